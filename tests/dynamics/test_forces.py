"""Efforts of inputs against loads, power and mechanical advantage: closed forms, virtual work, equilibrium, centres."""

from __future__ import annotations

import json
from dataclasses import replace
from math import cos, hypot, inf, nan, pi, radians, sin, tan
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planar
from planar.analysis.motion.mechanical_advantage import advantage, advantages
from planar.dynamics import virtual_work
from planar.dynamics.virtual_velocities import has_length_motion, unit_rate_state
from planar.dynamics.virtual_work import BalanceEquations
from planar.foundation.errors import BadInput, NoAnswer, Outcome, Unknown
from planar.model.loads import Load
from planar.model.mechanism import Drive, Input, Mechanism
from planar.results.motion import State
from planar.solving.position import solve
from tests.builders import Value, slider_crank_document
from tests.closed_forms import piston
from tests.command import run
from tests.draws import draws, first_cases, part
from tests.known import MODELS, state_of
from tests.linkages import random_linkage

ONE_INPUT = [stem for stem, mechanism in MODELS.items() if len(mechanism.inputs) == 1]
EXACT = 1e-10
near = settings(max_examples=draws(8), deadline=None)


def pushed_crank(angle: float, loads: list[Any], r: float = 0.3, rod: float = 1.0, turned: float = 0.0) -> Value:
    """Somewhere, the line of its slide turned; the crank's angle is counted from that line."""
    return slider_crank_document(r, rod, angle, turn=turned, shift=(0.4, -0.7), omega=2.0, loads=loads)


def solved(value: dict[str, Any]) -> State:
    return planar.solve(planar.from_dict(value))


def speed_ratio(angle: float, r: float = 0.3, rod: float = 1.0) -> float:
    """-dx/d(angle) of a piston, by its closed form."""
    return -float(piston(angle, r, rod)[1])


def loaded(mechanism: Mechanism, seed: int) -> Mechanism:
    """The mechanism with random forces at two points and a random torque on a link."""
    rng = np.random.default_rng(seed)
    points = planar.model.mechanism.named_points(mechanism)
    links = [link.name for link in mechanism.links]
    loads = [
        Load(point=points[int(rng.integers(len(points)))].name, force=tuple(map(float, rng.uniform(-1e3, 1e3, 2))))
        for _ in range(2)
    ]
    loads.append(Load(link=links[int(rng.integers(len(links)))], torque=float(rng.uniform(-1e3, 1e3))))
    first, second = rng.permutation(len(points))[:2]
    ends = points[int(first)].name, points[int(second)].name
    loads.append(Load(points=ends, effort=float(rng.uniform(-1e3, 1e3))))
    return replace(mechanism, loads=tuple(loads))


def potential(mechanism: Mechanism, state: State) -> float:
    """The work that constant loads have done from the origin on."""
    found = 0.0
    for load in mechanism.loads:
        if load.point is not None:
            found += float(np.dot(load.force, state.point(load.point).position))
        if load.link is not None:
            found += load.torque * state.link(load.link).angle
        if load.points is not None:
            first, second = (state.point(end).position for end in load.points)
            found += load.effort * float(np.hypot(*(second - first)))
    return found


def by_difference(mechanism: Mechanism, name: str, step: float) -> float:
    """The effort from the work of the loads between two positions of an input."""
    position = next(each.position for each in mechanism.inputs if each.pair == name)
    ends = [potential(mechanism, solve(mechanism, {name: position + way * step})) for way in (1.0, -1.0)]
    return -(ends[0] - ends[1]) / (2.0 * step)


# closed forms


@near
@given(angle=st.floats(-3.1, 3.1), force=st.floats(-1e4, 1e4), r=st.floats(0.05, 0.9))
def test_the_torque_of_a_slider_crank_is_its_closed_form(angle, force, r):
    """T = F r (sin a + sin 2a / (2 sqrt(n^2 - sin^2 a))), n = rod / crank."""
    state = solved(pushed_crank(angle, [{"point": "B", "force": [force, 0]}], r))
    found = planar.forces(state)
    assert found.inputs["O"] == pytest.approx(force * speed_ratio(angle, r), rel=1e-11, abs=1e-12 * (1 + abs(force)))
    rounding = 1e-12 * (1 + abs(force))
    assert found.power_in == pytest.approx(2.0 * found.inputs["O"], abs=rounding)
    assert found.power_out == pytest.approx(found.power_in, abs=rounding)


def test_an_input_that_slides_supplies_a_force():
    """The same press driven by its ram: F = T / (the ram's speed for each rad/s of the crank)."""
    value = pushed_crank(0.8, [{"link": "crank", "torque": 12.0}])
    place = planar.solve(planar.from_dict(value)).pair("stroke")["displacement"]
    value["inputs"] = [{"pair": "stroke", "position": place, "velocity": 0.1}]
    value["sketch"]["A"] = [0.4 + 0.3 * cos(0.8), -0.7 + 0.3 * sin(0.8)]
    found = planar.forces(solved(value))
    assert found.is_force_input("stroke")
    assert found.inputs["stroke"] == pytest.approx(12.0 / speed_ratio(0.8), rel=1e-10)
    assert advantage(found.moving, "crank").by_power == pytest.approx(-speed_ratio(0.8), rel=1e-10)
    assert advantage(found.moving, "crank").measure == "m"


