"""When friction holds pairs in a simulation, for what is drawn over time."""

from __future__ import annotations

from collections.abc import Sequence

from planar.drawing.diagrams.captions import HeldIntervals
from planar.dynamics.in_time.friction_record import slip_phases
from planar.dynamics.simulation import Simulation


def held_intervals(simulation: Simulation, names: Sequence[str]) -> HeldIntervals:
    """When friction holds the pairs that are drawn, or else any, as intervals apart from one another."""
    time = simulation.motion.time
    assert time is not None
    found: list[tuple[float, float]] = []
    held = []
    for name in [name for name in names if name in simulation.rubbing] or simulation.rubbing:
        phases = slip_phases(simulation.friction_events, name, float(time[-1]))
        own = [(each.start, each.end) for each in phases if each.sticks and each.end > each.start]
        held += [name] if own else []
        found += own
    merged: list[tuple[float, float]] = []
    for start, end in sorted(found):
        if merged and start <= merged[-1][1]:
            merged[-1] = merged[-1][0], max(end, merged[-1][1])
        else:
            merged.append((start, end))
    return HeldIntervals(tuple(held), tuple(merged))
