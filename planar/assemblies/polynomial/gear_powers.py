"""Angles tied by gears, as whole multiples of a few new angles whose powers enter the polynomials.

Where cosines and sines are of a[j] theta + c[j] with rational a[j], these span a lattice: with a basis of it as new
angles phi, a[j] theta = n[j] phi for whole n[j], and with t = exp(i phi) a direction is exp(i c[j]) t^n[j]. The powers
are entries of X and Y of their own (see `isotropic_form`), each the product or the quotient of two before it:

    X[m] Y[b] = X[a] Y[0],  X[b] Y[m] = X[0] Y[a]     m = a b
    X[a] Y[b] = X[m] Y[0],  X[b] Y[a] = X[0] Y[m]     m = a / b
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import permutations, product
from math import lcm
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.equations.casadi_functions import OPERATIONS, evaluate_function
from planar.equations.symbolic_equations import Block, ConstraintEquations
from planar.foundation.arrays import Array
from planar.model.pairs import MeasureKind

IntegerVector = tuple[int, ...]

MAX_DENOMINATOR = 1000
"""Greatest denominator of a ratio that is taken for rational."""
RATIONAL_TOLERANCE = 1e-12
"""How near a ratio is to the rational number for which it stands."""


class AngleArguments(NamedTuple):
    """What the cosines and sines in a block's rows are of: `symbols` stand for them in `rows`.

    `rates`: how they change with the block's angles (arguments, angles); `relations`: what rows between angles alone
    are multiplied by (relations, angles), which hold at `start` (angles,); `still`: what the arguments are there.
    """

    rows: ca.SX
    symbols: tuple[ca.SX, ...]
    rates: Array
    still: tuple[ca.SX, ...]
    relations: Array
    start: ca.SX


class GearPowers(NamedTuple):
    """How directions are powers of those of new angles.

    `places`: of every argument the place of its direction in X; `powers`: how many entries of X are directions, the new
    angles' first; `products`: (equations, 4) as in `isotropic_form`; `back`: angles from new ones (angles, new angles);
    `exact`: whether that is so of the ratios as the floats that they are.
    """

    entry_index: tuple[int, ...]
    powers: int
    products: Array
    angles_from_new: Array
    is_exact: bool

    def least_angles(self, angles: Array) -> Array:
        """The same directions with the least angles (angles,), which count turns."""
        period = 2.0 * np.pi * self.angles_from_new
        angles = angles - period @ np.round(np.linalg.pinv(period) @ angles)
        turns = np.array(list(product((0, -1, 1), repeat=period.shape[1])))
        tried = angles + turns @ period.T
        return tried[int(np.argmin(np.abs(tried).sum(axis=1).round(9)))]


class _NonlinearArgument(Exception):
    """A cosine of something that is not linear in a block's angles."""


