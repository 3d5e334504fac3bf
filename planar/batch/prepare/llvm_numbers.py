"""The numbers of a design as an LLVM function: from the values by which designs differ to what a run takes."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from planar.batch.march.kernel import Operand
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.run_endings import ALL_SOLVED, CANNOT_BE_ASSEMBLED, UNSURE
from planar.codegen.instructions import check_length
from planar.codegen.llvm_ir import IRWriter
from planar.equations.generic_evaluation import inline_function
from planar.foundation.instruction_list import InstructionList, required_values

FUNCTION_NAME = "numbers"
SAID: Operand = ("said", 0)
"""How a run ends before its start, see `run_endings`: it does not where all numbers are finite, and what the design's
`margin` and `opening` say is in order."""


REASONABLE_SIZES = (1e-99, 1e99)
"""Of values that are given, and not nothing: others are left to those who refuse them."""


def write_numbers(design: DesignNumbers, order: Sequence[Operand]) -> IRWriter:
    """The function: values of `design.symbols` to numbers in an order, and `SAID` where it stands there.

    It takes all values of the file's design, how many others are given and where each of these belongs, and these.
    Raises UnsupportedOperation.
    """
    t = IRWriter(1)
    t.write_line(f"define internal void @{FUNCTION_NAME}(ptr %own, ptr %places, ptr %given, ptr noalias %numbers) {{")
    t.write_label("entry")
    size = design.symbols.numel()
    t.write_line(f"%values = alloca [{size} x double], align 64")
    t.write_line(f"call void @llvm.memcpy.p0.p0.i64(ptr %values, ptr %own, i64 {8 * size}, i1 false)")
    is_given = write_given(t)
    given = [t.load(t.double_pointer("%values", str(k))) for k in range(design.symbols.numel())]
    outputs = [*design.numbers.values(), *design.points]
    function = ca.Function("numbers", [design.symbols], [ca.densify(ca.vertcat(*outputs))], {"cse": True})
    check_length(function.n_instructions())
    listing: InstructionList[int] = InstructionList()
    inputs = [listing.add_input(k) for k in range(len(given))]
    [wanted] = inline_function(listing, function, [inputs])
    names: dict[int, str] = {}
    known = {number: given[k] for k, number in enumerate(inputs)}
    t.write_values(listing, required_values(listing, wanted), names, known)
    values = {operand: names[k] for operand, k in zip(design.numbers, wanted, strict=False)}
    zero = t.constant(0.0)
    is_finite = t.compare("oeq", _write_nothing(t, [names[k] for k in wanted]), zero)
    is_fit = t.and_flags(t.and_flags(is_given, is_finite), t.compare("oge", values["margin", 0], zero))
    is_open = t.and_flags(is_given, t.compare("ogt", values["opening", 0], zero))
    refused = t.select(is_open, t.constant(CANNOT_BE_ASSEMBLED), t.constant(UNSURE))
    values[SAID] = t.select(is_fit, t.constant(ALL_SOLVED), refused)
    for k, operand in enumerate(order):
        if operand in values:
            t.store(values[operand], t.double_pointer("%numbers", str(k)))
    t.write_line("ret void")
    t.write_line("}")
    t.write_line("declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)")
    return t


def write_given(t: IRWriter) -> str:
    """Put the given values where they belong; a flag that they are neither too great nor too small."""
    slot = t.allocate()
    t.store(t.constant(1.0), slot)
    t.write_line("%many = load i64, ptr %places")
    t.write_line("%any = icmp sgt i64 %many, 0")
    t.write_line("br i1 %any, label %value, label %known")
    t.write_label("value")
    t.write_line("%k = phi i64 [0, %entry], [%knext, %value]")
    t.write_line("%knext = add i64 %k, 1")
    number = t.load(t.double_pointer("%given", "%k"))
    place = t.add_instruction("getelementptr i64, ptr %places, i64 %knext")
    t.store(number, t.double_pointer("%values", t.add_instruction(f"load i64, ptr {place}")))
    size = t.call_intrinsic("fabs", number)
    least, greatest = (t.constant(each) for each in REASONABLE_SIZES)
    within = t.and_flags(t.compare("oge", size, least), t.compare("ole", size, greatest))
    within = t.or_flags(within, t.compare("oeq", size, t.constant(0.0)))
    t.store(t.select_or_zero(within, t.load(slot)), slot)
    t.write_line("%more = icmp slt i64 %knext, %many")
    t.write_line("br i1 %more, label %value, label %known")
    t.write_label("known")
    return t.compare("oeq", t.load(slot), t.constant(1.0))


def _write_nothing(t: IRWriter, values: Sequence[str]) -> str:
    """Nothing, or no number where one of the values is not finite."""
    zero = t.constant(0.0)
    return t.add_all([zero, *(t.binary("mul", zero, each) for each in dict.fromkeys(values))])
