"""The equilibrium of all links under loads: what the inputs hold, as multipliers beside those of the pairs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.analysis.ties import still
from planar.mechanism import Mechanism, motions, named_points
from planar.motion import State
from planar.pairs import Kind
from planar.solving.constraints import Constraints, rank
from planar.solving.setup import Setup

Array = np.ndarray
NONE = 1e-9
"""A singular value below this part of the greatest is none: that of a constraint which others hold already."""


class Equilibrium(NamedTuple):
    """The inputs' multipliers, and how well the links are in balance.

    `efforts` in N m or N; `scale` (N m) is that of the loads with forces at an arm of the mechanism's `size` (m);
    `left` is the worst force or moment that is open, beside the greatest of the loads and the multipliers.
    """

    efforts: Mapping[str, float]
    scale: float
    size: float
    left: float


def equilibrium(state: State) -> Equilibrium | None:
    """The balance of virtual work on every coordinate of every link, nothing eliminated.

    J^T lambda + D^T T + Q = 0: the multipliers lambda of all pairs' constraints (J their slope) and the efforts T of
    the inputs (D the slope of their drives) balance the loads Q; least squares, as constraints may hold twice.
    None without inputs, without loads, or where links could move to first order with the inputs held, so that no
    forces balance every load.
    """
    mechanism = state.mechanism
    setup = Setup(mechanism)
    names = tuple(given.pair for given in mechanism.inputs)
    scale = sum(float(np.hypot(*load.force)) * setup.unit for load in mechanism.loads if load.force is not None)
    scale += sum(abs(load.torque) for load in mechanism.loads if load.torque is not None)
    if not names or scale == 0.0:
        return None
    constraints, w = Constraints(setup), setup.coordinates(state.frames, state.own)
    slopes = np.vstack([constraints.slope(w), constraints.drive_slope(names, w)])
    if rank(slopes) < w.size:
        return None
    loads = generalised(state, setup)
    found = np.linalg.lstsq(slopes.T, -loads, rcond=NONE)[0]
    left = float(np.abs(slopes.T @ found + loads).max())
    named = motions(mechanism)
    arms = [setup.unit if named[name].drive_kind is Kind.LENGTH else 1.0 for name in names]
    efforts = {name: float(each) / arm for name, each, arm in zip(names, found[-len(names) :], arms, strict=True)}
    return Equilibrium(efforts, scale, setup.unit, left / max(scale, float(np.abs(found).max())))


def generalised(state: State, setup: Setup) -> Array:
    """The loads on the coordinates w (coordinates,), N m: forces times the mechanism's size, moments about origins."""
    found = np.zeros(len(setup.equations.coordinates))
    at = carriers(state.mechanism)

    def add(link: str, which: str, value: float) -> None:
        if (link, which) in setup.column:  # the frame has no coordinates
            found[setup.column[link, which]] += value

    for load in state.mechanism.loads:
        if load.point is not None and load.force is not None:
            link, point = at[load.point]
            arm = still(state.frames[link]).turn(state.shapes[link].at(point))
            add(link, "x", load.force[0] * setup.unit)
            add(link, "y", load.force[1] * setup.unit)
            add(link, "angle", arm.x * load.force[1] - arm.y * load.force[0])
        if load.link is not None and load.torque is not None:
            add(load.link, "angle", load.torque)
    return found


def carriers(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """A (link, point) for every name of a point: as results have it, or `link.point`."""
    named = named_points(mechanism)
    own = {f"{link}.{point}": (link, point) for each in named for link, point in each.members}
    return own | {each.name: each.members[0] for each in named}
