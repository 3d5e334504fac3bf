"""The residuals of a mechanism against what was measured of it, by its free numbers, with exact derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.analysis.calibration.measurements import Measurement
from planar.derivatives.result_slopes import PredictedResults, PredictedValues
from planar.document.revised.changed_numbers import with_values
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import NoAnswer
from planar.foundation.jets import TURN
from planar.foundation.time_limit import all_within_time
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.position import solve

PATH_STEPS = 180
"""Positions of a path from which the nearest one to a sample is looked for."""
MAX_FOOT_STEPS = 8
FOOT_TOLERANCE = 1e-7
"""Of a part's scale: a foot that is no further off along the path is one."""
CLOSED_TURN = 1e-9
"""rad"""
LIMIT_DISTANCE = 1e-6
"""rad or m: an input so near to a limit is on it."""


class FittedSamples(NamedTuple):
    """What a mechanism shows beside what was measured."""

    inputs: Array
    "(n, inputs), rad or m"
    differences: Array
    "(n, parts): measured less shown, SI, NaN where nothing was measured"
    rows: Array
    "(rows,): what is to be small, in standard deviations"
    slopes: Array
    "(rows, numbers): its derivatives, per SI"
    row_samples: IntArray
    "(rows,): the sample of each"
    row_parts: IntArray
    "(rows,): the part of each; what is square to a path is of none, -1"
    is_active: BoolArray
    "(rows,): false for what a sample tells of its own place on the path, and on a dead point"


class ResidualFunction:
    """Residuals of a mechanism with these free numbers.

    Of a sample without a position of the input the residual is its distance from the path, square to it: the foot is
    where the input minimises the sum of squares, and there the derivative of what is square to the path is the partial
    one (G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10, 1973: variable projection).
    """

    def __init__(self, mechanism: Mechanism, measurement: Measurement, free: Sequence[str]):
        self.mechanism, self.measurement, self.free = mechanism, measurement, tuple(free)
        wanted = [(each.name, each.result) for each in measurement.series]
        self.predicted = PredictedResults(mechanism, wanted, self.free)
        self.names = [each.pair for each in mechanism.inputs]

    def changed(self, numbers: Array) -> Mechanism:
        """The mechanism with these free numbers (SI). Raises BadInput."""
        return with_values(self.mechanism, dict(zip(self.free, map(float, numbers), strict=True)))

    def at(self, mechanism: Mechanism) -> FittedSamples:
        """The residuals of a mechanism. Raises NoAnswer."""
        inputs = self.measurement.inputs
        return self._untimed(mechanism) if inputs is None else self._timed(mechanism, inputs)

    def _predict(self, mechanism: Mechanism, inputs: Array) -> PredictedValues:
        return self.predicted.at_inputs(mechanism, inputs)

    def _differences(self, shown: Array) -> Array:
        """Measured less shown (..., parts), angles by less than half a turn."""
        difference = self.measurement.values - shown
        turned: Array = difference - TURN * np.round(difference / TURN)
        return np.where(self.measurement.is_angle, turned, difference)

    def _timed(self, mechanism: Mechanism, inputs: Array) -> FittedSamples:
        kept = np.isfinite(self.measurement.values).any(axis=1)
        found = self._predict(mechanism, inputs[kept])
        shown = np.full(self.measurement.values.shape, np.nan)
        shown[kept] = found.values
        differences = self._differences(shown)
        rows = -differences[kept] / self.measurement.deviations
        slopes = found.by_numbers / self.measurement.deviations[:, None]
        known = np.isfinite(rows)
        sample, part = (each.astype(np.int64) for each in np.nonzero(known))
        active = ~found.is_singular[sample]
        sample = np.flatnonzero(kept)[sample]
        told = np.where(active, rows[known], 0.0), np.where(active[:, None], slopes[known], 0.0)
        return FittedSamples(inputs, differences, *told, sample, part, active)

    def _untimed(self, mechanism: Mechanism) -> FittedSamples:
        motion = cycle(mechanism, PATH_STEPS)
        given = motion.inputs[self.names[0]].position
        foot, found, is_end = self._feet(mechanism, motion, given)
        scale = self.measurement.deviations
        differences = self._differences(found.values)
        rows, slopes, samples, active = [], [], [], []
        for k, difference in enumerate(differences):
            known = np.isfinite(difference)
            if not known.any():
                continue
            turned = _turned_to(found.by_inputs[k, known, 0] / scale[known])
            is_told = np.full(len(turned), not found.is_singular[k])
            is_told[0] &= is_end[k]
            own = found.by_numbers[k, known] / scale[known, None]
            rows.append(np.where(is_told, turned @ (-difference[known] / scale[known]), 0.0))
            slopes.append(np.where(is_told[:, None], turned @ own, 0.0))
            samples += [k] * len(turned)
            active.append(is_told)
        sample = np.array(samples, np.int64)
        told = np.concatenate(rows), np.concatenate(slopes)
        return FittedSamples(
            foot[:, None], differences, *told, sample, np.full(len(sample), -1), np.concatenate(active)
        )

    def _feet(self, mechanism: Mechanism, motion: Motion, given: Array) -> tuple[Array, PredictedValues, BoolArray]:
        """The input's position (n,) at the nearest point of the path to each sample, what is shown there, and which are
        an end of the path (n,)."""
        along = self.predicted.along(motion)
        scale, unit = self.measurement.deviations, self.measurement.values
        distance = np.full((len(unit), len(given)), np.inf)
        for j, shown in enumerate(along.values):
            if not along.is_singular[j]:
                distance[:, j] = np.nansum((self._differences(shown) / scale) ** 2, axis=1)
        nearest = np.argmin(distance, axis=1)
        low, high = float(given.min()), float(given.max())
        step = (high - low) / max(len(given) - 1, 1)
        is_whole = abs((high - low) / TURN - round((high - low) / TURN)) < CLOSED_TURN and high - low > 1.0
        margin = 0.0 if is_whole else 1e-6 * (high - low)
        u = given[nearest]
        if not is_whole:
            u = np.clip(u, low + margin, high - margin)
        found = self._predict(mechanism, u[:, None])
        is_end = np.zeros(len(u), bool)
        for _ in range(MAX_FOOT_STEPS):
            tangent = np.where(np.isfinite(unit), found.by_inputs[:, :, 0] / scale, 0.0)
            off = np.nan_to_num(self._differences(found.values) / scale)
            square = np.maximum(np.einsum("np,np->n", tangent, tangent), np.finfo(float).tiny)
            change = np.clip(np.einsum("np,np->n", tangent, off) / square, -2.0 * step, 2.0 * step)
            wanted = u + np.where(found.is_singular, 0.0, change)
            after = wanted if is_whole else np.clip(wanted, low + margin, high - margin)
            is_end = (after != wanted) & (after == u)
            moved = np.abs(after - u) * np.sqrt(square)
            if (moved <= FOOT_TOLERANCE * np.linalg.norm(self._spread(along))).all():
                break
            u = after
            found = self._predict(mechanism, u[:, None])
        return u, found, is_end

    def _spread(self, along: PredictedValues) -> Array:
        """How far the path extends, in standard deviations (parts,)."""
        spread: Array = np.ptp(along.values, axis=0) / self.measurement.deviations
        return spread


