"""Every way to solve many designs beside the general path, on a few wide designs of each kind of mechanism."""

import pytest

from benchmarks.truth.draws import KINDS, drawn
from benchmarks.truth.judge import agrees, verdicts

SEEDS = {"four-bars": 3, "models": 11, "linkages": 1037}
"""Of 1037 the sketch does not tell the assemblies apart."""


@pytest.mark.parametrize("kind", KINDS)
def test_all_ways_tell_the_same(kind):
    found = verdicts(drawn(kind, SEEDS.get(kind, 2)))
    ways = {each.way for each in found}
    assert {"sweep, native", "sweep, numpy", "prepared", "sweep_each, native", "sweep_each, numpy"} <= ways
    assert [each for each in found if not agrees(each)] == []
