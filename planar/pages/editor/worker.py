"""A process beside the server that computes for pages: kept warm, limited in time, and stopped when nobody waits."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from math import inf
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from planar.foundation.errors import PlanarError

COMPUTATION_LIMIT = 60.0
"""s that one computation may take."""
GRACE = 1.5
"""s that a computation may take although nobody needs its result any more; a restart of the process takes as long."""
POLL_INTERVAL = 0.05
"""s between two checks of whether a result is still needed."""


class ComputationStopped(PlanarError):
    """A computation was stopped before it had a result; the text says why."""


class Superseded(ComputationStopped):
    """Nobody waits for the result any more: a newer drawing took its place, or the client is gone."""


class Worker:
    """Runs functions in one separate process, one after the other.

    The process is started by the first computation, or by `start`; it calls `prepare` once, which imports what the
    functions need. To stop a computation ends the process, and another one is started for the next. The process ends
    with the one that started it.
    """

    def __init__(self, prepare: Callable[[], object]) -> None:
        self._prepare = prepare
        self._turn = threading.Lock()
        self._tickets = count(1)
        self._newest: dict[str, int] = {}
        "the newest computation of each page"
        self._process: SpawnProcess | None = None
        self._line: Connection | None = None
        self._is_ready = False

    def compute(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        page: str | None = None,
        limit: float = COMPUTATION_LIMIT,
        queue_limit: float = inf,
        has_client: Callable[[], bool] = lambda: True,
    ) -> Any:
        """Return `function(*arguments)`, computed in the process; both can be pickled.

        A newer computation for the same `page` stops this one, as does a client that is gone. Raises Superseded in
        these cases, ComputationStopped after `limit` seconds, or after `queue_limit` seconds of waiting for others,
        and the PlanarError that the function raises.
        """
        ticket = next(self._tickets)
        if page is not None:
            self._newest[page] = ticket

        def is_needed() -> bool:
            return (page is None or self._newest[page] == ticket) and has_client()

        queued = time.monotonic()
        while not self._turn.acquire(timeout=min(POLL_INTERVAL, queue_limit)):
            if not is_needed():
                raise Superseded("a newer drawing took the place of this one")
            if time.monotonic() - queued >= queue_limit:
                raise ComputationStopped("another drawing is being computed")
        try:
            line = self._ready_line(limit, is_needed)
            with suppress(OSError):  # that the process has ended meanwhile is noticed when its answer is read
                line.send((function, arguments))
            succeeded, result = self._receive(line, limit, is_needed)
        finally:
            self._turn.release()
        if not succeeded:
            raise result
        return result

    def start(self) -> None:
        """Start the process, if none runs. It becomes ready in the background."""
        if self._process is not None and self._process.is_alive():
            return
        context = multiprocessing.get_context("spawn")  # a fork would copy the locks of this process's threads
        self._line, other = context.Pipe()
        self._process = context.Process(target=run_computations, args=(other, self._prepare), daemon=True)
        with _interrupts_blocked():
            self._process.start()
        other.close()
        self._is_ready = False

    def _ready_line(self, limit: float, is_needed: Callable[[], bool]) -> Connection:
        """The connection to a process that is ready. Raises ComputationStopped; the process then goes on starting."""
        self.start()
        line = self._line
        if line is None:
            raise ComputationStopped("no process computes drawings")
        if not self._is_ready:
            self._receive(line, limit, is_needed, is_starting=True)
            self._is_ready = True
        return line

    def _receive(self, line: Connection, limit: float, is_needed: Callable[[], bool], is_starting: bool = False) -> Any:
        """What the process sends next. Raises ComputationStopped; a process that computes is then replaced."""
        began = time.monotonic()
        try:
            while not line.poll(POLL_INTERVAL):
                elapsed = time.monotonic() - began
                is_late = elapsed > limit
                if not is_late and (elapsed <= GRACE or is_needed()):
                    continue
                if not is_starting:
                    self._restart()
                if is_late:
                    raise ComputationStopped(
                        f"this drawing takes more than {limit:.0f} s to compute, so the computation was stopped; save "
                        "the file and ask `planar solve` in a terminal, or draw fewer links"
                    )
                raise Superseded("a newer drawing took the place of this one")
            return line.recv()
        except (EOFError, OSError):
            self._restart()
            raise ComputationStopped(
                "the computation ended without an answer, as where memory runs out; change the drawing, or try again"
            ) from None

    def _restart(self) -> None:
        if self._process is not None and self._line is not None:
            self._process.kill()
            self._process.join()
            self._line.close()
        self.start()


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Start processes that an interrupt from the keyboard does not reach: a process inherits what its parent blocks."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    previous = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous)


def run_computations(line: Connection, prepare: Callable[[], object]) -> None:
    """Answer (function, arguments) by (True, result) or (False, error) until the connection is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt from the keyboard reaches all processes of a terminal
    threading.Thread(target=_end_with_parent, daemon=True).start()
    prepare()
    with suppress(EOFError, OSError):
        line.send("ready")
        while True:
            function, arguments = line.recv()
            line.send(_outcome(function, arguments))


def _outcome(function: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[bool, Any]:
    try:
        return True, function(*arguments)
    except PlanarError as problem:
        return False, problem
    except Exception as problem:  # the page needs a sentence, and the process goes on
        reason = f"{type(problem).__name__}: {problem}" if str(problem) else type(problem).__name__
        return False, ComputationStopped(f"the computation failed by an error of planar ({reason}); change the drawing")


def _end_with_parent() -> None:
    """End this process when its server has ended, even in the middle of a computation."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
