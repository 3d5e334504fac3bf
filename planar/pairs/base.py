"""What a pair type says of itself: its data, its residual, its drive, how it is written, a sample of it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, NamedTuple, Protocol, Self

from planar.algebra import Scalar
from planar.plane import Frame
from planar.shapes import Shape


class Kind(Enum):
    """What a number or an equation measures, and so how it scales and closes."""

    LENGTH = "length"
    ANGLE = "angle"
    """An angle that closes modulo a whole turn."""
    TURNS = "turns"
    """An angle in which whole turns count."""
    PURE = "pure"


@dataclass(frozen=True)
class Pair(ABC):
    """Two links joined so that some relative motions are prevented.

    A pair type is one file of this folder. Its `residual` is written with + - * alone, so the same lines
    serve floats, arrays, symbols and jets; Jacobian, velocity, acceleration and reactions are derived from it.
    """

    name: str
    links: tuple[str, str]

    keyword: ClassVar[str]
    """The key that marks the type in a mechanism file."""
    constrains: ClassVar[tuple[Kind, ...]]
    """What each entry of the residual measures."""
    coordinates: ClassVar[tuple[tuple[str, Kind], ...]] = ()
    """Coordinates of its own that the residual needs beside the two frames."""
    measures: ClassVar[tuple[Kind, ...]]
    """What each number that `measure` takes from the two shapes is."""
    reports: ClassVar[Mapping[str, str]]
    """The names of its results, in order, and the kind of quantity that each is."""
    drive_kind: ClassVar[Kind]
    """Whether its input is an angle or a length."""

    @abstractmethod
    def measure(self, first: Shape, second: Shape) -> Sequence[Scalar]:
        """The numbers of the two links that the residual needs (m, rad)."""

    @abstractmethod
    def residual(
        self, first: Frame, second: Frame, numbers: Sequence[Scalar], own: Sequence[Scalar]
    ) -> Sequence[Scalar]:
        """Zero where the pair is closed, an entry per constraint."""

    @abstractmethod
    def drive(self, first: Frame, second: Frame, numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The relative motion that an input here prescribes (rad or m)."""

    @abstractmethod
    def report(self, position: float, rate: float, second: float) -> dict[str, float | None]:
        """Its results by name, from its drive and the drive's derivatives (SI)."""

    def coincident(self) -> tuple[tuple[str, str], ...]:
        """The (link, point) that lie on one another in this pair, so that they bear its name."""
        return ()

    def rides(self) -> tuple[tuple[str, str], str] | None:
        """((link, point), link): a point of one link that moves along a line of another, if it does."""
        return None

    def ahead(self, drive: float) -> bool:
        """Whether this is the assembly that an author means who says nothing (a slide ahead of `through`)."""
        return True

    @classmethod
    def rewrite(cls, entry: Entry) -> Rewritten | None:
        """A short form of the entry in full; None where it is no short form."""
        return None

    @classmethod
    @abstractmethod
    def read(cls, entry: Entry) -> tuple[Self, ...]:
        """The pairs that one entry of a file describes."""

    @classmethod
    @abstractmethod
    def write(cls, group: Sequence[Self], quantity: Quantity) -> dict[str, Any]:
        """The entry that describes the pairs which one entry was read into."""

    def entry_name(self) -> str:
        """The name of the file's entry that this pair comes from."""
        return self.name

    @classmethod
    def motions(cls, group: Sequence[Self]) -> tuple[Self, ...]:
        """Every relative motion of an entry's links that has a name, as pairs."""
        return tuple(group)

    @classmethod
    @abstractmethod
    def samples(cls) -> tuple[Sample, ...]:
        """Small closed configurations, in general position, on which every law is tried."""


class Rewritten(NamedTuple):
    """A short entry in full, the links that it brings, and the entry of the pair that is to join these.

    Where the file has an entry of that type and name already, the links are added to it instead.
    """

    entry: dict[str, Any]
    links: dict[str, Any]
    joined_by: dict[str, Any]


class Sample(NamedTuple):
    """A pair closed between two links, with everything that its formulas need."""

    pair: Pair
    shapes: tuple[Shape, Shape]
    frames: tuple[Frame, Frame]
    own: tuple[float, ...]
    entry: dict[str, Any]
    """The pair as a file has it."""


class Quantity(Protocol):
    """Writes an SI number in the units of a file."""

    def __call__(self, value: float, kind: str) -> float | str: ...


class Entry(Protocol):
    """An object of a mechanism file under a reader that knows its place and units."""

    def has(self, key: str) -> bool:
        """Whether the object has this key."""

    def only(self, *keys: str) -> None:
        """Refuse any key but these."""

    def name(self, key: str) -> str:
        """A new name."""

    def quantity(self, key: str, kind: str, default: float | None = None) -> float:
        """A number in SI; `default` where the key is left out."""

    def names(self, key: str, count: int) -> tuple[str, ...]:
        """So many names."""

    def links(self, key: str) -> tuple[str, ...]:
        """Two or more different links of the mechanism."""

    def carriers(self, point: str) -> tuple[str, ...]:
        """All links that carry a point of this name, the frame first."""

    def point(self, key: str, link: str) -> str:
        """A point that the link carries."""

    def carried(self, point: str, link: str, key: str) -> None:
        """Refuse, at the key, a point that the link does not carry."""

    def place(self, key: str, link: str) -> str | tuple[float, float]:
        """A point of the link by name, or by coordinates."""

    def fields(self) -> Mapping[str, Any]:
        """The members of the object."""

    def link(self, key: str) -> str:
        """A link of the mechanism."""

    def distinct(
        self, key: str, link: str, first: str | tuple[float, float], second: str | tuple[float, float]
    ) -> None:
        """Refuse, at the key, two places of a link that coincide."""

    def inside(self, key: str) -> Entry:
        """The object under this key."""

    def refuse(self, key: str | None, sentence: str) -> Exception:
        """The error that says this of the place."""
