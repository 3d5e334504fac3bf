"""Mechanisms drawn by hand in a real browser, from nothing: by mouse, finger and keys, as a textbook writes them."""

from __future__ import annotations

import json
from math import atan2, degrees, hypot

import numpy as np
import pytest

import planar
from planar.document.texts.mechanism_link import read_link
from tests.guide_screens import draw_six_bar, guide_steps
from tests.hostile import harmful_mechanism
from tests.page_scripts import settled
from tests.pencil import Pencil

CLOSE = 1e-10
"""m: numbers of a drawn file have twelve figures."""
HEAD = {"planar": 1, "name": "Mechanism", "units": {"length": "mm", "angle": "deg"}, "frame": "frame"}


def equal(drawn, written):
    """A drawn mechanism has all points, rates and numbers of a written one, where it is drawn and a little farther."""
    written = planar.from_dict(written)
    first = f"{written.inputs[0].pair}.position"
    for by in (0.0, 0.3):
        found, wanted = (
            planar.solve(each.with_values({first: planar.dimensions(each)[first] + by})) for each in (drawn, written)
        )
        assert set(found.points) == set(wanted.points)
        assert found.mobility == wanted.mobility
        for name, point in wanted.points.items():
            assert found.point(name).position == pytest.approx(point.position, abs=CLOSE)
            assert found.point(name).velocity == pytest.approx(point.velocity, abs=1e-9)
            assert found.point(name).acceleration == pytest.approx(point.acceleration, abs=1e-7)


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


def draw_cam(hand):
    hand.bars((0, 0), (20, 0))
    hand.bars((0, 60), (0, 120))
    hand.tool("Slide")
    hand.drag((0, 60), (0, 30))
    hand.drag((0, 120), (0, 150))
    hand.drive((0, 0))
    hand.tool("Cam")
    hand.window.get_by_label("Lift, a length or an angle").fill("20")
    hand.window.get_by_label("Radius of the roller").fill("10")
    hand.drag((10, 0), (0, 60))


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


@pytest.mark.parametrize("name", LINKAGES)
def test_a_linkage_drawn_from_nothing_is_the_written_one(name, drawing):
    draw, written = LINKAGES[name]
    hand = drawing()
    draw(hand)
    many = len(written["inputs"])
    assert hand.told() == f"mobility {many}, {many} input{'s' * (many > 1)}"
    equal(hand.mechanism(), written)


def test_what_was_drawn_is_undone_to_nothing_and_done_again(drawing):
    hand = drawing()
    draw_quick_return(hand)
    drawn, steps = hand.file(), 0
    while hand.window.get_by_role("button", name="Undo drawing").is_enabled():
        hand.button("Undo drawing")
        steps += 1
    assert hand.file()["links"] == {"frame": {"points": {}}}
    for _ in range(steps):
        hand.button("Redo drawing")
    assert hand.file() == drawn
    assert hand.told() == "mobility 1, 1 input"


def test_the_guides_steps_lead_from_empty_paper_to_a_moving_six_bar(drawing):
    hand = drawing()
    draw_six_bar(hand)
    hand.window.get_by_label("Instantaneous centres").check()
    hand.window.get_by_role("button", name="Play").click()
    hand.actions += 2
    assert hand.actions == len(guide_steps()) <= 40
    start = hand.window.evaluate("page.input(0)")
    hand.window.wait_for_function("([start]) => Math.abs(page.input(0) - start) > 0.05", arg=[start])
    assert hand.window.locator("#drawing circle.centre").count() >= 10


