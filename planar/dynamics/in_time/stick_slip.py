"""Which pairs stick and which slip, and in which sense, from a position with rates on.

Pairs that stand still stick while friction at rest can hold them: unless released in some sense, with as much friction
as there can be, they would accelerate in it. Pairs whose rates are proportional stick and slip together.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.dynamics.equations_of_motion import EquationsOfMotion, SlidingFriction
from planar.dynamics.friction.contact_dynamics import (
    ContactDynamics,
    CountedContacts,
    HeldContacts,
    solve_all,
)
from planar.dynamics.friction.contact_functions import ContactFunctions, ContactValues
from planar.dynamics.in_time.sign_patterns import Signs, cocircuits, sign_patterns
from planar.dynamics.in_time.stop_contacts import StopSide
from planar.dynamics.load_variation import CoursePiece
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.short_repr import short_repr
from planar.model.pairs import MeasureKind
from planar.model.wording import quote_names

STILL_TOLERANCE, LEAST_SPEED = 1e-10, 1e-6
"""Of the greatest speed so far, or of so many rad or sizes a second: a pair with less stands still."""
STOPPED_TOLERANCE = 1e-7
"""Of the greatest speed so far: what moves with a pair that comes to rest, and has less, rests with it."""
HELD_TOLERANCE = 1e-9
"""Of a free motion: a pair moved by less in it is held by others."""
PARALLEL_TOLERANCE = 1e-9
ACCELERATION_TOLERANCE = 1e-10
"""Of the greatest acceleration without friction: less is none."""


class RubbingState(NamedTuple):
    """How pairs rub in a phase: the senses of their rates (pairs,), 0 where one stands still, and which stick."""

    senses: Array
    sticks: BoolArray

    def __repr__(self) -> str:
        return short_repr(self)


class Release(NamedTuple):
    """What may slip of what sticks: the senses of the pairs that would (pairs,), 0 of others, and those that hold the
    rest."""

    signs: Signs
    sticking: tuple[str, ...]


class FrictionBreak(NamedTuple):
    """Where a phase ends (s): the pair of number `stopped` comes to rest, a `release` (pairs,) slips from it, or a
    contact's part leads."""

    time: float
    stopped: int | None = None
    release: Signs | None = None
    lead: tuple[int, int] | None = None


class StickSlipPhase(NamedTuple):
    """The equations of motion of a phase, with pairs at rest on these sides, how pairs rub in it, at which positions
    it begins (pairs,), what may be released of what sticks, and an acceleration that is none."""

    equations: EquationsOfMotion
    sides: tuple[StopSide, ...]
    state: RubbingState
    positions: Array
    releases: tuple[Release, ...]
    least: float

    def __repr__(self) -> str:
        return short_repr(self)


class _Standing(NamedTuple):
    """Where pairs stand still: by class of those that move together the pairs with the ways they go, and the classes'
    rows of length one; the senses of all others; what is none of an acceleration."""

    classes: tuple[tuple[tuple[int, int], ...], ...]
    rows: Array
    senses: Array
    least: float


class _Tried(NamedTuple):
    """A try of senses: its equations, its contacts, and the second rates of all rubbing pairs, in units (pairs,)."""

    equations: EquationsOfMotion
    senses: Array
    sticks: BoolArray
    dynamics: ContactDynamics
    solution: CountedContacts
    second: Array


