"""What mechanisms are called, how their links are numbered, and how their pairs are listed."""

import json
import re
from cmath import exp
from math import radians
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planar
from planar.analysis.identity.mechanism_names import mechanism_names
from planar.document.files import model_files
from planar.model.link_graph import link_numbers, pair_labels_by_type
from tests.builders import four_bar_document


def made(frame, links, pairs, **more):
    """A mechanism file in mm and degrees whose frame has these points."""
    units = {"length": "mm", "angle": "deg"}
    links = {"frame": {"points": frame}} | links
    return {"planar": 1, "name": "M", "units": units, "frame": "frame", "links": links, "pairs": pairs} | more


def bar(*ends, length, **points):
    return {"ends": list(ends), "length": length} | ({"points": points} if points else {})


def pins(text):
    return [{"turning": name} for name in text.split()]


def slide(name, first, second, point, through=(0, 0), angle=0, turn=0):
    line = {"through": through if isinstance(through, str) else list(through), "angle": angle}
    return {"sliding": name, "links": [first, second], "line": line, "point": point, "turn": turn}


def bars_of_four(frame, crank, coupler, rocker, **more):
    names, units = ["frame", "OA", "AB", "QB"], {"length": "mm", "angle": "deg"}
    return four_bar_document(crank, coupler, rocker, frame, pins="OABQ", names=names, name="M", units=units, **more)


def folded(sketch, position=70, **inputs):
    given = {"inputs": [{"pair": "O", "position": position}]} if position is not None else {}
    return bars_of_four(100, 60, 100, 60, sketch=sketch, **given)


def crank_and_piston(crank, rod, off=0.0, wrist=0.0, turn=0.0):
    """The line of slide `off` beside the shaft, the piston's pin `wrist` to the left of the piston's own line."""
    links = {"OA": bar("O", "A", length=crank), "AB": bar("A", "B", length=rod)}
    at = complex(0, wrist) * exp(1j * radians(turn)).conjugate()
    links["piston"] = {"points": {"B": [at.real, at.imag], "G": [0, 0]}}
    return made({"O": [0, 0]}, links, [*pins("O A B"), slide("S", "frame", "piston", "G", (0, off), 0, turn)])


def slider_crank_line_on_piston(crank, rod, off):
    links = {"OA": bar("O", "A", length=crank), "AB": bar("A", "B", length=rod), "piston": {"points": {"B": [3, 4]}}}
    at = complex(50, off) * exp(1j * radians(25))
    frame = {"O": [0, 0], "G": [at.real, at.imag]}
    return made(frame, links, [*pins("O A B"), slide("S", "piston", "frame", "G", "B", 25, -25)])


def turning_block(fixed, crank, off=0.0, line_on_lever=True):
    """A crank at O with a block at A that slides on a lever pinned at C, whose line passes C at a distance."""
    links = {"OA": bar("O", "A", length=crank), "lever": {"points": {"C": [0, 0]}}, "block": {"points": {"A": [0, 0]}}}
    on = slide("S", "lever", "block", "A", (0, off)) if line_on_lever else slide("S", "block", "lever", "C", (0, off))
    return made({"O": [0, 0], "C": [fixed, 0]}, links, [*pins("O A C"), on])


def pin_in_slot(fixed, crank):
    links = {"OA": bar("O", "A", length=crank), "lever": {"points": {"C": [7, 0]}}}
    slot = {"slot": "S", "links": ["lever", "OA"], "line": {"through": [0, 4], "angle": -29.7448813}, "point": "A"}
    return made({"O": [0, 0], "C": [fixed, 0]}, links, [*pins("O C"), slot])


def ram(fixed, crank, across=False):
    """A turning block whose lever moves a ram, by a rod or by a block in a slot across the ram."""
    value = turning_block(fixed, crank)
    value["links"]["lever"]["points"]["D"] = [300, 0]
    value["links"]["ram"] = {"points": {"R": [0, 0]}}
    value["pairs"] += [{"turning": "D"}, slide("G", "frame", "ram", "R", (0, 200))]
    if across:
        value["links"]["second block"] = {"points": {"D": [0, 0]}}
        value["pairs"].append(slide("H", "ram", "second block", "D", (0, 0), 90))
    else:
        value["links"]["rod"] = bar("D", "R", length=180)
        value["pairs"].append({"turning": "R"})
    return value


def double_slider(fixed, angle=90):
    """Crank, block, yoke and guide, one of them fixed: a pin between crank and block, a slide on either side."""
    links = {"bar": {"points": {"P": [0, 0], "Q": [40, 0]}}, "guide": {"points": {"P": [0, 0], "K": [5, 0]}}}
    links |= {"yoke": {"points": {"Y": [0, 0]}}, "block": {"points": {"Q": [0, 0]}}}
    pairs = [*pins("P Q"), slide("S", "guide", "yoke", "Y", "K"), slide("T", "yoke", "block", "Q", "Y", angle)]
    return made({}, links, pairs) | {"frame": fixed, "links": links}


