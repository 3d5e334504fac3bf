"""The lift of a cam of circles, joined by straight tangents or by arcs, in closed form.

On each arc the follower rests as it does on a base circle that goes round with the cam. Of textbooks: the tangent cam,
the circular-arc cam (R. S. Khurmi, J. K. Gupta, Theory of Machines, ch. Cams).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, NamedTuple

from planar.foundation.angles import wrap_angle
from planar.foundation.argument_types import checked_arguments
from planar.foundation.geometry import Vector, direction
from planar.foundation.jets import Jet, Scalar, TermSizes, atan2, constant_jet, hypot, sqrt, value_between, within_turn
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.pairs.base import MeasureKind, Schema, described, list_schema, schema_reference
from planar.model.pairs.cams import (
    FollowerAxes,
    FollowerFace,
    FollowerRest,
    arc_opening,
    rest_position,
)
from planar.model.pairs.cams.lift_law import MAX_NOSES, LiftPiece

AXES_KINDS = (*(MeasureKind.LENGTH,) * 4, MeasureKind.PURE, MeasureKind.PURE, *(MeasureKind.LENGTH,) * 3)
"""Of the numbers of a follower: its centre, origin, line, arm, the roller's radius; then the face's normal."""
STEEPEST = 4.0
"""By how much, about, the terms of a lift grow with the cam's angle, beside the sizes of the cam."""


@checked_arguments
class CamCircle(NamedTuple):
    """A circle of a cam: its centre in the cam's axes from the cam's centre, and its radius (m)."""

    x: float
    y: float
    radius: float


class _Edge(NamedTuple):
    """Where an arc of a circle ends: a unit normal out of the cam."""

    centre: Vector
    radius: Scalar
    normal: Vector


class _Flank(NamedTuple):
    """What joins a circle to the next, anticlockwise: both normals, and an arc's centre and radius, if it is one."""

    start: Vector
    stop: Vector
    centre: Vector | None
    radius: Scalar


