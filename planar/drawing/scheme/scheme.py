"""The kinematic scheme of a mechanism in one position, as a textbook draws it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations, product
from math import atan2, hypot, pi, remainder

from planar.drawing.labels.placement import SAME_POINT_TOLERANCE
from planar.drawing.paper.picture import Arrow, Label, Mark, Pen, Picture, Polyline, paper_point
from planar.drawing.paper.scales import DRAWING_HEIGHT, DRAWING_WIDTH, Scale, round_scale
from planar.drawing.scheme import symbol_table, symbols
from planar.drawing.scheme.ground import Clearance, fixed_marks, ground_marks
from planar.drawing.scheme.link_bodies import LinkBody, all_marks, link_bodies
from planar.drawing.scheme.link_strokes import body_marks, moving_marks
from planar.drawing.scheme.scene import Scene, TravelRanges, plain_frames
from planar.drawing.scheme.spring_mass_strokes import mass_centre_labels
from planar.drawing.scheme.springs_masses import MassCentreMark
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Frame, Vector, direction
from planar.foundation.units import display_unit
from planar.model.link_graph import link_numbers
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Input, Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.model.pairs.symbols import GuideMark, PinMark, PitchLineMark, SliderMark, SlotMark, WheelMark
from planar.results.motion import State

__all__ = ["body_marks", "ground_marks", "plain_frames", "point_labels", "scheme", "scheme_scale", "space_scale"]

CROWDED_PIN_DISTANCE = 2.2 * symbol_table.PIN_RADIUS
"""mm between pins within which they lie on each other."""
CROWDED_SHEET_SIZE = (240.0, 150.0)
"""mm of a sheet of A4 on its side that a crowded drawing may take, its letters and symbols left out."""
MIN_FIGURE_SIZE = 60.0
"""mm: a figure that would be smaller may be higher than others."""
INPUT_ARC_SWEEP = 1.75
"""rad: how far the arrow of a turning input reaches round."""
INPUT_ARC_RADII = (6.0, 8.0, 10.5)
"""mm: how far from the pin it may be."""
MAX_ENLARGEMENT = 200.0
"""How much larger than what fits the paper a drawing may be: no sheet takes more, and hatching it takes for ever."""
INPUT_ARROW_LENGTH = 10.0
"""mm: the length of the arrow of a sliding input."""
INPUT_ARROW_OFFSET = 4.5
"""mm: how far it is from the line of the slide."""
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


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
    strokes: list[Mark] = [*fixed_marks(scene), *moving_marks(scene), *_fixed_point_marks(scene)]
    clear = Clearance.from_marks(strokes)
    for given in mechanism.inputs:
        arrow = tuple(_input_arrow(scene, given, clear))
        strokes += arrow
        clear = clear.with_marks(arrow)
    if numbers:
        strokes += _link_number_labels(scene, strokes, clear)
    if letters:
        strokes += (*point_labels(scene), *mass_centre_labels(scene))
    return Picture(tuple(strokes), mechanism.name, (f"Space diagram, {scale}",))


def space_scale(
    mechanism: Mechanism,
    frames: Mapping[str, Frame],
    shapes: Mapping[str, LinkShape],
    room: tuple[float, float] = (DRAWING_WIDTH, DRAWING_HEIGHT),
) -> Scale:
    """The round scale at which all points, bodies and wheels of a mechanism in a position fit a room (mm)."""
    places = [frames[link].to_world(point) for link, shape in shapes.items() for point in shape.points.values()]
    for link, body in link_bodies(mechanism, shapes).items():
        corners = [*(end for side in body.sides for end in side), *(guide.foot for guide in body.guides)]
        places += [frames[link].to_world(corner) for corner in corners]
    for mark in all_marks(mechanism, shapes):
        if isinstance(mark, WheelMark):
            x, y = frames[mark.link].to_world(mark.centre)
            r = abs(mark.radius)
            places += [Vector(x - r, y - r), Vector(x + r, y + r)]
        elif isinstance(mark, MassCentreMark):
            places.append(frames[mark.link].to_world(mark.at))
    xs, ys = zip(*places, strict=True) if places else ((0.0,), (0.0,))
    width, height = float(max(xs) - min(xs)), float(max(ys) - min(ys))
    fits = round_scale("length", mechanism.units.length, width, height, room)
    if fits.on_paper(max(width, height)) >= MIN_FIGURE_SIZE:
        return fits
    return round_scale("length", mechanism.units.length, width, height, (DRAWING_WIDTH, DRAWING_WIDTH))


def scheme_scale(state: State) -> Scale:
    """The round scale that fits the paper, or where pins would lie on each other the one that fits a whole sheet."""
    mechanism, frames, shapes = state.mechanism, plain_frames(state.frames), state.shapes
    fits = space_scale(mechanism, frames, shapes)
    pins = {mark.name for mark in all_marks(mechanism, shapes) if isinstance(mark, PinMark)}
    named = [each.members[0] for each in named_points(mechanism) if each.name in pins]
    places = [frames[link].to_world(shapes[link].position(point)) for link, point in named]
    apart = [fits.on_paper(hypot(*(one - other))) for one, other in combinations(places, 2)]
    if not any(SAME_POINT_TOLERANCE < each < CROWDED_PIN_DISTANCE for each in apart):
        return fits
    return space_scale(mechanism, frames, shapes, CROWDED_SHEET_SIZE)


def _fixed_point_marks(scene: Scene) -> Iterator[Mark]:
    """Points of the frame at which nothing is pinned."""
    frame = scene.mechanism.frame
    pinned = {mark.name for mark in scene.marks if isinstance(mark, PinMark)}
    for each in named_points(scene.mechanism):
        at = dict(each.members).get(frame)
        if at is not None and each.name not in pinned:
            place = scene.to_paper(frame, scene.shapes[frame].position(at))
            yield from symbols.symbol_marks("fixed dot", f"point {each.name}", place)


def point_labels(scene: Scene, size: float = 9.0) -> Iterator[Label]:
    """The names of the points."""
    blocks = {mark.name for mark in scene.marks if isinstance(mark, SliderMark)} - scene.cylinders.keys()
    on_blocks = {scene.running_point_name(name) for name in blocks}
    pinned = {mark.name for mark in scene.marks if isinstance(mark, PinMark)}
    for each in named_points(scene.mechanism):
        link, point = each.members[0]
        away = symbol_table.PIN_RADIUS + 0.6 if each.name in pinned else 0.9
        if each.name in on_blocks:
            away = symbol_table.BLOCK_SIZE[1] / 2.0 + 0.6
        at = scene.to_paper(link, scene.shapes[link].position(point))
        yield Label(each.name, paper_point(at), f"point {each.name}", size, away)


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


def _input_arrow(scene: Scene, given: Input, clear: Clearance) -> Iterator[Mark]:
    """The arrow of an input with its rates, in the sense in which the driven link moves, or begins to; none at rest."""
    pair = relative_motions(scene.mechanism)[given.pair]
    if not given.velocity and not given.acceleration:
        return
    if pair.input_kind is MeasureKind.LENGTH:
        yield from _sliding_arrow(scene, pair, given, clear)
    else:
        yield from _turning_arrow(scene, pair, given, clear)


def _rate_labels(
    scene: Scene, given: Input, letters: tuple[str, ...], kinds: tuple[str, str], at: Vector
) -> Iterator[Label]:
    """What is written at an input's arrow: its velocity, and its acceleration along the arrow; nothing of what is 0."""
    along = 1.0 if (given.velocity or given.acceleration) > 0.0 else -1.0
    for index, rate in enumerate((given.velocity, given.acceleration)):
        if rate:
            name, of = display_unit(kinds[index], scene.mechanism.units)
            text = f"{letters[index]} = {of.from_si(rate * along):.4g} {name}".replace("-", "−")
            # a text of its own by the velocity's, not one line with it
            yield Label(
                text, paper_point(at - Vector(0.0, 2.0 * SAME_POINT_TOLERANCE * index)), f"input {given.pair}", 9.0, 1.2
            )


