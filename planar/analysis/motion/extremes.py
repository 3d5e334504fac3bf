"""Where in a run a slide, a rocker or a point turns back, and where it is fastest: solved for, not read off samples."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import CLOSED_TOLERANCE, InterpolatedRun
from planar.analysis.motion.output import Axis, Extreme, Output
from planar.analysis.motion.zeros import SERIES_TOLERANCE, bracket_maxima, bracket_zeros, find_maximum
from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.root_finding import find_root
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion, State

StateMeasure = Callable[[State], float | Array]

RIVAL_RATIO = 0.5
"""Local maxima of the samples less than this part of the greatest are not looked into."""
NEARER_RATIO, GROWTH_EXPONENT = 5.0, 0.6
"""So many times nearer to a limit, the square of what grows there as the root of the distance, or faster, grows by more
than this power of it."""


class Stroke(NamedTuple):
    """The stroke of a slide: its two ends, whose values are displacements (m), and its length (m).

    `top` is the top dead centre (TDC), the end farther from the driving crank's fixed pin, `bottom` the other (BDC).
    """

    pair: str
    top: Extreme
    bottom: Extreme
    length: float


class Swing(NamedTuple):
    """The swing of a rocker: its extreme angles (rad), and the angle between them (rad)."""

    of: str
    least: Extreme
    greatest: Extreme
    angle: float


class Extremes(NamedTuple):
    """The extreme positions of a point along an axis: coordinates (m), and the distance between them (m).

    `turning` says of each whether the point turns back there; else it is at an end of the input's range.
    """

    point: str
    axis: Axis
    least: Extreme
    greatest: Extreme
    length: float
    turning: tuple[bool, bool]


@takes_result("Motion")
def stroke(motion: Motion, pair: str) -> Stroke | None:
    """The ends of a slide's travel, where its velocity is zero, solved for to round-off (about 1e-14 rad of the input).

    Top is the end farther from the driving crank's fixed pin, in the plane; where there is no such pin, or both are as
    far, the end of greater displacement. Of ends that are reached more than once the first in the range is told. None
    where the displacement is greatest or least at an end of the input's range and does not turn back there, where the
    slide does not move, or where the relative motion at the pair is no length. Raises Unknown for another name.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> planar.stroke(motion, "stroke").pair
    'stroke'
    """
    motion.pair(pair)  # refuses what there is not
    return find_stroke(InterpolatedRun(motion), pair) if motion.has_length_motion(pair) else None


def find_stroke(steady: InterpolatedRun, pair: str) -> Stroke | None:
    """See `stroke`; of a motion made ready for it."""
    found = Output(steady, pair).turning_extremes()
    if found is None:
        return None
    low, high = found
    top, bottom = (high, low) if _is_top(steady, pair, high, low) else (low, high)
    return Stroke(pair, top, bottom, high.value - low.value)


@takes_result("Motion")
def swing(motion: Motion, name: str) -> Swing | None:
    """The extreme angles of a rocker, solved for to round-off: of a turning pair, else of a link, of this name.

    Angles are those of the motion, so that the swing may be more than a turn. None where it turns right round, where it
    does not turn, where it is most at an end of the input's range and does not turn back there, and of a slide. Raises
    Unknown for another name.

    >>> import planar
    >>> motion = planar.cycle(planar.load("crank-rocker"), 12)
    >>> planar.swing(motion, "crank") is None
    True
    """
    if name in relative_motions(motion.mechanism) and motion.has_length_motion(name):
        return None
    found = Output(InterpolatedRun(motion), name).turning_extremes()
    return found and Swing(name, *found, found[1].value - found[0].value)


@takes_result("Motion")
def extremes(motion: Motion, point: str, axis: Axis = "x") -> Extremes:
    """The extreme positions of a point along an axis, "x" or "y" or a direction (rad), solved for to round-off.

    Over a range that is not closed they may be at its ends. Of places that are alike the first in the range is told.
    Raises Unknown for another name, BadInput for another axis.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> round(planar.extremes(motion, "A").greatest.value, 6)
    0.48
    """
    return find_extremes(Output(InterpolatedRun(motion), point, axis), axis)


def find_extremes(output: Output, axis: Axis) -> Extremes:
    """See `extremes`; of the output along this axis, made already."""
    turns = output.turning_points
    candidates = [(each, True) for each in turns] + [(each, False) for each in output.range_ends]
    least, greatest = (
        min((each for each in candidates if abs(each[0].value - end) <= output.tolerance), key=lambda each: not each[1])
        for end in output.range
    )
    length = greatest[0].value - least[0].value
    return Extremes(output.name, axis, least[0], greatest[0], length, (least[1], greatest[1]))


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


def find_greatest(steady: InterpolatedRun, of: str | Output | StateMeasure, what: str = "velocity") -> Extreme:
    """See `greatest`; of a motion made ready for it, or of an output of it."""
    if what not in ("velocity", "acceleration"):
        raise BadInput("what", f"the greatest 'velocity' or 'acceleration' is found, not {what!r:.40}")

    def measured(moving: State | Motion) -> Array:
        """The square of the quantity, and of a velocity what its square grows by (..., 2)."""
        if not isinstance(of, str | Output):
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
    still = steady.solver.unit * max(abs(steady.rate), steady.rate**2) if isinstance(of, str | Output) else 0.0
    if np.ptp(squares) <= max(SERIES_TOLERANCE * squares.max(), (SERIES_TOLERANCE * still) ** 2):
        return Extreme(steady.lowest, sqrt(float(squares.max())))
    for limit, _ in steady.open_limits():
        if _is_unbounded(positions, squares, limit):
            return Extreme(limit, inf)
    rival = float(squares.max())
    worth = RIVAL_RATIO**2 * rival
    ends = () if steady.closed else (steady.lowest, steady.highest)
    found = [Extreme(end, float(squares[np.argmin(np.abs(positions - end))])) for end in ends]
    exact = isinstance(of, str | Output) and what == "velocity"
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


def quantity_and_rates(moving: State | Motion, name: str | Output) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (..., axes) of a slide, else of a point, another pair or a link."""
    if isinstance(name, Output):
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
    far, near = (
        float(np.hypot(*(state.point(slider).position - state.point(steady.pin).position)))
        for state in (steady.state_at(high.input), steady.state_at(low.input))
    )
    return far >= near - CLOSED_TOLERANCE * steady.solver.unit


def _is_unbounded(positions: Array, squares: Array, limit: float) -> bool:
    """Whether a quantity grows beyond all bounds towards a limit, by the two states that are nearest to it."""
    near, nearer = np.argsort(np.abs(positions - limit))[1::-1]
    times = abs((positions[near] - limit) / (positions[nearer] - limit))
    return bool(times > NEARER_RATIO and squares[nearer] > times**GROWTH_EXPONENT * squares[near])
