"""The runners that are always there: the kernel by numpy, and one that only looks at where designs start."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import ceil
from typing import NamedTuple

import numpy as np

from planar.batch.design_arrays import split_into_blocks
from planar.batch.march.backend import CorrectedAssemblies, DesignBatch, UnsupportedStructure, erase_from_steps
from planar.batch.march.checks import PointWriter, design_positions
from planar.batch.march.design_functions import DesignFunctions
from planar.batch.march.kernel import KernelEquations, batch_equations
from planar.batch.march.numpy.kernel import (
    DesignMarch,
    MarchedSteps,
    NumpyKernel,
    make_numpy_kernel,
)
from planar.batch.march.prediction import (
    LONGEST_STEP,
    correction_counts,
    correction_limit,
    longest_step,
)
from planar.foundation.instruction_list import UnsupportedOperation

Array = np.ndarray

LANES = 4096
"""Positions at once: so many that an array's work is more than the call, so few that all arrays stay in the cache."""
REFINED_STEP = 0.12
"""rad or sizes to which steps are divided that are too long."""
EXTRA_CORRECTIONS = 2
"""Further corrections at every step for designs that the usual ones leave open."""
COMPACTION_RATIO = 0.7
"""Where less than this part of the designs goes on, the others are left behind."""


class NumpyRunner:
    """See `DesignRunner`. Raises UnsupportedStructure where blocks hold more constraints than unknowns."""

    def can_help(self, batch: DesignBatch) -> bool:
        """See `DesignRunner`."""
        return True

    def run(self, batch: DesignBatch, out: Array, candidates: Array | None = None) -> Array:
        """See `DesignRunner`."""
        kernel = _kernel(batch, batch.links, batch.rates)
        good = _run(kernel, batch, out, 0)
        rest = np.flatnonzero(good < len(batch.input_offsets))
        if kernel.has_newton_blocks and rest.size:
            own = np.empty((*out.shape[:2], rest.size))
            good[rest] = _run(kernel, batch.select(rest), own, EXTRA_CORRECTIONS)
            out[:, :, rest] = own
        erase_from_steps(out, good)
        if candidates is not None:
            candidates[:] = good
        return good

    def last_good_unknowns(self, batch: DesignBatch, good: Array) -> Array:
        """See `DesignRunner`."""
        kernel, last = _kernel(batch, (), False), np.maximum(good, 1) - 1
        z = np.empty_like(batch.z0)
        # those that come about as far go together
        with np.errstate(all="ignore"):
            for which in np.array_split(np.argsort(last), ceil(len(last) / LANES)):
                if kernel.is_sequential:
                    z[:, which] = _unknowns_at_steps(kernel, batch.select(which), last[which])
                else:
                    march = DesignMarch(kernel, batch.select(which), np.zeros(1, dtype=int), np.inf)
                    z[:, which] = march.advance(batch.input_offsets[last[which]].T[:, None]).unknowns(len(z))
        return z

    def correct_assemblies(
        self, batch: DesignBatch, point_blocks: Sequence[int], corrections: int
    ) -> CorrectedAssemblies:
        """See `DesignRunner`."""
        kernel, designs = _kernel(batch, batch.links, False, tuple(point_blocks)), batch.p.shape[1]
        converged, regularity, z = np.empty(designs, dtype=bool), np.empty(designs), np.empty_like(batch.z0)
        points, other_points = (np.full((len(batch.links), 2, designs), np.inf) for _ in range(2))
        counts = np.array([corrections])
        with np.errstate(all="ignore"):
            for part in split_into_blocks(designs, LANES):
                march = DesignMarch(kernel, batch.select(part), counts, np.inf)
                marched = march.advance(np.zeros((len(batch.u0), 1, 1)))
                converged[part], z[:, part] = marched.passed[0], marched.unknowns(len(z))
                regularity[part] = np.sqrt(np.maximum(marched.squared_regularity, 0.0))
                for k in range(len(batch.links)):
                    for axis in range(2):
                        points[k, axis, part] = marched.outputs[2 * k + axis]
                        if k in marched.other_points:
                            other_points[k, axis, part] = marched.other_points[k][axis]
        return CorrectedAssemblies(converged, regularity, z, points, other_points)

    def lead(self, batch: DesignBatch, span: Array, step: float) -> tuple[Array, Array]:
        """Designs led on from where they start, each input by its `span` (inputs, designs), in steps of so much.

        The unknowns there (unknowns, designs), and which designs passed all checks on the way (designs,).
        """
        kernel, designs = _kernel(batch, (), False), batch.p.shape[1]
        fractions = np.linspace(0.0, 1.0, ceil(np.max(np.abs(span), initial=0.0) / step) + 2)
        counts, z, passed = (
            correction_counts(len(fractions), step),
            np.empty_like(batch.z0),
            np.empty(designs, dtype=bool),
        )
        with np.errstate(all="ignore"):
            for part in split_into_blocks(designs, LANES):
                march = DesignMarch(kernel, batch.select(part), counts, correction_limit(step))
                for fraction in fractions:
                    marched = march.advance(fraction * span[:, None, part])
                z[:, part], passed[part] = marched.unknowns(len(z)), march.passed
        return z, passed


