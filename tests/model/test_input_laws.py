"""Input laws: published peaks, each rate against the one below, joints, tables, and laws in files."""

from __future__ import annotations

import json
import subprocess
import sys
from copy import deepcopy
from dataclasses import replace
from itertools import pairwise
from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

import planar
from planar.document.schema import schema
from planar.equations.mechanism_numbers import equation_structure
from planar.foundation.errors import BadInput
from planar.model.input_laws import (
    SEGMENT_TYPES,
    ConstantAccelerationSegment,
    ConstantSpeedSegment,
    CycloidalRise,
    DwellSegment,
    HarmonicRise,
    InputLaw,
    ModifiedTrapezoidalRise,
    Polynomial345Rise,
    Polynomial4567Rise,
    TableSegment,
    TrapezoidalRise,
)
from planar.model.mechanism import LARGEST_INPUT_POSITION, Drive, Input, replace_inputs
from tests import documents as document
from tests import random_documents
from tests.draws import draws

H, T = -0.7, 0.3
"""The way and the time of the pieces here."""
RISES = [Polynomial345Rise, Polynomial4567Rise, CycloidalRise, HarmonicRise, TrapezoidalRise, ModifiedTrapezoidalRise]
TIMES = (0.0, 0.1, 0.15, 0.4, 0.5, 0.9, 1.0, 1.3)
TABLE = TableSegment(TIMES, tuple(float(np.sin(3.0 * t) + t) for t in TIMES))
SAMPLES = [
    *(rise(T, H) for rise in RISES),
    TrapezoidalRise(T, H, 0.25),
    TrapezoidalRise(T, H, 0.0625),
    ModifiedTrapezoidalRise(T, H, 0.0625),
    DwellSegment(T),
    ConstantSpeedSegment(T),
    ConstantSpeedSegment(T, by=H),
    ConstantSpeedSegment(T, speed=2.0),
    ConstantAccelerationSegment(T, -5.0),
    TABLE,
    TableSegment((0.0, 0.2, 0.3), (1.0, 2.0, -1.0)),
    TableSegment((0.0, 0.2), (1.0, 2.0)),
]
CALLED = [f"{each.motion} {i}" for i, each in enumerate(SAMPLES)]

STEADY = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])


def edges(piece):
    """Times between which every rate of a sample is smooth."""
    return np.array(piece.times) if isinstance(piece, TableSegment) else np.linspace(0.0, piece.duration, 65)


def alone(piece, t, velocity=0.4):
    return InputLaw((piece,)).evaluate(t, 0.2, velocity)


# each law by itself


@pytest.mark.parametrize(
    ("piece", "peaks"),
    [
        (Polynomial345Rise(T, H), (15 / 8, 10 / sqrt(3.0), 60)),
        (Polynomial4567Rise(T, H), (35 / 16, 84 / sqrt(125.0), 105 / 2)),
        (CycloidalRise(T, H), (2, 2 * pi, 4 * pi**2)),
        (HarmonicRise(T, H), (pi / 2, pi**2 / 2, pi**3 / 2)),
        (TrapezoidalRise(T, H), (2, 16 / 3, 128 / 3)),
        (TrapezoidalRise(T, H, 0.25), (2, 8, 32)),
        (TrapezoidalRise(T, H, 0.001), (2, 4, 4000)),
        (ModifiedTrapezoidalRise(T, H), (2, 4 / (1 / pi + 1 / 2), 16 * pi / (1 / pi + 1 / 2))),
    ],
    ids=lambda each: getattr(each, "motion", ""),
)
def test_the_greatest_rates_are_the_published_ones(piece, peaks):
    t = np.linspace(0.0, T, 40_001)
    found = np.abs(piece.evaluate(t, 0.0))[1:].max(axis=1)
    loose = 0.01 if getattr(piece, "ramp", 1.0) == 0.001 else 1e-7
    assert found == pytest.approx([p * abs(H) / T**k for k, p in enumerate(peaks, start=1)], rel=loose)


def test_the_numbers_that_cam_books_print():
    t = np.linspace(0.0, 1.0, 40_001)
    printed = {"3-4-5": 5.7735, "4-5-6-7": 7.5132, "cycloidal": 6.283, "harmonic": 4.935, "modified trapezoidal": 4.888}
    for motion, peak in printed.items():
        assert np.abs(SEGMENT_TYPES[motion](1.0, 1.0).evaluate(t, 0.0)[2]).max() == pytest.approx(peak, abs=6e-4)


