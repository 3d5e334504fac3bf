"""One block of a sweep: plain data in, arrays out, so that it may be solved in any process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.closed_form.ends import closed_form_designs, find_ends, run_between_limits
from planar.batch.dead_point_tracking import DEAD_POINT_MARGIN, FollowedDesigns, follow_to_dead_points
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.design_stops import DesignStops
from planar.batch.general_path import OUTCOMES, DesignQuestion
from planar.batch.initial_assembly import find_assemblies, given_assemblies
from planar.batch.march.design_batch import DesignBatch, erase_between, erase_from_steps
from planar.batch.march.runs import lead_designs, run_designs
from planar.batch.march.stops import SAME_END
from planar.batch.reference_design import ReferenceDesign, reference_design
from planar.codegen.llvm_compile import allocate_aligned
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.instruction_list import UnsupportedOperation
from planar.foundation.turns import take_turn
from planar.model.link_shapes import LinkShape, PointMember, PointName, place_in_link
from planar.model.mechanism import LARGEST_INPUT_POSITION, Mechanism

Array = np.ndarray

LEAD_IN_STEP = 0.03
"""rad or sizes a step on the way to where the run starts."""
RUN_ALL_RATIO = 0.3
"""Where more than this part of the designs can be run, all are: those that cannot cost less than a copy of the rest."""
FULL_TURN = 2.0 * np.pi


class DesignBlock(NamedTuple):
    """A block that is to be solved. `designs`: names with an array (designs,) each; `start`, `stop`: see `sweep`.

    `assemblies`: unknowns (unknowns, designs) at the designs' own inputs, where it is not the sketch that chooses; not
    numbers of a design that has no assembly. `dtype`: of the results, which are rounded to it when they are written.
    """

    mechanism: Mechanism
    designs: Mapping[str, Array]
    steps: int
    points: tuple[PointName, ...]
    rates: bool
    start: float | None
    stop: float | None
    pair: str | None
    assemblies: Array | None = None
    dtype: str = "float64"


class SolvedDesigns(NamedTuple):
    """A solved block: out (steps + 1, rows, designs), x and y of every point, then first, then second rates (m, s);
    status (designs, steps + 1); positions of the running input (steps + 1,) or (designs, steps + 1); how many positions
    the general path solved, how many designs it was given; by outcome how many designs ended so, and what is said of
    one, which as text is its sentence: by that of what is solved, how many lack rates, or digits of them. dead_point
    (designs,): where the running input is at the dead point that ends a design (rad, m), not a number where none does;
    stop_position (designs,): the same of the stop that a pair meets.
    """

    out: Array
    status: Array
    input: Array
    general_positions: int
    general_designs: int
    endings: tuple[tuple[int, int, str | DesignQuestion | NoAnswer], ...]
    dead_point: Array
    stop_position: Array


def solve_design_block(block: DesignBlock, out: Array | None = None) -> SolvedDesigns:
    """Solve a block, in `out` (steps + 1, rows, designs) if that is given. Raises BadInput only for what holds for all
    designs."""
    with take_turn():
        return DesignBlockSolver(block, out).solve()


def status_code(outcome: Outcome) -> int:
    """What stands for an outcome in a status."""
    return OUTCOMES.index(outcome)


class DesignBlockSolver:
    """Solves one block, see `solve_design_block`; then `march` is what ran compiled, from where it started."""

    def __init__(self, block: DesignBlock, out: Array | None):
        self.block, self.out = block, out
        self.reference: ReferenceDesign = reference_design(block.mechanism, block.pair)
        self.design_count = len(next(iter(block.designs.values())))
        self.scale = float(self.reference.input_scale[self.reference.running_index])
        self.rows = self.reference.design_rows(block.designs, self.design_count)
        self.u = np.ascontiguousarray(self.rows.u)
        here = self.u[self.reference.running_index] * self.scale
        self.start: Array = here if block.start is None else np.full(self.design_count, float(block.start))
        self.has_own_range = self.reference.is_sliding and block.stop is None
        "whether every design has a range of its own, from limit to limit"
        self.solved_steps = np.full(self.design_count, -1)
        "how many steps are solved of a design that was followed to its end, or to a dead point"
        self.general_positions, self.followed_designs = 0, 0
        self.endings: dict[int, tuple[int, str | DesignQuestion | NoAnswer]] = {}
        self.dead_point, self.stop_position = np.full((2, self.design_count), np.nan)
        self.stops: DesignStops | None = None
        self.is_stopped = np.zeros(self.design_count, dtype=bool)
        "which designs are ended by a stop, of those that were followed"
        self.limits = np.full((2, self.design_count), np.nan)
        "between which inputs run that have a range of their own, rad or sizes"
        self.failed_block = np.full(self.design_count, -1)
        "the block that cannot be joined, where a design surely cannot be assembled"
        length = FULL_TURN if block.stop is None else block.stop - self.start
        self.range_length: Array = np.broadcast_to(length, self.start.shape)
        self.march: DesignBatch | None = None

    def solve(self) -> SolvedDesigns:
        """See `solve_design_block`."""
        block = self.block
        same = bool(np.ptp(self.range_length) == 0.0)
        # farther the general path counts turns
        runs = self.reference.can_be_compiled and np.abs(self.range_length).max() <= LARGEST_INPUT_POSITION
        runs = runs and (block.start is None or (same and not self.has_own_range))
        found = self._run_compiled(same and not self.has_own_range) if runs else None
        out, good = found or (self._output_array(), np.zeros(self.design_count, dtype=int))
        if found is None:
            out[:] = np.nan
        ended = (self.solved_steps >= 0) & (good <= block.steps)
        solved, code = np.where(ended, self.solved_steps, good), np.zeros(self.design_count, dtype=np.int8)
        code[ended & (solved <= block.steps)] = status_code(Outcome.DEAD_POINT)
        code[ended & (solved <= block.steps) & self.is_stopped] = status_code(Outcome.STOP)
        failed = ~ended & (good == 0) & (self.failed_block >= 0)
        code[failed] = status_code(Outcome.CANNOT_BE_ASSEMBLED)
        if any(self.reference.point_member(name)[0] == self.reference.mechanism.frame for name in block.points):
            erase_from_steps(out, solved)
        rest = np.flatnonzero((good <= block.steps) & ~ended & ~failed).tolist()
        if rest or code.any():
            # no wider than steps are counted: of all positions
            counter = np.min_scalar_type(-block.steps - 2)
            status = (np.arange(block.steps + 1).astype(counter) >= solved.astype(counter)[:, None]).view(np.int8)
            status *= code[:, None]
        else:
            # one number for all, which takes no room
            status = np.broadcast_to(np.int8(0), (self.design_count, block.steps + 1))
        inputs = self._input_positions(same)
        self.endings = {
            int(each): (int(np.sum(code == each)), self._question(int(np.argmax(code == each)), inputs))
            for each in np.unique(code[code != 0])
        }
        for index in rest:
            self._solve_alone(index, out, status, inputs)
        many, ends = (self.general_positions, len(rest) + self.followed_designs), (self.dead_point, self.stop_position)
        return SolvedDesigns(out, status, inputs, *many, tuple((k, *said) for k, said in self.endings.items()), *ends)

    def _input_positions(self, same: bool) -> Array:
        """Where the running input is at each step (steps + 1,), or (designs, steps + 1); unknown yet of own ranges."""
        grid = np.linspace(0.0, 1.0, self.block.steps + 1)
        if self.has_own_range:
            low, high = self.limits * self.scale
            return np.asarray(low[:, None] + (high - low)[:, None] * grid)
        if same and np.ptp(self.start) == 0.0:
            return np.asarray(self.start[0] + self.range_length[0] * grid)
        return np.asarray(self.start[:, None] + self.range_length[:, None] * grid)

    def _question(self, index: int, inputs: Array) -> DesignQuestion:
        """A design, and the range that it is to run."""
        block, mechanism, values = self.block, self.reference.mechanism, values_of_design(self.block.designs, index)
        if block.assemblies is not None:
            design = with_design_values(mechanism, values)
            mechanism = self.reference.with_sketch_of(design, block.assemblies[:, index], self.u[:, index])
            values = {}
        grid = None if self.has_own_range else inputs if inputs.ndim == 1 else inputs[index]
        ends = (block.start, block.stop) if grid is None else (float(grid[0]), float(grid[-1]))
        return DesignQuestion(mechanism, values, self.reference.pair, grid, block.steps, ends)

    def _solve_alone(self, index: int, out: Array, status: Array, inputs: Array) -> None:
        """Solve a design by the general path."""
        told = self._question(index, inputs).solve(self.block.points, self.block.rates)
        out[:, :, index], status[index], self.dead_point[index] = told.out, told.status, told.dead_point
        self.stop_position[index] = told.stop_position
        if self.has_own_range:
            inputs[index] = told.input
        self.general_positions += int(np.sum(told.status == 0))
        self._count_sentence(int(told.status[-1]), told.message)
        self._count_sentence(status_code(Outcome.SOLVED), told.rate_remark)

    def _count_sentence(self, code: int, sentence: str | NoAnswer) -> None:
        """Count a design with a sentence for a code; the sentence of the first design is kept."""
        if sentence:
            count, first = self.endings.get(code, (0, sentence))
            self.endings[code] = count + 1, first

    def _run_compiled(self, is_common: bool) -> tuple[Array, Array] | None:
        """Return out (m, s) and the number of first steps that passed (designs,); None where the structure cannot be
        compiled. `is_common`: all designs run over ranges of equal length."""
        block, reference, shapes, p = self.block, self.reference, self.rows.shapes, self.rows.p
        members = {name: reference.point_member(name) for name in block.points}
        moving = [member for member in members.values() if member[0] != reference.mechanism.frame]
        if block.assemblies is None:
            start = find_assemblies(reference, shapes, p, self.u)
        else:
            start = given_assemblies(block.assemblies)
        self.failed_block = start.failed_block
        fit = start.is_sure & self.rows.is_fit & ~reference.is_unfit(block.designs, shapes)
        fit &= (np.abs(self.u).max(axis=0) <= LARGEST_INPUT_POSITION) & (np.abs(self.start) <= LARGEST_INPUT_POSITION)
        offsets = np.zeros((block.steps + 1, len(self.u)))
        u0 = self.u.copy()
        u0[reference.running_index] = self.start / self.scale
        offsets[:, reference.running_index] = np.linspace(0.0, self.range_length[0] / self.scale, block.steps + 1)
        march = reference.design_batch(shapes, p, (u0, self.rows.u1, self.rows.u2), moving, block.rates)
        march = march._replace(z0=start.z, signs=start.signs, input_offsets=offsets)
        if reference.mechanism.stops:
            march = self._watch_stops(march, fit)
        try:
            if not is_common:
                out = self._run_own_ranges(march, fit, start.signs)
                return None if out is None else (self._with_frame_points(out, members, shapes), np.zeros(len(fit), int))
            march, fit = self._lead_to_start(march, fit, start.signs)
            fit = fit if self.stops is None else fit & self.stops.have_room(march, self.range_length)
            out, good, candidates = self._run_fit_designs(march, fit)
            self._end_at_input_stops(march, good, candidates)
        except UnsupportedOperation:
            return None
        self._follow_to_dead_points(march, out, (good, candidates), start.signs)
        erase_between(out, np.where(self.solved_steps >= 0, self.solved_steps, good), candidates)
        return self._with_frame_points(out, members, shapes), good

    def _watch_stops(self, march: DesignBatch, fit: Array) -> DesignBatch:
        """The march with the stops of its pairs; designs that start outside of them end there, others may be unfit."""
        designs = with_design_values(self.reference.mechanism, self.block.designs)
        self.stops = DesignStops(self.reference, designs, self.u)
        self.stops.watch_start(march, self.u)
        outside = fit & self.stops.is_outside
        self.solved_steps[outside], self.is_stopped[outside] = 0, True
        fit &= self.stops.is_fit & ~outside
        return march._replace(stops=self.stops.limits)

    def _end_at_input_stops(self, march: DesignBatch, good: Array, candidates: Array) -> None:
        """End designs at a stop of the input that runs, beyond which they would have gone on."""
        if self.stops is None:
            return
        input_stops = self.stops.find_input_stops(march, self.range_length)
        stopped = np.flatnonzero((good > input_stops.solved_steps) & input_stops.is_clear)
        candidates[:] = np.maximum(candidates, good)
        np.minimum(good, input_stops.solved_steps, out=good)
        self.solved_steps[stopped] = input_stops.solved_steps[stopped]
        self._keep_ends(stopped, input_stops.distance[stopped], np.ones(stopped.size, dtype=bool))

    def _run_own_ranges(self, march: DesignBatch, fit: Array, signs: Array | None) -> Array | None:
        """Return out of designs whose ranges differ; None where a block is not in closed form."""
        fit = fit if self.stops is None or self.has_own_range else fit & self.stops.have_room(march, self.range_length)
        chosen = np.flatnonzero(fit & (self.range_length != 0.0))
        chosen_signs = None if signs is None else signs[:, chosen]
        designs = closed_form_designs(march.select(chosen), self.reference.running_index, chosen_signs)
        if designs is None:
            return None
        out = self._own_output(march)
        out[:] = np.nan
        if not self.has_own_range:
            lengths, none = self.range_length[chosen] / self.scale, np.zeros(chosen.size, dtype=int)
            self._settle(chosen, find_ends(designs, lengths, none, none, self.block.steps), out)
            return out
        runs = run_between_limits(designs, self.block.steps)
        self.limits[:, chosen] = runs.limits
        settled = chosen[runs.is_settled]
        out[:, :, settled] = runs.out[:, :, runs.is_settled]
        self.solved_steps[settled] = len(out)
        return out

    def _own_output(self, march: DesignBatch) -> Array:
        """The array that a march fills: without the points on the frame."""
        out = self._output_array()
        if march.output_row_count == out.shape[1]:
            return out
        return allocate_aligned(len(out), march.output_row_count, self.design_count, out.dtype)

    def _output_array(self) -> Array:
        """The array of all results."""
        block = self.block
        if self.out is None:
            rows = 2 * len(block.points) * (3 if block.rates else 1)
            self.out = allocate_aligned(block.steps + 1, rows, self.design_count, block.dtype)
        return self.out

    def _run_fit_designs(self, march: DesignBatch, fit: Array) -> tuple[Array, Array, Array]:
        """out, good and candidates of all designs, of which only the fit ones are run."""
        out, candidates = self._own_output(march), np.zeros(self.design_count, dtype=int)
        self.march, march.u0[:, ~fit] = march, np.nan
        steps = len(out) if self.stops is None else self.stops.needed_steps(march, self.range_length, fit)
        needed = march._replace(input_offsets=march.input_offsets[:steps])
        out[steps:] = np.nan
        if fit.mean() > RUN_ALL_RATIO:
            # where all designs are fit, few end early
            return out, run_designs(needed, out[:steps], None if fit.all() else candidates), candidates
        out[:] = np.nan
        chosen, good = np.flatnonzero(fit), np.zeros(self.design_count, dtype=int)
        if chosen.size:
            rows, chosen_candidates = (
                allocate_aligned(steps, march.output_row_count, chosen.size, out.dtype),
                good[chosen],
            )
            good[chosen] = run_designs(needed.select(chosen), rows, chosen_candidates)
            out[:steps, :, chosen], candidates[chosen] = rows, chosen_candidates
        return out, good, candidates

    def _follow_to_dead_points(
        self,
        march: DesignBatch,
        out: Array,
        counts: tuple[Array, Array],
        signs: Array | None,
    ) -> None:
        """Follow the designs that compiled code did not bring to the end, all at once, to their ends.

        counts: the numbers of good steps and of candidates of each design (designs,).
        """
        good, candidates = counts
        open_ = np.flatnonzero((good > 0) & (good < len(march.input_offsets)) & (self.solved_steps < 0))
        if not open_.size:
            return
        index = self.reference.running_index
        open_signs = None if signs is None else signs[:, open_]
        designs = closed_form_designs(march.select(open_), index, open_signs)
        if designs is not None:
            lengths = self.range_length[open_] / self.scale
            ends = find_ends(designs, lengths, good[open_], np.maximum(good, candidates)[open_], self.block.steps)
            self._settle(open_, ends, out)
            open_ = open_[~ends.is_settled]
        if open_.size:
            followed = follow_to_dead_points(march.select(open_), index, good[open_])
            self._settle(open_, followed, out)
            self.general_positions += int(followed.design.size)
            self.followed_designs += int(followed.is_settled.sum())

    def _settle(self, designs: Array, followed: FollowedDesigns, out: Array) -> None:
        """Store the positions of followed designs and where they end."""
        out[followed.step, :, designs[followed.design]] = followed.out.T
        is_settled = followed.is_settled
        settled = designs[is_settled]
        self.solved_steps[settled] = followed.solved_steps[is_settled]
        self._keep_ends(settled, followed.distance[is_settled], followed.stop[is_settled] >= 0)

    def _keep_ends(self, settled: Array, distance: Array, is_stopped: Array) -> None:
        """Keep where designs end (designs,), rad or sizes from their start: at dead points, or at stops."""
        position = self.start[settled] + np.sign(self.range_length[settled]) * distance * self.scale
        ended = self.solved_steps[settled] <= self.block.steps
        self.dead_point[settled] = np.where(ended & ~is_stopped, position, np.nan)
        self.stop_position[settled] = np.where(ended & is_stopped, position, np.nan)
        self.is_stopped[settled] = is_stopped

    def _lead_to_start(self, march: DesignBatch, fit: Array, signs: Array | None) -> tuple[DesignBatch, Array]:
        """Lead the assemblies at the designs' own inputs to where the march starts; return the march from there, and
        which designs arrived (designs,)."""
        offset = march.u0 - self.u
        longest = float(np.max(np.abs(offset), initial=0.0))
        if longest == 0.0:
            return march, fit
        if longest > LARGEST_INPUT_POSITION:
            return march, np.zeros_like(fit)
        index, chosen = self.reference.running_index, np.flatnonzero(fit)
        origin = march._replace(u0=self.u).select(chosen)
        chosen_signs = None if signs is None else signs[:, chosen]
        designs, arrived = closed_form_designs(origin, index, chosen_signs), np.zeros_like(fit)
        span = offset[index, chosen]
        if designs is not None:
            z, ends = designs.lead(span, LEAD_IN_STEP)
            room = ends.distance - np.abs(span)
            dead = np.isfinite(ends.distance) & (-room > DEAD_POINT_MARGIN * np.abs(span))
            self.solved_steps[chosen[dead]] = 0
            self.is_stopped[chosen[dead]] = designs.stops_of(ends)[dead] >= 0
            arrived[chosen] = room > DEAD_POINT_MARGIN * np.abs(span)
        else:
            z, arrived[chosen] = lead_designs(origin, index, span, LEAD_IN_STEP)
            if march.stops is not None:
                arrived &= march.stops.input_rooms(self.u[index], offset[index]) >= np.abs(offset[index]) - SAME_END
        march.z0[:, chosen] = z
        return march, arrived

    def _with_frame_points(
        self, out: Array, members: Mapping[PointName, PointMember], shapes: Mapping[str, LinkShape]
    ) -> Array:
        """The rows of all points, those on the frame filled in."""
        frame = self.reference.mechanism.frame
        if all(link != frame for link, _ in members.values()):
            return out
        every = self._output_array()
        every[:] = 0.0
        for k, (link, point) in enumerate(members.values()):
            if link == frame:
                every[:, 2 * k], every[:, 2 * k + 1] = place_in_link(shapes[link], point)
        moving = [k for k, (link, _) in enumerate(members.values()) if link != frame]
        orders = every.reshape(len(out), -1, len(members), 2, self.design_count)
        orders[:, :, moving] = out.reshape(len(out), -1, len(moving), 2, self.design_count)
        return every
