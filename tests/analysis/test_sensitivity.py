"""Derivatives of results in the numbers of a file: closed forms, differences, fifty digits, other routes."""

from __future__ import annotations

from dataclasses import replace
from math import acos, cos, pi, sin, sqrt
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import planar
from benchmarks.growth import linkage
from planar.derivatives import result_slopes
from planar.derivatives.kinematic_slopes import design_dimensions
from planar.document.dimensions import change_dimension, file_dimensions
from planar.document.revised.changed_numbers import with_values
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.equations.coordinates import FRAME_PARTS, frames_from_coordinates
from planar.equations.residuals import input_positions, pair_residuals
from planar.foundation.errors import BadInput, NoAnswer, Outcome, Unknown
from planar.model.link_shapes import link_shape
from planar.model.mechanism import relative_motions
from tests.builders import four_bar, slider_crank
from tests.draws import draws, first_cases, is_exhaustive
from tests.draws import part as sparse
from tests.known import MODELS, some_models, state_of
from tests.linkages import assembled, random_linkage
from tests.rubbing import rubbing_linkage

REFUSED_STEPS = (BadInput, NoAnswer)


def derives(mechanism):
    """Whether derivatives are told of it."""
    return mechanism.closes_within is None and all(pair.measures_symbols for pair in mechanism.pairs)


def results_of(value, name):
    """All that a state or forces tell of a name, by the names of the results."""
    state = value.moving if isinstance(value, planar.Forces) else value
    told = {}
    if name in state.points:
        told |= state.point(name)._asdict()
    elif name in state.links:
        told |= state.link(name)._asdict()
    if name in state.pairs:
        told |= state.pair(name)
    if isinstance(value, planar.Forces):
        if name in value.inputs:
            told |= {"effort": value.inputs[name], "power": value.powers[name]}
        if name in value.reactions:
            told |= {"force": value.reactions[name].force, "couple": value.reactions[name].couple}
        if name in value.friction:
            told["friction"] = value.friction[name].effort
    return told


def agree_with_differences(solve, mechanism, names, numbers, found):
    """Central differences, extrapolated once, agree with derivatives where the mechanism can be changed both ways."""
    size = max(float(np.ptp([p.position for p in planar.solve(mechanism).points.values()])), 1e-3)
    tried = 0
    for number in numbers:
        value = planar.dimensions(mechanism)[number]
        step = 2e-4 * max(abs(value), size)
        try:
            at = {k: solve(mechanism.with_values({number: value + k * step})) for k in (-2, -1, 1, 2)}
        except REFUSED_STEPS:
            continue
        for name in names:
            tables = {k: results_of(each, name) for k, each in at.items()}
            for result, slopes in found[name].slopes.items():
                if number in found[name].tied:
                    continue
                v = {k: np.asarray(each[result], dtype=float) for k, each in tables.items()}
                if found[name].kinds[result] == "angle":  # told within a turn
                    v = {k: v[1] + np.remainder(each - v[1] + pi, 2.0 * pi) - pi for k, each in v.items()}
                wide, near = (v[2] - v[-2]) / (4 * step), (v[1] - v[-1]) / (2 * step)
                exact = np.asarray(slopes[number])
                if not (np.isfinite(near).all() and np.isfinite(exact).all()):  # or at an angle of a load's course
                    continue
                # what halving the step changes tells how far the difference itself is off
                bound = np.max(np.abs(wide - near)) * 0.1 + 1e-11 * (np.max(np.abs(v[1])) + size) / step
                assert np.all(np.abs((4.0 * near - wide) / 3.0 - exact) <= bound), (name, result, number)
                tried += 1
    return tried


def some(names, count, seed):
    return [str(each) for each in np.random.default_rng(seed).permutation(list(names))[:count]]


@pytest.mark.parametrize("stem", [each for each in some_models(5) if derives(MODELS[each])])
def test_derivatives_of_all_that_a_state_and_its_forces_tell_are_those_of_differences(stem):
    mechanism = MODELS[stem]

    def solve(changed):
        return planar.forces(planar.solve(changed), friction=False)

    base, count = solve(mechanism), 2 if is_exhaustive() else 1
    state = base.moving
    names = dict.fromkeys(
        [*some(state.points, count, 1), *some(state.links, 1, 2), *some(state.pairs, count, 3), *state.inputs]
    )
    names = [name for name in names if name != mechanism.frame]
    found = {name: planar.sensitivity(base, name) for name in names}
    numbers = some(found[names[0]].slopes[next(iter(found[names[0]].slopes))], 2 * count + 1, 4)
    agree_with_differences(solve, mechanism, names, numbers, found)


