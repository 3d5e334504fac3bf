"""Pages as tests need them: in Node, without a browser, or in Chromium; what is missing is said in one place."""

from __future__ import annotations

import json
import shutil
import subprocess
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from planar.document.files import read_asset
from planar.pages.data.page_data import page_data
from planar.pages.overlay_style import overlay_script
from planar.pages.page import script_safe_json
from tests.draws import covering, is_exhaustive
from tests.known import MODELS, kinds_of_model

NODE = shutil.which("node") or shutil.which("nodejs")
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
LOGIC = (
    "solve/singular.js",
    "solve/stops.js",
    "solve/linkage.js",
    "page.js",
    "controls/dimensions.js",
    "additions/input_rates.js",
    "controls/saving.js",
)
"""The scripts of a page that need no document."""

SCREENS = {"phone": (390, 844), "desk": (1280, 900), "projector": (1920, 1080)}
PLACES = "page.data.names.map((name) => Object.values(page.point(name)))"
FAINT = r"""() => {
const parts = (colour) => colour.match(/[\d.]+/g).map(Number);
const light = (colour) => {
  const linear = (each) => (each <= 0.04045 ? each / 12.92 : ((each + 0.055) / 1.055) ** 2.4);
  const [r, g, b] = parts(colour).map((each) => linear(each / 255));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05;
};
const paper = (each) => {
  const colour = getComputedStyle(each).backgroundColor;
  return each.parentElement && parts(colour)[3] === 0 ? paper(each.parentElement) : colour;
};
const fields = "[type=text], [type=number], select";
const text = (node) => node.nodeType === 3 && node.data.trim() !== "";
const lettered = (each) => Array.from(each.childNodes).some(text);
const texts = Array.from(document.querySelectorAll("body *")).filter(
  (each) => each.getClientRects().length && !each.disabled && (each.matches(fields) || lettered(each)),
);
const found = texts.map((each) => {
  const style = getComputedStyle(each), ink = each.ownerSVGElement ? style.fill : style.color;
  const ratio = light(ink) / light(paper(each));
  return [each.textContent.trim().slice(0, 20), Math.max(ratio, 1 / ratio)];
});
return { count: found.length, least: found.filter(([, ratio]) => ratio < 4.5) };
}"""
"""How many texts there are, and those with less contrast than WCAG 2, 1.4.3, wants, but for what cannot be used now."""
NAMELESS = """Array.from(document.querySelectorAll("button, input, select, textarea, summary, [role=slider]"))
  .filter((each) => !each.textContent.trim() && !each.getAttribute("aria-label") && !each.labels?.length)
  .map((each) => each.outerHTML)"""
"""Controls of a page that have no name."""
MISNAMED = r"""Array.from(document.querySelectorAll(":is(button, a, summary)[aria-label]"))
  .map((each) => [each.textContent, each.getAttribute("aria-label")]
    .map((text) => text.toLowerCase().replaceAll(/[^\p{L}\p{N}]+/gu, " ").trim()))
  .filter(([written, name]) => written && !name.includes(written))"""
"""Those that are not called as they are lettered: who speaks that means the control (WCAG 2, 2.5.3)."""
CLOSE = 1e-12
"""Of the greatest of its kind: as nearly a page's numbers are Python's."""
SLOW_PAGE = "double-parallelogram"
"""A model whose page takes seconds, since it passes change points; of its kinds only its units are no other model's."""
PAGE_STEMS = [*MODELS] if is_exhaustive() else covering((stem for stem in MODELS if stem != SLOW_PAGE), kinds_of_model)
"""Models of every kind, whose data is computed once for all tests of scripts in a process."""

_carried = cache(page_data)
needs_node = pytest.mark.skipif(NODE is None, reason="needs Node.js")


def in_node(mechanisms: dict[str, Any], act: str, *more: str) -> dict[str, Any]:
    """What the asynchronous `act(page, name)` returns for the page of each mechanism, with `more` scripts."""
    shared = "\n".join([overlay_script(), *(read_asset(name) for name in (*LOGIC, *more))])
    runs = []
    for name, mechanism in mechanisms.items():
        data, functions = _carried(mechanism)
        runs.append(
            "await (async () => "
            f"{{ {functions}\n"
            f" const page = new Page(JSON.parse({script_safe_json(script_safe_json(data))}), program);\n"
            f" found[{script_safe_json(name)}] = await act(page, {script_safe_json(name)}); }})();"
        )
    text = (
        f"{shared}\nasync function act(page, name) {{ {act} }}\n"
        f"(async () => {{ const found = {{}};\n{''.join(runs)}\nprocess.stdout.write(JSON.stringify(found)); }})();"
    )
    done = subprocess.run([NODE, "-"], input=text, capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


@cache
def chromium() -> str:
    """The browser's program; the test is skipped where there is none, or no Playwright to drive it."""
    pytest.importorskip("playwright.sync_api", reason="needs Playwright")
    for name in BROWSERS:
        found = shutil.which(name)
        if found:
            return found
    return pytest.skip("needs Chromium: apt-get install chromium")


@contextmanager
def browser():
    """A running browser."""
    program = chromium()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-gpu"])
        try:
            yield running
        finally:
            running.close()


def watched_window(context: Any) -> tuple[Any, list[str]]:
    """A window, and a list that takes what goes wrong in it."""
    window, wrong = context.new_page(), []
    window.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
    window.on("pageerror", lambda problem: wrong.append(str(problem)))
    window.on("request", lambda request: wrong.append(request.url) if request.url.startswith("http") else None)
    return window, wrong


def opened(context: Any, path: Path) -> tuple[Any, list[str]]:
    """A page in a window, and a list that takes what goes wrong in it."""
    window, wrong = watched_window(context)
    window.goto(path.as_uri())
    return window, wrong


class Windows:
    """Windows that show one page after the other: to open one costs several times what it takes to show a page."""

    def __init__(self, running: Any):
        self._running = running
        self._free: dict[bool, list[tuple[Any, list[str]]]] = {False: [], True: []}

    def take(self, has_touch: bool, size: tuple[int, int]) -> tuple[Any, list[str]]:
        """A window of a size (px) that nobody looks at, and a list that takes what goes wrong in it."""
        viewport = dict(zip(("width", "height"), size, strict=True))
        if self._free[has_touch]:
            window, wrong = self._free[has_touch].pop()
            if window.viewport_size != viewport:
                window.set_viewport_size(viewport)
            return window, wrong
        context = self._running.new_context(has_touch=has_touch, viewport=viewport)
        context.set_default_timeout(10_000)
        return watched_window(context)

    def give_back(self, has_touch: bool, window: Any, wrong: list[str]) -> None:
        """Release what was pressed, stop the motion, forget what went wrong; the page is replaced by the next one."""
        window.mouse.up()
        window.evaluate("globalThis.controls?.pause()")
        wrong.clear()
        self._free[has_touch].append((window, wrong))


def same(window, state):
    """The page's places, velocities and accelerations are those of a state."""
    found = np.array(window.evaluate(PLACES))
    wanted = np.array([[p.position, p.velocity, p.acceleration] for p in state.points.values()])
    for order in range(3):
        scale = np.abs(wanted[:, order]).max()
        assert np.abs(found[:, order] - wanted[:, order]).max() <= CLOSE * scale


def settled(window):
    """Wait for two frames, after which what was asked for is drawn."""
    window.evaluate("new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)))")


def downloaded(window, button, path):
    with window.expect_download() as coming:
        window.get_by_role("button", name=button).click()
    coming.value.save_as(path)
    return path.read_text(encoding="utf-8")
