"""Plates and pins of a mechanism that is to be built, as tables and as records."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.console import Group, RenderableType
from rich.text import Text

from planar.manufacture.plates import plate_area
from planar.reports.fitted_table import plain_table

if TYPE_CHECKING:
    from planar.manufacture.parts import Parts


def parts_tables(found: Parts) -> RenderableType:
    """The plates by layers, the pins, the spacers, and what is to know of them."""
    unit = found.unit
    plates = plain_table("Plates", "no.", "plate", "layer", "holes", "slots", "teeth", f"area, {unit.name}²", left=(1,))
    for number, plate in enumerate(found.plates, 1):
        counted = len(plate.drilled), len(plate.slots), plate.teeth or ""
        plates.add_row(
            str(number),
            plate.name,
            str(plate.layer),
            *map(str, counted),
            f"{plate_area(plate) / unit.millimetres**2:.5g}",
        )
    pins = plain_table("Pins", "pin", f"diameter, {unit.name}", f"length, {unit.name}", "layers", left=(0,))
    for pin in found.pins:
        low, high = pin.layers
        pins.add_row(pin.name, unit.format(pin.diameter), unit.format(pin.length), f"{low} to {high}")
    tables = [plates, pins]
    if found.spacers:
        heads = (f"{name}, {unit.name}" for name in ("inner", "outer", "length"))
        spacers = plain_table("Spacers", "pin", *heads, "layers", left=(0,))
        for spacer in found.spacers:
            low, high = spacer.layers
            outer = unit.format(spacer.outer) if spacer.outer else "-"
            layers = str(low) if low == high else f"{low} to {high}"
            spacers.add_row(spacer.pin, unit.format(spacer.inner), outer, unit.format(spacer.length), layers)
        tables.append(spacers)
    clear = "every plate and pin is clear" if found.is_clear else "not everything is clear"
    told = [f"{clear} over the run, at {found.positions} positions and between them", *found.notes]
    return Group(Text(found.heading, style="bold"), Text(), *tables, Text("\n".join(told)))


def parts_record(found: Parts) -> dict[str, Any]:
    """The same in SI for programs, plates with the places of their holes where the mechanism was drawn."""
    return {
        "mechanism": found.mechanism.name,
        "scale": found.scale,
        "thickness": found.thickness,
        "clear": found.is_clear,
        "positions": found.positions,
        "notes": list(found.notes),
        "plates": [
            {
                "plate": plate.name,
                "link": plate.link,
                "kind": plate.kind,
                "layer": plate.layer,
                "teeth": plate.teeth or None,
                "module": plate.module / 1e3 or None,
                "area": plate_area(plate) / 1e6,
                "holes": {hole.pin: [each / 1e3 for each in hole.at] for hole in plate.holes},
            }
            for plate in found.plates
        ],
        "pins": [
            {"pin": pin.name, "diameter": pin.diameter, "length": pin.length, "layers": list(pin.layers)}
            for pin in found.pins
        ],
        "spacers": [spacer.__dict__ | {"layers": list(spacer.layers)} for spacer in found.spacers],
        "sheets": [[plate.name for plate in sheet] for sheet in found.sheets],
    }
