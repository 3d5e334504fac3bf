"""What every function of LLVM IR that solves positions is made of: a mechanism's equations, printed group by group.

The angles' cos and sin are carried, never the angles. A group in closed form is written as that; any other is solved by
Newton's method, whose step turns an angle by the first terms of its cos and sin; what is not quite of length one then
is
brought to it. So no sine stands in the loop, and few divisions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.codegen.instructions import (
    Listing,
    NotPrinted,
    Turned,
    check_length,
    needed,
    without_turning,
)
from planar.codegen.invariant_hoisting import Collecting
from planar.codegen.llvm_ir import Text
from planar.equations.closed_form import Closed, closed
from planar.equations.constraint_equations import Equations, Stage
from planar.equations.functions import length, placed
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.model.mechanism import Mechanism, motions
from planar.model.pairs import Kind

FASTEST = 0.5
"""rad that a link may turn from one step to the next: farther apart they do not show what lies between."""
WEAK = 1e-2
"""A group whose slope is less regular than this (of more than two unknowns, than its power of 1.5: it is a volume) is
left to the general path."""

Leaf = tuple[str, int]
"""A number that the expressions take: which kind of it, and its index.

"z" of an unknown, "zc" and "zs" the cos and sin of an angle; "u", "uc", "us" the same of what is given; "p" the numbers
of pairs, "q" those of points; "u1", "u2" rates of what is given; "sign" of a group in closed form.
"""
Have = dict[Leaf, str]
"""The names under which numbers stand in the text."""


class Outside(Exception):
    """An angle stands outside cos and sin, so that its value has to be carried beside them."""

    def __init__(self, leaf: Leaf):
        super().__init__()
        self.leaf = leaf


class Part(NamedTuple):
    """A group: its stage, and its closed form if it has one."""

    stage: Stage
    form: Closed | None

    @property
    def unknowns(self) -> range:
        return range(self.stage.unknowns.start, self.stage.unknowns.stop)


class Structure:
    """A mechanism's equations with the groups' closed forms. Raises NotPrinted where a group holds itself twice."""

    def __init__(self, equations: Equations, mechanism: Mechanism, given: Sequence[str] = ()):
        e = self.equations = equations
        if any(length(s.rows) != length(s.unknowns) or s.free for s in e.stages):
            raise NotPrinted("constraints hold each other more than once")
        self.mechanism, self.given = mechanism, tuple(given)
        self.parts = tuple(Part(stage, closed(e, stage)) for stage in e.stages if length(stage.unknowns))
        self.angle = tuple(e.coordinates[column].kind is Kind.ANGLE for column in e.unknowns)
        self.turning = tuple(kind is Kind.ANGLE for kind in e.drives)
        self.forms = tuple(part.form for part in self.parts if part.form is not None)
        self.sides = ca.vertcat(ca.SX(0, 1), *(form.side for form in self.forms))
        self.column = {(c.owner, c.part): k for k, c in enumerate(e.coordinates)}

    def signs(self, z: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Which assembly every group in closed form is in (groups,), +1 or -1."""
        return np.sign(self._sides(z, u, p).full().ravel())

    @cached_property
    def _sides(self) -> ca.Function:
        e = self.equations
        return ca.Function("sides", [e.z, e.u, e.p], [ca.densify(self.sides)])

    def frame(self, link: str) -> Frame:
        """Where a link is, as expressions."""
        if link in self.given:
            first = 3 * self.given.index(link)
            return frame_at(*(self.equations.u[first + k] for k in range(3)))
        if (link, "x") not in self.column:
            return GROUND
        return frame_at(*(self.equations.w[self.column[link, part]] for part in ("x", "y", "angle")))

    def gaps(self) -> ca.SX:
        """What every constraint leaves open, by the pairs' own formulas: nothing of the elimination is believed.

        Of an angle that closes modulo a turn |sin| + 1 - cos, which needs no arc.
        """
        e, mechanism = self.equations, self.mechanism
        pairs = {pair.name: pair for pair in mechanism.pairs}
        _, own = placed(ca.vertsplit(e.w), self.column, (), pairs)
        frames = {link.name: self.frame(link.name) for link in mechanism.links}
        found, first = [], 0
        numbers: dict[str, list[ca.SX]] = {}
        for pair in mechanism.pairs:
            numbers[pair.name] = [e.p[first + k] for k in range(len(pair.measures))]
            first += len(pair.measures)
            left = pair.residual([frames[link] for link in pair.bodies], numbers[pair.name], own[pair.name])
            found += list(zip(pair.constrains, left, strict=True))
        named = motions(mechanism)
        for k, given in enumerate(mechanism.inputs, start=3 * len(self.given)):
            pair = named[given.pair]
            bodies = [frames[link] for link in pair.bodies]
            drive = pair.drive(bodies, numbers.get(pair.name, []), own.get(pair.name, ()))
            found.append((pair.drive_kind, drive - e.u[k]))
        shut = [ca.fabs(ca.sin(left)) + 1.0 - ca.cos(left) if kind is Kind.ANGLE else left for kind, left in found]
        return ca.vertcat(*shut)

    def rates(self, u1: ca.SX, u2: ca.SX) -> tuple[ca.SX, ca.SX]:
        """First and second rates of the unknowns, group after group."""
        e = self.equations
        y = ca.vertcat(e.z, e.u)
        v1, v2 = ca.SX.sym("v1", y.numel()), ca.SX.sym("v2", y.numel())
        first = ca.jtimes(e.F, y, v1)
        second = ca.jtimes(first, y, v1) + ca.jtimes(e.F, y, v2)
        z1, z2 = ca.SX.zeros(e.z.numel()), ca.SX.zeros(e.z.numel())
        for expression, found in ((first, z1), (second, z2)):
            for stage, _ in self.parts:
                known = ca.substitute(expression[stage.rows], ca.vertcat(v1, v2), ca.vertcat(z1, u1, z2, u2))
                found[stage.unknowns] = -solved(self._slope(stage), known)[0]
        return z1, z2

    def step(self, stage: Stage) -> list[ca.SX]:
        """Newton's step of a group, the square of the volume that its slope's columns span, and that of their
        lengths."""
        return list(solved(self._slope(stage), self.equations.F[stage.rows]))

    def _slope(self, stage: Stage) -> ca.SX:
        e = self.equations
        return ca.densify(ca.jacobian(e.F[stage.rows], e.z[stage.unknowns]))


