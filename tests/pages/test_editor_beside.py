"""What lies beside a drawing: a picture underneath, a wanted path; and how the page is reached without a mouse."""

from __future__ import annotations

import io
import json
from math import cos, pi, sin

import numpy as np
import pytest
from PIL import Image

import planar
from tests.draws import is_exhaustive
from tests.page_scripts import FAINT, MISNAMED, NAMELESS, downloaded, settled
from tests.prepared_search import send_designs
from tests.small_searches import search_few

ON_PICTURE = """(places) => {
  const image = document.querySelector("#drawing .underlay image"), to = image.getScreenCTM();
  const box = ["x", "y", "width", "height"].map((each) => Number(image.getAttribute(each)));
  return places.map(([x, y]) => {
    const at = new DOMPoint(box[0] + x * box[2], box[1] + y * box[3]).matrixTransform(to);
    return [at.x, at.y];
  });
}"""
"""Where parts of the breadth and height of the picture lie on the screen."""


def photograph():
    made = io.BytesIO()
    Image.linear_gradient("L").resize((400, 200)).save(made, "PNG")
    return {"name": "scan.png", "mimeType": "image/png", "buffer": made.getvalue()}


# a picture underneath


def test_a_picture_is_laid_by_two_places_whose_distance_is_typed_and_stays(drawing):
    hand = drawing()
    asked = []
    hand.window.on("request", lambda request: asked.append(request.url))
    hand.window.get_by_label("Picture", exact=True).set_input_files(files=[photograph()])
    hand.window.wait_for_selector("#drawing .underlay image")
    assert hand.window.evaluate("editing.tool") == "picture"
    places = [[0.25, 0.75], [0.75, 0.25]]
    for at in hand.window.evaluate(ON_PICTURE, places):
        hand.window.mouse.click(*at)
    for label, number in (("Distance (mm)", "150"), ("Direction (deg)", "90"), ("First at x (mm)", "-20")):
        hand.type(label, number)
    hand.type("First at y (mm)", "10")
    wanted = [hand.screen(-20, 10), hand.screen(-20, 160)]
    assert hand.window.evaluate(ON_PICTURE, places) == [pytest.approx(at, abs=1.5) for at in wanted]
    hand.window.get_by_label("Opacity").fill("0.25")
    hand.bars((0, 0), (30, 40))  # drawn over it
    assert "scan" not in str(hand.file())
    hand.window.on("dialog", lambda dialog: dialog.accept())
    hand.window.reload()
    hand.wait()
    settled(hand.window)
    wanted = [hand.screen(-20, 10), hand.screen(-20, 160)]
    assert hand.window.evaluate(ON_PICTURE, places) == [pytest.approx(at, abs=1.5) for at in wanted]
    assert hand.window.locator("#drawing .underlay image").get_attribute("opacity") == "0.25"
    hand.button("Remove picture")
    assert hand.window.locator("#drawing .underlay image").count() == 0
    here = tuple(f"{kind}{rest}" for kind, rest in (("", hand.window.evaluate("origin")), ("blob:", ""), ("data:", "")))
    assert all(url.startswith(here) for url in asked)


