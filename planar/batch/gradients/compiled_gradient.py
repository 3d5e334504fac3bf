"""The gradient of a weighted sum over a run, behind the stages of that run: the adjoint of its positions.

With positions F(z, u, p) = 0, and F' = 0 and F'' = 0 for the rates z' and z'' of the unknowns, and the weighted sum
S(z, z', z'', u, u', u'', q), the multipliers of the levels solve, the last one first,

    A^T l2 = dS/dz''    A^T l1 = d(S - l2 F'')/dz'    A^T l0 = d(S - l2 F'' - l1 F')/dz    with A = dF/dz

and the derivatives are those of S - l2 F'' - l1 F' - l0 F in p, q, u, u' and u'' (A. Griewank, A. Walther, Evaluating
Derivatives, SIAM 2008, ch. 15). A has blocks below its diagonal alone, so that each is solved by itself. From the
numbers that a run takes of a design the derivatives go on to those in the numbers of its file.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.batch.march.kernel import Operand
from planar.batch.march.kernel_writer import KernelWriter, OperandNames
from planar.batch.prepare.compiled_runs import (
    LANES,
    RUN_ARGUMENTS,
    RUN_FUNCTION,
    RUN_TYPES,
    STAGE_ARGUMENTS,
    BoundRun,
    CompiledRun,
    MakeNumbers,
    RunPositions,
    RunStages,
    begin_run,
    end_run,
    input_rows,
    load_constant,
    load_numbers,
    write_expressions,
    write_shifted_inputs,
)
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.stages import run_stages
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_compile import allocate_aligned, compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.derivatives.design_equations import design_equations, with_rates
from planar.derivatives.kinematic_slopes import INPUT_RATES
from planar.equations.linear import solve_by_determinants
from planar.equations.rates import block_jacobian
from planar.equations.symbolic_equations import ConstraintEquations, slice_length
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import UnsupportedOperation


class WeightedRow(NamedTuple):
    """The order of a point (0: its position), by its number among the kernel's, whose x and y a sum takes."""

    order: int
    point: int


def adjoint_expressions(kernel: KernelWriter, rows: Sequence[WeightedRow], weights: ca.SX) -> list[ca.SX]:
    """A sum (sizes, s) of rows with weights (2 rows,), and its derivatives in p, q, u, and the rates u' and u''."""
    e, s = kernel.equations.equations, kernel.symbols
    depth = 1 + max(row.order for row in rows)
    y = [e.y, ca.vertcat(s["z1"], s["u1"]), ca.vertcat(s["z2"], s["u2"])][:depth]
    orders = with_rates(kernel.point_coordinates(range(len(kernel.links))), y)
    results = ca.vertcat(*(orders[row.order][2 * row.point : 2 * row.point + 2] for row in rows))
    value = ca.dot(weights, results)
    levels, unknowns = with_rates(e.F, y), [s["z"], s["z1"], s["z2"]][:depth]
    rest, names, values = value, [], []
    for level, unknown in reversed(list(zip(levels, unknowns, strict=True))):
        multipliers = ca.SX.sym("l", e.z.numel())
        names.append(multipliers)
        values.append(_solve_transposed(e, ca.gradient(rest, unknown)))
        rest = rest - ca.dot(multipliers, level)
    rates = ca.vertcat(s["u1"], s["u2"]) if depth > 1 else ca.SX(0, 1)
    slopes = [ca.gradient(rest, symbol) for symbol in (s["p"], s["q"], e.u, rates)]
    known = [*kernel.equations.rates(s["u1"], s["u2"])][: depth - 1] if depth > 1 else []
    # rates first, then the multipliers, each of which the later ones take
    replaced: list[ca.SX] = ca.substitute_inplace([*unknowns[1:], *names], [*known, *values], [value, *slopes])[1]
    return replaced


def _solve_transposed(e: ConstraintEquations, right_side: ca.SX) -> ca.SX:
    """The Jacobian's transposed inverse times a right side, from the last block to the first."""
    solution = ca.SX.zeros(e.z.numel())
    for block in reversed(e.blocks):
        if slice_length(block.unknowns):
            later = slice(block.rows.stop, e.F.numel())
            known = right_side[block.unknowns]
            if later.start < later.stop:
                known = known - ca.jtimes(e.F[later], e.z[block.unknowns], solution[later], True)
            jacobian = block_jacobian(e, block.rows, block.unknowns)
            solution[block.rows] = solve_by_determinants(jacobian.T, ca.densify(known))
    return solution


