"""Linkages of textbooks as hands draw them from nothing, and as they are written."""

from __future__ import annotations

from math import atan2, degrees, hypot

from tests.guide_screens import draw_six_bar

HEAD = {"planar": 1, "name": "Mechanism", "units": {"length": "mm", "angle": "deg"}, "frame": "frame"}


def bar(*ends, length):
    return {"ends": list(ends), "length": length}


def pinned(*names):
    return [{"turning": name} for name in names]


def driven(pair, position):
    return {"inputs": [{"pair": pair, "position": position, "velocity": "10 rad/s"}]}


# linkages of textbooks


def draw_four_bar(hand):
    hand.bars((0, 0), (20, 40), (100, 70), (120, 0))
    hand.use("Point", (60, 55), (50, 90))
    hand.drive((0, 0), (120, 0))


FOUR_BAR = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0], "D": [120, 0]}},
        "AB": bar("A", "B", length=hypot(20, 40)),
        "BC": bar("B", "C", length=hypot(80, 30))
        | {"points": {"E": {"distances": {"B": hypot(30, 50), "C": hypot(50, 20)}, "left_of": ["B", "C"]}}},
        "CD": bar("C", "D", length=hypot(20, 70)),
    },
    "pairs": pinned("A", "B", "C", "D"),
    "sketch": {"C": [100, 70]},
    **driven("A", degrees(atan2(40, 20))),
}


def draw_slider_crank(hand):
    hand.bars((0, 0), (30, 40), (150, 0))
    hand.tool("Slide")
    hand.drag((150, 0), (180, 0))
    hand.drive((0, 0))


SLIDER_CRANK = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0]}},
        "AB": bar("A", "B", length=50),
        "BC": bar("B", "C", length=hypot(120, 40)),
    },
    "pairs": [
        *pinned("A", "B"),
        {"sliding": "stroke", "on": "frame", "block": "C", "line": {"through": [0, 0], "angle": 0}},
    ],
    "sketch": {"C": [150, 0]},
    **driven("A", degrees(atan2(4, 3))),
}


def draw_quick_return(hand):
    hand.bars((0, 0), (0, 140))
    hand.bars((60, 80), (0, 80))
    hand.tool("Slide")
    hand.drag((0, 80), (0, 120))
    hand.drive((60, 80), (0, 0))


QUICK_RETURN = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0], "C": [60, 80]}},
        "AB": bar("A", "B", length=140),
        "CD": bar("C", "D", length=60),
    },
    "pairs": [
        *pinned("A", "C"),
        {"sliding": "slot", "on": "AB", "block": "D", "line": {"through": "A", "to": "B"}},
    ],
    "sketch": {"D": [0, 80]},
    **driven("C", 180),
}


SIX_BAR = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0], "E": [100, 0], "G": [160, 20]}},
        "crank": bar("A", "B", length=40),
        "plate": bar("B", "C", length=hypot(80, 40))
        | {"points": {"D": {"distances": {"B": 100, "C": hypot(20, 40)}, "left_of": ["B", "C"]}}},
        "CE": bar("C", "E", length=hypot(20, 80)),
        "DF": bar("D", "F", length=90),
        "FG": bar("F", "G", length=hypot(10, 100)),
    },
    "pairs": pinned("A", "B", "C", "D", "E", "F", "G"),
    "sketch": {"C": [80, 80], "F": [150, 120]},
    **driven("A", 90),
}


def draw_wheels(hand):
    hand.bars((0, 0), (40, 0))
    hand.bars((120, 0), (120, 30))
    hand.drive((0, 0), (120, 0))
    hand.tool("Wheels")
    hand.window.get_by_label("Ratio of wheels").fill("-1.5")
    hand.click((20, 0), (120, 15))


WHEELS = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0], "C": [120, 0]}},
        "AB": bar("A", "B", length=40),
        "CD": bar("C", "D", length=30),
    },
    "pairs": [
        *pinned("A", "C"),
        {"gear": "wheels", "links": ["AB", "CD"], "ratio": -1.5, "mesh": {"AB": 0, "CD": 90}},
    ],
    **driven("A", 0),
}


def draw_offset_slider_crank(hand):
    hand.bars((0, 0), (30, 40), (150, 20))
    hand.tool("Slide")
    hand.drag((150, 20), (180, 50))
    hand.drive((0, 0))


OFFSET_SLIDER_CRANK = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0]}},
        "AB": bar("A", "B", length=50),
        "BC": bar("B", "C", length=hypot(120, 20)),
    },
    "pairs": [
        *pinned("A", "B"),
        {"sliding": "stroke", "on": "frame", "block": "C", "line": {"through": [150, 20], "angle": 45}},
    ],
    "sketch": {"C": [150, 20]},
    **driven("A", degrees(atan2(4, 3))),
}


