"""One position solved: assembled, checked, with its velocities and accelerations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.equations.coordinates import frames_from_coordinates
from planar.equations.functions import MAX_CACHED_STRUCTURES, EquationRates, equation_functions
from planar.equations.symbolic_equations import slice_length
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome, TrackingEnd
from planar.foundation.geometry import Frame
from planar.foundation.jets import Jet
from planar.model.mechanism import Drive, Input, Mechanism, replace_inputs, with_unit_rate
from planar.results.motion import State
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.assembly.nearest_assembly import (
    Assembly,
    AssemblySearchFailure,
    find_nearest_assembly,
    sketch_distance_remarks,
)
from planar.solving.checks.singular_values import MIN_REGULARITY
from planar.solving.continuation.fast_path import (
    MIN_FAST_REGULARITY,
    FastPosition,
    StraightPathCache,
    fast_position,
    is_surely_regular,
)
from planar.solving.lazy_frames import lazy_frames
from planar.solving.newton import CLOSED_TOLERANCE
from planar.solving.prepared_mechanism import PreparedMechanism

if TYPE_CHECKING:
    from planar.solving.continuation.bifurcation import SingularRates
    from planar.solving.continuation.run_samples import BranchRates, InputRates
    from planar.solving.continuation.solution_curve import CurvePoint


@takes_mechanism
def solve(mechanism: Mechanism, drives: Mapping[str, float] | Sequence[Drive] = ()) -> State:
    """The position at the mechanism's inputs, of the assembly nearest to its sketch, with its rates.

    `drives` change inputs, as {pair: position} (rad or m) or with rates as well: the position then is the one to which
    the assembly of the file's own inputs leads when they are moved there together.

    A mechanism without inputs that can move is solved as it is drawn, at rest; its state has inputs that hold it there,
    and a remark says so.

    Raises NoAnswer, whose outcome says whether the mechanism cannot be assembled, stands on a dead point or a change
    point, is a structure that an input cannot move, or has too few or too many inputs; its text names links, pairs,
    position and remedy.

    >>> import planar
    >>> planar.solve(planar.load("four-bar"))
    <State of 'Four-bar chain' at A = 60 deg>
    """
    if isinstance(drives, Mapping):
        drives = [Drive._make((pair, position, None, None)) for pair, position in drives.items()]
    known = solved_mechanism(mechanism)
    if not mechanism.inputs:
        known = solved_mechanism(known.completed_mechanism)
    here, found = known.solver, known.assembly
    if not drives:
        try:
            return here.state(found.z, known.remarks)
        except NoAnswer as problem:
            raise known.structure_refusal(problem) or problem from None
    moved = replace_inputs(mechanism, tuple(drives))
    quick = known.nearby_positions.position_at(moved)
    if quick is not None:
        return here.state_of(quick, known.remarks, moved)
    there = here.with_inputs_of(moved)
    z = known.nearby_positions.unknowns_at(there.inputs.u.tolist()) if there.unit == here.unit else None
    if z is not None:
        return there.state(z, known.remarks)
    from planar.solving.continuation.path import follow_straight  # most ways are surely regular

    # in the lengths of the size here: without a link's length a farther input makes the size greater
    scale = np.where(here.structure.input_slides, there.unit / here.unit, 1.0)
    way = follow_straight(here, found.z, here.inputs.u, there.inputs.u * scale)
    told = known.remarks
    if way.passed or way.nearby:
        from planar.solving.continuation.events import change_point_remarks

        told = (*told, *change_point_remarks(here, way.passed, way.nearby))
    by = (here.scale / there.scale)[list(here.equations.unknowns)]
    return there.state(way.z[-1] * by, told)


class PositionSolver(PreparedMechanism):
    """Solves positions of one mechanism.

    What is needed only where the acceptance test does not settle a position (the reasons of refusals, singular
    positions, rates and their accuracy) is imported there: it is slow to load beside what most positions take.
    """

    def find_assembly(self) -> Assembly:
        """The assembly nearest to the sketch. Raises NoAnswer."""
        found = self.nearest()
        if isinstance(found, AssemblySearchFailure):
            raise self.unassembled(found)
        return found

    def nearest(self) -> Assembly | AssemblySearchFailure:
        """The assembly nearest to the sketch, or where it fails. Raises NoAnswer where the inputs leave links free."""
        if any(stage.is_free for stage in self.equations.blocks):
            from planar.solving.diagnosis import refusals

            raise refusals.free_links(self)
        if self.equations.open_rows:
            return self._nearest_least_misfit()
        return find_nearest_assembly(BlockAssemblies(self), self._is_regular)

    def _nearest_least_misfit(self) -> Assembly:
        """The assembly of least misfit. Raises NoAnswer where there is none within that of the file."""
        from planar.solving.assembly.least_misfit import find_least_misfit, refuse_misfit  # few mechanisms have one

        exact = PositionSolver(replace(self.mechanism, closes_within=None))
        found = find_least_misfit(self, exact, exact._is_regular)
        if isinstance(found, AssemblySearchFailure):
            raise exact.unassembled(found)
        refuse_misfit(self, found.z, self.inputs.u)
        return found

    def remarks(self, found: Assembly) -> tuple[str, ...]:
        """What there is to say of an assembly."""
        remarks = self.mechanism.remarks
        if self.mechanism.sketch:
            remarks += sketch_distance_remarks(self, found.z)
        if not (found.ties or found.is_cut_off or self.is_deflated):
            return remarks
        from planar.solving.assembly.sketch_remarks import sketch_remarks  # only where there is something to say

        return (*remarks, *sketch_remarks(self, BlockAssemblies(self), found))

    def is_surely_regular(self, z: Array) -> bool:
        """Whether every block is surely determined at an assembly."""
        if self.acceptance is not None:
            return is_surely_regular(self, z)
        from planar.solving.rates.regularity import jacobian_at, regularity

        of_blocks = regularity(self, jacobian_at(self, z, self.inputs.u))
        return bool(of_blocks.min(initial=1.0) >= MIN_FAST_REGULARITY)

    def _is_regular(self, z: Array) -> bool:
        """Whether every block of an assembly is determined there."""
        if is_surely_regular(self, z):
            return True
        from planar.solving.rates.regularity import jacobian_at, regularity

        return bool(np.all(regularity(self, jacobian_at(self, z, self.inputs.u)) >= MIN_REGULARITY))

    def regularized(self, z: Array) -> tuple[PositionSolver, Array] | None:
        """A solver, and the unknowns, for constraints that are singular at z and all along the motion from there; None
        where they are not, or something is free."""
        if self.is_deflated:
            return None
        from planar.solving.rates.regularity import jacobian_at, regularity

        weak = regularity(self, jacobian_at(self, z, self.inputs.u)) < MIN_REGULARITY
        if not weak.any():
            return None
        from planar.solving.deflation import deflate  # few mechanisms are of this kind

        found = deflate(self, [stage for stage in self.equations.blocks if weak[stage.block_index]], z)
        return found and (self.with_functions(found[0]), found[1])

    def unassembled(self, failure: AssemblySearchFailure) -> NoAnswer:
        """Why it cannot be assembled, and what would mend that, which takes about as long to find as an assembly."""
        from planar.solving.diagnosis import refusals
        from planar.solving.rates.regularity import is_always_singular, jacobian_at, regularity

        found = regularity(self, jacobian_at(self, failure.z, self.inputs.u))
        for stage in self.equations.blocks[: failure.stage.block_index]:
            # a block that could stand anywhere was put somewhere, and what comes after it need not fit there
            if found[stage.block_index] < MIN_REGULARITY and is_always_singular(self, stage, failure.z):
                return refusals.always_free(self, stage.links)
        return (
            refusals.too_many_inputs(self) if self._is_contradicted(failure) else refusals.not_assembled(self, failure)
        )

    def _is_contradicted(self, failure: AssemblySearchFailure) -> bool:
        """Whether what does not close is held more than once because the inputs are more than the pairs leave free.

        Where the pairs leave nothing free by count, it is their dimensions that have to agree.
        """
        if slice_length(failure.stage.rows) <= slice_length(failure.stage.unknowns):
            return False
        bare = equation_functions(replace(self.mechanism, inputs=())).equations
        return 0 < bare.z.numel() - bare.F.numel() < len(self.mechanism.inputs)

    def state(self, z: Array, remarks: tuple[str, ...] = ()) -> State:
        """The state at given unknowns, once they and their rates have passed the residual check. Raises NoAnswer."""
        found = self._fast_state(z, remarks) or self._examined_state(z, remarks)
        self.refuse_outside_stops(z)
        return found

    def is_inside_stops(self, z: Array) -> bool:
        """Whether no pair is beyond its stop."""
        return self.stops is None or not self.stops.refusal_outside(self.stop_positions(z, self.inputs.u), "")

    def refuse_outside_stops(self, z: Array) -> None:
        """Raise NoAnswer where a pair is beyond its stop."""
        if self.stops is not None:
            wrong = self.stops.refusal_outside(self.stop_positions(z, self.inputs.u), self.describe_position())
            if wrong is not None:
                raise wrong

    def _examined_state(self, z: Array, remarks: tuple[str, ...]) -> State:
        """The state by the general checks, which say why where there is none."""
        from planar.solving.rates.sample_rates import sample_rates

        gaps = self.residuals(z[None], self.inputs.u[None])[:, 0]
        residual = float(gaps.max(initial=0.0))
        if residual > self.tolerance:
            raise self._open_refusal(z, residual, self.row_pairs[int(np.argmax(gaps))])
        if self.equations.open_rows:
            from planar.solving.assembly.least_misfit import refuse_misfit

            refuse_misfit(self, z, self.inputs.u)
        mobility = self.inputs.u.size
        if not (self.functions.is_square and self._is_regular(z)):
            judged = self._judged_mobility(z, remarks)
            if isinstance(judged, State):
                return judged
            mobility = judged
        rates = sample_rates(self, z[None], self._one_sample(), {}, False)
        doubt = rates.doubts
        if doubt is not None and doubt.errors.is_too_inexact[0]:
            raise doubt.refusal(self, 0, self.describe_position())
        remarks = (*remarks, doubt.remark()) if doubt else remarks
        return self._checked_state([part[0] for part in rates.coordinate_rates], mobility, residual, remarks)

    def _judged_mobility(self, z: Array, remarks: tuple[str, ...]) -> int | State:
        """The mobility at a position; where the constraints are singular there the state, if they have rates all the
        same. Raises NoAnswer."""
        from planar.solving.diagnosis.singular_refusals import SingularPosition, determined_mobility

        try:
            return determined_mobility(self, z, self._kinematics_at_rest(z))
        except (SingularPosition, NoAnswer) as problem:
            regular = self.regularized(z)
            if regular is not None:
                return regular[0].state(regular[1], remarks)
            if not isinstance(problem, SingularPosition):
                raise
            from planar.solving.continuation.bifurcation import singular_rates  # few positions are of this kind

            through = singular_rates(self, z)
            state = through and self._singular_state(through, remarks)
            if state is None:
                raise problem.refusal() from None
            return state

    def _open_refusal(self, z: Array, residual: float, pair: str) -> NoAnswer:
        """What to say of a position that does not close: where it all but does, it may be since it is singular."""
        from planar.solving.diagnosis import refusals
        from planar.solving.diagnosis.singular_refusals import SingularPosition, determined_mobility

        try:
            if residual <= CLOSED_TOLERANCE:
                determined_mobility(self, z, self._kinematics_at_rest(z))
        except SingularPosition as singular:
            return singular.refusal()
        except NoAnswer as singular:
            return singular
        return refusals.not_closed(self, pair, residual)

    def _kinematics_at_rest(self, z: Array) -> EquationRates:
        """The rates of the constraints while the unknowns rest and the inputs move."""
        s, rest = self.inputs, np.zeros_like(z)
        y, y1, y2 = (np.concatenate(both) for both in ((z, s.u), (rest, s.u1), (rest, s.u2)))
        return self.functions.kinematics(y, y1, y2, s.p)

    def _one_sample(self) -> InputRates:
        from planar.solving.continuation.run_samples import InputRates

        s = self.inputs
        return InputRates(s.u[None], s.u1[None], s.u2[None], 0.0 * s.u[None])

    def _fast_state(self, z: Array, remarks: tuple[str, ...]) -> State | None:
        """The state by the acceptance test alone, where that finds nothing to look at."""
        found = fast_position(self, z)
        return None if found is None else self.state_of(found, remarks, self.mechanism)

    def state_of(self, found: FastPosition, remarks: tuple[str, ...], mechanism: Mechanism) -> State:
        """The state of a position that is surely sound, of a mechanism that may have other inputs."""
        frames, own = lazy_frames(self, found.coordinate_rates.T)
        return State(mechanism, len(self.inputs.u), found.residual, remarks, frames, own, self.shapes)

    def end_refusal(self, u: Array, point: CurvePoint, ending: TrackingEnd) -> NoAnswer:
        """What to say of a motion that ends at inputs u, and went as far as a point."""
        from planar.solving.diagnosis import refusals
        from planar.solving.rates.regularity import moved_links

        tangent = point.tangent
        if ending is TrackingEnd.STOP and self.stops is not None:
            met = self.stops.describe_met(self.stop_positions(point.y[:-1], u))
            return refusals.motion_stopped(self, met, self.describe_inputs(u))
        return refusals.motion_ended(self, moved_links(self, tangent[:-1]), self.describe_inputs(u), ending)

    def _singular_state(self, rates: SingularRates, remarks: tuple[str, ...]) -> State | None:
        """The state where more than the inputs could move to first order, but only one motion goes on."""
        s = self.inputs
        residual = self.max_residual(rates.z, s.u)
        if residual > self.tolerance:
            return None
        y, y1, y2 = (np.concatenate(both) for both in ((rates.z, s.u), (rates.z1, s.u1), (rates.z2, s.u2)))
        told = "to first order there is one more motion here; the rates are those of the only one that goes on"
        found = self.functions.kinematics(y, y1, y2, s.p)
        return self._checked_state([found.w, found.w1, found.w2], s.u.size, residual, (*remarks, told))

    def state_on_branch(self, z: Array, local: BranchRates) -> State:
        """The state on a change point or beside it, with the rates of the branch that was followed there.

        Raises NoAnswer where the inputs do not run along the way on which it was followed.
        """
        from planar.solving.rates.sample_rates import sample_rates

        residual = self.max_residual(z, self.inputs.u)
        found = sample_rates(self, z[None], self._one_sample(), {0: local}, False)
        rates = [part[0] for part in found.coordinate_rates]
        if residual > self.tolerance or not np.isfinite(rates[1]).all():
            return self.state(z)  # says why not
        return self._checked_state(rates, self.inputs.u.size, residual, ())

    def state_with_rates(self, state: State) -> State:
        """The state in the same position as another's, with this mechanism's own rates."""
        w = self.coordinates(state.frames, state.own)
        return self.state(w[list(self.equations.unknowns)], state.remarks)

    def refuse_open_contact(self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Jet]]) -> None:
        """Raise NoAnswer where a contact is open that guides should keep closed."""
        gap = self.residual_check.find_open_contact(frames, own)
        if gap is not None:
            from planar.solving.diagnosis import refusals

            raise refusals.open_contact(self, *gap)

    def _checked_state(
        self, coordinate_rates: Sequence[Array], mobility: int, residual: float, remarks: tuple[str, ...]
    ) -> State:
        parts = np.stack(coordinate_rates, axis=1) * self.scale[:, None]
        frames, own = frames_from_coordinates(
            [Jet(*each) for each in parts.tolist()], self.column, self.shapes, self.pairs
        )
        gaps = self.residual_check.rate_residuals(frames, own)
        for (gap, pair), what in zip(gaps, ("velocities", "accelerations"), strict=True):
            if float(np.max(gap)) > 1e3 * self.tolerance:
                from planar.solving.diagnosis import refusals

                if self.inputs.u.size > mobility:
                    raise refusals.disagreeing_inputs(self, mobility, what)
                raise refusals.broken_rates(self, what, pair, float(np.max(gap)))
        self.refuse_open_contact(frames, own)
        return State(self.mechanism, mobility, residual, remarks, frames, own, self.shapes)


class SolvedMechanism:
    """What is kept of a mechanism from one solution to the next."""

    def __init__(self, mechanism: Mechanism):
        self.plain_solver = PositionSolver(mechanism)
        "by the constraints of the pairs alone"
        self._judgements: dict[str | None, NoAnswer | None] = {}
        self.range_ends: dict[Any, Any] = {}
        "the ends of the ranges of its inputs"

    @cached_property
    def solver(self) -> PositionSolver:
        """What solves its positions: where it can be assembled, regular all along the motion if that can be."""
        return self._start[0]

    @property
    def assembly(self) -> Assembly:
        """The assembly nearest to the sketch. Raises NoAnswer."""
        found = self._start[1]
        if isinstance(found, Assembly):
            self.solver.refuse_outside_stops(found.z)
            return found
        raise self._refusal.with_traceback(None)

    @cached_property
    def _refusal(self) -> NoAnswer:
        """Why there is no assembly: looked for only where somebody asks."""
        found = self._start[1]
        if isinstance(found, NoAnswer):
            return found
        return self.plain_solver.unassembled(found)  # type: ignore[arg-type]  # an assembly is not refused

    @cached_property
    def nearest(self) -> Assembly | AssemblySearchFailure | NoAnswer:
        """The assembly nearest to the sketch by the constraints of the pairs alone, or why there is none."""
        try:
            return self.plain_solver.nearest()
        except NoAnswer as problem:
            return problem

    @cached_property
    def _start(self) -> tuple[PositionSolver, Assembly | AssemblySearchFailure | NoAnswer]:
        solver, found = self.plain_solver, self.nearest
        if not isinstance(found, Assembly):
            return solver, found
        regular = None if is_surely_regular(solver, found.z) else solver.regularized(found.z)
        if regular is not None:
            solver, found = regular[0], found._replace(z=regular[1])
        found.z.flags.writeable = False
        if solver.stops is not None:
            solver.stops.initial_turns = solver.stops.turns(solver.stop_positions(found.z, solver.inputs.u))
        return solver, found

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """What there is to say of it."""
        return self.solver.remarks(self.assembly)

    @cached_property
    def completed_mechanism(self) -> Mechanism:
        """The mechanism; where its inputs leave links free, with further inputs that hold these as they are drawn."""
        solver = self.plain_solver
        if not any(block.is_free for block in solver.equations.blocks):
            return solver.mechanism
        from planar.solving.drawn_inputs import with_drawn_inputs  # few mechanisms have too few inputs

        return with_drawn_inputs(solver) or solver.mechanism

    @cached_property
    def is_rigid(self) -> bool:
        """Whether the pairs allow no motion from the position even to first order; False where there is no position.

        Equations that are not more than their unknowns are not looked at: one Jacobian is all that this takes.
        """
        solver = self.solver
        if solver.functions.is_square or solver.equations.open_rows:
            return False
        try:
            z = self.assembly.z
        except NoAnswer:
            return False
        from planar.solving.diagnosis.redundancy import is_rigid

        return is_rigid(solver, solver.functions.coordinates(z, solver.inputs.u, solver.inputs.p))

    def motion_refusal(self, pair: str | None = None) -> NoAnswer | None:
        """Why no input can run from the mechanism's position, whatever its range; None where one can.

        Every command asks this for the sentence: there is no position, nothing moves (a structure), there is no input,
        or the other inputs hold the one at `pair` (None: each holds the others).
        """
        try:
            z = self.assembly.z
        except NoAnswer as problem:
            return problem
        mechanism = self.solver.mechanism
        if self.solver.functions.is_square and mechanism.inputs and self.solver.is_surely_regular(z):
            return None  # regular positions need no judgement
        inputs = tuple(Input(given.pair, given.position) for given in mechanism.inputs)
        # rates, loads and remarks make no difference to the judgement, nor to the assembly
        at_rest = solved_mechanism(replace(mechanism, inputs=inputs, remarks=(), loads=()))
        at_rest._share_start(self)
        return at_rest._judgement(pair)

    def _share_start(self, other: SolvedMechanism) -> None:
        """Take the start of the same mechanism with other rates, where this one has none yet."""
        if "_start" not in self.__dict__:
            self.__dict__["_start"] = other.solver.with_inputs_of(self.plain_solver.mechanism), other._start[1]

    def _judgement(self, pair: str | None) -> NoAnswer | None:
        """Why an input of this mechanism at rest cannot run; None where one can."""
        if pair not in self._judgements:
            from planar.solving.diagnosis.judgement import judge_motion  # few mechanisms are judged

            self._judgements[pair] = judge_motion(self.solver, self.assembly.z, pair)
        return self._judgements[pair]

    def structure_refusal(self, problem: NoAnswer) -> NoAnswer | None:
        """What to say where rates are not determined since nothing can move; None where something can."""
        if problem.outcome not in (Outcome.DEAD_POINT, Outcome.CHANGE_POINT, Outcome.TOO_MANY_INPUTS):
            return None
        refusal = self.motion_refusal()
        return refusal if refusal is not None and refusal.outcome is Outcome.STRUCTURE else None

    def check_motion(self, pair: str | None = None) -> None:
        """Raise NoAnswer where no input can run from the mechanism's position; see `motion_refusal`."""
        problem = self.motion_refusal(pair)
        if problem is not None:
            raise problem

    @cached_property
    def nearby_positions(self) -> StraightPathCache:
        """Positions to which it leads."""
        return StraightPathCache(self.solver, self.assembly.z)


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _cached_solved_mechanism(mechanism: Mechanism) -> SolvedMechanism:
    return SolvedMechanism(mechanism)


