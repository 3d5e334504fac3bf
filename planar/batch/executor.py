"""Run tasks side by side: in threads of this process, or by an executor, which may lose them."""

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
"""How often a task is submitted to an executor before this process runs it."""
TASKS_PER_WORKER = 2
"""Tasks that are submitted to an executor, or to threads, for each worker."""


def usable_cores() -> int:
    """The number of cores that this process may use."""
    try:
        return max(1, len(os.sched_getaffinity(0)))
    except AttributeError:  # not on every system
        return max(1, os.cpu_count() or 1)


def thread_count(workers: int | None, executor: Executor | None) -> int:
    """The number of threads that solve: that of cores if `workers` is None. Raises BadInput."""
    if workers is None:
        return 1 if executor is not None else usable_cores()
    if isinstance(workers, bool) or not isinstance(workers, Integral) or workers < 1:
        raise BadInput("workers", f"a whole number of threads is wanted, not {workers!r:.40}")
    if executor is not None:
        raise BadInput("workers", "an executor has workers of its own; name the one or the other")
    return int(workers)


def worker_count(executor: Executor) -> int:
    """The number of tasks that an executor runs at once."""
    return max(1, getattr(executor, "_max_workers", None) or os.cpu_count() or 1)


def run_in_threads(
    threads: int, tasks: Iterable[tuple[int, Task]], function: Callable[[int, Task], Result]
) -> Iterator[tuple[int, Result]]:
    """Yield the numbers and results of tasks as they come; tasks are taken when a thread is free.

    Exceptions of tasks are raised.
    """
    waiting = iter(tasks)
    first_tasks = list(islice(waiting, 2 if threads > 1 else 0))
    waiting = chain(first_tasks, waiting)
    if len(first_tasks) < 2:  # one task needs no other thread
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
    """Yield the numbers and results of tasks as they come: by an executor if there is one, else in threads.

    No task is started after the time limit.
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
    """The same by an executor that calls `function` of a task; if a task is lost, `run_here` is called with its number
    and the task.

    Exceptions of the executor are not raised, as this process can run its tasks; a BadInput of a task is raised.
    """
    waiting, lost = iter(tasks), list[tuple[int, Task, int]]()
    running: dict[Future[Result], tuple[int, Task, int]] = {}
    maximum = TASKS_PER_WORKER * worker_count(executor)
    try:
        while True:
            while len(running) < maximum:
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
    """Yield the results of numbered tasks, which come in any order, in the order 0, 1, 2 ..."""
    early: dict[int, Result] = {}
    following = 0
    for k, result in results:
        early[k] = result
        while following in early:
            yield early.pop(following)
            following += 1


def _submit(executor: Executor, function: Callable[[Task], Result], task: Task) -> Future[Result] | None:
    """Submit a task; None if the executor takes no more, as when its workers have been killed."""
    try:
        return executor.submit(function, task)
    except Exception:  # this process can run the task, whatever an executor raises
        return None
