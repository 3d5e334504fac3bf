"""How a design moves: the range of its input, and how well it transmits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.analysis.motion.output import Extreme
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.synthesis.demands.output_transmissions import output_transmissions
from planar.synthesis.judgement.input_range import input_range, range_motion

STEPS = 90


class DesignMotion(NamedTuple):
    """How a design moves: its input `pair` goes from `low` to `high` (rad or m), `is_whole_turn`: it turns fully.

    `transmission` has the least transmission angle (rad) of every output that has one, by its pair, with the input
    there: over the whole turn, else between the first and the last entry of what is wanted.
    """

    pair: str
    low: float
    high: float
    is_whole_turn: bool
    transmission: Mapping[str, Extreme]

    @property
    def least_transmission(self) -> Extreme | None:
        """The least transmission angle of all outputs, None where there is none."""
        return min(self.transmission.values(), key=lambda each: each.value, default=None)

    def __repr__(self) -> str:
        return short_repr(self)


def design_motion(mechanism: Mechanism, inputs: Sequence[Array]) -> DesignMotion | None:
    """How a design moves that is to come to positions (n,) of its input; None where it cannot be solved."""
    running = mechanism.inputs[0].pair
    try:
        motion = range_motion(mechanism, inputs, STEPS)
    except (NoAnswer, BadInput):
        return None
    reach = input_range(motion, inputs)
    used: Motion | None = motion
    if not reach.is_whole_turn:
        every = reach.bring(np.concatenate(inputs))
        try:
            used = cycle(mechanism, STEPS, float(every.min()), float(every.max()), running)
        except (NoAnswer, BadInput):
            used = None  # what is wanted lies at one place, or beyond what it runs through
    return DesignMotion(
        running, reach.low, reach.high, reach.is_whole_turn, {} if used is None else least_transmissions(used)
    )


def least_transmissions(motion: Motion) -> dict[str, Extreme]:
    """The least transmission angle (rad) over a motion at every output that has one, by its pair."""
    return {each.pair: each.least for each in output_transmissions(motion) if each.least is not None}
