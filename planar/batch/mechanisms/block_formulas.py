"""The formulas of a block type: how it is assembled, marched, checked, and solved by Newton's method."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import casadi as ca

from planar.batch.mechanisms.block_type import COS, SIN, X1, X2, BlockEquations
from planar.codegen.block_formula import BlockFormula, FormulaInput
from planar.codegen.instructions import CosSin, check_length, expand_angle_sums
from planar.equations.closed_form import ClosedForm
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.generic_evaluation import inline_function
from planar.equations.linear import solve_by_determinants, solve_with_volume
from planar.equations.rates import UnknownRates, block_jacobian, first_and_second_rates
from planar.equations.residuals import closing_error, input_residuals, pair_residuals, scalars, split_pair_numbers
from planar.equations.symbolic_equations import Block
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation, required_values
from planar.model.pairs import MeasureKind as Measure

NAN_PROBE = 1e-300
"""Times what is a number it is nothing beside round-off; times what is none it is none."""


class SymbolicAssembly(NamedTuple):
    """A way to assemble a kind: the numbers of the values that stand for its unknowns, and of its bends."""

    z: list[int]
    cos_sin: dict[int, CosSin]
    bends: list[int]


class FormulaBuilder:
    """The formulas of a kind, put into one listing."""

    def __init__(self, block_equations: BlockEquations):
        self.block_equations, self.equations = block_equations, block_equations.equations
        self.instructions: InstructionList[FormulaInput] = InstructionList()
        e, given, measures = self.equations, len(block_equations.given_links), block_equations.measures
        self.symbols = [e.u, e.p, ca.SX.sym("u1", e.u.numel()), ca.SX.sym("u2", e.u.numel())]
        self.u: list[int] = []
        self.cos_sin: dict[int, CosSin] = {}
        for k in range(e.u.numel()):
            slot, part = (k // 3, k % 3) if k < 3 * given else (given + k - 3 * given, 0)
            self.u.append(self.add_input("angle", slot) if part == 2 else self.add_input("row", slot, part))
            if part == 2 or e.input_kinds[k] is not Measure.LENGTH:
                self.cos_sin[self.u[-1]] = CosSin(self.add_input("row", slot, COS), self.add_input("row", slot, SIN))
        self.p = [self.add_input("p", k) for k in range(len(measures))]
        for place, k in enumerate(block_equations.angle_measures):
            both = (self.add_input("p", len(measures) + 2 * place + part) for part in (0, 1))
            self.cos_sin[self.p[k]] = CosSin(*both)
        rows = [(k // 3, X1 + k % 3, X2 + k % 3) if k < 3 * given else (given + k - 3 * given, X1, X2)
                for k in range(e.u.numel())]  # fmt: skip
        self.u1 = [self.add_input("row", slot, first) for slot, first, _ in rows]
        self.u2 = [self.add_input("row", slot, second) for slot, _, second in rows]

    def add_input(self, source: str, place: int, part: int = 0) -> int:
        """A value from outside; those of "angle" and "unknown" are stood for by their cos and sin."""
        return self.instructions.add_input(FormulaInput(source, place, part))

    def add_unknown(self) -> int:
        """A value that no other is, stood for by its cos and sin, or by what it is put together from."""
        return self.add_input("unknown", len(self.instructions.instructions))

    def _inline(
        self, of: Sequence[ca.SX], outputs: list[ca.SX], z: list[int], more: Sequence[list[int]] = ()
    ) -> list[int]:
        """The values of expressions in z, u, p, u1, u2 and further symbols."""
        whole = ca.densify(ca.vertcat(*outputs))
        function = ca.Function("part", [self.equations.z, *self.symbols, *of], [whole], {"cse": True})
        arguments = [z, self.u, self.p, self.u1, self.u2, *more]
        return inline_function(self.instructions, function, arguments)[0]

    def closed_form_assembly(self, signs: Sequence[int], polished: bool = False) -> SymbolicAssembly:
        """The unknowns, group after group, by their closed forms; polished by a step of Newton's method."""
        e, way = self.equations, len(self.instructions.instructions)
        z = [self.add_input("unknown", way, k) for k in range(e.z.numel())]
        turned, bends, left = {}, [], iter(signs)
        for stage, form in zip(self.block_equations.blocks, self.block_equations.closed_forms, strict=True):
            assert form is not None
            flat = [*(part for found in form.values for part in found), form.coalescence]
            if isinstance(form, ClosedForm):
                values = iter(self._inline([form.sign], flat, z, [[next(left)]]))
            else:
                values = iter(self._inline((), flat, z))
            own = range(stage.unknowns.start, stage.unknowns.stop)
            parts = {k: [next(values) for _ in found] for k, found in zip(own, form.values, strict=True)}
            bends.append(next(values))
            if polished:
                parts = self._polish(stage, z, parts)
            for k, found in parts.items():
                if len(found) == 2:
                    self.cos_sin[z[k]] = turned[k] = CosSin(*found)
                else:
                    z[k] = found[0]
        return SymbolicAssembly(z, turned, bends)

    def newton_formula(self, rates: bool | None) -> BlockFormula:
        """One of the formulas of `NewtonFormulas`: None for the step, else what is told."""
        e, kind = self.equations, self.block_equations
        z, turned = [], {}
        for k, is_angle in enumerate(kind.unknown_is_angle):
            z.append(self.add_unknown() if is_angle else self.add_input("z", k, 0))
            if is_angle:
                turned[k] = self.cos_sin[z[k]] = CosSin(self.add_input("z", k, 0), self.add_input("z", k, 1))
        if rates is None:
            step, square, *lengths = solve_with_volume(ca.densify(ca.jacobian(e.F, e.z)), e.F)
            strength = square / lengths[0] if lengths else square
            return self.make_formula(self._inline((), [step, strength], z))
        way = SymbolicAssembly(z, turned, [])
        poses = rows = self.poses(way)
        if rates:
            rows = [[*pose, *more] for pose, more in zip(poses, self.rates(way), strict=True)]
        left, _ = self.acceptance_values(way, self.residuals(way, poses))
        return self.make_formula([*(each for pose in rows for each in pose), left])

    def _polish(self, stage: Block, z: list[int], parts: dict[int, list[int]]) -> dict[int, list[int]]:
        """The unknowns of a group after a step of Newton's method, angles turned by the rational rotation."""
        e, add, one = self.equations, self.instructions.add, self.instructions.add_constant(1.0)
        near = list(z)
        for k, found in parts.items():
            if len(found) == 2:
                c, s = found
                size = add("sqrt", add("add", add("mul", c, c), add("mul", s, s)))
                parts[k] = [add("div", c, size), add("div", s, size)]
                near[k] = self.add_unknown()
                self.cos_sin[near[k]] = CosSin(*parts[k])
            else:
                near[k] = found[0]
        slope = block_jacobian(e, stage.rows, stage.unknowns)
        step = self._inline((), [solve_by_determinants(slope, e.F[stage.rows])], near)
        polished = {}
        for (k, own), back in zip(parts.items(), step, strict=True):
            if len(own) == 1:
                polished[k] = [add("sub", own[0], back)]
                continue
            c, s = own
            half = add("mul", self.instructions.add_constant(-0.5), back)
            square = add("mul", half, half)
            scale = add("div", one, add("add", one, square))
            cos, sin = add("mul", add("sub", one, square), scale), add("mul", add("add", half, half), scale)
            polished[k] = [
                add("sub", add("mul", c, cos), add("mul", s, sin)),
                add("add", add("mul", s, cos), add("mul", c, sin)),
            ]
        return polished

    def _inner_frames(self) -> tuple[dict[str, Frame], dict[str, tuple[ca.SX, ...]]]:
        """Frames of the inner links and own coordinates of the pairs, in the unknowns."""
        e, kind = self.equations, self.block_equations
        column = coordinate_columns(e.coordinates)
        return frames_from_coordinates(
            ca.vertsplit(e.w), column, kind.inner_links, {pair.name: pair for pair in kind.mechanism.pairs}
        )

    def poses(self, way: SymbolicAssembly) -> list[list[int]]:
        """x, y, cos and sin of every inner link."""
        frames, _ = self._inner_frames()
        parts = [part for name in self.block_equations.inner_links for part in frames[name][:4]]
        values = self._inline((), [ca.SX(part) for part in parts], way.z)
        return [values[4 * k : 4 * k + 4] for k in range(len(self.block_equations.inner_links))]

    def residuals(self, way: SymbolicAssembly, poses: list[list[int]]) -> list[int]:
        """What every constraint leaves open, by the pairs' own formulas: nothing of the elimination is believed.

        Of an angle that closes modulo a turn |sin| + 1 - cos; of cos and sin of an unknown, how far from the circle.
        """
        e, kind = self.equations, self.block_equations
        places = ca.SX.sym("places", 3 * len(kind.inner_links))
        poses_given: list[int] = []
        for x, y, c, s in poses:
            poses_given += [x, y, self.add_unknown()]
            self.cos_sin[poses_given[-1]] = CosSin(c, s)
        names = (*kind.given_links, *kind.inner_links)
        split = [*ca.vertsplit(e.u)[: 3 * len(kind.given_links)], *ca.vertsplit(places)]
        frames = {name: frame_at(*split[3 * k : 3 * k + 3]) for k, name in enumerate(names)} | {"frame": GROUND}
        _, own = self._inner_frames()
        pairs = kind.mechanism.pairs
        numbers = split_pair_numbers(pairs, e.p)
        driven = [pair for pair, joint in zip(pairs, kind.signature.pairs, strict=True) if joint.driven]
        rows = [
            *pair_residuals(pairs, frames, numbers, own),
            *input_residuals(driven, frames, numbers, own, scalars(e.u)[3 * len(kind.given_links) :]),
        ]
        open_ = [closing_error(value, row.kind) for row, value in rows]
        values = self._inline((places,), [ca.SX(each) for each in open_], way.z, (poses_given,))
        add = self.instructions.add
        for c, s in way.cos_sin.values():
            square = add("add", add("mul", c, c), add("mul", s, s))
            values.append(add("sub", square, self.instructions.add_constant(1.0)))
        return values

    def acceptance_values(self, way: SymbolicAssembly, residuals: list[int]) -> list[int]:
        """What is left open at most, and the least of how far from where two ways meet."""
        add = self.instructions.add
        left = whole = self.instructions.add_constant(0.0)
        for gap in residuals:
            own = add("abs", gap)
            left, whole = add("maxnum", left, own), add("add", whole, own)
        # what is no number stays so in a sum, but not in the greatest
        left = add("add", left, add("mul", self.instructions.add_constant(NAN_PROBE), whole))
        clear = self.instructions.add_constant(1.0)
        for k, bend in enumerate(way.bends):
            own = add("sub", self.instructions.add_constant(1.0), bend)
            clear = add("minnum", clear, own) if k else own
        return [left, clear]

    def rates(self, way: SymbolicAssembly) -> list[list[int]]:
        """x', y', angle', then the second ones of every inner link."""
        e, (u1, u2) = self.equations, self.symbols[2:]
        z1, z2 = UnknownRates(e, solve_by_determinants).first_and_second(u1, u2)
        y, y1, y2 = e.y, ca.vertcat(z1, u1), ca.vertcat(z2, u2)
        w = e.w[: 3 * len(self.block_equations.inner_links)]
        both = ca.vertcat(*first_and_second_rates(w, y, y1, y2))
        values = self._inline((), [both], way.z)
        many = 3 * len(self.block_equations.inner_links)
        return [values[3 * k : 3 * k + 3] + values[many + 3 * k : many + 3 * k + 3] for k in range(many // 3)]

    def sketch_distance(self, poses: list[list[int]], sketch_sums: list[list[int]]) -> int:
        """The squared distance of the links' points to the sketch, from the sums of its points, see `BlockType`."""
        add, mul = self.instructions.add, partial(self.instructions.add, "mul")
        whole = self.instructions.add_constant(0.0)
        for (x, y, c, s), (many, px, py, tx, ty, along, across, squares) in zip(poses, sketch_sums, strict=True):
            square = add("add", mul(x, x), mul(y, y))
            turned = add("sub", mul(c, px), mul(s, py)), add("add", mul(s, px), mul(c, py))
            mixed = add("add", mul(x, add("sub", turned[0], tx)), mul(y, add("sub", turned[1], ty)))
            mixed = add("sub", mixed, add("add", mul(c, along), mul(s, across)))
            own = add("add", add("add", mul(many, square), add("add", mixed, mixed)), squares)
            whole = add("add", whole, own)
        return whole

    def make_formula(self, wanted: list[int]) -> BlockFormula:
        """The formula of wanted values. Raises UnsupportedOperation where an angle stands outside cos and sin, or it is
        long."""
        made, numbers = expand_angle_sums(self.instructions, wanted, self.cos_sin)
        leaves: dict[int, FormulaInput] = {}
        order = required_values(made, numbers)
        check_length(len(order))
        for number in order:
            key = made.instructions[number].key
            if key is not None:
                if key.source in ("angle", "unknown"):
                    raise UnsupportedOperation("an angle stands outside cos and sin")
                leaves[number] = key
        return BlockFormula(made, tuple(numbers), leaves)
