"""Friction in files: the keys of coefficients and efficiencies, read and written; what a mesh takes of its power."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from planar.foundation.jets import Scalar
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.pairs.base import EffortAction, RubbingContact, Schema, described, schema_reference
from planar.model.pairs.rubbing import ContactLoad, Friction, LoadLaw

_COEFFICIENT: Schema = {**schema_reference("number"), "minimum": 0}
FRICTION_SCHEMA: Mapping[str, Schema] = {
    "friction": described(_COEFFICIENT, "the coefficient of friction in motion; left out: no friction"),
    "static_friction": described(_COEFFICIENT, "the coefficient at rest, not below friction; left out: the same"),
}
EFFICIENCY_SCHEMA: Mapping[str, Schema] = {
    "efficiency": described(
        {**schema_reference("number"), "exclusiveMinimum": 0, "maximum": 1},
        "the part of the power that comes out again, whichever side drives; left out: 1",
    ),
}


def has_loss(efficiency: Scalar) -> bool:
    """Whether an efficiency is not just one."""
    return not (isinstance(efficiency, float) and efficiency == 1.0)


def mesh_loss(
    wheels: tuple[str, str], action: EffortAction, torque: ContactLoad, efficiency: Scalar, rate_sense: Scalar = 1.0
) -> RubbingContact:
    """What a mesh or belt takes of the power through it, as a couple against `action`.

    `torque` is the couple (N m) by which the wheels act on each other, without loss, on the second. Where the first
    drives, 1 - efficiency of it is lost; where the second drives, it supplies what the first gets by the efficiency.
    """
    lost = 1.0 - efficiency
    drives = tuple(f"{link} drives" for link in wheels)
    load = torque._replace(
        sides=(drives[0], drives[1]), factor=torque.factor * lost, opposed=torque.factor * lost / efficiency
    )
    return RubbingContact(action, (load,), LoadLaw.GREATEST, rate_sense)


def read_friction(entry: EntryReader) -> Friction | None:
    """The coefficients of an entry; None where there is no friction. Raises BadInput."""
    if not entry.has("friction"):
        if entry.has("static_friction"):
            raise entry.error_at("static_friction", "friction at rest goes with 'friction', which is that in motion")
        return None
    kinetic = entry.number("friction")
    if kinetic < 0.0:
        raise entry.error_at("friction", "a coefficient of friction is zero or more")
    static = entry.number("static_friction") if entry.has("static_friction") else None
    if static is not None and static < kinetic:
        raise entry.error_at("static_friction", "friction at rest is not below that in motion")
    return Friction(kinetic, static)


def write_friction(friction: Friction | None, quantity: QuantityWriter) -> dict[str, Any]:
    """The coefficients as an entry has them."""
    if friction is None:
        return {}
    found = {"friction": quantity(friction.kinetic, "number")}
    if friction.static is not None:
        found["static_friction"] = quantity(friction.static, "number")
    return found


def read_efficiency(entry: EntryReader) -> float:
    """The efficiency of an entry, 1 where it is left out. Raises BadInput."""
    found = entry.number("efficiency") if entry.has("efficiency") else 1.0
    if not 0.0 < found <= 1.0:
        raise entry.error_at("efficiency", "an efficiency is above zero, and one at most")
    return found


def write_efficiency(efficiency: float, quantity: QuantityWriter) -> dict[str, Any]:
    """The efficiency as an entry has it; nothing where it is one."""
    return {} if efficiency == 1.0 else {"efficiency": quantity(efficiency, "number")}
