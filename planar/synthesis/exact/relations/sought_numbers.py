"""Which of a task's free numbers are sought: those that change nothing alone are refused, and those that change nothing
beside others are given.

A function of angles is the same wherever its linkage stands, however it is turned, and whatever its size. Fixed pins
and lines are given, then, as far as other numbers that are free bring about all that they would.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.document.dimensions import file_dimensions
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, PlanarError
from planar.model.mechanism import Mechanism
from planar.synthesis.task.freedom import number_slopes
from planar.synthesis.task.starts import FreeNumbers
from planar.synthesis.task.synthesis_task import SynthesisTask, WantedFunction

NO_INFLUENCE = 1e-10
"""Of the greatest slope: a number with less changes nothing."""
DEPENDENT = 1e-8
"""Of a column: what other columns leave of it is nothing."""


def sought_numbers(task: SynthesisTask, mechanism: Mechanism, free: FreeNumbers) -> tuple[str, ...]:
    """The names of the numbers that are sought. Raises BadInput for one that is named and changes nothing wanted."""
    is_function = isinstance(task.wanted[0], WantedFunction)
    standing = [name for name in free.names if name in _frame_numbers(mechanism)] if is_function else []
    if not task.free:
        return tuple(name for name in free.names if name not in standing)
    try:
        slopes = number_slopes(task, mechanism, free)
    except PlanarError:  # where the start does not move its slopes are not known
        return tuple(name for name in free.names if name not in standing)
    sizes = np.linalg.norm(slopes, axis=0)
    columns = slopes / np.where(sizes > 0.0, sizes, 1.0)
    zeros = _basis(columns[:, len(free.names) :])
    for k, name in enumerate(free.names):
        rest = columns[:, k] - zeros @ (zeros.T @ columns[:, k])
        if sizes[k] <= NO_INFLUENCE * sizes.max() or np.linalg.norm(rest) <= DEPENDENT:
            raise BadInput(
                "$.free", f"nothing that is wanted depends on {name!r} of {mechanism.name!r} alone; leave it out"
            )
    return _independent(free.names, columns, standing)


def _frame_numbers(mechanism: Mechanism) -> frozenset[str]:
    """The coordinates of fixed pins, and the angles of fixed lines."""
    frame = mechanism.frame
    pins = {point for pair in mechanism.pairs for link, point in pair.coincident_points() if link == frame}
    lines = {pair.name for pair in mechanism.pairs if pair.coordinate_kinds and pair.bodies[0] == frame}
    return frozenset(
        each.name
        for each in file_dimensions(mechanism).values()
        if (each.link == frame and {*each.path} & pins)
        or (each.path[0] == "pairs" and {*each.name.split(".")} & lines and each.path[-2:] == ("line", "angle"))
    )


def _independent(names: tuple[str, ...], columns: Array, last: Sequence[str]) -> tuple[str, ...]:
    """The names of numbers, without those of the last that the columns before them make up; columns more, which have
    no names, are before all."""
    is_last = np.array([*(name in last for name in names), *[False] * (columns.shape[1] - len(names))])
    basis, given = _basis(columns[:, ~is_last]), set[str]()
    for k in np.flatnonzero(is_last).tolist():
        rest = columns[:, k] - basis @ (basis.T @ columns[:, k])
        size = np.linalg.norm(rest)
        if size > DEPENDENT:
            basis = np.column_stack([basis, rest / size])
        else:
            given.add(names[k])
    return tuple(name for name in names if name not in given)


def _basis(columns: Array) -> Array:
    """Orthonormal columns that span the same."""
    u, values, _ = np.linalg.svd(columns, full_matrices=False)
    found: Array = u[:, values > DEPENDENT * values.max(initial=0.0)]
    return found
