"""One block of a sweep with results beside the points': of links and pairs, by the places of the links' axes."""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np

from planar.batch.block import FULL_TURN, DesignBlock, SolvedDesigns, solve_design_block
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.general_path import link_angles
from planar.batch.march.prediction import LONGEST_STEP
from planar.batch.named_results.design_frames import DesignFrames
from planar.batch.named_results.force_results import find_forces
from planar.batch.named_results.result_rows import LINK_QUANTITIES, PAIR_QUANTITIES, RequestedResults
from planar.batch.named_results.timed_block import input_motions, solve_timed_block
from planar.batch.named_results.transmission_angles import output_link
from planar.batch.reference_design import ReferenceDesign, reference_design
from planar.codegen.aligned_arrays import allocate_aligned
from planar.foundation.geometry import Vector
from planar.foundation.turns import take_turn
from planar.model.link_shapes import LinkPlace
from planar.solving.cycle import cycle

Array = np.ndarray

LEAST_STROKE_STEPS = 24
"""Steps of a stroke between limits of its own, so that they show how links turn."""


class ResultBlock(NamedTuple):
    """A block that is to be solved, the results that are wanted beside those of its points, and how long (s) a run in
    time takes."""

    designs: DesignBlock
    results: RequestedResults
    duration: float | None = None


def solve_result_block(block: ResultBlock, out: Array | None = None) -> SolvedDesigns:
    """As `solve_design_block`; the rows of the results stand after those of the points."""
    if not any(block.results):
        if block.duration is not None:
            return solve_timed_block(block.designs, block.duration)
        return solve_design_block(block.designs, out)
    with take_turn():
        return _ResultBlockSolver(block).solve(out)