def rapson(fixed):
    links = {"tiller": {"points": {"O": [0, 0]}}, "block": {"points": {"K": [0, 0]}}}
    links |= {"carriage": {"points": {"K": [0, 0]}}, "hull": {"points": {"O": [0, 0], "G": [0, 9]}}}
    pairs = [*pins("O K"), slide("S", "tiller", "block", "K", "O"), slide("T", "hull", "carriage", "K", "G")]
    return made({}, links, pairs) | {"frame": fixed, "links": links}


def wedge_and_follower(angle=30):
    links = {"wedge": {"points": {"W": [0, 0]}}, "follower": {"points": {"V": [0, 0]}}}
    pairs = [
        slide("S", "frame", "wedge", "W", "O"),
        slide("T", "wedge", "follower", "V", "W", angle, -angle),
        slide("U", "frame", "follower", "V", "O", 90, -90),
    ]
    return made({"O": [0, 0]}, links, pairs)


def graph(fixed, *joints, seed=5, links=None):
    """Links with points anywhere, joined as "A: a b c" (a pin) or "S- a b" (a slide)."""
    random, found, pairs = Random(seed), {}, []
    for joint in joints:
        name, some = joint.split(": ")
        some = some.split()
        for link in some:
            found.setdefault(link, {"points": {}})["points"][name.strip("-")] = [random.uniform(-9, 9) for _ in "xy"]
        plain = {"turning": name, "links": some}
        through = name.strip("-")
        pairs.append(slide(through, *some, through, through, random.uniform(0, 90)) if "-" in name else plain)
    return made({}, {}, pairs) | {"frame": fixed, "links": found | (links or {})}


WATT = ("A: p l", "B: l m", "C: m q", "D: q n", "E: n o", "F: o p", "G: p q")
STEPHENSON = ("A: p l", "B: l q", "C: p m", "D: m q", "E: p n", "F: n o", "G: o q")
TOGGLE = ("O: g crank", "A: crank rod", "B: upper rod lower", "C: upper g", "D: lower slider")


def five_bar_with(*more, slider=False):
    links = {"a": bar("O", "A", length=30), "b": bar("A", "B", length=60), "c": bar("C", "B", length=65)}
    last = [slide("S", "frame", "d", "C", (50, 0), 90)] if slider else [*pins("Q")]
    links["d"] = {"points": {"C": [0, 0]}} if slider else bar("Q", "C", length=30)
    frame = {"O": [0, 0]} if slider else {"O": [0, 0], "Q": [80, 0]}
    return made(frame, links, [*pins("O A B C"), *last, *more])


def wheels(carrier=None, sun=None):
    """Two wheels in mesh, on the frame or on an arm, the first of them perhaps standing still."""
    links = {"arm": bar("O", "P", length=50), "wheel": {"points": {"O": [0, 0]}}, "planet": {"points": {"P": [0, 0]}}}
    pairs = [{"turning": "O", "links": ["frame", "arm", *([] if sun else ["wheel"])]}, {"turning": "P"}]
    if sun:
        del links["wheel"]
    if not carrier:
        links = {"wheel": {"points": {"O": [0, 0]}}, "planet": {"points": {"P": [0, 0]}}}
        pairs = pins("O P")
    mesh = {"gear": "G", "links": [sun or "wheel", "planet"], "ratio": -2} | ({"carrier": carrier} if carrier else {})
    return made({"O": [0, 0], "P": [50, 0]} if not carrier else {"O": [0, 0]}, links, [*pairs, mesh])


def rack():
    links = {"pinion": {"points": {"O": [0, 0]}}, "bar": {"points": {"R": [0, 0]}}}
    tooth = {"rack": "Z", "links": ["bar", "pinion"], "line": {"through": "R"}, "point": "O", "radius": 10}
    return made({"O": [0, 0]}, links, [*pins("O"), slide("S", "frame", "bar", "R", (0, -10)), tooth])


def sun_and_planet():
    """Watt's: a four-bar whose coupler carries the planet, the sun on the crank's shaft."""
    value = bars_of_four(100, 30, 90, 60)
    value["links"]["sun"] = {"points": {"O": [0, 0]}}
    value["pairs"].append({"gear": "G", "links": ["AB", "sun"], "carrier": "OA", "ratio": -1})
    return value


def cell(short=100, long=250, side=120, other=120, base=100):
    links = {
        "crank": bar("C", "P", length=short),
        **{f"O{end}": bar("O", end, length=long) for end in "AB"},
        **{f"P{end}": bar("P", end, length=side) for end in "AB"},
        **{f"Q{end}": bar("Q", end, length=other) for end in "AB"},
    }
    return made({"O": [0, 0], "C": [base, 0]}, links, pins("O C P A B Q"))


