"""Through change points: smoothly, or by another way where that is asked for; closed forms on both sides."""

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import NoAnswer, Outcome
from tests.builders import bar_document, block_slider_crank, four_bar, lift_document
from tests.checks import passes_residual_check, same_angles
from tests.closed_forms import PARALLELOGRAM, TURN, antiparallelogram, coupler, rates, rocker
from tests.draws import part

GRIDS = part(
    [(0.0, 4), (0.0, 60), (0.3, 1), (0.3, 7), (0.3, 61), (np.pi, 6), (-1.0, 45), (np.pi - 1e-6, 12), (1e-9, 8)], 1
)
"""Starts and steps of a turn: some hit the flat positions at 0 and pi, some step over them, some come very near."""


def with_third_crank(start, at=0.7):
    """A parallelogram 1, 2 with a third crank as long as the others: its pin on the frame is at * 2 from A."""
    turn = np.array([np.cos(start), np.sin(start)])
    bars = {"AB": ("A", "B", 1), "BC": ("B", "C", 2, {"F": {"along": ["B", "C"], "distance": 2 * at}})}
    bars |= {"DC": ("D", "C", 1), "EF": ("E", "F", 1)}
    sketch = {"C": np.add(turn, (2, 0)).tolist(), "F": np.add(turn, (2 * at, 0)).tolist()}
    frame = {"A": [0, 0], "D": [2, 0], "E": [2 * at, 0]}
    return files.from_dict(bar_document(frame, bars, ("A", start), omega=2.0, alpha=1.0, sketch=sketch))


def same_rates(motion, link, first, second, rows=slice(None)):
    np.testing.assert_allclose(
        motion.link(link).angular_velocity[rows], np.broadcast_to(first, len(motion))[rows], atol=1e-9
    )
    np.testing.assert_allclose(
        motion.link(link).angular_acceleration[rows], np.broadcast_to(second, len(motion))[rows], atol=2e-8
    )


@pytest.mark.parametrize(("start", "steps"), GRIDS)
def test_a_parallelogram_stays_one_on_any_grid(start, steps):
    mechanism = four_bar(*PARALLELOGRAM, 0.3)
    motion = planar.cycle(mechanism, steps, start, start + TURN, jerk=True)
    theta = motion.inputs["A"].position
    assert motion.outcome is Outcome.SOLVED
    assert len(motion) == steps + 1
    same_angles(motion.link("BC").angle, 0 * theta, 1e-12)
    same_angles(motion.link("DC").angle, theta, 1e-12)
    same_rates(motion, "BC", 0.0, 0.0)
    same_rates(motion, "DC", 2.0, 1.0)
    np.testing.assert_allclose(motion.angular_jerk("DC"), 0.0, atol=1e-5)
    np.testing.assert_allclose(motion.jerk("C"), motion.jerk("B"), atol=1e-5)
    assert passes_residual_check(mechanism, motion)


@pytest.mark.parametrize(("start", "steps"), GRIDS)
def test_an_antiparallelogram_stays_one_on_any_grid(start, steps):
    mechanism = four_bar(*PARALLELOGRAM, 0.3, -1)
    motion = planar.cycle(mechanism, steps, start, start + TURN)
    theta = motion.inputs["A"].position
    assert motion.outcome is Outcome.SOLVED
    phi, first, second = antiparallelogram(theta)
    same_angles(motion.link("DC").angle, phi, 1e-12)
    same_rates(motion, "DC", first, second)
    same_angles(motion.link("BC").angle, coupler(*PARALLELOGRAM, theta, phi), 1e-12)
    assert passes_residual_check(mechanism, motion)


@pytest.mark.parametrize(("start", "steps"), GRIDS)
def test_a_third_crank_goes_through_the_flat_positions_with_the_others(start, steps):
    mechanism = with_third_crank(0.3)
    motion = planar.cycle(mechanism, steps, start, start + TURN)
    theta = motion.inputs["A"].position
    assert motion.outcome is Outcome.SOLVED
    for name in ("AB", "DC", "EF"):
        same_angles(motion.link(name).angle, theta, 1e-12)
        same_rates(motion, name, 2.0, 1.0)
    same_angles(motion.link("BC").angle, 0 * theta, 1e-12)
    assert passes_residual_check(mechanism, motion)


