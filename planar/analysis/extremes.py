"""Where in a run a slide turns back, and where something moves fastest: solved for, not read off its samples."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import inf, nan, sqrt
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev

from planar.analysis.steady import SAME, Steady
from planar.errors import BadInput, NoAnswer
from planar.mechanism import motions
from planar.motion import Motion, Moving, State
from planar.pairs import Kind

Array = np.ndarray
Measure = Callable[[State], float | Array]

NODES, HALVINGS = 12, 4
"""Exact positions through which a quantity is laid to be differentiated; how often their stretch is halved for it."""
ROUND_OFF = 1e-12
"""The last terms of a series, as a part of the greatest, when it has come to its end."""
RIVAL = 0.5
"""Local maxima of the samples less than this part of the greatest are not looked into."""
CLOSER, GROWTH = 5.0, 0.6
"""So many times nearer to a limit, the square of what grows there as the root of the distance, or faster, grows by more
than this power of it."""
EVALUATIONS = 80
"""Bisection alone needs 52 for a root to round-off."""


class Extreme(NamedTuple):
    """An extreme value (SI), and the position of the running input (rad or m) where it is."""

    input: float
    value: float


class Stroke(NamedTuple):
    """The stroke of a slide: its two ends, whose values are displacements (m), and its length (m).

    `top` is the top dead centre (TDC), the end farther from the driving crank's fixed pin, `bottom` the other (BDC).
    """

    pair: str
    top: Extreme
    bottom: Extreme
    length: float


def stroke(motion: Motion, pair: str) -> Stroke | None:
    """The ends of a slide's travel, where its velocity is zero, solved for to round-off (about 1e-14 rad of the input).

    Top is the end farther from the driving crank's fixed pin, in the plane; where there is no such pin, or both are as
    far, the end of greater displacement. Of ends that are reached more than once the first in the range is told. None
    where the displacement is greatest or least at an end of the input's range and does not turn back there, where the
    slide does not move, or where the relative motion at the pair is no length. Raises Unknown for another name.
    """
    motion.pair(pair)  # refuses what there is not
    return ends(Steady(motion), pair) if motion.slides(pair) else None


def ends(steady: Steady, pair: str) -> Stroke | None:
    """See `stroke`; of a motion made ready for it."""
    displacement = _motion_at(steady.samples, pair)[0]
    least, greatest, near = displacement.min(), displacement.max(), SAME * steady.solver.unit
    if greatest - least <= near:
        return None
    positions, velocities = steady.tabled(lambda moving: np.asarray(_motion_at(moving, pair)[1]))
    found = []
    for low, high in _changes(positions, velocities):
        try:
            zero = root(lambda at: float(_motion_at(steady.at(at), pair)[1]), low, high)
            place, value = steady.within(zero), float(_motion_at(steady.at(zero), pair)[0])
        except NoAnswer:
            continue  # what cannot be followed does not turn back
        if place is not None:
            found.append(Extreme(place, value))
    if len(found) < 2:
        return None
    low, high = (_first(found, pick(each.value for each in found), near) for pick in (min, max))
    if low.value > least + near or high.value < greatest - near:
        return None
    top, bottom = (high, low) if _farther(steady, pair, high, low) else (low, high)
    return Stroke(pair, top, bottom, high.value - low.value)


def greatest(motion: Motion, of: str | Measure, what: str = "velocity") -> Extreme:
    """Where in a run a slide, a point or anything else is fastest, and how fast, solved for.

    `of` is a pair, whose relative motion is meant, or a point, and `what` its "velocity" or "acceleration"; the value
    is the magnitude. Or `of` is a function of a State, a number or a vector, whose greatest magnitude is asked for.

    The input runs steadily at the file's velocity, without acceleration, as the chapters take it; where the file's
    velocity is zero, values are per unit of the input (m/rad, m/rad^2). The place of the greatest velocity, where
    v . a = 0, is solved for to round-off; that of another quantity is where the derivative of a polynomial through
    exact values on either side is zero, good to about 1e-11 rad. Of places that are alike the first is told.

    Over a range that is not closed the greatest may be at an end; where it grows beyond all bounds towards a limit of
    the range it is inf, there; where no rates are determined anywhere it is NaN. Raises Unknown where there is nothing
    of that name, BadInput for another `what`.
    """
    return fastest(Steady(motion), of, what)


def fastest(steady: Steady, of: str | Measure, what: str = "velocity") -> Extreme:
    """See `greatest`; of a motion made ready for it."""
    if what not in ("velocity", "acceleration"):
        raise BadInput("what", f"the greatest 'velocity' or 'acceleration' is found, not {what!r:.40}")

    def measured(moving: Moving) -> Array:
        """The square of the quantity, and of a velocity what its square grows by (..., 2)."""
        if not isinstance(of, str):
            if isinstance(moving, Motion):
                return np.stack([_or_nothing(measured, steady, at) if ok else np.zeros(2) for at, ok in rows])
            return np.array([float(np.sum(np.square(of(moving)))), 0.0])
        parts = rates(moving, of)
        square = np.sum(parts[1 if what == "velocity" else 2] ** 2, axis=-1)
        # its rate in time, turned into one along the input
        return np.stack([square, np.sum(parts[1] * parts[2], axis=-1) / steady.rate], axis=-1)

    def square(position: float) -> float:
        return float(measured(steady.at(position))[0])

    rows = list(zip(steady.positions.tolist(), steady.known, strict=True))
    positions, table = steady.tabled(measured)
    if not len(positions):
        return Extreme(steady.first, nan)
    squares = table[:, 0]
    still = steady.solver.unit * max(abs(steady.rate), steady.rate**2) if isinstance(of, str) else 0.0
    if np.ptp(squares) <= max(ROUND_OFF * squares.max(), (ROUND_OFF * still) ** 2):
        return Extreme(steady.first, sqrt(float(squares.max())))
    for limit, _ in steady.limited():
        if _grows(positions, squares, limit):
            return Extreme(limit, inf)
    worth = RIVAL**2 * float(squares.max())
    ends = () if steady.closed else (steady.first, steady.last)
    found = [Extreme(end, float(squares[np.argmin(np.abs(positions - end))])) for end in ends]
    exact = isinstance(of, str) and what == "velocity"
    for low, high in _changes(positions, table[:, 1], falling=True) if exact else _peaks(positions, squares):
        if squares[(positions >= low) & (positions <= high)].max() < worth:
            continue
        try:
            at = root(lambda at: float(measured(steady.at(at))[1]), low, high) if exact else _summit(square, low, high)
            place, value = steady.within(at), square(at)
        except NoAnswer:
            continue  # the motion branches there
        if place is not None:
            found.append(Extreme(place, value))
    if not found:
        found.append(Extreme(float(positions[np.argmax(squares)]), float(squares.max())))
    best = max(each.value for each in found)
    at, value = _first(found, best, ROUND_OFF * best)
    return Extreme(at, sqrt(value))


def _or_nothing(measured: Callable[[State], Array], steady: Steady, position: float) -> Array:
    """What is measured at a position, or nothing where the motion branches."""
    try:
        return measured(steady.at(position))
    except NoAnswer:
        return np.zeros(2)


def rates(moving: Moving, name: str) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration (..., axes) of a slide, else of a point, else of the motion at a pair."""
    named = motions(moving.mechanism)
    slides = name in named and named[name].drive_kind is Kind.LENGTH
    if slides or (name in named and name not in moving.point_names):
        position, velocity, acceleration = (np.asarray(part)[..., None] for part in _motion_at(moving, name))
        return position, velocity, acceleration
    return moving.point(name)[:3]


