"""How many examples of a property are tried: few and always the same, or, where one searches, many new ones."""

import os

from hypothesis import settings

SEARCH = os.environ.get("PLANAR_TESTS") == "search"
TIMES = 10
"""As many more where one searches."""

settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=40)
settings.register_profile("search", deadline=None, max_examples=100 * TIMES)


def load_profile() -> None:
    """What decides over a change, on anybody's machine, tries the same examples each time."""
    settings.load_profile("search" if SEARCH else "repeatable")


def draws(number: int) -> int:
    """The number of examples of a property of which the suite tries so many."""
    return number * TIMES if SEARCH else number
