"""Answers about a motion (strokes, time ratios, extremes, dwells) as tables for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.motion.answers import Answers
from planar.analysis.motion.output import Axis, Extreme
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits, display_unit, unit_by_input
from planar.model.wording import REST_TOLERANCE, amount, count_phrase
from planar.reports.fitted_table import plain_table
from planar.reports.number_format import DIGITS
from planar.reports.tables.forces.mechanical_advantage import advantage_unit
from planar.results.motion import Motion

AnswerRow = tuple[str, str, str, str]


def tables(motion: Motion, asked: Mapping[str, Sequence[Answers]]) -> RenderableType:
    """A table for every pair, link and point asked for: what is told, how much, and where it is."""
    parts: list[RenderableType] = []
    for each in (one for group in asked.values() for one in group):
        units = motion.mechanism.units
        position = _PositionFormatter(motion.has_length_motion(each.input), units)
        table = plain_table(
            f"Answers of {each.what} {each.of}", "what", "value", f"at {each.input}", "", left=(0, 1, 2, 3)
        )
        for row in (
            *_range_rows(each, units, position),
            *_rate_rows(each, units, position),
            *_use_rows(each, units, position),
        ):
            table.add_row(*row)
        parts += [Text(), table, *(Text(f"- {note}") for note in each.notes)]
    return Group(*parts)


class _PositionFormatter:
    """Says positions of the running input in the units of the file."""

    def __init__(self, slides: bool, units: FileUnits):
        self.kind, self.units = "length" if slides else "angle", units
        # an angle is told beside a radian; nothing tells how large a slide's positions are
        self.least = 0.0 if slides else REST_TOLERANCE

    def __call__(self, *positions: float) -> str:
        name = self.units.length if self.kind == "length" else self.units.angle
        told = [f"{parse_unit(name).from_si(each if abs(each) > self.least else 0.0) + 0.0:.6g}" for each in positions]
        return f"{' to '.join(told)} {name}"


def _range_rows(each: Answers, units: FileUnits, position: _PositionFormatter) -> Iterator[AnswerRow]:
    """Stroke, swing, extreme positions, time ratio, dwells."""
    kind = "length" if each.length else "angle"
    if each.stroke is not None:
        stroke = each.stroke
        yield "stroke", amount(stroke.length, "length", units), "", ""
        words = ("greatest", "least") if stroke.top.value > stroke.bottom.value else ("least", "greatest")
        for word, centre, end, turns in zip(
            words, ("TDC", "BDC"), (stroke.top, stroke.bottom), stroke.turning, strict=True
        ):
            yield (
                f"  {centre if turns else word}",
                amount(end.value, "length", units, stroke.length),
                position(end.input),
                _end_text(turns),
            )
    if each.swing is not None:
        swing = each.swing
        yield "swing", amount(swing.angle, "angle", units), "", ""
        for word, end, turns in zip(("least", "greatest"), (swing.least, swing.greatest), swing.turning, strict=True):
            yield f"  {word} angle", amount(end.value, "angle", units, 1.0), position(end.input), _end_text(turns)
    for one in each.extremes:
        for word, end, turns in (("least", one.least, one.turning[0]), ("greatest", one.greatest, one.turning[1])):
            where = _end_text(turns) if one.length else ""
            size = max(abs(one.least.value), abs(one.greatest.value))
            yield f"{word} {one.axis}", amount(end.value, "length", units, size), position(end.input), where
        if one.length:
            yield f"range of {one.axis}", amount(one.length, "length", units), "", ""
    if each.time_ratio is not None:
        ratio = each.time_ratio
        yield "time ratio", f"{ratio.ratio:.{DIGITS}g}", "", ""
        for word, way in (("to the greatest", ratio.out), ("to the least", ratio.back)):
            took = "" if each.per_unit else f"{way.time:.{DIGITS}g} s"
            yield f"  {word}", position(way.travel), position(way.start.input, way.stop.input), took
    for axis, dwell in each.dwells:
        near = f"within {amount(dwell.within, kind, units)} of {amount(dwell.at.value, kind, units, dwell.within)}"
        yield f"dwell{_axis_suffix(axis)}", position(dwell.travel), position(dwell.start, dwell.stop), near


def _rate_rows(each: Answers, units: FileUnits, position: _PositionFormatter) -> Iterator[AnswerRow]:
    for order, word, found in ((1, "velocity", each.velocity), (2, "acceleration", each.acceleration)):
        if each.per_unit:
            measure, scale = unit_by_input(each.length, order, position.kind == "length", units)
        else:
            measure, of = display_unit(word if each.length else f"angular {word}", units)
            scale = of.from_si(1.0)
        if found is not None and np.isfinite(found.value):
            yield f"greatest {word}", f"{found.value * scale:.{DIGITS}g} {measure}", position(found.input), ""
        elif found is not None:
            told = "beyond all bounds" if found.value > 0.0 else "not determined"
            yield f"greatest {word}", told, position(found.input), ""


def _use_rows(each: Answers, units: FileUnits, position: _PositionFormatter) -> Iterator[AnswerRow]:
    """Area, transmission angle, mechanical advantage."""
    if each.area is not None:
        name, of = display_unit("area", units)
        value = of.from_si(each.area.value) if abs(each.area.value) > each.area.error else 0.0
        if not each.area.crossings:
            yield "area of its curve", f"{value:.{DIGITS}g} {name}", "", "anticlockwise positive"
        else:
            crossings = count_phrase(each.area.crossings, "crossing")
            yield "net area of its curve", f"{value:.{DIGITS}g} {name}", "", f"{crossings}; anticlockwise positive"
            loops = [of.from_si(loop) for loop in each.area.loops]
            listed = ", ".join(f"{loop:.{DIGITS}g}" for loop in loops)
            yield "  loops, sum of sizes", f"{sum(map(abs, loops)):.{DIGITS}g} {name}", "", listed
    if each.transmission is not None and each.transmission.least is not None:
        least = each.transmission.least
        through = f"driven at {' and '.join(each.transmission.through)}"
        yield "least transmission angle", amount(least.value, "angle", units), position(least.input), through
    if each.advantage is not None:
        found = each.advantage
        measure, by = advantage_unit(found.measure, units)
        told = f"{found.least.value * by:.{DIGITS}g}" + (f" {measure}" if measure else "")
        yield "least mechanical advantage", told, position(found.least.input), ""
        for place in found.infinite:
            yield "  beyond all bounds", "", position(place), ""


def _end_text(turns_back: bool) -> str:
    """What an extreme is."""
    return "turns back" if turns_back else "end of the range"


def _axis_suffix(axis: Axis | None) -> str:
    return "" if axis is None else f" of {axis}"


def record(asked: Mapping[str, Iterable[Answers]]) -> dict[str, Any]:
    """All of it as a JSON value in SI: by name, then by what bears it; what is infinite or not determined is null."""
    return {name: {each.what: _answers_record(each) for each in group} for name, group in asked.items()}


def _answers_record(each: Answers) -> dict[str, Any]:
    found = {name: _to_json(getattr(each, name)) for name in each.__dataclass_fields__ if name not in ("of", "what")}
    found["extremes"] = {str(one.axis): _to_json(one) for one in each.extremes}
    found["dwells"] = [{"axis": axis} | _to_json(dwell) for axis, dwell in each.dwells]
    return {name: value for name, value in found.items() if value not in (None, {}, [])} | {"notes": list(each.notes)}


def _to_json(value: Any) -> Any:
    """A value that JSON has: of a named tuple an object."""
    if isinstance(value, Extreme) or hasattr(value, "_asdict"):
        return {name: _to_json(part) for name, part in value._asdict().items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_to_json(part) for part in (value.tolist() if isinstance(value, np.ndarray) else value)]
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value
