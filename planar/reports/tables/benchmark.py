"""Measured solving speeds as tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Group, RenderableType
from rich.text import Text

from planar.bench.benchmark import CYCLE_STEPS, SWEEP_STEPS, Speed
from planar.reports.fitted_table import plain_table
from planar.reports.number_format import paragraphs


def table(measured: Iterable[Speed]) -> RenderableType:
    """One position and one run of each, then its sweeps, then what bounds them."""
    measured = tuple(measured)
    headings = (
        "mechanism",
        "links",
        "unknowns",
        "equations",
        "assembly",
        "solve, another position",
        "cycle, a position",
    )
    first = plain_table(None, *headings)
    for each in measured:
        times = (each.equations, each.assembly, each.solve, each.cycle)
        first.add_row(each.name, str(each.links), str(each.unknowns), *map(format_time, times))
    note = (
        f"cycle: {CYCLE_STEPS} steps; cycle and solve have velocities and accelerations; equations once for a structure"
    )
    parts: list[RenderableType] = [first, Text(note, style="italic")]
    for each in measured:
        parts += [Text(), *_sweep_tables(each)]
    return Group(*parts)


def _sweep_tables(speed: Speed) -> list[RenderableType]:
    """The sweeps of one mechanism, and what there is to say of it."""
    said = paragraphs(("-", f"{sentence}.") for sentence in speed.bounds)
    if not speed.sweeps:
        return [Text(speed.name, style="bold"), said]
    headings = ("a position", "with rates", "designs", "refused", "general path", "first call", "compiling")
    within = f"{100.0 * speed.sweeps[0].within:g} %"
    found = plain_table(
        f"{speed.name}: sweeps of designs whose lengths are within {within}, {SWEEP_STEPS} steps", *headings
    )
    both = {each.rates: each for each in speed.sweeps}
    most = both[True]
    found.add_row(
        format_time(both[False].seconds if False in both else None),
        format_time(most.seconds),
        str(most.designs),
        str(most.refused),
        f"{100.0 * most.general / (most.designs * (SWEEP_STEPS + 1)):.3g} %",
        f"+ {format_time(most.first)}",
        format_time(most.compiling),
    )
    return [found, said]


def format_time(seconds: float | None) -> str:
    """In the unit that fits."""
    if seconds is None:
        return "-"
    for size, name in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")):
        if seconds >= size:
            return f"{seconds / size:.3g} {name}"
    return f"{seconds / 1e-9:.3g} ns"
