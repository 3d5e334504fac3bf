"""The units in which a page tells its numbers: those of the file, and others that a reader may choose."""

from __future__ import annotations

from typing import Any

from planar.drawing.paper.scales import paper_unit
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits, display_unit

SHOWN_KINDS = (
    "length",
    "angle",
    "velocity",
    "acceleration",
    "angular velocity",
    "angular acceleration",
    "force",
    "torque",
    "power",
    "mass",
    "moment of inertia",
    "stiffness",
    "damping",
    "torsional stiffness",
    "torsional damping",
)
"""Of quantities that a page shows."""
OTHER_UNITS = (
    FileUnits("mm", "deg"),
    FileUnits("cm", "deg"),
    FileUnits("m", "deg"),
    FileUnits("m", "rad"),
    FileUnits("in", "deg"),
    FileUnits("ft", "deg"),
)
"""What a reader may choose besides the file's own."""


def unit_data(units: FileUnits) -> dict[str, Any]:
    """Of kinds of quantities as they are shown beside units: `units`, `paces` of inputs, and the scale's `paper`.

    A unit is `ratio[0] / ratio[1]` of the SI unit, `si` in one number.
    """
    shown = {kind: display_unit(kind, units) for kind in SHOWN_KINDS}
    return {
        "units": {
            kind: {"name": name, "si": of.to_si(1.0), "ratio": [of.numerator, of.denominator]}
            for kind, (name, of) in shown.items()
        },
        "paces": _pace_data(units),
        "paper": dict(zip(("name", "mm"), paper_unit(units.length), strict=True)),
    }


def unit_choices(units: FileUnits) -> list[dict[str, Any]]:
    """What a reader may choose: `name`, and what `unit_data` has of each; the file's own first, by its name alone."""
    others = (each for each in OTHER_UNITS if each[:2] != units[:2])
    return [
        {"name": "of the file"},
        *({"name": f"{each.length}, {each.angle}", **unit_data(each)} for each in others),
    ]


def _pace_data(units: FileUnits) -> dict[str, Any]:
    """In what the pace of a page's inputs is told: what the file declares, else its length by the second, and rpm."""
    own = f"{units.length}/s", parse_unit(units.length)
    length = display_unit("velocity", units) if units.velocity else own
    angle = display_unit("angular velocity", units) if units.angular_velocity else ("rpm", parse_unit("rpm"))
    return {kind: {"name": name, "si": of.to_si(1.0)} for kind, (name, of) in (("length", length), ("angle", angle))}
