"""A catalogue of random designs of one structure with their motion, and those of them that come near to a task.

Where links stand is drawn at random, and so are the free numbers; then numbers and places are changed together as
little as closes all equations (Newton's steps of least norm). Closure is linear in lengths and coordinates, so that
nearly every draw becomes a design, where hardly any set of random lengths can be assembled.
"""

from __future__ import annotations

import cmath
import hashlib
import io
import json
from collections.abc import Iterator
from dataclasses import dataclass
from math import log, pi
from typing import Any, NamedTuple

import numpy as np

from planar.document.writer import write_mechanism
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.jets import TURN
from planar.foundation.private_cache import PrivateCache
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.synthesis.fitting.wanted_equations import CLOSED, WantedEquations, tangents
from planar.synthesis.task.starts import FreeNumbers
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction, WantedPath, WantedPoses

STEPS = 72
"""Of a turn, or of as far as a slide may go."""
SLIDE_RANGE = 4.0
"""Of the mechanism's size: how far a slide that runs is followed."""
MAX_TURN = 0.35
"""rad, or of the size: how much any unknown changes in a step; shorter steps towards dead points."""
MAX_STEPS = 110
LEAST_RATE = 0.03
"""Of the input beside all unknowns, along the path: where it is less a dead point is near, and the branch ends."""


def follow_branches(equations: WantedEquations, x: Array, y: Array) -> tuple[Array, BoolArray]:
    """The unknowns (designs, steps, unknowns) along each design's branch, the input rising, NaN beyond its ends; and
    which designs turn fully (designs,)."""
    forward, is_whole = _follow(equations, x, y, 1.0)
    part = np.flatnonzero(~is_whole)
    back, _ = _follow(equations, x[part], y[part], -1.0)
    joined = np.full((len(x), 2 * MAX_STEPS + 1, y.shape[1]), np.nan)
    joined[:, MAX_STEPS:] = forward
    joined[part, : MAX_STEPS + 1] = back[:, ::-1]
    return joined, is_whole


def _follow(equations: WantedEquations, x: Array, y: Array, sense: float) -> tuple[Array, BoolArray]:
    turns = equations.design.equations.input_kinds[0] is not MeasureKind.LENGTH
    span = 2.0 * pi if turns else SLIDE_RANGE * equations.design.solver.unit / equations.input_scale
    found = np.full((len(x), MAX_STEPS + 1, y.shape[1]), np.nan)
    found[:, 0] = y
    rows, here = np.arange(len(x)), y[:, None]
    way = np.zeros_like(here)
    way[..., -1] = sense
    tangent = _along(equations, x, here, way)
    is_whole = np.zeros(len(x), bool)
    for step in range(1, MAX_STEPS + 1):
        if not len(rows):
            break
        rate = np.abs(tangent[:, 0, -1])
        left = span - np.abs(here[:, 0, -1] - y[rows, -1])
        length = np.minimum(span / STEPS, left) / np.maximum(rate, 1e-9)
        length = np.minimum(length, MAX_TURN / np.maximum(np.abs(tangent[:, 0]).max(axis=1), 1e-9))
        there = here + length[:, None, None] * tangent
        there, _ = equations.close(x[rows], there, tangent, 3)
        after = _along(equations, x[rows], there, tangent)
        F, _ = equations.closure_at(x[rows], there)
        good: BoolArray = np.asarray(np.abs(F).max(axis=(1, 2), initial=0.0) < CLOSED)
        good &= np.isfinite(there).all(axis=(1, 2))
        good &= sense * after[:, 0, -1] > LEAST_RATE
        good &= np.abs(there - here).max(axis=(1, 2)) < 2.0 * MAX_TURN
        found[rows[good], step] = there[good, 0]
        done = good & (np.abs(there[:, 0, -1] - y[rows, -1]) > span * (1.0 - 1e-6))
        is_whole[rows[done]] = turns
        on = good & ~done
        rows, here, tangent = rows[on], there[on], after[on]
    return found, is_whole


