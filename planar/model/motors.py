"""Motors: what they supply at a speed, as immutable data in SI units."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planar.foundation.argument_types import checked_arguments
from planar.foundation.arrays import Array


@checked_arguments
class Motor(NamedTuple):
    """What drives an input: a torque (N m) against angular speed (rad/s), at a slide a force (N) against speed (m/s).

    Either a straight line for all speeds, through `stall` at rest and nothing at `no_load`, as of a motor with
    permanent magnets at a steady voltage; or a table of `efforts` at rising `speeds`, straight between, before the
    first and after the last as there. Both signs are those of the input's motion.
    """

    stall: float | None = None
    no_load: float | None = None
    speeds: tuple[float, ...] = ()
    efforts: tuple[float, ...] = ()

    def effort_at(self, speed: Array | float) -> Array:
        """What it supplies at speeds."""
        if self.stall is not None and self.no_load is not None:
            return np.asarray(self.stall * (1.0 - np.asarray(speed) / self.no_load))
        return np.asarray(np.interp(speed, self.speeds, self.efforts))

    @property
    def sense(self) -> float:
        """The sense in which it drives: that of what it supplies at rest, else of its greatest."""
        at_rest = float(self.effort_at(0.0))
        if at_rest:
            return 1.0 if at_rest > 0.0 else -1.0
        return 1.0 if max(self.efforts, key=abs) >= 0.0 else -1.0

    @property
    def greatest_power(self) -> tuple[float, float]:
        """The greatest power (W), and the speed at which it has it."""
        if self.stall is not None and self.no_load is not None:
            return 0.25 * self.stall * self.no_load, 0.5 * self.no_load
        found = [(v * e, v) for v, e in zip(self.speeds, self.efforts, strict=True)]
        for (v, e), (w, f) in pairwise(zip(self.speeds, self.efforts, strict=True)):
            slope = (f - e) / (w - v)
            turning = 0.5 * (v - e / slope) if slope else v
            if v < turning < w:
                found.append((turning * (e + slope * (turning - v)), turning))
        return max(found)

    def find_problem(self) -> tuple[str, str] | None:
        """The key of a number that cannot be, and a sentence why."""
        if self.stall is not None and self.no_load is not None:
            if not self.stall * self.no_load > 0.0:
                return "no_load", "what it supplies at rest and its speed without load have one sign, and are not 0"
            return None
        if len(self.speeds) < 2 or len(self.speeds) != len(self.efforts):
            told = f"as many as speeds, two at least, are wanted here, not {len(self.efforts)} for {len(self.speeds)}"
            return "efforts", told
        if any(not low < high for low, high in pairwise(self.speeds)):
            return "speeds", "the speeds of a motor's table rise"
        return (
            ("efforts", "a motor that supplies nothing at any speed drives nothing") if not any(self.efforts) else None
        )
