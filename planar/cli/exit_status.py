"""How every command ends: one sentence and an exit status, whatever went wrong."""

from __future__ import annotations

import gc
import re
import sys
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from importlib import import_module
from types import MappingProxyType
from typing import Any, NoReturn, TextIO

import click

from planar.cli.streams import allow_every_letter, ended_early, is_ended_by_user, print_json
from planar.foundation.errors import BadInput, MissingGlyphs, NoAnswer, Outcome, Unknown, WriteFailure, join_names

NO_ANSWER, BAD_INPUT, NOT_WRITTEN, INTERRUPTED = 1, 2, 3, 130
"""Exit statuses; 0 is done, 130 what shells give for an interrupt from the keyboard."""
CLOSED_PIPE_STATUS = 128 + 13
"""What a shell tells of programs that the closing of their pipe ends (SIGPIPE is signal 13), as by `| head`."""


FOUND_BY_THEN = "what was found by then is reported; give more time for all of it"
"""Of a result that a time limit, or Ctrl-C, ended early."""


COMMAND_SYNONYMS = {
    "advantage": "forces",
    "analyse": "solve",
    "analyze": "solve",
    "animation": "animate",
    "assemblies": "modes",
    "branches": "circuits",
    "check": "inspect",
    "dof": "inspect",
    "draw": "plot",
    "dynamics": "simulate",
    "export": "cycle",
    "import": "convert",
    "info": "inspect",
    "kinematics": "solve",
    "list": "models",
    "mobility": "inspect",
    "motion": "cycle",
    "move": "cycle",
    "names": "inspect",
    "open": "view",
    "page": "view",
    "poles": "centres",
    "position": "solve",
    "reactions": "forces",
    "run": "cycle",
    "save": "convert",
    "show": "view",
    "statics": "forces",
    "steps": "explain",
    "validate": "inspect",
    "velocity": "solve",
}
"""Commands by other words for what they do."""


COLLECTION_THRESHOLD = 200_000
"""Objects made before the rings among them are looked for: more than loading and one solution make."""


REPEATABLE = "May be repeated."
"""What the help says of an option that takes several values."""


class OptionCheckedCommand(click.Command):
    """A command that refuses an option given twice unless it takes several values; click would keep the last alone."""

    def __init__(self, *args: Any, **more: Any):
        super().__init__(*args, **more)
        for option in self.params:
            if isinstance(option, click.Option) and option.multiple and REPEATABLE not in (option.help or ""):
                option.help = f"{option.help or ''} {REPEATABLE}".strip()

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        _, _, parameters = self.make_parser(ctx).parse_args(args=list(args))
        for option, count in Counter(parameters).items():
            if isinstance(option, click.Option) and count > 1 and not (option.multiple or option.is_eager):
                raise BadInput(
                    max(option.opts, key=len), f"this option is given {count} times but takes one value; give it once"
                )
        return super().parse_args(ctx, args)


