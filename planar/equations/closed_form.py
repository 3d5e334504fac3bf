"""Groups of two unknowns in closed form: how they can be assembled, derived from their equations.

Two constraints whose unknowns are angles, entering by their cosines and sines, or lengths, are an equation of complex
numbers, in one of three forms where a, b, d, g do not depend on the unknowns and e is the unit vector of an angle:

    a e1 + b e2 + g = 0      two angles, as between three turning pairs: |g + a e1| = |b|
    a e1 + d s + g = 0       an angle and a length along a direction that is known: |g + d s| = |a|
    (a + d s) e1 + g = 0     an angle and a length along a direction that turns with it: |a + d s| = |g|

Each is a quadratic equation. Its two roots are the two assemblies; they meet at a dead point of the group.
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.equations.constraint_equations import Equations, Stage
from planar.model.pairs import Kind

VANISHES = 1e-10
"""Of numbers about one: what is rounding."""
PLACES = 3
"""Random places at which a form is compared with the equations."""


class Closed(NamedTuple):
    """One group in closed form, as expressions in the symbols of its equations and in `sign`.

    `found`: for each unknown the cos and sin of an angle, or a length alone, given those of earlier groups; `sign`: +1
    or -1, which of the two assemblies; `side`: an expression in all unknowns that has this sign; `bend`: 0 to 1, where
    both assemblies meet, beyond it there is none: the squared cosine of the angle between what holds the group.
    """

    found: tuple[tuple[ca.SX, ...], ...]
    sign: ca.SX
    side: ca.SX
    bend: ca.SX


class _Vector(NamedTuple):
    """A complex number."""

    x: ca.SX
    y: ca.SX

    def __add__(self, other: _Vector) -> _Vector:  # type: ignore[override]
        return _Vector(self.x + other.x, self.y + other.y)

    def __neg__(self) -> _Vector:
        return _Vector(-self.x, -self.y)

    def times(self, other: _Vector) -> _Vector:
        return _Vector(self.x * other.x - self.y * other.y, self.y * other.x + self.x * other.y)

    def by(self, factor: ca.SX) -> _Vector:
        return _Vector(self.x * factor, self.y * factor)

    def along(self, other: _Vector) -> ca.SX:
        """The product with the other's conjugate, its real part: how far this goes along that."""
        return self.x * other.x + self.y * other.y

    def across(self, other: _Vector) -> ca.SX:
        """The same, its imaginary part: positive where this is to the left of that."""
        return self.y * other.x - self.x * other.y

    @property
    def square(self) -> ca.SX:
        return self.along(self)

    @property
    def conjugate(self) -> _Vector:
        return _Vector(self.x, -self.y)


def closed(e: Equations, stage: Stage) -> Closed | None:
    """The closed form of a group; None where it has none of the three forms."""
    if stage.free or stage.rows.stop - stage.rows.start != 2 or stage.unknowns.stop - stage.unknowns.start != 2:
        return None
    angles = [e.coordinates[column].kind is Kind.ANGLE for column in e.unknowns[stage.unknowns]]
    if not any(angles) or any(e.rows[row].kind is Kind.ANGLE for row in range(stage.rows.start, stage.rows.stop)):
        return None
    first = 0 if angles[0] else 1
    unknowns = [e.z[stage.unknowns.start + k] for k in (first, 1 - first)]
    found = _angles(e, stage, unknowns) if all(angles) else _angle_and_length(e, stage, unknowns)
    return found and found._replace(found=found.found[::-1] if first else found.found)


def _angles(e: Equations, stage: Stage, unknowns: list[ca.SX]) -> Closed | None:
    one, two = unknowns
    rows = e.F[stage.rows]
    a, turning_a = _turned(ca.substitute(rows, two, 0.0), one)
    b, turning_b = _turned(ca.substitute(rows, one, 0.0), two)
    g = ca.substitute(rows, ca.vertcat(one, two), ca.SX.zeros(2)) - a - b
    model = g + _applied(a, turning_a, one) + _applied(b, turning_b, two)
    signs = _similar(e, rows - model, [(a, turning_a), (b, turning_b)])
    if signs is None or 0 in signs:
        return None
    a, b, g = (_read(part, signs) for part in (a, b, g))
    d = -g
    sign = ca.SX.sym("sign")
    spanned, gap = a.square * b.square, 0.5 * (a.square + b.square - d.square)
    # spanned less the gap's square, as Heron has it: so nothing cancels where the angles are small
    one_length, other_length = ca.sqrt(a.square), ca.sqrt(b.square)
    least, greatest = one_length - other_length, one_length + other_length
    across = sign * 0.5 * ca.sqrt((d.square - least * least) * (greatest * greatest - d.square))
    scale = 1.0 / d.square
    along = 0.5 + 0.5 * (a.square - b.square) * scale
    reached = d.by(along) + _Vector(-d.y, d.x).by(across * scale)
    e1 = reached.times(a.conjugate).by(1.0 / a.square)
    e2 = (d + -reached).times(b.conjugate).by(1.0 / b.square)
    side = a.times(_unit(one)).across(b.times(_unit(two)))
    return Closed((tuple(e1), tuple(e2)), sign, side, gap * gap / spanned)


