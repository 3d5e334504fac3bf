"""A mechanism as a graph of links and pairs."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations, count
from typing import TYPE_CHECKING, Any, NamedTuple

from planar.model.mechanism import Mechanism, pair_entries, relative_motions
from planar.model.pairs import MeasureKind, Pair

if TYPE_CHECKING:
    import networkx as nx

Node = tuple[str, Any]
"""What a node stands for, a link or a pair, and its name or number."""
Neighbours = dict[Node, dict[Node, None]]
"""A graph: the nodes next to each, in the order of the file. The graph library is slow to load beside small graphs."""
_LINK_NUMBER = re.compile(r"0|[1-9][0-9]{0,3}")
"""A link's name that is its number."""


def link_pair_graph(mechanism: Mechanism) -> Neighbours:
    """Links and pairs, both as nodes ("link", name) and ("pair", name), so that two links may share two pairs.

    A pin of n links is one pair node with n edges.
    """
    edges = (
        (("pair", group[0].entry_name()), ("link", link))
        for group in pair_entries(mechanism)
        for pair in group
        for link in pair.links
    )
    return _neighbours((("link", link.name) for link in mechanism.links), edges)


def unconnected_links(mechanism: Mechanism) -> tuple[str, ...]:
    """Links that no chain of pairs joins to the frame."""
    joined = _distances(link_pair_graph(mechanism), ("link", mechanism.frame))
    return tuple(link.name for link in mechanism.links if ("link", link.name) not in joined)


def pairs_farthest_first(mechanism: Mechanism, name: str) -> tuple[str, ...]:
    """The other pairs, those first that are most links and pairs away from this one."""
    entry_of = {pair.name: pair.entry_name() for pair in mechanism.pairs}
    away = _distances(link_pair_graph(mechanism), ("pair", entry_of[name]))
    others = [other for other in entry_of if other != name]
    return tuple(sorted(others, key=lambda other: -away.get(("pair", entry_of[other]), 0)))


def _neighbours(nodes: Iterable[Node], edges: Iterable[tuple[Node, Node]]) -> Neighbours:
    """The graph of some nodes and edges, and of the nodes that edges join."""
    found: Neighbours = {node: {} for node in nodes}
    for one, other in edges:
        found.setdefault(one, {})[other] = None
        found.setdefault(other, {})[one] = None
    return found


def _distances(graph: Neighbours, start: Node) -> dict[Node, int]:
    """How many edges away every node is that can be reached, this one first."""
    found, waiting = {start: 0}, deque([start])
    while waiting:
        node = waiting.popleft()
        for other in graph[node]:
            if other not in found:
                found[other] = found[node] + 1
                waiting.append(other)
    return found


class JointDiagram(NamedTuple):
    """A chain by its joints alone: of each its kind and the links that meet in it; the fixed link where it matters."""

    joints: tuple[tuple[MeasureKind, tuple[str, ...]], ...]
    frame: str | None = None


class JointIsomorphism(NamedTuple):
    """Which link, and which joint by its index, of a second figure stands for each of a first one."""

    links: Mapping[str, str]
    joints: Mapping[int, int]


def isomorphisms(first: JointDiagram, second: JointDiagram) -> Iterator[JointIsomorphism]:
    """Every way in which two figures are the same but for names: joint for joint of one kind, frame for frame."""
    if len(first.joints) != len(second.joints):
        return
    marks = (
        sorted((len(beside), _mark(figure, node)) for node, beside in _joint_graph(figure).items())
        for figure in (first, second)
    )
    if next(marks) != next(marks):
        return
    from networkx.algorithms.isomorphism import GraphMatcher

    matcher = GraphMatcher(
        _labelled_graph(first), _labelled_graph(second), node_match=lambda one, other: one["mark"] == other["mark"]
    )
    for found in matcher.isomorphisms_iter():
        links = {name: found[what, name][1] for what, name in found if what == "link"}
        yield JointIsomorphism(links, {index: found[what, index][1] for what, index in found if what == "pair"})


def _joint_graph(figure: JointDiagram) -> Neighbours:
    """The joints, ("pair", index), and the links that meet in them."""
    joints = [(("pair", index), links) for index, (_, links) in enumerate(figure.joints)]
    return _neighbours(
        (node for node, _ in joints), ((node, ("link", link)) for node, links in joints for link in links)
    )


def _mark(figure: JointDiagram, node: Node) -> str:
    """The kind of a joint, or whether a link is the frame."""
    what, name = node
    if what == "link":
        return "frame" if name == figure.frame else "link"
    return figure.joints[name][0].value


def _labelled_graph(figure: JointDiagram) -> nx.Graph:
    import networkx as nx

    graph = nx.Graph()
    for index, (_, links) in enumerate(figure.joints):
        for node in (("pair", index), *(("link", link) for link in links)):
            graph.add_node(node, mark=_mark(figure, node))
            if node[0] == "link":
                graph.add_edge(("pair", index), node)
    return graph


def are_connected(figure: JointDiagram, links: Sequence[str]) -> bool:
    """Whether each of these links is joined to all the others."""
    graph = _joint_graph(figure)
    reached = _distances(graph, next(iter(graph))) if graph else {}
    return bool(graph) and len(reached) == len(graph) and all(("link", link) in graph for link in links)


