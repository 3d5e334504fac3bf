"""The equations of one block as polynomials in isotropic coordinates: e = exp(i angle) and its conjugate.

A pair of rows (x, y) that closes a loop is F = Fx + i Fy, linear in the e of its angles, and its conjugate linear in
their 1/e (C. Wampler, Solving the kinematics of planar mechanisms by Dixon determinant and a complex-plane
formulation, J. Mech. Des. 123, 2001). A length s along a direction that turns with e is S = s e, its conjugate s/e.

With X = (1, e's, S's) and Y = (1, 1/e's, conjugates of the S's), both up to a factor, the block is

    A X = 0, B Y = 0                                  its paired rows
    (a X) Y0 + X0 (b Y) = 0                           rows that have no other half
    X[j] Y[j] = X0 Y0                                 an angle
    X[m] Y[j] = X[j] Y[m]   or   X[m] Y0 = X0 Y[m]    a length along a direction that turns with e[j], or is known

and where gears tie angles, powers of e are entries too (see `gear_powers`). Once A and B are solved, X and Y lie in
projective spaces of some dimension d each, and 2d equations of bidegree (1, 1) remain: by Bezout's theorem for two
blocks of unknowns C(2d, d) isolated solutions at most, counted as often as they stand for, those at infinity with the
others.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb
from operator import add
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.assemblies.polynomial.gear_powers import AngleArguments, GearPowers, angle_arguments, gear_powers
from planar.equations.casadi_functions import BufferedFunction, is_piecewise_in
from planar.equations.symbolic_equations import Block, ConstraintEquations
from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array, ComplexArray, IntArray
from planar.model.pairs import MeasureKind

ZERO_TOLERANCE = 1e-10
"""Of numbers about one: what is rounding."""
RANDOM_POINTS = 4
"""Random places at which the form is compared with the equations."""


class BlockPolynomials(NamedTuple):
    """One block with numbers filled in; see the module for the letters."""

    A: ComplexArray
    B: ComplexArray
    a: ComplexArray
    b: ComplexArray

    @property
    def flat_coefficients(self) -> tuple[ComplexArray, ComplexArray]:
        """All coefficients of X, and all of Y, each in one row."""
        return (
            np.concatenate([self.A.ravel(), self.a.ravel()]),
            np.concatenate([self.B.ravel(), self.b.ravel()]),
        )


class IsotropicForm(NamedTuple):
    """How the block of one structure is written.

    `angles`, `lengths`: the block's unknowns whose directions and which are X[1:] in this order; `turning`: for each
    length the place in X of the direction that it turns with, 0 for a direction that is known; `real`: what X is
    multiplied by in every real row, as a function of (z, u, p): twice its factors (rows, X) with half the constants;
    `combined`: the rows put together to loops (loops, rows); `single`: to rows of which the other half is missing
    (singles, rows).
    """

    angles: tuple[int, ...]
    lengths: tuple[int, ...]
    direction_index: tuple[int, ...]
    row_factors: ca.Function
    factors_call: BufferedFunction
    combined: Array
    single: Array
    is_redundant: bool
    gears: GearPowers | None
    "where directions are powers of those of new angles, which are X[1:] then"
    start_angles: ca.Function
    "angles (angles, 1) that meet all rows between angles alone, as a function of (z, u, p)"

    @property
    def first_length(self) -> int:
        """The place of the first length in X."""
        return 1 + (self.gears.powers if self.gears else len(self.angles))

    @property
    def entry_count(self) -> int:
        """Entries of X."""
        return self.first_length + len(self.lengths)

    @property
    def real_entries(self) -> list[int]:
        """The entries of X that are real, or lengths along a direction that is known."""
        return [0, *(self.first_length + m for m, j in enumerate(self.direction_index) if not j)]

    @property
    def dimension(self) -> int:
        """d of the module's text."""
        return self.entry_count - 1 - len(self.combined)

    @property
    def bezout_number(self) -> int:
        """C(2d, d)."""
        return comb(2 * self.dimension, self.dimension)

    @property
    def products(self) -> IntArray:
        """(equations, 4): X[i] Y[j] - X[k] Y[l] = 0."""
        turned = self.gears.products if self.gears else [(j, j, 0, 0) for j in range(1, self.first_length)]
        slid = [(self.first_length + m, j, j, self.first_length + m) for m, j in enumerate(self.direction_index)]
        return np.array([*turned, *slid], dtype=int).reshape(-1, 4)

    def polynomials(self, z: Array, u: Array, p: Array) -> BlockPolynomials:
        """The block where all before it stands at z, for inputs u and numbers p."""
        real, imaginary = (each.T for each in self.factors_call(z, u, p))
        alpha: ComplexArray = real + 1j * imaginary
        loops: ComplexArray = self.combined @ alpha
        # of what is real one half stands with X, one with Y: in a loop both are put together
        loops[:, self.real_entries] *= 2.0
        return BlockPolynomials(loops, loops.conj(), self.single @ alpha, self.single @ alpha.conj())

    def nearest_real_unknowns(self, X: ComplexArray, Y: ComplexArray, given: Sequence[Array]) -> Array:
        """The real unknowns of the block (solutions, unknowns) that lie nearest to solutions at finite places, at
        (z, u, p)."""
        found = np.zeros((len(X), len(self.angles) + len(self.lengths)))
        X, Y = X / X[:, :1], Y / Y[:, :1]
        turned = np.angle(X + Y.conj())[:, 1:]
        if self.gears:
            back = self.gears.angles_from_new
            found[:, list(self.angles)] = turned[:, : back.shape[1]] @ back.T + self.start_angles(*given).full().T
        else:
            found[:, list(self.angles)] = turned[:, : len(self.angles)]
        for k, (own, j) in enumerate(zip(self.lengths, self.direction_index, strict=True), self.first_length):
            found[:, own] = (X[:, k] * (Y[:, j] if j else 1.0)).real
        return found

    def complex_unknowns(self, V: ComplexArray) -> ComplexArray:
        """The unknowns of the block (solutions, unknowns) at solutions at finite places, where no gears tie angles."""
        X, Y = (each / each[:, :1] for each in np.split(V, 2, axis=1))
        found = np.zeros((len(X), len(self.angles) + len(self.lengths)), dtype=complex)
        found[:, list(self.angles)] = -1j * np.log(X[:, 1 : self.first_length])
        for k, (own, j) in enumerate(zip(self.lengths, self.direction_index, strict=True), self.first_length):
            found[:, own] = X[:, k] * (Y[:, j] if j else 1.0)
        return found

    def wrap_angles(self, root: Array) -> Array:
        """The same assembly (unknowns,) with angles between -pi and pi, or the least that count turns."""
        angles, root = list(self.angles), root.copy()
        own = root[angles]
        root[angles] = self.gears.least_angles(own) if self.gears else wrap_angle(own)
        return root