def loaded(mechanism, rng):
    """The mechanism with masses on all links, weight, and a load at its first point."""
    links = [link for link in mechanism.links if link.names and link.name != mechanism.frame]
    masses = tuple(planar.Mass(link.name, float(rng.uniform(0.5, 4.0)), link.names[0], 0.1) for link in links)
    loads = (planar.Load(link=links[0].name, torque=10.0),)
    return replace(mechanism, masses=masses, loads=loads, gravity=(0.0, -9.81))


@settings(max_examples=draws(10), deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 8))
def test_derivatives_over_random_linkages_are_those_of_differences(seed, links):
    mechanism, _ = assembled(random_linkage(seed, links, 0.0, 0.3), 1e-2)
    rng = np.random.default_rng(seed)
    mechanism = loaded(mechanism, rng)

    def solve(changed):
        return planar.forces(planar.solve(changed))

    try:
        base = solve(mechanism)
    except NoAnswer:
        assume(False)
    names = [some(base.moving.points, 1, seed)[0], some(base.moving.pairs, 1, seed)[0], mechanism.inputs[0].pair]
    found = {name: planar.sensitivity(base, name) for name in dict.fromkeys(names)}
    numbers = some(next(iter(next(iter(found.values())).slopes.values())), 3, seed)
    agree_with_differences(solve, mechanism, list(found), numbers, found)


@pytest.mark.parametrize("seed", sparse(range(60), 12))
def test_derivatives_with_friction_are_those_of_differences(seed):
    mechanism = rubbing_linkage(seed, 0.3)

    def solve(changed):
        return planar.forces(planar.solve(changed))

    try:
        base = solve(mechanism)
    except NoAnswer:
        return
    if base.undetermined:
        return
    names = dict.fromkeys([*some(base.friction or base.moving.pairs, 2, seed), *base.inputs])
    found = {name: planar.sensitivity(base, name) for name in names}
    numbers = [name for name in planar.dimensions(mechanism) if name.endswith((".friction", ".efficiency"))]
    numbers = [*some(numbers, 2, seed), *some(next(iter(next(iter(found.values())).slopes.values())), 2, seed)]
    agree_with_differences(solve, mechanism, list(names), numbers, found)


def test_derivatives_of_the_screw_jack_with_friction_are_those_of_the_wedge():
    """The effort is W r tan(lead + friction angle)."""
    found = planar.forces(planar.solve("screw-jack"))
    slopes = planar.sensitivity(found, "turn").effort
    angle = np.arctan(8.0 / (40.0 * pi)) + np.arctan(0.12)
    by_angle = found.inputs["turn"] / np.tan(angle) / np.cos(angle) ** 2
    assert slopes["flank.friction"] == pytest.approx(by_angle / (1.0 + 0.12**2), rel=1e-9)


# closed forms


@settings(max_examples=draws(30))
@given(st.floats(0.2, 6.0), st.floats(-0.3, 0.3))
def test_a_slider_cranks_derivatives_are_those_of_its_closed_form(angle, offset):
    r, l = 0.5, 1.7  # noqa: E741
    state = planar.solve(slider_crank(r, l, offset, position=angle, velocity=3.0))
    pair = next(name for name, each in state.pairs.items() if "displacement" in each)
    found = planar.sensitivity(state, pair)
    values = planar.dimensions(state.mechanism)
    lengths = {round(values[name], 9): name for name in found.dimensions if name.endswith(".length")}
    root = sqrt(l**2 - (r * sin(angle) - offset) ** 2)
    y = r * sin(angle) - offset
    assert found.displacement[lengths[r]] == pytest.approx(cos(angle) - y * sin(angle) / root, abs=1e-12)
    assert found.displacement[lengths[l]] == pytest.approx(l / root, abs=1e-12)
    # v = -3 r (sin + y cos / root)
    by_rod = 3.0 * r * y * cos(angle) * l / root**3
    assert found.velocity[lengths[l]] == pytest.approx(by_rod, abs=1e-11)
    twice = found.second("displacement")[lengths[l]][lengths[l]]
    assert twice == pytest.approx(1.0 / root - l**2 / root**3, abs=1e-11)