@pytest.mark.parametrize("rise", RISES, ids=lambda rise: rise.motion)
def test_a_rise_goes_its_way_from_rest_to_rest(rise):
    start, middle, end = rise(T, H).evaluate(np.array([0.0, T / 2, T]), 3.0).T
    assert (start[:2] == 0.0).all()
    assert (end[:2] == [H, 0.0]).all()
    assert middle[0] == pytest.approx(H / 2, rel=1e-15)
    assert middle[2] == pytest.approx(0.0, abs=1e-13 * abs(H) / T**2)
    ends = pi**2 / 2 * H / T**2 if rise is HarmonicRise else 0.0
    assert (start[2], end[2]) == pytest.approx((ends, -ends), rel=1e-15)
    if rise is Polynomial4567Rise:
        assert start[3] == end[3] == 0.0


@pytest.mark.parametrize("piece", SAMPLES, ids=CALLED)
def test_every_rate_is_the_derivative_of_the_one_below(piece):
    knots = edges(piece)
    t = np.concatenate([a + (b - a) * np.array([0.2, 0.5, 0.71]) for a, b in pairwise(knots)])
    step = 0.19 * np.min(np.diff(knots))
    exact = alone(piece, t)
    size = np.abs(exact).max(axis=1)
    wrong = []
    for h in (step, step / 2):
        differences = (alone(piece, t + h) - alone(piece, t - h))[:3] / (2 * h)
        wrong.append(np.abs(differences - exact[1:]).max(axis=1))
    # central differences: a quarter of the error at half the step, down to the round-off of what is differenced
    noise = 40 * sys.float_info.epsilon * (size[:3] + 1e-3 * size.max()) / step
    assert (wrong[1] <= 0.27 * wrong[0] + noise).all()
    assert (wrong[0] <= 0.1 * np.abs(exact[1:]).max(axis=1) + noise).all()


@pytest.mark.parametrize("piece", SAMPLES, ids=CALLED)
def test_every_rate_sums_to_the_one_below(piece):
    knots = edges(piece)
    x, w = np.polynomial.legendre.leggauss(8)
    for a, b in pairwise(knots):
        within = alone(piece, (a + b) / 2 + (b - a) / 2 * x)
        summed = within[1:] @ w * (b - a) / 2
        inside = np.nextafter(b, a) if isinstance(piece, TableSegment) else b
        passed = (alone(piece, np.array([inside])) - alone(piece, np.array([a])))[:3, 0]
        assert summed == pytest.approx(passed, abs=1e-11 * np.abs(alone(piece, knots)).max())


def test_a_modified_trapezoid_of_ramps_alone_is_cycloidal():
    t = np.linspace(0.0, T, 101)
    expected = CycloidalRise(T, H).evaluate(t, 0.0)
    error = np.abs(ModifiedTrapezoidalRise(T, H, 0.25).evaluate(t, 0.0) - expected)
    assert (error <= 1e-14 * np.abs(expected).max(axis=1, keepdims=True)).all()


def test_short_ramps_come_near_to_two_constant_accelerations():
    t = np.linspace(0.0, T, 31)
    parabolic = InputLaw(
        (ConstantAccelerationSegment(T / 2, 4 * H / T**2), ConstantAccelerationSegment(T / 2, -4 * H / T**2))
    )
    for kind in (TrapezoidalRise, ModifiedTrapezoidalRise):
        found = kind(T, H, 0.001).evaluate(t, 0.0)
        assert found[:2] == pytest.approx(parabolic.evaluate(t, 0.0, 0.0)[:2], abs=0.005 * abs(H) / T)


@pytest.mark.parametrize("kind", [TrapezoidalRise, ModifiedTrapezoidalRise], ids=lambda kind: kind.motion)
def test_a_ramp_takes_the_part_of_the_time_that_it_is_given(kind):
    b = 1 / 16
    x = np.array([b * 1.0001, 0.5 - b * 1.0001, b * 0.99, 0.5 - b * 0.99])
    first, last, before, after = np.abs(kind(1.0, 1.0, b).evaluate(x, 0.0)[2])
    assert first == last
    assert before == pytest.approx(after, rel=1e-12)
    assert before < 0.9999 * first
    assert (kind(1.0, 1.0, b).evaluate(np.linspace(b, 0.5 - b, 9)[:-1], 0.0)[3] == 0.0).all()


