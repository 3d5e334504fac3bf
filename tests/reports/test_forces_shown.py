"""Forces and simulations as the program shows and writes them, against the same by hand."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from math import cos, hypot, pi, radians, sin, sqrt, tan
from pathlib import Path

import numpy as np
import pytest

import planar
from planar.drawing.diagrams.positions import loci, positions
from planar.drawing.output.animation import plan_animation
from planar.dynamics import simulation
from planar.foundation.errors import Outcome
from planar.model.loads import Load, Mass, Spring
from tests.closed_forms import piston
from tests.command import run
from tests.known import MODELS


def kept(folder: Path, mechanism: planar.Mechanism) -> str:
    (folder / "own.json").write_text(planar.dumps(mechanism), encoding="utf-8")
    return "own.json"


def heavy(stem: str) -> planar.Mechanism:
    """A model with a mass on every moving link."""
    mechanism = MODELS[stem]
    links = [link for link in mechanism.links if link.name != mechanism.frame]
    return replace(
        mechanism,
        masses=tuple(Mass(link.name, 1.0 + k, (0.01, 0.02 * k), 0.001) for k, link in enumerate(links)),
        gravity=(0.0, -9.81),
    )


def row(text: str, table: str, first: str) -> list[str]:
    """The cells of a table's row, told by its first."""
    after = text[text.index(f"\n{table}") :]
    return next(line.split() for line in after.splitlines() if line.split()[:1] == [first])


def column(file: Path, head: str) -> np.ndarray:
    with file.open(encoding="utf-8") as lines:
        return np.array([float(each[head] or "nan") for each in csv.DictReader(lines)])


# a position


def test_teeth_press_under_their_angles_and_load_the_bearings(tmp_path):
    """Tangential 120 N m / 75 mm, radial that times tan 25 deg; the countershaft's bearing has both stages' forces."""
    text = run(tmp_path, "forces", "gear-reducer").done()
    tooth = np.array([1600 * tan(radians(25)), -1600])
    found = row(text, "Reactions", "O3")
    assert [float(each) for each in found[-3:-1]] == pytest.approx(-tooth, rel=1e-5)
    assert float(found[-5]) == pytest.approx(hypot(*tooth), rel=1e-5)
    assert float(found[-4]) == pytest.approx(180 - 65, rel=1e-5)
    first = np.array([40 / 0.06 * tan(radians(20)), 40 / 0.06])  # of the input's 120/9 N m at 20 mm, or 40 at 60 mm
    middle = row(text, "Reactions", "O2")
    assert [float(each) for each in middle[-3:-1]] == pytest.approx(tooth - first, rel=1e-5)
    assert float(row(text, "Inputs", "O1")[1]) == pytest.approx(120 / 9, rel=1e-5)


@pytest.mark.parametrize(
    ("masses", "gravity", "words", "sentence"),
    [
        ((), (0.0, 0.0), (), "in equilibrium without inertia, weight and friction"),
        ((Mass("OA", 1.0, "A"),), (0.0, 0.0), (), "in equilibrium with inertia, without weight and friction"),
        ((Mass("OA", 1.0, "A"),), (0.0, -9.81), (), "in equilibrium with inertia and weight, without friction"),
        (
            (Mass("OA", 1.0, "A"),),
            (0.0, -9.81),
            ("--static",),
            "in equilibrium with weight, without inertia and friction",
        ),
        ((), (0.0, -9.81), (), "in equilibrium without inertia, weight and friction"),
    ],
)
def test_what_is_left_out_is_said(tmp_path, masses, gravity, words, sentence):
    model = kept(tmp_path, replace(MODELS["000-P2"], masses=masses, gravity=gravity))
    text = run(tmp_path, "forces", model, *words).done()
    assert sentence in text.splitlines()
    assert ("\nInertia" in text) == ("with inertia" in sentence)
    assert ("\n shaking" in text) == ("with inertia" in sentence)


