"""Cognates trace the same path: by the coupler curve's own equation, along whole motions, and by Roberts' relations."""

import json
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import planar
from planar.drawing.diagrams.cognate_drawing import cognate_pictures
from planar.model.mechanism import Drive
from planar.synthesis.cognates.cognates import first_cognates, task_cognates
from tests.command import run
from tests.draws import draws


def four_bar(a, b, c, d, x, y, position=1.0):
    """A four-bar on A (0, 0) and D (d, 0) with the point E of its coupler, in m."""
    return {
        "planar": 1,
        "name": "bars",
        "frame": "AD",
        "links": {
            "AD": {"points": {"A": [0, 0], "D": [d, 0]}},
            "AB": {"ends": ["A", "B"], "length": a},
            "BC": {"ends": ["B", "C"], "length": b, "points": {"E": [x, y]}},
            "DC": {"ends": ["D", "C"], "length": c},
        },
        "pairs": [{"turning": each} for each in "ABCD"],
        "inputs": [{"pair": "A", "position": position, "velocity": 2.0, "acceleration": -0.5}],
        "sketch": {"C": [d, c]},
    }


def curve_equation(z, a, b, c, d, e):
    """The tricircular sextic of a coupler curve, 0 on it; e is the point of the coupler over its length (complex)."""
    u, v = e * b, (1.0 - e) * b
    one, other = abs(z) ** 2 + abs(u) ** 2 - a**2, abs(z - d) ** 2 + abs(v) ** 2 - c**2
    p, q = -np.conj(z) * u, np.conj(z - d) * v
    return abs(other * np.conj(p) - one * np.conj(q)) ** 2 - abs(p * np.conj(q) - np.conj(p) * q) ** 2


def off_curve(z, *bars):
    """How far places are off a coupler curve, to the first order."""
    h = 1e-5
    slope = [(curve_equation(z + s * h, *bars) - curve_equation(z - s * h, *bars)) / (2 * h) for s in (1.0, 1.0j)]
    return np.abs(curve_equation(z, *bars)) / np.hypot(*slope)


def places(mechanism, point, steps=24, **more):
    """The places of a point over a motion, as complex numbers."""
    return planar.cycle(mechanism, steps, **more).point(point).position @ np.array([1.0, 1.0j])


def pivots(mechanism):
    """The places of the fixed pins."""
    state = planar.solve(mechanism)
    names = {
        pair.entry_name() for pair in mechanism.pairs if mechanism.frame in pair.links and pair.coincident_points()
    }
    return sorted(tuple(np.round(state.point(name).position, 9)) for name in names)


bars = st.tuples(*[st.floats(0.4, 2.5)] * 4, st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))


@settings(max_examples=draws(16))
@given(bars)
def test_of_random_four_bars_all_three_trace_one_curve(sizes):
    a, b, c, d, x, y = sizes
    e = complex(x, y) / b
    assume(abs(e) > 0.1 and abs(1.0 - e) > 0.1)
    sums = [a + b - c - d, a + c - b - d, a + d - b - c]
    assume(min(map(abs, sums)) > 0.1)
    try:
        mechanism = planar.from_dict(four_bar(*sizes))
        path = places(mechanism, "E")
    except planar.NoAnswer:
        assume(False)
    found = planar.cognates(mechanism, "E")
    assert len(found) == 3
    assert len(found.timed) == 1
    size = max(abs(path[:, None] - path[None]).max(), a, b, c, d)
    for each in found:
        other = places(each.mechanism, each.point)
        assert np.median(off_curve(other, a, b, c, d, e)) < 1e-10 * size
        assert off_curve(other, a, b, c, d, e).max() < 1e-6 * size  # near a double point the first order is rough
        assert not each.is_timed or np.abs(other - path).max() < 1e-9 * size
        state, own = planar.solve(each.mechanism).point(each.point), planar.solve(mechanism).point("E")
        assert np.allclose(state.position, own.position, rtol=0.0, atol=1e-12 * size)
        assert np.allclose(state.velocity, own.velocity, rtol=1e-6, atol=1e-8 * size)