@dataclass(frozen=True)
class ArcLift:
    """The base circle and `noses`, anticlockwise, joined by tangents, or by arcs of `flank_radius` (m), all convex."""

    noses: tuple[CamCircle, ...]
    flank_radius: float | None = None

    def number_kinds(self, lift: MeasureKind) -> tuple[MeasureKind, ...]:
        """What each of the numbers of `lift` is."""
        length, pure = MeasureKind.LENGTH, MeasureKind.PURE
        rest = length if lift is MeasureKind.LENGTH else pure
        flank = (pure, pure, pure, length) if self.flank_radius is None else (pure, length, length, length)
        circle = (pure, length, length, length)
        return (*AXES_KINDS, pure, pure, rest, pure, *(*circle, *flank) * (len(self.noses) + 1))

    def measure(self, rest: FollowerRest | None) -> tuple[Scalar, ...]:
        """The numbers of `lift`: the follower, how it rests, where the law's angle first meets the base circle, and of
        every piece where it starts from there, and its circle, or its line."""
        assert rest is not None
        axes, face, base = rest
        circles = [CamCircle(0.0, 0.0, base), *self.noses]
        flanks = [self._flank(one, other) for one, other in zip(circles, [*circles[1:], circles[0]], strict=True)]
        centres = [Vector(each.x, each.y) for each in circles]
        edges: list[_Edge] = []
        pieces: list[tuple[Scalar, ...]] = []
        for k in (0, *range(len(circles) - 1, 0, -1)):  # as the cam turns anticlockwise, the contact goes back
            centre, radius, before = centres[k], circles[k].radius, flanks[k - 1]
            edges += _Edge(centre, radius, flanks[k].start), _Edge(centre, radius, before.stop)
            pieces.append((*centre, radius))
            line = (*before.stop, centre.dot(before.stop) + radius)
            pieces.append(line if before.centre is None else (*before.centre, before.radius))
        angles = [_edge_angle(axes, face, edge) for edge in edges]
        starts = [within_turn(angle - angles[0]) if k else 0.0 for k, angle in enumerate(angles)]
        line = axes.line if axes.line is not None else Vector(0.0, 0.0)
        normal = face.normal if face.normal is not None else Vector(0.0, 0.0)
        # the arm of what slides is none: its place is that of the carrier's line
        own = (*axes.centre, *axes.origin, *line, *axes.arm, face.roller_radius, *normal)
        numbers = [number for start, piece in zip(starts, pieces, strict=True) for number in (start, *piece)]
        return (*own, rest_position(axes, face, base), angles[0], *numbers)

    def lift(self, angle: Scalar, numbers: Sequence[Scalar], kinds: FollowerAxes, is_flat: bool) -> Scalar:
        """The lift (m or rad) at an angle of the cam; `kinds` says whether the follower slides, and its side."""
        cx, cy, ox, oy, lx, ly, ax, ay, roller, nx, ny, rest, first, *pieces = numbers
        if isinstance(angle, TermSizes):
            return _sizes_of_lift(angle, numbers)
        line = None if kinds.line is None else Vector(lx, ly)
        axes = FollowerAxes(Vector(cx, cy), Vector(ox, oy), line, Vector(ax, ay), kinds.side)
        face = FollowerFace(roller, Vector(nx, ny) if is_flat else None)
        at = within_turn(angle - first)
        starts = pieces[::4]
        total: Scalar = 0.0
        for k, start in enumerate(starts):
            low, high = start if k else None, starts[k + 1] if k + 1 < len(starts) else None
            held = _clamp(at, start if k else 0.0, high if high is not None else 2.0 * pi) + first
            parts = pieces[4 * k + 1 : 4 * k + 4]
            if k % 2 and self.flank_radius is None:
                position = _position_on_line(axes, face, Vector(*parts[:2]).rotate(direction(held)), parts[2])
            else:
                centre = axes.centre + Vector(*parts[:2]).rotate(direction(held))
                position = rest_position(axes._replace(centre=centre), face, parts[2])
            went = position - rest
            total = value_between(at, low, high, went if line is not None else wrap_angle(went) * kinds.side) + total
        return total

    def lift_rates(
        self, angle: Scalar, numbers: Sequence[Scalar], kinds: FollowerAxes, is_flat: bool
    ) -> tuple[Scalar, ...]:
        """The lift and its first three derivatives by the cam's angle."""
        lift: Jet = self.lift(
            Jet(angle, 1.0, 0.0, 0.0), [constant_jet(number, 4) for number in numbers], kinds, is_flat
        )
        return lift.parts

    def lift_pieces(self, numbers: Sequence[Scalar]) -> list[LiftPiece]:
        """The pieces over a turn, from where the follower comes onto the base circle, in plain numbers."""
        first, starts = float(numbers[12]), [float(start) for start in numbers[13::4]]
        flank = "tangent" if self.flank_radius is None else "flank"
        names = [flank if k % 2 else "nose" if k else "base circle" for k in range(len(starts))]
        ends = [*starts[1:], 2.0 * pi]
        return [
            LiftPiece(name, first + start, first + end, name != "base circle")
            for name, start, end in zip(names, starts, ends, strict=True)
        ]

    def _flank(self, one: CamCircle, other: CamCircle) -> _Flank:
        a, b = Vector(one.x, one.y), Vector(other.x, other.y)
        apart = b - a
        distance = hypot(apart.x, apart.y)
        along = apart * (1.0 / distance)
        left = Vector(-along.y, along.x)
        if self.flank_radius is None:
            cosine = (one.radius - other.radius) / distance
            normal = along * cosine - left * sqrt(1.0 - cosine * cosine)
            return _Flank(normal, normal, None, 0.0)
        reach, far = self.flank_radius - one.radius, self.flank_radius - other.radius
        foot = (reach * reach - far * far + distance * distance) * (0.5 / distance)
        centre = a + along * foot + left * sqrt(reach * reach - foot * foot)
        return _Flank((a - centre) * (1.0 / reach), (b - centre) * (1.0 / far), centre, self.flank_radius)

    def find_problem(self, base_radius: float, is_flat: bool) -> tuple[str, str] | None:
        """The key that cannot be meant, and why."""
        if is_flat and self.flank_radius is None:
            return "noses", "a flat face would strike straight tangents; give the flanks a 'flank_radius'"
        circles = [CamCircle(0.0, 0.0, base_radius), *self.noses]
        for k, (one, other) in enumerate(zip(circles, [*circles[1:], circles[0]], strict=True)):
            apart = hypot(float(other.x - one.x), float(other.y - one.y))
            if not apart > abs(one.radius - other.radius):
                return f"noses[{min(k, len(self.noses) - 1)}]", "a circle lies within the one before or after it"
            if self.flank_radius is None:
                continue
            if not self.flank_radius > max(one.radius, other.radius) or not (
                apart < 2.0 * self.flank_radius - one.radius - other.radius
            ):
                return "flank_radius", "flanks of this radius do not reach round the circles that they join"
        return None