def pantograph(side=200):
    links = {
        "OD": bar("O", "D", length=300, A={"along": ["O", "D"], "distance": 100}),
        "DQ": bar("D", "Q", length=300, C={"along": ["D", "Q"], "distance": 100}),
        "AP": bar("A", "P", length=100),
        "PC": bar("P", "C", length=side),
    }
    return made({"O": [0, 0]}, links, pins("O D A P C"))


def three_cranks(last=60, rod=80, mirrored=1, scale=1):
    frame = {"O": [0, 0], "P": [100, 0], "Q": [50, 80]}
    links = {f"crank {x}": bar(x, x.lower(), length=last if x == "Q" else 60) for x in "OPQ"}
    spots = {"o": (0, 0), "p": (0, -100 * mirrored), "q": (rod, -50 * mirrored)}
    links["rod"] = {"points": {pin: [7 + scale * x, scale * y] for pin, (x, y) in spots.items()}}
    return made(frame, links, pins("O P Q o p q"))


def star(fixed, cylinders):
    links = {"block": {"points": {"O": [0, 0]}}, "crank": bar("O", "A", length=40)}
    pairs = [*pins("O A")]
    for k in range(cylinders):
        links |= {f"rod {k}": bar("A", f"P{k}", length=140), f"piston {k}": {"points": {f"P{k}": [0, 0]}}}
        pairs += [*pins(f"P{k}"), slide(f"S{k}", "block", f"piston {k}", f"P{k}", "O", 360 * k / cylinders)]
    return made({}, links, pairs) | {"frame": fixed, "links": links}


def scissor_of_stages(stages, middle=0.5):
    links, base = {}, "O"
    for k in range(stages):
        a, b = (
            ("O", f"R{k}") if k == 0 else (f"L{k - 1}", f"R{k}"),
            ("F", f"L{k}") if k == 0 else (f"R{k - 1}", f"L{k}"),
        )
        for name, ends in (("a", a), ("b", b)):
            links[f"{name}{k}"] = bar(*ends, length=60, **{f"M{k}": {"along": list(ends), "distance": 60 * middle}})
    top = stages - 1
    links |= {"foot": {"points": {"F": [0, 0]}}, "head": {"points": {f"R{top}": [0, 0]}}}
    links["platform"] = {"points": {f"L{top}": [0, 0], "edge": [70, 0]}}
    inner = [f"{x}{k}" for k in range(stages) for x in ("MLR" if k < top else "M")]
    pairs = [*pins(" ".join(["O", "F", *inner, f"L{top}", f"R{top}"]))]
    pairs += [slide("S", "frame", "foot", "F", base), slide("T", "platform", "head", f"R{top}", f"L{top}")]
    return made({"O": [0, 0]}, links, pairs)


def arm(links, branch=False):
    ends = "ABCDEFG"
    found = {f"link {k}": bar(ends[k], ends[k + 1], length=30) for k in range(links)}
    if branch:
        found["branch"] = bar("B", "Z", length=20)
    return made({"A": [0, 0]}, found, pins(" ".join(ends[:links])))


RACK = rack()
FOUR, CHANGE = ("four-bar chain",), ("four-bar chain", "change-point four-bar")
SLIDER = ("slider-crank chain",)
INVERTED = (*SLIDER, "inverted slider-crank")
WHITWORTH = (*INVERTED, "quick return", "Whitworth quick return")
LEVER = (*INVERTED, "quick return", "crank and slotted lever", "oscillating cylinder")
PENDULUM = (*SLIDER, "fixed-slider inversion", "pendulum pump")
DOUBLE = ("double slider-crank chain",)
YOKE = (*DOUBLE, "Scotch yoke", "cosine (sine) mechanism")
RAPSON = ("Rapson's slide", "tangent mechanism")
TWO_WAYS = tuple(f"degenerate {name} with a slider" for name in ("Watt II six-bar", "Stephenson III six-bar"))
RAM = ("Watt II six-bar with 2 sliders",)

