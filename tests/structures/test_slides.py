"""Chains with sliding pairs: their numbers by another route, their names, linkages made of them, their pictures."""

from __future__ import annotations

import json
import pickle
from itertools import combinations
from random import Random

import networkx as nx
import numpy as np
import pytest

import planar
from planar.structures.chain import Chain
from planar.structures.general_position import GeneralPosition
from planar.structures.linkage_dimensions import Linkage, candidate_places, candidate_ways, linkage_document
from tests.command import run
from tests.draws import first_cases, part


def moves(chain: Chain, slides: tuple[int, ...]) -> bool:
    """Whether every joint of some linkage moves, where one of its joints is driven: by the pairs' own equations."""
    linkages = (Linkage(chain.edges, chain.edges[drive][0], (drive,), slides) for drive in range(chain.joints))
    for linkage in linkages:
        random = np.random.default_rng(5)
        places, ways = candidate_places([linkage], random), candidate_ways(linkage, 1, random)
        try:
            state = planar.solve(planar.from_dict(linkage_document(linkage, places[0], "x", ways[0])))
        except planar.NoAnswer:
            continue
        rates = [each.get("relative_angular_velocity", each.get("velocity")) for each in state.pairs.values()]
        return bool(np.abs(rates).min() > 1e-6)
    return False


def by_linkages(links: int, slides: int) -> int:
    """How many chains of freedom 1 with so many slides there are: by isomorphism, each with a linkage that moves.

    Of the joints of a loop two are pins at least: where links keep their angle, through slides, no pin turns.
    """
    found: list[nx.Graph] = []
    for chain in planar.chains(links):
        whole = nx.Graph(chain.edges)
        loops = [
            {frozenset(ends) for ends in zip(loop, [*loop[1:], loop[0]], strict=True)}
            for loop in nx.simple_cycles(whole)
        ]
        for numbers in combinations(range(chain.joints), slides):
            sliding = {frozenset(chain.edges[k]) for k in numbers}
            if all(len(loop - sliding) > 1 for loop in loops):
                graph = nx.Graph()
                graph.add_edges_from((*ends, {"slides": frozenset(ends) in sliding}) for ends in chain.edges)
                alike = any(nx.is_isomorphic(graph, each, edge_match=lambda a, b: a == b) for each in found)
                if not alike and moves(chain, numbers):
                    found.append(graph)
    return len(found)


@pytest.mark.parametrize(
    ("links", "slides"),
    first_cases([*((4, slides) for slides in range(1, 6)), *((6, slides) for slides in (1, 5, 2, 3, 4))], 7),
)
def test_chains_with_slides_are_as_many_as_those_whose_linkages_move(links, slides):
    found = planar.chains(links, slides=slides)
    assert len(found) == by_linkages(links, slides)
    assert all(len(each.slides) == slides for each in found)


def test_two_bars_between_links_that_keep_their_angle_hold_them():
    """Stephenson's chain slides alone from one ternary link to the other: each loop has two pins, and none turns."""
    path = tuple(k for k, ends in enumerate(planar.chains(6)[1].edges) if {*ends} & {2, 3})
    assert not GeneralPosition(6, planar.chains(6)[1].edges).moves_as_counted(path)
    counted = [len(planar.chains(8, slides=slides)) for slides in range(8)]
    assert counted == [16, 84, 345, 776, 1069, 677, 140, 0]


def test_a_slide_moves_as_its_residual_does():
    """The rank of general position is that of the pairs' own constraints, where a linkage of it stands."""
    for chain in part(planar.chains(6, slides=2), one_in=2):
        mechanism = chain.mechanism(seed=2)
        found = planar.mobility(mechanism)
        assert found.finite == found.instantaneous == chain.freedom
    for slides in [(0, 1, 2), (0, 1, 3, 2)]:  # a loop with one pin, and one with none
        assert not GeneralPosition(4, planar.chains(4)[0].edges).moves_as_counted(slides)


NAMES = {
    "slider-crank": "slider-crank",
    "oscillating-cylinder": "inverted slider-crank",
    "tipper": "inverted slider-crank",
    "elliptical-trammel": "elliptical trammel",
    "scotch-yoke": "Scotch yoke",
    "oldham": "Oldham coupling",
    "rapsons-slide": "Rapson's slide",
    "atkinson-cycle-engine": "Stephenson III six-bar",
}


@pytest.mark.parametrize("model", NAMES)
def test_models_with_slides_have_their_names(model):
    assert planar.chain_of(model).name == NAMES[model]


