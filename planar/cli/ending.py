"""How every command ends: one sentence and an exit status, whatever went wrong."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from types import MappingProxyType
from typing import Any

import click

from planar.errors import BadInput, MissingGlyphs, NoAnswer

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
        with _ending(), _missing_glyphs_named():
            return super().invoke(ctx)


@contextmanager
def _ending() -> Iterator[None]:
    try:
        yield
    except BadInput as problem:
        _refuse(str(problem), "bad input", str(problem), BAD_INPUT)
    except NoAnswer as problem:
        _refuse(str(problem), problem.outcome.value, problem.reason, NO_ANSWER, problem.more)
    except click.UsageError as problem:
        told = problem.format_message().rstrip(".").replace(". Did", "; did").replace(". (", " (")
        if not told.endswith(("?", "?)")):
            told += f"; see `{problem.ctx.command_path if problem.ctx else 'planar'} --help`"
        wrong = str(BadInput("command line", told[0].lower() + told[1:]))
        _refuse(wrong, "bad input", wrong, BAD_INPUT)


@contextmanager
def _missing_glyphs_named() -> Iterator[None]:
    """What no font can show is named in one line, however many texts have it; other warnings go their way."""
    found: set[str] = set()
    before = warnings.showwarning

    def collect(message: Warning | str, *rest: Any) -> None:
        if isinstance(message, MissingGlyphs):
            found.update(message.characters)
        else:
            before(message, *rest)

    with warnings.catch_warnings():
        warnings.simplefilter("always", MissingGlyphs)
        warnings.showwarning = collect
        yield
    if found:
        click.echo(f"planar: {MissingGlyphs(found)}", err=True)


def _refuse(
    sentence: str, outcome: str, reason: str, status: int, more: Mapping[str, Any] = MappingProxyType({})
) -> None:
    if "--json" in sys.argv:
        click.echo(json.dumps({"outcome": outcome, "reason": reason, **more}, ensure_ascii=False))
    shown = "".join(each if each.isprintable() else repr(each)[1:-1] for each in sentence)
    click.echo(f"planar: {shown}", err=True)
    sys.exit(status)
