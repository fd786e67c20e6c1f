"""One render on many machines, by Ray. The bits are those of one thread.

A render is cut into ranges of passes; each is a task that gives a partial film, and partial films add exactly, in any order.
Tasks are pure: when a worker or its node dies they run again elsewhere, which costs time and nothing else. The scene travels
once to each node as one object with all its files, images decoded, and stays compiled in every worker process.

Needs ``pip install steradian[cluster]``. Without an address Ray starts on this machine.
"""

from __future__ import annotations

import json
import logging
import os
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from . import _api, _progress
from ._farm import Farm, Picture, Progress
from ._image import Image
from ._scene import Scene, load
from .errors import ClusterError, ParameterError

__all__ = ["ClusterError", "connect", "render", "render_many"]

_PATIENCE = 5.0
"""Seconds to wait for somebody who does not answer."""


def connect(address: str | None = None) -> Any:
    """Connects to Ray and gives the module: ``"HOST:PORT"``, ``"ray://HOST:PORT"``, ``"auto"`` for the cluster that this
    machine belongs to, ``"local"`` to start one on this machine. `None`: what is connected already, else as ``"local"``.

    Raises ClusterError within seconds if nobody answers there.
    """
    try:
        import ray
    except ImportError as e:
        raise ClusterError("Ray is missing: pip install 'steradian[cluster]'") from e
    if ray.is_initialized():
        return ray
    where = None if address in (None, "local") else address
    if where is not None and where != "auto":
        _check(where)
    try:
        # A cluster that runs here already is asked for by "auto".
        ray.init(
            address=where or "local",
            log_to_driver=False,
            logging_level=logging.WARNING,
            include_dashboard=False if where is None else None,
        )
    except (ConnectionError, ValueError, RuntimeError, TimeoutError) as e:
        why = " ".join(str(e).split())[:400] or type(e).__name__
        raise ClusterError(f"cannot reach a Ray cluster at {address or 'this machine'}: {why}") from e
    return ray


def render(
    scene: Scene | str | os.PathLike[str],
    *,
    address: str | None = None,
    spp: int | None = None,
    passes: tuple[int, int] | None = None,
    camera: Any = None,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: float = 30.0,
    resume: bool = False,
    progress: bool = True,
    on_progress: Progress | None = None,
    events: str | os.PathLike[str] | None = None,
    passes_per_task: int | None = None,
    cpus_per_task: int | None = None,
    fan_in: int | None = None,
    **how: Any,
) -> Image:
    """Renders on a Ray cluster; `how` is as for `steradian.render`, but for `time` and `error`.

    Results are merged as they arrive; no more of them wait than twice the cluster's processors. `on_progress` hears what
    happens as dicts (see docs/guide/farms.md), at least once a second; their ``["image"]`` is the picture so far. It ends the
    render with that by returning True, as Ctrl-C does. `events` names a file to which the dicts are appended as lines of JSON.
    ``metadata["nodes"]`` counts the passes of each node, ``metadata["retries"]`` the tasks that ran again. Nodes may join and
    leave meanwhile. `checkpoint` is the driver's: with `resume` a new driver goes on from it.

    `camera` is another than the scene's. A task has `passes_per_task` passes (by default as it pays) on `cpus_per_task`
    threads (by default one, or more where there are too few passes for all processors); `fan_in` films are merged by a task before the driver gets them (1 up to 64 tasks at a time, then 16).

    Raises what `steradian.render` does, and ClusterError.
    """
    picture = _picture(
        scene, spp=spp, passes=passes, camera=camera, checkpoint=checkpoint, resume=resume, how=how
    )
    with _progress.heard(progress, on_progress) as listener:
        farm = Farm(
            connect(address),
            iter([picture]),
            passes_per_task=passes_per_task,
            cpus_per_task=cpus_per_task,
            fan_in=fan_in,
            on_progress=listener,
            events=events,
            checkpoint_every=checkpoint_every,
        )
        try:
            farm.run()
        except KeyboardInterrupt:
            if picture.done == 0:
                raise
    image = picture.image()
    if image is None:
        raise KeyboardInterrupt
    image._report.update(
        interrupted=picture.done < picture.passes[1] - picture.passes[0],
        nodes=dict(picture.nodes),
        retries=picture.retries,
        duplicates=picture.duplicates,
        passes_resumed=picture.resumed,
        wall_seconds=farm.elapsed,
    )
    return image


