"""Tolerances of results: closed forms, random mechanisms, second order, clearance of pins, limits, refusals."""

from __future__ import annotations

import json
from math import cos, pi, sin, sqrt

import numpy as np
import pytest

import planar
from planar.analysis.tolerance.allowance import allowance
from planar.analysis.tolerance.spread import LinearSpread, NormalSpread
from planar.foundation.errors import BadInput, Unknown
from planar.guide.keys_page import read_example
from tests.builders import slider_crank
from tests.command import run
from tests.draws import first_cases, is_exhaustive

EXAMPLE = planar.from_dict(read_example("tolerances"))


def crank_of(angle=0.8, r=0.5, l=1.7, velocity=3.0):  # noqa: E741
    """A slider-crank, its slide, and the names of its lengths."""
    mechanism = slider_crank(r, l, 0.0, position=angle, velocity=velocity)
    state = planar.solve(mechanism)
    pair = next(name for name, each in state.pairs.items() if "displacement" in each)
    values = planar.dimensions(mechanism)
    by_value = {round(value, 9): name for name, value in values.items() if name.endswith(".length")}
    return state, pair, by_value[r], by_value[l]


def test_a_slider_cranks_worst_case_spread_and_contributions_are_those_of_its_closed_form():
    angle, r, l = 0.8, 0.5, 1.7  # noqa: E741
    state, pair, crank, rod = crank_of(angle, r, l)
    root = sqrt(l**2 - (r * sin(angle)) ** 2)
    by_crank, by_rod = cos(angle) - r * sin(angle) ** 2 / root, l / root
    band = planar.tolerance(state, pair, {crank: 1e-4, rod: [-1e-4, 3e-4]}, limit=3e-4)
    assert band.nominal == pytest.approx(r * cos(angle) + root)
    assert band.upper == pytest.approx(by_crank * 1e-4 + by_rod * 3e-4)
    assert band.lower == pytest.approx(-by_crank * 1e-4 - by_rod * 1e-4)
    assert band.worst == pytest.approx(band.upper)
    assert band.mean == pytest.approx(by_rod * 1e-4)
    parts = (by_crank * 1e-4 / 3.0, by_rod * 2e-4 / 3.0)
    assert band.std == pytest.approx(np.hypot(*parts))
    assert band.contribution[crank] == pytest.approx(parts[0] ** 2 / np.hypot(*parts) ** 2)
    assert sum(band.contribution.values()) == pytest.approx(1.0)
    assert 0.98 < band.share_within < 1.0
    uniform = planar.tolerance(state, pair, {crank: 1e-4, rod: [-1e-4, 3e-4]}, distribution="uniform")
    assert uniform.std == pytest.approx(band.std * sqrt(3.0))


def test_one_tolerance_of_all_lengths_is_that_of_each_beside_those_that_have_their_own():
    state, pair, crank, rod = crank_of()
    both = planar.tolerance(state, pair, {crank: 1e-4, rod: 1e-4})
    assert planar.tolerance(state, pair, {"lengths": "0.1 mm"}).worst == pytest.approx(both.worst, rel=1e-12)
    finer = planar.tolerance(state, pair, {crank: 1e-4, rod: 1e-6})
    assert planar.tolerance(state, pair, {"lengths": 1e-4, rod: 1e-6}).worst == pytest.approx(finer.worst, rel=1e-12)
    with_angles = planar.tolerance(state, pair, {"general": "ISO 2768-1 m", "lengths": 1e-4})
    assert with_angles.worst == pytest.approx(both.worst, rel=1e-12)


def test_a_four_bars_worst_case_is_that_of_the_law_of_cosines():
    """The rocker's angle at the crank on the line of centres: cos = (d'^2 + c^2 - b^2) / (2 c d')."""
    mechanism = planar.from_dict(read_example("tolerances") | {"tolerances": {"BC.length": 0.05, "DC.length": 0.02}})
    state = planar.solve(mechanism.with_values({"A.position": 0.0}))
    a, b, c, d = 0.03, 0.07, 0.05, 0.08
    side = d - a
    inner = np.arccos((side**2 + c**2 - b**2) / (2.0 * side * c))
    by_coupler = b / (side * c * sin(inner))
    by_rocker = (1.0 / side - cos(inner) / c) / sin(inner)
    band = planar.tolerance(state, "DC")
    assert band.worst == pytest.approx(by_coupler * 5e-5 + abs(by_rocker) * 2e-5, rel=1e-9)


def test_the_statistical_band_is_that_of_a_hundred_thousand_mechanisms():
    motion = planar.cycle(EXAMPLE, 12 if is_exhaustive() else 5)
    told = dict.fromkeys(("AB.length", "BC.length", "DC.length", "BC.E.distance"), "0.02 mm")
    band = planar.tolerance(motion, "E", told, samples=100_000, limit=5e-5)
    assert band.std == pytest.approx(band.sampled.std, rel=0.01)
    assert band.linear_error < 0.01
    assert band.share_within == pytest.approx(band.sampled.within, abs=5e-3)
    assert np.all(band.second_order.std >= band.std - 1e-15)
    uniform = planar.tolerance(motion, "E", told, samples=2000, distribution="uniform")
    assert np.all(uniform.sampled.worst <= 1.01 * uniform.worst)


