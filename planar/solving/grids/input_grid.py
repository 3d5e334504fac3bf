"""The positions of a mechanism over a grid of its inputs, on the assembly to which the motion from its own leads.

From one position that is known lines of the grid are followed both ways, and from these the lines beside them, until no
more can be reached: every step is followed, and none is assembled anew.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.time_limit import MORE_TIME, report_progress, stop_if_over
from planar.solving.checks.singular_values import MIN_REGULARITY
from planar.solving.continuation.path import follow_samples, follow_straight
from planar.solving.position import PositionSolver
from planar.solving.rates.regularity import regularity

MAX_STARTS = 16
"""Nodes next to the file's own position from which the grid may start."""
Node = tuple[int, ...]
"""Which of its positions each input of the grid has."""


class Border(NamedTuple):
    """Where the motion from one node towards its neighbour ends, and why: the inputs there, where they are known."""

    node: Node
    beyond: Node
    outcome: Outcome
    reason: str
    u: Array | None


class InputGrid:
    """The nodes that are reached: unknowns `z` (..., unknowns), NaN where none is, and the borders met on the way."""

    def __init__(self, solver: PositionSolver, z: Array, columns: Sequence[int], axes: Sequence[Array]):
        """From unknowns z at the solver's own inputs; `columns` are the inputs that run over `axes` (scaled)."""
        self.solver, self.columns, self.axes = solver, tuple(columns), tuple(axes)
        self.shape: Node = tuple(len(axis) for axis in axes)
        self.z = np.full((*self.shape, z.size), np.nan)
        self.is_reached: BoolArray = np.zeros(self.shape, dtype=bool)
        self.borders: dict[tuple[Node, Node], Border] = {}
        self._queue: deque[Node] = deque()
        self._start(z)
        while self._queue:
            done, total = int(self.is_reached.sum()), self.is_reached.size
            stop_if_over(f"after {done} of {total} positions", f"{MORE_TIME}, or ask for fewer positions")
            report_progress(done, total)
            self._leave(self._queue.popleft())

    def inputs_at(self, node: Node) -> Array:
        """All inputs at a node (inputs,), scaled."""
        u = self.solver.inputs.u.copy()
        u[list(self.columns)] = [axis[k] for axis, k in zip(self.axes, node, strict=True)]
        return u

    def _start(self, z: Array) -> None:
        """The node nearest to the file's own position from which the rest starts; it may have to be another."""
        own = self.solver.inputs.u
        grids = np.meshgrid(*(axis - own[c] for axis, c in zip(self.axes, self.columns, strict=True)), indexing="ij")
        far = np.sum([each**2 for each in grids], axis=0)
        first: NoAnswer | None = None
        for flat in np.argsort(far, axis=None)[:MAX_STARTS]:
            node = tuple(int(k) for k in np.unravel_index(int(flat), self.shape))
            try:
                way = follow_straight(self.solver, self.solver.inputs.p, z, own, self.inputs_at(node))
            except NoAnswer as problem:
                first = first or problem
                continue
            self._enter(node, way.z[-1])
            return
        assert first is not None
        raise first

    def _enter(self, node: Node, z: Array) -> None:
        self.z[node], self.is_reached[node] = z, True
        self._queue.append(node)

    def _leave(self, node: Node) -> None:
        """Follow the lines through a node as far as they are not known."""
        for axis in range(len(self.shape)):
            for way in (1, -1):
                line = [*self._line(node, axis, way)]
                if line:
                    self._follow([node, *line])

    def _line(self, node: Node, axis: int, way: int) -> Iterator[Node]:
        """The nodes that are not known from here on along an axis, until one that is."""
        before, k = node, node[axis] + way
        while 0 <= k < self.shape[axis]:
            here = (*node[:axis], k, *node[axis + 1 :])
            if self.is_reached[here] or (before, here) in self.borders or (here, before) in self.borders:
                return
            yield here
            before, k = here, k + way

    def _follow(self, nodes: list[Node]) -> None:
        u = np.array([self.inputs_at(node) for node in nodes])
        found = follow_samples(self.solver, self.solver.inputs.p, self.z[nodes[0]], u)
        weak = np.flatnonzero(self._strength(found.z, u[: len(found.z)]) < MIN_REGULARITY)
        if weak.size and weak[0]:
            row = int(weak[0])
            place = self.solver.describe_inputs(u[row])
            self.borders[nodes[row - 1], nodes[row]] = Border(
                nodes[row - 1], nodes[row], Outcome.DEAD_POINT, f"a dead point is at {place}", u[row]
            )
            found = found._replace(z=found.z[:row], stopped=None)
        for node, z in zip(nodes[1:], found.z[1:], strict=False):
            self._enter(node, z)
        if found.stopped is not None:
            last, beyond = nodes[len(found.z) - 1], nodes[len(found.z)]
            at = None if found.last_position is None else found.last_position[1]
            self.borders[last, beyond] = Border(last, beyond, found.stopped.outcome, found.stopped.reason, at)

    def _strength(self, z: Array, u: Array) -> Array:
        """How far from singular positions are (n,)."""
        slopes, _ = self.solver.functions.jacobians(z, u, self.solver.inputs.p)
        found: Array = regularity(self.solver, slopes).min(axis=-1, initial=1.0)
        return found

    def outcomes(self) -> IntArray:
        """Why each node is not reached (...), as the index of an `Outcome`; that of the border that lies before it."""
        every = [*Outcome]
        found = np.where(self.is_reached, every.index(Outcome.SOLVED), -1)
        known: IntArray = found
        for border in self.borders.values():
            if known[border.beyond] < 0:
                known[border.beyond] = every.index(border.outcome)
        while (known < 0).any():
            spread = known.copy()
            for axis in range(known.ndim):
                for shift in (1, -1):
                    beside = np.roll(known, shift, axis)
                    edge = [slice(None)] * known.ndim
                    edge[axis] = slice(0, 1) if shift == 1 else slice(-1, None)
                    beside[tuple(edge)] = -1
                    takes = (spread < 0) & (beside > every.index(Outcome.SOLVED))
                    spread[takes] = beside[takes]
            if (spread == known).all():
                break
            known = spread
        return known
