"""Equations that are assembled from elements, and blocks by their types, beside functions of the whole."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest

import planar
from planar.equations import assembled_equations
from planar.equations.functions import EquationFunctions
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.rates import rate_symbols, time_derivatives
from planar.equations.sparse_matrices import SparseMatrices
from planar.equations.symbolic_equations import build_equations
from planar.model.pairs import pair_types
from planar.solving.position import PositionSolver
from tests.builders import lift_document
from tests.known import MODELS, some_models

COMPARED = [stem for stem in some_models(4) if MODELS[stem].closes_within is None]
"""Models that show every pair type; where pairs may stay open there are no elements."""


@cache
def equations_of(stem):
    return build_equations(equation_structure(MODELS[stem]))


def of_expressions(equations):
    """The functions that casadi derives from the equations of the whole."""
    return EquationFunctions(replace(equations, elimination=None))


SQUARE = [stem for stem in COMPARED if MODELS[stem].inputs and equations_of(stem).is_square]


def random_place(equations, samples, seed=0):
    """z, u and p at random places."""
    rng = np.random.default_rng(seed)
    counts = len(equations.unknowns), len(equations.input_kinds), equations.elimination.number_count
    z, u, p = (rng.uniform(0.5, 1.5, (samples, count)) for count in counts)
    return z, u, p[0]


def random_place_of(stem, samples):
    """The same of a model; the numbers of a cam of arcs are its own, since such arcs have to meet."""
    z, u, p = random_place(equations_of(stem), samples)
    return z, u, PositionSolver(MODELS[stem]).inputs.p if stem == "tangent-cam" else p


def test_every_pair_type_is_in_a_model_that_is_compared():
    for stems in (COMPARED, SQUARE):
        assert {type(pair) for stem in stems for pair in MODELS[stem].pairs} == set(pair_types().values())


@pytest.mark.parametrize("stem", COMPARED)
def test_elements_say_what_expressions_of_the_whole_say(stem, monkeypatch):
    equations = equations_of(stem)
    assembled, compiled = equations.assembled, of_expressions(equations)
    z, u, p = random_place_of(stem, 3)
    y = np.hstack([z, u])
    y1, y2 = np.random.default_rng(1).normal(size=(2, *y.shape))
    expected = compiled.kinematics(y, y1, y2, p)
    residuals, coordinates, entries = assembled.kinematics(y, y1, y2, p)
    for order in range(3):
        np.testing.assert_allclose(residuals[:, order], expected[order], rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(coordinates[:, order], expected[3 + order], rtol=1e-10, atol=1e-10)
    jacobian = np.asarray(SparseMatrices(assembled.pattern, entries))
    both = np.concatenate([np.asarray(expected.jacobian), expected.input_jacobian], axis=2)
    np.testing.assert_allclose(jacobian, both, rtol=1e-10, atol=1e-10)
    np.testing.assert_array_equal(assembled.residuals_and_jacobians(z, u, p)[1], entries)
    for limit in (0, 10**6):  # by a sparse factorisation, and by sums
        monkeypatch.setattr(assembled_equations, "MAX_DENSE_SIZE", limit)
        np.testing.assert_allclose(assembled.coordinates(z, u, p), coordinates[:, 0], rtol=1e-10, atol=1e-10)
    assert assembled.kinematics(y[:0], y1[:0], y2[:0], p)[0].shape == (0, 3, len(equations.rows))


@pytest.mark.parametrize("stem", SQUARE)
def test_types_of_blocks_say_what_functions_of_the_whole_say(stem):
    solver, equations = PositionSolver(MODELS[stem]), equations_of(stem)
    by_types, compiled = EquationFunctions(equations), of_expressions(equations)
    z, u, p = random_place(equations, 5)
    p = solver.inputs.p
    for block in equations.blocks:
        first, second = (functions.block_call(block) for functions in (by_types, compiled))
        for a, b in zip(first.evaluate_batch(5, z, u, p), second.evaluate_batch(5, z, u, p), strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10)
        for k in (0, 3, 1):  # from one position to another, of which one block or all differ
            for a, b in zip(first(z[k], u[k], p), second(z[k], u[k], p), strict=True):
                np.testing.assert_allclose(a, b, rtol=1e-10, atol=1e-10)
        first, second = (functions.block_assemblies(block) for functions in (by_types, compiled))
        assert (first is None) == (second is None)
        if first is not None:
            a, b = (assemblies.evaluate_batch(z, u, p) for assemblies in (first, second))
            np.testing.assert_allclose(np.array(a[0]), np.array(b[0]), rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(a[1], b[1], rtol=1e-9, atol=1e-9)


def test_equal_blocks_share_one_type():
    equations = build_equations(equation_structure(planar.from_dict(lift_document(4))))
    functions = EquationFunctions(equations)
    keys = [placed.key for placed in functions.placed_blocks if placed is not None and placed.key.unknown_count]
    assert len(set(keys)) < len(keys)


def test_loops_of_a_tower_stay_short_and_its_coordinates_are_sums_along_them(monkeypatch):
    """A constraint of an upper stage rests on its neighbours, not on all stages down to the frame."""
    entries = []
    for stages in (8, 30):
        equations = build_equations(equation_structure(planar.from_dict(lift_document(stages))))
        assembled = equations.assembled
        entries.append(len(assembled.pattern.rows) / stages)
        z, u, p = random_place(equations, 3)
        expected = of_expressions(equations).coordinates(z, u, p)
        for limit in (0, 10**6):  # by a triangular matrix, and by sums
            monkeypatch.setattr(assembled_equations, "MAX_DENSE_SIZE", limit)
            np.testing.assert_allclose(assembled.coordinates(z, u, p), expected, rtol=1e-11, atol=1e-11)
    assert entries[1] < 1.2 * entries[0]


@pytest.mark.parametrize("stem", COMPARED)
def test_functions_joined_from_elements_say_what_index_arrays_say(stem):
    equations = equations_of(stem)
    functions = EquationFunctions(equations)
    z, u, p = random_place(equations, 7)
    expected, entries = equations.assembled.residuals_and_jacobians(z, u, p)
    jacobians = np.asarray(SparseMatrices(equations.assembled.pattern, entries))
    for k in range(len(z)):
        residuals, jacobian = functions.residuals_and_jacobian(z[k], u[k], p)
        np.testing.assert_allclose(residuals, expected[k], rtol=1e-13, atol=1e-13)
        np.testing.assert_allclose(np.asarray(jacobian), jacobians[k], rtol=1e-13, atol=1e-13)
        coordinates = equations.assembled.coordinates(z[k : k + 1], u[k : k + 1], p)[0]
        np.testing.assert_allclose(functions.coordinates(z[k], u[k], p), coordinates, rtol=1e-13, atol=1e-13)


def test_what_is_not_defined_at_a_place_is_not_a_number():
    equations = equations_of("whitworth")
    form = next(filter(None, map(EquationFunctions(equations).block_assemblies, equations.blocks)))
    z, u, p = random_place(equations, 7)
    few, many = (form.of_designs(z[:count], u[:count], 0.0 * p) for count in (1, 7))
    assert np.isnan(few[0]).any()
    np.testing.assert_array_equal(np.isnan(few[0]), np.isnan(many[0][:, :1]))


@pytest.mark.parametrize("stem", COMPARED)
def test_what_is_carried_out_on_jets_is_what_casadi_derives(stem):
    e = equations_of(stem)
    functions = EquationFunctions(e)
    z, u, p = random_place_of(stem, 3)
    y = np.hstack([z, u])
    y1, y2, y3 = np.random.default_rng(2).normal(size=(3, *y.shape))
    both, symbols = ca.vertcat(e.F, e.w), rate_symbols(e.y, 3)
    rates = time_derivatives(both, e.y, *symbols)
    slopes = [ca.jacobian(each, e.y) for each in (both, *rates[:2])]
    sizes = ca.mtimes(ca.fabs(ca.jacobian(both, e.p)), ca.fabs(e.p)) + ca.mtimes(ca.fabs(slopes[0]), ca.fabs(e.y))
    derived = ca.Function("derived", [e.y, *symbols, e.p], [rates[2], sizes, *slopes])
    rates_of_y = y, y1, y2, y3
    third = np.hstack(
        [
            functions.formulas.third_residual_rates(rates_of_y, p),
            functions.formulas.third_coordinate_rates(rates_of_y, p),
        ]
    )
    terms = functions.formulas.rounding_terms(y, y1, y2, p)
    for k in range(len(y)):
        expected = [each.full() for each in derived(y[k], y1[k], y2[k], y3[k], p)]
        for values, of_casadi in zip((third[k], terms.term_sum[k]), expected, strict=False):
            np.testing.assert_allclose(values, of_casadi[:, 0], rtol=1e-9, atol=1e-9 * (1.0 + np.abs(of_casadi).max()))
        for values, of_casadi in zip(terms[2:], expected[2:], strict=True):
            np.testing.assert_allclose(values[k], of_casadi, rtol=1e-9, atol=1e-9 * (1.0 + np.abs(of_casadi).max()))
        change = functions.formulas.jacobian_changes(y[k], y1[k : k + 1], p)[0]
        np.testing.assert_allclose(change, expected[3][: len(change)], rtol=1e-9, atol=1e-9)