def test_a_lever_is_in_balance_by_its_arms():
    value = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "lever": {"points": {"O": [0, 0], "P": [0.5, 0], "Q": [-2, 0]}}},
        "pairs": [{"turning": "O"}],
        "inputs": [{"pair": "O", "position": 0.4}],
        "loads": [{"point": "P", "force": [0, -80]}, {"point": "Q", "force": [0, -20]}],
    }
    assert planar.forces(solved(value)).inputs["O"] == pytest.approx(0.0, abs=1e-12)
    value["loads"].pop()
    state = solved(value)
    assert planar.forces(state).inputs["O"] == pytest.approx(80 * 0.5 * cos(0.4), rel=1e-12)
    assert advantage(state, "P").by_power == pytest.approx(1 / 0.5, rel=1e-12)
    assert advantage(state, "Q").by_centres == pytest.approx(1 / 2, rel=1e-12)


def test_wheels_in_mesh_pass_torque_on_by_their_radii():
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"P": [0, 0], "Q": [0.8, 0]}},
            "a": {"points": {"P": [0, 0]}},
            "b": {"points": {"Q": [0, 0]}},
        },
        "pairs": [{"turning": "P"}, {"turning": "Q"}, {"gear": "mesh", "links": ["a", "b"], "radii": [0.3, 0.5]}],
        "inputs": [{"pair": "P", "position": 0.2}],
        "loads": [{"link": "b", "torque": 10.0}],
    }
    state = solved(value)
    assert planar.forces(state).inputs["P"] == pytest.approx(10.0 * 0.3 / 0.5, rel=1e-12)
    ratio = advantage(state, "b")
    assert ratio.by_power == pytest.approx(-0.5 / 0.3, rel=1e-12)
    assert ratio.by_centres == pytest.approx(-0.5 / 0.3, rel=1e-12)
    assert ratio.measure == "1"


def test_a_pinion_pushes_its_rack_with_the_torque_by_its_radius():
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
            {
                "rack": "teeth",
                "links": ["rack", "pinion"],
                "line": {"through": "P"},
                "point": "O",
                "radius": 0.2,
                "mesh": {"displacement": 0, "angle": 0},
            },
        ],
        "inputs": [{"pair": "O", "position": 0.3}],
        "loads": [{"point": "P", "force": [-90, 7]}],
    }
    state = solved(value)
    assert planar.forces(state).inputs["O"] == pytest.approx(90 * 0.2, rel=1e-12)
    for output in ("rack.P", "travel") if "rack.P" in state.point_names else ("P", "travel"):
        ratio = advantage(state, output)
        assert (ratio.by_power, ratio.by_centres) == pytest.approx((5.0, 5.0), rel=1e-12)
        assert ratio.measure == "1/m"


def test_a_knee_thrusts_by_the_tangent_of_its_angle():
    """Two equal toggle links at an angle a from the line of thrust: F / (2 tan a) for a push F at the knee."""
    mechanism = MODELS["toggle-press"]
    state = solve(mechanism)
    knee = state.point("B").position
    a = float(np.arcsin(abs(knee[0]) / 0.2))
    push = replace(mechanism, loads=(Load("B", (1.0, 0.0)), Load("D", (0.0, -np.sign(knee[0]) / (2 * tan(a))))))
    balance = planar.forces(solve(push)).inputs["A0"]
    alone_ = planar.forces(solve(replace(push, loads=push.loads[:1]))).inputs["A0"]
    assert abs(alone_) > 1e-3
    assert abs(balance) < 1e-12


def test_the_toggle_of_the_chapter_takes_217_newton_metres_and_its_337_is_named_a_slip():
    state = planar.solve(planar.load("000-P2"))
    found = planar.forces(state)
    assert found.inputs["O"] == pytest.approx(216.6, abs=0.05)
    assert found.power_in == pytest.approx(2000 * abs(state.point("D").velocity[0]), rel=1e-12)
    ratio = advantage(state, "D")
    assert ratio.by_power * found.inputs["O"] == pytest.approx(2000.0, rel=1e-12)
    assert ratio.through == ("I16", "I14", "I46")


