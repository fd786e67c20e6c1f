"""From what people write (dataclasses, dicts, numbers, arrays) to descriptions, and back.

`Lowering` walks a value along its type's schema. What refers to another thing (a material, a texture, an image, a medium,
an object) may be its name, its number, or the thing itself, which is then added to the scene once.
"""

from __future__ import annotations

import dataclasses
import difflib
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import _native, _schema
from ._schema import FAMILIES, WITH_ARRAYS, Kind, Schema
from .errors import SceneError

LARGEST = float(np.finfo(np.float32).max)

SECTIONS = {
    "MaterialId": ("materials", "MaterialDesc"),
    "TextureId": ("textures", "TextureDesc"),
    "ImageId": ("images", "ImageDesc"),
    "MediumId": ("media", "MediumDesc"),
    "ObjectId": ("objects", "ObjectDesc"),
}
"""What an index refers to: the list of the scene, and the type of its things."""


def as_dict(value: Any) -> dict[str, Any] | None:
    """A dataclass of ours or a dict as a dict with its ``type``; None for anything else."""
    if isinstance(value, Mapping):
        return {str(k).rstrip("_"): v for k, v in value.items()}
    if hasattr(value, "_type"):
        fields = {f.name.rstrip("_"): getattr(value, f.name) for f in dataclasses.fields(value)}
        return {"type": value._type, **fields}
    return None


