"""Simulated stick and slip: closed forms of dry friction, another integration, forces the other way round, energy."""

from __future__ import annotations

from math import atan, cos, hypot, pi, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import planar
from planar.dynamics.in_time.sign_patterns import cocircuits, sign_patterns
from tests.draws import first_cases
from tests.rubbing import rubbing_linkage

G = 9.81


def block(friction, angle=0.0, velocity=0.0, position=0.0, pair=None, **more):
    """A block of 2 kg on an incline (rad)."""
    slide = {"sliding": "s", "links": ["f", "b"], "line": {"through": "O", "angle": angle}, "point": "P"}
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {"f": {"points": {"O": [0, 0]}}, "b": {"points": {"P": [0, 0], "Q": [0, 0.5]}}},
            "pairs": [slide | {"friction": friction} | (pair or {})],
            "inputs": [{"pair": "s", "position": position, "velocity": velocity}],
            "masses": [{"link": "b", "mass": 2, "at": "P", "inertia": 1}],
            "gravity": [0, -G],
        }
        | more
    )


def test_a_dry_oscillator_loses_the_same_of_its_amplitude_each_time_and_stops_in_its_dead_band():
    """Every half period pi sqrt(m / k) the amplitude is less by 2 mu m g / k, until that is within mu m g / k."""
    band = 0.2 * 2.0 * G / 80.0
    found = planar.simulate(block(0.2, position=0.37, springs=[{"points": ["O", "P"], "stiffness": 80}]), 2.5, 50)
    half = pi * sqrt(2.0 / 80.0)
    times = [each.time for each in found.friction_events]
    np.testing.assert_allclose(times, half * np.arange(5), atol=1e-10)
    assert [each.change for each in found.friction_events] == ["slips", "reverses", "reverses", "reverses", "sticks"]
    end = found.motion.inputs["s"]
    assert end.position[-1] == pytest.approx(0.37 - 8.0 * band, abs=1e-11)
    assert abs(end.position[-1]) < band
    assert max(abs(end.velocity[-1]), abs(end.acceleration[-1])) < 1e-15
    assert found.heat[-1] == pytest.approx(0.5 * 80.0 * (0.37**2 - end.position[-1] ** 2), rel=1e-9)
    assert found.balance < 1e-9


@pytest.mark.parametrize(("friction", "returns"), [(0.2, True), (0.6, False)])
def test_thrown_up_an_incline_a_block_comes_back_or_stays_as_its_friction_is(friction, returns):
    angle, speed = 0.5, 3.0
    found = planar.simulate(block(friction, angle, speed), 2.0, 20, moving=True)
    up = speed / (G * (sin(angle) + friction * cos(angle)))
    first, second = found.friction_events
    assert (first.change, first.sense) == ("slips", 1)
    assert second.time == pytest.approx(up, rel=1e-12)
    assert second.change == ("reverses" if returns else "sticks")
    rest = max(2.0 - up, 0.0)
    back = 0.5 * G * (sin(angle) - friction * cos(angle)) * rest**2 if returns else 0.0
    assert found.motion.inputs["s"].position[-1] == pytest.approx(0.5 * speed * up - back, rel=1e-11)


def test_pulled_by_a_spring_a_block_sticks_and_slips_in_a_period_of_closed_form():
    """It sticks for 2 D / v and slips for (2 / w) (pi - atan(w D / v)), with D = (mu0 - mu) m g / k and w^2 = k / m."""
    found = planar.simulate(planar.load("stick-slip"), 2.7, 27)
    gap, pace, speed = 0.2 * 2.0 * G / 80.0, sqrt(80.0 / 2.0), 0.1
    first, slips, sticks = 0.4 * 2.0 * G / 80.0 / speed, 2.0 / pace * (pi - atan(pace * gap / speed)), 2.0 * gap / speed
    times = np.cumsum([0.0, first, slips, sticks])
    np.testing.assert_allclose([each.time for each in found.friction_events], times, rtol=1e-9)
    assert [each.change for each in found.friction_events[1:]] == ["slips", "sticks", "slips"]
    stuck = found.rubbing["block"].sticks
    assert np.abs(found.motion.inputs["block"].velocity[stuck]).max() < 1e-15
    assert found.balance < 1e-9


