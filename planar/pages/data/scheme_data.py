"""The scheme that a page moves: strokes of links, their numbers functions of dimensions, travel and scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from itertools import chain
from math import pi
from typing import Any, ClassVar

import numpy as np

from planar.drawing.paper.picture import paper_point
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.clearance import Clearance
from planar.drawing.scheme.ground import fixed_pins, fixed_point_strokes, fixed_strokes, obstructing_strokes
from planar.drawing.scheme.input_arrows import moving_input_arrow
from planar.drawing.scheme.link_bodies import (
    RELATIVE_TOLERANCE,
    LinkBody,
    all_marks,
    bodies_of_points,
    body_points,
    largest_span,
)
from planar.drawing.scheme.link_strokes import moving_strokes
from planar.drawing.scheme.motors import motor_strokes
from planar.drawing.scheme.placed_strokes import PlacedSpring, PlacedStroke, PlacedTorsionSpring, stroke_marks
from planar.drawing.scheme.scene import Scene, plain_frames
from planar.drawing.scheme.scheme import extent_corners, extent_places, mass_centre_names, point_names
from planar.drawing.scheme.springs_masses import SpringMassMark
from planar.equations.coordinates import frames_from_coordinates
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.foundation.geometry import Frame, Vector
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import Pair
from planar.model.pairs.symbols import DrawingMark
from planar.pages.data.dimension_numbers import DimensionNumber, DimensionNumbers, DrawingNumbers
from planar.results.motion import Motion
from planar.solving.continuation.fast_path import fast_run, resting_inputs
from planar.solving.continuation.path import follow_samples
from planar.solving.position import PositionSolver, solved_mechanism

Positions = Sequence[Mapping[str, Frame]]
"""Where the links are, in some positions; first where the page begins."""

MOTION_STEPS = 24
"""Steps over the range of every input for which a drawing has room."""
STEP_PARTS = 6
"""Parts of such a step in which the motion is followed."""
FREE_SLIDE_RATIO = 0.3
"""Of the mechanism's size: how far a slide is followed either way."""
MAX_OBSTACLE_POSITIONS = 8
"""Positions of the links that supports keep clear of."""
OBSTACLE_WEIGHT = 0.3
"""What strokes count beside the cost of a support that leans: they are not everywhere at once."""
SMALL_ROOM = 104.0, 70.0
"""mm in which a page draws in a small window; sides and gaps are chosen for it, and serve in larger ones too."""
SMALLEST_RATIO = 0.02
"""Of the mechanism's size: what is smaller is not blown up to fill the room."""


@dataclass(frozen=True)
class MovingScene(Scene):
    """A scene for the whole motion: its numbers follow dimensions, travel and scale; choices hold for the file's."""

    is_moving: ClassVar[bool] = True

    numbers: DrawingNumbers = field(kw_only=True)
    own_marks: tuple[DrawingMark | SpringMassMark, ...] = field(kw_only=True)
    own_places: Mapping[str, Mapping[str, Vector]] = field(kw_only=True)
    positions: Positions = field(kw_only=True)
    measured: list[dict[str, Any]] = field(default_factory=list)
    _ranges: dict[Any, tuple[DimensionNumber, DimensionNumber]] = field(default_factory=dict)

    @property
    def per_mm(self) -> DimensionNumber:
        return self.numbers.per_mm

    @property
    def places(self) -> Mapping[str, Mapping[str, Vector]]:
        return self.own_places

    @cached_property
    def marks(self) -> tuple[DrawingMark | SpringMassMark, ...]:
        return self.own_marks

    def place(self, link: str, point: str) -> Vector:
        return self.own_places[link][point]

    def knows_travel(self, name: str) -> bool:
        return True

    def pair_marks(self, pair: Pair) -> Sequence[DrawingMark]:
        dimensions = self.numbers.dimensions
        own = relative_motions(dimensions.mechanism)[pair.name]
        return dimensions.with_values(own.drawing_marks(dimensions.shapes, dimensions.mechanism.pairs))

    def shown_range(self, name: str, link: str, foot: Vector, way: Vector) -> tuple[DimensionNumber, DimensionNumber]:
        """From where to where a point goes in the whole motion, which a page measures."""
        key = name, link, *map(float, (*foot, *way))
        if key not in self._ranges:
            rider, at = self.running_point(name) or (link, foot)
            start, along, place = (Vector(*paper_point(each)) for each in (foot, way, at))
            far = [
                (frames[link].to_local(frames[rider].to_world(place)) - start).dot(along) for frames in self.positions
            ]
            self._ranges[key] = self.numbers.add_travel(min(far), max(far))
            self.measured.append(
                {
                    "link": link,
                    "foot": self.numbers.add_point(foot),
                    "direction": self.numbers.add_point(way),
                    "rider": rider,
                    "at": self.numbers.add_point(at),
                }
            )
        return self._ranges[key]

    def travel_range(
        self, name: str, link: str, through: Vector, foot: Vector, way: Vector
    ) -> tuple[DimensionNumber, DimensionNumber]:
        return self.shown_range(name, link, foot, way)