def test_no_other_motion_leads_from_the_flat_positions_of_three_cranks():
    """Crossed, B, F and C would not be in one line on circles of one size."""
    for branches in ((), (2,)):
        motion = planar.cycle(with_third_crank(0.3), 12, branches=branches)
        same_angles(motion.link("EF").angle, motion.inputs["A"].position, 1e-12)
    assert not any("branches of the motion cross" in each for each in motion.remarks)


@pytest.mark.parametrize(("start", "steps"), part([(0.3, 4), (0.3, 13), (0.0, 4), (0.0, 12), (-1.0, 45)], 1))
def test_the_other_branch_at_a_flat_position_is_taken_where_it_is_asked_for(start, steps):
    """Parallel up to the change point where 2 is asked for, crossed beyond, and the other way round at the next."""
    for branches, parts in (
        ((2,), ((0.0, "parallel"), (np.pi, "crossed"))),
        ((1, 2), ((0.0, "parallel"), (TURN, "crossed"))),
        ((2, 2), ((0.0, "parallel"), (np.pi, "crossed"), (TURN, "parallel"))),
    ):
        mechanism = four_bar(*PARALLELOGRAM, 0.3)
        motion = planar.cycle(mechanism, steps, 0.3, 0.3 + TURN, branches=branches)
        assert motion.outcome is Outcome.SOLVED
        theta = motion.inputs["A"].position
        phi, first, second = antiparallelogram(theta)
        kinds = np.array([[k for at, k in parts if x > at][-1] for x in theta])
        is_crossed = kinds == "crossed"
        same_angles(motion.link("DC").angle, np.where(is_crossed, phi, theta), 1e-11)
        same_rates(motion, "DC", np.where(is_crossed, first, 2.0), np.where(is_crossed, second, 1.0))
        assert passes_residual_check(mechanism, motion)
        went = [
            "another one was taken, as asked for" if number == 2 else "this one goes on smoothly" for number in branches
        ]
        told = [each.told for each in motion.limits]
        assert [each.split("; ")[1] for each in told][: len(went)] == went


def test_on_a_change_point_where_it_goes_over_a_row_has_the_rates_of_the_branch_that_it_came_by():
    motion = planar.cycle(four_bar(*PARALLELOGRAM, 0.3), 4, 0.0, TURN, branches=[2])
    assert motion.inputs["A"].position[2] == np.pi
    np.testing.assert_allclose(motion.link("DC").angular_velocity, [2, 2, 2, -1.2, -6], atol=1e-10)


@pytest.mark.parametrize("steps", part([4, 12, 37], 1, 1))
def test_a_rhombus_stays_one_and_its_folded_branch_can_be_taken(steps):
    """At pi its crank lies on its frame: C may fall on A, and then BC lies on AB and DC stands still for good."""
    motion = planar.cycle(four_bar(1, 1, 1, 1, 0.5), steps)
    theta = motion.inputs["A"].position
    same_angles(motion.link("DC").angle, theta, 1e-12)
    same_rates(motion, "BC", 0.0, 0.0)
    folded = planar.cycle(four_bar(1, 1, 1, 1, 0.5), steps, branches=[2])
    beyond = theta > np.pi
    same_angles(folded.link("DC").angle, np.where(beyond, np.pi, theta), 1e-11)
    same_angles(folded.link("BC").angle, np.where(beyond, theta + np.pi, 0.0), 1e-11)
    same_rates(folded, "DC", np.where(beyond, 0.0, 2.0), np.where(beyond, 0.0, 1.0))


