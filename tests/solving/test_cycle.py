"""Runs of positions against closed forms, row by row, and where they end."""

import copy
import json

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.solving import samples
from planar.solving.continuation import fast_path
from planar.solving.position import PositionSolver
from tests.builders import block_slider_crank, four_bar
from tests.checks import accept_steps, passes_residual_check, same_angles
from tests.closed_forms import PARALLELOGRAM, ROCKER, TRIPLE, TURN, between, coupler, rates, rocker
from tests.command import run
from tests.draws import part

# closed forms all along


@pytest.mark.parametrize("closed", [1, -1])
def test_a_crank_rocker_at_every_row(closed):
    a, b, c, _ = ROCKER
    mechanism = four_bar(*ROCKER, 0.8, closed)
    motion = planar.cycle(mechanism)
    theta = 0.8 + np.linspace(0, TURN, 361)
    assert len(motion) == 361
    assert (motion.outcome, motion.reason) == (Outcome.SOLVED, "")
    np.testing.assert_allclose(motion.inputs["A"].position, theta, atol=1e-14)
    np.testing.assert_array_equal(motion.inputs["A"].velocity, 2.0)
    np.testing.assert_array_equal(motion.inputs["A"].acceleration, 1.0)
    phi = rocker(*ROCKER, theta, closed)
    beta = coupler(*ROCKER, theta, phi)
    beta1, phi1, beta2, phi2 = rates(a, b, c, theta, beta, phi, 2.0, 1.0)
    for name, angle, first, second in (("BC", beta, beta1, beta2), ("DC", phi, phi1, phi2)):
        link = motion.link(name)
        same_angles(link.angle, angle, 1e-13)
        np.testing.assert_allclose(link.angular_velocity, first, atol=1e-12)
        np.testing.assert_allclose(link.angular_acceleration, second, atol=1e-11)
    e = a * np.exp(1j * theta) + 0.4 * b * np.exp(1j * beta)
    e1 = 2j * a * np.exp(1j * theta) + 0.4j * b * beta1 * np.exp(1j * beta)
    e2 = a * (1j - 4) * np.exp(1j * theta) + 0.4 * b * (1j * beta2 - beta1**2) * np.exp(1j * beta)
    for found, wanted in zip(motion.point("E"), (e, e1, e2), strict=True):
        np.testing.assert_allclose(found @ [1, 1j], wanted, atol=1e-11)
    assert motion.residual < 1e-14
    assert passes_residual_check(mechanism, motion)


def test_an_offset_slider_crank_at_every_row():
    r, rod, e = 0.48, 1.6, 0.1
    motion = planar.cycle(block_slider_crank())
    t = 1.0 + np.linspace(0, TURN, 361)
    s, c = np.sin(t), np.cos(t)
    g = r * s - e
    root = np.sqrt(rod**2 - g**2)
    dx = -r * s - g * r * c / root
    ddx = -r * c - (r * r * c * c - g * r * s) / root - (g * r * c) ** 2 / root**3
    slide = motion.pair("s")
    np.testing.assert_allclose(slide["displacement"], r * c + root, atol=1e-14)
    np.testing.assert_allclose(slide["velocity"], 3 * dx, atol=1e-13)
    np.testing.assert_allclose(slide["acceleration"], 9 * ddx - dx, atol=1e-12)
    np.testing.assert_allclose(motion.point("B").position[:, 1], e, atol=1e-14)
    assert motion.has_length_motion("s")
    assert not motion.has_length_motion("O")


