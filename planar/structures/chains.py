"""All kinematic chains of so many links, in a fixed order."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, overload

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.wording import count_phrase
from planar.structures.binary_links import distribute_binary_links
from planar.structures.chain import Chain
from planar.structures.contracted_graphs import ContractedGraph, contracted_graphs
from planar.structures.contraction import canonical_chain, expand_graph, ring_joints


def chains(links: int, freedom: int = 1, *, fractionated: bool = True) -> Chains:
    """All kinematic chains of so many links joined by pins, as a sequence that is made as it is read.

    A chain is closed: each link has two joints or more. By count it has this freedom, and none of its parts has
    freedom 0 or less. Chains that a single link parts into ones that move alone are among them, after the others;
    without `fractionated` they are left out. There are none of freedom 1.

    Raises BadInput where by count no chain of so many links has this freedom.

    >>> import planar
    >>> len(planar.chains(8)), planar.chains(10)[17].assortment
    (16, (4, 6))
    """
    for name, value, least in (("links", links, 4), ("freedom", freedom, 1)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise BadInput(name, f"a whole number from {least} on is wanted, not {value!r:.40}")
    if (links - freedom) % 2 == 0:
        wanted = "odd" if links % 2 == 0 else "even"
        raise BadInput(
            "freedom",
            f"a chain of {links} links has an {wanted} freedom, 3 (links - 1) less 2 for each pin; ask for "
            f"{freedom + 1 if freedom == 1 else freedom - 1}, or for another number of links",
        )
    if links < freedom + 3:
        raise BadInput(
            "links",
            f"a chain of freedom {freedom} has {freedom + 3} links at least, as a single loop does; not {links}",
        )
    return Chains(links, freedom, fractionated)


class Chains(Sequence[Chain]):
    """All chains of some number of links and freedom, in order; see `planar.chains`.

    The order: chains that no single link parts come first; then by the numbers of joints of the links, the greatest
    first, where less comes first (so all ternary links before quaternary ones); then by the edges of the contracted
    graph, then by the binary links on these, both as words of which the greater comes first. A chain's number is its
    place, from 0.
    """

    def __init__(self, links: int, freedom: int, fractionated: bool):
        self.links, self.freedom, self.fractionated = links, freedom, fractionated
        loops = (links - 1 - freedom) // 2
        # a chain of freedom 1 that a link parts would have parts of freedom 0
        self._graphs = contracted_graphs(loops, fractionated and freedom > 1) if loops > 1 else ()
        self._rows: list[Array] = []

    def __repr__(self) -> str:
        return f"<Chains of {self.links} links, freedom {self.freedom}>"

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
        left = index + len(self) if index < 0 else index
        if left >= 0 and not self._graphs and left < 1:
            return self._chain(ring_joints(self.links), 0)
        number = left
        for graph, rows in self._parts():
            if 0 <= left < len(rows):
                return self._chain(expand_graph(graph, rows[left]), number)
            left -= len(rows)
        raise IndexError(
            f"there are {count_phrase(len(self), 'kinematic chain')} of {self.links} links, not one of number {index}"
        )

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
        if (chain.links, chain.freedom) != (self.links, self.freedom):
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

    def _chain(self, joints: Any, number: int) -> Chain:
        return Chain(self.links, self.freedom, joints, number)

    def _parts(self) -> Iterator[tuple[ContractedGraph, Array]]:
        """Each contracted graph with the binary links on its edges, made where they are not yet."""
        for index, graph in enumerate(self._graphs):
            if index == len(self._rows):
                self._rows.append(distribute_binary_links(graph, self.links - len(graph.counts), self.freedom))
            yield graph, self._rows[index]