class _ResultBlockSolver:
    def __init__(self, block: ResultBlock):
        self.block, self.results, self.duration = block.designs, block.results, block.duration
        timed = block.duration is not None
        self.reference: ReferenceDesign = reference_design(self.block.mechanism, self.block.pair, timed)
        self.mechanism, self.arm = self.reference.mechanism, self.reference.unit
        self.design_count = len(next(iter(self.block.designs.values())))
        self.links = self._needed_links()
        self.rates = self.block.rates or self.results.has_forces or bool(self.results.outputs)
        self.rows = self.results.rows(self.mechanism, self.block.rates)

    def _needed_links(self) -> tuple[str, ...]:
        """The links whose axes are looked at: with those that tell how far they have turned."""
        frame, motions = self.mechanism.frame, self.reference.motions
        if self.results.outputs or self.results.has_forces:
            found = [link.name for link in self.mechanism.links]
        else:
            found = [*self.results.links, *(link for name in self.results.pairs for link in motions[name].bodies)]
            if self.reference.counted_links.intersection(found):
                found = [link.name for link in self.mechanism.links]
        return tuple(link for link in dict.fromkeys(found) if link != frame)

    def solve(self, out: Array | None) -> SolvedDesigns:
        """See `solve_result_block`."""
        block, refined = self.block, self._refinement()
        places: list[LinkPlace] = [LinkPlace(link, Vector(x, 0.0)) for link in self.links for x in (0.0, self.arm)]
        asked = block._replace(
            points=(*block.points, *places), rates=self.rates, steps=block.steps * refined, dtype="float64"
        )
        done = solve_result_block(ResultBlock(asked, RequestedResults(), self.duration))
        orders, wide = 3 if self.rates else 1, 2 * len(asked.points)
        whole = done.out.reshape(len(done.out), orders, wide, self.design_count)
        points = 2 * len(block.points)
        frames = self._frames(done, np.moveaxis(whole[:, :, points:], 1, 0))
        unclear = np.flatnonzero(~frames.is_clear & (done.status[:, 0] == 0))
        general = self._look_up_angles(frames, done, unclear) if unclear.size else 0
        kept = 3 if block.rates else 1
        if out is None:
            count = kept * points + sum(row.width for row in self.rows)
            out = allocate_aligned(block.steps + 1, count, self.design_count, block.dtype)
        out[:, : kept * points].reshape(len(out), kept, points, self.design_count)[:] = whole[::refined, :kept, :points]
        self._write_results(frames, done, refined, out[:, kept * points :])
        return done._replace(
            out=out,
            status=done.status[:, ::refined],
            input=done.input[..., ::refined],
            general_positions=done.general_positions + general,
            general_designs=done.general_designs + unclear.size,
        )

    def _refinement(self) -> int:
        """Into how many a step is divided, so that it shows how far links turn."""
        block, base_ = self.block, self.reference
        if self.duration is not None:
            moved = np.abs(np.diff(self._timed_inputs(block.steps)[0], axis=1)) / base_.input_scale[:, None, None]
            return max(1, ceil(float(np.max(moved)) / LONGEST_STEP - 1e-9))
        if base_.is_sliding and block.stop is None:
            return ceil(LEAST_STROKE_STEPS / block.steps)
        inputs = base_.inputs(with_design_values(self.mechanism, block.designs), self.design_count)[0]
        scale = float(base_.input_scale[base_.running_index])
        start = inputs[base_.running_index] if block.start is None else block.start / scale
        length = FULL_TURN if block.stop is None else block.stop / scale - start
        return max(1, ceil(float(np.max(np.abs(length))) / block.steps / LONGEST_STEP - 1e-9))

    def _frames(self, done: SolvedDesigns, rows: Array) -> DesignFrames:
        """Frames of the links out of rows (orders, steps + 1, rows, designs) of places."""
        base_, steps = self.reference, len(done.out)
        designs = with_design_values(self.mechanism, self.block.designs)
        if self.duration is not None:
            timed = self._timed_inputs(steps - 1)[0]
            inputs = {given.pair: each for given, each in zip(designs.inputs, timed, strict=True)}
        else:
            running = np.broadcast_to(done.input, (self.design_count, steps)).T
            inputs = {
                given.pair: running
                if given.pair == base_.pair
                else np.broadcast_to(np.asarray(given.position, dtype=float), (steps, self.design_count))
                for given in designs.inputs
            }
        places = {
            link: (rows[:, :, 4 * k : 4 * k + 2], rows[:, :, 4 * k + 2 : 4 * k + 4])
            for k, link in enumerate(self.links)
        }
        found = DesignFrames(designs, base_.shapes(designs), inputs, places, self.arm)
        found.time = None if self.duration is None else done.input
        return found

    def _timed_inputs(self, steps: int) -> Array:
        """Positions and rates (SI) of the inputs (3, inputs, steps + 1, designs) in time."""
        time = np.linspace(0.0, self.duration or 0.0, steps + 1)
        return input_motions(self.mechanism, dict(self.block.designs), time)

    def _look_up_angles(self, frames: DesignFrames, done: SolvedDesigns, designs: Array) -> int:
        """Take the angles of designs whose steps do not show them from their cycles; how many positions these had."""
        steps, block = len(done.out) - 1, self.block
        found = np.full((len(self.links), steps + 1, designs.size), np.nan)
        for k, index in enumerate(designs):
            mechanism = with_design_values(self.mechanism, values_of_design(block.designs, int(index)))
            if block.assemblies is not None:
                u = self.reference.inputs(mechanism, 1)[0][:, 0]
                mechanism = self.reference.with_sketch_of(mechanism, block.assemblies[:, index], u)
            grid = done.input if done.input.ndim == 1 else done.input[index]
            own_range = self.reference.is_sliding and block.stop is None
            ends = (block.start, block.stop) if own_range else (float(grid[0]), float(grid[-1]))
            if self.duration is None:
                motion = cycle(mechanism, steps, *ends, self.reference.pair)
            else:
                motion = cycle(mechanism, steps, duration=self.duration)
            angles = link_angles(motion, self.links)
            many = int(np.argmax(done.status[index] != 0)) if done.status[index].any() else steps + 1
            found[:, :many, k] = angles[:, :many]
        frames.replace_angles(designs, dict(zip(self.links, found, strict=True)))
        return designs.size * (steps + 1)

    def _write_results(self, frames: DesignFrames, done: SolvedDesigns, refined: int, out: Array) -> None:
        """Write the results of links and pairs into rows of out (steps + 1, rows, designs)."""
        found: dict[tuple[str, str], Array] = {}
        for name in self.results.links:
            found |= {
                (word, name): each[None] for word, each in zip(LINK_QUANTITIES, frames.link_angle(name), strict=False)
            }
        for name in self.results.pairs:
            found |= {
                (word, name): each[None] for word, each in zip(PAIR_QUANTITIES, frames.pair_value(name), strict=False)
            }
        values, is_solved = dict(self.block.designs), done.status.T == 0
        if self.results.has_forces:
            found |= find_forces(self.mechanism, self.results, frames, values, is_solved)
        for name in self.results.outputs:
            angles = output_link(self.mechanism, name).angles(frames, values, is_solved)
            found["transmission_angle", name] = angles[None]
        at = 0
        for row in self.rows:
            whole = np.broadcast_to(found[row.quantity, row.name], (row.width, len(done.out), self.design_count))
            out[:, at : at + row.width] = np.moveaxis(whole, 0, 1)[::refined]
            at += row.width
