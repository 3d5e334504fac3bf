"""Efforts and reactions of mechanisms with mass, against Lagrange's equations of closed forms and against free bodies
drawn by hand."""

from __future__ import annotations

from math import cos, pi, sin, sqrt, tan
from typing import Any

import numpy as np
import pytest

import planar
from planar.dynamics.forces import Forces
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from tests.builders import (
    BODIES,
    Value,
    bracket_document,
    dynamic_four_bar_document,
    lever_document,
    masses,
    piston_document,
)
from tests.checks import forces_of
from tests.closed_forms import piston

STEP = 1e-30
"""Of the complex step: f'(x) = Im f(x + ih) / h, without cancellation."""


def over(value: Value, steps: int, **options: Any) -> Forces:
    return planar.forces(planar.cycle(planar.from_dict(value), steps=steps, **options))


# the torque of an inertia, by Lagrange: T = M a + M' w^2 / 2 + V', with M(t) w^2 / 2 the kinetic energy


def lagrange(mass_of, potential, angle, velocity, acceleration):
    slopes = [np.imag(each(angle + 1j * STEP)) / STEP for each in (mass_of, potential)]
    return mass_of(angle) * acceleration + 0.5 * slopes[0] * velocity**2 + slopes[1]


def carried(at, way, rate, along, off):
    """Place and velocity of what lies so far along a unit direction (cos, sin) that turns at a rate, and off it."""
    (x, u), (y, v), (c, s) = *at, way
    return (x + along * c - off * s, u - rate * (along * s + off * c)), (
        y + along * s + off * c,
        v + rate * (along * c - off * s),
    )


WEIGHT = (3.0, -9.0)


def summed(moving):
    """M and V of three bodies, of (place with velocity, direction, rate) each."""
    mass = potential = 0.0
    for (m, along, off, j), (at, way, rate) in zip(BODIES.values(), moving, strict=True):
        (x, u), (y, v) = carried(at, way, rate, along, off)
        mass = mass + m * (u**2 + v**2) + j * rate**2
        potential = potential - m * (WEIGHT[0] * x + WEIGHT[1] * y)
    return mass, potential


def test_the_torque_of_a_slider_crank_with_mass_is_lagranges():
    r, rod = 0.3, 0.9

    def all_of(angle):
        c, s = np.cos(angle), np.sin(angle)
        way = np.sqrt(1.0 - (r * s / rod) ** 2), -r * s / rod
        rate = -r * c / (rod * way[0])
        pin = (r * c, -r * s), (r * s, r * c)
        end = carried(pin, way, rate, rod, 0.0)
        return summed([(((0.0, 0.0), (0.0, 0.0)), (c, s), 1.0), (pin, way, rate), (end, (1.0, 0.0), 0.0)])

    found = over(piston_document(r, rod, masses=masses("crank", "rod", "piston"), gravity=list(WEIGHT)), 48)
    angle = found.moving.inputs["O"].position
    wanted = lagrange(lambda t: all_of(t)[0], lambda t: all_of(t)[1], angle, 9.0, 5.0)
    np.testing.assert_allclose(found.inputs["O"], wanted, atol=1e-12 * np.abs(wanted).max())
    assert max(found.proof.power, found.proof.equilibrium) < 1e-13


