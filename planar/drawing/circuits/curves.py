"""Circuits as curves in a plane, the input across and a chosen output up: strands, dead points, assemblies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import ceil, floor, isfinite, pi
from typing import Any, NamedTuple

import numpy as np

from planar.assemblies.circuits.circuit_of_assembly import Located
from planar.assemblies.circuits.circuits import Circuit, Circuits
from planar.drawing.diagrams.drawn_run import MOST_TURNS
from planar.drawing.diagrams.motion_curves import default_subject, known, slide_of
from planar.foundation.errors import BadInput
from planar.model.link_graph import numbered
from planar.model.mechanism import Mechanism, motions, named_points
from planar.model.pairs import Kind
from planar.results.motion import Motion
from planar.solving.cycle import cycle

Array = np.ndarray

TURN = 2.0 * pi
BESIDE = 0.08
"""Part of the range in which it goes together that is shown on either side of it."""
FEW, STRANDS, PLACES, NEAR = 12, 48, 48, 0.03
"""Circuits, strands and positions of the input at which outputs are compared, and what part of the range is seen."""
FINE, ROWS = 2, 180
"""Turns of the input up to which a circuit's own rows are fine enough, and rows for each of more."""
LEAST = 1e-6
"""Part of a turn: a gap below this is none."""


class Reading(NamedTuple):
    """An output: its name, whether it is an angle, and how it is read from a motion (n,) or a state."""

    name: str
    angle: bool
    of: Callable[[Any], Any]


class Strand(NamedTuple):
    """A part of a branch, within the window: the input and the output along it, each (n,) (SI)."""

    branch: int
    x: Array
    y: Array


class Marked(NamedTuple):
    """An assembly at the file's input: its number, where it is in the plane, whether the sketch means it."""

    number: int | None
    x: float
    y: float
    own: bool


class Chart(NamedTuple):
    """One circuit: its strands, its dead points (x, y), and the assemblies of the file's input on it."""

    circuit: Circuit
    strands: tuple[Strand, ...]
    dead: tuple[tuple[float, float], ...]
    marked: tuple[Marked, ...]
    left_out: bool
    "whether turns of the input are left out"
    others: tuple[Circuit, ...] = ()
    "circuits that look the same"


class Window(NamedTuple):
    """The part of the input's range that is shown (rad or m), what of it does not go together, and the file's place."""

    low: float
    high: float
    slides: bool
    gaps: tuple[tuple[float, float], ...]
    at: float

    def turned(self, x: Array) -> Array:
        """How many whole turns each place of the input is ahead of the window."""
        if self.slides:
            return np.zeros(np.shape(x), dtype=int)
        first = 0.5 * (self.low + self.high) - pi
        return np.floor((np.asarray(x) - first) / TURN + 1e-12).astype(int)

    def within(self, x: float) -> float:
        """The same place of the input in the window."""
        return float(x - TURN * self.turned(np.array(x)))


def telling(circuits: Circuits, shown: Window) -> str:
    """The output in which circuits and branches differ most: that of diagrams if it tells them apart, else a link."""
    mechanism = circuits.mechanism
    order = sorted(numbered(mechanism).items(), key=lambda each: -int(each[1]))
    links = [link for link, _ in order if link != mechanism.frame]
    # of several that are as good the first is taken
    return min([default_subject(mechanism), *links], key=lambda of: _alike(circuits, readings(mechanism, of)[0], shown))


def _alike(circuits: Circuits, reading: Reading, shown: Window) -> int:
    """How many pairs of strands cannot be told apart."""
    strands = [strand for each in circuits[:FEW] for strand in _chart(circuits, each, reading, shown).strands][:STRANDS]
    places = np.linspace(shown.low, shown.high, PLACES)
    found = np.array([np.interp(places, *_rising(each), left=np.nan, right=np.nan) for each in strands])
    apart = np.abs(found[:, None] - found[None])
    if reading.angle:
        apart = np.abs((apart + pi) % TURN - pi)
    most = np.nanmax(np.append(apart, 0.0))
    same = np.isnan(apart) | (apart <= NEAR * most)
    both = ~np.isnan(apart).all(axis=2)
    return int(np.sum(np.triu(same.all(axis=2) & both, 1)))


def readings(mechanism: Mechanism, of: str) -> tuple[Reading, ...]:
    """The output of a name as in diagrams: of a slide, a link or a pair; of a point its x and its y."""
    named = motions(mechanism)
    slide = slide_of(mechanism, of)
    if slide is None and any(
        of in (each.name, *(f"{link}.{own}" for link, own in each.members)) for each in named_points(mechanism)
    ):
        return tuple(
            Reading(f"{axis} of {of}", False, lambda moving, k=k: moving.point(of).position[..., k])
            for k, axis in enumerate("xy")
        )
    if slide is None and any(link.name == of for link in mechanism.links):
        return (Reading(f"angle of {of}", True, lambda moving: moving.link(of).angle),)
    pair = named.get(slide or of)
    if pair is None:
        raise BadInput(of, f"there is no pair, point or link of this name; {known(mechanism)}")
    first = next(iter(pair.reports))
    angle = pair.drive_kind is not Kind.LENGTH
    return (Reading(f"{first} at {slide or of}", angle, lambda moving: moving.pair(slide or of)[first]),)


