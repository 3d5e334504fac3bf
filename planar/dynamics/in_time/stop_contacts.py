"""Contacts at stops in a simulation: how far pairs are from them, impacts, what rests on which stop."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.dynamics.equations_of_motion import EquationsOfMotion
from planar.dynamics.in_time.complementarity import solve_complementarity
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.equations.casadi_functions import BufferedFunction
from planar.foundation.arrays import Array
from planar.foundation.short_repr import short_repr
from planar.solving.stops import STOP_TOLERANCE, MetStop, PairStops

LOWEST_BOUNCE = 1e-10
"""rad or sizes: a bounce that is lower, and all that would follow it, is a rest."""
STILL_TOLERANCE, LEAST_SPEED = 1e-9, 1e-6
"""Of the greatest speed, or of so many rad or sizes a second: what is slower stands still."""
StopSide = tuple[bool, int]
"""Whether it is an upper stop, and its number among the mechanism's stops."""


class Impact(NamedTuple):
    """An impact of a pair on its stop at a time (s): where that is (rad or m), the speeds towards it before and away
    from it after (rad/s or m/s), the impulse of the stop (N m s or N s), and the energy that is lost (J).

    `rests`: whether the pair stays there; a bounce too low to be followed ends so, with all that would come after it.
    """

    time: float
    pair: str
    position: float
    approach: float
    rebound: float
    impulse: float
    lost: float
    rests: bool

    def __repr__(self) -> str:
        return short_repr(self)


class ImpactResult(NamedTuple):
    """Rates after impacts (coordinates,), the impacts, and what driven inputs have put in (J)."""

    q1: Array
    impacts: tuple[Impact, ...]
    work: float