def angle_arguments(e: ConstraintEquations, stage: Block, angles: Sequence[int], p: Array) -> AngleArguments | None:
    """What a block's cosines and sines are of, for numbers p of the pairs; None where that is not linear in angles."""
    own, rng = e.z[stage.unknowns], np.random.default_rng(2)
    place = [rng.uniform(0.5, 2.0, symbol.numel()) for symbol in (e.z, e.u)]
    found: dict[tuple[float, ...], tuple[ca.SX, Array, ca.SX]] = {}

    def linear(of: ca.SX) -> tuple[Array, ca.SX, Array]:
        rate = ca.densify(ca.jacobian(of, own))
        still = ca.substitute(of, own, ca.SX.zeros(own.numel()))
        if ca.depends_on(rate, e.y):
            raise _NonlinearArgument
        rates, at = (each.full() for each in ca.Function("of", [e.z, e.u, e.p], [rate, still])(*place, p))
        if np.any(np.delete(rates, angles, axis=1)):
            raise _NonlinearArgument
        return rates[:, list(angles)], still, at

    def symbol(of: ca.SX) -> ca.SX:
        if not ca.depends_on(of, own):
            return of
        rates, still, at = linear(of)
        new = ca.SX.sym(f"argument {len(found)}"), rates[0], still
        return found.setdefault((*rates[0], *at.ravel().round(12)), new)[0]

    done: dict[int, Callable[..., Any]] = {
        **OPERATIONS,
        ca.OP_COS: lambda of: ca.cos(symbol(of)),
        ca.OP_SIN: lambda of: ca.sin(symbol(of)),
    }
    loops = [row.kind is MeasureKind.LENGTH for row in e.rows[stage.rows]]
    closed, between = (e.F[stage.rows][np.flatnonzero(np.equal(loops, which)).tolist()] for which in (True, False))
    rows = ca.Function("rows", [e.z, e.u, e.p], [ca.densify(closed)])
    try:
        (written,) = evaluate_function(
            rows, [ca.vertsplit(each) for each in (e.z, e.u, e.p)], ca.SX, lambda code, of: done[code](*of)
        )
        relations, left, _ = linear(ca.densify(between))
    except (_NonlinearArgument, KeyError):
        return None
    start = -ca.mtimes(ca.SX(np.linalg.pinv(relations)), left) if len(relations) else ca.SX.zeros(len(angles))
    symbols = tuple(each for each, _, _ in found.values())
    rates = np.array([of for _, of, _ in found.values()]).reshape(len(found), len(angles))
    offsets = tuple(each + ca.dot(ca.SX(of), start) for (_, _, each), of in zip(found.values(), rates, strict=True))
    return AngleArguments(ca.vertcat(*written), symbols, rates, offsets, relations, start)


def gear_powers(rates: Array, relations: Array) -> GearPowers | None:
    """The powers for arguments with such rates (arguments, angles), angles tied by relations (relations, angles).

    None where the numbers are not rational, or leave angles without arguments.
    """
    ratios, ties = _to_fractions(rates), _to_fractions(relations)
    ways = None if ratios is None or ties is None else _free_directions(ties, rates.shape[1])
    if not ratios or not ways:
        return None
    along = [[_dot(row, way) for way in ways] for row in ratios]
    parts = lcm(*(each.denominator for row in along for each in row))
    basis = np.array(_lattice_basis([[int(each * parts) for each in row] for row in along]), dtype=float) / parts
    if basis.shape != (len(ways), len(ways)):
        return None
    new = np.linalg.inv(basis)
    chain = _PowerChain(len(ways))
    powers = [tuple(int(power) for power in row) for row in np.round(np.array(along, dtype=float) @ new)]
    for power in sorted(powers, key=lambda power: sum(map(abs, power))):
        chain.add_power(power)
    places = tuple(chain.entry_index[power] for power in powers)
    exact = not ties and all(map(_are_equal, rates.tolist(), ratios))
    back = np.array(ways, dtype=float).T @ new
    return GearPowers(places, len(chain.entry_index) - 1, np.array(chain.products, dtype=int), back, exact)


def _to_fractions(numbers: Array) -> list[list[Fraction]] | None:
    """The quotients of small numbers for which floats stand; None where one stands for none."""
    found = [[Fraction(each).limit_denominator(MAX_DENOMINATOR) for each in row] for row in numbers.tolist()]
    gaps = np.abs(np.array(found, dtype=float).reshape(numbers.shape) - numbers)
    return None if np.any(gaps > RATIONAL_TOLERANCE * np.maximum(1.0, np.abs(numbers))) else found


def _are_equal(floats: list[float], ratios: list[Fraction]) -> bool:
    return list(map(Fraction, floats)) == ratios


