"""What rounding leaves of short links, of angles that count many turns, of linkages next to a change point."""

import re

import numpy as np
import pytest
from flint import arb, ctx

import planar
from planar.document.dimensions import change_dimension, link_lengths
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.geometry import Vector
from planar.model.pairs.base import sample_shape
from planar.model.pairs.guide_line import LinkLine
from planar.solving.checks import stack_motion
from planar.solving.continuation import path, predictor_corrector
from planar.solving.continuation.path import Period
from planar.solving.position import PositionSolver
from tests.builders import four_bar_document, slider_crank_document
from tests.draws import draws, part
from tests.watchdog import watched

SURE = 1e-7
"""What is not told is better than this."""


def sketched_four_bar(crank, coupler, rocker, frame, angle, sketch, velocity=1.0, acceleration=0.5):
    more = {"omega": velocity, "alpha": acceleration, "sketch": {"B": list(sketch)}}
    return four_bar_document(crank, coupler, rocker, frame, angle, pins="OABQ", **more)


def sketched_slider_crank(crank, rod, offset, angle, sketch):
    return slider_crank_document(crank, rod, angle, offset, alpha=0.5, sketch={"B": list(sketch)})


@pytest.fixture(autouse=True)
def digits():
    """Balls of a hundred digits: what is left of them after all that cancels here is exact to a double."""
    before, ctx.dps = ctx.dps, 100
    yield
    ctx.dps = before


def crank_pin(crank, angle, velocity, acceleration):
    """Place, velocity and acceleration of the crank's end."""
    c, s = crank * angle.cos(), crank * angle.sin()
    w, alpha = velocity, acceleration
    return (c, s), (-s * w, c * w), (-s * alpha - c * w * w, c * alpha - s * w * w)


def of_four_bar(crank, coupler, rocker, frame, angle, side, velocity=1.0, acceleration=0.5):
    """Place, velocity and acceleration of B, by its distances from A and Q; None where the links do not meet."""
    a, b, c, d, at, w, alpha = (arb(x) for x in (crank, coupler, rocker, frame, angle, velocity, acceleration))
    (ax, ay), (vx, vy), (wx, wy) = crank_pin(a, at, w, alpha)
    dx, dy = d - ax, -ay
    square = dx * dx + dy * dy
    along = (square + b * b - c * c) / (2 * square)
    across = b * b / square - along * along
    if not across > 0:
        return None
    off = across.sqrt() * side
    ex, ey = along * dx - off * dy, along * dy + off * dx
    fx, fy = ax + ex - d, ay + ey
    det = ey * fx - fy * ex

    def turning(x, y):
        """The rates p, q of the two links with (-ey, ex) p - (-fy, fx) q = -(x, y)."""
        return (x * fx + y * fy) / det, (ey * y + ex * x) / det

    p, q = turning(vx, vy)
    _, q2 = turning(wx - ex * p * p + fx * q * q, wy - ey * p * p + fy * q * q)
    return floats((ax + ex, ay + ey), (-fy * q, fx * q), (-fy * q2 - fx * q * q, fx * q2 - fy * q * q))


def of_slider_crank(crank, rod, offset, angle, side):
    """The same of the slide's pin: B is on y = offset, `side` of A."""
    a, b, h, at = (arb(x) for x in (crank, rod, offset, angle))
    (ax, ay), (vx, vy), (wx, wy) = crank_pin(a, at, arb(1), arb(0.5))
    ey = h - ay
    square = b * b - ey * ey
    if not square > 0:
        return None
    ex = square.sqrt() * side
    # ex^2 + ey^2 = b^2, differentiated once and twice
    ex1 = ey * vy / ex
    ex2 = (ey * wy - vy * vy - ex1 * ex1) / ex
    zero = arb(0)
    return floats((ax + ex, h), (vx + ex1, zero), (wx + ex2, zero))


def floats(*vectors):
    return [np.array([float(x) for x in vector]) for vector in vectors]


