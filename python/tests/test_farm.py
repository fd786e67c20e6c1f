"""The driver of a cluster by itself, with a Ray that is not there: what it does when tasks are lost, slow, or many."""

import json
import os
import resource
import signal
import types
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT, SCENES

import steradian as sr
from steradian import _farm, _worker

SMALL = {"resolution": (8, 8), "seed": 2, "progress": False}


class RayError(Exception):
    """As Ray's."""


class Ref:
    """Stands for what a task gives."""


class FakeRay:
    """Runs tasks in this process, when somebody waits for them: the one that `choose` says. `fail` names how a task is lost."""

    def __init__(self) -> None:
        names = ["RayTaskError", "WorkerCrashedError", "NodeDiedError", "OutOfMemoryError", "ObjectLostError"]
        kinds = {name: type(name, (RayError,), {}) for name in names}
        self.exceptions = types.SimpleNamespace(RayError=RayError, **kinds)
        self.cpus = [1, 1]
        self.choose: Callable[[list[Ref]], Ref] = lambda refs: refs[0]
        self.fail: Callable[[str], str | None] = lambda name: None
        self.values: dict[Ref, Any] = {}
        self.tasks: dict[Ref, Callable[[], None]] = {}
        self.log: list[tuple[str, Any]] = []
        self.most_waiting = 0

    def nodes(self) -> list[dict[str, Any]]:
        return [{"Alive": True, "NodeID": f"n{i}", "Resources": {"CPU": c}} for i, c in enumerate(self.cpus)]

    def put(self, value: Any) -> Ref:
        ref = Ref()
        self.values[ref] = value
        return ref

    def remote(self, function: Callable[..., Any]) -> Any:
        return types.SimpleNamespace(options=lambda **o: types.SimpleNamespace(remote=self._starter(function, **o)))

    def _starter(self, function: Callable[..., Any], num_returns: int = 1, **_: Any) -> Callable[..., Any]:
        def start(*args: Any) -> Any:
            refs = [Ref() for _ in range(num_returns)]
            self.log.append((function.__name__, args))

            def run() -> None:
                given = [self.value(a) if isinstance(a, Ref) else a for a in args]
                error = next((g for g in given if isinstance(g, RayError)), None)
                name = self.fail(function.__name__)
                if name is not None:
                    error = getattr(self.exceptions, name)("lost")
                result = error if error is not None else function(*given)
                results = [result] * num_returns if error is not None or num_returns == 1 else list(result)
                self.values.update(zip(refs, results, strict=True))

            self.tasks.update(dict.fromkeys(refs, run))
            return refs[0] if num_returns == 1 else refs

        return start

    def value(self, ref: Ref) -> Any:
        if ref not in self.values:
            self.tasks.pop(ref)()
        return self.values[ref]

    def wait(self, refs: list[Ref], timeout: float | None = None, **_: Any) -> tuple[list[Ref], list[Ref]]:
        if timeout != 0:
            self.value(self.choose(refs))
            self.most_waiting = max(self.most_waiting, len(refs))
        return [r for r in refs if r in self.values], [r for r in refs if r not in self.values]

    def get(self, refs: Any) -> Any:
        if isinstance(refs, list):
            return [self.get(r) for r in refs]
        value = self.value(refs)
        if isinstance(value, RayError):
            raise value
        return value

    def cancel(self, ref: Ref, force: bool) -> None:
        pass


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> FakeRay:
    ray = FakeRay()
    monkeypatch.setattr(sr.cluster, "connect", lambda address=None: ray)
    monkeypatch.setattr(_worker, "where", lambda: {"node": "n0", "process": os.getpid()})
    return ray


def one(**how: Any) -> bytes:
    return sr.render(SCENES / "small-lamp.pbrt", threads=1, **{**SMALL, **how}).to_bytes()


def many(**how: Any) -> sr.Image:
    return sr.cluster.render(SCENES / "small-lamp.pbrt", **{**SMALL, **how})


def test_the_driver_holds_no_more_than_two_results_for_each_processor(fake: FakeRay) -> None:
    image = many(spp=200, passes_per_task=1)
    assert image.to_bytes() == one(spp=200)
    assert fake.most_waiting <= 4


def test_results_in_any_order_and_through_a_merge_tree_give_the_same_bits(
    fake: FakeRay, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_farm, "tree", lambda slots: (2, 3))
    fake.choose = lambda refs: refs[len(fake.log) % len(refs)]
    for fan_in in [1, 2, 3, 7, None]:
        for integrator in ["path", "light", "guided", "irradiance-cache"]:
            image = many(integrator=integrator, spp=20, passes_per_task=1, fan_in=fan_in)
            assert image.to_bytes() == one(integrator=integrator, spp=20), (fan_in, integrator)
            assert image.metadata["nodes"] == {"n0": 20} and image.metadata["rays"] > 0
    assert Counter(name for name, _ in fake.log)["merged"] > 20


