"""Ends of strokes and greatest speeds, against closed forms and against finer and finer samples."""

from dataclasses import replace
from math import asin, degrees, hypot, inf, pi, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planar
from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.extremes import greatest, stroke
from planar.analysis.motion.output import Extreme
from planar.foundation.errors import BadInput, NoAnswer, Unknown
from planar.foundation.jets import Jet
from planar.foundation.root_finding import find_root
from planar.model.mechanism import Drive, relative_motions, replace_inputs
from planar.model.pairs import MeasureKind
from tests.builders import slider_crank
from tests.closed_forms import piston, turn_apart
from tests.draws import draws, first_cases

NEAR = 1e-12
"""rad, and part of a value: rounding of a position solved."""


def test_tdc_and_bdc_of_the_engine_are_where_crank_and_rod_are_in_line():
    motion = planar.cycle(planar.load("000-P5"))
    found = planar.stroke(motion, "stroke")
    assert found.pair == "stroke"
    assert turn_apart(found.top.input, 0.0) < NEAR
    assert turn_apart(found.bottom.input, pi) < NEAR
    assert found.top.value == pytest.approx(0.75, rel=NEAR)
    assert found.bottom.value == pytest.approx(0.45, rel=NEAR)
    assert found.length == pytest.approx(0.3, rel=NEAR)


@pytest.mark.parametrize("steps", [7, 12, 90])
@pytest.mark.parametrize("start", [None, -0.3, 0.0])
def test_an_end_at_the_seam_of_a_turn_is_found_however_the_turn_is_cut(steps, start):
    # 004-SC12: the file's own position is TDC; the stroke is S_6 = 60 mm
    mechanism = planar.load("004-SC12")
    motion = planar.cycle(mechanism, steps, start, None if start is None else start + 2.0 * pi)
    found = stroke(motion, "stroke")
    assert turn_apart(found.top.input, 0.0) < NEAR
    assert turn_apart(found.bottom.input, pi) < NEAR
    assert found.length == pytest.approx(0.06, rel=NEAR)
    assert all(motion.inputs["O"].position[0] <= each.input for each in (found.top, found.bottom))
    assert all(each.input < motion.inputs["O"].position[-1] for each in (found.top, found.bottom))


@settings(max_examples=draws(6), deadline=None)
@given(
    r=st.floats(0.05, 0.5),
    more=st.floats(1.15, 6.0),
    part=st.floats(-0.9, 0.9),
    position=st.floats(-4.0, 4.0),
    velocity=st.sampled_from([-3.0, 0.0, 5.0]),
)
def test_an_offset_slider_crank_turns_back_where_crank_and_rod_are_in_line(r, more, part, position, velocity):
    l, e = r * more, part * r * (more - 1.0)  # noqa: E741
    mechanism = slider_crank(r, l, e, position=position, velocity=velocity)
    found = stroke(planar.cycle(mechanism, 24), "stroke")
    outer, inner = sqrt((l + r) ** 2 - e**2), sqrt((l - r) ** 2 - e**2)
    assert turn_apart(found.top.input, asin(e / (l + r))) < 1e-10
    assert turn_apart(found.bottom.input, pi + asin(e / (l - r))) < 1e-10
    assert found.top.value == pytest.approx(outer, rel=1e-11)
    assert found.length == pytest.approx(outer - inner, rel=1e-10)


def test_a_shapers_ram_turns_back_where_the_crank_is_square_to_the_lever():
    # 004-QR: sin b = OA / OC, time ratio (180 + 2 b) / (180 - 2 b)
    found = stroke(planar.cycle(planar.load("004-QR")), "stroke")
    b = asin(0.1 / 0.25)
    assert turn_apart(found.top.input, -b) < NEAR
    assert turn_apart(found.bottom.input, pi + b) < NEAR
    forward = (found.bottom.input - found.top.input) % (2.0 * pi)
    assert forward / (2.0 * pi - forward) == pytest.approx((pi + 2.0 * b) / (pi - 2.0 * b), rel=NEAR)
    assert found.length == pytest.approx(2.0 * 0.5 * sin(b), rel=1e-9)


