"""Searches of a few designs, for tests that look at how a search is run and reported, and not at how much it finds."""

from importlib import import_module
from multiprocessing.connection import Connection
from typing import Any

from planar.pages.editor.search import search_for

SMALL_SEARCH = {"DRAWS": 600, "MATCHES": 24, "ROUNDS": 1}
"""Numbers of `planar.synthesis.synthesise`, and what they are in a small search."""


def search_few(line: Connection, value: dict[str, Any]) -> None:
    """Search as the process beside the server does, in a small catalogue. It replaces `search_for` in that process."""
    module = import_module("planar.synthesis.synthesise")
    for name, number in SMALL_SEARCH.items():
        setattr(module, name, number)
    search_for(line, value)
