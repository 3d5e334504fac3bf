"""What is wanted as expressions in a mechanism's unknowns and numbers, and the numbers that it depends on."""

from __future__ import annotations

import casadi as ca

from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.derivatives.result_slopes import tied_dimensions
from planar.equations.elimination import stack_expressions
from planar.foundation.errors import BadInput
from planar.model.mechanism import Mechanism, named_points
from planar.synthesis.task.synthesis_task import Wanted, WantedPath, WantedPoses


def wanted_expression(design: DesignEquations, wanted: Wanted) -> ca.SX:
    """The parts (parts,) of what is wanted, SI: of a point x and y, of a link those of its origin and its angle, of a
    pair its position."""
    frames, _ = design.placed
    if isinstance(wanted, WantedPath):
        name = carried_name(design.mechanism, wanted.point)
        point = next((each for each in named_points(design.mechanism) if each.name == name), None)
        if point is None:
            raise BadInput("$.wanted", f"{design.mechanism.name!r} has no point {wanted.point!r}")
        link, at = point.members[0]
        return stack_expressions(frames[link].to_world(design.work.shapes[link].position(at)))
    if isinstance(wanted, WantedPoses):
        if wanted.link not in frames:
            raise BadInput("$.wanted", f"{design.mechanism.name!r} has no link {wanted.link!r}")
        frame = frames[wanted.link]
        return ca.vertcat(ca.SX(frame.x), ca.SX(frame.y), ca.SX(frame.angle))
    if wanted.to_pair not in design.work.relative_motions:
        raise BadInput("$.wanted", f"{design.mechanism.name!r} has no pair {wanted.to_pair!r}")
    return design.in_link_coordinates(ca.vertcat(*design.work.relative_positions([wanted.to_pair])))


def set_apart(point: str) -> str:
    """What a wanted point of a chain is called where a joint of it bears its name."""
    return f"{point} wanted"


def carried_name(mechanism: Mechanism, point: str) -> str:
    """The name of a wanted point in a mechanism, which may be one of a chain where it is set apart from a joint."""
    apart = set_apart(point)
    return apart if any(each.name == apart for each in named_points(mechanism)) else point


def depended_numbers(mechanism: Mechanism, wanted: tuple[Wanted, ...]) -> tuple[str, ...]:
    """The numbers of links and pairs that what is wanted, or how the mechanism closes, depends on."""
    design = design_equations(mechanism)
    depends = ca.vertcat(design.F, *(wanted_expression(design, each) for each in wanted))
    used = ca.which_depends(depends, design.d, 1, False)
    return tuple(
        each.name
        for each, is_used in zip(design.dimensions, used, strict=True)
        if is_used and each.path[0] in ("links", "pairs")
    )


def influential_numbers(mechanism: Mechanism, wanted: tuple[Wanted, ...]) -> tuple[str, ...]:
    """The lengths and angles among them that can change alone."""
    used, tied = {*depended_numbers(mechanism, wanted)}, {*tied_dimensions(mechanism)}
    return tuple(
        each.name
        for each in design_equations(mechanism).dimensions
        if each.name in used - tied and each.kind in ("length", "angle")
    )
