"""A cluster on this machine: the bits of one thread, whatever dies. What needs no cluster is in `test_farm.py`."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from conftest import SCENES

import steradian as sr

ray = pytest.importorskip("ray")
cluster_utils = pytest.importorskip("ray.cluster_utils")

SMALL = {"resolution": (24, 24), "seed": 2, "progress": False}
COMMAND = Path(sys.executable).parent / "steradian"


FAST = {"health_check_initial_delay_ms": 500, "health_check_period_ms": 500, "health_check_failure_threshold": 4}
"""So that the death of a node is noticed in two seconds rather than ten or more."""


class Nodes:
    """A head without processors, and three nodes with one each."""

    def __init__(self) -> None:
        self.cluster = cluster_utils.Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "_system_config": FAST})
        self.workers = [self.add() for _ in range(3)]
        self.address: str = self.cluster.address

    def add(self) -> Any:
        return self.cluster.add_node(num_cpus=1, object_store_memory=80 << 20)

    def replace_one(self) -> None:
        """Kills the oldest node without grace, and adds one (which Ray allows on the main thread alone)."""
        victim = self.workers.pop(0)
        killer = threading.Thread(target=lambda: self.cluster.remove_node(victim, allow_graceful=False))
        killer.start()
        self.workers.append(self.add())
        killer.join()


@pytest.fixture(scope="module")
def nodes() -> Iterator[Nodes]:
    nodes = Nodes()
    ray.init(address=nodes.address, log_to_driver=False)
    nodes.cluster.wait_for_nodes()
    yield nodes
    ray.shutdown()
    nodes.cluster.shutdown()


HOW: dict[str, dict[str, Any]] = {
    "path": {"spp": 120},
    "light": {"spp": 60},
    "bdpt": {"spp": 40},
    "sppm": {"spp": 24},
    "vcm": {"spp": 24},
    "guided": {"spp": 60},
    "mlt": {"spp": 24},
    "irradiance-cache": {"spp": 40, "rays": 64, "min_spacing": 8},
}


@pytest.mark.parametrize("integrator", HOW)
def test_a_node_dies_and_another_joins_and_the_bits_are_those_of_one_thread(nodes: Nodes, integrator: str) -> None:
    scene = sr.load(SCENES / "rough-glass.pbrt")
    how = {**SMALL, **HOW[integrator], "integrator": integrator}
    expected = sr.render(scene, threads=1, **how)
    events: list[dict[str, Any]] = []

    def on_progress(event: dict[str, Any]) -> None:
        events.append(dict(event))
        if event["event"] == "partial" and sum(e["event"] == "partial" for e in events) == 1:
            assert event["image"].spp < expected.spp, "a preview"
            nodes.replace_one()

    image = sr.cluster.render(
        scene, passes_per_task=max(1, expected.spp // 20), on_progress=on_progress, events="events.jsonl", **how
    )
    assert image.to_bytes() == expected.to_bytes()
    about = image.metadata
    assert sum(about["nodes"].values()) == expected.spp and len(about["nodes"]) >= 2
    assert about["retries"] == sum(e["event"] == "retry" for e in events) and not about["interrupted"]
    lines = [json.loads(line) for line in Path("events.jsonl").read_text().splitlines()]
    assert [e["event"] for e in lines] == [e["event"] for e in events] and lines[-1]["fraction"] == 1.0


def test_a_hanging_worker_costs_the_time_of_one_task(nodes: Nodes) -> None:
    scene = sr.load(SCENES / "small-lamp.pbrt")
    hanging: list[int] = []

    def on_progress(event: dict[str, Any]) -> None:
        if event["event"] == "partial" and not hanging:
            hanging.append(event["process"])
            os.kill(event["process"], signal.SIGSTOP)

    began = time.monotonic()
    try:
        image = sr.cluster.render(scene, spp=300, passes_per_task=10, on_progress=on_progress, **SMALL)
    finally:
        os.kill(hanging[0], signal.SIGCONT)
    assert image.metadata["duplicates"] >= 1 and time.monotonic() - began < 60
    assert image.to_bytes() == sr.render(scene, spp=300, threads=1, **SMALL).to_bytes()


def test_textures_travel_decoded_and_need_no_file(nodes: Nodes) -> None:
    shutil.copy(SCENES / "sky-image.pbrt", "sky-image.pbrt")
    shutil.copy(SCENES / "sky-image.pfm", "sky-image.pfm")
    scene = sr.load("sky-image.pbrt")
    expected = sr.render(scene, spp=4, threads=1, **SMALL)
    packed = scene._native.pack()
    assert b"STPIXEL1" in packed
    Path("there").mkdir()
    there = sr.Scene(_made=sr._native.Scene.unpack(packed, Path("there").resolve()))
    Path("sky-image.pfm").unlink()
    assert sr.render(there, spp=4, **SMALL).to_bytes() == expected.to_bytes()
    with pytest.raises(sr.SceneError, match="sky-image.pfm: No such file"):
        sr.cluster.render(scene, spp=4, **SMALL)
    shutil.copy(SCENES / "sky-image.pfm", "sky-image.pfm")
    assert sr.cluster.render(scene, spp=4, **SMALL).to_bytes() == expected.to_bytes()


def test_errors_are_sentences(nodes: Nodes, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = sr.load(SCENES / "small-lamp.pbrt")
    with pytest.raises(sr.ParameterError, match="there is no integrator `pth`"):
        sr.cluster.render(scene, integrator="pth", spp=2, progress=False)
    with pytest.raises(sr.ParameterError, match="has no time"):
        sr.cluster.render(scene, time=3)
    with pytest.raises(sr.FilmTooLargeError, match="a film of 1000000 x 200 pixels needs .* GiB of memory"):
        sr.cluster.render(scene, spp=2, resolution=(1000000, 200), progress=False)
    with pytest.raises(sr.SceneError, match="gone.pbrt"):
        sr.cluster.render("gone.pbrt", spp=2)
    part = sr.render(scene, spp=2, **SMALL).to_bytes()
    with pytest.raises(sr.FilmError, match="checksum"):
        sr.merge([part[:-40] + bytes([part[-40] ^ 1]) + part[-39:]])
    monkeypatch.setattr(sr._native, "__version__", "9.9.9")
    with pytest.raises(sr.ClusterError, match="a worker has version .* of steradian, and the driver has 9.9.9"):
        sr.cluster.render(scene, spp=2, **SMALL)


def test_stopped_it_gives_what_there_is(nodes: Nodes) -> None:
    scene = sr.load(SCENES / "small-lamp.pbrt")
    stop = {"on_progress": lambda e: e["event"] == "partial"}
    stopped = sr.cluster.render(scene, spp=64, passes_per_task=1, **stop, **SMALL)
    assert stopped.metadata["interrupted"] and 1 <= stopped.spp < 64


def test_batches_skip_what_is_there(nodes: Nodes) -> None:
    jobs = [{"seed": i} for i in range(3)]
    Path("out").mkdir()
    Path("out/0001.pfm").write_text("there already")
    how = {"spp": 2, "resolution": (8, 8), "progress": False}
    scene = sr.load(SCENES / "small-lamp.pbrt")
    paths = sr.cluster.render_many(jobs, "out", scene=scene, name="{:04}.pfm".format, **how)
    assert all(p.exists() for p in paths) and paths[1].read_text() == "there already"
    assert (sr.read(paths[2]) == sr.render(scene, seed=2, **how).array).all()


def run(*args: Any, **env: str) -> "subprocess.CompletedProcess[str]":
    line = [COMMAND, "render", SCENES / "small-lamp.pbrt", "--resolution", "24x24", "--seed", "2", *map(str, args)]
    return subprocess.run(line, capture_output=True, text=True, env={**os.environ, **env}, timeout=120)


def test_the_command_line_renders_on_a_cluster(nodes: Nodes) -> None:
    there = run("--cluster", nodes.address, "--spp", 30, "--partial", "c", "-o", "c.exr", "--events", "e", "--json")
    assert there.returncode == 0 and there.stderr == "", there.stderr
    here = run("--spp", 30, "--partial", "h", "-o", "h.exr", "--events", "eh", "--json")
    assert Path("c").read_bytes() == Path("h").read_bytes()
    assert Path("c.exr").read_bytes() == Path("h.exr").read_bytes()
    cluster, local = json.loads(there.stdout), json.loads(here.stdout)
    assert set(cluster) == {*local, "nodes", "retries"} and sum(cluster["nodes"].values()) == 30
    assert cluster["rays"] == local["rays"] and cluster["mean"] == local["mean"]
    last = [json.loads(Path(name).read_text().splitlines()[-1]) for name in ("e", "eh")]
    assert all(e["event"] == "end" and e["spp"] == 30 for e in last)


def test_ctrl_c_saves_what_the_cluster_has(nodes: Nodes) -> None:
    line = [COMMAND, "render", SCENES / "small-lamp.pbrt", "--resolution", "24x24", "--seed", "2", "--json"]
    line += ["--cluster", nodes.address, "--spp", "1000000", "--partial", "c", "--events", "e"]
    child = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 60
    while not (Path("e").exists() and '"partial"' in Path("e").read_text()):
        assert time.monotonic() < deadline and child.poll() is None
        time.sleep(0.1)
    child.send_signal(signal.SIGINT)
    out, _ = child.communicate(timeout=60)
    assert child.returncode == 130
    image = sr.Image.load("c")
    assert json.loads(out)["spp"] == image.spp > 0 and json.loads(out)["interrupted"]
    parts = [sr.render(SCENES / "small-lamp.pbrt", passes=p, **SMALL) for p in image._film.passes()]
    assert image.to_bytes() == sr.merge(parts).to_bytes()


def test_ray_starts_itself_on_this_machine() -> None:
    answer = run("--cluster", "local", "--spp", 4, "--partial", "c", "--quiet")
    assert answer.returncode == 0 and answer.stdout == "", answer.stderr
    assert sr.Image.load("c").to_bytes() == sr.render(SCENES / "small-lamp.pbrt", spp=4, **SMALL).to_bytes()


def test_a_wrong_address_is_told_in_seconds() -> None:
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        free = closed.getsockname()[1]
    began = time.monotonic()
    for address, words in [
        (f"127.0.0.1:{free}", "cannot reach a Ray cluster at 127.0.0.1"),
        (f"ray://127.0.0.1:{free}", "cannot reach a Ray cluster at ray://127.0.0.1"),
        ("nowhere.invalid:6379", "cannot reach a Ray cluster at nowhere.invalid:6379"),
        ("nonsense", "nonsense is no address of a cluster: expected HOST:PORT"),
    ]:
        answer = run("--cluster", address, "--spp", 2, "-o", "x.exr")
        assert answer.returncode == 2 and f"error: {words}" in answer.stderr, answer.stderr
        assert answer.stdout == "" and not Path("x.exr").exists()
    assert time.monotonic() - began < 40
