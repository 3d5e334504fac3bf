"""What designers ask of a motion, against closed forms, against fine samples, and by construction."""

import json
import re
from dataclasses import replace
from itertools import pairwise
from math import acos, asin, atan2, hypot, inf, pi, radians, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console
from scipy.optimize import minimize_scalar

import planar
from planar.cli import main
from planar.foundation.errors import BadInput, Unknown
from planar.model.loads import Load
from planar.model.mechanism import Drive, relative_motions, replace_inputs
from planar.reports.tables.answers import record, tables
from tests import command
from tests.builders import crank_rocker, open_four_bar, slider_crank
from tests.closed_forms import between, meeting, turn_apart
from tests.draws import first_cases, part

SEEDS = part(range(8), 2)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_crank_rocker_swings_and_returns_as_the_law_of_cosines_says(seed):
    a, b, c, d = crank_rocker(seed)
    motion = planar.cycle(open_four_bar(a, b, c, d, velocity=-2.0 if seed % 2 else 3.0), 24)
    outer, inner = between(c, d, a + b), between(c, d, b - a)  # at D, from the frame
    for name in ("DC", "D"):
        found = planar.swing(motion, name)
        assert found.least.value == pytest.approx(pi - outer, abs=1e-11)
        assert found.greatest.value == pytest.approx(pi - inner, abs=1e-11)
        assert found.angle == pytest.approx(outer - inner, abs=1e-11)
        # crank and coupler are in line, stretched and folded
        assert turn_apart(found.least.input, between(a + b, d, c)) < 1e-9
        assert turn_apart(found.greatest.input, pi + between(b - a, d, c)) < 1e-9
    off = between(a + b, d, c) - between(b - a, d, c)
    ratio = planar.time_ratio(motion, "DC")
    assert ratio.ratio == pytest.approx((pi + abs(off)) / (pi - abs(off)), rel=1e-9)
    assert ratio.out.travel + ratio.back.travel == pytest.approx(2.0 * pi, abs=1e-12)
    assert ratio.out.travel == pytest.approx(pi - off if seed % 2 == 0 else pi + off, abs=1e-9)
    assert ratio.out.time == pytest.approx(ratio.out.travel / (2.0 if seed % 2 else 3.0), rel=1e-12)
    assert planar.swing(motion, "AB") is None  # it turns right round
    assert planar.time_ratio(motion, "AB") is None


@pytest.mark.parametrize("seed", SEEDS)
def test_an_offset_slider_cranks_stroke_and_time_ratio_are_the_closed_forms(seed):
    rng = np.random.default_rng(100 + seed)
    a, b = float(rng.uniform(0.1, 0.5)), float(rng.uniform(0.7, 2.0))
    e = float(rng.uniform(-0.9, 0.9)) * (b - a)
    motion = planar.cycle(slider_crank(a, b, e), 24)
    assert planar.stroke(motion, "stroke").length == pytest.approx(
        sqrt((a + b) ** 2 - e**2) - sqrt((b - a) ** 2 - e**2), rel=1e-10
    )
    off = abs(asin(e / (b - a)) - asin(e / (a + b)))
    assert planar.time_ratio(motion, "stroke").ratio == pytest.approx((pi + off) / (pi - off), rel=1e-9)
    of_point = planar.time_ratio(motion, "B", "x")
    assert of_point.ratio == pytest.approx((pi + off) / (pi - off), rel=1e-9)


@pytest.mark.parametrize(
    ("name", "of", "part"),
    [
        ("004-QR", "stroke", 0.1 / 0.25),
        ("004-QR", "CD", 0.1 / 0.25),
        ("crank-and-slotted-lever", "ram", 60 / 120),
        ("whitworth", "guide", 40 / 100),
    ],
)
def test_whitworths_and_the_slotted_levers_time_ratios_are_the_textbooks(name, of, part):
    # cos(alpha / 2) = OA / OC of the lever, OC / OA of Whitworth's: (360 - alpha) / alpha
    alpha = 2.0 * acos(part)
    found = planar.time_ratio(planar.cycle(planar.load(name)), of)
    assert found.ratio == pytest.approx((2.0 * pi - alpha) / alpha, rel=1e-12)
    assert min(found.out.travel, found.back.travel) == pytest.approx(alpha, abs=1e-12)