def _free_directions(relations: list[list[Fraction]], many: int) -> list[list[Fraction]] | None:
    """The ways in which angles can turn while relations hold; None where these depend on each other."""
    ways = [[Fraction(int(j == k)) for j in range(many)] for k in range(many)]
    for row in relations:
        off = [_dot(row, way) for way in ways]
        pivot = next((k for k, each in enumerate(off) if each), None)
        if pivot is None:
            return None
        ways = [
            [a - off[k] / off[pivot] * b for a, b in zip(way, ways[pivot], strict=True)]
            for k, way in enumerate(ways)
            if k != pivot
        ]
    return ways


def _dot(one: list[Fraction], other: list[Fraction]) -> Fraction:
    return sum((a * b for a, b in zip(one, other, strict=True)), Fraction(0))


class _PowerChain:
    """Powers of new directions, each made of two before it."""

    def __init__(self, many: int):
        self.zero: IntegerVector = (0,) * many
        units = [tuple(int(j == k) for j in range(many)) for k in range(many)]
        self.entry_index = {power: place for place, power in enumerate([self.zero, *units])}
        self.products = [(k, k, 0, 0) for k in range(1, many + 1)]

    def add_power(self, power: IntegerVector) -> None:
        """Put a power into X, with as few others on the way as are found at once."""
        if power in self.entry_index or self._add_from_two(power):
            return
        there = list(self.entry_index)
        for between in [each for a, b in product(there, repeat=2) for each in (_sum(a, b), _difference(a, b))]:
            if {_difference(power, between), _difference(between, power), _sum(power, between)} & {*there, between}:
                self._add_from_two(between)
                self._add_from_two(power)
                return
        half = tuple(int(each / 2) for each in power)
        if half == self.zero:
            first = next(k for k, each in enumerate(power) if each)
            half = tuple(each * (k == first) for k, each in enumerate(power))
        self.add_power(half)
        self.add_power(_difference(power, half))
        self._add_from_two(power)

    def _add_from_two(self, power: IntegerVector) -> bool:
        """Whether it is the product or the quotient of two that are there."""
        for one, a in self.entry_index.items():
            other = _difference(power, one)
            inverse = tuple(-each for each in other)
            m = len(self.entry_index)
            if other in self.entry_index:
                b = self.entry_index[other]
                self.products += [(m, b, a, 0), (b, m, 0, a)]
            elif inverse in self.entry_index:
                b = self.entry_index[inverse]
                self.products += [(a, b, m, 0), (b, a, 0, m)]
            else:
                continue
            self.entry_index[power] = m
            return True
        return False


def _sum(one: IntegerVector, other: IntegerVector) -> IntegerVector:
    return tuple(a + b for a, b in zip(one, other, strict=True))


def _difference(one: IntegerVector, other: IntegerVector) -> IntegerVector:
    return tuple(a - b for a, b in zip(one, other, strict=True))


def _lattice_basis(rows: list[list[int]]) -> list[list[int]]:
    """A basis of the lattice that rows of whole numbers span, of short ones (Euclid's algorithm, column by column)."""
    left, basis = [list(row) for row in rows], []
    for column in range(len(rows[0])):
        while len(there := [row for row in left if row[column]]) > 1:
            least = min(there, key=lambda row: abs(row[column]))
            for row in there:
                if row is not least:
                    by = row[column] // least[column]
                    row[:] = [a - by * b for a, b in zip(row, least, strict=True)]
        basis += there
        left = [row for row in left if not row[column]]
    return _reduce_basis(basis)


def _reduce_basis(basis: list[list[int]]) -> list[list[int]]:
    """The same lattice's basis, each less whole multiples of the others while that makes it shorter."""
    changed = True
    while changed:
        changed = False
        for one, other in permutations(basis, 2):
            by = round(Fraction(sum(a * b for a, b in zip(one, other, strict=True)), sum(b * b for b in other)))
            new = [a - by * b for a, b in zip(one, other, strict=True)]
            if sum(a * a for a in new) < sum(a * a for a in one):
                one[:], changed = new, True
    return [row if sum(row) >= 0 else [-each for each in row] for row in basis]
