"""Designs of a catalogue that come near to what is wanted, wherever, however large and however turned they are."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.jets import TURN
from planar.synthesis.catalogue.catalogue import Catalogue
from planar.synthesis.catalogue.step_choices import WantedItem, step_choices
from planar.synthesis.task.synthesis_task import WantedFunction, WantedPoses

MAX_FACTOR = 12.0
"""By which a mechanism of about the size of what is wanted is made larger at most: curves are no tiny wiggles."""
CHUNK = 256
"""Designs that are compared at once."""


class _Level(NamedTuple):
    """A comparison by so many entries of an item, evenly, from every so-many-th of the places where the first may be
    met; so many times as many designs as are wanted go on to the next."""

    entries: int
    stride: int
    share: int


LEVELS = (_Level(12, 2, 6), _Level(36, 1, 2))
"""By which designs are compared before all entries are, from all places."""
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
    for level in LEVELS:
        if len(first.target) > level.entries or (level.stride > 1 and first.inputs is None):
            coarse = _nearest_choices(catalogue, designs, order[0], first, factors, level)
            designs = designs[_best(coarse.distance, max(level.share, share) * many)]
    whole = _Level(len(first.target), 1, share)
    nearest = _nearest_choices(catalogue, designs, order[0], first, factors, whole)
    matches = []
    for row in _best(nearest.distance, share * many).tolist():
        steps: list[IntArray] = [np.zeros(0, int)] * len(items)
        steps[order[0]] = nearest.steps[row]
        factor, offset = complex(nearest.factor[row]), complex(nearest.offset[row])
        total = nearest.distance[row] ** 2 * len(first.target)
        for k in order[1:]:
            off, steps[k] = _nearest_steps(catalogue.values[k][designs[row]], items[k], factor, offset)
            total += off
        mean = float((total / sum(len(each.target) for each in items)) ** 0.5)
        matches.append(Match(int(designs[row]), mean, factor, offset, tuple(steps)))
    return sorted(matches, key=lambda each: each.distance)[:many]


def _best(distance: Array, many: int) -> IntArray:
    """The rows with the least distances that there are, at most so many."""
    best = np.argsort(distance, kind="stable")[:many]
    return best[np.isfinite(distance[best])]


def _nearest_choices(
    catalogue: Catalogue, designs: IntArray, k: int, item: WantedItem, factors: Array | None, level: _Level
) -> _NearestChoices:
    """The nearest choice of each design for the item k, looked at as the level says."""
    many, entries = len(designs), len(item.target)
    nearest = _NearestChoices(
        np.full(many, np.inf), np.ones(many, complex), np.zeros(many, complex), np.zeros((many, entries), int)
    )
    for first in range(0, many, CHUNK):
        rows = slice(first, first + CHUNK)
        few = catalogue.take(designs[rows])
        own = None if factors is None else factors[designs[rows]]
        for choices in step_choices(few, item, few.values[k], level.entries, level.stride):
            _take_better(nearest, rows, few.values[k], choices.steps, choices.entries, item, own)
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
