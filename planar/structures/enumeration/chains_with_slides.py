"""All kinematic chains of so many links of which so many joints slide, in a fixed order."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

from planar.foundation.time_limit import stop_if_over
from planar.structures.chain import Chain
from planar.structures.enumeration.pin_chains import Chains
from planar.structures.general_position import GeneralPosition
from planar.structures.multiple_pins import canonical_pins
from planar.structures.symmetry import first_alike, joint_exchanges


class ChainsWithSlides(Chains):
    """All chains of some number of links and freedom of which so many joints slide; see `planar.chains`.

    The order: by the chain of pins that it is but for its slides, then by the numbers of the joints that slide. Of sets
    of joints that an exchange of links takes to each other the first counts.
    """

    def __init__(self, pins: Chains, slides: int):
        super().__init__(pins.links, pins.freedom, pins.fractionated)
        self.pins, self.slides, self.multiple_pins = pins, slides, pins.multiple_pins
        self._pin_chains = iter(pins)
        self._found: list[tuple[Chain, list[tuple[int, ...]]]] = []

    def __reduce__(self) -> tuple[Any, ...]:
        return ChainsWithSlides, (self.pins, self.slides)

    def __len__(self) -> int:
        return sum(len(sets) for _, sets in self._slide_sets())

    def __iter__(self) -> Iterator[Chain]:
        number = 0
        for chain, sets in self._slide_sets():
            for slides in sets:
                yield chain.with_slides(slides, number)
                number += 1

    def number_of(self, chain: Chain) -> int | None:
        if (chain.links, chain.freedom, len(chain.slides)) != (self.links, self.freedom, self.slides):
            return None
        pins, numbers = canonical_pins(chain.links, chain.pins)
        before = 0
        for each, sets in self._slide_sets():
            if each.pins == pins:
                place = {joint: number for number, joint in enumerate(each.edges)}
                ends = ([numbers[link] for link in chain.edges[k]] for k in chain.slides)
                exchanges = joint_exchanges(each.automorphisms, each.edges)
                _, slides = first_alike((place[min(own), max(own)] for own in ends), exchanges)
                return before + sets.index(slides) if slides in sets else None
            before += len(sets)
        return None

    def _at(self, place: int) -> Chain | None:
        number = place
        for chain, sets in self._slide_sets():
            if place < len(sets):
                return chain.with_slides(sets[place], number)
            place -= len(sets)
        return None

    def _slide_sets(self) -> Iterator[tuple[Chain, list[tuple[int, ...]]]]:
        """Each chain of pins with the sets of its joints that may slide, made where they are not yet."""
        k = 0
        while True:
            if k == len(self._found):
                stop_if_over(f"after {k} chains of pins")
                chain = next(self._pin_chains, None)
                if chain is None:
                    return
                self._found.append((chain, slide_sets(chain, self.slides)))
            yield self._found[k]
            k += 1


def slide_sets(chain: Chain, slides: int) -> list[tuple[int, ...]]:
    """The sets of so many joints of a chain of pins that may slide: of those that are alike the first.

    With them the chain has the freedom that it has by count, wherever its joints stand but for special places, and all
    its joints move.
    """
    position = GeneralPosition(chain.links, chain.edges, chain.multiple_pins)
    exchanges = joint_exchanges(chain.automorphisms, chain.edges)
    pins_of_two = [number for number, ends in enumerate(chain.edges) if ends in chain.pins]
    return [
        chosen
        for chosen in combinations(pins_of_two, slides)
        if chosen == first_alike(chosen, exchanges)[1] and position.moves_as_counted(chosen)
    ]