def test_a_slide_on_a_moving_link_has_a_stroke_too():
    # the block on the lever is farthest from C where the crank points away from it: 250 + 100 mm
    found = stroke(planar.cycle(planar.load("004-QR")), "slot")
    assert found.top.value == pytest.approx(0.35, rel=NEAR)
    assert found.bottom.value == pytest.approx(0.15, rel=NEAR)
    assert turn_apart(found.top.input, pi / 2.0) < NEAR


def test_top_is_the_end_far_from_the_crank_also_where_displacement_grows_towards_it():
    value = planar.to_dict(slider_crank(0.1, 0.3))
    slide = next(pair for pair in value["pairs"] if "line" in pair)
    slide["line"] = {"through": [1.0, 0.0], "angle": pi}
    found = stroke(planar.cycle(planar.from_dict(value)), "stroke")
    assert turn_apart(found.top.input, 0.0) < NEAR
    assert found.top.value == pytest.approx(0.6, rel=NEAR)
    assert found.bottom.value == pytest.approx(0.8, rel=NEAR)


def test_of_ends_equally_far_from_the_crank_the_top_is_that_of_greater_displacement():
    found = stroke(planar.cycle(planar.load("004-COS")), "stroke")
    assert (found.top.value, found.bottom.value) == pytest.approx((0.05, -0.05), rel=NEAR)


@pytest.mark.parametrize("way", [1, -1])
def test_of_a_part_of_a_turn_only_ends_within_it_count(way):
    mechanism = slider_crank(0.1, 0.3)

    def over(start, stop):
        return stroke(planar.cycle(mechanism, 40, *(radians(each) for each in (start, stop)[::way])), "stroke")

    assert over(30, 120).turning == (False, False)
    part_of_turn = over(-20, 120)
    assert part_of_turn.turning == (True, False)  # TDC at 0, BDC at 180 degrees
    assert (part_of_turn.top.input, part_of_turn.bottom.input) == pytest.approx((0.0, radians(120)), abs=NEAR)
    assert part_of_turn.length == pytest.approx(0.4 - piston(radians(120), 0.1, 0.3)[0], rel=NEAR)
    whole = over(-20, 200)
    assert whole.turning == (True, True)
    assert (whole.top.input, whole.bottom.input) == pytest.approx((0.0, pi), abs=NEAR)
    # a range that begins and ends at the dead centres turns back there
    exactly = over(0, 180)
    assert (exactly.top.input, exactly.bottom.input) == pytest.approx((0.0, pi), abs=NEAR)


def test_of_two_turns_the_first_ends_are_told():
    motion = planar.cycle(slider_crank(0.1, 0.3), 60, 1.0, 1.0 + 4.0 * pi)
    found = stroke(motion, "stroke")
    assert found.bottom.input == pytest.approx(pi, abs=NEAR)
    assert found.top.input == pytest.approx(2.0 * pi, abs=NEAR)


def test_between_limits_of_the_input_a_slide_turns_back_inside_or_goes_from_end_to_end():
    # 002-E3.3 turns back inside its range; 000-P4's slides are farthest at the limits of the crank
    motion = planar.cycle(planar.load("002-E3.3"))
    found = stroke(motion, "stroke")
    fine = planar.cycle(planar.load("002-E3.3"), 3000).pair("stroke")["displacement"]
    assert np.isnan(motion.pair("stroke")["velocity"][[0, -1]]).all()
    assert found.length == pytest.approx(np.ptp(fine), rel=1e-5)
    run = planar.cycle(planar.load("000-P4"))
    for slide in ("guide B", "guide D"):
        travel, displacement = stroke(run, slide), run.pair(slide)["displacement"]
        assert np.ptp(displacement) <= travel.length == pytest.approx(np.ptp(displacement), rel=1e-5)
        assert False in travel.turning
        assert {travel.top.input, travel.bottom.input} & {*run.inputs["O"].position[[0, -1]].tolist()}