def nose_schema() -> Schema:
    """What JSON Schema says of a circle of a cam."""
    return {
        "type": "object",
        "properties": {
            "at": described(
                list_schema("length", 2, 2),
                "its centre in the cam's axes, from the cam's centre",
            ),
            "radius": described(schema_reference("size"), "its radius"),
        },
        "required": ["at", "radius"],
        "additionalProperties": False,
    }


def find_lift_problem(pieces: Sequence[LiftPiece]) -> str:
    """Why pieces of lift are no turn of a cam; empty where they are."""
    if min(piece.stop - piece.start for piece in pieces) < -1e-9 or pieces[-1].stop < pieces[-1].start:
        return "the circles do not follow one another anticlockwise about the cam"
    return ""


def _clamp(x: Scalar, low: Scalar, high: Scalar) -> Scalar:
    """A number, or the end of the range beyond which it is."""
    return (value_between(x, None, low, low + 0.0 * x) + value_between(x, low, high, x)) + value_between(
        x, high, None, high + 0.0 * x
    )


def _edge_angle(axes: FollowerAxes, face: FollowerFace, edge: _Edge) -> Scalar:
    """The angle of the cam at which the follower touches the end of an arc."""
    if face.normal is not None:
        distance = edge.centre.dot(edge.normal) + edge.radius
        normal = face.normal
        if axes.line is None:
            normal = normal.rotate(direction(rest_position(axes, face, distance)))
        return atan2(edge.normal.cross(normal), edge.normal.dot(normal))
    middle = edge.centre + edge.normal * (edge.radius + face.roller_radius)
    far = rest_position(axes, FollowerFace(0.0, None), hypot(middle.x, middle.y))
    if axes.line is not None:
        at = axes.origin + axes.line * far - axes.centre
    else:
        at = axes.origin + axes.arm.rotate(direction(far)) - axes.centre
    return atan2(middle.cross(at), middle.dot(at))


def _position_on_line(axes: FollowerAxes, face: FollowerFace, normal: Vector, distance: Scalar) -> Scalar:
    """The follower's displacement, or angle, where it rests on a line so far from the cam's centre."""
    reach = distance + face.roller_radius - normal.dot(axes.origin - axes.centre)
    if axes.line is not None:
        return reach / normal.dot(axes.line)
    opening = arc_opening(reach / hypot(axes.arm.x, axes.arm.y))
    return atan2(normal.y, normal.x) - opening * axes.side - atan2(axes.arm.y, axes.arm.x)


def _sizes_of_lift(angle: TermSizes, numbers: Sequence[Scalar]) -> TermSizes:
    """What is added up in a lift and its rates, at the most about."""
    size = sum(abs(number) for number in numbers)
    _, first, second = angle.parts
    return TermSizes(size, size * STEEPEST * first, size * STEEPEST * (second + STEEPEST * first * first))


def read_noses(entry: EntryReader) -> ArcLift:
    """The circles of an entry."""
    noses = []
    for place in entry.list_items("noses"):
        place.check_keys("at", "radius")
        x, y = place.quantities("at", "length", 2)
        radius = place.quantity("radius", "length")
        if not radius > 0.0:
            raise place.error_at("radius", "a radius above zero is wanted here")
        noses.append(CamCircle(x, y, radius))
    if not 1 <= len(noses) <= MAX_NOSES:
        raise entry.error_at("noses", f"a cam has from 1 to {MAX_NOSES} noses, not {len(noses)}")
    flank = entry.quantity("flank_radius", "length") if entry.has("flank_radius") else None
    return ArcLift(tuple(noses), flank)


def write_noses(lift: ArcLift, quantity: QuantityWriter) -> dict[str, Any]:
    """The circles as an entry has them."""
    noses = [
        {"at": [quantity(each.x, "length"), quantity(each.y, "length")], "radius": quantity(each.radius, "length")}
        for each in lift.noses
    ]
    flank = {} if lift.flank_radius is None else {"flank_radius": quantity(lift.flank_radius, "length")}
    return {"noses": noses, **flank}