@pytest.mark.parametrize("kind", [TrapezoidalRise, ModifiedTrapezoidalRise], ids=lambda kind: kind.motion)
def test_where_a_ramp_meets_a_flat_jerk_is_that_of_what_follows(kind):
    joints = np.array([0, 1, 3, 5, 7]) / 8
    piece = kind(1.0, 1.0)
    assert piece.evaluate(joints, 0.0)[3] == pytest.approx(piece.evaluate(joints + 1e-9, 0.0)[3], abs=1e-4)


# pieces one after the other


def test_a_diagram_of_dwell_rise_and_constant_speed():
    law = InputLaw((DwellSegment(0.5), CycloidalRise(0.4, pi / 2), ConstantSpeedSegment(1.0, by=-pi / 2)))
    assert law.duration == 1.9
    found = law.evaluate(np.array([0.0, 0.25, 0.5, 0.7, 0.9, 1.4, 1.9, 2.9]), pi / 6, 0.0)
    assert found[0] == pytest.approx(np.radians([30, 30, 30, 75, 120, 75, 30, -60]), rel=1e-14)
    assert found[1] == pytest.approx([0, 0, 0, pi / 0.4, -pi / 2, -pi / 2, -pi / 2, -pi / 2], rel=1e-14)
    assert found[3][[0, 1, 4, 5, 6, 7]] == pytest.approx(0.0)
    assert found[3][2] == pytest.approx(4 * pi**2 * (pi / 2) / 0.4**3, rel=1e-14)


def test_pieces_that_go_on_take_the_speed_at_which_those_before_end():
    law = InputLaw(
        (ConstantAccelerationSegment(2.0, 3.0), ConstantSpeedSegment(1.0), ConstantAccelerationSegment(2.0, -4.0))
    )
    found = law.evaluate(np.array([0.0, 1.0, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, -1.0]), 10.0, 2.0)
    assert (found[0] == [10, 13.5, 20, 24, 28, 34, 36, 36, 8]).all()
    assert (found[1] == [2, 5, 8, 8, 8, 4, 0, 0, 2]).all()
    assert (found[2] == [3, 3, 0, 0, -4, -4, -4, 0, 0]).all()
    assert not found[3].any()


def test_at_a_joint_rates_are_those_of_what_starts_and_at_the_end_of_what_ends():
    law = InputLaw((HarmonicRise(0.1, 1.0), HarmonicRise(0.2, -1.0)) * 5)
    joints = np.array([sum([0.1, 0.2] * k) for k in range(6)])
    peaks = pi**2 / 2 / np.array([0.1, 0.2]) ** 2
    assert np.array(law.joint_times[::2]) == pytest.approx(joints, rel=1e-15)
    assert law.evaluate(np.array(law.joint_times[:-1]), 0.0, 0.0)[2] == pytest.approx(
        np.tile([1, -1], 5) * np.tile(peaks, 5)
    )
    assert law.evaluate(np.array([law.duration]), 0.0, 0.0)[2] == pytest.approx(peaks[1])
    assert (law.evaluate(np.array([law.duration + 0.3]), 0.0, 0.0)[:, 0] == 0.0).all()


def test_joints_of_many_equal_times_lie_where_their_sum_is_rounded_once():
    law = InputLaw((DwellSegment(0.1),) * 1000)
    assert law.joint_times[10] == 1.0
    assert law.duration == 100.0


SPANS = st.floats(0.01, 10.0)
WAYS = st.floats(-20.0, 20.0)
PIECES = st.one_of(
    st.builds(DwellSegment, SPANS),
    st.builds(ConstantSpeedSegment, SPANS),
    st.builds(ConstantSpeedSegment, SPANS, by=WAYS),
    st.builds(ConstantSpeedSegment, SPANS, speed=WAYS),
    st.builds(ConstantAccelerationSegment, SPANS, WAYS),
    *(st.builds(rise, SPANS, WAYS) for rise in RISES),
    *(st.builds(kind, SPANS, WAYS, st.floats(0.01, 0.25)) for kind in (TrapezoidalRise, ModifiedTrapezoidalRise)),
    st.lists(st.tuples(st.floats(0.1, 1.0), WAYS), min_size=2, max_size=12).map(
        lambda rows: TableSegment((0.0, *np.cumsum([r[0] for r in rows[1:]]).tolist()), tuple(r[1] for r in rows))
    ),
)
LAWS = st.lists(PIECES, min_size=1, max_size=6).map(tuple).map(InputLaw)