def test_a_trammels_slide_runs_from_limit_to_limit():
    """P at x = L cos(phi), so that phi' = -v / (L sin(phi)) and phi'' = -phi'^2 cot(phi) - a / (L sin(phi))."""
    bar, v, a = 0.12, 0.2, 0.1
    links = {"f": {"points": {"O": [0, 0]}}, "bar": {"ends": ["Q", "P"], "length": bar}}
    pairs = [
        {"sliding": "x", "on": "f", "block": "P", "line": {"through": "O"}},
        {"sliding": "y", "on": "f", "block": "Q", "line": {"through": "O", "angle": np.pi / 2}},
    ]
    inputs = [{"pair": "x", "position": 0.08, "velocity": v, "acceleration": a}]
    mechanism = files.from_dict(
        {"planar": 1, "frame": "f", "links": links, "pairs": pairs, "inputs": inputs, "sketch": {"Q": [0, 0.09]}}
    )
    motion = planar.cycle(mechanism, 200)
    x = motion.inputs["x"].position
    assert len(motion) == 201
    assert motion.outcome is Outcome.SOLVED
    np.testing.assert_allclose(x[[0, -1]], [-bar, bar], rtol=1e-14)
    np.testing.assert_allclose(np.diff(x), (x[-1] - x[0]) / 200, rtol=1e-9)
    assert "-0.12 m" in motion.reason
    assert " 0.12 m" in motion.reason
    # the bar's own angle falls below the x-axis by as much as Q stands above it
    y = np.sqrt((bar - x) * (bar + x))
    np.testing.assert_allclose(motion.pair("y")["displacement"][1:-1], y[1:-1], atol=1e-13)
    angle = -np.arctan2(y, x)
    same_angles(motion.link("bar").angle[1:-1], angle[1:-1], 1e-12)
    inner = angle[1:-1]  # at the limits no velocity goes with one of the slide
    first = -v / (bar * np.sin(inner))
    second = -(first**2) / np.tan(inner) - a / (bar * np.sin(inner))
    link = motion.link("bar")
    np.testing.assert_allclose(link.angular_velocity[1:-1], first, rtol=1e-11)
    np.testing.assert_allclose(link.angular_acceleration[1:-1], second, rtol=1e-10, atol=1e-10)
    for values in (link.angular_velocity, link.angular_acceleration, *motion.point("Q")[1:]):
        assert np.isnan(values[[0, -1]]).all()
        assert np.isfinite(values[1:-1]).all()
    assert np.isfinite(link.angle).all()
    assert passes_residual_check(mechanism, motion)


