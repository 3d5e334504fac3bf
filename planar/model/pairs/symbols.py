"""What a pair type can say of how it is drawn: pins, blocks on guides, wheels; places in the own axes of links (m)."""

from __future__ import annotations

from typing import NamedTuple

from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar


class PinMark(NamedTuple):
    """A pin through links; `at` is where it goes through each of them."""

    name: str
    links: tuple[str, ...]
    positions: tuple[Vector, ...]


class GuideMark(NamedTuple):
    """A line of a link, through a point in the unit direction `way`, along which a point of another link runs."""

    name: str
    link: str
    through: Vector
    direction: Vector


class SliderMark(NamedTuple):
    """A block that is part of `link`, lies along the unit vector `way` there and slides on a line of link `on`."""

    name: str
    link: str
    position: Vector
    direction: Vector
    guide_link: str


class SlotMark(NamedTuple):
    """A narrow opening along a line of a link; the pin in it is at `at` of `pin`."""

    name: str
    link: str
    through: Vector
    direction: Vector
    pin_link: str
    pin_position: Vector


class WheelMark(NamedTuple):
    """The pitch circle of a wheel that is part of a link; an internal wheel's radius is negative."""

    name: str
    link: str
    centre: Vector
    radius: float


class PitchLineMark(NamedTuple):
    """The pitch line of a rack; `wheel` rolls on it."""

    name: str
    link: str
    through: Vector
    direction: Vector
    wheel: WheelMark


class BeltMark(NamedTuple):
    """A loop round two wheels, whose centres are places of `carrier`; where it is crossed they turn opposite ways."""

    name: str
    first: WheelMark
    second: WheelMark
    carrier: str
    centres: tuple[Vector, Vector]
    crossed: bool


class CamMark(NamedTuple):
    """A cam: its profile, points of `link`, about its `centre`; and the face of its follower `follower_link`.

    A roller of this radius about `middle`, or a flat face along the points `face` of a line (else empty), or a point.
    """

    name: str
    link: str
    centre: Vector
    profile: tuple[Vector, ...]
    follower_link: str
    middle: Vector
    roller_radius: float
    face: tuple[Vector, ...]


class OutlineMark(NamedTuple):
    """The outline of a body that is part of a link."""

    name: str
    link: str
    points: tuple[Vector, ...]
    closed: bool


class CurvedSlotMark(NamedTuple):
    """A curved slot of a link, in place of the pin at its centre.

    `directions` are unit vectors from the centre along the slot, anticlockwise; `closed` says that it is a ring.
    `centre_points` are the points (link, point) at the centre, which are not drawn.
    """

    name: str
    link: str
    centre: Vector
    radius: Scalar
    directions: tuple[Vector, ...]
    closed: bool
    centre_points: tuple[tuple[str, str], ...]

    def places(self, offset: Scalar = 0.0) -> tuple[Vector, ...]:
        """Places along the slot in the link's axes, `offset` (m) outside its middle line."""
        return tuple(self.centre + out * (self.radius + offset) for out in self.directions)


DrawingMark = (
    PinMark
    | GuideMark
    | SliderMark
    | SlotMark
    | CurvedSlotMark
    | WheelMark
    | PitchLineMark
    | BeltMark
    | CamMark
    | OutlineMark
)
