"""From the derivatives in what a run takes of a design to those in the numbers of its file, as an LLVM function."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from planar.batch.gradients.llvm_adjoint import ADJOINT_FUNCTION, LANES, WeighedRow, write_adjoint
from planar.batch.march.kernel import Operand
from planar.batch.prepare.design_numbers import NUMBERS_FUNCTION, DesignNumbers, write_given, write_numbers
from planar.batch.prepare.native_run import (
    NativeRun,
    NativeRuns,
    RunPositions,
    compile_run_function,
    prepare_native,
    run_design_numbers,
)
from planar.batch.prepare.run_calls import ALL_SOLVED, CANNOT_BE_ASSEMBLED, UNSURE, RunCall, address_of
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.instructions import check_length
from planar.codegen.llvm_compile import WIDEST_VECTOR_BYTES, compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.derivatives.design_equations import DesignEquations
from planar.derivatives.parameters import INPUT_RATES
from planar.equations.generic_evaluation import inline_function
from planar.equations.mechanism_numbers import scale_lengths
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import InstructionList, required_values
from planar.model.link_shapes import PointMember

if TYPE_CHECKING:
    from planar.batch.prepare.native_run import CompiledRun
    from planar.batch.prepare.newton_run import NewtonRun

SLOPES_FUNCTION = "file_slopes"
RATE_KINDS = dict(zip(INPUT_RATES, ("u", "u1", "u2"), strict=True))
"""By what a number of an input is, the kind of operand that it becomes."""


def file_slope_expressions(
    reference: ReferenceDesign,
    equations: DesignEquations,
    design: DesignNumbers,
    members: Sequence[PointMember],
    sums: dict[Operand, ca.SX],
) -> ca.SX:
    """The derivatives in `equations.names`, by the symbols of a design's values, from those of a sum in operands."""
    unit, work = reference.unit, equations.work
    numbers = [
        number
        for pair in reference.mechanism.pairs
        for number in scale_lengths(work.numbers[pair.name], pair.number_kinds, unit)
    ]
    places = [part / unit for link, point in members for part in work.shapes[link].position(point)]
    taken = {("p", k): ca.SX(each) for k, each in enumerate(numbers)}
    taken |= {("q", k): ca.SX(each) for k, each in enumerate(places)}
    weighed = [(value, sums[operand]) for operand, value in taken.items() if operand in sums]
    values, weights = (ca.vertcat(ca.SX(0, 1), *each) for each in zip(*weighed, strict=True))
    slopes = ca.jtimes(values, equations.d, weights, True)
    own = ca.vertcat(
        ca.SX(0, 1),
        *(
            design.symbols[design.index[each.name]] if each.name in design.index else ca.SX(each.value)
            for each in equations.dimensions
        ),
    )
    of_inputs = []
    for rate in INPUT_RATES:
        for k, given in enumerate(reference.mechanism.inputs):
            moves = rate == "position" or k == reference.running_index
            slope = sums.get((RATE_KINDS[rate], k), ca.SX(0.0)) if moves else ca.SX(0.0)
            of_inputs.append(slope / (unit if reference.solver.is_sliding(given.pair) else 1.0))
    return ca.densify(ca.vertcat(*of_inputs, ca.substitute(slopes, equations.d, own)))


