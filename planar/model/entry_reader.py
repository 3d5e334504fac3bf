"""What reads and writes the entries of mechanism files, as links and pairs see it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol


class QuantityWriter(Protocol):
    """Writes an SI number in the units of a file: a quantity of this kind, a plain "number", or a whole one, a "count".

    Every number of an entry goes through it, so that the number has a name (see `planar.document.dimensions`).
    """

    def __call__(self, value: float, kind: str) -> float | str: ...


class EntryReader(Protocol):
    """An object of a mechanism file under a reader that knows its place and units."""

    @property
    def frame(self) -> str:
        """The link that is the mechanism's frame."""

    def has(self, key: str) -> bool:
        """Whether the object has this key."""

    def number(self, key: str) -> float:
        """A number without a unit."""

    def check_keys(self, *keys: str) -> None:
        """Refuse any key but these."""

    def name(self, key: str) -> str:
        """A new name."""

    def quantity(self, key: str, kind: str, default: float | None = None) -> float:
        """A number in SI; `default` where the key is left out."""

    def names(self, key: str, count: int) -> tuple[str, ...]:
        """So many names."""

    def links(self, key: str) -> tuple[str, ...]:
        """Two or more different links of the mechanism."""

    def two_links(self, key: str) -> tuple[str, str]:
        """Two different links of the mechanism."""

    def quantities(self, key: str, kind: str, count: int) -> tuple[float, ...]:
        """So many numbers in SI."""

    def quantity_lists(self, key: str, kind: str, count: int) -> tuple[tuple[float, ...], ...]:
        """Lists of so many numbers in SI."""

    def whole_numbers(self, key: str, count: int) -> tuple[float, ...]:
        """So many whole numbers."""

    def counted_angle(self, key: str) -> float:
        """An angle (rad) that may count turns, not so many that nothing is left of the angle."""

    def flag(self, key: str) -> bool:
        """True or false; false where the key is left out."""

    def links_with_point(self, point: str) -> tuple[str, ...]:
        """All links that carry a point of this name, the frame first."""

    def point(self, key: str, link: str) -> str:
        """A point that the link carries."""

    def check_point_on_link(self, point: str, link: str, key: str) -> None:
        """Refuse, at the key, a point that the link does not carry."""

    def point_reference(self, key: str, link: str) -> str | tuple[float, float]:
        """A point of the link by name, or by coordinates."""

    def fields(self) -> Mapping[str, Any]:
        """The members of the object."""

    def link(self, key: str) -> str:
        """A link of the mechanism."""

    def check_distinct_points(
        self, key: str, link: str, first: str | tuple[float, float], second: str | tuple[float, float]
    ) -> None:
        """Refuse, at the key, two places of a link that coincide."""

    def object_at(self, key: str) -> EntryReader:
        """The object under this key."""

    def list_items(self, key: str) -> Sequence[EntryReader]:
        """The items of the list under this key; none where it is left out."""

    def text(self, key: str, default: str | None = None) -> str | None:
        """A text; `default` where the key is left out."""

    def choice(self, key: str, words: tuple[str, ...]) -> str | None:
        """One of some words; None where the key is left out."""

    def error_at(self, key: str | None, sentence: str) -> Exception:
        """The error that says this of the place."""
