"""Chains whose pins hold several links: their numbers by brute force, their groups, linkages of them, and pictures."""

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
from planar.structures.multiple_pins import link_pairs
from tests.command import run
from tests.draws import first_cases, part


def incidence(links, pins) -> nx.Graph:
    """Links and pins as vertices of two kinds."""
    graph = nx.Graph()
    graph.add_nodes_from(range(links), kind="link")
    graph.add_nodes_from((("pin", k) for k in range(len(pins))), kind="pin")
    graph.add_edges_from((link, ("pin", k)) for k, pin in enumerate(pins) for link in pin)
    return graph


def has_movable_parts(links, pins) -> bool:
    """Whether any set of links has by count freedom 1 or more, each pin counting by those of its links."""
    for count in range(2, links + 1):
        for chosen in map(set, combinations(range(links), count)):
            if 3 * (count - 1) - 2 * sum(max(0, len(chosen & {*pin}) - 1) for pin in pins) < 1:
                return False
    return True


def brute_force(links, freedom, extra) -> int:
    """How many chains there are: all ways to hold links by pins of three and four, from one link on, up to isomorphism.

    Pins are put together two by two, in every order and of any chain with as many joints, whether they share a link
    with enough joints or none at all; what then has another freedom, or parts that do not move, falls out.
    """
    known: list[nx.Graph] = [incidence(links, chain.edges) for chain in planar.chains(links, freedom)]
    pins_of = [[*chain.edges] for chain in planar.chains(links, freedom)]
    for _ in range(extra):
        known, following = [], []
        for pins in pins_of:
            for one, other in combinations(pins, 2):
                if not {*one} & {*other}:
                    continue
                merged = [pin for pin in pins if pin not in (one, other)] + [tuple(sorted({*one, *other}))]
                degrees = [sum(link in pin for pin in merged) for link in range(links)]
                if min(degrees) < 2 or not has_movable_parts(links, merged):
                    continue
                graph = incidence(links, merged)
                if not any(nx.is_isomorphic(graph, each, node_match=lambda a, b: a == b) for each in known):
                    known.append(graph)
                    following.append(merged)
        pins_of = following
    return len(known)


@pytest.mark.parametrize(
    ("links", "freedom", "extra"),
    first_cases([(4, 1, 1), (6, 1, 1), (6, 1, 2), (6, 1, 3), (5, 2, 1), (7, 2, 1), (7, 2, 2), (8, 1, 1)], 6),
)
def test_there_are_as_many_as_by_brute_force(links, freedom, extra):
    found = planar.chains(links, freedom, multiple_pins=extra)
    assert len(found) == brute_force(links, freedom, extra)
    for chain in found:
        assert sum(len(pin) - 2 for pin in chain.pins) == extra
        assert chain.freedom == 3 * (links - 1) - 2 * chain.joints == freedom


def test_numbers_are_the_same_whatever_links_are_called():
    random = Random(5)
    found = planar.chains(8, multiple_pins=2)
    for number, chain in enumerate(found):
        order = random.sample(range(8), 8)
        pins = tuple(sorted(tuple(sorted(order[link] for link in pin)) for pin in chain.pins))
        assert found.number_of(Chain(8, 1, link_pairs(pins), pins=pins)) == number == chain.number
        assert found[number] == chain
    assert pickle.loads(pickle.dumps(found))[3] == found[3]
    assert planar.chains(8).number_of(found[0]) is None


def test_of_six_links_there_are_one_with_a_pin_of_three_and_one_with_two():
    (one,), (two,) = (planar.chains(6, multiple_pins=extra) for extra in (1, 2))
    assert [sorted(map(len, each.pins)) for each in (one, two)] == [[2, 2, 2, 2, 2, 3], [2, 2, 2, 3, 3]]
    assert two.assortment == (6,)
    assert {group.assur_class for each in two.mechanisms() for group in each.groups} == {"II"}


@pytest.fixture
def short_search(monkeypatch):
    """What a search ends with does not matter here, but that it says the truth."""
    monkeypatch.setattr("planar.structures.linkage_search.ROUNDS", 2)
    monkeypatch.setattr("planar.structures.linkage_search.SLIDING_ROUNDS", 1)


CHOICES = part(
    [
        (links, extra, slides, chain.number, frame, drives)
        for links, extra, slides in ((6, 1, 0), (6, 2, 0), (6, 1, 1), (8, 2, 0), (8, 1, 2))
        for chain in part(planar.chains(links, slides=slides, multiple_pins=extra), one_in=1 if links < 8 else 50)
        for frame, drives, _, _ in chain.mechanisms(moving_drives=True)
    ],
    one_in=12,
)


@pytest.mark.parametrize(("links", "extra", "slides", "number", "frame", "drives"), CHOICES)
def test_a_linkage_has_the_pins_of_its_chain_and_goes_together(
    links, extra, slides, number, frame, drives, short_search
):
    chain = planar.chains(links, slides=slides, multiple_pins=extra)[number]
    mechanism = chain.mechanism(frame, drives, seed=1)
    state = planar.solve(mechanism)
    assert state.residual < 1e-12
    assert state.mobility == 1
    held: dict[str, set[str]] = {}
    for pair in mechanism.pairs:
        held.setdefault(pair.name.split(":")[0], set()).update(pair.links)
    own = incidence(
        links, [sorted(map([*(link.name for link in mechanism.links)].index, each)) for each in held.values()]
    )
    wanted = incidence(links, chain.pins)
    for graph, fixed in ((own, [link.name for link in mechanism.links].index("frame")), (wanted, frame)):
        graph.nodes[fixed]["kind"] = "frame"
    assert nx.is_isomorphic(own, wanted, node_match=lambda a, b: a == b)
    known = planar.chain_of(mechanism).pinned_chain
    assert (known, known.number) == (chain, number)
    rates = [each.get("relative_angular_velocity", each.get("velocity")) for each in state.pairs.values()]
    assert np.abs(rates).min() > 1e-6


def test_models_with_such_pins_are_known():
    found = planar.chain_of("toggle-press").pinned_chain
    assert found in planar.chains(6, slides=1, multiple_pins=1)
    assert planar.chain_of("watt-six-bar").pinned_chain is None
    pinned = planar.chain_of("peaucellier-lipkin").pinned_chain
    assert planar.chains(8, multiple_pins=4)[pinned.number] == pinned


def test_the_commands_list_draw_and_make_them(tmp_path):
    said = run(tmp_path, "chains", "6", "--multiple-pins", "1", "--mechanisms").done()
    assert "1 kinematic chain of 6 links with 1 extra link on pins, freedom 1" in said
    assert "1-3-5" in said
    (first,) = json.loads(run(tmp_path, "chains", "6", "--multiple-pins", "2", "--json").done())
    assert sorted(map(len, first["pins"])) == [2, 2, 2, 3, 3]
    run(tmp_path, "chains", "8", "--multiple-pins", "2", "--limit", "3", "-o", "atlas").done()
    run(tmp_path, "generate", "--links", "6", "--multiple-pins", "2", "-o", "a.json").done()
    assert planar.solve(tmp_path / "a.json").residual < 1e-12
    assert "moves" in run(tmp_path, "chains", "4", "--multiple-pins", "1", "-o", "none").refused(2)
