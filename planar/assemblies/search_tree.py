"""The search tree of assemblies: block after block, each with the assemblies that the choices before allow."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from planar.assemblies.polynomial.completeness import BlockRoots, Completeness
from planar.equations.block_type_functions import POLISHING_STEPS
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.angles import distances
from planar.foundation.arrays import Array
from planar.foundation.generic_numbers import generic_numbers
from planar.foundation.time_limit import stop_if_over
from planar.model.pairs import MeasureKind
from planar.solving.assembly.block_assemblies import block_dependencies, closed_form_roots
from planar.solving.newton import CLOSED_TOLERANCE, block_residual_function, one_system, repeat_step
from planar.solving.prepared_mechanism import PreparedMechanism

BEST_TO_WORST = (Completeness.PROVED, Completeness.NUMERICALLY, Completeness.NOT)
"""From the best to the worst."""
SAME_ROOT_DISTANCE, SAME_DOUBLE_ROOT_DISTANCE = 1e-6, 1e-4
"""How near to a root unknowns are that root, and one where two meet, which rounding puts farther off."""
REGULAR_SINGULAR_VALUE = 1e-9
"""A linear block whose Jacobian is weaker than this part of itself has no single assembly."""
CONGRUENCE_DIGITS = 9
"""Decimals (sizes, rad) by which positions are compared that are congruent but for rounding."""
JACOBIAN_ROUNDING = 1e-12
"""What is rounding in a Jacobian."""


class AssemblyPath(NamedTuple):
    """One assembly of all blocks: which root of each (from 0), the unknowns, and what is known of those roots."""

    choices: tuple[int, ...]
    z: Array
    certified: bool
    double: bool


class _CountingNode:
    """A block on the path of counting: the root that is next, and the number of assemblies with those before."""

    def __init__(self, index: int, key: bytes, real: Array):
        self.index, self.key, self.real = index, key, real
        self.rank = self.total = 0
        self.is_over_budget = False


class _Count:
    """Counting of assemblies block after block: blocks with equal keys have equally many, and are counted once."""

    def __init__(
        self,
        tree: AssemblyTree,
        key: Callable[[int, Array], bytes],
        counted: list[dict[bytes, int]],
        budget: list[int],
    ):
        self.tree, self.key, self.counted, self.budget = tree, key, counted, budget

    def count_from(self, first: int, z: Array) -> int | None:
        """How many assemblies the blocks from one on have; None where the budget does not reach."""
        z = z.copy()
        path: list[_CountingNode] = []
        count = self._count_or_push(first, z, path)
        while path:
            node = path[-1]
            if count is not None:
                node.total += count
            elif node.is_over_budget:
                return None
            if node.rank == len(node.real):
                self.counted[node.index][node.key] = count = node.total
                path.pop()
                continue
            z[self.tree.stages[node.index].unknowns] = node.real[node.rank]
            node.rank += 1
            count = self._count_or_push(node.index + 1, z, path)
        return count

    def _count_or_push(self, index: int, z: Array, path: list[_CountingNode]) -> int | None:
        """How many the blocks from one on have if that is known, else the block is put on the path to be counted."""
        if index == len(self.tree.stages):
            return 1
        key = self.key(index, z)
        if key not in self.counted[index]:
            self.budget[0] -= max(1, slice_length(self.tree.stages[index].unknowns) ** 3 // 8)
            if self.budget[0] >= 0:
                path.append(_CountingNode(index, key, self.tree.roots(index, z).real))
            elif path:
                path[-1].is_over_budget = True
            return None
        return self.counted[index][key]


class AssemblyTree:
    """The assemblies of a mechanism at its inputs, block after block; nothing is solved before it is asked for.

    A block that hangs on the same choices before it is solved once.
    """

    def __init__(self, setup: PreparedMechanism, certify: bool):
        self.setup, self.certify = setup, certify
        self.stages = setup.equations.blocks
        touched = block_dependencies(setup)
        self._dependencies = [np.array(sorted(columns), dtype=int) for columns in touched]
        # what is chosen before a block and matters for it or for a later one
        self._relevant_choices: list[Array] = []
        later: set[int] = set()
        for stage, columns in zip(reversed(self.stages), reversed(touched), strict=True):
            later = {column for column in later | columns if column < stage.unknowns.start}
            self._relevant_choices.append(np.array(sorted(later), dtype=int))
        self._relevant_choices.reverse()
        self._solved: list[dict[bytes, BlockRoots]] = [{} for _ in self.stages]
        self._dead_ends: list[set[bytes]] = [set() for _ in self.stages]
        self._counted: list[dict[bytes, int]] = [{} for _ in self.stages]
        self._counted_congruent: list[dict[bytes, int]] = [{} for _ in self.stages]

    def roots(self, index: int, z: Array) -> BlockRoots:
        """The assemblies of one block, the unknowns of those before it in z (unknowns,)."""
        key = z[self._dependencies[index]].tobytes()
        known = self._solved[index]
        if key not in known:
            stop_if_over(f"before group {index + 1} of {len(self.stages)} was assembled")
            known[key] = _solve_block(self.setup, self.stages[index], z, self.certify)
        return known[key]

    def solved_roots(self, index: int) -> tuple[BlockRoots, ...]:
        """What has been found of one block so far, once for each of the places of those before it."""
        return tuple(self._solved[index].values())

    @property
    def complete(self) -> Completeness:
        """How surely what has been solved of the blocks is all: of a curve only one place is taken further."""
        found = [self.solved_roots(index) for index in range(len(self.stages))]
        if any(each.has_curve for of in found[:-1] for each in of):
            return Completeness.NOT
        return max((each.complete for of in found for each in of), key=BEST_TO_WORST.index, default=Completeness.PROVED)

    def moving_links(self) -> Sequence[str]:
        """Where there is no assembly: links with a curve of them, of which another place might go on to one.

        None of them where some block never goes together that does not hang on any such curve.
        """
        moving: list[str] = []
        hanging: set[int] = set()
        for index, stage in enumerate(self.stages):
            if not self._dependencies[index].size:  # the list may have ended before it came to this one
                self.roots(index, np.zeros(len(self.setup.equations.unknowns)))
            found = self.solved_roots(index)
            if any(each.has_curve for each in found):
                moving += stage.links
            elif not hanging.intersection(self._dependencies[index].tolist()):
                if found and not any(len(each.real) for each in found):
                    return ()
                continue
            hanging.update(range(stage.unknowns.start, stage.unknowns.stop))
        return moving

    def paths(self) -> Iterator[AssemblyPath]:
        """All assemblies: of the first block the first, and with it those of the next in order, and so on."""
        z = np.zeros(len(self.setup.equations.unknowns))
        if not self.stages:
            yield AssemblyPath((), z, True, False)
            return
        # of every block on the way: its roots, the one that is next, and whether an earlier one led to an end
        way: list[list[Any]] = [[self.roots(0, z), 0, False]]
        while way:
            found, rank, led = way[-1]
            depth = len(way) - 1
            if rank == len(found.real):
                way.pop()
                if not led:
                    self._dead_ends[depth].add(self._choice_key(depth, z))
                elif way:
                    way[-1][2] = True
                continue
            way[-1][1] += 1
            z[self.stages[depth].unknowns] = found.real[rank]
            if depth + 1 == len(self.stages):
                way[-1][2] = True
                yield self._path(way, z)
            elif self._choice_key(depth + 1, z) not in self._dead_ends[depth + 1]:
                way.append([self.roots(depth + 1, z), 0, False])

    def _path(self, way: list[list[Any]], z: Array) -> AssemblyPath:
        ranks = [(found, rank - 1) for found, rank, _ in way]
        return AssemblyPath(
            tuple(rank for _, rank in ranks),
            z.copy(),
            all(bool(found.certified[rank]) for found, rank in ranks),
            any(bool(found.double[rank]) for found, rank in ranks),
        )

    def path_to(self, target: Array) -> AssemblyPath | None:
        """The assembly with given unknowns (unknowns,); None where it is none of these."""
        z = np.zeros_like(target)
        way: list[list[Any]] = []
        for index, stage in enumerate(self.stages):
            found = self.roots(index, z)
            if not len(found.real):
                return None
            is_angle = self.setup.equations.unknown_is_angle[stage.unknowns]
            gaps = distances(is_angle, found.real, target[stage.unknowns]).max(axis=1, initial=0.0)
            rank = int(np.argmin(gaps))
            if gaps[rank] > (SAME_DOUBLE_ROOT_DISTANCE if found.double[rank] else SAME_ROOT_DISTANCE):
                return None
            z[stage.unknowns] = found.real[rank]
            way.append([found, rank + 1, True])
        return self._path(way, z)

    def count_before(self, path: AssemblyPath, most: int) -> int | None:
        """How many assemblies stand before one in order; None where telling takes more than so many dyads solved."""
        z, found, budget = np.zeros_like(path.z), 0, [most]
        for depth, rank in enumerate(path.choices):
            real = self.roots(depth, z).real
            for other in range(rank):
                z[self.stages[depth].unknowns] = real[other]
                count = self._count_from(depth + 1, z, budget)
                if count is None:
                    return None
                found += count
            z[self.stages[depth].unknowns] = real[rank]
        return found

    def count(self, most: int) -> int | None:
        """How many assemblies there are, without listing those of blocks that do not hang on each other.

        None where that takes more than so many dyads solved, or what larger blocks are in dyads.
        """
        return self._count_from(0, np.zeros(len(self.setup.equations.unknowns)), [most])

    def _count_from(self, first: int, z: Array, budget: list[int]) -> int | None:
        """How many assemblies the blocks from one on have; `budget` runs down as blocks are solved.

        Where counting by equal choices takes more than that, congruent positions count as equal: blocks that differ by
        a common rigid motion of all that they are joined to have equally many assemblies. A certified tree is not
        counted so, since each of its blocks is to be proved.
        """
        remaining = budget[0]
        count = _Count(self, self._choice_key, self._counted, budget).count_from(first, z)
        if count is not None or self.certify:
            return count
        budget[0] = remaining
        return _Count(self, self._congruence_key, self._counted_congruent, budget).count_from(first, z)

    def _congruence_key(self, index: int, z: Array) -> bytes:
        """Where the links that blocks from one on are joined to lie relative to the first of them, and its own parts.

        Rounded, so that positions that are congruent but for rounding are one.
        """
        links, columns = self._boundaries[index]
        w = self.setup.functions.coordinates(z, self.setup.inputs.u, self.setup.inputs.p)
        poses = np.array([[w[column] if column >= 0 else 0.0 for column in link] for link in links]).reshape(-1, 3)
        if len(poses):
            angle = poses[0, 2]
            poses = poses - poses[0]
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            poses[:, :2] = poses[:, :2] @ turn
            if not self.setup.structure.counts:
                poses[:, 2] = np.remainder(poses[:, 2] + np.pi, 2.0 * np.pi)
        return (np.round(np.concatenate([poses.ravel(), w[columns]]), CONGRUENCE_DIGITS) + 0.0).tobytes()

    @cached_property
    def _boundaries(self) -> list[tuple[list[tuple[int, ...]], list[int]]]:
        """For every block: the columns x, y and angle in w of the links placed before it to which it or a later block
        is joined (-1: fixed), and the columns of the own coordinates of the joining pairs that are known before it."""
        setup = self.setup
        level = setup.equations.known_after_block
        parts = {
            link.name: tuple(setup.column.get((link.name, part), -1) for part in ("x", "y", "angle"))
            for link in setup.mechanism.links
        }
        link_level = {
            name: max((level[column] for column in columns if column >= 0), default=-1)
            for name, columns in parts.items()
        }
        driven = [setup.relative_motions[given.pair] for given in setup.mechanism.inputs]
        boundaries = []
        for index in range(len(self.stages)):
            later = {name for stage in self.stages[index:] for name in stage.pairs}
            joining = [
                pair
                for pair in (*setup.mechanism.pairs, *driven)
                if pair.name in later or any(link_level[link] >= index for link in pair.bodies)
            ]
            bodies = dict.fromkeys(link for pair in joining for link in pair.bodies if link_level[link] < index)
            names = {pair.name for pair in joining}
            columns = [
                column
                for column, coordinate in enumerate(setup.equations.coordinates)
                if not coordinate.of_link and coordinate.owner in names and level[column] < index
            ]
            boundaries.append(([parts[link] for link in bodies], columns))
        return boundaries

    def _choice_key(self, index: int, z: Array) -> bytes:
        """What of the choices before a block matters for it and for all later ones."""
        return z[self._relevant_choices[index]].tobytes()


def _solve_block(setup: PreparedMechanism, stage: Block, z: Array, certify: bool) -> BlockRoots:
    """One block: nothing to choose, one linear solution, two in closed form, or a larger block."""
    if not slice_length(stage.unknowns):
        left, _ = setup.functions.block_call(stage)(z, setup.inputs.u, setup.inputs.p)
        stands = int(np.abs(left).max(initial=0.0) <= CLOSED_TOLERANCE)
        return _uncertified_roots(np.zeros((stands, 0)), stands, "it stands with the others")
    known = _linear_roots(setup, stage, z)
    if known is None:
        dyad = closed_form_roots(setup, stage, z)
        known = None if dyad is None else _uncertified_roots(np.array(dyad).reshape(-1, 2), 2, "in closed form")
    if known is not None and not certify:
        return known
    # positions of dyads alone are told without what larger blocks need
    from planar.assemblies.block_roots import block_roots

    found = block_roots(setup, stage, z, certify)
    return found if known is None else _in_known_order(known, found)


def _in_known_order(known: BlockRoots, found: BlockRoots) -> BlockRoots:
    """What has been found and certified, in the order of what was known before, which stays as the block moves."""
    if len(known.real) != len(found.real) or found.complete is Completeness.NOT:
        return known
    gaps = distances(np.array(True), known.real[:, None, :], found.real[None, :, :]).sum(axis=2)
    order = gaps.argmin(axis=1) if len(known.real) else np.zeros(0, dtype=int)
    if sorted(order) != list(range(len(order))):
        return known
    return found._replace(real=found.real[order], double=found.double[order], certified=found.certified[order])


def _uncertified_roots(real: Array, expected: int, said: str) -> BlockRoots:
    """What follows from the form of the equations; that it is so in these numbers only rounding stands for."""
    none = np.zeros(len(real), dtype=bool)
    return BlockRoots(real, none, none, expected, expected, Completeness.NUMERICALLY, False, said)


def is_linear(setup: PreparedMechanism, stage: Block, z: Array) -> bool:
    """Whether the Jacobian of a block does not depend on its own unknowns, those before it given in z (unknowns,)."""
    many = slice_length(stage.unknowns)
    closing = one_system(block_residual_function(setup.functions, stage, z, setup.inputs.u, setup.inputs.p))
    slope = closing(np.zeros(many))[1]
    others = (closing(each)[1] for each in generic_numbers(2, many))
    return all(np.abs(other - slope).max(initial=0.0) <= JACOBIAN_ROUNDING for other in others)


def _linear_roots(setup: PreparedMechanism, stage: Block, z: Array) -> BlockRoots | None:
    """The one assembly of a block whose constraints are linear in its unknowns; None where they are not."""
    e, many = setup.equations, slice_length(stage.unknowns)
    rows = e.rows[stage.rows]
    if len(rows) != many or (many > 1 and any(row.kind is MeasureKind.ANGLE for row in rows)):
        return None
    closing = one_system(block_residual_function(setup.functions, stage, z, setup.inputs.u, setup.inputs.p))
    at: Array = np.zeros(many)
    slope = closing(at)[1]
    if not is_linear(setup, stage, z):
        return None
    values = np.linalg.svd(slope, compute_uv=False)
    turns = any(row.kind is MeasureKind.ANGLE for row in rows) and abs(abs(slope[0, 0]) - 1.0) > JACOBIAN_ROUNDING
    if values[-1] < REGULAR_SINGULAR_VALUE * max(1.0, values[0]) or turns:
        return None
    at = repeat_step(closing, np.linalg.inv(slope), at, POLISHING_STEPS)
    if np.abs(closing(at)[0]).max() > CLOSED_TOLERANCE:
        return None
    return _uncertified_roots(at[None], 1, "its equations are linear")
