"""What pairs carry where teeth press, where only ratios are known, and where links are held more than once."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, radians, sin, tan
from typing import Any

import numpy as np
import pytest

import planar
from planar.dynamics.forces import Forces
from planar.model.loads import Load
from tests.builders import four_bar_document, piston_document
from tests.checks import forces_of

Value = dict[str, Any]
OFF = tan(radians(20))


def told(reaction) -> bool:
    return bool(np.isfinite(reaction.force).all() and np.isfinite(reaction.couple))


# teeth


def wheels(apart: float, **mesh: Any) -> Value:
    """Two wheels on the frame, a's shaft at the origin and b's on the x-axis; b is loaded with 10 N m."""
    return {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"P": [0, 0], "Q": [apart, 0]}},
            "a": {"points": {"P": [0, 0]}},
            "b": {"points": {"Q": [0, 0]}},
        },
        "pairs": [{"turning": "P"}, {"turning": "Q"}, {"gear": "mesh", "links": ["a", "b"], **mesh}],
        "inputs": [{"pair": "P", "position": 0.2, "velocity": 3.0}],
        "loads": [{"link": "b", "torque": 10.0}],
    }


@pytest.mark.parametrize(
    ("apart", "mesh", "at", "tangential", "off"),
    [
        # on wheel b: its torque by its radius, square to the line of the centres, and off its fellow
        (0.8, {"radii": [0.3, 0.5]}, 0.3, 10 / 0.5, OFF * 20),
        (0.8, {"teeth": [30, 50]}, 0.3, 10 / 0.5, OFF * 20),
        (0.8, {"radii": [0.3, 0.5], "pressure_angle": 0.25}, 0.3, 10 / 0.5, tan(0.25) * 20),
        # a pinion within a ring is pushed towards its own centre, and a ring off its pinion
        (0.4, {"radii": [-0.6, 0.2]}, 0.6, -10 / 0.2, -OFF * 50),
        (0.4, {"radii": [0.2, -0.6]}, -0.2, 10 / 0.6, -OFF * 10 / 0.6),
    ],
)
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_teeth_press_with_the_torque_by_the_radius_and_push_each_other_off(apart, mesh, at, tangential, off, sense):
    value = wheels(apart, **mesh)
    value["loads"][0]["torque"] *= sense
    found = forces_of(value)
    on_second = found.reactions["mesh"]
    assert on_second.at == pytest.approx([at, 0.0], abs=1e-12)
    assert on_second.force == pytest.approx([off, tangential * sense], rel=1e-12)
    assert on_second.couple == 0.0
    assert found.reactions["Q"].force == pytest.approx(-on_second.force, rel=1e-12)
    assert found.reactions["P"].force == pytest.approx(on_second.force, rel=1e-12)
    assert found.inputs["P"] == pytest.approx(at * tangential * sense, rel=1e-12)
    assert found.proof.equilibrium < 1e-14
    assert found.undetermined == {}


def test_the_planet_of_a_gear_set_is_pressed_alike_from_both_sides():
    """Of a torque on the arm: F = T / (2 * arm) at each mesh, twice that at the planet's pin, F r on the sun."""
    value = planar.to_dict(planar.load("planetary-gear-set")) | {"loads": [{"link": "arm", "torque": -12.0}]}
    found = forces_of(value)
    press = 12.0 / (2 * 0.060)
    turn = found.moving.link("arm").angle
    across, outwards = np.array([-sin(turn), cos(turn)]), np.array([cos(turn), sin(turn)])
    inner, outer, pin = (found.reactions[name] for name in ("inner mesh", "outer mesh", "P"))
    assert inner.force == pytest.approx(press * across + OFF * press * outwards, rel=1e-12)
    assert outer.force == pytest.approx(press * across - OFF * press * outwards, rel=1e-12)
    assert inner.at == pytest.approx(0.040 * outwards, rel=1e-12)
    assert outer.at == pytest.approx(0.080 * outwards, rel=1e-12)
    assert pin.links == ("arm", "planet")
    assert pin.force == pytest.approx(-2 * press * across, rel=1e-12)
    assert found.inputs["O:frame,sun"] == pytest.approx(press * 0.040, rel=1e-12)
    assert found.undetermined == {}