def short_four_bars(rng, many):
    """Four-bars of which one link is short, or two: B near Q, crank, coupler, rocker."""
    for k in range(many):
        size, small = rng.uniform(0.5, 0.9), 10.0 ** -rng.uniform(3, 18)
        near = rng.uniform(-0.3, 0.3)
        reach = float(np.cos(near) + np.sqrt(size**2 - np.sin(near) ** 2))
        yield (
            (1.0, small, small * rng.uniform(0.6, 1.6), 1.0, small * rng.uniform(0.2, 1.5)),
            (1.0, small, size, reach + small * rng.uniform(-0.7, 0.7), near),
            (1.0, size, small, reach + small * rng.uniform(-0.7, 0.7), near),
            (small, size, rng.uniform(0.5, 1.0), 0.8, rng.uniform(-3.0, 3.0)),
        )[k % 4]


def short_rods(rng, many):
    for _ in range(many):
        small, near = 10.0 ** -rng.uniform(3, 18), rng.uniform(0.3, 1.2)
        yield 1.0, small, float(np.sin(near)) + small * rng.uniform(-0.7, 0.7), near


def told_error(state):
    """The greatest relative error that the rates may have, by what is said of them."""
    said = [re.search(r"rounding leaves (\d+) digits? of the rates", remark) for remark in state.remarks]
    return max((10.0 ** -int(each[1]) for each in said if each), default=SURE)


@pytest.mark.parametrize(
    ("drawn", "value", "exact"),
    [(short_four_bars, sketched_four_bar, of_four_bar), (short_rods, sketched_slider_crank, of_slider_crank)],
)
def test_the_rates_of_short_links_are_as_exact_as_is_told_or_refused(drawn, value, exact):
    refused, solved = [], []
    for given in drawn(np.random.default_rng(3), draws(280)):
        both = [exact(*given, side) for side in (1, -1)]
        if both[0] is None:
            continue
        least = min(each for each in given[:3] if each) if value is sketched_four_bar else given[1]
        try:
            state = planar.solve(planar.from_dict(value(*given, both[0][0])))
        except NoAnswer as problem:
            assert problem.outcome is Outcome.TOO_INEXACT
            assert re.search(r"link '\w+' has an arm of .* lengthen link", problem.reason)
            refused.append(least)
            continue
        place = state.point("B").position
        # which of the two is taken is not asked here
        near = min(both, key=lambda each: np.linalg.norm(state.point("B").velocity - each[1]))
        np.testing.assert_allclose(place, near[0], rtol=0.0, atol=1e-14)
        speeds = [np.linalg.norm(state.point(name).velocity) for name in "AB"]
        pace = [max(speeds), max(np.linalg.norm(state.point(name).acceleration) for name in "AB")]
        rates = state.point("B").velocity, state.point("B").acceleration
        for found, true, scale in zip(rates, near[1:], pace, strict=True):
            assert np.linalg.norm(found - true) <= told_error(state) * scale
        solved.append(least)
    # none is refused of which four digits are left
    assert max(refused) < 3e-11
    assert len(solved) > len(refused) > 3


def test_a_wrong_velocity_beside_a_very_fast_link_breaks_its_own_constraint():
    """A link of 1e-8 turns 1e8 times as fast as those that it joins: what is wrong of them is no less wrong for it."""
    angle, rocker = 0.2, 0.7
    frame = float(np.cos(angle) + np.sqrt(rocker**2 - np.sin(angle) ** 2)) + 3e-9
    given = sketched_four_bar(1.0, 1e-8, rocker, frame, angle, of_four_bar(1.0, 1e-8, rocker, frame, angle, 1)[0])
    solver = PositionSolver(planar.from_dict(given))
    state = solver.state(solver.find_assembly().z)
    assert abs(state.link("AB").angular_velocity) > 1e7
    check, p = solver.structure.residual_check, solver.inputs.p
    w = [rates[None] for rates in state.frames.source.coordinate_rates]
    u = [rates[None] for rates in solver.inputs[:3]]
    for order, (gap, _) in enumerate(check.rate_residuals(stack_motion(w, u), p), 1):
        assert gap <= 1e3 * solver.tolerance
        wrong = np.array(w)
        wrong[order, 0, solver.column["QB", "angle"]] *= 1.0 + 1e-6
        assert check.rate_residuals(stack_motion(wrong, u), p)[order - 1][0] > 1e3 * solver.tolerance


