"""Linkages that are held more than once, with rounded lengths: closed forms, and other routes."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

import planar
from planar.equations.residuals import residuals
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.geometry import GROUND, frame_at
from planar.solving.position import PositionSolver


def three_cranks(length=0.06003, within=5e-5):
    """Three parallel cranks out of line, the third of another length."""
    mechanism = planar.load("three-parallel-cranks")
    links = tuple(replace(each, length=length) if each.name == "crank C" else each for each in mechanism.links)
    return replace(mechanism, links=links, closes_within=within)


def test_the_pins_give_way_in_series_as_springs_do():
    """Three equal cranks in a row, the middle one longer by d: its force F in d = (F + F / 2) (1 / k0 + 1 / k1)."""
    found = planar.solve(planar.load("double-parallelogram")).misfits
    force = 2e-5 / (1.5 * (1.0 / 40e6 + 1.0 / 20e6))
    assert found["M0"] == pytest.approx(force / 40e6, rel=1e-9)
    assert found["M"] == pytest.approx(force / 20e6, rel=1e-9)
    assert found["A"] == pytest.approx(0.5 * force / 20e6, rel=1e-9)
    assert found["B0"] == pytest.approx(0.5 * force / 40e6, rel=1e-9)


def test_unloaded_pins_press_on_each_other_by_their_misfits():
    mechanism = replace(planar.load("double-parallelogram"), loads=())
    state = planar.solve(mechanism)
    found = planar.forces(state)
    assert found.undetermined == {}
    for name, stiffness in mechanism.pair_stiffness:
        assert np.hypot(*found.reactions[name].force) == pytest.approx(stiffness * state.misfits[name], rel=1e-6)
    assert found.inputs["A0"] == pytest.approx(0.0, abs=1e-6)


def test_the_position_is_that_of_least_squares_by_another_route():
    mechanism = three_cranks()
    state, solver = planar.solve(mechanism), PositionSolver(mechanism)
    numbers = {pair.name: pair.measure([solver.shapes[link] for link in pair.bodies]) for pair in mechanism.pairs}
    names = [name for name in state.frames if name != mechanism.frame]
    own = {pair.name: () for pair in mechanism.pairs}

    def left(q):
        frames = {mechanism.frame: GROUND} | {
            name: frame_at(*each) for name, each in zip(names, q.reshape(-1, 3), strict=True)
        }
        values = residuals(mechanism, frames, numbers, own, [mechanism.inputs[0].position])
        found = 1e3 * np.array([float(value) for _, value in values])
        found[-1] *= 1e6  # the input is held
        return found

    here = np.array([[each.parts[0] for each in (f.x, f.y, f.angle)] for f in (state.frames[n] for n in names)])
    found = least_squares(left, here.ravel() + 1e-3, xtol=1e-15, ftol=1e-15, gtol=1e-15, x_scale="jac")
    assert np.abs(found.x - here.ravel()).max() < 1e-9
    assert sum(1e6 * each**2 for each in state.misfits.values()) == pytest.approx(2.0 * found.cost, rel=1e-9)


def test_rates_are_those_of_the_motion_of_least_misfit():
    mechanism = three_cranks()
    speed, here = mechanism.inputs[0].velocity, planar.solve(mechanism)
    errors = []
    for step in (4e-3, 2e-3):
        before, after = (planar.solve(mechanism, {"A0": np.radians(40) + d}) for d in (-step, step))
        slope = (after.point("E").position - before.point("E").position) / (2.0 * step) * speed
        bend = (after.point("E").position + before.point("E").position - 2.0 * here.point("E").position) / step**2
        errors.append(
            (
                np.abs(slope - here.point("E").velocity).max(),
                np.abs(bend * speed**2 - here.point("E").acceleration).max(),
            )
        )
    orders = np.log2(np.array(errors[0]) / errors[1])
    assert orders == pytest.approx(2.0, abs=0.05)


def test_lengths_that_agree_close_as_they_do_without_a_misfit():
    exact = planar.load("three-parallel-cranks")
    with_misfit = replace(exact, closes_within=1e-5)
    one, other = planar.cycle(exact, 24), planar.cycle(with_misfit, 24)
    for name in one.point_names:
        for each, beside in zip(one.point(name), other.point(name), strict=True):
            assert np.abs(each - beside).max() <= 1e-10 * max(1.0, np.abs(each).max())
    assert all(np.all(each == 0.0) for each in other.misfits.values())


def test_power_balances_with_what_pairs_take_up():
    mechanism = planar.load("double-parallelogram")
    found = planar.forces(planar.solve(mechanism, {"A0": 1.2}))
    assert found.proof.power < 1e-12
    assert found.proof.routes < 1e-12


def test_without_stiffness_shares_stay_open_and_the_effort_is_told():
    bare = replace(planar.load("double-parallelogram"), pair_stiffness=())
    found = planar.forces(planar.solve(bare))
    assert set(found.undetermined) == {"A0", "M0", "B0", "A", "M", "B"}
    assert np.isfinite(found.inputs["A0"])
    assert found.inputs["A0"] == pytest.approx(500.0 * 0.08 * np.cos(np.pi / 3), rel=1e-3)


def test_the_refusal_offers_the_misfit_that_would_do():
    with pytest.raises(NoAnswer, match=r'at the least: "closes_within": "0\.01 mm" would take that position'):
        planar.solve(three_cranks(within=None))
    assert planar.solve(three_cranks(within=1e-5)).residual < 1e-14


def test_a_run_ends_where_a_pair_is_open_by_more():
    found = planar.cycle(three_cranks(within=7.95e-6), 36)
    assert found.outcome is Outcome.CANNOT_BE_ASSEMBLED
    assert "beyond the 0.00795 mm of `closes_within`" in found.reason
    assert max(np.max(each) for each in found.misfits.values()) <= 7.95e-6


def test_a_shorter_middle_crank_gives_way_beside_the_change_point():
    """Pressed cranks of a table balance where they lie in one line, but as a strut that is about to buckle."""
    mechanism = planar.load("double-parallelogram")
    links = tuple(replace(each, length=0.07998) if each.name == "crank M" else each for each in mechanism.links)
    found = planar.cycle(replace(mechanism, links=links), 36)
    assert found.outcome is Outcome.CHANGE_POINT
    assert "balance but are not the least" in found.reason


def test_assemblies_of_least_misfit_are_not_listed():
    with pytest.raises(BadInput, match="closes_within"):
        planar.modes(planar.load("double-parallelogram"))
