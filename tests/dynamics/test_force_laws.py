"""Laws that forces keep whatever the mechanism: random linkages and all models, under loads of every kind."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace
from functools import cache
from itertools import product
from math import cos, sin
from typing import Any

import casadi as ca
import numpy as np
import pytest
import scipy.linalg

import planar
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.forces import Forces
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.dynamics.virtual_velocities import has_length_motion
from planar.dynamics.virtual_work import balance_equations
from planar.foundation.errors import NoAnswer
from planar.model.file_units import FileUnits
from planar.model.loads import Load, Mass, Spring
from planar.model.mechanism import Mechanism, named_points
from planar.model.pairs import pair_types
from planar.results.motion import State
from planar.solving.position import PositionSolver, solve
from tests.draws import first_cases, is_exhaustive, part, repeats
from tests.known import MODELS, some_models
from tests.linkages import LIFTING, conditioning, random_linkage

EXACT = 1e-10
WELL = 1e-2
"""Linkages nearer to a dead point than this lose digits by their own conditioning, not by the solver's fault."""


COUNT = 40 if is_exhaustive() else 7
"""Linkages that are made."""


def worked(mechanism: Mechanism, seed: int) -> Mechanism:
    """The mechanism under a load of every kind, springs and dampers of both kinds, masses on all links, and weight."""
    rng = np.random.default_rng(seed)
    links = [link for link in mechanism.links if link.names]
    points = [each.name for each in named_points(mechanism)]
    moving = [link.name for link in links if link.name != mechanism.frame]

    def any_of(names):
        return str(names[int(rng.integers(len(names)))])

    def force():
        x, y = rng.uniform(-300.0, 300.0, 2)
        return float(x), float(y)

    pair = mechanism.inputs[0].pair
    loads = (
        Load(any_of(points), force()),
        Load(any_of(points), force(), axes=any_of(moving)),
        Load(link=any_of(moving), torque=float(rng.uniform(-100.0, 100.0))),
        Load(pair=pair, effort=float(rng.uniform(-100.0, 100.0))),
    )
    ends = [str(each) for each in rng.permutation(points)[:2]]
    springs = [Spring(links=(mechanism.frame, any_of(moving)), stiffness=30.0, free=0.3, damping=2.0)]
    if len(ends) == 2:
        springs.append(Spring(points=(ends[0], ends[1]), stiffness=500.0, free=0.4, damping=20.0))
    masses = tuple(
        Mass(link.name, float(rng.uniform(0.1, 4.0)), link.names[0], float(rng.uniform(0.01, 0.3))) for link in links
    )
    return replace(mechanism, loads=loads, springs=tuple(springs), masses=masses, gravity=(1.5, -9.0))


@cache
def linkages() -> tuple[tuple[dict[str, Any], Mechanism, State], ...]:
    """Well-conditioned random linkages of up to ten links, higher pairs among them, with their file values."""
    found: list[tuple[dict[str, Any], Mechanism, State]] = []
    for seed in range(400):
        if len(found) == COUNT:
            break
        value = random_linkage(seed, 1 + seed % 10, higher=0.3 * (seed % 2)).value
        mechanism = worked(planar.from_dict(value), seed)
        solver = PositionSolver(mechanism)
        try:
            state = solve(mechanism)
        except NoAnswer:
            continue
        if conditioning(solver, solver.find_assembly().z) > WELL:
            found.append((value, mechanism, state))
    return tuple(found)


def written(number: int) -> tuple[dict[str, Any], Mechanism]:
    """A linkage as its file has it, every number bare."""
    value, mechanism, _ = linkages()[number]
    acting = planar.to_dict(mechanism)
    return deepcopy(value) | {key: acting[key] for key in ("loads", "springs", "masses", "gravity")}, mechanism


@cache
def forces_of(number: int) -> Forces:
    return planar.forces(linkages()[number][2])


numbered = pytest.mark.parametrize("number", part(range(COUNT), 4))


def scale_of(found: Forces) -> float:
    told = [np.hypot(*each.force) for each in found.reactions.values()]
    return float(np.nanmax([*told, *map(abs, found.inputs.values())]))


def same(one: Forces, other: Forces, within: float, turned: float = 0.0) -> None:
    """Both give the same efforts and reactions, those of the other in axes turned by an angle."""
    scale = scale_of(one)
    c, s = cos(turned), sin(turned)
    for name, effort in one.inputs.items():
        assert abs(other.inputs[name] - effort) <= within * scale
    for name, each in one.reactions.items():
        again = other.reactions[name]
        force = np.array([c * each.force[0] - s * each.force[1], s * each.force[0] + c * each.force[1]])
        np.testing.assert_allclose(again.force, force, rtol=0.0, atol=within * scale)
        np.testing.assert_allclose(again.couple, each.couple, rtol=0.0, atol=within * scale)
    assert one.undetermined.keys() == other.undetermined.keys()


@numbered
def test_power_virtual_work_and_free_bodies_balance_on_random_linkages(number):
    found = forces_of(number)
    assert found.proof.power < EXACT
    assert found.proof.routes is None or found.proof.routes < EXACT
    assert found.proof.equilibrium is None or found.proof.equilibrium < EXACT
    assert all(np.isfinite(effort) for effort in found.inputs.values())


