"""What goes to the screen or into a pipe whose alphabet lacks letters, as that of a console of Windows may."""

from __future__ import annotations

import codecs
import json
import sys
import unicodedata
from typing import Any

import click

from planar.foundation.errors import Outcome

TIME_LIMIT = "planar.time_limit"
"""Where a command's context keeps the time limit of what it computes."""
ERROR_HANDLER = "planar.plain_letters"
PLAIN_LETTERS = {
    "α": "alpha",
    "ε": "epsilon",
    "θ": "theta",
    "λ": "lambda",
    "μ": "u",
    "µ": "u",
    "φ": "phi",
    "ω": "omega",
    "Δ": "Delta",
    "Ω": "Omega",
    "×": "x",
    "±": "+-",
    "·": ".",
    "−": "-",
    "–": "-",
    "—": "-",
    "─": "-",
    "━": "-",
    "│": "|",
    "•": "*",
    "→": "->",
    "∥": "||",
    "⊥": "_|_",
    "∞": "infinite",
    "°": " deg",
    "′": "'",
    "″": "''",
    "‴": "'''",
    "…": "...",
    "’": "'",
    "\N{NO-BREAK SPACE}": " ",
}
"""What stands for a letter that cannot be shown, of one character where that reads well."""


def allow_every_letter() -> None:
    """Let what is printed show letters that its streams lack by others, and never fail for them."""
    codecs.register_error(ERROR_HANDLER, _replace_letters)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors=ERROR_HANDLER)


def print_json(value: Any, indent: int | None = None, allow_nan: bool = False) -> None:
    """Print a JSON value; in other alphabets than that of Unicode in plain letters alone, which programs read alike.

    Of a computation that ended early it says so: `outcome` and `reason` are added to an object, a list stands in one.
    """
    reason = ended_early()
    if reason:
        value = dict(value) if isinstance(value, dict) else {"found": value}
        if value.get("outcome") != Outcome.INTERRUPTED.value or not value.get("reason"):
            value |= {"outcome": Outcome.INTERRUPTED.value, "reason": reason}
    plain = not (getattr(sys.stdout, "encoding", None) or "").lower().startswith("utf")
    click.echo(json.dumps(value, ensure_ascii=plain, indent=indent, allow_nan=allow_nan))


def ended_early() -> str:
    """Why what the command computes ended before it was done; empty where it did not."""
    context = click.get_current_context(silent=True)
    limit = None if context is None else context.meta.get(TIME_LIMIT)
    return "" if limit is None else limit.ended_by


def is_ended_by_user() -> bool:
    """Whether it was Ctrl-C that ended it."""
    context = click.get_current_context(silent=True)
    limit = None if context is None else context.meta.get(TIME_LIMIT)
    return limit is not None and limit.is_interrupted


def _replace_letters(problem: UnicodeError) -> tuple[str, int]:
    if not isinstance(problem, UnicodeEncodeError):
        raise problem
    found, before = [], problem.object[: problem.start][-1:]
    for each in problem.object[problem.start : problem.end]:
        found.append(_plain_letter(each, before))
        before = each
    return "".join(found), problem.end


def _plain_letter(letter: str, before: str) -> str:
    if letter in PLAIN_LETTERS:
        return PLAIN_LETTERS[letter]
    kind, _, _ = unicodedata.decomposition(letter).partition(" ")
    if kind not in ("<sub>", "<super>"):
        return letter.encode("ascii", "backslashreplace").decode()  # a name's, which is to be known again
    level = unicodedata.normalize("NFKD", letter).replace("−", "-")
    goes_on = before and unicodedata.decomposition(before).startswith(kind)
    return level if kind == "<sub>" or goes_on else f"^{level}"
