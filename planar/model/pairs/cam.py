"""The cam: it lifts a follower that slides or swings by a law of rises and dwells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar, NamedTuple

from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar
from planar.model.input_laws import CycloidalRise, DwellSegment, HarmonicRise
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import (
    EffortAction,
    EntryReader,
    LengthFormatter,
    MeasureKind,
    Pair,
    PairSample,
    QuantityWriter,
    Schema,
    ToothContact,
    described,
    list_schema,
    sample_shape,
    schema_reference,
)
from planar.model.pairs.cam_follower import (
    CamContact,
    FollowerAxes,
    FollowerFace,
    find_contact,
    rest_position,
    rest_problem,
)
from planar.model.pairs.guide_line import LINE_NUMBER_KINDS, LINE_SCHEMA, LinkLine
from planar.model.pairs.lift_law import LIFT_SCHEMA, LiftLaw, read_lift, write_lift
from planar.model.pairs.symbols import CamMark, DrawingMark

DRAWN_POINTS = 361
"""Of a profile, in drawings."""
SIDES = ("left", "right")
SHAPE_KEYS = ("centre", "base_radius", "roller_radius", "flat", "pivot", "side", "grooved")


class CamShape(NamedTuple):
    """What makes a profile of a law: the cam's `centre` (a point of cam and carrier), its base circle (m), and the
    follower's face: a roller's radius (m; 0: a point), or, where it is flat, the angle of its normal away from the cam
    (rad): to the line of a sliding follower, to the x-axis of a swinging one.

    A swinging follower turns about `pivot`, a point of it and of the carrier, and lies to the left or right (`side`)
    of the way from there to the cam's centre. A `grooved` cam, as a pair of conjugate ones, holds it both ways.
    """

    centre: str
    base_radius: float
    roller_radius: float = 0.0
    flat: float | None = None
    pivot: str | None = None
    side: str = "left"
    grooved: bool = False


@dataclass(frozen=True)
class CamPair(Pair):
    """The second link lifted by the first as the law says of the angle between the first and their carrier.

    Along `line` of the carrier `point` of the follower slides; without a line the follower swings. The law begins
    where the cam stands at `start` (rad) against the carrier, and is worked off as the cam turns anticlockwise, or
    clockwise. The lift zero is where the follower rests on the base circle of `shape`; without a shape, where its
    displacement, or angle against the carrier, is `rest` (m or rad): then what the links do to each other is a law
    alone, and no profile is known.
    """

    carrier: str
    law: LiftLaw
    line: LinkLine | None = None
    point: str | None = None
    start: float = 0.0
    clockwise: bool = False
    rest: float = 0.0
    shape: CamShape | None = None

    keyword: ClassVar[str] = "cam"
    entry_description: ClassVar[str] = "a cam with its follower: its name"
    entry_schemas: ClassVar[Mapping[str, Schema]] = {
        "links": described(list_schema("name", 2, 2) | {"uniqueItems": True}, "the cam, then its follower"),
        "carrier": described(
            schema_reference("name"), "the link on which cam and follower are guided; left out: the frame"
        ),
        "law": described(LIFT_SCHEMA, "the lift over a turn of the cam: rises, falls (negative) and dwells"),
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
            "the follower's displacement, or angle against the carrier, without lift, where no base_radius says it",
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
    }
    required_keys: ClassVar[tuple[str, ...]] = ("links", "law")
    entry_rule: ClassVar[Schema] = {
        "dependentRequired": {
            "line": ["point"],
            "base_radius": ["centre", "point"],
            **{key: ["base_radius"] for key in SHAPE_KEYS if key != "base_radius"},
        },
        "not": {"required": ["roller_radius", "flat"]},
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
    def lift_kind(self) -> MeasureKind:
        """Whether the lift is a length, or an angle."""
        return MeasureKind.ANGLE if self.line is None else MeasureKind.LENGTH

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

    @property
    def sense(self) -> float:
        """1 where the law is worked off as the cam turns anticlockwise, else -1."""
        return -1.0 if self.clockwise else 1.0

    def measure(self, shapes: Sequence[LinkShape]) -> Sequence[Scalar]:
        _, follower, carrier = shapes
        line: tuple[Scalar, ...] = ()
        if self.line is not None and self.point is not None:
            line = (*self.line.measure_line(carrier), *follower.position(self.point))
        return (*line, self.rest_position(shapes), self.start, *self.law.measure())

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        cam, follower, carrier = frames
        if self.line is None:
            rest, start, *law = numbers
            lift = self.law.lift((cam.angle - carrier.angle - start) * self.sense, law)
            return (follower.angle - carrier.angle - rest - lift * self.side,)
        x, y, along, across, px, py, rest, start, *law = numbers
        way = carrier.rotate_to_world(Vector(along, across))
        went = (follower.to_world(Vector(px, py)) - carrier.to_world(Vector(x, y))).dot(way)
        return (went - rest - self.law.lift((cam.angle - carrier.angle - start) * self.sense, law),)

    @property
    def side(self) -> float:
        """1 where lifting turns a swinging follower anticlockwise, else -1."""
        return -1.0 if self.shape is not None and self.shape.side == "right" else 1.0

    def input_position(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The angle of the cam against the carrier."""
        return frames[0].angle - frames[2].angle

    def effort_action(self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape]) -> EffortAction:
        return EffortAction(self.links[0], self.carrier)

    def results(self, position: Scalar, rate: Scalar, second: Scalar) -> dict[str, Scalar | None]:
        return dict(zip(self.result_kinds, (position, rate, second), strict=True))

    def follower_axes(self, shapes: Sequence[LinkShape]) -> FollowerAxes:
        """How the follower is guided, seen from the carrier; only where there is a shape."""
        assert self.shape is not None
        assert self.point is not None
        _, follower, carrier = shapes
        centre, none = carrier.position(self.shape.centre), Vector(0.0, 0.0)
        if self.line is not None:
            x, y, *way = self.line.measure_line(carrier)
            return FollowerAxes(centre, Vector(x, y), Vector(*way), none, 1.0)
        assert self.shape.pivot is not None
        arm = follower.position(self.point) - follower.position(self.shape.pivot)
        return FollowerAxes(centre, carrier.position(self.shape.pivot), None, arm, self.side)

    def follower_face(self, shapes: Sequence[LinkShape]) -> FollowerFace:
        """What touches the cam; only where there is a shape."""
        assert self.shape is not None
        if self.shape.flat is None:
            return FollowerFace(self.shape.roller_radius, None)
        normal = direction(self.shape.flat)
        if self.line is not None:
            normal = Vector(*self.line.measure_line(shapes[2])[2:]).rotate(normal)
        return FollowerFace(0.0, normal)

    def rest_position(self, shapes: Sequence[LinkShape]) -> Scalar:
        """The follower's displacement, or angle against the carrier, without lift (m or rad)."""
        if self.shape is None:
            return self.rest
        return rest_position(self.follower_axes(shapes), self.follower_face(shapes), self.shape.base_radius)

    def contact(self, shapes: Sequence[LinkShape], law_angle: Scalar) -> CamContact | None:
        """Where cam and follower touch at an angle of the law (rad), seen from the carrier; None without a shape."""
        if self.shape is None:
            return None
        rates = self.law.lift_rates(law_angle, self.law.measure())
        axes, face = self.follower_axes(shapes), self.follower_face(shapes)
        return find_contact(axes, face, self.shape.base_radius, rates, self.sense)

    def tooth_contact(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]
    ) -> ToothContact | None:
        """Where the two touch: the cam pushes along the common normal, away from it."""
        if self.shape is None:
            return None
        cam, carrier = frames[self.links[0]], frames[self.carrier]
        touching = self.contact(
            [shapes[body] for body in self.bodies], (cam.angle - carrier.angle - self.start) * self.sense
        )
        assert touching is not None
        centre = shapes[self.carrier].position(self.shape.centre)
        normal = carrier.rotate_to_world(touching.normal)
        return ToothContact(carrier.to_world(touching.point + centre), normal, normal, 0.0)

    def describe_sizes(self, format_length: LengthFormatter) -> str:
        if self.shape is None:
            return "by its law alone"
        face = "a flat face" if self.shape.flat is not None else "a point"
        if self.shape.roller_radius:
            face = f"a roller of radius {format_length(self.shape.roller_radius)}"
        return f"base circle of radius {format_length(self.shape.base_radius)}, {face}"

    def find_misfit(
        self, all_pairs: Sequence[Pair], shapes: Mapping[str, LinkShape], format_length: LengthFormatter
    ) -> str | None:
        if self.shape is None:
            return None
        cam, follower = self.links
        if not _is_pinned(all_pairs, cam, self.carrier, self.shape.centre):
            told = f"a cam with a base circle turns about {self.shape.centre!r} in {self.carrier!r}"
            return f"{told}, but is not pinned there"
        if self.line is None:
            if not _is_pinned(all_pairs, follower, self.carrier, str(self.shape.pivot)):
                return f"the follower swings about {self.shape.pivot!r} in {self.carrier!r}, but is not pinned there"
        elif not any(_slides(pair, follower, self.carrier) for pair in all_pairs):
            return f"the follower is lifted along a line of {self.carrier!r}, but does not slide on that link"
        own = [shapes[body] for body in self.bodies]
        wrong = rest_problem(self.follower_axes(own), self.follower_face(own), self.shape.base_radius)
        return f"the follower cannot rest on the base circle: {wrong}" if wrong else None

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        """The profile, and the follower's face, where there is a shape."""
        if self.shape is None:
            return ()
        own, cam, follower = [shapes[body] for body in self.bodies], *self.links
        at_centre = shapes[cam].position(self.shape.centre)
        profile = []
        for k in range(DRAWN_POINTS):
            angle = 2.0 * pi * k / (DRAWN_POINTS - 1)
            touching = self.contact(own, angle)
            assert touching is not None
            profile.append(at_centre + touching.point.rotate(direction(-(self.start + self.sense * angle))))
        assert self.point is not None
        normal = None if self.shape.flat is None else direction(self.shape.flat)
        middle = shapes[follower].position(self.point)
        return (CamMark(self.name, cam, at_centre, tuple(profile), follower, middle, self.shape.roller_radius, normal),)

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
        shape = _read_shape(entry, links, carrier, slides)
        if shape is not None and entry.has("rest"):
            raise entry.error_at(
                "rest", "where the follower rests follows from 'base_radius'; leave one of the two out"
            )
        if shape is not None and point is None:
            raise entry.error_at(None, "a profile needs the follower's 'point' that touches it")
        law = read_lift(entry, "law", kind)
        start, rest = entry.quantity("start", "angle", 0.0), entry.quantity("rest", kind, 0.0)
        return (cls(name, links, carrier, law, line, point, start, entry.flag("clockwise"), rest, shape),)

    @classmethod
    def write(cls, group: Sequence[CamPair], quantity: QuantityWriter) -> dict[str, Any]:  # type: ignore[override]
        (pair,) = group
        kind = "length" if pair.line is not None else "angle"
        entry: dict[str, Any] = {"cam": pair.name, "links": list(pair.links), "carrier": pair.carrier}
        if pair.line is not None:
            entry["line"] = pair.line.write(quantity)
        if pair.point is not None:
            entry["point"] = pair.point
        entry["law"] = write_lift(pair.law, kind, quantity)
        if pair.start != 0.0:
            entry["start"] = quantity(pair.start, "angle")
        if pair.clockwise:
            entry["clockwise"] = True
        if pair.shape is None:
            return entry | ({"rest": quantity(pair.rest, kind)} if pair.rest != 0.0 else {})
        return entry | _write_shape(pair.shape, quantity)

    @classmethod
    def samples(cls) -> tuple[PairSample, ...]:
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


