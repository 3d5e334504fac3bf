"""What is kept from one solution to the next, and what is judged block after block, against the general path."""

import pickle
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

import planar
from planar.equations import acceptance, block_type_functions, rates
from planar.equations.casadi_functions import CHUNK_SIZES, BufferedFunction
from planar.equations.functions import MAX_CACHED_STRUCTURES, EquationFunctions
from planar.model.mechanism import Drive, replace_inputs
from planar.solving import position
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.continuation import fast_path, path
from planar.solving.continuation.fast_path import InputRates, fast_position, fast_run
from planar.solving.position import PositionSolver, SolvedMechanism
from tests.acceptance import spoil_runs
from tests.builders import four_bar
from tests.closed_forms import between

ROCKER = (0.3, 0.8, 0.7, 1.0)
CLOSED = ("crank-rocker", "crank-and-slotted-lever", "offset-slider-crank", "sewing-machine")
MODELS = (
    "crank-rocker",
    "crank-and-slotted-lever",
    "geared-five-bar",
    "four-bar",
    "cardan-gears",
    "elliptical-trammel",
)


def mechanism(theta=1.0, lengths=ROCKER):
    return four_bar(*lengths, theta)


def turn(solver, rows=91):
    """Inputs of a turn (rows, inputs), with velocity 2 and acceleration 3."""
    u = solver.inputs.u + np.linspace(0.0, 2.0 * np.pi, rows)[:, None]
    return InputRates(u, np.full_like(u, 2.0), np.full_like(u, 3.0), np.zeros_like(u))


@pytest.mark.parametrize("many", [1, 7, CHUNK_SIZES[-1], CHUNK_SIZES[0], CHUNK_SIZES[0] + CHUNK_SIZES[-1] + 3])
def test_a_called_function_tells_of_many_positions_what_it_tells_of_each(many):
    x, y = ca.SX.sym("x", 2), ca.SX.sym("y", 1)
    called = BufferedFunction(ca.Function("f", [x, y], [ca.horzcat(x * y, ca.sin(x)), y + x[0]]))
    at, fixed = np.random.default_rng(0).normal(size=(many, 2)), np.array([0.7])
    whole, more = called.evaluate_batch(many, at, fixed)
    np.testing.assert_allclose(whole, np.stack([at * 0.7, np.sin(at)], axis=1), rtol=1e-15)
    np.testing.assert_array_equal(more[:, 0, 0], 0.7 + at[:, 0])
    for k in range(many):
        np.testing.assert_array_equal(called(at[k], fixed)[0], whole[k])
    assert called(at[0], fixed)[0] is not called(at[0], fixed)[0]


@pytest.mark.parametrize("name", MODELS)
def test_the_quick_path_tells_what_the_general_one_does(name, monkeypatch):
    model = planar.load(name)
    quick = planar.solve(model), planar.cycle(model, 60)
    monkeypatch.setattr(position, "fast_position", lambda *_: None)
    monkeypatch.setattr(path, "fast_run", lambda *_: None)
    monkeypatch.setattr("planar.solving.cycle.fast_run", lambda *_: None)
    slow = PositionSolver(model).state(PositionSolver(model).find_assembly().z), planar.cycle(model, 60)
    for one, other in zip(quick, slow, strict=True):
        assert one.remarks == other.remarks
        for point, parts in other.points.items():
            scale = 1.0
            for found, wanted in zip(one.points[point][:3], parts[:3], strict=True):
                scale = max(float(np.nanmax(np.abs(wanted))), scale)
                np.testing.assert_allclose(found, wanted, atol=1e-10 * scale, rtol=0)
    assert (quick[0].mobility, quick[1].outcome, quick[1].reason) == (1, slow[1].outcome, slow[1].reason)


def test_a_run_is_told_block_after_block_where_nothing_is_near():
    solver = PositionSolver(mechanism())
    inputs = turn(solver)
    found = path.follow_samples(solver, solver.find_assembly().z, inputs)
    assert len(found.z) == len(inputs.u)
    assert found.is_sure[1:].all()
    assert 0.0 < found.residual <= solver.tolerance


