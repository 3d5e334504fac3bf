"""Efforts of inputs, reactions of pairs and transmission angles of outputs, of many designs at every step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from planar.batch.design_arrays import design_variables, values_of_design, with_design_values
from planar.batch.design_frames import DesignFrames, pair_arguments, solve_own_coordinates
from planar.batch.named_results.result_rows import NamedArrays, RequestedResults
from planar.derivatives.transmission_system import DrivenOutput
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.friction.frictional_forces import solve_with_friction
from planar.dynamics.load_variation import load_factors
from planar.dynamics.reaction_solver import ReactionSolver
from planar.dynamics.reactions import input_efforts, pair_reaction
from planar.dynamics.virtual_work import balance_equations
from planar.equations.mechanism_numbers import mechanism_size, shapes_of_links
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.geometry import Frame
from planar.foundation.jets import Jet
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism
from planar.model.pairs.base import Pair
from planar.results.kinematic_result import KinematicResult

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
    designs: IntArray
    steps: IntArray


def position_chunks(
    mechanism: Mechanism, frames: DesignFrames, values: Mapping[str, Array], is_solved: BoolArray
) -> Iterator[DesignPositions]:
    """The positions that are solved (steps + 1, designs), with rates, some designs at a time."""
    finite, all_frames = is_solved.copy(), frames.frames
    for frame in all_frames.values():
        for part in () if frame.fixed else (frame.x, frame.y, frame.angle):
            for rate in part.parts:
                finite &= np.isfinite(rate)
    size = 1 if _one_by_one(mechanism, values) else max(1, MAX_CHUNK_POSITIONS // len(finite))
    for first in range(0, finite.shape[1], size):
        steps, columns = np.nonzero(finite[:, first : first + size])
        if not steps.size:
            continue
        designs = columns + first
        if size == 1:
            changed = with_design_values(mechanism, values_of_design(values, first))
        else:
            changed = with_design_values(
                mechanism, {name: np.asarray(value)[designs] for name, value in values.items()}
            )
        shapes, places = shapes_of_links(changed), (steps, designs)
        selected = {link: _select_frame(frame, places) for link, frame in all_frames.items()}
        own = {
            pair.name: tuple(solve_own_coordinates(pair, *pair_arguments(pair, selected, shapes)))
            for pair in changed.pairs
            if pair.coordinate_kinds
        }
        yield DesignPositions(changed, selected, own, shapes, designs, steps)


def _select_frame(frame: Frame, places: tuple[IntArray, IntArray]) -> Frame:
    """A frame at some places of its arrays."""
    if frame.fixed:
        return frame
    x, y, cosine, sine, angle = (Jet(*(rate[places] for rate in part.parts)) for part in frame[:5])
    return Frame(x, y, cosine, sine, angle)


def _one_by_one(mechanism: Mechanism, values: Mapping[str, Array]) -> bool:
    """Whether designs differ in what only numbers can stand for: wheels' sizes, and courses of loads."""
    variables = design_variables(mechanism)
    toothed = any(type(pair).tooth_contact is not Pair.tooth_contact for pair in mechanism.pairs)
    changed = [variables[name] for name in values]
    return any((toothed and each.path[0] == "pairs") or "varies" in each.address for each in changed)


def _reaction_solver(
    mechanism: Mechanism, frames: DesignFrames, positions: DesignPositions, values: Mapping[str, Array]
) -> ReactionSolver:
    """The balance at positions of a mechanism's designs, which have these values (designs,) by name."""
    equations = balance_equations(mechanism)
    field = KinematicArrays(positions, mechanism_size(mechanism, shapes_of_links(mechanism)))
    places = positions.steps, positions.designs
    inputs = {name: np.broadcast_to(value, frames.design_shape)[places] for name, value in frames.inputs.items()}
    time = None if frames.time is None else frames.time[positions.steps]
    factors = load_factors(positions.mechanism, inputs, time, field.position_count)
    q: Array = np.zeros((equations.link_coordinate_count, frames.design_shape[1]))
    for link, first in equations.link_columns.items():
        q[first + 2] = frames.angles[link][0]
    turns = equations.initial_spring_turns(q, with_design_values(mechanism, values).springs)
    return ReactionSolver(equations, equations.balance(field, factors, True, turns[:, positions.designs]), field)


def find_forces(
    mechanism: Mechanism,
    results: RequestedResults,
    frames: DesignFrames,
    values: Mapping[str, Array],
    is_solved: BoolArray,
    arrays: NamedArrays,
) -> None:
    """Fill in efforts (N m, N) and reactions (N, with their couples, N m) of designs with `values` (designs,) by name.

    `is_solved` (steps + 1, designs). NaN stays where positions or rates are not there, for what equilibrium does not
    tell, and where friction jams.
    """
    inputs = [driven.pair for driven in mechanism.inputs]
    for positions in position_chunks(mechanism, frames, values, is_solved):
        reactions = _reaction_solver(mechanism, frames, positions, values)
        solution = solve_with_friction(reactions, reactions.field)
        places = slice(None), positions.steps, positions.designs
        efforts = input_efforts(solution)[0]
        for name in results.efforts:
            arrays["effort", name][places] = efforts[:, inputs.index(name)]
        for name in results.reactions:
            reaction = pair_reaction(reactions.pairs[name], reactions.field, reactions, solution)
            arrays["reaction", name][places] = reaction.force.T
            arrays["reaction_couple", name][places] = reaction.couple


def transmission_angles(
    driven: DrivenOutput, frames: DesignFrames, values: Mapping[str, Array], is_solved: BoolArray
) -> Array:
    """The angle (rad, 0 to pi/2) of designs at every step (steps + 1, designs); NaN where it is not determined."""
    angles = np.full(frames.design_shape, np.nan)
    variables = design_variables(driven.mechanism)
    # numbers of loads, springs and masses change nothing
    kept = {name for name, variable in variables.items() if variable.path[0] != "loads"}
    known = {name: value for name, value in values.items() if name in kept}
    for positions in position_chunks(driven.mechanism, frames, known, is_solved):
        reactions = _reaction_solver(driven.mechanism, frames, positions, known)
        angles[positions.steps, positions.designs] = driven.angles(reactions)[1]
    return angles


@lru_cache(maxsize=16)
def output_link(mechanism: Mechanism, output: str) -> DrivenOutput:
    """An output link, kept. Raises Unknown, BadInput."""
    return DrivenOutput(mechanism, output)