def window(circuits: Circuits) -> Window:
    """The range of the input in which it goes together, with a little on both sides, or a whole turn."""
    slides = motions(circuits.mechanism)[circuits.pair].drive_kind is Kind.LENGTH
    at = next(given.position for given in circuits.mechanism.inputs if given.pair == circuits.pair)
    if slides:
        ends = [end for both in circuits.assembles for end in both if isfinite(end)]
        ends += [float(x) for each in circuits for x in _input(circuits, each.motion)[[0, -1]]] if not ends else []
        low, high = min(*ends, at), max(*ends, at)
        beside = BESIDE * (high - low) or 1e-3
        shown = (low - beside, high + beside)
        inner = sorted((max(a, shown[0]), min(b, shown[1])) for a, b in circuits.assembles)
        return Window(*shown, True, _between(inner, *shown), at)
    going = sorted((a - TURN * floor(a / TURN), b - TURN * floor(a / TURN)) for a, b in circuits.assembles)
    gaps = [(b, a) for (_, b), (a, _) in pairwise([*going, (going[0][0] + TURN, 0.0)]) if a - b > LEAST]
    if not gaps:
        return Window(0.0, TURN, False, (), at % TURN)
    widest = max(gaps, key=lambda gap: gap[1] - gap[0])
    half = 0.5 * (widest[1] - widest[0])
    first = widest[1] - half  # the middle of the widest gap, where nothing is cut
    place = first + (at - first) % TURN
    low, high = widest[1], widest[0] + TURN
    beside = min(half, BESIDE * (high - low))
    low, high = max(first, min(low, place) - beside), min(first + TURN, max(high, place) + beside)
    back = TURN * ceil((0.5 * (low + high) - 1.5 * pi) / TURN)  # so that its middle is from -90 to 270 degrees
    low, high, place = low - back, high - back, place - back
    here = sorted(
        (max(a + TURN * k, low), min(b + TURN * k, high))
        for a, b in going
        for k in (-2, -1, 0, 1)
        if a + TURN * k < high and b + TURN * k > low
    )
    return Window(low, high, False, _between(here, low, high), place)


