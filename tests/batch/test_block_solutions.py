"""All assemblies of larger blocks, of many designs at once."""

import numpy as np
import pytest

import planar
from planar.assemblies.block_roots import block_roots
from planar.batch.assembly.complete_lists import BlockListing
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.initial_assembly import find_assemblies
from planar.batch.reference_design import reference_design
from planar.document.dimensions import link_lengths
from planar.foundation.angles import distances
from planar.solving.assembly.nearest_assembly import AssemblySearchFailure
from planar.solving.position import PositionSolver
from tests.linkages import random_linkage

CASES = {"stephenson-3-five-bar": "stephenson-3-five-bar", "double-butterfly": "double-butterfly", "0": 0, "19": 19}
"""Models, and random linkages, whose first block has four unknowns or six."""


def mechanism_of(case):
    return planar.load(case) if isinstance(case, str) else planar.from_dict(random_linkage(case, 6).value)


def drawn(mechanism, spread, many):
    """Lengths of designs about a mechanism's own; its reference design, its designs' rows."""
    rng, common = np.random.default_rng(1), reference_design(mechanism, mechanism.inputs[0].pair)
    values = {
        each.name: each.value * (1.0 + spread * rng.uniform(-1.0, 1.0, many))
        for each in link_lengths(mechanism, frozenset(link.name for link in mechanism.links))
        if each.value
    }
    rows = common.design_rows(values, many)
    return values, common, rows


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_wide_designs_have_the_assemblies_of_the_complete_list(case):
    mechanism = mechanism_of(case)
    values, common, rows = drawn(mechanism, 0.3, 4)
    p = rows.p
    block = common.functions.equations.blocks[0]
    z = np.zeros((len(common.functions.equations.unknowns), 4))
    found = BlockListing(common, block).assemblies({"p": p, "u": rows.u, "z": z})
    assert found.is_complete[np.isfinite(p).all(axis=0)].mean() > 0.8
    for index in np.flatnonzero(found.is_complete):
        design = PositionSolver(with_design_values(common.mechanism, values_of_design(values, index)))
        whole = block_roots(design, block, z[:, 0], certify=False)
        assert whole.expected == found.exists.shape[1]
        angle = common.functions.equations.unknown_is_angle[block.unknowns]
        own = found.unknowns[:, index, found.exists[index]].T * np.where(angle, 1.0, common.unit / design.unit)
        apart = distances(angle, own[:, None], whole.real).max(axis=2)
        assert apart.shape[0] == apart.shape[1]
        assert np.all(apart.min(axis=0, initial=1.0) < 1e-7)


def test_of_all_assemblies_the_nearest_is_taken_and_none_where_none_is():
    mechanism = planar.load("stephenson-3-five-bar")
    values, common, rows = drawn(mechanism, 0.4, 24)
    found = find_assemblies(common, rows)
    refused = found.failed_block == 0
    assert np.all(found.is_sure | refused | ~np.isfinite(rows.p).all(axis=0))
    assert np.any(refused)
    for index in [*np.flatnonzero(refused)[:2], *np.flatnonzero(found.is_sure)[:4]]:
        nearest = PositionSolver(with_design_values(common.mechanism, values_of_design(values, index))).nearest()
        assert isinstance(nearest, AssemblySearchFailure) == refused[index]
        if not refused[index]:
            angle = common.functions.equations.unknown_is_angle
            assert distances(angle, nearest.z, found.z[:, index]).max() < 1e-6


def test_wide_designs_run_as_the_cycle():
    mechanism = planar.load("stephenson-3-five-bar")
    values, *_ = drawn(mechanism, 0.15, 4)
    start = mechanism.inputs[0].position
    swept = planar.sweep(mechanism, values, 6, start=start, stop=start + 0.4)
    assert swept.general == 0
    for index in range(4):
        design = with_design_values(mechanism, values_of_design(values, index))
        motion = planar.cycle(design, 6, start, start + 0.4)
        assert len(motion) == 7
        for point in swept.points:
            np.testing.assert_allclose(
                swept.acceleration[point][index], motion.point(point).acceleration, rtol=1e-7, atol=1e-9
            )
