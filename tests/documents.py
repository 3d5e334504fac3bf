"""Documents of mechanisms that tests read and change: the contract's examples, and every mistake of an author."""

from __future__ import annotations

import json
from math import inf, nan
from typing import Any

import pytest

import planar
from planar.foundation.errors import BadInput
from planar.model.mechanism import (
    Mechanism,
)

FOUR_BAR = """
{
  "planar": 1,
  "name": "Four-bar chain",
  "source": "Theory of Machines, acceleration analysis, Example 3.1",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "AD",
  "links": {
    "AD": {"points": {"A": [0, 0], "D": [100, 0]}},
    "AB": {"ends": ["A", "B"], "length": 50},
    "BC": {"ends": ["B", "C"], "length": 66,
           "points": {"E": {"along": ["B", "C"], "distance": 40},
                      "F": {"distances": {"B": 45, "C": 30}, "right_of": ["B", "C"]}}},
    "DC": {"ends": ["D", "C"], "length": 56,
           "points": {"G": {"distances": {"C": 24, "D": 44}, "left_of": ["C", "D"]}}}
  },
  "pairs": [
    {"turning": "A", "links": ["AD", "AB"], "pin_radius": 30},
    {"turning": "B", "links": ["AB", "BC"], "pin_radius": 40},
    {"turning": "C", "links": ["BC", "DC"], "pin_radius": 25},
    {"turning": "D", "links": ["AD", "DC"], "pin_radius": 35}
  ],
  "inputs": [{"pair": "A", "position": 60, "velocity": "10.5 rad/s", "acceleration": "-26 rad/s^2"}],
  "sketch": {"C": [80, 50]}
}
"""

SLIDER_CRANK = """
{
  "planar": 1,
  "name": "Slider-crank",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "frame",
  "links": {
    "frame": {"points": {"O": [0, 0]}},
    "crank": {"ends": ["O", "A"], "length": 480},
    "rod": {"ends": ["A", "B"], "length": 1600,
            "points": {"E": {"along": ["A", "B"], "distance": -450}}},
    "piston": {"points": {"B": [0, 0]}}
  },
  "pairs": [
    {"turning": "O"}, {"turning": "A"}, {"turning": "B"},
    {"sliding": "stroke", "links": ["frame", "piston"],
     "line": {"through": "O", "angle": 0}, "point": "B"}
  ],
  "inputs": [{"pair": "O", "position": 60, "velocity": "20 rad/s"}],
  "sketch": {"B": [1780, 0]}
}
"""

TWO_DYADS = """
{
  "planar": 1,
  "name": "A crank, two rods on one pin, a rocker and a block",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "frame",
  "links": {
    "frame": {"points": {"O": [0, 0], "Q": [300, 0], "X": [0, 10]}},
    "crank": {"ends": ["O", "A"], "length": 50},
    "rod": {"ends": ["A", "C"], "length": 250, "points": {"X": {"along": ["A", "C"], "distance": 40, "angle": 30}}},
    "rocker": {"points": {"Q": [0, 0], "C": [0, 200]}, "axis": ["Q", "C"]},
    "link": {"ends": ["C", "D"], "length": 400}
  },
  "pairs": [
    {"turning": "O"},
    {"turning": "A"},
    {"turning": "C", "pin_diameter": 30},
    {"turning": "Q"},
    {"sliding": "stroke", "on": "frame", "block": "D", "line": {"through": [0, 250]}}
  ],
  "inputs": [{"pair": "O", "position": 60, "velocity": "100 rpm"}],
  "loads": [{"point": "D", "force": [-3000, 0]}, {"link": "crank", "torque": 5}],
  "sketch": {"C": [280, 200], "D": [660, 250], "rod.X": [60, 40]},
  "published": [{"symbol": "v_D", "quantity": "velocity", "of": "D", "value": "0.5 m/s"}]
}
"""