@pytest.mark.parametrize("closed", [1, -1])
def test_a_rockers_range_ends_where_coupler_and_follower_stretch(closed):
    a, b, c, d = TRIPLE
    mechanism = four_bar(*TRIPLE, 0.6, closed)
    motion = planar.cycle(mechanism, 120)
    theta = motion.inputs["A"].position
    limit = between(a, d, b + c)
    np.testing.assert_allclose(theta[[0, -1]], [-limit, limit], atol=1e-13)
    np.testing.assert_allclose(np.diff(theta), (theta[-1] - theta[0]) / 120, rtol=1e-9)
    assert motion.outcome is Outcome.SOLVED
    assert f"A = {-limit:.6g} rad" in motion.reason
    assert f"A = {limit:.6g} rad" in motion.reason
    phi = rocker(*TRIPLE, theta, closed)
    same_angles(motion.link("DC").angle[1:-1], phi[1:-1], 1e-12)
    # beside the limit the follower's angle goes with the root of the distance, known to 1e-16 or so
    same_angles(motion.link("DC").angle, phi, 1e-7)
    beta = coupler(*TRIPLE, theta, phi)
    with np.errstate(divide="ignore", invalid="ignore"):
        beta1, phi1, beta2, phi2 = rates(a, b, c, theta, beta, phi, 2.0, 1.0)
    inside = slice(1, -1)
    for name, first, second in (("BC", beta1, beta2), ("DC", phi1, phi2)):
        link = motion.link(name)
        np.testing.assert_allclose(link.angular_velocity[inside], first[inside], rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(link.angular_acceleration[inside], second[inside], rtol=1e-9, atol=1e-9)
        for values in (link.angular_velocity, link.angular_acceleration):
            np.testing.assert_array_equal(np.isnan(values), [True] + 119 * [False] + [True])
    for values in motion.point("C")[1:]:
        assert np.isnan(values[[0, -1]]).all()
    assert passes_residual_check(mechanism, motion)


# single rows


@pytest.mark.parametrize("row", [0, 1, 7, 13, 24])
def test_a_row_is_what_solve_says_of_that_position(row):
    mechanism = four_bar(*ROCKER, 0.8)
    motion = planar.cycle(mechanism, 24)
    state = planar.solve(mechanism, {"A": float(motion.inputs["A"].position[row])})
    for name, point in state.points.items():
        for found, wanted in zip(motion.point(name), point, strict=False):
            np.testing.assert_allclose(found[row], wanted, atol=1e-12)
    for name, link in state.links.items():
        same_angles(motion.link(name).angle[row], link.angle, 1e-13)
        np.testing.assert_allclose([values[row] for values in motion.link(name)[1:]], link[1:3], atol=1e-12)
    for name, report in state.pairs.items():
        for what, value in report.items():
            found = motion.pair(name)[what]
            if value is None or what == "relative_angle":
                assert (found is None) == (value is None)
            else:
                assert found[row] == pytest.approx(value, abs=1e-12)


@pytest.mark.parametrize(
    ("start", "stop", "steps"), [(0.3, 1.7, 7), (1.7, 0.3, 7), (-2.0, 9.0, 50), (0.8, 0.8, 1), (5.0, 5.5, 1)]
)
def test_a_range_of_its_own(start, stop, steps):
    motion = planar.cycle(four_bar(*ROCKER, 0.8), steps, start, stop)
    theta = motion.inputs["A"].position
    np.testing.assert_allclose(theta, np.linspace(start, stop, steps + 1), atol=1e-14)
    same_angles(motion.link("DC").angle, rocker(*ROCKER, theta), 1e-12)


def test_only_the_start_or_the_stop_of_a_turning_range():
    mechanism = four_bar(*ROCKER, 0.8)
    from_start, to_stop = planar.cycle(mechanism, 10, start=2.0), planar.cycle(mechanism, 10, stop=2.0)
    np.testing.assert_allclose(from_start.inputs["A"].position, 2.0 + np.linspace(0, TURN, 11), atol=1e-14)
    np.testing.assert_allclose(to_stop.inputs["A"].position, np.linspace(0.8, 2.0, 11), atol=1e-14)
    for motion in (from_start, to_stop):
        same_angles(motion.link("DC").angle, rocker(*ROCKER, motion.inputs["A"].position), 1e-12)


def test_a_slides_range_from_a_start_ends_at_its_limit():
    mechanism = planar.load("elliptical-trammel")
    motion = planar.cycle(mechanism, 10, start=0.05)
    np.testing.assert_allclose(motion.inputs["across"].position, np.linspace(0.05, 0.12, 11), atol=1e-6)
    short = planar.cycle(mechanism, 10, start=0.05, stop=-0.03)
    np.testing.assert_allclose(short.inputs["across"].position, np.linspace(0.05, -0.03, 11), atol=1e-15)
    assert np.isfinite(short.link("bar").angular_velocity).all()


def test_the_scissor_lifts_foot_runs_its_whole_way():
    """Through the middle, where all bars stand upright and each stage could swing by itself: h = 3 sqrt(l^2 - x^2)."""
    motion = planar.cycle(planar.load("scissor-lift"), 40)
    foot = motion.inputs["foot"].position
    np.testing.assert_allclose(foot[[0, 20, -1]], [-0.6, 0.0, 0.6], atol=1e-9)
    inner, height = slice(1, -1), 3 * np.sqrt(0.36 - foot[1:-1] ** 2)
    np.testing.assert_allclose(motion.point("L3").position[inner, 1], height, atol=1e-12)
    np.testing.assert_allclose(motion.point("L3").velocity[inner, 1], 0.9 * foot[inner] / height, atol=1e-10)


def test_of_several_inputs_one_runs_and_the_others_stand_still():
    """Willis: (w_a - w_arm) / (w_b - w_arm) is the ratio with the arm held; the file's one still, the other runs."""
    mechanism = planar.load("planetary-differential")
    sun, ring = (given.pair for given in mechanism.inputs)
    with pytest.raises(BadInput, match="name the one that runs") as refused:
        planar.cycle(mechanism)
    assert sun in str(refused.value)
    assert ring in str(refused.value)
    whole = planar.solve(mechanism)
    motions = [planar.cycle(mechanism, 8, pair=pair) for pair in (sun, ring)]
    for motion, runs, stands in zip(motions, (sun, ring), (ring, sun), strict=True):
        given = whole.inputs
        np.testing.assert_allclose(np.ptp(motion.inputs[runs].position), TURN)
        np.testing.assert_array_equal(motion.inputs[stands].position, given[stands].position)
        np.testing.assert_array_equal(motion.inputs[stands].velocity, 0.0)
        np.testing.assert_array_equal(motion.inputs[stands].acceleration, 0.0)
        np.testing.assert_array_equal(motion.inputs[runs].velocity, given[runs].velocity)
    # velocities of a train are linear in those of its inputs: the two runs add up to the whole
    for name, link in whole.links.items():
        parts = [motion.link(name) for motion in motions]
        assert sum(part.angular_velocity[3] for part in parts) == pytest.approx(link.angular_velocity, abs=1e-10)
        assert sum(part.angular_acceleration[3] for part in parts) == pytest.approx(
            link.angular_acceleration, abs=1e-10
        )


# what cannot be run


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"steps": 0}, "steps: a whole number of steps from 1 to"),
        ({"steps": -3}, "steps: "),
        ({"steps": 2.0}, "steps: "),
        ({"steps": True}, "steps: "),
        ({"steps": 10**7}, "steps: .*1000000"),
        ({"start": np.nan}, r"start: a number up to 1e\+12"),
        ({"stop": np.inf}, r"stop: a number up to 1e\+12"),
        ({"pair": "B"}, "there is no input at 'B'; inputs are at A"),
    ],
)
def test_bad_arguments_are_named(given, words):
    with pytest.raises(BadInput, match=words):
        planar.cycle(four_bar(*ROCKER, 0.8), **given)


