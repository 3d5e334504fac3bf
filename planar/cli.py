"""The command line: words to calls."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planar import __version__
from planar.errors import BadInput, NoAnswer, Outcome

if TYPE_CHECKING:
    from planar.mechanism import Drive, Mechanism
    from planar.motion import RelativeState, State

NO_ANSWER, BAD_INPUT = 1, 2
"""Exit statuses; 0 is done."""


class Commands(click.Group):
    """Every command ends with the same sentences and exit statuses."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="backslashreplace")  # what the screen's alphabet lacks
        with _ending() if args else nullcontext():  # without any words click shows the help
            return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        with _ending():
            return super().invoke(ctx)


@contextmanager
def _ending() -> Iterator[None]:
    try:
        yield
    except BadInput as problem:
        _refuse(str(problem), "bad input", str(problem), BAD_INPUT)
    except NoAnswer as problem:
        _refuse(str(problem), problem.outcome.value, problem.reason, NO_ANSWER)
    except click.UsageError as problem:
        told = problem.format_message().rstrip(".").replace(". Did", "; did").replace(". (", " (")
        if not told.endswith(("?", "?)")):
            told += f"; see `{problem.ctx.command_path if problem.ctx else 'planar'} --help`"
        wrong = str(BadInput("command line", told[0].lower() + told[1:]))
        _refuse(wrong, "bad input", wrong, BAD_INPUT)


def _refuse(sentence: str, outcome: str, reason: str, status: int) -> None:
    if "--json" in sys.argv:
        click.echo(json.dumps({"outcome": outcome, "reason": reason}, ensure_ascii=False))
    shown = "".join(each if each.isprintable() else repr(each)[1:-1] for each in sentence)
    click.echo(f"planar: {shown}", err=True)
    sys.exit(status)


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, message="planar %(version)s")
def main() -> None:
    """How any planar linkage moves.

    MODEL is a mechanism file (JSON), or the name of a model that comes along.
    """


as_json = click.option("--json", "as_json", is_flag=True, help="Print machine-readable SI values.")


@main.command()
@click.argument("model")
@as_json
@click.option(
    "--at",
    "at",
    multiple=True,
    metavar="PAIR=POSITION",
    help="Move an input there first, along its branch: A=75deg, stroke=20mm, or a number in the file's units.",
)
@click.option(
    "--relative",
    "relative",
    multiple=True,
    metavar="POINT,POINT[,LINK]",
    help="Also how the first point moves against the second, in parts, in the axes of a link that carries the second.",
)
@click.option(
    "-o",
    "output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write the tables to a .txt, .svg or .html file.",
)
def solve(model: str, as_json: bool, at: tuple[str, ...], relative: tuple[str, ...], output: Path | None) -> None:
    """This position: mobility, all positions, velocities, accelerations, rubbing speeds."""
    from planar.analysis.published import compare
    from planar.files import load
    from planar.solving.position import solve as solved

    if as_json and output is not None:
        raise BadInput("-o", "tables go to a file or SI values are printed with --json; give one of the two")
    mechanism = load(model)
    _spare(model, output)
    drives = _drives(mechanism, at)
    state = solved(mechanism, drives)
    comparisons = compare(state) if not drives else ()
    relatives = {text: _relative(state, text) for text in relative}
    if as_json:
        from planar.views.record import record

        click.echo(json.dumps(record(state, comparisons, relatives), ensure_ascii=False, indent=1, allow_nan=False))
        return
    from planar.views.table import solution

    _show(solution(state, comparisons, relatives), output)


@main.command()
@click.argument("model")
@as_json
@click.option("--steps", default=360, show_default=True, metavar="N", help="Parts that the range is divided into.")
@click.option("--input", "pair", metavar="PAIR", help="The input that runs, where there are several.")
@click.option("--from", "start", metavar="POSITION", help="Where the range starts: 30deg, 20mm, or a bare number.")
@click.option("--to", "stop", metavar="POSITION", help="Where it stops; left out, a turn on, or from limit to limit.")
@click.option(
    "-o",
    "output",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write all positions, velocities and accelerations to a .csv, .json or .npz file.",
)
def cycle(
    model: str, as_json: bool, steps: int, pair: str | None, start: str | None, stop: str | None, output: Path | None
) -> None:
    """The whole motion: position to position through the range of an input."""
    from planar.files import load, save
    from planar.solving.cycle import cycle as run

    if as_json and output is not None:
        raise BadInput("-o", "a run goes to a file or is printed with --json; give one of the two")
    mechanism = load(model)
    _spare(model, output)
    names = [given.pair for given in mechanism.inputs]
    pair = pair if pair is not None or len(names) != 1 else names[0]
    ends = [_position(mechanism, pair, text, option) for option, text in (("--from", start), ("--to", stop))]
    with _busy(f"{mechanism.name}: {steps} steps"):
        motion = run(mechanism, steps, ends[0], ends[1], pair)
    if as_json:
        from planar.views.run import record

        click.echo(json.dumps(record(motion), ensure_ascii=False, allow_nan=False))
    else:
        from planar.views.run import written
        from planar.views.table import run as table

        if output is not None:
            save(output, written(motion, output.suffix))
        _show(table(motion), None)
    if motion.outcome is not Outcome.SOLVED:
        click.echo(f"planar: {motion.outcome.value}: {motion.reason}", err=True)
        sys.exit(NO_ANSWER)


