"""The solutions of a random member of a family: found by loops in the family, tested by a trace, stored on disk.

Members, or slices of one, are the nodes of a graph; along every edge each solution is followed once, those of all edges
side by side. T. Duff, C. Hill, A. Jensen, K. Lee, A. Leykin, J. Sommars, Solving polynomial systems via homotopy
continuation and monodromy, IMA J. Numer. Anal. 39, 2019.

The trace test shows whether the solutions are all. Along a line p + s v of members they are a curve in unknowns and s.
The slice s l(x) = 0 with l linear in the places x meets it at the solutions of the member p and where l vanishes,
nowhere at infinity. Other bilinear slices are reached from there, and where a slice is moved by a constant, the sums of
x and s of all points of an irreducible curve move evenly, and those of some of them do not. A. Leykin, J. I. Rodriguez,
F. Sottile, Trace test, Arnold Math. J. 4, 2018, section 3. Slices have the fewer points the fewer numbers a line moves:
it moves those of one entry, of places without their conjugates, and the solutions of all other rows, a curve, are taken
for irreducible where the family is. Where they are not, all parts have as many of the solutions, and random loops in
all numbers lead from one to another.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from functools import lru_cache
from hashlib import sha256
from itertools import permutations
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np

from planar.assemblies.polynomial.path_tracker import (
    MAX_STEPS,
    Homotopy,
    HomotopyValues,
    PathEnds,
    normalize,
    track_paths,
)
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.private_cache import PrivateCache
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.relations.unknowns import NumberKind
from planar.synthesis.exact.tracking.family_names import FamilyName, name_family
from planar.synthesis.exact.tracking.first_solution import first_solution
from planar.synthesis.exact.tracking.member_homotopy import (
    EdgeHomotopy,
    Images,
    MemberHomotopy,
    affine_solutions,
    exchange_images,
    first_of_same,
    homogeneous_slopes,
    homogeneous_solutions,
    reordered,
    representatives,
    scaled_rows,
)

BLOCK, FEW_PATHS = 4096, 128
"""Paths that are followed side by side, at most, and so few that more of them cost no more time."""
PREDICTION, CORRECTION, STEPS = 3e-2, 1e-4, 600
"""How far predictions and first corrections may be off, and most steps: a path that is lost, or leaps to another, comes
to a solution or to none all the same."""

Node = TypeVar("Node")


class SolutionGraph(Generic[Node]):
    """Nodes and solutions; of solutions that are `images` of each other one stands for all. `between` gives the
    homotopy of paths along edges (paths, 2) between some nodes."""

    def __init__(self, between: Callable[[Sequence[Node], IntArray], Homotopy], images: Images | None):
        self.between, self.images = between, images
        self.nodes: list[Node] = []
        self.solutions: list[ComplexArray] = []
        self.followed: dict[tuple[int, int], BoolArray] = {}
        "which solutions of the first node have been followed to the second, or met from there"
        self.leaves: set[int] = set()
        "nodes that edges do not go to unless asked for"

    @property
    def most(self) -> int:
        """The greatest number of solutions at any node."""
        return max(map(len, self.solutions))

    def add_node(self, node: Node, V: ComplexArray) -> int:
        """A node more, with solutions that are known of it; its number."""
        self.nodes.append(node)
        self.solutions.append(normalize(representatives(V, self.images)))
        return len(self.nodes) - 1

    def add_solutions(self, k: int, V: ComplexArray) -> IntArray:
        """Solutions of a node, known or not; their numbers there."""
        known = len(self.solutions[k])
        both = np.concatenate([self.solutions[k], normalize(representatives(V, self.images))])
        first = first_of_same(both)
        is_kept = first == np.arange(len(both))
        self.solutions[k] = both[is_kept]
        rows: IntArray = (np.cumsum(is_kept) - 1)[first[known:]]
        return rows

    def follow_edge(self, i: int, j: int) -> bool:
        """Follow those solutions of a node to another that have not been; whether all came there."""
        rows = self._open(i, j)
        return not len(rows) or self._follow([(i, j, rows)])

    def follow_open_edges(self) -> bool:
        """Follow what has not been followed along all edges, each in the direction with the more of it, or in both
        where that is few; False where there is none."""
        edges = list(permutations([k for k in range(len(self.nodes)) if k not in self.leaves], 2))
        open_rows = {edge: self._open(*edge) for edge in edges}
        if sum(map(len, open_rows.values())) > FEW_PATHS:
            edges = [max(edge, edge[::-1], key=lambda one: len(open_rows[one])) for edge in edges if edge[0] < edge[1]]
        batch, room = [], BLOCK
        for i, j in edges:
            rows = open_rows[i, j][:room]
            if len(rows):
                batch.append((i, j, rows))
                room -= len(rows)
        if batch:
            self._follow(batch)
        return bool(batch)

    def _open(self, i: int, j: int) -> IntArray:
        return np.flatnonzero(~self._followed(i, j))

    def _followed(self, i: int, j: int) -> BoolArray:
        """Which solutions of a node were followed to another, as many as there are now."""
        done = self.followed.get((i, j), np.zeros(0, dtype=bool))
        done = np.concatenate([done, np.zeros(len(self.solutions[i]) - len(done), dtype=bool)])
        self.followed[i, j] = done
        return done

    def _follow(self, batch: Sequence[tuple[int, int, IntArray]]) -> bool:
        edges = np.concatenate([np.tile([[i, j]], (len(rows), 1)) for i, j, rows in batch])
        start = np.concatenate([self.solutions[i][rows] for i, _, rows in batch])
        ends = track_paths(self.between(self.nodes, edges), start, PREDICTION, CORRECTION, STEPS)
        first = 0
        for i, j, rows in batch:
            own = slice(first, first + len(rows))
            first = own.stop
            self._followed(i, j)[rows] = True
            arrived = self.add_solutions(j, ends.V[own][ends.is_single[own]])
            self._followed(j, i)[arrived] = True
        return bool(ends.is_single.all())


FIRST_NODES, IDLE_NODES = 4, 2
"""Members at first, each with a linkage of its own, and how many more must bring nothing new."""
KEPT_FROM = 64
"""Solutions from which on every edge that was followed is kept, so that a search may go on from there."""
CLOSER_STEPS = 20 * MAX_STEPS
"""Of a path that is followed with the digits of long doubles: near members with solutions that meet it takes many."""
FOLLOWED_CORRECTION = 1e-7
"""What Newton's second step may still move a solution by: paths that leap for it are seen, as two come to one."""


