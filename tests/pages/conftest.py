"""A browser, and pages shown in it, for all tests of pages that need one."""

from __future__ import annotations

import pytest

from planar.pages.view import view
from tests.page_scripts import SCREENS, Windows, browser
from tests.pencil import Pencil, served


@pytest.fixture(scope="package")
def chromium():
    with browser() as running:
        yield running


@pytest.fixture(scope="package")
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


@pytest.fixture
def drawing(chromium, tmp_path):
    """Opens the page of a file, or of empty paper, in which nothing must go wrong."""
    opened, contexts = [], []

    def begin(value=None, path=None, hand=Pencil, **context):
        serving = served(value, path, tmp_path)
        server = serving.__enter__()
        contexts.append(chromium.new_context(**{"viewport": {"width": 1280, "height": 900}} | context))
        pencil = hand(contexts[-1], server)
        opened.append((serving, server, pencil))
        return pencil

    begin.opened = opened
    yield begin
    for each in contexts:
        each.close()
    for serving, _, _ in opened:
        serving.__exit__(None, None, None)
    assert not any(pencil.wrong for *_, pencil in opened), [pencil.wrong for *_, pencil in opened]
