"""Whether some of a mechanism's pairs and inputs can be satisfied together, the others left out."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array
from planar.model.mechanism import pair_entries
from planar.model.pairs import MeasureKind, Pair
from planar.solving.full_constraints import FullConstraints, sketch_coordinates
from planar.solving.newton import damped_newton
from planar.solving.prepared_mechanism import PreparedMechanism

START_BATCHES = (1, 3, 28)
"""Starts, one batch after the other; what can be met is mostly met from the first."""
MANY_COORDINATES = 18
"""Coordinates of links: more are not tried with the last batch, which takes long."""
SKETCH_STARTS = 4
"""Starts that are about the sketch."""


class Requirement(NamedTuple):
    """A pair as the file has it, with all the links of its pin, or the input at a pair."""

    name: str
    is_input: bool = False


class JointFeasibility:
    """The pairs and inputs of one mechanism, of which any may be left out.

    What can be met is proved by a position that meets it to round-off; that something cannot rests on starts.
    """

    def __init__(self, setup: PreparedMechanism):
        self.setup = setup
        self.pairs = {Requirement(group[0].entry_name()): group for group in pair_entries(setup.mechanism)}
        self.inputs = {
            Requirement(given.pair, True): float(at)
            for given, at in zip(setup.mechanism.inputs, setup.inputs.u, strict=True)
        }
        self._feasible: list[frozenset[Requirement]] = []
        self._infeasible: list[frozenset[Requirement]] = []
        self._entry = {
            named.name: member.name
            for member, group in self.pairs.items()
            for named in type(group[0]).relative_motions(group)
        }

    @property
    def requirements(self) -> tuple[Requirement, ...]:
        """All pairs and inputs in the order of the file, an input after its pair."""
        rank = {member.name: index for index, member in enumerate(self.pairs)}
        return tuple(sorted((*self.pairs, *self.inputs), key=lambda each: (rank[self.entry(each)], each.is_input)))

    def entry(self, member: Requirement) -> str:
        """The name of the file's entry to which it belongs."""
        return self._entry[member.name] if member.is_input else member.name

    def bodies(self, member: Requirement) -> frozenset[str]:
        """The links whose places it relates."""
        group = (self.setup.relative_motions[member.name],) if member.is_input else self.pairs[member]
        return frozenset(link for pair in group for link in pair.bodies)

    def moving_links(self, members: Iterable[Requirement]) -> frozenset[str]:
        """The moving links that they relate."""
        return frozenset(link for each in members for link in self.bodies(each)) - {self.setup.mechanism.frame}

    def is_feasible(self, members: Iterable[Requirement]) -> bool:
        """Whether positions were found that meet all of these."""
        together = frozenset(members)
        if any(each <= together for each in self._infeasible):
            return False
        return all(self._is_set_feasible(part) for part in self._independent_sets(together))

    def mark_feasible(self, members: Iterable[Requirement]) -> None:
        """Take note that these were met by other means."""
        met = frozenset(members)
        self._feasible.append(met)
        self._infeasible = [each for each in self._infeasible if not each <= met]

    def mark_infeasible(self, members: Iterable[Requirement]) -> None:
        """Take note that these do not agree."""
        self._infeasible.append(frozenset(members))

    def _independent_sets(self, members: Iterable[Requirement]) -> list[frozenset[Requirement]]:
        """Those that share moving links, set by set: each set is met by itself."""
        parts: list[tuple[set[Requirement], set[str]]] = []
        for member in members:
            held, links = {member}, set(self.moving_links((member,)))
            for other in [part for part in parts if not part[1].isdisjoint(links)]:
                parts.remove(other)
                held |= other[0]
                links |= other[1]
            parts.append((held, links))
        return sorted((frozenset(held) for held, _ in parts), key=len)

    def _is_set_feasible(self, members: frozenset[Requirement]) -> bool:
        if any(members <= each for each in self._feasible):
            return True
        part = _PartialConstraints(self, members)
        met = any(part.can_be_met(starts) for starts in self._starts(len(part.columns)))
        (self._feasible if met else self._infeasible).append(members)
        return met

    def _starts(self, columns: int) -> Iterator[Array]:
        """Places of all links (starts, coordinates), about the sketch and anywhere."""
        rng = np.random.default_rng(0)
        starts = rng.uniform(-1.0, 1.0, (sum(START_BATCHES), len(self.setup.equations.coordinates)))
        starts[:, ~self.setup.structure.is_length] *= np.pi
        starts[:SKETCH_STARTS] = [sketch_coordinates(self.setup, seed) for seed in range(SKETCH_STARTS)]
        for many in START_BATCHES if columns <= MANY_COORDINATES else START_BATCHES[:-1]:
            yield starts[:many]
            starts = starts[many:]


class _PartialConstraints:
    """Some of the pairs and inputs, in the coordinates of their own links."""

    def __init__(self, joining: JointFeasibility, members: frozenset[Requirement]):
        setup = joining.setup
        pairs: list[Pair] = [pair for member in members if not member.is_input for pair in joining.pairs[member]]
        driven = [member for member in members if member.is_input]
        self.constraints = FullConstraints(setup, pairs)
        self.drives = tuple(member.name for member in driven)
        self.drive_positions = np.array([joining.inputs[member] for member in driven])
        self.is_angle = np.array(
            [setup.relative_motions[name].input_kind is MeasureKind.ANGLE for name in self.drives], dtype=bool
        )
        owners = {(link, True) for member in members for link in joining.bodies(member)}
        owners |= {(pair.name, False) for pair in pairs}
        coordinates = setup.equations.coordinates
        self.columns = np.array([k for k, c in enumerate(coordinates) if (c.owner, c.of_link) in owners], dtype=int)
        self.is_length = setup.structure.is_length[self.columns]
        self.coordinate_count = len(coordinates)

    def can_be_met(self, starts: Array) -> bool:
        """Whether one of the starts (starts, coordinates) leads to a position that meets them."""
        own = starts[:, self.columns]
        left, slope = self.residuals_and_jacobian(own)
        # lengths enter linearly where bodies are turned as they are
        own[:, self.is_length] -= np.einsum("krm,km->kr", np.linalg.pinv(slope[:, :, self.is_length]), left)
        return bool(damped_newton(self.residuals_and_jacobian, own).converged.any())

    def residuals_and_jacobian(self, own: Array) -> tuple[Array, Array]:
        """What own coordinates (starts, columns) leave open (starts, rows), and its slope (starts, rows, columns)."""
        w: Array = np.zeros((len(own), self.coordinate_count))
        w[:, self.columns] = own
        residuals, jacobian = self.constraints.residuals_and_jacobian(w, self.drives, self.drive_positions)
        angles = np.flatnonzero(self.is_angle) + residuals.shape[1] - len(self.drives)
        residuals[:, angles] = wrap_angle(residuals[:, angles])
        return residuals, jacobian[..., self.columns]
