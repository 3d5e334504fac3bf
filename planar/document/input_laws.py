"""The law of an input in a file: a list of pieces to a Law and back."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from planar.document.cursor import Cursor
from planar.foundation.errors import suggest_name
from planar.foundation.units import SI_UNITS
from planar.model.file_units import FileUnits, display_unit
from planar.model.input_laws import SEGMENT_TYPES, InputLaw, LawSegment, SegmentKey, TableSegment
from planar.model.loads import MAX_LAW_ITEMS
from planar.model.mechanism import LARGEST_INPUT_POSITION, Input
from planar.model.pairs import Pair, QuantityWriter

InputKinds = tuple[str, str, str]
"""The kinds of quantity of an input's position, velocity and acceleration."""


def read_law(cursor: Cursor, given: Input, kinds: InputKinds) -> InputLaw:
    """The law of an input that starts as given. Raises BadInput."""
    places = tuple(cursor.items()) if isinstance(cursor.value, list) else (cursor,)
    if not 1 <= len(places) <= MAX_LAW_ITEMS:
        raise cursor.error_at(None, f"a law has from 1 to {MAX_LAW_ITEMS} pieces, not {len(places)}")
    law = InputLaw(tuple(_read_segment(place, kinds) for place in places))
    joints = law.joints(given.position, given.velocity)
    for place, piece, before, after in zip(places, law.segments, joints, joints[1:], strict=False):
        if isinstance(piece, TableSegment) and not piece.starts_at(before.position):
            own, wanted = (_format_value(cursor, each, kinds[0]) for each in (piece.positions[0], before.position))
            raise place.error_at("positions[0]", f"the table starts at {own}, but the piece starts at {wanted}")
        if not abs(after.position) <= LARGEST_INPUT_POSITION:
            told = f"this leads to {after.position:.6g} {SI_UNITS[kinds[0]]}"
            raise place.error_at(None, f"{told}; an input moves to {LARGEST_INPUT_POSITION:g} rad or m at most")
    return law


def write_law(law: InputLaw, kinds: InputKinds, quantity: QuantityWriter) -> list[dict[str, Any]]:
    """The pieces of a law as a file has them."""
    return [{"motion": piece.motion} | dict(_written_values(piece, kinds, quantity)) for piece in law.segments]


def speed_jump_remarks(inputs: Iterable[Input], known: Mapping[str, Pair], units: FileUnits) -> Iterator[str]:
    """What is to be said of each law whose pieces do not go on at the speed at which those before end."""
    for given in inputs:
        if given.law is None:
            continue
        joints = given.law.joints(given.position, given.velocity)[:-1]
        fastest = max(abs(speed) for joint in joints for speed in (joint.velocity_before, joint.velocity_after))
        # an input that rests in the file has no speed there that its law could go against
        found = [
            (i, joint)
            for i, joint in enumerate(joints)
            if abs(joint.velocity_after - joint.velocity_before) > 1e-9 * fastest and (i > 0 or given.velocity != 0.0)
        ]
        if found:
            (i, joint), *more = found
            name, of = display_unit(known[given.pair].input_quantity_kinds()[1], units)
            before = f"piece {i} ends" if i else "the input's velocity is"
            speeds = (joint.velocity_after, joint.velocity_before)
            starts, ends = (f"at {of.from_si(v):.6g} {name}" if v else "at rest" for v in speeds)
            others = f"; so it does at {len(more)} more of its joints" if more else ""
            told = f"{before} {ends if i else ends.removeprefix('at ')}"
            yield f"the law of input {given.pair!r} jumps in speed: piece {i + 1} starts {starts} where {told}{others}"


def _read_segment(cursor: Cursor, kinds: InputKinds) -> LawSegment:
    motion = cursor["motion"].as_choice(tuple(SEGMENT_TYPES))
    kind = SEGMENT_TYPES[motion]
    for key in cursor.fields():
        if key not in ("motion", *kind.keys):
            hint = suggest_name(key, ("motion", *kind.keys), "its keys", None)
            raise cursor.error_at(key, f"{motion!r} has no {key!r}{hint}")
    for key, each in kind.keys.items():
        if each.is_list and len(tuple(cursor[key].items())) > MAX_LAW_ITEMS:
            raise cursor.error_at(key, f"a table has at most {MAX_LAW_ITEMS} points")
    read = {
        each.field: _read_value(cursor[key], each, kinds)
        for key, each in kind.keys.items()
        if cursor.has(key) or each.is_required
    }
    piece = kind(**read)
    wrong = piece.find_problem()
    if wrong is not None:
        raise cursor.error_at(*wrong)
    return piece


def _read_value(cursor: Cursor, key: SegmentKey, kinds: InputKinds) -> Any:
    def one(cursor: Cursor) -> float:
        return cursor.as_number() if key.value_kind == "number" else cursor.as_quantity(_quantity_kind(key, kinds))

    return tuple(map(one, cursor.items())) if key.is_list else one(cursor)


def _written_values(piece: LawSegment, kinds: InputKinds, quantity: QuantityWriter) -> Iterator[tuple[str, Any]]:
    for name, key in piece.keys.items():
        value = getattr(piece, key.field)
        if value is not None:
            kind = _quantity_kind(key, kinds)
            yield name, [quantity(each, kind) for each in value] if key.is_list else quantity(value, kind)


def _quantity_kind(key: SegmentKey, kinds: InputKinds) -> str:
    orders = ("position", "velocity", "acceleration")
    return kinds[orders.index(key.value_kind)] if key.value_kind in orders else key.value_kind


def _format_value(cursor: Cursor, value: float, kind: str) -> str:
    name, of = display_unit(kind, cursor.context.units)
    return f"{of.from_si(value):.9g} {name}"