def test_roberts_relations():
    a, b, c, d, x, y = 1.0, 2.4, 2.1, 2.7, 1.1, 0.9
    e = complex(x, y) / b
    _, timed, other = planar.cognates(planar.from_dict(four_bar(a, b, c, d, x, y)), "E")
    g = d * e  # the triangle of the fixed pivots is like that of the coupler
    near = {"rel": 1e-12, "abs": 1e-12}
    for each in (timed, other):
        at = planar.solve(each.mechanism).point("G").position
        assert complex(*at) == pytest.approx(g, **near)
    sizes = planar.dimensions(timed.mechanism)
    assert timed.inputs[0].driven == "G"
    found = [sizes["GB1.length"], sizes["B1C1.length"], sizes["DC1.length"]]
    assert found == pytest.approx([abs(1 - e) * each for each in (a, c, b)], **near)
    sizes = planar.dimensions(other.mechanism)
    found = [sizes["AB2.length"], sizes["B2C2.length"], sizes["GC2.length"]]
    assert found == pytest.approx([abs(e) * each for each in (b, a, c)], **near)
    # the timed one turns with the crank, by the constant angle of 1 - e
    turned = planar.solve(timed.mechanism).link("GB1").angle - 1.0
    assert np.exp(1j * turned) == pytest.approx((1 - e) / abs(1 - e), **near)
    assert timed.mechanism.inputs[0].velocity == 2.0
    assert timed.mechanism.inputs[0].acceleration == -0.5


@pytest.mark.parametrize(
    ("model", "point"), [("hoeken-straight-line", "P"), ("slider-crank", "E"), ("klann-leg", "foot")]
)
def test_the_cognates_of_a_cognate_are_the_same(model, point):
    found = planar.cognates(model, point)
    whole = sorted(pivots(each.mechanism) for each in found)
    for each in found[1:4]:
        again = planar.cognates(each.mechanism, each.point)
        assert sorted(pivots(one.mechanism) for one in again) == whole


TIMED = {
    ("klann-leg", "foot"): 6,
    ("klann-leg", "C"): 2,
    ("atkinson-cycle-engine", "C"): 3,
    ("sewing-machine", "eyelet"): 2,
    ("stephenson-3-five-bar", "A"): 3,
    ("stephenson-2-six-bar", "A"): 12,
    ("double-wishbone", "contact"): 3,
}


@pytest.mark.parametrize(("model", "point"), TIMED)
def test_timed_cognates_go_with_the_mechanism(model, point):
    found = planar.cognates(model, point)
    assert len(found) == TIMED[model, point]
    path = places(found.mechanism, found.point, 12)
    assert found.timed
    for each in found.timed[:4]:
        other = places(each.mechanism, each.point, 12)
        assert np.abs(other - path).max() < 1e-9 * np.ptp(np.abs(path - path[0]))


@pytest.mark.parametrize(
    ("model", "point"),
    [("000-P4", "B"), ("002-E3.2", "E"), ("klann-leg", "K"), ("hand-pump", "H"), ("scott-russell", "C")],
)
@pytest.mark.parametrize("further", [0.4, 1.3])
def test_every_cognate_moves_as_the_mechanism_does_wherever_it_stands(model, point, further):
    mechanism = planar.load(model)
    first = mechanism.inputs[0]
    state = planar.solve(mechanism, [Drive(first.pair, first.position + further, first.velocity or 1.0)])
    here = tuple((name, *map(float, each.position)) for name, each in state.points.items())
    moved = replace(state.mechanism, sketch=here)
    found = planar.cognates(moved, point)
    own = planar.solve(moved).point(point)
    assert len(found) > 1
    for each in found[1:]:
        other = planar.solve(each.mechanism).point(each.point)
        assert np.allclose(other.velocity, own.velocity, rtol=0.0, atol=1e-9 * np.hypot(*own.velocity))
        assert np.allclose(other.acceleration, own.acceleration, rtol=0.0, atol=1e-7 * np.hypot(*own.acceleration))


