"""Derivatives of what a sweep tells, of many designs at every step, in numbers of the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from planar.batch.gradients.slope_rows import SlopeResults
from planar.batch.named_results.design_forces import DesignPositions, position_chunks
from planar.batch.named_results.design_frames import DesignFrames
from planar.batch.named_results.result_rows import (
    LINK_QUANTITIES,
    PAIR_QUANTITIES,
    POINT_QUANTITIES,
    RequestedResults,
    derivative_name,
)
from planar.batch.reference_design import ReferenceDesign
from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.derivatives.implicit_system import ImplicitSystem
from planar.derivatives.kinematic_slopes import OPENING
from planar.derivatives.result_slopes import tied_dimensions
from planar.document.dimensions import value_at
from planar.equations.casadi_call import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.equations.residuals import pair_residuals
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, suggest_name
from planar.model.pairs import MeasureKind

Expression = tuple[str, ca.SX]
"""What is derived, as `position of E`, and its parts (parts,)."""


class DesignSlopes:
    """The derivatives of results over a sweep's positions in some numbers, those of `planar.sensitivity`.

    Raises BadInput where derivatives are not told of a structure, or in a number.
    """

    def __init__(self, reference: ReferenceDesign, results: RequestedResults, rates: bool):
        self.reference, self.results, self.orders = reference, results, 3 if rates else 1
        self.design: DesignEquations = design_equations(reference.mechanism)
        names = list(self.design.names)
        for each in results.derivatives:
            if each not in names:
                hint = suggest_name(each, names, "numbers")
                raise BadInput("derivatives", f"nothing is derived in {each!r:.60}{hint}")
        self.columns = [names.index(each) for each in results.derivatives]
        self.rest = [k for k in range(len(names)) if k not in self.columns]
        self.scale = self.design.scale[self.columns]

    @cached_property
    def is_bound(self) -> BoolArray:
        """The numbers that cannot change alone (numbers,)."""
        bound = tied_dimensions(self.reference.mechanism)
        return np.array([each in bound for each in self.results.derivatives])

    @cached_property
    def system(self) -> ImplicitSystem:
        """The equations in the numbers."""
        t = self.design.t
        parameters, constants = (ca.vertcat(ca.SX(0, 1), *(t[k] for k in of)) for of in (self.columns, self.rest))
        return ImplicitSystem(self.design.kinematics.levels[: self.orders], parameters, constants)

    @cached_property
    def expressions(self) -> list[Expression]:
        """What is derived."""
        return list(self._expressions())

    @cached_property
    def jacobians(self) -> BufferedFunction:
        """Those of the results, and of what pairs leave open."""
        return self.system.result_jacobians(
            ca.vertcat(*(value for _, value in self.expressions), pair_gaps(self.design))
        )

    @cached_property
    def free(self) -> SlopeResults:
        """The same in the numbers that can change alone, as machine code has it."""
        numbers = [each for each, tied in zip(self.results.derivatives, self.is_bound, strict=True) if not tied]
        of = self.results
        return SlopeResults(of.derived_points, of.links, of.pairs, tuple(numbers), self.orders > 1)

    def write_free(self, slopes: Array, out: Array) -> None:
        """Write rows of `free` (steps + 1, rows, designs) into those of all numbers."""
        if not self.is_bound.any():
            out[:] = slopes
            return
        of_all = self.free._replace(numbers=self.results.derivatives)
        for whole, part in zip(of_all.split_rows(out), self.free.split_rows(slopes), strict=True):
            whole[:, :, self.is_bound] = np.nan
            whole[:, :, ~self.is_bound] = part

    def _expressions(self) -> Iterator[Expression]:
        frames, _ = self.design.placed
        work = self.design.work
        for name in self.results.derived_points:
            link, point = self.reference.point_member(name)
            place = stack_expressions(frames[link].to_world(work.shapes[link].position(point)))
            yield from self._with_rates(POINT_QUANTITIES, name, place)
        for name in self.results.links:
            yield from self._with_rates(LINK_QUANTITIES, name, ca.SX(frames[name].angle))
        for name in self.results.pairs:
            place = self.design.in_link_coordinates(ca.vertcat(*work.relative_positions([name])))
            yield from self._with_rates(PAIR_QUANTITIES, name, place)

    def _with_rates(self, quantities: Sequence[str], name: str, value: ca.SX) -> Iterator[Expression]:
        orders = (value, *self.design.rates(value)) if self.orders > 1 else (value,)
        for quantity, each in zip(quantities, orders, strict=False):
            yield f"{quantity} of {name}", each

    def find(
        self, frames: DesignFrames, values: Mapping[str, Array], rates: Array, is_solved: Array
    ) -> dict[tuple[str, str], Array]:
        """Derivatives (parts, steps + 1, designs) by quantity and name, of designs with `values` (designs,) by name.

        `rates` are those of the inputs (2, inputs, steps + 1, designs) in SI. NaN where positions are not there or are
        singular, and in numbers that cannot change alone.
        """
        shape = frames.design_shape
        found = {
            (what, number): np.full((value.numel(), *shape), np.nan)
            for what, value in self.expressions
            for number in self.results.derivatives
        }
        for positions in position_chunks(self.reference.mechanism, frames, values, is_solved):
            slopes = self._slopes(positions, frames, rates)
            at, first = (slice(None), positions.steps, positions.designs), 0
            for what, value in self.expressions:
                own = slopes[:, first : first + value.numel()]
                first += value.numel()
                for k, number in enumerate(self.results.derivatives):
                    found[what, number][at] = own[:, :, k].T
        return {("derivatives", derivative_name(*key)): each for key, each in found.items()}

    def _slopes(self, positions: DesignPositions, frames: DesignFrames, rates: Array) -> Array:
        """The derivatives (n, results, numbers)."""
        at = positions.steps, positions.designs
        inputs = [given.pair for given in self.reference.mechanism.inputs]
        places = [np.broadcast_to(frames.inputs[pair], frames.design_shape)[at] for pair in inputs]
        given = [*places, *(rates[order, k][at] for order in (0, 1) for k in range(len(inputs)))]
        given += [value_at(positions.mechanism, each.address) for each in self.design.dimensions]
        many = len(positions.steps)
        t = np.array([np.broadcast_to(np.asarray(each, dtype=float), (many,)) for each in given]).T
        unknowns = [np.broadcast_to(each, (many, each.shape[1])) for each in self.design.unknowns_at(positions)]
        told = self.system.slopes(self.jacobians, unknowns[: self.orders], t[:, self.columns], t[:, self.rest])
        count = sum(value.numel() for _, value in self.expressions)
        slopes, opened = told.slopes[:, :count], told.slopes[:, count:]
        tied = told.contradicts | (np.abs(opened * self.scale).max(axis=1, initial=0.0) > OPENING)
        slopes = np.where((tied | self.is_bound)[:, None], np.nan, slopes)
        slopes[told.is_singular] = np.nan
        return slopes


def pair_gaps(design: DesignEquations) -> ca.SX:
    """What all constraints leave open (sizes, rad), those that the equations do without among them."""
    frames, own = design.placed
    work, unit = design.work, design.solver.unit
    rows = pair_residuals(work.mechanism.pairs, frames, work.numbers, own)
    scaled = [value / unit if row.kind is MeasureKind.LENGTH else value for row, value in rows]
    scaled += [pair.contact_gap(work.numbers[pair.name], own[pair.name]) / unit for pair in work.mechanism.pairs]
    return ca.vertcat(ca.SX(0, 1), *scaled)


@lru_cache(maxsize=16)
def design_slopes(reference: ReferenceDesign, results: RequestedResults, rates: bool) -> DesignSlopes:
    """The derivatives of a mechanism's designs, kept: a worker solves many blocks of one sweep."""
    return DesignSlopes(reference, results, rates)