@pytest.mark.parametrize("steps", [3, 12, 90])
def test_a_kite_goes_through_its_flat_position_by_its_own_motion(steps):
    """a = d: at 0 crank and frame coincide. The angle at D is that of the crank's double turn: its own closed form."""
    a, b, c, d = 1.0, 2.0, 2.0, 1.0
    mechanism = four_bar(a, b, c, d, 1.0)
    motion = planar.cycle(mechanism, steps)
    theta = motion.inputs["A"].position
    assert motion.outcome is Outcome.SOLVED
    # the diagonal BD is 2 sin(theta / 2), signed so as to go on smoothly through zero, at right angles to the bisector
    diagonal = theta / 2 + np.pi / 2
    phi = diagonal - np.arccos(np.sin(theta / 2) / c)
    same_angles(motion.link("DC").angle, phi, 1e-12)
    clear = np.abs(np.sin(theta / 2)) > 1e-3
    beta = coupler(a, b, c, d, theta, phi)
    beta1, phi1, beta2, phi2 = rates(a, b, c, theta, beta, phi, 2.0, 1.0)
    same_rates(motion, "DC", phi1, phi2, clear)
    same_rates(motion, "BC", beta1, beta2, clear)


@pytest.mark.parametrize(("start", "steps"), part([(1.0, 12), (0.0, 4), (0.0, 12), (1.0, 7), (1.5, 360)], 1))
def test_a_slider_crank_of_equal_lengths_passes_the_cranks_pin_or_stays_on_it(start, steps):
    mechanism = block_slider_crank(0.05, 0.05, 0.0, 1.0)
    motion = planar.cycle(mechanism, steps, start, start + TURN)
    theta = motion.inputs["O"].position
    slide = motion.pair("s")
    np.testing.assert_allclose(slide["displacement"], 0.1 * np.cos(theta), atol=1e-14)
    np.testing.assert_allclose(slide["velocity"], -0.3 * np.sin(theta), atol=1e-10)
    np.testing.assert_allclose(slide["acceleration"], -0.9 * np.cos(theta) + 0.1 * np.sin(theta), atol=1e-9)
    assert passes_residual_check(mechanism, motion)
    folded = planar.cycle(mechanism, steps, start, start + TURN, branches=[2])
    beyond = theta > np.pi / 2 + 1e-9
    np.testing.assert_allclose(folded.pair("s")["displacement"], np.where(beyond, 0.0, 0.1 * np.cos(theta)), atol=1e-14)
    np.testing.assert_allclose(folded.pair("s")["velocity"][beyond], 0.0, atol=1e-10)
    same_angles(folded.link("rod").angle[beyond], theta[beyond] + np.pi, 1e-11)


@pytest.mark.parametrize("steps", [2, 90])
def test_backwards_the_same_change_points_are_passed(steps):
    motion = planar.cycle(four_bar(*PARALLELOGRAM, 0.3), steps, 0.3, 0.3 - 2 * TURN)
    same_angles(motion.link("DC").angle, motion.inputs["A"].position, 1e-12)
    found = [each.input for each in motion.limits]
    np.testing.assert_allclose(found, -np.pi * np.arange(4), atol=1e-12)


def test_a_change_point_of_a_part_of_a_linkage_is_passed_with_the_whole():
    """A dyad on the coupler of a parallelogram goes on as it would by itself."""
    bars = {"AB": ("A", "B", 1), "BC": ("B", "C", 2, {"F": [1.0, 0.5]}), "DC": ("D", "C", 1)}
    bars |= {"FH": ("F", "H", 2.5), "GH": ("G", "H", 2.2)}
    frame, sketch = {"A": [0, 0], "D": [2, 0], "G": [1.0, 2.5]}, {"C": [2.96, 0.3], "H": [3.5, 2.0]}
    value = bar_document(frame, bars, ("A", 0.3), omega=2.0, alpha=1.0, sketch=sketch)
    motion = planar.cycle(files.from_dict(value), 8, 0.0, TURN)
    theta = motion.inputs["A"].position
    # F moves as B does, by [1, 0.5]: a four-bar of its own with crank 1 about [1, 0.5], frame 2 upwards
    turned = theta - np.pi / 2
    phi = rocker(1.0, 2.5, 2.2, 2.0, turned, -1)
    beta = coupler(1.0, 2.5, 2.2, 2.0, turned, phi)
    _, phi1, _, phi2 = rates(1.0, 2.5, 2.2, turned, beta, phi, 2.0, 1.0)
    same_angles(motion.link("GH").angle, phi + np.pi / 2, 1e-11)
    same_rates(motion, "GH", phi1, phi2)


