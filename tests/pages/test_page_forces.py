"""Forces on a page, found by its own JavaScript, against Python's: with masses, loads and springs of all kinds."""

from __future__ import annotations

import json
import shutil
import subprocess
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import planar
from planar.analysis.motion.mechanical_advantage import advantages
from planar.document.dimensions import change_dimension, link_lengths
from planar.document.files import read_asset
from planar.dynamics.load_attachment import attachments
from planar.model.loads import Course, Load, Mass, Spring
from planar.model.mechanism import Mechanism, relative_motions
from planar.pages.data.page_data import page_data
from tests.draws import covering
from tests.known import MODELS, kinds_of_model
from tests.rubbing import with_friction

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="there is no node here to run a page's scripts")

SCRIPT = """
const [data, moved] = given;
const linkage = new Linkage(data, program), forces = new Forces(data, program);
if (moved.d) linkage.changeTo(moved.d);
if (moved.u) linkage.moveTo(moved.u.map((each, k) => each / linkage.scale[k]));
const rates = ["velocity", "acceleration"].map((rate) => data.inputs.map((each) => each[rate]));
const state = linkage.state(...rates), inputs = Array.from(linkage.u, (each, k) => each * linkage.scale[k]);
console.log(JSON.stringify(forces.at(state, inputs, linkage.d, forces.wound(state.w))));
"""


