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


def stop_forces(state: State, efforts: Mapping[str, float]) -> dict[str, float]:
    """By the pair: the force (N) or couple (N m) of each stop that is met, in the positive sense of the pair's motion,
    where the input is let go that would supply these efforts; 0 where the mechanism leaves the stop by itself.

    By virtual work: effort times motion of the input is force times motion at the stop. Of several inputs it is not
    told which is let go: nothing then.
    """
    mechanism = state.mechanism
    if not mechanism.stops or len(mechanism.inputs) != 1:
        return {}
    stops = PairStops(mechanism, mechanism_size(mechanism, state.shapes))
    met = stops.met_at(stops.positions(state.shapes, state.frames, state.own))
    if not met:
        return {}
    ((name, effort),) = efforts.items()
    unit = unit_rate_state(state, name)
    found = {}
    for each in met:
        motion = stops.motions[each.pair].input_position_at(unit.shapes, unit.frames, unit.own)
        ratio = float(value_and_rates(motion)[1])
        force = effort / ratio if abs(ratio) > LEAST_RATIO else 0.0
        pushes = force < 0.0 if each.is_upper else force > 0.0
        found[each.pair] = force if pushes else 0.0
    return found
