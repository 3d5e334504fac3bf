"""Gradients of one linkage's runs: compiled where that can be and is sure, else by the general path."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from math import isfinite

import numpy as np

from planar.batch.design_arrays import read_designs
from planar.batch.gradients.general_gradient import GeneralGradients
from planar.batch.gradients.native_gradient import padded_width, prepare_native_gradient
from planar.batch.gradients.run_gradient import WeightRows, check_finite
from planar.batch.prepare.native_run import NativeRuns
from planar.batch.prepare.run_endings import ALL_SOLVED, STATUS_OF_ENDING, UNSURE
from planar.batch.reference_design import ReferenceDesign
from planar.derivatives.design_equations import design_equations
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput

MAX_KEPT_SUMS = 8
"""Choices of weighed rows whose functions are kept."""
MAX_BLOCK_NUMBERS = 2**22
"""Weights that are laid out at once."""


class RunGradients:
    """Gradients over the positions (steps + 1,) of a run that starts and stops by itself (None) or where it is told.

    `names`: the numbers by which there are derivatives; `bound`: those that cannot change alone. Raises BadInput where
    derivatives are not told of a structure.
    """

    def __init__(
        self,
        reference: ReferenceDesign,
        points: tuple[str, ...],
        rates: bool,
        positions: Array,
        start: float | None,
        stop: float | None,
    ):
        if reference.is_sliding and stop is None:
            raise BadInput(
                "stop", "a slide runs between limits that change with the design; give start and stop for derivatives"
            )
        self._general = GeneralGradients(reference, points, rates)
        self.names, self.bound = self._general.names, self._general.bound
        self._positions, self._range = positions, (start, stop)
        self._width = 0
        self._native: dict[tuple[int, ...], NativeRuns | None] = {}
        self._bound = [k for k, name in enumerate(self.names) if name in self.bound]
        self._solved = np.zeros(len(positions), dtype=np.int8)
        self._solved.flags.writeable = False

    def gradient(self, weights: WeightRows, values: Mapping[str, float]) -> tuple[float, list[float], IntArray]:
        """The weighed sum of a design, its derivatives (names,), and the status of every position. Raises BadInput."""
        native = self._native_sums(weights.rows)
        if native is not None:
            told = self._run_native(native, weights, values)
            if told is not None:
                return told
        check_finite(weights)
        if values:
            read_designs(self._general.reference.mechanism, values)
        value, slopes, status = self._general.gradient(weights, values, *self._range)
        return value, slopes.tolist(), status

    def slopes_of_designs(self, rows: tuple[int, ...], names: tuple[str, ...], designs: Array, weights: Array) -> Array:
        """The derivatives (designs, `self.names`) of sums of these rows, of many designs (designs, names) with weights
        (designs, pairs of rows, steps + 1, 2) each. Raises BadInput."""
        found = np.zeros((len(designs), len(self.names)))
        many = max(MAX_BLOCK_NUMBERS // max(weights[:1].size, 1), 1)
        native = self._native_sums(rows)
        run = None if native is None or native.find_run is None else native.find_run(names)
        for first in range(0, len(designs), many):
            block = slice(first, first + many)
            given, weighed = designs[block], weights[block]
            sure = np.zeros(len(given), dtype=bool)
            if run is not None:
                padded = np.empty((*weighed.shape[:2], self._width, 2))
                padded[:, :, : weighed.shape[2]] = weighed
                sums, ending = run.run_designs(names, given, padded)
                sure = (ending != UNSURE) & np.isfinite(sums).all(axis=1)
                found[block][sure] = sums[sure, 1:]
            for k in np.flatnonzero(~sure):
                values = dict(zip(names, given[k].tolist(), strict=True))
                found[first + k] = self.gradient(WeightRows(rows, tuple(weighed[k])), values)[1]
        found[:, self._bound] = np.nan
        return found

    def _run_native(
        self, native: NativeRuns, weights: WeightRows, values: Mapping[str, float]
    ) -> tuple[float, list[float], IntArray] | None:
        """The same by compiled code; None where it is not sure."""
        # whole vectors of positions; what is behind the last one is not looked at
        rows, count = np.empty((len(weights.arrays), self._width, 2)), len(self._solved)
        for k, array in enumerate(weights.arrays):
            rows[k, :count] = array
        try:
            found, ending, end = native.run(values, rows)
        except KeyError:
            try:
                found, ending, end = native.run_other(values, rows)
            except (KeyError, struct.error, TypeError):
                return None
        except (struct.error, TypeError):
            return None
        if ending == UNSURE:
            return None
        status: IntArray = self._solved
        if ending != ALL_SOLVED:
            status = np.zeros(len(self._positions), dtype=np.int8)
            status[end:] = STATUS_OF_ENDING[ending]
            if not end:
                found = [0.0] * len(found)
        value, *slopes = found
        if not isfinite(sum(slopes, value)):
            return None
        for k in self._bound:
            slopes[k] = np.nan
        return value, slopes, status

    def _native_sums(self, rows: tuple[int, ...]) -> NativeRuns | None:
        """The compiled gradients of sums of these rows; None where there are none."""
        if rows not in self._native:
            if len(self._native) >= MAX_KEPT_SUMS:
                self._native.clear()
            self._native[rows] = self._prepare(rows)
        return self._native[rows]

    def _prepare(self, rows: tuple[int, ...]) -> NativeRuns | None:
        self._width = padded_width(len(self._positions))
        general, may_shift = self._general, self._range == (None, None)
        design = design_equations(general.reference.mechanism)
        return prepare_native_gradient(general.reference, design, general.points, rows, self._positions, may_shift)