def motion_positions(mechanism: Mechanism, z: Array) -> Positions:
    """Where the links are at the unknowns z, and over the motion of every input from there, if anything moves."""
    known = solved_mechanism(mechanism)
    solver = known.solver
    u, p = solver.inputs.u, solver.inputs.p

    def frames(z: Array, u: Array) -> Mapping[str, Frame]:
        w = solver.functions.coordinates(z, u, p)
        found, _ = frames_from_coordinates((w * solver.scale).tolist(), solver.column, solver.shapes, solver.pairs)
        return plain_frames(found)

    positions = [frames(z, u)]
    for number, given in enumerate(mechanism.inputs):
        if known.motion_refusal(given.pair) is not None:
            continue
        step = np.zeros_like(u)
        sliding = solver.is_sliding(given.pair)
        step[number] = (FREE_SLIDE_RATIO if sliding else 2.0 * pi) / MOTION_STEPS
        for sense in (1.0, -1.0):
            samples = u + sense * step * np.arange(MOTION_STEPS * STEP_PARTS + 1)[:, None] / STEP_PARTS
            places, found = _followed_samples(solver, z, samples, through=not sliding)
            positions += map(frames, found, places)
            if len(found) == MOTION_STEPS and not sliding:
                break  # a whole turn: nothing is left for the other way
    return positions


def _followed_samples(solver: PositionSolver, z: Array, samples: Array, through: bool) -> tuple[Array, Array]:
    """The inputs at every step after the first of the samples, as far as they are reached, and the unknowns there.

    Quickly as far as that goes; from there on by the general path, `through` change points, where that is wanted.
    """
    places, reached = samples[STEP_PARTS::STEP_PARTS], 0
    found: Array = np.empty((0, z.size))
    run = fast_run(solver, z, resting_inputs(samples))
    if run is not None and len(run.z):
        found = run.z[STEP_PARTS::STEP_PARTS]
        reached = len(found)
    if through and reached < len(places):
        ahead = samples[reached * STEP_PARTS :: STEP_PARTS]
        with suppress(NoAnswer):
            rest = follow_samples(solver, found[-1] if reached else z, resting_inputs(ahead)).z[1:]
            found = np.concatenate([found, rest])
    return places[: len(found)], found


def frames_of_rows(motion: Motion) -> list[dict[str, Frame]]:
    """The links' frames at every row of a motion, as plain numbers."""
    return [plain_frames(motion.frames, row) for row in range(len(motion))]


