"""What every function of LLVM IR that solves positions is made of: a mechanism's equations, printed group by group.

The angles' cos and sin are carried, never the angles. A group in closed form is written as that; any other is solved by
Newton's method, whose step turns an angle by the first terms of its cos and sin; what is not quite of length one then
is brought to it. So no sine stands in the loop, and few divisions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.codegen.instructions import (
    CosSin,
    InstructionList,
    UnsupportedOperation,
    check_length,
    expand_angle_sums,
    required_values,
)
from planar.codegen.invariant_hoisting import InvariantHoister
from planar.codegen.llvm_ir import IRWriter
from planar.equations.closed_form import ClosedForm, find_closed_form
from planar.equations.constraint_equations import Block, ConstraintEquations, slice_length
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.linear import solve_by_determinants, solve_with_volume
from planar.equations.rates import UnknownRates, block_jacobian
from planar.equations.residuals import closing_error, residuals, scalars, split_pair_numbers
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind

Operand = tuple[str, int]
"""A number that the expressions take: which kind of it, and its index.

"z" of an unknown, "zc" and "zs" the cos and sin of an angle; "u", "uc", "us" the same of what is given; "p" the numbers
of pairs, "q" those of points; "u1", "u2" rates of what is given; "sign" of a group in closed form.
"""
OperandNames = dict[Operand, str]
"""The names under which numbers stand in the text."""


class BareAngle(Exception):
    """An angle stands outside cos and sin, so that its value has to be carried beside them."""

    def __init__(self, operand: Operand):
        super().__init__()
        self.operand = operand


class KernelBlock(NamedTuple):
    """A group: its stage, and its closed form if it has one."""

    block: Block
    closed_form: ClosedForm | None

    @property
    def unknowns(self) -> range:
        return range(self.block.unknowns.start, self.block.unknowns.stop)


class KernelEquations:
    """A mechanism's equations with the groups' closed forms. Raises UnsupportedOperation where a group holds itself
    twice."""

    def __init__(self, equations: ConstraintEquations, mechanism: Mechanism, given: Sequence[str] = ()):
        e = self.equations = equations
        if not e.is_square:
            raise UnsupportedOperation("constraints hold each other more than once")
        self.mechanism, self.given_links = mechanism, tuple(given)
        self.blocks = tuple(
            KernelBlock(stage, find_closed_form(e, stage)) for stage in e.blocks if slice_length(stage.unknowns)
        )
        self.is_angle = tuple(e.coordinates[column].kind is MeasureKind.ANGLE for column in e.unknowns)
        self.input_is_angle = tuple(kind is MeasureKind.ANGLE for kind in e.input_kinds)
        self.closed_forms = tuple(part.closed_form for part in self.blocks if part.closed_form is not None)
        self.sides = ca.vertcat(ca.SX(0, 1), *(form.sign_expression for form in self.closed_forms))
        self.column_of = coordinate_columns(e.coordinates)

    def assembly_signs(self, z: np.ndarray, u: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Which assembly every group in closed form is in (groups,), +1 or -1."""
        return np.sign(self._sides_function(z, u, p).full().ravel())

    @cached_property
    def _sides_function(self) -> ca.Function:
        e = self.equations
        return ca.Function("sides", [e.z, e.u, e.p], [ca.densify(self.sides)])

    def frame(self, link: str) -> Frame:
        """Where a link is, as expressions."""
        if link in self.given_links:
            first = 3 * self.given_links.index(link)
            return frame_at(*(self.equations.u[first + k] for k in range(3)))
        if (link, "x") not in self.column_of:
            return GROUND
        return frame_at(*(self.equations.w[self.column_of[link, part]] for part in ("x", "y", "angle")))

    def residuals(self) -> ca.SX:
        """What every constraint leaves open, by the pairs' own formulas: nothing of the elimination is believed.

        Of an angle that closes modulo a turn |sin| + 1 - cos, which needs no arc.
        """
        e, pairs = self.equations, self.mechanism.pairs
        _, own = frames_from_coordinates(ca.vertsplit(e.w), self.column_of, (), {pair.name: pair for pair in pairs})
        frames = {link.name: self.frame(link.name) for link in self.mechanism.links}
        u = scalars(e.u)[3 * len(self.given_links) :]
        rows = residuals(self.mechanism, frames, split_pair_numbers(pairs, e.p), own, u)
        return ca.vertcat(*(closing_error(value, row.kind) for row, value in rows))

    def rates(self, u1: ca.SX, u2: ca.SX) -> tuple[ca.SX, ca.SX]:
        """First and second rates of the unknowns, group after group."""
        return UnknownRates(self.equations, solve_by_determinants).first_and_second(u1, u2)

    def newton_step(self, stage: Block) -> list[ca.SX]:
        """Newton's step of a group, the square of the volume that its slope's columns span, and that of their
        lengths."""
        e = self.equations
        return list(solve_with_volume(block_jacobian(e, stage.rows, stage.unknowns), e.F[stage.rows]))


