"""A catalogue: designs of one structure at random with their motion, kept on disk once it is made."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass

import numpy as np

from planar.document.writer import write_mechanism
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.model.mechanism import Mechanism
from planar.synthesis.catalogue.branch_tracking import follow_branches
from planar.synthesis.catalogue.design_samples import draw_designs
from planar.synthesis.fitting.wanted_equations import WantedEquations
from planar.synthesis.task.starts import FreeNumbers

LEAST_STEPS = 8
"""Positions that a design's branch has at least, to be of use."""


@dataclass(frozen=True)
class Catalogue:
    """Designs (designs, ...): scaled free numbers, and along each one's branch its unknowns and results."""

    numbers: Array
    "(designs, free)"
    unknowns: Array
    "(designs, steps, unknowns), NaN beyond the ends of a branch"
    values: tuple[Array, ...]
    "of each wanted item (designs, steps, parts), in units of its scales"
    is_whole: BoolArray
    "(designs,)"

    def __len__(self) -> int:
        """How many designs there are."""
        return len(self.numbers)

    def take(self, designs: IntArray) -> Catalogue:
        """Those designs (n,) of it."""
        values = tuple(each[designs] for each in self.values)
        return Catalogue(self.numbers[designs], self.unknowns[designs], values, self.is_whole[designs])


def build_catalogue(equations: tuple[WantedEquations, ...], free: FreeNumbers, count: int, seed: int = 0) -> Catalogue:
    """A catalogue from so many draws, the same for the same seed."""
    first = equations[0]
    x, y = draw_designs(first, free, count, np.random.default_rng([seed, count]))
    unknowns, is_whole = follow_branches(first, x, y)
    steps = np.isfinite(unknowns[..., 0] if unknowns.shape[2] else unknowns[..., -1]).sum(axis=1)
    kept = steps >= LEAST_STEPS
    x, unknowns, is_whole = x[kept], unknowns[kept], is_whole[kept]
    told = tuple(each.values(x, unknowns) for each in equations)
    return Catalogue(x, unknowns, told, is_whole)


def catalogue_key(
    start: Mechanism, equations: tuple[WantedEquations, ...], free: FreeNumbers, count: int, seed: int
) -> str:
    """What tells one catalogue from another: the file, what is wanted of it, free numbers, bounds, count and seed."""
    told = [
        write_mechanism(start),
        [str(each.rows.wanted.of) for each in equations],
        [*free.names],
        [*map(repr, (*free.lower, *free.upper))],
        count,
        seed,
    ]
    return hashlib.sha256(json.dumps(told, sort_keys=True, default=str).encode()).hexdigest()
