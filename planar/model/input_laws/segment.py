"""What every piece of an input's law offers, and the keys that it is written with."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from math import isfinite
from numbers import Real
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from planar.foundation.argument_types import check_field_types
from planar.foundation.arrays import Array

SHORTEST_DURATION, LONGEST_DURATION = 1e-9, 1e9
"""s: what a piece takes at least and at most, so that no rate of it overflows."""


class SegmentKey(NamedTuple):
    """A key of a piece in a file: the field that it fills, and what its value is.

    `value_kind` is "time", "number", or what of the input it is: "position", "velocity", "acceleration";
    `description` says what it means, for who writes a file.
    """

    field: str
    value_kind: str
    description: str
    is_required: bool = True
    is_list: bool = False


class LawSegment(ABC):
    """One motion of an input, from the place that it has reached on.

    Frozen dataclasses; `motion` is the name in files. All times are in s from where the piece starts, lengths in m,
    angles in rad.
    """

    motion: ClassVar[str]
    description: ClassVar[str]
    "what it does, for who writes a file"
    keys: ClassVar[Mapping[str, SegmentKey]]
    is_lift: ClassVar[bool] = False
    "whether a cam can lift its follower so: by a way of its own, whatever went before"

    if TYPE_CHECKING:  # a field, or made of the fields

        @property
        def duration(self) -> float:
            """How long it takes (s)."""

    def __post_init__(self) -> None:
        check_field_types(self)

    @abstractmethod
    def evaluate(self, t: Array, velocity: float) -> Array:
        """(4, n): the way from where the piece starts, and its three rates, at times (n,) within the piece.

        `velocity` is that at which the piece before ended.
        """

    @abstractmethod
    def end_displacement_and_velocity(self, velocity: float) -> tuple[float, float]:
        """The whole way, and the velocity in the end."""

    @abstractmethod
    def start_velocity(self, velocity: float) -> float:
        """The velocity with which the piece starts."""

    def find_problem(self) -> tuple[str, str] | None:
        """The key whose value cannot be meant, and why."""
        for key, (field, _, _, _, many) in self.keys.items():
            value = getattr(self, field)
            if value is None and getattr(type(self), field, 0.0) is None:
                continue  # left out
            for place, each in ((f"{key}[{i}]", each) for i, each in enumerate(value)) if many else ((key, value),):
                if not _is_number(each):
                    return place, f"a finite number is wanted here, not {each!r:.40}"
        if "in" in self.keys and not self.duration > 0.0:
            return "in", f"a time above zero is wanted here, not {float(self.duration):g} s"
        if "in" in self.keys and not SHORTEST_DURATION <= self.duration <= LONGEST_DURATION:
            return (
                "in",
                f"a piece takes from {SHORTEST_DURATION:g} s to {LONGEST_DURATION:g} s, not {float(self.duration):g} s",
            )
        return None


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and isfinite(value)
