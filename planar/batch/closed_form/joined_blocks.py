"""What joins the blocks of designs in closed form, one after the other, at inputs of each design's own."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from planar.batch.march.backend import DesignBatch
from planar.batch.march.kernel import KernelEquations, Operand

Array = np.ndarray


class JoinedBlocks(NamedTuple):
    """Designs joined block after block, each array (blocks, designs): the sign of the assembly that was taken; the
    squared distance of the block's sketched points from where they are shown (sizes), in that assembly and in the
    other; how near the two are to where they meet, 1 there, beyond it there is none.

    state (operands, designs): the unknowns as the kernel's operands, cos and sin of angles. What comes after a block
    that cannot be joined is no number.
    """

    signs: Array
    distances: Array
    other_distances: Array
    coalescences: Array
    state: Array


class FollowedBlocks(NamedTuple):
    """Designs in assemblies that are known, each array (..., designs): how near the two of each block are to where they
    meet, as above (blocks, designs), no number where an arm on which a length turns is shorter than `LEAST_ARM`; behind
    these what reaches one where a pair meets its stop; and their state (operands, designs)."""

    coalescences: Array
    state: Array


class InputRanges(NamedTuple):
    """How one input of designs, `running`, goes on from where they start, each array (designs,), rad or sizes: how far
    it surely came, how far it is to go, to either side, and the steps in which it went."""

    running: int
    reached: Array
    lengths: Array
    step: Array


class DeadPoints(NamedTuple):
    """How far designs surely go (designs,), rad or sizes from their start: to a dead point, or infinitely where there
    is none up to the end; not a number where that is not decided. And the block that ends it, else -1; behind the
    blocks are the pairs with stops, which end designs alike, and then the input that runs with its own."""

    distance: Array
    block: Array


class BlockJoiner(Protocol):
    """Joins the blocks of the designs of a batch."""

    equations: KernelEquations
    state: tuple[Operand, ...]

    def join(self, batch: DesignBatch, sketch: Array, forced: Array) -> JoinedBlocks:
        """At the inputs u0 of a batch, whose points are the sketched ones, each block in the assembly whose points lie
        nearer to the sketch.

        sketch (points, 2), in sizes; forced (blocks, designs): the sign of a block's assembly, 0 where it is free.
        """

    def follow(self, batch: DesignBatch, signs: Array, u: Array) -> FollowedBlocks:
        """At inputs u (inputs, designs), in the assemblies of these signs (blocks, designs)."""

    def find_dead_points(self, batch: DesignBatch, signs: Array, ranges: InputRanges) -> DeadPoints:
        """The first dead points of designs in the assemblies of these signs (blocks, designs), of none that goes no
        way."""


LEAST_ARM = 0.1
"""Sizes of an arm on which a length turns: a shorter one may have vanished between two positions."""


def without_short_arms(coalescences: Array, equations: KernelEquations, squared_arms: Sequence[Array]) -> Array:
    """The coalescences (blocks, designs), no number where an arm is short; squared arms of the blocks that have one."""
    arms = iter(squared_arms)
    for k, form in enumerate(equations.closed_forms):
        if form.squared_arm is not None:
            coalescences[k] = np.where(next(arms) < LEAST_ARM**2, np.nan, coalescences[k])
    return coalescences


def state_operands(equations: KernelEquations) -> tuple[Operand, ...]:
    """What stands for the unknowns: cos and sin of an angle, or a length."""
    return tuple(
        operand
        for k, is_angle in enumerate(equations.is_angle)
        for operand in ([("zc", k), ("zs", k)] if is_angle else [("z", k)])
    )


def unknowns_from_state(operands: Sequence[Operand], state: Array, count: int) -> Array:
    """The unknowns z (unknowns, designs) of a state (operands, designs)."""
    rows, z = dict(zip(operands, state, strict=True)), np.empty((count, state.shape[1]))
    for k in range(count):
        z[k] = rows["z", k] if ("z", k) in rows else np.arctan2(rows["zs", k], rows["zc", k])
    return z


def input_rows(equations: KernelEquations, u: Array) -> Array:
    """Rows of `KernelInstructions.input_operands` at inputs u (inputs, designs)."""
    rows = []
    for own, is_angle in zip(u, equations.input_is_angle, strict=True):
        # designs mostly start at one input
        alike = own.size > 1 and own[0] == own[-1] and bool(np.all(own == own[0]))
        of = own[:1] if alike else own
        rows += [np.broadcast_to(each, own.shape) for each in ([np.cos(of), np.sin(of)] if is_angle else [])]
        rows.append(own)
    return np.array(rows) if rows else np.zeros((0, u.shape[1]))
