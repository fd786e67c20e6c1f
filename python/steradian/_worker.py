"""What runs on a cluster's workers: tasks that are pure functions of their arguments.

A worker process keeps the scenes that it compiled, so that only its first task waits for that. Nothing else outlives a task.
"""

from __future__ import annotations

import os
import tempfile
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _api, _native
from ._scene import Scene
from .errors import ClusterError, SceneWarning

_KEPT = 2
"""Scenes that a worker process keeps."""

_scenes: dict[str, tuple[_native.Scene, Any]] = {}
"""The scenes that this process has, by content hash; and the folders that their files lie in."""


@dataclass(frozen=True)
class Work:
    """What all tasks of a picture share."""

    version: str
    """Of the driver."""
    content: str
    """Hash of the scene that travels, and of the scene with `camera`."""
    seen: str
    camera: str | None
    """Instead of the scene's, as JSON."""
    how: Mapping[str, Any]
    """As for `steradian.render`."""
    threads: int


def cell(
    packed: bytes, work: Work, passes: tuple[int, int], learned: bytes | None
) -> tuple[dict[str, Any], NDArray[np.uint8]]:
    """Some passes of a picture: about the work, and the partial film's bytes (an array, which travels without a copy)."""
    began = time.monotonic()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", SceneWarning)
        scene, request = _scene(packed, work), _request(work, passes)
        said: list[str] = []

        def listener(event: dict[str, Any]) -> None:
            if event["event"] == "warning":
                said.append(event["message"])

        film, report = _native.render(scene, request, None, listener, learned)
    rendered = time.monotonic()
    data = film.to_array()
    told = {
        **report,
        **where(),
        "seconds": time.monotonic() - began,
        "packing_seconds": time.monotonic() - rendered,
        "said": said,
        "warnings": [str(w.message) for w in caught if issubclass(w.category, SceneWarning)],
    }
    return told, data


def plan(packed: bytes, work: Work, passes: tuple[int, int]) -> list[tuple[int, int]]:
    """The rounds that some passes read, each with its first pass (from 0)."""
    return _native.rounds(_scene(packed, work), _request(work, passes), passes[1])


def learn(packed: bytes, work: Work, of_pass: int, before: bytes | None) -> tuple[bytes, int]:
    """What a pass reads, learned on from an earlier round; and the rays that it took."""
    return _native.learn(_scene(packed, work), _request(work, (of_pass, of_pass + 1)), of_pass, before)


def merged(*parts: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Partial films as one: an inner node of the merge tree."""
    total = _native.Sum()
    for part in parts:
        total.add(part)
    data = total.to_array()
    assert data is not None
    return data


def where() -> dict[str, Any]:
    """The node and process that this is."""
    import ray

    return {"node": ray.get_runtime_context().get_node_id(), "process": os.getpid()}


def _request(work: Work, passes: Sequence[int]) -> dict[str, Any]:
    if _native.__version__ != work.version:
        raise ClusterError(
            f"a worker has version {_native.__version__} of steradian, and the driver has {work.version}: "
            "all machines need the same"
        )
    return _api.request_of(passes=(passes[0], passes[1]), threads=work.threads, **work.how)


def _scene(packed: bytes, work: Work) -> _native.Scene:
    if work.seen in _scenes:
        return _scenes[work.seen][0]
    base = work.content
    if base not in _scenes:
        _make_room()
        # The files are needed again when an option makes the scene compile anew; they go with the process.
        folder = tempfile.TemporaryDirectory(prefix="steradian-")
        _scenes[base] = (_native.Scene.unpack(packed, Path(folder.name)), folder)
    scene, folder = _scenes[base]
    if work.camera is not None:
        # The same files, compiled apart.
        _make_room(but=base)
        scene = scene.with_camera(work.camera, work.seen)
        _scenes[work.seen] = (scene, folder)
    return scene


def _make_room(but: str | None = None) -> None:
    while len(_scenes) >= _KEPT:
        del _scenes[next(key for key in _scenes if key != but)]


def of(scene: Scene, camera: str | None, how: Mapping[str, Any], threads: int) -> Work:
    """The work of a picture; made by the driver."""
    content = scene.content_hash
    seen = content if camera is None else scene._native.with_camera(camera).content_hash()
    return Work(_native.__version__, content, seen, camera, dict(how), threads)
