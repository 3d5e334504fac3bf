"""Mechanisms let go: closed forms, textbook equations integrated apart, energy, power, and what their forces say."""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

import planar
from planar.dynamics.equations_of_motion import EquationsOfMotion
from planar.dynamics.simulation import Simulation
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from tests.builders import bracket_document, dynamic_four_bar_document, lever_document, masses, piston_document
from tests.closed_forms import between
from tests.draws import is_exhaustive

Value = dict[str, Any]
G = 9.81


def run(value: Value, duration: float, steps: int = 8, **options: Any) -> Simulation:
    found = planar.simulate(planar.from_dict(value), duration, steps, **options)
    assert found.motion.outcome is Outcome.SOLVED, found.motion.reason
    assert found.motion.residual < 1e-13
    return found


def angle(found: Simulation, pair: str = "O") -> np.ndarray:
    return found.motion.inputs[pair].position


# closed forms

PENDULUM = {"masses": [{"link": "lever", "mass": 2.0, "at": "G", "inertia": 0.05}], "gravity": [0, -G]}
LENGTH, ABOUT_PIN = 0.4, 0.05 + 2.0 * 0.4**2


@pytest.mark.parametrize("swing", [0.1, 1.5, 3.0])
def test_a_physical_pendulum_has_the_period_of_the_elliptic_integral(swing):
    """T = 4 K(sin(swing / 2)) sqrt(J / m g l); after half of it it stands on the other side, and so on."""
    period = 4.0 * ellipk(sin(swing / 2) ** 2) * sqrt(ABOUT_PIN / (2.0 * G * LENGTH))
    found = run(lever_document({"G": [LENGTH, 0]}, swing - pi / 2, **PENDULUM), 2.0 * period)
    wanted = np.array([swing, 0.0, -swing, 0.0, swing, 0.0, -swing, 0.0, swing]) - pi / 2
    np.testing.assert_allclose(angle(found), wanted, atol=2e-9)
    assert found.balance < 1e-10


@pytest.mark.parametrize("steps", [1, 7])
def test_the_period_of_a_swing_is_solved_for_and_does_not_depend_on_the_rows(steps):
    """T = 4 K(sin(swing / 2)) sqrt(J / m g l); it turns back at both ends, the start from rest among them."""
    swing = 1.0
    period = 4.0 * ellipk(sin(swing / 2) ** 2) * sqrt(ABOUT_PIN / (2.0 * G * LENGTH))
    found = run(lever_document({"G": [LENGTH, 0]}, swing - pi / 2, **PENDULUM), 2.2 * period, steps)
    oscillation = found.oscillations["O"]
    assert oscillation.period == pytest.approx(period, rel=1e-10)
    np.testing.assert_allclose(oscillation.times, np.arange(5) * period / 2.0, rtol=1e-10, atol=1e-15)
    np.testing.assert_allclose(
        oscillation.positions, [swing - pi / 2, -swing - pi / 2] * 2 + [swing - pi / 2], rtol=1e-9
    )


def test_a_damped_swing_has_its_closed_form_period_and_a_wheel_that_spins_or_rests_none():
    """m x'' + c x' + k x = 0: 2 pi / sqrt(k / m - (c / 2 m)^2)."""
    value: Value = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "b": {"points": {"P": [0, 0]}}},
        "pairs": [{"sliding": "s", "links": ["f", "b"], "line": {"through": "O"}, "point": "P"}],
        "inputs": [{"pair": "s", "position": 0.1, "velocity": 0.3}],
        "masses": [{"link": "b", "mass": 2.0, "at": "P"}],
    }
    period = 2.0 * pi / sqrt(50.0 / 2.0 - (1.5 / 4.0) ** 2)
    # a spring without a length has no direction for its damper where its ends meet, so that the anchor is aside
    value["links"]["f"]["points"]["W"] = [-10.0, 0]
    value["springs"] = [{"points": ["W", "P"], "stiffness": 50.0, "free_length": 10.0, "damping": 1.5}]
    found = run(value, 3.0, 3, moving=True).oscillations["s"]
    assert found.period == pytest.approx(period, rel=1e-9)
    np.testing.assert_allclose(found.periods, period, rtol=1e-9)
    value["springs"] = []
    assert run(value, 1.0, moving=True).oscillations == {}
    assert run(value, 1.0).oscillations == {}


