"""What a mechanism does by itself: accelerations under loads, weights and springs, some of its inputs driven.

In the directions N that all constraints leave free, with A what accelerations the constraints ask for,

    N^T M N c = N^T (Q - h - M A),   q'' = A + N c

so that constraints may hold twice (null space method; R. Featherstone, Rigid Body Dynamics Algorithms, 2008, ch. 3).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.dynamics.friction.contact_dynamics import (
    ConstrainedMotion,
    ContactDynamics,
    HeldContacts,
    contact_dynamics,
)
from planar.dynamics.friction.contact_functions import ContactFunctions, ContactValues
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.dynamics.load_variation import CoursePiece, course_piece, load_factors
from planar.dynamics.saddle_point import SaddlePattern, SaddleSystem, unit_pattern
from planar.equations.casadi_functions import BufferedFunction
from planar.equations.sparse_matrices import MAX_DENSE_UNKNOWNS, SparseMatrices, SparsePattern
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.wording import quote_names
from planar.solving.samples import input_law_rates
from planar.solving.stops import MetStop

RANK_TOLERANCE = 1e-9
"""A singular value below this part of the greatest is none."""
CERTAIN_RANK_REGULARITY = 1e-7
"""Constraints whose weakest is estimated above this beside the strongest are all needed."""
MASSLESS_TOLERANCE = 1e-12
"""Of the greatest inertia: a motion with less has none that could be accelerated."""
FULL_RANK_REGULARITY = 1e-2
"""Constraints whose weakest is above this beside the strongest are solved with the masses at once."""
CLOSED_TOLERANCE, MAX_NEWTON_STEPS = 1e-14, 8
"""Sizes: what stays open of the constraints, and Newton's steps to there."""


NO_EFFORTS: Array = np.zeros(0)


class AccelerationResult(NamedTuple):
    """Accelerations of the coordinates, and the power (W) of what stores none: loads, dampers and driven inputs.

    `regularity` is the weakest constraint beside the strongest: nothing on a change point. `efforts` (held,) are what
    driven inputs, pairs that stick and stops on which pairs rest supply, in the positive sense of their motions (N,
    N m), and `heat` (rubbing pairs,) what friction takes (W).
    """

    q2: Array
    power: float
    regularity: float
    efforts: Array = NO_EFFORTS
    heat: Array = NO_EFFORTS


class _MotionTerms(NamedTuple):
    """What the equations of motion consist of at one position: the derivatives of the constraints by the coordinates
    (rows, coordinates), their second rates without accelerations (rows,), the masses (coordinates, coordinates), what
    loads, dampers and motors put on the coordinates, and what weights, springs and velocities do (coordinates,), and
    kinetic and potential energy (J).
    """

    slope: Array | SparseMatrices
    bend: Array
    mass: Array | SparseMatrices
    force: Array
    rest: Array
    energies: Array


class SlidingFriction(NamedTuple):
    """How pairs rub in a phase of a motion: the senses of their rates (pairs,), 0 where one does not, and contacts."""

    functions: ContactFunctions
    senses: Array
    contacts: HeldContacts


class HeldMotions:
    """The inputs that keep to their laws while the others are free, the pairs that stick, and those that rest on
    stops."""

    def __init__(
        self, work: LagrangianFunctions, pairs: Sequence[str], resting: Sequence[MetStop], sticking: Sequence[str]
    ):
        self.resting, self.sticking = tuple(resting), tuple(sticking)
        names = [given.pair for given in work.mechanism.inputs]
        self.index = [names.index(pair) for pair in pairs]
        self.inputs = [work.mechanism.inputs[k] for k in self.index]
        self.let_go = tuple(name for name in names if name not in pairs)
        self.motors = [
            (k, given.motor)
            for k, given in enumerate(work.mechanism.inputs)
            if given.motor is not None and given.pair not in pairs
        ]
        self.held_pairs = (*pairs, *self.sticking, *(each.pair for each in self.resting))
        self.count = len(self.held_pairs)
        self.places: Array = np.zeros(len(self.sticking))
        "where pairs stick"

    def motion_at(self, time: float) -> Array:
        """Position, velocity and acceleration (3, held)."""
        driven = [input_law_rates(each, np.array([time]))[:3, 0] for each in self.inputs]
        still = [(each, 0.0, 0.0) for each in (*self.places, *(stop.position for stop in self.resting))]
        return np.array([*driven, *still]).reshape(-1, 3).T


