"""Documents of gears, belts, chains, racks and slots, and every mistake of an author in them."""

import copy
import json
from math import inf, nan

import pytest

WHEELS = {
    "planar": 1,
    "units": {"length": "mm", "angle": "deg"},
    "frame": "frame",
    "links": {
        "frame": {"points": {"O": [0, 0], "Q": [80, 0], "R": [40, 60]}},
        "a": {"ends": ["O", "A"], "length": 20},
        "b": {"ends": ["Q", "B"], "length": 20},
        "c": {"ends": ["R", "C"], "length": 10},
    },
    "pairs": [{"turning": "O"}, {"turning": "Q"}, {"turning": "R"}],
    "inputs": [{"pair": "O", "position": 20, "velocity": "1 rad/s"}, {"pair": "R", "position": 0}],
}

PINION = {
    "planar": 1,
    "units": {"length": "mm", "angle": "deg"},
    "frame": "frame",
    "links": {"frame": {"points": {"O": [0, 0], "P": [50, 0]}}, "w": {"ends": ["C", "T"], "length": 20}},
    "pairs": [{"slot": "s", "links": ["frame", "w"], "line": {"through": [0, 20]}, "point": "C"}],
    "inputs": [{"pair": "s", "position": 30, "velocity": 1}],
}

GEAR = {"gear": "g", "links": ["a", "b"], "radii": [30, 50]}

TEETH = {"gear": "g", "links": ["a", "b"], "teeth": [30, 50]}

RATIO = {"gear": "g", "links": ["a", "b"], "ratio": -2}

BELT = {"belt": "g", "links": ["a", "b"], "radii": [30, 40]}

CHAIN = {"chain": "g", "links": ["a", "b"], "teeth": [15, 45]}

RACK = {"rack": "r", "links": ["frame", "w"], "line": {"through": "O"}, "point": "C", "radius": 20}

SLOT = {"slot": "t", "links": ["frame", "w"], "line": {"through": "O"}, "point": "C"}

GONE = object()


def wheels(*entries, inputs=None):
    value = copy.deepcopy(WHEELS)
    value["pairs"] += entries
    return value if inputs is None else value | {"inputs": inputs}


def pinion(entry, **changes):
    value = copy.deepcopy(PINION) | changes
    value["pairs"].append(entry)
    return value


def driven(pair, position, **rates):
    return {"pair": pair, "position": position, **rates}


def mistake(entry, change, place, *words):
    """What is changed in an entry; the place to be named (from the entry on), and words that must stand."""
    entry = {key: value for key, value in (entry | change).items() if value is not GONE}
    told = {key: "gone" if value is GONE else value for key, value in change.items()}
    return pytest.param(entry, place, words, id=f"{next(iter(entry))} {json.dumps(told)}")


