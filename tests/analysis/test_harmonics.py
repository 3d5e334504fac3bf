"""Harmonics of a turn and the two-term formula, against series in closed form, runs, and what the chapters print."""

from __future__ import annotations

import json
from math import acos, comb, cos, degrees, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planar
from planar.analysis.motion.analytical_route import analytical_routes
from planar.analysis.motion.harmonics import harmonics
from planar.analysis.motion.piston import ExactFormulas, Piston, TwoTermFormulas, find_piston
from planar.foundation.errors import BadInput, NoAnswer
from planar.model.mechanism import Drive, relative_motions, replace_inputs
from planar.reports.tables.analytical import record
from tests.builders import slider_crank
from tests.closed_forms import piston
from tests.command import run
from tests.draws import draws

NEAR = 1e-12
"""Part of a value: rounding of a position solved."""


def in_line_series(r, l, count):  # noqa: E741
    """Mean and cosines of r cos t + sqrt(l^2 - r^2 sin^2 t), by the binomial series and the powers of a sine."""
    squared = (r / l) ** 2
    mean, cosines = 0.0, np.zeros(count)
    cosines[0] = r
    half = 1.0  # the binomial coefficient of 1/2 over k
    for k in range(200):
        term = l * half * (-squared) ** k / 4.0**k
        mean += term * comb(2 * k, k)
        for j in range(1, min(k, count // 2) + 1):
            cosines[2 * j - 1] += 2.0 * term * (-1) ** j * comb(2 * k, k - j)
        half *= (0.5 - k) / (k + 1)
    return mean, cosines


# harmonics


@pytest.mark.parametrize(("r", "l"), [(0.15, 0.6), (0.16, 0.5), (0.03, 0.1), (0.3, 0.5)])
def test_an_in_line_piston_has_the_harmonics_of_the_binomial_series(r, l):  # noqa: E741
    found = harmonics(slider_crank(r, l), "stroke")
    mean, cosines = in_line_series(r, l, 12)
    assert found.mean == pytest.approx(mean, rel=NEAR)
    many = min(12, len(found.cosines))
    assert found.cosines[:many] == pytest.approx(cosines[:many], abs=1e-15)
    assert found.sines == pytest.approx(np.zeros(len(found.sines)), abs=1e-15)
    assert cosines[many:] == pytest.approx(np.zeros(12 - many), abs=1e-14)  # no more are left out than noise


@pytest.mark.parametrize("ratio", [0.2, 0.02, 0.002])
def test_the_two_terms_are_the_series_to_the_first_power_of_r_by_l(ratio):
    # c_2 = r^2/4l (1 + (r/l)^2/4 + ...), and what the two terms leave out is of the third power
    found, two = harmonics(slider_crank(ratio, 1.0), "stroke"), TwoTermFormulas(ratio, 1.0)
    assert found.cosines[0] == pytest.approx(ratio, rel=NEAR)
    assert found.cosines[1] == pytest.approx(0.25 * ratio**2 * (1.0 + 0.25 * ratio**2), rel=0.2 * ratio**4 + 1e-9)
    theta = np.linspace(0.0, 2.0 * pi, 50)
    off = found.displacement(0.0) - found.displacement(theta) - two.displacement(theta)
    assert np.abs(off).max() <= 0.13 * ratio**4 * (1.0 + ratio**2) + 1e-15  # (1/8) (r/l)^4 sin^4, the next term


EVERYWHERE = [
    ("002-E3.4", "guide F", None),
    ("004-QR", "stroke", None),
    ("004-QR", "slot", None),
    ("004-COS", "stroke", None),
    ("000-P2", "stroke", None),
    ("jansen-leg", "foot", "y"),
    ("crank-rocker", "B", "x"),
    ("crank-rocker", "coupler", None),
    ("drag-link", "B0", None),
    ("oldham", "slide 1", None),
    ("000-P5", "AB", None),
    ("000-P5", "A", None),
]


@pytest.mark.parametrize(("name", "of", "axis"), EVERYWHERE)
def test_the_series_is_the_motion_between_its_samples_with_its_rates(name, of, axis):
    mechanism = planar.load(name)
    crank = mechanism.inputs[0].pair
    found = harmonics(mechanism, of, axis)
    moving = replace_inputs(mechanism, (Drive(crank, None, 2.0, 3.0),))
    motion = planar.cycle(moving, 97)  # no divisor of the series' own positions
    if axis is not None:
        value, velocity, acceleration = (part["xy".index(axis)] for part in map(np.transpose, motion.point(of)))
    elif of in relative_motions(mechanism):
        value, velocity, acceleration = list(motion.pair(of).values())[:3]
    else:
        value, velocity, acceleration = motion.link(of)
    theta = motion.inputs[crank].position
    turned = found.turns * theta
    whole = value - found.displacement(theta) - turned
    assert np.abs(whole - 2.0 * pi * np.round(whole / (2.0 * pi))).max() < 1e-12
    assert found.velocity(theta, 2.0) + 2.0 * found.turns == pytest.approx(velocity, abs=1e-10)
    two = found.acceleration(theta, 2.0, angular_acceleration=3.0) + 3.0 * found.turns
    assert two == pytest.approx(acceleration, abs=1e-8)


def test_a_scotch_yoke_has_one_harmonic():
    found = harmonics(planar.load("004-COS"), "stroke")
    assert len(found.cosines) == 1
    assert (found.cosines[0], found.sines[0], found.mean) == pytest.approx((0.05, 0.0, 0.0), abs=1e-15)
    assert found.stroke.length == pytest.approx(0.1, rel=NEAR)


def test_an_angle_is_told_beyond_the_turns_that_it_goes_round():
    mechanism = planar.load("drag-link")
    assert harmonics(mechanism, "driver").turns == 1
    assert harmonics(mechanism, "driver").amplitudes == pytest.approx([0.0], abs=1e-14)
    assert harmonics(mechanism, "follower").turns == 1
    assert harmonics(mechanism, "follower").amplitudes[0] > 0.1
    assert harmonics(mechanism, "coupler").turns == 1  # all three go round with the shortest link fixed
    rocker = harmonics(planar.load("000-P5"), "AB")
    assert rocker.turns == 0
    assert rocker.kind == "angle"


def test_amplitudes_and_phases_say_the_same_as_cosines_and_sines():
    found = harmonics(planar.load("004-QR"), "stroke")
    theta, n = 0.7, np.arange(1, len(found.cosines) + 1)
    told = found.mean + float(np.sum(found.amplitudes * np.cos(n * theta - found.phases)))
    assert told == pytest.approx(float(found.displacement(theta)), rel=NEAR)


def test_counted_from_tdc_the_series_starts_at_the_top_and_at_rest():
    found = harmonics(planar.load("offset-slider-crank"), "stroke")
    top = found.stroke.top
    moved = found.since(top.input)
    assert float(moved.displacement(0.0)) == pytest.approx(top.value, rel=NEAR)
    assert float(moved.velocity(0.0, 1.0)) == pytest.approx(0.0, abs=1e-14)
    assert moved.stroke.top.input == 0.0
    assert moved.stroke.bottom.input == pytest.approx(found.stroke.bottom.input - top.input, abs=NEAR)
    theta = np.linspace(0.0, 6.0, 7)
    assert moved.displacement(theta) == pytest.approx(found.displacement(theta + top.input), abs=NEAR)
    link = harmonics(planar.load("drag-link"), "follower")
    turned = link.displacement(theta + 0.4) + link.turns * (theta + 0.4)
    assert link.since(0.4).displacement(theta) + link.turns * theta == pytest.approx(turned, abs=NEAR)


def test_a_shortened_series_is_off_by_what_it_leaves_out():
    found = harmonics(planar.load("000-P5"), "stroke")
    worst = found.truncation(2)
    # the fourth is the greatest that is left, and with those after it all of one sign at 90 degrees
    assert worst.value == pytest.approx(
        float(np.abs(found.displacement(pi / 2) - found.displacement(pi / 2, 2))), rel=1e-3
    )
    assert abs(found.cosines[3]) <= worst.value <= np.sum(np.abs(found.cosines[2:])) * (1.0 + 1e-9)
    assert found.truncation(2, 2).value > found.truncation(2, 1).value > worst.value
    assert found.truncation(len(found.cosines)).value == 0.0
    for order, function in enumerate((found.displacement, lambda t, k: found.velocity(t, 1.0, k))):
        theta = found.truncation(1, order).input
        off = abs(float(function(theta, None) - function(theta, 1)))
        assert off == pytest.approx(found.truncation(1, order).value, rel=1e-9)


def test_a_sharp_motion_takes_more_positions():
    smooth, sharp = (harmonics(slider_crank(r, 1.0), "stroke") for r in (0.3, 0.98))
    assert smooth.positions == 64
    assert sharp.positions > 256
    assert sharp.rest < 1e-14
    assert sharp.cosines[0] == pytest.approx(0.98, rel=NEAR)
    assert float(sharp.displacement(pi / 2.0)) == pytest.approx(sqrt(1.0 - 0.98**2), rel=1e-11)


def test_a_mechanism_that_stands_still_in_its_file_has_the_same_harmonics():
    moving, still = (harmonics(slider_crank(0.1, 0.3, 0.02, velocity=v, acceleration=v), "stroke") for v in (9.0, 0.0))
    assert still.cosines == pytest.approx(moving.cosines, abs=1e-16)
    assert still.stroke.top.input == pytest.approx(moving.stroke.top.input, abs=NEAR)


def test_of_several_inputs_one_turns():
    mechanism = planar.load("walschaerts-valve-gear")
    with pytest.raises(BadInput, match="several inputs, O, K; name the one that turns"):
        harmonics(mechanism, "guide")
    found = harmonics(mechanism, "guide", pair="O")
    assert found.input == "O"
    assert found.cosines[0] == pytest.approx(0.3, rel=NEAR)
    with pytest.raises(BadInput, match="there is no input at 'guide'"):
        harmonics(mechanism, "guide", pair="guide")


REFUSED = [
    (
        "four-bar",
        "E",
        "x",
        NoAnswer,
        "makes no full turn.*the range of 'A' ends at A = -103.792 deg and A = 103.792 deg",
    ),
    ("002-E3.6a", "stroke", None, BadInput, "after a turn of 'O' it is not where it was"),
    ("planetary-gear-set", "T", "x", BadInput, "it is not where it was"),
    ("landing-gear", "D", "x", BadInput, "the input at 'jack' slides"),
    ("000-P5", "B", "z", BadInput, "the axis is 'x' or 'y'"),
    ("004-EX-piston", "P", None, BadInput, "name the axis, 'x' or 'y'"),
    ("000-P5", "nothing", None, BadInput, "there is no pair and no link 'nothing'"),
    ("000-P5", "nothing", "x", BadInput, "there is no point 'nothing'"),
]


@pytest.mark.parametrize(("name", "of", "axis", "kind", "told"), REFUSED)
def test_what_has_no_harmonics_is_refused_with_a_reason(name, of, axis, kind, told):
    with pytest.raises(kind, match=told):
        harmonics(planar.load(name), of, axis)


def test_a_mechanism_without_inputs_is_refused():
    with pytest.raises(NoAnswer, match="can still move in 1 way; give an input at"):
        harmonics(planar.model.mechanism.replace(planar.load("000-P5"), inputs=()), "stroke")


# pistons


def test_a_piston_is_recognised_wherever_it_stands():
    found = find_piston(planar.load("002-E3.4"), "guide B")
    assert (found.crank, found.rod, found.input) == ("OA", "AB", "O")
    assert (found.r, found.l, found.n, found.offset) == pytest.approx((0.2, 0.8, 4.0, 0.0), abs=1e-15)
    # the others hang on the rod, not on a crank
    assert find_piston(planar.load("002-E3.4"), "guide D") is None
    assert find_piston(planar.load("002-E3.4"), "guide F") is None
    assert find_piston(planar.load("walschaerts-valve-gear"), "guide").n == pytest.approx(5.0)
    assert find_piston(planar.load("sewing-machine"), "bush").heading == pytest.approx(-pi / 2.0)


@pytest.mark.parametrize(
    ("name", "pair"),
    [
        ("004-QR", "stroke"),  # the crank moves a lever
        ("004-QR", "slot"),  # on a moving link
        ("004-COS", "stroke"),  # a yoke
        ("000-P2", "stroke"),  # the rod is on a rocker that is not driven
        ("002-E3.3", "stroke"),  # no full turn
        ("scott-russell", "guide"),
        ("000-P5", "A"),
    ],
)
def test_what_is_no_piston_is_none(name, pair):
    mechanism = planar.load(name)
    pair = (
        pair
        if pair in relative_motions(mechanism)
        else next(p.name for p in mechanism.pairs if p.point_on_line() is not None)
    )
    assert find_piston(mechanism, pair) is None


def test_a_piston_is_asked_of_a_pair_that_there_is():
    with pytest.raises(BadInput, match="there is no pair 'nothing'"):
        find_piston(planar.load("000-P5"), "nothing")


@settings(max_examples=draws(5), deadline=None)
@given(
    r=st.floats(0.05, 0.5),
    more=st.floats(1.2, 6.0),
    part=st.floats(-0.9, 0.9),
    heading=st.floats(-pi, pi),
    rate=st.sampled_from([-3.0, 5.0]),
)
def test_the_closed_form_is_the_solved_motion_whichever_way_the_stroke_lies(r, more, part, heading, rate):
    l, e = r * more, part * r * (more - 1.0)  # noqa: E741
    mechanism = slider_crank(r, l, e, heading, velocity=rate)
    found = find_piston(mechanism, "stroke")
    assert isinstance(found, Piston)
    assert (found.r, found.l, found.offset) == pytest.approx((r, l, e), abs=1e-12)
    assert cos(found.heading - heading) == pytest.approx(1.0)
    motion = planar.cycle(mechanism, 30)
    theta = motion.inputs["O"].position + found.lead
    start, way = found.slide
    report = motion.pair("stroke")
    assert start + way * found.exact.displacement(theta) == pytest.approx(report["displacement"], abs=1e-12)
    assert way * found.exact.velocity(theta, rate) == pytest.approx(report["velocity"], abs=1e-11)
    assert way * found.exact.acceleration(theta, rate) == pytest.approx(report["acceleration"], abs=1e-9)
    assert found.theta(1.0) == pytest.approx(theta[0] % (2.0 * pi))


def test_displacement_may_grow_away_from_the_piston_and_the_slide_may_carry_the_line():
    value = planar.to_dict(slider_crank(0.1, 0.3))
    slide = next(pair for pair in value["pairs"] if "line" in pair)
    slide["line"] = {"through": [1.0, 0.0], "angle": pi}
    turned = find_piston(planar.from_dict(value), "stroke")
    assert turned.slide == pytest.approx((0.6, 1.0), abs=NEAR)
    assert turned.heading == pytest.approx(0.0, abs=NEAR)
    # the line in the block, the point in the frame
    slide["links"] = slide["links"][::-1]
    slide["line"], slide["point"] = {"through": "B", "angle": 0.0}, "O"
    carried = planar.from_dict(value)
    found, motion = find_piston(carried, "stroke"), planar.cycle(carried, 30)
    told = found.slide[0] + found.slide[1] * found.exact.displacement(motion.inputs["O"].position)
    assert told == pytest.approx(motion.pair("stroke")["displacement"], abs=NEAR)


def test_off_the_crank_axis_the_two_terms_do_not_hold_and_are_refused():
    found = find_piston(planar.load("offset-slider-crank"), "stroke")
    assert found.offset == pytest.approx(0.04)
    assert not found.is_in_line
    with pytest.raises(BadInput, match=r"for a stroke through the crank's axis; here it is 0\.04 m off"):
        _ = found.two_terms
    (route,) = analytical_routes(planar.load("offset-slider-crank"))
    assert route.piston is not None
    assert route.formula is None
    assert route.fastest.value == pytest.approx(
        abs(float(found.exact.velocity(found.exact.angle_of_greatest_speed(), route.rate)))
    )


# what the chapters print


def engine():
    """000-P5: r = 150, l = 600 mm, 450 rpm, 60 degrees from inner dead centre."""
    return find_piston(planar.load("000-P5"), "stroke"), 450 * pi / 30, radians(60)


def test_000_p5_velocity_printed_6_8_is_the_two_term_value_6_887_cut_short():
    found, omega, theta = engine()
    assert found.two_terms.velocity(theta, omega) == pytest.approx(6.887, abs=5e-4)
    assert int(10.0 * found.two_terms.velocity(theta, omega)) / 10.0 == 6.8
    assert found.exact.velocity(theta, omega) == pytest.approx(6.905, abs=5e-4)


def test_000_p5_acceleration_printed_124_89_is_the_two_term_value_at_the_rounded_speed_47_12():
    found, omega, theta = engine()
    assert round(float(found.two_terms.acceleration(theta, 47.12)), 2) == 124.89
    assert found.two_terms.acceleration(theta, omega) == pytest.approx(124.912, abs=5e-4)
    assert found.exact.acceleration(theta, omega) == pytest.approx(124.949, abs=5e-4)


def test_000_p5_angle_printed_77_is_right_by_two_terms_and_cos_printed_0_25_is_a_slip():
    two = engine()[0].two_terms
    assert cos(two.angle_of_greatest_speed()) == pytest.approx(
        (sqrt(24.0) - 4.0) / 4.0, rel=NEAR
    )  # 2 c^2 + 4 c - 1 = 0
    assert round(cos(two.angle_of_greatest_speed()), 4) == 0.2247
    assert round(degrees(two.angle_of_greatest_speed()), 2) == 77.01
    assert degrees(acos(0.25)) == pytest.approx(75.5, abs=0.05)  # what the slip would give
    assert degrees(engine()[0].exact.angle_of_greatest_speed()) == pytest.approx(76.72, abs=5e-3)


def test_000_p5_greatest_speed_printed_7_227_is_a_slip_for_7_274():
    found, omega, _ = engine()
    two, right = found.two_terms, radians(77)
    assert two.velocity(two.angle_of_greatest_speed(), omega) == pytest.approx(7.2747, abs=5e-5)
    assert found.exact.velocity(found.exact.angle_of_greatest_speed(), omega) == pytest.approx(7.287, abs=5e-4)
    lost = sin(radians(2 * 77 / (2 * 4)))  # sin(2 x 77 / (2 x 4)), as printed, for sin(2 x 77) / (2 x 4)
    assert 0.15 * omega * (sin(right) + lost) == pytest.approx(9.22, abs=0.005)
    assert two.velocity(right, omega) == pytest.approx(7.2747, abs=5e-5)
    assert two.velocity(right, omega) / 7.227 - 1.0 == pytest.approx(0.0066, abs=1e-4)


def example():
    """004: r = 160, l = 500 mm, 4500 rpm, 40 degrees from TDC; P is 360 mm from the piston."""
    return find_piston(planar.load("004-EX-piston"), "stroke"), 4500 * pi / 30, radians(40)


def test_004_the_printed_acceleration_with_r_by_2l_is_a_slip_that_is_3_4_percent_off():
    found, omega, theta = example()
    seed = found.r * omega**2 * (cos(theta) + found.r / (2.0 * found.l) * cos(2.0 * theta))
    right = float(found.two_terms.acceleration(theta, omega))
    assert seed / right - 1.0 == pytest.approx(-0.034, abs=5e-4)
    step = 1e-5  # the right one is the derivative of the velocity, which is printed right
    ahead, back = (found.two_terms.velocity(theta + by, omega) for by in (step, -step))
    assert omega * (ahead - back) / (2.0 * step) == pytest.approx(right, rel=1e-8)


def test_004_form_the_two_terms_are_off_by_so_much_at_r_by_l_0_32():
    # 004-FORM: at 40 degrees; x is r cos t + l - (r^2/4l)(1 - cos 2t), measured from the crank's axis
    found, omega, theta = example()
    two, exact = found.two_terms, found.exact
    r, l, seed = found.r, found.l, found.r / (2.0 * found.l)  # noqa: E741
    x = r * cos(theta) + l - r**2 / (4.0 * l) * (1.0 - cos(2.0 * theta))
    assert r + l - float(two.displacement(theta)) == pytest.approx(x, rel=NEAR)
    errors = [
        x / piston(theta, r, l)[0] - 1.0,
        two.velocity(theta, omega) / exact.velocity(theta, omega) - 1.0,
        two.acceleration(theta, omega) / exact.acceleration(theta, omega) - 1.0,
        r * omega**2 * (cos(theta) + seed * cos(2.0 * theta)) / exact.acceleration(theta, omega) - 1.0,
    ]
    # x, v, a, and a with the slip r/2l
    assert errors == pytest.approx([0.000187, -0.00428, -0.01166, -0.04508], rel=2e-3)
    assert [found.deviation(order).part for order in range(3)] == pytest.approx([0.00216, 0.00538, 0.01345], rel=2e-3)
    # the next term of the series, (r/l)^3/8 of r at 90 degrees, of the stroke 2 r
    assert found.deviation(0) == (pytest.approx((r / l) ** 3 / 16.0, rel=0.06), pytest.approx(pi / 2.0))


def test_004_ex_p_the_printed_66_48_of_the_drawing_is_the_exact_speed_of_p():
    found, omega, theta = example()
    exact, two = (each.rod_point(theta, omega, 0.36) for each in (found.exact, found.two_terms))
    assert round(hypot(*exact.velocity), 2) == 66.48
    assert hypot(*two.velocity) == pytest.approx(66.42, abs=5e-3)  # by two terms 0.09 % less
    assert hypot(*two.velocity) == pytest.approx(66.48, rel=0.02)
    # v_B printed 75.4 m/s
    assert round(found.r * omega, 1) == 75.4


def test_004_ex_p_the_formulas_of_p_are_those_printed():
    # x_P = x - b (1 - r^2/2l^2 sin^2 t), y_P = r (b/l) sin t; "r sin t = b sin phi" is a slip for l sin phi
    found, omega, theta = example()
    r, l, b = found.r, found.l, 0.36  # noqa: E741
    told = found.two_terms.rod_point(theta, omega, b)
    x = r * cos(theta) + l - r**2 / (4.0 * l) * (1.0 - cos(2.0 * theta)) - b * (1.0 - (r / l * sin(theta)) ** 2 / 2.0)
    assert told.position == pytest.approx([x, r * b / l * sin(theta)], rel=NEAR)
    vx = -r * omega * (sin(theta) + r / (2.0 * l) * (1.0 - b / l) * sin(2.0 * theta))
    assert told.velocity == pytest.approx([vx, r * omega * b / l * cos(theta)], rel=NEAR)
    ax = -r * omega**2 * (cos(theta) + r / l * (1.0 - b / l) * cos(2.0 * theta))
    assert told.acceleration == pytest.approx([ax, -r * omega**2 * b / l * sin(theta)], rel=NEAR)


@pytest.mark.parametrize(("r", "l", "e"), [(0.16, 0.5, 0.0), (0.06, 0.2, 0.04)])
def test_a_point_of_the_rod_moves_as_it_is_solved(r, l, e):  # noqa: E741
    value = planar.to_dict(slider_crank(r, l, e, velocity=3.0))
    value["links"]["AB"]["points"] = {"P": {"along": ["B", "A"], "distance": 0.7 * l}}
    mechanism = planar.from_dict(value)
    found, state = find_piston(mechanism, "stroke"), planar.solve(mechanism)
    told, point = found.exact.rod_point(found.theta(1.0), 3.0, 0.7 * l), state.point("P")
    for mine, solved in zip(told, (point.position, point.velocity, point.acceleration), strict=True):
        assert mine == pytest.approx(solved, abs=1e-12)


def test_points_off_the_line_of_the_rods_pins_have_no_two_term_formula():
    value = planar.to_dict(slider_crank(0.16, 0.5, velocity=3.0))
    value["links"]["AB"]["points"] = {
        "P": {"along": ["B", "A"], "distance": 0.36},
        "Q": {"along": ["B", "A"], "distance": 0.36, "angle": 0.2},
    }
    p, q, a = analytical_routes(planar.from_dict(value), points=("P", "Q", "A"))
    assert [rod.b for rod in p.rods] == pytest.approx([0.36])
    assert [rod.b for rod in a.rods] == pytest.approx([0.5])
    assert q.rods == ()


def test_the_greatest_deviation_is_that_of_all_angles():
    found = ExactFormulas(0.15, 0.6)
    theta = np.linspace(0.0, 2.0 * pi, 20001)
    off = np.abs(TwoTermFormulas(0.15, 0.6).velocity(theta, 1.0) - found.velocity(theta, 1.0))
    part = off.max() / np.abs(found.velocity(theta, 1.0)).max()
    told = engine()[0].deviation(1)
    assert told.part == pytest.approx(part, rel=1e-5)
    assert told.theta == pytest.approx(theta[np.argmax(off > off.max() * (1 - 1e-6))], abs=0.01)


# the whole program


def numbers(out, first):
    """The numbers of the line that begins with these words."""
    line = next(line.strip() for line in out.splitlines() if line.strip().startswith(first))
    words = line[len(first) :].replace(";", " ").replace(",", " ").replace("%", " ").split()
    return [float(word) for word in words if word.lstrip("+-").replace(".", "", 1).replace("e-", "", 1).isdigit()]


def test_the_engine_is_printed_with_its_stroke_harmonics_and_both_formulas(tmp_path):
    out = run(tmp_path, "harmonics", "000-P5").done()
    assert numbers(out, "stroke") == [300, 0, 750, 180, 450]
    assert "TDC at 0 deg" in out
    assert numbers(out, "greatest speed") == [7.28688, 76.721, 7.27475, 77.0121]
    assert numbers(out, "piston") == [150, 600, 4]
    assert numbers(out, "2 ") == pytest.approx([9.526, 0.0, 9.526])
    assert numbers(out, "velocity") == pytest.approx([6.90536, 6.88677, -0.269, 0.255, 60.3])
    assert numbers(out, "acceleration") == pytest.approx([124.949, 124.912, -0.030, 0.656, 90.0])


def test_json_has_the_whole_series_and_the_formula_in_si(tmp_path):
    value = json.loads(run(tmp_path, "harmonics", "000-P5", "--json").done())
    slide = value["slides"]["stroke"]
    mean, cosines = in_line_series(0.15, 0.6, 12)
    assert value["input"] == {
        "pair": "O",
        "position": pytest.approx(pi / 3),
        "rate": pytest.approx(450 * pi / 30),
        "per_unit": False,
    }
    assert slide["mean"] == pytest.approx(mean)
    assert [each["cosine"] for each in slide["harmonics"][:6]] == pytest.approx(cosines[:6], abs=1e-15)
    assert slide["stroke"]["length"] == pytest.approx(0.3)
    assert slide["piston"]["two_terms"]["here"]["acceleration"] == pytest.approx(124.912, abs=5e-4)
    assert slide["piston"]["two_terms"]["exact"]["velocity"] == pytest.approx(6.90536, abs=5e-6)
    assert slide["here"]["velocity"] == pytest.approx(-6.90536, abs=5e-6)
    assert slide["greatest_speed"]["value"] == pytest.approx(7.28688, abs=5e-6)


def test_a_point_of_the_rod_is_printed_by_both_formulas(tmp_path):
    out = run(tmp_path, "harmonics", "004-EX-piston", "--point", "P").done()
    assert numbers(out, "velocity  ") == pytest.approx([66.4778, 66.4211, -0.085])
    assert numbers(out, "2 ") == pytest.approx([3.680, 0.0, 3.680, 0.0, 0.0, 0.0])


def test_a_point_of_the_rod_is_as_it_is_solved_and_as_the_closed_form_has_it():
    mechanism = planar.load("004-EX-piston")
    (route,) = analytical_routes(mechanism, points=("P",))
    (rod,) = route.rods
    assert (rod.b, route.position) == pytest.approx((0.36, radians(40)))
    for mine, solved in zip(rod.exact, route.here, strict=True):
        assert mine == pytest.approx(solved, rel=1e-11)
    value = json.loads(json.dumps(record(mechanism, [route]), allow_nan=False))["points"]["P"]
    assert value["rods"][0]["two_terms"]["velocity"] == pytest.approx(list(rod.here.velocity))
    assert value["x"]["harmonics"][0]["cosine"] == pytest.approx(0.16)
    assert value["y"]["harmonics"][0]["sine"] == pytest.approx(0.36 / 0.5 * 0.16)


def test_every_slide_on_the_frame_that_is_not_driven_is_told(tmp_path):
    out = run(tmp_path, "harmonics", "002-E3.4").done()
    told = [line for line in out.splitlines() if line.startswith("Slide ")]
    assert told == ["Slide guide B", "Slide guide D", "Slide guide F"]
    (named,) = analytical_routes(planar.load("004-QR"), pairs=("slot",))
    assert named.of == "slot"


def test_without_a_speed_rates_are_per_radian(tmp_path):
    value = planar.to_dict(replace_inputs(planar.load("004-SC12"), (Drive("O", None, 0.0, 0.0),)))
    (tmp_path / "still.json").write_text(json.dumps(value))
    out = run(tmp_path, "harmonics", "still.json").done()
    assert numbers(out, "greatest speed")[:2] == pytest.approx([0.03133, 74.5289])
    assert "m/rad" in out
    assert "m/s" not in out


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (("four-bar", "--point", "E"), 1, "dead point: the input at 'A' makes no full turn"),
        (("jansen-leg",), 2, "name another slide with --pair, or a point with --point, such as 'foot'"),
        (("walschaerts-valve-gear",), 2, "there are several inputs, O, K; name the one that turns"),
    ],
)
def test_what_cannot_be_told_is_refused_in_one_sentence(tmp_path, words, status, told):
    assert told in run(tmp_path, "harmonics", *words).refused(status)


@pytest.mark.parametrize(
    ("name", "named", "told"),
    [
        ("002-E3.6a", {}, "stroke: after a turn of 'O' it is not where it was"),
        ("000-P5", {"pairs": ("O",)}, "O: nothing slides at this pair"),
        ("000-P5", {"points": ("Z",)}, "there is no point 'Z'; points are O, A and B"),
        ("000-P5", {"pairs": ("Z",)}, "there is no pair and no link 'Z'"),
    ],
)
def test_what_is_not_there_is_bad_input(name, named, told):
    with pytest.raises(BadInput, match=told):
        analytical_routes(planar.load(name), **named)
