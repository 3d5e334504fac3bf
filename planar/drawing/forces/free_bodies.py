"""Free-body diagrams: every moving link by itself with all that acts on it, and beside it its force polygon."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, degrees, hypot, pi

import numpy as np

from planar.drawing.forces.action_arrows import ActionArrow, action_arrows
from planar.drawing.paper.picture import (
    Arrow,
    Circle,
    Fill,
    Label,
    Mark,
    PaperPoint,
    Pen,
    Picture,
    Polyline,
    extent,
    paper_point,
)
from planar.drawing.paper.scales import Scale, format_force, parse_scales, round_scale, unit_for_size
from planar.drawing.scheme import symbol_table, symbols
from planar.drawing.scheme.clearance import Clearance
from planar.drawing.scheme.link_bodies import link_bodies, unit_vector
from planar.drawing.scheme.link_strokes import moving_marks, wheel_symbols
from planar.drawing.scheme.placed_strokes import stroke_marks
from planar.drawing.scheme.scene import Scene, plain_frames
from planar.drawing.scheme.scheme import point_labels, scheme, space_scale
from planar.dynamics.forces import Forces
from planar.dynamics.load_attachment import attachment_remarks
from planar.dynamics.load_validation import require_loads
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector, direction
from planar.model.file_units import FileUnits
from planar.model.link_graph import link_label, link_numbers
from planar.model.mechanism import named_points
from planar.model.pairs.symbols import BeltMark, PinMark, SliderMark, SlotMark, WheelMark
from planar.model.wording import join_all_names
from planar.results.motion import Motion

BODY_SIZE, MECHANISM_SIZE, MAX_FORCE_LENGTH = (50.0, 42.0), (105.0, 75.0), 36.0
"""mm: room for the largest link, for the whole mechanism, and for the greatest force."""
FORCE_LABEL_SIZE, POINT_LABEL_SIZE = 7.5, 8.0
"""Points: sizes of letters, which differ so that those of a force and of its point stay apart."""
POLYGON_GAP = 32.0
"""mm between a link's forces and its polygon."""
COUPLE_RADII = (5.5, 7.5, 9.5, 11.5)
"""mm: of the arrows of couples at one place."""
COUPLE_SWEEP = 4.2
"""rad: how far they reach round."""
MIN_POLYGON_SIDE = 2.0
"""mm: a polygon whose greatest side is shorter is none to read."""
LINE_OF_ACTION_OVERHANG = 6.0
"""mm by which the line of action of a two-force member goes on beyond it."""
SAME_POINT_RATIO = 1e-6
"""Of the mechanism's size: places nearer than this are one."""


def free_bodies(forces: Forces, scale: str | Sequence[str] | None = None) -> tuple[list[Picture], str]:
    """The scheme, every moving link by itself, and the title with the scales.

    One scale of length and one of force hold for all links and polygons. Strokes are `about` "force F_32", "couple
    M_32", "polygon F_32" (a link's own feel) or "link AB". Raises BadInput for a scale that is none, for forces
    over a motion, and for a mechanism on which nothing acts.
    """
    if isinstance(forces.moving, Motion):
        raise BadInput("forces", "free bodies are drawn at one position; give the forces of a state")
    require_loads(forces.mechanism)
    given = parse_scales(scale, ["length", "force"], forces.mechanism.units)
    state, mechanism = forces.moving, forces.mechanism
    felt = action_arrows(forces, mechanism_size(mechanism, state.shapes))
    frames, shown = plain_frames(state.frames), link_bodies(mechanism, state.shapes)
    scene = Scene(mechanism, shown, frames, state.shapes, given.get("length") or _length_scale(forces))
    force = given.get("force") or _force_scale(list(felt.values()), mechanism.units)
    drawn = scheme(state, scene.scale)
    note = "F₃₂ is the force on link 3 by link 2, M₃₂ the couple"
    pictures = [drawn._replace(title="Space diagram", notes=(note, *attachment_remarks(mechanism)))]
    pictures += [_FreeBody(scene, link, each, force, forces).picture() for link, each in felt.items()]
    arrows = any(push.force is not None for each in felt.values() for push in each)
    used = (scene.scale, force) if arrows else (scene.scale,)
    return pictures, ", ".join((f"{mechanism.name}: free bodies", *map(str, used)))


