"""What lies beside a drawing: a picture underneath, a wanted path; and how the page is reached without a mouse."""

from __future__ import annotations

import io

import pytest
from PIL import Image

from tests.page_scripts import settled

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


DROP = """([kind, content]) => {
  const carried = new DataTransfer();
  if (kind === "file") carried.items.add(new File([content], "drawn.svg", { type: "image/svg+xml" }));
  else carried.setData(kind, content);
  const event = new DragEvent("drop", { bubbles: true, cancelable: true, dataTransfer: carried });
  return document.getElementById("drawing").dispatchEvent(event); // false: the page itself deals with it
}"""
HOSTILE_SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="90" height="60" onload="parent.hacked = 1">
<script>parent.hacked = 1</script><image href="http://other.example/a.png" width="9" height="9"/><path d="M0 0h9v9"/></svg>"""


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
