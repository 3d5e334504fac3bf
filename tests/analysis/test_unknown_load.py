"""The load that holds a mechanism, solved for: closed forms, and forces with the load that was found."""

from __future__ import annotations

import json

import numpy as np
import pytest

import planar
from planar.analysis.efforts.unknown_load import scale_load
from tests.command import run


def test_the_balanced_lamps_spring_holds_it_everywhere():
    """Its two arms and head hang on the arm as m g l: k = sum(m l) g / (a b) with the spring's eyes at a and b."""
    mechanism = planar.load("balanced-lamp").with_values({"springs.0.stiffness": 100.0})
    found = planar.unknown_load(planar.cycle(mechanism, 24), "springs.0", inertia=False)
    assert found.is_constant
    assert found.best * found.value == pytest.approx(490.5, rel=1e-10)
    assert found.left < 1e-10
    np.testing.assert_allclose(found.factor, 4.905, rtol=1e-9)
    masses = planar.unknown_load(planar.cycle("balanced-lamp", 24), "masses.head", inertia=False)
    assert masses.best == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("model", "load", "effort"),
    [("motor-press", "loads.0", 150.0), ("motor-press", "masses.block B", 3.0), ("tipper", "masses.body", 1e4)],
)
def test_forces_with_the_load_that_was_found_are_those_that_were_wanted(model, load, effort):
    mechanism = planar.load(model)
    (given,) = mechanism.inputs
    at = {"motor-press": 4.0, "tipper": 1.0}[model]
    found = planar.unknown_load(planar.solve(mechanism, {given.pair: at}), load, effort)
    changed = scale_load(mechanism, load, found.factor)
    forces = planar.forces(planar.solve(changed, {given.pair: at}))
    assert float(forces.inputs[given.pair]) == pytest.approx(effort, rel=1e-10)
    assert found.best == pytest.approx(found.factor)


def test_over_a_motion_the_best_one_is_that_of_least_squares():
    motion = planar.cycle("motor-press", 20, start=np.radians(205), stop=np.radians(260))
    found = planar.unknown_load(motion, "loads.0", 150.0)
    assert not found.is_constant

    def missing(factor):
        changed = scale_load(planar.load("motor-press"), "loads.0", factor)
        same = planar.cycle(changed, 20, start=np.radians(205), stop=np.radians(260))
        return np.asarray(planar.forces(same).inputs["O"]) - 150.0

    assert np.abs(missing(found.best)).max() == pytest.approx(found.left, rel=1e-9)
    squares = [float(np.sum(missing(found.best + off) ** 2)) for off in (-1e-3, 0.0, 1e-3)]
    assert squares[1] == min(squares)


@pytest.mark.parametrize(
    ("model", "load", "effort"), [("toggle-clamp", "loads.0", -55.0), ("screw-jack", "loads.0", -1e3)]
)
def test_with_friction_the_load_is_that_whose_forces_with_friction_are_wanted(model, load, effort):
    mechanism = planar.load(model)
    name = mechanism.inputs[0].pair
    found = planar.unknown_load(planar.solve(mechanism), load, effort)
    forces = planar.forces(planar.solve(scale_load(mechanism, load, found.factor)))
    assert found.has_friction
    assert forces.inputs[name] == pytest.approx(effort, rel=1e-10)
    assert abs(forces.frictionless.inputs[name] - effort) > 0.05 * abs(effort)
    without = planar.unknown_load(planar.solve(mechanism), load, effort, friction=False)
    assert without.factor * planar.forces(planar.solve(mechanism), friction=False).inputs[name] == pytest.approx(effort)


def test_the_wedge_under_friction_holds_what_its_closed_form_says():
    """Raising takes W tan(lead + friction angle)."""
    jack = planar.load("screw-jack")
    found = planar.unknown_load(planar.solve(jack), "loads.0", -1e3)
    angle = np.arctan(8.0 / (40.0 * np.pi)) + np.arctan(0.12)
    assert found.factor * found.value == pytest.approx(1e3 / np.tan(angle), rel=1e-9)


def test_over_a_motion_with_friction_the_best_one_is_that_of_least_squares_too():
    motion = planar.cycle("toggle-clamp", 8, start=np.radians(20), stop=np.radians(50))
    found = planar.unknown_load(motion, "loads.0", -40.0)

    def missing(factor):
        changed = scale_load(planar.load("toggle-clamp"), "loads.0", factor)
        same = planar.cycle(changed, 8, start=np.radians(20), stop=np.radians(50))
        return np.asarray(planar.forces(same).inputs["O"]) + 40.0

    assert np.abs(missing(found.best)).max() == pytest.approx(found.left, rel=1e-9)
    squares = [float(np.sum(missing(found.best + off) ** 2)) for off in (-1e-3, 0.0, 1e-3)]
    assert squares[1] == min(squares)


def test_what_is_not_there_or_does_nothing_is_refused(tmp_path):
    press = planar.load("motor-press")
    with pytest.raises(planar.Unknown, match=r"there are loads\.0, masses\.crank and masses\.block B"):
        planar.unknown_load(planar.solve(press), "loads.7")
    with pytest.raises(planar.BadInput, match="it does nothing on the input at 'O' here"):
        planar.unknown_load(planar.solve(press, {"O": 2.0}), "loads.0")
    told = run(tmp_path, "forces", "balanced-lamp", "--static", "--solve-for", "springs.0", "--json")
    assert json.loads(told.out)["solved_for"]["factor"] == pytest.approx(1.0)
    moving = run(tmp_path, "forces", "toggle-clamp", "--solve-for", "loads.0", "--effort", "-55").done()
    assert "moving on against its friction" in moving
    refused = run(tmp_path, "forces", "balanced-lamp", "--effort", "3").refused(2)
    assert "name the load that is wanted by --solve-for" in refused
