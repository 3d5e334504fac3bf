"""A browser, and pages shown in it, for all tests of pages that need one."""

from __future__ import annotations

import pytest

from planar.pages.view import view
from tests.page_scripts import SCREENS, Windows, browser


@pytest.fixture(scope="module")
def chromium():
    with browser() as running:
        yield running


@pytest.fixture(scope="module")
def windows(chromium):
    return Windows(chromium)


@pytest.fixture
def shown(windows, tmp_path):
    """Shows the page of a mechanism: its window, in which nothing must go wrong."""
    taken = []

    def show(mechanism, screen="desk", scheme="light"):
        width, height = SCREENS[screen]
        window, problems = windows.take(has_touch=screen == "phone")
        taken.append((screen == "phone", window, problems))
        window.set_viewport_size({"width": width, "height": height})
        window.emulate_media(media="screen", color_scheme=scheme)
        window.goto(view(mechanism, tmp_path / "page.html").as_uri())
        return window

    yield show
    wrong = [list(problems) for *_, problems in taken]
    for each in taken:
        windows.give_back(*each)
    assert not any(wrong), wrong
