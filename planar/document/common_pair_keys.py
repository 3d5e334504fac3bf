"""Keys that the entry of any pair may have: its stops, read and written, and its stiffness."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from planar.document.cursor import Cursor
from planar.foundation.errors import suggest_name
from planar.model.mechanism import LARGEST_COUNTED_ANGLE
from planar.model.pairs import MeasureKind, Pair, QuantityWriter
from planar.model.stops import Stops


def read_stops(entry: Cursor, group: Sequence[Pair]) -> tuple[Stops, ...]:
    """The stops in the entry of these pairs. Raises BadInput."""
    if not entry.has("stops"):
        if entry.has("restitution"):
            raise entry.error_at("restitution", "a 'restitution' is that of 'stops', and there are none here")
        return ()
    motions = {pair.name: pair for pair in type(group[0]).relative_motions(group)}
    restitution = entry["restitution"].as_number() if entry.has("restitution") else 0.0
    cursor = entry["stops"]
    if isinstance(cursor.value, dict):
        if not cursor.value:
            raise cursor.error_at(None, "no relative motion is named here; write the two stops, as [10, 95]")
        for name, place in cursor.members():
            if name not in motions:
                raise place.error_at(
                    None, f"{name!r} is none of its relative motions{suggest_name(name, motions, 'these')}"
                )
        given = [(motions[name], place) for name, place in cursor.members()]
    elif len(motions) > 1:
        such = f'{{"{next(iter(motions))}": [...]}}'
        told = f"{group[0].entry_name()!r} joins {len(group) + 1} links; name the relative motion that stops, as {such}"
        raise cursor.error_at(None, told)
    else:
        given = [(pair, cursor) for pair in motions.values()]
    return tuple(_read_limits(place, pair, restitution, entry) for pair, place in given)


def read_pair_stiffness(entries: Sequence[tuple[Cursor, Sequence[Pair]]]) -> tuple[tuple[str, float], ...]:
    """The stiffness of every pair by its name (N/m). Raises BadInput where some pairs have one and some none."""
    found = []
    for entry, group in entries:
        if entry.has("stiffness"):
            stiffness = entry["stiffness"].as_quantity("stiffness")
            if not stiffness > 0.0:
                raise entry.error_at("stiffness", "a pair's stiffness is above 0")
            found.append((group[0].entry_name(), stiffness))
    if found and len(found) < len(entries):
        without = next(entry for entry, _ in entries if not entry.has("stiffness"))
        wrong = "this pair has no 'stiffness', but others have: give it on all pairs, or on none"
        raise without.error_at(None, wrong)
    return tuple(found)


def _read_limits(cursor: Cursor, pair: Pair, restitution: float, entry: Cursor) -> Stops:
    items = tuple(cursor.items())
    if len(items) != 2:
        raise cursor.error_at(None, f"a lower and an upper stop are wanted here, not {len(items)} (null: open)")
    low, high = (None if item.value is None else _read_position(item, pair) for item in items)
    found = Stops(pair.name, low, high, restitution)
    wrong = found.find_problem()
    if wrong:
        raise (cursor.error_at(None, wrong[1]) if wrong[0] == "stops" else entry.error_at(*wrong))
    return found


def _read_position(item: Cursor, pair: Pair) -> float:
    kind = pair.input_quantity_kinds()[0]
    if pair.input_kind is MeasureKind.LENGTH:
        return item.as_quantity(kind)
    found = item.as_quantity(kind)
    if abs(found) > LARGEST_COUNTED_ANGLE:
        raise item.error_at(None, f"an angle up to {LARGEST_COUNTED_ANGLE:g} rad is wanted here")
    return found


def write_stops(
    entry: Mapping[str, Any], stops: Iterable[Stops], group: Sequence[Pair], quantity: QuantityWriter
) -> dict[str, Any]:
    """A pair's entry with the stops of its relative motions."""
    motions = {pair.name: pair for pair in type(group[0]).relative_motions(group)}
    own = [each for each in stops if each.pair in motions]
    if not own:
        return dict(entry)
    limits = {each.pair: _write_limits(each, motions[each.pair], quantity) for each in own}
    found = dict(entry) | {"stops": limits if len(motions) > 1 else limits[own[0].pair]}
    if own[0].restitution != 0.0:
        found["restitution"] = quantity(own[0].restitution, "number")
    return found


def _write_limits(stops: Stops, pair: Pair, quantity: QuantityWriter) -> list[Any]:
    kind = pair.input_quantity_kinds()[0]
    return [None if each is None else quantity(each, kind) for each in (stops.low, stops.high)]
