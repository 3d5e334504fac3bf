"""How pairs that yield share what they carry where links are held more than once: by least work.

Of all forces that balance the links those are real whose complementary energy, less the work on the misfits that the
pairs are forced to close, is least: L. F. Menabrea, Nouveau principe sur la distribution des tensions dans les
systemes elastiques, C. R. Acad. Sci. 46, 1858; A. Castigliano 1879; with misfits F. Engesser 1889. A pair yields by its
force over its stiffness, and turns by its couple over its stiffness times the square of the mechanism's size.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

import numpy as np

from planar.dynamics.virtual_work import VirtualWorkBalance
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame
from planar.foundation.jets import value_and_rates
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism
from planar.model.pairs import Pair

MISFIT_RATIO = 10.0
"""A force that links held more than once may change by no more than this many times the misfit beside the size is
told: rounded lengths alone let it change."""


class Wrench(NamedTuple):
    """Forces (..., 2) and their moments about the origin of the world (...)."""

    force: Array
    moment: Array

    def __repr__(self) -> str:
        return short_repr(self)

    def moment_about(self, at: Array) -> Array:
        """The moment about places (..., 2)."""
        return self.moment - at[..., 0] * self.force[..., 1] + at[..., 1] * self.force[..., 0]


class PairForces(Protocol):
    """What is asked of a solver of reactions."""

    mechanism: Mechanism
    pairs: dict[str, Pair]
    pair_rows: dict[str, slice]
    balance: VirtualWorkBalance
    column_scale: Array
    arm: float
    position_count: int

    def pair_wrenches(self, pair: Pair, forces: Array) -> Mapping[str, Wrench]:
        """What a pair does to each of its bodies (n, ways) by forces of its own (n, rows, ways)."""

    def reaction_point(self, pair: Pair) -> Array | None:
        """Where a pair's force is told (n, 2)."""


def share_by_least_work(reactions: PairForces, forces: Array, ways: Array) -> tuple[Array, Array]:
    """Forces (n, forces, 1) of least work, and how they may still be otherwise (n, forces, ways).

    Forces and ways are those of `ReactionSolver`. Without a given stiffness all pairs are taken as equally stiff: what
    then hardly changes with the ways is told, and the ways of the rest stay.
    """
    mechanism = reactions.mechanism
    stiffness = dict(mechanism.pair_stiffness)
    if not ways.shape[2] or not (stiffness or mechanism.closes_within):
        return forces, ways
    compliance = {name: stiffness.get(pair.entry_name(), 1.0) ** -0.5 for name, pair in reactions.pairs.items()}
    forced = _forced_by_misfits(reactions, stiffness) if stiffness and mechanism.closes_within else 0.0
    strain, changes = (_strains(reactions, each, compliance) for each in (forces - forced, ways))
    part = np.linalg.pinv(changes) @ strain
    shared = forces - ways @ part
    if stiffness:
        return shared, np.zeros((*ways.shape[:2], 0))
    least = MISFIT_RATIO * (mechanism.closes_within or 0.0) / reactions.arm
    kept = np.where(np.abs(ways) <= least, 0.0, ways)
    return shared, kept


def _strains(reactions: PairForces, forces: Array, compliance: Mapping[str, float]) -> Array:
    """Forces (n, forces, ways) as the roots of twice the energies that they put into the pairs (n, strains, ways)."""
    found = []
    for name, pair in reactions.pairs.items():
        wrench = reactions.pair_wrenches(pair, forces[:, reactions.pair_rows[name]])[pair.links[1]]
        at = reactions.reaction_point(pair)
        couple = wrench.moment if at is None else wrench.moment_about(at[:, None])
        parts = [wrench.force[..., 0], wrench.force[..., 1], couple / reactions.arm]
        found += [compliance[name] * each for each in parts]
    return np.stack(found, axis=1)


def _forced_by_misfits(reactions: PairForces, stiffness: Mapping[str, float]) -> Array:
    """The forces (n, forces, 1) with which pairs of a given stiffness resist their misfits."""
    found = np.zeros((*reactions.column_scale.shape, 1))
    for name, pair in reactions.pairs.items():
        rows = reactions.pair_rows[name]
        own = -stiffness[pair.entry_name()] * reactions.balance.openings[:, rows]
        found[:, rows, 0] = own * reactions.column_scale[:, rows]
    return found


def yielding_power(wrenches: Mapping[str, Mapping[str, Wrench]], frames: Mapping[str, Frame]) -> Array:
    """The power (n,) that pairs put into the links where their misfits change: what they take up is minus that."""
    total = np.zeros(1)
    for of in wrenches.values():
        for link, wrench in of.items():
            x, y, angle = (value_and_rates(each) for each in (frames[link].x, frames[link].y, frames[link].angle))
            turning = np.asarray(angle[1])
            across, up = x[1] + turning * y[0], y[1] - turning * x[0]
            total = total + wrench.force[..., 0] * across + wrench.force[..., 1] * up + wrench.moment * turning
    return total
