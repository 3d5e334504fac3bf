"""The tolerances of a file: its entry to Tolerances."""

from __future__ import annotations

from collections.abc import Mapping

from planar.document.cursor import Cursor
from planar.document.dimensions import Dimension, file_dimensions, find_dimension
from planar.document.schema import TOLERANCE_SCHEMA
from planar.foundation.errors import BadInput, suggest_name, suggest_spelling
from planar.model.mechanism import Mechanism, pair_entries
from planar.model.pairs import Pair
from planar.model.tolerances.iso_286 import FitError, greatest_clearance, parse_fit
from planar.model.tolerances.iso_2768 import CLASSES
from planar.model.tolerances.tolerances import GENERAL, Clearance, Deviations, Tolerances


def read_tolerances(cursor: Cursor, mechanism: Mechanism) -> Tolerances:
    """The tolerances of a mechanism's numbers and pins. Raises BadInput."""
    known = file_dimensions(mechanism)
    numbers = tuple(
        _read_deviations(place, name, known) for name, place in cursor.members() if name not in TOLERANCE_SCHEMA
    )
    general = None
    if cursor.has("general"):
        text = " ".join(cursor["general"].as_text().split())
        general = text.removeprefix(GENERAL)
        if not text.startswith(GENERAL) or general not in CLASSES:
            told = ", ".join(f"'{GENERAL}{grade}' ({word})" for grade, word in CLASSES.items())
            raise cursor.error_at("general", f"{text!r:.40} is no class of general tolerances; there are {told}")
    lengths = _read_bounds(cursor["lengths"], "length") if cursor.has("lengths") else None
    pins = {group[0].entry_name(): group[0] for group in pair_entries(mechanism)}
    clearances = cursor["clearance"].members() if cursor.has("clearance") else ()
    by_pins = tuple(_read_clearance(place, name, pins) for name, place in clearances)
    return Tolerances(numbers, general, by_pins, lengths)


def _read_deviations(cursor: Cursor, name: str, known: Mapping[str, Dimension]) -> Deviations:
    try:
        dimension = find_dimension(known, name)
    except BadInput as problem:
        near = suggest_spelling(name, TOLERANCE_SCHEMA)
        raise cursor.error_at(None, f"{problem.sentence}{near}") from None
    if dimension.kind == "count" or dimension.path[0] == "sketch" or dimension.address[0] == "stops":
        raise cursor.error_at(None, f"{name!r} has no tolerance: nothing that is told follows smoothly from it")
    return Deviations(name, dimension.kind, *_read_bounds(cursor, dimension.kind))


def _read_bounds(cursor: Cursor, kind: str) -> tuple[float, float]:
    """The lower and the upper deviation: two values, or one that is plus and minus. Raises BadInput."""
    if not isinstance(cursor.value, list):
        upper = _read_value(cursor, kind)
        if upper < 0.0:
            raise cursor.error_at(None, "plus and minus this, so it is no number below 0; or give [lower, upper]")
        return -upper, upper
    bounds = tuple(_read_value(item, kind) for item in cursor.items())
    if len(bounds) != 2 or bounds[0] > bounds[1]:
        raise cursor.error_at(None, "a lower and an upper deviation are wanted here, as [-0.02, 0.05], the lower first")
    return bounds[0], bounds[1]


def _read_value(cursor: Cursor, kind: str) -> float:
    return cursor.as_number() if kind == "number" else cursor.as_quantity(kind)


def _read_clearance(cursor: Cursor, name: str, pins: Mapping[str, Pair]) -> Clearance:
    if name not in pins:
        raise cursor.error_at(None, f"there is no pair {name!r}{suggest_name(name, pins, 'pairs')}")
    pair = pins[name]
    if not pair.has_pin():
        raise cursor.error_at(None, f"{name!r} has no pin that could stand anywhere in its hole; clearance is of pins")
    if isinstance(cursor.value, str) and "/" in cursor.value:
        diameter = pair.pin_diameter()
        if diameter is None:
            raise cursor.error_at(None, f"a fit goes by the pin's diameter; give {name!r} its 'pin_diameter'")
        try:
            fit = parse_fit(cursor.value)
            greatest_clearance(fit, float(diameter))
        except FitError as problem:
            raise cursor.error_at(None, str(problem)) from None
        return Clearance(name, fit=str(fit))
    value = cursor.as_quantity("length")
    if value < 0.0:
        raise cursor.error_at(None, "a clearance is a length from 0 on, or a fit such as 'H7/g6'")
    return Clearance(name, value)