def test_a_course_ends_before_a_row_that_has_flipped(monkeypatch):
    solver = PositionSolver(mechanism())
    z, flipped = (each.find_assembly().z for each in (solver, PositionSolver(four_bar(*ROCKER, 1.0, -1))))
    inputs = turn(solver)
    assert len(fast_run(solver, z, inputs).z) == len(inputs.u)
    other = fast_run(solver, flipped, inputs).z

    def flip(found, given):
        found[29:] = other[30:]

    spoil_runs(solver, monkeypatch, flip)
    assert len(fast_run(solver, z, inputs).z) == 30


@pytest.mark.parametrize("spoil", [1e-6, np.nan])
def test_a_course_ends_before_a_row_that_is_open(monkeypatch, spoil):
    solver = PositionSolver(mechanism())
    inputs = turn(solver)

    def open_pin(found, given):
        found[40, 1] += spoil

    spoil_runs(solver, monkeypatch, open_pin)
    assert len(fast_run(solver, solver.find_assembly().z, inputs).z) == 41


@pytest.mark.parametrize("order", ["first", "second"])
def test_wrong_rates_of_a_block_type_do_not_pass(order, monkeypatch):
    solver = PositionSolver(mechanism())
    z = solver.find_assembly().z
    assert fast_position(solver, z) is not None
    real = getattr(rates.UnknownRates, order)
    monkeypatch.setattr(rates.UnknownRates, order, lambda self, *given: real(self, *given) * (1.0 + 1e-7))
    monkeypatch.setattr(block_type_functions, "known_text", lambda _: None)
    monkeypatch.setattr(acceptance, "block_type_functions", block_type_functions.BlockTypeFunctions)
    wrong = acceptance.AcceptanceFunctions(solver.structure.mechanism, EquationFunctions(solver.equations))
    monkeypatch.setattr(solver.structure, "acceptance", wrong)
    assert fast_position(solver, z) is None
    s = solver.inputs
    _, told = wrong.position(z, acceptance.InputSamples(s.u, s.u1, s.u2), solver.acceptance_scales)
    assert (told.velocity_error > 1e-9, told.acceleration_error > 1e-9) == (order == "first", order == "second")


def test_a_position_beside_a_dead_point_is_left_to_the_general_path():
    """B, C and D all but in line: the crank of a triple rocker stands next to its limit."""
    lengths = (1.0, 0.8, 0.7, 0.9)
    limit = between(1.0, 0.9, 1.5)
    near, far = (PositionSolver(four_bar(*lengths, limit - gap)) for gap in (1e-8, 0.3))
    assert fast_position(far, far.find_assembly().z) is not None
    assert fast_position(near, near.find_assembly().z) is None


def test_where_a_drive_leads_does_not_depend_on_what_was_asked_for_before():
    first, second = SolvedMechanism(mechanism()), SolvedMechanism(mechanism())
    for theta in (5.1, 1.3, -2.0, 2.0):
        first.nearby_positions.unknowns_at([theta])
    for theta in (1.05, 2.0, 4.7, -0.9):
        np.testing.assert_array_equal(
            first.nearby_positions.unknowns_at([theta]),
            second.nearby_positions.unknowns_at([theta]),
        )


def test_a_drive_leads_where_following_does():
    known = SolvedMechanism(mechanism())
    here = known.solver
    for theta in (1.0, 1.01, 1.125, 3.0, -4.0, 30.0):
        u = np.array([theta])
        wanted = path.follow_to(here, known.assembly.z, here.inputs.u, u)
        np.testing.assert_allclose(known.nearby_positions.unknowns_at([theta]), wanted, atol=1e-12)


