"""Which equations are put together of pieces in an unknown: of these no identity is judged at a few places."""

from __future__ import annotations

import casadi as ca

PIECEWISE_OPERATIONS = frozenset((ca.OP_FLOOR, ca.OP_LT, ca.OP_LE))


def is_piecewise_in(expression: ca.SX, symbols: ca.SX) -> bool:
    """Whether an expression changes its formula as these symbols change."""
    others = [each for each in ca.symvar(expression) if not ca.depends_on(symbols, each)]
    function = ca.Function("pieces", [symbols, ca.vertcat(ca.SX(0, 1), *others)], [expression])
    depends: dict[int, bool] = {}
    for k in range(function.n_instructions()):
        code, out, of = function.instruction_id(k), function.instruction_output(k), function.instruction_input(k)
        if code == ca.OP_INPUT:
            depends[out[0]] = of[0] == 0
        elif code == ca.OP_CONST:
            depends[out[0]] = False
        elif code != ca.OP_OUTPUT:
            depends[out[0]] = any(depends[each] for each in of)
            if depends[out[0]] and code in PIECEWISE_OPERATIONS:
                return True
    return False
