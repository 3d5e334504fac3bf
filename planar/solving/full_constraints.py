"""All constraints of a mechanism in all its coordinates, nothing eliminated: what its pairs hold, inputs or not.

Lengths are divided by the mechanism's size. Columns by the complex step, so the pairs' own formulas are the only ones:
W. Squire, G. Trapp, Using Complex Variables to Estimate Derivatives of Real Functions, SIAM Review 40, 1998.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planar.equations.coordinates import frames_from_coordinates
from planar.equations.mechanism_numbers import scaled_pair_numbers
from planar.equations.residuals import ConstraintRow, input_positions, pair_residuals, wrapped_residual
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame
from planar.foundation.jets import Scalar
from planar.model.pairs import Pair
from planar.solving.assembly.sketch_start import sketch_coordinates
from planar.solving.checks.singular_values import null_space
from planar.solving.newton import damped_newton
from planar.solving.prepared_mechanism import PreparedMechanism

COMPLEX_STEP = 1e-30
CLOSED_TOLERANCE = 1e-10
NEAR_DAMPING = 1e-6
"""Of first steps: what is looked for is near by."""
MAX_STARTS = 4
"""Starts from which a linkage is joined that its inputs do not determine."""
PROBE_DISTANCE = 0.02
"""How far (sizes, rad) a position is moved along what it allows, to see whether the motion goes on."""
MIN_PROBES, MAX_PROBES = 3, 12
NEIGHBOUR_DISTANCE = 1e-3
"""How far its neighbours are from a position whose motions are counted; what bends back within it is none."""


class FullConstraints:
    """The residuals of all pairs, or of some, at coordinates w (coordinates,), as `ConstraintEquations.coordinates` has
    them."""

    def __init__(self, setup: PreparedMechanism, pairs: Sequence[Pair] | None = None):
        self.setup = setup
        self.pairs = tuple(setup.mechanism.pairs if pairs is None else pairs)
        self.coordinates = setup.equations.coordinates
        self.pair_of_row = tuple(pair.name for pair in self.pairs for _ in pair.residual_kinds)
        self._numbers = {
            pair.name: scaled_pair_numbers(pair, setup.shapes, setup.unit)
            for pair in (*self.pairs, *setup.relative_motions.values())
        }

    def residuals(self, w: Array) -> Array:
        """What every constraint leaves open (rows,), of w (coordinates, many) of each (rows, many)."""
        # a complex step goes by no arc, and needs none
        stepped = np.iscomplexobj(w)
        left = [value if stepped else wrapped_residual(value, row.kind) for row, value in self.row_residuals(w)]
        return np.array(np.broadcast_arrays(*left)) if left else np.zeros((0, *w.shape[1:]))

    def row_residuals(self, w: Array | Sequence[Scalar]) -> Iterator[tuple[ConstraintRow, Scalar]]:
        """The residual of every constraint, with its row, at coordinates of any arithmetic; angles with their turns."""
        frames, own = self._frames_and_own(w)
        return pair_residuals(self.pairs, frames, self._numbers, own)

    def jacobian(self, w: Array) -> Array:
        """(rows, coordinates)"""
        return self._residuals_and_jacobian(w, (), np.zeros(0))[1]

    def relative_positions(self, names: tuple[str, ...], w: Array) -> Array:
        """The drives of these relative motions (names,)."""
        return np.array(self._relative_positions(names, w))

    def relative_jacobian(self, names: tuple[str, ...], w: Array) -> Array:
        """(names, coordinates)"""
        return _derivatives(self._relative_positions(names, _complex_steps(w)), w.shape)[1]

    def _relative_positions(self, names: tuple[str, ...], w: Array) -> list[Array]:
        frames, own = self._frames_and_own(w)
        return input_positions([self.setup.relative_motions[name] for name in names], frames, self._numbers, own)

    def points_and_jacobian(self, members: Sequence[tuple[str, str]], w: Array) -> tuple[Array, Array]:
        """Where points (link, point) are, x and y of each (2 points,), in sizes, and the Jacobian (2 points,
        coordinates)."""
        frames, _ = self._frames_and_own(_complex_steps(w))
        shapes, scale = self.setup.shapes, 1.0 / self.setup.unit
        places = [frames[link].to_world(shapes[link].points[point] * scale) for link, point in members]
        return _derivatives([part for place in places for part in place], w.shape)

    def _frames_and_own(self, w: Array | Sequence[Scalar]) -> tuple[dict[str, Frame], dict[str, tuple[Scalar, ...]]]:
        return frames_from_coordinates(w, self.setup.column, self.setup.shapes, self.setup.pairs)

    def correct(self, w: Array, held: tuple[str, ...] = (), positions: Array | None = None) -> Array | None:
        """The nearest closed position by Gauss and Newton's method, some drives held; None where there is none."""
        return self.correct_all(w[None], held, positions)[0]

    def correct_all(
        self, starts: Array, held: tuple[str, ...] = (), positions: Array | None = None
    ) -> list[Array | None]:
        """The same from several starts (starts, coordinates) at once."""
        targets = np.zeros(len(held)) if positions is None else positions
        result = damped_newton(
            lambda w: self._residuals_and_jacobian(w, held, targets), starts, CLOSED_TOLERANCE, NEAR_DAMPING
        )
        return [w if converged else None for w, converged in zip(result.unknowns, result.converged, strict=True)]

    def _residuals_and_jacobian(self, w: Array, held: tuple[str, ...], positions: Array) -> tuple[Array, Array]:
        """Residuals (..., rows) and Jacobian (..., rows, coordinates) of the pairs, then of relative motions that are
        held, at positions w (..., coordinates)."""
        frames, own = self._frames_and_own(_complex_steps(w))
        motions = [self.setup.relative_motions[name] for name in held]
        rows = list(pair_residuals(self.pairs, frames, self._numbers, own))
        reached = input_positions(motions, frames, self._numbers, own)
        values, jacobian = _derivatives([*(value for _, value in rows), *reached], w.shape)
        pairs = [wrapped_residual(value, row.kind) for (row, _), value in zip(rows, values, strict=False)]
        drives = [value - position for value, position in zip(values[len(rows) :], positions, strict=True)]
        residuals = np.array([*pairs, *drives]).reshape(values.shape)
        return np.moveaxis(residuals, 0, -1), np.moveaxis(jacobian, 0, -2)


