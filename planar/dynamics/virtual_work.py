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
from planar.equations.sparse_matrices import SparseMatrices, SparsePattern
from planar.foundation.arrays import Array, IntArray
from planar.model.mechanism import Input, Mechanism
from planar.model.pairs import MeasureKind, Pair


class VirtualWorkBalance(NamedTuple):
    """Everything at positions (n, ...), over the coordinates of the links alone (links: 3 per moving link).

    `constraints` (n, links, rows): what a force of one in each row of the pairs puts on the links, the pairs' own
    coordinates eliminated; `input_directions` (n, inputs, links) the same of efforts of the inputs, `loads` (n, links)
    what loads, weights, springs and dampers put on them, `inertia` (n, links) what accelerating them takes, `openings`
    (n, rows) by how much the pairs' constraints are open (m, angles as rad times the square of the size).
    """

    constraints: SparseMatrices
    input_directions: Array
    loads: Array
    inertia: Array
    openings: Array


class _PairSlopes(NamedTuple):
    """Where the derivatives of one pair's residuals stand among those of all pairs.

    `residuals` are its rows, `slopes` its entries (residuals, coordinates of its links and then its own), row after
    row; `entries` are those of its `rows` in the constraints.
    """

    residuals: slice
    slopes: slice
    rows: slice
    entries: slice
    own_count: int


