"""Kinematic chains: their numbers against what is published and against brute force, their numbering and symmetry."""

import pickle
from itertools import combinations, permutations
from random import Random

import networkx as nx
import pytest

import planar
from planar.structures.canonical_form import greatest_numberings
from planar.structures.contracted_graphs import contracted_graphs, has_cut_vertex
from planar.structures.rigid_parts import has_rigid_part
from tests.draws import first_cases

PUBLISHED = {(4, 1): 1, (6, 1): 2, (8, 1): 16, (10, 1): 230, (7, 2): 4, (8, 3): 7}
"""By links and freedom. Of freedom 1: T. Mruthyunjaya, Mechanism and Machine Theory 38, 2003; E. Butcher, C. Hartman,
the same, 40, 2005. Of two and three, fractionated ones among them: E. Tuttle, the same, 31, 1996."""
NOT_FRACTIONATED = {(7, 2): 3, (8, 3): 5}
"""Tuttle."""
INVERSIONS = {4: 1, 6: 5, 8: 71}
"""Of all chains of so many links and freedom 1, Mruthyunjaya."""


@pytest.mark.parametrize("links, freedom", PUBLISHED)
def test_there_are_as_many_chains_as_published(links, freedom):
    assert len(planar.chains(links, freedom)) == PUBLISHED[links, freedom]


@pytest.mark.parametrize("links, freedom", NOT_FRACTIONATED)
def test_without_fractionated_ones_too_and_these_come_last(links, freedom):
    whole, alone = planar.chains(links, freedom), planar.chains(links, freedom, fractionated=False)
    assert len(alone) == NOT_FRACTIONATED[links, freedom]
    assert [each.is_fractionated for each in whole] == [False] * len(alone) + [True] * (len(whole) - len(alone))
    assert tuple(alone) == whole[: len(alone)]


@pytest.mark.parametrize("links", INVERSIONS)
def test_there_are_as_many_inversions_as_published(links):
    assert sum(len(chain.inversions) for chain in planar.chains(links)) == INVERSIONS[links]


def has_movable_parts(graph, joints):
    """Whether every part has freedom 1 or more: by all sets of links, one after the other."""
    for count in range(2, graph.number_of_nodes() + 1):
        for part in combinations(graph, count):
            if 3 * (count - 1) - 2 * graph.subgraph(part).number_of_edges() < 1:
                return False
    return graph.number_of_edges() == joints


def told_apart(graph):
    """What graphs of one kind share: of each link its joints, and how far the others are."""
    far = dict(nx.all_pairs_shortest_path_length(graph))
    return tuple(sorted((graph.degree[each], *sorted(far[each].values())) for each in graph))


def brute_force(links, joints):
    """All chains, from every set of joints whose links are numbered by falling degree, up to isomorphism."""
    found = {}

    def extend(graph, left, rest):
        if not rest:
            if left == 0 and min(dict(graph.degree).values()) > 1 and nx.is_connected(graph):
                degrees = [graph.degree[each] for each in range(links)]
                if degrees == sorted(degrees, reverse=True) and has_movable_parts(graph, joints):
                    known = found.setdefault(told_apart(graph), [])
                    if not any(nx.is_isomorphic(graph, other) for other in known):
                        known.append(graph.copy())
            return
        (a, b), others = rest[0], rest[1:]
        # what is behind in the list of all pairs gives no more joints to links before a
        if a > 0 and graph.degree[a - 1] < 2:
            return
        if left and not set(graph[a]) & set(graph[b]):  # three links with three pins are rigid
            graph.add_edge(a, b)
            extend(graph, left - 1, others)
            graph.remove_edge(a, b)
        if len(others) >= left:
            extend(graph, left, others)

    empty = nx.empty_graph(links)
    extend(empty, joints, list(combinations(range(links), 2)))
    return [graph for known in found.values() for graph in known]


