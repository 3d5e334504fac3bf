"""Solutions of F(x, t) = 0 and results r(x, t) over boxes of parameters, enclosed by Krawczyk's operator.

For t in a box P about p, x in a box X about c, and any matrix Y near the inverse of the middle of F_x(X, P)

    K = c - Y F(c, p) - Y F_t(X, P) (P - p) + (1 - Y F_x(X, P)) (X - c)

holds every solution in X, and where K lies inside of X there is one for each t, no other one in X, and F_x is regular
(R. Krawczyk, Computing 4 (1969) 187; A. Neumaier, Interval Methods for Systems of Equations, Cambridge 1990, ch. 5;
R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, ch. 8). How they move with the
parameters, S = dx/dt, is enclosed by S = -Y F_t + (1 - Y F_x) S over the same boxes.

Intervals are rounded outward. Sums, products, quotients and roots of floats are rounded correctly, so that the next
float outward bounds them. Cosines are those of a series whose rounding is bounded beforehand, after Cody's and Waite's
reduction, and arctangents are bounded by these: no library's cosine is trusted (Moore, Kearfott, Cloud, ch. 2 and 5).
Bounds are NaN where nothing finite is known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from math import factorial
from typing import Any, NamedTuple, TypeAlias

import casadi as ca
import numpy as np

from planar.equations.casadi_functions import OPERATIONS, BufferedFunction, evaluate_function
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import BadInput
from planar.foundation.generalised_inverses import invert_matrices

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

    def __truediv__(self, other: Intervals) -> Intervals:
        is_known = (other.lower > 0.0) | (other.upper < 0.0)
        low, high = np.where(is_known, other.lower, np.nan), np.where(is_known, other.upper, np.nan)
        quotients = [self.lower / low, self.lower / high, self.upper / low, self.upper / high]
        return Intervals(down(np.minimum.reduce(quotients)), up(np.maximum.reduce(quotients)))

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
        """The root; NaN where the interval goes below 0."""
        lower, upper = (np.where(self.lower >= 0.0, bound, np.nan) for bound in (self.lower, self.upper))
        return Intervals(np.maximum(down(np.sqrt(lower)), 0.0), up(np.sqrt(upper)))

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
    quadrant = np.mod(turns + quarters, 4.0)
    cosine: Array = np.where(
        quadrant == 0.0, even, np.where(quadrant == 1.0, -odd, np.where(quadrant == 2.0, -even, odd))
    )
    return cosine


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


def _may_hold(angle: Intervals, offset: float) -> BoolArray:
    """Whether a multiple of a full turn may lie within an angle after some turns are added to it."""
    low, high = (bound / (2.0 * np.pi) + offset for bound in (angle.lower, angle.upper))
    margin = 1e-14 * (1.0 + np.maximum(np.abs(low), np.abs(high)))
    may_hold: BoolArray = np.floor(high + margin) >= np.ceil(low - margin)
    return may_hold


def _point_angle(y: Array, x: Array) -> Intervals:
    """The angle of points, by what turning them back by a float near it leaves: |atan t| <= |t|."""
    near = np.arctan2(y, x)
    cos, sin = exact(near).cos(), exact(near).sin()
    across, along = exact(y) * cos - exact(x) * sin, exact(x) * cos + exact(y) * sin
    error = (across / along).magnitude().upper
    return Intervals(down(near - error), up(near + error))


INTERVAL_OPERATIONS: Mapping[int, Callable[..., Intervals]] = {
    **OPERATIONS,
    ca.OP_INV: lambda a: exact(1.0) / a,
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


START_STEPS = 2
"""Newton's steps to where boxes have their middles."""
MAX_GROWTHS = 10
FIRST_GROWTH = 1.25
"""How much wider a box is made first than its parameters make it to the first order."""
GROWTH = 1.15
"""What a box that does not hold K is made greater than K."""
SPARE = 0.98
"""The part of a box that K has to lie in."""
LEAST_REACH = 1e-12
NESTED = (1, 4)
"""Boxes within one another over which slopes of ways from the middle are taken: first, and where that does not do."""
WIDE = 1.05
"""Boxes that are wider than this part of the first ones are made narrower."""
REFINEMENTS = 2
MAX_REACH = 1e3
SLACK = 1e-9
MAX_LANES = 2048
"""Boxes that are worked on side by side."""
HELD = ("OP_INPUT", "OP_OUTPUT", "OP_CONST")


