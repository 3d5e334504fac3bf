"""Whether anything can move from an assembled position, and whether the inputs determine the motion there."""

from __future__ import annotations

from collections.abc import Callable

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


class SingularPosition(Exception):
    """A position with one freedom more than inputs, to first order; `refusal` says what to say if it is so in truth."""

    def __init__(self, refused: Callable[[], NoAnswer]):
        super().__init__()
        self.refusal = refused


def determined_mobility(setup: PreparedMechanism, z: Array) -> int:
    """The mobility at a position; raises NoAnswer where the velocity is not determined, or contradicted.

    Raises SingularPosition where the next orders have to tell whether it is determined.
    """
    s, rest = setup.inputs, np.zeros_like(z)
    inputs = s.u.size
    # the unknowns rest while the inputs move
    y, y1, y2 = (np.concatenate(parts) for parts in ((z, s.u), (rest, s.u1), (rest, s.u2)))
    motion = setup.functions.kinematics(y, y1, y2, s.p)
    mobility, weak = freedom_by_rank(setup, motion)
    if not weak:
        if mobility < inputs and not input_rates_agree(setup, motion):
            raise refusals.disagreeing_inputs(setup, mobility, "velocities")
        return mobility
    links = links_free_at_rest(setup, motion.jacobian) or list(
        dict.fromkeys(link for block in weak for link in block.links)
    )
    if mobility <= inputs:
        raise refusals.dead_point(setup, links)

    def refused() -> NoAnswer:
        count = count_motions(setup, motion.w)
        always = any(is_always_singular(setup, block, z) for block in weak) if count is None else count > inputs
        if always:
            return refusals.always_free(setup, links, motion.w)
        return refusals.change_point(setup, links, mobility, z)

    raise SingularPosition(refused) if mobility == inputs + 1 else refused()
