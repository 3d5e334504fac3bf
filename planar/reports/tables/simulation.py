"""The motion of a mechanism that is let go: tables for a terminal, and what a file of it has of energies."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from rich.console import Group, RenderableType

from planar.dynamics.simulation import Simulation
from planar.foundation.units import shown, unit
from planar.reports.columns import Told
from planar.reports.fitted_table import FittedTable
from planar.reports.tables.motion import ran
from planar.reports.tables_of_numbers import counted, number, paragraphs, plain_table

ENERGIES = ("kinetic", "potential", "work")


def tables(simulation: Simulation) -> RenderableType:
    """The run, which inputs were let go, how they moved, and what became of the energy."""
    motion = simulation.motion
    kept = f"kinetic + potential − work stays what it was, but for {simulation.balance:.1e} of the energy that changes"
    return Group(ran(motion), _inputs(simulation), _energies(simulation), paragraphs([("energy", kept)]))


def _inputs(simulation: Simulation) -> FittedTable:
    motion = simulation.motion
    units = motion.mechanism.units
    headings = ("input", "", ("unit", "start", "end", "least", "greatest"), ("greatest speed", "unit"))
    table = plain_table("Inputs, among these positions", *headings, left=(0, 1, 2, 8), keys=2)
    for name, each in motion.inputs.items():
        own = units.length if motion.slides(name) else units.angle
        of = unit(own).from_si
        per, rate = shown(motion.driven(name)[1], units)
        places = (each.position[0], each.position[-1], each.position.min(), each.position.max())
        table.add_row(
            name,
            "driven" if name in simulation.driven else "let go",
            own,
            *(number(of(float(place))) for place in places),
            number(rate.from_si(float(np.abs(each.velocity).max()))),
            per,
        )
    return table


def _energies(simulation: Simulation) -> FittedTable:
    headings = ("of", "at the start, J", "at the end, J", "least, J", "greatest, J")
    table = plain_table("Energy", *headings)
    names = ("kinetic energy", "potential energy", "work put in")
    most = max(float(np.abs(getattr(simulation, what)).max()) for what in ENERGIES)
    for name, what in zip(names, ENERGIES, strict=True):
        values = getattr(simulation, what)
        ends = (values[0], values[-1], values.min(), values.max())
        table.add_row(name, *(counted(float(each), most) for each in ends))
    return table


def told(simulation: Simulation) -> Iterable[Told]:
    """The energies at every position, beside what a file of the motion has."""
    yield Told("energy", "", dict.fromkeys(ENERGIES, "energy"), {what: getattr(simulation, what) for what in ENERGIES})


def said(simulation: Simulation) -> dict[str, Any]:
    """What is said of the whole motion, as JSON values."""
    return {"driven": list(simulation.driven), "energy_balance": simulation.balance}
