"""A simulated motion: tables for a terminal, and the energies in its files."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from rich.console import Group, RenderableType

from planar.dynamics.simulation import Simulation
from planar.foundation.units import parse_unit
from planar.model.file_units import display_unit
from planar.reports.columns import ReportedSeries
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import column_heading, format_number, format_quantity, paragraphs
from planar.reports.tables.motion import motion_tables

ENERGIES = ("kinetic", "potential", "work")


def tables(simulation: Simulation) -> RenderableType:
    """The run, which inputs were let go, how they moved, and what became of the energy."""
    motion = simulation.motion
    kept = f"kinetic + potential − work stays what it was, but for {simulation.balance:.1e} of the energy that changes"
    return Group(
        motion_tables(motion), _inputs_table(simulation), _energies_table(simulation), paragraphs([("energy", kept)])
    )


def _inputs_table(simulation: Simulation) -> FittedTable:
    motion = simulation.motion
    units = motion.mechanism.units
    headings = ("input", "", ("unit", "start", "end", "least", "greatest"), ("greatest speed", "unit"))
    table = plain_table("Inputs, among these positions", *headings, left=(0, 1, 2, 8), keys=2)
    for name, each in motion.inputs.items():
        own = units.length if motion.has_length_motion(name) else units.angle
        of = parse_unit(own).from_si
        per, rate = display_unit(motion.input_quantity_kinds(name)[1], units)
        places = (each.position[0], each.position[-1], each.position.min(), each.position.max())
        table.add_row(
            name,
            "driven" if name in simulation.driven else "let go",
            own,
            *(format_number(of(float(place))) for place in places),
            format_number(rate.from_si(float(np.abs(each.velocity).max()))),
            per,
        )
    return table


def _energies_table(simulation: Simulation) -> FittedTable:
    units = simulation.motion.mechanism.units
    headings = (
        "of",
        *(column_heading(each, "energy", units) for each in ("at the start", "at the end", "least", "greatest")),
    )
    table = plain_table("Energy", *headings)
    names = ("kinetic energy", "potential energy", "work put in")
    most = max(float(np.abs(getattr(simulation, what)).max()) for what in ENERGIES)
    for name, what in zip(names, ENERGIES, strict=True):
        values = getattr(simulation, what)
        ends = (values[0], values[-1], values.min(), values.max())
        table.add_row(name, *(format_quantity(float(each), "energy", units, most) for each in ends))
    return table


def energy_series(simulation: Simulation) -> Iterable[ReportedSeries]:
    """The energies at every position, beside what a file of the motion has."""
    yield ReportedSeries(
        "energy", "", dict.fromkeys(ENERGIES, "energy"), {what: getattr(simulation, what) for what in ENERGIES}
    )


def simulation_facts(simulation: Simulation) -> dict[str, Any]:
    """What is said of the whole motion, as JSON values."""
    return {"driven": list(simulation.driven), "energy_balance": simulation.balance}