class GenericSolutions(NamedTuple):
    """A random member with the solutions V that were found of it."""

    member: Member
    V: ComplexArray


def find_generic_solutions(
    family: Family,
    images: Images | None = None,
    seed: int = 5,
    enough: int | None = None,
    progress: Callable[[int], None] | None = None,
    store: UnfinishedSearch | None = None,
) -> GenericSolutions:
    """The solutions of a random member, one of those that are `images` of each other; no more than are `enough`. With a
    `store` the search goes on from where it was."""
    search = GenericSearch(family, images, seed, progress, store)
    search.close(enough)
    return search.solutions


class GenericSearch:
    """A search for the solutions of a random member, which can be extended."""

    def __init__(
        self,
        family: Family,
        images: Images | None = None,
        seed: int = 5,
        progress: Callable[[int], None] | None = None,
        store: UnfinishedSearch | None = None,
    ):
        self.family, self.seed, self.progress, self.store = family, seed, progress, store
        self.graph: SolutionGraph[Member] = SolutionGraph(
            lambda nodes, edges: EdgeHomotopy(family, nodes, edges), images
        )
        kept = None if store is None else store.read()
        if kept is not None:
            take_arrays(self.graph, len(family.parts), kept)

    @property
    def solutions(self) -> GenericSolutions:
        """The member with the most solutions that are known."""
        best = max(range(len(self.graph.nodes)), key=lambda k: len(self.graph.solutions[k]))
        return GenericSolutions(self.graph.nodes[best], self.graph.solutions[best])

    def extend(self, known: GenericSolutions) -> GenericSolutions:
        """The solutions of a member with those that members of this search lead to."""
        self.graph.add_node(known.member, known.V)
        self.close()
        return GenericSolutions(self.graph.nodes[0], self.graph.solutions[0])

    def close(self, enough: int | None = None) -> None:
        """Go round between the members until linkages of others bring nothing new, or so many are known."""
        graph = self.graph
        while len(graph.nodes) < FIRST_NODES:
            self.add_linkage()
        before = -1
        while len(graph.solutions[0]) > before:
            while graph.follow_open_edges():
                if self.progress is not None:
                    self.progress(graph.most)
                if self.store is not None and graph.most >= KEPT_FROM:
                    self.store.write(to_arrays(graph))
                if enough is not None and len(graph.solutions[0]) >= enough:
                    return
            before = len(graph.solutions[0])
            # linkages more, at the first member
            rngs = [np.random.default_rng([self.seed, 1, len(graph.nodes), graph.most, k]) for k in range(IDLE_NODES)]
            members, x = zip(*(first_solution(self.family, rng) for rng in rngs), strict=True)
            edges = np.stack([1 + np.arange(IDLE_NODES), np.zeros(IDLE_NODES, dtype=int)], axis=1)
            between = EdgeHomotopy(self.family, [graph.nodes[0], *members], edges)
            ends = track_paths(between, homogeneous_solutions(np.array(x)), PREDICTION, CORRECTION)
            graph.add_solutions(0, ends.V[ends.is_single])

    def add_linkage(self) -> None:
        """A member more, with the linkage that it was made for."""
        member, x = first_solution(self.family, np.random.default_rng([self.seed, len(self.graph.nodes)]))
        self.graph.add_node(member, homogeneous_solutions(x[None]))