def test_what_is_greatest_on_a_change_point_is_found_there():
    """An antiparallelogram a, b: its follower turns (b + a) / (b - a) times as fast as the crank where B is nearest."""
    motion = planar.cycle(planar.load("antiparallelogram"), 90)
    ends = planar.extremes(motion, "B", "x")
    np.testing.assert_allclose([ends.least.value, ends.greatest.value], [0.04, 0.16], atol=1e-9)
    omega = abs(motion.link("crank").angular_velocity[0])
    fastest = planar.greatest(motion, "follower")
    assert fastest.value == pytest.approx(4.0 * omega, rel=1e-9)
    assert np.degrees(fastest.input) == pytest.approx(360.0, abs=1e-4)


def test_limits_are_those_of_the_branches_that_the_rows_take():
    """The piston of equal crank and rod rests on the crank's pin where that branch is taken: no end of a stroke."""
    motion = planar.cycle(block_slider_crank(1.0, 1.0, 0.0, 1.0), 40, start=1.2, stop=4.0, branches=[2])
    resting = motion.inputs["O"].position > TURN / 4 + 1e-9
    assert np.ptp(motion.pair("s")["displacement"][resting]) < 1e-12
    assert [limit.kind for limit in motion.limits] == ["change point"]
    assert motion.limits[0].input == pytest.approx(TURN / 4, abs=1e-12)
    beyond = planar.cycle(block_slider_crank(1.0, 1.0, 0.0, 1.0), 40, start=2.0, stop=4.0, branches=[2])
    assert beyond.limits == ()


def test_a_range_beside_a_change_point_passes_the_gate_on_any_grid():
    for wide in (0.05, 0.005, 1e-4, 1e-6):
        motion = planar.cycle(four_bar(*PARALLELOGRAM, 1.0), 37, start=np.pi - wide, stop=np.pi + 0.93 * wide)
        assert motion.outcome is Outcome.SOLVED
        np.testing.assert_allclose(motion.link("BC").angle, 0.0, atol=1e-12)


def test_where_the_inputs_turn_back_on_a_change_point_the_range_ends():
    """Hart's inversor lies flat at both ends of its range, and its circuit comes back through them."""
    motion = planar.cycle(planar.load("hart-inversor"), 40)
    ends = [limit.input for limit in motion.limits if limit.kind == "input dead point"]
    np.testing.assert_allclose(ends, motion.inputs["B"].position[[0, -1]], atol=1e-12)
    assert ends[0] == pytest.approx(-ends[1], abs=1e-12)
    round_it = planar.cycle(planar.load("hart-inversor"), 40, circuit=True)
    for point in round_it.points.values():
        np.testing.assert_allclose(point.position[-1], point.position[0], atol=1e-9)


def test_a_range_up_to_a_dead_point_that_was_told_is_solved():
    mechanism = four_bar(0.9, 0.7, 0.85, 1.5, 0.5)
    end = planar.cycle(mechanism, 4).limits[-1]
    assert end.kind == "input dead point"
    for short in (0.0, 1e-14, 1e-13, 1e-9):
        motion = planar.cycle(mechanism, 6, start=0.5, stop=end.input - short)
        assert motion.residual < 1e-12
        assert motion.inputs["A"].position[-1] == pytest.approx(end.input, abs=2e-9)


# starts on a change point

