"""Steradian: a physically based Monte Carlo renderer.

>>> import steradian as sr                                    # doctest: +SKIP
>>> image = sr.render("scenes/first-light.pbrt", spp=64)      # doctest: +SKIP
>>> image.save("first-light.exr")                             # doctest: +SKIP
"""

from . import cluster, errors, kinds
from ._api import integrators, render, resume
from ._image import Image, diff, merge, read
from ._native import __version__
from ._scene import Scene, load
from ._transforms import look_at, rotate, scale, translate
from .errors import (
    FilmError,
    FilmTooLargeError,
    OutputError,
    ParameterError,
    ResumeError,
    SceneError,
    SceneWarning,
    SteradianError,
)
from .kinds import *  # noqa: F403

__all__ = [
    "FilmError",
    "FilmTooLargeError",
    "Image",
    "OutputError",
    "ParameterError",
    "ResumeError",
    "Scene",
    "SceneError",
    "SceneWarning",
    "SteradianError",
    "__version__",
    "cluster",
    "diff",
    "errors",
    "integrators",
    "kinds",
    "load",
    "look_at",
    "merge",
    "read",
    "render",
    "resume",
    "rotate",
    "scale",
    "translate",
    *kinds.__all__,
]
