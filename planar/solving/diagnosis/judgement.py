"""Whether anything can move from an assembled position: the judgement that every command asks for."""

from __future__ import annotations

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.solving.diagnosis import refusals
from planar.solving.diagnosis.redundancy import can_move_alone, count_motions
from planar.solving.prepared_mechanism import PreparedMechanism


def judge_motion(setup: PreparedMechanism, z: Array, pair: str | None = None) -> NoAnswer | None:
    """Why no motion of an input leads away from unknowns z (unknowns,); None where one may.

    The causes are a structure, no input, and inputs of which `pair` (None: each) is held by the others. A dead point
    and a change point are none: motions lead away from them, and the run says which. Counting motions takes some
    milliseconds, so this is asked when a motion fails, or where the equations are not regular.
    """
    names = [given.pair for given in setup.mechanism.inputs]
    if setup.equations.open_rows:  # lengths that do not agree count as if they did
        return None if names else refusals.undriven(setup)
    w = setup.functions.coordinates(z, setup.inputs.u, setup.inputs.p)
    mobility = count_motions(setup, w)
    if mobility == 0 or (mobility is None and not names):
        return refusals.structure(setup, w)
    if not names:
        return refusals.undriven(setup)
    if mobility is not None and mobility < len(names):
        running = names if pair is None else [pair]
        if not any(can_move_alone(setup, w, name) for name in running):
            return refusals.surplus_inputs(setup, mobility)
    return None