def test_the_pin_of_a_pendulum_carries_its_weight_and_its_swing():
    """Along it m (g cos + l w^2), by energy w^2 = 2 m g l (cos - cos swing) / J; across m g sin (1 - m l^2 / J)."""
    found = run(lever_document({"G": [LENGTH, 0]}, 1.2 - pi / 2, **PENDULUM), 1.5, 30)
    off = angle(found) + pi / 2
    along = 2.0 * G * (np.cos(off) + 4.0 * LENGTH**2 * (np.cos(off) - cos(1.2)) / ABOUT_PIN)
    across = 2.0 * G * np.sin(off) * (1.0 - 2.0 * LENGTH**2 / ABOUT_PIN)
    # down the lever is (sin, -cos); the frame holds against it
    wanted = np.stack([-along * np.sin(off) + across * np.cos(off), along * np.cos(off) + across * np.sin(off)], axis=1)
    forces = planar.forces(found.motion)
    np.testing.assert_allclose(forces.reactions["O"].force, wanted, atol=1e-8)
    assert np.abs(forces.inputs["O"]).max() < 1e-11 * 2.0 * G


def slide(**more: Any) -> Value:
    """A block of 2 kg on a line that climbs at 0.5 rad, tied to the frame by a spring along it."""
    return {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0], "W": [-cos(0.5), -sin(0.5)]}},
            "block": {"points": {"B": [0, 0]}},
        },
        "pairs": [
            {"sliding": "way", "links": ["f", "block"], "line": {"through": "O", "angle": 0.5}, "point": "B"},
        ],
        "inputs": [{"pair": "way", "position": 0.3}],
        "masses": [{"link": "block", "mass": 2.0, "at": "B"}],
        **more,
    }


@pytest.mark.parametrize("damping", [0.0, 1.7, 100.0])
def test_a_block_on_a_spring_swings_as_the_oscillator_of_the_books(damping):
    """x = e^(-dt) (cos wt + d/w sin wt) about where spring and weight balance; of much damping w is imaginary."""
    spring = {"points": ["f.W", "block.B"], "stiffness": 80.0, "free_length": 0.9, "damping": damping}
    found = run(slide(springs=[spring], gravity=[0, -G]), 2.0, 20)
    rest = -0.1 - 2.0 * G * sin(0.5) / 80.0
    decay, time = damping / 4.0, found.motion.time
    way = np.emath.sqrt(80.0 / 2.0 - decay**2)
    wanted = rest + (0.3 - rest) * np.real(
        np.exp(-decay * time) * (np.cos(way * time) + decay / way * np.sin(way * time))
    )
    np.testing.assert_allclose(angle(found, "way"), wanted, atol=1e-10)
    lost = -found.work
    assert np.all(np.diff(lost) >= -1e-12)
    assert found.balance < 1e-10


def test_a_block_under_a_force_that_grows_with_time_goes_as_its_cube():
    load = {"point": "block.B", "force": [6.0, 0.0], "axes": "block", "varies": {"at": [0, 2], "factors": [0, 1]}}
    found = run(slide(loads=[load]), 2.0)
    time = found.motion.time
    np.testing.assert_allclose(angle(found, "way"), 0.3 + 3.0 * time**3 / (6.0 * 2.0), rtol=1e-12)
    np.testing.assert_allclose(found.work, found.kinetic, atol=1e-11)
    np.testing.assert_allclose(found.kinetic, 0.5 * 2.0 * (3.0 * time**2 / 4.0) ** 2, atol=1e-11)


