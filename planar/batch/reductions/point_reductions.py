"""Reductions by name: extremes of what a point does, and measures of its path, of all designs of a block at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from planar.batch.mechanisms.results import Each
from planar.batch.results import Sweep

Array = np.ndarray

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
    found: Array = np.hypot(step[..., 0], step[..., 1]).sum(axis=1)
    return found


def enclosed_area(path: Array) -> Array:
    """The signed area (designs,) within closed paths (designs, steps + 1, 2), as `planar.area` counts it.

    From the positions as they are: with x + iy = sum of c_n exp(i n theta), pi times the sum of n |c_n|^2.
    """
    c = _fourier_coefficients(path)
    n = np.fft.fftfreq(c.shape[1], 1.0 / c.shape[1])
    n[2 * np.abs(n) == c.shape[1]] = 0.0
    found: Array = np.pi * np.sum(n * (c.real**2 + c.imag**2), axis=1)
    return found


def fourier_descriptors(path: Array, harmonics: int = HARMONICS) -> Array:
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
        found: Array = np.stack([ahead, back], axis=2).reshape(len(c), -1) / (1.0 + back[:, :1])
    return found


def _fourier_coefficients(path: Array) -> Array:
    """c_n (designs, steps) of x + iy at positions equally spaced, the last of which is the first again."""
    z = path[:, :-1, 0] + 1j * path[:, :-1, 1]
    return np.fft.fft(z, axis=1) / z.shape[1]


class _Measure(NamedTuple):
    """Of a point: `measure` of what a sweep has of it, `order`, (designs, steps + 1, 2); `of_whole_path`: whether only
    of paths that are solved at every step, `of_closed_path`: and that come back to their start."""

    measure: Callable[[Array], Array]
    order: str = "position"
    of_whole_path: bool = False
    of_closed_path: bool = False


def _magnitude_extremes(values: Array) -> Array:
    return extremes(np.hypot(values[..., 0], values[..., 1]))


def _bounding_box(path: Array) -> Array:
    return np.concatenate([np.fmin.reduce(path, axis=1), np.fmax.reduce(path, axis=1)], axis=1)


MEASURES: Mapping[str, _Measure] = {
    "x_extremes": _Measure(lambda path: extremes(path[..., 0])),
    "y_extremes": _Measure(lambda path: extremes(path[..., 1])),
    "bounding_box": _Measure(_bounding_box),
    "speed_extremes": _Measure(_magnitude_extremes, "velocity"),
    "acceleration_extremes": _Measure(_magnitude_extremes, "acceleration"),
    "path_length": _Measure(path_length, of_whole_path=True),
    "enclosed_area": _Measure(enclosed_area, of_whole_path=True, of_closed_path=True),
    "fourier_descriptors": _Measure(fourier_descriptors, of_whole_path=True, of_closed_path=True),
}
"""What is told of a point by name."""


@dataclass(frozen=True)
class PointReduction:
    """A function of a sweep, or of a block of one: a measure of `MEASURES` of a point, (designs, ...)."""

    point: str
    measure: str

    @property
    def wants_rates(self) -> bool:
        """Whether it is made of rates."""
        return MEASURES[self.measure].order != "position"

    def __call__(self, sweep: Sweep | Each) -> Array:
        """The measure of every design; not a number where the path is not as the measure wants it."""
        wanted = MEASURES[self.measure]
        if isinstance(sweep, Each):
            values = sweep.of_point(wanted.order, self.point)
        else:
            of_points: Mapping[str, Any] = getattr(sweep, wanted.order)
            values = np.asarray(of_points[self.point])
        found = wanted.measure(values)
        if wanted.of_whole_path:
            found[~sweep.whole] = np.nan
        if wanted.of_closed_path:
            found[~_is_closed(values)] = np.nan
        return found


def _is_closed(path: Array) -> Array:
    """Which paths (designs, steps + 1, 2) come back to where they started (designs,)."""
    extent = np.ptp(path, axis=1).max(axis=1)
    found: Array = np.abs(path[:, -1] - path[:, 0]).max(axis=1) <= CLOSED_PATH_TOLERANCE * extent
    return found


class ResultMeasure(NamedTuple):
    """A result beside those of points: which argument of a sweep asks for it, and of which order in time it is."""

    asked_by: str
    order: int = 0


RESULTS: Mapping[str, ResultMeasure] = {
    "angle": ResultMeasure("links"),
    "angular_velocity": ResultMeasure("links", 1),
    "angular_acceleration": ResultMeasure("links", 2),
    "value": ResultMeasure("pairs"),
    "value_rate": ResultMeasure("pairs", 1),
    "value_second_rate": ResultMeasure("pairs", 2),
    "transmission_angle": ResultMeasure("outputs"),
    "effort": ResultMeasure("efforts"),
    "reaction": ResultMeasure("reactions"),
    "reaction_couple": ResultMeasure("reactions"),
}
"""Results of links, pairs and inputs whose extremes are told by name: those attributes of a `Sweep`."""
EXTREMES_ENDING = "_extremes"


@dataclass(frozen=True)
class ResultReduction:
    """A function of a sweep, or of a block of one: the extremes of a result of `RESULTS`, of vectors by length."""

    name: str
    quantity: str

    @property
    def wants_rates(self) -> bool:
        """Whether it is a rate."""
        return RESULTS[self.quantity].order > 0

    def __call__(self, sweep: Sweep) -> Array:
        """The least and the greatest of every design (designs, 2)."""
        found: Mapping[str, Any] = getattr(sweep, self.quantity)
        values = np.asarray(found[self.name])
        return extremes(values if values.ndim == 2 else np.hypot(values[..., 0], values[..., 1]))
