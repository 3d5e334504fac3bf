"""Friction in pairs: closed forms of textbooks, laws over random linkages, every solution beside another route."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product
from math import acos, asin, atan, atan2, cos, hypot, pi, sin, sqrt, tan

import numpy as np
import pytest

import planar
from planar.drawing.forces.free_bodies import free_bodies
from planar.drawing.paper.picture import Arrow, Circle
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.friction.all_solutions import find_all_solutions
from planar.dynamics.friction.contact_rows import ContactRows
from planar.dynamics.friction.contact_system import ContactSystem
from planar.dynamics.friction.frictionless_path import follow_from_frictionless
from planar.dynamics.friction.single_solution import has_single_solution, solve_contraction
from planar.dynamics.reaction_solver import fill_balance
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.model.mechanism import Drive, replace_inputs
from planar.model.pairs.rubbing import Friction
from tests.draws import part
from tests.rubbing import crank_and_slider, gear_train, incline, rubbing_linkage

EXACT = 1e-10


def forces_of(mechanism, **more):
    return planar.forces(planar.solve(mechanism), **more)


@pytest.mark.parametrize("velocity", [2.0, -2.0])
@pytest.mark.parametrize(("angle", "mu"), [(0.3, 0.1), (0.9, 0.4), (-0.4, 0.7)])
def test_on_an_incline_friction_is_mu_times_the_part_of_the_weight_across_it(angle, mu, velocity):
    found = forces_of(incline(angle, mu, velocity))
    sense = np.sign(velocity)
    assert found.inputs["S"] == pytest.approx(100 * (sin(angle) + sense * mu * cos(angle)), rel=1e-12)
    assert found.heat["S"] == pytest.approx(mu * 100 * cos(angle) * 2.0, rel=1e-12)
    assert found.frictionless.inputs["S"] == pytest.approx(100 * sin(angle), rel=1e-12)
    held = planar.holding(found.moving)
    assert (held.low, held.high) == pytest.approx([100 * (sin(angle) + s * mu * cos(angle)) for s in (-1, 1)])
    assert held.is_self_locking == (abs(angle) <= atan(mu))
    assert held.is_proved


def test_at_rest_the_coefficient_at_rest_counts():
    found = planar.holding(planar.solve(incline(0.3, 0.1, 0.0, static_friction=0.2)))
    assert found.high - found.low == pytest.approx(2 * 0.2 * 100 * cos(0.3))
    resting = forces_of(incline(0.3, 0.1, 0.0))
    assert resting.inputs["S"] == pytest.approx(100 * sin(0.3))
    assert "nothing moves that rubs" in resting.remarks[0]
    assert not resting.friction


def test_where_a_motion_dwells_friction_is_not_told():
    mechanism = incline(0.3, 0.1, 0.0)
    law = [{"motion": "constant speed", "by": 1.0, "in": 1.0}, {"motion": "dwell", "in": 1.0}]
    value = planar.to_dict(mechanism)
    value["inputs"][0] = {"pair": "S", "position": 0.0, "law": law}
    found = planar.forces(planar.cycle(planar.from_dict(value), steps=8))
    assert found.inputs["S"][:4] == pytest.approx(100 * (sin(0.3) + 0.1 * cos(0.3)))
    assert np.isnan(found.inputs["S"][5:]).all()
    assert "friction has no sense" in found.undetermined["S"]


@pytest.mark.parametrize(("length", "jams"), [(0.30, True), (0.50, False)])
def test_a_drawer_pulled_beside_its_middle_jams_where_it_is_shorter_than_two_mu_times_the_arm(length, jams):
    """A load F at an arm a presses F a / L on both ends: it pulls the drawer if F > 2 mu F a / L, or L > 2 mu a."""
    mechanism = incline(0.0, 0.4, 1.0, guide_length=length)
    pulled = replace(mechanism, loads=(planar.Load("P", (100.0, 0.0)),))
    found = forces_of(pulled)
    assert found.inputs["S"] == pytest.approx(-100.0 + 2 * 0.4 * 100 * 0.5 / length)
    assert found.friction["S"].side == "tilted clockwise, bears at both ends"
    assert planar.holding(found.moving).is_self_locking == jams == (length < 2 * 0.4 * 0.5)


@pytest.mark.parametrize("velocity", [1.0, -1.0])
def test_the_faces_of_a_guide_give_friction_an_arm(velocity):
    """The lower face presses up: friction at 50 mm below the line has 1.5 N m, which 20 mm bear by 75 N up and down."""
    found = forces_of(incline(0.0, 0.3, velocity, guide_length=0.02, guide_width=0.1))
    assert found.inputs["S"] == pytest.approx(velocity * 0.3 * (125.0 + 25.0))
    assert "both ends" in found.friction["S"].side
    longer = forces_of(incline(0.0, 0.3, velocity, guide_length=0.4, guide_width=0.1))
    assert longer.inputs["S"] == pytest.approx(velocity * 0.3 * 100.0)


@pytest.mark.parametrize("velocity", [3.0, -3.0])
def test_a_lever_on_a_pin_takes_the_load_at_its_arm_and_the_radius_of_the_friction_circle(velocity):
    lever = planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {"f": {"points": {"O": [0, 0]}}, "lever": {"ends": ["O", "P"], "length": 0.4}},
            "pairs": [{"turning": "O", "pin_diameter": 0.04, "friction": 0.25}],
            "inputs": [{"pair": "O", "position": 0.6, "velocity": velocity}],
            "loads": [{"point": "P", "force": [0, -500]}],
        }
    )
    found = forces_of(lever)
    circle = 0.02 * sin(atan(0.25))
    assert found.inputs["O"] == pytest.approx(500 * 0.4 * cos(0.6) + np.sign(velocity) * 500 * circle, rel=1e-13)
    assert lever.pairs[0].friction_circle_radius() == pytest.approx(circle)
    assert planar.sweep(lever, {"O.friction": [0.0, 0.25]}, steps=2, start=0.6, stop=0.6 + 1e-9, efforts=["O"]).effort[
        "O"
    ][:, 0] == pytest.approx([500 * 0.4 * cos(0.6), found.inputs["O"]])


@pytest.mark.parametrize("velocity", [10.0, -10.0])
@pytest.mark.parametrize("angle", [0.5, 1.2, 2.3, 3.6, 5.0])
def test_a_slider_crank_is_that_of_the_drawn_line_tangent_to_friction_circles(angle, velocity):
    """The rod's line of force touches the circles at both its pins, on the sides that resist turning (J. E. Shigley,
    J. J. Uicker, Theory of Machines and Mechanisms, section on friction forces): by geometry alone."""
    radius, mu, load = 0.01, 0.15, 1000.0
    found = forces_of(crank_and_slider(radius, mu, angle, velocity))
    circle, phi = radius * sin(atan(mu)), atan(mu)
    a = np.array([0.05 * cos(angle), 0.05 * sin(angle)])
    b = np.array([a[0] + sqrt(0.15**2 - a[1] ** 2), 0.0])
    rod_rate = -velocity * 0.05 * cos(angle) / (b[0] - a[0])
    slide = -velocity * 0.05 * sin(angle) + rod_rate * a[1]
    at_a, at_b = np.sign(rod_rate - velocity), np.sign(-rod_rate)
    # the crank's push F u on the rod has the moment -at_a F c about A, the rod's on the block -at_b F c about B
    tilt = asin((at_b - at_a) * circle / 0.15)
    line = atan2(b[1] - a[1], b[0] - a[0]) + tilt
    push = np.array([cos(line), sin(line)])
    # the block: push of the rod, load, guide under the angle of friction against its motion
    side = np.sign(push[1])
    guide = np.array([-np.sign(slide) * sin(phi), -side * cos(phi)])
    strength = np.linalg.solve(np.array([push, guide]).T, [load, 0.0])[0]
    assert strength > 0.0
    foot = a - at_a * circle * np.array([push[1], -push[0]])
    moment = (foot[0] * push[1] - foot[1] * push[0]) * strength + np.sign(velocity) * strength * circle
    assert found.inputs["O"] == pytest.approx(moment, rel=1e-12)
    assert hypot(*found.reactions["A"].force) == pytest.approx(strength, rel=1e-12)


def test_the_screw_jack_is_the_wedge_of_statics():
    lead, phi = atan(8 / (40 * pi)), atan(0.12)
    state = planar.solve(planar.load("screw-jack"))
    found, held = planar.forces(state), planar.holding(state)
    assert found.inputs["turn"] == pytest.approx(-1e4 * tan(lead + phi), rel=1e-12)
    assert found.efficiency == pytest.approx(tan(lead) / tan(lead + phi), rel=1e-12)
    assert (held.low, held.high) == pytest.approx((-1e4 * tan(lead + phi), 1e4 * tan(phi - lead)), rel=1e-12)
    assert held.is_self_locking and held.is_proved


def test_the_toggle_clamp_holds_itself_until_its_line_of_force_leaves_the_friction_circle():
    """Opening: the strut's line crosses between the circles of A and B, and touches that of O."""
    clamp = planar.load("toggle-clamp")
    first, second = planar.self_locking(planar.cycle(clamp, steps=72))
    circle = 0.005 * sin(atan(0.15))

    def miss(angle):
        """How far off the circle of O the strut's line is, where the handle opens anticlockwise."""
        a = np.array([0.04 * cos(angle), 0.04 * sin(angle)])
        b = np.array([a[0] + sqrt(0.06**2 - a[1] ** 2), 0.0])
        # the handle turns on, the strut back: at A the block's push holds back the one, at B the other
        line = atan2(a[1] - b[1], a[0] - b[0]) + asin(2 * circle / 0.06)
        foot = a + circle * np.array([-sin(line), cos(line)])
        return abs(foot[0] * sin(line) - foot[1] * cos(line)) - circle

    opened = second.stop - 2 * pi
    assert second.start - 2 * pi == pytest.approx(-opened, rel=1e-9)
    assert min(abs(miss(opened)), abs(miss(-opened))) < 1e-12
    assert first.start + first.stop == pytest.approx(2 * pi)
    assert all(each.start_is_solved and each.stop_is_solved for each in (first, second))