def levers(hand: float, bolt: float, **changes: Any) -> Value:
    """A compound cutter with handles of 420 and 60, and jaws of 100 and 35: two forces, each between two points."""
    links = {
        "lower handle": {"points": {"A": [0, 0], "D": [0.06, -0.025], "L": [-0.42, -0.06]}},
        "upper handle": {"points": {"A": [0, 0], "B": [0.06, 0.025], "H": [-0.42, 0.06]}},
        "upper jaw": {"points": {"C": [0, 0], "B": [-0.1, 0.025], "P": [0.035, 0.004]}},
        "lower jaw": {"points": {"C": [0, 0], "D": [-0.1, -0.025], "Q": [0.035, -0.004]}},
    }
    loads = [{"points": ["H", "L"], "force": -hand}, {"points": ["P", "Q"], "force": bolt}]
    return {
        "planar": 1,
        "frame": "lower handle",
        "links": links,
        "pairs": [{"turning": pin} for pin in "ABCD"],
        "inputs": [{"pair": "A", "position": 0.0, "velocity": 0.3}],
        "loads": loads,
        "sketch": {"C": [0.16, 0]},
        **changes,
    }


def test_hands_on_both_handles_hold_a_bolt_by_the_ratio_of_the_levers():
    """Moments about the pins: 420 of the handle on 60, 100 of the jaw on 35; every pin's force by equilibrium."""
    state = solved(levers(100.0, 2000.0))
    found = planar.forces(state)
    assert found.inputs["A"] == pytest.approx(0.0, abs=1e-9)
    proved(found, EXACT)
    for pin, force in (("A", 800.0), ("B", 700.0), ("C", 2700.0), ("D", -700.0)):
        assert found.reactions[pin].force == pytest.approx([0.0, force], abs=1e-8)
    for load, size in (("loads.0", -100.0), ("loads.1", 2000.0)):
        unknown = planar.unknown_load(state, load)
        assert (unknown.what, unknown.value, unknown.factor) == ("force", size, pytest.approx(1.0, rel=1e-12))
    pressed = planar.unknown_load(solved(levers(45.0, 1.0)), "loads.1")
    assert pressed.factor == pytest.approx(45.0 * 20.0, rel=1e-12)


def test_a_force_between_two_points_is_read_written_and_varies_as_other_loads():
    varies = {"with": "A", "at": [-0.1, 0.1], "factors": [0.0, 1.0]}
    value = levers(100.0, 0.0, loads=[{"points": ["H", "L"], "force": -100.0, "varies": varies}])
    mechanism = planar.from_dict(value)
    assert mechanism.loads[0].points == ("H", "L")
    assert planar.loads(planar.dumps(mechanism)) == mechanism
    assert planar.dimensions(mechanism)["loads.0.force"] == -100.0
    turned = planar.forces(planar.solve(mechanism, {"A": 0.05}))
    constant = planar.forces(planar.solve(planar.from_dict(levers(75.0, 0.0)), {"A": 0.05}))
    assert turned.inputs["A"] == pytest.approx(constant.inputs["A"], rel=1e-12)
    slope = planar.sensitivity(turned, "A").effort["loads.0.force"]
    assert slope == pytest.approx(turned.inputs["A"] / -100.0, rel=1e-9)
    with pytest.raises(BadInput, match="a force acts between two different points") as refused:
        planar.from_dict(levers(1.0, 1.0, loads=[{"points": ["H", "H"], "force": 1.0}]))
    assert refused.value.place == "$.loads[0].points"
    with pytest.raises(BadInput, match="a 'force' at a 'point' or between two 'points'"):
        planar.from_dict(levers(1.0, 1.0, loads=[{"points": ["H", "L"], "point": "H", "force": 1.0}]))


def test_a_force_between_points_that_coincide_has_no_direction():
    value = levers(1.0, 1.0, loads=[{"points": ["upper jaw.C", "lower jaw.C"], "force": 1.0}])
    with pytest.raises(NoAnswer, match="a spring, a damper or a load acts coincide here"):
        planar.forces(solved(value))


def test_a_force_between_two_points_drives_a_simulation_with_its_work():
    """Two masses pressed apart on a line: each moves by F t^2 / 2 m."""
    links = {name: {"points": {point: [0, 0]}} for name, point in (("a", "P"), ("b", "Q"))}
    value = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, **links},
        "pairs": [
            {"sliding": name, "links": ["f", name], "line": {"through": "O"}, "point": point}
            for name, point in (("a", "P"), ("b", "Q"))
        ],
        "inputs": [{"pair": "a", "position": 0.0}, {"pair": "b", "position": 1.0}],
        "loads": [{"points": ["P", "Q"], "force": 6.0}],
        "masses": [{"link": "a", "mass": 2.0, "at": "P"}, {"link": "b", "mass": 3.0, "at": "Q"}],
    }
    found = planar.simulate(planar.from_dict(value), 0.5, 4)
    time = found.motion.time
    np.testing.assert_allclose(found.motion.inputs["a"].position, -1.5 * time**2, atol=1e-12)
    np.testing.assert_allclose(found.motion.inputs["b"].position, 1.0 + time**2, atol=1e-12)
    assert found.balance < 1e-12


