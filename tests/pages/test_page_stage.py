"""How a page is looked at and kept: zoom, the whole screen, reloading, units, pictures and films, what acts."""

from __future__ import annotations

import io
import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from PIL import Image

import planar
from planar.foundation.units import parse_unit
from tests.drawn_linkages import LINKAGES, drawn_kinds
from tests.draws import covering, first_cases, part
from tests.known import MODELS
from tests.page_scripts import downloaded, same, settled


def drawn_point(window, name):
    """Where a point is on the screen (px)."""
    return np.array(window.evaluate("(name) => page.view.toScreen(page.point(name).position)", name))


MOVE_BETWEEN_ENDS = """(ratio) => {
  const { low, high } = controls.ends(page.running);
  page.moveTo(low + ratio * (high - low));
}"""


def saved_bytes(window, button, path):
    with window.expect_download() as coming:
        window.get_by_role("button", name=button).click()
    coming.value.save_as(path)
    return path.read_bytes()


# what is drawn

RACKS = [
    ("pump-jack", {"horsehead": ("P", "S", 1)}),
    ("rack-steering", {"mesh": ("S", "O", 0)}),
    ("rack-differential", {"lower mesh": ("L", "C", 0), "upper mesh": ("U", "C", 0)}),
]
"""Of each rack a point on its pitch line, the pinion's centre, and the axis along which it lies."""
BARS = """() => [...document.querySelectorAll("#drawing .wheels polygon")].map((each) => {
  const { link } = each.closest("[data-link]").dataset, { left, right, top, bottom } = each.getBoundingClientRect();
  return [link, [[left, right], [top, bottom]]];
})"""


@pytest.mark.parametrize(
    ("name", "meshes"),
    covering(RACKS, lambda rack: {("count", len(rack[1])), *(("axis", axis) for *_, axis in rack[1].values())}),
)
def test_a_rack_is_in_the_frame_and_beneath_its_wheel_at_every_end_of_the_motion(name, meshes, shown):
    mechanism = MODELS[name]
    window = shown(mechanism)
    racks = {pair.name: pair.links[0] for pair in mechanism.pairs}
    window.wait_for_function("() => page.course")
    frame = window.locator("#drawing").bounding_box()
    sides = [(frame["x"], frame["x"] + frame["width"]), (frame["y"], frame["y"] + frame["height"])]
    for ratio in (0.5, 0.0, 1.0, 0.25):
        window.evaluate(MOVE_BETWEEN_ENDS, ratio)
        settled(window)
        bars = window.evaluate(BARS)
        for mesh, (point, centre, axis) in meshes.items():
            own = [box for link, box in bars if link == racks[mesh]]
            assert own
            for box in own:
                for (low, high), (least, most) in zip(box, sides, strict=True):
                    assert least <= low <= high <= most
            low, high = own[0][axis]
            for each in (point, centre):
                assert low - 2.0 <= drawn_point(window, each)[axis] + sides[axis][0] <= high + 2.0


def test_a_guide_is_drawn_wherever_its_block_goes_where_nothing_limits_it(shown):
    window = shown(MODELS["rack-differential"])
    frame = window.locator("#drawing").bounding_box()
    for position in (0.12, 0.1, 0.07, 0.02, 0.17, 0.3):
        window.evaluate("(position) => page.moveTo(position)", position)
        settled(window)
        x, y = drawn_point(window, "L")
        assert 0.0 < x < frame["width"]
        assert 0.0 < y < frame["height"]
        # its guide is a line of the frame beside the block
        lines = window.evaluate(
            """() => [...document.querySelectorAll("#drawing .ground [data-link=frame] polyline")]
              .map((each) => each.getBoundingClientRect()).filter(({ width }) => width > 60)
              .map(({ left, right, top }) => [left, right, top])"""
        )
        near = [(left, right) for left, right, top in lines if abs(top - y - frame["y"]) < 15.0]
        assert near
        assert all(left <= x + frame["x"] <= right for left, right in near)


# looked at