def test_a_step_of_a_load_is_met_in_time():
    """A push for half a second only: the block goes on at the speed that it has then."""
    load = {
        "point": "block.B",
        "force": [6.0, 0.0],
        "axes": "block",
        "varies": {"at": [0, 0.5, 0.5, 2], "factors": [1, 1, 0, 0]},
    }
    found = run(slide(loads=[load]), 2.0)
    time = found.motion.time
    wanted = np.where(time < 0.5, 1.5 * time**2, 1.5 * 0.25 + 1.5 * (time - 0.5))
    np.testing.assert_allclose(angle(found, "way"), 0.3 + wanted, atol=1e-9)


def test_a_torsional_spring_swings_a_wheel_over_several_turns():
    """J a'' = -k a: from three turns off it swings three turns to the other side, at one frequency."""
    value = lever_document({"A": [1, 0]}, 0.0)
    value["masses"] = [{"link": "lever", "mass": 1.0, "at": "O", "inertia": 0.5}]
    value["springs"] = [{"links": ["f", "lever"], "stiffness": 2.0}]
    value["inputs"][0] |= {"velocity": 6.0 * pi * 2.0, "acceleration": 0.0}
    found = run(value, pi, 16, moving=True)
    time = found.motion.time
    np.testing.assert_allclose(angle(found), 6.0 * pi * np.sin(2.0 * time), atol=1e-9)
    forces = planar.forces(found.motion)
    torque = [each.couple for each in forces.acting if each.kind == "spring" and each.link == "lever"]
    np.testing.assert_allclose(torque[0], -2.0 * angle(found), atol=1e-9)
    assert np.abs(forces.inputs["O"]).max() < 1e-9


def test_a_double_pendulum_goes_as_its_equations_in_the_books_say():
    """Two rods let go at both pins, against the equations of Lagrange in absolute angles, solved by another method."""
    l1, l2 = 0.5, 0.4
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0]}},
            "upper": {"ends": ["O", "E"], "length": l1},
            "lower": {"ends": ["E", "H"], "length": l2},
        },
        "pairs": [{"turning": "O"}, {"turning": "E"}],
        "inputs": [{"pair": "O", "position": 0.3}, {"pair": "E", "position": 0.8}],
        "masses": [
            {"link": "upper", "mass": 1.2, "at": [0.2, 0], "inertia": 0.03},
            {"link": "lower", "mass": 0.9, "at": [0.25, 0], "inertia": 0.02},
        ],
        "gravity": [0, -G],
    }
    found = run(value, 1.0, 10)
    j1, j2, cross = 1.2 * 0.2**2 + 0.03 + 0.9 * l1**2, 0.9 * 0.25**2 + 0.02, 0.9 * l1 * 0.25

    def rate(_, y):
        a, b, u, v = y
        c, s = cross * cos(a - b), cross * sin(a - b)
        push = [
            -s * v**2 - G * (1.2 * 0.2 + 0.9 * l1) * cos(a),
            s * u**2 - G * 0.9 * 0.25 * cos(b),
        ]
        return [u, v, *np.linalg.solve([[j1, c], [c, j2]], push)]

    by_books = solve_ivp(
        rate, (0.0, 1.0), [0.3, 1.1, 0.0, 0.0], method="Radau", rtol=1e-11, atol=1e-12, t_eval=found.motion.time
    )
    np.testing.assert_allclose(angle(found), by_books.y[0], atol=2e-8)
    np.testing.assert_allclose(angle(found) + angle(found, "E"), by_books.y[1], atol=2e-8)
    assert found.balance < 1e-10


# energy and power


@pytest.mark.parametrize(
    "value",
    [
        dynamic_four_bar_document(0.3, 0.7, 0.6, 0.9, masses=masses("crank", "coupler", "rocker"), gravity=[0, -G]),
        piston_document(0.3, 0.9, masses=masses("crank", "rod", "piston"), gravity=[0, -G]),
    ],
    ids=["four-bar", "slider-crank"],
)
def test_what_falls_freely_keeps_its_energy(value):
    found = run(value, 10.0 if is_exhaustive() else 1.5, 100)
    whole = found.kinetic + found.potential
    assert found.kinetic.max() > 1.0
    assert np.ptp(whole) < 1e-9 * np.ptp(found.potential)
    assert np.ptp(found.work) == 0.0
    forces = planar.forces(found.motion)
    greatest = max(np.abs(each.force).max() for each in forces.reactions.values())
    assert np.abs(forces.inputs["O"]).max() < 1e-9 * greatest
    assert forces.proof.equilibrium < 1e-12


