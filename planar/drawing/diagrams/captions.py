"""What is written below kinematic diagrams: where they start, their scales, their greatest values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.drawing.diagrams.drawn_run import Run
from planar.drawing.diagrams.motion_curves import Chords, Curve, Peak, Subject, chords, peak
from planar.drawing.labels.text_metrics import measured, wrapped
from planar.drawing.paper.scales import Scale
from planar.foundation.units import coherent, length_of_rates, shown, unit
from planar.model.mechanism import Units
from planar.model.wording import amount

Array = np.ndarray

INNER = 0.1
"""Part of the run beside an end where rates grow without bound that no ordinate is made for."""


class Ordinate(NamedTuple):
    """One diagram's vertical axis: symbol, scale, the unit that is written, and its ends in mm from the zero line."""

    name: str
    symbol: str
    scale: Scale
    written: str
    si: str
    low: float
    high: float
    by: float
    "how many of the unit `si` are one in SI, which it is but for inches and the like"


class Sheet(NamedTuple):
    """Everything that the diagrams of one run show."""

    run: Run
    subject: Subject
    units: Units
    width: float
    count: int
    chords: int | None

    @property
    def span(self) -> float:
        """The time (s) that the axis is long."""
        return float(self.run.time[-1])

    def on_axis(self, time: float) -> float:
        """mm along the time axis."""
        return time / self.span * self.width


def inner(time: Array, values: Array, curve: Curve) -> Array:
    """The part of a curve that an ordinate is made for: not what grows without bound beside an end of the range."""
    if values is curve.value:
        return values
    start, end = (np.isnan(curve.rate[row]) for row in (0, -1))
    kept = (time >= time[-1] * INNER * start) & (time <= time[-1] * (1.0 - INNER * end))
    return values[kept]


def endless(sheet: Sheet) -> bool:
    """Whether the run comes to an end at which no rates exist."""
    return any(np.isnan(curve.rate[[0, -1]]).any() for curve in sheet.subject.curves)


def raised(written: str) -> str:
    return written.replace("^2", "²")


def caption(sheet: Sheet, ordinates: list[Ordinate], points: float, room: float) -> list[tuple[str, bool]]:
    """The lines below the diagrams, at most `room` mm long; each with whether it is mathtext."""
    lines = [(line, False) for line in wrapped(_start(sheet), points, room)]
    lines += [(line, True) for line in _filled(_scales(sheet, ordinates), points, room)]
    if endless(sheet):
        told = "At an end of the range, a dead or change point, no rates exist; what grows without bound is cut off."
        lines += [(line, False) for line in wrapped(told, points, room)]
    told = [line for index in (1, 2) for line in _peaks(sheet, ordinates[index], index)]
    if sheet.chords is not None:
        told.append(_chord_scale(sheet, ordinates))
    return lines + [(line, True) for text in told for line in _filled(text.split(" "), points, room)]


def _filled(parts: Sequence[str], points: float, room: float) -> list[str]:
    """Parts of a mathtext, such as its words, in lines of at most so many mm; a formula has no space in it."""
    lines: list[str] = []
    for part in parts:
        longer = f"{lines[-1]} {part}" if lines else part
        if lines and measured(longer, points, math=True).width <= room:
            lines[-1] = longer
        else:
            lines.append(part)
    return lines


def _start(sheet: Sheet) -> str:
    """Where position 0 is, and at what speed the input runs."""
    run, units = sheet.run, sheet.units
    kind = "length" if run.slides else "angle"
    at = f"input {run.given.pair} at {amount(run.first, kind, units)}"
    start = f"top dead centre (TDC) of {run.stroke.pair}, {at}" if run.from_top and run.stroke else at
    told = f"Position 0: {start}"
    if not run.in_time:
        told += f"; {_gone(run)} is how far the input has {'moved' if run.slides else 'turned'} from there"
    told += ". "
    if sheet.subject.angle:
        told += "φ is from the x-axis of the frame. "
    elif run.stroke is None or sheet.subject.slide != run.stroke.pair:
        told += "Displacements are from position 0. "
    elif not run.from_top:
        told += "S is from TDC. "
    if run.in_time:
        return f"{told}A motion in time."
    if not run.timed:
        return f"{told}The file gives no speed: rates are per {'metre' if run.slides else 'radian'} of the input."
    rates = ("velocity", "acceleration") if run.slides else ("angular velocity", "angular acceleration")
    (speed, of), (second, of_second) = (shown(kind, units) for kind in rates)
    told += f"Steady speed {of.from_si(abs(run.rate)):.6g} {speed}"
    if run.given.acceleration:
        told += f"; the acceleration in the file, {of_second.from_si(run.given.acceleration):.6g} {second}, is left out"
    return f"{told}."


