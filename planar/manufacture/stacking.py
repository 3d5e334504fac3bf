"""What must not share a layer, what no pin may run through, and spacers, by distances of plates and pins over a run."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

from planar.manufacture.clearances import Body, PlacesOf, body_of, keep_apart
from planar.manufacture.layers import LayerRules
from planar.manufacture.plate_making import Pin, Sizes
from planar.manufacture.plates import Plate

SPACER_WALLS = (2.0, 1.0, 0.5)
"""Walls by which a spacer is wider than its pin: the first for which there is room."""


class Spacer(NamedTuple):
    """What fills the gap between two plates on a pin: its outer diameter (mm), 0 if nothing clears the plates there,
    and its first and last layer."""

    pin: str
    diameter: float
    layers: tuple[int, int]


def layer_rules(
    places: PlacesOf,
    plates: Sequence[Plate],
    pins: Sequence[Pin],
    meshing: Sequence[tuple[str, str]],
    sizes: Sizes,
) -> LayerRules:
    """What must not share a layer, and what no pin may run through, by the distances over the run."""
    number = {plate.name: index for index, plate in enumerate(plates)}
    together = tuple((number[one], number[other]) for one, other in meshing)
    bodies = [body_of(plate.link, plate.core) for plate in plates]
    apart, beside = set(), set()
    for one, other in combinations(range(1, len(plates)), 2):
        if plates[one].link == plates[other].link:
            apart.add((one, other))
            beside.add((one, other))
        elif (one, other) not in together and (other, one) not in together:
            room = plates[one].reach + plates[other].reach + sizes.play
            if not keep_apart(bodies[one], bodies[other], room, places):
                apart.add((one, other))
    joins = {each.name: joined_plates(each, plates) for each in pins}
    spots = {each.name: Body(each.on, (each.at,)) for each in pins}
    obstacles = {}
    for each in pins:
        radius = sizes.diameter(each.name) / 2.0
        near = [
            index
            for index, plate in enumerate(plates)
            if index
            and index not in joins[each.name]
            and plate.link not in each.links
            and not keep_apart(spots[each.name], bodies[index], plate.reach + radius + sizes.play, places)
        ]
        obstacles[each.name] = frozenset(near)
    crowded = frozenset(
        (one.name, other.name)
        for one, other in combinations(pins, 2)
        if not keep_apart(
            spots[one.name],
            spots[other.name],
            (sizes.diameter(one.name) + sizes.diameter(other.name)) / 2.0 + sizes.play,
            places,
        )
    )
    return LayerRules(len(plates), frozenset(apart), together, tuple(sorted(beside)), joins, obstacles, crowded)


def joined_plates(pin: Pin, plates: Sequence[Plate]) -> tuple[int, ...]:
    """The plates with the pin's hole, or the slot in which it slides."""

    def is_held(plate: Plate) -> bool:
        drilled = any(hole.pin == pin.name for hole in plate.holes)
        slid = any(pin.name in (slot.pin, f"{slot.pin} 2") for slot in plate.slots)
        return plate.link in pin.links and (drilled or slid)

    return tuple(index for index, plate in enumerate(plates) if is_held(plate))


def find_spacers(places: PlacesOf, plates: Sequence[Plate], pins: Sequence[Pin], sizes: Sizes) -> list[Spacer]:
    """The spacers of all pins: one in every gap between layers that a pin joins, clear of all else over the run."""
    layers = {pin.name: sorted({plates[index].layer for index in joined_plates(pin, plates)}) for pin in pins}
    by_name = {pin.name: pin for pin in pins}
    spacers: list[Spacer] = []
    for pin in pins:
        for low, high in pairwise(layers[pin.name]):
            if high - low < 2:
                continue
            # pins and spacers that stand in one of these layers, with their diameters
            others = [
                (by_name[name], sizes.diameter(name))
                for name, joined in layers.items()
                if name != pin.name and joined and joined[0] < high and joined[-1] > low
            ]
            others += [
                (by_name[spacer.pin], spacer.diameter)
                for spacer in spacers
                if spacer.pin != pin.name and spacer.layers[0] < high and spacer.layers[1] > low
            ]
            between = [plate for plate in plates if low < plate.layer < high]
            diameters = [sizes.diameter(pin.name) + walls * sizes.wall for walls in SPACER_WALLS]
            clear = (size for size in diameters if _is_clear(pin, size, between, others, places, sizes.play))
            spacers.append(Spacer(pin.name, next(clear, 0.0), (low + 1, high - 1)))
    return spacers


def _is_clear(  # many: what a spacer must clear
    pin: Pin,
    diameter: float,
    plates: Sequence[Plate],
    others: Sequence[tuple[Pin, float]],
    places: PlacesOf,
    play: float,
) -> bool:
    """Whether a spacer of this diameter on a pin meets no plate and no other pin or spacer over the run."""
    spot = Body(pin.on, (pin.at,))
    return all(
        keep_apart(spot, body_of(plate.link, plate.core), plate.reach + diameter / 2.0 + play, places)
        for plate in plates
    ) and all(
        keep_apart(spot, Body(other.on, (other.at,)), (size + diameter) / 2.0 + play, places) for other, size in others
    )
