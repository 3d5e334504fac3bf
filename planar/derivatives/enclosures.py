"""Solutions of F(x, t) = 0 and results r(x, t) over boxes of parameters, enclosed by Krawczyk's operator.

For t in a box P about p, x in a box X about c, and any matrix Y near the inverse of the middle of F_x(X, P)

    K = c - Y F(c, p) - Y F_t(X, P) (P - p) + (1 - Y F_x(X, P)) (X - c)

holds every solution in X, and where K lies inside of X there is one for each t, no other one in X, and F_x is regular
(R. Krawczyk, Computing 4 (1969) 187; A. Neumaier, Interval Methods for Systems of Equations, Cambridge 1990, ch. 5;
R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, ch. 8). How they move with the
parameters, S = dx/dt, is enclosed by S = -Y F_t + (1 - Y F_x) S over the same boxes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import casadi as ca
import numpy as np

from planar.derivatives.intervals import (
    INTERVAL_OPERATIONS,
    OVER,
    TINY,
    Balls,
    Intervals,
    apply_to_intervals,
    down,
    exact,
    mean_of_balls,
    to_balls,
    up,
)
from planar.equations.casadi_call import BufferedFunction
from planar.equations.generic_evaluation import evaluate_function
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
    `radius` of `middle` (lanes, unknowns) and no other within `reach`; balls (lanes, results, columns) of how results
    move with the parameters `columns`; and how unknowns do at the middle, as floats (lanes, unknowns, columns)."""

    is_proved: BoolArray
    middle: Array
    radius: Array
    reach: Array
    slopes: Balls
    tangents: Array

    def holds(self, other: Enclosures) -> BoolArray:
        """Whether the solutions of another lie where these are the only ones (lanes,)."""
        inside = np.abs(other.middle - self.middle) * OVER + other.radius < self.reach
        found: BoolArray = self.is_proved & other.is_proved & inside.all(axis=1)
        return found

    def rows(self, which: Lanes) -> Enclosures:
        """Those of some lanes."""
        proved, middle, radius, reach, slopes, tangents = self
        parts = Balls(slopes.middle[which], slopes.radius[which])
        return Enclosures(proved[which], middle[which], radius[which], reach[which], parts, tangents[which])

    @staticmethod
    def stack(parts: Sequence[Enclosures]) -> Enclosures:
        """Those of several."""
        proved, middle, radius, reach, balls, tangents = zip(*parts, strict=True)
        slopes = Balls(*(np.concatenate(each) for each in zip(*balls, strict=True)))
        middles, radii, reaches = (np.concatenate(each) for each in (middle, radius, reach))
        return Enclosures(np.concatenate(proved), middles, radii, reaches, slopes, np.concatenate(tangents))


class ParametricSystem:
    """Equations F(x, t) = 0, as many as unknowns, and results r(x, t), whose slopes in `columns` of t are wanted.

    Raises BadInput where there are operations of which no intervals are known, or that jump.
    """

    def __init__(self, x: ca.SX, t: ca.SX, equations: ca.SX, results: ca.SX, columns: Sequence[int]):
        self.columns = list(columns)
        self.count, self.parts = x.numel(), results.numel()
        by = ca.vertcat(ca.SX(0, 1), *(t[k] for k in self.columns))
        slopes = [ca.jacobian(each, of) for each in (equations, results) for of in (x, by)]
        self._slopes = ca.Function("slopes", [x, t], [ca.densify(each) for each in slopes])
        self._left = ca.Function("left", [x, t], [ca.densify(equations)])
        self._step = BufferedFunction(
            ca.Function("step", [x, t], [ca.densify(slopes[0]), ca.densify(slopes[1]), equations])
        )
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
        middle, tangents = self._find_middles(boxes, start, steps)
        many = len(start)
        left = self._left_open(middle, boxes.middle)
        half = self._half_widths(boxes)
        proved = np.zeros(many, dtype=bool)
        reach = FIRST_GROWTH * (np.abs(tangents) @ half[:, :, None])[:, :, 0] + LEAST_REACH
        inside = reach.copy()
        alive = np.isfinite(reach).all(axis=1)
        first = reach.copy()
        for nested in NESTED:
            alive = np.isfinite(reach).all(axis=1) & ~proved
            reach[alive] = first[alive]
            for _ in range(MAX_GROWTHS):
                at = np.flatnonzero(alive & ~proved)
                if not len(at):
                    break
                linear = self._linearise(middle[at], reach[at], boxes.rows(at), nested)
                image = linear.image(Balls(left.middle[at], left.radius[at]), half[at], reach[at])
                known = np.isfinite(image).all(axis=1) & (image < MAX_REACH).all(axis=1)
                within = known & (image < SPARE * reach[at]).all(axis=1)
                proved[at[within]], inside[at[within]] = True, image[within]
                alive[at[~known]] = False
                reach[at[~within]] = (GROWTH * image + LEAST_REACH)[~within]
        slopes = Balls(*(np.full((many, self.parts, len(self.columns)), np.nan) for _ in range(2)))
        found = np.flatnonzero(proved)
        if len(found):
            wide = found[(inside[found] > WIDE * first[found]).any(axis=1)]
            for _ in range(REFINEMENTS if len(wide) else 0):
                linear = self._linearise(middle[wide], inside[wide], boxes.rows(wide), NESTED[-1])
                image = linear.image(Balls(left.middle[wide], left.radius[wide]), half[wide], inside[wide])
                inside[wide] = np.fmin(inside[wide], image)
            linear = self._linearise(middle[found], inside[found], boxes.rows(found))
            proved[found], (slopes.middle[found], slopes.radius[found]) = linear.slopes()
            proved &= np.isfinite(slopes.radius).all(axis=(1, 2))
        return Enclosures(proved, middle, inside, reach, slopes, tangents)

    def _find_middles(self, boxes: ParameterBoxes, start: Array, steps: int) -> tuple[Array, Array]:
        """Solutions at the middles and how they move with the columns, as floats have both."""
        t, x = boxes.middle, start
        inverse: Array = np.zeros((len(x), self.count, self.count))
        by: Array = np.zeros((len(x), self.count, len(self.columns)))
        for _ in range(steps):
            slope, by, left = (each.transpose(0, 2, 1) for each in self._step.evaluate_batch(len(x), x, t))
            inverse, is_singular = invert_matrices(slope)
            x = x - (inverse @ left)[:, :, 0]
            x[is_singular] = np.nan
        return x, -inverse @ by

    def _half_widths(self, boxes: ParameterBoxes) -> Array:
        """Of the varying parameters, from the middle (lanes, columns)."""
        middle = boxes.middle
        both = np.maximum(up(boxes.upper - middle), up(middle - boxes.lower))
        return both[:, self.columns]

    def _left_open(self, middle: Array, t: Array) -> Balls:
        """F at the middles (lanes, unknowns, 1)."""
        given = [[exact(each) for each in values.T] for values in (middle, t)]
        return _stack_balls(evaluate_function(self._left, given, exact, apply_to_intervals)[0], len(t), (self.count, 1))

    def _linearise(self, middle: Array, reach: Array, boxes: ParameterBoxes, nested: int = 1) -> _LinearLanes:
        """Over boxes, or the mean along straight ways from the middle, each part of which is in one of nested boxes."""
        shapes = [self._slopes.size_out(k) for k in range(4)]
        parts = []
        for k in range(1, nested + 1):
            share = k / nested
            x = [Intervals(down(at - far), up(at + far)) for at, far in zip(middle.T, up(share * reach.T), strict=True)]
            t = [_interval(*both) for both in zip(*(each.T for each in boxes.shrunk(share)), strict=True)]
            found = evaluate_function(self._slopes, [x, t], exact, apply_to_intervals)
            parts.append(
                [_stack_balls(values, len(middle), shape) for values, shape in zip(found, shapes, strict=True)]
            )
        return _LinearLanes(*(mean_of_balls(each) for each in zip(*parts, strict=True)))


