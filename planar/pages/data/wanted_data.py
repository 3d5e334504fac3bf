"""What is wanted of a mechanism as its page carries it: places, poses, functions, and which dimensions may follow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from planar.document.dimensions import file_dimensions, find_dimension
from planar.foundation.errors import BadInput, join_names
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind
from planar.synthesis.task.starts import free_numbers, with_wanted_points
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction, WantedPoses
from planar.synthesis.task.wanted_results import carried_name

LEAST_LENGTH = 1e-3
"""Of the mechanism's size: a length that follows gets no shorter."""
FARTHEST = 1e3
"""Of the mechanism's size: as far go dimensions without bounds."""


class PageTask(NamedTuple):
    """What a page shows as wanted of its mechanism, and what of the mechanism follows when that is dragged.

    `free` are the numbers of the file that follow, by name, each with its bounds (SI) or None; left out, all that a
    page changes.
    """

    wanted: Sequence[Wanted]
    free: Mapping[str, tuple[float, float] | None] | None = None


def apply_task(mechanism: Mechanism, task: SynthesisTask) -> tuple[Mechanism, PageTask]:
    """A mechanism with its wanted points as coordinates in their links, and what its page shows of the task.

    Raises BadInput where it lacks what the task names, or has no input.
    """
    if not mechanism.inputs:
        raise BadInput("task", f"{mechanism.name!r} has no input, so that it comes to no other place")
    ready = replace(with_wanted_points(mechanism, task, {}), notes=mechanism.notes)
    free = free_numbers(task, ready)
    bounds = zip(free.lower.tolist(), free.upper.tolist(), strict=True)
    return ready, PageTask(task.wanted, dict(zip(free.names, bounds, strict=True)))


def wanted_data(mechanism: Mechanism, data: Mapping[str, Any], task: PageTask | None) -> dict[str, Any] | None:
    """What the scripts read, beside the other data of the page; None where nothing is wanted.

    Raises BadInput for a point, a link, a pair or a number that is not there.
    """
    if task is None or not task.wanted:
        return None
    places = [each.places for each in task.wanted if not isinstance(each, WantedFunction)]
    extent = float(np.ptp(np.concatenate(places), axis=0).max()) if places else 0.0
    size = extent or float(data["size"])
    free, unmoved = _free_dimensions(mechanism, data, task.free)
    return {
        "items": [_item(mechanism, item, size, f"wanted[{index}]") for index, item in enumerate(task.wanted)],
        "free": free,
        "input": 0,
        "unmoved": unmoved,
    }


def _free_dimensions(
    mechanism: Mechanism, data: Mapping[str, Any], free: Mapping[str, tuple[float, float] | None] | None
) -> tuple[list[dict[str, Any]], list[str]]:
    """The dimensions of the page that follow, each with its bounds (m), and what the page does not change."""
    known = file_dimensions(mechanism)
    given = dict.fromkeys(each["name"] for each in data["dimensions"]) if free is None else free
    wanted = {find_dimension(known, name).name: bounds for name, bounds in given.items()}
    size, found = float(data["size"]), []
    for k, each in enumerate(data["dimensions"]):
        if each["name"] not in wanted:
            continue
        low, high = wanted.pop(each["name"]) or (-np.inf, np.inf)
        below, above = each["bounds"]
        least = LEAST_LENGTH if each["positive"] else -FARTHEST
        low = max(low, least * size, -np.inf if below is None else below)
        high = min(high, FARTHEST * size, np.inf if above is None else above)
        found.append({"k": k, "low": low, "high": high})
    return found, list(wanted)


def _item(mechanism: Mechanism, item: Wanted, size: float, place: str) -> dict[str, Any]:
    """One item, whatever its kind with all keys that any has."""
    found: dict[str, Any] = {
        "of": item.of,
        "size": size,
        "scale": 1.0,
        "slides": False,
        "places": None,
        "angles": None,
        "values": None,
        "inputs": None if item.inputs is None else item.inputs.tolist(),
        "weights": item.weights.tolist(),
        "is_absolute": item.is_absolute,
        "in_order": False,
        "is_closed": False,
        "value_is_free": False,
        "tolerance": item.tolerance,
    }
    if isinstance(item, WantedFunction):
        return found | _function(mechanism, item, size, place)
    found |= {"places": item.places.tolist(), "in_order": item.in_order}
    if isinstance(item, WantedPoses):
        if item.link not in {each.name for each in mechanism.links} - {mechanism.frame}:
            raise BadInput(place, f"there is no moving link {item.link!r}")
        return found | {"kind": "poses", "angles": item.angles.tolist(), "angular": [False, False, True]}
    name = _point_name(mechanism, carried_name(mechanism, item.point), place)
    return found | {"kind": "path", "of": name, "is_closed": item.is_closed, "angular": [False, False]}


def _point_name(mechanism: Mechanism, point: str, place: str) -> str:
    """The name that results give a point."""
    every = named_points(mechanism)
    for each in every:
        if each.name == point or any(f"{link}.{own}" == point for link, own in each.members):
            return each.name
    raise BadInput(place, f"there is no point {point!r}; points are {join_names(each.name for each in every)}")


def _function(mechanism: Mechanism, item: WantedFunction, size: float, place: str) -> dict[str, Any]:
    """Which of the numbers that pairs report is that of the pair, and how a miss of it counts."""
    motions, first = relative_motions(mechanism), mechanism.inputs[0].pair
    if item.to_pair not in motions:
        raise BadInput(place, f"there is no pair {item.to_pair!r}; pairs are {join_names(motions)}")
    if item.from_pair != first:
        raise BadInput(place, f"a function of the input {first!r} is wanted, and not of {item.from_pair!r}")
    at = 0
    for own, pair in motions.items():
        if own == item.to_pair:
            break
        at += sum(each is not None for each in pair.results(0.0, 0.0, 0.0).values())
    slides = motions[item.to_pair].input_kind is MeasureKind.LENGTH
    return {
        "kind": "function",
        "from": first,
        "number": at,
        "slides": slides,
        "scale": size if slides else 1.0,
        "values": item.values.tolist(),
        "angular": [item.is_absolute and not slides],
        "value_is_free": not item.is_absolute,
    }
