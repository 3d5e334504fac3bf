"""Sweeps: every design as its own cycle and the closed forms have it, refused where it must be, kept in stores."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import planar
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.march import runs
from planar.batch.march.checks import DesignEvaluation
from planar.batch.reference_design import reference_design
from planar.document import files
from planar.document.dimensions import link_lengths
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.instruction_list import UnsupportedOperation
from planar.solving.position import PositionSolver
from tests.builders import block_slider_crank, designs_around, four_bar
from tests.checks import ORDERS, accept_steps
from tests.closed_forms import PARALLELOGRAM, ROCKER, TRIPLE, TURN, coupler, rates, rocker
from tests.draws import draws, part
from tests.known import MODELS
from tests.linkages import random_linkage


def cycles(mechanism, designs, result, steps, pair=None, start=None, stop=None):
    """Every design's status, rows and rates are those of its own cycle; returns how far they are off at most."""
    worst = 0.0
    for k in range(len(result)):
        changed, inputs = with_design_values(mechanism, values_of_design(designs, k)), np.atleast_2d(result.input)
        row = inputs[k] if len(inputs) > 1 else inputs[0]
        ends = (start, stop) if start is None and stop is None else (row[0], row[-1])
        name = pair or changed.inputs[0].pair
        if start is None and stop is None and not PositionSolver(changed).is_sliding(name):
            ends = row[0], row[-1]
        try:
            motion = planar.cycle(changed, steps, *ends, pair)
        except NoAnswer as problem:
            assert {result.outcomes[code] for code in result.status[k]} == {problem.outcome}
            assert all(
                np.all(np.isnan(getattr(result, order)[point][k])) for order in ORDERS for point in result.points
            )
            continue
        many = int(np.sum(result.status[k] == 0))
        stopped = motion.outcome is not Outcome.SOLVED
        assert many == len(motion) - stopped
        assert {result.outcomes[code] for code in result.status[k, many:]} == ({motion.outcome} if stopped else set())
        np.testing.assert_allclose(row[:many], motion.inputs[name].position[:many], atol=1e-9)
        for point in result.points:
            for order in ORDERS:
                found, wanted = getattr(result, order)[point][k], getattr(motion.point(point), order)[:many]
                assert np.all(np.isnan(found[many:]))
                np.testing.assert_array_equal(np.isnan(found[:many]), np.isnan(wanted))
                scale = max(1e-3, np.nanmax(np.abs(wanted), initial=0.0))
                worst = max(worst, np.nanmax(np.abs(found[:many] - wanted), initial=0.0) / scale)
    return worst


# as the cycle of every design


SAME = {
    "four-bar": (four_bar(*ROCKER, 0.8), 0.05, 0),
    "other assembly": (four_bar(*ROCKER, 0.8, -1), 0.05, 0),
    "slider-crank": (block_slider_crank(), 0.05, 0),
    "quick return": (MODELS["004-QR"], 0.03, 0),
    "six-bar": (MODELS["stephenson-1-six-bar"], 0.02, 0),
    "six-bar of four unknowns at once": (MODELS["double-butterfly"], 0.01, 0),
    "ten links": (MODELS["ten-link"], 0.01, 0),
    "gears": (MODELS["geared-five-bar"], 0.01, 0),
    "wheels that count turns": (MODELS["002-E3.6a"], 0.01, 0),
    "parallel cranks": (MODELS["three-parallel-cranks"], 0.0, None),
    "through change points": (four_bar(*PARALLELOGRAM, 0.8), 0.0, None),
    "stops": (four_bar(*TRIPLE, 1.2), 0.05, None),
    "slides": (MODELS["elliptical-trammel"], 0.05, None),
}


