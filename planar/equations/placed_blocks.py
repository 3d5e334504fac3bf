"""The functions of a structure's blocks by their types: called with z, u and p of the whole, as others are."""

from __future__ import annotations

from collections.abc import Sequence
from threading import Lock

import numpy as np

from planar.equations.assembled_equations import AssembledEquations
from planar.equations.block_types import PlacedBlock
from planar.equations.closed_form_assemblies import ArrayFunction, ClosedFormAssemblies
from planar.equations.symbolic_equations import Block, ConstraintEquations
from planar.foundation.arrays import Array


class KnownCoordinates:
    """(w, u) as far as blocks ahead of one give it. Of one position the last one is kept: from one block to the next,
    or from one step of a block to the next, little changes."""

    def __init__(
        self,
        e: ConstraintEquations,
        assembled: AssembledEquations,
        placed: tuple[PlacedBlock | None, ...],
        coordinate_calls: Sequence[ArrayFunction | None],
    ):
        self._equations, self._assembled, self._placed = e, assembled, placed
        self._coordinate_calls = coordinate_calls
        self._lock = Lock()
        self._last: tuple[Array, Array, Array] | None = None
        self._state: Array = np.zeros(0)
        self._block_of_unknown = np.repeat(
            np.arange(len(e.blocks)), [block.unknowns.stop - block.unknowns.start for block in e.blocks]
        )

    def coordinates_ahead(self, block_index: int, z: Array, u: Array, p: Array) -> Array:
        """w (coordinates,) at one position; what follows from this block or a later one holds anything."""
        with self._lock:
            self._update(block_index, z, u, p)
            return self._state[: len(self._equations.coordinates)].copy()

    def arguments(self, block: Block, z: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
        """What the functions of a block's type take: its unknowns, what it rests on of (w, u), and its numbers."""
        placed = self._placed[block.block_index]
        assert placed is not None
        numbers = p[..., placed.numbers]
        if z.ndim == 1:
            with self._lock:
                self._update(block.block_index, z, u, p)
                return z[block.unknowns], self._state[placed.known], numbers
        own = z[:, block.unknowns]
        if u.ndim == p.ndim == 1 and bool((z[:, : block.unknowns.start] == z[0, : block.unknowns.start]).all()):
            return own, self.arguments(block, z[0], u, p)[1], numbers
        inputs = np.broadcast_to(u, (len(z), u.shape[-1]))
        return own, np.hstack([self._assembled.coordinates(z, inputs, p), inputs])[:, placed.known], numbers

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
            own = z[block.unknowns]
            self._state[placed.coordinates] = call(own, self._state[placed.known], p[placed.numbers])[0][0]
        # blocks behind are computed again when they are asked for
        previous[:start] = z[:start]
        previous[start:] = np.nan


class PlacedBlockCall:
    """A block's residuals and Jacobian by its type, as `EquationFunctions.block_call` gives them."""

    def __init__(self, block: Block, function: ArrayFunction, known: KnownCoordinates):
        self._block, self._function, self._known = block, function, known

    def __call__(self, *arguments: Array) -> list[Array]:
        """At one position z, u, p."""
        return self._function(*self._known.arguments(self._block, *arguments))

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """At many positions z, u, p; arguments (positions, entries), or (entries,) for all of them alike."""
        return self._function.evaluate_batch(count, *self._known.arguments(self._block, *arguments))


class PlacedAssemblies:
    """Both assemblies of a block by its type, as `ClosedFormAssemblies` gives them."""

    def __init__(self, block: Block, assemblies: ClosedFormAssemblies, known: KnownCoordinates):
        self._block, self._assemblies, self._known = block, assemblies, known
        self.has_changing_arm = assemblies.has_changing_arm

    def __call__(self, z: Array, u: Array, p: Array) -> tuple[list[Array], float, float]:
        """See `ClosedFormAssemblies`."""
        return self._assemblies(*self._known.arguments(self._block, z, u, p))

    def evaluate_batch(self, z: Array, u: Array, p: Array) -> tuple[list[Array], Array]:
        """See `ClosedFormAssemblies.evaluate_batch`."""
        return self._assemblies.evaluate_batch(*self._known.arguments(self._block, z, u, p))

    def of_designs(self, z: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
        """See `ClosedFormAssemblies.of_designs`."""
        return self._assemblies.of_designs(*self._known.arguments(self._block, z, u, p))


BlockCall = ArrayFunction
"""(z, u, p) -> a block's F and the columns of its Jacobian."""
BlockAssemblyCall = ClosedFormAssemblies | PlacedAssemblies
"""(z, u, p) -> both assemblies of a block."""