class Lowering:
    """Makes a scene's JSON. One for each scene, so that a thing that is used twice is added once."""

    def __init__(self, native: _native.Scene) -> None:
        self.native = native
        # The things themselves are kept, so that no other gets the same id.
        self._added: dict[tuple[str, int], tuple[int, Any]] = {}
        self._files: dict[str, int] = {}

    # Things of the scene.

    def put(self, section: str, value: Any, index: int | None = None, **how: Any) -> int:
        """Puts a thing into a list of the scene, or in the place of another; gives its number."""
        family = next(f for s, f in SECTIONS.values() if s == section) if section not in _OTHERS else _OTHERS[section]
        where = section if index is None else f"{section}[{index}]"
        if family == "ShapeDesc":
            text, geometry = self.shape(value, where)
            return self.native.put_shape(index, text, geometry)
        if family == "ObjectDesc":
            return self._object(value, where)
        if family == "TextureDesc" and (given := as_dict(value)) is not None:
            value = {"kind": how.get("kind", "spectrum"), **given}
        if family in FAMILIES:
            lowered = self.family(family, value, where)
        else:
            lowered = self.struct(family, value, where)
        if index is not None:
            self._refuse_later(lowered, section, index, where)
        return self.native.put(section, index, json.dumps(lowered))

    def put_named(self, section: str, name: str | None, value: Any) -> int:
        """Adds a thing, under a name if it has one; what refers to the thing itself finds it too."""
        thing = value
        if name is not None:
            thing = {**(as_dict(value) or {"type": None}), "name": name}
        index = self.put(section, thing)
        self._added[section, id(value)] = (index, value)
        return index

    def shape(self, value: Any, where: str) -> tuple[str, _native.Geometry]:
        """A shape without its geometry, and the geometry."""
        given, kind = self._flat_kind("ShapeDesc", value, where)
        where = f"{where} ({kind.name})"
        handle = given.pop("geometry", None)
        variant = _schema.variants("Geometry")[kind.name]
        own = {n: given.pop(n) for n in list(given) if n in variant.fields}
        if isinstance(handle, _native.Geometry):
            geometry = handle
        elif kind.name in WITH_ARRAYS:
            geometry = self._arrays(kind.name, own, where)
        else:
            lowered = self.fields(variant, own, where)
            geometry = self._geometry(json.dumps({kind.name: lowered}), where)
        outer = _schema.struct("ShapeDesc")
        rest = Kind(
            kind.name,
            "",
            {n: s for n, s in outer.fields.items() if n != "geometry"},
            {n: v for n, v in kind.defaults.items() if n in outer.fields},
        )
        if given.get("material") is None:
            given["material"] = _GRAY
        lowered = self.fields(rest, given, where)
        return json.dumps({**lowered, "geometry": _PLACEHOLDER}), geometry

    def family(self, family: str, value: Any, where: str) -> dict[str, Any]:
        """A camera, light, material, medium or texture."""
        field, enum, _ = FAMILIES[family]
        given, kind = self._flat_kind(family, value, where)
        where = f"{where} ({kind.name})"
        inner = _schema.variants(enum)[kind.name]
        if inner.single is not None or inner.unit:
            lowered: Any = kind.name
            if inner.single is not None:
                lowered = {kind.name: self.value(inner.single, given.pop("value", None), where)}
        else:
            own = {n: given.pop(n) for n in list(given) if n in inner.fields and n != "kind"}
            lowered = {kind.name: self.fields(inner, own, where)}
        outer = _schema.struct(family)
        fields = {n: s for n, s in outer.fields.items() if n != field}
        rest = Kind(kind.name, "", fields, {n: v for n, v in kind.defaults.items() if n in fields})
        return {**self.fields(rest, given, where), field: lowered}

    def _flat_kind(self, family: str, value: Any, where: str) -> tuple[dict[str, Any], Kind]:
        given, kinds = as_dict(value), _schema.flat(family)
        if given is None:
            raise SceneError(f"{where}: expected a description with a type, not {value!r}")
        name = given.pop("type", None)
        if not isinstance(name, str) or name not in kinds:
            raise SceneError(f"{where}: there is no type {name!r}; {_did_you_mean(name, kinds)}")
        known = {*kinds[name].fields, "value", "geometry", "segments", "positions", "indices", "levels", "width"}
        for field in given:
            if field not in known:
                raise SceneError(f"{where} ({name}) has no `{field}`; {_did_you_mean(field, known)}")
        return given, kinds[name]

    # Values.

    def struct(self, name: str, value: Any, where: str) -> dict[str, Any]:
        """A value of a struct's type."""
        given = as_dict(value)
        if given is None:
            raise SceneError(f"{where}: expected the values of {_plain(name)}, not {value!r}")
        given.pop("type", None)
        return self.fields(_schema.struct(name), given, where)

    def fields(self, kind: Kind, given: Mapping[str, Any], where: str) -> dict[str, Any]:
        """All fields of a kind: what is given, else the defaults."""
        for name in given:
            if name not in kind.fields:
                raise SceneError(f"{where} has no `{name}`; {_did_you_mean(name, kind.fields)}")
        lowered = {}
        for name, schema in kind.fields.items():
            if name in given:
                lowered[name] = self.value(schema, given[name], f"{where}.{name}")
            elif name in kind.defaults:
                lowered[name] = kind.defaults[name]
            else:
                raise SceneError(f"{where} needs `{name}`: {schema.get('description', '')}".rstrip(": "))
        return lowered

    def value(self, schema: Schema, value: Any, where: str) -> Any:
        """A value along its schema."""
        if (inner := _schema.optional(schema)) is not None:
            return None if value is None else self.value(inner, value, where)
        if (name := _schema.reference(schema)) is not None:
            return self.named(name, value, where)
        match schema.get("type"):
            case "number":
                return _number(value, where)
            case "integer":
                return _integer(value, where)
            case "boolean":
                if isinstance(value, (bool, np.bool_)):
                    return bool(value)
                raise SceneError(f"{where} cannot be {value!r}: expected True or False")
            case "string":
                if isinstance(value, (str, os.PathLike)):
                    return os.fspath(value)
                raise SceneError(f"{where} cannot be {value!r}: expected text")
            case "array":
                return self._array(schema, value, where)
            case "object" if "properties" in schema:
                return self.fields(_schema._fields("", "", schema, {}), as_dict(value) or {}, where)
            case "object":
                return dict(value)
            case other:
                raise SceneError(f"{where}: a value of {other} cannot be given from Python")

    def _array(self, schema: Schema, value: Any, where: str) -> list[Any]:
        if isinstance(value, (str, bytes)) or not isinstance(value, Iterable):
            raise SceneError(f"{where} cannot be {value!r}: expected a sequence")
        values = list(value)
        least, most = schema.get("minItems", 0), schema.get("maxItems", len(values))
        if not least <= len(values) <= most:
            raise SceneError(f"{where} has {len(values)} values: expected {least}")
        items = schema.get("prefixItems") or [schema["items"]] * len(values)
        return [self.value(s, v, f"{where}[{i}]") for i, (s, v) in enumerate(zip(items, values))]

    def named(self, name: str, value: Any, where: str) -> Any:
        """A value of a named type, with what people may write instead of all its words."""
        if name in SECTIONS:
            return self.refer(name, value, where)
        if (short := getattr(self, f"_short_{name}", None)) is not None:
            lowered = short(value, where)
            if lowered is not None:
                return lowered
        if name in FAMILIES:
            return self.family(name, value, where)
        schema = _schema.definition(name)
        if _schema.is_enum(schema):
            return self.enum(name, value, where)
        if "properties" in schema:
            return self.struct(name, value, where)
        return self.value(schema, value, where)

    def enum(self, name: str, value: Any, where: str) -> Any:
        """One of an enum's kinds: a word, ``{"type": kind, ...}``, or ``{kind: content}``."""
        kinds = _schema.variants(name)
        if isinstance(value, str):
            if value in kinds and kinds[value].unit:
                return value
            raise SceneError(f"{where} cannot be {value!r}; {_did_you_mean(value, kinds)}")
        given = as_dict(value)
        if given is None:
            raise SceneError(f"{where} cannot be {value!r}; {_did_you_mean(None, kinds)}")
        if "type" in given:
            kind_name = given.pop("type")
            content: Any = given
        elif len(given) == 1:
            ((kind_name, content),) = given.items()
        else:
            raise SceneError(f"{where}: a type is missing; {_did_you_mean(None, kinds)}")
        if kind_name not in kinds:
            raise SceneError(f"{where}: there is no type {kind_name!r}; {_did_you_mean(kind_name, kinds)}")
        kind = kinds[kind_name]
        if kind.unit:
            return kind_name
        if kind.single is not None:
            if isinstance(content, dict) and set(content) == {"value"}:
                content = content["value"]
            return {kind_name: self.value(kind.single, content, f"{where}.{kind_name}")}
        return {kind_name: self.fields(kind, as_dict(content) or {}, f"{where}.{kind_name}")}

    # What refers to another thing.

    def refer(self, name: str, value: Any, where: str, **how: Any) -> int:
        """The number of a thing: by its name, its number, or itself."""
        section, family = SECTIONS[name]
        if isinstance(value, (int, np.integer)) and not isinstance(value, bool):
            if 0 <= value < self.native.len(section):
                return int(value)
            raise SceneError(f"{where}: there are {self.native.len(section)} {section}, and no number {value}")
        if isinstance(value, (str, os.PathLike)):
            if family == "ImageDesc":
                return self._image(os.fspath(value))
            names = self.native.names(section)
            if value in names:
                return names.index(str(value))
            raise SceneError(f"{where}: there is no {_plain(family)} {value!r}; {_did_you_mean(value, names)}")
        key = (section, id(value))
        if key not in self._added:
            self._added[key] = (self.put(section, value, None, **how), value)
        return self._added[key][0]

    def _image(self, path: str) -> int:
        path = str(Path(path).absolute())
        if path not in self._files:
            image = {**_schema.struct("ImageDesc").defaults, "path": path}
            self._files[path] = self.native.put("images", None, json.dumps(image))
        return self._files[path]

    def _object(self, value: Any, where: str) -> int:
        given = as_dict(value)
        if given is None:
            raise SceneError(f"{where}: expected an object with shapes, not {value!r}")
        given.pop("type", None)
        for name in given:
            if name not in ("name", "shapes", "instances"):
                raise SceneError(f"{where} has no `{name}`; there are name, shapes, instances")
        shapes = [self.shape(s, f"{where}.shapes[{i}]") for i, s in enumerate(given.get("shapes", []))]
        instances = [
            self.struct("InstanceDesc", s, f"{where}.instances[{i}]")
            for i, s in enumerate(given.get("instances", []))
        ]
        return self.native.add_object(str(given.get("name", "")), shapes, json.dumps(instances))

    def _refuse_later(self, lowered: Any, section: str, index: int, where: str) -> None:
        """A thing in the place of another may refer to earlier ones of its list only, or they could go round in a circle."""
        field = {"materials": "MaterialId", "textures": "TextureId"}.get(section)
        if field is None:
            return
        used = _ids(lowered, section)
        if any(i >= index for i in used):
            raise SceneError(f"{where} would refer to a later thing of its list: only earlier ones can be used")

    # Short forms. None: it is not one.

    def _short_SpectrumDesc(self, value: Any, where: str) -> Any:
        if _is_number(value):
            return {"constant": _number(value, where)}
        if isinstance(value, str):
            return {"named": value}
        if isinstance(value, (Sequence, np.ndarray)):
            array = np.asarray(value, dtype=np.float64)
            if array.shape == (3,):
                rgb = [_number(x, where) for x in array.tolist()]
                return {"rgb": {"rgb": rgb, "space": "srgb"}}
            if array.ndim == 2 and array.shape[1] == 2:
                return {"curve": [[_number(x, where) for x in row] for row in array.tolist()]}
            raise SceneError(f"{where}: expected 3 numbers (linear sRGB), or pairs of wavelength and value")
        return None

    def _short_FloatInput(self, value: Any, where: str) -> Any:
        if _is_number(value):
            return {"constant": _number(value, where)}
        if isinstance(value, str) or _is_texture(value):
            return {"texture": self.refer("TextureId", value, where, kind="float")}
        return None

    def _short_SpectrumInput(self, value: Any, where: str) -> Any:
        if _is_texture(value) or (isinstance(value, str) and value in self.native.names("textures")):
            return {"texture": self.refer("TextureId", value, where, kind="spectrum")}
        if _is_tagged(value, "SpectrumInput"):
            return None
        return {"constant": self.named("SpectrumDesc", value, where)}

    def _short_TextureInput(self, value: Any, where: str) -> Any:
        if _is_number(value):
            return {"float": _number(value, where)}
        if _is_texture(value) or (isinstance(value, str) and value in self.native.names("textures")):
            return {"texture": self.refer("TextureId", value, where, kind="spectrum")}
        if _is_tagged(value, "TextureInput"):
            return None
        return {"spectrum": self.named("SpectrumDesc", value, where)}

    def _short_Illuminant(self, value: Any, where: str) -> Any:
        given = as_dict(value)
        if given is not None and "spectrum" in given:
            return None
        if _is_number(value):
            value = (value, value, value)
        return {"spectrum": self.named("SpectrumDesc", value, where), "scale": 1.0, "normalize": True}

    def _short_IndexOfRefraction(self, value: Any, where: str) -> Any:
        if _is_number(value):
            return {"constant": _number(value, where)}
        if _is_tagged(value, "IndexOfRefraction"):
            return None
        return {"spectrum": self.named("SpectrumDesc", value, where)}

    def _short_ConductorSpectrum(self, value: Any, where: str) -> Any:
        if isinstance(value, str):
            named = {part: {"constant": {"named": f"metal-{value}-{part}"}} for part in ("eta", "k")}
            return {"eta_k": named}
        if _is_tagged(value, "ConductorSpectrum"):
            return None
        return {"reflectance": self.named("SpectrumInput", value, where)}

    def _short_Roughness(self, value: Any, where: str) -> Any:
        given = as_dict(value)
        if given is not None and ("u" in given or "v" in given or "remap" in given):
            return None
        if isinstance(value, (tuple, list)) and len(value) == 2:
            u, v = (self.named("FloatInput", x, where) for x in value)
        else:
            u = v = self.named("FloatInput", value, where)
        return {**_schema.struct("Roughness").defaults, "u": u, "v": v}

    def _short_AreaLightDesc(self, value: Any, where: str) -> Any:
        given = as_dict(value)
        if given is not None and any(n in given for n in _schema.struct("AreaLightDesc").fields):
            return None
        radiance = self.named("Illuminant", value, where)
        return {**_schema.struct("AreaLightDesc").defaults, "radiance": radiance}

    def _short_PhaseDesc(self, value: Any, where: str) -> Any:
        return {"henyey_greenstein": _number(value, where)} if _is_number(value) else None

    def _short_Transform(self, value: Any, where: str) -> Any:
        return _matrix(value, where)

    def _short_AnimatedTransform(self, value: Any, where: str) -> Any:
        given = as_dict(value)
        if given is None:
            return _matrix(value, where)
        times = [_number(t, where) for t in given.get("times", (0.0, 1.0))]
        keys = {key: _matrix(given.get(key), f"{where}.{key}") for key in ("start", "end")}
        return {**keys, "times": times}

    # Geometry.

    def _arrays(self, kind: str, own: Mapping[str, Any], where: str) -> _native.Geometry:
        allowed = {
            "mesh": {
                *("positions", "indices", "normals", "tangents", "uvs", "attributes"),
                *("end_positions", "end_normals", "key_times"),
            },
            "bilinear_mesh": {"positions", "indices", "normals", "uvs"},
            "loop_subdiv": {"positions", "indices", "levels"},
            "curve": {"segments", "width", "kind", "normals"},
        }[kind]
        for name in own:
            if name not in allowed:
                raise SceneError(f"{where} has no `{name}`; {_did_you_mean(name, allowed)}")

        def rows(name: str, dtype: type, columns: int) -> np.ndarray[Any, Any] | None:
            value = own.get(name)
            if value is None:
                return None
            array = np.asarray(value)
            if array.size == 0:
                return np.zeros((0, columns), dtype)
            if dtype is np.uint32 and (array.dtype.kind not in "iu" or array.min() < 0 or array.max() >= 1 << 32):
                raise SceneError(f"{where}.{name}: expected whole numbers from 0")
            if array.ndim < 2 or array.shape[-1] != columns:
                raise SceneError(f"{where}.{name} has the shape {array.shape}: expected (n, {columns})")
            return np.ascontiguousarray(array.reshape(-1, columns), dtype)

        positions = rows("segments" if kind == "curve" else "positions", np.float32, 3)
        corners = 4 if kind == "bilinear_mesh" else 3
        indices = rows("indices", np.uint32, corners)
        if positions is None:
            raise SceneError(f"{where} needs its points")
        if indices is None and kind != "curve":
            if len(positions) % corners:
                raise SceneError(f"{where} has {len(positions)} positions and no indices: expected a multiple of {corners}")
            indices = np.arange(len(positions), dtype=np.uint32).reshape(-1, corners)
        width = np.broadcast_to(np.asarray(own.get("width", 1.0), np.float32), (2,))
        try:
            return _native.Geometry.from_arrays(
                kind,
                {
                    "positions": positions,
                    "normals": rows("normals", np.float32, 3),
                    "tangents": rows("tangents", np.float32, 3),
                    "uvs": rows("uvs", np.float32, 2),
                    "end_positions": rows("end_positions", np.float32, 3),
                    "end_normals": rows("end_normals", np.float32, 3),
                    "key_times": _pair(own.get("key_times", (0.0, 1.0)), f"{where}.key_times"),
                    "indices": indices,
                    "width": np.ascontiguousarray(width),
                    "levels": _integer(own.get("levels", 3), f"{where}.levels"),
                    "facing": str(own.get("kind", "flat")),
                    "attributes": json.dumps([_attribute(a, f"{where}.attributes") for a in own.get("attributes") or ()]),
                },
            )
        except SceneError as e:
            raise SceneError(f"{where}: {e}") from None

    def _geometry(self, text: str, where: str) -> _native.Geometry:
        try:
            return _native.Geometry.from_json(text)
        except SceneError as e:
            raise SceneError(f"{where}: {e}") from None