def test_a_picture_is_undone_step_by_step_with_what_is_drawn_and_comes_back(drawing):
    hand = drawing()
    hand.bars((0, 0), (30, 40))

    def stands():
        """What lies on the paper: the bars, the picture's corners, and the two places by which it is laid."""
        settled(hand.window)
        shown = hand.window.locator("#drawing .underlay image").count()
        corners = hand.window.evaluate(ON_PICTURE, [[0, 0], [1, 1]]) if shown else None
        opacity = hand.window.locator("#drawing .underlay image").get_attribute("opacity") if shown else None
        marks = hand.window.get_by_label("Distance (mm)").is_visible()
        return list(hand.file()["links"]), corners, opacity, marks

    seen = [stands()]
    hand.window.get_by_label("Picture", exact=True).set_input_files(files=[photograph()])
    hand.window.wait_for_selector("#drawing .underlay image")
    seen.append(stands())
    for at in hand.window.evaluate(ON_PICTURE, [[0.25, 0.75], [0.75, 0.25]]):
        hand.window.mouse.click(*at)
    seen.append(stands())
    for label, number in (("Distance (mm)", "150"), ("Direction (deg)", "90"), ("First at x (mm)", "-20")):
        hand.type(label, number)
        seen.append(stands())
    opacity = hand.window.get_by_label("Opacity")
    opacity.fill("0.25")
    seen.append(stands())
    hand.bars((30, 40), (90, 40))
    seen.append(stands())
    hand.button("Remove picture")
    seen.append(stands())
    assert len({str(each) for each in seen}) == len(seen)
    asked = []
    hand.window.on("request", lambda request: asked.append(request.url.rsplit("/", 1)[-1]))
    back, forth = [], []
    for _ in seen[1:]:
        hand.button("Undo")
        back.append(stands())
    for _ in seen[1:]:
        hand.button("Redo")
        forth.append(stands())
    assert back == seen[-2::-1]
    assert forth == seen[1:]
    assert asked.count("answer") == 2  # of the bar alone, there and back
    hand.button("Undo")
    hand.window.on("dialog", lambda dialog: dialog.accept())
    hand.window.reload()
    hand.wait()
    found = hand.window.locator("#drawing .underlay image")
    assert found.get_attribute("opacity") == "0.25"  # what is undone is what the window keeps