def _along(equations: WantedEquations, x: Array, y: Array, before: Array) -> Array:
    """Unit vectors along the path, in the sense of those before."""
    jacobian = equations.jacobians(x, y)
    if not jacobian.shape[2]:
        return np.broadcast_to(before, y.shape).copy()
    found = tangents(np.where(np.isfinite(jacobian), jacobian, 0.0))
    sense = np.where(np.sum(found * before, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    told: Array = sense * found
    return told


CLOSING_STEPS, DRAW_RESIDUAL = 24, 1e-9
MOBILITY_OF_PLACES = 0.1
"""How readily places change to close a design, beside numbers."""
NEAR_SHARE, NEAR_SPREAD = 0.25, 0.25
"""Of designs near the start, and how far from it they are, of the numbers and the size."""
LENGTH_RANGE = (0.12, 1.6)
"""Of the mechanism's size: between which lengths are drawn, evenly by their logarithm."""
COORDINATE_RANGE = 0.9
"""Of the size: how far coordinates go, either way."""
LEAST_LENGTH = 0.02


def draw_designs(
    equations: WantedEquations, free: FreeNumbers, count: int, random: np.random.Generator
) -> tuple[Array, Array]:
    """Scaled free numbers (designs, free), and unknowns (designs, unknowns) at which each goes together; fewer than
    `count` of them."""
    lower, upper = free.lower / equations.scale, free.upper / equations.scale
    start = free.values / equations.scale
    unit = equations.design.solver.unit / equations.unit
    x = draw_numbers(equations, free, count, random, unit)
    y = draw_places(equations, count, random, 1.0)
    near = random.random(count) < NEAR_SHARE
    x[near] = start * (1.0 + NEAR_SPREAD * random.normal(size=(int(near.sum()), len(start))))
    x = np.clip(x, lower, upper)
    least = np.where(is_positive(free), np.maximum(lower, 2.0 * LEAST_LENGTH), lower)
    x, y = _close(equations, x, y, least, upper)
    F, _ = equations.closure_at(x, y[:, None])
    good: BoolArray = np.asarray(np.abs(F).max(axis=(1, 2), initial=0.0) < DRAW_RESIDUAL)
    good &= ((x >= lower - 1e-12) & (x <= upper + 1e-12)).all(axis=1)
    good &= (x[:, is_positive(free)] > LEAST_LENGTH).all(axis=1)
    return x[good], y[good]


def is_positive(free: FreeNumbers) -> BoolArray:
    """The numbers that are lengths of something, not coordinates: these are above zero."""
    return np.array(
        [
            kind == "length" and not name.endswith((".x", ".y"))
            for name, kind in zip(free.names, free.kinds, strict=True)
        ],
        dtype=bool,
    )


def draw_numbers(
    equations: WantedEquations, free: FreeNumbers, count: int, random: np.random.Generator, unit: float
) -> Array:
    """Random free numbers (designs, free), scaled, of designs of about the size `unit`."""
    lower, upper = free.lower / equations.scale, free.upper / equations.scale
    start = free.values / equations.scale
    found = np.empty((count, len(free.names)))
    for k, (positive, kind) in enumerate(zip(is_positive(free), free.kinds, strict=True)):
        if np.isfinite(lower[k]) and np.isfinite(upper[k]):
            found[:, k] = random.uniform(lower[k], upper[k], count)
        elif positive:
            found[:, k] = unit * np.exp(random.uniform(log(LENGTH_RANGE[0]), log(LENGTH_RANGE[1]), count))
        elif kind == "length":
            found[:, k] = start[k] * random.integers(0, 2, count) + unit * COORDINATE_RANGE * random.uniform(
                -1, 1, count
            )
        elif kind == "angle":
            found[:, k] = random.uniform(-pi, pi, count)
        else:
            found[:, k] = start[k] * np.exp(random.normal(0.0, 0.5, count))
    return found


def draw_places(equations: WantedEquations, count: int, random: np.random.Generator, unit: float) -> Array:
    """Random unknowns and inputs (designs, unknowns) of designs of about the size `unit`."""
    design = equations.design
    kinds = [design.equations.coordinates[k].kind for k in design.equations.unknowns]
    kinds.append(design.equations.input_kinds[0])
    found = np.empty((count, len(kinds)))
    for k, kind in enumerate(kinds):
        if kind is MeasureKind.LENGTH:
            found[:, k] = unit * random.uniform(-1.2, 1.2, count)
        else:
            found[:, k] = random.uniform(-pi, pi, count)
    return found


def _close(equations: WantedEquations, x: Array, y: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Numbers between bounds, and unknowns, that keep the equations: steps of least norm, and back to the bounds."""
    for _ in range(CLOSING_STEPS):
        F, F_y, F_x = (each[:, 0] for each in equations.closure_slopes_at(x, y[:, None]))
        if not F.shape[1]:
            break
        slopes = np.concatenate([F_x, MOBILITY_OF_PLACES * F_y], axis=2)
        square = slopes @ slopes.swapaxes(1, 2)
        square += 1e-13 * np.eye(square.shape[1])
        step = -(slopes.swapaxes(1, 2) @ np.linalg.solve(square, F[..., None]))[..., 0]
        step = np.nan_to_num(np.clip(step, -2.0, 2.0))
        x = np.clip(x + step[:, : x.shape[1]], lower, upper)
        y = y + MOBILITY_OF_PLACES * step[:, x.shape[1] :]
    return x, y


LEAST_STEPS = 8
"""Positions that a design's branch has at least, to be of use."""


@dataclass(frozen=True)
class Catalogue:
    """Designs (designs, ...): scaled free numbers, and along each one's branch its unknowns and results."""

    numbers: Array
    "(designs, free)"
    unknowns: Array
    "(designs, steps, unknowns), NaN beyond the ends of a branch"
    values: tuple[Array, ...]
    "of each wanted item (designs, steps, parts), in units of its scales"
    is_whole: BoolArray
    "(designs,)"

    def __len__(self) -> int:
        """How many designs there are."""
        return len(self.numbers)

    def take(self, designs: IntArray) -> Catalogue:
        """Those designs (n,) of it."""
        values = tuple(value[designs] for value in self.values)
        return Catalogue(self.numbers[designs], self.unknowns[designs], values, self.is_whole[designs])


def build_catalogue(equations: tuple[WantedEquations, ...], free: FreeNumbers, count: int, seed: int = 0) -> Catalogue:
    """A catalogue from so many draws, the same for the same seed."""
    first = equations[0]
    x, y = draw_designs(first, free, count, np.random.default_rng([seed, count]))
    unknowns, is_whole = follow_branches(first, x, y)
    steps = np.isfinite(unknowns[..., 0] if unknowns.shape[2] else unknowns[..., -1]).sum(axis=1)
    kept = steps >= LEAST_STEPS
    x, unknowns, is_whole = x[kept], unknowns[kept], is_whole[kept]
    told = tuple(item.values(x, unknowns) for item in equations)
    return Catalogue(x, unknowns, told, is_whole)


CACHE = PrivateCache("catalogues", ".npz", b"planar catalogue 1\n", 2 * 2**30)


def kept_catalogue(
    start: Mechanism, equations: tuple[WantedEquations, ...], free: FreeNumbers, count: int, seed: int
) -> Catalogue:
    """The catalogue of so many draws, from disk where it is kept there, else made and kept.

    The `equations` may be of a mechanism similar to the `start`: a catalogue is without a size."""
    described = [
        write_mechanism(start),
        [str(item.rows.wanted.of) for item in equations],
        [*free.names],
        [*map(repr, (*free.lower, *free.upper))],
        count,
        seed,
    ]
    key = hashlib.sha256(json.dumps(described, sort_keys=True, default=str).encode()).hexdigest()
    content = CACHE.read(key)
    if content is not None:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            numbers, unknowns, is_whole = (file[name] for name in ("numbers", "unknowns", "is_whole"))
        values = tuple(item.values(numbers, unknowns) for item in equations)
        return Catalogue(numbers, unknowns, values, is_whole)
    found = build_catalogue(equations, free, count, seed)
    if CACHE.is_writable():
        told = io.BytesIO()
        np.savez(told, numbers=found.numbers, unknowns=found.unknowns, is_whole=found.is_whole)
        CACHE.write(key, told.getvalue())
    return found


CURVE_STARTS = 64
"""Of a closed curve, evenly by its length, at which the first entry may be."""
ARC_STARTS, ARC_SHARES = 24, (0.12, 0.18, 0.25, 0.35, 0.5, 0.7, 0.85, 1.0)
"""Of a branch: where arcs begin, and how much of it they are."""
MOST_ORDERS = 4
"""In which entries without an order are tried."""
POSE_STRIDE, MAX_TURN_MISS = 3, 0.3
"""Steps from one first pose that is tried to the next; rad that a pose may be off there."""
TURN_WEIGHT = 0.3
"""Of a turn by a rad beside a way as long as what is wanted, along a row of poses."""


class WantedItem(NamedTuple):
    """What is wanted in the scales of a catalogue, and the inputs that are given."""

    wanted: Wanted
    target: Array
    "(n, parts)"
    inputs: Array | None
    "(n,) scaled as unknowns are"
    input_is_free: bool

    @property
    def is_closed(self) -> bool:
        """Whether its entries lie round a closed curve."""
        return isinstance(self.wanted, WantedPath) and self.wanted.is_closed


def step_choices(
    catalogue: Catalogue, item: WantedItem, values: Array, most: int, stride: int
) -> Iterator[tuple[IntArray, IntArray]]:
    """Where the entries of an item may be met along the branches of designs that show `values` (designs, steps, parts):
    at most so many entries (m,), evenly, and steps (designs, choices, m), -1 for none, of every so-many-th place along
    a branch where the first may be met."""
    if item.inputs is not None:
        entries = _evenly(len(item.target), most)
        given = item.inputs[entries]
        yield entries, _timed_steps(catalogue.unknowns[..., -1], given, item, catalogue.is_whole)
        return
    if isinstance(item.wanted, WantedPoses):
        entries = _evenly(len(item.target), most)
        yield entries, _turned_steps(values[..., 2], item.target[entries, 2], stride)
    along = _lengths_along(values[..., 0] + 1j * values[..., 1])
    for order in _entry_orders(item):
        few = _evenly(len(order), most)
        fractions, entries = _entry_fractions(item, order)[few], order[few]
        if item.is_closed:
            yield entries, _closed_steps(along, fractions, catalogue.is_whole, stride)
        else:
            for steps in _arc_steps(along, fractions, catalogue.is_whole, stride):
                yield entries, steps


def _evenly(count: int, most: int) -> IntArray:
    """So many of a row at the most, its ends among them."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))


def _timed_steps(inputs: Array, given: Array, item: WantedItem, is_whole: BoolArray) -> IntArray:
    """By the inputs given, from every step as their zero, or as they are."""
    if item.input_is_free:
        wanted = inputs[:, :, None] + (given - given[0])  # designs, zeros, entries
    else:
        wanted = np.broadcast_to(given, (len(inputs), 1, len(given)))
    low, high = np.nanmin(inputs, axis=1), np.nanmax(inputs, axis=1)
    turned = low[:, None, None] + np.mod(wanted - low[:, None, None], TURN)
    wanted = np.where(is_whole[:, None, None], turned, wanted)
    known = np.where(np.isfinite(inputs), inputs, np.inf)
    first = np.argmax(np.isfinite(inputs), axis=1)
    steps = np.full(wanted.shape, -1)
    for k in range(len(inputs)):
        own = known[k, first[k] :]
        own = own[np.isfinite(own)]
        at = np.searchsorted(own, wanted[k])
        at = np.clip(at, 1, len(own) - 1) if len(own) > 1 else np.zeros_like(at)
        nearer = np.abs(own[at - 1] - wanted[k]) < np.abs(own[at] - wanted[k])
        at = np.where(nearer, at - 1, at) + first[k]
        inside = (wanted[k] >= low[k] - 0.1) & (wanted[k] <= high[k] + 0.1)
        steps[k] = np.where(inside, at, -1)
    return steps


def _turned_steps(angles: Array, wanted: Array, stride: int) -> IntArray:
    """Where a link is turned from every so many a step as it is to turn from pose to pose: that is alike however the
    linkage lies and however large it is."""
    starts = np.arange(0, angles.shape[1], POSE_STRIDE * stride)
    order = np.argsort(np.mod(angles, TURN), axis=1)  # what is not known comes last
    rising = np.take_along_axis(np.mod(angles, TURN), order, axis=1)
    last = np.maximum(np.isfinite(rising).sum(axis=1, keepdims=True) - 1, 0)
    ends = [np.take_along_axis(rising, last, axis=1) - TURN, rising[:, :1] + TURN]
    round_turn = np.concatenate([ends[0], np.where(np.isfinite(rising), rising, ends[1])], axis=1)
    round_turn = np.concatenate([round_turn, ends[1]], axis=1)
    first = angles[:, starts, None]
    at = _steps_at(round_turn, np.mod(first + (wanted - wanted[0]), TURN))
    at = np.where(at > last[:, :, None] + 1, 0, at - 1)  # beyond its last the first comes again
    at = np.where(at < 0, last[:, :, None], at)
    steps: IntArray = np.take_along_axis(order, at.reshape(len(at), -1), axis=1).reshape(at.shape)
    every = np.arange(len(angles))[:, None, None]
    off = angles[every, steps] - first - (wanted - wanted[0])
    off = np.abs(off - TURN * np.round(off / TURN))
    return np.where(off < MAX_TURN_MISS, steps, -1)


def _lengths_along(curve: ComplexArray) -> Array:
    """How far along its branch each step is, of the whole (designs, steps); NaN beyond the ends."""
    pieces = np.abs(np.diff(curve, axis=1))
    far = np.concatenate([np.zeros((len(curve), 1)), np.nancumsum(pieces, axis=1)], axis=1)
    whole = np.maximum(far[:, -1:], np.finfo(float).tiny)
    shares: Array = np.where(np.isfinite(curve.real), far / whole, np.nan)
    return shares


def _entry_orders(item: WantedItem) -> Iterator[IntArray]:
    """Orders in which entries may be met: as they are written, and where none is wanted by the nearest that is left."""
    count = len(item.target)
    own = np.arange(count)
    yield own
    if isinstance(item.wanted, WantedFunction) or item.wanted.in_order:
        return
    places = item.target[:, 0] + 1j * item.target[:, 1]
    apart = np.abs(places[:, None] - places)
    known = {tuple(own.tolist())}
    for start in range(count):
        tour, left = [start], {*range(count)} - {start}
        while left:
            nearest = min(left, key=lambda k: apart[tour[-1], k])
            tour.append(nearest)
            left.remove(nearest)
        if tuple(tour) not in known:
            known.add(tuple(tour))
            yield np.array(tour)
        if len(known) >= MOST_ORDERS:
            return


def _entry_fractions(item: WantedItem, order: IntArray) -> Array:
    """How far along the way through the entries each is, of the whole, in this order (n,)."""
    places = (item.target[:, 0] + 1j * item.target[:, 1])[order]
    pieces = np.abs(np.diff(places))
    if isinstance(item.wanted, WantedPoses):
        pieces = pieces + TURN_WEIGHT * np.abs(np.diff(item.target[order, 2]))
    far = np.concatenate([[0.0], np.cumsum(pieces)])
    whole = far[-1]
    if item.is_closed:
        whole += abs(places[0] - places[-1])
    fractions: Array = far / (whole or 1.0)
    return fractions


def _closed_steps(along: Array, fractions: Array, is_whole: BoolArray, stride: int) -> IntArray:
    """All round the curves of designs that turn fully, from every start, both ways."""
    shifts = np.arange(0, CURVE_STARTS, stride) / CURVE_STARTS
    wanted = np.concatenate([shifts[:, None] + fractions, shifts[:, None] - fractions]) % 1.0
    steps = _steps_at(along, np.broadcast_to(wanted, (len(along), *wanted.shape)))
    steps[~is_whole] = -1
    return steps


def _arc_steps(along: Array, fractions: Array, is_whole: BoolArray, stride: int) -> Iterator[IntArray]:
    """Along arcs of every start and share of the branch, both ways; a whole turn goes on over its end."""
    starts = np.arange(0, ARC_STARTS, stride) / ARC_STARTS
    for share in ARC_SHARES:
        wanted = starts[:, None] + share * fractions
        wanted = np.concatenate([wanted, starts[:, None] + share * (fractions.max() - fractions)])
        beyond = (wanted > 1.0 + 1e-9).any(axis=1)
        steps = _steps_at(along, np.broadcast_to(wanted % (1.0 + 1e-9), (len(along), *wanted.shape)))
        steps[(~is_whole)[:, None] & beyond] = -1
        yield steps


def _steps_at(along: Array, wanted: Array) -> IntArray:
    """The steps at which rising values along each design's branch (designs, steps), NaN beyond its ends, are nearest to
    wanted ones (designs, choices, n)."""
    design, step = np.nonzero(np.isfinite(along))
    low, high = (float(function(along[design, step], initial=0.0)) for function in (np.min, np.max))
    row = 2.0 * (high - low + 1.0) * np.arange(len(along))  # each design has a stretch of its own on one line
    line = along[design, step] + row[design]
    first = np.searchsorted(design, np.arange(len(along)))
    last = np.searchsorted(design, np.arange(len(along)), side="right") - 1
    flat = np.nan_to_num(wanted.reshape(len(wanted), -1)) + row[:, None]
    at = np.searchsorted(line, flat)
    at = np.clip(at, first[:, None] + 1, last[:, None])
    nearer = np.abs(line[at - 1] - flat) < np.abs(line[at] - flat)
    steps: IntArray = step[np.where(nearer, at - 1, at)].reshape(wanted.shape)
    return steps


@dataclass(frozen=True)
class MovedNumbers:
    """Which of a design's numbers are lengths, places in the frame's axes, and angles against these."""

    lengths: IntArray
    places: tuple[tuple[int, int], ...]
    angles: IntArray
    own_lengths: IntArray
    "among the unknowns, and the input"
    own_angles: IntArray

    def move(self, x: Array, y: Array, factor: complex, offset: complex) -> tuple[Array, Array]:
        """Scaled free numbers (free,) and unknowns (n, unknowns) where every place p is at factor * p + offset, which
        is in the numbers' scale."""
        x, y, size, turn = x.copy(), y.copy(), abs(factor), cmath.phase(factor)
        x[self.lengths] *= size
        for first, second in self.places:
            at = factor * complex(x[first], x[second]) + offset
            x[first], x[second] = at.real, at.imag
        x[self.angles] += turn
        y[:, self.own_lengths] *= size
        y[:, self.own_angles] += turn
        return x, y

    def factors(self, x: Array, lower: Array, upper: Array) -> Array | None:
        """The least and the greatest size (designs, 2) by which scaled free numbers (designs, free) may grow between
        their bounds; None where bounds of places or of angles in the frame hold designs where they are."""
        is_bound = np.isfinite(lower) | np.isfinite(upper)
        held = [*self.angles.tolist(), *(k for place in self.places for k in place)]
        if is_bound[held].any():
            return None
        own = self.lengths[is_bound[self.lengths]]
        size, low, high = x[:, own], lower[own], upper[own]
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([low / size, high / size])
        ends = np.where(size == 0.0, np.array([0.0, np.inf])[:, None, None], ends)
        least = np.maximum(ends.min(axis=0).max(axis=1, initial=0.0), 0.0)
        most = ends.max(axis=0).min(axis=1, initial=np.inf)
        return np.stack([np.minimum(least, 1.0), np.maximum(most, 1.0)], axis=1)


def moved_numbers(equations: WantedEquations, free: FreeNumbers) -> MovedNumbers:
    """How a mechanism's free numbers follow where it is moved as a whole."""
    design = equations.design
    mechanism, frame = design.mechanism, design.mechanism.frame
    known = {dimension.name: dimension for dimension in design.dimensions}
    by_place: dict[str, dict[str, int]] = {}
    lengths, angles = [], []
    for k, name in enumerate(free.names):
        dimension = known[name]
        on_frame = dimension.path[:2] == ("links", frame) or (
            dimension.path[0] == "pairs" and _is_guided_by_frame(mechanism, name)
        )
        stem, _, part = name.rpartition(".")
        if dimension.kind == "length" and on_frame and part in ("x", "y"):
            by_place.setdefault(stem, {})[part] = k
        elif dimension.kind == "length":
            lengths.append(k)
        elif dimension.kind == "angle" and dimension.path[0] == "pairs" and on_frame and "line" in name:
            angles.append(k)
    kinds = [design.equations.coordinates[k] for k in design.equations.unknowns]
    own_lengths = [k for k, coordinate in enumerate(kinds) if coordinate.kind is MeasureKind.LENGTH]
    own_angles = [
        k for k, coordinate in enumerate(kinds) if coordinate.kind is MeasureKind.ANGLE and coordinate.of_link
    ]
    running = relative_motions(mechanism)[mechanism.inputs[0].pair]
    if running.input_kind is MeasureKind.LENGTH:
        own_lengths.append(len(kinds))
    elif running.links[0] == frame:
        own_angles.append(len(kinds))
    return MovedNumbers(
        np.array(lengths, int),
        tuple((each["x"], each["y"]) for each in by_place.values() if len(each) == 2),
        np.array(angles, int),
        np.array(own_lengths, int),
        np.array(own_angles, int),
    )


def _is_guided_by_frame(mechanism: Mechanism, name: str) -> bool:
    pair = next((pair for pair in mechanism.pairs if name.startswith(f"{pair.name}.")), None)
    return pair is not None and mechanism.frame in pair.links


MAX_FACTOR = 12.0
"""By which a mechanism of about the size of what is wanted is made larger at most: curves are no tiny wiggles."""
CHUNK = 256
"""Designs that are compared at once."""


LEVELS = ((12, 2, 6), (36, 1, 2))
"""Comparisons before that by all entries from all places: by so many entries of an item, evenly, from every so-many-th
of the places where the first may be met; so many times as many designs as are wanted go on to the next."""
SHARE_OF_ITEMS = 6
"""So many times as many designs as are wanted are compared by all items, where there are several."""


class Match(NamedTuple):
    """A design of a catalogue, moved by place -> factor * place + offset, and the step of its branch at each entry."""

    design: int
    distance: float
    "root mean square, of the scale"
    factor: complex
    offset: complex
    steps: tuple[IntArray, ...]
    "of each wanted item (n,)"


class _NearestChoices(NamedTuple):
    """Of designs (designs,) the least distance, the move there, and the steps at the entries (designs, n)."""

    distance: Array
    factor: ComplexArray
    offset: ComplexArray
    steps: IntArray


def find_matches(
    catalogue: Catalogue, items: list[WantedItem], factors: Array | None, many: int, whole_only: bool = False
) -> list[Match]:
    """The nearest designs, one match each: by the item with the most entries, and of what is near by this all items.

    `factors` (designs, 2) are the least and the greatest by which each design may grow where it is moved; without them
    all stay where they are. With `whole_only` of those that turn fully."""
    order = sorted(range(len(items)), key=lambda k: -len(items[k].target))
    first = items[order[0]]
    designs = np.flatnonzero(catalogue.is_whole) if whole_only or first.is_closed else np.arange(len(catalogue))
    share = SHARE_OF_ITEMS if len(items) > 1 else 1
    for entries, stride, level_share in LEVELS:
        if len(first.target) > entries or (stride > 1 and first.inputs is None):
            coarse = _nearest_choices(catalogue, designs, order[0], first, factors, entries, stride)
            designs = designs[_best(coarse.distance, max(level_share, share) * many)]
    nearest = _nearest_choices(catalogue, designs, order[0], first, factors, len(first.target), 1)
    matches = []
    for row in _best(nearest.distance, share * many).tolist():
        steps: list[IntArray] = [np.zeros(0, int)] * len(items)
        steps[order[0]] = nearest.steps[row]
        factor, offset = complex(nearest.factor[row]), complex(nearest.offset[row])
        total = nearest.distance[row] ** 2 * len(first.target)
        for k in order[1:]:
            off, steps[k] = _nearest_steps(catalogue.values[k][designs[row]], items[k], factor, offset)
            total += off
        mean = float((total / sum(len(item.target) for item in items)) ** 0.5)
        matches.append(Match(int(designs[row]), mean, factor, offset, tuple(steps)))
    return sorted(matches, key=lambda each: each.distance)[:many]


def _best(distance: Array, many: int) -> IntArray:
    """The rows with the least distances that there are, at most so many."""
    best = np.argsort(distance, kind="stable")[:many]
    return best[np.isfinite(distance[best])]


def _nearest_choices(
    catalogue: Catalogue, designs: IntArray, k: int, item: WantedItem, factors: Array | None, most: int, stride: int
) -> _NearestChoices:
    """The nearest choice of each design for the item k, of at most so many entries and every so-many-th place."""
    many, entries = len(designs), len(item.target)
    nearest = _NearestChoices(
        np.full(many, np.inf), np.ones(many, complex), np.zeros(many, complex), np.zeros((many, entries), int)
    )
    for first in range(0, many, CHUNK):
        rows = slice(first, first + CHUNK)
        few = catalogue.take(designs[rows])
        own = None if factors is None else factors[designs[rows]]
        for chosen, steps in step_choices(few, item, few.values[k], most, stride):
            _take_better(nearest, rows, few.values[k], steps, chosen, item, own)
    return nearest


def _take_better(
    nearest: _NearestChoices,
    rows: slice,
    values: Array,
    steps: IntArray,
    entries: IntArray,
    item: WantedItem,
    factors: Array | None,
) -> None:
    """Keep of each design the choice with the least distance."""
    with np.errstate(invalid="ignore", over="ignore"):  # steps that a design lacks
        distance, factor, offset = _distances(values, steps, entries, item, factors)
    every = np.arange(len(values))
    best = np.argmin(distance, axis=1)
    least = distance[every, best]
    better = least < nearest.distance[rows]
    for kept, own in (
        (nearest.distance, least),
        (nearest.factor, factor[every, best]),
        (nearest.offset, offset[every, best]),
    ):
        kept[rows][better] = own[better]
    at = np.flatnonzero(better) + rows.start
    nearest.steps[at[:, None], entries] = steps[every, best][better]


def _distances(
    values: Array, steps: IntArray, entries: IntArray, item: WantedItem, factors: Array | None
) -> tuple[Array, ComplexArray, ComplexArray]:
    """Root mean square misses of choices (designs, choices), after the move that is best for the places."""
    there = values[np.arange(len(values))[:, None, None], np.maximum(steps, 0)]
    weights, target = item.wanted.weights[entries], item.target[entries]
    weights = weights / weights.sum()
    if isinstance(item.wanted, WantedFunction):
        off = there[..., 0] - target[:, 0]
        if not item.wanted.is_absolute:
            off = off - _mean(off, weights)[..., None]
        square = _mean(off**2, weights)
        ones: ComplexArray = np.ones(square.shape, complex)
        return _refused(square, steps), ones, np.zeros(square.shape, complex)
    own, wanted = there[..., 0] + 1j * there[..., 1], target[:, 0] + 1j * target[:, 1]
    factor: ComplexArray = np.ones(own.shape[:2], complex)
    offset: ComplexArray = np.zeros(own.shape[:2], complex)
    if factors is not None:
        centre, middle = _mean(own, weights), np.sum(wanted * weights)
        part = own - centre[..., None]
        size = _mean(np.abs(part) ** 2, weights)
        factor = _mean(np.conj(part) * (wanted - middle), weights) / np.maximum(size, 1e-9)
        grown = np.abs(factor)
        bounded = np.clip(grown, factors[:, :1], factors[:, 1:])
        factor = factor * np.where(grown > 0.0, bounded / np.where(grown > 0.0, grown, 1.0), 1.0)
        is_small: BoolArray = np.asarray(bounded > MAX_FACTOR)
        offset = middle - factor * centre
    square = _mean(np.abs(factor[..., None] * own + offset[..., None] - wanted) ** 2, weights)
    if isinstance(item.wanted, WantedPoses):
        turned = there[..., 2] + np.angle(factor)[..., None] - target[:, 2]
        square = square + _mean((turned - TURN * np.round(turned / TURN)) ** 2, weights)
    if factors is not None:
        square = np.where(is_small, np.inf, square)
    return _refused(square, steps), factor, offset


def _mean(rows: Any, weights: Array) -> Any:
    """The means of rows (designs, choices, n) by weights (n,); no library's threads are worth their start here."""
    return np.einsum("dcn,n->dc", rows, weights)


def _refused(square: Array, steps: IntArray) -> Array:
    wrong = (steps < 0).any(axis=-1) | ~np.isfinite(square)
    distance: Array = np.where(wrong, np.inf, np.sqrt(np.where(wrong, 0.0, square)))
    return distance


def _nearest_steps(values: Array, item: WantedItem, factor: complex, offset: complex) -> tuple[float, IntArray]:
    """The steps of a design nearest to each entry, and the sum of squares of what they are off."""
    if isinstance(item.wanted, WantedFunction):
        square = (values[None, :, 0] - item.target[:, :1]) ** 2
    else:
        moved = factor * (values[:, 0] + 1j * values[:, 1]) + offset
        square = np.abs(moved[None] - (item.target[:, 0] + 1j * item.target[:, 1])[:, None]) ** 2
        if isinstance(item.wanted, WantedPoses):
            turned = values[None, :, 2] + np.angle(factor) - item.target[:, 2:]
            square = square + (turned - TURN * np.round(turned / TURN)) ** 2
    square = np.where(np.isfinite(square), square, np.inf)
    steps = np.argmin(square, axis=1)
    return float(square[np.arange(len(steps)), steps].sum()), steps
