"""Circuits as curves in a plane, the input across and a chosen output up: strands, dead points, assemblies."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import ceil, floor, isfinite, pi
from typing import Any, NamedTuple

import numpy as np

from planar.assemblies.circuits.circuit_of_assembly import LocatedAssembly
from planar.assemblies.circuits.circuits import Circuit, Circuits
from planar.drawing.diagrams.drawn_run import MAX_TURNS
from planar.drawing.diagrams.motion_curves import available_names, default_subject, find_slide
from planar.foundation.angles import window_start
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.link_graph import link_numbers
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion
from planar.solving.cycle import cycle

FULL_TURN = 2.0 * pi
RANGE_MARGIN = 0.08
"""Part of the range in which it goes together that is shown on either side of it."""
MAX_COMPARED_CIRCUITS, MAX_COMPARED_CURVES, COMPARED_POSITIONS, SAME_OUTPUT_RATIO = 12, 48, 48, 0.03
"""Circuits, strands and positions of the input at which outputs are compared, and what part of the range is seen."""
FINE_TURNS, ROWS_PER_TURN = 2, 180
"""Turns of the input up to which a circuit's own rows are fine enough, and rows for each of more."""
END_TOLERANCE = 1e-5
"""Part of a curve: an assembly this near to its end lies on it."""
MIN_GAP_RATIO = 1e-6
"""Part of a turn: a gap below this is none."""


class PlottedOutput(NamedTuple):
    """An output: its name, whether it is an angle, and how it is read from a motion (n,) or a state."""

    name: str
    is_angle: bool
    read: Callable[[Any], Any]


class BranchCurve(NamedTuple):
    """A part of a branch, within the window: the input and the output along it, each (n,) (SI)."""

    branch: int
    x: Array
    y: Array


class MarkedAssembly(NamedTuple):
    """An assembly at the file's input: its number, where it is in the plane, whether the sketch means it."""

    number: int | None
    x: float
    y: float
    is_sketch: bool


class CircuitChart(NamedTuple):
    """One circuit: its strands, its dead points (x, y), and the assemblies of the file's input on it."""

    circuit: Circuit
    branch_curves: tuple[BranchCurve, ...]
    dead_points: tuple[tuple[float, float], ...]
    marked_assemblies: tuple[MarkedAssembly, ...]
    left_out: bool
    "whether turns of the input are left out"
    equal_circuits: tuple[Circuit, ...] = ()
    "circuits that look the same"


class InputWindow(NamedTuple):
    """The part of the input's range that is shown (rad or m), what of it does not go together, and the file's place."""

    low: float
    high: float
    is_length: bool
    gaps: tuple[tuple[float, float], ...]
    input_position: float

    def turns_ahead(self, x: Array) -> Array:
        """How many whole turns each place of the input is ahead of the window."""
        if self.is_length:
            return np.zeros(np.shape(x), dtype=int)
        first = 0.5 * (self.low + self.high) - pi
        return np.floor((np.asarray(x) - first) / FULL_TURN + 1e-12).astype(int)

    def wrap(self, x: float) -> float:
        """The same place of the input in the window."""
        return float(x - FULL_TURN * self.turns_ahead(np.array(x)))


class DrawnMotion(NamedTuple):
    """What is drawn of a circuit, the branch of each row, and whether that is not the whole of it."""

    circuit: Circuit
    motion: Motion
    branch: Array
    left_out: bool


def choose_output(circuits: Circuits, motions: Sequence[DrawnMotion], shown: InputWindow) -> str:
    """The output in which circuits and branches differ most: that of diagrams if it tells them apart, else a link."""
    mechanism = circuits.mechanism
    order = sorted(link_numbers(mechanism).items(), key=lambda each: -int(each[1]))
    links = [link for link, _ in order if link != mechanism.frame]
    # of several that are as good the first is taken
    return min(
        [default_subject(mechanism), *links],
        key=lambda of: _count_indistinguishable(circuits, motions, plotted_outputs(mechanism, of)[0], shown),
    )


