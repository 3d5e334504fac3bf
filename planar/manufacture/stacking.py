"""What must not share a layer, and what no pin may run through, by the distances of plates and pins over a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations

from planar.foundation.arrays import Array
from planar.manufacture.clearances import hull_rows, least_distance
from planar.manufacture.layers import LayerRules
from planar.manufacture.plate_making import Pin, Sizes
from planar.manufacture.plates import Place, Plate

PlacesOf = Callable[[str, tuple[Place, ...]], Array]
"""Where points of a link are at every position of a run: (positions, points, 2) in mm."""


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
    rows = [places(plate.link, hull_rows(plate.core)) for plate in plates]
    apart, beside = set(), set()
    for one, other in combinations(range(1, len(plates)), 2):
        if plates[one].link == plates[other].link:
            apart.add((one, other))
            beside.add((one, other))
        elif (one, other) not in together and (other, one) not in together:
            room = plates[one].reach + plates[other].reach + sizes.play
            if least_distance(rows[one], rows[other]) < room:
                apart.add((one, other))
    joins = {each.name: joined_plates(each, plates) for each in pins}
    spots = {each.name: places(each.on, (each.at,)) for each in pins}
    obstacles = {}
    for each in pins:
        radius = sizes.diameter(each.name) / 2.0
        near = [
            index
            for index, plate in enumerate(plates)
            if index
            and index not in joins[each.name]
            and plate.link not in each.links
            and least_distance(spots[each.name], rows[index]) < plate.reach + radius + sizes.play
        ]
        obstacles[each.name] = frozenset(near)
    crowded = frozenset(
        (one.name, other.name)
        for one, other in combinations(pins, 2)
        if least_distance(spots[one.name], spots[other.name])
        < (sizes.diameter(one.name) + sizes.diameter(other.name)) / 2.0 + sizes.play
    )
    return LayerRules(len(plates), frozenset(apart), together, tuple(sorted(beside)), joins, obstacles, crowded)


def joined_plates(pin: Pin, plates: Sequence[Plate]) -> tuple[int, ...]:
    """The plates with the pin's hole, or the slot in which it slides."""

    def is_held(plate: Plate) -> bool:
        drilled = any(hole.pin == pin.name for hole in plate.holes)
        slid = any(pin.name in (slot.pin, f"{slot.pin} 2") for slot in plate.slots)
        return plate.link in pin.links and (drilled or slid)

    return tuple(index for index, plate in enumerate(plates) if is_held(plate))
