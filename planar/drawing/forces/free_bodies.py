"""Free-body diagrams: every moving link by itself with all that acts on it, and beside it its force polygon."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, degrees, hypot, pi

import numpy as np

from planar.drawing.forces.action_arrows import Push, pushes
from planar.drawing.paper.picture import (
    Arrow,
    Circle,
    Fill,
    Letter,
    Line,
    Mark,
    Pen,
    Picture,
    Spot,
    extent,
    spot,
)
from planar.drawing.paper.scales import Scale, fitting, prefixed, said, scales
from planar.drawing.scheme import symbols
from planar.drawing.scheme.ground import Clearance
from planar.drawing.scheme.link_bodies import bodies, unit
from planar.drawing.scheme.link_strokes import moving
from planar.drawing.scheme.scene import Scene, standing
from planar.drawing.scheme.scheme import point_letters, scheme, space_scale
from planar.dynamics.forces import Forces
from planar.dynamics.load_attachment import choices
from planar.dynamics.load_validation import refuse_unloaded
from planar.equations.functions import size
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector, direction
from planar.model.link_graph import number_and_name, numbered
from planar.model.mechanism import named_points
from planar.model.pairs.symbols import Band, Block, Opening, Pin, Wheel
from planar.model.wording import listed
from planar.results.motion import Motion

BODY, WHOLE, ARROW = (50.0, 42.0), (105.0, 75.0), 36.0
"""mm: room for the largest link, for the whole mechanism, and for the greatest force."""
FORCES, POINTS = 7.5, 8.0
"""Points: sizes of letters, which differ so that those of a force and of its point stay apart."""
POLYGON = 32.0
"""mm between a link's forces and its polygon."""
RADII = (5.5, 7.5, 9.5, 11.5)
"""mm: of the arrows of couples at one place."""
SWEEP = 4.2
"""rad: how far they reach round."""
LEAST = 2.0
"""mm: a polygon whose greatest side is shorter is none to read."""
OVER = 6.0
"""mm by which the line of action of a two-force member goes on beyond it."""
ON_LINE = 1e-6
"""Of the mechanism's size: places nearer than this are one."""


def free_bodies(forces: Forces, scale: str | Sequence[str] | None = None) -> tuple[list[Picture], str]:
    """The scheme, every moving link by itself, and the title with the scales.

    One scale of length and one of force hold for all links and polygons. Strokes are `about` "force F_32", "couple
    M_32", "polygon F_32" (a link's own feel) or "link AB". Raises BadInput for a scale that is none, for forces
    over a motion, and for a mechanism on which nothing acts.
    """
    if isinstance(forces.moving, Motion):
        raise BadInput("forces", "free bodies are drawn at one position; give the forces of a state")
    refuse_unloaded(forces.mechanism)
    given = scales(scale, ["length", "force"])
    state, mechanism = forces.moving, forces.mechanism
    felt = pushes(forces, size(mechanism, state.shapes))
    frames, shown = standing(state.frames), bodies(mechanism, state.shapes)
    scene = Scene(mechanism, shown, frames, state.shapes, given.get("length") or _length(forces))
    force = given.get("force") or _force_scale(felt.values())
    drawn = scheme(state, scene.scale)
    note = "F₃₂ is the force on link 3 by link 2, M₃₂ the couple"
    pictures = [drawn._replace(title="Space diagram", notes=(note, *choices(mechanism)))]
    pictures += [_FreeBody(scene, link, each, force, forces).picture() for link, each in felt.items()]
    arrows = any(push.force is not None for each in felt.values() for push in each)
    used = (scene.scale, force) if arrows else (scene.scale,)
    return pictures, ", ".join((f"{mechanism.name}: free bodies", *map(str, used)))


