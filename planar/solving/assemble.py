"""The assembly of a mechanism that lies nearest to a rough sketch, found group after group."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping, Sequence
from itertools import count
from typing import NamedTuple

import numpy as np

from planar.algebra import Scalar
from planar.equations import Stage
from planar.mechanism import Mechanism, named_points
from planar.pairs import Kind, Pair
from planar.plane import GROUND, Frame, Vector, frame_at
from planar.program import Program, length, shapes
from planar.solving.newton import Closing, newton, polished

Array = np.ndarray

ALIKE = 1e-9
"""Assemblies whose sums of squared distances to the sketch (sizes squared) agree to this fit alike."""
SAME = 1e-6
"""Unknowns closer than this are one assembly: within it two would be a dead point to working precision."""
EXPANSIONS = 2000
"""Groups solved before the search stops looking for a nearer assembly and takes the best way to an end."""


class Assembly(NamedTuple):
    """The unknowns of an assembly, and what is to be said of how it was chosen."""

    z: Array
    remarks: tuple[str, ...] = ()


class Failure(NamedTuple):
    """The group at which every way to assemble ends, how far its constraints stay open at the best (rows,), and the
    unknowns with those of the earlier groups filled in."""

    stage: Stage
    open: Array
    z: Array


class Assembler:
    """The search for the assembly nearest to the sketch, for one mechanism and one set of inputs (u, p scaled)."""

    def __init__(self, mechanism: Mechanism, program: Program, u: Array, p: Array, unit: float):
        self.program, self.u, self.p = program, u, p
        self.equations = program.equations
        self.pairs = {pair.name: pair for pair in mechanism.pairs}
        self.column = {(c.owner, c.part): index for index, c in enumerate(self.equations.coordinates)}
        self.local = {
            name: {point: Vector(at.x / unit, at.y / unit) for point, at in shape.points.items()}
            for name, shape in shapes(mechanism).items()
        }
        self.points = {each.name: each.members for each in named_points(mechanism)}
        self.sketch = {name: Vector(x / unit, y / unit) for name, x, y in mechanism.sketch}
        self.level_of = {link.name: self._level(link.name) for link in mechanism.links}

    def _level(self, link: str) -> int:
        """The stage after which a link's position is known; -1 for the frame."""
        columns = [self.column.get((link, part)) for part in ("x", "y", "angle")]
        return max((self.equations.known_from[c] for c in columns if c is not None), default=-1)

    def search(self) -> Assembly | Failure:
        """Best first: of all assemblies the one with the least sum of squared distances to the sketch.

        The cost of a partial assembly never falls as it grows, so the first whole one is the nearest.
        """
        number = count()
        start = np.zeros(len(self.equations.unknowns))
        heap: list[tuple[float, int, tuple[int, ...], int, Array]] = [(0.0, 0, (), next(number), start)]
        worst: Failure | None = None
        chosen: tuple[float, tuple[int, ...], Array] | None = None
        for expansions in count():
            if not heap:
                break
            if expansions < EXPANSIONS:
                node = heapq.heappop(heap)
            else:
                node = heap.pop(min(range(len(heap)), key=lambda index: (-len(heap[index][2]), *heap[index][:4])))
            cost, behind, ranks, _, z = node
            if chosen is not None and (cost > chosen[0] or expansions > EXPANSIONS):
                break
            if len(ranks) == len(self.equations.stages):
                if chosen is not None:
                    return Assembly(chosen[2], (self._tie(chosen[1], ranks),))
                chosen = cost, ranks, z
                continue
            stage = self.equations.stages[len(ranks)]
            found, gap = self.candidates(stage, z)
            if not found and (worst is None or stage.level > worst.stage.level):
                worst = Failure(stage, gap, z)
            for rank, (more, late, unknowns) in enumerate(found):
                total = round((cost + more) / ALIKE) * ALIKE
                heapq.heappush(heap, (total, behind + late, (*ranks, rank), next(number), unknowns))
        if chosen is None:
            assert worst is not None
            return worst
        return Assembly(chosen[2])

    def _tie(self, ranks: tuple[int, ...], others: tuple[int, ...]) -> str:
        first = next(index for index, (a, b) in enumerate(zip(ranks, others, strict=True)) if a != b)
        links = ", ".join(self.equations.stages[first].links)
        return (
            f"the sketch fits more than one assembly alike; taken is the one with its sliding points ahead of "
            f"'through', else the upper one: sketch a point of {links} to choose"
        )

    def candidates(self, stage: Stage, z: Array) -> tuple[list[tuple[float, int, Array]], Array]:
        """All assemblies of one group that its starts lead to, given the earlier groups.

        Each as (squared distance to the sketch, slides that lie behind, all unknowns), the upper ones first;
        with what the best start leaves open.
        """
        closing = self._closing(stage, z)
        starts = self._starts(stage, z, closing)
        ended = newton(closing, starts)
        best = ended.unknowns[int(np.argmin(ended.open))][None, :]
        roots: list[Array] = []
        for root in ended.unknowns[ended.closed]:
            if not any(self._same(stage, root, other) for other in roots):
                roots.append(polished(closing, root))
        found = []
        for root in roots:
            whole = z.copy()
            whole[stage.unknowns] = root
            frames, own = self._placed(whole)
            found.append(
                (self._distance(stage, frames), self._behind(stage, frames, own), whole, self._height(stage, frames))
            )
        found.sort(key=lambda each: (each[1], -round(each[3], 9), *np.round(each[2], 6)))
        return [each[:3] for each in found], closing(best)[0][0]

    def _closing(self, stage: Stage, z: Array) -> Closing:
        function = self.program.closing(stage)
        rows, unknowns = length(stage.rows), length(stage.unknowns)

        def closing(tried: Array) -> tuple[Array, Array]:
            count = len(tried)
            whole = np.repeat(z[:, None], count, axis=1)
            whole[stage.unknowns] = tried.T
            left, slope = function(whole, self.u, self.p) if count > 1 else function(whole[:, 0], self.u, self.p)
            slopes = slope.full().reshape(rows, count, unknowns, order="C") if unknowns else np.zeros((rows, count, 0))
            return left.full().reshape(rows, count).T.copy(), slopes.transpose(1, 0, 2).copy()

        return closing

    def _is_angle(self, stage: Stage) -> Array:
        columns = self.equations.unknowns[stage.unknowns]
        return np.array([self.equations.coordinates[c].kind is not Kind.LENGTH for c in columns], dtype=bool)

    def _same(self, stage: Stage, a: Array, b: Array) -> bool:
        apart = np.where(self._is_angle(stage), np.abs(np.exp(1j * a) - np.exp(1j * b)), np.abs(a - b))
        return bool(np.all(apart < SAME))

    def _starts(self, stage: Stage, z: Array, closing: Closing) -> Array:
        """Starts for a group: angles as in the sketch where it shows them, others spread evenly over the circle."""
        unknowns = length(stage.unknowns)
        if unknowns == 0:
            return np.zeros((1, 0))
        angles = self._is_angle(stage)
        many = min(6 * unknowns**2, 160)
        spread = 2.0 * np.pi * (np.arange(many)[:, None] * _irrationals(unknowns) % 1.0)
        shown = self._shown(stage, z)
        near = spread[: max(4, many // 4)].copy()
        for index, column in enumerate(self.equations.unknowns[stage.unknowns]):
            coordinate = self.equations.coordinates[column]
            if coordinate.owner in shown and coordinate.of_link and coordinate.part == "angle":
                near[:, index] = shown[coordinate.owner]
        starts = np.vstack([near, spread])
        starts[:, ~angles] = 0.0
        if not angles.all():
            # lengths enter linearly, so for given angles they follow from least squares
            left, slope = closing(starts)
            along = slope[:, :, ~angles]
            starts[:, ~angles] = -np.einsum("krm,km->kr", np.linalg.pinv(along), left)
        return starts

    def _shown(self, stage: Stage, z: Array) -> dict[str, float]:
        """The angle at which the sketch, and the points that are known already, show a link of the group."""
        frames, _ = self._placed(z)
        located = dict(self.sketch)
        for name, members in self.points.items():
            for link, point in members:
                if self.level_of[link] < stage.level:
                    located[name] = frames[link].carry(self.local[link][point])
        angles = {}
        for link in stage.links:
            ends = [
                (self.local[link][point], located[name])
                for name, members in self.points.items()
                for each, point in members
                if each == link and name in located
            ]
            if len(ends) >= 2:
                angle = _turn_between(ends)
                if angle is not None:
                    angles[link] = angle
        return angles

    def _placed(self, z: Array) -> tuple[dict[str, Frame], dict[str, tuple[float, ...]]]:
        w = self.program.positions(z, self.u, self.p).full().ravel()
        return placed(w, self.column, self.level_of, self.pairs)

    def _distance(self, stage: Stage, frames: Mapping[str, Frame]) -> float:
        """The squared distances of the sketched points that this group places."""
        total = 0.0
        for name, at in self.sketch.items():
            link, point = min(self.points[name], key=lambda member: self.level_of[member[0]])
            if self.level_of[link] == stage.level:
                gap = frames[link].carry(self.local[link][point]) - at
                total += float(gap.dot(gap))
        return total

    def _behind(self, stage: Stage, frames: Mapping[str, Frame], own: Mapping[str, tuple[float, ...]]) -> int:
        late = 0
        for name in stage.pairs:
            pair = self.pairs.get(name)
            if pair is not None and pair.coordinates:
                first, second = (frames[link] for link in pair.links)
                late += not pair.ahead(float(pair.drive(first, second, (), own[name])))
        return late

    def _height(self, stage: Stage, frames: Mapping[str, Frame]) -> float:
        points = [frames[link].carry(at).y for link in stage.links for at in self.local[link].values()]
        return float(np.mean(points)) if points else 0.0


def placed(
    w: Sequence[Scalar], column: Mapping[tuple[str, str], int], links: Iterable[str], pairs: Mapping[str, Pair]
) -> tuple[dict[str, Frame], dict[str, tuple[Scalar, ...]]]:
    """Frames of links and own coordinates of pairs from w, whose entries may be floats, arrays or jets."""
    frames = {
        link: frame_at(*(w[column[link, part]] for part in ("x", "y", "angle"))) if (link, "x") in column else GROUND
        for link in links
    }
    own = {name: tuple(w[column[name, part]] for part, _ in pair.coordinates) for name, pair in pairs.items()}
    return frames, own


def _irrationals(dimensions: int) -> Array:
    """Steps of an evenly spread sequence: powers of the root of x^(d+1) = x + 1 (M. Roberts' R-sequence)."""
    root = 2.0
    for _ in range(40):
        root = (1.0 + root) ** (1.0 / (dimensions + 1))
    return (1.0 / root) ** np.arange(1, dimensions + 1)


def _turn_between(ends: list[tuple[Vector, Vector]]) -> float | None:
    """The angle that turns local points nearest to where they are shown (orthogonal Procrustes in the plane)."""
    local = np.array([complex(*at) for at, _ in ends])
    shown = np.array([complex(*at) for _, at in ends])
    turn = np.vdot(local - local.mean(), shown - shown.mean())
    return None if abs(turn) < 1e-12 else float(np.angle(turn))