def _pair(given: Any, where: str) -> list[float]:
    values = np.asarray(given)
    if values.shape != (2,):
        raise SceneError(f"{where} cannot be {given!r}: expected two numbers")
    return [_number(x, where) for x in values.tolist()]


def _attribute(given: Any, where: str) -> dict[str, Any]:
    """Values that a mesh carries: ``{"name": ..., "values": (n,) or (n, channels), "per_face": False}``."""
    about = as_dict(given)
    if about is None or not {"name", "values"} <= about.keys() <= {"name", "values", "channels", "per_face"}:
        raise SceneError(f"{where}: expected dicts with name, values and perhaps channels and per_face, not {given!r}")
    values = np.asarray(about["values"], np.float32)
    channels = about.get("channels", values.shape[1] if values.ndim > 1 else 1)
    return {
        "name": str(about["name"]),
        "channels": _integer(channels, f"{where}.channels"),
        "per_face": bool(about.get("per_face", False)),
        "values": values.ravel().tolist(),
    }


_GRAY = {"type": "diffuse"}
"""The material of shapes without one."""

_OTHERS = {"lights": "LightDesc", "shapes": "ShapeDesc", "instances": "InstanceDesc"}
_PLACEHOLDER = {"sphere": {"radius": 1.0, "z_min": -1.0, "z_max": 1.0, "phi_max": 360.0}}


