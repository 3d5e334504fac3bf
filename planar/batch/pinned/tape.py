"""Linkages of pinned bars as tapes: which pin is placed from which others, step after step, for all side by side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.assembly_scores import is_surely_farther
from planar.batch.pinned.formulas import NUMBERS, PinStep
from planar.batch.pinned.told_pins import frame_pins
from planar.model.pin_linkages import PinnedLinkages
from planar.solving.checks.residual_check import EPS, NEGLIGIBLE_ERROR, SHORT_ARM, residual_tolerance

Array = np.ndarray

MAX_BARS = 64
"""Bars of a linkage; longer ones are parted by themselves."""
SMALLEST_SIZE, LARGEST_SIZE = 1e-50, 1e50
"""m: squares and products of lengths between these are numbers."""


class PinTape(NamedTuple):
    """Steps of linkages, linkage after linkage, each after those that it needs: their `kinds` (see `PinStep`), the two
    pins that each takes, `given` (steps, 2), and the one that it places (steps,), numbers p (steps, numbers), the two
    `bars` (steps, 2), and of what `level` each is.

    Linkage k of `which` has the steps from first[k] to first[k + 1]; `tolerance` (linkages,) in sizes and least
    `clearance` (linkages,). Pins and bars
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
    clearance: Array

    def select(self, some: Array) -> PinTape:
        """Some of the linkages (numbers, rising)."""
        if len(some) == len(self.which):
            return self
        counts = np.diff(self.first)[some]
        first = np.concatenate([[0], np.cumsum(counts)])
        own = np.repeat(self.first[some] - first[:-1], counts) + np.arange(first[-1])
        parts = (each[own] for each in (self.kinds, self.given, self.placed, self.p, self.bars, self.level))
        return PinTape(self.which[some], first, *parts, self.tolerance[some], self.clearance[some])


class _Bars(NamedTuple):
    """All linkages as one: of every entry, a pin on a bar, sorted by pin, its bar and pin; whose bars and pins are."""

    bar: Array
    pin: Array
    bar_owner: Array
    pin_owner: Array
    is_fixed: Array


class _Steps(NamedTuple):
    """Steps: their kinds, the two given pins, the one that is placed, the two bars, their level."""

    kinds: Array
    first: Array
    second: Array
    placed: Array
    one: Array
    two: Array
    level: Array


def make_tape(linkages: PinnedLinkages) -> PinTape:
    """The steps of those linkages that consist of a crank and dyads whose assembly is surely that of their places."""
    bar_counts = np.diff(linkages.first_bar)
    bar_owner = np.repeat(np.arange(len(linkages)), bar_counts)
    pin_owner = np.repeat(np.arange(len(linkages)), np.diff(linkages.first_pin))
    entry_bar = np.repeat(np.arange(len(bar_owner)), np.diff(linkages.first_entry))
    entry_pin = linkages.bar_pins + linkages.first_pin[bar_owner[entry_bar]]
    is_fixed = np.zeros(len(pin_owner), dtype=bool)
    is_fixed[frame_pins(linkages)] = True
    order = np.argsort(entry_pin, kind="stable")
    whole = _Bars(entry_bar[order], entry_pin[order], bar_owner, pin_owner, is_fixed)
    holders = np.bincount(entry_pin, minlength=len(pin_owner)) + is_fixed
    pairs = np.bincount(pin_owner, np.maximum(holders - 1, 0), len(linkages))
    odd = (bar_counts > MAX_BARS) | (2 * pairs + 1 != 3 * bar_counts)
    steps = _peel(whole, linkages.first_bar[:-1] + linkages.crank, odd)
    unit, reach = _sizes(linkages, entry_bar, entry_pin)
    odd |= ~((unit > SMALLEST_SIZE) & (unit < LARGEST_SIZE))
    p, arm = _numbers(linkages, steps, pin_owner, unit, is_fixed)
    owner = pin_owner[steps.placed]
    odd[owner[arm < SHORT_ARM]] = True
    which = np.flatnonzero(~odd)
    order = np.argsort(owner, kind="stable")
    if len(which) < len(linkages):
        order = order[~odd[owner[order]]]
    first = np.zeros(len(which) + 1, dtype=np.int64)
    np.cumsum(np.bincount(owner, minlength=len(linkages))[which], out=first[1:])
    given, bars = (np.stack([a[order], b[order]], axis=1) for a, b in (steps[1:3], steps[4:6]))
    tolerance = residual_tolerance(bar_counts + 1, reach / unit)[which]
    shortest = np.minimum.reduceat(arm[order], first[:-1]) if len(which) else np.ones(0)
    clearance = EPS / (NEGLIGIBLE_ERROR * np.minimum(shortest, 1.0))
    return PinTape(
        which, first, steps.kinds[order], given, steps.placed[order], p[order], bars, steps.level[order], tolerance,
        clearance,
    )  # fmt: skip


