"""All circuits of a mechanism and their branches as text for a terminal, and as JSON values."""

from __future__ import annotations

from math import pi
from typing import Any

from rich.console import Group as Stack
from rich.console import RenderableType
from rich.text import Text

from planar.assemblies.circuits.circuit_of_assembly import MAX_LOCATED, LocatedAssembly, locate_assemblies
from planar.assemblies.circuits.circuits import Circuit, Circuits
from planar.assemblies.circuits.traced_circuit import Branch
from planar.assemblies.modes import Modes
from planar.assemblies.selection import selection_words
from planar.foundation.units import parse_unit
from planar.model.mechanism import relative_motions
from planar.model.wording import amount, count_phrase, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import format_number, paragraphs


def table(circuits: Circuits, modes: Modes) -> RenderableType:
    """How many circuits there are, where each branch begins and ends, and where the assemblies at the input lie."""
    head = [Text(circuits.mechanism.name, style="bold"), Text(_running_text(circuits)), Text(count_text(circuits))]
    lying = locate_assemblies(circuits, modes)
    told = list(circuits.remarks)
    if len(lying) == MAX_LOCATED:
        told.append(f"of the assemblies here the first {MAX_LOCATED} are located")
    lost = [str(each.mode.number) for each in lying if each.circuit is None]
    if lost:
        told.append(f"of the assemblies here on none of these circuits: {join_all_names(lost)}")
    tables = [_branches_table(circuits, lying)] if len(circuits) else []
    tables += [_intervals_table(circuits)] if circuits.intervals else []
    return Stack(*head, Text(), *tables, Text(), paragraphs((" -", sentence) for sentence in told))


def count_text(circuits: Circuits) -> str:
    """How many circuits there are, how sure that is, and where it goes together."""
    there = f"{count_phrase(len(circuits), 'circuit')}, {circuits.complete.value}"
    return f"{there}; {_assembly_range_text(circuits)}"


def _assembly_range_text(circuits: Circuits) -> str:
    if not circuits.assembles:
        return "no position of the input was found at which it goes together"
    if _is_range_unknown(circuits):
        return "where else it goes together is not known"
    if _assembles_all_round(circuits):
        return "it goes together all round"
    ends = [" to ".join(_position_text(circuits, end) for end in both) for both in circuits.assembles]
    return f"it goes together with {circuits.pair} from {join_all_names(ends)}"


def _is_range_unknown(circuits: Circuits) -> bool:
    """Whether it is not known at which positions of the input it goes together."""
    return all(each.assemblies is None for each in circuits.intervals)


def _assembles_all_round(circuits: Circuits) -> bool:
    """Whether it goes together at every position of an input that turns."""
    return not _is_sliding_input(circuits) and any(
        high - low >= 2.0 * pi * (1.0 - 1e-9) for low, high in circuits.assembles
    )


def _running_text(circuits: Circuits) -> str:
    """Which input runs, and where the others stand."""
    named, units = relative_motions(circuits.mechanism), circuits.mechanism.units
    rest = [
        f"{given.pair} = {amount(given.position, named[given.pair].input_kind.value, units)}"
        for given in circuits.mechanism.inputs
        if given.pair != circuits.pair
    ]
    return f"input {circuits.pair} running" + (f", {join_all_names(rest)} held" if rest else "")


def _branches_table(circuits: Circuits, lying: tuple[LocatedAssembly, ...]) -> FittedTable:
    at = _position_text(circuits, _file_position(circuits))
    rows = plain_table(
        "Circuits and branches",
        "circuit",
        "branch",
        (f"from, {_input_unit(circuits)}", f"to, {_input_unit(circuits)}", "ends"),
        f"assemblies at, {at}",
        left=(4, 5),
        keys=2,
    )
    for circuit in circuits:
        for branch in circuit.branches:
            here = [
                f"{each.mode.number}{f', {selection_words(circuits.mechanism)}' if each.is_sketched else ''}"
                for each in lying
                if each.is_on(circuit, branch)
            ]
            ends = [_position_cell(circuits, end) for end in (branch.low, branch.high)]
            rows.add_row(
                str(circuit.number), str(branch.number), *ends, _ends_text(branch), join_all_names(here) if here else ""
            )
    return rows


def _ends_text(branch: Branch) -> str:
    """What stands at the ends: goes all round, dead points, dead point and without end."""
    if branch.turns:
        return "goes all round" if branch.turns == 1 else f"back after {branch.turns} turns"
    low, high = branch.ends
    return f"{low}s" if low == high == "dead point" else low if low == high else f"{low} and {high}"


def _intervals_table(circuits: Circuits) -> FittedTable:
    rows = plain_table(
        "Intervals of the input",
        (f"from, {_input_unit(circuits)}", f"to, {_input_unit(circuits)}"),
        "assemblies",
        left=(),
        keys=0,
    )
    for each in circuits.intervals:
        many_ = "?" if each.assemblies is None else str(each.assemblies)
        rows.add_row(_position_cell(circuits, each.low), _position_cell(circuits, each.high), many_)
    return rows


def _is_sliding_input(circuits: Circuits) -> bool:
    return relative_motions(circuits.mechanism)[circuits.pair].input_kind.value == "length"


def _input_unit(circuits: Circuits) -> str:
    units = circuits.mechanism.units
    return units.length if _is_sliding_input(circuits) else units.angle


def _position_cell(circuits: Circuits, position: float) -> str:
    return format_number(parse_unit(_input_unit(circuits)).from_si(float(position)))


def _position_text(circuits: Circuits, position: float) -> str:
    return amount(float(position), "length" if _is_sliding_input(circuits) else "angle", circuits.mechanism.units)


def _file_position(circuits: Circuits) -> float:
    """Where the file has the input that runs."""
    return next(given.position for given in circuits.mechanism.inputs if given.pair == circuits.pair)


def record(circuits: Circuits, modes: Modes) -> dict[str, Any]:
    """The circuits and branches as a JSON value, in SI units."""
    lying = locate_assemblies(circuits, modes)
    refused = None if modes else modes.refusal()

    def told(circuit: Circuit, branch: Branch) -> dict[str, Any]:
        here = [each.mode.number for each in lying if each.is_on(circuit, branch)]
        return branch._asdict() | {"modes": here}

    return {
        "mechanism": circuits.mechanism.name,
        "outcome": (refused.outcome if refused else circuits.outcome).value,
        "reason": refused.reason if refused else circuits.reason,
        "input": circuits.pair,
        "inputs": {given.pair: given.position for given in circuits.mechanism.inputs},
        "complete": circuits.complete.value,
        "critical": list(circuits.critical),
        "assembles": None if _is_range_unknown(circuits) else [list(both) for both in circuits.assembles],
        "intervals": [each._asdict() for each in circuits.intervals],
        "nearest": next((each.mode.number for each in lying if each.is_sketched), None),
        "circuits": [
            {
                "number": circuit.number,
                "closed": circuit.closed,
                "branches": [told(circuit, branch) for branch in circuit.branches],
            }
            for circuit in circuits
        ],
        "remarks": [*circuits.remarks],
    }