def test_numbers_below_nothing_have_a_minus_as_in_print(shown):
    window = shown(planar.from_dict(LINKAGES["offset slider-crank"][1]))
    window.wait_for_function("() => page.course")
    assert window.locator(".ends span").first.inner_text() == "dead point −171.5 deg"


def test_the_heading_of_a_wide_table_is_read_whole(shown):
    window = shown(planar.from_dict(LINKAGES["five-bar"][1]))
    assert window.evaluate(
        """() => [...document.querySelectorAll("#numbers .scroll")].every((each) => {
          each.scrollLeft = 100;
          const frame = each.getBoundingClientRect(), head = each.querySelector("caption").getBoundingClientRect();
          return each.scrollWidth > each.clientWidth && head.left >= frame.left - 1 && head.right <= frame.right + 1;
        })"""
    )


CROSSED = """() => {
  const boxes = (parts) => [...document.querySelectorAll(parts)].map((each) => each.getBoundingClientRect());
  const rings = boxes("#drawing .layers circle"), letters = boxes("#drawing .letters text");
  const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom - 4 <= b.top || b.bottom - 4 <= a.top;
  const crossed = letters.filter((letter) => rings.some((ring) => !apart(ring, letter)));
  return [rings.length, crossed.map(({ left, top }) => [left, top])];
}"""
"""How many centres are marked, and the places of letters that one of them crosses."""


@pytest.mark.parametrize("name", part(["Watt", "Stephenson", "toggle"], 3))
def test_letters_of_points_make_room_for_centres(name, shown):
    window = shown(planar.from_dict(LINKAGES[name][1]))
    window.get_by_label("Instantaneous centres").check()
    settled(window)
    count, crossed = window.evaluate(CROSSED)
    assert count > 5
    assert crossed == []


HIDDEN = """() => {
  const shown = [...document.querySelectorAll(".lens")].filter((each) => each.offsetHeight);
  const boxes = shown.map((each) => each.getBoundingClientRect());
  const { left, top } = svg.getBoundingClientRect(), { avoided } = drawing, spots = [];
  for (let k = 0; k < avoided.length; k += 2) {
    const x = left + avoided[k], y = top + avoided[k + 1];
    spots.push([x, y, x, y]);
  }
  for (const each of document.querySelectorAll("#drawing .layers :is(circle, text, .head)")) {
    const box = each.getBoundingClientRect();
    spots.push([box.left, box.top, box.right, box.bottom]);
  }
  const meets = ([x0, y0, x1, y1]) => (box) => x0 < box.right && x1 > box.left && y0 < box.bottom && y1 > box.top;
  return [boxes.length, spots.filter((each) => boxes.some(meets(each)))];
}"""
"""How many groups of buttons lie over the drawing, and boxes of what they hide: strokes' ends, centres, letters."""


@pytest.mark.parametrize(
    ("name", "screen"),
    covering(
        product(["toggle", "cam", "quick return", "offset slider-crank"], ["desk", "phone"]),
        lambda case: {case[1], *drawn_kinds(case[0])} - {("turning", False)},
    ),
)
def test_no_button_hides_what_is_drawn_while_it_moves(name, screen, shown):
    window = shown(planar.from_dict(LINKAGES[name][1]), screen)
    window.wait_for_function("() => page.course")
    window.get_by_label("Instantaneous centres").check()
    for ratio in (0.5, 0.0, 1.0, 0.3, 0.7):
        window.evaluate(MOVE_BETWEEN_ENDS, ratio)
        settled(window)
        count, hidden = window.evaluate(HIDDEN)
        assert count == 2
        assert hidden == []


def test_the_drawing_stays_in_sight_while_the_panels_scroll(shown):
    window = shown(MODELS["watt-six-bar"])
    for name in ("Numbers", "Dimensions", "Save"):
        window.get_by_role("navigation", name="Panels").get_by_role("button", name=name).click()
        settled(window)
        box = window.locator("#drawing").bounding_box()
        assert box["y"] >= 0.0
        assert box["y"] + box["height"] <= 900.0
        assert box["height"] > 400.0
        assert window.get_by_role("button", name="Play").is_visible()
    assert window.evaluate("scrollY") > 300.0
    assert window.evaluate("document.activeElement.id") == "saving"