# long: one loop over levels, with what is known between them
def _peel(whole: _Bars, cranks: Array, odd: Array) -> _Steps:
    """What follows at once from known pins, level after level: two bars that share a pin, each on one known pin.

    Linkages with anything else become `odd`.
    """
    bar, pin, owner = whole.bar, whole.pin, whole.bar_owner
    bars, pins = len(owner), len(whole.is_fixed)
    known_pin, known_bar = whole.is_fixed.copy(), np.zeros(bars, dtype=bool)
    known_bar[cranks] = True
    # the known pin of every bar, and the one that its dyad places
    arm, reached = np.zeros((2, bars), dtype=np.int64)
    driven = known_bar[bar]
    on_frame = driven & known_pin[pin]
    arm[bar[on_frame]] = pin[on_frame]
    own = np.flatnonzero(driven & ~known_pin[pin])
    steps = [(PinStep.CRANK, arm[bar[own]], arm[bar[own]], pin[own], bar[own], bar[own])]
    known_pin[pin[own]] = True
    bar, pin = bar[~driven], pin[~driven]
    while len(bar):
        known = known_pin[pin]
        held = np.bincount(bar[known], minlength=bars)
        if held.max() > 1:
            odd[owner[held > 1]] = True
        arm[bar[known]] = pin[known]
        ends = np.flatnonzero(~known & (held[bar] == 1))
        at = pin[ends]
        count = np.bincount(at, minlength=pins)[at]
        if count.max(initial=0) > 2:
            odd[owner[bar[ends[count > 2]]]] = True
        ends = ends[count == 2]
        # entries are sorted by pin, so that the two stand side by side
        one, two = bar[ends[::2]], bar[ends[1::2]]
        if not one.size:
            break
        placed = pin[ends[::2]]
        twice = np.bincount(bar[ends], minlength=bars)
        if twice.max() > 1:
            odd[owner[twice > 1]] = True
        steps += _dyad_steps(whole, arm, placed, one, two)
        known_pin[placed] = True
        for each in (one, two):
            known_bar[each], reached[each] = True, placed
        now = known_bar[bar]
        carried = np.flatnonzero(now & ~known_pin[pin])
        if carried.size:
            b, at = bar[carried], pin[carried]
            steps += _by_second_pin(whole, PinStep.CARRIED, reached[b], arm[b], at, b, b)
            known_pin[at] = True
        rest = np.flatnonzero(~now)
        bar, pin = bar[rest], pin[rest]
    odd[owner[~known_bar]] = True
    kinds, level = (
        np.repeat(of, [len(each[3]) for each in steps]) for of in ([s[0] for s in steps], range(len(steps)))
    )
    return _Steps(kinds, *(np.concatenate(parts) for parts in list(zip(*steps, strict=True))[1:]), level)


_StepRow = tuple[int, Array, Array, Array, Array, Array]
"""Steps of one kind and level: the kind, and arrays as in `_Steps`."""


def _dyad_steps(whole: _Bars, arm: Array, placed: Array, one: Array, two: Array) -> list[_StepRow]:
    """The dyads of bars one and two, each on a known pin: that of the first one moves."""
    swap = whole.is_fixed[arm[one]]
    one, two = np.where(swap, two, one), np.where(swap, one, two)
    return _by_second_pin(whole, PinStep.DYAD, arm[one], arm[two], placed, one, two)


def _by_second_pin(
    whole: _Bars, kind: PinStep, first: Array, second: Array, placed: Array, one: Array, two: Array
) -> list[_StepRow]:
    """Steps apart whose second pin moves, and whose second pin is on the frame."""
    on_frame = whole.is_fixed[second]
    found: list[_StepRow] = []
    for number, own in ((kind, np.flatnonzero(~on_frame)), (kind + 1, np.flatnonzero(on_frame))):
        if own.size:
            found.append((number, *(each[own] for each in (first, second, placed, one, two))))
    return found


def _numbers(
    linkages: PinnedLinkages, steps: _Steps, pin_owner: Array, unit: Array, is_fixed: Array
) -> tuple[Array, Array]:
    """The numbers of steps (steps, numbers), and the shortest bar of dyads (steps,) in sizes; zero for what is not
    sure."""
    x, a, b = (linkages.positions[each] for each in (steps.placed, steps.first, steps.second))
    to, far = x - a, b - a
    p, arm = np.empty((len(x), NUMBERS)), np.full(len(x), np.inf)
    own = np.flatnonzero(steps.kinds == PinStep.CRANK)
    owner = pin_owner[steps.placed[own]]
    p[own, :2], p[own, 2:4] = a[own], to[own]
    p[own, 4], p[own, 5] = linkages.velocity[owner], linkages.acceleration[owner]
    across = far[:, 0] * to[:, 1] - far[:, 1] * to[:, 0]
    square = far[:, 0] ** 2 + far[:, 1] ** 2
    own = np.flatnonzero(steps.kinds >= PinStep.CARRIED)
    with np.errstate(all="ignore"):
        p[own, 0] = (far[own] * to[own]).sum(axis=1) / square[own]
        p[own, 1], p[own, 2:4] = across[own] / square[own], b[own]
        own = np.flatnonzero((steps.kinds == PinStep.DYAD) | (steps.kinds == PinStep.DYAD_ON_FRAME))
        to, across, b, size = to[own], across[own], b[own], unit[pin_owner[steps.placed[own]]]
        rest = x[own] - b
        one, two = np.sqrt(to[:, 0] ** 2 + to[:, 1] ** 2), np.sqrt(rest[:, 0] ** 2 + rest[:, 1] ** 2)
        p[own, 0], p[own, 1], p[own, 2], p[own, 3], p[own, 4:] = one, two, np.sign(across), 1.0 / size, b
        # the other assembly has the pin on the other side of the line through those that are given
        sure = is_surely_farther(4.0 * across**2 / (square[own] * size**2), np.zeros(1), roundings=2)
        arm[own] = np.where(sure & ~is_fixed[steps.first[own]], np.minimum(one, two) / size, 0.0)
    return p, np.nan_to_num(arm, nan=0.0, posinf=np.inf)


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
