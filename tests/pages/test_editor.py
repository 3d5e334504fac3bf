"""Mechanisms drawn by hand in a real browser, from nothing: by mouse, finger and keys, as a textbook writes them."""

from __future__ import annotations

import json
from math import hypot

import numpy as np
import pytest

import planar
from planar.document.texts.mechanism_link import read_link
from planar.pages.editor.answer import BLANK
from tests.drawn_linkages import (
    CAM,
    LINKAGES,
    SLIDER_CRANK,
    draw_cam,
    draw_quick_return,
    draw_slider_crank,
    drawn_kinds,
)
from tests.draws import covering, first_cases
from tests.guide_screens import draw_six_bar, guide_steps
from tests.hostile import harmful_mechanism
from tests.page_scripts import settled
from tests.pencil import KeyPencil, Pencil, served

CLOSE = 1e-10
"""m: numbers of a drawn file have twelve figures."""


EMPTY = """(file) => {
  for (const { key, kind, value } of TOOL_NUMBERS) {
    const field = editing.panel.numbers.fields[key];
    if (kind === "tick") field.checked = false;
    else field.value = value;
  }
  editing.use("bar");
  editing.replace(file);
}"""
"""Leaves nothing of a drawing, and the numbers beside the tools as they are at first."""


@pytest.fixture(scope="module")
def paper(drawing_context):
    """One window for all drawings from nothing."""
    with served() as server:
        pencil = Pencil(drawing_context, server)
        yield pencil
        pencil.window.close()


@pytest.fixture
def sheet(paper):
    """An empty sheet, on which nothing must go wrong."""
    paper.window.evaluate(EMPTY, BLANK)
    paper.wait()
    yield paper
    assert paper.wrong == []


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


@pytest.mark.parametrize("name", covering(LINKAGES, drawn_kinds))
def test_a_linkage_drawn_from_nothing_is_the_written_one(name, sheet):
    draw, written = LINKAGES[name]
    draw(sheet)
    many = len(written["inputs"])
    assert sheet.told() == f"mobility {many}, {many} input{'s' * (many > 1)}"
    equal(sheet.mechanism(), written)


@pytest.mark.parametrize(
    ("law", "pieces"),
    [
        (
            {"motion": "3-4-5", "rise": 90, "dwell": 30, "back": 150},
            [("3-4-5", 8, 90), ("dwell", 0, 30), ("3-4-5", -8, 150), ("dwell", 0, 90)],
        ),
        (
            {"motion": "modified trapezoidal", "rise": 200, "dwell": 0, "back": 160},
            [("modified trapezoidal", 8, 200), ("modified trapezoidal", -8, 160)],
        ),
    ],
)
def test_a_cam_is_drawn_with_the_law_that_stands_beside(law, pieces, sheet):
    draw_cam(sheet, lift=8, **law)
    *others, cam = CAM["pairs"]
    wanted = [{"motion": motion, "in": angle} | ({"by": by} if by else {}) for motion, by, angle in pieces]
    equal(sheet.mechanism(), CAM | {"pairs": [*others, cam | {"law": wanted}]})


def test_a_cam_of_more_than_a_turn_is_not_drawn(sheet):
    draw_cam(sheet, rise=200, dwell=61, back=100)
    assert "360 deg at the most" in sheet.said()
    assert not any("cam" in pair for pair in sheet.file()["pairs"])


def test_a_place_on_the_side_of_a_link_lies_in_its_line_unless_alt_is_held(sheet):
    sheet.bars((0, 0), (100, 40))
    way, step = np.array([100, 40]) / hypot(100, 40), sheet.window.evaluate("editing.sketch.step * 1000")
    off = 2 / sheet.window.evaluate("page.view.scale / 1000")  # of 2 px, in mm
    place = 36.7 * way + off * np.array([-way[1], way[0]])
    sheet.use("Point", 20 * way, place)
    sheet.tool("Point")
    sheet.click(20 * way)
    sheet.window.keyboard.down("Alt")
    sheet.click(place + 30 * way)
    sheet.window.keyboard.up("Alt")
    first, second = sheet.file()["links"]["AB"]["points"].values()
    assert first[1] == pytest.approx(0, abs=1e-9)
    assert first[0] == pytest.approx(36.7, abs=step / 10)
    assert first[0] / step * 10 == pytest.approx(round(first[0] / step * 10), abs=1e-9)
    assert second == pytest.approx([66.7, off], abs=off / 2)


