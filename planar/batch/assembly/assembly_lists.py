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
from planar.equations.block_type_functions import POLISHING_STEPS
from planar.equations.linear import solve_vectors
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.errors import BadInput, NoAnswer
from planar.model.link_shapes import PointPlacementError
from planar.solving.assembly.block_assemblies import MEETING_COSINE_SQUARED, is_out_of_reach
from planar.solving.newton import CLOSED_TOLERANCE

Array = np.ndarray

MAX_ASSEMBLIES = 4096
"""Of one design: of more it is not clear that all are wanted."""


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
    count = len(next(iter(values.values())))
    rows = reference.design_rows(values, count)
    fit = rows.is_fit & ~reference.is_unfit(values, rows.shapes)
    design, z, decided = _list_dyads(reference, rows.p, rows.u, fit)
    for index in np.flatnonzero(~decided):
        assemblies = _list_one_by_one(reference, values, int(index))
        design, z = np.append(design, np.full(len(assemblies), index)), np.concatenate([z, assemblies.T], axis=1)
    none = np.setdiff1d(np.arange(count), design)
    design, z = np.append(design, none), np.concatenate([z, np.full((len(z), len(none)), np.nan)], axis=1)
    order = np.argsort(design, kind="stable")
    design = design[order]
    number = np.arange(1, len(design) + 1) - np.searchsorted(design, design)
    return ListedAssemblies(design, np.where(np.isin(design, none), 0, number), z[:, order])


def _list_one_by_one(reference: ReferenceDesign, values: Mapping[str, Array], index: int) -> Array:
    """The assemblies (assemblies, unknowns) of one design, by the complete list."""
    unknowns, assemblies = list(reference.solver.equations.unknowns), []
    try:
        listing = modes(with_design_values(reference.mechanism, values_of_design(values, index)), certify=False)
        assemblies = [mode.z for mode in islice(listing, MAX_ASSEMBLIES + 1)]
    except (NoAnswer, BadInput, PointPlacementError):
        return np.zeros((0, len(unknowns)))  # as its run will say
    if len(assemblies) > MAX_ASSEMBLIES:
        raise BadInput("assemblies", f"design {index} has more than {MAX_ASSEMBLIES} assemblies")
    scale = listing.scale / reference.solver.scale
    return np.reshape(assemblies, (-1, len(unknowns))) * scale[unknowns]


def _list_dyads(reference: ReferenceDesign, p: Array, u: Array, fit: Array) -> tuple[Array, Array, Array]:
    """The assemblies of designs whose blocks are dyads that do not all but meet, or linear: of which design (rows,),
    and the unknowns (unknowns, rows); and which designs these are (designs,)."""
    functions, decided = reference.functions, fit.copy()
    equations, design = functions.equations, np.flatnonzero(fit)
    z = np.zeros((len(equations.unknowns), len(design)))
    forms = [functions.block_assemblies(block) for block in equations.blocks]
    if not reference.can_be_compiled or not all(
        form or _is_linear_block(reference, block) for block, form in zip(equations.blocks, forms, strict=True)
    ):
        return design[:0], z[:, :0], np.zeros_like(fit)
    for block, form in zip(equations.blocks, forms, strict=True):
        inputs, numbers = u[:, design].T, p[:, design].T
        if form is not None:
            both, residuals, coalescence = form.of_designs(z.T, inputs, numbers)
            joins = (coalescence < MEETING_COSINE_SQUARED) & (residuals <= CLOSED_TOLERANCE)
            decided[design[~(joins | is_out_of_reach(coalescence))]] = False
            z, design = np.repeat(z[:, joins], 2, axis=1), np.repeat(design[joins], 2)
            z[block.unknowns] = both[:, joins].transpose(2, 1, 0).reshape(slice_length(block.unknowns), -1)
        elif slice_length(block.unknowns):
            for _ in range(1 + POLISHING_STEPS):
                residuals, jacobian = functions.block_call(block).evaluate_batch(len(design), z.T, inputs, numbers)
                z[block.unknowns] -= solve_vectors(jacobian.transpose(0, 2, 1), residuals[:, 0]).T
            decided[design[~(np.abs(residuals[:, 0]).max(axis=1) <= CLOSED_TOLERANCE)]] = False
    kept = decided[design]
    return design[kept], z[:, kept], decided


def _is_linear_block(reference: ReferenceDesign, block: Block) -> bool:
    """Whether a block has one assembly, by linear equations; it may have others where that is not known."""
    if not slice_length(block.rows):
        return True
    try:
        return is_linear(reference.solver, block, reference.solver.find_assembly().z)
    except NoAnswer:
        return False
