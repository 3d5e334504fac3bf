"""Extreme values of forces over a motion, for tables: solved for between positions where the motion is known there."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.dynamics.force_course import force_course, has_unknown_intervals
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.reports.number_format import AMONG_POSITIONS, ROUNDING_RATIO
from planar.reports.tables.motion import place_cell
from planar.results.motion import Motion


class RunExtreme(NamedTuple):
    """An extreme value (SI), where it is, as a cell of a table, and all columns there (columns,)."""

    value: float
    place: str
    columns: Array


class RunExtremes:
    """Extreme values of columns that are measured of forces, (n,) or (n, columns).

    `least_scale` (columns,) see `fit_series`. A column that is known at some positions only is read off these, and
    then `is_solved` is False.
    """

    def __init__(self, forces: Forces, measure: Callable[[Forces], Array], least_scale: Array | float):
        motion = forces.moving
        assert isinstance(motion, Motion)
        self.motion = motion
        self.rows = np.asarray(measure(forces), dtype=float).reshape(len(motion), -1)
        known = np.isfinite(self.rows).any(axis=0)
        is_finite = np.array([not has_unknown_intervals(column) for column in self.rows.T])
        self.course = force_course(forces)
        self.series = None
        self._solved_columns = np.flatnonzero(is_finite).tolist()
        if self.course is not None and is_finite.any():
            scales = np.broadcast_to(least_scale, is_finite.shape)[is_finite]
            self.series = self.course.series(
                lambda at_places: np.asarray(measure(at_places)).reshape(-1, len(is_finite))[:, is_finite], scales
            )
        self.is_solved = not known.any() or (self.series is not None and bool((known == is_finite).all()))

    @property
    def title(self) -> str:
        """What the title of a table says behind its words."""
        return "" if self.is_solved else AMONG_POSITIONS

    def greatest(self, column: int, sign: float = 1.0) -> RunExtreme:
        """The greatest value of a column, or the least (`sign` -1); NaN where it is unknown."""
        if self.is_solved and self.series is not None and self.course is not None and column in self._solved_columns:
            extreme = self.series.greatest(self._solved_columns.index(column), sign)
            columns = np.full(self.rows.shape[1], np.nan)
            columns[self._solved_columns] = extreme.columns
            position = float(self.course.positions([extreme.place])[0])
            return RunExtreme(extreme.value, place_cell(self.motion, position), columns)
        values = sign * self.rows[:, column]
        if not np.isfinite(values).any():
            return RunExtreme(np.nan, "", np.full(self.rows.shape[1], np.nan))
        row = int(np.nanargmax(values))
        along = self.motion.inputs[self.motion.running_input].position if self.motion.time is None else self.motion.time
        return RunExtreme(float(self.rows[row, column]), place_cell(self.motion, float(along[row])), self.rows[row])

    def least_and_greatest(self, column: int, scale: float) -> tuple[RunExtreme, RunExtreme]:
        """The least and the greatest value of a column, without places where they differ by round-off of a scale."""
        least, greatest = self.greatest(column, -1.0), self.greatest(column)
        if greatest.value - least.value <= ROUNDING_RATIO * scale:
            return least._replace(place=""), greatest._replace(place="")
        return least, greatest

    def mean(self, column: int) -> float:
        """The mean of a column over the run; over the positions where it is known at these alone."""
        if self.is_solved and self.series is not None and column in self._solved_columns:
            return self.series.integral(self._solved_columns.index(column)) / (self.series.high - self.series.low)
        known = self.rows[:, column][np.isfinite(self.rows[:, column])]
        return float(np.mean(known)) if len(known) else np.nan

    def greatest_size(self, column: int) -> RunExtreme:
        """The greatest absolute value of a column, of the places of equal ones that of the positive value."""
        high, low = self.greatest(column), self.greatest(column, -1.0)
        return low._replace(value=-low.value) if -low.value > high.value * (1.0 + EQUAL_SIZE) else high


EQUAL_SIZE = 1e-9
"""Two sizes that differ by less, of the greater, are equal."""
