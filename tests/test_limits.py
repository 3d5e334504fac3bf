"""Where inputs and outputs turn back: solved for, against closed forms."""

from fractions import Fraction

import numpy as np
import pytest

import planar
from planar import files
from planar.errors import BadInput, NoAnswer, Outcome
from tests import ranges
from tests.test_cycle import PARALLELOGRAM, ROCKER, TRIPLE, TURN, four_bar, rocker, slider_crank

DEAD, STROKE, CHANGE = "input dead point", "stroke end", "change point"


def told(motion, kind=None):
    """Kind, pair and place of every limit, or of one kind."""
    return [(each.kind, each.of, each.input) for each in motion.limits if kind in (None, each.kind)]


def places(motion, kind):
    return [each.input for each in motion.limits if each.kind == kind]


def modulo(places, start):
    """Places of a turning input, in their order within a turn from the start on."""
    return sorted(start + (np.asarray(places) - start) % TURN)


# ranges


@pytest.mark.parametrize("kind", list(ranges.KINDS))
def test_the_range_of_a_random_linkage_is_that_of_its_closed_form(kind):
    """More of them: `python -m tests.ranges 1000`."""
    some, left_out = ranges.cases(kind, 30)
    assert left_out < 5
    for case in some:
        turns = case.ends[1] - case.ends[0] == TURN
        assert ranges.off(case, 60 if turns else 1) < 1e-12


@pytest.mark.parametrize("kind", list(ranges.KINDS))
def test_the_limits_of_a_random_linkage_are_the_ends_of_its_range_and_typed(kind):
    for case in ranges.cases(kind, 6)[0]:
        motion = planar.cycle(case.mechanism, 7)
        dead = places(motion, DEAD)
        if case.ends[1] - case.ends[0] == TURN:
            assert dead == []
            assert motion.reason == ""
        else:
            np.testing.assert_allclose(dead, case.ends, atol=1e-12)
            assert all(each.of == case.pair for each in motion.limits if each.kind == DEAD)
        assert places(motion, CHANGE) == []
        low, high = case.ends
        assert all(low - 1e-12 < each.input < high + 1e-12 for each in motion.limits)
        assert [each.input for each in motion.limits] == sorted(each.input for each in motion.limits)


def test_a_full_turn_is_kept_where_the_range_misses_a_dead_point_by_little_and_lost_where_it_does_not():
    """s + l against p + q, 1e-6 apart: a crank, and none."""
    a, b, c = 0.5, 0.9, 0.8
    for spare, turns in ((1e-6, True), (-1e-6, False)):
        d = b + c - a - spare
        motion = planar.cycle(four_bar(a, b, c, d, 1.0), 90)
        assert (len(places(motion, DEAD)) == 0) is turns
        if not turns:
            limit = 2 * np.arccos(np.sqrt(((d + a) ** 2 - (b + c) ** 2) / (4 * a * d)))
            np.testing.assert_allclose(places(motion, DEAD), [-limit, limit], atol=1e-12)


# dead points


@pytest.mark.parametrize("closed", [1, -1])
def test_dead_points_and_the_rockers_swing_of_a_triple_rocker(closed):
    a, b, c, d = TRIPLE
    motion = planar.cycle(four_bar(*TRIPLE, 0.6, closed), 12)
    limit = np.arccos((a * a + d * d - (b + c) ** 2) / (2 * a * d))
    # the follower turns back where crank and coupler are in line: A to C is a + b, and the crank's angle that of C
    reach = (d * d + (a + b) ** 2 - c * c) / (2 * d * (a + b))
    swing, value = np.arccos(reach), rocker(*TRIPLE, np.arccos(reach), 1)
    found = motion.limits
    assert [each.kind for each in found] == [DEAD, STROKE, DEAD]
    assert [each.of for each in found] == ["A", "D", "A"]
    np.testing.assert_allclose([each.input for each in found], [-limit, closed * swing, limit], atol=1e-12)
    assert found[0].value == found[0].input
    # of one of the two assemblies the follower stands mirrored
    assert np.exp(1j * found[1].value) == pytest.approx(np.exp(1j * closed * value), abs=1e-12)