class _FreeBody:
    """One link with what acts on it."""

    def __init__(self, scene: Scene, link: str, felt: Sequence[ActionArrow], scale: Scale, forces: Forces):
        self.scene, self.link, self.forces = scene, link, forces
        self.scale = scale
        told = [each for each in felt if each.is_determined]
        self.undetermined = [each for each in felt if not each.is_determined]
        self.arrows = sorted((each for each in told if each.force is not None), key=lambda each: -_magnitude(each))
        self.couples = [each for each in told if each.couple is not None]

    def picture(self) -> Picture:
        """The link, its forces, couples and letters, and the polygon to the right."""
        strokes: list[Mark] = list(_body_marks(self.scene, self.link))
        if self.is_two_force_member:
            strokes.insert(0, self._line_of_action())
        for at in dict.fromkeys(self._action_point(each) for each in self.arrows if each.at_mass_centre):
            strokes += symbols.symbol_marks("mass centre", "centre of mass", Vector(*at))
        strokes += self._friction_circles()
        clear, letters = Clearance.from_marks(strokes), list(_point_labels(self.scene, self.link))
        for each in self.arrows:
            arrow = self._force_arrow(each, clear)
            clear = clear.with_marks([arrow])
            strokes.append(arrow)
            tip = arrow.head if arrow.tail == self._action_point(each) else arrow.tail
            letters.append(self._action_label(each, tip, arrow.about))
        for each in self.couples:
            arc, at = self._couple_arc(each, clear, strokes)
            clear = clear.with_marks([arc])
            strokes.append(arc)
            letters.append(self._action_label(each, at, arc.about))
        polygon = list(self._force_polygon(extent(strokes)))
        title = link_label(link_numbers(self.scene.mechanism)[self.link], self.link)
        return Picture((*strokes, *polygon, *letters), title, tuple(self._notes()))

    @property
    def is_two_force_member(self) -> bool:
        """Whether just two forces act on it, at two places, and no couple."""
        if len(self.arrows) != 2 or self.couples or self.undetermined:
            return False
        places = [each.at for each in self.arrows if each.at is not None]
        least = SAME_POINT_RATIO * mechanism_size(self.scene.mechanism, self.scene.shapes)
        return len(places) == 2 and hypot(*(places[1] - places[0])) > least

    @property
    def is_too_small_for_polygon(self) -> bool:
        """Whether all its forces are too small for a polygon."""
        return max(map(_magnitude, self.arrows), default=0.0) < MIN_POLYGON_SIDE * self.scale.per_mm

    def _notes(self) -> Iterator[str]:
        if self.is_two_force_member:
            yield "two-force member"
        if any(each.friction_circle for each in self.arrows):
            yield "forces at pins are tangent to the friction circles"
        if not self.arrows and not self.couples and not self.undetermined:
            yield "nothing acts on it"
        if self.arrows and self.is_too_small_for_polygon:
            yield "forces too small for a polygon to this scale"
        if self.undetermined:
            yield f"not determined: {join_all_names([each.symbol.plain_text for each in self.undetermined])}"
        whys = [each.why for each in self.forces.reactions.values() if self.link in each.links and each.why]
        yield from dict.fromkeys(whys)

    def _action_point(self, push: ActionArrow) -> PaperPoint:
        """Where something acts; a couple that has no place at the link's first joint, or what else it has."""
        if push.at is not None:
            return paper_point(push.at / self.scene.scale.per_mm)
        body = self.scene.bodies[self.link]
        places = (*body.joints, *(guide.foot for guide in body.guides), *body.dots, Vector(0.0, 0.0))
        return paper_point(self.scene.to_paper(self.link, places[0]))

    def _friction_circles(self) -> list[Mark]:
        """The circles to which forces are tangent, to the scale of lengths."""
        circles = {each.friction_circle.pair: each.friction_circle for each in self.arrows if each.friction_circle}
        per_mm = self.scene.scale.per_mm
        return [
            Circle(paper_point(each.centre / per_mm), each.radius / per_mm, Pen.PIN, f"friction circle {each.pair}")
            for each in circles.values()
        ]

    def _line_of_action(self) -> Polyline:
        ends = [Vector(*self._action_point(each)) for each in self.arrows]
        way = unit_vector(ends[1] - ends[0]) * LINE_OF_ACTION_OVERHANG
        return Polyline((paper_point(ends[0] - way), paper_point(ends[1] + way)), Pen.CONSTRUCTION, "line of action")

    def _force_arrow(self, push: ActionArrow, clear: Clearance) -> Arrow:
        """The arrow of a force, from its place or to it, whichever crosses less."""
        at = Vector(*self._action_point(push))
        along = Vector(*paper_point(push.vector / self.scale.per_mm))
        way, long = unit_vector(along), hypot(*along)
        price = [
            clear.count_in_box(at, way, Vector(low, -1.0), Vector(high, 1.0))
            for low, high in ((symbol_table.PIN_RADIUS, long), (-long, -symbol_table.PIN_RADIUS))
        ]
        tail = at if price[0] <= price[1] else at - along
        return Arrow(paper_point(tail), paper_point(tail + along), push.pen, f"force {push.symbol}")

    def _couple_arc(self, push: ActionArrow, clear: Clearance, strokes: Sequence[Mark]) -> tuple[Circle, PaperPoint]:
        """The arrow of a couple about its place, outside those that are there, and where its letter belongs."""
        x, y = self._action_point(push)
        taken = sum(
            isinstance(each, Circle) and each.arrow_end and hypot(each.centre[0] - x, each.centre[1] - y) < 1.0
            for each in strokes
        )
        radius = COUPLE_RADII[min(taken, len(COUPLE_RADII) - 1)]
        at, sense = Vector(x, y), 1 if (push.couple or 0.0) > 0.0 else -1
        turns = [k * pi / 12.0 for k in range(24)]
        middle = min(turns, key=lambda turn: clear.count_near_arc(at, radius, turn, COUPLE_SWEEP))
        start = degrees(middle - COUPLE_SWEEP / 2.0) % 360.0
        arc = Circle(
            (x, y), radius, push.pen, f"couple {push.symbol}", Fill.NONE, start, start + degrees(COUPLE_SWEEP), sense
        )
        return arc, paper_point(at + direction(middle) * radius)

    def _action_label(self, push: ActionArrow, at: PaperPoint, about: str) -> Label:
        text, math = push.symbol.label
        told = format_force(
            _magnitude(push), "force" if push.force is not None else "torque", self.scene.mechanism.units
        )
        return Label(f"{text} = {told}", at, about, FORCE_LABEL_SIZE, 0.8, math=math)

    def _force_polygon(self, about: tuple[PaperPoint, PaperPoint]) -> Iterator[Mark]:
        """All forces head to tail, by their directions, so that they go once round; none where one is not told."""
        if (
            len(self.arrows) < 2
            or any(each.force is not None for each in self.undetermined)
            or self.is_too_small_for_polygon
        ):
            return
        ordered = sorted(self.arrows, key=lambda each: atan2(each.vector[1], each.vector[0]))
        sides = np.array([each.vector for each in ordered]) / self.scale.per_mm
        corners = np.concatenate([np.zeros((1, 2)), np.cumsum(sides, axis=0)])
        (_, low), (right, high) = about
        shift = np.array([right + POLYGON_GAP, (low + high) / 2.0])
        shift -= [corners[:, 0].min(), (corners[:, 1].min() + corners[:, 1].max()) / 2.0]
        for each, tail, side in zip(ordered, corners + shift, sides, strict=False):
            name = f"polygon {each.symbol}"
            yield Arrow(paper_point(tail), paper_point(tail + side), each.pen, name)
            text, math = each.symbol.label
            yield Label(text, paper_point(tail + side / 2.0), name, FORCE_LABEL_SIZE, 0.8, math=math)


