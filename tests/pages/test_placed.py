"""The numbers of a file after one of its pins has moved, as pages find them: all other pins stay where they are."""

from __future__ import annotations

import json
import subprocess

import numpy as np
import pytest

import planar
from planar.document.files import read_asset
from planar.foundation.units import parse_unit
from tests.known import MODELS
from tests.page_scripts import NODE, needs_node

COUPLED = {
    "epicyclic-coupler": ("O", "P", "E", "B"),
    "geared-five-bar": ("O", "A", "P"),
    "sun-and-planet": ("O", "E", "P"),
    "rack-steering": ("O", "A", "L"),
    "belt-arm": ("O", "E"),
    "chain-swing-arm": ("O", "W"),
    "gear-reducer": ("O2", "M"),
    "slotted-lever": ("O", "D", "C"),
    "valve-cam": ("O", "P"),
    "whitworth": ("C", "S"),
}
"""Pins of files with wheels, racks, belts, slots and cams, each led aside."""
SLID = {("slotted-lever", "D"): "A", ("slotted-lever", "C"): "A", ("valve-cam", "O"): "PT", ("whitworth", "C"): "AR"}
SLID[("whitworth", "S")] = "A"
"""What slides on lines that move with a pin, and so has to come along."""
SCRIPTS = ("stage/plane.js", "stage/symbols.js", "stage/coupled.js", "stage/places.js")
LED = """const led = cases.map(({ file, at, units, pin, to, along }) => {
  const placed = new Placed(file, new Map(Object.entries(at)), units);
  return along ? placed.along(pin, to, null, null).file : placed.moved(pin, to, null).file;
});
process.stdout.write(JSON.stringify(led));"""


def led(cases):
    """The files after pins have moved."""
    scripts = "\n".join(map(read_asset, SCRIPTS))
    text = f"{scripts}\nconst cases = {json.dumps(cases)};\n{LED}"
    ran = subprocess.run([NODE, "-"], input=text, capture_output=True, text=True, check=False, timeout=60)
    assert ran.returncode == 0, ran.stderr[-2000:]
    return json.loads(ran.stdout)


def case(mechanism, pin, along=False):
    """A pin a little aside, as the scripts read it."""
    points = {name: point.position for name, point in planar.solve(mechanism).points.items()}
    size = float(np.ptp(np.array(list(points.values())), axis=0).max())
    to = points[pin] + size * np.array([0.05, 0.03])
    units = {kind: parse_unit(getattr(mechanism.units, kind)).to_si(1.0) for kind in ("length", "angle")}
    at = {name: place.tolist() for name, place in points.items()}
    value = {"file": planar.to_dict(mechanism), "at": at, "units": units, "pin": pin, "to": to.tolist(), "along": along}
    return value, points, to


@needs_node
def test_wheels_racks_belts_slots_and_cams_follow_a_pin_and_all_others_stay():
    every = [(stem, pin, *case(MODELS[stem], pin)) for stem, pins in COUPLED.items() for pin in pins]
    for (stem, pin, _, points, to), file in zip(every, led([each[2] for each in every]), strict=True):
        found = planar.solve(planar.from_dict(file))
        size = float(np.ptp(np.array(list(points.values())), axis=0).max())
        for name, place in points.items():
            if name in SLID.get((stem, pin), ""):
                continue
            wanted = to if name == pin else place
            assert found.point(name).position == pytest.approx(wanted, abs=1e-9 * size), (stem, pin, name)


@needs_node
def test_a_pin_with_the_rest_changes_numbers_of_one_link_alone():
    stems = ("000-P1", "slider-crank", "watt-six-bar")
    every = [(stem, pin, *case(MODELS[stem], pin, along=True)) for stem in stems for pin in ("A", "B")]
    for (stem, pin, *_), file in zip(every, led([each[2] for each in every]), strict=True):
        before, after = (planar.dimensions(each) for each in (MODELS[stem], planar.from_dict(file)))
        changed = [name for name in before if after[name] != pytest.approx(before[name], rel=1e-12, abs=1e-15)]
        links = {name.split(".")[0] for name in changed if not name.endswith(".position")}
        assert len(links) == 1, (stem, pin, changed)


REFUSED = {
    'Couplings.gear(draft, ["AB", "AB"], -2)': "wheels are two links",
    'Couplings.gear(draft, ["AB", "CD"], 0)': "a number, and not 0",
    'Couplings.gear(draft, ["frame", "AB"], 2)': "no link carries both",
    'Couplings.belt(draft, ["AB", "CD"], [-1, 2], false)': "radii above zero",
    'Couplings.rack(draft, "AB", "AB", [0, 0])': "rolls on another link",
    'Couplings.rack(draft, "CD", "AB", [0.1, 0])': "lies on AB",
    'Couplings.slot(draft, { pin: "B" }, "AB", [0, 0])': "a link is wanted at B",
    'Couplings.cam(draft, "AB", "A", { lift: {}, roller: null })': "the pin of its follower",
    'Couplings.cam(draft, "AB", "D", { lift: {}, roller: 1 })': "larger than what is between",
    'Couplings.camLaw({ motion: "cycloidal", angles: [0, 60, 120] })': "above 0 deg",
    'Couplings.camLaw({ motion: "cycloidal", angles: [200, null, 170] })': "360 deg at the most",
    'Draw.slide(draft, { pin: "B" }, "AB", [0, 0])': "it cannot slide on it",
}
"""What cannot be drawn of two bars on the frame, one in line with the other's pin, and why."""


@needs_node
def test_what_cannot_be_drawn_is_refused_in_a_sentence():
    links = {
        "frame": {"points": {"A": [0, 0], "C": [100, 0]}},
        "AB": {"ends": ["A", "B"], "length": 40},
        "CD": {"ends": ["C", "D"], "length": 30},
    }
    file = {"planar": 1, "frame": "frame", "links": links, "pairs": [{"turning": "A"}, {"turning": "C"}]}
    at = {"A": [0, 0], "B": [0.04, 0], "C": [0.1, 0], "D": [0.1, 0.03]}
    scripts = "\n".join(map(read_asset, (*SCRIPTS, "editor/document.js", "editor/couplings.js")))
    acts = ", ".join(f"(draft) => {act}" for act in REFUSED)
    text = f"""{scripts}
    const told = [{acts}].map((act) => {{
      const draft = {{ file: {json.dumps(file)}, at: new Map(Object.entries({json.dumps(at)})) }};
      draft.units = {{ length: 1e-3, angle: Math.PI / 180 }};
      try {{ return `drawn: ${{act(draft)}}`; }} catch (problem) {{ return problem.message; }}
    }});
    process.stdout.write(JSON.stringify(told));"""
    ran = subprocess.run([NODE, "-"], input=text, capture_output=True, text=True, check=True, timeout=60)
    for act, told, wanted in zip(REFUSED, json.loads(ran.stdout), REFUSED.values(), strict=True):
        assert wanted in told, act
