"""Hands that draw on the page of `planar edit` in a real browser: by mouse or by keys, at places in millimetres."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import planar
from planar.pages.editor.answer import BLANK
from planar.pages.editor.server import EditServer

ANSWERED = "() => page && globalThis.editing.settled"
ON_SCREEN = """([x, y]) => {
  const { left, top } = svg.getBoundingClientRect(), at = page.view.toScreen([x / 1000, y / 1000]);
  return [left + at[0], top + at[1]];
}"""


@contextmanager
def served(value: Any = None, path: Path | None = None, folder: Path | None = None) -> Iterator[EditServer]:
    """A server of a file's value, or of empty paper, as long as it is wanted."""
    server = EditServer(BLANK if value is None else value, path, folder or Path.cwd())
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()


class Pencil:
    """A window with the page of a server; what goes wrong there is in `wrong`."""

    def __init__(self, context: Any, server: EditServer):
        self.window, self.wrong = context.new_page(), []
        self.window.set_default_timeout(10_000)
        self.window.on("pageerror", lambda problem: self.wrong.append(str(problem)))
        self.actions = 0
        self.window.goto(server.address)
        self.wait()

    def wait(self) -> None:
        """Wait for the server's answer to what is drawn."""
        self.window.wait_for_function(ANSWERED)

    def screen(self, x: float, y: float) -> tuple[float, float]:
        """A place of the world (mm) on the screen (px)."""
        return tuple(self.window.evaluate(ON_SCREEN, [x, y]))

    def tool(self, name: str) -> None:
        """Take a tool."""
        self.actions += 1
        self.window.get_by_role("toolbar", name="Pencil").get_by_role("button", name=name, exact=True).click()

    def drag(self, *places: tuple[float, float]) -> None:
        """From one place to another, by way of those between."""
        self.actions += 1
        self.window.mouse.move(*self.screen(*places[0]))
        self.window.mouse.down()
        for place in places[1:]:
            self.window.mouse.move(*self.screen(*place))
        self.window.mouse.up()

    def click(self, *places: tuple[float, float]) -> None:
        """One place after the other."""
        for place in places:
            self.actions += 1
            self.window.mouse.click(*self.screen(*place))

    def bars(self, *places: tuple[float, float]) -> None:
        """A bar from each place to the next."""
        self.tool("Bar")
        for start, stop in pairwise(places):
            self.drag(start, stop)

    def use(self, tool: str, *places: tuple[float, float]) -> None:
        """Take a tool, and click one place after the other."""
        self.tool(tool)
        self.click(*places)

    def drive(self, pin: tuple[float, float], *fixed: tuple[float, float]) -> None:
        """Fix pins to the frame, and drive one of these."""
        self.use("Ground", pin, *fixed)
        self.use("Input", pin)

    def type(self, field: str, text: str) -> None:
        """Type into a field, and enter it."""
        self.actions += 1
        place = self.window.get_by_label(field, exact=True)
        place.fill(text)
        place.press("Enter")
        self.wait()

    def button(self, name: str) -> None:
        """Press a button."""
        self.actions += 1
        self.window.get_by_role("button", name=name, exact=True).click()
        self.wait()

    def said(self) -> str:
        """What the page said last."""
        return self.window.locator("#said").inner_text()

    def told(self) -> str:
        """What stands beside the drawing on how it moves."""
        self.wait()
        return self.window.locator("#pencil > [role=status]").inner_text()

    def file(self) -> Any:
        """The file that is drawn."""
        self.wait()
        return self.window.evaluate("globalThis.editing.draft().file")

    def mechanism(self) -> planar.Mechanism:
        """The mechanism that is drawn."""
        return planar.from_dict(self.file())


class KeyPencil(Pencil):
    """The same by keys alone: Tab's stops are taken as reached, arrows lead the cross by the grid, Enter presses."""

    def press(self, *keys: str) -> None:
        """One key after the other."""
        for key in keys:
            self.actions += 1
            self.window.keyboard.press(key)

    def tool(self, name: str) -> None:
        """From the tool in hand by arrows to another."""
        bar = self.window.get_by_role("toolbar", name="Pencil")
        bar.locator("button[aria-pressed=true]").focus()
        for _ in bar.get_by_role("button").all():
            if self.window.evaluate("document.activeElement.textContent") == name:
                break
            self.press("ArrowRight")
        self.press("Enter")

    def drag(self, *places: tuple[float, float]) -> None:
        """From the first place to the last."""
        self.click(places[0], places[-1])

    def click(self, *places: tuple[float, float]) -> None:
        """Lead the cross to one place after the other, and press there."""
        for place in places:
            self.window.locator("#drawing").focus()
            self.lead(*place)
            self.press("Enter")
            self.wait()

    def lead(self, x: float, y: float) -> None:
        """Lead the cross to a place of the grid, or near it."""
        if self.window.evaluate("editing.hand.cursor") is None:
            self.press("ArrowRight")
        at, step = (self.window.evaluate(f"editing.{each}") for each in ("hand.cursor", "sketch.step"))
        ways = (("ArrowRight", "ArrowLeft"), ("ArrowUp", "ArrowDown"))
        for far, start, (on, back) in zip((x, y), at, ways, strict=True):
            count = round((far / 1000 - start) / step)
            key = back if count < 0 else on
            self.press(*[f"Shift+{key}"] * (abs(count) // 10), *[key] * (abs(count) % 10))
