"""Polynomials in isotropic coordinates, as a number that the formulas of pairs run on.

A point x + i y is a symbol z with its conjugate z' = x - i y beside it, so that x = (z + z')/2 and y = (z - z')/(2i); a
direction is e = cos + i sin with e' = cos - i sin. Over the complex numbers z and z' are two unknowns; where they are
conjugate the thing is real.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple, TypeAlias

import casadi as ca

from planar.foundation.geometry import Vector

Monomial: TypeAlias = tuple[int, ...]
"""The symbols of a product, in order, each as often as it stands there."""
NOTHING = 1e-13
"""Coefficients below are rounding: they are made of halves of whole numbers."""


class Symbol(NamedTuple):
    """A complex symbol by two numbers: its own, and that of its conjugate."""

    own: int
    conjugate: int

    @property
    def value(self) -> Polynomial:
        """The symbol itself; its polynomial's conjugate is the other."""
        return variable(self.own)


def symbol(number: int) -> Symbol:
    """The symbol with this place in a list of them."""
    return Symbol(2 * number, 2 * number + 1)


class Polynomial:
    """A sum of products of symbols with complex coefficients."""

    __slots__ = ("terms",)
    __array_ufunc__ = None

    def __init__(self, terms: Mapping[Monomial, complex]):
        self.terms = {key: value for key, value in terms.items() if abs(value) > NOTHING}

    def __add__(self, other: Polynomial | float | complex) -> Polynomial:
        found = dict(self.terms)
        for key, value in as_polynomial(other).terms.items():
            found[key] = found.get(key, 0.0) + value
        return Polynomial(found)

    __radd__ = __add__

    def __neg__(self) -> Polynomial:
        return Polynomial({key: -value for key, value in self.terms.items()})

    def __sub__(self, other: Polynomial | float | complex) -> Polynomial:
        return self + -as_polynomial(other)

    def __rsub__(self, other: float | complex) -> Polynomial:
        return -self + other

    def __mul__(self, other: Polynomial | float | complex) -> Polynomial:
        found: dict[Monomial, complex] = {}
        for one, a in self.terms.items():
            for two, b in as_polynomial(other).terms.items():
                key = tuple(sorted((*one, *two)))
                found[key] = found.get(key, 0.0) + a * b
        return Polynomial(found)

    __rmul__ = __mul__

    @property
    def symbols(self) -> frozenset[int]:
        """The numbers of all that stand in it."""
        return frozenset(each for key in self.terms for each in key)

    @property
    def conjugate(self) -> Polynomial:
        """Every symbol and every coefficient by its conjugate."""
        return Polynomial({tuple(sorted(k ^ 1 for k in key)): value.conjugate() for key, value in self.terms.items()})

    def by_powers(self, number: int) -> dict[int, Polynomial]:
        """What each power of a symbol is multiplied by."""
        found: dict[int, dict[Monomial, complex]] = {}
        for key, value in self.terms.items():
            rest = tuple(each for each in key if each != number)
            found.setdefault(len(key) - len(rest), {})[rest] = value
        return {power: Polynomial(terms) for power, terms in found.items()}

    def constant(self) -> complex | None:
        """Its value, where it is a number."""
        return None if self.symbols else self.terms.get((), 0.0)

    def substitute(self, values: Mapping[int, Polynomial]) -> Polynomial:
        """With polynomials in place of symbols, all at once."""
        if not self.symbols & values.keys():
            return self
        found = Polynomial({})
        for key, value in self.terms.items():
            product = Polynomial({tuple(k for k in key if k not in values): value})
            for k in key:
                if k in values:
                    product = product * values[k]
            found = found + product
        return found

    def with_unit(self, direction: Symbol) -> Polynomial:
        """With e e' = 1 used for a direction."""
        found: dict[Monomial, complex] = {}
        for key, value in self.terms.items():
            left = list(key)
            while direction.own in left and direction.conjugate in left:
                left.remove(direction.own)
                left.remove(direction.conjugate)
            found[tuple(left)] = found.get(tuple(left), 0.0) + value
        return Polynomial(found)

    def expression(self, values: Mapping[int, ca.SX]) -> ca.SX:
        """As an expression of casadi, whose numbers are real."""
        found = ca.SX(0.0)
        for key, value in sorted(self.terms.items()):
            if abs(value.imag) > NOTHING:
                raise ValueError("a coefficient is not real")
            product = ca.SX(value.real)
            for k in key:
                product = product * values[k]
            found = found + product
        return found


def as_polynomial(value: Polynomial | float | complex) -> Polynomial:
    """A number as a polynomial."""
    return value if isinstance(value, Polynomial) else Polynomial({(): complex(value)})


def variable(number: int) -> Polynomial:
    """One symbol."""
    return Polynomial({(number,): 1.0 + 0.0j})


def point(place: Polynomial) -> Vector:
    """x and y of a place x + i y."""
    other = place.conjugate
    return Vector((place + other) * 0.5, (place - other) * -0.5j)


def complex_row(x: Polynomial | float, y: Polynomial | float) -> Polynomial:
    """x + i y of two rows."""
    return as_polynomial(x) + as_polynomial(y) * 1j


class Direction:
    """An angle that formulas meet by its cos and sin alone."""

    def __init__(self, way: Symbol):
        self.symbol, self.way = way, point(way.value)

    def cos(self) -> Polynomial:
        """(e + e')/2."""
        x: Polynomial = self.way.x
        return x

    def sin(self) -> Polynomial:
        """(e - e')/(2i)."""
        y: Polynomial = self.way.y
        return y

    def __add__(self, other: object) -> AngleSum:
        return AngleSum({})

    __radd__ = __add__


class AngleSum:
    """Angles of links added up; what does not vary is left out."""

    def __init__(self, links: Mapping[str, int]):
        self.links = {name: count for name, count in links.items() if count}

    def __add__(self, other: object) -> AngleSum:
        more = other.links if isinstance(other, AngleSum) else {}
        names: Iterable[str] = {**self.links, **more}
        return AngleSum({name: self.links.get(name, 0) + more.get(name, 0) for name in names})

    __radd__ = __add__

    def __neg__(self) -> AngleSum:
        return AngleSum({name: -count for name, count in self.links.items()})

    def __sub__(self, other: object) -> AngleSum:
        return self + (-other if isinstance(other, AngleSum) else 0.0)

    def __rsub__(self, other: object) -> AngleSum:
        return -self
