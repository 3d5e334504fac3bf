"""Which plate lies in which layer, so that plates of one layer never meet and no pin runs through a plate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

SEARCH_LIMIT = 60_000
"""Assignments of one plate that are tried; ten plates that can be stacked take some hundred."""
MOST_EXCHANGED = 16
"""Plates that are exchanged in search of a better order, where none is clear."""


class LayerRules(NamedTuple):
    """What is to be kept. Plates are numbered, 0 is the frame's, which lies below all others.

    `apart` may not share a layer; `together` have to; `beside` lie in neighbouring layers; a pin joins the plates of
    `pins`, and may not run through the layers of those that it would meet, `obstacles`; `crowded` are two pins that
    would meet.
    """

    number: int
    apart: frozenset[tuple[int, int]]
    together: tuple[tuple[int, int], ...]
    beside: tuple[tuple[int, int], ...]
    pins: Mapping[str, tuple[int, ...]]
    obstacles: Mapping[str, frozenset[int]]
    crowded: frozenset[tuple[str, str]]


def find_layers(rules: LayerRules) -> tuple[list[int], list[tuple[str, str | int]]]:
    """A layer for every plate, as few layers as can be, and the pins and plates that could not be kept clear.

    Where none is found each plate has a layer of its own, in an order that no exchange of two makes better, and what
    meets there is told.
    """
    groups = _groups(rules)
    order = sorted(groups, key=lambda group: -sum(_degree(rules, plate) for plate in group))
    search = _Search(rules, order)
    for many in range(1, len(groups) + 1):
        found = search.layers(many)
        if found is not None:
            return found, []
    stack = sorted(groups)
    least = len(broken_rules(rules, _stacked(rules, stack)))
    swapped = True
    while swapped and least:
        swapped = False
        for one, other in combinations(range(min(len(stack), MOST_EXCHANGED)), 2):
            tried = list(stack)
            tried[one], tried[other] = tried[other], tried[one]
            broken = len(broken_rules(rules, _stacked(rules, tried)))
            if broken < least:
                stack, least, swapped = tried, broken, True
    own = _stacked(rules, stack)
    return own, broken_rules(rules, own)


def _stacked(rules: LayerRules, stack: Sequence[tuple[int, ...]]) -> list[int]:
    """A layer of its own for every group, in this order."""
    found = [0] * rules.number
    for number, group in enumerate(stack, 1):
        for plate in group:
            found[plate] = number
    return found


def broken_rules(rules: LayerRules, layers: Sequence[int]) -> list[tuple[str, str | int]]:
    """The pins that run through plates (by number) or beside other pins (by name) at these layers."""
    found: list[tuple[str, str | int]] = []
    for pin, plates in rules.obstacles.items():
        found += [(pin, plate) for plate in sorted(plates) if _runs_through(rules, layers, pin, plate)]
    return found + [two for two in sorted(rules.crowded) if _share_gap(rules, layers, *two)]


def _groups(rules: LayerRules) -> list[tuple[int, ...]]:
    """Plates that share a layer, the frame's left out."""
    group = list(range(rules.number))
    for one, other in rules.together:
        old, new = group[one], group[other]
        group = [new if each == old else each for each in group]
    found: dict[int, list[int]] = {}
    for plate in range(1, rules.number):
        found.setdefault(group[plate], []).append(plate)
    return [tuple(each) for each in found.values()]


def _degree(rules: LayerRules, plate: int) -> int:
    return sum(plate in pair for pair in rules.apart) + sum(plate in each for each in rules.obstacles.values())


class _Search:
    """Layers by trying one group of plates after the other; so many tries for all numbers of layers together."""

    def __init__(self, rules: LayerRules, order: list[tuple[int, ...]]) -> None:
        self.rules, self.order, self.left = rules, order, SEARCH_LIMIT
        self.held = [[pin for pin, plates in rules.pins.items() if plate in plates] for plate in range(rules.number)]
        self.blocked = [
            [pin for pin, plates in rules.obstacles.items() if plate in plates] for plate in range(rules.number)
        ]
        self.crowd = {pin: [two for two in rules.crowded if pin in two] for pin in rules.pins}
        self.now = [-1] * rules.number

    def layers(self, many: int) -> list[int] | None:
        """Layers from 1 to so many; None where there are none, or no tries are left."""
        self.now = [0] + [-1] * (self.rules.number - 1)
        return list(self.now) if self._place(0, many) else None

    def _place(self, number: int, many: int) -> bool:
        if number == len(self.order):
            return True
        group = self.order[number]
        for layer in range(1, many + 1):
            self.left -= 1
            if self.left < 0:
                return False
            if self._fits(group, layer):
                for plate in group:
                    self.now[plate] = layer
                if self._is_clear(group) and self._place(number + 1, many):
                    return True
                for plate in group:
                    self.now[plate] = -1
        return False

    def _fits(self, group: tuple[int, ...], layer: int) -> bool:
        """Whether no plate that may not is in this layer, and those that lie beside these are beside it."""
        for plate in group:
            for one, other in self.rules.apart:
                if plate in (one, other) and self.now[other if plate == one else one] == layer:
                    return False
            for one, other in self.rules.beside:
                if plate in (one, other):
                    beside = self.now[other if plate == one else one]
                    if beside >= 0 and abs(beside - layer) != 1:
                        return False
        return True

    def _is_clear(self, group: tuple[int, ...]) -> bool:
        """Whether the pins that these plates lengthen, and those that they may block, run clear."""
        rules, now = self.rules, self.now
        for plate in group:
            if any(_runs_through(rules, now, pin, plate) for pin in self.blocked[plate]):
                return False
            for pin in self.held[plate]:
                if any(_runs_through(rules, now, pin, each) for each in rules.obstacles.get(pin, ())):
                    return False
                if any(_share_gap(rules, now, one, other) for one, other in self.crowd[pin]):
                    return False
        return True


def _span(rules: LayerRules, layers: Sequence[int], pin: str) -> tuple[int, int]:
    """From which to which layer a pin runs, as far as its plates are placed."""
    known = [layers[plate] for plate in rules.pins[pin] if layers[plate] >= 0]
    return (min(known), max(known)) if known else (0, 0)


def _runs_through(rules: LayerRules, layers: Sequence[int], pin: str, plate: int) -> bool:
    low, high = _span(rules, layers, pin)
    return low < layers[plate] < high


def _share_gap(rules: LayerRules, layers: Sequence[int], one: str, other: str) -> bool:
    """Whether two pins are beside each other somewhere between layers."""
    (a, b), (c, d) = _span(rules, layers, one), _span(rules, layers, other)
    return max(a, c) < min(b, d)
