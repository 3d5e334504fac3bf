"""The phases of a simulation between its events: which pairs rest on stops, stick and slip, and their equations."""

from __future__ import annotations

from collections.abc import Callable
from itertools import chain, combinations
from typing import NamedTuple

import numpy as np

from planar.dynamics.equations_of_motion import EquationsOfMotion
from planar.dynamics.friction.contact_functions import ContactFunctions
from planar.dynamics.in_time.friction_breaks import FrictionBreaks
from planar.dynamics.in_time.friction_record import FrictionRecord
from planar.dynamics.in_time.stick_slip import FrictionBreak, StickSlip, StickSlipPhase
from planar.dynamics.in_time.stop_contacts import Impact, StopContacts, StopSide
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.root_finding import find_first_passage, find_root
from planar.solving.stops import PairStops

MAX_IMPACTS = 20_000
"""Impacts that are followed."""
PRESSED_TOLERANCE = 1e-10
"""Of the greatest acceleration: what goes on against a stop by less does not."""
Interpolant = Callable[[float], Array]


class ContactEvent(NamedTuple):
    """When a pair meets a stop, or is no longer pressed on one (s); or when friction changes."""

    time: float
    side: StopSide | None = None
    lifts_off: bool = False
    friction: FrictionBreak | None = None


class ContactPhases:
    """The phases of one motion. A state y is the coordinates, their rates, the work that was put in, and the heat of
    every pair that rubs (J)."""

    def __init__(
        self,
        make: Callable[[tuple[StopSide, ...], tuple[str, ...]], EquationsOfMotion],
        contacts: StopContacts | None,
        functions: ContactFunctions | None,
        unit: float,
    ):
        """`make(sides, pairs)` makes equations with pairs that rest on stops, and pairs that stick."""
        self._make = make
        self._made: dict[tuple[tuple[StopSide, ...], tuple[str, ...]], EquationsOfMotion] = {}
        self.base = self.equations = self._cached((), ())
        self.coordinate_count = self.base.work.q.numel()
        self.contacts = contacts
        self.resting: tuple[StopSide, ...] = ()
        self.impacts: list[Impact] = []
        self._begun: list[tuple[float, EquationsOfMotion]] = [(-np.inf, self.base)]
        self.stick_slip = None if functions is None else StickSlip(functions, self._cached, unit)
        self.rubbing: StickSlipPhase | None = None
        self.record = FrictionRecord(functions)

    @property
    def is_begun(self) -> bool:
        """Whether a phase was found to begin with."""
        return self.stick_slip is None or self.rubbing is not None

    @property
    def is_sticking(self) -> bool:
        """Whether friction holds a pair that it may yet release."""
        return self.rubbing is not None and bool(self.rubbing.releases)

    def split(self, y: Array) -> tuple[Array, Array]:
        """Coordinates and rates."""
        many = self.coordinate_count
        return y[:many], y[many : 2 * many]

    def equations_at(self, time: float) -> EquationsOfMotion:
        """Those of the phase that a time (s) belongs to; where two meet of the one before."""
        return next(each for begun, each in reversed(self._begun) if begun < time or begun <= 0.0)

    def lost_at(self, times: Array) -> Array:
        """What impacts before times have taken (times,), J."""
        at, lost = (np.array([getattr(each, name) for each in self.impacts]) for name in ("time", "lost"))
        return np.array([float(lost[at < time].sum()) for time in times])

    def first_event(
        self, before: tuple[float, Array], after: tuple[float, Array], interpolant: Callable[[], Interpolant]
    ) -> ContactEvent | None:
        """The first that happens between two states at their times; `interpolant()` gives the states between them."""
        made: list[Interpolant] = []

        def state(time: float) -> tuple[Array, Array]:
            made[:] = made or [interpolant()]
            return self.split(before[1] if time == before[0] else np.asarray(made[0](time)))

        (first, y0), (last, y1) = before, after
        found: list[ContactEvent] = []
        if self.stick_slip is not None and self.rubbing is not None:
            self.stick_slip.note_speed(self.base, self.split(y1)[1])
            change = FrictionBreaks(self.stick_slip).first_break(self.rubbing, (first, last), state)
            found += [] if change is None else [ContactEvent(change.time, friction=change)]
        contacts = self.contacts
        if contacts is None:
            return found[0] if found else None
        rooms0, rooms1 = contacts.rooms(*self.split(y0)), contacts.rooms(*self.split(y1))
        for k, side in enumerate(contacts.sides):
            if side in self.resting:
                continue

            def room(time: float, k: int = k) -> float:
                return float(contacts.rooms(*state(time))[k, 0])

            def rate(time: float, k: int = k) -> float:
                return float(contacts.rooms(*state(time))[k, 1])

            known = (float(rooms0[k, 0]), float(rooms0[k, 1])), (float(rooms1[k, 0]), float(rooms1[k, 1]))
            at = find_first_passage(room, rate, (first, last), known)
            if at is not None:
                found.append(ContactEvent(at, side, False))
        pulled = np.flatnonzero(self.contact_forces(last, *self.split(y1)) < 0.0) if self.resting else ()
        for number in pulled:

            def force(time: float, number: int = int(number)) -> float:
                return float(self.contact_forces(time, *state(time))[number])

            found.append(ContactEvent(find_root(force, first, last), self.resting[number], True))
        return min(found, key=lambda each: each.time, default=None)

    def contact_forces(self, time: float, q: Array, q1: Array) -> Array:
        """What the stops exert on which pairs rest (resting,), N or N m, positive as they push."""
        efforts = self.equations.accelerations_at(time, q, q1).efforts[-len(self.resting) :]
        return efforts * np.array([-1.0 if upper else 1.0 for upper, _ in self.resting])

    def respond(self, time: float, y: Array, event: ContactEvent | None = None) -> Array:
        """The state after what happens at a time: impacts, and what rests from then on. Raises NoAnswer where an input
        is driven on against a stop."""
        contacts, y = self.contacts, y.copy()
        if contacts is None:
            self._begin(time, y, event)
            return y
        q, q1 = self.split(y)
        self.base.pieces = None
        if contacts.is_struck(self.base, q, q1):
            hit = contacts.strike(self.base, time, q, q1)
            if hit is None or len(self.impacts) > MAX_IMPACTS:
                raise self._refusal(time, q, q1, hit is None)
            hit = contacts.settle(self.base, time, q, hit)
            y[self.coordinate_count : 2 * self.coordinate_count] = hit.q1
            y[2 * self.coordinate_count] += hit.work
            q, q1 = self.split(y)
            resting = contacts.resting(self.base, time, q, q1)
            held = {contacts.stops.pairs[k].name for _, k in resting}
            self.impacts += (each._replace(rests=each.pair in held) for each in hit.impacts)
        self._begin(time, y, event)
        return y

    def _begin(self, time: float, y: Array, event: ContactEvent | None) -> None:
        """Begin the phase that follows at a state."""
        q, q1 = self.split(y)
        if self.stick_slip is not None:
            self._begin_with_friction(time, (q, q1), event)
        elif self.contacts is not None:
            resting = self.contacts.resting(self.base, time, q, q1)
            if event is not None and event.lifts_off:
                resting = tuple(side for side in resting if side != event.side)
            self.resting, self.equations = resting, self._cached(resting, ())
        self._begun.append((time, self.equations))

    def _begin_with_friction(self, time: float, y: tuple[Array, Array], event: ContactEvent | None) -> None:
        """Begin a phase in which pairs rub or stick, and the fewest rest on stops that push them."""
        assert self.stick_slip is not None
        contacts = self.contacts
        at = () if contacts is None else contacts.still_sides(self.base, *y)
        if event is not None and event.lifts_off:
            at = tuple(side for side in at if side != event.side)
        change = None if event is None else event.friction
        if change is not None:  # what turns back near a stop does not rest on it
            at = tuple(side for side in at if side in self.resting)
        refused: NoAnswer | None = None
        for sides in chain.from_iterable(combinations(at, size) for size in range(len(at) + 1)):
            try:
                phase = self.stick_slip.find_phase(time, y, sides, change)
            except NoAnswer as jammed:
                refused = jammed
                continue
            if contacts is None or self._is_held(contacts, phase, time, y, at):
                self.resting, self.rubbing, self.equations = sides, phase, phase.equations
                self.record.begin(time, self.stick_slip, phase)
                return
        raise refused or NoAnswer(Outcome.INPUT_JAMMED, "no pair rests on its stop or leaves it as its friction allows")

    def _is_held(
        self,
        contacts: StopContacts,
        phase: StickSlipPhase,
        time: float,
        y: tuple[Array, Array],
        at: tuple[StopSide, ...],
    ) -> bool:
        """Whether the stops on which pairs rest push them, and no other pair goes on against its stop."""
        pushed = phase.equations.accelerations_at(time, *y)
        sense = np.array([-1.0 if upper else 1.0 for upper, _ in phase.sides])
        force = pushed.efforts[len(pushed.efforts) - len(sense) :] * sense
        free = tuple(side for side in at if side not in phase.sides)
        leaving = contacts.leaving_accelerations(*y, pushed.q2, free)
        least = PRESSED_TOLERANCE * float(np.abs(pushed.q2 / self.base.scale).max(initial=0.0))
        return bool((force > 0.0).all() and (leaving >= -least * self.base.scale.max()).all())

    def _cached(self, sides: tuple[StopSide, ...], sticking: tuple[str, ...]) -> EquationsOfMotion:
        key = sides, sticking
        if key not in self._made:
            self._made[key] = self._make(sides, sticking)
        return self._made[key]

    def _refusal(self, time: float, q: Array, q1: Array, is_driven: bool) -> NoAnswer:
        contacts = self.contacts
        assert contacts is not None
        if not is_driven:
            told = f"{MAX_IMPACTS} impacts on stops were followed; simulate a shorter time"
            return NoAnswer(Outcome.BRANCH_LOST, told)
        stops = contacts.stops
        met = [stops.side(*side).describe(stops.motions, stops.mechanism.units) for side in contacts.touching(q, q1)]
        return NoAnswer(Outcome.STOP, f"{' and '.join(met)}, against which a driven input goes on")


def make_phases(
    work: LagrangianFunctions, driven: tuple[str, ...], unit: float, wound: Array, q: Array
) -> ContactPhases:
    """The phases of a motion from coordinates q, before which nothing rests."""
    mechanism = work.mechanism
    contacts = StopContacts(work, PairStops(mechanism, unit), q) if mechanism.stops else None
    functions = ContactFunctions(work) if any(pair.has_friction for pair in mechanism.pairs) else None

    def make(sides: tuple[StopSide, ...], sticking: tuple[str, ...]) -> EquationsOfMotion:
        resting = () if contacts is None else contacts.met_stops(sides)
        return EquationsOfMotion(work, driven, unit, wound, resting, sticking)

    return ContactPhases(make, contacts, functions, unit)