@repeats("few of the linkages are tried there")
def test_they_are_of_all_sizes_and_types():
    mechanisms = [mechanism for _, mechanism, _ in linkages()]
    assert len(mechanisms) == 40
    assert {len(each.inputs) for each in mechanisms} >= {1, 2, 3}
    assert {type(pair) for each in mechanisms for pair in each.pairs} == {
        kind for keyword, kind in pair_types().items() if keyword not in LIFTING
    }
    told = [found for found in map(forces_of, range(40)) if not found.undetermined]
    assert len(told) >= 20


@pytest.mark.parametrize("stem", some_models(6))
def test_they_balance_on_every_model_at_every_step_of_a_motion(stem):
    pair, start, *_ = MODELS[stem].inputs[0]
    stop = start + (0.01 if has_length_motion(MODELS[stem], pair) else 6.0)
    motion = planar.cycle(worked(MODELS[stem], 7), 6, start, stop, pair)
    found = planar.forces(motion)
    assert found.proof.power < 1e-9
    assert found.proof.equilibrium is None or found.proof.equilibrium < 1e-9


@numbered
def test_no_pair_does_work_on_a_motion_that_it_allows(number):
    """On relative motion its reaction has no power; teeth press where nothing slips."""
    found = forces_of(number)

    def turning(link):
        return found.moving.link(link).angular_velocity

    def velocity(link, at):
        """From that of any point of the link."""
        point = found.moving.point(f"{link}.{next(each for each in named[link])}")
        arm = at - point.position
        return point.velocity + turning(link) * np.array([-arm[1], arm[0]])

    named = {link.name: link.names for link in found.mechanism.links}
    for name, each in found.reactions.items():
        first, second = each.links
        if each.couples:
            parts = np.array([couple * turning(link) for link, couple in each.couples.items()])
        else:
            ways = [(sense, velocity(link, each.at), turning(link)) for sense, link in ((1, second), (-1, first))]
            parts = np.array([sense * part for sense, v, w in ways for part in (*(each.force * v), each.couple * w)])
        if np.isfinite(parts).all():
            assert abs(parts.sum()) <= 1e-9 * max(1.0, np.abs(parts).max()), name


@pytest.mark.parametrize(
    ("number", "turned"), first_cases([(6, 0.7), (3, -2.4), *product(range(0, COUNT, 3), (0.7, -2.4))], 2)
)
def test_a_world_that_is_moved_and_turned_has_its_forces_turned(number, turned):
    """The old frame is pinned to a new one at some place and angle, gravity and loads turned alike."""
    full, mechanism = written(number)
    c, s = cos(turned), sin(turned)

    def turn(x, y):
        return [c * x - s * y, s * x + c * y]

    full["links"] = {"world": {"points": {"Z": [3.0, -2.0]}}} | full["links"]
    full["links"]["frame"] = {"points": full["links"]["frame"]["points"] | {"Z": [0.4, 0.3]}}
    full["frame"] = "world"
    full["pairs"] = [{"turning": "Z", "links": ["world", "frame"]}, *full["pairs"]]
    on_frame = {pair.name for pair in mechanism.pairs if pair.links[1] == "frame" and not hasattr(pair, "line")}
    for given in full["inputs"]:
        if given["pair"] in on_frame:  # at a pin on the frame the other link's angle counts
            given |= {key: -given[key] for key in ("position", "velocity", "acceleration") if key in given}
    full["inputs"].append({"pair": "Z", "position": turned})
    for load in full["loads"]:
        if "point" in load and "axes" not in load:
            load["force"] = turn(*load["force"])
        if load.get("pair") in on_frame:
            load["torque"] = -load["torque"]
    full["gravity"] = turn(*full["gravity"])
    place = np.array([3.0, -2.0]) - turn(0.4, 0.3)
    full["sketch"] = {name: list(place + turn(*at)) for name, at in full["sketch"].items()}
    other = planar.forces(planar.solve(planar.from_dict(full)))
    flipped = {name: (-1.0 if name in on_frame else 1.0) * effort for name, effort in other.inputs.items()}
    one = forces_of(number)
    same(one, replace(other, inputs=flipped, undetermined=one.undetermined), 1e-8, turned)
    if not one.undetermined:
        assert other.undetermined == {}


@pytest.mark.parametrize("number", range(0, COUNT, 4))
def test_at_rest_the_forces_of_loads_add_up(number):
    _, mechanism, _ = linkages()[number]
    still = replace(mechanism, springs=(), inputs=tuple(each._replace(velocity=0.0) for each in mechanism.inputs))
    whole = planar.forces(solve(still), inertia=False)
    parts = [replace(still, masses=(), loads=(load,)) for load in still.loads] + [replace(still, loads=())]
    found = [planar.forces(solve(each), inertia=False) for each in parts]
    scale = scale_of(whole)
    for name, effort in whole.inputs.items():
        assert sum(each.inputs[name] for each in found) == pytest.approx(effort, abs=EXACT * scale)
    teeth = any(
        reaction.at is not None and hasattr(pair, "pressure_angle")
        for pair, reaction in zip(mechanism.pairs, whole.reactions.values(), strict=True)
    )
    if not teeth:  # teeth push each other off whichever way they press, so that this does not add up
        for name, reaction in whole.reactions.items():
            added = sum(each.reactions[name].force for each in found)
            np.testing.assert_allclose(added, reaction.force, atol=EXACT * scale)


