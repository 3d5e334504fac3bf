"""How much of a law is tried: few examples and always the same, or, where one searches, many new ones of all models."""

import os
from collections.abc import Iterable
from typing import Any

from hypothesis import settings

SEARCH = os.environ.get("PLANAR_TESTS") == "search"
TIMES = 10
"""As many more where one searches."""
SHARE = 0.1
"""Of the examples that a test names, so many are tried where nobody searches: the suite has five minutes."""

settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=10)
settings.register_profile("search", deadline=None, max_examples=100 * TIMES)


def load_profile() -> None:
    """What decides over a change, on anybody's machine, tries the same examples each time."""
    settings.load_profile("search" if SEARCH else "repeatable")


def draws(number: int) -> int:
    """The number of examples of a property of which the suite tries so many."""
    return number * TIMES if SEARCH else max(1, round(SHARE * number))


def part(of: Iterable[Any], one_in: int, first: int = 0) -> list[Any]:
    """About one in so many of what a law goes through, from the first on; all of them where one searches."""
    every = list(of)
    return every if SEARCH else every[first :: max(one_in, round(one_in / SHARE))]