def _count_indistinguishable(
    circuits: Circuits, motions: Sequence[DrawnMotion], reading: PlottedOutput, shown: InputWindow
) -> int:
    """How many pairs of strands cannot be told apart."""
    strands = [
        strand
        for each in motions[:MAX_COMPARED_CIRCUITS]
        for strand in _circuit_chart(circuits, each, reading, shown).branch_curves
    ][:MAX_COMPARED_CURVES]
    places = np.linspace(shown.low, shown.high, COMPARED_POSITIONS)
    found = np.array([np.interp(places, *_sorted_by_input(each), left=np.nan, right=np.nan) for each in strands])
    apart = np.abs(found[:, None] - found[None])
    if reading.is_angle:
        apart = np.abs((apart + pi) % FULL_TURN - pi)
    most = np.nanmax(np.append(apart, 0.0))
    same = np.isnan(apart) | (apart <= SAME_OUTPUT_RATIO * most)
    both = ~np.isnan(apart).all(axis=2)
    return int(np.sum(np.triu(same.all(axis=2) & both, 1)))


def plotted_outputs(mechanism: Mechanism, of: str) -> tuple[PlottedOutput, ...]:
    """The output of a name as in diagrams: of a slide, a link or a pair; of a point its x and its y."""
    named = relative_motions(mechanism)
    slide = find_slide(mechanism, of)
    if slide is None and any(
        of in (each.name, *(f"{link}.{own}" for link, own in each.members)) for each in named_points(mechanism)
    ):
        return tuple(PlottedOutput(f"{axis} of {of}", False, _coordinate_of(of, k)) for k, axis in enumerate("xy"))
    if slide is None and any(link.name == of for link in mechanism.links):
        return (PlottedOutput(f"angle of {of}", True, lambda moving: moving.link(of).angle),)
    pair = named.get(slide or of)
    if pair is None:
        raise BadInput(of, f"there is no pair, point or link of this name; {available_names(mechanism)}")
    first = next(iter(pair.result_kinds))
    angle = pair.input_kind is not MeasureKind.LENGTH
    return (PlottedOutput(f"{first} at {slide or of}", angle, lambda moving: moving.pair(slide or of)[first]),)


def _coordinate_of(point: str, axis: int) -> Callable[[Any], Any]:
    return lambda moving: moving.point(point).position[..., axis]


def input_window(circuits: Circuits) -> InputWindow:
    """The range of the input in which it goes together, with a little on both sides, or a whole turn."""
    slides = relative_motions(circuits.mechanism)[circuits.pair].input_kind is MeasureKind.LENGTH
    at = next(given.position for given in circuits.mechanism.inputs if given.pair == circuits.pair)
    if slides:
        ends = [end for both in circuits.assembles for end in both if isfinite(end)]
        ends += (
            [float(x) for each in circuits for x in _input_positions(circuits, each.motion)[[0, -1]]]
            if not ends
            else []
        )
        low, high = min(*ends, at), max(*ends, at)
        beside = RANGE_MARGIN * (high - low) or 1e-3
        shown = (low - beside, high + beside)
        inner = sorted((max(a, shown[0]), min(b, shown[1])) for a, b in circuits.assembles)
        return InputWindow(*shown, True, _gaps_between(inner, *shown), at)
    written = sorted(circuits.assembles)
    going = sorted(
        (a - FULL_TURN * floor(a / FULL_TURN), b - FULL_TURN * floor(a / FULL_TURN)) for a, b in circuits.assembles
    )
    gaps = [(b, a) for (_, b), (a, _) in pairwise([*going, (going[0][0] + FULL_TURN, 0.0)]) if a - b > MIN_GAP_RATIO]
    if not gaps:
        first = _full_turn_start(circuits, at)
        return InputWindow(first, first + FULL_TURN, False, (), first + (at - first) % FULL_TURN)
    # the turn is cut in the middle of a gap: beside the intervals as tables write them, if they lie in one turn
    around = (written[-1][1], written[0][0] + FULL_TURN)
    fits = around[1] - around[0] > MIN_GAP_RATIO
    cut = around if fits else max(gaps, key=lambda gap: gap[1] - gap[0])
    half = 0.5 * (cut[1] - cut[0])
    low, high = (cut[1] - FULL_TURN, cut[0]) if fits else (cut[1], cut[0] + FULL_TURN)
    first = low - half
    place = first + (at - first) % FULL_TURN
    beside = min(half, RANGE_MARGIN * (high - low))
    low, high = max(first, min(low, place) - beside), min(first + FULL_TURN, max(high, place) + beside)
    if not fits:
        low, high, place = low + at - place, high + at - place, at
    here = sorted(
        (max(a + FULL_TURN * k, low), min(b + FULL_TURN * k, high))
        for a, b in going
        for k in range(floor((low - FULL_TURN) / FULL_TURN) - 1, ceil(high / FULL_TURN) + 1)
        if a + FULL_TURN * k < high and b + FULL_TURN * k > low
    )
    return InputWindow(low, high, False, _gaps_between(here, low, high), place)


