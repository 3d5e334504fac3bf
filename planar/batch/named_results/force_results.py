"""Efforts of inputs, reactions of pairs and transmission angles of outputs, of many designs at every step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planar.batch.named_results.design_forces import design_reaction_solver, position_chunks
from planar.batch.named_results.design_frames import DesignFrames
from planar.batch.named_results.result_rows import RequestedResults
from planar.dynamics.friction.frictional_forces import solve_with_friction
from planar.dynamics.reactions import input_efforts, pair_reaction
from planar.model.mechanism import Mechanism

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
