"""The rows of a member of a family in ball arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from planar.assemblies.polynomial.krawczyk import ball, direction_ball
from planar.foundation.arrays import ComplexArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.relations.unknowns import NumberKind


class MemberInBalls:
    """The equations of a member, or of one a part `back` of the way from it to another."""

    def __init__(self, family: Family, member: Member, other: Member | None = None, back: float = 0.0):
        self.parts: list[tuple[Any, list[list[Any]]]] = []
        given: list[Any] = []
        others = member.parts if other is None else other.parts
        for k, (part, numbers, there) in enumerate(zip(family.parts, member.parts, others, strict=True)):
            rows = [_in_balls(part.kinds, *each, back) for each in zip(numbers, there, strict=True)]
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


def _in_balls(kinds: Sequence[NumberKind], numbers: ComplexArray, others: ComplexArray, back: float) -> list[Any]:
    found = []
    for kind, own, there in zip(kinds, numbers, others, strict=True):
        here, end = ([ball(complex(each)) for each in pair] for pair in (own, there))
        value, other = (a + back * (b - a) for a, b in zip(here, end, strict=True)) if back else here
        if kind is NumberKind.TURN:
            found += [direction_ball(value), direction_ball(-value)]
        else:
            found += [value, other]
    return found