def test_tasks_are_as_long_as_it_pays(fake: FakeRay) -> None:
    assert _farm.chunk(10**6, 10**6, 16, 0.0, 0.0) == 4, "to see how long a pass takes"
    assert _farm.chunk(1024, 1024, 16, 1.0, 0.0) == 8, "eight tasks each"
    assert _farm.chunk(1024, 96, 16, 1.0, 0.0) == 3, "shorter ones at the end"
    assert _farm.chunk(10**6, 10**6, 4, 0.1, 0.0) == 600, "a minute"
    assert _farm.chunk(1000, 1000, 4, 1e-3, 0.0) == 250, "no dust, but one for each"
    assert _farm.chunk(1024, 1024, 16, 0.5, 0.01) == 10, "a film costs a hundredth of its task"
    assert _farm.chunk(1024, 1024, 16, 0.5, 0.3) == 32, "or all slots have half of what is left"
    assert _farm.chunk(1024, 40, 16, 0.5, 0.03) == 2, "at the end it costs a tenth at most"
    assert _farm.chunk(100, 1, 64, 5.0, 0.0) == 1
    assert [_farm.tree(n) for n in (64, 65, 5000)] == [(1, 0), (16, 1), (16, 2)]


def test_what_is_lost_runs_again_however_often_nodes_die(fake: FakeRay) -> None:
    failing = iter(["NodeDiedError"] * 300 + ["WorkerCrashedError", "ObjectLostError", "OutOfMemoryError"])
    fake.fail = lambda name: next(failing, None)
    image = many(integrator="guided", spp=6, passes_per_task=2)
    assert image.to_bytes() == one(integrator="guided", spp=6)
    assert image.metadata["retries"] >= 200


@pytest.mark.parametrize("fan_in", [1, 3])
def test_losses_now_and_then_cost_time_alone(fake: FakeRay, fan_in: int) -> None:
    count = iter(range(10**6))
    fake.fail = lambda name: "WorkerCrashedError" if next(count) % 3 == 1 else None
    image = many(spp=90, passes_per_task=1, fan_in=fan_in)
    assert image.to_bytes() == one(spp=90)
    assert image.metadata["retries"] >= 30 and sum(image.metadata["nodes"].values()) == 90


def test_a_cluster_on_which_nothing_works_is_given_up_with_a_sentence(fake: FakeRay) -> None:
    fake.fail = lambda name: "OutOfMemoryError"
    with pytest.raises(sr.ClusterError, match="17 tasks in a row ended their workers, .* too little memory"):
        many(spp=8)


def test_workers_errors_are_told_as_sentences(fake: FakeRay) -> None:
    lost = fake.exceptions.RayTaskError("...\nModuleNotFoundError: No module named 'steradian._worker'")
    assert "a worker has no steradian: pip install" in str(_farm._as_ours(lost))
    lost.cause = MemoryError()
    assert "too little memory" in str(_farm._as_ours(lost))
    lost.cause = sr.FilmTooLargeError("a film of 9 x 9 pixels")
    assert _farm._as_ours(lost) is lost.cause


def test_the_slow_run_twice_and_only_one_counts(fake: FakeRay, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_farm, "_SHORTEST_TASK", 0.0)
    first: list[Any] = []

    def choose(refs: list[Any]) -> Any:
        # The first task that began is never done before all others are.
        first.append(refs[0])
        return next((r for r in refs if r != first[0]), refs[0])

    fake.choose = choose
    told: list[Any] = []
    image = many(spp=12, passes_per_task=1, on_progress=lambda e: told.append(dict(e)) and None)
    assert image.to_bytes() == one(spp=12)
    assert image.metadata["duplicates"] == 1 and image.metadata["retries"] == 0
    assert [e["passes"] for e in told if e["event"] == "duplicate"] == [[0, 1]]
    assert sum(image.metadata["nodes"].values()) == 12, "the second result is not counted"

    # Both at once: the wait gives two results of the same passes.
    def both(refs: list[Any]) -> Any:
        if len(refs) == 2:
            fake.value(refs[0])
        return refs[-1]

    fake.choose = both
    assert many(spp=12, passes_per_task=1).to_bytes() == one(spp=12)