def test_the_wheel_looks_nearer_about_the_pointer_and_what_is_dragged_stays_under_it(shown):
    window = shown(MODELS["watt-six-bar"])
    at, scale = drawn_point(window, "B"), window.evaluate("page.view.scale")
    box = window.locator("#drawing").bounding_box()
    window.mouse.move(box["x"] + at[0], box["y"] + at[1])
    window.mouse.wheel(0.0, -600.0)
    settled(window)
    assert window.evaluate("page.view.scale") / scale == pytest.approx(np.exp(0.9), rel=1e-6)
    assert drawn_point(window, "B") == pytest.approx(at, abs=1.5)  # whole px of the pointer
    # empty paper is moved along by the pointer
    empty = (box["x"] + 40.0, box["y"] + box["height"] - 60.0)
    window.mouse.move(*empty)
    window.mouse.down()
    window.mouse.move(empty[0] + 100.0, empty[1] - 30.0, steps=4)
    window.mouse.up()
    settled(window)
    assert drawn_point(window, "B") == pytest.approx(at + np.array([100.0, -30.0]), abs=2.0)
    start = window.evaluate("page.input(0)")
    window.mouse.move(*(np.array([box["x"], box["y"]]) + drawn_point(window, "B")))
    window.mouse.down()
    window.mouse.move(*(np.array([box["x"] - 60.0, box["y"]]) + drawn_point(window, "B")), steps=4)
    window.mouse.up()
    settled(window)
    assert window.evaluate("page.input(0)") != start
    window.get_by_role("button", name="Fit everything (0)").click()
    settled(window)
    assert window.evaluate("page.view.scale") == pytest.approx(scale)


def test_keys_look_nearer_and_along_and_take_the_whole_screen(shown):
    window = shown(MODELS["watt-six-bar"])
    scale, height, mm = window.evaluate("[page.view.scale, page.view.height, page.view.mm]")
    drawing = window.locator("#drawing")
    drawing.focus()
    window.keyboard.press("+")
    settled(window)
    assert window.evaluate("page.view.scale") == pytest.approx(1.25 * scale)
    at = drawn_point(window, "B")
    window.keyboard.press("Control+ArrowRight")
    settled(window)
    assert drawn_point(window, "B") == pytest.approx(at - [40.0, 0.0], abs=0.5)
    window.keyboard.press("0")
    window.keyboard.press("f")
    settled(window)
    assert window.locator(".left").bounding_box() == {"x": 0.0, "y": 0.0, "width": 1280.0, "height": 900.0}
    assert window.evaluate("page.view.mm") > 1.3 * mm
    assert (
        window.get_by_role("button", name="Play").evaluate("(each) => parseFloat(getComputedStyle(each).fontSize)")
        == 24.0
    )
    assert window.evaluate("document.querySelector('.right').inert")
    window.keyboard.press("Escape")
    settled(window)
    assert not window.evaluate("document.querySelector('.right').inert")
    assert window.evaluate("page.view.height") == height


def test_two_fingers_look_nearer(shown):
    window = shown(MODELS["watt-six-bar"], screen="phone")
    scale = window.evaluate("page.view.scale")
    touch = window.context.new_cdp_session(window)
    box = window.locator("#drawing").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def fingers(kind, far):
        points = [] if far is None else [{"x": x - far, "y": y, "id": 0}, {"x": x + far, "y": y, "id": 1}]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    fingers("touchStart", 40)
    for far in (50, 60, 70, 80):
        fingers("touchMove", far)
    fingers("touchEnd", None)
    settled(window)
    assert window.evaluate("page.view.scale") / scale == pytest.approx(2.0, rel=0.1)


def test_compact_shows_the_drawing_and_what_moves_it_alone(shown):
    window = shown(MODELS["four-bar"])
    window.goto(f"{window.url}#compact=1")
    window.reload()
    assert window.get_by_role("button", name="Play").is_visible()
    assert window.locator("#drawing").is_visible()
    for hidden in ("#layers", "#numbers", "#dimensions"):
        assert not window.locator(hidden).is_visible()
    heading = window.get_by_role("heading", level=1)  # heard, and not seen
    assert heading.inner_text() == MODELS["four-bar"].name
    assert window.evaluate("document.documentElement.scrollHeight <= innerHeight")


