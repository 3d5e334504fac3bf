"""Runs in time: inputs by their laws, rates against differences of positions, ends and change points at their times."""

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import BadInput, Outcome
from tests.builders import block_slider_crank, four_bar
from tests.checks import passes_residual_check, same_angles
from tests.closed_forms import PARALLELOGRAM, ROCKER, TRIPLE, TRIPLE_LIMIT, antiparallelogram, piston, rocker
from tests.draws import part

RISES = ["3-4-5", "4-5-6-7", "cycloidal", "harmonic", "trapezoidal", "modified trapezoidal"]


def lawful(mechanism, *laws, velocity=0.0):
    """The mechanism with these laws at its inputs, which start at this velocity."""
    value = files.to_dict(mechanism)
    for given, law in zip(value["inputs"], laws, strict=True):
        given |= {"velocity": velocity, "acceleration": 0.0}
        if law is not None:
            given["law"] = law
    return files.from_dict(value)


def rise(by, duration, motion="cycloidal"):
    return {"motion": motion, "by": by, "in": duration}


def two_cranks(first=None, second=None, third=None):
    """A five-bar whose two cranks on the frame are driven, and an arm with a slide on its coupler's pin."""
    links = {
        "f": {"points": {"A": [0, 0], "E": [1.2, 0]}},
        "AB": {"ends": ["A", "B"], "length": 0.5},
        "ED": {"ends": ["E", "D"], "length": 0.6},
        "BC": {"ends": ["B", "C"], "length": 1.0, "points": {"P": [0.6, 0.2]}},
        "DC": {"ends": ["D", "C"], "length": 1.1},
    }
    inputs = [
        {"pair": "A", "position": 0.8, "velocity": 1.0, "acceleration": -0.5},
        {"pair": "E", "position": 1.9, "velocity": -0.7, "acceleration": 0.3},
    ]
    for given, law in zip(inputs, (first, second), strict=True):
        if law:
            given |= {"law": law, "velocity": 0.0, "acceleration": 0.0}
    value = {
        "planar": 1,
        "frame": "f",
        "links": links,
        "pairs": [{"turning": name} for name in "ABCDE"],
        "inputs": inputs,
        "sketch": {"C": [0.8, 1.4]},
    }
    return files.from_dict(value)


def parts(motion, order):
    """Angles of links and places of points, or their rates of an order up to three, one column each."""
    links = [link.name for link in motion.mechanism.links if link.name != motion.mechanism.frame]
    if order == 3:
        columns = [motion.angular_jerk(name)[:, None] for name in links]
        return np.hstack(columns + [motion.jerk(name) for name in motion.point_names])
    columns = [motion.link(name)[order][:, None] for name in links]
    return np.hstack(columns + [motion.point(name)[order] for name in motion.point_names])


def observed(runs, spacing, keep, orders=(0, 1, 2)):
    """By order: the greatest gaps of central differences of a rate from the next, of runs with steps halved."""
    found = []
    for order in orders:
        gaps = []
        for run in runs:
            h = spacing(run)
            value, rate = parts(run, order), parts(run, order + 1)
            gap = (value[2:] - value[:-2]) / (2 * h) - rate[1:-1]
            gaps.append(float(np.abs(gap[keep(run)[1:-1]]).max()))
        found.append(gaps)
    return found


@pytest.mark.parametrize("motion", RISES)
def test_every_rate_is_the_difference_of_the_one_before_at_order_two(motion):
    """Within one piece of the law, whose jerk may jump at its ends and in a trapezoidal one within."""
    mechanism = lawful(four_bar(*ROCKER, 0.8), [rise(3.0, 1.5, motion)])
    runs = [planar.cycle(mechanism, steps, jerk=True) for steps in (400, 800)]

    def smooth(run):
        tau = run.time / 1.5
        # trapezoids have corners at eighths
        return (np.abs((tau * 8 + 0.5) % 1.0 - 0.5) > 0.05) & (tau > 0.01) & (tau < 0.99)

    for order, (coarse, fine) in enumerate(observed(runs, lambda run: run.time[1], smooth)):
        assert 1.9 < np.log2(coarse / fine) < 2.1, order


