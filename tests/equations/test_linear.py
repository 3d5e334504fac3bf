"""Small linear systems: what is solved is a solution, and a singular one gives what was asked for."""

import casadi as ca
import numpy as np
import pytest

from planar.equations.linear import (
    inverse_arrays,
    solve_arrays,
    solve_by_elimination,
    solve_linear,
    solve_vectors,
    solve_with_volume,
)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7])
def test_expressions_and_arrays_have_the_same_solution(count):
    rng = np.random.default_rng(count)
    matrices, right = rng.normal(size=(7, count, count)), rng.normal(size=(7, count, 1))
    found = solve_arrays(matrices, right)
    np.testing.assert_allclose(matrices @ found, right, atol=1e-10)
    np.testing.assert_allclose(solve_vectors(matrices[0], right[0, :, 0]), found[0, :, 0], rtol=1e-9)
    np.testing.assert_allclose(inverse_arrays(matrices) @ right, found, rtol=1e-9)
    for solved in (
        solve_linear,
        lambda a, b: solve_with_volume(a, b)[0],
        lambda a, b: solve_by_elimination(a, b, matrices[1]),
    ):
        one = ca.evalf(solved(ca.SX(matrices[0]), ca.SX(right[0])))
        np.testing.assert_allclose(one.full(), found[0], rtol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_singular_system_of_many_spoils_no_other(count):
    matrices, right = np.random.default_rng(count).normal(size=(7, count, count)), np.ones((7, count))
    matrices[3], matrices[4] = 0.0, np.nan
    with np.errstate(invalid="ignore"):
        found = solve_vectors(matrices, right)
        nearest = solve_vectors(matrices, right, least_squares=True)
    assert list(np.isnan(found).all(axis=1)) == [k in (3, 4) for k in range(7)]
    np.testing.assert_array_equal(nearest[[0, 1, 2, 5, 6]], found[[0, 1, 2, 5, 6]])
    if count > 2:
        np.testing.assert_allclose(nearest[3], 0.0, atol=1e-12)


def test_more_rows_than_unknowns_give_least_squares():
    rng = np.random.default_rng(0)
    matrices, right = rng.normal(size=(3, 4, 2)), rng.normal(size=(3, 4))
    matrices[1] = np.nan
    found = solve_vectors(matrices, right)
    np.testing.assert_allclose(found[2], np.linalg.lstsq(matrices[2], right[2], rcond=None)[0])
    assert np.isnan(found[1]).all()
