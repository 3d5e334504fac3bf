"""Whether the inputs determine the motion at a position, and what is said where they do not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.solving.diagnosis import refusals
from planar.solving.prepared_mechanism import PreparedMechanism
from planar.solving.rates.regularity import (
    freedom_by_rank,
    input_rates_agree,
    is_always_singular,
    links_free_at_rest,
)


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
        from planar.solving.diagnosis.redundancy import count_motions  # only where something is refused

        free = count_motions(setup, motion.w)
        always = any(is_always_singular(setup, block, z) for block in weak) if free is None else free > inputs
        return (
            refusals.always_free(setup, links, motion.w) if always else refusals.change_point(setup, links, mobility, z)
        )

    raise SingularPosition(refused) if mobility == inputs + 1 else refused()
