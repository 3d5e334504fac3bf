"""Every assembly of one group of links, those before it given, and how surely there is no other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np

from planar.assemblies.polynomial.certification import able, certified, regular
from planar.assemblies.polynomial.coefficient_family import family
from planar.assemblies.polynomial.completeness import Completeness, Roots
from planar.assemblies.polynomial.eigenvalue_solver import MOST, by_eigenvalues
from planar.assemblies.polynomial.isotropic_form import Form, Polynomials, constant_slope, form
from planar.assemblies.polynomial.path_tracker import (
    Between,
    Ends,
    Generic,
    at_finite,
    doubles,
    ended,
    followed,
    generic,
    normed,
)
from planar.assemblies.solution_curves import ALONG, OPEN, goes_on, one_of_each
from planar.equations.constraint_equations import Equations, Stage
from planar.equations.functions import Program, length
from planar.model.pairs import Kind
from planar.solving.assembly.block_assemblies import SAME, Candidates, closing_of
from planar.solving.newton import CLOSED, Closing, newton, polished
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

MOST_PATHS = 1000
"""Bezout's number up to which paths are followed."""
MOST_GEARED = 300
"""The same where gears tie angles: most paths then go to infinity, and slowly."""
MOST_KEPT = 100
"""Structures of one program that are kept: with gears each ratio makes one."""
REAL = 1e-9
"""A single solution that differs from its mirror image by less (of its size) is taken for real as it stands."""
NEARLY = 0.05
"""One that differs by less is tried on the real equations."""
DOUBLE = 3e-7
"""Least singular value of the real slope, of the greatest, below which two assemblies may meet."""
SETTLED = 12
"""Steps that put what else moves in its place on a way off along an open direction."""
CLOSES, ROUNDED = 30.0, 1e-9
"""How much less open a direction has to be there; below what part of the greatest singular value it is open in full."""
MULTIPLE = 40
"""Newton's steps to a root where several may meet: towards three each leaves two thirds of the way."""
VANISHES = 1e-13
"""Singular values below this part of the greatest are none."""
EPS = float(np.finfo(float).eps)
ABSENT = 1e-13
"""Coefficients below this part of the greatest are none: the structure is one without them."""
MEETING = 1e-3
"""Assemblies that leave a direction open and are nearer to each other than this are one."""


class _Known(NamedTuple):
    """What is kept of a group's structure: the slope of equations that are linear; else its form, and an instance with
    all its solutions for each set of absent coefficients."""

    straight: ca.Function | None
    form: Form | None
    instances: dict[bytes, Generic]


_KNOWN: WeakKeyDictionary[Program, dict[tuple[int, bytes], _Known]] = WeakKeyDictionary()


def roots(setup: Setup, stage: Stage, z: Array, certify: bool = True) -> Roots:
    """Every assembly of a group at the setup's inputs, all groups before it standing at z (unknowns,)."""
    known = _known(setup, stage)
    unknowns = length(stage.unknowns)
    if not unknowns:
        return Roots(
            np.zeros((1, 0)), *np.zeros((2, 1), dtype=bool), 1, 1, Completeness.PROVED, False, "nothing is open"
        )
    if known.straight is not None:
        return _straight(setup, stage, z, known.straight, certify)
    if known.form is None:
        return _searched(setup, stage, z, "its equations are no polynomials of this kind")
    if known.form.bound > (MOST_GEARED if known.form.gears else MOST_PATHS):
        return _searched(setup, stage, z, f"there may be up to {known.form.bound} complex ones")
    found = _Solving(setup, stage, z, known).roots(certify)
    return found or _searched(setup, stage, z, "linkages of this structure have no single solutions")


def _known(setup: Setup, stage: Stage) -> _Known:
    kept = _KNOWN.setdefault(setup.program, {})
    numbers = setup.station.p if setup.outline.counts else None
    key = (stage.level, b"" if numbers is None else numbers.tobytes())
    if key not in kept:
        if len(kept) >= MOST_KEPT:
            kept.clear()
        slope = constant_slope(setup.equations, stage)
        kept[key] = _Known(slope, None if slope else form(setup.equations, stage, numbers), {})
    return kept[key]


