"""Block types: links that are solved together from other links whose poses are known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca

from planar.equations.closed_form import ClosedForm, find_closed_form
from planar.equations.linear import solve_by_determinants
from planar.equations.symbolic_equations import Block, ConstraintEquations, build_equations, slice_length
from planar.model.link_shapes import Link
from planar.model.mechanism import Input, Mechanism
from planar.model.pairs import MeasureKind as Measure
from planar.model.pairs import Pair

FRAME_BODY = -99
"""The body of a signature that is the mechanism's frame."""
X, Y, COS, SIN, X1, Y1, TURN1, X2, Y2, TURN2 = range(10)
"""Rows of a slot: where a link is, then its rates. Of an input X is its position, X1 and X2 its rates."""
POSE_ROWS = 4
"""Rows of a slot that are a link's place: x, y, cos and sin."""
SKETCH_SUMS = 8
"""Numbers of a link's points in the sketch: how many, their sums in the link and in the world, and mixed ones."""


class BlockPair(NamedTuple):
    """A pair of a kind: its type, its bodies (inner links from 0 on, given ones -1, -2, ...), whether it is driven."""

    type: type[Pair]
    bodies: tuple[int, ...]
    driven: bool


class BlockSignature(NamedTuple):
    """What makes a kind: how many links are inner and given, and the pairs in their order."""

    inner_count: int
    given_count: int
    pairs: tuple[BlockPair, ...]


class _SymbolicPair:
    """A pair between the links of a kind: the formulas of its type with bodies of its own."""

    def __init__(self, name: str, joint: BlockPair, like: Pair):
        self.name, self.bodies, self.sample = name, tuple(_body_name(body) for body in joint.bodies), like
        self.residual_kinds, self.number_kinds = like.residual_kinds, like.number_kinds
        self.coordinate_kinds, self.input_kind = like.coordinate_kinds, like.input_kind
        self.residual, self.input_position = like.residual, like.input_position

    def entry_name(self) -> str:
        return self.name

    @classmethod
    def relative_motions(cls, group: Sequence[_SymbolicPair]) -> tuple[_SymbolicPair, ...]:
        return tuple(group)


def _body_name(body: int) -> str:
    return "frame" if body == FRAME_BODY else f"inner{body}" if body >= 0 else f"given{-1 - body}"


class BlockEquations:
    """One kind of groups: its equations, with those of their groups that are in closed form.

    What it takes, in slots: the given links, the inputs, then the inner links. In numbers: p of the pairs, the cosine
    and sine of those that are angles, then a sign for each group that can be assembled in two ways; where it starts,
    in their place the sums of the points in the sketch, see `_sketch_sums` of the initial assembly.
    """

    def __init__(self, signature: BlockSignature, samples: Sequence[Pair]):
        self.signature = signature
        pairs = tuple(
            _SymbolicPair(f"p{k}", *each) for k, each in enumerate(zip(signature.pairs, samples, strict=True))
        )
        self.given_links = tuple(_body_name(-1 - k) for k in range(signature.given_count))
        inner = tuple(_body_name(k) for k in range(signature.inner_count))
        self.inner_links = inner
        inputs = tuple(Input(p.name, 0.0) for p, joint in zip(pairs, signature.pairs, strict=True) if joint.driven)
        names = ("frame", *inner, *self.given_links)
        links = tuple(Link(name) for name in names)
        self.mechanism = Mechanism("", "frame", links, pairs, inputs)  # type: ignore[arg-type]  # pairs as equations ask for them
        self.equations: ConstraintEquations = build_equations(self.mechanism, self.given_links)
        e = self.equations
        self.input_count = len(inputs)
        self.slot_count = len(self.given_links) + self.input_count + len(inner)
        self.measures = tuple(measure for pair in pairs for measure in pair.number_kinds)
        self.angle_measures = tuple(k for k, measure in enumerate(self.measures) if measure is Measure.ANGLE)
        self.length_measures = tuple(k for k, measure in enumerate(self.measures) if measure is Measure.LENGTH)
        self.blocks = tuple(stage for stage in e.blocks if slice_length(stage.rows) or slice_length(stage.unknowns))
        self.closed_forms = [find_closed_form(e, stage) or linear_form(e, stage) for stage in self.blocks]
        self.sign_count = sum(each is not None and isinstance(each, ClosedForm) for each in self.closed_forms)
        "how many groups in it can be assembled in two ways"
        self.is_square = e.is_square and not any(pair.sample.counts_turns for pair in pairs)
        "whether it can be solved without the whole"

    @property
    def unknown_is_angle(self) -> tuple[bool, ...]:
        """Of every unknown whether it is an angle."""
        e = self.equations
        return tuple(e.coordinates[column].kind is not Measure.LENGTH for column in e.unknowns)


class LinearForm(NamedTuple):
    """A group of lengths that has one assembly: as `ClosedForm`, without a sign."""

    values: tuple[tuple[ca.SX], ...]
    coalescence: ca.SX


def linear_form(e: ConstraintEquations, stage: Block) -> LinearForm | None:
    """The only assembly of a group of one or two lengths whose constraints are linear in them; None for others."""
    many = slice_length(stage.unknowns)
    lengths = all(e.coordinates[column].kind is Measure.LENGTH for column in e.unknowns[stage.unknowns])
    if stage.is_free or many != slice_length(stage.rows) or many > 2 or not lengths:
        return None
    rows, own = e.F[stage.rows], e.z[stage.unknowns]
    slope = ca.densify(ca.jacobian(rows, own))
    if any(e.rows[row].kind is Measure.ANGLE for row in range(stage.rows.start, stage.rows.stop)):
        return None
    if ca.jacobian_sparsity(slope, own).nnz():
        return None
    found = -solve_by_determinants(slope, ca.substitute(rows, own, ca.SX.zeros(many)))
    if many == 1:
        return LinearForm(((found,),), ca.SX(0.0))
    det = slope[0, 0] * slope[1, 1] - slope[0, 1] * slope[1, 0]
    bend = 1.0 - det * det / (ca.sumsqr(slope[:, 0]) * ca.sumsqr(slope[:, 1]))
    return LinearForm(tuple((found[k],) for k in range(many)), bend)
