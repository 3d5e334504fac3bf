"""Designs of a catalogue that come near to what is wanted, wherever, however large and however turned they are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.jets import TURN
from planar.synthesis.catalogue.catalogue import Catalogue
from planar.synthesis.task.synthesis_task import WantedFunction, WantedPath, WantedPoses

CURVE_SAMPLES, HARMONICS = 64, 12
"""Of a closed curve, evenly by its length, and of its Fourier series."""
ARC_STARTS, ARC_SHARES = 24, (0.12, 0.18, 0.25, 0.35, 0.5, 0.7, 0.85, 1.0)
"""Of a branch: where arcs begin, and how much of it they are."""
MAX_FACTOR = 12.0
"""By which a mechanism of about the size of what is wanted is made larger at most: curves are no tiny wiggles."""
CHUNK = 256
"""Designs that are compared at once."""


class Match(NamedTuple):
    """A design of a catalogue, moved by place -> factor * place + offset, and the step of its branch at each entry."""

    design: int
    distance: float
    "root mean square, of the scale"
    factor: complex
    offset: complex
    steps: tuple[IntArray, ...]
    "of each wanted item (n,)"


class WantedItem(NamedTuple):
    """What is wanted in the scales of a catalogue, and the inputs that are given."""

    wanted: WantedPath | WantedPoses | WantedFunction
    target: Array
    "(n, parts)"
    inputs: Array | None
    "(n,) scaled as unknowns are"
    input_is_free: bool


def find_matches(
    catalogue: Catalogue, items: list[WantedItem], can_move: bool, many: int, whole_only: bool = False
) -> list[Match]:
    """The nearest designs, one match each, by the item with the most entries; the others then by their nearest steps.

    With `whole_only` of those that turn fully."""
    if not len(catalogue):
        return []
    order = sorted(range(len(items)), key=lambda k: -len(items[k].target))
    first = order[0]
    distance, factor, offset, steps = _match_item(catalogue, items[first], catalogue.values[first], can_move)
    if whole_only:
        distance = np.where(catalogue.is_whole, distance, np.inf)
    best = np.argsort(distance, kind="stable")[:many]
    found = []
    for design in best[np.isfinite(distance[best])].tolist():
        own: list[IntArray] = [np.zeros(0, int)] * len(items)
        own[first] = steps[design]
        total = distance[design] ** 2 * len(steps[design])
        for k in order[1:]:
            off, own[k] = _nearest_steps(catalogue.values[k][design], items[k], factor[design], offset[design])
            total += off
        mean = (total / sum(len(each.target) for each in items)) ** 0.5
        found.append(Match(design, float(mean), complex(factor[design]), complex(offset[design]), tuple(own)))
    return sorted(found, key=lambda each: each.distance)


def _match_item(
    catalogue: Catalogue, item: WantedItem, values: Array, can_move: bool
) -> tuple[Array, ComplexArray, ComplexArray, IntArray]:
    """Of every design the distance, the move, and the step at each entry (designs, n)."""
    many, entries = len(values), len(item.target)
    found = (
        np.full(many, np.inf),
        np.ones(many, complex),
        np.zeros(many, complex),
        np.zeros((many, entries), int),
    )
    for first in range(0, many, CHUNK):
        rows = slice(first, first + CHUNK)
        for candidates in _step_choices(catalogue, item, values, rows):
            _take_better(found, rows, values[rows], candidates, item, can_move)
    return found


def _step_choices(catalogue: Catalogue, item: WantedItem, values: Array, rows: slice) -> Iterator[IntArray]:
    """Steps (designs, choices, n) at which the entries may be met; -1 where a design has none."""
    unknowns = catalogue.unknowns[rows]
    if item.inputs is not None:
        yield _timed_steps(unknowns[..., -1], item, catalogue.is_whole[rows])
        return
    curve = values[rows, :, 0] + 1j * values[rows, :, 1]
    along = _lengths_along(curve)
    for order in _entry_orders(item):
        fractions = _entry_fractions(item, order)
        if getattr(item.wanted, "is_closed", False):
            yield _closed_steps(along, fractions, order, catalogue.is_whole[rows])
        else:
            yield from _arc_steps(along, fractions, order, catalogue.is_whole[rows])


def _timed_steps(inputs: Array, item: WantedItem, is_whole: BoolArray) -> IntArray:
    """By the inputs given, from every step as their zero, or as they are."""
    assert item.inputs is not None
    given = item.inputs
    steps = inputs.shape[1]
    if item.input_is_free:
        wanted = inputs[:, :, None] + (given - given[0])  # designs, zeros, entries
    else:
        wanted = np.broadcast_to(given, (len(inputs), 1, len(given)))
    low, high = np.nanmin(inputs, axis=1), np.nanmax(inputs, axis=1)
    turned = low[:, None, None] + np.mod(wanted - low[:, None, None], TURN)
    wanted = np.where(is_whole[:, None, None], turned, wanted)
    known = np.where(np.isfinite(inputs), inputs, np.inf)
    first = np.argmax(np.isfinite(inputs), axis=1)
    found = np.full(wanted.shape, -1)
    for k in range(len(inputs)):
        own = known[k, first[k] :]
        own = own[np.isfinite(own)]
        at = np.searchsorted(own, wanted[k])
        at = np.clip(at, 1, len(own) - 1) if len(own) > 1 else np.zeros_like(at)
        nearer = np.abs(own[at - 1] - wanted[k]) < np.abs(own[at] - wanted[k])
        at = np.where(nearer, at - 1, at) + first[k]
        inside = (wanted[k] >= low[k] - 0.1) & (wanted[k] <= high[k] + 0.1)
        found[k] = np.where(inside, at, -1)
    assert found.max(initial=0) < steps
    return found


def _lengths_along(curve: ComplexArray) -> Array:
    """How far along its branch each step is, of the whole (designs, steps); NaN beyond the ends."""
    pieces = np.abs(np.diff(curve, axis=1))
    far = np.concatenate([np.zeros((len(curve), 1)), np.nancumsum(pieces, axis=1)], axis=1)
    whole = np.maximum(far[:, -1:], np.finfo(float).tiny)
    found: Array = np.where(np.isfinite(curve.real), far / whole, np.nan)
    return found


def _entry_orders(item: WantedItem) -> Iterator[IntArray]:
    """Orders in which the entries may be met."""
    count = len(item.target)
    own = np.arange(count)
    yield own
    if item.wanted.in_order if not isinstance(item.wanted, WantedFunction) else True:
        return
    places = item.target[:, 0] + 1j * item.target[:, 1]
    apart = np.abs(places[:, None] - places)
    told = {tuple(own.tolist())}
    for start in range(count):  # from each the nearest that is left
        tour, left = [start], {*range(count)} - {start}
        while left:
            nearest = min(left, key=lambda k: apart[tour[-1], k])
            tour.append(nearest)
            left.remove(nearest)
        if tuple(tour) not in told:
            told.add(tuple(tour))
            yield np.array(tour)
        if len(told) > 3:
            return


def _entry_fractions(item: WantedItem, order: IntArray) -> Array:
    """How far along the way through the entries each is, of the whole, in this order (n,)."""
    places = (item.target[:, 0] + 1j * item.target[:, 1])[order]
    pieces = np.abs(np.diff(places))
    if isinstance(item.wanted, WantedPoses):
        pieces = pieces + 0.3 * np.abs(np.diff(item.target[order, 2]))
    far = np.concatenate([[0.0], np.cumsum(pieces)])
    whole = far[-1]
    if getattr(item.wanted, "is_closed", False):
        whole += abs(places[0] - places[-1])
    found: Array = far / (whole or 1.0)
    return found


def _closed_steps(along: Array, fractions: Array, order: IntArray, is_whole: BoolArray) -> IntArray:
    """All round the curves of designs that turn fully, from every start, both ways."""
    shifts = np.arange(CURVE_SAMPLES) / CURVE_SAMPLES
    wanted = np.concatenate([shifts[:, None] + fractions, shifts[:, None] - fractions]) % 1.0
    found = _steps_at(along, np.broadcast_to(wanted, (len(along), *wanted.shape)))
    found[~is_whole] = -1
    return _in_given_order(found, order)


def _arc_steps(along: Array, fractions: Array, order: IntArray, is_whole: BoolArray) -> Iterator[IntArray]:
    """Along arcs of every start and share of the branch, both ways; a whole turn goes on over its end."""
    starts = np.arange(ARC_STARTS) / ARC_STARTS
    for share in ARC_SHARES:
        wanted = starts[:, None] + share * fractions
        wanted = np.concatenate([wanted, wanted[:, -1:] + wanted[:, :1] - wanted])
        beyond = (wanted > 1.0 + 1e-9).any(axis=1)
        found = _steps_at(along, np.broadcast_to(wanted % (1.0 + 1e-9), (len(along), *wanted.shape)))
        found[(~is_whole)[:, None] & beyond] = -1
        yield _in_given_order(found, order)


def _steps_at(along: Array, wanted: Array) -> IntArray:
    """The steps nearest to shares of each design's branch (designs, choices, n)."""
    design, step = np.nonzero(np.isfinite(along))
    row = 2.0 * np.arange(len(along))  # every design has a stretch of its own on one line, searched once
    line = along[design, step] + row[design]
    first = np.searchsorted(design, np.arange(len(along)))
    last = np.searchsorted(design, np.arange(len(along)), side="right") - 1
    flat = wanted.reshape(len(wanted), -1) + row[:, None]
    at = np.searchsorted(line, flat)
    at = np.clip(at, first[:, None] + 1, last[:, None])
    nearer = np.abs(line[at - 1] - flat) < np.abs(line[at] - flat)
    found: IntArray = step[np.where(nearer, at - 1, at)].reshape(wanted.shape)
    return found


