"""The JSON Schema of mechanism files, and the keys that the reader knows from it.

What a schema cannot say (that a link exists, that a triangle closes, that a unit is one of length) the reader says.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planar.foundation.units import MAX_QUANTITY_LENGTH
from planar.model.loads import MAX_LAW_ITEMS
from planar.model.mechanism import LARGEST_NUMBER, PUBLISHED_QUANTITIES, SMALLEST_NUMBER
from planar.model.pairs import Pair, pair_types
from planar.model.pairs.base import Schema, list_schema, schema_reference

if TYPE_CHECKING:
    from planar.model.input_laws import LawSegment

FORMAT_VERSION = 1
FORBIDDEN_IN_NAMES = ".:,"
GEOMETRY_SOURCES = ("given", "recovered", "fitted", "underdetermined")
SENSE_WORDS = ("clockwise", "anticlockwise", "to the left", "to the right", "upwards", "downwards")

_TEXT: Schema = {"type": "string"}
_TEXTS: Schema = {"type": "array", "items": _TEXT}
_BOUNDED: Schema = {"type": "number", "exclusiveMinimum": -LARGEST_NUMBER, "exclusiveMaximum": LARGEST_NUMBER}
_FROM_ZERO: Schema = {"type": "number", "minimum": 0, "exclusiveMaximum": LARGEST_NUMBER}
_ABOVE_ZERO: Schema = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": LARGEST_NUMBER}
_POSITIVE_SIZE: Schema = {"type": "number", "minimum": SMALLEST_NUMBER, "exclusiveMaximum": LARGEST_NUMBER}
_NUMBER_WITH_UNIT = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*(?![eE][+-]?[0-9])[A-Za-zµμΩ°]"
"""A number and the beginning of its unit."""


def _quantity_schema(number: Schema, sign: str, such: str) -> Schema:
    text = {"type": "string", "pattern": rf"^\s*{sign}{_NUMBER_WITH_UNIT}", "maxLength": MAX_QUANTITY_LENGTH}
    return {"anyOf": [number, text], "description": f"a number in the declared unit, or a text such as {such!r}"}


def _object_schema(properties: Schema, *required: str, **more: Any) -> Schema:
    return {
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
    } | more


def _named_values_schema(values: Schema, **more: Any) -> Schema:
    """An object whose keys are names."""
    return {"type": "object", "propertyNames": schema_reference("name"), "additionalProperties": values} | more


def _vector_schema(kind: str) -> Schema:
    return list_schema(kind, 2, 2)


UNITS_SCHEMA: Schema = {"length": _TEXT, "angle": _TEXT}
ALONG_SCHEMA: Schema = {
    "along": list_schema("name", 2, 2) | {"uniqueItems": True},
    "distance": schema_reference("length"),
    "angle": schema_reference("angle"),
}
DISTANCES_SCHEMA: Schema = {
    "distances": _named_values_schema(schema_reference("size"), minProperties=2, maxProperties=2),
    "left_of": list_schema("name", 2, 2),
    "right_of": list_schema("name", 2, 2),
}
LINK_SCHEMA: Schema = {
    "ends": list_schema("name", 2, 2) | {"uniqueItems": True},
    "length": schema_reference("size"),
    "points": _named_values_schema(schema_reference("place")),
    "axis": list_schema("name", 2, 2) | {"uniqueItems": True},
}
INPUT_SCHEMA: Schema = {
    "pair": _TEXT,
    "position": schema_reference("quantity"),
    "velocity": schema_reference("quantity"),
    "acceleration": schema_reference("quantity"),
    "law": {"anyOf": [schema_reference("piece"), list_schema("piece", 1, MAX_LAW_ITEMS)]},
}
DRIVE_SCHEMA: Schema = {key: INPUT_SCHEMA[key] for key in ("position", "velocity", "acceleration")}
VARIATION_SCHEMA: Schema = {
    "with": _TEXT,
    "at": list_schema("quantity", 2, MAX_LAW_ITEMS),
    "factors": list_schema("number", 2, MAX_LAW_ITEMS),
}
PIN_POINT_NOTE: Schema = {
    "description": "at a pin: on the link that slides there, else on the first, or on the one that is named, as rod.B"
}
"""Of the name of a point where something acts."""
FORCE_SCHEMA: Schema = {
    "point": _TEXT | PIN_POINT_NOTE,
    "force": _vector_schema("quantity"),
    "axes": _TEXT,
    "varies": schema_reference("varies"),
}
TORQUE_SCHEMA: Schema = {"link": _TEXT, "torque": schema_reference("quantity"), "varies": schema_reference("varies")}
EFFORT_SCHEMA: Schema = {
    "pair": _TEXT,
    "force": schema_reference("quantity"),
    "torque": schema_reference("quantity"),
    "varies": schema_reference("varies"),
}
SPRING_SCHEMA: Schema = {
    "points": list_schema("text", 2, 2) | {"uniqueItems": True} | PIN_POINT_NOTE,
    "stiffness": schema_reference("amount"),
    "free_length": schema_reference("amount"),
    "damping": schema_reference("amount"),
}
TORSION_SPRING_SCHEMA: Schema = {
    "links": list_schema("name", 2, 2) | {"uniqueItems": True},
    "stiffness": schema_reference("amount"),
    "free_angle": schema_reference("angle"),
    "damping": schema_reference("amount"),
}
MASS_SCHEMA: Schema = {
    "link": _TEXT,
    "mass": schema_reference("amount"),
    "at": schema_reference("spot"),
    "inertia": schema_reference("amount"),
}
PUBLISHED_SCHEMA: Schema = {
    "symbol": _TEXT,
    "quantity": {"enum": list(PUBLISHED_QUANTITIES)},
    "of": _TEXT,
    "value": {"anyOf": [{"type": "null"}, schema_reference("quantity")]},
    "tolerance": {"type": "number", "minimum": 0, "exclusiveMaximum": LARGEST_NUMBER},
    "relative_to": _TEXT,
    "component": {"enum": ["x", "y"]},
    "sense": {"enum": list(SENSE_WORDS)},
    "case": _TEXT,
    "note": _TEXT,
    "slip": _TEXT,
    "inputs": schema_reference("drives"),
    "from": schema_reference("drives"),
}
FILE_SCHEMA: Schema = {
    "planar": {"const": FORMAT_VERSION},
    "name": _TEXT,
    "ids": _TEXTS,
    "about": _TEXT,
    "source": _TEXT,
    "geometry": {"enum": list(GEOMETRY_SOURCES)},
    "notes": _TEXTS,
    "units": _object_schema(UNITS_SCHEMA),
    "frame": _TEXT,
    "links": _named_values_schema(schema_reference("link"), minProperties=1),
    "pairs": {"type": "array", "items": schema_reference("pair")},
    "inputs": {"type": "array", "items": _object_schema(INPUT_SCHEMA, "pair", "position")},
    "loads": {
        "type": "array",
        "items": {
            "anyOf": [
                _object_schema(FORCE_SCHEMA, "point", "force"),
                _object_schema(TORQUE_SCHEMA, "link", "torque"),
                _object_schema(EFFORT_SCHEMA, "pair", oneOf=[{"required": ["force"]}, {"required": ["torque"]}]),
            ]
        },
    },
    "springs": {
        "type": "array",
        "items": {
            "anyOf": [
                _object_schema(kind, ends, anyOf=[{"required": ["stiffness"]}, {"required": ["damping"]}])
                for kind, ends in ((SPRING_SCHEMA, "points"), (TORSION_SPRING_SCHEMA, "links"))
            ]
        },
    },
    "masses": {"type": "array", "items": _object_schema(MASS_SCHEMA, "link", "mass", "at")},
    "gravity": _vector_schema("quantity"),
    "sketch": {"type": "object", "additionalProperties": _vector_schema("length")},
    "published": {"type": "array", "items": _object_schema(PUBLISHED_SCHEMA, "symbol", "quantity", "of")},
}
"""Every key of a file, and what its value is."""


def schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a mechanism file."""
    from planar.model.input_laws import SEGMENT_TYPES  # which few files have

    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A planar mechanism",
        **_object_schema(FILE_SCHEMA, "planar", "frame", "links", "pairs"),
        "$defs": {
            "name": {
                "type": "string",
                "pattern": rf"^[^{FORBIDDEN_IN_NAMES}]*[^\s{FORBIDDEN_IN_NAMES}][^{FORBIDDEN_IN_NAMES}]*$",
                "description": f"contains none of {' '.join(FORBIDDEN_IN_NAMES)}",
            },
            "text": _TEXT,
            "number": _BOUNDED,
            "quantity": _quantity_schema(_BOUNDED, "[+−-]?", "10.5 rad/s"),
            "length": _quantity_schema(_BOUNDED, "[+−-]?", "50 mm"),
            "amount": _quantity_schema(_FROM_ZERO, "[+]?", "2 kg"),
            "size": _quantity_schema(_POSITIVE_SIZE, "[+]?", "50 mm"),
            "angle": _quantity_schema(_BOUNDED, "[+−-]?", "60 deg"),
            "spot": {"anyOf": [_TEXT, _vector_schema("length")], "description": "a point of the link, or [x, y]"},
            "place": {
                "anyOf": [
                    _vector_schema("length"),
                    _object_schema(ALONG_SCHEMA, "along", "distance"),
                    _object_schema(
                        DISTANCES_SCHEMA, "distances", oneOf=[{"required": ["left_of"]}, {"required": ["right_of"]}]
                    ),
                ]
            },
            "link": _object_schema(
                LINK_SCHEMA,
                dependentRequired={"length": ["ends"], "ends": ["length"]},
                anyOf=[
                    {"required": ["ends"]},
                    {"properties": {"points": {"minProperties": 1}}, "required": ["points"]},
                ],
                **{"not": {"required": ["ends", "axis"]}},
            ),
            "varies": _object_schema(VARIATION_SCHEMA, "at", "factors"),
            "time": _quantity_schema(_ABOVE_ZERO, "[+]?", "0.5 s"),
            "piece": {"oneOf": [_segment_schema(kind) for kind in SEGMENT_TYPES.values()]},
            "drives": {"type": "object", "additionalProperties": _object_schema(DRIVE_SCHEMA)},
            "pair": {"oneOf": [_pair_schema(kind) for kind in pair_types().values()]},
        },
    }


def _pair_schema(kind: type[Pair]) -> Schema:
    properties = {kind.keyword: schema_reference("name"), **kind.entry_schemas}
    return _object_schema(properties, kind.keyword, *kind.required_keys) | dict(kind.entry_rule)


def _segment_schema(kind: type[LawSegment]) -> Schema:
    """The schema of one motion of an input's law."""
    values = {"time": schema_reference("time"), "number": {"type": "number", "exclusiveMinimum": 0, "maximum": 1}}
    properties: Schema = {"motion": {"const": kind.motion}}
    for name, key in kind.keys.items():
        value = values.get(key.value_kind, schema_reference("quantity"))
        properties[name] = list_schema("quantity", 2, MAX_LAW_ITEMS) if key.is_list else value
    return _object_schema(properties, "motion", *(name for name, key in kind.keys.items() if key.is_required))
