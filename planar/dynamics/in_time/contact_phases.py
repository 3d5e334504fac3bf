"""The phases of a simulation between its impacts: which pairs rest on stops, and the equations of motion of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planar.dynamics.equations_of_motion import EquationsOfMotion
from planar.dynamics.in_time.stop_contacts import Impact, StopContacts, StopSide
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.root_finding import find_first_passage, find_root
from planar.solving.stops import MetStop, PairStops

MAX_IMPACTS = 20_000
"""Impacts that are followed."""
Interpolant = Callable[[float], Array]


class ContactEvent(NamedTuple):
    """When a pair meets a stop, or is no longer pressed on one (s)."""

    time: float
    side: StopSide
    lifts_off: bool


class ContactPhases:
    """The phases of one motion. A state y is the coordinates, their rates, and the work that was put in (J)."""

    def __init__(
        self, base: EquationsOfMotion, stops: PairStops | None, q: Array, make: Callable[..., EquationsOfMotion]
    ):
        """`base`: the equations without contacts; `make(resting)` makes those with pairs that rest on stops."""
        self.base, self.equations, self._make = base, base, make
        self.coordinate_count = len(q)
        self.contacts = None if stops is None else StopContacts(base.work, stops, q)
        self.resting: tuple[StopSide, ...] = ()
        self.impacts: list[Impact] = []
        self._made: dict[tuple[StopSide, ...], EquationsOfMotion] = {(): base}
        self._begun: list[tuple[float, EquationsOfMotion]] = [(-np.inf, base)]

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
        contacts = self.contacts
        if contacts is None:
            return None
        made: list[Interpolant] = []

        def state(time: float) -> tuple[Array, Array]:
            made[:] = made or [interpolant()]
            return self.split(before[1] if time == before[0] else np.asarray(made[0](time)))

        (first, y0), (last, y1) = before, after
        rooms0, rooms1 = contacts.rooms(*self.split(y0)), contacts.rooms(*self.split(y1))
        found: list[ContactEvent] = []
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
            return y
        q, q1 = self.split(y)
        self.base.pieces = None
        if contacts.is_struck(self.base, q, q1):
            hit = contacts.strike(self.base, time, q, q1)
            if hit is None or len(self.impacts) > MAX_IMPACTS:
                raise self._refusal(time, q, q1, hit is None)
            hit = contacts.settle(self.base, time, q, hit)
            y[self.coordinate_count : 2 * self.coordinate_count] = hit.q1
            y[-1] += hit.work
            q, q1 = self.split(y)
            resting = contacts.resting(self.base, time, q, q1)
            held = {contacts.stops.pairs[k].name for _, k in resting}
            self.impacts += (each._replace(rests=each.pair in held) for each in hit.impacts)
        resting = contacts.resting(self.base, time, q, q1)
        if event is not None and event.lifts_off:
            resting = tuple(side for side in resting if side != event.side)
        self.resting = resting
        if resting not in self._made:
            self._made[resting] = self._make(contacts.met_stops(resting))
        self.equations = self._made[resting]
        self._begun.append((time, self.equations))
        return y

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

    def make(resting: Sequence[MetStop] = ()) -> EquationsOfMotion:
        return EquationsOfMotion(work, driven, unit, wound, resting)

    stops = PairStops(work.mechanism, unit) if work.mechanism.stops else None
    return ContactPhases(make(), stops, q, make)