def test_a_double_rocker_that_is_let_go_passes_the_limits_of_its_crank():
    """Its input angle is no coordinate there, for it turns back: energy and closure do not notice."""
    value = dynamic_four_bar_document(0.7, 0.35, 0.6, 0.9, masses=masses("crank", "coupler", "rocker"), gravity=[0, -G])
    value["inputs"][0] |= {"position": 1.0, "velocity": 0.0, "acceleration": 0.0}
    value["sketch"] = {"B": [0.4, 0.6]}
    found = run(value, 4.0, 400)
    # the limits of the crank are where coupler and rocker lie in line: by the law of cosines
    ends = [between(0.7, 0.9, 0.35 + way * 0.6) for way in (1.0, -1.0)]
    assert found.balance < 1e-10
    swing = angle(found)
    assert (swing.max(), swing.min()) == pytest.approx(ends, abs=1e-3)
    assert ends[0] - swing.max() > 0.0
    assert swing.min() - ends[1] > 0.0
    # each limit is passed on the way there and on the way back, and nothing is lost there
    forces = planar.forces(found.motion)
    assert np.abs(forces.inputs["O"]).max() < 1e-9 * np.abs(forces.reactions["O"].force).max()


def test_what_a_driven_input_puts_in_is_what_the_others_gain():
    """A crank by its law, an arm on it let go, against a damper: work, energy and the power of the forces agree."""
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0], "W": [1, 1]}},
            "upper": {"ends": ["O", "E"], "length": 0.5},
            "lower": {"ends": ["E", "H"], "length": 0.4},
        },
        "pairs": [{"turning": "O"}, {"turning": "E"}],
        "inputs": [
            {"pair": "O", "position": 0.3, "velocity": 4.0, "acceleration": -1.0},
            {"pair": "E", "position": 0.8},
        ],
        "masses": masses_of_arm(),
        "springs": [
            {"points": ["W", "H"], "stiffness": 30.0, "free_length": 0.2, "damping": 0.4},
            {"links": ["upper", "lower"], "stiffness": 3.0, "free_angle": 0.2, "damping": 0.05},
        ],
        "gravity": [0, -G],
    }
    found = run(value, 0.5, 500, driven=["O"], moving=True)
    time = found.motion.time
    np.testing.assert_allclose(angle(found), 0.3 + 4.0 * time - 0.5 * time**2, atol=1e-12)
    forces = planar.forces(found.motion)
    greatest = np.abs(forces.inputs["O"]).max()
    assert np.abs(forces.inputs["E"]).max() < 1e-9 * greatest
    assert found.balance < 1e-10
    # the work's rate is the driven input's power less what the dampers take, by differences of order four
    step = time[1]
    rate = (found.work[:-4] - 8 * found.work[1:-3] + 8 * found.work[3:-1] - found.work[4:]) / (12 * step)
    taken = damped(forces)
    np.testing.assert_allclose(rate, (forces.powers["O"] - taken)[2:-2], atol=1e-6 * np.abs(rate).max())
    assert np.all(taken >= 0.0)
    assert rate.max() > 1.0


def masses_of_arm() -> list[Value]:
    return [
        {"link": "upper", "mass": 1.2, "at": [0.2, 0], "inertia": 0.03},
        {"link": "lower", "mass": 0.9, "at": [0.25, 0], "inertia": 0.02},
    ]


def damped(forces) -> np.ndarray:
    """What the two dampers of the arm take, from the motion alone."""
    hand = forces.moving.point("H")
    away = hand.position - np.array([1.0, 1.0])
    closing = (away * hand.velocity).sum(axis=1) / np.hypot(*away.T)
    return 0.4 * closing**2 + 0.05 * forces.moving.inputs["E"].velocity ** 2


