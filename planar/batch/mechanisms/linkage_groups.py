"""Mechanisms of any structure as arrays of linkages that share their blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.linkage_arrays import LinkageArrays, PartitionedLinkage, make_linkage_arrays
from planar.batch.mechanisms.partition import NotPartitionable, Partition, partition_mechanism
from planar.batch.stop_checks import watched_links
from planar.foundation.errors import BadInput
from planar.model.link_shapes import PointPlacementError
from planar.model.mechanism import Mechanism, named_points, running_input_index
from planar.model.pairs import MeasureKind as Measure

Array = np.ndarray


class SweepRequest(NamedTuple):
    """What is asked of every mechanism, see `sweep_each`."""

    steps: int
    points: tuple[str, ...] | None
    rates: bool
    pair: str | None


class LinkageGroup(NamedTuple):
    """Linkages that can be solved group after group: their numbers, as arrays, names of their points, where each
    starts, and the links of all groups. Behind the points of a linkage stand two of each of its `watched` links, which
    tell where pairs with stops are: the origin of its axes, and the place at the size on the x-axis."""

    numbers: Array
    arrays: LinkageArrays
    names: Sequence[Sequence[str]]
    start: Array
    links_of_block: Callable[[int], str]
    mechanisms: Sequence[Mechanism]
    watched: Sequence[tuple[str, ...]]


def linkage_group(mechanisms: Sequence[Mechanism], request: SweepRequest) -> LinkageGroup | None:
    """Those of the mechanisms that are not for the general path; None where there are none."""
    ones: list[PartitionedLinkage] = []
    numbers: list[int] = []
    names: list[list[str]] = []
    starts: list[float] = []
    for k, mechanism in enumerate(mechanisms):
        made = _partition_linkage(mechanism, request)
        if made is not None:
            one, own_names, start = made
            ones.append(one)
            numbers.append(k)
            names.append(own_names)
            starts.append(start)
    if not ones:
        return None

    def block_links(number: int) -> str:
        for one in ones:
            if number < len(one.partition.blocks):
                links = list(one.partition.shapes)
                return ", ".join(links[k] for k in one.partition.blocks[number].inner_links)
            number -= len(one.partition.blocks)
        return ""

    own = [mechanisms[k] for k in numbers]
    watched, arrays = [watched_links(each) for each in own], make_linkage_arrays(ones)
    return LinkageGroup(np.array(numbers), arrays, names, np.array(starts), block_links, own, watched)


def _partition_linkage(
    mechanism: Mechanism, request: SweepRequest
) -> tuple[PartitionedLinkage, list[str], float] | None:
    """A mechanism parted into groups, with the names of its points and where it starts; None where it is for the
    general path."""
    running = running_input_index(mechanism, request.pair, "inputs")
    try:
        own = partition_mechanism(mechanism)
    except (NotPartitionable, BadInput, PointPlacementError):
        return None
    kinds = {pair.name: pair.input_kind for pair in mechanism.pairs}
    angles = [kinds[given.pair] is not Measure.LENGTH for given in mechanism.inputs]
    if not angles[running] or not all(
        group.block_type.has_closed_form or group.block_type.has_newton_formulas for group in own.blocks
    ):
        return None
    unit = own.unit
    inputs = [
        (given.position if angle else given.position / unit, angle, k == running, given.velocity, given.acceleration)
        for k, (given, angle) in enumerate(zip(mechanism.inputs, angles, strict=True))
    ]
    members = _point_members(mechanism, request.points)
    shown = (
        [] if all(group.block_type.has_closed_form for group in own.blocks) else _shown_points(mechanism, own, members)
    )
    sketch: list[tuple[float, ...]] = []
    for name, x, y in mechanism.sketch:
        if name not in members:
            return None
        place, link, point = min((own.link_index[link], link, point) for link, point in members[name])
        if place:
            at = own.shapes[link].points[point]
            sketch.append((place, at.x / unit, at.y / unit, x / unit, y / unit))
    names: list[str] = []
    points: list[tuple[float, ...]] = []
    for name in wanted_points(mechanism, members, request.points):
        place, link, point = min((own.link_index[link], link, point) for link, point in members[name])
        names.append(name)
        points.append((place, *own.shapes[link].points[point]))
    for link in watched_links(mechanism):
        points += [(own.link_index[link], x, 0.0) for x in (0.0, unit)]
    return PartitionedLinkage(own, inputs, sketch, points, shown), names, mechanism.inputs[running].position


def _shown_points(
    mechanism: Mechanism, partition: Partition, members: Mapping[str, Sequence[tuple[str, str]]]
) -> list[tuple[float, ...]]:
    """Points of every link that the sketch shows, or that lie on the frame: see `Lot.shown`."""
    at = {name: (x, y) for name, x, y in mechanism.sketch}
    found: list[tuple[float, ...]] = []
    for name, both in members.items():
        on = next((point for link, point in both if link == mechanism.frame), None)
        place = at.get(name) if on is None else partition.shapes[mechanism.frame].points[on]
        if place is not None:
            for link, point in both:
                if partition.link_index[link]:
                    local = partition.shapes[link].points[point]
                    found.append((partition.link_index[link], *(part / partition.unit for part in (*local, *place))))
    return found


def _point_members(mechanism: Mechanism, points: tuple[str, ...] | None) -> Mapping[str, Sequence[tuple[str, str]]]:
    """The (link, point) of named points: of all, or of those that pairs keep together where no other is asked for."""
    together: dict[str, list[tuple[str, str]]] = {}
    for pair in mechanism.pairs:
        own = pair.coincident_points()
        if own:
            together.setdefault(pair.entry_name(), []).extend(own)
    wanted = (*(points or ()), *(name for name, _, _ in mechanism.sketch))
    if points is not None and all(name in together for name in wanted):
        return together
    return {each.name: each.members for each in named_points(mechanism)}


def wanted_points(
    mechanism: Mechanism, members: Mapping[str, Sequence[tuple[str, str]]], points: tuple[str, ...] | None
) -> list[str]:
    """The names of the points that are wanted of a mechanism."""
    if points is not None:
        return [name for name in points if name in members]
    return [name for name, own in members.items() if all(link != mechanism.frame for link, _ in own)]
