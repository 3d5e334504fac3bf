"""What may vary in a mechanism, and by how much: its numbers, and where its pins stand in their holes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from planar.derivatives.kinematic_slopes import design_dimensions
from planar.derivatives.result_slopes import tied_dimensions
from planar.document.cursor import Cursor, FileContext
from planar.document.dimensions import Dimension, input_numbers
from planar.document.sections.tolerances import read_tolerances
from planar.foundation.errors import BadInput, join_names
from planar.model.link_shapes import link_shape, shape_extent
from planar.model.mechanism import Mechanism, pair_entries
from planar.model.tolerances.iso_286 import greatest_clearance, parse_fit
from planar.model.tolerances.iso_2768 import angle_deviation, length_deviation
from planar.model.tolerances.tolerances import Clearance, Deviations, Tolerances

PIN_SIZES = ("pin_radius", "pin_diameter")
"""Keys of pins, which have tolerances by their fits."""


class PinOffset(NamedTuple):
    """A pair whose pin may stand anywhere within a radius (m) in its hole."""

    pair: str
    radius: float


class Variations(NamedTuple):
    """What varies, and what is to be said of what does not."""

    numbers: tuple[Deviations, ...]
    offsets: tuple[PinOffset, ...]
    remarks: tuple[str, ...]


def leave_out_tied(variations: Variations, tied: Collection[str]) -> Variations:
    """What varies without numbers that cannot change alone, which is said."""
    held = [each.number for each in variations.numbers if each.number in tied]
    if not held:
        return variations
    told = f"{join_names(held)} cannot change alone, since other numbers go with them: left out"
    kept = tuple(each for each in variations.numbers if each.number not in tied)
    return Variations(kept, variations.offsets, (*variations.remarks, told))


def find_variations(mechanism: Mechanism, tolerances: Tolerances | Mapping[str, Any] | None) -> Variations:
    """The tolerances of a mechanism, those of its file or others (SI). Raises BadInput where there are none."""
    if isinstance(tolerances, Mapping):
        tolerances = read_tolerances(Cursor(dict(tolerances), "tolerances", FileContext()), mechanism)
    told = mechanism.tolerances if tolerances is None else tolerances
    if told is None:
        such = '"tolerances": {"general": "ISO 2768-1 m"}'
        raise BadInput("tolerances", f"the file has no 'tolerances'; give it some, as {such}")
    remarks = []
    dimensions = {each.name: each for each in (*design_dimensions(mechanism), *input_numbers(mechanism))}
    numbers = {each.number: each for each in told.numbers}
    given = frozenset(numbers)
    strange = [name for name in numbers if name not in dimensions]
    if strange:
        remarks.append(f"{join_names(strange)}: nothing that is told follows smoothly from it, and it is left out")
    if told.general is not None:
        general, without = _general_deviations(mechanism, told.general, dimensions)
        numbers = {**{each.number: each for each in general}, **numbers}
        if without:
            remarks.append(f"ISO 2768-1 has no general tolerance of {without} lengths below 0.5 mm or too great")
    if told.lengths is not None:
        lengths = (
            Deviations(each.name, each.kind, *told.lengths)
            for each in dimensions.values()
            if each.kind == "length" and _has_general_tolerance(each) and each.name not in given
        )
        numbers |= {each.number: each for each in lengths}
    kept = tuple(each for name, each in numbers.items() if name in dimensions)
    found = Variations(kept, tuple(_pin_offsets(mechanism, told.clearances)), tuple(remarks))
    return leave_out_tied(found, tied_dimensions(mechanism))


def _has_general_tolerance(each: Dimension) -> bool:
    """Whether a number is a length or an angle of a link or a pair, not 0 and not the size of a pin."""
    moves = each.path[0] in ("links", "pairs") and each.path[-1] not in PIN_SIZES
    return moves and each.kind in ("length", "angle") and bool(each.value)


def _general_deviations(
    mechanism: Mechanism, grade: str, dimensions: Mapping[str, Dimension]
) -> tuple[list[Deviations], int]:
    """Of lengths and angles of links and pairs; of an angle the shorter side is its point's distance, else the extent
    of its link, else of the greatest link. What is 0 has none. And how many other lengths have none."""
    extents = {link.name: shape_extent(link_shape(link)) for link in mechanism.links}
    found, without = [], 0
    for each in dimensions.values():
        if not _has_general_tolerance(each):
            continue
        if each.kind == "length":
            most = length_deviation(grade, each.value)
        else:
            beside = dimensions.get(f"{each.name.rpartition('.')[0]}.distance")
            side = abs(beside.value) if beside is not None else extents.get(each.link) or max(extents.values())
            most = angle_deviation(grade, side)
        if most is not None:
            found.append(Deviations(each.name, each.kind, -most, most))
        else:
            without += 1
    return found, without


def _pin_offsets(mechanism: Mechanism, clearances: tuple[Clearance, ...]) -> list[PinOffset]:
    groups = {group[0].entry_name(): group for group in pair_entries(mechanism)}
    found = []
    for each in clearances:
        group = groups[each.pair]
        radius = each.value
        if radius is None:
            diameter = group[0].pin_diameter()
            if diameter is None or each.fit is None:
                raise BadInput(each.pair, "a fit goes by the pin's diameter, which this pair does not have")
            radius = greatest_clearance(parse_fit(each.fit), float(diameter))
        if radius:
            found += [PinOffset(pair.name, radius) for pair in group]
    return found
