"""The assembly nearest to the sketch of every design, found for all designs at once."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planar.batch.assembly.assembly_scores import DesignAssemblies
from planar.batch.assembly.assembly_search import AssemblySearch
from planar.batch.assembly.nearest_assemblies import find_nearest_assemblies
from planar.batch.closed_form.start_assemblies import find_start_assemblies
from planar.batch.reference_design import ReferenceDesign, shape_of_designs
from planar.model.link_shapes import LinkShape

Array = np.ndarray

MAX_ALONE = 12
"""Designs that are not clear: so few are solved by themselves sooner than they are searched for."""


def given_assemblies(z: Array) -> DesignAssemblies:
    """Assemblies that are told: unknowns (unknowns, designs), not numbers where there is none."""
    return DesignAssemblies(z, np.isfinite(z).all(axis=0), np.full(z.shape[1], -1))


def find_assemblies(
    reference: ReferenceDesign,
    shapes: Mapping[str, LinkShape],
    p: Array,
    u: Array,
) -> DesignAssemblies:
    """The assemblies at inputs u (inputs, designs), of designs with numbers p (numbers, designs) and these shapes."""
    with np.errstate(all="ignore"):  # starts that lead nowhere end as what is no number
        every = _find_without_search(reference, shapes, p, u)
        if every is None:
            return AssemblySearch(reference, shapes, p, u).search()
        rest = np.flatnonzero(~every.is_sure & (every.failed_block < 0))
        if rest.size > (0 if every.signs is None else MAX_ALONE):
            own = {name: shape_of_designs(shape, rest) for name, shape in shapes.items()}
            found = AssemblySearch(reference, own, p[:, rest], u[:, rest]).search()
            every.z[:, rest], every.is_sure[rest], every.failed_block[rest] = found[:3]
            if every.signs is not None:
                every.signs[:, rest] = 0.0
        return every


def _find_without_search(
    reference: ReferenceDesign,
    shapes: Mapping[str, LinkShape],
    p: Array,
    u: Array,
) -> DesignAssemblies | None:
    """Those by closed forms, else those near the base's own; None where neither can be."""
    start = find_start_assemblies(reference, shapes, p, u)
    if start is not None:
        return start
    near = find_nearest_assemblies(reference, shapes, p, u)
    return None if near is None else DesignAssemblies(near.z, near.is_clear, np.full(len(near.is_clear), -1))