def to_arrays(graph: SolutionGraph[Member]) -> dict[str, Any]:
    """A graph by names, to be kept."""
    content: dict[str, Any] = {"nodes": np.array(len(graph.nodes))}
    for k, (member, V) in enumerate(zip(graph.nodes, graph.solutions, strict=True)):
        content |= {f"V {k}": V} | {f"part {k} {n}": part for n, part in enumerate(member.parts)}
    return content | {f"followed {i} {j}": done for (i, j), done in graph.followed.items()}


def take_arrays(graph: SolutionGraph[Member], part_count: int, content: dict[str, Any]) -> None:
    """Go on from what was kept."""
    for k in range(int(content["nodes"])):
        graph.nodes.append(Member(tuple(content[f"part {k} {n}"] for n in range(part_count))))
        graph.solutions.append(content[f"V {k}"])
    for name, done in content.items():
        if name.startswith("followed"):
            i, j = map(int, name.split()[1:])
            graph.followed[i, j] = done


def follow(
    family: Family, begin: Member, V: ComplexArray, end: Member, near: float, long_steps: int | None = None
) -> PathEnds:
    """Solutions of one member followed to another, many at a time; in at most so many `long_steps` with the digits of
    long doubles, where any are given."""
    between = MemberHomotopy(family, begin, end)
    start = V if long_steps is None else V.astype(np.clongdouble)
    blocks = [
        track_paths(between, start[k : k + BLOCK], near, FOLLOWED_CORRECTION, long_steps or MAX_STEPS)
        for k in range(0, max(len(V), 1), BLOCK)
    ]
    ends = PathEnds(*(np.concatenate(each) for each in zip(*blocks, strict=True)))
    return ends._replace(V=ends.V.astype(complex))


MAX_POINTS = 1500
"""Of a slice, where nothing else is said; with more the test is not made."""
FIRST_SLICES, MORE_SLICES = (8, 5), 8
"""Between which points are followed at first, where there are FEW solutions or more, and how many more are tried before
the trace is said to be uneven."""
FEW = 10
LOOPS = 6
"""Through two random members each."""
SPREAD = 1.0
"""Of the sizes of a slice's coefficients (logarithm)."""
LEVELS = 1.0 + 0.3j, -0.4 + 1.1j
"""By which a slice is moved, of its greatest coefficient: the sums of its points are compared there and where it is."""
EVEN = 1e-10
"""Of the size of the sums: by how much a trace may be off."""
SEPARATE = 1e-9
"""Of the greatest unknown: solutions whose places are nearer are told from each other by conjugates alone."""
ON_SLICE = 1e-6
"""Of the size of a point: what s is less than that at the member itself."""

Slice = ComplexArray
"""Coefficients (2, 1 + unknowns) of 1 and the unknowns, and of s and s times these."""