def test_a_slider_crank_has_one_other():
    mechanism = planar.load("slider-crank").with_values({"crank.length": 0.3, "rod.length": 0.9})
    found = planar.cognates(mechanism, "E")
    assert [len(found), len(found.timed)] == [2, 0]
    assert found[1].inputs[0].turns_back
    a, b, e = 0.3, 0.9, -0.5  # E on the rod, 450 mm behind A
    sizes = planar.dimensions(found[1].mechanism)
    assert sizes["crank.length"] == pytest.approx(abs(e) * b)
    assert sizes["rod.length"] == pytest.approx(abs(e) * a)
    z = places(found[1].mechanism, "E", 360, circuit=True)
    along = (abs(z) ** 2 + a**2 - (e * b) ** 2) / (2.0 * abs(z))  # where circles about O and E meet
    above = np.sqrt(np.maximum(a**2 - along**2, 0.0))
    ends = [pin + (z - pin) / e for pin in (z / abs(z) * (along + 1j * s * above) for s in (1.0, -1.0))]
    assert len(z) > 300
    assert np.min([abs(end.imag) for end in ends], axis=0).max() < 1e-9


def test_driven_at_its_slide_the_cognate_of_a_slider_crank_is_timed():
    value = planar.to_dict("slider-crank") | {"inputs": [{"pair": "stroke", "position": 1700, "velocity": -100}]}
    value["sketch"] = {"A": [300, 300]}
    mechanism = planar.from_dict(value)
    found = planar.cognates(mechanism, "E")
    (other,) = found.timed
    assert other.inputs[0].driven == "stroke"
    assert other.inputs[0].scale == pytest.approx(450 / 1600)
    path, same = places(mechanism, "E", 20), places(other.mechanism, "E", 20)
    assert min(np.abs(same - path).max(), np.abs(same[::-1] - path).max()) < 1e-9
    assert "0.28125 times as fast" in other.sentence


def test_of_two_inputs_both_are_kept_where_they_can_be():
    value = four_bar(1.0, 2.0, 1.2, 3.0, 0.8, 0.7)
    value["links"] |= {"CF": {"ends": ["C", "F"], "length": 1.6}, "DC": {"ends": ["D", "F"], "length": 1.2}}
    value["pairs"] = [{"turning": each} for each in "ABCDF"]
    value["inputs"].append({"pair": "D", "position": 1.3, "velocity": -1.0})
    value["sketch"] = {"C": [2.0, 2.0]}
    found = planar.cognates(planar.from_dict(value), "E")
    own = planar.solve(found.mechanism).point("E")
    for each in found[1:]:
        other = planar.solve(each.mechanism).point(each.point)
        assert np.allclose(other.position, own.position, rtol=0.0, atol=1e-12)
        assert np.allclose(other.velocity, own.velocity, rtol=0.0, atol=1e-12)
    assert [one.is_timed for one in found[1].inputs] == [False, True]


def test_what_acts_on_links_that_stay_goes_along():
    value = planar.to_dict("klann-leg")
    value |= {
        "masses": [{"link": "leg", "mass": 1, "at": "foot"}, {"link": "crank", "mass": 2, "at": "C"}],
        "loads": [{"point": "foot", "force": [0, 5]}, {"point": "E", "force": [0, 5]}],
    }
    first = planar.cognates(planar.from_dict(value), "foot")[1].mechanism
    assert [each.link for each in first.masses] == ["leg"]
    assert [each.point for each in first.loads] == ["foot"]
    assert "loads, masses" in first.notes[1]
    assert planar.load("klann-leg").links[2:4] != first.links[2:4]


def test_of_a_task_those_cognates_count_that_keep_its_timing():
    mechanism = planar.load("hoeken-straight-line")
    value = {"planar": 1, "units": {"length": "mm", "angle": "deg"}, "start": "hoeken-straight-line"}
    path = {"point": "P", "through": [[0, 400], [100, 400]]}
    timed = path | {"through": [{"at": at, "input": 10 * k} for k, at in enumerate(path["through"])]}
    poses = {"link": "coupler", "poses": [{"at": [0, 0], "angle": 0}]}
    driven = [
        [each.inputs[0].driven for each in task_cognates(mechanism, planar.read_task(value | {"wanted": wanted}))]
        for wanted in ([path], [timed], [path, poses], [path | {"point": "A"}])
    ]
    assert driven == [["G", "O"], ["G"], [], []]


