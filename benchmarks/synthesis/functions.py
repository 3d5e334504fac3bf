"""Four-bars that make functions, beside three precision points at Chebyshev's spacing.

The structural error is the greatest difference between the output's angle and the wanted one, both zeros being free,
in % of the output's swing. Beside it stands the method of textbooks, its error computed in the same way: Freudenstein's
equation at three points at Chebyshev's spacing, at the best of all starting angles by steps of 5 degrees.

F. Freudenstein, *Approximate Synthesis of Four-Bar Linkages*, Transactions of the ASME 77 (1955) 853; R. S. Hartenberg,
J. Denavit, *Kinematic Synthesis of Linkages*, McGraw-Hill 1964, chapter 10.
"""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from typing import NamedTuple

import numpy as np

import planar
from benchmarks.synthesis.misses import Array

MANY, DENSE = 25, 201
"""Pairs that are wanted, and angles of the input at which the error is looked at."""
STEP = 5
"""Degrees between the starting angles that are tried."""


class WantedFunction(NamedTuple):
    """y = f(x) over a range, x by a swing of the input and y by one of the output (degrees)."""

    name: str
    f: Callable[[Array], Array]
    low: float
    high: float
    input_swing: float
    output_swing: float

    def angles(self, many: int) -> tuple[Array, Array]:
        """Of the input (n,) at equal ways, and of the output (n,), rad from their starts."""
        x = np.linspace(self.low, self.high, many)
        y = self.f(x)
        turned = np.radians(self.input_swing) * (x - self.low) / (self.high - self.low)
        return turned, np.radians(self.output_swing) * (y - y[0]) / abs(float(np.ptp(y)))


class FunctionResult(NamedTuple):
    """Structural errors in % of the output's swing (none where there is no design), and processor seconds."""

    name: str
    own: float | None
    three_points: float | None
    seconds: float
    defects: tuple[str, ...]


FUNCTIONS = (
    WantedFunction("x^2, 0..1", np.square, 0.0, 1.0, 90.0, 90.0),
    WantedFunction("x^1.5, 1..4", lambda x: x**1.5, 1.0, 4.0, 90.0, 90.0),
    WantedFunction("sqrt x, 1..4", np.sqrt, 1.0, 4.0, 90.0, 60.0),
    WantedFunction("1/x, 1..2", np.reciprocal, 1.0, 2.0, 90.0, 90.0),
    WantedFunction("log10 x, 1..2", np.log10, 1.0, 2.0, 60.0, 90.0),
    WantedFunction("log10 x, 1..10", np.log10, 1.0, 10.0, 100.0, 50.0),
    WantedFunction("exp x, 0..1", np.exp, 0.0, 1.0, 90.0, 90.0),
    WantedFunction("sin x, 0..90 deg", np.sin, 0.0, np.pi / 2.0, 120.0, 60.0),
    WantedFunction("tan x, 0..45 deg", np.tan, 0.0, np.pi / 4.0, 90.0, 90.0),
    WantedFunction("parabola x (1 - x), 0.1..0.9", lambda x: x * (1.0 - x), 0.1, 0.9, 100.0, 30.0),
)


def function_task(wanted: WantedFunction) -> dict[str, object]:
    """The task's file value: the model `four-bar`, from its input A to D."""
    first, second = wanted.angles(MANY)
    pairs = np.degrees(np.stack([first, second], axis=1)).tolist()
    entry = {"from": "A", "to": "D", "pairs": pairs}
    units = {"length": "mm", "angle": "deg"}
    return {"planar": 1, "name": wanted.name, "units": units, "start": "four-bar", "wanted": [entry]}


def measure(wanted: WantedFunction) -> FunctionResult:
    """A function by planar, judged anew from the design's file, and by three points."""
    begun = process_time()
    found = planar.synthesise(function_task(wanted), many=3)
    seconds = process_time() - begun
    other = best_of_three_points(wanted)
    if not found:
        return FunctionResult(wanted.name, None, other, seconds, tuple(found.remarks))
    best = found[0]
    error = design_error(wanted, best.mechanism, float(best.inputs[0][0]))
    return FunctionResult(wanted.name, error, other, seconds, best.defects)


def design_error(wanted: WantedFunction, mechanism: planar.Mechanism, start: float) -> float:
    """The structural error of a mechanism whose input A runs from `start` (rad), % of the output's swing."""
    again = planar.loads(planar.dumps(mechanism))
    stop = start + float(np.radians(wanted.input_swing))
    motion = planar.cycle(again, DENSE - 1, pair="A", start=start, stop=stop)
    output = np.unwrap(np.asarray(motion.pair("D")["relative_angle"]))
    return structural_error(output, wanted)


def structural_error(output: Array, wanted: WantedFunction) -> float:
    """Of output angles (n,) at equal ways of the input, rad: % of the wanted swing, the zero being free."""
    off = output - wanted.angles(len(output))[1]
    return 50.0 * float(np.ptp(off)) / np.radians(wanted.output_swing)


def best_of_three_points(wanted: WantedFunction) -> float | None:
    """The least structural error of three points at Chebyshev's spacing, over all starting angles."""
    angles = np.radians(np.arange(0.0, 360.0, STEP))
    errors = [three_points_error(wanted, first, second) for first in angles for second in angles]
    least = float(np.nanmin(errors))
    return least if np.isfinite(least) else None


def three_points_error(wanted: WantedFunction, first: float, second: float) -> float:
    """The structural error with the input starting at `first` and the output at `second`; NaN where it does not run.

    K1 cos(psi) - K2 cos(phi) + K3 = cos(phi - psi), with K1 = d/a, K2 = d/c, K3 = (a^2 - b^2 + c^2 + d^2) / (2 a c).
    """
    turned, wanted_turned = wanted.angles(DENSE)
    share = 0.5 - 0.5 * np.cos(np.pi * (2.0 * np.arange(3) + 1.0) / 6.0)
    phi = first + share * turned[-1]
    psi = second + np.interp(share * turned[-1], turned, wanted_turned)
    rows = np.stack([np.cos(psi), -np.cos(phi), np.ones(3)], axis=1)
    if abs(np.linalg.det(rows)) < 1e-9:
        return np.nan
    k1, k2, k3 = np.linalg.solve(rows, np.cos(phi - psi))
    return _freudenstein_error(wanted, first + turned, (float(k1), float(k2), float(k3)))


def _freudenstein_error(wanted: WantedFunction, phi: Array, k: tuple[float, float, float]) -> float:
    """The structural error of a four-bar by its three ratios, on one branch all the way."""
    # (k1 - cos phi) cos psi - sin phi sin psi = k2 cos phi - k3
    a, b, c = k[0] - np.cos(phi), -np.sin(phi), k[1] * np.cos(phi) - k[2]
    far = np.hypot(a, b)
    if (np.abs(c) >= far).any():
        return np.nan
    outputs = [np.unwrap(np.arctan2(b, a) + side * np.arccos(c / far)) for side in (1.0, -1.0)]
    return min(structural_error(each, wanted) for each in outputs)
