"""The formulas of linkages of pinned bars in the places of their pins, between which bars keep distances."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from functools import lru_cache, partial

import casadi as ca

from planar.batch.mechanisms.block_type import write_formula
from planar.batch.mechanisms.tape_runs import POINT_ROWS, TABLE_COS, TABLE_SIN
from planar.codegen.tape import FormulaInput, TapeFormula


class PinStep(IntEnum):
    """How a pin is placed: on the crank; as the pin between two bars whose others are known; on a bar through two
    pins. Of those the second may be one of the frame."""

    CRANK = 0
    DYAD = 1
    DYAD_ON_FRAME = 2
    CARRIED = 3
    CARRIED_ON_FRAME = 4


NUMBERS = 6
"""Numbers of a step at most. Of a crank: where it is on the frame, the pin from there as it stands (m), velocity and
acceleration. Of a dyad: the lengths of its bars (m), its sign, one by the linkage's size. Of a pin on a bar: where it
is, in parts of the way from the first pin to the second. Then the second pin (m) where that is on the frame."""
_FRAME_PIN = {PinStep.DYAD_ON_FRAME: 4, PinStep.CARRIED_ON_FRAME: 2}


@lru_cache
def pin_formulas(rates: bool, polished: bool) -> tuple[TapeFormula, ...]:
    """The formulas of all steps, which take two pins and write the third. `polished`: closed forms are followed by a
    step of Newton's method."""
    row_count = POINT_ROWS[rates]
    rows = tuple((2, row) for row in range(row_count))
    made = []
    for step in PinStep:
        frame_pin = _FRAME_PIN.get(step)
        numbers = [FormulaInput("p", k) for k in range(NUMBERS if frame_pin is None else frame_pin)]
        if step is PinStep.CRANK:
            table = [FormulaInput("row", 0, row) for row in (TABLE_COS, TABLE_SIN)]
            made.append(TapeFormula(write_formula((table, numbers), partial(_crank, rates)), rows))
            continue
        first, second = ([FormulaInput("row", slot, row) for row in range(row_count)] for slot in range(2))
        if frame_pin is not None:
            second = [FormulaInput("p", frame_pin + k) for k in range(2)]
        inputs = first, second, numbers
        if step in (PinStep.CARRIED, PinStep.CARRIED_ON_FRAME):
            made.append(TapeFormula(write_formula(inputs, partial(_carried, rates)), rows))
        else:
            directions = tuple((row_count + k, row_count + k + 1, row_count + k + 2) for k in (0, 3))
            made.append(TapeFormula(write_formula(inputs, partial(_dyad, rates, polished)), rows, directions, True))
    return tuple(made)


def _turned(x: ca.SX) -> ca.SX:
    """By a right angle."""
    return ca.vertcat(-x[1], x[0])


def _orders(pin: ca.SX, rates: bool) -> list[ca.SX]:
    """Place, velocity and acceleration of a pin; one that has no rates stands."""
    order_count = POINT_ROWS[rates] // 2
    return [pin[2 * k : 2 * k + 2] if 2 * k < pin.numel() else ca.SX.zeros(2) for k in range(order_count)]


def _crank(rates: bool, table: ca.SX, numbers: ca.SX) -> list[ca.SX]:
    """Rows of a pin on the crank."""
    pivot, pin, velocity, acceleration = numbers[:2], numbers[2:4], numbers[4], numbers[5]
    arm = table[0] * pin + table[1] * _turned(pin)
    if not rates:
        return [pivot + arm]
    return [pivot + arm, velocity * _turned(arm), acceleration * _turned(arm) - velocity**2 * arm]


def _carried(rates: bool, first: ca.SX, second: ca.SX, numbers: ca.SX) -> list[ca.SX]:
    """Rows of a pin on a bar: linear in those of two others."""
    both = zip(_orders(first, rates), _orders(second, rates), strict=True)
    return [a + numbers[0] * (b - a) + numbers[1] * _turned(b - a) for a, b in both]


def _dyad(rates: bool, polished: bool, first: ca.SX, second: ca.SX, numbers: ca.SX) -> list[ca.SX]:
    """Rows of the pin between two bars, these as vectors with their squared lengths, by how much of the size the
    distances are off, and how clear they are of where two ways to assemble them meet: the squared sine between them.

    The pin is where two circles about the given ones meet.
    """
    (a, *a_rates), (b, *b_rates) = _orders(first, rates), _orders(second, rates)
    lengths, sign, per_size = numbers[:2], numbers[2], numbers[3]
    squares, between = lengths**2, b - a
    distance = ca.sumsqr(between)
    scale = 0.5 / distance
    height = (ca.sum1(lengths) ** 2 - distance) * (distance - (lengths[0] - lengths[1]) ** 2)
    along, across = 0.5 + scale * (squares[0] - squares[1]), scale * (sign * ca.sqrt(height))
    pin = a + along * between + across * _turned(between)
    if polished:
        bars, off = _bars(pin, (a, b), squares)
        pin -= _solve(bars, 0.5 * off)
    bars, off = _bars(pin, (a, b), squares)
    rows = [pin]
    if rates:
        # what keeps a distance: bar * (pin' - given') = 0, and once more by time
        velocity = _solve(bars, _dots(bars, ca.horzcat(a_rates[0], b_rates[0]).T))
        relative = ca.horzcat(velocity - a_rates[0], velocity - b_rates[0]).T
        acceleration = _solve(bars, _dots(bars, ca.horzcat(a_rates[1], b_rates[1]).T) - _dots(relative, relative))
        rows += [velocity, acceleration]
    open_ = ca.sum1(ca.fabs(off) * (0.5 * per_size / lengths))
    directions = [part for k in range(2) for part in (bars[k, 0], bars[k, 1], squares[k])]
    return [*rows, *directions, open_, height * (0.25 / (squares[0] * squares[1]))]


def _bars(pin: ca.SX, given_pins: Sequence[ca.SX], squares: ca.SX) -> tuple[ca.SX, ca.SX]:
    """The vectors from given pins to one, row by row, and by how much their squared lengths are off."""
    bars = ca.horzcat(*(pin - given_pin for given_pin in given_pins)).T
    return bars, bars[:, 0] ** 2 - squares + bars[:, 1] ** 2


def _dots(bars: ca.SX, others: ca.SX) -> ca.SX:
    return bars[:, 0] * others[:, 0] + bars[:, 1] * others[:, 1]


def _solve(bars: ca.SX, of: ca.SX) -> ca.SX:
    """The vector whose products with two bars are so."""
    scale = 1.0 / (bars[0, 0] * bars[1, 1] - bars[0, 1] * bars[1, 0])
    x, y = of[0] * bars[1, 1] - of[1] * bars[0, 1], of[1] * bars[0, 0] - of[0] * bars[1, 0]
    return ca.vertcat(scale * x, scale * y)
