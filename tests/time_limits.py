"""Time limits of tests, which go by how often they are asked and not by a clock."""

from __future__ import annotations

from planar.foundation.time_limit import TimeLimit

REASON = "the time limit of this test was reached"


class CountedLimit(TimeLimit):
    """Is over once it was asked so often; never where `checks` is None."""

    def __init__(self, checks: int | None):
        super().__init__(None)
        self.checks, self.asked = checks, 0

    @property
    def reason(self) -> str:
        if self.is_interrupted:
            return super().reason
        self.asked += 1
        return REASON if self.checks is not None and self.asked > self.checks else ""
