"""New exact members from known ones: parts of a design that vary independently of each other are exchanged.

The members near one of them differ by the null space of the Jacobian of all rows. Where the orthogonal projector onto
it is block diagonal, each block of unknowns varies without the others, as two dyads do that carry a link through poses.
"""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array, IntArray
from planar.synthesis.families.exact_members import ExactMembers, MemberSampler

RANK_TOLERANCE, TIED = 1e-9, 1e-8
"""Of the greatest singular value, what counts as zero; and of the projector's entries."""
RECOMBINED_RESIDUAL = 1e-9
"""Greatest residual of a member that was put together."""


def null_space(sampler: MemberSampler, member: ExactMembers) -> Array:
    """The directions (columns, dimension) in which one member (1, ...) may change and stay exact."""
    columns = member.columns.shape[1]
    rows = []
    first = sampler.globals.free
    start = first + sum(zero.shape[1] for zero in member.zeros)
    for equations, y, zero in zip(sampler.equations, member.unknowns, member.zeros, strict=True):
        slopes = equations.slopes_at(member.numbers, y)
        size = y.shape[2]
        for entry in range(y.shape[1]):
            stop = start + size
            for by_unknowns, by_numbers, is_result in slopes:
                block = np.zeros((by_unknowns.shape[2], columns))
                block[:, : sampler.globals.free] = by_numbers[0, entry]
                block[:, start:stop] = by_unknowns[0, entry]
                if is_result and equations.rows.value_is_free:
                    block[:, first + zero.shape[1] - 1] = -1.0
                rows.append(block)
            if equations.is_timed:
                block = np.zeros((1, columns))
                block[0, stop - 1] = 1.0
                if equations.rows.input_is_free:
                    block[0, first] = -1.0
                rows.append(block)
            start = stop
        first += zero.shape[1]
    _, singular, vectors = np.linalg.svd(np.concatenate(rows))
    rank = int((singular > RANK_TOLERANCE * singular.max(initial=0.0)).sum())
    directions: Array = vectors[rank:].T
    return directions


def independent_parts(directions: Array) -> list[IntArray]:
    """The columns that vary with each other, in parts that vary independently."""
    projector = directions @ directions.T
    moving = np.flatnonzero(np.diag(projector) > TIED)
    is_tied = np.abs(projector[np.ix_(moving, moving)]) > TIED
    labels = np.arange(len(moving))
    for _ in moving:  # the least label goes from column to column
        labels = np.where(is_tied, labels, len(moving)).min(axis=1, initial=len(moving))
    return [moving[labels == label] for label in np.unique(labels)]


def recombine(sampler: MemberSampler, members: ExactMembers, parts: list[IntArray], count: int) -> ExactMembers:
    """So many members, less those that do not fit together, each part from another member."""
    columns = members.columns
    chosen = sampler.random.integers(len(columns), size=(len(parts), count))
    mixed = columns[chosen[0]]
    for part, rows in zip(parts[1:], chosen[1:], strict=True):
        mixed[:, part] = columns[rows][:, part]
    combined = members.with_columns(mixed)
    return combined.take(sampler.residuals(combined) < RECOMBINED_RESIDUAL)