MISTAKES = [
    mistake(GEAR, {"gear": "O"}, "", "'O'", "$.pairs[0]", "another name"),
    mistake(GEAR, {"links": ["a"]}, ".links", "two links"),
    mistake(GEAR, {"links": ["a", "a"]}, ".links", "'a'", "twice"),
    mistake(GEAR, {"links": ["a", "b", "c"]}, ".links", "two links", "3"),
    mistake(GEAR, {"links": ["a", "z"]}, ".links[1]", "no link 'z'"),
    mistake(GEAR, {"links": ["frame", "b"]}, "", "'frame'", "third link", "'carrier'"),
    mistake(GEAR, {"carrier": "a"}, ".carrier", "'a'", "third link"),
    mistake(GEAR, {"carrier": "z"}, ".carrier", "no link 'z'"),
    mistake(GEAR, {"carrier": ["frame"]}, ".carrier", "text", "a list"),
    mistake(GEAR, {"carrier": "c"}, "", "'a'", "not pinned to 'c'"),
    mistake(GEAR, {"radii": [30]}, ".radii", "2 numbers", "1"),
    mistake(GEAR, {"radii": [30, 40]}, "", "70 mm", "80 mm"),
    mistake(GEAR, {"radii": [0, 50]}, ".radii", "zero"),
    mistake(GEAR, {"radii": [-30, -50]}, ".radii", "both", "internal"),
    mistake(GEAR, {"radii": [30, -30]}, ".radii", "larger"),
    mistake(GEAR, {"radii": [inf, 50]}, ".radii[0]", "too large"),
    mistake(GEAR, {"radii": [nan, 50]}, ".radii[0]", "not a number"),
    mistake(GEAR, {"radii": ["30 deg", 50]}, ".radii[0]", "length is wanted"),
    mistake(GEAR, {"radii": [True, 50]}, ".radii[0]", "true"),
    mistake(GEAR, {"teeth": [20, 31]}, "", "one of", "radii and teeth"),
    mistake(GEAR, {"radii": GONE}, "", "one of", "'radii', 'teeth' and 'ratio'"),
    mistake(GEAR, {"ratii": [1, 2]}, ".ratii", "did you mean"),
    mistake(GEAR, {"crossed": True}, ".crossed", "unknown key"),
    mistake(GEAR, {"mesh": {"a": 0}}, ".mesh", "'b'", "missing"),
    mistake(GEAR, {"mesh": {"a": 0, "frame": 0}}, ".mesh.frame", "'frame'"),
    mistake(GEAR, {"mesh": [0, 0]}, ".mesh", "object", "a list"),
    mistake(GEAR, {"mesh": {"a": "5 mm", "b": 0}}, ".mesh.a", "angle is wanted"),
    mistake(GEAR, {"mesh": {"a": inf, "b": 0}}, ".mesh.a", "too large"),
    mistake(TEETH, {"teeth": [20.5, 31]}, ".teeth[0]", "whole number", "20.5"),
    mistake(TEETH, {"teeth": ["20", 31]}, ".teeth[0]", "whole number", "'20'"),
    mistake(TEETH, {"teeth": [0, 31]}, ".teeth", "zero"),
    mistake(TEETH, {"teeth": [10**400, 31]}, ".teeth[0]", "too large"),
    mistake(RATIO, {"ratio": 0}, ".ratio", "zero"),
    mistake(RATIO, {"ratio": 1e-7}, ".ratio", "from 1e-06 to 1e+06"),
    mistake(RATIO, {"ratio": -2e6}, ".ratio", "from 1e-06 to 1e+06"),
    mistake(RATIO, {"ratio": "-2"}, ".ratio", "number", "'-2'"),
    mistake(RATIO, {"ratio": None}, ".ratio", "number", "null"),
    mistake(RATIO, {"ratio": -inf}, ".ratio", "too large"),
    mistake(BELT, {"radii": [30, -40]}, ".radii", "above zero"),
    mistake(BELT, {"radii": [200, 50]}, "", "80 mm", "150 mm", "open"),
    mistake(BELT, {"radii": [30, 50], "crossed": True}, "", "80 mm", "crossed"),
    mistake(BELT, {"crossed": "yes"}, ".crossed", "true or false", "'yes'"),
    mistake(BELT, {"radii": GONE, "ratio": -2, "crossed": True}, ".crossed", "sign of 'ratio'"),
    mistake(CHAIN, {"teeth": [15, -45]}, ".teeth", "above zero"),
    mistake(RACK, {"radius": 0}, ".radius", "zero"),
    mistake(RACK, {"radius": inf}, ".radius", "too large"),
    mistake(RACK, {"radius": "20 deg"}, ".radius", "length is wanted"),
    mistake(RACK, {"radius": GONE}, "", "'radius'", "missing"),
    mistake(RACK, {"point": "X"}, ".point", "'w'", "no point 'X'"),
    mistake(RACK, {"links": ["w", "frame"]}, ".line.through", "'w'", "no point 'O'"),
    mistake(RACK, {"line": {"through": "O", "to": "P", "angle": 3}}, ".line.angle", "not both"),
    mistake(RACK, {"mesh": {"displacement": 0}}, ".mesh", "'angle'", "missing"),
    mistake(RACK, {"mesh": {"displacement": "3 deg", "angle": 0}}, ".mesh.displacement", "length is wanted"),
    mistake(RACK, {"carrier": "frame"}, ".carrier", "unknown key"),
    mistake(RACK, {"module": 20}, ".module", "unknown key"),
    mistake(RACK, {"teeth": 2.5}, ".teeth", "a whole number of teeth"),
    mistake(RACK, {"friction": 0.1}, ".friction", "the friction of teeth follows their number"),
    mistake(RACK, {"friction": 0.1, "teeth": 20, "efficiency": 0.9}, ".efficiency", "not both"),
    mistake(SLOT, {"point": "P"}, ".point", "'w'", "no point 'P'"),
    mistake(SLOT, {"line": GONE}, "", "'line'", "missing"),
    mistake(SLOT, {"line": {"through": "C"}}, ".line.through", "'frame'", "no point 'C'"),
    mistake(SLOT, {"block": "C"}, ".block", "unknown key"),
    mistake(SLOT, {"turn": 90}, ".turn", "unknown key"),
]


def mistaken(entry):
    """A mechanism with this entry."""
    return pinion(entry) if {"rack", "slot"} & entry.keys() else wheels(entry)


INPUTS = [
    (wheels(GEAR, inputs=[driven("g", "30 mm")]), "$.inputs[0].position", "angle is wanted"),
    (wheels(GEAR, inputs=[driven("g", 30, velocity=5)]), "$.inputs[0].velocity", "unclear"),
    (pinion(RACK, inputs=[driven("r", "30 deg")]), "$.inputs[0].position", "length is wanted"),
    (pinion(RACK, inputs=[driven("r", 30, velocity="1 rad/s")]), "$.inputs[0].velocity", "velocity is wanted"),
]
