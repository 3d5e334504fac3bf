"""What the results of one position and of a run have in common: names of points and pairs, and relative motions."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array
from planar.foundation.errors import Unknown, suggest_name
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet, value_and_rates
from planar.foundation.notebook_display import Displayable
from planar.model.link_shapes import LinkShape, shape_extent
from planar.model.mechanism import Mechanism, NamedPoint, links_counting_turns, named_points, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import amount
from planar.results.records import (
    InputMotion,
    InputState,
    RelativeState,
    principal_angle,
    principal_turns,
    rotate_quarter_turn,
    stack_vectors,
    vector_and_rates,
)

ZERO_MISFIT = 1e-13
"""Sizes: what rounding leaves of a pair that closes."""


class KinematicResult(Displayable):
    """What a position and a motion have in common: links, points and pairs by name, from frames that are jets."""

    mechanism: Mechanism
    frames: Mapping[str, Frame]
    own: Mapping[str, tuple[Jet, ...]]
    shapes: Mapping[str, LinkShape]

    if TYPE_CHECKING:  # a field, or made of the mechanism

        @property
        def inputs(self) -> Mapping[str, InputState | InputMotion]:
            """Every input by its pair."""

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
    def _point_members(self) -> dict[str, tuple[str, str]]:
        """The (link, point) of every name of a point."""
        return {name: point.members[0] for name, point in self._point_names.items()}

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
        return principal_angle(position) - position

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

    @cached_property
    def misfits(self) -> Mapping[str, Any]:
        """By how much every pair stays open (m), of a motion an array (n,), where the mechanism closes within a misfit.

        Of the lengths and angles that a pair closes the root of the sum of squares, angles as arcs at the mechanism's
        size (the greatest distance between two points of one link); what rounding leaves of none is 0. Empty of a
        mechanism that has to close.
        """
        if self.mechanism.closes_within is None:
            return {}
        size = max(map(shape_extent, self.shapes.values()), default=0.0) or 1.0
        found = {}
        for pair in self.mechanism.pairs:
            numbers = pair.measure([self.shapes[link] for link in pair.bodies])
            left = pair.residual([self.frames[link] for link in pair.bodies], numbers, self.own[pair.name])
            parts = [
                wrap_angle(value_and_rates(each)[0]) * size if kind is MeasureKind.ANGLE else value_and_rates(each)[0]
                for kind, each in zip(pair.residual_kinds, left, strict=True)
            ]
            whole = np.sqrt(sum(np.square(np.asarray(part, dtype=float)) for part in parts))
            found[pair.name] = np.where(whole <= ZERO_MISFIT * size, 0.0, whole)[()]
        return found

    @property
    def point_names(self) -> tuple[str, ...]:
        """The names that results give the points."""
        return tuple(each.name for each in self._points)

    def _frame(self, link: str) -> Frame:
        if link not in self.frames:
            raise Unknown(f"there is no link {link!r}{suggest_name(link, self.frames, 'links')}")
        return self.frames[link]

    def _find_relative_motion(self, name: str) -> tuple[Pair, ValueAndRates]:
        """A pair, and the relative motion that its results are of."""
        if name not in self._relative_motions:
            raise Unknown(f"there is no pair {name!r}{suggest_name(name, self._relative_motions, 'pairs')}")
        pair = self._relative_motions[name]
        return pair, value_and_rates(pair.input_position_at(self.shapes, self.frames, self.own))

    def relative(self, point: str, other: str, axes: str | None = None) -> RelativeState:
        """How `point` moves against `other`, in the axes of a link.

        `axes` left out: the link that carries both points, else the link on whose line one of them slides while it
        carries the other. Raises Unknown where there is no such link and none is named.
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
        raise Unknown(
            f"no link carries both {p.name!r} and {q.name!r}, and neither slides on a link that carries the other; "
            f"name the link whose axes are meant"
        )

    def _find_point(self, name: str) -> NamedPoint:
        if name in self._point_names:
            return self._point_names[name]
        raise Unknown(f"there is no point {name!r}{suggest_name(name, self.point_names, 'points')}")

    def _point_position(self, named: NamedPoint) -> Vector:
        link, point = named.members[0]
        return self.frames[link].to_world(self.shapes[link].position(point))


ValueAndRates = tuple[Any, Any, Any]
"""A number with its first and second rate: floats, or arrays over a motion."""