def _angle_and_length(e: Equations, stage: Stage, unknowns: list[ca.SX]) -> Closed | None:
    turn, slide = unknowns
    rows = e.F[stage.rows]
    still = ca.substitute(rows, slide, 0.0)
    moved = ca.substitute(ca.jacobian(rows, slide), slide, 0.0)
    a, turning_a = _turned(still, turn)
    d, turning_d = _turned(moved, turn)
    g, fixed = (ca.substitute(part, turn, 0.0) - turned for part, turned in ((still, a), (moved, d)))
    model = g + _applied(a, turning_a, turn) + slide * (fixed + _applied(d, turning_d, turn))
    signs = _similar(e, rows - model, [(a, turning_a), (d, turning_d)])
    if signs is None:
        return None
    rest = _vanishing(e, [fixed, d, a])
    fixed, d, a, g = (_read(part, signs) for part in (fixed, d, a, g))
    sign = ca.SX.sym("sign")
    if rest[1] and not rest[0] and not rest[2]:
        # the length goes along a direction that is known
        way, base, reach = fixed, g, a
    elif rest[0] and not rest[1]:
        way, base, reach = d, a, g
    else:
        return None
    gap, spanned = base.across(way), reach.square * way.square
    length = (sign * ca.sqrt(spanned - gap * gap) - base.along(way)) / way.square
    side = way.square * slide + base.along(way)
    if way is fixed:
        unit = (-(g + way.by(length))).times(a.conjugate).by(1.0 / a.square)
    else:
        unit = (-g).times((a + d.by(length)).conjugate).by(1.0 / g.square)
    return Closed((tuple(unit), (length,)), sign, side, gap * gap / spanned)


def _turned(rows: ca.SX, angle: ca.SX) -> tuple[ca.SX, ca.SX]:
    """By what the cos and the sin of an angle are multiplied in rows that depend on it by these alone."""
    slope = ca.jacobian(rows, angle)
    return -ca.substitute(ca.jacobian(slope, angle), angle, 0.0), ca.substitute(slope, angle, 0.0)


def _applied(cosine: ca.SX, sine: ca.SX, angle: ca.SX) -> ca.SX:
    return cosine * ca.cos(angle) + sine * ca.sin(angle)


def _unit(angle: ca.SX) -> _Vector:
    return _Vector(ca.cos(angle), ca.sin(angle))


def _read(rows: ca.SX, signs: list[int]) -> _Vector:
    """Two rows as a complex number: the other way round where that makes angles turn to the left."""
    rows = ca.densify(rows)
    return _Vector(rows[1], rows[0]) if -1 in signs else _Vector(rows[0], rows[1])


def _similar(e: Equations, gap: ca.SX, turned: list[tuple[ca.SX, ca.SX]]) -> list[int] | None:
    """Which way every pair of factors turns: +1 left, -1 right, 0 where both vanish; None where the form is not it.

    Left: the factors of the sine are those of the cosine, turned to the left by a right angle. All have to turn alike,
    and the form has to agree with the equations.
    """
    found, values = [], [_at_places(e, [gap, *each]) for each in turned]
    for left, cosine, sine in values:
        if not np.all(np.abs(left) < VANISHES):
            return None
        ways = [way for way in (1, -1) if np.all(np.abs(sine - way * np.stack([-cosine[1], cosine[0]])) < VANISHES)]
        if not ways:
            return None
        found.append(0 if len(ways) == 2 else ways[0])
    return found if len(set(found) - {0}) == 1 else None


def _vanishing(e: Equations, parts: list[ca.SX]) -> list[bool]:
    return [bool(np.all(np.abs(each) < VANISHES)) for each in _at_places(e, parts)]


def _at_places(e: Equations, parts: list[ca.SX]) -> list[np.ndarray]:
    """Expressions (2,) in numbers (2, places): at random places an identity holds by accident nowhere."""
    function = ca.Function("parts", [e.z, e.u, e.p], [ca.densify(part) for part in parts])
    rng = np.random.default_rng(0)
    values = [rng.uniform(0.5, 2.0, (symbol.numel(), PLACES)) for symbol in (e.z, e.u, e.p)]
    found = function(*values)
    return [each.full() for each in (found if isinstance(found, tuple) else (found,))]