def test_the_part_of_a_load_that_is_held_is_the_effort_by_what_the_whole_load_wants():
    state = planar.solve(planar.load("toggle-clamp"))
    held, part = planar.holding(state), planar.holding(state, "B", -55.0)
    assert (part.low, part.high) == pytest.approx((-55.0 / held.low, -55.0 / held.high), rel=1e-9)
    assert part.is_self_locking and part.is_proved and part.load == "B"
    jack = planar.holding(planar.solve(planar.load("screw-jack")), "B", -1000.0)
    assert (jack.low, jack.high) == (pytest.approx(1000.0 / (1e4 * tan(atan(8 / (40 * pi)) + atan(0.12)))), np.inf)
    with pytest.raises(BadInput, match="no load on 'A'"):
        planar.holding(state, "A")


@pytest.mark.parametrize(("kind", "ratio"), [("gear", -0.4), ("belt", 0.4), ("inside", 0.4), ("round", 2.5)])
@pytest.mark.parametrize(("velocity", "load"), [(2.0, 30.0), (2.0, -30.0), (-2.0, 30.0)])
def test_the_efficiency_of_a_mesh_or_belt_is_of_the_power_from_whichever_side_drives(kind, ratio, velocity, load):
    """Both wheels outside, one inside the other, or the other round the one."""
    teeth = {"inside": {"gear": "G", "teeth": [20, -50]}, "round": {"gear": "G", "teeth": [-50, 20]}}
    mesh = teeth.get(kind) or {kind: "G"}
    found = forces_of(gear_train(velocity, load, **mesh, efficiency=0.8))
    first_drives = load * ratio * velocity < 0.0
    assert found.friction["G"].side == ("a drives" if first_drives else "b drives")
    assert found.inputs["A"] == pytest.approx(-load * ratio * (1 / 0.8 if first_drives else 0.8), rel=1e-12)
    assert found.efficiency == pytest.approx(0.8, rel=1e-12)
    assert found.proof.equilibrium is None or found.proof.equilibrium < EXACT


