"""Forces over a grid of inputs as a table of worst cases, as columns, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.force_maps.force_map import ForceMap
from planar.analysis.force_maps.worst_cases import WorstCase
from planar.foundation.arrays import Array
from planar.foundation.errors import Outcome
from planar.model.mechanism import relative_motions
from planar.model.wording import amount, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import paragraphs, quantity_text


def table(found: ForceMap) -> RenderableType:
    """The worst cases, and what is said of them and of what is not reached."""
    head = [Text(found.mechanism.name, style="bold")]
    if found.mechanism.source:
        head.append(Text(found.mechanism.source, style="italic"))
    return Group(*head, Text(), _worst_table(found), Text(), paragraphs((" -", told) for told in _remarks(found)))


def _worst_table(found: ForceMap) -> FittedTable:
    units = found.mechanism.units
    title = f"Worst cases over {join_all_names([*found.over])}"
    shown = plain_table(title, "at", "what", "value", *found.over, left=(0, 1))
    for each in found.worst:
        value = "no bound" if each.is_unbounded else quantity_text(each.value, _kind(found, each), units)
        shown.add_row(each.of, each.kind, value, *(_position(found, name, at) for name, at in each.at.items()))
    return shown


def _kind(found: ForceMap, worst: WorstCase) -> str:
    if worst.kind.endswith("effort"):
        return "force" if found.forces.is_force_input(worst.of) else "torque"
    return "torque" if worst.kind == "couple" else "force"


def _position(found: ForceMap, name: str, at: float) -> str:
    kind = relative_motions(found.mechanism)[name].input_kind.value
    return amount(at, kind, found.mechanism.units)


def _remarks(found: ForceMap) -> Iterator[str]:
    many, reached = found.is_reached.size, int(found.is_reached.sum())
    yield f"{many} positions, {' by '.join(map(str, found.shape))}; extremes are solved for between them"
    for outcome in Outcome:
        beyond = int((found.outcomes == [*Outcome].index(outcome)).sum())
        if outcome is not Outcome.SOLVED and beyond:
            yield f"{beyond} positions are not reached: a {outcome.value} lies before them"
    if reached < many and not any(each.is_unbounded for each in found.worst):
        yield "no force grows without bound where the motion ends"
    by_place: dict[str, list[str]] = {}
    for each in found.worst:
        if each.remark:
            by_place.setdefault(each.remark, []).append(f"the {each.kind} at {each.of}")
    for remark, names in by_place.items():
        yield f"{join_all_names(names)} {remark if len(names) == 1 else remark.replace('grows', 'grow', 1)}"


def record(found: ForceMap) -> dict[str, Any]:
    """The map as JSON values (SI), `null` where there is none."""
    return {
        "mechanism": found.mechanism.name,
        "over": {name: each.tolist() for name, each in found.over.items()},
        "worst": [
            {
                "kind": each.kind,
                "of": each.of,
                "value": None if each.is_unbounded else each.value,
                "at": dict(each.at),
                "unbounded": each.is_unbounded,
                "remark": each.remark,
            }
            for each in found.worst
        ],
        "outcome": np.array([each.value for each in Outcome])[found.outcomes].tolist(),
        "effort": {name: _values(each) for name, each in found.effort.items()},
        "reaction": {name: _values(each) for name, each in found.reaction.items()},
        "couple": {name: _values(each) for name, each in found.couple.items()},
    }


def _values(numbers: Array) -> Any:
    known: Array = np.where(np.isfinite(numbers), numbers, 0.0).astype(object)
    known[~np.isfinite(numbers)] = None
    return known.tolist()
