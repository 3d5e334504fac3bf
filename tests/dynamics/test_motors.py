"""Motors: run-up in closed form, table and line, what forces say of them, refusals; the flywheel by the command."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import planar
from planar.model.motors import Motor
from tests.command import run

NO_LOAD = 3000.0 * np.pi / 30.0


def rotor(motor, **more):
    """A wheel of 0.02 kg m^2 on a motor."""
    return {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "r": {"points": {"O": [0, 0]}}},
        "pairs": [{"turning": "O"}],
        "inputs": [{"pair": "O", "position": 0, "velocity": "10 rad/s", "motor": motor} | more],
        "masses": [{"link": "r", "mass": 1, "at": "O", "inertia": 0.02}],
    }


LINE = {"stall": 3, "no_load": "3000 rpm"}


def test_a_motor_with_an_inertia_comes_to_its_speed_without_load_exponentially():
    """J w' = T0 (1 - w / w0): w = w0 (1 - exp(-t / tau)), tau = J w0 / T0; from the file's speed if moving."""
    found = planar.simulate(planar.from_dict(rotor(LINE)), 6.0, 24)
    tau = 0.02 * NO_LOAD / 3.0
    rise = 1.0 - np.exp(-found.motion.time / tau)
    np.testing.assert_allclose(found.motion.inputs["O"].velocity, NO_LOAD * rise, rtol=1e-11)
    assert found.balance < 1e-11
    moving = planar.simulate(planar.from_dict(rotor(LINE)), 1.0, 4, moving=True)
    wanted = NO_LOAD + (10.0 - NO_LOAD) * np.exp(-moving.motion.time / tau)
    np.testing.assert_allclose(moving.motion.inputs["O"].velocity, wanted, rtol=1e-11)


def test_a_table_of_two_points_is_the_line_between_them_and_stays_beyond():
    line, table = Motor(3.0, NO_LOAD), Motor(None, None, (0.0, NO_LOAD), (3.0, 0.0))
    speeds = np.linspace(0.0, NO_LOAD, 7)
    np.testing.assert_allclose(table.effort_at(speeds), line.effort_at(speeds), atol=1e-14)
    assert table.effort_at(-5.0) == 3.0
    assert line.greatest_power == pytest.approx((0.25 * 3.0 * NO_LOAD, 0.5 * NO_LOAD))
    assert table.greatest_power == pytest.approx(line.greatest_power)
    written = rotor({"speeds": [0, "3000 rpm"], "torques": [3, 0]})
    found = planar.simulate(planar.from_dict(written), 2.0, 8)
    same = planar.simulate(planar.from_dict(rotor(LINE)), 2.0, 8)
    np.testing.assert_allclose(found.motion.inputs["O"].velocity, same.motion.inputs["O"].velocity, rtol=1e-10)


def test_an_input_is_held_to_its_law_though_it_has_a_motor_where_that_is_asked_for():
    law = {"law": [{"motion": "constant speed", "speed": "10 rad/s", "in": "1 s"}]}
    mechanism = planar.from_dict(rotor(LINE, **law))
    driven = planar.simulate(mechanism, 0.5, 5, ["O"])
    np.testing.assert_allclose(driven.motion.inputs["O"].velocity, 10.0)
    assert planar.simulate(mechanism, 0.5, 5).motion.inputs["O"].velocity[-1] > 40.0


def test_a_motor_at_a_slide_pushes_with_a_force():
    """m v' = F0 (1 - v / v0) - m g: it comes to v0 (1 - m g / F0) exponentially."""
    given = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "b": {"points": {"P": [0, 0]}}},
        "pairs": [{"sliding": "s", "links": ["f", "b"], "line": {"through": "O", "angle": np.pi / 2}, "point": "P"}],
        "inputs": [{"pair": "s", "position": 0, "velocity": 0.1, "motor": {"stall": "400 N", "no_load": "0.5 m/s"}}],
        "masses": [{"link": "b", "mass": 20, "at": "P", "inertia": 1}],
        "gravity": [0, -10],
    }
    mechanism = planar.from_dict(given)
    end = planar.simulate(mechanism, 1.0, 4).motion.inputs["s"].velocity[-1]
    assert end == pytest.approx(0.25 * (1.0 - np.exp(-1.0 * 400.0 / (20.0 * 0.5))), rel=1e-10)
    duty = planar.motor_duty(planar.forces(planar.solve(mechanism)))
    assert (duty.available, duty.needed, duty.margin) == pytest.approx((320.0, 200.0, 120.0))