class BalanceFunction:
    """The function of one mechanism that fills a balance in.

    `dimensions` are the symbols that stand in the mechanism for numbers of its file.
    """

    def __init__(self, work: LagrangianFunctions, dimensions: ca.SX | None = None):
        self.work, self.link_coordinate_count = work, work.link_coordinate_count
        self.pair_rows: dict[str, slice] = {}
        "of every pair: its rows of the constraints"
        first = 0
        for pair in work.mechanism.pairs:
            self.pair_rows[pair.name] = slice(first, first + len(pair.residual_kinds) - len(pair.coordinate_kinds))
            first = self.pair_rows[pair.name].stop
        self.row_count = first
        # efforts act by their places: how a pair's own coordinates follow those of its links is not unique
        drives = ca.vertcat(
            ca.SX(0, work.q.numel()), *(work.unit_effort_on_links(given.pair).T for given in work.mechanism.inputs)
        )
        openings = stack_expressions(
            wrapped_residual(value, kind) * (1.0 if kind is MeasureKind.LENGTH else work.size**2)
            for value, kind in zip(ca.vertsplit(work.residuals), self._residual_kinds(), strict=True)
        )
        slopes, drives = ca.jacobian(work.residuals, work.q), ca.sparsify(drives)
        self._place_slopes(*(np.array(each, dtype=int) for each in slopes.sparsity().get_triplet()))
        self._drive_entries = drives.sparsity().get_triplet()
        outputs = [ca.vec(slopes).nz[:], ca.vec(drives).nz[:], work.total_action_on_links, work.inertia, openings]
        arguments = [
            work.q,
            work.q1,
            work.q2,
            work.factors,
            work.spring_turns,
            ca.SX(0, 1) if dimensions is None else dimensions,
        ]
        self._called = BufferedFunction(ca.Function("balance", arguments, [ca.densify(each) for each in outputs]))

    def _residual_kinds(self) -> list[MeasureKind]:
        return [kind for pair in self.work.mechanism.pairs for kind in pair.residual_kinds]

    def columns_of_pair(self, pair: Pair) -> list[int]:
        """The coordinates of the links that a pair joins."""
        firsts = sorted({self.work.link_columns[link] for link in pair.bodies if link in self.work.link_columns})
        return [first + k for first in firsts for k in range(3)]

    def _place_slopes(self, residual_rows: IntArray, coordinates: IntArray) -> None:
        """Place the derivatives of all residuals by the coordinates, pair after pair, and those of the constraints."""
        self._pair_slopes: list[_PairSlopes] = []
        places: dict[tuple[int, int], int] = {}
        pattern_rows: list[int] = []
        first_residual = first_slope = 0
        for pair in self.work.mechanism.pairs:
            own, rows = self.work.own_slices[pair.name], self.pair_rows[pair.name]
            columns, own_count = self.columns_of_pair(pair), own.stop - own.start
            residuals = slice(first_residual, first_residual + len(pair.residual_kinds))
            local = [*columns, *range(own.start, own.stop)]
            pairs = ((row, column) for row in range(residuals.start, residuals.stop) for column in local)
            places |= {each: first_slope + k for k, each in enumerate(pairs)}
            slopes = slice(first_slope, first_slope + len(pair.residual_kinds) * len(local))
            entries = slice(len(pattern_rows), len(pattern_rows) + (rows.stop - rows.start) * len(columns))
            pattern_rows += columns * (rows.stop - rows.start)
            self._pair_slopes.append(_PairSlopes(residuals, slopes, rows, entries, own_count))
            first_residual, first_slope = residuals.stop, slopes.stop
        self._slope_count = first_slope
        self._slope_places = np.array(
            [places[each] for each in zip(residual_rows.tolist(), coordinates.tolist(), strict=True)], dtype=int
        )
        widths = [len(self.columns_of_pair(pair)) for pair in self.work.mechanism.pairs for _ in self._row_range(pair)]
        firsts = np.concatenate([[0], np.cumsum(np.array(widths, dtype=int))])
        self.pattern = SparsePattern((self.link_coordinate_count, self.row_count), np.array(pattern_rows, int), firsts)

    def _row_range(self, pair: Pair) -> range:
        return range(self.pair_rows[pair.name].start, self.pair_rows[pair.name].stop)

    def evaluate(
        self, q: Array, q1: Array, q2: Array, factors: Array, wound: Array, dimensions: Array | None = None
    ) -> VirtualWorkBalance:
        """Everything at coordinates with their rates (n, coordinates), each alike; factors of the loads (n, loads),
        `wound` as `LagrangianFunctions.initial_spring_turns` gives it, (springs,) or (n, springs), and `dimensions`
        (n, dimensions), where there are any."""
        count, numbers = len(q), np.zeros(0) if dimensions is None else dimensions
        parts = self._called.evaluate_batch(count, q, q1, q2, factors, wound, numbers)
        nonzeros, drives, loads, inertia, gaps = (each[:, 0] for each in parts)
        slopes: Array = np.zeros((count, self._slope_count))
        slopes[:, self._slope_places] = nonzeros
        constraints: Array = np.zeros((count, len(self.pattern.rows)))
        openings: Array = np.zeros((count, self.row_count))
        for pair in self._pair_slopes:
            pair_slopes, opening = slopes[:, pair.slopes], gaps[:, pair.residuals]
            if pair.own_count:
                pair_slopes = pair_slopes.reshape(count, opening.shape[1], -1)
                # what remains to hold the links is square to what the pair's own coordinates do
                basis = np.linalg.qr(pair_slopes[..., -pair.own_count :], mode="complete")[0]
                basis = basis.transpose(0, 2, 1)[:, pair.own_count :]
                pair_slopes = (basis @ pair_slopes[..., : -pair.own_count]).reshape(count, -1)
                opening = (basis @ opening[:, :, None])[:, :, 0]
            constraints[:, pair.entries] = pair_slopes
            openings[:, pair.rows] = opening
        of_links = self.link_coordinate_count
        directions: Array = np.zeros((count, len(self.work.mechanism.inputs), q.shape[1]))
        directions[:, self._drive_entries[0], self._drive_entries[1]] = drives
        return VirtualWorkBalance(
            SparseMatrices(self.pattern, constraints),
            directions[..., :of_links],
            loads[:, :of_links],
            inertia[:, :of_links],
            openings,
        )


def balance_function(mechanism: Mechanism) -> BalanceFunction:
    """The function of a mechanism, kept for the next time, wherever its inputs then stand and however fast they run."""
    inputs = tuple(Input(given.pair, 0.0) for given in mechanism.inputs)
    loads = tuple(load._replace(varies=None) for load in mechanism.loads)
    acted_on = mechanism.links, mechanism.pairs, inputs, loads, mechanism.springs, mechanism.masses, mechanism.gravity
    return _cached_balance_function(Mechanism("", mechanism.frame, *acted_on))


@lru_cache(maxsize=32)
def _cached_balance_function(mechanism: Mechanism) -> BalanceFunction:
    return BalanceFunction(LagrangianFunctions(mechanism))