@settings(STEADY, max_examples=draws(50))
@given(LAWS, WAYS, WAYS)
def test_positions_of_any_law_go_on_at_every_joint(law, position, velocity):
    joints = law.joints(position, velocity)
    h = 1e-9
    at = np.array(law.joint_times)
    before, there, after = (law.evaluate(at + d, position, velocity) for d in (-h, 0.0, h))
    assert law.find_problem() is None
    moved = 2 * h * np.abs(np.stack([before[1], there[1], after[1]])).max(axis=0) + 1e-11 * (1 + np.abs(there[0]))
    assert (np.abs(there[0] - before[0]) <= moved).all()
    assert (np.abs(after[0] - there[0]) <= moved).all()
    assert there[0] == pytest.approx([joint.position for joint in joints], abs=1e-15)
    scale = 1e-11 * (1 + np.abs(there[1]).max())
    assert there[1] == pytest.approx([joint.velocity_after for joint in joints], abs=scale)
    bend = 2 * h * np.abs(np.stack([before[2], there[2]])).max(axis=0) + 10 * scale + 1e-14 * np.abs(before[3])
    assert (np.abs(before[1] - [joint.velocity_before for joint in joints]) <= bend).all()


@settings(STEADY, max_examples=draws(25))
@given(LAWS, WAYS, WAYS, st.permutations(range(40)))
def test_each_time_has_its_own_answer_in_whatever_order(law, position, velocity, order):
    t = np.linspace(-0.2, 1.2, 40) * law.duration
    together = law.evaluate(t, position, velocity)
    assert np.isfinite(together).all()
    assert law.evaluate(t[list(order)], position, velocity) == pytest.approx(together[:, list(order)], rel=1e-13)
    assert law.evaluate(t[7:8], position, velocity) == pytest.approx(together[:, 7:8], rel=1e-13)
    assert law.evaluate(t[:0], position, velocity).shape == (4, 0)


# tables


@settings(STEADY, max_examples=draws(30))
@given(st.lists(st.tuples(st.floats(0.2, 1.0), WAYS), min_size=2, max_size=30))
def test_a_table_goes_through_its_points(rows):
    times = np.concatenate([[0.0], np.cumsum([r[0] for r in rows[1:]])])
    positions = np.array([r[1] for r in rows])
    table = TableSegment(tuple(times.tolist()), tuple(positions.tolist()))
    assert table.find_problem() is None
    assert InputLaw((table,)).evaluate(times, positions[0], 0.0)[0] == pytest.approx(positions, abs=1e-9)


def test_jerk_of_a_table_goes_on_at_its_points():
    inner = np.array(TIMES[1:-1])
    before, after = (TABLE.evaluate(inner + d, 0.0) for d in (-1e-9, 1e-9))
    snap = np.abs(np.diff(TABLE.evaluate(np.linspace(0.0, 1.3, 10_001), 0.0)[3])).max() / 1.3e-4
    assert (np.abs(after[2:] - before[2:]) <= 1e-8 * snap).all()


@pytest.mark.parametrize("points", [6, 7, 12])
def test_a_table_of_a_polynomial_is_that_polynomial(points):
    rise = Polynomial345Rise(2.0, 3.0)
    times = np.linspace(0.0, 2.0, points) ** 1.2 * 2.0**-0.2
    times[-1] = 2.0
    table = TableSegment(tuple(times.tolist()), tuple(rise.evaluate(times, 0.0)[0].tolist()))
    t = np.linspace(0.0, 2.0, 33)
    assert table.evaluate(t, 0.0) == pytest.approx(rise.evaluate(t, 0.0), abs=1e-9)


def test_a_table_of_few_points_is_one_polynomial_and_of_two_a_constant_speed():
    t = np.linspace(0.0, 2.0, 9)
    assert TableSegment((0.0, 2.0), (1.0, 5.0)).evaluate(t, 0.0) == pytest.approx(
        ConstantSpeedSegment(2.0, by=4.0).evaluate(t, 0.0), abs=1e-14
    )
    thrown = ConstantAccelerationSegment(2.0, -9.0)
    few = (0.0, 0.7, 2.0)
    table = TableSegment(few, tuple(thrown.evaluate(np.array(few), 4.0)[0].tolist()))
    assert table.evaluate(t, 0.0) == pytest.approx(thrown.evaluate(t, 4.0), abs=1e-12)


