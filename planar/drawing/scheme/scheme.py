"""The kinematic scheme of a mechanism in one position, as a textbook draws it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from math import hypot
from typing import NamedTuple

import numpy as np

from planar.drawing.labels.placement import SAME_POINT_TOLERANCE
from planar.drawing.paper.boxes import nearby_points
from planar.drawing.paper.picture import Label, Mark, Pen, Picture, Polyline, paper_point
from planar.drawing.paper.scales import DRAWING_HEIGHT, DRAWING_WIDTH, Scale, round_scale
from planar.drawing.scheme import symbol_table
from planar.drawing.scheme.clearance import Clearance
from planar.drawing.scheme.ground import fixed_marks, fixed_point_strokes, ground_marks
from planar.drawing.scheme.input_arrows import input_arrow_marks
from planar.drawing.scheme.link_bodies import LinkBody, all_marks, link_bodies
from planar.drawing.scheme.link_strokes import body_marks, moving_marks
from planar.drawing.scheme.motors import motor_strokes
from planar.drawing.scheme.placed_strokes import stroke_marks
from planar.drawing.scheme.scene import Scene, TravelRanges, plain_frames
from planar.drawing.scheme.springs_masses import MassCentreMark, SpringMassMark
from planar.drawing.scheme.stops import slide_stop_places
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Scalar
from planar.model.link_graph import link_numbers
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, named_points
from planar.model.pairs.symbols import CamMark, CurvedSlotMark, DrawingMark, OutlineMark, PinMark, SliderMark, WheelMark
from planar.results.motion import State
from planar.solving.position import rest_remarks

__all__ = ["body_marks", "ground_marks", "plain_frames", "point_labels", "scheme", "scheme_scale", "space_scale"]

CROWDED_PIN_DISTANCE = 2.2 * symbol_table.PIN_RADIUS
"""mm between pins within which they lie on each other."""
CROWDED_SHEET_SIZE = (240.0, 150.0)
"""mm of a sheet of A4 on its side that a crowded drawing may take, its letters and symbols left out."""
MIN_FIGURE_SIZE = 60.0
"""mm: a figure that would be smaller may be higher than others."""
MAX_ENLARGEMENT = 200.0
"""How much larger than what fits the paper a drawing may be: no sheet takes more, and hatching it takes for ever."""


def scheme(
    state: State,
    scale: Scale | None = None,
    letters: bool = True,
    numbers: bool = True,
    travel: TravelRanges | None = None,
) -> Picture:
    """The scheme of a solved position, to a round scale that fits the paper unless one is given.

    `letters` names the points, `numbers` the links as textbooks do; `travel` tells how far slides go (m, by pair).
    """
    mechanism, frames = state.mechanism, plain_frames(state.frames)
    fits = space_scale(mechanism, frames, state.shapes)
    if scale is not None and scale.per_mm * MAX_ENLARGEMENT < fits.per_mm:
        raise BadInput("scale", "the drawing would be metres large on paper: choose a smaller one")
    scale = scale or scheme_scale(state)
    scene = Scene(mechanism, link_bodies(mechanism, state.shapes), frames, state.shapes, scale, travel or {})
    spots = stroke_marks(fixed_point_strokes(scene), frames, scale.per_mm)
    strokes: list[Mark] = [*fixed_marks(scene), *moving_marks(scene), *spots]
    clear = Clearance.from_marks(strokes)
    motors = tuple(stroke_marks(motor_strokes(scene, clear), frames, scale.per_mm))
    strokes += motors
    clear = clear.with_marks(motors)
    for given in mechanism.inputs:
        arrow = tuple(input_arrow_marks(scene, given, clear))
        strokes += arrow
        clear = clear.with_marks(arrow)
    if numbers:
        strokes += _link_number_labels(scene, strokes, clear)
    if letters:
        strokes += (*point_labels(scene), *_labels(scene, mass_centre_names(scene), 9.0))
    return Picture(tuple(strokes), mechanism.name, (f"Space diagram, {scale}", *rest_remarks(mechanism)))


def space_scale(
    mechanism: Mechanism,
    frames: Mapping[str, Frame],
    shapes: Mapping[str, LinkShape],
    room: tuple[float, float] = (DRAWING_WIDTH, DRAWING_HEIGHT),
) -> Scale:
    """The round scale at which all points, bodies and wheels of a mechanism in a position fit a room (mm)."""
    points = {link: shape.points for link, shape in shapes.items()}
    marks = list(all_marks(mechanism, shapes))
    places = extent_places(points, link_bodies(mechanism, shapes), marks)
    places += [ExtentPlace(link, at) for link, at in slide_stop_places(mechanism, marks)]
    low, high = extent_corners(places, [frames])
    width, height = high.x - low.x, high.y - low.y
    fits = round_scale("length", mechanism.units.length, width, height, room)
    if fits.on_paper(max(width, height)) >= MIN_FIGURE_SIZE:
        return fits
    return round_scale("length", mechanism.units.length, width, height, (DRAWING_WIDTH, DRAWING_WIDTH))


class ExtentPlace(NamedTuple):
    """A place of a link that has to be seen, with a circle about it (m)."""

    link: str
    at: Vector
    radius: Scalar = 0.0


def extent_places(
    points: Mapping[str, Mapping[str, Vector]],
    bodies: Mapping[str, LinkBody],
    marks: Sequence[DrawingMark | SpringMassMark],
) -> list[ExtentPlace]:
    """What of a mechanism has to be seen: all points, bodies, curved slots, wheels and masses."""
    slots = [mark for mark in marks if isinstance(mark, CurvedSlotMark)]
    unseen = {member for slot in slots for member in slot.centre_points}
    places = [
        ExtentPlace(link, place)
        for link, link_points in points.items()
        for point, place in link_points.items()
        if (link, point) not in unseen
    ]
    places += [ExtentPlace(slot.link, place) for slot in slots for place in slot.places()]
    for link, body in bodies.items():
        corners = [*(end for side in body.sides for end in side), *(guide.foot for guide in body.guides)]
        places += [ExtentPlace(link, corner) for corner in corners]
    for mark in marks:
        if isinstance(mark, WheelMark):
            places.append(ExtentPlace(mark.link, mark.centre, abs(mark.radius)))
        elif isinstance(mark, OutlineMark):
            places += [ExtentPlace(mark.link, at) for at in mark.points]
        elif isinstance(mark, CamMark):
            places += [ExtentPlace(mark.link, at) for at in mark.profile]
            places += [ExtentPlace(mark.follower_link, at) for at in (mark.middle, *mark.face)]
        elif isinstance(mark, MassCentreMark):
            places.append(ExtentPlace(mark.link, mark.at))
    return places


def extent_corners(places: Sequence[ExtentPlace], positions: Iterable[Mapping[str, Frame]]) -> tuple[Vector, Vector]:
    """The lower left and the upper right corner (m) of places in some positions of the links."""
    if not places:
        return Vector(0.0, 0.0), Vector(0.0, 0.0)
    spots: dict[str, list[tuple[float, float, float]]] = {}
    for link, at, radius in places:
        spots.setdefault(link, []).append((*paper_point(at), float(radius)))
    groups = {link: np.array(own).T for link, own in spots.items()}
    corners = []
    for frames in positions:
        for link, (x, y, r) in groups.items():
            at = frames[link].to_world(Vector(x, y))
            corners.append([f(each + sign * r) for f, sign in ((np.min, -1), (np.max, 1)) for each in at])
    every = np.array(corners)
    low, high = every[:, :2].min(axis=0), every[:, 2:].max(axis=0)
    return Vector(float(low[0]), float(low[1])), Vector(float(high[0]), float(high[1]))


def scheme_scale(state: State) -> Scale:
    """The round scale that fits the paper, or where pins would lie on each other the one that fits a whole sheet."""
    mechanism, frames, shapes = state.mechanism, plain_frames(state.frames), state.shapes
    fits = space_scale(mechanism, frames, shapes)
    pins = {mark.name for mark in all_marks(mechanism, shapes) if isinstance(mark, PinMark)}
    named = [each.members[0] for each in named_points(mechanism) if each.name in pins]
    places = [frames[link].to_world(shapes[link].position(point)) for link, point in named]
    on_paper = np.array([(place.x, place.y) for place in places]).reshape(-1, 2) / fits.per_mm
    one, other = nearby_points(on_paper, CROWDED_PIN_DISTANCE / 2.0).T
    if not (np.hypot(*(on_paper[one] - on_paper[other]).T) > SAME_POINT_TOLERANCE).any():
        return fits
    return space_scale(mechanism, frames, shapes, CROWDED_SHEET_SIZE)


class NamedPlace(NamedTuple):
    """A letter at a place of a link, and how far it keeps off there (mm)."""

    text: str
    about: str
    link: str
    at: Vector
    clearance: float


def point_names(scene: Scene) -> Iterator[NamedPlace]:
    """The names of the points, but for those of outlines."""
    blocks = {mark.name for mark in scene.marks if isinstance(mark, SliderMark)} - scene.cylinders.keys()
    on_blocks = {scene.running_point_name(name) for name in blocks}
    pinned = {mark.name for mark in scene.marks if isinstance(mark, PinMark)}
    for each in named_points(scene.mechanism):
        link, point = each.members[0]
        if scene.is_unmarked(link, point):
            continue
        away = symbol_table.PIN_RADIUS + 0.6 if each.name in pinned else 0.9
        if each.name in on_blocks:
            away = symbol_table.BLOCK_SIZE[1] / 2.0 + 0.6
        yield NamedPlace(each.name, f"point {each.name}", link, scene.place(link, point), away)


def mass_centre_names(scene: Scene) -> Iterator[NamedPlace]:
    """The letters of the centres of mass that are at no named point."""
    for mark in scene.marks:
        if isinstance(mark, MassCentreMark) and mark.letter:
            yield NamedPlace(mark.letter, mark.name, mark.link, mark.at, symbol_table.MASS_CENTRE_RADIUS + 0.5)


def point_labels(scene: Scene, size: float = 9.0) -> Iterator[Label]:
    """The names of the points on paper."""
    return _labels(scene, point_names(scene), size)


def _labels(scene: Scene, names: Iterable[NamedPlace], size: float) -> Iterator[Label]:
    for text, about, link, at, away in names:
        yield Label(text, paper_point(scene.to_paper(link, at)), about, size, away)


def _link_number_labels(scene: Scene, strokes: list[Mark], clear: Clearance) -> Iterator[Label]:
    """The numbers of the links, each near the middle of its link; the frame's at its first support."""
    number = link_numbers(scene.mechanism)
    for link, body in scene.bodies.items():
        at, away = _number_position(scene, body, clear)
        yield Label(number[link], paper_point(at), f"number of {link}", 8.0, away)
    frame = scene.mechanism.frame
    base = next(
        (mark for mark in strokes if isinstance(mark, Polyline) and mark.pen is Pen.GROUND and len(mark.points) == 2),
        None,
    )
    if base is not None:
        (a, b), (c, d) = base.points
        yield Label(
            number[frame], ((a + c) / 2.0, (b + d) / 2.0), f"number of {frame}", 8.0, symbol_table.HATCH_LENGTH + 0.8
        )


