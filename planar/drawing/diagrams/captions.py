"""What is written below kinematic diagrams: where they start, their scales, their greatest values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.drawing.diagrams.drawn_run import DrawnRun
from planar.drawing.diagrams.motion_curves import ChordRates, DiagramSubject, MotionCurve, Peak, chord_rates, find_peak
from planar.drawing.labels.text_metrics import text_size, wrap_text
from planar.drawing.paper.scales import Scale, format_calculating_scale, paper_length
from planar.foundation.arrays import Array
from planar.foundation.errors import join_names
from planar.foundation.units import format_unit, parse_unit
from planar.model.file_units import FileUnits, coherent_unit, display_unit, rate_length
from planar.model.wording import amount

END_MARGIN = 0.1
"""Part of the run beside an end where rates grow without bound that no ordinate is made for."""


class Ordinate(NamedTuple):
    """One diagram's vertical axis: symbol, scale, the unit that is written, and its ends in mm from the zero line."""

    name: str
    symbol: str
    scale: Scale
    unit_name: str
    si_unit: str
    low: float
    high: float
    si_factor: float
    "how many of the unit `si` are one in SI, which it is but for inches and the like"


class HeldIntervals(NamedTuple):
    """The intervals of time (s) in which friction holds pairs."""

    pairs: tuple[str, ...]
    intervals: tuple[tuple[float, float], ...]


class DiagramSheet(NamedTuple):
    """Everything that the diagrams of one run show."""

    run: DrawnRun
    subject: DiagramSubject
    units: FileUnits
    width: float
    interval_count: int
    chords: int | None
    held: HeldIntervals | None = None

    @property
    def span(self) -> float:
        """The time (s) that the axis is long."""
        return float(self.run.time[-1])

    def on_axis(self, time: float) -> float:
        """mm along the time axis."""
        return time / self.span * self.width


def bounded_values(time: Array, values: Array, curve: MotionCurve) -> Array:
    """The part of a curve that an ordinate is made for: not what grows without bound beside an end of the range."""
    if values is curve.value:
        return values
    start, end = (np.isnan(curve.rate[row]) for row in (0, -1))
    kept = (time >= time[-1] * END_MARGIN * start) & (time <= time[-1] * (1.0 - END_MARGIN * end))
    return values[kept]


def has_unbounded_end(sheet: DiagramSheet) -> bool:
    """Whether the run comes to an end at which no rates exist."""
    return any(np.isnan(curve.rate[[0, -1]]).any() for curve in sheet.subject.curves)


def caption_lines(
    sheets: Sequence[DiagramSheet], ordinates: Sequence[Sequence[Ordinate]], points: float, room: float
) -> list[tuple[str, bool]]:
    """The lines below the diagrams, at most `room` mm long; each with whether it is mathtext.

    `ordinates` are the three of each sheet; the sheets are of one run.
    """
    sheet = sheets[0]
    lines = [(line, False) for line in wrap_text(_start_sentence(sheets), points, room)]
    lines += [(line, True) for line in _fill_lines(_scale_phrases(sheets, ordinates), points, room)]
    if sheet.held is not None and sheet.held.intervals:
        shaded = f"Shaded: friction holds {join_names(sheet.held.pairs, last_joiner=' or ')}."
        lines += [(line, False) for line in wrap_text(shaded, points, room)]
    if any(map(has_unbounded_end, sheets)):
        ends = "At an end of the range, a dead or change point, no rates exist; what grows without bound is cut off."
        lines += [(line, False) for line in wrap_text(ends, points, room)]
    sentences = [
        line
        for part, three in zip(sheets, ordinates, strict=True)
        for index in (1, 2)
        for line in _peak_sentences(part, three[index], index)
    ]
    if sheet.chords is not None:
        sentences += [_chord_scale_sentence(part, three) for part, three in zip(sheets, ordinates, strict=True)]
    return lines + [(line, True) for text in sentences for line in _fill_lines(text.split(" "), points, room)]


