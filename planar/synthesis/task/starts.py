"""The mechanisms that a task starts from, their free numbers, and the units of what is wanted of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planar.derivatives.kinematic_slopes import design_dimensions
from planar.derivatives.result_slopes import tied_dimensions
from planar.document.dimensions import Dimension
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.link_shapes import At, Distances, Link, Point, link_shape
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.wording import amount
from planar.solving.cycle import cycle
from planar.synthesis.task.synthesis_task import (
    ChainStart,
    SynthesisTask,
    Wanted,
    WantedFunction,
    WantedPath,
    WantedPoses,
)
from planar.synthesis.task.wanted_results import (
    carried_name,
    depended_numbers,
    influential_numbers,
    set_apart,
    wanted_slopes,
)

NO_INFLUENCE = 1e-9
"""Of the greatest slope: a number with less does not matter."""


class FreeNumbers(NamedTuple):
    """Numbers of a mechanism that are sought, by name, with bounds (SI, infinite where there is none)."""

    names: tuple[str, ...]
    values: Array
    lower: Array
    upper: Array
    kinds: tuple[str, ...]


def start_mechanisms(task: SynthesisTask) -> Iterator[Mechanism]:
    """Every mechanism that a task starts from, with a point for every path that is wanted, by coordinates in its link.

    Of a chain every choice of a fixed link, an input, and the link that carries a wanted point.
    """
    if isinstance(task.starts, ChainStart):
        yield from _chain_starts(task, task.starts)
        return
    for start in task.starts:
        yield with_wanted_points(start, task, {})


def _chain_starts(task: SynthesisTask, start: ChainStart) -> Iterator[Mechanism]:
    from planar.structures.enumeration.chains import chains

    paths = [item.point for item in task.wanted if isinstance(item, WantedPath)]
    for links in start.links:
        for chain in chains(links):
            for mechanism in chain.mechanisms():
                found = chain.mechanism(mechanism.frame, mechanism.drives)
                known = {point.name for point in named_points(found)}
                names = {point: set_apart(point) if point in known else point for point in paths}
                for link in _carriers(found):
                    carried = {point: (link, names[point]) for point in paths}
                    complete = with_wanted_points(found, task, carried)
                    if _all_links_matter(complete, task):
                        yield complete


def _all_links_matter(mechanism: Mechanism, task: SynthesisTask) -> bool:
    """Whether what is wanted depends on every link; else a simpler chain does as well."""
    motion = cycle(mechanism, 8, pair=mechanism.inputs[0].pair)
    system, derived = wanted_slopes(motion, task.wanted)
    slopes = np.concatenate([*derived.slopes.values()], axis=1)[~derived.is_singular]
    strength = np.abs(slopes * system.parameters.scale).max(axis=(0, 1), initial=0.0)
    dimensions = system.parameters.dimensions
    by_link = {link.name: 0.0 for link in mechanism.links}
    for dimension, own in zip(dimensions, strength[len(strength) - len(dimensions) :], strict=True):
        if dimension.link in by_link:
            by_link[dimension.link] = max(by_link[dimension.link], float(own))
    return min(by_link.values()) > NO_INFLUENCE * max(by_link.values())


def _carriers(mechanism: Mechanism) -> Iterator[str]:
    """The links of which a point may describe a curve: those that move and do not turn about a fixed pivot."""
    beside_frame = {
        link
        for pair in mechanism.pairs
        if mechanism.frame in pair.links
        for link in pair.links
        if link != mechanism.frame
    }
    for link in mechanism.links:
        if link.name != mechanism.frame and link.name not in beside_frame:
            yield link.name


def with_wanted_points(mechanism: Mechanism, task: SynthesisTask, carried: dict[str, tuple[str, str]]) -> Mechanism:
    """The mechanism with its wanted points as coordinates in their link; `carried`: link and name of new ones.

    Links that are to take poses have coordinates throughout, so that their origin is not held to a pin.
    """
    links = {link.name: link for link in mechanism.links}
    known = {point.name: point for point in named_points(mechanism)}
    named = (*task.free, *task.within)
    for each in mechanism.links:  # by distances a point is no longer there where lengths change
        for own in each.points:
            is_named = any(name.startswith(f"{each.name}.{own.name}.") for name in named)
            if isinstance(own.place, Distances) and not is_named:
                links[each.name] = _by_coordinates(links[each.name], own.name)
    for posed in task.wanted:
        if isinstance(posed, WantedPoses) and posed.link in links:
            is_named = any(name.startswith(f"{posed.link}.") for name in named)
            links[posed.link] = links[posed.link] if is_named else _with_free_axes(links[posed.link])
    for path in task.wanted:
        if not isinstance(path, WantedPath):
            continue
        there = known.get(carried_name(mechanism, path.point))
        if there is not None and path.point not in carried:
            link, point = there.members[0]
            links[link] = _by_coordinates(links[link], point)
            continue
        link, point = carried.get(path.point, (path.link or "", path.point))
        if link not in links:
            raise BadInput(
                "$.wanted", f"{mechanism.name!r} has no point {path.point!r}; 'on' names the link for a new one"
            )
        if point not in links[link].names:  # else wanted twice
            links[link] = _with_new_point(links[link], point, max(map(_reach, mechanism.links)))
    changed = replace(mechanism, links=tuple(links.values()), published=(), notes=(), tolerances=None)
    return changed if changed.links != mechanism.links else replace(mechanism, published=(), tolerances=None)


def _by_coordinates(link: Link, point: str) -> Link:
    """The link with a point by its coordinates, where its axes are those in which it was drawn."""
    if link.axis is not None or point in (link.ends or ()):
        return link
    at = link_shape(link).position(point)
    points = tuple(
        Point(each.name, At(float(at.x), float(at.y))) if each.name == point else each for each in link.points
    )
    return replace(link, points=points)


def _with_free_axes(link: Link) -> Link:
    """The link with all of its points by coordinates in its own axes, which then lie anywhere beside its pins."""
    if link.ends is None and link.axis is None:
        return link
    shape = link_shape(link)
    places = {name: shape.position(name) for name in link.names}
    return Link(link.name, tuple(Point(name, At(float(at.x), float(at.y))) for name, at in places.items()))


def _with_new_point(link: Link, point: str, size: float) -> Link:
    """The link with a point more, beside the middle of its others; `size` is that of the greatest link."""
    shape = link_shape(link)
    places = [shape.position(name) for name in link.names]
    x, y = (float(np.mean([getattr(place, part) for place in places])) for part in "xy")
    return replace(link, points=(*link.points, Point(point, At(x, y + 0.5 * (_reach(link) or size or 1.0)))))


def _reach(link: Link) -> float:
    """The greatest distance between points of a link."""
    shape = link_shape(link)
    x, y = (np.array([getattr(shape.position(name), part) for name in link.names]) for part in "xy")
    return float(np.hypot(x[:, None] - x, y[:, None] - y).max())


def free_numbers(task: SynthesisTask, mechanism: Mechanism) -> FreeNumbers:
    """The numbers of a mechanism that a task leaves free, in the order of the file.

    Where it names none these are all lengths and angles of links and pairs that what is wanted depends on, without
    those that cannot change alone. Values beyond bounds are the bounds. Raises BadInput for what is no number of it,
    cannot change alone, or changes nothing that is wanted, and NoAnswer where the mechanism cannot move.
    """
    known = {
        dimension.name: dimension
        for dimension in design_dimensions(mechanism)
        if dimension.path[0] in ("links", "pairs")
    }
    _check_free_names(task, mechanism, known)
    names = tuple(dict.fromkeys(task.free)) or influential_numbers(mechanism, task.wanted)
    chosen = [known[name] for name in names]
    lower, upper = np.array([task.within.get(name, (-np.inf, np.inf)) for name in names]).reshape(-1, 2).T
    values = np.clip([float(each.value) for each in chosen], lower, upper)
    return FreeNumbers(names, values, lower, upper, tuple(each.kind for each in chosen))


def _check_free_names(task: SynthesisTask, mechanism: Mechanism, known: Mapping[str, Dimension]) -> None:
    """Refuse numbers by name that cannot be sought."""
    if not task.free:
        return
    used, tied = depended_numbers(mechanism, task.wanted), {*tied_dimensions(mechanism, task.free)}
    for name in task.free:
        if name not in known:
            raise BadInput("$.free", f"{mechanism.name!r} has no number {name!r} that links and pairs depend on")
        if name in tied:
            told = f"{name!r} of {mechanism.name!r} cannot change alone, as others have to go with it; leave it out"
            raise BadInput("$.free", told)
        if name not in used:
            raise BadInput("$.free", f"nothing that is wanted depends on {name!r} of {mechanism.name!r}; leave it out")


def start_numbers(mechanism: Mechanism, wanted: Sequence[Wanted]) -> dict[str, Dimension]:
    """The numbers of a start's links and pairs by name; those of wanted points are coordinates, however it wrote
    them."""
    paths = tuple(item for item in wanted if isinstance(item, WantedPath))
    ready = with_wanted_points(mechanism, SynthesisTask("", paths, (mechanism,)), {})
    points = {path.point for path in paths}
    members = {point.name: point.members for point in named_points(ready)}
    own = tuple(f"{link}.{point}." for name in points for link, point in members.get(name, ()))
    found = {
        dimension.name: dimension for dimension in design_dimensions(mechanism) if not dimension.name.startswith(own)
    }
    found |= {dimension.name: dimension for dimension in design_dimensions(ready) if dimension.name.startswith(own)}
    return {name: each for name, each in found.items() if each.path[0] in ("links", "pairs")}


def motion_kind(mechanism: Mechanism, pair: str) -> str:
    """Whether the position of a relative motion is a "length" or an "angle"."""
    return relative_motions(mechanism)[pair].input_quantity_kinds()[0]


def task_motion_kind(task: SynthesisTask, pair: str | None = None) -> str:
    """That of a pair of a task's starts, or of the running input; angles are those of chains, and of what is not
    there."""
    if isinstance(task.starts, ChainStart) or not task.starts:
        return "angle"
    first = task.starts[0]
    name = pair or first.inputs[0].pair
    return motion_kind(first, name) if name in relative_motions(first) else "angle"


def wanted_miss_kind(task: SynthesisTask, wanted: Wanted) -> str:
    """What a miss of a wanted item is: a "length", or an "angle" where it is a function whose values are angles."""
    return task_motion_kind(task, wanted.to_pair) if isinstance(wanted, WantedFunction) else "length"


def miss_kind(task: SynthesisTask) -> str:
    """What misses of a task are together: an "angle" where all of them are."""
    return "angle" if all(wanted_miss_kind(task, item) == "angle" for item in task.wanted) else "length"


def miss_text(task: SynthesisTask, miss: float, size: float) -> str:
    """A miss of a task with its unit: 0 where it is round-off of the size (m) of what is wanted, or of a radian."""
    kind = miss_kind(task)
    return amount(miss, kind, task.units, size if kind == "length" else 1.0)
