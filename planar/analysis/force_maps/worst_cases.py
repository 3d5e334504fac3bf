"""The greatest forces over a grid of inputs: solved for between the nodes, and whether they grow without bound."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import inf, sqrt
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from planar.analysis.force_maps.grid_forces import (
    GridForces,
    Quantity,
    named_positions,
    quantities,
    quantity_values,
)
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import NoAnswer, Outcome, join_names
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import all_within_time
from planar.model.wording import amount
from planar.solving.continuation.fast_path import resting_inputs
from planar.solving.continuation.path import follow_samples
from planar.solving.input_grid import Border, InputGrid

STENCIL = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Parts of its width at which the neighbourhood of a greatest force is looked at, along each input."""
REFINEMENTS = 26
"""Halvings of that neighbourhood: its greatest, flat as it is there, is known to rounding long before."""
SAME_TOP = 0.3
"""Of the width: searches so near to one another, in a neighbourhood that is smaller than a step by as much, go on to
the same top."""
APPROACHES, APPROACH = 8, 4.0
"""Places towards a dead point, each so many times nearer than the one before."""
LEAST_GROWTH = 1.4
"""From one of these to the next: at a dead point forces that have no bound grow at least as the root of the distance,
twofold, and those that have one less and less."""
MAX_BORDERS = 3
"""Dead points and stops that are looked into for each force, those beside its greatest."""
MAX_TOPS = 5
"""Local maxima among the nodes from which the greatest is looked for."""
NO_GROWTH = 1e30
SEARCHED_LINES = 10
"""Lines between two of the grid that are looked at."""
SEARCHED_STEPS = 4.0
"""Steps of the grid in which a line beside another comes to its dead point, too."""
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
    """Where the search for a greatest begins."""

    value: float
    u: Array
    z: Array