def test_without_an_input_nothing_runs():
    value = files.to_dict(four_bar(*ROCKER, 0.8)) | {"inputs": []}
    with pytest.raises(NoAnswer, match="with 0 inputs links 'AB', 'BC' and 'DC' can still move"):
        planar.cycle(files.from_dict(value))


def test_a_slide_without_a_limit_is_refused_unless_its_range_is_named():
    mechanism = planar.load("rolling-wheel")
    (given,) = mechanism.inputs
    with pytest.raises(BadInput, match=r"the slide goes on without a limit; name where the range starts and stops"):
        planar.cycle(mechanism)
    motion = planar.cycle(mechanism, 9, 0.0, 3.0)
    np.testing.assert_allclose(motion.inputs[given.pair].position, np.linspace(0, 3, 10), atol=1e-15)


def test_a_mechanism_that_has_no_position_has_no_run():
    value = files.to_dict(four_bar(*ROCKER, 0.8))
    value["links"]["BC"]["length"] = 9.0
    with pytest.raises(NoAnswer) as refused:
        planar.cycle(files.from_dict(value))
    assert refused.value.outcome is Outcome.CANNOT_BE_ASSEMBLED


def test_a_start_beyond_the_limit_is_refused_with_the_limit():
    limit = between(0.9, 1.5, 1.55)
    with pytest.raises(NoAnswer) as refused:
        planar.cycle(four_bar(*TRIPLE, 0.6), start=2.0)
    assert refused.value.outcome is Outcome.DEAD_POINT
    assert f"A = {limit:.6g} rad" in refused.value.reason


# where runs end, and that they never jump


