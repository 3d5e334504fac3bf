"""Directions in which quadratic forms vanish."""

import numpy as np
import pytest

from planar.solving.continuation.second_order import branch_directions, is_same_direction, nearest_direction


def form(first, second):
    """The form that vanishes across two vectors: first . c times second . c."""
    both = np.outer(first, second)
    return both + both.T


@pytest.mark.parametrize("redundant", [False, True])
def test_two_branches_of_two_null_vectors(redundant):
    forms = np.array([form((1.0, 2.0), (3.0, -1.0))] * (1 + redundant)) * 0.1
    found = branch_directions(forms)
    assert len(found) == 2
    for expected in ((2.0, -1.0) / np.sqrt(5.0), (1.0, 3.0) / np.sqrt(10.0)):
        assert sum(is_same_direction(c, expected) for c in found) == 1


def test_what_one_form_allows_the_other_forbids():
    found = branch_directions(np.array([form((1.0, 2.0), (3.0, -1.0)), form((1.0, 2.0), (1.0, 1.0))]))
    assert len(found) == 1
    assert is_same_direction(found[0], np.array((2.0, -1.0)) / np.sqrt(5.0))
    assert branch_directions(np.array([form((1.0, 2.0), (3.0, -1.0)), np.eye(2)])) == []


def test_branches_that_touch_or_are_not_told_apart_are_none():
    assert branch_directions(np.array([form((1.0, 2.0), (1.0, 2.0))])) == []
    assert branch_directions(np.zeros((1, 2, 2))) == []
    assert nearest_direction(np.zeros((1, 2, 2)), np.ones(2)) is None


def test_three_null_vectors():
    forms = np.array([form((1.0, 0.0, 0.0), (0.0, 1.0, -1.0)), form((0.0, 1.0, 0.0), (1.0, 0.0, -1.0))])
    found = branch_directions(forms)
    assert len(found) == 4
    for expected in (*np.eye(3), np.ones(3) / np.sqrt(3.0)):
        assert sum(is_same_direction(c, expected) for c in found) == 1
        assert is_same_direction(nearest_direction(forms, expected + 1e-3 * np.array((1.0, 0.0, -1.0))), expected)
