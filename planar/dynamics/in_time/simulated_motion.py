"""The rows of a simulation as a motion like any other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planar.dynamics.lagrangian import LagrangianFunctions
from planar.foundation.arrays import Array
from planar.foundation.errors import Outcome
from planar.foundation.geometry import Frame, frame_at
from planar.foundation.jets import Jet
from planar.results.motion import Motion, State
from planar.results.records import InputMotion
from planar.solving.position import PositionSolver


def simulated_motion(
    work: LagrangianFunctions, start: State, time: Array, orders: Sequence[Array], remarks: Sequence[str]
) -> Motion:
    """Coordinates with their first and second rates, each (rows, coordinates), at times (rows,), as a motion."""
    mechanism = start.mechanism
    at = {
        link: [Jet(*(order[:, k + j] for order in orders)) for j in range(3)] for link, k in work.link_columns.items()
    }
    frames: dict[str, Frame] = {
        name: frame_at(*at[name]) if name in at else frame for name, frame in start.frames.items()
    }
    own = {
        name: tuple(Jet(*(order[:, k] for order in orders)) for k in range(part.start, part.stop))
        for name, part in work.own_slices.items()
    }
    inputs = {}
    for given in mechanism.inputs:
        pair = work.relative_motions[given.pair]
        inputs[given.pair] = InputMotion(*pair.input_position_at(work.shapes, frames, own).parts[:3])
    motion = Motion(
        mechanism=mechanism,
        inputs=inputs,
        outcome=Outcome.SOLVED,
        reason="",
        residual=0.0,
        remarks=(*start.remarks, *remarks),
        frames=frames,
        own=own,
        shapes=start.shapes,
        time=time,
    )
    u = np.array([each.position for each in inputs.values()]).reshape(len(inputs), len(time))
    solver = PositionSolver(mechanism)
    gaps = solver.coordinate_residuals(solver.coordinates(frames, own), u.T / solver.input_scale)
    return replace(motion, residual=float(np.max(gaps, initial=0.0)))