def _between(going: Sequence[tuple[float, float]], low: float, high: float) -> tuple[tuple[float, float], ...]:
    """What sorted intervals leave of a range."""
    edges = [low, *(end for both in going for end in both), high]
    return tuple((a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > LEAST * (high - low))


def charts(
    circuits: Circuits, drawn: Sequence[Circuit], reading: Reading, shown: Window, lying: Sequence[Located]
) -> list[Chart]:
    """Some of the circuits in the plane of the input and an output, angles where all lie nearest together."""
    found = [_chart(circuits, each, reading, shown) for each in drawn]
    if reading.angle:
        found = _together(found)
    return [
        each._replace(marked=tuple(_marks(each, reading, [of for of in lying if of.on(each.circuit)], shown.at)))
        for each in found
    ]


def _chart(circuits: Circuits, circuit: Circuit, reading: Reading, shown: Window) -> Chart:
    """A circuit without marks; an angle has the turns with which it was followed."""
    motion, branch, left_out = _course(circuits, circuit, shown.slides)
    closed = circuit.closed and not left_out
    x, y = _input(circuits, motion), np.array(reading.of(motion), dtype=float)
    gain = TURN * round(float(y[-1] - y[0]) / TURN) if reading.angle and closed else 0.0
    changes = np.flatnonzero(np.diff(branch))
    if closed and len(changes):
        # from a dead point on, so that no branch is cut where the motion was started
        first = int(changes[0])
        order = [*range(first, len(x)), *range(1, first + 1)]
        y = np.concatenate([y[first:], y[1 : first + 1] + gain])
        x, branch = x[order], branch[order]
        changes = np.flatnonzero(np.diff(branch))
    strands = _strands(x, y, branch, shown)
    if len(strands) > 1 and not len(changes) and closed:
        # where the motion was started the last strand goes on as the first
        start, last = strands[0], strands[-1]
        x, y = np.concatenate([last.x[:-1], start.x]), np.concatenate([last.y[:-1] - gain, start.y])
        strands = [Strand(start.branch, x, y), *strands[1:-1]]
    again = [len(x) - 1] if closed and len(changes) and gain else []  # the first dead point, turns of the output on
    return Chart(
        circuit, tuple(strands), tuple((shown.within(x[k]), float(y[k])) for k in (*changes, *again)), (), left_out
    )


def _course(circuits: Circuits, circuit: Circuit, slides: bool) -> tuple[Motion, Array, bool]:
    """What is drawn of a circuit, the branch of each row, and whether that is not the whole of it.

    Where the input makes many turns there are rows for every turn, and some turns are left out.
    """
    low, high = min(each.low for each in circuit.branches), max(each.high for each in circuit.branches)
    turns = ceil((high - low) / TURN - LEAST)
    if slides or len(circuit.branches) > 1 or turns <= FINE:
        return circuit.motion, circuit.branch, False
    shown = min(turns, MOST_TURNS)
    start, stop = low, high
    if circuit.closed or shown < turns:
        start = next(given.position for given in circuit.mechanism.inputs if given.pair == circuits.pair)
        stop = start + shown * TURN
    motion = cycle(circuit.mechanism, shown * ROWS, start, stop, circuits.pair)
    return motion, np.full(len(motion), circuit.branches[0].number), shown < turns


def _together(found: Sequence[Chart]) -> list[Chart]:
    """The same with every circuit's angles shifted by whole turns, the widest range without any cut."""
    parts = [part for each in found for part in _parts(each)]
    lows = [min(float(strand.y.min()) for strand in part) for part in parts]
    highs = [max(float(strand.y.max()) for strand in part) for part in parts]
    ranges = sorted((low % TURN, low % TURN + high - low) for low, high in zip(lows, highs, strict=True))
    cut, widest, reached = 0.0, 0.0, max(high for _, high in ranges) - TURN
    for low, high in ranges:
        if low - reached > widest:
            cut, widest = low, low - reached
        reached = max(reached, high)
    if cut > pi:
        cut -= TURN

    def off(part: Sequence[Strand]) -> float:
        low = min(float(strand.y.min()) for strand in part)
        return TURN * floor((low - cut) / TURN + 1e-9)

    shifted = []
    for each in found:
        moved = [strand._replace(y=strand.y - off(part)) for part in _parts(each) for strand in part]
        dead = tuple((x, y - off(each.strands)) for x, y in each.dead)
        shifted.append(each._replace(strands=tuple(moved), dead=dead))
    return shifted


def _parts(each: Chart) -> list[tuple[Strand, ...]]:
    """Strands that keep their places to each other: of an input that makes several turns every turn is by itself."""
    return [each.strands] if each.dead else [(strand,) for strand in each.strands]


def _input(circuits: Circuits, motion: Motion) -> Array:
    return np.asarray(motion.inputs[circuits.pair].position, dtype=float)


def _strands(x: Array, y: Array, branch: Array, shown: Window) -> list[Strand]:
    """The curve cut where the branch changes, at the dead point, and where the input leaves the window."""
    found: list[Strand] = []
    turns = shown.turned(x)
    xs, ys = [x[0] - TURN * turns[0]], [y[0]]

    def end() -> None:
        if len(xs) > 1:
            found.append(Strand(int(now), np.array(xs), np.array(ys)))

    now = branch[0]
    for k in range(1, len(x)):
        if branch[k] != now:
            end()
            now, xs, ys = branch[k], xs[-1:], ys[-1:]
        if turns[k] != turns[k - 1]:
            ahead = turns[k] > turns[k - 1]
            edge = 0.5 * (shown.low + shown.high) + (pi if ahead else -pi)
            part = (edge - (x[k - 1] - TURN * turns[k - 1])) / (x[k] - x[k - 1])
            across = y[k - 1] + part * (y[k] - y[k - 1])
            xs, ys = [*xs, edge], [*ys, across]
            end()
            xs, ys = [edge - TURN if ahead else edge + TURN], [across]
        xs.append(x[k] - TURN * turns[k])
        ys.append(y[k])
    end()
    return found


def _marks(each: Chart, reading: Reading, lying: Sequence[Located], at: float) -> Iterator[Marked]:
    """Where the assemblies of the file's input are on the strands of their branches; not those without a state."""
    for located in lying:
        state, branch = located.mode.state, located.branch
        there = [
            float(np.interp(at, *_rising(strand)))
            for strand in each.strands
            if branch is not None and strand.branch == branch.number and strand.x.min() <= at <= strand.x.max()
        ]
        if state is None or not there:
            continue
        apart = np.array(there) - float(reading.of(state))
        if reading.angle:
            apart = (apart + pi) % TURN - pi
        yield Marked(located.mode.number, at, there[int(np.argmin(np.abs(apart)))], located.own)


def _rising(strand: Strand) -> tuple[Array, Array]:
    order = np.argsort(strand.x)
    return strand.x[order], strand.y[order]
