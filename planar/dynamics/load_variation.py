"""How much of a load there is at a position of an input, or at a time."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planar.model.loads import Course
from planar.model.mechanism import Mechanism, motions

Array = np.ndarray


def factors(mechanism: Mechanism, inputs: Mapping[str, Array], time: Array | None, many: int) -> Array:
    """What every load is multiplied by at positions of the inputs, or at times (n, loads)."""
    found = np.ones((many, len(mechanism.loads)))
    for k, load in enumerate(mechanism.loads):
        if load.varies is not None:
            named = load.varies.input
            at = (np.zeros(many) if time is None else time) if named is None else inputs[named]
            turns = named is not None and motions(mechanism)[named].driven()[0] == "angle"
            found[:, k] = factor(load.varies, np.broadcast_to(at, (many,)), turns)
    return found


def factor(course: Course, at: Array, turns: bool) -> Array:
    """The factor at places (n,): straight between those that are given."""
    places, span = np.array(course.at), course.at[-1] - course.at[0]
    if turns and abs(span - 2.0 * np.pi) < 1e-9:
        at = places[0] + np.mod(at - places[0], 2.0 * np.pi)
    return np.interp(at, places, course.factors)