class _SliceHomotopy:
    """Of each path a homotopy between two slices; solutions are (1, places, s; 1, conjugates, s)."""

    def __init__(
        self,
        family: Family,
        member: Member,
        line: tuple[ComplexArray, ...],
        begin: ComplexArray,
        end: ComplexArray,
    ):
        self.family, self.member, self.line, self.begin, self.end = family, member, line, begin, end

    def at_paths(self, paths: IntArray) -> _SliceHomotopy:
        """The homotopy of some of the paths."""
        return _SliceHomotopy(self.family, self.member, self.line, self.begin[paths], self.end[paths])

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way."""
        n = self.family.size
        x, s, other = _affine(V, n)
        f, slope, by_s = self.family.rows_at(x.T.copy(), self.member, self.line, s, True)
        rows, paths = f.shape
        change = self.end - self.begin
        c = self.begin + way[:, None, None] * change
        monomials = np.concatenate([np.ones((paths, 1)), x], axis=1)
        parts, changes = (np.einsum("pku,pu->pk", each, monomials) for each in (c, change))
        by_x = c[:, 0, 1:] + s[:, None] * c[:, 1, 1:]
        # unknowns in the order of V: places, s, conjugates, s
        total: ComplexArray = np.zeros((rows + 2, 2 * n + 2, paths), dtype=complex)
        total[:rows, :n], total[:rows, n], total[:rows, n + 1 : -1] = slope[:, :n], by_s, slope[:, n:]
        total[rows, :n], total[rows, n], total[rows, n + 1 : -1] = by_x[:, :n].T, parts[:, 1], by_x[:, n:].T
        total[rows + 1, n], total[rows + 1, -1] = 1.0, -1.0
        last = np.stack([parts[:, 0] + s * parts[:, 1], s - other])
        along = np.zeros((rows + 2, paths), dtype=complex)
        along[rows] = changes[:, 0] + s * changes[:, 1]
        return scaled_rows(np.concatenate([f, last]), homogeneous_slopes(total, V), along)


def _affine(V: ComplexArray, n: int) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """The unknowns, and s of both halves."""
    y = affine_solutions(V)
    return np.concatenate([y[:, :n], y[:, n + 1 : -1]], axis=1), y[:, n], y[:, -1]


class _Slices:
    """Slices of the solutions along one line of members, and the points of each."""

    def __init__(self, family: Family, known: GenericSolutions, V: ComplexArray, rng: np.random.Generator):
        self.size, self.rng = family.size, rng
        x, one = affine_solutions(V), np.ones((len(V), 1))
        self.form_size = _form_size(x)
        line = _random_line(family, rng)

        def between(slices: Sequence[Slice], edges: IntArray) -> _SliceHomotopy:
            every = np.array(slices)
            return _SliceHomotopy(family, known.member, line, *(every[nodes] for nodes in edges.T))

        self.graph: SolutionGraph[Slice] = SolutionGraph(between, None)
        W = np.concatenate([one, x[:, : self.size], 0.0 * one, one, x[:, self.size :], 0.0 * one], axis=1)
        first = self.random_slice()
        first[0] = 0.0
        self.graph.add_node(first, normalize(W))
        while len(self.graph.nodes) < FIRST_SLICES[len(V) > FEW]:
            self.graph.add_node(self.random_slice(), W[:0])
        self.levels = self._add_levels(1)

    def _add_levels(self, node: int) -> list[int]:
        """The number of a slice, and those of the same slice at other levels."""
        levels = [node]
        for level in LEVELS:
            moved = self.graph.nodes[node].copy()
            moved[0, 0] += level * np.abs(moved).max()
            levels.append(self.graph.add_node(moved, self.graph.solutions[0][:0]))
            self.graph.leaves.add(levels[-1])
        return levels

    def random_slice(self) -> Slice:
        """Coefficients at random; none of conjugates where places tell solutions from each other."""
        shape = (2, 1 + 2 * self.size)
        result: Slice = self.rng.normal(size=shape) + 1j * self.rng.normal(size=shape)
        result *= np.exp(SPREAD * self.rng.normal(size=shape))
        result[:, 1 + self.form_size :] = 0.0
        return result

    def close(self, most_points: int) -> bool:
        """Find the points of all slices; whether they have an even trace and are no more than so many."""
        for _ in range(MORE_SLICES):
            while self.graph.follow_open_edges():
                if self.graph.most > most_points:
                    return False
            if self._is_even():
                return True
            # where a path to another level was lost, those of another slice are tried
            is_lost = len({len(self.graph.solutions[level]) for level in self.levels}) > 1
            node = self.graph.add_node(self.random_slice(), self.graph.solutions[0][:0])
            if is_lost:
                self.levels = self._add_levels(node)
        return False

    def _is_even(self) -> bool:
        """Whether the sum of the points of a slice moves evenly with its level."""
        first, *others = self.levels
        if not all(self.graph.follow_edge(first, level) for level in others):
            return False
        points = [self.graph.solutions[level] for level in self.levels]
        sums = []
        for V in points:
            x, s, _ = _affine(V, self.size)
            sums.append(np.append(x[:, : self.form_size].sum(axis=0), s.sum()))
        slopes = [(total - sums[0]) / level for total, level in zip(sums[1:], LEVELS, strict=True)]
        size = max(float(np.abs(total).max()) for total in sums)
        return len({*map(len, points)}) == 1 and bool(np.abs(slopes[1] - slopes[0]).max() <= EVEN * max(size, 1.0))

    def at_member(self) -> ComplexArray:
        """The unknowns (solutions, unknowns) of the points that are the member's."""
        x, s, _ = _affine(self.graph.solutions[0], self.size)
        result: ComplexArray = x[np.abs(s) < ON_SLICE * np.maximum(1.0, np.abs(x).max(axis=1))]
        return result


