"""The rows that a task's wanted items make, in units in which a miss of one counts alike."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array
from planar.synthesis.fitting.wanted_equations import WantedRows
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction, WantedPath


def wanted_size(task: SynthesisTask, mechanism_size: float) -> float:
    """The extent (m) of all places that are wanted; that of the mechanism where there are none, or but one."""
    places = [each.places for each in task.wanted if not isinstance(each, WantedFunction)]
    extent = float(np.ptp(np.concatenate(places), axis=0).max()) if places else 0.0
    return extent or mechanism_size


def wanted_rows(task: SynthesisTask, size: float) -> list[WantedRows]:
    """Of each wanted item its rows: places in units of the size, angles in rad, lengths of functions in the size."""
    heavier = EXACT_WEIGHT if 0 < len(task.exact) < len(task.wanted) else 1.0
    return [_rows(each, size, heavier if each.tolerance == 0.0 else 1.0) for each in task.wanted]


EXACT_WEIGHT = 30.0
"""Of a miss of what is to be met exactly beside others, before a fit's last steps meet it."""


def _rows(wanted: Wanted, size: float, heavier: float) -> WantedRows:
    weights = heavier * np.sqrt(wanted.weights)
    if isinstance(wanted, WantedFunction):
        scale = np.ones(1)
        is_free = not wanted.is_absolute
        return WantedRows(wanted, wanted.values[:, None], wanted.inputs, weights, scale, is_free, is_free)
    is_free = wanted.inputs is not None and not wanted.is_absolute
    if isinstance(wanted, WantedPath):
        return WantedRows(wanted, wanted.places, wanted.inputs, weights, np.full(2, size), is_free, False)
    values: Array = np.concatenate([wanted.places, wanted.angles[:, None]], axis=1)
    return WantedRows(wanted, values, wanted.inputs, weights, np.array([size, size, 1.0]), is_free, False)
