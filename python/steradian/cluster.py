"""One render on many machines, by Ray. The bits are those of one thread.

A render is cut into ranges of passes; each is a task that gives a partial film, and partial films add exactly, in any order.
Tasks are pure: when a worker or its node dies they run again elsewhere, which costs time and nothing else. The scene travels
once as one object with all its files, and stays compiled in every worker process.

Needs ``pip install steradian[cluster]``. Without an address Ray starts on this machine.
"""

from __future__ import annotations

import json
import os
import tempfile
import time as _time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from . import _api, _native
from ._image import Image, merge
from ._scene import Scene, load
from .errors import ParameterError, SteradianError

Progress = Callable[[dict[str, Any]], "bool | None"]

_scenes: dict[str, Scene] = {}
"""In a worker process: the scenes that it has compiled, by content hash."""

_KEPT = 2
"""Scenes that a worker process keeps."""


class ClusterError(SteradianError):
    """The cluster cannot be reached, or its workers cannot do the work."""


def connect(address: str | None = None) -> Any:
    """Connects to Ray (``"auto"``, ``"HOST:PORT"``, ``"ray://..."``), or starts it on this machine; gives the module."""
    try:
        import ray
    except ImportError as e:
        raise ClusterError("Ray is missing: pip install steradian[cluster]") from e
    if not ray.is_initialized():
        try:
            ray.init(address=address, log_to_driver=False, include_dashboard=False if address is None else None)
        except (ConnectionError, ValueError, RuntimeError, TimeoutError) as e:
            raise ClusterError(f"cannot reach a Ray cluster at {address or 'this machine'}: {e}") from e
    return ray


