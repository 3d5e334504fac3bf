"""Where in a run a slide, a rocker or a point turns back, and where it is fastest: solved for, not read off samples."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from math import inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import CLOSED_TOLERANCE, InterpolatedRun
from planar.analysis.motion.output import Axis, Extreme, MotionQuantity, Output
from planar.analysis.motion.zeros import SERIES_TOLERANCE, bracket_maxima, bracket_zeros, find_maximum
from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.root_finding import find_root
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion, State

StateMeasure = Callable[[State], float | Array]

PAIR_AXES = ("angle", "displacement")
"""The quantities of a link or a pair that `extremes` takes for an axis."""
RIVAL_RATIO = 0.5
"""Local maxima of the samples less than this part of the greatest are not looked into."""
NEARER_RATIO, GROWTH_EXPONENT = 5.0, 0.6
"""So many times nearer to a limit, the square of what grows there as the root of the distance, or faster, grows by more
than this power of it."""


class Stroke(NamedTuple):
    """The stroke of a slide: its two ends, whose values are displacements (m), and its length (m).

    `top` is the end farther from the driving crank's fixed pin, `bottom` the other. `turning` says of each whether the
    slide turns back there, so that it is a dead centre (TDC, BDC); otherwise the input's range ends there.
    """

    pair: str
    top: Extreme
    bottom: Extreme
    length: float
    turning: tuple[bool, bool] = (True, True)


class Swing(NamedTuple):
    """The swing of a link or a pair: its extreme angles (rad), and the angle between them (rad).

    `turning` says of each extreme whether the link turns back there; otherwise the input's range ends there.
    """

    of: str
    least: Extreme
    greatest: Extreme
    angle: float
    turning: tuple[bool, bool] = (True, True)


class Extremes(NamedTuple):
    """The extremes of a point along an axis (m), of an angle (rad) or of a slide (m), and the distance between them.

    `point` is the name of the point, link or pair; `axis` is "angle" or "displacement" for a link or pair. `turning`
    says of each whether it turns back there; otherwise the input's range ends there. NaN where no rates are determined.
    """

    point: str
    axis: Axis
    least: Extreme
    greatest: Extreme
    length: float
    turning: tuple[bool, bool]


@takes_result("Motion")
def stroke(motion: Motion, pair: str) -> Stroke | None:
    """The ends of a slide's travel, solved for to round-off (about 1e-14 rad of the input).

    The slide turns back at an end, where its velocity is zero, or the input's range ends there: `turning`. Top is the
    end farther from the driving crank's fixed pin, in the plane; where there is no such pin, or both are as far, the
    end of greater displacement. If an end is reached more than once, the first in the range is returned. None where the
    slide does not move, where no rates are determined, or where the relative motion at the pair is no length. Raises
    Unknown for another name.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> planar.stroke(motion, "stroke").pair
    'stroke'
    """
    motion.pair(pair)  # refuses what there is not
    return find_stroke(InterpolatedRun(motion), pair) if motion.has_length_motion(pair) else None


def find_stroke(steady: InterpolatedRun, pair: str) -> Stroke | None:
    """See `stroke`; of a motion made ready for it."""
    output = Output(steady, pair)
    if not output.is_moving or output.range_extremes is None:
        return None
    low, high = output.range_extremes
    top, bottom = (high, low) if _is_top(steady, pair, high.extreme, low.extreme) else (low, high)
    return Stroke(pair, top.extreme, bottom.extreme, high.value - low.value, (top.turns_back, bottom.turns_back))


@takes_result("Motion")
def swing(motion: Motion, name: str) -> Swing | None:
    """The extreme angles over a motion, solved for to round-off: of a turning pair, else of a link, of this name.

    Angles are those of the motion, so that the swing may be more than a turn. The link turns back at an extreme, or the
    input's range ends there: `turning`. None for a link that rotates fully with the input or does not turn, where no
    rates are determined, and for a slide. Raises Unknown for another name.

    >>> import planar
    >>> motion = planar.cycle(planar.load("crank-rocker"), 12)
    >>> planar.swing(motion, "crank") is None
    True
    """
    if name in relative_motions(motion.mechanism) and motion.has_length_motion(name):
        return None
    return find_swing(Output(InterpolatedRun(motion), name))


def find_swing(output: Output) -> Swing | None:
    """See `swing`; of the output of this name, made already."""
    if not output.is_moving or output.full_turns or output.range_extremes is None:
        return None
    least, greatest = output.range_extremes
    turning = least.turns_back, greatest.turns_back
    return Swing(output.name, least.extreme, greatest.extreme, greatest.value - least.value, turning)


@takes_result("Motion")
def extremes(motion: Motion, name: str = "", axis: Axis | None = None, *, point: str | None = None) -> Extremes:
    """The extremes of a point along an axis, of the angle of a link or a pair, or of a slide, solved for to round-off.

    `axis` of a point is "x" (by default), "y" or a direction (rad). "angle" is the angle of the pair, else of the link,
    of this name, "displacement" that of a slide; they may be left out where no point has this name. Extremes may be at
    the ends of the input's range, which `turning` says; those of a link that rotates fully are. Of places that are
    alike the first in the range is returned. `point` is the former word for `name`. Raises Unknown for another name,
    BadInput for another axis.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> round(planar.extremes(motion, "A").greatest.value, 6)
    0.48
    >>> round(planar.extremes(motion, "rod").greatest.value, 6)
    0.304693
    """
    if point is not None:
        warnings.warn("extremes: the argument 'point' is called 'name' now", DeprecationWarning, stacklevel=3)
        name = point
    if axis is None and (name in motion.point_names or name in motion._point_names):
        axis = "x"
    if axis is not None and axis not in PAIR_AXES:
        return find_extremes(Output(InterpolatedRun(motion), name, axis), axis)
    output = Output(InterpolatedRun(motion), name)
    quantity = "displacement" if output.kind == "length" else "angle"
    if axis is not None and axis != quantity:
        raise BadInput("axis", f"{name!r} has no {axis}, but a{'n' * (quantity == 'angle')} {quantity}")
    return find_extremes(output, quantity)


def find_extremes(output: Output, axis: Axis) -> Extremes:
    """See `extremes`; of the output along this axis, made already."""
    if output.range_extremes is None:
        return Extremes(output.name, axis, Extreme(nan, nan), Extreme(nan, nan), nan, (False, False))
    least, greatest = output.range_extremes
    turning = least.turns_back, greatest.turns_back
    return Extremes(output.name, axis, least.extreme, greatest.extreme, greatest.value - least.value, turning)


@takes_result("Motion")
def greatest(motion: Motion, of: str | StateMeasure, what: str = "velocity") -> Extreme:
    """Where in a run a slide, a point or anything else is fastest, and how fast, solved for.

    `of` is a slide, else a point, else another pair, whose relative motion is meant, else a link, which turns; `what`
    is its "velocity" or "acceleration"; the value is the magnitude. Or `of` is a function of a State, a number or a
    vector, whose greatest magnitude is asked for.

    The input runs steadily at the file's velocity, without acceleration, as the chapters take it; where the file's
    velocity is zero, values are per unit of the input (m/rad, m/rad^2). The place of the greatest velocity, where
    v . a = 0, is solved for to round-off; that of another quantity is where the derivative of a polynomial through
    exact values on either side is zero, good to about 1e-11 rad. Of places that are alike the first is told.

    Over a range that is not closed the greatest may be at an end; where it grows beyond all bounds towards a limit of
    the range it is inf, there; where no rates are determined anywhere it is NaN. Raises Unknown where there is
    nothing of that name, BadInput for another `what`.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> planar.greatest(motion, "stroke").value > 0
    True
    """
    return find_greatest(InterpolatedRun(motion), of, what)


def find_greatest(steady: InterpolatedRun, of: str | MotionQuantity | StateMeasure, what: str = "velocity") -> Extreme:
    """See `greatest`; of a motion made ready for it, or of a quantity of it."""
    if what not in ("velocity", "acceleration"):
        raise BadInput("what", f"the greatest 'velocity' or 'acceleration' is found, not {what!r:.40}")

    def measured(moving: State | Motion) -> Array:
        """The square of the quantity, and of a velocity what its square grows by (..., 2)."""
        if callable(of):
            if isinstance(moving, Motion):
                return np.stack([_measure_or_zero(measured, steady, at) if ok else np.zeros(2) for at, ok in rows])
            return np.array([float(np.sum(np.square(of(moving)))), 0.0])
        parts = quantity_and_rates(moving, of)
        square = np.sum(parts[1 if what == "velocity" else 2] ** 2, axis=-1)
        # its rate in time, turned into one along the input
        return np.stack([square, np.sum(parts[1] * parts[2], axis=-1) / steady.rate], axis=-1)

    def square(position: float) -> float:
        return float(measured(steady.state_at(position))[0])

    rows = list(zip(steady.positions.tolist(), steady.has_rates, strict=True))
    positions, table = steady.tabulate(measured)
    if not len(positions):
        return Extreme(steady.lowest, nan)
    squares = table[:, 0]
    still = steady.solver.unit * max(abs(steady.rate), steady.rate**2) if not callable(of) else 0.0
    if np.ptp(squares) <= max(SERIES_TOLERANCE * squares.max(), (SERIES_TOLERANCE * still) ** 2):
        return Extreme(steady.lowest, sqrt(float(squares.max())))
    for limit, _ in steady.open_limits():
        if _is_unbounded(positions, squares, limit):
            return Extreme(limit, inf)
    rival = float(squares.max())
    worth = RIVAL_RATIO**2 * rival
    ends = () if steady.closed else (steady.lowest, steady.highest)
    found = [Extreme(end, float(squares[np.argmin(np.abs(positions - end))])) for end in ends]
    exact = not callable(of) and what == "velocity"
    for low, high in (
        bracket_zeros(positions, table[:, 1], falling=True) if exact else bracket_maxima(positions, squares)
    ):
        around = squares[(positions >= low) & (positions <= high)]
        if around.max() < (worth if exact else max(worth, rival - np.ptp(around))):
            continue  # a top is less above its samples than these are apart
        try:
            at = (
                find_root(lambda at: float(measured(steady.state_at(at))[1]), low, high)
                if exact
                else find_maximum(square, low, high)
            )
            place, value = steady.wrap_position(at), square(at)
        except NoAnswer:
            continue  # the motion branches there
        if place is not None:
            found.append(Extreme(place, value))
    if not found:
        found.append(Extreme(float(positions[np.argmax(squares)]), float(squares.max())))
    best = max(each.value for each in found)
    at, value = _first_of_value(found, best, SERIES_TOLERANCE * best)
    return Extreme(at, sqrt(value))


def _measure_or_zero(measured: Callable[[State], Array], steady: InterpolatedRun, position: float) -> Array:
    """What is measured at a position, or nothing where the motion branches."""
    try:
        return measured(steady.state_at(position))
    except NoAnswer:
        return np.zeros(2)


def quantity_and_rates(moving: State | Motion, name: str | MotionQuantity) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (..., axes) of a slide, else of a point, another pair or a link."""
    if not isinstance(name, str):
        position, velocity, acceleration = (
            each[..., None] for each in np.broadcast_arrays(*name.value_and_rates(moving))
        )
        return position, velocity, acceleration
    named = relative_motions(moving.mechanism)
    slides = name in named and named[name].input_kind is MeasureKind.LENGTH
    if slides or (name not in moving._point_names and (name in named or name in moving.frames)):
        parts = _pair_motion(moving, name) if name in named else moving.link(name)[:3]
        position, velocity, acceleration = (np.asarray(part)[..., None] for part in parts)
        return position, velocity, acceleration
    return moving.point(name)[:3]


