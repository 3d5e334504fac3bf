"""The command `synthesise`."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from planar.cli.exit_status import INTERRUPTED, no_answer_status
from planar.cli.options import json_option, limited_time, main, print_or_write, show_progress, timeout_option
from planar.cli.streams import TIME_LIMIT, ended_early, print_json
from planar.foundation.errors import Outcome

if TYPE_CHECKING:
    from planar.synthesis.exact.complete_synthesis import CompleteSynthesis
    from planar.synthesis.synthesis import Synthesis
    from planar.synthesis.synthesise import SearchProgress, TaskSearch

SHEET_SUFFIXES = (".png", ".svg", ".pdf")
"""What `-o` names where it is no folder: sheets of drawings."""

KEPT = "what was found of a random task is kept, and the same command goes on from there"
"""Of a search for all linkages that is interrupted."""

NOT_COUNTED = (
    "interrupted: the designs are proved, but not that there are no others; the same command goes on with that test"
)
"""Of a list whose trace test is interrupted."""


def _keep_former_option(context: click.Context, _: click.Parameter, seconds: float | None) -> None:
    """The former name of `--timeout`, in seconds."""
    if seconds is None:
        return
    from planar.foundation.time_limit import TimeLimit

    click.echo("planar: --time is called --timeout now", err=True)
    context.meta[TIME_LIMIT] = TimeLimit(seconds)


@main.command()
@click.argument("task", type=click.Path(path_type=Path))
@click.option("--many", type=click.IntRange(1, 1000), default=10, show_default=True, metavar="N", help="Designs.")
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, metavar="S", help="The same gives the same."
)
@timeout_option
@click.option(
    "--time", type=click.FloatRange(0.0, min_open=True), hidden=True, expose_value=False, callback=_keep_former_option
)
@click.option(
    "-o",
    "output",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="The folder for the designs, a mechanism file and a page each, with a gallery; the same command goes on there "
    "where it was interrupted. Or a .pdf, .png or .svg file for drawings of the designs alone, or of the curves "
    "of their dyads.",
)
@click.option(
    "--complete", is_flag=True, help="All linkages that meet exactly as much as the start can, each certified."
)
@json_option
def synthesise(task: Path, many: int, seed: int, output: Path | None, complete: bool, as_json: bool) -> None:
    """The linkages that do best what a TASK wants: paths, poses or functions, of any structure."""
    from planar.reports.tables.design.synthesis import record, table
    from planar.synthesis.synthesise import TaskSearch, progress_words
    from planar.synthesis.synthesise import synthesise as find_all
    from planar.synthesis.task.task_reader import read_task

    wanted = read_task(task)
    is_sheet = output is not None and output.suffix.lower() in SHEET_SUFFIXES
    folder = None if is_sheet else output
    shown: list[CompleteSynthesis] = []
    with limited_time(f"{wanted.name}: designs", returns_part=True) as bar:

        def show(done: SearchProgress) -> None:
            if done.result is not None and not as_json:
                print_or_write(table(done.result, []), None)
                shown.append(done.result)
            if bar is not None:
                bar.describe(f"{wanted.name}: {done.stage if complete else progress_words(done, wanted)}")

        ended_by: int | None = None
        found: Synthesis
        if complete:
            try:
                found = find_all(wanted, complete=True, progress=show)
            except KeyboardInterrupt:
                raise KeyboardInterrupt(KEPT) from None
            ended_by = None if found.is_finished else INTERRUPTED
        else:
            search = TaskSearch(wanted, many, seed, folder, show)
            ended_by = _run(search)
            found = search.result()
        if ended_early():
            ended_by = no_answer_status(Outcome.INTERRUPTED)
    files: list[Path] = []
    if folder is not None:
        from planar.pages.design_gallery import design_files, write_designs

        with show_progress(f"{len(found)} pages") as progress:
            write_designs(found, folder, progress=progress)
        files = design_files(found, folder)
    elif output is not None:
        _write_sheets(found, output)
    if as_json:
        print_json(record(found, files))
    else:
        _print_designs(found, files, shown)
    if ended_by is not None:
        if complete:
            click.echo(f"planar: {NOT_COUNTED}", err=True)
            sys.exit(ended_by)
        goes_on = "; the same command goes on where it was" if folder is not None else "; with -o FOLDER it could go on"
        why = f"{ended_early()}; " if ended_early() else ""
        click.echo(f"planar: interrupted: {why}the designs found by then are listed{goes_on}", err=True)
        sys.exit(ended_by)


def _print_designs(found: Synthesis, files: list[Path], shown: list[CompleteSynthesis]) -> None:
    """Print the designs; of a list that was shown before its test, and has not changed, what is known of the whole."""
    from planar.reports.tables.design.synthesis import table
    from planar.synthesis.exact.complete_synthesis import CompleteSynthesis

    if isinstance(found, CompleteSynthesis) and not files and [each.designs for each in shown] == [found.designs]:
        click.echo("\n".join(found.summary))
    else:
        print_or_write(table(found, files), None)


def _run(search: TaskSearch) -> int | None:
    """Run a search; an exit status where the keyboard, or a signal to end, stopped it."""
    try:
        with _ended_by_signal():
            search.run()
    except KeyboardInterrupt as stopped:
        return 128 + signal.SIGTERM if stopped.args == (signal.SIGTERM,) else INTERRUPTED
    return None


@contextmanager
def _ended_by_signal() -> Iterator[None]:
    """What ends a process (SIGTERM) stops what is done here as the keyboard does."""

    def stop(number: int, _: Any) -> NoReturn:
        raise KeyboardInterrupt(number)

    try:
        before: Callable[..., Any] | int | None = signal.signal(signal.SIGTERM, stop)
    except ValueError:  # signals are the main thread's
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _write_sheets(found: Synthesis, output: Path) -> None:
    """Drawings of the curves of dyads that poses leave, else of the designs."""
    from planar import plot
    from planar.drawing.diagrams.dyad_drawing import drawn_curves
    from planar.synthesis.exact.complete_synthesis import CompleteSynthesis

    if isinstance(found, CompleteSynthesis) and drawn_curves(found):
        plot.save(plot.dyad_curves(found), output)
    elif len(found):
        plot.save(plot.designs(found), output)
    else:
        click.echo(f"planar: nothing was found that could be drawn; {output} is not written", err=True)
