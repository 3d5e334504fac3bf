"""Where inputs and outputs turn back: solved for, against closed forms."""

from fractions import Fraction

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.solving.continuation.predictor_corrector import ArcBudget
from tests import ranges
from tests.builders import block_slider_crank, four_bar
from tests.closed_forms import PARALLELOGRAM, ROCKER, TRIPLE, TURN, between, rocker
from tests.draws import draws, first_cases, part

EPS = float(np.finfo(float).eps)

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
    some, left_out = ranges.cases(kind, draws(30))
    assert left_out < 5
    for case in some:
        turns = case.ends[1] - case.ends[0] == TURN
        assert ranges.off(case, 60 if turns else 1) < 1e-12


@pytest.mark.parametrize("kind", list(ranges.KINDS))
def test_the_limits_of_a_random_linkage_are_the_ends_of_its_range_and_typed(kind):
    for case in ranges.cases(kind, draws(6))[0]:
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


@pytest.mark.parametrize("short", part([1e-9, 1e-10, 3e-11, 1e-11, 1e-12], 1))
def test_both_dead_points_of_a_slider_crank_that_all_but_turns_are_told(short):
    """l = r - short: the rod reaches its line up to sin(theta) = l / r."""
    for r, theta in ((1.0, 1.0), (1.0, -0.3), (0.7, 0.4)):
        motion = planar.cycle(block_slider_crank(r, r - short, 0.0, theta), 3)
        limit = np.arctan2(r - short, np.sqrt(short * (2.0 * r - short)))
        far = 32.0 * EPS / np.sqrt(2.0 * short)  # an ulp of a length moves the limit by that
        np.testing.assert_allclose(places(motion, DEAD), [-limit, limit], atol=far, rtol=0)
        assert motion.reason.count("O = ") == 2


def test_a_motion_whose_reason_names_dead_points_has_them_among_its_limits():
    """Four-bars beside change-point linkages, where a dead point lies within the rounding of a regular place."""
    rng = np.random.default_rng(8)
    looked_at = 0
    while looked_at < draws(4):
        drawn = ranges.beside(rng)
        if drawn is None:
            continue
        (mechanism, _, ends), gap = drawn
        motion = planar.cycle(mechanism, 5)
        dead = places(motion, DEAD)
        if abs(ends[1] - ends[0] - TURN) < 1e-12:
            assert dead == []
            assert motion.reason == ""
            continue
        looked_at += 1
        np.testing.assert_allclose(dead, ends, atol=64.0 * EPS / np.sqrt(gap), rtol=0)
        assert motion.reason.count("A = ") == 2
        past = planar.cycle(mechanism, 5, stop=ends[1] + 0.1)
        assert past.outcome is Outcome.DEAD_POINT
        np.testing.assert_allclose(places(past, DEAD), ends[1:], atol=64.0 * EPS / np.sqrt(gap), rtol=0)


# ill-conditioned all along


def arcs_of(monkeypatch, walk, *given, **more):
    """What a call gives, and how many arcs were walked for it."""
    counted = []
    real = ArcBudget.spend
    monkeypatch.setattr(ArcBudget, "spend", lambda self, u: counted.append(1) or real(self, u))
    try:
        return walk(*given, **more), len(counted)
    finally:
        monkeypatch.undo()


def nearly_redundant(slope, r, rod):
    """A crank pushes a wedge of a small slope under a follower, whose own wedge of that slope pushes a jaw as far."""
    links = {
        "frame": {"points": {"O": [0, 0], "G": [2, 0], "H": [0, 1]}},
        "crank": {"ends": ["O", "A"], "length": r},
        "rod": {"ends": ["A", "B"], "length": rod},
        "wedge": {"points": {"B": [0, 0]}},
        "follower": {"points": {"P": [0, 0]}},
        "jaw": {"points": {"J": [0, 0]}},
    }
    pairs = [
        {"turning": "O"},
        {"turning": "A"},
        {"turning": "B"},
        {"sliding": "in", "links": ["frame", "wedge"], "line": {"through": "O"}, "point": "B"},
        {"slot": "face", "links": ["wedge", "follower"], "line": {"through": "B", "angle": slope}, "point": "P"},
        {
            "sliding": "guide",
            "links": ["frame", "follower"],
            "line": {"through": "G", "angle": np.pi / 2},
            "point": "P",
            "turn": -np.pi / 2,
        },
        {"sliding": "out", "links": ["frame", "jaw"], "line": {"through": "H"}, "point": "J"},
        {"slot": "under", "links": ["follower", "jaw"], "line": {"through": [0, 1], "angle": slope}, "point": "J"},
    ]
    inputs = [{"pair": "O", "position": 0.2, "velocity": 1.0}]
    value = {"planar": 1, "frame": "frame", "links": links, "pairs": pairs, "inputs": inputs}
    return files.from_dict(value)