def test_a_shaft_out_of_balance_shakes_its_frame_by_m_r_w_squared(tmp_path):
    """A point mass 2 kg at 0.2 m turning at 2 pi rad/s, hastened by 2 rad/s^2 (single-link)."""
    model = kept(tmp_path, replace(MODELS["single-link"], masses=(Mass("link", 2.0, "P"),)))
    found = json.loads(run(tmp_path, "forces", model, "--json").done())
    out, along = 2 * 0.2 * (2 * pi) ** 2, -2 * 0.2 * 2.0
    wanted = [out * cos(pi / 6) - along * sin(pi / 6), out * sin(pi / 6) + along * cos(pi / 6)]
    assert found["shaking"]["force"] == pytest.approx(wanted, rel=1e-12)
    assert found["shaking"]["moment"] == pytest.approx(0.2 * along, rel=1e-12)
    assert found["reactions"]["O"]["force"] == pytest.approx([-each for each in wanted], rel=1e-12)
    assert found["inputs"]["O"]["torque"] == pytest.approx(2 * 0.2**2 * 2.0, rel=1e-12)
    still = json.loads(run(tmp_path, "forces", model, "--json", "--static").done())
    assert still["inputs"]["O"]["torque"] == 0.0
    assert "shaking" not in still


def test_what_is_not_determined_is_named_and_never_a_number(tmp_path):
    model = kept(tmp_path, heavy("three-parallel-cranks"))
    text = run(tmp_path, "forces", model).done()
    for pair in ("A0", "B0", "C0", "A", "B", "C"):
        assert row(text, "Reactions", pair)[-5:-1] == ["-"] * 4
    assert "not determined at A0, B0, C0, A, B and C: the links are held more than once" in text
    found = json.loads(run(tmp_path, "forces", model, "--json").done())
    assert all(each["force"] == [None, None] for each in found["reactions"].values())
    assert set(found["undetermined"]) == {"A0", "B0", "C0", "A", "B", "C"}
    assert found["proof"]["equilibrium"] is None
    assert isinstance(found["inputs"]["A0"]["torque"], float)


def test_a_belt_has_couples_on_its_links_and_no_force(tmp_path):
    model = kept(tmp_path, heavy("belt-arm"))
    found = json.loads(run(tmp_path, "forces", model, "--json").done())
    couples = found["reactions"]["belt"]["couples"]
    assert "force" not in found["reactions"]["belt"]
    assert sum(couples.values()) == pytest.approx(0.0, abs=1e-12)
    assert max(map(abs, couples.values())) > 1e-3
    assert found["reactions"]["O"]["force"] == [None, None]
    text = run(tmp_path, "forces", model).done()
    assert "not determined at O and E: what 'belt' puts on it is not known: only the couples are" in text


def test_everything_that_acts_stands_in_the_table_with_its_power(tmp_path):
    mechanism = heavy("crank-rocker")
    ends = planar.model.mechanism.named_points(mechanism)
    mechanism = replace(
        mechanism,
        loads=(Load("B", (3.0, 4.0)), Load(link="rocker", torque=0.5), Load(pair="B", effort=0.25)),
        springs=(Spring((ends[0].name, "B"), None, 100.0, 0.05, 2.0), Spring(None, ("rocker", "coupler"), 0.3, 0.1)),
    )
    assert {"rocker", "coupler"} <= {link.name for link in mechanism.links}
    found = json.loads(run(tmp_path, "forces", kept(tmp_path, mechanism), "--json").done())
    acting = [*found["loads"], *found["inertia"]]
    kinds = [each["kind"] for each in acting]
    # a force, a torque, an effort between two links, three weights, two springs with two ends; three inertias
    assert [kinds.count(kind) for kind in ("load", "weight", "spring", "inertia")] == [4, 3, 4, 3]
    whole = sum(each["power"] for each in acting) + sum(each["power"] for each in found["inputs"].values())
    assert whole == pytest.approx(0.0, abs=1e-12)
    state = planar.solve(mechanism)
    assert acting[0]["power"] == pytest.approx(np.dot([3, 4], state.point("B").velocity), rel=1e-12)
    for each in acting:
        given = np.dot(each["force"], each["velocity"]) + each["torque"] * each["angular_velocity"]
        assert given == pytest.approx(each["power"], abs=1e-12)


def test_a_load_that_varies_with_time_is_told_at_the_start(tmp_path):
    varying = Load("BD.D", (1000.0, 0.0), varies=planar.Course(None, (0.0, 2.0), (0.5, 1.0)))
    text = run(tmp_path, "forces", kept(tmp_path, replace(MODELS["000-P2"], loads=(varying,)))).done()
    assert float(row(text, "Loads", "BD.D")[2]) == 500.0
    assert "loads that vary with time are those at 0 s" in text