# kept


def test_what_is_changed_and_looked_at_is_there_again_after_a_reload(shown):
    window = shown(MODELS["watt-six-bar"])
    window.get_by_label("AB: length, number, mm").fill("225")
    window.get_by_label("AB: length, number, mm").press("Enter")
    angle = window.get_by_label("A0 (deg)")
    angle.fill("100")
    angle.press("Enter")
    window.get_by_role("button", name="Zoom in (+)").click()
    window.get_by_label("Velocity arrows").check()
    settled(window)
    here = "[Array.from(page.linkage.d), page.input(0), Array.from(page.linkage.z), page.view.scale]"
    wait_for_address(window)
    stood = window.evaluate(here)
    window.reload()
    settled(window)
    found = window.evaluate(here)
    for one, other in zip(stood, found, strict=True):
        assert other == pytest.approx(one, rel=1e-2 if one is stood[3] else 1e-12)
    assert window.get_by_label("Velocity arrows").is_checked()
    assert window.get_by_role("button", name="Undo").is_disabled()


def test_an_address_that_is_not_of_this_mechanism_is_left_aside(shown):
    mechanism = MODELS["watt-six-bar"]
    window = shown(mechanism)
    address = window.url
    for kept in ('{"u":[1],"z":[9,9,9,9]}', '{"u":[null],"z":[]}', "[1", '{"d":3,"u":[1e999],"z":null}'):
        window.goto(f"{address}#at={kept}&view=a,b&figures=x&units=ell")
        window.reload()
        settled(window)
        same(window, planar.solve(mechanism))


def test_figures_and_units_are_chosen_and_the_file_keeps_its_own(shown, tmp_path):
    mechanism = MODELS["watt-six-bar"]
    window = shown(mechanism)
    window.get_by_label("Figures").select_option("3")
    settled(window)
    cell = window.locator("#numbers tbody td[data-si]").first
    assert cell.inner_text() == "40.0"
    window.get_by_label("Units").select_option("in, deg")
    window.wait_for_function("() => globalThis.page?.data.unit_choice > 0")
    settled(window)
    length = parse_unit("in")
    assert float(cell.inner_text()) == pytest.approx(length.from_si(0.04), rel=5e-3)
    field = window.get_by_label("AB: length, number, in", exact=True)
    field.fill("9")
    field.press("Enter")
    settled(window)
    saved = planar.loads(downloaded(window, "Save: Mechanism (JSON)", tmp_path / "saved.json"))
    assert saved.units == mechanism.units
    assert planar.dimensions(saved)["AB.length"] == pytest.approx(length.to_si(9.0), rel=1e-15)


# taken away


def test_a_picture_of_dots_is_large_and_shows_the_drawing(shown, tmp_path):
    window = shown(MODELS["crank-rocker"], scheme="dark")
    image = Image.open(io.BytesIO(saved_bytes(window, "Save: Picture (PNG)", tmp_path / "a.png")))
    box = window.locator("#drawing").bounding_box()
    assert max(image.size) >= 1999
    assert image.size[0] / image.size[1] == pytest.approx(box["width"] / box["height"], rel=0.01)
    colours = image.convert("RGB").getcolors(1 << 24)
    paper = max(colours)[1]
    assert max(paper) < 60  # dark as the page is
    assert sum(count for count, colour in colours if min(colour) > 200) > 3000  # bars and letters


