"""Loads as outputs: the unit load of a name, and how what it acts on moves in its direction."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.load_attachment import attachments
from planar.dynamics.virtual_velocities import has_length_motion
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector
from planar.model.loads import Load
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion, State

LOAD_PREFIX = "loads."


def loads_by_name(mechanism: Mechanism) -> dict[str, Load]:
    """The loads of a mechanism, by their names: `loads.0` is the first."""
    return {f"{LOAD_PREFIX}{index}": load for index, load in enumerate(mechanism.loads)}


def find_unit_load(mechanism: Mechanism, name: str) -> tuple[Load, str] | None:
    """The load of one (N, N m) in the direction of the load of this name, or from point to point, `P,Q`.

    The second is what it is along: the load's name, or "line". None where the name is neither. Raises BadInput for a
    load that is zero.
    """
    load = loads_by_name(mechanism).get(name)
    if load is not None:
        size = np.hypot(*load.force) if load.force is not None else load.torque or load.effort
        if not size:
            raise BadInput(name, "the load is zero, so that it has no direction; give it a size")
        return load.scaled(1.0 / abs(float(size))), name
    first, _, second = name.partition(",")
    if first != second and {first, second} <= attachments(mechanism).keys():
        return Load(points=(first, second), effort=1.0), "line"
    return None


class LoadDirection(NamedTuple):
    """A unit load as an output: its rate is its power (W), a speed (m/s) or an angular velocity (rad/s)."""

    name: str
    load: Load
    kind: str
    "length or angle"

    @classmethod
    def of(cls, mechanism: Mechanism, name: str) -> LoadDirection | None:
        """That of a load, or of two points, by name; None where there is neither. Raises BadInput."""
        unit = find_unit_load(mechanism, name)
        if unit is None:
            return None
        load = unit[0]
        is_length = load.link is None and (load.pair is None or has_length_motion(mechanism, load.pair))
        return cls(name, load, "length" if is_length else "angle")

    def value_and_rates(self, moving: State | Motion) -> tuple[Array, Array, Array]:
        """NaN for its value, which a direction that turns does not have, its rate and the rate of that, (...)."""
        rate, second_rate = self._rates(moving)
        if isinstance(moving, State):
            rate, second_rate = np.reshape(rate, ()), np.reshape(second_rate, ())
        return np.full_like(rate, np.nan), rate, second_rate

    def _rates(self, moving: State | Motion) -> tuple[Array, Array]:
        load, field = self.load, KinematicArrays(moving)
        if load.point is not None and load.force is not None:
            link, point = field.attachments[load.point][:2]
            velocity, acceleration = _point_rates(field, link, point)[1:]
            direction = Vector(*load.force)
            turning: Array = np.zeros(field.position_count)
            if load.axes is not None:
                direction = field.frame(load.axes).rotate_to_world(direction)
                turning = field.angle_rates(load.axes)
            x, y = np.broadcast_arrays(*direction, turning)[:2]
            unit_rate = np.stack([-turning * y, turning * x], axis=-1)
            unit = np.stack([x, y], axis=-1)
            return _dot(velocity, unit), _dot(acceleration, unit) + _dot(velocity, unit_rate)
        if load.points is not None:
            ends = [_point_rates(field, *field.attachments[point][:2]) for point in load.points]
            apart, velocity, acceleration = (second - first for first, second in zip(*ends, strict=True))
            length = np.hypot(*apart.T)
            distance = np.where(length > 0.0, length, np.nan)  # points that coincide have no line
            line: Array = apart / distance[:, None]
            rate = _dot(velocity, line)
            across = velocity - rate[:, None] * line
            return rate, _dot(acceleration, line) + _dot(across, across) / distance
        if load.link is not None:
            sign = np.sign(load.torque or 0.0)
            return sign * field.angle_rates(load.link), sign * field.angle_rates(load.link, 2)
        parts = list(moving.pair(load.pair or "").values())[1:3]
        velocity, acceleration = (np.sign(load.effort or 0.0) * np.asarray(part, dtype=float) for part in parts)
        return velocity, acceleration


def _point_rates(field: KinematicArrays, link: str, point: str) -> list[Array]:
    """Position, velocity and acceleration (n, 2) of a point of a link."""
    place = field.shapes[link].position(point)
    return [field.point_rates(link, place, rate) for rate in range(3)]


def _dot(one: Array, other: Array) -> Array:
    product: Array = np.sum(one * other, axis=-1)
    return product
