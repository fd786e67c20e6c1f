"""Scenes and renders."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from . import _native, _progress
from ._image import Image
from ._live import Live
from ._scene import Scene, _text, load
from .errors import FilmError, ParameterError, ResumeError

Settings = list[tuple[str, str]]


def render(
    scene: Scene | str | os.PathLike[str],
    *,
    integrator: str | None = None,
    spp: int | None = None,
    time: float | None = None,
    error: str | float | None = None,
    passes: tuple[int, int] | None = None,
    seed: int | None = None,
    threads: int | None = None,
    resolution: tuple[int, int] | None = None,
    crop: tuple[int, int, int, int] | None = None,
    spectral: bool = False,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: float = 30.0,
    resume: bool = False,
    progress: bool = True,
    on_progress: Callable[[dict[str, Any]], bool | None] | None = None,
    **parameters: object,
) -> Image:
    """Renders a scene.

    Stops after `spp` samples in each pixel, after `time` seconds, when √relMSE is below `error` (``"1%"`` or ``0.01``) with
    95 % confidence, or when `passes` (half-open) are done; else the scene says when. What is left out is as the scene says;
    `parameters` are the integrator's, and ``sampler`` and ``light_selection`` (see `integrators`). `resolution` is (width,
    height), `crop` (x0, y0, x1, y1) in pixels, half-open. The same arguments give the same bits for any number of `threads`.

    `checkpoint` names a file to which the film is saved every `checkpoint_every` seconds; with `resume` the render goes
    on from it. `on_progress` hears events as dicts, some ten times a second; if it returns True, or on Ctrl-C, the render
    stops and gives what there is (``metadata["interrupted"]`` tells).

    Raises SceneError, ParameterError, FilmError, FilmTooLargeError, ResumeError, OutputError.
    """
    request = request_of(
        integrator=integrator,
        spp=spp,
        time=time,
        error=error,
        passes=passes,
        seed=seed,
        threads=threads,
        resolution=resolution,
        crop=crop,
        spectral=spectral,
        checkpoint=checkpoint,
        checkpoint_every=checkpoint_every,
        resume=resume,
        **parameters,
    )
    scene = scene if isinstance(scene, Scene) else load(scene)
    return _run(scene, request, None, progress, on_progress)


def request_of(
    *,
    integrator: str | None = None,
    spp: int | None = None,
    time: float | None = None,
    error: str | float | None = None,
    passes: tuple[int, int] | None = None,
    seed: int | None = None,
    threads: int | None = None,
    resolution: tuple[int, int] | None = None,
    crop: tuple[int, int, int, int] | None = None,
    spectral: bool = False,
    checkpoint: str | os.PathLike[str] | None = None,
    checkpoint_every: float = 30.0,
    resume: bool = False,
    **parameters: object,
) -> dict[str, Any]:
    """What the arguments of `render` ask for, as the compiled half reads it."""
    return _request(
        integrator=integrator,
        settings=_settings(parameters),
        seed=seed,
        threads=threads,
        resolution=resolution,
        crop=crop,
        spectral=spectral,
        spp=spp,
        passes=passes,
        time=time,
        error=error,
        checkpoint=None if checkpoint is None else Path(checkpoint),
        checkpoint_every=checkpoint_every,
        resume=resume,
    )


def live(
    scene: Scene | str | os.PathLike[str],
    *,
    integrator: str | None = None,
    spp: int | None = None,
    time: float | None = None,
    error: str | float | None = None,
    seed: int | None = None,
    threads: int | None = None,
    resolution: tuple[int, int] | None = None,
    crop: tuple[int, int, int, int] | None = None,
    spectral: bool = False,
    every: float = 0.25,
    **parameters: object,
) -> Live:
    """Renders in the background: returns at once what can be looked at, waited for and stopped.

    In a notebook it shows the image, its error estimate and a stop button while it renders (with ``steradian[notebook]``); the image
    is drawn anew `every` so many seconds. All else is as for `render`, and so are the bits of the image.
    """
    request = _request(
        integrator=integrator,
        settings=_settings(parameters),
        seed=seed,
        threads=threads,
        resolution=resolution,
        crop=crop,
        spectral=spectral,
        spp=spp,
        passes=None,
        time=time,
        error=error,
        checkpoint=None,
        checkpoint_every=30.0,
        resume=False,
    )
    scene = scene if isinstance(scene, Scene) else load(scene)
    return Live(scene, {**request, "view_every": float(every)})


def resume(
    image: Image | str | os.PathLike[str],
    *,
    more: int | None = None,
    time: float | None = None,
    scene: Scene | str | os.PathLike[str] | None = None,
    threads: int | None = None,
    progress: bool = True,
    on_progress: Callable[[dict[str, Any]], bool | None] | None = None,
) -> Image:
    """Continues a render exactly, by `more` passes or `time` seconds: the bits of one render in one go.

    `image` is what `render` gave, or the path of a ``.partial`` file or checkpoint; a file, and an image that was
    pickled, need the `scene` too.

    Raises ResumeError if the scene or the version is another.
    """
    image = image if isinstance(image, Image) else Image.load(image)
    if scene is None:
        scene = image._scene
    elif not isinstance(scene, Scene):
        scene = load(scene)
    if scene is None:
        raise ResumeError("this film does not know its scene: give it, as scene=")
    if (more is None) == (time is None):
        raise ParameterError("give either more (passes) or time (seconds)")
    if more is not None and more < 1:
        raise ParameterError(f"more cannot be {more}: expected a whole number from 1")

    # All that decides the picture stands in the film's key.
    first = _first_missing(image)
    request = {
        **_of_film(image),
        "threads": threads,
        "passes": None if more is None else (first, first + more),
        "time": time,
        "error": None,
        "view_every": None,
        "checkpoint": None,
        "checkpoint_every": 30.0,
        "resume": False,
    }
    try:
        after = _run(scene, request, image._film, progress, on_progress)
    except FilmError as e:
        raise ResumeError(f"the film cannot be resumed: {e}") from None
    for name in ("render_seconds", "rays", "camera_paths", "light_paths"):
        after._report[name] += image._report.get(name, 0)
    after._report["passes_resumed"] = image.spp
    return after


def integrators() -> dict[str, dict[str, Any]]:
    """The integrators by name: ``purpose``, what each ``misses``, ``unbiased``, and its ``parameters`` with defaults."""
    return {about["name"]: about for about in _native.integrators()}


def _request(*, spp: int | None, error: str | float | None, **given: Any) -> dict[str, Any]:
    """What the compiled half wants to know."""
    if sum(x is not None for x in (spp, error, given["time"], given["passes"])) > 1:
        raise ParameterError("only one of spp, time, error and passes can say when to stop")
    if spp is not None and spp < 1:
        raise ParameterError(f"spp cannot be {spp}: expected a whole number from 1")
    if given["resume"] and given["checkpoint"] is None:
        raise ParameterError("resume needs a checkpoint to go on from")
    passes = given["passes"] if spp is None else (0, spp)
    return {**given, "passes": passes, "error": None if error is None else _text(error), "view_every": None}


def _run(
    scene: Scene,
    request: Mapping[str, Any],
    start: _native.Film | None,
    progress: bool,
    on_progress: Callable[[dict[str, Any]], bool | None] | None,
) -> Image:
    with _progress.heard(progress, on_progress) as listener:
        film, report = _native.render(scene._native, request, start, listener)
    return Image(film, report, scene, request)


def _settings(parameters: Mapping[str, object]) -> Settings:
    return [(name, _text(value)) for name, value in parameters.items()]


def _first_missing(image: Image) -> int:
    ranges = image._film.passes()
    return ranges[0][1] if ranges and ranges[0][0] == 0 else 0


def _of_film(image: Image) -> dict[str, Any]:
    """The request that makes a film like this one, read from its key."""
    info = image._film.info()
    known = integrators()
    if info["integrator"] not in known:
        raise ResumeError(f"the film was rendered with `{info['integrator']}`, which this version does not have")
    own = {*known[info["integrator"]]["parameters"], "light_selection"}
    pairs = [part.split("=", 1) for part in info["settings"].split(" ") if "=" in part]
    values = dict(pairs)
    settings = [(name, value) for name, value in pairs if name in own]
    sampler = values.get("sampler", "")
    if not sampler.startswith("stratified"):
        settings.append(("sampler", sampler))
    else:
        settings.append(("sampler", "stratified"))
    return {
        "integrator": info["integrator"],
        "settings": settings,
        "seed": info["seed"],
        "resolution": info["resolution"],
        "crop": info["crop"],
        "spectral": values.get("mode") == "spectral",
    }

