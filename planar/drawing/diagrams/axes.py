"""Axes of a diagram in millimetres on paper, and curves between them."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor
from typing import NamedTuple

import numpy as np

from planar.drawing.paper.picture import Label, Mark, PaperPoint, Pen, Polyline, paper_point
from planar.drawing.paper.scales import DECIMAL_STEPS, DEGREE_STEPS, round_step, unit_for_size
from planar.foundation.arrays import Array
from planar.model.file_units import FileUnits

TICK_LENGTH, NUMBER_SIZE, NAME_SIZE = 1.2, 7.0, 8.0
"""mm that a tick is long; points of the numbers and of an axis's name."""
NUMBER_GAP = 0.6
"""mm between a tick and its number."""
FLAT_TOLERANCE, FLAT_HALF_RATIO = 1e-9, 0.5
"""Values that differ by less than this part of the greatest are one, and stand in the middle of an axis that goes on
by this part of it, or of one, both ways."""
LEAST_VALUE = 1e-290
"""Values below this are drawn as none: their steps would be no numbers any more."""

USUAL_QUANTILE, OUTLIER_RATIO, SHOWN_RATIO = 0.8, 10.0, 3.0
"""So many of all values are usual; one that is so many times the greatest of these is beyond the axis, and so many are
shown then."""


class Axis(NamedTuple):
    """From `low` to `high` on so many millimetres, a tick at every multiple of `step`; `name` with its unit."""

    low: float
    high: float
    length: float
    step: float
    name: str
    unit_factor: float = 1.0
    "of what the numbers count, such as 1000 of kN"

    def on_paper(self, value: Array | float) -> Array | float:
        """Millimetres from the axis's start."""
        return (value - self.low) * (self.length / (self.high - self.low))

    @property
    def ticks(self) -> list[float]:
        """The values at which there are ticks."""
        slack = 1e-9 * (self.high - self.low)
        first, last = ceil((self.low - slack) / self.step), floor((self.high + slack) / self.step)
        return [self.step * k for k in range(first, last + 1)]


def fit_axis(
    values: Array,
    length: float,
    name: str,
    tick_distance: float = 12.0,
    end_at_ticks: bool = True,
    degrees: bool = False,
) -> Axis:
    """An axis for values with ticks at least so far apart (mm), from tick to tick where it is `end_at_ticks`."""
    told = values[np.isfinite(values)]
    low, high = float(told.min(initial=np.inf)), float(told.max(initial=-np.inf))
    if not low <= high:
        low, high = 0.0, 0.0
    most = max(abs(low), abs(high))
    if most < LEAST_VALUE:
        low, high, most = 0.0, 0.0, 0.0
    if high - low <= FLAT_TOLERANCE * most or most == 0.0:
        low, high = low - FLAT_HALF_RATIO * (most or 1.0), high + FLAT_HALF_RATIO * (most or 1.0)
    step = round_step((high - low) * tick_distance / length, DEGREE_STEPS if degrees else DECIMAL_STEPS)
    if end_at_ticks:
        low, high = step * floor(low / step + 1e-9), step * ceil(high / step - 1e-9)
    return Axis(low, high, length, step, name)


def force_axis(values: Array, length: float, symbol: str, kind: str, units: FileUnits) -> Axis:
    """An upright axis of forces (N) or couples (N m), zero on it, in the unit in which these are said."""
    name, per = unit_for_size(kind, float(np.nanmax(np.abs(values), initial=0.0)), units)
    axis = fit_axis(np.append(values, 0.0) / per, length, f"{symbol} ({name})", 9.0)
    return axis._replace(low=axis.low * per, high=axis.high * per, step=axis.step * per, unit_factor=per)


def axes_frame(across: Axis, up: Axis) -> Iterator[Mark]:
    """Both axes at the left and below, with ticks, numbers and names, and where they cross a zero its line."""
    corners = ((0.0, 0.0), (across.length, 0.0), (across.length, up.length), (0.0, up.length))
    yield Polyline(corners, Pen.AXIS, "frame", closed=True)
    for each, way in ((across, (0, -1)), (up, (-1, 0))):
        for value in each.ticks:
            at = float(each.on_paper(value))
            foot = (at, 0.0) if each is across else (0.0, at)
            end = foot[0] + TICK_LENGTH * way[0], foot[1] + TICK_LENGTH * way[1]
            yield Polyline((foot, end), Pen.AXIS, f"tick {each.name}")
            yield Label(
                format_number(value / each.unit_factor), end, f"number {each.name}", NUMBER_SIZE, NUMBER_GAP, side=way
            )
    if up.low < 0.0 < up.high:
        at = float(up.on_paper(0.0))
        yield Polyline(((0.0, at), (across.length, at)), Pen.AXIS, "zero")
    yield Label(up.name, (0.0, up.length), f"axis {up.name}", NAME_SIZE, 1.5, side=(0, 1))
    yield Label(across.name, (across.length, 0.0), f"axis {across.name}", NAME_SIZE, 1.5, side=(1, 0))


def curve_strokes(x: Array, y: Array, across: Axis, up: Axis, pen: Pen, about: str) -> list[Polyline]:
    """A curve, in as many pieces as gaps leave."""
    both = np.stack([across.on_paper(x), up.on_paper(y)], axis=1)
    told = np.flatnonzero(np.isfinite(both).all(axis=1))
    runs = np.split(told, np.flatnonzero(np.diff(told) > 1) + 1) if len(told) else []
    return [Polyline(tuple(map(paper_point, both[run])), pen, about) for run in runs if len(run) > 1]


def point_on_paper(x: float, y: float, across: Axis, up: Axis) -> PaperPoint:
    """A place between the axes."""
    return float(across.on_paper(x)), float(up.on_paper(y))


def format_number(value: float, digits: int = 6) -> str:
    """A number with a proper minus sign."""
    return f"{value:.{digits}g}".replace("-", "−") if value else "0"


MAX_OUTLIER_SHARE = 0.1
"""Of the values: what grows over more of them is part of the motion, as the working stroke of a press."""


def without_outliers(values: Array) -> Array:
    """The same, not a number where values grow beyond all the others, as beside a dead point (n,)."""
    size = np.abs(values[np.isfinite(values)])
    usual = float(np.quantile(size, USUAL_QUANTILE)) if len(size) else 0.0
    if not usual or size.max() <= OUTLIER_RATIO * usual or np.mean(size > SHOWN_RATIO * usual) > MAX_OUTLIER_SHARE:
        return values
    return np.where(np.abs(values) <= SHOWN_RATIO * usual, values, np.nan)
