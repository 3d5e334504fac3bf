"""The closed form, on arrays and on floats, and its own reference in longer arithmetic."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from benchmarks.linkages import Linkage
from benchmarks.linkages.base import ALPHA, OMEGA
from benchmarks.ways.trial import CRANK, Array, Trial

FLOATS, ARRAYS = "closed form, Python floats", "closed form, numpy arrays"


def trials(linkage: Linkage) -> tuple[Trial, ...]:
    """The closed form of all positions at once, and position by position."""
    crank = CRANK.tolist()
    return (
        Trial(ARRAYS, False, len(CRANK), lambda: linkage.positions(np, CRANK), _from_arrays),
        Trial(ARRAYS, True, len(CRANK), lambda: linkage.motion(np, CRANK, OMEGA, ALPHA), _from_arrays),
        Trial(
            FLOATS,
            False,
            len(CRANK),
            lambda: [linkage.positions(math, theta) for theta in crank],
            _from_floats,
        ),
        Trial(
            FLOATS,
            True,
            len(CRANK),
            lambda: [linkage.motion(math, theta, OMEGA, ALPHA) for theta in crank],
            _from_floats,
        ),
    )


def reference(linkage: Linkage) -> Array:
    """The answers (3, samples, 2) in the longest arithmetic that numpy has here, so that doubles have an error."""
    return np.array(linkage.motion(np, CRANK.astype(np.longdouble), OMEGA, ALPHA)).transpose(0, 2, 1)


def _from_arrays(found: Any) -> Array:
    return np.array(found).reshape(-1, 2, len(CRANK)).transpose(0, 2, 1)


def _from_floats(found: Any) -> Array:
    return np.array(found).reshape(len(CRANK), -1, 2).transpose(1, 0, 2)
