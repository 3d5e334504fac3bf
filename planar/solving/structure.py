"""The structure that mechanisms share which differ in numbers alone: names, pairs, functions, points."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from planar.equations.acceptance import AcceptanceFunctions, acceptance_functions
from planar.equations.coordinates import FRAME_PARTS, coordinate_columns
from planar.equations.functions import MAX_CACHED_STRUCTURES, EquationFunctions, equation_functions
from planar.foundation.errors import BadInput
from planar.model.link_shapes import At, Link, Point
from planar.model.mechanism import (
    Input,
    Mechanism,
    check_mechanism,
    find_law_problem,
    links_counting_turns,
    named_points,
    relative_motions,
)
from planar.model.pairs import MeasureKind, Pair
from planar.solving.checks.residual_check import ResidualCheck


class PointLocations(NamedTuple):
    """The places of named points: each by the first of its links to be placed, (block, link, point), and the points of
    each link with their names. The block is that after which the link stands, -1 where inputs alone place it."""

    first_link: dict[str, tuple[int, str, str]]
    points_of: dict[str, list[tuple[str, str]]]


class MechanismStructure:
    """All of a mechanism but its numbers. Raises BadInput where it names what it does not have."""

    def __init__(self, mechanism: Mechanism):
        check_mechanism(mechanism)
        self.mechanism = mechanism
        self.functions: EquationFunctions = equation_functions(mechanism)
        self.equations = self.functions.equations
        self.column = coordinate_columns(self.equations.coordinates)
        self.pairs: dict[str, Pair] = {pair.name: pair for pair in mechanism.pairs}
        self.relative_motions = relative_motions(mechanism)
        self.is_length = np.array([c.kind is MeasureKind.LENGTH for c in self.equations.coordinates], dtype=bool)
        self.input_slides = tuple(
            self.relative_motions[given.pair].input_kind is MeasureKind.LENGTH for given in mechanism.inputs
        )
        self.counts = bool(links_counting_turns(mechanism))

    @cached_property
    def acceptance(self) -> AcceptanceFunctions | None:
        """What computes and judges positions block after block, for the structures that have it."""
        functions = acceptance_functions(self.mechanism)
        return functions if functions.is_available else None

    @cached_property
    def residual_check(self) -> ResidualCheck:
        """What judges positions by the pairs' own formulas."""
        return ResidualCheck(self.mechanism, self.column, self.equations.open_rows)

    @cached_property
    def point_locations(self) -> PointLocations:
        """The places of named points."""
        names = [link.name for link in self.mechanism.links]
        known_after = self.equations.known_after_block
        columns = {link: [self.column.get((link, part)) for part in FRAME_PARTS] for link in names}
        blocks = {link: max((known_after[c] for c in columns[link] if c is not None), default=-1) for link in names}
        first: dict[str, tuple[int, str, str]] = {}
        points_of: dict[str, list[tuple[str, str]]] = {link: [] for link in names}
        for named in named_points(self.mechanism):
            first[named.name] = min((blocks[link], link, point) for link, point in named.members)
            for link, point in named.members:
                points_of[link].append((point, named.name))
        return PointLocations(first, points_of)


def mechanism_structure(mechanism: Mechanism) -> MechanismStructure:
    """The outline of a mechanism, kept for others of the same. Raises BadInput."""
    wrong = find_law_problem(mechanism)
    if wrong:
        raise BadInput(*wrong)
    links = tuple((link.name, link.names) for link in mechanism.links)
    try:
        inputs = tuple(given.pair for given in mechanism.inputs)
        return _cached_structure(mechanism.frame, links, mechanism.pairs, inputs, mechanism.closes_within is not None)
    except TypeError:  # made in Python, of lists
        return MechanismStructure(mechanism)


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _cached_structure(
    frame: str,
    links: tuple[tuple[str, tuple[str, ...]], ...],
    pairs: tuple[Pair, ...],
    inputs: tuple[str, ...],
    with_misfit: bool,
) -> MechanismStructure:
    bare = tuple(Link(name, tuple(Point(point, At(0.0, 0.0)) for point in points)) for name, points in links)
    drives = tuple(Input(pair, 0.0) for pair in inputs)
    return MechanismStructure(Mechanism("", frame, bare, pairs, drives, closes_within=0.0 if with_misfit else None))