# a whole motion


def test_over_a_turn_inertia_supplies_nothing_and_the_mean_torque_is_the_work_of_the_gas(tmp_path):
    """The closed integral of the gas force over the piston's way, by its closed form, straight between the places."""
    text = run(tmp_path, "forces", "two-stroke-engine", "--cycle", "--steps", "36").done()
    (load,) = MODELS["two-stroke-engine"].loads
    at, r, rod = np.linspace(0, 2 * pi, 200_001), 0.03, 0.11
    way = piston(at, r, rod)[1]
    work = np.trapezoid(-283 * np.interp(at, load.varies.at, load.varies.factors) * way, at)
    assert float(row(text, "Inputs", "O")[1]) == pytest.approx(-work / (2 * pi), rel=2e-6)


def test_the_tables_have_the_extremes_between_the_positions_and_where(tmp_path):
    """Of few steps those of very many, with places that are steps of neither."""
    text = run(tmp_path, "forces", "two-stroke-engine", "--cycle", "--steps", "36").done()
    motion = planar.cycle(MODELS["two-stroke-engine"], 3600)
    found = planar.forces(motion)
    effort, at = found.inputs["O"], np.degrees(motion.inputs["O"].position)
    shown = [float(each) for each in row(text, "Inputs", "O")[3:]]
    assert shown[::2] == pytest.approx([effort.min(), effort.max()], rel=1e-5)
    assert shown[1::2] == pytest.approx([at[effort.argmin()], at[effort.argmax()]], abs=0.06)
    force = np.hypot(*found.reactions["A"].force.T)
    most = int(force.argmax())
    way = np.degrees(np.arctan2(*found.reactions["A"].force[most, ::-1]))
    cells = [float(each) for each in row(text, "Reactions", "A")[3:6]]
    assert cells == pytest.approx([force[most], way, at[most]], rel=2e-5)
    shaken = float(np.hypot(*found.shaking[0].T).max())
    assert f"shaking up to {shaken:#.6g} N (at O = " in text
    assert text.count("among these positions") == 0


@pytest.mark.parametrize("suffix", ["csv", "npz", "json"])
def test_every_position_is_written_with_efforts_and_reactions(tmp_path, suffix):
    run(tmp_path, "forces", "two-stroke-engine", "--cycle", "--from", "10", "--to", "60deg", "-o", f"f.{suffix}").done()
    file = tmp_path / f"f.{suffix}"
    motion = planar.cycle(MODELS["two-stroke-engine"], 360, radians(10), radians(60))
    found = planar.forces(motion)
    if suffix == "csv":
        torque, x = column(file, "input O torque [N m]"), column(file, "reaction stroke Fy [N]")
        moment, place = column(file, "shaking moment [N m]"), column(file, "reaction B x [mm]") / 1e3
        power = column(file, "input O power [W]")
    elif suffix == "npz":
        arrays = np.load(file)
        torque, x = arrays["inputs/O/torque"], arrays["reactions/stroke/force"][:, 1]
        moment, place = arrays["shaking/moment"], arrays["reactions/B/position"][:, 0]
        power = arrays["inputs/O/power"]
        units = dict(arrays["units"])
        assert (units["inputs/O/power"], units["reactions/O/couple"], units["shaking/force"]) == ("W", "N m", "N")
    else:
        value = json.loads(file.read_text(encoding="utf-8"))
        torque, x = (np.array(value["inputs"]["O"]["torque"]), np.array(value["reactions"]["stroke"]["force"])[:, 1])
        moment, place = value["shaking"]["moment"], np.array(value["reactions"]["B"]["position"])[:, 0]
        power = value["inputs"]["O"]["power"]
        assert value["between"]["stroke"] == ["frame", "block B"]
        assert max(each for each in value["proof"].values() if each is not None) < 1e-10
    np.testing.assert_allclose(torque, found.inputs["O"], rtol=1e-12)
    np.testing.assert_allclose(power, np.asarray(torque) * motion.inputs["O"].velocity, rtol=1e-12)
    np.testing.assert_allclose(x, found.reactions["stroke"].force[:, 1], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(moment, found.shaking[1], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(place, motion.point("B").position[:, 0], rtol=1e-12)


def test_on_a_dead_point_nothing_is_told_and_how_often_is_said(tmp_path):
    value = planar.to_dict(MODELS["slider-crank"]) | {"loads": [{"link": "crank", "torque": 5}]}
    value |= {"inputs": [{"pair": "stroke", "position": 1780}], "sketch": {"A": [240, 410]}}
    model = kept(tmp_path, planar.from_dict(value))
    text = run(tmp_path, "forces", model, "--cycle", "--circuit", "-o", "f.csv").done()
    assert row(text, "Inputs", "stroke")[1] == "-"
    effort, place = (column(tmp_path / "f.csv", f"input stroke {what}") for what in ("force [N]", "position [mm]"))
    dead = np.isclose(np.abs(place - 1600), 480, atol=1e-6)
    assert np.array_equal(np.isnan(effort), dead)
    assert f"at {dead.sum()} of {len(dead)} positions: no forces in the pairs balance the links there" in text
    assert "held more than once" not in text
    found = json.loads(run(tmp_path, "forces", model, "--cycle", "--circuit", "--json").done())
    assert found["inputs"]["stroke"]["force"].count(None) == dead.sum()


def truss(*bars: str) -> planar.Mechanism:
    """Bars from the frame to a loaded pin C, which stands a metre above the middle of A and B."""
    feet = {"A": [0, 0], "B": [2, 0], "E": [1, 0]}
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {"f": {"points": {bar: feet[bar] for bar in bars}}}
            | {f"{bar}C": {"ends": [bar, "C"], "length": 1.0 if bar == "E" else sqrt(2.0)} for bar in bars},
            "pairs": [{"turning": name} for name in (*bars, "C")],
            "loads": [{"point": "C", "force": [0, -100]}],
            "sketch": {"C": [1, 1]},
        }
    )


