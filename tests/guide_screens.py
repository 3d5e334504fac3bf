"""The pictures of the guide that are of a browser's window: `python -m tests.guide_screens` takes them anew.

They are taken while the guide's own steps are done, so that what it says is what is seen.
"""

import io
import json
import re
from collections.abc import Callable
from math import cos, pi, sin

from PIL import Image, ImageDraw

from planar.guide.topics import read_page
from tests.guide_pictures import FOLDER
from tests.page_scripts import browser, settled
from tests.pencil import Pencil, served

SCREENS = ("draw/bars", "draw/loose", "draw/moves", "draw/wanted")
"""Pictures by name, each after the step of the guide behind which it stands."""
COLOURS = 200


def draw_six_bar(hand: Pencil, see: Callable[[Pencil, str], None] = lambda *_: None) -> None:
    """The first seventeen steps of the guide; `see` is called wherever a picture is."""
    hand.tool("Bar")
    hand.drag((0, 0), (0, 40))
    hand.tool("Plate")
    hand.click((0, 40), (80, 80), (60, 120), (60, 120))
    hand.tool("Bar")
    hand.drag((80, 80), (100, 0))
    hand.drag((60, 120), (150, 120))
    hand.drag((150, 120), (160, 20))
    see(hand, "draw/bars")
    hand.tool("Ground")
    hand.click((0, 0), (100, 0), (160, 20))
    see(hand, "draw/loose")
    hand.tool("Input")
    hand.click((0, 0))


FIGURE = ((150, 400), (210, 250), (480, 190), (600, 400))
"""px: pins of a four-bar on a scanned figure."""


def scanned_figure() -> bytes:
    """A figure as a book has it."""
    sheet = Image.new("RGB", (800, 500), "white")
    ink = ImageDraw.Draw(sheet)
    ink.line(FIGURE, fill="black", width=8)
    for x, y in FIGURE:
        ink.ellipse([x - 12, y - 12, x + 12, y + 12], outline="black", width=5, fill="white")
    made = io.BytesIO()
    sheet.save(made, "PNG")
    return made.getvalue()


def draw_over_a_figure(hand: Pencil) -> None:
    """A four-bar over a scanned figure, and a path that is wanted of its coupler's point."""
    picture = {"name": "figure.png", "mimeType": "image/png", "buffer": scanned_figure()}
    hand.window.get_by_label("Picture", exact=True).set_input_files(files=[picture])
    image = hand.window.locator("#drawing .underlay image")
    image.wait_for()
    box = image.bounding_box()
    for x, y in (FIGURE[0], FIGURE[3]):
        hand.window.mouse.click(box["x"] + x / 800 * box["width"], box["y"] + y / 500 * box["height"])
    for label, number in (("Distance (mm)", "120"), ("Direction (deg)", "0"), ("First at x (mm)", "0")):
        hand.type(label, number)
    hand.type("First at y (mm)", "0")
    hand.bars((0, 0), (16, 40), (88, 56), (120, 0))
    hand.use("Point", (52, 48), (50, 80))
    hand.drive((0, 0), (120, 0))
    hand.tool("Wanted path")
    turns = [2 * pi * k / 20 for k in range(20)]
    hand.drag(*((50 + 22 * cos(turn), 85 + 10 * sin(turn)) for turn in turns))
    hand.wait()
    hand.tool("Move")


def take(hand: Pencil, name: str) -> None:
    """A picture of the window, in few colours, once the server has answered."""
    hand.wait()
    settled(hand.window)
    image = Image.open(io.BytesIO(hand.window.screenshot())).convert("RGB").quantize(COLOURS)
    path = FOLDER / f"{name}.png"
    path.parent.mkdir(exist_ok=True)
    image.save(path, optimize=True)


def guide_steps() -> list[str]:
    """The steps of the guide's page, in order."""
    return re.findall(r"^\d+\. (.+)$", read_page("begin/draw"), re.MULTILINE)


def main() -> None:
    """Take all of them."""
    with browser() as running, served() as server:
        hand = Pencil(running.new_context(viewport={"width": 1280, "height": 860}), server)
        draw_six_bar(hand, take)
        hand.window.get_by_label("Instantaneous centres").check()
        hand.tool("Move")
        hand.window.wait_for_timeout(1000)
        take(hand, "draw/moves")
        print(json.dumps(hand.file()))
    with browser() as running, served() as server:
        hand = Pencil(running.new_context(viewport={"width": 1280, "height": 860}), server)
        draw_over_a_figure(hand)
        hand.window.wait_for_timeout(1000)
        take(hand, "draw/wanted")


if __name__ == "__main__":
    main()