def test_the_shapers_lever_swings_twice_the_angle_of_its_tangent():
    assert planar.swing(planar.cycle(planar.load("004-QR")), "CD").angle == pytest.approx(2.0 * asin(0.4), abs=1e-12)


def test_a_swing_does_not_jump_where_an_angle_passes_half_a_turn():
    mechanism = planar.to_dict(open_four_bar(0.2, 0.6, 0.5, 0.7))
    mechanism["links"]["DC"]["ends"] = ["C", "D"]  # the rocker's own angle now passes -180 degrees or not
    found = planar.swing(planar.cycle(planar.from_dict(mechanism), 24), "DC")
    assert found.angle == pytest.approx(between(0.5, 0.7, 0.8) - between(0.5, 0.7, 0.4), abs=1e-11)


def test_a_slide_has_no_swing_and_no_return_without_a_whole_turn():
    motion = planar.cycle(planar.load("004-QR"), 40, 0.0, 3.0)
    assert planar.swing(motion, "stroke") is None
    assert planar.time_ratio(motion, "stroke") is None


def door_angle(o):
    """The door hangs between the ends of arm and guide, 900 mm apart."""
    a = 1250j + 492.4 * np.exp(1j * o)
    b = meeting(a, 900.0, 700.0 + 1900.0j, 538.5)
    return np.angle(b - a)


def thigh_angle(b):
    """Shank, rear link, thigh and front link; the thigh's axis is upright where the line DC is as drawn."""
    d = -22.0 + 10.0j + abs(8.0 + 38.0j) * np.exp(1j * b)
    c = meeting(d, abs(26.0 + 14.0j), 20.0 + 0.0j, abs(-8.0 + 62.0j))
    return np.unwrap(np.atleast_1d(np.angle((c - d) / (26.0 + 14.0j) * 1j)))


def terminal_lines(motion, name):
    """The table of answers about a name, line by line."""
    console = Console(width=200)
    with console.capture() as shown:
        console.print(tables(motion, {name: planar.answers(motion, name)}))
    return [line.strip() for line in shown.get().splitlines()]


@pytest.fixture(scope="module")
def short_ranges():
    """Runs between limits of the input: stops of a slide, stops of a pin, dead points."""
    paths = {path.stem: path for path in (Path(__file__).parents[1] / "data" / "ranges").glob("*.json")}
    return {name: planar.cycle(planar.load(path), 24) for name, path in paths.items()}


def test_a_boom_swings_as_far_as_the_law_of_cosines_says_between_its_cylinders_stops(short_ranges):
    motion = short_ranges["boom-on-a-cylinder"]
    ground = hypot(0.6, 0.4)
    least, greatest = (radians(8.0) - atan2(0.4, 0.6) + between(1.2, ground, cylinder) for cylinder in (0.8, 1.3))
    swing = planar.swing(motion, "boom")
    assert (swing.least.value, swing.greatest.value) == pytest.approx((least, greatest), abs=1e-12)
    assert swing.angle == pytest.approx(greatest - least, abs=1e-12)
    assert (swing.least.input, swing.greatest.input) == pytest.approx((0.8, 1.3), abs=1e-12)
    assert swing.turning == (False, False)
    assert [(each.kind, each.of, each.input) for each in motion.limits] == [
        ("stop", "cylinder", pytest.approx(end)) for end in (0.8, 1.3)
    ]
    assert planar.extremes(motion, "boom")[2:] == (*swing[1:4], (False, False))
    travel = planar.stroke(motion, "cylinder")
    assert [*travel.top, *travel.bottom, travel.length] == pytest.approx([1.3, 1.3, 0.8, 0.8, 0.5], abs=1e-12)
    assert planar.extremes(motion, "cylinder", "displacement").turning == travel.turning == (False, False)