@pytest.mark.parametrize("steps", part([1, 2, 7, 37, 360], 1))
@pytest.mark.parametrize("stop", [1.4, 2.5, 5.0])
def test_a_run_past_a_limit_stops_there_and_keeps_its_rows(steps, stop):
    limit = between(0.9, 1.5, 1.55)
    mechanism = four_bar(*TRIPLE, 0.6)
    motion = planar.cycle(mechanism, steps, 0.6, stop)
    wanted = np.linspace(0.6, stop, steps + 1)
    assert motion.outcome is Outcome.DEAD_POINT
    assert f"A = {limit:.6g} rad" in motion.reason
    # every sample before the limit, then the limit, where no velocity goes with one of the input
    theta = motion.inputs["A"].position
    np.testing.assert_allclose(theta[:-1], wanted[wanted < limit], atol=1e-14)
    assert theta[-1] == pytest.approx(limit, abs=1e-13)
    assert np.isnan(motion.point("C").velocity[-1]).all()
    assert not np.isnan(motion.point("C").velocity[:-1]).any()
    same_angles(motion.link("DC").angle[:-1], rocker(*TRIPLE, theta[:-1]), 1e-12)
    # at the limit itself B, C and D lie in line
    same_angles(motion.link("DC").angle[-1:], rocker(*TRIPLE, theta[-1:], 0), 1e-12)
    assert passes_residual_check(mechanism, motion)


@pytest.mark.parametrize("steps", part([1, 2, 3, 10, 45, 360, 361], 1, 2))
@pytest.mark.parametrize("start", part([0.0, 0.3, 1.0, 2.9, np.pi], 1))
def test_a_parallelogram_stays_one_through_its_flat_positions(start, steps):
    """Its bars go on parallel, never crossed, whichever grid hits the flat positions or steps over them."""
    mechanism = four_bar(*PARALLELOGRAM, 0.3, 1)
    motion = planar.cycle(mechanism, steps, start, start + TURN)
    theta = motion.inputs["A"].position
    assert motion.outcome is Outcome.SOLVED
    np.testing.assert_allclose(theta, start + np.linspace(0, TURN, steps + 1), atol=1e-14)
    same_angles(motion.link("BC").angle, 0.0 * theta, 1e-12)
    same_angles(motion.link("DC").angle, theta, 1e-12)
    for name, rate in (("BC", 0.0), ("DC", 1.0)):
        np.testing.assert_allclose(motion.link(name).angular_velocity, 2.0 * rate, atol=1e-10)
        np.testing.assert_allclose(motion.link(name).angular_acceleration, rate, atol=1e-9)
    assert passes_residual_check(mechanism, motion)
    assert any("2 branches of the motion cross; this one goes on smoothly" in each for each in motion.remarks)


@pytest.mark.parametrize(
    ("start", "steps"),
    part([(20, 36), (20, 90), (20.25, 360), (20.7, 90), (21.5, 90), (33, 90), (57.75, 90), (70.1, 7)], 1, 1),
)
def test_a_slider_crank_of_equal_lengths_goes_on_where_it_could_change_over(start, steps):
    """Its slide goes on through the crank's centre; at 90 deg the rod could as well turn with the crank there."""
    mechanism = block_slider_crank(0.05, 0.05, 0.0, np.radians(start))
    motion = planar.cycle(mechanism, steps, np.radians(start), np.radians(start + 180))
    theta = motion.inputs["O"].position
    assert motion.outcome is Outcome.SOLVED
    assert theta[-1] == pytest.approx(np.radians(start + 180), abs=1e-13)
    slide = motion.pair("s")
    np.testing.assert_allclose(motion.point("B").position[:, 0], 0.1 * np.cos(theta), atol=1e-12)
    np.testing.assert_allclose(slide["velocity"], -0.3 * np.sin(theta), atol=1e-10)
    np.testing.assert_allclose(slide["acceleration"], -0.9 * np.cos(theta) + 0.1 * np.sin(theta), atol=1e-9)
    assert passes_residual_check(mechanism, motion)


def limited(rng):
    """A random four-bar, a limit of its crank, the way inwards, and how wide the range is."""
    while True:
        a, b, c, d = rng.uniform(0.3, 2.0, 4)
        outer, inner = ((a * a + d * d - far**2) / (2 * a * d) for far in (b + c, b - c))
        if abs(outer) < 0.95:
            high = np.arccos(outer)
            low = np.arccos(inner) if abs(inner) < 1.0 else -high
            if inner > -1.0 and high - low > 0.6:
                return (a, b, c, d), (high, -1.0) if rng.random() < 0.5 else (low, 1.0), high - low


