"""The steps of designs' branches at which wanted entries may be met."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.jets import TURN
from planar.synthesis.catalogue.catalogue import Catalogue
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction, WantedPath, WantedPoses

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


class StepChoices(NamedTuple):
    """Which entries (m,) are looked at, and steps (designs, choices, m) at which they may be met; -1 for none."""

    entries: IntArray
    steps: IntArray


def step_choices(
    catalogue: Catalogue, item: WantedItem, values: Array, most: int, stride: int
) -> Iterator[StepChoices]:
    """Where the entries of an item may be met along the branches of designs that show `values` (designs, steps, parts),
    of at most so many entries evenly, and of every so-many-th place along a branch where the first may be met."""
    if item.inputs is not None:
        entries = _evenly(len(item.target), most)
        given = item.inputs[entries]
        yield StepChoices(entries, _timed_steps(catalogue.unknowns[..., -1], given, item, catalogue.is_whole))
        return
    if isinstance(item.wanted, WantedPoses):
        entries = _evenly(len(item.target), most)
        yield StepChoices(entries, _turned_steps(values[..., 2], item.target[entries, 2], stride))
    along = _lengths_along(values[..., 0] + 1j * values[..., 1])
    for order in _entry_orders(item):
        few = _evenly(len(order), most)
        fractions, entries = _entry_fractions(item, order)[few], order[few]
        if item.is_closed:
            yield StepChoices(entries, _closed_steps(along, fractions, catalogue.is_whole, stride))
        else:
            for steps in _arc_steps(along, fractions, catalogue.is_whole, stride):
                yield StepChoices(entries, steps)


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