ADJOINT_LANES = 8
STATES_STAGE, ADJOINT_FUNCTION, DESIGNS_FUNCTION = "states", "adjoint", "designs"
ADJOINT_ARGUMENTS = (
    "i64 %good, ptr noalias readonly %numbers, ptr noalias readonly %inputs, i64 %width, ptr noalias readonly %state, "
    "i64 %stride, ptr noalias readonly %weights, ptr noalias %sums"
)
"""How many positions are good, from the first on; the numbers of a design; rows of inputs, and how wide they are; rows
of states, so far apart; weights (weighted rows, width, 2); and the sum that is written, with its derivatives."""


class _AdjointWriter(KernelWriter):
    """Writes the sum of weighted rows of points on links, and its derivatives in the operands `derived`.

    It reads the states at the `wanted` ones of their positions. Raises UnsupportedOperation.
    """

    def __init__(
        self,
        design: DesignNumbers,
        links: tuple[str, ...],
        rows: Sequence[WeightedRow],
        wanted: range,
    ):
        equations, invariant = design.equations("q"), frozenset({"p", "q", "u1", "u2"})
        if equations.has_large_blocks:
            raise UnsupportedOperation("a group has so many unknowns that expressions do not solve it")
        super().__init__(equations, links, any(row.order for row in rows), ADJOINT_LANES, invariant, frozenset())
        self.order, self.rows, self.wanted = design.order, rows, wanted
        self.symbols["weight"] = ca.SX.sym("weight", 2 * len(rows))
        self.outputs = adjoint_expressions(self, rows, self.symbols["weight"])
        _, p, q, u, rates = (output.numel() for output in self.outputs)
        input_rates = [(kind, k) for kind in ("u1", "u2") for k in range(u)] if rates else []
        counts = (("p", p), ("q", q), ("u", u))
        self.derived: list[Operand] = [*((kind, k) for kind, count in counts for k in range(count)), *input_rates]

    def write_function(self) -> None:
        """The whole function: blocks of positions, whose parts are added up."""
        t = self.ir
        t.write_line(f"define internal void @{ADJOINT_FUNCTION}({ADJOINT_ARGUMENTS}) {{")
        t.write_label("entry")
        slots = [t.allocate() for _ in range(1 + len(self.derived))]
        for slot in slots:
            t.store("zeroinitializer", slot)
        have = load_numbers(t, self.order, "p", "q", "u1", "u2", "d", "dc", "ds")
        last = t.add_instruction(f"insertelement <{t.lanes} x i64> poison, i64 %good, i64 0")
        t.write_line(f"%padded = add i64 %good, {t.lanes - 1}")
        t.write_line(f"%blocks = sdiv i64 %padded, {t.lanes}")
        t.mark_hoist_point()
        t.write_line("%any = icmp sgt i64 %good, 0")
        t.write_line("br i1 %any, label %block, label %after")
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %block]")
        self.lane = t.add_instruction(f"mul i64 %b, {t.lanes}")
        inputs = {operand: self.load_entry("%inputs", k) for k, operand in enumerate(self.equations.input_operands)}
        have |= write_shifted_inputs(t, self.equations, inputs, have)
        have |= self._load_states()
        for k in range(len(self.rows)):
            place = t.add_instruction(f"add i64 {t.add_instruction(f'mul i64 %width, {k}')}, {self.lane}")
            pointer = t.double_pointer("%weights", t.add_instruction(f"mul i64 {place}, 2"))
            have["weight", 2 * k], have["weight", 2 * k + 1] = t.load_pairs(pointer)
        parts = self.write_values(self.outputs, have)
        is_beyond = t.lanes_from(self.lane, last)
        for part, slot in zip(parts, slots, strict=True):
            t.store(t.binary("add", t.load(slot), t.select(is_beyond, t.constant(0.0), part)), slot)
        t.close_loop("b", "blocks", "block", "after")
        t.write_label("after")
        for k, slot in enumerate(slots):
            total = t.reduce("fadd", t.load(slot))
            t.write_line(f"store double {total}, ptr {t.double_pointer('%sums', str(k))}")
        t.end_function()

    def _load_states(self) -> OperandNames:
        """The states at a block of positions; behind the last one it is repeated."""
        t, wanted = self.ir, self.wanted
        rows = {leaf: t.add_instruction(f"mul i64 %stride, {k}") for k, leaf in enumerate(self.state_operands())}
        places = []
        for lane in range(t.lanes if rows else 0):
            place = t.add_instruction(f"add i64 {self.lane}, {lane}")
            is_within = t.add_instruction(f"icmp slt i64 {place}, {len(wanted) - 1}")
            place = t.add_instruction(f"select i1 {is_within}, i64 {place}, i64 {len(wanted) - 1}")
            place = t.add_instruction(f"mul i64 {place}, {wanted.step}")
            places.append(t.add_instruction(f"add i64 {place}, {wanted.start}"))

        def load(row: str) -> str:
            if wanted.step == 1:
                begin = t.add_instruction(f"add i64 {self.lane}, {wanted.start}")
                return t.load(t.double_pointer("%state", t.add_instruction(f"add i64 {row}, {begin}")))
            values = "poison"
            for lane, place in enumerate(places):
                pointer = t.double_pointer("%state", t.add_instruction(f"add i64 {row}, {place}"))
                value = t.add_instruction(f"load double, ptr {pointer}")
                values = t.add_instruction(f"insertelement {t.vector} {values}, double {value}, i64 {lane}")
            return values

        return {leaf: load(row) for leaf, row in rows.items()}


