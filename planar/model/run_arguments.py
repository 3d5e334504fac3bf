"""Checks of what is asked for: how many of something, how many steps of a run, from where to where."""

from __future__ import annotations

from numbers import Integral, Real

from planar.foundation.errors import BadInput

MAX_STEPS = 10**5


def check_steps(steps: object) -> int:
    """How many steps a run has. Raises BadInput for what is no whole number from 1 to MAX_STEPS."""
    if isinstance(steps, bool) or not isinstance(steps, Integral) or steps < 1 or not steps <= MAX_STEPS:
        raise BadInput("steps", f"a whole number of steps from 1 to {MAX_STEPS} is wanted, not {steps!r:.40}")
    return int(steps)


def check_whole_number(name: str, value: object, least: int, most: int | None = None) -> int:
    """A whole number from `least` on, up to `most` if there is one. Raises BadInput."""
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)
    number = int(value) if isinstance(value, Integral) else least
    if not is_whole or number < least or (most is not None and number > most):
        to = "on" if most is None else f"to {most}"
        raise BadInput(name, f"a whole number from {least} {to} is wanted, not {value!r:.40}")
    return number


def check_number(name: str, value: object, most: float, unit: str = "rad or m") -> None:
    """Raises BadInput for what is neither None nor a number up to `most`, which is in `unit`."""
    if value is None:
        return
    if isinstance(value, bool) or not isinstance(value, Real) or not value <= most or value < -most:
        raise BadInput(name, f"a number up to {most:g} ({unit}) is wanted, not {value!r:.40}")