def test_the_stroke_of_an_offset_slider_crank_and_its_time_ratio_move_as_their_closed_forms():
    r, l, e = 0.5, 1.7, 0.3  # noqa: E741
    motion = planar.cycle(slider_crank(r, l, e, velocity=3.0), 36)
    pair = next(name for name, each in motion.pairs.items() if "displacement" in each)
    found = planar.sensitivity(motion, pair)
    values = planar.dimensions(motion.mechanism)
    name = {round(values[each], 9): each for each in found.dimensions if each.endswith(".length")}
    far, near = sqrt((l + r) ** 2 - e**2), sqrt((l - r) ** 2 - e**2)
    travel = found.travel
    assert travel.travel == pytest.approx(far - near, rel=1e-12)
    assert travel.travel_slopes[name[r]] == pytest.approx((l + r) / far + (l - r) / near, rel=1e-10)
    assert travel.travel_slopes[name[l]] == pytest.approx((l + r) / far - (l - r) / near, rel=1e-10)
    # between the dead centres the crank turns by pi + c and pi - c
    c = acos(e / (l + r)) - acos(e / (l - r))
    by_rod = (e / (l + r) ** 2) / sqrt(1 - (e / (l + r)) ** 2) - (e / (l - r) ** 2) / sqrt(1 - (e / (l - r)) ** 2)
    assert travel.time_ratio == pytest.approx((pi + c) / (pi - c), rel=1e-10)
    assert travel.time_ratio_slopes[name[l]] == pytest.approx(2 * pi * by_rod / (pi - c) ** 2, rel=1e-8)


def test_dead_points_move_as_the_law_of_cosines_says():
    motion = planar.cycle("four-bar", 24)
    values = planar.dimensions(motion.mechanism)
    a, b, c = (values[f"{link}.length"] for link in ("AB", "BC", "DC"))
    found = planar.sensitivity(motion, "A").dead_points
    assert len(found) == 2
    d = values["AD.D.x"] - values["AD.A.x"]
    for dead in found:
        assert cos(dead.input) == pytest.approx((a**2 + d**2 - (b + c) ** 2) / (2 * a * d), abs=1e-12)
        by_coupler = (b + c) / (a * d) / sin(dead.input)
        assert dead.input_slopes["BC.length"] == pytest.approx(by_coupler, rel=1e-9)
        by_crank = -(1.0 / d - cos(dead.input) / a) / sin(dead.input)
        assert dead.input_slopes["AB.length"] == pytest.approx(by_crank, rel=1e-9)


@settings(max_examples=draws(30))
@given(st.floats(0.1, 6.2))
def test_the_transmission_angle_of_a_four_bar_changes_as_the_law_of_cosines_says(angle):
    a, b, c, d = 0.3, 0.8, 0.7, 1.0
    state = planar.solve(four_bar(a, b, c, d, angle))
    values = planar.dimensions(state.mechanism)
    name = {round(values[each], 9): each for each in values if each.endswith(".length")}
    fixed = [pair.name for pair in state.mechanism.pairs if state.mechanism.frame in pair.links]
    (out,) = (name for name in fixed if name not in state.inputs)
    found = planar.sensitivity(state, out).transmission
    cosine = (b**2 + c**2 - a**2 - d**2 + 2.0 * a * d * cos(angle)) / (2.0 * b * c)
    sense = 1.0 if cosine > 0.0 else -1.0
    assert found.angle == pytest.approx(acos(abs(cosine)), abs=1e-10)
    assume(abs(cosine) > 1e-3)
    by_crank = -sense * (2.0 * d * cos(angle) - 2.0 * a) / (2.0 * b * c) / sqrt(1.0 - cosine**2)
    assert found.slopes[name[a]] == pytest.approx(by_crank, abs=1e-9)


# other routes


@pytest.mark.parametrize("stem", ["watt-six-bar", "whitworth", "two-stroke-engine", "gear-reducer"])
def test_the_gradient_is_the_weighed_sum_of_derivatives(stem):
    motion = planar.cycle(MODELS[stem], 24)
    for result in (motion, planar.forces(motion)):
        rng, name = np.random.default_rng(3), MODELS[stem].inputs[0].pair
        other = next(each for each in motion.pairs if each != name)
        slopes = {each: planar.sensitivity(result, each).slopes for each in (name, other)}
        weights = {
            each: {key: rng.normal(size=np.shape(next(iter(own.values())))) for key, own in of.items()}
            for each, of in slopes.items()
        }
        found = planar.gradient(result, weights)
        for number, slope in found.items():
            whole = (
                sum(
                    float(np.sum(numbers * slopes[each][key][number]))
                    for each, of in weights.items()
                    for key, numbers in of.items()
                )
                if number in ("O.position", next(iter(found)))
                else None
            )
            if whole is not None and np.isfinite(slope):
                assert slope == pytest.approx(whole, rel=1e-9, abs=1e-9)


