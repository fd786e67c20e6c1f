"""Scenes: read from files or made of dataclasses and dicts, looked at and changed."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native, _schema
from ._describe import Lowering, raised
from .errors import SceneError
from .kinds import CLASSES, Described

if TYPE_CHECKING:
    from ._lowlevel import Hits, Surfaces

Thing = Described | Mapping[str, Any]


class Listing(Sequence[Any]):
    """A list of a scene: its things come as dataclasses, and others can be put in their place.

    Things with names can be had by name too. What a get gives is a copy: ``scene.lights[0] = scene.lights[0].replace(...)``
    changes the scene.
    """

    def __init__(self, scene: Scene, section: str, family: str) -> None:
        self._scene, self._section, self._family = scene, section, family

    def __len__(self) -> int:
        return self._scene._native.len(self._section)

    def names(self) -> list[str]:
        """The names of the things; empty for one without."""
        return self._scene._native.names(self._section)

    def __getitem__(self, which: Any) -> Any:
        if isinstance(which, slice):
            return [self[i] for i in range(*which.indices(len(self)))]
        index = self._index(which)
        if self._section == "shapes":
            text, geometry = self._scene._native.get_shape(index)
            return _shape(json.loads(text), geometry)
        return _raise(self._family, json.loads(self._scene._native.get(self._section, index)))

    def __setitem__(self, which: int | str, thing: Thing) -> None:
        self._scene._lowering.put(self._section, thing, self._index(which))

    def __delitem__(self, which: int | str) -> None:
        if self._section not in ("lights", "shapes", "instances"):
            raise SceneError(f"{self._section} cannot be taken away, for others refer to them by number")
        self._scene._native.remove(self._section, self._index(which))

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"<{len(self)} {self._section}>"

    def append(self, thing: Thing) -> int:
        """Adds a thing and gives its number."""
        return self._scene._lowering.put(self._section, thing)

    def _index(self, which: int | str) -> int:
        if isinstance(which, str):
            names = self.names() if self._section not in ("lights", "shapes", "instances") else []
            if which not in names:
                raise KeyError(which)
            return names.index(which)
        n = len(self)
        index = which + n if which < 0 else which
        if not 0 <= index < n:
            raise IndexError(f"there are {n} {self._section}, and no number {which}")
        return index


class Scene:
    """A scene: what a file or Python describes, compiled when it is first rendered, and again when something changed.

    Things may be dataclasses of `steradian.kinds` or dicts with a ``type``. `materials` is a mapping of names to materials,
    or a sequence; shapes may also hold their materials themselves, and materials their textures. `content` does the same as
    one dict: ``Scene({"camera": ..., "shapes": [...]})``.

    >>> import steradian as sr
    >>> scene = sr.Scene(
    ...     camera=sr.PerspectiveCamera(40, world_from_camera=sr.look_at((0, -5, 1), (0, 0, 0))),
    ...     film={"resolution": (32, 32)},
    ...     materials={"red": sr.DiffuseMaterial((0.7, 0.1, 0.1))},
    ...     shapes=[sr.Sphere(1.0, material="red")],
    ...     lights=[sr.InfiniteConstantLight(1.0)],
    ... )
    >>> scene.materials["red"] = scene.materials["red"].replace(reflectance=(0.1, 0.1, 0.7))
    >>> sr.render(scene, spp=4).shape
    (32, 32, 3)
    """

    def __init__(
        self,
        content: Mapping[str, Any] | None = None,
        *,
        camera: Thing | None = None,
        film: Thing | None = None,
        filter: Thing | None = None,
        sampler: Thing | None = None,
        integrator: Thing | str | None = None,
        textures: Mapping[str, Thing] | Iterable[Thing] = (),
        materials: Mapping[str, Thing] | Iterable[Thing] = (),
        media: Mapping[str, Thing] | Iterable[Thing] = (),
        objects: Mapping[str, Thing] | Iterable[Thing] = (),
        shapes: Iterable[Thing] = (),
        instances: Iterable[Thing] = (),
        lights: Iterable[Thing] = (),
        strict: bool = False,
        _made: _native.Scene | None = None,
    ) -> None:
        self._native = _made if _made is not None else _native.Scene(strict)
        self._lowering = Lowering(self._native)
        self._strict = strict
        if content is not None:
            self._fill(content)
        self._fill(
            {
                "camera": camera,
                "film": film,
                "filter": filter,
                "sampler": sampler,
                "integrator": integrator,
                "textures": textures,
                "media": media,
                "materials": materials,
                "objects": objects,
                "shapes": shapes,
                "instances": instances,
                "lights": lights,
            }
        )

    @property
    def camera(self) -> Any:
        """The eye. Assign to change it."""
        return _raise("CameraDesc", json.loads(self._native.get_one("camera")))

    @camera.setter
    def camera(self, camera: Thing) -> None:
        self._native.set_one("camera", json.dumps(self._lowering.family("CameraDesc", camera, "camera")))

    @property
    def film(self) -> Any:
        """Resolution, sensor, primaries. Assign to change it."""
        return _raise("FilmDesc", json.loads(self._native.get_one("film")))

    @film.setter
    def film(self, film: Thing) -> None:
        self._native.set_one("film", json.dumps(self._lowering.struct("FilmDesc", film, "film")))

    @property
    def filter(self) -> Any:
        """How samples become pixels. Assign to change it."""
        ((kind, fields),) = json.loads(self._native.get_one("filter")).items()
        return CLASSES["FilterDesc", kind](**fields)

    @filter.setter
    def filter(self, filter: Thing) -> None:
        self._native.set_one("filter", json.dumps(self._lowering.enum("FilterDesc", filter, "filter")))

    @property
    def sampler(self) -> dict[str, Any]:
        """Where samples come from: name, spp, strata, seed. Assign a dict to change them."""
        return cast(dict[str, Any], json.loads(self._native.get_one("sampler")))

    @sampler.setter
    def sampler(self, sampler: Thing) -> None:
        self._native.set_one("sampler", json.dumps(self._lowering.struct("SamplerDesc", sampler, "sampler")))

    @property
    def integrator(self) -> dict[str, Any]:
        """What renders unless `render` is told otherwise: name, max_depth, rr_depth, light_selection, parameters."""
        about = json.loads(self._native.get_one("integrator"))
        about["parameters"] = {n: next(iter(v.values())) for n, v in about["parameters"].items()}
        return cast(dict[str, Any], about)

    @integrator.setter
    def integrator(self, integrator: Thing | str) -> None:
        given: dict[str, Any] = {"name": integrator} if isinstance(integrator, str) else dict(cast(Mapping[str, Any], integrator))
        parameters = {n: {"text": _text(v)} for n, v in given.pop("parameters", {}).items()}
        lowered = self._lowering.struct("IntegratorDesc", given, "integrator")
        self._native.set_one("integrator", json.dumps({**lowered, "parameters": parameters}))

    @property
    def materials(self) -> Listing:
        """Surfaces' looks, by number or name."""
        return Listing(self, "materials", "MaterialDesc")

    @property
    def textures(self) -> Listing:
        """Values that vary over surfaces, by number or name."""
        return Listing(self, "textures", "TextureDesc")

    @property
    def images(self) -> Listing:
        """Image files, by number."""
        return Listing(self, "images", "ImageDesc")

    @property
    def media(self) -> Listing:
        """What fills space, by number or name."""
        return Listing(self, "media", "MediumDesc")

    @property
    def lights(self) -> Listing:
        """Lights that are not surfaces, by number."""
        return Listing(self, "lights", "LightDesc")

    @property
    def shapes(self) -> Listing:
        """Surfaces, by number. Arrays of meshes come as copies when they are asked for."""
        return Listing(self, "shapes", "ShapeDesc")

    @property
    def instances(self) -> Listing:
        """Repetitions of objects, by number."""
        return Listing(self, "instances", "InstanceDesc")

    @property
    def content_hash(self) -> str:
        """A hash of all that makes the scene: the same scene, the same hash, on every machine."""
        return self._native.content_hash()

    def intersect(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        t_max: ArrayLike | None = None,
        time: float = 0.0,
        threads: int | None = None,
    ) -> Hits:
        """Nearest hits of rays, arrays of shape (n, 3); float32 without a copy. Directions need not be unit; t is a distance.

        A ray that is not finite or has no direction hits nothing.
        """
        from ._lowlevel import Hits, _ends, _rows

        o, d = _rows(origins, 3), _rows(directions, 3)
        found = self._native.intersect(o, d, _ends(t_max, len(o)), time, threads)
        ids = found["ids"]
        return Hits(found["t"], found["uv"], ids[:, 0], ids[:, 1], ids[:, 2])

    def occluded(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        t_max: ArrayLike | None = None,
        time: float = 0.0,
        threads: int | None = None,
    ) -> NDArray[np.bool_]:
        """Is anything opaque along the rays before `t_max`? (n,)"""
        from ._lowlevel import _ends, _rows

        o, d = _rows(origins, 3), _rows(directions, 3)
        return self._native.occluded(o, d, _ends(t_max, len(o)), time, threads)

    def surfaces(self, origins: ArrayLike, directions: ArrayLike, *, t_max: ArrayLike | None = None) -> Surfaces:
        """The surfaces that rays meet first."""
        from ._lowlevel import Surfaces, _ends, _rows

        o, d = _rows(origins, 3), _rows(directions, 3)
        return Surfaces(self._native.surfaces(o, d, _ends(t_max, len(o))))

    def background(self, directions: ArrayLike) -> NDArray[np.float32]:
        """Radiance of infinite lights seen along directions, (n, 3), RGB."""
        from ._lowlevel import _rows

        return self._native.background(_rows(directions, 3))

    def camera_rays(self, raster: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Rays through places on the film, (n, 2) in pixels: origins and directions. Pixel (i, j) is [i, i+1) x [j, j+1)."""
        from ._lowlevel import _rows

        return self._native.camera_rays(_rows(raster, 2))

    def __repr__(self) -> str:
        n = self._native.len
        return f"<steradian.Scene, {n('shapes')} shapes, {n('materials')} materials, {n('lights')} lights>"

    def _fill(self, content: Mapping[str, Any]) -> None:
        for section in content:
            if section not in _ONES and section not in _LISTS:
                raise SceneError(f"a scene has no `{section}`; there are {', '.join([*_ONES, *_LISTS])}")
        # What others refer to by name comes first.
        for section in _LISTS:
            things = content.get(section) or ()
            named = things.items() if isinstance(things, Mapping) else ((None, thing) for thing in things)
            for name, thing in named:
                self._lowering.put_named(section, name, thing)
        for section in _ONES:
            if content.get(section) is not None:
                setattr(self, section, content[section])


_ONES = ("camera", "film", "filter", "sampler", "integrator")
_LISTS = ("images", "textures", "media", "materials", "objects", "shapes", "instances", "lights")


def load(
    path: str | os.PathLike[str],
    *,
    strict: bool = False,
    defines: Mapping[str, object] | None = None,
) -> Scene:
    """Reads a scene file.

    With `strict` every warning is an error; `defines` sets the file's ``$parameters``. Raises SceneError, which lists
    all that is wrong with file, line and column; warns with SceneWarning.
    """
    given = [(name, _text(value)) for name, value in (defines or {}).items()]
    scene = Scene(_made=_native.Scene.load(Path(path), strict, given))
    scene._strict = strict
    return scene


def _text(value: object) -> str:
    """A value as the command line writes it."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "true" if value else "false"
    return str(value)


def _raise(family: str, lowered: Mapping[str, Any]) -> Any:
    """A dataclass where there is one, else a dict."""
    if family in _schema.FAMILIES:
        fields = raised(family, lowered)
        return _make(family, fields.pop("type"), fields)
    return _make(family, family, dict(lowered))


def _make(family: str, kind: str, fields: Mapping[str, Any]) -> Any:
    made = CLASSES.get((family, kind))
    if made is None:
        return {"type": kind, **fields}
    known = {f.name for f in dataclasses.fields(cast(Any, made))}
    return made(**{n if n in known else f"{n}_": v for n, v in fields.items()})


def _shape(rest: Mapping[str, Any], geometry: _native.Geometry) -> Any:
    about = json.loads(geometry.to_json())
    outer = {n: v for n, v in raised("ShapeDesc", rest).items() if n in _schema.struct("ShapeDesc").fields}
    if isinstance(about, dict):
        ((kind, fields),) = about.items()
        inner = {n: v for n, v in raised("ShapeDesc", {"geometry": {kind: fields}}).items() if n != "type"}
        return _make("ShapeDesc", kind, {**inner, **outer})
    arrays = geometry.to_arrays()
    if "attributes" in arrays:
        arrays["attributes"] = json.loads(arrays["attributes"])
    if about == "curve":
        arrays["segments"] = arrays.pop("positions").reshape(-1, 4, 3)
    return _make("ShapeDesc", about, {**arrays, **outer})
