"""Designs whose pairs have stops: in lanes as by themselves, and where closed forms say."""

from dataclasses import replace

import numpy as np
import pytest

import planar
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.general_path import OUTCOMES, DesignRun
from planar.batch.reference_design import reference_design
from planar.document.dimensions import link_lengths
from planar.model.mechanism import relative_motions
from planar.model.stops import Stops
from tests.builders import four_bar
from tests.draws import first_cases
from tests.known import MODELS

DEG = np.pi / 180.0
STOP = OUTCOMES.index(planar.Outcome.STOP)
CRANK, COUPLER, ROCKER, GROUND = 0.3, 0.9, 0.7, 1.0


def agrees_with_general_path(mechanism, designs, steps, pair=None, start=None, stop=None, **more):
    """A sweep, whose every status, number and end is what the general path says of the design."""
    swept = planar.sweep(mechanism, designs, steps, pair=pair, start=start, stop=stop, **more)
    base = reference_design(replace(mechanism, inputs=tuple(g._replace(law=None) for g in mechanism.inputs)), pair)
    for index in range(len(swept)):
        own = with_design_values(base.mechanism, values_of_design(designs, index))
        row = np.broadcast_to(swept.input, swept.status.shape)[index]
        grid = None if base.is_sliding and stop is None else row
        alone = DesignRun(own, base.pair, grid, steps, start=start).solve(swept.points, True)
        assert alone.status.tolist() == swept.status[index].tolist(), (index, str(alone.message))
        found = np.hstack([o[n][index] for o in (swept.position, swept.velocity) for n in swept.points])
        wanted = alone.out[:, : found.shape[1]]
        scale = np.nanmax(np.abs(wanted), axis=0, initial=base.unit)
        np.testing.assert_allclose(found / scale, wanted / scale, rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(swept.dead_point[index], alone.dead_point, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(swept.stop_position[index], alone.stop_position, rtol=0.0, atol=1e-9)
    return swept


def with_stops(name, *stops):
    return replace(MODELS[name], stops=tuple(Stops(*each) for each in stops))


def designs_around(mechanism, spread, many, seed=1):
    """Lengths of all links, each times a number near to one."""
    rng = np.random.default_rng(seed)
    lengths = link_lengths(mechanism, frozenset(link.name for link in mechanism.links))
    return {each.name: each.value * np.exp(spread * rng.uniform(-1.0, 1.0, many)) for each in lengths if each.value}


@pytest.mark.parametrize("ends", [(60.0, 110.0), (None, 110.0)])
def test_a_rocker_meets_its_stop_where_two_circles_say(ends):
    rng, many = np.random.default_rng(3), 40
    a, b, c = (length * np.exp(0.05 * rng.uniform(-1.0, 1.0, many)) for length in (CRANK, COUPLER, ROCKER))
    low, high = (None if end is None else end * DEG for end in ends)
    mechanism = replace(four_bar(CRANK, COUPLER, ROCKER, GROUND, 0.8), stops=(Stops("D", low, high),))
    designs = {"AB.length": a, "BC.length": b, "DC.length": c}
    swept = planar.sweep(mechanism, designs, 90, "C")
    assert swept.general == 0
    ended = swept.status[:, -1] == STOP
    assert ended.sum() > 20
    # C at a stop is known, and so is how far it is from A: the law of cosines
    gaps = []
    for angle in (end for end in (low, high) if end is not None):
        at = np.array([GROUND, 0.0]) + c[:, None] * np.array([np.cos(angle), np.sin(angle)])
        far, way = np.hypot(*at.T), np.arctan2(at[:, 1], at[:, 0])
        cosine = (a**2 + far**2 - b**2) / (2.0 * a * far)
        swing = np.arccos(np.clip(cosine, -1.0, 1.0))
        gaps += [np.abs(np.angle(np.exp(1j * (swept.stop_position - way - side * swing)))) for side in (1, -1)]
    assert np.all(np.min(gaps, axis=0)[ended] < 1e-10)


@pytest.mark.parametrize(
    ("name", "stops", "pair", "start", "stop"),
    first_cases(
        [
            ("crank-rocker", [("A0", -1.0, 8.0)], "A0", 0.5, -9.0),  # more than a turn
            ("slider-crank", [("slide", 0.0, 0.14)], None, 1.0, -4.0),
            ("double-butterfly", [], None, None, None),  # no closed form
            ("geared-five-bar", [], None, None, None),  # angles that count turns
            ("four-bar", [("D", None, 1.9), ("B", -2.0, None)], None, None, None),
            ("watt-six-bar", [], None, None, None),
            ("elliptical-trammel", [], None, None, None),
        ],
        4,
    ),
)
def test_designs_with_stops_are_what_the_general_path_finds(name, stops, pair, start, stop):
    mechanism = MODELS[name]
    motions = relative_motions(mechanism)
    if not stops or stops[0][0] not in motions:
        stops = [(each, at - 0.2, at + 0.25) for each, at in positions(mechanism)]
    mechanism = replace(mechanism, stops=tuple(Stops(*each) for each in stops))
    agrees_with_general_path(mechanism, designs_around(mechanism, 0.01, 4), 48, pair, start, stop)


def positions(mechanism):
    """Two pairs that are no inputs, and where they are."""
    state, inputs = planar.solve(mechanism), {given.pair for given in mechanism.inputs}
    names = [name for name in relative_motions(mechanism) if name not in inputs]
    return [(name, next(iter(state.pair(name).values()))) for name in names[-2:]]


def test_mechanisms_of_one_list_end_at_their_stops():
    base = planar.load("four-bar")
    cases = [
        replace(base, stops=(Stops("D", low, high),))
        for low, high in ((1.0, 1.9), (None, 1.8), (1.72, 3.0), (2.0, 3.0), (-4.0, 1.5))
    ]
    found = planar.sweep_each(cases, 72)
    for mechanism, each in zip(cases, found, strict=True):
        alone = DesignRun(mechanism, "A", np.asarray(each.input), 72).solve(("C",), False)
        np.testing.assert_array_equal(each.status, alone.status)
        np.testing.assert_allclose(each.position["C"], alone.out, atol=1e-12)
    assert not all(each.general for each in found)
    assert "pair 'D' meets its upper stop at 108.862 deg, at an input of" in found[0].reason


def test_the_input_ends_at_its_own_stop_and_a_range_up_to_it_is_whole():
    base = MODELS["crank-rocker"]
    mechanism = replace(base, stops=(Stops("A0", 0.2, 2.0),))
    designs = designs_around(mechanism, 0.02, 6)
    whole = agrees_with_general_path(mechanism, designs, 30, start=0.2, stop=2.0)
    assert whole.general == 0
    assert whole.whole.all()
    back = agrees_with_general_path(mechanism, designs, 30, start=2.0, stop=-1.0)
    assert back.general == 0
    np.testing.assert_allclose(back.stop_position, 0.2, atol=1e-12)
    outside = agrees_with_general_path(replace(base, stops=(Stops("A0", -3.0, -1.0),)), designs, 30)
    assert outside.general == 0
    assert np.all(np.asarray(outside.status) == STOP)


def test_prepared_runs_end_at_stops_in_their_compiled_code(monkeypatch):
    base = four_bar(CRANK, COUPLER, ROCKER, GROUND, 0.8)
    for stops, ends in (((Stops("D", 0.2, 1.9),), True), ((Stops("D", 0.2, 3.0),), False)):
        mechanism = replace(base, stops=stops)
        ready = planar.prepared(mechanism, 90, "C")
        with monkeypatch.context() as alone:
            alone.setattr(type(ready), "_run_as_sweep", lambda *_: pytest.fail("it went through a sweep"))
            found = [ready({"AB.length": length}) for length in (0.28, 0.3, 0.33)]
        swept = planar.sweep(mechanism, {"AB.length": [0.28, 0.3, 0.33]}, 90, "C")
        for k, each in enumerate(found):
            np.testing.assert_array_equal(each.status, swept.status[k])
            np.testing.assert_allclose(each.position["C"], swept.position["C"][k], atol=1e-12)
            assert bool(each.status[-1] == STOP) is ends
