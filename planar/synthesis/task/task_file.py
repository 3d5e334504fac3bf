"""The JSON Schema of task files, and a task written as one.

As for mechanism files, the reader checks what a schema cannot: that a link exists, or that bounds are in order.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import Any

import numpy as np

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
from planar.document.writer import quantity_writer, write_mechanism
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.entry_reader import QuantityWriter
from planar.model.pairs.base import Schema, described, list_schema, schema_reference
from planar.synthesis.task.starts import start_numbers, task_motion_kind
from planar.synthesis.task.synthesis_task import (
    ChainStart,
    Demands,
    SynthesisTask,
    Wanted,
    WantedFunction,
    WantedPath,
    WantedPoses,
)

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


def write_task(task: SynthesisTask) -> dict[str, Any]:
    """The JSON value of a task, in its own units; `read_task` gives the same task back, to the last bit.

    Raises BadInput for a task made in Python whose arrays do not fit one another.

    >>> import json, planar
    >>> wanted = [{"point": "E", "through": [["0 mm", "0 mm"], ["20 mm", "12 mm"]]}]
    >>> task = planar.read_task({"planar": 1, "name": "Lid", "start": "four-bar", "wanted": wanted})
    >>> planar.read_task(json.loads(json.dumps(planar.write_task(task))))
    <SynthesisTask 'Lid': 2 wanted entries>
    """
    quantity = quantity_writer(task.units)
    value: dict[str, Any] = {"planar": FORMAT_VERSION, "name": task.name}
    value["units"] = {key: unit for key, unit in task.units._asdict().items() if unit}
    starts = () if isinstance(task.starts, ChainStart) else task.starts
    written = [write_mechanism(start) for start in starts]
    if isinstance(task.starts, ChainStart):
        value["start"] = {"chains": list(task.starts.links)}
    else:
        value["start"] = written[0] if len(written) == 1 else written
    for k, each in enumerate(task.wanted):
        _check_shapes(each, f"$.wanted[{k}]")
    value["wanted"] = [_write_wanted(item, task, quantity) for item in task.wanted]
    if task.free:
        value["free"] = list(task.free)
    if task.within:
        numbers = (start_numbers(start, task.wanted) for start in starts)
        kinds = {name: dimension.kind for known in numbers for name, dimension in known.items()}
        value["within"] = {
            name: [quantity(part, kinds.get(name, "number")) if isfinite(part) else None for part in both]
            for name, both in task.within.items()
        }
    demands = list(_write_demands(task.demands, quantity))
    return value | ({"demands": demands} if demands else {})


def _check_shapes(wanted: Wanted, place: str) -> None:
    """Refuse arrays that are not of so many entries, or hold no numbers."""
    many = len(wanted.weights)
    shapes = {"places": (many, 2), "angles": (many,), "inputs": (many,), "values": (many,), "weights": (many,)}
    for name, shape in shapes.items():
        value = getattr(wanted, name, None)
        if value is None:
            continue
        found = np.shape(value)
        if found != shape:
            raise BadInput(place, f"{name} of {many} entries have the shape {shape}, not {found}")
        if not np.isfinite(np.asarray(value, float)).all():
            raise BadInput(place, f"{name} are finite numbers")


def _write_wanted(wanted: Wanted, task: SynthesisTask, quantity: QuantityWriter) -> dict[str, Any]:
    if isinstance(wanted, WantedFunction):
        return _write_function(wanted, task, quantity)
    flags = {"in_order": wanted.in_order, "absolute": wanted.is_absolute}
    told: dict[str, Any] = {key: True for key, is_set in flags.items() if is_set}
    if wanted.tolerance is not None:
        told["tolerance"] = quantity(wanted.tolerance, "length")
    entries: list[dict[str, Any]] = [{"at": [quantity(each, "length") for each in place]} for place in wanted.places]
    if isinstance(wanted, WantedPoses):
        for entry, angle in zip(entries, wanted.angles, strict=True):
            entry["angle"] = quantity(angle, "angle")
    _add_timing(entries, wanted, task_motion_kind(task), quantity)
    if isinstance(wanted, WantedPoses):
        return {"link": wanted.link, "poses": entries, **told}
    own: dict[str, Any] = {"point": wanted.point} | ({} if wanted.link is None else {"on": wanted.link})
    own["through"] = [each["at"] if len(each) == 1 else each for each in entries]
    return own | told | ({"closed": True} if wanted.is_closed else {})


def _add_timing(
    entries: list[dict[str, Any]], wanted: WantedPath | WantedPoses, kind: str, quantity: QuantityWriter
) -> None:
    """Add the input and the weight of each entry, where they are not left out."""
    inputs: Array | list[None] = [None] * len(entries) if wanted.inputs is None else wanted.inputs
    for entry, given, weight in zip(entries, inputs, wanted.weights, strict=True):
        if given is not None:
            entry["input"] = quantity(given, kind)
        if weight != 1.0:
            entry["weight"] = float(weight)


def _write_function(wanted: WantedFunction, task: SynthesisTask, quantity: QuantityWriter) -> dict[str, Any]:
    kinds = task_motion_kind(task, wanted.from_pair), task_motion_kind(task, wanted.to_pair)
    pairs: list[Any] = []
    for given, value, weight in zip(wanted.inputs, wanted.values, wanted.weights, strict=True):
        both = [quantity(given, kinds[0]), quantity(value, kinds[1])]
        pairs.append(both if weight == 1.0 else {"at": both, "weight": float(weight)})
    told: dict[str, Any] = {"from": wanted.from_pair, "to": wanted.to_pair, "pairs": pairs}
    if wanted.is_absolute:
        told["absolute"] = True
    if wanted.tolerance is not None:
        told["tolerance"] = quantity(wanted.tolerance, kinds[1])
    return told


def _write_demands(demands: Demands, quantity: QuantityWriter) -> Iterator[Any]:
    if demands.whole_turn:
        yield WHOLE_TURN
    if demands.one_branch:
        yield ONE_BRANCH
    if demands.transmission is not None:
        yield {"transmission": quantity(demands.transmission, "angle")}
    if demands.inside is not None:
        yield {"inside": [[quantity(each, "length") for each in corner] for corner in demands.inside]}
