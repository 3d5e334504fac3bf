"""Mechanical advantages as a table for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from planar.analysis.motion.mechanical_advantage import Advantage
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import format_or_zero

Advantages = Mapping[str, Mapping[str, Advantage]]
"""By output and input."""
ADVANTAGE_UNITS = {"1/m": "N per N·m", "m": "N·m per N", "1": ""}
"""How an advantage's unit is printed; one of like for like has none."""


def all_advantages(advantages: Advantages) -> list[Advantage]:
    """All of them in one list."""
    return [each for row in advantages.values() for each in row.values()]


def advantages_table(ratios: Iterable[Advantage]) -> FittedTable:
    """What an ideal mechanism exerts at each output for what an input supplies, by both routes."""
    headings = ("output", "for the input", ("by power", "by centres", "unit"), "through")
    table = plain_table("Mechanical advantage", *headings, left=(0, 1, 4, 5), keys=2)
    for each in ratios:
        values = format_or_zero(each.by_power), format_or_zero(each.by_centres)
        table.add_row(each.output, each.input, *values, ADVANTAGE_UNITS[each.measure], " ".join(each.through))
    return table


def record(advantages: Advantages) -> dict[str, Any]:
    """The same as a JSON value, by output and input."""
    return {
        output: {
            name: {
                "by_power": each.by_power,
                "by_centres": each.by_centres,
                "unit": each.measure,
                "through": list(each.through),
                "why": each.why,
            }
            for name, each in row.items()
        }
        for output, row in advantages.items()
    }