def epicyclic(teeth: bool, **changes: Any) -> Value:
    """A sun of 40 inside an annulus of 80, which is the frame; the arm is loaded with 300 N m."""
    sizes = (
        ({"teeth": [40, 20]}, {"teeth": [-80, 20]}) if teeth else ({"radii": [0.04, 0.02]}, {"radii": [-0.08, 0.02]})
    )
    return {
        "planar": 1,
        "frame": "annulus",
        "links": {
            "annulus": {"points": {"O": [0.1, 0.2]}},
            "sun": {"points": {"O": [0, 0]}},
            "arm": {"ends": ["O", "P"], "length": 0.06},
            "planet": {"points": {"P": [0, 0]}},
        },
        "pairs": [
            {"turning": "O", "links": ["annulus", "sun", "arm"]},
            {"turning": "P"},
            {"gear": "inner", "links": ["sun", "planet"], "carrier": "arm", **sizes[0]},
            {"gear": "outer", "links": ["annulus", "planet"], "carrier": "arm", **sizes[1]},
        ],
        "inputs": [{"pair": "O:annulus,sun", "position": 0.3, "velocity": 10.0}],
        "loads": [{"link": "arm", "torque": -300.0}],
        **changes,
    }


@pytest.mark.parametrize("sizes", ["teeth", "radii", "ratio"])
def test_the_annulus_of_an_epicyclic_train_is_held_with_what_arm_and_sun_differ_by(sizes):
    """Torques of sun, arm and annulus add up to nothing: 100 drives, 300 is taken off, 200 holds."""
    value = epicyclic(sizes == "teeth")
    if sizes == "ratio":  # only couples are known then
        for pair, ratio in zip(value["pairs"][2:], (-2.0, 4.0), strict=True):
            pair |= {"ratio": ratio}
            del pair["radii"]
    found = planar.forces(solved(value))
    assert found.inputs["O:annulus,sun"] == pytest.approx(100.0, rel=1e-12)
    assert {*found.fixed_wheels} == {"O"}
    wheel = found.fixed_wheels["O"]
    assert wheel.torque == pytest.approx(200.0, rel=1e-12)
    assert {*wheel.shares} == {"outer"}
    assert wheel.centre == pytest.approx([0.1, 0.2])
    over = planar.forces(planar.cycle(planar.from_dict(value), 4))
    np.testing.assert_allclose(over.fixed_wheels["O"].torque, 200.0, rtol=1e-12)


def test_the_holding_torque_is_the_effort_of_the_wheel_as_a_second_input_at_rest():
    """With a loss in both meshes as well, and with three planets, which share it."""
    value = epicyclic(False)
    for pair in value["pairs"][2:]:
        pair["efficiency"] = 0.95
    held = planar.forces(solved(value)).fixed_wheels["O"].torque
    value["links"] |= {"base": {"points": {"O": [0.1, 0.2]}}, "annulus": {"points": {"O": [0, 0]}}}
    value |= {"frame": "base"}
    value["pairs"][0]["links"] = ["base", "annulus", "sun", "arm"]
    value["inputs"] = [
        {"pair": "O:base,sun", "position": 0.3, "velocity": 10.0},
        {"pair": "O:base,annulus", "position": 0.0},
    ]
    assert planar.forces(solved(value)).inputs["O:base,annulus"] == pytest.approx(held, rel=1e-9)


def test_a_stop_carries_the_effort_of_the_input_that_is_released():
    """Of two inputs each is released in turn, but one at its stop is the one that is released."""
    links = {"f": {"points": {"O": [0, 0]}}, "a": {"ends": ["O", "A"], "length": 1.0}}
    links["b"] = {"ends": ["A", "B"], "length": 0.5}
    value = {
        "planar": 1,
        "frame": "f",
        "links": links,
        "pairs": [{"turning": "O", "stops": [-0.5, 0.0]}, {"turning": "A"}],
        "inputs": [{"pair": "O", "position": 0.0}, {"pair": "A", "position": 0.0}],
        "loads": [{"point": "B", "force": [0, 10]}],
    }
    found = planar.forces(solved(value))
    assert found.inputs["O"] == pytest.approx(-15.0)
    assert {name: dict(of) for name, of in found.stop_loads.items()} == {"O": {"O": pytest.approx(-15.0)}}
    assert found.stops == {"O": pytest.approx(-15.0)}
    value["loads"][0]["force"] = [0, -10]
    assert planar.forces(solved(value)).stops == {"O": 0.0}


# other routes


@pytest.mark.parametrize("stem", part(MODELS, 3, 1))
def test_random_loads_on_every_model_are_held_by_the_multipliers_of_its_inputs(stem):
    """Equilibrium of all links with unknown forces in all pairs, nothing eliminated."""
    found = planar.forces(solve(loaded(MODELS[stem], 1)))
    assert found.proof.routes is not None
    assert found.proof.routes < EXACT
    proved(found, EXACT)


