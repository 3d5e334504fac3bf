"""A Mechanism to a JSON value that reads back as the same mechanism."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from planar.document.input_laws import write_law
from planar.document.loads import write_applied
from planar.document.schema import DRIVE, FORMAT
from planar.foundation.units import SI, Unit, shortest, unit
from planar.model.link_shapes import Along, At, Place
from planar.model.mechanism import (
    QUANTITIES,
    Drive,
    Input,
    Link,
    Mechanism,
    Published,
    entries,
    motions,
)
from planar.model.pairs import Quantity


def write(mechanism: Mechanism) -> dict[str, Any]:
    """The mechanism as a file has it, in its own units; each number reads back to the last bit."""
    quantity = _quantities(mechanism)
    value: dict[str, Any] = {"planar": FORMAT, "name": mechanism.name}
    value |= _told(
        ids=list(mechanism.ids),
        about=mechanism.about,
        source=mechanism.source,
        geometry=mechanism.geometry,
        notes=list(mechanism.notes),
    )
    value["units"] = {"length": mechanism.units.length, "angle": mechanism.units.angle}
    value["frame"] = mechanism.frame
    value["links"] = {link.name: _link(link, quantity) for link in mechanism.links}
    value["pairs"] = [type(group[0]).write(group, quantity) for group in entries(mechanism)]
    value |= _told(
        inputs=[_drive_entry(mechanism, given, quantity) for given in mechanism.inputs],
        **write_applied(mechanism, quantity),
        sketch={point: [quantity(x, "length"), quantity(y, "length")] for point, x, y in mechanism.sketch},
        published=[_published(item, mechanism, quantity) for item in mechanism.published],
    )
    return value


def _quantities(mechanism: Mechanism) -> Quantity:
    declared = {"length": unit(mechanism.units.length), "angle": unit(mechanism.units.angle)}

    def quantity(value: float, kind: str) -> float | str:
        value = float(value)  # a number of numpy would write its type
        if kind in declared:
            return shortest(value, declared[kind])
        if kind.startswith("angular") and value != 0.0:
            return f"{value!r} {SI[kind]}"  # a bare rate is refused where angles are in degrees
        return shortest(value, Unit(kind, 1.0, 1.0))

    return quantity


def _told(**fields: Any) -> dict[str, Any]:
    """Only the fields that say something."""
    return {
        key: value
        for key, value in fields.items()
        if value is not None and (value or not isinstance(value, list | dict))
    }


def _list(values: Iterable[Any] | None) -> list[Any] | None:
    return None if values is None else list(values)


def _link(link: Link, quantity: Quantity) -> dict[str, Any]:
    return _told(
        ends=_list(link.ends),
        length=None if link.length is None else quantity(link.length, "length"),
        axis=_list(link.axis),
        points={point.name: _place(point.place, quantity) for point in link.points},
    )


def _place(place: Place, quantity: Quantity) -> Any:
    if isinstance(place, At):
        return [quantity(place.x, "length"), quantity(place.y, "length")]
    if isinstance(place, Along):
        return {
            "along": [place.start, place.towards],
            "distance": quantity(place.distance, "length"),
            "angle": quantity(place.angle, "angle"),
        }
    return {
        "distances": {
            place.first: quantity(place.from_first, "length"),
            place.second: quantity(place.from_second, "length"),
        },
        "left_of" if place.left else "right_of": [place.first, place.second],
    }


def _drive_entry(mechanism: Mechanism, drive: Input, quantity: Quantity) -> dict[str, Any]:
    law = None if drive.law is None else write_law(drive.law, motions(mechanism)[drive.pair].driven(), quantity)
    return {"pair": drive.pair} | _drive(mechanism, drive, quantity) | _told(law=law)


def _drive(mechanism: Mechanism, drive: Any, quantity: Quantity) -> dict[str, Any]:
    kinds = dict(zip(DRIVE, motions(mechanism)[drive.pair].driven(), strict=True))
    told = {key: getattr(drive, key) for key in kinds}
    return {key: quantity(value, kinds[key]) for key, value in told.items() if value is not None}


def _drives(mechanism: Mechanism, drives: tuple[Drive, ...], quantity: Quantity) -> dict[str, Any]:
    return {drive.pair: _drive(mechanism, drive, quantity) for drive in drives}


def _published(item: Published, mechanism: Mechanism, quantity: Quantity) -> dict[str, Any]:
    value = None if item.value is None else f"{float(item.value)!r} {SI[QUANTITIES[item.quantity]]}"
    return {"symbol": item.symbol, "quantity": item.quantity, "of": item.of, "value": value} | _told(
        tolerance=item.tolerance,
        relative_to=item.relative_to,
        component=item.component,
        sense=item.sense,
        case=item.case,
        note=item.note,
        slip=item.slip,
        inputs=_drives(mechanism, item.inputs, quantity),
        **{"from": _drives(mechanism, item.start, quantity)},
    )
