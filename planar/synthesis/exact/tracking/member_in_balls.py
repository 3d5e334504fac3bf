"""The rows of a member of a family in ball arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from planar.assemblies.polynomial.krawczyk import ball, direction_ball, exact_ball
from planar.foundation.arrays import ComplexArray
from planar.synthesis.exact.relations.exact_numbers import ExactNumber
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.relations.unknowns import NumberKind


class MemberInBalls:
    """The equations of a member, or of one a part `back` of the way from it to another; of a task's numbers as its file
    has them."""

    def __init__(self, family: Family, member: Member, other: Member | None = None, back: float = 0.0):
        self.parts: list[tuple[Any, list[list[Any]]]] = []
        given: list[Any] = []
        for k, (part, numbers) in enumerate(zip(family.parts, member.parts, strict=True)):
            exact = None if member.exact is None else member.exact[k]
            rows = []
            for entry in range(part.entry_count):
                here = _number_balls(part.kinds, numbers[entry], None if exact is None else exact[entry])
                if other is not None and back:
                    there = _number_balls(part.kinds, other.parts[k][entry], None)
                    here = [a + back * (b - a) for a, b in zip(here, there, strict=True)]
                rows.append(_symbol_values(part.kinds, here))
            if k == 0:
                given = rows[0]
            self.parts.append((part.rows, [given] if k == 0 else [[*given, *own] for own in rows]))

    def __call__(self, w: Sequence[Any]) -> tuple[list[Any], list[list[Any]]]:
        """The rows and their Jacobian at a box of balls."""
        f: list[Any] = []
        slope: list[list[Any]] = []
        for rows, entries in self.parts:
            if not rows.equation_count:
                continue
            for numbers in entries:
                own, own_slope = rows.evaluate_as(w, numbers)
                f += own
                slope += own_slope
        return f, slope


def _number_balls(kinds: Sequence[NumberKind], numbers: ComplexArray, exact: Sequence[ExactNumber] | None) -> list[Any]:
    """The numbers of an entry, each beside its conjugate."""
    if exact is None:
        return [ball(complex(each)) for pair in numbers for each in pair]
    values = [exact_ball(*each) for each in exact]
    pairs = [
        (value, value if kind in (NumberKind.TURN, NumberKind.LENGTH) else value.conjugate())
        for kind, value in zip(kinds, values, strict=True)
    ]
    return [each for pair in pairs for each in pair]


def _symbol_values(kinds: Sequence[NumberKind], numbers: Sequence[Any]) -> list[Any]:
    """What stands for the symbols of an entry."""
    values: list[Any] = []
    for k, kind in enumerate(kinds):
        own, conjugate = numbers[2 * k : 2 * k + 2]
        values += [direction_ball(own), direction_ball(-own)] if kind is NumberKind.TURN else [own, conjugate]
    return values
