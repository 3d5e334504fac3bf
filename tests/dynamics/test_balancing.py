"""Balancing: closed forms of books, conditions by rank, certificates, bounds, and the frame's forces afresh."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.util import find_spec
from math import pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planar
from planar.dynamics.balancing.counterweights import CounterweightSet, SetLimit
from planar.dynamics.balancing.mass_parameters import QUANTITIES, mass_parameters
from planar.dynamics.balancing.shaking_maps import LinkKinematics
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.errors import NoAnswer
from planar.model.loads import Mass
from planar.model.mechanism import Mechanism
from tests.command import run
from tests.draws import draws, first_cases
from tests.linkages import random_linkage

needs_solver = pytest.mark.skipif(find_spec("clarabel") is None, reason="needs clarabel")
STEPS = 60


def four_bar(crank: float, coupler: float, rocker: float, frame: float, **more) -> Mechanism:
    """Lengths in metres, the input at 60 deg."""
    bars = {"crank": ("O", "A", crank), "coupler": ("A", "B", coupler), "rocker": ("C", "B", rocker)}
    links = {name: {"ends": [first, second], "length": length} for name, (first, second, length) in bars.items()}
    return planar.from_dict(
        {
            "planar": 1,
            "name": "bars",
            "units": {"length": "m", "angle": "deg"},
            "frame": "frame",
            "links": {"frame": {"points": {"O": [0, 0], "C": [frame, 0]}}, **links},
            "pairs": [{"turning": name} for name in "OABC"],
            "inputs": [{"pair": "O", "position": 60, "velocity": "10 rad/s"}],
            "sketch": {"B": [frame, rocker]},
            **more,
        }
    )


BARS = (0.05, 0.18, 0.12, 0.2)
MASSES = (
    Mass("crank", 1.0, (0.02, 0.003), 1e-4),
    Mass("coupler", 2.0, (0.07, 0.02), 1e-3),
    Mass("rocker", 1.5, (0.05, -0.01), 1e-3),
)


def massive_bars() -> Mechanism:
    return replace(four_bar(*BARS), masses=MASSES)


@pytest.mark.parametrize(
    ("model", "force", "both"),
    first_cases(
        [
            ("crank-rocker", 4, 8),
            ("slider-crank", 4, 7),
            ("three-parallel-cranks", 2, 5),
            ("single-link", 2, 3),
            ("gear-reducer", 6, 7),
            ("belt-arm", 4, 5),
            ("open-arm", 6, 9),
            ("scotch-yoke", 3, 6),
            ("stephenson-1-six-bar", 6, 13),
            ("band-drafting-machine", 4, 10),
            ("planetary-differential", 8, 10),
        ],
        7,
    ),
)
def test_conditions_are_as_many_as_the_rank(model, force, both):
    """Of single links, open chains and gears they are counted by hand; those of a four-bar are Berkof and Lowen's."""
    found = planar.balancing_conditions(model)
    assert (found.force.count, found.both.count) == (force, both)
    assert found.force.is_certain and found.both.is_certain


def test_the_conditions_of_a_four_bar_are_those_of_berkof_and_lowen():
    a, b, c, _ = BARS
    told = {
        (condition.terms[0].link, condition.terms[0].quantity): {
            (each.link, each.quantity): each.coefficient for each in condition.terms[1:]
        }
        for condition in planar.balancing_conditions(four_bar(*BARS)).force.conditions
    }
    assert told["crank", "m x"] == pytest.approx({("coupler", "m"): a, ("coupler", "m x"): -a / b}, rel=1e-9)
    assert told["crank", "m y"] == pytest.approx({("coupler", "m y"): -a / b}, rel=1e-9)
    for part in ("m x", "m y"):
        assert told["rocker", part] == pytest.approx({("coupler", part): c / b}, rel=1e-9)


@needs_solver
def test_counterweights_of_a_four_bar_are_those_of_berkof_and_lowen():
    a, b, c, _ = BARS
    moments = [mass.mass * complex(*mass.at) for mass in MASSES]
    wanted = (-(moments[0] + a * 2.0 - a / b * moments[1]), -(moments[2] + c / b * moments[1]))
    found = planar.force_balance(massive_bars())
    assert [each.link for each in found.counterweights] == ["crank", "rocker"]
    for each, moment in zip(found.counterweights, wanted, strict=True):
        assert each.mass_radius * np.exp(1j * each.angle) == pytest.approx(moment, rel=1e-9)
    best = planar.balance(planar.cycle(massive_bars(), STEPS), limit=planar.CounterweightLimit(10.0))
    assert best.value < 1e-7 * best.value_before and best.bound == 0.0
    assert not planar.force_balance(massive_bars(), ["crank"]).is_possible


