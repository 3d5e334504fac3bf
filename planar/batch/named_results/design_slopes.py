"""Derivatives of what a sweep tells, of many designs at every step, in numbers of the file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property, lru_cache

import numpy as np

from planar.batch.block import DesignBlock, SolvedDesigns
from planar.batch.gradients.marched_slopes import SlopeResults, march_slopes
from planar.batch.march.design_batch import DesignBatch
from planar.batch.named_results.design_forces import position_chunks
from planar.batch.named_results.design_frames import DesignFrames
from planar.batch.named_results.result_rows import (
    LINK_QUANTITIES,
    PAIR_QUANTITIES,
    POINT_QUANTITIES,
    NamedArrays,
    RequestedResults,
    derivative_name,
)
from planar.batch.reference_design import ReferenceDesign
from planar.derivatives.kinematic_slopes import (
    CoordinateMotion,
    Directions,
    KinematicSlopes,
    constraint_elements,
    result_array,
)
from planar.derivatives.parameters import Parameters
from planar.derivatives.result_slopes import tied_dimensions
from planar.document.dimensions import value_at
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, suggest_name
from planar.foundation.jets import Scalar


class DesignSlopes:
    """The derivatives of results over a sweep's positions in some numbers, those of `planar.sensitivity`.

    Raises BadInput where derivatives are not told of a structure, or in a number.
    """

    def __init__(self, reference: ReferenceDesign, results: RequestedResults, rates: bool):
        self.reference, self.results, self.orders = reference, results, 3 if rates else 1
        self.parameters = Parameters(reference.mechanism)
        names = list(self.parameters.names)
        for number in results.derivatives:
            if number not in names:
                hint = suggest_name(number, names, "numbers")
                raise BadInput("derivatives", f"nothing is derived in {number!r:.60}{hint}")
        self.directions = Directions(self.parameters, [names.index(number) for number in results.derivatives])

    @cached_property
    def is_bound(self) -> BoolArray:
        """The numbers that cannot change alone (numbers,)."""
        bound = tied_dimensions(self.reference.mechanism)
        return np.array([number in bound for number in self.results.derivatives])

    @cached_property
    def free(self) -> SlopeResults:
        """The same in the numbers that can change alone, as machine code has it."""
        results = self.results
        numbers = tuple(np.array(results.derivatives, dtype=object)[~self.is_bound])
        return SlopeResults(results.derived_points, results.links, results.pairs, numbers, self.orders > 1)

    def write_free(self, slopes: Array, out: Array) -> None:
        """Write rows of `free` (steps + 1, rows, designs) into those of all numbers."""
        if not self.is_bound.any():
            out[:] = slopes
            return
        of_all = self.free._replace(numbers=self.results.derivatives)
        for rows, free_rows in zip(of_all.split_rows(out), self.free.split_rows(slopes), strict=True):
            rows[:, :, self.is_bound] = np.nan
            rows[:, :, ~self.is_bound] = free_rows

    def march_block(
        self, block: DesignBlock, march: DesignBatch, done: SolvedDesigns
    ) -> tuple[Array, BoolArray] | None:
        """The slopes of a block, which has been solved and marched so, in the numbers that can change alone (steps + 1,
        rows, designs), and the positions that are solved but have none yet (steps + 1, designs); None where machine
        code does not do that."""
        slopes = march_slopes(self.reference, march, self.free, block.designs)
        if slopes is None:
            return None
        is_missing = np.zeros((len(slopes), slopes.shape[2]), dtype=bool)
        # mostly all are numbers, and their sum is one
        if done.status.any() or not np.isfinite(slopes.sum()):
            is_solved = done.status.T == 0
            is_missing = is_solved & ~np.isfinite(slopes).all(axis=1)
            np.copyto(slopes, np.nan, where=~is_solved[:, None])
        return slopes, is_missing

    def find(
        self, frames: DesignFrames, values: Mapping[str, Array], is_solved: BoolArray, arrays: NamedArrays
    ) -> None:
        """Fill in the derivatives of designs with `values` (designs,) by name.

        NaN stays where positions are not there or are singular, and in numbers that cannot change alone.
        """
        elements = constraint_elements(self.reference.mechanism)
        for positions in position_chunks(self.reference.mechanism, frames, values, is_solved):
            numbers = [value_at(positions.mechanism, number.address) for number in self.parameters.dimensions]
            coordinates = elements.coordinates(positions)[: self.orders]
            kinematics = KinematicSlopes(self.parameters, coordinates, self.directions, numbers)
            is_unknown = kinematics.tied | self.is_bound | kinematics.is_singular[:, None]
            places = positions.steps, positions.designs
            for result, parts in self._results(kinematics.motion):
                for axis, part in enumerate(parts):
                    slopes = np.where(is_unknown, np.nan, result_array(part, 1, is_unknown.shape))
                    for number, column in zip(self.results.derivatives, slopes.T, strict=True):
                        arrays["derivatives", derivative_name(result, number)][axis][places] = column

    def _results(self, motion: CoordinateMotion) -> Iterator[tuple[str, tuple[Scalar, ...]]]:
        """What is derived, as `position of E`, with its parts."""
        for name in self.results.derived_points:
            link, point = self.reference.point_member(name)
            local = motion.shapes[link].position(point)
            for rate, quantity in enumerate(POINT_QUANTITIES[: self.orders]):
                yield f"{quantity} of {name}", tuple(motion.place(link, local, rate))
        for name in self.results.links:
            for rate, quantity in enumerate(LINK_QUANTITIES[: self.orders]):
                yield f"{quantity} of {name}", (motion.angle_rates(name, rate),)
        for name in self.results.pairs:
            positions = motion.input_position(motion.relative_motions[name]).parts
            for quantity, part in zip(PAIR_QUANTITIES, positions, strict=False):
                yield f"{quantity} of {name}", (part,)


@lru_cache(maxsize=16)
def design_slopes(reference: ReferenceDesign, results: RequestedResults, rates: bool) -> DesignSlopes:
    """The derivatives of a mechanism's designs, kept: a worker solves many blocks of one sweep."""
    return DesignSlopes(reference, results, rates)