class StickSlip:
    """What sticks and slips in one motion; `make(sides, pairs)` gives equations where pairs rest on stops and stick."""

    def __init__(
        self,
        functions: ContactFunctions,
        make: Callable[[tuple[StopSide, ...], tuple[str, ...]], EquationsOfMotion],
        unit: float,
    ):
        self.functions, self._make = functions, make
        motions = functions.work.relative_motions
        lengths = [motions[name].input_kind is MeasureKind.LENGTH for name in functions.pairs]
        self.units = np.where(lengths, unit, 1.0)
        self.fastest = LEAST_SPEED
        self._pieces: tuple[CoursePiece, ...] | None = None

    def find_phase(
        self, time: float, y: tuple[Array, Array], sides: tuple[StopSide, ...], event: FrictionBreak | None = None
    ) -> StickSlipPhase:
        """The phase that begins at coordinates and rates, with pairs at rest on these sides. Raises NoAnswer where
        no motion agrees with friction, or several do."""
        base = self._make(sides, ()).in_phase(np.zeros(0))
        base.pieces = self._pieces = base.course_pieces(base.course_places(time, *y))
        self.note_speed(base, y[1])
        values = base.contact_values(self.functions, time, *y)
        standing = self._standing(base, values, time, y, None if event is None else event.stopped)
        release = event.release if event is not None else None
        chosen, releases = self._choose(time, y, sides, values, standing, release)
        self.refuse_several(chosen.solution)
        contacts = HeldContacts(chosen.dynamics.system, chosen.solution.y)
        if event is not None and event.lead is not None:
            contacts.lead_by(*event.lead)
        equations = chosen.equations
        if equations.stays_at_rest(time, *y):
            releases = ()
        equations.friction = SlidingFriction(self.functions, chosen.senses, contacts)
        state = RubbingState(chosen.senses, chosen.sticks)
        return StickSlipPhase(equations, sides, state, values.positions, releases, standing.least)

    def note_speed(self, equations: EquationsOfMotion, q1: Array) -> None:
        """Speeds that are reached tell what stands still."""
        self.fastest = max(self.fastest, float(np.abs(q1 / equations.scale).max(initial=0.0)))

    def side(self, phase: StickSlipPhase, name: str) -> str:
        """Where a pair bears, or which wheel drives, in words."""
        for k, (pair, words) in enumerate(zip(self.functions.contact_pairs, self.functions.sides, strict=False)):
            sense = phase.state.senses[self.functions.pairs.index(pair)]
            if pair == name and sense and not (self.functions.is_resultant[k] or self.functions.is_signed[k]):
                assert phase.equations.friction is not None
                return words[int(sense < 0.0)][int(phase.equations.friction.contacts.leading[k])]
        return ""

    def _standing(
        self, base: EquationsOfMotion, values: ContactValues, time: float, y: tuple[Array, Array], stopped: int | None
    ) -> _Standing:
        rates = values.rates / self.units
        moving = np.abs(rates) > STILL_TOLERANCE * self.fastest
        pushed = base.accelerations_at(time, *y).q2
        second = (values.slopes @ pushed + values.bends) / self.units
        most = max(float(np.abs(second).max(initial=0.0)), float(np.abs(pushed / base.scale).max(initial=0.0)))
        least = ACCELERATION_TOLERANCE * max(most, LEAST_SPEED)
        ways = base.free_directions(time, *y)
        rows = values.slopes @ ways / self.units[:, None]
        long = np.linalg.norm(rows, axis=1)
        if stopped is not None:  # and what moves with it, as far as rounding tells
            is_parallel = np.abs(rows @ rows[stopped]) >= (1.0 - PARALLEL_TOLERANCE) * long * long[stopped]
            moving &= ~(is_parallel & (np.abs(rates) <= STOPPED_TOLERANCE * self.fastest))
            moving[stopped] = False
        senses = np.where(moving, np.sign(rates), 0.0)
        classes: list[list[tuple[int, int]]] = []
        kept: list[Array] = []
        for k in np.flatnonzero(~moving):
            if long[k] <= HELD_TOLERANCE:
                senses[k] = np.sign(second[k]) if abs(second[k]) > least else 0.0
                continue
            row = rows[k] / long[k]
            along = [float(row @ other) for other in kept]
            same = next((j for j, each in enumerate(along) if abs(abs(each) - 1.0) < PARALLEL_TOLERANCE), None)
            if same is None:
                kept.append(row)
                classes.append([(int(k), 1)])
            else:
                classes[same].append((int(k), 1 if along[same] > 0.0 else -1))
        found = np.array(kept).reshape(len(kept), ways.shape[1])
        return _Standing(tuple(map(tuple, classes)), found, senses, least)

    def _choose(  # many: one choice
        self,
        time: float,
        y: tuple[Array, Array],
        sides: tuple[StopSide, ...],
        values: ContactValues,
        standing: _Standing,
        release: Signs | None,
    ) -> tuple[_Tried, tuple[Release, ...]]:
        """The senses with which the motion agrees, of several those in which most sticks."""

        def attempt(signs: Signs, at_rest: tuple[int, ...] = ()) -> _Tried | None:
            return self._try(time, y, sides, values, standing, signs, at_rest)

        none = True
        for signs in sign_patterns(standing.rows):
            if release is not None and not self._has_release(standing, signs, release):
                continue
            tried = attempt(signs)
            if tried is None:
                continue
            none = False
            slipping = [k for k, sign in enumerate(signs) if sign]
            ahead = [signs[k] * way * tried.second[pair] for k in slipping for pair, way in standing.classes[k][:1]]
            if min(ahead, default=0.0) < -standing.least:
                continue
            releases = self._possible_releases(standing, signs)
            if any(self._is_released(attempt, standing, signs, each) for each in releases):
                continue
            freed = [tuple(a or b for a, b in zip(signs, each, strict=True)) for each in releases]
            return tried, tuple(
                Release(self._of_pairs(standing, each), self._representatives(standing, whole))
                for each, whole in zip(releases, freed, strict=True)
            )
        raise NoAnswer(Outcome.INPUT_JAMMED, self.jam_sentence(none))

    def _possible_releases(self, standing: _Standing, signs: Signs) -> list[Signs]:
        """The ways in which what sticks can slip with one freedom more, of classes."""
        stuck = [k for k, sign in enumerate(signs) if not sign]
        found = []
        for ray in cocircuits(standing.rows[stuck]):
            whole = [0] * len(signs)
            for k, sign in zip(stuck, ray, strict=True):
                whole[k] = sign
            found.append(tuple(whole))
        return found

    def _is_released(
        self, attempt: Callable[..., _Tried | None], standing: _Standing, signs: Signs, release: Signs
    ) -> bool:
        """Whether what sticks would accelerate in a sense, with friction at rest against it."""
        tried = attempt(tuple(a or b for a, b in zip(signs, release, strict=True)), tuple(np.flatnonzero(release)))
        return tried is not None and self._release_margin(standing, tried.second, release) > standing.least

    def _release_margin(self, standing: _Standing, second: Array, release: Signs) -> float:
        firsts = [(sign * standing.classes[k][0][1], standing.classes[k][0][0]) for k, sign in enumerate(release)]
        return min(float(sign * second[pair]) for sign, pair in firsts if sign)

    def _of_pairs(self, standing: _Standing, signs: Signs) -> Signs:
        """Signs of classes as signs of pairs."""
        found = [0] * len(self.functions.pairs)
        for sign, members in zip(signs, standing.classes, strict=True):
            for pair, way in members:
                found[pair] = sign * way
        return tuple(found)

    def _has_release(self, standing: _Standing, signs: Signs, release: Signs) -> bool:
        own = self._of_pairs(standing, signs)
        still = {pair for members in standing.classes for pair, _ in members}
        return all(own[k] == sign for k, sign in enumerate(release) if sign and k in still)

    # many: one try
    def _try(
        self,
        time: float,
        y: tuple[Array, Array],
        sides: tuple[StopSide, ...],
        values: ContactValues,
        standing: _Standing,
        signs: Signs,
        at_rest: tuple[int, ...],
    ) -> _Tried | None:
        """The motion with these senses of classes, some with friction at rest; None where contacts have no solution."""
        own = np.array(self._of_pairs(standing, signs), dtype=float)
        senses = np.where(own != 0.0, own, standing.senses)
        sticks = np.zeros(len(senses), dtype=bool)
        static = np.zeros(len(senses), dtype=bool)
        for k, members in enumerate(standing.classes):
            which = [pair for pair, _ in members]
            sticks[which], static[which] = not signs[k], k in at_rest
        equations = self.equations(sides, self._representatives(standing, signs), values.positions)
        dynamics = equations.contact_dynamics(self.functions, time, *y, senses, static)
        solution = solve_all(dynamics.system)
        if not solution.solution_count:
            return None
        pushed = dynamics.accelerations + dynamics.changes @ solution.y
        second = (values.slopes @ pushed + values.bends) / self.units
        return _Tried(equations, senses, sticks, dynamics, solution, second)

    def equations(self, sides: tuple[StopSide, ...], sticking: tuple[str, ...], positions: Array) -> EquationsOfMotion:
        """Those of pairs that stick at positions of all rubbing pairs (pairs,)."""
        found = self._make(sides, sticking).in_phase(positions[[self.functions.pairs.index(name) for name in sticking]])
        found.pieces = self._pieces
        return found

    def _representatives(self, standing: _Standing, signs: Signs) -> tuple[str, ...]:
        """Of the classes that stick so many pairs as hold all of them."""
        kept: list[int] = []
        for k, sign in enumerate(signs):
            if not sign and np.linalg.matrix_rank(standing.rows[[*kept, k]], tol=1e-9) > len(kept):
                kept.append(k)
        return tuple(self.functions.pairs[standing.classes[k][0][0]] for k in kept)

    def refuse_several(self, solution: CountedContacts) -> None:
        """Raise NoAnswer where there is not just one solution, or that is not proved."""
        at = f"with the friction at {quote_names(self.functions.pairs)}"
        if not solution.solution_count:
            raise NoAnswer(Outcome.INPUT_JAMMED, self.jam_sentence(True))
        if solution.solution_count > 1:
            raise NoAnswer(
                Outcome.BRANCH_LOST,
                f"{at} there are {solution.solution_count} solutions for the forces and accelerations, and nothing "
                "tells which is there; with less friction there is one",
            )
        if not solution.is_complete:
            told = f"{at} one solution for the forces and accelerations was found, but others could not be ruled out"
            raise NoAnswer(Outcome.BRANCH_LOST, told)

    def jam_sentence(self, no_forces: bool) -> str:
        """That no solution goes with the motion."""
        told = "no forces and accelerations" if no_forces else "no way to stick or slip"
        return f"with the friction at {quote_names(self.functions.pairs)} {told} agree with the motion: it jams"