def _complex_steps(w: Array) -> Array:
    """Each coordinate of w (..., coordinates) with a step in one coordinate after the other: (coordinates, all)."""
    stepped: Array = w[..., None] + 1j * COMPLEX_STEP * np.eye(w.shape[-1])
    return np.moveaxis(stepped, -2, 0).reshape(w.shape[-1], w.size)


def _derivatives(values: Sequence[Array], shape: tuple[int, ...]) -> tuple[Array, Array]:
    """Values (rows, ...) and their derivatives (rows, ..., coordinates), of what complex steps of w made of them.

    `shape` is that of w (..., coordinates).
    """
    stepped = np.empty((len(values), int(np.prod(shape))), dtype=complex)
    for row, value in zip(stepped, values, strict=True):
        row[:] = value
    stepped = stepped.reshape(len(values), *shape)
    return stepped[..., :1].real.sum(axis=-1), stepped.imag / COMPLEX_STEP


def random_step(free: Array, rng: np.random.Generator, length: float) -> Array:
    """A random move of a length within the columns of `free`."""
    way = free @ rng.normal(size=free.shape[1])
    return way * (length / np.linalg.norm(way))


def find_closed_position(constraints: FullConstraints) -> Array | None:
    """A closed position near the sketch, with the inputs where they are if that can be; None where none is found."""
    setup = constraints.setup
    names = tuple(given.pair for given in setup.mechanism.inputs)
    for held, at in ((names, setup.inputs.u), ((), None)):
        for seed in range(MAX_STARTS):
            found = constraints.correct(sketch_coordinates(setup, seed), held, at)
            if found is not None:
                return found
        if not names:
            break
    return None


def motion_dimension(constraints: FullConstraints, w: Array) -> tuple[int, Array]:
    """The dimension of the motion that leads away from a position, and a position on it."""
    free = null_space(constraints.jacobian(w))
    found, place, held = 0, w, -1
    single = free.shape[1] == 1  # which leaves two directions to probe, and no random ones
    for seed in range((2 if single else MAX_PROBES) if free.size else 0):
        rng = np.random.default_rng(seed)
        step = (1.0 - 2.0 * seed) * PROBE_DISTANCE * free[:, 0] if single else random_step(free, rng, PROBE_DISTANCE)
        away = constraints.correct(w + step)
        if away is not None:
            free_there = null_space(constraints.jacobian(away))
            ways, holds = _spread_dimension(constraints, away, free_there, rng), w.size - free_there.shape[1]
            # of places that move alike the one where nothing is singular: some fall back beside w
            if (ways, holds) > (found, held):
                found, place, held = ways, away, holds
        if seed >= MIN_PROBES and found + held == w.size:
            break
    return found, place


def _spread_dimension(constraints: FullConstraints, w: Array, free: Array, rng: np.random.Generator) -> int:
    """In how many directions the closed positions next to one spread, of those that are `free` to first order."""
    count = 2 * free.shape[1] + 2 if free.size else 0
    if not count:
        return 0
    starts = np.array([w + random_step(free, rng, NEIGHBOUR_DISTANCE) for _ in range(count)])
    moves = [(place - w) / NEIGHBOUR_DISTANCE for place in constraints.correct_all(starts) if place is not None]
    if not moves:
        return 0
    values = np.linalg.svd(np.array(moves), compute_uv=False)
    return int(np.sum(values > 0.1 * np.sqrt(len(moves) / free.shape[1])))