@pytest.mark.parametrize("velocity", [2.0, -2.0])
def test_rubbing_teeth_lose_what_niemann_says(velocity):
    """mu (pi / 2)(1/z1 + 1/z2) of the power W v between the pitch circles, of which the first is at 100 mm."""
    found = forces_of(gear_train(velocity, 30.0, gear="G", friction=0.08))
    power = abs(found.reactions["G"].force[1]) * 0.1 * 2.0
    assert found.heat["G"] == pytest.approx(0.08 * pi / 2 * (1 / 20 + 1 / 50) * power, rel=1e-12)
    assert found.proof.equilibrium < EXACT


def pinion_and_rack(velocity, load, **mesh):
    """A pinion of 100 mm that draws a rack against a force (N)."""
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {
                "f": {"points": {"O": [0, 0], "G": [0, -0.1]}},
                "w": {"points": {"O": [0, 0]}},
                "r": {"points": {"P": [0, 0]}},
            },
            "pairs": [
                {"turning": "O"},
                {"sliding": "S", "links": ["f", "r"], "line": {"through": "G"}, "point": "P"},
                {
                    "rack": "R",
                    "links": ["r", "w"],
                    "line": {"through": "P"},
                    "point": "O",
                    "radius": 0.1,
                    **mesh,
                },
            ],
            "inputs": [{"pair": "O", "position": 0, "velocity": velocity}],
            "loads": [{"point": "P", "force": [load, 0]}],
        }
    )