def test_laws_of_inputs_that_keep_the_timing_stay():
    value = four_bar(1.0, 2.4, 2.1, 2.7, 1.1, 0.9)
    value["inputs"] = [{"pair": "A", "position": 1.0, "law": [{"motion": "cycloidal", "by": 1.5, "in": 2.0}]}]
    found = planar.cognates(planar.from_dict(value), "E")
    timed = found.timed[0]
    paths = [places(each, "E", 10, duration=2.0) for each in (found.mechanism, timed.mechanism)]
    assert np.abs(paths[0] - paths[1]).max() < 1e-12
    assert found[2].mechanism.inputs[0].law is None


PARALLEL = four_bar(1.0, 2.0, 1.0, 2.0, 0.7, 0.9) | {"sketch": {"C": [2.6, 0.9]}}
REFUSED = [
    (PARALLEL, "E", "does not turn, as in a parallelogram"),
    (four_bar(1.0, 2.4, 2.1, 2.7, 0.0, 0.0), "BC.E", "at a pin"),
    ("four-bar", "C", "no moving link with two pins alone carries"),
    ("four-bar", "A", "point of the frame"),
    ("geared-five-bar", "P", "no cognates of the path"),
    ("crank-and-slotted-lever", "S", "held by more than pins"),
    ("double-parallelogram", "E", "stay open"),
]


@pytest.mark.parametrize(("source", "point", "why"), REFUSED)
def test_a_path_without_cognates_is_refused_with_the_reason(source, point, why):
    mechanism = planar.from_dict(source) if isinstance(source, dict) else planar.load(source)
    with pytest.raises(planar.BadInput, match=why):
        planar.cognates(mechanism, point)


def test_names_that_are_not_there():
    with pytest.raises(planar.Unknown):
        planar.cognates("four-bar", "Q")
    with pytest.raises(planar.BadInput, match="no point of it"):
        first_cognates(planar.load("open-arm"))


def test_pictures_hold_three_together_and_more_apart():
    (whole,) = cognate_pictures(planar.cognates("four-bar", "F"))
    assert {mark.text for mark in whole.marks if hasattr(mark, "text")} >= {"A", "D", "F", "B1", "C1", "B2", "C2"}
    about = {mark.about for mark in whole.marks}
    assert {"between pivots", "path of F"} <= about
    apart = cognate_pictures(planar.cognates("klann-leg", "foot"))
    assert [each.title for each in apart[:2]] == ["The mechanism itself", "Cognate 1"]
    assert len(apart) == 6


def test_the_command_writes_files_that_trace_the_path(tmp_path):
    told = run(tmp_path, "cognates", "four-bar", "--of", "E", "-o", "found", "--drawing", "roberts.svg").done()
    assert "2 other linkages trace the path of E" in told
    assert "H it keeps the timing" in told
    assert b"<svg" in (tmp_path / "roberts.svg").read_bytes()
    value = json.loads(run(tmp_path, "cognates", "four-bar", "--of", "E", "--json").done())
    assert [each["is_timed"] for each in value["cognates"]] == [True, True, False]
    here = planar.solve("four-bar").point("E").position
    for number in (1, 2):
        file = tmp_path / "found" / f"cognate-{number}.json"
        assert planar.dumps(file) == planar.dumps(planar.from_dict(value["cognates"][number]["mechanism"]))
        assert planar.solve(file).point("E").position == pytest.approx(here, abs=1e-12)
    assert run(tmp_path, "cognates", "four-bar", "--of", "B").status == 2
    assert run(tmp_path, "cognates", "four-bar", "--of", "E", "--drawing", "a.gif").status == 2
    assert run(tmp_path, "plot", "four-bar", "cognates", "-o", "c.svg").status == 0


def test_fixed_pivots_of_three_four_bars_are_three():
    found = planar.cognates("chebyshev-straight-line", "P")
    every = {place for each in found for place in pivots(each.mechanism)}
    assert len(every) == 3
    assert all(len(pivots(each.mechanism)) == 2 for each in found)
    assert all(pivots(one.mechanism) != pivots(other.mechanism) for one, other in combinations(found, 2))