@dataclass(eq=False)
class _Search:
    """The greatest of a quantity, by its number, that is found so far, half the `width` of the neighbourhood that is
    looked at next along each input, and by how much the least value of the last was less."""

    quantity: int
    best: _Start
    width: Array
    spread: float = inf


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
        unbounded = [self._unbounded(quantity, approaches) for quantity in self.quantities]
        tasks = [
            (k, start)
            for k, quantity in enumerate(self.quantities)
            for start in (self._starts(quantity, approaches) if unbounded[k] is None else ())
        ]
        best: dict[int, tuple[float, Array]] = {}
        for (k, _), (value, u) in zip(tasks, self._refine(tasks), strict=True):
            if k not in best or value > best[k][0]:
                best[k] = value, u
        found = []
        for k, quantity in enumerate(self.quantities):
            value, u = best.get(k, (-np.inf, self.u[0]))
            found.append(self._worst_case(quantity, value, u, unbounded[k]))
        return tuple(found)

    def _worst_case(self, quantity: Quantity, value: float, u: Array, unbounded: Border | None) -> WorstCase:
        kind = quantity.kind
        if kind == "effort":
            kind = "greatest effort" if quantity.sense > 0.0 else "least effort"
        if unbounded is None or unbounded.u is None:
            at = named_positions(self.maker.solver, u, self.names)
            return WorstCase(kind, quantity.of, quantity.sense * value, at, False, "")
        at = named_positions(self.maker.solver, unbounded.u, self.names)
        units = self.maker.solver.mechanism.units
        motions = self.maker.solver.relative_motions
        place = join_names(
            [f"{name} = {amount(each, motions[name].input_kind.value, units)}" for name, each in at.items()], None
        )
        told = f"grows without bound towards the dead point at {place}"
        return WorstCase(kind, quantity.of, quantity.sense * np.inf, at, True, told)

    def _starts(self, quantity: Quantity, approaches: list[_Approach]) -> Iterator[_Start]:
        """The greatest local maxima among the nodes, and the greatest on the way to a dead point or a stop."""
        rows = np.nan_to_num(quantity_values(self.found, quantity), nan=-np.inf)
        whole = np.full(self.grid.shape, -np.inf)
        whole[tuple(self.nodes.T)] = rows
        padded = np.pad(whole, 1, constant_values=-np.inf)
        inside = (slice(1, -1),) * whole.ndim
        is_top = np.isfinite(whole)
        for axis, way in product(range(whole.ndim), (1, -1)):
            is_top &= whole >= np.roll(padded, way, axis)[inside]
        tops = np.flatnonzero(is_top[tuple(self.nodes.T)])
        for row in tops[np.argsort(-rows[tops])[:MAX_TOPS]]:
            yield _Start(float(rows[row]), self.u[row], self.z[row])
        at_borders = [
            _Start(float(near[k]), each.u[k], each.z[k])
            for each in approaches
            if len(near := quantity_values(each.forces, quantity)) and np.isfinite(near).all()
            for k in [int(np.argmax(near))]
        ]
        if at_borders:
            yield max(at_borders, key=lambda each: each.value)

    def _unbounded(self, quantity: Quantity, approaches: list[_Approach]) -> Border | None:
        """The dead point towards which a quantity grows without bound, if there is one; an effort's are looked for
        between the lines of the grid, too, where it grows with the other sign on these."""
        growing = [each for each in approaches if _grows_without_bound(quantity_values(each.forces, quantity))]
        if not growing and quantity.kind == "effort":
            growing = [*self._growing_between_lines(quantity, approaches)]
        if not growing:
            return None
        return max(growing, key=lambda each: float(quantity_values(each.forces, quantity)[-1])).border

    def _growing_between_lines(self, quantity: Quantity, approaches: list[_Approach]) -> Iterator[_Approach]:
        """The approach between two lines towards which the effort grows most, where it has no bound.

        Beside a dead point an effort is c / sqrt(distance), and c goes on along the dead points: it is greatest next to
        the line on which it is.
        """
        known = [each for each in approaches if each.border.outcome is Outcome.DEAD_POINT]
        known.sort(key=lambda each: -_growth(each, quantity))
        for start in known[:1]:
            (along,) = np.flatnonzero(np.array(start.border.node) != np.array(start.border.beyond))
            for axis, way in product(range(len(self.grid.shape)), (1, -1)):
                if axis != along and 0 <= start.border.node[axis] + way < self.grid.shape[axis]:
                    beside = self._greatest_beside(quantity, start.border, (int(along), axis), way)
                    if beside is not None and _grows_without_bound(quantity_values(beside.forces, quantity)):
                        yield beside

    def _greatest_beside(self, quantity: Quantity, border: Border, axes: tuple[int, int], way: int) -> _Approach | None:
        """The approach with the greatest c up to the next line on a side."""
        seen: list[_Approach] = []

        def shortfall(part: float) -> float:
            found = self._approach_beside(border, *axes, way * part)
            if found is None:
                return NO_GROWTH
            seen.append(found)
            return -_growth(found, quantity)

        minimize_scalar(shortfall, bounds=(0.0, 1.0), method="bounded", options={"maxiter": SEARCHED_LINES})
        return max(seen, key=lambda each: _growth(each, quantity), default=None)

    def _approach_beside(self, border: Border, along: int, axis: int, part: float) -> _Approach | None:
        """The approach to the dead point on a line that is so far, in steps of the grid, beside that of a border."""
        solver = self.maker.solver
        start = self.grid.inputs_at(border.node)
        there, far = start.copy(), np.sign(border.beyond[along] - border.node[along])
        there[self.grid.columns[axis]] += part * self.step[axis]
        beyond = there.copy()
        beyond[self.grid.columns[along]] += SEARCHED_STEPS * far * self.step[along]
        try:
            aside = follow_samples(solver, self.grid.z[border.node], resting_inputs(np.stack([start, there])))
            if aside.stopped is not None:
                return None
            way = follow_samples(solver, aside.z[-1], resting_inputs(np.stack([there, beyond])))
        except NoAnswer:
            return None
        if way.stopped is None or way.last_position is None or way.stopped.outcome is not Outcome.DEAD_POINT:
            return None
        dead = way.last_position[1]
        place = dead[self.grid.columns[along]]
        if not self.low[along] <= place <= self.high[along]:
            return None
        met = border._replace(u=dead)
        return self._approach(met, there, aside.z[-1])

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
        every = (
            self._approach(borders[k], self.grid.inputs_at(borders[k].node), self.grid.z[borders[k].node])
            for k in chosen
        )
        return [each for each in every if each is not None]

    def _approach(self, border: Border, start: Array, z: Array) -> _Approach | None:
        """Positions from one that is known nearer and nearer to a border, with their forces."""
        assert border.u is not None
        nearer = APPROACH ** -np.arange(APPROACHES + 1.0)
        parts = nearer if border.outcome is Outcome.DEAD_POINT else np.array([1.0, 0.0])
        places = border.u + (start - border.u) * parts[:, None]
        try:
            way = follow_samples(self.maker.solver, z, resting_inputs(places))
            forces = self.maker.forces(self.maker.motion(way.z, places[: len(way.z)]))
        except NoAnswer:
            return None
        return _Approach(border, places[: len(way.z)], way.z, forces)

    def _refine(self, tasks: Sequence[tuple[int, _Start]]) -> list[tuple[float, Array]]:
        """The greatest of quantities, by their numbers, near where each search starts, all at once: values, inputs."""
        searches = [_Search(quantity, start, self.step.copy()) for quantity, start in tasks]
        for _ in all_within_time(range(REFINEMENTS if tasks else 0), "refinements of the worst cases"):
            going = [each for each in searches if not self._is_outdone(each, searches)]
            try:
                self._look_around(going)
            except NoAnswer:
                break
        return [(each.best.value, each.best.u) for each in searches]

    def _look_around(self, searches: Sequence[_Search]) -> None:
        """Each search goes to the greatest in its neighbourhood, or looks at a smaller one. Raises NoAnswer."""
        columns = list(self.grid.columns)
        pattern = np.array(list(product(STENCIL, repeat=len(columns))))
        every = np.repeat([each.best.u for each in searches], len(pattern), axis=0)
        start = every.copy()
        for number, each in enumerate(searches):
            own = slice(number * len(pattern), (number + 1) * len(pattern))
            every[own, columns] = np.clip(each.best.u[columns] + pattern * each.width, self.low, self.high)
        z = np.repeat([each.best.z for each in searches], len(pattern), axis=0)
        found, is_reached = self.maker.near(z, start, every)
        forces = self.maker.forces(self.maker.motion(found[is_reached], every[is_reached]))
        for number, each in enumerate(searches):
            own = slice(number * len(pattern), (number + 1) * len(pattern))
            values = np.full(len(every), -np.inf)
            values[is_reached] = quantity_values(forces, self.quantities[each.quantity])
            near = np.nan_to_num(values[own], nan=-np.inf)
            top = int(np.argmax(near))
            moved = near[top] > each.best.value
            if moved:
                each.best = _Start(float(near[top]), every[own][top], found[own][top])
            each.spread = each.best.value - float(near.min())
            if not moved or np.abs(pattern[top]).max() < 1.0:
                each.width = 0.5 * each.width

    def _is_outdone(self, search: _Search, searches: Sequence[_Search]) -> bool:
        """Whether a search cannot come up to another of its quantity, or comes to the same top: around a top what may
        still be gained is less than what the values of the neighbourhood differ by."""
        columns = list(self.grid.columns)
        for other in searches:
            if other is search or other.quantity != search.quantity:
                continue
            ahead = other.best.value - search.best.value
            if ahead > search.spread:
                return True
            apart = np.abs(other.best.u - search.best.u)[columns]
            same = (apart <= SAME_TOP * search.width).all() and (search.width < SAME_TOP * self.step).all()
            if same and (ahead > 0.0 or (ahead == 0.0 and searches.index(other) < searches.index(search))):
                return True
        return False


def _growth(approach: _Approach, quantity: Quantity) -> float:
    """c of an effort that is c / sqrt(distance) beside a dead point."""
    values = quantity_values(approach.forces, quantity)
    if not len(values) or approach.border.u is None or not np.isfinite(values[-1]):
        return -NO_GROWTH
    distance = float(np.linalg.norm(approach.u[-1] - approach.border.u))
    return float(values[-1]) * sqrt(distance)


def _grows_without_bound(values: Array) -> bool:
    """Whether values at places each so many times nearer grow on and on."""
    if len(values) < APPROACHES or not np.isfinite(values).all() or values[-1] <= 0.0:
        return False
    late = values[-4:]
    return bool((late > 0.0).all() and (late[1:] >= LEAST_GROWTH * late[:-1]).all())
