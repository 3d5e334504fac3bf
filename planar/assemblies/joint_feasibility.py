"""Whether some of a mechanism's pairs and inputs can be met together, whatever else it has."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from planar.model.mechanism import entries
from planar.model.pairs import Kind, Pair
from planar.solving.assembly.sketch_start import sketched
from planar.solving.full_constraints import STEP, Constraints
from planar.solving.newton import newton
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

BATCHES = (1, 3, 28)
"""Starts, one batch after the other; what can be met is mostly met from the first."""
LARGE = 18
"""Coordinates of links: more are not tried with the last batch, which takes long."""
SKETCHED = 4
"""Starts that are about the sketch."""


class Member(NamedTuple):
    """A pair as the file has it, with all the links of its pin, or the input at a pair."""

    name: str
    input: bool = False


class Joining:
    """The pairs and inputs of one mechanism, of which any may be left out.

    What can be met is proved by a position that meets it to round-off; that something cannot rests on starts.
    """

    def __init__(self, setup: Setup):
        self.setup = setup
        self.pairs = {Member(group[0].entry_name()): group for group in entries(setup.mechanism)}
        self.inputs = {
            Member(given.pair, True): float(at)
            for given, at in zip(setup.mechanism.inputs, setup.station.u, strict=True)
        }
        self._met: list[frozenset[Member]] = []
        self._unmet: list[frozenset[Member]] = []
        self._entry = {
            named.name: member.name for member, group in self.pairs.items() for named in type(group[0]).motions(group)
        }

    @property
    def members(self) -> tuple[Member, ...]:
        """All pairs and inputs in the order of the file, an input after its pair."""
        rank = {member.name: index for index, member in enumerate(self.pairs)}
        return tuple(sorted((*self.pairs, *self.inputs), key=lambda each: (rank[self.entry(each)], each.input)))

    def entry(self, member: Member) -> str:
        """The name of the file's entry to which it belongs."""
        return self._entry[member.name] if member.input else member.name

    def bodies(self, member: Member) -> frozenset[str]:
        """The links whose places it relates."""
        group = (self.setup.named[member.name],) if member.input else self.pairs[member]
        return frozenset(link for pair in group for link in pair.bodies)

    def moved(self, members: Iterable[Member]) -> frozenset[str]:
        """The moving links that they relate."""
        return frozenset(link for each in members for link in self.bodies(each)) - {self.setup.mechanism.frame}

    def agree(self, members: Iterable[Member]) -> bool:
        """Whether positions were found that meet all of these."""
        together = frozenset(members)
        if any(each <= together for each in self._unmet):
            return False
        return all(self._agree(part) for part in self._parts(together))

    def meet(self, members: Iterable[Member]) -> None:
        """Take note that these were met by other means."""
        met = frozenset(members)
        self._met.append(met)
        self._unmet = [each for each in self._unmet if not each <= met]

    def part(self, members: Iterable[Member]) -> None:
        """Take note that these do not agree."""
        self._unmet.append(frozenset(members))

    def _parts(self, members: Iterable[Member]) -> list[frozenset[Member]]:
        """Those that share moving links, set by set: each set is met by itself."""
        parts: list[tuple[set[Member], set[str]]] = []
        for member in members:
            held, links = {member}, set(self.moved((member,)))
            for other in [part for part in parts if not part[1].isdisjoint(links)]:
                parts.remove(other)
                held |= other[0]
                links |= other[1]
            parts.append((held, links))
        return sorted((frozenset(held) for held, _ in parts), key=len)

    def _agree(self, members: frozenset[Member]) -> bool:
        if any(members <= each for each in self._met):
            return True
        part = _Part(self, members)
        met = any(part.met(starts) for starts in self._starts(len(part.columns)))
        (self._met if met else self._unmet).append(members)
        return met

    def _starts(self, columns: int) -> Iterator[Array]:
        """Places of all links (starts, coordinates), about the sketch and anywhere."""
        rng = np.random.default_rng(0)
        starts = rng.uniform(-1.0, 1.0, (sum(BATCHES), len(self.setup.equations.coordinates)))
        starts[:, ~self.setup.outline.lengths] *= np.pi
        starts[:SKETCHED] = [sketched(self.setup, seed) for seed in range(SKETCHED)]
        for many in BATCHES if columns <= LARGE else BATCHES[:-1]:
            yield starts[:many]
            starts = starts[many:]


class _Part:
    """Some of the pairs and inputs, in the coordinates of their own links."""

    def __init__(self, joining: Joining, members: frozenset[Member]):
        setup = joining.setup
        pairs: list[Pair] = [pair for member in members if not member.input for pair in joining.pairs[member]]
        driven = [member for member in members if member.input]
        self.constraints = Constraints(setup, pairs)
        self.drives = tuple(member.name for member in driven)
        self.at = np.array([joining.inputs[member] for member in driven])[:, None]
        self.turning = np.array([setup.named[name].drive_kind is Kind.ANGLE for name in self.drives], dtype=bool)
        owners = {(link, True) for member in members for link in joining.bodies(member)}
        owners |= {(pair.name, False) for pair in pairs}
        coordinates = setup.equations.coordinates
        self.columns = np.array([k for k, c in enumerate(coordinates) if (c.owner, c.of_link) in owners], dtype=int)
        self.lengths = setup.outline.lengths[self.columns]
        self.many = len(coordinates)

    def met(self, starts: Array) -> bool:
        """Whether one of the starts (starts, coordinates) leads to a position that meets them."""
        own = starts[:, self.columns]
        left, slope = self.closing(own)
        # lengths enter linearly where bodies are turned as they are
        own[:, self.lengths] -= np.einsum("krm,km->kr", np.linalg.pinv(slope[:, :, self.lengths]), left)
        return bool(newton(self.closing, own).closed.any())

    def closing(self, own: Array) -> tuple[Array, Array]:
        """What own coordinates (starts, columns) leave open (starts, rows), and its slope (starts, rows, columns)."""
        starts, columns = own.shape
        nudged = np.repeat(own.astype(complex), columns, axis=0) + np.tile(1j * STEP * np.eye(columns), (starts, 1))
        slope = np.imag(self._left(nudged)) / STEP
        return self._left(own).T, slope.reshape(len(slope), starts, columns).transpose(1, 0, 2)

    def _left(self, own: Array) -> Array:
        """(rows, many) at coordinates (many, columns)."""
        w = np.zeros((self.many, len(own)), dtype=own.dtype)
        w[self.columns] = own.T
        gaps = self.constraints.gaps(w)
        if not self.drives:
            return gaps
        drives = self.constraints.drives(self.drives, w) - self.at
        if not np.iscomplexobj(drives):
            drives[self.turning] = np.arctan2(np.sin(drives[self.turning]), np.cos(drives[self.turning]))
        return np.concatenate([gaps, drives])
