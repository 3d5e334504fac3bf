"""Guaranteed bands: intervals against another arithmetic, closed forms, samples by sweeps, refusals."""

from __future__ import annotations

import json
from itertools import product
from math import pi

import casadi as ca
import numpy as np
import pytest

import planar
from planar.derivatives.enclosures import Intervals, ParameterBoxes, ParametricSystem, exact
from planar.foundation.errors import BadInput, NoAnswer
from tests.builders import slider_crank
from tests.command import run
from tests.draws import first_cases

GRASHOF = ("crank.length", "coupler.length", "rocker.length", "frame.B0.x")
"""The lengths of the model crank-rocker: 50 + 200 < 180 + 120 mm, so with 12.5 mm each the crank may turn no more."""


def test_intervals_hold_what_other_arithmetic_tells_and_are_hardly_wider():
    flint = pytest.importorskip("flint")
    rng = np.random.default_rng(0)
    low = rng.uniform(-30.0, 30.0, 150)
    boxes = Intervals(low, low + 10.0 ** rng.uniform(-17.0, 1.0, 150))
    others = Intervals(low[::-1] / 7.0, boxes.upper[::-1] / 7.0)
    inside = [np.clip(low + part * (boxes.upper - low), low, boxes.upper) for part in (0.0, 0.4, 1.0)]
    beside = [np.clip(o + part * (others.upper - o), o, others.upper) for o, part in ((others.lower, 0.3),)]
    kinds = {
        "cos": (boxes.cos(), lambda x, _: x.cos()),
        "sin": (boxes.sin(), lambda x, _: x.sin()),
        "product": (boxes * others, lambda x, y: x * y),
        "quotient": (boxes / others, lambda x, y: x / y),
        "square": (boxes.square(), lambda x, _: x * x),
        "root": (boxes.magnitude().sqrt(), lambda x, _: abs(x).sqrt()),
        "angle": (boxes.atan2(others), flint.arb.atan2),
    }
    for name, (found, formula) in kinds.items():
        for x, y in product(inside, beside):
            for k in np.flatnonzero(np.isfinite(found.lower)):
                with flint.ctx.workprec(200):
                    value = formula(flint.arb(float(x[k])), flint.arb(float(y[k])))
                    assert flint.arb(found.lower[k]) <= value <= flint.arb(found.upper[k]), name
    narrow = exact(low).cos()
    assert np.max(narrow.upper - narrow.lower) < 3e-14


def test_krawczyks_operator_encloses_a_root_and_its_slope_and_proves_none_where_there_are_two():
    """x^2 = t on 3.9 to 4.1 near 2, where dx/dt = 1 / (2 x); about t = 0 the root is no function of t."""
    x, t = ca.SX.sym("x"), ca.SX.sym("t")
    system = ParametricSystem(x, t, x * x - t, 3.0 * x, [0])
    boxes = ParameterBoxes(np.array([[3.9], [-0.1]]), np.array([[4.1], [0.1]]))
    found = system.enclose(boxes, np.array([[2.1], [0.1]]))
    assert found.is_proved.tolist() == [True, False]
    roots = np.sqrt(boxes.lower[0, 0]), np.sqrt(boxes.upper[0, 0])
    ends = found.middle[0, 0] - found.radius[0, 0], found.middle[0, 0] + found.radius[0, 0]
    assert ends[0] <= roots[0] < roots[1] <= ends[1]
    assert ends[1] - ends[0] < 1.1 * (roots[1] - roots[0])
    slopes = found.slopes.middle[0, 0, 0] + found.slopes.radius[0, 0, 0] * np.array([-1.0, 1.0])
    assert slopes[0] <= 1.5 / roots[1] < 1.5 / roots[0] <= slopes[1]


