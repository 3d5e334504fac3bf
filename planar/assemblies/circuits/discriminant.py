"""The discriminant of a block: a product over all its solutions that is zero where two of them meet.

They are found at once, as eigenvalues, or else followed from the position before: not straight, where on real ways
solutions meet, but by a complex place beside it.
"""

from __future__ import annotations

import numpy as np

from planar.assemblies.block_roots import generic_instance, solve_by_eigenvalues
from planar.assemblies.circuits.chebyshev_zeros import ZERO, SignedLog
from planar.assemblies.polynomial.isotropic_form import BlockPolynomials, IsotropicForm
from planar.assemblies.polynomial.path_tracker import (
    CoefficientHomotopy,
    PathEnds,
    is_duplicate,
    is_finite_solution,
    track_paths,
)
from planar.equations.symbolic_equations import ConstraintEquations
from planar.foundation.arrays import Array, ComplexArray

COMPLEX_MIDPOINT = 0.5 + 0.3j
"""Of the way from one position to another: the complex place between."""
INFINITY_TOLERANCE = 1e-4
"""A solution that does not count once is at infinity where X0 or Y0 is smaller."""


class DeadPointsUnclaimed(Exception):
    """Why dead points of a block are not all found."""


class MovingSolutions:
    """The solutions of one block as what is given moves."""

    def __init__(self, equations: ConstraintEquations, form: IsotropicForm):
        self.equations, self.form = equations, form
        self._by_eigenvalues = True
        self._last_solutions: tuple[BlockPolynomials, ComplexArray] | None = None
        self._many: int | None = None

    def discriminant(self, z: Array, u: Array, p: Array) -> SignedLog:
        """The product of the Jacobian's determinant, X0 = Y0 = 1, over all solutions at finite places.

        Real up to a constant phase: the block is its own mirror image. Zero where some meet, or all but meet. Raises
        Unclaimed where there are not always as many.
        """
        numbers, many = self.form.polynomials(z, u, p), self.form.entry_count
        V = solve_by_eigenvalues(self.form, numbers) if self._by_eigenvalues else None
        if V is None and (self._many is None or not self._by_eigenvalues):
            self._by_eigenvalues = False
            V = self._track_solutions(numbers)
        if V is None:
            return ZERO
        V = V[is_finite_solution(V)]
        if self._many not in (None, len(V)):
            raise DeadPointsUnclaimed("the number of its complex solutions changes")
        self._many = len(V)
        V = np.concatenate([V[:, :many] / V[:, :1], V[:, many:] / V[:, many : many + 1]], axis=1)
        _, slope, _ = CoefficientHomotopy(self.form, numbers, numbers)(V, np.ones(len(V)))
        kept = [k for k in range(2 * many) if k not in (0, many)]
        signs, sizes = np.linalg.slogdet(slope[:, :, kept])
        whole = complex(np.prod(signs))
        # of a mirror image it is the conjugate, or the conjugate's opposite: the product is real, or imaginary
        part = whole.real if abs(whole.real) > abs(whole.imag) else whole.imag
        return SignedLog(float(np.sign(part)), float(np.sum(sizes)))

    def _track_solutions(self, numbers: BlockPolynomials) -> ComplexArray | None:
        """All that count once at the position before; None where they do not here."""
        if self._last_solutions is None:
            begin = generic_instance(self.equations, self.form, numbers)
            found = _single_ends(track_paths(CoefficientHomotopy(self.form, begin.begin, numbers), begin.V))
            if found is None:
                raise DeadPointsUnclaimed("its complex solutions do not all count once")
        else:
            start, V = self._last_solutions
            beside = BlockPolynomials(*(a + COMPLEX_MIDPOINT * (b - a) for a, b in zip(start, numbers, strict=True)))
            between = _single_ends(track_paths(CoefficientHomotopy(self.form, start, beside), V))
            found = (
                None
                if between is None
                else _single_ends(track_paths(CoefficientHomotopy(self.form, beside, numbers), between))
            )
            if found is None or len(found) < len(V):
                return None
        self._last_solutions = numbers, found
        return found


def _single_ends(ends: PathEnds) -> ComplexArray | None:
    """The ends of all paths that are single solutions; None where some others are not at infinity."""
    lost = ~ends.is_single & is_finite_solution(ends.V, INFINITY_TOLERANCE)
    found = ends.V[ends.is_single]
    return None if lost.any() or is_duplicate(found).any() else found
