"""Inputs that hold a mechanism, which has too few, at rest in the position in which it is drawn."""

from __future__ import annotations

from dataclasses import replace
from math import inf, pi, remainder

import numpy as np

from planar.foundation.arrays import Array
from planar.model.mechanism import Input, Mechanism, named_points
from planar.model.wording import quote_names
from planar.solving.diagnosis.refusals import free_links
from planar.solving.full_constraints import MAX_STARTS, FullConstraints, sketch_coordinates
from planar.solving.prepared_mechanism import PreparedMechanism

MIN_DRIVEN_SHARE = 1e-3
"""Part of a unit motion by which a pair must move to be chosen as an input."""
SHORTEST_STEP, MIN_GAIN = 0.05, 1e-6
"""Part of a full step towards the sketch that is still tried, and of the squared distance that a step must save."""
DRAWN_REMARK = "no input is given"
"""The first words of the remark on a position that is as drawn."""


def with_drawn_inputs(setup: PreparedMechanism) -> Mechanism | None:
    """The mechanism of `setup` with an input at rest for each freedom that its own inputs leave.

    The positions of these inputs are those of the closed position nearest to the sketch, and a remark says so. Returns
    None where nothing is left free, no closed position is found, or no pairs drive every motion (links that nothing
    joins).
    """
    mechanism, constraints = setup.mechanism, FullConstraints(setup)
    driven = tuple(given.pair for given in mechanism.inputs)
    w = _drawn_position(constraints, driven)
    if w is None:
        return None
    free = constraints.free_motions(w, driven)
    names = _driving_pairs(constraints, w, free)
    if not names or len(names) < free.shape[1]:
        return None
    inputs = (
        Input(name, _input_position(setup, name, float(position)))
        for name, position in zip(names, constraints.relative_positions(names, w), strict=True)
    )
    remark = f"{DRAWN_REMARK} at {quote_names(names)}, where it stands as drawn: {free_links(setup).reason}"
    return replace(mechanism, inputs=(*mechanism.inputs, *inputs), remarks=(*mechanism.remarks, remark))


def _drawn_position(constraints: FullConstraints, driven: tuple[str, ...]) -> Array | None:
    """The closed position w at the inputs nearest to the sketch of those found; None where none is found.

    From each of a few starts the sum of squared distances to the sketched points is brought down along the motions that
    the inputs leave free, by Gauss and Newton's method with halved steps.
    """
    setup = constraints.setup
    targets = {name: (x / setup.unit, y / setup.unit) for name, x, y in setup.mechanism.sketch}
    sketched = [point for point in named_points(setup.mechanism) if point.name in targets]
    members = [point.members[0] for point in sketched]
    target = np.array([targets[point.name] for point in sketched]).ravel()
    best, minimum = None, inf
    for seed in range(MAX_STARTS):
        w = constraints.correct(sketch_coordinates(setup, seed), driven, setup.inputs.u)
        if w is None:
            continue
        points, jacobian = constraints.points_and_jacobian(members, w)
        distance, step_size = float(np.sum((points - target) ** 2)), 1.0
        while members and step_size > SHORTEST_STEP:
            free = constraints.free_motions(w, driven)
            step = free @ np.linalg.lstsq(jacobian @ free, target - points)[0]
            trial = constraints.correct(w + step * step_size, driven, setup.inputs.u)
            if trial is not None:
                trial_points, trial_jacobian = constraints.points_and_jacobian(members, trial)
                trial_distance = float(np.sum((trial_points - target) ** 2))
                if trial_distance < distance * (1.0 - MIN_GAIN):
                    w, points, jacobian, distance, step_size = trial, trial_points, trial_jacobian, trial_distance, 1.0
                    continue
            step_size *= 0.5
        if distance < minimum:
            best, minimum = w, distance
        if not members:
            break
    return best


def _input_position(setup: PreparedMechanism, name: str, position: float) -> float:
    """A position (rad, sizes) as an input has it (rad, m): an angle whose turns are not counted within half a turn."""
    if setup.is_sliding(name):
        return position * setup.unit
    return position if setup.structure.counts else remainder(position, 2.0 * pi)


def _driving_pairs(constraints: FullConstraints, w: Array, free: Array) -> tuple[str, ...]:
    """Relative motions that determine every free motion (columns of `free`): those at the frame first.

    Each chosen one moves at least a tenth as fast as the fastest of those left.
    """
    setup = constraints.setup
    frame = setup.mechanism.frame
    names = sorted(setup.relative_motions, key=lambda name: frame not in setup.relative_motions[name].links)
    rates = constraints.relative_jacobian(tuple(names), w) @ free
    chosen: list[str] = []
    while len(chosen) < free.shape[1]:
        sizes = np.linalg.norm(rates, axis=1)
        greatest = sizes.max(initial=0.0)
        if greatest <= MIN_DRIVEN_SHARE:
            break
        first = int(np.argmax(sizes >= 0.1 * greatest))
        chosen.append(names[first])
        direction = rates[first] / sizes[first]
        rates = rates - np.outer(rates @ direction, direction)
    return tuple(chosen)