def solved_mechanism(mechanism: Mechanism) -> SolvedMechanism:
    """What is known of a mechanism. Raises BadInput."""
    try:
        hash(mechanism)
    except TypeError:  # made in Python, of lists
        return SolvedMechanism(mechanism)
    return _cached_solved_mechanism(mechanism)


def state_at_unit_rate(state: State) -> State:
    """The same position at the unit rate of the first input where no input has a rate, else the state itself.

    Raises NoAnswer where nothing can move.
    """
    moving = with_unit_rate(state.mechanism)
    if moving is state.mechanism:
        return state
    try:
        return PositionSolver(moving).state_with_rates(state)
    except NoAnswer as problem:
        raise solved_mechanism(moving).structure_refusal(problem) or problem from None


def rest_remarks(mechanism: Mechanism) -> tuple[str, ...]:
    """What a drawing or a page says of a mechanism that does not run: nothing moves, or no input is given."""
    from planar.solving.drawn_inputs import DRAWN_REMARK

    remarks = [remark for remark in mechanism.remarks if remark.startswith(DRAWN_REMARK)]
    problem = solved_mechanism(mechanism).motion_refusal()
    return (*remarks, problem.reason) if problem is not None else tuple(remarks)


def stopped_at_start(solver: PositionSolver, z: Array, problem: NoAnswer) -> NoAnswer:
    """What to say of a run that did not leave its first position: if that is a change point, which ways lead on."""
    if problem.outcome is Outcome.BRANCH_LOST:
        try:
            solver.state(z)
        except NoAnswer as singular:
            return singular
    return problem
