"""Krawczyk's operator on any square system of complex equations in ball arithmetic: a box with one solution in it.

R. Krawczyk, Computing 4, 1969; S. M. Rump, Verification methods, Acta Numerica 19, 2010, sec. 13.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray

BALL_PRECISION_BITS = 192
BOX_HALF_WIDTHS = (1e-7, 1e-9, 1e-11, 1e-13, 1e-16, 1e-20, 1e-24, 1e-28)
"""Half widths of boxes that are tried, the widest first."""
POLISHING_STEPS, POLISHED = 12, 1e-36
"""At most, and of a solution's entries: what moves it by less is the last."""

BallEquations = Callable[[Sequence[Any]], tuple[list[Any], list[list[Any]]]]
"""The equations at a box of balls, and their Jacobian."""


class ProvedBox(NamedTuple):
    """A box that holds one solution and no other: its middle, its half width, and a narrow box of the solution."""

    middle: list[Any]
    half: float
    inside: list[Any]


@contextmanager
def ball_precision() -> Iterator[None]:
    """Balls of the precision that proofs take."""
    from flint import ctx

    before, ctx.prec = ctx.prec, BALL_PRECISION_BITS
    try:
        yield
    finally:
        ctx.prec = before


def ball(value: complex) -> Any:
    """A number that is what its digits say."""
    from flint import acb

    return acb(value.real, value.imag)


def exact_ball(real: Fraction, imaginary: Fraction, pi_multiple: Fraction) -> Any:
    """real + i imaginary + pi pi_multiple, enclosed."""
    from flint import acb, arb, fmpq

    x, y, turn = (arb(fmpq(each.numerator, each.denominator)) for each in (real, imaginary, pi_multiple))
    return acb(x + turn * arb.pi() if pi_multiple else x, y)


def direction_ball(angle: Any) -> Any:
    """exp(i angle) of a ball, enclosed."""
    from flint import acb

    return (acb(0.0, 1.0) * angle).exp()


def _inverse(slope: list[list[Any]]) -> Any | None:
    """A matrix near the inverse of a Jacobian, in the digits of balls: far solutions leave doubles too few."""
    from flint import acb_mat

    try:
        return acb_mat([[each.mid() for each in row] for row in slope]).inv().mid()
    except (ZeroDivisionError, ValueError):
        return None


def newton_step(equations: BallEquations, at: Sequence[Any]) -> list[Any] | None:
    """What Newton's method takes from w, None where the Jacobian has no inverse."""
    from flint import acb_mat

    left, slope = equations(at)
    near = _inverse(slope)
    return None if near is None else (near * acb_mat([[each] for each in left])).entries()


def polished_balls(equations: BallEquations, w: ComplexArray) -> list[Any] | None:
    """A solution near w to the precision of balls, by Newton's method."""
    at = [ball(complex(each)) for each in w]
    for _ in range(POLISHING_STEPS):
        step = newton_step(equations, at)
        if step is None:
            return None
        at = [(one - other).mid() for one, other in zip(at, step, strict=True)]
        if relative_size(step, at) < POLISHED:
            break
    return at


def relative_size(step: Sequence[Any], at: Sequence[Any]) -> float:
    """The greatest entry of a step, of those it is taken from where they are greater than one."""
    sizes = (abs(complex(each.mid())) / max(1.0, abs(complex(one))) for each, one in zip(step, at, strict=True))
    return max(sizes, default=0.0)


def prove_box(equations: BallEquations, middle: list[Any]) -> ProvedBox | None:
    """A box about a middle that is proved to hold one solution and no other."""
    from flint import acb_mat

    left, slope = equations(middle)
    near = _inverse(slope)
    if near is None:
        return None
    step = near * acb_mat([[each] for each in left])
    many = len(middle)
    one = acb_mat(many, many, [1 if i == j else 0 for i in range(many) for j in range(many)])
    for half in BOX_HALF_WIDTHS:
        wide = one - near * acb_mat(equations([box_about(each, half) for each in middle])[1])
        about = acb_mat([[box_about(ball(0.0), half)] for _ in range(many)])
        moved = (wide * about - step).entries()
        if all(is_within(each, half) for each in moved):
            return ProvedBox(middle, half, [at + each for at, each in zip(middle, moved, strict=True)])
    return None


def box_about(middle: Any, half: float) -> Any:
    """A square of this half width."""
    from flint import acb, arb

    off = arb(0.0, half)
    return acb(middle.real + off, middle.imag + off)


def is_within(each: Any, half: float) -> bool:
    """Whether a ball lies inside of a square about nothing."""
    return bool(each.real.abs_upper() < half) and bool(each.imag.abs_upper() < half)


def is_own_image(box: ProvedBox) -> bool:
    """Whether the solution is the conjugate of itself with its two halves exchanged, as the equations are: its image
    lies in the box of which it is the only one."""
    n = len(box.inside) // 2
    image = [each.conjugate() for each in (*box.inside[n:], *box.inside[:n])]
    return all(is_within(each - at, box.half) for each, at in zip(image, box.middle, strict=True))


def apart_boxes(w: ComplexArray, half: Array, proved: BoolArray) -> BoolArray:
    """Which proved boxes about w (solutions, unknowns) lie apart from each other, with a factor of two to spare."""
    safe = np.where(np.isfinite(half), half, 0.0)
    found = proved.copy()
    key = w @ np.exp(1j * np.arange(1, w.shape[1] + 1))
    room = 4.0 * safe.max(initial=0.0) * (2.0 * w.shape[1])
    order: IntArray = np.argsort(key.real, kind="stable")
    for at, k in enumerate(order.tolist()):
        for other in order[at + 1 :].tolist():
            if key[other].real - key[k].real > room:
                break
            both = found[k] and found[other]
            if both and float(np.abs(w[k] - w[other]).max()) <= 4.0 * (safe[k] + safe[other]):
                found[k] = False  # the other may stay
                break
    return found
