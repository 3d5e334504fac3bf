"""Linkages of pinned bars as arrays, many at once: crank and dyads are found for all of them side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import FRAME_BODY, BlockPair, BlockSignature
from planar.batch.mechanisms.linkage_arrays import BlockBatch, InputArrays, LinkageArrays, PointArrays, make_batch
from planar.batch.mechanisms.solved_block_type import BlockType, find_block_type
from planar.model.pin_linkage import PinLayout, turning_pair_type
from planar.solving.checks.residual_check import SHORT_ARM, residual_tolerance

Array = np.ndarray

MAX_BARS = 64
"""Bars of a linkage; longer ones are parted by themselves."""


class BarLinkages(NamedTuple):
    """Linkages as arrays: `which` of those that were given (linkages,), the pins that are told of each, where each
    starts (rad), and the links of a group by its number."""

    which: Array
    arrays: LinkageArrays
    pins: list[list[int]]
    start: Array
    links_of_block: Callable[[int], str]


@lru_cache
def crank_and_dyad_types() -> tuple[BlockType, BlockType]:
    """The crank, and the dyad of two bars."""
    pin = turning_pair_type()
    dyad = (BlockPair(pin, (0, -1), False), BlockPair(pin, (1, -2), False), BlockPair(pin, (0, 1), False))
    return find_block_type(BlockSignature(1, 0, (BlockPair(pin, (FRAME_BODY, 0), True),))), find_block_type(
        BlockSignature(2, 2, dyad)
    )


class _MergedBars(NamedTuple):
    """All linkages in one: of every entry, a pin on a link, `link` and `pin` and where it is in the link (m), sorted by
    pin, the frame first. `pin0` and `link0` are where the pins and links of each linkage begin (its frame is first),
    `owner` whose a link is; `at` the places of pins, `fixed` those on the frame; extent `unit` and `reach` (m)."""

    link: Array
    pin: Array
    local: Array
    unit: Array
    reach: Array
    pin_positions: Array
    fixed_pins: Array
    first_pin: Array
    first_link: Array
    owner: Array


class _Dyads(NamedTuple):
    """Dyads that are solved at once: entries of each bar on its known pin and on the pin between, and entries of known
    links on the known pins."""

    first: Array
    second: Array
    first_between: Array
    second_between: Array
    first_on: Array
    second_on: Array


class _CranksAndDyads(NamedTuple):
    """Entries of the cranks on the frame, and of the frames there; dyads level after level; which linkages have other
    groups too; of every link the level after which it is known."""

    cranks: Array
    frames: Array
    dyads: list[_Dyads]
    has_other_blocks: Array
    level: Array


def bar_linkage_arrays(layouts: Sequence[PinLayout], wanted: Sequence[int] | None) -> BarLinkages | None:
    """Linkages that consist of a crank and dyads, None where there are none; the others are left out.

    `wanted`: pins that are told, else all that move.
    """
    whole = _merge_bars(layouts)
    peeled = _find_cranks_and_dyads(layouts, whole)
    which = np.flatnonzero(~(peeled.has_other_blocks | _has_short_bar(whole, peeled)))
    if not which.size:
        return None
    number = np.full(len(layouts), -1)
    number[which] = np.arange(len(which))
    place = np.arange(whole.first_link[-1]) - whole.first_link[whole.owner] + 1
    place[whole.first_link[:-1]] = 0
    unit = whole.unit[which]
    levels, names = _block_batches(whole, peeled, number, place, unit)

    def links(group: int) -> str:
        ends = dict.fromkeys(int(each) for each in names[group])
        return ", ".join(f"bar{link - whole.first_link[whole.owner[link]] - 1}" for link in ends)

    # every pin by the link that is placed first
    order = np.lexsort((peeled.level[whole.link], whole.pin))
    firsts = order[np.concatenate([[True], whole.pin[order][1:] != whole.pin[order][:-1]])]
    moving = np.ones(len(whole.pin_positions), dtype=bool)
    moving[whole.fixed_pins] = False
    owner = number[np.repeat(np.arange(len(layouts)), np.diff(whole.first_pin))]
    shown = np.flatnonzero(moving & (owner >= 0))
    size = unit[owner[shown]][:, None]
    local = whole.local[firsts]
    both = np.hstack([local[shown] / size, whole.pin_positions[shown] / size])
    sketch = PointArrays(owner[shown], place[whole.link[firsts[shown]]], both)
    told, own = _wanted_pins(layouts, which, wanted, shown, whole.first_pin)
    points = PointArrays(owner[told], place[whole.link[firsts[told]]], local[told])
    kept = [layouts[k] for k in which.tolist()]
    start = np.array([each.crank_angle for each in kept])
    rates = np.array([(each.velocity, each.acceleration) for each in kept]).reshape(-1, 2)
    every, yes = np.arange(len(which)), np.ones(len(which), dtype=bool)
    inputs = InputArrays(every, np.ones_like(every), start, yes, yes, *rates.T)
    many = np.diff(whole.first_link)[which]
    tolerance = residual_tolerance(many, whole.reach[which] / unit)
    turns = [levels[0], *([_merge_batches(levels[1:])] if len(levels) > 1 else [])]
    lot = LinkageArrays(many, unit, tolerance, levels, turns, inputs, sketch, points, sketch, len(names))
    return BarLinkages(which, lot, own, start, links)


def _has_short_bar(merged: _MergedBars, decomposition: _CranksAndDyads) -> Array:
    """The linkages with a bar of a dyad so short that rounding may take digits (linkages,).

    Pins that a bar carries for later dyads may lie as near to its own as they like: its angle is known by then.
    """
    found = np.zeros(len(merged.unit), dtype=bool)
    for each in decomposition.dyads:
        for known, between in ((each.first, each.first_between), (each.second, each.second_between)):
            arm = np.linalg.norm(merged.local[between] - merged.local[known], axis=-1)
            owner = merged.owner[merged.link[known]]
            found[owner[(arm > 0.0) & (arm < SHORT_ARM * merged.unit[owner])]] = True
    return found


def _find_cranks_and_dyads(layouts: Sequence[PinLayout], merged: _MergedBars) -> _CranksAndDyads:
    """What follows at once from known pins, level after level: two bars that share a pin, each on one known pin."""
    link, pin, owner = merged.link, merged.pin, merged.owner
    beams = np.diff(merged.first_link) - 1
    links, pins = len(owner), len(merged.pin_positions)
    holders = np.bincount(pin, minlength=pins)
    pairs = np.bincount(
        np.repeat(np.arange(len(layouts)), np.diff(merged.first_pin)), np.maximum(holders - 1, 0), len(layouts)
    )
    odd = (beams > MAX_BARS) | (2 * pairs + 1 != 3 * beams)
    known_link, known_pin = np.zeros(links, dtype=bool), np.zeros(pins, dtype=bool)
    level, on = np.full(links, 10**6), np.zeros(pins, dtype=np.int64)
    known_link[merged.first_link[:-1]], level[merged.first_link[:-1]] = True, -1

    def learnt() -> None:
        """Pins of known links are known, each by the first of its entries that is."""
        here = np.flatnonzero(known_link[link] & ~known_pin[pin])[::-1]
        on[pin[here]] = here
        known_pin[pin[here]] = True

    learnt()
    crank = np.zeros(links, dtype=bool)
    crank[merged.first_link[:-1] + 1 + np.array([each.crank for each in layouts])] = True
    cranks = np.flatnonzero(crank[link] & known_pin[pin])
    frames = on[pin[cranks]]
    known_link[link[cranks]], level[link[cranks]] = True, 0
    learnt()
    dyads: list[_Dyads] = []
    for number in range(1, MAX_BARS):
        free = ~known_link[link]
        held = np.bincount(link[free & known_pin[pin]], minlength=links)
        odd[owner[held > 1]] = True
        by = np.zeros(links, dtype=np.int64)
        on_known = np.flatnonzero(free & known_pin[pin])
        by[link[on_known]] = on_known
        ends = np.flatnonzero(free & ~known_pin[pin] & (held[link] == 1))
        count = np.bincount(pin[ends], minlength=pins)
        crowded = ends[count[pin[ends]] > 2]
        odd[owner[link[crowded]]] = True
        ends = ends[count[pin[ends]] == 2]
        # entries are sorted by pin, so that the two stand side by side
        one, two = ends[::2], ends[1::2]
        if not one.size:
            break
        twice = np.bincount(link[ends], minlength=links) > 1
        odd[owner[twice]] = True
        a, b = by[link[one]], by[link[two]]
        dyads.append(_Dyads(a, b, one, two, on[pin[a]], on[pin[b]]))
        known_link[link[ends]], level[link[ends]] = True, number
        learnt()
    odd[owner[~known_link]] = True
    return _CranksAndDyads(cranks, frames, dyads, odd, level)


def _block_batches(
    merged: _MergedBars, decomposition: _CranksAndDyads, number: Array, place: Array, unit: Array
) -> tuple[list[BlockBatch], Array]:
    """The cranks, then the dyads level after level, and the links of every group (groups, 2)."""
    link, local = merged.link, merged.local
    turning, dyad = crank_and_dyad_types()

    def kept(entries: Array) -> Array:
        return number[merged.owner[link[entries]]]

    fine = kept(decomposition.cranks) >= 0
    crank, frame = decomposition.cranks[fine], decomposition.frames[fine]
    places = np.stack([np.ones_like(crank), place[link[crank]]], axis=1)
    p = np.hstack([local[frame], local[crank]])
    levels = [make_batch(turning, kept(crank), places, p, np.arange(len(crank)), unit)]
    names, groups = [np.stack([link[crank], link[crank]], axis=1)], len(crank)
    for each in decomposition.dyads:
        fine = kept(each.first) >= 0
        if not fine.any():
            continue
        own = _Dyads(*(part[fine] for part in each))
        places = np.stack([place[link[k]] for k in (own.first_on, own.second_on, own.first, own.second)], axis=1)
        # as the kind has its pairs: each bar with what it is on, then one with the other
        order = (own.first, own.first_on, own.second, own.second_on, own.first_between, own.second_between)
        p = np.hstack([local[k] for k in order])
        levels.append(make_batch(dyad, kept(own.first), places, p, groups + np.arange(len(own.first)), unit))
        names.append(np.stack([link[own.first], link[own.second]], axis=1))
        groups += len(own.first)
    return levels, np.concatenate(names)


def _merge_batches(batches: Sequence[BlockBatch]) -> BlockBatch:
    """Groups of one kind, linkage after linkage, each after those that it needs."""
    owner = np.concatenate([each.owner for each in batches])
    order = np.argsort(owner, kind="stable")
    places, p, ids = (
        np.concatenate([getattr(each, name) for each in batches])[order]
        for name in ("link_indices", "p", "block_numbers")
    )
    return BlockBatch(batches[0].block_type, owner[order], places, p, ids)


def _merge_bars(layouts: Sequence[PinLayout]) -> _MergedBars:
    beams = np.array([len(each.bars) for each in layouts])
    pin0, link0 = (
        np.concatenate([[0], np.cumsum(each)])
        for each in (np.array([len(each.pin_positions) for each in layouts]), beams + 1)
    )
    at = np.concatenate([each.pin_positions for each in layouts])
    counts = np.array([len(each.frame_pins) for each in layouts])
    fixed = np.array([pin for each in layouts for pin in each.frame_pins]) + np.repeat(pin0[:-1], counts)
    lens = np.array([len(bar) for each in layouts for bar in each.bars])
    flat = np.array([pin for each in layouts for bar in each.bars for pin in bar])
    owner = np.repeat(np.arange(len(layouts)), beams)
    flat += np.repeat(pin0[owner], lens)
    starts = np.concatenate([[0], np.cumsum(lens)[:-1]])
    link = np.repeat(np.arange(len(lens)) + owner + 1, lens)
    base, way = at[flat[starts]], at[flat[starts + 1]] - at[flat[starts]]
    length = np.hypot(*way.T)
    c, s = np.repeat(way.T / length, lens, axis=1)
    x, y = (at[flat] - np.repeat(base, lens, axis=0)).T
    local = np.stack([c * x + s * y, c * y - s * x], axis=1)
    local[starts] = 0.0
    local[starts + 1, 0], local[starts + 1, 1] = length, 0.0

    # the extent of every link, the frame's too
    begins, heads = np.cumsum(counts) - counts, np.cumsum(beams) - beams
    unit = np.maximum.reduceat(np.hypot(*_extents(local, starts)), heads)
    unit = np.maximum(unit, np.hypot(*_extents(at[fixed], begins)))
    reach = np.maximum.reduceat(np.abs(local).max(axis=1), starts[heads])
    reach = np.maximum(reach, np.maximum.reduceat(np.abs(at[fixed]).max(axis=1), begins))

    pin = np.concatenate([fixed, flat])
    order = np.argsort(pin, kind="stable")
    links = np.concatenate([np.repeat(link0[:-1], counts), link])[order]
    places = np.concatenate([at[fixed], local])[order]
    whose = np.repeat(np.arange(len(layouts)), beams + 1)
    return _MergedBars(links, pin[order], places, unit, reach, at, fixed, pin0, link0, whose)


def _extents(points: Array, starts: Array) -> Array:
    """How far points (points, 2) reach in x and in y (2, parts), part by part."""
    return (np.maximum.reduceat(points, starts) - np.minimum.reduceat(points, starts)).T


def _wanted_pins(
    layouts: Sequence[PinLayout], which: Array, wanted: Sequence[int] | None, moving_pins: Array, pin0: Array
) -> tuple[Array, list[list[int]]]:
    """The pins that are told, of all linkages one after the other, and by their own numbers of each."""
    if wanted is None:
        ends = np.searchsorted(moving_pins, pin0[which]), np.searchsorted(moving_pins, pin0[which + 1])
        own = [(moving_pins[a:b] - pin0[k]).tolist() for k, a, b in zip(which, *ends, strict=True)]
        return moving_pins, own
    own = [[pin for pin in wanted if pin < len(layouts[k].pin_positions)] for k in which]
    flat = np.array([pin0[k] + pin for k, pins in zip(which, own, strict=True) for pin in pins], dtype=np.int64)
    return flat, own