def test_second_derivatives_are_symmetric_and_those_of_first_ones():
    mechanism = MODELS["double-butterfly"]
    state = planar.solve(mechanism)
    point = [name for name in state.points if np.any(state.point(name).velocity)][-1]
    found = planar.sensitivity(state, point)
    second = found.second("position")
    numbers = [name for name in found.dimensions if name.endswith(".length")][: 3 if is_exhaustive() else 2]
    for one in numbers:
        value = planar.dimensions(mechanism)[one]
        step = 1e-5 * value
        beside = [planar.solve(mechanism.with_values({one: value + k * step})) for k in (-1, 1)]
        ends = [planar.sensitivity(each, point) for each in beside]
        for other in numbers:
            assert second[one][other] == pytest.approx(second[other][one], rel=1e-9, abs=1e-9)
            near = (ends[1].position[other] - ends[0].position[other]) / (2.0 * step)
            assert second[one][other] == pytest.approx(near, rel=1e-6, abs=1e-6 * np.abs(near).max())


def fifty_digit_frames(mechanism, state, arb, changed):
    """The frames of all links to fifty digits: Newton's method on the pairs' own residuals, each step with the Jacobian
    of doubles, which wins ten digits."""
    work = LagrangianFunctions(mechanism)
    motions = relative_motions(changed)
    inputs = [motions[given.pair] for given in mechanism.inputs]
    q = work.coordinates(state)[0][0]
    rows = ca.vertcat(work.residuals, work.input_positions)
    inverse = np.linalg.pinv(np.array(ca.Function("slopes", [work.q], [ca.jacobian(rows, work.q)])(q)))
    shapes = {link.name: link_shape(link) for link in changed.links}
    numbers = {
        pair.name: pair.measure([shapes[link] for link in pair.bodies]) for pair in (*changed.pairs, *motions.values())
    }
    columns = {(link, part): at + k for link, at in work.link_columns.items() for k, part in enumerate(FRAME_PARTS)}
    for pair in mechanism.pairs:
        first = work.own_slices[pair.name].start
        columns |= {(pair.name, part): first + k for k, (part, _) in enumerate(pair.coordinate_kinds)}
    pairs, links = {pair.name: pair for pair in mechanism.pairs}, [link.name for link in mechanism.links]
    place: list[Any] = [arb(value) for value in q]
    for _ in range(6):
        frames, own = frames_from_coordinates(place, columns, links, pairs)
        left = [value for _, value in pair_residuals(changed.pairs, frames, numbers, own)]
        left += [
            at - given.position
            for at, given in zip(input_positions(inputs, frames, numbers, own), mechanism.inputs, strict=True)
        ]
        place = [
            each - sum((arb(float(inverse[k, j])) * left[j] for j in range(len(left))), arb(0))
            for k, each in enumerate(place)
        ]
        place = [arb(each.mid()) for each in place]
    frames, _ = frames_from_coordinates(place, columns, links, pairs)
    return frames, shapes


@pytest.mark.parametrize("stem", ["whitworth", "double-butterfly", "watt-six-bar", "000-P2", "rack-differential"])
def test_derivatives_agree_with_differences_of_fifty_digits_to_a_part_in_a_thousand_million(stem):
    flint = pytest.importorskip("flint")
    digits, flint.ctx.dps = flint.ctx.dps, 60
    try:
        mechanism = MODELS[stem]
        given = mechanism.inputs[0]
        for turn in first_cases(range(6), 2):
            there = given.position + turn * (0.002 if stem == "rack-differential" else 0.1)
            at = replace(mechanism, inputs=(given._replace(position=there), *mechanism.inputs[1:]), published=())
            state = planar.solve(at)
            point = [name for name in state.points if np.any(state.point(name).velocity)][-1]
            found = planar.sensitivity(state, point)
            number = some([each for each in found.dimensions if each.endswith((".length", ".x"))], 1, turn)[0]
            step, places = flint.arb("1e-15"), []
            for way in (-1, 1):
                exact = flint.arb(planar.dimensions(at)[number]) + way * step
                changed = change_dimension(at, file_dimensions(at)[number], exact)
                frames, shapes = fifty_digit_frames(at, state, flint.arb, changed)
                link, own = state._point_names[point].members[0]
                places.append(frames[link].to_world(shapes[link].position(own)))
            slope = [float((b - a) / (2 * step)) for a, b in zip(*places, strict=True)]
            assert found.position[number] == pytest.approx(slope, rel=1e-9, abs=1e-9 * max(map(abs, slope)) + 1e-12)
    finally:
        flint.ctx.dps = digits


# what has no derivative