def test_a_truss_has_no_inputs_and_its_bars_carry_the_load_along_themselves(tmp_path):
    text = run(tmp_path, "forces", kept(tmp_path, truss("A", "B"))).done()
    assert "Inputs" not in text
    assert row(text, "Reactions", "A")[3:] == ["70.7107", "0.785398", "50.0000", "50.0000", "0"]
    assert row(text, "Reactions", "B")[3:] == ["70.7107", "2.35619", "-50.0000", "50.0000", "0"]
    assert "every link balances as a free body" in text
    text = run(tmp_path, "forces", kept(tmp_path, truss("A", "B", "E"))).done()
    assert row(text, "Reactions", "E")[3:7] == ["-"] * 4
    assert "none: of no link all is told" in text


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (("four-bar",), 2, "$.loads: the mechanism has no loads, springs or masses; write"),
        (("balanced-lamp", "--steps", "9"), 2, "--steps: this is for the forces of a whole motion, with --cycle"),
        (("balanced-lamp", "--circuit"), 2, "--circuit: this is for the forces of a whole motion, with --cycle"),
        (("balanced-lamp", "--from", "20"), 2, "--from: this is for the forces of a whole motion, with --cycle"),
        (("balanced-lamp", "--cycle", "--at", "O=20"), 2, "--at: the forces of a whole motion have no one position"),
        (
            ("balanced-lamp", "--cycle", "-o", "f.txt"),
            2,
            "a file name that ends in '.txt': a run can be written to files that end in .csv, .json",
        ),
        (
            ("balanced-lamp", "-o", "f.csv"),
            2,
            "a file name that ends in '.csv': tables can be written to files that end in .txt",
        ),
        (("balanced-lamp", "--json", "-o", "f.txt"), 2, "-o: results go to a file or are printed with --json"),
    ],
)
def test_what_the_forces_cannot_do_is_refused(tmp_path, words, status, told):
    assert run(tmp_path, "forces", *words).refused(status).startswith(told)
    assert not list(tmp_path.iterdir())


def test_a_motion_that_stops_is_told_as_far_as_it_goes_and_ends_with_status_1(tmp_path):
    ended = run(tmp_path, "forces", kept(tmp_path, heavy("triple-rocker")), "--cycle", "--to", "720deg", "--json")
    found = json.loads(ended.out)
    assert ended.status == 1
    assert ended.err.startswith(f"planar: {found['outcome']}: ")
    assert len(next(iter(found["inputs"].values()))["torque"]) > 1


# a mechanism let go


