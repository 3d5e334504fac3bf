"""What a call costs that is repeated in one process, beside scipy's fsolve with rates by hand for as many positions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from typing import Any

import planar
from benchmarks.linkages import FourBar
from benchmarks.timing import ROUNDS, best
from benchmarks.ways import fsolve

WARM_CALLS = 400
"""Calls of each kind before time is taken: what is often computed becomes machine code, where llvmlite is installed."""
STEPS = (72, 360)
"""Of runs."""
PLACES = 50
"""Positions of the input, a thousandth of a radian apart, to which it is moved in turn."""


@dataclass(frozen=True)
class RepeatedCall:
    """Seconds of a call, how many positions it gives, and its time in times of fsolve's for as many."""

    call: str
    seconds: float
    positions: int
    ratio: float


def repeated_calls(warm_calls: int = WARM_CALLS, rounds: int = ROUNDS) -> tuple[RepeatedCall, ...]:
    """Positions of a four-bar at its own input and at others, runs of a whole turn and between dead points."""
    crank_rocker, double_rocker = planar.from_dict(FourBar().document()), planar.load("four-bar")
    calls: dict[str, tuple[int, Callable[[], Any]]] = {
        "solve": (1, lambda: planar.solve(double_rocker)),
        "solve, input moved": (1, _solve_elsewhere(double_rocker)),
    }
    for steps in STEPS:
        calls[f"cycle of {steps} steps, a turn"] = steps + 1, _run(crank_rocker, steps)
        calls[f"cycle of {steps} steps, between dead points"] = steps + 1, _run(double_rocker, steps)
    for _, call in calls.values():
        for _ in range(warm_calls):
            call()
    _, with_rates = fsolve.trials(FourBar())
    seconds = best({fsolve.WAY: with_rates.solve, **{name: call for name, (_, call) in calls.items()}}, rounds)
    position = seconds[fsolve.WAY] / with_rates.samples
    return tuple(
        RepeatedCall(name, seconds[name], positions, seconds[name] / (positions * position))
        for name, (positions, _) in calls.items()
    )


def _solve_elsewhere(mechanism: planar.Mechanism) -> Callable[[], planar.State]:
    (given,), numbers = mechanism.inputs, count()
    return lambda: planar.solve(mechanism, {given.pair: given.position + 1e-3 * (next(numbers) % PLACES)})


def _run(mechanism: planar.Mechanism, steps: int) -> Callable[[], planar.Motion]:
    return lambda: planar.cycle(mechanism, steps)
