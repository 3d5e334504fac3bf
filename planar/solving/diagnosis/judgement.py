"""Whether anything can move from an assembled position, and whether the inputs determine the motion there."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.solving.diagnosis import refusals
from planar.solving.diagnosis.redundancy import can_move_alone, count_motions
from planar.solving.prepared_mechanism import PreparedMechanism
from planar.solving.rates.regularity import (
    freedom_by_rank,
    input_rates_agree,
    is_always_singular,
    links_free_at_rest,
)


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


def judge_velocity(setup: PreparedMechanism, z: Array) -> tuple[int, Callable[[], NoAnswer] | None]:
    """The mobility at a position, and what computes the refusal where the inputs do not determine the velocity there or
    contradict one another; None where they do determine it.

    With one freedom more than inputs it is so to first order: the next orders tell whether it is in truth.
    """
    s, rest = setup.inputs, np.zeros_like(z)
    # the unknowns rest while the inputs move
    y, y1, y2 = (np.concatenate(parts) for parts in ((z, s.u), (rest, s.u1), (rest, s.u2)))
    motion = setup.functions.kinematics(y, y1, y2, s.p)
    mobility, weak = freedom_by_rank(setup, motion)
    if not weak:
        if mobility < s.u.size and not input_rates_agree(setup, motion):
            return mobility, partial(refusals.disagreeing_inputs, setup, mobility, "velocities")
        return mobility, None

    def refuse() -> NoAnswer:
        links = links_free_at_rest(setup, motion.jacobian)
        links = links or list(dict.fromkeys(link for block in weak for link in block.links))
        if mobility <= s.u.size:
            return refusals.dead_point(setup, links)
        count = count_motions(setup, motion.w)
        always = any(is_always_singular(setup, block, z) for block in weak) if count is None else count > s.u.size
        if always:
            return refusals.always_free(setup, links, motion.w)
        return refusals.change_point(setup, links, mobility, z)

    return mobility, refuse
