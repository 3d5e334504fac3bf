"""The results that a task wants: as expressions in unknowns and numbers, and how far entries are missed."""

from __future__ import annotations

from collections.abc import Iterable

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.derivatives.kinematic_slopes import CoordinateMotion, NamedResult
from planar.derivatives.result_slopes import DerivedResults, PositionSlopes, SlopeSystem, tied_dimensions
from planar.equations.elimination import stack_expressions
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.jets import TURN, Scalar
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.results.motion import Motion
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction, WantedPath, WantedPoses


def wanted_parts(mechanism: Mechanism, motion: CoordinateMotion, wanted: Wanted) -> list[Scalar]:
    """The parts of a wanted item, SI, in any arithmetic: of a point x and y, of a link those of its origin and its
    angle, of a pair its position."""
    if isinstance(wanted, WantedPath):
        name = carried_name(mechanism, wanted.point)
        point = next((point for point in named_points(mechanism) if point.name == name), None)
        if point is None:
            raise BadInput("$.wanted", f"{mechanism.name!r} has no point {wanted.point!r}")
        link, place = point.members[0]
        return list(motion.frames[link].to_world(motion.shapes[link].position(place)))
    if isinstance(wanted, WantedPoses):
        if wanted.link not in motion.frames:
            raise BadInput("$.wanted", f"{mechanism.name!r} has no link {wanted.link!r}")
        frame = motion.frames[wanted.link]
        return [frame.x, frame.y, frame.angle]
    if wanted.to_pair not in relative_motions(mechanism):
        raise BadInput("$.wanted", f"{mechanism.name!r} has no pair {wanted.to_pair!r}")
    return [motion.input_position(motion.relative_motions[wanted.to_pair]).parts[0]]


def wanted_expression(design: DesignEquations, wanted: Wanted) -> ca.SX:
    """The parts (parts,) of a wanted item in the unknowns and numbers of a design."""
    return stack_expressions(wanted_parts(design.mechanism, design.positions, wanted))


def wanted_slopes(moving: Motion, wanted: Iterable[Wanted]) -> tuple[SlopeSystem, DerivedResults]:
    """The results of wanted items over a motion, by the numbers of the items, with their derivatives, and their
    system."""
    system = SlopeSystem(moving, has_rates=False)

    def results(part: PositionSlopes) -> list[NamedResult]:
        motion = part.kinematics.motion
        return [
            NamedResult(str(number), "length", tuple(wanted_parts(moving.mechanism, motion, item)))
            for number, item in enumerate(wanted)
        ]

    return system, system.derive(results)


def set_apart(point: str) -> str:
    """What a wanted point of a chain is called where a joint of it bears its name."""
    return f"{point} wanted"


def carried_name(mechanism: Mechanism, point: str) -> str:
    """The name of a wanted point in a mechanism, which may be one of a chain where it is set apart from a joint."""
    apart = set_apart(point)
    return apart if any(point.name == apart for point in named_points(mechanism)) else point


def depended_numbers(mechanism: Mechanism, wanted: tuple[Wanted, ...]) -> tuple[str, ...]:
    """The numbers of links and pairs that what is wanted, or how the mechanism closes, depends on."""
    design = design_equations(mechanism)
    depends = ca.vertcat(design.F, *(wanted_expression(design, item) for item in wanted))
    used = ca.which_depends(depends, design.d, 1, False)
    return tuple(
        dimension.name
        for dimension, is_used in zip(design.dimensions, used, strict=True)
        if is_used and dimension.path[0] in ("links", "pairs")
    )


def influential_numbers(mechanism: Mechanism, wanted: tuple[Wanted, ...]) -> tuple[str, ...]:
    """The lengths and angles among them that can change alone."""
    used = {*depended_numbers(mechanism, wanted)}
    tied = {*tied_dimensions(mechanism, used)}
    return tuple(
        dimension.name
        for dimension in design_equations(mechanism).dimensions
        if dimension.name in used - tied and dimension.kind in ("length", "angle")
    )


def _wrapped(angles: Array) -> Array:
    """Angles by less than half a turn."""
    within: Array = angles - TURN * np.round(angles / TURN)
    return within


def result_differences(wanted: Wanted, shown: Array, other: Array, size: float, turns: bool = True) -> Array:
    """How far results (n, parts) are from others (n,), m or rad: of a pose the angle counts by the size (m).

    `turns` tells whether the values of a function are angles, which are the same a turn apart.
    """
    apart: Array = shown - other
    if isinstance(wanted, WantedFunction):
        return np.abs(_wrapped(apart[:, 0]) if turns else apart[:, 0])
    if not isinstance(wanted, WantedPath):
        apart = np.concatenate([apart[:, :2], size * _wrapped(apart[:, 2:])], axis=1)
    distances: Array = np.linalg.norm(apart, axis=1)
    return distances


def function_zero(wanted: WantedFunction, shown: Array, turns: bool = True) -> float:
    """What results (n, 1) of a function differ by on average from its values; 0 of an absolute one."""
    if wanted.is_absolute:
        return 0.0
    apart = shown[:, 0] - wanted.values
    steps = apart - apart[0]  # the zero may be about half a turn
    return float(apart[0] + np.mean(_wrapped(steps) if turns else steps))


def entry_misses(wanted: Wanted, shown: Array, size: float, zero: float | None = None, *, turns: bool = True) -> Array:
    """How far each entry is missed (n,): m, of functions rad or m; of a pose the angle counts by the size.

    `zero` is where the scale of a function's values begins, that of the results where it is not given.
    """
    if isinstance(wanted, WantedFunction):
        zero = function_zero(wanted, shown, turns) if zero is None else zero
        return result_differences(wanted, shown, wanted.values[:, None] + zero, size, turns)
    return result_differences(wanted, shown, wanted_results(wanted), size)


def wanted_results(wanted: Wanted) -> Array:
    """The results (n, parts) that are wanted: places, poses, or values of a function."""
    if isinstance(wanted, WantedFunction):
        return wanted.values[:, None]
    if isinstance(wanted, WantedPath):
        return wanted.places
    return np.concatenate([wanted.places, wanted.angles[:, None]], axis=1)


def repeat_entry(wanted: Wanted, entry: int, many: int) -> Wanted:
    """A path or poses, so many times this entry."""
    assert not isinstance(wanted, WantedFunction)
    places = np.broadcast_to(wanted.places[entry], (many, 2))
    if isinstance(wanted, WantedPath):
        return wanted._replace(places=places)
    return wanted._replace(places=places, angles=np.broadcast_to(wanted.angles[entry], (many,)))


def resting_misses(wanted: Wanted, size: float) -> Array:
    """How far each entry is missed (n,) by one that does not move, where it misses least."""
    if isinstance(wanted, WantedFunction):
        apart: Array = np.abs(wanted.values - wanted.values.mean())
        return apart
    middle = wanted.places.mean(axis=0)
    if not isinstance(wanted, WantedPath):
        middle = np.append(middle, wanted.angles.mean())
    return entry_misses(wanted, np.broadcast_to(middle, (len(wanted.places), len(middle))), size)
