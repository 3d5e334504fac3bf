"""kinepy: groups solved in closed form on arrays over all steps; dyads only."""

from __future__ import annotations

from contextlib import redirect_stdout
from io import StringIO
from itertools import product

import numpy as np
from kinepy import System

from benchmarks.entry import Array, Entry
from benchmarks.peers.bodies import Bodies, bodies
from benchmarks.swept.base import Swept

SYSTEM = "kinepy"


def entries(swept: Swept, theta: Array) -> list[Entry]:
    """Positions of the file's own design; its rates come only with forces, by differences, and are left out."""
    if not swept.dyadic:
        return []
    told = bodies(swept.document())
    # ways that do not close come out as nan, and it warns of them
    with redirect_stdout(StringIO()), np.errstate(invalid="ignore"):
        system = System()
        solids = {told.frame: system.ground} | {name: system.add_solid(name) for name in told.places}
        joints = [
            system.add_revolute(solids[joint.first], solids[joint.second], joint.at_first, joint.at_second)
            for joint in told.joints
        ]
        system.pilot(joints[told.driven])
        system.compile()
        body, at = told.points[swept.point]
        # which way each group goes together is a sign; the file's sketch says which ones
        names = list(system._object.signs)
        ways = [dict(zip(names, signs, strict=True)) for signs in product((1, -1), repeat=len(names))]
        system.change_signs(min(ways, key=lambda signs: _far(system, signs, solids, told)))

    def solve() -> Array:
        system.solve_kinematics(theta.copy())
        return solids[body].get_point(at)

    return [Entry(SYSTEM, False, np.arange(1), np.arange(len(theta)), solve, lambda found: np.array(found)[..., None])]


def _far(system: System, signs: dict, solids: dict, told: Bodies) -> float:
    """How far the bodies' angles are from those at the file's position."""
    system.change_signs(signs)
    angle = told.places[told.joints[told.driven].second][2]
    system.solve_kinematics(np.array([angle, angle]))
    return sum(
        abs(np.exp(1j * float(np.ravel(solids[name]._object.angle)[0])) - np.exp(1j * place[2]))
        for name, place in told.places.items()
    )