def test_a_mechanism_held_twice_falls_as_without_the_second_holding():
    """A parallelogram with a third parallel crank without mass moves like one with two."""
    value = planar.to_dict(planar.load("three-parallel-cranks"))
    value["masses"] = [{"link": "rod", "mass": 2.0, "at": [90, -20], "inertia": 0.01}] + [
        {"link": f"crank {each}", "mass": 0.3, "at": [30, 0]} for each in "AB"
    ]
    value["gravity"] = [0, "-9.81 m/s^2"]
    twice = run(value, 1.0, 20)
    # all translate: a pendulum of the rod and half of each crank's arm
    lengths = 0.06 * 2.0 + 2 * 0.03 * 0.3
    inertia = 0.06**2 * 2.0 + 2 * 0.03**2 * 0.3
    turn = angle(twice, "A0")
    kinetic = -G * lengths * (np.sin(turn) - sin(turn[0]))
    np.testing.assert_allclose(twice.kinetic, kinetic, atol=1e-10)
    np.testing.assert_allclose(twice.kinetic, 0.5 * inertia * twice.motion.inputs["A0"].velocity ** 2, atol=1e-12)


def test_a_parallelogram_stays_one_where_its_branches_cross():
    """Let go with some speed it passes flat through its change points, twice a turn, and stays a parallelogram."""
    value = dynamic_four_bar_document(
        0.3, 0.9, 0.3, 0.9, masses=[{"link": "coupler", "mass": 2.0, "at": [0.45, 0], "inertia": 0.1}]
    )
    value["sketch"] = {"B": [1.15, 0.17]}
    value["inputs"][0]["velocity"] = 5.0
    found = run(value, 3.0, 60, moving=True)
    np.testing.assert_allclose(angle(found), 0.6 + 5.0 * found.motion.time, rtol=1e-9)
    np.testing.assert_allclose(found.motion.link("coupler").angle, 0.0, atol=1e-8)


def test_a_parallelogram_that_falls_passes_every_change_point_on_its_way():
    """Its rod translates all the time, so that it is a pendulum of its mass on the cranks: energy tells its speed."""
    value = dynamic_four_bar_document(
        0.3, 0.9, 0.3, 0.9, masses=[{"link": "coupler", "mass": 2.0, "at": [0.45, 0], "inertia": 0.1}]
    )
    value |= {"gravity": [0, -G], "sketch": {"B": [1.15, 0.17]}}
    found = run(value, 2.0, 50)
    assert np.count_nonzero(np.diff(np.sign(np.sin(angle(found))))) >= 3
    np.testing.assert_allclose(found.motion.link("coupler").angle, 0.0, atol=1e-7)
    speed = found.motion.inputs["O"].velocity ** 2
    np.testing.assert_allclose(speed, 2 * G / 0.3 * (sin(0.6) - np.sin(angle(found))), atol=1e-6 * speed.max())


def test_a_step_that_ends_beyond_a_change_point_takes_no_speed_away():
    """Where Watt's parallelogram lies flat, rates that are brought back by its constraints lost half its energy."""
    value = planar.to_dict(planar.load("watt-parallel-motion"))
    told = {
        "beam": (0.98, 8, 84, 0.024),
        "AB": (0.737, 26, -34, 0.0146),
        "radius bar": (1.22, -122, -87, 0.0266),
        "EQ": (0.762, -122, 12, 0.0492),
        "BQ": (2.585, -43, 105, 0.0119),
    }
    value["masses"] = [
        {"link": link, "mass": mass, "at": [f"{x} mm", f"{y} mm"], "inertia": f"{inertia} kg m^2"}
        for link, (mass, x, y, inertia) in told.items()
    ]
    value["gravity"] = ["0 m/s^2", f"{-G} m/s^2"]
    found = run(value, 0.615, 40)
    across = found.motion.link("AB").angle - found.motion.link("beam").angle
    assert np.any(np.diff(np.sign(np.sin(across))))
    assert found.balance < 1e-6
    np.testing.assert_allclose(found.motion.link("EQ").angle, found.motion.link("AB").angle, atol=1e-7)


# what is refused, and what is said


