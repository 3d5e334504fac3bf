"""Samples that do not fit the rest, by their studentised residuals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.analysis.calibration.fitted_residuals import FittedSamples
from planar.analysis.calibration.measurements import Measurement
from planar.foundation.arrays import Array
from planar.foundation.short_repr import short_repr

RISK = 0.05
"""How often a sample of a set without outliers is taken for one."""
ROUNDING = 1e-10
"""Of the greatest measured number: residuals so small are rounding."""
FULL_LEVERAGE = 1.0 - 1e-9
"""A residual that the fit makes zero whatever was measured tells nothing."""


class Outlier(NamedTuple):
    """A sample (its row, from 0) that does not fit the rest: what of it, and its residual in standard deviations of
    what the others let expect."""

    row: int
    of: str
    studentised: float

    def __repr__(self) -> str:
        return short_repr(self)


def find_outliers(
    found: FittedSamples, slopes: Array, deviation: float, freedom: int, measurement: Measurement
) -> tuple[Outlier, ...]:
    """Samples whose externally studentised residual is beyond the quantile of Student's distribution for the greatest
    of all (R. D. Cook, S. Weisberg, Residuals and Influence in Regression, 1982), the worst first."""
    greatest = float(np.nanmax(np.abs(measurement.values) / measurement.deviations))
    if freedom < 2 or not deviation > ROUNDING * greatest:
        return ()
    from scipy.special import stdtrit  # slow to load, and only needed here

    rows, samples, parts = (each[found.is_active] for each in (found.rows, found.row_samples, found.row_parts))
    u, s, _ = np.linalg.svd(slopes, full_matrices=False)
    leverage = np.sum(u[:, s > 1e-7 * s.max(initial=0.0)] ** 2, axis=1)
    free = np.maximum(1.0 - leverage, 1.0 - FULL_LEVERAGE)
    inside = rows / (deviation * np.sqrt(free))
    left = np.maximum(freedom - inside**2, 1e-12)
    outside = inside * np.sqrt((freedom - 1) / left)
    limit = float(stdtrit(freedom - 1, 1.0 - RISK / (2.0 * len(rows))))
    labels, worst = measurement.labels, dict[int, Outlier]()
    for k in np.argsort(-np.abs(outside)):
        if abs(outside[k]) > limit and leverage[k] < FULL_LEVERAGE:
            of = labels[parts[k]] if parts[k] >= 0 else "distance from the path"
            worst.setdefault(int(samples[k]), Outlier(int(samples[k]), of, float(abs(outside[k]))))
    return tuple(worst.values())
