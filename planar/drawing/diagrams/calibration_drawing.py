"""What was measured over what the fitted mechanism shows: points on their paths with residuals enlarged, histograms."""

from __future__ import annotations

from collections.abc import Iterator
from math import floor, log10

import numpy as np

from planar.analysis.calibration.calibration import Calibration
from planar.analysis.calibration.measurements import MeasuredSeries
from planar.drawing.diagrams import axes
from planar.drawing.paper.picture import Arrow, Circle, Label, Mark, Pen, Picture, Polyline, paper_point
from planar.drawing.paper.scales import round_scale
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.model.file_units import FileUnits, display_unit
from planar.solving.cycle import cycle

ROOM = (110.0, 90.0)
"""mm that the path of a point takes at the most."""
LONGEST_ARROW = 12.0
"""mm of the greatest residual."""
ENLARGEMENTS = (5.0, 2.0, 1.0)
POINT_RADIUS = 0.5
HISTOGRAM_WIDTH, HISTOGRAM_HEIGHT = 70.0, 40.0
MAX_BINS = 24
PATH_STEPS = 360
NO_PATH: Array = np.empty((0, 2))


def calibration_pictures(found: Calibration) -> list[Picture]:
    """Of each measured point its path with the samples, and of each series the histogram of its residuals.

    Strokes are `about` "path", "sample 3", "residual 3", "bar 2".
    """
    pictures = []
    for each, residuals in zip(found.measurement.series, found.residuals.values(), strict=True):
        if each.result == "position" and np.ptp(np.nan_to_num(each.values), axis=0).max() > 0.0:
            pictures.append(_path_picture(found, each, residuals))
        pictures.append(_histogram(each, residuals, found.mechanism.units))
    return pictures


def _path_picture(found: Calibration, series: MeasuredSeries, residuals: Array) -> Picture:
    """The path of the fitted point, the samples, and arrows from the path to them, enlarged."""
    units = found.mechanism.units
    measured = series.values[np.isfinite(series.values).all(axis=1)]
    path = _path(found, series.name)
    every = np.concatenate([measured, path])
    width, height = np.ptp(every, axis=0)
    used = round_scale("length", units.length, float(width), float(height), ROOM)
    mm = 1.0 / used.per_mm
    sizes = np.linalg.norm(residuals, axis=1)
    times = _enlargement(float(np.nanmax(sizes, initial=0.0)) * mm)
    marks: list[Mark] = []
    if len(path) > 1:
        marks.append(Polyline(tuple(map(paper_point, path * mm)), Pen.PATH, "path"))
    outside = {each.row for each in found.outliers}
    for row, (at, by) in enumerate(zip(series.values, residuals, strict=True)):
        if not np.isfinite(by).all():
            continue
        foot, head = paper_point((at - by) * mm), paper_point((at - by + times * by) * mm)
        marks.append(Circle(paper_point(at * mm), POINT_RADIUS, Pen.PIN, f"sample {row + 1}"))
        if np.hypot(head[0] - foot[0], head[1] - foot[1]) > 1.0:
            marks.append(Arrow(foot, head, Pen.ACCELERATION if row in outside else Pen.VELOCITY, f"residual {row + 1}"))
        if row in outside:
            marks.append(Label(str(row + 1), head, f"residual {row + 1}", axes.NUMBER_SIZE, 1.0))
    notes = [str(used), f"residuals {times:g} times as long"]
    if outside:
        notes.append("numbered: samples that do not fit the rest")
    return Picture(tuple(marks), f"{series.name}: measured, and the fitted path", tuple(notes))


def _path(found: Calibration, name: str) -> Array:
    """The path (n, 2) of a point of the fitted mechanism, where it has one."""
    if len(found.inputs) != 1:
        return NO_PATH
    ((pair, at),) = found.inputs.items()
    try:
        run = cycle(found.mechanism, PATH_STEPS)
        whole = run.inputs[pair].position
        if found.is_timed and not (whole.min() - 1e-9 <= at.min() and at.max() <= whole.max() + 1e-9):
            run = cycle(found.mechanism, PATH_STEPS, float(at.min()), float(at.max()))
    except NoAnswer:
        return NO_PATH
    path: Array = run.point(name).position
    return path


def _enlargement(longest: float) -> float:
    """The roundest number that makes the longest residual (mm) about as long as an arrow may be."""
    if not longest > 0.0 or longest >= LONGEST_ARROW:
        return 1.0
    wanted = LONGEST_ARROW / longest
    power = 10.0 ** floor(log10(wanted))
    return next(each for each in ENLARGEMENTS if each * power <= wanted) * power


def _histogram(series: MeasuredSeries, residuals: Array, units: FileUnits) -> Picture:
    """How many residuals are how great, and the normal distribution of their root mean square."""
    name, of = display_unit(series.kind, units)
    values = np.asarray(of.from_si(1.0) * residuals[np.isfinite(residuals)])
    told = f"residual ({name})"
    if not len(values) or not np.any(values):
        return Picture((), f"Residuals of {series.name}", ("none",))
    across = axes.fit_axis(values, HISTOGRAM_WIDTH, told)
    bins = min(MAX_BINS, max(5, round(1.5 * len(values) ** 0.5)))
    counts, edges = np.histogram(values, bins, (across.low, across.high))
    up = axes.fit_axis(np.append(counts.astype(float), 0.0), HISTOGRAM_HEIGHT, "samples", 8.0)
    marks: list[Mark] = [*axes.axes_frame(across, up), *_bars(counts, edges, across, up)]
    rms = float(np.sqrt(np.mean(values**2)))
    x = np.linspace(across.low, across.high, 121)
    width = edges[1] - edges[0]
    bell = len(values) * width / (rms * np.sqrt(2.0 * np.pi)) * np.exp(-0.5 * (x / rms) ** 2)
    marks += axes.curve_strokes(x, np.where(bell <= up.high, bell, np.nan), across, up, Pen.SHARE, "normal")
    return Picture(tuple(marks), f"Residuals of {series.name}", (f"root mean square {rms:.4g} {name}",))


def _bars(counts: Array, edges: Array, across: axes.Axis, up: axes.Axis) -> Iterator[Mark]:
    for k, count in enumerate(counts):
        if count:
            low, high = edges[k], edges[k + 1]
            corners = ((low, 0.0), (low, count), (high, count), (high, 0.0))
            points = tuple(axes.point_on_paper(float(x), float(y), across, up) for x, y in corners)
            yield Polyline(points, Pen.CURVE, f"bar {k + 1}", closed=True)
