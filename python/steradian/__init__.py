"""Steradian: a physically based Monte Carlo renderer.

>>> import steradian as sr                                    # doctest: +SKIP
>>> image = sr.render("scenes/first-light.pbrt", spp=64)      # doctest: +SKIP
>>> image.save("first-light.exr")                             # doctest: +SKIP
"""

from . import cluster, errors, kinds
from ._api import integrators, render, resume
from ._image import Image, diff, merge, read
from ._lowlevel import Bsdf, Estimate, Hits, Sampler, Surfaces, estimate, warp
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
    "Bsdf",
    "Estimate",
    "FilmError",
    "FilmTooLargeError",
    "Hits",
    "Image",
    "OutputError",
    "ParameterError",
    "ResumeError",
    "Sampler",
    "Scene",
    "SceneError",
    "SceneWarning",
    "SteradianError",
    "Surfaces",
    "__version__",
    "cluster",
    "diff",
    "errors",
    "estimate",
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
    "warp",
    *kinds.__all__,
]
