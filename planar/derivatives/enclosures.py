"""Solutions of F(x, t) = 0 and results r(x, t) over boxes of parameters, enclosed by Krawczyk's operator.

For t in a box P about p, x in a box X about c, and any matrix Y near the inverse of the middle of F_x(X, P)

    K = c - Y F(c, p) - Y F_t(X, P) (P - p) + (1 - Y F_x(X, P)) (X - c)

holds every solution in X, and where K lies inside of X there is one for each t, no other one in X, and F_x is regular
(R. Krawczyk, Computing 4 (1969) 187; A. Neumaier, Interval Methods for Systems of Equations, Cambridge 1990, ch. 5;
R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, ch. 8). How they move with the
parameters, S = dx/dt, is enclosed by S = -Y F_t + (1 - Y F_x) S over the same boxes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import casadi as ca
import numpy as np

from planar.derivatives.intervals import (
    INTERVAL_OPERATIONS,
    OVER,
    TINY,
    Balls,
    Intervals,
    down,
    evaluate_intervals,
    exact,
    mean_of_balls,
    to_balls,
    up,
)
from planar.equations.casadi_call import BufferedFunction
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import BadInput
from planar.foundation.generalised_inverses import invert_matrices

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


class ParametricSystem:
    """Equations F(x, t) = 0, as many as unknowns, and results r(x, t), whose slopes in `columns` of t are wanted.

    Raises BadInput where there are operations of which no intervals are known, or that jump.
    """

    def __init__(self, x: ca.SX, t: ca.SX, equations: ca.SX, results: ca.SX, columns: Sequence[int]):
        self.columns = list(columns)
        self.count, self.parts = x.numel(), results.numel()
        varying = ca.vertcat(ca.SX(0, 1), *(t[k] for k in self.columns))
        slopes = [ca.densify(ca.jacobian(of, by)) for of in (equations, results) for by in (x, varying)]
        self._slopes = ca.Function("slopes", [x, t], slopes)
        self._residual = ca.Function("residual", [x, t], [ca.densify(equations)])
        self._step = BufferedFunction(ca.Function("step", [x, t], [slopes[0], slopes[1], equations]))
        names = {getattr(ca, name): name for name in dir(ca) if name.startswith("OP_")}
        values = ca.Function("values", [x, t], [equations, results])
        for function, jumps in ((values, [ca.OP_SIGN]), (self._slopes, [])):
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
        middle, tangents = self._find_middles(t, start, steps)
        points = [[exact(column) for column in values.T] for values in (middle, t)]
        residual = _stack_balls(evaluate_intervals(self._residual, points)[0], count, (self.count, 1))
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

    def _find_middles(self, t: Array, start: Array, steps: int) -> tuple[Array, Array]:
        """Solutions at the middles t and how they move with the columns, as floats have both."""
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

    def _linearise(self, middle: Array, reach: Array, boxes: ParameterBoxes, nested: int = 1) -> _LinearLanes:
        """Over boxes, or the mean along straight ways from the middle, each part of which is in one of nested boxes."""
        shapes = [self._slopes.size_out(k) for k in range(4)]
        parts = []
        for k in range(1, nested + 1):
            share = k / nested
            spread = up(share * reach)
            x = [Intervals(*bounds) for bounds in zip(down(middle - spread).T, up(middle + spread).T, strict=True)]
            t = [_interval(*bounds) for bounds in zip(*(bound.T for bound in boxes.shrunk(share)), strict=True)]
            slopes = evaluate_intervals(self._slopes, [x, t])
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
