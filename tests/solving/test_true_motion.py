"""Runs of whole linkages: six-bars that must turn back, and linkages drawn at random."""

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

import planar
from planar.document import files
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.model.pairs import MeasureKind
from planar.solving.position import PositionSolver
from tests.builders import bar_document
from tests.checks import passes_residual_check
from tests.closed_forms import TURN, rocker
from tests.draws import draws, part
from tests.linkages import conditioning, random_linkage, seeds, shares

few = settings(
    max_examples=draws(6), deadline=None, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow]
)
sizes = st.integers(3, 8)

# a six-bar whose second loop sets the limit

FIRST = (0.3, 0.9, 0.7, 1.0)
"""A crank-rocker: its crank turns round."""


def watt(reach, side=1):
    """Watt's six-bar: on the rocker DC stands D-F, and F drives a second four-bar F-H, G-H with sum of lengths reach.

    The crank turns round by itself, but the second dyad must close on F and G.
    """
    a, b, c, d = FIRST
    theta = 0.8
    phi = float(rocker(*FIRST, theta))
    f = d + 0.6 * np.exp(1j * (phi - 0.9))
    g = 1.9 + 0.1j
    # H over the middle of F and G, on one side
    middle, half = 0.5 * (f + g), 0.5 * (g - f)
    high = np.sqrt((0.5 * reach) ** 2 - abs(half) ** 2)
    h = middle + side * 1j * half / abs(half) * high
    arm = {"F": [0.6 * np.cos(0.9), -0.6 * np.sin(0.9)]}
    bars = {"AB": ("A", "B", a), "BC": ("B", "C", b), "DC": ("D", "C", c, arm)}
    bars |= {"FH": ("F", "H", 0.5 * reach), "GH": ("G", "H", 0.5 * reach)}
    c_at = d + c * np.exp(1j * phi)
    sketch = {"C": [c_at.real, c_at.imag], "H": [h.real, h.imag]}
    frame = {"A": [0, 0], "D": [d, 0], "G": [g.real, g.imag]}
    return files.from_dict(bar_document(frame, bars, ("A", theta), sketch=sketch))


def apart(theta):
    """The distance FG at an angle of the crank."""
    return np.abs(1.0 + 0.6 * np.exp(1j * (rocker(*FIRST, theta) - 0.9)) - (1.9 + 0.1j))


def true_limits(reach, theta=0.8):
    """The crank's interval about theta within which the second dyad closes: by a scan, and bisection."""
    grid = theta + np.linspace(0.0, TURN, 20001)
    up = grid[int(np.argmax(apart(grid) > reach))]
    down = theta - (grid[int(np.argmax(apart(2 * theta - grid) > reach))] - theta)
    ends = []
    for inner, outer in ((down + TURN / 20000, down), (up - TURN / 20000, up)):
        inside, outside = inner, outer
        for _ in range(100):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if apart(middle) < reach else (inside, middle)
        ends.append(inside)
    return ends


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("share", part([0.4, 0.8, 0.95, 0.999], 1, 2))
def test_a_six_bar_turns_back_where_its_second_loop_can_reach_no_further(share, side):
    """Its crank could turn round; the dyad on the rocker, which reaches a part of the way, cannot follow."""
    grid = np.linspace(0.0, TURN, 2001)
    least, most = apart(grid).min(), apart(grid).max()
    reach = max(least + share * (most - least), apart(0.8) * 1.001)
    mechanism = watt(reach, side)
    motion = planar.cycle(mechanism, 30)
    assert motion.outcome is Outcome.SOLVED
    wanted = true_limits(reach)
    np.testing.assert_allclose(motion.inputs["A"].position[[0, -1]], wanted, atol=1e-11)
    dead = [each for each in motion.limits if each.kind == "input dead point"]
    np.testing.assert_allclose([each.input for each in dead], wanted, atol=1e-11)
    # at both ends the second dyad is stretched, and the first loop is nowhere near
    np.testing.assert_allclose(np.hypot(*(motion.point("F").position - motion.point("G").position)[[0, -1]].T), reach)
    assert passes_residual_check(mechanism, motion)
    # the whole circuit goes through both, with H on the other side of FG in between
    circuit = planar.cycle(mechanism, 30, circuit=True)
    h, f, g = (circuit.point(name).position @ [1, 1j] for name in "HFG")
    sides = np.sign(((h - f) / (g - f)).imag)
    inner = np.isfinite(circuit.link("GH").angular_velocity)
    assert set(sides[inner]) == {1.0, -1.0}
    for name in circuit.point_names:
        place = circuit.point(name).position
        np.testing.assert_allclose(place[-1], place[0], atol=1e-9)


def test_a_six_bar_whose_second_loop_reaches_turns_round():
    motion = planar.cycle(watt(apart(np.linspace(0.0, TURN, 2001)).max() * 1.01), 30)
    assert np.ptp(motion.inputs["A"].position) == pytest.approx(TURN, abs=1e-12)
    assert not [each for each in motion.limits if each.kind != "stroke end"]


