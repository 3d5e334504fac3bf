"""The least time of several tasks that are run in turn."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from time import perf_counter
from typing import Any, TypeVar

Name = TypeVar("Name", bound=Hashable)

ROUNDS = 40
"""Most rounds of a task."""
FEWEST = 4
"""Rounds of a task that are run however long they take."""
BUDGET = 0.6
"""Seconds after which a task that has had its fewest rounds is run no more."""


def best(tasks: Mapping[Name, Callable[[], Any]]) -> dict[Name, float]:
    """Seconds of one call of each task, the least over the rounds.

    Every round calls each task once, so that what else the machine does meanwhile falls on all of them alike; a call
    before the first round, whose time does not count, fills the caches.
    """
    for task in tasks.values():
        task()
    times: dict[Name, list[float]] = {name: [] for name in tasks}
    for _ in range(ROUNDS):
        for name, task in tasks.items():
            if len(times[name]) < FEWEST or sum(times[name]) < BUDGET:
                start = perf_counter()
                task()
                times[name].append(perf_counter() - start)
    return {name: min(seconds) for name, seconds in times.items()}
