"""The ways in which one group of links can be assembled, once all earlier groups stand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.equations.constraint_equations import Stage
from planar.equations.functions import Program, length, placed
from planar.equations.minors import depends
from planar.foundation.geometry import Vector
from planar.model.pairs import Kind
from planar.solving.assembly.sketch_start import turn_between
from planar.solving.newton import CLOSED, Closing, Found, newton, polished
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

SAME = 1e-6
"""Unknowns closer than this are one assembly: within it two would be a dead point to working precision."""
MEETING = 1.0 - 1e-6
"""Squared cosine beyond which two assemblies are too near to where they meet to be told apart by a closed form."""
MOST_STARTS = 160
LARGE, BATCH = 10, 16
"""Unknowns of a group from which on starts are tried in batches of so many."""
BLUR = 0.3
"""Radians: how far about the angles of a sketch starts are spread, so that near twins are both found."""
CLEAR = 0.03
"""An assembly whose points lie this near to the sketch on average (lengths of the size) is the one that is meant."""


def hanging(setup: Setup) -> list[frozenset[int]]:
    """The unknowns of earlier groups on which each group hangs."""
    columns = depends(setup.program)
    later = len(setup.equations.unknowns) + len(setup.station.u)
    return [
        frozenset().union(*columns[stage.rows]).difference(range(stage.unknowns.start, later))
        for stage in setup.equations.stages
    ]


class Candidate(NamedTuple):
    """One assembly of a group: all unknowns with this group's filled in, and how it lies.

    `distance`: squared distance to the sketch of the points that the group places (sizes squared); `behind`: how many
    slides are not ahead of their `through`; `height`: mean y of the group's points; `far`: how far its slides are ahead
    together.
    """

    z: Array
    distance: float
    behind: int
    height: float
    far: float


class Candidates:
    """Assemblies of the groups of one mechanism, at its own inputs."""

    def __init__(self, setup: Setup):
        mechanism, unit = setup.mechanism, setup.unit
        self.setup = setup
        self.program, self.u, self.p = setup.program, setup.station.u, setup.station.p
        self.equations, self.pairs, self.column = setup.equations, setup.pairs, setup.column
        self.numbers, first = {}, 0
        for pair in mechanism.pairs:
            self.numbers[pair.name] = self.p[first : first + len(pair.measures)]
            first += len(pair.measures)
        self.local = {
            name: {point: Vector(at.x / unit, at.y / unit) for point, at in shape.points.items()}
            for name, shape in setup.shapes.items()
        }
        self.sketch = {name: Vector(x / unit, y / unit) for name, x, y in mechanism.sketch}
        self.counts = setup.outline.counts
        # each point by the first of its links to be placed, and the points of each link
        self.first, self.points_of, _ = setup.outline.places
        self.sketched_at: dict[int, list[str]] = {}
        for name in self.sketch:
            self.sketched_at.setdefault(self.first[name][0], []).append(name)

    def of(self, stage: Stage, z: Array, every: bool = False) -> tuple[list[Candidate], Array]:
        """All assemblies of a group that its starts lead to, the ones that an author would mean first.

        Where one lies clearly at the sketch others are looked for only if `every` one is wanted.

        With all unknowns at the end of the best start, whether it closes the group or not.
        """
        both = self._both(stage, z)
        if both is not None:
            return both, both[0].z
        closing = self.closing(stage, z, self.p)
        near, shown = self._near(stage, z)
        ended = newton(closing, self._with_lengths(stage, closing, near))
        found = self._candidates(stage, z, closing, ended.unknowns[ended.closed])
        sketched = len(self.sketched_at.get(stage.level, ()))
        lower = all(self.pairs[name].lower for name in stage.pairs)
        dyad = length(stage.unknowns) == 2 and len(stage.pairs) == 3 and lower and len(found) == 2  # there is no third
        clear = not every and shown and found and min(each.distance for each in found) <= sketched * CLEAR**2
        if not (dyad or clear):
            for starts in self._searched(stage, closing):
                more = newton(closing, starts)
                ended = Found(*(np.concatenate(both) for both in zip(ended, more, strict=True)))
                if not sketched and np.any(more.closed):
                    break
            found = self._candidates(stage, z, closing, ended.unknowns[ended.closed])
        nearest = z.copy()
        nearest[stage.unknowns] = ended.unknowns[int(np.argmin(ended.open))]
        return found, nearest

    def _both(self, stage: Stage, z: Array) -> list[Candidate] | None:
        """The two assemblies of a group in closed form; None where it has none, or where they all but meet."""
        function = None if self.counts else self.program.assemblies(stage)
        if function is None:
            return None
        found, left, bend = function(z, self.u, self.p)
        # what is not a number is not below anything
        if not (bend < MEETING and left <= CLOSED):
            return None
        return self._ordered(stage, z, found)

    def _searched(self, stage: Stage, closing: Closing) -> Iterator[Array]:
        """Starts all over the circles; of a large group in batches, since any assembly will do without a sketch."""
        starts = self._with_lengths(stage, closing, _spread(length(stage.unknowns)))
        many = len(starts) if length(stage.unknowns) < LARGE else BATCH
        return (starts[first : first + many] for first in range(0, len(starts), many))

    def _candidates(self, stage: Stage, z: Array, closing: Closing, closed: Array) -> list[Candidate]:
        if self.counts:
            # angles take the turn nearest to none, wherever Newton's method wandered, if that is closed too
            least = np.where(self._is_angle(stage), np.arctan2(np.sin(closed), np.cos(closed)), closed)
            still = np.abs(closing(least)[0]).max(axis=1, initial=0.0) < CLOSED if len(closed) else closed
            closed = np.where(still[:, None], least, closed) if len(closed) else closed
            closed = closed[np.argsort(np.abs(closed).sum(axis=1), kind="stable")]
        roots: list[Array] = []
        for root in closed:
            if not any(self._same(stage, z, root, other) for other in roots):
                roots.append(polished(closing, root))
        return self._ordered(stage, z, roots)

    def _ordered(self, stage: Stage, z: Array, roots: list[Array]) -> list[Candidate]:
        return sorted(
            (self._candidate(stage, z, root) for root in roots),
            key=lambda each: (each.behind, -round(each.height, 9), -round(each.far, 9), *np.round(each.z, 6)),
        )

    def _candidate(self, stage: Stage, z: Array, root: Array) -> Candidate:
        whole = z.copy()
        whole[stage.unknowns] = root
        sketched = {name: self.first[name] for name in self.sketched_at.get(stage.level, ())}
        pairs = {name: self.pairs[name] for name in stage.pairs}
        links = {*stage.links, *(link for pair in pairs.values() for link in pair.bodies)}
        links |= {link for _, link, _ in sketched.values()}
        frames, own = placed(self._w(whole).tolist(), self.column, links, pairs)
        gaps = [
            frames[link].carry(self.local[link][point]) - self.sketch[name]
            for name, (_, link, point) in sketched.items()
        ]
        drives = [
            (pair, float(pair.drive([frames[link] for link in pair.bodies], self.numbers[name], own[name])))
            for name, pair in pairs.items()
            if pair.coordinates
        ]
        heights = [frames[link].carry(at).y for link in stage.links for at in self.local[link].values()]
        return Candidate(
            whole,
            sum(float(gap.dot(gap)) for gap in gaps),
            sum(not pair.ahead(drive) for pair, drive in drives),
            sum(heights) / len(heights) if heights else 0.0,
            sum(drive for _, drive in drives),
        )

    def _w(self, z: Array) -> Array:
        return self.program.coordinates(z, self.u, self.p)

    def closing(self, stage: Stage, z: Array, p: Array) -> Closing:
        """A group's constraints at tries of its own unknowns, those of earlier groups and the pairs' numbers given."""
        return closing_of(self.program, stage, z, self.u, p)

    def everywhere(self, stage: Stage, z: Array) -> list[Candidate]:
        """All assemblies of a group that starts about the sketch and all over the circles lead to."""
        closing = self.closing(stage, z, self.p)
        starts = np.concatenate([self._near(stage, z)[0], _spread(length(stage.unknowns))])
        ended = newton(closing, self._with_lengths(stage, closing, starts))
        return self._candidates(stage, z, closing, ended.unknowns[ended.closed])

    def _is_angle(self, stage: Stage) -> Array:
        columns = self.equations.unknowns[stage.unknowns]
        return np.array([self.equations.coordinates[c].kind is not Kind.LENGTH for c in columns], dtype=bool)

    def _same(self, stage: Stage, z: Array, a: Array, b: Array) -> bool:
        """Whether two roots of a group are one assembly; where turns count, they are if all that hangs on them is."""
        if not np.all(_apart(self._is_angle(stage), a, b) < SAME):
            return False
        if not self.counts:
            return True
        both = np.repeat(z[None], 2, axis=0)
        both[:, stage.unknowns] = a, b
        angles = np.array([c.kind is not Kind.LENGTH for c in self.equations.coordinates])
        return bool(np.all(_apart(angles, *self.program.coordinates(both, np.tile(self.u, (2, 1)), self.p)) < SAME))

    def _near(self, stage: Stage, z: Array) -> tuple[Array, bool]:
        """Starts about the angles that the sketch shows, and whether it shows a large group whole.

        Of a large group that is shown whole only the surroundings of the sketch are searched, if an assembly lies
        there: its assemblies may be many, and the nearest is wanted.
        """
        unknowns = length(stage.unknowns)
        spread = _spread(unknowns)
        shown = self._shown(stage, z)
        near = spread[: 2 * unknowns + 2].copy()
        blur = BLUR * near / np.pi
        blur[: min(1, len(blur))] = 0.0
        whole = unknowns > 2
        for index, column in enumerate(self.equations.unknowns[stage.unknowns]):
            coordinate = self.equations.coordinates[column]
            if coordinate.of_link and coordinate.part == "angle":
                if coordinate.owner in shown:
                    near[:, index] = shown[coordinate.owner] + blur[:, index]
                else:
                    whole = False
        return near, whole

    def _with_lengths(self, stage: Stage, closing: Closing, starts: Array) -> Array:
        """Starts whose lengths follow from their angles: lengths enter linearly, so by least squares."""
        lengths = ~self._is_angle(stage)
        if lengths.any():
            starts[:, lengths] = 0.0
            left, slope = closing(starts)
            starts[:, lengths] = -np.einsum("krm,km->kr", np.linalg.pinv(slope[:, :, lengths]), left)
        return starts

    def _shown(self, stage: Stage, z: Array) -> dict[str, float]:
        """The angle at which the sketch, and the points that are known already, show a link of the group."""
        names = {name for link in stage.links for _, name in self.points_of[link]}
        known = {name: self.first[name] for name in names if self.first[name][0] < stage.level}
        frames, _ = placed(self._w(z), self.column, {link for _, link, _ in known.values()}, {})
        located = {name: self.sketch[name] for name in names if name in self.sketch}
        located |= {name: frames[link].carry(self.local[link][point]) for name, (_, link, point) in known.items()}
        angles = {}
        for link in stage.links:
            ends = [(self.local[link][point], located[name]) for point, name in self.points_of[link] if name in located]
            angle = turn_between(ends) if len(ends) > 1 else None
            if angle is not None:
                angles[link] = angle
        return angles


def closing_of(program: Program, stage: Stage, z: Array, u: Array, p: Array) -> Closing:
    """A group's constraints at tries of its own unknowns, those of earlier groups and all numbers given."""
    function = program.closed(stage)

    def closing(tried: Array) -> tuple[Array, Array]:
        count = len(tried)
        whole = np.repeat(z[None], count, axis=0)
        whole[:, stage.unknowns] = tried
        left, slopes = function.over(count, whole, u, p) if count > 1 else function(whole[0], u, p)
        return left.reshape(count, -1), slopes.reshape(count, *slopes.shape[-2:]).transpose(0, 2, 1)

    return closing


def _apart(angles: Array, a: Array, b: Array) -> Array:
    """How far numbers are apart, those that are angles modulo a turn."""
    return np.where(angles, np.abs(np.exp(1j * a) - np.exp(1j * b)), np.abs(a - b))


def _spread(unknowns: int) -> Array:
    """Angles between -pi and pi spread evenly over the circles (starts, unknowns), the same each time.

    Multiples of powers of the root of x^(d+1) = x + 1, modulo a turn (M. Roberts' R-sequence).
    """
    root = 2.0
    for _ in range(40):
        root = (1.0 + root) ** (1.0 / (unknowns + 1))
    steps = (1.0 / root) ** np.arange(1, unknowns + 1)
    many = min(6 * unknowns**2, MOST_STARTS) or 1
    spread = np.arange(many)[:, None] * steps % 1.0
    return 2.0 * np.pi * np.where(spread > 0.5, spread - 1.0, spread)
