"""All round the closed curve of positions, there and back, and starts on dead points: against closed forms."""

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from tests.builders import block_slider_crank, four_bar
from tests.checks import passes_residual_check, same_angles
from tests.closed_forms import (
    PARALLELOGRAM,
    ROCKER,
    TRIPLE,
    TRIPLE_LIMIT,
    TURN,
    antiparallelogram,
    between,
    coupler,
    rates,
    rocker,
)
from tests.draws import part

DEAD = "input dead point"
A, B, C, D = TRIPLE


def comes_back(mechanism, motion, far=1e-9):
    """Whether the last row is the first: every link stands as it did, whole turns aside."""
    for link in mechanism.links:
        angle = motion.link(link.name).angle
        assert np.exp(1j * angle[-1]) == pytest.approx(np.exp(1j * angle[0]), abs=far)
    for name in motion.point_names:
        place = motion.point(name).position
        np.testing.assert_allclose(place[-1], place[0], atol=far)


def halves(theta, first):
    """The assembly of the triple rocker at every row of its circuit: `first` up to the first dead point, and so on."""
    turns = np.flatnonzero(np.isclose(np.abs(theta), TRIPLE_LIMIT, atol=1e-9) & (np.arange(len(theta)) > 0))
    return first * (-1) ** np.searchsorted(turns, np.arange(len(theta)), side="right"), turns


