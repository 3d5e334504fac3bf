"""A member of a family in the digits of balls: paths that doubles lose, and proofs of solutions.

Slow. Predictor by the polynomial through the last points, corrector by Newton's method.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import prod
from typing import Any, NamedTuple

import numpy as np

from planar.assemblies.polynomial.krawczyk import (
    ProvedBox,
    apart_boxes,
    ball,
    ball_precision,
    direction_ball,
    exact_ball,
    is_own_image,
    newton_step,
    polished_balls,
    prove_box,
    relative_size,
)
from planar.foundation.arrays import BoolArray, ComplexArray
from planar.synthesis.exact.relations.exact_numbers import ExactNumber
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.relations.unknowns import NumberKind

NumberBalls = list[list[list[Any]]]
"""The numbers of a member as balls: (parts, entries, numbers and their conjugates)."""


class MemberInBalls:
    """The equations of a member whose numbers are balls."""

    def __init__(self, family: Family, numbers: NumberBalls):
        self.parts: list[tuple[Any, list[list[Any]]]] = []
        given: list[Any] = []
        for k, (part, entries) in enumerate(zip(family.parts, numbers, strict=True)):
            rows = [_symbol_values(part.kinds, entry) for entry in entries]
            if k == 0:
                given = rows[0]
            self.parts.append((part.rows, [given] if k == 0 else [[*given, *row] for row in rows]))

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


def member_balls(family: Family, member: Member) -> NumberBalls:
    """The numbers of a member as balls; those of a task as its file has them."""
    return [
        [
            _number_balls(part.kinds, numbers[entry], None if member.exact is None else member.exact[k][entry])
            for entry in range(part.entry_count)
        ]
        for k, (part, numbers) in enumerate(zip(family.parts, member.parts, strict=True))
    ]


def _balls_between(begin: NumberBalls, end: NumberBalls, remainder: float) -> NumberBalls:
    """The numbers at a position on the straight path from one member to another, a part of which remains."""
    if not remainder:
        return end
    return [
        [
            [b + remainder * (a - b) for a, b in zip(first, last, strict=True)]
            for first, last in zip(*entries, strict=True)
        ]
        for entries in zip(begin, end, strict=True)
    ]


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


MOST_PATHS = 30
"""That are worth following: they take seconds each."""
FIRST_STEP, LEAST_STEP = 1e-4, 1e-9
"""Of what is left of the way."""
SINGULAR_END = 1e-18
"""What is left of the way where a path is said to end where several solutions meet."""
FAR = 1e5
"""An unknown that is greater where next to nothing of the way is left goes to infinity."""
FARTHEST = 1e11
"""What is farther out than this is at infinity."""
MOST_STEPS = 10_000
POINTS = 6
"""Through so many the predictor goes at most."""
NEAR, CORRECTION = 1e-4, 1e-9
"""What Newton's first and second step may move a solution by."""
SAFETY, FACTORS = 0.8, (0.2, 2.0)
"""Of the step that corrections call for, and its bounds over the one before it."""


def follow_in_balls(family: Family, begin: Member, x: ComplexArray, end: Member, left: float = 1.0) -> ComplexArray:
    """Solutions x (paths, unknowns) on the way from one member to another, where so much of it is left, followed to its
    end; infinite where a path goes to infinity, no numbers where it does not come to an end."""
    found = np.full_like(x, np.nan)
    with ball_precision():
        first, last = (member_balls(family, member) for member in (Member(begin.parts), end))
        for k, own in enumerate(x):
            w, is_end = _follow_path(family, first, [ball(complex(each)) for each in own], last, left)
            if is_end:
                found[k] = [complex(value) for value in w]
            elif _greatest(w) > FAR:
                found[k] = np.inf
    return found


def _greatest(w: Sequence[Any]) -> float:
    return max((abs(complex(value)) for value in w), default=0.0)


