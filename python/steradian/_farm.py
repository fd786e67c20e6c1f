"""The driver's side of renders on a cluster: which task is next, what came of it, and what to do when something is lost.

Tasks are pure and films add exactly, so that nothing here can be seen in a picture: not the order of results, nor retries, nor
tasks that ran twice. All waiting for Ray happens in `Farm.run`.
"""

from __future__ import annotations

import json
import os
import statistics
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native, _worker
from ._image import Image
from ._scene import Scene
from .errors import ClusterError, FilmError, OutputError, ResumeError, SceneError, SteradianError, _warn

Progress = Callable[[dict[str, Any]], "bool | None"]
Range = tuple[int, int]

_LONGEST_TASK = 60.0
"""Seconds that a task should take at most: what the loss of a processor costs."""
_SHORTEST_TASK = 0.5
"""Seconds below which starting a task costs more than it spreads."""
_FIRST = 4
"""Passes of a task while nothing is known of how long they take."""
_FILM_COST = 5.0
"""What a film costs in all (packing, the way through Ray's stores, adding), in packings: measured, see docs/scale.md."""
_FILM_SHARE = 0.01
"""Share of a task's time that its film should cost at most while there is enough to do, and ten times that at the end."""
_BEAT = 1.0
"""Seconds between looks at the cluster, and between events of progress."""
_SLOW = 1.5
"""A task that takes so many times as long as the median is run a second time, once nothing else is left to do."""
_COUNTED = ("rays", "camera_paths", "light_paths", "render_seconds")


@dataclass(eq=False)
class Picture:
    """A picture to be rendered."""

    scene: Scene
    how: Mapping[str, Any]
    """As for `steradian.render`."""
    passes: Range
    camera: str | None = None
    """Instead of the scene's, as JSON."""
    checkpoint: Path | None = None
    resume: bool = False
    path: Path | None = None
    """Where it is saved when it is done."""

    film: _native.Sum = field(default_factory=_native.Sum)
    todo: list[Range] = field(default_factory=list)
    """Passes that no task has, ascending."""
    out: set[Range] = field(default_factory=set)
    """Passes that tasks have, or that wait to be merged."""
    rounds: list[tuple[int, int]] | None = None
    """Rounds and their first passes; `None`: not known yet."""
    nodes: dict[str, int] = field(default_factory=dict)
    report: dict[str, Any] = field(default_factory=dict)
    retries: int = 0
    duplicates: int = 0
    resumed: int = 0
    saved: float = 0.0
    """When the checkpoint was written, and the passes in it."""
    kept: int = 0
    work: _worker.Work | None = None
    """What its tasks share."""

    @property
    def done(self) -> int:
        """Passes in the film."""
        return sum(b - a for a, b in self.film.passes())

    def begin(self) -> None:
        """Takes over the checkpoint, and knows what is left."""
        if self.checkpoint is not None and self.resume and self.checkpoint.exists():
            try:
                known = _native.Film.load(self.checkpoint)
                seen = _worker.of(self.scene, self.camera, self.how, 1).seen
                if known.info()["scene_hash"] != seen:
                    raise FilmError("it is a film of another scene")
                self.film.add(known.to_array())
            except FilmError as e:
                raise ResumeError(f"{self.checkpoint} cannot be resumed: {e}") from None
            self.resumed = self.kept = self.done
        self.todo = _without(self.passes, self.film.passes())
        self.saved = time.monotonic()

    def take(self, most: int) -> Range | None:
        """The next passes for a task, none of two rounds."""
        if not self.todo:
            return None
        a, b = self.todo[0]
        ends = [first for _, first in self.rounds or () if a < first < b]
        end = min([a + most, b, *ends])
        self.todo[0:1] = [(end, b)] if end < b else []
        self.out.add((a, end))
        return a, end

    def give_back(self, passes: Range) -> None:
        """A task is lost: others take its passes."""
        if passes in self.out:
            self.out.remove(passes)
            self.todo.insert(0, passes)
            self.retries += 1

    def first_of_round(self, a_pass: int) -> int | None:
        """The first pass of the round that a pass reads."""
        firsts = [first for _, first in self.rounds or () if first <= a_pass]
        return firsts[-1] if firsts else None

    def image(self) -> Image | None:
        """What there is of it."""
        film = self.film.film()
        return None if film is None else Image(film, self.report, self.scene)


