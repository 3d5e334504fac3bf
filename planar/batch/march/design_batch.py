"""A block of designs that runs through the same steps, and arrays of its results."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import casadi as ca
import numpy as np

from planar.batch.march.stops import StopLimits
from planar.equations.functions import EquationFunctions
from planar.model.mechanism import Mechanism
from planar.model.pairs import Pair

Array = np.ndarray


class ResultRows(Protocol):
    """Results that a march tells in place of points: so many rows of them, of further numbers of a design (symbols).

    `write_rows` writes them into the text of a march (a `KernelWriter`) where numbers stand under these names.
    """

    row_count: int
    numbers: ca.SX

    def __hash__(self) -> int: ...

    def write_rows(self, writer: Any, have: dict[tuple[str, int], str]) -> list[str]: ...


class DesignBatch(NamedTuple):
    """A block of designs that is to run. Lengths are in units of one size for all, angles in rad.

    p (numbers, designs): the numbers of all pairs; q (2 a point, designs): coordinates of the wanted points in the axes
    of their `links`, none of which is the frame; z0 (unknowns, designs): the assembly at the start; u (steps + 1,
    inputs): how far the inputs are from where each design starts, u0 (inputs, designs); u1, u2 (inputs, designs): their
    rates, the same at every step. `rates`: whether first and second rates are wanted. `tolerance`: what a constraint
    may leave open. `mechanism` has the pairs and inputs; its numbers are not those of the designs. `unit`: the size, m.
    `zeros`: rows of p and q, as ("p", row), that are nothing in all designs and are left out of what is computed.
    `signs` (blocks, designs): of the assemblies of blocks in closed form, 0 where one is not known; None of none.
    `stops`: those of pairs, which no position of a design passes; None where there are none. `results`: what is told in
    place of the points; the numbers that it takes stand in q behind those of the points.
    """

    functions: EquationFunctions
    mechanism: Mechanism
    p: Array
    q: Array
    z0: Array
    input_offsets: Array
    u0: Array
    u1: Array
    u2: Array
    links: tuple[str, ...]
    rates: bool
    tolerance: float
    unit: float
    zeros: frozenset[tuple[str, int]] = frozenset()
    signs: Array | None = None
    stops: StopLimits | None = None
    results: ResultRows | None = None

    @property
    def stop_pairs(self) -> tuple[Pair, ...]:
        """The pairs whose stops are looked at in the march."""
        return () if self.stops is None else self.stops.pairs

    @property
    def numbers(self) -> Array:
        """p, and behind it the numbers of stops, row by row."""
        return np.concatenate([self.p, self.stops.numbers]) if self.stops is not None and self.stops.pairs else self.p

    @property
    def output_row_count(self) -> int:
        """What is told at a step: x and y of each point, then their first, then second rates; or other results."""
        if self.results is not None:
            return self.results.row_count
        return 2 * len(self.links) * (3 if self.rates else 1)

    def select(self, designs: Array | slice, z0: Array | None = None) -> DesignBatch:
        """The batch of some of the designs, from other unknowns if they are given."""
        names = ("p", "q", "z0", "u0", "u1", "u2", *(["signs"] if self.signs is not None else []))
        rows = {name: getattr(self, name) for name in names}
        if isinstance(designs, slice):
            parts = {name: row[:, designs] for name, row in rows.items()}
        else:  # of which rows lie in one piece, unlike what an index gives
            which = np.flatnonzero(designs) if designs.dtype == bool else designs
            parts = {name: np.take(row, which, axis=1) for name, row in rows.items()}
            designs = which
        more: dict[str, Any] = {} if self.stops is None else {"stops": self.stops.select(designs)}
        return self._replace(**parts | more | ({} if z0 is None else {"z0": z0}))


def erase_from_steps(out: Array, first: Array) -> None:
    """Make out (steps + 1, rows, designs) no number from a step of each design on (designs,)."""
    begin = int(first.min(initial=len(out)))
    np.copyto(out[begin:], np.nan, where=np.arange(begin, len(out))[:, None, None] >= first)


def erase_between(out: Array, first: Array, end: Array) -> None:
    """Make out (steps + 1, rows, designs) no number from a step of each design on, up to another (designs,)."""
    counts = np.maximum(end - first, 0)
    if not counts.any():
        return
    design = np.repeat(np.arange(len(first)), counts)
    begins = np.repeat(first - (np.cumsum(counts) - counts), counts)
    out[begins + np.arange(len(design)), :, design] = np.nan