def _in_given_order(steps: IntArray, order: IntArray) -> IntArray:
    found = np.empty_like(steps)
    found[..., order] = steps
    return found


def _take_better(
    found: tuple[Array, ComplexArray, ComplexArray, IntArray],
    rows: slice,
    values: Array,
    steps: IntArray,
    item: WantedItem,
    can_move: bool,
) -> None:
    """Keep of each design the choice with the least distance."""
    with np.errstate(invalid="ignore", over="ignore"):  # steps that a design lacks
        distance, factor, offset = _distances(values, steps, item, can_move)
    every = np.arange(len(values))
    best = np.argmin(distance, axis=1)
    least = distance[every, best]
    better = least < found[0][rows]
    for told, own in zip(found, (least, factor[every, best], offset[every, best], steps[every, best]), strict=True):
        told[rows][better] = own[better]


def _distances(
    values: Array, steps: IntArray, item: WantedItem, can_move: bool
) -> tuple[Array, ComplexArray, ComplexArray]:
    """Root mean square misses of choices (designs, choices), after the move that is best for the places."""
    there = values[np.arange(len(values))[:, None, None], np.maximum(steps, 0)]
    weights = item.wanted.weights / item.wanted.weights.sum()
    if isinstance(item.wanted, WantedFunction):
        off = there[..., 0] - item.target[:, 0]
        if not item.wanted.is_absolute:
            off = off - _mean(off, weights)[..., None]
        square = _mean(off**2, weights)
        ones: ComplexArray = np.ones(square.shape, complex)
        return _refused(square, steps), ones, np.zeros(square.shape, complex)
    own, wanted = there[..., 0] + 1j * there[..., 1], item.target[:, 0] + 1j * item.target[:, 1]
    factor: ComplexArray = np.ones(own.shape[:2], complex)
    offset: ComplexArray = np.zeros(own.shape[:2], complex)
    if can_move:
        centre, middle = _mean(own, weights), np.sum(wanted * weights)
        part = own - centre[..., None]
        size = _mean(np.abs(part) ** 2, weights)
        factor = _mean(np.conj(part) * (wanted - middle), weights) / np.maximum(size, 1e-9)
        is_small: BoolArray = np.asarray(np.abs(factor) > MAX_FACTOR)
        offset = middle - factor * centre
    square = _mean(np.abs(factor[..., None] * own + offset[..., None] - wanted) ** 2, weights)
    if isinstance(item.wanted, WantedPoses):
        turned = there[..., 2] + np.angle(factor)[..., None] - item.target[:, 2]
        square = square + _mean((turned - TURN * np.round(turned / TURN)) ** 2, weights)
    if can_move:
        square = np.where(is_small, np.inf, square)
    return _refused(square, steps), factor, offset


def _mean(rows: Any, weights: Array) -> Any:
    """The means of rows (designs, choices, n) by weights (n,); no library's threads are worth their start here."""
    return np.einsum("dcn,n->dc", rows, weights)


def _refused(square: Array, steps: IntArray) -> Array:
    wrong = (steps < 0).any(axis=-1) | ~np.isfinite(square)
    found: Array = np.where(wrong, np.inf, np.sqrt(np.where(wrong, 0.0, square)))
    return found


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
