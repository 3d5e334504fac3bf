"""The momentum of a linkage at generic positions, each input alone at unit rate, with how exact it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planar.dynamics.balancing.mass_parameters import QUANTITY_POWERS, LinkAxes
from planar.dynamics.balancing.shaking_maps import LinkKinematics
from planar.dynamics.virtual_velocities import has_length_motion
from planar.equations.mechanism_numbers import mechanism_size, shapes_of_links
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Drive, Input, Mechanism
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.position import solve, solved_mechanism

RUN_STEPS = (37, 53)
"""Steps of the runs whose positions are taken: coprime, so that no function of the input is nought at all of both and
not everywhere, but for harmonics beyond these."""
OTHER_SETTINGS, SETTING_RADII = 6, (0.3, 0.1, 0.03)
"""Positions at which the other inputs stand meanwhile, and how far from the file's at most (rad, or of the size)."""
MAX_CONDITION = 1e5
"""Positions at which velocities are less certain than so are left out: there are others."""
ROUNDING = 64.0 * float(np.finfo(float).eps)
"""What a rate is off by, beside itself, where its equations have a condition number of one."""


class MomentumRows(NamedTuple):
    """The momentum of a linkage as rows that mass parameters (4 links,) are multiplied by, everything in the unit of
    its size, and every velocity beside the greatest at its position.

    `linear` (2 n, 4 links), `angular` (n, 4 links) about a point; `linear_error` and `angular_error` bound the
    spectral norm of what the condition numbers let them be off by.
    """

    axes: tuple[LinkAxes, ...]
    shapes: dict[str, LinkShape]
    size: float
    linear: Array
    angular: Array
    linear_error: float
    angular_error: float

    @property
    def column_scale(self) -> Array:
        """The unit of each mass parameter of the rows: powers of the size (4 links,)."""
        return self.size ** (np.tile(QUANTITY_POWERS, len(self.axes)) + 0.0)


def generic_momentum(mechanism: Mechanism, about: Array, seed: int = 0) -> MomentumRows:
    """The momentum at positions over the whole motion of every input. Raises NoAnswer where there is no motion."""
    linear, angular, errors = [], [], []
    kinematics = None
    size = 1.0
    for motion in _generic_motions(mechanism, seed):
        kinematics = LinkKinematics(motion)
        size = kinematics.reactions.arm
        found = kinematics.unit_rate_momentum(about)
        scale = size ** (np.tile(QUANTITY_POWERS, len(kinematics.axes)) + 0.0)
        flat, turned = found.linear * scale, found.angular * (scale / size)
        speed = np.maximum(np.abs(flat).max(axis=(2, 3)), np.abs(turned).max(axis=2))
        good = np.isfinite(speed).all(axis=1) & (found.condition < MAX_CONDITION) & (speed > 0.0).all(axis=1)
        flat, turned = flat[good] / speed[good, :, None, None], turned[good] / speed[good, :, None]
        linear.append(flat.reshape(-1, flat.shape[-1]))
        angular.append(turned.reshape(-1, flat.shape[-1]))
        # a position is off by its residual times the condition number, and its rates by that times it again
        off = found.condition[good] * (ROUNDING + found.condition[good] * max(motion.residual, ROUNDING))
        errors.append(np.repeat(off, flat.shape[1]))
    if kinematics is None or not sum(map(len, angular)):
        told = "no position of the motion is far enough from dead points for its velocities to be told"
        raise NoAnswer(Outcome.DEAD_POINT, told)
    rows, turning, off = np.concatenate(linear), np.concatenate(angular), np.concatenate(errors)
    return MomentumRows(
        kinematics.axes,
        dict(kinematics.motion.shapes),
        size,
        rows,
        turning,
        _norm_of_errors(rows, np.repeat(off, 2)),
        _norm_of_errors(turning, off),
    )


def _norm_of_errors(rows: Array, off: Array) -> float:
    """The Frobenius norm of what rows (k, columns) are off by, each by so much beside itself; no norm is less."""
    return float(np.sqrt(np.sum((np.linalg.norm(rows, axis=1) * off) ** 2)))


def _generic_motions(mechanism: Mechanism, seed: int) -> Iterator[Motion]:
    """Runs of every input at unit speed; where there are others these stand in random positions.

    Where they cannot stand there, or the input not run, nearer positions are tried. Raises NoAnswer where the input
    does not run from the file's position.
    """
    if not mechanism.inputs:
        solved_mechanism(mechanism).check_motion()
    random = np.random.default_rng(seed)
    for name in [given.pair for given in mechanism.inputs]:
        if len(mechanism.inputs) == 1:
            yield from (_run(mechanism, steps, name) for steps in RUN_STEPS)
            continue
        yield _run(mechanism, RUN_STEPS[0], name)
        for _ in range(OTHER_SETTINGS):
            for radius in SETTING_RADII:
                try:
                    offsets = radius * random.uniform(-1.0, 1.0, len(mechanism.inputs))
                    motion = _run(_moved(mechanism, name, offsets), RUN_STEPS[0], name)
                except (NoAnswer, BadInput):
                    continue
                yield motion
                break


def _run(mechanism: Mechanism, steps: int, name: str) -> Motion:
    """The motion of an input at unit speed over its range, the others at rest; of one without ends, a part of it."""
    inputs = tuple(Input(given.pair, given.position, float(given.pair == name)) for given in mechanism.inputs)
    alone = replace(mechanism, inputs=inputs)
    try:
        return cycle(alone, steps, pair=name)
    except BadInput:
        position = next(given.position for given in inputs if given.pair == name)
        return cycle(alone, steps, position, position + _input_size(mechanism, name), name)


def _moved(mechanism: Mechanism, name: str, offsets: Array) -> Mechanism:
    """The mechanism with all inputs but one off the positions of the file, by parts of a radian or of its size.

    It goes there along its branch, and its sketch is where it then stands.
    """
    drives = tuple(
        Drive(given.pair, given.position + float(offset) * _input_size(mechanism, given.pair))
        for given, offset in zip(mechanism.inputs, offsets, strict=True)
        if given.pair != name
    )
    state = solve(mechanism, drives)
    sketch = tuple((name, float(at.position[0]), float(at.position[1])) for name, at in state.points.items())
    return replace(state.mechanism, sketch=sketch)


def _input_size(mechanism: Mechanism, name: str) -> float:
    """One radian, or at a length the mechanism's size (m)."""
    return mechanism_size(mechanism, shapes_of_links(mechanism)) if has_length_motion(mechanism, name) else 1.0