# linkages drawn at random


def drawn(seed, links, higher):
    """A random linkage that moves, its first input, and a short way of it."""
    built = random_linkage(seed, links, 0.0, higher)
    mechanism = files.from_dict(built.value)
    try:
        solver = PositionSolver(mechanism)
        found = solver.find_assembly()
        solver.state(found.z)
    except NoAnswer:
        assume(False)
        raise
    assume(conditioning(solver, found.z) > 0.02)
    return mechanism, mechanism.inputs[0].pair, mechanism.inputs[0].position


def ranged(mechanism, pair, steps, start, stop, **more):
    """A run, which may end before."""
    try:
        return planar.cycle(mechanism, steps, start, stop, pair=pair, **more)
    except NoAnswer as problem:
        assert problem.outcome in (Outcome.BRANCH_LOST, Outcome.DEAD_POINT)
        assume(False)
        raise


def frames(motion, order=0):
    """Places and angles of all links (n, 3 links), or their rates."""
    columns = []
    for link in motion.mechanism.links:
        frame = motion.frames[link.name]
        if not frame.fixed:
            columns += [
                np.broadcast_to(getattr(frame, part).parts[order], (len(motion),)) for part in ("x", "y", "angle")
            ]
    return np.stack(columns, axis=1)


def same_place(one, other, far):
    """Whether rows of links stand alike, whole turns aside."""
    gap = one - other
    gap[..., 2::3] = np.angle(np.exp(1j * gap[..., 2::3]))
    return np.abs(gap).max(initial=0.0) < far


@few
@given(seeds, sizes, shares)
def test_every_row_passes_the_gate_and_no_row_jumps(seed, links, higher):
    """From row to row a link moves as its velocities there say, to what their difference leaves open."""
    mechanism, pair, here = drawn(seed, links, higher)
    steps = 60
    motion = ranged(mechanism, pair, steps, here, here + 0.6)
    assert passes_residual_check(mechanism, motion)
    speed = next(each.velocity for each in mechanism.inputs if each.pair == pair)
    rows = np.flatnonzero(np.isfinite(frames(motion, 1)).all(axis=1))
    rows = rows[np.isin(rows + 1, rows)]
    assume(len(rows) > 4)
    place, rate, second = (frames(motion, order) for order in range(3))
    h = np.diff(motion.inputs[pair].position)[rows, None] / speed
    # the second rate without that of the input, as the rows are instants of a run at constant speed only for it
    given_rate = next(each.acceleration for each in mechanism.inputs if each.pair == pair)
    second = second - rate * given_rate / speed
    move = place[rows + 1] - place[rows]
    # Hermite: of fourth order in the step, so the odd large gap would be a jump
    told = 0.5 * h * (rate[rows] + rate[rows + 1]) + h**2 / 12 * (second[rows] - second[rows + 1])
    room = np.abs(h**2 / 6 * (second[rows + 1] - second[rows])) + 0.02 * np.abs(h * rate[rows]).max(
        axis=1, keepdims=True
    )
    near = np.abs(h * (rate[rows + 1] - rate[rows])).max(axis=1) > 0.3 * np.abs(h * rate[rows]).max(axis=1)
    assert np.all(np.abs(move - told)[~near] <= room[~near] + 1e-9)


@few
@given(seeds, sizes, shares)
def test_a_finer_grid_goes_the_same_way(seed, links, higher):
    mechanism, pair, here = drawn(seed, links, higher)
    coarse, fine = (ranged(mechanism, pair, steps, here, here + 1.2) for steps in (6, 90))
    assert coarse.outcome is fine.outcome
    stop = coarse.inputs[pair].position[-1]
    assert fine.inputs[pair].position[-1] == pytest.approx(stop, abs=1e-9)
    shared = [
        k for k, u in enumerate(coarse.inputs[pair].position) if np.abs(fine.inputs[pair].position - u).min() < 1e-12
    ]
    rows = [int(np.argmin(np.abs(fine.inputs[pair].position - coarse.inputs[pair].position[k]))) for k in shared]
    # beside a dead point places are known to the root of rounding
    assert same_place(frames(coarse)[shared], frames(fine)[rows], 1e-6)