def _rate_symbol(scene: Scene, letter: str, link: str, against: str | None) -> str:
    """ω or v; with the numbers of the links where there is a choice."""
    number = link_numbers(scene.mechanism)
    if against is not None and against != scene.mechanism.frame:
        both = number[link], number[against]
        return letter + ("," if len(max(both, key=len)) > 1 else "").join(both).translate(SUBSCRIPTS)
    return letter if len(scene.mechanism.inputs) == 1 else letter + number[link].translate(SUBSCRIPTS)


def _turning_arrow(scene: Scene, pair: Pair, given: Input, clear: Clearance) -> Iterator[Mark]:
    numbers = pair.measure([scene.shapes[link] for link in pair.bodies])

    def drive(turned: str | None) -> float:
        frames = [scene.frames[link] for link in pair.bodies]
        frames = [f._replace(angle=f.angle + (link == turned)) for link, f in zip(pair.bodies, frames, strict=True)]
        return float(pair.input_position(frames, numbers, ()))

    still = scene.mechanism.frame
    turns = {link: drive(link) - drive(None) for link in dict.fromkeys((*reversed(pair.links), *pair.bodies))}
    driven = next((link for link, sign in turns.items() if link != still and abs(sign) > 0.5), None)
    if driven is None:
        return
    against = next((link for link, sign in turns.items() if link != driven and abs(sign) > 0.5), None)
    at = _turning_centre(scene, pair, driven)
    if at is None:
        return
    sense = 1 if (given.velocity or given.acceleration) * turns[driven] > 0.0 else -1
    radius, middle = _clear_arc(scene, at, driven, sense, clear)
    about = f"input {pair.name}"
    yield symbols.turning_arrow(at, radius, middle, INPUT_ARC_SWEEP, sense, about)
    rates = tuple(_rate_symbol(scene, letter, driven, against) for letter in "ωα")
    kinds = ("angular velocity", "angular acceleration")
    yield from _rate_labels(scene, given, rates, kinds, at + direction(middle) * radius)


