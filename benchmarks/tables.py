"""The measurements as tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from benchmarks.comparison import Row
from benchmarks.growth import Growth
from benchmarks.imports import Cost
from benchmarks.processes import Process


def comparison(linkage: str, rows: Iterable[Row]) -> RenderableType:
    """Every way to solve one linkage, in the order of their times: positions alone, then with rates."""
    rows = sorted(rows, key=lambda row: row.seconds)
    return Group(
        _compared(f"{linkage}, a position", (row for row in rows if not row.rates)),
        _compared(f"{linkage}, a position with velocities and accelerations", (row for row in rows if row.rates)),
    )


def _compared(title: str, rows: Iterable[Row]) -> Table:
    table = _table(title, "way", "time", "ratio", "greatest error")
    table.columns[0].min_width = 34
    for row in rows:
        table.add_row(row.way, _time(row.seconds), _ratio(row.ratio), _error(row.error))
    return table


def growth(measured: Iterable[Growth]) -> RenderableType:
    """Time against the number of links; ratios to the fewest."""
    measured = tuple(measured)
    table = _table(
        "rows of four-bars: time against the number of links (and its ratio to the first line)",
        "links",
        "equations",
        "program of a run",
        "assembly",
        "a position with rates",
        "greatest error",
        "a position of a run",
        "greatest error",
    )
    first = measured[0]
    for each in measured:
        table.add_row(
            str(each.links),
            _step(each.equations, first.equations),
            _step(each.program, first.program),
            _step(each.assembly, first.assembly),
            _step(each.position, first.position),
            _error(each.position_error),
            _step(each.run, first.run),
            _error(each.run_error),
        )
    return table


def processes(measured: Iterable[Process]) -> RenderableType:
    """Whole processes, from start to end."""
    table = _table("cold start, whole processes", "command", "time", "ratio")
    for each in measured:
        table.add_row(each.command, _time(each.seconds), _ratio(each.ratio))
    return table


def costs(measured: Iterable[Cost]) -> RenderableType:
    """What a cold `planar solve` spends its time on."""
    table = _table("what costs what in a cold `planar solve`", "part", "time", "share")
    for each in measured:
        table.add_row(each.part, _time(each.seconds), f"{100.0 * each.share:.0f} %")
    return table


def notes() -> RenderableType:
    """What the numbers are."""
    return Text(
        "Only ratios mean anything on a shared machine; those of the ways are to the closed form in Python floats. "
        "Times are the best of several rounds run in turn, processes the median of their runs. The ways solve a turn "
        "of the crank in 360 steps, and their time is that of one position. Errors are against the closed form in "
        "longer arithmetic, as a part of the greatest value that a quantity takes in the turn. "
        "planar.cycle assembles, runs and has its rates gated too; the other rates of runs come sample by sample from "
        "the program and are ungated.",
        style="italic",
    )


def _time(seconds: float) -> str:
    for size, name in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")):
        if seconds >= size:
            return f"{seconds / size:.3g} {name}"
    return f"{seconds / 1e-9:.3g} ns"


def _step(seconds: float, first: float) -> str:
    return f"{_time(seconds)} ({_ratio(seconds / first)})"


def _ratio(ratio: float) -> str:
    return f"x {ratio:.2g}" if ratio < 100.0 else f"x {ratio:.0f}"


def _error(error: float) -> str:
    return f"{error:.1e}"


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="right" if index else "left", overflow="fold")
    return table
