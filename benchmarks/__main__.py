"""`python -m benchmarks` measures everything in one run and prints it."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console, RenderableType
from rich.progress import Progress
from rich.text import Text

from benchmarks import tables
from benchmarks.comparison import compare
from benchmarks.growth import LINKS, grow
from benchmarks.imports import costs
from benchmarks.linkages import LINKAGES, Linkage
from benchmarks.processes import cold_starts
from benchmarks.versions import versions


def main() -> None:
    """Measure, then print."""
    console = Console()
    if not console.is_terminal:
        console = Console(width=160)
    measurements: dict[str, Callable[[], RenderableType]] = {
        **{linkage.name: _compared(linkage) for linkage in LINKAGES},
        "number of links": lambda: tables.growth(grow(links) for links in LINKS),
        "cold start": lambda: tables.processes(cold_starts()),
        "what costs what": lambda: tables.costs(costs()),
    }
    shown: list[RenderableType] = [Text(versions(), style="bold"), tables.notes()]
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=len(measurements))
        for name, measure in measurements.items():
            progress.update(task, description=name)
            shown.append(measure())
            progress.advance(task)
    for each in shown:
        console.print(each)


def _compared(linkage: Linkage) -> Callable[[], RenderableType]:
    return lambda: tables.comparison(linkage.name, compare(linkage))


main()
