"""Inputs that hold a mechanism, which has too few, at rest in the position in which it is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, pi, remainder

import numpy as np

from planar.foundation.arrays import Array
from planar.model.mechanism import Input, Mechanism, named_points
from planar.model.wording import quote_names
from planar.solving.checks.singular_values import null_space
from planar.solving.diagnosis.refusals import free_links
from planar.solving.full_constraints import MAX_STARTS, FullConstraints, sketch_coordinates
from planar.solving.prepared_mechanism import PreparedMechanism

MIN_DRIVEN_SHARE = 1e-3
"""Part of a unit motion by which a pair must move to be chosen as an input."""
SHORTEST_STEP, LEAST_GAIN = 0.05, 1e-6
"""Part of a whole step towards the sketch that is still tried, and of the squared distance that a step must save."""
DRAWN_REMARK = "no input is given"
"""The first words of the remark on a position that is as drawn."""


def with_drawn_inputs(setup: PreparedMechanism) -> Mechanism | None:
    """The mechanism of `setup` with an input at rest for each freedom that its own inputs leave.

    The positions of these inputs are those of the closed position nearest to the sketch, and a remark says so. Returns
    None where nothing is left free, no closed position is found, or no pairs drive every motion (links that nothing
    joins).
    """
    mechanism, constraints = setup.mechanism, FullConstraints(setup)
    w = _drawn_position(constraints)
    if w is None:
        return None
    free = _free_motions(constraints, w)
    names = _driving_pairs(constraints, w, free)
    if not names or len(names) < free.shape[1]:
        return None
    inputs = (
        Input(name, _input_position(setup, name, float(position)))
        for name, position in zip(names, constraints.relative_positions(names, w), strict=True)
    )
    remark = f"{DRAWN_REMARK} at {quote_names(names)}, where it stands as drawn: {free_links(setup).reason}"
    return replace(mechanism, inputs=(*mechanism.inputs, *inputs), remarks=(*mechanism.remarks, remark))


def _drawn_position(constraints: FullConstraints) -> Array | None:
    """The closed position w at the inputs nearest to the sketch of those found; None where none is found.

    From each of a few starts the sum of squared distances to the sketched points is brought down along the motions that
    the inputs leave free, by Gauss and Newton's method with halved steps.
    """
    setup = constraints.setup
    targets = {name: (x / setup.unit, y / setup.unit) for name, x, y in setup.mechanism.sketch}
    shown = [each for each in named_points(setup.mechanism) if each.name in targets]
    members = [each.members[0] for each in shown]
    target = np.array([targets[each.name] for each in shown]).ravel()
    best, least = None, inf
    for seed in range(MAX_STARTS):
        w = _closed(constraints, sketch_coordinates(setup, seed))
        if w is None:
            continue
        places, slope = constraints.points_and_jacobian(members, w)
        distance, step_size = float(np.sum((places - target) ** 2)), 1.0
        while members and step_size > SHORTEST_STEP:
            free = _free_motions(constraints, w)
            step = free @ np.linalg.lstsq(slope @ free, target - places)[0]
            beside = _closed(constraints, w + step * step_size)
            if beside is not None:
                nearer, its_slope = constraints.points_and_jacobian(members, beside)
                its_distance = float(np.sum((nearer - target) ** 2))
                if its_distance < distance * (1.0 - LEAST_GAIN):
                    w, places, slope, distance, step_size = beside, nearer, its_slope, its_distance, 1.0
                    continue
            step_size *= 0.5
        if distance < least:
            best, least = w, distance
        if not members:
            break
    return best


def _closed(constraints: FullConstraints, w: Array) -> Array | None:
    """The closed position at the inputs near coordinates w, if one is found."""
    setup = constraints.setup
    return constraints.correct(w, tuple(given.pair for given in setup.mechanism.inputs), setup.inputs.u)


def _free_motions(constraints: FullConstraints, w: Array) -> Array:
    """What the pairs and the inputs leave free at w (coordinates, freedoms)."""
    names = tuple(given.pair for given in constraints.setup.mechanism.inputs)
    return null_space(np.vstack([constraints.jacobian(w), constraints.relative_jacobian(names, w)]))


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
