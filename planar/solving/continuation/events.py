"""Where along a curve of positions the input or an output turns back, or branches cross: solved for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import NamedTuple

import numpy as np

from planar.equations.functions import placed
from planar.foundation.errors import Ending
from planar.foundation.jets import Jet, orders
from planar.foundation.root_finding import root
from planar.model.pairs import Kind, Pair
from planar.results.records import Limit
from planar.solving.continuation.change_point_remarks import crossed
from planar.solving.continuation.path_pieces import SEAM, Met, Piece, cubic, met, pieces, rests
from planar.solving.continuation.period import Round
from planar.solving.continuation.predictor_corrector import Walk
from planar.solving.continuation.solution_curve import Curve, Point
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

STILL = 1e-9
"""An output that moves less than this (rad or sizes) for one of the curve's length stands still but for rounding."""
ROUNDING = 1e-13
"""A rate of an output below this part is zero."""
SAME = 1e-9
APART = 1e-6
"""rad or sizes: at a dead point unknowns are known to the root of rounding."""


class _End(NamedTuple):
    """An end of a piece of the curve, and how the outputs move there (outputs, 3)."""

    point: Point
    gains: Array


class Outputs(NamedTuple):
    """The relative motions whose ends of stroke are told, and how they move along a curve."""

    setup: Setup
    pairs: tuple[Pair, ...]

    def along(self, curve: Curve, point: Point) -> Array:
        """Position, first and second derivative by arc length of every output (outputs, 3), SI."""
        setup = self.setup
        if not self.pairs:
            return np.zeros((0, 3))
        rates, second = curve.widened(point.tangent), curve.widened(point.bend)
        moving = setup.program.kinematics(curve.whole(point.y), rates, second, curve.p)
        parts = np.stack([moving.w, moving.w1, moving.w2], axis=1) * setup.scale[:, None]
        frames, own = placed([Jet(*each) for each in parts.tolist()], setup.column, setup.shapes, setup.pairs)
        found = []
        for pair in self.pairs:
            numbers = pair.measure([setup.shapes[link] for link in pair.bodies])
            drive = pair.drive([frames[link] for link in pair.bodies], numbers, own.get(pair.name, ()))
            found.append(orders(drive))
        return np.array(found, dtype=float)

    def end(self, curve: Curve, point: Point) -> _End:
        """An end of a piece, with how the outputs move there."""
        return _End(point, self.along(curve, point))

    def distance(self, curve: Curve, point: Point, pair: Pair, pin: tuple[str, str]) -> float:
        """How far the point that slides is from a pin of the frame (m)."""
        setup = self.setup
        w = setup.program.coordinates(point.y[:-1], curve.inputs(point.y), curve.p) * setup.scale
        frames, _ = placed(w.tolist(), setup.column, setup.shapes, setup.pairs)
        (link, name), _ = pair.rides()
        gap = frames[link].carry(setup.shapes[link].at(name)) - frames[pin[0]].carry(setup.shapes[pin[0]].at(pin[1]))
        return float(np.hypot(gap.x, gap.y))


def outputs(setup: Setup) -> Outputs:
    """All slides, and all pairs in which a link turns on the frame, but for inputs."""
    inputs = {given.pair for given in setup.mechanism.inputs}
    frame = setup.mechanism.frame
    found = [
        pair
        for name, pair in setup.named.items()
        if name not in inputs and (pair.drive_kind is Kind.LENGTH or frame in pair.links)
    ]
    return Outputs(setup, tuple(found))


def until(parts: Iterable[Piece], last: float) -> Iterator[Piece]:
    """The pieces of a curve up to a place of the inputs on their way, or to the dead point before it.

    A dead point at the very place, to rounding, is not left out.
    """
    for piece in parts:
        ends = piece.dead is not None and piece.first != piece.last
        if piece.stop <= last + SEAM and not (piece.dead is None and piece.start >= last):
            yield piece
            if ends:
                return
            continue
        if piece.start < last:
            x = root(lambda x, arc=piece.arc: float(arc.rough(x)[-1]) - last, piece.first, piece.last)
            yield piece._replace(last=x, stop=last, dead=None)
        return


