"""The area within a closed coupler curve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import CLOSED_TOLERANCE, InterpolatedRun
from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array, ComplexArray
from planar.foundation.errors import BadInput, NoAnswer
from planar.results.motion import Motion
from planar.solving.cycle import cycle

SUM_TOLERANCE = 1e-10
"""The estimated error, beside the area, at which the sum has come to its end."""
ROUND_OFF_RATIO = 1e-14
"""An error below this part of the square of the curve's extent is round-off, however small the area is."""
MAX_POSITIONS = 4096
"""Positions at the most."""


class Area(NamedTuple):
    """The signed area (m^2) within a point's closed curve, its estimated error (m^2), and from how many positions."""

    point: str
    value: float
    error: float
    positions: int


@takes_result("Motion")
def area(motion: Motion, point: str) -> Area:
    """The area within the closed curve that a point describes over a motion, in the order of its rows.

    Positive where the point goes round anticlockwise; parts that are gone round several times, or the other way, count
    so often, or against the others. A path there and back along one line has none.

    With x + iy = sum of c_n exp(i n theta) over the range it is pi times the sum of n abs(c_n)^2, which is half the
    integral of x dy - y dx. From exact positions equally spaced, as many as those of the motion, and twice as many
    until the sum does not change by more than 1e-10 of itself: of smooth curves it converges like a geometric series
    (L. N. Trefethen, J. A. C. Weideman, The exponentially convergent trapezoidal rule, SIAM Review 56, 2014).

    Raises Unknown for another name, BadInput where the curve is not closed.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> round(planar.area(motion, "A").value, 6)
    0.723823
    """
    motion.point(point)  # refuses what there is not
    steady = InterpolatedRun(motion)
    _refuse_open(steady, motion, point)
    sense = 1.0 if steady.positions[-1] > steady.positions[0] else -1.0
    many = len(steady.positions) - 1
    curve = _sample_curve(steady, point, many)
    extent = float(np.abs(curve - curve.mean()).max())
    before = _area_within(curve[::2]) if many % 2 == 0 else np.inf
    while True:
        found = _area_within(curve)
        error = abs(found - before)
        if error <= max(SUM_TOLERANCE * abs(found), ROUND_OFF_RATIO * extent**2) or 2 * many > MAX_POSITIONS:
            nothing = abs(found) <= ROUND_OFF_RATIO * extent**2  # there and back along one line
            return Area(point, 0.0 if nothing else sense * found, error, many)
        curve, before, many = _refine_curve(steady, point, curve), found, 2 * many


def _refuse_open(steady: InterpolatedRun, motion: Motion, point: str) -> None:
    if steady.closed:
        return
    place, velocity, acceleration = steady.samples.point(point)
    scales = steady.solver.unit * np.array(
        [1.0, max(abs(steady.rate), CLOSED_TOLERANCE), max(steady.rate**2, CLOSED_TOLERANCE)]
    )
    gaps = [float(np.hypot(*(part[-1] - part[0]))) for part in (place, velocity, acceleration)]
    turns = steady.period / (2.0 * np.pi)
    whole = (
        not motion.has_length_motion(steady.pair)
        and round(turns) >= 1
        and abs(turns - round(turns)) <= CLOSED_TOLERANCE
    )
    if whole and all(gap <= CLOSED_TOLERANCE * scale for gap, scale in zip(gaps, scales, strict=True)):
        return
    told = f"{point} does not come back to where it started as it moved there, so that no area is within its curve"
    raise BadInput(point, f"{told}; run the input through as many whole turns as it takes")


def _sample_curve(steady: InterpolatedRun, point: str, many: int) -> ComplexArray:
    """x + iy at equally spaced positions, without the end."""
    places = np.linspace(steady.lowest, steady.highest, many + 1)
    order = np.argsort(steady.positions, kind="stable")
    if np.abs(steady.positions[order] - places).max() > 1e-13 * max(steady.period, abs(steady.highest)):
        return _points_at(steady, point, places[:-1])
    x, y = steady.samples.point(point).position[order[:-1]].T
    found: ComplexArray = x + 1j * y
    return found


def _refine_curve(steady: InterpolatedRun, point: str, curve: ComplexArray) -> ComplexArray:
    """The same curve at twice as many positions: of a finer run where that is the same motion, else one by one."""
    many = len(curve)
    try:
        finer = cycle(steady.mechanism, 2 * many, steady.lowest, steady.highest, steady.pair)
    except NoAnswer:
        finer = None
    if finer is not None and len(finer) == 2 * many + 1:
        x, y = finer.point(point).position[:-1].T
        found: ComplexArray = x + 1j * y
        if np.abs(found[::2] - curve).max() <= CLOSED_TOLERANCE * steady.solver.unit:
            return found
    between = _points_at(steady, point, steady.lowest + steady.period * (np.arange(many) + 0.5) / many)
    return np.stack([curve, between], axis=1).ravel()


def _points_at(steady: InterpolatedRun, point: str, places: Array) -> ComplexArray:
    return np.array([complex(*steady.state_at(float(place)).point(point).position) for place in places])


def _area_within(curve: ComplexArray) -> float:
    many = len(curve)
    terms = np.fft.fft(curve) / many
    n = np.fft.fftfreq(many, 1.0 / many)
    n[np.abs(n) == many / 2] = 0.0
    return float(np.pi * np.sum(n * np.abs(terms) ** 2))
