"""What the frame feels, from the reactions of its pairs afresh: another route to the shaking force."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.forces import forces
from planar.dynamics.free_body_check import force_and_moment, pair_actions_on
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.arrays import Array
from planar.results.motion import Motion


class FrameLoad(NamedTuple):
    """The shaking force and moment, at an arm (m), that reactions tell (n, 3), N; `scale` is the greatest of their
    parts, beside which they are exact."""

    shaking: Array
    arm: float
    scale: float


def frame_load(motion: Motion, about: Array) -> FrameLoad | None:
    """What pairs, inputs and springs put on the frame, less the loads and weights that the moving links carry there.

    From `planar.forces` without friction; the moment about a point (2,), m. None where a pair's force has no place.
    """
    found = forces(motion, friction=False)
    frame, arm = motion.mechanism.frame, mechanism_size(motion.mechanism, motion.shapes)
    many = KinematicArrays(motion).position_count
    parts = []
    for pair in found.reactions.values():
        if frame in pair.links and pair.at is None:
            return None
        parts += pair_actions_on(frame, pair, many)
    for each in found.acting:
        if each.kind in ("input", "spring") and each.link == frame:
            parts.append(force_and_moment(each.at, each.force, each.couple))
        elif each.kind in ("load", "weight") and each.link != frame:
            parts.append(-force_and_moment(each.at, each.force, each.couple))
    rows = np.array(parts).reshape(-1, many, 3)
    # about the world's origin; about the point it is less by the moment of the force there
    rows[:, :, 2] -= about[0] * rows[:, :, 1] - about[1] * rows[:, :, 0]
    rows[:, :, 2] /= arm
    told = np.isfinite(rows).all(axis=(0, 2))
    scale = float(np.abs(rows[:, told]).max(initial=0.0))
    return FrameLoad(rows.sum(axis=0), arm, scale)
