"""The pressure angle of pairs with teeth."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, radians
from typing import Any

from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.pairs.base import Schema, described, schema_reference

STANDARD_PRESSURE_ANGLE = radians(20.0)
"""Of involute teeth by ISO 53, unless said."""
TEETH_SCHEMA: Mapping[str, Schema] = {
    "pressure_angle": described(
        schema_reference("angle"), "the angle at which the teeth press, which forces need; left out: 20 degrees"
    )
}


def read_pressure_angle(entry: EntryReader) -> float:
    """The pressure angle of an entry (rad), or the usual one."""
    found = entry.quantity("pressure_angle", "angle", STANDARD_PRESSURE_ANGLE)
    if not 0.0 <= found < pi / 2.0:
        raise entry.error_at("pressure_angle", "a pressure angle from zero to less than a right angle is wanted here")
    return found


def write_pressure_angle(angle: float, quantity: QuantityWriter) -> dict[str, Any]:
    """The angle as an entry has it; nothing where it is the usual one."""
    return {} if angle == STANDARD_PRESSURE_ANGLE else {"pressure_angle": quantity(angle, "angle")}