def test_what_was_drawn_is_undone_to_nothing_and_done_again(drawing):
    hand = drawing()
    draw_quick_return(hand)
    drawn, steps = hand.file(), 0
    undo = hand.window.get_by_role("button", name="Undo")
    while undo.is_enabled():
        undo.click()
        steps += 1
    assert hand.file()["links"] == {"frame": {"points": {}}}
    for _ in range(steps):
        hand.window.get_by_role("button", name="Redo").click()
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


KEYED = {
    "slider-crank": {"one place", "two places"},
    "epicyclic": {"one place", "two places"},
    "Stephenson": {"one place", "two places", "many places"},
    "cam": {"one place", "two places"},
    "slot": {"one place", "two places"},
}
"""Linkages that are drawn by keys, and the places that a use of their tools takes; Enter presses as a mouse does."""


@pytest.mark.parametrize("name", covering(KEYED, KEYED.get))
def test_a_linkage_is_drawn_by_keys_alone(name, drawing):
    draw, written = LINKAGES[name]
    hand = drawing(hand=KeyPencil)
    draw(hand)
    equal(hand.mechanism(), written)
    drawn = hand.file()
    hand.lead(30, 40)
    assert hand.said().startswith(("30, 40 mm", "Pin "))  # for those who do not see the cross
    hand.press("Control+z")
    assert hand.file() != drawn
    hand.press("Control+y")
    assert hand.file() == drawn


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
        for part in (0.4, 1.0):
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
    hand.button("Undo")
    assert "Zapfen 1" in planar.solve(hand.mechanism()).points


def test_a_link_is_copied_and_mirrored(sheet):
    sheet.use("Plate", (0, 0), (60, 0), (20, 40), (20, 40))
    sheet.use("Pins", (30, 0))
    # the server answers while the button is held down: the click is heard all the same
    box = sheet.window.get_by_role("button", name="Copy ABC", exact=True).bounding_box()
    sheet.wait()
    sheet.window.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    sheet.window.mouse.down()
    with sheet.window.expect_response("**/answer"):
        sheet.window.evaluate("() => { editing.ask(); }")
    settled(sheet.window)
    sheet.window.mouse.up()
    sheet.wait()
    sheet.click((8, 16))
    sheet.button("Mirror ABC")
    found = {name: [round(1000 * each, 6) for each in at] for name, at in sheet.window.evaluate("[...editing.at]")}
    step = round(1000 * sheet.window.evaluate("editing.sketch.step"), 6)
    assert [found[name] for name in "DEF"] == [
        [2 * step, -2 * step],
        [60 + 2 * step, -2 * step],
        [20 + 2 * step, 40 - 2 * step],
    ]
    assert [found[name] for name in "GH"] == [[120, 0], [100, 40]]
    assert sheet.file()["pairs"] == [{"turning": "B"}]
    mirrored = sheet.file()["links"]["GBH"]
    assert mirrored == {"ends": ["G", "B"], "length": 60, "points": {"H": [20, -40]}}
    # a tool's numbers and hint take room from the drawing, which knows so at once
    heights = "(tool) => { editing.use(tool); return [page.view.height, svg.clientHeight]; }"
    seen = [sheet.window.evaluate(heights, tool) for tool in ("cam", "pin")]
    assert seen[0][0] != seen[1][0]
    assert all(view == element for view, element in seen)


# always alive


def test_what_does_not_go_together_is_shown_with_what_mends_it(drawing):
    value = planar.to_dict("crank-rocker")
    value["links"]["coupler"]["length"] = 1000
    hand = drawing(value)
    assert "cannot be assembled" in hand.told()
    hand.window.wait_for_function("() => editing.answer.remedies.length", timeout=30_000)
    told = hand.told()
    assert "pair 'B' stays open by" in told
    # drawn where it is nearest to going together: all lengths as they are, and the gap between
    hand.button("Fit everything (0)")
    scale = hand.window.evaluate("page.view.scale")

    def lengths(parts):
        drawn = [each.get_attribute("points").split() for each in hand.window.locator(parts).all()]
        ends = np.array([[[float(part) for part in at.split(",")] for at in each] for each in drawn])
        return sorted(np.hypot(*(ends[:, 1] - ends[:, 0]).T) / scale * 1000)

    assert f"{lengths('.gap')[0]:.3f} mm" in told
    wanted = [each["length"] for each in value["links"].values() if "length" in each]
    assert lengths(".pencil .link") == pytest.approx(sorted(wanted), rel=1e-6)
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