def test_every_way_to_run_a_linkage_holds_what_rounding_leaves():
    """A coupler of 1e-12, whose rocker comes out wrong by 1e-5 and more."""
    angle, coupler, rocker = 0.5, 1e-12, 0.6
    frame = float(np.cos(angle) + np.sqrt(rocker**2 - np.sin(angle) ** 2)) + 0.3 * coupler
    sketch = of_four_bar(1.0, coupler, rocker, frame, angle, 1)[0]
    mechanism = planar.from_dict(sketched_four_bar(1.0, coupler, rocker, frame, angle, sketch))
    whole = {"start": angle, "stop": angle + 0.2 * coupler}
    with pytest.raises(NoAnswer, match="too inexact"):
        planar.cycle(mechanism, 4, **whole)
    inexact = tuple(Outcome).index(Outcome.TOO_INEXACT)
    swept = planar.sweep(mechanism, {"AB.length": [coupler] * 3}, 4, ["B"], **whole)
    assert set(np.ravel(swept.status)) == {inexact}
    assert set(planar.prepared(mechanism, 4, ["B"], **whole)().status) == {inexact}
    for each in planar.sweep_each([mechanism, mechanism], 4, points=["B"]):
        solved = np.asarray(each.status) == 0
        assert np.isnan(np.asarray(each.velocity["B"])[solved]).all()


# angles that count turns


def geared(ratio, angle):
    return {
        "planar": 1,
        "name": "two wheels",
        "frame": "frame",
        "links": {
            "frame": {"points": {"O": [0, 0], "Q": [1, 0]}},
            "a": {"ends": ["O", "A"], "length": 0.3},
            "b": {"ends": ["Q", "B"], "length": 0.4},
        },
        "pairs": [{"turning": "O"}, {"turning": "Q"}, {"gear": "wheels", "links": ["a", "b"], "ratio": ratio}],
        "inputs": [{"pair": "O", "position": angle, "velocity": 1.0}],
    }


@pytest.mark.parametrize("turns", [0.3, 10, 1000.123, 1e5])
@pytest.mark.parametrize("ratio", [-2.0, 1e3, 1e6])
def test_a_wheel_that_has_turned_far_is_where_its_angle_says_to_the_digits_that_are_told(ratio, turns):
    angle = 2.0 * np.pi * turns
    state = planar.solve(planar.from_dict(geared(ratio, angle)))
    true = arb(ratio) * arb(angle)
    place = np.array([1.0 + 0.4 * float(true.cos()), 0.4 * float(true.sin())])
    off = np.linalg.norm(state.point("B").position - place)
    # a number is rounded by a part of itself
    assert off <= 0.4 * np.finfo(float).eps * abs(ratio * angle) + 1e-15
    assert off <= 0.4 * told_error(state)


def test_an_angle_of_too_many_turns_is_refused_for_what_it_is():
    with pytest.raises(NoAnswer, match=r"the angle of link 'b' counts up to 6\.28e") as refused:
        planar.solve(planar.from_dict(geared(1e6, 2e6 * np.pi)))
    assert refused.value.outcome is Outcome.TOO_INEXACT
    assert "e+284" not in refused.value.reason
    with pytest.raises(planar.BadInput, match=r"inputs\[0\].position: beyond 1e\+12 rad rounding leaves"):
        planar.from_dict(geared(1.0, 1e13))


ROCKER = (0.3, 0.9, 0.7, 1.0)
DRAG_LINK = (0.9, 0.8, 1.0, 0.4)


def off_closed_form(lengths, angle, point_velocity):
    return min(np.linalg.norm(point_velocity - of_four_bar(*lengths, angle, side)[1]) for side in (1, -1))


@pytest.mark.parametrize("lengths", [ROCKER, DRAG_LINK])
def test_a_crank_far_round_is_followed_over_whole_turns_at_once(lengths, monkeypatch):
    """A motion that comes back goes on as before, so that no walk need go through all its turns."""
    mechanism = planar.from_dict(sketched_four_bar(*lengths, 0.0, of_four_bar(*lengths, 0.0, 1)[0]))
    asked = []
    real = path.follow_samples
    monkeypatch.setattr(path, "follow_samples", lambda *given: asked.append(len(given[2].u)) or real(*given))
    for far in (1e5, -1e7):
        motion = planar.cycle(mechanism, 16, 0.0, far)
        rounding = 20.0 * np.finfo(float).eps * abs(far)
        for angle, velocity in zip(motion.inputs["O"].position, motion.point("B").velocity, strict=True):
            assert off_closed_form(lengths, float(angle), velocity) <= rounding
        state = planar.solve(mechanism, {"O": far})
        assert off_closed_form(lengths, far, state.point("B").velocity) <= rounding
    # what goes round has turned as often as the crank
    turned = motion.link("QB").angle[-1] - motion.link("QB").angle[0]
    assert abs(turned - (far if lengths is DRAG_LINK else 0.0)) < 2.0 * np.pi
    assert sum(asked) < 5000
    at_once = planar.solve(planar.from_dict(sketched_four_bar(*lengths, 1e6, motion.point("B").position[0])))
    assert off_closed_form(lengths, 1e6, at_once.point("B").velocity) <= 20.0 * np.finfo(float).eps * 1e6


