"""The parts of a renderer by the array: rays, surfaces, lights, samplers, warps. Enough for a small integrator in Python."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._scene import Scene, Thing
from .errors import ParameterError

Floats = NDArray[np.float32]


def _rows(x: ArrayLike, n: int) -> Floats:
    array = np.ascontiguousarray(x, dtype=np.float32)
    return array.reshape(-1, n) if array.ndim == 1 and array.size == n else array


def _ends(t_max: ArrayLike | None, n: int) -> Floats | None:
    return None if t_max is None else np.ascontiguousarray(np.broadcast_to(np.asarray(t_max, np.float32), (n,)))


@dataclass(frozen=True)
class Hits:
    """Nearest hits of n rays."""

    t: Floats
    """Distances, (n,); infinite where nothing was hit."""
    uv: Floats
    """Parameters on the primitive, (n, 2): of a triangle, the weights of its second and third corner."""
    instance: NDArray[np.uint32]
    """Which instance, (n,); 2³² − 1 for what stands in the world itself, or for nothing."""
    geometry: NDArray[np.uint32]
    """Which shape of the world or of the instance's object, (n,)."""
    primitive: NDArray[np.uint32]
    """Which triangle or patch of the shape, (n,)."""

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Was anything hit?"""
        return np.isfinite(self.t)


class Surfaces:
    """Points on surfaces: what n rays met. Entries of rays that met nothing are zero, and not `valid`. Colours are RGB.

    Directions are unit vectors in world space that point away from the surface.
    """

    def __init__(self, native: _native.Surfaces) -> None:
        self._native = native
        fields = native.fields()
        self.valid: NDArray[np.bool_] = fields["valid"]
        """Was anything hit? (n,)"""
        self.p: Floats = fields["p"]
        """The points, (n, 3)."""
        self.n: Floats = fields["n"]
        """Shading normals with bumps, (n, 3)."""
        self.ng: Floats = fields["ng"]
        """Geometric normals, (n, 3)."""
        self.wo: Floats = fields["wo"]
        """Back along the rays, (n, 3)."""
        self.uv: Floats = fields["uv"]
        """Surface coordinates, (n, 2)."""
        self.t: Floats = fields["t"]
        """Distances along the rays, (n,)."""
        self.shape: NDArray[np.uint32] = fields["shape"]
        """Numbers of the compiled shapes, (n,)."""
        self.primitive: NDArray[np.uint32] = fields["primitive"]
        """Numbers of the primitives within the shapes, (n,)."""
        self.material: NDArray[np.uint32] = fields["material"]
        """Numbers of the materials, (n,)."""
        self.emitted: Floats = fields["emitted"]
        """Radiance emitted along `wo`, (n, 3)."""

    def __len__(self) -> int:
        return len(self._native)

    def eval(self, wi: ArrayLike, wo: ArrayLike | None = None) -> Floats:
        """f(wo, wi) in 1/sr **without** the cosine, (n, 3); zero for mirrors. `wo` is as the rays came, if not given."""
        return self._native.eval(_rows(wi, 3), None if wo is None else _rows(wo, 3))[0]

    def pdf(self, wi: ArrayLike, wo: ArrayLike | None = None) -> Floats:
        """Density of `sample` for the direction `wi`, per steradian, (n,)."""
        return self._native.eval(_rows(wi, 3), None if wo is None else _rows(wo, 3))[1]

    def sample(self, u: ArrayLike, wo: ArrayLike | None = None) -> BsdfSamples:
        """Directions drawn from the BSDFs; `u` is (n, 3) in [0, 1): one number chooses the lobe, two the direction."""
        return BsdfSamples(**self._native.sample(_rows(u, 3), None if wo is None else _rows(wo, 3)))

    def sample_lights(self, u: ArrayLike) -> LightSamples:
        """Light that may reach the points: one light each, chosen by the first of the numbers `u` (n, 3)."""
        return LightSamples(**self._native.sample_lights(_rows(u, 3)))

    def spawn(self, wi: ArrayLike) -> tuple[Floats, Floats]:
        """Rays that leave along `wi`, safely off the surface: origins and directions."""
        wi = _rows(wi, 3)
        return self._native.spawn(wi), wi


@dataclass(frozen=True)
class BsdfSamples:
    """Directions drawn from BSDFs. Where nothing could be drawn `pdf` is 0."""

    wi: Floats
    """Directions, (n, 3)."""
    weight: Floats
    """``f |cos| / pdf``, (n, 3): what a path's throughput is multiplied by."""
    pdf: Floats
    """Density per steradian, (n,); where `delta`, the probability."""
    delta: NDArray[np.bool_]
    """A mirror's or smooth glass's single direction? (n,)"""


