"""The backend that is always there: the compiled program, step after step, over the designs of a block."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.batch.march.backend import CorrectedAssemblies, DesignBatch, UnsupportedStructure
from planar.batch.march.checks import DesignBranchCheck, DesignPositions, DesignResidualCheck
from planar.batch.march.design_functions import DesignFunctions
from planar.batch.march.prediction import extrapolation_weights
from planar.equations.functions import EquationRates
from planar.equations.linear import solve_vectors
from planar.equations.mechanism_numbers import mechanism_size, shapes_of_links
from planar.foundation.geometry import Vector
from planar.foundation.jets import Jet, Scalar
from planar.solving.checks.residual_check import ResidualCheck

Array = np.ndarray

PREDICTOR_ORDER = 4
"""Moves before from which the next is predicted, at most."""
START_GROUPS = 6
"""Groups of designs that are led to their last good step together."""
COMPACTION_RATIO = 0.7
"""Where less than this part of the designs goes on, the others are left behind."""


class DesignsAtStep(NamedTuple):
    """All designs at one step: z (designs, unknowns), u (inputs, designs), w (coordinates, designs), which of them have
    passed the gate at this step and all before, and the slopes by which they were judged."""

    z: Array
    u: Array
    w: Array
    passed: Array
    positions: DesignPositions


class NumpyRunner:
    """See `DesignRunner`."""

    def run(self, batch: DesignBatch, out: Array) -> Array:
        """See `DesignRunner`; raises UnsupportedStructure where blocks hold more constraints than unknowns."""
        steps, designs = len(batch.input_offsets), batch.p.shape[1]
        good, some, first, part = np.zeros(designs, dtype=int), np.arange(designs), 0, batch
        with np.errstate(all="ignore"):  # designs that have failed run on as what is no number
            while some.size and first < steps:
                first, row = _run_until_many_fail(part, first, some, out, good)
                # those that have failed are left behind; the others go on from the step where they are
                some, part = some[row.passed], batch.select(some[row.passed], row.z[row.passed].T)
        return good

    def last_good_unknowns(self, batch: DesignBatch, good: Array) -> Array:
        """See `DesignRunner`."""
        designs = len(good)
        found = np.full((len(batch.z0), designs), np.nan)
        # those that come about as far are led together
        for some in np.array_split(np.argsort(good), min(START_GROUPS, designs)):
            part, own = batch.select(some), good[some]
            inputs = (part.u0 + each[:, None] for each in part.input_offsets[: int(own.max())])
            for k, row in enumerate(iterate_steps(part, inputs)):
                last = (own == k + 1) & row.passed
                found[:, some[last]] = row.z[last].T
        return found

    def correct_assemblies(
        self, batch: DesignBatch, point_blocks: Sequence[int], corrections: int
    ) -> CorrectedAssemblies:
        """See `DesignRunner`: none here, they are left to the search block after block."""
        raise UnsupportedStructure("assemblies are searched for block after block")


def _run_until_many_fail(
    part: DesignBatch, first: int, some: Array, out: Array, good: Array
) -> tuple[int, DesignsAtStep]:
    """March some designs on from a step, to the end or to where most have failed: the step after it, or that itself."""
    columns = DesignFunctions(part.program, part.p)
    told, last = PointWriter(part, columns), len(part.input_offsets) - 1
    whole = out.shape[2] == len(some)
    own = None if whole else np.empty((out.shape[1], len(some)))
    inputs = (part.u0 + each[:, None] for each in part.input_offsets[first:])
    for step, row in enumerate(iterate_steps(part, inputs, columns), start=first):
        into = out[step] if own is None else own
        fine = told.write(into, row)
        if own is not None:
            out[step][:, some] = own
        good[some] += row.passed & fine & (good[some] == step)
        if step in (last, first):
            continue
        if np.count_nonzero(row.passed) < COMPACTION_RATIO * len(some):
            return step, row
    return last + 1, row


def iterate_steps(
    task: DesignBatch, inputs: Iterable[Array], functions: DesignFunctions | None = None
) -> Iterator[DesignsAtStep]:
    """The designs at inputs (inputs, designs), one step after the other, from the unknowns at the first."""
    if not task.program.is_square:
        raise UnsupportedStructure("constraints hold each other more than once")
    functions = functions or DesignFunctions(task.program, task.p)
    closed, branches = make_residual_check(task), DesignBranchCheck(functions)
    z = np.ascontiguousarray(task.z0.T)
    moves: list[Array] = []
    before, ahead, last_way = None, None, None
    good = np.ones(len(z), dtype=bool)
    for u in inputs:
        near = z.copy()
        for weight, move in zip(extrapolation_weights(len(moves)), moves, strict=True):
            near += weight * move
        after = functions.correct(near, u.T)
        if before is not None:
            moves = [after - z, *moves[: PREDICTOR_ORDER - 1]]
        z = after
        w = functions.coordinates(z, u.T)
        good = good & (closed.worst_residual(w, u) <= task.tolerance) & closed.is_resolved(w)
        here = branches.evaluate(z, u.T)
        good = good & branches.is_regular(here)
        if before is not None:
            way = here.u - before.u
            same = last_way is not None and np.allclose(way, last_way, rtol=1e-9, atol=1e-12)
            keeps, ahead = branches.check_step(before, here, ahead if same else None)
            good, last_way = good & keeps, way
        before = here
        yield DesignsAtStep(z, u, w, good, here)


def make_residual_check(task: DesignBatch) -> DesignResidualCheck:
    """The first part of the gate for a march."""
    own = shapes_of_links(task.mechanism)
    return DesignResidualCheck(
        ResidualCheck(task.mechanism, own, mechanism_size(task.mechanism, own)), task.mechanism, task.program, task.p
    )


class PointWriter:
    """The points of a march, with their rates."""

    def __init__(self, task: DesignBatch, functions: DesignFunctions):
        self.task, self.functions, self.residual_check = task, functions, make_residual_check(task)

    def write(self, out: Array, row: DesignsAtStep) -> Array:
        """Write the points of a step (rows, designs); whether their rates break no constraint (designs,)."""
        task = self.task
        if not task.rates:
            self._write_points(out, row.w)
            return np.ones(row.w.shape[1:] or row.passed.shape, dtype=bool)
        found = self._rates(row)
        w = [Jet(*(np.ascontiguousarray(part[:, k]) for part in found)) for k in range(found[0].shape[1])]
        self._write_points(out, w)
        frames, own = self.residual_check.frames_from_coordinates(w)
        inputs = [Jet(u, u1, u2) for u, u1, u2 in zip(row.u, task.u1, task.u2, strict=True)]
        gaps = self.residual_check.residual_check.rate_residuals(frames, own, inputs)
        return np.all([np.broadcast_to(gap, row.passed.shape) <= 1e3 * task.tolerance for gap, _ in gaps], axis=0)

    def _rates(self, row: DesignsAtStep) -> tuple[Array, Array, Array]:
        """w with its first and second rates, each (designs, coordinates)."""
        task, none = self.task, np.zeros_like(row.z)
        y, u1, u2 = np.hstack([row.z, row.u.T]), task.u1.T, task.u2.T

        def at(z1: Array, z2: Array) -> EquationRates:
            return self.functions.kinematics(y, np.hstack([z1, u1]), np.hstack([z2, u2]))

        z1 = (row.positions.sensitivities @ u1[:, :, None])[..., 0]
        z2 = -solve_vectors(row.positions.jacobians, at(z1, none).F2)
        found = at(z1, z2)
        return found.w, found.w1, found.w2

    def _write_points(self, out: Array, w: Sequence[Scalar] | Array) -> None:
        frames, _ = self.residual_check.frames_from_coordinates(w)
        many = 2 * len(self.task.links)
        for k, link in enumerate(self.task.links):
            place = frames[link].to_world(Vector(*self.task.q[2 * k : 2 * k + 2]))
            for axis, value in enumerate(place):
                for order, part in enumerate(value.parts if isinstance(value, Jet) else (value,)):
                    np.multiply(part, self.task.unit, out=out[order * many + 2 * k + axis])
