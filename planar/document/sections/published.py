"""The published values of a mechanism file."""

from __future__ import annotations

from collections.abc import Mapping

from planar.document.cursor import Cursor
from planar.document.names import find_motion, find_point
from planar.document.schema import DRIVE_SCHEMA, PUBLISHED_SCHEMA, SENSE_WORDS
from planar.foundation.errors import suggest_name
from planar.model.mechanism import PUBLISHED_QUANTITIES, Drive, Mechanism, PublishedValue, relative_motions


def read_published(cursor: Cursor, mechanism: Mechanism, points: Mapping[str, str]) -> PublishedValue:
    """A published value. Raises BadInput."""
    cursor.check_keys(*PUBLISHED_SCHEMA)
    quantity = cursor["quantity"].as_text()
    if quantity not in PUBLISHED_QUANTITIES:
        hint = suggest_name(quantity, PUBLISHED_QUANTITIES, "quantities", None)
        raise cursor.error_at("quantity", f"{quantity!r} is no quantity{hint}")
    kind = PUBLISHED_QUANTITIES[quantity]
    of, relative_to = cursor["of"].as_text(), cursor.text("relative_to")
    if quantity.startswith("angular"):
        of = cursor["of"].as_link()
    elif quantity in ("rubbing speed", "displacement", "sliding velocity", "sliding acceleration", "input torque"):
        of = find_motion(cursor["of"], relative_motions(mechanism)).name
    else:
        of = find_point(cursor["of"], of, points)
        if relative_to is not None:
            relative_to = find_point(cursor["relative_to"], relative_to, points)
    return PublishedValue(
        symbol=cursor["symbol"].as_line(),
        quantity=quantity,
        of=of,
        value=cursor.optional_quantity("value", kind)
        if cursor.has("value") and cursor["value"].value is not None
        else None,
        tolerance=_read_tolerance(cursor),
        relative_to=relative_to,
        component=cursor.choice("component", ("x", "y")),
        sense=cursor.choice("sense", SENSE_WORDS),
        case=cursor["case"].as_line() if cursor.has("case") else None,
        note=cursor.text("note"),
        slip=cursor.text("slip"),
        inputs=_read_drives(cursor, "inputs", mechanism),
        start=_read_drives(cursor, "from", mechanism),
    )


def _read_drives(cursor: Cursor, key: str, mechanism: Mechanism) -> tuple[Drive, ...]:
    if not cursor.has(key):
        return ()
    known = {given.pair: relative_motions(mechanism)[given.pair] for given in mechanism.inputs}
    found = []
    for name, drive in cursor[key].members():
        if name not in known:
            raise drive.error_at(
                None, f"there is no input at {name!r}{suggest_name(name, known, 'the pairs with inputs')}"
            )
        drive.check_keys(*DRIVE_SCHEMA)
        kinds = known[name].input_quantity_kinds()
        found.append(
            Drive(
                name,
                drive.optional_quantity("position", kinds[0]),
                drive.optional_quantity("velocity", kinds[1]),
                drive.optional_quantity("acceleration", kinds[2]),
            )
        )
    return tuple(found)


def _read_tolerance(cursor: Cursor) -> float:
    if not cursor.has("tolerance"):
        return float(PublishedValue._field_defaults["tolerance"])
    found = cursor["tolerance"].as_number()
    if not 0.0 <= found < 1e100:
        raise cursor.error_at("tolerance", f"a number from zero on is wanted here, not {found!r}")
    return found
