"""One block of a sweep: its points, over a range of one input or in time, and the results beside them."""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np

from planar.batch.block import FULL_TURN, DesignBlock, DesignBlockSolver, SolvedDesigns, input_motions
from planar.batch.design_arrays import split_into_blocks, with_design_values
from planar.batch.design_frames import DesignFrames
from planar.batch.general_path import link_angles
from planar.batch.march.prediction import LONGEST_STEP
from planar.batch.named_results.design_forces import find_forces, output_link, transmission_angles
from planar.batch.named_results.design_slopes import design_slopes
from planar.batch.named_results.result_rows import LINK_QUANTITIES, PAIR_QUANTITIES, NamedArrays, RequestedResults
from planar.codegen.llvm_compile import allocate_aligned
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.geometry import Vector
from planar.foundation.turns import take_turn
from planar.model.link_shapes import LinkPlace

LEAST_STROKE_STEPS = 24
"""Steps of a stroke between limits of its own, so that they show how links turn."""
MAX_PART_POSITIONS = 2**15
"""Positions whose results are made at once: so few that all arrays stay in the cache."""


class ResultBlock(NamedTuple):
    """A block that is to be solved, and the results that are wanted beside those of its points; `slopes_by_places`
    (steps + 1, designs): where derivatives follow from the places of links, of a block whose other derivatives are
    known."""

    designs: DesignBlock
    results: RequestedResults
    slopes_by_places: BoolArray | None = None


def solve_result_block(block: ResultBlock, out: Array | None = None) -> SolvedDesigns:
    """Solve a block, in `out` if that is given; the rows of the results stand after those of the points."""
    with take_turn():
        if not any(block.results):
            return DesignBlockSolver(block.designs, out).solve()
        return _ResultBlockSolver(block).solve(out)


