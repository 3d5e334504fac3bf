"""The pictures of the guide that are of a browser's window: `python -m tests.guide_screens` takes them anew.

They are taken while the guide's own steps are done, so that what it says is what is seen.
"""

import io
import json
import re
from collections.abc import Callable

from PIL import Image

from planar.guide.topics import read_page
from tests.guide_pictures import FOLDER
from tests.page_scripts import browser, settled
from tests.pencil import Pencil, served

SCREENS = ("draw/bars", "draw/loose", "draw/moves")
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


def take(hand: Pencil, name: str) -> None:
    """A picture of the window, in few colours."""
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


if __name__ == "__main__":
    main()