def isotropic_form(e: ConstraintEquations, stage: Block, p: Array | None = None) -> IsotropicForm | None:
    """How a block is written; None where its equations are no such polynomials, or leave it free.

    Where angles count turns the numbers p of the pairs are needed: the form is that for their ratios.
    """
    unknowns, rows = stage.unknowns.stop - stage.unknowns.start, stage.rows.stop - stage.rows.start
    if stage.is_free or rows < unknowns or not unknowns:
        return None
    written = (MeasureKind.LENGTH,) if p is None else (MeasureKind.LENGTH, MeasureKind.TURNS)
    if any(row.kind not in written for row in e.rows[stage.rows]) or is_piecewise_in(
        e.F[stage.rows], e.z[stage.unknowns]
    ):
        return None
    own = [e.coordinates[column].kind for column in e.unknowns[stage.unknowns]]
    angles = tuple(k for k, kind in enumerate(own) if kind is MeasureKind.ANGLE)
    lengths = tuple(k for k, kind in enumerate(own) if kind is MeasureKind.LENGTH)
    if len(angles) + len(lengths) != unknowns:
        return None
    (slope,) = evaluate_at_random(e, [ca.jacobian(e.F[stage.rows], e.z[stage.unknowns])])
    if np.linalg.matrix_rank(slope, tol=ZERO_TOLERANCE).max() < unknowns:
        return None
    turns, tied = None, None
    if p is not None:
        turns = angle_arguments(e, stage, angles, p)
        tied = gear_powers(turns.rates, turns.relations) if turns else None
        if tied is None:
            return None
    parts = _RowFactors(e, stage, angles, lengths, turns)
    turning = parts.direction_indices()
    return turning and _pair_rows(e, parts, turning[0], tied, rows - unknowns)


