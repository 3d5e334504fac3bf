"""The balance of virtual work at many positions, in the coordinates of the links alone."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.dynamics.lagrangian import LagrangianFunctions
from planar.equations.casadi_call import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.equations.residuals import wrapped_residual
from planar.foundation.arrays import Array
from planar.model.mechanism import Input, Mechanism
from planar.model.pairs import MeasureKind


class VirtualWorkBalance(NamedTuple):
    """Everything at positions (n, ...), over the coordinates of the links alone (links: 3 per moving link).

    `constraints` (n, rows, links) with the pairs' own coordinates gone, `drives` (n, inputs, links), `loads` (n, links)
    what loads, weights, springs and dampers put on them, `inertia` (n, links) what accelerating them takes, `openings`
    (n, rows) by how much the pairs' constraints are open (m, angles as rad times the square of the size).
    """

    constraints: Array
    input_directions: Array
    loads: Array
    inertia: Array
    openings: Array


class BalanceFunction:
    """The function of one mechanism that fills a balance in.

    `dimensions` are the symbols that stand in the mechanism for numbers of its file.
    """

    def __init__(self, work: LagrangianFunctions, dimensions: ca.SX | None = None):
        self.work, self.link_coordinate_count = work, work.link_coordinate_count
        self.pair_rows: dict[str, slice] = {}
        "of every pair: its rows of the constraints"
        at = 0
        for pair in work.mechanism.pairs:
            self.pair_rows[pair.name] = slice(at, at + len(pair.residual_kinds) - len(pair.coordinate_kinds))
            at = self.pair_rows[pair.name].stop
        self.row_count = at
        # what efforts do is told by their places: how a pair's own coordinates follow those of its links is not unique
        drives = ca.vertcat(
            ca.SX(0, work.q.numel()), *(work.unit_effort_on_links(given.pair).T for given in work.mechanism.inputs)
        )
        openings = stack_expressions(
            wrapped_residual(value, kind) * (1.0 if kind is MeasureKind.LENGTH else work.size**2)
            for value, kind in zip(ca.vertsplit(work.residuals), self._residual_kinds(), strict=True)
        )
        outputs = [ca.jacobian(work.residuals, work.q), drives, ca.sum2(work.actions_on_links), work.inertia, openings]
        given = [
            work.q,
            work.q1,
            work.q2,
            work.factors,
            work.spring_turns,
            ca.SX(0, 1) if dimensions is None else dimensions,
        ]
        self._called = BufferedFunction(ca.Function("balance", given, [ca.densify(each) for each in outputs]))

    def _residual_kinds(self) -> list[MeasureKind]:
        return [kind for pair in self.work.mechanism.pairs for kind in pair.residual_kinds]

    def evaluate(
        self, q: Array, q1: Array, q2: Array, factors: Array, wound: Array, dimensions: Array | None = None
    ) -> VirtualWorkBalance:
        """Everything at coordinates with their rates (n, coordinates), each alike; factors of the loads (n, loads),
        `wound` as `LagrangianFunctions.initial_spring_turns` gives it, (springs,) or (n, springs), and `dimensions`
        (n, dimensions), where there are any."""
        numbers = np.zeros(0) if dimensions is None else dimensions
        parts = self._called.evaluate_batch(len(q), q, q1, q2, factors, wound, numbers)
        slopes, drives = (each.transpose(0, 2, 1) for each in parts[:2])
        loads, inertia, open_by = (each[:, 0] for each in parts[2:])
        constraints = np.zeros((len(q), self.row_count, self.link_coordinate_count))
        openings = np.zeros((len(q), self.row_count))
        first = 0
        for pair in self.work.mechanism.pairs:
            rows, own = slice(first, first + len(pair.residual_kinds)), self.work.own_slices[pair.name]
            first = rows.stop
            of_links, of_own = slopes[:, rows, : self.link_coordinate_count], slopes[:, rows, own]
            count, opening = of_own.shape[2], open_by[:, rows]
            if count:
                # what is left to hold the links, square to what its own coordinates do
                basis = np.linalg.qr(of_own, mode="complete")[0]
                of_links = (basis.transpose(0, 2, 1) @ of_links)[:, count:]
                opening = (basis.transpose(0, 2, 1) @ opening[:, :, None])[:, count:, 0]
            constraints[:, self.pair_rows[pair.name]] = of_links
            openings[:, self.pair_rows[pair.name]] = opening
        of_all = self.link_coordinate_count
        return VirtualWorkBalance(constraints, drives[..., :of_all], loads[:, :of_all], inertia[:, :of_all], openings)


def balance_function(mechanism: Mechanism) -> BalanceFunction:
    """The function of a mechanism, kept for the next time, wherever its inputs then stand and however fast they run."""
    inputs = tuple(Input(given.pair, 0.0) for given in mechanism.inputs)
    loads = tuple(load._replace(varies=None) for load in mechanism.loads)
    acted_on = mechanism.links, mechanism.pairs, inputs, loads, mechanism.springs, mechanism.masses, mechanism.gravity
    return _cached_balance_function(Mechanism("", mechanism.frame, *acted_on))


@lru_cache(maxsize=32)
def _cached_balance_function(mechanism: Mechanism) -> BalanceFunction:
    return BalanceFunction(LagrangianFunctions(mechanism))
