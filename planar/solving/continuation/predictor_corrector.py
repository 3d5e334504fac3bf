"""The curve tracker: predictor and corrector, arc after arc, through dead points and change points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import cos
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, greatest_size, length_of
from planar.foundation.errors import TrackingEnd
from planar.foundation.root_finding import find_root
from planar.foundation.time_limit import time_is_over
from planar.model.pairs import MeasureKind
from planar.solving.checks.singular_values import SINGULAR_DISTANCE_RATIO
from planar.solving.continuation.bifurcation import (
    AT_BIFURCATION_DISTANCE,
    Bifurcation,
    BranchCrossing,
    bifurcation_ahead,
    bifurcation_at_start,
    bifurcation_candidates,
    branch_crossing,
)
from planar.solving.continuation.solution_curve import (
    Arc,
    CurvePoint,
    CurveSolver,
    ImplicitCurve,
    SolutionCurve,
    arc_between,
)
from planar.solving.continuation.turning_points import start_point

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
"""Where to look for a change point: so near to a singular Jacobian, and again where it is so many times nearer."""
MAX_AHEAD_RATIO = 10.0
"""A change point farther ahead than so many times the distance within which there is none is another one."""
MAX_ARCS = 5_000
"""Arcs that are walked for one answer; a turn of a usual linkage has some fifty."""
NEAR_SLIDE_EXTENT = 4.0
"""Lengths of the size: where a slide is farther out than this, steps along it grow with how far it is."""
MAX_TURNING_EXTENT = 1e5
"""Sizes: where slides are farther out, inputs turn back by rounding alone."""
SHOWN_SLIDE_EXTENT = 100.0
"""Lengths of the size, or times the greatest number of a pair: so far out a slide is shown that goes out without an
end."""
MAX_SLIDE_EXTENT = 6e6
"""Lengths of the size: farther out than this the residual check tells nothing."""
MIN_LIMIT_POWER = 0.25
"""Where a slide goes out without an end the inputs tend to a limit with a power of the slide's inverse; beyond half of
the square root, which is the lowest that lines becoming parallel give, they do."""
STANDING_INPUT = 1e-12
"""rad or sizes: inputs that move less than this stand still."""


class PassedBifurcation(NamedTuple):
    """A change point that a walk went through: the ways, by the first of which it came, and by which it went on; or
    on which it started."""

    bifurcation: Bifurcation
    branch_index: int
    is_start: bool = False
    beyond: bool = False
    """Whether a higher number was asked for than there are ways, so that it took the last."""

    @property
    def is_switched(self) -> bool:
        """Whether it went on by another way than smoothly."""
        return self.branch_index != 0 and not self.is_start


class NearbyBifurcation(NamedTuple):
    """A change point of a neighbouring linkage that a walk came near: where, how near, and by how much this linkage's
    constraints do not close there (lengths of the size)."""

    y: Array
    distance: float
    residual: float


class ArcBudget:
    """What may be spent on one answer, counted in arcs, and who is told of each: where the inputs are."""

    def __init__(self, most: int = MAX_ARCS, tell: Callable[[Array], None] | None = None):
        self.arcs_left, self._report = most, tell

    def spend(self, u: Array) -> bool:
        """Count an arc from inputs u (inputs,); False where nothing is left to spend, or the time is over."""
        self.arcs_left -= 1
        if self._report is not None:
            self._report(u)
        return self.arcs_left >= 0 and not time_is_over()


def next_point(curve: ImplicitCurve, here: CurvePoint, longest: float) -> tuple[CurvePoint | None, float]:
    """The next point of a curve, and the step to it, no longer than `longest`; None where no step leads on.

    A predictor of second order, Newton's corrector; a step that turns the tangent, or that could pass a singular
    position, is halved.
    """
    bent = max(length_of(here.curvature), 1e-300)
    step = min(longest, FIRST_DISTANCE_RATIO * here.regular_distance, FIRST_TURN_RATIO * MAX_TANGENT_TURN / bent)
    while step > SHORTEST_STEP:
        y = curve.correct(here.y + step * here.tangent + 0.5 * step**2 * here.curvature, here.tangent)
        if y is not None:
            after = curve.point_at(y, here.tangent)
            gone = length_of(y - here.y)
            onwards = after.tangent @ here.tangent > MIN_TANGENT_COSINE
            is_regular = SINGULAR_DISTANCE_RATIO * gone < here.regular_distance + after.regular_distance
            if onwards and is_regular and gone < MAX_CORRECTED_RATIO * step:
                return after, step
        step *= 0.5
    return None, step


class CurveTracker:
    """One walk along a curve from a point: its arcs, one after the other, and what it met on the way.

    `branches` are the numbers of the ways taken at change points, in the order in which they are met: 1 goes on
    smoothly, 2 takes the way nearest to that, and so on; 1 where the list ends. Of a start on one see `starting`.
    """

    def __init__(
        self, curve: SolutionCurve, start: CurvePoint, branches: Sequence[int] = (), work: ArcBudget | None = None
    ):
        self.curve, self.point, self.budget = curve, start, work or ArcBudget()
        self.branches = list(branches)
        self.passed: list[PassedBifurcation] = []
        self.nearby: list[NearbyBifurcation] = []
        self.step = FIRST_STEP
        self._last_search_distance, self._approaching = np.inf, False
        self._start_crossing: BranchCrossing | None = None
        self._choose_start_branch()
        self.ending = TrackingEnd.BRANCH_LOST
        self.limit: float | None = None
        "the place of the inputs to which the curve tends while a slide goes out without an end"
        self.far_point: CurvePoint | None = None
        "where a slide has come out far, and went on"
        equations = curve.functions.equations
        self._is_length = ~equations.unknown_is_angle
        turns = any(
            kind is not MeasureKind.LENGTH
            for kind, way in zip(equations.input_kinds, curve.input_direction, strict=True)
            if way
        )
        self.is_periodic = np.append(equations.unknown_is_angle, turns)
        "which entries of y come back after whole turns: angles, and the place of inputs that turn"

    @classmethod
    def from_position(
        cls,
        solver: CurveSolver,
        p: Array,
        position: tuple[Array, Array],
        direction: Array,
        branches: Sequence[int] = (),
        work: ArcBudget | None = None,
    ) -> CurveTracker:
        """From unknowns and inputs along a direction of the inputs, in which the fastest goes one rad or size a unit.

        At a dead point the first of the `branches` tells by which of its two ways.
        """
        (z, u), numbers = position, list(branches)
        curve = SolutionCurve(solver, p, u, direction)
        return cls(curve, start_point(curve, np.append(z, 0.0), numbers), numbers, work)

    def arcs(self) -> Iterator[Arc]:
        """The arcs of the curve; they end where it cannot be followed further, `ending` and `limit` say why."""
        shown = SHOWN_SLIDE_EXTENT * max(1.0, greatest_size(self.curve.p))
        farthest = max(MAX_SLIDE_EXTENT, 2.0 * self._slide_extent(self.point.y))
        if self._start_crossing is not None:
            self.point = self._start_crossing.after
            yield self._start_crossing.arc(self._start_crossing.middle, self._start_crossing.after)
        while True:
            here = self.point
            if not self.budget.spend(self.curve.inputs(here.y)):
                self.ending = TrackingEnd.INTERRUPTED if time_is_over() else TrackingEnd.WORK_LIMIT
                return
            if self._approaching and here.regular_distance < min(
                SEARCH_DISTANCE, REPEATED_SEARCH_RATIO * self._last_search_distance, self.step
            ):
                through = list(self._arcs_through_bifurcation())
                if through:
                    yield from through
                    self.step, self._last_search_distance, self._approaching = FIRST_STEP, np.inf, False
                    continue
            elif here.regular_distance > SEARCH_DISTANCE:
                self._last_search_distance = np.inf
            out = self._slide_extent(here.y)
            after = None if out > farthest else self._next_point()
            if after is not None and out > MAX_TURNING_EXTENT and here.input_rate * after.input_rate <= 0.0:
                self.limit, self.ending = float(here.y[-1]), TrackingEnd.ENDLESS
                return
            if after is None:
                self.limit = (
                    _input_limit(here, int(np.argmax(np.abs(here.y[:-1]) * self._is_length)))
                    if out > SHOWN_SLIDE_EXTENT
                    else None
                )
                if self.limit is not None:
                    self.ending = TrackingEnd.ENDLESS
                elif out > farthest:
                    self.ending = TrackingEnd.OUT_OF_RANGE
                return
            self._update_nearby(after)
            self._approaching = after.regular_distance < here.regular_distance
            arc = arc_between(here, after)
            if self.far_point is None and self._slide_extent(after.y) > shown:

                def beyond(x: float, arc: Arc = arc) -> float:
                    return self._slide_extent(arc.curve_coordinates(self.curve, x)) - shown

                self.far_point = arc.point_at(self.curve, find_root(beyond, *arc.ends))
            self.point = after
            yield arc

    @property
    def starts_on_bifurcation(self) -> bool:
        """Whether it starts on a change point, by a way that was asked for."""
        return self._start_crossing is not None

    def _choose_start_branch(self) -> None:
        """Start by the way of the next number where that is asked for and the start is a change point."""
        if not (self.branches and self.point.regular_distance < AT_BIFURCATION_DISTANCE):
            return
        found = bifurcation_at_start(self.curve, self.point.y)
        number = self.branches[0]
        went = min(number, len(found.branches)) - 1 if found else 0
        out = found and branch_crossing(self.curve, found.branches[went], found.rank_loss)
        if found is not None and out is not None:
            del self.branches[0]
            self.point, self._start_crossing = out.middle, out
            self.passed.append(PassedBifurcation(found, went, True, number > len(found.branches)))

    @property
    def end_inputs(self) -> tuple[Array, TrackingEnd]:
        """The inputs beyond which the arcs do not go, and why."""
        y = self.point.y if self.limit is None else np.append(self.point.y[:-1], self.limit)
        return self.curve.inputs(y), self.ending

    def _slide_extent(self, y: Array) -> float:
        """How far the farthest slide is out (sizes)."""
        return greatest_size(y[:-1][self._is_length])

    def _next_point(self) -> CurvePoint | None:
        """The next point, as far ahead as the curve and slides that are far out allow."""
        here, curve = self.point, self.curve
        # far out a step of a slide may be longer, but not that of an angle
        out = max(self._slide_extent(here.y), 0.0 if self.is_periodic[-1] else abs(float(here.y[-1])))
        turning = greatest_size(here.tangent[self.is_periodic])
        longest = LONGEST_STEP / max(turning, min(1.0, NEAR_SLIDE_EXTENT / max(out, 1.0)))
        step = min(self.step, longest)
        after, taken = next_point(curve, here, step)
        if after is not None:
            self.step = STEP_GROWTH * taken
        return after

    def _arcs_through_bifurcation(self) -> Iterator[Arc]:
        """The arcs through a change point that lies just ahead, if one does."""
        here = self.point
        self._last_search_distance = here.regular_distance
        found = self._bifurcation_ahead(here)
        if found is None:
            return
        went, onwards, beyond = self._choose_branch(found, here)
        inwards, outwards = self._crossing_towards(found, 0, here), self._crossing_towards(found, went, onwards)
        if inwards is None or outwards is None:
            return
        if float(inwards.middle.tangent @ (here.y - inwards.before.y)) < 0.0:
            yield arc_between(here, inwards.before)
            here = inwards.before
        self.passed.append(PassedBifurcation(found, went, beyond=beyond))
        yield inwards.arc(here, inwards.middle)
        yield outwards.arc(outwards.middle, outwards.after)
        self.point = outwards.after

    def _bifurcation_ahead(self, here: CurvePoint) -> Bifurcation | None:
        """The change point that lies just ahead; those of neighbouring linkages are noted."""
        curve, farthest = self.curve, max(MAX_AHEAD_RATIO * here.regular_distance, SEARCH_DISTANCE)
        for near in bifurcation_candidates(curve, here, farthest):
            away = float(np.linalg.norm(near.y - here.y))
            if not float(here.tangent @ (near.y - here.y)) > 0.0 or away > farthest:
                continue
            if near.residual > curve.solver.tolerance or not curve.is_closed(near.y):
                self.nearby = [each for each in self.nearby if np.linalg.norm(each.y - near.y) > 1e-6]
                self.nearby.append(NearbyBifurcation(near.y, away, near.residual))
                continue
            found = bifurcation_ahead(curve, here, near.y)
            if found is not None:
                return found
        return None

    def _crossing_towards(self, found: Bifurcation, index: int, towards: CurvePoint) -> BranchCrossing | None:
        """The curve beside a change point along one of its ways, in the sense of a point on it."""
        way = found.branches[index]
        return branch_crossing(
            self.curve, way if way.tangent @ towards.tangent >= 0.0 else way.reversed(), found.rank_loss
        )

    def _choose_branch(self, found: Bifurcation, here: CurvePoint) -> tuple[int, CurvePoint, bool]:
        """The way to go on by, and a point in whose sense: smoothly, or as asked for; and whether it is but the last,
        as there are not so many."""
        number = self.branches.pop(0) if self.branches else 1
        options = outgoing_branches(found, here)
        index, tangent = options[min(number, len(options)) - 1]
        return index, found.branches[index]._replace(tangent=tangent), number > len(options)

    def _update_nearby(self, after: CurvePoint) -> None:
        """How near the walk comes to change points of neighbouring linkages."""
        for k, each in enumerate(self.nearby):
            self.nearby[k] = each._replace(distance=min(each.distance, float(np.linalg.norm(after.y - each.y))))


def _input_limit(here: CurvePoint, slide: int) -> float | None:
    """The place to which the inputs tend as a slide goes out without an end; None where they go on with it.

    Far out t = limit + c s^-k, of which the first and second derivative by s tell k and the rest of the way.
    """
    s, s1, s2 = here.y[slide], here.tangent[slide], here.curvature[slide]
    t, t1, t2 = here.y[-1], here.tangent[-1], here.curvature[-1]
    if s * s1 <= 0.0:
        return None
    first, second = t1 / s1, (t2 * s1 - t1 * s2) / s1**3
    if abs(s * first) < STANDING_INPUT:
        return float(t)
    power = -s * second / first - 1.0
    return float(t + s * first / power) if power > MIN_LIMIT_POWER else None


def outgoing_branches(found: Bifurcation, here: CurvePoint) -> list[tuple[int, Array]]:
    """The ways on from a change point with their directions: the smooth one first, then by the angle from it.

    Of another way the direction in which the inputs go on as they came; both where they rest on it.
    """
    smooth = found.branches[0].tangent
    smooth = smooth if smooth @ here.tangent >= 0.0 else -smooth
    options = []
    for index, way in enumerate(found.branches):
        for tangent in (way.tangent, -way.tangent):
            same = index == 0
            onwards = tangent @ smooth > 0.0 if same else tangent[-1] * smooth[-1] >= -1e-9
            if onwards:
                options.append((index, tangent))
    return sorted(options, key=lambda each: -float(each[1] @ smooth))
