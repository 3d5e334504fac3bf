"""The arrows of inputs: where they stand, in the sense in which the driven link moves, and what is written at them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from math import atan2, hypot, pi, remainder
from typing import NamedTuple

from planar.drawing.labels.placement import SAME_POINT_TOLERANCE
from planar.drawing.paper.picture import Arrow, Label, Mark, Pen, paper_point
from planar.drawing.scheme import symbols
from planar.drawing.scheme.clearance import Clearance
from planar.drawing.scheme.placed_strokes import PlacedSymbol
from planar.drawing.scheme.scene import Scene
from planar.drawing.scheme.springs_masses import SUBSCRIPTS
from planar.drawing.scheme.symbol_table import (
    INPUT_ARC_LEAD,
    INPUT_ARC_RADII,
    INPUT_ARC_SWEEP,
    INPUT_ARROW_LENGTH,
    INPUT_ARROW_OFFSET,
)
from planar.foundation import jets
from planar.foundation.geometry import Vector, direction
from planar.model.file_units import display_unit
from planar.model.link_graph import link_numbers
from planar.model.mechanism import Input, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.model.pairs.symbols import GuideMark, PinMark, PitchLineMark, SliderMark, SlotMark, WheelMark

PLACES_ALONG = (0.0, INPUT_ARROW_LENGTH / 2.0, -INPUT_ARROW_LENGTH / 2.0, INPUT_ARROW_LENGTH, -INPUT_ARROW_LENGTH)
"""mm ahead of its slide at which an arrow may stand."""


class DrivenPlace(NamedTuple):
    """Which link an input moves against which, and the place of a link at which that is shown.

    `direction`, in the axes of `line`, is that of the slide, or from the pin to the driven link's farthest joint;
    `sense` is 1 where the link goes along it, or turns anticlockwise, as the input grows, else -1.
    """

    driven: str
    against: str | None
    link: str
    at: Vector
    line: str
    direction: Vector
    sense: float


def moving_input_arrow(scene: Scene, given: Input, sense: float, clear: Clearance) -> PlacedSymbol | None:
    """The arrow at its link where the input grows (`sense` 1) or shrinks (-1); None where there is no place for it."""
    pair = relative_motions(scene.mechanism)[given.pair]
    found, about = driven_place(scene, pair), f"input {given.pair}"
    if found is None:
        return None
    sense *= found.sense
    if pair.input_kind is not MeasureKind.LENGTH:
        return PlacedSymbol(about, found.link, "turning input", found.at, found.direction, side=sense)
    block = next((mark for mark in scene.pair_marks(pair) if isinstance(mark, SliderMark)), None)
    if block is None:
        return None  # a pin in a slot turns against the line
    at, way = scene.to_paper(found.link, found.at), scene.direction_on_paper(found.link, block.direction) * sense
    side, _ = _clear_side(at, way, clear, (0.0,))
    return PlacedSymbol(about, found.link, "sliding input", found.at, block.direction * sense, side=side)


def input_arrow_marks(scene: Scene, given: Input, clear: Clearance) -> Iterator[Mark]:
    """The arrow of an input with its rates, in the sense in which the driven link moves, or begins to; none at rest."""
    rate, pair = given.velocity or given.acceleration, relative_motions(scene.mechanism)[given.pair]
    found = driven_place(scene, pair) if rate else None
    if found is None:
        return
    sense = found.sense if rate > 0.0 else -found.sense
    at, about = scene.to_paper(found.link, found.at), f"input {given.pair}"
    way = scene.direction_on_paper(found.line, found.direction)
    if pair.input_kind is MeasureKind.LENGTH:
        way, letters, kinds = way * sense, "va", ("velocity", "acceleration")
        side, ahead = _clear_side(at, way, clear)
        tail = at + symbols.quarter_turn(way) * (side * INPUT_ARROW_OFFSET) + way * (ahead - INPUT_ARROW_LENGTH / 2.0)
        yield Arrow(paper_point(tail), paper_point(tail + way * INPUT_ARROW_LENGTH), Pen.INPUT, about)
        named = tail + way * (INPUT_ARROW_LENGTH / 2.0)
    else:
        letters, kinds = "ωα", ("angular velocity", "angular acceleration")
        radius, middle = _clear_arc(at, way, sense, clear)
        yield symbols.turning_arrow(at, radius, middle, INPUT_ARC_SWEEP, int(sense), about)
        named = at + direction(middle) * radius
    rates = tuple(_rate_symbol(scene, letter, found.driven, found.against) for letter in letters)
    yield from _rate_labels(scene, given, rates, kinds, named)


def driven_place(scene: Scene, pair: Pair) -> DrivenPlace | None:
    """Where the arrow of an input belongs, if anywhere."""
    return (_slid_place if pair.input_kind is MeasureKind.LENGTH else _turned_place)(scene, pair)


def _slid_place(scene: Scene, pair: Pair) -> DrivenPlace | None:
    marks = scene.pair_marks(pair)
    line = next((mark for mark in marks if isinstance(mark, GuideMark | SlotMark | PitchLineMark)), None)
    rider = scene.running_point(pair.name)
    if line is None or rider is None:
        return None
    moved, against, sense = rider[0], line.link, 1.0
    if moved == scene.mechanism.frame:  # the line is pushed through the block
        moved, against, sense = against, moved, -1.0
    return DrivenPlace(moved, against, *rider, line.link, line.direction, sense)


def _turned_place(scene: Scene, pair: Pair) -> DrivenPlace | None:
    numbers, still = pair.measure([scene.shapes[link] for link in pair.bodies]), scene.mechanism.frame

    def drive(turned: str | None) -> float:
        frames = [scene.frames[link] for link in pair.bodies]
        frames = [f._replace(angle=f.angle + (link == turned)) for link, f in zip(pair.bodies, frames, strict=True)]
        return float(pair.input_position(frames, numbers, ()))

    turns = {link: drive(link) - drive(None) for link in dict.fromkeys((*reversed(pair.links), *pair.bodies))}
    driven = next((link for link, sign in turns.items() if link != still and abs(sign) > 0.5), None)
    if driven is None:
        return None
    against = next((link for link, sign in turns.items() if link != driven and abs(sign) > 0.5), None)
    at = _turning_centre(scene, pair, driven)
    if at is None:
        return None
    joints = (*scene.bodies[driven].joints, *scene.bodies[driven].dots)
    far = max(joints, key=lambda p: hypot(*(p - at)), default=at) - at
    length = jets.hypot(*far)
    way = far * (1.0 / length) if length > 0.0 else symbols.EAST
    return DrivenPlace(driven, against, driven, at, driven, way, 1.0 if turns[driven] > 0.0 else -1.0)


def _turning_centre(scene: Scene, pair: Pair, driven: str) -> Vector | None:
    """The pin or the wheel's centre about which an input turns a link, in the link's axes."""
    for mark in scene.pair_marks(pair):
        if isinstance(mark, PinMark) and driven in mark.links:
            return mark.positions[mark.links.index(driven)]
        if isinstance(mark, WheelMark) and mark.link == driven:
            return mark.centre
    return None


def _clear_arc(at: Vector, way: Vector, sense: float, clear: Clearance) -> tuple[float, float]:
    """Radius (mm) and middle (rad) of an arc that few strokes cross, best just ahead of the driven link."""
    ahead = atan2(way.y, way.x) + sense * (INPUT_ARC_SWEEP / 2.0 + INPUT_ARC_LEAD)

    def price(choice: tuple[float, float]) -> float:
        radius, middle = choice
        return (
            clear.count_near_arc(at, radius, middle, INPUT_ARC_SWEEP)
            + abs(remainder(middle - ahead, 2.0 * pi))
            + 0.5 * (radius - INPUT_ARC_RADII[0])
        )

    return min(((radius, ahead + k * pi / 18.0) for radius in INPUT_ARC_RADII for k in range(36)), key=price)


def _clear_side(
    at: Vector, way: Vector, clear: Clearance, places: Sequence[float] = PLACES_ALONG
) -> tuple[float, float]:
    """On which side of a slide (1: left) and how far ahead of its place (mm) an arrow and its letters have room."""
    left = symbols.quarter_turn(way)

    def price(choice: tuple[float, float]) -> tuple[float, float]:
        sign, ahead = choice
        side, half = left * sign, Vector(INPUT_ARROW_LENGTH / 2.0, 3.5)
        middle = at + side * (INPUT_ARROW_OFFSET + 1.5) + way * ahead
        return clear.count_in_box(middle, way, half * -1.0, half) + abs(ahead) / 2.0, -side.y

    return min(product((1.0, -1.0), places), key=price)


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