def test_numbers_are_the_same_whatever_links_are_called():
    random = Random(3)
    for slides in (1, 2, 3):
        found = planar.chains(6, slides=slides)
        for number, chain in enumerate(found):
            assert (chain.number, found[number]) == (number, chain)
            order = random.sample(range(6), 6)
            edges = [tuple(sorted((order[a], order[b]))) for a, b in chain.edges]
            other = Chain(6, 1, tuple(edges), slides=chain.slides)
            assert found.number_of(other) == number
    assert pickle.loads(pickle.dumps(found)).slides == 3
    assert found[0] in found
    assert found[0] not in planar.chains(6)
    assert found[0].pin_chain == planar.chains(6)[0]
    assert planar.chains(6).number_of(found[0]) is None
    assert repr(found[0]) == "<Chain 0 of 6 links with 3 slides, freedom 1, Watt chain>"
    assert repr(found) == "<Chains of 6 links with 3 slides, freedom 1>"


@pytest.fixture
def short_search(monkeypatch):
    """What a search ends with does not matter here, but that it says the truth."""
    monkeypatch.setattr("planar.structures.linkage_search.ROUNDS", 2)
    monkeypatch.setattr("planar.structures.linkage_search.SLIDING_ROUNDS", 1)


CHOICES = part(
    [
        (links, slides, chain.number, frame, drives)
        for links, slides in ((4, 1), (4, 2), (6, 1), (6, 2), (6, 4), (8, 2))
        for chain in part(planar.chains(links, slides=slides), one_in=1 if links < 8 else 50)
        for frame, drives, _, _ in chain.mechanisms()
    ],
    one_in=5,
)


@pytest.mark.parametrize(("links", "slides", "number", "frame", "drives"), CHOICES)
def test_a_linkage_with_slides_is_of_its_chain_goes_together_and_runs_as_its_note_says(
    links, slides, number, frame, drives, short_search
):
    chain = planar.chains(links, slides=slides)[number]
    mechanism = chain.mechanism(frame, drives, seed=1)
    state = planar.solve(mechanism)
    assert state.residual < 1e-12
    assert state.mobility == 1
    found = planar.chain_of(mechanism)
    assert (found.chain, found.chain.number, found.frame, found.drives) == (chain, number, frame, drives)
    (note,) = mechanism.notes
    if "without a limit" in note:
        return
    at = planar.cycle(mechanism, 36, pair=mechanism.inputs[0].pair).inputs[mechanism.inputs[0].pair].position
    if drives[0] in chain.slides:
        low, high = 1e3 * at.min(), 1e3 * at.max()
        assert f"slides from {low:.6g} mm to {high:.6g} mm" in note
    else:
        assert ("drives turns fully." in note) == (np.ptp(at) > 2.0 * np.pi - 1e-9)


def test_other_inversions_of_the_chain_are_told():
    found = planar.chain_of("slider-crank")
    assert found.inversions == {"rod": "inverted slider-crank"}
    assert planar.chain_of("oldham").inversions.keys() == {"cross", "disc 1"}


def test_the_commands_list_draw_and_make_them(tmp_path):
    said = run(tmp_path, "chains", "4", "--slides", "2", "--mechanisms").done()
    assert "2 kinematic chains of 4 links with 2 slides, freedom 1" in said
    assert all(name in said for name in ("elliptical trammel", "Scotch yoke", "Oldham coupling", "Rapson's slide"))
    assert "II: 4" in said  # the class of its mechanisms, beside each chain
    (first, _) = json.loads(run(tmp_path, "chains", "4", "--slides", "2", "--json").done())
    assert (first["slides"], first["pin_number"], first["name"]) == ([0, 1], 0, "double slider-crank chain")
    run(tmp_path, "chains", "4", "--slides", "1", "-o", "atlas").done()
    assert json.loads((tmp_path / "atlas" / "chains.json").read_text())["slides"] == 1
    said = run(tmp_path, "generate", "--links", "4", "--slides", "1", "--frame", "2", "-o", "a.json").done()
    assert said.startswith("inverted slider-crank. The link that")
    assert "some joint of each would not move" in run(tmp_path, "chains", "4", "--slides", "3").done()
    for words in (
        ("chains", "4", "--slides", "3", "-o", "none"),
        ("generate", "--links", "4", "--slides", "3", "-o", "b.json"),
    ):
        assert "moves" in run(tmp_path, *words).refused(2)
    assert "from 0 on is wanted" in run(tmp_path, "chains", "4", "--slides", "-1").refused(2)
