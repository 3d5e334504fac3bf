"""The transmission angle: how squarely the rest of a mechanism drives an output link."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.output import Extreme
from planar.analysis.motion.zeros import SERIES_TOLERANCE, bracket_maxima, find_maximum
from planar.derivatives.transmission_system import can_drive, force_point, undriven_output
from planar.document.first_argument import takes_result
from planar.equations.coordinates import FRAME_PARTS
from planar.equations.sparse_matrices import SparseMatrices
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.jets import Scalar, value_and_rates
from planar.foundation.short_repr import short_repr
from planar.model.output_pair import find_output_pair
from planar.model.pairs import MeasureKind
from planar.model.wording import join_all_names
from planar.results.kinematic_result import KinematicResult
from planar.results.motion import Motion, State
from planar.solving.checks import SINGULAR_TOLERANCE
from planar.solving.full_constraints import FullConstraints
from planar.solving.prepared_mechanism import PreparedMechanism

BALANCE_TOLERANCE = 1e-7
"""Of a unit load: what is left of it by all multipliers, where the position is a limit and nothing balances it."""
NEGLIGIBLE_FORCE = 1e-7
"""A force below this part of the greatest on the output, or a moment below this part at an arm of the size, is none."""
MAX_REGULAR_MULTIPLIER = 1e6
"""Multipliers of a unit load that are less are far from a limit."""
CHUNK_SIZE = 64
"""Positions whose slopes are found at once."""


class Transmission(NamedTuple):
    """The transmission angle (rad, 0 to pi/2) of an output link: at a position, or (n,) at every one of a motion.

    It is NaN at a limit of a part of the mechanism at which the forces on the output are not determined. `pair` is the
    output's pair with the frame, `through` names the pairs at which it is driven. `least` is where over a
    motion the angle is least, and how great it is there; None of a position.
    """

    link: str
    pair: str
    through: tuple[str, ...]
    angle: float | Array
    least: Extreme | None = None

    def __repr__(self) -> str:
        return short_repr(self)


@takes_result("State", "Motion")
def transmission(moving: State | Motion, output: str) -> Transmission:
    """The transmission angle of a link that turns about a fixed pin or slides on the frame: a link, or that pair.

    All inputs hold still, the output alone is loaded, by a torque if it turns and by a force along its way if it
    slides, and all links are weightless: which force F do the other moving links exert on it? The angle is that between
    F and the line from the fixed pin to the pin (or the point of a slide) where F acts, or, if it slides, between F and
    the perpendicular to its way. At 90 degrees all of F does work, at 0 nothing does: there the input is at a limit.
    In a four-bar it is the angle between coupler and follower, in a slider-crank the rod's with the perpendicular.

    F is that of the multipliers of all pairs' constraints, nothing eliminated. The least over a motion is solved for:
    where the derivative of a polynomial through exact values of cos^2 is zero, good to about 1e-8 of the input.

    Raises Unknown for another name; BadInput where the link is not so joined to the frame, nothing but the input
    itself drives it, a turning link is driven at several places or by a couple, so that no one line of force acts on a
    pin, or where constraints hold twice, so that the forces are not determined.

    >>> import planar
    >>> state = planar.solve(planar.load("four-bar"))
    >>> round(planar.transmission(state, "D").angle, 3)
    1.57
    """
    driven = _DrivenOutput(moving, output)
    through, angle = driven.angles(moving)
    least = _find_least(moving, driven, through, angle) if isinstance(moving, Motion) else None
    return Transmission(driven.link, driven.pair.name, through, float(angle[0]) if least is None else angle, least)


def _find_least(motion: Motion, driven: _DrivenOutput, through: tuple[str, ...], angle: Array) -> Extreme:
    """Where over a motion the angle is least, and how great it is."""
    steady = InterpolatedRun(motion)

    def exact(position: float) -> float:
        return float(driven.angles(steady.state_at(position), through)[1][0])

    order = np.argsort(steady.positions, kind="stable")
    positions, angle = steady.positions[order], angle[order]
    sampled = Extreme(float(positions[np.nanargmin(angle)]), float(np.nanmin(angle)))
    ends = [0] if steady.closed else [0, -1]
    found = [Extreme(float(positions[k]), float(angle[k])) for k in ends if np.isfinite(angle[k])] or [sampled]
    if steady.closed:  # on over its seam
        positions = np.concatenate([positions[:-1], positions[:2] + steady.period])
        angle = np.concatenate([angle[:-1], angle[:2]])
    squares = np.nan_to_num(np.cos(angle) ** 2)  # where it is not determined nothing is looked for
    most = float(squares.max())
    for low, high in bracket_maxima(positions, squares) if np.ptp(squares) > SERIES_TOLERANCE else ():
        around = squares[(positions >= low) & (positions <= high)]
        if 2.0 * around.max() - around.min() < most:  # its top is not so far above its samples
            continue
        try:
            at = find_maximum(lambda at: float(np.cos(exact(at)) ** 2), low, high)
            place, value = steady.wrap_position(at), exact(at)
        except NoAnswer:
            continue  # the motion branches there
        if place is not None:
            found.append(Extreme(place, value))
    least = min(each.value for each in found)
    first = min(each for each in found if each.value <= least + SERIES_TOLERANCE)
    return first if least <= sampled.value + SERIES_TOLERANCE else sampled


class _DrivenOutput:
    """An output link with the constraints that other moving links put on it."""

    def __init__(self, moving: KinematicResult, output: str):
        mechanism = moving.mechanism
        self.link, self.pair = find_output_pair(moving.mechanism, output)
        if not mechanism.inputs:
            raise BadInput("inputs", "the mechanism has no input, and nothing is transmitted")
        self.prepared = PreparedMechanism(mechanism)
        self.prepared.refuse_misfit("a transmission angle is not told")
        self.constraints = FullConstraints(self.prepared)
        self.inputs = tuple(given.pair for given in mechanism.inputs)
        first = self.prepared.column[self.link, "x"]
        self.columns = slice(first, first + len(FRAME_PARTS))
        self.slides = self.pair.input_kind is MeasureKind.LENGTH
        rows = [self.prepared.pairs[name] for name in self.constraints.pair_of_row]
        rows += [self.prepared.relative_motions[name] for name in self.inputs]
        self.rows_of_pair: dict[str, list[int]] = defaultdict(list)
        for number, row in enumerate(rows):
            self.rows_of_pair[row.name].append(number)
        self.driving_pairs = {pair.name: pair for pair in rows if can_drive(mechanism, pair, (self.link, self.pair))}
        self.direction = self._slide_direction(moving) if self.slides else np.zeros(2)

    def angles(self, moving: KinematicResult, through: tuple[str, ...] | None = None) -> tuple[tuple[str, ...], Array]:
        """The pairs that drive the output, if they are not told, and the angle (n,); 0 at a limit."""
        wrenches, stuck = self._wrenches(moving)
        names = self._driving_names(wrenches) if through is None else through
        force = np.sum([wrenches[name] for name in names], axis=0)
        along = self.direction if self.slides else self._lever(moving, names, force)
        cross = np.abs(along[0] * force[1] - along[1] * force[0])
        dot = np.abs(along[0] * force[0] + along[1] * force[1])
        angle = np.arctan2(dot, cross) if self.slides else np.arctan2(cross, dot)
        return names, np.where(stuck, 0.0, angle)

    def _wrenches(self, moving: KinematicResult) -> tuple[dict[str, Array], Array]:
        """Of every pair that may drive the output, force and moment about the link's origin over the size, (3, n).

        The greatest of a position is 1, as only directions are asked for. NaN where they are not determined because
        the position is a limit; second which positions (n,) are limits at which no forces balance the load.
        """
        w = np.atleast_2d(self.prepared.coordinates(moving.frames, moving.own))
        load = np.zeros(len(self.prepared.column))
        load[self.columns] = (*self.direction, 0.0) if self.slides else (0.0, 0.0, 1.0)
        wrenches: list[Array] = []
        stuck = np.zeros(len(w), dtype=bool)
        for start in range(0, len(w), CHUNK_SIZE):
            chunk = slice(start, start + CHUNK_SIZE)
            sides = self.constraints.transposed_jacobians(w[chunk], self.inputs)
            multipliers, stuck[chunk] = self._multipliers(sides, load)
            rows_of_pairs = [self.rows_of_pair[name] for name in self.driving_pairs]
            parts = [
                np.einsum("ncr,nr->cn", _block(sides, self.columns, rows), multipliers[:, rows])
                for rows in rows_of_pairs
            ]
            wrenches.append(np.array(parts).reshape(len(self.driving_pairs), 3, len(sides)))
        all_wrenches = np.concatenate(wrenches, axis=2)
        greatest = np.abs(all_wrenches).max(axis=(0, 1), initial=0.0)
        if not (greatest > NEGLIGIBLE_FORCE).any() and not stuck.all():
            raise undriven_output(self.link)
        with np.errstate(invalid="ignore", divide="ignore"):
            return dict(zip(self.driving_pairs, all_wrenches / greatest, strict=True)), stuck

    def _multipliers(self, sides: Array | SparseMatrices, load: Array) -> tuple[Array, BoolArray]:
        """Multipliers (n, rows) that balance a load (coordinates,) on slopes, transposed (n, coordinates, rows); which
        do not.

        NaN where nothing does, and where the position is a limit and they are not the only ones.
        """
        many, columns, rows = sides.shape
        found: Array = np.zeros((many, rows))
        stuck, sound = np.zeros(many, dtype=bool), np.zeros(many, dtype=bool)
        if rows == columns:
            try:
                loads = np.broadcast_to(-load[:, None], (many, columns, 1))
                solve = sides.solve if isinstance(sides, SparseMatrices) else partial(np.linalg.solve, sides)
                found = solve(loads)[..., 0]
                sound = np.abs(found).max(axis=1) < MAX_REGULAR_MULTIPLIER
            except np.linalg.LinAlgError:
                pass  # one of them is exactly at a limit
        if not sound.all():
            found[~sound], stuck[~sound] = self._minimum_norm_multipliers(np.asarray(sides[~sound]), load)
        return found, stuck

    def _minimum_norm_multipliers(self, sides: Array, load: Array) -> tuple[Array, BoolArray]:
        """See `_multipliers`; where constraints may hold twice, or a position is a limit."""
        columns = sides.shape[1]
        u, s, vt = np.linalg.svd(sides, full_matrices=False)
        held = s > SINGULAR_TOLERANCE * s[:, :1]
        gain = np.where(held, 1.0 / np.where(held, s, 1.0), 0.0)
        inverse = (vt.transpose(0, 2, 1) * gain[:, None]) @ u.transpose(0, 2, 1)
        found = -inverse @ load
        stuck = np.abs(np.einsum("ncr,nr->nc", sides, found) + load).max(axis=1) > BALANCE_TOLERANCE
        found[stuck] = np.nan
        mine = [row for name in self.driving_pairs for row in self.rows_of_pair[name]]
        free = np.eye(sides.shape[2]) - inverse @ sides
        acting = sides[:, self.columns][:, :, mine] @ free[:, mine]
        loose = np.abs(acting).max(axis=(1, 2), initial=0.0) > BALANCE_TOLERANCE
        if (loose & (held.sum(axis=1) == columns)).any():
            told = f"constraints hold twice, so that the forces on {self.link} are not determined without elasticity"
            raise BadInput(self.link, f"{told}; leave out the link that holds nothing new")
        found[loose] = np.nan
        return found, stuck

    def _driving_names(self, wrenches: dict[str, Array]) -> tuple[str, ...]:
        """The pairs that drive the output; all that may where every position is a limit."""
        known = {name: np.abs(wrench[:, ~np.isnan(wrench[0])]) for name, wrench in wrenches.items()}
        driving = tuple(name for name, wrench in known.items() if wrench.max(initial=0.0) > NEGLIGIBLE_FORCE)
        return driving or tuple(wrenches)

    def _lever(self, moving: KinematicResult, names: tuple[str, ...], force: Array) -> Array:
        """From the fixed pin to the point at which the force acts, (2, n). Raises BadInput where there is none."""
        places = {force_point(self.driving_pairs[name], self.link) for name in names}
        place = places.pop()
        if places or place is None:
            reason = (
                f"{self.link} is driven at {join_all_names(names)}, not at one pin"
                if places
                else f"wheels drive {self.link}"
            )
            raise BadInput(self.link, f"{reason}, so that no one line of force with one pin tells a transmission angle")
        fixed_pin = next(member for member in self.pair.coincident_points() if member[0] == moving.mechanism.frame)
        members = (place, fixed_pin)
        vectors = [moving.frames[link].to_world(moving.shapes[link].position(name)) for link, name in members]
        point, pin = map(_values, vectors)
        arm = point - _values((moving.frames[self.link].x, moving.frames[self.link].y))
        couple = np.abs(force[2] - (arm[0] * force[1] - arm[1] * force[0]) / self.prepared.unit)
        if np.max(couple[~np.isnan(couple)], initial=0.0) > NEGLIGIBLE_FORCE:
            reason = f"at {join_all_names(names)} a couple drives {self.link} beside a force"
            raise BadInput(self.link, f"{reason}, so that no line of force through one pin tells a transmission angle")
        lever: Array = point - pin
        if np.hypot(*lever).max() <= NEGLIGIBLE_FORCE * self.prepared.unit:
            raise BadInput(self.link, f"{self.link} is driven at its fixed pin, about which no force turns it")
        return lever

    def _slide_direction(self, moving: KinematicResult) -> Array:
        """The unit direction (2,) in which the output slides on the frame: how its place goes with the displacement."""
        w = np.atleast_2d(self.prepared.coordinates(moving.frames, moving.own))
        sides = self.constraints.transposed_jacobians(w[:1], self.inputs)
        column = self.prepared.column[self.pair.name, self.pair.coordinate_kinds[0][0]]
        direction = _block(sides, slice(column, column + 1), self.rows_of_pair[self.pair.name][:2])[0, 0]
        unit_direction: Array = direction / np.hypot(*direction)
        return unit_direction


def _block(matrices: Array | SparseMatrices, rows: slice, columns: Sequence[int]) -> Array:
    """The entries of some rows and columns of matrices (n, rows, columns)."""
    return np.concatenate([matrices[:, rows, column : column + 1] for column in columns], axis=2)


def _values(vector: Iterable[Scalar]) -> Array:
    """The values of two components, jets or numbers, (2, n)."""
    return np.stack(np.broadcast_arrays(*(np.atleast_1d(value_and_rates(component)[0]) for component in vector)))
