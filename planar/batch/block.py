"""One block of a sweep: plain data in, arrays out, so that it may be solved in any process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.design_arrays import design_variables, split_into_blocks, values_of_design, with_design_values
from planar.batch.design_ends import (
    DEAD_POINT_MARGIN,
    STEPS_BEYOND_STOP,
    FollowedDesigns,
    closed_form_designs,
    find_input_stops,
    follow_to_dead_points,
    watch_stops,
)
from planar.batch.general_path import DesignRun
from planar.batch.initial_assembly import find_assemblies, given_assemblies
from planar.batch.march.design_batch import DesignBatch, erase_between, erase_from_steps
from planar.batch.march.runs import lead_designs, run_designs
from planar.batch.march.stops import SAME_END
from planar.batch.mechanisms.linkages import SweepRequest
from planar.batch.mechanisms.part_runs import solve_part
from planar.batch.reference_design import ReferenceDesign, reference_design
from planar.codegen.llvm_compile import allocate_aligned
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import LinkShape, PointMember, PointName, place_in_link
from planar.model.mechanism import LARGEST_INPUT_POSITION, Mechanism
from planar.solving.samples import input_law_rates

Array = np.ndarray

LEAD_IN_STEP = 0.03
"""rad or sizes a step on the way to where the run starts."""
MAX_TAPED_DESIGNS = 256
"""Designs that are solved block after block at once."""
RUN_ALL_RATIO = 0.3
"""Where more than this part of the designs can be run, all are: those that cannot cost less than a copy of the rest."""
FULL_TURN = 2.0 * np.pi
MAX_JOINED_LINKS = 60
"""Links of mechanisms whose equations are compiled together: larger ones are solved block after block."""


class DesignBlock(NamedTuple):
    """A block that is to be solved. `designs`: names with an array (designs,) each; `start`, `stop`: see `sweep`.

    `assemblies`: unknowns (unknowns, designs) at the designs' own inputs, where it is not the sketch that chooses; not
    numbers of a design that has no assembly. `dtype`: of the results, which are rounded to it when they are written.
    `duration`: how long (s) a run in time takes, None where one input runs over a range.
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
    duration: float | None = None

    @property
    def design_count(self) -> int:
        """How many designs there are."""
        return len(next(iter(self.designs.values())))

    @property
    def time(self) -> Array:
        """The times (steps + 1,) of a run in time, s."""
        assert self.duration is not None
        return np.linspace(0.0, self.duration, self.steps + 1)

    def select(self, which: slice | Array) -> DesignBlock:
        """Some of the designs."""
        designs = {name: value[which] for name, value in self.designs.items()}
        z = None if self.assemblies is None else self.assemblies[:, which]
        return self._replace(designs=designs, assemblies=z)

    def reference(self) -> ReferenceDesign:
        """What the designs have in common."""
        return reference_design(self.mechanism, self.pair, self.duration is not None)

    def single_design(self, index: int) -> Mechanism:
        """One design, with a sketch of its assembly where that is given."""
        reference = self.reference()
        design = with_design_values(reference.mechanism, values_of_design(self.designs, index))
        if self.assemblies is None:
            return design
        u = reference.design_rows(self.designs, self.design_count).u[:, index]
        return reference.with_sketch_of(design, self.assemblies[:, index], u)

    @property
    def has_own_ranges(self) -> bool:
        """Whether every design has a range of its own, from limit to limit."""
        return self.reference().is_sliding and self.stop is None and self.duration is None

    def design_run(self, index: int, inputs: Array) -> DesignRun:
        """One design, and the range or the time that it is to run; `inputs` as of `SolvedDesigns`."""
        reference = self.reference()
        mechanism, values = reference.mechanism, values_of_design(self.designs, index)
        if self.assemblies is not None:
            mechanism, values = self.single_design(index), {}
        grid = None if self.has_own_ranges else inputs if inputs.ndim == 1 else inputs[index]
        return DesignRun(mechanism, reference.pair, grid, self.steps, values, self.start, self.duration)