@pytest.mark.parametrize("slope", [1e-3, 2e-5])
def test_a_linkage_that_is_ill_conditioned_all_along_runs_through_its_whole_range(slope, monkeypatch):
    """Its slopes are nearly singular everywhere, by as much, and so no nearer to a change point than others'."""
    motion, arcs = arcs_of(monkeypatch, planar.cycle, nearly_redundant(slope, 0.9, 0.6), 12)
    limit = np.arcsin(0.6 / 0.9)
    np.testing.assert_allclose(motion.inputs["O"].position[[0, -1]], [-limit, limit], atol=1e-11)
    np.testing.assert_allclose(places(motion, DEAD), [-limit, limit], atol=1e-11)
    theta = motion.inputs["O"].position
    # the jaw goes with the wedge: the follower rises by tan(slope) of what the wedge goes, and so gives it back
    wedge, jaw = motion.pair("in")["displacement"], motion.pair("out")["displacement"]
    np.testing.assert_allclose(wedge, 0.9 * np.cos(theta) + np.sqrt(0.36 - (0.9 * np.sin(theta)) ** 2), atol=1e-7)
    np.testing.assert_allclose(jaw - jaw[0], wedge - wedge[0], atol=1e3 * EPS / slope)
    assert arcs < 200


# slides that go out without an end


def lever(rail, off=0.0, through=(1.0, 0.0)):
    """A slotted lever about the origin carries a block along a rail: it goes out for ever as the lines get parallel."""
    links = {
        "frame": {"points": {"O": [0, 0]}},
        "lever": {"points": {"O": [0, 0], "L": [0, off]}},
        "rod": {"points": {"P": [0, 0]}},
    }
    pairs = [
        {"turning": "O"},
        {"sliding": "rail", "links": ["frame", "rod"], "line": {"through": list(through), "angle": rail}, "point": "P"},
        {"sliding": "slot", "on": "lever", "block": "P", "line": {"through": "L"}},
    ]
    inputs = [{"pair": "O", "position": rail - 70, "velocity": "1 rad/s"}]
    units = {"angle": "deg"}
    return files.from_dict(
        {"planar": 1, "units": units, "frame": "frame", "links": links, "pairs": pairs, "inputs": inputs}
    )


@pytest.mark.parametrize(("rail", "off"), part([(90, 0.0), (63, 0.3), (124, -0.4)], 1, 1))
def test_where_lines_become_parallel_both_ends_are_told_where_that_is(rail, off):
    mechanism = lever(rail, off)
    motion = planar.cycle(mechanism, 12)
    assert motion.outcome is Outcome.BRANCH_LOST
    assert f"beyond O = {rail - 180} deg and O = {rail} deg: towards there" in motion.reason
    assert "slide out without an end, as where lines become parallel" in motion.reason
    # shown within a degree or so of them
    np.testing.assert_allclose(np.degrees(motion.inputs["O"].position[[0, -1]]), [rail - 180, rail], atol=1.0)
    assert places(motion, DEAD) == []


@pytest.mark.parametrize("through", part([(1.0, 0.0), (1e-3, 0.0), (30.0, 0.0)], 1))
def test_short_of_where_lines_become_parallel_a_position_and_a_run_agree(through):
    mechanism = lever(90, 0.0, through)
    for degrees in (-89.9, 89.99):
        rise = through[0] * np.tan(np.radians(degrees))
        here = planar.solve(mechanism, {"O": np.radians(degrees)}).pair("rail")["displacement"]
        motion = planar.cycle(mechanism, 3, stop=np.radians(degrees))
        assert motion.outcome is Outcome.SOLVED
        np.testing.assert_allclose([here, motion.pair("rail")["displacement"][-1]], rise, rtol=1e-11)
    for degrees in (135.0,):
        with pytest.raises(NoAnswer, match="cannot go beyond O = 90 deg"):
            planar.solve(mechanism, {"O": np.radians(degrees)})
        motion = planar.cycle(mechanism, 3, stop=np.radians(degrees))
        assert motion.outcome is Outcome.BRANCH_LOST
        assert "cannot go beyond O = 90 deg" in motion.reason
        assert places(motion, DEAD) == []