def on_page(mechanism: Mechanism, **moved: list[float]) -> dict[str, Any]:
    """What the page's scripts find, with its inputs moved to `u` or its dimensions changed to `d` (SI)."""
    data, functions = page_data(mechanism)
    scripts = "".join(read_asset(f"solve/{name}.js") for name in ("singular", "stops", "linkage", "friction", "forces"))
    ran = subprocess.run(
        ["node", "-"],
        input=f"{scripts}\n{functions}\nconst given = {json.dumps([data, moved])};\n{SCRIPT}",
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    return json.loads(ran.stdout)


def acted_on(mechanism: Mechanism, seed: int = 3) -> Mechanism:
    """A mechanism with a mass on every link, and loads and springs of every kind."""
    rng = np.random.default_rng(seed)
    links = [link.name for link in mechanism.links if link.name != mechanism.frame]
    points, pairs, given = list(attachments(mechanism)), list(relative_motions(mechanism)), mechanism.inputs[0]
    course = Course(given.pair, (given.position - 1.0, given.position + 2.0), (0.5, 2.0))
    masses = (
        Mass(link, rng.uniform(0.5, 3.0), tuple(rng.uniform(-0.1, 0.1, 2)), rng.uniform(0.001, 0.1)) for link in links
    )
    loads = (
        Load(point=points[-1], force=(30.0, -20.0), varies=course),
        Load(point=points[0], force=(5.0, 2.0), axes=links[0]),
        Load(link=links[-1], torque=3.0),
        Load(points=(points[0], points[-1]), effort=7.0, varies=course),
        *(Load(pair=pairs[k], effort=4.0) for k in rng.integers(len(pairs), size=2)),
    )
    springs = (
        Spring(links=(mechanism.frame, links[0]), stiffness=2.0, free=0.3, damping=0.1),
        Spring(points=(points[0], points[-1]), stiffness=300.0, free=0.05, damping=3.0),
    )
    return replace(mechanism, masses=tuple(masses), loads=loads, springs=springs, gravity=(0.3, -9.81))


def alike(found: dict[str, Any], mechanism: Mechanism) -> None:
    """Everything equals Python's to 1e-9 of the greatest."""
    state = planar.solve(mechanism)
    forces = planar.forces(state)
    force = max([np.hypot(*each.force) for each in (*forces.acting, *forces.reactions.values())], default=0.0)
    couple = max([abs(float(each.couple)) for each in forces.acting], default=0.0)
    size = max(
        np.hypot(a.x - b.x, a.y - b.y)
        for shape in state.shapes.values()
        for a in shape.points.values()
        for b in shape.points.values()
    )
    least = 1e-9 * max(force, couple / size) * np.array([1.0, 1.0, size])
    for effort, (name, wanted) in zip(found["inputs"], forces.inputs.items(), strict=True):
        assert effort["pair"] == name
        assert abs(effort["effort"] - wanted) <= least[0 if forces.is_force_input(name) else 2]
    for pair, (name, wanted) in zip(found["pairs"], forces.reactions.items(), strict=True):
        assert pair["name"] == name and pair["links"] == list(wanted.links)
        assert (np.abs(np.array([*pair["force"], pair["couple"]]) - [*wanted.force, wanted.couple]) <= least).all()
        assert pair["at"] == pytest.approx(wanted.at, abs=1e-9 * size)
    for shown, (name, wheel) in zip(found["wheels"], forces.fixed_wheels.items(), strict=True):
        assert shown["about"] == name and shown["pairs"] == [*wheel.shares]
        assert abs(shown["torque"] - wheel.torque) <= least[2]
    listed = [each for row in advantages(state).values() for each in row.values()] if state.mechanism.loads else []
    for shown, wanted in zip(found["advantages"], listed, strict=True):
        assert (shown["output"], shown["along"], shown["input"]) == (wanted.target, wanted.along, wanted.input)
        if wanted.by_power is None:
            assert shown["ratio"] is None
        else:
            assert shown["ratio"] == pytest.approx(wanted.by_power, rel=1e-6)
    # what acts, link by link, as a force and a moment about the world's origin
    for link in state.shapes.keys() - {mechanism.frame}:
        shown = [(*each["at"], *each["force"], each["couple"]) for each in found["acting"] if each["link"] == link]
        acting = [
            (*each.at, *each.force, float(each.couple))
            for each in forces.acting
            if each.link == link and each.kind not in ("input", "inertia")
        ]
        sums = [
            sum((np.array([fx, fy, m + x * fy - y * fx]) for x, y, fx, fy, m in each), np.zeros(3))
            for each in (shown, acting)
        ]
        assert (np.abs(sums[0] - sums[1]) <= 2.0 * least).all()


def pair_kinds(name: str) -> set[object]:
    """Types of pairs, with whether the frame is one of their links."""
    mechanism = MODELS[name]
    return {(type(pair), mechanism.frame in pair.links) for pair in mechanism.pairs}


LOADED = ("toggle-clamp", "000-P2", "two-stroke-engine", "physical-pendulum", "balanced-lamp", "gear-reducer")


@pytest.mark.parametrize("name", covering(LOADED, kinds_of_model))
def test_the_forces_of_a_page_are_those_of_python(name):
    alike(on_page(planar.load(name)), planar.load(name))


@pytest.mark.parametrize(
    "name",
    covering(
        [
            "four-bar",
            "000-P2",
            "rolling-wheel",
            "gear-reducer",
            "planetary-gear-set",
            "hypocycloid-dwell",
            "scissor-lift",
            "002-E3.1",
        ],
        pair_kinds,
    ),
)
def test_masses_loads_and_springs_of_every_kind_act_on_a_page_as_in_python(name):
    mechanism = acted_on(planar.load(name))
    alike(on_page(mechanism), mechanism)


@pytest.mark.parametrize(
    "name",
    covering(["four-bar", "slider-crank", "whitworth", "gear-reducer", "rolling-wheel", "rack-steering"], pair_kinds),
)
def test_friction_on_a_page_is_that_of_python(name):
    mechanism = acted_on(with_friction(planar.load(name), np.random.default_rng(5), 0.1))
    found = on_page(mechanism)
    assert not found["why"] and planar.forces(planar.solve(mechanism)).friction
    alike(found, mechanism)


def test_much_friction_and_friction_of_unknown_forces_have_no_numbers_on_a_page():
    belt = acted_on(with_friction(planar.load("belt-arm"), np.random.default_rng(5), 0.1))
    assert "not determined: friction follows" in on_page(belt)["why"]
    assert planar.forces(planar.solve(belt)).undetermined
    jammed = planar.load("toggle-clamp").with_values({f"{pin}.pin_radius": 0.5 for pin in "OAB"})
    assert "several solutions or none" in on_page(jammed)["why"]


def test_forces_follow_the_input():
    mechanism = acted_on(planar.load("two-stroke-engine"))
    (given,) = mechanism.inputs
    moved = replace(mechanism, inputs=(given._replace(position=given.position + 0.4),))
    alike(on_page(mechanism, u=[given.position + 0.4]), moved)


def test_forces_follow_the_dimensions():
    mechanism = acted_on(planar.load("000-P2"))
    every = list(link_lengths(mechanism, frozenset(link.name for link in mechanism.links)))
    values = [each.value * (1.05 if each.name == "BD.length" else 1.0) for each in every]
    longer = change_dimension(mechanism, next(each for each in every if each.name == "BD.length"), 1.05 * 0.54)
    alike(on_page(mechanism, d=values), longer)


def test_links_that_are_held_more_than_once_have_no_numbers():
    found = on_page(acted_on(planar.load("coupled-wheels")))
    assert set(found) == {"why"} and "held more than once" in found["why"]


def test_beside_a_chain_only_efforts_are_told():
    mechanism = acted_on(planar.load("chain-swing-arm"))
    found, wanted = on_page(mechanism), planar.forces(planar.solve(mechanism))
    assert [each["effort"] for each in found["inputs"]] == pytest.approx(list(wanted.inputs.values()), rel=1e-9)
    assert all(pair["force"] == [None, None] for pair in found["pairs"]) and "chain" in found["why"]


def test_a_page_says_on_which_link_of_a_pin_a_load_acts():
    """The gas pushes the piston, as in Python; the note stands beside the layer of forces and its tables."""
    engine = planar.load("two-stroke-engine")
    found = on_page(engine)
    assert [(each["name"], each["link"]) for each in found["acting"] if each["kind"] == "load"] == [("B", "block B")]
    page = json.dumps({"data": page_data(engine)[0]})
    ran = subprocess.run(
        ["node", "-e", f"{read_asset('layers/forces.js')}\nconsole.log(forceNotes({page}, {{ why: '' }}).join())"],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert ran.stdout.strip() == "the load at 'B' acts on link 'block B', not on 'rod'; to have it there write 'rod.B'"
