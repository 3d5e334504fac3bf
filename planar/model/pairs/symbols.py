"""What a pair type can say of how it is drawn: pins, blocks on guides, wheels; places in the own axes of links (m)."""

from __future__ import annotations

from typing import NamedTuple

from planar.foundation.geometry import Vector


class Pin(NamedTuple):
    """A pin through links; `at` is where it goes through each of them."""

    name: str
    links: tuple[str, ...]
    at: tuple[Vector, ...]


class Guide(NamedTuple):
    """A line of a link, through a point in the unit direction `way`, along which a point of another link runs."""

    name: str
    link: str
    through: Vector
    way: Vector


class Block(NamedTuple):
    """A block that is part of `link`, lies along the unit vector `way` there and slides on a line of link `on`."""

    name: str
    link: str
    at: Vector
    way: Vector
    on: str


class Opening(NamedTuple):
    """A narrow opening along a line of a link; the pin in it is at `at` of `pin`."""

    name: str
    link: str
    through: Vector
    way: Vector
    pin: str
    at: Vector


class Wheel(NamedTuple):
    """The pitch circle of a wheel that is part of a link; an internal wheel's radius is negative."""

    name: str
    link: str
    centre: Vector
    radius: float


class PitchLine(NamedTuple):
    """The pitch line of a rack; `wheel` rolls on it."""

    name: str
    link: str
    through: Vector
    way: Vector
    wheel: Wheel


class Band(NamedTuple):
    """A loop round two wheels; where it is crossed they turn opposite ways."""

    name: str
    first: Wheel
    second: Wheel
    crossed: bool


Mark = Pin | Guide | Block | Opening | Wheel | PitchLine | Band
