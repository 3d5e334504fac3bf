"""The greatest forces over a grid of inputs: solved for between the nodes, and whether they grow without bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from planar.analysis.force_maps.grid_forces import (
    GridForces,
    Quantity,
    named_positions,
    quantities,
    quantity_values,
)
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.short_repr import short_repr
from planar.solving.continuation.path import follow_samples
from planar.solving.grids.input_grid import Border, InputGrid

STENCIL = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Parts of its width at which the neighbourhood of a greatest force is looked at, along each input."""
REFINEMENTS = 18
"""Halvings of that neighbourhood: its greatest, flat as it is there, is known to rounding long before."""
APPROACHES, APPROACH = 8, 4.0
"""Places towards a dead point, each so many times nearer than the one before."""
LEAST_GROWTH = 1.4
"""From one of these to the next: at a dead point forces that have no bound grow at least as the root of the distance,
twofold, and those that have one less and less."""
MAX_BORDERS = 3
"""Dead points and stops that are looked into for each force, those beside its greatest."""
MORE_BORDERS = 48
"""And so many of all, evenly: a force may begin to grow next to a dead point alone."""


class WorstCase(NamedTuple):
    """The greatest of a force over a grid of inputs, and where it is.

    `kind` is "greatest effort" or "least effort" of an input, with its sign, "force" of a pair, the size of its
    reaction, or "couple" (N, N m). `at` are the positions of the inputs of the grid (rad, m). Where it `is_unbounded`,
    `value` is infinite, `at` is the dead point, and `remark` the sentence that says so.
    """

    kind: str
    of: str
    value: float
    at: Mapping[str, float]
    is_unbounded: bool
    remark: str

    def __repr__(self) -> str:
        return short_repr(self)


class _Approach(NamedTuple):
    """Places nearer and nearer to a border, as far as they are reached, and the forces there."""

    border: Border
    u: Array
    z: Array
    forces: Forces


class _Start(NamedTuple):
    """Where the search for a greatest begins, or the dead point towards which it has no bound."""

    value: float
    u: Array
    z: Array
    unbounded: Border | None


