"""The band of a result within tolerances, round its path or over the motion, and what each number brings to it."""

from __future__ import annotations

import numpy as np

from planar.analysis.tolerance.tolerance import ToleranceBand
from planar.drawing.diagrams import axes
from planar.drawing.diagrams.drawn_run import steady_run
from planar.drawing.diagrams.positions import loci, motion_scale
from planar.drawing.diagrams.running_axis import running_axis
from planar.drawing.paper.picture import Fill, Label, Mark, Pen, Picture, Polyline
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.link_bodies import convex_hull
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector
from planar.model.file_units import display_unit
from planar.model.wording import amount
from planar.results.motion import Motion

DIAGRAM_WIDTH, DIAGRAM_HEIGHT = 150.0, 80.0
"""mm between the axes."""
BAND_WIDTH = 5.0
"""mm on paper that the greatest deviation of a band is at least, by a factor where it would be less."""
DIRECTIONS = 48
"""Corners of the area in which a point may be."""
LIKELY_SIGMAS = 3.0
HULL_TOLERANCE = 1e-6
"""mm"""
BAR_LENGTH, BAR_HEIGHT, BAR_STEP, MAX_BARS = 70.0, 3.0, 5.5, 8
"""mm of a whole share, of a bar, from one to the next; and how many are drawn."""
LABEL_SIZE = 7.5


def tolerance_pictures(band: ToleranceBand, scale: Scale | None = None) -> list[Picture]:
    """The band of a result over a motion, of a point's place round its path, and the shares of the greatest variance.

    Raises BadInput for a single position.
    """
    if not isinstance(band.moving, Motion) or not band.has_rows:
        raise BadInput("tolerance", "a band is drawn over a motion, and this is one value")
    is_path = band.result == "position" and band.nominal_rows.shape[1] == 2
    parts = range(band.nominal_rows.shape[1])
    drawn = [_path_picture(band, scale)] if is_path else [_band_picture(band, part) for part in parts]
    return [*drawn, _share_picture(band)]


def _path_picture(band: ToleranceBand, scale: Scale | None) -> Picture:
    motion = band.moving
    assert isinstance(motion, Motion)
    scale = scale or motion_scale(steady_run(motion, steps=len(motion) - 1))
    drawn = loci(motion, [band.of], scale)
    worst = float(np.nanmax(band.worst)) / scale.per_mm
    factor = 1.0 if worst >= BAND_WIDTH or not worst > 0.0 else _round_factor(BAND_WIDTH / worst)
    areas: list[Mark] = []
    for deviations, pen, fill in (
        (band.linear.boundary(DIRECTIONS), Pen.WORST, Fill.WORST),
        (band.statistical.ellipse(DIRECTIONS, LIKELY_SIGMAS), Pen.LIKELY, Fill.LIKELY),
    ):
        corners = (band.nominal_rows[:, None] + factor * deviations) / scale.per_mm
        known: BoolArray = np.asarray(np.isfinite(corners).all(axis=(1, 2)))
        for row in range(len(corners) - 1):
            if known[row] and known[row + 1]:
                both = [Vector(x, y) for x, y in (*corners[row], *corners[row + 1])]
                points = tuple((float(each.x), float(each.y)) for each in convex_hull(both, HULL_TOLERANCE))
                areas.append(Polyline(points, pen, f"{fill.value} band of {band.of}", True, fill))
    units = motion.mechanism.units
    times = "to the same scale" if factor == 1.0 else f"drawn {factor:g} times as wide as it is"
    most = amount(float(np.nanmax(band.worst)), "length", units)
    note = f"Light: worst case, {most} at most; dark: three standard deviations; {times}"
    return Picture((*areas, *drawn.marks), f"{motion.mechanism.name}: where {band.of} may be", (note, *drawn.notes))


