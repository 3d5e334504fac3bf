"""Derivatives over a sweep by machine code: the march of its designs once more, with slopes in place of points."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from planar.batch.design_arrays import split_into_blocks
from planar.batch.gradients.slope_rows import SlopeResults, SlopeRows
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.runs import run_designs
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.aligned_arrays import allocate_aligned
from planar.derivatives.design_equations import design_equations
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import UnsupportedOperation

MAX_NUMBERS = 8
"""Numbers of the file by which one function derives: of more its text grows so long that its code is made briefly."""


def march_slopes(
    reference: ReferenceDesign, march: DesignBatch, results: SlopeResults, values: Mapping[str, Array]
) -> Array | None:
    """The slopes (steps + 1, rows, designs) of designs with these values (designs,) by name that ran so.

    Rows are as `SlopeRows` has them. Not numbers where a design did not come, or where its own numbers have no
    derivatives. None where that cannot be compiled.
    """
    many = march.p.shape[1]
    groups = list(split_into_blocks(len(results.numbers), MAX_NUMBERS))
    out = allocate_aligned(len(march.input_offsets), results.row_count, many)
    for group in groups:
        own = results._replace(numbers=results.numbers[group])
        found = out if len(groups) == 1 else allocate_aligned(len(out), own.row_count, many)
        if not _march_group(slope_rows(reference, own), march, values, found):
            return None
        if found is not out:
            for whole, part in zip(results.split_rows(out), own.split_rows(found), strict=True):
                whole[:, :, group] = part
    return out


@lru_cache(maxsize=64)
def slope_rows(reference: ReferenceDesign, results: SlopeResults) -> SlopeRows:
    """The rows of a mechanism's designs, kept."""
    return SlopeRows(reference, design_equations(reference.mechanism), results)


def _march_group(rows: SlopeRows, march: DesignBatch, values: Mapping[str, Array], out: Array) -> bool:
    """Fill out; whether it could be compiled."""
    many = march.p.shape[1]
    places, numbers = rows.design_numbers(values, many)
    zeros = {each for each in march.zeros if each[0] == "p"}
    zeros |= {("q", k) for k in rows.zero_places if not places[k].any()}
    batch = march._replace(
        q=np.concatenate([places, numbers]),
        links=tuple(link for link, _ in rows.members),
        rates=rows.results.rates,
        zeros=frozenset(zeros),
        stops=None,
        results=rows,
    )
    told = np.zeros(many, dtype=int)
    try:
        run_designs(batch, out, told)
    except UnsupportedOperation:
        return False
    return True