def test_forces_tell_where_a_motor_is_too_weak():
    """The stretch begins where the load does, and ends where the crank needs the motor's 150 N m."""
    mechanism = planar.load("motor-press")
    motion = planar.cycle(mechanism, 90)
    duty = planar.motor_duty(planar.forces(motion))
    assert np.allclose(duty.available, 150.0)
    ((first, last),) = duty.too_weak
    assert first == pytest.approx(np.radians(200), abs=1e-9)  # where the load begins
    there = planar.forces(planar.solve(mechanism, {"O": last}))
    assert float(there.inputs["O"]) == pytest.approx(150.0, abs=1e-9)
    assert planar.motor_duty(there).margin == pytest.approx(0.0, abs=1e-9)
    needed = planar.forces(planar.solve(mechanism, {"O": np.radians(200.0) + 1e-12})).inputs[
        "O"
    ]  # where the load is on
    assert duty.is_solved
    assert duty.least == pytest.approx(150.0 - float(needed), rel=1e-9)
    assert duty.least_at == pytest.approx(np.radians(200.0), abs=1e-9)
    assert duty.greatest_power_needed == pytest.approx(2.0 * np.pi * float(needed), rel=1e-9)
    # by its motor the press comes through, below the speed without load
    found = planar.simulate(mechanism, 1.5, 150, moving=True)
    speeds = found.motion.inputs["O"].velocity * 30.0 / np.pi
    assert found.balance < 1e-10
    assert 60.0 - 1e-9 < speeds.min() < speeds.max() < 120.0


@pytest.mark.parametrize(
    ("motor", "told"),
    [
        ({"stall": 3}, "$.inputs[0].motor: the key 'no_load' is missing"),
        ({"stall": -3, "no_load": "10 rpm"}, "$.inputs[0].motor.no_load: what it supplies at rest"),
        (
            {"speeds": [0, 1], "forces": [1, 0]},
            "$.inputs[0].motor.forces: what a motor at pair 'O' supplies are torques",
        ),
        ({"speeds": ["1 rad/s", 0], "torques": [1, 0]}, "$.inputs[0].motor.speeds: the speeds of a motor's table rise"),
        ({}, "$.inputs[0].motor: a motor has 'stall' and 'no_load', or a table of 'speeds' and 'torques'"),
    ],
)
def test_bad_motors_are_refused_at_their_place(motor, told):
    with pytest.raises(planar.BadInput, match=re.escape(told)):
        planar.from_dict(rotor(motor))


def test_numbers_of_motors_have_names():
    mechanism = planar.from_dict(rotor(LINE))
    assert planar.from_dict(planar.to_dict(mechanism)) == mechanism
    changed = mechanism.with_values({"O.motor.stall": 4.0, "O.motor.no_load": "1500 rpm"})
    assert changed.inputs[0].motor[:2] == pytest.approx((4.0, 0.5 * NO_LOAD))
    with pytest.raises(planar.BadInput, match="no input has a motor"):
        planar.motor_duty(planar.forces(planar.solve(planar.load("four-bar"))))


def test_the_flywheel_for_a_wanted_fluctuation_by_the_command(tmp_path):
    ended = run(
        tmp_path, "forces", "motor-press", "--cycle", "--fluctuation", "0.05", "--rim-radius", "400mm", "--json"
    )
    told = json.loads(ended.out)
    wheel = planar.flywheel(planar.forces(planar.cycle(planar.load("motor-press"))), fluctuation=0.05)
    assert told["flywheel"]["inertia"] == pytest.approx(wheel.inertia)
    assert told["flywheel"]["inertia"] == pytest.approx(wheel.energy / (0.05 * (2.0 * np.pi) ** 2))
    assert told["flywheel"]["rim_mass"] == pytest.approx(wheel.inertia / 0.16)
    assert [len(ends) for ends in told["motors"]["O"]["too_weak"]] == [2]
    refused = run(tmp_path, "forces", "motor-press", "--fluctuation", "0.05").refused(2)
    assert "this is for the forces of a whole motion, with --cycle" in refused