@pytest.mark.parametrize("name", [*MODELS, "klann-leg", "watt-six-bar"])
def test_a_drive_by_the_formula_of_one_step_is_the_state_to_which_following_leads(name):
    """With positions, velocities and accelerations of its inputs, near and far, both ways."""
    model = planar.load(name)
    known = position.solved_mechanism(model)
    here = known.solver
    for _ in range(2 + int(here.acceptance._calls_before_fusing)):
        planar.solve(model)
    pair, rng = model.inputs[0].pair, np.random.default_rng(0)
    by_formula = 0
    for move in (0.01, -0.03, 0.11, 0.2, -0.3, 0.01, 0.125):
        drive = Drive(pair, model.inputs[0].position + move * (here.unit if here.is_sliding(pair) else 1.0))
        if rng.random() < 0.5:
            drive = drive._replace(velocity=float(rng.normal()), acceleration=float(rng.normal()))
        moved = replace_inputs(model, (drive,))
        there = PositionSolver(moved)
        quick = known.nearby_positions.position_at(moved)
        try:
            z = path.follow_to(here, known.assembly.z, here.inputs.u, there.inputs.u)
        except planar.NoAnswer:
            assert quick is None
            continue
        wanted, found = there.state(z), planar.solve(model, [drive])
        assert found.mechanism == wanted.mechanism and found.residual <= there.tolerance
        for point, state in wanted.points.items():
            for order in ("position", "velocity", "acceleration"):
                np.testing.assert_allclose(
                    getattr(found.point(point), order), getattr(state, order), rtol=1e-9, atol=1e-9
                )
        if quick is not None:
            by_formula += 1
            np.testing.assert_allclose(
                quick.coordinate_rates[0, list(here.equations.unknowns)], z, rtol=1e-11, atol=1e-11
            )
    assert by_formula >= 4


def test_a_drive_beyond_a_dead_point_is_none_by_the_formula_of_one_step():
    """Nor is one next to it, where its two branches come together."""
    model = planar.load("four-bar")
    known = position.solved_mechanism(model)
    for _ in range(2 + int(known.solver.acceptance._calls_before_fusing)):
        planar.solve(model)
    limit = planar.cycle(model, steps=4).limits[-1].input
    for beyond in (1e-3, 0.05, 0.4, -1e-7):
        moved = replace_inputs(model, (Drive("A", limit + beyond),))
        assert known.nearby_positions.position_at(moved) is None
    quick = known.nearby_positions.position_at(replace_inputs(model, (Drive("A", 1.2),)))
    z = quick.coordinate_rates[0, list(known.solver.equations.unknowns)]
    np.testing.assert_allclose(z, known.nearby_positions.unknowns_at([1.2]), rtol=1e-12, atol=1e-12)


MIDDLE = 15


@pytest.mark.parametrize("name", [*MODELS, "klann-leg", "double-butterfly", "watt-six-bar"])
def test_a_run_from_within_is_the_two_runs_from_there(name):
    here = PositionSolver(planar.load(name))
    z = here.find_assembly().z
    rows = here.inputs.u + np.linspace(-0.3, 0.2, 26)[:, None] * (np.arange(len(here.inputs.u)) == 0)
    rows += here.inputs.u - rows[MIDDLE]
    inputs = InputRates(rows, np.ones_like(rows), np.zeros_like(rows), np.zeros_like(rows))
    for _ in range(3):
        whole = fast_run(here, z, inputs, MIDDLE)
        down, up = (fast_run(here, z, inputs.select(part)) for part in (slice(MIDDLE, None, -1), slice(MIDDLE, None)))
        if len(down.z) + len(up.z) <= len(rows):
            assert whole is None
            continue
        np.testing.assert_allclose(whole.z, np.vstack([down.z[::-1], up.z[1:]]), rtol=1e-11, atol=1e-11)
        wanted = np.vstack([down.coordinate_rates[::-1], up.coordinate_rates[1:]])
        np.testing.assert_allclose(whole.coordinate_rates, wanted, rtol=1e-8, atol=1e-8)