def scheme_data(
    mechanism: Mechanism, dimensions: DimensionNumbers, positions: Positions, digits: int | None = None
) -> tuple[dict[str, Any], DrawingNumbers]:
    """Strokes, arrows of inputs and letters by their links, and the numbers that they refer to.

    `measures` are displacements along lines whose ranges a page finds, `extent` is what has to be seen.
    """
    scene = moving_scene(mechanism, dimensions, positions, digits)
    numbers = scene.numbers
    levels: dict[str, list[PlacedStroke]] = {level: list(each) for level, each in moving_strokes(scene).items()}
    levels["pins"] += fixed_point_strokes(scene)
    seen = positions[:: -(-len(positions) // MAX_OBSTACLE_POSITIONS)]
    moving, per_mm, weight = list(obstructing_strokes(scene)), scene.scale.per_mm, OBSTACLE_WEIGHT
    clear = Clearance.from_marks(stroke_marks(fixed_pins(scene), scene.frames, per_mm), weight)
    for frames in seen:
        clear = clear.with_marks(stroke_marks(moving, frames, per_mm), weight / len(seen))
    levels = {"ground": fixed_strokes(scene, clear)} | levels
    clear = clear.with_marks(stroke_marks(levels["ground"], scene.frames, per_mm), weight)
    motors = tuple(motor_strokes(scene, clear))
    levels["pins"] += motors
    clear = clear.with_marks(stroke_marks(motors, scene.frames, per_mm), weight)
    arrows = [[moving_input_arrow(scene, given, sense, clear) for sense in (1.0, -1.0)] for given in mechanism.inputs]
    points, bodies = scene.own_places, scene.bodies
    data = {
        "levels": {level: [_stroke_data(each, numbers) for each in strokes] for level, strokes in levels.items()},
        "arrows": [[each and _stroke_data(each, numbers) for each in both] for both in arrows],
        "letters": [
            {"text": each.text, "link": each.link, "at": numbers.add_point(each.at), "clearance": each.clearance}
            for each in chain(point_names(scene), mass_centre_names(scene))
        ],
        "extent": [
            {"link": link, "at": numbers.add_point(at), "radius": numbers.add(radius)}
            for link, at, radius in extent_places(points, bodies, scene.marks)
        ],
        "measures": scene.measured,
    }
    return data | {"count": len(numbers.values)}, numbers


def moving_scene(
    mechanism: Mechanism,
    dimensions: DimensionNumbers,
    positions: Positions,
    digits: int | None = None,
    per_mm: float | None = None,
) -> MovingScene:
    """Bodies chosen at the file's dimensions, at the scale at which all positions fit a small room unless given."""
    shapes = shapes_of_links(mechanism)
    own = {link.name: dict(dimensions.shapes[link.name].points) for link in mechanism.links}
    own, marks = dimensions.with_values((own, all_marks(dimensions.mechanism, dimensions.shapes)))
    size = largest_span(shapes)
    moving = body_points(mechanism, own, shapes)
    bodies: dict[str, LinkBody] = bodies_of_points(moving, marks, RELATIVE_TOLERANCE * size)
    low, high = extent_corners(extent_places(own, bodies, marks), positions)
    spans = [(far / room) for far, room in zip(high - low, SMALL_ROOM, strict=True)]
    per_mm = per_mm or max(*spans, SMALLEST_RATIO * size / (0.6 * min(SMALL_ROOM)))
    return MovingScene(
        mechanism,
        bodies,
        positions[0],
        shapes,
        Scale("length", per_mm, mechanism.units.length),
        numbers=DrawingNumbers(dimensions, per_mm, digits),
        own_marks=tuple(marks),
        own_places=own,
        positions=positions,
    )


def _stroke_data(stroke: PlacedStroke, numbers: DrawingNumbers) -> dict[str, Any]:
    """A stroke with its numbers as places; without what is as usual."""

    def plain(value: Any) -> Any:
        if isinstance(value, Vector):
            return numbers.add_point(value)
        if isinstance(value, tuple | list):
            return [plain(part) for part in value]
        if isinstance(value, Enum):
            return value.value
        return value if isinstance(value, str | bool) else numbers.add(value)

    named = isinstance(stroke, PlacedSpring | PlacedTorsionSpring)
    usual = stroke._field_defaults
    own = {name: value for name, value in stroke._asdict().items() if name not in usual or value != usual[name]}
    side = {"side": own.pop("side")} if "side" in own else {}
    return side | {name: plain(value) for name, value in own.items() if named or name != "about"}
