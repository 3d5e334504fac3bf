"""From the derivatives in what a run takes of a design to those in the numbers of its file, as an LLVM function."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from planar.batch.march.kernel import Operand
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.llvm_numbers import write_given
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.instructions import check_length
from planar.codegen.llvm_ir import IRWriter
from planar.derivatives.design_equations import DesignEquations
from planar.derivatives.parameters import INPUT_RATES
from planar.equations.generic_evaluation import inline_function
from planar.equations.mechanism_numbers import scale_lengths
from planar.foundation.instruction_list import InstructionList, required_values
from planar.model.link_shapes import PointMember

FUNCTION_NAME = "file_slopes"
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
    t.write_line(f"define internal void @{FUNCTION_NAME}(ptr %own, ptr %places, ptr %given, ptr %sums, ptr %slopes) {{")
    t.write_label("entry")
    size = design.symbols.numel()
    t.write_line(f"%values = alloca [{size} x double], align 64")
    t.write_line(f"call void @llvm.memcpy.p0.p0.i64(ptr %values, ptr %own, i64 {8 * size}, i1 false)")
    write_given(t)
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