@pytest.mark.parametrize("name, pair", [("rolling-wheel", "rail"), ("rack-differential", "upper mesh")])
def test_an_effort_along_a_rack_is_carried_where_it_acts(name, pair):
    """It pushes the pinion at its centre, and what pairs carry balances every link against that very push."""
    mechanism = planar.load(name)
    solved = planar.solve(replace(mechanism, loads=(Load(pair=pair, effort=4.0),), springs=(), masses=()))
    assert planar.forces(solved).proof.equilibrium < 1e-12


def test_a_pinion_and_its_rack_push_each_other_off():
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0.2]}},
            "pinion": {"points": {"O": [0, 0]}},
            "rack": {"points": {"P": [0, 0]}},
        },
        "pairs": [
            {"turning": "O"},
            {"sliding": "travel", "links": ["f", "rack"], "line": {"through": [0, 0]}, "point": "P"},
            {"rack": "teeth", "links": ["rack", "pinion"], "line": {"through": "P"}, "point": "O", "radius": 0.2},
        ],
        "inputs": [{"pair": "O", "position": 0.3}],
        "loads": [{"point": "P", "force": [-90, 7]}],
    }
    found = forces_of(value)
    off = 90 * OFF
    assert found.reactions["teeth"].force == pytest.approx([-90, off], rel=1e-12)
    assert found.reactions["teeth"].at == pytest.approx([0, 0], abs=1e-15)
    assert found.reactions["O"].force == pytest.approx([90, -off], rel=1e-12)
    assert found.reactions["travel"].force == pytest.approx([0, off - 7], abs=1e-10)
    place = found.reactions["travel"].at[0]
    # the teeth push the rack down at the origin, the guide holds it up at its point, with a couple against the arm
    assert found.reactions["travel"].couple == pytest.approx(-place * off, rel=1e-12)


# wheels of which a ratio is known, and no more


@pytest.mark.parametrize("keyword", ["gear", "belt", "chain"])
def test_of_wheels_given_by_ratio_couples_are_told_and_bearings_named(keyword):
    value = wheels(0.8)
    value["pairs"][2] = {keyword: "mesh", "links": ["a", "b"], "ratio": -0.6}
    found = forces_of(value)
    assert found.inputs["P"] == pytest.approx(6.0, rel=1e-12)
    assert found.reactions["mesh"].couples == pytest.approx({"a": -6.0, "b": -10.0, "f": 16.0}, rel=1e-12)
    assert set(found.undetermined) == {"P", "Q"}
    for name in "PQ":
        assert np.isnan(found.reactions[name].force).all()
        assert "what 'mesh' puts on it is not known" in found.undetermined[name]
        assert found.reactions[name].couple == 0.0


def test_a_bearing_beyond_the_wheels_is_told_all_the_same():
    """Behind wheel b a crank drives a piston: what runs in the shafts is open, what runs in the rod is not."""
    value = piston_document(0.3, 0.9, loads=[{"point": "B", "force": [100, 0]}])
    whole = forces_of(value)
    value["links"]["f"]["points"]["Q"] = [-0.5, 0.0]
    value["links"]["motor"] = {"points": {"Q": [0, 0]}}
    value["pairs"] += [{"turning": "Q"}, {"belt": "loop", "links": ["motor", "crank"], "ratio": 0.5}]
    value["inputs"] = [{"pair": "Q", "position": 0.8}]
    value["sketch"]["A"] = [0.3 * cos(0.4), 0.3 * sin(0.4)]
    found = forces_of(value)
    assert found.inputs["Q"] == pytest.approx(0.5 * whole.inputs["O"], rel=1e-12)
    assert set(found.undetermined) == {"O", "Q"}
    for name in ("A", "B", "stroke"):
        assert found.reactions[name].force == pytest.approx(whole.reactions[name].force, rel=1e-12)


