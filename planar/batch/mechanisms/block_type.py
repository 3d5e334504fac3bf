"""What a kind of groups is: links that are solved together from other links whose places are given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca

from planar.batch.march.kernel import solved
from planar.equations.closed_form import Closed, closed
from planar.equations.constraint_equations import Equations, Stage, build
from planar.equations.functions import length
from planar.model.mechanism import Input, Link, Mechanism
from planar.model.pairs import Kind as Measure
from planar.model.pairs import Pair

GROUNDED = -99
"""The body of a signature that is the mechanism's frame."""
X, Y, COS, SIN, X1, Y1, TURN1, X2, Y2, TURN2 = range(10)
"""Rows of a slot: where a link is, then its rates. Of an input X is its position, X1 and X2 its rates."""
POSE = 4
"""Rows of a slot that are a link's place: x, y, cos and sin."""
STATISTICS = 8
"""Numbers of a link's points in the sketch: how many, their sums in the link and in the world, and mixed ones."""


class Joint(NamedTuple):
    """A pair of a kind: its type, its bodies (inner links from 0 on, given ones -1, -2, ...), whether it is driven."""

    type: type[Pair]
    bodies: tuple[int, ...]
    driven: bool


class Signature(NamedTuple):
    """What makes a kind: how many links are inner and given, and the pairs in their order."""

    inner: int
    given: int
    joints: tuple[Joint, ...]


class _Standing:
    """A pair between the links of a kind: the formulas of its type with bodies of its own."""

    def __init__(self, name: str, joint: Joint, like: Pair):
        self.name, self.bodies, self.like = name, tuple(_named(body) for body in joint.bodies), like
        self.constrains, self.measures = like.constrains, like.measures
        self.coordinates, self.drive_kind = like.coordinates, like.drive_kind
        self.residual, self.drive = like.residual, like.drive

    def entry_name(self) -> str:
        return self.name

    @classmethod
    def motions(cls, group: Sequence[_Standing]) -> tuple[_Standing, ...]:
        return tuple(group)


def _named(body: int) -> str:
    return "frame" if body == GROUNDED else f"inner{body}" if body >= 0 else f"given{-1 - body}"


class Structure:
    """One kind of groups: its equations, with those of their groups that are in closed form.

    What it takes, in slots: the given links, the inputs, then the inner links. In numbers: p of the pairs, the cosine
    and sine of those that are angles, then a sign for each group that can be assembled in two ways; where it starts,
    in their place the sums of the points in the sketch, see `statistics`.
    """

    def __init__(self, signature: Signature, likes: Sequence[Pair]):
        self.signature = signature
        pairs = tuple(_Standing(f"p{k}", *each) for k, each in enumerate(zip(signature.joints, likes, strict=True)))
        self.given = tuple(_named(-1 - k) for k in range(signature.given))
        inner = tuple(_named(k) for k in range(signature.inner))
        self.inner = inner
        inputs = tuple(Input(p.name, 0.0) for p, joint in zip(pairs, signature.joints, strict=True) if joint.driven)
        names = ("frame", *inner, *self.given)
        links = tuple(Link(name) for name in names)
        self.mechanism = Mechanism("", "frame", links, pairs, inputs)  # type: ignore[arg-type]
        self.equations: Equations = build(self.mechanism, self.given)
        e = self.equations
        self.inputs = len(inputs)
        self.slots = len(self.given) + self.inputs + len(inner)
        self.measures = tuple(measure for pair in pairs for measure in pair.measures)
        self.angles = tuple(k for k, measure in enumerate(self.measures) if measure is Measure.ANGLE)
        self.lengths = tuple(k for k, measure in enumerate(self.measures) if measure is Measure.LENGTH)
        self.stages = tuple(stage for stage in e.stages if length(stage.rows) or length(stage.unknowns))
        self.closed = [closed(e, stage) or straight(e, stage) for stage in self.stages]
        self.signs = sum(each is not None and isinstance(each, Closed) for each in self.closed)
        "how many groups in it can be assembled in two ways"
        square = all(length(stage.rows) == length(stage.unknowns) and not stage.free for stage in e.stages)
        self.square = square and not any(pair.like.counts_turns for pair in pairs)
        "whether it can be solved without the whole"

    @property
    def turning(self) -> tuple[bool, ...]:
        """Of every unknown whether it is an angle."""
        e = self.equations
        return tuple(e.coordinates[column].kind is not Measure.LENGTH for column in e.unknowns)


class Straight(NamedTuple):
    """A group of lengths that has one assembly: as `Closed`, without a sign."""

    found: tuple[tuple[ca.SX], ...]
    bend: ca.SX


def straight(e: Equations, stage: Stage) -> Straight | None:
    """The only assembly of a group of one or two lengths whose constraints are linear in them; None for others."""
    many = length(stage.unknowns)
    lengths = all(e.coordinates[column].kind is Measure.LENGTH for column in e.unknowns[stage.unknowns])
    if stage.free or many != length(stage.rows) or many > 2 or not lengths:
        return None
    rows, own = e.F[stage.rows], e.z[stage.unknowns]
    slope = ca.densify(ca.jacobian(rows, own))
    if any(e.rows[row].kind is Measure.ANGLE for row in range(stage.rows.start, stage.rows.stop)):
        return None
    if ca.jacobian_sparsity(slope, own).nnz():
        return None
    found = -solved(slope, ca.substitute(rows, own, ca.SX.zeros(many)))[0]
    if many == 1:
        return Straight(((found,),), ca.SX(0.0))
    det = slope[0, 0] * slope[1, 1] - slope[0, 1] * slope[1, 0]
    bend = 1.0 - det * det / (ca.sumsqr(slope[:, 0]) * ca.sumsqr(slope[:, 1]))
    return Straight(tuple((found[k],) for k in range(many)), bend)
