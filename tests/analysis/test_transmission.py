"""Transmission angles, against the law of cosines, the rod's angle, and lines through joints."""

from math import acos, asin, pi

import numpy as np
import pytest

import planar
from planar.analysis.sensitivity.transmission_slopes import transmission_slopes
from planar.foundation.errors import BadInput, Outcome, Unknown
from tests.builders import crank_rocker, open_four_bar, slider_crank
from tests.closed_forms import turn_apart
from tests.draws import part
from tests.known import MODELS

SEEDS = part(range(8), 2)


def acute(angle):
    """The acute angle between two lines."""
    return np.minimum(angle, pi - angle)


def between(motion, first, second, third):
    """The acute angle at the second point between the lines to the others, from positions alone."""
    at = motion.point(second).position
    one, two = motion.point(first).position - at, motion.point(third).position - at
    return np.arctan2(np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]), np.abs(np.sum(one * two, axis=1)))


@pytest.mark.parametrize("seed", SEEDS)
def test_of_a_four_bar_it_is_the_angle_of_the_law_of_cosines(seed):
    a, b, c, d = crank_rocker(seed)
    motion = planar.cycle(open_four_bar(a, b, c, d), 24)
    found = planar.transmission(motion, "DC")
    theta = motion.inputs["A"].position
    expected = acute(np.arccos((b**2 + c**2 - a**2 - d**2 + 2.0 * a * d * np.cos(theta)) / (2.0 * b * c)))
    assert found.angle == pytest.approx(expected, abs=1e-10)
    assert found.through == ("C",)
    worst = {0.0: acute(acos((b**2 + c**2 - (d - a) ** 2) / (2.0 * b * c)))}
    worst[pi] = acute(acos((b**2 + c**2 - (d + a) ** 2) / (2.0 * b * c)))
    place = min(worst, key=worst.get)
    assert found.least.value == pytest.approx(worst[place], abs=1e-11)
    assert turn_apart(found.least.input, place) < 1e-7
    assert planar.transmission(motion, "D").angle == pytest.approx(found.angle, abs=1e-13)


@pytest.mark.parametrize("seed", SEEDS)
def test_of_a_slider_crank_it_is_the_rods_angle_with_the_perpendicular(seed):
    rng = np.random.default_rng(seed)
    a, b = float(rng.uniform(0.1, 0.5)), float(rng.uniform(0.7, 2.0))
    e = float(rng.uniform(-0.9, 0.9)) * (b - a)
    motion = planar.cycle(slider_crank(a, b, e), 24)
    found = planar.transmission(motion, "stroke")
    rod = np.arcsin((a * np.sin(motion.inputs["O"].position) - e) / b)
    assert found.angle == pytest.approx(0.5 * pi - np.abs(rod), abs=1e-11)
    assert found.least.value == pytest.approx(0.5 * pi - asin((a + abs(e)) / b), abs=1e-11)
    assert turn_apart(found.least.input, -0.5 * pi if e > 0.0 else 0.5 * pi) < 1e-7


@pytest.mark.parametrize(
    ("name", "output"), [("watt-six-bar", "DD0"), ("windscreen-wiper", "right wiper"), ("toggle-press", "block D")]
)
def test_a_state_tells_what_the_motion_does(name, output):
    mechanism = planar.load(name)
    motion = planar.cycle(mechanism, 12)
    found = planar.transmission(motion, output)
    pair = mechanism.inputs[0].pair
    for row in (1, 5, 9):
        state = planar.solve(mechanism, {pair: motion.inputs[pair].position[row]})
        one = planar.transmission(state, output)
        assert one.angle == pytest.approx(found.angle[row], abs=1e-9)
        assert one.least is None


def test_a_rocker_driven_by_a_rod_has_the_rods_angle_whatever_drives_the_rod():
    motion = planar.cycle(planar.load("crank-and-slotted-lever"), 24)
    ram = planar.transmission(motion, "ram")
    rod = motion.point("R").position - motion.point("S").position
    assert ram.angle == pytest.approx(np.arctan2(np.abs(rod[:, 0]), np.abs(rod[:, 1])), abs=1e-11)
    press = planar.cycle(planar.load("toggle-press"), 24)
    assert planar.transmission(press, "upper link").angle == pytest.approx(between(press, "A", "B", "C"), abs=1e-10)


def test_a_block_in_a_slot_drives_squarely():
    motion = planar.cycle(planar.load("slotted-lever"), 24)
    found = planar.transmission(motion, "CD")
    assert found.angle == pytest.approx(0.5 * pi, abs=1e-12)
    assert found.through == ("slot",)


def held_coupler():
    """A four-bar ABCD whose coupler is moved at P by the rod EP from a crank OE."""
    at = {"O": (-0.6, 0.6), "E": (-0.5, 0.75), "P": (0.4, 0.9), "A": (0.0, 0.0), "B": (0.1, 0.5), "C": (0.7, 0.6)}
    at["D"] = (0.8, 0.0)
    links = {"frame": "OAD", "OE": "OE", "EP": "EP", "AB": "AB", "BCP": "BCP", "DC": "DC"}
    return planar.from_dict(
        {
            "planar": 1,
            "name": "Held coupler",
            "frame": "frame",
            "links": {
                name: {"points": {each: list(at[each]) for each in points}}
                | ({} if name == "frame" else {"axis": [*points[:2]]})
                for name, points in links.items()
            },
            "pairs": [{"turning": each} for each in "OEPABCD"],
            "inputs": [{"pair": "O", "position": float(np.arctan2(0.15, 0.1)), "velocity": 1.0}],
            "sketch": {each: list(at[each]) for each in "EPBC"},
        }
    )