def test_rates_of_two_inputs_by_their_laws_are_differences_at_order_two():
    mechanism = two_cranks([rise(0.9, 1.0), rise(-0.4, 1.0, "3-4-5")], [rise(0.5, 2.0, "4-5-6-7")])
    runs = [planar.cycle(mechanism, steps, jerk=True) for steps in (400, 800)]
    for run in runs:
        assert run.outcome is Outcome.SOLVED
        assert passes_residual_check(mechanism, run)

    def smooth(run):
        return (np.abs(run.time - 1.0) > 0.02) & (run.time > 0.02) & (run.time < 1.98)

    for order, (coarse, fine) in enumerate(observed(runs, lambda run: run.time[1], smooth)):
        assert 1.9 < np.log2(coarse / fine) < 2.1, order


def test_inputs_run_by_their_laws_and_one_without_by_the_files_own_rates():
    mechanism = two_cranks(None, [rise(0.5, 2.0, "4-5-6-7")])
    motion = planar.cycle(mechanism, 50)
    t = np.linspace(0.0, 2.0, 51)
    np.testing.assert_allclose(motion.time, t, atol=1e-15)
    tau = t / 2.0
    polynomial = 35 * tau**4 - 84 * tau**5 + 70 * tau**6 - 20 * tau**7
    slope = 140 * tau**3 - 420 * tau**4 + 420 * tau**5 - 140 * tau**6
    second = 420 * tau**2 - 1680 * tau**3 + 2100 * tau**4 - 840 * tau**5
    np.testing.assert_allclose(motion.inputs["E"].position, 1.9 + 0.5 * polynomial, atol=1e-14)
    np.testing.assert_allclose(motion.inputs["E"].velocity, 0.25 * slope, atol=1e-14)
    np.testing.assert_allclose(motion.inputs["E"].acceleration, 0.125 * second, atol=1e-13)
    np.testing.assert_allclose(motion.inputs["A"].position, 0.8 + t - 0.25 * t * t, atol=1e-14)
    np.testing.assert_allclose(motion.inputs["A"].velocity, 1.0 - 0.5 * t, atol=1e-14)
    np.testing.assert_array_equal(motion.inputs["A"].acceleration, -0.5)
    for name, pin in (("AB", "A"), ("ED", "E")):
        for k in range(3):
            np.testing.assert_allclose(motion.link(name)[k], motion.inputs[pin][k], atol=1e-12)
    # C is met by B and D: two circles
    b, d = motion.point("B").position, motion.point("D").position
    c = motion.point("C").position
    np.testing.assert_allclose(np.hypot(*(c - b).T), 1.0, atol=1e-13)
    np.testing.assert_allclose(np.hypot(*(c - d).T), 1.1, atol=1e-13)
    assert passes_residual_check(mechanism, motion)


@pytest.mark.parametrize(("given", "duration"), [(None, 2.0), (0.7, 0.7), (3.5, 3.5)])
def test_a_run_lasts_as_long_as_its_longest_law_or_as_is_asked_for(given, duration):
    mechanism = two_cranks([rise(0.3, 0.5)], [rise(0.5, 2.0)])
    motion = planar.cycle(mechanism, 35, duration=given)
    np.testing.assert_allclose(motion.time, np.linspace(0, duration, 36), atol=1e-15)
    # after its law an input stands still
    done = motion.time >= 0.5
    np.testing.assert_allclose(motion.inputs["A"].position[done], 1.1, atol=1e-14)
    np.testing.assert_array_equal(motion.inputs["A"].velocity[done], 0.0)


def test_without_a_law_a_duration_makes_a_run_in_time():
    motion = planar.cycle(four_bar(*ROCKER, 0.8), 40, duration=1.6)
    t = np.linspace(0, 1.6, 41)
    theta = 0.8 + 2.0 * t + 0.5 * t * t
    np.testing.assert_allclose(motion.inputs["A"].position, theta, atol=1e-14)
    np.testing.assert_allclose(motion.inputs["A"].velocity, 2.0 + t, atol=1e-14)
    same_angles(motion.link("DC").angle, rocker(*ROCKER, theta), 1e-12)


def test_a_named_range_is_no_run_in_time_though_there_is_a_law():
    mechanism = lawful(four_bar(*ROCKER, 0.8), [rise(3.0, 1.0)], velocity=2.0)
    motion = planar.cycle(mechanism, 10, 0.8, 1.8)
    assert motion.time is None
    np.testing.assert_allclose(motion.inputs["A"].position, np.linspace(0.8, 1.8, 11), atol=1e-14)
    with pytest.raises(BadInput, match="duration: a run in time has no range"):
        planar.cycle(mechanism, 10, 0.8, 1.8, duration=1.0)


