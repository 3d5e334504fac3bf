"""The linear family of a structure's coefficients: random members of it, from which others of it are reached."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.isotropic_form import ZERO_TOLERANCE, BlockPolynomials, IsotropicForm
from planar.equations.symbolic_equations import ConstraintEquations
from planar.foundation.arrays import BoolArray, ComplexArray


class CoefficientFamily(NamedTuple):
    """The space that all coefficients of X of one structure span (coefficients, dimensions); those of Y span its
    conjugate."""

    form: IsotropicForm
    span: ComplexArray

    def draw_member(self, rng: np.random.Generator) -> BlockPolynomials:
        """A random member, complex: its Y is not the conjugate of its X."""
        many = self.span.shape[1]
        x, y = (rng.normal(size=many) + 1j * rng.normal(size=many) for _ in range(2))
        return self._split_coefficients(self.span @ x, self.span.conj() @ y)

    def _split_coefficients(self, x: ComplexArray, y: ComplexArray) -> BlockPolynomials:
        loops, singles, many = len(self.form.combined), len(self.form.single), self.form.entry_count
        A, a = x[: loops * many].reshape(loops, many), x[loops * many :].reshape(singles, many)
        B, b = y[: loops * many].reshape(loops, many), y[loops * many :].reshape(singles, many)
        return BlockPolynomials(A, B, a, b)


def coefficient_family(e: ConstraintEquations, form: IsotropicForm, absent: BoolArray) -> CoefficientFamily:
    """The least linear family that holds every linkage of a structure in which some coefficients are `absent`."""
    rng = np.random.default_rng(3)
    wanted = form.entry_count * (len(form.combined) + len(form.single)) + 8
    values = [[rng.uniform(0.5, 2.0, symbol.numel()) for symbol in (e.z, e.u, e.p)] for _ in range(wanted)]
    drawn = np.array([form.polynomials(*each).flat_coefficients[0] for each in values]).T
    span = _span(drawn)
    if absent.any():
        # what vanishes in the one that is wanted is kept away from all of them
        _, sizes, directions = np.linalg.svd(span[absent])
        rank = int(np.sum(sizes > ZERO_TOLERANCE))
        span = _span(span @ directions[rank:].conj().T)
        span[absent] = 0.0
    return CoefficientFamily(form, span)


def _span(columns: ComplexArray) -> ComplexArray:
    """An orthonormal basis of what columns span."""
    directions, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    return directions[:, sizes > 1e-9 * max(sizes[0], 1e-300)] if len(sizes) else columns
