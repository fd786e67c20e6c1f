"""Matrices that place things: arrays of shape (4, 4) that map column vectors, so that ``a @ b`` applies b first."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .errors import SceneError

Matrix = NDArray[np.float64]


def translate(x: float, y: float, z: float) -> Matrix:
    """Moves by (x, y, z)."""
    m = np.eye(4)
    m[:3, 3] = x, y, z
    return m


def scale(x: float, y: float | None = None, z: float | None = None) -> Matrix:
    """Scales; one number for all axes."""
    return np.diag([x, x if y is None else y, x if z is None else z, 1.0]).astype(np.float64)


def rotate(axis: Sequence[float], degrees: float) -> Matrix:
    """Turns about an axis, counter-clockwise seen against it."""
    a = _unit(axis, "the axis")
    cross = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    angle = np.radians(degrees)
    m = np.eye(4)
    m[:3, :3] = np.cos(angle) * np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * np.outer(a, a)
    return m


def look_at(eye: Sequence[float], target: Sequence[float], up: Sequence[float] = (0.0, 0.0, 1.0)) -> Matrix:
    """world_from_camera of a camera at `eye` that looks at `target`; camera space is x right, y up, z forward.

    As in pbrt this is left-handed: in a right-handed world, such as with z up, the picture is the mirror image of what you
    expect. ``look_at(...) @ scale(-1, 1, 1)`` turns it back.
    """
    forward = _unit(np.subtract(target, eye), "the direction of view")
    right = _unit(np.cross(_unit(up, "up"), forward), "up, across the direction of view,")
    m = np.eye(4)
    m[:3, 0], m[:3, 1], m[:3, 2], m[:3, 3] = right, np.cross(forward, right), forward, eye
    return m


def _unit(v: Sequence[float] | NDArray[np.float64], what: str) -> NDArray[np.float64]:
    array = np.asarray(v, dtype=np.float64)
    length = float(np.linalg.norm(array)) if array.shape == (3,) else 0.0
    if not (length > 1e-12 and np.isfinite(length)):
        raise SceneError(f"{what} has no length")
    return array / length