@pytest.mark.parametrize(
    ("name", "link", "angle", "turning"),
    [("garage-door", "door", door_angle, (False, True)), ("knee", "thigh", thigh_angle, (True, False))],
)
def test_one_extreme_may_turn_back_and_the_other_be_an_end_of_the_range(short_ranges, name, link, angle, turning):
    motion = short_ranges[name]
    swing = planar.swing(motion, link)
    ends = motion.inputs[motion.running_input].position[[0, -1]]
    inputs = np.linspace(*ends, 20001)[1:-1]
    values = angle(inputs)
    assert swing.turning == turning
    for extreme, turns, row, sign in (
        (swing.least, turning[0], np.argmin(values), 1.0),
        (swing.greatest, turning[1], np.argmax(values), -1.0),
    ):
        if turns:
            beside = inputs[[row - 1, row + 1]]

            def signed_angle(position, sign=sign):
                return sign * angle(np.array([position]))[0]

            best = minimize_scalar(signed_angle, bounds=beside, method="bounded", options={"xatol": 1e-10})
            assert extreme.input == pytest.approx(best.x, abs=1e-7)
            assert extreme.value == pytest.approx(sign * best.fun, abs=1e-12)
        else:
            assert row == len(inputs) - 1
            assert extreme.input == ends[1]
            beside = angle(np.append(inputs, ends[1] - 1e-9))[-1]  # at a dead point it moves as a root there
            assert extreme.value == pytest.approx(beside, abs=1e-3)
    assert swing.angle == swing.greatest.value - swing.least.value


def test_the_table_says_of_each_end_whether_it_turns_back(short_ranges):
    lines = terminal_lines(short_ranges["knee"], "thigh")
    (least,) = (line for line in lines if "least angle" in line)
    (greatest,) = (line for line in lines if "greatest angle" in line)
    assert least.split() == ["least", "angle", "79.7585", "deg", "126.017", "deg", "turns", "back"]
    assert greatest.split()[-6:] == ["299.542", "deg", "end", "of", "the", "range"]
    assert not any("does not turn back" in line for line in lines)
    turning = terminal_lines(planar.cycle(planar.load("crank-rocker"), 24), "crank")
    assert any("it rotates fully, 1 turn over the range" in line for line in turning)


def test_extremes_of_an_angle_that_rotates_fully_are_the_ends_of_its_range():
    motion = planar.cycle(planar.load("crank-rocker"), 24)
    crank = planar.extremes(motion, "crank", "angle")
    assert crank.length == pytest.approx(2.0 * pi, abs=1e-12)
    assert crank.turning == (False, False)
    with pytest.raises(BadInput, match="'crank' has no displacement, but an angle"):
        planar.extremes(motion, "crank", "displacement")
    rocker = planar.extremes(motion, "B", "angle")  # of the pair: without an axis the point of this name is meant
    assert rocker.length == planar.swing(motion, "B").angle


def test_extreme_positions_of_a_crank_pin_are_those_of_its_circle():
    motion = planar.cycle(open_four_bar(0.2, 0.6, 0.5, 0.7), 10)
    for axis, way in (("x", 0.0), ("y", pi / 2.0), (0.9, 0.9)):
        found = planar.extremes(motion, "B", axis)
        assert found.greatest.value == pytest.approx(0.2, abs=1e-14)
        assert found.least.value == pytest.approx(-0.2, abs=1e-14)
        assert turn_apart(found.greatest.input, way) < 1e-12
        assert turn_apart(found.least.input, way + pi) < 1e-12
        assert found.turning == (True, True)


def test_over_a_part_of_a_turn_a_point_may_be_extreme_at_its_ends():
    motion = planar.cycle(open_four_bar(0.2, 0.6, 0.5, 0.7), 10, 0.3, 2.0)
    found = planar.extremes(motion, "B", "y")
    assert found.turning == (False, True)
    assert found.least.input == pytest.approx(0.3, abs=1e-12)
    assert found.least.value == pytest.approx(0.2 * sin(0.3), abs=1e-14)


@pytest.mark.parametrize("steps", first_cases([4, 7, 12]))
def test_coarse_samples_miss_no_extreme_of_a_coupler_curve(steps):
    fine = planar.cycle(planar.load("hoeken-straight-line"), 720)
    motion = planar.cycle(planar.load("hoeken-straight-line"), steps)
    for axis, column in (("x", 0), ("y", 1)):
        values = fine.point("P").position[:, column]
        found = planar.extremes(motion, "P", axis)
        assert found.least.value <= values.min() + 1e-12
        assert found.greatest.value >= values.max() - 1e-12
        assert found.least.value == pytest.approx(values.min(), abs=1e-5)
        assert found.greatest.value == pytest.approx(values.max(), abs=1e-5)


