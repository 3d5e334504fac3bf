"""The other linkages of a real solution's class, followed beside it."""

from __future__ import annotations

import numpy as np

from planar.assemblies.polynomial.certification import is_available
from planar.assemblies.polynomial.path_tracker import PathEnds
from planar.foundation.arrays import BoolArray, ComplexArray
from planar.synthesis.exact.relations.exact_problem import Component
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.exact_certificates import certify_member
from planar.synthesis.exact.tracking.generic_store import FamilyRecord
from planar.synthesis.exact.tracking.member_homotopy import affine_solutions, homogeneous_solutions
from planar.synthesis.exact.tracking.monodromy import first_of_same, follow
from planar.synthesis.exact.tracking.symmetry import exchange_images, representatives

PRECISION, CLOSER = 1e-5, 1e-7
"""How far predictions may be off, and where paths are lost so."""


def class_members(
    component: Component, record: FamilyRecord, real: ComplexArray, sure: BoolArray
) -> tuple[ComplexArray, BoolArray]:
    """Real solutions with those of their classes; what moves alike is as real, and as sure, as the one.

    Which class a solution is of is seen where its path began."""
    images = exchange_images(record.name.exchanges)
    known = record.solutions
    ends = _follow_closely(component.family, component.member, homogeneous_solutions(real), known.member)
    both = np.concatenate([representatives(known.V, images), representatives(ends.V, images)])
    own = first_of_same(both)[len(known.V) :]
    seen = np.flatnonzero(ends.is_single & (own < len(known.V)))
    members = record.classes.shape[1]
    class_of = np.empty(len(known.V), dtype=int)
    class_of[record.classes] = np.arange(len(record.classes))[:, None]
    others = [[k for k in record.classes[class_of[one]] if k != one] for one in own[seen].tolist()]
    rows = np.array(others, dtype=int).reshape(-1)
    gone = _follow_closely(component.family, known.member, known.V[rows], component.member)
    proofs = np.repeat(sure[seen], members - 1)
    gone = _with_proved(component, gone)
    every = np.concatenate([homogeneous_solutions(real), representatives(gone.V[gone.is_single], images)])
    both_proofs = np.concatenate([sure, proofs[gone.is_single]])
    first = first_of_same(np.concatenate([representatives(every[: len(real)], images), every[len(real) :]]))
    kept = first == np.arange(len(every))
    return affine_solutions(every[kept]), both_proofs[kept]


def _follow_closely(family: Family, begin: Member, V: ComplexArray, end: Member) -> PathEnds:
    ends = follow(family, begin, V, end, PRECISION)
    lost = ~ends.is_single
    if lost.any():
        again = follow(family, begin, V[lost], end, CLOSER)
        for whole, part in zip(ends, again, strict=True):
            whole[lost] = part
    return ends


def _with_proved(component: Component, ends: PathEnds) -> PathEnds:
    """Ends, those that only look singular put in by what balls of more digits prove of them."""
    open_ = np.flatnonzero(ends.is_near_end & ~ends.is_single)
    if not len(open_) or not is_available():
        return ends
    proof = certify_member(component.family, component.member, affine_solutions(ends.V[open_]))
    V, regularity, has_converged = ends.V.copy(), ends.regularity.copy(), ends.has_converged.copy()
    own = open_[proof.proved]
    V[own] = homogeneous_solutions(proof.x[proof.proved])
    regularity[own], has_converged[own] = 1.0, True
    return PathEnds(V, regularity, has_converged, ends.is_near_end)