def test_what_is_loose_is_coloured(sheet):
    sheet.bars((0, 0), (20, 40), (100, 70))
    sheet.drive((0, 0))
    assert "mobility 2, 1 input" in sheet.told()
    assert "'BC' hangs at 'B' alone" in sheet.told()
    assert sheet.window.locator(".pencil .link").count() == 2
    assert sheet.window.locator(".pencil .loose").count() == 1


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


def test_what_another_window_or_program_has_saved_is_replaced_only_when_that_is_wanted(drawing, tmp_path):
    path = tmp_path / "two.json"
    path.write_text(json.dumps(planar.to_dict("four-bar")))
    first = drawing(json.loads(path.read_text()), path)
    second = Pencil(first.window.context, drawing.opened[0][1])
    asked, answers = [], []

    def answer(dialog):
        if dialog.type == "beforeunload":
            dialog.accept()
            return
        asked.append(dialog.message)
        dialog.accept() if answers.pop(0) else dialog.dismiss()

    def save(hand):
        hand.window.bring_to_front()
        hand.window.evaluate("editing.say('')")
        hand.window.locator("#pencil").get_by_role("button", name="Save", exact=True).click()
        hand.window.wait_for_function("() => document.getElementById('said').textContent.includes('ave')")
        return hand.said(), path.read_text()

    for hand, place in ((first, (40, 30)), (second, (60, 10))):
        hand.window.bring_to_front()
        hand.window.on("dialog", answer)
        hand.bars((20, 20), place)
        hand.wait()
    assert save(first)[0] == "Saved to two.json."
    kept = path.read_text()
    assert json.loads(kept) == first.file() != second.file()
    answers += [False]
    told, text = save(second)
    assert "two.json was written by another window or program meanwhile: nothing is saved" in told
    assert text == kept
    answers += [True]  # also after a reload, which does not forget from what it was drawn on
    second.window.reload()
    second.wait()
    assert save(second)[0] == "Saved to two.json."
    assert json.loads(path.read_text()) == second.file()
    assert save(second)[0] == "Saved to two.json."  # its own, by now
    path.write_text(kept)
    answers += [False]
    assert "nothing is saved" in save(second)[0]
    why = "two.json was written by another window or program meanwhile"
    assert asked == [f"{why}. Replace it?"] * 3


def test_without_its_server_pins_are_led_on_and_the_mechanism_moves(drawing):
    hand = drawing(planar.to_dict("four-bar"))
    _, server, _ = drawing.opened[0]
    server.shutdown()
    server.server_close()
    hand.tool("Pins")
    for by in (4, -2):
        place = 1000 * np.array(hand.window.evaluate("editing.at.get('C')"))
        hand.click(place)
        hand.type("x (mm)", str(place[0] + by))
        assert "does not answer" in hand.told()
        assert hand.window.evaluate("page.point('C').position[0]") == pytest.approx((place[0] + by) / 1000, abs=CLOSE)
        assert planar.solve(hand.mechanism()).point("C").position[0] == pytest.approx((place[0] + by) / 1000, abs=CLOSE)
    hand.tool("Move")
    start = hand.window.evaluate("page.input(0)")
    hand.button("Play")
    hand.window.wait_for_function("([start]) => Math.abs(page.input(0) - start) > 0.05", arg=[start])


def test_without_its_server_what_is_drawn_stays_and_leaves_as_a_link(drawing):
    hand = drawing()
    draw_slider_crank(hand)
    _, server, _ = drawing.opened[0]
    server.shutdown()
    server.server_close()
    hand.tool("Bar")
    hand.drag((30, 40), (60, 90))
    assert "does not answer" in hand.told()
    hand.button("Undo")
    hand.button("Copy link")
    hand.window.wait_for_function("() => !editing.panel.link.hidden")
    link = hand.window.get_by_label("Link of the mechanism").input_value()
    equal(planar.load(link), SLIDER_CRANK)
    assert json.loads(read_link(link)) == hand.file()


