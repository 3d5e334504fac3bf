"""How many conditions and free numbers each part of a structure has, by ranks at a linkage."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, ComplexArray
from planar.foundation.errors import PlanarError, join_names
from planar.model.wording import count_phrase
from planar.synthesis.exact.relations.exact_problem import Component, ExactProblem
from planar.synthesis.exact.relations.family import Member
from planar.synthesis.exact.relations.known_linkage import component_unknowns, linkage_values, sample_linkage

NO_RANK = 1e-9
"""Of the greatest singular value: one below is zero."""


class PartCount(NamedTuple):
    """Of a part of a structure, by its links: how many of its numbers stay `open`, and how many conditions more are set
    than it can meet."""

    links: tuple[str, ...]
    open: int
    excess: int

    @property
    def name(self) -> str:
        """The part in words."""
        if not self.links:
            return "the frame"
        names = join_names(map(repr, self.links))
        return f"the link{'s' * (len(self.links) > 1)} {names}"

    @property
    def sentence(self) -> str:
        """What it cannot meet, or what stays open, in words."""
        parts = []
        if self.excess:
            verb = "is" if self.excess == 1 else "are"
            parts.append(f"{count_phrase(self.excess, 'condition')} on {self.name} {verb} too many")
        if self.open:
            verb = "stays" if self.open == 1 else "stay"
            name = self.name if not self.excess else "it" if len(self.links) < 2 else "them"
            parts.append(f"{count_phrase(self.open, 'number')} of {name} {verb} open")
        return " and ".join(parts)


def count_parts(problem: ExactProblem) -> tuple[PartCount, ...]:
    """The count of each component of a problem, and last that of what is given alone, where entries set conditions on
    it."""
    try:
        known = sample_linkage(problem)
        values = linkage_values(problem, known)
        members = {id(each): problem.member(each, known.items) for each in _parts(problem)}
    except PlanarError:  # its start does not move: rows and unknowns are counted
        return tuple(_plain_count(problem, each) for each in _parts(problem))
    return tuple(
        PartCount(part_links(problem, each), *_ranks(each, members[id(each)], component_unknowns(each, values)))
        for each in _parts(problem)
    )


def _parts(problem: ExactProblem) -> Iterator[Component]:
    yield from problem.components
    if problem.fixed.family.row_count:
        yield problem.fixed


def _plain_count(problem: ExactProblem, part: Component) -> PartCount:
    return PartCount(part_links(problem, part), max(part.freedom, 0), max(-part.freedom, 0))


def _ranks(part: Component, member: Member, x: ComplexArray) -> tuple[int, int]:
    """How many dimensions of unknowns the rows leave, and how many of the rows no unknown can meet."""
    still = [np.zeros_like(each) for each in member.parts]
    slope = part.family.rows_at(x[:, None], member, still, np.zeros(1))[1][:, :, 0]
    rng = np.random.default_rng(5)
    columns = []
    for _ in range(len(slope)):
        change = [rng.normal(size=each.shape) + 0.0j for each in member.parts]
        columns.append(part.family.rows_at(x[:, None], member, change, np.zeros(1))[2][:, 0])
    both = np.concatenate([slope, np.array(columns).T.reshape(len(slope), -1)], axis=1)
    sizes = np.linalg.norm(both, axis=1, keepdims=True)
    both = both / np.where(sizes > 0.0, sizes, 1.0)
    rank = _rank(both[:, : len(x)])
    return len(x) - rank, _rank(both) - rank


def _rank(matrix: Array | ComplexArray) -> int:
    if not matrix.size:
        return 0
    values = np.linalg.svd(matrix, compute_uv=False)
    return int((values > NO_RANK * max(values[0], NO_RANK)).sum())


def part_links(problem: ExactProblem, part: Component) -> tuple[str, ...]:
    """The links whose points are sought in a component, without those that entries place; of what is given alone those
    that are in none."""
    frame, placed = problem.mechanism.frame, {problem.items[0].of}
    moving = [each.name for each in problem.mechanism.links if each.name not in (frame, *placed)]
    if not part.unknowns:
        others = {name for each in problem.components for name in part_links(problem, each)}
        return tuple(name for name in moving if name not in others)
    own = {number for each in part.unknowns for number in each}
    used = {
        link for (link, _), place in problem.pose.places.items() if own & place.substitute(problem.pose.values).symbols
    }
    for link, axes in problem.pose.axes.items():
        if any(each is not None and own & each.substitute(problem.pose.values).symbols for each in axes):
            used.add(link)
    return tuple(name for name in moving if name in used)