def _pair_motion(moving: State | Motion, pair: str) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration of the relative motion at a pair: what every pair reports first."""
    position, velocity, acceleration = (np.asarray(each, dtype=float) for each in list(moving.pair(pair).values())[:3])
    return position, velocity, acceleration


def _first_of_value(found: list[Extreme], value: float, near: float) -> Extreme:
    """The first in the range of those that have this value."""
    return min(each for each in found if abs(each.value - value) <= near)


def _is_top(steady: InterpolatedRun, pair: str, high: Extreme, low: Extreme) -> bool:
    """Whether the sliding point is farther from the driving crank's pin at the end of greater displacement."""
    rides = steady.solver.relative_motions[pair].point_on_line()
    if steady.pin is None or rides is None:
        return True
    slider = "{}.{}".format(*rides[0])
    far, near = (_distance_at(steady, slider, steady.pin, end.input) for end in (high, low))
    return far >= near - CLOSED_TOLERANCE * steady.solver.unit


def _distance_at(steady: InterpolatedRun, point: str, other: str, position: float) -> float:
    """How far two points are apart (m) at a position of the input, which may be a limit of the run."""
    rows = np.flatnonzero(steady.positions == position)
    moving: State | Motion = steady.samples if len(rows) else steady.state_at(position)
    apart = np.hypot(*np.transpose(moving.point(point).position - moving.point(other).position))
    return float(apart[rows[0]] if len(rows) else apart)


def _is_unbounded(positions: Array, squares: Array, limit: float) -> bool:
    """Whether a quantity grows beyond all bounds towards a limit, by the two states that are nearest to it."""
    near, nearer = np.argsort(np.abs(positions - limit))[1::-1]
    times = abs((positions[near] - limit) / (positions[nearer] - limit))
    return bool(times > NEARER_RATIO and squares[nearer] > times**GROWTH_EXPONENT * squares[near])