@pytest.mark.parametrize(("model", "of"), first_cases([("whitworth", "R"), ("stephenson-3-five-bar", "C")]))
def test_the_statistical_band_is_that_of_its_samples_with_slides_and_without_dyads(model, of):
    motion = planar.cycle(model, 6)
    band = planar.tolerance(motion, of, {"general": "ISO 2768-1 f"}, samples=60_000)
    assert not any("off by" in each for each in band.remarks)
    np.testing.assert_allclose(band.std, band.sampled.std, rtol=0.01)


def test_where_the_linear_spread_is_off_it_says_so():
    state, pair, crank, _ = crank_of(angle=1e-3)
    band = planar.tolerance(state, pair, {"O.position" if False else crank: 1e-4})
    assert not band.remarks
    drive = state.mechanism.inputs[0].pair
    wide = planar.tolerance(state, pair, {f"{drive}.position": 0.6})
    assert wide.linear_error > 0.05
    assert any("the linear spread is off by" in each for each in wide.remarks)


def test_clearance_at_a_pin_adds_what_its_circle_does():
    """At the crosshead of an inline slider-crank the rod passes on what lies along it, over the cosine of its slope."""
    angle, r, l = 0.8, 0.5, 1.7  # noqa: E741
    state, pair, _, _ = crank_of(angle, r, l)
    slope = np.arcsin(r * sin(angle) / l)
    pin = next(each.name for each in state.mechanism.pairs if each.has_pin() and each.name not in state.inputs)
    band = planar.tolerance(state, pair, {"clearance": {pin: 3e-5}})
    assert band.worst == pytest.approx(3e-5 / cos(slope), rel=1e-9)
    assert band.std == pytest.approx(3e-5 / cos(slope) / sqrt(2.0), rel=1e-9)
    assert band.contribution == {f"clearance.{pin}": pytest.approx(1.0)}


def test_with_the_crank_in_line_every_pin_adds_its_whole_clearance():
    state, pair, _, _ = crank_of(angle=0.0)
    pins = [each.name for each in state.mechanism.pairs if each.has_pin()]
    told = {"clearance": {name: 1e-5 * (k + 1) for k, name in enumerate(pins)}}
    assert len(pins) == 3
    assert planar.tolerance(state, pair, told).worst == pytest.approx(6e-5, rel=1e-9)


def test_a_load_holds_a_pin_against_its_hole():
    from dataclasses import replace

    state, pair, _, _ = crank_of()
    pin = next(each for each in state.mechanism.pairs if each.has_pin() and each.name not in state.inputs)
    loaded = replace(state.mechanism, loads=(planar.Load(pair=pair, effort=-100.0),))
    free = planar.tolerance(state, pair, {"clearance": {pin.name: 3e-5}})
    held = planar.tolerance(planar.forces(planar.solve(loaded)), pair, {"clearance": {pin.name: 3e-5}})
    # the force on the slide is along the rod, and pushes it as far the way of the load as it can go
    assert held.mean == pytest.approx(-free.worst, rel=1e-9)
    assert held.std == pytest.approx(0.0, abs=1e-15)


def test_the_farthest_point_of_a_zonotope_is_its_farthest_corner():
    rng = np.random.default_rng(1)
    slopes, half = rng.normal(size=(3, 2, 6)), rng.uniform(0.1, 1.0, 6)
    spread = LinearSpread(slopes, -half, half, np.zeros((3, 2, 0, 2)), np.zeros((3, 0)), np.zeros((3, 2)), 3.0)
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 6)).reshape(6, -1)
    corners = np.linalg.norm(slopes @ (half[:, None] * signs), axis=1).max(axis=1)
    assert spread.farthest() == pytest.approx(corners, rel=1e-12)


def test_the_share_within_a_circle_is_that_of_its_closed_form():
    covariance = np.eye(2)[None] * 4.0
    found = NormalSpread(np.zeros((1, 2)), covariance).share_within(-3.0, 3.0)
    assert found[0] == pytest.approx(1.0 - np.exp(-9.0 / 8.0), abs=1e-6)


def test_hoeckens_line_is_as_crooked_by_its_tolerances_as_by_its_curve():
    motion = planar.cycle("hoeken-straight-line", 36, start=pi / 2, stop=1.5 * pi)
    band = planar.tolerance(motion, "P")
    assert 1e3 * band.upper[:, 1].max() == pytest.approx(0.97, abs=0.005)
    assert 1e3 * np.abs(band.nominal[:, 1] - 0.4).max() == pytest.approx(0.97, abs=0.005)