class StopContacts:
    """The stops of one mechanism, as functions of its coordinates; `turns` whole turns (rad) as in `PairStops`."""

    def __init__(self, work: LagrangianFunctions, stops: PairStops, q: Array):
        self.stops = stops
        positions = ca.vertcat(ca.SX(0, 1), *work.relative_positions(pair.name for pair in stops.pairs))
        slope = ca.jacobian(positions, work.q)
        rate = ca.mtimes(slope, work.q1)
        outputs = [positions, slope, rate, ca.jtimes(rate, work.q, work.q1)]
        self._motions = BufferedFunction(
            ca.Function("stops", [work.q, work.q1], [ca.densify(each) for each in outputs])
        )
        self.turns = stops.turns(self._evaluate(q, np.zeros(len(q)))[0])
        numbers = enumerate(zip(stops.low, stops.high, strict=True))
        self.sides: tuple[StopSide, ...] = tuple(
            (bool(upper), k) for k, both in numbers for upper, at in enumerate(both) if np.isfinite(at)
        )

    def rooms(self, q: Array, q1: Array) -> Array:
        """How far every side is, with its rate (sides, 2): rad or sizes, and per second."""
        positions, _, rates, _ = self._evaluate(q, q1)
        rooms, scaled = self.stops.rooms(positions, self.turns), rates / self.stops.scale
        return np.array([(rooms[int(upper), k], (-1.0 if upper else 1.0) * scaled[k]) for upper, k in self.sides])

    def met_stops(self, sides: tuple[StopSide, ...]) -> tuple[MetStop, ...]:
        """Sides as stops, at the positions that coordinates have there."""
        found = (self.stops.side(upper, k) for upper, k in sides)
        return tuple(
            each._replace(position=each.position - self.turns[k]) for each, (_, k) in zip(found, sides, strict=True)
        )

    def is_struck(self, equations: EquationsOfMotion, q: Array, q1: Array) -> bool:
        """Whether a pair moves on against a stop at which it is."""
        rooms = self.rooms(q, q1)
        return bool(np.any((rooms[:, 0] <= STOP_TOLERANCE) & (rooms[:, 1] < -still_rate(equations, q1))))

    def touching(self, q: Array, q1: Array) -> tuple[StopSide, ...]:
        """The sides at which pairs are."""
        return tuple(
            side for side, (room, _) in zip(self.sides, self.rooms(q, q1), strict=True) if room <= STOP_TOLERANCE
        )

    def resting(self, equations: EquationsOfMotion, time: float, q: Array, q1: Array) -> tuple[StopSide, ...]:
        """The sides on which pairs rest, pressed on them; `equations` are those without contacts."""
        at = self.still_sides(equations, q, q1)
        if not at:
            return ()
        normal, bend = self._normals(q, q1, at)
        pushed = equations.accelerations_at(time, q, q1).q2
        force = solve_complementarity(
            normal @ equations.impulse_response(time, q, q1) @ normal.T, normal @ pushed + bend
        )
        return () if force is None else tuple(side for side, each in zip(at, force, strict=True) if each > 0.0)

    def still_sides(self, equations: EquationsOfMotion, q: Array, q1: Array) -> tuple[StopSide, ...]:
        """The sides at which pairs are and stand still."""
        still = still_rate(equations, q1)
        return tuple(
            side
            for side, (room, rate) in zip(self.sides, self.rooms(q, q1), strict=True)
            if room <= STOP_TOLERANCE and abs(rate) <= still
        )

    def leaving_accelerations(self, q: Array, q1: Array, q2: Array, at: tuple[StopSide, ...]) -> Array:
        """The second rates of how far sides are (sides,), SI."""
        normal, bend = self._normals(q, q1, at)
        return normal @ q2 + bend

    def strike(self, equations: EquationsOfMotion, time: float, q: Array, q1: Array) -> ImpactResult | None:
        """The rates after the impacts at all stops that are touched, by Newton's law; None where no impulse can hold
        the pairs, as with an input that is driven on.

        Several at once: impulses push, and what they do not push goes away faster than restitution asks. Where the
        stops' restitutions would together add energy the least of them is taken for all.
        """
        at = self.touching(q, q1)
        normal, _ = self._normals(q, q1, at)
        compliance = equations.impulse_response(time, q, q1)
        matrix, before = normal @ compliance @ normal.T, normal @ q1
        own = np.array([self.stops.side(*side).restitution for side in at])
        hits: Array = np.zeros(len(at))
        after, lost = before, hits
        for restitution in (own, np.full(len(at), own.min(initial=1.0)), np.zeros(len(at))):
            found = solve_complementarity(matrix, np.where(before < 0.0, (1.0 + restitution) * before, before))
            if found is None:
                return None
            hits, after = found, before + matrix @ found
            lost = -0.5 * hits * (before + after)
            if lost.sum() >= 0.0:
                break
        there = q1 + compliance @ normal.T @ hits
        gained = float(equations.energies(time, q, there)[0] - equations.energies(time, q, q1)[0])
        impacts = tuple(
            Impact(
                float(time),
                stop.pair,
                stop.position,
                -float(v),
                max(float(w), 0.0),
                float(hit),
                max(float(gone), 0.0),
                False,
            )
            for stop, v, w, hit, gone in zip(
                (self.stops.side(*side) for side in at), before, after, hits, lost, strict=True
            )
            if hit > 0.0
        )
        return ImpactResult(there, impacts, gained + float(lost.sum()))

    def settle(self, equations: EquationsOfMotion, time: float, q: Array, found: ImpactResult) -> ImpactResult:
        """The same, bounces that are too low to be followed taken for the end of all bounces: there the pair rests."""
        at = self.touching(q, found.q1)
        normal, bend = self._normals(q, found.q1, at)
        pushed = normal @ equations.accelerations_at(time, q, found.q1).q2 + bend
        rate = normal @ found.q1
        scale = np.array([self.stops.scale[k] for _, k in at])
        low = (rate > 0.0) & (pushed < 0.0) & (rate**2 < -2.0 * pushed * LOWEST_BOUNCE * scale)
        if not low.any():
            return found
        compliance = equations.impulse_response(time, q, found.q1)
        # the motion away from these is taken out, whatever the others do
        some = normal[low]
        pull = np.linalg.lstsq(some @ compliance @ some.T, -rate[low], rcond=1e-12)[0]
        still = found.q1 + compliance @ some.T @ pull
        lost = -0.5 * pull * rate[low]
        names = {
            self.stops.side(*side).pair: float(each)
            for side, each in zip(np.array(at, dtype=object)[low], lost, strict=True)
        }
        impacts = tuple(
            each._replace(rebound=0.0, lost=each.lost + names[each.pair], rests=True) if each.pair in names else each
            for each in found.impacts
        )
        gained = float(equations.energies(time, q, still)[0] - equations.energies(time, q, found.q1)[0])
        return ImpactResult(still, impacts, found.work + gained + float(lost.sum()))

    def _normals(self, q: Array, q1: Array, at: tuple[StopSide, ...]) -> tuple[Array, Array]:
        """The derivative of how far sides are by the coordinates (sides, coordinates), and their second rates without
        accelerations (sides,), SI."""
        _, slope, _, bend = self._evaluate(q, q1)
        sense = np.array([-1.0 if upper else 1.0 for upper, _ in at])
        which = [k for _, k in at]
        return sense[:, None] * slope[which], sense * bend[which]

    def _evaluate(self, q: Array, q1: Array) -> tuple[Array, Array, Array, Array]:
        positions, slope, rates, bend = self._motions(q, q1)
        return positions[0], slope.T, rates[0], bend[0]


def still_rate(equations: EquationsOfMotion, q1: Array) -> float:
    """A rate (rad or sizes a second) below which a pair stands still, beside the rates of all coordinates."""
    return STILL_TOLERANCE * max(float(np.abs(q1 / equations.scale).max(initial=0.0)), LEAST_SPEED)