RATE_KINDS = dict(zip(INPUT_RATES, ("u", "u1", "u2"), strict=True))
"""The kind of operand that a number of an input becomes."""
HEADER = 2
"""Numbers of a result ahead of the sum and its derivatives: how the run ends, and how many positions are good."""


class GradientWriter:
    """Writes the function for sums of some `rows` of a run over points, x and y of each point one after the other.

    It takes weights (pairs of rows, `padded_width`, 2), and gives the sum and its derivatives in `equations.names`.
    """

    def __init__(self, reference: ReferenceDesign, points: tuple[str, ...], rows: tuple[int, ...]):
        self.reference, self.equations = reference, design_equations(reference.mechanism)
        orders, numbers = zip(*(divmod(row // 2, len(points)) for row in rows[::2]), strict=True)
        chosen = [*dict.fromkeys(numbers)]
        self.members = [reference.point_member(points[number]) for number in chosen]
        self.rows = [WeightedRow(order, chosen.index(number)) for order, number in zip(orders, numbers, strict=True)]

    def compile(self, make_numbers: MakeNumbers, grid: RunPositions) -> CompiledRun:
        """The gradient: its stage is a run for the states, whose code is that of all gradients.

        Raises UnsupportedOperation, BareAngle.
        """
        numbers = make_numbers(())
        run = CompiledRun(numbers, run_stages(self.reference, numbers, None, False, grid), grid.wanted)
        design, wanted = make_numbers(self.members), grid.wanted
        inputs = input_rows(design.equations("q").input_operands, grid.u[wanted])
        width, row_count = inputs.shape[1], run.shape[0] - 1
        constants = {
            "own values": design.own_values,
            "blocks": run.shape[1] // LANES,
            "run": run.function,
            "constants": run,
            "inputs": inputs,
        }
        stage = IRWriter(1)
        stage.write_line(f"define internal void @{STATES_STAGE}({STAGE_ARGUMENTS}) {{")
        function, context = (load_constant(stage, constants, name) for name in ("run", "constants"))
        arguments = "ptr %places, ptr %given, ptr %scratch, ptr %out, ptr null"
        stage.write_line(f"call void {function}(ptr {context}, {arguments})")
        stage.end_function()
        adjoint = _AdjointWriter(design, tuple(link for link, _ in self.members), self.rows, wanted)
        adjoint.write_function()
        writers = (stage, adjoint.ir)
        stages = RunStages((STATES_STAGE,), writers, design.order, constants, 0, row_count, run.scratch_size)
        sums = ca.SX.sym("sum", 1 + len(adjoint.derived))
        unit = self.reference.unit
        slopes = self._file_slopes(design, {operand: unit * sums[1 + k] for k, operand in enumerate(adjoint.derived)})
        t = IRWriter(1)
        begin_run(t, stages, range(len(wanted)), sums.numel())
        t.write_line(f"%width = mul i64 {load_constant(t, constants, 'blocks')}, {LANES}")
        states, result = (t.row_pointer("%out", "%width", row, "0") for row in (1, 1 + row_count))
        t.write_line(
            f"call void @{ADJOINT_FUNCTION}(i64 %good, ptr %numbers, ptr {load_constant(t, constants, 'inputs')}, "
            f"i64 {width}, ptr {states}, i64 %width, ptr %weights, ptr %sums)"
        )
        values = t.double_pointer("%numbers", str(stages.order.index(("value", 0))))
        names = write_expressions(t, [unit * sums[0], slopes], {values: design.symbols, "%sums": sums})
        for k, name in enumerate(names):
            t.store(name, t.double_pointer(result, str(k)))
        end_run(t)
        self._write_designs(t, width)
        return CompiledRun(design, stages, range(len(wanted)), t, ceil(len(names) / run.shape[1]))

    def _file_slopes(self, design: DesignNumbers, sums: dict[Operand, ca.SX]) -> ca.SX:
        """The derivatives in `equations.names`, by the symbols of a design's values, from those in operands."""
        reference, equations = self.reference, self.equations
        taken = {
            (kind, k): ca.SX(value)
            for kind, values in (("p", equations.pair_numbers), ("q", equations.point_numbers(self.members)))
            for k, value in enumerate(values)
        }
        weighted = [(value, sums[operand]) for operand, value in taken.items() if operand in sums]
        values, weights = (ca.vertcat(ca.SX(0, 1), *column) for column in zip(*weighted, strict=True))
        slopes = ca.jtimes(values, equations.d, weights, True)
        own = [
            design.symbols[design.index[each.name]] if each.name in design.index else ca.SX(each.value)
            for each in equations.dimensions
        ]
        input_slopes = []
        for rate in INPUT_RATES:
            for k, scale in enumerate(reference.input_scale):
                moves = rate == "position" or k == reference.running_index
                slope = sums.get((RATE_KINDS[rate], k), ca.SX(0.0)) if moves else ca.SX(0.0)
                input_slopes.append(slope / float(scale))
        return ca.vertcat(*input_slopes, ca.substitute(slopes, equations.d, ca.vertcat(ca.SX(0, 1), *own)))

    def _write_designs(self, t: IRWriter, width: int) -> None:
        """The function for many designs, one after the other."""
        t.write_line(f"define void @{DESIGNS_FUNCTION}({RUN_ARGUMENTS}, ptr %sums, ptr %results, i64 %designs) {{")
        t.write_label("entry")
        t.write_line("%names = load i64, ptr %places")
        t.write_line("br label %design")
        t.write_label("design")
        t.write_line("%k = phi i64 [0, %entry], [%knext, %design]")
        result_size = HEADER + 1 + len(self.equations.names)
        sizes = (("%given", "%names"), ("%weights", 2 * len(self.rows) * width), ("%results", result_size))
        values, weights, result = (
            t.double_pointer(base, t.add_instruction(f"mul i64 %k, {size}")) for base, size in sizes
        )
        t.write_line(
            f"call void @{RUN_FUNCTION}(ptr %context, ptr %places, ptr {values}, ptr %scratch, ptr %out, ptr {weights})"
        )
        for target, source, size in (
            (result, "%out", HEADER),
            (t.double_pointer(result, str(HEADER)), "%sums", result_size - HEADER),
        ):
            t.write_line(f"call void @llvm.memcpy.p0.p0.i64(ptr {target}, ptr {source}, i64 {8 * size}, i1 false)")
        t.close_loop("k", "designs", "design", "done")
        t.write_label("done")
        t.end_function()


def run_designs(bound: BoundRun, designs: Array, weights: Array, count: int) -> tuple[Array, Array]:
    """The `count` sums and derivatives (designs, 1 + names), and how the runs end (designs,), of designs (designs,
    given names) and weights (designs, pairs of rows, width, 2)."""
    run = bound.run
    function = compile_function(run.text, DESIGNS_FUNCTION, *RUN_TYPES, *("array",) * 2, "int")
    values, results = np.ascontiguousarray(designs, dtype=float), np.empty((len(designs), HEADER + count))
    rows, width = run.shape
    memory = allocate_aligned(1, 1, run.scratch_size + rows * width)
    scratch, results_address = memory.ctypes.data, results.ctypes.data
    out = scratch + 8 * run.scratch_size
    sums = out + 8 * width * run.results.start
    arrays = (values.ctypes.data, scratch, out, weights.ctypes.data, sums, results_address)
    function(run.context, bound.address, *arrays, len(values))
    results[results[:, 1] == 0.0, HEADER:] = 0.0
    return results[:, HEADER:], results[:, 0]