def test_a_slider_crank_is_drawn_by_keys_alone(drawing):
    hand = drawing()
    press = hand.window.keyboard.press

    def lead(x, y, at):
        """The cross, from a place to another, in steps of the grid."""
        step = hand.window.evaluate("editing.sketch.step * 1000")
        for way, keys in ((x - at[0], ("ArrowRight", "ArrowLeft")), (y - at[1], ("ArrowUp", "ArrowDown"))):
            count = round(abs(way) / step)
            for _ in range(count // 10):
                press(f"Shift+{keys[way < 0]}")
            for _ in range(count % 10):
                press(keys[way < 0])

    def place():
        return [round(1000 * each, 6) for each in hand.window.evaluate("editing.hand.cursor")]

    def use(name, *places):
        hand.window.get_by_role("toolbar", name="Pencil").get_by_role("button", name=name, exact=True).focus()
        press("Enter")
        hand.window.locator("#drawing").focus()
        press("ArrowRight")
        for at in places:
            lead(*at, place())
            assert place() == pytest.approx(at)
            press("Enter")
            hand.wait()
            hand.window.locator("#drawing").focus()

    use("Bar", (0, 0), (30, 40), (30, 40), (150, 0))
    assert "mm" in hand.said() or "Bar" in hand.said()
    use("Ground", (0, 0))
    use("Slide", (150, 0), (180, 0))
    use("Input", (0, 0))
    equal(hand.mechanism(), SLIDER_CRANK)
    press("Control+z")
    hand.wait()
    assert "inputs" not in hand.file()


def test_a_four_bar_is_drawn_by_a_finger_on_a_phone(drawing):
    hand = drawing(viewport={"width": 390, "height": 844}, has_touch=True)

    def tap(*places):
        for at in places:
            hand.window.touchscreen.tap(*hand.screen(*at))
            hand.wait()

    hand.tool("Bar")
    tap((0, 0), (20, 40), (20, 40), (100, 80), (100, 80), (120, 0))
    hand.tool("Ground")
    tap((0, 0), (120, 0))
    hand.tool("Input")
    tap((0, 0))
    assert hand.told() == "mobility 1, 1 input"
    assert planar.dimensions(hand.mechanism())["BC.length"] == pytest.approx(hypot(80, 40) / 1000, rel=1e-11)
    assert hand.window.evaluate("document.documentElement.scrollWidth") <= 390


# pins


def test_a_pin_is_led_and_lengths_follow_while_the_rest_stays(drawing):
    hand = drawing(planar.to_dict("four-bar"))
    start = {name: point.position for name, point in planar.solve("four-bar").points.items()}
    hand.tool("Pins")
    for name, by in (("C", (0.012, -0.004)), ("D", (-0.005, 0.003)), ("F", (0.0, 0.01)), ("B", (0.004, 0.004))):
        at = start[name] + np.array(by)
        hand.window.mouse.move(*hand.screen(*(1000 * start[name])))
        hand.window.mouse.down()
        hand.window.keyboard.down("Alt")
        for part in (0.3, 0.7, 1.0):
            hand.window.mouse.move(*hand.screen(*(1000 * (start[name] + part * np.array(by)))))
            settled(hand.window)
        assert hand.window.evaluate("editing.solved")  # by the page itself
        hand.window.mouse.up()
        hand.window.keyboard.up("Alt")
        hand.wait()
        found = planar.solve(hand.mechanism())
        start[name] = found.point(name).position
        assert start[name] == pytest.approx(at, abs=5e-4)  # a pixel of the pointer
        for other, place in start.items():
            assert found.point(other).position == pytest.approx(place, abs=CLOSE)


def test_the_authors_file_keeps_its_order_texts_and_units(drawing, tmp_path):
    path = tmp_path / "own.json"
    value = {
        "name": "Mine",
        "planar": 1,
        "frame": "base",
        "units": {"angle": "deg", "length": "cm"},
        "pairs": [{"links": ["base", "a"], "turning": "O"}, {"turning": "P"}, {"turning": "Q"}, {"turning": "R"}],
        "links": {
            "b": {"length": "40 mm", "ends": ["P", "Q"]},
            "a": {"ends": ["O", "P"], "length": 2},
            "base": {"points": {"R": [5, 0], "O": ["0 mm", "0 in"]}},
            "c": {"ends": ["R", "Q"], "length": "0.03 m"},
        },
        "notes": ["my own"],
        "inputs": [{"pair": "O", "velocity": "60 rpm", "position": 70}],
        "sketch": {"Q": [4, 3]},
    }
    path.write_text(json.dumps(value))
    hand = drawing(value, path)
    hand.tool("Pins")
    at = 100 * planar.solve(path).point("Q").position
    hand.click(10 * at)
    hand.type("x (cm)", "4.5")
    hand.type("y (cm)", "2.5")
    assert "not saved yet" in hand.window.locator("#pencil .files").inner_text()
    hand.window.locator("#pencil").get_by_role("button", name="Save", exact=True).click()
    hand.window.wait_for_function("() => !editing.changed")
    saved = json.loads(path.read_text())
    assert list(saved) == list(value)
    assert list(saved["links"]) == list(value["links"])
    for key in ("name", "units", "pairs", "notes"):
        assert saved[key] == value[key]
    assert saved["links"]["base"] == value["links"]["base"]
    assert saved["links"]["a"] == value["links"]["a"]
    assert saved["inputs"] == value["inputs"]
    assert saved["links"]["b"]["length"].endswith(" mm")
    assert saved["links"]["c"]["length"].endswith(" m")
    assert planar.solve(path).point("Q").position == pytest.approx([0.045, 0.025], abs=CLOSE)


def test_names_are_changed_and_pins_and_links_go(drawing):
    hand = drawing(planar.to_dict("crank-rocker"))
    name = next(iter(hand.window.evaluate("[...editing.placed.pins.keys()]")))
    hand.window.evaluate("(name) => { editing.use('pin'); editing.choose({ kind: 'pin', name }); }", name)
    hand.type("Pin", "Zapfen 1")
    assert hand.told() == "mobility 1, 1 input"
    assert "Zapfen 1" in planar.solve(hand.mechanism()).points
    hand.type("Pin", "a.b")
    assert "no . : or ," in hand.said()
    hand.button("Erase Zapfen 1")
    assert "Zapfen 1" not in json.dumps(hand.file())
    hand.button("Undo drawing")
    assert "Zapfen 1" in planar.solve(hand.mechanism()).points


def test_a_link_is_copied_and_mirrored(drawing):
    hand = drawing()
    hand.use("Plate", (0, 0), (60, 0), (20, 40), (20, 40))
    hand.use("Pins", (30, 0))
    hand.button("Copy ABC")
    hand.click((8, 16))
    hand.button("Mirror ABC")
    found = {name: [round(1000 * each, 6) for each in at] for name, at in hand.window.evaluate("[...editing.at]")}
    step = round(1000 * hand.window.evaluate("editing.sketch.step"), 6)
    assert [found[name] for name in "DEF"] == [
        [2 * step, -2 * step],
        [60 + 2 * step, -2 * step],
        [20 + 2 * step, 40 - 2 * step],
    ]
    assert [found[name] for name in "GH"] == [[120, 0], [100, 40]]
    assert hand.file()["pairs"] == [{"turning": "B"}]
    mirrored = hand.file()["links"]["GBH"]
    assert mirrored == {"ends": ["G", "B"], "length": 60, "points": {"H": [20, -40]}}


# always alive


def test_what_does_not_go_together_is_shown_with_what_mends_it(drawing):
    value = planar.to_dict("crank-rocker")
    value["links"]["coupler"]["length"] = 1000
    hand = drawing(value)
    assert "cannot be assembled" in hand.told()
    hand.window.wait_for_function("() => editing.answer.remedies.length", timeout=30_000)
    assert "pair 'B' stays open by" in hand.told()
    assert "it goes together with coupler.length" in hand.told()
    hand.window.get_by_text("Text of the file").click()
    hand.window.wait_for_function("() => editing.panel.area.value")
    area = hand.window.get_by_label("Text of the file")
    area.fill(area.input_value().replace("1000", '"oops"'))
    hand.button("Take this text")
    assert "$.links.coupler.length" in hand.told()
    area.fill(json.dumps(planar.to_dict("crank-rocker")))
    hand.button("Take this text")
    assert hand.told() == "mobility 1, 1 input"
    assert hand.window.get_by_role("button", name="Play").is_visible()


def test_what_is_loose_is_coloured(drawing):
    hand = drawing()
    hand.bars((0, 0), (20, 40), (100, 70))
    hand.drive((0, 0))
    assert "mobility 2, 1 input" in hand.told()
    assert "'BC' hangs at 'B' alone" in hand.told()
    assert hand.window.locator(".pencil .link").count() == 2
    assert hand.window.locator(".pencil .loose").count() == 1


def test_texts_of_a_file_are_shown_and_never_run(drawing):
    hand = drawing(planar.to_dict(harmful_mechanism()))
    for tool in ("Pins", "Bar", "Input", "Move"):
        hand.tool(tool)
    hand.window.get_by_text("Text of the file").click()
    for name in hand.window.evaluate("[...editing.at.keys()]"):
        hand.window.evaluate("(name) => { editing.use('pin'); editing.choose({ kind: 'pin', name }); }", name)
    assert hand.window.evaluate("typeof window.hacked") == "undefined"
    assert hand.window.locator("img").count() == 0


def test_two_windows_draw_each_their_own_and_a_reload_keeps_it(drawing, chromium):
    hand = drawing()
    server = drawing.opened[0][1]
    draw_slider_crank(hand)
    other = Pencil(hand.window.context, server)
    assert other.file()["links"] == {"frame": {"points": {}}}
    assert other.wrong == []
    hand.window.on("dialog", lambda dialog: dialog.accept())
    hand.window.reload()
    hand.wait()
    equal(hand.mechanism(), SLIDER_CRANK)


def test_without_its_server_what_is_drawn_stays_and_leaves_as_a_link(drawing):
    hand = drawing()
    draw_slider_crank(hand)
    _, server, _ = drawing.opened[0]
    server.shutdown()
    server.server_close()
    hand.tool("Bar")
    hand.drag((30, 40), (60, 90))
    assert "does not answer" in hand.told()
    hand.button("Undo drawing")
    hand.button("Copy link")
    hand.window.wait_for_function("() => !editing.panel.link.hidden")
    link = hand.window.get_by_label("Link of the mechanism").input_value()
    equal(planar.load(link), SLIDER_CRANK)
    assert json.loads(read_link(link)) == hand.file()


def test_a_slide_is_driven_from_where_it_stands(drawing):
    hand = drawing()
    draw_slider_crank(hand)
    hand.click((0, 0), (150, 0))
    (given,) = hand.mechanism().inputs
    assert (given.pair, given.position, given.velocity) == (
        "C slide",
        pytest.approx(0.0, abs=CLOSE),
        pytest.approx(0.1),
    )
    assert planar.solve(hand.mechanism()).point("B").position == pytest.approx([0.03, 0.04], abs=CLOSE)


# what acts


@pytest.mark.parametrize(("length", "units"), [("mm", ("N/m", "N", "kg")), ("in", ("lbf/in", "lbf", "lb"))])
def test_springs_forces_and_masses_are_drawn_in_the_files_kind_of_units(length, units, drawing):
    value = planar.to_dict("crank-rocker")
    value["units"]["length"] = length
    value["links"]["frame"]["points"] = {"A0": [0, 0], "B0": [200, 0]}
    hand = drawing(value)
    places = {name: point.position * 1000 for name, point in planar.solve(hand.mechanism()).points.items()}
    hand.tool("Spring")
    hand.drag(places["A"], places["B0"])
    hand.tool("Force")
    hand.drag(places["B"], places["B"] + np.array([0, -0.2 * places["B"][1]]))
    hand.tool("Mass")
    hand.click((places["A"] + places["B"]) / 2)
    file = hand.file()
    found = file["springs"][0]["stiffness"], file["loads"][0]["force"][1], file["masses"][0]["mass"]
    assert tuple(each.split(" ", 1)[1] for each in found) == units
    drawn = hand.mechanism()
    assert drawn.springs[0].ends == ("A", "B0")
    assert drawn.loads[0].point == "B"
    assert drawn.masses[0].link == "coupler"
    (given,) = drawn.inputs
    effort = float(planar.forces(planar.solve(drawn)).inputs[given.pair])
    assert hand.window.evaluate("(name) => page.forces.effort(name)", given.pair) == pytest.approx(effort, rel=1e-8)


@pytest.mark.parametrize(("pin", "changed"), [("D", {"AD.D.x", "AD.D.y"}), ("B", {"AB.length", "A.position"})])
def test_the_rest_goes_along_with_a_pin_and_keeps_its_lengths(pin, changed, drawing):
    hand = drawing(planar.to_dict("four-bar"))
    start = planar.solve(hand.mechanism()).point(pin).position * 1000
    hand.tool("Pins")
    hand.window.get_by_label("The rest goes along").check()
    hand.click(start)
    hand.type("x (mm)", str(start[0] + 6))
    hand.type("y (mm)", str(start[1] + 4))
    drawn = hand.mechanism()
    before, after = planar.dimensions(planar.load("four-bar")), planar.dimensions(drawn)
    gone = {name for name in before if not name.startswith("sketch") and after[name] != pytest.approx(before[name])}
    assert gone == changed
    found = planar.solve(drawn)
    assert found.point(pin).position * 1000 == pytest.approx(start + np.array([6, 4]), abs=1e-6)
    for name, at in hand.window.evaluate("[...editing.at]"):
        assert found.point(name).position == pytest.approx(at, abs=CLOSE)
    hand.button("Undo drawing")
    hand.button("Undo drawing")
    assert planar.dimensions(hand.mechanism()) == before