def _form_size(x: ComplexArray) -> int:
    """How many unknowns a slice's form has for solutions x (solutions, unknowns): the places, or the conjugates too."""
    half = int(x.shape[1]) // 2
    apart = np.abs(x[:, None, :half] - x[:, :half]).max(axis=2) + np.where(np.eye(len(x)), np.inf, 0.0)
    return half if apart.min() > SEPARATE * max(1.0, float(np.abs(x).max())) else 2 * half


def _random_line(family: Family, rng: np.random.Generator) -> tuple[ComplexArray, ...]:
    """Changes of the numbers of one entry, or of those that conditions hold where there is none."""
    entries = [k for k, part in enumerate(family.parts) if k and part.kinds and part.rows.equation_count]
    moving = max(entries, key=lambda k: family.parts[k].entry_count, default=0)
    line: list[ComplexArray] = []
    for k, part in enumerate(family.parts):
        change: ComplexArray = np.zeros((part.entry_count, len(part.kinds), 2), dtype=complex)
        if k == moving:
            change[0, :, 0] = rng.normal(size=len(part.kinds)) + 1j * rng.normal(size=len(part.kinds))
            change[0, :, 1] = np.where([kind is NumberKind.LENGTH for kind in part.kinds], change[0, :, 0], 0.0)
        line.append(change)
    return tuple(line)


def _is_closed(family: Family, known: GenericSolutions, V: ComplexArray, rng: np.random.Generator) -> bool:
    """Whether random loops in all numbers lead from solutions V of the member to these alone."""
    members = [known.member, *(family.random_member(rng) for _ in range(2 * LOOPS))]
    first = 1 + 2 * np.repeat(np.arange(LOOPS), len(V))
    nodes = np.zeros_like(first)
    ends = np.tile(V, (LOOPS, 1))
    for corner in range(3):  # paths that are lost on the way do not go on
        target = first + corner if corner < 2 else np.zeros_like(first)
        paths = track_paths(
            EdgeHomotopy(family, members, np.stack([nodes, target], axis=1)), ends, PREDICTION, CORRECTION, STEPS
        )
        first, nodes, ends = first[paths.is_single], target[paths.is_single], paths.V[paths.is_single]
    return bool((first_of_same(np.concatenate([V, ends])) < len(V)).all())


def trace_test(
    family: Family,
    known: GenericSolutions,
    exchanges: tuple[tuple[int, ...], ...],
    seed: int = 9,
    most_points: int = MAX_POINTS,
) -> bool:
    """Whether the solutions of a random member, with what exchanges make of them, are all that it has.

    False also where the slice has more points than `most_points`.
    """
    V = np.concatenate(exchange_images(exchanges)(known.V))
    V = V[first_of_same(V) == np.arange(len(V))]
    if not 0 < 2 * len(V) <= most_points:
        return False
    rng = np.random.default_rng(seed)
    slices = _Slices(family, known, V, rng)
    return slices.close(most_points) and len(slices.at_member()) == len(V) and _is_closed(family, known, V, rng)


CACHE = PrivateCache("exact", ".npz", b"planar exact 1\n", 256 * 2**20)
MAX_RECENT = 16
_RECENT: dict[str, dict[str, Any]] = {}
"""What was found in this process, by the names of families: at most so many."""
TESTS = 3
"""Trace tests of a family at most, each with the solutions that were missing at the last."""
KNOWN = Path(__file__).parent / "known"
"""Where those stand that come with the package."""