def test_a_stroke_between_the_last_sample_and_a_limit_is_found():
    # 3 positions between the limits: both ends of the stroke are beside samples that tell nothing of them
    fine, coarse = (stroke(planar.cycle(planar.load("002-E3.3"), steps), "stroke") for steps in (720, 6))
    assert coarse.top.input == pytest.approx(fine.top.input, abs=1e-10)
    assert coarse.length == pytest.approx(fine.length, rel=1e-10)


def test_what_does_not_slide_or_does_not_move_has_no_stroke():
    motion = planar.cycle(planar.load("000-P5"))
    assert stroke(motion, "A") is None
    held = planar.cycle(planar.load("excavator-arm"), 20, pair="boom cylinder")
    assert stroke(held, "stick cylinder") is None
    with pytest.raises(Unknown, match="there is no pair 'nothing'"):
        stroke(motion, "nothing")


def fastest_crank_angle(r, l):  # noqa: E741
    """Where a piston in line is fastest, from its acceleration in closed form, by halving."""
    low, high = 0.1, pi / 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if piston(middle, r, l)[2] < 0.0 else (low, middle)
    return low


def test_the_greatest_speed_of_the_engine_is_solved_for():
    # 000-P5: exactly 7.287 m/s at 76.72 degrees; the chapter prints 77, by two terms, and 7.227 by a slip
    found = greatest(planar.cycle(planar.load("000-P5")), "stroke")
    at = fastest_crank_angle(0.15, 0.6)
    assert found.input == pytest.approx(at, abs=NEAR)
    assert degrees(found.input) == pytest.approx(76.72, abs=0.005)
    exact = -450 * pi / 30 * piston(at, 0.15, 0.6)[1]
    assert found.value == pytest.approx(exact, rel=NEAR)
    assert found.value == pytest.approx(7.287, abs=0.0005)


def test_the_greatest_speed_of_the_twelve_positions_is_per_radian_what_the_notes_say():
    # 004-SC12 is driven at 1 rad/s: 0.03133 m/rad at 74.53 degrees
    found = greatest(planar.cycle(planar.load("004-SC12"), 12), "stroke")
    assert found.input == pytest.approx(fastest_crank_angle(0.03, 0.1), abs=NEAR)
    assert (found.value, degrees(found.input)) == pytest.approx((0.03133, 74.53), rel=2e-4)


def test_the_greatest_speed_does_not_depend_on_the_files_rate_or_its_sense_but_in_proportion():
    still, slow, back, hurried = (
        greatest(planar.cycle(slider_crank(0.1, 0.3, velocity=v, acceleration=a), 60), "stroke")
        for v, a in ((0.0, 0.0), (0.5, 0.0), (-4.0, 0.0), (2.0, 30.0))
    )
    for found, rate in ((slow, 0.5), (back, 4.0), (hurried, 2.0)):
        assert found.value == pytest.approx(rate * still.value, rel=NEAR)
        assert found.input == pytest.approx(still.input, abs=NEAR)


def test_a_stroke_needs_no_speed_and_no_acceleration_changes_it():
    still, hurried = (
        stroke(planar.cycle(slider_crank(0.1, 0.3, velocity=v, acceleration=a), 60), "stroke")
        for v, a in ((0.0, 0.0), (2.0, 30.0))
    )
    assert still.top.input == pytest.approx(hurried.top.input, abs=NEAR)
    assert still.length == pytest.approx(hurried.length, rel=NEAR)