class _ResultBlockSolver:
    def __init__(self, block: ResultBlock, marches_slopes: bool = True):
        self.block, self.results = block.designs, block.results
        is_timed = self.block.duration is not None
        self.reference = self.block.reference()
        self.mechanism, self.arm = self.reference.mechanism, self.reference.unit
        self.design_count = self.block.design_count
        self.slopes = (
            design_slopes(self.reference, self.results, self.block.rates) if self.results.derivatives else None
        )
        self.slopes_at = block.slopes_by_places
        self.marches_slopes = marches_slopes and self.slopes is not None and not is_timed and self.slopes_at is None
        "whether derivatives are told by machine code, and not by the places of links"
        by_places = self.slopes is not None and not self.marches_slopes
        self.links = self._needed_links(by_places)
        self.rates = self.block.rates or self.results.has_forces or bool(self.results.outputs) or by_places
        self.rows = self.results.rows(self.mechanism, self.block.rates)

    def _needed_links(self, by_places: bool) -> tuple[str, ...]:
        """The links whose axes are looked at: with those that tell how far they have turned."""
        frame, motions = self.mechanism.frame, self.reference.motions
        moving = tuple(link.name for link in self.mechanism.links if link.name != frame)
        if self.results.outputs or self.results.has_forces or by_places:
            return moving
        links = [*self.results.links, *(link for name in self.results.pairs for link in motions[name].bodies)]
        if self.reference.counted_links.intersection(links):
            return moving
        if not links:
            return () if self.marches_slopes else moving[:1]
        return tuple(link for link in dict.fromkeys(links) if link != frame)

    def solve(self, out: Array | None) -> SolvedDesigns:
        """See `solve_result_block`."""
        block, refined = self.block, self._refinement() if self.links else 1
        places: list[LinkPlace] = [LinkPlace(link, Vector(x, 0.0)) for link in self.links for x in (0.0, self.arm)]
        asked = block._replace(
            points=(*block.points, *places), rates=self.rates, steps=block.steps * refined, dtype="float64"
        )
        solver = DesignBlockSolver(asked, None)
        done, march, marched = solver.solve(), solver.march, None
        if self.slopes is not None and self.marches_slopes:
            marched = None if march is None else self.slopes.march_block(asked, march, done)
            if marched is None:  # machine code cannot do that
                return _ResultBlockSolver(ResultBlock(block, self.results), False).solve(out)
        orders, point_rows = 3 if block.rates else 1, 2 * len(block.points)
        places_out = done.out.reshape(len(done.out), -1, 2 * len(asked.points), self.design_count)
        if out is None:
            count = orders * point_rows + sum(row.width for row in self.rows)
            out = allocate_aligned(block.steps + 1, count, self.design_count, block.dtype)
        points_out = out[:, : orders * point_rows].reshape(len(out), orders, point_rows, self.design_count)
        points_out[:] = places_out[::refined, :orders, :point_rows]
        looked_up = 0
        parts = split_into_blocks(self.design_count, max(1, MAX_PART_POSITIONS // len(done.out)))
        for part in parts if self.links else ():
            inputs = done.input if done.input.ndim == 1 else done.input[part]
            solved = _SolvedPart(part, block.select(part), done.status[part], inputs)
            frames = self._frames(solved, np.moveaxis(places_out[:, :, point_rows:, part], 1, 0))
            unclear = np.flatnonzero(~frames.is_clear & (solved.status[:, 0] == 0))
            if unclear.size:
                self._look_up_angles(frames, solved, unclear)
                looked_up += int(unclear.size)
            self._write_results(frames, solved, out[:, orders * point_rows :, part], refined)
        if marched is not None:
            slopes, is_missing = marched
            self._write_marched(slopes[::refined], is_missing[::refined], out)
        return done._replace(
            out=out,
            status=done.status[:, ::refined],
            input=done.input[..., ::refined],
            general_positions=done.general_positions + looked_up * len(done.out),
            general_designs=done.general_designs + looked_up,
        )

    def _write_marched(self, slopes: Array, is_missing: BoolArray, out: Array) -> None:
        """Write the derivatives into the last rows of out: those that machine code tells, and what it leaves open."""
        count = sum(row.width for row in self.rows if row.quantity == "derivatives")
        slope_rows = out[:, out.shape[1] - count :]
        slope_rows[:] = slopes
        designs = np.flatnonzero(is_missing.any(axis=0))
        if designs.size:
            block = self.block.select(designs)._replace(points=())
            results = self.results._replace(outputs=(), efforts=(), reactions=())
            others = solve_result_block(ResultBlock(block, results, is_missing[:, designs])).out
            known = slope_rows[:, :, designs]
            slope_rows[:, :, designs] = np.where(
                is_missing[:, None, designs], others[:, others.shape[1] - count :], known
            )

    def _refinement(self) -> int:
        """Into how many a step is divided, so that it shows how far links turn."""
        block, reference = self.block, self.reference
        if block.duration is not None:
            timed = input_motions(self.mechanism, block, block.time)[0]
            moved = np.abs(np.diff(timed, axis=1)) / reference.input_scale[:, None, None]
            return max(1, ceil(float(np.max(moved)) / LONGEST_STEP - 1e-9))
        if block.has_own_ranges:
            return ceil(LEAST_STROKE_STEPS / block.steps)
        inputs = reference.design_rows(block.designs, self.design_count).u
        scale = float(reference.input_scale[reference.running_index])
        start = inputs[reference.running_index] if block.start is None else block.start / scale
        length = FULL_TURN if block.stop is None else block.stop / scale - start
        return max(1, ceil(float(np.max(np.abs(length))) / block.steps / LONGEST_STEP - 1e-9))

    def _frames(self, part: _SolvedPart, rows: Array) -> DesignFrames:
        """Frames of the links out of rows (orders, steps + 1, rows, designs) of places."""
        reference, shape = self.reference, (rows.shape[1], rows.shape[3])
        designs = with_design_values(self.mechanism, part.block.designs)
        if self.block.duration is not None:
            timed = input_motions(self.mechanism, part.block, part.input)[0]
            inputs = {driven.pair: position for driven, position in zip(designs.inputs, timed, strict=True)}
        else:
            running = np.broadcast_to(part.input, shape[::-1]).T
            inputs = {
                driven.pair: running
                if driven.pair == reference.pair
                else np.broadcast_to(np.asarray(driven.position, dtype=float), shape)
                for driven in designs.inputs
            }
        places = {
            link: (rows[:, :, 4 * k : 4 * k + 2], rows[:, :, 4 * k + 2 : 4 * k + 4])
            for k, link in enumerate(self.links)
        }
        time = None if self.block.duration is None else part.input
        shapes = reference.design_rows(part.block.designs, shape[1]).shapes
        return DesignFrames(designs, shapes, inputs, places, self.arm, time)

    def _look_up_angles(self, frames: DesignFrames, part: _SolvedPart, designs: IntArray) -> None:
        """Take the angles of designs whose steps do not show them from their cycles."""
        steps = frames.design_shape[0] - 1
        angles = np.full((len(self.links), steps + 1, designs.size), np.nan)
        for k, index in enumerate(designs):
            count = int(np.argmax(part.status[index] != 0)) if part.status[index].any() else steps + 1
            motion = part.block._replace(steps=steps).design_run(int(index), part.input).motion()
            angles[:, :count, k] = link_angles(motion, self.links)[:, :count]
        frames.replace_angles(designs, dict(zip(self.links, angles, strict=True)))

    def _write_results(self, frames: DesignFrames, part: _SolvedPart, out: Array, refined: int) -> None:
        """Write the results into rows of out (steps + 1, rows, designs); derivatives that are marched stand last."""
        rows = [row for row in self.rows if row.quantity != "derivatives" or not self.marches_slopes]
        arrays: NamedArrays = {
            (row.quantity, row.name): np.full((row.width, *frames.design_shape), np.nan)
            for row in rows
            if row.quantity not in (*LINK_QUANTITIES, *PAIR_QUANTITIES)
        }
        for name in self.results.links:
            for quantity, rate in zip(LINK_QUANTITIES, frames.link_angle(name), strict=False):
                arrays[quantity, name] = rate[None]
        for name in self.results.pairs:
            for quantity, rate in zip(PAIR_QUANTITIES, frames.pair_value(name), strict=False):
                arrays[quantity, name] = rate[None]
        is_solved, values = part.status.T == 0, part.block.designs
        if self.results.has_forces:
            find_forces(self.mechanism, self.results, frames, values, is_solved, arrays)
        for name in self.results.outputs:
            driven = output_link(self.mechanism, name)
            arrays["transmission_angle", name][0] = transmission_angles(driven, frames, values, is_solved)
        if self.slopes is not None and not self.marches_slopes:
            is_asked = np.zeros_like(is_solved)  # not between the positions of the sweep
            is_asked[::refined] = is_solved[::refined]
            if self.slopes_at is not None:
                is_asked[::refined] &= self.slopes_at[:, part.designs]
            self.slopes.find(frames, values, is_asked, arrays)
        first = 0
        for row in rows:
            array = np.broadcast_to(arrays[row.quantity, row.name], (row.width, *frames.design_shape))
            out[:, first : first + row.width] = np.moveaxis(array, 0, 1)[::refined]
            first += row.width


class _SolvedPart(NamedTuple):
    """Some designs of a block that has been solved: which, and their numbers, statuses and inputs."""

    designs: slice
    block: DesignBlock
    status: Array
    input: Array