def _scales(sheet: Sheet, ordinates: list[Ordinate]) -> list[str]:
    """The length of the axis and the calculating scales, in SI units to a millimetre."""
    run = sheet.run
    parts = [f"Scales: OK = {sheet.width:g} mm"]
    if run.timed:
        parts.append(_mu("t", sheet.span / sheet.width, "s"))
    if not run.in_time:
        name, of = length_of_rates(sheet.units.length) if run.slides else coherent("rad")
        parts.append(_mu(_gone(run), of.from_si(float(run.turned[-1])) / sheet.width, name))
    symbols = _indices(sheet)
    parts += [_mu(name, each.scale.per_mm * each.by, each.si) for name, each in zip(symbols, ordinates, strict=True)]
    return [*(f"{part}," for part in parts[:-1]), f"{parts[-1]}."]


def _indices(sheet: Sheet) -> tuple[str, ...]:
    """The letters by which the scales of the three diagrams are told apart."""
    return ("φ", "ω", "ε") if sheet.subject.angle else ("s", "v", "a")


def _mu(symbol: str, per_mm: float, si: str) -> str:
    si = raised(si)
    return f"$\\mu_{{{symbol}}}$ = {per_mm:.4g} {f'({si})' if '/' in si else si}/mm"


def _peaks(sheet: Sheet, ordinate: Ordinate, index: int) -> list[str]:
    """The greatest values, exact and by chords, and how much less the chords give."""
    lines = []
    for curve in sheet.subject.curves:
        exact = peak(sheet.run.time, inner(sheet.run.time, curve.all[index], curve)) if not endless(sheet) else None
        name = f"${ordinate.symbol}_{curve.name}$" if curve.name else f"${ordinate.symbol}$"
        written = raised(ordinate.si)
        if exact is not None and exact.value == 0.0:
            continue
        told = None
        if exact is not None and np.ptp(curve.all[index]) <= 1e-9 * exact.value:
            lines.append(f"{name} is {exact.value * ordinate.by:.4g} {written} throughout.")
            continue
        if exact is not None:
            told = f"Greatest {name} {exact.value * ordinate.by:.4g} {written} at {_when(sheet, exact)}"
        if sheet.chords is not None:
            found = chords(sheet.run, curve.all[index - 1], sheet.chords)
            by_chords = _by_chords(ordinate, curve, found, written, sheet.chords)
            if by_chords is not None:
                told = (
                    f"Greatest {name} {by_chords}"
                    if exact is None or told is None
                    else f"{told}; {by_chords}{_less(found, exact)}"
                )
        if told is not None:
            lines.append(f"{told}.")
    return lines


def _when(sheet: Sheet, exact: Peak) -> str:
    run = sheet.run
    if run.in_time:
        return f"t = {exact.time:.4g} s"
    written = sheet.units.length if run.slides else sheet.units.angle
    return f"{_gone(run)} = {unit(written).from_si(exact.time * abs(run.rate)):.4g} {written}"


def _gone(run: Run) -> str:
    """The letter for how far the input has gone."""
    return "s₁" if run.slides else "α"


def _greatest(rates: Array) -> int:
    """The index of the greatest magnitude, the first of those that are alike."""
    sizes = np.nan_to_num(np.abs(rates))
    return int(np.argmax(sizes >= sizes.max() * (1.0 - 1e-9)))


def _by_chords(ordinate: Ordinate, curve: Curve, found: Chords, written: str, count: int) -> str | None:
    if not np.isfinite(found.rates).any():
        return None
    at = _greatest(found.rates)
    letter = f"{ordinate.symbol}_{{{at + 1}{',' + curve.name if curve.name else ''}}}"
    return f"by {count} chords {abs(found.rates[at]) * ordinate.by:.4g} {written} ($\\mathit{{{letter}}}$)"


def _less(found: Chords, exact: Peak) -> str:
    off = 1.0 - abs(float(found.rates[_greatest(found.rates)])) / exact.value if exact.value else 0.0
    return f", {abs(100.0 * off):.2g} % {'less' if off >= 0.0 else 'more'}"


def _chord_scale(sheet: Sheet, ordinates: list[Ordinate]) -> str:
    """The scale that a velocity would have if the rises were drawn as they are in the displacements."""
    step = sheet.span / sheet.count
    symbols = _indices(sheet)
    per_mm = ordinates[0].scale.per_mm / step
    base = f"$\\mu_{symbols[0]}/(\\mu_t\\cdot$OK$/{sheet.count})$"
    said = _mu(symbols[1], per_mm * ordinates[1].by, ordinates[1].si).replace(" = ", f" = {base} = ", 1)
    return f"Rises of {ordinates[0].symbol} drawn as they are would be velocities to the scale {said}."
