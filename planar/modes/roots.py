"""All assemblies of one group of links, those before it given: for now by a search from many starts."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

import numpy as np

from planar.equations import Stage
from planar.program import length
from planar.solving.candidates import Candidates
from planar.solving.newton import newton
from planar.solving.setup import Setup

Array = np.ndarray

STARTS = 40


class Completeness(StrEnum):
    """How far a list of assemblies is known to be all of them."""

    PROVED = "complete"
    NUMERICALLY = "numerically complete"
    NOT = "not known to be complete"


class Roots(NamedTuple):
    """All assemblies of one group of links, those before it given."""

    real: Array
    "(roots, unknowns): of the group as in z[stage.unknowns] (rad, sizes), sorted: angles in (-pi, pi]"
    double: Array
    "(roots,) bool: two that meet: a dead point"
    certified: Array
    "(roots,) bool"
    expected: int | None
    "complex solutions by the bound that is exact for the structure; None where no bound is known"
    found: int
    "complex solutions found (at finite places, with multiplicity)"
    complete: Completeness
    curve: bool
    "a whole curve of assemblies there"
    said: str
    "how it was solved, one sentence"


def roots(setup: Setup, stage: Stage, z: Array, certify: bool = True) -> Roots:  # noqa: ARG001
    """See `Roots`."""
    candidates, many = Candidates(setup), length(stage.unknowns)
    closing = candidates.closing(stage, z, setup.station.p)
    starts = np.random.default_rng(0).uniform(-np.pi, np.pi, (STARTS * many, many))
    ended = newton(closing, candidates._with_lengths(stage, closing, starts))
    closed = ended.unknowns[ended.closed]
    angles = candidates._is_angle(stage)
    closed = np.where(angles, np.arctan2(np.sin(closed), np.cos(closed)), closed)
    found = candidates._candidates(stage, z, closing, closed)
    real = np.array([each.z[stage.unknowns] for each in found]).reshape(-1, many)
    real = real[np.lexsort(np.round(real, 9).T[::-1])] if len(real) else real
    none = np.zeros(len(real), dtype=bool)
    return Roots(real, none, none, None, len(real), Completeness.NOT, False, "searched from many starts")
