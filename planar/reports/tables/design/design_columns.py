"""All designs of a synthesis as columns, and as the content of a CSV file: numbers, misses, inputs, with units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.document.dimensions import file_dimensions
from planar.model.file_units import display_unit
from planar.reports.files.csv import csv_cell
from planar.synthesis.synthesis import Synthesis, SynthesisedDesign
from planar.synthesis.task.starts import miss_kind, motion_kind, wanted_miss_kind

UNITLESS = "number"
"""The kind of what has no unit."""


class DesignColumn(NamedTuple):
    """What is told of every design: texts, or numbers in the unit, None where there is none."""

    name: str
    unit: str
    values: tuple[str | float | None, ...]

    @property
    def head(self) -> str:
        """Name and unit, as "AB.length [mm]"."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def design_columns(found: Synthesis, names: Sequence[str]) -> Iterator[DesignColumn]:
    """The sound designs, then those rejected, under these names: what is told of each, in the task's units."""
    every = (*found, *found.rejected)
    yield DesignColumn("design", "", tuple(names))
    yield DesignColumn("start", "", tuple(each.start for each in every))
    kind = miss_kind(found.task)
    yield _quantities(found, "root mean square", kind, [each.error for each in every])
    yield _quantities(found, "greatest miss", kind, [each.greatest_miss for each in every])
    if found.task.wants_places:
        shares = [100.0 * each.greatest_miss / found.size for each in every]
        yield DesignColumn("of the extent", "%", _finite(shares))
    motions = [each.motion for each in every]
    yield DesignColumn("input", "", tuple(None if each is None else each.pair for each in motions))
    turns = (None if each is None else "yes" if each.is_whole_turn else "no" for each in motions)
    yield DesignColumn("whole turn", "", tuple(turns))
    yield from _inputs(found, every, "input from", [None if each is None else each.low for each in motions])
    yield from _inputs(found, every, "input to", [None if each is None else each.high for each in motions])
    least = [None if each is None else each.least_transmission for each in motions]
    angles = [None if each is None else each.value for each in least]
    yield _quantities(found, "least transmission angle", "angle", angles)
    yield from _entries(found, every)
    yield from _numbers(found, every)
    yield DesignColumn("defects", "", tuple("; ".join(each.defects) for each in every))


def _entries(found: Synthesis, every: Sequence[SynthesisedDesign]) -> Iterator[DesignColumn]:
    """Of every entry of what is wanted how far each design misses it, and where the input is there."""
    for item, wanted in enumerate(found.task.wanted):
        named = f"{wanted.of}" if len(found.task.wanted) == 1 else f"{wanted.of} ({item + 1})"
        for entry in range(len(wanted.weights)):
            misses = [float(each.misses[item][entry]) for each in every]
            inputs = [float(each.inputs[item][entry]) for each in every]
            yield _quantities(found, f"miss of {named} {entry + 1}", wanted_miss_kind(found.task, wanted), misses)
            yield from _inputs(found, every, f"input at {named} {entry + 1}", inputs)


def _inputs(
    found: Synthesis, every: Sequence[SynthesisedDesign], name: str, values: Sequence[float | None]
) -> Iterator[DesignColumn]:
    """Positions of inputs: a column of angles, or of lengths, or both where starts are driven differently."""
    kinds = [motion_kind(each.mechanism, each.mechanism.inputs[0].pair) for each in every]
    for kind in dict.fromkeys(kinds):
        own = [value if one == kind else None for value, one in zip(values, kinds, strict=True)]
        yield _quantities(found, name, kind, own)


def _numbers(found: Synthesis, every: Sequence[SynthesisedDesign]) -> Iterator[DesignColumn]:
    """Every number that is sought of any start."""
    kinds: dict[str, str] = {}
    for each in every:
        if not each.numbers.keys() <= kinds.keys():
            known = file_dimensions(each.mechanism)
            kinds |= {name: known[name].kind for name in each.numbers}
    for name, kind in kinds.items():
        yield _quantities(found, name, kind, [each.numbers.get(name) for each in every])


def _quantities(found: Synthesis, name: str, kind: str, values: Sequence[float | None]) -> DesignColumn:
    """Quantities (SI) in the unit that is shown."""
    if kind == UNITLESS:
        return DesignColumn(name, "", _finite(values))
    unit, of = display_unit(kind, found.task.units)
    return DesignColumn(name, unit, _finite([None if each is None else of.from_si(each) for each in values]))


def _finite(values: Sequence[float | None]) -> tuple[float | None, ...]:
    return tuple(None if each is None or not np.isfinite(each) else float(each) for each in values)


def design_csv(columns: Sequence[DesignColumn]) -> str:
    """A row a design; what is not known is a blank cell."""
    lines = [",".join(csv_cell(each.head) for each in columns)]
    for row in zip(*(each.values for each in columns), strict=True):
        lines.append(",".join(_cell(value) for value in row))
    return "\n".join(lines) + "\n"


def _cell(value: str | float | None) -> str:
    if value is None:
        return ""
    return csv_cell(value) if isinstance(value, str) else repr(value)
