"""Steradian: a physically based Monte Carlo renderer.

>>> import steradian as sr                                    # doctest: +SKIP
>>> image = sr.render("scenes/first-light.pbrt", spp=64)      # doctest: +SKIP
>>> image.save("first-light.exr")                             # doctest: +SKIP
"""

from . import cluster, errors, kinds
from ._api import integrators, live, render, resume
from ._compare import Advice, Comparison, Interval, MethodFigures, Verdict, advise, compare
from ._image import Image, diff, merge, read
from ._live import Live
from ._lowlevel import Bsdf, Estimate, Hits, Sampler, Surfaces, estimate, warp
from ._native import __version__
from ._scene import Scene, load
from ._transforms import look_at, rotate, scale, translate
from .errors import (
    ClusterError,
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
    "Advice",
    "Bsdf",
    "ClusterError",
    "Comparison",
    "Estimate",
    "FilmError",
    "FilmTooLargeError",
    "Hits",
    "Image",
    "Interval",
    "Live",
    "MethodFigures",
    "OutputError",
    "ParameterError",
    "ResumeError",
    "Sampler",
    "Scene",
    "SceneError",
    "SceneWarning",
    "SteradianError",
    "Surfaces",
    "Verdict",
    "__version__",
    "advise",
    "cluster",
    "compare",
    "diff",
    "errors",
    "estimate",
    "integrators",
    "kinds",
    "live",
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
