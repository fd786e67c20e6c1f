"""Steradian: a physically based Monte Carlo renderer.

>>> import steradian as sr                                    # doctest: +SKIP
>>> image = sr.render("scenes/first-light.pbrt", spp=64)      # doctest: +SKIP
>>> image.save("first-light.exr")                             # doctest: +SKIP
"""

from . import errors
from ._api import Scene, integrators, load, render, resume
from ._image import Image, diff, merge, read
from ._native import __version__
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
    "diff",
    "errors",
    "integrators",
    "load",
    "merge",
    "read",
    "render",
    "resume",
]
