"""Linkages of pinned bars as tapes: which pin is placed from which others, step after step, for all side by side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.assembly_scores import is_surely_farther
from planar.batch.pinned.formulas import NUMBERS, PinStep
from planar.batch.pinned.told_pins import frame_pins
from planar.model.pin_linkages import PinnedLinkages
from planar.solving.checks.residual_check import SHORT_ARM, residual_tolerance

Array = np.ndarray

MAX_BARS = 64
"""Bars of a linkage; longer ones are parted by themselves."""
SMALLEST_SIZE, LARGEST_SIZE = 1e-50, 1e50
"""m: squares and products of lengths between these are numbers."""


class PinTape(NamedTuple):
    """Steps of linkages, linkage after linkage, each after those that it needs: their `kinds` (see `PinStep`), the two
    pins that each takes, `given` (steps, 2), and the one that it places (steps,), numbers p (steps, numbers), the two
    `bars` (steps, 2), and of what `level` each is.

    Linkage k of `which` has the steps from first[k] to first[k + 1]; `tolerance` (linkages,) in sizes. Pins and bars
    are numbered through all linkages.
    """

    which: Array
    first: Array
    kinds: Array
    given: Array
    placed: Array
    p: Array
    bars: Array
    level: Array
    tolerance: Array

    def select(self, some: Array) -> PinTape:
        """Some of the linkages (numbers, rising)."""
        if len(some) == len(self.which):
            return self
        counts = np.diff(self.first)[some]
        first = np.concatenate([[0], np.cumsum(counts)])
        own = np.repeat(self.first[some] - first[:-1], counts) + np.arange(first[-1])
        parts = (each[own] for each in (self.kinds, self.given, self.placed, self.p, self.bars, self.level))
        return PinTape(self.which[some], first, *parts, self.tolerance[some])


class _Bars(NamedTuple):
    """All linkages as one: of every entry, a pin on a bar, sorted by pin, its bar and pin; whose bars and pins are."""

    bar: Array
    pin: Array
    bar_owner: Array
    pin_owner: Array
    is_fixed: Array


class _Steps(NamedTuple):
    """Steps of one kind and level: the two given pins, the one that is placed, the two bars."""

    kind: int
    first: Array
    second: Array
    placed: Array
    bars: Array


def make_tape(linkages: PinnedLinkages) -> PinTape:
    """The steps of those linkages that consist of a crank and dyads whose assembly is surely that of their places."""
    bar_counts = np.diff(linkages.first_bar)
    entry_counts = np.diff(linkages.first_entry)
    bar_owner = np.repeat(np.arange(len(linkages)), bar_counts)
    pin_owner = np.repeat(np.arange(len(linkages)), np.diff(linkages.first_pin))
    entry_bar = np.repeat(np.arange(len(bar_owner)), entry_counts)
    entry_pin = linkages.bar_pins + linkages.first_pin[bar_owner[entry_bar]]
    is_fixed = np.zeros(len(pin_owner), dtype=bool)
    is_fixed[frame_pins(linkages)] = True
    order = np.argsort(entry_pin, kind="stable")
    whole = _Bars(entry_bar[order], entry_pin[order], bar_owner, pin_owner, is_fixed)
    holders = np.bincount(entry_pin, minlength=len(pin_owner)) + is_fixed
    pairs = np.bincount(pin_owner, np.maximum(holders - 1, 0), len(linkages))
    odd = (bar_counts > MAX_BARS) | (2 * pairs + 1 != 3 * bar_counts)
    levels, known = _peel(whole, linkages.first_bar[:-1] + linkages.crank, odd)
    odd[bar_owner[~known]] = True
    unit, reach = _sizes(linkages, entry_bar, entry_pin)
    odd |= ~((unit > SMALLEST_SIZE) & (unit < LARGEST_SIZE))
    made = [(level, each, _numbers(linkages, each, whole, unit, odd)) for level, each in enumerate(levels)]
    which = np.flatnonzero(~odd)
    tolerance = residual_tolerance(bar_counts + 1, reach / unit)[which]
    kinds, level = (
        np.concatenate([np.full(len(each.placed), value(n, each)) for n, each, _ in made])
        for value in (lambda n, each: each.kind, lambda n, each: n)
    )
    given = np.concatenate([np.stack([each.first, each.second], axis=1) for _, each, _ in made])
    placed, bars = (np.concatenate([getattr(each, name) for _, each, _ in made]) for name in ("placed", "bars"))
    numbers = np.concatenate([p for _, _, p in made])
    owner = pin_owner[placed]
    order = np.argsort(owner, kind="stable")
    order = order[~odd[owner[order]]]
    counts = np.bincount(owner, minlength=len(linkages))[which]
    parts = (each[order] for each in (kinds, given, placed, numbers, bars, level))
    return PinTape(which, np.concatenate([[0], np.cumsum(counts)]), *parts, tolerance)


# long: one loop over levels, with what is known between them
def _peel(whole: _Bars, cranks: Array, odd: Array) -> tuple[list[_Steps], Array]:
    """What follows at once from known pins, level after level: two bars that share a pin, each on one known pin.

    Which bars are known (bars,) in the end; linkages with anything else become `odd`.
    """
    bar, pin, owner = whole.bar, whole.pin, whole.bar_owner
    bars, pins = len(owner), len(whole.is_fixed)
    known_pin, known_bar = whole.is_fixed.copy(), np.zeros(bars, dtype=bool)
    known_bar[cranks] = True
    pivot = np.zeros(bars, dtype=np.int64)
    driven = known_bar[bar]
    on_frame = driven & known_pin[pin]
    pivot[bar[on_frame]] = pin[on_frame]
    own = np.flatnonzero(driven & ~known_pin[pin])
    steps = [_Steps(PinStep.CRANK, pivot[bar[own]], pivot[bar[own]], pin[own], np.stack([bar[own]] * 2, axis=1))]
    known_pin[pin[own]] = True
    bar, pin = bar[~driven], pin[~driven]
    arm, reached = np.zeros(bars, dtype=np.int64), np.zeros(bars, dtype=np.int64)
    while len(bar):
        known = known_pin[pin]
        held = np.bincount(bar[known], minlength=bars)
        odd[owner[held > 1]] = True
        arm[bar[known]] = pin[known]
        ends = np.flatnonzero(~known & (held[bar] == 1))
        count = np.bincount(pin[ends], minlength=pins)[pin[ends]]
        odd[owner[bar[ends[count > 2]]]] = True
        ends = ends[count == 2]
        # entries are sorted by pin, so that the two stand side by side
        one, two = bar[ends[::2]], bar[ends[1::2]]
        if not one.size:
            break
        placed = pin[ends[::2]]
        twice = np.bincount(bar[ends], minlength=bars) > 1
        odd[owner[twice]] = True
        steps += _dyad_steps(whole, arm, placed, one, two)
        known_pin[placed] = True
        for each in (one, two):
            known_bar[each], reached[each] = True, placed
        now = known_bar[bar]
        carried = np.flatnonzero(now & ~known_pin[pin])
        if carried.size:
            steps += _carried_steps(whole, arm, reached, pin[carried], bar[carried])
            known_pin[pin[carried]] = True
        rest = ~now & ~odd[owner[bar]]
        bar, pin = bar[rest], pin[rest]
    return steps, known_bar


def _dyad_steps(whole: _Bars, arm: Array, placed: Array, one: Array, two: Array) -> list[_Steps]:
    """The dyads of bars one and two, each on a known pin: that of the first one moves."""
    swap = whole.is_fixed[arm[one]]
    one, two = np.where(swap, two, one), np.where(swap, one, two)
    on_frame = whole.is_fixed[arm[two]]
    found = []
    for kind, own in ((PinStep.DYAD, ~on_frame), (PinStep.DYAD_ON_FRAME, on_frame)):
        if own.any():
            a, b = one[own], two[own]
            found.append(_Steps(kind, arm[a], arm[b], placed[own], np.stack([a, b], axis=1)))
    return found


def _carried_steps(whole: _Bars, arm: Array, reached: Array, placed: Array, bar: Array) -> list[_Steps]:
    """Further pins of bars two of whose pins are known, the second of which moves."""
    on_frame = whole.is_fixed[arm[bar]]
    found = []
    for kind, own in ((PinStep.CARRIED, ~on_frame), (PinStep.CARRIED_ON_FRAME, on_frame)):
        if own.any():
            b = bar[own]
            found.append(_Steps(kind, reached[b], arm[b], placed[own], np.stack([b, b], axis=1)))
    return found


def _numbers(linkages: PinnedLinkages, steps: _Steps, whole: _Bars, unit: Array, odd: Array) -> Array:
    """The numbers of steps (steps, numbers); linkages that are not sure become `odd`."""
    x, a, b = (linkages.positions[each] for each in (steps.placed, steps.first, steps.second))
    owner = whole.pin_owner[steps.placed]
    p = np.zeros((len(x), NUMBERS))
    if steps.kind == PinStep.CRANK:
        p[:, :2], p[:, 2:4] = a, x - a
        p[:, 4], p[:, 5] = linkages.velocity[owner], linkages.acceleration[owner]
        return p
    to, far = x - a, b - a
    along, across = far[:, 0] * to[:, 0] + far[:, 1] * to[:, 1], far[:, 0] * to[:, 1] - far[:, 1] * to[:, 0]
    square = far[:, 0] ** 2 + far[:, 1] ** 2
    with np.errstate(all="ignore"):
        if steps.kind in (PinStep.CARRIED, PinStep.CARRIED_ON_FRAME):
            p[:, 0], p[:, 1], p[:, 2:4] = along / square, across / square, b
            return p
        size = unit[owner]
        lengths = np.hypot(*to.T), np.hypot(*(x - b).T)
        p[:, 0], p[:, 1], p[:, 2], p[:, 3], p[:, 4:] = *lengths, np.where(across > 0.0, 1.0, -1.0), 1.0 / size, b
        # the other assembly has the pin on the other side of the line through those that are given
        sure = is_surely_farther(4.0 * across**2 / square / size**2, np.zeros(1), roundings=2)
        sure &= np.minimum(*lengths) >= SHORT_ARM * size
    sure &= ~whole.is_fixed[steps.first]
    odd[owner[~sure]] = True
    return p


def _sizes(linkages: PinnedLinkages, entry_bar: Array, entry_pin: Array) -> tuple[Array, Array]:
    """The greatest extent of a link of each linkage, and how far its numbers reach (m)."""
    at, starts = linkages.positions, linkages.first_entry[:-1]
    base, way = at[entry_pin[starts]], at[entry_pin[starts + 1]] - at[entry_pin[starts]]
    length = np.hypot(*way.T)
    heads, frames = linkages.first_bar[:-1], linkages.first_frame_pin[:-1]
    fixed = at[frame_pins(linkages)]
    extents, reaches = length, length
    if len(entry_bar) > 2 * len(starts):
        c, s = (way.T / length)[:, entry_bar]
        x, y = (at[entry_pin] - base[entry_bar]).T
        local = np.stack([c * x + s * y, c * y - s * x], axis=1)
        extents = np.hypot(*_extents(local, starts))
        reaches = np.maximum.reduceat(np.abs(local).max(axis=1), starts)
    unit = np.maximum(np.maximum.reduceat(extents, heads), np.hypot(*_extents(fixed, frames)))
    reach = np.maximum.reduceat(np.abs(fixed).max(axis=1), frames)
    return unit, np.maximum(np.maximum.reduceat(reaches, heads), reach)


def _extents(points: Array, starts: Array) -> Array:
    """How far points (points, 2) reach in x and in y (2, parts), part by part."""
    return (np.maximum.reduceat(points, starts) - np.minimum.reduceat(points, starts)).T