def test_a_crank_by_a_law_that_comes_back_is_at_its_old_place_in_its_old_assembly():
    mechanism = lawful(four_bar(*TRIPLE, 0.6), [rise(0.7, 1.0), {"motion": "dwell", "in": 0.5}, rise(-1.7, 1.5)])
    motion = planar.cycle(mechanism, 60)
    assert motion.outcome is Outcome.SOLVED
    theta = motion.inputs["A"].position
    same_angles(motion.link("DC").angle, rocker(*TRIPLE, theta), 1e-11)
    dwell = (motion.time > 1.0) & (motion.time < 1.5)
    np.testing.assert_array_equal(motion.link("DC").angular_velocity[dwell], 0.0)


def test_rows_of_a_run_in_time_are_those_of_a_ranged_one_at_the_same_rates():
    """At one instant it does not matter why the input moves as it does."""
    mechanism = lawful(four_bar(*ROCKER, 0.8), [rise(3.0, 1.5)])
    motion = planar.cycle(mechanism, 12)
    for row in (3, 6, 11):
        given = motion.inputs["A"]
        drive = planar.model.mechanism.Drive("A", *(float(part[row]) for part in given))
        state = planar.solve(mechanism, [drive])
        for name, point in state.points.items():
            for found, wanted in zip(motion.point(name), point, strict=False):
                np.testing.assert_allclose(found[row], wanted, atol=1e-11)


# dead points


@pytest.mark.parametrize("steps", part([1, 3, 10, 77], 1, 2))
@pytest.mark.parametrize("rates", [(1.0, 0.0), (0.2, 0.3), (-1.0, -0.1)], ids=str)
def test_a_run_in_time_ends_when_it_comes_to_its_dead_point(rates, steps):
    """The last row is the dead point, at the time at which the input is there."""
    omega, alpha = rates
    mechanism = four_bar(*TRIPLE, 0.6, 1, omega, alpha)
    motion = planar.cycle(mechanism, steps, duration=5.0)
    gone = np.sign(omega) * TRIPLE_LIMIT - 0.6
    roots = np.roots([0.5 * alpha, omega, -gone]) if alpha else np.array([gone / omega])
    when = float(min(each for each in roots.real if each > 0))
    assert motion.outcome is Outcome.DEAD_POINT
    assert motion.time[-1] == pytest.approx(when, abs=1e-12)
    assert motion.inputs["A"].position[-1] == pytest.approx(np.sign(omega) * TRIPLE_LIMIT, abs=1e-13)
    grid = np.linspace(0.0, 5.0, steps + 1)
    np.testing.assert_allclose(motion.time[:-1], grid[grid < when], atol=1e-14)
    nan = np.isnan(motion.link("DC").angular_velocity)
    assert nan.tolist() == (len(nan) - 1) * [False] + [True]
    same_angles(motion.link("DC").angle[:-1], rocker(*TRIPLE, motion.inputs["A"].position[:-1]), 1e-11)
    same_angles(motion.link("DC").angle[-1:], rocker(*TRIPLE, motion.inputs["A"].position[-1:], 0), 1e-10)
    (dead,) = (each for each in motion.limits if each.kind == "input dead point")
    assert (dead.of, dead.input) == ("A", pytest.approx(when, abs=1e-12))
    assert dead.value == pytest.approx(np.sign(omega) * TRIPLE_LIMIT, abs=1e-13)
    assert passes_residual_check(mechanism, motion)


def test_a_run_that_turns_back_short_of_its_dead_point_goes_on():
    """v^2 / 2a = 0.7 from 0.6 leaves 0.02 to the limit, and then it goes back to the other one."""
    alpha = -1.0
    omega = float(np.sqrt(2.0 * (TRIPLE_LIMIT - 0.6 - 0.02)))
    motion = planar.cycle(four_bar(*TRIPLE, 0.6, 1, omega, alpha), 90, duration=3.0)
    assert motion.outcome is Outcome.SOLVED
    same_angles(motion.link("DC").angle, rocker(*TRIPLE, motion.inputs["A"].position), 1e-11)
    assert not [each for each in motion.limits if each.kind == "input dead point"]