def proved(found, within):
    """Every law is kept that says something; all links are proved but those that feel what is named undetermined."""
    mechanism = found.mechanism
    blind = {link for pair in mechanism.pairs if pair.name in found.undetermined for link in pair.bodies}
    assert set(found.bodies) == {link.name for link in mechanism.links} - blind - {mechanism.frame}
    assert found.proof.equilibrium is None if not found.bodies else found.proof.equilibrium < within
    assert found.proof.power is None or found.proof.power < within
    if found.proof.routes is None:
        greatest = max(hypot(*each.force) for each in found.loads)
        assert all(abs(effort) < 1e-9 * greatest for effort in found.inputs.values())
    else:
        assert found.proof.routes < within


def random_state(seed):
    """The first linkage from a seed on that has a position with rates, with loads."""
    for each in range(seed, seed + 1200, 100):
        try:
            return solve(loaded(planar.from_dict(random_linkage(each, 2 + seed % 6, higher=0.3).value), each))
        except NoAnswer:
            continue
    raise AssertionError(f"none of the linkages from {seed} on has a position")


@pytest.mark.parametrize("seed", first_cases(range(12), 5))
def test_random_linkages_too(seed):
    state = random_state(seed)
    proved(planar.forces(state), 1e-8)


@pytest.mark.parametrize(
    "stem", ["000-P1", "double-butterfly", "planetary-gear-set", "rack-steering", "scotch-yoke", "open-arm"]
)
def test_efforts_are_the_slope_of_the_work_of_the_loads(stem):
    mechanism = loaded(MODELS[stem], 3)
    for name, effort in planar.forces(solve(mechanism)).inputs.items():
        assert by_difference(mechanism, name, 1e-5) == pytest.approx(effort, rel=1e-5, abs=1e-3)


def test_each_cylinder_of_an_excavator_holds_its_share_at_order_two():
    mechanism = replace(MODELS["excavator-arm"], loads=(Load("tip", (-5e4, 3e4)), Load(link="bucket", torque=2e3)))
    found = planar.forces(solve(mechanism))
    assert len(found.inputs) == 3
    for name, effort in found.inputs.items():
        assert found.is_force_input(name)
        assert abs(effort) > 1e3
        wide, narrow = (by_difference(mechanism, name, step) - effort for step in (0.02, 0.01))
        assert wide / narrow == pytest.approx(4.0, rel=0.05)
    assert found.proof.power < EXACT


# laws


@near
@given(angle=st.floats(0.2, 2.9), turned=st.floats(-3.0, 3.0), force=st.floats(-100, 100), way=st.floats(-3, 3))
def test_efforts_do_not_depend_on_the_axes(angle, turned, force, way):
    def effort(by: float) -> float:
        pushed = [force * cos(way + by), force * sin(way + by)]
        mid = {"point": "A", "force": [-3.0 * sin(by), 3.0 * cos(by)]}
        return planar.forces(solved(pushed_crank(angle, [{"point": "B", "force": pushed}, mid], turned=by))).inputs["O"]

    assert effort(turned) == pytest.approx(effort(0.0), rel=1e-9, abs=1e-9)


def test_efforts_add_up_and_need_no_speed():
    mechanism = loaded(MODELS["excavator-arm"], 5)
    whole = planar.forces(solve(mechanism)).inputs
    parts = [planar.forces(solve(replace(mechanism, loads=(load,)))).inputs for load in mechanism.loads]
    held = replace(mechanism, inputs=tuple(each._replace(velocity=0.0) for each in mechanism.inputs))
    resting = planar.forces(solve(held))
    for name, effort in whole.items():
        assert sum(part[name] for part in parts) == pytest.approx(effort, rel=1e-10)
        assert resting.inputs[name] == pytest.approx(effort, rel=1e-12)
    assert resting.proof.power is None
    assert resting.power_in == resting.power_out == 0.0


def test_without_loads_every_effort_is_zero():
    found = planar.forces(state_of("four-bar"))
    assert set(found.inputs.values()) == {0.0}
    assert found.loads == ()
    assert found.proof == (None, None, None)


def test_a_force_on_the_frame_costs_nothing():
    state = solved(pushed_crank(0.7, [{"point": "O", "force": [1e5, 1e5]}, {"link": "frame", "torque": 1e5}]))
    assert planar.forces(state).inputs["O"] == 0.0


# mechanical advantage


@pytest.mark.parametrize("stem", part(ONE_INPUT, 3))
def test_the_advantage_of_everything_is_the_same_by_power_and_by_centres(stem):
    state = state_of(stem)
    told = 0
    for over in advantages(state, (*state.points, *state.links, *state.pairs)).values():
        (found,) = over.values()
        if found.by_power is None:
            assert found.by_centres is None
            assert " here however " in found.why
            continue
        told += 1
        assert found.why == ""
        assert found.by_centres == pytest.approx(found.by_power, rel=1e-9)
    assert told