def slides_in_a_ring(face, lift, reach, through):
    """Three slides in a ring: a wedge on the floor lifts a rod, without an end."""
    points = {"A": [0, 0]} | ({"end": [reach, 0]} if reach else {})
    links = {"frame": {"points": {"O": [0, 0]}}, "wedge": {"points": points}, "rod": {"points": {"B": [0, 0]}}}
    pairs = [
        {"sliding": "floor", "links": ["frame", "wedge"], "line": {"through": "O"}, "point": "A"},
        {
            "sliding": "face",
            "links": ["wedge", "rod"],
            "line": {"through": "A", "angle": face},
            "point": "B",
            "turn": -face,
        },
        {
            "sliding": "lift",
            "links": ["frame", "rod"],
            "line": {"through": list(through), "angle": lift},
            "point": "B",
            "turn": -lift,
        },
    ]
    inputs = [{"pair": "floor", "position": 0.5, "velocity": 1.0}]
    units = {"angle": "deg"}
    return files.from_dict(
        {"planar": 1, "units": units, "frame": "frame", "links": links, "pairs": pairs, "inputs": inputs}
    )


@pytest.mark.parametrize("reach", first_cases([0.1, 0.0]))
@pytest.mark.parametrize(
    ("face", "lift", "through"), part([(30, 90, (0.0, 0.0)), (30, 60, (1.0, 0.0)), (5, 80, (0.3, 0.2))], 1, 2)
)
def test_slides_without_an_end_have_no_limit(face, lift, through, reach):
    mechanism = slides_in_a_ring(face, lift, reach, through)
    up = np.exp(1j * np.radians(lift))
    normal = 1j * np.exp(1j * np.radians(face))

    def rise(x):
        """Where the rod's line meets the wedge's face: normal . (through + s up - x) = 0."""
        return float((np.conj(normal) * (x - complex(*through))).real / (np.conj(normal) * up).real)

    for x in (-5000.0, 70.0, 5000.0):
        here = planar.solve(mechanism, {"floor": x}).pair("lift")["displacement"]
        motion = planar.cycle(mechanism, 4, 0.0, x)
        assert motion.outcome is Outcome.SOLVED
        np.testing.assert_allclose([here, motion.pair("lift")["displacement"][-1]], rise(x), rtol=1e-12)
    with pytest.raises(BadInput, match="goes on without a limit"):
        planar.cycle(mechanism)


def test_a_place_too_far_out_to_be_followed_to_is_reached_as_the_refusal_says():
    mechanism = slides_in_a_ring(30, 90, 0.0, (0.0, 0.0))
    with pytest.raises(NoAnswer, match="write the place that is wanted as the input's `position`") as refused:
        planar.solve(mechanism, {"floor": 1e7})
    assert "drive" not in refused.value.reason
    value = files.to_dict(mechanism)
    value["inputs"][0]["position"] = 1e7
    there = planar.solve(files.from_dict(value))
    assert there.pair("lift")["displacement"] == pytest.approx(-1e7 * np.tan(np.radians(30)), rel=1e-12)


# many turns


@pytest.mark.parametrize("lengths", [ROCKER, PARALLELOGRAM])
def test_what_comes_round_is_followed_once_however_many_turns_it_makes(lengths, monkeypatch):
    mechanism = four_bar(*lengths, 1.0)
    few, some = arcs_of(monkeypatch, planar.cycle, mechanism, 12, stop=1.0 + 3 * TURN)
    motion, arcs = arcs_of(monkeypatch, planar.cycle, mechanism, 12, stop=1.0 + 1000 * TURN)
    assert arcs == some < 100
    assert motion.outcome is Outcome.SOLVED
    theta = motion.inputs["A"].position
    wanted = theta if lengths is PARALLELOGRAM else rocker(*lengths, theta)
    np.testing.assert_allclose(np.angle(np.exp(1j * (motion.link("DC").angle - wanted))), 0.0, atol=1e-10)
    assert len(motion.remarks) < 20  # what is met again and again is not told a thousand times
    limits, in_all = arcs_of(monkeypatch, lambda: motion.limits)
    assert in_all < 100
    turn = [each for each in few.limits if each.input < 1.0 + TURN]
    assert len(limits) == 1000 * len(turn)
    for first, last in zip(turn, limits[-len(turn) :], strict=True):
        assert (first.kind, first.of) == (last.kind, last.of)
        assert last.input == pytest.approx(first.input + 999 * TURN, abs=1e-9)


