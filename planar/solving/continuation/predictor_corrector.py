"""The curve tracker: predictor and corrector, arc after arc, through dead points and change points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import cos
from typing import Any, NamedTuple, Protocol, TypeAlias, cast

import numpy as np

from planar.foundation.arrays import Array, greatest_size, length_of
from planar.foundation.errors import NoAnswer, TrackingEnd
from planar.foundation.root_finding import find_root
from planar.foundation.time_limit import time_is_over
from planar.model.pairs import MeasureKind
from planar.solving.checks import SINGULAR_DISTANCE_RATIO
from planar.solving.continuation.bifurcation import (
    AT_BIFURCATION_DISTANCE,
    Bifurcation,
    bifurcation_ahead,
    bifurcation_at_start,
    bifurcation_candidates,
    branch_crossing,
)
from planar.solving.continuation.solution_curve import (
    Arc,
    CurvePoint,
    ImplicitCurve,
    SolutionCurve,
    arc_between,
    input_axis,
)
from planar.solving.prepared_mechanism import PreparedMechanism

FIRST_STEP, LONGEST_STEP, SHORTEST_STEP = 0.05, 0.25, 1e-9
"""Steps of arc length (rad, lengths of the size): the first, the longest, and one at which the curve ends."""
MAX_TANGENT_TURN = 0.4
"""rad by which the tangent may turn in a step."""
MIN_TANGENT_COSINE = cos(MAX_TANGENT_TURN)
FIRST_TURN_RATIO, FIRST_DISTANCE_RATIO = 0.8, 1.2
"""Steps that are tried first: by what they turn of that, and as parts of the distance from singular positions."""
MAX_CORRECTED_RATIO, STEP_GROWTH = 2.0, 1.6
"""How many times longer than its step a move may be, and a next step than one that was taken."""
SEARCH_DISTANCE, REPEATED_SEARCH_RATIO = 0.15, 0.2
"""Where to look for a change point: so near to a singular Jacobian, and again where it is nearer by this factor."""
MAX_AHEAD_RATIO = 10.0
"""A change point farther ahead than this multiple of the distance within which there is none is another one."""
MAX_ARCS = 5_000
"""Arcs that are followed for one answer; a turn of a usual linkage has some fifty."""
NEAR_SLIDE_EXTENT = 4.0
"""Lengths of the size: where a slide is farther out than this, steps along it grow with how far it is."""
MAX_TURNING_EXTENT = 1e5
"""Sizes: where slides are farther out, inputs turn back by rounding alone."""
SHOWN_SLIDE_EXTENT = 100.0
"""Lengths of the size, or times the greatest number of a pair: so far out a slide is shown that goes out without an
end."""
MAX_SLIDE_EXTENT = 6e6
"""Lengths of the size: farther out than this the residual check decides nothing."""
MIN_LIMIT_POWER = 0.25
"""Where a slide goes out without an end the inputs tend to a limit with a power of the slide's inverse; beyond half of
the square root, which is the lowest that lines becoming parallel give, they do."""
STANDING_INPUT = 1e-12
"""rad or sizes: inputs that move less than this stand still."""
END_TOLERANCE = 1e-9
"""rad or sizes: so near to the end of a path a dead point, a change point or the end of a piece is at that end."""
Lengths: TypeAlias = Any
"""A length, or lengths of points or steps side by side."""


class PassedBifurcation(NamedTuple):
    """A change point that a tracker passed, at inputs u along a direction of them, or on which it started; and the
    index of the branch by which it went on. By the first it came."""

    bifurcation: Bifurcation
    branch_index: int
    u: Array
    input_direction: Array
    is_start: bool = False
    beyond: bool = False
    """Whether a higher number was asked for than there are branches, so that it took the last."""

    @property
    def is_switched(self) -> bool:
        """Whether it went on by another branch than the smooth one."""
        return self.branch_index != 0 and not self.is_start


class NearbyBifurcation(NamedTuple):
    """A change point of a neighbouring linkage that a tracker came near: where, how near, and by how much this linkage
    does not close there (lengths of the size)."""

    y: Array
    distance: float
    residual: float


class ArcBudget:
    """What may be spent on one answer, counted in arcs, each of which is reported with the inputs there."""

    def __init__(self, arcs: int = MAX_ARCS, report: Callable[[Array], None] | None = None):
        self.arcs_left, self._report = arcs, report

    def spend(self, u: Array) -> bool:
        """Count an arc from inputs u (inputs,); False where nothing is left to spend, or the time is over."""
        self.arcs_left -= 1
        if self._report is not None:
            self._report(u)
        return self.arcs_left >= 0 and not time_is_over()


def first_step(longest: Lengths, regular_distance: Lengths, curvature: Lengths) -> Lengths:
    """The step to try first from a point whose second derivative has this length, or from points (points,)."""
    by_turn = FIRST_TURN_RATIO * MAX_TANGENT_TURN / np.maximum(curvature, 1e-300)
    return np.minimum(np.minimum(longest, FIRST_DISTANCE_RATIO * regular_distance), by_turn)


def is_step_sound(step: Lengths, distance: Lengths, tangent_cosine: Lengths, regular_distances: Lengths) -> Any:
    """Whether a step that led so far, or steps (steps,), neither turned the tangent nor could pass a singular position.

    `regular_distances` are the sums of those at both ends.
    """
    is_regular = SINGULAR_DISTANCE_RATIO * distance < regular_distances
    return (tangent_cosine > MIN_TANGENT_COSINE) & is_regular & (distance < MAX_CORRECTED_RATIO * step)


def next_point(curve: ImplicitCurve, point: CurvePoint, longest: float) -> tuple[CurvePoint | None, float]:
    """The next point of a curve, and the step to it, no longer than `longest`; None where no step leads on.

    A predictor of second order, Newton's corrector; a step that turns the tangent, or that could pass a singular
    position, is halved.
    """
    step = float(first_step(longest, point.regular_distance, length_of(point.curvature)))
    while step > SHORTEST_STEP:
        y = curve.correct(point.ahead(step), point.tangent)
        if y is not None:
            after = curve.point_at(y, point.tangent)
            distance = length_of(y - point.y)
            regular_distances = point.regular_distance + after.regular_distance
            if is_step_sound(step, distance, after.tangent @ point.tangent, regular_distances):
                return after, step
        step *= 0.5
    return None, step


class _EndReporter(Protocol):
    """What a solver of positions says of a motion that ends."""

    def end_refusal(self, u: Array, point: CurvePoint, ending: TrackingEnd) -> NoAnswer:
        """See `CurveTracker.end_refusal`."""


class CurveTracker:
    """Follows a curve from a position: its arcs, one after the other, and the change points that are met.

    `branches` are the numbers of the branches taken at change points, in the order in which these are met: 1 goes on
    smoothly, 2 takes the branch nearest to that, and so on; 1 where the list ends. On a start on a change point they
    number the branches through it, on one on a dead point its two branches.
    """

    def __init__(
        self,
        solver: PreparedMechanism,
        z: Array,
        u: Array,
        direction: Array,
        branches: Sequence[int] = (),
        budget: ArcBudget | None = None,
    ):
        """From unknowns and inputs along a direction of the inputs, in which the fastest goes one rad or size a
        unit."""
        self.curve, self.budget = SolutionCurve(solver, u, direction), budget or ArcBudget()
        self.branches = list(branches)
        self.passed: list[PassedBifurcation] = []
        self.nearby: list[NearbyBifurcation] = []
        self.step = FIRST_STEP
        self._last_search_distance, self._approaching = np.inf, False
        self._start_arc: Arc | None = None
        self._set_start(np.append(z, 0.0))
        self.ending = TrackingEnd.BRANCH_LOST
        self.limit: float | None = None
        "the place of the inputs to which the curve tends while a slide goes out without an end"
        self.far_point: CurvePoint | None = None
        "where a slide has come out far, and went on"
        equations = solver.equations
        self._is_length = ~equations.unknown_is_angle
        turns = any(
            kind is not MeasureKind.LENGTH for kind, part in zip(equations.input_kinds, direction, strict=True) if part
        )
        self.is_periodic = np.append(equations.unknown_is_angle, turns)
        "which entries of y come back after whole turns: angles, and the place of inputs that turn"

    def _set_start(self, y: Array) -> None:
        """Start at y, so that the inputs go on; by a number taken off `branches` where several branches lead on.

        Of the two at a dead point the first is that on which the most moved unknown grows.
        """
        self.point = self.curve.point_at(y, input_axis(len(y)))
        is_singular = self.point.regular_distance < AT_BIFURCATION_DISTANCE
        if self.point.is_dead_point and not is_singular:
            grows = bool(self.point.tangent[int(np.argmax(np.abs(self.point.tangent)))] > 0.0)
            takes_second = bool(self.branches) and self.branches.pop(0) > 1
            self.point = self.point.reversed() if grows is takes_second else self.point
        bifurcation = bifurcation_at_start(self.curve, y) if self.branches and is_singular else None
        if bifurcation is None:
            return
        number = self.branches[0]
        index = min(number, len(bifurcation.branches)) - 1
        branch = bifurcation.branches[index]
        arc = branch_crossing(self.curve, branch, bifurcation.rank_loss)
        if arc is not None:
            del self.branches[0]
            self.point, self._start_arc = branch, arc._replace(before=branch)
            self._note_passed(bifurcation, index, is_start=True, beyond=number > len(bifurcation.branches))

    def arcs(self) -> Iterator[Arc]:
        """The arcs of the curve; they end where it cannot be followed further, `ending` and `limit` say why."""
        shown_extent = SHOWN_SLIDE_EXTENT * max(1.0, greatest_size(self.curve.p))
        farthest = max(MAX_SLIDE_EXTENT, 2.0 * self._slide_extent(self.point.y))
        if self._start_arc is not None:
            self.point = self._start_arc.after
            yield self._start_arc
        while True:
            point = self.point
            if not self.budget.spend(self.curve.inputs(point.y)):
                self.ending = TrackingEnd.INTERRUPTED if time_is_over() else TrackingEnd.WORK_LIMIT
                return
            if self._approaching and point.regular_distance < min(
                SEARCH_DISTANCE, REPEATED_SEARCH_RATIO * self._last_search_distance, self.step
            ):
                through = list(self._arcs_through_bifurcation())
                if through:
                    yield from through
                    self.step, self._last_search_distance, self._approaching = FIRST_STEP, np.inf, False
                    continue
            elif point.regular_distance > SEARCH_DISTANCE:
                self._last_search_distance = np.inf
            extent = self._slide_extent(point.y)
            after = None if extent > farthest else self._next_point()
            if after is not None and extent > MAX_TURNING_EXTENT and point.input_rate * after.input_rate <= 0.0:
                self.limit, self.ending = float(point.y[-1]), TrackingEnd.ENDLESS
                return
            if after is None:
                self.limit = (
                    _input_limit(point, int(np.argmax(np.abs(point.y[:-1]) * self._is_length)))
                    if extent > SHOWN_SLIDE_EXTENT
                    else None
                )
                if self.limit is not None:
                    self.ending = TrackingEnd.ENDLESS
                elif extent > farthest:
                    self.ending = TrackingEnd.OUT_OF_RANGE
                return
            for k, near in enumerate(self.nearby):
                distance = float(np.linalg.norm(after.y - near.y))
                self.nearby[k] = near._replace(distance=min(near.distance, distance))
            self._approaching = after.regular_distance < point.regular_distance
            arc = arc_between(point, after)
            if self.far_point is None and self._slide_extent(after.y) > shown_extent:

                def beyond(x: float, arc: Arc = arc) -> float:
                    return self._slide_extent(arc.curve_coordinates(self.curve, x)) - shown_extent

                self.far_point = arc.point_at(self.curve, find_root(beyond, *arc.ends))
            self.point = after
            yield arc

    @property
    def starts_on_bifurcation(self) -> bool:
        """Whether it starts on a change point, by a branch that was asked for."""
        return self._start_arc is not None

    def _note_passed(self, bifurcation: Bifurcation, index: int, is_start: bool, beyond: bool) -> None:
        u, direction = self.curve.inputs(bifurcation.y), self.curve.input_direction
        self.passed.append(PassedBifurcation(bifurcation, index, u, direction, is_start, beyond))

    def passed_until(self, last: float = np.inf) -> tuple[PassedBifurcation, ...]:
        """The change points passed up to a place of the inputs on their path."""
        return tuple(passed for passed in self.passed if passed.bifurcation.y[-1] <= last + END_TOLERANCE)

    @property
    def end_inputs(self) -> tuple[Array, TrackingEnd]:
        """The inputs beyond which the arcs do not go, and why."""
        y = self.point.y if self.limit is None else np.append(self.point.y[:-1], self.limit)
        return self.curve.inputs(y), self.ending

    def end_refusal(self) -> NoAnswer:
        """Why the motion along the curve ends."""
        u, ending = self.end_inputs
        return cast(_EndReporter, self.curve.solver).end_refusal(u, self.point, ending)

    def _slide_extent(self, y: Array) -> float:
        """How far the farthest slide is out (sizes)."""
        return greatest_size(y[:-1][self._is_length])

    def _next_point(self) -> CurvePoint | None:
        """The next point, as far ahead as the curve and slides that are far out allow."""
        point, curve = self.point, self.curve
        # far out a step of a slide may be longer, but not that of an angle
        extent = max(self._slide_extent(point.y), 0.0 if self.is_periodic[-1] else abs(float(point.y[-1])))
        turning = greatest_size(point.tangent[self.is_periodic])
        longest = LONGEST_STEP / max(turning, min(1.0, NEAR_SLIDE_EXTENT / max(extent, 1.0)))
        step = min(self.step, longest)
        after, taken = next_point(curve, point, step)
        if after is not None:
            self.step = STEP_GROWTH * taken
        return after

    def _arcs_through_bifurcation(self) -> Iterator[Arc]:
        """The arcs through a change point that lies just ahead, if one does."""
        point = self.point
        self._last_search_distance = point.regular_distance
        bifurcation = self._bifurcation_ahead(point)
        if bifurcation is None:
            return
        number = self.branches.pop(0) if self.branches else 1
        options = outgoing_branches(bifurcation, point)
        coming, (index, leaving) = options[0][1], options[min(number, len(options)) - 1]
        inwards, outwards = (branch_crossing(self.curve, branch, bifurcation.rank_loss) for branch in (coming, leaving))
        if inwards is None or outwards is None:
            return
        if float(coming.tangent @ (point.y - inwards.before.y)) < 0.0:
            yield arc_between(point, inwards.before)
            point = inwards.before
        self._note_passed(bifurcation, index, is_start=False, beyond=number > len(options))
        yield inwards._replace(before=point, after=coming)
        yield outwards._replace(before=leaving)
        self.point = outwards.after

    def _bifurcation_ahead(self, point: CurvePoint) -> Bifurcation | None:
        """The change point that lies just ahead; those of neighbouring linkages are noted."""
        curve, farthest = self.curve, max(MAX_AHEAD_RATIO * point.regular_distance, SEARCH_DISTANCE)
        for near in bifurcation_candidates(curve, point, farthest):
            distance = float(np.linalg.norm(near.y - point.y))
            if not float(point.tangent @ (near.y - point.y)) > 0.0 or distance > farthest:
                continue
            if near.gap > curve.solver.tolerance or not curve.is_closed(near.y):
                self.nearby = [other for other in self.nearby if np.linalg.norm(other.y - near.y) > 1e-6]
                self.nearby.append(NearbyBifurcation(near.y, distance, near.gap))
                continue
            bifurcation = bifurcation_ahead(curve, point, near.y)
            if bifurcation is not None:
                return bifurcation
        return None


def _input_limit(point: CurvePoint, slide: int) -> float | None:
    """The place to which the inputs tend as a slide goes out without an end; None where they go on with it.

    Far out t = limit + c s^-k, where k and the rest of the path follow from the first and second derivative by s.
    """
    s, s1, s2 = point.y[slide], point.tangent[slide], point.curvature[slide]
    t, t1, t2 = point.y[-1], point.tangent[-1], point.curvature[-1]
    if s * s1 <= 0.0:
        return None
    first, second = t1 / s1, (t2 * s1 - t1 * s2) / s1**3
    if abs(s * first) < STANDING_INPUT:
        return float(t)
    power = -s * second / first - 1.0
    return float(t + s * first / power) if power > MIN_LIMIT_POWER else None


def outgoing_branches(bifurcation: Bifurcation, point: CurvePoint) -> list[tuple[int, CurvePoint]]:
    """The branches on from a change point with their numbers: the smooth one first, then by the angle from it.

    Of another branch the direction in which the inputs go on as they came; both where they rest on it.
    """
    smooth = bifurcation.branches[0].towards(point.tangent)
    options = [(0, smooth)]
    for index, branch in enumerate(bifurcation.branches[1:], 1):
        options += [
            (index, option) for option in (branch, branch.reversed()) if option.input_rate * smooth.input_rate >= -1e-9
        ]
    return sorted(options, key=lambda option: -float(option[1].tangent @ smooth.tangent))
