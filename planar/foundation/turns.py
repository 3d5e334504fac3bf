"""Turns of threads: what is Python's of a task is done by one thread at a time, what is compiled by all at once.

Only one thread at a time runs Python anyway. Two that want to at once hand the interpreter over at every call into
numpy, which takes longer than many of the calls; where each goes on to its next long call into compiled code, these
run side by side. And what tasks have in common, as functions that are compiled when they are first wanted, is made by
one thread.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock, local

_lock = Lock()


class _Turn(local):
    is_mine = False


_turn = _Turn()


@contextmanager
def take_turn() -> Iterator[None]:
    """Wait until no other thread has its turn, then take it."""
    if _turn.is_mine:
        yield
        return
    with _lock:
        _turn.is_mine = True
        try:
            yield
        finally:
            _turn.is_mine = False


@contextmanager
def leave_turn(is_long: bool = True) -> Iterator[None]:
    """Meanwhile other threads may take their turn, if this one has it, and what it does meanwhile `is_long`."""
    if not (is_long and _turn.is_mine):
        yield
        return
    _turn.is_mine = False
    _lock.release()
    try:
        yield
    finally:
        _lock.acquire()
        _turn.is_mine = True
