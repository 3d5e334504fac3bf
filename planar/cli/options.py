"""Options that several commands share, input positions, and how results are printed or written."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Timer
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from planar import __version__
from planar.cli.exit_status import CommandGroup, no_answer_status
from planar.cli.streams import TIME_LIMIT, print_json
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.safe_files import is_existing

if TYPE_CHECKING:
    from planar.model.mechanism import Drive, Mechanism
    from planar.reports.columns import ReportedSeries
    from planar.results.motion import Motion


THREAD_LIMITS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Set before numpy is loaded, unless the user did: matrices are small, and on a busy machine threads that share one
wait for each other longer than they work."""


@click.group(cls=CommandGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, message="planar %(version)s")
def main() -> None:
    """How any planar linkage moves.

    MODEL is a mechanism file (JSON), a file or link of another program (see `planar convert --formats`), the name of a
    model that comes along, or - for what is piped in.

    Ends with status 0 when all is done, 1 where the mechanism has no answer, 2 on bad input, 3 where the result cannot
    be written, as on a full disk.
    """
    for limit in THREAD_LIMITS:
        os.environ.setdefault(limit, "1")


json_option = click.option("--json", "as_json", is_flag=True, help="Print machine-readable SI values.")


at_option = click.option(
    "--at",
    "at",
    multiple=True,
    metavar="PAIR=POSITION",
    help="Move an input there first, along its branch: A=75deg, stroke=20mm, or a number in the file's units.",
)


scale_option = click.option(
    "--scale",
    "scales",
    multiple=True,
    metavar="SCALE",
    help='Of what is drawn: "1 cm = 100 mm", "1:5", "1 cm = 0.1 m/s", "1 cm = 500 N"; left out, round ones that fit.',
)


mode_option = click.option(
    "--mode",
    "mode",
    type=click.IntRange(1),
    metavar="N",
    help="The assembly of this number in `planar modes`, and not the one nearest to the sketch.",
)


SETTINGS = "planar.settings"
"""Where a command's context keeps what `--set` says."""


PROGRESS_DELAY = 1.0
"""s; what takes less shows no bar."""


FRAME_NUMBER = "planar.frame_number"
"""Where a command's context keeps what `--frame-number` says."""


def frame_number_option(command: Any) -> Any:
    """The option that makes the frame the first or the last link; `read_model` follows it."""

    def keep(context: click.Context, _: click.Parameter, order: str | None) -> None:
        context.meta[FRAME_NUMBER] = order

    return click.option(
        "--frame-number",
        type=click.Choice(("first", "last")),
        expose_value=False,
        callback=keep,
        help="Number the frame first, as link 1, or last; by default as the file says, or last.",
    )(command)


def model_argument(*names: str, **more: Any) -> Callable[[Any], Any]:
    """The MODEL of a command, with the option that changes numbers of it; `read_model` reads the one by the other."""

    def keep(context: click.Context, _: click.Parameter, settings: tuple[str, ...]) -> None:
        context.meta[SETTINGS] = settings

    option = click.option(
        "--set",
        multiple=True,
        metavar="NUMBER=VALUE",
        expose_value=False,
        callback=keep,
        help="Another value for a number of MODEL: BC.length=400mm, a bare number in its units; `inspect` lists them.",
    )
    argument = click.argument(*(names or ("model",)), **more)
    return lambda command: argument(option(command))


def read_model(model: str) -> Mechanism:
    """The mechanism of a file, or of a model's name, with what `--set` and `--frame-number` change."""
    from planar.document.files import load

    mechanism = apply_settings(load(model))
    order = click.get_current_context().meta.get(FRAME_NUMBER)
    if order is None or order == mechanism.frame_number:
        return mechanism
    from planar.model.link_graph import frame_number_problem

    renumbered = replace(mechanism, frame_number=order)
    problem = frame_number_problem(renumbered)
    if problem:
        raise BadInput("--frame-number", problem)
    return renumbered


def apply_settings(mechanism: Mechanism) -> Mechanism:
    """The mechanism with the numbers that `--set` changes."""
    settings = click.get_current_context().meta.get(SETTINGS, ())
    if not settings:
        return mechanism
    from planar.document.revised.changed_numbers import with_values

    values: dict[str, Any] = {}
    for text in settings:
        name, equals, value = (part.strip() for part in text.rpartition("="))
        if not equals or not name:
            raise BadInput("--set", f"{text!r} is not of the form NUMBER=VALUE, such as BC.length=400mm")
        if name in values:
            raise BadInput("--set", f"{name!r} is set twice; say once to what")
        try:
            values[name] = float(value)
        except ValueError:
            values[name] = value
    return with_values(mechanism, values, mechanism.units)


