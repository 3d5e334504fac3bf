"""The lift that a cam gives its follower over a turn: rises, falls and dwells, one after the other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple

from planar.foundation.argument_types import check_field_types
from planar.foundation.jets import Jet, Scalar, constant_jet, part_of_piece, value_between, within_turn
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.pairs.base import MeasureKind, Schema, described, list_schema, schema_reference

if TYPE_CHECKING:
    from planar.model.input_laws import LawSegment

CLOSED_TOLERANCE = 1e-9
"""Of a turn, and of the greatest rise: what rounding leaves of them where a law closes."""
MAX_NOSES = 20
"""Circles of a cam beside its base circle."""
MAX_LIFT_PIECES = 100
"""Each is a part of every formula."""
MIN_PROFILE_POINTS, MAX_PROFILE_POINTS = 6, 720
"""Of a profile: with fewer it is no curve, and half a degree is fine enough."""
LEFT_OUT_KEYS = frozenset({"speed"})
"""Of motions in time: a lift goes by its way."""


def lift_motions() -> dict[str, type[LawSegment]]:
    """The motions of which a lift is made, by their names in files; what takes time there takes an angle here."""
    from planar.model.input_laws import SEGMENT_TYPES  # which few files have

    return {motion: kind for motion, kind in SEGMENT_TYPES.items() if kind.is_lift}


def rise_motions() -> tuple[str, ...]:
    """Those that lead from rest to rest, of which a lift and an angle say all."""
    from planar.model.input_laws.cam_rises import CamRise  # which few files have

    return tuple(motion for motion, kind in lift_motions().items() if issubclass(kind, CamRise))


def lift_schema() -> Schema:
    """What JSON Schema says of a piece of lift."""
    return {"oneOf": [_piece_schema(motion, kind) for motion, kind in lift_motions().items()]}


def _piece_schema(motion: str, kind: type[LawSegment]) -> Schema:
    properties: Schema = {"motion": described({"const": motion}, kind.description.replace("the input", "the follower"))}
    words = {
        "in": ("angle", "the angle by which the cam turns meanwhile"),
        "by": ("quantity", "how far it lifts the follower, a length or an angle; negative: lets it back"),
    }
    for name in _piece_keys(kind):
        what, text = words.get(name, ("number", kind.keys[name].description))
        properties[name] = described(schema_reference(what), text.replace("the time", "the angle"))
    required = [name for name in properties if name != "ramp"]
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


def _piece_keys(kind: type[LawSegment]) -> list[str]:
    return [name for name in kind.keys if name not in LEFT_OUT_KEYS]


LIFT_SCHEMA: Schema = {
    "type": "array",
    "items": schema_reference("lift"),
    "minItems": 1,
    "maxItems": MAX_LIFT_PIECES,
}
"""What JSON Schema says of a lift."""
NOSES_SCHEMA: Schema = {
    "type": "array",
    "items": schema_reference("nose"),
    "minItems": 1,
    "maxItems": MAX_NOSES,
}
"""What JSON Schema says of the circles of a cam."""
PROFILE_SCHEMA: Schema = {
    "type": "array",
    "items": list_schema("length", 2, 2),
    "minItems": MIN_PROFILE_POINTS,
    "maxItems": MAX_PROFILE_POINTS,
}
"""What JSON Schema says of the points of a profile."""


class LiftPiece(NamedTuple):
    """A piece of lift: its name, from where to where the law's angle goes (rad), and whether the follower moves."""

    name: str
    start: float
    stop: float
    moves: bool


