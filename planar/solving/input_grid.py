"""Positions at many inputs side by side: over a grid of several inputs, or at any positions of one, as a motion.

The positions of a grid lie on the assembly to which the motion from the mechanism's own leads. From one position that
is known lines of the grid are followed in both directions, and from these the lines beside them, until no more can be
reached: every step is followed, and none is assembled again.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.time_limit import MORE_TIME, report_progress, stop_if_over
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion
from planar.solving.assembly.nearest_assembly import Assembly
from planar.solving.checks import MIN_REGULARITY
from planar.solving.continuation.fast_path import InputRates, resting_inputs, unjudged_rows
from planar.solving.continuation.path import follow_samples, follow_to
from planar.solving.position import PositionSolver, solved_mechanism
from planar.solving.samples import build_motion

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
    """The nodes that are reached: unknowns `z` (..., unknowns), NaN where none is, and the borders that are met."""

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
        start = self.solver.inputs.u
        offsets = (axis - start[column] for axis, column in zip(self.axes, self.columns, strict=True))
        distances = np.meshgrid(*offsets, indexing="ij")
        squares = np.sum([distance**2 for distance in distances], axis=0)
        first_problem: NoAnswer | None = None
        for flat in np.argsort(squares, axis=None)[:MAX_STARTS]:
            node = tuple(int(k) for k in np.unravel_index(int(flat), self.shape))
            try:
                self._enter(node, follow_to(self.solver, z, start, self.inputs_at(node)))
            except NoAnswer as problem:
                first_problem = first_problem or problem
            else:
                return
        assert first_problem is not None
        raise first_problem

    def _enter(self, node: Node, z: Array) -> None:
        self.z[node], self.is_reached[node] = z, True
        self._queue.append(node)

    def _leave(self, node: Node) -> None:
        """Follow the lines through a node as far as they are not known."""
        for axis in range(len(self.shape)):
            for sense in (1, -1):
                line = [*self._line(node, axis, sense)]
                if line:
                    self._follow([node, *line])

    def _line(self, node: Node, axis: int, sense: int) -> Iterator[Node]:
        """The nodes that are not known from one on along an axis, until one that is."""
        before, k = node, node[axis] + sense
        while 0 <= k < self.shape[axis]:
            after = (*node[:axis], k, *node[axis + 1 :])
            if self.is_reached[after] or (before, after) in self.borders or (after, before) in self.borders:
                return
            yield after
            before, k = after, k + sense

    def _follow(self, nodes: list[Node]) -> None:
        u = np.array([self.inputs_at(node) for node in nodes])
        run = follow_samples(self.solver, self.z[nodes[0]], resting_inputs(u))
        jacobians, _ = self.solver.functions.jacobians(run.z, run.inputs.u, self.solver.inputs.p)
        weak = np.flatnonzero(self.solver.jacobian_regularity(jacobians).min(axis=-1, initial=1.0) < MIN_REGULARITY)
        problem, end = run.stopped, None if run.last_position is None else run.last_position[1]
        count = len(run.z)
        if weak.size and weak[0]:
            count = int(weak[0])
            end = u[count]
            problem = NoAnswer(Outcome.DEAD_POINT, f"a dead point is at {self.solver.describe_inputs(end)}")
        for node, z in zip(nodes[1:count], run.z[1:count], strict=True):
            self._enter(node, z)
        if problem is not None:
            border = nodes[count - 1], nodes[count]
            self.borders[border] = Border(*border, problem.outcome, problem.reason, end)

    def outcomes(self) -> IntArray:
        """Why each node is not reached (...), as the index of an `Outcome`; that of the border that lies before it."""
        outcomes = [*Outcome]
        solved = outcomes.index(Outcome.SOLVED)
        known: IntArray = np.where(self.is_reached, solved, -1)
        for border in self.borders.values():
            if known[border.beyond] < 0:
                known[border.beyond] = outcomes.index(border.outcome)
        while (known < 0).any():
            spread = known.copy()
            for axis in range(known.ndim):
                for shift in (1, -1):
                    beside = np.roll(known, shift, axis)
                    np.moveaxis(beside, axis, 0)[0 if shift == 1 else -1] = -1
                    takes = (spread < 0) & (beside > solved)
                    spread[takes] = beside[takes]
            if (spread == known).all():
                break
            known = spread
        return known


def motion_at_inputs(solver: PositionSolver, assembly: Assembly, z: Array, u: Array) -> Motion:
    """The positions of unknowns z (n, unknowns) at inputs u (n, inputs), scaled, at the file's own rates.

    The rows are positions side by side and no run; rates and both parts of the gate are as in a run. Raises NoAnswer
    where one does not close.
    """
    s = solver.inputs
    rates = (np.broadcast_to(rate, u.shape).copy() for rate in (s.u1, s.u2, np.zeros_like(s.u)))
    return build_motion(solver, solver.remarks(assembly), unjudged_rows(solver, z, InputRates(u, *rates)))


def motion_over_input(mechanism: Mechanism, positions: Array) -> Motion:
    """The positions of a mechanism of one input at positions (n,) of it (rad or m), in one run from its own.

    The rows are positions side by side and no run. Raises NoAnswer where the run does not reach one.
    """
    known = solved_mechanism(mechanism)
    solver = known.solver
    u = positions[:, None] / (solver.unit if solver.is_sliding(mechanism.inputs[0].pair) else 1.0)
    order = np.argsort(positions)
    run = follow_samples(solver, known.assembly.z, resting_inputs(np.concatenate([solver.inputs.u[None], u[order]])))
    if run.stopped is not None:
        raise run.stopped
    z = np.empty((len(u), run.z.shape[1]))
    z[order] = run.z[1:]
    return motion_at_inputs(solver, known.assembly, z, u)
