"""The pressure angle of pairs with teeth."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi, radians
from typing import Any

from planar.model.pairs.base import Entry, Quantity, Schema, described

PRESSURE_ANGLE = radians(20.0)
"""Of involute teeth by ISO 53, unless said."""
TEETH: Mapping[str, Schema] = {"pressure_angle": described("angle")}


def read_pressure_angle(entry: Entry) -> float:
    """The pressure angle of an entry (rad), or the usual one."""
    found = entry.quantity("pressure_angle", "angle", PRESSURE_ANGLE)
    if not 0.0 <= found < pi / 2.0:
        raise entry.refuse("pressure_angle", "a pressure angle from zero to less than a right angle is wanted here")
    return found


def write_pressure_angle(angle: float, quantity: Quantity) -> dict[str, Any]:
    """The angle as an entry has it; nothing where it is the usual one."""
    return {} if angle == PRESSURE_ANGLE else {"pressure_angle": quantity(angle, "angle")}