@pytest.mark.parametrize("name", part(SAME, 2))
def test_every_design_is_the_cycle_of_the_mechanism_so_changed(name):
    mechanism, spread, general = SAME[name]
    designs = designs_around(mechanism, spread, 4)
    result = planar.sweep(mechanism, designs, 48, pair=mechanism.inputs[0].pair)
    # beside a change point the last digits of a position are lost in the rates
    allowed = 1e-8 if name == "through change points" else 1e-10
    assert cycles(mechanism, designs, result, 48, mechanism.inputs[0].pair) < allowed
    assert general is None or result.general == general
    assert (result.general > 0 or not result.whole.all()) == bool(result.remarks)


def test_one_of_several_inputs_runs_and_the_others_stand_where_each_design_has_them():
    mechanism = MODELS["planetary-differential"]
    names = [each.pair for each in mechanism.inputs]
    assert len(names) > 1
    designs = {f"{names[1]}.position": np.linspace(0.1, 0.9, 4), f"{names[1]}.velocity": 7.0}
    result = planar.sweep(mechanism, designs, 24, pair=names[0])
    assert cycles(mechanism, {k: np.broadcast_to(v, 4) for k, v in designs.items()}, result, 24, names[0]) < 1e-12
    with pytest.raises(BadInput, match="name the one that runs"):
        planar.sweep(mechanism, designs, 24)


@settings(max_examples=draws(6), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(0, 10**6), st.integers(1, 6), st.sampled_from([0.0, 0.3]))
def test_random_linkages_of_dimensions_changed_by_a_hundredth(seed, links, higher):
    mechanism = files.from_dict(random_linkage(seed, links, higher=higher).value)
    pair = mechanism.inputs[0].pair
    here = mechanism.inputs[0].position
    designs = designs_around(mechanism, 0.01, 3, seed)
    result = planar.sweep(mechanism, designs, 10, pair=pair, start=here, stop=here + 0.2)
    assert cycles(mechanism, designs, result, 10, pair, here, here + 0.2) < 1e-7


@pytest.mark.parametrize(("start", "stop"), [(1.5, None), (-0.4, 0.9), (2.0, 0.3), (None, 1.9)])
def test_a_range_is_that_of_the_cycle(start, stop):
    mechanism, designs = four_bar(*ROCKER, 0.8), {"BC.length": np.array([0.85, 0.9, 0.95])}
    result = planar.sweep(mechanism, designs, 30, start=start, stop=stop)
    for k in range(3):
        motion = planar.cycle(
            with_design_values(mechanism, values_of_design(designs, k)), 30, 0.8 if start is None else start, stop
        )
        np.testing.assert_allclose(result.input, motion.inputs["A"].position, atol=1e-14)
        np.testing.assert_allclose(result.acceleration["E"][k], motion.point("E").acceleration, atol=1e-11)


# closed forms


def test_four_bars_at_every_position_against_the_closed_form():
    rng = np.random.default_rng(1)
    a, b, c, d = (x * (1 + 0.1 * rng.uniform(-1, 1, 30)) for x in ROCKER)
    theta = 0.8 + np.linspace(0, TURN, 61)[None]
    omega, alpha = rng.uniform(1, 3, 30), rng.uniform(-2, 2, 30)
    designs = {"AB.length": a, "BC.length": b, "DC.length": c, "AD.D.x": d, "A.velocity": omega}
    result = planar.sweep(four_bar(*ROCKER, 0.8), designs | {"A.acceleration": alpha}, 60, ["C", "AB.B", "D"])
    a, b, c, d, omega, alpha = (each[:, None] for each in (a, b, c, d, omega, alpha))
    phi = rocker(a, b, c, d, theta)
    beta = coupler(a, b, c, d, theta, phi)
    _, phi1, _, phi2 = rates(a, b, c, theta, beta, phi, omega, alpha)
    arm = c * np.exp(1j * phi)
    wanted = d + arm, 1j * phi1 * arm, (1j * phi2 - phi1**2) * arm
    for order, value in zip(ORDERS, wanted, strict=True):
        found = getattr(result, order)["C"]
        np.testing.assert_allclose(found[..., 0] + 1j * found[..., 1], value, atol=1e-11)
    assert result.points == ("C", "B", "D")
    np.testing.assert_allclose(result.position["B"][..., 0], a * np.cos(theta), atol=1e-14)
    np.testing.assert_array_equal(result.position["D"][:, :, 0], np.repeat(d, 61, axis=1))
    assert not result.velocity["D"].any()
    assert result.whole.all()