@pytest.mark.parametrize("seed", part(range(60), 5))
def test_a_run_that_starts_beside_a_limit_stays_on_its_branch(seed):
    """Two branches lead inwards from a limit; beside it both are near, and rates are beyond all bounds."""
    rng = np.random.default_rng(seed)
    lengths, (limit, way), width = limited(rng)
    closed = int(rng.choice([-1, 1]))
    start = limit + way * 10.0 ** rng.uniform(-5.7, -3.0)
    stop = start + way * rng.uniform(0.1, 0.9) * width
    steps = int(rng.choice([1, 3, 10, 90]))
    for theta in (start, limit + way * 0.4 * width):  # from the file's own position, and followed to there
        motion = planar.cycle(four_bar(*lengths, theta, closed), steps, start, stop)
        assert motion.outcome is Outcome.SOLVED
        found = np.exp(1j * motion.link("DC").angle)
        own, other = (np.exp(1j * rocker(*lengths, motion.inputs["A"].position, each)) for each in (closed, -closed))
        # rounding of the limit itself is magnified by the root of the distance
        np.testing.assert_allclose(found, own, atol=1e-9)
        assert np.all(np.abs(found - own) < np.abs(found - other))


def test_the_branch_that_comes_back_from_a_limit_is_told_apart_by_its_way_and_its_determinant(monkeypatch):
    """Beside a limit, steps from one branch to the other: closed, and as the rates there allow."""

    def judged(seed):
        rng = np.random.default_rng(seed)
        lengths, (limit, way), _ = limited(rng)
        near = 10.0 ** rng.uniform(-5, -2)
        theta = limit + way * near * np.array([1.0, 10.0 ** rng.uniform(-1, 1)])
        solver = PositionSolver(four_bar(*lengths, theta[0]))
        base = solver.find_assembly().z
        phi = [rocker(*lengths, theta, closed) for closed in (1, -1)]
        beta = [coupler(*lengths, theta, each) for each in phi]
        for k in (0, 1):
            z = np.array([[beta[0][0], phi[0][0]], [beta[k][1], phi[k][1]]])
            z -= TURN * np.round((z - base) / TURN)
            assert np.all(solver.max_residuals(z, theta[:, None]) < solver.tolerance)
            steps = accept_steps(solver.acceptance, z, theta[:, None], solver.acceptance_scales)
            yield bool(steps[0])

    own, other = np.transpose([list(judged(seed)) for seed in range(40)])
    assert own.sum() > 20
    assert not other.any()
    for name in ("keep_direction", "keep_signs"):
        with monkeypatch.context() as without:
            without.setattr(fast_path, name, lambda *given: True)
            assert not any(list(judged(seed))[1] for seed in range(40))
    monkeypatch.setattr(fast_path, "keep_direction", lambda *given: True)
    monkeypatch.setattr(fast_path, "keep_signs", lambda *given: True)
    assert sum(list(judged(seed))[1] for seed in range(40))


def test_near_a_parallelogram_no_step_leads_to_the_assembly_beside():
    """Its two assemblies run along each other for a quarter of a turn, and meet in the dead point ahead."""
    value = {
        "planar": 1,
        "name": "all but a parallelogram",
        "frame": "base",
        "links": {
            "base": {"points": {"O": [-0.00030895, 0.00024396], "P": [-0.05030818, -0.00031008]}},
            "arm": {"ends": ["O", "A"], "length": 0.39976116},
            "stay": {"ends": ["P", "B"], "length": 0.4032915},
            "head": {"ends": ["A", "B"], "length": 0.048882979},
        },
        "pairs": [{"turning": name} for name in "OPAB"],
        "inputs": [{"pair": "O", "position": "50 deg", "velocity": "0.5 rad/s"}],
        "sketch": {"B": [0.206165, 0.30427]},
    }
    mechanism = planar.from_dict(value)
    start = mechanism.inputs[0].position
    coarse, fine = (planar.cycle(mechanism, steps, start, start + TURN) for steps in (24, 240))
    rows = len(coarse.inputs["O"].position) - 1  # the last one is the dead point
    assert rows == 8
    np.testing.assert_allclose(
        coarse.point("B").position[:rows], fine.point("B").position[: 10 * rows : 10], atol=1e-12
    )


