"""The factor of a load at a position of an input, or at a time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planar.foundation.arrays import Array
from planar.model.loads import Course
from planar.model.mechanism import Mechanism, relative_motions


def load_factors(mechanism: Mechanism, inputs: Mapping[str, Array], time: Array | None, many: int) -> Array:
    """What every load is multiplied by at positions of the inputs, or at times (n, loads)."""
    found = np.ones((many, len(mechanism.loads)))
    for k, load in enumerate(mechanism.loads):
        if load.varies is not None:
            named = load.varies.input
            at = (np.zeros(many) if time is None else time) if named is None else inputs[named]
            turns = named is not None and relative_motions(mechanism)[named].input_quantity_kinds()[0] == "angle"
            found[:, k] = interpolate_factor(load.varies, np.broadcast_to(at, (many,)), turns)
    return found


def interpolate_factor(course: Course, at: Array, is_angle: bool) -> Array:
    """The factor at places (n,): straight between those that are given."""
    places, span = np.array(course.at), course.at[-1] - course.at[0]
    if is_angle and abs(span - 2.0 * np.pi) < 1e-9:
        at = places[0] + np.mod(at - places[0], 2.0 * np.pi)
    return np.interp(at, places, course.factors)