class SolvedDesigns(NamedTuple):
    """A solved block: out (steps + 1, rows, designs), x and y of every point, then first, then second rates (m, s);
    status (designs, steps + 1); positions of the running input (steps + 1,) or (designs, steps + 1), times (steps + 1,)
    of a run in time; how many positions the general path solved, how many designs it was given; by outcome how many
    designs ended so, and what is said of one, which as text is its sentence: by that of what is solved, how many lack
    rates, or digits of them. dead_point (designs,): where the running input is at the dead point that ends a design
    (rad, m), not a number where none does, nor in time; stop_position (designs,): the same of the stop that a pair
    meets.
    """

    out: Array
    status: Array
    input: Array
    general_positions: int
    general_designs: int
    endings: tuple[tuple[int, int, str | DesignRun | NoAnswer], ...]
    dead_point: Array
    stop_position: Array


def input_motions(mechanism: Mechanism, block: DesignBlock, time: Array) -> Array:
    """Positions, first and second rates of the inputs (3, inputs, steps + 1, designs) of designs at times (steps + 1,)
    (SI)."""
    variables = design_variables(mechanism)
    of_inputs = {name: value for name, value in block.designs.items() if variables[name].path[0] == "inputs"}
    designs = [
        with_design_values(mechanism, values_of_design(of_inputs, index))
        for index in range(block.design_count if of_inputs else 1)
    ]
    rates = np.array([[input_law_rates(driven, time)[:3] for driven in design.inputs] for design in designs])
    rates = rates.transpose(2, 1, 3, 0)
    return np.broadcast_to(rates, (*rates.shape[:3], block.design_count))