def test_a_run_past_a_dead_point_ends_with_it_as_its_last_limit():
    a, b, c, d = TRIPLE
    limit = np.arccos((a * a + d * d - (b + c) ** 2) / (2 * a * d))
    motion = planar.cycle(four_bar(*TRIPLE, 0.6), 12, 0.6, 3.0)
    assert motion.outcome is Outcome.DEAD_POINT
    ((kind, of, at),) = told(motion)
    assert (kind, of) == (DEAD, "A")
    assert at == pytest.approx(limit, abs=1e-13)
    assert at == pytest.approx(motion.inputs["A"].position[-1], abs=1e-13)


@pytest.mark.parametrize("end", [-1, 1])
def test_a_range_that_starts_on_a_dead_point_counts_it(end):
    a, b, c, d = TRIPLE
    limit = end * np.arccos((a * a + d * d - (b + c) ** 2) / (2 * a * d))
    mechanism = four_bar(*TRIPLE, limit)
    inwards = planar.cycle(mechanism, 9, limit, 0.9 * limit)
    ((kind, _, at),) = told(inwards)
    assert (kind, at) == (DEAD, pytest.approx(limit, abs=1e-12))
    assert np.isnan(inwards.link("DC").angular_velocity).tolist() == [True] + 9 * [False]
    whole = planar.cycle(mechanism, 9)
    np.testing.assert_allclose(places(whole, DEAD), [-abs(limit), abs(limit)], atol=1e-12)


def test_a_drag_link_has_no_limit_at_all():
    """The frame is the shortest: both cranks turn round, and so does the coupler."""
    motion = planar.cycle(four_bar(0.9, 0.8, 1.0, 0.3, 0.4), 24)
    assert motion.limits == ()


# ends of strokes


@pytest.mark.parametrize("closed", [1, -1])
def test_the_swing_of_a_rocker(closed):
    a, b, c, d = ROCKER
    motion = planar.cycle(four_bar(*ROCKER, 0.8, closed), 17)
    found = [each for each in motion.limits if each.kind == STROKE]
    assert len(found) == len(motion.limits) == 2
    assert {(each.of, each.end, each.told) for each in found} == {("D", None, "")}
    # C at b + a, or b - a, from A: the crank points at it, or away from it
    wanted = {}
    for reach, back in ((b + a, 0.0), (b - a, np.pi)):
        turn = closed * np.arccos((d * d + reach**2 - c * c) / (2 * d * reach))
        angle = closed * (np.pi - np.arccos((d * d + c * c - reach**2) / (2 * d * c)))
        wanted[0.8 + (turn + back - 0.8) % TURN] = angle
    np.testing.assert_allclose([each.input for each in found], sorted(wanted), atol=1e-12)
    for each, at in zip(found, sorted(wanted), strict=True):
        assert np.exp(1j * each.value) == pytest.approx(np.exp(1j * wanted[at]), abs=1e-12)


@pytest.mark.parametrize("start", [0.0, 1.0, np.pi])
@pytest.mark.parametrize("steps", [4, 7, 90])
@pytest.mark.parametrize("offset", [0.0, 0.1, -0.3])
def test_top_and_bottom_dead_centre_of_a_slider_crank(start, steps, offset):
    """Crank and rod in line: the block is l + r, and l - r, from the crank's pin."""
    r, rod = 0.48, 1.6
    motion = planar.cycle(slider_crank(r, rod, offset, start), steps)
    top, bottom = np.arcsin(offset / (rod + r)), np.pi + np.arcsin(offset / (rod - r))
    wanted = {"TDC": (top, np.sqrt((rod + r) ** 2 - offset**2)), "BDC": (bottom, np.sqrt((rod - r) ** 2 - offset**2))}
    found = motion.limits
    assert {(each.kind, each.of) for each in found} == {(STROKE, "s")}
    for end, (at, value) in wanted.items():
        of = [each for each in found if each.end == end]
        # a turn that starts in a dead centre ends in it as well
        twice = abs((at - start + np.pi) % TURN - np.pi) < 1e-12
        base = start + (at - start + 1e-12) % TURN - 1e-12
        np.testing.assert_allclose([each.input for each in of], [base, base + TURN][: 1 + twice], atol=1e-12)
        np.testing.assert_allclose([each.value for each in of], value, atol=1e-13)
    assert [each.input for each in found] == sorted(each.input for each in found)