def test_a_slide_is_driven_from_where_it_stands(sheet):
    draw_slider_crank(sheet)
    sheet.click((0, 0), (150, 0))
    (given,) = sheet.mechanism().inputs
    assert (given.pair, given.position, given.velocity) == (
        "C slide",
        pytest.approx(0.0, abs=CLOSE),
        pytest.approx(0.1),
    )
    assert planar.solve(sheet.mechanism()).point("B").position == pytest.approx([0.03, 0.04], abs=CLOSE)


# what acts


@pytest.mark.parametrize(
    ("length", "units"), first_cases([("in", ("lbf/in", "lbf", "lb")), ("mm", ("N/m", "N", "kg"))])
)
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
    hand.tool("Opposed forces")
    hand.drag(places["A"], places["B0"])
    hand.tool("Mass")
    hand.click((places["A"] + places["B"]) / 2)
    file = hand.file()
    assert file["loads"][1]["points"] == ["A", "B0"]
    assert file["loads"][1]["force"].split(" ", 1)[1] == units[1]
    found = file["springs"][0]["stiffness"], file["loads"][0]["force"][1], file["masses"][0]["mass"]
    assert tuple(each.split(" ", 1)[1] for each in found) == units
    drawn = hand.mechanism()
    assert drawn.springs[0].ends == ("A", "B0")
    assert drawn.loads[0].point == "B"
    assert drawn.masses[0].link == "coupler"
    (given,) = drawn.inputs
    effort = float(planar.forces(planar.solve(drawn)).inputs[given.pair])
    assert hand.window.evaluate("(name) => page.forces.effort(name)", given.pair) == pytest.approx(effort, rel=1e-8)


def test_the_rest_goes_along_with_a_pin_and_keeps_its_lengths(drawing):
    pin, changed = "B", {"AB.length", "A.position"}
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
    hand.button("Undo")
    hand.button("Undo")
    assert planar.dimensions(hand.mechanism()) == before


def test_an_empty_sheet_greets_with_a_hint_and_says_once_what_the_tool_does(drawing):
    hand = drawing()
    assert hand.told().startswith("Draw the first bar")
    assert "nothing moves" not in hand.window.locator("body").inner_text()  # that would be said of the sheet before
    colour = "(name) => getComputedStyle(document.querySelector(name)).color"
    greeting, hint = (
        hand.window.evaluate(colour, name) for name in ("#pencil [role=status] p:not([hidden]).hint", "#pencil-hint")
    )
    assert greeting == hint
    for tool, told in (("Bar", "From one place to another"), ("Plate", "A click for each pin")):
        hand.tool(tool)
        assert hand.window.locator("body").inner_text().count(told) == 1
    hand.bars((0, 0), (40, 0))
    assert hand.told().startswith("Nothing is fixed yet")
    assert hand.window.locator("#pencil .why:visible").count() == 0


def test_one_button_undoes_what_was_drawn_and_what_was_done_on_the_page(drawing):
    hand = drawing(planar.to_dict("crank-rocker"))
    for name in ("Undo", "Redo", "Save"):
        assert hand.window.get_by_role("button", name=name, exact=True).count() == 1
    start = hand.file()
    length = "page.linkage.d[page.data.dimensions.findIndex((each) => each.what === 'length')]"
    first = hand.window.evaluate(length)
    hand.window.evaluate("page.changeTo(page.linkage.d.map((each) => 1.01 * each))")
    changed = hand.window.evaluate(length)
    assert changed == pytest.approx(1.01 * first)
    hand.window.evaluate("editing.perform((draft) => Draw.renamePin(draft, [...editing.placed.pins.keys()][0], 'Q'))")
    hand.wait()
    assert "Q" in json.dumps(hand.file())
    hand.button("Undo")
    assert "Q" not in json.dumps(hand.file())
    assert hand.window.evaluate(length) == pytest.approx(changed, rel=1e-12)
    hand.button("Undo")
    assert hand.file()["links"] == start["links"]
    assert hand.window.evaluate(length) == pytest.approx(first, rel=1e-12)
    assert hand.window.get_by_role("button", name="Undo", exact=True).is_disabled()
    hand.button("Redo")
    hand.button("Redo")
    assert "Q" in json.dumps(hand.file())