@pytest.mark.parametrize("links, freedom", first_cases([(4, 1), (5, 2), (6, 1), (6, 3), (7, 2)], 4))
def test_brute_force_finds_the_same_chains(links, freedom):
    """Naively, with the isomorphisms of another library."""
    found = planar.chains(links, freedom)
    others = brute_force(links, (3 * (links - 1) - freedom) // 2)
    assert len(others) == len(found)
    assert sorted(found.number_of(chain_of_graph(graph, freedom)) for graph in others) == [*range(len(found))]


def chain_of_graph(graph, freedom):
    joints = tuple(sorted((min(edge), max(edge)) for edge in graph.edges))
    return planar.Chain(graph.number_of_nodes(), freedom, joints)


@pytest.mark.parametrize("links, freedom", [(8, 1), (8, 3), (9, 2), (10, 1)])
def test_no_two_chains_are_isomorphic_and_each_is_one(links, freedom):
    kinds = {}
    for chain in planar.chains(links, freedom):
        graph = nx.Graph(chain.edges)
        assert len(chain.edges) == (3 * (links - 1) - freedom) / 2
        assert min(chain.degrees) > 1 and nx.is_connected(graph)
        assert not has_rigid_part(links, chain.edges)
        assert chain.is_fractionated == (not nx.is_biconnected(graph))
        key = told_apart(graph)
        assert not any(nx.is_isomorphic(graph, other) for other in kinds.get(key, ()))
        kinds.setdefault(key, []).append(graph)


@pytest.mark.parametrize("links, freedom", [(4, 1), (7, 2), (8, 1), (8, 3), (10, 1)])
def test_a_chain_is_known_again_whatever_its_links_are_called(links, freedom):
    random, found = Random(3), planar.chains(links, freedom)
    for chain in found:
        names = random.sample(range(links), links)
        joints = [(names[a], names[b]) for a, b in chain.edges]
        random.shuffle(joints)
        again = planar.Chain(links, freedom, tuple(joints))
        assert found.index(again) == chain.number
        assert again in found


def test_symmetry_is_that_of_all_exchanges():
    for chain in planar.chains(6):
        joints = {*chain.edges}
        group = [
            each
            for each in permutations(range(6))
            if {(min(each[a], each[b]), max(each[a], each[b])) for a, b in joints} == joints
        ]
        assert chain.symmetry.order == len(group)
        assert chain.symmetry.link_orbits == tuple(sorted({tuple(sorted({e[k] for e in group})) for k in range(6)}))
    orders = [chain.symmetry.order for chain in planar.chains(8)]
    matchers = [nx.Graph(chain.edges) for chain in planar.chains(8)]
    assert orders == [len(list(nx.isomorphism.GraphMatcher(g, g).isomorphisms_iter())) for g in matchers]


def test_mechanisms_differ_and_are_all_there():
    """Against all choices, told apart by isomorphisms that keep the frame and the driven joint."""
    for chain in planar.chains(8)[:3]:
        graphs = []
        for frame in range(8):
            for joint in chain.edges:
                if frame in joint:
                    graph = nx.Graph(chain.edges)
                    nx.set_node_attributes(graph, {each: each == frame for each in graph}, "fixed")
                    nx.set_edge_attributes(graph, {edge: edge == joint for edge in chain.edges}, "driven")
                    if not any(
                        nx.is_isomorphic(
                            graph,
                            other,
                            nx.isomorphism.categorical_node_match("fixed", False),
                            nx.isomorphism.categorical_edge_match("driven", False),
                        )
                        for other in graphs
                    ):
                        graphs.append(graph)
        assert len(chain.mechanisms()) == len(graphs)


def test_six_bars_have_their_names_and_groups():
    told = {each.name for chain in planar.chains(6) for each in chain.mechanisms()}
    assert told == {
        f"{who} six-bar" for who in ("Watt I", "Watt II", "Stephenson I", "Stephenson II", "Stephenson III")
    }
    watt, stephenson = planar.chains(6)
    assert (watt.name, stephenson.name) == ("Watt chain", "Stephenson chain")
    assert {group.assur_class for each in watt.mechanisms() for group in each.groups} == {"II"}
    by_frame = {
        (each.name, each.drives): [group.assur_class for group in each.groups] for each in stephenson.mechanisms()
    }
    assert ["IV"] in by_frame.values() and ["III"] in by_frame.values()


def test_groups_are_placed_by_those_before_them():
    """Each has two joints for three links' motions, with itself and with what stands already."""
    for chain in planar.chains(8):
        for each in chain.mechanisms():
            (joint,) = each.drives
            placed = {*chain.edges[joint]}
            for group in each.groups:
                own = {*group.links}
                joints = [edge for edge in chain.edges if own & {*edge} and {*edge} <= own | placed]
                assert 2 * len(joints) == 3 * len(own)
                placed |= own
            assert placed == {*range(8)}


def test_several_drives_do_not_drive_the_same():
    (parted,) = [chain for chain in planar.chains(7, 2) if chain.is_fractionated]
    loops = [{0, 1, 2, 3}, {0, 4, 5, 6}]
    for each in parted.mechanisms(moving_drives=True):
        driven = [{*parted.edges[joint]} for joint in each.drives]
        assert all(sum(pair <= loop for pair in driven) == 1 for loop in loops)


def test_contracted_graphs_are_those_of_brute_force():
    """Connected multigraphs of three independent loops, as numbers of edges between vertices of degree 3 and more."""
    words = set()
    for size in (1, 2, 3, 4):
        cells = [(i, j) for i in range(size) for j in range(i, size)]
        for counts in compositions(size + 2, len(cells)):
            rows = [[0] * size for _ in range(size)]
            for (i, j), count in zip(cells, counts, strict=True):
                rows[i][j] = rows[j][i] = count
            table = tuple(map(tuple, rows))
            degrees = [sum(row) + row[k] for k, row in enumerate(rows)]
            graph = nx.Graph([(i, j) for i, j in cells if rows[i][j]])
            if min(degrees) > 2 and len(graph) == size and nx.is_connected(graph):
                words.add((has_cut_vertex(table), greatest_numberings(table, degrees)[0]))
    assert {(has_cut_vertex(each.counts), each.word) for each in contracted_graphs(3, True)} == words
    assert {each.word for each in contracted_graphs(3, False)} == {word for parted, word in words if not parted}


def compositions(total, parts):
    if parts == 1:
        yield (total,)
        return
    for first in range(total + 1):
        for rest in compositions(total - first, parts - 1):
            yield (first, *rest)


def test_the_list_is_made_as_it_is_read():
    found = planar.chains(14)
    assert found[2].number == 2
    assert len(found._rows) == 1
    assert pickle.loads(pickle.dumps(found))[2] == found[2]
    assert planar.chains(8)[-1].number == 15
    with pytest.raises(IndexError, match="16 kinematic chains"):
        planar.chains(8)[16]


@pytest.mark.parametrize(
    "asked, said",
    [((7, 1), "an even freedom"), ((8, 2), "an odd freedom"), ((6, 5), "8 links at least"), ((3, 1), "from 4 on")],
)
def test_what_cannot_be_is_bad_input(asked, said):
    with pytest.raises(planar.BadInput, match=said):
        planar.chains(*asked)


def test_crossings_are_needed_where_a_library_says_so():
    assert [sum(not chain.is_planar for chain in planar.chains(n)) for n in (6, 8, 10)] == [0, 0, 11]
