"""Where along a curve of positions the input or an output turns back, or branches cross: solved for, and in words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np

from planar.equations.coordinates import frames_from_coordinates
from planar.foundation.arrays import Array, greatest_size
from planar.foundation.errors import TrackingEnd
from planar.foundation.root_finding import find_root_by_slope, lowest_on_cubic
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import count_phrase, join_all_names
from planar.results.records import Limit
from planar.solving.continuation.path import PathPiece, PeriodicPieces
from planar.solving.continuation.predictor_corrector import (
    END_TOLERANCE,
    CurveTracker,
    NearbyBifurcation,
    PassedBifurcation,
)
from planar.solving.continuation.solution_curve import CurvePoint, SolutionCurve, pair_motions_at
from planar.solving.prepared_mechanism import PreparedMechanism

STANDING_RATE = 1e-9
"""An output that moves less than this (rad or sizes) for one of the curve's length stands still but for rounding."""
ROUNDING_RATE = 1e-13
"""A rate of an output below this part is zero."""
SAME_VALUE_TOLERANCE = 1e-9
SAME_ASSEMBLY_TOLERANCE = 1e-6
"""rad or sizes: at a dead point unknowns are known to the root of rounding."""
REMARKED_DISTANCE = 1e-2
"""rad or sizes: a change point of a neighbouring linkage that is farther away is not worth a word."""
MAX_REMARKS = 12
"""Change points that are reported one by one."""


def watched_outputs(setup: PreparedMechanism) -> tuple[Pair, ...]:
    """The relative motions whose ends of stroke are reported: all slides, and all pairs in which a link turns on the
    frame, but for inputs."""
    inputs = {driven.pair for driven in setup.mechanism.inputs}
    frame = setup.mechanism.frame
    return tuple(
        pair
        for name, pair in setup.relative_motions.items()
        if name not in inputs and (pair.input_kind is MeasureKind.LENGTH or frame in pair.links)
    )


def _pieces_until(pieces: Iterable[PathPiece], last: float) -> Iterator[PathPiece]:
    """The pieces of a curve up to a place of the inputs, or to the dead point before it.

    A dead point at the very place, to rounding, is not left out.
    """
    for piece in pieces:
        if piece.stop <= last + END_TOLERANCE and not (piece.dead_point is None and piece.start >= last):
            yield piece
            if piece.dead_point is not None and piece.first != piece.last:
                return
            continue
        if piece.start < last:
            yield piece.until(last)
        return


class LocatedLimit(NamedTuple):
    """A limit, the point of the curve where it is, and what is known of a change point that is passed there."""

    limit: Limit
    point: CurvePoint
    passed: PassedBifurcation | None = None

    def in_direction(self, direction: float) -> LocatedLimit:
        """The same, its point on the curve along which the input goes in the other direction, if that is -1."""
        y = np.append(self.point.y[:-1], direction * self.point.y[-1])
        return self._replace(point=self.point._replace(y=y))