@pytest.mark.parametrize("stem", first_cases(["crank-rocker", "000-P1"]))
def test_the_motion_is_a_gif_that_comes_round_to_where_it_began(stem, shown, tmp_path):
    window = shown(MODELS[stem])
    window.set_viewport_size({"width": 1000, "height": 420})
    window.wait_for_function("() => page.course")
    window.evaluate("FILM.frames = 8")
    stood = window.evaluate("page.snapshot()")
    window.set_default_timeout(60_000)
    film = Image.open(io.BytesIO(saved_bytes(window, "Save: Motion (GIF)", tmp_path / "a.gif")))
    window.set_default_timeout(10_000)
    assert film.n_frames == 8
    assert film.info["loop"] == 0
    frames = []
    for k in (0, 1, 4, 7):
        film.seek(k)
        frames.append(np.asarray(film.convert("L"), dtype=float))
    apart = [np.abs(each - frames[0]).mean() for each in frames]
    assert 0.0 < apart[1] < apart[2]
    assert apart[3] < apart[2]
    assert (frames[0] > 200).mean() > 0.8
    now = window.evaluate("page.snapshot()")
    assert [now["u"], now["d"]] == [stood["u"], stood["d"]]
    assert window.get_by_role("button", name="Undo").is_disabled()


def wait_for_address(window):
    """Wait until the last change stands in the address, which is written a little later."""
    window.wait_for_function("() => page.keeping.waits === null && location.hash.includes('at=')")


def test_the_motion_is_a_video(shown, tmp_path):
    window = shown(MODELS["crank-rocker"])
    records = (
        "() => typeof MediaRecorder !== 'undefined' && FILM.types.some((each) => MediaRecorder.isTypeSupported(each))"
    )
    if not window.evaluate(records):
        assert window.get_by_role("button", name="Save: Motion (video)").count() == 0
        return
    window.wait_for_function("() => page.course")
    window.set_default_timeout(60_000)
    for seconds in (1.5, 6.0, 24.0):  # a busy machine may encode nothing of a short one
        window.evaluate("(seconds) => Object.assign(FILM, { seconds, frames: 30 })", seconds)
        film = saved_bytes(window, "Save: Motion (video)", tmp_path / "a.webm")
        if len(film) > 5000:
            break
    window.set_default_timeout(10_000)
    assert film[:4] == bytes.fromhex("1a45dfa3") or film[4:8] == b"ftyp"  # what files of either form begin with
    assert len(film) > 5000


# what acts


def test_loads_springs_and_masses_are_changed_and_forces_follow_and_are_saved(shown, tmp_path):
    mechanism = MODELS["two-stroke-engine"]
    window = shown(mechanism)
    window.get_by_label("force on B along x, number, N").fill("-400")
    window.get_by_label("force on B along x, number, N").press("Enter")
    slider = window.get_by_role("slider", name="mass of rod, kg", exact=True)
    slider.focus()
    for _ in range(3):
        window.keyboard.press("ArrowRight")
    settled(window)
    saved = planar.loads(downloaded(window, "Save: Mechanism (JSON)", tmp_path / "saved.json"))
    numbers = planar.dimensions(saved)
    assert numbers["loads.0.force.x"] == -400.0
    assert numbers["masses.rod.mass"] > planar.dimensions(mechanism)["masses.rod.mass"]
    (given,) = mechanism.inputs
    effort = planar.forces(planar.solve(saved)).inputs[given.pair]
    assert window.evaluate("(name) => page.forces.effort(name)", given.pair) == pytest.approx(float(effort), rel=1e-9)
    assert float(effort) != pytest.approx(float(planar.forces(planar.solve(mechanism)).inputs[given.pair]), rel=0.01)
    wait_for_address(window)
    window.reload()
    settled(window)
    assert window.evaluate("(name) => page.forces.effort(name)", given.pair) == pytest.approx(float(effort), rel=1e-9)
    window.get_by_role("button", name="Reset all of these").click()
    settled(window)
    filed = float(planar.forces(planar.solve(mechanism)).inputs[given.pair])
    assert window.evaluate("(name) => page.forces.effort(name)", given.pair) == pytest.approx(filed, rel=1e-9)
    window.keyboard.press("Control+z")
    settled(window)
    assert window.evaluate("(name) => page.forces.effort(name)", given.pair) == pytest.approx(float(effort), rel=1e-9)


def test_a_mass_cannot_be_less_than_nothing(shown):
    window = shown(MODELS["two-stroke-engine"])
    field = window.get_by_label("mass of rod, number, kg")
    field.fill("-1")
    field.press("Enter")
    settled(window)
    assert window.locator("#said").inner_text() == "mass of rod cannot be -1 kg."
    assert float(field.input_value()) > 0.0


