"""What stands in the rows of one entry alone, eliminated: places and turns of links, and how far pairs have slid.

A row is complex, F = 0 with its conjugate, or single, equal to plus or minus its own conjugate. A translation stands in
complex rows with a number before it and is put in. A slide s with F = N + s c leaves N c' - N' c. A turn e that stands
in one complex row only, F = N + V e, leaves N N' - V V'. What is left may hold one more turn, linear after e e' = 1:

    A e + B e' + C = 0

Two such rows give e and e' by Cramer's rule, of which the product is one; any more are determinants.
"""

from __future__ import annotations

from itertools import permutations
from typing import NamedTuple

from planar.synthesis.exact.relations.polynomials import Polynomial, Symbol
from planar.synthesis.exact.relations.unknowns import refuse


class Quotient(NamedTuple):
    """What a symbol is, where it and its conjugate have been eliminated."""

    symbol: Symbol
    numerator: Polynomial
    denominator: Polynomial


class LinearRow(NamedTuple):
    """A e + B e' + C."""

    own: Polynomial
    conjugate: Polynomial
    rest: Polynomial


class EntryRows(NamedTuple):
    """The rows of an entry: polynomials, and rows linear in one more `turn`, of which the first two give it.

    `steps` are the symbols that were eliminated, in that order.
    """

    rows: tuple[Polynomial, ...]
    linear: tuple[LinearRow, ...]
    turn: Symbol | None
    steps: tuple[Quotient, ...]

    @property
    def equation_count(self) -> int:
        """How many equations they make."""
        return len(self.rows) + (len(self.linear) - 1 if self.turn else 0)

    @property
    def symbols(self) -> frozenset[int]:
        """The numbers of all symbols that stand in them."""
        parts = [*self.rows, *(part for row in self.linear for part in row)]
        return frozenset[int]().union(*(each.symbols for each in parts))


def eliminate(
    rows: list[Polynomial], translations: list[Symbol], slides: list[Symbol], turns: list[Symbol]
) -> EntryRows:
    """The rows of an entry without its own symbols. Raises BadInput where more than one turn is left."""
    steps: list[Quotient] = []
    rows = _shortest_loops(_without_translations(rows, translations, steps), turns)
    single: list[Polynomial] = []
    for slide in slides:
        rows, single = _without_slide(rows, single, slide, steps)
    for turn in turns:
        holding = [row for row in rows if {*turn} & row.symbols]
        if len(holding) == 1 and not any({*turn} & row.symbols for row in single):
            row = holding[0]
            powers = row.by_powers(turn.own)
            if max(powers) > 1 or turn.conjugate in row.symbols:
                raise refuse("a turn stands in its rows by more than its first power")
            rest, factor = powers.get(0, Polynomial({})), powers[1]
            rows = [each for each in rows if each is not row]
            single.append(rest * rest.conjugate - factor * factor.conjugate)
            steps.append(Quotient(turn, -rest, factor))
    left = [turn for turn in turns if any({*turn} & row.symbols for row in (*rows, *single))]
    if len(left) > 1:
        raise refuse("its links need more than one unknown turn at a time, as those of six-bars do")
    if not left:
        return EntryRows((*_with_conjugates(rows), *single), (), None, tuple(steps))
    turn = left[0]
    linear, plain = [], []
    for each in (*_with_conjugates(rows), *single):
        if {*turn} & each.symbols:
            linear.append(_linear_row(each.with_unit(turn), turn))
        else:
            plain.append(each)
    if len(linear) < 2:
        raise refuse("its links are left free")
    return EntryRows(tuple(plain), tuple(linear), turn, tuple(steps))


def _with_conjugates(rows: list[Polynomial]) -> list[Polynomial]:
    return [each for row in rows for each in (row, row.conjugate)]


def _without_translations(
    rows: list[Polynomial], translations: list[Symbol], steps: list[Quotient]
) -> list[Polynomial]:
    for each in translations:
        for row in rows:
            factor = row.by_powers(each.own).get(1, Polynomial({})).constant()
            if factor:
                value = row.by_powers(each.own)[0] * (-1.0 / factor)
                new = {each.own: value, each.conjugate: value.conjugate}
                rows = [other.substitute(new) for other in rows if other is not row]
                steps.append(Quotient(each, value, Polynomial({(): 1.0})))
                break
        else:
            raise refuse("a link is tied to nothing")
    return [row for row in rows if row.terms]


def _shortest_loops(rows: list[Polynomial], turns: list[Symbol]) -> list[Polynomial]:
    """Loops that close, as rows, made of others so that each has as few turns as can be, by adding one to another."""

    def many(row: Polynomial) -> int:
        return sum(bool({*turn} & row.symbols) for turn in turns)

    rows, is_shorter = [*rows], True
    while is_shorter:
        is_shorter = False
        for (i, one), (j, other) in permutations(enumerate(rows), 2):
            shorter = min((other + one, other - one), key=many)
            if rows[i] is one and rows[j] is other and many(shorter) < many(other):
                rows[j], is_shorter = shorter, True
    return rows


def _without_slide(
    rows: list[Polynomial], single: list[Polynomial], slide: Symbol, steps: list[Quotient]
) -> tuple[list[Polynomial], list[Polynomial]]:
    holding = [row for row in rows if slide.own in row.symbols]
    if len(holding) != 1:
        raise refuse("a slide stands in several rows")
    powers = holding[0].by_powers(slide.own)
    rest, factor = powers.get(0, Polynomial({})), powers[1]
    steps.append(Quotient(slide, -rest, factor))
    whole = rest * factor.conjugate
    return [row for row in rows if row is not holding[0]], [*single, whole - whole.conjugate]


def _linear_row(row: Polynomial, turn: Symbol) -> LinearRow:
    powers = row.by_powers(turn.own)
    own, rest = powers.get(1, Polynomial({})), powers.get(0, Polynomial({}))
    back = rest.by_powers(turn.conjugate)
    is_linear = max(powers) <= 1 and max(back, default=0) <= 1 and not {*turn} & own.symbols
    if not is_linear:
        raise refuse("a turn stands in its rows by more than its first power")
    return LinearRow(own, back.get(1, Polynomial({})), back.get(0, Polynomial({})))