class LimitSearch:
    """Looks for what a tracker meets while the input at `pair` runs from `start` in a direction, 1 or -1."""

    def __init__(self, pair: str, start: float, direction: float, tracker: CurveTracker):
        self.pair, self.start, self.direction, self.tracker = pair, start, direction, tracker
        self.curve, self.setup = tracker.curve, tracker.curve.solver
        self.outputs = watched_outputs(self.setup)
        self.unit = self.setup.unit if self.setup.is_sliding(pair) else 1.0

    def until(self, last: float) -> Iterator[LocatedLimit]:
        """What the tracker meets up to a place of the input.

        Of a curve that comes back after some turns of the input what is met in these is reported for all turns.
        """
        known: list[PathPiece] = []
        begin, pieces = self.tracker.point, PeriodicPieces(self.tracker)
        for piece in pieces:
            known.append(piece)
            if pieces.period is not None or piece.dead_point is not None or piece.stop > last:
                break
        period = pieces.period
        if period is None or last < period.length:
            yield from self.along(_pieces_until(chain(known, pieces), last), last, begin)
            return
        once = list(self.along(period.pieces, period.length))
        growths = [self._growth(located, period.growth) for located in once]
        for times in range(int((last + END_TOLERANCE) / period.length) + 1):
            for (limit, point, passed), growth in zip(once, growths, strict=True):
                repeated = point._replace(y=point.y + times * period.growth)
                if repeated.y[-1] > last + END_TOLERANCE:
                    continue
                remark = limit.told
                if passed is not None:
                    remark = change_point_remark(self.setup, passed._replace(u=self.curve.inputs(repeated.y)))
                position, value = self._position(repeated), limit.value + times * growth
                yield LocatedLimit(limit._replace(input=position, value=value, told=remark), repeated, passed)

    def _growth(self, located: LocatedLimit, growth: Array) -> float:
        """By how much the value of a limit grows with each period: an output may turn with the input."""
        output = [pair for pair in self.outputs if pair.name == located.limit.of]
        if not output:
            return self.direction * float(growth[-1]) * self.unit
        point = located.point._replace(y=located.point.y + growth)
        return float(pair_motions_at(output, self.curve, point)[0, 0]) - located.limit.value

    def _position(self, point: CurvePoint) -> float:
        """The position of the input at a point (rad or m)."""
        return (self.start + self.direction * float(point.y[-1])) * self.unit

    def _located(
        self,
        kind: str,
        of: str,
        point: CurvePoint,
        value: float | None = None,
        remark: str = "",
        passed: PassedBifurcation | None = None,
    ) -> LocatedLimit:
        position = self._position(point)
        value = position if value is None else value
        return LocatedLimit(Limit(kind, of, position, value, None, remark), point, passed)

    def along(
        self, pieces: Iterable[PathPiece], last: float = np.inf, begin: CurvePoint | None = None
    ) -> Iterator[LocatedLimit]:
        """What the tracker meets on pieces of its curve, up to a place of the input or along a circuit; `begin` is
        where they begin, if that may be a dead point."""
        curve, passed_count = self.curve, 0
        if begin is not None and begin.is_dead_point:
            yield self._located("input dead point", self.pair, begin)
        before: CurvePoint | None = None
        rates_before: Array = np.zeros((0, 3))
        for piece in pieces:
            arc = piece.arc
            if before is None or arc.is_exact:
                before = arc.point_at(curve, piece.first, False)
                rates_before = pair_motions_at(self.outputs, curve, before)
            after = piece.dead_point or (arc.after if piece.last == arc.ends[1] else None)
            after = after or arc.point_at(curve, piece.last, False)
            rates_after = pair_motions_at(self.outputs, curve, after)
            for output, at_first, at_last in zip(self.outputs, rates_before, rates_after, strict=True):
                for x in self._turning_points(piece, output, ((before, at_first), (after, at_last))):
                    point = arc.point_at(curve, x, False)
                    yield self._located("stroke end", output.name, point, self._output_rates(output, point)[0])
            for passed in self.tracker.passed_until(last)[passed_count:]:
                if not (passed.is_start or np.array_equal(passed.bifurcation.y, arc.after.y)):
                    break  # farther on: a tracker that has followed all of the curve knows them all
                remark = change_point_remark(self.setup, passed)
                yield self._located("change point", self.pair, passed.bifurcation.branches[0], None, remark, passed)
                passed_count += 1
            if piece.dead_point is not None and piece.first != piece.last:
                yield self._located("input dead point", self.pair, piece.dead_point)
            before, rates_before = after, rates_after
        point, ending = self.tracker.point, self.tracker.ending
        if ending is TrackingEnd.STOP:
            for stop in self.setup.stops_at(point.y[:-1], self.curve.inputs(point.y)):
                yield self._located("stop", stop.pair, point, stop.position)
        elif ending in (TrackingEnd.WORK_LIMIT, TrackingEnd.INTERRUPTED):
            reason = ": it takes more work than one answer may; name a nearer range"
            if ending is TrackingEnd.INTERRUPTED:
                reason = ", as the computation was ended"
            remark = f"what lies beyond was not followed{reason}"
            yield self._located("not followed further", self.pair, point, None, remark)

    def _output_rates(self, output: Pair, point: CurvePoint) -> list[float]:
        """Position, first and second derivative by arc length of one output, SI."""
        return pair_motions_at((output,), self.curve, point)[0].tolist()

    def _turning_points(
        self, piece: PathPiece, output: Pair, ends: tuple[tuple[CurvePoint, Array], tuple[CurvePoint, Array]]
    ) -> Iterator[float]:
        """Where on a piece an output turns back: places on the arc's axis; `ends` are points, with the position and the
        rates of the output there (3,)."""
        arc = piece.arc
        (before, (_, g0, s0)), (after, (_, g1, s1)) = ends
        standing = STANDING_RATE * (self.setup.unit if output.input_kind is MeasureKind.LENGTH else 1.0)

        def rate_and_slope(x: float) -> tuple[float, float]:
            point = arc.point_at(self.curve, x, False)
            _, rate, second = self._output_rates(output, point)
            return rate, second / float(arc.axis @ point.tangent)

        if max(abs(g0), abs(g1)) < standing:
            return
        # where a piece starts or ends in the very turn, the sign of its rate there is rounding
        zero = ROUNDING_RATE * standing / STANDING_RATE
        for point, x, g, s in ((before, piece.first, g0, s0), (after, piece.last, g1, s1)):
            if abs(g) < zero and abs(s) > standing and not point.is_dead_point:
                yield x
                return
        # what only turns back since the input does, at a dead point, has no end of its stroke there
        g0 = zero * s0 if abs(g0) < zero and before.is_dead_point else g0
        g1 = -zero * s1 if abs(g1) < zero and after.is_dead_point else g1
        if g0 * g1 < 0.0:
            yield find_root_by_slope(rate_and_slope, (piece.first, piece.last), (g0, g1))
        elif g0 * s0 < 0.0 < g1 * s1 and g0 * g1 > 0.0:
            # both ends go in one direction, but the output may have gone back in between
            length, up = abs(piece.last - piece.first), float(np.sign(g0))
            lowest, part = lowest_on_cubic((up * g0, up * s0 * length), (up * g1, up * s1 * length))
            middle = piece.first + part * (piece.last - piece.first)
            rate_at_middle = rate_and_slope(middle)[0] if lowest < 0.0 else 0.0
            if up * rate_at_middle < -standing:
                yield find_root_by_slope(rate_and_slope, (piece.first, middle), (g0, rate_at_middle))
                yield find_root_by_slope(rate_and_slope, (middle, piece.last), (rate_at_middle, g1))


