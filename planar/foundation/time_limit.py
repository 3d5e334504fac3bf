"""A time limit for long computations, and their interruption by the user: what was found by then is returned.

Loops ask `time_is_over` between two steps; whoever starts a computation sets the limit. The first Ctrl-C ends it as the
limit does, a second one at once.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from numbers import Real
from time import monotonic
from types import FrameType

from planar.foundation.errors import BadInput

LONGEST_LIMIT = 1e9
"""s"""


class TimeLimit:
    """How long a computation may take, from when it is made: `seconds`, None for as long as it takes."""

    def __init__(self, seconds: float | None, outer: TimeLimit | None = None):
        self.seconds, self.outer, self.is_interrupted = seconds, outer, False
        self._end = None if seconds is None else monotonic() + seconds

    @property
    def reason(self) -> str:
        """Why it is over, in words; empty where it is not."""
        if self.is_interrupted:
            return "the user interrupted it"
        if self._end is not None and monotonic() > self._end:
            return f"the time limit of {self.seconds:g} s was reached"
        return self.outer.reason if self.outer is not None else ""


_CURRENT: ContextVar[TimeLimit | None] = ContextVar("time limit", default=None)


@contextmanager
def time_limit(seconds: float | None) -> Iterator[TimeLimit]:
    """A context whose computations end after so many seconds, or where the user interrupts them. Raises BadInput."""
    if seconds is not None and not (
        isinstance(seconds, Real) and not isinstance(seconds, bool) and 0.0 < seconds < LONGEST_LIMIT
    ):
        raise BadInput("timeout", f"a time above zero, in s, is wanted, not {seconds!r:.40}")
    limit = TimeLimit(seconds, _CURRENT.get())
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
    finally:
        _CURRENT.reset(token)
        if is_first:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def time_is_over() -> str:
    """Why the computation that is under way has to end, in words; empty where it may go on."""
    limit = _CURRENT.get()
    return limit.reason if limit is not None else ""
