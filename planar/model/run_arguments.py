"""Checks of what a run is asked for: how many steps, from where to where."""

from __future__ import annotations

from numbers import Integral, Real

from planar.foundation.errors import BadInput

MAX_STEPS = 10**5


def check_steps(steps: object) -> int:
    """How many steps a run has. Raises BadInput for what is no whole number from 1 to MAX_STEPS."""
    if isinstance(steps, bool) or not isinstance(steps, Integral) or steps < 1 or not steps <= MAX_STEPS:
        raise BadInput("steps", f"a whole number of steps from 1 to {MAX_STEPS} is wanted, not {steps!r:.40}")
    return int(steps)


def check_number(name: str, value: object, most: float, unit: str = "rad or m") -> None:
    """Raises BadInput for what is neither None nor a number up to `most`, which is in `unit`."""
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, Real) or not value <= most or value < -most:
        raise BadInput(name, f"a number up to {most:g} ({unit}) is wanted, not {value!r:.40}")