def _is_pinned(pairs: Sequence[Pair], link: str, other: str, point: str) -> bool:
    """Whether two links turn about one point that both name so."""
    pins: dict[str, set[tuple[str, str]]] = {}
    for pair in pairs:  # a pin of n links is several pairs
        pins.setdefault(pair.entry_name(), set()).update(pair.coincident_points())
    return any({(link, point), (other, point)} <= pin for pin in pins.values())


def _slides(pair: Pair, follower: str, carrier: str) -> bool:
    """Whether a pair guides one link straight on the other."""
    straight = pair.is_lower_pair and pair.input_kind is MeasureKind.LENGTH
    return straight and {*pair.links} == {follower, carrier}


def _read_shape(entry: EntryReader, links: tuple[str, str], carrier: str, slides: bool) -> CamShape | None:
    given = [key for key in SHAPE_KEYS if entry.has(key)]
    if not given:
        return None
    for key in ("base_radius", "centre"):
        if not entry.has(key):
            raise entry.error_at(None, f"a profile has a 'base_radius' and a 'centre'; here {key!r} is missing")
    if entry.has("roller_radius") and entry.has("flat"):
        raise entry.error_at("flat", "a follower has a roller or a flat face, not both")
    for key in ("pivot", "side") if slides else ():
        if entry.has(key):
            raise entry.error_at(key, f"a follower that slides along a 'line' has no {key!r}")
    if not slides and not entry.has("pivot"):
        raise entry.error_at(None, "a follower slides along a 'line' or swings about a 'pivot'; name one of them")
    centre = entry.point("centre", links[0])
    entry.check_point_on_link(centre, carrier, "centre")
    pivot = None
    if not slides:
        pivot = entry.point("pivot", links[1])
        entry.check_point_on_link(pivot, carrier, "pivot")
    sizes = [entry.quantity(key, "length", 0.0) for key in ("base_radius", "roller_radius")]
    for key, size in zip(("base_radius", "roller_radius"), sizes, strict=True):
        if entry.has(key) and not size > 0.0:
            raise entry.error_at(key, "a radius above zero is wanted here")
    flat = entry.quantity("flat", "angle") if entry.has("flat") else None
    return CamShape(centre, *sizes, flat, pivot, entry.choice("side", SIDES) or "left", entry.flag("grooved"))


def _write_shape(shape: CamShape, quantity: QuantityWriter) -> dict[str, Any]:
    entry: dict[str, Any] = {"centre": shape.centre, "base_radius": quantity(shape.base_radius, "length")}
    if shape.flat is not None:
        entry["flat"] = quantity(shape.flat, "angle")
    elif shape.roller_radius != 0.0:
        entry["roller_radius"] = quantity(shape.roller_radius, "length")
    if shape.pivot is not None:
        entry |= {"pivot": shape.pivot, "side": shape.side}
    return entry | ({"grooved": True} if shape.grooved else {})