def test_strokes_time_ratios_and_dead_points_have_bands():
    r, l, e = 0.5, 1.7, 0.3  # noqa: E741
    motion = planar.cycle(slider_crank(r, l, e, velocity=3.0), 36)
    pair = next(name for name, each in motion.pairs.items() if "displacement" in each)
    values = planar.dimensions(motion.mechanism)
    crank = next(name for name, value in values.items() if name.endswith(".length") and abs(value - r) < 1e-9)
    far, near = sqrt((l + r) ** 2 - e**2), sqrt((l - r) ** 2 - e**2)
    band = planar.tolerance(motion, pair, {crank: 1e-3}, result="travel")
    assert band.nominal == pytest.approx(far - near)
    assert band.worst == pytest.approx(1e-3 * ((l + r) / far + (l - r) / near))
    assert planar.tolerance(motion, pair, {crank: 1e-3}, result="time_ratio").worst > 0.0
    four_bar = planar.cycle("four-bar", 24)
    dead = planar.tolerance(four_bar, "A", {"BC.length": 1e-4}, result="dead_points")
    assert dead.nominal.shape == dead.worst.shape == (2,)
    swing = planar.tolerance(planar.cycle(EXAMPLE, 24), "DC", result="travel")
    assert swing.kind == "angle"
    assert 0.0 < swing.std < swing.worst < pi


def test_a_mechanism_of_no_dyads_is_as_its_samples():
    mechanism = planar.load("double-butterfly")
    state = planar.solve(mechanism)
    point = [name for name in state.points if np.any(state.point(name).velocity)][-1]
    band = planar.tolerance(state, point, {"general": "ISO 2768-1 f"}, samples=4000)
    assert band.second_order.std[0] == pytest.approx(band.sampled.std[0], rel=0.05)


@pytest.mark.parametrize("statistical", [False, True])
def test_allowed_tolerances_reach_the_limit_and_lagranges_are_the_cheapest(statistical):
    state, pair, crank, rod = crank_of()
    given = {crank: 1e-4, rod: 2e-4}
    band = planar.tolerance(state, pair, given)
    found = allowance(band, 5e-4, statistical)

    def reach(told):
        spread = planar.tolerance(state, pair, told)
        return 3.0 * spread.std if statistical else spread.worst

    def cost(told):
        return sum(given[name] / told[name] for name in given)

    for told in (found.equal, found.least_cost, {name: found.factor * each for name, each in given.items()}):
        assert reach(told) == pytest.approx(5e-4, rel=1e-9)
    shares = planar.tolerance(state, pair, found.equal).contribution
    assert shares[crank] == pytest.approx(0.5)
    for part in (0.9, 1.1):
        other = found.least_cost | {crank: part * found.least_cost[crank]}
        scale = 5e-4 / reach(other)
        assert cost({name: scale * each for name, each in other.items()}) > cost(found.least_cost)


def test_the_command_tells_the_band_what_to_tighten_first_and_what_suffices(tmp_path):
    path = tmp_path / "example.json"
    path.write_text(json.dumps(read_example("tolerances")))
    course = ("--cycle", "--steps", "12", "--samples", "50", "--limit", "0.5mm")
    told = run(tmp_path, "tolerance", path.name, "--of", "E", *course).out
    assert told.index("BC.E.angle") < told.index("BC.E.distance")
    assert "of all mechanisms keep the limit at the worst position" in " ".join(told.split())
    found = json.loads(run(tmp_path, "tolerance", path.name, "--of", "E", "--allow", "E=0.4mm", "--json").out)
    assert found["worst"] == pytest.approx(planar.tolerance(planar.solve(EXAMPLE), "E").worst)
    assert found["allowed"]["limit"] == pytest.approx(4e-4)
    assert "write E=VALUE" in run(tmp_path, "tolerance", path.name, "--of", "E", "--allow", "C=1mm").err


def test_what_is_asked_amiss_is_refused_in_a_sentence():
    state = planar.solve("four-bar")
    with pytest.raises(BadInput, match="has no 'tolerances'"):
        planar.tolerance(state, "C")
    told = {"BC.length": 1e-4}
    with pytest.raises(Unknown, match="no point, link or pair 'X'"):
        planar.tolerance(state, "X", told)
    with pytest.raises(BadInput, match="no 'force'"):
        planar.tolerance(state, "C", told, result="force")
    with pytest.raises(BadInput, match="of a whole motion"):
        planar.tolerance(state, "C", told, result="travel")
    with pytest.raises(BadInput, match="normal and uniform"):
        planar.tolerance(state, "C", told, distribution="flat")
    with pytest.raises(BadInput, match="a whole number"):
        planar.tolerance(state, "C", told, samples=1)
    with pytest.raises(BadInput, match="plus and minus"):
        planar.tolerance(state, "C", told, limit=(1.0, 0.0))
    parallel = planar.solve("three-parallel-cranks")
    band = planar.tolerance(parallel, "C", {"crank B.length": 1e-4, "A0.position": 1e-3})
    assert any("crank B.length cannot change alone" in each for each in band.remarks)