def test_a_link_that_nothing_makes_heavy_is_named():
    value = lever_document({"A": [1, 0]}, gravity=[0, -G])
    with pytest.raises(NoAnswer, match="'lever' can move without anything that has a mass") as refused:
        run(value, 1.0)
    assert refused.value.outcome is Outcome.TOO_FEW_INPUTS
    assert refused.value.reason.endswith("give it a mass with an inertia, or let an input drive it (--drive O)")
    # its weight alone at the pin is no inertia either
    value["masses"] = [{"link": "lever", "mass": 1.0, "at": "O"}]
    with pytest.raises(NoAnswer, match="can move without"):
        run(value, 1.0)
    driven = run(value, 1.0, driven=["O"], moving=True)
    assert angle(driven)[-1] == pytest.approx(3.0 + 1.0, rel=1e-12)


def test_where_nothing_is_let_go_that_is_said_with_the_option_that_drives_it():
    value = lever_document({"A": [1, 0]}, gravity=[0, -G], masses=[{"link": "lever", "mass": 1.0, "at": "A"}])
    assert not any("nothing" in each for each in run(value, 0.1).motion.remarks)
    (told,) = run(value, 0.1, driven=["O"]).motion.remarks
    assert told.startswith("nothing moves freely: the driven inputs at 'O' determine the whole motion")
    assert told.endswith("to let it go leave out --drive O")
    value["inputs"][0]["law"] = [{"motion": "constant speed", "by": 1, "in": 1}]
    told = run(value, 0.1).motion.remarks[-1]
    assert told.endswith("to let it go take the law of 'O' out of the file")


def test_of_a_truss_it_is_said_that_nothing_can_move():
    bars = {"AC": {"ends": ["A", "C"], "length": 1.5}, "BC": {"ends": ["B", "C"], "length": 1.5}}
    value = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"A": [0, 0], "B": [2, 0]}}, **bars},
        "pairs": [{"turning": name} for name in "ABC"],
        "sketch": {"C": [1, 1]},
        "masses": [{"link": "AC", "mass": 2, "at": "C"}],
    }
    (remark,) = run(value, 0.1).motion.remarks
    assert "nothing moves: it is a structure of links 'AC' and 'BC' with the frame 'f'" in remark


def test_where_what_can_move_loses_its_mass_on_the_way_the_rows_before_are_kept():
    """A yoke thrown up to where its crank, which has no mass, stands upright: till then it is a body in free flight."""
    radius, speed = 0.1, sqrt(2.0 * G * 0.1)
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0]}},
            "crank": {"ends": ["O", "A"], "length": radius},
            "yoke": {"points": {"Y": [0, 0]}},
        },
        "pairs": [
            {"turning": "O"},
            {"sliding": "up", "links": ["f", "yoke"], "line": {"through": "O", "angle": pi / 2}, "point": "Y"},
            {"slot": "slot", "links": ["yoke", "crank"], "line": {"through": "Y", "angle": -pi / 2}, "point": "A"},
        ],
        "inputs": [{"pair": "O", "position": 0, "velocity": speed / radius}],
        "masses": [{"link": "yoke", "mass": 1, "at": "Y"}],
        "gravity": [0, -G],
    }
    found = planar.simulate(planar.from_dict(value), 0.2, 100, moving=True)
    assert found.motion.outcome is Outcome.TOO_FEW_INPUTS
    assert "only to 0.142 s: beyond, link 'crank' can move without anything that has a mass" in found.motion.reason
    time = found.motion.time
    assert time[-1] == pytest.approx(0.142)  # of the 0.1428 s to the top
    np.testing.assert_allclose(found.motion.point("Y").position[:, 1], speed * time - G / 2 * time**2, atol=1e-11)


@pytest.mark.parametrize("duration", [0.0, -1.0, float("nan"), float("inf"), True, "2s"])
def test_durations_that_are_none_are_refused(duration):
    with pytest.raises(BadInput) as refused:
        planar.simulate(planar.from_dict(lever_document({"A": [1, 0]})), duration)
    assert refused.value.place == "duration"


