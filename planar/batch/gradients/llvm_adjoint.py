"""The adjoint of one position as expressions: a weighed sum of what a run tells, derived in the numbers that it takes.

With positions F(z, u, p) = 0, and F' = 0 and F'' = 0 for the rates z' and z'' of the unknowns, and the weighed sum
S(z, z', z'', u, u', u'', q), the multipliers of the levels solve, the last one first,

    A^T l2 = dS/dz''    A^T l1 = d(S - l2 F'')/dz'    A^T l0 = d(S - l2 F'' - l1 F')/dz    with A = dF/dz

and the derivatives are those of S - l2 F'' - l1 F' - l0 F in p, q, u, u' and u'' (A. Griewank, A. Walther, Evaluating
Derivatives, SIAM 2008, ch. 15). A has blocks below its diagonal alone, so that each is solved by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca

from planar.batch.march.kernel import BareAngle, KernelEquations, KernelInstructions, Operand
from planar.batch.march.kernel_writer import KernelWriter, OperandNames
from planar.codegen.llvm_ir import IRWriter
from planar.equations.linear import solve_by_determinants
from planar.equations.rates import block_jacobian, time_derivatives
from planar.equations.symbolic_equations import ConstraintEquations, slice_length
from planar.foundation.instruction_list import UnsupportedOperation


class WeighedRow(NamedTuple):
    """Of what order of a point (0: its position), by its number among the kernel's, a sum takes x and y."""

    order: int
    point: int


class Adjoint(NamedTuple):
    """A weighed sum (sizes, s) and its derivatives, as expressions; those in rates are empty where none are told."""

    value: ca.SX
    in_numbers: ca.SX
    in_points: ca.SX
    in_inputs: ca.SX
    in_input_rates: ca.SX

    @property
    def outputs(self) -> list[ca.SX]:
        """All of them."""
        return list(self)


def adjoint_expressions(kernel: KernelInstructions, weighed: Sequence[WeighedRow], weights: ca.SX) -> Adjoint:
    """The adjoint of rows with weights (2 rows,), in the symbols of a kernel's instructions."""
    e, s = kernel.equations.equations, kernel.symbols
    depth = 1 + max(row.order for row in weighed)
    y = [e.y, ca.vertcat(s["z1"], s["u1"]), ca.vertcat(s["z2"], s["u2"])][:depth]
    orders = _with_rates(kernel.point_coordinates(range(len(kernel.links))), y)
    told = ca.vertcat(*(orders[row.order][2 * row.point : 2 * row.point + 2] for row in weighed))
    value = ca.dot(weights, told)
    levels, unknowns = _with_rates(e.F, y), [s["z"], s["z1"], s["z2"]][:depth]
    rest, names, values = value, [], []
    for level, unknown in reversed(list(zip(levels, unknowns, strict=True))):
        multipliers = ca.SX.sym("l", e.z.numel())
        names.append(multipliers)
        values.append(_solve_transposed(e, ca.gradient(rest, unknown)))
        rest = rest - ca.dot(multipliers, level)
    rates = ca.vertcat(s["u1"], s["u2"]) if depth > 1 else ca.SX(0, 1)
    slopes = [ca.gradient(rest, of) for of in (s["p"], s["q"], e.u, rates)]
    known: list[ca.SX] = []
    if depth > 1:
        known = list(kernel.equations.rates(s["u1"], s["u2"]))[: depth - 1]
    # rates first, then the multipliers, each of which the later ones take
    every = [*unknowns[1:], *names]
    found = ca.substitute_inplace(every, [*known, *values], [value, *slopes])[1]
    return Adjoint(*found)


def _with_rates(value: ca.SX, y: Sequence[ca.SX]) -> list[ca.SX]:
    """What is made of y, and its rates, as many as y has."""
    return [value, *time_derivatives(value, *y)] if len(y) > 1 else [value]


def _solve_transposed(e: ConstraintEquations, right_side: ca.SX) -> ca.SX:
    """The Jacobian's transposed inverse times a right side, from the last block to the first."""
    found = ca.SX.zeros(e.z.numel())
    for block in reversed(e.blocks):
        if slice_length(block.unknowns):
            later = slice(block.rows.stop, e.F.numel())
            known = right_side[block.unknowns]
            if later.start < later.stop:
                known = known - ca.jtimes(e.F[later], e.z[block.unknowns], found[later], True)
            own = block_jacobian(e, block.rows, block.unknowns)
            found[block.rows] = solve_by_determinants(own.T, ca.densify(known))
    return found


LANES = 8
ADJOINT_FUNCTION = "adjoint"
ARGUMENTS = (
    "i64 %good, ptr noalias readonly %numbers, ptr noalias readonly %drive, i64 %width, ptr noalias readonly %state, "
    "i64 %stride, ptr noalias readonly %weights, ptr noalias %sums"
)
"""How many positions are good, from the first on; the numbers of a design; inputs, rows of so many; states, rows so far
apart; weights (weighed rows, so many, 2); and what is written: the sum, and its derivatives one after the other."""


class AdjointFunction(NamedTuple):
    """The function's writer; what the rows of given inputs are, and which numbers the sums are derived by, after the
    sum itself."""

    writer: IRWriter
    inputs: tuple[Operand, ...]
    derived: tuple[Operand, ...]


def write_adjoint(
    equations: KernelEquations,
    links: tuple[str, ...],
    weighed: Sequence[WeighedRow],
    order: Sequence[Operand],
    wanted: range,
) -> AdjointFunction:
    """The function of a structure for weighed rows of points on these links, which reads a design's numbers in this
    order, and the states at the `wanted` ones of their positions. Raises UnsupportedOperation."""
    if equations.has_large_blocks:
        raise UnsupportedOperation("a group has so many unknowns that expressions do not solve it")
    try:
        return _AdjointWriter(equations, links, weighed, order, wanted).write()
    except BareAngle as angle:
        raise UnsupportedOperation(f"an angle counts its turns: {angle.operand}") from None