def _fill_lines(parts: Sequence[str], points: float, room: float) -> list[str]:
    """Parts of a mathtext, such as its words, in lines of at most so many mm; a formula has no space in it."""
    lines: list[str] = []
    for part in parts:
        longer = f"{lines[-1]} {part}" if lines else part
        if lines and text_size(longer, points, math=True).width <= room:
            lines[-1] = longer
        else:
            lines.append(part)
    return lines


def _start_sentence(sheets: Sequence[DiagramSheet]) -> str:
    """Where position 0 is, and at what speed the input runs."""
    run, units = sheets[0].run, sheets[0].units
    kind = "length" if run.is_sliding_input else "angle"
    at = f"input {run.input.pair} at {amount(run.start_position, kind, units)}"
    start = f"top dead centre (TDC) of {run.stroke.pair}, {at}" if run.starts_at_top and run.stroke else at
    told = f"Position 0: {start}"
    if not run.is_time_run:
        told += (
            f"; {_travel_symbol(run)} is how far the input has "
            f"{'moved' if run.is_sliding_input else 'turned'} from there"
        )
    told += ". " + "".join(_origin_sentence(sheet) for sheet in sheets)
    if run.is_time_run:
        return f"{told}A motion in time."
    if not run.has_speed:
        return (
            f"{told}The file gives no speed: rates are per "
            f"{_length_word(units) if run.is_sliding_input else 'radian'} of the input."
        )
    rates = ("velocity", "acceleration") if run.is_sliding_input else ("angular velocity", "angular acceleration")
    (speed, of), (second, of_second) = (display_unit(kind, units) for kind in rates)
    told += f"Steady speed {of.from_si(abs(run.rate)):.6g} {speed}"
    if run.input.acceleration:
        told += f"; the acceleration in the file, {of_second.from_si(run.input.acceleration):.6g} {second}, is left out"
    return f"{told}."


def _origin_sentence(sheet: DiagramSheet) -> str:
    """From where the displacements of a sheet are measured, where the start of the run does not say it."""
    if sheet.subject.is_angle:
        return "φ is from the x-axis of the frame. "
    from_top = [curve.subject for curve in sheet.subject.curves if curve.from_top]
    if not from_top:
        return "Displacements are from position 0. "
    if len(sheet.subject.curves) == 1:
        return "" if sheet.run.starts_at_top else "S is from TDC. "
    if len(from_top) == len(sheet.subject.curves):
        return "S of each slide is from its own top dead centre. "
    return f"S of {join_names(from_top)} is from top dead centre, other displacements are from position 0. "


def _length_word(units: FileUnits) -> str:
    """The length by which rates are told where no time is, in a word."""
    name = rate_length(units)[0]
    return "metre" if name == "m" else name


def _scale_phrases(sheets: Sequence[DiagramSheet], ordinates: Sequence[Sequence[Ordinate]]) -> list[str]:
    """The length of the axis and the calculating scales, in SI units to a millimetre, of inches in these to an inch."""
    sheet = sheets[0]
    run = sheet.run
    parts = [f"Scales: OK = {paper_length(sheet.width, sheet.units)}"]
    if run.has_speed:
        parts.append(_calculating_scale("t", sheet.span / sheet.width, "s", sheet.units))
    if not run.is_time_run:
        name, of = rate_length(sheet.units) if run.is_sliding_input else coherent_unit("rad")
        per_mm = of.from_si(float(run.input_travel[-1])) / sheet.width
        parts.append(_calculating_scale(_travel_symbol(run), per_mm, name, sheet.units))
    parts += [
        _calculating_scale(name, ordinate.scale.per_mm * ordinate.si_factor, ordinate.si_unit, sheet.units)
        for part, three in zip(sheets, ordinates, strict=True)
        for name, ordinate in zip(_scale_subscripts(part), three, strict=True)
    ]
    return [*(f"{part}," for part in parts[:-1]), f"{parts[-1]}."]


def _scale_subscripts(sheet: DiagramSheet) -> tuple[str, ...]:
    """The letters by which the scales of the three diagrams are told apart."""
    return ("φ", "ω", "ε") if sheet.subject.is_angle else ("s", "v", "a")