@pytest.mark.parametrize(("velocity", "load"), [(1.0, 50.0), (1.0, -50.0), (-1.0, 50.0)])
def test_a_rack_has_its_efficiency_either_way(velocity, load):
    found = forces_of(pinion_and_rack(velocity, load, efficiency=0.9))
    without = found.frictionless.inputs["O"]
    assert abs(without) == pytest.approx(abs(load) * 0.1)
    drives = without * velocity > 0.0
    assert found.inputs["O"] == pytest.approx(without / 0.9 if drives else without * 0.9, rel=1e-12)
    assert found.friction["R"].side == ("w drives" if drives else "r drives")


@pytest.mark.parametrize(("velocity", "load"), [(1.0, 50.0), (-1.0, 50.0)])
def test_teeth_on_a_rack_lose_what_those_on_a_wheel_beyond_all_bounds_do(velocity, load):
    """mu (pi / 2) / z of the power F v of the teeth, the second wheel's 1 / z being none."""
    found = forces_of(pinion_and_rack(velocity, load, teeth=20, friction=0.08))
    assert found.heat["R"] == pytest.approx(0.08 * pi / 2 / 20 * 50.0 * 0.1, rel=1e-12)
    assert found.proof.equilibrium < EXACT


@cache
def linkage(seed):
    mechanism = rubbing_linkage(seed, 0.3)
    try:
        return planar.solve(mechanism)
    except NoAnswer:
        return None


def told(state):
    try:
        found = planar.forces(state)
    except NoAnswer as refused:
        assert refused.outcome in (Outcome.INPUT_JAMMED, Outcome.DEAD_POINT)
        return None
    return found if found.friction and not found.undetermined else None


seeds = pytest.mark.parametrize("seed", part(range(60), 15))


@seeds
def test_power_balances_with_the_heat_in_every_solution_on_random_linkages(seed):
    state = linkage(seed)
    found = state and told(state)
    if not found:
        pytest.skip("nothing is told of friction")
    assert found.solutions[0] is found
    for each in found.solutions:
        assert all(worst is None or worst < EXACT for worst in each.proof)
        assert each.heat_flow >= 0.0
        assert all(heat >= -EXACT * each.heat_flow for heat in each.heat.values())


