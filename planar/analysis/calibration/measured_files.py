"""What the columns of a table of measurements are of a mechanism, in SI."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from planar.derivatives.result_slopes import position_results
from planar.document.tables.measured_table import MeasuredColumn, MeasuredTable
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, join_names, suggest_spelling
from planar.foundation.units import UnitError, parse_unit
from planar.model.mechanism import Mechanism, relative_motions
from planar.results.motion import State
from planar.solving.position import solve


class MeasuredColumns(NamedTuple):
    """What `planar.calibrate` takes of a table: `measured`, `inputs`, and the columns that it has no use for."""

    measured: dict[str, dict[str, Array]]
    inputs: dict[str, Array]
    unused: tuple[str, ...]


class _Meaning(NamedTuple):
    """What a column is: of an input, or of a result by name, with its part."""

    kind: str
    name: str
    result: str = ""
    part: int = 0
    is_input: bool = False


def read_columns(mechanism: Mechanism, table: MeasuredTable) -> MeasuredColumns:
    """The columns by what they are of the mechanism; heads are those of its runs. Raises BadInput."""
    state = solve(mechanism)
    meanings = dict(_column_meanings(mechanism, state))
    parts: dict[tuple[str, str], dict[int, Array]] = {}
    inputs: dict[str, Array] = {}
    unused = []
    for column in table.columns:
        meaning = meanings.get(column.name) or _distance_meaning(state, column.name)
        if meaning is None:
            if not _is_other_quantity(column):
                near = suggest_spelling(column.name, meanings, "is it {!r}?")
                meant = near or f"; there are such as {join_names(list(meanings)[:6])}"
                raise BadInput(str(table.path), f"the column {column.name!r} names nothing that can be measured{meant}")
            unused.append(column.name)
            continue
        values = _si_values(mechanism, table, column, meaning.kind)
        if meaning.is_input:
            inputs[meaning.name] = values
        else:
            parts.setdefault((meaning.name, meaning.result), {})[meaning.part] = values
    measured: dict[str, dict[str, Array]] = {}
    for (name, result), own in parts.items():
        if result == "position":
            if len(own) < 2:
                raise BadInput(str(table.path), f"of the point {name!r} there is only one of the columns x and y")
            measured.setdefault(name, {})[result] = np.stack([own[0], own[1]], axis=1)
        else:
            measured.setdefault(name, {})[result] = own[0]
    if not measured:
        raise BadInput(str(table.path), "no column is of a point, a link's angle, a pair or a distance of two points")
    return MeasuredColumns(measured, inputs, tuple(unused))


def _column_meanings(mechanism: Mechanism, state: State) -> Iterator[tuple[str, _Meaning]]:
    motions = relative_motions(mechanism)
    for given in mechanism.inputs:
        kind = motions[given.pair].input_kind.value
        yield f"input {given.pair} position", _Meaning(kind, given.pair, is_input=True)
    for name in state.point_names:
        for part, axis in enumerate("xy"):
            yield f"{name} {axis}", _Meaning("length", name, "position", part)
    for name in state.frames:
        if name not in state.point_names and name != mechanism.frame:
            yield f"{name} angle", _Meaning("angle", name, "angle")
    for name in motions:
        for result, each in position_results(state, name).items():
            if result not in ("position", "angle") or name not in (*state.point_names, *state.frames):
                yield f"pair {name} {result.replace('_', ' ')}", _Meaning(each.kind, name, result)


def _distance_meaning(state: State, head: str) -> _Meaning | None:
    name = head.removesuffix(" distance")
    ends = name.split(" to ")
    return _Meaning("length", name, "distance") if len(ends) == 2 and {*ends} <= {*state.point_names} else None


def _is_other_quantity(column: MeasuredColumn) -> bool:
    """Whether a column is of a run, but no length and no angle: times, rates, forces."""
    try:
        return bool(column.unit) and parse_unit(column.unit).kind not in ("length", "angle")
    except UnitError:
        return column.unit in ("1", "-")


def _si_values(mechanism: Mechanism, table: MeasuredTable, column: MeasuredColumn, kind: str) -> Array:
    try:
        unit = parse_unit(column.unit or getattr(mechanism.units, kind))
    except UnitError as problem:
        raise BadInput(str(table.path), f"the column {column.name!r}: {problem}") from None
    if unit.kind != kind:
        raise BadInput(
            str(table.path), f"the column {column.name!r} is a {kind}, and {column.unit} measures {unit.kind}"
        )
    numbers: list[Any] = [np.nan if each is None else unit.to_si(each) for each in column.numbers]
    return np.array(numbers, dtype=float)
