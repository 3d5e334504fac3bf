"""A SynthesisTask to a JSON value that reads back as the same task."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import Any

import numpy as np

from planar.document.schema import FORMAT_VERSION
from planar.document.writer import quantity_writer, write_mechanism
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.entry_reader import QuantityWriter
from planar.synthesis.task.synthesis_task import (
    ChainStart,
    Demands,
    SynthesisTask,
    Wanted,
    WantedFunction,
    WantedPath,
    WantedPoses,
)
from planar.synthesis.task.task_numbers import start_numbers, task_motion_kind
from planar.synthesis.task.task_schema import ONE_BRANCH, WHOLE_TURN


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
    value["start"] = _write_starts(task)
    for k, each in enumerate(task.wanted):
        _check_shapes(each, f"$.wanted[{k}]")
    value["wanted"] = [_write_wanted(each, task, quantity) for each in task.wanted]
    if task.free:
        value["free"] = list(task.free)
    if task.within:
        kinds = _number_kinds(task)
        value["within"] = {
            name: [quantity(each, kinds.get(name, "number")) if isfinite(each) else None for each in both]
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


def _write_starts(task: SynthesisTask) -> Any:
    if isinstance(task.starts, ChainStart):
        return {"chains": list(task.starts.links)}
    written = [write_mechanism(each) for each in task.starts]
    return written[0] if len(written) == 1 else written


def _number_kinds(task: SynthesisTask) -> dict[str, str]:
    """What each number that starts have is."""
    starts = () if isinstance(task.starts, ChainStart) else task.starts
    return {name: each.kind for start in starts for name, each in start_numbers(start, task.wanted).items()}


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