def test_the_greatest_rate_of_a_link_is_what_fine_samples_come_to():
    mechanism = planar.load("crank-rocker")
    fine, motion = planar.cycle(mechanism, 3600).link("rocker"), planar.cycle(mechanism, 24)
    found = planar.greatest(motion, "rocker")
    assert found.value == pytest.approx(np.abs(fine.angular_velocity).max(), rel=1e-5)
    assert found.value >= np.abs(fine.angular_velocity).max() * (1.0 - 1e-12)
    assert abs(planar.solve(mechanism, {"A0": found.input}).link("rocker").angular_acceleration) < 1e-9
    hardest = planar.greatest(motion, "rocker", "acceleration")
    assert hardest.value == pytest.approx(np.abs(fine.angular_acceleration).max(), rel=1e-5)


@pytest.mark.parametrize(("start", "part"), first_cases([(None, 0.01), (-0.1, 0.03), (0.0, 0.01), (None, 0.03)], 2))
def test_a_scotch_yoke_dwells_as_long_as_its_cosine_does(start, part):
    # x = r cos A: within w of r over 2 acos(1 - w / r)
    motion = planar.cycle(planar.load("scotch-yoke"), 24, start, None if start is None else start + 2.0 * pi)
    found = planar.dwells(motion, "stroke", within=part * 0.15, least=0.0)
    wide = 2.0 * acos(1.0 - 2.0 * part)
    assert len(found) == 2
    assert {round(each.at.value, 9) for each in found} == {0.075, -0.075}
    for each in found:
        assert each.travel == pytest.approx(wide, abs=1e-11)
        assert turn_apart(each.start, (0.0 if each.at.value > 0.0 else pi) - 0.5 * wide) < 1e-11
        assert each.stop == pytest.approx(each.start + each.travel, abs=1e-14)
        assert each.time == pytest.approx(wide / (10.0 * pi), rel=1e-11)
    assert planar.dwells(motion, "stroke", within=part * 0.15, least=wide + 0.01) == ()


def test_by_default_harmonic_motion_is_no_dwell_and_a_hypocycloids_is():
    assert planar.dwells(planar.cycle(planar.load("scotch-yoke"), 24), "stroke") == ()
    mechanism = planar.load("hypocycloid-dwell")
    (found,) = planar.dwells(planar.cycle(mechanism, 48), "stroke")
    assert found.within == pytest.approx(0.002, rel=1e-9)
    for end in (found.start, found.stop):
        at = planar.solve(mechanism, {"O": end}).pair("stroke")["displacement"]
        assert abs(at - found.at.value) == pytest.approx(found.within, rel=1e-9)
    assert turn_apart(0.5 * (found.start + found.stop), pi) < 1e-9
    assert found.travel > radians(60.0)


def test_a_dwell_may_be_cut_by_the_range_and_ripples_make_one_dwell():
    short = planar.cycle(planar.load("scotch-yoke"), 24, -0.05, 1.0)
    (found,) = planar.dwells(short, "stroke", within=0.0015, least=0.0)
    assert (found.start, found.stop) == (pytest.approx(-0.05), pytest.approx(acos(1.0 - 0.02), abs=1e-11))
    line = planar.cycle(planar.load("hoeken-straight-line"), 48)
    wide = planar.dwells(line, "P", within=0.002, axis="y")
    spans = sorted((each.start, each.stop) for each in wide)
    assert all(one[1] <= other[0] for one, other in pairwise(spans))
    assert max(each.travel for each in wide) > radians(130.0)


def test_a_crank_pins_and_a_planets_curve_have_the_areas_of_circle_and_ellipse():
    motion = planar.cycle(open_four_bar(0.2, 0.6, 0.5, 0.7), 12)
    found = planar.area(motion, "B")
    assert found.value == pytest.approx(pi * 0.04, rel=1e-14)
    assert found.error <= 1e-10 * found.value
    # Cardan's wheel turns as fast backwards: semi-axes 50 + d and 50 - d; a point of its rim runs along a diameter
    cardan = planar.cycle(planar.load("cardan-gears"), 12)
    assert planar.area(cardan, "E").value == pytest.approx(pi * 0.08 * 0.02, rel=1e-13)
    assert planar.area(cardan, "T").value == 0.0
    assert planar.area(cardan, "N").value == 0.0