@seeds
def test_small_friction_is_nearly_none_and_no_friction_is_none(seed):
    state = linkage(seed)
    found = state and told(state)
    if not found:
        pytest.skip("nothing is told of friction")
    mechanism = state.mechanism
    numbers = {
        name: 1.0 - 1e-7 if name.endswith("efficiency") else 1e-7
        for name in planar.dimensions(mechanism)
        if name.rpartition(".")[2] in ("friction", "efficiency")
    }
    nearly = planar.forces(planar.solve(mechanism.with_values(numbers)))
    scale = max(1.0, *(float(np.hypot(*each.force)) for each in nearly.reactions.values()))
    for name, effort in found.frictionless.inputs.items():
        assert nearly.inputs[name] == pytest.approx(effort, abs=1e-4 * scale)
    assert planar.forces(state, friction=False).inputs == found.frictionless.inputs


@seeds
def test_run_back_friction_turns_round_and_wants_no_less(seed):
    state = linkage(seed)
    found = state and told(state)
    if not found or len(state.mechanism.inputs) != 1 or found.solution_count != 1:
        pytest.skip("nothing is told of friction, or there are several inputs")
    mechanism = state.mechanism
    (given,) = mechanism.inputs
    back = planar.solve(replace_inputs(mechanism, (Drive(given.pair, None, -given.velocity, given.acceleration),)))
    again = planar.forces(replace(back), friction=False)
    # velocities enter inertia by their squares: without friction nothing changes
    assert again.inputs[given.pair] == pytest.approx(found.frictionless.inputs[given.pair], rel=1e-8)
    other = told(back)
    if other:
        assert {name: -each.sense for name, each in other.friction.items()} == {
            name: each.sense for name, each in found.friction.items()
        }
        assert np.sign(given.velocity) * (found.inputs[given.pair] - other.inputs[given.pair]) > -1e-9


def brute_solutions(system):
    """Each side and sense by itself is a linear system, of which those count that bear as they say; pins rub not."""
    count, width = system.loads.shape[1:]
    sides = [1 if signed else width for signed in system.is_signed]
    found = []
    for case in product(*map(range, sides)):
        rows = np.arange(count), np.array(case)
        matrix = np.eye(count) + system.slopes[0][rows]
        if abs(np.linalg.det(matrix)) > 1e-12:
            y = np.linalg.solve(matrix, system.loads[0][rows])
            if system.errors(y[None])[0] < 1e-10 and not any(np.allclose(y, each, 1e-8) for each in found):
                found.append(y)
    return found


def same_solutions(found, brute):
    assert found.is_complete
    assert len(found.y) == len(brute)
    for y in brute:
        assert np.abs(found.y - y).max(axis=1).min() <= 1e-8 * np.abs(y).max()


@pytest.mark.parametrize("seed", range(12))
def test_every_contact_case_solved_by_itself_gives_the_same_solutions(seed):
    rng = np.random.default_rng(seed)
    count = 2 + seed % 3
    loads, slopes = rng.normal(size=(1, count, 2)), rng.normal(size=(1, count, 2, count)) * rng.uniform(0.1, 0.8)
    both = np.concatenate([loads, -loads], axis=2), np.concatenate([slopes, -slopes], axis=2)
    none = np.zeros(count, dtype=bool)
    system = ContactSystem(*both, none, none, ~none)
    same_solutions(find_all_solutions(system), brute_solutions(system))


@pytest.mark.parametrize("seed", part(range(80), 20))
def test_so_it_does_for_the_guides_slots_and_meshes_of_random_linkages(seed):
    """With much friction, so that there are several solutions and none: 0 to 3 among these."""
    state = linkage(seed)
    if state is None:
        pytest.skip("it cannot be assembled")
    rng = np.random.default_rng(seed)
    pairs = tuple(
        replace(pair, friction=None)
        if isinstance(pair, planar.TurningPair)
        else replace(pair, friction=Friction(float(rng.uniform(0.3, 2.0))))
        if pair.friction is not None
        else pair
        for pair in state.mechanism.pairs
    )
    state = planar.solve(replace(state.mechanism, pairs=pairs))
    field = KinematicArrays(state)
    rows = ContactRows(fill_balance(field, np.zeros(1), True), field)
    if not rows.rubbing_pairs or not rows.is_determined().all() or len(rows.contacts) > 7:
        pytest.skip("nothing rubs, or it is not determined")
    system, _ = rows.system(rows.senses())
    same_solutions(find_all_solutions(system), brute_solutions(system))


