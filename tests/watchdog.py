"""Ends a test that hangs."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def watched(seconds: int = 30) -> Iterator[None]:
    """Ends what would hang. No speed is tested: what is watched takes milliseconds when right, minutes when wrong."""

    def ring(*_: object) -> None:
        raise AssertionError(f"not done in {seconds} s")

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
