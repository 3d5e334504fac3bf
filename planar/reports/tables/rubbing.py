"""What sticks and slips in a simulated motion: tables for a terminal, columns of its files, and facts."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planar.dynamics.in_time.friction_record import FrictionEvent, slip_phases
from planar.dynamics.simulation import Simulation
from planar.model.file_units import display_unit
from planar.reports.columns import ReportedSeries
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import column_heading, format_number, format_or_zero

MAX_EVENTS_SHOWN = 16
"""Events that a table lists; JSON, and Python, has all."""
_WAYS = {1: " forward", -1: " back", 0: ""}


def friction_events_table(simulation: Simulation) -> FittedTable:
    """When pairs began to stick or slip, in which sense, and where they bear then; the first of very many."""
    events, many = simulation.friction_events[:MAX_EVENTS_SHOWN], len(simulation.friction_events)
    title = "Friction, as it changes" if many == len(events) else f"The first {len(events)} of {many} changes"
    table = plain_table(title, "time, s", "pair", "change", "contact", left=(1, 2, 3))
    for each in events:
        table.add_row(format_number(each.time), each.pair, event_phrase(each), each.side)
    return table


def event_phrase(event: FrictionEvent) -> str:
    """What changes, in words."""
    turned = {"bears otherwise": "bears otherwise", "reverses": "turns back, slips"}
    return f"{turned.get(event.change, event.change)}{'' if event.change == 'bears otherwise' else _WAYS[event.sense]}"


def friction_heat_table(simulation: Simulation) -> FittedTable:
    """How long every pair slipped and stuck, and its heat."""
    motion = simulation.motion
    assert motion.time is not None
    units = motion.mechanism.units
    headings = ("slips, s", "sticks, s", "begins to slip", column_heading("heat", "energy", units))
    table = plain_table("Friction, in all", "pair", *headings)
    most = float(simulation.heat[-1])
    energy = display_unit("energy", units)[1]
    for name, each in simulation.rubbing.items():
        slips, sticks = phase_durations(simulation, name)
        begun = sum(event.pair == name and event.change == "slips" for event in simulation.friction_events)
        heat = format_or_zero(energy.from_si(float(each.heat[-1])), energy.from_si(most))
        table.add_row(name, format_number(slips), format_number(sticks), str(begun), heat)
    return table


def phase_durations(simulation: Simulation, name: str) -> tuple[float, float]:
    """How long a pair slipped, and how long friction held it (s)."""
    motion = simulation.motion
    assert motion.time is not None
    phases = slip_phases(simulation.friction_events, name, float(motion.time[-1]))
    lengths = [(each.end - each.start, each) for each in phases]
    return sum(t for t, each in lengths if each.sense), sum(t for t, each in lengths if each.sticks)


def friction_series(simulation: Simulation) -> Iterator[ReportedSeries]:
    """The sense of every pair that rubs, whether it sticks, and its heat since the start, at every position."""
    for name, each in simulation.rubbing.items():
        kinds = {"sense": "number", "sticks": "number", "heat": "energy"}
        values = {"sense": each.sense, "sticks": each.sticks.astype(float), "heat": each.heat}
        yield ReportedSeries("rubbing", name, kinds, values)


def friction_facts(simulation: Simulation) -> dict[str, Any]:
    """What is said of friction in the whole motion, as JSON values."""
    if not simulation.rubbing:
        return {}
    pairs = {}
    for name, each in simulation.rubbing.items():
        slips, sticks = phase_durations(simulation, name)
        pairs[name] = {"slips": slips, "sticks": sticks, "heat": float(np.asarray(each.heat)[-1])}
    return {"friction": pairs, "friction_events": [each._asdict() for each in simulation.friction_events]}