def test_wheels_whose_shafts_are_not_in_the_carrier_load_bearings_that_are_not_known():
    """A planetary set whose sun and arm have a pin each on the frame: nothing ties the meshes to places, so that what
    passes between the wheels loads pins in a way that is not told; but efforts and couples are."""
    value = planar.to_dict(planar.load("planetary-gear-set")) | {"loads": [{"link": "arm", "torque": -12.0}]}
    value["links"]["frame"]["points"]["S0"] = [0, 0]
    value["links"]["sun"]["points"] = {"S0": [0, 0]}
    value["pairs"][0] = {"turning": "O", "links": ["frame", "arm"]}
    value["pairs"].insert(1, {"turning": "S0", "links": ["frame", "sun"]})
    for pair in value["pairs"][3:]:
        pair.pop("radii")
        pair["ratio"] = -2.0 if pair["gear"] == "inner mesh" else 4.0
    value["inputs"][0]["pair"] = "S0"
    found = forces_of(value)
    assert found.inputs["S0"] == pytest.approx(4.0, rel=1e-12)
    assert set(found.undetermined) == {"O", "S0", "P"}


# links held more than once


def agreeing(ways: list[Forces]) -> set[str]:
    """The pairs that carry the same in several mechanisms, of those that all of them have."""
    common = set.intersection(*(set(each.reactions) for each in ways))
    first = ways[0].reactions
    return {
        name
        for name in common
        if all(
            np.allclose(each.reactions[name].force, first[name].force, atol=1e-9)
            and np.allclose(each.reactions[name].couple, first[name].couple, atol=1e-9)
            for each in ways[1:]
        )
    }


def test_of_a_piston_in_two_guides_only_the_guides_are_not_told():
    value = piston_document(0.3, 0.9, loads=[{"point": "B", "force": [-100, 0]}, {"point": "A", "force": [3, 5]}])
    again = {"sliding": "again", "links": ["f", "piston"], "line": {"through": "O"}, "point": "B"}
    broken = [forces_of(value)]
    whole = forces_of(value | {"pairs": [*value["pairs"], again]})
    broken.append(forces_of(value | {"pairs": [*value["pairs"][:-1], again]}))
    assert set(whole.undetermined) == {"stroke", "again"}
    assert agreeing(broken) == {"O", "A", "B"}
    for name in "OAB":
        assert whole.reactions[name].force == pytest.approx(broken[0].reactions[name].force, rel=1e-10)
    assert whole.inputs["O"] == pytest.approx(broken[0].inputs["O"], rel=1e-12)
    assert "held more than once" in whole.undetermined["stroke"]
    assert whole.bodies == ("crank", "rod")
    assert whole.proof.equilibrium < 1e-13


def parallel(*cranks: str) -> Value:
    """A rod on parallel cranks, with a link hung on it that swings by an input of its own."""
    value = planar.to_dict(planar.load("three-parallel-cranks"))
    for name in set("ABC") - set(cranks):
        value["links"].pop(f"crank {name}")
        value["pairs"] = [each for each in value["pairs"] if not each["turning"].startswith(name)]
    value["links"]["hung"] = {"ends": ["E", "H"], "length": 80}
    value["pairs"].append({"turning": "E"})
    value["inputs"].append({"pair": "E", "position": -100})
    value["loads"] = [{"point": "H", "force": [30, -200]}, {"point": "rod.E", "force": [10, 0]}]
    return value


def test_of_a_rod_on_three_parallel_cranks_what_hangs_on_it_is_told():
    whole = forces_of(parallel("A", "B", "C"))
    broken = [forces_of(parallel("A", "B")), forces_of(parallel("A", "C"))]
    assert agreeing(broken) == {"E"}
    assert {name for name, each in whole.reactions.items() if told(each)} == {"E"}
    assert whole.reactions["E"].force == pytest.approx(broken[0].reactions["E"].force, rel=1e-10)
    for name, effort in whole.inputs.items():
        assert effort == pytest.approx(broken[0].inputs[name], rel=1e-10)
    assert whole.bodies == ("hung",)