CASES = {
    "crank-rocker": (bars_of_four(200, 50, 180, 120), (*FOUR, "crank-rocker")),
    "crank-rocker from its rocker": (bars_of_four(200, 120, 180, 50), (*FOUR, "crank-rocker")),
    "drag link": (bars_of_four(40, 100, 90, 110), (*FOUR, "double-crank", "drag link")),
    "double-rocker": (bars_of_four(120, 100, 40, 90), (*FOUR, "Grashof double-rocker")),
    "triple-rocker": (bars_of_four(150, 90, 70, 85), (*FOUR, "triple-rocker")),
    "change-point crank-rocker": (bars_of_four(100, 40, 90, 50), (*CHANGE, "change-point crank-rocker")),
    "change-point double-crank": (bars_of_four(40, 100, 90, 50), (*CHANGE, "change-point double-crank")),
    "change-point double-rocker": (bars_of_four(90, 50, 40, 100), (*CHANGE, "change-point double-rocker")),
    "hardly Grashof": (bars_of_four(100, 40, 90, 50.01), (*FOUR, "crank-rocker")),
    "hardly not Grashof": (bars_of_four(100, 40, 90, 49.99), (*FOUR, "triple-rocker")),
    "rhombus": (bars_of_four(80, 80, 80, 80), (*CHANGE, "rhombus")),
    "kite": (bars_of_four(100, 100, 60, 60), (*CHANGE, "kite (deltoid)")),
    "kite with a short frame": (bars_of_four(60, 100, 100, 60), (*CHANGE, "kite (deltoid)")),
    "parallelogram": (folded({"A": [20, 56], "B": [120, 56]}), (*CHANGE, "parallelogram")),
    "antiparallelogram": (folded({"A": [20, 56], "B": [70, -50]}), (*CHANGE, "antiparallelogram")),
    "either": (folded({}, position=None), (*CHANGE, "parallelogram or antiparallelogram")),
    "too long to close": (bars_of_four(500, 40, 90, 50), FOUR),
    "in-line slider-crank": (crank_and_piston(60, 200), (*SLIDER, "slider-crank", "in-line slider-crank")),
    "offset slider-crank": (crank_and_piston(60, 200, 40), (*SLIDER, "slider-crank", "offset slider-crank")),
    "offset of the wrist pin": (
        crank_and_piston(60, 200, 0, 7, 30),
        (*SLIDER, "slider-crank", "offset slider-crank"),
    ),
    "offsets that cancel": (
        crank_and_piston(60, 200, 7, -7, 30),
        (*SLIDER, "slider-crank", "in-line slider-crank"),
    ),
    "line on the piston": (slider_crank_line_on_piston(60, 200, 0), (*SLIDER, "slider-crank", "in-line slider-crank")),
    "line on the piston, offset": (
        slider_crank_line_on_piston(60, 200, 9),
        (*SLIDER, "slider-crank", "offset slider-crank"),
    ),
    "isosceles slider-crank": (crank_and_piston(90, 90), (*SLIDER, "slider-crank", "isosceles slider-crank")),
    "rocker-slider": (crank_and_piston(60, 90, 40), (*SLIDER, "rocker-slider")),
    "rocker-slider with a long rocker": (crank_and_piston(90, 60, 40), (*SLIDER, "rocker-slider")),
    "pendulum pump": (crank_and_piston(200, 60), PENDULUM),
    "pendulum pump, line on the plunger": (slider_crank_line_on_piston(200, 60, 9), PENDULUM),
    "Whitworth": (turning_block(40, 100), WHITWORTH),
    "Whitworth, offset": (turning_block(40, 100, 50), WHITWORTH),
    "Whitworth, line on the block": (turning_block(40, 100, line_on_lever=False), WHITWORTH),
    "neither turns fully": (turning_block(40, 100, 70), INVERTED),
    "neither turns fully on a long frame": (turning_block(100, 40, 70), INVERTED),
    "crank and slotted lever": (turning_block(100, 40), LEVER),
    "oscillating cylinder": (turning_block(100, 40, line_on_lever=False), LEVER),
    "isosceles turning block": (turning_block(70, 70), (*INVERTED, "isosceles inverted slider-crank")),
    "pin in a slot": (pin_in_slot(100, 40), LEVER),
    "pin in a slot that turns": (pin_in_slot(40, 100), WHITWORTH),
    "pin in a slot in line": (pin_in_slot(70, 70), (*INVERTED, "isosceles inverted slider-crank")),
    "elliptical trammel": (double_slider("yoke"), (*DOUBLE, "elliptical trammel")),
    "elliptical trammel, skew": (double_slider("yoke", 50), (*DOUBLE, "elliptical trammel")),
    "Scotch yoke": (double_slider("guide"), YOKE),
    "Scotch yoke, the other": (double_slider("block"), YOKE),
    "Oldham": (double_slider("bar"), (*DOUBLE, "Oldham coupling")),
    "parallel slides": (double_slider("yoke", 0), DOUBLE),
    "Rapson": (rapson("hull"), RAPSON),
    "Rapson on its tiller": (rapson("tiller"), RAPSON),
    "wedge": (wedge_and_follower(), ("wedge mechanism",)),
    "no wedge": (wedge_and_follower(0), ()),
    "five-bar": (five_bar_with(), ("five-bar chain",)),
    "five-bar with a slider": (five_bar_with(slider=True), ("five-bar chain with a slider",)),
    "geared five-bar": (five_bar_with({"gear": "G", "links": ["a", "d"], "ratio": -1}), ("geared five-bar",)),
    "geared five-bar with a slider": (
        five_bar_with({"gear": "G", "links": ["frame", "b"], "carrier": "a", "ratio": -1}, slider=True),
        ("geared five-bar with a slider",),
    ),
    "geared otherwise": (
        five_bar_with({"gear": "G", "links": ["frame", "c"], "carrier": "d", "ratio": -1}) | {"frame": "a"},
        ("geared five-bar",),
    ),
    "geared across": (five_bar_with({"gear": "G", "links": ["a", "c"], "ratio": -1}), ("geared linkage",)),
    "train": (wheels(), ("train of wheels",)),
    "epicyclic": (wheels("arm"), ("epicyclic train",)),
    "epicyclic on a fixed sun": (wheels("arm", "frame"), ("epicyclic train",)),
    "sun and planet": (sun_and_planet(), ("geared linkage", "epicyclic train")),
    "geared four-bar": (
        bars_of_four(200, 50, 180, 120)
        | {"pairs": [*pins("O A B Q"), {"gear": "G", "links": ["OA", "QB"], "ratio": -1}]},
        ("geared linkage",),
    ),
    "rack and pinion": (rack(), ("rack and pinion",)),
    "rack and pinion in a loop": (
        made({"O": [0, 0]}, RACK["links"], [*RACK["pairs"], slide("T", "frame", "bar", "R", (0, -10))]),
        ("rack and pinion",),
    ),
    "Watt I": (graph("l", *WATT), ("Watt I six-bar",)),
    "Watt I, the other binaries": (graph("o", *WATT), ("Watt I six-bar",)),
    "Watt II": (graph("q", *WATT), ("Watt II six-bar",)),
    "Stephenson I": (graph("m", *STEPHENSON), ("Stephenson I six-bar",)),
    "Stephenson II": (graph("o", *STEPHENSON), ("Stephenson II six-bar",)),
    "Stephenson III": (graph("p", *STEPHENSON), ("Stephenson III six-bar",)),
    "Watt II with a slider": (graph("p", *WATT[:5], "F-: o p", "G: p q"), ("Watt II six-bar with a slider",)),
    "degenerate": (
        graph("o", "A: p l m", "B: l n", "C: m q", "D: n q", "E: q o", "F: o p"),
        tuple(f"degenerate {name} six-bar" for name in ("Watt I", "Stephenson I", "Stephenson II")),
    ),
    "toggle": (graph("g", *TOGGLE, "S-: g slider"), (*TWO_WAYS, "toggle mechanism")),
    "toggle with a rocker for its slider": (
        graph("g", *TOGGLE, "E: g slider"),
        tuple(name.removesuffix(" with a slider") for name in TWO_WAYS),
    ),
    "shaper": (ram(120, 60), (*RAM, "crank and slotted lever", "quick return with ram (shaper)")),
    "shaper by Whitworth": (ram(40, 100), (*RAM, "Whitworth quick return", "quick return with ram (shaper)")),
    "shaper with two blocks": (
        ram(120, 60, across=True),
        ("Watt II six-bar with 3 sliders", "crank and slotted lever", "quick return with ram (shaper)"),
    ),
    "no quick return": (ram(80, 80), RAM),
    "double butterfly": (
        graph("c", "1: w x", "2: y z", "3: w a", "4: w b", "5: x c", "6: x d", "7: y a", "8: y c", "9: z b", "0: z d"),
        ("double butterfly linkage",),
    ),
    "single flier": (
        graph("w", "1: y z", "2: y a", "3: z b", "4: a b c", "5: y d", "6: z e", "7: d w", "8: e w", "9: c w"),
        ("single flier eight-bar",),
    ),
    "double flier": (
        graph("a", "1: w x", "2: w y", "3: x a", "4: y a", "5: x b", "6: y c", "7: w d", "8: b z", "9: c z", "0: d z"),
        ("double flier eight-bar",),
    ),
    "Peaucellier": (cell(), ("Peaucellier-Lipkin linkage", "exact straight-line linkage")),
    "Peaucellier on a circle": (cell(base=90), ("Peaucellier-Lipkin linkage",)),
    "no Peaucellier": (cell(other=110), ()),
    "pantograph": (pantograph(), ("pantograph",)),
    "no pantograph": (pantograph(210), ()),
    "parallel cranks": (three_cranks(), ("parallel cranks with a coupling rod",)),
    "cranks of two lengths": (three_cranks(last=70), ()),
    "cranks on another rod": (three_cranks(rod=90), ()),
    "cranks on the rod's back": (three_cranks(mirrored=-1), ()),
    "cranks on a larger rod": (three_cranks(scale=1.5), ()),
    "rotary engine": (star("crank", 5), ("rotary engine",)),
    "radial engine": (star("block", 3), ("radial engine",)),
    "scissor lift": (scissor_of_stages(3), ("scissor lift",)),
    "scissor lift of one stage": (scissor_of_stages(1), ("Watt I six-bar with 2 sliders", "scissor lift")),
    "no scissor lift": (scissor_of_stages(2, 0.4), ()),
    "serial arm": (arm(3), ("open chain of 3 moving links", "serial arm")),
    "pendulum": (arm(1), ("open chain of 1 moving link",)),
    "branched arm": (arm(3, branch=True), ("open chain of 4 moving links",)),
    "branched link": (graph("a", "1: a b", "2: b c", "3: b d"), ("open chain of 3 moving links",)),
    "two arms on the frame": (graph("b", "1: a b", "2: b c"), ("open chain of 2 moving links",)),
    "triangle": (graph("a", "1: a b", "2: b c", "3: c a"), ()),
    "in two pieces": (graph("a", "1: a b", "2: c d"), ()),
    "apart from the frame": (graph("e", "1: a b", "2: b c", links={"e": {"points": {"E": [0, 0]}}}), ()),
    "with a link to spare": (
        made({"O": [0, 0]}, {"a": bar("O", "A", length=1), "b": bar("B", "C", length=1)}, pins("O")),
        (),
    ),
    "eight-bar without a name": (
        graph("a", "1: a b", "2: b c", "3: c d", "4: d a", "5: c e", "6: e f", "7: f a", "8: e g", "9: g h", "0: h a"),
        (),
    ),
}

