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


def run_tasks(
    threads: int,
    executor: Executor | None,
    run_there: Callable[[Task], Result],
    tasks: Iterable[tuple[int, Task]],
    run_here: Callable[[int, Task], Result],
) -> Iterator[tuple[int, Result]]:
    """Yield the numbers and results of tasks as they come: of `run_there` by an executor if there is one, else of
    `run_here` in threads. Tasks are taken when a worker is free, and none after the time limit.

    What a task raises in a thread is raised. Of an executor a BadInput is raised; this process runs a task that is lost
    otherwise.
    """
    waiting = within_time(tasks)
    if executor is not None:
        maximum = TASKS_PER_WORKER * worker_count(executor)
        yield from _run_by(lambda _, task: executor.submit(run_there, task), maximum, BadInput, waiting, run_here)
        return
    first_tasks = list(islice(waiting, 2 if threads > 1 else 0))
    waiting = chain(first_tasks, waiting)
    if len(first_tasks) < 2:  # one task needs no other thread
        for k, task in waiting:
            yield k, run_here(k, task)
        return
    with ThreadPoolExecutor(threads, thread_name_prefix="planar") as pool:
        maximum = TASKS_PER_WORKER * threads
        yield from _run_by(
            lambda k, task: pool.submit(copy_context().run, run_here, k, task),
            maximum,
            BaseException,
            waiting,
            run_here,
        )


def _run_by(
    submit: Callable[[int, Task], Future[Result]],
    maximum: int,
    raised: type[BaseException],
    waiting: Iterator[tuple[int, Task]],
    run_here: Callable[[int, Task], Result],
) -> Iterator[tuple[int, Result]]:
    """Yield the numbers and results of tasks, of which at most `maximum` are submitted at a time; `raised` is the type
    of the exceptions of tasks that are raised."""
    fresh, lost = ((k, task, 0) for k, task in waiting), list[tuple[int, Task, int]]()
    running: dict[Future[Result], tuple[int, Task, int]] = {}
    try:
        while True:
            while len(running) < maximum and (following := lost.pop() if lost else next(fresh, None)):
                k, task, tries = following
                future = None
                if tries < MAX_EXECUTOR_TRIES:
                    with suppress(Exception):  # an executor takes no more, as when its workers have been killed
                        future = submit(k, task)
                if future is None:
                    yield k, run_here(k, task)
                else:
                    running[future] = k, task, tries + 1
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                k, task, tries = running.pop(future)
                problem = None if future.cancelled() else future.exception()
                if isinstance(problem, raised):
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
