"""The law of an input in a file: a list of pieces to a Law and back."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from planar.document.cursor import Cursor, did_you_mean
from planar.foundation.units import SI, unit
from planar.model.input_laws import MOST, MOTIONS, Key, Law, Piece, Table
from planar.model.mechanism import FARTHEST, Input
from planar.model.pairs import Pair, Quantity

Kinds = tuple[str, str, str]
"""The kinds of quantity of an input's position, velocity and acceleration."""


def read_law(cursor: Cursor, given: Input, kinds: Kinds) -> Law:
    """The law of an input that starts as given. Raises BadInput."""
    places = tuple(cursor.items()) if isinstance(cursor.value, list) else (cursor,)
    if not 1 <= len(places) <= MOST:
        raise cursor.refuse(None, f"a law has from 1 to {MOST} pieces, not {len(places)}")
    law = Law(tuple(_piece(place, kinds) for place in places))
    joints = law.joints(given.position, given.velocity)
    for place, piece, before, after in zip(places, law.pieces, joints, joints[1:], strict=False):
        if isinstance(piece, Table) and not piece.begins(before.position):
            told = [_told(cursor, each, kinds[0]) for each in (piece.positions[0], before.position)]
            raise place.refuse("positions[0]", f"the table starts at {told[0]}, but the piece starts at {told[1]}")
        if not abs(after.position) <= FARTHEST:
            told = f"this leads to {after.position:.6g} {SI[kinds[0]]}"
            raise place.refuse(None, f"{told}; an input moves to {FARTHEST:g} rad or m at most")
    return law


def write_law(law: Law, kinds: Kinds, quantity: Quantity) -> list[dict[str, Any]]:
    """The pieces of a law as a file has them."""
    return [{"motion": piece.motion} | dict(_values(piece, kinds, quantity)) for piece in law.pieces]


def jumps(inputs: Iterable[Input], known: Mapping[str, Pair]) -> Iterator[str]:
    """What is to be said of each law whose pieces do not go on at the speed at which those before end."""
    for given in inputs:
        if given.law is None:
            continue
        joints = given.law.joints(given.position, given.velocity)[:-1]
        fastest = max(abs(speed) for joint in joints for speed in (joint.ending, joint.starting))
        # an input that rests in the file has no speed there that its law could go against
        found = [
            (i, joint)
            for i, joint in enumerate(joints)
            if abs(joint.starting - joint.ending) > 1e-9 * fastest and (i > 0 or given.velocity != 0.0)
        ]
        if found:
            (i, joint), *more = found
            si = SI[known[given.pair].driven()[1]]
            before = f"piece {i} ends" if i else "the input's velocity is"
            starts, ends = (f"at {v:.6g} {si}" if v else "at rest" for v in (joint.starting, joint.ending))
            others = f"; so it does at {len(more)} more of its joints" if more else ""
            told = f"{before} {ends if i else ends.removeprefix('at ')}"
            yield f"the law of input {given.pair!r} jumps in speed: piece {i + 1} starts {starts} where {told}{others}"


def _piece(cursor: Cursor, kinds: Kinds) -> Piece:
    cursor["motion"].as_text()
    motion = cursor.one_of("motion", tuple(MOTIONS))
    kind = MOTIONS[motion]
    for key in cursor.fields():
        if key not in ("motion", *kind.keys):
            told = f"{motion!r} has no {key!r}, only {', '.join(map(repr, kind.keys))}"
            raise cursor.refuse(key, f"{told}{did_you_mean(key, kind.keys)}")
    for key, each in kind.keys.items():
        if each.many and len(tuple(cursor[key].items())) > MOST:
            raise cursor.refuse(key, f"a table has at most {MOST} points")
    read = {
        each.field: _value(cursor[key], each, kinds)
        for key, each in kind.keys.items()
        if cursor.has(key) or each.needed
    }
    piece = kind(**read)
    wrong = piece.problem()
    if wrong is not None:
        raise cursor.refuse(*wrong)
    return piece


def _value(cursor: Cursor, key: Key, kinds: Kinds) -> Any:
    def one(cursor: Cursor) -> float:
        return cursor.as_number() if key.what == "number" else cursor.as_quantity(_kind(key, kinds))

    return tuple(map(one, cursor.items())) if key.many else one(cursor)


def _values(piece: Piece, kinds: Kinds, quantity: Quantity) -> Iterator[tuple[str, Any]]:
    for name, key in piece.keys.items():
        value = getattr(piece, key.field)
        if value is not None:
            kind = _kind(key, kinds)
            yield name, [quantity(each, kind) for each in value] if key.many else quantity(value, kind)


def _kind(key: Key, kinds: Kinds) -> str:
    orders = ("position", "velocity", "acceleration")
    return kinds[orders.index(key.what)] if key.what in orders else key.what


def _told(cursor: Cursor, value: float, kind: str) -> str:
    units = cursor.whole.units._asdict()
    return f"{unit(units[kind]).from_si(value):.9g} {units[kind]}"
