"""What mechanisms have in common that differ in their numbers alone: names, pairs, program, places of points."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from planar.equations.acceptance import Judged, judged
from planar.equations.functions import CACHED, Program, program
from planar.foundation.errors import BadInput
from planar.model.link_shapes import At
from planar.model.mechanism import (
    Input,
    Link,
    Mechanism,
    Point,
    check,
    counting,
    motions,
    named_points,
    unlawful,
)
from planar.model.pairs import Kind, Pair

Array = np.ndarray


class Places(NamedTuple):
    """Where named points are found: each by the first of its links to be placed, (stage, link, point), and the points
    of each link with their names; `level` is the stage after which each link stands, -1 where inputs alone say so."""

    first: dict[str, tuple[int, str, str]]
    points_of: dict[str, list[tuple[str, str]]]
    level: dict[str, int]


class Outline:
    """All of a mechanism but its numbers. Raises BadInput where it names what it does not have."""

    def __init__(self, mechanism: Mechanism):
        check(mechanism)
        self.mechanism = mechanism
        self.program: Program = program(mechanism)
        self.equations = self.program.equations
        self.column = {(c.owner, c.part): index for index, c in enumerate(self.equations.coordinates)}
        self.pairs: dict[str, Pair] = {pair.name: pair for pair in mechanism.pairs}
        self.named = motions(mechanism)
        self.lengths = np.array([c.kind is Kind.LENGTH for c in self.equations.coordinates], dtype=bool)
        self.slide = tuple(self.named[given.pair].drive_kind is Kind.LENGTH for given in mechanism.inputs)
        self.counts = bool(counting(mechanism))

    @cached_property
    def judged(self) -> Judged | None:
        """What judges positions in compiled functions, for the structures that have it."""
        found = judged(self.mechanism)
        return found if found.able else None

    @cached_property
    def places(self) -> Places:
        """Where named points are found."""
        links = self.mechanism.links
        level = {link.name: self._level(link.name) for link in links}
        first: dict[str, tuple[int, str, str]] = {}
        points_of: dict[str, list[tuple[str, str]]] = {link.name: [] for link in links}
        for each in named_points(self.mechanism):
            first[each.name] = min((level[link], link, point) for link, point in each.members)
            for link, point in each.members:
                points_of[link].append((point, each.name))
        return Places(first, points_of, level)

    def _level(self, link: str) -> int:
        columns = [self.column.get((link, part)) for part in ("x", "y", "angle")]
        return max((self.equations.known_from[c] for c in columns if c is not None), default=-1)


def outline(mechanism: Mechanism) -> Outline:
    """The outline of a mechanism, kept for others of the same. Raises BadInput."""
    wrong = unlawful(mechanism)
    if wrong:
        raise BadInput(*wrong)
    links = tuple((link.name, link.names) for link in mechanism.links)
    try:
        return _outline(mechanism.frame, links, mechanism.pairs, tuple(given.pair for given in mechanism.inputs))
    except TypeError:  # made in Python, of lists
        return Outline(mechanism)


@lru_cache(maxsize=CACHED)
def _outline(
    frame: str, links: tuple[tuple[str, tuple[str, ...]], ...], pairs: tuple[Pair, ...], inputs: tuple[str, ...]
) -> Outline:
    bare = tuple(Link(name, tuple(Point(point, At(0.0, 0.0)) for point in points)) for name, points in links)
    return Outline(Mechanism("", frame, bare, pairs, tuple(Input(pair, 0.0) for pair in inputs)))