def test_wheels_that_count_turns_are_followed_for_as_many_as_they_need(monkeypatch):
    """3 to 2: after one turn of the crank all stands otherwise, after two as before."""
    mechanism = planar.load("geared-five-bar")
    first = mechanism.inputs[0].position
    (pair,) = (each.pair for each in mechanism.inputs)
    rows, arcs = arcs_of(monkeypatch, planar.cycle, mechanism, 7, stop=first + 7 * 143 * TURN)
    assert arcs < 200
    point = rows.point_names[-1]
    once = planar.cycle(mechanism, 2, stop=first + 2 * TURN)
    moved = {
        name: np.abs(once.point(name).position[0] - once.point(name).position[1]).max() for name in once.point_names
    }
    point = max(moved, key=moved.get)
    assert moved[point] > 1e-3
    np.testing.assert_allclose(rows.point(point).position[::2], once.point(point).position[[0, 0, 0, 0]], atol=1e-9)
    np.testing.assert_allclose(rows.point(point).position[1::2], once.point(point).position[[1, 1, 1, 1]], atol=1e-9)
    assert rows.inputs[pair].position[-1] == first + 7 * 143 * TURN


def test_a_run_says_how_far_it_has_come():
    told = []
    planar.cycle(four_bar(*ROCKER, 1.0), 3, stop=1.0 + 3 * TURN, progress=lambda *each: told.append(each))
    done, total = np.array(told).T
    assert np.all(np.diff(done) >= 0.0)
    np.testing.assert_allclose(total, 3 * TURN)


def test_a_run_that_takes_too_much_work_says_how_far_it_came(monkeypatch):
    monkeypatch.setattr("planar.solving.cycle.MAX_ARCS", 10)
    monkeypatch.setattr("planar.solving.cycle.ARCS_PER_TURN", 0)
    mechanism = four_bar(*ROCKER, 1.0)
    motion = planar.cycle(mechanism, 2, stop=1.0 + 0.9 * TURN)
    assert motion.outcome is Outcome.BRANCH_LOST
    reached = motion.inputs["A"].position[-1]
    assert 1.0 < reached < 1.0 + 0.9 * TURN
    assert f"was followed as far as A = {reached:.6g} rad, which took all the work" in motion.reason
    beyond = planar.cycle(mechanism, 90, stop=1.0 + 0.9 * TURN)  # by a finer grid, as is advised
    assert beyond.outcome is Outcome.SOLVED
    assert [each.kind for each in beyond.limits][-1] == "not followed further"


def test_of_a_range_that_takes_too_much_work_one_way_the_other_end_is_told_as_well(monkeypatch):
    """A scissor lift a little off its dimensions: fully up its bars all but coincide and can hardly be told apart."""
    value = files.to_dict(planar.load("scissor-lift"))
    for k, link in enumerate(value["links"].values()):
        if "length" in link:
            link["length"] *= 1 + 1e-5 * np.sin(7.0 * k)
    monkeypatch.setattr("planar.solving.cycle.MAX_ARCS", 100)
    motion = planar.cycle(files.from_dict(value), 6)
    assert motion.outcome is Outcome.BRANCH_LOST
    low, high = motion.inputs["foot"].position[[0, -1]]
    assert 0.0 < low < 1e-3
    assert abs(high - 0.6) < 1e-4
    assert f"followed as far as foot = {1e3 * low:.6g} mm, which took all the work" in motion.reason
    assert f"the range of 'foot' ends at foot = {1e3 * high:.6g} mm" in motion.reason


