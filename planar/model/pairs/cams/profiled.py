"""What pairs have in common in which a profile lifts a follower: its shape, where the two touch, how it is drawn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from planar.foundation.argument_types import checked_arguments
from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import LengthFormatter, MeasureKind, Pair, PieceEnds, ToothContact
from planar.model.pairs.cams import (
    CamContact,
    FollowerAxes,
    FollowerFace,
    FollowerRest,
    find_contact,
    rest_position,
    rest_problem,
    turn_left,
)
from planar.model.pairs.cams.contact_material import ContactMaterial, read_contact, write_contact
from planar.model.pairs.cams.lift_law import LiftLaw, LiftPiece
from planar.model.pairs.guide_line import LinkLine
from planar.model.pairs.symbols import CamMark, DrawingMark

if TYPE_CHECKING:
    from planar.model.pairs.cams.arc_lift import ArcLift
    from planar.model.pairs.cams.profile_lift import ProfileLift

DRAWN_POINTS = 361
"""Of a profile, in drawings."""
DRAWN_FACE_RATIO = 1.15
"""How long a flat face is drawn, of how far the contact goes along it."""
SIDES = ("left", "right")
SHAPE_KEYS = ("centre", "base_radius", "roller_radius", "flat", "pivot", "side", "grooved", "contact")


@checked_arguments
class CamShape(NamedTuple):
    """What makes a profile of a law: the cam's `centre` (a point of cam and carrier), its base circle (m; 0 where that
    follows from the points of a profile), and the follower's face: a roller's radius (m; 0: a point), or, where it is
    flat, the angle of its normal away from the cam (rad): to the line of a sliding follower, to the x-axis of a
    swinging one.

    A swinging follower turns about `pivot`, a point of it and of the carrier, and lies to the left or right (`side`)
    of the way from there to the cam's centre. A `grooved` cam, as a pair of conjugate ones, holds it both ways.
    `contact` is what the two are made of.
    """

    centre: str
    base_radius: float
    roller_radius: float = 0.0
    flat: float | None = None
    pivot: str | None = None
    side: str = "left"
    grooved: bool = False
    contact: ContactMaterial | None = None


@dataclass(frozen=True)
class ProfiledPair(Pair):
    """The second link lifted by the first as the law says of the angle between the first and their carrier.

    Along `line` of the carrier `point` of the follower slides; without a line the follower swings. The law begins
    where the cam stands at `start` (rad) against the carrier, and is worked off as the cam turns anticlockwise, or
    clockwise. The lift zero is where the follower rests on the base circle of `shape`; without a shape, where its
    displacement, or angle against the carrier, is `rest` (m or rad): then what the links do to each other is a law
    alone, and no profile is known.
    """

    has_profile: ClassVar[bool] = True

    carrier: str
    law: LiftLaw | ArcLift | ProfileLift
    line: LinkLine | None = None
    point: str | None = None
    start: float = 0.0
    clockwise: bool = False
    rest: float | None = 0.0
    shape: CamShape | None = None

    @property
    def has_given_profile(self) -> bool:
        """Whether circles or points make the profile, and not a law."""
        return not isinstance(self.law, LiftLaw)

    @property
    def profile_by_points(self) -> ProfileLift | None:
        """The profile, where it is given by points."""
        law: Any = self.law
        return law if hasattr(law, "points") else None

    @property
    def base_radius(self) -> Scalar:
        """The base circle's radius (m); only where there is a shape."""
        assert self.shape is not None
        by_points = self.profile_by_points
        return self.shape.base_radius if by_points is None else by_points.least_radius

    @property
    def measures_symbols(self) -> bool:
        return self.profile_by_points is None

    @property
    def lift_kind(self) -> MeasureKind:
        """Whether the lift is a length, or an angle."""
        return MeasureKind.ANGLE if self.line is None else MeasureKind.LENGTH

    @property
    def sense(self) -> float:
        """1 where the law is worked off as the cam turns anticlockwise, else -1."""
        return -1.0 if self.clockwise else 1.0

    @property
    def side(self) -> float:
        """1 where lifting turns a swinging follower anticlockwise, else -1."""
        return -1.0 if self.shape is not None and self.shape.side == "right" else 1.0

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
        return rest_position(*self._follower_rest(shapes))

    def _follower_rest(self, shapes: Sequence[LinkShape]) -> FollowerRest:
        return FollowerRest(self.follower_axes(shapes), self.follower_face(shapes), self.base_radius)

    def law_numbers(self, shapes: Sequence[LinkShape]) -> tuple[Scalar, ...]:
        """The numbers of the law of lift."""
        if isinstance(self.law, LiftLaw):
            return self.law.measure()
        return self.law.measure(self._follower_rest(shapes))

    def lift(self, law_angle: Scalar, numbers: Sequence[Scalar]) -> Scalar:
        """The lift (m or rad) at an angle of the law (rad), from its numbers."""
        return self.law.lift(law_angle, numbers, *self._follower_kind)

    def lift_rates(self, law_angle: Scalar, shapes: Sequence[LinkShape]) -> tuple[Scalar, ...]:
        """The lift and its first three derivatives by the law's angle."""
        return self.law.lift_rates(law_angle, self.law_numbers(shapes), *self._follower_kind)

    @property
    def _follower_kind(self) -> tuple[Any, ...]:
        """Of circles: whether the follower slides, on which side it lies, and whether its face is flat."""
        if isinstance(self.law, LiftLaw) or self.profile_by_points is not None:
            return ()
        none = Vector(0.0, 0.0)
        assert self.shape is not None
        line = None if self.line is None else none
        return FollowerAxes(none, none, line, none, self.side), self.shape.flat is not None

    def lift_pieces(self, shapes: Sequence[LinkShape]) -> list[LiftPiece]:
        """The pieces of lift over a turn of the cam."""
        if isinstance(self.law, LiftLaw):
            return self.law.lift_pieces()
        if self.profile_by_points is not None:
            return self.profile_by_points.lift_pieces(self._follower_rest(shapes))
        circles: Any = self.law
        found: list[LiftPiece] = circles.lift_pieces(self.law_numbers(shapes))
        return found

    def piece_ends(self, shapes: Mapping[str, LinkShape]) -> PieceEnds:
        """Where one piece of the lift ends and the next begins."""
        of_bodies = [shapes[body] for body in self.bodies]
        if self.profile_by_points is not None:
            angles = self.profile_by_points.piece_starts(self._follower_rest(of_bodies))
        else:
            angles = [piece.start for piece in self.lift_pieces(of_bodies)]
        return PieceEnds(self.links[0], self.carrier, tuple(self.start + self.sense * angle for angle in angles))

    def contact(self, shapes: Sequence[LinkShape], law_angle: Scalar) -> CamContact | None:
        """Where cam and follower touch at an angle of the law (rad), seen from the carrier; None without a shape."""
        if self.shape is None:
            return None
        rates = self.lift_rates(law_angle, shapes)
        axes, face = self.follower_axes(shapes), self.follower_face(shapes)
        return find_contact(axes, face, self.base_radius, rates, self.sense)

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
        wrong = rest_problem(self.follower_axes(own), self.follower_face(own), float(self.base_radius))
        if wrong:
            return f"the follower cannot rest on the base circle: {wrong}"
        return self._find_lift_problem(own)

    def remarks(self, shapes: Mapping[str, LinkShape]) -> Iterable[str]:
        """Where the contact jumps along a profile of points."""
        if self.profile_by_points is None:
            return ()
        from planar.model.pairs.cams.profile_lift import jump_remarks  # which few files have

        solved = self.profile_by_points.solved(self._follower_rest([shapes[body] for body in self.bodies]))
        return jump_remarks(self.name, solved.jumps)

    def _find_lift_problem(self, shapes: Sequence[LinkShape]) -> str | None:
        """Why the follower cannot go round a cam of circles; None where it can, and where the lift is a law."""
        if isinstance(self.law, LiftLaw):
            return None
        if self.profile_by_points is not None:
            return self.profile_by_points.find_problem(self._follower_rest(shapes)) or None
        from planar.model.pairs.cams.arc_lift import find_lift_problem  # which few files have

        pieces = self.lift_pieces(shapes)
        wrong = find_lift_problem(pieces)
        if wrong:
            return wrong
        at = [angle for piece in pieces for angle in (piece.start + 1e-9, piece.stop - 1e-9)]
        ends = [self.lift_rates(angle, shapes)[0] for angle in at]
        apart = [abs(after - before) for before, after in zip(ends[1::2], [*ends[2::2], ends[0]], strict=True)]
        if not max(apart) < 1e-6 * (max(map(abs, ends)) or 1.0):
            return "the follower cannot go round the cam without losing it"
        return None

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        """The profile, and the follower's face, where there is a shape."""
        if self.shape is None:
            return ()
        assert self.point is not None
        own, (cam, follower) = [shapes[body] for body in self.bodies], self.links
        at_centre, middle = shapes[cam].position(self.shape.centre), shapes[follower].position(self.point)
        along_face = self._along_face(shapes, all_pairs)
        angles = np.linspace(0.0, 2.0 * pi, DRAWN_POINTS)
        touching = self.contact(own, angles)
        assert touching is not None
        outline = touching.point.rotate(direction(-(self.start + self.sense * angles)))
        if self.profile_by_points is not None:
            outline = Vector(*self.profile_by_points.outline(DRAWN_POINTS).T)
        profile = _vectors(at_centre + outline)
        face: list[Vector] = []
        if along_face is not None:
            reach = turn_left(touching.normal).dot(touching.point - touching.middle)
            face = [middle, *_vectors(middle + along_face * (DRAWN_FACE_RATIO * reach))]
        radius = self.shape.roller_radius
        return (CamMark(self.name, cam, at_centre, tuple(profile), follower, middle, radius, tuple(face)),)

    def _along_face(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> Vector | None:
        """The direction of a flat face, to the left of its normal, in the follower's axes; None where it is not."""
        assert self.shape is not None
        if self.shape.flat is None:
            return None
        along = turn_left(direction(self.shape.flat))
        if self.line is None:
            return along
        line = Vector(*self.line.measure_line(shapes[self.carrier])[2:])
        return along.rotate(line).rotate(direction(-1.0 * self._follower_turn(shapes, all_pairs)))

    def _follower_turn(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> Scalar:
        """The fixed angle of a sliding follower against the carrier (rad), as the pair that guides it has it."""
        guide = next(pair for pair in all_pairs if _slides(pair, self.links[1], self.carrier))
        still = frame_at(0.0, 0.0, 0.0)
        numbers = guide.measure([shapes[body] for body in guide.bodies])
        open_by = guide.residual([still] * len(guide.bodies), numbers, [0.0] * len(guide.coordinate_kinds))
        turned = -1.0 * open_by[guide.residual_kinds.index(MeasureKind.ANGLE)]
        return turned if guide.links[0] == self.carrier else -1.0 * turned


def _vectors(rows: Vector) -> list[Vector]:
    """The vectors of arrays of parts, of numbers or of symbols."""
    if isinstance(rows.x, np.ndarray):
        return [Vector(x, y) for x, y in zip(rows.x.tolist(), rows.y.tolist(), strict=True)]
    return [Vector(rows.x[row], rows.y[row]) for row in range(rows.x.shape[0])]


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


def read_shape(entry: EntryReader, links: tuple[str, str], carrier: str, slides: bool) -> CamShape | None:
    given = [key for key in SHAPE_KEYS if entry.has(key)]
    if not given:
        return None
    for key in ("centre",) if entry.has("profile") else ("base_radius", "centre"):
        if not entry.has(key):
            raise entry.error_at(None, f"a profile has a 'base_radius' and a 'centre'; here {key!r} is missing")
    if entry.has("profile") and entry.has("base_radius"):
        raise entry.error_at("base_radius", "the base circle follows from the points of the profile; leave it out")
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
    base, roller = (entry.quantity(key, "length", 0.0) for key in ("base_radius", "roller_radius"))
    for key, size in (("base_radius", base), ("roller_radius", roller)):
        if entry.has(key) and not size > 0.0:
            raise entry.error_at(key, "a radius above zero is wanted here")
    flat = entry.quantity("flat", "angle") if entry.has("flat") else None
    side = entry.choice("side", SIDES) or "left"
    contact = read_contact(entry, "contact") if entry.has("contact") else None
    if contact is not None and flat is None and not roller:
        raise entry.error_at("contact", "a point has no contact stress; give the follower a roller or a flat face")
    return CamShape(centre, base, roller, flat, pivot, side, entry.flag("grooved"), contact)


def write_shape(shape: CamShape, quantity: QuantityWriter) -> dict[str, Any]:
    entry: dict[str, Any] = {"centre": shape.centre}
    if shape.base_radius != 0.0:
        entry["base_radius"] = quantity(shape.base_radius, "length")
    if shape.flat is not None:
        entry["flat"] = quantity(shape.flat, "angle")
    elif shape.roller_radius != 0.0:
        entry["roller_radius"] = quantity(shape.roller_radius, "length")
    if shape.pivot is not None:
        entry |= {"pivot": shape.pivot, "side": shape.side}
    if shape.contact is not None:
        entry["contact"] = write_contact(shape.contact, quantity)
    return entry | ({"grooved": True} if shape.grooved else {})