def at_once(form: Form, polynomials: Polynomials) -> Array | None:
    """All complex solutions that Bezout's theorem allows (solutions, 2 many), as eigenvalues.

    None where they are too many for that, or do not all count once.
    """
    V = by_eigenvalues(form, polynomials) if form.dimension <= MOST else None
    if V is None or not np.all(np.isfinite(V)):
        return None
    ends = ended(Between(form, polynomials, polynomials), normed(V), np.zeros(len(V), dtype=bool))
    return ends.V if ends.single.all() and not doubles(ends.V).any() else None


def absent(polynomials: Polynomials) -> Array:
    """Which coefficients a linkage's polynomials do not have."""
    coefficients = np.abs(polynomials.flat[0])
    return coefficients < ABSENT * max(float(coefficients.max(initial=0.0)), 1.0)


def instance(equations: Equations, form: Form, polynomials: Polynomials) -> Generic:
    """A random linkage of the structure that a linkage's polynomials have, with all its solutions that count once."""
    return generic(form, family(equations, form, absent(polynomials)).drawn)


class _Complex(NamedTuple):
    """All complex solutions that were found: those that count once, those where several meet or that go on, whether
    every path came to an end, how many there are at finite places, and how they were found."""

    single: Array
    several: Array
    ended: bool
    expected: int
    how: str