def draw_watt(hand):
    hand.bars((0, 0), (20, 40), (100, 70))
    hand.use("Plate", (100, 70), (110, 0), (150, 60), (150, 60))
    hand.bars((150, 60), (220, 70), (210, 0))
    hand.drive((0, 0), (110, 0), (210, 0))


WATT = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0], "D": [110, 0], "G": [210, 0]}},
        "AB": bar("A", "B", length=hypot(20, 40)),
        "BC": bar("B", "C", length=hypot(80, 30)),
        "rocker": bar("D", "C", length=hypot(10, 70))
        | {"points": {"E": {"distances": {"D": hypot(40, 60), "C": hypot(50, 10)}, "right_of": ["D", "C"]}}},
        "EF": bar("E", "F", length=hypot(70, 10)),
        "FG": bar("F", "G", length=hypot(10, 70)),
    },
    "pairs": pinned("A", "B", "C", "D", "E", "F", "G"),
    "sketch": {"C": [100, 70], "F": [220, 70]},
    **driven("A", degrees(atan2(4, 2))),
}


def draw_five_bar(hand):
    hand.bars((0, 0), (-20, 60), (50, 110), (130, 60), (100, 0))
    hand.drive((0, 0), (100, 0))
    hand.click((100, 0))


FIVE_BAR = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0], "E": [100, 0]}},
        "AB": bar("A", "B", length=hypot(20, 60)),
        "BC": bar("B", "C", length=hypot(70, 50)),
        "CD": bar("C", "D", length=hypot(80, 50)),
        "ED": bar("E", "D", length=hypot(30, 60)),
    },
    "pairs": pinned("A", "B", "C", "D", "E"),
    "sketch": {"C": [50, 110]},
    "inputs": [
        {"pair": pair, "position": degrees(atan2(60, x)), "velocity": "10 rad/s"} for pair, x in (("A", -20), ("E", 30))
    ],
}


def draw_toggle(hand):
    hand.bars((0, 0), (20, 30), (110, 40), (110, 100))
    hand.bars((110, 40), (130, -40))
    hand.tool("Slide")
    hand.drag((130, -40), (130, -80))
    hand.drive((0, 0), (110, 100))


TOGGLE = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0], "D": [110, 100]}},
        "AB": bar("A", "B", length=hypot(20, 30)),
        "BC": bar("B", "C", length=hypot(90, 10)),
        "DC": bar("D", "C", length=60),
        "CE": bar("C", "E", length=hypot(20, 80)),
    },
    "pairs": [
        *pinned("A", "B", "C", "D"),
        {"sliding": "ram", "on": "frame", "block": "E", "line": {"through": [130, 0], "angle": -90}},
    ],
    "sketch": {"C": [110, 40], "E": [130, -40]},
    **driven("A", degrees(atan2(3, 2))),
}


def draw_epicyclic(hand):
    hand.bars((0, 0), (60, 50), (80, 50), (180, 110), (200, 0))
    hand.drive((0, 0), (200, 0))
    hand.use("Wheels", (150, -30), (70, 50))  # empty paper: a wheel of the frame


EPICYCLIC = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0], "E": [200, 0]}},
        "arm": bar("A", "B", length=hypot(60, 50)),
        "planet": bar("B", "C", length=20),
        "CD": bar("C", "D", length=hypot(100, 60)),
        "ED": bar("E", "D", length=hypot(20, 110)),
    },
    "pairs": [
        *pinned("A", "B", "C", "D", "E"),
        {
            "gear": "mesh",
            "links": ["frame", "planet"],
            "carrier": "arm",
            "radii": [2 * hypot(60, 50) / 3, hypot(60, 50) / 3],
            "mesh": {"frame": -degrees(atan2(50, 60)), "planet": -degrees(atan2(50, 60))},
        },
    ],
    "sketch": {"D": [180, 110]},
    **driven("A", degrees(atan2(50, 60))),
}


def draw_belt(hand):
    hand.bars((0, 0), (20, 0))
    hand.bars((110, 0), (110, 40))
    hand.drive((0, 0), (110, 0))
    hand.tool("Belt")
    hand.window.get_by_label("Radius of the first pulley").fill("20")
    hand.window.get_by_label("Radius of the second pulley").fill("45")
    hand.window.get_by_label("Crossed").check()
    hand.click((10, 0), (110, 20))


BELT = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0], "C": [110, 0]}},
        "AB": bar("A", "B", length=20),
        "CD": bar("C", "D", length=40),
    },
    "pairs": [
        *pinned("A", "C"),
        {"belt": "b", "links": ["AB", "CD"], "radii": [20, 45], "crossed": True, "mesh": {"AB": 0, "CD": 90}},
    ],
    **driven("A", 0),
}


def draw_rack(hand):
    hand.bars((0, 30), (20, 30))
    hand.bars((-40, 0), (80, 0))
    hand.tool("Slide")
    hand.drag((-40, 0), (-20, 0))
    hand.drag((80, 0), (100, 0))
    hand.drive((0, 30))
    hand.tool("Rack")
    hand.drag((10, 30), (10, 0))


