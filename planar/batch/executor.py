"""Tasks given to an executor, which may lose them: retried, then done here."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from typing import TypeVar

from planar.foundation.errors import BadInput

Task = TypeVar("Task")
Result = TypeVar("Result")

MAX_EXECUTOR_TRIES = 2
"""How often a task is given to an executor before it is done here."""
TASKS_PER_WORKER = 2
"""Tasks in the hands of an executor for each of its workers."""


def worker_count(executor: Executor) -> int:
    """How many tasks an executor does at once."""
    return max(1, getattr(executor, "_max_workers", None) or os.cpu_count() or 1)


def run_tasks(
    executor: Executor | None,
    function: Callable[[Task], Result],
    tasks: Mapping[int, Task],
    run_here: Callable[[int], Result],
) -> Iterator[tuple[int, Result]]:
    """The results as they come, each by its number: `function` of a task by the executor, else `run_here` of a number.

    Whatever an executor raises, its tasks can be done here; a BadInput of the task itself is raised once.
    """
    if executor is None:
        for k in tasks:
            yield k, run_here(k)
        return
    waiting, tries = list(tasks)[::-1], dict.fromkeys(tasks, 0)
    running: dict[Future[Result], int] = {}
    most = TASKS_PER_WORKER * worker_count(executor)
    try:
        while waiting or running:
            while waiting and len(running) < most:
                k = waiting.pop()
                future = _submit(executor, function, tasks[k]) if tries[k] < MAX_EXECUTOR_TRIES else None
                tries[k] += 1
                if future is None:
                    yield k, run_here(k)
                else:
                    running[future] = k
            for future in wait(running, return_when=FIRST_COMPLETED).done if running else ():
                k = running.pop(future)
                problem = future.exception() if not future.cancelled() else None
                if isinstance(problem, BadInput):
                    raise problem
                if future.cancelled() or problem is not None:
                    waiting.append(k)
                else:
                    yield k, future.result()
    finally:
        for future in running:
            future.cancel()


def in_order(results: Iterable[tuple[int, Result]]) -> Iterator[Result]:
    """The results of the numbers 0, 1, 2 ..., which may come in any order."""
    early: dict[int, Result] = {}
    following = 0
    for k, result in results:
        early[k] = result
        while following in early:
            yield early.pop(following)
            following += 1


def _submit(executor: Executor, function: Callable[[Task], Result], task: Task) -> Future[Result] | None:
    """A task in the executor's hands; None where it takes no more, as when its workers have been killed."""
    try:
        return executor.submit(function, task)
    except Exception:  # whatever an executor raises, the task can be done here
        return None
