"""The motor of an input in a file: an entry to a Motor, and back."""

from __future__ import annotations

from typing import Any

from planar.document.cursor import Cursor
from planar.document.loads import EFFORT_KINDS
from planar.document.schema import MOTOR_SCHEMA
from planar.model.motors import Motor
from planar.model.pairs import Pair, QuantityWriter


def read_motor(cursor: Cursor, pair: Pair) -> Motor:
    """The motor of an input at a pair. Raises BadInput."""
    cursor.check_keys(*MOTOR_SCHEMA)
    effort, efforts, other = _effort_keys(pair)
    if cursor.has(other):
        raise cursor.error_at(other, f"what a motor at pair {pair.name!r} supplies are {efforts}")
    speed = pair.input_quantity_kinds()[1]
    line, table = ("stall", "no_load"), ("speeds", efforts)
    if any(map(cursor.has, line)) == any(map(cursor.has, table)):
        told = f"a motor has 'stall' and 'no_load', or a table of 'speeds' and {efforts!r}"
        raise cursor.error_at(None, told)
    if cursor.has("stall") or cursor.has("no_load"):
        motor = Motor(cursor.quantity("stall", effort), cursor.quantity("no_load", speed))
    else:
        columns = [
            tuple(each.as_quantity(kind) for each in cursor[key].items())
            for key, kind in zip(table, (speed, effort), strict=True)
        ]
        motor = Motor(None, None, *columns)
    wrong = motor.find_problem()
    if wrong:
        raise cursor.error_at(efforts if wrong[0] == "efforts" else wrong[0], wrong[1])
    return motor


def write_motor(motor: Motor, pair: Pair, quantity: QuantityWriter) -> dict[str, Any]:
    """A motor as a file has it."""
    effort, efforts, _ = _effort_keys(pair)
    speed = pair.input_quantity_kinds()[1]
    if motor.stall is not None and motor.no_load is not None:
        return {"stall": quantity(motor.stall, effort), "no_load": quantity(motor.no_load, speed)}
    return {
        "speeds": [quantity(each, speed) for each in motor.speeds],
        efforts: [quantity(each, effort) for each in motor.efforts],
    }


def _effort_keys(pair: Pair) -> tuple[str, str, str]:
    """The kind of what a motor supplies at a pair, the key of its table, and that of a motor of the other kind."""
    kind = EFFORT_KINDS.get(pair.input_kind, "torque")
    return kind, f"{kind}s", "torques" if kind == "force" else "forces"
