"""What a reader adds to a page without a server: points, speeds, a wanted path; a link of the same structure."""

from __future__ import annotations

import json

import numpy as np
import pytest

import planar
from planar.document.texts.mechanism_link import read_link, write_link
from tests.draws import first_cases
from tests.known import MODELS
from tests.page_scripts import downloaded, same, settled

FOUR_BAR = MODELS["000-P1"]


def on_screen(window, x, y):
    """A place of the world (m) on the screen (px)."""
    return window.evaluate(
        "([x, y]) => { const { left, top } = svg.getBoundingClientRect(), at = page.view.toScreen([x, y]);"
        " return [left + at[0], top + at[1]]; }",
        [float(x), float(y)],
    )


def alike(window, state):
    """The page's points, whatever their order, are those of a state."""
    assert set(window.evaluate("page.data.names")) == set(state.points)
    for name, point in state.points.items():
        found = window.evaluate("(name) => Object.values(page.point(name))", name)
        for value, wanted in zip(found, (point.position, point.velocity, point.acceleration), strict=True):
            assert value == pytest.approx(wanted, rel=1e-9, abs=1e-9)


def press(window, name):
    window.get_by_role("button", name=name, exact=True).click()


def test_a_point_that_is_added_moves_with_its_link_and_goes_with_the_file(shown, tmp_path):
    window = shown(FOUR_BAR)
    points = {name: point.position for name, point in planar.solve(FOUR_BAR).points.items()}
    middle = (points["B"] + points["C"]) / 2
    press(window, "Add a point to a link")
    window.mouse.click(*on_screen(window, *middle))
    wanted = middle + np.array([0.01, -0.02])
    window.mouse.click(*on_screen(window, *wanted))
    (name,) = set(window.evaluate("page.data.names")) - set(points)
    assert f"Point {name} of BC is added" in window.locator("#said").inner_text()
    scale = window.evaluate("page.view.scale")
    assert window.evaluate("(name) => page.point(name).position", name) == pytest.approx(wanted, abs=1.5 / scale)
    window.evaluate("page.moveTo(page.input() + 0.5)")
    saved = planar.loads(downloaded(window, "Save: Mechanism (JSON)", tmp_path / "saved.json"))
    alike(window, planar.solve(saved))
    table = downloaded(window, "Save: Motion (CSV)", tmp_path / "motion.csv").splitlines()
    assert f"{name} x [mm]" in table[0]
    at = [table[0].split(",").index(f"{name} {axis} [mm]") for axis in "xy"]
    motion = planar.cycle(saved, steps=12)
    row = [float(each) for each in table[len(table) // 2].split(",")]
    rows = np.hypot(*(1000 * motion.point(name).position - [row[k] for k in at]).T)
    assert rows.min() < 0.2 * np.ptp(motion.point(name).position) * 1000  # on its path
    window.reload()
    settled(window)
    assert name in window.evaluate("page.data.names")
    press(window, f"Remove {name}")
    assert name not in window.evaluate("page.data.names")


def test_a_point_is_typed_and_speeds_are_others_until_undone(shown, tmp_path):
    mechanism = MODELS["slider-crank"]
    window = shown(mechanism)
    window.get_by_text("Points of your own").click()
    window.get_by_label("Link of the new point").select_option("rod")
    window.get_by_label("x in the link's axes, mm").fill("400")
    press(window, "Add point")
    window.get_by_text("Speeds of inputs").click()
    field = window.get_by_label("velocity of O, rad/s")
    field.fill("-7.5")
    field.press("Enter")
    saved = planar.loads(downloaded(window, "Save: Mechanism (JSON)", tmp_path / "saved.json"))
    assert saved.inputs[0].velocity == -7.5
    assert saved.inputs[0].acceleration == mechanism.inputs[0].acceleration
    alike(window, planar.solve(saved))
    window.get_by_role("button", name="Undo", exact=True).click()
    assert window.evaluate("page.inputRates()[0][0]") == mechanism.inputs[0].velocity


def test_a_path_is_wanted_on_a_page_without_a_server_and_saved_as_a_task(shown, tmp_path):
    window = shown(FOUR_BAR)
    press(window, "Draw the wanted path")
    for x, y in ((0.0, 0.02), (0.03, 0.04), (0.06, 0.03)):
        window.mouse.click(*on_screen(window, x, y))
    task = planar.read_task(json.loads(downloaded(window, "Task (JSON)", tmp_path / "task.json")))
    scale = window.evaluate("page.view.scale")
    assert task.wanted[0].places == pytest.approx(np.array([(0.0, 0.02), (0.03, 0.04), (0.06, 0.03)]), abs=1.5 / scale)
    assert task.wanted[0].in_order
    assert window.evaluate("page.wanted.items[0].of") == task.wanted[0].point
    window.reload()
    settled(window)
    assert window.evaluate("page.wanted.items[0].places.length") == 3
    press(window, "Erase wanted path")
    assert window.evaluate("page.wanted") is None


STANDS = """() => JSON.stringify([
  page.data.names, ...["d", "u", "z"].map((key) => Array.from(page.linkage[key])), page.inputRates(), page.running,
  page.data.names.map((name) => page.point(name).position),
  page.wanted?.items.map(({ of, places, is_closed }) => [of, places, is_closed]) ?? null,
])"""
"""What stands on a page, in exact numbers."""


def test_points_and_paths_that_are_added_are_steps_of_one_history(shown):
    window = shown(FOUR_BAR)
    seen = [window.evaluate(STANDS)]

    def see():
        settled(window)
        seen.append(window.evaluate(STANDS))

    def type_length(number):
        field = window.get_by_label("BC: length, number, mm")
        field.fill(number)
        field.press("Enter")
        see()

    def click(*places):
        for place in places:
            window.mouse.click(*on_screen(window, *place))
            see()

    def step_input():
        window.locator("#drawing").press("Shift+ArrowRight")
        see()

    length = 1000 * planar.dimensions(FOUR_BAR)["BC.length"]
    type_length(f"{1.05 * length:.6g}")
    for _ in range(2):
        middle = window.evaluate("[0, 1].map((k) => (page.point('B').position[k] + page.point('C').position[k]) / 2)")
        press(window, "Add a point to a link")
        window.mouse.click(*on_screen(window, *middle))
        window.mouse.click(*on_screen(window, middle[0] + 0.01 * len(seen), middle[1] + 0.01))
        press(window, "Add a point to a link")  # no longer
        see()
        step_input()
    press(window, "Draw the wanted path")
    click((0.0, 0.02), (0.03, 0.04), (0.06, 0.03))
    press(window, "Draw the wanted path")
    step_input()
    window.mouse.move(*on_screen(window, 0.03, 0.04))
    window.mouse.down()
    window.mouse.move(*on_screen(window, 0.03, 0.044), steps=3)
    window.mouse.up()
    window.wait_for_function("() => page.wanted.fit.ready && !page.wanted.waits")  # the dimensions have followed
    see()
    window.get_by_label("Point that is to trace it").select_option("C")
    see()
    type_length(f"{0.97 * length:.6g}")
    (name,) = json.loads(seen[-1])[0][-1:]
    press(window, f"Remove {name}")
    see()
    step_input()
    press(window, "Erase wanted path")
    see()
    assert len(set(seen)) == len(seen)
    undo, redo = (window.get_by_role("button", name=each, exact=True) for each in ("Undo", "Redo"))
    back, forth = [], []
    undo.focus()
    for _ in seen[1:]:
        window.keyboard.press("Enter")
        settled(window)
        back.append(window.evaluate(STANDS))
    assert back == seen[-2::-1]
    assert undo.is_disabled()
    assert "points=" not in window.url
    assert "wish=" not in window.url
    for _ in seen[1:]:
        window.keyboard.press("Control+y")
        settled(window)
        forth.append(window.evaluate(STANDS))
    assert forth == seen[1:]
    assert redo.is_disabled()
    assert "points=" in window.url


@pytest.mark.parametrize("name", first_cases(["toggle-clamp", "000-P1"]))
def test_a_page_without_a_server_says_where_new_loads_are_drawn(name, shown, drawing):
    window = shown(MODELS[name])
    part = window.get_by_text("Loads, springs and masses", exact=True).locator("..")
    if not part.evaluate("(part) => part.open"):
        part.locator("summary").click()
    (told,) = part.locator("p").all_inner_texts()
    assert told.count(".") == 1
    assert "planar edit LINK" in told
    press(window, "Copy mechanism as a link")
    link = window.get_by_label("Link of this mechanism").input_value()
    # there they are drawn, and nothing is said of it
    hand = drawing(json.loads(read_link(link)))
    assert hand.window.get_by_text("planar edit LINK").count() == 0
    many = len(hand.mechanism().loads)
    moving = next(name for name, at in planar.solve(hand.mechanism()).points.items() if np.hypot(*at.velocity) > 0)
    at = planar.solve(hand.mechanism()).point(moving).position * 1000
    hand.tool("Force")
    hand.drag(at, at + np.array([0.0, -0.2 * hand.window.evaluate("1000 * page.data.size")]))
    assert len(hand.mechanism().loads) == many + 1
    assert hand.window.get_by_label("Forces", exact=True).count() == 1


def test_a_link_of_the_same_structure_is_opened_and_of_another_one_refused(shown):
    window = shown(FOUR_BAR)
    other = planar.to_dict(FOUR_BAR)
    other["links"]["BC"]["length"] *= 1.04
    other["inputs"][0] |= {"position": "70 deg", "velocity": "30 rpm"}
    for pair in other["pairs"]:
        pair.pop("links", None)  # as an author may leave them out
    window.evaluate("(link) => { location.hash = `link=${link}`; location.reload(); }", write_link(other))
    window.wait_for_function("() => document.getElementById('said')?.textContent.includes('with its numbers')")
    same(window, planar.solve(planar.from_dict(other)))
    press(window, "Copy mechanism as a link")
    copied = planar.load(window.get_by_label("Link of this mechanism").input_value())
    same(window, planar.solve(copied))
    field = window.get_by_label("Link or text of a mechanism of this structure")
    for text, said in (
        (write_link(planar.to_dict("slider-crank")), "of another structure"),
        ("planar:???", "no whole mechanism"),
        (json.dumps(other | {"units": {"length": "cm", "angle": "deg"}}), "other units"),
    ):
        field.fill(text)
        press(window, "Open")
        window.wait_for_function("(said) => document.getElementById('said').textContent.includes(said)", arg=said)
    same(window, planar.solve(planar.from_dict(other)))