def write_file_slopes(design: DesignNumbers, sums: ca.SX, slopes: ca.SX) -> IRWriter:
    """The function: the values by which a design differs, as `write_numbers` takes them, and sums, to slopes.

    Raises UnsupportedOperation.
    """
    t = IRWriter(1)
    t.write_line(
        f"define internal void @{SLOPES_FUNCTION}(ptr %own, ptr %places, ptr %given, ptr %sums, ptr %slopes) {{"
    )
    t.write_label("entry")
    size = design.symbols.numel()
    write_given(t, size)
    function = ca.Function("file_slopes", [design.symbols, sums], [slopes], {"cse": True})
    check_length(function.n_instructions())
    listing: InstructionList[tuple[str, int]] = InstructionList()
    given = {
        base: [listing.add_input((base, k)) for k in range(many)]
        for base, many in (("%values", size), ("%sums", sums.numel()))
    }
    [wanted] = inline_function(listing, function, list(given.values()))
    order = required_values(listing, wanted)
    known = {
        number: t.load(t.double_pointer(base, str(k)))
        for base, numbers in given.items()
        for k, number in enumerate(numbers)
        if number in set(order)
    }
    names: dict[int, str] = {}
    t.write_values(listing, order, names, known)
    for k, number in enumerate(wanted):
        t.store(names[number], t.double_pointer("%slopes", str(k)))
    t.write_line("ret void")
    t.write_line("}")
    return t


FUNCTION_NAME, OF_ONE = "gradients", "gradient"
ARGUMENT_TYPES = (*("array",) * 6, "int")
"""Of the function's arguments: what does not change from call to call, which are addresses; places of values that are
given, these, design after design; weights; room; out; and how many designs there are."""
TOLD = 2
"""Numbers of each design ahead of the sum and its derivatives: how the run ended, and how many positions are good."""
NUMBER_KINDS = frozenset({"p", "q", "u1", "u2", "d", "dc", "ds"})
ONE_ARGUMENTS = "ptr %context, ptr %places, ptr %given, ptr %weights, ptr %room, ptr %out"


