"""One block of a sweep: plain data in, arrays out, so that it may be solved in any process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.dead_point_tracking import follow_to_dead_points
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.general_path import OUTCOMES, SolvedDesign, solve_design
from planar.batch.initial_assembly import find_assemblies, given_assemblies
from planar.batch.march.backend import DesignBatch, DesignRunner, UnsupportedStructure
from planar.batch.march.choice import find_runner
from planar.batch.march.numpy_backend import NumpyRunner
from planar.batch.reference_design import ReferenceDesign, reference_design
from planar.codegen.aligned_arrays import allocate_aligned
from planar.foundation.errors import Outcome
from planar.model.link_shapes import LinkShape, PointMember, PointName, place_in_link
from planar.model.mechanism import LARGEST_INPUT_POSITION, Mechanism

Array = np.ndarray

LEAD_IN_STEP = 0.03
"""rad or sizes a step on the way to where the run starts."""
RUN_ALL_RATIO = 0.9
"""Where more than this part of the designs can be run, all are."""
FULL_TURN = 2.0 * np.pi


class DesignBlock(NamedTuple):
    """A block that is to be solved. `designs`: names with an array (designs,) each; `start`, `stop`: see `sweep`.

    `assemblies`: unknowns (unknowns, designs) at the designs' own inputs, where it is not the sketch that chooses; not
    numbers of a design that has no assembly.
    """

    mechanism: Mechanism
    designs: Mapping[str, Array]
    steps: int
    points: tuple[PointName, ...]
    rates: bool
    start: float | None
    stop: float | None
    pair: str | None
    backend: str
    assemblies: Array | None = None


class SolvedDesigns(NamedTuple):
    """A solved block: out (steps + 1, rows, designs), x and y of every point, then first, then second rates (m, s);
    status (designs, steps + 1); positions of the running input (steps + 1,) or (designs, steps + 1); how many positions
    the general path solved, how many designs it was given; by outcome how many designs ended so, and a sentence of one:
    by that of what is solved, how many lack rates, or digits of them.
    """

    out: Array
    status: Array
    input: Array
    general_positions: int
    general_designs: int
    endings: tuple[tuple[int, int, str], ...]


def solve_design_block(block: DesignBlock, out: Array | None = None) -> SolvedDesigns:
    """Solve a block, in `out` (steps + 1, rows, designs) if that is given. Raises BadInput only for what holds for all
    designs."""
    return _DesignBlockSolver(block, out).solve()


def _count_sentence(said: dict[int, tuple[int, str]], code: int, sentence: str) -> None:
    """One design more of which this is said by a code; the first one's sentence is kept."""
    many, first = said.get(code, (0, sentence))
    said[code] = many + 1, first


