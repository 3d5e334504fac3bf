"""Designs whose assembly is clearly the one of the base: found by a backend from there, all groups at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.march.backend import Closed, Closing, March, NotMarched
from planar.batch.reference_design import Base, spread
from planar.equations.constraint_equations import Stage
from planar.equations.functions import length
from planar.model.link_shapes import Shape
from planar.solving.assembly.block_assemblies import CLEAR, SAME, Candidates
from planar.solving.assembly.nearest_assembly import ALIKE

Array = np.ndarray

CORRECTIONS = 6
"""Newton's steps from the assembly of the base."""
REGULAR = 0.2
"""The volume that the columns of a slope span, each of length one, from which on no other assembly is near."""
NEAR = 0.15
"""Lengths of the size, on average, from the sketch: a large group that lies farther off may have another assembly that
is
nearer, of which no start tells."""
MOST = 4
"""Unknowns of the largest group whose regularity a backend tells as that volume."""


class Nearby(NamedTuple):
    """z (unknowns, designs), and which of the designs are clearly meant to be assembled so (designs,)."""

    z: Array
    clear: Array


def nearby(
    base: Base, shapes: Mapping[str, Shape], p: Array, u: Array, tolerance: float, close: Closing
) -> Nearby | None:
    """The assemblies at inputs u (inputs, designs); None where the sketch does not show every group, or `close` cannot.

    Costs never fall: where the nearest assembly is taken of every group, and each group's next one alone would cost
    more than all these, there is no nearer one of the whole. A group in closed form has two assemblies; any other as
    many as
    the base has, if they are found again, or it lies where it does at the sketch, and so regular that no other is near.
    """
    candidates = base.candidates
    stages = [stage for stage in base.program.equations.stages if length(stage.unknowns)]
    at = {stage.level: candidates.sketched_at.get(stage.level, ()) for stage in stages}
    if candidates.counts or any(length(stage.unknowns) > MOST or not at[stage.level] for stage in stages):
        return None
    try:
        return _Near(base, shapes, p, u, tolerance, close, candidates, stages).found()
    except NotMarched:
        return None


class _Near:
    def __init__(
        self,
        base: Base,
        shapes: Mapping[str, Shape],
        p: Array,
        u: Array,
        tolerance: float,
        close: Closing,
        candidates: Candidates,
        stages: list[Stage],
    ):
        self.many, self.close, self.stages = p.shape[1], close, stages
        at = candidates.sketched_at
        self.roots = {
            stage.level: each for stage, each in zip(base.program.equations.stages, base.roots(), strict=True)
        }
        self.names = [name for stage in stages for name in at[stage.level]]
        self.levels = tuple(stage.level for stage in stages for _ in at[stage.level])
        self.sketch = np.array([candidates.sketch[name] for name in self.names]).reshape(-1, 2, 1)
        members = [candidates.first[name][1:] for name in self.names]
        q = spread([part for link, point in members for part in shapes[link].at(point)], self.many) / base.unit
        links = tuple(link for link, _ in members)
        start = np.concatenate([np.zeros(0), *(roots[0] for roots, _ in self.roots.values() if len(roots))])
        self.march = March(
            base.program,
            base.mechanism,
            p,
            q,
            np.repeat(start[:, None], self.many, axis=1),
            np.zeros((1, len(u))),
            u,
            u,
            u,
            links,
            False,
            tolerance,
            base.unit,
        )

    def found(self) -> Nearby:
        """See `nearby`."""
        found = self.close(self.march, self.levels, CORRECTIONS)
        costs, others = (np.square(places - self.sketch).sum(axis=1) for places in (found.points, found.others))
        clear, total, before = found.closed.copy(), costs.sum(axis=0), np.zeros(self.many)
        for stage in self.stages:
            own = np.array(self.levels) == stage.level
            cost, other = costs[own].sum(axis=0), others[own].sum(axis=0)
            if np.all(np.isinf(other)):
                clear &= (cost <= np.count_nonzero(own) * NEAR**2) & (found.regular > REGULAR)
                near = cost <= np.count_nonzero(own) * CLEAR**2
                clear &= near if near.all() else near | (before + self._next(stage, found, own) > total + ALIKE)
            else:
                clear &= before + other > total + ALIKE
            before += cost
        return Nearby(found.z, clear)

    def _next(self, stage: Stage, found: Closed, own: Array) -> Array:
        """The least cost of a group's other assemblies (designs,); nothing where not as many are found as it has."""
        roots, most = self.roots[stage.level]
        least, known = np.full(self.many, np.inf), [found.z[stage.unknowns]]
        count = np.ones(self.many, dtype=int)
        for root in roots[1:]:
            self.march.z0[stage.unknowns] = root[:, None]
            other = self.close(self.march, self.levels, CORRECTIONS)
            z = other.z[stage.unknowns]
            apart = [~(np.max(np.abs(np.exp(1j * z) - np.exp(1j * each)), axis=0) <= SAME) for each in known]
            new = other.closed & np.all(apart, axis=0)
            cost = np.square(other.points - self.sketch)[own].sum(axis=(0, 1))
            least = np.where(new, np.minimum(least, cost), least)
            count += new
            known.append(np.where(new, z, np.nan))
        self.march.z0[stage.unknowns] = roots[0][:, None]
        return np.where(count == most, least, -np.inf)
