"""Tasks side by side: in threads of this process, or given to an executor, which may lose them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from contextvars import copy_context
from itertools import chain, islice
from numbers import Integral
from typing import TypeVar

from planar.foundation.errors import BadInput
from planar.foundation.time_limit import within_time

Task = TypeVar("Task")
Result = TypeVar("Result")

MAX_EXECUTOR_TRIES = 2
"""How often a task is given to an executor before it is done here."""
TASKS_PER_WORKER = 2
"""Tasks in the hands of an executor, or of threads, for each of its workers."""


def usable_cores() -> int:
    """How many cores this process may use."""
    try:
        return max(1, len(os.sched_getaffinity(0)))
    except AttributeError:  # not every system tells
        return max(1, os.cpu_count() or 1)


def thread_count(workers: int | None, executor: Executor | None) -> int:
    """How many threads solve: as many as there are cores where `workers` is None. Raises BadInput."""
    if workers is None:
        return 1 if executor is not None else usable_cores()
    if isinstance(workers, bool) or not isinstance(workers, Integral) or workers < 1:
        raise BadInput("workers", f"a whole number of threads is wanted, not {workers!r:.40}")
    if executor is not None:
        raise BadInput("workers", "an executor has workers of its own; name the one or the other")
    return int(workers)


def worker_count(executor: Executor) -> int:
    """How many tasks an executor does at once."""
    return max(1, getattr(executor, "_max_workers", None) or os.cpu_count() or 1)


def run_in_threads(
    threads: int, tasks: Iterable[tuple[int, Task]], function: Callable[[int, Task], Result]
) -> Iterator[tuple[int, Result]]:
    """The results of numbered tasks as they come, each by its number; tasks are taken when a thread is free for them.

    Whatever a task raises is raised here.
    """
    waiting = iter(tasks)
    first_tasks = list(islice(waiting, 2 if threads > 1 else 0))
    waiting = chain(first_tasks, waiting)
    if len(first_tasks) < 2:  # one task needs no thread of its own
        for k, task in waiting:
            yield k, function(k, task)
        return
    running: dict[Future[Result], int] = {}
    with ThreadPoolExecutor(threads, thread_name_prefix="planar") as pool:
        try:
            while True:
                with suppress(StopIteration):
                    while len(running) < TASKS_PER_WORKER * threads:
                        k, task = next(waiting)
                        running[pool.submit(copy_context().run, function, k, task)] = k
                if not running:
                    return
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    yield running.pop(future), future.result()
        finally:
            for future in running:
                future.cancel()


def run_tasks(
    threads: int,
    executor: Executor | None,
    run_there: Callable[[Task], Result],
    tasks: Iterable[tuple[int, Task]],
    run_here: Callable[[int, Task], Result],
) -> Iterator[tuple[int, Result]]:
    """The results of numbered tasks as they come: by an executor if there is one, else in threads.

    Where time is over no further task is begun.
    """
    if executor is None:
        return run_in_threads(threads, within_time(tasks), run_here)
    return run_in_executor(executor, run_there, within_time(tasks), run_here)


def run_in_executor(
    executor: Executor,
    function: Callable[[Task], Result],
    tasks: Iterable[tuple[int, Task]],
    run_here: Callable[[int, Task], Result],
) -> Iterator[tuple[int, Result]]:
    """The same by an executor: `function` of a task there, `run_here` of its number and itself where that is lost.

    Whatever an executor raises, its tasks can be done here; a BadInput of the task itself is raised once.
    """
    waiting, lost = iter(tasks), list[tuple[int, Task, int]]()
    running: dict[Future[Result], tuple[int, Task, int]] = {}
    most = TASKS_PER_WORKER * worker_count(executor)
    try:
        while True:
            while len(running) < most:
                following = lost.pop() if lost else next(((k, task, 0) for k, task in waiting), None)
                if following is None:
                    break
                k, task, tries = following
                future = _submit(executor, function, task) if tries < MAX_EXECUTOR_TRIES else None
                if future is None:
                    yield k, run_here(k, task)
                else:
                    running[future] = k, task, tries + 1
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                k, task, tries = running.pop(future)
                problem = future.exception() if not future.cancelled() else None
                if isinstance(problem, BadInput):
                    raise problem
                if future.cancelled() or problem is not None:
                    lost.append((k, task, tries))
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
