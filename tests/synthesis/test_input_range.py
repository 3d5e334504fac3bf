"""Ranges of inputs: turns that close, turns that gears close later, and dead points more than a turn apart."""

from math import pi

import numpy as np
import pytest

import planar
from planar.synthesis.judgement.input_range import input_range

ENTRIES = [np.array([1.0, 3.0, 9.0])]


def test_a_crank_that_turns_fully_comes_again_where_it_was():
    reach = input_range(planar.cycle("crank-rocker", 24), ENTRIES)
    assert reach.is_whole_turn and reach.is_cyclic
    assert reach.high - reach.low == pytest.approx(2.0 * pi)
    brought = reach.bring(ENTRIES[0])
    assert ((brought >= reach.low) & (brought <= reach.high)).all()
    np.testing.assert_allclose(np.sin(brought), np.sin(ENTRIES[0]), atol=1e-12)
    assert not reach.are_beyond(ENTRIES[0]).any()
    assert reach.is_in_order(np.array([5.0, 6.0, 1.0])) and not reach.is_in_order(np.array([1.0, 3.0, 2.0, 4.0]))


def test_a_geared_linkage_is_followed_over_the_turns_of_all_entries():
    value = planar.to_dict(planar.load("geared-five-bar"))
    wheels = next(each for each in value["pairs"] if "gear" in each)
    wheels["ratio"] = -0.5
    del wheels["teeth"]
    motion = planar.cycle(planar.from_dict(value), 24)
    reach = input_range(motion, ENTRIES)
    assert reach.is_whole_turn and not reach.is_cyclic
    assert reach.high >= 9.0
    np.testing.assert_allclose(reach.bring(ENTRIES[0]), np.clip(ENTRIES[0], reach.low, reach.high))


def test_beyond_dead_points_there_is_nothing():
    motion = planar.cycle("four-bar", 24)
    reach = input_range(motion, ENTRIES)
    assert not reach.is_whole_turn and not reach.is_cyclic
    assert reach.are_beyond(np.array([reach.low - 0.1, reach.low, reach.high + 0.1])).tolist() == [True, False, True]
    assert 0.0 < reach.margin < 1e-4


def test_a_slide_runs_by_its_length():
    reach = input_range(planar.cycle("tipper", 24), [np.zeros(1)])
    assert (reach.turns, reach.kind, reach.is_whole_turn) == (False, "length", False)
