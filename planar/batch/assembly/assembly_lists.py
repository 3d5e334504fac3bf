"""All assemblies of many designs, in the order of `planar.modes`: dyads of all designs at once, others one by one."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice
from typing import NamedTuple

import numpy as np

from planar.assemblies.modes import modes
from planar.assemblies.search_tree import is_linear
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.reference_design import ReferenceDesign
from planar.equations.linear import solve_vectors
from planar.equations.placed_blocks import POLISHING_STEPS
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.errors import BadInput, NoAnswer
from planar.model.link_shapes import PointPlacementError
from planar.solving.assembly.block_assemblies import MEETING_COSINE_SQUARED, is_out_of_reach
from planar.solving.newton import CLOSED_TOLERANCE

Array = np.ndarray

MAX_ASSEMBLIES = 4096
"""Of one design: of more it is not said that all are wanted."""


class ListedAssemblies(NamedTuple):
    """Assemblies of designs, row by row: of which design (rows,), the number in its list from 1 (rows,), and the
    unknowns (unknowns, rows) at the design's own inputs, lengths in sizes of the base.

    A design without any has one row of the number 0, its unknowns not numbers.
    """

    design: Array
    number: Array
    z: Array


def list_assemblies(reference: ReferenceDesign, values: Mapping[str, Array]) -> ListedAssemblies:
    """All assemblies of designs with `values` (designs,) by name. Raises BadInput where one has too many."""
    many = len(next(iter(values.values())))
    designs = with_design_values(reference.mechanism, values)
    shapes = reference.shapes(designs)
    p, u = reference.pair_numbers(shapes, many, designs), reference.inputs(designs, many)[0]
    fit = reference.is_fit(values, shapes, p)
    found, decided = _list_dyads(reference, p, u, fit)
    for index in np.flatnonzero(~decided):
        z = _list_one_by_one(reference, values, int(index))
        found = ListedAssemblies(
            np.append(found.design, np.full(len(z), index)),
            np.append(found.number, np.arange(1, len(z) + 1)),
            np.concatenate([found.z, z.T], axis=1),
        )
    none = np.setdiff1d(np.arange(many), found.design)
    design, number = np.append(found.design, none), np.append(found.number, np.zeros(len(none), dtype=int))
    z = np.concatenate([found.z, np.full((len(found.z), len(none)), np.nan)], axis=1)
    order = np.lexsort((number, design))
    return ListedAssemblies(design[order], number[order], z[:, order])


def _list_one_by_one(reference: ReferenceDesign, values: Mapping[str, Array], index: int) -> Array:
    """The assemblies (assemblies, unknowns) of one design, by the complete list."""
    base = reference.solver
    none = np.zeros((0, len(base.equations.unknowns)))
    try:
        every = modes(with_design_values(reference.mechanism, values_of_design(values, index)), certify=False)
        found = list(islice(every, MAX_ASSEMBLIES + 1))
    except (NoAnswer, BadInput, PointPlacementError):
        return none  # as its run will say
    if len(found) > MAX_ASSEMBLIES:
        raise BadInput("assemblies", f"design {index} has more than {MAX_ASSEMBLIES} assemblies")
    scale = every.scale / base.scale
    return np.array([mode.z * scale[list(base.equations.unknowns)] for mode in found]).reshape(-1, none.shape[1])


def _list_dyads(reference: ReferenceDesign, p: Array, u: Array, fit: Array) -> tuple[ListedAssemblies, Array]:
    """The assemblies of designs whose blocks are dyads that do not all but meet, or linear; which those are."""
    equations, functions = reference.functions.equations, reference.functions
    decided = fit.copy()
    empty = np.zeros(0, dtype=int)
    nothing = ListedAssemblies(empty, empty, np.zeros((len(equations.unknowns), 0)))
    ways = [functions.block_assemblies(block) or _linear_block(reference, block) for block in equations.blocks]
    if not reference.can_be_compiled or any(way is None for way in ways):
        return nothing, np.zeros_like(fit)
    design, z = np.flatnonzero(fit), np.zeros((len(equations.unknowns), int(fit.sum())))
    for block, way in zip(equations.blocks, ways, strict=True):
        own_u, own_p = u[:, design].T, p[:, design].T
        if way is not None and not isinstance(way, bool):
            both, left, bend = way.of_designs(z.T, own_u, own_p)
            joins = (bend < MEETING_COSINE_SQUARED) & (left <= CLOSED_TOLERANCE)
            decided[design[~(joins | is_out_of_reach(bend))]] = False
            z, design = np.repeat(z[:, joins], 2, axis=1), np.repeat(design[joins], 2)
            z[block.unknowns] = both[:, joins].transpose(2, 1, 0).reshape(slice_length(block.unknowns), -1)
        elif slice_length(block.unknowns):
            for _ in range(1 + POLISHING_STEPS):
                gap, slope = functions.block_call(block).evaluate_batch(len(design), z.T, own_u, own_p)
                z[block.unknowns] -= solve_vectors(slope.transpose(0, 2, 1), gap[:, 0]).T
            decided[design[~(np.abs(gap[:, 0]).max(axis=1) <= CLOSED_TOLERANCE)]] = False
    kept = decided[design]
    design, z = design[kept], z[:, kept]
    first = np.searchsorted(design, design)
    return ListedAssemblies(design, np.arange(len(design)) - first + 1, z), decided


def _linear_block(reference: ReferenceDesign, block: Block) -> bool | None:
    """Whether a block has one assembly, by linear equations; None where it may have others."""
    if not slice_length(block.rows):
        return True
    try:
        here = reference.solver.find_assembly().z
    except NoAnswer:
        return None
    return is_linear(reference.solver, block, here) or None
