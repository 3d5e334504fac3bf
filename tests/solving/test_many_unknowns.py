"""Mechanisms of many unknowns: their Jacobians by entries, beside the same as arrays, closed forms and numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest

import planar
from benchmarks import chain
from planar.equations import acceptance, functions
from planar.equations.functions import equation_functions
from planar.equations.sparse_matrices import BorderedJacobian, SparseMatrices, SparsePattern, closing_step
from planar.foundation.errors import NoAnswer
from planar.foundation.private_cache import disable_cache
from planar.solving import position, prepared_mechanism
from tests.builders import lift_document
from tests.draws import first_cases
from tests.known import MODELS

CURVES = [
    "peaucellier-lipkin",
    "scissor-lift",
    "balanced-lamp",
    "watt-parallel-motion",
    "tangent-cam",
    "four-bar",
    "antiparallelogram",
]
"""Models with dead points, change points, positions of lost rank, redundant pairs, one unknown, or none of these."""


def clear_structures():
    for module in (functions, acceptance, prepared_mechanism, position):
        for each in vars(module).values():
            if hasattr(each, "cache_clear"):
                each.cache_clear()


@pytest.fixture
def few_dense_unknowns(monkeypatch):
    """All square systems by their entries, however small."""

    def switch():
        monkeypatch.setattr(functions, "MAX_DENSE_UNKNOWNS", 0)
        clear_structures()

    with disable_cache():
        yield switch
    monkeypatch.undo()
    clear_structures()


def some_matrices(seed, many=3, rows=7, columns=8):
    rng = np.random.default_rng(seed)
    dense = rng.normal(size=(many, rows, columns)) * (rng.random((rows, columns)) < 0.4)
    dense[:, np.arange(rows), np.arange(rows)] = rng.uniform(1.0, 2.0, (many, rows))
    column, row = np.nonzero((dense != 0.0).any(axis=0).T)
    first = np.searchsorted(column, np.arange(columns + 1))
    return dense, SparseMatrices(SparsePattern((rows, columns), row, first), dense[:, row, column])


def test_blocks_norms_and_products_are_those_of_arrays():
    dense, sparse = some_matrices(1)
    assert sparse.shape == dense.shape
    np.testing.assert_array_equal(np.asarray(sparse), dense)
    np.testing.assert_array_equal(sparse[:, slice(2, 5), slice(1, 7)], dense[:, 2:5, 1:7])
    np.testing.assert_array_equal(np.asarray(sparse[np.array([True, False, True])]), dense[[0, 2]])
    np.testing.assert_allclose(sparse.column_norms(0.5), np.maximum(np.linalg.norm(dense, axis=1), 0.5))
    vector = np.arange(8.0)
    np.testing.assert_allclose(sparse[1] @ vector, dense[1] @ vector)
    np.testing.assert_allclose(np.asarray(sparse[1].divide_columns(vector + 1.0)), dense[1] / (vector + 1.0))
    for weights in (np.array([-0.5]), np.array([0.3, -2.0])):
        joined = np.column_stack([dense[0][:, : -len(weights)], dense[0][:, -len(weights) :] @ weights])
        np.testing.assert_allclose(np.asarray(sparse[0].join_last_columns(weights)), joined)
    assert sparse[0].greatest_singular_value_bound() >= np.linalg.norm(dense[0], 2)


def test_systems_are_solved_and_singular_ones_are_not():
    dense, sparse = some_matrices(2, columns=7)
    right = np.random.default_rng(3).normal(size=(3, 7, 2))
    np.testing.assert_allclose(sparse.solve(right), np.linalg.solve(dense, right), rtol=1e-9)
    sparse.values[1] = 0.0
    assert np.isnan(sparse.solve(right)[1]).all()
    assert np.isfinite(sparse.solve(right)[[0, 2]]).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_bordered_jacobian_knows_singular_values_and_shortest_steps(seed):
    dense, sparse = some_matrices(10 + seed, many=2)
    jacobian, change = dense
    here = BorderedJacobian(sparse[0], np.ones(8))
    left, values, right = np.linalg.svd(jacobian)
    assert abs(here.tangent @ right[-1]) == pytest.approx(1.0)
    own = here.least_singular_vectors(3)
    np.testing.assert_allclose(own[1], values[-3:], rtol=1e-6)
    np.testing.assert_allclose(jacobian @ own[2][:3].T, own[0] * own[1], atol=1e-6)
    sizes = np.linspace(0.5, 2.0, 8)
    scaled = jacobian / sizes
    least = np.linalg.svd(scaled, compute_uv=False)[-1]
    assert 0.85 * least < here.least_singular_value(sizes) <= least * 1.001
    norm = np.linalg.norm(np.linalg.pinv(scaled) @ (change / sizes), 2)
    assert norm * 0.999 <= here.relative_change(sparse[1], sizes) < 1.2 * norm
    residual = np.arange(7.0)
    np.testing.assert_allclose(here.step(residual, here.tangent), np.linalg.pinv(jacobian) @ residual, atol=1e-9)
    others = -right[:6].T @ ((left[:, :6].T @ residual) / values[:6])
    np.testing.assert_allclose(closing_step(sparse[0], residual, left[:, 6:], right[6:].T), others, atol=1e-9)


def run_of(mechanism):
    try:
        return planar.cycle(mechanism, 24)
    except NoAnswer as problem:
        return problem


@pytest.mark.parametrize("stem", first_cases(CURVES, 5))
def test_runs_are_the_same_by_entries_and_by_arrays(stem, few_dense_unknowns):
    by_arrays = run_of(MODELS[stem])
    few_dense_unknowns()
    assert equation_functions(MODELS[stem]).is_sparse or not equation_functions(MODELS[stem]).is_square
    by_entries = run_of(MODELS[stem])
    assert (by_entries.outcome, by_entries.reason) == (by_arrays.outcome, by_arrays.reason)
    # whether rates at a crossing hold to round-off depends on round-off
    remarks = [
        [remark for remark in run.remarks if not remark.endswith("next to a change point")]
        for run in (by_entries, by_arrays)
    ]
    assert remarks[0] == remarks[1]
    for name in by_arrays.links:
        one, other = by_entries.link(name), by_arrays.link(name)
        np.testing.assert_allclose(one.angle, other.angle, atol=1e-7)
        greatest = 1.0 + np.nanmax(np.abs(other.angular_velocity), initial=0.0)
        both = np.isfinite(one.angular_velocity) & np.isfinite(other.angular_velocity)
        assert np.mean(both) > 0.8
        np.testing.assert_allclose(one.angular_velocity[both], other.angular_velocity[both], atol=1e-6 * greatest)


def test_the_transmission_angle_of_the_last_of_many_four_bars_is_that_of_coupler_and_rocker():
    """With more coordinates than are solved as arrays; in a run and at a position."""
    mechanism, last = planar.from_dict(chain.document(40)), chain.last_rocker(40)
    run, state = planar.cycle(mechanism, 12), planar.solve(mechanism)
    for moving, inside in ((run, slice(1, -1)), (state, slice(None))):
        angle = np.atleast_1d(planar.transmission(moving, last).angle)[inside]
        between = np.atleast_1d(moving.link(last).angle - moving.link(last.replace("rocker", "coupler")).angle)[inside]
        np.testing.assert_allclose(np.sin(angle), np.abs(np.sin(between)), rtol=1e-7)


def test_lifts_end_at_their_flat_positions_by_entries(few_dense_unknowns):
    few_dense_unknowns()
    run = planar.cycle(planar.from_dict(lift_document(6)), 12)
    assert run.reason == "the range of 's' ends at s = -2 m and s = 2 m"


def test_a_long_row_moves_as_four_bar_after_four_bar():
    links = 160
    mechanism = planar.from_dict(chain.document(links))
    assert equation_functions(mechanism).is_sparse
    run = planar.cycle(mechanism, 24)
    inside = slice(1, -1)  # it is limited by dead points
    angle, velocity, _ = chain.motion(np, links, np.asarray(run.link("crank").angle)[inside])
    last = run.link(chain.last_rocker(links))
    np.testing.assert_allclose(np.cos(np.asarray(last.angle)[inside]), np.cos(angle), atol=1e-7)
    np.testing.assert_allclose(np.asarray(last.angular_velocity)[inside], velocity, rtol=1e-4)
    state = planar.solve(mechanism)
    own, rate, _ = chain.motion(math, links, mechanism.inputs[0].position)
    assert math.cos(state.link(chain.last_rocker(links)).angle) == pytest.approx(math.cos(own), abs=1e-8)
    assert state.link(chain.last_rocker(links)).angular_velocity == pytest.approx(rate, rel=1e-5)
