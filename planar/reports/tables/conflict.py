"""Conflicts and their remedies as text for a terminal and as JSON values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from planar.assemblies.circuits.circuits import Circuits
from planar.assemblies.conflict import Conflict
from planar.assemblies.polynomial.completeness import Completeness
from planar.model.mechanism import relative_motions
from planar.model.wording import amount, join_all_names
from planar.reports.fitted_table import plain_table
from planar.reports.number_format import paragraphs
from planar.solving.diagnosis.remedy import RemedyChange


def conflict_table(conflict: Conflict, runs: Sequence[Circuits]) -> RenderableType:
    """The pairs in conflict, the changes of one number that mend it, and where the inputs let it go together."""
    units = conflict.mechanism.units
    head = [Text(conflict.mechanism.name, style="bold"), Text(), Text("Why it does not go together", style="bold")]
    parts: list[RenderableType] = [
        *head,
        paragraphs((" -", each) for each in (*conflict.remarks, *map(_range_sentence, runs))),
    ]
    changes = (*conflict.dimensions, *conflict.positions)
    if changes:
        table = plain_table("It would go together with one of these changed", "what", "to", "instead of", "change")
        for each in changes:
            by = amount(each.value - each.was, each.kind, units)
            table.add_row(each.name, each.shown, amount(each.was, each.kind, units), by)
        parts += [Text(), table]
    return Group(*parts)


def _range_sentence(run: Circuits) -> str:
    """Where one input lets the mechanism go together."""
    kind, units = relative_motions(run.mechanism)[run.pair].input_kind.value, run.mechanism.units
    known = "as far as known" if run.complete is Completeness.NOT else run.complete.value
    ranges = [f"from {amount(low, kind, units)} to {amount(high, kind, units)}" for low, high in run.assembles]
    where = join_all_names(ranges) if ranges else "nowhere"
    return f"it goes together with the input at {run.pair!r} {where}, {known}"


def conflict_record(conflict: Conflict, runs: Sequence[Circuits]) -> dict[str, Any]:
    """The same as a JSON value, in SI units."""
    return {
        "pairs": list(conflict.pairs),
        "inputs": list(conflict.inputs),
        "complete": conflict.complete.value,
        "dimensions": [_change_record(each) for each in conflict.dimensions],
        "positions": [_change_record(each) for each in conflict.positions],
        "assembles": {
            run.pair: {"intervals": [list(each) for each in run.assembles], "complete": run.complete.value}
            for run in runs
        },
        "remarks": [*conflict.remarks],
    }


def _change_record(change: RemedyChange) -> dict[str, Any]:
    return {"name": change.name, "was": change.was, "value": change.value}