def refuse_settings() -> None:
    """Refuse `--set` where no MODEL is named. Raises BadInput."""
    if click.get_current_context().meta.get(SETTINGS):
        raise BadInput("--set", "name the MODEL whose numbers are changed")


MODE_ADVICE = "`planar modes` lists them, --mode takes another"
"""What a remark on a terminal says of other assemblies."""


def load_model(model: str, mode: int | None, advice: str = MODE_ADVICE) -> Mechanism:
    """The mechanism of a file, the assembly chosen that `--mode` names, else with the number of the sketch's own.

    `advice` ends the remark that has this number; it is empty for what is printed and handed out.
    """
    from planar.assemblies.selection import select_assembly, with_assembly_number

    mechanism = read_model(model)
    if mode is None:
        return with_assembly_number(mechanism, advice)
    with show_status(f"{mechanism.name}: assemblies"):
        return select_assembly(mechanism, mode)


input_option = click.option("--input", "pair", metavar="PAIR", help="The input that runs, where there are several.")


def range_options(command: Any) -> Any:
    """The options of a run: which input runs, from where to where."""
    for option in (
        click.option("--to", "stop", metavar="POSITION", help="Where it stops; left out, a turn on, or to its limits."),
        click.option("--from", "start", metavar="POSITION", help="Where the range starts: 30deg, 20mm, a bare number."),
        input_option,
    ):
        command = option(command)
    return command


def motion_options(command: Any) -> Any:
    """The options of a whole motion, all of which `run` takes."""
    for option in (
        click.option(
            "--duration",
            metavar="TIME",
            help="Run in time so long, every input by its law or at constant acceleration.",
        ),
        click.option(
            "--branch",
            "branches",
            multiple=True,
            type=click.IntRange(1),
            metavar="N",
            help="The way taken where branches of the motion cross: 1 smoothly, 2 the next; for each change point.",
        ),
        click.option("--circuit", is_flag=True, help="Go through dead points, all round the circuit of this assembly."),
        click.option("--there-and-back", is_flag=True, help="Come back through the range by the same positions."),
    ):
        command = option(command)
    return steps_option(range_options(command))


steps_option = click.option(
    "--steps", default=360, show_default=True, metavar="N", help="Parts that the motion is divided into."
)


def timeout_option(command: Any) -> Any:
    """The option that limits the time of a computation; `limited_time` follows it."""

    def keep(context: click.Context, _: click.Parameter, timeout: str | None) -> None:
        if timeout is None:
            return
        from planar.document import read_time
        from planar.foundation.time_limit import TimeLimit

        seconds = read_time(timeout, "--timeout")
        if not seconds > 0.0:
            raise BadInput("--timeout", f"a time above zero is wanted, not {timeout!r:.40}")
        context.meta[TIME_LIMIT] = TimeLimit(seconds)

    return click.option(
        "--timeout",
        metavar="TIME",
        expose_value=False,
        callback=keep,
        help="End after so long (5 s, 2 min), with what was found by then, as Ctrl-C does.",
    )(command)


@contextmanager
def limited_time(description: str, returns_part: bool = False) -> Iterator[ProgressBar | None]:
    """A context that ends what is computed in it after the time of `--timeout`, or by a Ctrl-C.

    Raises NoAnswer where something ended early, unless the context `returns_part`. On a terminal a bar shows how much
    is done. A command that was ended so says it at its end, see `CommandGroup`.
    """
    from planar.foundation.time_limit import TimeLimit, limited_by

    limit = click.get_current_context().meta.setdefault(TIME_LIMIT, TimeLimit(None))
    with show_progress(description, transient=True) as bar, limited_by(limit, returns_part):
        limit.progress = bar
        yield bar


def output_option(help: str, required: bool = False) -> Callable[[Any], Any]:  # noqa: A002
    """The option that names a file to write."""
    kind = click.Path(dir_okay=False, path_type=Path)
    return click.option("-o", "output", type=kind, metavar="FILE", help=help, required=required)


def refuse_overwriting(model: str, output: Path | None, what: str = "the mechanism's own file") -> None:
    """Refuse to write over a file that is read."""
    from planar.document import LINK_PREFIX

    is_file = not model.startswith(LINK_PREFIX) and is_existing(model)
    if output is not None and is_file and is_existing(output) and output.samefile(model):
        raise BadInput("-o", f"this is {what}, which would be lost; name another")


def refuse_options(names: Iterable[str], reason: str) -> None:
    """Refuse options, by the names of their values, that are on the command line but not used. Raises BadInput."""
    context = click.get_current_context()
    for option in context.command.params:
        if option.name in names and context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE:
            raise BadInput(max(option.opts, key=len), reason)