@pytest.mark.parametrize("number", range(0, COUNT, 5))
def test_a_file_in_other_units_says_the_same(number):
    _, mechanism, _ = linkages()[number]
    other = planar.from_dict(planar.to_dict(replace(mechanism, units=FileUnits("mm", "deg"))))
    same(forces_of(number), planar.forces(solve(other)), 1e-8)


@pytest.mark.parametrize("size", [1e-6, 1e6])
@pytest.mark.parametrize("number", range(0, COUNT, 8))
def test_a_mechanism_of_another_size_balances_alike(number, size):
    """Lengths by a factor and masses by its square, in the same time: forces by its third power."""
    full, mechanism = written(number)
    length, mass = size, size**2

    def scaled(item, by):
        return [each * by for each in item]

    for link in full["links"].values():
        link["points"] = {name: scaled(at, length) for name, at in link["points"].items()}
    lines = [pair["line"] for pair in full["pairs"] if "line" in pair]
    for line in lines:
        if not isinstance(line["through"], str):
            line["through"] = scaled(line["through"], length)
    for pair in full["pairs"]:
        if "radius" in pair:
            pair["radius"] *= length
            pair["mesh"]["displacement"] *= length
    slides = [pair.name for pair in mechanism.pairs if hasattr(pair, "line")]
    for given in full["inputs"]:
        if given["pair"] in slides:
            given |= {key: given[key] * length for key in ("position", "velocity", "acceleration") if key in given}
    for load in full["loads"]:
        for key, by in (("force", mass * length), ("torque", mass * length**2)):
            if key in load:
                load[key] = scaled(load[key], by) if isinstance(load[key], list) else load[key] * by
    for spring in full["springs"]:
        by = mass * length**2 if "links" in spring else mass
        spring |= {key: spring[key] * by for key in ("stiffness", "damping") if key in spring}
    for body in full["masses"]:
        body |= {"mass": body["mass"] * mass, "inertia": body["inertia"] * mass * length**2}
    full["gravity"] = scaled(full["gravity"], length)
    full["sketch"] = {name: scaled(at, length) for name, at in full["sketch"].items()}
    found, other = forces_of(number), planar.forces(planar.solve(planar.from_dict(full)))
    scale = scale_of(found)
    for name, each in found.reactions.items():
        again = other.reactions[name]
        np.testing.assert_allclose(again.force / (mass * length), each.force, atol=1e-8 * scale)
        np.testing.assert_allclose(again.couple / (mass * length**2), each.couple, atol=1e-8 * scale)
    assert found.undetermined == other.undetermined
    assert other.proof.equilibrium is None or other.proof.equilibrium < EXACT


@numbered
def test_the_balance_is_that_of_the_energies(number):
    """What acts, inertia, pairs and inputs by vectors and elements, against derivatives of energies and residuals."""
    _, mechanism, state = linkages()[number]
    work = LagrangianFunctions(mechanism)
    constraints, directions = ca.jacobian(work.residuals, work.q), ca.jacobian(work.input_positions, work.q)
    arguments = [work.q, work.q1, work.q2, work.factors, work.spring_turns]
    results = [constraints, directions, work.total_action_on_links, work.inertia]
    q, q1, q2 = (rows[0] for rows in work.coordinates(state))
    turns = work.initial_spring_turns(q, mechanism.springs)
    derived = ca.Function("balance", arguments, results)(q, q1, q2, np.ones(len(mechanism.loads)), turns)
    slopes, drives, loads, inertia = (np.array(result) for result in derived)
    field = KinematicArrays(state)
    equations = balance_equations(mechanism)
    balance = equations.balance(field, np.ones((1, len(mechanism.loads))), inertia=True)
    count = equations.link_coordinate_count
    for result, expected in ((balance.loads, loads), (balance.inertia, inertia)):
        np.testing.assert_allclose(result[0], expected[:count, 0], atol=EXACT * np.abs(expected).max())
    if slopes.shape[1] == count:  # pairs without coordinates of their own
        np.testing.assert_allclose(np.asarray(balance.constraints)[0], slopes.T, atol=EXACT * np.abs(slopes).max())
        np.testing.assert_allclose(balance.input_directions[0], drives, atol=EXACT * np.abs(drives).max())
    else:  # what the pairs hold is square to each motion that they allow
        free = scipy.linalg.null_space(slopes)
        allowed = np.asarray(balance.constraints)[0].T @ free[:count]
        np.testing.assert_allclose(allowed, 0.0, atol=EXACT * np.abs(slopes).max())
        assert np.linalg.matrix_rank(balance.constraints[0]) == np.linalg.matrix_rank(slopes) - slopes.shape[1] + count
