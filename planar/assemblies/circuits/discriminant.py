"""How far the solutions of a group are from where two of them meet: the product of slopes over all, complex ones too.

They are found at once, as eigenvalues, or else followed from the position before: not straight, where on real ways
solutions meet, but by a complex place beside it.
"""

from __future__ import annotations

import numpy as np

from planar.assemblies.block_roots import at_once, instance
from planar.assemblies.circuits.chebyshev_zeros import NONE, Value
from planar.assemblies.polynomial.isotropic_form import Form, Polynomials
from planar.assemblies.polynomial.path_tracker import Between, Ends, at_finite, doubles, followed
from planar.equations.constraint_equations import Equations

Array = np.ndarray

BESIDE = 0.5 + 0.3j
"""Of the way from one position to another: the complex place between."""
MULTIPLE = 1e-4
"""A solution that does not count once is at infinity where X0 or Y0 is smaller."""


class Unclaimed(Exception):
    """Why dead points of a group are not all found."""


class Solutions:
    """The solutions of one group as what is given moves."""

    def __init__(self, equations: Equations, form: Form):
        self.equations, self.form = equations, form
        self._at_once = True
        self._before: tuple[Polynomials, Array] | None = None
        self._many: int | None = None

    def product(self, z: Array, u: Array, p: Array) -> Value:
        """The product of the slope's determinant, X0 = Y0 = 1, over all solutions at finite places.

        Real up to a constant phase: the group is its own mirror image. Zero where some meet, or all but meet. Raises
        Unclaimed where there are not always as many.
        """
        numbers, many = self.form.polynomials(z, u, p), self.form.many
        V = at_once(self.form, numbers) if self._at_once else None
        if V is None and (self._many is None or not self._at_once):
            self._at_once = False
            V = self._followed(numbers)
        if V is None:
            return NONE
        V = V[at_finite(V)]
        if self._many not in (None, len(V)):
            raise Unclaimed("the number of its complex solutions changes")
        self._many = len(V)
        V = np.concatenate([V[:, :many] / V[:, :1], V[:, many:] / V[:, many : many + 1]], axis=1)
        _, slope, _ = Between(self.form, numbers, numbers)(V, np.ones(len(V)))
        kept = [k for k in range(2 * many) if k not in (0, many)]
        signs, sizes = np.linalg.slogdet(slope[:, :, kept])
        whole = complex(np.prod(signs))
        # of a mirror image it is the conjugate, or the conjugate's opposite: the product is real, or imaginary
        part = whole.real if abs(whole.real) > abs(whole.imag) else whole.imag
        return Value(float(np.sign(part)), float(np.sum(sizes)))

    def _followed(self, numbers: Polynomials) -> Array | None:
        """All that count once at the position before; None where they do not here."""
        if self._before is None:
            begin = instance(self.equations, self.form, numbers)
            found = _ended(followed(Between(self.form, begin.begin, numbers), begin.V))
            if found is None:
                raise Unclaimed("its complex solutions do not all count once")
        else:
            start, V = self._before
            beside = Polynomials(*(a + BESIDE * (b - a) for a, b in zip(start, numbers, strict=True)))
            between = _ended(followed(Between(self.form, start, beside), V))
            found = None if between is None else _ended(followed(Between(self.form, beside, numbers), between))
            if found is None or len(found) < len(V):
                return None
        self._before = numbers, found
        return found


def _ended(ends: Ends) -> Array | None:
    """The ends of all paths that are single solutions; None where some others are not at infinity."""
    lost = ~ends.single & at_finite(ends.V, MULTIPLE)
    found = ends.V[ends.single]
    return None if lost.any() or doubles(found).any() else found