class DesignBlockSolver:
    """Solves one block, in `out` (steps + 1, rows, designs) if that is given; then `march` is what ran compiled over a
    range, from where it started.

    One input runs over a range, or all run in time by their laws. Raises BadInput only for what holds for all designs.
    """

    def __init__(self, block: DesignBlock, out: Array | None):
        self.block, self.out = block, out
        self.reference, self.design_count = block.reference(), block.design_count
        self.scale = float(self.reference.input_scale[self.reference.running_index])
        self.rows = self.reference.design_rows(block.designs, self.design_count)
        self.start: Array = self.rows.u[self.reference.running_index] * self.scale
        if block.start is not None:
            self.start = np.full(self.design_count, float(block.start))
        self.has_own_range = block.has_own_ranges
        self.solved_steps = np.full(self.design_count, -1)
        "how many steps are solved of a design whose end is known"
        self.ends = np.full((2, self.design_count), np.nan)
        "where the running input is at the dead point that ends a design, and at the stop"
        self.is_stopped = np.zeros(self.design_count, dtype=bool)
        "which designs are ended by a stop, of those whose end is known"
        self.general_positions, self.followed_designs = 0, 0
        self.endings: dict[int, tuple[int, str | DesignRun | NoAnswer]] = {}
        self.limits = np.full((2, self.design_count), np.nan)
        "between which inputs run that have a range of their own, rad or sizes"
        self.failed_block = np.full(self.design_count, -1)
        "the block that cannot be joined, where a design surely cannot be assembled"
        length = FULL_TURN if block.stop is None else block.stop - self.start
        self.range_length: Array = np.broadcast_to(length, self.start.shape)
        self.has_common_length = bool(np.ptp(self.range_length) == 0.0)
        self.has_common_range = self.has_common_length and not self.has_own_range
        "whether one range serves all designs"
        self.march: DesignBatch | None = None

    def solve(self) -> SolvedDesigns:
        """Solve the block: compiled as far as the checks let designs pass, all others by the general path."""
        block = self.block
        compiled = self._run_compiled() if self._can_be_compiled() else None
        out, good = compiled or (self._output_array(), np.zeros(self.design_count, dtype=int))
        if compiled is None:
            out[:] = np.nan
        ended = (self.solved_steps >= 0) & (good <= block.steps)
        solved, code = np.where(ended, self.solved_steps, good), np.zeros(self.design_count, dtype=np.int8)
        code[ended & (solved <= block.steps)] = Outcome.DEAD_POINT.code
        code[ended & (solved <= block.steps) & self.is_stopped] = Outcome.STOP.code
        failed = ~ended & (good == 0) & (self.failed_block >= 0)
        code[failed] = Outcome.CANNOT_BE_ASSEMBLED.code
        if any(self.reference.point_member(name)[0] == self.reference.mechanism.frame for name in block.points):
            erase_from_steps(out, solved)
        rest = np.flatnonzero((good <= block.steps) & ~ended & ~failed).tolist()
        shape, early = (self.design_count, block.steps + 1), np.flatnonzero(code)
        # one number for all where there is no other, which takes no room
        status: Array = np.zeros(shape, np.int8) if rest or early.size else np.broadcast_to(np.int8(0), shape)
        if early.size:
            # no wider than steps are counted: of all positions
            counter = np.min_scalar_type(-block.steps - 2)
            is_beyond = np.arange(block.steps + 1).astype(counter) >= solved[early].astype(counter)[:, None]
            status[early] = is_beyond.view(np.int8) * code[early, None]
        inputs = self._input_positions()
        self.endings = {
            number: (count, block.design_run(int(np.argmax(code == number)), inputs))
            for number, count in enumerate(np.bincount(code).tolist())
            if number and count
        }
        left = self._solve_by_blocks(rest, out)
        for index in left:
            self._solve_alone(index, out, status, inputs)
        counts = self.general_positions, len(left) + self.followed_designs
        endings = tuple((number, *ending) for number, ending in self.endings.items())
        return SolvedDesigns(out, status, inputs, *counts, endings, *self.ends)

    def _can_be_compiled(self) -> bool:
        """Whether designs may run compiled, as far as the mechanism and the range tell."""
        reference, block = self.reference, self.block
        if not reference.can_be_compiled or len(reference.mechanism.links) > MAX_JOINED_LINKS:
            return False
        if block.duration is not None:
            return not reference.mechanism.stops
        # farther the general path counts turns
        is_counted = np.abs(self.range_length).max() <= LARGEST_INPUT_POSITION
        return bool(is_counted and (block.start is None or self.has_common_range))

    def _input_positions(self) -> Array:
        """Where the running input is at each step (steps + 1,), or (designs, steps + 1); unknown yet of own ranges. The
        times of a run in time."""
        if self.block.duration is not None:
            return self.block.time
        grid = np.linspace(0.0, 1.0, self.block.steps + 1)
        if self.has_own_range:
            low, high = self.limits * self.scale
            return np.asarray(low[:, None] + (high - low)[:, None] * grid)
        if self.has_common_length and np.ptp(self.start) == 0.0:
            return np.asarray(self.start[0] + self.range_length[0] * grid)
        return np.asarray(self.start[:, None] + self.range_length[:, None] * grid)

    def _solve_by_blocks(self, designs: list[int], out: Array) -> list[int]:
        """Solve designs as `sweep_each` does, whose functions are compiled for types of blocks; the designs that are
        left: those that it does not decide, or that do not come to the end."""
        block = self.block
        if (
            block.duration is not None
            or block.start is not None
            or self.reference.is_sliding
            or not self.has_common_range
        ):
            return designs
        request = SweepRequest(block.steps, block.points, block.rates, block.pair, float(self.range_length[0]))
        left: list[int] = []
        for part in split_into_blocks(len(designs), MAX_TAPED_DESIGNS):
            indices = designs[part]
            solved = solve_part([block.single_design(k) for k in indices], request, uses_general_path=False)
            is_whole, steps = solved.endings.solved > block.steps, block.steps + 1
            rows = solved.values[:, :, :steps].reshape(len(indices), len(block.points), -1, 2, steps)[is_whole]
            out[:, :, np.array(indices)[is_whole]] = rows.transpose(4, 2, 1, 3, 0).reshape(*out.shape[:2], len(rows))
            left += [k for k, is_solved in zip(indices, is_whole.tolist(), strict=True) if not is_solved]
        return left

    def _solve_alone(self, index: int, out: Array, status: Array, inputs: Array) -> None:
        """Solve a design by the general path."""
        solved = self.block.design_run(index, inputs).solve(self.block.points, self.block.rates)
        out[:, :, index], status[index] = solved.out, solved.status
        self.ends[:, index] = solved.dead_point, solved.stop_position
        if self.has_own_range:
            inputs[index] = solved.input
        self.general_positions += int(np.sum(solved.status == 0))
        self._count_sentence(int(solved.status[-1]), solved.message)
        self._count_sentence(Outcome.SOLVED.code, solved.rate_remark)

    def _count_sentence(self, code: int, sentence: str | NoAnswer) -> None:
        """Count a design with a sentence for a code; the sentence of the first design is kept."""
        if sentence:
            count, first = self.endings.get(code, (0, sentence))
            self.endings[code] = count + 1, first

    def _run_compiled(self) -> tuple[Array, Array] | None:
        """Return out (m, s) and the number of first steps that passed (designs,); None where the structure cannot be
        compiled."""
        block, reference, shapes = self.block, self.reference, self.rows.shapes
        members = {name: reference.point_member(name) for name in block.points}
        moving = [member for member in members.values() if member[0] != reference.mechanism.frame]
        if block.assemblies is None:
            start = find_assemblies(reference, self.rows)
        else:
            start = given_assemblies(block.assemblies)
        if block.duration is None:  # in time the general path says where inputs start by their laws
            self.failed_block = start.failed_block
        fit = start.is_sure & self.rows.is_fit & ~reference.is_unfit(block.designs, shapes)
        march = reference.design_batch(self.rows, moving, block.rates)._replace(z0=start.z, signs=start.signs)
        try:
            run = self._run_over_range if block.duration is None else self._run_in_time
            out, good = run(march, fit)
        except UnsupportedOperation:
            return None
        return self._with_frame_points(out, members, shapes), good

    def _run_in_time(self, march: DesignBatch, fit: Array) -> tuple[Array, Array]:
        """out and good of a run in time: designs whose inputs move alike go side by side where only positions are
        wanted, or where all inputs keep their speed. Raises UnsupportedOperation."""
        block, reference = self.block, self.reference
        u, u1, u2 = input_motions(reference.mechanism, block, block.time) / reference.input_scale[:, None, None]
        fit &= np.abs(u).max(axis=(0, 1)) <= LARGEST_INPUT_POSITION
        if block.rates:
            fit &= np.all((np.ptp(u1, axis=1) == 0.0) & np.all(u2 == 0.0, axis=1), axis=0)
        march = march._replace(u0=u[:, 0], u1=u1[:, 0], u2=u2[:, 0], signs=None)
        offsets = (u - u[:, :1]).transpose(1, 0, 2)  # (steps + 1, inputs, designs)
        out, counts = self._own_output(march), np.zeros((2, self.design_count), dtype=int)
        out[:] = np.nan
        chosen = np.flatnonzero(fit)
        if chosen.size:
            columns = offsets[:, :, chosen].reshape(-1, chosen.size)
            courses = np.unique(columns, axis=1, return_inverse=True)[1].ravel()
            for course in range(int(courses.max()) + 1):
                alike = chosen[courses == course]
                course_offsets = np.ascontiguousarray(offsets[:, :, alike[0]])
                self._run_selected(march._replace(input_offsets=course_offsets), alike, out, counts)
        return out, counts[0]

    def _run_over_range(self, march: DesignBatch, fit: Array) -> tuple[Array, Array]:
        """out and good where one input runs over a range. Raises UnsupportedOperation."""
        index, u, lengths = self.reference.running_index, self.rows.u, self.range_length
        fit &= (np.abs(u).max(axis=0) <= LARGEST_INPUT_POSITION) & (np.abs(self.start) <= LARGEST_INPUT_POSITION)
        offsets = np.zeros((self.block.steps + 1, len(u)))
        u0 = u.copy()
        u0[index] = self.start / self.scale
        offsets[:, index] = np.linspace(0.0, lengths[0] / self.scale, self.block.steps + 1)
        march = march._replace(u0=u0, input_offsets=offsets)
        if self.reference.mechanism.stops:
            designs = with_design_values(self.reference.mechanism, self.block.designs)
            limits, is_inside, is_outside = watch_stops(self.reference, designs, march, u)
            outside = fit & is_outside
            self.solved_steps[outside], self.is_stopped[outside] = 0, True
            fit &= is_inside & ~outside
            march = march._replace(stops=limits)
        if not self.has_common_range:
            return self._run_own_ranges(march, fit), np.zeros(self.design_count, dtype=int)
        march, fit = self._lead_to_start(march, fit)
        if march.stops is None:
            out, good, candidates = self._run_fit_designs(march, fit, len(offsets))
        else:
            fit &= march.stops.have_room(march.u0[index], lengths)
            distance, solved, is_clear = find_input_stops(march, index, lengths)
            needed = int(solved[fit].max(initial=1)) + STEPS_BEYOND_STOP
            out, good, candidates = self._run_fit_designs(march, fit, min(needed, len(offsets)))
            stopped = np.flatnonzero((good > solved) & is_clear)
            np.maximum(candidates, good, out=candidates)
            np.minimum(good, solved, out=good)
            self._end_designs(stopped, solved[stopped], distance[stopped], np.ones(stopped.size, dtype=bool))
        self._find_ends(march, out, good, candidates)
        erase_between(out, np.where(self.solved_steps >= 0, self.solved_steps, good), candidates)
        return out, good

    def _run_own_ranges(self, march: DesignBatch, fit: Array) -> Array:
        """Return out of designs whose ranges differ. Raises UnsupportedOperation where a block is not in closed
        form."""
        index = self.reference.running_index
        if march.stops is not None and not self.has_own_range:
            fit = fit & march.stops.have_room(march.u0[index], self.range_length)
        chosen = np.flatnonzero(fit & (self.range_length != 0.0))
        designs = closed_form_designs(march.select(chosen), index)
        if designs is None:
            raise UnsupportedOperation("a block is not in closed form")
        out = self._own_output(march)
        out[:] = np.nan
        if self.has_own_range:
            self.limits[:, chosen], rows = designs.run_between_limits(self.block.steps)
            settled = np.isfinite(self.limits[0, chosen])
            out[:, :, chosen[settled]] = rows[:, :, settled]
            self.solved_steps[chosen[settled]] = len(out)
        else:
            lengths, none = self.range_length[chosen] / self.scale, np.zeros(chosen.size, dtype=int)
            self._settle(chosen, designs.follow_to_ends(lengths, none, none, self.block.steps), out)
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

    def _run_fit_designs(self, march: DesignBatch, fit: Array, steps: int) -> tuple[Array, Array, Array]:
        """out, good and candidates of all designs, of which only the fit ones are run, so many steps."""
        out, candidates = self._own_output(march), np.zeros(self.design_count, dtype=int)
        self.march, march.u0[:, ~fit] = march, np.nan
        needed = march._replace(input_offsets=march.input_offsets[:steps])
        out[steps:] = np.nan
        if fit.mean() > RUN_ALL_RATIO:
            # where all designs are fit, few end early
            return out, run_designs(needed, out[:steps], None if fit.all() else candidates), candidates
        out[:] = np.nan
        chosen, counts = np.flatnonzero(fit), np.zeros((2, self.design_count), dtype=int)
        if chosen.size:
            self._run_selected(needed, chosen, out, counts)
        return out, *counts

    @staticmethod
    def _run_selected(march: DesignBatch, chosen: Array, out: Array, counts: Array) -> None:
        """Run some designs of a march, and put their rows and counts among those of all: out, and counts (2, designs)
        of the good steps and of the candidates."""
        rows = allocate_aligned(len(march.input_offsets), march.output_row_count, chosen.size, out.dtype)
        candidates = np.zeros(chosen.size, dtype=int)
        counts[0, chosen] = run_designs(march.select(chosen), rows, candidates)
        out[: len(rows), :, chosen], counts[1, chosen] = rows, candidates

    def _find_ends(self, march: DesignBatch, out: Array, good: Array, candidates: Array) -> None:
        """Follow the designs that compiled code did not bring to the end, all at once, to their ends.

        good and candidates: the numbers of steps of each design (designs,).
        """
        remaining = np.flatnonzero((good > 0) & (good < len(march.input_offsets)) & (self.solved_steps < 0))
        if not remaining.size:
            return
        index = self.reference.running_index
        designs = closed_form_designs(march.select(remaining), index)
        if designs is not None:
            lengths, first = self.range_length[remaining] / self.scale, np.maximum(good, candidates)[remaining]
            ends = designs.follow_to_ends(lengths, good[remaining], first, self.block.steps)
            self._settle(remaining, ends, out)
            remaining = remaining[~ends.is_settled]
        if remaining.size:
            followed = follow_to_dead_points(march.select(remaining), index, good[remaining])
            self._settle(remaining, followed, out)
            self.general_positions += int(followed.design.size)
            self.followed_designs += int(followed.is_settled.sum())

    def _settle(self, designs: Array, followed: FollowedDesigns, out: Array) -> None:
        """Store the positions of followed designs and where they end."""
        out[followed.step, :, designs[followed.design]] = followed.out.T
        solved, distance, is_stopped = (
            rows[followed.is_settled] for rows in (followed.solved_steps, followed.distance, followed.is_stopped)
        )
        self._end_designs(designs[followed.is_settled], solved, distance, is_stopped)

    def _end_designs(self, designs: Array, solved: Array, distance: Array, is_stopped: Array) -> None:
        """Store how many steps of designs are solved, and where they end, rad or sizes from their start: at dead
        points, or at stops."""
        position = self.start[designs] + np.sign(self.range_length[designs]) * distance * self.scale
        self.ends[is_stopped.astype(int), designs] = np.where(solved <= self.block.steps, position, np.nan)
        self.solved_steps[designs], self.is_stopped[designs] = solved, is_stopped

    def _lead_to_start(self, march: DesignBatch, fit: Array) -> tuple[DesignBatch, Array]:
        """Lead the assemblies at the designs' own inputs to where the march starts; return the march from there, and
        which designs arrived (designs,)."""
        offset = march.u0 - self.rows.u
        longest = float(np.max(np.abs(offset), initial=0.0))
        if longest == 0.0:
            return march, fit
        if longest > LARGEST_INPUT_POSITION:
            return march, np.zeros_like(fit)
        index, chosen = self.reference.running_index, np.flatnonzero(fit)
        origin = march._replace(u0=self.rows.u).select(chosen)
        designs, arrived = closed_form_designs(origin, index), np.zeros_like(fit)
        span = offset[index, chosen]
        if designs is not None:
            z, ends = designs.lead(span, LEAD_IN_STEP)
            room = ends.distance - np.abs(span)
            dead = np.isfinite(ends.distance) & (-room > DEAD_POINT_MARGIN * np.abs(span))
            self.solved_steps[chosen[dead]], self.is_stopped[chosen[dead]] = 0, ends.is_stopped[dead]
            arrived[chosen] = room > DEAD_POINT_MARGIN * np.abs(span)
        else:
            z, arrived[chosen] = lead_designs(origin, index, span, LEAD_IN_STEP)
            if origin.stops is not None:
                rooms = origin.stops.input_rooms(origin.u0[index], span)
                arrived[chosen] &= rooms >= np.abs(span) - SAME_END
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
