"""Paths from one member of a family to another in the digits of balls: slow, for those that doubles lose.

Predictor by the polynomial through the last points, corrector by Newton's method.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planar.assemblies.polynomial.krawczyk import ball, ball_precision, newton_step, relative_size
from planar.foundation.arrays import ComplexArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.member_in_balls import MemberInBalls

MOST_PATHS = 30
"""That are worth following: they take seconds each."""
FIRST_STEP, LEAST_STEP = 1e-4, 1e-9
"""Of what is left of the way."""
SINGULAR_END = 1e-18
"""What is left of the way where a path is said to end where several solutions meet."""
FAR = 1e5
"""An unknown that is greater where next to nothing of the way is left goes to infinity."""
MOST_STEPS = 10_000
POINTS = 6
"""Through so many the predictor goes at most."""
NEAR, CORRECTION = 1e-4, 1e-9
"""What Newton's first and second step may move a solution by."""
SAFETY, FACTORS = 0.8, (0.2, 2.0)
"""Of the step that corrections call for, and its bounds over the one before it."""


def follow_in_balls(family: Family, begin: Member, x: ComplexArray, end: Member) -> ComplexArray:
    """Solutions x (paths, unknowns) of one member followed to another; infinite where a path goes to
    infinity, no numbers where it does not come to an end."""
    found = np.full_like(x, np.nan)
    with ball_precision():
        for k, own in enumerate(x):
            w, is_end = _follow_path(family, begin, [ball(complex(each)) for each in own], end)
            if is_end:
                found[k] = [complex(each) for each in w]
            elif max((abs(complex(each)) for each in w), default=0.0) > FAR:
                found[k] = np.inf
    return found


def _follow_path(family: Family, begin: Member, w: list[Any], end: Member) -> tuple[list[Any], bool]:
    """The last point of the path from a solution, and whether that is its end; none where it was lost before."""
    first = _corrected(MemberInBalls(family, end, begin, 1.0), w)[0]
    if first is None:
        return [], False
    points = [(1.0, first)]
    step = FIRST_STEP
    for _ in range(MOST_STEPS):
        left = points[-1][0]
        if left < SINGULAR_END or step < LEAST_STEP:
            return (points[-1][1] if left < SINGULAR_END else []), False
        here = left * (1.0 - step) if step < 0.5 else 0.0
        at, off = _corrected(MemberInBalls(family, end, begin, here), _predicted(points, here))
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
    """The polynomial through points, elsewhere (Lagrange)."""
    weights = []
    for k, (one, _) in enumerate(points):
        others = [other for n, (other, _) in enumerate(points) if n != k]
        weights.append(float(np.prod([(here - other) / (one - other) for other in others])))
    entries = zip(*(w for _, w in points), strict=True)
    return [sum((weight * each for weight, each in zip(weights, own, strict=True)), ball(0.0)).mid() for own in entries]