class CommandGroup(click.Group):
    """Every command ends with the same sentences and exit statuses; its module is loaded when it is asked for."""

    command_class = OptionCheckedCommand

    modules: Mapping[str, str] = MappingProxyType({})
    """The commands by name, and the module of each."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(self.modules)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.modules:
            return None
        import_module(self.modules[cmd_name])
        found = self.commands[cmd_name]
        found.short_help = found.help  # of one sentence: the list of commands has it whole
        return found

    def load_commands(self) -> Mapping[str, click.Command]:
        """Every command by its name."""
        for module in self.modules.values():
            import_module(module)
        return self.commands

    def main(self, *args: Any, **more: Any) -> Any:
        """As click's, but that output which cannot be written ends in a status of its own, the last of it too."""
        if args or "args" in more:
            return self._checked_main(*args, **more)
        # a process of its own, most of whose objects are modules that last as long as it
        gc.set_threshold(COLLECTION_THRESHOLD)
        try:
            return self._checked_main(**more)
        finally:
            gc.freeze()  # nothing is looked through on the way out

    def _checked_main(self, *args: Any, **more: Any) -> Any:
        if sys.stdout is None:
            from planar.foundation.safe_files import closed_output

            sys.stdout = closed_output()
        try:
            try:
                return super().main(*args, **more)
            finally:
                if sys.stdout is not None:
                    sys.stdout.flush()
        except OSError as problem:
            _exit_unwritable(problem)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        allow_every_letter()
        with _exit_with_status() if args else nullcontext():  # without any words click shows the help
            return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        name = args[0]
        if not name.startswith("-") and self.get_command(ctx, name) is None:
            from difflib import get_close_matches

            near = get_close_matches(name.lower(), self.modules, 1) or [COMMAND_SYNONYMS.get(name.lower(), "")]
            if near[0]:
                ctx.fail(f"no such command {name!r}; did you mean {near[0]!r}?")
            ctx.fail(f"no such command {name!r}; commands are {join_names(sorted(self.modules), None)}")
        return super().resolve_command(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        with _exit_with_status(), _report_missing_glyphs():
            result = super().invoke(ctx)
        reason = ended_early()
        if reason:
            _print_error(f"{Outcome.INTERRUPTED.value}: {reason}; {FOUND_BY_THEN}")
            sys.exit(no_answer_status(Outcome.INTERRUPTED))
        return result


def no_answer_status(outcome: Outcome) -> int:
    """The exit status of a result with an outcome other than solved: of one that Ctrl-C ended that of an interrupt."""
    return INTERRUPTED if outcome is Outcome.INTERRUPTED and is_ended_by_user() else NO_ANSWER


@contextmanager
def _exit_with_status() -> Iterator[None]:
    try:
        yield
    except OSError as problem:
        _exit_unwritable(problem)
    except WriteFailure as problem:
        _exit_refused(str(problem), "not written", str(problem), NOT_WRITTEN)
    except (BadInput, Unknown) as problem:
        _exit_refused(str(problem), "bad input", str(problem), BAD_INPUT)
    except NoAnswer as problem:
        status = no_answer_status(problem.outcome)
        _exit_refused(str(problem), problem.outcome.value, problem.reason, status, problem.more)
    except KeyboardInterrupt as stopped:
        told = "; ".join(["stopped by the user before it was done", *map(str, stopped.args)])
        _exit_refused(f"interrupted: {told}", "interrupted", told, INTERRUPTED)
    except click.UsageError as problem:
        told = " ".join(problem.format_message().split()).rstrip(".").replace(". Did", "; did").replace(". (", " (")
        told = re.sub(r"(?: for)? '\{[^}]*\}'", "", told).replace(
            ". Choose", "; choose"
        )  # click names an argument by its choices, and then lists them
        if not told.endswith(("?", "?)")):
            told += f"; see `{problem.ctx.command_path if problem.ctx else 'planar'} --help`"
        wrong = str(BadInput("command line", told[0].lower() + told[1:]))
        _exit_refused(wrong, "bad input", wrong, BAD_INPUT)


@contextmanager
def _report_missing_glyphs() -> Iterator[None]:
    """What no font can show is named in one line, however many texts have it; other warnings go their way."""
    found: set[str] = set()
    before = warnings.showwarning

    def collect(  # many: the signature of `showwarning`
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if isinstance(message, MissingGlyphs):
            found.update(message.characters)
        else:
            before(message, category, filename, lineno, file, line)

    with warnings.catch_warnings():
        warnings.simplefilter("always", MissingGlyphs)
        warnings.showwarning = collect
        yield
    if found:
        click.echo(f"planar: {MissingGlyphs(found)}", err=True)


def _exit_refused(
    sentence: str, outcome: str, reason: str, status: int, more: Mapping[str, Any] = MappingProxyType({})
) -> None:
    if "--json" in sys.argv:
        try:
            print_json({"outcome": outcome, "reason": reason, **more}, allow_nan=True)
        except OSError as problem:
            _exit_unwritable(problem)
    _print_error(sentence)
    sys.exit(status)


def _exit_unwritable(problem: OSError) -> NoReturn:
    """End where what is printed cannot be written, quietly where nobody reads it any more."""
    from planar.foundation.safe_files import NO_SPACE_ERRORS, discard_stream

    if problem.errno not in NO_SPACE_ERRORS:
        raise problem
    discard_stream(sys.stdout)
    if isinstance(problem, BrokenPipeError):
        sys.exit(CLOSED_PIPE_STATUS)
    _print_error(f"the output cannot be written: {problem.strerror}")
    sys.exit(NOT_WRITTEN)


def _print_error(sentence: str) -> None:
    """One line on stderr, if that takes it."""
    shown = "".join(each if each.isprintable() else repr(each)[1:-1] for each in sentence)
    try:
        click.echo(f"planar: {shown}", err=True)
    except OSError:
        from planar.foundation.safe_files import discard_stream

        discard_stream(sys.stderr)