@pytest.mark.parametrize("steps", part([1, 2, 7, 90], 1, 2))
@pytest.mark.parametrize("closed", [1, -1])
def test_the_circuit_of_a_triple_rocker_goes_through_both_assemblies(closed, steps):
    mechanism = four_bar(*TRIPLE, 0.6, closed)
    motion = planar.cycle(mechanism, steps, circuit=True)
    assert (motion.outcome, motion.reason) == (Outcome.SOLVED, "")
    theta = motion.inputs["A"].position
    kinds, turns = halves(theta, closed)
    np.testing.assert_allclose(theta[turns], [TRIPLE_LIMIT, -TRIPLE_LIMIT], atol=1e-13)
    np.testing.assert_allclose(theta[[0, -1]], 0.6, atol=1e-12)
    # the longest stretch, from limit to limit, is divided into so many steps, and the others about as finely
    assert turns[1] - turns[0] == steps
    np.testing.assert_array_equal(np.abs(np.diff(theta)) <= 2 * TRIPLE_LIMIT / steps * (1 + 1e-9), True)
    inner = np.ones(len(theta), dtype=bool)
    inner[turns] = False
    phi = np.where(kinds > 0, rocker(*TRIPLE, theta, 1), rocker(*TRIPLE, theta, -1))
    same_angles(motion.link("DC").angle[inner], phi[inner], 1e-11)
    # at a dead point coupler and follower lie in line
    same_angles(motion.link("DC").angle[turns], rocker(*TRIPLE, theta[turns], 0), 1e-12)
    sense = np.where(np.searchsorted(turns, np.arange(len(theta)), side="left") == 1, -1.0, 1.0)
    np.testing.assert_array_equal(motion.inputs["A"].velocity, 2.0 * sense)
    np.testing.assert_array_equal(motion.inputs["A"].acceleration, 1.0)
    beta = coupler(*TRIPLE, theta, phi)
    beta1, phi1, beta2, phi2 = rates(A, B, C, theta[inner], beta[inner], phi[inner], 2.0 * sense[inner], 1.0)
    for name, first, second in (("BC", beta1, beta2), ("DC", phi1, phi2)):
        link = motion.link(name)
        np.testing.assert_allclose(link.angular_velocity[inner], first, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(link.angular_acceleration[inner], second, rtol=1e-8, atol=1e-8)
        assert np.isnan(link.angular_velocity[turns]).all()
        assert np.isnan(link.angular_acceleration[turns]).all()
    # within the circuit the follower swings from its one end to its other without a jump
    assert np.abs(np.diff(motion.link("DC").angle)).max() < 5.0 / min(steps, 10)
    comes_back(mechanism, motion)
    assert passes_residual_check(mechanism, motion)


def test_the_limits_of_a_circuit_come_in_its_order():
    """The follower turns back where crank and coupler are in line, once in each assembly."""
    motion = planar.cycle(four_bar(*TRIPLE, 0.6), 12, circuit=True)
    swing = between(D, A + B, C)
    found = motion.limits
    assert [(each.kind, each.of) for each in found] == 2 * [(DEAD, "A"), ("stroke end", "D")]
    np.testing.assert_allclose([each.input for each in found], [TRIPLE_LIMIT, -swing, -TRIPLE_LIMIT, swing], atol=1e-12)


def test_a_crank_that_turns_round_has_its_turn_as_circuit():
    mechanism = four_bar(*ROCKER, 0.8)
    turn, circuit = planar.cycle(mechanism, 36), planar.cycle(mechanism, 36, circuit=True)
    for name in ("AB", "BC", "DC"):
        for found, wanted in zip(circuit.link(name), turn.link(name), strict=True):
            np.testing.assert_allclose(found, wanted, atol=1e-10)
    np.testing.assert_allclose([x.input for x in circuit.limits], [x.input for x in turn.limits], atol=1e-12)
    comes_back(mechanism, circuit)


def test_the_circuit_of_a_trammel_is_its_whole_turn():
    """P at L cos(phi) and Q at L sin(phi): once round, through both limits of the driven slide."""
    mechanism = planar.load("elliptical-trammel")
    motion = planar.cycle(mechanism, 40, circuit=True)
    x, y = motion.inputs["across"].position, motion.pair("up")["displacement"]
    np.testing.assert_allclose(x * x + y * y, 0.12**2, atol=1e-15)
    turned = np.unwrap(np.arctan2(y, x))
    assert abs(turned[-1] - turned[0]) == pytest.approx(TURN, abs=1e-9)
    assert np.all(np.diff(turned) * np.sign(turned[-1] - turned[0]) > 0)
    dead = [each.input for each in motion.limits if each.kind == DEAD]
    np.testing.assert_allclose(sorted(dead), [-0.12, 0.12], atol=1e-15)
    # the other slide turns back in the middle
    ends = [each for each in motion.limits if each.kind == "stroke end" and each.of == "up"]
    np.testing.assert_allclose([each.input for each in ends], 0.0, atol=1e-13)
    np.testing.assert_allclose(sorted(each.value for each in ends), [-0.12, 0.12], atol=1e-15)
    comes_back(mechanism, motion)


@pytest.mark.parametrize("rod", [0.3, 1.6])
def test_the_circuit_of_a_slider_crank_driven_by_its_block(rod):
    """With a long rod the crank turns round; with a short one it swings, and the block stays on its side."""
    value = files.to_dict(block_slider_crank(0.48, rod, 0.1, 1.0))
    value["inputs"] = [{"pair": "s", "position": 0.5 + 0.75 * (rod - 0.3), "velocity": 2.0}]
    value["sketch"] = {"A": [0.3, 0.4]}
    mechanism = files.from_dict(value)
    motion = planar.cycle(mechanism, 30, circuit=True)
    ends = [np.sqrt((far - 0.1) * (far + 0.1)) for far in (abs(0.48 - rod), 0.48 + rod)]
    dead = [each for each in motion.limits if each.kind == DEAD]
    np.testing.assert_allclose(sorted(each.input for each in dead), ends, atol=1e-12)
    angle = motion.link("crank").angle
    assert abs(angle[-1] - angle[0]) == pytest.approx(TURN if rod > 0.48 else 0.0, abs=1e-9)
    # crank and rod in line at the dead points
    rows = np.flatnonzero(np.isnan(motion.link("crank").angular_velocity))
    assert len(rows) == 2
    np.testing.assert_allclose(np.sin(angle - motion.link("rod").angle)[rows], 0.0, atol=1e-12)
    comes_back(mechanism, motion)
    assert passes_residual_check(mechanism, motion)


def test_gears_come_back_after_the_turns_that_their_teeth_need():
    """The second crank turns -1.5 times as far: twice round."""
    mechanism = planar.load("geared-five-bar")
    motion = planar.cycle(mechanism, 40, circuit=True)
    (given,) = motion.inputs.values()
    assert given.position[-1] - given.position[0] == pytest.approx(2 * TURN, abs=1e-12)
    assert len(motion) == 81
    comes_back(mechanism, motion)


def test_a_circuit_keeps_to_its_branch_through_change_points_or_takes_another():
    mechanism = four_bar(*PARALLELOGRAM, 0.3)
    smooth = planar.cycle(mechanism, 24, circuit=True)
    same_angles(smooth.link("DC").angle, smooth.inputs["A"].position, 1e-11)
    comes_back(mechanism, smooth)
    over = planar.cycle(mechanism, 24, circuit=True, branches=[2, 2])
    theta = over.inputs["A"].position
    beyond = (theta > np.pi) & (theta < TURN)
    same_angles(over.link("DC").angle, np.where(beyond, antiparallelogram(theta)[0], theta), 1e-11)
    comes_back(mechanism, over)


def test_a_circuit_that_does_not_come_back_says_so():
    for model, words in (("rolling-wheel", "slides on without an end"),):
        with pytest.raises(NoAnswer, match=words) as refused:
            planar.cycle(planar.load(model), 12, circuit=True)
        assert refused.value.outcome is Outcome.BRANCH_LOST
        assert "name where the range starts and stops" in refused.value.reason


# starts on a dead point


@pytest.mark.parametrize("steps", part([1, 5, 40], 1, 1))
@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("side", [1, -1])
def test_a_start_on_a_dead_point_goes_inwards_by_either_way(side, number, steps):
    """Both assemblies meet there; numbers 1 and 2 take one each."""
    mechanism = four_bar(*TRIPLE, side * TRIPLE_LIMIT)
    motion = planar.cycle(mechanism, steps, side * TRIPLE_LIMIT, 0.2 * side, branches=[number])
    theta = motion.inputs["A"].position
    np.testing.assert_allclose(theta, np.linspace(side * TRIPLE_LIMIT, 0.2 * side, steps + 1), atol=1e-14)
    ways = [np.abs(np.exp(1j * motion.link("DC").angle) - np.exp(1j * rocker(*TRIPLE, theta, k))) for k in (1, -1)]
    gaps = [float(each[1:].max()) for each in ways]
    assert min(gaps) < 1e-10
    assert max(gaps) > 0.1
    other = planar.cycle(mechanism, steps, side * TRIPLE_LIMIT, 0.2 * side, branches=[3 - number])
    assert abs(np.exp(1j * other.link("DC").angle[-1]) - np.exp(1j * motion.link("DC").angle[-1])) > 0.1
    assert np.isnan(motion.link("DC").angular_velocity).tolist() == [True] + steps * [False]
    same_angles(motion.link("DC").angle[:1], rocker(*TRIPLE, theta[:1], 0), 1e-7)
    default = planar.cycle(mechanism, steps, side * TRIPLE_LIMIT, 0.2 * side)
    if number == 1:
        np.testing.assert_array_equal(default.link("DC").angle, motion.link("DC").angle)


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("side", [1, -1])
def test_the_circuit_from_a_dead_point_ends_there_whichever_way_round(side, number):
    mechanism = four_bar(*TRIPLE, side * TRIPLE_LIMIT)
    motion = planar.cycle(mechanism, 20, circuit=True, branches=[number])
    theta = motion.inputs["A"].position
    assert len(theta) == 41
    np.testing.assert_allclose(
        theta[[0, 20, 40]], [side * TRIPLE_LIMIT, -side * TRIPLE_LIMIT, side * TRIPLE_LIMIT], atol=1e-12
    )
    for rate in motion.link("DC")[1:]:
        assert np.flatnonzero(np.isnan(rate)).tolist() == [0, 20, 40]
    # the start is as near to the dead point as the file's number says: in other angles the root of that
    comes_back(mechanism, motion, 1e-7)
    first = motion.link("DC").angle[10]
    other = planar.cycle(mechanism, 20, circuit=True, branches=[3 - number])
    # the other way round the same positions come in the opposite order
    same_angles(other.link("DC").angle[1:-1], motion.link("DC").angle[::-1][1:-1], 1e-9)
    assert np.exp(1j * first) != pytest.approx(np.exp(1j * other.link("DC").angle[10]), abs=0.1)


@pytest.mark.parametrize("number", [1, 2])
def test_a_start_on_a_dead_point_to_the_last_bit_goes_either_way(number):
    """Crank 5 at (-3, 4), coupler 3 and follower 7 upright on (-3, 0): the slope is singular without any rounding."""
    links = {
        "f": {"points": {"O": [0, 0], "Q": [-3, 0]}},
        "OA": {"ends": ["O", "A"], "length": 5},
        "AB": {"ends": ["A", "B"], "length": 3},
        "QB": {"ends": ["Q", "B"], "length": 7},
    }
    limit = float(np.arctan2(4, -3))
    value = {"planar": 1, "frame": "f", "links": links, "pairs": [{"turning": name} for name in "OABQ"]}
    value |= {"inputs": [{"pair": "O", "position": limit, "velocity": 1.0}], "sketch": {"B": [-3, 7]}}
    mechanism = files.from_dict(value)
    motion = planar.cycle(mechanism, 12, circuit=True, branches=[number])
    assert (motion.outcome, motion.reason) == (Outcome.SOLVED, "")
    np.testing.assert_allclose(motion.inputs["O"].position[[0, 12, 24]], [limit, -limit, limit], atol=1e-12)
    comes_back(mechanism, motion, 1e-7)
    # two assemblies are mirrored at the line AQ; of the two ways round the one has each first
    a, b = (motion.point(name).position[6] for name in "AB")
    side = (a[0] + 3) * b[1] - a[1] * (b[0] + 3)
    other = planar.cycle(mechanism, 12, circuit=True, branches=[3 - number]).point("B").position[6]
    assert side * ((a[0] + 3) * other[1] - a[1] * (other[0] + 3)) < 0.0


def test_the_whole_range_from_a_dead_point_is_that_from_elsewhere():
    """Without a range of its own it is one assembly from limit to limit."""
    for number in (1, 2):
        motion = planar.cycle(four_bar(*TRIPLE, TRIPLE_LIMIT), 16, branches=[number])
        theta = motion.inputs["A"].position
        np.testing.assert_allclose(theta, np.linspace(-TRIPLE_LIMIT, TRIPLE_LIMIT, 17), atol=1e-12)
        gaps = [
            np.abs(np.exp(1j * motion.link("DC").angle) - np.exp(1j * rocker(*TRIPLE, theta, k)))[1:-1].max()
            for k in (1, -1)
        ]
        assert min(gaps) < 1e-10
        assert max(gaps) > 0.1


# there and back


@pytest.mark.parametrize("steps", part([1, 2, 9, 60], 1, 2))
@pytest.mark.parametrize(
    "given", [{}, {"start": 0.1, "stop": 1.1}, {"start": 1.1, "stop": 0.1}, {"stop": 2.0}], ids=str
)
def test_there_and_back_is_the_way_there_and_its_mirror_image(given, steps):
    """As in a film run backwards: positions and accelerations are the same, velocities turn round."""
    mechanism = four_bar(*TRIPLE, 0.6)
    there = planar.cycle(mechanism, steps, **given, jerk=True)
    both = planar.cycle(mechanism, steps, **given, there_and_back=True, jerk=True)
    last = len(there) - 1
    assert len(both) == 2 * last + 1
    assert (both.outcome, both.reason) == (there.outcome, there.reason)
    odd = np.where(np.arange(2 * last + 1) > last, -1.0, 1.0)

    def same(found, wanted, sense):
        mirrored = np.concatenate([wanted, wanted[-2::-1]])
        np.testing.assert_allclose(found, (mirrored.T * sense).T, rtol=1e-9, atol=1e-9)

    for k, sense in enumerate((1.0, odd, 1.0)):
        same(both.inputs["A"][k], there.inputs["A"][k], sense)
        for name in ("BC", "DC"):
            same(both.link(name)[k], there.link(name)[k], sense)
        same(both.point("E")[k], there.point("E")[k], sense)
    same(both.angular_jerk("DC"), there.angular_jerk("DC"), odd)
    assert passes_residual_check(mechanism, both)


def test_there_and_back_through_a_change_point_comes_back_as_it_went():
    for branches, kind in (((), 1.0), ((2,), -1.0)):
        motion = planar.cycle(four_bar(*PARALLELOGRAM, 0.3), 10, 0.3, 4.5, there_and_back=True, branches=branches)
        theta = motion.inputs["A"].position
        np.testing.assert_array_equal(theta, theta[::-1])
        phi = np.where((theta > np.pi) & (kind < 0), antiparallelogram(theta)[0], theta)
        same_angles(motion.link("DC").angle, phi, 1e-11)


# what is refused

TIMED = {"duration": 2.0}
MISTAKES = [
    ({"circuit": True, "stop": 2.0}, "circuit", "it has no end to stop at"),
    ({"circuit": True, "there_and_back": True}, "circuit", "it has no end to stop at"),
    (TIMED | {"circuit": True}, "duration", "a run in time has no range"),
    (TIMED | {"start": 0.3}, "duration", "a run in time has no range"),
    (TIMED | {"stop": 0.3}, "duration", "a run in time has no range"),
    (TIMED | {"pair": "A"}, "duration", "a run in time has no range"),
    (TIMED | {"there_and_back": True}, "duration", "a run in time has no range"),
    ({"duration": 0.0}, "duration", "a time"),
    ({"duration": -1.0}, "duration", "a time"),
    ({"duration": np.nan}, "duration", "a number up to"),
    ({"duration": np.inf}, "duration", "a number up to"),
    ({"duration": True}, "duration", "a number up to"),
    ({"duration": "2 s"}, "duration", "a number up to"),
    ({"branches": [0]}, "branches", "numbers of branches from 1 on is wanted"),
    ({"branches": [1, -2]}, "branches", "numbers of branches from 1 on is wanted"),
    ({"branches": [1.5]}, "branches", "numbers of branches from 1 on is wanted"),
    ({"branches": [True]}, "branches", "numbers of branches from 1 on is wanted"),
    ({"branches": ["2"]}, "branches", "numbers of branches from 1 on is wanted"),
    ({"branches": "2"}, "branches", "numbers of branches from 1 on is wanted"),
]


@pytest.mark.parametrize(("given", "place", "words"), MISTAKES, ids=str)
def test_a_mistaken_argument_is_named_in_one_sentence(given, place, words):
    with pytest.raises(BadInput) as refused:
        planar.cycle(four_bar(*ROCKER, 0.8), 12, **given)
    assert refused.value.place == place
    assert words in refused.value.sentence
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("given", [{"branches": 2}, {"branches": None}, {"branches": [None]}], ids=str)
def test_branches_that_are_no_list_are_refused_as_well(given):
    with pytest.raises(BadInput) as refused:
        planar.cycle(four_bar(*ROCKER, 0.8), 12, **given)
    assert refused.value.place == "branches"


def test_more_branches_than_change_points_do_no_harm():
    """And a number above that of the branches is the last of them."""
    plain = planar.cycle(four_bar(*ROCKER, 0.8), 12)
    numbered = planar.cycle(four_bar(*ROCKER, 0.8), 12, branches=[2, 5, 1])
    np.testing.assert_array_equal(plain.link("DC").angle, numbered.link("DC").angle)
    two, many = (planar.cycle(four_bar(*PARALLELOGRAM, 0.3), 7, branches=[each]) for each in (2, 9))
    np.testing.assert_array_equal(two.link("DC").angle, many.link("DC").angle)


def test_third_rates_are_there_only_where_they_are_asked_for():
    with pytest.raises(BadInput, match="third rates are there where the motion is made with jerk=True"):
        planar.cycle(four_bar(*ROCKER, 0.8), 4).jerk("C")
