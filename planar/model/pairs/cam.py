"""The cam: it lifts a follower that slides or swings by a law of rises and dwells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import (
    EffortAction,
    LengthFormatter,
    MeasureKind,
    PairSample,
    Schema,
    described,
    list_schema,
    sample_shape,
    schema_reference,
)
from planar.model.pairs.cams.contact_material import contact_schema
from planar.model.pairs.cams.lift_law import LIFT_SCHEMA, NOSES_SCHEMA, PROFILE_SCHEMA, LiftLaw, read_lift, write_lift
from planar.model.pairs.cams.profiled import SHAPE_KEYS, SIDES, CamShape, ProfiledPair, read_shape, write_shape
from planar.model.pairs.guide_line import LINE_NUMBER_KINDS, LINE_SCHEMA, LinkLine

if TYPE_CHECKING:
    from planar.model.pairs.cams.arc_lift import ArcLift
    from planar.model.pairs.cams.profile_lift import ProfileLift


@dataclass(frozen=True)
class CamPair(ProfiledPair):
    """A cam, as `ProfiledPair` says, by a law of rises, falls and dwells."""

    keyword: ClassVar[str] = "cam"
    entry_description: ClassVar[str] = "a cam with its follower: its name"
    entry_schemas: ClassVar[Mapping[str, Schema]] = {
        "links": described(list_schema("name", 2, 2) | {"uniqueItems": True}, "the cam, then its follower"),
        "carrier": described(
            schema_reference("name"), "the link on which cam and follower are guided; left out: the frame"
        ),
        "law": described(LIFT_SCHEMA, "the lift over a turn of the cam: rises, falls (negative) and dwells"),
        "noses": described(
            NOSES_SCHEMA,
            "in place of a law: circles that tangents join, anticlockwise from the base circle",
        ),
        "flank_radius": described(
            schema_reference("size"), "the radius of arcs that join the circles, in place of straight tangents"
        ),
        "profile": described(
            PROFILE_SCHEMA,
            "in place of a law: points of a smooth closed profile, anticlockwise in the cam's axes from its centre; "
            "the follower goes by its first contact",
        ),
        "line": described(
            LINE_SCHEMA, "of a sliding follower: the line in the carrier along which its point is lifted"
        ),
        "point": described(
            schema_reference("name"),
            "the follower's point that touches the cam, the middle of its roller, or a point of its flat face",
        ),
        "start": described(schema_reference("angle"), "the cam's angle against the carrier where the law begins"),
        "clockwise": described({"type": "boolean"}, "true where the law is worked off as the cam turns clockwise"),
        "rest": described(
            schema_reference("quantity"),
            "in place of base_radius, without a profile: where the follower is without lift, its displacement or angle",
        ),
        "centre": described(schema_reference("name"), "the point of cam and carrier about which the cam turns"),
        "base_radius": described(schema_reference("size"), "the base circle's radius: the profile follows from it"),
        "roller_radius": described(schema_reference("size"), "the roller's radius; left out: a point touches the cam"),
        "flat": described(
            schema_reference("angle"),
            "of a flat face: the angle of its normal, away from the cam, to the line of a sliding follower (0: upright "
            "to it), to the x-axis of a swinging one",
        ),
        "pivot": described(schema_reference("name"), "the point of follower and carrier about which it swings"),
        "side": described(
            {"enum": list(SIDES)}, "where a swinging arm lies, seen from its pivot towards the cam; left out: left"
        ),
        "grooved": described(
            {"type": "boolean"}, "true where the cam holds the follower both ways: a groove, or conjugate cams"
        ),
        "contact": described(
            contact_schema(), "of a roller or a flat face, what the two are made of: for the stress where they touch"
        ),
    }
    required_keys: ClassVar[tuple[str, ...]] = ("links",)
    entry_rule: ClassVar[Schema] = {
        "dependentRequired": {
            "line": ["point"],
            "base_radius": ["centre", "point"],
            "profile": ["centre", "point"],
            "noses": ["base_radius"],
            "flank_radius": ["noses"],
        },
        "not": {"required": ["roller_radius", "flat"]},
        "anyOf": [
            {"required": ["base_radius"]},
            {"required": ["profile"]},
            {"not": {"anyOf": [{"required": [key]} for key in SHAPE_KEYS]}},
        ],
        "oneOf": [
            {"required": ["law"]},
            {"required": ["noses"], "not": {"anyOf": [{"required": ["start"]}, {"required": ["clockwise"]}]}},
            {
                "required": ["profile"],
                "not": {
                    "anyOf": [{"required": [key]} for key in ("start", "clockwise", "base_radius", "flank_radius")]
                },
            },
        ],
    }
    is_lower_pair: ClassVar[bool] = False
    result_kinds: ClassVar[Mapping[str, str]] = {
        "angle": "angle",
        "angular_velocity": "angular velocity",
        "angular_acceleration": "angular acceleration",
    }
    input_kind: ClassVar[MeasureKind] = MeasureKind.ANGLE

    @property
    def bodies(self) -> tuple[str, ...]:
        return (*self.links, self.carrier)

    @property
    def ties_angles(self) -> bool:  # type: ignore[override]
        return self.shape is None

    @property
    def residual_kinds(self) -> tuple[MeasureKind, ...]:  # type: ignore[override]
        return (self.lift_kind,)

    @property
    def number_kinds(self) -> tuple[MeasureKind, ...]:  # type: ignore[override]
        line = () if self.line is None else (*LINE_NUMBER_KINDS, MeasureKind.LENGTH, MeasureKind.LENGTH)
        return (*line, self.lift_kind, MeasureKind.PURE, *self.law.number_kinds(self.lift_kind))

    @classmethod
    def prevented_motion_count(cls) -> int:
        return 1

    def measure(self, shapes: Sequence[LinkShape]) -> Sequence[Scalar]:
        _, follower, carrier = shapes
        line: tuple[Scalar, ...] = ()
        if self.line is not None and self.point is not None:
            line = (*self.line.measure_line(carrier), *follower.position(self.point))
        return (*line, self.rest_position(shapes), self.start, *self.law_numbers(shapes))

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        cam, follower, carrier = frames
        if self.line is None:
            rest, start, *law = numbers
            lift = self.lift((cam.angle - carrier.angle - start) * self.sense, law)
            return (follower.angle - carrier.angle - rest - lift * self.side,)
        x, y, along, across, px, py, rest, start, *law = numbers
        way = carrier.rotate_to_world(Vector(along, across))
        went = (follower.to_world(Vector(px, py)) - carrier.to_world(Vector(x, y))).dot(way)
        return (went - rest - self.lift((cam.angle - carrier.angle - start) * self.sense, law),)

    def input_position(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The angle of the cam against the carrier."""
        return frames[0].angle - frames[2].angle

    def effort_action(self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape]) -> EffortAction:
        return EffortAction(self.links[0], self.carrier)

    def results(self, position: Scalar, rate: Scalar, second: Scalar) -> dict[str, Scalar | None]:
        return dict(zip(self.result_kinds, (position, rate, second), strict=True))

    def describe_sizes(self, format_length: LengthFormatter) -> str:
        if self.shape is None:
            return "by its law alone"
        face = "a flat face" if self.shape.flat is not None else "a point"
        if self.shape.roller_radius:
            face = f"a roller of radius {format_length(self.shape.roller_radius)}"
        return f"base circle of radius {format_length(float(self.base_radius))}, {face}"

    @classmethod
    def read(cls, entry: EntryReader) -> tuple[CamPair, ...]:
        entry.check_keys(cls.keyword, *cls.entry_schemas)
        name, links = entry.name("cam"), entry.two_links("links")
        carrier = entry.link("carrier") if entry.has("carrier") else entry.frame
        if carrier in links:
            raise entry.error_at(
                "carrier" if entry.has("carrier") else None,
                f"{carrier!r} is the cam or its follower; the carrier is a third link",
            )
        slides = entry.has("line")
        line = LinkLine.read(entry, "line", carrier) if slides else None
        point = entry.point("point", links[1]) if entry.has("point") or slides else None
        kind = "length" if slides else "angle"
        shape = read_shape(entry, links, carrier, slides)
        if shape is not None and entry.has("rest"):
            raise entry.error_at(
                "rest", "where the follower rests follows from 'base_radius'; leave one of the two out"
            )
        if shape is not None and point is None:
            raise entry.error_at(None, "a profile needs the follower's 'point' that touches it")
        law = _read_law(entry, kind, shape)
        start = entry.quantity("start", "angle", 0.0)
        rest = None if shape is not None else entry.quantity("rest", kind, 0.0)
        return (cls(name, links, carrier, law, line, point, start, entry.flag("clockwise"), rest, shape),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        (pair,) = group
        kind = "length" if pair.line is not None else "angle"
        entry: dict[str, Any] = {"cam": pair.name, "links": list(pair.links), "carrier": pair.carrier}
        if pair.line is not None:
            entry["line"] = pair.line.write(quantity)
        if pair.point is not None:
            entry["point"] = pair.point
        if isinstance(pair.law, LiftLaw):
            entry["law"] = write_lift(pair.law, kind, quantity)
        elif pair.profile_by_points is not None:
            from planar.model.pairs.cams.profile_lift import write_profile  # which few files have

            entry["profile"] = write_profile(pair.profile_by_points, quantity)
        else:
            from planar.model.pairs.cams.arc_lift import write_noses  # which few files have

            circles: Any = pair.law
            entry |= write_noses(circles, quantity)
        if pair.start != 0.0:
            entry["start"] = quantity(pair.start, "angle")
        if pair.clockwise:
            entry["clockwise"] = True
        if pair.shape is None:
            return entry | ({"rest": quantity(pair.rest, kind)} if pair.rest is not None and pair.rest != 0.0 else {})
        return entry | write_shape(pair.shape, quantity)

    @classmethod
    def samples(cls) -> tuple[PairSample, ...]:
        return (
            *cls._samples_by_law(),
            *(
                cls._sample_of_circles(face, flank)
                for face, flank in (("roller", None), ("roller", 0.9), ("flat", 0.9))
            ),
        )

    @classmethod
    def _sample_of_circles(cls, face: str, flank: float | None) -> PairSample:
        """A swinging follower on two circles, all pinned to the carrier."""
        from planar.model.pairs.cams.arc_lift import ArcLift, CamCircle  # which few files have

        carrier, cam = frame_at(0.3, -0.4, 0.7), frame_at(0.2, 0.5, 2.4)
        flat, roller = (1.7, 0.0) if face == "flat" else (None, 0.07)
        shape = CamShape("O", 0.3, roller, flat, "C")
        pair = cls(
            "K", ("a", "b"), "c", ArcLift((CamCircle(0.1, 0.25, 0.2),), flank), None, "P", rest=None, shape=shape
        )
        shapes = (
            sample_shape(O=Vector(0.0, 0.0)),
            sample_shape(C=Vector(0.1, 0.0), P=Vector(0.9, 0.3)),
            sample_shape(O=Vector(0.0, 0.0), C=Vector(-0.8, 0.1)),
        )
        lift = pair.lift(cam.angle - carrier.angle, pair.law_numbers(shapes))
        follower = frame_at(-0.7, 0.1, carrier.angle + pair.rest_position(shapes) + lift)
        entry: dict[str, Any] = {"cam": "K", "links": ["a", "b"], "carrier": "c", "point": "P", "centre": "O"}
        entry |= {"base_radius": 0.3, "pivot": "C", "noses": [{"at": [0.1, 0.25], "radius": 0.2}]}
        entry |= {"roller_radius": roller} if flat is None else {"flat": flat}
        entry |= {} if flank is None else {"flank_radius": flank}
        pins = {"turning": "O", "links": ["c", "a"]}, {"turning": "C", "links": ["c", "b"]}
        return PairSample(pair, shapes, (cam, follower, carrier), (), entry, pins)

    @classmethod
    def _samples_by_law(cls) -> tuple[PairSample, ...]:
        from planar.model.input_laws import CycloidalRise, DwellSegment, HarmonicRise  # which few files have

        law = LiftLaw((CycloidalRise(2.0, 0.5), DwellSegment(1.0), HarmonicRise(2.0 * pi - 3.0, -0.5)))
        pieces = [
            {"motion": "cycloidal", "by": 0.5, "in": 2.0},
            {"motion": "dwell", "in": 1.0},
            {"motion": "harmonic", "by": -0.5, "in": 2.0 * pi - 3.0},
        ]
        entry = {"cam": "K", "links": ["a", "b"], "carrier": "c", "law": pieces}
        turned, carrier = 0.9, frame_at(0.3, -0.4, 0.7)
        cam = frame_at(0.2, 0.5, carrier.angle + turned)
        numbers, line = law.measure(), LinkLine("T", None, 0.4)
        swung = frame_at(-0.7, 0.1, carrier.angle + 0.3 + law.lift(turned - 0.2, numbers))
        bare = sample_shape(A=Vector(0.0, 0.0))
        through, point = Vector(0.1, 0.2), Vector(-0.3, 0.1)
        way = direction(0.4)
        lifted = carrier.to_world(through + way * (0.25 + law.lift(-turned, numbers)) + Vector(-way.y, way.x) * 0.15)
        slid = frame_at(0.0, 0.0, -0.8)
        at = lifted - slid.rotate_to_world(point)
        return (
            PairSample(
                cls("K", ("a", "b"), "c", law, start=0.2, rest=0.3),
                (bare, bare, bare),
                (cam, swung, carrier),
                (),
                entry | {"start": 0.2, "rest": 0.3},
            ),
            PairSample(
                cls("K", ("a", "b"), "c", law, line, "P", clockwise=True, rest=0.25),
                (bare, sample_shape(P=point), sample_shape(T=through)),
                (cam, frame_at(at.x, at.y, slid.angle), carrier),
                (),
                entry | {"line": {"through": "T", "angle": 0.4}, "point": "P", "clockwise": True, "rest": 0.25},
            ),
        )


def _read_law(entry: EntryReader, kind: str, shape: CamShape | None) -> LiftLaw | ArcLift | ProfileLift:
    """The law of an entry, or the circles or points of its profile."""
    if sum(entry.has(key) for key in ("law", "noses", "profile")) != 1:
        told = "a cam is given by the 'law' of its lift or by the 'noses' of its profile: by one"
        raise entry.error_at(None, f"{told}, or by the points of its 'profile'")
    if entry.has("law"):
        if entry.has("flank_radius"):
            raise entry.error_at("flank_radius", "flanks are between 'noses'; the profile of a 'law' follows from it")
        return read_lift(entry, "law", kind)
    for key in ("start", "clockwise"):
        if entry.has(key):
            given = "circles" if entry.has("noses") else "points"
            raise entry.error_at(key, f"the {given} of a cam stand in its own axes; leave {key!r} out")
    if entry.has("profile"):
        if entry.has("flank_radius"):
            raise entry.error_at(
                "flank_radius", "flanks are between 'noses'; a profile goes smoothly through its points"
            )
        from planar.model.pairs.cams.profile_lift import read_profile  # which few files have

        return read_profile(entry, "profile")
    if shape is None:
        raise entry.error_at(None, "noses are joined with the base circle; here 'base_radius' is missing")
    from planar.model.pairs.cams.arc_lift import read_noses  # which few files have

    found = read_noses(entry)
    wrong = found.find_problem(shape.base_radius, shape.flat is not None)
    if wrong is not None:
        raise entry.error_at(*wrong)
    return found
