"""What a little more of each number of the file does to a result, over the motion."""

from __future__ import annotations

import numpy as np

from planar.analysis.sensitivity.sensitivity import INFLUENCE_STEP, Sensitivity
from planar.drawing.diagrams import axes
from planar.drawing.diagrams.running_axis import running_axis
from planar.drawing.paper.picture import Label, Mark, Pen, Picture, Polyline
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.file_units import display_unit
from planar.model.wording import amount
from planar.results.motion import Motion

DIAGRAM_WIDTH, DIAGRAM_HEIGHT = 150.0, 90.0
"""mm between the axes."""
MAX_CURVES = 6
"""Numbers of the greatest influence that are drawn."""
LABEL_SIZE, LABEL_GAP = 7.5, 5.0
"""Points; and mm between the labels of two curves."""
LEADER_LENGTH = 6.0
"""mm from the end of a curve to its label, where labels would stand on each other."""


def sensitivity_picture(found: Sensitivity, result: str | None = None) -> Picture:
    """The effects of the numbers of greatest influence on a result (left out: the first) over a motion.

    Strokes are `about` the numbers' names. Raises BadInput for a single position, another result, and where no number
    has an influence.
    """
    motion, name = found.moving, result or next(iter(found.slopes))
    if not isinstance(motion, Motion):
        raise BadInput("sensitivity", "curves are drawn over a motion, and this is one position")
    if name not in found.slopes:
        raise BadInput("result", f"of {found.of!r} are told {', '.join(found.slopes)}, and no {name!r}")
    influences = found.influences(name)[:MAX_CURVES]
    if not influences:
        raise BadInput(found.of, "no number of the file has an influence on it")
    units, kind = motion.mechanism.units, found.kinds[name]
    symbol, of = display_unit(kind, units)
    abscissa, across_name, is_angle = running_axis(motion)
    curves: dict[str, Array] = {}
    for each in influences:
        slopes = np.asarray(found.slopes[name][each.dimension])
        rows = np.linalg.norm(slopes, axis=1) if slopes.ndim > 1 else slopes
        step = each.effect / abs(each.slope) if each.slope else 0.0
        curves[each.dimension] = np.array([of.from_si(float(value) * step) for value in rows])
    seen = axes.without_outliers(np.concatenate(list(curves.values()))).reshape(len(curves), -1)
    across = axes.fit_axis(abscissa, DIAGRAM_WIDTH, across_name, end_at_ticks=False, degrees=is_angle)
    what = name.replace("_", " ")
    up = axes.fit_axis(np.append(seen.ravel(), 0.0), DIAGRAM_HEIGHT, f"change of {what} ({symbol})", 9.0)
    strokes: list[Mark] = [*axes.axes_frame(across, up)]
    for k, (number, values) in enumerate(zip(curves, seen, strict=True)):
        strokes += axes.curve_strokes(abscissa, values, across, up, Pen.CURVE if k == 0 else Pen.SHARE, number)
    strokes += _labels(dict(zip(curves, seen, strict=True)), up)
    size = found.size
    length, angle = (amount(INFLUENCE_STEP * step, k, units) for step, k in ((size, "length"), (1.0, "angle")))
    notes = [f"by {length} more of a length, {angle} of an angle, 0.1 % of any other number, one at a time"]
    if np.isnan(seen).any():
        notes.append("where a curve is missing it grows beyond the others, as towards a dead point")
    return Picture(tuple(strokes), f"{motion.mechanism.name}: {what} of {found.of}", tuple(notes))


def _labels(curves: dict[str, Array], up: axes.Axis) -> list[Mark]:
    """The numbers' names to the right, each beside its curve's end, one above the other."""
    ends = {}
    for number, values in curves.items():
        known = values[np.isfinite(values)]
        ends[number] = float(up.on_paper(known[-1])) if len(known) else 0.0
    order = sorted(ends, key=lambda number: ends[number])
    heights: dict[str, float] = {}
    low = -np.inf
    for number in order:
        heights[number] = low = max(ends[number], low + LABEL_GAP)
    if heights == ends:
        return [_label(number, DIAGRAM_WIDTH, ends[number]) for number in order]
    at = DIAGRAM_WIDTH + LEADER_LENGTH
    leaders = [
        Polyline(((DIAGRAM_WIDTH, ends[number]), (at, heights[number])), Pen.LEADER, f"leader {number}")
        for number in order
    ]
    return [*leaders, *(_label(number, at, heights[number]) for number in order)]


def _label(number: str, at: float, height: float) -> Label:
    return Label(number, (at, height), f"label {number}", LABEL_SIZE, 1.2, side=(1, 0))