class _LinearLanes:
    """F_x, F_t, r_x, r_t as balls, with all preconditioned by the inverse of the middle of F_x."""

    def __init__(self, F_x: Balls, F_t: Balls, r_x: Balls, r_t: Balls):
        self.inverse, is_singular = invert_matrices(F_x.middle)
        self.inverse[is_singular] = np.nan
        unit = np.eye(F_x.middle.shape[1])
        near = F_x.times(self.inverse)
        self.rest = Balls(near.middle - unit, near.radius + 2.0**-52).size
        "|1 - Y F_x|"
        self.by = F_t.times(-self.inverse)
        self.r_x, self.r_t = r_x, r_t

    def image(self, left: Balls, half: Array, reach: Array) -> Array:
        """How far K goes from the middle (lanes, unknowns)."""
        step = left.times(self.inverse).size[:, :, 0]
        moved = (self.by.size @ half[:, :, None])[:, :, 0]
        turned = (self.rest @ reach[:, :, None])[:, :, 0]
        return (step + moved + turned) * OVER + TINY

    def slopes(self) -> tuple[BoolArray, Balls]:
        """Whether F_x is regular, by some v > 0 with |1 - Y F_x| v < v (A. Neumaier, sec. 4.1), and slopes of results.

        A size X of S with |B| + |1 - Y F_x| X <= X holds it, for B = -Y F_t.
        """
        many, count = self.rest.shape[:2]
        whole = np.concatenate([np.ones((many, count, 1)), self.by.size], axis=2)
        known: BoolArray = np.asarray(np.isfinite(self.rest).all(axis=(1, 2)))
        inverse, is_singular = invert_matrices(np.eye(count) - np.where(known[:, None, None], self.rest, 0.0))
        wider = whole + SLACK * whole.max(axis=1, keepdims=True, initial=0.0) + LEAST_REACH
        size = inverse @ wider * (1.0 + SLACK)
        image = (self.rest @ size + whole) * OVER + TINY
        holds: BoolArray = np.all((size > 0.0) & (image <= size), axis=(1, 2))
        far = (self.rest @ size[:, :, 1:]) * OVER + TINY
        unknown = Balls(self.by.middle, (self.by.radius + far) * OVER)
        return known & ~is_singular & holds, self.r_x.product(unknown).plus(self.r_t)


def _interval(lower: Array, upper: Array) -> Intervals:
    """The bounds of one parameter, which mostly is the same number in all lanes."""
    if lower[0] == upper[0] and (lower == lower[0]).all() and (upper == upper[0]).all():
        return exact(lower[:1])
    return Intervals(lower, upper)


def _stack_balls(values: Sequence[Intervals], lanes: int, shape: tuple[int, int]) -> Balls:
    """Dense results, column by column, as balls (lanes, rows, columns)."""
    both = [np.empty((shape[1], shape[0], lanes)) for _ in range(2)]
    for k, each in enumerate(values):
        place = divmod(k, shape[0])
        both[0][place], both[1][place] = each.lower, each.upper
    return to_balls(*(each.transpose(2, 1, 0) for each in both))