def test_the_advantage_of_a_load_is_along_the_load_and_that_of_its_point_along_the_path():
    """The handle turns about A: H goes square to AH, and the load is square to the handles."""
    value = levers(1.0, 1.0, loads=[{"point": "H", "force": [0, -45]}, {"points": ["P", "Q"], "force": 3.0}])
    found = advantages(solved(value))
    assert list(found) == ["H", "loads.0", "P,Q"]
    path, load, line = (over["A"] for over in found.values())
    assert (path.along, load.along, line.along) == ("path", "loads.0", "line")
    assert (path.target, load.target, line.target) == ("H", "H", "P,Q")
    assert path.by_power == pytest.approx(1.0 / hypot(0.42, 0.06), rel=1e-12)
    assert load.by_power == pytest.approx(1.0 / 0.42, rel=1e-12)
    assert line.by_power == pytest.approx(-20.0 / 0.42, rel=1e-12)
    for each in (path, load, line):
        assert each.by_centres == pytest.approx(each.by_power, rel=1e-12)
    assert advantage(solved(value), "loads.1").by_power == pytest.approx(line.by_power, rel=1e-12)
    value["loads"] = [{"point": "H", "force": [0.42, -0.06]}]
    assert advantage(solved(value), "loads.0").why.startswith("H does not move along loads.0 here however A moves")


@pytest.mark.parametrize(
    "stem", ["000-P1", "002-E3.1", "double-butterfly", "watt-six-bar", "klann-leg", "crank-rocker"]
)
def test_the_torque_ratio_is_that_of_distances_between_centres(stem):
    """T_o / T_i = w_i / w_o = |I_of I_io| / |I_if I_io|, negative where I_io lies between the other two."""
    mechanism = MODELS[stem]
    (name,) = (given.pair for given in mechanism.inputs)
    driven = next(
        link for link in planar.model.mechanism.relative_motions(mechanism)[name].links if link != mechanism.frame
    )
    state = solve(mechanism)
    centres = planar.centres(state)
    compared = 0
    for link in state.links:
        if link in (mechanism.frame, driven):
            continue
        places = [centres[two].position for two in ((driven, mechanism.frame), (link, mechanism.frame), (driven, link))]
        if any(place is None for place in places):
            continue
        first, second = places[2] - places[0], places[2] - places[1]
        if min(hypot(*first), hypot(*second)) < 1e-6:
            continue
        sign = 1.0 if first @ second > 0 else -1.0
        found = advantage(state, link)
        assert found.by_centres == pytest.approx(sign * hypot(*second) / hypot(*first), rel=1e-8)
        compared += 1
    assert compared


def test_with_several_inputs_each_has_its_own_advantage():
    mechanism = replace(MODELS["excavator-arm"], loads=(Load("tip", (-5e4, 3e4)), Load(link="bucket", torque=1.0)))
    state = solve(mechanism)
    found = advantages(state)
    assert list(found) == ["tip", "loads.0", "bucket"]
    for name in state.inputs:
        unit = unit_rate_state(state, name)
        assert has_length_motion(mechanism, name)
        assert found["tip"][name].by_power == pytest.approx(1 / hypot(*unit.point("tip").velocity), rel=1e-12)
        assert found["tip"][name].by_centres == pytest.approx(found["tip"][name].by_power, rel=1e-9)
        assert found["bucket"][name].by_centres == pytest.approx(1 / unit.link("bucket").angular_velocity, rel=1e-9)
        assert (found["tip"][name].measure, found["bucket"][name].measure) == ("1", "m")
    with pytest.raises(BadInput, match="name it: the inputs are at boom cylinder, stick cylinder and bucket cylinder"):
        advantage(state, "tip")


def test_towards_its_dead_point_a_toggle_grows_without_bound_and_there_it_is_said():
    grown = [advantage(solved(pushed_crank(angle, [])), "B").by_power for angle in (1e-1, 1e-2, 1e-3, 1e-4, 1e-6)]
    assert grown == pytest.approx([1 / speed_ratio(angle) for angle in (1e-1, 1e-2, 1e-3, 1e-4, 1e-6)], rel=1e-8)
    assert grown[-1] > 1e6
    state = solved(pushed_crank(0.0, [{"point": "B", "force": [1e3, 0]}]))
    for output, rest in (("B", "B is at rest"), ("stroke", "pair 'stroke' does not move")):
        there = advantage(state, output)
        assert there.by_power is None
        assert there.by_centres is None
        assert there.why == f"{rest} here however O moves, so that no force at it is too great"
    assert abs(planar.forces(state).inputs["O"]) < 1e-9


def test_on_the_dead_point_of_the_input_itself_there_is_no_effort_to_tell():
    value = pushed_crank(0.0, [{"link": "crank", "torque": 5.0}])
    value["inputs"] = [{"pair": "stroke", "position": 1.3, "velocity": 0.1}]
    with pytest.raises(NoAnswer) as refused:
        planar.forces(solved(value))
    assert refused.value.outcome in (Outcome.DEAD_POINT, Outcome.CANNOT_BE_ASSEMBLED)


