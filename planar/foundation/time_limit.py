"""A time limit for long computations, and their interruption by the user: what was found by then is returned.

Loops ask `time_is_over` between two steps, or run through `within_time`, where a part is a result; through
`all_within_time`, where it is none. Whoever starts a computation sets the limit, public functions by their argument
`timeout`. The first Ctrl-C ends it as the limit does, a second one at once.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from numbers import Real
from time import monotonic
from types import FrameType
from typing import Any, TypeVar

from planar.foundation.errors import BadInput, NoAnswer, Outcome

LONGEST_LIMIT = 1e9
"""s"""
MORE_TIME = "give more time"
"""What helps a computation that a time limit ended."""

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")
Progress = Callable[[float, float], object]
"""Is called with how much is done, and how much there is in all."""


class ComputationEnded(Exception):
    """Ends a computation of which a part is no result; nothing between loop and limit handles this class."""


class TimeLimit:
    """How long a computation may take, from when it is made: `seconds`, None for as long as it takes.

    `progress` is called by loops with how much is done and how much there is. Of a computation that ended early
    `ended_by` is the reason, empty where none did, and `how_far` says how far it came.
    """

    def __init__(self, seconds: float | None, progress: Progress | None = None):
        self.seconds, self.progress, self.is_interrupted = seconds, progress, False
        self.outer: TimeLimit | None = None
        self.ended_by = self.how_far = ""
        self._end = None if seconds is None else monotonic() + seconds

    @property
    def reason(self) -> str:
        """Why it is over, in words; empty where it is not."""
        if self.is_interrupted:
            return "the user interrupted it"
        if self._end is not None and monotonic() > self._end:
            return f"the time limit of {self.seconds:g} s was reached"
        return ""


_CURRENT: ContextVar[TimeLimit | None] = ContextVar("time limit", default=None)


def check_timeout(seconds: float | None) -> None:
    """Refuse what is no time. Raises BadInput."""
    if seconds is not None and not (
        isinstance(seconds, Real) and not isinstance(seconds, bool) and 0.0 < seconds < LONGEST_LIMIT
    ):
        raise BadInput("timeout", f"a time above zero, in s, is wanted, not {seconds!r:.40}")


@contextmanager
def time_limit(seconds: float | None) -> Iterator[TimeLimit]:
    """A context whose computations end after so many seconds, or where the user interrupts them. Raises BadInput."""
    check_timeout(seconds)
    with limited_by(TimeLimit(seconds)) as limit:
        yield limit


@contextmanager
def limited_by(limit: TimeLimit, returns_part: bool = True) -> Iterator[TimeLimit]:
    """A context whose computations end where a limit, or one around it, is over.

    Raises NoAnswer with the outcome "interrupted" where one ended early of which a part is no result; unless the
    context `returns_part`, any that ended early, whatever was made of it.
    """
    limit.outer = _CURRENT.get()
    token = _CURRENT.set(limit)
    is_first = threading.current_thread() is threading.main_thread()
    is_first = is_first and signal.getsignal(signal.SIGINT) is signal.default_int_handler

    def interrupt(number: int, frame: FrameType | None) -> None:
        if limit.is_interrupted:
            signal.default_int_handler(number, frame)
        limit.is_interrupted = True

    if is_first:
        signal.signal(signal.SIGINT, interrupt)
    try:
        yield limit
        is_whole = returns_part or not limit.ended_by
    except ComputationEnded:
        is_whole = False
    except Exception as problem:
        says_so = isinstance(problem, NoAnswer) and problem.outcome is Outcome.INTERRUPTED
        if returns_part or says_so or not limit.ended_by:
            raise
        is_whole = False
    finally:
        _CURRENT.reset(token)
        if is_first:
            signal.signal(signal.SIGINT, signal.default_int_handler)
    if not is_whole:
        raise NoAnswer(Outcome.INTERRUPTED, f"{limit.ended_by} {limit.how_far or f'before it was done; {MORE_TIME}'}")


def stops_in_time(function: F) -> F:
    """The function, which its argument `timeout` (s), or a Ctrl-C, ends with NoAnswer: a part is no result of it."""
    return _with_timeout(function, False)


def returns_part_in_time(function: F) -> F:
    """The function, which its argument `timeout` (s), or a Ctrl-C, ends with a part of the result, which says so."""
    return _with_timeout(function, True)


def _with_timeout(function: F, returns_part: bool) -> F:
    @wraps(function)
    def limited(*arguments: Any, timeout: float | None = None, **options: Any) -> Any:
        check_timeout(timeout)
        with limited_by(TimeLimit(timeout), returns_part):
            return function(*arguments, **options)

    wrapped: Any = limited
    wrapped.returns_part = returns_part
    return wrapped  # type: ignore[no-any-return]


def time_is_over() -> str:
    """Why the computation that is under way has to end, in words; empty where it may go on."""
    limits = []
    limit = _CURRENT.get()
    while limit is not None:
        limits.append(limit)
        reason = limit.reason
        if reason:
            for ended in limits:
                ended.ended_by = reason
            return reason
        limit = limit.outer
    return ""


def stop_if_over(progress: str, remedy: str = MORE_TIME) -> None:
    """End a computation of which a part is no result, where its time is over: `progress` says how far it came."""
    if not time_is_over():
        return
    limit = _CURRENT.get()
    while limit is not None and limit.ended_by:
        limit.how_far = f"{progress}; {remedy}"
        limit = limit.outer
    raise ComputationEnded


def interrupted(reason: str, progress: str, remedy: str = MORE_TIME) -> NoAnswer:
    """That a computation ended early: why, how far it came, and what helps."""
    return NoAnswer(Outcome.INTERRUPTED, f"{reason} {progress}; {remedy}")


def within_time(items: Iterable[T]) -> Iterator[T]:
    """The items for as long as there is time."""
    for item in items:
        if time_is_over():
            return
        yield item


def all_within_time(items: Collection[T], what: str, remedy: str = MORE_TIME) -> Iterator[T]:
    """The items where only all of them are a result: `what` names them, in the plural."""
    for number, item in enumerate(items):
        stop_if_over(f"after {number} of {len(items)} {what}", remedy)
        yield item
        report_progress(number + 1, len(items))


def report_progress(done: float, total: float) -> None:
    """Say how much of the computation under way is done, to whoever set its limit."""
    limit = _CURRENT.get()
    while limit is not None and limit.progress is None:
        limit = limit.outer
    if limit is not None and limit.progress is not None:
        limit.progress(done, total)
