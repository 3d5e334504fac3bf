"""What a gradient costs beside its run: one scalar of a whole turn in all numbers of the file, natively, side by side.

    python -m benchmarks.gradients [MODEL ...]

For each model twice: positions alone, then with velocities and accelerations; one point; a design that was not solved
before. The scalar is a sum of random weights. The greatest difference from `planar.gradient` of the same motion stands
beside the times, as a part of the greatest derivative.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from itertools import count
from typing import Any, NamedTuple

import numpy as np

import planar
from benchmarks.timing import best
from planar.batch.design_arrays import design_variables

MODELS = (
    "crank-rocker",
    "slider-crank",
    "whitworth",
    "oscillating-cylinder",
    "geared-five-bar",
    "watt-six-bar",
    "klann-leg",
    "stephenson-3-five-bar",
    "double-butterfly",
)
STEPS = 360
LIMITS = {False: 3.0, True: 5.0}
"""Of a gradient's time beside that of its run: positions alone, and with rates."""
CHANGES = 1e-6
"""By what part a length differs from call to call."""


class Case(NamedTuple):
    """A run and its gradient, ready to be timed; `names` is how many numbers the gradient is by."""

    model: str
    rates: bool
    names: int
    is_native: bool
    error: float
    run: Callable[[], Any]
    gradient: Callable[[], Any]


def case(model: str, rates: bool) -> Case:
    """A model's run and gradient, of another design in each call."""
    mechanism = planar.load(model)
    every = planar.prepared(mechanism, 12, rates=False).points
    ready = planar.prepared(mechanism, STEPS, every[-1], rates=rates)
    rng, known = np.random.default_rng(1), design_variables(mechanism)
    orders = ("position", "velocity", "acceleration")[: 3 if rates else 1]
    weights = {order: {every[-1]: rng.normal(size=(STEPS + 1, 2))} for order in orders}
    name = next(name for name, each in known.items() if each.link and each.kind == "length" and each.value)
    value = known[name].value
    calls = count()

    def values() -> dict[str, float]:
        return {name: value * (1.0 + CHANGES * (next(calls) % 64))}

    found = ready.gradient(weights, {name: value})
    motion = planar.cycle(mechanism, STEPS)
    solved = found.status == 0
    if len(motion) != STEPS + 1 or not solved.all():
        error = float("nan")
    else:
        wanted = planar.gradient(motion, {every[-1]: {order: of[every[-1]] for order, of in weights.items()}})
        off = np.array([found.derivatives[key] - each for key, each in wanted.items()])
        error = float(np.nanmax(np.abs(off)) / np.nanmax(np.abs(list(wanted.values()))))
    is_native = any(runs is not None for runs in ready.run_gradients.compiled.values())
    return Case(
        model,
        rates,
        len(found.derivatives),
        is_native,
        error,
        lambda: ready(values()),
        lambda: ready.gradient(weights, values()),
    )


def told(cases: list[Case]) -> Iterator[str]:
    """A line for each case, after all were timed in turn."""
    times = best({(k, what): getattr(each, what) for k, each in enumerate(cases) for what in ("run", "gradient")})
    yield f"{'model':24}{'rates':>6}{'numbers':>9}{'run':>11}{'gradient':>11}{'ratio':>7}{'limit':>7}{'error':>10}"
    for k, each in enumerate(cases):
        run, gradient = times[k, "run"], times[k, "gradient"]
        said = "" if each.is_native else "  (no machine code)"
        times_shown = f"{1e6 * run:8.1f} us{1e6 * gradient:8.1f} us{gradient / run:7.2f}{LIMITS[each.rates]:7.1f}"
        yield f"{each.model:24}{'yes' if each.rates else 'no':>6}{each.names:9d}{times_shown}{each.error:10.1e}{said}"


def main() -> None:
    """Print a line for each model, without rates and with them."""
    print(*told([case(model, rates) for model in sys.argv[1:] or MODELS for rates in (False, True)]), sep="\n")


if __name__ == "__main__":
    main()