class KernelWriter:
    """The text of one function, written front to back: expressions of a structure as values of the lanes."""

    def __init__(
        self,
        equations: KernelEquations,
        lanes: int,
        points: int,
        invariant: frozenset[str],
        carried: frozenset[Operand],
    ):
        self.equations, self.ir, self.carried = equations, IRWriter(lanes), carried
        e = equations.equations
        self.symbols: dict[str, ca.SX] = {
            "z": e.z,
            "u": e.u,
            "p": e.p,
            "q": ca.SX.sym("q", 2 * points),
            "u1": ca.SX.sym("u1", e.u.numel()),
            "u2": ca.SX.sym("u2", e.u.numel()),
            "sign": ca.vertcat(ca.SX(0, 1), *(form.sign for form in equations.closed_forms)),
        }
        self.hoister = InvariantHoister[Operand](lambda operand: operand[0] in invariant)
        self.hoisted_names: dict[int, str] = {}
        "of what does not vary"
        self.sign_index = {
            part.block.block_index: k for k, part in enumerate(p for p in equations.blocks if p.closed_form is not None)
        }

    def is_carried(self, leaf: Operand) -> bool:
        """Whether an angle's own value is carried beside its cos and sin."""
        return leaf in self.carried

    def write_values(self, outputs: Sequence[ca.SX], names: Mapping[Operand, str]) -> list[str]:
        """The values of expressions where numbers stand under these names. Raises BareAngle, UnsupportedOperation."""
        function = ca.Function("part", list(self.symbols.values()), [ca.densify(ca.vertcat(*outputs))], {"cse": True})
        check_length(self.ir.count + function.n_instructions())
        listing: InstructionList[Operand] = InstructionList()
        angles: dict[int, CosSin] = {}
        arguments = []
        for name, symbol in self.symbols.items():
            numbers = [listing.add_input((name, k)) for k in range(symbol.numel())]
            arguments.append(numbers)
            turned = self.equations.is_angle if name == "z" else self.equations.input_is_angle if name == "u" else ()
            for k, is_angle in enumerate(turned):
                if is_angle:
                    angles[numbers[k]] = CosSin(*(listing.add_input((name + part, k)) for part in "cs"))
        wanted = [each for output in listing.inline_function(function, arguments) for each in output]
        turned_out, wanted = expand_angle_sums(listing, wanted, angles)
        numbers = self.hoister.rebuild(turned_out, wanted)
        written = self._write_instructions(numbers, names)
        check_length(self.ir.count)
        return written

    def write_separately(self, outputs: Sequence[ca.SX], have: Mapping[Operand, str]) -> list[list[str]]:
        """The same, of each expression by itself."""
        values = iter(self.write_values(outputs, have))
        return [[next(values) for _ in range(each.numel())] for each in outputs]

    def _write_instructions(self, wanted: Sequence[int], have: Mapping[Operand, str]) -> list[str]:
        made, still = self.hoister.result, self.hoister.invariants
        order = required_values(made, wanted)
        names = {}
        for k in order:
            operand = made.instructions[k].key
            if operand is not None:
                if operand not in have:
                    raise BareAngle(operand)
                names[k] = have[operand]
        ahead = [k for k in order if k in still and k not in self.hoisted_names]
        with self.ir.hoisted():
            self.ir.write_values(made, ahead, self.hoisted_names, names)
        names |= {k: self.hoisted_names[k] for k in order if k in still}
        self.ir.write_values(made, [k for k in order if k not in still], names, names)
        return [names[k] for k in wanted]

    def write_closed_form(self, part: KernelBlock, names: OperandNames) -> str:
        """A group in closed form: its unknowns put into `have`, and the bend."""
        assert part.closed_form is not None
        leaves = [
            leaf
            for k, values in zip(part.unknowns, part.closed_form.values, strict=True)
            for leaf in ([("zc", k), ("zs", k)] if len(values) == 2 else [("z", k)])
        ]
        *values, bend = self.write_values(
            [*(each for of in part.closed_form.values for each in of), part.closed_form.coalescence], names
        )
        names.update(zip(leaves, values, strict=True))
        return bend

    def write_angle_sum(self, cos: str, sin: str, c: str, s: str) -> tuple[str, str]:
        """The cos and sin of a sum of two angles."""
        t = self.ir
        return (
            t.binary("sub", t.binary("mul", cos, c), t.binary("mul", sin, s)),
            t.binary("add", t.binary("mul", sin, c), t.binary("mul", cos, s)),
        )

    def write_small_rotation(self, c: str, s: str, angle: str) -> tuple[str, str]:
        """The cos and sin of an angle turned by a little."""
        t = self.ir
        square = t.binary("mul", angle, angle)
        cos = t.binary("sub", t.constant(1.0), t.binary("mul", square, t.constant(0.5)))
        sin = t.binary("mul", angle, t.binary("sub", t.constant(1.0), t.binary("mul", square, t.constant(1.0 / 6.0))))
        return self.write_normalised(*self.write_angle_sum(c, s, cos, sin))

    def write_normalised(self, c: str, s: str) -> tuple[str, str]:
        """What is nearly of length one, nearer to it: the inverse root by its first terms."""
        t = self.ir
        square = t.binary("add", t.binary("mul", c, c), t.binary("mul", s, s))
        scale = t.binary("sub", t.constant(1.5), t.binary("mul", square, t.constant(0.5)))
        return t.binary("mul", c, scale), t.binary("mul", s, scale)

    def write_circle_residuals(self, have: OperandNames) -> list[str]:
        """How far the square of every unknown angle's cos and sin is from one."""
        t = self.ir
        return [
            t.binary(
                "sub",
                t.add_all([t.binary("mul", have[part, k], have[part, k]) for part in ("zc", "zs")]),
                t.constant(1.0),
            )
            for k, turns in enumerate(self.equations.is_angle)
            if turns
        ]