@needs_solver
def test_a_cylinder_is_half_balanced_and_a_v_twin_of_its_first_harmonic():
    """A piston's position has the crank's radius as its first harmonic, exactly, and no other odd one."""
    piston, r = 0.32, 0.03
    bare = planar.load("two-stroke-engine")
    masses = (Mass("crank", 2.0, (0.002, 0.0), 1e-3), Mass("block B", piston, "B"))
    one = planar.balance(planar.cycle(replace(bare, masses=masses), STEPS), measure="root mean square")
    (weight,) = one.counterweights
    assert weight.mass_radius == pytest.approx(2.0 * 0.002 + 0.5 * piston * r, rel=1e-4)
    assert abs(weight.angle) == pytest.approx(pi, abs=1e-4)
    twin = planar.balance(planar.cycle("v-twin-engine", STEPS), measure="root mean square")
    assert twin.counterweights[0].mass_radius == pytest.approx(0.5 * 0.04, rel=1e-4)
    speed, length = 100.0 * pi, 0.15
    second = np.sqrt(2.0) * 0.5 * 0.04**2 / length * speed**2  # of a piston m r^2/l w^2 cos 2t, of two at a right angle
    assert twin.after.measured("shaking force") == pytest.approx(second, rel=0.03)
    yoke = replace(planar.load("scotch-yoke"), masses=(Mass("yoke", 2.0, (0.0, 0.0)),))
    half = planar.balance(planar.cycle(yoke, STEPS), limit=planar.CounterweightLimit(5.0))
    assert half.value == pytest.approx(0.5 * half.value_before, rel=1e-6)
    assert half.bound == pytest.approx(half.value, rel=1e-6)


@needs_solver
def test_special_four_bars_alone_have_no_moment_without_a_counter_rotation():
    for bars in ((0.1, 0.06, 0.06, 0.1), (0.06, 0.06, 0.1, 0.1)):
        mechanism = four_bar(*bars)
        found = planar.mass_balance(mechanism)
        assert found.is_possible and found.margin > 1e-3
        # and the bodies that are told shake nothing, at a speed that changes
        kept = replace(mechanism, masses=found.masses, inputs=(mechanism.inputs[0]._replace(acceleration=30.0),))
        afresh = planar.forces(planar.cycle(kept, 24, radians(20), radians(120)))
        force, moment = afresh.shaking
        greatest = max(float(np.nanmax(np.abs(each.force))) for each in afresh.acting if each.kind == "inertia")
        assert np.nanmax(np.abs(force)) < 1e-7 * greatest
        assert np.nanmax(np.abs(moment)) < 1e-7 * greatest * bars[0]
    assert planar.mass_balance("antiparallelogram").is_possible


@needs_solver
@pytest.mark.parametrize("model", ["crank-rocker", "slider-crank", "stephenson-1-six-bar", "scotch-yoke"])
def test_a_certificate_is_above_zero_for_bodies_and_of_the_conditions(model):
    found = planar.mass_balance(model)
    assert not found.is_possible and found.error < 1e-9
    mechanism = planar.load(model)
    conditions = planar.balancing_conditions(mechanism)
    place = {axes.link: 4 * k for k, axes in enumerate(conditions.axes)}
    sums = np.zeros(4 * len(place))
    for term in found.certificate:
        sums[place[term.link] + QUANTITIES.index(term.quantity)] = term.coefficient
    scaled = sums * conditions.rows.column_scale
    basis = conditions.both.basis
    assert np.abs(scaled - basis.T @ (basis @ scaled)).max() < 1e-5
    random = np.random.default_rng(5)
    shapes = shapes_of_links(mechanism)
    for _ in range(50):
        masses = tuple(
            Mass(name, random.uniform(0.1, 3.0), tuple(random.uniform(-1.0, 1.0, 2)), random.uniform(1e-4, 1.0))
            for name in place
        )
        parameters = mass_parameters(replace(mechanism, masses=masses), shapes, conditions.axes)
        assert sums @ parameters > 0.0


