"""Positions and runs block after block: by one formula of all, by matrices of numbers, and by the general check."""

import numpy as np
import pytest

from planar.equations.acceptance import AcceptanceFunctions, InputSamples
from planar.equations.block_motion import LargeBlockMotion
from planar.equations.block_types import block_equations
from planar.equations.functions import EquationFunctions
from planar.equations.mechanism_numbers import equation_structure
from planar.model.pairs import pair_types
from planar.solving.checks import stack_motion
from planar.solving.position import solved_mechanism
from tests.known import MODELS

STEMS = (
    "belt-arm",
    "cam-with-spring",
    "chain-swing-arm",
    "double-butterfly",
    "geared-five-bar",
    "geneva-wheel",
    "planetary-differential",
    "rack-steering",
    "slotted-yoke",
    "whitworth",
)


def judged(stem, samples=9):
    """A solver, functions that nothing has called, and a run of all inputs from the file's position, with rates."""
    known = solved_mechanism(MODELS[stem])
    solver = known.solver
    functions = AcceptanceFunctions(equation_structure(MODELS[stem]), EquationFunctions(solver.equations))
    way = np.linspace(1.0, 1.5, len(solver.inputs.u))
    u = solver.inputs.u + np.linspace(0.0, 0.02, samples)[:, None] * way
    given = InputSamples(u, np.broadcast_to(way, u.shape), np.full_like(u, 0.3))
    return solver, functions, known.assembly.z, given


def test_every_pair_type_is_judged():
    assert {type(pair) for stem in STEMS for pair in MODELS[stem].pairs} == set(pair_types().values())


@pytest.mark.parametrize("stem", STEMS)
def test_one_formula_of_all_blocks_says_what_they_say_one_after_the_other(stem):
    solver, functions, z, given = judged(stem)
    here = InputSamples(*(each[0] for each in given))
    parts, told = functions.position(z, here, solver.acceptance_scales)
    functions._call_count = 10**6
    again, fused = functions.position(z, here, solver.acceptance_scales)
    assert functions._fused_position.formula.instructions
    np.testing.assert_allclose(again, parts, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(fused, told, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("stem", STEMS)
def test_what_is_open_and_rates_that_are_wrong_are_judged_as_the_general_check_judges_them(stem):
    solver, functions, z, given = judged(stem)
    found, run = functions.run(z, given, solver.acceptance_scales)
    assert (solver.max_residuals(found, given.u) <= solver.tolerance).all()
    rng = np.random.default_rng(1)
    wrong = run.coordinate_rates + 1e-5 * rng.uniform(-1.0, 1.0, run.coordinate_rates.shape)
    motion = np.concatenate([wrong.transpose(1, 2, 0), np.array([part.T for part in given])], axis=1)
    residual, _, velocity_error, acceleration_error, _ = functions.check.judge(motion, solver.inputs.p)
    check = solver.structure.residual_check
    np.testing.assert_array_equal(stack_motion(wrong.transpose(1, 0, 2), given), motion)
    open_now = solver.coordinate_residuals(wrong[:, 0], given.u)
    np.testing.assert_allclose(residual, open_now.max(axis=0), rtol=1e-6)
    errors = check.rate_residuals(motion, solver.inputs.p)
    for error, (gaps, _) in zip((velocity_error, acceleration_error), errors, strict=True):
        np.testing.assert_allclose(error, gaps, rtol=1e-6)


@pytest.mark.parametrize("stem", STEMS)
def test_matrices_of_numbers_move_blocks_as_formulas_do(stem):
    solver, functions, z, given = judged(stem)
    found, run = functions.run(z, given, solver.acceptance_scales)
    blocks = [(block, placed, _by_matrices(placed, of_type)) for block, placed, of_type in functions._blocks]
    functions.__dict__["_blocks"] = blocks
    by_matrices = functions.judge(found, given, solver.acceptance_scales)
    scale = np.abs(run.coordinate_rates).max()
    np.testing.assert_allclose(by_matrices.coordinate_rates, run.coordinate_rates, rtol=1e-9, atol=1e-10 * scale)
    # formulas give bounds: what they call regular is
    tight = 1.0 - 1e-9
    assert (by_matrices.result.regularity >= tight * run.result.regularity).all()
    assert (by_matrices.result.least_singular_value >= tight * run.result.least_singular_value).all()
    assert (np.signbit(by_matrices.distances) == np.signbit(run.distances)).all()
    assert (np.abs(by_matrices.distances) >= (1.0 - 1e-4) * np.abs(run.distances)).all()


def _by_matrices(placed, of_type):
    """The functions of a block type, its motion by matrices."""
    if not placed.key.unknown_count:
        return of_type
    other = type(of_type)(placed.key)
    other.__dict__["motion"] = LargeBlockMotion(block_equations(placed.key))
    return other