def test_only_a_table_loads_scipy():
    code = (
        "import sys, numpy as np; from planar.model.input_laws import *\n"
        "law = InputLaw((DwellSegment(1.0), CycloidalRise(1.0, 2.0), TrapezoidalRise(1.0, 2.0)))\n"
        "law.find_problem(); law.evaluate(np.linspace(0, 3, 9), 0.0, 0.0); print('scipy' in sys.modules)\n"
        "TableSegment((0.0, 1.0), (0.0, 1.0)).evaluate(np.zeros(1), 0.0); print('scipy' in sys.modules)"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert ended.stdout.split() == ["False", "True"]


# laws in files

FULL = [
    {"motion": "dwell", "in": 0.5},
    {"motion": "cycloidal", "by": 90, "in": "0.4 s"},
    {"motion": "constant speed", "by": -90, "in": 1},
    {"motion": "constant speed", "speed": "10 rpm", "in": "500 ms"},
    {"motion": "constant speed", "in": 0.5},
    {"motion": "constant acceleration", "acceleration": "-2 rad/s^2", "in": 0.25},
    {"motion": "3-4-5", "by": "0.2 rad", "in": 0.3},
    {"motion": "4-5-6-7", "by": -10, "in": 0.3},
    {"motion": "harmonic", "by": 5, "in": 0.3},
    {"motion": "trapezoidal", "by": 7.5, "in": 0.3},
    {"motion": "modified trapezoidal", "by": -7.5, "in": 0.3, "ramp": 0.2},
]
TABULATED = {"motion": "table", "times": [0, "100 ms", 0.25, 0.5], "positions": [60, 62, "1.1 rad", 90]}


def filed(law, **more):
    """The four-bar of the contract, at rest at 60 deg, with a law at its input."""
    value = document.base()
    value["inputs"] = [{"pair": "A", "position": 60, **more, "law": law}]
    return value


def read(law, **more):
    return planar.from_dict(filed(law, **more)).inputs[0].law


def test_a_law_reads_as_it_is_written():
    law = read(FULL)
    degree = pi / 180
    assert law.segments[:6] == (
        DwellSegment(0.5),
        CycloidalRise(0.4, pytest.approx(90 * degree)),
        ConstantSpeedSegment(1.0, by=pytest.approx(-90 * degree)),
        ConstantSpeedSegment(0.5, speed=pytest.approx(pi / 3)),
        ConstantSpeedSegment(0.5),
        ConstantAccelerationSegment(0.25, -2.0),
    )
    assert law.segments[6:] == (
        Polynomial345Rise(0.3, 0.2),
        Polynomial4567Rise(0.3, pytest.approx(-10 * degree)),
        HarmonicRise(0.3, pytest.approx(5 * degree)),
        TrapezoidalRise(0.3, pytest.approx(7.5 * degree)),
        ModifiedTrapezoidalRise(0.3, pytest.approx(-7.5 * degree), 0.2),
    )
    assert [each.motion for each in law.segments] == [each["motion"] for each in FULL]


def test_one_piece_may_stand_without_its_list_and_a_table_has_the_units_of_its_input():
    law = read(TABULATED)
    assert law == read([TABULATED])
    assert law.segments[0].times == (0.0, 0.1, 0.25, 0.5)
    assert law.segments[0].positions == pytest.approx((pi / 3, 62 * pi / 180, 1.1, pi / 2))
    assert read(FULL[1]) == InputLaw((CycloidalRise(0.4, pytest.approx(pi / 2)),))


def test_a_law_of_a_slide_is_in_lengths():
    value = document.base("slider-crank")
    law = [{"motion": "cycloidal", "by": -20, "in": 1}, {"motion": "constant speed", "speed": 0.2, "in": 1}]
    value["inputs"] = [{"pair": "stroke", "position": 1780, "law": law}]
    found = planar.from_dict(value)
    assert found.inputs[0].law == InputLaw((CycloidalRise(1.0, -0.02), ConstantSpeedSegment(1.0, speed=0.2)))
    assert planar.to_dict(found)["inputs"] == value["inputs"] or planar.from_dict(planar.to_dict(found)) == found


@pytest.mark.parametrize("law", [FULL, TABULATED, [FULL[0], TABULATED, *FULL[3:]]], ids=["pieces", "table", "both"])
@pytest.mark.parametrize("velocity", ["0 rad/s", "2 rad/s"])
def test_a_law_written_and_read_again_is_the_same_to_the_last_bit(law, velocity):
    found = planar.from_dict(filed(law, velocity=velocity))
    written = planar.to_dict(found)
    assert planar.from_dict(written) == found
    assert planar.loads(planar.dumps(found)) == found
    assert planar.to_dict(planar.from_dict(written)) == written
    for value in (filed(law), written):
        assert Draft202012Validator(schema()).is_valid(value)


@settings(STEADY, max_examples=draws(40))
@example(InputLaw((ConstantAccelerationSegment(10.0, 20.0),) * 6), 0.0, 0.0)
@given(LAWS, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_any_law_made_in_python_is_read_as_it_was_written(law, position, velocity):
    mechanism = planar.from_dict(document.base())
    law = law.start_at(position, velocity)
    made = replace(mechanism, inputs=(Input("A", position, velocity, 0.0, law),))
    if max(abs(joint.position) for joint in law.joints(position, velocity)) > LARGEST_INPUT_POSITION:
        with pytest.raises(BadInput, match="an input moves to"):
            planar.from_dict(planar.to_dict(made))
        return
    again = planar.from_dict(planar.to_dict(made))
    assert again.inputs == made.inputs
    assert Draft202012Validator(schema()).is_valid(planar.to_dict(made))


def test_a_position_is_solved_as_if_there_were_no_law():
    value = filed(FULL, velocity="10.5 rad/s", acceleration="-26 rad/s^2")
    with_law = planar.solve(planar.from_dict(value))
    without = planar.solve(planar.loads(document.FOUR_BAR))
    assert (with_law.point("F").acceleration == without.point("F").acceleration).all()
    assert equation_structure(with_law.mechanism) == equation_structure(without.mechanism)


def test_a_changed_input_keeps_its_law_which_starts_from_there():
    mechanism = planar.from_dict(filed([FULL[5], FULL[1]]))
    moved = replace_inputs(mechanism, (Drive("A", 0.3, 1.0),)).inputs[0]
    assert moved == Input("A", 0.3, 1.0, 0.0, mechanism.inputs[0].law)
    assert replace_inputs(mechanism, ()).inputs == mechanism.inputs


def test_a_table_moves_to_where_a_changed_input_starts():
    mechanism = planar.from_dict(filed(TABULATED))
    moved = replace_inputs(mechanism, (Drive("A", 0.3),))
    before, after = mechanism.inputs[0], moved.inputs[0]
    t = np.linspace(0.0, 1.0, 11)
    ways = [each.law.evaluate(t, each.position, 0.0)[0] - each.position for each in (before, after)]
    assert ways[0] == pytest.approx(ways[1], abs=1e-14)
    assert after.law.segments[0].positions[0] == 0.3
    assert planar.from_dict(planar.to_dict(moved)).inputs == moved.inputs


# what is said of laws, and what is refused


def remarks(law, **more):
    return planar.from_dict(filed(law, **more)).remarks


def test_a_jump_in_speed_is_said_with_the_piece():
    jump = [{"motion": "constant speed", "speed": "3 rad/s", "in": 1}, {"motion": "3-4-5", "by": 5, "in": 1}]
    first = "the law of input 'A' jumps in speed: piece "
    assert remarks(jump) == (first + "2 starts at rest where piece 1 ends at 3 rad/s",)
    more = first + "1 starts at 3 rad/s where the input's velocity is 1 rad/s; so it does at 1 more of its joints"
    assert remarks(jump, velocity="1 rad/s") == (more,)
    assert remarks(jump[1:], velocity="1 rad/s") == (first + "1 starts at rest where the input's velocity is 1 rad/s",)
    still = [jump[1], {"motion": "dwell", "in": 1}, jump[0]]
    assert remarks(still) == (first + "3 starts at 3 rad/s where piece 2 ends at rest",)


@pytest.mark.parametrize("law", [FULL[:2], [FULL[5], FULL[4]], [FULL[8]] * 4, TABULATED])
def test_a_law_that_goes_on_at_its_speed_is_not_remarked_on(law):
    assert remarks(law) == ()


RISE = {"motion": "cycloidal", "by": 90, "in": 0.4}
MISTAKES = [
    pytest.param([RISE, RISE | {"motion": "cyclodal"}], "[1].motion", "did you mean 'cycloidal'", id="a word"),
    pytest.param([{"by": 90, "in": 1}], "[0]", "'motion' is missing", id="no motion"),
    pytest.param([RISE | {"motion": 345}], "[0].motion", "a text is wanted", id="motion no text"),
    pytest.param([{"motion": "3-4-5", "in": 1}], "[0]", "'by' is missing", id="no by"),
    pytest.param([RISE, {"motion": "dwell"}], "[1]", "'in' is missing", id="no in"),
    pytest.param([RISE | {"in": 0}], "[0].in", "above zero", id="no time"),
    pytest.param([RISE | {"in": -0.4}], "[0].in", "above zero", id="time back"),
    pytest.param(RISE | {"in": "-5 ms"}, ".in", "above zero", id="time back as a text"),
    pytest.param([RISE | {"in": "5 mm"}], "[0].in", "a time is wanted", id="a length for a time"),
    pytest.param([RISE | {"in": 1e-30}], "[0].in", "from 1e-09 s", id="hardly a time"),
    pytest.param([RISE | {"in": 1e30}], "[0].in", "to 1e+09 s", id="ages"),
    pytest.param([RISE | {"by": True}], "[0].by", "a number is wanted", id="true"),
    pytest.param([RISE | {"by": float("nan")}], "[0].by", "not a number", id="nan"),
    pytest.param([RISE | {"by": float("inf")}], "[0].by", "too large", id="infinite"),
    pytest.param([RISE | {"by": "3 mm"}], "[0].by", "an angle is wanted", id="a length for an angle"),
    pytest.param([RISE | {"by": 1e9}], "[0]", "moves to 10000 rad", id="too far"),
    pytest.param([RISE | {"ramp": 0.1}], "[0].ramp", "'cycloidal' has no 'ramp'", id="no such key"),
    pytest.param([RISE | {"speed": "1 rad/s"}], "[0].speed", "its keys are motion, by and in", id="a rise at a speed"),
    *(
        pytest.param([RISE | {"motion": each, "ramp": ramp}], "[0].ramp", "0.25", id=f"{each} {ramp}")
        for each in ("trapezoidal", "modified trapezoidal")
        for ramp in (0, -0.1, 0.3, 1e-9)
    ),
    pytest.param([RISE | {"motion": "trapezoidal", "ramp": "1"}], "[0].ramp", "a number is wanted", id="ramp text"),
    pytest.param(
        [RISE | {"motion": "constant speed", "speed": "1 rad/s"}], "[0].speed", "not both", id="by and at a speed"
    ),
    pytest.param([{"motion": "constant speed", "speed": 3, "in": 1}], "[0].speed", "rad/s, deg/s", id="a bare rate"),
    pytest.param([{"motion": "constant acceleration", "in": 1}], "[0]", "'acceleration' is missing", id="no rate"),
    pytest.param([], "", "from 1 to 10000 pieces, not 0", id="no pieces"),
    pytest.param([RISE] * 10_001, "", "not 10001", id="too many pieces"),
    pytest.param("cycloidal", "", "an object {...} is wanted", id="only a word"),
    pytest.param([RISE, None], "[1]", "an object {...} is wanted", id="null"),
    *(
        pytest.param([TABULATED | change], f"[0]{place}", words, id=f"table {place} {words}")
        for change, place, words in [
            ({"in": 1}, ".in", "'table' has no 'in'"),
            ({"times": [0, 1]}, ".positions", "there are 2 times, so 2 positions"),
            ({"times": [0], "positions": [60]}, ".times", "from 2 to 10000 points, not 1"),
            ({"times": [], "positions": []}, ".times", "not 0"),
            ({"times": [0.1, 0.2, 0.3, 0.4]}, ".times[0]", "times start at 0"),
            ({"times": [0, 0.2, 0.1, 0.4]}, ".times[2]", "0.1 s comes after 0.2 s"),
            ({"times": [0, 0.2, 0.2, 0.4]}, ".times[2]", "times increase"),
            ({"times": [0, 0.2, "x", 0.4]}, ".times[2]", "is not a number"),
            ({"times": [0, 0.2, 0.3, 1e30]}, ".times", "at most"),
            ({"positions": [60, None, 2, 3]}, ".positions[1]", "a number is wanted"),
            ({"positions": [50, 60, 61, 62]}, ".positions[0]", "starts at 50 deg, but the piece starts at 60 deg"),
            ({"positions": [60, 60, 61, 1e7]}, "", "moves to 10000 rad"),
            ({"times": list(range(10_001))}, ".times", "at most 10000 points"),
            ({"times": 4}, ".times", "a list"),
            ({"positions": None}, ".positions", "a list"),
        ]
    ),
]


@pytest.mark.parametrize(("law", "place", "words"), MISTAKES)
def test_a_mistake_in_a_law_is_refused_at_its_place(law, place, words):
    problem = document.refused(filed(law))
    assert problem.place == f"$.inputs[0].law{place}"
    assert words in problem.sentence


def test_a_table_must_start_where_the_pieces_before_it_end():
    rise = {"motion": "3-4-5", "by": 30, "in": 1}
    assert read([rise, TABULATED | {"positions": [90, 91, 92, 90]}]).duration == 1.5
    problem = document.refused(filed([rise, TABULATED]))
    assert problem.place == "$.inputs[0].law[1].positions[0]"
    assert "starts at 60 deg, but the piece starts at 90 deg" in problem.sentence


def test_times_that_lie_too_unevenly_are_refused_and_nothing_else():
    times = [0, 1e-8, 2e-8, 3e-8, 1e8, 2e8, 5e8, 5e8 + 1, 9e8]
    problem = document.refused(filed(TABULATED | {"times": times, "positions": [60, 90] * 4 + [60]}))
    assert problem.place == "$.inputs[0].law.times"
    assert "too unevenly" in problem.sentence


@pytest.mark.parametrize(
    ("pieces", "place"),
    [
        ((), "A.law"),
        ((DwellSegment(1.0), CycloidalRise(0.0, 1.0)), "A.law[1].in"),
        ((DwellSegment(float("nan")),), "A.law[0].in"),
        ((TableSegment((0.0, 1.0), (0.0, float("inf"))),), "A.law[0].positions[1]"),
        ((TableSegment((), ()),), "A.law[0].times"),
    ],
    ids=str,
)
def test_a_law_made_in_python_is_held_to_the_same_rules(pieces, place):
    mechanism = planar.from_dict(document.base())
    with pytest.raises(BadInput) as caught:
        planar.solve(replace(mechanism, inputs=(Input("A", 1.0, law=InputLaw(pieces)),)))
    assert caught.value.place == place


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CycloidalRise(1.0, None), "CycloidalRise.by: a number is wanted here, not None"),
        (lambda: TrapezoidalRise(1.0, 1.0, None), "TrapezoidalRise.ramp: a number is wanted here, not None"),
        (
            lambda: Input("A", 1.0, law=abs),
            "Input.law: an InputLaw or None is wanted here, not <built-in function abs>",
        ),
        (lambda: InputLaw(CycloidalRise(1.0, 1.0)), "InputLaw.segments: a tuple of LawSegment objects is wanted here"),
        (lambda: Input("A", "60 deg"), "Input.position: a number is wanted here, not '60 deg'"),
        (lambda: planar.Load(point="D", force=3), "Load.force: a tuple of 2 numbers or None is wanted here, not 3"),
        (lambda: planar.Spring(points="PQ"), "Spring.points: a tuple of 2 texts or None is wanted here, not 'PQ'"),
        (lambda: planar.Stops("A", low="1"), "Stops.low: a number or None is wanted here, not '1'"),
        (lambda: planar.Link.from_ends("A", "B", "5 mm"), "Link.length: a number or None is wanted here"),
        (
            lambda: planar.TurningPair("A", "ab", ("A", "A"), "A"),
            "TurningPair.links: a tuple of 2 texts is wanted here",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "make",
)
def test_what_a_mechanism_is_built_of_refuses_arguments_of_other_types_by_name(make, message):
    with pytest.raises(BadInput) as caught:
        make()
    assert str(caught.value).startswith(message)


@settings(STEADY, max_examples=draws(150))
@given(st.sampled_from([FULL, [TABULATED], [FULL[0], TABULATED, *FULL[3:6]]]), st.integers(1, 3), st.data())
def test_a_mutilated_law_is_read_or_refused_and_nothing_else(law, times, data):
    law = {"law": deepcopy(law)}
    for _ in range(times):
        if random_documents.places(law):
            random_documents.mutilated(law, data.draw)
    value = filed(None)
    value["inputs"][0] |= law
    try:
        found = planar.from_dict(value)
    except BadInput as problem:
        assert problem.place.startswith("$")
        assert str(problem).isprintable()
        return
    assert Draft202012Validator(schema()).is_valid(value)
    assert planar.from_dict(json.loads(planar.dumps(found))) == found
    given = found.inputs[0]
    if given.law:
        t = np.linspace(0.0, 1.1, 50) * given.law.duration
        assert np.isfinite(given.law.evaluate(t, given.position, given.velocity)).all()