class _AdjointWriter(KernelWriter):
    def __init__(
        self,
        equations: KernelEquations,
        links: tuple[str, ...],
        weighed: Sequence[WeighedRow],
        order: Sequence[Operand],
        wanted: range,
    ):
        invariant = frozenset({"p", "q", "u1", "u2"})
        super().__init__(equations, links, any(row.order for row in weighed), LANES, invariant, frozenset())
        self.order, self.weighed, self.wanted = order, weighed, wanted
        self.symbols["weight"] = ca.SX.sym("weight", 2 * len(weighed))

    def write(self) -> AdjointFunction:
        """The whole function: blocks of positions, whose parts are added up."""
        t, inputs = self.ir, self.equations.equations.u.numel()
        adjoint = adjoint_expressions(self, self.weighed, self.symbols["weight"])
        rates = [(kind, k) for kind in ("u1", "u2") for k in range(inputs)] if adjoint.in_input_rates.numel() else []
        derived: list[Operand] = [("p", k) for k in range(adjoint.in_numbers.numel())]
        derived += [("q", k) for k in range(adjoint.in_points.numel())]
        derived += [*(("u", k) for k in range(inputs)), *rates]
        t.write_line(f"define internal void @{ADJOINT_FUNCTION}({ARGUMENTS}) {{")
        t.write_label("entry")
        slots = [t.allocate() for _ in range(1 + len(derived))]
        for slot in slots:
            t.store("zeroinitializer", slot)
        have: OperandNames = {
            operand: t.broadcast(t.add_instruction(f"load double, ptr {t.double_pointer('%numbers', str(k))}"))
            for k, operand in enumerate(self.order)
        }
        last = t.add_instruction(f"insertelement <{LANES} x i64> poison, i64 %good, i64 0")
        t.write_line(f"%many = add i64 %good, {LANES - 1}")
        t.write_line(f"%blocks = sdiv i64 %many, {LANES}")
        t.mark_hoist_point()
        t.write_line("%any = icmp sgt i64 %good, 0")
        t.write_line("br i1 %any, label %block, label %after")
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %block]")
        first = t.add_instruction(f"mul i64 %b, {LANES}")
        self._write_given(first, have)
        found = self.write_values(adjoint.outputs, have)
        beyond = t.lanes_from(first, last)
        for value, slot in zip(found, slots, strict=True):
            part = t.select(beyond, t.constant(0.0), value)
            t.store(t.binary("add", t.load(slot), part), slot)
        t.close_loop("b", "blocks", "block", "after")
        t.write_label("after")
        for k, slot in enumerate(slots):
            total = t.reduce("fadd", t.load(slot))
            t.write_line(f"store double {total}, ptr {t.double_pointer('%sums', str(k))}")
        t.write_line("ret void")
        t.write_line("}")
        return AdjointFunction(t, self.input_operands, tuple(derived))

    def _write_given(self, first: str, have: OperandNames) -> None:
        """Where the inputs are, farther than the file has them by as much as the design has; states; and weights."""
        t = self.ir

        def load(base: str, row: int, stride: str) -> str:
            begin = t.add_instruction(f"mul i64 {stride}, {row}")
            return t.load(t.double_pointer(base, t.add_instruction(f"add i64 {begin}, {first}")))

        given = {leaf: load("%drive", k, "%width") for k, leaf in enumerate(self.input_operands)}
        for k, is_angle in enumerate(self.equations.input_is_angle):
            have["u", k] = t.binary("add", given["u", k], have["d", k])
            if is_angle:
                have["uc", k], have["us", k] = self.write_angle_sum(
                    given["uc", k], given["us", k], have["dc", k], have["ds", k]
                )
        have |= self._load_states(first)
        for k in range(len(self.weighed)):
            begin = t.add_instruction(f"mul i64 %width, {k}")
            place = t.add_instruction(f"add i64 {begin}, {first}")
            pointer = t.double_pointer("%weights", t.add_instruction(f"mul i64 {place}, 2"))
            have["weight", 2 * k], have["weight", 2 * k + 1] = t.load_pairs(pointer)

    def _load_states(self, first: str) -> OperandNames:
        """The states at a block of positions; those after the last one are that again."""
        t, wanted = self.ir, self.wanted
        rows = {leaf: t.add_instruction(f"mul i64 %stride, {k}") for k, leaf in enumerate(self.state_operands())}
        places = []
        for lane in range(LANES if rows else 0):
            place = t.add_instruction(f"add i64 {first}, {lane}")
            is_within = t.add_instruction(f"icmp slt i64 {place}, {len(wanted) - 1}")
            place = t.add_instruction(f"select i1 {is_within}, i64 {place}, i64 {len(wanted) - 1}")
            place = t.add_instruction(f"mul i64 {place}, {wanted.step}")
            places.append(t.add_instruction(f"add i64 {place}, {wanted.start}"))

        def load(row: str) -> str:
            if wanted.step == 1:
                begin = t.add_instruction(f"add i64 {first}, {wanted.start}")
                return t.load(t.double_pointer("%state", t.add_instruction(f"add i64 {row}, {begin}")))
            found = "poison"
            for lane, place in enumerate(places):
                pointer = t.double_pointer("%state", t.add_instruction(f"add i64 {row}, {place}"))
                one = t.add_instruction(f"load double, ptr {pointer}")
                found = t.add_instruction(f"insertelement {t.vector} {found}, double {one}, i64 {lane}")
            return found

        return {leaf: load(row) for leaf, row in rows.items()}
