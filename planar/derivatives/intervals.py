"""Interval arithmetic on arrays, rounded outward: what casadi's instructions make of intervals, and balls of matrices.

Sums, products, quotients and roots of floats are rounded correctly, so that the next float outward bounds them. Cosines
are those of a series whose rounding is bounded beforehand, after Cody's and Waite's reduction, and arctangents are
bounded by these: no library's cosine is trusted (R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval
Analysis, SIAM 2009, ch. 2 and 5). Where nothing finite is known, bounds are NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from math import factorial
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.equations.generic_evaluation import OPERATIONS, evaluate_function
from planar.foundation.arrays import Array, BoolArray

HALF_PI_PARTS = (1.5707963267341256, 6.077100506506192e-11)
"""pi / 2 to 33 binary digits, times any number of quarter turns below 2^20 a float, and the rest to 1e-26."""
MAX_ANGLE = 1e5
"""rad: cosines of greater angles are not told."""
COSINE_ERROR = 1e-14
"""Twice what the series, its 24 operations below 1.4 and the reduction may be off by."""
UNIT_ROUNDOFF = 2.0**-53
OVER = 1.0 + 2.0**-40
"""What a sum of positive floats is multiplied by to be above that of the numbers."""
TINY = 1e-290
"""Above what products below the least floats lose."""
COSINE_TERMS = [(-1.0) ** k / factorial(2 * k) for k in range(10)]
SINE_TERMS = [(-1.0) ** k / factorial(2 * k + 1) for k in range(10)]


def down(value: Array) -> Array:
    """The next floats below."""
    return np.nextafter(value, -np.inf)


def up(value: Array) -> Array:
    """The next floats above."""
    return np.nextafter(value, np.inf)


class Intervals:
    """Arrays of lower and upper bounds, which may be broadcast to one another's shape."""

    __slots__ = ("lower", "upper")

    def __init__(self, lower: Array, upper: Array):
        self.lower, self.upper = lower, upper

    def __add__(self, other: Intervals) -> Intervals:
        return Intervals(down(self.lower + other.lower), up(self.upper + other.upper))

    def __sub__(self, other: Intervals) -> Intervals:
        return Intervals(down(self.lower - other.upper), up(self.upper - other.lower))

    def __neg__(self) -> Intervals:
        return Intervals(-self.upper, -self.lower)

    def __mul__(self, other: Intervals) -> Intervals:
        if other is self:
            return self.square()
        a, b = self.lower * other.lower, self.lower * other.upper
        c, d = self.upper * other.lower, self.upper * other.upper
        low = np.minimum(np.minimum(a, b), np.minimum(c, d))
        return Intervals(down(low), up(np.maximum(np.maximum(a, b), np.maximum(c, d))))

    def inverse(self) -> Intervals:
        """1 / x; NaN where 0 is within."""
        is_known = (self.lower > 0.0) | (self.upper < 0.0)
        low, high = np.where(is_known, self.upper, np.nan), np.where(is_known, self.lower, np.nan)
        return Intervals(down(1.0 / low), up(1.0 / high))

    def __truediv__(self, other: Intervals) -> Intervals:
        is_known = (other.lower > 0.0) | (other.upper < 0.0)
        low, high = np.where(is_known, other.lower, np.nan), np.where(is_known, other.upper, np.nan)
        quotients = [self.lower / low, self.lower / high, self.upper / low, self.upper / high]
        return Intervals(down(np.minimum.reduce(quotients)), up(np.maximum.reduce(quotients)))

    def twice(self) -> Intervals:
        """2 x."""
        return Intervals(2.0 * self.lower, 2.0 * self.upper)

    def magnitude(self) -> Intervals:
        """|x|."""
        low = np.maximum(np.maximum(self.lower, -self.upper), 0.0)
        return Intervals(low, np.maximum(-self.lower, self.upper))

    def sign(self) -> Intervals:
        """Of x; from -1 to 1 where 0 is within, as the slope of |x| is."""
        low = np.where(self.lower > 0.0, 1.0, np.where(self.lower <= 0.0, -1.0, np.nan))
        return Intervals(low, np.where(self.upper < 0.0, -1.0, np.where(self.upper >= 0.0, 1.0, np.nan)))

    def square(self) -> Intervals:
        """x^2."""
        size = self.magnitude()
        return Intervals(np.maximum(down(size.lower * size.lower), 0.0), up(size.upper * size.upper))

    def sqrt(self) -> Intervals:
        """The root; NaN where anything below 0 is within."""
        known = np.where(self.lower >= 0.0, self.lower, np.nan)
        return Intervals(
            np.maximum(down(np.sqrt(known)), 0.0), up(np.sqrt(np.where(self.lower >= 0.0, self.upper, np.nan)))
        )

    def cos(self) -> Intervals:
        """The cosine."""
        return _turned_cosine(self, 0)

    def sin(self) -> Intervals:
        """The sine, which is the cosine a quarter turn back."""
        return _turned_cosine(self, 3)

    def atan2(self, other: Intervals) -> Intervals:
        """The angle at x = other, y = self; NaN where the half line to the left, or the origin, is within."""
        y, x = self, other
        is_known = (x.lower > 0.0) | (y.lower > 0.0) | (y.upper < 0.0)
        corners = [_point_angle(*corner) for corner in product((y.lower, y.upper), (x.lower, x.upper))]
        low = np.minimum.reduce([corner.lower for corner in corners])
        high = np.maximum.reduce([corner.upper for corner in corners])
        return Intervals(np.where(is_known, low, np.nan), np.where(is_known, high, np.nan))


def exact(value: Any) -> Intervals:
    """Floats as they are."""
    bounds = np.asarray(value, dtype=float)
    return Intervals(bounds, bounds)