class ProgressBar:
    """A bar of rich on the terminal: what is done, and how much of it."""

    def __init__(self, description: str, transient: bool):
        from rich.console import Console
        from rich.progress import Progress

        self.bar = Progress(console=Console(stderr=True, markup=False), transient=transient)
        self.task = self.bar.add_task(description.replace("[", r"\["), total=None)

    def __call__(self, done: float, total: float) -> None:
        self.bar.update(self.task, completed=done, total=total)

    def describe(self, description: str) -> None:
        """Say what is being done."""
        self.bar.update(self.task, description=description.replace("[", r"\["))


def show_status(description: str) -> AbstractContextManager[ProgressBar | None]:
    """A sign on a terminal that work is under way."""
    return show_progress(description, transient=True)


@contextmanager
def show_progress(description: str, transient: bool = False) -> Iterator[ProgressBar | None]:
    """A bar on a terminal that shows how much of a long work is done; it may be gone when that is.

    It comes after `PROGRESS_DELAY`; there is none where stderr is no terminal.
    """
    if not sys.stderr.isatty():
        yield None
        return
    bar = ProgressBar(description, transient)
    timer = Timer(PROGRESS_DELAY, bar.bar.start)
    timer.daemon = True
    timer.start()
    try:
        yield bar
    finally:
        timer.cancel()
        timer.join()
        bar.bar.stop()


def parse_drives(mechanism: Mechanism, texts: tuple[str, ...]) -> tuple[Drive, ...]:
    """The inputs that `--at` moves."""
    if not texts:
        return ()
    from planar.document import read_drive

    drives = []
    for text in texts:
        pair, equals, position = text.partition("=")
        if not equals:
            raise BadInput("--at", f"{text!r} is not of the form PAIR=POSITION, such as A=75deg")
        drives.append(read_drive(mechanism, pair.strip(), position.strip()))
        if drives[-1].pair in (drive.pair for drive in drives[:-1]):
            raise BadInput("--at", f"the input at {drives[-1].pair!r} is moved twice; say once where to")
    return tuple(drives)


def print_or_write(renderable: Any, output: Path | None) -> None:
    """Print a table, or write it to a file in the format that its name says."""
    from rich.console import Console

    class Screen(Console):
        def on_broken_pipe(self) -> None:
            raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))  # which every command ends alike

    if output is None:
        console = Screen(markup=False, emoji=False, highlight=False)  # a name is text, whatever it looks like
        if not console.is_terminal and not os.environ.get("COLUMNS", "").isdecimal():
            # a file or another program has no width: lines are not to be broken for it
            console.width = 140
        console.print(renderable, crop=False)
        return
    from planar.foundation.safe_files import save_file
    from planar.reports.files.table_files import encode_tables

    save_file(output, encode_tables(renderable, output.suffix))


def read_ends(
    mechanism: Mechanism, pair: str | None, start: str | None, stop: str | None
) -> tuple[float | None, float | None]:
    """Where the range of the options `--from` and `--to` starts and stops (rad or m), for the input that runs."""
    names = [given.pair for given in mechanism.inputs]
    of = pair if pair is not None or len(names) != 1 else names[0]
    first, last = (_parse_position(mechanism, of, text, option) for option, text in (("--from", start), ("--to", stop)))
    return first, last


def run_motion(
    mechanism: Mechanism,
    steps: int,
    pair: str | None,
    start: str | None,
    stop: str | None,
    duration: str | None = None,
    **more: Any,
) -> Motion:
    """The run of an input over the range that the options give; `more` goes to `planar.cycle` as it is."""
    from planar.document import read_time
    from planar.solving.cycle import cycle

    ends = read_ends(mechanism, pair, start, stop)
    time = None if duration is None else read_time(duration, "--duration")
    return cycle(mechanism, steps, ends[0], ends[1], pair, duration=time, **more)


def report_motion(
    motion: Motion,
    as_json: bool,
    output: Path | None,
    tables: Callable[[], Iterable[Any]],
    more: Iterable[ReportedSeries] = (),
    facts: Callable[[], Mapping[str, Any]] = dict,
) -> None:
    """Report a motion, its further series `more` and its `facts`, as JSON, or as tables and in a named file.

    `tables` and `facts` are called only where they are reported.

    Ends with a sentence and a status where the motion did not come to its end.
    """
    from planar.reports.files.run_formats import encode_run, record

    if as_json:
        print_json(record(motion, more, facts()))
    else:
        if output is not None:
            from planar.foundation.safe_files import save_file

            save_file(output, encode_run(motion, output.suffix, more, facts))
        for each in tables():
            print_or_write(each, None)
    if motion.outcome is not Outcome.SOLVED:
        click.echo(f"planar: {motion.outcome.value}: {motion.reason}", err=True)
        sys.exit(no_answer_status(motion.outcome))


def _parse_position(mechanism: Mechanism, pair: str | None, text: str | None, option: str) -> float | None:
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