def test_a_coupler_held_at_two_other_pins_drives_through_the_point_where_their_lines_meet():
    # three forces in balance meet in one point: those along the rod EP and the link AB, and that on the output at C
    motion = planar.cycle(held_coupler(), 24)
    found = planar.transmission(motion, "DC")
    assert found.through == ("C",)
    points = {name: np.column_stack([each.position, np.ones(len(motion))]) for name, each in motion.points.items()}
    meet = np.cross(np.cross(points["E"], points["P"]), np.cross(points["A"], points["B"]))
    force, lever = np.cross(meet, points["C"])[:, :2], np.cross(points["C"], points["D"])[:, :2]
    cross = np.abs(force[:, 0] * lever[:, 1] - force[:, 1] * lever[:, 0])
    expected = np.arctan2(cross, np.abs(np.sum(force * lever, axis=1)))
    assert len(motion) == 25
    assert np.ptp(expected) > 0.01
    assert found.angle[1:-1] == pytest.approx(expected[1:-1], abs=1e-7)


def test_it_is_none_where_the_input_is_at_a_limit():
    motion = planar.cycle(planar.load("four-bar"), 24)
    found = planar.transmission(motion, "DC")
    assert found.angle[[0, -1]] == pytest.approx(0.0, abs=1e-6)
    assert found.least.value == pytest.approx(0.0, abs=1e-6)
    assert found.angle[1:-1] == pytest.approx(between(motion, "B", "C", "D")[1:-1], abs=1e-9)


@pytest.mark.parametrize(
    ("name", "output", "why"),
    [
        ("crank-rocker", "crank", "no other moving link drives"),
        ("four-bar", "AB", "no other moving link drives"),
        ("crank-rocker", "coupler", "no such link or pair"),
        ("crank-rocker", "B", "no such link or pair"),
        ("three-parallel-cranks", "crank C", "hold twice"),
        ("gear-reducer", "output shaft", "wheels drive"),
        ("double-butterfly", "CGH", "G and H, not at one pin"),
        ("oldham", "disc 2", "couple"),
    ],
)
def test_where_no_one_line_of_force_drives_a_link_it_is_refused(name, output, why):
    motion = planar.cycle(planar.load(name), 12)
    with pytest.raises(BadInput, match=why):
        planar.transmission(motion, output)


def test_another_name_is_refused():
    with pytest.raises(Unknown, match="there is no pair and no link"):
        planar.transmission(planar.cycle(planar.load("crank-rocker"), 12), "nothing")


def test_of_a_cam_with_a_translating_follower_it_is_the_complement_of_the_pressure_angle():
    motion = planar.cycle(planar.load("tangent-cam"), 48)
    found = planar.transmission(motion, "guide")
    centre, cam = motion.point("P"), motion.inputs["O"]
    # the follower's line passes through the centre of the cam
    pressure = np.arctan2(np.abs(centre.velocity[:, 1] / cam.velocity), centre.position[:, 1])
    assert pressure.max() > 0.2
    assert found.angle == pytest.approx(0.5 * pi - pressure, abs=1e-9)
    # greatest where the contact passes from the flank to the nose
    base, nose, roller, distance = 30.0, 23.88903174135038, 17.5, 23.61096825864962
    flank = acos((base - nose) / distance)
    greatest = np.arctan(distance * np.sin(flank) / (base + roller))
    assert found.least.value == pytest.approx(0.5 * pi - greatest, abs=1e-8)
    assert turn_apart(abs(found.least.input), flank - greatest) < 1e-8


def test_a_pin_between_two_meshes_of_wheels_drives_the_arm_squarely():
    found = planar.transmission(planar.cycle(planar.load("planetary-gear-set"), 12), "arm")
    assert found.through == ("P",)
    assert found.angle == pytest.approx(0.5 * pi, abs=1e-9)


# a motion whose lengths do not quite agree is refused, and a sweep is not
OUTPUTS = [
    (stem, link.name)
    for stem, mechanism in MODELS.items()
    for link in mechanism.links
    if mechanism.inputs and stem != "double-parallelogram"
]


@pytest.mark.parametrize(("stem", "output"), part(OUTPUTS, 8))
def test_that_of_a_motion_is_that_of_a_sweep(stem, output):
    mechanism, pair = MODELS[stem], MODELS[stem].inputs[0].pair
    start = mechanism.inputs[0].position
    try:
        motion = planar.cycle(mechanism, 6, start, start + 0.05, pair)
        angle = planar.transmission(motion, output).angle
    except (BadInput, planar.NoAnswer) as refusal:
        if isinstance(refusal, BadInput):
            with pytest.raises(planar.PlanarError):
                swept = planar.sweep(
                    mechanism, {f"{pair}.position": start}, 6, outputs=output, start=start, stop=start + 0.05, pair=pair
                )
                # what constraints that hold twice leave open is not a number there
                if np.isnan(swept.transmission_angle[output]).any():
                    raise refusal from None
        return
    swept = planar.sweep(
        mechanism, {f"{pair}.position": start}, 6, outputs=output, start=start, stop=start + 0.05, pair=pair
    )
    # a motion that comes to a limit ends there, beside a step of the sweep
    count = len(motion) if motion.outcome is Outcome.SOLVED else len(motion) - 1
    np.testing.assert_allclose(swept.transmission_angle[output][0][:count], angle[:count], atol=1e-7)


def test_there_are_no_slopes_where_an_input_drives_the_output():
    state = planar.solve(planar.load("tipper"))
    slopes = transmission_slopes(state, "tube")
    assert slopes.angle > 0.0
    assert np.isnan([*slopes.slopes.values()]).all()