def distinct_limits(pair: str, curve: SolutionCurve, limits: Iterable[LocatedLimit]) -> tuple[Limit, ...]:
    """Limits in their order, each once, with the two ends of every slide on the frame by name."""
    once: list[LocatedLimit] = []
    for located in limits:
        if not any(_is_same_limit(other, located) for other in once[-8:]):
            once.append(located)
    return tuple(_name_stroke_ends(curve, pair, once))


def _is_same_limit(one: LocatedLimit, other: LocatedLimit) -> bool:
    """Whether two limits are one: of one pair, at one place of the input, in one assembly."""
    if one.limit[:2] != other.limit[:2] or abs(one.limit.input - other.limit.input) >= END_TOLERANCE:
        return False
    # of two assemblies some link stands elsewhere, whole turns aside
    turned = np.sin(0.5 * (one.point.y[:-1] - other.point.y[:-1]))
    return greatest_size(turned) < SAME_ASSEMBLY_TOLERANCE


def _name_stroke_ends(curve: SolutionCurve, pair: str, limits: list[LocatedLimit]) -> Iterator[Limit]:
    """The limits; the two ends of every slide are named by how far they are from the driving crank's pin."""
    setup, driving = curve.solver, curve.solver.relative_motions[pair]
    frame, rounding = setup.mechanism.frame, SAME_VALUE_TOLERANCE * setup.unit
    pins = [pin for pin in driving.coincident_points() if pin[0] == frame and driving.input_kind is MeasureKind.ANGLE]
    ends: dict[str, tuple[float, float]] = {}
    for output in watched_outputs(setup):
        strokes = [located for located in limits if located.limit[:2] == ("stroke end", output.name)]
        if output.input_kind is not MeasureKind.LENGTH or frame not in output.links or len(strokes) < 2:
            continue
        low, high = (end(strokes, key=lambda located: located.limit.value) for end in (min, max))
        if high.limit.value - low.limit.value <= rounding:
            continue
        bottom, top, rides = low, high, output.point_on_line()
        if pins and rides is not None:
            near, far = (_pin_distance(curve, located.point, rides[0], pins[0]) for located in (low, high))
            if far < near - rounding:
                bottom, top = high, low
        ends[output.name] = bottom.limit.value, top.limit.value
    for limit, _, _ in limits:
        if limit.kind == "stroke end" and limit.of in ends:
            at_bottom, at_top = (abs(limit.value - value) <= rounding for value in ends[limit.of])
            yield limit._replace(end="TDC" if at_top else "BDC" if at_bottom else None)
        else:
            yield limit


