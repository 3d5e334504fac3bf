"""The stops of pairs on a page: its input ends where Python's does."""

import pytest

import planar
from tests.page_scripts import in_node, needs_node


@needs_node
def test_the_input_of_a_page_ends_at_the_stops_that_a_motion_meets():
    given = planar.to_dict(planar.load("four-bar")) | {"published": []}
    given["pairs"][3]["stops"] = [80, 110]
    mechanism = planar.from_dict(given)
    motion = planar.cycle(mechanism, 8)
    act = """
    const met = () => page.linkage.met.map(({ pair, at }) => [pair, at]);
    const ends = [3, -3].map((to) => [page.moveTo(to), page.input(), met()]);
    return [...ends, page.moveTo(1), page.linkage.met.length];
    """
    up, down, inside, met = in_node({"four-bar": mechanism}, act)["four-bar"]
    low, high = motion.inputs["A"].position[[0, -1]]
    # the lower stop is never come to: the crank's dead point is before it
    assert up == [False, pytest.approx(high, abs=1e-8), [["D", pytest.approx(110 * 3.141592653589793 / 180)]]]
    assert down[:2] == [False, pytest.approx(low, abs=1e-6)]
    assert (inside, met) == (True, 0)
