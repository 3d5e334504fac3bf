"""What is demanded of a motion as rows at positions of many designs, which keep it while they are fitted."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.analysis.motion.transmission_angle import Transmission
from planar.derivatives.design_equations import DesignEquations, OutputBalance, design_equations
from planar.derivatives.transmission_system import output_angle
from planar.equations.casadi_functions import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import PlanarError
from planar.model.mechanism import Mechanism, named_points
from planar.model.output_pair import find_output_pair
from planar.solving.cycle import cycle
from planar.synthesis.fitting.wanted_equations import WantedEquations, WantedRows, in_entries, solve_rows
from planar.synthesis.judgement.defects import output_transmissions, polygon_depths
from planar.synthesis.task.freedom import generic_start
from planar.synthesis.task.starts import FreeNumbers
from planar.synthesis.task.synthesis_task import SynthesisTask


class LinearSystem(NamedTuple):
    """Equations that are linear in unknowns l, and a value of these, over a design's z, u and d."""

    design: DesignEquations
    equations: ca.SX
    unknowns: ca.SX
    value: ca.SX


class _SystemFunctions(NamedTuple):
    system: BufferedFunction
    "(y, x) -> A, b"
    value: BufferedFunction
    "(y, x, l) -> a, a_l"
    slopes: BufferedFunction
    "(y, x, l, w) -> the derivatives in y and x of a - w^T (A l + b)"


