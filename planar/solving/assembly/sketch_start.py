"""Start values of links from the sketch alone."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector
from planar.model.mechanism import named_points
from planar.solving.prepared_mechanism import PreparedMechanism

START_SPREAD = 0.5
"""Sizes, rad: how far tries after the first are spread about what the sketch shows."""


def sketch_coordinates(setup: PreparedMechanism, seed: int) -> Array:
    """Coordinates w with the links about where the sketch has their points; what it does not show is at random.

    Pins on the frame are where the frame has them.
    """
    rng = np.random.default_rng(seed)
    w = rng.uniform(-1.0, 1.0, len(setup.equations.coordinates))
    shown = {name: Vector(x / setup.unit, y / setup.unit) for name, x, y in setup.mechanism.sketch}
    frame = setup.mechanism.frame
    for each in named_points(setup.mechanism):
        for link, point in each.members:
            if link == frame and len(each.members) > 1:
                shown[each.name] = setup.shapes[frame].points[point] * (1.0 / setup.unit)
    ends: dict[str, list[tuple[Vector, Vector]]] = {}
    for each in named_points(setup.mechanism):
        if each.name in shown:
            for link, point in each.members:
                local = setup.shapes[link].points[point] * (1.0 / setup.unit)
                ends.setdefault(link, []).append((local, shown[each.name]))
    for link, both in ends.items():
        if (link, "x") not in setup.column:
            continue
        turn = turn_between(both) if len(both) > 1 else None
        angle = float(w[setup.column[link, "angle"]]) * np.pi if turn is None else turn
        carried = [at - local.rotate(Vector(np.cos(angle), np.sin(angle))) for local, at in both]
        place = (*np.mean(carried, axis=0), angle)
        w[[setup.column[link, part] for part in ("x", "y", "angle")]] = place
    return w + (START_SPREAD * rng.normal(size=w.size) if seed else 0.0)


def turn_between(ends: list[tuple[Vector, Vector]]) -> float | None:
    """The angle that turns local points nearest to where they are shown (orthogonal Procrustes in the plane)."""
    local = np.array([complex(*at) for at, _ in ends])
    shown = np.array([complex(*at) for _, at in ends])
    turn = np.vdot(local - local.mean(), shown - shown.mean())
    return None if abs(turn) < 1e-12 else float(np.angle(turn))
