"""Rates, that is time derivatives, as casadi expressions: of what is made of y = (z, u), and of the unknowns z."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from planar.equations.linear import solve_linear
from planar.equations.symbolic_equations import ConstraintEquations, slice_length


def rate_symbols(y: ca.SX, order: int) -> tuple[ca.SX, ...]:
    """Symbols for the first rates of y, the second ones, and so on."""
    return tuple(ca.SX.sym(f"y{k}", y.numel()) for k in range(1, order + 1))


def time_derivatives(value: ca.SX, y: ca.SX, *rates: ca.SX) -> list[ca.SX]:
    """The first rates of an expression in symbols y, the second ones, ..., one for each of the rates of y.

    Those but the last have to be symbols. The chain rule: what an order is made of is y, y', ..., and the next one
    is the sum of its derivatives by each, times the rate of that.
    """
    derivatives: list[ca.SX] = []
    for order, last in enumerate(rates):
        # the last rate stands in it as y' stands in the first
        rate = ca.jtimes(value, y, last)
        if derivatives:
            parts = [ca.jtimes(derivatives[-1], of, by) for of, by in zip((y, *rates), rates[:order], strict=False)]
            rate = sum(parts[1:], parts[0]) + rate
        derivatives.append(rate)
    return derivatives


def first_and_second_rates(value: ca.SX, y: ca.SX, y1: ca.SX, y2: ca.SX) -> tuple[ca.SX, ca.SX]:
    """The first and second rates of an expression in y, whose own rates are any expressions."""
    symbols = rate_symbols(y, 2)
    first, second = ca.substitute(time_derivatives(value, y, *symbols), list(symbols), [y1, y2])
    return first, second


class UnknownRates:
    """The rates of the unknowns as expressions, block after block, each solved for its own."""

    def __init__(self, e: ConstraintEquations, solve: Callable[[ca.SX, ca.SX], ca.SX] = solve_linear):
        """`solve` gives matrix^-1 right side, see `linear`."""
        self.equations, self.y, self._solve = e, e.y, solve
        self._y1, self._y2 = rate_symbols(self.y, 2)
        self._first, self._second = time_derivatives(e.F, self.y, self._y1, self._y2)
        self.jacobians = [block_jacobian(e, block.rows, block.unknowns) for block in e.blocks]

    def right_sides(self, y1: ca.SX, y2: ca.SX | None = None) -> list[ca.SX]:
        """What the rate of each block's residuals is without the unknowns' own part, at first rates y1, or second ones.

        Blocks without unknowns are left out. Rates of later blocks do not stand in it.
        """
        count = self.equations.z.numel()
        rate, y_rate = (self._first, y1) if y2 is None else (ca.substitute(self._second, self._y1, y1), y2)
        symbol = self._y1 if y2 is None else self._y2
        right_sides = []
        for block in self.equations.blocks:
            if slice_length(block.unknowns):
                first = block.unknowns.start
                known = ca.vertcat(y_rate[:first], ca.SX.zeros(count - first), y_rate[count:])
                right_sides.append(ca.substitute(rate[block.rows], symbol, known))
        return right_sides

    def first(self, u1: ca.SX) -> ca.SX:
        """The first rates of the unknowns (unknowns,) for those of the inputs (inputs,)."""
        return self._solve_blocks(self._first, self._y1, u1)

    def second(self, z1: ca.SX, u1: ca.SX, u2: ca.SX) -> ca.SX:
        """Their second rates (unknowns,)."""
        return self._solve_blocks(ca.substitute(self._second, self._y1, ca.vertcat(z1, u1)), self._y2, u2)

    def first_and_second(self, u1: ca.SX, u2: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Both for the first and second rates of the inputs."""
        z1 = self.first(u1)
        return z1, self.second(z1, u1, u2)

    def _solve_blocks(self, residual_rate: ca.SX, rates: ca.SX, input_rates: ca.SX) -> ca.SX:
        """The unknowns' part of `rates`, symbols, so that the rate of the residuals, linear in it, vanishes."""
        count = self.equations.z.numel()
        if not count:
            return ca.SX(0, 1)
        # of one symbol an empty part has another shape than an empty column
        names, values = ([rates[count:]], [input_rates]) if input_rates.numel() else ([], [])
        for block, jacobian in zip(self.equations.blocks, self.jacobians, strict=True):
            if slice_length(block.unknowns):
                # later unknowns may stand in the expression, but cancel
                ahead = rates[block.unknowns.start : count]
                rest = ca.substitute(residual_rate[block.rows], ahead, ca.SX.zeros(ahead.numel()))
                names.append(rates[block.unknowns])
                values.append(ca.densify(-self._solve(jacobian, rest)))
        return ca.substitute_inplace(names, values, [rates[:count]])[1][0]


def block_jacobian(e: ConstraintEquations, rows: slice, unknowns: slice) -> ca.SX:
    """dF/dz of some rows and unknowns (rows, unknowns), every entry of it written."""
    return ca.densify(ca.jacobian(e.F[rows], e.z[unknowns]))
