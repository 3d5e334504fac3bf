"""What must not share a layer, and what no pin may run through, by the distances of plates and pins over a run."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from planar.manufacture.clearances import Body, PlacesOf, body_of, keep_apart
from planar.manufacture.layers import LayerRules
from planar.manufacture.plate_making import Pin, Sizes
from planar.manufacture.plates import Plate


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
