"""One timed call that solves a swept linkage, and how to read what it found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

Array = np.ndarray

PLANAR, LIMIT = "planar", "C"


@dataclass(frozen=True)
class Entry:
    """A call to be timed; `read`, which is not timed, gives (2 or 6, steps, designs): x, y of the point, then rates.

    A slow solver may take fewer designs, or fewer steps, than the others: those whose numbers are in `designs` and
    `steps`, which are what `read` gives.
    """

    system: str
    rates: bool
    designs: Array
    steps: Array
    solve: Callable[[], Any]
    read: Callable[[Any], Array]

    @property
    def positions(self) -> int:
        """How many positions one call solves."""
        return len(self.designs) * len(self.steps)
