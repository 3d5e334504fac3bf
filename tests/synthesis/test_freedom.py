"""What free numbers can meet exactly, against the counts of the literature, and whether they move a mechanism whole."""

import json

import numpy as np
import pytest

import planar
from planar.synthesis.task.freedom import can_move_whole, count_freedom
from planar.synthesis.task.starts import free_numbers, start_mechanisms

UNITS = {"length": "mm", "angle": "deg"}


def path(count, point="E", **more):
    return {"point": point, "through": [[k, k * k] for k in range(count)]} | more


def timed(count, **more):
    return {"point": "E", "through": [{"at": [k, k * k], "input": 10 * k} for k in range(count)]} | more


def poses(count, link="BC"):
    return {"link": link, "poses": [{"at": [k, 0], "angle": 5 * k} for k in range(count)]}


def function(count, to="D", **more):
    return {"from": "A", "to": to, "pairs": [[10 * k, k] for k in range(count)]} | more


def start_of(start, *wanted, **more):
    task = planar.read_task({"planar": 1, "units": UNITS, "start": start, "wanted": list(wanted)} | more)
    return task, next(start_mechanisms(task))


def four_bar_with(link, shape):
    """The model with a link written otherwise."""
    value = planar.to_dict("four-bar")
    value["links"][link] = shape
    return json.loads(json.dumps(value))


COUPLER = {"points": {"B": [-10, -20], "C": [56, -20], "E": [30, 5]}}
"""Of which the axes are its own."""


@pytest.mark.parametrize(
    ("start", "wanted", "free"),
    [
        ("four-bar", path(9), 9),  # Roth and Freudenstein 1963: nine points
        ("four-bar", timed(5), 10),  # five with prescribed timing
        ("four-bar", timed(4, absolute=True), 9),
        ("four-bar", function(5), 5),  # Freudenstein 1954: five pairs
        ("four-bar", function(4, absolute=True), 4),  # three ratios of lengths, and how the frame lies
        (four_bar_with("BC", COUPLER), poses(5), 10),  # Burmester 1888: five poses
        ("slider-crank", path(7), 7),
    ],
)
def test_as_many_conditions_are_met_as_the_literature_has(start, wanted, free):
    count = count_freedom(*start_of(start, wanted))
    assert count.free == free
    assert count.excess == 0


@pytest.mark.parametrize(
    ("wanted", "excess"), [(path(12), 3), (timed(6), 2), (function(6), 1), (path(1), 0), (function(2), 0)]
)
def test_what_is_more_is_counted(wanted, excess):
    assert count_freedom(*start_of("four-bar", wanted)).excess == excess


def test_the_count_is_in_words():
    assert count_freedom(*start_of("four-bar", path(12))).sentence == (
        "what is wanted sets 12 conditions, and 9 independent numbers are free: 3 more than can be met exactly"
    )
    assert count_freedom(*start_of("four-bar", path(9))).sentence.endswith("9 independent numbers are free: as many")
    few = count_freedom(*start_of("four-bar", path(3), free=["AB.length", "AD.D", "BC.length"]))
    assert few.sentence == "what is wanted sets 3 conditions, and 4 independent numbers are free: 1 stays open"


def test_one_item_may_want_too_much_while_numbers_stay_open():
    """A function has five numbers, however many a path leaves."""
    count = count_freedom(*start_of("four-bar", path(1), function(7)))
    assert (count.demanded, count.met) == (8, 6)
    assert "2 more than can be met exactly and 5 stay open" in count.sentence


def test_a_special_start_counts_as_those_beside_it():
    """A parallelogram, in which derivatives are alike."""
    value = planar.to_dict("four-bar")
    for link, length in (("AB", 50), ("BC", 100), ("DC", 50)):
        value["links"][link]["length"] = length
    value["links"]["BC"]["points"] = {"E": [50, 0]}
    value["links"]["DC"].pop("points", None)
    for key in ("published", "sketch", "loads", "masses"):
        value.pop(key, None)
    value["sketch"] = {"C": [125, 43.3]}
    assert count_freedom(*start_of(value, path(9))).free == 9


FRAME_BY_ENDS = {"ends": ["A", "D"], "length": 100}


@pytest.mark.parametrize(
    ("start", "wanted", "more", "moves"),
    [
        ("four-bar", path(3), {}, True),
        ("slider-crank", path(3), {}, True),
        ("four-bar", poses(3), {}, True),
        ("four-bar", timed(3), {}, True),
        ("four-bar", timed(3, absolute=True), {}, False),  # a turn changes the input
        (four_bar_with("AD", FRAME_BY_ENDS), path(3), {}, False),  # its first end stays at the origin
        ("four-bar", path(3), {"within": {"AB.length": [20, 80]}}, True),
        ("four-bar", path(3), {"within": {"AB.length": [None, None]}}, True),
        ("four-bar", path(3), {"free": ["AB.length", "BC.length"]}, False),
        ("four-bar", function(3), {}, False),
    ],
)
def test_a_mechanism_moves_whole_where_its_free_numbers_let_it(start, wanted, more, moves):
    task, mechanism = start_of(start, wanted, **more)
    assert can_move_whole(task, mechanism, free_numbers(task, mechanism)) is moves


# the numbers that are sought


def test_values_beyond_bounds_are_the_bounds():
    task, mechanism = start_of("four-bar", path(3), within={"AB.length": [60, 80], "DC.length": [None, 40]})
    free = free_numbers(task, mechanism)
    of = dict(zip(free.names, zip(free.values, free.lower, free.upper, strict=True), strict=True))
    np.testing.assert_allclose(of["AB.length"], [0.06, 0.06, 0.08])
    np.testing.assert_allclose(of["DC.length"], [0.04, -np.inf, 0.04])
    np.testing.assert_allclose(of["BC.length"], [0.066, -np.inf, np.inf])


def test_numbers_that_change_nothing_or_not_alone_are_refused():
    task, mechanism = start_of("four-bar", path(3), free=["A.pin_radius"])
    with pytest.raises(planar.BadInput, match=r"nothing that is wanted depends on 'A\.pin_radius'"):
        free_numbers(task, mechanism)


def test_a_new_point_is_carried_where_it_is_wanted():
    task, mechanism = start_of("slider-crank", path(2, "P", on="piston"), path(1, "P", on="piston"))
    assert mechanism != task.starts[0]
    assert {"piston.P.x", "piston.P.y"} <= {*free_numbers(task, mechanism).names}
    assert np.isfinite(planar.solve(mechanism).point("P").position).all()


def test_a_wanted_point_of_a_chain_is_set_apart_from_its_joints():
    joint = "A"
    task, mechanism = start_of({"chains": [4]}, path(2, joint))
    carried = [name for name in free_numbers(task, mechanism).names if f"{joint} wanted" in name]
    assert len(carried) == 2