@settings(max_examples=draws(5), deadline=None)
@given(st.integers(0, 10_000))
def test_maps_of_random_linkages_give_the_forces_of_all_their_masses(seed):
    """Shaking force and moment beside `planar.forces`, and the inputs' efforts with weights."""
    try:
        mechanism = planar.from_dict(random_linkage(seed, 1 + seed % 6, 0.0, 0.3 * (seed % 2)).value)
        state = planar.solve(mechanism)
    except NoAnswer:
        return
    random = np.random.default_rng(seed)
    moving = [link.name for link in mechanism.links if link.name != mechanism.frame]
    masses = tuple(
        Mass(name, random.uniform(0.1, 3.0), tuple(random.uniform(-1.0, 1.0, 2)), random.uniform(0.0, 1.0))
        for name in moving
    )
    inputs = tuple(
        each._replace(velocity=float(random.normal()), acceleration=float(random.normal()), law=None)
        for each in mechanism.inputs
    )
    heavy = replace(mechanism, masses=masses, inputs=inputs, gravity=(0.3, -9.81), loads=(), springs=())
    try:
        state = planar.solve(heavy)
        wanted = planar.forces(state, friction=False)
    except (NoAnswer, planar.BadInput):
        return
    kinematics = LinkKinematics(state)
    maps = kinematics.shaking_maps(np.zeros(2))
    parameters = mass_parameters(heavy, state.shapes, kinematics.axes)
    force, moment = wanted.shaking
    scale = sum(float(np.abs(part).max()) for part in (maps.force, maps.moment)) * float(np.abs(parameters).max())
    assert maps.force[0] @ parameters == pytest.approx(force, abs=1e-11 * scale)
    assert maps.moment[0] @ parameters == pytest.approx(float(moment), abs=1e-11 * scale)
    for name, effort in wanted.inputs.items():
        if np.isfinite(effort):
            size = float(np.abs(maps.efforts[name] * parameters).sum())
            assert maps.efforts[name][0] @ parameters == pytest.approx(float(effort), abs=1e-9 * size)


@needs_solver
@pytest.mark.parametrize("objective", ["shaking force", "shaking moment", "peak torque"])
def test_no_random_counterweights_are_better_and_forces_afresh_agree(objective):
    motion = planar.cycle(replace(massive_bars(), gravity=(0.0, -9.81)), STEPS)
    limit = planar.CounterweightLimit(1.2, 0.06)
    best = planar.balance(motion, objective, ["crank", "rocker"], limit, about="C")
    assert best.bound <= best.value <= best.bound + 1e-6 * best.value_before
    assert best.value < 0.95 * best.value_before
    assert best.frame_error < 1e-12
    afresh = planar.forces(replace(motion, mechanism=best.balanced))
    assert afresh.shaking[0] == pytest.approx(best.after.force, abs=1e-9 * best.before.measured("shaking force"))
    assert afresh.inputs["O"] == pytest.approx(best.after.effort, abs=1e-9 * best.before.measured("peak torque"))
    kinematics = LinkKinematics(motion)
    maps = kinematics.shaking_maps(best.about)
    random = np.random.default_rng(2)
    many = 4000
    more = np.zeros((many, 4 * len(kinematics.axes)))
    for k, axes in enumerate(kinematics.axes):
        if axes.link in best.links:
            m = limit.mass * random.uniform(0.0, 1.0, many)
            away, angle = limit.radius * np.sqrt(random.uniform(0.0, 1.0, many)), random.uniform(-pi, pi, many)
            x, y = away * np.cos(angle), away * np.sin(angle)
            inertia = random.uniform(away**2, limit.radius**2)
            more[:, 4 * k : 4 * k + 4] = (m * np.stack([np.ones(many), x, y, inertia])).T
    if objective == "shaking force":
        force = best.before.force[:, :, None] + maps.force @ more.T
        reached = np.linalg.norm(force, axis=1).max(axis=0)
    else:
        own, matrix = (
            (best.before.moment, maps.moment) if "moment" in objective else (best.before.effort, maps.efforts["O"])
        )
        reached = np.abs(own[:, None] + matrix @ more.T).max(axis=0)
    assert reached.min() >= best.bound