def _full_turn_start(circuits: Circuits, position: float) -> float:
    """Where a window of a whole turn starts: so that branches lie in it as tables write them, if one turn holds all."""
    ends = [end for each in circuits for branch in each.branches if not branch.turns for end in branch[1:3]]
    usual = window_start(position)
    low, high = min(ends, default=usual), max(ends, default=usual)
    middle = 0.5 * (low + high - FULL_TURN)
    return next((first for first in (usual, 0.0, -pi, middle) if first <= low and high <= first + FULL_TURN), usual)


def _gaps_between(going: Sequence[tuple[float, float]], low: float, high: float) -> tuple[tuple[float, float], ...]:
    """What sorted intervals leave of a range."""
    edges = [low, *(end for both in going for end in both), high]
    return tuple((a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > MIN_GAP_RATIO * (high - low))


def circuit_charts(
    circuits: Circuits,
    motions: Sequence[DrawnMotion],
    reading: PlottedOutput,
    shown: InputWindow,
    assemblies: Sequence[LocatedAssembly],
) -> list[CircuitChart]:
    """Some of the circuits in the plane of the input and an output, angles where all lie nearest together."""
    found = [_circuit_chart(circuits, each, reading, shown) for each in motions]
    if reading.is_angle:
        found = _align_angles(found)
    return [
        each._replace(
            marked_assemblies=tuple(
                _mark_assemblies(
                    each, reading, [of for of in assemblies if of.is_on(each.circuit)], shown.input_position
                )
            )
        )
        for each in found
    ]


def _circuit_chart(circuits: Circuits, drawn: DrawnMotion, reading: PlottedOutput, shown: InputWindow) -> CircuitChart:
    """A circuit without marks; an angle has the turns with which it was followed."""
    circuit, motion, branch, left_out = drawn
    closed = circuit.closed and not left_out
    x, y = _input_positions(circuits, motion), np.array(reading.read(motion), dtype=float)
    gain = FULL_TURN * round(float(y[-1] - y[0]) / FULL_TURN) if reading.is_angle and closed else 0.0
    changes = np.flatnonzero(np.diff(branch))
    if closed and len(changes):
        # from a dead point on, so that no branch is cut where the motion was started
        first = int(changes[0])
        order = [*range(first, len(x)), *range(1, first + 1)]
        y = np.concatenate([y[first:], y[1 : first + 1] + gain])
        x, branch = x[order], branch[order]
        changes = np.flatnonzero(np.diff(branch))
    strands = _cut_into_curves(x, y, branch, shown)
    if len(strands) > 1 and not len(changes) and closed:
        # where the motion was started the last strand goes on as the first
        start, last = strands[0], strands[-1]
        x, y = np.concatenate([last.x[:-1], start.x]), np.concatenate([last.y[:-1] - gain, start.y])
        strands = [BranchCurve(start.branch, x, y), *strands[1:-1]]
    again = [len(x) - 1] if closed and len(changes) and gain else []  # the first dead point, turns of the output on
    return CircuitChart(
        circuit, tuple(strands), tuple((shown.wrap(x[k]), float(y[k])) for k in (*changes, *again)), (), left_out
    )


def drawn_motion(circuits: Circuits, circuit: Circuit, shown: InputWindow) -> DrawnMotion:
    """The motion that is drawn of a circuit.

    Where the input makes many turns there are rows for every turn, and some turns are left out.
    """
    low, high = min(each.low for each in circuit.branches), max(each.high for each in circuit.branches)
    turns = ceil((high - low) / FULL_TURN - MIN_GAP_RATIO)
    if shown.is_length or len(circuit.branches) > 1 or turns <= FINE_TURNS:
        return DrawnMotion(circuit, circuit.motion, circuit.branch, False)
    drawn = min(turns, MAX_TURNS)
    start, stop = circuit.home_range
    if circuit.closed or drawn < turns:
        start = next(given.position for given in circuit.mechanism.inputs if given.pair == circuits.pair)
        stop = start + drawn * FULL_TURN
    motion = cycle(circuit.mechanism, drawn * ROWS_PER_TURN, start, stop, circuits.pair)
    return DrawnMotion(circuit, motion, np.full(len(motion), circuit.branches[0].number), drawn < turns)


def _align_angles(found: Sequence[CircuitChart]) -> list[CircuitChart]:
    """The same with every circuit's angles shifted by whole turns, the widest range without any cut."""
    parts = [part for each in found for part in _rigid_groups(each)]
    lows = [min(float(strand.y.min()) for strand in part) for part in parts]
    highs = [max(float(strand.y.max()) for strand in part) for part in parts]
    ranges = sorted((low % FULL_TURN, low % FULL_TURN + high - low) for low, high in zip(lows, highs, strict=True))
    cut, widest, reached = 0.0, 0.0, max(high for _, high in ranges) - FULL_TURN
    for low, high in ranges:
        if low - reached > widest:
            cut, widest = low, low - reached
        reached = max(reached, high)
    if cut > pi:
        cut -= FULL_TURN

    def off(part: Sequence[BranchCurve]) -> float:
        low = min(float(strand.y.min()) for strand in part)
        return FULL_TURN * floor((low - cut) / FULL_TURN + 1e-9)

    shifted = []
    for each in found:
        moved = [strand._replace(y=strand.y - off(part)) for part in _rigid_groups(each) for strand in part]
        dead = tuple((x, y - off(each.branch_curves)) for x, y in each.dead_points)
        shifted.append(each._replace(branch_curves=tuple(moved), dead_points=dead))
    return shifted


def _rigid_groups(each: CircuitChart) -> list[tuple[BranchCurve, ...]]:
    """Strands that keep their places to each other: of an input that makes several turns every turn is by itself."""
    return [each.branch_curves] if each.dead_points else [(strand,) for strand in each.branch_curves]


def _input_positions(circuits: Circuits, motion: Motion) -> Array:
    return np.asarray(motion.inputs[circuits.pair].position, dtype=float)


def _cut_into_curves(x: Array, y: Array, branch: Array, shown: InputWindow) -> list[BranchCurve]:
    """The curve cut where the branch changes, at the dead point, and where the input leaves the window."""
    found: list[BranchCurve] = []
    turns = shown.turns_ahead(x)
    xs, ys = [x[0] - FULL_TURN * turns[0]], [y[0]]

    def end() -> None:
        if len(xs) > 1:
            found.append(BranchCurve(int(now), np.array(xs), np.array(ys)))

    now = branch[0]
    for k in range(1, len(x)):
        if branch[k] != now:
            end()
            now, xs, ys = branch[k], xs[-1:], ys[-1:]
        if turns[k] != turns[k - 1]:
            ahead = turns[k] > turns[k - 1]
            edge = 0.5 * (shown.low + shown.high) + (pi if ahead else -pi)
            part = (edge - (x[k - 1] - FULL_TURN * turns[k - 1])) / (x[k] - x[k - 1])
            across = y[k - 1] + part * (y[k] - y[k - 1])
            xs, ys = [*xs, edge], [*ys, across]
            end()
            xs, ys = [edge - FULL_TURN if ahead else edge + FULL_TURN], [across]
        xs.append(x[k] - FULL_TURN * turns[k])
        ys.append(y[k])
    end()
    return found


def _mark_assemblies(
    each: CircuitChart, reading: PlottedOutput, lying: Sequence[LocatedAssembly], at: float
) -> Iterator[MarkedAssembly]:
    """Where the assemblies of the file's input are on the strands of their branches; not those without a state."""
    for located in lying:
        state, branch = located.mode.state, located.branch
        there = [
            float(np.interp(at, *_sorted_by_input(strand)))
            for strand in each.branch_curves
            if branch is not None
            and strand.branch == branch.number
            # a curve stops short of the ends of a branch
            and strand.x.min() - END_TOLERANCE * np.ptp(strand.x)
            <= at
            <= strand.x.max() + END_TOLERANCE * np.ptp(strand.x)
        ]
        if state is None or not there:
            continue
        apart = np.array(there) - float(reading.read(state))
        if reading.is_angle:
            apart = (apart + pi) % FULL_TURN - pi
        yield MarkedAssembly(located.mode.number, at, there[int(np.argmin(np.abs(apart)))], located.is_sketched)


def _sorted_by_input(strand: BranchCurve) -> tuple[Array, Array]:
    order = np.argsort(strand.x)
    return strand.x[order], strand.y[order]
