"""The equations against the pairs' own residuals, and the graph's groups against known structures."""

from pathlib import Path

import casadi as ca
import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import structural_rank

from planar.document import files
from planar.equations.block_decomposition import decompose_blocks
from planar.equations.coordinates import frames_from_coordinates
from planar.equations.functions import equation_functions
from planar.equations.mechanism_numbers import equation_structure, pair_numbers
from planar.equations.mechanism_numbers import shapes_of_links as shapes_of
from planar.equations.symbolic_equations import build_equations, slice_length
from planar.model.link_graph import link_pair_graph, unconnected_links
from planar.model.pairs import MeasureKind
from tests.linkages import random_linkage


@given(st.lists(st.sets(st.integers(0, 11), max_size=4), max_size=14))
def test_groups_take_every_row_and_column_once_and_can_be_solved_in_order(rows):
    groups = decompose_blocks(rows, 12)
    assert sorted(row for group in groups for row in group.rows) == list(range(len(rows)))
    assert sorted(column for group in groups for column in group.columns) == list(range(12))
    known: set[int] = set()
    for group in groups:
        known |= set(group.columns)
        if not group.is_free:
            assert all(rows[row] <= known for row in group.rows)
            assert len(group.rows) >= len(group.columns)


@given(st.lists(st.sets(st.integers(0, 9), max_size=3), max_size=12))
def test_freedom_left_by_the_groups_is_what_the_structural_rank_says(rows):
    dense = np.zeros((len(rows) + 1, 10))
    for index, held in enumerate(rows):
        dense[index, list(held)] = 1
    rank = structural_rank(csr_matrix(dense))
    groups = decompose_blocks(rows, 10)
    missing = sum(max(0, len(group.columns) - len(group.rows)) for group in groups if group.is_free)
    surplus = sum(max(0, len(group.rows) - len(group.columns)) for group in groups)
    assert missing == 10 - rank
    assert surplus == len(rows) - rank


def test_two_links_may_share_two_pairs_and_a_detached_link_is_found():
    value = {
        "planar": 1,
        "frame": "a",
        "links": {n: {"points": {"P": [0, 0], "Q": [1, 0], "R": [0, 1]}} for n in ("a", "b", "c")},
        "pairs": [{"turning": "P", "links": ["a", "b"]}, {"turning": "Q", "links": ["a", "b"]}],
    }
    mechanism = files.from_dict(value)
    graph = nx.Graph(link_pair_graph(mechanism))
    assert graph.number_of_edges() == 4
    assert nx.is_bipartite(graph)
    assert unconnected_links(mechanism) == ("c",)


@pytest.mark.parametrize("seed", range(24))
def test_eliminated_coordinates_close_their_pairs_wherever_the_remaining_unknowns_are(seed):
    """All that the pairs leave open at a random place is F: no constraint is lost or bent by the elimination."""
    mechanism = files.from_dict(random_linkage(seed, 1 + seed % 12).value)
    equations = build_equations(equation_structure(mechanism))
    rng = np.random.default_rng(seed)
    shapes = shapes_of(mechanism)
    p = pair_numbers(mechanism, shapes, 1.0)
    z, u = rng.uniform(-2, 2, equations.z.numel()), rng.uniform(-2, 2, equations.u.numel())
    function = ca.Function("both", [equations.z, equations.u, equations.p], [equations.F, equations.w])
    left, w = (each.full().ravel() for each in function(z, u, p))
    columns = {(c.owner, c.part): index for index, c in enumerate(equations.coordinates)}
    pairs = {pair.name: pair for pair in mechanism.pairs}
    frames, own = frames_from_coordinates(w, columns, {link.name: None for link in mechanism.links}, pairs)
    opened = []
    for pair in mechanism.pairs:
        ends = [frames[link] for link in pair.bodies]
        measured = pair.measure([shapes[link] for link in pair.bodies])
        residual = pair.residual(ends, measured, own[pair.name])
        opened += [
            wrapped(x) if kind is MeasureKind.ANGLE else x
            for kind, x in zip(pair.residual_kinds, residual, strict=True)
        ]
    for given_input, position in zip(mechanism.inputs, u, strict=True):
        pair = pairs[given_input.pair]
        ends = [frames[link] for link in pair.bodies]
        gap = pair.input_position(ends, (), own[pair.name]) - position
        opened.append(wrapped(gap) if pair.input_kind is MeasureKind.ANGLE else gap)
    opened = np.array([value for value in opened if abs(value) > 1e-12])
    left = np.array([value for value in left if abs(value) > 1e-12])
    # every constraint that stays open is one of F's, with its value up to the sign and the mix of its own pair
    assert len(opened) == len(left)
    np.testing.assert_allclose(np.sort(np.abs(opened)), np.sort(np.abs(left)), atol=1e-12)


def wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


@pytest.mark.parametrize(
    ("model", "unknowns_of_groups"),
    [
        ("four-bar", [2]),
        ("slider-crank", [2]),
        ("single-link", []),
        ("open-arm", []),
        ("watt-six-bar", [2, 2]),
        ("stephenson-3-five-bar", [4]),
        ("double-butterfly", [6]),
        ("single-flier", [6]),
        ("double-flier", [6]),
        ("ten-link", [8]),
        ("000-P2", [2, 2]),
        ("002-E3.4", [2, 2, 2]),
    ],
)
def test_groups_are_as_small_as_the_structure_allows(model, unknowns_of_groups):
    """Dyads leave two unknowns, a triad four, and links x and y never remain."""
    stages = equation_functions(files.load(model)).equations.blocks
    assert [slice_length(stage.unknowns) for stage in stages if slice_length(stage.unknowns)] == unknowns_of_groups
    assert all(slice_length(stage.unknowns) == slice_length(stage.rows) for stage in stages)


IDLE = Path(__file__).parents[1] / "data" / "idle-slide.json"


@pytest.mark.parametrize("seed", [None, *range(1000, 1040, 3)])
def test_a_group_and_a_place_stand_in_no_unknown_that_does_not_move_them(seed):
    mechanism = files.load(IDLE) if seed is None else files.from_dict(random_linkage(seed, 7, 0.0, 0.3).value)
    e = build_equations(equation_structure(mechanism))
    for stage in e.blocks if not any(stage.is_free for stage in e.blocks) else ():
        _, columns = ca.jacobian_sparsity(e.F[stage.rows], e.z).get_triplet()
        assert max(columns, default=-1) < stage.unknowns.stop
    both, rng = ca.vertcat(e.F, e.w), np.random.default_rng(1)
    slope = ca.Function("slope", [e.z, e.u, e.p], [ca.jacobian(both, e.z)])
    places = [[rng.uniform(0.5, 2.0, each.numel()) for each in (e.z, e.u, e.p)] for _ in range(2)]
    assert np.all(sum(np.abs(np.array(slope(*place).nonzeros())) for place in places) > 1e-12)


def test_mechanisms_that_differ_in_dimensions_share_one_program():
    value = files.to_dict(files.load("four-bar"))
    longer = value | {"links": value["links"] | {"AB": {"ends": ["A", "B"], "length": 45}}}
    assert equation_functions(files.from_dict(value)) is equation_functions(files.from_dict(longer))