def test_a_function_of_the_state_and_a_name_agree():
    motion = planar.cycle(planar.load("jansen-leg"), 60)
    named = greatest(motion, "foot")
    made = greatest(motion, lambda state: state.point("foot").velocity)
    assert made.input == pytest.approx(named.input, abs=1e-9)
    assert made.value == pytest.approx(named.value, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "of", "what"),
    first_cases(
        [
            *[("jansen-leg", "foot", "velocity"), ("002-E3.4", "F", "acceleration"), ("crank-rocker", "B", "velocity")],
            *[("jansen-leg", "foot", "acceleration"), ("002-E3.4", "F", "velocity")],
            ("crank-rocker", "B", "acceleration"),
        ],
        3,
    ),
)
def test_the_greatest_of_a_point_is_what_finer_and_finer_samples_come_to(name, of, what):
    mechanism = planar.load(name)
    found = greatest(planar.cycle(mechanism, 72), of, what)
    steps = 3600
    sampled = np.hypot(*getattr(planar.cycle(mechanism, steps).point(of), what).T)
    assert found.value >= sampled.max() * (1.0 - NEAR)
    assert found.value == pytest.approx(sampled.max(), rel=5e-5)  # half a step off a summit
    at = mechanism.inputs[0].position + 2.0 * pi * np.argmax(sampled) / steps
    assert turn_apart(found.input, at) <= 1.01 * pi / steps
    drive = Drive(mechanism.inputs[0].pair, found.input)
    there = getattr(planar.solve(mechanism, (drive,)).point(of), what)
    assert hypot(*there) == pytest.approx(found.value, rel=1e-10)


def test_the_greatest_acceleration_of_a_piston_is_at_tdc():
    found = greatest(planar.cycle(planar.load("000-P5")), "stroke", "acceleration")
    omega = 450 * pi / 30
    assert turn_apart(found.input, 0.0) < 1e-10
    assert found.value == pytest.approx(0.15 * omega**2 * (1.0 + 0.25), rel=NEAR)


def test_a_crank_at_a_steady_rate_is_as_fast_everywhere():
    motion = planar.cycle(planar.load("000-P5"))
    assert greatest(motion, "A") == (pytest.approx(pi / 3.0), pytest.approx(0.15 * 450 * pi / 30, rel=NEAR))
    assert greatest(motion, "O") == Extreme(pytest.approx(pi / 3.0), 0.0)


def test_over_a_part_of_a_turn_the_greatest_may_be_at_an_end():
    mechanism = slider_crank(0.1, 0.3)
    motion = planar.cycle(mechanism, 30, 0.2, 0.9)
    found = greatest(motion, "stroke")
    assert found == Extreme(pytest.approx(0.9), pytest.approx(abs(motion.pair("stroke")["velocity"][-1]), rel=NEAR))


def test_what_grows_beyond_all_bounds_towards_a_limit_has_no_greatest():
    motion = planar.cycle(planar.load("000-P1"))
    found = greatest(motion, "C")
    assert found.value == inf
    assert found.input in motion.inputs["A"].position[[0, -1]]
    # what is limited there keeps its greatest: the crank's own pin
    assert greatest(motion, "B").value == pytest.approx(10.5 * 0.05, rel=1e-9)


def test_the_greatest_velocity_or_acceleration_is_asked_for_and_of_what_there_is():
    motion = planar.cycle(planar.load("000-P5"), 12)
    with pytest.raises(BadInput, match="'velocity' or 'acceleration'"):
        greatest(motion, "stroke", "jerk")
    with pytest.raises(Unknown, match="there is no point 'nothing'"):
        greatest(motion, "nothing")