def test_designs_that_cannot_turn_are_refused_exactly_where_they_must_be():
    rng, steps, first = np.random.default_rng(0), 60, 0.8
    a, b, c, d = rng.uniform(0.2, 1.5, (4, 500))
    designs = {"AB.length": a, "BC.length": b, "DC.length": c, "AD.D.x": d}
    result = planar.sweep(four_bar(*ROCKER, first), designs, steps, "C", rates=False)
    theta = first + np.linspace(0, TURN, steps + 1)
    far = np.sqrt(a * a + d * d - 2 * a * d * np.cos(theta)[:, None]).T
    closes = np.logical_and.accumulate((far <= (b + c)[:, None]) & (far >= abs(b - c)[:, None]), axis=1)
    # between two rows the diagonal may be longest, at half a turn, or shortest, at a whole one
    for place, extreme in ((np.pi, a + d), (TURN, abs(a - d))):
        broken = (extreme > b + c) | (extreme < abs(b - c))
        closes &= ~(broken[:, None] & (theta > place))
    np.testing.assert_array_equal(result.status == 0, closes)
    codes = {result.outcomes[code] for code in np.unique(result.status)}
    assert codes == {Outcome.SOLVED, Outcome.DEAD_POINT, Outcome.CANNOT_BE_ASSEMBLED}
    assert np.array_equal(np.isnan(result.position["C"][..., 0]), ~closes)
    assert result.velocity is None
    assert result.acceleration is None
    assert 100 < result.whole.sum() < 400
    assert any("dead point" in told for told in result.remarks)
    # the assembly nearest to the sketch
    sketch = np.array([each[1:] for each in four_bar(*ROCKER, first).sketch])[0]
    for k in np.flatnonzero(closes[:, 0])[:200]:
        ends = [rocker(a[k], b[k], c[k], d[k], first, closed) for closed in (1, -1)]
        places = [(d[k] + c[k] * np.cos(phi), c[k] * np.sin(phi)) for phi in ends]
        nearest = min(places, key=lambda at: np.hypot(*(at - sketch)))
        np.testing.assert_allclose(result.position["C"][k, 0], nearest, atol=1e-7)


def test_a_flipped_linkage_is_closed_and_does_not_pass():
    mechanism = four_bar(*ROCKER, 0.8)
    solver, flipped = PositionSolver(mechanism), PositionSolver(four_bar(*ROCKER, 0.8, -1))
    z, other = (each.find_assembly().z for each in (solver, flipped))
    u = solver.inputs.u
    near = planar.solving.continuation.path.follow_to(solver, z, u, u + 0.02)
    accepted = [
        accept_steps(solver.acceptance, np.stack([z, after]), np.stack([u, u + 0.02]), solver.acceptance_scales)
        for after in (near, other)
    ]
    assert [each.tolist() for each in accepted] == [[True], [False]]


def test_what_is_open_by_the_pairs_own_formulas_does_not_pass():
    solver = PositionSolver(four_bar(*ROCKER, 0.8))
    reference, z = reference_design(solver.mechanism, None), np.repeat(solver.find_assembly().z[:, None], 3, axis=1)
    rows = reference.design_rows({}, 3)
    p, u = rows.p.copy(), rows.u
    z[0, 1] += 1e-9
    p[-1, 2] += 1e-9
    batch = reference.design_batch(rows._replace(p=p), ())
    evaluation = DesignEvaluation(batch._replace(tolerance=solver.tolerance))
    assert evaluation.is_closed(evaluation.positions(z.T, u)).tolist() == [True, False, False]