def _number_position(scene: Scene, body: LinkBody, clear: Clearance) -> tuple[Vector, float]:
    """Where a link's number belongs, and how far from there it keeps (mm)."""
    link = body.link
    if body.plate:
        total = Vector(0.0, 0.0)
        for corner in body.plate:
            total = total + corner
        return scene.to_paper(link, total * (1.0 / len(body.plate))), 0.0
    tube = next((each for each in scene.cylinders.items() if link in (each[1].guide, each[1].rod)), None)
    if tube is not None:
        name, each = tube
        here = scene.displacement_along(name, each.guide, each.foot, each.direction)
        low, high = (
            (each.base, each.mouth)
            if link == each.guide
            else (max(each.mouth, here + each.piston), here + each.rod_end)
        )
        first, last = (scene.to_paper(each.guide, each.foot + each.direction * s) for s in (low, high))
        return (first + last) * 0.5, symbol_table.CYLINDER_WIDTH / 2.0 + 0.8 if link == each.guide else 1.0
    lines = list(body.sides)
    for name, foot, way in body.guides:
        lines.append((foot, foot + way * scene.displacement_along(name, link, foot, way)))
    longest = max(lines, key=lambda side: hypot(*(side[1] - side[0])), default=None)
    if longest is None or scene.scale.on_paper(hypot(*(longest[1] - longest[0]))) < 1.0:
        at = body.joints[0] if body.joints else body.guides[0].foot if body.guides else Vector(0.0, 0.0)
        return scene.to_paper(link, at), symbol_table.BLOCK_SIZE[1] / 2.0 + 1.0
    start, stop = (scene.to_paper(link, p) for p in longest)
    box = Vector(-3.0, -3.0), Vector(3.0, 3.0)
    parts = (0.5, 0.42, 0.58, 0.34, 0.66, 0.26, 0.74)
    spots = [start + (stop - start) * part for part in parts]
    return min(spots, key=lambda at: clear.count_in_box(at, Vector(1.0, 0.0), *box)), 1.0
