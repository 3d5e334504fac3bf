"""The assembly nearest to the sketch, found block after block."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from itertools import count
from math import hypot, pi, remainder, tau
from typing import NamedTuple

import numpy as np

from planar.equations.coordinates import frames_from_coordinates
from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.units import parse_unit
from planar.model.link_shapes import fitted_frame
from planar.model.mechanism import named_points, sketched_places
from planar.model.pairs import MeasureKind
from planar.model.wording import count_phrase, join_all_names, quote_names
from planar.solving.assembly.block_assemblies import (
    CLEAR_SKETCH_DISTANCE,
    BlockAssemblies,
    BlockAssembly,
    block_dependencies,
)
from planar.solving.prepared_mechanism import PreparedMechanism

EQUAL_DISTANCE_TOLERANCE = 1e-9
"""Assemblies whose sums of squared distances to the sketch (sizes squared) agree to this fit alike."""
MAX_TIED = 64
"""Assemblies that fit alike among which one is looked for whose rates are determined."""
MAX_BEST_FIRST_EFFORT = 3000.0
"""The effort (steps of Newton's method) on blocks that were solved before, with earlier blocks elsewhere, up to which
the search looks for a nearer assembly; beyond it takes the best partial one to an end."""
MAX_REPEATED_EFFORT = 1.2 * MAX_BEST_FIRST_EFFORT
"""The same effort at which the search stops without an assembly: combinations of earlier blocks grow exponentially."""


def is_at_sketch(
    squared_distance: Array, point_count: int | Array, reach: float | Array = CLEAR_SKETCH_DISTANCE
) -> BoolArray:
    """Whether points lie where the sketch shows them, by the sum of their squared distances (squared sizes)."""
    return np.asarray(squared_distance <= point_count * reach**2)


def is_surely_farther(other: Array, total: Array, roundings: int = 1) -> BoolArray:
    """Whether another assembly of a block, taken alone, lies farther from the sketch than the total that was taken.

    Squared distances never fall as blocks are added, so there is then no nearer assembly.
    """
    return np.asarray(other > total + roundings * EQUAL_DISTANCE_TOLERANCE)


class Assembly(NamedTuple):
    """The unknowns of an assembly, the blocks that may as well stand otherwise, and whether the search was cut off."""

    z: Array
    ties: tuple[int, ...] = ()
    is_cut_off: bool = False


class AssemblySearchFailure(NamedTuple):
    """The block at which every way to assemble ends.

    `z`: the unknowns where it is nearest to closing, those of earlier blocks filled in; `effort`: that of the search
    (see `BlockAssemblies.effort`); `is_cut_off`: whether it stopped before it had tried all combinations.
    """

    stage: Block
    z: Array
    effort: float = 0.0
    is_cut_off: bool = False


class _BlockSearch:
    """The candidates of blocks, and where there are none: whatever the blocks do on which one does not hang, at the
    same places of those on which it hangs there are none again."""

    def __init__(self, candidates: BlockAssemblies):
        self.candidates = candidates
        self.last_failure: AssemblySearchFailure | None = None
        "the last block that could not be assembled"
        self.is_hopeless = False
        "whether one cannot be assembled that hangs on no other"
        self._dependencies: list[list[int]] | None = None
        self._dead_ends: dict[int, set[bytes]] = {}

    def find_assemblies(self, stage: Block, z: Array) -> list[BlockAssembly]:
        """Those of a block, the unknowns before it in z; none as well where a later one would have none for these."""
        if self._is_dead_end(z, stage.unknowns.start):
            return []
        is_farthest = self.last_failure is None or stage.block_index > self.last_failure.stage.block_index
        assemblies, nearest = self.candidates.near_sketch(stage, z, needs_nearest=is_farthest)
        if not assemblies:
            if is_farthest:
                self.last_failure = AssemblySearchFailure(stage, nearest)
            self._dependencies = self._dependencies or [
                sorted(columns) for columns in block_dependencies(self.candidates.setup)
            ]
            self._dead_ends.setdefault(stage.block_index, set()).add(z[self._dependencies[stage.block_index]].tobytes())
            self.is_hopeless = not self._dependencies[stage.block_index]
        return assemblies

    def _is_dead_end(self, z: Array, known: int) -> bool:
        columns = self._dependencies or []
        return any(
            columns[level][-1] < known and z[columns[level]].tobytes() in places
            for level, places in self._dead_ends.items()
        )


class _Node(NamedTuple):
    """A partial assembly, in the order in which the search takes them up."""

    cost: float
    slides_behind: float
    ranks: tuple[int, ...]
    number: int
    z: Array
    ties: tuple[int, ...]
    "blocks in which another choice lies as near to the sketch"


def _deepest_index(heap: Sequence[_Node]) -> int:
    """The partial assembly of most blocks, of several the best."""
    return min(range(len(heap)), key=lambda index: (-len(heap[index].ranks), *heap[index][:4]))


def find_nearest_assembly(
    candidates: BlockAssemblies, is_regular: Callable[[Array], bool] | None = None
) -> Assembly | AssemblySearchFailure:
    """Best first: of all assemblies the one with the least sum of squared distances to the sketch.

    The cost of a partial assembly never falls as it grows, so the first whole one is the nearest. Of several that fit
    alike one is taken that `is_regular`, whose rates are determined, if there is one among the first. After
    `MAX_BEST_FIRST_EFFORT` the search only goes on to an end, and says so; after `MAX_REPEATED_EFFORT` it stops.
    """
    stages = candidates.equations.blocks
    number, groups = count(), _BlockSearch(candidates)
    heap = [_Node(0.0, 0, (), next(number), np.zeros(len(candidates.equations.unknowns)), ())]
    nearest: list[_Node] = []  # whole assemblies, of equal cost
    regular: _Node | None = None
    while heap:
        is_best_first = candidates.repeated_effort < MAX_BEST_FIRST_EFFORT
        if candidates.repeated_effort >= MAX_REPEATED_EFFORT or (nearest and not is_best_first):
            break
        node = heapq.heappop(heap) if is_best_first else heap.pop(_deepest_index(heap))
        if nearest and node.cost > nearest[0].cost:
            heap.clear()
            break
        if len(node.ranks) == len(stages):
            nearest.append(node)
            if regular is None and (is_regular is None or is_regular(node.z)):
                regular = node
            if len(nearest) > 1 and (regular is not None or len(nearest) > MAX_TIED + 1):
                heap.clear()
            continue
        assemblies = groups.find_assemblies(stages[len(node.ranks)], node.z)
        if groups.is_hopeless:
            break
        for rank, part in enumerate(assemblies):
            alike = sum(abs(other.distance - part.distance) <= EQUAL_DISTANCE_TOLERANCE for other in assemblies) > 1
            heapq.heappush(
                heap,
                _Node(
                    round((node.cost + part.distance) / EQUAL_DISTANCE_TOLERANCE) * EQUAL_DISTANCE_TOLERANCE,
                    node.slides_behind + part.slides_behind,
                    (*node.ranks, rank),
                    next(number),
                    part.z,
                    (*node.ties, len(node.ranks)) if alike else node.ties,
                ),
            )
    if not groups.is_hopeless and not nearest:  # cut off: what is whole already will do
        nearest = sorted(node for node in heap if len(node.ranks) == len(stages))[:1]
    if nearest:
        chosen = regular or nearest[0]
        return Assembly(chosen.z, chosen.ties if len(nearest) > 1 else (), bool(heap))
    failure = groups.last_failure
    if failure is None:  # cut off before any block failed
        farthest = max(heap, key=lambda node: len(node.ranks))
        failure = AssemblySearchFailure(stages[len(farthest.ranks)], farthest.z)
    return failure._replace(effort=candidates.effort, is_cut_off=bool(heap) and not groups.is_hopeless)


FAR_FROM_SKETCH = 0.1
"""The part of the mechanism's size by which a point may be off its sketch without a remark."""
TURNED_FROM_SKETCH = pi / 4
"""The angle (rad) by which a link may be turned against its sketched points without a remark."""
MAX_NAMED_BLOCKS = 4
"""Blocks of links that are named one by one."""


def sketch_remarks(setup: PreparedMechanism, assembly: Assembly) -> tuple[str, ...]:
    """Sentences on an assembly that lies far from the sketch, and on blocks whose assembly the sketch leaves open: how
    they stand, and how to choose."""
    remarks = _sketch_distance_remarks(setup, assembly.z) if setup.mechanism.sketch else []
    open_blocks = [setup.equations.blocks[index] for index in assembly.ties]
    if open_blocks:
        lead = "the sketch leaves open" if setup.mechanism.sketch else "there is no sketch to say"
        positions = [_describe_block_position(setup, block, assembly.z) for block in open_blocks[:MAX_NAMED_BLOCKS]]
        more = (
            f", and so on for {count_phrase(len(open_blocks) - MAX_NAMED_BLOCKS, 'more group')}"
            if len(open_blocks) > MAX_NAMED_BLOCKS
            else ""
        )
        remarks.append(
            f"{lead} how some links go together; taken is {join_all_names(positions)}{more}: the sliding points ahead "
            f"of 'through', else the upper assembly; sketch these points elsewhere to choose another"
        )
    if assembly.is_cut_off:
        remarks.append(
            "the search for the assembly nearest to the sketch stopped before it had tried all combinations and took "
            "the nearest so far; sketch more points to choose the one that is meant"
        )
    if setup.is_deflated:
        links = links_held_to_second_order(setup)
        remarks.append(
            f"all along the motion the pairs hold link{'s' * (len(links) != 1)} {quote_names(links)} "
            f"to second order only; to first order more could move, so that a little play lets it move far"
        )
    return tuple(remarks)


def links_held_to_second_order(setup: PreparedMechanism) -> list[str]:
    """The links that constraints hold to second order only, and leave free to first order, all along the motion."""
    rows = setup.equations.rows
    touching = [
        stage for stage in setup.equations.blocks if any(row.kind is MeasureKind.PURE for row in rows[stage.rows])
    ]
    return list(dict.fromkeys(link for stage in touching for link in stage.links))


def _describe_block_position(setup: PreparedMechanism, block: Block, z: Array) -> str:
    """Where a point of a block is: C at [80, 50] mm; of a block without points, its links."""
    locations = setup.structure.point_locations
    placed = [place for place in locations.first_link.items() if place[1][0] == block.block_index]
    if not placed:
        return f"one assembly of {quote_names(block.links)}"
    names = [name for points in locations.points_of.values() for _, name in points]
    # of the points that could be named one that several links share says most
    name, (_, link, point) = max(placed, key=lambda place: names.count(place[0]))
    w = setup.functions.coordinates(z, setup.inputs.u, setup.inputs.p) * setup.scale
    frames, _ = frames_from_coordinates(w, setup.column, [link], {})
    length = parse_unit(setup.mechanism.units.length)
    position = frames[link].to_world(setup.shapes[link].position(point))
    values = [f"{length.from_si(float(value)):.4g}" for value in position]
    return f"{name} at [{', '.join(values)}] {setup.mechanism.units.length}"


def _sketch_distance_remarks(setup: PreparedMechanism, z: Array) -> list[str]:
    """A sentence on an assembly that lies far from the sketch: the farthest point, and the link that is turned most."""
    mechanism, places = setup.mechanism, sketched_places(setup.mechanism)
    w = setup.functions.coordinates(z, setup.inputs.u, setup.inputs.p) * setup.scale
    frames, _ = frames_from_coordinates(w, setup.column, setup.shapes, {})
    distances = {
        (link, point): hypot(*(frames[link].to_world(setup.shapes[link].position(point)) - place))
        for link, points in places.items()
        for point, place in points.items()
    }
    turns = {
        link: remainder(float(frames[link].angle) - sketched.angle, tau)
        for link, points in places.items()
        if link != mechanism.frame and (sketched := fitted_frame(setup.shapes[link], points)) is not None
    }
    corners = [frames[link].to_world(point) for link, shape in setup.shapes.items() for point in shape.points.values()]
    x, y = [float(point.x) for point in corners], [float(point.y) for point in corners]
    diagonal = hypot(max(x) - min(x), max(y) - min(y))
    clauses = []
    farthest = max(distances, key=lambda member: distances[member])
    if distances[farthest] > FAR_FROM_SKETCH * diagonal:
        name = next(point.name for point in named_points(mechanism) if farthest in point.members)
        distance = parse_unit(mechanism.units.length).from_si(float(distances[farthest]))
        clauses.append(f"{name} is {distance:.4g} {mechanism.units.length} from where it is sketched")
    link = max(turns, key=lambda name: abs(turns[name]), default="")
    if link and abs(turns[link]) > TURNED_FROM_SKETCH:
        clauses.append(f"link {link!r} is turned by {turns[link] * 180 / pi:.4g} deg against its sketched points")
    if not clauses:
        return []
    return [f"at the file's inputs {' and '.join(clauses)}, far from the sketch; check lengths, angles and sketch"]