class _DesignBlockSolver:
    def __init__(self, block: DesignBlock, out: Array | None):
        self.block, self.out = block, out
        self.reference: ReferenceDesign = reference_design(block.mechanism, block.pair)
        self.design_count = len(next(iter(block.designs.values())))
        self.scale = float(self.reference.input_scale[self.reference.running_index])
        self.all_designs = with_design_values(self.reference.mechanism, block.designs)
        self.u, self.u1, self.u2 = self.reference.inputs(self.all_designs, self.design_count)
        self.u = np.ascontiguousarray(self.u)
        here = self.u[self.reference.running_index] * self.scale
        self.start = here if block.start is None else np.full(self.design_count, float(block.start))
        self.has_own_range = self.reference.is_sliding and block.stop is None
        "whether every design has a range of its own, from limit to limit"
        self.solved_steps = np.full(self.design_count, -1)
        "how many steps are solved of a design that was followed to its end, or to a dead point"
        self.followed_positions = 0
        self.failed_block = np.full(self.design_count, -1)
        "the block that cannot be joined, where a design surely cannot be assembled"
        length = FULL_TURN if block.stop is None else block.stop - self.start
        self.range_length = np.broadcast_to(np.asarray(length, dtype=float), (self.design_count,))

    def solve(self) -> SolvedDesigns:
        """See `solve_design_block`."""
        block = self.block
        status = np.zeros((self.design_count, block.steps + 1), dtype=np.int8)
        grid = np.linspace(0.0, 1.0, block.steps + 1)
        same = np.ptp(self.range_length) == 0.0
        runs = same and not self.has_own_range and self.reference.can_run_backend
        runs = runs and abs(self.range_length[0]) <= LARGEST_INPUT_POSITION  # farther the general path counts turns
        found = self._run_with_backend() if runs else None
        out, good = (self._output_array(), np.zeros(self.design_count, dtype=int)) if found is None else found
        ended = (self.solved_steps >= 0) & (good <= block.steps)
        rest = np.flatnonzero((good <= block.steps) & ~ended)
        alike = same and np.ptp(self.start) == 0.0
        if self.has_own_range:
            inputs = np.full((self.design_count, block.steps + 1), np.nan)
        elif alike:
            inputs = self.start[0] + self.range_length[0] * grid
        else:
            inputs = self.start[:, None] + self.range_length[:, None] * grid
        general, sent, said = (
            self.followed_positions,
            int(ended.sum()),
            {},
        )  # by outcome how many designs, and a sentence
        dead = np.flatnonzero(ended & (self.solved_steps <= block.steps))
        if dead.size:
            code = OUTCOMES.index(Outcome.DEAD_POINT)
            for index in dead:
                out[self.solved_steps[index] :, :, index] = np.nan
                status[index, self.solved_steps[index] :] = code
            first = int(dead[0])
            said[code] = dead.size, self._solve_one_design(first, inputs if alike else inputs[first]).message
        refused: dict[int, SolvedDesign] = {}  # by the block that cannot be joined: the first design says it for all
        for index in rest:
            ends = int(self.failed_block[index])
            row = None if self.has_own_range else inputs if alike else inputs[index]
            told = refused.get(ends) or self._solve_one_design(int(index), row)
            if ends >= 0 and OUTCOMES[told.status[0]] is Outcome.CANNOT_BE_ASSEMBLED:
                refused[ends] = told
            out[:, :, index], status[index] = told.out, told.status
            if self.has_own_range:
                inputs[index] = told.input
            general += int(np.sum(told.status == 0))
            sent += ends < 0
            if told.message:
                _count_sentence(said, int(told.status[-1]), told.message)
            if told.rate_remark:
                _count_sentence(said, OUTCOMES.index(Outcome.SOLVED), told.rate_remark)
        return SolvedDesigns(out, status, inputs, general, sent, tuple((code, *each) for code, each in said.items()))

    def _solve_one_design(self, index: int, grid: Array | None) -> SolvedDesign:
        block = self.block
        mechanism = with_design_values(self.reference.mechanism, values_of_design(block.designs, index))
        if block.assemblies is not None:
            mechanism = self.reference.with_sketch_of(mechanism, block.assemblies[:, index], self.u[:, index])
        ends = (block.start, block.stop) if grid is None else (float(grid[0]), float(grid[-1]))
        return solve_design(mechanism, self.reference.pair, grid, block.steps, ends, block.points, block.rates)

    def _run_with_backend(self) -> tuple[Array, Array] | None:
        """out (m, s), and how many of the first steps passed; None where no backend can run the structure."""
        block, base_, runner = self.block, self.reference, find_runner(self.block.backend)
        shapes = base_.shapes(self.all_designs)
        p = base_.pair_numbers(shapes, self.design_count, self.all_designs)
        told = {name: base_.point_member(name) for name in block.points}
        moving = {name: each for name, each in told.items() if each[0] != base_.mechanism.frame}
        if block.assemblies is None:
            start = find_assemblies(base_, shapes, p, self.u, runner)
        else:
            start = given_assemblies(block.assemblies)
        self.failed_block = start.failed_block
        fit = start.is_sure & base_.is_fit(block.designs, shapes, p)
        fit &= (np.abs(self.u).max(axis=0) <= LARGEST_INPUT_POSITION) & (np.abs(self.start) <= LARGEST_INPUT_POSITION)
        offsets = np.zeros((block.steps + 1, len(self.u)))
        u0 = self.u.copy()
        u0[base_.running_index] = self.start / self.scale
        offsets[:, base_.running_index] = np.linspace(0.0, self.range_length[0] / self.scale, block.steps + 1)
        march = base_.design_batch(shapes, p, (u0, self.u1, self.u2), moving.values(), block.rates)
        march = march._replace(z0=start.z, input_offsets=offsets)
        try:
            march, fit = self._lead_to_start(march, fit)
            out, good = self._run_fit_designs(runner, march, fit)
        except UnsupportedStructure:
            return None
        self._follow_to_dead_points(march, out, good, runner)
        return self._with_frame_points(out, told, shapes), good

    def _output_array(self) -> Array:
        """Where the results stand."""
        block = self.block
        if self.out is None:
            self.out = allocate_aligned(
                block.steps + 1, 2 * len(block.points) * (3 if block.rates else 1), self.design_count
            )
        return self.out

    def _run_fit_designs(self, runner: DesignRunner, march: DesignBatch, fit: Array) -> tuple[Array, Array]:
        """out and good of all designs, of which only the fit ones are run."""
        out = self._output_array()
        if march.output_row_count != out.shape[1]:
            out = allocate_aligned(len(out), march.output_row_count, self.design_count)
        if fit.mean() > RUN_ALL_RATIO:
            return out, np.where(fit, runner.run(march, out), 0)
        some, good = np.flatnonzero(fit), np.zeros(self.design_count, dtype=int)
        if some.size:
            own = allocate_aligned(len(out), march.output_row_count, some.size)
            good[some] = runner.run(march.select(some), own)
            out[:, :, some] = own
        return out, good

    def _follow_to_dead_points(self, march: DesignBatch, out: Array, good: Array, runner: DesignRunner) -> None:
        """Follow those that a backend did not bring to the end, all at once, as far as they come."""
        some = np.flatnonzero((good > 0) & (good < len(march.input_offsets)))
        if not some.size:
            return
        found = follow_to_dead_points(march.select(some), self.reference.running_index, good[some], runner)
        out[found.step, :, some[found.design]] = found.out.T
        settled = some[found.is_settled]
        self.followed_positions = int(found.design.size)
        self.solved_steps[settled] = found.solved_steps[found.is_settled]

    def _lead_to_start(self, march: DesignBatch, fit: Array) -> tuple[DesignBatch, Array]:
        """The same march from the assemblies at its start, to which those at the designs' own positions are led."""
        gone = march.u0 - self.u
        far = float(np.max(np.abs(gone), initial=0.0))
        if far == 0.0:
            return march, fit
        if far > LARGEST_INPUT_POSITION:
            return march, np.zeros_like(fit)
        z, passed = NumpyRunner().lead(march._replace(u0=self.u), gone, LEAD_IN_STEP)
        return march._replace(z0=z), fit & passed

    def _with_frame_points(
        self, out: Array, told: Mapping[PointName, PointMember], shapes: Mapping[str, LinkShape]
    ) -> Array:
        """The rows of all points, those on the frame filled in."""
        frame = self.reference.mechanism.frame
        if all(link != frame for link, _ in told.values()):
            return out
        orders = 3 if self.block.rates else 1
        whole = self._output_array()
        whole[:] = 0.0
        moving = [k for k, (link, _) in enumerate(told.values()) if link != frame]
        for k, (link, point) in enumerate(told.values()):
            if link == frame:
                whole[:, 2 * k], whole[:, 2 * k + 1] = place_in_link(shapes[link], point)
        for order in range(orders):
            for place, k in enumerate(moving):
                old, new = 2 * (order * len(moving) + place), 2 * (order * len(told) + k)
                whole[:, new : new + 2] = out[:, old : old + 2]
        return whole