def render_many(
    jobs: Iterable[Mapping[str, Any]],
    folder: str | os.PathLike[str],
    *,
    address: str | None = None,
    name: Callable[[int], str] = "{:04}.exr".format,
    on_progress: Progress | None = None,
    events: str | os.PathLike[str] | None = None,
    checkpoint_every: float = 30.0,
    passes_per_task: int | None = None,
    cpus_per_task: int | None = None,
    fan_in: int | None = None,
    **shared: Any,
) -> list[Path]:
    """Renders many pictures into a folder: frames, cameras, sweeps. Gives their paths, of those that are there.

    Each job is the arguments of `render` that are not `shared` by all: its ``scene``, a ``camera``, a ``seed``, a ``name``.
    Tasks of a picture begin before the one before it has ended, and each is saved as soon as it is done. What is there already
    is skipped, and what was begun (saved beside it, as ``.partial``) goes on: run it again after any accident.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths: list[Path] = []

    def pictures() -> Iterator[Picture]:
        scenes: dict[str, Scene] = {}
        for i, job in enumerate(jobs):
            how = {**shared, **job}
            path = folder / how.pop("name", name(i))
            paths.append(path)
            if path.exists():
                continue
            scene = how.pop("scene")
            if not isinstance(scene, Scene):
                scenes = {k: v for k, v in scenes.items() if k == str(scene)} or {str(scene): load(scene)}
                scene = scenes[str(scene)]
            begun = path.with_name(path.name + ".partial")
            given = {k: how.pop(k, None) for k in ("spp", "passes", "camera")}
            yield _picture(scene, checkpoint=begun, resume=True, path=path, how=how, **given)

    def save(picture: Picture) -> None:
        image = picture.image()
        assert image is not None and picture.path is not None and picture.checkpoint is not None
        image.save(picture.path)
        picture.checkpoint.unlink(missing_ok=True)
        picture.film = type(picture.film)()

    Farm(
        connect(address),
        pictures(),
        passes_per_task=passes_per_task,
        cpus_per_task=cpus_per_task or 1,
        fan_in=fan_in,
        on_progress=on_progress,
        events=events,
        checkpoint_every=checkpoint_every,
        on_done=save,
    ).run()
    return [path for path in paths if path.exists()]


def _picture(
    scene: Scene | str | os.PathLike[str],
    *,
    how: dict[str, Any],
    spp: int | None = None,
    passes: tuple[int, int] | None = None,
    camera: Any = None,
    checkpoint: str | os.PathLike[str] | None = None,
    resume: bool = False,
    path: Path | None = None,
) -> Picture:
    for name in ("time", "error"):
        if how.pop(name, None) is not None:
            raise ParameterError(f"a render on a cluster has no {name}: give spp")
    how = {k: v for k, v in how.items() if k not in ("progress", "threads")}
    scene = scene if isinstance(scene, Scene) else load(scene)
    if spp is None and passes is None:
        spp = int(scene.sampler["spp"])
    request = _api.request_of(spp=spp, passes=passes, checkpoint=checkpoint, resume=resume, **how)
    a, b = request["passes"]
    if not 0 <= a < b:
        raise ParameterError(f"passes {a}..{b} are none")
    seen = None if camera is None else json.dumps(scene._lowering.family("CameraDesc", camera, "camera"))
    return Picture(scene, how, (a, b), seen, request["checkpoint"], resume, path)


def _check(address: str) -> None:
    """Is there somebody at an address? Ray itself would try for a minute."""
    host, colon, port = address.removeprefix("ray://").rpartition(":")
    if not colon or not port.isdigit() or not host:
        raise ClusterError(f"{address} is no address of a cluster: expected HOST:PORT, ray://HOST:PORT, auto or local")
    try:
        with socket.create_connection((host.strip("[]"), int(port)), timeout=_PATIENCE):
            pass
    except (OSError, OverflowError) as e:
        raise ClusterError(f"cannot reach a Ray cluster at {address}: {e}") from None
