"""One position: assembled, gated, and with its velocities and accelerations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.equations.functions import CACHED, Rates, length, placed, program
from planar.foundation.errors import Ending, NoAnswer, Outcome
from planar.foundation.geometry import Frame
from planar.foundation.jets import Jet
from planar.model.mechanism import Drive, Mechanism, with_inputs
from planar.results.motion import State
from planar.solving.assembly.block_assemblies import Candidates
from planar.solving.assembly.nearest_assembly import Assembly, Failure, search
from planar.solving.continuation.fast_path import Ways, sound, surely_determined
from planar.solving.continuation.path import Local, followed
from planar.solving.diagnosis import refusals
from planar.solving.lazy_frames import laid
from planar.solving.prepared_mechanism import Setup
from planar.solving.rates.accuracy import doubts
from planar.solving.rates.regularity import (
    SINGULAR,
    Crossing,
    always_weak,
    cancelled,
    mobility,
    moved_by,
    slope_at,
    strengths,
)

if TYPE_CHECKING:
    from planar.solving.continuation.singular_rates import Passing

Array = np.ndarray


def solve(mechanism: Mechanism, drives: Mapping[str, float] | Sequence[Drive] = ()) -> State:
    """The position at the mechanism's inputs, of the assembly nearest to its sketch, with its rates.

    `drives` change inputs, as {pair: position} (rad or m) or with rates as well: the position then is the one to which
    the assembly of the file's own inputs leads when they are moved there together.

    Raises NoAnswer, whose outcome says whether the mechanism cannot be assembled, stands on a dead point or a change
    point, or has too few or too many inputs; its text names links, pairs, position and remedy.
    """
    if isinstance(drives, Mapping):
        drives = [Drive(pair, position) for pair, position in drives.items()]
    known = known_of(mechanism)
    here, found = known.solver, known.assembly
    if not drives:
        return here.state(found.z, known.remarks)
    there = here.moved(with_inputs(mechanism, tuple(drives)))
    z = known.ways.to(there.station.u) if there.unit == here.unit else None
    if z is not None:
        return there.state(z, known.remarks)
    # in the lengths of the size here: without a link's length a farther input makes the size greater
    scale = np.where(here.outline.slide, there.unit / here.unit, 1.0)
    way = followed(here, here.station.p, found.z, here.station.u, there.station.u * scale)
    told = known.remarks
    if way.met or way.missed:
        from planar.solving.continuation.change_point_remarks import on_the_way

        told = (*told, *on_the_way(here, way.met, way.missed))
    by = (here.scale / there.scale)[list(here.equations.unknowns)]
    return there.state(way.z[-1] * by, told)


class Solver(Setup):
    """Solves positions of one mechanism."""

    def assembly(self) -> Assembly:
        """The assembly nearest to the sketch. Raises NoAnswer."""
        found = self.nearest()
        if isinstance(found, Failure):
            raise self.unassembled(found)
        return found

    def nearest(self) -> Assembly | Failure:
        """The assembly nearest to the sketch, or where it fails. Raises NoAnswer where the inputs leave links free."""
        if any(stage.free for stage in self.equations.stages):
            raise refusals.free(self)
        return search(Candidates(self), self._is_sound)

    def remarks(self, found: Assembly) -> tuple[str, ...]:
        """What there is to say of an assembly."""
        if not (found.ties or found.stopped or self.deflated):
            return self.mechanism.remarks
        from planar.solving.assembly.sketch_remarks import remarks  # only where there is something to say

        return (*self.mechanism.remarks, *remarks(self, Candidates(self), found))

    def _is_sound(self, z: Array) -> bool:
        """Whether every group of an assembly is determined there."""
        if surely_determined(self, z):
            return True
        return bool(np.all(strengths(self, slope_at(self, z, self.station.u)) >= SINGULAR))

    def regular(self, z: Array) -> tuple[Solver, Array] | None:
        """A solver, and the unknowns, for constraints that are singular at z and all along the motion from there; None
        where they are not, or something is free."""
        if self.deflated:
            return None
        weak = strengths(self, slope_at(self, z, self.station.u)) < SINGULAR
        if not weak.any():
            return None
        from planar.solving.deflation import deflated  # few mechanisms are of this kind

        found = deflated(self, [stage for stage in self.equations.stages if weak[stage.level]], z)
        return found and (self.solved_by(found[0]), found[1])

    def unassembled(self, failure: Failure) -> NoAnswer:
        """Why it cannot be assembled, and what would mend that, which takes about as long to find as an assembly."""
        found = strengths(self, slope_at(self, failure.z, self.station.u))
        for stage in self.equations.stages[: failure.stage.level]:
            # a group that could stand anywhere was put somewhere, and what comes after it need not fit there
            if found[stage.level] < SINGULAR and always_weak(self, stage, failure.z):
                return refusals.ever_free(self, stage.links)
        return refusals.too_many(self) if self._contradicted(failure) else refusals.not_assembled(self, failure)

    def _contradicted(self, failure: Failure) -> bool:
        """Whether what does not close is held more than once because the inputs are more than the pairs leave free.

        Where the pairs leave nothing free by count, it is their dimensions that have to agree.
        """
        if length(failure.stage.rows) <= length(failure.stage.unknowns):
            return False
        bare = program(replace(self.mechanism, inputs=())).equations
        return 0 < bare.z.numel() - bare.F.numel() < len(self.mechanism.inputs)

    def state(self, z: Array, remarks: tuple[str, ...] = ()) -> State:
        """The state at given unknowns, once they and their rates have passed the gate. Raises NoAnswer."""
        state = self._surely(z, remarks)
        if state is not None:
            return state
        gaps = self.gaps(z[None], self.station.u[None])[:, 0]
        residual = float(gaps.max(initial=0.0))
        if residual > self.tolerance:
            raise refusals.not_closed(self, self.gate.names[int(np.argmax(gaps))], residual)
        s, rest = self.station, np.zeros_like(z)
        y, given = np.concatenate([z, s.u]), np.concatenate([rest, s.u2])
        still = self.program.kinematics(y, np.concatenate([rest, s.u1]), given, s.p)
        try:
            found = mobility(self, z, still)
        except (Crossing, NoAnswer) as problem:
            regular = self.regular(z)
            if regular is not None:
                return regular[0].state(regular[1], remarks)
            if not isinstance(problem, Crossing):
                raise
            from planar.solving.continuation.singular_rates import passing  # few positions are of this kind

            through = passing(self, z)
            state = through and self._passed(through, remarks)
            if state is None:
                raise problem.refused() from None
            return state
        y1 = np.concatenate([cancelled(still.slope, still.F1), s.u1])
        moving = self.program.kinematics(y, y1, given, s.p)
        y2 = np.concatenate([cancelled(moving.slope, moving.F2), s.u2])
        motion = self.program.kinematics(y, y1, y2, s.p)
        doubt = doubts(self, motion.slope[None], motion.w[None], y[None], y1[None], y2[None])
        if doubt is not None and doubt.errors.lost[0]:
            raise doubt.refused(self, 0, self.at())
        return self._stated(motion, found, residual, (*remarks, doubt.remark()) if doubt else remarks)

    def _surely(self, z: Array, remarks: tuple[str, ...]) -> State | None:
        """The state by compiled functions alone, where they find nothing to look at."""
        found = sound(self, z)
        if found is None:
            return None
        frames, own = laid(self, found.parts)
        mobility = len(self.station.u)
        return State(self.mechanism, mobility, found.residual, remarks, frames, own, self.shapes)

    def ends(self, u: Array, tangent: Array, ending: Ending) -> NoAnswer:
        """What to say of a motion that ends at inputs u, towards which it went along a tangent."""
        return refusals.ended(self, moved_by(self, tangent[:-1]), self.where(u), ending)

    def _passed(self, through: Passing, remarks: tuple[str, ...]) -> State | None:
        """The state where more than the inputs could move to first order, but only one motion goes on."""
        s = self.station
        residual = float(self.open_along(through.z[None], s.u[None])[0])
        if residual > self.tolerance:
            return None
        y, y1, y2 = (np.concatenate(both) for both in ((through.z, s.u), (through.z1, s.u1), (through.z2, s.u2)))
        told = "to first order there is one more motion here; the rates are those of the only one that goes on"
        return self._stated(self.program.kinematics(y, y1, y2, s.p), s.u.size, residual, (*remarks, told))

    def on_branch(self, z: Array, local: Local) -> State:
        """The state on a change point or beside it, with the rates of the branch that was followed there.

        Raises NoAnswer where the inputs do not run along the way on which it was followed.
        """
        from planar.solving.rates.sample_rates import Given, rates

        s = self.station
        residual = float(self.open_along(z[None], s.u[None])[0])
        given = Given(s.u[None], s.u1[None], s.u2[None], 0.0 * s.u[None])
        w, w1, w2 = (part[0] for part in rates(self, z[None], given, {0: local}, False).parts)
        if residual > self.tolerance or not np.isfinite(w1).all():
            return self.state(z)  # says why not
        none = np.zeros(0)
        return self._stated(Rates(none, none, none, w, w1, w2, none, none), s.u.size, residual, ())

    def at_rates_of(self, state: State) -> State:
        """The state in the same position as another's, with this mechanism's own rates."""
        w = self.coordinates(state.frames, state.own)
        return self.state(w[list(self.equations.unknowns)], state.remarks)

    def refuse_gap(self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Jet]]) -> None:
        """Raise NoAnswer where a contact is open that guides should keep closed."""
        gap = self.gate.apart(frames, own)
        if gap is not None:
            raise refusals.no_contact(self, *gap)

    def _stated(self, motion: Rates, found: int, residual: float, remarks: tuple[str, ...]) -> State:
        parts = np.stack([motion.w, motion.w1, motion.w2], axis=1) * self.scale[:, None]
        frames, own = placed([Jet(*each) for each in parts.tolist()], self.column, self.shapes, self.pairs)
        gaps = self.gate.rate_gaps(frames, own)
        for (gap, pair), what in zip(gaps, ("velocities", "accelerations"), strict=True):
            if float(np.max(gap)) > 1e3 * self.tolerance:
                if self.station.u.size > found:
                    raise refusals.disagreeing(self, found, what)
                raise refusals.broken_rates(self, what, pair, float(np.max(gap)))
        self.refuse_gap(frames, own)
        return State(self.mechanism, found, residual, remarks, frames, own, self.shapes)


class Known:
    """What is kept of a mechanism from one solution to the next."""

    def __init__(self, mechanism: Mechanism):
        self._bare = Solver(mechanism)
        self.ends: dict[Any, Any] = {}
        "the ends of the ranges of its inputs"

    @cached_property
    def solver(self) -> Solver:
        """What solves its positions: where it can be assembled, regular all along the motion if that can be."""
        return self._start[0]

    @property
    def assembly(self) -> Assembly:
        """The assembly nearest to the sketch. Raises NoAnswer."""
        found = self._start[1]
        if isinstance(found, Assembly):
            return found
        raise self._refusal.with_traceback(None)

    @cached_property
    def _refusal(self) -> NoAnswer:
        """Why there is no assembly: looked for only where somebody asks."""
        found = self._start[1]
        return found if isinstance(found, NoAnswer) else self._bare.unassembled(found)

    @cached_property
    def _start(self) -> tuple[Solver, Assembly | Failure | NoAnswer]:
        solver = self._bare
        try:
            found = solver.nearest()
        except NoAnswer as problem:
            return solver, problem
        if isinstance(found, Failure):
            return solver, found
        regular = None if surely_determined(solver, found.z) else solver.regular(found.z)
        if regular is not None:
            solver, found = regular[0], found._replace(z=regular[1])
        found.z.flags.writeable = False
        return solver, found

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """What there is to say of it."""
        return self.solver.remarks(self.assembly)

    @cached_property
    def ways(self) -> Ways:
        """Positions to which it leads."""
        return Ways(self.solver, self.assembly.z)


@lru_cache(maxsize=CACHED)
def _known(mechanism: Mechanism) -> Known:
    return Known(mechanism)


def known_of(mechanism: Mechanism) -> Known:
    """What is known of a mechanism. Raises BadInput."""
    try:
        hash(mechanism)
    except TypeError:  # made in Python, of lists
        return Known(mechanism)
    return _known(mechanism)


def stopped_at_start(solver: Solver, z: Array, problem: NoAnswer) -> NoAnswer:
    """What to say of a run that did not leave its first position: if that is a change point, which ways lead on."""
    if problem.outcome is Outcome.BRANCH_LOST:
        try:
            solver.state(z)
        except NoAnswer as singular:
            return singular
    return problem
