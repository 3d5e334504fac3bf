"""How much of a law is tried: few examples and always the same, or, where one searches, many new ones of all models."""

import os
from collections.abc import Callable, Hashable, Iterable
from typing import Any, TypeVar

import pytest
from hypothesis import settings

T = TypeVar("T")
SEARCH = os.environ.get("PLANAR_TESTS") == "search"
TIMES = 10
"""As many more where one searches."""
SHARE = 0.1
"""Of the examples that a test names, so many are tried where nobody searches: the suite has five minutes."""

settings.register_profile("repeatable", derandomize=True, deadline=None, max_examples=10)
settings.register_profile("search", deadline=None, max_examples=100 * TIMES)


EXHAUSTIVE_OPTION = "--exhaustive"
EXHAUSTIVE_VARIABLE = "PLANAR_TESTS_EXHAUSTIVE"
"""Says so to the workers of a run, which import the tests as well."""


def is_exhaustive() -> bool:
    """Whether all cases of every test run, not only those that show each kind once."""
    return SEARCH or EXHAUSTIVE_VARIABLE in os.environ


def load_profile() -> None:
    """What decides over a change, on anybody's machine, tries the same examples each time."""
    settings.load_profile("search" if SEARCH else "repeatable")


def draws(number: int) -> int:
    """The number of examples of a property of which the suite tries so many."""
    return number * TIMES if SEARCH else max(1, round(SHARE * number))


def part(of: Iterable[Any], one_in: int, first: int = 0) -> list[Any]:
    """About one in so many of what a law goes through, from the first on; all of them in an exhaustive run."""
    every = list(of)
    return every if is_exhaustive() else every[first :: max(one_in, round(one_in / SHARE))]


def first_cases(cases: Iterable[T], count: int = 1) -> list[T]:
    """The first cases of a test whose others repeat what these show; all cases in an exhaustive run."""
    every = list(cases)
    return every if is_exhaustive() else every[:count]


def repeats(shown_by: str) -> pytest.MarkDecorator:
    """A mark of tests that run in exhaustive runs alone, with a sentence on what shows the same in any run."""
    return pytest.mark.skipif(not is_exhaustive(), reason=f"runs with {EXHAUSTIVE_OPTION}: {shown_by}")


def covering(cases: Iterable[T], kinds_of: Callable[[T], Iterable[Hashable]]) -> list[T]:
    """The first cases that together show every kind that any case shows; all cases in an exhaustive run."""
    every = list(cases)
    if is_exhaustive():
        return every
    kinds = [set(kinds_of(case)) for case in every]
    remaining = set().union(*kinds)
    chosen = []
    while remaining:
        best = max(range(len(every)), key=lambda index: len(remaining & kinds[index]))
        chosen.append(best)
        remaining -= kinds[best]
    return [every[index] for index in sorted(chosen)]
