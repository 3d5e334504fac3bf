"""The other linkages of a real solution's class, followed beside it."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import BoolArray, ComplexArray
from planar.synthesis.exact.relations.exact_problem import Component
from planar.synthesis.exact.tracking.generic_store import FamilyRecord
from planar.synthesis.exact.tracking.member_homotopy import affine_solutions, homogeneous_solutions
from planar.synthesis.exact.tracking.monodromy import first_of_same, follow
from planar.synthesis.exact.tracking.symmetry import exchange_images, representatives

PRECISION = 1e-5


def class_members(
    component: Component, record: FamilyRecord, real: ComplexArray, sure: BoolArray
) -> tuple[ComplexArray, BoolArray]:
    """Real solutions with those of their classes; what moves alike is as real, and as sure, as the one.

    Which class a solution is of is seen where its path began."""
    images = exchange_images(record.name.exchanges)
    known = record.representatives
    ends = follow(component.family, component.member, homogeneous_solutions(real), known.member, PRECISION)
    both = np.concatenate([representatives(known.V, images), representatives(ends.V, images)])
    own = first_of_same(both)[len(known.V) :]
    seen = ends.is_single & (own < len(known.V))
    others = record.classes[own[seen], 1:]
    V = record.solutions.V[others.ravel()]
    gone = follow(component.family, known.member, V, component.member, PRECISION)
    proofs = np.repeat(sure[seen], others.shape[1])
    return (
        np.concatenate([real, affine_solutions(gone.V[gone.is_single])]),
        np.concatenate([sure, proofs[gone.is_single]]),
    )