@main.command()
@click.argument("model")
@as_json
def inspect(model: str, as_json: bool) -> None:
    """What it is: links, pairs, chain, mobility, motions, names."""
    from planar.analysis.inspection import inspect as inspected
    from planar.files import load

    mechanism = load(model)
    with _busy(mechanism.name):
        found = inspected(mechanism)
    if as_json:
        from dataclasses import asdict

        click.echo(json.dumps(asdict(found), ensure_ascii=False))
        return
    from planar.views.inspected import inspection

    _show(inspection(found), None)


@main.command()
@click.argument("model")
@click.option("--pair", "pairs", multiple=True, metavar="NAME", help="A slide; left out, all that the frame guides.")
@click.option("--point", "points", multiple=True, metavar="NAME", help="A point: harmonics of its x and y.")
@click.option("--input", "running", metavar="PAIR", help="The input that turns, where there are several.")
@as_json
def harmonics(model: str, pairs: tuple[str, ...], points: tuple[str, ...], running: str | None, as_json: bool) -> None:
    """Strokes, harmonics and the two-term formula of pistons, over a turn."""
    from planar.analysis.analytical import routes
    from planar.files import load
    from planar.views.analytical import analytical, record

    mechanism = load(model)
    with _busy(mechanism.name):
        found = routes(mechanism, pairs, points, running)
    if as_json:
        click.echo(json.dumps(record(mechanism, found), ensure_ascii=False, allow_nan=False))
        return
    _show(analytical(mechanism, found), None)


def _spare(model: str, output: Path | None) -> None:
    """Refuse to write over the mechanism's own file."""
    if output is not None and output.exists() and Path(model).exists() and output.samefile(model):
        raise BadInput("-o", "this is the mechanism's own file, which would be lost; name another")


def _position(mechanism: Mechanism, pair: str | None, text: str | None, option: str) -> float | None:
    """An end of a run's range."""
    from planar.document import read_drive

    if text is None:
        return None
    if pair is None:
        raise BadInput(option, "there are several inputs; name the one that runs with --input")
    try:
        return read_drive(mechanism, pair, text).position
    except BadInput as problem:
        raise BadInput(option, problem.sentence) from None


def _busy(doing: str) -> AbstractContextManager[Any]:
    """A sign on a terminal that work is under way."""
    if not sys.stderr.isatty():
        return nullcontext()
    from rich.console import Console

    return Console(stderr=True, markup=False).status(doing)


@main.command()
def schema() -> None:
    """The JSON schema of mechanism files, which editors can use."""
    from planar.document import schema as published

    click.echo(json.dumps(published(), ensure_ascii=False, indent=2))


@main.command()
@as_json
def models(as_json: bool) -> None:
    """The models that come along."""
    from planar.files import models as known

    rows = [(file.stem, [name for name in m.ids if name != file.stem], m.about or m.name) for file, m in known()]
    if as_json:
        click.echo(json.dumps([{"model": n, "ids": ids, "about": about} for n, ids, about in rows], ensure_ascii=False))
        return
    from planar.views.table import models as table

    _show(table((name, ", ".join(ids), about) for name, ids, about in rows), None)


@main.command()
@click.argument("model", required=False)
@as_json
def bench(model: str | None, as_json: bool) -> None:
    """Solver speed on this machine: assembly, one warm position, a position of a 360-step run."""
    from planar.analysis.speed import measure
    from planar.files import load

    speeds = [measure(load(name)) for name in ([model] if model else ["four-bar", "slider-crank", "double-butterfly"])]
    if as_json:
        click.echo(json.dumps([speed.record() for speed in speeds], ensure_ascii=False))
        return
    from planar.views.table import speeds as table

    _show(table(speeds), None)


def _relative(state: State, text: str) -> RelativeState:
    """The relative motion that `--relative` asks for."""
    from planar.motion import Unknown

    names = [name.strip() for name in text.split(",")]
    if len(names) not in (2, 3):
        raise BadInput("--relative", f"{text!r} is not of the form POINT,POINT or POINT,POINT,LINK, such as C,B")
    try:
        return state.relative(*names)
    except Unknown as problem:
        raise BadInput("--relative", str(problem)) from None


def _drives(mechanism: Mechanism, told: tuple[str, ...]) -> tuple[Drive, ...]:
    """The inputs that `--at` moves."""
    if not told:
        return ()
    from planar.document import read_drive

    drives = []
    for text in told:
        pair, equals, position = text.partition("=")
        if not equals:
            raise BadInput("--at", f"{text!r} is not of the form PAIR=POSITION, such as A=75deg")
        drives.append(read_drive(mechanism, pair.strip(), position.strip()))
        if drives[-1].pair in (drive.pair for drive in drives[:-1]):
            raise BadInput("--at", f"the input at {drives[-1].pair!r} is moved twice; say once where to")
    return tuple(drives)


def _show(renderable: Any, output: Path | None) -> None:
    """Print a table, or write it to a file in the format that its name says."""
    from rich.console import Console

    if output is None:
        console = Console(markup=False, emoji=False, highlight=False)  # a name is text, whatever it looks like
        if not console.is_terminal:
            # a file or another program has no width: lines are not to be broken for it
            console.width = 140
        console.print(renderable)
        return
    from planar.files import save
    from planar.views.saved import written

    save(output, written(renderable, output.suffix))


if __name__ == "__main__":
    main()
