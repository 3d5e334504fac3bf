"""Inputs that hold a mechanism, which has too few, at rest in the position in which it is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import pi, remainder

import numpy as np

from planar.foundation.arrays import Array
from planar.model.mechanism import Input, Mechanism
from planar.model.wording import quote_names
from planar.solving.checks.singular_values import null_space
from planar.solving.diagnosis.refusals import free_links
from planar.solving.full_constraints import CLOSED_TOLERANCE, FullConstraints, find_closed_position
from planar.solving.prepared_mechanism import PreparedMechanism

MIN_DRIVEN_SHARE = 1e-3
"""Part of a unit motion by which a pair must move to be chosen as an input."""
DRAWN_REMARK = "no input is given"
"""The first words of the remark on a position that is as drawn."""


def with_drawn_inputs(setup: PreparedMechanism) -> Mechanism | None:
    """The mechanism of `setup` with an input at rest for each freedom that its own inputs leave.

    The positions of these inputs are those of the closed position nearest to the sketch, and a remark says so. Returns
    None where nothing is left free, no closed position is found, or no pairs drive every motion (links that nothing
    joins).
    """
    mechanism, constraints = setup.mechanism, FullConstraints(setup)
    given = tuple(each.pair for each in mechanism.inputs)
    w = find_closed_position(constraints)
    if w is None or np.any(np.abs(constraints.relative_positions(given, w) - setup.inputs.u) > CLOSED_TOLERANCE):
        return None
    free = null_space(np.vstack([constraints.jacobian(w), constraints.relative_jacobian(given, w)]))
    names = _driving_pairs(constraints, w, free)
    if not names or len(names) < free.shape[1]:
        return None
    inputs = (
        Input(name, _input_position(setup, name, float(position)))
        for name, position in zip(names, constraints.relative_positions(names, w), strict=True)
    )
    remark = f"{DRAWN_REMARK} at {quote_names(names)}, where it stands as drawn: {free_links(setup).reason}"
    return replace(mechanism, inputs=(*mechanism.inputs, *inputs), remarks=(*mechanism.remarks, remark))


def _input_position(setup: PreparedMechanism, name: str, position: float) -> float:
    """A position (rad, sizes) as an input has it (rad, m): an angle whose turns are not counted within half a turn."""
    if setup.is_sliding(name):
        return position * setup.unit
    return position if setup.structure.counts else remainder(position, 2.0 * pi)


def _driving_pairs(constraints: FullConstraints, w: Array, free: Array) -> tuple[str, ...]:
    """Relative motions that determine every free motion (columns of `free`): those at the frame first."""
    setup = constraints.setup
    frame = setup.mechanism.frame
    names = sorted(setup.relative_motions, key=lambda name: frame not in setup.relative_motions[name].links)
    rates = constraints.relative_jacobian(tuple(names), w) @ free
    chosen: list[str] = []
    while len(chosen) < free.shape[1]:
        sizes = np.linalg.norm(rates, axis=1)
        fit = _first_large(sizes)
        if fit is None:
            break
        chosen.append(names[fit])
        direction = rates[fit] / sizes[fit]
        rates = rates - np.outer(rates @ direction, direction)
    return tuple(chosen)


def _first_large(sizes: Sequence[float] | Array) -> int | None:
    """The first that is at least a tenth of the greatest; None where all are too small."""
    greatest = float(np.max(sizes, initial=0.0))
    return int(np.argmax(np.asarray(sizes) >= 0.1 * greatest)) if greatest > MIN_DRIVEN_SHARE else None