@dataclass(frozen=True)
class LightSamples:
    """Light that may reach points: ``f * li * |cos| * visible / pdf`` estimates what is reflected."""

    wi: Floats
    """Towards the light, (n, 3)."""
    li: Floats
    """Radiance that arrives, over the probability of the light, (n, 3)."""
    visible: NDArray[np.bool_]
    """Is nothing in between? (n,)"""
    pdf: Floats
    """Density per steradian, (n,); where `delta`, a probability. 0: no light."""
    delta: NDArray[np.bool_]
    """A light without extent? (n,)"""


class Bsdf(Surfaces):
    """A material alone, in the local frame: the normal is +z, the tangent +x.

    >>> import numpy as np, steradian as sr
    >>> lambert = sr.Bsdf(sr.DiffuseMaterial(0.5))
    >>> up = np.array([[0.0, 0.0, 1.0]])
    >>> bool(np.allclose(lambert.eval(up, up), 0.5 / np.pi))
    True
    """

    def __init__(self, material: Thing) -> None:
        scene = Scene(shapes=[{"type": "disk", "material": material}])
        up = np.array([[0.0, 0.0, 1.0]], np.float32)
        super().__init__(scene._native.surfaces(up * 0.5, -up, None))


class Sampler:
    """A sequence of points in the unit cube: ``sobol`` (Owen-scrambled), ``independent`` or ``stratified``.

    `stream` counts independent sequences of one `seed`.
    """

    def __init__(
        self, kind: str = "sobol", *, seed: int = 0, stream: int = 0, strata: tuple[int, int] = (4, 4)
    ) -> None:
        self.kind, self.seed, self.stream, self.strata = kind, seed, stream, strata

    def points(self, n: int, dimensions: int, *, begin: int = 0) -> Floats:
        """Points `begin` to ``begin + n``, float32 of shape (n, dimensions). Dimensions come in pairs, each well spread."""
        if n < 0 or dimensions < 0:
            raise ParameterError("n and dimensions cannot be below 0")
        flat = _native.samples(self.kind, self.strata, self.seed, self.stream, begin, n, dimensions)
        return cast(Floats, flat.reshape(n, dimensions))

    def replace(self, **changes: Any) -> Sampler:
        """The same with another seed, stream, strata."""
        values: dict[str, Any] = {"seed": self.seed, "stream": self.stream, "strata": self.strata, **changes}
        return Sampler(values.pop("kind", self.kind), **values)


@dataclass(frozen=True)
class Estimate:
    """An integral's estimate."""

    mean: Any
    """The estimate; of the shape of what the function gives for a point."""
    standard_error: Any
    """Its standard error, from the spread of independent randomisations."""
    n: int
    """Points that were used."""


def estimate(
    f: Callable[[Floats], ArrayLike],
    sampler: Sampler | str,
    n: int,
    *,
    dimensions: int = 2,
    randomisations: int = 16,
) -> Estimate:
    """Integrates `f` over the unit cube by `n` points of a sampler.

    `f` maps points (m, dimensions) to values (m,) or (m, k). The points are dealt to independent `randomisations` of the
    sampler, whose spread gives the standard error, right for low-discrepancy points too.

    >>> import steradian as sr
    >>> e = sr.estimate(lambda u: u[:, 0] * u[:, 1], "sobol", 4096)
    >>> bool(abs(e.mean - 0.25) < 5 * e.standard_error + 1e-6)
    True
    """
    if randomisations < 2 or n < randomisations:
        raise ParameterError(f"{n} points for {randomisations} randomisations: expected at least one each, and two of them")
    base = sampler if isinstance(sampler, Sampler) else Sampler(sampler)
    each = n // randomisations
    means = []
    for r in range(randomisations):
        points = base.replace(stream=base.stream * randomisations + r).points(each, dimensions)
        means.append(np.asarray(f(points), dtype=np.float64).mean(axis=0))
    spread = np.std(means, axis=0, ddof=1) / np.sqrt(randomisations)
    return Estimate(np.mean(means, axis=0), spread, each * randomisations)


class _Warps:
    """From the unit square to where samples are wanted: each ``x`` with its density ``x_pdf`` and inverse ``x_inverse``.

    The unit square is (n, 2), directions are (n, 3), densities (n,). There are concentric_disk, uniform_hemisphere,
    cosine_hemisphere, uniform_sphere, equal_area_sphere.
    """

    _names = ("concentric_disk", "uniform_hemisphere", "cosine_hemisphere", "uniform_sphere", "equal_area_sphere")

    def __getattr__(self, name: str) -> Callable[[ArrayLike], Floats]:
        if name.removesuffix("_pdf").removesuffix("_inverse") not in self._names:
            raise AttributeError(f"there is no warp {name}; there are {', '.join(self._names)}")
        columns = 2 if name in self._names or "disk" in name else 3

        def apply(x: ArrayLike) -> Floats:
            out = _native.warp(name, _rows(x, columns))
            return out[:, 0] if name.endswith("_pdf") else out

        return apply

    def __dir__(self) -> list[str]:
        return [name + ending for name in self._names for ending in ("", "_inverse", "_pdf")]


warp = _Warps()