def constant_jacobian(e: ConstraintEquations, stage: Block) -> ca.Function | None:
    """The Jacobian (rows, unknowns) of a block in its own unknowns as a function of (z, u, p); None where it depends on
    them: such a block is linear."""
    if stage.is_free or any(row.kind is MeasureKind.ANGLE for row in e.rows[stage.rows]):
        return None
    own, slope = e.z[stage.unknowns], ca.densify(ca.jacobian(e.F[stage.rows], e.z[stage.unknowns]))
    if not own.numel() or not slope.numel() or ca.depends_on(slope, own):
        return None
    return ca.Function("slope", [e.z, e.u, e.p], [slope])


class _RowFactors:
    """The rows of a block taken apart: by what the cos and sin of angles, and lengths along directions, multiply."""

    def __init__(
        self,
        e: ConstraintEquations,
        stage: Block,
        angles: Sequence[int],
        lengths: Sequence[int],
        of: AngleArguments | None,
    ):
        self.e, self.rows = e, of.rows if of else e.F[stage.rows]
        self.angles, self.lengths = tuple(angles), tuple(lengths)
        own = e.z[stage.unknowns]
        self.turns, self.slides = list(of.symbols) if of else [own[k] for k in angles], [own[k] for k in lengths]
        self.still, self.start = (of.still, of.start) if of else ((), ca.SX.zeros(len(self.angles)))
        self.symbols = of.symbols if of else ()
        own = ca.vertcat(own, *self.symbols)
        none = ca.SX.zeros(own.numel())

        def at_none(expression: ca.SX) -> ca.SX:
            return ca.densify(ca.substitute(expression, own, none))

        def taken(expression: ca.SX) -> tuple[list[tuple[ca.SX, ca.SX]], ca.SX]:
            found = []
            for angle in self.turns:
                slope = ca.jacobian(expression, angle)
                found.append((at_none(-ca.jacobian(slope, angle)), at_none(slope)))
            rest = at_none(expression)
            for cosine, _ in found:
                rest = rest - cosine
            return found, rest

        self.turned, self.rest = taken(self.rows)
        self.along = [taken(ca.jacobian(self.rows, slide)) for slide in self.slides]

    def direction_indices(self) -> tuple[tuple[int, ...]] | None:
        """For every length what it turns with, in a tuple of its own; None where the form is not that of the rows."""
        model = self.rest
        for (cosine, sine), angle in zip(self.turned, self.turns, strict=True):
            model = model + cosine * ca.cos(angle) + sine * ca.sin(angle)
        for (turned, still), slide in zip(self.along, self.slides, strict=True):
            model = model + slide * still
            for (cosine, sine), angle in zip(turned, self.turns, strict=True):
                model = model + slide * (cosine * ca.cos(angle) + sine * ca.sin(angle))
        parts = [still for _, still in self.along]
        parts += [each for turned, _ in self.along for both in turned for each in both]
        gap, *sizes = evaluate_at_random(self.e, [self.rows - model, *parts], self.symbols)
        if not np.all(np.abs(gap) < ZERO_TOLERANCE):
            return None
        there = [bool(np.any(np.abs(each) > ZERO_TOLERANCE)) for each in sizes]
        found, many = [], len(self.turns)
        for k in range(len(self.slides)):
            first = len(self.slides) + 2 * many * k
            with_ = [j + 1 for j in range(many) if there[first + 2 * j] or there[first + 2 * j + 1]]
            with_ += [0] if there[k] else []
            if len(with_) != 1:
                return None
            found.append(with_[0])
        return (tuple(found),)

    def factors(self, turning: Sequence[int], tied: GearPowers | None) -> tuple[ca.SX, ca.SX]:
        """Of every real row what X is multiplied by, real and imaginary part: the row is this and its conjugate's."""
        columns = [(0.5 * self.rest, 0.0 * self.rest)]
        columns += [(0.0 * self.rest, 0.0 * self.rest)] * (tied.powers if tied else len(self.turns))
        for j, factor in enumerate(self.turned, 1):
            k = tied.entry_index[j - 1] if tied else j
            columns[k] = tuple(map(add, columns[k], self._rotated_factor(j, factor, k)))
        for (turned, still), j in zip(self.along, turning, strict=True):
            k = tied.entry_index[j - 1] if tied and j else j
            columns.append(self._rotated_factor(j, turned[j - 1], k) if j else (0.5 * still, 0.0 * still))
        real, imaginary = (ca.horzcat(*each) for each in zip(*columns, strict=True))
        return ca.densify(real), ca.densify(imaginary)

    def _rotated_factor(self, j: int, factor: tuple[ca.SX, ca.SX], place: int) -> tuple[ca.SX, ca.SX]:
        """What a direction is multiplied by, or the power in X that it is but for a direction that is known."""
        real, imaginary = 0.5 * factor[0], -0.5 * factor[1]
        if self.still:
            cosine, sine = ca.cos(self.still[j - 1]), ca.sin(self.still[j - 1])
            real, imaginary = real * cosine - imaginary * sine, real * sine + imaginary * cosine
        # what stands beside X0 is real: half of it belongs to X, half to Y
        return real, imaginary if place else 0.0 * imaginary