@pytest.mark.parametrize("inside", [1e-5, 1e-4, 1e-3])
@pytest.mark.parametrize("side", [1, -1])
def test_a_trammel_started_beside_its_limit_stays_on_its_side(inside, side):
    value = files.to_dict(planar.load("elliptical-trammel"))
    value["inputs"][0]["position"] = 120 * (1 - inside)
    value["sketch"] = {"Q": [0, side * 10]}
    motion = planar.cycle(files.from_dict(value), 5, stop=-0.1)
    assert motion.outcome is Outcome.SOLVED
    x = motion.inputs["across"].position
    np.testing.assert_allclose(motion.pair("up")["displacement"], side * np.sqrt(0.12**2 - x**2), rtol=1e-9)


@pytest.mark.parametrize(
    "model",
    ["watt-six-bar", "stephenson-3-five-bar", "klann-leg", "toggle-press", "slotted-lever", "oldham", "whitworth"],
)
def test_every_row_of_a_run_passes_the_gate(model):
    mechanism = planar.load(model)
    motion = planar.cycle(mechanism, 60, pair=mechanism.inputs[0].pair)
    assert passes_residual_check(mechanism, motion)
    assert len(motion) == 61 or motion.outcome is not Outcome.SOLVED
    # what is given of the input is what every row has
    (given, *_) = mechanism.inputs
    pair = motion.pair(given.pair)
    rate = pair["velocity"] if motion.has_length_motion(given.pair) else pair["relative_angular_velocity"]
    np.testing.assert_allclose(rate[np.isfinite(rate)], given.velocity, rtol=1e-12)


# turns


def test_angles_go_on_beyond_a_turn_and_come_back():
    motion = planar.cycle(four_bar(*ROCKER, 0.8), 300, 0.8, 0.8 + 3 * TURN)
    np.testing.assert_allclose(motion.link("AB").angle, motion.inputs["A"].position, atol=1e-12)
    for name in ("BC", "DC"):
        angle = motion.link(name).angle
        assert np.abs(np.diff(angle)).max() < 0.2
        np.testing.assert_allclose(angle[100:], angle[:-100], atol=1e-12)  # a rocker and its coupler come back


def test_gears_count_turns_over_three_turns():
    """Sun 40, ring 80 held: the arm a third of the sun's way, the planet backwards by Willis' equation."""
    mechanism = planar.load("planetary-gear-set")
    start = mechanism.inputs[0].position
    motion = planar.cycle(mechanism, 90, stop=start + 3 * TURN)
    sun = motion.inputs["O:frame,sun"].position
    assert sun[-1] - sun[0] == pytest.approx(3 * TURN, abs=1e-12)
    angles = {name: motion.link(name).angle for name in ("sun", "arm", "planet")}
    np.testing.assert_allclose(angles["sun"], sun, atol=1e-12)
    np.testing.assert_allclose(angles["arm"] - angles["arm"][0], (sun - sun[0]) / 3, atol=1e-11)
    planet = (sun - sun[0]) / 3 - 2 * (2 / 3) * (sun - sun[0])
    np.testing.assert_allclose(angles["planet"] - angles["planet"][0], planet, atol=1e-11)


def test_a_geared_five_bar_closes_only_after_two_turns():
    """Its second crank turns -1.5 times as far: after one turn of the first it stands half a turn off."""
    mechanism = planar.load("geared-five-bar")
    start = mechanism.inputs[0].position
    motion = planar.cycle(mechanism, 40, stop=start + 2 * TURN)
    place = motion.point("C").position
    np.testing.assert_allclose(place[-1], place[0], atol=1e-12)
    assert np.hypot(*(place[20] - place[0])) > 0.01


