"""Which results a sweep tells beside the points', and the rows in which they stand."""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np

from planar.batch.block import FULL_TURN, DesignBlock, DesignBlockSolver, SolvedDesigns, solve_design_block
from planar.batch.design_arrays import split_into_blocks, values_of_design, with_design_values
from planar.batch.general_path import link_angles
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.prediction import LONGEST_STEP
from planar.batch.named_results.design_forces import find_forces
from planar.batch.named_results.design_frames import DesignFrames
from planar.batch.named_results.design_slopes import MarchedBlock, design_slopes, march_block_slopes
from planar.batch.named_results.result_rows import LINK_QUANTITIES, PAIR_QUANTITIES, RequestedResults
from planar.batch.named_results.timed_block import input_motions, solve_timed_block
from planar.batch.named_results.transmission_angles import output_link
from planar.batch.reference_design import ReferenceDesign, reference_design
from planar.codegen.llvm_compile import allocate_aligned
from planar.foundation.arrays import BoolArray
from planar.foundation.geometry import Vector
from planar.foundation.turns import take_turn
from planar.model.link_shapes import LinkPlace
from planar.results.motion import Motion
from planar.solving.cycle import cycle

Array = np.ndarray

LEAST_STROKE_STEPS = 24
"""Steps of a stroke between limits of its own, so that they show how links turn."""
MAX_PART_POSITIONS = 2**15
"""Positions whose results are made at once: so few that all arrays stay in the cache."""


class ResultBlock(NamedTuple):
    """A block that is to be solved, the results that are wanted beside those of its points, and how long (s) a run in
    time takes; `slopes_by_places` (steps + 1, designs): where derivatives follow from the places of links, of a block
    whose other derivatives are known."""

    designs: DesignBlock
    results: RequestedResults
    duration: float | None = None
    slopes_by_places: BoolArray | None = None


def solve_result_block(block: ResultBlock, out: Array | None = None) -> SolvedDesigns:
    """As `solve_design_block`; the rows of the results stand after those of the points."""
    if not any(block.results):
        if block.duration is not None:
            return solve_timed_block(block.designs, block.duration)
        return solve_design_block(block.designs, out)
    with take_turn():
        return _ResultBlockSolver(block).solve(out)


