"""Dimensions found from measurements as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import floor, isfinite, log10
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.calibration.calibration import Calibration
from planar.document.dimensions import file_dimensions
from planar.foundation.arrays import Array
from planar.foundation.errors import join_names
from planar.model.file_units import display_unit
from planar.model.wording import amount, count_phrase
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import format_number, paragraphs

MAX_OUTLIERS = 12
"""Outliers that are listed."""
MAX_PLACES = 9
"""Decimals that are shown."""


def table(found: Calibration, lines: Sequence[int] = (), unused: Sequence[str] = ()) -> RenderableType:
    """The numbers with their standard deviations, the residuals, and what is said; `lines` are those of a file."""
    head = [Text(found.mechanism.name, style="bold")]
    timed = "at given positions of the input" if found.is_timed else "anywhere on the path"
    head.append(Text(f"{count_phrase(found.measurement.many, 'sample')} {timed}; {found.evaluations} evaluations"))
    parts: list[RenderableType] = [*head, Text(), _numbers_table(found), Text(), _residuals_table(found)]
    told = list(_remarks(found, lines, unused))
    return Group(*parts, Text(), paragraphs((" -", sentence) for sentence in told)) if told else Group(*parts)


def rounded(value: float, deviation: float) -> str:
    """A number to the place of the second digit of its standard deviation."""
    if not isfinite(deviation) or deviation <= 0.0:
        return format_number(value)
    places = 1 - floor(log10(deviation))
    if places > MAX_PLACES:
        return format_number(value)
    return f"{value:.{places}f}" if places > 0 else f"{round(value, places):.0f}"


def _numbers_table(found: Calibration) -> FittedTable:
    units, known = found.mechanism.units, file_dimensions(found.start)
    shown = plain_table("Numbers of the file", "number", "before", "fitted", "standard deviation", "unit", "")
    for name, value in found.values.items():
        kind, deviation = known[name].kind, found.deviations[name]
        label, of = display_unit(kind, units)
        before, after, spread = of.from_si(known[name].value), of.from_si(value), of.from_si(deviation)
        is_fixed = isfinite(deviation)
        told = "" if is_fixed or found.degrees_of_freedom <= 0 else "not determined"
        cells = (format_number(before), rounded(after, spread), f"{spread:.2g}" if is_fixed else "")
        shown.add_row(name, *cells, label, told)
    return shown


def _residuals_table(found: Calibration) -> FittedTable:
    units = found.mechanism.units
    shown = plain_table("Measured less shown", "of", "samples", "root mean square", "greatest", "at")
    for series, (name, each) in zip(found.measurement.series, found.residuals.items(), strict=True):
        kind = series.kind
        sizes = np.linalg.norm(each, axis=1) if each.ndim == 2 else np.abs(each)
        if not np.isfinite(sizes).any():
            continue
        rms, row = float(np.sqrt(np.nanmean(sizes**2))), int(np.nanargmax(sizes))
        least, most = amount(rms, kind, units), amount(float(sizes[row]), kind, units)
        shown.add_row(name, str(int(np.isfinite(sizes).sum())), least, most, f"sample {row + 1}")
    return shown


def _remarks(found: Calibration, lines: Sequence[int], unused: Sequence[str]) -> Iterator[str]:
    yield from (each.sentence for each in found.unidentified)
    for each in found.outliers[:MAX_OUTLIERS]:
        where = f"line {lines[each.row]}" if lines else f"sample {each.row + 1}"
        yield f"{where} does not fit the rest: {each.of} is off by {each.studentised:.1f} standard deviations"
    if len(found.outliers) > MAX_OUTLIERS:
        yield f"{len(found.outliers) - MAX_OUTLIERS} more samples do not fit"
    if isfinite(found.residual_deviation) and found.measurement.has_deviations:
        yield f"residuals are {found.residual_deviation:.3g} times as great as the given standard deviations"
    yield from found.remarks
    if unused:
        yield f"columns that are not used: {join_names(unused, 4)}"


def record(found: Calibration, lines: Sequence[int] = (), unused: Sequence[str] = ()) -> dict[str, Any]:
    """The result as JSON values (SI), `null` where there is none."""
    return {
        "mechanism": found.mechanism.name,
        "samples": found.measurement.many,
        "timed": found.is_timed,
        "values": dict(found.values),
        "deviations": {name: _number(each) for name, each in found.deviations.items()},
        "covariance": _numbers(found.covariance),
        "residuals": {name: _numbers(each) for name, each in found.residuals.items()},
        "inputs": {name: _numbers(each) for name, each in found.inputs.items()},
        "residual_deviation": _number(found.residual_deviation),
        "degrees_of_freedom": found.degrees_of_freedom,
        "unidentified": [{"numbers": dict(each.numbers), "sentence": each.sentence} for each in found.unidentified],
        "outliers": [each._asdict() | ({"line": lines[each.row]} if lines else {}) for each in found.outliers],
        "singular_values": _numbers(found.singular_values),
        "evaluations": found.evaluations,
        "remarks": list(found.remarks),
        "unused": list(unused),
    }


def _number(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def _numbers(values: Array) -> Any:
    told: Array = np.asarray(values, dtype=float).astype(object)
    told[~np.isfinite(np.asarray(values, dtype=float))] = None
    return told.tolist()
