"""A task: what a linkage must do, as immutable data in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from planar.foundation.arrays import Array
from planar.foundation.short_repr import short_repr
from planar.model.file_units import FileUnits
from planar.model.mechanism import Mechanism
from planar.model.wording import count_phrase


class WantedPath(NamedTuple):
    """`places` (n, 2) in the frame's axes (m) that a `point` is to come to.

    `inputs` (n,) are where the running input is there (rad or m), None where that is left open; unless `is_absolute`
    they count by their differences. `in_order`: the places are met one after the other, either way. `is_closed`: they
    lie round a closed curve. A miss counts by its `weights` (n,); one greater than the `tolerance` (m) is a defect, any
    but round-off where that is 0.
    `link` carries the point, where a start lacks it.
    """

    point: str
    places: Array
    inputs: Array | None
    weights: Array
    in_order: bool = False
    is_closed: bool = False
    is_absolute: bool = False
    tolerance: float | None = None
    link: str | None = None

    @property
    def of(self) -> str:
        """What is to come there."""
        return self.point

    def __repr__(self) -> str:
        return short_repr(self)


class WantedPoses(NamedTuple):
    """Poses that a `link` is to take: `places` (n, 2) of its origin in the frame's axes (m), and `angles` (n,) (rad).

    `inputs`, `weights`, `in_order`, `is_absolute` and `tolerance` (m) are as of a path; an angle is missed by as much
    as the length by which it turns the extent of what is wanted.
    """

    link: str
    places: Array
    angles: Array
    inputs: Array | None
    weights: Array
    in_order: bool = False
    is_absolute: bool = False
    tolerance: float | None = None

    @property
    def of(self) -> str:
        """What is to come there."""
        return self.link

    def __repr__(self) -> str:
        return short_repr(self)


class WantedFunction(NamedTuple):
    """Positions `values` (n,) of the pair `to_pair` at positions `inputs` (n,) of the input `from_pair`, rad or m.

    Unless `is_absolute` both count by their differences, so that the zeros of both scales are free. A miss counts by
    its `weights` (n,); one greater than the `tolerance` is a defect, any but round-off where
    that is 0.
    """

    from_pair: str
    to_pair: str
    inputs: Array
    values: Array
    weights: Array
    is_absolute: bool = False
    tolerance: float | None = None

    @property
    def of(self) -> str:
        """What is to come there."""
        return self.to_pair

    def __repr__(self) -> str:
        return short_repr(self)


Wanted = WantedPath | WantedPoses | WantedFunction


class Demands(NamedTuple):
    """What a design must keep besides: see the keys of a task's `demands`."""

    whole_turn: bool = False
    "the running input turns fully"
    transmission: float | None = None
    "rad: the least transmission angle of any output"
    inside: Array | None = None
    "(n, 2) m: corners of a polygon that all points stay in"
    one_branch: bool = False
    "all that is wanted is met without passing a dead point"


class ChainStart(NamedTuple):
    """All kinematic chains of these numbers of links, with every fixed link and input that differ."""

    links: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class SynthesisTask:
    """What a linkage must do, and the linkages to start from.

    `wanted` are paths, poses and functions, `starts` mechanisms or chains, `demands` what is to be kept besides, and
    `units` those of the file. `free` are names of numbers that are sought, all where it is empty; `within` bounds
    numbers by name (SI).
    """

    name: str
    wanted: tuple[Wanted, ...]
    starts: tuple[Mechanism, ...] | ChainStart
    free: tuple[str, ...] = ()
    within: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    demands: Demands = field(default_factory=Demands)
    units: FileUnits = field(default_factory=FileUnits)

    def __repr__(self) -> str:
        return f"<SynthesisTask {self.name!r}: {count_phrase(self.entry_count, 'wanted entry', 'wanted entries')}>"

    @property
    def wants_places(self) -> bool:
        """Whether places are wanted, so that a miss may be seen beside their extent."""
        return any(not isinstance(item, WantedFunction) for item in self.wanted)

    @property
    def needs_whole_turn(self) -> bool:
        """Whether the running input is to turn fully: where that is demanded, and round closed curves."""
        closed = any(isinstance(item, WantedPath) and item.is_closed for item in self.wanted)
        return closed or self.demands.whole_turn

    @property
    def exact(self) -> tuple[Wanted, ...]:
        """What is to be met exactly: items with no tolerance for a miss."""
        return tuple(item for item in self.wanted if item.tolerance == 0.0)

    @property
    def entry_count(self) -> int:
        """How many places, poses and pairs are wanted together."""
        return sum(len(item.weights) for item in self.wanted)
