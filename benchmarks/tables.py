"""The measurements as tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

import planar
from benchmarks.comparison import Row
from benchmarks.compiling import Compiling
from benchmarks.contests import Result
from benchmarks.curves import Curve
from benchmarks.growth import Growth
from benchmarks.imports import Cost
from benchmarks.long import Long
from benchmarks.processes import Process
from benchmarks.repeated import RepeatedCall


def comparison(linkage: str, rows: Iterable[Row]) -> RenderableType:
    """Every way to solve one linkage, in the order of their times: positions alone, then with rates."""
    rows = sorted(rows, key=lambda row: row.seconds)
    return Group(
        _comparison_table(f"{linkage}, a position", (row for row in rows if not row.rates)),
        _comparison_table(
            f"{linkage}, a position with velocities and accelerations", (row for row in rows if row.rates)
        ),
    )


def _comparison_table(title: str, rows: Iterable[Row]) -> Table:
    table = _table(title, "way", "time", "ratio", "greatest error")
    table.columns[0].min_width = 34
    for row in rows:
        table.add_row(row.way, time(row.seconds), ratio(row.ratio), _error(row.error))
    return table


NOT_THERE = "" if hasattr(planar, "sweep") else "planar.sweep is not there in this version. "


def contest(results: Iterable[Result]) -> RenderableType:
    """One contest, in the order of times: positions alone, then with rates; ratios to the limit."""
    results = sorted(results, key=lambda result: (result.rates, result.seconds))
    table = _table(
        results[0].contest, "system", "a position", "ratio", "greatest error", "designs", "refused", "wrongly"
    )
    table.columns[0].min_width = 34
    for index, each in enumerate(results):
        if index and each.rates != results[index - 1].rates:
            table.add_section()
        shown = each.system + (", with rates" if each.rates else "")
        table.add_row(
            shown,
            time(each.seconds),
            ratio(each.ratio),
            _error(each.error),
            str(each.designs),
            str(each.refused),
            str(each.wrong),
        )
    return table


def curves(title: str, measured: Iterable[Curve]) -> RenderableType:
    """Time a position against what grows."""
    measured = tuple(measured)
    grows = sorted({number for curve in measured for number in curve.grows})
    table = _table(title, "system", *(f"{number:,}" for number in grows), "greatest error (m)")
    for curve in measured:
        known = dict(zip(curve.grows, curve.seconds, strict=True))
        table.add_row(curve.system, *(time(known[n]) if n in known else "" for n in grows), _error(curve.error))
    return table


def growth(measured: Iterable[Growth]) -> RenderableType:
    """Processor time a link, of runs a link and position, against the number of links; ratios to the fewest."""
    table = _table(
        "processor time a link, of runs a link and position (and its ratio to the first line of the kind)",
        "linkage",
        "links",
        "first solve",
        "first cycle",
        "cycle again",
        "forces",
        "simulate, a step",
        "greatest residual",
    )
    first: dict[str, tuple[float | None, ...]] = {}
    for each in measured:
        fewest = first.setdefault(each.kind, each.per_link())
        shown = [
            "" if seconds is None or least is None else _step(seconds, least)
            for seconds, least in zip(each.per_link(), fewest, strict=True)
        ]
        table.add_row(each.kind, f"{each.links:,}", *shown, _error(each.residual))
    return table


def long(measured: Iterable[Long]) -> RenderableType:
    """Seconds a position and link, for each kind of linkage and number of links."""
    table = _table("a position and link of linkages of many links", "linkage", "links", "planar", "C", "greatest error")
    for each in measured:
        for k, links in enumerate(each.links):
            times = (each.planar[k], each.limit[k])
            shown = ("" if seconds is None else time(seconds) for seconds in times)
            error = _error(each.error) if each.planar[k] is not None else ""
            table.add_row("" if k else each.structure, f"{links:,}", *shown, "" if k else error)
    return table


def compiling(measured: Iterable[Compiling]) -> RenderableType:
    """How long machine code takes to be there."""
    table = _table("machine code, with velocities and accelerations", "structure", "printed", "compiled", "from disk")
    for each in measured:
        table.add_row(each.structure, time(each.printing), time(each.compiling), time(each.reading))
    return table


def processes(measured: Iterable[Process]) -> RenderableType:
    """Whole processes, from start to end."""
    table = _table("cold start, whole processes", "command", "time", "ratio")
    for each in measured:
        command = f"{each.command} ({each.remark})" if each.remark else each.command
        table.add_row(command, time(each.seconds), ratio(each.ratio))
    return table


def repeated(measured: Iterable[RepeatedCall]) -> RenderableType:
    """Calls that are repeated in one process."""
    table = _table("calls repeated in one process, positions with rates", "call", "time", "positions", "fsolve")
    for each in measured:
        table.add_row(each.call, time(each.seconds), f"{each.positions:,}", ratio(each.ratio))
    return table


def costs(measured: Iterable[Cost]) -> RenderableType:
    """What a cold `planar solve` spends its time on."""
    table = _table("what costs what in a cold `planar solve`", "part", "time", "share")
    for each in measured:
        table.add_row(each.part, time(each.seconds), f"{100.0 * each.share:.0f} %")
    return table


def notes() -> RenderableType:
    """What the numbers are."""
    return Text(
        "Only ratios mean anything on a shared machine; those of the ways are to the closed form in Python floats. "
        "Times are the best of several rounds run in turn, processes the median of their runs. The ways solve a turn "
        "of the crank in 360 steps, and their time is that of one position. Errors are against the closed form in "
        "longer arithmetic, as a part of the greatest value that a quantity takes in the turn. "
        "In the contests ratios are to C by hand. Everybody gives new arrays, in memory that the process has already. "
        "Refused are designs with a position that is not given, wrongly those that are refused at another step than "
        f"the closed form, or not. {NOT_THERE}"
        "planar.cycle assembles, runs and has its rates gated too; the other rates of runs come sample by sample from "
        "the program and are ungated.",
        style="italic",
    )


def time(seconds: float) -> str:
    """In the unit that fits."""
    for size, name in ((1.0, "s"), (1e-3, "ms"), (1e-6, "us")):
        if seconds >= size:
            return f"{seconds / size:.3g} {name}"
    return f"{seconds / 1e-9:.3g} ns"


def _step(seconds: float, first: float) -> str:
    return f"{time(seconds)} ({ratio(seconds / first)})"


def ratio(times: float) -> str:
    """As a factor."""
    return f"x {times:.2g}" if times < 100.0 else f"x {times:.0f}"


def _error(error: float) -> str:
    return f"{error:.1e}"


def _table(title: str, *headings: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
    for index, heading in enumerate(headings):
        table.add_column(heading, justify="right" if index else "left", overflow="fold")
    return table
