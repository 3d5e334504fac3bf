"""`python -m benchmarks` measures everything in one run and prints it; `--write` writes the guide's page on speed."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from rich.console import Console, RenderableType
from rich.progress import Progress
from rich.text import Text

from benchmarks import speed_page, tables
from benchmarks.comparison import compare
from benchmarks.compiling import compilings
from benchmarks.contests import contests
from benchmarks.curves import against_designs, against_links
from benchmarks.growth import growths
from benchmarks.imports import costs
from benchmarks.linkages import LINKAGES, Linkage
from benchmarks.long import long
from benchmarks.memory import hold
from benchmarks.mixed import STOPPING, Mixed
from benchmarks.processes import ROOT, cold_starts
from benchmarks.repeated import repeated_calls
from benchmarks.versions import versions

DESIGNS, ROW = "time a position against the number of designs", "time a position against the number of links"
LONG, CODE, COLD = "up to ten thousand links", "machine code", "cold start"


def main() -> None:
    """Measure, then print, then write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Measures everything in one run.")
    parser.add_argument("--write", action="store_true", help="write the guide's page on speed, with its plots")
    wanted = parser.parse_args()
    console = Console()
    if not console.is_terminal:
        console = Console(width=160)
    hold()
    held = (*contests(), Mixed(), Mixed(STOPPING, True))
    measurements: dict[str, Callable[[], Any]] = {
        **{contest.name: contest.measure for contest in held},
        DESIGNS: against_designs,
        ROW: against_links,
        **{linkage.name: _compare(linkage) for linkage in LINKAGES},
        "repeated calls": lambda: tables.repeated(repeated_calls()),
        "growth": lambda: tables.growth(growths()),
        LONG: long,
        CODE: compilings,
        COLD: cold_starts,
        "what costs what": lambda: tables.costs(costs()),
    }
    found: dict[str, Any] = {}
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=len(measurements))
        for name, measure in measurements.items():
            progress.update(task, description=name)
            found[name] = measure()
            progress.advance(task)
    console.print(Text(versions(), style="bold"))
    console.print(tables.notes())
    for name, each in found.items():
        console.print(_render(name, each, {contest.name for contest in held}))
    if wanted.write:
        results = [result for contest in held for result in found[contest.name]]
        speed_page.write(
            ROOT, versions(), results, found[DESIGNS], found[ROW], tables=(found[LONG], found[CODE], found[COLD])
        )


def _render(name: str, found: Any, contested: set[str]) -> RenderableType:
    if name in contested:
        return tables.contest(found)
    if name in (DESIGNS, ROW):
        return tables.curves(name, found)
    kinds = {LONG: tables.long, CODE: tables.compiling, COLD: tables.processes}
    return kinds[name](found) if name in kinds else found


def _compare(linkage: Linkage) -> Callable[[], RenderableType]:
    return lambda: tables.comparison(linkage.name, compare(linkage))


if __name__ == "__main__":
    main()
