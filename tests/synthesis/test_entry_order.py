"""Entries met in their order, against trying every assignment."""

from itertools import combinations_with_replacement

import numpy as np
import pytest

from planar.synthesis.judgement.input_range import _least_rising, ordered_inputs


@pytest.mark.parametrize("seed", range(5))
def test_the_least_rising_assignment_is_that_of_all_assignments(seed):
    square = np.random.default_rng(seed).random((7, 4))
    total, rows = _least_rising(square)
    every = [sum(square[row, k] for k, row in enumerate(each)) for each in combinations_with_replacement(range(7), 4)]
    assert total == pytest.approx(min(every), rel=1e-12)
    assert (np.diff(rows) >= 0).all()
    assert square[rows, range(4)].sum() == pytest.approx(total, rel=1e-12)


@pytest.mark.parametrize(("turn", "sense"), [(0.0, 1.0), (2.0, 1.0), (5.0, -1.0)])
def test_entries_round_a_circle_are_met_where_they_are_though_one_goes_back_a_little(turn, sense):
    wanted = turn + sense * np.array([0.1, 1.0, 2.0, 1.98, 3.0, 4.5])
    places = np.exp(1j * wanted)
    inputs = ordered_inputs(lambda at: np.abs(np.exp(1j * at)[:, None] - places), 0.0, 2.0 * np.pi, True)
    steps = np.mod(sense * np.diff(inputs), 2.0 * np.pi)
    assert steps.sum() < 2.0 * np.pi
    off = np.abs(np.exp(1j * inputs) - places)
    assert off[[0, 1, 4, 5]].max() < 1e-4
    assert off[[2, 3]].max() < 0.021


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_last_entry_does_not_come_beyond_the_first_a_turn_later(sense):
    places = np.exp(1j * (2.5 + sense * np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 2.0 * np.pi + 0.03])))
    inputs = ordered_inputs(lambda at: np.abs(np.exp(1j * at)[:, None] - places), 0.0, 2.0 * np.pi, True)
    assert np.mod(sense * np.diff(inputs), 2.0 * np.pi).sum() <= 2.0 * np.pi + 1e-9
    assert np.abs(np.exp(1j * inputs) - places).max() < 0.035


def test_a_range_without_a_whole_turn_does_not_go_on_over_its_end():
    places = np.array([0.8, 0.1])
    inputs = ordered_inputs(lambda at: np.abs(at[:, None] - places), 0.0, 1.0, False)
    np.testing.assert_allclose(inputs, places, atol=1e-3)
    inputs = ordered_inputs(lambda at: np.abs(at[:, None] - np.array([0.2, 0.8, 0.3])), 0.0, 1.0, False)
    assert (np.diff(inputs) >= -1e-9).all() or (np.diff(inputs) <= 1e-9).all()
