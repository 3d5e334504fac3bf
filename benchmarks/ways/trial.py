"""One timed way to solve a linkage, and the crank positions at which all ways are tried."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.linkages.base import THETA

Array = np.ndarray

STEPS = 360
CRANK = THETA + 2.0 * np.pi * np.linspace(0.0, 1.0, STEPS + 1)
"""The crank's angle at every sample (samples,), rad."""


@dataclass(frozen=True)
class Trial:
    """A call to be timed, and how to read its answers, which is not.

    `read` gives (1, samples, 2) for positions alone, (3, samples, 2) with velocities and accelerations: the linkage's
    two answers (m, rad, per s, per s^2) at the first `samples` crank positions.
    """

    way: str
    rates: bool
    samples: int
    solve: Callable[[], Any]
    read: Callable[[Any], Array]