DROP = """([kind, content]) => {
  const carried = new DataTransfer();
  if (kind === "file") carried.items.add(new File([content], "drawn.svg", { type: "image/svg+xml" }));
  else carried.setData(kind, content);
  const event = new DragEvent("drop", { bubbles: true, cancelable: true, dataTransfer: carried });
  return document.getElementById("drawing").dispatchEvent(event); // false: the page itself deals with it
}"""
HOSTILE_SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="90" height="60" onload="parent.hacked = 1">
<script>parent.hacked = 1</script><image href="http://other.example/a.png" width="9" height="9"/>
<path d="M0 0h9v9"/></svg>"""


def test_what_is_dropped_is_read_here_and_nothing_of_another_site(drawing):
    hand = drawing()
    asked = []
    hand.window.on("request", lambda request: asked.append(request.url))
    assert hand.window.evaluate(DROP, ["text/uri-list", "http://other.example/a.png"]) is False
    assert "another site is not loaded" in hand.said()
    assert hand.window.evaluate(DROP, ["file", HOSTILE_SVG]) is False
    hand.window.wait_for_selector("#drawing .underlay image")
    assert hand.window.locator("#drawing .underlay image").get_attribute("href").startswith("data:image/png")
    assert hand.window.evaluate("typeof window.hacked") == "undefined"
    assert not [url for url in asked if "other.example" in url]


# a path that is wanted

ELLIPSE = [(45 + 20 * cos(2 * pi * k / 18), 20 + 10 * sin(2 * pi * k / 18)) for k in range(18)]
"""mm"""


def wished(drawing, *places):
    """A four-bar, and a hand that has drawn a path freehand."""
    hand = drawing(planar.to_dict("four-bar"))
    hand.tool("Wanted path")
    hand.drag(*(places or ELLIPSE))
    hand.wait()
    return hand


def test_a_path_drawn_freehand_is_the_wanted_curve_of_a_point_and_a_task(drawing, tmp_path):
    hand = wished(drawing)
    (item,) = hand.window.evaluate("page.wanted.items")
    assert item["is_closed"]
    assert item["of"] in {"E", "F"}  # points of the coupler
    wanted = planar.read_task(json.loads(downloaded(hand.window, "Task (JSON)", tmp_path / "task.json"))).wanted[0]
    assert wanted.is_closed
    assert wanted.point == item["of"]
    off = (wanted.places * 1000 - [45, 20]) / [20, 10]
    assert np.hypot(*off.T) == pytest.approx(1.0, abs=0.05)  # pixels of the pointer
    steps = np.hypot(*np.diff(wanted.places, axis=0, append=wanted.places[:1]).T)
    assert steps == pytest.approx(steps.mean(), rel=0.05)
    hand.window.get_by_label("Point that is to trace it").select_option("B")
    hand.wait()
    assert hand.window.evaluate("page.wanted.items[0].of") == "B"
    # a place is dragged as on any page, and one button undoes that, the choice of the point, and the path
    hand.tool("Move")
    x, y = (1000 * each for each in hand.window.evaluate("editing.wish.places[6]"))
    hand.drag((x, y), (x, y + 4), (x, y + 8))
    moved = np.array(hand.window.evaluate("editing.wish.places[6]")) * 1000
    assert moved == pytest.approx([x, y + 8], abs=0.5)
    hand.button("Undo")
    back = np.array(hand.window.evaluate("editing.wish.places[6]")) * 1000
    assert back == pytest.approx([x, y], abs=1e-9)
    hand.button("Undo")
    hand.button("Undo")
    assert hand.window.evaluate("page.wanted") is None
    assert not hand.window.evaluate("editing.changed")


def test_a_path_is_clicked_place_by_place_and_closed_at_its_first(drawing):
    hand = drawing()
    places = [(0, 0), (40, 0), (60, 30), (30, 50), (-10, 30)]
    hand.use("Wanted path", *places)
    wish = hand.window.evaluate("editing.wish")
    assert np.array(wish["places"]) * 1000 == pytest.approx(np.array(places), abs=1e-9)  # of the grid
    assert not wish["closed"]
    hand.click(places[0])
    assert hand.window.evaluate("editing.wish.closed")
    assert hand.window.locator(".pencil polygon.wish").count() == 1
    hand.button("Erase wanted path")
    assert hand.window.locator(".pencil .wish").count() == 0


def test_designs_that_the_server_finds_are_listed_and_taken_over_in_one_step(drawing):
    hand = wished(drawing)
    before, server, asked = hand.file(), drawing.opened[0][1], []
    design = json.loads(json.dumps(before))
    design["links"]["BC"]["length"] = 70

    def begin(task):
        asked.append(task)
        return {"search": 1, "progress": "begins", "is_over": False}

    def tell(number, stops):
        asked.append(stops)
        if not any(each is True for each in asked):
            return {"search": number, "progress": "start 1", "is_over": False}
        designs = [{"words": "misses by 1 mm (root mean square), by 2 mm at most", "document": design}]
        return {"search": number, "progress": "", "is_over": True, "designs": designs, "remarks": ["stopped early"]}

    server.begin_search, server.tell_search = begin, tell
    hand.window.get_by_role("button", name="Synthesise").click()
    hand.window.get_by_text("Searching: start 1").wait_for()
    hand.window.get_by_role("button", name="Stop").click()
    hand.window.get_by_text("1 design.").wait_for()
    assert planar.read_task(asked[0]).wanted[0].is_closed
    assert asked[0]["start"] == before
    assert hand.window.get_by_text("stopped early").is_visible()
    hand.button("Take design 1")
    assert hand.file() == design
    assert hand.window.evaluate("page.wanted.items.length") == 1
    hand.button("Undo")
    assert hand.file() == before
    server.shutdown()
    server.server_close()
    with hand.window.expect_download() as coming:
        hand.window.get_by_role("button", name="Synthesise").click()
    assert json.loads(coming.value.path().read_text())["start"] == before


def test_a_search_is_found_again_by_a_page_that_is_loaded_again_and_so_is_its_answer(drawing, monkeypatch):
    # what a search that is begun by a request finds is shown by the tests of the server
    searching = search_few if is_exhaustive() else send_designs
    monkeypatch.setattr("planar.pages.editor.search.search_for", searching)
    hand = wished(drawing)
    server = drawing.opened[0][1]
    hand.window.on("dialog", lambda dialog: dialog.accept())
    search, tell = hand.window.get_by_role("button", name="Synthesise"), server.tell_search

    def load_again():
        hand.window.reload()
        hand.wait()

    load_again()
    assert search.is_enabled()  # nothing has been searched for
    server.tell_search = lambda number, stops: {"search": number, "progress": f"search {number}", "is_over": False}
    search.click()
    hand.window.get_by_text("Searching: search").wait_for()
    begun = server.search
    load_again()
    hand.window.get_by_text(f"Searching: search {begun.number}").wait_for()
    assert search.is_disabled()
    assert len(hand.window.evaluate("editing.wish.places")) == 24
    server.tell_search = tell
    hand.window.get_by_text("6 designs.").wait_for(timeout=60_000)
    assert server.search is begun
    found = begun.told
    for _ in range(2):
        listed = hand.window.locator("#pencil .designs li").all_inner_texts()
        assert listed == [f"{each['words']} Take" for each in found["designs"]]
        assert hand.window.locator("#pencil .remarks li").all_inner_texts() == found["remarks"]
        load_again()
        hand.window.get_by_text("6 designs.").wait_for()
    hand.button("Take design 1")
    assert hand.file() == found["designs"][0]["document"]
    # another window has searched meanwhile
    with server.work:
        server.begin_search(hand.window.evaluate("editing.wishing.form.task()"))
    load_again()
    hand.window.get_by_text("Another search has taken the place of this one.").wait_for()
    load_again()
    settled(hand.window)
    assert hand.window.get_by_text("Another search").count() == 0


def test_a_path_that_is_wanted_stays_in_the_window_when_the_file_is_saved(drawing, tmp_path):
    hand = wished(drawing)
    hand.window.get_by_label("Name of the file").fill("four")
    hand.button("Save as")
    hand.window.get_by_text("four.json", exact=True).wait_for()
    places = hand.window.evaluate("editing.wish.places")
    hand.window.reload()
    hand.wait()
    assert hand.window.evaluate("editing.wish.places") == places
    assert not hand.window.evaluate("editing.changed")
    assert json.loads((tmp_path / "four.json").read_text()) == hand.file()


# without a mouse, and for all eyes


def test_whatever_the_pencil_shows_has_a_name_is_legible_and_reached_by_keys(drawing):
    hand = drawing(planar.to_dict("four-bar"))
    hand.use("Wanted path", (40, 20), (60, 30))
    hand.use("Pins", (0, 0))
    hand.wait()
    hand.window.evaluate("document.querySelectorAll('.page :is(details, label)').forEach((each) => each.open = true)")
    hand.window.evaluate("for (const each of editing.panel.numbers.boxes) each.hidden = false")
    assert hand.window.evaluate(NAMELESS) == []
    assert hand.window.evaluate(MISNAMED) == []
    for scheme in ("light", "dark"):
        hand.window.emulate_media(color_scheme=scheme)
        assert hand.window.evaluate(FAINT)["least"] == []
    # what is a picture holds nothing that takes the focus, and no two parts are one
    assert hand.window.locator("[role=img] [tabindex]").count() == 0
    assert hand.window.evaluate(
        "[...document.querySelectorAll('[id]')].map((each) => each.id).every((id, k, all) => all.indexOf(id) === k)"
    )
    hand.window.get_by_role("button", name="Pins", exact=True).focus()
    hand.window.keyboard.press("ArrowRight")  # from tool to tool, of which Tab stops at one
    assert hand.window.evaluate("document.activeElement.textContent") == "Bar"
    reached = []
    while "Play" not in reached and len(reached) < 30:
        hand.window.keyboard.press("Tab")
        reached.append(
            hand.window.evaluate(
                "document.activeElement.id || document.activeElement.ariaLabel || document.activeElement.textContent"
            )
        )
    stops = [each for each in reached if each in ("Plate", "Undo", "Full screen (F)", "drawing", "Play")]
    assert stops == ["Undo", "drawing", "Full screen (F)", "Play"]
