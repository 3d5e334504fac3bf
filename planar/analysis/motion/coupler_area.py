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


CROSSING_SAMPLES = 1440
"""Points of a curve between whose chords crossings are searched."""
CROSSING_SINE = 1e-4
"""Directions whose sine is below this do not cross: the curve touches itself, or runs back along itself."""
MAX_NEWTON_STEPS = 12
QUADRATURE_NODES = 8
"""Gauss-Legendre nodes of each interval between two samples along a loop."""


class Area(NamedTuple):
    """The signed area (m^2) within a point's closed curve, its estimated error (m^2), and from how many positions.

    `crossings` is how often the curve crosses itself. `loops` are the signed areas (m^2) of its loops, which add up to
    `value`: the curve is cut at every crossing and rejoined so that no loop crosses itself or another one (Seifert
    circles). A curve without crossings is one loop.
    """

    point: str
    value: float
    error: float
    positions: int
    crossings: int = 0
    loops: tuple[float, ...] = ()


@takes_result("Motion")
def area(motion: Motion, point: str) -> Area:
    """The area within the closed curve that a point describes over a motion, in the order of its rows.

    It is the net area: positive where the point goes round anticlockwise, so that the loops of a figure of eight
    cancel; the areas of the loops are in `loops`. A part that is gone round several times counts as often. A path there
    and back along one line has none.

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
            value = 0.0 if nothing else sense * found
            crossings, loops = _loop_areas(curve)
            return Area(
                point, value, error, many, crossings, tuple(sense * loop for loop in loops) if crossings else (value,)
            )
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


def _loop_areas(curve: ComplexArray) -> tuple[int, list[float]]:
    """How often a closed curve (n,) at equally spaced parameters crosses itself, and the areas of its loops.

    The parameter goes from 0 to 1. Between the samples the curve is its trigonometric interpolant.
    """
    terms, orders = _fourier_terms(curve)
    crossings = _crossings(terms, orders) if len(terms) > 1 else []
    if not crossings:
        return 0, []
    visits = sorted((parameter, number) for number, pair in enumerate(crossings) for parameter in pair)
    # the curve that arrives at a crossing goes on where it leaves from the other visit of the same crossing
    partner = {
        index: other
        for index, (_, number) in enumerate(visits)
        for other, (_, same) in enumerate(visits)
        if same == number and other != index
    }
    pieces = [
        _sector_area(terms, orders, start, stop)
        for (start, _), (stop, _) in zip(visits, [*visits[1:], (visits[0][0] + 1.0, 0)], strict=True)
    ]
    remaining, loops = set(partner), []
    while remaining:
        index, total = min(remaining), 0.0
        while index in remaining:
            remaining.remove(index)
            total += pieces[index]
            index = partner[(index + 1) % len(visits)]
        loops.append(total)
    return len(crossings), loops


def _fourier_terms(curve: ComplexArray) -> tuple[ComplexArray, Array]:
    """The coefficients of a closed curve and their orders, without what is round-off."""
    terms = np.fft.fft(curve) / len(curve)
    orders = np.fft.fftfreq(len(curve), 1.0 / len(curve))
    counted = (np.abs(terms) > 1e-16 * np.abs(terms).max()) & (np.abs(orders) < len(curve) / 2.0)
    return terms[counted], orders[counted]


def _evaluate(terms: ComplexArray, orders: Array, parameters: Array) -> tuple[ComplexArray, ComplexArray]:
    """A curve and its derivative by the parameter at some parameters (m,): each (m,)."""
    waves = np.exp(2j * np.pi * np.multiply.outer(parameters, orders))
    return waves @ terms, waves @ (2j * np.pi * orders * terms)


def _crossings(terms: ComplexArray, orders: Array) -> list[tuple[float, float]]:
    """The two parameters of each place where a curve crosses itself."""
    count = CROSSING_SAMPLES
    points, _ = _evaluate(terms, orders, np.arange(count) / count)
    chords = np.roll(points, -1) - points
    first, second = np.triu_indices(count, 2)
    apart = points[second] - points[first]
    turn = (chords[first].conj() * chords[second]).imag
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (apart.conj() * chords[second]).imag / turn
        across = (apart.conj() * chords[first]).imag / turn
    hits = (along >= -0.01) & (along <= 1.01) & (across >= -0.01) & (across <= 1.01)
    found: list[tuple[float, float]] = []
    for start, stop in zip((first + along)[hits] / count, (second + across)[hits] / count, strict=True):
        pair = _refine_crossing(terms, orders, float(start), float(stop))
        if pair is not None and not any(_is_same_crossing(pair, known) for known in found):
            found.append(pair)
    return found


def _is_same_crossing(pair: tuple[float, float], known: tuple[float, float]) -> bool:
    """Whether two pairs of parameters are one crossing, to within rounding."""
    gaps = np.abs(np.array(pair) - known)
    return bool((np.minimum(gaps, 1.0 - gaps) < 1e-7).all())


def _refine_crossing(terms: ComplexArray, orders: Array, first: float, second: float) -> tuple[float, float] | None:
    """A crossing by Newton's method from two parameters near it; None where the curve does not cross itself there."""
    place = np.array([first, second])
    size = float(np.abs(terms[orders != 0.0]).sum())
    for _ in range(MAX_NEWTON_STEPS):
        points, rates = _evaluate(terms, orders, place)
        turn = float((rates[0].conj() * rates[1]).imag)
        if abs(turn) <= CROSSING_SINE * float(np.abs(rates).prod()):
            return None
        gap = points[1] - points[0]
        step = np.array([(gap.conj() * rates[1]).imag, (gap.conj() * rates[0]).imag]) / turn
        place = place + step
        if np.abs(step).max() <= 1e-13:
            break
    points, _ = _evaluate(terms, orders, place)
    low, high = sorted(float(value) for value in place % 1.0)
    is_one_place = min(high - low, 1.0 - (high - low)) < 1e-6
    return None if is_one_place or abs(points[1] - points[0]) > 1e-9 * size else (low, high)


def _sector_area(terms: ComplexArray, orders: Array, start: float, stop: float) -> float:
    """Half the integral of x dy - y dx along a curve from one parameter to a later one."""
    nodes, weights = np.polynomial.legendre.leggauss(QUADRATURE_NODES)
    count = max(int(np.ceil((stop - start) * 2.0 * (np.abs(orders).max() + 1.0))), 1)
    edges = np.linspace(start, stop, count + 1)
    half = (stop - start) / count / 2.0
    points, rates = _evaluate(terms, orders, (edges[:-1, None] + half * (1.0 + nodes)).ravel())
    return float(0.5 * half * (points.conj() * rates).imag @ np.tile(weights, count))