def test_a_pendulum_braked_by_its_pin_swings_as_integrated_otherwise():
    """The couple of the pin is r sin(arctan mu) times its force, which has the acceleration in it: a quadratic."""
    rod = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "b": {"ends": ["O", "C"], "length": 0.5}},
    }
    rod |= {"pairs": [{"turning": "O", "pin_radius": 0.05, "friction": 0.3}], "gravity": [0, -G]}
    rod |= {"masses": [{"link": "b", "mass": 2, "at": "C", "inertia": 0.1}], "inputs": [{"pair": "O", "position": 0.3}]}
    found = planar.simulate(planar.from_dict(rod), 2.0, 4)
    arm, inertia, pull = 0.05 * 0.3 / hypot(1.0, 0.3), 0.1 + 2.0 * 0.25, 2.0 * 0.5

    def acceleration(turn, rate, sense):
        # (inertia a + pull g cos)^2 = arm^2 |F|^2, |F|^2 = (pull a)^2 + 2 pull a m g cos + rest
        weight = pull * G * cos(turn)
        across, along = -pull * rate**2 * cos(turn), -pull * rate**2 * sin(turn) + 2.0 * G
        square = inertia**2 - (arm * pull) ** 2
        linear = inertia * weight - arm**2 * pull * (along * cos(turn) - across * sin(turn))
        rest = weight**2 - arm**2 * (across**2 + along**2)
        return (-linear - sense * sqrt(linear**2 - square * rest)) / square

    at, turn, sense, times = 0.0, 0.3, -1.0, []
    while at < 2.0:

        def stops(_, y):
            return y[1]

        stops.terminal, stops.direction = True, -sense
        run = solve_ivp(
            lambda _, y, s=sense: [y[1], acceleration(*y, s)],
            (at, 2.0),
            [turn, 0.0],
            method="DOP853",
            rtol=1e-11,
            atol=1e-12,
            events=stops,
        )
        at, turn, sense = run.t[-1], run.y[0, -1], -sense
        times.append(at)
    np.testing.assert_allclose([each.time for each in found.friction_events[1:]], times[:-1], atol=1e-9)
    assert found.motion.inputs["O"].position[-1] == pytest.approx(run.y[0, -1], abs=1e-9)


def test_a_block_on_a_block_goes_with_it_once_both_have_one_speed():
    """The upper one (1 kg) is slowed by mu g, and draws the lower one (2 kg), which the table brakes."""
    slide = {"sliding": "s", "links": ["f", "b"], "line": {"through": "O"}, "point": "P", "friction": 0.1}
    upper = {"sliding": "u", "links": ["b", "c"], "line": {"through": "P"}, "point": "R", "friction": 0.4}
    both = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "b": {"points": {"P": [0, 0]}}, "c": {"points": {"R": [0, 0]}}},
        "pairs": [slide, upper],
        "inputs": [{"pair": "s", "position": 0.0}, {"pair": "u", "position": 0.0, "velocity": 2.0}],
        "masses": [{"link": "b", "mass": 2, "at": "P"}, {"link": "c", "mass": 1, "at": "R"}],
        "gravity": [0, -G],
    }
    found = planar.simulate(planar.from_dict(both), 3.0, 30, moving=True)
    drawn = (0.4 - 0.3) * G / 2.0
    meet = 2.0 / (0.4 * G + drawn)
    stop = meet + drawn * meet / (0.1 * G)
    assert [(each.pair, each.change) for each in found.friction_events] == [
        ("s", "slips"),
        ("u", "slips"),
        ("u", "sticks"),
        ("s", "sticks"),
    ]
    np.testing.assert_allclose([each.time for each in found.friction_events[2:]], [meet, stop], rtol=1e-11)
    assert found.heat[-1] == pytest.approx(0.5 * 1.0 * 2.0**2, rel=1e-12)


def test_impacts_on_a_stop_and_friction_go_together():
    """Down an incline, up again by the restitution, and at rest on the stop in the end."""
    angle, friction = 0.5, 0.2
    found = planar.simulate(block(friction, angle, position=1.0, pair={"stops": [0, None], "restitution": 0.3}), 2.0, 8)
    down, up = (G * (sin(angle) - sign * friction * cos(angle)) for sign in (1.0, -1.0))
    speed, fall = sqrt(2.0 * down), sqrt(2.0 / down)
    back = 0.3 * speed
    height = back**2 / (2.0 * up)
    assert found.impacts[0].time == pytest.approx(fall, rel=1e-11)
    assert found.impacts[1].time == pytest.approx(fall + back / up + sqrt(2.0 * height / down), rel=1e-9)
    assert found.impacts[1].approach == pytest.approx(sqrt(2.0 * down * height), rel=1e-9)
    assert found.impacts[-1].rests
    assert abs(found.motion.inputs["s"].velocity[-1]) < 1e-15
    assert found.balance < 1e-7


def test_what_is_held_slips_when_a_load_grows_beyond_the_limit_and_a_jump_of_it_is_met_at_once():
    growing = {"point": "P", "force": [10, 0], "varies": {"at": [0, 2], "factors": [0, 2]}}
    first, second = planar.simulate(block(0.3, loads=[growing]), 1.0, 10).friction_events
    assert (first.change, second.change, second.sense) == ("sticks", "slips", 1)
    assert second.time == pytest.approx(0.3 * 2.0 * G / 10.0, rel=1e-9)
    jump = growing | {"varies": {"at": [0, 0.5, 0.5, 1], "factors": [0, 0, 1, 1]}}
    assert planar.simulate(block(0.3, loads=[jump]), 1.0, 10).friction_events[1].time == 0.5