class AdjointRows:
    """Values at positions y of designs x (see `in_entries`), a column for each of linear `systems`.

    Where a value is a(y, x, l) of what solves A(y, x) l = -b(y, x), with A^T w = a_l, it changes by the adjoint (A.
    Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, ch. 15): da = (a - w^T (A l + b))_x dx, and with y alike.
    """

    def __init__(self, systems: Iterable[LinearSystem], free: Sequence[str], scale: Array):
        self.systems, self.free, self.scale = tuple(systems), tuple(free), scale

    def __len__(self) -> int:
        """How many columns there are."""
        return len(self.systems)

    @cached_property
    def _functions(self) -> list[_SystemFunctions]:
        return [self._functions_of(system) for system in self.systems]

    def _functions_of(self, of: LinearSystem) -> _SystemFunctions:
        y, x, (equations, value) = in_entries(of.design, self.free, self.scale, [of.equations, of.value])
        own, w = of.unknowns, ca.SX.sym("w", equations.numel())
        A, b = ca.jacobian(equations, own), ca.substitute(equations, own, ca.SX.zeros(own.numel()))
        adjoint = value - ca.dot(w, equations)
        told = ([y, x], [A, b]), ([y, x, own], [value, ca.jacobian(value, own)])
        slopes = [y, x, own, w], [ca.jacobian(adjoint, y), ca.jacobian(adjoint, x)]
        return _SystemFunctions(
            *(
                BufferedFunction(ca.Function("rows", given, [ca.densify(each) for each in found]))
                for given, found in (*told, slopes)
            )
        )

    def values(self, x: Array, y: Array) -> Array:
        """The values (positions, rows), of positions y (positions, unknowns) of designs x (positions, free)."""
        found = np.empty((len(y), len(self)))
        for k, each in enumerate(self._functions):
            found[:, k] = self._solved(each, x, y)[0]
        return found

    def linearise(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """The values, and their slopes in y (positions, rows, unknowns) and x (positions, rows, free), each with the
        other held."""
        many = len(y)
        values = np.empty((many, len(self)))
        by_y, by_x = (np.empty((many, len(self), each.shape[1])) for each in (y, x))
        for k, each in enumerate(self._functions):
            values[:, k], by_l, unknowns, inverse = self._solved(each, x, y)
            w = np.einsum("nlr,nl->nr", inverse, by_l)
            own = each.slopes.evaluate_batch(many, y, x, unknowns, w)
            by_y[:, k], by_x[:, k] = own[0][..., 0], own[1][..., 0]
        return values, by_y, by_x

    def _solved(self, of: _SystemFunctions, x: Array, y: Array) -> tuple[Array, Array, Array, Array]:
        """Values (n,), their slopes by the unknowns (n, unknowns), these, and the inverse of A; NaN at limits."""
        many = len(y)
        A, b = of.system.evaluate_batch(many, y, x)
        inverse = _inverses(A.transpose(0, 2, 1))
        unknowns = -np.einsum("nlr,nr->nl", inverse, b[:, 0])
        value, by_l = of.value.evaluate_batch(many, y, x, unknowns)
        return value[:, 0, 0], by_l[..., 0], unknowns, inverse


def _inverses(matrices: Array) -> Array:
    """Of matrices (n, rows, columns), generalised where constraints hold twice; NaN where there is none."""
    is_finite = np.isfinite(matrices).all(axis=(1, 2))
    if matrices.shape[1] == matrices.shape[2] and is_finite.all():
        try:
            told: Array = np.linalg.inv(matrices)
            return told
        except np.linalg.LinAlgError:
            pass  # one of them is exactly at a limit
    found: Array = np.full(matrices.swapaxes(1, 2).shape, np.nan)
    found[is_finite] = np.linalg.pinv(matrices[is_finite], rcond=1e-12)
    return found


def rate_rows(mechanism: Mechanism, free: Sequence[str], scale: Array) -> AdjointRows:
    """The rate of the running input where all unknowns together go on by one: a column, but none of a mechanism without
    unknowns, of which nothing can stop."""
    design = design_equations(mechanism)
    velocities = ca.SX.sym("v", design.z.numel())
    by_input = ca.jacobian(design.F, design.u)[:, 0] * float(design.input_scale[0])
    equations = ca.jacobian(design.F, design.z) @ velocities + by_input
    rate = LinearSystem(design, equations, velocities, 1.0 / ca.sqrt(1.0 + ca.sumsqr(velocities)))
    return AdjointRows([rate] if design.z.numel() else [], free, scale)


def _transmission_systems(mechanism: Mechanism, transmissions: Sequence[Transmission]) -> Iterator[LinearSystem]:
    """The balance of each output under an effort on it alone, with its transmission angle (rad) by the forces of all
    constraints' multipliers; see `planar.transmission`."""
    design = design_equations(mechanism)
    for output in transmissions:
        pair = find_output_pair(mechanism, output.pair)[1]
        balance = OutputBalance(design, pair)
        forces = (balance.force_on(name, output.link) for name in output.through)
        angle = output_angle(design.positions, (output.link, pair), output.through, forces)
        yield LinearSystem(design, balance.acting, balance.unknowns, angle)


class RegionRows:
    """Depths (of a size in m) at positions y of designs x (see `in_entries`), a column for each named point."""

    def __init__(self, mechanism: Mechanism, corners: Array, size: float, free: Sequence[str], scale: Array):
        self.mechanism, self.corners, self.size = mechanism, corners / size, size
        self.free, self.scale = tuple(free), scale
        self.points = named_points(mechanism)

    def __len__(self) -> int:
        """How many columns there are."""
        return len(self.points)

    @cached_property
    def _places(self) -> tuple[BufferedFunction, BufferedFunction]:
        """(y, x) -> places of all points (x and y of each in turn), and the same with their Jacobians in y and x."""
        design = design_equations(self.mechanism)
        frames = design.positions.frames
        parts = []
        for point in self.points:
            link, at = point.members[0]
            parts += list(frames[link].to_world(design.work.shapes[link].position(at)))
        y, x, (places,) = in_entries(design, self.free, self.scale, [stack_expressions(parts) / self.size])
        told = [places], [places, ca.jacobian(places, y), ca.jacobian(places, x)]
        value, slopes = (ca.Function("places", [y, x], [ca.densify(each) for each in found]) for found in told)
        return BufferedFunction(value), BufferedFunction(slopes)

    def values(self, x: Array, y: Array) -> Array:
        """The depths (positions, points), of positions y (positions, unknowns) of designs x (positions, free)."""
        places = self._places[0].evaluate_batch(len(y), y, x)[0]
        return polygon_depths(places.reshape(-1, 2), self.corners)[0].reshape(len(y), len(self))

    def linearise(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """The depths, and their slopes in y (positions, points, unknowns) and x (positions, points, free), each with
        the other held."""
        places, by_y, by_x = self._places[1].evaluate_batch(len(y), y, x)
        depths, ways = polygon_depths(places.reshape(-1, 2), self.corners)
        ways = ways.reshape(len(y), len(self), 2)
        y_slopes, x_slopes = (
            np.einsum("npa,npai->npi", ways, each.swapaxes(1, 2).reshape(len(y), len(self), 2, each.shape[1]))
            for each in (by_y, by_x)
        )
        return depths.reshape(len(y), len(self)), y_slopes, x_slopes


GUARD_STEPS, MAX_GUARD_MOVE = 6, 0.7
"""Newton's steps, and how far unknowns may go in them: farther is another assembly."""
MARGIN = 2e-5
"""rad, or of the size: by so much a demand is more than kept, for what rounding of a file takes."""
UNKNOWN_SLACK = -1.0
"""Of what is not determined, as at a limit."""


class DemandSlopes(NamedTuple):
    """Slacks that are below a bound, of some designs, to the first order in the free numbers and the input."""

    designs: IntArray
    "(k,)"
    positions: IntArray
    rows: IntArray
    slack: Array
    by_numbers: Array
    "(k, free), the input held"
    by_input: Array
    "(k,)"


@dataclass(frozen=True)
class DemandGuard:
    """The equations at the positions, and the rows whose slack, their value less a `least` one, is not to be negative.

    `over_range`: the positions lie between the first and the last entry, at shares of that range of the input; else all
    round a turn, where they were given.
    """

    equations: WantedEquations
    rows: tuple[AdjointRows | RegionRows, ...] = ()
    least: tuple[float, ...] = ()
    over_range: bool = False
    turns_only: bool = False
    "whether nothing is demanded but that a design turns fully"
    keeps_order: bool = True
    "whether entries that are wanted in their order keep it while a design is fitted"

    def kept_by(self, turn: bool, order: bool) -> DemandGuard:
        """The guard of a fit that keeps a whole turn, where only that is demanded, and an order if it says so."""
        rows, least = (self.rows, self.least) if turn or not self.turns_only else ((), ())
        return replace(self, rows=rows, least=least, keeps_order=order)

    @property
    def position_count(self) -> int:
        """How many positions are spread over the motion."""
        return 0 if self.equations.rows.inputs is None else len(self.equations.rows.inputs)

    @property
    def row_count(self) -> int:
        """How many slacks a position has."""
        return sum(len(row) for row in self.rows)

    def ends(self, unknowns: Sequence[Array]) -> tuple[Array, Array]:
        """The least and the greatest input (designs,) of all entries of designs."""
        inputs = np.concatenate([y[..., -1] for y in unknowns], axis=1)
        return inputs.min(axis=1), inputs.max(axis=1)

    def close(self, numbers: Array, before: Array, shares: Array, unknowns: Sequence[Array]) -> tuple[Array, BoolArray]:
        """Unknowns of the positions (designs, positions, unknowns) of changed designs near those before, and which
        designs go together at all of them."""
        if not before.shape[1]:
            return before, np.ones(len(before), bool)
        tried = before
        if self.over_range:
            low, high = self.ends(unknowns)
            inputs = low[:, None] + shares * (high - low)[:, None]
            tried = np.concatenate([before[..., :-1], inputs[..., None]], axis=-1)
        found, is_closed = self.equations.close(numbers, tried, np.zeros_like(tried), GUARD_STEPS)
        return found, is_closed & (np.abs(found - before).max(axis=(1, 2), initial=0.0) < MAX_GUARD_MOVE)

    def slacks(self, numbers: Array, y: Array) -> Array:
        """What is left of every demand (designs, positions * rows), rad or of the size; below zero it is not kept."""
        many, positions, unknowns = y.shape
        if not self.rows:
            return np.zeros((many, 0))
        flat, x = y.reshape(-1, unknowns), np.repeat(numbers, positions, axis=0)
        parts = [row.values(x, flat) - least for row, least in zip(self.rows, self.least, strict=True)]
        found = np.concatenate(parts, axis=1).reshape(many, positions * self.row_count) - MARGIN
        return np.where(np.isfinite(found), found, UNKNOWN_SLACK)

    def slopes(self, numbers: Array, y: Array, is_near: BoolArray) -> DemandSlopes:
        """The slacks that are near (designs, positions, rows), to the first order along the motion's equations."""
        design, position = np.nonzero(is_near.any(axis=2))
        x, at = numbers[design], y[design, position]
        values, by_y, by_x = (
            np.concatenate(parts, axis=1) for parts in zip(*(row.linearise(x, at) for row in self.rows), strict=True)
        )
        _, F_y, F_x = (each[:, 0] for each in self.equations.closure_slopes_at(x, at[:, None]))
        closures = F_y.shape[1]
        K = np.zeros((len(x), closures + 1, closures + 1))
        K[:, :-1], K[:, -1, -1] = F_y, 1.0
        right = np.zeros((len(x), closures + 1, 1 + x.shape[1]))
        right[:, -1, 0], right[:, :-1, 1:] = 1.0, -F_x
        moves = solve_rows(K, right)
        along = np.nan_to_num(by_y @ moves)
        least = np.concatenate([np.full(len(row), own) for row, own in zip(self.rows, self.least, strict=True)])
        slack = values - least - MARGIN
        flat, row = np.nonzero(is_near[design, position])
        return DemandSlopes(
            design[flat],
            position[flat],
            row,
            np.where(np.isfinite(slack), slack, UNKNOWN_SLACK)[flat, row],
            (along[..., 1:] + np.nan_to_num(by_x))[flat, row],
            along[flat, row, 0],
        )


GUARD_POSITIONS = 24
"""Between which a motion is divided, all round a turn or from the first entry to the last."""
LEAST_RATE = 0.04
"""Of the input beside all unknowns, along the path: where it is less a dead point is near."""
SAMPLES = 24
"""Positions of a start, from which the outputs are known that one force drives, and by which pairs."""


def demand_guards(
    task: SynthesisTask, equations: WantedEquations, rows: WantedRows, free: FreeNumbers, size: float
) -> Mapping[bool, DemandGuard] | None:
    """The guards of designs that turn fully (True), and of others; None where nothing is demanded of the motion."""
    demands, mechanism = task.demands, equations.design.mechanism
    kept: list[tuple[AdjointRows | RegionRows, float]] = []
    if demands.transmission is not None:
        kept.append((output_rows(equations, free), demands.transmission))
    if demands.inside is not None:
        kept.append((RegionRows(mechanism, demands.inside, size, equations.free, equations.scale), 0.0))
    turns_only = not kept
    if task.needs_whole_turn or kept:
        kept.append((rate_rows(mechanism, equations.free, equations.scale), LEAST_RATE))
    is_guarded = bool(kept or demands.one_branch)
    is_bound = bool(task.exact) or any(getattr(item, "in_order", False) for item in task.wanted)
    if not (is_guarded or is_bound):
        return None
    positions = rows._replace(inputs=np.zeros(GUARD_POSITIONS + 1 if is_guarded else 0))
    guarded = WantedEquations(mechanism, positions, equations.free, equations.unit)
    kept = [each for each in kept if len(each[0])]
    told = tuple(each for each, _ in kept), tuple(least for _, least in kept)
    return {over_turn: DemandGuard(guarded, *told, not over_turn, turns_only) for over_turn in (True, False)}


def output_rows(equations: WantedEquations, free: FreeNumbers) -> AdjointRows:
    """The transmission angles (rad) of the outputs that one force drives."""
    mechanism = equations.design.mechanism
    try:
        motion = cycle(generic_start(mechanism, free), SAMPLES, pair=mechanism.inputs[0].pair)
        told = tuple(output_transmissions(motion))
    except PlanarError:
        told = ()  # the judge tells
    return AdjointRows(_transmission_systems(mechanism, told), equations.free, equations.scale)