class WorstCaseSearch:
    """The greatest of each quantity, from the forces at the nodes of a grid."""

    def __init__(self, maker: GridForces, grid: InputGrid, nodes: IntArray, u: Array, z: Array, found: Forces):
        self.maker, self.grid, self.nodes, self.u, self.z, self.found = maker, grid, nodes, u, z, found
        self.quantities = [
            each for each in quantities(found, maker.solver.unit) if np.isfinite(quantity_values(found, each)).any()
        ]
        self.names = [maker.solver.mechanism.inputs[k].pair for k in grid.columns]
        self.step = np.array([np.ptp(axis) / max(len(axis) - 1, 1) for axis in grid.axes])
        self.low = np.array([axis.min() for axis in grid.axes])
        self.high = np.array([axis.max() for axis in grid.axes])

    def worst_cases(self) -> tuple[WorstCase, ...]:
        """Of every quantity one."""
        approaches = self._approaches()
        starts = [self._start(quantity, approaches) for quantity in self.quantities]
        refined = self._refine([k for k, start in enumerate(starts) if start.unbounded is None], starts)
        found = []
        for k, (quantity, start) in enumerate(zip(self.quantities, starts, strict=True)):
            value, u = refined.get(k, (start.value, start.u))
            found.append(self._worst_case(quantity, value, u, start.unbounded))
        return tuple(found)

    def _worst_case(self, quantity: Quantity, value: float, u: Array, unbounded: Border | None) -> WorstCase:
        kind = quantity.kind
        if kind == "effort":
            kind = "greatest effort" if quantity.sense > 0.0 else "least effort"
        if unbounded is None or unbounded.u is None:
            at = named_positions(self.maker.solver, u, self.names)
            return WorstCase(kind, quantity.of, quantity.sense * value, at, False, "")
        at = named_positions(self.maker.solver, unbounded.u, self.names)
        place = self.maker.solver.describe_inputs(unbounded.u)
        told = f"grows without bound towards the dead point at {place}"
        return WorstCase(kind, quantity.of, quantity.sense * np.inf, at, True, told)

    def _start(self, quantity: Quantity, approaches: list[_Approach]) -> _Start:
        """The greatest at a node or on the way to a dead point, with the unknowns there; or towards which dead point it
        grows without bound."""
        values = np.nan_to_num(quantity_values(self.found, quantity), nan=-np.inf)
        row = int(np.argmax(values))
        value, u, z = float(values[row]), self.u[row], self.z[row]
        unbounded: tuple[float, Border] | None = None
        for border, places, unknowns, forces in approaches:
            near = quantity_values(forces, quantity)
            if len(near) and np.isfinite(near).all() and near.max() > value:
                k = int(np.argmax(near))
                value, u, z = float(near[k]), places[k], unknowns[k]
            if _grows_without_bound(near) and (unbounded is None or near[-1] > unbounded[0]):
                unbounded = float(near[-1]), border
        return _Start(value, u, z, unbounded and unbounded[1])

    def _approaches(self) -> list[_Approach]:
        """Positions nearer and nearer to the dead points beside the nodes with the greatest forces, with their forces;
        of stops those at them."""
        rows = {tuple(node): k for k, node in enumerate(self.nodes.tolist())}
        borders = [each for each in self.grid.borders.values() if each.u is not None]
        at = np.array([rows[each.node] for each in borders], dtype=int)
        chosen: dict[int, None] = {}
        for quantity in self.quantities:
            values = np.nan_to_num(quantity_values(self.found, quantity), nan=-np.inf)[at]
            chosen |= dict.fromkeys(map(int, np.argsort(-values)[:MAX_BORDERS]))
        chosen |= dict.fromkeys(np.linspace(0, len(borders) - 1, min(len(borders), MORE_BORDERS), dtype=int).tolist())
        found = []
        for border in (borders[k] for k in chosen):
            assert border.u is not None
            start = self.grid.inputs_at(border.node)
            parts = (
                APPROACH ** -np.arange(APPROACHES + 1.0)
                if border.outcome is Outcome.DEAD_POINT
                else np.array([1.0, 0.0])
            )
            places = border.u + (start - border.u) * parts[:, None]
            try:
                way = follow_samples(self.maker.solver, self.maker.solver.inputs.p, self.grid.z[border.node], places)
                forces = self.maker.forces(self.maker.motion(way.z, places[: len(way.z)]))
            except NoAnswer:
                continue
            found.append(_Approach(border, places[: len(way.z)], way.z, forces))
        return found

    def _refine(self, chosen: Sequence[int], starts: Sequence[_Start]) -> dict[int, tuple[float, Array]]:
        """The greatest of some quantities between the nodes, all at once: (value, inputs) of each."""
        best = {k: (starts[k].value, starts[k].u, starts[k].z) for k in chosen}
        width = {k: self.step.copy() for k in chosen}
        columns = list(self.grid.columns)
        pattern = np.array(list(product(STENCIL, repeat=len(columns))))
        for _ in range(REFINEMENTS if chosen else 0):
            z, start, inputs = [], [], []
            for k in chosen:
                _, here, unknowns = best[k]
                places = np.tile(here, (len(pattern), 1))
                places[:, columns] = np.clip(here[columns] + pattern * width[k], self.low, self.high)
                inputs.append(places)
                start.append(np.tile(here, (len(pattern), 1)))
                z.append(np.tile(unknowns, (len(pattern), 1)))
            found, is_reached = self.maker.near(np.concatenate(z), np.concatenate(start), np.concatenate(inputs))
            every = np.concatenate(inputs)
            try:
                forces = self.maker.forces(self.maker.motion(found[is_reached], every[is_reached]))
            except NoAnswer:
                break
            row_of: IntArray = np.full(len(every), -1)
            row_of[is_reached] = np.arange(int(is_reached.sum()))
            for number, k in enumerate(chosen):
                own: IntArray = np.arange(number * len(pattern), (number + 1) * len(pattern))
                ours = own[row_of[own] >= 0]
                values = np.nan_to_num(quantity_values(forces, self.quantities[k])[row_of[ours]], nan=-np.inf)
                top = int(np.argmax(values)) if len(values) else -1
                moved = top >= 0 and values[top] > best[k][0]
                if moved:
                    row = int(ours[top])
                    best[k] = float(values[top]), every[row], found[row]
                if not moved or np.abs(pattern[int(ours[top] - own[0])]).max() < 1.0:
                    width[k] = 0.5 * width[k]
        return {k: each[:2] for k, each in best.items()}


def _grows_without_bound(values: Array) -> bool:
    """Whether values at places each so many times nearer grow on and on."""
    if len(values) < APPROACHES or not np.isfinite(values).all() or values[-1] <= 0.0:
        return False
    late = values[-4:]
    return bool((late > 0.0).all() and (late[1:] >= LEAST_GROWTH * late[:-1]).all())
