"""A browser, and pages shown in it, for all tests of pages that need one."""

from __future__ import annotations

from functools import cache
from itertools import count

import pytest

from planar.pages.view import view
from tests.page_scripts import SCREENS, Windows, browser
from tests.pencil import Pencil, served

DESK = dict(zip(("width", "height"), SCREENS["desk"], strict=True))


@pytest.fixture(scope="package")
def chromium():
    with browser() as running:
        yield running


@pytest.fixture(scope="package")
def windows(chromium):
    return Windows(chromium)


@pytest.fixture(scope="package")
def page_file(tmp_path_factory):
    """Writes the page of a mechanism, once for all tests that show it; gives its file."""
    folder = tmp_path_factory.mktemp("shown")
    numbers = count()
    return cache(lambda mechanism: view(mechanism, folder / f"page-{next(numbers)}.html"))


@pytest.fixture
def taken(windows):
    """Takes a window for a test, in which nothing must go wrong."""
    given = []

    def take(screen="desk", scheme="light", has_touch=None):
        has_touch = screen == "phone" if has_touch is None else has_touch
        window, wrong = windows.take(has_touch, SCREENS[screen])
        given.append((has_touch, window, wrong))
        window.emulate_media(media="screen", color_scheme=scheme)
        return window

    yield take
    wrong = [list(problems) for *_, problems in given]
    for each in given:
        windows.give_back(*each)
    assert not any(wrong), wrong


@pytest.fixture
def shown(taken, page_file):
    """Shows the page of a mechanism: its window."""

    def show(mechanism, screen="desk", scheme="light"):
        window = taken(screen, scheme)
        window.goto(page_file(mechanism).as_uri())
        return window

    return show


@pytest.fixture(scope="package")
def drawing_context(chromium):
    """Where windows are opened to draw in, each of which keeps its own drawing."""
    context = chromium.new_context(viewport=DESK)
    yield context
    context.close()


@pytest.fixture
def drawing(chromium, drawing_context, tmp_path):
    """Opens the page of a file, or of empty paper, in which nothing must go wrong."""
    opened, contexts, others = [], [], drawing_context.pages

    def begin(value=None, path=None, hand=Pencil, **context):
        serving = served(value, path, tmp_path)
        server = serving.__enter__()
        if context:
            contexts.append(chromium.new_context(**{"viewport": DESK} | context))
        pencil = hand(contexts[-1] if context else drawing_context, server)
        opened.append((serving, server, pencil))
        return pencil

    begin.opened = opened
    yield begin
    for page in drawing_context.pages:
        if page not in others:
            page.close()
    for each in contexts:
        each.close()
    for serving, _, _ in opened:
        serving.__exit__(None, None, None)
    assert not any(pencil.wrong for *_, pencil in opened), [pencil.wrong for *_, pencil in opened]
