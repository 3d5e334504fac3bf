"""Which exchanges of unknowns leave a family's rows as they are, and a name that does not depend on their order."""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from itertools import permutations
from math import factorial
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import ComplexArray, IntArray
from planar.synthesis.exact.relations.family import Family, FamilyPart, Member

MAX_ORDERS = 5040
"""Orders of unknowns that are tried."""
DIGITS = 6
"""Of values by which rows are told from each other."""

Images = Callable[[ComplexArray], list[ComplexArray]]
"""Of solutions V all that stand for the same thing, themselves first."""


class FamilyName(NamedTuple):
    """`text` is the same for families that differ in the order of symbols; `unknowns` and `given` say which of this
    family's stand at each place of the order that all of them share."""

    text: str
    unknowns: tuple[int, ...]
    given: tuple[int, ...]
    exchanges: tuple[tuple[int, ...], ...]
    "orders of the unknowns that leave every row as it is, the first as they are"


def name_family(family: Family) -> FamilyName:
    """The name of a family, by the values of its rows at random places."""
    given = family.parts[0].kinds
    orders = _orders(family.size)
    best: tuple[tuple[float, ...], tuple[int, ...], tuple[int, ...]] | None = None
    exchanges: tuple[tuple[int, ...], ...] = ()
    for order in _orders(len(given)):
        if [given[k].value for k in order] != sorted(each.value for each in given):
            continue
        ratios = _row_values(family, np.array(orders), np.array(order, dtype=int))
        if not exchanges:  # which may exchange rows of an entry, too
            rows = np.take_along_axis(ratios, np.argsort(ratios.real, axis=1), axis=1)
            same = np.abs(rows - rows[0]).max(axis=1, initial=0.0) < 1e-8 * np.abs(rows[0]).max(initial=1.0)
            exchanges = tuple(each for each, is_same in zip(orders, same, strict=True) if is_same)
        for unknowns, values in zip(orders, ratios, strict=True):
            told = tuple(sorted((_rounded(v.real), _rounded(v.imag)) for v in values))
            key = tuple(each for both in told for each in both)
            if best is None or key < best[0]:
                best = key, unknowns, order
    assert best is not None
    shape = [(part.entry_count, [each.value for each in part.kinds]) for part in family.parts]
    shape[0] = (1, sorted(each.value for each in given))
    text = sha256(repr((family.size, shape, best[0])).encode()).hexdigest()
    return FamilyName(text, best[1], best[2], exchanges)


def _orders(count: int) -> list[tuple[int, ...]]:
    return [*permutations(range(count))] if factorial(count) <= MAX_ORDERS else [tuple(range(count))]


def _row_values(family: Family, orders: IntArray, given: IntArray) -> ComplexArray:
    """What rows are at one random place, of what they are at another, for every order of the unknowns."""
    rng = np.random.default_rng(17)
    places = rng.normal(size=(2, 2, family.size)) + 1j * rng.normal(size=(2, 2, family.size))
    member = Family(family.size, tuple(map(_sorted_numbers, family.parts))).random_member(rng)
    first = np.empty_like(member.parts[0])
    first[:, given] = member.parts[0]
    member = Member((first, *member.parts[1:]))
    still = [np.zeros_like(each) for each in member.parts]
    values = []
    for place in places:
        x = np.empty((2, family.size, len(orders)), dtype=complex)
        for k, order in enumerate(orders):
            x[:, order, k] = place
        values.append(family.rows_at(x.reshape(-1, len(orders)), member, still, np.zeros(len(orders)))[0])
    found: ComplexArray = (values[0] / values[1]).T
    return found


def _sorted_numbers(part: FamilyPart) -> FamilyPart:
    return part._replace(kinds=tuple(sorted(part.kinds, key=lambda each: each.value)))


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def reordered(V: ComplexArray, order: tuple[int, ...]) -> ComplexArray:
    """Solutions whose unknown at each place is that of an order."""
    half = V.shape[1] // 2
    own = np.array(order, dtype=int) + 1
    return V[:, [0, *own.tolist(), half, *(own + half).tolist()]]


def exchange_images(exchanges: tuple[tuple[int, ...], ...]) -> Images:
    """All that exchanges make of solutions."""
    return lambda V: [reordered(V, each) for each in exchanges]


def representatives(V: ComplexArray, images: Images | None) -> ComplexArray:
    """Of all that stand for the same thing always the same one."""
    every = images(V) if images is not None else [V]
    if len(every) == 1:
        return V
    keys = np.array([solution_keys(each).real for each in every])
    chosen = np.argmin(keys, axis=0)
    found: ComplexArray = np.array(every)[chosen, np.arange(len(V))]
    return found


def solution_keys(V: ComplexArray) -> ComplexArray:
    """A number by which solutions are told from each other, whatever the length of their halves."""
    half = V.shape[1] // 2
    rng = np.random.default_rng(1)
    weights = rng.normal(size=(2, 2, half)) + 1j * rng.normal(size=(2, 2, half))
    parts = V[:, :half], V[:, half:]
    found: ComplexArray = sum((each @ w[0]) / (each @ w[1]) for each, w in zip(parts, weights, strict=True))
    return found
