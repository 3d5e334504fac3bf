"""Numbers as tables show them: their digits, units in headings, what is rounding, directions of vectors."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from rich.table import Table
from rich.text import Text

from planar.foundation.units import Unit, parse_unit
from planar.model.file_units import FileUnits, display_unit

DIGITS = 6
"""Significant digits printed; `--json` has all of them."""
SIZE_PHRASE = "of the mechanism's size"
ROUND_OFF_THRESHOLD = 1e-10
"""Of what it is told beside: a proof that leaves less is as good as numbers are."""
ROUNDING_RATIO = 1e-12
"""What is less than this part of what it is told beside is printed as 0."""

ZERO_THRESHOLD = 1e-14
"""A number of which it is not known what it is told beside is printed as 0 below this."""
AMONG_POSITIONS = ", among these positions"
"""Said of extreme values and means that are read off the positions of a run, and not solved for between them."""


def paragraphs(rows: Iterable[tuple[str, str]]) -> Table:
    """Paragraphs with what they are about before them."""
    grid = Table.grid(padding=(0, 1))
    for _ in range(3):
        grid.add_column(overflow="fold")
    for about, text in rows:
        grid.add_row("", Text(about), Text(text))
    return grid


def column_heading(name: str, kind: str, units: FileUnits) -> str:
    """The heading of a column: its name and the unit in which its kind of quantity is shown."""
    return f"{name}, {display_unit(kind, units)[0]}"


def _polar_cells(vector: np.ndarray, of: Unit, units: FileUnits, beside: float) -> tuple[str, str]:
    """A vector's magnitude and direction; without a direction where it is round-off of the size beside it."""
    size = float(np.hypot(*vector))
    if size <= max(ROUNDING_RATIO * beside, ZERO_THRESHOLD):
        return "0", ""
    return format_number(of.from_si(size)), format_number(parse_unit(units.angle).from_si(vector_direction(vector)))


def _report_cell(value: float | None, kind: str, units: FileUnits, beside: float) -> str:
    """A quantity (SI), 0 where it is round-off of the size beside it; a dash where there is none."""
    if value is None:
        return "-"
    return format_number(display_unit(kind, units)[1].from_si(value if abs(value) > ROUNDING_RATIO * beside else 0.0))


def vector_direction(vector: np.ndarray) -> float:
    """The direction of a vector (rad), above -pi up to pi; what rounding leaves of a part is none."""
    least = ROUNDING_RATIO * float(np.hypot(*vector))
    x, y = (float(part) if abs(part) > least else 0.0 for part in vector)
    return float(np.arctan2(y, x))


def precision_text(value: float, reference: str = "") -> str:
    """How well something holds that leaves `value` of another thing open: exactly, to round-off, or but for that."""
    beside = f"{value:.1e} {reference}".rstrip()
    return (
        "exactly"
        if value == 0.0
        else f"to round-off ({beside})"
        if value < ROUND_OFF_THRESHOLD
        else f"but for {beside}"
    )


def format_number(value: float) -> str:
    return "0" if abs(value) < ZERO_THRESHOLD else f"{value:#.{DIGITS}g}".rstrip(".")


def format_quantity(value: float | None, kind: str, units: FileUnits, beside: float = 0.0) -> str:
    """A quantity (SI) as a number of the unit in which its kind is shown (see `format_or_zero`)."""
    of = display_unit(kind, units)[1]
    return format_or_zero(None if value is None else of.from_si(value), of.from_si(beside))


def quantity_text(value: float | None, kind: str, units: FileUnits, beside: float = 0.0) -> str:
    """The same with its unit behind it."""
    return f"{format_quantity(value, kind, units, beside)} {display_unit(kind, units)[0]}"


def format_or_zero(value: float | None, beside: float = 0.0) -> str:
    """A number, nothing where it is only what rounding leaves of another beside it; a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "-"
    return f"{value:#.{DIGITS}g}".rstrip(".") if abs(value) > ROUNDING_RATIO * abs(beside) else "0"