class _FreeBody:
    """One link with what acts on it."""

    def __init__(self, scene: Scene, link: str, felt: Sequence[Push], scale: Scale, forces: Forces):
        self.scene, self.link, self.forces = scene, link, forces
        self.scale = scale
        told = [each for each in felt if each.told]
        self.untold = [each for each in felt if not each.told]
        self.arrows = sorted((each for each in told if each.force is not None), key=lambda each: -_magnitude(each))
        self.couples = [each for each in told if each.couple is not None]

    def picture(self) -> Picture:
        """The link, its forces, couples and letters, and the polygon to the right."""
        strokes: list[Mark] = list(_body(self.scene, self.link))
        if self.two_force:
            strokes.insert(0, self._line_of_action())
        for at in dict.fromkeys(self._spot(each) for each in self.arrows if each.massive):
            strokes += symbols.mass_centre(Vector(*at), "centre of mass")
        clear, letters = Clearance.of(strokes), list(_points(self.scene, self.link))
        for each in self.arrows:
            arrow = self._arrow(each, clear)
            clear = clear.beside([arrow])
            strokes.append(arrow)
            tip = arrow.head if arrow.tail == self._spot(each) else arrow.tail
            letters.append(self._letter(each, tip, arrow.about))
        for each in self.couples:
            arc, at = self._couple(each, clear, strokes)
            clear = clear.beside([arc])
            strokes.append(arc)
            letters.append(self._letter(each, at, arc.about))
        polygon = list(self._polygon(extent(strokes)))
        title = number_and_name(numbered(self.scene.mechanism)[self.link], self.link)
        return Picture((*strokes, *polygon, *letters), title, tuple(self._notes()))

    @property
    def two_force(self) -> bool:
        """Whether just two forces act on it, at two places, and no couple."""
        if len(self.arrows) != 2 or self.couples or self.untold:
            return False
        return hypot(*(self.arrows[1].at - self.arrows[0].at)) > ON_LINE * size(self.scene.mechanism, self.scene.shapes)

    @property
    def small(self) -> bool:
        """Whether all its forces are too small for a polygon."""
        return max(map(_magnitude, self.arrows), default=0.0) < LEAST * self.scale.per_mm

    def _notes(self) -> Iterator[str]:
        if self.two_force:
            yield "two-force member"
        if not self.arrows and not self.couples and not self.untold:
            yield "nothing acts on it"
        if self.arrows and self.small:
            yield "forces too small for a polygon to this scale"
        if self.untold:
            yield f"not determined: {listed([each.sign.plain for each in self.untold])}"
        whys = [each.why for each in self.forces.reactions.values() if self.link in each.links and each.why]
        yield from dict.fromkeys(whys)

    def _spot(self, push: Push) -> Spot:
        """Where something acts; a couple that has no place at the link's first joint, or what else it has."""
        if push.at is not None:
            return spot(push.at / self.scene.scale.per_mm)
        body = self.scene.bodies[self.link]
        places = (*body.joints, *(guide.foot for guide in body.guides), *body.dots, Vector(0.0, 0.0))
        return spot(self.scene.place(self.link, places[0]))

    def _line_of_action(self) -> Line:
        ends = [Vector(*self._spot(each)) for each in self.arrows]
        way = unit(ends[1] - ends[0]) * OVER
        return symbols.line("line of action", Pen.CONSTRUCTION, ends[0] - way, ends[1] + way)

    def _arrow(self, push: Push, clear: Clearance) -> Arrow:
        """The arrow of a force, from its place or to it, whichever crosses less."""
        at = Vector(*self._spot(push))
        along = Vector(*map(float, push.force / self.scale.per_mm))
        way, long = unit(along), hypot(*along)
        price = [
            clear.crowd(at, way, Vector(low, -1.0), Vector(high, 1.0))
            for low, high in ((symbols.PIN, long), (-long, -symbols.PIN))
        ]
        tail = at if price[0] <= price[1] else at - along
        return Arrow(spot(tail), spot(tail + along), push.pen, f"force {push.sign}")

    def _couple(self, push: Push, clear: Clearance, strokes: Sequence[Mark]) -> tuple[Circle, Spot]:
        """The arrow of a couple about its place, outside those that are there, and where its letter belongs."""
        x, y = self._spot(push)
        taken = sum(
            isinstance(each, Circle) and each.pointed and hypot(each.centre[0] - x, each.centre[1] - y) < 1.0
            for each in strokes
        )
        radius = RADII[min(taken, len(RADII) - 1)]
        at, sense = Vector(x, y), 1 if (push.couple or 0.0) > 0.0 else -1
        turns = [k * pi / 12.0 for k in range(24)]
        middle = min(turns, key=lambda turn: clear.ring(at, radius, turn, SWEEP))
        start = degrees(middle - SWEEP / 2.0) % 360.0
        arc = Circle((x, y), radius, push.pen, f"couple {push.sign}", Fill.NONE, start, start + degrees(SWEEP), sense)
        return arc, spot(at + direction(middle) * radius)

    def _letter(self, push: Push, at: Spot, about: str) -> Letter:
        text, math = push.sign.text
        told = said(_magnitude(push), "N" if push.force is not None else "N·m")
        return Letter(f"{text} = {told}", at, about, FORCES, 0.8, math=math)

    def _polygon(self, about: tuple[Spot, Spot]) -> Iterator[Mark]:
        """All forces head to tail, by their directions, so that they go once round; none where one is not told."""
        if len(self.arrows) < 2 or any(each.force is not None for each in self.untold) or self.small:
            return
        ordered = sorted(self.arrows, key=lambda each: atan2(each.force[1], each.force[0]))
        sides = np.array([each.force for each in ordered]) / self.scale.per_mm
        corners = np.concatenate([np.zeros((1, 2)), np.cumsum(sides, axis=0)])
        (_, low), (right, high) = about
        shift = np.array([right + POLYGON, (low + high) / 2.0])
        shift -= [corners[:, 0].min(), (corners[:, 1].min() + corners[:, 1].max()) / 2.0]
        for each, tail, side in zip(ordered, corners + shift, sides, strict=False):
            name = f"polygon {each.sign}"
            yield Arrow(spot(tail), spot(tail + side), each.pen, name)
            text, math = each.sign.text
            yield Letter(text, spot(tail + side / 2.0), name, FORCES, 0.8, math=math)