def _pin_distance(curve: SolutionCurve, point: CurvePoint, sliding: tuple[str, str], pin: tuple[str, str]) -> float:
    """How far a (link, point) that slides is from a pin of the frame (m)."""
    setup = curve.solver
    w = setup.functions.coordinates(point.y[:-1], curve.inputs(point.y), curve.p) * setup.scale
    frames, _ = frames_from_coordinates(w.tolist(), setup.column, setup.shapes, setup.pairs)
    (x, y), (pin_x, pin_y) = (
        frames[link].to_world(setup.shapes[link].position(name))[:2] for link, name in (sliding, pin)
    )
    return float(np.hypot(x - pin_x, y - pin_y))


def change_point_remarks(
    setup: PreparedMechanism, passed: Sequence[PassedBifurcation], nearby: Sequence[NearbyBifurcation]
) -> tuple[str, ...]:
    """What to report of change points on a path, and near it."""
    if not passed and not nearby:
        return ()
    remarks = [change_point_remark(setup, bifurcation) for bifurcation in passed]
    remarks += [
        f"the motion comes within {near.distance:.1g} (rad, or lengths of the mechanism's size) of a change "
        f"point of a linkage that differs from this one by {near.residual * setup.unit:.1g} m"
        for near in nearby
        if near.distance < REMARKED_DISTANCE
    ]
    remarks = list(dict.fromkeys(remarks))
    if len(remarks) > MAX_REMARKS:
        rest = f"and so on at {count_phrase(len(remarks) - MAX_REMARKS, 'more place')}; see the motion's limits"
        remarks[MAX_REMARKS:] = [rest]
    return tuple(remarks)


def change_point_remark(setup: PreparedMechanism, passed: PassedBifurcation) -> str:
    """What to say of a change point that a motion passes."""
    branch_count, is_complete = len(passed.bifurcation.branches), passed.bifurcation.is_complete
    moving = zip(setup.mechanism.inputs, passed.u, passed.input_direction, strict=True)
    place = join_all_names([setup.describe_input(driven.pair, u) for driven, u, part in moving if part])
    if branch_count == 1 and is_complete:
        return f"at {place} there is one more motion to first order, but only this one goes on"
    reason = "the last that there is" if passed.beyond else "as asked for"
    if passed.is_start:
        choice = f"this motion starts there by number {passed.branch_index + 1}, {reason}"
    else:
        choice = "this one goes on smoothly" if passed.branch_index == 0 else f"another one was taken, {reason}"
    count = count_phrase(max(branch_count, 2), "branch", "branches")
    return f"at {place} {'' if is_complete else 'at least '}{count} of the motion cross; {choice}"