def test_a_run_of_two_inputs_that_cannot_go_on_says_so_and_keeps_its_rows():
    """The two cranks turn apart until coupler and rod stretch: |BD| = 2.1."""
    mechanism = two_cranks([rise(2.6, 1.0, "harmonic")], [rise(-2.2, 1.0, "harmonic")])
    motion = planar.cycle(mechanism, 100)
    assert motion.outcome is Outcome.DEAD_POINT
    b, d = motion.point("B").position, motion.point("D").position
    apart = np.hypot(*(b - d).T)
    assert np.all(apart <= 2.1 + 1e-12)
    t = np.linspace(0, 1, 101)
    s = 0.5 * (1 - np.cos(np.pi * t))
    every = np.abs(1.2 + 0.6 * np.exp(1j * (1.9 - 2.2 * s)) - 0.5 * np.exp(1j * (0.8 + 2.6 * s)))
    reached = int(np.argmax(every > 2.1))
    assert len(motion) in (reached, reached + 1)
    np.testing.assert_allclose(apart[:reached], every[:reached], atol=1e-12)


# change points


@pytest.mark.parametrize("steps", [7, 20, 90])
def test_change_points_are_passed_in_time_and_told_with_their_times(steps):
    mechanism = four_bar(*PARALLELOGRAM, 0.3, 1, 1.0, 0.5)
    motion = planar.cycle(mechanism, steps, duration=4.0, jerk=True)
    assert motion.outcome is Outcome.SOLVED
    theta = 0.3 + motion.time + 0.25 * motion.time**2
    same_angles(motion.link("DC").angle, theta, 1e-12)
    np.testing.assert_allclose(motion.link("DC").angular_velocity, 1.0 + 0.5 * motion.time, atol=1e-9)
    np.testing.assert_allclose(motion.link("DC").angular_acceleration, 0.5, atol=1e-7)
    np.testing.assert_allclose(motion.angular_jerk("DC"), 0.0, atol=1e-4)
    # 0.3 + t + t^2 / 4 = pi, 2 pi
    wanted = [-2.0 + 2.0 * np.sqrt(1.0 + flat - 0.3) for flat in (np.pi, 2 * np.pi)]
    found = [each for each in motion.limits if each.kind == "change point"]
    assert [each.of for each in found] == ["A", "A"]
    np.testing.assert_allclose([each.input for each in found], wanted, atol=1e-12)


@pytest.mark.parametrize("branches", [(), (2,)])
@pytest.mark.parametrize("steps", [8, 9])
def test_a_law_that_carries_a_parallelogram_over_its_flat_position(steps, branches):
    """Eight steps hit it in the middle, at full speed and with a jerk of its own; nine do not."""
    mechanism = lawful(four_bar(*PARALLELOGRAM, np.pi / 2), [rise(float(np.pi), 2.0)])
    motion = planar.cycle(mechanism, steps, jerk=True, branches=branches)
    t = motion.time
    theta = motion.inputs["A"].position
    first = np.pi / 2 * (1 - np.cos(np.pi * t))
    np.testing.assert_allclose(motion.inputs["A"].velocity, first, atol=1e-13)
    over = bool(branches) & (theta > np.pi + 1e-9)
    phi, slope, _ = antiparallelogram(theta)
    same_angles(motion.link("DC").angle, np.where(over, phi, theta), 1e-11)
    np.testing.assert_allclose(motion.link("DC").angular_velocity, np.where(over, slope / 2.0, 1.0) * first, atol=1e-10)
    np.testing.assert_allclose(motion.angular_jerk("DC")[~over], (np.pi**3 / 2 * np.cos(np.pi * t))[~over], atol=1e-5)
    (found,) = (each for each in motion.limits if each.kind == "change point")
    assert found.input == pytest.approx(1.0, abs=1e-12)
    # where it goes over the output turns back at once: that is the branch's doing, and no stroke's end
    assert [each for each in motion.limits if each.kind == "stroke end"] == []


# ends of strokes


@pytest.mark.parametrize("steps", [9, 20, 100])
def test_ends_of_strokes_have_their_times(steps):
    """The block turns back where crank and rod are in line, and where the crank itself turns back."""
    r, rod, e = 0.48, 1.6, 0.1
    motion = planar.cycle(block_slider_crank(r, rod, e, 1.0), steps, duration=5.0)
    inner, outer = np.pi + np.arcsin(e / (rod - r)), 2 * np.pi + np.arcsin(e / (rod + r))
    assert outer > 1.0 + 9 / 2  # the crank turns back at 5.5, short of the outer one
    times = [3 - np.sqrt(9 - 2 * (inner - 1)), 3.0]
    found = [each for each in motion.limits if each.kind == "stroke end"]
    wanted = [*times, 3 + np.sqrt(9 - 2 * (inner - 1))]
    wanted = [each for each in wanted if each < 5.0]
    np.testing.assert_allclose([each.input for each in found], wanted, atol=1e-12)
    assert {each.of for each in found} == {"s"}
    assert found[0].value == pytest.approx(np.sqrt((rod - r) ** 2 - e**2), abs=1e-13)
    turn = 1.0 + 9 / 2
    assert found[1].value == pytest.approx(piston(turn, r, rod, e)[0], abs=1e-12)