def _pair_rows(
    e: ConstraintEquations, parts: _RowFactors, turning: Sequence[int], tied: GearPowers | None, surplus: int
) -> IsotropicForm | None:
    """Rows put together two by two, so that of each two X alone, and Y alone, is left."""
    real, imaginary = parts.factors(turning, tied)
    function = ca.Function("factors", [e.z, e.u, e.p], [real, imaginary])
    values = evaluate_at_random(e, [real, imaginary])
    alpha = values[0] + 1j * values[1]  # (places, rows, X)
    rows = alpha.shape[1]
    # what stands beside X0 and lengths along known directions is real and belongs to both
    known = [alpha.shape[2] - len(turning) + m for m, j in enumerate(turning) if not j]
    bent = [k for k in range(1, alpha.shape[2]) if k not in known]
    taken: set[int] = set()
    combined, single = [], []
    for i in range(rows):
        if i in taken:
            continue
        match = next(
            (found for k in range(i + 1, rows) if k not in taken and (found := _matching_row(alpha, i, k, bent))), None
        )
        taken.add(i)
        whole = np.zeros(rows, dtype=complex)
        whole[i] = 1.0
        if match is None:
            single.append(whole.real)
        else:
            taken.add(match[0])
            whole[match[0]] = 1j / match[1]
            combined.append(whole)
    loops = np.array(combined, dtype=complex).reshape(-1, rows)
    singles = np.array(single, dtype=float).reshape(-1, rows)
    if surplus:
        loops, singles = _squared_system(loops, singles, rows - surplus)
    turning = tuple(tied.entry_index[j - 1] if tied and j else j for j in turning)
    called, start = BufferedFunction(function), ca.Function("start", [e.z, e.u, e.p], [parts.start])
    return IsotropicForm(
        parts.angles, parts.lengths, turning, function, called, loops, singles, bool(surplus), tied, start
    )


def _matching_row(alpha: Array, i: int, k: int, bent: Sequence[int]) -> tuple[int, float] | None:
    """The row and by how much of it: the row k is the other half of row i, whose sine goes with its cosine."""
    a, b = alpha[:, i][:, bent], alpha[:, k][:, bent]
    largest = np.unravel_index(int(np.argmax(np.abs(a))), a.shape) if a.size else None
    if largest is None or abs(a[largest]) < ZERO_TOLERANCE:
        return None
    ratio = b[largest] / a[largest] * 1j
    if abs(ratio.imag) > ZERO_TOLERANCE:
        return None
    # what elimination adds of other rows are whole multiples: with them nothing is rounded
    by = float(np.round(ratio.real))
    return (k, by) if by and np.all(np.abs(b + 1j * by * a) < ZERO_TOLERANCE) else None


def _squared_system(loops: Array, singles: Array, wanted: int) -> tuple[Array, Array]:
    """As many rows as unknowns: random sums of all, which keep every isolated solution isolated."""
    rng = np.random.default_rng(1)
    paired = min(len(loops), wanted // 2)
    left = wanted - 2 * paired
    pool = np.concatenate([loops.real, loops.imag, singles])
    if paired < len(loops):
        loops = (rng.normal(size=(paired, len(loops))) + 1j * rng.normal(size=(paired, len(loops)))) @ loops
    elif left == len(singles):
        return loops, singles
    return loops, rng.normal(size=(left, len(pool))) @ pool


def evaluate_at_random(e: ConstraintEquations, parts: Sequence[ca.SX], more: Sequence[ca.SX] = ()) -> list[Array]:
    """Expressions in numbers (places, rows, columns): at random places an identity holds by accident nowhere."""
    symbols = [e.z, e.u, e.p, ca.vertcat(*more)]
    function = ca.Function("parts", symbols, [ca.densify(part) for part in parts])
    rng = np.random.default_rng(0)
    found = []
    for _ in range(RANDOM_POINTS):
        values = function(*(rng.uniform(0.5, 2.0, symbol.numel()) for symbol in symbols))
        found.append([each.full() for each in (values if isinstance(values, tuple) else (values,))])
    return [np.array(each) for each in zip(*found, strict=True)]