def _turning_centre(scene: Scene, pair: Pair, driven: str) -> Vector | None:
    """The pin or the wheel's centre about which an input turns a link, on paper."""
    for mark in pair.drawing_marks(scene.shapes, scene.mechanism.pairs):
        if isinstance(mark, PinMark):
            return scene.to_paper(mark.links[0], mark.positions[0])
        if isinstance(mark, WheelMark) and mark.link == driven:
            return scene.to_paper(mark.link, mark.centre)
    return None


def _clear_arc(scene: Scene, at: Vector, driven: str, sense: int, clear: Clearance) -> tuple[float, float]:
    """Radius (mm) and middle (rad) of an arc that few strokes cross, best just ahead of the driven link."""
    joints = [scene.to_paper(driven, p) for p in (*scene.bodies[driven].joints, *scene.bodies[driven].dots)]
    far = max(joints, key=lambda p: hypot(*(p - at)), default=at)
    ahead = atan2(far.y - at.y, far.x - at.x) + sense * (INPUT_ARC_SWEEP / 2.0 + 0.25)

    def price(choice: tuple[float, float]) -> float:
        radius, middle = choice
        return (
            clear.count_near_arc(at, radius, middle, INPUT_ARC_SWEEP)
            + abs(remainder(middle - ahead, 2.0 * pi))
            + 0.5 * (radius - INPUT_ARC_RADII[0])
        )

    return min(((radius, ahead + k * pi / 18.0) for radius in INPUT_ARC_RADII for k in range(36)), key=price)


def _sliding_arrow(scene: Scene, pair: Pair, given: Input, clear: Clearance) -> Iterator[Mark]:
    found = pair.drawing_marks(scene.shapes, scene.mechanism.pairs)
    line = next((mark for mark in found if isinstance(mark, GuideMark | SlotMark | PitchLineMark)), None)
    rider = scene.running_point(pair.name)
    if line is None or rider is None:
        return
    moved, against, sign = rider[0], line.link, 1.0 if (given.velocity or given.acceleration) > 0.0 else -1.0
    if moved == scene.mechanism.frame:  # the line is pushed through the block
        moved, against, sign = against, moved, -sign
    at, way = scene.to_paper(*rider), scene.direction_on_paper(line.link, line.direction) * sign
    left = symbols.quarter_turn(way)

    def price(choice: tuple[Vector, float]) -> tuple[float, float]:
        """What is in the way of the arrow and of its letters."""
        side, ahead = choice
        middle, half = at + side * (INPUT_ARROW_OFFSET + 1.5) + way * ahead, Vector(INPUT_ARROW_LENGTH / 2.0, 3.5)
        return clear.count_in_box(middle, way, half * -1.0, half) + abs(ahead) / 2.0, -side.y

    side, ahead = min(
        product(
            (left, left * -1.0),
            (0.0, INPUT_ARROW_LENGTH / 2.0, -INPUT_ARROW_LENGTH / 2.0, INPUT_ARROW_LENGTH, -INPUT_ARROW_LENGTH),
        ),
        key=price,
    )
    tail = at + side * INPUT_ARROW_OFFSET + way * (ahead - INPUT_ARROW_LENGTH / 2.0)
    about = f"input {pair.name}"
    yield Arrow(paper_point(tail), paper_point(tail + way * INPUT_ARROW_LENGTH), Pen.INPUT, about)
    rates = tuple(_rate_symbol(scene, letter, moved, against) for letter in "va")
    yield from _rate_labels(scene, given, rates, ("velocity", "acceleration"), tail + way * (INPUT_ARROW_LENGTH / 2.0))