def test_turns_without_change_points_are_not_gone_through_one_by_one():
    period = Period((), np.array([0.0, 2.0 * np.pi]), (), ())
    with watched(20):
        assert list(period.bifurcations_until(1e15)) == []


def test_a_far_motion_that_ends_or_does_not_come_back_says_so(monkeypatch):
    monkeypatch.setattr(predictor_corrector.ArcBudget.__init__, "__defaults__", (300, None))
    double_rocker = (0.9, 0.8, 0.5, 0.6)
    value = sketched_four_bar(*double_rocker, 0.3, of_four_bar(*double_rocker, 0.3, 1)[0])
    with pytest.raises(NoAnswer, match="cannot go beyond"):
        planar.solve(planar.from_dict(value), {"O": 1e6})
    # wheels of an irrational ratio never come back to where they meshed
    never = planar.to_dict(planar.load("geared-five-bar"))
    gear = next(pair for pair in never["pairs"] if "gear" in pair)
    del gear["teeth"]
    gear["ratio"] = -(1.0 + 5.0**0.5) / 2.0
    with pytest.raises(NoAnswer, match=r"branch lost: .* O = "):
        planar.solve(planar.from_dict(never), {"O": 1e6})


# next to a change point


@pytest.mark.parametrize("off", part([0.0, 1e-15, -1e-15, 3e-15, 1e-14, -1e-14], 1))
def test_a_parallelogram_printed_to_fifteen_digits_runs_through_all_its_rows(off):
    """B moves as the crank's end, but for what the length that is off makes of it beside the points where all is in one
    line: there an angle is off by as much over the square of the distance."""
    crank, frame, start, steps = 0.3, 1.0, 0.9, 360
    place = np.array([frame + crank * np.cos(start), crank * np.sin(start)])
    mechanism = planar.from_dict(sketched_four_bar(crank, frame + off, crank, frame, start, place))
    motion = planar.cycle(mechanism, steps)
    angles = motion.inputs["O"].position
    true = crank * np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    near = np.abs(np.sin(angles))
    given = near > 1e-6
    assert np.isfinite(motion.point("B").velocity[given]).all()
    error = np.linalg.norm(motion.point("B").velocity - true, axis=1)
    # the dyad's determinant is as the sine; its errors are twice divided by it
    bound = 20.0 * (abs(off) + np.finfo(float).eps) / crank / np.minimum(near, 1.0) ** 2
    assert np.all(error[given] <= bound[given])
    swept = planar.sweep(mechanism, {"AB.length": [frame + off]}, steps, ["B"])
    assert np.all(np.asarray(swept.status) == 0)
    np.testing.assert_allclose(np.asarray(swept.velocity["B"])[0][given], motion.point("B").velocity[given], atol=1e-9)


# numbers that no plan has


@pytest.mark.parametrize(("name", "value"), [("AB.length", 1e-155), ("PD.length", 1e-308), ("AB.length", 1e155)])
def test_a_length_whose_square_is_no_number_is_bad_input_however_it_came(name, value):
    mechanism = planar.load("004-OABQ")
    links = frozenset(link.name for link in mechanism.links)
    (own,) = (each for each in link_lengths(mechanism, links) if each.name == name)
    for ask in (planar.solve, planar.cycle, planar.inspect):
        with pytest.raises(planar.BadInput, match="a place is 0, or from 1e-100"):
            ask(change_dimension(mechanism, own, value))


def test_a_line_through_near_points_has_its_direction():
    """Also where the square of their distance is no number."""
    shape = sample_shape(P=Vector(0.0, 0.0), R=Vector(3e-170, -4e-170))
    np.testing.assert_allclose(LinkLine("P", "R").measure_line(shape), [0.0, 0.0, 0.6, -0.8], rtol=1e-15)