def ends_of(values, row, per_row):
    """The least and the greatest of samples (designs, positions) half a step about a row."""
    near = values[:, max(0, row * per_row - per_row // 2) : row * per_row + per_row // 2 + 1]
    return near.min(), near.max()


def test_a_slider_cranks_worst_case_is_enclosed_to_a_hundredth():
    """x = r cos u + sqrt(l^2 - (r sin u)^2): at the corners of its lengths, at many positions about every row."""
    r, l, t = 0.5, 1.7, 1e-3  # noqa: E741
    mechanism = slider_crank(r, l, 0.0, position=0.3, velocity=3.0)
    motion = planar.cycle(mechanism, 72)
    pair = next(name for name, each in motion.pairs.items() if "displacement" in each)
    told = {name: t for name, value in planar.dimensions(mechanism).items() if value in (r, l) and "length" in name}
    assert len(told) == 2
    band = planar.tolerance(motion, pair, told, guaranteed=True).guaranteed
    u = 0.3 + np.linspace(0.0, 2.0 * pi, 72 * 8 + 1)
    place = [a * np.cos(u) + np.sqrt(b**2 - (a * np.sin(u)) ** 2) for a in (r - t, r, r + t) for b in (l - t, l, l + t)]
    off = np.array(place) - place[4]
    for row in range(73):
        least, greatest = ends_of(off, row, 8)
        assert band.lower[row, 0] < least
        assert greatest < band.upper[row, 0]
    for angle in (0.2, 1.1, 2.5):
        state = planar.solve(slider_crank(r, l, 0.0, position=angle, velocity=3.0))
        alone = planar.tolerance(state, pair, told, guaranteed=True).guaranteed
        ends = [
            a * np.cos(angle) + np.sqrt(b**2 - (a * np.sin(angle)) ** 2) for a in (r - t, r + t) for b in (l - t, l + t)
        ]
        nominal = r * np.cos(angle) + np.sqrt(l**2 - (r * np.sin(angle)) ** 2)
        least, greatest = min(ends) - nominal, max(ends) - nominal
        assert alone.lower[0, 0] <= least < greatest <= alone.upper[0, 0]
        assert alone.upper[0, 0] - alone.lower[0, 0] < 1.01 * (greatest - least)


@pytest.mark.parametrize(
    ("model", "of"),
    first_cases(
        [("whitworth", "R"), ("stephenson-3-five-bar", "C"), ("slider-crank", "stroke"), ("crank-rocker", "B")], 2
    ),
)
def test_no_mechanism_leaves_the_band_and_it_is_hardly_wider_than_they_are_far(model, of):
    """A quick return with slides, and a linkage of no dyads, among them; corners and inside, between the rows too."""
    rows, per_row = 24, 4
    motion = planar.cycle(model, rows)
    band = planar.tolerance(motion, of, {"general": "ISO 2768-1 m"}, guaranteed=True)
    limits = np.array([[each.lower, each.upper] for each in band.variations.numbers])
    rng = np.random.default_rng(3)
    slopes = np.concatenate(band.linear.slopes)
    unit = np.concatenate([np.sign(slopes), -np.sign(slopes), np.sign(rng.normal(size=(200, len(limits))))])
    unit = np.concatenate([unit, rng.uniform(-1.0, 1.0, (400, len(limits))), np.zeros((1, len(limits)))])
    off = limits.mean(axis=1) + 0.5 * np.ptp(limits, axis=1) * unit
    values = planar.dimensions(motion.mechanism)
    names = [each.number for each in band.variations.numbers]
    at, asked = motion.inputs[motion.running_input].position, "points" if band.result == "position" else "pairs"
    swept = planar.sweep(
        motion.mechanism,
        {name: values[name] + off[:, k] for k, name in enumerate(names)},
        rows * per_row,
        start=float(at[0]),
        stop=float(at[-1]),
        rates=False,
        **{asked: [of]},
    )
    found = swept.position[of] if asked == "points" else swept.value[of][..., None]
    found = found - found[-1]
    assert np.isfinite(found).all()
    guaranteed = band.guaranteed
    for row in range(rows + 1):
        for part in range(found.shape[2]):
            least, greatest = ends_of(found[..., part], row, per_row)
            assert guaranteed.lower[row, part] <= least
            assert greatest <= guaranteed.upper[row, part]
            assert guaranteed.upper[row, part] - guaranteed.lower[row, part] < 1.2 * (greatest - least)
    far = np.linalg.norm(found, axis=2)[:, ::per_row].max(axis=0)
    assert np.all(guaranteed.worst >= far)


def test_clearance_is_a_disc_and_an_inputs_own_tolerance_counts():
    state = planar.solve("crank-rocker")
    band = planar.tolerance(state, "B", {"clearance": {"A": 2e-5, "B": 1e-5}, "A0.position": 1e-4}, guaranteed=True)
    linear = band.linear.limits()
    assert band.guaranteed.lower == pytest.approx(linear[0], rel=2e-3)
    assert band.guaranteed.upper == pytest.approx(linear[1], rel=2e-3)
    assert band.guaranteed.worst[0] == pytest.approx(band.worst, rel=5e-3)
    assert np.all(band.guaranteed.worst >= band.worst)


def test_a_stroke_and_a_dead_point_are_enclosed_where_they_go_themselves():
    """sqrt((l + r)^2 - e^2) - sqrt((l - r)^2 - e^2); and a crank as far as where coupler and rocker are in line."""
    r, l, e, t = 0.5, 1.7, 0.3, 2e-3  # noqa: E741
    motion = planar.cycle(slider_crank(r, l, e, velocity=3.0), 36)
    pair = next(name for name, each in motion.pairs.items() if "displacement" in each)
    values = planar.dimensions(motion.mechanism)
    told = {name: t for name, value in values.items() if value in (r, l) and "length" in name}
    strokes = [
        np.sqrt((b + a) ** 2 - e**2) - np.sqrt((b - a) ** 2 - e**2)
        for a in (r - t, r, r + t)
        for b in (l - t, l, l + t)
    ]
    found = planar.tolerance(motion, pair, told, result="travel", guaranteed=True).guaranteed
    least, greatest = min(strokes) - strokes[4], max(strokes) - strokes[4]
    assert found.lower[0, 0] <= least < greatest <= found.upper[0, 0]
    assert found.upper[0, 0] - found.lower[0, 0] < 1.01 * (greatest - least)

    four_bar = planar.cycle("four-bar", 24)
    values = planar.dimensions(four_bar.mechanism)
    a, b, c, d = (values[name] for name in ("AB.length", "BC.length", "DC.length", "AD.D.x"))
    turned = [np.arccos((a**2 + d**2 - (x + c) ** 2) / (2.0 * a * d)) for x in (b - 1e-4, b, b + 1e-4)]
    band = planar.tolerance(four_bar, "A", {"BC.length": 1e-4}, result="dead_points", guaranteed=True)
    assert abs(band.nominal).max() == pytest.approx(turned[1])
    far = np.abs(np.array(turned) - turned[1]).max()
    assert far <= band.guaranteed.worst[0] < 1.01 * far


def test_a_dead_point_within_the_tolerances_is_proved_and_what_cannot_be_proved_is_said():
    motion = planar.cycle("crank-rocker", 4)
    with pytest.raises(NoAnswer, match=r"within the tolerances there is a dead point at A0 = .* brings it nearest"):
        planar.tolerance(motion, "B", dict.fromkeys(GRASHOF, "12.7 mm"), guaranteed=True)
    with pytest.raises(NoAnswer, match=r"it is undecided whether all .* at A0 = .* contributes most: tighten it"):
        planar.tolerance(motion, "B", dict.fromkeys(GRASHOF, "12.4 mm"), guaranteed=True)


def test_what_has_no_guaranteed_band_is_refused_in_a_sentence():
    told, told_of_whitworth = {"rod.length": 1e-4}, {"crank.length": 1e-4}
    state = planar.solve("slider-crank")
    with pytest.raises(BadInput, match="not of 'velocity'"):
        planar.tolerance(state, "B", told, result="velocity", guaranteed=True)
    with pytest.raises(BadInput, match="not of ratios"):
        planar.tolerance(
            planar.cycle("whitworth", 12), "guide", told_of_whitworth, result="time_ratio", guaranteed=True
        )
    with pytest.raises(BadInput, match="without redundant constraints"):
        planar.tolerance(planar.solve("three-parallel-cranks"), "C", {"A0.position": 1e-3}, guaranteed=True)
    with pytest.raises(BadInput, match="'floor'"):
        planar.tolerance(planar.solve("valve-cam"), "T", {"general": "ISO 2768-1 f"}, guaranteed=True)


def test_the_command_tells_the_guaranteed_band(tmp_path):
    words = ("tolerance", "crank-rocker", "--of", "rocker", "--general", "f", "--guaranteed")
    told = run(tmp_path, *words).done()
    assert "no mechanism within the tolerances is off by more than" in " ".join(told.split())
    found = json.loads(run(tmp_path, *words, "--json").done())
    assert found["guaranteed"]["upper"][0][0] >= found["upper"]
    assert found["guaranteed"]["boxes"] == 1