def test_a_drive_through_a_dead_point_is_refused_as_before_and_again():
    model = planar.load("four-bar")
    for _ in range(2):
        with pytest.raises(planar.NoAnswer, match="dead point"):
            planar.solve(model, {"A": 3.1})


def test_kept_positions_are_few(monkeypatch):
    monkeypatch.setattr(fast_path, "MAX_STORED_NUMBERS", 40)
    monkeypatch.setattr(fast_path, "MIN_STORED_POSITIONS", 1)
    known = SolvedMechanism(mechanism())
    assert known.nearby_positions.unknowns_at(np.array([1.0 + 19 * fast_path.STEP_LENGTH])) is not None
    assert known.nearby_positions.unknowns_at(np.array([1.0 + 22 * fast_path.STEP_LENGTH])) is None
    assert sum(len(each) for each in known.nearby_positions._kept.values()) <= 21
    for number in range(3):
        planar.solve(mechanism(1.0 + 0.01 * number))
    assert (
        position._cached_solved_mechanism.cache_info().currsize
        <= position._cached_solved_mechanism.cache_info().maxsize
        == MAX_CACHED_STRUCTURES
    )


def test_mechanisms_of_one_structure_share_all_but_their_numbers():
    one, other = mechanism(), mechanism(lengths=(0.3, 0.85, 0.7, 1.0))
    assert PositionSolver(one).structure is PositionSolver(other).structure
    assert planar.solve(one).link("BC").angle != planar.solve(other).link("BC").angle
    moved = replace_inputs(one, (Drive("A", 1.2, 3.0, -1.0),))
    theirs, own = planar.solve(one, [Drive("A", 1.2, 3.0, -1.0)]), planar.solve(moved)
    for point in own.points:
        for found, wanted in zip(theirs.point(point)[:3], own.point(point)[:3], strict=True):
            np.testing.assert_allclose(found, wanted, atol=1e-12)
    assert theirs.inputs["A"] == own.inputs["A"]


def test_a_hash_is_kept_but_not_carried_to_another_process():
    model = mechanism()
    assert hash(model) == hash(mechanism()) != hash(mechanism(1.1))
    assert "_hash" in model.__dict__
    other = pickle.loads(pickle.dumps(model))
    assert "_hash" not in other.__dict__
    assert other == model
    assert "_hash" not in replace(model, name="other").__dict__


def test_a_mechanism_made_of_lists_is_solved_too():
    model = replace(mechanism(), sketch=list(mechanism().sketch))
    with pytest.raises(TypeError):
        hash(model)
    assert planar.solve(model).link("BC").angle == planar.solve(mechanism()).link("BC").angle


def test_frames_are_placed_when_they_are_asked_for():
    state = planar.solve(mechanism())
    assert "frames_and_own" not in state.frames.source.__dict__
    _ = state.point("C")
    assert "frames_and_own" in state.frames.source.__dict__
    assert set(state.frames) == {"AD", "AB", "BC", "DC"}


@pytest.mark.parametrize("name", CLOSED)
def test_both_assemblies_in_closed_form_are_those_that_newtons_method_finds(name, monkeypatch):
    setup = PositionSolver(planar.load(name))
    z, seen = setup.find_assembly().z, 0
    for stage in setup.equations.blocks:
        quick = BlockAssemblies(setup)._closed_form(stage, z)
        if quick is None:
            continue
        with monkeypatch.context() as patched:
            patched.setattr(BlockAssemblies, "_closed_form", lambda *_: None)
            patched.setattr("planar.solving.assembly.block_assemblies.CLEAR_SKETCH_DISTANCE", -1.0)
            slow, _ = BlockAssemblies(setup).near_sketch(stage, z)
        assert len(quick) == len(slow) == 2
        for one, other in zip(quick, slow, strict=True):
            np.testing.assert_allclose(np.exp(1j * one.z), np.exp(1j * other.z), atol=1e-11)
            assert one[1:] == pytest.approx(other[1:], abs=1e-10)
        seen += 1
    assert seen
