"""The JSON Schema of mechanism files, and the keys that the reader knows from it.

What a schema cannot say (that a link exists, that a triangle closes, that a unit is one of length) the reader says.
"""

from __future__ import annotations

from typing import Any

from planar.foundation.units import LONGEST
from planar.model.input_laws import MOST, MOTIONS, Piece
from planar.model.mechanism import HUGE, QUANTITIES, TINY
from planar.model.pairs import Pair, pair_types
from planar.model.pairs.base import Schema, described, several

FORMAT = 1
FORBIDDEN = ".:,"
GEOMETRY = ("given", "recovered", "fitted", "underdetermined")
SENSES = ("clockwise", "anticlockwise", "to the left", "to the right", "upwards", "downwards")

_TEXT: Schema = {"type": "string"}
_TEXTS: Schema = {"type": "array", "items": _TEXT}
_BOUNDED: Schema = {"type": "number", "exclusiveMinimum": -HUGE, "exclusiveMaximum": HUGE}
_FROM_ZERO: Schema = {"type": "number", "minimum": 0, "exclusiveMaximum": HUGE}
_ABOVE_ZERO: Schema = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": HUGE}
_SIZE: Schema = {"type": "number", "minimum": TINY, "exclusiveMaximum": HUGE}
_NUMBER = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*(?![eE][+-]?[0-9])[A-Za-zµμΩ°]"
"""A number and the beginning of its unit."""


def _quantity(number: Schema, sign: str, such: str) -> Schema:
    text = {"type": "string", "pattern": rf"^\s*{sign}{_NUMBER}", "maxLength": LONGEST}
    return {"anyOf": [number, text], "description": f"a number in the declared unit, or a text such as {such!r}"}


def _object(properties: Schema, *required: str, **more: Any) -> Schema:
    return {
        "type": "object",
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
    } | more


def _named(values: Schema, **more: Any) -> Schema:
    """An object whose keys are names."""
    return {"type": "object", "propertyNames": described("name"), "additionalProperties": values} | more


def _vector(kind: str) -> Schema:
    return several(kind, 2, 2)


UNITS: Schema = {"length": _TEXT, "angle": _TEXT}
ALONG: Schema = {
    "along": several("name", 2, 2) | {"uniqueItems": True},
    "distance": described("length"),
    "angle": described("angle"),
}
DISTANCES: Schema = {
    "distances": _named(described("size"), minProperties=2, maxProperties=2),
    "left_of": several("name", 2, 2),
    "right_of": several("name", 2, 2),
}
LINK: Schema = {
    "ends": several("name", 2, 2) | {"uniqueItems": True},
    "length": described("size"),
    "points": _named(described("place")),
    "axis": several("name", 2, 2) | {"uniqueItems": True},
}
INPUT: Schema = {
    "pair": _TEXT,
    "position": described("quantity"),
    "velocity": described("quantity"),
    "acceleration": described("quantity"),
    "law": {"anyOf": [described("piece"), several("piece", 1, MOST)]},
}
DRIVE: Schema = {key: INPUT[key] for key in ("position", "velocity", "acceleration")}
VARIES: Schema = {"with": _TEXT, "at": several("quantity", 2, MOST), "factors": several("number", 2, MOST)}
AT_A_PIN: Schema = {
    "description": "at a pin: on the link that slides there, else on the first, or on the one that is named, as rod.B"
}
"""Of the name of a point where something acts."""
FORCE: Schema = {"point": _TEXT | AT_A_PIN, "force": _vector("quantity"), "axes": _TEXT, "varies": described("varies")}
TORQUE: Schema = {"link": _TEXT, "torque": described("quantity"), "varies": described("varies")}
EFFORT: Schema = {
    "pair": _TEXT,
    "force": described("quantity"),
    "torque": described("quantity"),
    "varies": described("varies"),
}
SPRING: Schema = {
    "points": several("text", 2, 2) | {"uniqueItems": True} | AT_A_PIN,
    "stiffness": described("amount"),
    "free_length": described("amount"),
    "damping": described("amount"),
}
TORSION: Schema = {
    "links": several("name", 2, 2) | {"uniqueItems": True},
    "stiffness": described("amount"),
    "free_angle": described("angle"),
    "damping": described("amount"),
}
MASS: Schema = {
    "link": _TEXT,
    "mass": described("amount"),
    "at": described("spot"),
    "inertia": described("amount"),
}
PUBLISHED: Schema = {
    "symbol": _TEXT,
    "quantity": {"enum": list(QUANTITIES)},
    "of": _TEXT,
    "value": {"anyOf": [{"type": "null"}, described("quantity")]},
    "tolerance": {"type": "number", "minimum": 0, "exclusiveMaximum": HUGE},
    "relative_to": _TEXT,
    "component": {"enum": ["x", "y"]},
    "sense": {"enum": list(SENSES)},
    "case": _TEXT,
    "note": _TEXT,
    "slip": _TEXT,
    "inputs": described("drives"),
    "from": described("drives"),
}
TOP: Schema = {
    "planar": {"const": FORMAT},
    "name": _TEXT,
    "ids": _TEXTS,
    "about": _TEXT,
    "source": _TEXT,
    "geometry": {"enum": list(GEOMETRY)},
    "notes": _TEXTS,
    "units": _object(UNITS),
    "frame": _TEXT,
    "links": _named(described("link"), minProperties=1),
    "pairs": {"type": "array", "items": described("pair")},
    "inputs": {"type": "array", "items": _object(INPUT, "pair", "position")},
    "loads": {
        "type": "array",
        "items": {
            "anyOf": [
                _object(FORCE, "point", "force"),
                _object(TORQUE, "link", "torque"),
                _object(EFFORT, "pair", oneOf=[{"required": ["force"]}, {"required": ["torque"]}]),
            ]
        },
    },
    "springs": {
        "type": "array",
        "items": {
            "anyOf": [
                _object(kind, ends, anyOf=[{"required": ["stiffness"]}, {"required": ["damping"]}])
                for kind, ends in ((SPRING, "points"), (TORSION, "links"))
            ]
        },
    },
    "masses": {"type": "array", "items": _object(MASS, "link", "mass", "at")},
    "gravity": _vector("quantity"),
    "sketch": {"type": "object", "additionalProperties": _vector("length")},
    "published": {"type": "array", "items": _object(PUBLISHED, "symbol", "quantity", "of")},
}
"""Every key of a file, and what its value is."""


def schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a mechanism file."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A planar mechanism",
        **_object(TOP, "planar", "frame", "links", "pairs"),
        "$defs": {
            "name": {
                "type": "string",
                "pattern": rf"^[^{FORBIDDEN}]*[^\s{FORBIDDEN}][^{FORBIDDEN}]*$",
                "description": f"contains none of {' '.join(FORBIDDEN)}",
            },
            "text": _TEXT,
            "number": _BOUNDED,
            "quantity": _quantity(_BOUNDED, "[+−-]?", "10.5 rad/s"),
            "length": _quantity(_BOUNDED, "[+−-]?", "50 mm"),
            "amount": _quantity(_FROM_ZERO, "[+]?", "2 kg"),
            "size": _quantity(_SIZE, "[+]?", "50 mm"),
            "angle": _quantity(_BOUNDED, "[+−-]?", "60 deg"),
            "spot": {"anyOf": [_TEXT, _vector("length")], "description": "a point of the link, or [x, y]"},
            "place": {
                "anyOf": [
                    _vector("length"),
                    _object(ALONG, "along", "distance"),
                    _object(DISTANCES, "distances", oneOf=[{"required": ["left_of"]}, {"required": ["right_of"]}]),
                ]
            },
            "link": _object(
                LINK,
                dependentRequired={"length": ["ends"], "ends": ["length"]},
                anyOf=[
                    {"required": ["ends"]},
                    {"properties": {"points": {"minProperties": 1}}, "required": ["points"]},
                ],
                **{"not": {"required": ["ends", "axis"]}},
            ),
            "varies": _object(VARIES, "at", "factors"),
            "time": _quantity(_ABOVE_ZERO, "[+]?", "0.5 s"),
            "piece": {"oneOf": [_piece(kind) for kind in MOTIONS.values()]},
            "drives": {"type": "object", "additionalProperties": _object(DRIVE)},
            "pair": {"oneOf": [_pair(kind) for kind in pair_types().values()]},
        },
    }


def _pair(kind: type[Pair]) -> Schema:
    properties = {kind.keyword: described("name"), **kind.members}
    return _object(properties, kind.keyword, *kind.required) | dict(kind.rule)


def _piece(kind: type[Piece]) -> Schema:
    """The schema of one motion of an input's law."""
    values = {"time": described("time"), "number": {"type": "number", "exclusiveMinimum": 0, "maximum": 1}}
    properties: Schema = {"motion": {"const": kind.motion}}
    for name, key in kind.keys.items():
        value = values.get(key.what, described("quantity"))
        properties[name] = several("quantity", 2, MOST) if key.many else value
    return _object(properties, "motion", *(name for name, key in kind.keys.items() if key.needed))
