"""What a stop carries on which a pair is pressed, in place of the input that would hold the mechanism there."""

from __future__ import annotations

from collections.abc import Mapping

from planar.dynamics.virtual_velocities import unit_rate_state
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.jets import value_and_rates
from planar.results.motion import State
from planar.solving.stops import PairStops

LEAST_RATIO = 1e-9
"""A motion at a stop that is smaller for one of the input is none: the stop cannot hold the input there."""


def stop_forces(state: State, efforts: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """What each stop that is met carries if one input is released, by the pair at its stop and by the input.

    A force (N) or couple (N m) in the positive sense of the pair's motion; 0 where the mechanism leaves the stop. The
    inputs would supply `efforts`. By virtual work, with the other inputs held: effort times motion of the input is
    force times motion at the stop. An input at its own stop is the one that is released; else each that moves the pair.
    """
    mechanism = state.mechanism
    if not mechanism.stops:
        return {}
    stops = PairStops(mechanism, mechanism_size(mechanism, state.shapes))
    met = stops.met_at(stops.positions(state.shapes, state.frames, state.own))
    loads: dict[str, dict[str, float]] = {}
    for name, effort in efforts.items() if met else ():
        unit = unit_rate_state(state, name)
        for stop in met:
            if stop.pair in efforts and stop.pair != name:
                continue
            motion = stops.motions[stop.pair].input_position_at(unit.shapes, unit.frames, unit.own)
            ratio = float(value_and_rates(motion)[1])
            if abs(ratio) <= LEAST_RATIO and len(efforts) > 1:
                continue
            force = effort / ratio if abs(ratio) > LEAST_RATIO else 0.0
            pushes = force < 0.0 if stop.is_upper else force > 0.0
            loads.setdefault(stop.pair, {})[name] = force if pushes else 0.0
    return loads
