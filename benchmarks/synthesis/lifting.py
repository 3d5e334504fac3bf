"""Lifting and turning things over: poses that the coupler of a four-bar is to take one after the other."""

from __future__ import annotations

from time import process_time
from typing import NamedTuple

import numpy as np

import planar
from benchmarks.synthesis.misses import Array
from planar.foundation.jets import value_and_rates
from planar.solving.input_grid import motion_over_input

LINK = "BC"
GARAGE = [[0, 0, 90], [20, 70, 68], [60, 130, 32], [130, 150, 0]]
OVEN = [[0, 0, 90], [8, -3, 72], [22, -12, 48], [36, -28, 22], [44, -46, 0]]


class Lift(NamedTuple):
    """Poses (n, 3) of the coupler: x and y of its origin in mm, its angle in degrees."""

    name: str
    poses: Array


class LiftResult(NamedTuple):
    """Greatest miss of a place in % of the poses' extent, and of an angle in degrees; processor seconds."""

    name: str
    poses: int
    place: float | None
    angle: float | None
    seconds: float
    remarks: tuple[str, ...]


def lifts() -> list[Lift]:
    """All of them."""
    share = np.linspace(0.0, 1.0, 7)
    quarter = np.radians(90.0 * share)
    level = [70.0 * np.sin(quarter), 70.0 * (1.0 - np.cos(quarter)), 0.0 * share]
    dumper = [60.0 * share**2, 100.0 * share, -60.0 * share]
    return [
        Lift("tailgate: up and over, 3 poses", np.array([[0, 0, 0], [60, 90, 50], [20, 180, 95]], float)),
        Lift("garage door: upright to flat, 4 poses", np.array(GARAGE, float)),
        Lift("oven door, 5 poses", np.array(OVEN, float)),
        Lift("load kept level, 7 poses", np.stack(level, axis=1)),
        Lift("dumper: turned as it is lifted, 7 poses", np.stack(dumper, axis=1)),
    ]


def lift_task(lift: Lift) -> dict[str, object]:
    """The task's file value."""
    poses = [{"at": [x, y], "angle": turned} for x, y, turned in lift.poses.tolist()]
    wanted = [{"link": LINK, "poses": poses, "in_order": True}]
    units = {"length": "mm", "angle": "deg"}
    return {"planar": 1, "name": lift.name, "units": units, "start": "four-bar", "wanted": wanted}


def measure(lift: Lift) -> LiftResult:
    """A lift by planar; its misses by the general path at the inputs that the search tells."""
    begun = process_time()
    found = planar.synthesise(lift_task(lift), many=3)
    seconds = process_time() - begun
    if not found:
        return LiftResult(lift.name, len(lift.poses), None, None, seconds, found.remarks)
    best = found[0]
    place, angle = pose_misses(best.mechanism, lift.poses, best.inputs[0])
    return LiftResult(lift.name, len(lift.poses), place, angle, seconds, best.defects)


def pose_misses(mechanism: planar.Mechanism, poses: Array, inputs: Array) -> tuple[float, float]:
    """Greatest misses of a place (% of the extent) and of an angle (deg), at inputs (n,) of the design's file."""
    frame = motion_over_input(planar.loads(planar.dumps(mechanism)), inputs).frames[LINK]
    x, y, turn = (np.broadcast_to(value_and_rates(part)[0], inputs.shape) for part in (frame.x, frame.y, frame.angle))
    origins, angles = np.stack([x, y], axis=1) * 1e3, np.degrees(turn)
    off = np.hypot(*(origins - poses[:, :2]).T)
    turned = (angles - poses[:, 2] + 180.0) % 360.0 - 180.0
    return 100.0 * float(off.max()) / float(np.hypot(*np.ptp(poses[:, :2], axis=0))), float(np.abs(turned).max())
