"""Solved positions as arrays with names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from planar.foundation.errors import BadInput, Outcome, join_names
from planar.foundation.geometry import Frame, Vector, frame_at
from planar.foundation.jets import Jet, value_and_rates
from planar.foundation.notebook_display import Displayable
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, NamedPoint, links_counting_turns, named_points, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import amount, direction_sense, speed_trend, turning_sense
from planar.results.records import (
    InputMotion,
    InputState,
    Limit,
    LinkMotion,
    LinkState,
    PointMotion,
    PointState,
    RelativeState,
    ThirdRates,
    principal_turns,
    rotate_quarter_turn,
    scales,
    stack_vectors,
    third_rate,
    vector_and_rates,
    wrap_angle,
)

Array = np.ndarray


class UnknownName(KeyError):
    """A name that the mechanism does not have."""

    def __str__(self) -> str:
        return str(self.args[0])


class KinematicResult(Displayable):
    """What a position and a motion have in common: links, points and pairs by name, from frames that are jets."""

    mechanism: Mechanism
    frames: Mapping[str, Frame]
    own: Mapping[str, tuple[Jet, ...]]
    shapes: Mapping[str, LinkShape]

    def _format_input_position(self, pair: str, position: float) -> str:
        """A position of an input in the file's units: A = 60 deg."""
        return f"{pair} = {amount(position, self._relative_motions[pair].input_kind.value, self.mechanism.units)}"

    @cached_property
    def _points(self) -> tuple[NamedPoint, ...]:
        return named_points(self.mechanism)

    @cached_property
    def _point_names(self) -> dict[str, NamedPoint]:
        """Every way to write a point: as `link.point`, or by the name that results give it."""
        under_links = {f"{link}.{point}": each for each in self._points for link, point in each.members}
        return under_links | {each.name: each for each in self._points}

    @cached_property
    def _links_counting_turns(self) -> frozenset[str]:
        return links_counting_turns(self.mechanism)

    @cached_property
    def _relative_motions(self) -> Mapping[str, Pair]:
        return relative_motions(self.mechanism)

    def _turns_of_pair(self, name: str, position: float) -> float:
        """The whole turns (rad) from a pair's first angle to the one told, of an input its own; of a length 0."""
        pair = self._relative_motions[name]
        if pair.input_kind is not MeasureKind.ANGLE or self._links_counting_turns.issuperset(pair.links):
            return 0.0
        if name in self.inputs:
            started = float(np.ravel(self.inputs[name].position)[0])
            return 2.0 * np.pi * round((started - position) / (2.0 * np.pi))
        return wrap_angle(position) - position

    def _turns_of_limit(self, name: str, positions: Array) -> float:
        """The whole turns (rad) by which the angle at a pair is told off these of its unknown; of a length 0."""
        pair = self._relative_motions[name]
        if (
            pair.input_kind is not MeasureKind.ANGLE
            or name in self.inputs
            or self._links_counting_turns.issuperset(pair.links)
        ):
            return self._turns_of_pair(name, float(positions[0]))
        return principal_turns(positions)

    @property
    def point_names(self) -> tuple[str, ...]:
        """The names that results give the points."""
        return tuple(each.name for each in self._points)

    def _frame(self, link: str) -> Frame:
        if link not in self.frames:
            raise UnknownName(f"there is no link {link!r}; links are {join_names(self.frames)}")
        return self.frames[link]

    def _find_relative_motion(self, name: str) -> tuple[Pair, ValueAndRates]:
        """A pair, and the relative motion that its results are of."""
        if name not in self._relative_motions:
            raise UnknownName(f"there is no pair {name!r}; pairs are {join_names(self._relative_motions)}")
        pair = self._relative_motions[name]
        numbers = pair.measure([self.shapes[link] for link in pair.bodies])
        frames = [self.frames[link] for link in pair.bodies]
        return pair, value_and_rates(pair.input_position(frames, numbers, self.own.get(pair.name, ())))

    def relative(self, point: str, other: str, axes: str | None = None) -> RelativeState:
        """How `point` moves against `other`, in the axes of a link.

        `axes` left out: the link that carries both points, else the link on whose line one of them slides while it
        carries the other. Raises UnknownName where there is no such link and none is named.
        """
        p, q = self._find_point(point), self._find_point(other)
        axes = axes or self._default_axes(p, q)
        frame = self._frame(axes)
        r = [stack_vectors(*parts) for parts in vector_and_rates(self._point_position(p) - self._point_position(q))]
        _, omega, alpha = (np.asarray(part)[..., None] for part in value_and_rates(frame.angle))
        local = [
            stack_vectors(*parts)
            for parts in vector_and_rates(self._point_in_link(p, axes) - self._point_in_link(q, axes))
        ]
        cos, sin = (np.asarray(value_and_rates(each)[0])[..., None] for each in (frame.cos, frame.sin))
        sliding, sliding_acceleration = (cos * each + sin * rotate_quarter_turn(each) for each in local[1:])
        return RelativeState(
            axes=axes,
            position=r[0],
            velocity=r[1],
            rotation=omega * rotate_quarter_turn(r[0]),
            sliding=sliding,
            acceleration=r[2],
            centripetal=-(omega**2) * r[0],
            tangential=alpha * rotate_quarter_turn(r[0]),
            coriolis=2.0 * omega * rotate_quarter_turn(sliding),
            sliding_acceleration=sliding_acceleration,
        )

    def _point_in_link(self, named: NamedPoint, link: str) -> Vector:
        """Where a point lies in a link's axes; exactly at rest there if the link carries it."""
        point = dict(named.members).get(link)
        return (
            self.frames[link].to_local(self._point_position(named))
            if point is None
            else self.shapes[link].position(point)
        )

    def _default_axes(self, p: NamedPoint, q: NamedPoint) -> str:
        carrying = [link for link, _ in p.members if any(link == other for other, _ in q.members)]
        moving = [link for link in carrying if link != self.mechanism.frame]
        if carrying:
            return (moving or carrying)[0]
        for pair in self.mechanism.pairs:
            rides = pair.point_on_line()
            if rides is not None:
                for rider, base in ((p, q), (q, p)):
                    if rides[0] in rider.members and any(link == rides[1] for link, _ in base.members):
                        return rides[1]
        raise UnknownName(
            f"no link carries both {p.name!r} and {q.name!r}, and neither slides on a link that carries the other; "
            f"name the link whose axes are meant"
        )

    def _find_point(self, name: str) -> NamedPoint:
        if name in self._point_names:
            return self._point_names[name]
        raise UnknownName(f"there is no point {name!r}; points are {join_names(self.point_names)}")

    def _point_position(self, named: NamedPoint) -> Vector:
        link, point = named.members[0]
        return self.frames[link].to_world(self.shapes[link].position(point))


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
        """A point by its result name, or as `link.point`. Raises UnknownName."""
        return self._point_state(self._find_point(name))

    def link(self, name: str) -> LinkState:
        """A link by name; its angle between -pi and pi, or with its turns where a pair counts them. Raises
        UnknownName."""
        angle, velocity, acceleration = map(float, value_and_rates(self._frame(name).angle))
        fastest, hardest = self.scales_of_links
        sense = _describe_sense(turning_sense(velocity, fastest), velocity * acceleration, abs(velocity) * hardest)
        return LinkState(
            angle if name in self._links_counting_turns else wrap_angle(angle), velocity, acceleration, sense
        )

    def pair(self, name: str) -> dict[str, float | None]:
        """What a pair reports of its relative motion (SI). Raises UnknownName."""
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

    def limits(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""


@dataclass(frozen=True)
class Motion(KinematicResult):
    """A run of positions of a mechanism, n of them, in the order in which its inputs run through them.

    `outcome` is solved where the run came to its end, else why it stopped, which `reason` says in a sentence;
    `residual` is what the worst constraint leaves open at any position, in lengths of the mechanism's size. `time` (s)
    is there where the inputs run by laws of time, `jerked` where third rates were asked for.
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
        """A point by its result name, or as `link.point`. Raises UnknownName."""
        return self._point_motion(self._find_point(name))

    def link(self, name: str) -> LinkMotion:
        """A link by name. Its angle starts between -pi and pi unless a pair counts its turns. Raises UnknownName."""
        angle, velocity, acceleration = self._broadcast_rows(value_and_rates(self._frame(name).angle))
        if name not in self._links_counting_turns:
            angle = angle - (angle[0] - wrap_angle(float(angle[0])))
        return LinkMotion(angle, velocity, acceleration)

    def jerk(self, point: str) -> Array:
        """A point's third rate (n, 2) (m/s^3). Raises UnknownName, and BadInput where the motion was made without."""
        link, own = self._find_point(point).members[0]
        place = self._require_jerks().frames[link].to_world(self.shapes[link].position(own))
        return np.stack(self._broadcast_rows((third_rate(place.x), third_rate(place.y))), axis=1)

    def angular_jerk(self, link: str) -> Array:
        """A link's third rate (n,) (rad/s^3). Raises UnknownName, and BadInput where the motion was made without."""
        self._frame(link)
        return self._broadcast_rows((third_rate(self._require_jerks().frames[link].angle),))[0]

    def _require_jerks(self) -> ThirdRates:
        if self.jerked is None:
            raise BadInput("jerk", "third rates are there where the motion is made with jerk=True")
        return self.jerked

    def pair(self, name: str) -> dict[str, Array | None]:
        """What a pair reports at every position, each (n,) (SI). An angle starts as a link's. Raises UnknownName."""
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
    return way if way == "at rest" else f"{way}, {speed_trend(power, scale)}"


ValueAndRates = tuple[Any, Any, Any]
"""A number with its first and second rate: floats, or arrays over a motion."""
