"""What can go wrong. The text of each is what the command line says."""

import warnings
from collections.abc import Iterable


class SteradianError(Exception):
    """Anything that Steradian refuses or cannot do."""


class SceneError(SteradianError, ValueError):
    """A scene cannot be rendered. The text lists everything that is wrong with it, with file, line and column."""


class ParameterError(SteradianError, ValueError):
    """There is no such integrator, no such parameter, or the parameter cannot have this value."""


class FilmError(SteradianError, ValueError):
    """Films or pictures that do not belong together, or a file that is no film or damaged."""


class ResumeError(SteradianError, ValueError):
    """A checkpoint that belongs to another render, or is damaged."""


class FilmTooLargeError(SteradianError, MemoryError):
    """The film does not fit into memory."""


class OutputError(SteradianError, OSError):
    """A file cannot be written or read."""


class ClusterError(SteradianError):
    """The cluster cannot be reached, or its workers cannot do the work."""


class SceneWarning(UserWarning):
    """The scene renders, but something in it is not as it asks."""


def _warn(texts: Iterable[str]) -> None:
    for text in texts:
        warnings.warn(text, SceneWarning, stacklevel=3)