@pytest.mark.parametrize("seed", SEEDS)
def test_the_area_of_a_coupler_curve_is_half_the_integral_of_x_dy_less_y_dx(seed):
    mechanism = open_four_bar(*crank_rocker(seed), velocity=1.0)
    fine = planar.cycle(mechanism, 720).point("P")
    x, y = fine.position[:-1].T
    u, v = fine.velocity[:-1].T
    whole = float(np.sum(x * v - y * u)) * pi / 720.0
    found = planar.area(planar.cycle(mechanism, 10), "P")
    assert found.value == pytest.approx(whole, abs=1e-11)
    back = planar.area(planar.cycle(mechanism, 10, 1.0, 1.0 - 2.0 * pi), "P")
    assert back.value == pytest.approx(-whole, abs=1e-11)


def geared_arms(ratio, length):
    """Two arms, the second of which turns `ratio` times as fast: P is exp(i t) + length exp(i ratio t)."""
    return planar.from_dict(
        {
            "planar": 1,
            "units": {"length": "m", "angle": "rad"},
            "frame": "frame",
            "links": {
                "frame": {"points": {"O": [0, 0]}},
                "arm": {"ends": ["O", "A"], "length": 1.0},
                "bar": {"ends": ["A", "P"], "length": length},
            },
            "pairs": [
                {"turning": "O"},
                {"turning": "A"},
                {"gear": "wheels", "links": ["arm", "bar"], "ratio": ratio},
            ],
            "inputs": [{"pair": "O", "position": 0.3}],
        }
    )


def test_the_net_area_of_a_path_that_crosses_itself_is_the_sum_of_its_loops():
    """A limacon r = 1 + 2 cos t, whose inner loop counts twice, and a path of three petals that cancel its middle."""
    found = planar.area(planar.cycle(geared_arms(2, 1.0), 12), "P")
    assert found.crossings == 1
    assert sorted(found.loops) == pytest.approx([pi - 1.5 * sqrt(3.0), 2.0 * pi + 1.5 * sqrt(3.0)], rel=1e-12)
    assert found.value == pytest.approx(sum(found.loops), rel=1e-12)
    back = planar.area(planar.cycle(geared_arms(2, 1.0), 12, 0.3, 0.3 - 2.0 * pi), "P")
    assert sorted(back.loops) == pytest.approx(sorted(-loop for loop in found.loops), rel=1e-12)
    petals = planar.area(planar.cycle(geared_arms(-2, sqrt(0.5)), 12), "P")
    assert petals.crossings == 3
    *outer, middle = sorted(petals.loops)
    assert outer == pytest.approx([outer[0]] * 3, rel=1e-10)
    assert petals.value == pytest.approx(0.0, abs=1e-12)
    assert sum(outer) == pytest.approx(-middle, rel=1e-10)
    simple = planar.area(planar.cycle(geared_arms(2, 0.2), 12), "P")
    assert (simple.crossings, simple.loops) == (0, (simple.value,))


def test_the_table_says_that_the_area_of_a_figure_of_eight_is_net(tmp_path):
    (tmp_path / "arms.json").write_text(planar.dumps(geared_arms(-2, sqrt(0.5))), encoding="utf-8")
    text = command.run(tmp_path, "cycle", "arms.json", "--steps", "12", "--of", "P").done()
    assert re.search(r"net area of its curve +0 m² +3 crossings; anticlockwise positive", text)
    assert "loops, sum of sizes" in text
    rows = command.run(tmp_path, "cycle", "arms.json", "--steps", "12", "--of", "A").done()
    assert "net area" not in rows


def test_an_open_curve_has_no_area():
    for motion in (planar.cycle(planar.load("crank-rocker"), 10, 0.0, 3.0), planar.cycle(planar.load("four-bar"), 10)):
        with pytest.raises(BadInput, match="does not come back"):
            planar.area(motion, "B")


@pytest.mark.parametrize("output", ["stroke", "CD", "D"])
def test_the_advantage_over_a_motion_is_that_of_every_position(output):
    mechanism = planar.load("004-QR")
    motion = planar.cycle(mechanism, 12)
    found = planar.advantage_over(motion, output)
    for row in (0, 3, 8):
        state = planar.solve(mechanism, {"O": motion.inputs["O"].position[row]})
        assert found.values[row] == pytest.approx(planar.advantage(state, output).by_power, rel=1e-9)
        assert found.measure == planar.advantage(state, output).measure
    ends = [asin(0.4) + pi, 2.0 * pi - asin(0.4)]
    assert found.infinite == pytest.approx(ends, abs=1e-11)
    assert found.least.value <= np.abs(found.values).min()