@pytest.mark.parametrize("sketched", [1.0, -1.0])
def test_the_torque_of_a_four_bar_with_mass_is_lagranges(sketched):
    a, b, c, d = 0.3, 0.7, 0.8, 0.9

    def all_of(angle):
        x, y = d - a * np.cos(angle), -a * np.sin(angle)
        k = (b**2 - c**2 - x**2 - y**2) / (2 * c)  # Freudenstein: x cos + y sin = k of the rocker's angle
        rocker = 2 * np.arctan((y + sketched * np.sqrt(x**2 + y**2 - k**2)) / (x + k))
        third = np.cos(rocker), np.sin(rocker)
        second = (x + c * third[0]) / b, (y + c * third[1]) / b
        sine = second[0] * third[1] - second[1] * third[0]
        first = np.cos(angle), np.sin(angle)
        rates = (
            -a * (third[1] * first[0] - third[0] * first[1]) / (b * sine),
            a * (first[1] * second[0] - first[0] * second[1]) / (c * sine),
        )
        pin = (a * first[0], -a * first[1]), (a * first[1], a * first[0])
        return summed(
            [
                (((0.0, 0.0), (0.0, 0.0)), first, 1.0),
                (pin, second, rates[0]),
                (((d, 0.0), (0.0, 0.0)), third, rates[1]),
            ]
        )

    value = dynamic_four_bar_document(a, b, c, d, masses=masses("crank", "coupler", "rocker"), gravity=list(WEIGHT))
    value["sketch"] = {"B": [d, sketched]}
    found = over(value, 48)
    wanted = lagrange(lambda t: all_of(t)[0], lambda t: all_of(t)[1], found.moving.inputs["O"].position, 7.0, -3.0)
    np.testing.assert_allclose(found.inputs["O"], wanted, atol=1e-12 * np.abs(wanted).max())


def test_the_shaking_force_is_the_mass_times_the_acceleration_of_its_centre():
    """A crank alone, turning steadily: m r w^2 outwards, and no torque to turn it."""
    value = lever_document({"A": [0.2, 0]}, 0.5, masses=[{"link": "lever", "mass": 3.0, "at": "A", "inertia": 0.4}])
    value["inputs"][0]["acceleration"] = 0.0
    found = forces_of(value)
    outwards = 3.0 * 0.2 * 3.0**2
    assert found.shaking[0] == pytest.approx([outwards * cos(0.5), outwards * sin(0.5)], rel=1e-12)
    assert found.shaking[1] == pytest.approx(0.0, abs=1e-12)
    assert found.inputs["O"] == pytest.approx(0.0, abs=1e-12)
    assert found.reactions["O"].force == pytest.approx(-found.shaking[0], rel=1e-12)
    assert forces_of(value, inertia=False).reactions["O"].force == pytest.approx([0.0, 0.0])


def test_inertia_without_a_place_of_its_own_adds_up():
    """Two entries of one link are as their sum about the common centre (the parallel axes of Steiner)."""
    two = [{"link": "lever", "mass": 2.0, "at": [0.3, 0.1], "inertia": 0.2}, {"link": "lever", "mass": 1.0, "at": "A"}]
    found = forces_of(lever_document({"A": [0.6, 0.4]}, 0.3, masses=two))
    inertia = 0.2 + 2.0 * (0.3**2 + 0.1**2) + 1.0 * (0.6**2 + 0.4**2)
    assert found.inputs["O"] == pytest.approx(2.0 * inertia, rel=1e-13)
    centre = [(2.0 * 0.3 + 0.6) / 3.0, (2.0 * 0.1 + 0.4) / 3.0]
    own = inertia - 3.0 * (centre[0] ** 2 + centre[1] ** 2)
    as_one = forces_of(
        lever_document({"A": [0.6, 0.4]}, 0.3, masses=[{"link": "lever", "mass": 3.0, "at": centre, "inertia": own}])
    )
    assert as_one.inputs["O"] == pytest.approx(found.inputs["O"], rel=1e-13)
    assert as_one.reactions["O"].force == pytest.approx(found.reactions["O"].force, rel=1e-12)


def test_a_place_of_a_mass_is_in_the_axes_in_which_the_link_was_drawn():
    """An `axis` turns the link's angle, not where the drawing has its mass; and a file in mm says it in mm."""
    drawn = {"O": [0, 0], "A": [0, 300], "G": [120, 80]}
    value = lever_document(drawn, pi / 6, units={"length": "mm", "angle": "rad"}, gravity=[0, "-10 m/s^2"])
    value["links"]["lever"]["axis"] = ["O", "A"]
    by_name, by_place = (
        forces_of(value | {"masses": [{"link": "lever", "mass": 2.0, "at": at, "inertia": 0.3}]})
        for at in ("G", [120, 80])
    )
    # along the axis 80, to its right 120
    across = 0.08 * cos(pi / 6) + 0.12 * sin(pi / 6)
    inertia = 0.3 + 2.0 * (0.12**2 + 0.08**2)
    for found in (by_name, by_place):
        assert found.inputs["O"] == pytest.approx(20.0 * across + 2.0 * inertia, rel=1e-13)


