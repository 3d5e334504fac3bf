"""Which plate lies in which layer, so that plates of one layer never meet and no pin runs through a plate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

SEARCH_LIMIT = 20_000
"""Assignments of one plate that are tried, for a number of layers; ten plates that can be stacked take some hundred."""


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


def find_layers(rules: LayerRules) -> tuple[list[int], list[str]]:
    """A layer for every plate, as few layers as can be, and the pins and plates that could not be kept clear.

    Where none is found each plate has a layer of its own, in an order that no exchange of two makes better, and what
    meets there is told.
    """
    groups = _groups(rules)
    order = sorted(groups, key=lambda group: -sum(_degree(rules, plate) for plate in group))
    for many in range(1, len(groups) + 1):
        found = _search(rules, order, many)
        if found is not None:
            return found, []
    stack = sorted(groups)
    least = len(broken_rules(rules, _stacked(rules, stack)))
    swapped = True
    while swapped and least:
        swapped = False
        for one, other in combinations(range(len(stack)), 2):
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


def broken_rules(rules: LayerRules, layers: Sequence[int]) -> list[str]:
    """The pins that run through plates, and each other, at these layers, by name."""
    found = [
        f"{pin}|{plate}"
        for pin, plates in rules.obstacles.items()
        for plate in plates
        if _runs_through(rules, layers, pin, plate)
    ]
    return found + [f"{one}|{other}" for one, other in rules.crowded if _share_gap(rules, layers, one, other)]


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


def _search(rules: LayerRules, order: list[tuple[int, ...]], many: int) -> list[int] | None:
    """Layers from 1 to so many, by trying one group after the other; None where there are none, or too many to try."""
    layers = [-1] * rules.number
    layers[0] = 0
    left = SEARCH_LIMIT

    def fits(group: tuple[int, ...], layer: int) -> bool:
        for plate in group:
            for one, other in rules.apart:
                if plate in (one, other) and layers[other if plate == one else one] == layer:
                    return False
            for one, other in rules.beside:
                if plate in (one, other):
                    beside = layers[other if plate == one else one]
                    if beside >= 0 and abs(beside - layer) != 1:
                        return False
        return True

    def clear() -> bool:
        return not any(
            _runs_through(rules, layers, pin, plate) for pin, plates in rules.obstacles.items() for plate in plates
        ) and not any(_share_gap(rules, layers, one, other) for one, other in rules.crowded)

    def place(number: int) -> bool:
        nonlocal left
        if number == len(order):
            return True
        for layer in range(1, many + 1):
            left -= 1
            if left < 0:
                return False
            if fits(order[number], layer):
                for plate in order[number]:
                    layers[plate] = layer
                if clear() and place(number + 1):
                    return True
                for plate in order[number]:
                    layers[plate] = -1
        return False

    return list(layers) if place(0) else None


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