def test_a_motion_between_its_samples_is_the_motion():
    mechanism = planar.load("002-E3.4")
    steady = InterpolatedRun(planar.cycle(mechanism, 24))
    for position in (1.1, 2.345, 7.2):
        known = planar.solve(mechanism, {"O": position})
        assert steady.state_at(position).point("F").acceleration == pytest.approx(
            known.point("F").acceleration, rel=1e-10
        )
    assert steady.closed
    assert steady.rate == -210 * pi / 30
    assert not InterpolatedRun(planar.cycle(planar.load("002-E3.6a"), 24)).closed  # the ratio of its wheels is 2.122
    with pytest.raises(NoAnswer):
        InterpolatedRun(planar.cycle(planar.load("000-P1"))).state_at(2.5)


@pytest.mark.parametrize(
    "name", first_cases(["000-P2", "slotted-lever", "hand-pump", "atkinson-cycle-engine", "002-E3.5"], 3)
)
def test_strokes_of_other_machines_are_what_a_fine_run_shows(name):
    mechanism = planar.load(name)
    coarse, fine = (planar.cycle(mechanism, steps) for steps in (48, 2400))
    for pair, each in relative_motions(mechanism).items():
        if each.input_kind is MeasureKind.LENGTH:
            found, sampled = stroke(coarse, pair), fine.pair(pair)["displacement"]
            assert found.length >= np.ptp(sampled) - NEAR
            assert found.length == pytest.approx(np.ptp(sampled), rel=2e-5)
            assert max(found.top.value, found.bottom.value) == pytest.approx(sampled.max(), rel=2e-5)


def test_several_inputs_run_one_at_a_time():
    mechanism = planar.load("walschaerts-valve-gear")
    found = stroke(planar.cycle(mechanism, 72, pair="O"), "guide")
    assert found.length == pytest.approx(0.6, rel=NEAR)
    assert turn_apart(found.top.input, 0.0) < NEAR


@given(st.floats(-3.0, 3.0), st.floats(0.01, 5.0))
def test_a_root_is_found_to_round_off(at, by):
    found = find_root(lambda x: np.expm1(by * (x - at)), at - 1.0, at + 1.3)
    assert found == pytest.approx(at, abs=1e-14)
    assert find_root(lambda x: (x - at) ** 3, at - 1.0, at + 1.3) == pytest.approx(at, abs=1e-4)


def test_the_files_velocity_is_not_lost_in_a_steady_run():
    mechanism = replace_inputs(planar.load("000-P5"), (Drive("O", None, 3.0, 7.0),))
    steady = InterpolatedRun(planar.cycle(mechanism, 36))
    plain = planar.cycle(replace_inputs(mechanism, (Drive("O", None, 3.0, 0.0),)), 36)
    for part in ("velocity", "acceleration"):
        assert steady.samples.pair("stroke")[part] == pytest.approx(plain.pair("stroke")[part], abs=1e-12)
    unit = InterpolatedRun(planar.cycle(replace_inputs(mechanism, (Drive("O", None, 0.0, 7.0),)), 36))
    assert 9.0 * unit.samples.pair("stroke")["acceleration"] == pytest.approx(
        plain.pair("stroke")["acceleration"], abs=1e-12
    )


def test_an_input_that_stays_where_it_is_has_a_speed_and_no_stroke():
    mechanism = planar.load("000-P5")
    motion = planar.cycle(mechanism, 3, 1.0, 1.0)
    assert stroke(motion, "stroke") is None
    told = abs(planar.solve(mechanism, {"O": 1.0}).pair("stroke")["velocity"])
    assert greatest(motion, "stroke") == Extreme(1.0, pytest.approx(told, rel=NEAR))


@pytest.mark.parametrize("what", ["velocity", "acceleration"])
def test_where_no_rates_are_determined_nothing_is_found(what):
    motion = planar.cycle(planar.load("000-P5"), 12)
    frames = {
        name: frame if frame.fixed else frame._replace(angle=Jet(frame.angle.parts[0], *np.full((2, 13), np.nan)))
        for name, frame in motion.frames.items()
    }
    blind = replace(motion, frames=frames)
    assert stroke(blind, "stroke") is None
    assert np.isnan(greatest(blind, "stroke", what).value)
