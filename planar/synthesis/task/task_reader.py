"""A task's file, or what stands in one, to a SynthesisTask; or BadInput with the place in the file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

from planar.document.cursor import Cursor, FileContext, describe_value
from planar.document.files import find_model_file, load, load_value
from planar.document.reader import read_mechanism, read_units
from planar.document.schema import FORMAT_VERSION
from planar.document.writer import write_mechanism
from planar.foundation.errors import BadInput, suggest_name
from planar.foundation.safe_files import is_existing
from planar.model.mechanism import Mechanism
from planar.synthesis.task.demands_reader import read_demands
from planar.synthesis.task.synthesis_task import ChainStart, SynthesisTask, Wanted
from planar.synthesis.task.task_numbers import start_numbers
from planar.synthesis.task.task_schema import CHAIN_START_SCHEMA, GREATEST_CHAIN, LEAST_CHAIN, TASK_SCHEMA
from planar.synthesis.task.task_writer import write_task
from planar.synthesis.task.wanted_reader import WantedReader

TaskSource = Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask
"""A task, what stands in its file, or the file."""


def read_task(source: TaskSource) -> SynthesisTask:
    """The task in a file, or that a JSON value describes; "-" is what is piped in. Raises BadInput with the place.

    A SynthesisTask made in Python is checked as its file would be.

    >>> import planar
    >>> wanted = [{"point": "E", "through": [["0 mm", "0 mm"], ["20 mm", "12 mm"]]}]
    >>> planar.read_task({"planar": 1, "name": "Lid", "start": "four-bar", "wanted": wanted})
    <SynthesisTask 'Lid': 2 wanted entries>
    """
    if isinstance(source, SynthesisTask):
        return _TaskReader(Path()).read(Cursor(write_task(source)))
    if isinstance(source, str | os.PathLike):
        return _TaskReader(Path(os.fsdecode(source)).parent).read(Cursor(load_value(source, "a task's file")))
    if isinstance(source, Mapping):
        return _TaskReader(Path()).read(Cursor(_with_written_starts(source)))
    told = f"{type(source).__name__} {source!r:.60}"
    raise BadInput("task", f"a task's file, or what stands in one, is wanted, not {told}")


def _with_written_starts(source: Mapping[str, Any]) -> dict[str, Any]:
    """The value of a task in which a start may be a Mechanism, with these as their files have them."""

    def written(start: Any) -> Any:
        return write_mechanism(start) if isinstance(start, Mechanism) else start

    value = dict(source)
    if "start" in value:
        start = value["start"]
        value["start"] = [written(each) for each in start] if isinstance(start, list) else written(start)
    return value


class _TaskReader:
    """`folder` is where files to start from are looked for first."""

    def __init__(self, folder: Path):
        self.folder = folder

    def read(self, top: Cursor) -> SynthesisTask:
        """The task that the value of a file describes. Raises BadInput."""
        top.check_json()
        top.check_keys(*TASK_SCHEMA)
        version = top["planar"].value
        if version != FORMAT_VERSION or isinstance(version, bool):
            told = f"the format is to be the number {FORMAT_VERSION}, not {describe_value(version)}"
            raise top.error_at("planar", told)
        units = read_units(top)
        top = replace(top, context=FileContext(units))
        starts = self._read_starts(top["start"])
        mechanisms = () if isinstance(starts, ChainStart) else starts
        reader = WantedReader(mechanisms)
        wanted = tuple(reader.read(each) for each in top["wanted"].items())
        if not wanted:
            raise top.error_at("wanted", "nothing is wanted: give a path, poses, or a function")
        numbers = NumberNames(mechanisms, wanted)
        free = numbers.read_free(top["free"]) if top.has("free") else ()
        return SynthesisTask(
            (top["name"].as_line().strip() if top.has("name") else "") or "task",
            wanted,
            starts,
            free,
            numbers.read_bounds(top.object_at("within"), free) if top.has("within") else {},
            read_demands(top.list_items("demands"), mechanisms),
            units,
        )

    def _read_starts(self, cursor: Cursor) -> tuple[Mechanism, ...] | ChainStart:
        value = cursor.value
        if isinstance(value, dict) and "chains" in value:
            cursor.check_keys(*CHAIN_START_SCHEMA)
            return ChainStart(_read_chain_sizes(cursor))
        found = [self._read_start(each) for each in (cursor.items() if isinstance(value, list) else [cursor])]
        if not found:
            raise cursor.error_at(None, "a mechanism to start from is wanted here, or several")
        return tuple(found)

    def _read_start(self, cursor: Cursor) -> Mechanism:
        if isinstance(cursor.value, dict):
            try:
                found = read_mechanism(cursor.value)
            except BadInput as problem:
                raise BadInput(problem.place.replace("$", cursor.path, 1), problem.sentence) from None
        else:
            name = cursor.as_text()
            beside = self.folder / name
            is_beside = is_existing(beside) and beside.is_file()
            try:
                found = load(beside if is_beside else find_model_file(name))
            except BadInput as problem:
                raise cursor.error_at(None, f"{problem.place}: {problem.sentence}") from None
        if not found.inputs:
            raise cursor.error_at(None, f"{found.name!r} has no input that could run; give it 'inputs'")
        return found


def _read_chain_sizes(cursor: Cursor) -> tuple[int, ...]:
    links = []
    for each in cursor["chains"].items():
        number = each.as_number()
        if not number.is_integer() or not LEAST_CHAIN <= number <= GREATEST_CHAIN:
            told = f"a whole number of links from {LEAST_CHAIN} to {GREATEST_CHAIN} is wanted here"
            raise each.error_at(None, f"{told}, not {describe_value(each.value)}")
        links.append(int(number))
    if not links:
        raise cursor.error_at("chains", "numbers of links are wanted here, as [4, 6]")
    return tuple(dict.fromkeys(links))


class NumberNames:
    """The names by which a task's file names numbers of its starts."""

    def __init__(self, starts: Sequence[Mechanism], wanted: Sequence[Wanted]):
        self.starts = tuple(starts)
        self.known = [start_numbers(start, wanted) for start in starts]

    def find(self, cursor: Cursor, name: str) -> tuple[str, ...]:
        """The names of one number of all starts, or of both coordinates of a point."""
        if not self.starts:
            raise cursor.error_at(None, "chains have no numbers yet that could be named; leave this out")
        every = [_own_names(name, known) for known in self.known]
        for start, known, found in zip(self.starts, self.known, every, strict=True):
            if not found:
                told = suggest_name(name, known, "numbers")
                raise cursor.error_at(None, f"{start.name!r} has no number {name!r} of links or pairs{told}")
            if found != every[0]:
                told = f"{name!r} is {' and '.join(found)} in {start.name!r}, but {' and '.join(every[0])} in"
                raise cursor.error_at(None, f"{told} {self.starts[0].name!r}; name what all starts have")
        return every[0]

    def read_free(self, cursor: Cursor) -> tuple[str, ...]:
        """The names of the numbers that are sought, each once."""
        found = tuple(dict.fromkeys(name for each in cursor.items() for name in self.find(each, each.as_text())))
        if not found:
            raise cursor.error_at(None, "no number is free: name some, or leave 'free' out for all")
        return found

    def read_bounds(self, cursor: Cursor, free: Sequence[str]) -> dict[str, tuple[float, float]]:
        """Bounds by name (SI), infinite where there is none; of free numbers alone, where these are named."""
        found: dict[str, tuple[float, float]] = {}
        for name, each in cursor.members():
            names = self.find(each, name)
            fixed = [other for other in names if free and other not in free]
            if fixed:
                raise each.error_at(None, f"{fixed[0]!r} is not among those that are 'free', so it needs no bounds")
            for other in names:
                if other in found:
                    raise each.error_at(None, f"{other!r} has bounds already, under another name")
                found[other] = _read_bound_pair(each, self.known[0][other].kind)
        return found


def _own_names(name: str, known: Iterable[str]) -> tuple[str, ...]:
    every = list(known)
    return (name,) if name in every else tuple(each for each in every if each.startswith(f"{name}."))


def _read_bound_pair(cursor: Cursor, kind: str) -> tuple[float, float]:
    def bounds() -> Iterator[float | None]:
        for each in cursor.items():
            if each.value is None:
                yield None
            else:
                yield each.as_number() if kind == "number" else each.as_quantity(kind)

    both = tuple(bounds())
    if len(both) == 2:
        low, high = -inf if both[0] is None else both[0], inf if both[1] is None else both[1]
        if low < high:
            return low, high
    raise cursor.error_at(None, "a lower and an upper bound are wanted here, as [20, 80], the lower first")