def independent_loop_count(figure: JointDiagram) -> int:
    """How many independent loops the links make."""
    graph = _joint_graph(figure)
    edges, components, left = sum(map(len, graph.values())) // 2, 0, dict(graph)
    while left:
        components += 1
        for node in _distances(graph, next(iter(left))):
            del left[node]
    return edges - len(graph) + components


def pin_pair_trees(links: Sequence[str]) -> tuple[tuple[tuple[str, str], ...], ...]:
    """Every choice of n - 1 pairs that a pin of n links may stand for."""
    choices = combinations(tuple(combinations(links, 2)), len(links) - 1)
    return tuple(pairs for pairs in choices if len({*sum(pairs, ())}) == len(links) and _is_connected(pairs))


def _is_connected(pairs: Sequence[tuple[str, str]]) -> bool:
    """Whether edges join all that they join to one another."""
    graph = _neighbours((), ((("link", one), ("link", other)) for one, other in pairs))
    return not graph or len(_distances(graph, next(iter(graph)))) == len(graph)


def link_numbers(mechanism: Mechanism) -> dict[str, str]:
    """The number of each link, in the order of the numbers.

    A link whose name is a number has that number. The others have the numbers that are left, in the manner of
    textbooks: 1 drives, 2 is joined to it and so on; the frame is last, or with the mechanism's `frame_number` "first"
    it is 1 and 2 drives. Breadth first over the moving links, links
    alike in that in the order of the file. What drives is the link that the first input moves: on the frame the other
    one, else the second; without inputs it is the file's first.
    """
    place = {link.name: index for index, link in enumerate(mechanism.links) if link.name != mechanism.frame}
    beside: dict[str, set[str]] = {link: set() for link in place}
    for group in pair_entries(mechanism):
        meeting = _links_of_entry(group, place)
        for link in meeting:
            beside[link].update(meeting)
    named = relative_motions(mechanism)
    driven = [link for given in mechanism.inputs[:1] for link in reversed(named[given.pair].links) if link in place]
    order: dict[str, None] = {}
    for start in (*driven[:1], *place):
        waiting = deque([start])
        while waiting:
            link = waiting.popleft()
            if link not in order:
                order[link] = None
                waiting += sorted(beside[link], key=place.__getitem__)
    links = (mechanism.frame, *order) if mechanism.frame_number == "first" else (*order, mechanism.frame)
    own = {link for link in links if _LINK_NUMBER.fullmatch(link)}
    free = (str(number) for number in count(1) if str(number) not in own)
    numbers = {link: link if link in own else next(free) for link in links}
    return dict(sorted(numbers.items(), key=lambda item: int(item[1])))


def frame_number_problem(mechanism: Mechanism) -> str:
    """Why the frame cannot be the first link, although the mechanism says so; empty where it is, or is to be last."""
    if mechanism.frame_number != "first":
        return ""
    first = next(iter(link_numbers(mechanism)))
    if first == mechanism.frame:
        return ""
    return (
        f"the frame {mechanism.frame!r} cannot be the first link: a link whose name is a number has that number, and "
        f"{first!r} comes before it; rename the links"
    )


def link_label(number: str, link: str) -> str:
    """A link by its number and its name, once where they are the same."""
    return number if number == link else f"{number} {link}"


def number_separator(numbers: Mapping[str, str]) -> str:
    """What stands between the numbers of two links: nothing, or a comma where one of all has two digits."""
    return "," if any(len(number) > 1 for number in numbers.values()) else ""


def pair_labels_by_type(mechanism: Mechanism) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """The pairs of each type as textbooks list them: ("turning", ("O-1", "1-2", "2-3")), ("sliding", ("3-4",)).

    A turning pair on the frame is written with its pin's name in place of the frame's number. A pin of n links
    stands for n - 1 pairs: of the frame, else of its link of the lowest number, with each of the others.
    """
    number = {link: int(text) for link, text in link_numbers(mechanism).items()}
    frame = number[mechanism.frame]
    found: dict[tuple[bool, str, str], list[tuple[tuple[int, int], str]]] = {}
    for group in pair_entries(mechanism):
        pair = group[0]
        hub, *others = sorted(number[link] for link in _links_of_entry(group, number))
        if frame in others:
            hub, others = frame, [hub, *(each for each in others if each != frame)]
        for other in others:
            low, high = sorted((hub, other))
            pinned = hub == frame and pair.is_lower_pair and pair.input_kind is MeasureKind.ANGLE
            key = (other, frame) if hub == frame else (high, low)
            text = f"{pair.entry_name()}-{other}" if pinned else f"{low}-{high}"
            found.setdefault((not pair.is_lower_pair, pair.input_kind.value, pair.keyword), []).append((key, text))
    return tuple((kind[-1], tuple(text for _, text in sorted(found[kind]))) for kind in sorted(found))


def _links_of_entry(group: Sequence[Pair], among: Mapping[str, int]) -> tuple[str, ...]:
    """Those of some links that meet in an entry's pairs."""
    return tuple(dict.fromkeys(link for pair in group for link in pair.links if link in among))
