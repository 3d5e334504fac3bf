"""The JSON Schema of task files, and the keys that the reader knows from it.

As of mechanism files, the reader says what a schema cannot: that a link exists, or that bounds are the right way round.
"""

from __future__ import annotations

from typing import Any

from planar.document.schema import (
    ABOVE_ZERO,
    FORMAT_VERSION,
    TEXT,
    UNITS_SCHEMA,
    object_schema,
    quantity_schema,
    schema,
    vector_schema,
)
from planar.model.pairs.base import Schema, described, list_schema, schema_reference

WHOLE_TURN, ONE_BRANCH = "whole turn", "one branch"
DEMAND_WORDS = (WHOLE_TURN, ONE_BRANCH)
LEAST_CHAIN, GREATEST_CHAIN = 4, 12
"""Links of chains to start from."""
LEAST_CLOSED = 4
"""Places of a closed curve."""
MAX_CORNERS = 1000
"""Of a polygon."""

_FLAG: Schema = {"type": "boolean"}
_INPUT = described(schema_reference("quantity"), "where the running input is there; given for all or for none")
_WEIGHT = described(ABOVE_ZERO, "how much its squared miss counts; left out: 1")
_IN_ORDER = described(_FLAG, "true: they are met one after the other, either way round; left out: in any order")
_ABSOLUTE = described(
    _FLAG, "true: inputs are positions of the pair itself; left out: they count by their differences from the first"
)
_TOLERANCE = described(
    schema_reference("amount"), "the greatest miss that is accepted, 0: it is to be met exactly; left out: any"
)

PLACE_SCHEMA: Schema = {
    "at": described(vector_schema("length"), "the place, in the frame's axes"),
    "input": _INPUT,
    "weight": _WEIGHT,
}
PATH_SCHEMA: Schema = {
    "point": described(TEXT, "the point that is to come there"),
    "on": described(TEXT, "the link that carries it, where the mechanism to start from has no such point"),
    "through": described(
        {
            "type": "array",
            "items": {"anyOf": [vector_schema("length"), object_schema(PLACE_SCHEMA, "at")]},
            "minItems": 1,
        },
        "the places, each [x, y] in the frame's axes, or with its input and weight",
    ),
    "in_order": _IN_ORDER,
    "closed": described(_FLAG, "true: they lie round a closed curve, in their order, which takes a whole turn"),
    "absolute": _ABSOLUTE,
    "tolerance": _TOLERANCE,
}
POSE_SCHEMA: Schema = {
    "at": described(vector_schema("length"), "where the origin of the link's axes is, in the frame's axes"),
    "angle": described(schema_reference("angle"), "of the link's x-axis, anticlockwise from the frame's"),
    "input": _INPUT,
    "weight": _WEIGHT,
}
POSES_SCHEMA: Schema = {
    "link": described(TEXT, "the link that is to take the poses"),
    "poses": described(
        {"type": "array", "items": object_schema(POSE_SCHEMA, "at", "angle"), "minItems": 1}, "the poses"
    ),
    "in_order": _IN_ORDER,
    "absolute": _ABSOLUTE,
    "tolerance": _TOLERANCE,
}
FUNCTION_PAIR_SCHEMA: Schema = {
    "at": described(list_schema("quantity", 2, 2), "the position of the input, and that of the other pair"),
    "weight": _WEIGHT,
}
FUNCTION_SCHEMA: Schema = {
    "from": described(TEXT, "the pair of the running input"),
    "to": described(TEXT, "the pair whose position is to be a function of it"),
    "pairs": described(
        {
            "type": "array",
            "items": {"anyOf": [list_schema("quantity", 2, 2), object_schema(FUNCTION_PAIR_SCHEMA, "at")]},
            "minItems": 1,
        },
        "positions of the two, as [20, 31], or with a weight",
    ),
    "absolute": described(
        _FLAG, "true: both are positions of the pairs themselves; left out: they count by their differences"
    ),
    "tolerance": _TOLERANCE,
}
DEMAND_SCHEMA: Schema = {
    "transmission": described(
        schema_reference("positive"), "the least transmission angle of every output, below a right angle"
    ),
    "inside": described(
        {"type": "array", "items": vector_schema("length"), "minItems": 2, "maxItems": MAX_CORNERS},
        "two opposite corners of a rectangle, or a polygon's corners, that all points stay in",
    ),
}
CHAIN_START_SCHEMA: Schema = {
    "chains": described(
        {
            "type": "array",
            "items": {"type": "integer", "minimum": LEAST_CHAIN, "maximum": GREATEST_CHAIN},
            "minItems": 1,
        },
        "all kinematic chains of so many links, with every fixed link, input and carrier of the point that differ",
    ),
}
_START: Schema = {"anyOf": [described(TEXT, "a file or a model"), schema_reference("mechanism")]}
_BOUND: Schema = {"anyOf": [{"type": "null"}, schema_reference("quantity")]}
TASK_SCHEMA: Schema = {
    "planar": described({"const": FORMAT_VERSION}, "the version of this form of file"),
    "name": described(TEXT, "the task's name, as titles have it"),
    "units": described(object_schema(UNITS_SCHEMA), "the units of bare numbers in this file, and of results"),
    "start": described(
        {
            "anyOf": [
                *_START["anyOf"],
                {"type": "array", "items": _START, "minItems": 1},
                object_schema(CHAIN_START_SCHEMA, "chains"),
            ]
        },
        "what to start from: a mechanism's file or a model's name, a mechanism itself, several in a list, or chains",
    ),
    "wanted": described(
        {
            "type": "array",
            "items": {
                "anyOf": [
                    object_schema(PATH_SCHEMA, "point", "through"),
                    object_schema(POSES_SCHEMA, "link", "poses"),
                    object_schema(FUNCTION_SCHEMA, "from", "to", "pairs"),
                ]
            },
            "minItems": 1,
        },
        "what one linkage is to do: paths, poses and functions, all of them together",
    ),
    "free": described(
        {"type": "array", "items": TEXT, "minItems": 1},
        "the numbers that are sought, by their names as `planar inspect` lists them; AD.D: both coordinates; left "
        "out: all that the motion depends on",
    ),
    "within": described(
        {
            "type": "object",
            "additionalProperties": {"type": "array", "items": _BOUND, "minItems": 2, "maxItems": 2},
        },
        "bounds of numbers, by their names, as [20, 80]; null where there is none",
    ),
    "demands": described(
        {
            "type": "array",
            "items": {"anyOf": [{"enum": [*DEMAND_WORDS]}, object_schema(DEMAND_SCHEMA, minProperties=1)]},
        },
        "what is to be kept besides",
    ),
}
"""Every key of a task's file, and what its value is."""


def task_schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of a task's file.

    >>> import planar
    >>> planar.task_schema()["title"]
    'A task of synthesis'
    """
    whole = schema()
    kinds = whole.pop("$defs")
    version = whole.pop("$schema")
    positive = quantity_schema(ABOVE_ZERO, "[+]?", "30 deg")
    return {
        "$schema": version,
        "title": "A task of synthesis",
        **object_schema(TASK_SCHEMA, "planar", "start", "wanted"),
        "$defs": {**kinds, "mechanism": whole, "positive": positive},
    }