@pytest.mark.parametrize("steps", [0, 2.5, True, 10**6])
def test_steps_that_are_none_are_refused(steps):
    with pytest.raises(BadInput) as refused:
        planar.simulate(planar.from_dict(lever_document({"A": [1, 0]})), 1.0, steps)
    assert refused.value.place == "steps"


def test_inputs_to_be_driven_are_known_by_name():
    with pytest.raises(BadInput, match="no input at 'X' to be driven; the inputs are at O"):
        planar.simulate(planar.from_dict(lever_document({"A": [1, 0]})), 1.0, driven=["X"])


def test_a_driven_input_that_jams_ends_the_motion_with_a_sentence():
    """The double rocker's crank, driven past where it can go."""
    value = dynamic_four_bar_document(0.7, 0.35, 0.6, 0.9, masses=masses("crank", "coupler", "rocker"))
    value["inputs"][0] |= {"position": 0.8, "velocity": 2.0, "acceleration": 0.0}
    value["sketch"] = {"B": [0.4, 0.6]}
    found = planar.simulate(planar.from_dict(value), 3.0, 300, driven=["O"], moving=True)
    assert found.motion.outcome is not Outcome.SOLVED
    assert "the motion can be told only to 0.22" in found.motion.reason
    assert "a dead point of what is driven at O" in found.motion.reason
    end = between(0.7, 0.9, 0.95)
    assert found.motion.inputs["O"].position[-1] == pytest.approx(end, abs=0.03)
    assert found.motion.residual < 1e-12


def test_a_spring_whose_ends_meet_at_the_start_is_said_to_have_no_direction():
    value = lever_document({"A": [1, 0]}, 0.0, springs=[{"points": ["W", "A"], "stiffness": 10, "free_length": 0.3}])
    value["links"]["f"]["points"]["W"] = [1, 0]
    value["masses"] = [{"link": "lever", "mass": 1, "at": "A"}]
    found = planar.simulate(planar.from_dict(value), 1.0)
    assert found.motion.outcome is Outcome.BRANCH_LOST
    assert (
        "told only to 0 s, where two points between which a spring, damper or load acts coincide" in found.motion.reason
    )
    assert len(found.motion) == 1


def test_what_rests_stays_and_keeps_its_energy():
    """A pendulum that hangs, and a bracket of two bars that cannot move."""
    hanging = run(lever_document({"G": [LENGTH, 0]}, -pi / 2, **PENDULUM), 2.0)
    np.testing.assert_allclose(angle(hanging), -pi / 2, atol=1e-12)
    assert hanging.balance < 1e-14
    value = bracket_document(masses=[{"link": "strut", "mass": 2.0, "at": "C"}], gravity=[0, -G])
    still = planar.simulate(planar.from_dict(value), 1.0, 4)
    assert still.motion.outcome is Outcome.SOLVED
    assert still.balance < 1e-14
    np.testing.assert_allclose(still.motion.point("C").position, [[4.0, 0.0]] * 5, atol=1e-12)
    assert planar.forces(planar.solve(planar.from_dict(value))).reactions["Q"].force[1] == pytest.approx(2.0 * G)


def test_a_motion_does_not_depend_on_units_or_size():
    """The same pendulum a million times smaller, in a gravity as much smaller, swings alike."""
    found = run(lever_document({"G": [LENGTH, 0]}, 0.2, **PENDULUM), 2.0, 10)
    for by in (1e-6, 1e6):
        value = lever_document({"G": [LENGTH * by, 0]}, 0.2, gravity=[0, -G * by])
        value["masses"] = [{"link": "lever", "mass": 2.0, "at": "G", "inertia": 0.05 * by**2}]
        other = run(value, 2.0, 10)
        np.testing.assert_allclose(angle(other), angle(found), atol=1e-9)
        np.testing.assert_allclose(other.kinetic, found.kinetic * by**2, atol=1e-10 * by**2)
        assert other.balance < 1e-10


# a model with a damper


