"""Linkages of bars given by the places of their pins: the same mechanisms as in a file, and clear refusals."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import planar
from planar.foundation.errors import BadInput

PLACES = [[0, 0], [0.8, 0.1], [0.1, 0.25], [0.7, 0.6], [0.4, 0.9], [1.5, 0.4]]
BARS = [[0, 2], [2, 3, 4], [1, 3], [3, 5]]
"""A four-bar whose coupler carries a point, and a bar that hangs on its pin."""


def pinned_watt_six_bar():
    """Watt's, of two dyads; the second hangs on the rocker's far point."""
    places = [[0, 0], [0.8, 0.1], [0.1, 0.25], [0.7, 0.6], [0.9, 0.9], [1.6, 0.1], [1.5, 0.8]]
    return planar.pinned(np.array(places), [[0, 2], [2, 3], [1, 3, 4], [4, 6], [5, 6]], [0, 1, 5], velocity=2.0)


def test_a_pinned_linkage_is_the_one_that_a_file_describes():
    mechanism = planar.pinned(np.array(PLACES)[:5], BARS[:3], [0, 1], velocity=2.0, acceleration=-1.0)
    points = dict(zip(("A", "D", "B", "C", "E"), PLACES, strict=False))

    def apart(a, b):
        return float(np.hypot(*np.subtract(points[a], points[b])))

    value = {
        "planar": 1,
        "frame": "frame",
        "links": {
            "frame": {"points": {"A": points["A"], "D": points["D"]}},
            "AB": {"ends": ["A", "B"], "length": apart("A", "B")},
            "BC": {
                "ends": ["B", "C"],
                "length": apart("B", "C"),
                "points": {"E": {"distances": {"B": apart("B", "E"), "C": apart("C", "E")}, "left_of": ["B", "C"]}},
            },
            "DC": {"ends": ["D", "C"], "length": apart("D", "C")},
        },
        "pairs": [{"turning": name} for name in "ABCD"],
        "inputs": [{"pair": "A", "position": float(np.arctan2(0.25, 0.1)), "velocity": 2.0, "acceleration": -1.0}],
        "sketch": {"C": points["C"]},
    }
    other = planar.from_dict(value)
    one, two = planar.solve(mechanism), planar.solve(other)
    for own, name in (("P2", "B"), ("P3", "C"), ("P4", "E")):
        np.testing.assert_allclose(one.point(own).position, points[name], atol=1e-14)
        for order in ("position", "velocity", "acceleration"):
            found, wanted = (getattr(state.point(p), order) for state, p in ((one, own), (two, name)))
            np.testing.assert_allclose(found, wanted, atol=1e-12)


def test_a_pin_of_three_links_and_a_bar_on_a_pin_of_the_frame():
    places = [[0, 0], [0.8, 0.1], [0.1, 0.25], [0.7, 0.6], [1.5, 0.4], [1.7, -0.2]]
    mechanism = planar.pinned(places, [[0, 2], [2, 3], [1, 3], [3, 4], [5, 4]], [0, 1, 5])
    state = planar.solve(mechanism)
    for pin, at in enumerate(places):
        np.testing.assert_allclose(state.point(f"P{pin}").position, at, atol=1e-13)
    assert [pair.name for pair in mechanism.pairs] == ["P0", "P1", "P2", "P3:bar1,bar2", "P3:bar1,bar3", "P4", "P5"]


def test_a_crank_on_a_pin_of_the_frame_that_other_bars_share():
    places = [[0, 0], [0.8, 0.1], [0.1, 0.25], [0.7, 0.6], [0.3, 1.4]]
    mechanism = planar.pinned(places, [[1, 3], [2, 0], [2, 3], [3, 4], [0, 4]], [1, 0], crank=1)
    assert mechanism.inputs[0].pair == "P0:frame,bar1"
    np.testing.assert_allclose(planar.solve(mechanism).point("P4").position, places[4], atol=1e-13)
    # the axis of the bar goes from its first pin on
    assert mechanism.inputs[0].position == pytest.approx(np.arctan2(-0.25, -0.1))


def test_it_is_a_mechanism_like_others():
    mechanism = pinned_watt_six_bar()
    again = pickle.loads(pickle.dumps(mechanism))
    assert again.layout.bars == mechanism.layout.bars
    assert again == mechanism
    faster = replace(mechanism, inputs=(mechanism.inputs[0]._replace(velocity=5.0),))
    assert faster.links == mechanism.links
    assert faster.inputs[0].velocity == 5.0
    assert pickle.loads(pickle.dumps(faster)).inputs == faster.inputs
    wanted = 2.5 * planar.solve(mechanism).point("P6").velocity
    np.testing.assert_allclose(planar.solve(faster).point("P6").velocity, wanted)
    swept = planar.sweep_each([mechanism, faster], 24, ["P6"])
    np.testing.assert_allclose(swept[1].velocity["P6"], 2.5 * swept[0].velocity["P6"], atol=1e-12)
    file = planar.to_dict(mechanism)
    np.testing.assert_allclose(planar.solve(planar.from_dict(file)).point("P6").position, [1.5, 0.8], atol=1e-12)


REFUSED = {
    "no numbers": ({"places": "abc"}, "places", "array"),
    "three coordinates": ({"places": [[0, 0, 0], [1, 1, 1]]}, "places", "pins, 2"),
    "a place that is no number": ({"places": [*PLACES[:4], [np.nan, 0], PLACES[5]]}, r"places\[4\]", "up to"),
    "no frame": ({"frame": []}, "frame", "no pin"),
    "a pin of the frame that is not there": ({"frame": [0, 9]}, r"frame\[1\]", "there are 6"),
    "a bar of one pin": ({"bars": [*BARS[:3], [3, 4], [5]]}, r"bars\[4\]", "two pins"),
    "a bar with a pin twice": ({"bars": [[0, 2], [2, 3, 2], *BARS[2:]]}, r"bars\[1\]", "each once"),
    "a pin that is not there": ({"bars": [*BARS, [4, 6]]}, r"bars\[4\]\[1\]", "there are 6"),
    "a pin that is no number": ({"bars": [*BARS, [4, True]]}, r"bars\[4\]\[1\]", "True"),
    "bars that are none": ({"bars": [1, 2]}, "bars", "lists of pin"),
    "a bar of no length": ({"places": [*PLACES[:5], PLACES[3]]}, r"bars\[3\]", "no length"),
    "a pin on nothing": ({"bars": BARS[:3]}, r"places\[5\]", "on no bar"),
    "a crank that is not there": ({"crank": 4}, "crank", "there are 4"),
    "a crank that is not on the frame": ({"crank": 1}, "crank", "not pinned"),
    "a crank that is on it twice": ({"frame": [0, 1, 2]}, "crank", "twice"),
    "a velocity that is none": ({"velocity": "fast"}, "velocity", "finite"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_linkage_is_refused_at_its_place(name):
    changed, place, told = REFUSED[name]
    given = {"places": PLACES, "bars": BARS, "frame": [0, 1]} | changed
    with pytest.raises(BadInput, match=told) as caught:
        planar.pinned(**given)
    assert caught.match(place)


def test_places_and_bars_as_arrays_are_not_held():
    places, bars = np.array(PLACES[:4], dtype=float), np.array([[0, 2], [2, 3], [1, 3]])
    mechanism = planar.pinned(places, bars, np.array([0, 1]))
    places[3] = 7.0
    np.testing.assert_allclose(planar.solve(mechanism).point("P3").position, PLACES[3], atol=1e-14)


ARRAYS = {
    "places": np.array([[*PLACES[:5], [np.nan, np.nan]], PLACES]),
    "bars": np.array([[[0, 2, -1], [2, 3, 4], [1, 3, -1], [-1] * 3], [[0, 2, -1], [2, 3, 4], [1, 3, -1], [3, 5, -1]]]),
    "frame": np.array([[0, 1], [1, 0]]),
}


def test_linkages_from_arrays_are_those_that_are_made_one_by_one():
    linkages = planar.pinned_linkages(**ARRAYS, velocity=[1.0, 2.0])
    assert linkages[0] == planar.pinned(PLACES[:5], BARS[:3], [0, 1])
    assert linkages[-1] == planar.pinned(PLACES, BARS, [1, 0], velocity=2.0)
    assert pickle.loads(pickle.dumps(linkages))[1:][0] == linkages[1]
    assert len(linkages[:1]) == 1
    np.testing.assert_allclose(linkages.crank_angles, [each.inputs[0].position for each in linkages], atol=1e-15)


WRONG_ARRAYS = {
    "a place that is none": ("places", (1, 2, 0), np.inf, r"places\[1\]\[2\]"),
    "a pin between others": ("places", (0, 2), np.nan, r"places\[0\]\[2\]"),
    "a pin that is not there": ("bars", (0, 1, 2), 5, r"bars\[0\]\[1\]\[2\]"),
    "a pin twice": ("bars", (1, 1, 2), 2, r"bars\[1\]\[1\]"),
    "a bar of one pin": ("bars", (1, 3, 1), -1, r"bars\[1\]\[3\]"),
    "no length": ("places", (1, 2), PLACES[0], r"bars\[1\]\[0\].*no length"),
    "nothing on the frame": ("frame", (1,), -1, r"frame\[1\].*no pin"),
    "a crank that is not on it": ("frame", (0, 0), 3, r"crank\[0\].*not pinned"),
    "a crank that is on it twice": ("frame", (1, 0), 2, r"crank\[1\].*twice"),
    "a pin on nothing": ("bars", (0, 1, 2), -1, r"places\[0\]\[4\].*on no bar"),
}


@pytest.mark.parametrize("name", WRONG_ARRAYS)
def test_arrays_that_are_no_linkages_are_refused_at_their_place(name):
    key, place, value, told = WRONG_ARRAYS[name]
    given = {each: values.copy() for each, values in ARRAYS.items()}
    given[key][place] = value
    if name == "a crank that is on it twice":
        given["frame"][1] = [0, 2]
    with pytest.raises(BadInput, match=told):
        planar.pinned_linkages(**given)