@pytest.mark.parametrize("rates", [True, False])
def test_what_compiled_code_does_not_let_pass_is_solved_all_the_same_and_counted(monkeypatch, rates):
    mechanism, designs = four_bar(*ROCKER, 0.8), {"BC.length": np.linspace(0.85, 0.95, 6)}
    wanted = planar.sweep(mechanism, designs, 30, "E", rates=rates)

    really = runs.run_compiled

    def run_in_part(batch, out, candidates=None):
        good = really(batch, out)
        out[7:, :, 1] = np.nan
        out[:, :, 2] = np.nan
        good[1], good[2] = 7, 0
        return good

    monkeypatch.setattr(runs, "run_compiled", run_in_part)
    monkeypatch.setattr("planar.batch.block.closed_form_designs", lambda *_: None)
    found = planar.sweep(mechanism, designs, 30, "E", rates=rates)
    assert found.general == 24 + 30
    assert found.remarks == ("2 of 6 designs went to the general path, which solved 54 positions",)
    np.testing.assert_allclose(found.position["E"], wanted.position["E"], atol=1e-13)
    if rates:
        np.testing.assert_allclose(found.acceleration["E"], wanted.acceleration["E"], atol=1e-11)
    assert found.whole.all()


def test_a_structure_that_is_not_compiled_is_followed_from_its_start(monkeypatch):
    def refuse(*_given, **_more):
        raise UnsupportedOperation("not this one")

    mechanism, designs = four_bar(*ROCKER, 0.8), {"BC.length": [0.9, 0.92]}
    wanted = planar.sweep(mechanism, designs, 30, "E")
    monkeypatch.setattr(runs, "run_compiled", refuse)
    found = planar.sweep(mechanism, designs, 30, "E")
    assert (found.whole.all(), wanted.general) == (True, 0)
    np.testing.assert_allclose(found.acceleration["E"], wanted.acceleration["E"], atol=1e-11)


def test_designs_that_compiled_code_does_not_begin_are_looked_at_where_they_start(monkeypatch):
    asked, really = [], runs.run_compiled
    mechanism, designs = four_bar(*ROCKER, 0.8), {"BC.length": np.linspace(0.85, 0.95, 6)}
    wanted = planar.sweep(mechanism, designs, 30, "E")

    def begin_every_second(batch, out, candidates=None, **more):
        asked.append(batch.p.shape[1])
        return np.where(np.arange(out.shape[2]) % 2, really(batch, out, None, **more), 0)

    monkeypatch.setattr(runs, "run_compiled", begin_every_second)
    found = planar.sweep(mechanism, designs, 30, "E")
    assert asked[0] == 6
    assert found.whole.all()
    np.testing.assert_allclose(found.position["E"], wanted.position["E"], atol=1e-13)


def test_the_argument_backend_is_no_longer_needed():
    calls = (planar.sweep, ("four-bar", {"BC.length": [0.07]})), (planar.sweep_each, (["four-bar"],))
    for function, arguments in calls:
        with pytest.warns(DeprecationWarning, match="leave out the argument 'backend'") as told:
            function(*arguments, 6, backend="numpy")
        assert told[0].filename == __file__


# what may be asked for, and how it is said


def test_designs_in_blocks_are_the_designs_together():
    mechanism, designs = four_bar(*TRIPLE, 1.2), designs_around(four_bar(*TRIPLE, 1.2), 0.05, 7)
    told = []
    parts = planar.sweep(mechanism, designs, 20, "E", block=3, workers=1, progress=lambda *done: told.append(done))
    whole = planar.sweep(mechanism, designs, 20, "E")
    np.testing.assert_allclose(parts.acceleration["E"], whole.acceleration["E"], rtol=1e-9)
    np.testing.assert_array_equal(parts.status, whole.status)
    assert parts.remarks == whole.remarks
    assert told == [(3, 7), (6, 7), (7, 7)]
    assert len(parts) == 7