LOADS_OF_ALL_KINDS = (
    Load(point="E", force=(-3.0, 4.0)),
    Load(point="E", force=(-3.0, 4.0), axes="rod"),
    Load(link="rod", torque=-5.0),
    Load(pair="stroke", effort=-2.0),
    Load(points=("O", "E"), effort=3.0),
    Load(point="B", force=(0.0, 0.0)),
)


@pytest.mark.parametrize("output", ["loads.0", "loads.1", "loads.2", "loads.3", "loads.4", "O,E", "B,O"])
def test_the_advantage_over_a_motion_takes_loads_by_name(output):
    mechanism = replace(planar.load("slider-crank"), loads=LOADS_OF_ALL_KINDS)
    motion = planar.cycle(mechanism, 12)
    found = planar.advantage_over(motion, output)
    assert found.output == output
    for row in (1, 4, 8):
        wanted = planar.advantage(planar.solve(mechanism, {"O": motion.inputs["O"].position[row]}), output)
        assert found.values[row] == (inf if wanted.by_power is None else pytest.approx(wanted.by_power, rel=1e-9))
        assert found.measure == wanted.measure
    near = planar.advantage(planar.solve(mechanism, {"O": found.least.input}), output)
    assert found.least.value == pytest.approx(abs(near.by_power), rel=1e-9)
    for position in found.infinite:
        around = [
            planar.advantage(planar.solve(mechanism, {"O": position + step}), output).by_power for step in (-1e-4, 1e-4)
        ]
        assert around[0] * around[1] < 0.0
        assert min(map(abs, around)) > 100.0 * found.least.value
    assert len(found.infinite) == 2


def test_a_load_that_is_zero_or_not_there_has_no_advantage_over_a_motion():
    motion = planar.cycle(replace(planar.load("slider-crank"), loads=LOADS_OF_ALL_KINDS), 12)
    with pytest.raises(BadInput, match="the load is zero"):
        planar.advantage_over(motion, "loads.5")
    with pytest.raises(Unknown, match=r"no point, link, pair or load 'loads.9'"):
        planar.advantage_over(motion, "loads.9")


def test_an_advantage_is_infinite_at_a_sample_on_an_end_and_without_rates_not_told():
    motion = planar.cycle(planar.load("000-P5"), 4, 0.0, 2.0 * pi)
    found = planar.advantage_over(motion, "stroke")
    assert list(np.isinf(found.values)) == [True, False, True, False, True]
    between = planar.advantage_over(planar.cycle(planar.load("four-bar"), 24), "DC")
    assert np.isnan(between.values[[0, -1]]).all()
    assert np.isfinite(between.values[1:-1]).all()
    assert between.least.value == 0.0  # towards a limit the output is ever faster


def test_what_there_is_not_is_refused_in_a_sentence():
    motion = planar.cycle(planar.load("crank-rocker"), 12)
    for ask in (planar.swing, planar.time_ratio, planar.dwells, planar.advantage_over, planar.answers, planar.greatest):
        with pytest.raises(Unknown, match="there is no"):
            ask(motion, "nothing")
    with pytest.raises(Unknown, match="there is no pair and no link"):
        planar.extremes(motion, "nothing")
    with pytest.raises(Unknown, match="there is no point"):
        planar.extremes(motion, "nothing", "x")
    with pytest.raises(BadInput, match="'x', 'y' or a direction"):
        planar.extremes(motion, "A", "z")
    with pytest.raises(BadInput, match="direction"):
        planar.extremes(motion, "A", inf)
    with pytest.raises(BadInput, match="not negative"):
        planar.dwells(motion, "rocker", within=-1.0)


def test_what_slides_without_turning_is_not_said_to_stand_still():
    motion = planar.cycle(planar.load("scotch-yoke"), 12)
    for name, sentence in (("yoke", "it does not turn"), ("frame", "it does not turn")):
        (found,) = planar.answers(motion, name)
        assert sentence in found.notes
        assert "it does not move" not in found.notes


@pytest.mark.parametrize(
    ("name", "of"),
    [("four-bar", "DC"), ("cardan-gears", "mesh"), ("single-link", "O")],
)
def test_the_answers_of_a_name_are_told_in_a_table_and_as_json(name, of):
    motion = planar.cycle(planar.load(name), 24)
    asked = {of: planar.answers(motion, of)} if of in {*motion.pairs, *motion.links} else {}
    value = json.loads(json.dumps(record(asked), allow_nan=False))
    assert value.keys() == asked.keys()
    assert tables(motion, asked)