MODELS = {
    "000-P1": ("triple-rocker",),
    "000-P2": ("toggle mechanism",),
    "000-P3": ("triple-rocker",),
    "000-P4": ("Stephenson III six-bar with 2 sliders",),
    "000-P4-BC480": ("Stephenson III six-bar with 2 sliders",),
    "000-P5": ("in-line slider-crank",),
    "002-E3.1": ("triple-rocker",),
    "002-E3.2": ("in-line slider-crank",),
    "002-E3.3": ("Watt II six-bar with a slider",),
    "002-E3.4": (),
    "002-E3.5": ("toggle mechanism",),
    "004-COS": ("Scotch yoke", "cosine (sine) mechanism"),
    "004-EX-piston": ("in-line slider-crank",),
    "004-OABQ": ("Stephenson III six-bar with a slider",),
    "004-QR": ("crank and slotted lever", "quick return with ram (shaper)"),
    "004-SC12": ("in-line slider-crank",),
    "antiparallelogram": ("antiparallelogram",),
    "atkinson-cycle-engine": ("Stephenson III six-bar with a slider",),
    "chain-42": (),
    "chebyshev-straight-line": ("Grashof double-rocker",),
    "coupled-wheels": ("parallel cranks with a coupling rod",),
    "crank-and-slotted-lever": ("crank and slotted lever", "quick return with ram (shaper)"),
    "crank-rocker": ("crank-rocker",),
    "double-butterfly": ("double butterfly linkage",),
    "double-flier": ("double flier eight-bar",),
    "double-rocker": ("Grashof double-rocker",),
    "drag-link": ("drag link",),
    "elliptical-trammel": ("elliptical trammel",),
    "excavator-arm": (),
    "four-bar": ("triple-rocker",),
    "hand-pump": ("pendulum pump",),
    "offset-slider-crank": ("offset slider-crank",),
    "oldham": ("Oldham coupling",),
    "open-arm": ("serial arm",),
    "oscillating-cylinder": ("oscillating cylinder",),
    "pantograph": ("pantograph",),
    "peaucellier-lipkin": ("Peaucellier-Lipkin linkage", "exact straight-line linkage"),
    "rapsons-slide": ("Rapson's slide",),
    "rotary-engine": ("rotary engine",),
    "scissor-lift": ("scissor lift",),
    "scotch-yoke": ("Scotch yoke",),
    "single-flier": ("single flier eight-bar",),
    "slider-crank": ("in-line slider-crank",),
    "stephenson-1-six-bar": ("Stephenson I six-bar",),
    "stephenson-2-six-bar": ("Stephenson II six-bar",),
    "stephenson-3-five-bar": ("Stephenson III six-bar",),
    "ten-link": (),
    "three-parallel-cranks": ("parallel cranks with a coupling rod",),
    "toggle-press": ("toggle mechanism",),
    "triple-rocker": ("triple-rocker",),
    "watt-1-six-bar": ("Watt I six-bar",),
    "watt-six-bar": ("Watt II six-bar",),
    "whitworth": ("Whitworth quick return", "quick return with ram (shaper)"),
    "windscreen-wiper": ("degenerate Watt II six-bar", "degenerate Stephenson III six-bar"),
}