class StartRunner:
    """See `DesignRunner`: of designs that no other begins, whether they can start; they are followed from there.

    They may start nearer to where assemblies meet than others do, in structures of any size.
    """

    def can_help(self, batch: DesignBatch) -> bool:
        """See `DesignRunner`."""
        return True

    def run(self, batch: DesignBatch, out: Array, candidates: Array | None = None) -> Array:
        """See `DesignRunner`."""
        if not batch.functions.is_square:
            raise UnsupportedStructure("constraints hold each other more than once")
        functions = DesignFunctions(batch.functions, batch.p)
        with np.errstate(all="ignore"):
            row = design_positions(functions, batch, self._start(functions, batch), batch.u0)
            good = (PointWriter(batch, functions).write(out[0], row) & row.passed).astype(int)
        erase_from_steps(out, good)
        if candidates is not None:
            candidates[:] = good
        return good

    def last_good_unknowns(self, batch: DesignBatch, good: Array) -> Array:
        """See `DesignRunner`."""
        with np.errstate(all="ignore"):
            return self._start(DesignFunctions(batch.functions, batch.p), batch).T

    def correct_assemblies(
        self, batch: DesignBatch, point_blocks: Sequence[int], corrections: int
    ) -> CorrectedAssemblies:
        """See `DesignRunner`: none here."""
        raise UnsupportedStructure("assemblies are searched for block after block")

    @staticmethod
    def _start(functions: DesignFunctions, batch: DesignBatch) -> Array:
        return functions.correct(np.ascontiguousarray(batch.z0.T), batch.u0.T)


def _kernel(
    batch: DesignBatch, links: tuple[str, ...], rates: bool, point_blocks: tuple[int, ...] | None = None
) -> NumpyKernel:
    try:
        return _cached_kernel(batch_equations(batch), links, rates, point_blocks)
    except UnsupportedOperation as why:
        raise UnsupportedStructure(str(why)) from None


@lru_cache(maxsize=256)
def _cached_kernel(
    equations: KernelEquations, links: tuple[str, ...], rates: bool, point_blocks: tuple[int, ...] | None
) -> NumpyKernel:
    return make_numpy_kernel(equations, links, rates, point_blocks)


class _Division(NamedTuple):
    """Steps divided into so many each: where the inputs are (inputs, parts + 1), and how far one goes in a part."""

    part_count: int
    offsets: Array
    longest: float