def _follow_path(
    family: Family, begin: NumberBalls, w: list[Any], end: NumberBalls, left: float
) -> tuple[list[Any], bool]:
    """The last point of the path from a solution, and whether that is its end; none where it was lost before."""
    first = _corrected(MemberInBalls(family, _balls_between(begin, end, left)), w)[0]
    if first is None:
        return [], False
    points = [(left, first)]
    step = FIRST_STEP
    for _ in range(MOST_STEPS):
        left = points[-1][0]
        is_over = left < SINGULAR_END or _greatest(points[-1][1]) > FARTHEST
        if is_over or step < LEAST_STEP:
            return (points[-1][1] if is_over else []), False
        here = left * (1.0 - step) if step < 0.5 else 0.0
        at, off = _corrected(MemberInBalls(family, _balls_between(begin, end, here)), _predicted(points, here))
        if at is not None:
            if not here:
                return at, True
            points = [*points[1 - POINTS :], (here, at)]
        factor = SAFETY * (0.25 * NEAR / max(off, 1e-300)) ** (1.0 / len(points))
        step = min(1.0, step * min(max(factor, FACTORS[0]), FACTORS[1] if at is not None else 0.5))
    return [], False


def _corrected(equations: MemberInBalls, w: list[Any]) -> tuple[list[Any] | None, float]:
    """A solution near w, and how far that was off; None where Newton's method does not come to one at once."""
    sizes = []
    for _ in range(3):
        step = newton_step(equations, w)
        if step is None:
            return None, float("inf")
        w = [(one - other).mid() for one, other in zip(w, step, strict=True)]
        sizes.append(relative_size(step, w))
        if (len(sizes) > 1 and sizes[1] > CORRECTION) or sizes[0] > NEAR:
            return None, sizes[0]
    return w, sizes[0]


def _predicted(points: Sequence[tuple[float, list[Any]]], here: float) -> list[Any]:
    """The polynomial through points, elsewhere (Lagrange); with all digits, as far out the rounding of a double in one
    unknown moves another one by more than the step does."""
    places = [place for place, _ in points]
    distances = [ball(here) - place for place in places]
    weights = []
    for k, place in enumerate(map(ball, places)):
        numerator = prod([distance for n, distance in enumerate(distances) if n != k], start=ball(1.0))
        weights.append(numerator / prod([place - other for n, other in enumerate(places) if n != k], start=ball(1.0)))
    entries = zip(*(w for _, w in points), strict=True)
    return [sum((weight * each for weight, each in zip(weights, own, strict=True)), ball(0.0)).mid() for own in entries]


SAME_SOLUTION = 1e-9
"""Of the size of a solution: two that are nearer to each other are one."""
MAX_CORRECTION = 0.1
"""Of the size of a solution: one that moves farther as it is polished may have come to another one."""


class ExactCertificates(NamedTuple):
    """Of every solution: whether it is proved, and proved to be real; `x` are the solutions to the last digit."""

    proved: BoolArray
    is_real: BoolArray
    x: ComplexArray


def certify_member(family: Family, member: Member, x: ComplexArray) -> ExactCertificates:
    """What is proved of solutions x (solutions, unknowns) of a real member, whose numbers are the floats they are."""
    with ball_precision():
        equations = MemberInBalls(family, member_balls(family, member))
        proved, real = np.zeros(len(x), dtype=bool), np.zeros(len(x), dtype=bool)
        half = np.full(len(x), np.inf)
        exact = x.copy()
        boxes: list[ProvedBox | None] = []
        for k, value in enumerate(x):
            middle = polished_balls(equations, value)
            box = prove_box(equations, middle) if middle is not None else None
            boxes.append(box)
            if box is not None:
                proved[k], half[k] = True, box.half
                exact[k] = [complex(one) for one in box.middle]
        correction = np.abs(exact - x).max(axis=1, initial=0.0) / np.abs(x).max(axis=1, initial=1.0)
        for k in np.flatnonzero(correction > MAX_CORRECTION).tolist():
            distance = np.abs(np.delete(exact, k, axis=0) - exact[k]).max(axis=1, initial=0.0)
            if distance.min(initial=np.inf) < SAME_SOLUTION * np.abs(exact[k]).max(initial=1.0):
                boxes[k], proved[k], half[k], exact[k] = None, False, np.inf, x[k]  # polished to another one
        proved = apart_boxes(exact, half, proved)
        for k, box in enumerate(boxes):
            real[k] = box is not None and proved[k] and is_own_image(box)
        return ExactCertificates(proved, real, exact)