def test_names():
    for case, (value, expected) in CASES.items():
        assert mechanism_names(planar.from_dict(value)) == expected, case


@pytest.mark.parametrize("model", MODELS)
def test_models_are_called_what_they_are(model):
    found = mechanism_names(planar.load(model))
    assert set(MODELS[model]) <= set(found)
    assert bool(found) == bool(MODELS[model])


def test_no_name_is_given_that_is_not_tried_here():
    """Every name that stands in the code is the answer to one of the cases."""
    from planar.analysis.identity.four_link_names import _DOUBLE_SLIDER, _GRASHOF, _INVERSIONS
    from planar.analysis.identity.mechanism_names import FAMILIES, PATTERNS, SIX_BARS

    tables = [*_DOUBLE_SLIDER.values(), *_GRASHOF, *_INVERSIONS.values()]
    told = {name for some in tables for name in some if "{" not in name}
    told |= {each.name for each in (*PATTERNS, *FAMILIES)} | {name for name, *_ in SIX_BARS}
    assert told <= {name for _, some in CASES.values() for name in some}


PARTS = ("planar", "name", "units", "frame", "links", "pairs", "inputs", "sketch")
VALUES = [value for value, _ in CASES.values()] + [json.loads(path.read_text("utf-8")) for path in model_files()]