# the command line


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["-o", "m.xls"], [".xls", ".csv, .json, .npz, .parquet or .xlsx"]),
        (["-o", "m"], ["a file name without an ending", ".csv"]),
        (["-o", "no/m.csv"], ["m.csv", "cannot be written"]),
        (["-o", "m.csv", "--json"], ["-o", "give one of the two"]),
        (["--from", "30mm"], ["an angle is wanted"]),
        (["--input", "Q"], ["there is no input at 'Q'"]),
        (["--steps", "0"], ["steps", "from 1 to"]),
    ],
)
def test_a_wrong_word_on_the_command_line_ends_with_2(words, said, tmp_path):
    ended = run(tmp_path, "cycle", "crank-rocker", *words)
    sentence = ended.refused(2)
    for each in said:
        assert each in sentence
    assert not list(tmp_path.iterdir())


def test_a_run_that_stops_ends_with_1_and_what_was_reached(tmp_path):
    ended = run(tmp_path, "cycle", "triple-rocker", "--to", "100deg", "--steps", "12", "--json")
    sentence = ended.refused(1)
    told = json.loads(ended.out)
    limit = np.degrees(between(90, 150, 155))
    assert told["outcome"] == "dead point"
    assert told["reason"] in sentence
    assert f"A0 = {limit:.6g} deg" in sentence
    np.testing.assert_allclose(
        np.degrees(told["inputs"]["A0"]["position"]), [*(40 + 5 * np.arange(8)), limit], rtol=1e-6
    )
    ended = run(tmp_path, "cycle", "triple-rocker", "--to", "100deg", "--steps", "12", "-o", "m.csv")
    assert ended.refused(1) == sentence
    assert len((tmp_path / "m.csv").read_text(encoding="utf-8").splitlines()) == 1 + 9


def test_a_run_is_printed_as_a_table(tmp_path):
    out = run(tmp_path, "cycle", "crank-rocker", "--steps", "720").done()
    assert "A0 from 60 deg to 420 deg" in out
    assert "721 positions" in out
    line = next(line for line in out.splitlines() if line.split()[:1] == ["B"])
    x = [float(cell) for cell in line.split()[1:3]]
    # the rocker turns back where crank and coupler are in line: 230 and 130 from A0, 120 from B0 200 further on
    ends = [(r * r + 200**2 - 120**2) / (2 * 200) for r in (130, 230)]
    assert x == pytest.approx(ends, abs=0.01)


def test_an_input_is_named_on_the_command_line(tmp_path):
    sentence = run(tmp_path, "cycle", "planetary-differential").refused(2)
    assert "there are several inputs" in sentence
    out = run(tmp_path, "cycle", "planetary-differential", "--input", "O:frame,ring", "--steps", "2").done()
    assert "O:frame,sun = 30 deg, held" in out


def test_a_copy_of_a_motion_changes_nothing_in_it():
    motion = planar.cycle(four_bar(*ROCKER, 0.8), 4)
    before = copy.deepcopy(motion.link("DC"))
    motion.link("DC").angle[:] = 0.0
    motion.pair("C")["relative_angle"][:] = 0.0
    np.testing.assert_array_equal(motion.link("DC").angle, before.angle)


def test_a_run_is_not_written_over_its_own_mechanism(tmp_path):
    file = tmp_path / "m.json"
    file.write_text(planar.dumps(planar.load("crank-rocker")), encoding="utf-8")
    before = file.read_bytes()
    sentence = run(tmp_path, "cycle", "m.json", "-o", "./m.json").refused(2)
    assert "own file" in sentence
    assert file.read_bytes() == before


@pytest.mark.parametrize("order", [1, 2])
def test_a_row_whose_rates_break_a_constraint_has_none_and_is_named(monkeypatch, order):
    real = samples.sample_rates

    def spoiled(*given):
        rated = real(*given)
        rated[0][order][3] *= 1.01
        return rated

    monkeypatch.setattr(samples, "sample_rates", spoiled)
    motion = planar.cycle(four_bar(*ROCKER, 0.8), 12, jerk=True)
    assert np.flatnonzero(np.isnan(motion.link("BC").angular_velocity)).tolist() == [3]
    assert np.isfinite(motion.link("BC").angle).all()
    (remark,) = [each for each in motion.remarks if "no rates are given" in each]
    assert f"at A = {motion.inputs['A'].position[3]:.6g} rad" in remark