class Found(NamedTuple):
    """A limit, the point of the curve where it is, and what is known of a change point that is passed there."""

    limit: Limit
    point: Point
    passed: Met | None = None

    def turned(self, way: float) -> Found:
        """The same, its point on the curve along which the input goes the other way, if that is -1."""
        y = np.append(self.point.y[:-1], way * self.point.y[-1])
        return self._replace(point=self.point._replace(y=y))


def over(setup: Setup, pair: str, start: float, way: float, walk: Walk, last: float) -> Iterator[Found]:
    """What a walk meets up to a place of the input on its way; see `along`.

    Of a walk that comes back after some turns of the input what it meets in these is told for all.
    """
    known: list[Piece] = []
    begin = walk.here
    parts, whole, period = pieces(walk), Round(walk), None
    for piece in parts:
        known.append(piece)
        period = whole.after(piece)
        if period is not None or piece.dead is not None or piece.stop > last:
            break
    if period is None or last < period.length:
        yield from along(setup, pair, start, way, walk, until(chain(known, parts), last), last, begin)
        return
    once = list(along(setup, pair, start, way, walk, period.pieces, period.length))
    watched, scale = outputs(setup), setup.unit if setup.slides(pair) else 1.0
    index = {output.name: k for k, output in enumerate(watched.pairs)}

    def grows(limit: Limit, point: Point) -> float:
        """By how much an output that turns with the input is farther on each time."""
        if limit.of not in index:
            return way * period.length * scale
        return (
            float(watched.along(walk.curve, point._replace(y=point.y + period.turns))[index[limit.of], 0]) - limit.value
        )

    grown = [grows(limit, point) for limit, point, _ in once]
    many, turns = int((last + SEAM) / period.length) + 1, period.turns
    for times in range(many):
        for (limit, point, passed), by in zip(once, grown, strict=True):
            there = point._replace(y=point.y + times * turns)
            if there.y[-1] > last + SEAM:
                continue
            place = (start + way * float(there.y[-1])) * scale
            told = limit.told if passed is None else crossed(setup, passed._replace(u=walk.curve.inputs(there.y)))
            yield Found(limit._replace(input=place, value=limit.value + times * by, told=told), there, passed)


def limits(setup: Setup, pair: str, curve: Curve, found: Iterable[Found]) -> tuple[Limit, ...]:
    """Limits in their order, each once, with the two ends of every slide on the frame told apart."""
    once: list[Found] = []
    for each in found:
        if not any(_same(other, each) for other in once[-8:]):
            once.append(each)
    return tuple(_named(setup, outputs(setup), curve, pair, once))


def _same(one: Found, other: Found) -> bool:
    """Whether two limits are one: of one pair, at one place of the input, in one assembly."""
    if one.limit[:2] != other.limit[:2] or abs(one.limit.input - other.limit.input) >= SEAM:
        return False
    # of two assemblies some link stands elsewhere, whole turns aside
    return float(np.max(np.abs(np.sin(0.5 * (one.point.y[:-1] - other.point.y[:-1]))), initial=0.0)) < APART


def along(
    setup: Setup,
    pair: str,
    start: float,
    way: float,
    walk: Walk,
    parts: Iterable[Piece],
    last: float = np.inf,
    begin: Point | None = None,
) -> Iterator[Found]:
    """What a walk meets on which the input at `pair` runs from `start` one way (1) or the other.

    `parts` are its pieces, up to a place of the input on that way or all round a circuit; `begin` is where they begin,
    if that may be a dead point.
    """
    curve, watched = walk.curve, outputs(setup)
    unit = setup.unit if setup.slides(pair) else 1.0
    passed = 0

    def noted(
        kind: str, of: str, point: Point, value: float | None = None, told: str = "", through: Met | None = None
    ) -> Found:
        place = (start + way * float(point.y[-1])) * unit
        return Found(Limit(kind, of, place, place if value is None else value, None, told), point, through)

    if begin is not None and rests(begin):
        yield noted("input dead point", pair, begin)
    before: _End | None = None
    for piece in parts:
        arc = piece.arc
        if before is None or arc.exact:
            before = watched.end(curve, arc.at(curve, piece.first))
        after = watched.end(
            curve, piece.dead or (arc.after if piece.last == arc.ends[1] else arc.at(curve, piece.last))
        )
        for k, output in enumerate(watched.pairs):
            still = STILL * (setup.unit if output.drive_kind is Kind.LENGTH else 1.0)
            for x in _turns(watched, curve, piece, (before, after), k, still):
                point = arc.at(curve, x)
                yield noted("stroke end", output.name, point, float(watched.along(curve, point)[k, 0]))
        for each in met(walk, last)[passed:]:
            if not (each.passed.starts or np.array_equal(each.passed.crossing.y, arc.after.y)):
                break  # farther on: a walk that has gone its whole way knows them all
            yield noted("change point", pair, each.passed.crossing.ways[0], None, crossed(setup, each), each)
            passed += 1
        if piece.dead is not None and piece.first != piece.last:
            yield noted("input dead point", pair, piece.dead)
        before = after
    if walk.ending is Ending.SPENT:
        told = "what lies beyond was not followed: it takes more work than one answer may; name a nearer range"
        yield noted("not followed further", pair, walk.here, None, told)