def test_top_is_farther_from_the_crank_whichever_way_the_line_points():
    value = files.to_dict(slider_crank(0.48, 1.6, 0.1, 1.0))
    (slide,) = (pair for pair in value["pairs"] if "sliding" in pair)
    slide["line"] = {"through": [0, 0.1], "angle": np.pi}
    value["sketch"] = {"B": [1.8, 0.1]}
    motion = planar.cycle(files.from_dict(value), 12)
    ends = {each.end: each.value for each in motion.limits}
    assert ends["TDC"] == pytest.approx(-np.sqrt(2.08**2 - 0.1**2), abs=1e-13)
    assert ends["BDC"] == pytest.approx(-np.sqrt(1.12**2 - 0.1**2), abs=1e-13)


def test_only_what_lies_within_the_range_is_told():
    """Swing ends of the rocker lie at 3.90 and 6.91: the first, the second, both or neither."""
    mechanism = four_bar(*ROCKER, 0.8)
    first, second = (each.input for each in planar.cycle(mechanism, 9).limits)
    for start, stop, wanted in (
        (0.8, 3.0, []),
        (3.0, 5.0, [first]),
        (5.0, 3.0, [first]),
        (5.0, 7.5, [second]),
        (7.5, 3.0, [second, first]),
        (0.8, 0.8 + 2 * TURN, [first, second, first + TURN, second + TURN]),
    ):
        np.testing.assert_allclose(places(planar.cycle(mechanism, 5, start, stop), STROKE), wanted, atol=1e-11)


def test_limits_do_not_hang_on_how_finely_a_run_is_divided():
    mechanism = four_bar(*ROCKER, 0.8)
    wanted = [each.input for each in planar.cycle(mechanism, 360).limits]
    for steps in (1, 2, 3, 50):
        np.testing.assert_allclose([x.input for x in planar.cycle(mechanism, steps).limits], wanted, atol=1e-12)


def test_there_and_back_tells_every_limit_once():
    for mechanism, given in ((four_bar(*TRIPLE, 0.6), {}), (four_bar(*ROCKER, 0.8), {"start": 3.0, "stop": 7.5})):
        there = planar.cycle(mechanism, 12, **given)
        both = planar.cycle(mechanism, 12, **given, there_and_back=True)
        assert [each[:3] for each in both.limits] == [each[:3] for each in there.limits]
        assert len(both.limits) == len(there.limits) > 1


# change points


@pytest.mark.parametrize(("steps", "start"), [(12, 0.3), (7, 0.3), (4, 0.0), (360, 2.0)])
def test_change_points_of_a_parallelogram(steps, start):
    motion = planar.cycle(four_bar(*PARALLELOGRAM, 0.3), steps, start, start + TURN)
    found = motion.limits
    flat = [at for at in (0.0, np.pi, TURN) if start <= at <= start + TURN]
    assert [each.kind for each in found] == len(flat) * [CHANGE]
    np.testing.assert_allclose([each.input for each in found], flat, atol=1e-12)
    for each, at in zip(found, flat, strict=True):
        assert each.of == "A"
        assert each.told == f"at A = {at:.6g} rad 2 branches of the motion cross; this one goes on smoothly"


def test_a_slide_that_passes_change_points_has_its_ends_between():
    """Crank and rod of one length: the block goes on through the crank's pin, x = 2 r cos(theta)."""
    motion = planar.cycle(slider_crank(0.05, 0.05, 0.0, 1.0), 12)
    assert [(each.kind, each.of, each.end) for each in motion.limits] == [
        (CHANGE, "O", None),
        (STROKE, "s", "BDC"),
        (CHANGE, "O", None),
        (STROKE, "s", "TDC"),
    ]
    np.testing.assert_allclose([each.input for each in motion.limits], np.pi / 2 * np.arange(1, 5), atol=1e-12)
    np.testing.assert_allclose([each.value for each in motion.limits[1::2]], [-0.1, 0.1], atol=1e-15)


