"""Which results a sweep tells beside the points', and the rows in which they stand."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, suggest_name
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind

POINT_QUANTITIES = ("position", "velocity", "acceleration")
LINK_QUANTITIES = ("angle", "angular_velocity", "angular_acceleration")
PAIR_QUANTITIES = ("value", "value_rate", "value_second_rate")
RATE_UNITS = ("", "/s", "/s^2")
NamedArrays: TypeAlias = dict[tuple[str, str], Array]
"""Results (numbers, steps + 1, designs) by quantity and name."""


class ResultRow(NamedTuple):
    """A result of a sweep: the quantity, which is the attribute that has it; of what; how many numbers; their unit."""

    quantity: str
    name: str
    width: int
    unit: str


class DerivedKind(NamedTuple):
    """Results that have derivatives: their quantities by order, the names, and how many numbers each result has."""

    quantities: tuple[str, ...]
    names: tuple[str, ...]
    width: int


class RequestedResults(NamedTuple):
    """The results that are asked for beside those of points: of these links, pairs, outputs, inputs and pairs; and
    derivatives of these points, links and pairs in numbers of the file."""

    links: tuple[str, ...] = ()
    pairs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    efforts: tuple[str, ...] = ()
    reactions: tuple[str, ...] = ()
    derivatives: tuple[str, ...] = ()
    derived_points: tuple[str, ...] = ()

    @property
    def has_forces(self) -> bool:
        """Whether loads, springs and inertia count."""
        return bool(self.efforts or self.reactions)

    def rows(self, mechanism: Mechanism, rates: bool) -> tuple[ResultRow, ...]:
        """The rows in their order, of links and pairs with `rates` also first and second rates."""
        return tuple(self._rows(mechanism, 3 if rates else 1))

    def _rows(self, mechanism: Mechanism, orders: int) -> Iterator[ResultRow]:
        slides = {name: pair.input_kind is MeasureKind.LENGTH for name, pair in relative_motions(mechanism).items()}
        for order in range(orders):
            for link in self.links:
                yield ResultRow(LINK_QUANTITIES[order], link, 1, f"rad{RATE_UNITS[order]}")
            for pair in self.pairs:
                yield ResultRow(PAIR_QUANTITIES[order], pair, 1, f"{'m' if slides[pair] else 'rad'}{RATE_UNITS[order]}")
        for name in self.outputs:
            yield ResultRow("transmission_angle", name, 1, "rad")
        for name in self.efforts:
            yield ResultRow("effort", name, 1, "N" if slides[name] else "N m")
        for name in self.reactions:
            yield ResultRow("reaction", name, 2, "N")
        for name in self.reactions:
            yield ResultRow("reaction_couple", name, 1, "N m")
        if self.derivatives:
            yield from self._derivative_rows(orders)

    @property
    def derived(self) -> tuple[DerivedKind, ...]:
        """The derived results of points, links and pairs."""
        return (
            DerivedKind(POINT_QUANTITIES, self.derived_points, 2),
            DerivedKind(LINK_QUANTITIES, self.links, 1),
            DerivedKind(PAIR_QUANTITIES, self.pairs, 1),
        )

    def number_of_row(self, rates: bool) -> IntArray:
        """The index of the number of the file that each row of derivatives belongs to (rows,)."""
        numbers = np.arange(len(self.derivatives))
        orders = 3 if rates else 1
        return np.concatenate(
            [np.tile(np.repeat(numbers, width), orders * len(names)) for _, names, width in self.derived]
        )

    def _derivative_rows(self, orders: int) -> Iterator[ResultRow]:
        for quantities, names, width in self.derived:
            for quantity in quantities[:orders]:
                for name in names:
                    for number in self.derivatives:
                        yield ResultRow("derivatives", derivative_name(f"{quantity} of {name}", number), width, "SI")


def derivative_name(what: str, number: str) -> str:
    """What a derivative is called: `position of E by BC.length`."""
    return f"{what} by {number}"


def select_names(place: str, given: Sequence[str] | str, known: Sequence[str]) -> tuple[str, ...]:
    """Names that are asked for, each once. Raises BadInput for one that is not known."""
    asked = [given] if isinstance(given, str) else list(given)
    for name in asked:
        if name not in known:
            hint = suggest_name(str(name), known, "names here")
            raise BadInput(place, f"there is nothing of the name {name!r:.60} here{hint}")
    return tuple(dict.fromkeys(asked))