class GradientWriter:
    """Writes the function for weighed rows of points (by their `members`, link and point)."""

    def __init__(
        self,
        reference: ReferenceDesign,
        equations: DesignEquations,
        members: Sequence[PointMember],
        weighed: Sequence[WeighedRow],
    ):
        self.reference, self.equations, self.members, self.weighed = reference, equations, members, weighed

    def write(self, design: DesignNumbers, run: RunCall, wanted: range, width: int) -> tuple[str, tuple[Operand, ...]]:
        """The text, and what the rows of given inputs are, of the `wanted` positions of a run; rows of weights have
        this width. Raises UnsupportedOperation."""
        order = [operand for operand in design.numbers if operand[0] in NUMBER_KINDS]
        links = tuple(link for link, _ in self.members)
        adjoint = write_adjoint(design.equations("q"), links, self.weighed, order, wanted)
        sums = ca.SX.sym("sum", 1 + len(adjoint.derived))
        unit = self.reference.unit
        named: dict[Operand, ca.SX] = {operand: unit * sums[1 + k] for k, operand in enumerate(adjoint.derived)}
        slopes = file_slope_expressions(self.reference, self.equations, design, self.members, named)
        by_file = write_file_slopes(design, sums, ca.vertcat(unit * sums[0], slopes))
        t = IRWriter(1)
        self._write_one(t, run, wanted, width, (len(order), sums.numel()))
        self._write_designs(t, 2 * len(self.weighed) * width, TOLD + 1 + slopes.numel())
        return t.module_text(write_numbers(design, order), adjoint.writer, by_file), adjoint.inputs

    def _write_one(self, t: IRWriter, run: RunCall, wanted: range, width: int, counts: tuple[int, int]) -> None:
        """One design: where the run is not sure nothing but that is told."""
        t.write_line(f"define internal void @{OF_ONE}({ONE_ARGUMENTS}) {{")
        t.write_label("entry")
        own, drive, function, context = (
            t.add_instruction(f"load ptr, ptr {t.double_pointer('%context', str(k))}") for k in range(4)
        )
        t.write_line(f"%numbers = alloca [{counts[0]} x double], align 64")
        t.write_line(f"%sums = alloca [{counts[1]} x double], align 64")
        second = "" if run.second is None else f", ptr {t.double_pointer('%room', str(run.second))}"
        t.write_line(f"call void {function}(ptr {context}, ptr %places, ptr %given, ptr %room{second})")
        ending = t.add_instruction(f"load double, ptr {t.double_pointer('%room', str(run.ending))}")
        t.write_line(f"store double {ending}, ptr %out")
        self._write_good(t, ending, run, wanted)
        t.write_line("%shown = sitofp i64 %good to double")
        t.write_line(f"store double %shown, ptr {t.double_pointer('%out', '1')}")
        t.write_line(f"call void @{NUMBERS_FUNCTION}(ptr {own}, ptr %places, ptr %given, ptr %numbers)")
        states, told = t.double_pointer("%room", str(run.rows)), t.double_pointer("%out", str(TOLD))
        t.write_line(
            f"call void @{ADJOINT_FUNCTION}(i64 %good, ptr %numbers, ptr {drive}, i64 {width}, ptr {states}, "
            f"i64 {run.stride}, ptr %weights, ptr %sums)"
        )
        t.write_line(f"call void @{SLOPES_FUNCTION}(ptr {own}, ptr %places, ptr %given, ptr %sums, ptr {told})")
        t.write_line("ret void")
        t.write_line("}")

    @staticmethod
    def _write_good(t: IRWriter, ending: str, run: RunCall, wanted: range) -> None:
        """How many of the wanted positions are good; a run that ends on its way to the first one is not sure."""

        def branch(ends: float, label: str, otherwise: str) -> None:
            t.write_line(
                f"br i1 {t.add_instruction(f'fcmp oeq double {ending}, {ends}')}, label %{label}, label %{otherwise}"
            )

        branch(ALL_SOLVED, "whole", "ended")
        t.write_label("ended")
        branch(CANNOT_BE_ASSEMBLED, "whole", "stopped")
        t.write_label("stopped")
        branch(UNSURE, "leave", "found")
        t.write_label("leave")
        t.write_line(f"store double {UNSURE}, ptr %out")
        t.write_line("ret void")
        t.write_label("found")
        place = t.add_instruction(f"load double, ptr {t.double_pointer('%room', str(run.ending + 1))}")
        t.write_line(f"%at = fptosi double {place} to i64")
        is_ahead = t.add_instruction(f"icmp sle i64 %at, {wanted.start}")
        t.write_line(f"%before = sub i64 %at, {wanted.start - wanted.step + 1}")
        t.write_line(f"%stop = sdiv i64 %before, {wanted.step}")
        t.write_line(f"br i1 {is_ahead}, label %leave, label %whole")
        t.write_label("whole")
        t.write_line(f"%good = phi i64 [{len(wanted)}, %entry], [0, %ended], [%stop, %found]")

    @staticmethod
    def _write_designs(t: IRWriter, weights: int, told: int) -> None:
        """One design after the other."""
        t.write_line(f"define void @{FUNCTION_NAME}({ONE_ARGUMENTS}, i64 %designs) {{")
        t.write_label("entry")
        t.write_line("%names = load i64, ptr %places")
        t.write_line("br label %design")
        t.write_label("design")
        t.write_line("%k = phi i64 [0, %entry], [%knext, %design]")
        of_one = [
            t.double_pointer(base, t.add_instruction(f"mul i64 %k, {size}"))
            for base, size in (("%given", "%names"), ("%weights", weights), ("%out", told))
        ]
        given, weighed, out = of_one
        t.write_line(
            f"call void @{OF_ONE}(ptr %context, ptr %places, ptr {given}, ptr {weighed}, ptr %room, ptr {out})"
        )
        t.close_loop("k", "designs", "design", "done")
        t.write_label("done")
        t.write_line("ret void")
        t.write_line("}")


