"""The oscillations of released inputs in a simulation: when each turns back, solved for between the steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.dynamics.lagrangian import LagrangianFunctions
from planar.equations.casadi_functions import BufferedFunction
from planar.foundation.arrays import Array
from planar.foundation.root_finding import find_root
from planar.foundation.short_repr import short_repr
from planar.model.pairs import MeasureKind

REST_RATIO = 1e-10
"""Of the greatest rate of an input so far, and of a radian or the mechanism's size in the duration: at a lower rate it
is at rest, since that is round-off."""


class Oscillation(NamedTuple):
    """The times (n,), s, at which a released input turns back, and its positions (n,), rad or m, there.

    A start from rest is the first of them. Each time is a zero of the input's rate on the polynomial of the
    integrator's step, or an impact; where friction holds the input it is the time at which it comes to rest.
    """

    times: Array
    positions: Array

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def periods(self) -> Array:
        """The time from each turning to the next one on the same side (n - 2,), s; empty without a whole swing."""
        return self.times[2:] - self.times[:-2]

    @property
    def period(self) -> float:
        """The mean time of the whole swings, s; NaN where there is none."""
        count = (len(self.times) - 1) // 2
        return float(self.times[2 * count] - self.times[0]) / count if count > 0 else float("nan")


class OscillationRecorder:
    """Finds the oscillations of inputs by name, from state to state (coordinates and their rates) of an integration."""

    def __init__(self, work: LagrangianFunctions, names: Sequence[str], duration: float):
        self.names = tuple(names)
        kinds = [work.relative_motions[name].input_kind for name in names]
        sizes = [work.size if kind is MeasureKind.LENGTH else 1.0 for kind in kinds]
        positions = ca.vertcat(ca.SX(0, 1), *work.relative_positions(names))
        rates = ca.jtimes(positions, work.q, work.q1)
        outputs = [ca.densify(positions), ca.densify(rates)]
        self._function = BufferedFunction(ca.Function("inputs", [work.q, work.q1], outputs))
        self._coordinate_count = work.q.numel()
        count = len(self.names)
        self._signs, self._greatest_rates = np.zeros(count), np.array(sizes, dtype=float) / duration
        self._rest_since: list[tuple[float, float] | None] = [None] * count
        self._turnings: list[list[tuple[float, float]]] = [[] for _ in self.names]

    def oscillations(self) -> dict[str, Oscillation]:
        """The oscillations so far, of the inputs that turned back at least once after the start."""
        return {
            name: Oscillation(*np.array(turnings).T)
            for name, turnings in zip(self.names, self._turnings, strict=True)
            if len(turnings) > 1 or any(time > 0.0 for time, _ in turnings)
        }

    def follow(
        self, start: tuple[float, Array], end: tuple[float, Array], interpolant: Callable[[], Callable[..., Array]]
    ) -> None:
        """Go on from a start (time, state) to an end, between which an interpolant has the states."""
        positions, rates = self._evaluate(end[1])
        inner: list[Callable[..., Array]] = []

        def state_at(time: float) -> Array:
            inner[:] = inner or [interpolant()]
            return np.asarray(inner[0](time))

        for index, (position, rate) in enumerate(zip(positions, rates, strict=True)):
            self._greatest_rates[index] = max(self._greatest_rates[index], abs(rate))
            if abs(rate) <= REST_RATIO * self._greatest_rates[index]:
                self._rest_since[index] = self._rest_since[index] or (end[0], position)
                continue
            sign, rest = np.sign(rate), self._rest_since[index]
            if sign != self._signs[index]:
                if rest is not None:
                    self._turnings[index].append(rest)
                elif self._signs[index]:
                    self._turnings[index].append(self._turning(index, start[0], end[0], state_at))
            self._signs[index], self._rest_since[index] = sign, None

    def jump(self, time: float, state: Array) -> None:
        """Go on with a state at a time at which rates may have changed, as by an impact."""
        self.follow((time, state), (time, state), lambda: lambda _: state)

    def _turning(self, index: int, start: float, end: float, state_at: Callable[[float], Array]) -> tuple[float, float]:
        time = (
            find_root(lambda time: float(self._evaluate(state_at(time))[1][index]), start, end) if end > start else end
        )
        return time, float(self._evaluate(state_at(time))[0][index])

    def _evaluate(self, state: Array) -> tuple[list[float], list[float]]:
        q, q1 = state[: self._coordinate_count], state[self._coordinate_count : 2 * self._coordinate_count]
        positions, rates = self._function(q, q1)
        return np.ravel(positions).tolist(), np.ravel(rates).tolist()
