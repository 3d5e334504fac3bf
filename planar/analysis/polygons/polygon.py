"""The velocity and acceleration polygons of a position, in the order in which a pencil can draw them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from planar.foundation.arrays import Array
from planar.foundation.short_repr import short_repr
from planar.results.motion import State


class VectorPart(Enum):
    """What part of a relative velocity or acceleration a vector is."""

    ROTATION = "rotation"
    """A relative velocity of two points of one link."""
    CENTRIPETAL = "centripetal"
    TANGENTIAL = "tangential"
    SLIDING = "along a slide"
    """A relative velocity or acceleration along the line of a sliding pair."""
    CORIOLIS = "Coriolis"


class PolygonVector(NamedTuple):
    """One row of a vector table: the velocity (m/s) or acceleration (m/s^2) of point `of` relative to `against`.

    `tail` and `head` are letters of the polygon. Its magnitude is `known` before the polygon is drawn or not; where it
    is, it is made of `factors`, else its direction alone is known. `line` is what it is parallel or square to.
    """

    part: VectorPart
    of: str
    "name of a point in the space diagram: B"
    against: str
    tail: str
    head: str
    value: Array
    "(2,)"
    known: bool
    is_perpendicular: bool
    "its direction is square to `line`, else parallel"
    line: str
    "AB, or `line of motion of B`; empty where it is already drawn"
    factors: tuple[Factor, ...] = ()
    "of which the magnitude is made"
    towards: str = ""
    "the sense where it is known: the point (A) or the letter (a) that it points to, else words"

    def __repr__(self) -> str:
        return short_repr(self)


class Factor(NamedTuple):
    """A number in a formula of a magnitude: (ab)²/AB has ab to the power 2 and AB to the power -1."""

    symbol: str
    value: float
    "SI"
    power: int = 1
    kind: str = "length"
    "length, velocity, angular velocity, angular acceleration, or pure"


class PointImage(NamedTuple):
    """Points of a link by their images: on a line in a ratio, or by a triangle similar to that of the link."""

    link: str
    base: tuple[str, str]
    "two points whose letters are drawn"
    point: str
    ratio: float
    "of the distances base[0]-point and base[0]-base[1] with the sign of a point beyond; of a triangle: of its size"
    sense: str
    "`clockwise` or `anticlockwise`: how base and point are read; empty on a line; `same` where all have one letter"


class MeetingSide(NamedTuple):
    """One way to a point: from a letter that is drawn, vector after vector, the unknown one last."""

    start: str
    vectors: tuple[PolygonVector, ...]


class Meeting(NamedTuple):
    """One or two ways to a point. Of two, the lines of their last vectors meet in it.

    A second side without vectors: the point is drawn already, and joined to the first side.
    """

    links: tuple[str, ...]
    point: str
    letter: str
    sides: tuple[MeetingSide, ...]


class LoopEquation(NamedTuple):
    """One component of a vector equation round a loop: sum of coefficient times unknown = known (SI)."""

    loop: tuple[str, ...]
    "the points round which it goes"
    axis: str
    "x or y; `turns` of what ties rates by a pair, which `loop` names"
    terms: tuple[tuple[str, float], ...]
    "unknown (ω_BC, v_D/D′) and its coefficient"
    known: float


class SolvedRate(NamedTuple):
    """A rate that equations give (SI): of a link that turns, or along a line."""

    name: str
    value: float
    is_angular: bool


class SimultaneousSolution(NamedTuple):
    """A group that no two lines locate: its equations and the unknowns that solve them."""

    links: tuple[str, ...]
    equations: tuple[LoopEquation, ...]
    unknowns: tuple[SolvedRate, ...]
    letters: tuple[str, ...]
    "that are found by it"


class TurningRate(NamedTuple):
    """How fast a link turns, read from the polygon: ω_BC = bc / BC, α_BC = c_b c1 / BC (SI, anticlockwise positive)."""

    link: str
    value: float
    sense: str
    vector: tuple[str, str] = ("", "")
    "tail and head of what is measured; empty where it is known otherwise"
    magnitude: float = 0.0
    line: str = ""
    "the length by which it is divided"
    length: float = 0.0
    by: str = ""
    "the input, or the pair, from which it is known otherwise"


DrawingStage = Meeting | PointImage | SimultaneousSolution | TurningRate


@dataclass(frozen=True)
class Polygon:
    """A velocity or an acceleration polygon: letters and where they are, measured from the pole (m/s or m/s^2)."""

    state: State
    kind: str
    "velocity or acceleration"
    pole: tuple[str, ...]
    "letters of what is fixed: o, g, q"
    letters: dict[str, Array]
    "every letter, those of heads of parts (b_a) included"
    points: dict[str, str]
    "the point of the space diagram for each letter that is no head of a part"
    stages: tuple[DrawingStage, ...]
    "in the order of drawing"
    points_underneath: Mapping[str, tuple[str, str]]
    "for each letter of a point that has no name in the mechanism its link, and the point of another that it lies at"

    __repr__ = short_repr
