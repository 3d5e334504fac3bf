"""The picture of a mechanism that stands on a page, and in a notebook, until a script moves it."""

from __future__ import annotations

import numpy as np

from planar.drawing.output.svg import svg
from planar.drawing.scheme.scheme import scheme
from planar.equations.coordinates import frames_from_coordinates
from planar.model.mechanism import Mechanism
from planar.results.motion import State
from planar.solving.position import solved_mechanism


def still_svg(mechanism: Mechanism, z: np.ndarray | None = None) -> str:
    """The scheme as SVG at the mechanism's inputs; `z` are the unknowns of the assembly, else the one of the sketch.

    Needs no velocities: a mechanism may stand on a dead point. Raises NoAnswer where it has no position.
    """
    known = solved_mechanism(mechanism)
    solver, z = known.solver, known.assembly.z if z is None else z
    w = solver.functions.coordinates(z, solver.inputs.u, solver.inputs.p)
    frames, own = frames_from_coordinates((w * solver.scale).tolist(), solver.column, solver.shapes, solver.pairs)
    return svg(scheme(State(mechanism, 0, 0.0, (), frames, own, solver.shapes), numbers=False), mechanism.name)