def raised(family: str, lowered: Mapping[str, Any]) -> dict[str, Any]:
    """A description as people write it: flat, with short forms where they say the same."""
    field, enum, _ = FAMILIES[family]
    kind = lowered[field]
    rest = {n: v for n, v in lowered.items() if n != field}
    if isinstance(kind, str):
        return {"type": kind, **_short(rest)}
    ((name, content),) = kind.items()
    if _schema.variants(enum)[name].single is not None:
        return {"type": name, "value": content, **_short(rest)}
    return {"type": name, **_short(content), **_short(rest)}


def _short(value: Any) -> Any:
    if isinstance(value, list):
        return [_short(v) for v in value]
    if not isinstance(value, dict):
        return math.copysign(math.inf, value) if isinstance(value, float) and abs(value) >= LARGEST else value
    if set(value) == {"constant"}:
        return _short(value["constant"])
    if set(value) == {"rgb"} and value["rgb"].get("space") == "srgb":
        return tuple(value["rgb"]["rgb"])
    if set(value) == {"spectrum", "scale", "normalize"} and value["scale"] == 1.0 and value["normalize"]:
        inner = value["spectrum"]
        return _short(inner) if set(inner) == {"rgb"} else {n: _short(v) for n, v in value.items()}
    return {n: _short(v) for n, v in value.items()}


