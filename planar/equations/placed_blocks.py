"""The functions of blocks, called with z, u and p of the structure: residuals and Jacobian, both assemblies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from threading import Lock
from typing import Protocol

import numpy as np

from planar.equations.assembled_equations import AssembledEquations
from planar.equations.block_types import PlacedBlock
from planar.equations.linear import solve_vectors
from planar.equations.symbolic_equations import Block, ConstraintEquations, slice_length
from planar.foundation.arrays import Array

POLISHING_STEPS = 2
"""Newton's steps that carry a closed form to round-off."""
SETTLED_STEP = 1e-9
"""rad or sizes: after a shorter step of Newton's method the next one is round-off."""


class BlockCall(Protocol):
    """A function (z, u, p) of dense columns, as a block's F and the columns of its Jacobian, at one position or
    many."""

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results (columns, rows)."""

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """The results (positions, columns, rows); arguments (positions, entries), or (entries,) for all alike."""


def polish(
    closing: BlockCall, z: Array, u: Array, p: Array, unknowns: slice = slice(None), steps: int = POLISHING_STEPS
) -> None:
    """Carry a block's unknowns in z (designs, unknowns) to round-off by Newton's method; `closing` gives its F and the
    columns of its Jacobian."""
    for _ in range(steps):
        residuals, columns = closing.evaluate_batch(len(z), z, u, p)
        with np.errstate(all="ignore"):  # what is not there is not a number
            moves = solve_vectors(columns.swapaxes(-1, -2), residuals[:, 0])
            z[:, unknowns] -= moves
            if not (np.abs(moves) > SETTLED_STEP).any():
                break


BlockArguments = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
"""z, u and p of the structure to what the functions of a block take."""


class ClosedFormAssemblies:
    """The two assemblies of one block in closed form, carried to round-off by Newton's steps.

    `form` (z, u, p, sign) gives them, `closing` (z, u, p) the block's residuals and the columns of its Jacobian. Both
    take what `arguments` gives; None where that is z, u and p themselves.
    `has_changing_arm`: whether a length of the block turns on an arm that may vanish as the mechanism moves.
    """

    def __init__(
        self,
        unknowns: slice,
        form: BlockCall,
        closing: BlockCall,
        has_changing_arm: bool,
        arguments: BlockArguments | None = None,
    ):
        self._unknowns, self._form, self._closing = unknowns, form, closing
        self.has_changing_arm, self._arguments = has_changing_arm, arguments

    def placed(self, arguments: BlockArguments) -> ClosedFormAssemblies:
        """The same of a block of this type in a structure."""
        return ClosedFormAssemblies(self._unknowns, self._form, self._closing, self.has_changing_arm, arguments)

    def __call__(self, z: Array, u: Array, p: Array) -> tuple[list[Array], float, float]:
        """Both (unknowns,), the greatest residual of the two, and how near they are to where they meet (`ClosedForm`).

        What is not there is not a number.
        """
        assemblies, residual, coalescence = self.of_designs(z[None], u, p)
        return list(assemblies[:, 0]), float(residual[0]), float(coalescence[0])

    def evaluate_batch(self, z: Array, u: Array, p: Array) -> tuple[list[Array], Array]:
        """Both (positions, unknowns), not polished, and how near they are to where they meet (positions,), at z
        (positions, unknowns), u and p alike."""
        return self._evaluate_form(*self._block_arguments(z, u, p))

    def _block_arguments(self, z: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
        return (z, u, p) if self._arguments is None else self._arguments(z, u, p)

    def _evaluate_form(self, z: Array, u: Array, p: Array) -> tuple[list[Array], Array]:
        results = [self._form.evaluate_batch(len(z), z, u, p, np.array([sign])) for sign in (1.0, -1.0)]
        return [assembly[:, 0] for assembly, _ in results], results[0][1][:, 0, 0]

    def of_designs(self, z: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
        """The same of designs z (designs, unknowns), u and p alike: both (2, designs, unknowns of the block), the
        greatest residuals and how near they are to where they meet (designs,)."""
        z, u, p = self._block_arguments(z, u, p)
        both, coalescence = self._evaluate_form(z, u, p)
        greatest: Array = np.zeros(len(z))
        assemblies: list[Array] = []
        for assembly in both:
            tried = z.copy()
            tried[:, self._unknowns] = assembly
            polish(self._closing, tried, u, p, self._unknowns)
            residual = np.abs(self._closing.evaluate_batch(len(z), tried, u, p)[0][:, 0]).max(axis=1)
            # the greatest of what is left open does not see what is not a number
            is_defined = np.isfinite(tried[:, self._unknowns]).all(axis=1)
            greatest = np.maximum(greatest, np.where(is_defined, residual, np.nan))
            assemblies.append(tried[:, self._unknowns])
        return np.array(assemblies), greatest, coalescence


class PlacedBlockCall:
    """A function of a block's type, called with z, u and p of the structure."""

    def __init__(self, function: BlockCall, arguments: BlockArguments):
        self._function, self._arguments = function, arguments

    def __call__(self, *arguments: Array) -> list[Array]:
        """See `BlockCall`."""
        return self._function(*self._arguments(*arguments))

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """See `BlockCall`."""
        return self._function.evaluate_batch(count, *self._arguments(*arguments))