def test_more_inputs_than_freedoms_are_refused_with_the_remedy():
    mechanism = MODELS["coupled-wheels"]
    (own,) = mechanism.inputs
    twice = replace(mechanism, inputs=(own, Input("B0", own.position, own.velocity)), loads=(Load("A", (1.0, 0.0)),))
    with pytest.raises(NoAnswer, match="leave out 1 of them") as refused:
        planar.forces(solve(twice))
    assert refused.value.outcome is Outcome.TOO_MANY_INPUTS


@pytest.mark.parametrize(
    ("load", "sentence"),
    [
        (Load(point="X", force=(1.0, 0.0)), "there is no point 'X'"),
        (Load(link="X", torque=1.0), "there is no link 'X'"),
        (Load(point="B"), "one of the two is left out"),
        (Load(torque=1.0), "one of the two is left out"),
        (Load(), "a load is a force at a point, a torque on a link, or an effort at a pair or between two points"),
        (Load(points=("A", "X"), effort=1.0), "there is no point 'X'"),
        (Load(points=("A", "A"), effort=1.0), "two different points"),
        (Load(points=("A", "B")), "one of the two is left out"),
        (Load(points=("A", "B"), pair="A", effort=1.0), "at a pair or between two points, not both"),
        (Load(points=("A", "B"), effort=inf), "finite"),
        (Load(point="B", force=(nan, 0.0)), "finite"),
        (Load(link="crank", torque=inf), "finite"),
    ],
)
def test_loads_made_in_python_are_checked(load, sentence):
    mechanism = replace(planar.from_dict(pushed_crank(0.5, [])), loads=(load,))
    with pytest.raises(BadInput, match=sentence) as refused:
        planar.forces(solve(mechanism))
    assert refused.value.place == "loads[0]"


def test_unknown_outputs_and_inputs_are_named():
    state = state_of("four-bar")
    with pytest.raises(Unknown, match="there is no point, link, pair or load 'nothing'"):
        advantage(state, "nothing")
    with pytest.raises(Unknown, match="there is no input at 'nothing'"):
        advantage(state, next(iter(state.points)), "nothing")


# the whole program


def test_the_program_prints_torque_loads_power_advantage_and_the_slip(tmp_path):
    text = run(tmp_path, "forces", "000-P2").done()
    for line in (
        "O      216.609  N·m      45 deg  18.8496 rad/s  4082.98",
        "D      block D  2000.00      0       -   2.04149  180.000              -  -4082.98",
        "B:AB,BD  BD       AB     2059.15   166.234  -2000.00   489.986       0",
        "D        block D  BD     2059.15   166.234  -2000.00   489.986       0",
        "stroke   block D  frame  489.986  -90.0000         0  -489.986       0",
        "the load at 'D' acts on link 'block D', not on 'BD'; to have it there write 'BD.D'",
        "in: 4082.98 W from the inputs; out: 4082.98 W against the loads",
        "D       its path  O               9.23324     9.23324  N per N·m  I16 I14 I46",
        "D       loads.0   O              -9.23324    -9.23324  N per N·m",
        "links 1 OA, 2 AB, 3 CB, 4 BD, 5 block D and 6 frame",
        "slip in the book",
        "without inertia, weight and friction",
    ):
        assert line in text
    printed = [line for line in text.splitlines() if line.strip().startswith("T_A ") and "input torque" in line]
    assert [line.split()[-1] for line in printed] == ["book", "agrees"]
    assert "velocity of D" not in text


def test_the_program_prints_si_values(tmp_path):
    found = json.loads(run(tmp_path, "forces", "000-P2", "--json").done())
    assert found["inputs"]["O"]["torque"] == pytest.approx(216.6086, abs=1e-4)
    assert found["power"]["in"] == pytest.approx(found["power"]["out"], rel=1e-12)
    assert [(each["kind"], each["name"], each["link"]) for each in found["loads"]] == [("load", "D", "block D")]
    assert [each for each in found["remarks"] if "acts on link 'block D', not on 'BD'" in each]
    assert found["reactions"]["stroke"]["force"] == pytest.approx([0.0, -489.98610015], abs=1e-6)
    assert found["reactions"]["stroke"]["links"] == ["frame", "block D"]
    assert found["advantage"]["D"]["O"]["by_centres"] == pytest.approx(9.23324, abs=1e-5)
    assert max(found["proof"].values()) < EXACT
    assert [each["verdict"] for each in found["published"]] == ["slip in the book", "agrees"]


def test_the_program_moves_an_input_first_and_says_where_loads_drive(tmp_path):
    text = run(tmp_path, "forces", "000-P2", "--at", "O=170deg").done()
    assert "the loads drive: 3111.03 W from the loads, 3111.03 W taken up by the inputs" in text
    assert "Published" not in text
    found = json.loads(run(tmp_path, "forces", "000-P2", "--at", "O=170deg", "--json").done())
    state = solve(MODELS["000-P2"], [Drive("O", radians(170))])
    assert found["inputs"]["O"]["torque"] == pytest.approx(planar.forces(state).inputs["O"], rel=1e-12)


