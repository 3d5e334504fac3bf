"""Mechanical advantages as a table for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from planar.analysis.motion.mechanical_advantage import Advantage
from planar.model.file_units import FileUnits, display_unit
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import format_or_zero

Advantages = Mapping[str, Mapping[str, Advantage]]
"""By output and input."""
_ADVANTAGE_KINDS = {"1/m": ("force", "torque"), "m": ("torque", "force")}
"""What is exerted for what; an advantage of like for like has no unit."""


def advantage_unit(measure: str, units: FileUnits) -> tuple[str, float]:
    """The unit of an advantage as it is printed, N per N·m, and how many of it are one in SI."""
    if measure not in _ADVANTAGE_KINDS:
        return "", 1.0
    (over, of_over), (under, of_under) = (display_unit(kind, units) for kind in _ADVANTAGE_KINDS[measure])
    return f"{over} per {under}", of_over.from_si(1.0) / of_under.from_si(1.0)


def all_advantages(advantages: Advantages) -> list[Advantage]:
    """All of them in one list."""
    return [each for row in advantages.values() for each in row.values()]


def advantages_table(ratios: Iterable[Advantage], units: FileUnits) -> FittedTable:
    """What an ideal mechanism exerts at each output for what an input supplies, by both routes."""
    headings = ("output", "along", "for the input", ("by power", "by centres", "unit"), "through")
    table = plain_table("Mechanical advantage", *headings, left=(0, 1, 2, 5, 6), keys=3)
    for each in ratios:
        unit, by = advantage_unit(each.measure, units)
        values = (format_or_zero(None if one is None else one * by) for one in (each.by_power, each.by_centres))
        along = {"path": "its path", "line": "their line"}.get(each.along, each.along)
        table.add_row(each.target, along, each.input, *values, unit, " ".join(each.through))
    return table


def record(advantages: Advantages) -> dict[str, Any]:
    """The same as a JSON value, by output and input."""
    return {
        output: {
            name: {
                "by_power": each.by_power,
                "by_centres": each.by_centres,
                "unit": each.measure,
                "target": each.target,
                "along": each.along,
                "through": list(each.through),
                "why": each.why,
            }
            for name, each in row.items()
        }
        for output, row in advantages.items()
    }
