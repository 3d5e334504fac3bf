"""Linkages of pinned bars as arrays, many at once: crank and dyads are found for all of them side by side."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import GROUNDED, Joint, Signature
from planar.batch.mechanisms.linkage_arrays import Batch, Inputs, Lot, Marked, batch
from planar.batch.mechanisms.partition import EPS
from planar.batch.mechanisms.solved_block_type import Kind, kind
from planar.model.pin_linkage import Laid, joined
from planar.solving.checks.residual_check import SHORT_ARM

Array = np.ndarray

MOST = 64
"""Bars of a linkage; longer ones are parted by themselves."""


class Bars(NamedTuple):
    """Linkages as arrays: `which` of those that were given (linkages,), the pins that are told of each, where each
    starts (rad), and the links of a group by its number."""

    which: Array
    lot: Lot
    pins: list[list[int]]
    start: Array
    links: Callable[[int], str]


@lru_cache
def kinds() -> tuple[Kind, Kind]:
    """The crank, and the dyad of two bars."""
    pin = joined()
    dyad = (Joint(pin, (0, -1), False), Joint(pin, (1, -2), False), Joint(pin, (0, 1), False))
    return kind(Signature(1, 0, (Joint(pin, (GROUNDED, 0), True),))), kind(Signature(2, 2, dyad))


class _Whole(NamedTuple):
    """All linkages in one: of every entry, a pin on a link, `link` and `pin` and where it is in the link (m), sorted by
    pin, the frame first. `pin0` and `link0` are where the pins and links of each linkage begin (its frame is first),
    `owner` whose a link is; `at` the places of pins, `fixed` those on the frame; extent `unit` and `reach` (m)."""

    link: Array
    pin: Array
    local: Array
    unit: Array
    reach: Array
    at: Array
    fixed: Array
    pin0: Array
    link0: Array
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


class _Peeled(NamedTuple):
    """Entries of the cranks on the frame, and of the frames there; dyads level after level; which linkages have other
    groups too; of every link the level after which it is known."""

    cranks: Array
    frames: Array
    dyads: list[_Dyads]
    odd: Array
    level: Array


def bars(laid: Sequence[Laid], wanted: Sequence[int] | None) -> Bars | None:
    """Linkages that consist of a crank and dyads, None where there are none; the others are left out.

    `wanted`: pins that are told, else all that move.
    """
    whole = _whole(laid)
    peeled = _peeled(laid, whole)
    which = np.flatnonzero(~(peeled.odd | _short(whole, peeled)))
    if not which.size:
        return None
    number = np.full(len(laid), -1)
    number[which] = np.arange(len(which))
    place = np.arange(whole.link0[-1]) - whole.link0[whole.owner] + 1
    place[whole.link0[:-1]] = 0
    unit = whole.unit[which]
    levels, names = _levels(whole, peeled, number, place, unit)

    def links(group: int) -> str:
        ends = dict.fromkeys(int(each) for each in names[group])
        return ", ".join(f"bar{link - whole.link0[whole.owner[link]] - 1}" for link in ends)

    # every pin by the link that is placed first
    order = np.lexsort((peeled.level[whole.link], whole.pin))
    firsts = order[np.concatenate([[True], whole.pin[order][1:] != whole.pin[order][:-1]])]
    moving = np.ones(len(whole.at), dtype=bool)
    moving[whole.fixed] = False
    owner = number[np.repeat(np.arange(len(laid)), np.diff(whole.pin0))]
    shown = np.flatnonzero(moving & (owner >= 0))
    size = unit[owner[shown]][:, None]
    local = whole.local[firsts]
    both = np.hstack([local[shown] / size, whole.at[shown] / size])
    sketch = Marked(owner[shown], place[whole.link[firsts[shown]]], both)
    told, own = _told(laid, which, wanted, shown, whole.pin0)
    points = Marked(owner[told], place[whole.link[firsts[told]]], local[told])
    start = np.array([laid[k].position for k in which])
    rates = np.array([(laid[k].velocity, laid[k].acceleration) for k in which]).reshape(-1, 2)
    every, yes = np.arange(len(which)), np.ones(len(which), dtype=bool)
    inputs = Inputs(every, np.ones_like(every), start, yes, yes, *rates.T)
    many = np.diff(whole.link0)[which]
    tolerance = 16.0 * EPS * (4 + many) * np.maximum(1.0, whole.reach[which] / unit)
    turns = [levels[0], *([_together(levels[1:])] if len(levels) > 1 else [])]
    lot = Lot(many, unit, tolerance, levels, turns, inputs, sketch, points, sketch, len(names))
    return Bars(which, lot, own, start, links)


def _short(whole: _Whole, peeled: _Peeled) -> Array:
    """The linkages with a bar so short that rounding may take digits, other than a crank (linkages,)."""
    order = np.argsort(whole.link, kind="stable")
    link, at = whole.link[order], whole.local[order]
    exempt = np.zeros(len(whole.owner), dtype=bool)
    exempt[whole.link[peeled.cranks]] = True
    exempt[whole.link0[:-1]] = True
    found = np.zeros(len(whole.unit), dtype=bool)
    for ahead in range(1, int(np.bincount(link).max(initial=0))):
        both = np.flatnonzero((link[ahead:] == link[:-ahead]) & ~exempt[link[ahead:]])
        arm = np.hypot(*(at[both + ahead] - at[both]).T)
        owner = whole.owner[link[both]]
        found[owner[(arm > 0.0) & (arm < SHORT_ARM * whole.unit[owner])]] = True
    return found


def _peeled(laid: Sequence[Laid], whole: _Whole) -> _Peeled:
    """What follows at once from known pins, level after level: two bars that share a pin, each on one known pin."""
    link, pin, owner = whole.link, whole.pin, whole.owner
    beams = np.diff(whole.link0) - 1
    links, pins = len(owner), len(whole.at)
    holders = np.bincount(pin, minlength=pins)
    pairs = np.bincount(np.repeat(np.arange(len(laid)), np.diff(whole.pin0)), np.maximum(holders - 1, 0), len(laid))
    odd = (beams > MOST) | (2 * pairs + 1 != 3 * beams)
    known_link, known_pin = np.zeros(links, dtype=bool), np.zeros(pins, dtype=bool)
    level, on = np.full(links, 10**6), np.zeros(pins, dtype=np.int64)
    known_link[whole.link0[:-1]], level[whole.link0[:-1]] = True, -1

    def learnt() -> None:
        """Pins of known links are known, each by the first of its entries that is."""
        here = np.flatnonzero(known_link[link] & ~known_pin[pin])[::-1]
        on[pin[here]] = here
        known_pin[pin[here]] = True

    learnt()
    crank = np.zeros(links, dtype=bool)
    crank[whole.link0[:-1] + 1 + np.array([each.crank for each in laid])] = True
    cranks = np.flatnonzero(crank[link] & known_pin[pin])
    frames = on[pin[cranks]]
    known_link[link[cranks]], level[link[cranks]] = True, 0
    learnt()
    dyads: list[_Dyads] = []
    for number in range(1, MOST):
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
    return _Peeled(cranks, frames, dyads, odd, level)


def _levels(whole: _Whole, peeled: _Peeled, number: Array, place: Array, unit: Array) -> tuple[list[Batch], Array]:
    """The cranks, then the dyads level after level, and the links of every group (groups, 2)."""
    link, local = whole.link, whole.local
    turning, dyad = kinds()

    def kept(entries: Array) -> Array:
        return number[whole.owner[link[entries]]]

    fine = kept(peeled.cranks) >= 0
    crank, frame = peeled.cranks[fine], peeled.frames[fine]
    places = np.stack([np.ones_like(crank), place[link[crank]]], axis=1)
    p = np.hstack([local[frame], local[crank]])
    levels = [batch(turning, kept(crank), places, p, np.arange(len(crank)), unit)]
    names, groups = [np.stack([link[crank], link[crank]], axis=1)], len(crank)
    for each in peeled.dyads:
        fine = kept(each.first) >= 0
        if not fine.any():
            continue
        own = _Dyads(*(part[fine] for part in each))
        places = np.stack([place[link[k]] for k in (own.first_on, own.second_on, own.first, own.second)], axis=1)
        # as the kind has its pairs: each bar with what it is on, then one with the other
        order = (own.first, own.first_on, own.second, own.second_on, own.first_between, own.second_between)
        p = np.hstack([local[k] for k in order])
        levels.append(batch(dyad, kept(own.first), places, p, groups + np.arange(len(own.first)), unit))
        names.append(np.stack([link[own.first], link[own.second]], axis=1))
        groups += len(own.first)
    return levels, np.concatenate(names)


def _together(batches: Sequence[Batch]) -> Batch:
    """Groups of one kind, linkage after linkage, each after those that it needs."""
    owner = np.concatenate([each.owner for each in batches])
    order = np.argsort(owner, kind="stable")
    places, p, ids = (
        np.concatenate([getattr(each, name) for each in batches])[order] for name in ("places", "p", "ids")
    )
    return Batch(batches[0].kind, owner[order], places, p, ids)


def _whole(laid: Sequence[Laid]) -> _Whole:
    beams = np.array([len(each.bars) for each in laid])
    pin0, link0 = (
        np.concatenate([[0], np.cumsum(each)]) for each in (np.array([len(each.at) for each in laid]), beams + 1)
    )
    at = np.concatenate([each.at for each in laid])
    counts = np.array([len(each.fixed) for each in laid])
    fixed = np.array([pin for each in laid for pin in each.fixed]) + np.repeat(pin0[:-1], counts)
    lens = np.array([len(bar) for each in laid for bar in each.bars])
    flat = np.array([pin for each in laid for bar in each.bars for pin in bar])
    owner = np.repeat(np.arange(len(laid)), beams)
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
    unit = np.maximum.reduceat(np.hypot(*_span(local, starts)), heads)
    unit = np.maximum(unit, np.hypot(*_span(at[fixed], begins)))
    reach = np.maximum.reduceat(np.abs(local).max(axis=1), starts[heads])
    reach = np.maximum(reach, np.maximum.reduceat(np.abs(at[fixed]).max(axis=1), begins))

    pin = np.concatenate([fixed, flat])
    order = np.argsort(pin, kind="stable")
    links = np.concatenate([np.repeat(link0[:-1], counts), link])[order]
    places = np.concatenate([at[fixed], local])[order]
    whose = np.repeat(np.arange(len(laid)), beams + 1)
    return _Whole(links, pin[order], places, unit, reach, at, fixed, pin0, link0, whose)


def _span(points: Array, starts: Array) -> Array:
    """How far points (points, 2) reach in x and in y (2, parts), part by part."""
    return (np.maximum.reduceat(points, starts) - np.minimum.reduceat(points, starts)).T


def _told(
    laid: Sequence[Laid], which: Array, wanted: Sequence[int] | None, shown: Array, pin0: Array
) -> tuple[Array, list[list[int]]]:
    """The pins that are told, of all linkages one after the other, and by their own numbers of each."""
    if wanted is None:
        ends = np.searchsorted(shown, pin0[which]), np.searchsorted(shown, pin0[which + 1])
        own = [(shown[a:b] - pin0[k]).tolist() for k, a, b in zip(which, *ends, strict=True)]
        return shown, own
    own = [[pin for pin in wanted if pin < len(laid[k].at)] for k in which]
    flat = np.array([pin0[k] + pin for k, pins in zip(which, own, strict=True) for pin in pins], dtype=np.int64)
    return flat, own