def _calculating_scale(symbol: str, per_mm: float, unit_name: str, units: FileUnits) -> str:
    return format_calculating_scale(f"$\\mu_{{{symbol}}}$", per_mm, unit_name, units)


def _peak_sentences(sheet: DiagramSheet, ordinate: Ordinate, index: int) -> list[str]:
    """The greatest values, exact and by chords, and how much less the chords give."""
    lines = []
    for curve in sheet.subject.curves:
        exact = (
            find_peak(sheet.run.time, bounded_values(sheet.run.time, curve.derivatives[index], curve))
            if not has_unbounded_end(sheet)
            else None
        )
        name = f"${ordinate.symbol}_{curve.name}$" if curve.name else f"${ordinate.symbol}$"
        if curve.subject:
            name += " of " + curve.subject.replace("$", r"\$")
        written = format_unit(ordinate.si_unit)
        if exact is not None and exact.value == 0.0:
            continue
        told = None
        if exact is not None and np.ptp(curve.derivatives[index]) <= 1e-9 * exact.value:
            lines.append(f"{name} is {exact.value * ordinate.si_factor:.4g} {written} throughout.")
            continue
        if exact is not None:
            told = f"Greatest {name} {exact.value * ordinate.si_factor:.4g} {written} at {_time_text(sheet, exact)}"
        if sheet.chords is not None:
            found = chord_rates(sheet.run, curve.derivatives[index - 1], sheet.chords)
            by_chords = _chord_text(ordinate, curve, found, written, sheet.chords)
            if by_chords is not None:
                told = (
                    f"Greatest {name} {by_chords}"
                    if exact is None or told is None
                    else f"{told}; {by_chords}{_shortfall_text(found, exact)}"
                )
        if told is not None:
            lines.append(f"{told}.")
    return lines


def _time_text(sheet: DiagramSheet, exact: Peak) -> str:
    run = sheet.run
    if run.is_time_run:
        return f"t = {exact.time:.4g} s"
    written = sheet.units.length if run.is_sliding_input else sheet.units.angle
    return f"{_travel_symbol(run)} = {parse_unit(written).from_si(exact.time * abs(run.rate)):.4g} {written}"


def _travel_symbol(run: DrawnRun) -> str:
    """The letter for how far the input has gone."""
    return "s₁" if run.is_sliding_input else "α"


def _index_of_greatest(rates: Array) -> int:
    """The index of the greatest magnitude, the first of those that are alike."""
    sizes = np.nan_to_num(np.abs(rates))
    return int(np.argmax(sizes >= sizes.max() * (1.0 - 1e-9)))


def _chord_text(ordinate: Ordinate, curve: MotionCurve, found: ChordRates, written: str, count: int) -> str | None:
    if not np.isfinite(found.rates).any():
        return None
    at = _index_of_greatest(found.rates)
    letter = f"{ordinate.symbol}_{{{at + 1}{',' + curve.name if curve.name else ''}}}"
    return f"by {count} chords {abs(found.rates[at]) * ordinate.si_factor:.4g} {written} ($\\mathit{{{letter}}}$)"


def _shortfall_text(found: ChordRates, exact: Peak) -> str:
    off = 1.0 - abs(float(found.rates[_index_of_greatest(found.rates)])) / exact.value if exact.value else 0.0
    return f", {abs(100.0 * off):.2g} % {'less' if off >= 0.0 else 'more'}"


def _chord_scale_sentence(sheet: DiagramSheet, ordinates: Sequence[Ordinate]) -> str:
    """The scale that a velocity would have if the rises were drawn as they are in the displacements."""
    step = sheet.span / sheet.interval_count
    symbols = _scale_subscripts(sheet)
    per_mm = ordinates[0].scale.per_mm / step
    base = f"$\\mu_{symbols[0]}/(\\mu_t\\cdot$OK$/{sheet.interval_count})$"
    said = _calculating_scale(symbols[1], per_mm * ordinates[1].si_factor, ordinates[1].si_unit, sheet.units).replace(
        " = ", f" = {base} = ", 1
    )
    return f"Rises of {ordinates[0].symbol} drawn as they are would be velocities to the scale {said}."