@few
@given(seeds, sizes, shares)
def test_third_rates_are_the_derivatives_at_order_two(seed, links, higher):
    """In a short run in time, from the file's own position."""
    mechanism, _, _ = drawn(seed, links, higher)
    base = planar.cycle(mechanism, 1, duration=1e-9, jerk=True)
    names = [link.name for link in mechanism.links if link.name != mechanism.frame]
    jerk = max(np.abs(base.angular_jerk(name)).max() for name in names)
    rates = [np.abs(frames(base, order)).max() for order in (1, 2)]
    span = 8e-3 / (1.0 + rates[0] + rates[1] ** (1 / 2) + jerk ** (1 / 3))
    gaps = []
    for steps in (2, 4):
        motion = planar.cycle(mechanism, steps, duration=2 * span / (steps // 2), jerk=True)
        assume(motion.outcome is Outcome.SOLVED)
        h = motion.time[1]
        worst = 0.0
        for name in names:
            alpha = motion.link(name).angular_acceleration
            worst = max(worst, abs((alpha[2] - alpha[0]) / (2 * h) - motion.angular_jerk(name)[1]))
        for name in motion.point_names:
            a = motion.point(name).acceleration
            worst = max(worst, np.abs((a[2] - a[0]) / (2 * h) - motion.jerk(name)[1]).max())
        gaps.append(worst)
    rounding = 1e-10 * (1.0 + rates[1]) / span
    assert gaps[1] < rounding or 3.6 < np.log2(gaps[0] / gaps[1]) < 4.4  # steps of a quarter


@example(8205, 7)  # starts beside a dead point
@few
@given(seeds, sizes)
def test_a_circuit_comes_back_to_its_start_or_says_why_not(seed, links):
    mechanism, pair, _ = drawn(seed, links, 0.0)
    try:
        motion = planar.cycle(mechanism, 12, pair=pair, circuit=True)
    except NoAnswer as problem:
        assert problem.outcome is Outcome.BRANCH_LOST
        told = ("name where the range starts", "cannot be told", "slide out without an end")
        assert any(each in problem.reason for each in told)
        return
    assert motion.outcome is Outcome.SOLVED
    assert passes_residual_check(mechanism, motion)
    place = frames(motion)
    assert same_place(place[-1:], place[:1], 1e-8)
    # at dead points, and only there, no velocity is determined; they are what the limits say
    nan = np.flatnonzero(np.isnan(frames(motion, 1)).any(axis=1))
    told = [each.input for each in motion.limits if each.kind == "input dead point"]
    np.testing.assert_allclose(np.sort(motion.inputs[pair].position[nan]), np.sort(told), atol=1e-8)
    # the input turns back there, and its rate with it
    senses = np.sign(np.diff(motion.inputs[pair].position))
    assert np.sum(np.diff(senses) != 0) == len(nan)


@few
@given(seeds, sizes)
def test_the_limits_of_a_range_are_its_ends(seed, links):
    mechanism, pair, here = drawn(seed, links, 0.0)
    try:
        motion = planar.cycle(mechanism, 8, pair=pair)
    except BadInput as problem:
        assert "goes on without a limit" in problem.sentence
        return
    ends = motion.inputs[pair].position[[0, -1]]
    dead = [each.input for each in motion.limits if each.kind == "input dead point"]
    assert motion.outcome in (Outcome.SOLVED, Outcome.BRANCH_LOST)
    if motion.outcome is Outcome.SOLVED and not (
        not motion.has_length_motion(pair) and np.ptp(ends) == pytest.approx(TURN)
    ):
        np.testing.assert_allclose(dead, ends, atol=1e-9)
        assert ends[0] - 1e-9 <= here <= ends[1] + 1e-9
        # just beyond either the assembly cannot follow
        for end, beyond in zip(ends, (-1e-4, 1e-4), strict=True):
            past = planar.cycle(mechanism, 2, here, end + beyond, pair=pair)
            assert past.outcome is Outcome.DEAD_POINT
            assert past.inputs[pair].position[-1] == pytest.approx(end, abs=1e-9)
    else:
        assert dead == [] or motion.outcome is Outcome.BRANCH_LOST
    assert all(ends[0] - 1e-9 <= each.input <= ends[1] + 1e-9 for each in motion.limits)


@few
@given(seeds, sizes)
def test_at_the_end_of_a_stroke_the_output_rests_and_is_farthest(seed, links):
    mechanism, pair, here = drawn(seed, links, 0.0)
    motion = ranged(mechanism, pair, 9, here, here + 0.8)
    for each in motion.limits:
        if each.kind != "stroke end":
            continue
        values = []
        kind = planar.model.mechanism.relative_motions(mechanism)[each.of].input_kind
        for u in (each.input - 1e-4, each.input, each.input + 1e-4):
            if not here <= u <= motion.inputs[pair].position[-1]:
                break
            row = planar.cycle(mechanism, 1, here, u, pair=pair)
            report = row.pair(each.of)
            values.append([report["displacement" if kind is MeasureKind.LENGTH else "relative_angle"][-1]])
            rate = report["velocity" if kind is MeasureKind.LENGTH else "relative_angular_velocity"][-1]
            if u == each.input:
                assert abs(rate) < 1e-8 * (1.0 + np.nanmax(np.abs(frames(row, 1))))
        else:
            before, at, after = (
                np.unwrap(np.array(values)[:, 0]) if kind is not MeasureKind.LENGTH else np.array(values)[:, 0]
            )
            assert (at - before) * (after - at) <= 1e-12