WHEELS = """
{
  "planar": 1,
  "name": "A train of wheels, a rack and a slotted arm",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "frame",
  "links": {
    "frame": {"points": {"O": [0, 0], "Q": [80, 0], "R": [80, 200], "T": [200, 0], "S": [-90, 0]}},
    "sun": {"ends": ["O", "A"], "length": 40},
    "planet": {"ends": ["Q", "B"], "length": 20},
    "pulley": {"points": {"R": [0, 0], "E": [15, 5]}, "axis": ["R", "E"]},
    "sprocket": {"ends": ["T", "F"], "length": 10},
    "bar": {"points": {"G": [0, 0], "H": [100, 0]}},
    "arm": {"ends": ["S", "K"], "length": 200}
  },
  "pairs": [
    {"turning": "O"}, {"turning": "Q"}, {"turning": "R"}, {"turning": "T"}, {"turning": "S"},
    {"gear": "mesh", "links": ["sun", "planet"], "carrier": "frame", "radii": [50, "3 cm"]},
    {"belt": "loop", "links": ["planet", "pulley"], "radii": [20, 40], "crossed": true},
    {"chain": "drive", "links": ["pulley", "sprocket"], "teeth": [15, 45],
     "mesh": {"pulley": 10, "sprocket": "0.5 rad"}},
    {"gear": "back", "links": ["sun", "bar"], "carrier": "arm", "ratio": -1.5},
    {"sliding": "guide", "links": ["frame", "bar"], "line": {"through": [0, -50], "to": "T"},
     "point": "G", "turn": 180},
    {"rack": "roll", "links": ["bar", "sun"], "line": {"through": "G", "to": "H"}, "point": "O", "radius": -50,
     "mesh": {"displacement": 5, "angle": "30 deg"}},
    {"slot": "groove", "links": ["arm", "sun"], "line": {"through": "S", "angle": 0}, "point": "A"}
  ],
  "inputs": [{"pair": "mesh", "position": 700, "velocity": "100 rpm"},
             {"pair": "roll", "position": "1 cm", "velocity": 2}],
  "published": [{"symbol": "x", "quantity": "displacement", "of": "roll", "value": "1 cm", "tolerance": 0.01,
                 "from": {"mesh": {"position": 0}}}]
}
"""

LOADED = """
{
  "planar": 1,
  "name": "A slider-crank with everything that can act on it",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "frame",
  "links": {
    "frame": {"points": {"O": [0, 0], "S": [50, 200]}},
    "crank": {"ends": ["O", "A"], "length": 80},
    "rod": {"ends": ["A", "B"], "length": 300, "points": {"G": {"along": ["A", "B"], "distance": 110}}}
  },
  "pairs": [
    {"turning": "O"}, {"turning": "A"},
    {"sliding": "stroke", "on": "frame", "block": "B", "line": {"through": "O", "angle": 0}}
  ],
  "inputs": [{"pair": "O", "position": 40, "velocity": "60 rpm"}],
  "loads": [
    {"point": "B", "force": ["-2 kN", 0],
     "varies": {"with": "O", "at": [0, 90, 90, 360], "factors": [0, 1, 0.25, 0]}},
    {"point": "G", "force": [3, -4], "axes": "rod"},
    {"link": "crank", "torque": "500 N mm", "varies": {"at": [0, "200 ms", 1], "factors": [1, 0, 0.5]}},
    {"pair": "stroke", "force": 40},
    {"pair": "A", "torque": -0.5}
  ],
  "springs": [
    {"points": ["S", "A"], "stiffness": "2 N/mm", "free_length": 120, "damping": 3},
    {"points": ["O", "B"], "damping": "0.5 N s/mm"},
    {"links": ["crank", "rod"], "stiffness": "5 N m/rad", "free_angle": -30, "damping": 0.02},
    {"links": ["frame", "rod"], "stiffness": 1}
  ],
  "masses": [
    {"link": "crank", "mass": "900 g", "at": [20, -5], "inertia": 0.001},
    {"link": "rod", "mass": 1.5, "at": "G"},
    {"link": "rod", "mass": 0, "at": "A", "inertia": "2e4 g mm^2"},
    {"link": "block B", "mass": 0.8, "at": "B"}
  ],
  "gravity": [0, "-9.81 m/s^2"],
  "sketch": {"B": [360, 0]}
}
"""

EXAMPLES = {
    "four-bar": FOUR_BAR,
    "slider-crank": SLIDER_CRANK,
    "two dyads": TWO_DYADS,
    "wheels": WHEELS,
    "loaded": LOADED,
}


def base(name: str = "four-bar") -> Any:
    """A fresh JSON value of an example."""
    return json.loads(EXAMPLES[name])


def put(value: Any, path: list[Any], new: Any) -> Any:
    """The value with what stands at a path replaced."""
    place = value
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = new
    return value


def read(*changes: tuple[list[Any], Any], of: str = "four-bar") -> Mechanism:
    value = base(of)
    for path, new in changes:
        put(value, path, new)
    return planar.from_dict(value)


def refused(value: Any) -> BadInput:
    """How a value is refused: in one printable line of a readable length."""
    with pytest.raises(BadInput) as caught:
        planar.from_dict(value)
    assert str(caught.value).isprintable()
    assert 20 < len(str(caught.value)) < 500
    return caught.value


GONE = "no value at all"
"""In the place of a value: there is none."""


