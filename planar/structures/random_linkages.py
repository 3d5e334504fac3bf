"""Random linkages of all structures of so many links whose crank turns fully, with the paths of all their points."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.linkages import SweepRequest
from planar.batch.mechanisms.part_runs import solve_part
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.pin_linkages import PinnedLinkages, pinned_linkages
from planar.structures.linkage_dimensions import Linkage, candidate_places

ABSENT = -1
"""In arrays of pin numbers: no pin."""
PATIENCE, MAX_ROUNDS = 40, 400
"""Draws of dimensions after which a structure is drawn anew, too; and after which an end is made."""
ASIDE = 0.4
"""How far a coupler point lies beside a joint of its link on average, joints being in a square of side 2."""


class Structure(NamedTuple):
    """A linkage without dimensions, by the numbers of its chain, its fixed link and its driven joint."""

    chain: int
    linkage: Linkage


class SolvedLinkages(NamedTuple):
    """Linkages with the numbers of their structures, where their pins stand at the start (linkages, pins, 2), of which
    the last is the coupler point, on which link that is, and the paths of all pins (linkages, steps + 1, pins, 2)."""

    structure: IntArray
    start: Array
    coupler_link: IntArray
    path: Array


@cache
def structures(links: int) -> tuple[Structure, ...]:
    """All chains of freedom 1, with all fixed links and driven joints that differ."""
    from planar.structures.enumeration.chains import chains

    return tuple(
        Structure(number, Linkage(chain.edges, each.frame, each.drives))
        for number, chain in enumerate(chains(links))
        for each in chain.mechanisms()
    )


def random_linkages(links: int, count: int, steps: int, seed: Sequence[int]) -> SolvedLinkages:
    """So many linkages, the same for the same seed: of each its structure is drawn first, all alike, then dimensions
    until its crank turns fully. Raises NoAnswer where that takes too long."""
    known, random = structures(links), np.random.default_rng(seed)
    drawn = random.integers(len(known), size=count)
    joints = len(known[0].linkage.joints)
    found = SolvedLinkages(
        drawn,
        np.empty((count, joints + 1, 2)),
        np.empty(count, dtype=np.int64),
        np.empty((count, steps + 1, joints + 1, 2)),
    )
    left = np.arange(count)
    for turn in range(MAX_ROUNDS):
        if turn >= PATIENCE:
            drawn[left] = random.integers(len(known), size=len(left))
        start, link, linkages = _draw([known[k].linkage for k in drawn[left]], random)
        # what compiled code leaves open comes to a dead point in most cases
        part = solve_part(linkages, SweepRequest(steps, None, False, None), uses_general_path=False)
        is_whole, first = part.last_status == 0, part.points.first
        for k in np.flatnonzero(is_whole).tolist():
            row, pins = left[k], part.points.codes[first[k] : first[k + 1]]
            found.start[row], found.coupler_link[row] = start[k], link[k]
            found.path[row] = start[k]
            found.path[row][:, pins] = part.values[first[k] : first[k + 1], :, : steps + 1].transpose(2, 0, 1)
        left = left[~is_whole]
        if not len(left):
            return found
    told = f"of {MAX_ROUNDS} random linkages of {links} links each, {len(left)} of {count} times none turns fully"
    raise NoAnswer(Outcome.DEAD_POINT, f"{told}; ask for fewer links")


def _draw(linkages: Sequence[Linkage], random: np.random.Generator) -> tuple[Array, Array, PinnedLinkages]:
    """Dimensions and a coupler point for each linkage: where all pins stand, on which link it is, and arrays to run."""
    places = candidate_places(linkages, random)
    many, joints = places.shape[:2]
    couplers = np.array([random.choice(_couplers(each)) for each in linkages])
    beside = np.array([random.choice(each.joints_of(link)) for each, link in zip(linkages, couplers, strict=True)])
    point = places[np.arange(many), beside] + random.normal(scale=ASIDE, size=(many, 2))
    start = np.concatenate([places, point[:, None]], axis=1)
    links = linkages[0].link_count
    widest = 1 + max(len(each.joints_of(link)) for each in linkages for link in range(links))
    bars = np.full((many, links - 1, widest), ABSENT)
    frames = np.full((many, widest), ABSENT)
    cranks = np.empty(many, dtype=np.int64)
    for row, (each, coupler) in enumerate(zip(linkages, couplers.tolist(), strict=True)):
        moving = [link for link in range(links) if link != each.frame]
        cranks[row] = moving.index(each.driven_link(0))
        for k, link in enumerate(moving):
            pins = each.joints_of(link) + [joints] * (link == coupler)
            bars[row, k, : len(pins)] = pins
        own = each.joints_of(each.frame)
        frames[row, : len(own)] = own
    return start, couplers, pinned_linkages(start, bars, frames, cranks)


def _couplers(linkage: Linkage) -> list[int]:
    """Links that neither are fixed nor turn about a fixed pivot; where there is none, all that the input does not
    drive."""
    pivoted = {link for links in linkage.joints if linkage.frame in links for link in links}
    moving = [link for link in range(linkage.link_count) if link != linkage.frame]
    return [link for link in moving if link not in pivoted] or [
        link for link in moving if link != linkage.driven_link(0)
    ]