def _turns(
    watched: Outputs, curve: Curve, piece: Piece, ends: tuple[_End, _End], k: int, still: float
) -> Iterator[float]:
    """Where on a piece an output turns back: places on the arc's axis."""
    arc = piece.arc
    (_, g0, s0), (_, g1, s1) = (end.gains[k] for end in ends)
    sense = 1.0 if piece.last > piece.first else -1.0

    def rate(x: float) -> float:
        return float(watched.along(curve, arc.at(curve, x))[k, 1])

    if max(abs(g0), abs(g1)) < still:
        return
    # where a piece starts or ends in the very turn, the sign of its rate there is rounding
    none = ROUNDING * still / STILL
    for end, x, g, s in ((ends[0], piece.first, g0, s0), (ends[1], piece.last, g1, s1)):
        if abs(g) < none and abs(s) > still and not rests(end.point):
            yield x
            return
    # what only turns back since the input does, at a dead point, has no end of its stroke there
    g0 = none * s0 if abs(g0) < none and rests(ends[0].point) else g0
    g1 = -none * s1 if abs(g1) < none and rests(ends[1].point) else g1
    if g0 * g1 < 0.0:
        yield root(rate, piece.first, piece.last)
    elif g0 * s0 < 0.0 < g1 * s1 and g0 * g1 > 0.0:
        # both ends go one way, but the output may have gone back in between
        gone, up = abs(piece.last - piece.first), float(np.sign(g0))
        parts = np.linspace(0.05, 0.95, 19)
        least, part = min((cubic(up * g0, up * s0 * gone, up * g1, up * s1 * gone, part), part) for part in parts)
        middle = piece.first + sense * part * gone
        if least < 0.0 and up * rate(middle) < -still:
            yield root(rate, piece.first, middle)
            yield root(rate, middle, piece.last)


def _named(setup: Setup, watched: Outputs, curve: Curve, pair: str, found: list[Found]) -> Iterator[Limit]:
    """The limits, with the two ends of every slide told apart by how far they are from the driving crank's pin."""
    frame = setup.mechanism.frame
    driving = setup.named[pair]
    pins = [each for each in driving.coincident() if each[0] == frame] if driving.drive_kind is Kind.ANGLE else []
    ends: dict[str, tuple[float, float, bool]] = {}
    for output in watched.pairs:
        if output.drive_kind is not Kind.LENGTH or frame not in output.links:
            continue
        of = [
            (limit.value, point) for limit, point, _ in found if limit.kind == "stroke end" and limit.of == output.name
        ]
        if len(of) < 2:
            continue
        (low, at_low), (high, at_high) = min(of, key=lambda each: each[0]), max(of, key=lambda each: each[0])
        if high - low <= SAME * setup.unit:
            continue
        far = True
        if pins and output.rides() is not None:
            distances = [watched.distance(curve, point, output, pins[0]) for point in (at_low, at_high)]
            far = distances[1] >= distances[0] - SAME * setup.unit
        ends[output.name] = (low, high, far)
    for limit, _, _ in found:
        if limit.kind != "stroke end" or limit.of not in ends:
            yield limit
            continue
        low, high, far = ends[limit.of]
        near = SAME * setup.unit
        top = abs(limit.value - (high if far else low)) <= near
        bottom = abs(limit.value - (low if far else high)) <= near
        yield limit._replace(end="TDC" if top else "BDC" if bottom else None)