def _ids(value: Any, section: str) -> list[int]:
    """The numbers of textures (or materials) that a lowered description refers to."""
    if isinstance(value, list):
        return [i for v in value for i in _ids(v, section)]
    if not isinstance(value, dict):
        return []
    found = []
    for name, inner in value.items():
        refers = name == "texture" if section == "textures" else name in ("materials", "front", "back")
        if refers and isinstance(inner, int):
            found.append(inner)
        elif refers and isinstance(inner, list):
            found.extend(inner)
        else:
            found.extend(_ids(inner, section))
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _is_texture(value: Any) -> bool:
    given = as_dict(value)
    return given is not None and given.get("type") in _schema.variants("TextureNode") and "constant" not in given


def _is_tagged(value: Any, enum: str) -> bool:
    given = as_dict(value)
    if given is None:
        return False
    if "type" in given:
        return given["type"] in _schema.variants(enum)
    kinds = _schema.variants(enum)
    if len(given) != 1 or next(iter(given)) not in kinds:
        return False
    # {"constant": 0.5} is a spectrum as well; what is inside decides.
    ((name, content),) = given.items()
    return name != "constant" or isinstance(content, (Mapping, tuple, list)) or enum == "IndexOfRefraction"


def _number(value: Any, where: str) -> float:
    if not _is_number(value) or math.isnan(float(value)):
        raise SceneError(f"{where} cannot be {value!r}: expected a number")
    return max(-LARGEST, min(LARGEST, float(value)))


def _integer(value: Any, where: str) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not 0 <= value < 1 << 32:
        raise SceneError(f"{where} cannot be {value!r}: expected a whole number from 0")
    return int(value)


def _matrix(value: Any, where: str) -> list[list[float]]:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape == (3, 4):
        array = np.vstack([array, [0, 0, 0, 1]])
    if array.shape != (4, 4) or not np.isfinite(array).all():
        raise SceneError(f"{where}: expected a matrix of shape (4, 4), such as look_at or translate give")
    if abs(np.linalg.det(array)) == 0.0:
        raise SceneError(f"{where}: the matrix has no inverse")
    return array.tolist()  # type: ignore[no-any-return]


def _plain(type_name: str) -> str:
    return type_name.removesuffix("Desc").lower()


def _did_you_mean(name: Any, known: Iterable[str]) -> str:
    names = sorted(known)
    near = difflib.get_close_matches(str(name), names, n=1) if name is not None else []
    if near:
        return f"did you mean `{near[0]}`?"
    return f"there are {', '.join(names)}" if names else "there is none"