def test_a_shaft_in_two_bearings_at_one_place_has_no_telling_which_carries():
    value = piston_document(0.3, 0.9, loads=[{"point": "B", "force": [-100, 0]}])
    value["links"]["f"]["points"]["O2"] = [0, 0]
    value["links"]["crank"]["points"] = {"O2": [0, 0]}
    value["pairs"].append({"turning": "O2", "links": ["f", "crank"]})
    found = forces_of(value)
    assert set(found.undetermined) == {"O", "O2"}
    assert np.isnan(found.reactions["O"].force).all()


def test_two_pins_in_line_hold_a_rigid_body_twice_only_along_their_line():
    """A plate on two pins of the frame, with no freedom: across, each is told by the lever; along, neither is."""
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"P": [0, 0], "Q": [2, 0]}},
            "plate": {"points": {"P": [0, 0], "Q": [2, 0], "R": [0.5, 0.3]}},
        },
        "pairs": [{"turning": "P"}, {"turning": "Q"}],
        "loads": [{"point": "R", "force": [0, -8]}],
    }
    found = forces_of(value)
    assert set(found.undetermined) == {"P", "Q"}
    for name in "PQ":
        assert np.isnan(found.reactions[name].force).all()


@pytest.mark.parametrize("second", [20, 28])
def test_teeth_that_mesh_twice_leave_open_how_hard_they_push_their_bearings_apart(second):
    """Two meshes of one pair of wheels may press against each other; the torques are told all the same."""
    value = {
        "planar": 1,
        "units": {"angle": "deg"},
        "frame": "f",
        "links": {
            "f": {"points": {"P": [0, 0], "Q": [3, 0]}},
            "a": {"points": {"P": [0, 0]}},
            "b": {"points": {"Q": [0, 0]}},
        },
        "pairs": [
            {"turning": "P"},
            {"turning": "Q"},
            {"gear": "one", "links": ["a", "b"], "radii": [1, 2]},
            {"gear": "two", "links": ["a", "b"], "radii": [1, 2], "pressure_angle": second},
        ],
        "inputs": [{"pair": "P", "position": 0}],
        "loads": [{"link": "b", "torque": -10}],
    }
    found = forces_of(value)
    assert found.inputs["P"] == pytest.approx(-5.0, rel=1e-12)
    assert set(found.undetermined) == {"P", "Q", "one", "two"}
    for each in found.reactions.values():
        assert np.isnan(each.force).all()
    value["pairs"].pop()
    once = forces_of(value)
    assert not once.undetermined
    # T / s across the centres at each, and its tangent along them, off each other
    assert once.reactions["Q"].force == pytest.approx([-5.0 * tan(radians(20)), 5.0], rel=1e-12)


@pytest.mark.parametrize("angle", [0.3, pi])
def test_a_motion_that_passes_where_links_are_held_twice_names_it_there_only(angle):
    """A parallelogram of two cranks: flat in its line of shafts it is held twice, elsewhere once."""
    more = {"loads": [{"link": "b", "torque": 2.0}], "sketch": {"B": [1.19, 0.09]}}
    value = four_bar_document(0.3, 0.9, 0.3, 0.9, 0.3, pins="OABQ", names=["f", "a", "rod", "b"], **more)
    motion = planar.cycle(planar.from_dict(value), steps=4, start=angle - 0.2, stop=angle + 0.2)
    found = planar.forces(motion)
    lost = np.isnan(found.inputs["O"])
    assert list(lost) == [False, False, angle == pi, False, False]
    assert all("as at a dead point" in why for why in found.undetermined.values())  # the second crank is loaded
    assert bool(found.undetermined) == lost.any()
    np.testing.assert_allclose(found.inputs["O"][~lost], -2.0, rtol=1e-10)
    force = found.reactions["A"].force
    # the rod is a two-force link: T / (r sin) along itself
    np.testing.assert_allclose(
        np.abs(force[~lost, 0]), 2.0 / (0.3 * np.abs(np.sin(motion.inputs["O"].position[~lost]))), rtol=1e-9
    )
