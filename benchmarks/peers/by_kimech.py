"""kimech: rigid bodies, Newton's iteration with continuation."""

from __future__ import annotations

import kimech
import numpy as np

from benchmarks.entry import Array, Entry
from benchmarks.linkages.base import ALPHA, OMEGA
from benchmarks.peers.bodies import bodies
from benchmarks.swept.base import Swept

SYSTEM = "kimech"
FEW = 12
"""It takes milliseconds a position: so many steps of the turn are enough."""


def entries(swept: Swept, theta: Array) -> list[Entry]:
    """The first steps of the file's own design."""
    told = bodies(swept.document())
    mechanism = kimech.Mechanism(swept.limit)
    links = {told.frame: mechanism.ground} | {name: mechanism.add_link(name) for name in told.places}
    joints = [
        mechanism.revolute(
            links[joint.first].add_point(f"{joint.first} {number}", joint.at_first),
            links[joint.second].add_point(f"{joint.second} {number}", joint.at_second),
        )
        for number, joint in enumerate(told.joints)
    ]
    body, at = told.points[swept.point]
    point = links[body].add_point("asked", at)
    guess = {links[name]: place for name, place in told.places.items()}
    few = theta[:FEW]

    def solve(**rates: float) -> kimech.KinematicSolution:
        driver = kimech.KinematicDriver(joints[told.driven], position=few, **rates)
        return kimech.solve(mechanism, drivers=driver, initial_guess=guess)

    def read(found: kimech.KinematicSolution) -> Array:
        return np.asarray(found.point_positions(point)).T[..., None]

    def read_moving(found: kimech.KinematicSolution) -> Array:
        orders = found.point_positions(point), found.point_velocities(point), found.point_accelerations(point)
        return np.concatenate([np.asarray(order).T for order in orders])[..., None]

    return [
        Entry(SYSTEM, False, np.arange(1), np.arange(FEW), solve, read),
        Entry(
            SYSTEM, True, np.arange(1), np.arange(FEW), lambda: solve(velocity=OMEGA, acceleration=ALPHA), read_moving
        ),
    ]
