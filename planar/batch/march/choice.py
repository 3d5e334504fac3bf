"""Which backends are there, and the ladder of runners that a sweep is given to."""

from __future__ import annotations

from collections.abc import Callable

from planar.batch.march.backend import RunnerAttempt, RunnerLadder
from planar.foundation.errors import BadInput


def _native_attempts() -> tuple[RunnerAttempt, ...]:
    from planar.batch.march.llvm.runner import EXTRA_CORRECTIONS, LLVMRunner

    return RunnerAttempt(LLVMRunner(), True), RunnerAttempt(LLVMRunner(EXTRA_CORRECTIONS), True)


def _numpy_attempts() -> tuple[RunnerAttempt, ...]:
    from planar.batch.march.numpy.runner import NumpyRunner

    return (RunnerAttempt(NumpyRunner(), False),)


BACKENDS: dict[str, Callable[[], tuple[RunnerAttempt, ...]]] = {"native": _native_attempts, "numpy": _numpy_attempts}
"""The attempts of each backend, the faster first. One whose library is not installed raises ImportError."""


def available_backends(backend: str) -> list[str]:
    """The names of the backends to try, in this order: what one cannot do is left to the next. Raises BadInput."""
    return [name for name, _ in _available_attempts(backend)]


def find_runner(backend: str) -> RunnerLadder:
    """What runs the designs of a sweep by a backend, or "auto". Raises BadInput."""
    from planar.batch.march.numpy.runner import StartRunner

    attempts = [each for _, attempts in _available_attempts(backend) for each in attempts]
    return RunnerLadder([*attempts, RunnerAttempt(StartRunner(), False)])


def find_native_runner(backend: str) -> RunnerLadder | None:
    """What runs them by machine code alone; None where the backend has none."""
    attempts = dict(_available_attempts(backend)).get("native")
    return None if attempts is None else RunnerLadder(attempts)


def _available_attempts(backend: str) -> list[tuple[str, tuple[RunnerAttempt, ...]]]:
    if backend not in ("auto", *BACKENDS):
        raise BadInput("backend", f"there is no backend {backend!r:.40}; choose from auto, {', '.join(BACKENDS)}")
    found = []
    for name in BACKENDS if backend == "auto" else dict.fromkeys((backend, "numpy")):
        try:
            found.append((name, BACKENDS[name]()))
        except ImportError:
            continue
    if backend not in ("auto", *(name for name, _ in found)):
        raise BadInput("backend", f'the backend {backend!r} is not installed: pip install "planar-linkages[{backend}]"')
    return found