@dataclass(frozen=True)
class LiftLaw:
    """Pieces of lift over a turn of the cam, whose durations are angles (rad); the lift starts, and ends, at zero."""

    pieces: tuple[LawSegment, ...]

    def __post_init__(self) -> None:
        check_field_types(self)

    def ways(self) -> tuple[Scalar, ...]:
        """By how much each piece lifts (m or rad)."""
        return tuple(getattr(piece, "by", 0.0) for piece in self.pieces)

    @cached_property
    def joint_angles(self) -> tuple[float, ...]:
        """Where each piece starts, from 0 (rad)."""
        return tuple(self._sums([piece.duration for piece in self.pieces]))

    def lift_pieces(self) -> list[LiftPiece]:
        """The pieces over a turn, in plain numbers."""
        ends = [*self.joint_angles, 2.0 * pi]
        rows = zip(self.pieces, self.ways(), pairwise(ends), strict=True)
        return [LiftPiece(piece.motion, start, stop, way != 0.0) for piece, way, (start, stop) in rows]

    @staticmethod
    def _sums(values: Sequence[Scalar]) -> Iterator[Scalar]:
        total: Scalar = 0.0
        for value in values:
            yield total
            total = total + value

    def measure(self) -> tuple[Scalar, ...]:
        """The numbers of `lift`: of every piece where it starts (rad), the inverse of the angle that it takes, the
        lift before it, how far it lifts, and what else it is made of."""
        ways = self.ways()
        durations = [piece.duration for piece in self.pieces]
        rows = zip(self.pieces, self._sums(durations), durations, self._sums(ways), ways, strict=True)
        return tuple(
            number
            for piece, start, duration, before, way in rows
            for number in (start, 1.0 / duration, before, way, *(getattr(piece, field) for field in _fields(piece)))
        )

    def number_kinds(self, lift: MeasureKind) -> tuple[MeasureKind, ...]:
        """What each of the numbers is, for a lift that is a length, or an angle (which scales as a plain number)."""
        of = lift if lift is MeasureKind.LENGTH else MeasureKind.PURE
        pure = MeasureKind.PURE
        return tuple(kind for piece in self.pieces for kind in (pure, pure, of, of, *(pure,) * len(_fields(piece))))

    def lift(self, angle: Scalar, numbers: Sequence[Scalar]) -> Scalar:
        """The lift (m or rad) at an angle of the cam, in any arithmetic."""
        at = within_turn(angle)
        rest = iter(numbers)
        rows = [(piece, *(next(rest) for _ in range(4)), [next(rest) for _ in _fields(piece)]) for piece in self.pieces]
        starts = [*(row[1] for row in rows[1:]), None]
        total: Scalar = 0.0
        for k, ((piece, start, inverse, before, way, own), end) in enumerate(zip(rows, starts, strict=True)):
            value = before
            if hasattr(piece, "by"):
                part = part_of_piece((at - start) * inverse)
                value = _fraction(piece, own, part) * way + before
            total = value_between(at, start if k else None, end, value) + total
        return total

    def lift_rates(self, angle: Scalar, numbers: Sequence[Scalar]) -> tuple[Scalar, ...]:
        """The lift and its first three derivatives by the cam's angle."""
        lift = self.lift(Jet(angle, 1.0, 0.0, 0.0), [constant_jet(number, 4) for number in numbers])
        return lift.parts if isinstance(lift, Jet) else (lift, 0.0, 0.0, 0.0)

    def find_problem(self) -> tuple[str, str] | None:
        """The place within the law that cannot be meant, such as "[1].in", and why."""
        if not 1 <= len(self.pieces) <= MAX_LIFT_PIECES:
            return "", f"a lift has from 1 to {MAX_LIFT_PIECES} pieces, not {len(self.pieces)}"
        return self._find_piece_problem() or self._find_closing_problem()

    def _find_piece_problem(self) -> tuple[str, str] | None:
        for k, piece in enumerate(self.pieces):
            if not piece.duration > 0.0:
                return f"[{k}].in", "an angle above zero is wanted here"
            wrong = piece.find_problem()
            if wrong is not None:
                return f"[{k}].{wrong[0]}", wrong[1]
        return None

    def _find_closing_problem(self) -> tuple[str, str] | None:
        whole = sum(piece.duration for piece in self.pieces)
        if not abs(whole - 2.0 * pi) <= CLOSED_TOLERANCE * 2.0 * pi:
            return "", f"the pieces take a whole turn of the cam together, 360 deg, not {whole * 180.0 / pi:.9g} deg"
        left = sum(self.ways())
        if not abs(left) <= CLOSED_TOLERANCE * max(map(abs, self.ways())):
            return "", f"the lift comes back to where it starts, but these rises add up to {left:.6g} (m or rad)"
        if min(self._sums(self.ways())) < 0.0:
            return "", "the lift counts from its least, but these pieces lead below where they start"
        return None


def _fields(piece: LawSegment) -> tuple[str, ...]:
    """The fields of a piece beside its way and its angle."""
    return ("ramp",) if "ramp" in piece.keys else ()


def _fraction(piece: LawSegment, own: Sequence[Scalar], x: Scalar) -> Scalar:
    """The part of its way that a piece has gone after the part x of its angle."""
    if not hasattr(piece, "fraction"):  # constant speed
        return x
    changed: Mapping[str, Any] = dict(zip(_fields(piece), own, strict=True))
    changed_piece: Any = replace(piece, **changed) if changed else piece  # type: ignore[type-var]
    return changed_piece.fraction(x)


def read_lift(entry: EntryReader, key: str, kind: str) -> LiftLaw:
    """The lift under a key of an entry, lengths or angles as `kind` says."""
    places = entry.list_items(key)
    if len(places) > MAX_LIFT_PIECES:
        raise entry.error_at(key, f"a lift has at most {MAX_LIFT_PIECES} pieces")
    law = LiftLaw(tuple(_read_piece(place, kind) for place in places))
    wrong = law.find_problem()
    if wrong is not None:
        raise entry.error_at(f"{key}{wrong[0]}", wrong[1])
    return law


def _read_piece(place: EntryReader, kind: str) -> LawSegment:
    known = lift_motions()
    motion = place.choice("motion", tuple(known))
    if motion is None:
        raise place.error_at(None, f"the key 'motion' is missing; there are {', '.join(known)}")
    found = known[motion]
    place.check_keys("motion", *_piece_keys(found))
    values: dict[str, float] = {"duration": place.quantity("in", "angle")}
    if "by" in found.keys:  # keys of a file, by the class
        values["by"] = place.quantity("by", kind)
    if place.has("ramp"):
        values["ramp"] = place.number("ramp")
    made: LawSegment = found(**values)
    return made


def write_lift(law: LiftLaw, kind: str, quantity: QuantityWriter) -> list[dict[str, Any]]:
    """The lift as a file has it."""
    found = []
    for piece in law.pieces:
        entry: dict[str, Any] = {"motion": piece.motion}
        for name in _piece_keys(type(piece)):
            of = {"in": "angle", "by": kind}.get(name, "number")
            entry[name] = quantity(getattr(piece, piece.keys[name].field), of)
        found.append(entry)
    return found