def _body_marks(scene: Scene, link: str) -> Iterator[Mark]:
    """What a link looks like by itself: its body, wheels, blocks, and the pins through it."""
    yield from (mark for mark in moving_marks(scene) if mark.about == f"link {link}")
    wheels = [mark for mark in scene.marks if isinstance(mark, WheelMark)]
    wheels += [wheel for mark in scene.marks if isinstance(mark, BeltMark) for wheel in (mark.first, mark.second)]
    for wheel in {(each.centre, each.radius): each for each in wheels if each.link == link}.values():
        yield from stroke_marks(wheel_symbols(wheel, f"gear {wheel.name}"), scene.frames, scene.scale.per_mm)
    pins: dict[str, Vector] = {}
    for mark in scene.marks:
        if isinstance(mark, SliderMark) and mark.link == link and mark.name not in scene.cylinders:
            yield from symbols.symbol_marks(
                "block",
                f"block {scene.running_point_name(mark.name)}",
                scene.to_paper(link, mark.position),
                scene.direction_on_paper(link, mark.direction),
            )
        elif isinstance(mark, PinMark) and link in mark.links:
            pins.setdefault(mark.name, mark.positions[mark.links.index(link)])
        elif isinstance(mark, SlotMark) and mark.pin_link == link:
            pins.setdefault(scene.running_point_name(mark.name), mark.pin_position)
    for name, at in pins.items():
        yield from symbols.symbol_marks("pin", f"pin {name}", scene.to_paper(link, at))
    for at in scene.bodies[link].dots:
        yield from symbols.symbol_marks("dot", f"point of {link}", scene.to_paper(link, at))