LINES = dict(
    part({"forth": (0.0, 1.0), "back": (0.0, -1.0), "both ways": (-1.0, 1.0), "a turn": (0.0, TURN)}.items(), 1, 2)
)


@pytest.mark.parametrize("away", LINES.values(), ids=LINES)
@pytest.mark.parametrize(("at", "crossed_first"), [(0.0, False), (np.pi, True)])
@pytest.mark.parametrize("number", [1, 2])
def test_a_flat_start_goes_on_as_parallelogram_or_crossed_as_its_number_says(number, at, crossed_first, away):
    """By number 1 the least moves: at 0 DC with the crank, not three times as fast; at pi a third as fast, crossed."""
    mechanism = four_bar(*PARALLELOGRAM, at)
    motion = planar.cycle(mechanism, 6, at + away[0], at + away[1], branches=[number])
    theta = motion.inputs["A"].position
    assert (motion.outcome, len(motion)) == (Outcome.SOLVED, 7)
    phi, first, second = antiparallelogram(theta) if (number == 1) is crossed_first else (theta, 2.0, 1.0)
    same_angles(motion.link("DC").angle, phi, 1e-12)
    same_rates(motion, "DC", first, second)
    assert passes_residual_check(mechanism, motion)
    assert [each.input for each in motion.limits if each.kind == "change point"][:1] == pytest.approx([at], abs=1e-9)
    assert any(f"starts there by number {number}" in each for each in motion.remarks)


@pytest.mark.parametrize("number", [1, 2])
def test_the_circuit_from_a_flat_start_and_the_run_in_time_take_the_way_of_that_number(number):
    mechanism = four_bar(*PARALLELOGRAM, 0.0)
    for given in ({"circuit": True}, {"duration": 1.0}):
        motion = planar.cycle(mechanism, 6, branches=[number], **given)
        theta = motion.inputs["A"].position
        same_angles(motion.link("DC").angle, antiparallelogram(theta)[0] if number == 2 else theta, 1e-12)
        assert np.isfinite(motion.link("DC").angular_velocity).all()


def test_numbers_after_the_first_are_of_the_change_points_that_are_met_then():
    motion = planar.cycle(four_bar(*PARALLELOGRAM, 0.0), 8, branches=[2, 2])
    theta = motion.inputs["A"].position
    expected = np.where(theta < np.pi - 1e-9, antiparallelogram(theta)[0], theta)
    same_angles(motion.link("DC").angle, expected, 1e-11)


def test_a_number_beyond_the_ways_takes_the_last_and_says_so():
    last = planar.cycle(four_bar(*PARALLELOGRAM, 0.0), 8, branches=[2, 2])
    motion = planar.cycle(four_bar(*PARALLELOGRAM, 0.0), 8, branches=[3, 3])
    np.testing.assert_array_equal(motion.link("DC").angle, last.link("DC").angle)
    assert not any("as asked for" in each for each in motion.remarks)
    assert sum("the last that there is" in each for each in motion.remarks) == 2
    assert not any("the last that there is" in each for each in last.remarks)


def test_a_rhombus_that_starts_flat_stays_one_or_keeps_its_follower_at_rest():
    for number, phi in ((1, None), (2, np.pi)):
        motion = planar.cycle(four_bar(1, 1, 1, 1, np.pi), 6, np.pi, np.pi + 2.0, branches=[number])
        theta = motion.inputs["A"].position
        same_angles(motion.link("DC").angle, theta if phi is None else phi, 1e-11)
        same_angles(motion.link("BC").angle, 0.0 * theta if phi is None else theta + np.pi, 1e-11)


def test_a_slider_crank_of_equal_lengths_that_starts_upright_goes_on_folded_or_passes():
    upright = np.pi / 2
    for number, reach in ((1, 0.0), (2, 0.1)):
        mechanism = block_slider_crank(0.05, 0.05, 0.0, upright)
        motion = planar.cycle(mechanism, 8, upright - 1.0, upright + 1.0, branches=[number])
        theta = motion.inputs["O"].position
        np.testing.assert_allclose(motion.pair("s")["displacement"], reach * np.cos(theta), atol=1e-13)
        np.testing.assert_allclose(motion.pair("s")["velocity"], -3.0 * reach * np.sin(theta), atol=1e-9)