class _Solving:
    """One group with its numbers."""

    def __init__(self, setup: Setup, stage: Stage, z: Array, known: _Known):
        self.setup, self.stage, self.z, self.known = setup, stage, z, known
        self.form = known.form
        self.given = (z, setup.station.u, setup.station.p)
        self.polynomials: Polynomials = self.form.polynomials(*self.given)
        self.closing: Closing = closing_of(setup.program, stage, z, *self.given[1:])

    def roots(self, certify: bool) -> Roots | None:
        """See `roots`; None where not even a random linkage of the structure has solutions that count once."""
        found = self._at_once() or self._followed()
        if found is None:
            return None
        single = found.single[at_finite(found.single)]
        real, curve = self._real(found, single)
        proofs, proved, said = np.zeros(len(real), dtype=bool), False, found.how
        if certify and self.form.redundant:
            said += "; it holds more than it needs, which no box proves"
        elif certify and self.form.gears and not self.form.gears.exact:
            said += "; a ratio of its gears is no float, so that no box proves them"
        elif certify and not able():
            said += "; python-flint is not there to certify them"
        elif certify:
            proofs, proved = self._proved(found, real)
            said += "; each proved to be the only one in a box of its own" if proved else ""
        finite = len(single) + int(np.sum(at_finite(found.several, 1e-4)))
        # paths end on a curve at complex places, so that of real curves only starts tell
        whole = Completeness.NUMERICALLY if found.ended and not curve else Completeness.NOT
        double, complete = _double(self.closing, real) & ~proofs, Completeness.PROVED if proved else whole
        return Roots(real, double, proofs, found.expected, finite, complete, curve, said)

    def _at_once(self) -> _Complex | None:
        """By eigenvalues, where there are as many single solutions as Bezout's number."""
        V = at_once(self.form, self.polynomials)
        if V is None:
            return None
        finite = int(np.sum(at_finite(V)))
        away = f", {len(V) - finite} of them at infinity" if finite < len(V) else ""
        said = f"all {len(V)} complex solutions that Bezout's theorem allows, as eigenvalues{away}"
        return _Complex(V, V[:0], True, finite, said)

    def _followed(self) -> _Complex | None:
        """By paths from a random instance of the structure."""
        instance = self._instance()
        if not len(instance.V):
            return None
        between = Between(self.form, instance.begin, self.polynomials)
        ends = followed(between, instance.V)
        for near in (1e-6, 1e-8):
            again = ~ends.near | _met(ends)
            if not again.any():
                break
            closer = followed(between, instance.V[again], near)
            for whole, part in zip(ends, closer, strict=True):
                whole[again] = part
        # where several meet they arrive at one place by right
        several = _met(ends) & (ends.regular < OPEN)
        single = ends.single & ~several
        lost = int(np.sum(~ends.near | (_met(ends) & ~several)))
        said = f"{len(instance.V)} paths from a random linkage of this structure, which has {instance.finite} solutions"
        if lost:
            said += f"; {lost} came to no end"
        return _Complex(ends.V[single], ends.V[~single], not lost, instance.finite, said)

    def _instance(self) -> Generic:
        key = absent(self.polynomials).tobytes()
        if key not in self.known.instances:
            self.known.instances[key] = instance(self.setup.equations, self.form, self.polynomials)
        return self.known.instances[key]

    def _real(self, found: _Complex, single: Array) -> tuple[Array, bool]:
        """The assemblies among the solutions (roots, unknowns), sorted, and whether there is a curve of them."""
        X, Y = single[:, : self.form.many], single[:, self.form.many :]
        X, Y = X / X[:, :1], Y / Y[:, :1]
        off = np.max(np.abs(X - Y.conj()) / np.maximum(1.0, np.abs(X)), axis=1, initial=0.0)
        near = self.form.nearest(X, Y, self.given)
        sure = [polished(self.closing, each) for each in near[off < REAL]]
        tried = self._closed(near[(off >= REAL) & (off < NEARLY)])
        several = found.several[at_finite(found.several, 1e-6)]
        met = self._closed(self.form.nearest(several[:, : self.form.many], several[:, self.form.many :], self.given))
        kept, curves = list(met), []
        if len(found.several):
            kept, curves = _parted(self.setup, self.stage, self.z, self.closing, met)
        every = [self.form.wrapped(each) for each in (*sure, *tried, *kept, *curves)]
        distinct: list[Array] = []
        weak: list[bool] = []
        for number, each in enumerate(every):
            # beside a root that counts once there is an exact one; what else stays open by more than rounding is none
            exact = number < len(sure) and not self.form.redundant
            if not self._closes(each, CLOSED if exact else self.setup.tolerance):
                continue
            open_ = bool(_weakest(self.closing, each[None])[0] < OPEN)
            # where several meet each is found to a root of round-off only
            near = [MEETING if open_ and other else SAME for other in weak]
            if not any(self._same(each, other, within) for other, within in zip(distinct, near, strict=True)):
                distinct.append(each)
                weak.append(open_ and number >= len(sure))  # of single solutions each stands for itself
        distinct.sort(key=lambda each: tuple(np.round(each, 7)))
        return np.array(distinct).reshape(-1, length(self.stage.unknowns)), bool(curves)

    def _closed(self, near: Array) -> list[Array]:
        """Where Newton's method on the real equations leads to from near by, if there."""
        if not len(near):
            return []
        ended_ = newton(self.closing, near)
        return [_multiple(self.closing, each) for each in ended_.unknowns[ended_.closed]]

    def _closes(self, root: Array, within: float) -> bool:
        """Whether all rows are met, those too that a redundant group has more."""
        return bool(np.max(np.abs(self.closing(root[None])[0]), initial=0.0) <= within)

    def _same(self, one: Array, other: Array, within: float = SAME) -> bool:
        angles = list(self.form.angles)
        apart = np.abs(one - other)
        apart[angles] = np.abs(np.exp(1j * one[angles]) - np.exp(1j * other[angles]))
        return bool(np.all(apart < within))

    def _proved(self, found: _Complex, real: Array) -> tuple[Array, bool]:
        """Which assemblies are proved, and whether it is proved that there are no others."""
        proof = certified(self.form, self.given, found.single)
        many = self.form.many
        proofs = np.zeros(len(real), dtype=bool)
        of = found.single[proof.real]
        for near in self.form.nearest(of[:, :many], of[:, many:], self.given):
            proofs |= np.array([self._same(each, near) for each in real], dtype=bool)
        whole = len(found.single) == self.form.bound and bool(np.all(proof.proved & proof.decided))
        return proofs, whole and int(proof.real.sum()) == len(real)


def _met(ends: Ends) -> Array:
    """Which single solutions several paths came to: one of them took another's."""
    met = np.zeros(len(ends.V), dtype=bool)
    met[ends.single] = doubles(ends.V[ends.single])
    return met


def _searched(setup: Setup, stage: Stage, z: Array, why: str) -> Roots:
    """What starts all over the circles lead to."""
    closing = closing_of(setup.program, stage, z, setup.station.u, setup.station.p)
    isolated, curves = _parted(setup, stage, z, closing)
    real = np.array([*isolated, *curves]).reshape(-1, length(stage.unknowns))
    if not setup.outline.counts:
        real = np.where(_angles(setup, stage), np.arctan2(np.sin(real), np.cos(real)), real)
    real = np.array(sorted(real, key=lambda each: tuple(np.round(each, 7)))).reshape(real.shape)
    none = np.zeros(len(real), dtype=bool)
    said = f"searched by starts only: {why}"
    return Roots(real, _double(closing, real), none, None, len(real), Completeness.NOT, bool(curves), said)


