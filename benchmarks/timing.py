"""The least time of several tasks that are run in turn."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from time import perf_counter
from typing import Any, TypeVar

Name = TypeVar("Name", bound=Hashable)

ROUNDS = 8
SLICE = 0.02
"""Seconds that a task has in each round; it is called at least once, however long that takes."""


def best(tasks: Mapping[Name, Callable[[], Any]], rounds: int = ROUNDS) -> dict[Name, float]:
    """Seconds of one call of each task, the least of all its calls.

    The tasks take turns, so that what else the machine does meanwhile falls on all of them alike; a call before the
    first round, whose time does not count, fills the caches.
    """
    for task in tasks.values():
        task()
    least = dict.fromkeys(tasks, float("inf"))
    for _ in range(rounds):
        for name, task in tasks.items():
            least[name] = min(least[name], _least(task))
    return least


def _least(task: Callable[[], Any]) -> float:
    """The least time of the calls that fit into a slice."""
    least, end = float("inf"), perf_counter() + SLICE
    while (start := perf_counter()) < end:
        task()
        least = min(least, perf_counter() - start)
    return least