def without_dead_points(mechanism: Mechanism, measurement: Measurement) -> tuple[Measurement, int]:
    """What was measured, without samples at which the mechanism stands on a limit of its input, and how many those are.

    Raises NoAnswer where it cannot be at another one.
    """
    if measurement.inputs is None:
        return measurement, 0
    names = [each.pair for each in mechanism.inputs]
    lost = []
    for k, position in enumerate(all_within_time(measurement.inputs, "samples")):
        try:
            solve(mechanism, dict(zip(names, map(float, position), strict=True)))
        except NoAnswer as problem:
            limits = cycle(mechanism, PATH_STEPS).limits if len(names) == 1 else ()
            if not any(each.of == names[0] and abs(each.input - position[0]) < LIMIT_DISTANCE for each in limits):
                raise NoAnswer(problem.outcome, f"sample {k + 1}: {problem}") from None
            lost.append(k)
    blank = [each.values.copy() for each in measurement.series]
    for values in blank:
        values[lost] = np.nan
    series = tuple(each._replace(values=own) for each, own in zip(measurement.series, blank, strict=True))
    return measurement._replace(series=series), len(lost)


def _turned_to(tangent: Array) -> Array:
    """An orthogonal matrix whose first row is along a vector, by one reflection."""
    size = float(np.linalg.norm(tangent))
    if size == 0.0:
        whole: Array = np.eye(len(tangent))
        return whole
    v = tangent / size
    sign = 1.0 if v[0] >= 0.0 else -1.0
    v[0] += sign
    reflected: Array = np.eye(len(v)) - np.outer(v, v) * (2.0 / (v @ v))
    return -sign * reflected