@needs_solver
def test_discs_are_searched_for_above_the_bound_of_all_of_them():
    motion = planar.cycle(replace(massive_bars(), gravity=(0.0, -9.81)), 24)
    limit = planar.CounterweightLimit(1.2, 0.06, thickness=0.004)
    found = planar.balance(motion, "peak torque", ["crank", "rocker"], limit)
    assert found.is_searched and found.bound <= found.value <= found.value_before
    for each in found.counterweights:
        radius = np.sqrt(each.mass / (planar.CounterweightLimit().density * pi * 0.004))
        assert each.inertia == pytest.approx(0.5 * each.mass * radius**2, rel=1e-9)
    assert (
        planar.balance(motion, "peak torque", ["crank", "rocker"], limit._replace(thickness=None)).bound <= found.bound
    )


@settings(max_examples=draws(40), deadline=None)
@given(st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4), st.sampled_from([0.0, 0.3, 2.0]))
def test_the_least_of_a_sum_over_counterweights_is_that_of_many(coefficients, disc):
    """In units of mass and radius: points of the cone for bodies of any shape, and discs."""
    one = CounterweightSet((0,), (SetLimit(1.0, 1.0, disc),))
    told = one.least_sum(np.array(coefficients))
    m, away, angle, part = (axis.ravel() for axis in np.meshgrid(*[np.linspace(0.0, 1.0, 21)] * 4))
    inertia = away**2 + (disc * m if disc else part * (1.0 - away**2))
    x, y = away * np.cos(2.0 * pi * angle), away * np.sin(2.0 * pi * angle)
    every = m * (coefficients[0] + coefficients[1] * x + coefficients[2] * y + coefficients[3] * inertia)
    assert told <= every.min() + 1e-12
    assert told >= every.min() - 0.15 * (1.0 + disc)


@needs_solver
def test_the_tradeoff_is_between_the_least_of_both_and_falls():
    motion = planar.cycle(massive_bars(), 36)
    limit = planar.CounterweightLimit(3.0)
    curve = planar.balance_tradeoff(motion, limit=limit, about="C", count=4)
    assert (np.diff(curve.force) > 0.0).all() and (np.diff(curve.moment) < 0.0).all()
    assert (curve.moment_bound <= curve.moment + 1e-6 * curve.before[1]).all()
    steady = planar.balance(motion, "shaking moment", limit=limit, about="C")
    assert curve.moment[-1] == pytest.approx(steady.value, abs=1e-4 * curve.before[1])


@needs_solver
def test_the_command_tells_writes_and_draws(tmp_path):
    told = run(tmp_path, "balance", "v-twin-engine", "--counterweights", "crank", "-o", "b.json", "--diagrams", "b.svg")
    assert "6 conditions at any speed" in told.done() and "m x(left rod) + 150 mm · m(block L) = 0" in told.done()
    found = json.loads(run(tmp_path, "balance", "v-twin-engine", "--json", "--counterweights", "crank").done())
    (weight,) = found["best"]["counterweights"]
    kept = planar.load(tmp_path / "b.json")
    assert kept.masses[-1].mass == pytest.approx(weight["mass"])
    shaking = np.linalg.norm(planar.forces(planar.cycle(kept)).shaking[0], axis=1).max()
    assert shaking == pytest.approx(found["best"]["after"], rel=1e-9)
    assert "before" in (tmp_path / "b.svg").read_text()
    refused = run(tmp_path, "balance", "four-bar", "--counterweights", "AB")
    assert refused.status == 2 and "no moving link has a mass" in refused.err


def test_what_cannot_be_meant_is_refused():
    engine = planar.load("two-stroke-engine")
    for sentence, call in (
        ("there is no moving link 'bolt'", lambda: planar.force_balance(engine, ["bolt"])),
        ("is named twice", lambda: planar.force_balance(engine, ["crank", "crank"])),
        ("above zero", lambda: planar.force_balance(engine, limit=planar.CounterweightLimit(radius=-1.0))),
        ("the frame has no point 'A'", lambda: planar.balancing_conditions(engine, "A")),
        ("one of shaking force, shaking moment, peak torque", lambda: planar.balance(engine, "noise")),
        ("one of greatest, root mean square", lambda: planar.balance(engine, measure="mean")),
        ("there is no input at 'A'", lambda: planar.balance(engine, of="A")),
        ("no moving link has a mass", lambda: planar.balance("four-bar")),
        ("one of shaking force, shaking moment, both", lambda: planar.mass_balance(engine, "noise")),
        ("two points or more", lambda: planar.balance_tradeoff(engine, count=1)),
    ):
        with pytest.raises(planar.BadInput, match=sentence):
            call()