def _point_labels(scene: Scene, link: str) -> Iterator[Label]:
    """The names of a link's points."""
    own = {f"point {each.name}" for each in named_points(scene.mechanism) if link in dict(each.members)}
    return (letter for letter in point_labels(scene, POINT_LABEL_SIZE) if letter.about in own)


def _length_scale(forces: Forces) -> Scale:
    """The scale at which the whole mechanism has room as well as its largest link."""
    state, mechanism = forces.moving, forces.mechanism
    frames = plain_frames(state.frames)
    whole = space_scale(mechanism, frames, state.shapes)
    scene = Scene(mechanism, link_bodies(mechanism, state.shapes), frames, state.shapes, whole)
    spans: list[float] = []
    drawn: list[tuple[Sequence[Mark], tuple[float, float]]] = [(moving_marks(scene), MECHANISM_SIZE)]
    drawn += [(list(_body_marks(scene, link)), BODY_SIZE) for link in scene.bodies]
    for marks, room in drawn:
        low, high = extent(marks)
        spans += [(high[k] - low[k]) * whole.per_mm / room[k] for k in (0, 1)]
    most = max(spans)
    return round_scale("length", mechanism.units.length, most, most, (1.0, 1.0))


def _force_scale(felt: Sequence[Sequence[ActionArrow]], units: FileUnits) -> Scale:
    """The scale at which the greatest force has its room."""
    most = max((_magnitude(p) for each in felt for p in each if p.is_determined and p.force is not None), default=0.0)
    return round_scale(
        "force", unit_for_size("force", most, units)[0], most, most, (MAX_FORCE_LENGTH, MAX_FORCE_LENGTH)
    )


def _magnitude(push: ActionArrow) -> float:
    return float(np.hypot(*push.force)) if push.force is not None else abs(push.couple or 0.0)