def one_pin(load, slope):
    """y = |load - slope y|."""
    none = np.zeros(1, dtype=bool)
    return ContactSystem(np.array([[[load, 0.0]]]), np.array([[[[slope], [0.0]]]]), ~none, none, ~none)


def test_one_contact_has_one_solution_or_two_or_none():
    assert find_all_solutions(one_pin(2.0, 0.5)).y.ravel() == pytest.approx([2.0 / 1.5])
    both = find_all_solutions(one_pin(2.0, 3.0))
    assert sorted(both.y.ravel()) == pytest.approx([2.0 / 4.0, 2.0 / 2.0])
    assert follow_from_frictionless(one_pin(2.0, 3.0)).y == pytest.approx([0.5])
    none = find_all_solutions(one_pin(2.0, -3.0))
    assert none.is_complete and not len(none.y)
    end = follow_from_frictionless(one_pin(2.0, -3.0))
    assert end.part == pytest.approx(1.0 / 3.0, abs=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_where_friction_is_weak_there_is_one_solution_however_it_is_found(seed):
    rng = np.random.default_rng(seed)
    loads, slopes = rng.normal(size=(1, 4, 2)), 0.15 * rng.normal(size=(1, 4, 2, 4))
    kinds = np.array([True, True, False, True]), np.array([False, False, True, False])
    system = ContactSystem(loads, slopes, *kinds, np.ones(4, dtype=bool))
    assert has_single_solution(system)
    every = find_all_solutions(system)
    assert every.is_complete and len(every.y) == 1
    assert every.y[0] == pytest.approx(solve_contraction(system)[0], rel=1e-9)
    assert every.y[0] == pytest.approx(follow_from_frictionless(system).y, rel=1e-9)


def test_a_slider_jams_before_its_dead_point_and_says_how_much_friction_it_would_bear():
    """The block drives: where the rod's line of force meets the circle at the crank's pin no push turns it on."""
    driven = crank_and_slider(0.02, 0.3, 1.5, 10.0)
    driven = replace(driven, loads=(planar.Load(link="crank", torque=50.0),), sketch=(("A", 0.04, 0.03),))
    with pytest.raises(NoAnswer) as refused:
        planar.forces(planar.solve(replace(driven, inputs=(planar.Input("S", 0.1999, 0.01),))))
    assert refused.value.outcome is Outcome.INPUT_JAMMED
    assert "% of every coefficient" in str(refused.value)
    motion = planar.cycle(replace(driven, inputs=(planar.Input("S", 0.19, 0.01),)), 12, 0.19, 0.19999)
    found = planar.forces(motion)
    jams = np.isnan(found.inputs["S"])
    assert 0 < jams.sum() < len(motion)
    assert "friction jams it" in found.remarks[0]
    (interval,) = planar.jamming(motion)
    x, circle = interval.start, 0.02 * sin(atan(0.3))
    assert interval.start_is_solved and not interval.stop_is_solved
    # there the rod's line of force, across between the circles at its pins, touches that of the crank's own pin
    rod, crank = acos((x**2 + 0.15**2 - 0.05**2) / (0.3 * x)), acos((x**2 + 0.05**2 - 0.15**2) / (0.1 * x))
    line = -rod + asin(2 * circle / 0.15)
    passes = 0.05 * sin(line - crank) + circle
    assert abs(passes) == pytest.approx(circle, abs=1e-9)


@pytest.mark.parametrize("turned", [0.7, 2.9])
def test_turned_as_a_whole_friction_is_the_same(turned):
    upright = crank_and_slider(0.01, 0.2, 1.0, 5.0, guide_length=0.02, guide_width=0.01)
    value = planar.to_dict(upright)
    c, s = cos(turned), sin(turned)
    slide = next(pair for pair in value["pairs"] if "sliding" in pair)
    slide["line"]["angle"] = f"{turned!r} rad"
    value["inputs"][0]["position"] = f"{1.0 + turned!r} rad"
    value["loads"] = [{"point": "B", "force": [-1000 * c, -1000 * s]}]
    value["sketch"] = {"B": [0.15 * c, 0.15 * s]}
    one, other = forces_of(upright), forces_of(planar.from_dict(value))
    assert other.inputs["O"] == pytest.approx(one.inputs["O"], rel=1e-9)
    assert other.heat == pytest.approx(one.heat, rel=1e-9)
    assert {name: each.side for name, each in other.friction.items()} == {n: e.side for n, e in one.friction.items()}


def test_sweeps_take_friction_as_motions_do():
    mechanism = crank_and_slider(0.01, 0.2, 1.0, 5.0, guide_length=0.03)
    designs = {"rod.length": [0.15, 0.2], "A.friction": [0.1, 0.3], "S.friction": [0.2, 0.05]}
    swept = planar.sweep(mechanism, designs, steps=12, efforts=["O"], reactions=["A"])
    for k in range(2):
        own = mechanism.with_values({name: values[k] for name, values in designs.items()})
        found = planar.forces(planar.cycle(own, steps=12))
        assert swept.effort["O"][k] == pytest.approx(found.inputs["O"], rel=1e-9)
        assert swept.reaction["A"][k] == pytest.approx(found.reactions["A"].force, rel=1e-9, abs=1e-6)


def test_drawn_forces_at_pins_are_tangent_to_their_friction_circles():
    found = forces_of(planar.load("toggle-clamp"))
    pictures, _ = free_bodies(found)
    checked = 0
    for picture in pictures[1:]:
        circles = [mark for mark in picture.marks if isinstance(mark, Circle) and "friction circle" in mark.about]
        arrows = [mark for mark in picture.marks if isinstance(mark, Arrow) and mark.about.startswith("force F")]
        for circle in circles:
            off = []
            for arrow in arrows:
                way = np.subtract(arrow.head, arrow.tail) / np.hypot(*np.subtract(arrow.head, arrow.tail))
                x, y = np.subtract(circle.centre, arrow.tail)
                off.append(abs(way[0] * y - way[1] * x))
            assert min(abs(each - circle.radius) for each in off) < 1e-9
            checked += 1
    assert checked == 5


def test_where_reactions_are_not_determined_friction_is_not_either():
    value = planar.to_dict(crank_and_slider(0.01, 0.2, 1.0, 1.0))
    value["pairs"].append(
        {"slot": "twice", "links": ["f", "block B"], "line": {"through": "O"}, "point": "B", "friction": 0.1}
    )
    found = forces_of(planar.from_dict(value))
    assert np.isnan(found.inputs["O"])
    assert "friction" in found.undetermined["O"]


def test_friction_of_a_pin_without_a_size_is_refused_where_a_mechanism_is_made_in_python():
    bare = crank_and_slider(0.01, 0.2, 1.0, 1.0)
    bare = replace(bare, pairs=(replace(bare.pairs[0], radius=None), *bare.pairs[1:]))
    with pytest.raises(BadInput, match="radius of a pin"):
        forces_of(bare)


@pytest.mark.parametrize(
    ("pair", "where", "words"),
    [
        ({"turning": "O", "friction": 0.1}, "$.pairs[0].friction", "'pin_radius'"),
        ({"turning": "O", "pin_radius": 1, "friction": -0.1}, "$.pairs[0].friction", "zero or more"),
        (
            {"turning": "O", "pin_radius": 1, "static_friction": 0.1},
            "$.pairs[0].static_friction",
            "goes with 'friction'",
        ),
        (
            {"turning": "O", "pin_radius": 1, "friction": 0.2, "static_friction": 0.1},
            "$.pairs[0].static_friction",
            "not below",
        ),
    ],
)
def test_friction_that_cannot_be_meant_is_refused_at_its_place(pair, where, words):
    value = planar.to_dict(planar.load("slider-crank"))
    value["pairs"][0] = pair
    with pytest.raises(BadInput) as refused:
        planar.from_dict(value)
    assert str(refused.value).startswith(where)
    assert words in str(refused.value)
