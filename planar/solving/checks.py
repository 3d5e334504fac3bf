"""Checks of positions: the residual that round-off leaves, and how near the Jacobian is to a lower rank."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from planar.equations.constraint_check import constraint_check
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.model.pairs import Pair

CONTACT_TOLERANCE = 1e-6
"""Sizes: dimensions in files are rounded, so a contact that guides keep closed may be open by as much."""
EPS = float(np.finfo(float).eps)
NEGLIGIBLE_ERROR = 1e-7
"""Relative errors by round-off that are surely below this are neither looked for nor told."""
MAX_RATE_ERROR = 1e-3
"""Angles (rad) and rates that may have greater relative errors are no answer: less than three digits are sure."""
SHORT_ARM = EPS / (NEGLIGIBLE_ERROR * 1e-2**2)
"""Sizes: where no link has a shorter arm and no block is nearer than 1e-2 to being singular, which backends keep clear
of, rounding surely takes no more than that."""


def residual_tolerance(link_count: int | Array, reach: float | Array) -> Array:
    """By how much constraints may be open (sizes, or rad) that close but for rounding; `reach` is the longest length.

    An entry of a residual is a sum of a few terms as long as the mechanism reaches, after one step of rounding for each
    link on the way round a loop.
    """
    return 16.0 * EPS * (4 + link_count) * np.maximum(1.0, reach)


def stack_motion(w: Sequence[Array], u: Sequence[Array]) -> Array:
    """Positions of one motion, and their rates as far as they are needed, as `ResidualCheck` takes them.

    `w` and `u` have the value, the first and the second rate of all coordinates (samples, coordinates) and of all
    inputs (samples, inputs); returns (orders, coordinates and inputs, samples).
    """
    return np.array([np.hstack([rates, of_inputs]).T for rates, of_inputs in zip(w, u, strict=True)])


class ResidualCheck:
    """The constraints of all mechanisms of one structure, lengths in units of a mechanism's size.

    The numbers p of pairs are (numbers,), or (numbers, samples) where samples are of different designs.
    """

    def __init__(self, mechanism: Mechanism, column: Mapping[tuple[str, str], int], open_rows: Collection[int] = ()):
        """`column` is the place of each coordinate; `open_rows` may stay open by a misfit, with which they are judged,
        see `PreparedMechanism.residuals`."""
        self.row_pairs = [pair.name for pair in mechanism.pairs for _ in pair.residual_kinds]
        self.row_pairs += [given.pair for given in mechanism.inputs]
        """The pair of every constraint, the inputs' last."""
        self._open_rows = list(open_rows)
        self._has_contacts = any(type(pair).contact_gap is not Pair.contact_gap for pair in mechanism.pairs)
        self._check = constraint_check(mechanism, len(column))

    def residuals(self, motion: Array, p: Array) -> Array:
        """How far every constraint is open (constraints, samples): lengths of the size, or rad; see `row_pairs`.

        cos and sin of links are computed from their angles. What is not a number counts as infinitely open.
        """
        with np.errstate(all="ignore"):  # of what is not finite
            gaps = self._check.residuals(self._check.evaluate(motion[:1], p), motion)
        gaps[self._open_rows] *= 0.0
        return np.nan_to_num(gaps, nan=np.inf, posinf=np.inf)

    def find_open_contact(self, motion: Array, p: Array) -> tuple[str, float] | None:
        """The first contact that guides have to keep closed and do not: its pair and the gap (sizes).

        No gap but a rate of it: the contact is closed in passing only.
        """
        if not self._has_contacts:
            return None
        with np.errstate(all="ignore"):  # of what is not finite
            evaluated = self._check.evaluate(motion, p)
            scales = self._check.contact_scales(evaluated, motion)
            for name, gap in evaluated.gaps:
                if np.nanmax(np.abs(gap) / scales, initial=0.0) > CONTACT_TOLERANCE:
                    return name, float(np.max(np.abs(gap[0])))
        return None

    def rate_residuals(self, motion: Array, p: Array) -> list[tuple[Array, str]]:
        """How far velocities, then accelerations, break the worst constraint (samples,), as a part of its own terms;
        its pair."""
        worst_rates: list[tuple[Array, str]] = []
        with np.errstate(all="ignore"):  # of what is not finite
            for errors in self._check.rate_errors(self._check.evaluate(motion, p)):
                errors[self._open_rows] *= 0.0
                gaps = np.nan_to_num(errors, nan=np.inf)
                worst = int(np.argmax(gaps.max(axis=1, initial=0.0))) if len(gaps) else -1
                worst_rates.append((gaps.max(axis=0, initial=0.0), self.row_pairs[worst] if worst >= 0 else ""))
        return worst_rates


SINGULAR_TOLERANCE = 1e-6
"""A singular value below this part of the greatest is zero: where constraints touch, rounding leaves about 1e-8."""
MIN_REGULARITY = 1e-5
"""A block is singular where its least singular value is below this part of its links' own reach.

Near a dead point it falls with the square root of the distance to it, so that round-off in the input of one part in
1e16 becomes one in 1e16 / value^2 in the velocity: at 1e-5 six digits remain, below they are lost.
"""
ZERO_REGULARITY = 1e-9
"""A regularity below this is zero but for rounding."""
SINGULAR_DISTANCE_RATIO = 1.5
"""How many times shorter than the distances from singular positions at its two ends a step must be."""
DIFFERENCE_STEP = 1e-6
"""The part of a step over which the change of a Jacobian is taken."""


def rank(matrix: Array, tolerance: float = SINGULAR_TOLERANCE, unit: float = 1e-300) -> int:
    """How many singular values of a matrix (rows, columns) exceed a part of the greatest, or of a greater unit."""
    return _count_nonzero(np.linalg.svd(matrix, compute_uv=False), tolerance, unit) if matrix.size else 0


def null_space(matrix: Array, tolerance: float = SINGULAR_TOLERANCE, unit: float = 1e-300) -> Array:
    """Orthonormal columns that a matrix (rows, columns) takes to zero (columns, nullity); see `rank`."""
    if not matrix.size:
        return np.eye(matrix.shape[1])
    _, values, vectors = np.linalg.svd(matrix)
    return vectors[_count_nonzero(values, tolerance, unit) :].T


def _count_nonzero(values: Array, tolerance: float, unit: float) -> int:
    return int(np.sum(values > tolerance * max(values[0], unit)))


def column_norms(jacobians: Array, least: float | Array) -> Array:
    """The sizes of columns (..., columns), by which they are judged so that a small link counts as much as a large."""
    return np.maximum(np.sqrt(np.add.reduce(jacobians * jacobians, axis=-2)), least)


def singular_distance(least: Array | float, change: Array | np.floating[Any]) -> Array:
    """How far a matrix keeps its rank: until it has changed by its least singular value (Weyl's inequality).

    `change` is the norm of its change by what the distance is counted in.
    """
    return least / np.maximum(change, 1e-300)