# third rates of ranges


def test_third_rates_over_a_range_are_differences_at_order_two():
    """By the chain rule at a constant angular velocity: the rows as instants h / omega apart."""
    value = files.to_dict(four_bar(*ROCKER, 0.8))
    value["inputs"][0] |= {"velocity": 2.0, "acceleration": 0.0}
    runs = [planar.cycle(files.from_dict(value), steps, jerk=True) for steps in (180, 360)]
    for order, (coarse, fine) in enumerate(
        observed(runs, lambda run: 2 * np.pi / (len(run) - 1) / 2.0, lambda run: np.ones(len(run), dtype=bool))
    ):
        assert 1.9 < np.log2(coarse / fine) < 2.1, order


def test_third_rates_of_a_slider_crank_are_those_of_its_closed_form():
    """x = r cos(theta) + sqrt(l^2 - (r sin(theta) - e)^2); its third rate by a complex step of the second."""
    r, rod, e = 0.48, 1.6, 0.1
    motion = planar.cycle(block_slider_crank(), 36, jerk=True)

    def second(t):
        # theta = theta0 + 3 t - t^2 / 2, at every row from its own theta0
        theta, omega = theta0 + 3 * t - t * t / 2, 3 - t
        g = r * np.sin(theta) - e
        root = np.sqrt(rod**2 - g**2)
        dx = -r * np.sin(theta) - g * r * np.cos(theta) / root
        ddx = (
            -r * np.cos(theta)
            - (r * r * np.cos(theta) ** 2 - g * r * np.sin(theta)) / root
            - (g * r * np.cos(theta)) ** 2 / root**3
        )
        return omega**2 * ddx - dx

    theta0 = motion.inputs["O"].position
    np.testing.assert_allclose(motion.jerk("B")[:, 0], np.imag(second(1e-30j)) / 1e-30, atol=1e-10)
    np.testing.assert_allclose(motion.jerk("B")[:, 1], 0.0, atol=1e-12)
    crank = np.exp(1j * theta0)
    # third derivative of r exp(i theta): r (i a''' - 3 w a - i w^3) exp(i theta) with no third rate of the input
    third = r * (-3 * 3.0 * -1.0 - 1j * 27.0) * crank
    np.testing.assert_allclose(motion.jerk("A") @ [1, 1j], third, atol=1e-12)


@pytest.mark.parametrize("steps", part([3, 7, 50, 51], 1, 1))
def test_a_change_point_that_is_passed_to_and_fro_has_both_its_times(steps):
    """By symmetry of a cycloidal rise of 240 deg from 60 deg the flat position at 180 deg is passed half-way."""
    law = [rise(4 * np.pi / 3, 1.0), {"motion": "dwell", "in": 0.5}, rise(-4 * np.pi / 3, 1.0, "3-4-5")]
    motion = planar.cycle(lawful(four_bar(*PARALLELOGRAM, np.pi / 3), law), steps)
    times = [limit.input for limit in motion.limits if limit.kind == "change point"]
    np.testing.assert_allclose(times, [0.5, 2.0], atol=1e-9)
    np.testing.assert_allclose(np.sin(motion.link("BC").angle), 0.0, atol=1e-12)


def test_a_rest_and_a_return_on_a_change_point_keep_to_the_branch():
    law = [rise(2 * np.pi / 3, 1.0), {"motion": "dwell", "in": 0.5}, rise(-2 * np.pi / 3, 1.0)]
    motion = planar.cycle(lawful(four_bar(*PARALLELOGRAM, np.pi / 3), law), 50)
    assert motion.outcome is Outcome.SOLVED
    np.testing.assert_allclose(np.sin(motion.link("BC").angle), 0.0, atol=1e-12)
    assert motion.link("DC").angle[-1] == pytest.approx(np.pi / 3, abs=1e-12)