def test_a_start_on_a_change_point_says_which_number_goes_which_way():
    for act in (planar.solve, planar.cycle):
        with pytest.raises(NoAnswer) as refused:
            act(four_bar(*PARALLELOGRAM, 0.0))
        assert refused.value.outcome is Outcome.CHANGE_POINT
        assert "1 moves 'DC' by 1, 2 moves 'DC' by -3 rad for each rad of the input" in refused.value.reason


def test_a_run_in_time_from_a_change_point_is_refused_as_the_position_is_and_goes_on_by_a_number():
    mechanism = four_bar(*PARALLELOGRAM, 0.0)
    with pytest.raises(NoAnswer) as at_rest:
        planar.solve(mechanism)
    with pytest.raises(NoAnswer) as in_time:
        planar.cycle(mechanism, 10, duration=0.1)
    assert in_time.value.outcome is Outcome.CHANGE_POINT
    assert in_time.value.reason == at_rest.value.reason
    assert "`branches` (--branch)" in in_time.value.reason
    assert planar.cycle(mechanism, 10, duration=0.1, branches=[2]).outcome is Outcome.SOLVED


@pytest.mark.parametrize(("stages", "told"), [(3, "4 branches"), (6, "32 branches"), (10, "at least 2 branches")])
def test_at_the_flat_position_of_a_lift_any_number_of_stages_turns_over(stages, told):
    """Each stage beyond the first may open either way; of very many branches none are counted."""
    limits = planar.cycle(planar.from_dict(lift_document(stages)), 4).limits
    flat = [each.told for each in limits if each.kind == "change point" and each.input]
    assert len(flat) == 2
    assert all(f"m {told} of the motion cross" in each for each in flat)


def parallelograms_in_a_row(count, start):
    """Parallelograms 1, 2, one beside the other: the rocker of one is the crank of the next."""
    ground = {f"D{k}": [2.0 * k, 0.0] for k in range(count + 1)}
    bars = {f"c{k}": (f"D{k}", f"B{k}", 1.0) for k in range(count + 1)}
    bars |= {f"r{k}": (f"B{k}", f"B{k + 1}", 2.0) for k in range(count)}
    sketch = {f"B{k}": [2.0 * k + np.cos(start), np.sin(start)] for k in range(count + 1)}
    return files.from_dict(bar_document(ground, bars, ("D0", start), omega=2.0, alpha=1.0, sketch=sketch))


@pytest.mark.parametrize(("count", "start"), [(2, 0.0), (3, 0.0), (3, 1e-9)])
def test_a_start_where_several_parallelograms_are_flat_goes_on_by_every_branch(count, start):
    mechanism = parallelograms_in_a_row(count, start)
    with pytest.raises(NoAnswer) as refused:
        planar.cycle(mechanism, 8, start, 1.0)
    assert refused.value.outcome is Outcome.CHANGE_POINT
    expected = [np.array([1.0])]
    for _ in range(count):
        expected = [np.append(angles, angle) for angles in expected for angle in (angles[-1], follower(angles[-1]))]
    ends = []
    for number in range(1, 2**count + 1):
        motion = planar.cycle(mechanism, 8, start, 1.0, branches=[number])
        assert motion.outcome is Outcome.SOLVED
        ends.append([motion.link(f"c{k}").angle[-1] for k in range(count + 1)])
    distances = np.abs(np.exp(1j * np.array(ends))[:, None] - np.exp(1j * np.array(expected))).max(axis=2)
    assert sorted(np.argmin(distances, axis=1)) == list(range(2**count))
    assert distances.min(axis=1).max() < 1e-9


def follower(theta):
    """The angle of the antiparallelogram's rocker at an angle of its crank."""
    return antiparallelogram(theta)[0]