def test_the_program_says_where_loads_are_written(tmp_path):
    sentence = run(tmp_path, "forces", "four-bar").refused(2)
    told = (
        "$.loads: the mechanism has no loads, springs or masses; write forces (N) at points or torques (N m) on links"
    )
    assert sentence.startswith(f"{told}, and masses (kg), as ")
    example = json.loads("{" + sentence.split(" as ")[1].removesuffix(" in its file") + "}")
    value = planar.to_dict(MODELS["four-bar"]) | example
    assert planar.forces(solved(value)).inputs


def test_the_program_prints_forces_of_slides_and_says_what_is_at_rest(tmp_path):
    mechanism = replace(MODELS["excavator-arm"], loads=(Load("tip", (-5e4, 0.0)), Load("T", (1e3, 0.0))))
    (tmp_path / "arm.json").write_text(planar.dumps(mechanism), encoding="utf-8")
    text = run(tmp_path, "forces", "arm.json", "-o", "arm.txt")
    assert (text.status, text.out, text.err) == (0, "", "")
    text = (tmp_path / "arm.txt").read_text(encoding="utf-8")
    assert "T is at rest here however boom cylinder moves, so that no force at it is too great" in text.replace(
        "\n", ""
    )
    assert "nan" not in text
    assert "inf" not in text
    found = json.loads(run(tmp_path, "forces", "arm.json", "--json").done())
    assert set(found["inputs"]) == {"boom cylinder", "stick cylinder", "bucket cylinder"}
    assert all("force" in each and "torque" not in each for each in found["inputs"].values())
    assert found["advantage"]["T"]["boom cylinder"]["by_power"] is None


def test_the_program_ends_with_no_answer_on_a_dead_point(tmp_path):
    value = pushed_crank(pi / 2, [{"point": "A", "force": [5.0, 1.0]}], r=0.3, rod=1.0)
    value["inputs"] = [{"pair": "stroke", "position": 1.3}]
    (tmp_path / "dead.json").write_text(json.dumps(value), encoding="utf-8")
    ended = run(tmp_path, "forces", "dead.json", "--json")
    assert ended.status == 1
    assert json.loads(ended.out)["outcome"] == "dead point"


def test_the_equations_are_set_up_once_wherever_inputs_stand_and_however_fast_they_run(monkeypatch):
    """Setting them up takes ten times as long as a position; also loads that vary are none of their business."""
    virtual_work._cached_balance_equations.cache_clear()  # other tests may have set them up before
    made = []
    kept = BalanceEquations.__init__
    monkeypatch.setattr(BalanceEquations, "__init__", lambda self, work: (made.append(work), kept(self, work))[1])
    engine = replace(MODELS["two-stroke-engine"], gravity=(0.0, -9.81))
    found = [planar.forces(solve(engine, {"O": angle})).inputs["O"] for angle in (0.3, 0.9, 2.1)]
    faster = replace(engine, inputs=(engine.inputs[0]._replace(velocity=10.0),))
    found.append(planar.forces(solve(faster)).inputs["O"])
    assert len(made) == 1
    assert len(set(found)) == 4
    # nor is what acts
    planar.forces(solve(replace(engine, loads=())))
    assert len(made) == 1


def two_slots(first: dict[str, Any]) -> dict[str, Any]:
    """A body on two upright lines, by `first` on the left one and by a pin in a slot on the other, under a couple."""
    return {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"P": [0, 0], "Q": [2, 0]}}, "b": {"points": {"F": [0, 0], "G": [2, 0]}}},
        "pairs": [
            {"links": ["f", "b"], "line": {"through": "P", "angle": pi / 2}, "point": "F"} | first,
            {"slot": "q", "links": ["f", "b"], "line": {"through": "Q", "angle": pi / 2}, "point": "G"},
        ],
        "inputs": [{"pair": "p", "position": 0.3}],
        "loads": [{"link": "b", "torque": 5.0}],
    }


def test_a_couple_that_slots_cannot_bear_gets_a_remedy_that_helps():
    """Both normal forces lie in one line wherever the body stands: moving it helps nothing."""
    mechanism = planar.from_dict(two_slots({"slot": "p"}))
    with pytest.raises(NoAnswer, match="wherever the inputs are the pairs hold link 'b' to second order") as refused:
        planar.forces(solve(mechanism))
    helps = "have a pair that bears couples too, as a sliding pair, in place of 'p' or 'q'"
    assert refused.value.reason.endswith(helps)
    over = planar.forces(planar.cycle(mechanism, 4, start=0.0, stop=1.0)).undetermined["p"]
    assert "wherever the inputs are" in over
    assert "dead point" not in over
    # as is said
    held = planar.forces(solve(planar.from_dict(two_slots({"sliding": "p", "turn": -pi / 2}))))
    assert held.reactions["p"].couple == pytest.approx(-5.0, abs=1e-12)
    assert held.inputs["p"] == pytest.approx(0.0, abs=1e-12)
