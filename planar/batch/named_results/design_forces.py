"""Efforts of inputs, reactions of pairs and transmission angles of outputs, of many designs at every step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from planar.batch.design_arrays import design_variables, values_of_design, with_design_values
from planar.batch.named_results.design_frames import DesignFrames
from planar.batch.named_results.result_rows import RequestedResults
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.friction.frictional_forces import solve_with_friction
from planar.dynamics.load_variation import load_factors
from planar.dynamics.reaction_solver import ReactionSolver
from planar.dynamics.reactions import input_efforts, pair_reaction
from planar.dynamics.virtual_work import balance_equations
from planar.equations.mechanism_numbers import mechanism_size, shapes_of_links
from planar.foundation.geometry import Frame
from planar.foundation.jets import Jet, Scalar
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism
from planar.model.pairs.base import Pair
from planar.results.kinematic_result import KinematicResult

Array = np.ndarray
Found = dict[tuple[str, str], Array]
"""Results (numbers, steps + 1, designs) by quantity and name."""


def find_forces(
    mechanism: Mechanism,
    results: RequestedResults,
    frames: DesignFrames,
    values: Mapping[str, Array],
    is_solved: Array,
) -> Found:
    """Efforts (N m, N) and reactions (N, with their couples, N m) of designs with `values` (designs,) by name.

    `is_solved` (steps + 1, designs). NaN where positions or rates are not there, for what equilibrium does not tell,
    and where friction jams.
    """
    shape, names = frames.design_shape, [given.pair for given in mechanism.inputs]
    found: Found = {("effort", name): np.full((1, *shape), np.nan) for name in results.efforts}
    found |= {("reaction", name): np.full((2, *shape), np.nan) for name in results.reactions}
    found |= {("reaction_couple", name): np.full((1, *shape), np.nan) for name in results.reactions}
    for positions in position_chunks(mechanism, frames, values, is_solved):
        reactions = design_reaction_solver(mechanism, frames, positions, values)
        field = reactions.field
        solved = solve_with_friction(reactions, field)
        at = slice(None), positions.steps, positions.designs
        supplied = input_efforts(solved)[0]
        for name in results.efforts:
            found["effort", name][at] = supplied[:, names.index(name)]
        for name in results.reactions:
            own = pair_reaction(reactions.pairs[name], field, reactions, solved)
            found["reaction", name][at] = own.force.T
            found["reaction_couple", name][at] = own.couple
    return found


MAX_CHUNK_POSITIONS = 4096
"""Positions whose forces are found at once."""


@dataclass(frozen=True, eq=False, repr=False)
class DesignPositions(KinematicResult):
    """Positions (n,) of several designs, as a motion has those of one; numbers of the mechanism, too, are arrays (n,).

    `designs` are the columns and `steps` the rows at which they are.
    """

    mechanism: Mechanism
    frames: Mapping[str, Frame]
    own: Mapping[str, tuple[Jet, ...]]
    shapes: Mapping[str, LinkShape]
    designs: Array
    steps: Array


def design_reaction_solver(
    mechanism: Mechanism, frames: DesignFrames, positions: DesignPositions, values: Mapping[str, Array]
) -> ReactionSolver:
    """The balance at positions of a mechanism's designs, which have these values (designs,) by name."""
    equations = balance_equations(mechanism)
    field = KinematicArrays(positions, mechanism_size(mechanism, shapes_of_links(mechanism)))
    at = positions.steps, positions.designs
    inputs = {name: np.broadcast_to(value, frames.design_shape)[at] for name, value in frames.inputs.items()}
    time = None if frames.time is None else frames.time[positions.steps]
    factors = load_factors(positions.mechanism, inputs, time, field.position_count)
    q: Array = np.zeros((equations.link_coordinate_count, frames.design_shape[1]))
    for link, first in equations.link_columns.items():
        q[first + 2] = frames.angles[link][0]
    turns = equations.initial_spring_turns(q, with_design_values(mechanism, values).springs)
    return ReactionSolver(equations, equations.balance(field, factors, True, turns[:, positions.designs]), field)


def position_chunks(
    mechanism: Mechanism, frames: DesignFrames, values: Mapping[str, Array], is_solved: Array
) -> Iterator[DesignPositions]:
    """The positions that are solved (steps + 1, designs), with rates, some designs at a time."""
    finite, every = is_solved.copy(), frames.frames
    for frame in every.values():
        for part in () if frame.fixed else (frame.x, frame.y, frame.angle):
            for each in part.parts:
                finite &= np.isfinite(each)
    size = 1 if _one_by_one(mechanism, values) else max(1, MAX_CHUNK_POSITIONS // len(finite))
    for first in range(0, finite.shape[1], size):
        steps, columns = np.nonzero(finite[:, first : first + size])
        if not steps.size:
            continue
        designs, at = columns + first, (steps, columns + first)
        own = (
            values_of_design(values, first)
            if size == 1
            else {name: np.asarray(value)[designs] for name, value in values.items()}
        )
        changed = with_design_values(mechanism, own)
        yield DesignPositions(
            changed,
            {link: _frame_at(frame, at) for link, frame in every.items()},
            {
                pair.name: tuple(_at(each, at) for each in frames.own_coordinates(pair))
                for pair in frames.mechanism.pairs
                if pair.coordinate_kinds
            },
            shapes_of_links(changed),
            designs,
            steps,
        )


def _one_by_one(mechanism: Mechanism, values: Mapping[str, Array]) -> bool:
    """Whether designs differ in what only numbers can stand for: wheels' sizes, and courses of loads."""
    known = design_variables(mechanism)
    toothed = any(type(pair).tooth_contact is not Pair.tooth_contact for pair in mechanism.pairs)
    changed = [known[name] for name in values]
    return any((toothed and each.path[0] == "pairs") or "varies" in each.address for each in changed)


def _frame_at(frame: Frame, at: tuple[Array, Array]) -> Frame:
    if frame.fixed:
        return frame
    return Frame(_at(frame.x, at), _at(frame.y, at), _at(frame.cos, at), _at(frame.sin, at), _at(frame.angle, at))


def _at(value: Scalar, at: tuple[Array, Array]) -> Jet:
    return Jet(*(np.broadcast_to(part, np.shape(value.parts[0]))[at] for part in value.parts))
