"""What a description can be made of, as the compiled half tells it: kinds, their fields, defaults.

Nothing is written twice: the types are Rust's, in ``crates/scene-desc``, and this module reads their schema.
"""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from typing import Any

from . import _native

Schema = dict[str, Any]

FAMILIES: dict[str, tuple[str, str, str]] = {
    "CameraDesc": ("kind", "CameraKind", "Camera"),
    "LightDesc": ("kind", "LightKind", "Light"),
    "MaterialDesc": ("kind", "MaterialKind", "Material"),
    "MediumDesc": ("kind", "MediumKind", "Medium"),
    "TextureDesc": ("node", "TextureNode", "Texture"),
    "ShapeDesc": ("geometry", "Geometry", ""),
}
"""Structs that Python flattens with the enum inside them: struct → (field, enum, ending of the classes' names)."""

WITH_ARRAYS = {"mesh", "bilinear_mesh", "loop_subdiv", "curve"}
"""Shapes that are made of arrays, which do not travel as JSON."""


@dataclass(frozen=True)
class Kind:
    """A variant of an enum, or a struct: its fields and what they are if not given."""

    name: str
    doc: str
    fields: dict[str, Schema]
    defaults: dict[str, Any]
    unit: bool = False
    """A variant without content."""
    single: Schema | None = None
    """A variant whose content is one value without a name."""


@functools.cache
def _all() -> tuple[dict[str, Schema], dict[str, Any], Schema]:
    schema, prototypes = (json.loads(text) for text in _native.schema())
    return schema["$defs"], prototypes, schema


def definition(name: str) -> Schema:
    """A named type."""
    return _all()[0][name]


def reference(schema: Schema) -> str | None:
    """The name of the type that a schema refers to."""
    ref = schema.get("$ref")
    return None if ref is None else str(ref).rsplit("/", 1)[-1]


def optional(schema: Schema) -> Schema | None:
    """What a schema is beside null, if it can be null."""
    of = schema.get("anyOf", [])
    if any(s.get("type") == "null" for s in of):
        return next(s for s in of if s.get("type") != "null")  # type: ignore[no-any-return]
    if isinstance(schema.get("type"), list) and "null" in schema["type"]:
        rest = [t for t in schema["type"] if t != "null"]
        return {**schema, "type": rest[0] if len(rest) == 1 else rest}
    return None


def is_enum(schema: Schema) -> bool:
    """Is it one of several kinds?"""
    return "oneOf" in schema or "enum" in schema


@functools.cache
def struct(name: str) -> Kind:
    """A struct by the name of its type."""
    schema, default = definition(name), _all()[1].get(name, {})
    return _fields(name, schema.get("description", ""), schema, default if isinstance(default, dict) else {})


@functools.cache
def variants(name: str) -> dict[str, Kind]:
    """The kinds of an enum by their names."""
    schema, prototypes = definition(name), _all()[1].get(name, [])
    defaults: dict[str, Any] = {}
    for prototype in prototypes:
        if isinstance(prototype, dict):
            defaults.update(prototype)
    found: dict[str, Kind] = {}
    for one in schema.get("oneOf", [schema]):
        doc = one.get("description", "")
        if one.get("type") == "string":
            for unit in [one["const"]] if "const" in one else one["enum"]:
                found[unit] = Kind(unit, doc, {}, {}, unit=True)
            continue
        ((variant, content),) = one["properties"].items()
        given = defaults.get(variant, {})
        inner = definition(ref) if (ref := reference(content)) else content
        if "properties" in inner and "oneOf" not in inner:
            found[variant] = _fields(variant, doc, inner, given)
        else:
            found[variant] = Kind(variant, doc, {}, {}, single=content)
    return found


def _fields(name: str, doc: str, schema: Schema, default: dict[str, Any]) -> Kind:
    properties = schema.get("properties", {})
    required = schema.get("required", [])
    order = [*required, *(p for p in properties if p not in required)]
    fields = {p: properties[p] for p in order}
    optionals = {p: s.get("default") for p, s in fields.items() if optional(s) is not None or p not in required}
    return Kind(name, doc, fields, {**optionals, **default})


@functools.cache
def flat(family: str) -> dict[str, Kind]:
    """The kinds of a flattened family: a variant's fields, then those of the struct around it."""
    field, enum, _ = FAMILIES[family]
    around = struct(family)
    outer = {n: s for n, s in around.fields.items() if n != field}
    common = {
        "name": "",
        "world_from_object": IDENTITY,
        "world_from_light": IDENTITY,
        "world_from_medium": IDENTITY,
        "reverse_orientation": False,
        "phase": "isotropic",
    }
    defaults = {n: v for n, v in {**common, **around.defaults}.items() if n in outer}
    kinds = {}
    for name, kind in variants(enum).items():
        fields = {**kind.fields, **{n: s for n, s in outer.items() if n not in kind.fields}}
        kinds[name] = Kind(name, kind.doc, fields, {**defaults, **kind.defaults}, single=kind.single)
    return kinds


IDENTITY = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