def render(
    scene: Scene | str | os.PathLike[str],
    *,
    address: str | None = None,
    spp: int | None = None,
    on_progress: Progress | None = None,
    events: str | os.PathLike[str] | None = None,
    passes_per_task: int | None = None,
    cpus_per_task: int = 1,
    **how: Any,
) -> Image:
    """Renders on a Ray cluster; `how` is as for `steradian.render`, but for `time` and checkpoints.

    Results are merged as they arrive; no more of them wait than the cluster has processors. `on_progress` hears an event for
    each, with the ``image`` so far, and ends the render with it by returning True, as Ctrl-C does. `events` names a file to
    which they are appended as lines of JSON. ``metadata["nodes"]`` counts the passes of each node, ``metadata["retries"]`` the
    tasks that ran more than once. Nodes may join and leave meanwhile.
    """
    for name in ("time", "passes", "checkpoint", "resume"):
        if how.pop(name, None):
            raise ParameterError(f"a render on a cluster has no {name}: give spp")
    how.pop("progress", None)
    how.pop("threads", None)
    scene = scene if isinstance(scene, Scene) else load(scene)
    n = int(scene.sampler["spp"] if spp is None else spp)
    if n < 1:
        raise ParameterError(f"spp cannot be {n}: expected a whole number from 1")
    ray = connect(address)

    cpus = max(int(ray.cluster_resources().get("CPU", 1)), 1)
    step = passes_per_task or max(1, n // (8 * cpus))
    ranges = [(a, min(a + step, n)) for a in range(0, n, step)]
    packed, content = ray.put(scene._native.pack()), scene.content_hash
    version = _native.__version__
    task = ray.remote(_cell).options(num_cpus=cpus_per_task, max_retries=-1, retry_exceptions=False)
    return _Run(ray, task, (packed, content, version, how), ranges, cpus, on_progress, events).image()


def render_many(
    jobs: Iterable[Mapping[str, Any]],
    folder: str | os.PathLike[str],
    *,
    address: str | None = None,
    name: Callable[[int], str] = "{:04}.exr".format,
    **shared: Any,
) -> list[Path]:
    """Renders many pictures into a folder: frames, cameras, sweeps. What is there already is skipped, so that a run that
    ended early goes on.

    Each job is the arguments of `render` (with its ``scene``) that are not `shared` by all.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    done = []
    for i, job in enumerate(jobs):
        path = folder / name(i)
        if not path.exists():
            arguments = {**shared, **job}
            render(arguments.pop("scene"), address=address, **arguments).save(path)
        done.append(path)
    return done


class _Run:
    """The driver's side of a render."""

    def __init__(
        self,
        ray: Any,
        task: Any,
        shared: tuple[Any, str, str, Mapping[str, Any]],
        ranges: Sequence[tuple[int, int]],
        cpus: int,
        on_progress: Progress | None,
        events: str | os.PathLike[str] | None,
    ) -> None:
        self._ray, self._task, self._shared = ray, task, shared
        self._waiting = list(reversed(ranges))
        self._n = ranges[-1][1]
        self._window = 2 * cpus
        self._on_progress, self._events = on_progress, None if events is None else Path(events)
        self._running: dict[Any, tuple[int, int]] = {}
        self._image: Image | None = None
        self._nodes: dict[str, int] = {}
        self._retries = 0
        self._start = _time.monotonic()

    def image(self) -> Image:
        """Renders all ranges, or until somebody stops it."""
        interrupted = False
        try:
            while self._waiting or self._running:
                self._submit()
                if self._collect():
                    interrupted = bool(self._waiting or self._running)
                    break
        except KeyboardInterrupt:
            interrupted = True
            if self._image is None:
                raise
        finally:
            for ref in self._running:
                self._ray.cancel(ref, force=False)
        assert self._image is not None
        self._image._report.update(
            interrupted=interrupted,
            nodes=dict(self._nodes),
            retries=self._retries,
            wall_seconds=_time.monotonic() - self._start,
        )
        return self._image

    def _submit(self) -> None:
        while self._waiting and len(self._running) < self._window:
            passes = self._waiting.pop()
            packed, *rest = self._shared
            self._running[self._task.remote(packed, *rest, passes)] = passes

    def _collect(self) -> bool:
        """Merges what is done; True if somebody wants to stop."""
        done, _ = self._ray.wait(list(self._running), num_returns=1, timeout=1.0)
        stop = False
        for ref in done:
            passes = self._running.pop(ref)
            try:
                data, report, node, attempt = self._ray.get(ref)
            except self._ray.exceptions.RayTaskError as e:
                cause = getattr(e, "cause", None)
                raise cause if isinstance(cause, SteradianError) else ClusterError(str(e)) from None
            except self._ray.exceptions.RayError:
                # Ray gave up on it; we do not.
                self._waiting.append(passes)
                self._retries += 1
                continue
            part = Image.from_bytes(data)
            part._report = report
            self._image = part if self._image is None else merge([self._image, part])
            self._nodes[node] = self._nodes.get(node, 0) + passes[1] - passes[0]
            self._retries += attempt
            stop = self._tell(passes, node) or stop
        return stop

    def _tell(self, passes: tuple[int, int], node: str) -> bool:
        assert self._image is not None
        event = {
            "event": "partial",
            "passes": list(passes),
            "node": node,
            "fraction": self._image.spp / self._n,
            "elapsed_seconds": _time.monotonic() - self._start,
            "retries": self._retries,
        }
        if self._events is not None:
            with self._events.open("a") as file:
                file.write(json.dumps(event) + "\n")
        return bool(self._on_progress({**event, "image": self._image})) if self._on_progress else False


def _cell(
    packed: bytes, content: str, version: str, how: Mapping[str, Any], passes: tuple[int, int]
) -> tuple[bytes, dict[str, Any], str, int]:
    """On a worker: some passes of a scene."""
    import ray

    if _native.__version__ != version:
        raise ClusterError(f"a worker has version {_native.__version__} of steradian, the driver {version}")
    scene = _scenes.get(content)
    if scene is None:
        while len(_scenes) >= _KEPT:
            del _scenes[next(iter(_scenes))]
        # The files are needed again when an option makes the scene compile anew; they go with the process.
        folder = tempfile.TemporaryDirectory(prefix="steradian-")
        scene = _scenes[content] = Scene(_made=_native.Scene.unpack(packed, Path(folder.name)))
        scene._files = folder
    image = _api.render(scene, passes=passes, threads=1, progress=False, **how)
    context = ray.get_runtime_context()
    attempt = getattr(context, "get_attempt_number", lambda: 0)()
    return image.to_bytes(), image._report, context.get_node_id(), attempt
