"""Where along a curve of positions the input or an output turns back, or branches cross: solved for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np

from planar.equations.coordinates import frames_from_coordinates
from planar.foundation.arrays import Array
from planar.foundation.errors import TrackingEnd
from planar.foundation.root_finding import find_root, find_root_by_slope, lowest_on_cubic
from planar.model.pairs import MeasureKind, Pair
from planar.results.records import Limit
from planar.solving.continuation.change_point_remarks import change_point_remark
from planar.solving.continuation.pair_motions import pair_motions_at
from planar.solving.continuation.path_pieces import (
    END_TOLERANCE,
    PathBifurcation,
    PathPiece,
    bifurcations_until,
    path_pieces,
)
from planar.solving.continuation.period import PeriodSearch
from planar.solving.continuation.predictor_corrector import CurveTracker
from planar.solving.continuation.solution_curve import Arc, CurvePoint, SolutionCurve
from planar.solving.continuation.turning_points import is_dead_point
from planar.solving.prepared_mechanism import PreparedMechanism

STANDING_RATE = 1e-9
"""An output that moves less than this (rad or sizes) for one of the curve's length stands still but for rounding."""
ROUNDING_RATE = 1e-13
"""A rate of an output below this part is zero."""
SAME_VALUE_TOLERANCE = 1e-9
SAME_ASSEMBLY_TOLERANCE = 1e-6
"""rad or sizes: at a dead point unknowns are known to the root of rounding."""


class _PieceEnd(NamedTuple):
    """An end of a piece of the curve, and how the outputs move there (outputs, 3)."""

    point: CurvePoint
    output_rates: Array


class WatchedOutputs(NamedTuple):
    """The relative motions whose ends of stroke are told, and how they move along a curve."""

    setup: PreparedMechanism
    pairs: tuple[Pair, ...]

    def rates_at(self, curve: SolutionCurve, point: CurvePoint) -> Array:
        """Position, first and second derivative by arc length of every output (outputs, 3), SI."""
        return pair_motions_at(self.setup, self.pairs, curve, point)

    def output_rates_at(self, curve: SolutionCurve, point: CurvePoint, index: int) -> Array:
        """The same of one output (3,)."""
        rates: Array = pair_motions_at(self.setup, self.pairs[index : index + 1], curve, point)[0]
        return rates

    def piece_end(self, curve: SolutionCurve, point: CurvePoint) -> _PieceEnd:
        """An end of a piece, with how the outputs move there."""
        return _PieceEnd(point, self.rates_at(curve, point))

    def pin_distance(
        self, curve: SolutionCurve, point: CurvePoint, sliding: tuple[str, str], pin: tuple[str, str]
    ) -> float:
        """How far a (link, point) that slides is from a pin of the frame (m)."""
        setup = self.setup
        w = setup.functions.coordinates(point.y[:-1], curve.inputs(point.y), curve.p) * setup.scale
        frames, _ = frames_from_coordinates(w.tolist(), setup.column, setup.shapes, setup.pairs)
        link, name = sliding
        gap = frames[link].to_world(setup.shapes[link].position(name)) - frames[pin[0]].to_world(
            setup.shapes[pin[0]].position(pin[1])
        )
        return float(np.hypot(gap.x, gap.y))


def watched_outputs(setup: PreparedMechanism) -> WatchedOutputs:
    """All slides, and all pairs in which a link turns on the frame, but for inputs."""
    inputs = {given.pair for given in setup.mechanism.inputs}
    frame = setup.mechanism.frame
    found = [
        pair
        for name, pair in setup.relative_motions.items()
        if name not in inputs and (pair.input_kind is MeasureKind.LENGTH or frame in pair.links)
    ]
    return WatchedOutputs(setup, tuple(found))


def pieces_until(parts: Iterable[PathPiece], last: float) -> Iterator[PathPiece]:
    """The pieces of a curve up to a place of the inputs on their way, or to the dead point before it.

    A dead point at the very place, to rounding, is not left out.
    """
    for piece in parts:
        ends = piece.dead_point is not None and piece.first != piece.last
        if piece.stop <= last + END_TOLERANCE and not (piece.dead_point is None and piece.start >= last):
            yield piece
            if ends:
                return
            continue
        if piece.start < last:

            def beyond(x: float, arc: Arc = piece.arc) -> float:
                return float(arc.polynomial(x)[-1]) - last

            x = find_root(beyond, piece.first, piece.last)
            yield piece._replace(last=x, stop=last, dead_point=None)
        return


class LocatedLimit(NamedTuple):
    """A limit, the point of the curve where it is, and what is known of a change point that is passed there."""

    limit: Limit
    point: CurvePoint
    passed: PathBifurcation | None = None

    def in_direction(self, way: float) -> LocatedLimit:
        """The same, its point on the curve along which the input goes the other way, if that is -1."""
        y = np.append(self.point.y[:-1], way * self.point.y[-1])
        return self._replace(point=self.point._replace(y=y))