def test_a_run_that_starts_where_branches_cross_is_refused_and_says_why():
    with pytest.raises(NoAnswer) as refused:
        planar.cycle(four_bar(*PARALLELOGRAM, 0.0), 12)
    assert refused.value.outcome is Outcome.CHANGE_POINT
    assert "'BC' and 'DC' may move in more than one way" in refused.value.reason
    with pytest.raises(BadInput, match="start: branches of the motion cross where the circuit would start"):
        planar.cycle(four_bar(*PARALLELOGRAM, 0.3), 12, start=0.0, circuit=True)


# close to a change point


def exact(part: int, by: float):
    """Where the crank of a parallelogram with one link a little off stands at its limits: exactly, in fractions.

    sin^2(theta / 2) = ((b - c)^2 - (d - a)^2) / 4 a d and cos^2(theta / 2) = ((a + d)^2 - (b + c)^2) / 4 a d.
    """
    lengths = list(PARALLELOGRAM)
    lengths[part] += by
    a, b, c, d = map(Fraction, lengths)
    low, high = ((b - c) ** 2 - (d - a) ** 2) / (4 * a * d), ((a + d) ** 2 - (b + c) ** 2) / (4 * a * d)
    first = 2 * np.arcsin(np.sqrt(float(low))) if low > 0 else None
    last = np.pi - 2 * np.arcsin(np.sqrt(float(high))) if high > 0 else None
    return tuple(lengths), first, last


@pytest.mark.parametrize("by", [1e-9, -1e-9, 1e-6, -1e-6])
@pytest.mark.parametrize("part", range(4))
def test_a_parallelogram_a_little_off_has_true_limits(part, by):
    """It turns round, or turns back on one side or on both, as its lengths say; and how near it comes is said.

    A limit goes with the root of the distance: an ulp of a length is 1e-16 / 3e-5 of it.
    """
    lengths, first, last = exact(part, by)
    motion = planar.cycle(four_bar(*lengths, 0.3), 12)
    dead = places(motion, DEAD)
    if first is None and last is None:
        assert dead == []
        assert motion.inputs["A"].position[-1] == pytest.approx(0.3 + TURN, abs=1e-13)
    else:
        wanted = (first if first else -last, last if last else TURN - first)
        np.testing.assert_allclose(dead, wanted, atol=2e-11)
        np.testing.assert_allclose(motion.inputs["A"].position[[0, -1]], dead, atol=2e-11)
    assert places(motion, CHANGE) == []
    near = [each for each in motion.remarks if "of a change point of a linkage that differs from this one" in each]
    assert near
    assert all(0.0 < float(each.split()[4]) < 10 * abs(by) ** 0.5 for each in near)
    assert all(float(each.split()[-2]) <= 2 * abs(by) for each in near)


ROUND = [(part, by) for part in range(4) for by in (1e-9, -1e-9) if exact(part, by)[1:] == (None, None)]


@pytest.mark.parametrize(("part", "by"), ROUND)
def test_a_parallelogram_a_little_off_that_turns_round_changes_over(part, by):
    """It is a crank-rocker, or a drag link's inversion: beside the flat positions C goes over to the other side."""
    lengths, _, _ = exact(part, by)
    motion = planar.cycle(four_bar(*lengths, 0.3), 360)
    theta = motion.inputs["A"].position
    clear = np.abs(np.sin(theta)) > 1e-3
    wanted = np.exp(1j * rocker(*lengths, theta, 1))
    found = np.exp(1j * motion.link("DC").angle)
    np.testing.assert_allclose(found[clear], wanted[clear], atol=1e-10)
    # beyond pi that is the crossed one
    beyond = clear & (theta > np.pi) & (theta < TURN)
    assert np.all(np.abs(found - np.exp(1j * theta))[beyond & (np.abs(np.sin(theta)) > 0.1)] > 0.05)


def test_some_of_them_turn_round():
    assert [part for part, _ in ROUND] == [0, 2]
