"""Directions in which quadratic forms vanish."""

from itertools import pairwise, product

import numpy as np
import pytest

from planar.solving.continuation.bifurcation import branch_directions, is_same_direction, nearest_direction


def form(first, second):
    """The form that vanishes across two vectors: first . c times second . c."""
    both = np.outer(first, second)
    return both + both.T


@pytest.mark.parametrize("redundant", [False, True])
def test_two_branches_of_two_null_vectors(redundant):
    forms = np.array([form((1.0, 2.0), (3.0, -1.0))] * (1 + redundant)) * 0.1
    found = branch_directions(forms).vectors
    assert len(found) == 2
    for expected in ((2.0, -1.0) / np.sqrt(5.0), (1.0, 3.0) / np.sqrt(10.0)):
        assert sum(is_same_direction(c, expected) for c in found) == 1


def test_what_one_form_allows_the_other_forbids():
    found = branch_directions(np.array([form((1.0, 2.0), (3.0, -1.0)), form((1.0, 2.0), (1.0, 1.0))])).vectors
    assert len(found) == 1
    assert is_same_direction(found[0], np.array((2.0, -1.0)) / np.sqrt(5.0))
    assert branch_directions(np.array([form((1.0, 2.0), (3.0, -1.0)), np.eye(2)])).vectors == []


def test_branches_that_touch_or_are_not_told_apart_are_none():
    assert branch_directions(np.array([form((1.0, 2.0), (1.0, 2.0))])).vectors == []
    assert branch_directions(np.zeros((1, 2, 2))).vectors == []
    assert nearest_direction(np.zeros((1, 2, 2)), np.ones(2)) is None


def test_three_null_vectors():
    forms = np.array([form((1.0, 0.0, 0.0), (0.0, 1.0, -1.0)), form((0.0, 1.0, 0.0), (1.0, 0.0, -1.0))])
    found = branch_directions(forms).vectors
    assert len(found) == 4
    for expected in (*np.eye(3), np.ones(3) / np.sqrt(3.0)):
        assert sum(is_same_direction(c, expected) for c in found) == 1
        assert is_same_direction(nearest_direction(forms, expected + 1e-3 * np.array((1.0, 0.0, -1.0))), expected)


@pytest.mark.parametrize("size", [4, 6])
def test_of_forms_with_all_directions_real_all_are_found(size):
    """The squares of all entries of c are alike in a turned basis: 2^(size - 1) directions, one for each choice of
    signs."""
    basis = np.linalg.qr(np.random.default_rng(size).normal(size=(size, size)))[0]
    squares = [np.outer(own, own) for own in basis.T]
    directions = branch_directions(np.array([one - other for one, other in pairwise(squares)]))
    assert directions.is_complete
    signs = np.round((np.array(directions.vectors) @ basis) * np.sqrt(size), 6)
    assert {tuple(row * row[0]) for row in signs} == {(1.0, *rest) for rest in product((-1.0, 1.0), repeat=size - 1)}


def test_of_complex_directions_only_the_real_ones_are_found_and_these_are_all():
    forms = np.array([np.diag([1.0, -1.0, 0.0]), np.diag([1.0, 1.0, 1.0])])
    assert branch_directions(forms) == ([], True)


def test_directions_that_are_one_are_not_called_all():
    forms = np.array([form((1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), form((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
    assert not branch_directions(forms).is_complete
