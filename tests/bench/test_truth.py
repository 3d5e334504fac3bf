"""Every way to solve many designs beside the general path, on a few wide designs of each kind of mechanism."""

import pytest

from benchmarks.truth.comparison import agrees, compare_case
from benchmarks.truth.random_cases import KINDS, random_case

SEEDS = {"four-bars": 3, "models": 11, "linkages": 1037}
"""Of 1037 the sketch does not tell the assemblies apart."""


@pytest.mark.parametrize("kind", KINDS)
def test_all_ways_tell_the_same(kind):
    found = compare_case(random_case(kind, SEEDS.get(kind, 2)))
    ways = {each.way for each in found}
    assert {"sweep", "prepared", "sweep_each"} <= ways
    assert [each for each in found if not agrees(each)] == []
