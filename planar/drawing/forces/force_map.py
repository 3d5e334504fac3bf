"""What an input supplies over one or two inputs: a curve, or lines of equal effort on a map."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from planar.analysis.force_maps.force_map import ForceMap
from planar.drawing.diagrams import axes
from planar.drawing.paper.picture import Circle, Fill, Label, Mark, Pen, Picture, Polyline, paper_point
from planar.drawing.paper.scales import DECIMAL_STEPS, round_step, unit_for_size
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, join_names
from planar.foundation.units import parse_unit
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind
from planar.model.wording import amount

MAP_WIDTH, MAP_HEIGHT = 130.0, 110.0
"""mm between the axes."""
LINES = 10
"""Lines of equal effort, about."""
LABEL_SIZE, MARK_RADIUS = 7.0, 0.9
"""Points; mm."""
UNREACHED_RADIUS = 0.35
"""mm: the dot at a position that is not reached."""


def force_map_picture(found: ForceMap, of: str | None = None) -> Picture:
    """The effort of an input (left out: the first of the map) over the first two inputs of a map, the others in the
    middle of their ranges.

    Strokes are `about` "effort 20 kN" for each line and "greatest", "least"; places that are not reached have dots.
    Raises BadInput for another input, and where no effort is told.
    """
    names = [*found.over]
    name = of or names[0]
    if name not in found.effort:
        raise BadInput(name, f"there is no input of this name; inputs are at {join_names(found.effort)}")
    middle = tuple(len(each) // 2 for each in list(found.over.values())[2:])
    values = found.effort[name][(slice(None),) * min(len(names), 2) + middle]
    if not np.isfinite(values).any():
        raise BadInput(name, "what it supplies is told at no position of the map")
    mechanism = found.mechanism
    kind = "force" if found.forces.is_force_input(name) else "torque"
    shown = _without_outliers(values)
    unit, per = unit_for_size(kind, float(np.nanmax(np.abs(shown))), mechanism.units)
    along = [_axis_values(found, each) for each in names[:2]]
    across = axes.fit_axis(along[0][0], MAP_WIDTH, along[0][1], end_at_ticks=False, degrees=along[0][2])
    notes = [f"others: {', '.join(_held_positions(found, names[2:], middle))}"] if middle else []
    if len(names) == 1:
        up = axes.fit_axis(shown / per, MAP_HEIGHT, f"{kind} of {name} ({unit})", 9.0)
        strokes = [
            *axes.axes_frame(across, up),
            *axes.curve_strokes(along[0][0], shown / per, across, up, Pen.CURVE, "effort"),
        ]
        return Picture(tuple(strokes), f"{mechanism.name}: {kind} of {name}", tuple(notes))
    up = axes.fit_axis(along[1][0], MAP_HEIGHT, along[1][1], 9.0, end_at_ticks=False, degrees=along[1][2])
    places = along[0][0], along[1][0]
    strokes = [*axes.axes_frame(across, up), *_unreached(places, values, across, up)]
    strokes += _equal_lines(places, shown / per, across, up, unit)
    strokes += _extremes(
        found, name, across, up, {each: scale for each, (_, _, _, scale) in zip(names, along, strict=False)}
    )
    notes += [f"lines of equal {kind} in {unit}; dots: not reached"] if np.isnan(values).any() else [f"in {unit}"]
    notes += [
        f"{each.kind} {each.remark}"
        for each in found.worst
        if each.of == name and each.remark and "effort" in each.kind
    ]
    return Picture(tuple(strokes), f"{mechanism.name}: {kind} of {name}", tuple(notes))


def _without_outliers(values: Array) -> Array:
    """The same with what grows beyond all the rest, as beside a dead point, left out."""
    found: Array = axes.without_outliers(values.ravel()).reshape(values.shape)
    return found


def _axis_values(found: ForceMap, name: str) -> tuple[Array, str, bool, float]:
    """The positions of an input in its unit, the name of the axis, whether it is an angle, and SI per unit."""
    if relative_motions(found.mechanism)[name].input_kind is MeasureKind.ANGLE:
        return np.degrees(found.over[name]), f"{name} (°)", True, float(np.pi / 180.0)
    unit = found.mechanism.units.length
    per = parse_unit(unit).to_si(1.0)
    return found.over[name] / per, f"{name} ({unit})", False, per


def _held_positions(found: ForceMap, names: list[str], middle: tuple[int, ...]) -> Iterator[str]:
    for name, k in zip(names, middle, strict=True):
        kind = relative_motions(found.mechanism)[name].input_kind.value
        yield f"{name} = {amount(float(found.over[name][k]), kind, found.mechanism.units)}"


def _unreached(places: tuple[Array, Array], values: Array, across: axes.Axis, up: axes.Axis) -> Iterator[Mark]:
    for i, j in np.argwhere(np.isnan(values)):
        at = axes.point_on_paper(float(places[0][i]), float(places[1][j]), across, up)
        yield Circle(at, UNREACHED_RADIUS, Pen.CONSTRUCTION, "not reached", Fill.PAPER)


def _equal_lines(
    places: tuple[Array, Array], values: Array, across: axes.Axis, up: axes.Axis, unit: str
) -> Iterator[Mark]:
    """Lines of equal effort at round numbers, each with its number where it is longest."""
    from contourpy import contour_generator

    known = np.ma.masked_invalid(_without_outliers(values).T)
    low, high = float(known.min()), float(known.max())
    if high - low <= axes.FLAT_TOLERANCE * max(abs(low), abs(high)):
        return
    few, many = np.quantile(known.compressed(), (0.05, 0.95))
    step = round_step(float(many - few or high - low) / LINES, DECIMAL_STEPS)
    lines = contour_generator(*places, known)
    for k in range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1):
        level = k * step
        longest: Array = np.zeros((0, 2))
        for line in lines.lines(level):
            on_paper = np.array([axes.point_on_paper(float(x), float(y), across, up) for x, y in np.asarray(line)])
            pen = Pen.CURVE if k == 0 else Pen.SHARE
            yield Polyline(tuple(map(paper_point, on_paper)), pen, f"effort {axes.format_number(level)} {unit}")
            longest = on_paper if _length(on_paper) > _length(longest) else longest
        if len(longest):
            yield Label(
                axes.format_number(level), paper_point(longest[len(longest) // 2]), f"number {k}", LABEL_SIZE, 0.6
            )


def _length(line: Array) -> float:
    return float(np.hypot(*np.diff(line, axis=0).T).sum()) if len(line) > 1 else 0.0


def _extremes(
    found: ForceMap, name: str, across: axes.Axis, up: axes.Axis, scales: Mapping[str, float]
) -> Iterator[Mark]:
    """The greatest and the least effort where they have a bound, if they lie on this map."""
    (first, by_first), (second, by_second) = scales.items()
    for each in found.worst:
        if each.of == name and "effort" in each.kind and not each.is_unbounded and len(found.over) == 2:
            at = axes.point_on_paper(each.at[first] / by_first, each.at[second] / by_second, across, up)
            yield Circle(at, MARK_RADIUS, Pen.CURVE, each.kind, Fill.SOLID)
            yield Label(each.kind.split()[0], at, f"label {each.kind}", LABEL_SIZE, 1.2)