def full(value):
    """A mechanism file in full, with nothing left to what the reader adds from the order or the names in it."""
    return planar.to_dict(planar.from_dict({key: value[key] for key in PARTS if key in value}))


def known(value):
    """Every name of a link, a point and a pair."""
    found = set(value["links"]) | {pair[next(iter(pair))] for pair in value["pairs"]}
    return found | {
        name for link in value["links"].values() for name in (*link.get("ends", ()), *link.get("points", ()))
    }


def renamed(part, new, under=""):
    """A part of a file with its names exchanged."""

    def word(text):
        return "".join(new.get(piece, piece) for piece in re.split("([.:,])", text))

    if isinstance(part, dict):
        named = under in ("links", "points", "distances", "mesh", "sketch")
        return {word(key) if named else key: renamed(each, new, "" if named else key) for key, each in part.items()}
    if isinstance(part, list):
        return [renamed(each, new) for each in part]
    return word(part) if isinstance(part, str) and under not in ("velocity", "acceleration", "position") else part


def shuffled(value, random):
    """The same mechanism with links, points, pairs, and the links of a pin, in another order."""

    def mixed(some):
        return random.sample(list(some), len(some))

    links = {}
    for name, link in mixed(value["links"].items()):
        links[name] = link | ({"points": dict(mixed(link["points"].items()))} if "points" in link else {})
    pairs = []
    for pair in mixed(value["pairs"]):
        # an input at a pin of several names two of its links in their order there
        driven = any(given["pair"].startswith(f"{pair.get('turning')}:") for given in value.get("inputs", ()))
        free = "turning" in pair and not driven
        order = mixed(range(len(pair["links"]))) if free else range(len(pair["links"]))
        turned = {key: [pair[key][k] for k in order] for key in ("links", "points") if key in pair}
        pairs.append(pair | turned)
    return value | {"links": links, "pairs": pairs}


def moved(value, random, unit):
    """The same mechanism in another unit of length, and its links drawn in other axes, where these are free."""
    spots = {}
    for name, link in value["links"].items():
        if "ends" not in link and "axis" not in link and all(isinstance(at, list) for at in link["points"].values()):
            spots[name] = random.uniform(-180, 180), complex(random.uniform(-99, 99), random.uniform(-99, 99))

    def there(link, at):
        angle, shift = spots.get(link, (0.0, 0.0))
        z = complex(*at) * exp(1j * radians(angle)) + shift
        return [z.real, z.imag]

    def turn(link):
        return spots.get(link, (0.0, 0.0))[0]

    links = {}
    for name, link in value["links"].items():
        points = {
            point: there(name, at) if isinstance(at, list) else at for point, at in link.get("points", {}).items()
        }
        links[name] = link | ({"points": points} if points else {})
    pairs = []
    for pair in value["pairs"]:
        new = dict(pair)
        if "line" in pair:
            first, second = pair["links"]
            new["line"] = dict(pair["line"])
            if isinstance(pair["line"]["through"], list):
                new["line"]["through"] = there(first, pair["line"]["through"])
            if "angle" in pair["line"]:
                new["line"]["angle"] += turn(first)
            if "sliding" in pair:
                new["turn"] = pair.get("turn", 0.0) - turn(second)
        pairs.append(new)
    inputs = [given | {"position": given["position"] + turn(value["frame"])} for given in value.get("inputs", ())]
    sketch = {point: there(value["frame"], at) for point, at in value.get("sketch", {}).items()}
    units = value["units"] | {"length": unit}
    return value | {"links": links, "pairs": pairs, "inputs": inputs, "sketch": sketch, "units": units}