RACK = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 30]}},
        "AB": bar("A", "B", length=20),
        "CD": bar("C", "D", length=120),
    },
    "pairs": [
        *pinned("A"),
        {"sliding": "guide", "links": ["frame", "CD"], "line": {"through": [-40, 0], "angle": 0}, "point": "C"},
        {
            "rack": "rack",
            "links": ["CD", "AB"],
            "line": {"through": "C", "angle": 0},
            "point": "A",
            "radius": 30,
            "mesh": {"displacement": 40, "angle": 0},
        },
    ],
    "sketch": {"C": [-40, 0]},
    **driven("A", 0),
}


def draw_cam(hand, lift=20, **law):
    """A cam and its follower, with what stands beside the tool typed where it differs."""
    hand.bars((0, 0), (20, 0))
    hand.bars((0, 60), (0, 120))
    hand.tool("Slide")
    hand.drag((0, 60), (0, 30))
    hand.drag((0, 120), (0, 150))
    hand.drive((0, 0))
    hand.tool("Cam")
    hand.window.get_by_label("Lift, a length or an angle").fill(str(lift))
    hand.window.get_by_label("Radius of the roller").fill("10")
    for name, value in law.items():
        field = hand.window.get_by_label(CAM_LABELS[name])
        if name == "motion":
            field.select_option(value)
        else:
            field.fill(str(value))
    hand.drag((10, 0), (0, 60))


CAM_LABELS = {
    "motion": "Motion of the rise",
    "rise": "Rise (deg)",
    "dwell": "Dwell above (deg)",
    "back": "Return (deg)",
}
CAM = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 0]}},
        "AB": bar("A", "B", length=20),
        "CD": {"points": {"C": [0, 0], "D": [0, 60]}},
    },
    "pairs": [
        *pinned("A"),
        {
            "sliding": "guide",
            "links": ["frame", "CD"],
            "line": {"through": "A", "angle": 90},
            "point": "C",
            "turn": -90,
        },
        {
            "cam": "lift",
            "links": ["AB", "CD"],
            "line": {"through": "A", "angle": 90},
            "point": "C",
            "centre": "A",
            "base_radius": 50,
            "roller_radius": 10,
            "law": [
                {"motion": "cycloidal", "by": 20, "in": 120},
                {"motion": "dwell", "in": 60},
                {"motion": "cycloidal", "by": -20, "in": 120},
                {"motion": "dwell", "in": 60},
            ],
        },
    ],
    "sketch": {"C": [0, 60], "D": [0, 120]},
    **driven("A", 0),
}


def draw_slot(hand):
    hand.bars((0, 30), (20, 30))
    hand.bars((0, -10), (60, 110))
    hand.drive((0, 30), (0, -10))
    hand.tool("Slot")
    hand.drag((20, 30), (40, 70))


SLOT = HEAD | {
    "links": {
        "frame": {"points": {"A": [0, 30], "C": [0, -10]}},
        "AB": bar("A", "B", length=20),
        "CD": bar("C", "D", length=hypot(60, 120)),
    },
    "pairs": [
        *pinned("A", "C"),
        {"slot": "slot", "links": ["CD", "AB"], "line": {"through": "C", "to": "D"}, "point": "B"},
    ],
    "sketch": {"D": [60, 110]},
    **driven("A", 0),
}
LINKAGES = {
    "four-bar": (draw_four_bar, FOUR_BAR),
    "slider-crank": (draw_slider_crank, SLIDER_CRANK),
    "quick return": (draw_quick_return, QUICK_RETURN),
    "Stephenson": (draw_six_bar, SIX_BAR),
    "wheels": (draw_wheels, WHEELS),
    "offset slider-crank": (draw_offset_slider_crank, OFFSET_SLIDER_CRANK),
    "Watt": (draw_watt, WATT),
    "five-bar": (draw_five_bar, FIVE_BAR),
    "toggle": (draw_toggle, TOGGLE),
    "epicyclic": (draw_epicyclic, EPICYCLIC),
    "belt": (draw_belt, BELT),
    "rack": (draw_rack, RACK),
    "cam": (draw_cam, CAM),
    "slot": (draw_slot, SLOT),
}


def drawn_kinds(name: str) -> set[object]:
    """What is drawn of a linkage: its kinds of pairs with their keys and what they are on, inputs, plates, slopes."""
    _, written = LINKAGES[name]
    pairs, links = written["pairs"], written["links"].values()
    keys = {(*sorted({*pair} - {"radii"}), "frame" in (pair.get("on"), *pair.get("links", ()))) for pair in pairs}
    sloped = [pair for pair in pairs if pair.get("line", {}).get("angle", 0) % 90]
    plates = [link for link in links if any("distances" in place for place in link.get("points", {}).values())]
    return {*keys, len(written["inputs"]), *(["slope"] if sloped else []), *(["plate"] if plates else [])}