class _ResultBlockSolver:
    def __init__(self, block: ResultBlock, marches_slopes: bool = True):
        self.block, self.results, self.duration = block.designs, block.results, block.duration
        timed = block.duration is not None
        self.reference: ReferenceDesign = reference_design(self.block.mechanism, self.block.pair, timed)
        self.mechanism, self.arm = self.reference.mechanism, self.reference.unit
        self.design_count = len(next(iter(self.block.designs.values())))
        self.slopes = (
            design_slopes(self.reference, self.results, self.block.rates) if self.results.derivatives else None
        )
        self.slopes_at = block.slopes_by_places
        self.marches_slopes = marches_slopes and self.slopes is not None and not timed and self.slopes_at is None
        "whether derivatives are told by machine code, and not by the places of links"
        by_places = self.slopes is not None and not self.marches_slopes
        self.links = self._needed_links(by_places)
        self.rates = self.block.rates or self.results.has_forces or bool(self.results.outputs) or by_places
        self.rows = self.results.rows(self.mechanism, self.block.rates)

    def _needed_links(self, by_places: bool) -> tuple[str, ...]:
        """The links whose axes are looked at: with those that tell how far they have turned."""
        frame, motions = self.mechanism.frame, self.reference.motions
        if self.results.outputs or self.results.has_forces or by_places:
            found = [link.name for link in self.mechanism.links]
        else:
            found = [*self.results.links, *(link for name in self.results.pairs for link in motions[name].bodies)]
            if not found and self.marches_slopes:
                return ()
            if self.reference.counted_links.intersection(found):
                found = [link.name for link in self.mechanism.links]
        moving = [link.name for link in self.mechanism.links if link.name != frame]
        return tuple(link for link in dict.fromkeys(found or moving[:1]) if link != frame)

    def solve(self, out: Array | None) -> SolvedDesigns:
        """See `solve_result_block`."""
        block, refined = self.block, self._refinement() if self.links else 1
        places: list[LinkPlace] = [LinkPlace(link, Vector(x, 0.0)) for link in self.links for x in (0.0, self.arm)]
        asked = block._replace(
            points=(*block.points, *places), rates=self.rates, steps=block.steps * refined, dtype="float64"
        )
        done, march = self._solve_places(asked)
        marched = None
        if self.slopes is not None and self.marches_slopes:
            marched = march_block_slopes(self.slopes, asked, march, done)
            if marched is None:
                return _ResultBlockSolver(ResultBlock(block, self.results), False).solve(out)
        orders, wide = 3 if self.rates else 1, 2 * len(asked.points)
        whole = done.out.reshape(len(done.out), orders, wide, self.design_count)
        points = 2 * len(block.points)
        kept = 3 if block.rates else 1
        if out is None:
            count = kept * points + sum(row.width for row in self.rows)
            out = allocate_aligned(block.steps + 1, count, self.design_count, block.dtype)
        out[:, : kept * points].reshape(len(out), kept, points, self.design_count)[:] = whole[::refined, :kept, :points]
        looked_up = 0
        parts = split_into_blocks(self.design_count, max(1, MAX_PART_POSITIONS // len(done.out)))
        for part in parts if self.links else ():
            own = _DesignPart(block, done, part)
            frames = self._frames(own, np.moveaxis(whole[:, :, points:, part], 1, 0))
            unclear = np.flatnonzero(~frames.is_clear & (own.status[:, 0] == 0))
            if unclear.size:
                self._look_up_angles(frames, own, unclear)
                looked_up += int(unclear.size)
            self._write_results(frames, own, out[:, kept * points :, part], refined)
        if marched is not None:
            self._write_marched(marched, out, refined)
        return done._replace(
            out=out,
            status=done.status[:, ::refined],
            input=done.input[..., ::refined],
            general_positions=done.general_positions + looked_up * len(done.out),
            general_designs=done.general_designs + looked_up,
        )

    def _solve_places(self, asked: DesignBlock) -> tuple[SolvedDesigns, DesignBatch | None]:
        """The points and places that are asked for, and how compiled code marched to them."""
        if self.duration is not None:
            return solve_timed_block(asked, self.duration), None
        solver = DesignBlockSolver(asked, None)
        return solver.solve(), solver.march

    def _write_marched(self, marched: MarchedBlock, out: Array, refined: int) -> None:
        """Write the derivatives into the last rows of out: those that machine code tells, and what it leaves open."""
        assert self.slopes is not None
        count = sum(row.width for row in self.rows if row.quantity == "derivatives")
        own, missing = out[:, out.shape[1] - count :], marched.missing[::refined]
        self.slopes.write_free(marched.slopes[::refined], own)
        some = np.flatnonzero(missing.any(axis=0))
        if some.size:
            block = self.block
            designs = {name: np.asarray(value)[some] for name, value in block.designs.items()}
            z = None if block.assemblies is None else block.assemblies[:, some]
            part = block._replace(designs=designs, assemblies=z, points=())
            of = self.results._replace(outputs=(), efforts=(), reactions=())
            found = solve_result_block(ResultBlock(part, of, None, missing[:, some])).out
            at = missing[:, None, some]
            own[:, :, some] = np.where(at, found[:, found.shape[1] - count :], own[:, :, some])

    def _refinement(self) -> int:
        """Into how many a step is divided, so that it shows how far links turn."""
        block, base_ = self.block, self.reference
        if self.duration is not None:
            time = np.linspace(0.0, self.duration, block.steps + 1)
            timed = input_motions(self.mechanism, dict(block.designs), time)[0]
            moved = np.abs(np.diff(timed, axis=1)) / base_.input_scale[:, None, None]
            return max(1, ceil(float(np.max(moved)) / LONGEST_STEP - 1e-9))
        if base_.is_sliding and block.stop is None:
            return ceil(LEAST_STROKE_STEPS / block.steps)
        inputs = base_.design_rows(block.designs, self.design_count).u
        scale = float(base_.input_scale[base_.running_index])
        start = inputs[base_.running_index] if block.start is None else block.start / scale
        length = FULL_TURN if block.stop is None else block.stop / scale - start
        return max(1, ceil(float(np.max(np.abs(length))) / block.steps / LONGEST_STEP - 1e-9))

    def _frames(self, part: _DesignPart, rows: Array) -> DesignFrames:
        """Frames of the links out of rows (orders, steps + 1, rows, designs) of places."""
        base_, shape = self.reference, (rows.shape[1], rows.shape[3])
        designs = with_design_values(self.mechanism, part.designs)
        if self.duration is not None:
            timed = input_motions(self.mechanism, part.designs, part.input)[0]
            inputs = {given.pair: each for given, each in zip(designs.inputs, timed, strict=True)}
        else:
            running = np.broadcast_to(part.input, shape[::-1]).T
            inputs = {
                given.pair: running
                if given.pair == base_.pair
                else np.broadcast_to(np.asarray(given.position, dtype=float), shape)
                for given in designs.inputs
            }
        places = {
            link: (rows[:, :, 4 * k : 4 * k + 2], rows[:, :, 4 * k + 2 : 4 * k + 4])
            for k, link in enumerate(self.links)
        }
        found = DesignFrames(designs, base_.design_rows(part.designs, shape[1]).shapes, inputs, places, self.arm)
        found.time = None if self.duration is None else part.input
        return found

    def _look_up_angles(self, frames: DesignFrames, part: _DesignPart, designs: Array) -> None:
        """Take the angles of designs whose steps do not show them from their cycles."""
        steps = frames.design_shape[0] - 1
        found = np.full((len(self.links), steps + 1, designs.size), np.nan)
        for k, index in enumerate(designs):
            many = int(np.argmax(part.status[index] != 0)) if part.status[index].any() else steps + 1
            found[:, :many, k] = link_angles(self._motion(part, int(index), steps), self.links)[:, :many]
        frames.replace_angles(designs, dict(zip(self.links, found, strict=True)))

    def _motion(self, part: _DesignPart, index: int, steps: int) -> Motion:
        """The motion of one design, by itself."""
        mechanism = with_design_values(self.mechanism, values_of_design(part.designs, index))
        if part.assemblies is not None:
            rows = self.reference.design_rows(part.designs, len(part.status))
            mechanism = self.reference.with_sketch_of(mechanism, part.assemblies[:, index], rows.u[:, index])
        if self.duration is not None:
            return cycle(mechanism, steps, duration=self.duration)
        if self.reference.is_sliding and self.block.stop is None:
            return cycle(mechanism, steps, self.block.start, None, self.reference.pair)
        grid = part.input if part.input.ndim == 1 else part.input[index]
        return cycle(mechanism, steps, float(grid[0]), float(grid[-1]), self.reference.pair)

    def _write_results(self, frames: DesignFrames, part: _DesignPart, out: Array, refined: int) -> None:
        """Write the results into rows of out (steps + 1, rows, designs)."""
        found: dict[tuple[str, str], Array] = {}
        for name in self.results.links:
            found |= {
                (word, name): each[None] for word, each in zip(LINK_QUANTITIES, frames.link_angle(name), strict=False)
            }
        for name in self.results.pairs:
            found |= {
                (word, name): each[None] for word, each in zip(PAIR_QUANTITIES, frames.pair_value(name), strict=False)
            }
        is_solved = part.status.T == 0
        if self.results.has_forces:
            found |= find_forces(self.mechanism, self.results, frames, part.designs, is_solved)
        for name in self.results.outputs:
            angles = output_link(self.mechanism, name).angles(frames, part.designs, is_solved)
            found["transmission_angle", name] = angles[None]
        if self.slopes is not None and not self.marches_slopes:
            wanted = is_solved & self._slope_positions(part.which, refined)
            found |= self.slopes.find(frames, part.designs, wanted)
        at = 0
        for row in self.rows:
            if row.quantity == "derivatives" and self.marches_slopes:
                break  # which stand last
            whole = np.broadcast_to(found[row.quantity, row.name], (row.width, *frames.design_shape))
            out[:, at : at + row.width] = np.moveaxis(whole, 0, 1)[::refined]
            at += row.width

    def _slope_positions(self, designs: slice, refined: int) -> BoolArray:
        """Where derivatives are wanted (steps + 1, designs): not between the positions that are told."""
        found = np.zeros((self.block.steps * refined + 1, self.design_count), dtype=bool)
        found[::refined] = True if self.slopes_at is None else self.slopes_at
        return found[:, designs]


class _DesignPart:
    """Some designs of a block that has been solved: their numbers, statuses and inputs."""

    def __init__(self, block: DesignBlock, done: SolvedDesigns, part: slice):
        self.which = part
        self.designs = {name: np.asarray(value)[part] for name, value in block.designs.items()}
        self.assemblies = None if block.assemblies is None else block.assemblies[:, part]
        self.status = done.status[part]
        self.input = done.input if done.input.ndim == 1 else done.input[part]