def _parted(
    setup: Setup, stage: Stage, z: Array, closing: Closing, met: Sequence[Array] = ()
) -> tuple[list[Array], list[Array]]:
    """Assemblies that stand alone, and one of every curve: of those given and of where starts all over lead to."""
    there = [*met, *(each.z[stage.unknowns] for each in Candidates(setup).everywhere(stage, z))]
    going = [goes_on(closing, each) for each in there]
    on_curves = [each for each, on in zip(there, going, strict=True) if on]
    isolated = [each for each, on in zip(there, going, strict=True) if not on]
    return isolated, one_of_each(closing, on_curves, _angles(setup, stage))


def _angles(setup: Setup, stage: Stage) -> Array:
    """Which unknowns of a group are angles (unknowns,)."""
    own = (setup.equations.coordinates[column] for column in setup.equations.unknowns[stage.unknowns])
    return np.array([each.kind is not Kind.LENGTH for each in own], dtype=bool)


def _straight(setup: Setup, stage: Stage, z: Array, slope: ca.Function, certify: bool) -> Roots:
    """The one assembly of a group whose equations are linear."""
    given = (z, setup.station.u, setup.station.p)
    closing = closing_of(setup.program, stage, z, *given[1:])
    unknowns, rows = length(stage.unknowns), length(stage.rows)
    said = "its equations are linear"
    left, there = closing(np.zeros((1, unknowns)))
    values = np.linalg.svd(there[0], compute_uv=False)
    root = polished(closing, -np.linalg.lstsq(there[0], left[0], rcond=1e-12)[0])
    one = np.ones(1, dtype=bool)
    if np.max(np.abs(closing(root[None])[0])) > CLOSED:
        none = np.zeros((0, unknowns))
        return Roots(none, one[:0], one[:0], 0, 0, Completeness.NUMERICALLY, False, f"{said}, and at odds")
    if values[-1] <= 1e-12 * values[0]:
        return Roots(root[None], one, ~one, 0, 0, Completeness.NUMERICALLY, True, f"{said}, and leave it free")
    proved = certify and rows == unknowns and able() and regular(slope, given)
    whole = Completeness.PROVED if proved else Completeness.NUMERICALLY
    return Roots(root[None], ~one, one & proved, 1, 1, whole, False, said)


def _multiple(closing: Closing, root: Array) -> Array:
    """The place with the least left open on Newton's way from near a root to which several may come.

    A step along what is all but open bends away before the next one brings it nearer, so none is refused.
    """
    best, least = root, np.inf
    for _ in range(MULTIPLE):
        left, slope = closing(root[None])
        left_open = float(np.abs(left).max())
        if left_open < least:
            best, least = root, left_open
        step = np.linalg.pinv(slope[0], rcond=VANISHES) @ left[0]
        if not EPS < np.abs(step).max() < MEETING:
            break
        root = root - step
    return best


def _weakest(closing: Closing, real: Array) -> Array:
    """The least singular value of a group's slope, of the greatest (roots,): none where a direction is open."""
    if not real.size:
        return np.ones(len(real))
    values = np.linalg.svd(closing(real)[1], compute_uv=False)
    return values[:, -1] / np.maximum(values[:, 0], 1e-300)


def _double(closing: Closing, real: Array) -> Array:
    """Where two assemblies or more meet (roots,): a direction is open there, and a way off along it is not.

    Beside a curve of assemblies it is open, or all but open, all along; there they lie apart.
    """
    double = _weakest(closing, real) < DOUBLE
    for k in np.flatnonzero(double):
        slope = closing(real[k][None])[1][0]
        values, way = np.linalg.svd(slope)[1:]
        others, off = np.linalg.pinv(slope, rcond=OPEN), real[k] + ALONG * way[-1]
        for _ in range(SETTLED):  # the other directions only
            off = off - others @ closing(off[None])[0][0]
        weakest = _weakest(closing, off[None])[0]
        double[k] = weakest > CLOSES * max(values[-1] / values[0], ROUNDED)
    return double
