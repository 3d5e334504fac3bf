"""All constraints of a mechanism in all its coordinates, nothing eliminated, and what they let move.

Lengths are divided by the mechanism's size.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

import numpy as np

from planar.equations.coordinates import FRAME_PARTS, consecutive_ranges, frames_from_coordinates
from planar.equations.elements import ElementGroup, ElementPlacement, group_elements
from planar.equations.functions import EquationRates
from planar.equations.linear import solve_vectors
from planar.equations.mechanism_numbers import scaled_pair_numbers
from planar.equations.residuals import ConstraintRow, pair_residuals
from planar.equations.sparse_matrices import SparseMatrices
from planar.equations.symbolic_equations import Block
from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar
from planar.model.link_shapes import fitted_frame
from planar.model.mechanism import Mechanism, named_points, pair_entries, sketched_places
from planar.model.pairs import MeasureKind, Pair
from planar.solving.checks import MIN_REGULARITY, ZERO_REGULARITY, column_norms, null_space, rank
from planar.solving.newton import correct_blocks, damped_newton
from planar.solving.prepared_mechanism import PreparedMechanism

CLOSED_TOLERANCE = 1e-10
NEAR_DAMPING = 1e-6
"""Of first steps: what is looked for is near by."""
MAX_STARTS = 4
"""Starts from which a linkage is joined that its inputs do not determine."""
START_SPREAD = 0.5
"""Sizes, rad: how far starts after the first are spread about what the sketch shows."""
PROBE_DISTANCE = 0.02
"""How far (sizes, rad) a position is moved along what it allows, to see whether the motion goes on."""
MIN_PROBES, MAX_PROBES = 3, 12
NEIGHBOUR_DISTANCE = 1e-3
"""How far its neighbours are from a position whose motions are counted; what bends back within it is none."""
ZERO_COMPONENT = 1e-7
"""A part of a unit vector that is zero but for rounding."""
MAX_REMOVALS = 60
"""Links or pairs of a structure whose removal is tried."""
MAX_COORDINATES = 200
"""Coordinates: a larger mechanism is not searched for inputs that are stuck, or for how it moves in general."""
SHIFT_DISTANCE = 1e-2
"""How far (rad, or lengths of the size) a position is moved to see whether what holds there holds elsewhere."""


class FullConstraints:
    """The residuals of all pairs, or of some, at coordinates w (coordinates,), as `ConstraintEquations.coordinates` has
    them."""

    def __init__(self, setup: PreparedMechanism, pairs: Sequence[Pair] | None = None):
        self.setup = setup
        self.pairs = tuple(setup.mechanism.pairs if pairs is None else pairs)
        self.coordinates = setup.equations.coordinates
        self.pair_of_row = tuple(pair.name for pair in self.pairs for _ in pair.residual_kinds)
        kinds = [kind for pair in self.pairs for kind in pair.residual_kinds]
        self._angle_rows = np.flatnonzero([kind is MeasureKind.ANGLE for kind in kinds])
        self._numbers = {
            pair.name: scaled_pair_numbers(pair, setup.shapes, setup.unit)
            for pair in (*self.pairs, *setup.relative_motions.values())
        }
        self._groups: dict[tuple[str, ...], list[ElementGroup]] = {}
        "of all pairs, by the relative motions whose positions follow in the rows"
        "of their transposed Jacobians, by the same"

    def row_residuals(self, w: Array | Sequence[Scalar]) -> Iterator[tuple[ConstraintRow, Scalar]]:
        """The residual of every constraint, with its row, at coordinates of any arithmetic; angles with their turns."""
        frames, own = frames_from_coordinates(w, self.setup.column, self.setup.shapes, self.setup.pairs)
        return pair_residuals(self.pairs, frames, self._numbers, own)

    def jacobian(self, w: Array, held: tuple[str, ...] = ()) -> Array:
        """(rows, coordinates) of the pairs, then of relative motions that are held."""
        return self.residuals_and_jacobian(w, held)[1]

    def free_motions(self, w: Array, held: tuple[str, ...] = ()) -> Array:
        """The motions that are free to first order at w while relative motions are held: orthonormal columns
        (coordinates, freedoms)."""
        return null_space(self.jacobian(w, held))

    def relative_positions(self, names: tuple[str, ...], w: Array) -> Array:
        """The positions of these relative motions (names,)."""
        return self.residuals_and_jacobian(w, names)[0][len(self.pair_of_row) :]

    def relative_jacobian(self, names: tuple[str, ...], w: Array) -> Array:
        """(names, coordinates)"""
        return self.jacobian(w, names)[len(self.pair_of_row) :]

    def points_and_jacobian(self, members: Sequence[tuple[str, str]], w: Array) -> tuple[Array, Array]:
        """Where points (link, point) are, x and y of each (2 points,), in sizes, and the Jacobian (2 points,
        coordinates)."""
        shapes, scale = self.setup.shapes, 1.0 / self.setup.unit
        frames, _ = frames_from_coordinates(w, self.setup.column, shapes, {})
        places: Array = np.empty(2 * len(members))
        jacobian: Array = np.zeros((2 * len(members), len(w)))
        for row, (link, point) in enumerate(members):
            arm = frames[link].rotate_to_world(shapes[link].points[point] * scale)
            places[2 * row : 2 * row + 2] = frames[link].x + arm.x, frames[link].y + arm.y
            if (link, "x") in self.setup.column:
                columns = [self.setup.column[link, part] for part in FRAME_PARTS]
                jacobian[2 * row : 2 * row + 2, columns] = (1.0, 0.0, -arm.y), (0.0, 1.0, arm.x)
        return places, jacobian

    def correct(self, w: Array, held: tuple[str, ...] = (), positions: Array | float = 0.0) -> Array | None:
        """The nearest closed position by Gauss and Newton's method, relative motions held at positions; None where
        there is none."""
        closed = self.correct_all(w[None], held, positions)
        return closed[0] if len(closed) else None

    def correct_all(self, starts: Array, held: tuple[str, ...] = (), positions: Array | float = 0.0) -> Array:
        """The same from several starts (starts, coordinates) at once, those that lead to a closed position."""
        result = damped_newton(
            lambda w: self.residuals_and_jacobian(w, held, positions), starts, CLOSED_TOLERANCE, NEAR_DAMPING
        )
        return result.unknowns[result.converged]

    def residuals_and_jacobian(
        self, w: Array, held: tuple[str, ...] = (), positions: Array | float = 0.0
    ) -> tuple[Array, Array]:
        """Residuals (..., rows) and Jacobian (..., rows, coordinates) of the pairs, then of relative motions that are
        held, at positions w (..., coordinates)."""
        flat = w.reshape(int(np.prod(w.shape[:-1])), w.shape[-1])
        pair_rows, row_count = len(self.pair_of_row), len(self.pair_of_row) + len(held)
        residuals: Array = np.zeros((len(flat), row_count))
        jacobian: Array = np.zeros((len(flat), row_count, w.shape[-1]))
        for group in self._groups_with(held):
            values, slopes = group.evaluate(flat, self._p)
            residuals[:, group.rows] = values
            for column, coordinates in enumerate(group.coordinates.T):  # a link may be two bodies of a pair
                jacobian[:, group.rows, coordinates[:, None]] += slopes[..., column]
        residuals[:, pair_rows:] -= positions
        residuals[:, self._angle_rows] = wrap_angle(residuals[:, self._angle_rows])
        return residuals.reshape(*w.shape[:-1], row_count), jacobian.reshape(*w.shape[:-1], row_count, w.shape[-1])

    @cached_property
    def _p(self) -> Array:
        """The numbers of all pairs and relative motions (1, numbers)."""
        return np.array([[number for numbers in self._numbers.values() for number in numbers]], dtype=float)

    def _groups_with(self, held: tuple[str, ...]) -> list[ElementGroup]:
        if held not in self._groups:
            placed, row = [], 0
            for pair in self.pairs:
                placed.append(self._placement.residual_of(pair, row))
                row += len(pair.residual_kinds)
            motions = [self.setup.relative_motions[name] for name in held]
            placed += [self._placement.input_position_of(motion, row + k) for k, motion in enumerate(motions)]
            self._groups[held] = group_elements(placed)
        return self._groups[held]

    @cached_property
    def _placement(self) -> ElementPlacement:
        column = self.setup.column
        moving = [link for link in self.setup.shapes if (link, "x") in column]
        return ElementPlacement(
            {link: [column[link, part] for part in FRAME_PARTS] for link in moving},
            {
                name: [column[name, part] for part, _ in pair.coordinate_kinds]
                for name, pair in self.setup.pairs.items()
            },
            consecutive_ranges({name: len(values) for name, values in self._numbers.items()}),
        )


def sketch_coordinates(setup: PreparedMechanism, seed: int) -> Array:
    """Coordinates w with the links about where the sketch has their points; what it does not show is at random.

    Pins on the frame are where the frame has them.
    """
    rng = np.random.default_rng(seed)
    w = rng.uniform(-1.0, 1.0, len(setup.equations.coordinates))
    frame, places = setup.mechanism.frame, sketched_places(setup.mechanism)
    for named in named_points(setup.mechanism):
        on_frame = [setup.shapes[frame].points[point] for link, point in named.members if link == frame]
        for link, point in named.members if on_frame else ():
            places.setdefault(link, {})[point] = on_frame[-1]
    for link, points in places.items():
        if (link, "x") not in setup.column:
            continue
        columns = [setup.column[link, part] for part in FRAME_PARTS]
        fitted = fitted_frame(setup.shapes[link], points)
        if fitted is None:
            angle = float(w[columns[2]]) * np.pi
            axis = Vector(np.cos(angle), np.sin(angle))
            origins = [place - setup.shapes[link].points[point].rotate(axis) for point, place in points.items()]
            w[columns] = *(np.mean(origins, axis=0) / setup.unit), angle
        else:
            w[columns] = fitted.x / setup.unit, fitted.y / setup.unit, fitted.angle
    return w + (START_SPREAD * rng.normal(size=w.size) if seed else 0.0)


def random_step(free: Array, rng: np.random.Generator, length: float) -> Array:
    """A random move of a length within the columns of `free`."""
    move = free @ rng.normal(size=free.shape[1])
    return move * (length / np.linalg.norm(move))


def find_closed_position(constraints: FullConstraints) -> Array | None:
    """A closed position near the sketch, with the inputs where they are if that can be; None where none is found."""
    setup = constraints.setup
    names = tuple(given.pair for given in setup.mechanism.inputs)
    for held in dict.fromkeys((names, ())):
        for seed in range(MAX_STARTS):
            w = constraints.correct(sketch_coordinates(setup, seed), held, setup.inputs.u if held else 0.0)
            if w is not None:
                return w
    return None


def motion_dimension(constraints: FullConstraints, w: Array) -> tuple[int, Array]:
    """The dimension of the motion that leads away from a position, and a position on it."""
    free = constraints.free_motions(w)
    dimension, rank, position = 0, -1, w
    single = free.shape[1] == 1  # which leaves two directions to probe, and no random ones
    for seed in range((2 if single else MAX_PROBES) if free.size else 0):
        rng = np.random.default_rng(seed)
        step = (1.0 - 2.0 * seed) * PROBE_DISTANCE * free[:, 0] if single else random_step(free, rng, PROBE_DISTANCE)
        probe = constraints.correct(w + step)
        if probe is not None:
            probe_free = constraints.free_motions(probe)
            spread = _spread_dimension(constraints, probe, probe_free, rng), w.size - probe_free.shape[1]
            # of places that move alike the one where nothing is singular: some fall back beside w
            if spread > (dimension, rank):
                (dimension, rank), position = spread, probe
        if seed >= MIN_PROBES and dimension + rank == w.size:
            break
    return dimension, position


def _spread_dimension(constraints: FullConstraints, w: Array, free: Array, rng: np.random.Generator) -> int:
    """In how many directions the closed positions next to one spread, of those that are `free` to first order."""
    count = 2 * free.shape[1] + 2 if free.size else 0
    if not count:
        return 0
    starts = np.array([w + random_step(free, rng, NEIGHBOUR_DISTANCE) for _ in range(count)])
    moves = (constraints.correct_all(starts) - w) / NEIGHBOUR_DISTANCE
    if not len(moves):
        return 0
    values = np.linalg.svd(moves, compute_uv=False)
    return int(np.sum(values > 0.1 * np.sqrt(len(moves) / free.shape[1])))


def mobility_by_rank(setup: PreparedMechanism, motion: EquationRates) -> tuple[int, tuple[Block, ...]]:
    """The mobility at a position, to first order, and the blocks that are singular there.

    With the inputs' positions counted as unknowns, the pairs leave free unknowns + inputs - rank.
    """
    inputs = setup.inputs.u.size
    is_block_weak = setup.jacobian_regularity(motion.jacobian) < MIN_REGULARITY
    weak = tuple(block for block, is_weak in zip(setup.equations.blocks, is_block_weak, strict=True) if is_weak)
    if weak:
        jacobian = np.hstack([motion.jacobian, motion.input_jacobian])
        total_rank = rank(_scaled_jacobian(setup, jacobian), MIN_REGULARITY, unit=1.0)
        return len(setup.equations.unknowns) + inputs - total_rank, weak
    if motion.jacobian.shape[0] == motion.jacobian.shape[1]:
        return inputs, ()
    # the unknowns are determined; each independent contradiction of the inputs to the rest is a freedom less
    sizes = np.maximum(np.linalg.norm(motion.input_jacobian, axis=0), ZERO_REGULARITY)
    rates = np.linalg.lstsq(motion.jacobian, motion.input_jacobian, rcond=1e-12)[0]
    residual = (motion.input_jacobian - motion.jacobian @ rates) / sizes
    return inputs - int(np.sum(np.linalg.svd(residual, compute_uv=False) > MIN_REGULARITY)), ()


def _scaled_jacobian(setup: PreparedMechanism, jacobian: Array | SparseMatrices) -> Array:
    """A Jacobian (..., rows, unknowns and inputs), every block's lengths in units of its reach, columns of one size.

    The size of an unknown's column is that in its own block, however large or small the things that hang on it are. A
    column that could reach further than it does now keeps what it lacks: it is that which vanishes.
    """
    jacobian = np.asarray(jacobian)
    scaled = jacobian / setup.row_scale[:, None]
    sizes = np.maximum(np.linalg.norm(jacobian, axis=-2), 1.0)
    for stage in setup.equations.blocks:
        norms = column_norms(scaled[..., stage.rows, stage.unknowns], setup.min_column_scale[stage.unknowns])
        sizes[..., stage.unknowns] = norms
    return scaled / sizes[..., None, :]


def input_rates_agree(setup: PreparedMechanism, motion: EquationRates) -> bool:
    """Whether rates of the inputs that are more than the freedom do not contradict one another."""
    residual = motion.F1 - motion.jacobian @ solve_vectors(motion.jacobian, motion.F1)
    scale = np.max(np.abs(setup.inputs.u1), initial=0.0) or 1.0
    return bool(np.max(np.abs(residual), initial=0.0) <= 1e-9 * scale)


def is_always_singular(setup: PreparedMechanism, stage: Block, z: Array) -> bool:
    """Whether a block is singular in closed positions near by too, so that it is no matter of this one."""
    u, p = setup.inputs.u, setup.inputs.p
    for seed in range(3):
        rng = np.random.default_rng(seed)
        near = u + rng.uniform(-SHIFT_DISTANCE, SHIFT_DISTANCE, u.size)
        start = z + rng.uniform(-SHIFT_DISTANCE, SHIFT_DISTANCE, z.size)
        beside = correct_blocks(setup.functions, p, start, near, stage.block_index)
        if beside is not None and setup.block_regularity(beside, near)[stage.block_index] > ZERO_REGULARITY:
            return False
    return True


def links_free_at_rest(setup: PreparedMechanism, jacobian: Array | SparseMatrices) -> list[str]:
    """The links that can move while the inputs are held, from the null vectors of the Jacobian."""
    null = null_space(_scaled_jacobian(setup, jacobian), MIN_REGULARITY, unit=1.0)
    return moved_links(setup, np.max(np.abs(null), axis=1)) if null.size else []


def moved_links(setup: PreparedMechanism, rates: Array) -> list[str]:
    """The links that rates of the unknowns (unknowns,) move."""
    share = np.abs(rates)
    owners = [
        setup.equations.coordinates[column].owner
        for column, part in zip(setup.equations.unknowns, share, strict=True)
        if part > 1e-3 * share.max()
    ]
    joined = [link for name in owners for link in (setup.pairs[name].links if name in setup.pairs else (name,))]
    return [link for link in dict.fromkeys(joined) if link != setup.mechanism.frame]


def smallest_dependent_sets(
    left_null: Array, owners: Sequence[str], order: Callable[[str], Sequence[str]]
) -> tuple[tuple[str, ...], ...]:
    """The smallest sets of owners of rows that depend on one another.

    `left` (rows, k) spans the combinations of rows that vanish; an owner is left out as long as a combination without
    it still holds the one that is asked for, in the order `order` gives for that one.
    """
    rows_of: dict[str, list[int]] = {}
    for row, owner in enumerate(owners):
        rows_of.setdefault(owner, []).append(row)
    sets: dict[tuple[str, ...], None] = {}
    for owner, rows in rows_of.items():
        span = left_null
        if np.linalg.norm(span[rows]) < ZERO_COMPONENT:
            continue
        for other in order(owner):
            # the columns are orthonormal, so sizes mean something
            without = span @ null_space(span[rows_of.get(other, [])], ZERO_COMPONENT, unit=1.0)
            if without.size and np.linalg.norm(without[rows]) > ZERO_COMPONENT:
                span = without
        sets[tuple(name for name, each in rows_of.items() if np.linalg.norm(span[each]) > ZERO_COMPONENT)] = None
    return tuple(sorted(sets, key=len))


def find_jammed_inputs(setup: PreparedMechanism, w: Array | None = None) -> tuple[list[str], list[str]] | None:
    """Inputs that no motion of the pairs can move while others can: their names, and the links that are free.

    At a closed position w and beside it, or at one that is looked for. None where the mechanism cannot be joined, or
    every input moves.
    """
    names = tuple(given.pair for given in setup.mechanism.inputs)
    constraints = FullConstraints(setup)
    positions = _closed_positions(constraints, w) if names else ()
    if not positions:
        return None
    moves = np.zeros(len(names))
    for position in positions:
        free = constraints.free_motions(position)
        rates = np.abs(constraints.relative_jacobian(names, position) @ free)
        moves = np.maximum(moves, rates.max(axis=1, initial=0.0))
    jammed = [name for name, move in zip(names, moves, strict=True) if move < 100.0 * ZERO_COMPONENT]
    if not jammed or not free.size:
        return None
    share = np.abs(free).max(axis=1)
    links = dict.fromkeys(
        coordinate.owner
        for coordinate, part in zip(constraints.coordinates, share, strict=True)
        if coordinate.of_link and part > 1e-4
    )
    return jammed, list(links)


def count_motions(setup: PreparedMechanism, w: Array) -> int | None:
    """The dimension of the motion of a mechanism on from a position w, inputs left aside; None if it is too large."""
    return motion_dimension(FullConstraints(setup), w)[0] if w.size <= MAX_COORDINATES else None


def releasing_parts(setup: PreparedMechanism, w: Array) -> tuple[str | None, tuple[str, ...]]:
    """What lets the inputs of a structure at a position w move when it is removed: a link with its pairs, or one pair.

    Returns the link (None: a pair alone, where no link will do) and the names of the pairs; none if nothing is found.
    Links at driven pairs and driven pairs are left out. What leaves one freedom for each input is preferred.
    """
    mechanism = setup.mechanism
    names = tuple(given.pair for given in mechanism.inputs)
    driven = {link for name in names for link in setup.relative_motions[name].bodies}
    input_rows = FullConstraints(setup).relative_jacobian(names, w)

    def freedoms(pairs: Sequence[Pair], removed: str | None) -> int:
        """How many freedoms these pairs leave; 0 where some input cannot move."""
        constraints = FullConstraints(setup, pairs)
        owners = {pair.name for pair in pairs} | {link.name for link in mechanism.links if link.name != removed}
        columns = [coordinate.owner in owners for coordinate in constraints.coordinates]
        free = null_space(constraints.jacobian(w)[:, columns])
        rates = np.abs(input_rows[:, columns] @ free).max(axis=1, initial=0.0)
        return free.shape[1] if np.all(rates > 100.0 * ZERO_COMPONENT) else 0

    links = [link.name for link in mechanism.links if link.name not in driven | {mechanism.frame}]
    choices: list[tuple[str | None, list[Pair]]] = [(link, _pairs_without(mechanism, link)) for link in links]
    entries = [group for group in pair_entries(mechanism) if len(group) == 1 and group[0].name not in names]
    for kind in (choices, [(None, [pair for pair in mechanism.pairs if pair not in group]) for group in entries]):
        counted = [(freedoms(pairs, link), link, pairs) for link, pairs in kind[:MAX_REMOVALS]]
        released = [choice for choice in counted if choice[0]]
        if released:
            _, link, pairs = min(released, key=lambda choice: choice[0])
            remaining = {pair.name for pair in pairs}
            removed = [
                pair for pair in mechanism.pairs if (link in pair.bodies if link else pair.name not in remaining)
            ]
            return link, tuple(dict.fromkeys(pair.entry_name() for pair in removed))
    return None, ()


def _pairs_without(mechanism: Mechanism, link: str) -> list[Pair]:
    """The pairs of a mechanism without a link; the other links of its pins stay joined to one another."""
    pairs: list[Pair] = []
    for group in pair_entries(mechanism):
        rest = [pair for pair in type(group[0]).relative_motions(group) if link not in pair.bodies]
        pairs += [pair for pair in rest if pair.links[0] == rest[0].links[0]]
    return pairs


def can_move_alone(setup: PreparedMechanism, w: Array, pair: str) -> bool:
    """Whether the input at a pair can move from a position w, to first order, while the other inputs stand still."""
    others = tuple(given.pair for given in setup.mechanism.inputs if given.pair != pair)
    return FullConstraints(setup).free_motions(w, others).size > 0


def is_rigid(setup: PreparedMechanism, w: Array) -> bool:
    """Whether the pairs, inputs left aside, allow no motion from a position w even to first order."""
    return not FullConstraints(setup).free_motions(w).size


def find_conflicting_inputs(setup: PreparedMechanism) -> tuple[tuple[str, ...], ...]:
    """The smallest sets of inputs that move one another, or cannot move; none where the mechanism cannot be joined."""
    names = tuple(given.pair for given in setup.mechanism.inputs)
    constraints = FullConstraints(setup)
    positions = _closed_positions(constraints)
    if not positions:
        return ()
    w = positions[-1]
    rates = constraints.relative_jacobian(names, w) @ constraints.free_motions(w)
    together = null_space(rates.T) if rates.size else np.eye(len(names))
    return smallest_dependent_sets(together, names, lambda name: [other for other in names if other != name])


def _closed_positions(constraints: FullConstraints, w: Array | None = None) -> tuple[Array, ...]:
    """A closed position (w, or one with the inputs where they are if possible) and a generic one beside it; empty if
    there is none."""
    if len(constraints.coordinates) > MAX_COORDINATES:
        return ()
    w = find_closed_position(constraints) if w is None else w
    if w is None:
        return ()
    free = constraints.free_motions(w)
    beside = constraints.correct(w + random_step(free, np.random.default_rng(0), PROBE_DISTANCE)) if free.size else None
    return (w,) if beside is None else (w, beside)
