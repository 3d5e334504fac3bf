"""Searches of a few designs, for tests that look at how a search is run and reported, and not at how much it finds."""

from importlib import import_module
from multiprocessing.connection import Connection
from typing import Any

from pytest import MonkeyPatch

from planar.pages.editor.search import search_for

SMALL_SEARCH = {"DRAWS": 600, "MATCHES": 24, "ROUNDS": 1}
"""Numbers of `planar.synthesis.synthesise`, and what they are in a small search."""
SMALL_FAMILY = {
    "DRAWS": 60,
    "DRAW_ROUNDS": 2,
    "RECOMBINATIONS": 2000,
    "RECOMBINED_ROUNDS": 4,
    "PARENTS": 12,
    "CHILDREN": 5,
    "SPREADS": (0.2, 0.1, 0.05, 0.02),
}
"""The same of `planar.synthesis.families`, which samples the designs that meet a task exactly."""
SMALL_SEARCHES = {"planar.synthesis.synthesise": SMALL_SEARCH, "planar.synthesis.families": SMALL_FAMILY}
"""Modules, and their numbers in small searches whose fits converge."""
SHORT_FITS = {"planar.synthesis.fitting.design_fit": {"MAX_STEPS": 30}}
"""The same of fits that end before they converge, where the test does not look at the quality of the designs."""


def set_small_searches(patch: MonkeyPatch) -> None:
    """Make searches small while the patch lasts."""
    for module, numbers in SMALL_SEARCHES.items():
        for name, number in numbers.items():
            patch.setattr(import_module(module), name, number)


def search_few(line: Connection, value: dict[str, Any]) -> None:
    """Search as the process beside the server does, in a small catalogue. It replaces `search_for` in that process."""
    set_small_searches(MonkeyPatch())
    search_for(line, value)
