"""How a design moves: the range of its input, and how well it transmits."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.analysis.motion.output import Extreme
from planar.analysis.motion.transmission_angle import transmission
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, PlanarError
from planar.foundation.jets import TURN
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.synthesis.synthesis import DesignMotion

STEPS = 90


def design_motion(mechanism: Mechanism, inputs: Sequence[Array]) -> DesignMotion | None:
    """How a design moves that is to come to positions (n,) of its input; None where it cannot be solved."""
    running = mechanism.inputs[0].pair
    try:
        motion = cycle(mechanism, STEPS, pair=running)
    except (NoAnswer, BadInput):
        return None
    given = motion.inputs[running].position
    low, high = float(given.min()), float(given.max())
    turns = relative_motions(mechanism)[running].input_kind is not MeasureKind.LENGTH
    is_whole = turns and high - low > TURN * (1.0 - 1e-9)
    used: Motion | None = motion
    if not is_whole:
        every = np.clip(np.concatenate(inputs), low, high)
        try:
            used = cycle(mechanism, STEPS, float(every.min()), float(every.max()), running)
        except (NoAnswer, BadInput):
            used = None  # what is wanted lies at one place, or beyond what it runs through
    return DesignMotion(running, low, high, is_whole, {} if used is None else least_transmissions(used))


def least_transmissions(motion: Motion) -> dict[str, Extreme]:
    """The least transmission angle (rad) over a motion at every output that has one, by its pair."""
    mechanism = motion.mechanism
    driven = {each.pair for each in mechanism.inputs}
    found = {}
    for pair in mechanism.pairs:
        if mechanism.frame not in pair.links or pair.name in driven:
            continue
        try:
            least = transmission(motion, pair.name).least
        except PlanarError:
            continue  # nothing is transmitted to it by one force
        if least is not None:
            found[pair.name] = least
    return found
