"""Where a phase of sticking and slipping ends: a rate is zero, friction at rest gives way, or a contact turns over."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from planar.dynamics.friction.contact_dynamics import is_single, solve_all
from planar.dynamics.in_time.stick_slip import STILL_TOLERANCE, FrictionBreak, Release, StickSlip, StickSlipPhase
from planar.foundation.arrays import Array, IntArray
from planar.foundation.root_finding import find_first_passage, find_root

SIDE_TOLERANCE = 1e-12
"""Of the greatest part of a contact: what another is above the leading one by less is not."""
StateFunction = Callable[[float], tuple[Array, Array]]
"""Coordinates and their rates at a time."""


class FrictionBreaks:
    """The ends of phases of one motion."""

    def __init__(self, stick_slip: StickSlip):
        self.stick_slip, self.functions, self.units = stick_slip, stick_slip.functions, stick_slip.units

    def first_break(
        self,
        phase: StickSlipPhase,
        ends: tuple[float, float],
        state: StateFunction,
    ) -> FrictionBreak | None:
        """The first end of a phase between two times. Raises NoAnswer where contacts get several solutions."""
        found = [*self._zero_rates(phase, ends, state), *self._new_leads(phase, ends, state)]
        found += self._releases(phase, ends, state)
        return min(found, key=lambda each: each.time, default=None)

    def _zero_rates(
        self, phase: StickSlipPhase, ends: tuple[float, float], state: StateFunction
    ) -> Iterator[FrictionBreak]:
        """Where pairs that slip come to rest, and where such as stood still move."""

        def motion(time: float) -> tuple[Array, Array]:
            values = phase.equations.contact_values(self.functions, time, *state(time))
            second = values.slopes @ phase.equations.regular_accelerations(time, *state(time)).q2 + values.bends
            by = self.units * self.stick_slip.fastest
            return values.rates / by, second / by

        if not phase.state.senses.any():
            still = phase.equations.contact_values(self.functions, ends[1], *state(ends[1])).rates
            if np.abs(still / self.units).max(initial=0.0) <= 2.0 * STILL_TOLERANCE * self.stick_slip.fastest:
                return
        first, last = motion(ends[0]), motion(ends[1])
        for k, sense in enumerate(phase.state.senses.tolist()):
            if sense:
                known = (sense * first[0][k], sense * first[1][k]), (sense * last[0][k], sense * last[1][k])

                def along(time: float, order: int, k: int = k, sense: float = sense) -> float:
                    return sense * float(motion(time)[order][k])

                at = find_first_passage(partial(along, order=0), partial(along, order=1), ends, known)
                if at is not None:
                    yield FrictionBreak(at, stopped=k)
            elif abs(last[0][k]) > 2.0 * STILL_TOLERANCE:

                def moved(time: float, k: int = k) -> float:
                    return abs(float(motion(time)[0][k])) - 1.5 * STILL_TOLERANCE

                yield FrictionBreak(find_root(moved, ends[0], ends[1]))

    def _new_leads(
        self, phase: StickSlipPhase, ends: tuple[float, float], state: StateFunction
    ) -> Iterator[FrictionBreak]:
        """Where another part of a contact leads from then on, as where a guide bears on its other side."""
        friction = phase.equations.friction
        assert friction is not None
        if not phase.state.senses.any() and self.functions.is_friction.all():
            return  # nothing rubs, and no teeth press
        none = np.zeros(len(phase.state.senses), dtype=bool)

        def leads(time: float) -> tuple[Array, IntArray]:
            dynamics = phase.equations.contact_dynamics(self.functions, time, *state(time), friction.senses, none)
            y = friction.contacts.solve(dynamics.system)
            if y is None:
                many = len(self.functions.contact_pairs)
                return np.full(many, np.nan), np.zeros(many, dtype=int)
            return friction.contacts.leads(dynamics.system, y)

        dynamics = phase.equations.contact_dynamics(self.functions, ends[1], *state(ends[1]), friction.senses, none)
        gaps = leads(ends[1])[0]
        passed = np.flatnonzero(gaps < -SIDE_TOLERANCE)
        for k in passed:

            def gap(time: float, k: int = int(k)) -> float:
                found = float(leads(time)[0][k]) + SIDE_TOLERANCE
                return max(found, SIDE_TOLERANCE) if time == ends[0] else found  # there rounding tells no sign

            at = find_root(gap, ends[0], ends[1])
            yield FrictionBreak(at, lead=(int(k), int(leads(at)[1][k])))
        if not passed.size and not is_single(dynamics.system):
            self.stick_slip.refuse_several(solve_all(dynamics.system))

    def _releases(
        self, phase: StickSlipPhase, ends: tuple[float, float], state: StateFunction
    ) -> Iterator[FrictionBreak]:
        """Where what sticks slips."""
        for release in phase.releases:
            if self._margin(phase, release, ends[1], state(ends[1])) > 0.0:
                at = ends[0]
                if self._margin(phase, release, at, state(at)) <= 0.0:

                    def margin(time: float, release: Release = release) -> float:
                        return self._margin(phase, release, time, state(time))

                    at = find_root(margin, *ends)
                yield FrictionBreak(at, release=release.signs)

    def _margin(self, phase: StickSlipPhase, release: Release, time: float, y: tuple[Array, Array]) -> float:
        """By how much what sticks would accelerate if it slipped with friction at rest against it."""
        signs = np.array(release.signs)
        freed = self.stick_slip.equations(phase.sides, release.sticking, phase.positions)
        freed.pieces = phase.equations.pieces
        senses = np.where(signs != 0, signs, phase.state.senses).astype(float)
        dynamics = freed.contact_dynamics(self.functions, time, *y, senses, signs != 0)
        solution = solve_all(dynamics.system)
        if not solution.solution_count:
            return -phase.least
        values = freed.contact_values(self.functions, time, *y)
        pushed = dynamics.accelerations + dynamics.changes @ solution.y
        second = (values.slopes @ pushed + values.bends) / self.units
        return float((signs * second)[signs != 0].min()) - phase.least
