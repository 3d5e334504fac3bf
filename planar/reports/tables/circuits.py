"""All circuits of a mechanism and their branches as text for a terminal, and as JSON values."""

from __future__ import annotations

from math import pi
from typing import Any

from rich.console import Group as Stack
from rich.console import RenderableType
from rich.text import Text

from planar.assemblies.circuits.circuit_of_assembly import MOST, Located, located
from planar.assemblies.circuits.circuits import Branch, Circuit, Circuits
from planar.assemblies.modes import Modes
from planar.foundation.errors import Outcome
from planar.foundation.units import unit
from planar.model.mechanism import motions
from planar.model.wording import amount, listed, many
from planar.reports.fitted_table import FittedTable
from planar.reports.tables_of_numbers import number, paragraphs, plain_table


def table(circuits: Circuits, modes: Modes) -> RenderableType:
    """How many circuits there are, where each branch begins and ends, and where the assemblies at the input lie."""
    head = [Text(circuits.mechanism.name, style="bold"), Text(_running(circuits)), Text(counted(circuits))]
    lying = located(circuits, modes)
    told = list(circuits.said)
    if len(lying) == MOST:
        told.append(f"of the assemblies here the first {MOST} are located")
    lost = [str(each.mode.number) for each in lying if each.circuit is None]
    if lost:
        told.append(f"of the assemblies here on none of these circuits: {listed(lost)}")
    tables = [_branches(circuits, lying)] if len(circuits) else []
    tables += [_intervals(circuits)] if circuits.intervals else []
    return Stack(*head, Text(), *tables, Text(), paragraphs((" -", sentence) for sentence in told))


def counted(circuits: Circuits) -> str:
    """How many circuits there are, how sure that is, and where it goes together."""
    there = f"{many(len(circuits), 'circuit')}, {circuits.complete.value}"
    return f"{there}; {_assembling(circuits)}"


def _assembling(circuits: Circuits) -> str:
    if not circuits.assembles:
        return "no position of the input was found at which it goes together"
    if _round(circuits):
        return "it goes together all round"
    ends = [" to ".join(_amount(circuits, end) for end in both) for both in circuits.assembles]
    return f"it goes together with {circuits.pair} from {listed(ends)}"


def _round(circuits: Circuits) -> bool:
    """Whether it goes together at every position of an input that turns."""
    return not _slides(circuits) and any(high - low >= 2.0 * pi * (1.0 - 1e-9) for low, high in circuits.assembles)


def _running(circuits: Circuits) -> str:
    """Which input runs, and where the others stand."""
    named, units = motions(circuits.mechanism), circuits.mechanism.units
    rest = [
        f"{given.pair} = {amount(given.position, named[given.pair].drive_kind.value, units)}"
        for given in circuits.mechanism.inputs
        if given.pair != circuits.pair
    ]
    return f"input {circuits.pair} running" + (f", {listed(rest)} held" if rest else "")


def _branches(circuits: Circuits, lying: tuple[Located, ...]) -> FittedTable:
    at = _amount(circuits, _position(circuits))
    rows = plain_table(
        "Circuits and branches",
        "circuit",
        "branch",
        (f"from, {_unit(circuits)}", f"to, {_unit(circuits)}", "ends"),
        f"assemblies at, {at}",
        left=(4, 5),
        keys=2,
    )
    for circuit in circuits:
        for branch in circuit.branches:
            here = [
                f"{each.mode.number}{' as sketched' if each.own else ''}" for each in lying if each.on(circuit, branch)
            ]
            ends = [_printed(circuits, end) for end in (branch.low, branch.high)]
            rows.add_row(str(circuit.number), str(branch.number), *ends, _ends(branch), listed(here) if here else "")
    return rows


def _ends(branch: Branch) -> str:
    """What stands at the ends: goes all round, dead points, dead point and without end."""
    if branch.turns:
        return "goes all round" if branch.turns == 1 else f"back after {branch.turns} turns"
    low, high = branch.ends
    return f"{low}s" if low == high == "dead point" else low if low == high else f"{low} and {high}"


def _intervals(circuits: Circuits) -> FittedTable:
    rows = plain_table(
        "Intervals of the input",
        (f"from, {_unit(circuits)}", f"to, {_unit(circuits)}"),
        "assemblies",
        left=(),
        keys=0,
    )
    for each in circuits.intervals:
        many_ = "?" if each.assemblies is None else str(each.assemblies)
        rows.add_row(_printed(circuits, each.low), _printed(circuits, each.high), many_)
    return rows


def _slides(circuits: Circuits) -> bool:
    return motions(circuits.mechanism)[circuits.pair].drive_kind.value == "length"


def _unit(circuits: Circuits) -> str:
    units = circuits.mechanism.units
    return units.length if _slides(circuits) else units.angle


def _printed(circuits: Circuits, position: float) -> str:
    return number(unit(_unit(circuits)).from_si(float(position)))


def _amount(circuits: Circuits, position: float) -> str:
    return amount(float(position), "length" if _slides(circuits) else "angle", circuits.mechanism.units)


def _position(circuits: Circuits) -> float:
    """Where the file has the input that runs."""
    return next(given.position for given in circuits.mechanism.inputs if given.pair == circuits.pair)


def record(circuits: Circuits, modes: Modes) -> dict[str, Any]:
    """The circuits and branches as a JSON value, in SI units."""
    lying = located(circuits, modes)
    refused = None if modes else modes.refusal()

    def told(circuit: Circuit, branch: Branch) -> dict[str, Any]:
        here = [each.mode.number for each in lying if each.on(circuit, branch)]
        return branch._asdict() | {"modes": here}

    return {
        "mechanism": circuits.mechanism.name,
        "outcome": (refused.outcome if refused else Outcome.SOLVED).value,
        "reason": refused.reason if refused else "",
        "input": circuits.pair,
        "inputs": {given.pair: given.position for given in circuits.mechanism.inputs},
        "complete": circuits.complete.value,
        "critical": list(circuits.critical),
        "assembles": [list(both) for both in circuits.assembles],
        "intervals": [each._asdict() for each in circuits.intervals],
        "nearest": next((each.mode.number for each in lying if each.own), None),
        "circuits": [
            {
                "number": circuit.number,
                "closed": circuit.closed,
                "branches": [told(circuit, branch) for branch in circuit.branches],
            }
            for circuit in circuits
        ],
        "remarks": [*circuits.said],
    }