# reactions by hand


def test_the_bars_of_a_truss_carry_what_the_method_of_joints_says():
    """A bracket of two bars under a load: both feel forces along themselves."""
    found = forces_of(bracket_document(loads=[{"point": "C", "force": [70, -900]}]))
    tie = 900 * 5 / 3
    strut = -(70 - tie * 4 / 5)
    assert found.reactions["Q"].force == pytest.approx([-tie * 4 / 5, tie * 3 / 5], rel=1e-13)
    assert found.reactions["P"].force == pytest.approx([strut, 0.0], abs=1e-10)
    assert found.inputs == {}
    assert (found.proof.power, found.proof.routes) == (None, None)
    assert found.proof.equilibrium < 1e-14


def test_a_warren_truss_with_a_driven_foot_by_joints():
    """Three triangles on a pin and a roller; the roller's input holds the truss's own mechanism of mobility 1.

    Bars of 2 m; the middle bar of the lower chord is left out and an input at the roller pushes in its place.
    """
    h = sqrt(3.0)
    bars = {"PB": ("P", "B"), "BC": ("B", "C"), "CR": ("C", "R"), "BR": ("B", "R")}
    value = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"P": [0, 0]}}, "shoe": {"points": {"R": [0, 0]}}}
        | {name: {"ends": list(ends), "length": 2} for name, ends in bars.items()},
        "pairs": [
            {"turning": "P"},
            {"turning": "B"},
            {"turning": "C"},
            {"turning": "R"},
            {"sliding": "roller", "links": ["f", "shoe"], "line": {"through": "P"}, "point": "R"},
        ],
        "inputs": [{"pair": "roller", "position": 2.0}],
        "loads": [{"point": "C", "force": [0, -300]}],
        "sketch": {"B": [1, h], "C": [3, h], "R": [2, 0]},
    }
    found = forces_of(value)
    assert found.moving.point("C").position == pytest.approx([3.0, h], rel=1e-12)
    # moments about R: the foot P holds down 300 N * 1 m / 2 m, along its bar at 60 degrees; at joint C stands CR alone
    assert found.reactions["P"].force == pytest.approx([-150 / tan(pi / 3), -150], rel=1e-12)
    assert found.reactions["roller"].force == pytest.approx([0.0, 450.0], abs=1e-9)
    assert found.inputs["roller"] == pytest.approx(150 / tan(pi / 3), rel=1e-12)
    assert found.reactions["C"].force == pytest.approx([-300 / tan(pi / 3), -300], rel=1e-12)
    assert found.reactions["B:PB,BR"].force == pytest.approx([150 / tan(pi / 3), -150], rel=1e-12)


def test_a_lever_of_three_forces_rests_on_its_pin():
    loads = [
        {"point": "P", "force": [10, -80]},
        {"point": "Q", "force": [-25, -20]},
        {"point": "P", "force": [0, 30], "axes": "lever"},
    ]
    angle = 0.4
    found = forces_of(lever_document({"P": [0.5, 0.1], "Q": [-2, 0.3]}, angle, loads=loads), inertia=False)
    turned = np.array([-30 * sin(angle), 30 * cos(angle)])
    assert found.reactions["O"].force == pytest.approx(-(np.array([-15.0, -100.0]) + turned), rel=1e-13)
    moment = 0.0
    for (x, y), force in (((0.5, 0.1), np.array([10, -80]) + turned), ((-2, 0.3), (-25, -20))):
        px, py = x * cos(angle) - y * sin(angle), x * sin(angle) + y * cos(angle)
        moment += px * force[1] - py * force[0]
    assert found.inputs["O"] == pytest.approx(-moment, rel=1e-13)
    assert found.reactions["O"].couple == 0.0


