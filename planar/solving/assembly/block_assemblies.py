"""The assemblies of one block, once all earlier blocks are placed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.equations.coordinates import frames_from_coordinates
from planar.equations.rank_conditions import constraint_dependencies
from planar.equations.residuals import split_pair_numbers
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.angles import distances, wrap_angle
from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar
from planar.model.link_shapes import fitted_frame
from planar.solving.newton import (
    CLOSED_TOLERANCE,
    NewtonResult,
    ResidualFunction,
    block_residual_function,
    damped_newton,
    polish_root,
)
from planar.solving.prepared_mechanism import PreparedMechanism

SAME_ASSEMBLY_TOLERANCE = 1e-6
"""Unknowns closer than this are one assembly: within it two would be a dead point to working precision."""
MEETING_COSINE_SQUARED = 1.0 - 1e-6
"""Squared cosine beyond which two assemblies are too near to where they meet to be told apart by a closed form."""
MAX_STARTS = 160
LARGE_BLOCK, START_BATCH = 10, 16
"""Unknowns of a block from which on starts are tried in batches of so many."""
STEPS_PER_BLOCK, STEPS_PER_ROOT = 2.0, 2.0
"""Steps of Newton's method that cost about as much as a closed form and what surrounds it, or as polishing a root."""
LARGE_BATCH = 128
"""Unknowns of all starts together with which a step of Newton's method costs twice as much as one with few."""
START_ANGLE_SPREAD = 0.3
"""Radians: how far about the angles of a sketch starts are spread, so that near twins are both found."""
CLEAR_SKETCH_DISTANCE = 0.03
"""An assembly whose points lie this near to the sketch on average (lengths of the size) is the one that is meant."""


def block_dependencies(setup: PreparedMechanism) -> list[frozenset[int]]:
    """The unknowns of earlier blocks on which each block hangs."""
    columns = constraint_dependencies(setup.functions)
    later = len(setup.equations.unknowns) + len(setup.inputs.u)
    return [
        frozenset().union(*columns[stage.rows]).difference(range(stage.unknowns.start, later))
        for stage in setup.equations.blocks
    ]


class BlockAssembly(NamedTuple):
    """One assembly of a block: all unknowns with this block's filled in, and how it lies.

    `distance`: squared distance to the sketch of the points that the block places (sizes squared); `slides_behind`: how
    many slides are not ahead of their `through`; `height`: mean y of the block's points; `slides_ahead`: how far its
    slides are ahead together.
    """

    z: Array
    distance: float
    slides_behind: float
    height: float
    slides_ahead: float


def is_out_of_reach(coalescence: Scalar) -> Scalar:
    """Whether a block surely has no assembly, by how near the two of its closed form are to where they meet. Infinity
    says that the form divides by nothing: what holds the block is not known then."""
    return (coalescence > 2.0 - MEETING_COSINE_SQUARED) & (coalescence < np.inf)


def closed_form_roots(setup: PreparedMechanism, stage: Block, z: Array) -> Sequence[Array] | None:
    """The unknowns of the two assemblies of a block in closed form, always in the same order, none where it is out of
    reach; None where it has no closed form, or the two all but meet."""
    function = setup.functions.block_assemblies(stage)
    if function is None:
        return None
    roots, residual, coalescence = function(z, setup.inputs.u, setup.inputs.p)
    if is_out_of_reach(coalescence):
        return []
    # what is not a number is not below anything
    return roots if coalescence < MEETING_COSINE_SQUARED and residual <= CLOSED_TOLERANCE else None