def test_after_the_exact_period_a_pendulum_is_back(tmp_path):
    """T = 2 pi sqrt(J / m g s) / agm(1, cos(amplitude / 2)) for any amplitude, here 60 deg (C. F. Gauss)."""
    inertia, moment = 0.036 + 1.2 * 0.3**2 + 0.00432 + 2.4 * 0.6**2, 9.81 * (1.2 * 0.3 + 2.4 * 0.6)
    a, b = 1.0, cos(radians(60) / 2)
    for _ in range(6):
        a, b = (a + b) / 2, sqrt(a * b)
    period = 2 * pi * sqrt(inertia / moment) / a
    words = ("simulate", "physical-pendulum", "--duration", f"{period!r}s", "--steps", "100")
    text = run(tmp_path, *words, "-o", "p.csv").done()
    angle = column(tmp_path / "p.csv", "input O position [deg]")
    assert angle[[0, 50, 100]] == pytest.approx([-30, -150, -30], abs=1e-7)
    assert column(tmp_path / "p.csv", "time [s]")[-1] == pytest.approx(period, rel=1e-15)
    kinetic, potential = (column(tmp_path / "p.csv", f"energy {what} [J]") for what in ("kinetic", "potential"))
    np.testing.assert_allclose(potential, moment * np.sin(np.radians(angle)), rtol=1e-9)
    np.testing.assert_allclose(kinetic + potential, -moment / 2, rtol=1e-10)
    assert row(text, "Inputs", "O")[1:7] == ["let", "go", "deg", "-30.0000", "-30.0000", "-150.000"]
    assert float(row(text, "Inputs", "O")[8]) == pytest.approx(sqrt(moment / inertia), rel=1e-5)
    assert [float(each) for each in row(text, "Energy", "kinetic")[-2:]] == pytest.approx([0, moment / 2], rel=1e-5)
    found = json.loads(run(tmp_path, *words, "--json").done())
    assert found["energy_balance"] < 1e-9
    assert found["driven"] == []
    assert found["residual"] < 1e-12
    np.testing.assert_allclose(found["energy"]["kinetic"], kinetic, atol=1e-14)


def test_an_input_that_is_driven_keeps_its_speed_and_the_others_are_let_go(tmp_path):
    """A double pendulum whose upper arm turns steadily: the work put in is what the energies gain."""
    mechanism = heavy("open-arm")
    first, *others = (given.pair for given in mechanism.inputs)
    speed = next(given.velocity for given in mechanism.inputs)
    model = kept(tmp_path, mechanism)
    words = ("simulate", model, "--duration", "300ms", "--steps", "30", "--drive", first)
    found = json.loads(run(tmp_path, *words, "--json").done())
    assert found["driven"] == [first]
    assert found["inputs"][first]["velocity"] == pytest.approx([speed] * 31, rel=1e-12)
    gained = np.array(found["energy"]["kinetic"]) + found["energy"]["potential"]
    np.testing.assert_allclose(found["energy"]["work"], gained - gained[0], atol=1e-9 * np.abs(gained).max())
    text = run(tmp_path, *words).done()
    assert row(text, "Inputs", first)[1] == "driven"
    assert all(row(text, "Inputs", other)[1:3] == ["let", "go"] for other in others)


def test_what_rounding_leaves_of_a_place_or_an_energy_is_told_as_nothing(tmp_path):
    """A piston on the x-axis: its y is 0, not 1e-14 mm; without weights and springs there is no potential energy."""
    mechanism = replace(heavy("slider-crank"), gravity=(0.0, 0.0))
    text = run(tmp_path, "simulate", kept(tmp_path, mechanism), "--duration", "0.2s", "--moving").done()
    assert row(text, "Points", "B")[3:5] == ["0", "0"]
    assert row(text, "Energy", "potential")[2:] == ["0"] * 4


