"""Whether printed numbers depend on the number of steps of a run; `python -m tests.step_independence` asks all models.

A number that is printed without "among these positions" is solved for, so it has the same six digits for every number
of steps. Run by hand over all models and commands:

    nice .venv/bin/python -m tests.step_independence [MODEL ...]
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.command import ROOT, run

STEPS = (90, 91, 1440)
AMONG = "among these positions"
ROUND_OFF = re.compile(
    r"exactly|round-off|digits|residual|energy that changes|positions?;|^\d+ positions|steps|rows? without"
    r"|of \d+ positions|balances as a free body|all powers add up"
)
"""Lines that say how well laws are kept, or how many positions there are: no results of the mechanism."""
NUMBER = re.compile(r"(?<![\w.])[-−]?\d+(?:\.\d+)?(?:e[-+]\d+)?")
SIXTH_DIGIT = 1.05e-5
"""Relative: two numbers of six digits that differ by rounding differ by one in the sixth, 1e-5 at most."""
NOTHING = 1e-9
"""SI or a file's units: what is smaller is round-off of a sum."""

COMMANDS: tuple[tuple[str, ...], ...] = (
    ("cycle",),
    ("cycle", "--json"),
    ("forces", "--cycle"),
    ("forces", "--cycle", "--fluctuation", "0.02"),
    ("forces", "--cycle", "--json", "--fluctuation", "0.02"),
    ("forces", "--cycle", "--static", "--without-friction"),
    ("balance",),
)
"""Commands over a motion that print results, without the model and the number of steps."""


def solved_lines(text: str) -> Iterator[str]:
    """The lines of a printed result that claim to be solved for: tables and sentences without `AMONG`."""
    for paragraph in _paragraphs(text):
        if AMONG not in " ".join(paragraph):
            yield from (" ".join(line.split()) for line in paragraph if not ROUND_OFF.search(line))


def _paragraphs(text: str) -> Iterator[list[str]]:
    """Tables with their titles, the line above a line of blanks and a rule; other lines one by one."""
    lines = text.splitlines()
    tables: dict[int, int] = {}
    for k, line in enumerate(lines):
        if line.strip() and not line.strip(" ─"):
            first = max((i for i in range(k) if _is_blank(lines[i])), default=0) - 1
            last = next((i for i in range(k, len(lines)) if _is_blank(lines[i])), len(lines))
            tables[max(first, 0)] = last
    k = 0
    while k < len(lines):
        stop = tables.get(k, k + 1)
        if lines[k].strip():
            yield [line for line in lines[k:stop] if line.strip(" ─")]
        k = stop


def _is_blank(line: str) -> bool:
    return not line.strip()


def differences(first: str, second: str) -> list[tuple[str, str]]:
    """Lines of two outputs whose solved numbers differ in their sixth digit, or whose words differ."""
    before, after = list(solved_lines(first)), list(solved_lines(second))
    pairs = [(a, b) for a, b in zip(before, after, strict=False) if not _agree(a, b)]
    if len(before) != len(after):
        pairs.append((f"{len(before)} lines", f"{len(after)} lines"))
    return pairs


def _agree(first: str, second: str) -> bool:
    if NUMBER.sub("#", first) != NUMBER.sub("#", second):
        return False
    return all(
        abs(a - b) <= SIXTH_DIGIT * max(abs(a), abs(b)) or max(abs(a), abs(b)) < NOTHING
        for a, b in zip(_numbers(first), _numbers(second), strict=True)
    )


def _numbers(line: str) -> list[float]:
    return [float(each.replace("−", "-")) for each in NUMBER.findall(line)]


def compare_steps(
    folder: Path, words: Sequence[str], model: str, steps: Sequence[int] = STEPS
) -> list[tuple[int, str, str]]:
    """What a command prints differently for a model with other numbers of steps than the first: (steps, line, line)."""
    command, *options = words
    results = [run(folder, command, model, "--steps", str(count), *options, COLUMNS="400") for count in steps]
    if any(each.status for each in results):
        return [(0, results[0].err, each.err) for each in results if each.status != results[0].status]
    return [
        (count, *lines)
        for count, result in zip(steps[1:], results[1:], strict=True)
        for lines in differences(_facts(results[0].out, min(steps)), _facts(result.out, min(steps)))
    ]


def _facts(text: str, row_count: int) -> str:
    """The facts of JSON, a line each, without lists of so many values, which are those of positions."""
    if not text.startswith("{"):
        return text
    return "\n".join(_json_lines("", json.loads(text), row_count))


def _json_lines(place: str, value: object, row_count: int) -> Iterator[str]:
    if isinstance(value, dict):
        for key, part in value.items():
            if key not in ("proof", "residual", "remarks", "undetermined"):
                yield from _json_lines(f"{place}.{key}", part, row_count)
    elif isinstance(value, list):
        if len(value) < row_count:
            for k, part in enumerate(value):
                yield from _json_lines(f"{place}[{k}]", part, row_count)
    else:
        yield f"{place} {value}"


def check_models(models: Sequence[str], commands: Sequence[Sequence[str]] = COMMANDS) -> int:
    """Print what depends on the number of steps, over models and commands; how many lines these are."""
    count = 0
    with TemporaryDirectory() as folder:
        for model in models:
            for words in commands:
                try:
                    found = compare_steps(Path(folder), words, model)
                except Exception as problem:
                    found = [(0, type(problem).__name__, str(problem)[:200])]
                count += len(found)
                for steps, before, after in found:
                    title = f"{Path(model).stem}: {' '.join(words)}, {STEPS[0]} and {steps} steps"
                    print(title, before, after, sep="\n  ", flush=True)
    return count


if __name__ == "__main__":
    all_models = sorted(str(each) for each in (ROOT / "models").rglob("*.json"))
    print(check_models(sys.argv[1:] or all_models), "lines depend on the number of steps")