Lanes: TypeAlias = IntArray | BoolArray


class ParameterBoxes(NamedTuple):
    """Bounds of all parameters (lanes, parameters); they are about the middle that floats have."""

    lower: Array
    upper: Array

    @property
    def middle(self) -> Array:
        """(lanes, parameters)"""
        return 0.5 * (self.lower + self.upper)

    def shrunk(self, share: float) -> ParameterBoxes:
        """Those of a part of the widths about the middle."""
        if share == 1.0:
            return self
        middle, thin = self.middle, self.lower == self.upper
        low, high = middle + share * (self.lower - middle), middle + share * (self.upper - middle)
        return ParameterBoxes(np.where(thin, middle, down(low)), np.where(thin, middle, up(high)))

    def rows(self, which: Lanes | slice) -> ParameterBoxes:
        """Some of them."""
        return ParameterBoxes(self.lower[which], self.upper[which])


class Enclosures(NamedTuple):
    """What is proved over boxes of parameters: of every lane, whether there is one solution for all of them, within
    `radius` of `middle` (lanes, unknowns) and no other within `reach`; middles and radii (lanes, results, columns) of
    how results move with the parameters `columns`; and how unknowns do at the middle, as floats (lanes, unknowns,
    columns)."""

    is_proved: BoolArray
    middle: Array
    radius: Array
    reach: Array
    slope_middle: Array
    slope_radius: Array
    tangents: Array

    @property
    def slopes(self) -> Balls:
        """How results move with the parameters, as balls."""
        return Balls(self.slope_middle, self.slope_radius)

    def holds(self, other: Enclosures) -> BoolArray:
        """Whether the solutions of another lie where these are the only ones (lanes,)."""
        is_inside = np.abs(other.middle - self.middle) * OVER + other.radius < self.reach
        holds: BoolArray = self.is_proved & other.is_proved & is_inside.all(axis=1)
        return holds

    def rows(self, which: Lanes) -> Enclosures:
        """Those of some lanes."""
        arrays: Iterator[Any] = (array[which] for array in self)
        return Enclosures(*arrays)

    @staticmethod
    def stack(parts: Sequence[Enclosures]) -> Enclosures:
        """Those of several."""
        return Enclosures(*map(np.concatenate, zip(*parts, strict=True)))


class ImplicitSystem:
    """Equations F(x, t) = 0, as many as unknowns, and results r(x, t), with their slopes in `columns` of t."""

    def __init__(self, x: ca.SX, t: ca.SX, equations: ca.SX, results: ca.SX, columns: Sequence[int]):
        self.columns = list(columns)
        self.count, self.parts = x.numel(), results.numel()
        varying = ca.vertcat(ca.SX(0, 1), *(t[k] for k in self.columns))
        slopes = [ca.densify(ca.jacobian(values, by)) for values in (equations, results) for by in (x, varying)]
        self.values = ca.Function("values", [x, t], [ca.densify(equations), ca.densify(results)])
        self.slopes = ca.Function("slopes", [x, t], slopes)
        "(x, t) -> F_x, F_t, r_x, r_t"
        self._step = BufferedFunction(ca.Function("step", [x, t], [slopes[0], slopes[1], equations]))

    def newton(self, t: Array, start: Array, steps: int) -> tuple[Array, Array]:
        """Solutions (lanes, unknowns) at t (lanes, parameters) by some of Newton's steps from a start, and how they
        move with the columns (lanes, unknowns, columns); NaN where F_x is singular."""
        x = start
        inverse: Array = np.zeros((len(x), self.count, self.count))
        by_columns: Array = np.zeros((len(x), self.count, len(self.columns)))
        for _ in range(steps):
            parts = self._step.evaluate_batch(len(x), x, t)
            jacobian, by_columns, residual = (part.transpose(0, 2, 1) for part in parts)
            inverse, is_singular = invert_matrices(jacobian)
            x = x - (inverse @ residual)[:, :, 0]
            x[is_singular] = np.nan
        return x, -inverse @ by_columns