def prepare_native_gradient(  # many: what a gradient is made of
    reference: ReferenceDesign,
    equations: DesignEquations,
    points: tuple[str, ...],
    rows: tuple[int, ...],
    positions: Array,
    may_shift: bool,
) -> NativeRuns | None:
    """The compiled gradients of a run over these positions of the running input, of sums of these rows of its points;
    None where there are none.

    Each takes values by name and weights (pairs of rows, `padded_width`, 2), and gives the sum and its derivatives in
    `equations.names` (1 + names,), how the run ended, as a `NativeRun`, and how many of its positions are good.
    """
    wide = 2 * len(points)
    chosen = dict.fromkeys((row % wide) // 2 for row in rows)
    number = {point: k for k, point in enumerate(chosen)}
    weighed = [WeighedRow(row // wide, number[(row % wide) // 2]) for row in rows[::2]]
    members = [reference.point_member(points[point]) for point in chosen]

    def compile_gradient(grid: RunPositions, zeros: frozenset[str]) -> NativeRun:
        own = run_design_numbers(reference, (), may_shift, zeros)
        states = compile_run_function(reference, own, (), False, grid, True)
        design = run_design_numbers(reference, members, may_shift, zeros)
        return NativeGradient(states, design, GradientWriter(reference, equations, members, weighed), grid)

    return prepare_native(reference, positions, compile_gradient)


def padded_width(count: int) -> int:
    """How many numbers a row of weights has: whole vectors of positions."""
    return LANES * -(-count // LANES)


class NativeGradient:
    """One function's calls, over the same positions always; from any thread. Raises UnsupportedOperation."""

    def __init__(
        self, states: CompiledRun | NewtonRun, design: DesignNumbers, writer: GradientWriter, grid: RunPositions
    ):
        """`states` and `design` have the same values, in one order."""
        wanted = range(grid.lead, len(grid.u), grid.every)
        call = states.run_call()
        self._width = padded_width(len(wanted))
        ir, inputs = writer.write(design, call, wanted, self._width)
        self._states, self._own = states, design.own_values
        self._function: Any = compile_function(ir, FUNCTION_NAME, *ARGUMENT_TYPES)
        at = grid.u[wanted]
        whole = np.concatenate([at, np.repeat(at[-1:], self._width - len(at), axis=0)]).T
        turned = {"c": np.cos, "s": np.sin}
        self._drive = np.array([turned.get(name[1:], np.positive)(whole[k]) for name, k in inputs])
        run = ctypes.cast(call.function, ctypes.c_void_p).value or 0
        context = [self._own.ctypes.data, self._drive.ctypes.data, run, call.context]
        self._context = np.array(context, dtype=np.int64)
        self._pointer = self._context.ctypes.data
        self._told = TOLD + 1 + len(writer.equations.names)
        self._room = call.room + WIDEST_VECTOR_BYTES // 8

    def __call__(self, values: Mapping[str, float], weights: Array) -> tuple[list[float], float, int]:
        """See `prepare_native_gradient`."""
        names, states = tuple(values), self._states
        pack, _, places = states.bound.get(names) or states.bind(names)
        out = np.empty(self._told + self._room)
        told = address_of(out)
        room = told + 8 * self._told
        room += -room % WIDEST_VECTOR_BYTES
        self._function(self._pointer, places, pack(*values.values()), address_of(weights), room, told, 1)
        ending, good, *found = out[: self._told].tolist()
        return found, ending, int(good)

    def run_designs(self, names: tuple[str, ...], designs: Array, weights: Array) -> tuple[Array, Array]:
        """The sums with their derivatives (designs, 1 + names), and how the runs end (designs,), of designs (designs,
        given names) and weights (designs, pairs of rows, width, 2)."""
        _, _, places = self._states.bound.get(names) or self._states.bind(names)
        given = np.ascontiguousarray(designs, dtype=float)
        out, room = np.empty((len(given), self._told)), np.empty(self._room)
        first = address_of(room)
        first += -first % WIDEST_VECTOR_BYTES
        self._function(
            self._pointer, places, given.ctypes.data, weights.ctypes.data, first, out.ctypes.data, len(given)
        )
        out[out[:, 1] == 0.0, TOLD:] = 0.0
        return out[:, TOLD:], out[:, 0]