def test_positions_of_the_input_stand_in_one_row_where_all_designs_share_them():
    mechanism = four_bar(*ROCKER, 0.8)
    shared = planar.sweep(mechanism, {"BC.length": [0.9, 0.95]}, 4, "C")
    np.testing.assert_allclose(shared.input, 0.8 + np.linspace(0, TURN, 5))
    own = planar.sweep(mechanism, {"A.position": [0.7, 0.8, 0.9]}, 4, "C", block=2)
    np.testing.assert_allclose(own.input, np.array([[0.7], [0.8], [0.9]]) + np.linspace(0, TURN, 5))


def test_points_left_out_are_all_that_move():
    assert planar.sweep(four_bar(*ROCKER, 0.8), {"BC.length": 0.9}, 4).points == ("B", "C", "E")


WRONG = [
    ({"BC.lenght": [1.0]}, {}, "did you mean 'BC.length'"),
    ({"nothing": [1.0]}, {}, "no such dimension or input; its numbers are"),
    ({"BC.length": [1.0, 2.0], "AB.length": [1.0, 2.0, 3.0]}, {}, "3 numbers, but 2 of 'BC.length'"),
    ({"BC.length": [[1.0]]}, {}, "one row of numbers"),
    ({"BC.length": [1.0, np.nan]}, {}, "not finite"),
    ({"BC.length": ["long"]}, {}, "numbers .* are wanted"),
    ({"BC.length": []}, {}, "there is no design"),
    ({}, {}, "name what the designs differ in"),
    ({"A.position": [1e13]}, {}, "at most"),
    ({"BC.length": 0.9}, {"points": ["c"]}, "did you mean 'C'"),
    ({"BC.length": 0.9}, {"points": "none such"}, "points are"),
    ({"BC.length": 0.9}, {"steps": 0}, "whole number of steps"),
    ({"BC.length": 0.9}, {"block": 0}, "whole number of designs"),
    ({"BC.length": 0.9}, {"start": "now"}, "a number up to"),
    ({"BC.length": 0.9}, {"pair": "Z"}, "no input at 'Z'"),
    ({"BC.length": 0.9}, {"store": "results.csv"}, "ends in .zarr or .parquet"),
    ({"BC.length": np.ones(10**6)}, {"steps": 10**5}, "too much for memory"),
]


@pytest.mark.parametrize(("designs", "more", "told"), WRONG)
def test_bad_input_is_one_clear_sentence(designs, more, told):
    with pytest.raises(BadInput, match=told):
        planar.sweep(four_bar(*ROCKER, 0.8), designs, **more)


def test_a_design_that_is_no_linkage_at_all_is_refused_and_the_others_are_not():
    value = files.to_dict(four_bar(*ROCKER, 0.8))
    value["links"]["BC"]["points"] = {"E": {"distances": {"B": 0.5, "C": 0.6}, "left_of": ["B", "C"]}}
    mechanism = files.from_dict(value)
    result = planar.sweep(mechanism, {"BC.E.B": [0.5, 0.1, 0.55]}, 12)
    assert [result.outcomes[code] for code in result.status[:, 0]] == [
        Outcome.SOLVED,
        Outcome.CANNOT_BE_ASSEMBLED,
        Outcome.SOLVED,
    ]
    assert "does not close" in " ".join(result.remarks)


def test_wheels_that_do_not_mesh_are_refused_design_by_design():
    mechanism = MODELS["sun-and-planet"]
    name, value = next(
        (each.name, each.value)
        for each in link_lengths(mechanism, frozenset(link.name for link in mechanism.links))
        if abs(each.value - 0.6) < 1e-9
    )
    result = planar.sweep(mechanism, {name: np.array([1.0, 1.01]) * value}, 12)
    assert (result.status[:, 0] == 0).tolist() == [True, False]


def test_what_a_base_has_in_common_is_made_once():
    mechanism = four_bar(*ROCKER, 0.8)
    assert reference_design(mechanism, None) is reference_design(four_bar(*ROCKER, 0.8), None)