def _band_picture(band: ToleranceBand, part: int) -> Picture:
    """The deviation of one part of a result over the motion."""
    motion = band.moving
    assert isinstance(motion, Motion)
    symbol, unit = display_unit(band.kind, motion.mechanism.units)
    abscissa, across_name, is_angle = running_axis(motion)
    lower, upper = (unit.from_si(1.0) * each[:, part] for each in band.linear.limits())
    middle, spread = (unit.from_si(1.0) * each[:, part] for each in (band.statistical.mean, band.statistical.std))
    across = axes.fit_axis(abscissa, DIAGRAM_WIDTH, across_name, end_at_ticks=False, degrees=is_angle)
    seen = axes.without_outliers(np.concatenate([lower, upper]))
    what = band.result.replace("_", " ")
    if band.nominal_rows.shape[1] > 1:
        what = f"{'xy'[part]} of the {what}"
    up = axes.fit_axis(np.append(seen, 0.0), DIAGRAM_HEIGHT, f"deviation of {what} ({symbol})", 9.0)
    marks: list[Mark] = []
    for low, high, pen, fill in (
        (lower, upper, Pen.WORST, Fill.WORST),
        (middle - LIKELY_SIGMAS * spread, middle + LIKELY_SIGMAS * spread, Pen.LIKELY, Fill.LIKELY),
    ):
        marks += _strip(abscissa, low, high, across, up, pen, fill)
    marks += axes.axes_frame(across, up)
    most = float(np.nanmax(np.abs([band.linear.limits()[0][:, part], band.linear.limits()[1][:, part]])))
    note = (
        f"Light: worst case, {amount(most, band.kind, motion.mechanism.units)} at most; dark: three standard deviations"
    )
    return Picture(tuple(marks), f"{motion.mechanism.name}: how far the {what} of {band.of} may be off", (note,))


def _strip(x: Array, low: Array, high: Array, across: axes.Axis, up: axes.Axis, pen: Pen, fill: Fill) -> list[Mark]:
    """The area between two curves, in pieces where one is missing or beyond the axes."""
    known = np.isfinite(low) & np.isfinite(high) & (low >= up.low) & (high <= up.high)
    found: list[Mark] = []
    for piece in np.split(np.arange(len(x)), np.flatnonzero(np.diff(known)) + 1):
        if len(piece) > 1 and known[piece[0]]:
            there = [axes.point_on_paper(x[k], high[k], across, up) for k in piece]
            back = [axes.point_on_paper(x[k], low[k], across, up) for k in piece[::-1]]
            found.append(Polyline((*there, *back), pen, f"{fill.value} band", True, fill))
    return found


def _share_picture(band: ToleranceBand) -> Picture:
    """The shares of the variance where the worst case is greatest, the greatest first."""
    shares = {name: float(np.atleast_1d(part)[band.row]) for name, part in band.contribution.items()}
    ordered = sorted(shares.items(), key=lambda each: -each[1])[:MAX_BARS]
    marks: list[Mark] = []
    for k, (name, share) in enumerate(ordered):
        low = -k * BAR_STEP
        right = BAR_LENGTH * share
        corners = ((0.0, low), (right, low), (right, low + BAR_HEIGHT), (0.0, low + BAR_HEIGHT))
        marks.append(Polyline(corners, Pen.AXIS, f"share of {name}", True, Fill.LIKELY))
        middle = low + 0.5 * BAR_HEIGHT
        marks.append(Label(name, (0.0, middle), f"label {name}", LABEL_SIZE, 1.2, side=(-1, 0)))
        text = f"{100.0 * share:.3g} %"
        marks.append(Label(text, (right, middle), f"number of {name}", LABEL_SIZE, 1.2, side=(1, 0)))
    motion = band.moving
    assert isinstance(motion, Motion)
    name = motion.running_input
    place = amount(float(motion.inputs[name].position[band.row]), _input_kind(band), motion.mechanism.units)
    note = f"Where the worst case is greatest, {name} = {place}; tighten the uppermost first"
    return Picture(tuple(marks), "Shares of the variance", (note,))


def _input_kind(band: ToleranceBand) -> str:
    motion = band.moving
    assert isinstance(motion, Motion)
    return motion._relative_motions[motion.running_input].input_kind.value


def _round_factor(least: float) -> float:
    """The next of 1, 2, 5, 10, 20, ... from a number on."""
    power = 10.0 ** np.floor(np.log10(least))
    return float(next(each * power for each in (1.0, 2.0, 5.0, 10.0) if each * power >= least * (1.0 - 1e-12)))
