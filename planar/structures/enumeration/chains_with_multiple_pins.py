"""All kinematic chains of so many links of which pins hold more than two links, in a fixed order."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

from planar.foundation.time_limit import stop_if_over
from planar.structures.chain import Chain
from planar.structures.enumeration.pin_chains import Chains
from planar.structures.general_position import GeneralPosition
from planar.structures.multiple_pins import Pin, canonical_pins, link_pairs, merged_pins


class ChainsWithMultiplePins(Chains):
    """All chains of some number of links and freedom whose pins hold so many links beyond two each; see
    `planar.chains`.

    The order: the numbers of pins of the links, the greatest first, are a word, and so are the numbers of links of the
    pins; less comes first, of the first word, then of the second; then by the pins themselves, each by its links.
    """

    def __init__(self, links: int, freedom: int, fractionated: bool, multiple_pins: int):
        super().__init__(links, freedom, fractionated)
        self.multiple_pins = multiple_pins

    def __reduce__(self) -> tuple[Any, ...]:
        return ChainsWithMultiplePins, (self.links, self.freedom, self.fractionated, self.multiple_pins)

    def __len__(self) -> int:
        return len(self._pins)

    def __iter__(self) -> Iterator[Chain]:
        return (self._numbered(number) for number in range(len(self)))

    def number_of(self, chain: Chain) -> int | None:
        if (chain.links, chain.freedom, chain.slides) != (self.links, self.freedom, ()):
            return None
        wanted, _ = canonical_pins(chain.links, chain.pins)
        return self._pins.index(wanted) if wanted in self._pins else None

    def _at(self, place: int) -> Chain | None:
        return self._numbered(place) if place < len(self) else None

    def _numbered(self, number: int) -> Chain:
        pins = self._pins[number]
        return Chain(self.links, self.freedom, link_pairs(pins), number, pins=pins)

    @cached_property
    def _pins(self) -> list[tuple[Pin, ...]]:
        """The pins of each chain: those of chains with fewer, of which two on a link with three and more are one.

        All are had so, since a part that moves still moves where a link of a pin is pinned to one of its others alone.
        """
        found: set[tuple[Pin, ...]] = {chain.pins for chain in Chains(self.links, self.freedom, self.fractionated)}
        for merged_count in range(self.multiple_pins):
            stop_if_over(f"after pins were merged {merged_count} of {self.multiple_pins} times")
            merged = {canonical_pins(self.links, pins)[0] for each in found for pins in merged_pins(each)}
            found = {pins for pins in merged if has_movable_pins(self.links, pins)}
        return sorted(found, key=self._rank)

    def _rank(self, pins: tuple[Pin, ...]) -> tuple[Any, ...]:
        joints = sorted((sum(link in pin for pin in pins) for link in range(self.links)), reverse=True)
        return joints, sorted(map(len, pins), reverse=True), pins


def has_movable_pins(links: int, pins: tuple[Pin, ...]) -> bool:
    """Whether links that are pinned so have the freedom that they have by count, and any two on a pin move."""
    pairs = link_pairs(pins)
    if len({*pairs}) < len(pairs):  # two links on two pins
        return False
    return GeneralPosition(links, pairs, [pin for pin in pins if len(pin) > 2]).moves_as_counted(())
