"""The coordinates q of links: x, y and angle of every moving link, then those of the pairs' own (m, rad)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from planar.equations.coordinates import FRAME_PARTS, consecutive_ranges
from planar.equations.elements import ElementPlacement
from planar.foundation.arrays import Array
from planar.foundation.jets import value_and_rates
from planar.model.loads import Spring
from planar.model.mechanism import Mechanism
from planar.model.pairs import Pair
from planar.results.kinematic_result import KinematicResult


class LinkCoordinates:
    """The places of links and pairs in q, of one mechanism."""

    def __init__(self, mechanism: Mechanism):
        self.mechanism = mechanism
        self.links = tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
        self.link_columns = {link: len(FRAME_PARTS) * k for k, link in enumerate(self.links)}
        self.link_coordinate_count = len(FRAME_PARTS) * len(self.links)
        own_counts = {pair.name: len(pair.coordinate_kinds) for pair in mechanism.pairs}
        own_columns = consecutive_ranges(own_counts, self.link_coordinate_count)
        self.own_slices = {name: slice(columns.start, columns.stop) for name, columns in own_columns.items()}
        "of every pair: its own coordinates"
        self.coordinate_count = self.link_coordinate_count + sum(own_counts.values())

    def element_placement(self, pairs: Iterable[Pair]) -> ElementPlacement:
        """Finds the elements of pairs in q, whose numbers follow one another in this order."""
        return ElementPlacement(
            {link: range(first, first + len(FRAME_PARTS)) for link, first in self.link_columns.items()},
            {name: range(own.start, own.stop) for name, own in self.own_slices.items()},
            consecutive_ranges({pair.name: len(pair.number_kinds) for pair in pairs}),
        )

    def initial_spring_turns(self, q: Array, springs: Sequence[Spring]) -> Array:
        """The full turns (rad) between links whose torsional springs do not count turns (springs, ...).

        Nothing says in a file how often links have turned: where they stand at coordinates q the spring is wound up the
        least, but for a free angle beyond half a turn, which is off the angle between -pi and pi. Coordinates may be
        arrays (coordinates, n), and the numbers of `springs` then too.
        """
        turns = np.zeros((len(springs), *np.shape(q)[1:]))
        for number, spring in enumerate(springs):
            if spring.is_torsional:
                first, second = (
                    q[self.link_columns[link] + 2] if link in self.link_columns else 0.0 for link in spring.ends
                )
                near = np.where(np.abs(spring.free) <= np.pi, spring.free, 0.0)
                turns[number] = 2.0 * np.pi * np.round((second - first - near) / (2.0 * np.pi))
        return turns

    def coordinates(self, moving: KinematicResult) -> tuple[Array, Array, Array]:
        """The coordinates of a state or a motion with their two rates (n, coordinates)."""
        values = [getattr(moving.frames[link], part) for link in self.links for part in FRAME_PARTS]
        values += [value for pair in self.mechanism.pairs for value in moving.own.get(pair.name, ())]
        parts = [value_and_rates(value)[:3] for value in values]
        count = max((np.size(part) for rates in parts for part in rates), default=1)
        rates_of_all: Array = np.empty((3, count, len(parts)))
        for column, rates in enumerate(parts):
            for order, part in enumerate(rates):
                rates_of_all[order, :, column] = part
        positions, first, second = rates_of_all
        return positions, first, second
