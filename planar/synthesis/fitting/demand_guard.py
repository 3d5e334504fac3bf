"""Positions of a design at which it goes together and keeps what is demanded of its motion, while it is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.synthesis.fitting.adjoint_rows import AdjointRows
from planar.synthesis.fitting.region_rows import RegionRows
from planar.synthesis.fitting.wanted_equations import WantedEquations, solve_rows

GUARD_STEPS, MAX_GUARD_MOVE = 6, 0.7
"""Newton's steps, and how far unknowns may go in them: farther is another assembly."""
MARGIN = 2e-5
"""rad, or of the size: by so much a demand is more than kept, for what rounding of a file takes."""
UNKNOWN_SLACK = -1.0
"""Of what is not determined, as at a limit."""


class DemandSlopes(NamedTuple):
    """Slacks that are below a bound, of some designs, to the first order in the free numbers and the input."""

    designs: IntArray
    "(k,)"
    positions: IntArray
    rows: IntArray
    slack: Array
    by_numbers: Array
    "(k, free), the input held"
    by_input: Array
    "(k,)"


@dataclass(frozen=True)
class DemandGuard:
    """The equations at the positions, and the rows whose slack, their value less a `least` one, is not to be negative.

    `over_range`: the positions lie between the first and the last entry, at shares of that range of the input; else all
    round a turn, where they were given.
    """

    equations: WantedEquations
    rows: tuple[AdjointRows | RegionRows, ...] = ()
    least: tuple[float, ...] = ()
    over_range: bool = False
    turns_only: bool = False
    "whether nothing is demanded but that a design turns fully"
    keeps_order: bool = True
    "whether entries that are wanted in their order keep it while a design is fitted"

    def kept_by(self, turn: bool, order: bool) -> DemandGuard:
        """The guard of a fit that keeps a whole turn, where only that is demanded, and an order if it says so."""
        rows, least = (self.rows, self.least) if turn or not self.turns_only else ((), ())
        return replace(self, rows=rows, least=least, keeps_order=order)

    @property
    def position_count(self) -> int:
        """How many positions are spread over the motion."""
        return 0 if self.equations.rows.inputs is None else len(self.equations.rows.inputs)

    @property
    def row_count(self) -> int:
        """How many slacks a position has."""
        return sum(len(each) for each in self.rows)

    def ends(self, unknowns: Sequence[Array]) -> tuple[Array, Array]:
        """The least and the greatest input (designs,) of all entries of designs."""
        inputs = np.concatenate([each[..., -1] for each in unknowns], axis=1)
        return inputs.min(axis=1), inputs.max(axis=1)

    def close(self, numbers: Array, before: Array, shares: Array, unknowns: Sequence[Array]) -> tuple[Array, BoolArray]:
        """Unknowns of the positions (designs, positions, unknowns) of changed designs near those before, and which
        designs go together at all of them."""
        if not before.shape[1]:
            return before, np.ones(len(before), bool)
        tried = before
        if self.over_range:
            low, high = self.ends(unknowns)
            inputs = low[:, None] + shares * (high - low)[:, None]
            tried = np.concatenate([before[..., :-1], inputs[..., None]], axis=-1)
        found, is_closed = self.equations.close(numbers, tried, np.zeros_like(tried), GUARD_STEPS)
        return found, is_closed & (np.abs(found - before).max(axis=(1, 2), initial=0.0) < MAX_GUARD_MOVE)

    def slacks(self, numbers: Array, y: Array) -> Array:
        """What is left of every demand (designs, positions * rows), rad or of the size; below zero it is not kept."""
        many, positions, unknowns = y.shape
        if not self.rows:
            return np.zeros((many, 0))
        flat, x = y.reshape(-1, unknowns), np.repeat(numbers, positions, axis=0)
        parts = [each.values(x, flat) - least for each, least in zip(self.rows, self.least, strict=True)]
        found = np.concatenate(parts, axis=1).reshape(many, positions * self.row_count) - MARGIN
        return np.where(np.isfinite(found), found, UNKNOWN_SLACK)

    def slopes(self, numbers: Array, y: Array, is_near: BoolArray) -> DemandSlopes:
        """The slacks that are near (designs, positions, rows), to the first order along the motion's equations."""
        design, position = np.nonzero(is_near.any(axis=2))
        x, at = numbers[design], y[design, position]
        values, by_y, by_x = (
            np.concatenate(parts, axis=1) for parts in zip(*(each.linearise(x, at) for each in self.rows), strict=True)
        )
        _, F_y, F_x = (each[:, 0] for each in self.equations.closure_slopes_at(x, at[:, None]))
        closures = F_y.shape[1]
        K = np.zeros((len(x), closures + 1, closures + 1))
        K[:, :-1], K[:, -1, -1] = F_y, 1.0
        right = np.zeros((len(x), closures + 1, 1 + x.shape[1]))
        right[:, -1, 0], right[:, :-1, 1:] = 1.0, -F_x
        moves = solve_rows(K, right)
        along = np.nan_to_num(by_y @ moves)
        least = np.concatenate([np.full(len(each), own) for each, own in zip(self.rows, self.least, strict=True)])
        slack = values - least - MARGIN
        flat, row = np.nonzero(is_near[design, position])
        return DemandSlopes(
            design[flat],
            position[flat],
            row,
            np.where(np.isfinite(slack), slack, UNKNOWN_SLACK)[flat, row],
            (along[..., 1:] + np.nan_to_num(by_x))[flat, row],
            along[flat, row, 0],
        )