def _motion_at(moving: Moving, pair: str) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration of the relative motion at a pair: what every pair reports first."""
    position, velocity, acceleration = list(moving.pair(pair).values())[:3]
    return position, velocity, acceleration


def _first(found: list[Extreme], value: float, near: float) -> Extreme:
    """The first in the range of those that have this value."""
    return min(each for each in found if abs(each.value - value) <= near)


def _farther(steady: Steady, pair: str, high: Extreme, low: Extreme) -> bool:
    """Whether the sliding point is farther from the driving crank's pin at the end of greater displacement."""
    rides = steady.solver.named[pair].rides()
    if steady.pin is None or rides is None:
        return True
    slider = "{}.{}".format(*rides[0])
    far, near = (
        float(np.hypot(*(state.point(slider).position - state.point(steady.pin).position)))
        for state in (steady.at(high.input), steady.at(low.input))
    )
    return far >= near - SAME * steady.solver.unit


def _grows(positions: Array, squares: Array, limit: float) -> bool:
    """Whether a quantity grows beyond all bounds towards a limit, by the two states that are nearest to it."""
    near, nearer = np.argsort(np.abs(positions - limit))[1::-1]
    times = abs((positions[near] - limit) / (positions[nearer] - limit))
    return times > CLOSER and squares[nearer] > times**GROWTH * squares[near]


def _changes(positions: Array, values: Array, falling: bool = False) -> Iterator[tuple[float, float]]:
    """Where a quantity passes zero, or only where it falls through it: the positions on either side."""
    kept = values != 0.0
    positions, values = positions[kept], values[kept]
    for k in np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:])):
        if not falling or values[k] > 0.0:
            yield float(positions[k]), float(positions[k + 1])


def _peaks(positions: Array, values: Array) -> Iterator[tuple[float, float]]:
    """Where a quantity has a local maximum: the positions on either side."""
    inner = values[1:-1]
    for k in np.flatnonzero((inner >= values[:-2]) & (inner >= values[2:]) & (values[:-2] + values[2:] < 2.0 * inner)):
        yield float(positions[k]), float(positions[k + 2])


def _summit(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function is greatest between two positions: a zero of the derivative of a polynomial through it."""
    lowest, highest = low, high
    at = 0.5 * (low + high)
    for _ in range(HALVINGS):
        series = Chebyshev.interpolate(
            lambda some: np.array([function(float(each)) for each in some]), NODES - 1, domain=[low, high]
        )
        roots = [float(each.real) for each in series.deriv().roots() if abs(each.imag) < SAME]
        flat = [each for each in roots if low <= each <= high]
        at = max([*flat, low, high], key=series)
        terms = np.abs(series.coef)
        if terms[-2:].max() <= ROUND_OFF * terms.max():
            break
        quarter = 0.25 * (high - low)
        low, high = max(at - quarter, lowest), min(at + quarter, highest)
    return at


def root(function: Callable[[float], float], low: float, high: float) -> float:
    """A zero of a function between two positions at which its signs differ, to round-off.

    T. Chandrupatla, A new hybrid quadratic/bisection algorithm, Advances in Engineering Software 28, 1997.
    """
    a, b = high, low
    fa, fb = function(a), function(b)
    if fa * fb >= 0.0:  # a sample at round-off of the zero
        return a if abs(fa) < abs(fb) else b
    part = 0.5
    for _ in range(EVALUATIONS):
        x = a + part * (b - a)
        fx = function(x)
        if fx * fa > 0.0:
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, fx
        best = a if abs(fa) < abs(fb) else b
        least = 2.0 * float(np.finfo(float).eps) * max(abs(best), 1.0) / abs(b - a)
        if fx == 0.0 or least > 0.5:
            break
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        part = 0.5
        if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        part = min(1.0 - least, max(least, part))
    return best