def test_a_force_that_turns_with_its_link_takes_the_same_torque_everywhere():
    value = lever_document({"P": [0.5, 0]}, loads=[{"point": "P", "force": [3, 4], "axes": "lever"}])
    found = over(value, 12)
    np.testing.assert_allclose(found.inputs["O"], -0.5 * 4, rtol=1e-13)
    force = found.reactions["O"].force
    np.testing.assert_allclose(np.hypot(*force.T), 5.0, rtol=1e-13)


def block(at: list[float], force: list[float], line: float = 0.3, **more: Any) -> Value:
    """A block on a line; the load at a place of it."""
    return {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0.1, 0.2]}}, "block": {"points": {"B": [0, 0], "P": at}}},
        "pairs": [
            {"sliding": "way", "links": ["f", "block"], "line": {"through": "O", "angle": line}, "point": "B"},
        ],
        "inputs": [{"pair": "way", "position": 0.7, "velocity": 0.3}],
        "loads": [{"point": "P", "force": force, "axes": "block"}],
        **more,
    }


def test_a_guide_takes_an_eccentric_load_as_a_force_and_a_couple():
    """Of 50 N along and 80 N across at 0.6 m along and 0.25 m off: across 80 N, and a couple 80*0.6 - 50*0.25."""
    found = forces_of(block([0.6, 0.25], [50, -80]))
    assert found.inputs["way"] == pytest.approx(-50.0, rel=1e-13)
    assert found.reactions["way"].force == pytest.approx([-80 * sin(0.3), 80 * cos(0.3)], rel=1e-13)
    assert found.reactions["way"].couple == pytest.approx(80 * 0.6 + 50 * 0.25, rel=1e-13)
    assert found.reactions["way"].at == pytest.approx([0.1 + 0.7 * cos(0.3), 0.2 + 0.7 * sin(0.3)], rel=1e-13)


def test_a_slot_takes_only_what_is_square_to_it():
    """A bar pinned at O, its slot over a driven pin: the pin pushes square to the bar with T over its distance."""
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0], "Q": [0.5, 0]}},
            "crank": {"ends": ["Q", "P"], "length": 0.2},
            "bar": {"points": {"O": [0, 0], "E": [1, 0]}},
        },
        "pairs": [
            {"turning": "O"},
            {"turning": "Q"},
            {"slot": "slit", "links": ["bar", "crank"], "line": {"through": "O", "to": "E"}, "point": "P"},
        ],
        "inputs": [{"pair": "Q", "position": 0.8}],
        "loads": [{"link": "bar", "torque": 6.0}],
        "sketch": {"E": [1, 0.2]},
    }
    found = forces_of(value)
    at = np.array([0.5 + 0.2 * cos(0.8), 0.2 * sin(0.8)])
    apart = float(np.hypot(*at))
    across = np.array([-at[1], at[0]]) / apart
    # the crank (second) feels what balances the bar's torque
    assert found.reactions["slit"].force == pytest.approx(6.0 / apart * across, rel=1e-13)
    assert found.reactions["slit"].couple == 0.0
    assert found.reactions["O"].force == pytest.approx(6.0 / apart * across, rel=1e-12)
    lever_arm = 0.2 * np.array([cos(0.8), sin(0.8)])
    assert found.inputs["Q"] == pytest.approx(
        -(lever_arm[0] * across[1] - lever_arm[1] * across[0]) * 6.0 / apart, rel=1e-12
    )


@pytest.mark.parametrize("name", ["way", "O"])
def test_an_effort_at_a_pair_is_the_same_as_the_input_that_it_spares(name):
    value = block([0.6, 0.25], [50, -80]) if name == "way" else lever_document({"P": [1, 0]}, 0.3)
    key = "force" if name == "way" else "torque"
    value.setdefault("loads", []).append({"pair": name, key: 33.0})
    with_it = forces_of(value)
    value["loads"].pop()
    without = forces_of(value)
    assert with_it.inputs[name] == pytest.approx(without.inputs[name] - 33.0, rel=1e-12)
    np.testing.assert_allclose(with_it.reactions[name].force, without.reactions[name].force, atol=1e-11)
    np.testing.assert_allclose(with_it.reactions[name].couple, without.reactions[name].couple, atol=1e-11)