class EquationsOfMotion:
    """The equations of motion of one mechanism; lengths count in parts of its size `unit` (m)."""

    def __init__(
        self,
        work: LagrangianFunctions,
        driven: Sequence[str],
        unit: float,
        wound: Array,
        resting: Sequence[MetStop] = (),
        sticking: Sequence[str] = (),
    ):
        self.work, self.driven, self.spring_turns = work, HeldMotions(work, driven, resting, sticking), wound
        self.friction: SlidingFriction | None = None
        q, q1 = work.q, work.q1
        self.scale = np.full(q.numel(), unit)
        self.scale[2 : work.link_coordinate_count : 3] = 1.0  # angles
        held = [work.input_positions[k] for k in self.driven.index]
        held += work.relative_positions((*sticking, *(each.pair for each in resting)))
        rows = ca.vertcat(work.residuals, *held)
        slope, mass = ca.jacobian(rows, q), ca.jacobian(work.momentum, q1)
        loads, efforts = work.applied_forces
        force = loads + efforts
        still = ca.substitute(work.inertia, work.q2, ca.SX.zeros(q.numel()))
        self.is_sparse = q.numel() > MAX_DENSE_UNKNOWNS
        if self.is_sparse:
            self._slope_pattern, self._mass_pattern = _pattern_of(slope), _pattern_of(mass)
            self._saddle_pattern = SaddlePattern(self._mass_pattern, self._slope_pattern)
            self._projection_pattern = SaddlePattern(unit_pattern(q.numel()), self._slope_pattern)
        bend = ca.jtimes(ca.mtimes(slope, q1), q, q1)
        slope, mass = (ca.vec(each).nz[:] if self.is_sparse else each for each in (slope, mass))
        motors = ca.vertcat(ca.SX(0, 1), *(work.input_positions[k] for k, _ in self.driven.motors))
        outputs = [
            slope,
            bend,
            mass,
            force,
            work.conservative_forces - still,
            ca.vertcat(*work.energies[:2]),
            ca.jacobian(motors, q),
        ]
        arguments = [q, q1, work.factors, work.spring_turns]
        self._called = BufferedFunction(ca.Function("accelerations", arguments, [ca.densify(each) for each in outputs]))
        self._closing = BufferedFunction(ca.Function("closing", [q], [ca.densify(rows), ca.densify(slope)]))
        positions = work.input_positions
        rates = ca.densify(ca.jtimes(positions, q, q1))
        self._inputs = BufferedFunction(ca.Function("inputs", [q, q1], [ca.densify(positions), rates]))
        names = [given.pair for given in work.mechanism.inputs]
        varying = [(k, load.varies) for k, load in enumerate(work.mechanism.loads) if load.varies is not None]
        self.varying = [(k, each, None if each.input is None else names.index(each.input)) for k, each in varying]
        self.pieces: tuple[CoursePiece, ...] | None = None
        "the pieces of the courses of varying loads on which these are held, so that nothing has kinks"
        self.rank: int | None = None

    def course_places(self, time: float, q: Array, q1: Array) -> list[tuple[float, float]]:
        """Where on its course each varying load is, and how fast it goes there."""
        if not self.varying:
            return []
        at, rate = (each[0] for each in self._inputs(q, q1))
        return [(time, 1.0) if k is None else (float(at[k]), float(rate[k])) for _, _, k in self.varying]

    def course_pieces(self, places: Sequence[tuple[float, float]]) -> tuple[CoursePiece, ...]:
        """The pieces of the courses at places, where two meet the one towards which it goes."""
        turns = [
            k is not None
            and self.work.relative_motions[self.work.mechanism.inputs[k].pair].input_quantity_kinds()[0] == "angle"
            for _, _, k in self.varying
        ]
        return tuple(
            course_piece(course, at, -1.0 if rate < 0.0 else 1.0, turning)
            for (_, course, _), (at, rate), turning in zip(self.varying, places, turns, strict=True)
        )

    def regular_accelerations(self, time: float, q: Array, q1: Array) -> AccelerationResult:
        """As `accelerations_at`, in one solution where every constraint is needed and holds firmly."""
        if self.rank is None or self.rank != self.work.residuals.numel() + self.driven.count:
            return self.accelerations_at(time, q, q1)
        terms = self._evaluate(time, q, q1)
        wanted, count = self._required_accelerations(time, terms), len(q)
        rubbed = self._friction(time, q, q1, terms, wanted)
        push = (terms.force + terms.rest + rubbed[0]) * self.scale
        if isinstance(terms.slope, SparseMatrices):
            solution = self._sparse_accelerations(terms, push, wanted)
            if solution is None:
                return self.accelerations_at(time, q, q1)
            scaled, multipliers = solution
        else:
            held, mass = terms.slope * self.scale, np.asarray(terms.mass) * self.scale * self.scale[:, None]
            size = float(np.abs(mass).max()) or 1.0
            total = np.zeros((count + self.rank, count + self.rank))
            total[:count, :count], total[count:, :count], total[:count, count:] = mass / size, held, held.T
            try:
                solved = np.linalg.solve(total, np.concatenate([push / size, wanted]))
            except np.linalg.LinAlgError:
                return self.accelerations_at(time, q, q1)
            scaled, multipliers = solved[:count], size * solved[count:]
        return self._acceleration_result(time, q1, terms, scaled, -multipliers, 1.0, rubbed[1])

    def accelerations_at(self, time: float, q: Array, q1: Array) -> AccelerationResult:
        """The accelerations at a time, and the power that comes in."""
        terms = self._evaluate(time, q, q1)
        wanted = self._required_accelerations(time, terms)
        values = terms.slope.values if isinstance(terms.slope, SparseMatrices) else terms.slope
        if not np.all(np.isfinite(values)):  # of a stage far out, which the integrator takes back
            return AccelerationResult(np.full(len(q), np.nan), np.nan, 1.0)
        projection = self._projection(terms.slope)
        rubbed = self._friction(time, q, q1, terms, wanted)
        push = (terms.force + terms.rest + rubbed[0]) * self.scale
        if projection is not None:
            solution = self._sparse_accelerations(terms, push, wanted, with_mass_check=True)
            if solution is not None:
                return self._acceleration_result(
                    time, q1, terms, solution[0], -solution[1], projection.regularity(), rubbed[1]
                )
        held, mass = np.asarray(terms.slope) * self.scale, np.asarray(terms.mass) * self.scale * self.scale[:, None]
        u, s, v = np.linalg.svd(held)
        many = self._constraint_rank(s)
        firm = float(s[many - 1] / s[0]) if many else 1.0
        ways = v[many:].T
        asked = v[:many].T @ ((u[:, :many].T @ wanted) / s[:many])
        free = ways.T @ mass @ ways
        if free.size and np.linalg.eigvalsh(free)[0] <= MASSLESS_TOLERANCE * max(float(np.abs(mass).max()), 1e-300):
            raise self._massless_error(ways, free)
        scaled = asked + ways @ np.linalg.solve(free, ways.T @ (push - mass @ asked)) if free.size else asked
        carried: Array = np.zeros(0)
        if self.driven.count:
            # what holds the links does no work, but for the inputs, which move
            carried = np.linalg.lstsq(held.T, mass @ scaled - push, rcond=RANK_TOLERANCE)[0]
        return self._acceleration_result(time, q1, terms, scaled, carried, firm, rubbed[1])

    def _required_accelerations(self, time: float, terms: _MotionTerms) -> Array:
        """The second rates (rows,) that the constraints ask of the coordinates."""
        required = -terms.bend
        if self.driven.count:
            required[-self.driven.count :] += self.driven.motion_at(time)[2]
        return required

    def _acceleration_result(
        self, time: float, q1: Array, terms: _MotionTerms, scaled: Array, carried: Array, firm: float, heat: Array
    ) -> AccelerationResult:
        """The result from scaled accelerations, and from what each constraint carries (rows,)."""
        power, efforts = float(terms.force @ q1), NO_EFFORTS
        if self.driven.count:
            efforts = carried[-self.driven.count :]
            power += float(efforts @ self.driven.motion_at(time)[1])
        return AccelerationResult(scaled * self.scale, power, firm, efforts, heat)

    def _projection(self, slope: Array | SparseMatrices) -> SaddleSystem | None:
        """The projection onto sparse constraints, scaled; None where they are dense, or not all of them are needed."""
        if not isinstance(slope, SparseMatrices) or self.rank not in (None, len(slope)):
            return None
        scaled = slope.values * self.scale[slope.pattern.columns]
        try:
            projection = SaddleSystem(self._projection_pattern, np.ones(len(self.scale)), scaled)
        except ValueError:
            return None
        if self.rank is None:
            if projection.regularity() < CERTAIN_RANK_REGULARITY:
                return None
            self.rank = len(slope)
        return projection

    def _sparse_accelerations(
        self, terms: _MotionTerms, push: Array, wanted: Array, with_mass_check: bool = False
    ) -> tuple[Array, Array] | None:
        """Scaled accelerations (coordinates,) and the multipliers of the constraints (rows,), where all of these are
        needed; None where masses do not determine them."""
        slope, mass = terms.slope, terms.mass
        assert isinstance(slope, SparseMatrices) and isinstance(mass, SparseMatrices)
        scaled_mass = mass.values * self.scale[mass.pattern.rows] * self.scale[mass.pattern.columns]
        size = float(np.abs(scaled_mass).max(initial=0.0)) or 1.0
        scaled_slope = slope.values * self.scale[slope.pattern.columns]
        try:
            system = SaddleSystem(self._saddle_pattern, scaled_mass / size, scaled_slope)
        except ValueError:
            return None
        if with_mass_check and not system.greatest_compliance() < 1.0 / MASSLESS_TOLERANCE:
            return None
        scaled, multipliers = system.solve(push / size, wanted)
        return scaled, size * multipliers

    def project(self, time: float, q: Array, q1: Array) -> tuple[Array, Array]:
        """The nearest coordinates and rates that the constraints allow."""
        motion = self.driven.motion_at(time)
        shortest: Callable[[Array], Array] = np.zeros_like
        for _ in range(MAX_NEWTON_STEPS):
            residual, slope = self._residuals_and_jacobian(q, motion[0])
            shortest = self._shortest_steps(slope)
            step = shortest(residual)
            q = q - step * self.scale
            if np.abs(step).max(initial=0.0) < CLOSED_TOLERANCE:
                break
        slope = self._residuals_and_jacobian(q, motion[0])[1]
        wrong = slope @ q1
        if self.driven.count:
            wrong[-self.driven.count :] -= motion[1]
        return q, q1 - shortest(wrong) * self.scale

    def _shortest_steps(self, slope: Array | SparseMatrices) -> Callable[[Array], Array]:
        """What gives the shortest scaled step (coordinates,) that changes the constraints by so much (rows,)."""
        projection = self._projection(slope)
        if projection is not None:
            return projection.shortest
        u, s, v = np.linalg.svd(np.asarray(slope) * self.scale, full_matrices=False)
        many = self._constraint_rank(s)
        held, ways = (u[:, :many] / s[:many]).T, v[:many].T
        return lambda residual: ways @ (held @ residual)

    def impulse_response(self, time: float, q: Array, q1: Array) -> Array:
        """By how much rates change for impulses on the coordinates (coordinates, coordinates), all constraints held:
        N (N^T M N)^-1 N^T."""
        terms = self._evaluate(time, q, q1)
        held, mass = np.asarray(terms.slope) * self.scale, np.asarray(terms.mass) * self.scale * self.scale[:, None]
        _, s, v = np.linalg.svd(held)
        ways = v[self._constraint_rank(s) :].T
        free = ways @ np.linalg.solve(ways.T @ mass @ ways, ways.T)
        return np.asarray(free * self.scale * self.scale[:, None])

    def free_directions(self, time: float, q: Array, q1: Array) -> Array:
        """The motions that all constraints leave (coordinates, freedoms), square to one another in parts of sizes and
        turns."""
        slope = np.asarray(self._evaluate(time, q, q1).slope)
        _, s, v = np.linalg.svd(slope * self.scale)
        return np.asarray(v[self._constraint_rank(s) :].T * self.scale[:, None])

    def stays_at_rest(self, time: float, q: Array, q1: Array) -> bool:
        """Whether nothing can move, nor anything that acts change with the time."""
        changes = self.driven.index or any(course.input is None for _, course, _ in self.varying)
        return not changes and not self.free_directions(time, q, q1).size

    def energies(self, time: float, q: Array, q1: Array) -> Array:
        """Kinetic energy, and potential of weights and springs (2,), J."""
        return self._evaluate(time, q, q1).energies

    def in_phase(self, places: Array, friction: SlidingFriction | None = None) -> EquationsOfMotion:
        """The same where pairs stick at places (sticking,), and others rub."""
        found = copy(self)
        found.driven = copy(self.driven)
        found.driven.places, found.friction = places, friction
        return found

    def contact_values(self, functions: ContactFunctions, time: float, q: Array, q1: Array) -> ContactValues:
        """What contacts do at a time, and follow."""
        return functions.evaluate(q, q1, self._load_factors(time, q, q1), self.spring_turns)

    def contact_dynamics(
        self, functions: ContactFunctions, time: float, q: Array, q1: Array, senses: Array, at_rest: BoolArray
    ) -> ContactDynamics:
        """The equations of contacts at a time, with senses and coefficients at rest of the rubbing pairs (pairs,)."""
        terms = self._evaluate(time, q, q1)
        values = self.contact_values(functions, time, q, q1)
        motion = self._constrained_motion(functions, values, terms, self._required_accelerations(time, terms), q1)
        return contact_dynamics(functions, values, motion, senses, at_rest)

    def _constrained_motion(
        self, functions: ContactFunctions, values: ContactValues, terms: _MotionTerms, wanted: Array, q1: Array
    ) -> ConstrainedMotion:
        slope, mass = np.asarray(terms.slope), np.asarray(terms.mass)
        at = [functions.effort_pairs.index(name) for name in self.driven.held_pairs]
        push: Array = values.push
        for k, motor in self.driven.motors:
            number = functions.effort_pairs.index(self.work.mechanism.inputs[k].pair)
            way = values.efforts[:, number]
            push = push + way * float(motor.effort_at(float(way @ q1)))
        is_firm = self.rank == len(wanted)
        return ConstrainedMotion(mass, slope, wanted, values.efforts[:, at], push, self.scale, is_firm)

    def _friction(self, time: float, q: Array, q1: Array, terms: _MotionTerms, wanted: Array) -> tuple[Array, Array]:
        """What friction puts on the coordinates, and takes at every rubbing pair (W); not a number where its equations
        have no solution."""
        friction = self.friction
        if friction is None:
            return np.zeros(len(q)), NO_EFFORTS
        values = self.contact_values(friction.functions, time, q, q1)
        motion = self._constrained_motion(friction.functions, values, terms, wanted, q1)
        none = np.zeros(len(friction.senses), dtype=bool)
        found = contact_dynamics(friction.functions, values, motion, friction.senses, none)
        y = friction.contacts.solve(found.system)
        if y is None:
            return np.full(len(q), np.nan), np.full(len(friction.senses), np.nan)
        heat: Array = np.zeros(len(friction.senses))
        rubs = friction.functions.is_friction
        np.subtract.at(heat, friction.functions.pair_index[rubs], (q1 @ found.actions * y)[rubs])
        return found.actions @ y, heat

    def _residuals_and_jacobian(self, q: Array, at: Array) -> tuple[Array, Array | SparseMatrices]:
        rows, slope = self._closing(q)
        residual = rows[0]
        if self.driven.count:
            residual[-self.driven.count :] -= at
        return residual, SparseMatrices(self._slope_pattern, slope[0]) if self.is_sparse else slope.T

    def _load_factors(self, time: float, q: Array, q1: Array) -> Array:
        """By what loads are multiplied at a time (loads,)."""
        by = np.ones(len(self.work.mechanism.loads))
        places = self.course_places(time, q, q1)
        if self.pieces is not None:
            for (k, _, _), piece, (at, _) in zip(self.varying, self.pieces, places, strict=True):
                by[k] = piece.factor_at(at)
        elif self.varying:
            named = [given.pair for given in self.work.mechanism.inputs]
            inputs = {
                named[k]: np.array([at])
                for (_, _, k), (at, _) in zip(self.varying, places, strict=True)
                if k is not None
            }
            by = load_factors(self.work.mechanism, inputs, np.array([time]), 1)[0]
        return by

    def _evaluate(self, time: float, q: Array, q1: Array) -> _MotionTerms:
        slope, bend, mass, force, rest, energies, motor_slopes = self._called(
            q, q1, self._load_factors(time, q, q1), self.spring_turns
        )
        force = force[0]
        if self.driven.motors:
            efforts = [
                float(motor.effort_at(rate))
                for (_, motor), rate in zip(self.driven.motors, q1 @ motor_slopes, strict=True)
            ]
            force = force + motor_slopes @ np.array(efforts)
        vectors = force, rest[0], energies[0]
        if self.is_sparse:
            sparse = SparseMatrices(self._slope_pattern, slope[0]), bend[0], SparseMatrices(self._mass_pattern, mass[0])
            return _MotionTerms(*sparse, *vectors)
        return _MotionTerms(slope.T, bend[0], mass.T, *vectors)

    def _constraint_rank(self, values: Array) -> int:
        """How many constraints hold: at the start they are counted, and near a change point they stay as many."""
        if self.rank is None:
            self.rank = int(np.sum(values > RANK_TOLERANCE * values.max(initial=0.0)))
        return self.rank

    def _massless_error(self, ways: Array, free: Array) -> NoAnswer:
        """That something moves whose inertia is nothing."""
        way = np.abs(ways @ np.linalg.eigh(free)[1][:, 0])
        moved = [link for link, at in self.work.link_columns.items() if way[at : at + 3].max() > 0.1 * way.max()]
        let_go = self.driven.let_go
        driving = ", ".join(f"--drive {name}" for name in let_go)
        return NoAnswer(
            Outcome.TOO_FEW_INPUTS,
            f"link{'s' * (len(moved) != 1)} {quote_names(moved)} can move without anything that "
            f"has a mass, so nothing tells how fast; give {'one of them' if len(moved) > 1 else 'it'} a mass with an "
            f"inertia{f', or let an input drive it ({driving})' if let_go else ''}",
        )


def _pattern_of(matrix: ca.SX) -> SparsePattern:
    rows, first = np.array(matrix.sparsity().row(), dtype=int), np.array(matrix.sparsity().colind(), dtype=int)
    return SparsePattern(matrix.shape, rows, first)