def test_frames_overlap_and_scenes_travel_once(fake: FakeRay, tmp_path: Path) -> None:
    scene = sr.load(SCENES / "small-lamp.pbrt")
    cameras = [scene.camera.replace(fov=f) for f in (30.0, 40.0, 50.0)]
    fake.choose = lambda refs: refs[-1]
    events: list[Any] = []
    paths = sr.cluster.render_many(
        [{"camera": c} for c in cameras],
        "frames",
        scene=scene,
        spp=6,
        passes_per_task=2,
        on_progress=lambda e: events.append(dict(e)) and None,
        **SMALL,
    )
    for path, camera in zip(paths, cameras, strict=True):
        mine = sr.load(SCENES / "small-lamp.pbrt")
        mine.camera = camera
        assert (sr.read(path) == sr.render(mine, spp=6, **SMALL).array).all()
    order = [(e["event"], Path(e["picture"]).name) for e in events if "picture" in e]
    assert order.index(("start", "0001.exr")) < order.index(("end", "0000.exr")), "the second begins before the first ends"
    packs = {args[0] for name, args in fake.log if name == "cell"}
    assert len(packs) == 1, "one scene, however many cameras"


def test_a_batch_goes_on_in_the_middle_of_a_picture(fake: FakeRay) -> None:
    jobs = [{"seed": i} for i in range(4)]
    how = {**SMALL, "scene": SCENES / "small-lamp.pbrt", "spp": 8, "passes_per_task": 1, "name": "{:04}.pfm".format}
    del how["seed"]
    done = iter(range(100))
    with pytest.raises(KeyboardInterrupt):

        def stop(event: dict[str, Any]) -> None:
            if event["event"] == "partial" and next(done) == 12:
                raise KeyboardInterrupt

        sr.cluster.render_many(jobs, "out", on_progress=stop, **how)
    assert Path("out/0000.pfm").exists() and not Path("out/0003.pfm").exists()
    begun = list(Path("out").glob("*.partial"))
    assert begun, "what was begun is kept"
    resumed = []
    paths = sr.cluster.render_many(
        jobs, "out", on_progress=lambda e: resumed.append(e.get("resumed", 0)) and None, **how
    )
    assert max(resumed) > 0 and len(paths) == 4 and not list(Path("out").glob("*.partial"))
    for i, path in enumerate(paths):
        expected = sr.render(SCENES / "small-lamp.pbrt", spp=8, **{**SMALL, "seed": i})
        assert (sr.read(path) == expected.array).all()


def test_a_driver_that_died_goes_on_from_its_checkpoint(fake: FakeRay) -> None:
    how = {"integrator": "guided", "passes_per_task": 1, "checkpoint": "c.partial", "resume": True}
    half = many(spp=10, **how)
    assert half.metadata["passes_resumed"] == 0 and Path("c.partial").exists()
    whole = many(spp=20, **how)
    assert whole.metadata["passes_resumed"] == 10
    assert whole.to_bytes() == one(integrator="guided", spp=20) == Path("c.partial").read_bytes()
    with pytest.raises(sr.ResumeError, match="c.partial cannot be resumed: .*integrators"):
        many(spp=30, **{**how, "integrator": "path"})
    with pytest.raises(sr.ResumeError, match="another scene"):
        sr.cluster.render(SCENES / "large-lamp.pbrt", spp=30, **SMALL, **how)
    assert Path("c.partial").read_bytes() == whole.to_bytes(), "and it is as it was"


def test_a_full_disk_costs_the_checkpoint_alone(fake: FakeRay) -> None:
    half = many(spp=4, checkpoint="c.partial")
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    before = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    told: list[Any] = []
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
        image = many(
            spp=8,
            checkpoint="c.partial",
            resume=True,
            on_progress=lambda e: told.append(dict(e)) and None,
        )
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
        signal.signal(signal.SIGXFSZ, before)
    assert image.to_bytes() == one(spp=8) and "File too large" in image.metadata["checkpoint_error"]
    assert any("the render goes on" in e["message"] for e in told if e["event"] == "warning")
    assert Path("c.partial").read_bytes() == half.to_bytes(), "the old one is as it was"


def test_events_are_as_the_guide_says(fake: FakeRay) -> None:
    guide = (ROOT / "docs/guide/farms.md").read_text().split("### Of a render on a cluster")[1]
    table = [line.split("|")[1:-1] for line in guide.splitlines() if line.startswith("| `")]
    fields = {row[0].strip(" `"): {f.strip(" `") for f in row[2].split(",")} for row in table}
    failing = iter([None, "WorkerCrashedError"])
    fake.fail = lambda name: next(failing, None)
    heard: list[Any] = []
    many(
        spp=6,
        passes_per_task=1,
        events="events.jsonl",
        checkpoint="c.partial",
        checkpoint_every=0.0,
        on_progress=lambda e: heard.append(dict(e)) and None,
    )
    lines = [json.loads(line) for line in Path("events.jsonl").read_text().splitlines()]
    assert lines == json.loads(json.dumps(heard)), "the file has what the callback hears"
    kinds = {e["event"] for e in lines}
    assert {"nodes", "start", "partial", "retry", "end", "checkpoint"} <= kinds
    common = {"event", "elapsed_seconds", "fraction", "retries"}
    for e in lines:
        assert set(e) - common == fields[e["event"]] - {"picture"}, e
