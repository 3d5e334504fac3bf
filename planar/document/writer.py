"""A Mechanism to a JSON value that reads back as the same mechanism."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from planar.document.input_laws import write_law
from planar.document.loads import write_loads
from planar.document.schema import DRIVE_SCHEMA, FORMAT_VERSION
from planar.foundation.units import SI_UNITS, Unit, UnitError, parse_unit, shortest_number
from planar.model.file_units import FileUnits, is_metric, takes_bare_number, unit_of_kind
from planar.model.link_shapes import Along, At, Link, Offset, PointDefinition
from planar.model.mechanism import (
    PUBLISHED_QUANTITIES,
    Drive,
    Input,
    Mechanism,
    PublishedValue,
    pair_entries,
    relative_motions,
)
from planar.model.pairs import Pair, QuantityWriter


def write_mechanism(mechanism: Mechanism) -> dict[str, Any]:
    """The mechanism as a file has it, in its own units; each number reads back to the last bit."""
    quantity, motions = quantity_writer(mechanism.units), relative_motions(mechanism)
    value: dict[str, Any] = {"planar": FORMAT_VERSION, "name": mechanism.name}
    value |= _nonempty_fields(
        ids=list(mechanism.ids),
        about=mechanism.about,
        source=mechanism.source,
        geometry=mechanism.geometry,
        notes=list(mechanism.notes),
    )
    value["units"] = {key: unit for key, unit in mechanism.units._asdict().items() if unit}
    value["frame"] = mechanism.frame
    if mechanism.frame_number != "last":
        value["frame_number"] = mechanism.frame_number
    value["links"] = {link.name: write_link(link, quantity) for link in mechanism.links}
    stiffness = {name: quantity(each, "stiffness") for name, each in mechanism.pair_stiffness}
    value["pairs"] = [
        _write_pair(group, mechanism, quantity) | _nonempty_fields(stiffness=stiffness.get(group[0].entry_name()))
        for group in pair_entries(mechanism)
    ]
    if mechanism.closes_within is not None:
        value["closes_within"] = quantity(mechanism.closes_within, "length")
    if mechanism.tolerances is not None:
        value["tolerances"] = mechanism.tolerances.write(quantity)
    value |= _nonempty_fields(
        inputs=[write_input(given, motions, quantity) for given in mechanism.inputs],
        **write_loads(mechanism, quantity),
        sketch={point: [quantity(x, "length"), quantity(y, "length")] for point, x, y in mechanism.sketch},
        published=[_write_published(item, mechanism, quantity) for item in mechanism.published],
    )
    return value


def quantity_writer(units: FileUnits) -> QuantityWriter:
    """Writes SI numbers in the units that a file declares, so that each reads back to the last bit."""

    def quantity(value: float, kind: str) -> float | str:
        value = float(value)  # a number of numpy would write its type
        if kind == "count":
            return int(value)
        if units.declared(kind):
            return shortest_number(value, unit_of_kind(kind, units)[1])
        if value != 0.0 and (kind.startswith("angular") or not takes_bare_number(kind, units)):
            return _quantity_text(value, kind, units)
        return shortest_number(value, Unit(kind, 1.0, 1.0))

    return quantity


def _quantity_text(value: float, kind: str, units: FileUnits) -> str:
    """A quantity (SI) as a text in SI, or where that is not metric in the unit in which it is shown."""
    name, of = unit_of_kind(kind, units)
    if not is_metric(of):
        with suppress(UnitError):  # it may be made of one that is spelled as nobody does: in^1
            number = shortest_number(value, parse_unit(name))
            if not isinstance(number, str):
                return f"{number!r} {name}"
    return f"{value!r} {SI_UNITS[kind]}"


def _nonempty_fields(**fields: Any) -> dict[str, Any]:
    """Only the fields that say something."""
    return {
        key: value
        for key, value in fields.items()
        if value is not None and (value or not isinstance(value, list | dict))
    }


def _list_or_none(values: Iterable[Any] | None) -> list[Any] | None:
    return None if values is None else list(values)


def write_link(link: Link, quantity: QuantityWriter) -> dict[str, Any]:
    """A link as a file has it."""
    return _nonempty_fields(
        ends=_list_or_none(link.ends),
        length=None if link.length is None else quantity(link.length, "length"),
        axis=_list_or_none(link.axis),
        points={point.name: _write_point_definition(point.place, quantity) for point in link.points},
        curved_slot=link.curved_slot or None,
    )


def _write_point_definition(place: PointDefinition, quantity: QuantityWriter) -> Any:
    if isinstance(place, At):
        return [quantity(place.x, "length"), quantity(place.y, "length")]
    if isinstance(place, Along):
        return {
            "along": [place.start, place.towards],
            "distance": quantity(place.distance, "length"),
            "angle": quantity(place.angle, "angle"),
        }
    if isinstance(place, Offset):
        return {
            "along": [place.start, place.towards],
            "distance": quantity(place.distance, "length"),
            "offset": quantity(place.offset, "length"),
        }
    return {
        "distances": {
            place.first: quantity(place.from_first, "length"),
            place.second: quantity(place.from_second, "length"),
        },
        "left_of" if place.left else "right_of": [place.first, place.second],
    }


def _write_pair(group: Sequence[Pair], mechanism: Mechanism, quantity: QuantityWriter) -> dict[str, Any]:
    entry = type(group[0]).write(group, quantity)
    if not mechanism.stops:
        return entry
    from planar.document.common_pair_keys import write_stops  # few pairs have any

    return write_stops(entry, mechanism.stops, group, quantity)


def write_input(drive: Input, motions: Mapping[str, Pair], quantity: QuantityWriter) -> dict[str, Any]:
    """An input as a file has it."""
    law = None if drive.law is None else write_law(drive.law, motions[drive.pair].input_quantity_kinds(), quantity)
    motor = None
    if drive.motor is not None:
        from planar.document.motors import write_motor  # few inputs have one

        motor = write_motor(drive.motor, motions[drive.pair], quantity)
    return {"pair": drive.pair} | _write_drive(drive, motions, quantity) | _nonempty_fields(law=law, motor=motor)


def _write_drive(drive: Any, motions: Mapping[str, Pair], quantity: QuantityWriter) -> dict[str, Any]:
    kinds = dict(zip(DRIVE_SCHEMA, motions[drive.pair].input_quantity_kinds(), strict=True))
    told = {key: getattr(drive, key) for key in kinds}
    return {key: quantity(value, kinds[key]) for key, value in told.items() if value is not None}


def _write_drives(mechanism: Mechanism, drives: tuple[Drive, ...], quantity: QuantityWriter) -> dict[str, Any]:
    motions = relative_motions(mechanism) if drives else {}
    return {drive.pair: _write_drive(drive, motions, quantity) for drive in drives}


def _write_published(item: PublishedValue, mechanism: Mechanism, quantity: QuantityWriter) -> dict[str, Any]:
    kind = PUBLISHED_QUANTITIES[item.quantity]
    value = None if item.value is None else _quantity_text(float(item.value), kind, mechanism.units)
    return {"symbol": item.symbol, "quantity": item.quantity, "of": item.of, "value": value} | _nonempty_fields(
        tolerance=item.tolerance,
        relative_to=item.relative_to,
        component=item.component,
        sense=item.sense,
        case=item.case,
        note=item.note,
        slip=item.slip,
        inputs=_write_drives(mechanism, item.inputs, quantity),
        **{"from": _write_drives(mechanism, item.start, quantity)},
    )
