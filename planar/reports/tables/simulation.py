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
from planar.reports.number_format import (
    AMONG_POSITIONS,
    column_heading,
    format_number,
    format_or_zero,
    format_quantity,
    paragraphs,
    quantity_text,
)
from planar.reports.tables.motion import motion_tables
from planar.reports.tables.rubbing import (
    friction_events_table,
    friction_facts,
    friction_heat_table,
    friction_series,
)

ENERGIES = {
    "kinetic": "kinetic energy",
    "potential": "potential energy",
    "work": "work put in",
    "lost": "lost in impacts",
    "heat": "heat of friction",
}
"""What a simulation has of them, in words."""
MAX_IMPACTS_SHOWN = 12
"""Impacts that a table lists; a file of the motion, and JSON, has all."""
SPEED_KINDS = {True: "velocity", False: "angular velocity"}


def tables(simulation: Simulation) -> RenderableType:
    """The run, which inputs were let go, how they moved, and what became of the energy."""
    motion = simulation.motion
    also = " + lost" * bool(simulation.impacts) + " + heat" * bool(simulation.rubbing)
    what = f"kinetic + potential − work{also}"
    kept = f"{what} stays what it was, but for {simulation.balance:.1e} of the energy that changes"
    hits = [_impacts_table(simulation)] if simulation.impacts else []
    rubs = [friction_events_table(simulation), friction_heat_table(simulation)] if simulation.rubbing else []
    return Group(
        motion_tables(motion),
        _inputs_table(simulation),
        *hits,
        *rubs,
        *([_oscillations_table(simulation)] if simulation.oscillations else []),
        _energies_table(simulation),
        paragraphs([("energy", kept)]),
    )


def _impacts_table(simulation: Simulation) -> FittedTable:
    """The impacts on stops, the first of very many; then what is lost in all."""
    motion, many = simulation.motion, len(simulation.impacts)
    units = motion.mechanism.units
    shown = simulation.impacts[:MAX_IMPACTS_SHOWN]
    title = "Impacts on stops" if many == len(shown) else f"The first {len(shown)} of {many} impacts on stops"
    lost = column_heading("lost", "energy", units)
    headings = ("pair", "time, s", ("at", "unit"), ("speed before", "after"), lost, "")
    table = plain_table(title, *headings, left=(0, 3, 7))
    for each in shown:
        length = motion.has_length_motion(each.pair)
        own = units.length if length else units.angle
        table.add_row(
            each.pair,
            format_number(each.time),
            format_number(parse_unit(own).from_si(each.position)),
            own,
            *(quantity_text(speed, SPEED_KINDS[length], units) for speed in (each.approach, each.rebound)),
            format_quantity(each.lost, "energy", units, float(np.abs(simulation.lost).max(initial=0.0))),
            "rests there" if each.rests else "",
        )
    return table


def _oscillations_table(simulation: Simulation) -> FittedTable:
    """How often released inputs turn back, the period of their swings, and where the last ends."""
    motion, units = simulation.motion, simulation.motion.mechanism.units
    periods = ("period, s", "least, s", "greatest, s")
    headings = ("input", periods, ("last one from", "to", "unit"))
    table = plain_table("Oscillations, solved for", *headings, left=(0, 6), keys=1)
    for name, oscillation in simulation.oscillations.items():
        own = units.length if motion.has_length_motion(name) else units.angle
        values = [
            oscillation.period,
            *((oscillation.periods.min(), oscillation.periods.max()) if len(oscillation.periods) else (np.nan,) * 2),
        ]
        last = [float(place) for place in oscillation.positions[-2:]]
        places = [np.nan] * (2 - len(last)) + [parse_unit(own).from_si(place) for place in last]
        table.add_row(name, *map(format_or_zero, values), *map(format_or_zero, places), own)
    return table


def _inputs_table(simulation: Simulation) -> FittedTable:
    motion = simulation.motion
    units = motion.mechanism.units
    motors = {given.pair for given in motion.mechanism.inputs if given.motor is not None}
    headings = ("input", "", ("unit", "start", "end", "least", "greatest"), ("greatest speed", "unit"))
    table = plain_table("Inputs, among these positions", *headings, left=(0, 1, 2, 8), keys=2)
    for name, each in motion.inputs.items():
        own = units.length if motion.has_length_motion(name) else units.angle
        of = parse_unit(own).from_si
        per, rate = display_unit(motion.input_quantity_kinds(name)[1], units)
        places = (each.position[0], each.position[-1], each.position.min(), each.position.max())
        table.add_row(
            name,
            "driven" if name in simulation.driven else "by its motor" if name in motors else "let go",
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
    table = plain_table(f"Energy{AMONG_POSITIONS}", *headings)
    most = max(float(np.abs(getattr(simulation, what)).max()) for what in ENERGIES)
    there = {"lost": bool(simulation.impacts), "heat": bool(simulation.rubbing)}
    for what, name in ENERGIES.items():
        values = getattr(simulation, what)
        if not there.get(what, True):
            continue
        ends = (values[0], values[-1], values.min(), values.max())
        table.add_row(name, *(format_quantity(float(each), "energy", units, most) for each in ends))
    return table


def energy_series(simulation: Simulation) -> Iterable[ReportedSeries]:
    """The energies at every position, beside what a file of the motion has."""
    there = {"lost": bool(simulation.motion.mechanism.stops), "heat": bool(simulation.rubbing)}
    told = [what for what in ENERGIES if there.get(what, True)]
    yield ReportedSeries(
        "energy", "", dict.fromkeys(told, "energy"), {what: getattr(simulation, what) for what in told}
    )
    yield from friction_series(simulation)


def simulation_facts(simulation: Simulation) -> dict[str, Any]:
    """What is said of the whole motion, as JSON values."""
    found: dict[str, Any] = {"driven": list(simulation.driven), "energy_balance": simulation.balance}
    if simulation.motion.mechanism.stops:
        found["impacts"] = [each._asdict() for each in simulation.impacts]
    if simulation.oscillations:
        found["oscillations"] = {
            name: {
                "period": oscillation.period if np.isfinite(oscillation.period) else None,
                "periods": oscillation.periods.tolist(),
                "times": oscillation.times.tolist(),
                "positions": oscillation.positions.tolist(),
            }
            for name, oscillation in simulation.oscillations.items()
        }
    return found | friction_facts(simulation)