def test_it_starts_from_rest_unless_it_moves_already(tmp_path):
    for words, speed in (((), 0.0), (("--moving",), 1.0)):
        whole = ("simulate", "physical-pendulum", "--duration", "0.1", "--steps", "5", "--json", *words)
        assert json.loads(run(tmp_path, *whole).done())["inputs"]["O"]["velocity"][0] == pytest.approx(speed)


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (("physical-pendulum",), 2, "command line: missing option '--duration'"),
        (("physical-pendulum", "--duration", "5 mm"), 2, "--duration: "),
        (("physical-pendulum", "--duration", "-1s"), 2, ""),
        (("physical-pendulum", "--duration", "1s", "--drive", "P"), 2, "--drive: there is no input at 'P'"),
        (("physical-pendulum", "--duration", "1s", "--steps", "0"), 2, "steps: "),
        (
            ("physical-pendulum", "--duration", "1s", "-o", "p.txt"),
            2,
            "a file name that ends in '.txt': a run can be written to",
        ),
        (("physical-pendulum", "--duration", "1s", "--json", "-o", "p.csv"), 2, "-o: "),
        (("four-bar", "--duration", "1s"), 1, "too few inputs: links 'AB', 'BC' and 'DC' can move without anything"),
    ],
)
def test_what_a_simulation_cannot_do_is_refused(tmp_path, words, status, told):
    assert run(tmp_path, "simulate", *words).refused(status).startswith(told)
    assert not list(tmp_path.iterdir())


def test_a_simulation_that_stops_is_told_as_far_as_it_goes_and_ends_with_status_1(tmp_path, monkeypatch):
    whole_way = simulation.simulate

    def stopping(*given, **more):
        whole = whole_way(*given, **more)
        motion = replace(whole.motion.up_to_row(4), outcome=Outcome.BRANCH_LOST, reason="told only to 0.08 s")
        energies = {name: getattr(whole, name)[:5] for name in ("kinetic", "potential", "work", "lost")}
        return replace(whole, motion=motion, **energies)

    words = ("simulate", "physical-pendulum", "--duration", "0.2s", "--steps", "10", "-o", "p.csv")
    monkeypatch.setattr(simulation, "simulate", stopping)
    ended = run(tmp_path, *words)
    assert ended.status == 1
    assert ended.err == "planar: branch lost: told only to 0.08 s\n"
    assert "in time, from 0 s to 0.08 s" in ended.out
    assert len(column(tmp_path / "p.csv", "energy kinetic [J]")) == 5


# drawings of a mechanism let go


@pytest.fixture(scope="module")
def swing():
    return planar.simulate(MODELS["physical-pendulum"], 2.4, 360).motion


def test_diagrams_of_a_motion_in_time_are_of_that_motion(swing):
    figure = planar.plot.diagrams(swing, "D")
    drawn = {line.get_gid(): line.get_xydata() for chart in figure.axes for line in chart.lines}
    for axis, letter in enumerate("xy"):
        found = drawn[f"V{letter}"]
        np.testing.assert_allclose(found, np.stack([swing.time, swing.point("D").velocity[:, axis]], axis=1))
    assert [chart.get_label() for chart in figure.axes][3:] == ["time"]


def test_positions_and_paths_of_a_motion_in_time_follow_the_clock(swing):
    told = positions(swing, 12)
    assert "The next positions follow every 0.2 s" in told.notes
    place = swing.point("D").position[30] / (1e-3 * told_scale(told))
    assert any(np.allclose(mark.centre, place) for mark in told.marks if getattr(mark, "about", "") == "position of D")
    assert "Paths over 2.4 s, marked at 12 equal divisions" in loci(swing, ["D"]).notes


def told_scale(picture) -> float:
    """Millimetres of the mechanism to one on paper."""
    return float(next(note for note in picture.notes if note.startswith("Space")).split("= ")[1].split()[0]) / 10


def test_an_animation_of_a_motion_in_time_goes_through_it_once(swing):
    script = plan_animation(swing, ["D"], 37)
    assert script.rows == script.traced == tuple(range(0, 361, 10))


def test_the_lamp_is_in_balance_wherever_it_stands():
    """k h r = g L (sum of the weights' parts): the spring's moment is that of the weights at every angle."""
    found = planar.forces(planar.cycle(MODELS["balanced-lamp"], 24, 0.1, 1.5), inertia=False)
    acting = [each for each in found.acting if each.kind in ("weight", "spring")]
    assert max(np.abs(each.power).max() for each in acting) > 0.1
    # the pins carry up to eighty times the weights, since arm and stay lie all but in one line: every one of the
    # nine equations of the three links rounds moments as great as these forces at the arm's length
    held = sum(np.linalg.norm(found.reactions[name].force, axis=-1) for name in "OPAB")
    assert np.all(np.abs(found.inputs["O"]) <= 9.0 * np.finfo(float).eps * held * 0.4)