class ParametricSystem(ImplicitSystem):
    """The same over boxes of parameters.

    Raises BadInput where there are operations of which no intervals are known, or that jump.
    """

    def __init__(self, x: ca.SX, t: ca.SX, equations: ca.SX, results: ca.SX, columns: Sequence[int]):
        super().__init__(x, t, equations, results, columns)
        names = {getattr(ca, name): name for name in dir(ca) if name.startswith("OP_")}
        for function, jumps in ((self.values, [ca.OP_SIGN]), (self.slopes, [])):
            for k in range(function.n_instructions()):
                code = function.instruction_id(k)
                if (code not in INTERVAL_OPERATIONS and names[code] not in HELD) or code in jumps:
                    operation = names[code].removeprefix("OP_").lower()
                    raise BadInput(
                        "guaranteed",
                        f"guaranteed bands are not told of this mechanism, whose formulas have a {operation!r} in them",
                    )

    def enclose(self, boxes: ParameterBoxes, start: Array, steps: int = START_STEPS) -> Enclosures:
        """What can be proved over boxes, of solutions at their middles that so many of Newton's steps from a start
        (lanes, unknowns) lead to."""
        parts = [slice(first, first + MAX_LANES) for first in range(0, max(1, len(start)), MAX_LANES)]
        with np.errstate(all="ignore"):  # what overflows, or has no value, is not proved
            return Enclosures.stack([self._enclose_lanes(boxes.rows(part), start[part], steps) for part in parts])

    def _enclose_lanes(self, boxes: ParameterBoxes, start: Array, steps: int) -> Enclosures:
        count, t = len(start), boxes.middle
        middle, tangents = self.newton(t, start, steps)
        points = [[exact(column) for column in values.T] for values in (middle, t)]
        residual = _stack_balls(evaluate_intervals(self.values, points)[0], count, (self.count, 1))
        half_widths = np.maximum(up(boxes.upper - t), up(t - boxes.lower))[:, self.columns]
        first_reach = FIRST_GROWTH * (np.abs(tangents) @ half_widths[:, :, None])[:, :, 0] + LEAST_REACH
        reach, radius = first_reach.copy(), first_reach.copy()
        is_proved = np.zeros(count, dtype=bool)

        def krawczyk_image(lanes: IntArray, reach: Array, nested: int) -> Array:
            linear = self._linearise(middle[lanes], reach, boxes.rows(lanes), nested)
            return linear.image(residual.rows(lanes), half_widths[lanes], reach)

        for nested in NESTED:
            is_alive = np.isfinite(reach).all(axis=1) & ~is_proved
            reach[is_alive] = first_reach[is_alive]
            for _ in range(MAX_GROWTHS):
                lanes = np.flatnonzero(is_alive & ~is_proved)
                if not len(lanes):
                    break
                image = krawczyk_image(lanes, reach[lanes], nested)
                is_bounded = np.isfinite(image).all(axis=1) & (image < MAX_REACH).all(axis=1)
                is_inside = is_bounded & (image < SPARE * reach[lanes]).all(axis=1)
                is_proved[lanes[is_inside]], radius[lanes[is_inside]] = True, image[is_inside]
                is_alive[lanes[~is_bounded]] = False
                reach[lanes[~is_inside]] = (GROWTH * image + LEAST_REACH)[~is_inside]
        slopes = Balls(*(np.full((count, self.parts, len(self.columns)), np.nan) for _ in range(2)))
        proved = np.flatnonzero(is_proved)
        if len(proved):
            wide = proved[(radius[proved] > WIDE * first_reach[proved]).any(axis=1)]
            for _ in range(REFINEMENTS if len(wide) else 0):
                radius[wide] = np.fmin(radius[wide], krawczyk_image(wide, radius[wide], NESTED[-1]))
            linear = self._linearise(middle[proved], radius[proved], boxes.rows(proved))
            is_proved[proved], (slopes.middle[proved], slopes.radius[proved]) = linear.slopes()
            is_proved &= np.isfinite(slopes.radius).all(axis=(1, 2))
        return Enclosures(is_proved, middle, radius, reach, *slopes, tangents)

    def _linearise(self, middle: Array, reach: Array, boxes: ParameterBoxes, nested: int = 1) -> _LinearLanes:
        """Over boxes, or the mean along straight ways from the middle, each part of which is in one of nested boxes."""
        shapes = [self.slopes.size_out(k) for k in range(4)]
        parts = []
        for k in range(1, nested + 1):
            share = k / nested
            spread = up(share * reach)
            x = [Intervals(*bounds) for bounds in zip(down(middle - spread).T, up(middle + spread).T, strict=True)]
            t = [_interval(*bounds) for bounds in zip(*(bound.T for bound in boxes.shrunk(share)), strict=True)]
            slopes = evaluate_intervals(self.slopes, [x, t])
            parts.append([_stack_balls(of, len(middle), shape) for of, shape in zip(slopes, shapes, strict=True)])
        return _LinearLanes(*(mean_of_balls(balls) for balls in zip(*parts, strict=True)))


