"""Reductions by name: extremes of what a point does, and measures of its path, of all designs of a block at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from planar.batch.mechanisms.results import Each
from planar.batch.named_results.result_rows import LINK_QUANTITIES, PAIR_QUANTITIES
from planar.batch.results import Sweep
from planar.foundation.arrays import Array, BoolArray, ComplexArray

HARMONICS = 8
"""Harmonics of a path of which there are descriptors."""
CLOSED_PATH_TOLERANCE = 1e-6
"""Of a path's extent, by which its end may lie beside its start."""


def extremes(values: Array) -> Array:
    """The least and the greatest (designs, 2) of values (designs, steps + 1), of those that are numbers."""
    return np.stack([np.fmin.reduce(values, axis=1), np.fmax.reduce(values, axis=1)], axis=1)


def path_length(path: Array) -> Array:
    """The length (designs,) of the polygon through the positions of paths (designs, steps + 1, 2)."""
    step = np.diff(path, axis=1)
    length: Array = np.hypot(step[..., 0], step[..., 1]).sum(axis=1)
    return length


def enclosed_area(path: Array) -> Array:
    """The signed area (designs,) within closed paths (designs, steps + 1, 2), as `planar.area` counts it.

    From the positions as they are: with x + iy = sum of c_n exp(i n theta), pi times the sum of n |c_n|^2.
    """
    c = _fourier_coefficients(path)
    n = np.fft.fftfreq(c.shape[1], 1.0 / c.shape[1])
    n[2 * np.abs(n) == c.shape[1]] = 0.0
    area: Array = np.pi * np.sum(n * (c.real**2 + c.imag**2), axis=1)
    return area


def fourier_descriptors(path: Array, harmonics: int = HARMONICS) -> ComplexArray:
    """Normalised Fourier descriptors (designs, 2 harmonics) of closed paths (designs, steps + 1, 2): complex numbers.

    Those of n = 1, -1, 2, -2, ... in x + iy = sum of c_n exp(i n theta), theta going on evenly from step to step, so
    scaled, turned and begun that the ellipse of n = 1 and -1 has its greater half-axis of length one along x, starts at
    its end, and is gone round anticlockwise; of the two ends the one at which c_2 has no negative real part. So equal
    curves have equal descriptors wherever they lie, however large they are, and wherever they begin (F. P. Kuhl,
    C. R. Giardina, Elliptic Fourier features of a closed contour, Comp. Graphics Image Proc. 18, 1982).
    """
    c = _fourier_coefficients(path)
    n = np.arange(1, harmonics + 1)
    ahead, back = c[:, n], c[:, -n]
    clockwise = (np.abs(ahead[:, 0]) < np.abs(back[:, 0]))[:, None]
    ahead, back = np.where(clockwise, back, ahead), np.where(clockwise, ahead, back)
    with np.errstate(all="ignore"):  # of a point at rest there is none
        first = ahead[:, :1]
        ahead, back = ahead / first, back / first
        begin = np.exp(0.5j * np.angle(back[:, :1]))
        ahead, back = ahead * begin ** (n - 1), back * begin ** (-n - 1)
        other = (ahead[:, 1:2].real < 0.0) if harmonics > 1 else np.zeros((len(c), 1), dtype=bool)
        ahead, back = np.where(other, ahead * (-1.0) ** (n - 1), ahead), np.where(other, back * (-1.0) ** (n + 1), back)
        return np.stack([ahead, back], axis=2).reshape(len(c), -1) / (1.0 + back[:, :1])


def _fourier_coefficients(path: Array) -> ComplexArray:
    """c_n (designs, steps) of x + iy at positions equally spaced, the last of which is the first again."""
    z = path[:, :-1, 0] + 1j * path[:, :-1, 1]
    return np.fft.fft(z, axis=1) / z.shape[1]


class _Measure(NamedTuple):
    """A `function` of a quantity that a sweep has of a point (designs, steps + 1, 2), or of a link, pair or input.

    `of_whole_path`: only of paths that are solved at every step; `of_closed_path`: and that come back to their start.
    """

    function: Callable[[Array], Any]
    quantity: str = "position"
    of_whole_path: bool = False
    of_closed_path: bool = False


def _size_extremes(values: Array) -> Array:
    """The least and the greatest of every design (designs, 2), of vectors by length."""
    return extremes(values if values.ndim == 2 else np.hypot(values[..., 0], values[..., 1]))


def _bounding_box(path: Array) -> Array:
    return np.concatenate([np.fmin.reduce(path, axis=1), np.fmax.reduce(path, axis=1)], axis=1)


POINT_MEASURES: Mapping[str, _Measure] = {
    "x_extremes": _Measure(lambda path: extremes(path[..., 0])),
    "y_extremes": _Measure(lambda path: extremes(path[..., 1])),
    "bounding_box": _Measure(_bounding_box),
    "speed_extremes": _Measure(_size_extremes, "velocity"),
    "acceleration_extremes": _Measure(_size_extremes, "acceleration"),
    "path_length": _Measure(path_length, of_whole_path=True),
    "enclosed_area": _Measure(enclosed_area, of_whole_path=True, of_closed_path=True),
    "fourier_descriptors": _Measure(fourier_descriptors, of_whole_path=True, of_closed_path=True),
}
RESULT_ARGUMENTS: Mapping[str, str] = {
    **dict.fromkeys(LINK_QUANTITIES, "links"),
    **dict.fromkeys(PAIR_QUANTITIES, "pairs"),
    "transmission_angle": "outputs",
    "effort": "efforts",
    "reaction": "reactions",
    "reaction_couple": "reactions",
}
"""Quantities of links, pairs and inputs, those attributes of a `Sweep`: which argument of a sweep asks for each."""
MEASURES: Mapping[str, _Measure] = {
    **POINT_MEASURES,
    **{f"{quantity}_extremes": _Measure(_size_extremes, quantity) for quantity in RESULT_ARGUMENTS},
}
RATES = "velocity", "acceleration", *LINK_QUANTITIES[1:], *PAIR_QUANTITIES[1:]


@dataclass(frozen=True)
class NamedReduction:
    """A function of a sweep, or of a block of one: a measure of `MEASURES` of a point, link, pair or input."""

    name: str
    measure: str

    @property
    def is_of_point(self) -> bool:
        """Whether it is a measure of a point."""
        return self.measure in POINT_MEASURES

    @property
    def quantity(self) -> str:
        """The attribute of a sweep that is measured."""
        return MEASURES[self.measure].quantity

    @property
    def wants_rates(self) -> bool:
        """Whether it is made of rates."""
        return self.quantity in RATES

    def __call__(self, sweep: Sweep | Each) -> Array:
        """The measure of every design; not a number where the path is not as the measure needs it."""
        measure = MEASURES[self.measure]
        if isinstance(sweep, Each):
            values = sweep.of_point(measure.quantity, self.name)
        else:
            results: Mapping[str, Any] = getattr(sweep, measure.quantity)
            values = np.asarray(results[self.name])
        measured = measure.function(values)
        if measure.of_whole_path:
            measured[~sweep.whole] = np.nan
        if measure.of_closed_path:
            measured[~_is_closed(values)] = np.nan
        return measured


def _is_closed(path: Array) -> BoolArray:
    """Which paths (designs, steps + 1, 2) come back to where they started (designs,)."""
    extent = np.ptp(path, axis=1).max(axis=1)
    return np.asarray(np.abs(path[:, -1] - path[:, 0]).max(axis=1) <= CLOSED_PATH_TOLERANCE * extent)