def _float_cosine(angle: Array, quarters: int) -> Array:
    """The cosine of floats, some quarter turns on, but for COSINE_ERROR."""
    known = np.where(np.abs(angle) < MAX_ANGLE, angle, np.nan)
    turns = np.rint(known / (HALF_PI_PARTS[0] + HALF_PI_PARTS[1]))
    rest = (known - turns * HALF_PI_PARTS[0]) - turns * HALF_PI_PARTS[1]
    square = rest * rest
    even, odd = (np.full_like(square, terms[-1]) for terms in (COSINE_TERMS, SINE_TERMS))
    for one, other in zip(COSINE_TERMS[-2::-1], SINE_TERMS[-2::-1], strict=True):
        even, odd = even * square + one, odd * square + other
    odd = odd * rest
    place = np.mod(turns + quarters, 4.0)
    found: Array = np.where(place == 0.0, even, np.where(place == 1.0, -odd, np.where(place == 2.0, -even, odd)))
    return found


def _turned_cosine(angle: Intervals, quarters: int) -> Intervals:
    """cos(x + quarters pi / 2): extremes are at the ends, but for whole and half turns within."""
    one = other = _float_cosine(angle.lower, quarters)
    if angle.lower is not angle.upper:
        other = _float_cosine(angle.upper, quarters)
    upper = np.where(_may_hold(angle, 0.25 * quarters), 1.0, np.minimum(np.maximum(one, other) + COSINE_ERROR, 1.0))
    lower = np.where(
        _may_hold(angle, 0.25 * quarters - 0.5), -1.0, np.maximum(np.minimum(one, other) - COSINE_ERROR, -1.0)
    )
    known = np.isfinite(one) & np.isfinite(other)
    return Intervals(np.where(known, lower, np.nan), np.where(known, upper, np.nan))


def _may_hold(angle: Intervals, on: float) -> BoolArray:
    """Whether a whole turn lies within, as far as floats tell it, once so many turns are added."""
    low, high = (end / (2.0 * np.pi) + on for end in (angle.lower, angle.upper))
    margin = 1e-14 * (1.0 + np.maximum(np.abs(low), np.abs(high)))
    found: BoolArray = np.floor(high + margin) >= np.ceil(low - margin)
    return found


def _point_angle(y: Array, x: Array) -> Intervals:
    """The angle of points, by what turning them back by a float near it leaves: |atan t| <= |t|."""
    near = np.arctan2(y, x)
    cos, sin = exact(near).cos(), exact(near).sin()
    across, along = exact(y) * cos - exact(x) * sin, exact(x) * cos + exact(y) * sin
    error = (across / along).magnitude().upper
    return Intervals(down(near - error), up(near + error))


INTERVAL_OPERATIONS: Mapping[int, Callable[..., Intervals]] = {
    **{code: OPERATIONS[code] for code in (ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV, ca.OP_NEG, ca.OP_COS)},
    **{code: OPERATIONS[code] for code in (ca.OP_SIN, ca.OP_ASSIGN)},
    ca.OP_SQ: Intervals.square,
    ca.OP_TWICE: Intervals.twice,
    ca.OP_INV: Intervals.inverse,
    ca.OP_SQRT: Intervals.sqrt,
    ca.OP_FABS: Intervals.magnitude,
    ca.OP_SIGN: Intervals.sign,
    ca.OP_ATAN2: Intervals.atan2,
}


def evaluate_intervals(function: ca.Function, inputs: Sequence[Sequence[Intervals]]) -> list[list[Intervals]]:
    """The results of a casadi function of intervals, dense, column by column. Raises KeyError for an operation that is
    not of `INTERVAL_OPERATIONS`."""
    return evaluate_function(function, inputs, exact, lambda code, operands: INTERVAL_OPERATIONS[code](*operands))


class Balls(NamedTuple):
    """Matrices (lanes, rows, columns) that are each entry within a radius of the middle."""

    middle: Array
    radius: Array

    @property
    def size(self) -> Array:
        """The greatest that entries may be."""
        return (np.abs(self.middle) + self.radius) * OVER

    def rows(self, which: Any) -> Balls:
        """Those of some lanes."""
        return Balls(self.middle[which], self.radius[which])

    def times(self, factor: Array) -> Balls:
        """factor @ self, of matrices of floats; a sum of n products in any order is off by n roundings at most."""
        return Balls(factor, np.zeros_like(factor)).product(self)

    def product(self, other: Balls) -> Balls:
        """self @ other."""
        rounding = (other.middle.shape[-2] + 2) * UNIT_ROUNDOFF
        radius = np.abs(self.middle) @ (other.radius + rounding * np.abs(other.middle)) + self.radius @ other.size
        return Balls(self.middle @ other.middle, radius * OVER + TINY)

    def plus(self, other: Balls) -> Balls:
        """self + other."""
        middle = self.middle + other.middle
        return Balls(middle, (self.radius + other.radius + 2.0 * UNIT_ROUNDOFF * np.abs(middle)) * OVER + TINY)


def mean_of_balls(parts: Sequence[Balls]) -> Balls:
    """The mean of some."""
    if len(parts) == 1:
        return parts[0]
    middle = np.mean([part.middle for part in parts], axis=0)
    size = np.mean([np.abs(part.middle) for part in parts], axis=0)
    radius = np.mean([part.radius for part in parts], axis=0)
    return Balls(middle, (radius + (len(parts) + 1) * 2.0 * UNIT_ROUNDOFF * size) * OVER + TINY)


def to_balls(lower: Array, upper: Array) -> Balls:
    """The balls that hold intervals."""
    middle = 0.5 * (lower + upper)
    return Balls(middle, up(np.maximum(upper - middle, middle - lower)) * OVER)
