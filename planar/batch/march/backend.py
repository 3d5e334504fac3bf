"""What runs the designs of a sweep: all of a batch through the same steps, each position judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol, TypeVar

import casadi as ca
import numpy as np

from planar.batch.march.stops import StopLimits
from planar.codegen.aligned_arrays import allocate_aligned
from planar.equations.functions import EquationFunctions
from planar.model.mechanism import Mechanism
from planar.model.pairs import Pair

Array = np.ndarray
Answer = TypeVar("Answer")


class UnsupportedStructure(Exception):
    """A backend cannot do this structure; the text says why."""


class ResultRows(Protocol):
    """Results that a march tells in place of points: so many rows of them, of further numbers of a design (symbols).

    `write_rows` writes them into the text of a march (a `NewtonBlockWriter`) where numbers stand under these names.
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
    place of the points, by machine code alone; the numbers that it takes stand in q behind those of the points.
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


class CorrectedAssemblies(NamedTuple):
    """Where designs are that a runner corrected from near by.

    `converged` (designs,), and how regular the least regular is of the blocks that Newton's method solved (the volume
    that the columns of its Jacobian span) (designs,); the unknowns z (unknowns, designs); the points of the batch, and
    the same in the other assembly of their block, infinite where that is not known (points, 2, designs), in sizes.
    """

    converged: Array
    regularity: Array
    z: Array
    points: Array
    other_points: Array


class DesignRunner(Protocol):
    """Runs the designs of a batch through all steps. Each method raises UnsupportedStructure where it cannot."""

    def can_help(self, batch: DesignBatch) -> bool:
        """Whether it can do anything for such designs that others have not done before."""

    def run(self, batch: DesignBatch, out: Array, candidates: Array | None = None) -> Array:
        """Fill out (steps + 1, rows, designs): x and y of each point, then their first, then second rates (m, s); what
        is no number from the first step on that did not pass.

        Where `out` is in single precision, each number is rounded when it is written. `candidates` (designs,) takes
        how many of the first steps stand in `out`, where a runner leaves more than passed: those that follow pass the
        checks of one position, but there may be a dead point before them.

        Returns how many of the first steps passed residual and branch check (designs,).
        """

    def last_good_unknowns(self, batch: DesignBatch, good: Array) -> Array:
        """The unknowns (unknowns, designs) at the last of so many good steps (designs,), one at least."""

    def correct_assemblies(
        self, batch: DesignBatch, point_blocks: Sequence[int], corrections: int
    ) -> CorrectedAssemblies:
        """Designs corrected from near by, where they start, by so many of Newton's steps.

        `point_blocks` are the blocks that place the points of the batch.
        """


def erase_from_steps(out: Array, first: Array) -> None:
    """Make out (steps + 1, rows, designs) no number from a step of each design on (designs,)."""
    begin = int(first.min(initial=len(out)))
    np.copyto(out[begin:], np.nan, where=np.arange(begin, len(out))[:, None, None] >= first)


def erase_between(out: Array, first: Array, end: Array) -> None:
    """Make out (steps + 1, rows, designs) no number from a step of each design on, up to another (designs,)."""
    many = np.maximum(end - first, 0)
    design = np.repeat(np.arange(len(first)), many)
    begins = np.repeat(first - (np.cumsum(many) - many), many)
    out[begins + np.arange(len(design)), :, design] = np.nan


class RunnerAttempt(NamedTuple):
    """A runner, and whether it is given all designs that have not come to the end, or those that have not begun."""

    runner: DesignRunner
    runs_to_end: bool


class RunnerLadder:
    """A runner made of others: one after the other, each for the designs that the ones before left open."""

    def __init__(self, attempts: Sequence[RunnerAttempt]):
        self.attempts = attempts

    def can_help(self, batch: DesignBatch) -> bool:
        """See `DesignRunner`."""
        return True

    def run(self, batch: DesignBatch, out: Array, candidates: Array | None = None) -> Array:
        """See `DesignRunner`."""
        good, runs = np.zeros(out.shape[2], dtype=int), 0
        for runner, runs_to_end in self.attempts:
            left = np.flatnonzero(good < (len(batch.input_offsets) if runs_to_end else 1))
            if not left.size or not runner.can_help(batch):
                continue
            if runs:  # what has nowhere to start is given once
                left = left[np.isfinite(batch.z0[:, left]).all(axis=0) & np.isfinite(batch.u0[:, left]).all(axis=0)]
                if not left.size:
                    continue
            try:
                if left.size == len(good):
                    good = runner.run(batch, out, candidates)
                else:
                    steps, rows, _ = out.shape
                    own = allocate_aligned(steps, rows, left.size, out.dtype)
                    good[left] = runner.run(batch.select(left), own)
                    out[:, :, left] = own
                    if candidates is not None:
                        candidates[left] = good[left]
            except UnsupportedStructure:
                continue
            runs += 1
        if not runs:
            raise UnsupportedStructure("no runner can run this structure")
        return good

    def last_good_unknowns(self, batch: DesignBatch, good: Array) -> Array:
        """See `DesignRunner`."""
        return self._first_answer(lambda runner: runner.last_good_unknowns(batch, good))

    def correct_assemblies(
        self, batch: DesignBatch, point_blocks: Sequence[int], corrections: int
    ) -> CorrectedAssemblies:
        """See `DesignRunner`."""
        return self._first_answer(lambda runner: runner.correct_assemblies(batch, point_blocks, corrections))

    def _first_answer(self, ask: Callable[[DesignRunner], Answer]) -> Answer:
        for runner, _ in self.attempts:
            try:
                return ask(runner)
            except UnsupportedStructure:
                continue
        raise UnsupportedStructure("no runner can do this")