def _body(scene: Scene, link: str) -> Iterator[Mark]:
    """What a link looks like by itself: its body, wheels, blocks, and the pins through it."""
    yield from (mark for mark in moving(scene) if mark.about == f"link {link}")
    wheels = [mark for mark in scene.marks if isinstance(mark, Wheel)]
    wheels += [wheel for mark in scene.marks if isinstance(mark, Band) for wheel in (mark.first, mark.second)]
    for centre, radius, name in {
        (each.centre, each.radius): (each.centre, each.radius, each.name) for each in wheels if each.link == link
    }.values():
        yield from symbols.wheel(scene.place(link, centre), scene.scale.on_paper(radius), f"gear {name}", Pen.LINK)
    pins = {}
    for mark in scene.marks:
        if isinstance(mark, Block) and mark.link == link and mark.name not in scene.tubes:
            yield symbols.block(
                scene.place(link, mark.at), scene.way(link, mark.way), f"block {scene.named(mark.name)}"
            )
        elif isinstance(mark, Pin) and link in mark.links:
            pins.setdefault(mark.name, mark.at[mark.links.index(link)])
        elif isinstance(mark, Opening) and mark.pin == link:
            pins.setdefault(scene.named(mark.name), mark.at)
    for name, at in pins.items():
        yield symbols.pin(scene.place(link, at), f"pin {name}")
    for at in scene.bodies[link].dots:
        yield symbols.dot(scene.place(link, at), f"point of {link}")


def _points(scene: Scene, link: str) -> Iterator[Letter]:
    """The names of a link's points."""
    own = {f"point {each.name}" for each in named_points(scene.mechanism) if link in dict(each.members)}
    return (letter for letter in point_letters(scene, POINTS) if letter.about in own)


def _length(forces: Forces) -> Scale:
    """The scale at which the whole mechanism has room as well as its largest link."""
    state, mechanism = forces.moving, forces.mechanism
    frames = standing(state.frames)
    whole = space_scale(mechanism, frames, state.shapes)
    scene = Scene(mechanism, bodies(mechanism, state.shapes), frames, state.shapes, whole)
    spans = []
    for marks, room in [(list(moving(scene)), WHOLE), *((list(_body(scene, link)), BODY) for link in scene.bodies)]:
        low, high = extent(marks)
        spans += [(high[k] - low[k]) * whole.per_mm / room[k] for k in (0, 1)]
    most = max(spans)
    return fitting("length", mechanism.units.length, most, most, (1.0, 1.0))


def _force_scale(felt: Sequence[Sequence[Push]]) -> Scale:
    """The scale at which the greatest force has its room."""
    most = max((_magnitude(p) for each in felt for p in each if p.told and p.force is not None), default=0.0)
    return fitting("force", prefixed(most)[0] + "N", most, most, (ARROW, ARROW))


def _magnitude(push: Push) -> float:
    return float(np.hypot(*push.force)) if push.force is not None else abs(push.couple or 0.0)
