"""A linkage as a function of some of its numbers with its derivative, for libraries that learn and optimise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planar.batch.gradients.run_gradients import ORDERS, read_names
from planar.batch.prepared import PreparedRun, RangeArguments, prepared
from planar.batch.results import Sweep
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput

LEAST_SWEPT_DESIGNS = 32
"""Designs from which on they are swept; fewer run one after the other."""


class LinkageLayer:
    """The runs of one linkage for many designs at once, and the derivatives of weighed sums of what they tell.

    `free`: the numbers that designs differ in, by name; `file_values` (free,) those of the file (SI). `orders`: what is
    told, positions alone or with velocities and accelerations. Raises BadInput.
    """

    def __init__(  # many: what a layer is made of
        self,
        mechanism: Any,
        free: Sequence[str] | str,
        points: Sequence[str] | str | None,
        steps: int,
        rates: bool,
        over: RangeArguments,
    ):
        self._runs = prepared(mechanism, steps, points, rates=rates, **over)
        known = self._runs.derivative_values
        self.free = read_names(free, known)
        if not self.free:
            raise BadInput("free", "name the numbers that are free, as free=['BC.length']")
        for name in self.free:
            if known[name] is None:
                raise BadInput("free", f"{name!r} cannot change alone: others have to go with it")
        self.file_values = np.array([known[name] for name in self.free])
        self.points, self.orders = self._runs.points, ORDERS if rates else ORDERS[:1]
        self.result_shape = (steps + 1, *([len(self.points)] if len(self.points) > 1 else []), 2)
        "of one design: positions, then points where there are several, then x and y"

    def __repr__(self) -> str:
        shown = ", ".join(self.free)
        return f"{self._runs.mechanism.name!r}: {self.result_shape[0]} positions of {', '.join(self.points)} by {shown}"

    def run(self, values: Array) -> tuple[list[Array], BoolArray]:
        """What the runs of designs (..., free) tell, an array (..., *result_shape) for each order, and which positions
        are solved (..., steps + 1). What is not solved is 0."""
        designs = np.asarray(values, dtype=float).reshape(-1, len(self.free))
        results = np.zeros((len(self.orders), len(designs), self.result_shape[0], len(self.points), 2))
        solved = np.zeros((len(designs), self.result_shape[0]), dtype=bool)
        known = np.flatnonzero(np.isfinite(designs).all(axis=1))
        runs: list[tuple[Any, PreparedRun | Sweep]] = []
        if len(known) < LEAST_SWEPT_DESIGNS:
            runs += [(k, self._runs(dict(zip(self.free, designs[k].tolist(), strict=True)))) for k in known]
        else:
            runs.append((known, self._runs.sweep(dict(zip(self.free, designs[known].T, strict=True)))))
        for index, run in runs:
            for order, name in enumerate(self.orders):
                for number, point in enumerate(self.points):
                    results[order, index, :, number] = getattr(run, name)[point]
            solved[index] = np.asarray(run.status) == 0
        solved &= np.isfinite(results).all(axis=(0, 3, 4))
        results[:, ~solved] = 0.0
        lead = np.shape(values)[:-1]
        orders: list[Array] = [order.reshape(*lead, *self.result_shape) for order in results]
        return orders, solved.reshape(*lead, self.result_shape[0])

    def pull_back(self, values: Array, weights: Sequence[Array]) -> Array:
        """The derivatives (..., free) of the sum of what is told times weights, one array for each order as `run` has
        them. Positions that are not solved bring nothing."""
        designs = np.asarray(values, dtype=float).reshape(-1, len(self.free))
        shape = (len(designs), self.result_shape[0], len(self.points), 2)
        given = np.stack([np.asarray(each, dtype=float).reshape(shape) for each in weights], axis=1)
        pairs = given.transpose(0, 1, 3, 2, 4).reshape(len(designs), -1, self.result_shape[0], 2)
        known = np.isfinite(designs).all(axis=1)
        gradients = self._runs.run_gradients
        columns = [gradients.names.index(name) for name in self.free]
        slopes, rows = np.zeros(designs.shape), tuple(range(2 * pairs.shape[1]))
        slopes[known] = gradients.slopes_of_designs(rows, self.free, designs[known], pairs[known])[:, columns]
        return slopes.reshape(np.shape(values))

    def check_shape(self, shape: Sequence[int]) -> None:
        """Refuse values that are not (..., free). Raises BadInput."""
        if not shape or shape[-1] != len(self.free):
            raise BadInput("values", f"an array (..., {len(self.free)}) of {', '.join(self.free)} is wanted here")
