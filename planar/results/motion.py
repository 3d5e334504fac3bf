"""The results of one position and of a run: State and Motion, arrays with names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.geometry import Frame, frame_at
from planar.foundation.jets import Jet, value_and_rates
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, NamedPoint
from planar.model.pairs import MeasureKind
from planar.model.wording import AT_REST, NOT_TURNING, direction_sense, speed_trend, turning_sense
from planar.results.kinematic_result import KinematicResult
from planar.results.records import (
    InputMotion,
    InputState,
    Limit,
    LinkMotion,
    LinkState,
    PointMotion,
    PointState,
    ThirdRates,
    principal_angle,
    scales,
    stack_vectors,
    third_rate,
    vector_and_rates,
)


@dataclass(frozen=True)
class State(KinematicResult):
    """One position of a mechanism, solved.

    `mobility` is the true one, by rank; `residual` is what the worst constraint leaves open, in lengths of the
    mechanism's size; `remarks` are what there is to say of how the position was found.
    """

    mechanism: Mechanism
    mobility: int
    residual: float
    remarks: tuple[str, ...]
    frames: Mapping[str, Frame]
    "of every link, as jets: each entry with its first and second time derivative (m, rad, s)"
    own: Mapping[str, tuple[Jet, ...]]
    "every pair's own coordinates, as jets"
    shapes: Mapping[str, LinkShape]

    def __repr__(self) -> str:
        at = [self._format_input_position(given.pair, given.position) for given in self.mechanism.inputs]
        return f"<State of {self.mechanism.name!r}{' at ' if at else ''}{', '.join(at)}>"

    @property
    def points(self) -> dict[str, PointState]:
        """Every point under its result name."""
        return {each.name: self._point_state(each) for each in self._points}

    @property
    def links(self) -> dict[str, LinkState]:
        """Every link, the frame among them."""
        return {link.name: self.link(link.name) for link in self.mechanism.links}

    @property
    def inputs(self) -> dict[str, InputState]:
        """Every input by its pair."""
        return {
            given.pair: InputState(given.position, given.velocity, given.acceleration)
            for given in self.mechanism.inputs
        }

    @property
    def pairs(self) -> dict[str, dict[str, float | None]]:
        """What every pair reports, by name; of a pin of n links, every two of them."""
        return {name: self.pair(name) for name in self._relative_motions}

    def point(self, name: str) -> PointState:
        """A point by its result name, or as `link.point`. Raises Unknown."""
        return self._point_state(self._find_point(name))

    def link(self, name: str) -> LinkState:
        """A link by name; its angle between -pi and pi, or with its turns where a pair counts them. Raises
        Unknown."""
        angle, velocity, acceleration = map(float, value_and_rates(self._frame(name).angle))
        fastest, hardest = self.scales_of_links
        sense = _describe_sense(turning_sense(velocity, fastest), velocity * acceleration, abs(velocity) * hardest)
        return LinkState(
            angle if name in self._links_counting_turns else principal_angle(angle), velocity, acceleration, sense
        )

    def pair(self, name: str) -> dict[str, float | None]:
        """What a pair reports of its relative motion (SI). Raises Unknown."""
        pair, parts = self._find_relative_motion(name)
        position, rate, second = map(float, parts)
        return pair.results(position + self._turns_of_pair(name, position), rate, second)

    def _point_state(self, named: NamedPoint) -> PointState:
        position, velocity, acceleration = (
            stack_vectors(*part) for part in vector_and_rates(self._point_position(named))
        )
        fastest, hardest = self.scales_of_points
        scale = float(np.hypot(*velocity)) * hardest
        sense = _describe_sense(direction_sense(velocity, fastest), float(velocity @ acceleration), scale)
        return PointState(position, velocity, acceleration, sense)

    @cached_property
    def _scales(self) -> tuple[tuple[float, float], tuple[float, float]]:
        points = [vector_and_rates(self._point_position(each)) for each in self._points]
        return scales(
            np.array(points).reshape(-1, 3, 2), np.array([value_and_rates(f.angle) for f in self.frames.values()])
        )

    @property
    def scales_of_points(self) -> tuple[float, float]:
        """The greatest velocity and acceleration of points (m/s, m/s^2), beside which others are at rest."""
        return self._scales[0]

    @property
    def scales_of_links(self) -> tuple[float, float]:
        """The greatest angular velocity and acceleration of links (rad/s, rad/s^2), beside which others are at rest."""
        return self._scales[1]


class FollowedPath(Protocol):
    """The curve of positions that a motion runs along."""

    singular_rows: frozenset[int]
    """Rows on a change point, or so near one that their rates are those of the branch that was followed."""

    fork_positions: tuple[float, ...]
    """Positions of the running input (rad or m) at which another way was taken than the smooth one."""

    @property
    def unknowns(self) -> Array | None:
        """The unknowns of the solver at the rows (rows, unknowns); None where they were not kept."""

    def limits(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""


class RecordedPath(NamedTuple):
    """What is known of the path of a motion that came from another process, or is a copy."""

    singular_rows: frozenset[int]
    fork_positions: tuple[float, ...]
    known_limits: tuple[Limit, ...]
    unknowns: Array | None = None

    def limits(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""
        return self.known_limits


@dataclass(frozen=True)
class Motion(KinematicResult):
    """A run of positions of a mechanism, n of them, in the order in which its inputs run through them.

    `outcome` is solved where the run came to its end, else why it stopped, which `reason` says in a sentence;
    `residual` is what the worst constraint leaves open at any position, in lengths of the mechanism's size. `time` (s)
    is there where the inputs run by laws of time, `jerked` where third rates were asked for. `rate_remarks` are those
    of the remarks that say which rows have no rates, or rates of few digits.
    """

    mechanism: Mechanism
    inputs: Mapping[str, InputMotion]
    outcome: Outcome
    reason: str
    residual: float
    remarks: tuple[str, ...]
    frames: Mapping[str, Frame]
    "of every link, as jets of arrays (n,)"
    own: Mapping[str, tuple[Jet, ...]]
    shapes: Mapping[str, LinkShape]
    time: Array | None = None
    jerked: ThirdRates | None = None
    course: FollowedPath | None = None
    rate_remarks: tuple[str, ...] = ()

    def __repr__(self) -> str:
        ends = [
            f"{self._format_input_position(name, float(given.position[0]))} to "
            f"{self._format_input_position(name, float(given.position[-1]))}"
            for name, given in self.inputs.items()
        ]
        return f"<Motion of {self.mechanism.name!r}: {len(self)} positions, {', '.join(ends)}; {self.outcome.value}>"

    @cached_property
    def limits(self) -> tuple[Limit, ...]:
        """Where an input or an output of the motion turns back, or branches cross, in the order of the rows.

        Solved for when first asked for. Outputs are all slides, and all links pinned to the frame. Of a motion there
        and back they are those of the way there.
        """
        return tuple(map(self._limit_with_turns, self.course.limits(self))) if self.course else ()

    def _limit_with_turns(self, limit: Limit) -> Limit:
        """A limit whose angle is one as positions have it (see `principal_turns`)."""
        if limit.kind != "stroke end" or limit.of not in self._relative_motions:
            return limit
        position = np.atleast_1d(self._find_relative_motion(limit.of)[1][0])
        return limit._replace(value=limit.value + self._turns_of_limit(limit.of, position))

    def __getstate__(self) -> dict[str, Any]:
        """With its limits solved for, in place of the compiled equations that would solve for them."""
        state = {each.name: getattr(self, each.name) for each in fields(self)}
        if self.course is not None:
            path = self.course
            state["course"] = RecordedPath(path.singular_rows, path.fork_positions, path.limits(self), path.unknowns)
        return state

    def up_to_row(self, row: int) -> Motion:
        """The rows up to one, and that."""
        many = slice(row + 1)

        def cut(jet: Any) -> Any:
            return (
                Jet(*(np.broadcast_to(part, (len(self),))[many] for part in jet.parts)) if isinstance(jet, Jet) else jet
            )

        frames = {
            name: frame if frame.fixed else frame_at(cut(frame.x), cut(frame.y), cut(frame.angle))
            for name, frame in self.frames.items()
        }
        return replace(
            self,
            inputs={name: InputMotion(*(part[many] for part in given)) for name, given in self.inputs.items()},
            frames=frames,
            own={name: tuple(map(cut, each)) for name, each in self.own.items()},
            time=None if self.time is None else self.time[many],
            jerked=None,
        )

    def __len__(self) -> int:
        return len(next(iter(self.inputs.values())).position if self.time is None else self.time)

    @property
    def points(self) -> dict[str, PointMotion]:
        """Every point under its result name."""
        return {each.name: self._point_motion(each) for each in self._points}

    @property
    def links(self) -> dict[str, LinkMotion]:
        """Every link, the frame among them."""
        return {link.name: self.link(link.name) for link in self.mechanism.links}

    @property
    def pairs(self) -> dict[str, dict[str, Array | None]]:
        """What every pair reports, by name."""
        return {name: self.pair(name) for name in self._relative_motions}

    def point(self, name: str) -> PointMotion:
        """A point by its result name, or as `link.point`. Raises Unknown."""
        return self._point_motion(self._find_point(name))

    def link(self, name: str) -> LinkMotion:
        """A link by name. Its angle starts between -pi and pi unless a pair counts its turns. Raises Unknown."""
        angle, velocity, acceleration = self._broadcast_rows(value_and_rates(self._frame(name).angle))
        if name not in self._links_counting_turns:
            angle = angle - (angle[0] - principal_angle(float(angle[0])))
        return LinkMotion(angle, velocity, acceleration)

    def jerk(self, point: str) -> Array:
        """A point's third rate (n, 2) (m/s^3). Raises Unknown, and BadInput where the motion was made without."""
        link, own = self._find_point(point).members[0]
        place = self._require_jerks().frames[link].to_world(self.shapes[link].position(own))
        return np.stack(self._broadcast_rows((third_rate(place.x), third_rate(place.y))), axis=1)

    def angular_jerk(self, link: str) -> Array:
        """A link's third rate (n,) (rad/s^3). Raises Unknown, and BadInput where the motion was made without."""
        self._frame(link)
        return self._broadcast_rows((third_rate(self._require_jerks().frames[link].angle),))[0]

    def _require_jerks(self) -> ThirdRates:
        if self.jerked is None:
            raise BadInput("jerk", "third rates are there where the motion is made with jerk=True")
        return self.jerked

    def pair(self, name: str) -> dict[str, Array | None]:
        """What a pair reports at every position, each (n,) (SI). An angle starts as a link's. Raises Unknown."""
        pair, parts = self._find_relative_motion(name)
        position, velocity, acceleration = self._broadcast_rows(parts)
        return pair.results(position + self._turns_of_pair(name, float(position[0])), velocity, acceleration)

    def result_kinds(self, name: str) -> Mapping[str, str]:
        """What a pair reports, and the kind of quantity that each is."""
        return self._relative_motions[name].result_kinds

    def input_quantity_kinds(self, name: str) -> tuple[str, str, str]:
        """The kinds of quantity of an input's position, velocity and acceleration."""
        return self._relative_motions[name].input_quantity_kinds()

    def has_length_motion(self, name: str) -> bool:
        """Whether the relative motion at a pair is a length."""
        return self._relative_motions[name].input_kind is MeasureKind.LENGTH

    @property
    def running_input(self) -> str:
        """The input that runs farthest."""
        return max(self.inputs, key=lambda name: float(np.ptp(self.inputs[name].position)))

    def _broadcast_rows(self, parts: tuple[Any, ...]) -> tuple[Array, ...]:
        return tuple(np.broadcast_to(part, (len(self),)).copy() for part in parts)

    def _point_motion(self, named: NamedPoint) -> PointMotion:
        x, y = (self._broadcast_rows(value_and_rates(each)) for each in self._point_position(named))
        return PointMotion(*(np.stack(both, axis=1) for both in zip(x, y, strict=True)))


def _describe_sense(way: str, power: float, scale: float) -> str:
    return way if way in (AT_REST, NOT_TURNING) else f"{way}, {speed_trend(power, scale)}"