class BlockAssemblies:
    """Assemblies of the blocks of one mechanism, at its own inputs."""

    def __init__(self, setup: PreparedMechanism, misfit: float = 0.0, spend: Callable[[float], None] | None = None):
        """`misfit` (sizes) is what blocks with more rows than unknowns may leave open; `spend` is called with the
        effort of each computation, and may raise an exception."""
        self.misfit, self._spend = misfit, spend
        self.effort = 0.0
        "steps of Newton's method taken so far, and what else was computed, counted in such steps"
        self.repeated_effort = 0.0
        "the part of the effort spent on blocks that had been solved before, with earlier blocks elsewhere"
        self._solved_blocks: set[int] = set()
        self._is_repeated = False
        mechanism, unit = setup.mechanism, setup.unit
        self.setup = setup
        self.functions, self.u, self.p = setup.functions, setup.inputs.u, setup.inputs.p
        self.equations, self.pairs, self.column = setup.equations, setup.pairs, setup.column
        self.numbers = split_pair_numbers(mechanism.pairs, self.p.tolist())
        self.local = {
            name: {point: Vector(at.x / unit, at.y / unit) for point, at in shape.points.items()}
            for name, shape in setup.shapes.items()
        }
        self.sketch = {name: Vector(x / unit, y / unit) for name, x, y in mechanism.sketch}
        self.counts_turns = setup.structure.counts
        # each point by the first of its links to be placed, and the points of each link
        self.first_link, self.points_of = setup.structure.point_locations
        self.sketched_by_level: dict[int, list[str]] = {}
        for name in self.sketch:
            self.sketched_by_level.setdefault(self.first_link[name][0], []).append(name)

    def near_sketch(
        self, stage: Block, z: Array, every: bool = False, needs_nearest: bool = True
    ) -> tuple[list[BlockAssembly], Array]:
        """All assemblies of a block that its starts lead to, the ones that an author would mean first.

        Where one lies clearly at the sketch others are looked for only if `every` one is wanted.

        The second is all unknowns at the end of the best start, whether it closes the block or not; z itself where
        nothing closes it and this place is not needed.
        """
        self._is_repeated = stage.block_index in self._solved_blocks
        self._solved_blocks.add(stage.block_index)
        self._count_effort(STEPS_PER_BLOCK)
        both = self._closed_form(stage, z)
        if both:
            return both, both[0].z
        if both is not None and not needs_nearest:
            return [], z
        closing = block_residual_function(self.functions, stage, z, self.u, self.p)
        near, is_shown = self._starts_near_sketch(stage, z)
        unknowns = slice_length(stage.unknowns)
        is_redundant = slice_length(stage.rows) > unknowns
        # out of reach of a closed form nothing closes: the starts near the sketch show where the block is nearest to it
        tolerance = max(CLOSED_TOLERANCE, self.misfit if is_redundant and both is None else 0.0)
        ends = self._solve_from(stage, closing, near, tolerance)
        assemblies = [] if both is not None else self._from_converged(stage, z, closing, ends)
        sketched = len(self.sketched_by_level.get(stage.block_index, ()))
        lower = all(self.pairs[name].is_lower_pair for name in stage.pairs)
        is_dyad = unknowns == 2 and len(stage.pairs) == 3 and lower and len(assemblies) == 2  # there is no third
        is_clear = (
            not every
            and is_shown
            and min((each.distance for each in assemblies), default=np.inf) <= sketched * CLEAR_SKETCH_DISTANCE**2
        )
        if both is None and not (is_dyad or is_clear):
            # all over the circles; of a large block in batches, since any assembly will do without a sketch
            starts = _spread_angles(unknowns)
            batch = len(starts) if unknowns < LARGE_BLOCK else START_BATCH
            for first in range(0, len(starts), batch):
                more = self._solve_from(stage, closing, starts[first : first + batch], tolerance)
                ends = ends.joined(more)
                if not sketched and np.any(more.converged):
                    break
            assemblies = self._from_converged(stage, z, closing, ends)
        nearest = z.copy()
        nearest[stage.unknowns] = ends.unknowns[int(np.argmin(ends.residual))]
        return assemblies, nearest

    def _count_effort(self, steps: float) -> None:
        """Add to `effort`, and to `repeated_effort` where the block was solved before."""
        self.effort += steps
        if self._is_repeated:
            self.repeated_effort += steps
        if self._spend is not None:
            self._spend(steps)

    def _solve_from(
        self, stage: Block, closing: ResidualFunction, starts: Array, tolerance: float = CLOSED_TOLERANCE
    ) -> NewtonResult:
        """Where starts (starts, unknowns) lead whose angles are given: lengths enter linearly, so by least squares."""
        lengths = ~self.equations.unknown_is_angle[stage.unknowns]
        if lengths.any():
            starts[:, lengths] = 0.0
            residuals, jacobian = closing(starts)
            starts[:, lengths] = -np.einsum("krm,km->kr", np.linalg.pinv(jacobian[:, :, lengths]), residuals)
        result = damped_newton(closing, starts, tolerance)
        self._count_effort(result.steps * (1.0 + starts.size / LARGE_BATCH))
        return result

    def _closed_form(self, stage: Block, z: Array) -> list[BlockAssembly] | None:
        """The two assemblies of a block in closed form, none where it is out of reach; None where the form fails."""
        roots = None if self.counts_turns else closed_form_roots(self.setup, stage, z)
        return None if roots is None else self._sorted_assemblies(stage, z, roots)

    def _from_converged(
        self, stage: Block, z: Array, closing: ResidualFunction, ends: NewtonResult
    ) -> list[BlockAssembly]:
        converged = ends.unknowns[ends.converged]
        if self.counts_turns and len(converged):
            # angles take the turn nearest to none, wherever Newton's method wandered, if that is closed too
            wrapped = np.where(self.equations.unknown_is_angle[stage.unknowns], wrap_angle(converged), converged)
            is_closed = np.abs(closing(wrapped)[0]).max(axis=1, initial=0.0) < CLOSED_TOLERANCE
            converged = np.where(is_closed[:, None], wrapped, converged)
            converged = converged[np.argsort(np.abs(converged).sum(axis=1), kind="stable")]
        roots: list[Array] = []
        for root in converged:
            if not any(self._is_same(stage, z, root, other) for other in roots):
                roots.append(polish_root(closing, root))
        self._count_effort(STEPS_PER_ROOT * len(roots))
        return self._sorted_assemblies(stage, z, roots)

    def _sorted_assemblies(self, stage: Block, z: Array, roots: Sequence[Array]) -> list[BlockAssembly]:
        return sorted(
            (self._assembly_of(stage, z, root) for root in roots),
            key=lambda each: (
                each.slides_behind,
                -round(each.height, 9),
                -round(each.slides_ahead, 9),
                *np.round(each.z, 6),
            ),
        )

    def _assembly_of(self, stage: Block, z: Array, root: Array) -> BlockAssembly:
        unknowns = z.copy()
        unknowns[stage.unknowns] = root
        w = self.functions.coordinates_ahead(stage.block_index + 1, unknowns, self.u, self.p)
        position = self.block_position(stage, w.data, self.local, self.numbers)  # floats, few of many
        return BlockAssembly(unknowns, *(float(part) for part in position))

    def block_position(
        self,
        stage: Block,
        w: Sequence[Scalar] | Mapping[int, Scalar] | Array,
        local: Mapping[str, Mapping[str, Vector]],
        numbers: Mapping[str, Sequence[Scalar]],
    ) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """How a block lies, in the order of `BlockAssembly`, at coordinates w in any arithmetic.

        `local` is the positions of points in their links, `numbers` those of pairs, in the same arithmetic.
        """
        names = self.sketched_by_level.get(stage.block_index, ())
        sketched = {name: self.first_link[name][1:] for name in names}
        pairs = {name: self.pairs[name] for name in stage.pairs}
        links = {*stage.links, *(link for pair in pairs.values() for link in pair.bodies)}
        links |= {link for link, _ in sketched.values()}
        frames, pair_coordinates = frames_from_coordinates(w, self.column, links, pairs)
        gaps = [frames[link].to_world(local[link][at]) - self.sketch[name] for name, (link, at) in sketched.items()]
        slides = [
            (pair, pair.input_position([frames[link] for link in pair.bodies], numbers[name], pair_coordinates[name]))
            for name, pair in pairs.items()
            if pair.coordinate_kinds
        ]
        heights = [frames[link].to_world(point).y for link in stage.links for point in local[link].values()]
        return (
            sum(gap.dot(gap) for gap in gaps),
            sum(1.0 - pair.is_intended_assembly(position) for pair, position in slides),
            sum(heights) / len(heights) if heights else 0.0,
            sum(position for _, position in slides),
        )

    def from_all_starts(self, stage: Block, z: Array) -> list[BlockAssembly]:
        """All assemblies of a block that starts about the sketch and all over the circles lead to."""
        closing = block_residual_function(self.functions, stage, z, self.u, self.p)
        starts = np.concatenate([self._starts_near_sketch(stage, z)[0], _spread_angles(slice_length(stage.unknowns))])
        return self._from_converged(stage, z, closing, self._solve_from(stage, closing, starts))

    def _is_same(self, stage: Block, z: Array, a: Array, b: Array) -> bool:
        """Whether two roots of a block are one assembly; where turns count, they are if all that hangs on them is."""
        if not np.all(distances(self.equations.unknown_is_angle[stage.unknowns], a, b) < SAME_ASSEMBLY_TOLERANCE):
            return False
        if not self.counts_turns:
            return True
        both = np.repeat(z[None], 2, axis=0)
        both[:, stage.unknowns] = a, b
        w = self.functions.coordinates(both, np.tile(self.u, (2, 1)), self.p)
        return bool(np.all(distances(~self.setup.structure.is_length, *w) < SAME_ASSEMBLY_TOLERANCE))

    def _starts_near_sketch(self, stage: Block, z: Array) -> tuple[Array, bool]:
        """Starts about the angles that the sketch shows, and whether it shows a large block whole.

        Of a large block that is shown whole only the surroundings of the sketch are searched, if an assembly lies
        there: its assemblies may be many, and the nearest is wanted.
        """
        unknowns = slice_length(stage.unknowns)
        sketched_angles = self._sketched_angles(stage, z)
        starts = _spread_angles(unknowns)[: 2 * unknowns + 2]
        blur = START_ANGLE_SPREAD * starts / np.pi
        blur[:1] = 0.0
        is_shown = unknowns > 2
        for index, column in enumerate(self.equations.unknowns[stage.unknowns]):
            coordinate = self.equations.coordinates[column]
            if coordinate.of_link and coordinate.part == "angle":
                if coordinate.owner in sketched_angles:
                    starts[:, index] = sketched_angles[coordinate.owner] + blur[:, index]
                else:
                    is_shown = False
        return starts, is_shown

    def _sketched_angles(self, stage: Block, z: Array) -> dict[str, float]:
        """The angle at which the sketch, and the points that are known already, show a link of the block."""
        names = {name for link in stage.links for _, name in self.points_of[link]}
        known = {name: self.first_link[name] for name in names if self.first_link[name][0] < stage.block_index}
        w = self.functions.coordinates_ahead(stage.block_index, z, self.u, self.p)
        frames, _ = frames_from_coordinates(w, self.column, {link for _, link, _ in known.values()}, {})
        unit = self.setup.unit
        located = {name: self.sketch[name] * unit for name in names if name in self.sketch}
        located |= {
            name: frames[link].to_world(self.local[link][point]) * unit for name, (_, link, point) in known.items()
        }
        angles = {}
        for link in stage.links:
            places = {point: located[name] for point, name in self.points_of[link] if name in located}
            fitted = fitted_frame(self.setup.shapes[link], places)
            if fitted is not None:
                angles[link] = float(fitted.angle)
        return angles


def _spread_angles(unknowns: int) -> Array:
    """Angles between -pi and pi spread evenly over the circles (starts, unknowns), the same each time.

    Multiples of powers of the root of x^(d+1) = x + 1, modulo a turn (M. Roberts' R-sequence).
    """
    root = 2.0
    for _ in range(40):
        root = (1.0 + root) ** (1.0 / (unknowns + 1))
    steps = (1.0 / root) ** np.arange(1, unknowns + 1)
    count = min(6 * unknowns**2, MAX_STARTS) or 1
    spread = np.arange(count)[:, None] * steps % 1.0
    return 2.0 * np.pi * np.where(spread > 0.5, spread - 1.0, spread)