def test_an_effort_between_two_moving_links_acts_on_both():
    """Of a torque at the elbow of an open arm the shoulder's input carries nothing, for it is within the arm."""
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0]}},
            "upper": {"ends": ["O", "E"], "length": 0.4},
            "lower": {"ends": ["E", "H"], "length": 0.3},
        },
        "pairs": [{"turning": "O"}, {"turning": "E"}],
        "inputs": [{"pair": "O", "position": 0.4}, {"pair": "E", "position": 0.9}],
        "loads": [{"pair": "E", "torque": 5.0}],
    }
    found = forces_of(value)
    assert found.inputs == pytest.approx({"O": 0.0, "E": -5.0}, abs=1e-13)
    value["loads"] = [{"point": "H", "force": [0, -10]}]
    found = forces_of(value)
    elbow = 0.3 * cos(1.3)
    assert found.inputs == pytest.approx({"O": 10 * (0.4 * cos(0.4) + elbow), "E": 10 * elbow}, rel=1e-13)
    assert found.reactions["E"].force == pytest.approx([0.0, 10.0], abs=1e-12)


def test_loads_on_a_pin_of_three_links_and_their_reactions_by_name():
    """Three bars that meet in a pin, one of them loaded along itself: it takes all, the others are told apart."""
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"P": [0, 0], "Q": [2, 0]}},
            "a": {"ends": ["P", "C"], "length": sqrt(2)},
            "b": {"ends": ["Q", "C"], "length": sqrt(2)},
            "hanger": {"points": {"C": [0, 0], "D": [0, -1]}},
        },
        "pairs": [{"turning": each} for each in "PQC"],
        "inputs": [{"pair": "C:a,hanger", "position": -pi / 4}],
        "loads": [{"point": "D", "force": [0, -100]}],
        "sketch": {"C": [1, 1], "D": [1, 0]},
    }
    found = forces_of(value)
    assert list(found.reactions) == ["P", "Q", "C:a,b", "C:a,hanger"]
    assert found.reactions["C:a,hanger"].force == pytest.approx([0.0, 100.0], abs=1e-11)
    assert found.reactions["C:a,b"].force == pytest.approx([50.0, -50.0], rel=1e-12)
    assert found.reactions["P"].force == pytest.approx([50.0, 50.0], rel=1e-12)


def test_an_input_may_drive_a_motion_of_a_pin_that_is_no_pair_by_itself():
    """The angle between the second and third link of a pin: the effort acts on these two."""
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"C": [0, 0]}},
            "a": {"points": {"C": [0, 0]}},
            "b": {"points": {"C": [0, 0], "D": [1, 0]}},
        },
        "pairs": [{"turning": "C", "links": ["f", "a", "b"]}],
        "inputs": [{"pair": "C:f,a", "position": 0.2}, {"pair": "C:a,b", "position": 0.3}],
        "loads": [{"point": "D", "force": [0, -8]}],
    }
    found = forces_of(value)
    torque = 8 * cos(0.5)
    assert found.inputs == pytest.approx({"C:f,a": torque, "C:a,b": torque}, rel=1e-13)
    assert found.proof.equilibrium < 1e-14


# springs


def test_a_spring_pulls_by_its_length_and_a_damper_by_how_fast_it_grows():
    spring = {"points": ["W", "A"], "stiffness": 40.0, "free_length": 0.3, "damping": 2.5}
    value = lever_document({"A": [0.5, 0]}, 0.7, springs=[spring])
    value["links"]["f"]["points"]["W"] = [1.2, -0.1]
    found = forces_of(value)
    away = np.array([1.2 - 0.5 * cos(0.7), -0.1 - 0.5 * sin(0.7)])
    length = np.hypot(*away)
    growing = -3.0 * 0.5 * (-sin(0.7) * away[0] + cos(0.7) * away[1]) / length
    pull = (40.0 * (length - 0.3) + 2.5 * growing) * away / length
    assert found.reactions["O"].force == pytest.approx(-pull, rel=1e-12)
    assert found.inputs["O"] == pytest.approx(-0.5 * (cos(0.7) * pull[1] - sin(0.7) * pull[0]), rel=1e-12)