def test_a_spring_without_free_length_keeps_its_force_where_its_ends_meet(shown):
    mechanism = MODELS["balanced-lamp"]
    window = shown(mechanism)
    names = window.evaluate("page.data.forces.parameters.map((each) => each.name)")
    assert "springs.0.stiffness" in names
    assert not {"springs.0.free", "springs.0.damping"} & set(names)
    assert json.dumps(names).count("masses.arm.mass") == 1
    field = window.get_by_label("mass of arm, number, kg")
    field.fill("0.45")
    field.press("Enter")
    settled(window)
    (given,) = mechanism.inputs
    heavier = replace(
        mechanism, masses=tuple(each._replace(mass=0.45) for each in mechanism.masses[:1]) + mechanism.masses[1:]
    )
    effort = float(planar.forces(planar.solve(heavier)).inputs[given.pair])
    assert window.evaluate("(name) => page.forces.effort(name)", given.pair) == pytest.approx(effort, rel=1e-9)


# pins


def test_pins_are_dragged_and_lengths_follow_while_all_others_stay(shown, tmp_path):
    mechanism = MODELS["000-P1"]
    window = shown(mechanism)
    before = {name: point.position for name, point in planar.solve(mechanism).points.items()}
    window.get_by_role("button", name="Pins").click()
    box = window.locator("#drawing").bounding_box()
    corner = np.array([box["x"], box["y"]])
    for name, by in (("C", (10.0, -6.0)), ("D", (-4.0, 3.0)), ("B", (2.0, 5.0))):
        at = drawn_point(window, name) + corner
        window.mouse.move(*at)
        window.mouse.down()
        window.mouse.move(*(at + by), steps=3)
        settled(window)
        window.mouse.up()
        settled(window)
        assert drawn_point(window, name) + corner == pytest.approx(at + by, abs=25.0)  # it is fitted anew
        before[name] = np.array(window.evaluate("(name) => page.point(name).position", name))
    saved = planar.loads(downloaded(window, "Save: Mechanism (JSON)", tmp_path / "saved.json"))
    found = planar.solve(saved)
    for name in ("A", "B", "C", "D"):
        assert found.point(name).position == pytest.approx(before[name], abs=1e-10)
    same(window, found)
    assert planar.dimensions(saved)["BC.length"] != planar.dimensions(mechanism)["BC.length"]
    for _ in range(3):
        window.keyboard.press("Control+z")
    settled(window)
    same(window, planar.solve(mechanism))


def test_pins_are_moved_by_keys_and_one_that_would_not_go_together_stays(shown):
    mechanism = MODELS["slider-crank"]
    window = shown(mechanism)
    window.get_by_role("button", name="Pins").click()
    window.locator("#drawing").focus()
    names = window.evaluate("page.data.names")
    for _ in range(1 + names.index("A")):
        window.keyboard.press("n")
    assert window.locator("#said").inner_text().startswith("Pin A ")
    start = window.evaluate("page.point('A').position")
    window.keyboard.press("Shift+ArrowRight")
    settled(window)
    there = window.evaluate("page.point('A').position")
    assert there == pytest.approx([start[0] + 0.02 * window.evaluate("page.data.size"), start[1]], abs=1e-9)
    assert "Pin A at" in window.locator("#said").inner_text()
    # the rest goes along: only a place of the frame changes
    before = window.evaluate("Array.from(page.linkage.d)")
    window.get_by_role("button", name="Rest along").click()
    window.locator("#drawing").focus()
    for _ in range(len(names) + names.index("O") - names.index("A")):
        window.keyboard.press("n")
    rod = window.evaluate("page.point('B').position")
    window.keyboard.press("Shift+ArrowUp")
    moved = np.array(window.evaluate("Array.from(page.linkage.d)")) != before
    changed = np.array(window.evaluate("page.data.dimensions.map((each) => each.name)"))[moved]
    assert list(changed) == ["frame.O.y"]
    assert window.evaluate("page.point('B').position") != rod
    window.keyboard.press("Escape")
    assert window.locator(".pencil").count() == 0
