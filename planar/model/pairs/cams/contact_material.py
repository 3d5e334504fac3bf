"""What a cam and the face of its follower are made of, and how wide they touch."""

from __future__ import annotations

from typing import Any, NamedTuple

from planar.foundation.argument_types import checked_arguments
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.pairs.base import Schema, described, schema_reference

KEYS = ("width", "modulus", "poisson_ratio", "follower_modulus", "follower_poisson_ratio")


@checked_arguments
class ContactMaterial(NamedTuple):
    """How wide cam and follower touch (m), and of both Young's modulus (Pa) and Poisson's ratio."""

    width: float
    modulus: float
    poisson_ratio: float
    follower_modulus: float
    follower_poisson_ratio: float

    @property
    def effective_modulus(self) -> float:
        """E* (Pa): 1/E* is (1 - nu^2) / E of the cam and that of its follower, added up."""
        return 1.0 / (
            (1.0 - self.poisson_ratio**2) / self.modulus
            + (1.0 - self.follower_poisson_ratio**2) / self.follower_modulus
        )


def contact_schema() -> Schema:
    """What JSON Schema says of the contact of a cam."""
    ratio = {"type": "number", "minimum": 0, "exclusiveMaximum": 0.5}
    return {
        "type": "object",
        "properties": {
            "width": described(schema_reference("size"), "how wide cam and follower touch, along the cam's axis"),
            "modulus": described(schema_reference("quantity"), "the cam's modulus of elasticity, as 206 GPa"),
            "poisson_ratio": described(ratio, "the cam's Poisson's ratio; left out: 0.3"),
            "follower_modulus": described(schema_reference("quantity"), "that of the follower; left out: the cam's"),
            "follower_poisson_ratio": described(ratio, "that of the follower; left out: the cam's"),
        },
        "required": ["width", "modulus"],
        "additionalProperties": False,
    }


def read_contact(entry: EntryReader, key: str) -> ContactMaterial:
    """The contact under a key of an entry."""
    place = entry.object_at(key)
    place.check_keys(*KEYS)
    width, modulus = place.quantity("width", "length"), place.quantity("modulus", "stress")
    follower = place.quantity("follower_modulus", "stress", modulus)
    for name, value in (("width", width), ("modulus", modulus), ("follower_modulus", follower)):
        if not value > 0.0:
            raise place.error_at(name, "a number above zero is wanted here")
    ratio = place.number("poisson_ratio") if place.has("poisson_ratio") else 0.3
    other = place.number("follower_poisson_ratio") if place.has("follower_poisson_ratio") else ratio
    for name, value in (("poisson_ratio", ratio), ("follower_poisson_ratio", other)):
        if not 0.0 <= value < 0.5:
            raise place.error_at(name, "a Poisson's ratio is from 0 up to 0.5")
    return ContactMaterial(width, modulus, ratio, follower, other)


def write_contact(contact: ContactMaterial, quantity: QuantityWriter) -> dict[str, Any]:
    """The contact as a file has it."""
    return {
        "width": quantity(contact.width, "length"),
        "modulus": quantity(contact.modulus, "stress"),
        "poisson_ratio": quantity(contact.poisson_ratio, "number"),
        "follower_modulus": quantity(contact.follower_modulus, "stress"),
        "follower_poisson_ratio": quantity(contact.follower_poisson_ratio, "number"),
    }
