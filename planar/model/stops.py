"""Stops: between which positions a relative motion can go, as immutable data in SI units."""

from __future__ import annotations

from typing import NamedTuple

from planar.foundation.argument_types import checked_arguments


@checked_arguments
class Stops(NamedTuple):
    """Between which positions the relative motion at a pair can go: from `low` to `high` (rad or m); None where open.

    They measure what an input there prescribes (see `Pair.input_position`). Of an angle that does not count turns those
    are meant that are whole turns off, too, and one that is open goes as far as the other's back, a turn on.
    `restitution` is the speed after an impact beside that before it, from 0 to 1 (I. Newton's law).
    """

    pair: str
    low: float | None = None
    high: float | None = None
    restitution: float = 0.0

    def find_problem(self) -> tuple[str, str] | None:
        """The key of a number that cannot be, and a sentence why."""
        if self.low is None and self.high is None:
            return "stops", "both ends are open; name the lower stop, the upper stop or both"
        if self.low is not None and self.high is not None and not self.low < self.high:
            return "stops", "the lower stop comes first, and below the upper one"
        if not 0.0 <= self.restitution <= 1.0:
            return "restitution", f"a number from 0 to 1 is wanted here, not {self.restitution!r:.40}"
        return None