def solved(slope: ca.SX, left: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """slope^-1 left, the square of the volume that its columns span, and the product of the squares of their lengths.

    Up to four unknowns by determinants, which leave nothing where the slope has nothing; of more by QR.
    """
    many = left.numel()
    if many == 1:
        return left / slope, slope * slope, ca.SX(1.0)
    if many > MOST_BY_DETERMINANTS:
        q, r = ca.qr(slope)
        strength = ca.SX(1.0)
        for k in range(many):
            strength = ca.fmin(strength, r[k, k] ** 2 / ca.sumsqr(slope[:, k]))
        return ca.solve(r, ca.mtimes(q.T, left)), strength, ca.SX(1.0)
    both = ca.horzcat(slope, left)
    minors = _minors(both)
    whole = minors[tuple(range(many))]
    scale = 1.0 / whole
    # Cramer's rule: the left side in place of a column, moved there from the end
    step = [
        minors[tuple(k for k in range(many + 1) if k != column)]
        * (1.0 if (many - 1 - column) % 2 == 0 else -1.0)
        * scale
        for column in range(many)
    ]
    lengths = ca.SX(1.0)
    for k in range(many):
        lengths = lengths * ca.sumsqr(slope[:, k])
    return ca.vertcat(*step), whole * whole, lengths


MOST_BY_DETERMINANTS = 4


def _minors(matrix: ca.SX) -> dict[tuple[int, ...], ca.SX]:
    """The determinants of all rows with as many columns, by those of two rows at a time (Laplace)."""
    rows, columns = matrix.shape
    here: dict[tuple[int, ...], ca.SX] = {(): ca.SX(1.0)}
    for first in range(0, rows, 2):
        pair = matrix[first : min(first + 2, rows), :]
        found: dict[tuple[int, ...], ca.SX] = {}
        for chosen, value in here.items():
            rest = [k for k in range(columns) if k not in chosen]
            for own, minor in _of_rows(pair, rest):
                sign = -1.0 if sum(a > b for a in chosen for b in own) % 2 else 1.0
                key = tuple(sorted((*chosen, *own)))
                found[key] = found.get(key, ca.SX(0.0)) + sign * value * minor
        here = found
    return here


def _of_rows(rows: ca.SX, columns: Sequence[int]) -> list[tuple[tuple[int, ...], ca.SX]]:
    if rows.shape[0] == 1:
        return [((k,), rows[0, k]) for k in columns]
    return [
        ((i, j), rows[0, i] * rows[1, j] - rows[0, j] * rows[1, i])
        for n, i in enumerate(columns)
        for j in columns[n + 1 :]
    ]


class Kernel:
    """The text of one function, written front to back: expressions of a structure as values of the lanes."""

    def __init__(self, structure: Structure, lanes: int, points: int, still: frozenset[str], carried: frozenset[Leaf]):
        self.of, self.text, self.carried = structure, Text(lanes), carried
        e = structure.equations
        self.symbols: dict[str, ca.SX] = {
            "z": e.z,
            "u": e.u,
            "p": e.p,
            "q": ca.SX.sym("q", 2 * points),
            "u1": ca.SX.sym("u1", e.u.numel()),
            "u2": ca.SX.sym("u2", e.u.numel()),
            "sign": ca.vertcat(ca.SX(0, 1), *(form.sign for form in structure.forms)),
        }
        self.collecting = Collecting(lambda value: value.data[0] in still)
        self.names: dict[int, str] = {}
        "of what does not vary"
        self.signs = {part.stage.level: k for k, part in enumerate(p for p in structure.parts if p.form is not None)}

    def carries(self, leaf: Leaf) -> bool:
        """Whether an angle's own value is carried beside its cos and sin."""
        return leaf in self.carried

    def values(self, outputs: Sequence[ca.SX], have: Mapping[Leaf, str]) -> list[str]:
        """The values of expressions where numbers stand under these names. Raises Outside, NotPrinted."""
        function = ca.Function("part", list(self.symbols.values()), [ca.densify(ca.vertcat(*outputs))], {"cse": True})
        check_length(self.text.count + function.n_instructions())
        listing = Listing()
        angles: dict[int, Turned] = {}
        arguments = []
        for name, symbol in self.symbols.items():
            numbers = [listing.add("input", data=(name, k)) for k in range(symbol.numel())]
            arguments.append(numbers)
            turned = self.of.angle if name == "z" else self.of.turning if name == "u" else ()
            for k, is_angle in enumerate(turned):
                if is_angle:
                    angles[numbers[k]] = Turned(*(listing.add("input", data=(name + part, k)) for part in "cs"))
        wanted = [each for output in listing.inlined(function, arguments) for each in output]
        turned_out, wanted = without_turning(listing, wanted, angles)
        numbers = self.collecting.again(turned_out, wanted)
        names = self._written(numbers, have)
        check_length(self.text.count)
        return names

    def parted(self, outputs: Sequence[ca.SX], have: Mapping[Leaf, str]) -> list[list[str]]:
        """The same, of each expression by itself."""
        values = iter(self.values(outputs, have))
        return [[next(values) for _ in range(each.numel())] for each in outputs]

    def _written(self, wanted: Sequence[int], have: Mapping[Leaf, str]) -> list[str]:
        made, still = self.collecting.made, self.collecting.still
        order = needed(made, wanted)
        names = {}
        for k in order:
            value = made.values[k]
            if value.what == "input":
                if value.data not in have:
                    raise Outside(value.data)
                names[k] = have[value.data]
        ahead = [k for k in order if k in still and k not in self.names]
        with self.text.ahead():
            self.text.put(made, ahead, self.names, names)
        names |= {k: self.names[k] for k in order if k in still}
        self.text.put(made, [k for k in order if k not in still], names, names)
        return [names[k] for k in wanted]

    def found(self, part: Part, have: Have) -> str:
        """A group in closed form: its unknowns put into `have`, and the bend."""
        assert part.form is not None
        leaves = [
            leaf
            for k, values in zip(part.unknowns, part.form.found, strict=True)
            for leaf in ([("zc", k), ("zs", k)] if len(values) == 2 else [("z", k)])
        ]
        *values, bend = self.values([*(each for of in part.form.found for each in of), part.form.bend], have)
        have.update(zip(leaves, values, strict=True))
        return bend

    def turned(self, cos: str, sin: str, c: str, s: str) -> tuple[str, str]:
        """The cos and sin of a sum of two angles."""
        t = self.text
        return (
            t.binary("sub", t.binary("mul", cos, c), t.binary("mul", sin, s)),
            t.binary("add", t.binary("mul", sin, c), t.binary("mul", cos, s)),
        )

    def turned_by(self, c: str, s: str, by: str) -> tuple[str, str]:
        """The cos and sin of an angle turned by a little."""
        t = self.text
        square = t.binary("mul", by, by)
        cos = t.binary("sub", t.constant(1.0), t.binary("mul", square, t.constant(0.5)))
        sin = t.binary("mul", by, t.binary("sub", t.constant(1.0), t.binary("mul", square, t.constant(1.0 / 6.0))))
        return self.unit(*self.turned(c, s, cos, sin))

    def unit(self, c: str, s: str) -> tuple[str, str]:
        """What is nearly of length one, nearer to it: the inverse root by its first terms."""
        t = self.text
        square = t.binary("add", t.binary("mul", c, c), t.binary("mul", s, s))
        scale = t.binary("sub", t.constant(1.5), t.binary("mul", square, t.constant(0.5)))
        return t.binary("mul", c, scale), t.binary("mul", s, scale)

    def off_circle(self, have: Have) -> list[str]:
        """How far the square of every unknown angle's cos and sin is from one."""
        t = self.text
        return [
            t.binary(
                "sub",
                t.summed([t.binary("mul", have[part, k], have[part, k]) for part in ("zc", "zs")]),
                t.constant(1.0),
            )
            for k, turns in enumerate(self.of.angle)
            if turns
        ]
