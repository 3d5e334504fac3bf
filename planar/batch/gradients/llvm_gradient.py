"""A run's states, its adjoint and the way to the file's numbers, design after design, as one LLVM function."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from planar.batch.gradients.adjoint_equations import WeighedRow
from planar.batch.gradients.llvm_adjoint import FUNCTION_NAME as ADJOINT_FUNCTION
from planar.batch.gradients.llvm_adjoint import write_adjoint
from planar.batch.gradients.llvm_file_slopes import FUNCTION_NAME as SLOPES_FUNCTION
from planar.batch.gradients.llvm_file_slopes import file_slope_expressions, write_file_slopes
from planar.batch.march.kernel import Operand
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.llvm_numbers import FUNCTION_NAME as NUMBERS_FUNCTION
from planar.batch.prepare.llvm_numbers import write_numbers
from planar.batch.prepare.run_endings import ALL_SOLVED, CANNOT_BE_ASSEMBLED, UNSURE
from planar.batch.prepare.value_binder import RunCall
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_ir import IRWriter
from planar.derivatives.design_equations import DesignEquations
from planar.model.link_shapes import PointMember

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