def limits_until(
    setup: PreparedMechanism, pair: str, start: float, direction: float, tracker: CurveTracker, last: float
) -> Iterator[LocatedLimit]:
    """What a walk meets up to a place of the input on its way; see `along`.

    Of a walk that comes back after some turns of the input what it meets in these is told for all.
    """
    known: list[PathPiece] = []
    begin = tracker.point
    parts, whole, period = path_pieces(tracker), PeriodSearch(tracker), None
    for piece in parts:
        known.append(piece)
        period = whole.period_after(piece)
        if period is not None or piece.dead_point is not None or piece.stop > last:
            break
    if period is None or last < period.length:
        yield from limits_along(
            setup, pair, start, direction, tracker, pieces_until(chain(known, parts), last), last, begin
        )
        return
    once = list(limits_along(setup, pair, start, direction, tracker, period.pieces, period.length))
    watched, scale = watched_outputs(setup), setup.unit if setup.is_sliding(pair) else 1.0
    index = {output.name: k for k, output in enumerate(watched.pairs)}

    def grows(limit: Limit, point: CurvePoint) -> float:
        """By how much an output that turns with the input is farther on each time."""
        if limit.of not in index:
            return direction * period.length * scale
        return (
            float(watched.output_rates_at(tracker.curve, point._replace(y=point.y + period.growth), index[limit.of])[0])
            - limit.value
        )

    grown = [grows(limit, point) for limit, point, _ in once]
    many, turns = int((last + END_TOLERANCE) / period.length) + 1, period.growth
    for times in range(many):
        for (limit, point, passed), by in zip(once, grown, strict=True):
            there = point._replace(y=point.y + times * turns)
            if there.y[-1] > last + END_TOLERANCE:
                continue
            place = (start + direction * float(there.y[-1])) * scale
            told = (
                limit.told
                if passed is None
                else change_point_remark(setup, passed._replace(u=tracker.curve.inputs(there.y)))
            )
            yield LocatedLimit(limit._replace(input=place, value=limit.value + times * by, told=told), there, passed)


def distinct_limits(
    setup: PreparedMechanism, pair: str, curve: SolutionCurve, found: Iterable[LocatedLimit]
) -> tuple[Limit, ...]:
    """Limits in their order, each once, with the two ends of every slide on the frame told apart."""
    once: list[LocatedLimit] = []
    for each in found:
        if not any(_is_same_limit(other, each) for other in once[-8:]):
            once.append(each)
    return tuple(_name_stroke_ends(setup, watched_outputs(setup), curve, pair, once))


def _is_same_limit(one: LocatedLimit, other: LocatedLimit) -> bool:
    """Whether two limits are one: of one pair, at one place of the input, in one assembly."""
    if one.limit[:2] != other.limit[:2] or abs(one.limit.input - other.limit.input) >= END_TOLERANCE:
        return False
    # of two assemblies some link stands elsewhere, whole turns aside
    return (
        float(np.max(np.abs(np.sin(0.5 * (one.point.y[:-1] - other.point.y[:-1]))), initial=0.0))
        < SAME_ASSEMBLY_TOLERANCE
    )


def limits_along(  # long: one kind of limit after the other
    setup: PreparedMechanism,
    pair: str,
    start: float,
    direction: float,
    tracker: CurveTracker,
    parts: Iterable[PathPiece],
    last: float = np.inf,
    begin: CurvePoint | None = None,
) -> Iterator[LocatedLimit]:
    """What a walk meets on which the input at `pair` runs from `start` one way (1) or the other.

    `parts` are its pieces, up to a place of the input on that way or all round a circuit; `begin` is where they begin,
    if that may be a dead point.
    """
    curve, watched = tracker.curve, watched_outputs(setup)
    unit = setup.unit if setup.is_sliding(pair) else 1.0
    passed = 0

    def noted(
        kind: str,
        of: str,
        point: CurvePoint,
        value: float | None = None,
        told: str = "",
        through: PathBifurcation | None = None,
    ) -> LocatedLimit:
        place = (start + direction * float(point.y[-1])) * unit
        return LocatedLimit(Limit(kind, of, place, place if value is None else value, None, told), point, through)

    if begin is not None and is_dead_point(begin):
        yield noted("input dead point", pair, begin)
    before: _PieceEnd | None = None
    for piece in parts:
        arc = piece.arc
        if before is None or arc.is_exact:
            before = watched.piece_end(curve, arc.point_at(curve, piece.first, False))
        after = watched.piece_end(
            curve,
            piece.dead_point or (arc.after if piece.last == arc.ends[1] else arc.point_at(curve, piece.last, False)),
        )
        for k, output in enumerate(watched.pairs):
            still = STANDING_RATE * (setup.unit if output.input_kind is MeasureKind.LENGTH else 1.0)
            for x in _output_turning_points(watched, curve, piece, (before, after), k, still):
                point = arc.point_at(curve, x, False)
                yield noted("stroke end", output.name, point, float(watched.output_rates_at(curve, point, k)[0]))
        for each in bifurcations_until(tracker, last)[passed:]:
            if not (each.passed.is_start or np.array_equal(each.passed.bifurcation.y, arc.after.y)):
                break  # farther on: a walk that has gone its whole way knows them all
            yield noted(
                "change point", pair, each.passed.bifurcation.branches[0], None, change_point_remark(setup, each), each
            )
            passed += 1
        if piece.dead_point is not None and piece.first != piece.last:
            yield noted("input dead point", pair, piece.dead_point)
        before = after
    met = setup.stops_at(tracker.point.y[:-1], curve.inputs(tracker.point.y))
    for stop in met if tracker.ending is TrackingEnd.STOP else ():
        yield noted("stop", stop.pair, tracker.point, stop.position)
    if tracker.ending in (TrackingEnd.WORK_LIMIT, TrackingEnd.INTERRUPTED):
        told = "what lies beyond was not followed: it takes more work than one answer may; name a nearer range"
        if tracker.ending is TrackingEnd.INTERRUPTED:
            told = "what lies beyond was not followed, as the computation was ended"
        yield noted("not followed further", pair, tracker.point, None, told)


