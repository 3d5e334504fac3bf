"""All kinematic chains of so many links and pins, in a fixed order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, overload

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.time_limit import stop_if_over
from planar.model.wording import count_phrase
from planar.structures.chain import Chain
from planar.structures.contracted_graphs import ContractedGraph, contracted_graphs
from planar.structures.contraction import canonical_chain, expand_graph, ring_joints
from planar.structures.enumeration.binary_links import distribute_binary_links
from planar.structures.multiple_pins import joint_kinds_phrase


class Chains(Sequence[Chain]):
    """All chains of some number of links and pins and of some freedom, in order; see `planar.chains`.

    The order: chains that no single link parts come first; then by the numbers of joints of the links, the greatest
    first, where less comes first (so all ternary links before quaternary ones); then by the edges of the contracted
    graph, then by the binary links on these, both as words of which the greater comes first. A chain's number is its
    place, from 0.
    """

    def __init__(self, links: int, freedom: int, fractionated: bool):
        self.links, self.freedom, self.fractionated = links, freedom, fractionated
        self.slides = self.multiple_pins = 0
        loops = (links - 1 - freedom) // 2
        # a chain of freedom 1 that a link parts would have parts of freedom 0
        self._graphs = contracted_graphs(loops, fractionated and freedom > 1) if loops > 1 else ()
        self._rows: list[Array] = []

    def __repr__(self) -> str:
        beside = joint_kinds_phrase(self.slides, self.multiple_pins)
        return f"<Chains of {self.links} links{beside}, freedom {self.freedom}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return Chains, (self.links, self.freedom, self.fractionated)

    def __len__(self) -> int:
        return sum(len(rows) for _, rows in self._parts()) if self._graphs else 1

    def __iter__(self) -> Iterator[Chain]:
        if not self._graphs:
            yield self._chain(ring_joints(self.links), 0)
        number = 0
        for graph, rows in self._parts():
            for row in rows:
                yield self._chain(expand_graph(graph, row), number)
                number += 1

    @overload
    def __getitem__(self, index: int) -> Chain: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Chain, ...]: ...
    def __getitem__(self, index: int | slice) -> Chain | tuple[Chain, ...]:
        if isinstance(index, slice):
            return tuple(self[k] for k in range(*index.indices(len(self))))
        place = index + len(self) if index < 0 else index
        found = self._at(place) if place >= 0 else None
        if found is None:
            many = count_phrase(len(self), "kinematic chain")
            raise IndexError(f"there are {many} of {self.links} links, not one of number {index}")
        return found

    def index(self, value: Any, start: int = 0, stop: int | None = None) -> int:
        """The number of a chain. Raises ValueError where it is none of these."""
        number = self.number_of(value) if isinstance(value, Chain) else None
        if number is None or number not in range(*slice(start, stop).indices(number + 1)):
            raise ValueError(f"{value!r} is not among the {self!r}")
        return number

    def __contains__(self, value: object) -> bool:
        return isinstance(value, Chain) and self.number_of(value) is not None

    def number_of(self, chain: Chain) -> int | None:
        """The number of a chain, whatever the numbers of its links; None where it is none of these."""
        if (chain.links, chain.freedom, chain.slides, chain.multiple_pins) != (self.links, self.freedom, (), ()):
            return None
        wanted = canonical_chain(chain.links, chain.edges)
        if not self._graphs:
            return 0
        before = 0
        for graph, rows in self._parts():
            if graph.word == wanted.word:
                at = np.flatnonzero((rows == wanted.row).all(axis=1))
                return before + int(at[0]) if len(at) else None
            before += len(rows)
        return None

    def _at(self, place: int) -> Chain | None:
        """The chain of a number from 0 on, None beyond the last."""
        if not self._graphs:
            return None if place else self._chain(ring_joints(self.links), 0)
        left = place
        for graph, rows in self._parts():
            if left < len(rows):
                return self._chain(expand_graph(graph, rows[left]), place)
            left -= len(rows)
        return None

    def _chain(self, joints: Any, number: int) -> Chain:
        return Chain(self.links, self.freedom, joints, number)

    def _parts(self) -> Iterator[tuple[ContractedGraph, Array]]:
        """Each contracted graph with the binary links on its edges, made where they are not yet."""
        for index, graph in enumerate(self._graphs):
            if index == len(self._rows):
                stop_if_over(f"after {index} of {len(self._graphs)} contracted graphs")
                self._rows.append(distribute_binary_links(graph, self.links - len(graph.counts), self.freedom))
            yield graph, self._rows[index]