def test_a_pin_is_asked_of_as_pair_and_as_point():
    motion = planar.cycle(planar.load("crank-rocker"), 24)
    pair, point = planar.answers(motion, "B")
    assert (pair.what, point.what) == ("pair", "point")
    assert pair.swing.angle == planar.swing(motion, "B").angle
    assert point.extremes[0].greatest == planar.extremes(motion, "B").greatest
    rates = np.abs(planar.cycle(planar.load("crank-rocker"), 720).pair("B")["relative_angular_velocity"])
    assert pair.velocity.value == pytest.approx(rates.max(), rel=1e-5)  # of the joint's motion, not of its point's


def test_an_input_at_rest_is_told_per_unit():
    mechanism = replace_inputs(planar.load("crank-rocker"), (Drive("A0", None, 0.0, 0.0),))
    (found,) = planar.answers(planar.cycle(mechanism, 24), "rocker")
    assert found.per_unit
    assert found.velocity.value == pytest.approx(1.0 / found.advantage.least.value, rel=1e-12)


def test_the_command_prints_answers_beside_the_run():
    told = CliRunner().invoke(main, ["cycle", "004-QR", "--steps", "24", "--of", "CD"])
    assert told.exit_code == 0, told.output
    assert "Answers of link CD" in told.output
    assert "1.70995" in told.output
    assert "47.1564 deg" in told.output
    value = json.loads(
        CliRunner().invoke(main, ["cycle", "004-QR", "--steps", "24", "--json", "--of", "stroke"]).output
    )
    assert value["answers"]["stroke"]["pair"]["stroke"]["length"] == pytest.approx(0.4, rel=1e-9)
    assert value["answers"]["stroke"]["pair"]["time_ratio"]["ratio"] == pytest.approx(1.7099527817, rel=1e-9)
    refused = CliRunner().invoke(main, ["cycle", "004-QR", "--steps", "24", "--of", "nothing"])
    assert refused.exit_code == 2
    assert "--of" in refused.output


@pytest.mark.parametrize(
    "model",
    part(["four-bar", "hart-inversor", "triple-rocker", "watt-parallel-motion", "jansen-leg", "crank-rocker"], 2),
)
def test_an_angle_of_one_thing_is_told_one_way(model):
    """A pair on the frame turns as its link does; both start between -180 and 180 degrees, as a position has them."""
    motion = planar.cycle(planar.load(model), 24)
    state = planar.solve(motion.mechanism)
    compared = 0
    for name, pair in relative_motions(motion.mechanism).items():
        told = next(iter(motion.pair(name).values()))
        here = next(iter(state.pair(name).values()))
        if name in motion.inputs:
            assert told == pytest.approx(motion.inputs[name].position, abs=1e-9)
            assert here == pytest.approx(state.inputs[name].position, abs=1e-9)
        elif pair.links[0] == motion.mechanism.frame and pair.keyword == "turning":
            assert abs(told[0]) <= pi
            assert here == pytest.approx(state.link(pair.links[1]).angle, abs=1e-9)
            assert told == pytest.approx(motion.link(pair.links[1]).angle, abs=1e-9)
            by_pair, by_link = planar.swing(motion, name), planar.swing(motion, pair.links[1])
            assert (by_pair is None) == (by_link is None)
            if by_pair is not None:
                for one, other in zip(by_pair[1:3], by_link[1:3], strict=True):
                    assert one.value == pytest.approx(other.value, abs=1e-7)
            wide = [planar.dwells(motion, each, within=0.2, least=0.0) for each in (name, pair.links[1])]
            assert [each.at.value for each in wide[0]] == pytest.approx([each.at.value for each in wide[1]], abs=1e-7)
            if by_pair is not None:
                assert abs(by_pair.least.value) <= pi + 1e-6
                low, high = by_pair.least.value - 1e-7, by_pair.greatest.value + 1e-7
                ends = [each.value for each in motion.limits if each.kind == "stroke end" and each.of == name]
                assert all(low <= each <= high for each in (*ends, *(each.at.value for each in wide[0])))
            compared += 1
    assert compared