def _output_turning_points(
    watched: WatchedOutputs,
    curve: SolutionCurve,
    piece: PathPiece,
    ends: tuple[_PieceEnd, _PieceEnd],
    k: int,
    still: float,
) -> Iterator[float]:
    """Where on a piece an output turns back: places on the arc's axis."""
    arc = piece.arc
    (_, g0, s0), (_, g1, s1) = (end.output_rates[k] for end in ends)
    sense = 1.0 if piece.last > piece.first else -1.0

    def rate_and_slope(x: float) -> tuple[float, float]:
        point = arc.point_at(curve, x, False)
        _, rate, second = watched.output_rates_at(curve, point, k)
        return float(rate), float(second / (arc.axis @ point.tangent))

    if max(abs(g0), abs(g1)) < still:
        return
    # where a piece starts or ends in the very turn, the sign of its rate there is rounding
    none = ROUNDING_RATE * still / STANDING_RATE
    for end, x, g, s in ((ends[0], piece.first, g0, s0), (ends[1], piece.last, g1, s1)):
        if abs(g) < none and abs(s) > still and not is_dead_point(end.point):
            yield x
            return
    # what only turns back since the input does, at a dead point, has no end of its stroke there
    g0 = none * s0 if abs(g0) < none and is_dead_point(ends[0].point) else g0
    g1 = -none * s1 if abs(g1) < none and is_dead_point(ends[1].point) else g1
    if g0 * g1 < 0.0:
        yield find_root_by_slope(rate_and_slope, (piece.first, piece.last), (g0, g1))
    elif g0 * s0 < 0.0 < g1 * s1 and g0 * g1 > 0.0:
        # both ends go one way, but the output may have gone back in between
        gone, up = abs(piece.last - piece.first), float(np.sign(g0))
        least, part = lowest_on_cubic((up * g0, up * s0 * gone), (up * g1, up * s1 * gone))
        middle = piece.first + sense * part * gone
        turned = rate_and_slope(middle)[0] if least < 0.0 else 0.0
        if up * turned < -still:
            yield find_root_by_slope(rate_and_slope, (piece.first, middle), (g0, turned))
            yield find_root_by_slope(rate_and_slope, (middle, piece.last), (turned, g1))


def _name_stroke_ends(
    setup: PreparedMechanism, watched: WatchedOutputs, curve: SolutionCurve, pair: str, found: list[LocatedLimit]
) -> Iterator[Limit]:
    """The limits, with the two ends of every slide told apart by how far they are from the driving crank's pin."""
    frame = setup.mechanism.frame
    driving = setup.relative_motions[pair]
    pins = (
        [each for each in driving.coincident_points() if each[0] == frame]
        if driving.input_kind is MeasureKind.ANGLE
        else []
    )
    ends: dict[str, tuple[float, float, bool]] = {}
    for output in watched.pairs:
        if output.input_kind is not MeasureKind.LENGTH or frame not in output.links:
            continue
        of = [
            (limit.value, point) for limit, point, _ in found if limit.kind == "stroke end" and limit.of == output.name
        ]
        if len(of) < 2:
            continue
        (low, at_low), (high, at_high) = min(of, key=lambda each: each[0]), max(of, key=lambda each: each[0])
        if high - low <= SAME_VALUE_TOLERANCE * setup.unit:
            continue
        far = True
        rides = output.point_on_line()
        if pins and rides is not None:
            distances = [watched.pin_distance(curve, point, rides[0], pins[0]) for point in (at_low, at_high)]
            far = distances[1] >= distances[0] - SAME_VALUE_TOLERANCE * setup.unit
        ends[output.name] = (low, high, far)
    for limit, _, _ in found:
        if limit.kind != "stroke end" or limit.of not in ends:
            yield limit
            continue
        low, high, far = ends[limit.of]
        near = SAME_VALUE_TOLERANCE * setup.unit
        top = abs(limit.value - (high if far else low)) <= near
        bottom = abs(limit.value - (low if far else high)) <= near
        yield limit._replace(end="TDC" if top else "BDC" if bottom else None)