class _LinearLanes:
    """F_x, F_t, r_x, r_t as balls, with all preconditioned by the inverse of the middle of F_x."""

    def __init__(self, F_x: Balls, F_t: Balls, r_x: Balls, r_t: Balls):
        self.inverse, is_singular = invert_matrices(F_x.middle)
        self.inverse[is_singular] = np.nan
        unit = np.eye(F_x.middle.shape[1])
        near_unit = F_x.times(self.inverse)
        self.rest = Balls(near_unit.middle - unit, near_unit.radius + 2.0**-52).size
        "|1 - Y F_x|"
        self.by_columns = F_t.times(-self.inverse)
        self.r_x, self.r_t = r_x, r_t

    def image(self, residual: Balls, half_widths: Array, reach: Array) -> Array:
        """How far K goes from the middle (lanes, unknowns)."""
        from_middle = residual.times(self.inverse).size[:, :, 0]
        from_columns = (self.by_columns.size @ half_widths[:, :, None])[:, :, 0]
        from_rest = (self.rest @ reach[:, :, None])[:, :, 0]
        return (from_middle + from_columns + from_rest) * OVER + TINY

    def slopes(self) -> tuple[BoolArray, Balls]:
        """Whether F_x is regular, by some v > 0 with |1 - Y F_x| v < v (A. Neumaier, sec. 4.1), and slopes of results.

        A size X of S with |B| + |1 - Y F_x| X <= X holds it, for B = -Y F_t.
        """
        lanes, count = self.rest.shape[:2]
        sides = np.concatenate([np.ones((lanes, count, 1)), self.by_columns.size], axis=2)
        is_finite: BoolArray = np.asarray(np.isfinite(self.rest).all(axis=(1, 2)))
        inverse, is_singular = invert_matrices(np.eye(count) - np.where(is_finite[:, None, None], self.rest, 0.0))
        wider = sides + SLACK * sides.max(axis=1, keepdims=True, initial=0.0) + LEAST_REACH
        size = inverse @ wider * (1.0 + SLACK)
        image = (self.rest @ size + sides) * OVER + TINY
        holds: BoolArray = np.all((size > 0.0) & (image <= size), axis=(1, 2))
        spread = (self.rest @ size[:, :, 1:]) * OVER + TINY
        unknown_slopes = Balls(self.by_columns.middle, (self.by_columns.radius + spread) * OVER)
        return is_finite & ~is_singular & holds, self.r_x.product(unknown_slopes).plus(self.r_t)


def _interval(lower: Array, upper: Array) -> Intervals:
    """The bounds of one parameter, which mostly is the same number in all lanes."""
    if lower[0] == upper[0] and (lower == lower[0]).all() and (upper == upper[0]).all():
        return exact(lower[:1])
    return Intervals(lower, upper)


def _stack_balls(values: Sequence[Intervals], lanes: int, shape: tuple[int, int]) -> Balls:
    """Dense results, column by column, as balls (lanes, rows, columns)."""
    bounds: Array = np.empty((2, shape[1], shape[0], lanes))
    for k, value in enumerate(values):
        column, row = divmod(k, shape[0])
        bounds[0, column, row], bounds[1, column, row] = value.lower, value.upper
    return to_balls(*bounds.transpose(0, 3, 2, 1))