def mistake(path: str, new: Any, place: str, *words: str, of: str = "four-bar") -> Any:
    """A row of the table: what is written where ("links/AB/length"), the place to be named, words that must stand."""
    keys = [int(key) if key.isdigit() else key for key in path.split("/")] if path else []
    return pytest.param(of, keys, new, place, words, id=f"{path or 'whole'}={str(new)[:40]}".replace("\n", " "))


ALONG = "links/BC/points/E"

E_PLACE = "$.links.BC.points.E"

TRIANGLE = "links/BC/points/F"

SLIDE = {"sliding": "s", "on": "AD", "block": "E", "line": {"through": "A"}}

RIDE = {"sliding": "s", "links": ["AD", "BC"], "line": {"through": "A"}, "point": "E"}

PRINTED = {"symbol": "v", "quantity": "velocity", "of": "C", "value": 1}

MISTAKES = [
    # the whole
    mistake("", [], "$", "object", "a list"),
    mistake("", None, "$", "object", "null"),
    mistake("", "text", "$", "object", "'text'"),
    mistake("", 5, "$", "object", "number 5"),
    mistake("planar", GONE, "$", "'planar'", "missing"),
    mistake("planar", 2, "$.planar", "format is to be the number 1, not the number 2"),
    mistake("planar", "1", "$.planar", "format", "'1'"),
    mistake("planar", True, "$.planar", "format", "true"),
    mistake("link", {}, "$.link", "unknown key 'link'", "'links'"),
    mistake("Frame", "AD", "$.Frame", "unknown key 'Frame'", "'frame'"),
    mistake("name", 5, "$.name", "text", "number 5"),
    mistake("name", None, "$.name", "text", "null"),
    mistake("notes", "one", "$.notes", "list", "'one'"),
    mistake("notes", ["one", 2], "$.notes[1]", "text", "number 2"),
    mistake("ids", {}, "$.ids", "list", "an object"),
    mistake("geometry", "fit", "$.geometry", "'fit'", "fitted", "given"),
    # units
    mistake("units", "mm", "$.units", "object", "'mm'"),
    mistake("units", {"lenght": "mm"}, "$.units.lenght", "'lenght'", "'length'"),
    mistake("units/length", "deg", "$.units.length", "'deg'", "length", "'mm'"),
    mistake("units/length", "parsnip", "$.units.length", "'parsnip'", "length"),
    mistake("units/length", 5, "$.units.length", "text", "number 5"),
    mistake("units/angle", "mm", "$.units.angle", "'mm'", "angle", "'deg'"),
    mistake("units/angle", "percent", "$.units.angle", "'percent'"),
    mistake("units/length", "m^0", "$.units.length", "'m^0'"),
    mistake("units/length", "x" * 100_000, "$.units.length", "unit"),
    # frame
    mistake("frame", GONE, "$", "'frame'", "missing"),
    mistake("frame", "Ad", "$.frame", "no link 'Ad'", "'AD'"),
    mistake("frame", ["AD"], "$.frame", "text", "a list"),
    mistake("frame", "nothing like it", "$.frame", "no link 'nothing like it'"),
    # links
    mistake("links", GONE, "$", "'links'", "missing"),
    mistake("links", [], "$.links", "object", "a list"),
    mistake("links/AB", [0, 0], "$.links.AB", "object", "a list"),
    mistake("links/AB", {}, "$.links.AB", "points"),
    mistake("links/AB", {"points": {}}, "$.links.AB", "points"),
    mistake("links/AB/lenght", 5, "$.links.AB.lenght", "'lenght'", "'length'"),
    mistake("links/AB/length", GONE, "$.links.AB", "'length'", "missing"),
    mistake("links/AB/ends", GONE, "$.links.AB.length", "'ends'"),
    mistake("links/AB/ends", ["A"], "$.links.AB.ends", "2 names", "1"),
    mistake("links/AB/ends", ["A", "B", "C"], "$.links.AB.ends", "2 names", "3"),
    mistake("links/AB/ends", ["A", "A"], "$.links.AB.ends", "'A'", "different"),
    mistake("links/AB/ends", "AB", "$.links.AB.ends", "list", "'AB'"),
    mistake("links/AB/ends", ["A", 5], "$.links.AB.ends[1]", "text", "number 5"),
    mistake("links/AB/ends", ["A", ""], "$.links.AB.ends[1]", "empty"),
    mistake("links/AB/ends", ["A", "B.C"], "$.links.AB.ends[1]", "'B.C'", "'.'"),
    mistake("links/AB/length", 0, "$.links.AB.length", "above zero", "0"),
    mistake("links/AB/length", -50, "$.links.AB.length", "above zero", "-50"),
    mistake("links/AB/length", "-50 mm", "$.links.AB.length", "above zero", "-50 mm"),
    mistake("links/AB/length", "-50\nmm", "$.links.AB.length", "above zero"),
    mistake("links/AB/length", True, "$.links.AB.length", "number", "true"),
    mistake("links/AB/length", None, "$.links.AB.length", "number", "null"),
    mistake("links/AB/length", [50], "$.links.AB.length", "number", "a list"),
    mistake("links/AB/length", {"mm": 50}, "$.links.AB.length", "number", "an object"),
    mistake("links/AB/length", "50", "$.links.AB.length", "no unit", "'50 mm'"),
    mistake("links/AB/length", "fifty", "$.links.AB.length", "'fifty'", "'50 mm'"),
    mistake("links/AB/length", "50 deg", "$.links.AB.length", "angle", "length is wanted"),
    mistake("links/AB/length", "50 parsnips", "$.links.AB.length", "'parsnips'"),
    mistake("links/AB/length", "1e999 m", "$.links.AB.length", "too large"),
    mistake("links/AB/length", 1e-155, "$.links.AB.length", "above zero", "1e-100 m at least"),
    mistake("links/AB/length", inf, "$.links.AB.length", "too large"),
    mistake("links/AB/length", nan, "$.links.AB.length", "not a number"),
    mistake("links/AB/length", 10**400, "$.links.AB.length", "too large"),
    mistake("links/AB/length", "x" * 100_000, "$.links.AB.length", "number with a unit"),
    mistake("links/AB/length", "9**9**9 m", "$.links.AB.length", "unit"),
    mistake("links/A.B", {"points": {"A": [0, 0]}}, "$.links['A.B']", "'A.B'", "'.'"),
    mistake("links/A:B", {"points": {"A": [0, 0]}}, "$.links['A:B']", "'A:B'", "':'"),
    mistake("links/A,B", {"points": {"A": [0, 0]}}, "$.links['A,B']", "'A,B'", "','"),
    mistake("links/ ", {"points": {"A": [0, 0]}}, "$.links[' ']", "empty"),
    mistake("links/x[\nfoo", 5, r"$.links['x[\nfoo']", "name"),
    # points of links
    mistake("links/AD/points", [[0, 0]], "$.links.AD.points", "object", "a list"),
    mistake("links/AD/points/D", [100], "$.links.AD.points.D", "two numbers", "1"),
    mistake("links/AD/points/D", [100, 0, 0], "$.links.AD.points.D", "two numbers", "3"),
    mistake("links/AD/points/D", [100, "far"], "$.links.AD.points.D[1]", "'far'"),
    mistake("links/AD/points/D", 100, "$.links.AD.points.D", "object", "100"),
    mistake("links/AD/points/D", {"x": 100}, "$.links.AD.points.D.x", "unknown key 'x'"),
    mistake("links/AD/points/D", {}, "$.links.AD.points.D", "[x, y]", "'along'", "'distances'"),
    mistake("links/AD/points/", [1, 2], "$.links.AD.points['']", "empty"),
    mistake("links/AD/points/D,E", [1, 2], "$.links.AD.points['D,E']", "','"),
    mistake("links/AB/points", {"B": [1, 2]}, "$.links.AB.points.B", "'B'", "end"),
    mistake(ALONG, {"along": ["B", "C"]}, "$.links.BC.points.E", "'distance'", "missing"),
    mistake(ALONG, {"along": ["B"], "distance": 4}, "$.links.BC.points.E.along", "2 names"),
    mistake(ALONG, {"along": ["B", "B"], "distance": 4}, "$.links.BC.points.E.along", "different"),
    mistake(ALONG, {"along": ["B", "X"], "distance": 4}, "$.links.BC.points.E", "no point 'X'"),
    mistake(ALONG, {"along": ["B", "E"], "distance": 4}, "$.links.BC.points.E", "rests on itself"),
    mistake(f"{ALONG}/distance", "40 deg", "$.links.BC.points.E.distance", "length is wanted"),
    mistake(f"{ALONG}/angle", "40 mm", "$.links.BC.points.E.angle", "angle is wanted"),
    mistake(
        ALONG, {"along": ["B", "C"], "distance": 4, "angle": 5, "offset": 3}, "$.links.BC.points.E.offset", "not both"
    ),
    mistake(ALONG, {"along": ["B", "C"], "distance": 4, "offset": "3 deg"}, f"{E_PLACE}.offset", "length is wanted"),
    mistake(f"{ALONG}/left_of", ["B", "C"], "$.links.BC.points.E.left_of", "'left_of'"),
    mistake(f"{ALONG}/distances", {"B": 1, "C": 1}, "$.links.BC.points.E.distances", "'distances'"),
    mistake(f"{TRIANGLE}/distances", {"B": 5, "C": 5}, "$.links.BC.points.F", "does not close", "B-C-F"),
    mistake(f"{TRIANGLE}/distances", {"B": 5, "C": 1e99}, "$.links.BC.points.F", "does not close"),
    mistake(f"{TRIANGLE}/distances", {"B": 5, "C": 1e200}, "$.links.BC.points.F.distances.C", "too large"),
    mistake(f"{TRIANGLE}/distances", {"B": 45}, "$.links.BC.points.F.distances", "two points", "1"),
    mistake(f"{TRIANGLE}/distances", {"B": 45, "C": 0}, "$.links.BC.points.F.distances.C", "above zero"),
    mistake(f"{TRIANGLE}/distances", {"B": 45, "E": 30}, "$.links.BC.points.F.right_of", "B and E"),
    mistake(f"{TRIANGLE}/distances", {"B\nX": 45, "C": 30}, r"$.links.BC.points.F.distances['B\nX']", "name"),
    mistake(f"{TRIANGLE}/distances", [45, 30], "$.links.BC.points.F.distances", "object", "a list"),
    mistake(f"{TRIANGLE}/right_of", GONE, "$.links.BC.points.F", "'left_of'", "'right_of'"),
    mistake(f"{TRIANGLE}/left_of", ["B", "C"], "$.links.BC.points.F", "'left_of'", "'right_of'"),
    mistake(f"{TRIANGLE}/right_of", ["B", "X"], "$.links.BC.points.F.right_of", "B and C"),
    mistake(f"{TRIANGLE}/angle", 30, "$.links.BC.points.F.angle", "'angle'"),
    mistake("links/BC/points/P", {"along": ["Q", "B"], "distance": 1}, "$.links.BC.points.P", "no point 'Q'"),
    mistake("links/AB/axis", ["A", "B"], "$.links.AB.axis", "'ends'"),
    mistake("links/AD/axis", ["A"], "$.links.AD.axis", "2 names"),
    mistake("links/AD/axis", ["A", "A"], "$.links.AD.axis", "different"),
    mistake("links/AD/axis", ["A", "X"], "$.links.AD.axis", "no point 'X'"),
    mistake("links/AD", {"points": {"A": [1, 2], "D": [1, 2]}, "axis": ["A", "D"]}, "$.links.AD.axis", "coincide"),
    # pairs
    mistake("pairs", GONE, "$", "'pairs'", "missing"),
    mistake("pairs", {}, "$.pairs", "list", "an object"),
    mistake("pairs/0", "A", "$.pairs[0]", "object", "'A'"),
    mistake("pairs/0", {}, "$.pairs[0]", "'turning'", "'sliding'"),
    mistake("pairs/0", {"turnin": "A"}, "$.pairs[0]", "'turning'", "did you mean 'turning'"),
    mistake("pairs/0", {"links": ["AD", "AB"], "turnin": "A"}, "$.pairs[0]", "did you mean 'turning'"),
    mistake("pairs/0/sliding", "s", "$.pairs[0]", "more than one"),
    mistake("pairs/0/turning", 5, "$.pairs[0].turning", "text", "number 5"),
    mistake("pairs/0/turning", "", "$.pairs[0].turning", "empty"),
    mistake("pairs/0/turning", "A.B", "$.pairs[0].turning", "'A.B'", "'.'"),
    mistake("pairs/0/turning", "Z", "$.pairs[0].turning", "'AD'", "no point 'Z'"),
    mistake("pairs/0", {"turning": "Z"}, "$.pairs[0].turning", "no link", "'Z'"),
    mistake("pairs/0", {"turning": "E"}, "$.pairs[0].turning", "two links", "only link 'BC'", "'links'"),
    mistake("pairs/0/links", ["AD", "Ab"], "$.pairs[0].links[1]", "no link 'Ab'", "did you mean 'AB'"),
    mistake("pairs/0/links", ["AD"], "$.pairs[0].links", "two links"),
    mistake("pairs/0/links", ["AD", "AB", "AD"], "$.pairs[0].links", "'AD'", "twice"),
    mistake("pairs/0/links", "AD", "$.pairs[0].links", "list", "'AD'"),
    mistake("pairs/0/links", ["AD", 5], "$.pairs[0].links[1]", "text", "number 5"),
    mistake("pairs/0/links", ["AD", "BC"], "$.pairs[0].turning", "'BC'", "no point 'A'"),
    mistake("pairs/0/points", ["A"], "$.pairs[0].points", "2 names", "1"),
    mistake("pairs/0/points", ["A", "X"], "$.pairs[0].points[1]", "'AB'", "no point 'X'"),
    mistake("pairs/0/pin_radius", 0, "$.pairs[0].pin_radius", "above zero"),
    mistake("pairs/0/pin_radius", "30 deg", "$.pairs[0].pin_radius", "length is wanted"),
    mistake("pairs/0/pin_diameter", 30, "$.pairs[0].pin_diameter", "'pin_radius'", "not both"),
    mistake("pairs/0", {"turning": "A", "pin_diameter": -1}, "$.pairs[0].pin_diameter", "above zero"),
    mistake("pairs/0/radius", 30, "$.pairs[0].radius", "unknown key 'radius'", "'pin_radius'"),
    mistake("pairs/1", {"turning": "A"}, "$.pairs[1]", "'A'", "$.pairs[0]", "write one pair"),
    mistake("pairs/3", RIDE | {"sliding": "A"}, "$.pairs[3]", "'A'", "$.pairs[0]", "another name"),
    mistake("pairs/3", RIDE | {"links": ["AD", "AB", "BC"]}, "$.pairs[3].links", "two links", "3"),
    mistake("pairs/3", RIDE | {"line": "A"}, "$.pairs[3].line", "object", "'A'"),
    mistake("pairs/3", RIDE | {"line": {}}, "$.pairs[3].line", "'through'", "missing"),
    mistake("pairs/3", RIDE | {"line": {"through": "X"}}, "$.pairs[3].line.through", "'AD'", "no point 'X'"),
    mistake("pairs/3", RIDE | {"line": {"through": "A", "to": "D", "angle": 5}}, "$.pairs[3].line.angle", "not both"),
    mistake("pairs/3", RIDE | {"line": {"through": "A", "to": "A"}}, "$.pairs[3].line.to", "different"),
    mistake("pairs/3", RIDE | {"line": {"through": "A", "to": [0, 0]}}, "$.pairs[3].line.to", "coincide"),
    mistake("pairs/3", RIDE | {"line": {"through": [5, 5], "to": [5, 5]}}, "$.pairs[3].line.to", "different"),
    mistake("pairs/3", RIDE | {"point": "X"}, "$.pairs[3].point", "'BC'", "no point 'X'"),
    mistake("pairs/3", RIDE | {"point": [1, 2]}, "$.pairs[3].point", "text", "a list"),
    mistake("pairs/3", RIDE | {"turn": "5 mm"}, "$.pairs[3].turn", "angle is wanted"),
    mistake("pairs/3", RIDE | {"on": "AD"}, "$.pairs[3].on", "'block'"),
    mistake("pairs/3", SLIDE | {"block": 5}, "$.pairs[3].block", "text", "number 5"),
    mistake("pairs/3", SLIDE | {"block": ""}, "$.pairs[3].block", "empty"),
    mistake(
        "pairs/3",
        SLIDE | {"block": "BC.E"},
        "$.pairs[3].block",
        "a block is a new link",
        '["AD", "BC"]',
        '"point": "E"',
    ),
    mistake("pairs/3", SLIDE | {"block": "Z.E"}, "$.pairs[3].block", "'Z.E'", "'.'"),
    mistake("pairs/3", SLIDE | {"block": "Z"}, "$.pairs[3].block", "no link", "'Z'"),
    mistake("pairs/3", SLIDE | {"on": "Ad"}, "$.pairs[3].on", "no link 'Ad'", "'AD'"),
    mistake("pairs/3", SLIDE | {"on": ["AD"]}, "$.pairs[3].on", "text", "a list"),
    mistake("pairs/3", SLIDE | {"links": ["AD", "BC"]}, "$.pairs[3].links", "'links'"),
    mistake("pairs/3", SLIDE | {"point": "C"}, "$.pairs[3].point", "'point'"),
    mistake("pairs/3", {"sliding": "s", "block": "E", "line": {"through": "A"}}, "$.pairs[3]", "'on'", "missing"),
    # inputs
    mistake("inputs", {}, "$.inputs", "list", "an object"),
    mistake("inputs/0", "A", "$.inputs[0]", "object", "'A'"),
    mistake("inputs/0/pair", GONE, "$.inputs[0]", "'pair'", "missing"),
    mistake("inputs/0/pair", "AA", "$.inputs[0].pair", "no pair 'AA'", "'A'"),
    mistake("inputs/0/pair", "", "$.inputs[0].pair", "no pair ''"),
    mistake("inputs/0/pair", 5, "$.inputs[0].pair", "text", "number 5"),
    mistake("inputs/0/position", GONE, "$.inputs[0]", "'position'", "missing"),
    mistake("inputs/0/position", "60 mm", "$.inputs[0].position", "a length", "an angle is wanted"),
    mistake("inputs/0/position", None, "$.inputs[0].position", "number", "null"),
    mistake("inputs/0/velocity", "10.5 Hz", "$.inputs[0].velocity", "turns or radians", "rpm"),
    mistake("inputs/0/velocity", "10.5 m/s", "$.inputs[0].velocity", "an angular velocity is wanted"),
    mistake("inputs/0/acceleration", "10.5 rad/s", "$.inputs[0].acceleration", "an angular acceleration is wanted"),
    mistake("inputs/0/speed", 5, "$.inputs[0].speed", "unknown key 'speed'"),
    mistake("inputs", [{"pair": "A", "position": 1}] * 2, "$.inputs[1].pair", "'A'", "already"),
    mistake(
        "inputs/0",
        {"pair": "stroke", "position": 60, "velocity": "1 rad/s"},
        "$.inputs[0].velocity",
        "a velocity is wanted",
        of="two dyads",
    ),
    # sketch, loads, published
    mistake("sketch", [[80, 50]], "$.sketch", "object", "a list"),
    mistake("sketch/C", 80, "$.sketch.C", "list", "80"),
    mistake("sketch/C", [80], "$.sketch.C", "two numbers", "1"),
    mistake("sketch/C", ["80 mm", "50 deg"], "$.sketch.C[1]", "length is wanted"),
    mistake("sketch/Z", [1, 2], "$.sketch.Z", "no point 'Z'"),
    mistake("sketch/BC.Z", [1, 2], "$.sketch['BC.Z']", "no point 'BC.Z'", "did you mean 'BC."),
    mistake("sketch/X", [1, 2], "$.sketch.X", "several points", "'frame.X'", "'rod.X'", of="two dyads"),
    mistake("loads", {}, "$.loads", "list", "an object"),
    mistake("loads", [{}], "$.loads[0]", "'force'", "'torque'"),
    mistake("loads", [{"point": "Z", "force": [1, 2]}], "$.loads[0].point", "no point 'Z'"),
    mistake("loads", [{"point": "C", "force": 5}], "$.loads[0].force", "list", "5"),
    mistake("loads", [{"point": "C", "force": [1, "2 m"]}], "$.loads[0].force[1]", "force is wanted"),
    mistake("loads", [{"point": "C"}], "$.loads[0]", "'force'", "missing"),
    mistake("loads", [{"point": "C", "force": [1, 2], "torque": 3}], "$.loads[0].torque", "'torque'"),
    mistake("loads", [{"link": "AB", "torque": 3, "force": [1, 2]}], "$.loads[0].force", "'force'"),
    mistake("loads", [{"link": "BA", "torque": 3}], "$.loads[0].link", "no link 'BA'"),
    mistake("loads", [{"link": "AB", "torque": "3 N"}], "$.loads[0].torque", "torque is wanted"),
    mistake("loads/0", {"point": "B"}, "$.loads[0]", "'force'", "missing", of="loaded"),
    mistake("loads/0", {"force": [1, 2]}, "$.loads[0]", "a 'force' at a 'point'", "at a 'pair'", of="loaded"),
    mistake("loads/0", {"point": "B", "pair": "A", "force": [1, 2]}, "$.loads[0]", "a load is a", of="loaded"),
    mistake("loads/1/axes", "road", "$.loads[1].axes", "no link 'road'", of="loaded"),
    mistake("loads/2/axes", "rod", "$.loads[2].axes", "'axes'", of="loaded"),
    mistake("loads/3", {"pair": "stroke", "torque": 4}, "$.loads[3].torque", "is a force", of="loaded"),
    mistake("loads/4", {"pair": "A", "force": 4}, "$.loads[4].force", "is a torque", of="loaded"),
    mistake("loads/4", {"pair": "A"}, "$.loads[4]", "'torque'", "missing", of="loaded"),
    mistake("loads/4/pair", "Z", "$.loads[4].pair", "there is no pair 'Z'", of="loaded"),
    mistake("loads/0/varies/with", "stroke", "$.loads[0].varies.with", "'stroke' has no input", of="loaded"),
    mistake("loads/0/varies/with", "Z", "$.loads[0].varies.with", "there is no pair 'Z'", of="loaded"),
    mistake("loads/0/varies/at", [0, 1], "$.loads[0].varies.factors", "4 for 2", of="loaded"),
    mistake("loads/0/varies/at", [0, 90, 80, 360], "$.loads[0].varies.at[2]", "the places rise", of="loaded"),
    mistake("loads/0/varies/at", [5, 5, 5, 5], "$.loads[0].varies.at", "do not differ", of="loaded"),
    mistake("loads/0/varies/at/0", "1 s", "$.loads[0].varies.at[0]", "an angle is wanted", of="loaded"),
    mistake("loads/2/varies/at/0", "1 deg", "$.loads[2].varies.at[0]", "a time is wanted", of="loaded"),
    mistake("loads/0/varies/factors/1", "1", "$.loads[0].varies.factors[1]", "number", of="loaded"),
    mistake("loads/0/varies/by", 1, "$.loads[0].varies.by", "'by'", of="loaded"),
    mistake("springs/0", {"stiffness": 1}, "$.springs[0]", "between two 'points'", of="loaded"),
    mistake("springs/0/links", ["frame", "rod"], "$.springs[0]", "between two 'points'", of="loaded"),
    mistake("springs/0", {"points": ["S", "A"]}, "$.springs[0]", "a 'stiffness', a 'damping', or both", of="loaded"),
    mistake("springs/0/points", ["S", "Z"], "$.springs[0].points[1]", "no point 'Z'", of="loaded"),
    mistake("springs/0/points", ["S", "S"], "$.springs[0].points", "two different points", of="loaded"),
    mistake("springs/0/points", ["S", "A", "O"], "$.springs[0].points", "two different points", of="loaded"),
    mistake("springs/0/stiffness", -1, "$.springs[0].stiffness", "from zero on", "-1", of="loaded"),
    mistake("springs/0/damping", "-1 N s/m", "$.springs[0].damping", "from zero on", of="loaded"),
    mistake("springs/0/free_length", -1, "$.springs[0].free_length", "from zero on", of="loaded"),
    mistake("springs/0/free_angle", 1, "$.springs[0].free_angle", "'free_angle'", of="loaded"),
    mistake("springs/2/stiffness", "5 N/m", "$.springs[2].stiffness", "torsional stiffness is wanted", of="loaded"),
    mistake("springs/2/links", ["rod", "rod"], "$.springs[2].links", "'rod' stands here twice", of="loaded"),
    mistake("masses/0/mass", -1, "$.masses[0].mass", "mass from zero on", "-1", of="loaded"),
    mistake("masses/0/inertia", -1, "$.masses[0].inertia", "from zero on", of="loaded"),
    mistake("masses/0/link", "Z", "$.masses[0].link", "no link 'Z'", of="loaded"),
    mistake("masses/0/at", "G", "$.masses[0].at", "'G'", "'crank'", of="loaded"),
    mistake("masses/0/at", GONE, "$.masses[0]", "'at'", "missing", of="loaded"),
    mistake("masses/0/weight", 1, "$.masses[0].weight", "'weight'", of="loaded"),
    mistake("gravity", [0], "$.gravity", "two numbers", of="loaded"),
    mistake("gravity", [0, "9.81 m/s"], "$.gravity[1]", "acceleration is wanted", of="loaded"),
    mistake("published", [{}], "$.published[0]", "'quantity'", "missing"),
    mistake("published", [PRINTED | {"quantity": "speed"}], "$.published[0].quantity", "'speed'"),
    mistake("published", [PRINTED | {"of": "Z"}], "$.published[0].of", "no point 'Z'"),
    mistake("published", [PRINTED | {"value": "1 N"}], "$.published[0].value", "velocity is wanted"),
    mistake("published", [PRINTED | {"valu": 1}], "$.published[0].valu", "'value'"),
    mistake("published", [PRINTED | {"tolerance": "1"}], "$.published[0].tolerance", "number", "'1'"),
    mistake("published", [PRINTED | {"tolerance": inf}], "$.published[0].tolerance", "number"),
    mistake("published", [PRINTED | {"tolerance": -1}], "$.published[0].tolerance", "-1"),
    mistake("published", [PRINTED | {"sense": "left"}], "$.published[0].sense", "'left'", "to the left"),
    mistake("published", [PRINTED | {"inputs": {"B": {}}}], "$.published[0].inputs.B", "no input at 'B'"),
]


def mistaken(of: str, path: list[Any], new: Any) -> Any:
    """The value of an example with a mistake in it."""
    if not path:
        return new
    value = base(of)
    if new is not GONE:
        return put(value, path, new)
    holder = value
    for key in path[:-1]:
        holder = holder[key]
    del holder[path[-1]]
    return value