def _divide_steps(offsets: Array) -> _Division:
    """Steps as they are, or divided where they do not show what lies between, by offsets (steps + 1, inputs)."""
    steps, longest = len(offsets), longest_step(offsets)
    count = ceil(longest / REFINED_STEP) if longest > LONGEST_STEP or steps == 2 else 1
    count = max(count, 2) if steps == 2 else count
    knots = np.arange(count * (steps - 1) + 1) / count
    fine = np.array([np.interp(knots, np.arange(steps), each) for each in offsets.T]) if count > 1 else offsets.T
    return _Division(count, fine, longest / count)


def _run(kernel: NumpyKernel, batch: DesignBatch, out: Array, extra_corrections: int) -> Array:
    """Fill out (steps + 1, rows, designs); how many of the first steps passed (designs,)."""
    division = _divide_steps(batch.input_offsets)
    parts, good = division.offsets.shape[1], np.zeros(out.shape[2], dtype=int)
    with np.errstate(all="ignore"):  # designs that have failed run on as what is no number
        for lanes in split_into_blocks(out.shape[2], LANES):
            good[lanes] = _run_lanes(kernel, batch.select(lanes), division, out[:, :, lanes], extra_corrections)
    # what is seen of a step only at the next one condemns the step too
    good = np.where((good > 1) & (good < parts), good - 1, good)
    return np.where(good > 0, (good - 1) // division.part_count + 1, 0)


def _run_lanes(
    kernel: NumpyKernel, batch: DesignBatch, division: _Division, out: Array, extra_corrections: int
) -> Array:
    """The same of some designs; how many parts of steps passed (designs,)."""
    parts, designs = division.offsets.shape[1], out.shape[2]
    counts = correction_counts(parts, division.longest) + extra_corrections
    march = DesignMarch(kernel, batch, counts, correction_limit(division.longest))
    good, lanes, first = np.zeros(designs, dtype=int), np.arange(designs), 0
    while first < parts and lanes.size:
        last = min(parts, first + (1 if kernel.is_sequential else max(1, LANES // lanes.size)))
        marched = march.advance(division.offsets[:, first:last, None])
        skipped = -first % division.part_count
        rows = slice((first + skipped) // division.part_count, (last - 1) // division.part_count + 1)
        if rows.start < rows.stop:
            _write_points(marched, batch.unit, slice(skipped, None, division.part_count), out, (rows, lanes))
        good[lanes] += marched.passed.sum(axis=0)
        first = last
        if np.count_nonzero(march.passed) < COMPACTION_RATIO * lanes.size:
            lanes = lanes[march.passed]
            march.select(march.passed)
    return good


def _write_points(marched: MarchedSteps, unit: float, parts: slice, out: Array, target: tuple[slice, Array]) -> None:
    """Write the points at some parts of steps into rows of out (steps + 1, rows, designs), for some designs."""
    rows, lanes = target
    shape, whole = marched.passed.shape, len(lanes) == out.shape[2]
    for k, value in enumerate(marched.outputs):
        own = np.broadcast_to(value, shape)[parts]
        if whole:
            np.multiply(own, unit, out=out[rows, k])
        else:
            out[rows, k, lanes] = own * unit


def _unknowns_at_steps(kernel: NumpyKernel, batch: DesignBatch, steps: Array) -> Array:
    """The unknowns (unknowns, designs) where each design comes to a step of its own (designs,)."""
    division = _divide_steps(batch.input_offsets)
    counts = correction_counts(division.offsets.shape[1], division.longest) + EXTRA_CORRECTIONS
    march, z, lanes = DesignMarch(kernel, batch, counts, np.inf), np.empty_like(batch.z0), np.arange(len(steps))
    for part in range(int(steps.max()) * division.part_count + 1):
        marched = march.advance(division.offsets[:, part : part + 1, None])
        here = steps[lanes] * division.part_count == part
        if here.any():
            z[:, lanes[here]] = marched.unknowns(len(z))[:, here]
            lanes = lanes[~here]
            march.select(~here)
    return z