def test_a_driven_input_supplies_what_friction_takes():
    found = planar.simulate(block(0.3, 0.3, 0.5), 2.0, 4, driven=["s"])
    heat = 0.3 * 2.0 * G * cos(0.3)
    assert found.heat[-1] == pytest.approx(heat, rel=1e-12)
    assert found.work[-1] == pytest.approx(heat + 2.0 * G * sin(0.3), rel=1e-12)


def test_a_motor_runs_at_the_speed_at_which_it_supplies_the_friction():
    motor = {"pair": "s", "position": 0.0, "motor": {"stall": 10, "no_load": 1.0}}
    found = planar.simulate(block(0.3, inputs=[motor]), 4.0, 4)
    speed = 1.0 - 0.3 * 2.0 * G / 10.0
    assert found.motion.inputs["s"].velocity[-1] == pytest.approx(speed * (1.0 - np.exp(-4.0 * 10.0 / 2.0)), rel=1e-9)


@pytest.mark.parametrize(("length", "jams"), [(0.5, False), (0.3, True)])
def test_a_block_whose_mass_is_far_off_its_short_guide_jams_as_it_is_braked(length, jams):
    """It bears on both ends by the couple of its own braking: without a solution where 2 mu h / L is above one."""
    masses = [{"link": "b", "mass": 2, "at": "Q", "inertia": 1}]
    found = planar.simulate(block(0.4, velocity=1.0, pair={"guide_length": length}, masses=masses), 1.0, 4, moving=True)
    assert (found.motion.outcome is planar.Outcome.INPUT_JAMMED) == jams
    assert jams == ("no forces and accelerations agree with the motion: it jams" in found.motion.reason)
    assert np.isnan(found.motion.inputs["s"].acceleration).any() == jams


@pytest.mark.parametrize("seed", first_cases([53, 8, 3, 43], 2))
def test_over_random_linkages_energy_balances_with_the_heat_and_forces_agree(seed):
    """The forces of the motion that is found need nothing from the inputs, which are let go."""
    found = planar.simulate(rubbing_linkage(seed, 0.2), 0.2, 6, moving=True)
    assert found.balance < 1e-9
    assert all(np.diff(each.heat).min(initial=0.0) >= -1e-12 * found.heat[-1] for each in found.rubbing.values())
    back = planar.forces(found.motion)
    slips = np.all([each.sense != 0.0 for each in found.rubbing.values()], axis=0)
    checked = slips & (np.ravel(back.solution_count) == 1)
    most = max(float(np.nanmax(np.abs(each.force))) for each in back.reactions.values() if each.force is not None)
    for effort in back.inputs.values():
        assert np.abs(effort[checked]).max(initial=0.0) < 1e-8 * most


def test_small_friction_is_nearly_none():
    """What it changes goes with the coefficient."""
    off = []
    for friction in (1e-5, 2e-5):
        clear, rubs = (
            planar.simulate(block(f, 0.4, springs=[{"points": ["O", "Q"], "stiffness": 30}]), 0.4, 4)
            for f in (0.0, friction)
        )
        off.append(np.abs(clear.motion.inputs["s"].position - rubs.motion.inputs["s"].position).max())
    assert 0.0 < off[0] < 1e-4
    assert off[1] == pytest.approx(2.0 * off[0], rel=1e-3)


def test_friction_that_follows_what_is_not_determined_is_refused():
    value = planar.to_dict(planar.load("three-parallel-cranks"))
    value["pairs"] = [pair | {"pin_radius": "5 mm", "friction": 0.1} for pair in value["pairs"]]
    value["masses"] = [{"link": "rod", "mass": 1, "at": "A", "inertia": 1}]
    with pytest.raises(planar.BadInput, match="is not determined"):
        planar.simulate(planar.from_dict(value), 1.0)


def test_senses_that_rates_can_have_at_once_are_those_of_all_directions():
    """Of rows in space the signs along many random directions are among them, and their number is that of a plane's
    arrangement: of k lines through a point 2 k cells, 2 k rays and the point."""
    rng = np.random.default_rng(3)
    plane = rng.normal(size=(5, 2))
    plane /= np.linalg.norm(plane, axis=1)[:, None]
    assert len(sign_patterns(plane)) == 4 * 5 + 1
    assert len(cocircuits(plane)) == 2 * 5
    space = rng.normal(size=(6, 3))
    space /= np.linalg.norm(space, axis=1)[:, None]
    found = set(sign_patterns(space))
    assert {tuple(np.sign(space @ way).astype(int)) for way in rng.normal(size=(500, 3))} <= found