def test_numbers_that_cannot_change_alone_are_named_and_have_none():
    found = planar.sensitivity(state_of("three-parallel-cranks"), "C")
    assert "crank B.length" in found.tied
    assert np.isnan(found.position["crank B.length"]).all()
    assert np.isfinite(found.position["A0.position"]).all()
    wheels = planar.sensitivity(state_of("planetary-gear-set"), "arm")
    assert {"arm.length", "inner mesh.radii.0"} <= {*wheels.tied}
    rack = planar.sensitivity(state_of("rack-steering"), "travel")
    assert {"frame.O.y", "mesh.radius"} <= {*rack.tied}


@pytest.mark.parametrize("stem", ["planetary-gear-set", "three-parallel-cranks"])
def test_numbers_that_cannot_change_alone_are_found_by_few_checks_of_the_file(stem, monkeypatch):
    mechanism, checks = replace(MODELS[stem], published=()), []

    def counted(mechanism, values):
        checks.append(values)
        return with_values(mechanism, values)

    def is_refused(name, factor):
        try:
            with_values(mechanism, {name: factor * planar.dimensions(mechanism)[name]})
        except BadInput:
            return True
        return False

    monkeypatch.setattr(result_slopes, "with_values", counted)
    found = result_slopes.tied_dimensions(mechanism)
    names = [each.name for each in design_dimensions(mechanism) if each.path[0] in ("links", "pairs")]
    tried = [name for name in names if planar.dimensions(mechanism)[name]]
    assert [name for name in found if name in tried] == [
        name for name in tried if is_refused(name, 1.001) and is_refused(name, 0.999)
    ]
    assert len(checks) < 2 + 4 * len(found) * np.log2(len(names))


def test_at_a_dead_point_there_are_none():
    motion = planar.cycle("four-bar", 24)
    found = planar.sensitivity(motion, "C")
    assert found.singular_rows == (0, 24)
    assert np.isnan(found.position["BC.length"][[0, 24]]).all()
    assert np.isfinite(found.position["BC.length"][1:24]).all()
    with pytest.raises(NoAnswer) as problem:
        planar.gradient(motion, {"C": np.ones((25, 2))})
    assert problem.value.outcome is Outcome.DEAD_POINT
    weights = np.ones((25, 2))
    weights[[0, 24]] = 0.0
    assert np.isfinite(list(planar.gradient(motion, {"C": weights}).values())).all()


@pytest.mark.parametrize(
    ("stem", "name", "rows"), [("coupled-wheels", "rod", (4, 10)), ("elliptical-trammel", "Q", (0, 12))]
)
def test_change_points_and_dead_points_of_all_structures_have_none(stem, name, rows):
    """With all cranks in line the wheels could turn against each other; a slide of the trammel turns back at an end."""
    motion = planar.cycle(stem, 12)
    found = planar.sensitivity(motion, name)
    assert found.singular_rows == rows
    for slopes in found.slopes.values():
        free = [slope for number, slope in slopes.items() if number not in found.tied]
        assert np.isnan([slope[list(rows)] for slope in free]).all()
        assert np.isfinite([np.delete(slope, rows, axis=0) for slope in free]).all()


def test_a_long_row_is_derived_by_sparse_factors_as_its_first_links_are_alone():
    long, short = (planar.from_dict(linkage("rows of four-bars", count)) for count in (60, 4))
    name = next(point for point in planar.solve(short).points if np.any(planar.solve(short).point(point).velocity))
    slopes = [planar.sensitivity(planar.solve(each), name).position for each in (long, short)]
    assert len(long.links) > 40
    for number, slope in slopes[1].items():
        np.testing.assert_allclose(slopes[0][number], slope, rtol=1e-9, atol=1e-12)


def test_a_time_ratio_of_one_has_none():
    travel = planar.sensitivity(planar.cycle("slider-crank", 24), "stroke").travel
    assert travel.time_ratio == pytest.approx(1.0)
    assert travel.time_ratio_slopes is None


def test_what_is_asked_amiss_is_refused_in_a_sentence():
    state = state_of("four-bar")
    with pytest.raises(Unknown, match="no point, link or pair 'X'"):
        planar.sensitivity(state, "X")
    with pytest.raises(AttributeError, match="no 'force'"):
        planar.sensitivity(state, "C").force  # noqa: B018
    with pytest.raises(BadInput, match="shape"):
        planar.gradient(state, {"C": [1.0, 2.0, 3.0]})
    with pytest.raises(BadInput, match="name what is weighed"):
        planar.gradient(state, {})
    with pytest.raises(BadInput, match="cam of given points"):
        planar.sensitivity(state_of("measured-cam"), "P")
    with pytest.raises(BadInput, match="within a misfit"):
        planar.sensitivity(state_of("double-parallelogram"), "A")