@settings(deadline=None)
@given(st.sampled_from(VALUES), st.integers(0, 2**32))
def test_names_ask_neither_for_words_nor_for_their_order(value, seed):
    random, value = Random(seed), full(value)
    words = sorted(known(value))
    other = renamed(
        value, dict(zip(words, [f"n{k}" for k in random.sample(range(len(words)), len(words))], strict=True))
    )
    assert not known(other) & set(words)
    other = planar.from_dict(shuffled(other | {"name": "another"}, random))
    assert mechanism_names(other) == mechanism_names(planar.from_dict(value))


@settings(deadline=None)
@given(st.sampled_from(VALUES), st.integers(0, 2**32), st.sampled_from(["m", "inch", "mm"]))
def test_names_ask_neither_for_the_scale_nor_for_the_axes(value, seed, unit):
    value = full(value)
    assert mechanism_names(planar.from_dict(moved(value, Random(seed), unit))) == mechanism_names(
        planar.from_dict(value)
    )


def test_the_chapters_listing_of_its_slider_crank():
    """Machine Elements, 1.3.5 (i): 3 turning pairs O-1, 1-2 and 2-3, 1 sliding pair 3-4."""
    mechanism = planar.load("slider-crank")
    assert link_numbers(mechanism) == {"crank": "1", "rod": "2", "piston": "3", "frame": "4"}
    assert pair_labels_by_type(mechanism) == (("turning", ("O-1", "1-2", "2-3")), ("sliding", ("3-4",)))


def test_the_chapters_numbers_of_its_quick_return():
    """Machine Elements, 1.3.5 (ii): crank 1, slider 2, link 3; then two more links and the frame."""
    mechanism = planar.load("004-QR")
    order = ("OA", "block A", "CD", "DR", "block R", "frame")
    assert link_numbers(mechanism) == {link: str(number) for number, link in enumerate(order, start=1)}
    turning, sliding = pair_labels_by_type(mechanism)
    assert turning == ("turning", ("O-1", "1-2", "C-3", "3-4", "4-5"))
    assert sliding == ("sliding", ("2-3", "5-6"))


def test_numbers_begin_at_what_drives():
    assert link_numbers(planar.load("hand-pump")) == {
        "handle": "1",
        "plunger": "2",
        "swinging link": "3",
        "barrel": "4",
    }
    value = bars_of_four(200, 50, 180, 120)
    assert link_numbers(planar.from_dict(value)) == {"OA": "1", "AB": "2", "QB": "3", "frame": "4"}
    value["inputs"] = [{"pair": "Q", "position": 90}]
    assert link_numbers(planar.from_dict(value)) == {"QB": "1", "AB": "2", "OA": "3", "frame": "4"}


def test_links_beyond_the_frame_are_numbered_after_the_others():
    value = made({"O": [0, 0], "Q": [9, 0]}, {"q": bar("Q", "R", length=1), "o": bar("O", "P", length=1)}, pins("O Q"))
    value["inputs"] = [{"pair": "O", "position": 0}]
    assert link_numbers(planar.from_dict(value)) == {"o": "1", "q": "2", "frame": "3"}


@pytest.mark.parametrize("model", ["toggle-press", "peaucellier-lipkin", "scissor-lift", "excavator-arm"])
def test_a_pin_of_n_links_gives_its_binary_pairs(model):
    mechanism = planar.load(model)
    listed = [text for _, some in pair_labels_by_type(mechanism) for text in some]
    assert len(listed) == len(mechanism.pairs) == len(set(listed))


def test_a_pin_of_three_links_is_listed_from_its_lowest_number_or_from_the_frame():
    turning, sliding = pair_labels_by_type(planar.load("toggle-press"))
    assert turning == ("turning", ("A0-1", "1-2", "2-3", "C-3", "2-4", "4-5"))
    assert sliding == ("sliding", ("5-6",))
    shared = planar.from_dict(graph("g", "O: a g b", "P: a b"))
    assert pair_labels_by_type(shared) == (("turning", ("O-1", "1-2", "O-2")),)


def test_higher_pairs_are_listed_last():
    assert [kind for kind, _ in pair_labels_by_type(planar.from_dict(rack()))] == ["turning", "sliding", "rack"]
    assert pair_labels_by_type(planar.from_dict(wheels())) == (("turning", ("O-1", "P-2")), ("gear", ("1-2",)))


def test_long_chains_are_named_without_delay():
    """No search through the likenesses of large graphs."""
    links = {f"l{k}": bar(f"P{k}", f"P{k + 1}", length=1) for k in range(600)}
    value = made({"P0": [0, 0]}, links, pins(" ".join(f"P{k}" for k in range(600))))
    assert mechanism_names(planar.from_dict(value)) == ("open chain of 600 moving links", "serial arm")
