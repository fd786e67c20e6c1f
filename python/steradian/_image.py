"""Pictures that know how they were made."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from .errors import FilmError

if TYPE_CHECKING:
    from ._scene import Scene

Array = NDArray[np.float32]

_PICTURES = {".exr", ".png", ".hdr", ".pfm"}


class Image:
    """What a render gives: a picture, how certain it is, and how it was made.

    It holds the exact sums of all passes, so that it can be continued (`resume`) and merged with other parts of the same
    render (`merge`) to the bits of one long render. It pickles, and shows itself in a notebook.
    """

    def __init__(
        self,
        film: _native.Film,
        report: Mapping[str, Any] | None = None,
        scene: Scene | None = None,
        request: Mapping[str, Any] | None = None,
    ) -> None:
        self._film = film
        self._report = dict(report or {})
        self._scene = scene
        self._request = dict(request or {})
        self._developed: dict[str, Any] | None = None

    @property
    def array(self) -> Array:
        """Linear R, G, B in the film's primaries, float32 of shape (height, width, 3); read-only. Row 0 is the top."""
        return self._develop()["mean"]  # type: ignore[no-any-return]

    @property
    def variance(self) -> Array:
        """Variance of the mean, of the same shape; infinite below two passes. Its square root is the standard error."""
        return self._develop()["variance"]  # type: ignore[no-any-return]

    @property
    def aovs(self) -> dict[str, Array]:
        """Further channels by name, each of shape (height, width)."""
        developed = self._develop()
        return {name: developed["aovs"][..., i] for i, name in enumerate(developed["aov_names"])}

    @property
    def metadata(self) -> dict[str, Any]:
        """How to make the same picture again, and what it took: as ``steradian render --json``."""
        developed = self._develop()
        return {
            **self._film.info(),
            **self._report,
            "mean": tuple(developed["mean_rgb"]),
            "relmse_estimate": developed["relmse_estimate"],
        }

    @property
    def spp(self) -> int:
        """Complete passes, that is samples in each pixel."""
        return int(self._film.info()["spp"])

    @property
    def shape(self) -> tuple[int, ...]:
        """(height, width, 3)."""
        return tuple(self.array.shape)

    def save(self, path: str | os.PathLike[str], *, exposure: float = 0.0) -> Path:
        """Writes ``.exr`` (with variance and metadata), ``.png``, ``.hdr``, ``.pfm``, or ``.partial`` (the exact sums).

        `exposure` in stops brightens pictures of eight bits. The file appears whole or not at all.
        """
        path = Path(path)
        if path.suffix == ".partial":
            self._film.save(path)
        else:
            self._film.save_picture(path, exposure)
        return path

    def to_bytes(self) -> bytes:
        """The exact sums, as a ``.partial`` file has them."""
        return self._film.to_bytes()

    @classmethod
    def from_bytes(cls, data: bytes) -> Image:
        """From what `to_bytes` gave."""
        return cls(_native.Film.from_bytes(data))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Image:
        """From a ``.partial`` file or a checkpoint."""
        return cls(_native.Film.load(Path(path)))

    def to_png(self, *, exposure: float = 0.0, filmic: bool = False) -> bytes:
        """A PNG file's bytes. What is above one is white, or compressed if `filmic`."""
        return _native.png(self.array, exposure, filmic)

    def _repr_png_(self) -> bytes:
        return self.to_png(filmic=True)

    def __repr__(self) -> str:
        info = self._film.info()
        height, width, _ = self.shape
        return f"<steradian.Image {width}x{height}, {info['spp']} passes of {info['integrator']}>"

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(self.array, dtype=dtype, copy=True if copy is None else copy)

    def __reduce__(self) -> tuple[Any, ...]:
        return _unpickle, (self.to_bytes(), self._report)

    def _develop(self) -> dict[str, Any]:
        if self._developed is None:
            developed = self._film.develop()
            for name in ("mean", "variance", "aovs"):
                developed[name].flags.writeable = False
            self._developed = developed
        return self._developed


def _unpickle(data: bytes, report: Mapping[str, Any]) -> Image:
    return Image(_native.Film.from_bytes(data), report)


def merge(images: Sequence[Image | str | os.PathLike[str] | bytes]) -> Image:
    """Adds parts of one render exactly: the bits of the render in one go, whatever the order.

    Takes images, paths of ``.partial`` files, and bytes of `Image.to_bytes`. A part that adds nothing is ignored;
    `Image.metadata` counts them as ``duplicates``.

    Raises FilmError for parts of different renders, or that share some of their passes but not all.
    """
    parts = [part if isinstance(part, Image) else _image(part) for part in images]
    if not parts:
        raise FilmError("nothing to merge")
    film, duplicates = _native.merge([part._film for part in parts])
    known = next((part for part in parts if part._scene is not None), parts[0])
    added = [part for i, part in enumerate(parts) if i not in duplicates]
    report: dict[str, Any] = {"duplicates": len(duplicates)}
    for name in ("render_seconds", "rays", "camera_paths", "light_paths"):
        if all(name in part._report for part in added):
            report[name] = sum(part._report[name] for part in added)
    return Image(film, report, known._scene, known._request)


def _image(part: str | os.PathLike[str] | bytes) -> Image:
    return Image.from_bytes(part) if isinstance(part, bytes) else Image.load(part)


def read(path: str | os.PathLike[str]) -> Array:
    """A picture file as linear light: float32 of shape (height, width, 3); eight bits are decoded from sRGB."""
    return _native.load_picture(Path(path))[0]


def diff(a: Any, b: Any) -> dict[str, Any]:
    """Compares a picture with a reference `b`: mse, relmse, trimmed-relmse, mape, smape, flip, means.

    Takes images, arrays of shape (height, width, 3), and paths of picture files. The metrics are those of
    ``steradian diff``.
    """
    (x, x_is_float), (y, y_is_float) = _pixels(a), _pixels(b)
    return _native.diff(x, y, x_is_float or y_is_float)


def _pixels(x: Any) -> tuple[Array, bool]:
    """Linear light, and whether it may hold more than a screen shows."""
    if isinstance(x, (str, os.PathLike)):
        path = Path(x)
        if path.suffix.lower() not in _PICTURES:
            return Image.load(path).array, True
        picture, _, is_float = _native.load_picture(path)
        return picture, is_float
    if isinstance(x, Image):
        return x.array, True
    array = np.asarray(x, dtype=np.float32)
    if array.ndim != 3 or array.shape[2] != 3:
        raise FilmError(f"expected an image of shape (height, width, 3), not {array.shape}")
    return array, True