def test_a_door_with_a_closer_is_critically_damped():
    """J = m b^2 / 3, c = 2 sqrt(k J): it shuts by the closed form, and never swings through."""
    door = planar.load("door-closer")
    (spring,), (mass,) = door.springs, door.masses
    inertia = mass.inertia + mass.mass * 0.4**2
    assert inertia == pytest.approx(mass.mass * 0.8**2 / 3.0, rel=1e-14)
    assert spring.damping == pytest.approx(2.0 * sqrt(spring.stiffness * inertia), rel=1e-14)
    found = planar.simulate(door, 5.0, 50)
    omega, time = sqrt(spring.stiffness / inertia), found.motion.time
    np.testing.assert_allclose(angle(found, "H"), pi / 2 * (1.0 + omega * time) * np.exp(-omega * time), atol=1e-10)
    assert np.all(np.diff(angle(found, "H")) < 0.0)
    # with a quarter of the damping it would: ratio 0.25, by the decrement of what it swings out beyond
    found = planar.simulate(door.with_values({"springs.0.damping": 4.0}), 12.0, 1200)
    swings = angle(found, "H")
    ends = swings[1:-1][np.diff(np.sign(np.diff(swings))) != 0]
    decrement = np.log(ends[:-1] / -ends[1:])
    np.testing.assert_allclose(decrement, pi * 0.25 / sqrt(1.0 - 0.25**2), rtol=1e-3)


def test_a_door_with_a_closer_stands_in_a_wind_where_its_spring_balances_it():
    door = planar.load("door-closer").with_values({"H.velocity": 0.0, "H.position": 0.5})
    assert planar.forces(planar.solve(door)).inputs["H"] == pytest.approx(12.0 * 0.5, rel=1e-12)


# loads by a table


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_between_the_kinks_of_a_load_that_varies_steps_are_as_long_as_of_a_smooth_one(monkeypatch, sense):
    """m v^2 / 2 is the area under the table, and no step is tried again and again across a kink."""
    at, factors = [0.3 + 0.1 * sense * k for k in range(21)], [1.0 + k % 2 for k in range(21)]
    by = [list(each) for each in zip(*sorted(zip(at, factors, strict=True)), strict=True)]
    load = {"pair": "way", "force": sense * 100.0, "varies": {"with": "way", "at": by[0], "factors": by[1]}}
    calls = []
    original = EquationsOfMotion._evaluate
    monkeypatch.setattr(EquationsOfMotion, "_evaluate", lambda *given: calls.append(1) or original(*given))
    found = run(slide(loads=[load]), 0.2, 40)
    gone = np.abs(found.motion.inputs["way"].position - 0.3)
    fine = np.sort(np.concatenate([np.linspace(0.0, 2.0, 20001), gone]))
    area = np.concatenate([[0.0], np.cumsum(np.diff(fine) * 50.0 * (interp(fine[1:]) + interp(fine[:-1])))])
    wanted = np.sqrt(area[np.searchsorted(fine, gone)])
    assert gone[-1] > 1.0
    np.testing.assert_allclose(np.abs(found.motion.inputs["way"].velocity), wanted, rtol=1e-9, atol=1e-9)
    assert found.balance < 1e-11
    assert len(calls) < 1500


def interp(gone: np.ndarray) -> np.ndarray:
    """The factor of the table: 1 and 2 in turn, every 0.1 m."""
    return np.interp(gone, 0.1 * np.arange(21), [1.0 + k % 2 for k in range(21)])


def test_a_load_that_turns_round_beyond_a_kink_within_a_step():
    """A block thrown against a wall of stiffness k at s = 1 comes back as fast as it came, after pi sqrt(m / k)."""
    wall = {"with": "way", "at": [0.0, 1.0, 2.0], "factors": [0.0, 0.0, -1.0]}
    value = slide(loads=[{"pair": "way", "force": 800.0, "varies": wall}])
    value["inputs"] = [{"pair": "way", "position": 0.3, "velocity": 0.7}]
    after = 2.0 + pi * sqrt(2.0 / 800.0)
    found = run(value, after, 8, moving=True)
    assert found.motion.inputs["way"].position[-1] == pytest.approx(0.3, abs=1e-10)
    assert found.motion.inputs["way"].velocity[-1] == pytest.approx(-0.7, abs=1e-10)
