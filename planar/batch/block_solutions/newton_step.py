"""Newton's step of one block at complex unknowns and numbers, as numpy code over lanes."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from planar.batch.march.kernel import KernelEquations, KernelInstructions, Operand
from planar.codegen.printed_formula import PrintedFunction, compile_numpy
from planar.equations.linear import solve_by_elimination
from planar.equations.rates import block_jacobian
from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import ComplexArray
from planar.foundation.instruction_list import UnsupportedOperation, required_values
from planar.model.pairs import MeasureKind

ANALYTIC_OPERATIONS = frozenset({"input", "const", "add", "sub", "mul", "div", "neg", "cos", "sin"})
"""What a step may be made of: functions that keep their derivative at complex places."""


class ComplexNewtonStep:
    """What Newton's method takes away from a block's unknowns, by operands that are complex arrays (lanes,).

    An angle enters by its cos and sin. `operands`: what has to be given, the block's own unknowns among it. Raises
    UnsupportedOperation for a block whose equations are no polynomials in these.
    """

    def __init__(self, equations: KernelEquations, block: Block):
        e = equations.equations
        if any(row.kind is not MeasureKind.LENGTH for row in e.rows[block.rows]):
            raise UnsupportedOperation("an angle closes modulo a turn, or counts turns")
        instructions = KernelInstructions(equations, (), False, frozenset(), frozenset())
        jacobian = block_jacobian(e, block.rows, block.unknowns)
        rng = np.random.default_rng(0)
        function = ca.Function("jacobian", [e.z, e.u, e.p], [jacobian])
        sample = function(*(rng.uniform(0.5, 2.0, symbol.numel()) for symbol in (e.z, e.u, e.p))).full()
        outputs = [solve_by_elimination(jacobian, e.F[block.rows], sample)]
        made, wanted = instructions.hoister.result, instructions.list_values(outputs, 0)
        operands: dict[int, Operand] = {}
        for number in required_values(made, wanted):
            operation, _, _, key = made.instructions[number]
            if operation not in ANALYTIC_OPERATIONS:
                raise UnsupportedOperation(f"{operation} has no derivative at complex places")
            if key is not None:
                operands[number] = key
        is_angle = {"z": equations.is_angle, "u": equations.input_is_angle}
        bare = [(name, k) for name, k in operands.values() if name in is_angle and is_angle[name][k]]
        if bare:
            raise UnsupportedOperation(f"an angle stands outside cos and sin: {bare[0]}")
        self.operands: tuple[Operand, ...] = tuple(operands.values())
        self.function: PrintedFunction = compile_numpy(made, wanted, tuple(operands))

    def __call__(self, values: dict[Operand, Any]) -> tuple[ComplexArray, ...]:
        """The step of each unknown (lanes,)."""
        return self.function(*(values[each] for each in self.operands))
