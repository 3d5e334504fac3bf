"""The gate is tried by fooling it: with a flipped assembly, and with finite wrong answers."""

import numpy as np
import pytest

from planar.document import files
from planar.foundation.errors import NoAnswer, Outcome
from planar.solving import position, sample_rates
from planar.solving.continuation.fast_path import is_move_allowed, resting_inputs
from planar.solving.continuation.path import PathFollower, follow_samples, follow_to
from planar.solving.position import PositionSolver
from tests.acceptance import spoil_runs
from tests.builders import four_bar_document
from tests.checks import accept_steps

CRANK = four_bar_document(0.3, 0.9, 0.7, 1.0, 0.8, omega=2.0, alpha=1.0, sketch={"C": [0.9, 0.7]})


@pytest.fixture
def solver() -> PositionSolver:
    return PositionSolver(files.from_dict(CRANK))


@pytest.fixture
def by_general_path(monkeypatch) -> list[float]:
    """The places of samples that the general path solves."""
    places, real = [], PathFollower.unknowns_at
    monkeypatch.setattr(PathFollower, "unknowns_at", lambda self, place: places.append(place) or real(self, place))
    return places


def mirrored(solver: PositionSolver, z: np.ndarray) -> np.ndarray:
    """The other assembly of the dyad, by reflecting C in the line BD."""
    state = solver.state(z)
    b, c, d = (state.point(name).position for name in "BCD")
    way = (d - b) / np.linalg.norm(d - b)
    foot = b + way * ((c - b) @ way)
    flipped = 2 * foot - c
    return np.array([np.arctan2(*(flipped - b)[::-1]), np.arctan2(*(flipped - d)[::-1])])


def circle(solver: PositionSolver, samples: int = 91) -> np.ndarray:
    return solver.inputs.u + np.linspace(0, 2 * np.pi, samples)[:, None]


def test_the_flipped_assembly_is_closed_too(solver):
    z = mirrored(solver, solver.find_assembly().z)
    assert solver.max_residuals(z[None], solver.inputs.u[None])[0] < solver.tolerance


def test_a_step_to_the_flipped_assembly_is_refused_though_its_residual_is_zero(solver):
    z, u = solver.find_assembly().z, solver.inputs.u
    ahead = u + 0.01
    on = follow_to(solver, z, u, ahead)
    off = mirrored(PositionSolver(files.from_dict(CRANK | {"inputs": [{"pair": "A", "position": 0.81}]})), on)
    inputs = np.array([u, ahead])
    for after, keeps in ((on, True), (off, False)):
        assert np.all(solver.max_residuals(np.array([z, after]), inputs) < solver.tolerance)
        steps = accept_steps(solver.acceptance, np.array([z, after]), inputs, solver.acceptance_scales)
        assert steps.tolist() == [keeps]


def test_followed_samples_are_on_the_branch_and_the_flipped_ones_are_another_branch(solver):
    """The second assembly is followed as well as the first, and passes: it is the way between them that does not."""
    inputs = circle(solver)
    first = follow_samples(solver, solver.find_assembly().z, resting_inputs(inputs)).z
    second = follow_samples(solver, mirrored(solver, first[0]), resting_inputs(inputs)).z
    for followed in (first, second):
        assert accept_steps(solver.acceptance, followed, inputs, solver.acceptance_scales).all()
    crossed = np.where(np.arange(len(inputs))[:, None] % 2, first, second)
    assert not accept_steps(solver.acceptance, crossed, inputs, solver.acceptance_scales).any()


def test_a_run_whose_program_flips_half_way_is_put_right_and_counted(solver, by_general_path, monkeypatch):
    z, inputs = solver.find_assembly().z, circle(solver)
    honest = follow_samples(solver, z, resting_inputs(inputs))
    assert not by_general_path

    def flip(found, u):
        for k in range(len(u)):
            if inputs[30, 0] <= u[k, 0] < inputs[34, 0]:
                other = CRANK | {"inputs": [{"pair": "A", "position": float(u[k, 0])}]}
                found[k] = mirrored(PositionSolver(files.from_dict(other)), found[k])

    spoil_runs(solver, monkeypatch, flip)
    fooled = follow_samples(solver, z, resting_inputs(inputs))
    assert 4 <= len(by_general_path) <= 6  # those that were flipped, and what lies on the same arc of the curve
    turns = (fooled.z - honest.z) / (2 * np.pi)
    np.testing.assert_allclose(fooled.z, honest.z + 2 * np.pi * np.round(turns), atol=1e-12)


@pytest.mark.parametrize("spoil", [1e-9, 1e-3, 1.0, np.nan, np.inf])
def test_a_finite_wrong_answer_from_the_program_does_not_get_out(solver, spoil):
    z = solver.find_assembly().z
    with pytest.raises(NoAnswer) as refused:
        solver.state(z + np.array([0.0, spoil]))
    assert refused.value.outcome is Outcome.CANNOT_BE_ASSEMBLED
    assert "'C'" in refused.value.reason or "'D'" in refused.value.reason or "'B'" in refused.value.reason


def test_samples_with_a_wrong_or_missing_value_go_to_the_general_path(solver, by_general_path, monkeypatch):
    z, inputs = solver.find_assembly().z, circle(solver)
    honest = follow_samples(solver, z, resting_inputs(inputs))

    def spoil(found, u):
        found[u[:, 0] == inputs[50, 0], 0] += 1e-6
        found[u[:, 0] == inputs[70, 0], 1] = np.nan

    spoil_runs(solver, monkeypatch, spoil)
    found = follow_samples(solver, z, resting_inputs(inputs))
    assert len(by_general_path) == 2
    np.testing.assert_allclose(found.z, honest.z, atol=1e-12)


def test_wrong_velocities_and_accelerations_are_refused(solver, monkeypatch):
    z = solver.find_assembly().z
    monkeypatch.setattr(position, "fast_position", lambda *_: None)
    real = sample_rates.solve_vectors
    for order in (1, 2):
        calls = []

        def wrong(slope, known, calls=calls, order=order):
            calls.append(1)
            return real(slope, known) * (1.0 + (1e-7 if len(calls) == order else 0.0))

        monkeypatch.setattr(sample_rates, "solve_vectors", wrong)
        with pytest.raises(NoAnswer) as refused:
            solver.state(z)
        assert ("velocities" if order == 1 else "accelerations") in refused.value.reason


def test_residual_is_judged_with_cos_and_sin_made_afresh_from_the_angle(solver):
    """A program that carries a wrong sine beside the right angle closes its own equations, not the gate's."""
    state, u = solver.state(solver.find_assembly().z), solver.inputs.u[None]
    assert solver.coordinate_residuals(solver.coordinates(state.frames, state.own)[None], u).max() < solver.tolerance
    bent = state.frames["BC"]._replace(angle=state.frames["BC"].angle + 0.1)
    w = solver.coordinates(state.frames | {"BC": bent}, state.own)
    assert solver.coordinate_residuals(w[None], u).max() > 0.01


def test_a_move_is_allowed_if_the_rates_at_its_ends_explain_it():
    at, h = 0.3, 0.05
    before, after = np.array([np.cos(at) * h]), np.array([np.cos(at + h) * h])
    move = np.array([np.sin(at + h) - np.sin(at)])
    assert is_move_allowed(move, before, after).all()
    assert not is_move_allowed(move + 0.1, before, after).any()
    assert not is_move_allowed(-move, before, after).any()
    assert not is_move_allowed(np.array([np.nan]), before, after).any()
