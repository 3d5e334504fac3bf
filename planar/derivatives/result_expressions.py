"""What results tell of a point, a link, a pair or an input, as expressions in the unknowns and dimensions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca

from planar.derivatives.design_equations import DesignEquations
from planar.equations.elimination import stack_expressions
from planar.results.kinematic_result import KinematicResult

LINK_RESULTS = ("angle", "angular_velocity", "angular_acceleration")
POINT_RESULTS = ("position", "velocity", "acceleration")
POINT_KINDS = ("length", "velocity", "acceleration")


class ResultExpression(NamedTuple):
    """A result by the name that it has in a state, its kind of quantity, and its parts (parts,) in SI."""

    name: str
    kind: str
    value: ca.SX


def kinematic_expressions(design: DesignEquations, moving: KinematicResult, name: str) -> Iterator[ResultExpression]:
    """What a state tells of this name: of a point, else of a link, and of a pair."""
    frames, _ = design.placed
    if name in moving._point_names:
        link, point = moving._point_names[name].members[0]
        at = frames[link].to_world(design.work.shapes[link].position(point))
        position = stack_expressions(at)
        values = (position, *design.rates(position))
        yield from map(ResultExpression, POINT_RESULTS, POINT_KINDS, values)
    elif name in frames:
        angle = ca.SX(frames[name].angle)
        kinds = (each.replace("_", " ") for each in LINK_RESULTS)
        yield from map(ResultExpression, LINK_RESULTS, kinds, (angle, *design.rates(angle)))
    if name in design.work.relative_motions:
        pair = design.work.relative_motions[name]
        place = design.in_link_coordinates(ca.vertcat(*design.work.relative_positions([name])))
        found = pair.results(place, *design.rates(place))
        for key, value in found.items():
            if value is not None:
                yield ResultExpression(key, pair.result_kinds[key], value)
