"""A name of a family that does not depend on the order of its symbols, and the exchanges that leave its rows alike.

Symbols are told apart by invariants: values of all rows where one symbol differs from those that are still alike. Where
symbols stay alike, each of them is taken first in turn, and the least row values give the order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from hashlib import sha256
from itertools import permutations, product
from math import factorial, prod
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, ComplexArray
from planar.synthesis.exact.relations.family import Family, FamilyPart, Member
from planar.synthesis.exact.relations.unknowns import NumberKind

MAX_ORDERS = 5040
"""Orders of unknowns that are tried for exchanges."""
MAX_LEAVES = 48
"""Orders of symbols that are compared for a name."""
DIGITS = 6
"""Of values by which rows are told from each other."""
VANISHES = 1e-9
"""Of what its terms are made of: a row below is zero."""
APART = 1000
"""The colour of the one symbol that differs."""

Colours = tuple[int, ...]


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
    namer = _Namer(family)
    start = namer.refine((0,) * family.size, namer.kind_colours)
    leaves = [leaf for leaf, _ in zip(namer.leaves(*start), range(MAX_LEAVES), strict=False)]
    key, unknowns, given = min((namer.key(*leaf), *leaf) for leaf in leaves)
    shape = [(part.entry_count, [each.value for each in part.kinds]) for part in family.parts]
    shape[0] = (1, sorted(each.value for each in family.parts[0].kinds))
    text = sha256(repr((family.size, shape, key)).encode()).hexdigest()
    return FamilyName(text, _order(unknowns), _order(given), namer.exchanges())


def _order(colours: Colours) -> tuple[int, ...]:
    return tuple(sorted(range(len(colours)), key=colours.__getitem__))


def _ranks(keys: Sequence[tuple[object, ...]]) -> Colours:
    places = {key: k for k, key in enumerate(sorted({*keys}))}
    return tuple(places[key] for key in keys)


class _Namer:
    def __init__(self, family: Family):
        self.family = family
        self.kinds = family.parts[0].kinds
        self.kind_colours = _ranks([(each.value,) for each in self.kinds])
        others = Family(family.size, (family.parts[0]._replace(kinds=()), *family.parts[1:]))
        self.entries = others.random_member(np.random.default_rng(17)).parts[1:]

    def ratios(self, unknowns: Sequence[Colours], given: Colours) -> ComplexArray:
        """What rows are at one place, of what they are at another, for each choice of colours of the unknowns."""
        first = [_number(kind, colour) for kind, colour in zip(self.kinds, given, strict=True)]
        member = Member((np.array(first, dtype=complex).reshape(1, -1, 2), *self.entries))
        still = [np.zeros_like(each) for each in member.parts]
        colours = np.array(unknowns, dtype=int).reshape(len(unknowns), -1)
        known = {colour: _places(colour) for colour in np.unique(colours).tolist()}
        values = []
        for place in range(2):
            own = np.array([[known[one][place] for one in row] for row in colours.tolist()]).reshape(*colours.shape, 2)
            x = np.moveaxis(own, 0, 2).swapaxes(0, 1).reshape(-1, len(colours))
            f, slope, _ = self.family.rows_at(x, member, still, np.zeros(len(colours)))
            f[np.abs(f) < VANISHES * np.abs(slope * x).sum(axis=1)] = 0.0
            values.append(f)
        with np.errstate(all="ignore"):
            found: ComplexArray = np.where(values[1] == 0.0, 1e9, values[0] / values[1])
        return found.T

    def refine(self, unknowns: Colours, given: Colours) -> tuple[Colours, Colours]:
        """Colours by which as many symbols are told from each other as their rows tell."""
        while True:
            count = len({*unknowns}) + len({*given})
            apart = [_with_apart(unknowns, k) for k in range(len(unknowns))]
            own = [_signature(row) for row in self.ratios(apart, given)]
            other = [_signature(self.ratios([unknowns], _with_apart(given, k))[0]) for k in range(len(given))]
            unknowns = _ranks([*zip(unknowns, own, strict=True)])
            given = _ranks([*zip(given, other, strict=True)])
            if len({*unknowns}) + len({*given}) == count:
                return unknowns, given

    def leaves(self, unknowns: Colours, given: Colours) -> Iterator[tuple[Colours, Colours]]:
        """Colours of which every symbol has its own, each of those that are alike first in turn."""
        for which, colours in enumerate((unknowns, given)):
            alike = [k for k in {*colours} if colours.count(k) > 1]
            if alike:
                for k in [k for k, colour in enumerate(colours) if colour == min(alike)]:
                    split = _ranks([(colour, place != k) for place, colour in enumerate(colours)])
                    yield from self.leaves(*self.refine(*((unknowns, split) if which else (split, given))))
                return
        yield unknowns, given

    def key(self, unknowns: Colours, given: Colours) -> tuple[float, ...]:
        """The values of all rows where each symbol has its own colour."""
        return _signature(self.ratios([unknowns], given)[0])

    def exchanges(self) -> tuple[tuple[int, ...], ...]:
        """Orders of the unknowns that leave every row as it is, which may exchange rows of an entry, too."""
        size, given = self.family.size, tuple(range(len(self.kinds)))
        colours = self.refine((0,) * size, given)[0]
        classes = [[k for k in range(size) if colours[k] == colour] for colour in sorted({*colours})]
        orders: list[tuple[int, ...]] = [tuple(range(size))]
        if prod(factorial(len(each)) for each in classes) <= MAX_ORDERS:
            for chosen in product(*(permutations(each) for each in classes)):
                order = [0] * size
                for places, own in zip(classes, chosen, strict=True):
                    for place, k in zip(places, own, strict=True):
                        order[place] = k
                orders.append(tuple(order))
        orders = [*dict.fromkeys(orders)]
        ratios = self.ratios(orders, given)
        rows = np.take_along_axis(ratios, np.argsort(ratios.real, axis=1), axis=1)
        same = np.abs(rows - rows[0]).max(axis=1, initial=0.0) < 1e-8 * np.abs(rows[0]).max(initial=1.0)
        return tuple(each for each, is_same in zip(orders, same, strict=True) if is_same)


def _with_apart(colours: Colours, place: int) -> Colours:
    return (*colours[:place], APART, *colours[place + 1 :])


def _places(colour: int) -> Array:
    """An unknown and its conjugate at two places (2, 2)."""
    rng = np.random.default_rng([18, colour])
    found: Array = rng.normal(size=(2, 2)) + 1j * rng.normal(size=(2, 2))
    return found


def _number(kind: NumberKind, colour: int) -> ComplexArray:
    part = FamilyPart(None, (kind,), 1)  # type: ignore[arg-type]
    rng = np.random.default_rng([19, colour])
    found: ComplexArray = Family(0, (part,)).random_member(rng).parts[0][0, 0]
    return found


def _signature(ratios: ComplexArray) -> tuple[float, ...]:
    told = sorted((_rounded(v.real), _rounded(v.imag)) for v in ratios)
    return tuple(each for both in told for each in both)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}") + 0.0