def test_a_spring_without_free_length_pulls_nothing_where_its_ends_meet_and_any_other_has_no_direction():
    value = lever_document({"A": [0.5, 0]}, 0.0, springs=[{"points": ["W", "A"], "stiffness": 40.0}])
    value["links"]["f"]["points"]["W"] = [0.5, 0.0]
    assert forces_of(value).reactions["O"].force == pytest.approx([0.0, 0.0], abs=1e-14)
    for more in ({"free_length": 0.1}, {"damping": 1.0}):
        value["springs"][0] = {"points": ["W", "A"], "stiffness": 40.0, **more}
        with pytest.raises(NoAnswer, match="a spring, a damper or a load acts coincide here"):
            forces_of(value)
        found = over(value, 4)
        assert list(np.isnan(found.inputs["O"])) == [True, False, False, False, True]


@pytest.mark.parametrize(
    ("free", "angle", "wound"),
    [(0.2, 0.9, 0.7), (3.0, -3.0, 2 * pi - 6.0), (-1.5 * pi, 0.4, 0.4 + 1.5 * pi), (5 * pi, 0.1, 0.1 - 5 * pi)],
)
def test_a_torsional_spring_is_wound_up_the_least_unless_it_is_set_with_turns(free, angle, wound):
    value = lever_document({}, angle, springs=[{"links": ["f", "lever"], "stiffness": 7.0, "free_angle": free}])
    found = forces_of(value)
    assert found.inputs["O"] == pytest.approx(7.0 * wound, rel=1e-12)
    assert found.proof.equilibrium < 1e-14
    two_turns = planar.cycle(planar.from_dict(value), steps=12, start=angle, stop=angle + 4 * pi)
    torque = planar.forces(two_turns).inputs["O"]
    np.testing.assert_allclose(torque, 7.0 * (wound + np.linspace(0.0, 4 * pi, 13)), rtol=1e-12)


# refusals


def test_loads_of_time_are_refused_of_a_motion_without():
    value = lever_document(
        {"P": [1, 0]}, loads=[{"link": "lever", "torque": 2, "varies": {"at": [0, 1], "factors": [1, 3]}}]
    )
    assert forces_of(value).inputs["O"] == pytest.approx(-2.0)
    with pytest.raises(BadInput, match="varies with time") as refused:
        over(value, 4)
    assert refused.value.place == "loads"
    found = over(value, 4, duration=1.0)
    np.testing.assert_allclose(found.inputs["O"], [-2.0, -3.0, -4.0, -5.0, -6.0], rtol=1e-13)


def test_a_dead_point_is_said_and_in_a_motion_not_a_number():
    """A slider-crank driven by its slide towards its dead point: its pull grows as T / (r sin), and there is none."""
    value = piston_document(0.3, 0.9, loads=[{"link": "crank", "torque": 5.0}])
    value["inputs"] = [{"pair": "stroke", "position": 1.2, "velocity": 0.1}]
    value["sketch"]["A"] = [0.3, 0.01]
    with pytest.raises(NoAnswer) as refused:
        forces_of(value)
    assert refused.value.outcome is Outcome.DEAD_POINT
    value["inputs"][0]["position"] = 1.0
    found = over(value, 20)
    force, lost = found.inputs["stroke"], np.isnan(found.inputs["stroke"])
    assert lost.any()
    assert not lost.all()
    turn = found.moving.pair("O")["relative_angle"][~lost]
    wanted = -5.0 / piston(turn, 0.3, 0.9)[1]
    np.testing.assert_allclose(force[~lost], wanted, rtol=1e-8)
    assert np.isnan(found.reactions["O"].force[lost]).all()
