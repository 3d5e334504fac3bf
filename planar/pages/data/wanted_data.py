"""What is wanted of a mechanism as its page carries it: places, poses, functions, and which dimensions may follow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from planar.document.dimensions import file_dimensions, find_dimension
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, join_names
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind

LEAST_LENGTH = 1e-3
"""Of the mechanism's size: a length that follows gets no shorter."""


class PageTask(NamedTuple):
    """What a page shows as wanted of its mechanism, and what of the mechanism follows when that is dragged.

    `wanted` are items of a task: paths of points, poses of links, functions of pairs. `free` are the numbers of the
    file that follow, by name, each with its bounds (SI) or None; left out, all that a page changes.
    """

    wanted: Sequence[Any]
    free: Mapping[str, tuple[float, float] | None] | None = None


def wanted_data(mechanism: Mechanism, data: Mapping[str, Any], task: PageTask | None) -> dict[str, Any] | None:
    """What the scripts read, beside the other data of the page; None where nothing is wanted.

    Raises BadInput for a point, a link, a pair or a number that is not there.
    """
    if task is None or not task.wanted:
        return None
    if not mechanism.inputs:
        raise BadInput("wanted", f"{mechanism.name!r} has no input, so that it comes to no other place")
    places = [each for item in task.wanted if (each := _array(item, "places")) is not None]
    extent = float(np.ptp(np.concatenate(places), axis=0).max()) if places else 0.0
    size = extent or float(data["size"])
    free, unmoved = _free_dimensions(mechanism, data, task.free)
    return {
        "items": [_item(mechanism, item, size, index) for index, item in enumerate(task.wanted)],
        "free": free,
        "input": 0,
        "unmoved": unmoved,
    }


def _free_dimensions(
    mechanism: Mechanism, data: Mapping[str, Any], free: Mapping[str, tuple[float, float] | None] | None
) -> tuple[list[dict[str, Any]], list[str]]:
    """The dimensions of the page that follow, each with its bounds (m), and what the page does not change."""
    known = file_dimensions(mechanism)
    wanted: dict[str, tuple[float, float] | None] = {}
    for name, bounds in (free or dict.fromkeys(each["name"] for each in data["dimensions"])).items():
        both = [f"{name}.{axis}" for axis in "xy"]
        names = both if name not in known and set(both) <= set(known) else [find_dimension(known, name).name]
        wanted |= dict.fromkeys(names, bounds)
    found = []
    least = LEAST_LENGTH * float(data["size"])
    for k, each in enumerate(data["dimensions"]):
        if each["name"] not in wanted:
            continue
        own = wanted.pop(each["name"]) or (-np.inf, np.inf)
        low, high = (np.inf * sign if end is None else end for sign, end in zip((-1, 1), each["bounds"], strict=True))
        low = max(low, own[0], least if each["positive"] else -np.inf)
        far = 1e3 * float(data["size"])
        found.append({"k": k, "low": max(low, -far), "high": min(high, own[1], far)})
    return found, list(wanted)


def _item(mechanism: Mechanism, item: Any, size: float, index: int) -> dict[str, Any]:
    place = f"wanted[{index}]"
    if _value(item, "point") is not None:
        found = {"kind": "path", "of": _point_name(mechanism, item, place), "angular": [False, False]}
    elif _value(item, "link") is not None:
        link = _value(item, "link")
        if link not in {each.name for each in mechanism.links} - {mechanism.frame}:
            raise BadInput(place, f"there is no moving link {link!r}")
        found = {"kind": "poses", "of": link, "angular": [False, False, True]}
    else:
        found = _function(mechanism, item, place)
    values = {key: _array(item, key) for key in ("places", "angles", "inputs", "values", "weights")}
    many = next(len(each) for each in values.values() if each is not None)
    if values["weights"] is None:
        values["weights"] = np.ones(many)
    for key, each in values.items():
        if each is not None and (len(each) != many or not np.isfinite(each).all()):
            raise BadInput(f"{place}.{key}", f"{many} finite entries are wanted, as the others have")
    more = {key: None if each is None else each.tolist() for key, each in values.items()}
    flags = {key: bool(_value(item, key)) for key in ("in_order", "is_closed", "is_absolute")}
    tolerance = _value(item, "tolerance")
    is_function = found["kind"] == "function"
    return (
        {"scale": 1.0, "slides": False}
        | found
        | more
        | flags
        | {
            "size": size,
            "tolerance": None if tolerance is None else float(tolerance),
            "value_is_free": is_function and not flags["is_absolute"],
        }
    )


def _point_name(mechanism: Mechanism, item: Any, place: str) -> str:
    """The name that results give a point."""
    name = str(_value(item, "point"))
    for each in named_points(mechanism):
        if each.name == name or any(f"{link}.{point}" == name for link, point in each.members):
            return each.name
    names = [each.name for each in named_points(mechanism)]
    raise BadInput(place, f"there is no point {name!r}; points are {join_names(names)}")


def _function(mechanism: Mechanism, item: Any, place: str) -> dict[str, Any]:
    """Which of the numbers that pairs report is that of the pair, and how a miss of it counts."""
    motions, name = relative_motions(mechanism), _value(item, "to_pair")
    given, first = _value(item, "from_pair"), mechanism.inputs[0].pair
    if name not in motions:
        raise BadInput(place, f"there is no pair {name!r}; pairs are {join_names(motions)}")
    if given not in (None, first):
        raise BadInput(place, f"a function of the input {first!r} is wanted, and not of {given!r}")
    at = 0
    for own, pair in motions.items():
        if own == name:
            break
        at += sum(each is not None for each in pair.results(0.0, 0.0, 0.0).values())
    slides = motions[name].input_kind is MeasureKind.LENGTH
    return {"kind": "function", "of": name, "from": first, "number": at, "slides": slides, "angular": [False]}


def _value(item: Any, key: str) -> Any:
    return item.get(key) if isinstance(item, Mapping) else getattr(item, key, None)


def _array(item: Any, key: str) -> Array | None:
    """A column of an item; of several columns (n, 2)."""
    value = _value(item, key)
    return None if value is None else np.asarray(value, dtype=float)