class FamilyRecord(NamedTuple):
    """What is known of a family: a random member with all solutions `V` that were found of it; `classes` (classes,
    members) are rows of V that stand for the same motion; `is_traced`: whether the trace test says that these are all,
    and `is_tested` whether it was made; `source`: where their number is published, empty where it is not known."""

    name: FamilyName
    solutions: GenericSolutions
    classes: IntArray
    is_traced: bool
    source: str
    is_tested: bool = True

    @property
    def representatives(self) -> GenericSolutions:
        """One of every class."""
        return self.solutions._replace(V=self.solutions.V[self.classes[:, 0]])


def family_record(family: Family, progress: Callable[[int], None] | None = None) -> FamilyRecord:
    """What is known of a family, found now where nothing is, and kept."""
    name = name_family(family)
    content = _packaged(name.text) or _RECENT.get(name.text)
    if content is None:
        kept = CACHE.read(name.text)
        content = _read(io.BytesIO(kept)) if kept is not None else None
    if content is None:
        found = find_generic_solutions(
            family, exchange_images(name.exchanges), progress=progress, store=UnfinishedSearch(name)
        )
        content = _keep(name, found, False, False)
    return _unpack(name, content)


def tested_record(family: Family, record: FamilyRecord) -> FamilyRecord:
    """A record after the trace test; where this shows that solutions are missing, with those that more members lead to.

    What comes of it is kept.
    """
    name, known = record.name, record.solutions
    for seed in range(TESTS):
        is_traced = trace_test(family, known, name.exchanges)
        more = None if is_traced else GenericSearch(family, exchange_images(name.exchanges), TESTS + seed).extend(known)
        if more is None or len(more.V) == len(known.V):
            break
        known = more
    return _unpack(name, _keep(name, known, is_traced, True))


def _keep(name: FamilyName, found: GenericSolutions, is_traced: bool, is_tested: bool) -> dict[str, Any]:
    """A record as arrays, kept on disk where anything can be."""
    content = pack_record(name, found, np.arange(len(found.V))[:, None], is_traced, "")
    content["is_tested"] = np.array(is_tested)
    if len(_RECENT) >= MAX_RECENT:
        _RECENT.clear()
    _RECENT[name.text] = content
    if CACHE.is_writable():
        CACHE.write(name.text, write_record(content))
    return content


class UnfinishedSearch:
    """Where the search for the solutions of a family is kept as long as it is not at its end."""

    def __init__(self, name: FamilyName):
        self.key = sha256(f"unfinished {name.text} {name.unknowns} {name.given}".encode()).hexdigest()

    def read(self) -> dict[str, Any] | None:
        """What was kept."""
        kept = CACHE.read(self.key)
        return None if kept is None else _read(io.BytesIO(kept))

    def write(self, content: dict[str, Any]) -> None:
        """Keep it, where anything can be kept."""
        if CACHE.is_writable():
            CACHE.write(self.key, write_record(content))


def pack_record(
    name: FamilyName, found: GenericSolutions, classes: IntArray, is_traced: bool, source: str
) -> dict[str, Any]:
    """A record as arrays, in the order of symbols that all families of one name share."""
    V = reordered(found.V, name.unknowns)
    parts = [found.member.parts[0][:, list(name.given)], *found.member.parts[1:]]
    named = {f"part{k}": part for k, part in enumerate(parts)}
    return {"V": V, "classes": classes, "is_traced": np.array(is_traced), "source": np.array(source), **named}


def write_record(content: dict[str, Any]) -> bytes:
    """A record as the bytes of a file."""
    told = io.BytesIO()
    np.savez_compressed(told, **content)
    return told.getvalue()


def _read(source: io.BytesIO | Path) -> dict[str, Any]:
    with np.load(source, allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


@lru_cache(maxsize=8)
def _packaged(text: str) -> dict[str, Any] | None:
    path = KNOWN / f"{text[:16]}.npz"
    return _read(path) if path.is_file() else None


def _unpack(name: FamilyName, content: dict[str, Any]) -> FamilyRecord:
    V = reordered(content["V"], tuple(np.argsort(name.unknowns).tolist()))
    first = np.empty_like(content["part0"])
    first[:, list(name.given)] = content["part0"]
    others = [content[f"part{k}"] for k in range(1, sum(key.startswith("part") for key in content))]
    member = Member((first, *others))
    return FamilyRecord(
        name,
        GenericSolutions(member, V),
        content["classes"],
        bool(content["is_traced"]),
        str(content["source"]),
        bool(content.get("is_tested", True)),
    )