@dataclass(eq=False)
class _Task:
    """A task on its way."""

    picture: Picture
    passes: list[Range]
    """More than one if it merges, none if it plans."""
    data: Any = None
    """Reference of the film, of a task that renders."""
    told: list[dict[str, Any]] = field(default_factory=list)
    """About the films that it merges."""
    film: Any = None
    """Reference of what it gave, while that waits to be merged."""
    level: int = 0
    """In the merge tree; 0: it renders."""
    since: float = field(default_factory=time.monotonic)

    @property
    def plans(self) -> bool:
        return not self.passes

    @property
    def merges(self) -> bool:
        return bool(self.passes) and self.data is None


class Event(dict[str, Any]):
    """What happened; ``event["image"]`` is made when it is asked for."""

    picture: Picture | None = None

    def __missing__(self, key: str) -> Any:
        if key != "image" or self.picture is None:
            raise KeyError(key)
        self[key] = self.picture.image()
        return self[key]


class Farm:
    """Renders pictures on a cluster, as many at a time as it takes to keep it busy."""

    def __init__(
        self,
        ray: Any,
        pictures: Iterator[Picture],
        *,
        passes_per_task: int | None = None,
        cpus_per_task: int | None = None,
        fan_in: int | None = None,
        on_progress: Progress | None = None,
        events: str | os.PathLike[str] | None = None,
        checkpoint_every: float = 30.0,
        on_done: Callable[[Picture], None] | None = None,
    ) -> None:
        self._ray, self._pictures = ray, pictures
        self._passes_per_task, self._cpus, self._fan_in = passes_per_task, cpus_per_task, fan_in
        self._on_progress = on_progress
        self._events = None if events is None else Path(events)
        self._every = checkpoint_every
        self._on_done = on_done
        self._open: list[Picture] = []
        self._running: dict[Any, _Task] = {}
        self._unmerged: list[_Task] = []
        self._functions: dict[Any, Any] = {}
        self._packed: dict[str, Any] = {}
        self._learned: dict[tuple[int, int], tuple[Any, Any]] = {}
        self._per_pass: dict[int, tuple[float, float]] = {}
        self._seconds: list[float] = []
        self._nodes: set[str] = set()
        self._slots, self._per_node = 1, [1]
        self._crashes = 0
        self._start = self._beat = time.monotonic()
        self._stopped = False
        self._warned: set[str] = set()
        self.most_in_flight = 0
        """Tasks that were on their way at once, at most: a bound on what waits for the driver."""

    @property
    def stopped(self) -> bool:
        """Did somebody stop it before it was done?"""
        return self._stopped

    @property
    def elapsed(self) -> float:
        """Seconds since it began."""
        return time.monotonic() - self._start

    def run(self) -> None:
        """Renders all pictures, or until somebody stops it; Ctrl-C goes on to the caller when all that can be saved is."""
        try:
            self._look()
            while not self._stopped and self._submit():
                self._collect()
        except KeyboardInterrupt:
            self._stopped = True
            raise
        finally:
            for ref in self._running:
                self._ray.cancel(ref, force=False)
            for picture in self._open:
                self._save(picture)
                self._tell("end", picture, spp=picture.done, interrupted=True)

    # What is next.

    def _submit(self) -> bool:
        """Keeps the cluster busy; False when all is done."""
        while len(self._running) < 2 * self._slots:
            picture = self._ready()
            if picture is None:
                break
            if picture.rounds is None:
                self._plan(picture)
                continue
            passes = picture.take(self._chunk(picture))
            assert passes is not None
            self._render(picture, passes)
        if not self._running and not self._open:
            return False
        self._run_slow_ones_twice()
        self._merge_in_tasks()
        self.most_in_flight = max(self.most_in_flight, len(self._running))
        return True

    def _ready(self) -> Picture | None:
        """A picture that has work, the earliest first."""
        planned = {id(t.picture) for t in self._running.values() if t.plans}
        for known in self._open:
            if (known.rounds is None or known.todo) and id(known) not in planned:
                return known
        for picture in self._pictures:
            picture.begin()
            self._open.append(picture)
            self._tell(
                "start",
                picture,
                slots=self._slots,
                scene_hash=picture.scene.content_hash,
                passes=list(picture.passes),
                resumed=picture.resumed,
            )
            if picture.todo:
                picture.rounds = None if _learns(picture) else []
                self._widen(picture)
                return picture
            picture.rounds = []
            self._finish(picture)
        return None

    def _widen(self, picture: Picture) -> None:
        """Are there too few passes for all processors? Then each task gets several."""
        if self._cpus is None:
            a, b = picture.passes
            total, fewest = sum(self._per_node), min(self._per_node)
            self._cpus = min(fewest, max(1, -(-2 * total // (b - a))))
            self._slots = max(1, sum(c // self._cpus for c in self._per_node))

    def _chunk(self, picture: Picture) -> int:
        if self._passes_per_task is not None:
            return self._passes_per_task
        left = sum(b - a for a, b in picture.todo)
        per_pass, packing = self._per_pass.get(id(picture), (0.0, 0.0))
        return chunk(picture.passes[1] - picture.passes[0], left, self._slots, per_pass, packing)

    def _common(self, picture: Picture) -> tuple[Any, _worker.Work]:
        """The scene's reference, put once for all pictures that it is in; and what tasks share."""
        work = picture.work
        if work is None:
            work = picture.work = _worker.of(picture.scene, picture.camera, picture.how, self._cpus or 1)
        if work.content not in self._packed:
            kept = {p.scene.content_hash for p in self._open}
            self._packed = {c: ref for c, ref in self._packed.items() if c in kept}
            self._packed[work.content] = self._ray.put(picture.scene._native.pack())
        return self._packed[work.content], work

    def _remote(self, function: Callable[..., Any], returns: int = 1, **options: Any) -> Any:
        # Ray does not run renders again by itself: we hear of every loss, and do it.
        options = {"num_cpus": self._cpus or 1, "max_retries": 0, "num_returns": returns, **options}
        if function not in self._functions:
            self._functions[function] = self._ray.remote(function)
        return self._functions[function].options(**options)

    def _plan(self, picture: Picture) -> None:
        ref = self._remote(_worker.plan).remote(*self._common(picture), picture.passes)
        self._running[ref] = _Task(picture, [])

    def _render(self, picture: Picture, passes: Range) -> None:
        told, data = self._remote(_worker.cell, 2).remote(
            *self._common(picture), passes, self._learned_for(picture, passes[0])
        )
        self._running[told] = _Task(picture, [passes], data)

    def _learned_for(self, picture: Picture, a_pass: int) -> Any:
        """Reference of what the pass's round has learned, on from the rounds before: made once, broadcast by the object store."""
        first = picture.first_of_round(a_pass)
        if first is None:
            return None
        known = [f for p, f in self._learned if p == id(picture) and f <= first]
        before = self._learned[id(picture), max(known)][0] if known else None
        if first in known:
            return before
        # Ray makes it again if all nodes that have it are lost.
        made = self._remote(_worker.learn, 2, max_retries=8).remote(*self._common(picture), first, before)
        self._learned[id(picture), first] = made
        return made[0]

    def _run_slow_ones_twice(self) -> None:
        """Nothing is left to begin, and processors are idle: what takes long runs elsewhere too, and the first result counts."""
        cells = [t for t in self._running.values() if t.data is not None]
        if any(p.todo for p in self._open) or len(cells) >= self._slots or len(self._seconds) < 3:
            return
        now, limit = time.monotonic(), _SLOW * statistics.median(self._seconds) + _SHORTEST_TASK
        for task in sorted(cells, key=lambda t: t.since)[: self._slots - len(cells)]:
            (passes,) = task.passes
            twice = sum(t.passes == task.passes and t.picture is task.picture for t in cells) > 1
            if not twice and now - task.since > limit:
                task.picture.duplicates += 1
                self._tell("duplicate", task.picture, passes=list(passes), seconds=now - task.since)
                self._render(task.picture, passes)

    @property
    def _tree(self) -> tuple[int, int]:
        return tree(self._slots) if self._fan_in is None else (self._fan_in, int(self._fan_in > 1))

    def _merge_in_tasks(self) -> None:
        """On large clusters, films become fewer on their way to the driver."""
        fan_in, levels = self._tree
        for picture in list(self._open) if self._unmerged else ():
            rendering = any(t.data is not None and t.picture is picture for t in self._running.values())
            is_last = not picture.todo and not rendering
            for level in [0] if is_last else range(max(levels, 1)):
                mine = [t for t in self._unmerged if t.picture is picture and (is_last or t.level == level)]
                if len(mine) < (1 if is_last else fan_in):
                    continue
                for i in range(0, len(mine), max(fan_in, 2)):
                    some = mine[i : i + max(fan_in, 2)]
                    ref = self._remote(_worker.merged, num_cpus=0).remote(*(t.film for t in some))
                    passes, told = [r for t in some for r in t.passes], [about for t in some for about in t.told]
                    self._running[ref] = _Task(picture, passes, told=told, level=levels if is_last else level + 1)
                self._unmerged = [t for t in self._unmerged if t not in mine]

    # What came of it.

    def _collect(self) -> None:
        if self._running:
            done, _ = self._ray.wait(list(self._running), num_returns=1, timeout=_BEAT, fetch_local=False)
            for ref in done:
                task = self._running.pop(ref, None)
                if task is not None:
                    self._take(ref, task)
        if time.monotonic() - self._beat >= _BEAT:
            self._beat = time.monotonic()
            self._look()
            for picture in self._open:
                self._progress(picture)
                if time.monotonic() - picture.saved >= self._every:
                    self._save(picture)
        for picture in list(self._open):
            if picture.rounds is not None and not picture.todo and not picture.out:
                self._finish(picture)

    def _take(self, ref: Any, task: _Task) -> None:
        picture = task.picture
        if not task.plans and not task.merges and task.passes[0] not in picture.out:
            return  # Another one was first.
        try:
            if task.plans:
                picture.rounds = _of(picture.passes, self._ray.get(ref))
            elif task.merges and task.level < self._tree[1]:
                self._keep(task, ref)
            elif task.merges:
                self._add(task, self._ray.get(ref))
            elif self._tree[1] > 0:
                told = self._ray.get(ref)
                self._hear(task, told)
                task.told = [told]
                self._keep(task, task.data)
            else:
                told, data = self._ray.get([ref, task.data])
                self._hear(task, told)
                task.told = [told]
                self._add(task, data)
            self._crashes = 0
        except self._ray.exceptions.RayTaskError as e:
            raise _as_ours(e) from None
        except self._ray.exceptions.RayError as e:
            self._lose(task, e)

    def _keep(self, task: _Task, film: Any) -> None:
        """A film stays where it is until a task merges it with others."""
        self._unmerged.append(_Task(task.picture, task.passes, film=film, told=task.told, level=task.level))

    def _hear(self, task: _Task, told: dict[str, Any]) -> None:
        """A task is done: how long it took, what it warns of; its duplicate is no longer needed."""
        picture, (passes,) = task.picture, task.passes
        for ref, other in list(self._running.items()):
            if other.picture is picture and other.passes == task.passes and other.data is not None:
                del self._running[ref]
                self._ray.cancel(ref, force=False)
        n = passes[1] - passes[0]
        self._per_pass[id(picture)] = told["render_seconds"] / n, told["packing_seconds"]
        self._seconds = [*self._seconds[-99:], told["seconds"]]
        for text in told["warnings"]:
            if picture.scene._strict:
                raise SceneError(text.replace("warning: ", "error: ", 1))
            if text not in self._warned:
                self._warned.add(text)
                self._tell("scene_warning", picture, message=text)
                _warn([text])
        for text in told["said"]:
            if text not in self._warned:
                self._warned.add(text)
                self._tell("warning", picture, message=text)

    def _add(self, task: _Task, data: NDArray[np.uint8]) -> None:
        """Adds a film, and what is known of its passes."""
        picture = task.picture
        try:
            picture.film.add(data)
        except FilmError as e:
            if picture.resumed:
                raise ResumeError(f"{picture.checkpoint} cannot be resumed: {e}") from None
            raise
        for passes, told in zip(task.passes, task.told, strict=True):
            picture.out.discard(passes)
            node, report = told["node"], picture.report
            picture.nodes[node] = picture.nodes.get(node, 0) + passes[1] - passes[0]
            for name in _COUNTED:
                report[name] = report.get(name, 0) + told[name]
            report["load_seconds"] = max(report.get("load_seconds", 0.0), told["load_seconds"])
            report["threads"] = told["threads"]
            about = {name: told[name] for name in ("node", "process", "seconds")}
            self._tell("partial", picture, passes=list(passes), **about)

    def _lose(self, task: _Task, e: Exception) -> None:
        """A worker or a node is gone, or what it made: its passes wait again. Only a cluster on which nothing works any more,
        where task after task ends its worker and none is done in between, is given up."""
        why = type(e).__name__
        if task.plans:
            task.picture.retries += 1
            self._tell("retry", task.picture, passes=list(task.picture.passes), reason=why)
        for passes in task.passes:
            twin = any(
                t.data is not None and t.picture is task.picture and t.passes == [passes] for t in self._running.values()
            )
            if not twin:
                task.picture.give_back(passes)
            self._tell("retry", task.picture, passes=list(passes), reason=why)
        # What was learned may be what is lost: then it is learned again.
        for key, (_, rays) in list(self._learned.items()):
            if key[0] == id(task.picture) and ("Object" in why or self._is_lost(rays)):
                del self._learned[key]
        if why != "NodeDiedError":
            self._crashes += 1
        if self._crashes > max(16, 4 * self._slots):
            memory = "; they had too little memory" if why == "OutOfMemoryError" else ""
            raise ClusterError(
                f"{self._crashes} tasks in a row ended their workers, and none was done in between{memory} "
                f"({why}: {str(e).splitlines()[0] if str(e) else 'no reason given'})"
            )

    def _is_lost(self, ref: Any) -> bool:
        ready, _ = self._ray.wait([ref], num_returns=1, timeout=0)
        try:
            self._ray.get(ready)
        except self._ray.exceptions.RayError:
            return True
        return False

    # Beside the work.

    def _look(self) -> None:
        """Which nodes there are."""
        alive = [n for n in self._ray.nodes() if n["Alive"]]
        cpus = [int(n["Resources"].get("CPU", 0)) for n in alive]
        self._per_node = cpus = [c for c in cpus if c > 0] or [1]
        self._slots = max(1, sum(c // (self._cpus or 1) for c in cpus))
        nodes = {n["NodeID"] for n in alive if n["Resources"].get("CPU", 0) > 0}
        if nodes != self._nodes:
            joined, left = sorted(nodes - self._nodes), sorted(self._nodes - nodes)
            self._nodes = nodes
            self._tell("nodes", None, joined=joined, left=left, nodes=len(nodes), processors=sum(cpus))

    def _progress(self, picture: Picture) -> None:
        done, (a, b) = picture.done, picture.passes
        elapsed, fresh = self.elapsed, done - picture.resumed
        left = elapsed * (b - a - done) / fresh if fresh > 0 else None
        self._tell(
            "progress",
            picture,
            passes=done,
            of_passes=b - a,
            remaining_seconds=left,
            running=len(self._running),
            waiting=sum(d - c for c, d in picture.todo),
            **{name: picture.report.get(name, 0) for name in _COUNTED[:3]},
        )

    def _save(self, picture: Picture) -> None:
        picture.saved = time.monotonic()
        if picture.checkpoint is not None and picture.done != picture.kept:
            try:
                picture.film.save(picture.checkpoint)
            except OutputError as e:
                # The render is worth more than its checkpoint; the old one is as it was.
                picture.report["checkpoint_error"] = str(e)
                self._tell("warning", picture, message=f"{e}; the render goes on")
                return
            picture.report.pop("checkpoint_error", None)
            picture.kept = picture.done
            self._tell("checkpoint", picture, path=str(picture.checkpoint), passes=picture.done)

    def _finish(self, picture: Picture) -> None:
        self._open.remove(picture)
        self._learned = {k: v for k, v in self._learned.items() if k[0] != id(picture)}
        picture.report.update(
            interrupted=False, nodes=dict(picture.nodes), retries=picture.retries, passes_resumed=picture.resumed
        )
        if picture.path is None:
            self._save(picture)
        if self._on_done is not None:
            self._on_done(picture)
        self._tell("end", picture, spp=picture.done, interrupted=False)

    def _tell(self, event: str, picture: Picture | None, **about: Any) -> None:
        told = Event(event=event, elapsed_seconds=self.elapsed)
        if picture is not None:
            told.picture = picture
            if picture.path is not None:
                told["picture"] = str(picture.path)
            told["fraction"] = picture.done / (picture.passes[1] - picture.passes[0])
            told["retries"] = picture.retries
        told.update(about)
        if self._events is not None:
            try:
                with self._events.open("a") as file:
                    file.write(json.dumps(told) + "\n")
            except OSError as e:
                warnings.warn(f"events are no longer written: {e}", stacklevel=2)
                self._events = None
        if self._on_progress is not None and self._on_progress(told):
            self._stopped = True


def chunk(passes: int, left: int, slots: int, per_pass: float, packing: float) -> int:
    """Passes for the next task: about eight tasks for each of the `slots` that run at a time, or fewer where a film costs more
    than its share of such a task; then shorter ones so that all end at once (half of what is left for all slots together: factoring,
    Hummel, Schonberg and Flynn 1992); none that takes too long, or too short a time for its start and its film, as long as there
    is one for each. `per_pass` is 0 while that is not known; it and the `packing` of a film in seconds.
    """
    half = left // (2 * slots)
    eighth = max(1, min(passes // (8 * slots), half))
    if per_pass == 0.0:
        return min(eighth, _FIRST)
    film = _FILM_COST * packing / _FILM_SHARE
    worth = min(int(film / per_pass), half)
    least = min(int(max(_SHORTEST_TASK, film / 10) / per_pass), left // slots)
    return min(max(eighth, worth, least), max(1, int(_LONGEST_TASK / per_pass)))


def tree(slots: int) -> tuple[int, int]:
    """Films that a task merges on their way to the driver, and how often: nothing up to 64 tasks at a time, then by 16, beyond
    1024 twice."""
    return (1, 0) if slots <= 64 else (16, 1) if slots <= 1024 else (16, 2)


def _learns(picture: Picture) -> bool:
    from ._api import integrators

    name = picture.how.get("integrator") or json.loads(picture.scene._native.get_one("integrator"))["name"]
    known = integrators().get(name)
    return known is not None and bool(known["learns"])


def _of(passes: Range, rounds: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The rounds that these passes read, the first from the first of them."""
    before = [r for r in rounds if r[1] <= passes[0]]
    after = [r for r in rounds if r[1] > passes[0]]
    return [(before[-1][0], passes[0]), *after] if before else after


def _without(wanted: Range, present: list[Range]) -> list[Range]:
    left, start = [], wanted[0]
    for a, b in present:
        left.append((start, min(a, wanted[1])))
        start = max(start, b)
    left.append((start, wanted[1]))
    return [(a, b) for a, b in left if a < b]


def _as_ours(e: Any) -> Exception:
    """A worker's exception as the driver raises it."""
    cause = getattr(e, "cause", None)
    if isinstance(cause, SteradianError):
        return cause
    if isinstance(cause, MemoryError):
        return ClusterError("a worker has too little memory for the scene or its film")
    text = str(e)
    if "No module named 'steradian" in text:
        version = _native.__version__
        return ClusterError(f"a worker has no steradian: pip install 'steradian[cluster]=={version}' on every node")
    return ClusterError(f"a task failed on a worker: {text}")