def test_a_cart_with_a_linkage_on_it_runs_along_its_rail_as_far_as_is_asked(monkeypatch):
    """Nothing but the cart moves, and nothing is near to anything."""
    value = files.to_dict(four_bar(*ROCKER, 1.0))
    links = value["links"]
    links["AD"]["points"]["F"] = [0.0, 0.0]
    value |= {"frame": "rail", "links": {"rail": {"points": {"R": [0, 0]}}, **links}}
    value["pairs"].append({"sliding": "along", "links": ["rail", "AD"], "line": {"through": "R"}, "point": "F"})
    value["inputs"].append({"pair": "along", "position": 0.0, "velocity": 1.0})
    value["sketch"] = {}
    mechanism = files.from_dict(value)
    motion, arcs = arcs_of(monkeypatch, planar.cycle, mechanism, 3, 0.0, 9000.0, "along")
    assert motion.outcome is Outcome.SOLVED
    np.testing.assert_allclose(motion.point("A").position[:, 0], [0.0, 3000.0, 6000.0, 9000.0], atol=1e-9)
    assert len(motion.limits) == 0
    assert arcs < 300


# dead points


@pytest.mark.parametrize("closed", [1, -1])
def test_dead_points_and_the_rockers_swing_of_a_triple_rocker(closed):
    a, b, c, d = TRIPLE
    motion = planar.cycle(four_bar(*TRIPLE, 0.6, closed), 12)
    limit = between(a, d, b + c)
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
    limit = between(a, d, b + c)
    motion = planar.cycle(four_bar(*TRIPLE, 0.6), 12, 0.6, 3.0)
    assert motion.outcome is Outcome.DEAD_POINT
    ((kind, of, at),) = told(motion)
    assert (kind, of) == (DEAD, "A")
    assert at == pytest.approx(limit, abs=1e-13)
    assert at == pytest.approx(motion.inputs["A"].position[-1], abs=1e-13)


@pytest.mark.parametrize("end", [-1, 1])
def test_a_range_that_starts_on_a_dead_point_counts_it(end):
    a, b, c, d = TRIPLE
    limit = end * between(a, d, b + c)
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
        turn = closed * between(d, reach, c)
        angle = closed * (np.pi - between(d, c, reach))
        wanted[0.8 + (turn + back - 0.8) % TURN] = angle
    np.testing.assert_allclose([each.input for each in found], sorted(wanted), atol=1e-12)
    for each, at in zip(found, sorted(wanted), strict=True):
        assert np.exp(1j * each.value) == pytest.approx(np.exp(1j * wanted[at]), abs=1e-12)


@pytest.mark.parametrize("start", [0.0, 1.0, np.pi])
@pytest.mark.parametrize("steps", [4, 90])
@pytest.mark.parametrize("offset", part([0.0, 0.1, -0.3], 1, 2))
def test_top_and_bottom_dead_centre_of_a_slider_crank(start, steps, offset):
    """Crank and rod in line: the block is l + r, and l - r, from the crank's pin."""
    r, rod = 0.48, 1.6
    motion = planar.cycle(block_slider_crank(r, rod, offset, start), steps)
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
    value = files.to_dict(block_slider_crank(0.48, 1.6, 0.1, 1.0))
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


@pytest.mark.parametrize(("steps", "start"), part([(12, 0.3), (7, 0.3), (4, 0.0), (360, 2.0)], 1, 2))
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
    motion = planar.cycle(block_slider_crank(0.05, 0.05, 0.0, 1.0), 12)
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
    with pytest.raises(BadInput, match=r"start: branches of the motion .* start; choose .* --branch"):
        planar.cycle(four_bar(*PARALLELOGRAM, 0.3), 12, start=0.0, circuit=True)
    assert (
        planar.cycle(four_bar(*PARALLELOGRAM, 0.3), 12, start=0.0, circuit=True, branches=[1]).outcome is Outcome.SOLVED
    )


def test_a_single_input_between_dead_points_close_by_is_not_one_input_too_many():
    """OA = 1, QB = 1 and AB = 1e-8 on a frame of sqrt(2): the crank swings by about 1e-8 rad each way."""
    value = files.to_dict(four_bar(1.0, 1e-8, 1.0, float(np.sqrt(2.0)), np.pi / 4))
    with pytest.raises(NoAnswer) as refused:
        planar.cycle(files.from_dict(value), 12)
    assert refused.value.outcome is Outcome.DEAD_POINT
    assert "other inputs" not in refused.value.reason


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


@pytest.mark.parametrize(
    ("part", "by"), part([(part, by) for part in range(4) for by in (1e-9, -1e-9, 1e-6 * (-1) ** (part // 2))], 1)
)
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
