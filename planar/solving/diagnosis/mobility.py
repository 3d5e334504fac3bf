"""What can move at a position of a mechanism: motions by rank, links left free, inputs that hold one another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planar.equations.functions import EquationRates
from planar.equations.linear import solve_vectors
from planar.equations.sparse_matrices import SparseMatrices
from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism, pair_entries
from planar.model.pairs import Pair
from planar.solving.checks.singular_values import MIN_REGULARITY, ZERO_REGULARITY, column_norms, null_space, rank
from planar.solving.full_constraints import (
    PROBE_DISTANCE,
    FullConstraints,
    find_closed_position,
    motion_dimension,
    random_step,
)
from planar.solving.newton import correct_blocks
from planar.solving.prepared_mechanism import PreparedMechanism

ZERO_COMPONENT = 1e-7
"""A part of a unit vector that is zero but for rounding."""
MAX_REMOVALS = 60
"""Links or pairs of a structure whose removal is tried."""
MAX_COORDINATES = 200
"""Coordinates: a larger mechanism is not searched for inputs that are stuck, or for how it moves in general."""
NEIGHBOUR_DISTANCE = 1e-2
"""How far (rad, or lengths of the size) a position is moved to see whether what holds there holds elsewhere."""


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
    # the unknowns are determined; each independent way in which the inputs break the rest is a freedom less
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
        near = u + rng.uniform(-NEIGHBOUR_DISTANCE, NEIGHBOUR_DISTANCE, u.size)
        beside = correct_blocks(
            setup.functions,
            p,
            z + rng.uniform(-NEIGHBOUR_DISTANCE, NEIGHBOUR_DISTANCE, z.size),
            near,
            stage.block_index,
        )
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
    """In how many ways the mechanism can move on from a position w, inputs left aside; None where it is too large."""
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