class KnownCoordinates:
    """(w, u) as far as blocks ahead of one give it. Of one position the last one is kept: from one block to the next,
    or from one step of a block to the next, little changes."""

    def __init__(
        self,
        e: ConstraintEquations,
        assembled: AssembledEquations,
        placed: tuple[PlacedBlock | None, ...],
        coordinate_calls: Sequence[BlockCall | None],
    ):
        self._equations, self._assembled, self._placed = e, assembled, placed
        self._coordinate_calls = coordinate_calls
        self._lock = Lock()
        self._last: tuple[Array, Array, Array] | None = None
        self._state: Array = np.zeros(0)
        self._block_of_unknown = np.repeat(
            np.arange(len(e.blocks)), [slice_length(block.unknowns) for block in e.blocks]
        )

    def coordinates_ahead(self, block_index: int, z: Array, u: Array, p: Array) -> Array:
        """w (coordinates,) at one position; what follows from this block or a later one holds anything."""
        with self._lock:
            self._update(block_index, z, u, p)
            return self._state[: len(self._equations.coordinates)].copy()

    def arguments_of(self, block: Block) -> BlockArguments:
        """z, u and p to what the functions of a block's type take: its unknowns, what it rests on of (w, u), and its
        numbers."""
        return partial(self._arguments, block)

    def _arguments(self, block: Block, z: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
        placed = self._placed[block.block_index]
        assert placed is not None
        numbers = p[..., placed.numbers]
        if z.ndim == 1:
            with self._lock:
                self._update(block.block_index, z, u, p)
                return z[block.unknowns], self._state[placed.known], numbers
        unknowns = z[:, block.unknowns]
        if u.ndim == p.ndim == 1 and bool((z[:, : block.unknowns.start] == z[0, : block.unknowns.start]).all()):
            return unknowns, self._arguments(block, z[0], u, p)[1], numbers
        inputs = np.broadcast_to(u, (len(z), u.shape[-1]))
        return unknowns, np.hstack([self._assembled.coordinates(z, inputs, p), inputs])[:, placed.known], numbers

    def _update(self, block_index: int, z: Array, u: Array, p: Array) -> None:
        """Bring the state to a position, as far as the block."""
        count = len(self._equations.coordinates)
        if self._last is None or not (np.array_equal(u, self._last[1]) and np.array_equal(p, self._last[2])):
            self._state = np.concatenate([self._assembled.coordinates(z[None], u[None], p)[0], u])
            self._last = z.copy(), u.copy(), p.copy()
            return
        previous = self._last[0]
        start = self._equations.blocks[block_index].unknowns.start if block_index < len(self._placed) else len(z)
        changed = np.flatnonzero(z[:start] != previous[:start])
        if not len(changed):
            return
        first = int(self._block_of_unknown[changed[0]])
        for block in self._equations.blocks[first:block_index]:
            placed, call = self._placed[block.block_index], self._coordinate_calls[block.block_index]
            if placed is None or call is None:
                self._state[:count] = self._assembled.coordinates(z[None], u[None], p)[0]
                previous[:] = z
                return
            unknowns = z[block.unknowns]
            self._state[placed.coordinates] = call(unknowns, self._state[placed.known], p[placed.numbers])[0][0]
        # blocks behind are computed again when they are asked for
        previous[:start] = z[:start]
        previous[start:] = np.nan
