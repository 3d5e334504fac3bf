"""One position solved: assembled, checked, with its velocities and accelerations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.equations.acceptance import InputSamples
from planar.equations.coordinates import frames_from_coordinates
from planar.equations.functions import MAX_CACHED_STRUCTURES, equation_functions
from planar.equations.symbolic_equations import slice_length
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome, TrackingEnd
from planar.foundation.lazy_module import LazyModule
from planar.model.mechanism import Drive, Input, Mechanism, replace_inputs, with_unit_rate
from planar.results.motion import State
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.assembly.nearest_assembly import (
    Assembly,
    AssemblySearchFailure,
    find_nearest_assembly,
    sketch_remarks,
)
from planar.solving.checks import MIN_REGULARITY, null_space, stack_motion
from planar.solving.continuation.fast_path import (
    MIN_FAST_REGULARITY,
    BranchRates,
    FastPosition,
    InputRates,
    StraightPathCache,
    fast_position,
)
from planar.solving.newton import CLOSED_TOLERANCE
from planar.solving.prepared_mechanism import PreparedMechanism, lazy_frames

if TYPE_CHECKING:
    from planar.solving import full_constraints, sample_rates
    from planar.solving.assembly import least_misfit
    from planar.solving.continuation.solution_curve import CurvePoint
    from planar.solving.diagnosis import refusals
else:  # few positions need them
    least_misfit = LazyModule("planar.solving.assembly.least_misfit")
    full_constraints = LazyModule("planar.solving.full_constraints")
    refusals = LazyModule("planar.solving.diagnosis.refusals")
    sample_rates = LazyModule("planar.solving.sample_rates")


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
    start, z, remarks = known.solver, known.assembly.z, known.remarks
    if not drives:
        try:
            return start.state(z, remarks)
        except NoAnswer as problem:
            raise known.structure_refusal(problem) or problem from None
    moved = replace_inputs(mechanism, tuple(drives))
    fast = known.nearby_positions.position_at(moved)
    if fast is not None:
        return start.fast_state(fast, remarks, moved)
    target = start.with_inputs_of(moved)
    sure = known.nearby_positions.unknowns_at(target.inputs.u.tolist()) if target.unit == start.unit else None
    if sure is not None:
        return target.state(sure, remarks)
    from planar.solving.continuation.path import follow_straight  # most paths are surely regular

    # in lengths of the start's size: without a link's length a farther input makes the size greater
    u = target.inputs.u * (target.input_scale / start.input_scale)
    z, passed, nearby = follow_straight(start, z, start.inputs.u, u)
    if passed or nearby:
        from planar.solving.continuation.events import change_point_remarks

        remarks = (*remarks, *change_point_remarks(start, passed, nearby))
    unknown_scale = (start.scale / target.scale)[list(start.equations.unknowns)]
    return target.state(z * unknown_scale, remarks)


def rest_position(mechanism: Mechanism, drives: Sequence[Drive] = ()) -> State:
    """The position that `solve` finds, all rates zero, as dead points and change points allow; its mobility is that of
    this position.

    Raises NoAnswer where the mechanism cannot be assembled, or inputs leave it free or cannot be moved there.
    """
    known = solved_mechanism(mechanism)
    solver, z, remarks = known.solver, known.assembly.z, known.remarks
    if drives:
        from planar.solving.continuation.path import follow_to

        target = solver.with_inputs_of(replace_inputs(mechanism, tuple(drives)))
        z = follow_to(target, z, solver.inputs.u, target.inputs.u)
        solver = target
    u, p = solver.inputs.u, solver.inputs.p
    residual, pair = solver.worst_residual(z)
    if residual > solver.tolerance:
        raise refusals.not_closed(solver, pair, residual)
    w = solver.functions.coordinates(z, u, p)
    solver.refuse_open_contact(stack_motion([w[None], *[0.0 * w[None]] * 2], [u[None], *[0.0 * u[None]] * 2]))
    # what is held to second order only is no freedom: the pairs' own Jacobian does not see it, the deflated one does
    if solver.is_deflated or solver.equations.open_rows:
        jacobian = np.asarray(solver.functions.residuals_and_jacobian(z, u, p)[1])
    else:
        jacobian = full_constraints.FullConstraints(solver).jacobian(w)
    mobility = null_space(jacobian).shape[1] if w.size else 0
    if np.any(solver.block_regularity(z) < MIN_REGULARITY):
        note = "the inputs are on a dead point or a change point, where places are exact to the root of rounding only"
        remarks = (*remarks, note)
    frames, own = frames_from_coordinates((w * solver.scale).tolist(), solver.column, solver.shapes, solver.pairs)
    return State(solver.mechanism, mobility, residual, remarks, frames, own, solver.shapes)


class PositionSolver(PreparedMechanism):
    """Solves positions of one mechanism.

    What is needed only where the acceptance test does not settle a position (the reasons of refusals, singular
    positions, rates and their accuracy) is imported there: it is slow to load beside what most positions take.
    """

    def find_assembly(self) -> Assembly:
        """The assembly nearest to the sketch. Raises NoAnswer."""
        assembly = self.nearest()
        if isinstance(assembly, AssemblySearchFailure):
            raise self.unassembled(assembly)
        return assembly

    def nearest(self) -> Assembly | AssemblySearchFailure:
        """The assembly nearest to the sketch, or where it fails; of pairs that may stay open that of least misfit.

        Raises NoAnswer where the inputs leave links free, or no misfit is within that of the file.
        """
        if any(stage.is_free for stage in self.equations.blocks):
            raise refusals.free_links(self)
        if not self.equations.open_rows:
            return find_nearest_assembly(BlockAssemblies(self), self._is_regular)
        exact = PositionSolver(replace(self.mechanism, closes_within=None))
        assembly = least_misfit.find_least_misfit(self, exact, exact._is_regular)
        if isinstance(assembly, AssemblySearchFailure):
            raise exact.unassembled(assembly)
        least_misfit.refuse_misfit(self, assembly.z, self.inputs.u)
        return assembly

    def remarks(self, assembly: Assembly) -> tuple[str, ...]:
        """The remarks of the mechanism, and those on an assembly."""
        return (*self.mechanism.remarks, *sketch_remarks(self, assembly))

    def is_surely_regular(self, z: Array) -> bool:
        """Whether every block is surely determined at an assembly."""
        if self.acceptance is None:
            return bool(self.block_regularity(z).min(initial=1.0) >= MIN_FAST_REGULARITY)
        rest = np.zeros_like(self.inputs.u)
        result = self.acceptance.position(z, InputSamples(self.inputs.u, rest, rest), self.acceptance_scales)[1]
        return result.regularity >= MIN_FAST_REGULARITY

    def _is_regular(self, z: Array) -> bool:
        """Whether every block of an assembly is determined there."""
        return self.is_surely_regular(z) or bool(np.all(self.block_regularity(z) >= MIN_REGULARITY))

    def regularized(self, z: Array) -> tuple[PositionSolver, Array] | None:
        """A solver, and the unknowns, for constraints that are singular at z and all along the motion from there; None
        where they are not, or something is free."""
        if self.is_deflated:
            return None
        weak = self.block_regularity(z) < MIN_REGULARITY
        if not weak.any():
            return None
        from planar.solving.deflation import deflate  # few mechanisms are of this kind

        deflated = deflate(self, [stage for stage in self.equations.blocks if weak[stage.block_index]], z)
        return deflated and (self.with_functions(deflated[0]), deflated[1])

    def unassembled(self, failure: AssemblySearchFailure) -> NoAnswer:
        """Why it cannot be assembled, and what would mend that, which takes about as long to find as an assembly."""
        block_regularity = self.block_regularity(failure.z)
        for stage in self.equations.blocks[: failure.stage.block_index]:
            # a block that could stand anywhere was put somewhere, and what comes after it need not fit there
            is_weak = block_regularity[stage.block_index] < MIN_REGULARITY
            if is_weak and full_constraints.is_always_singular(self, stage, failure.z):
                return refusals.always_free(self, stage.links)
        if slice_length(failure.stage.rows) > slice_length(failure.stage.unknowns):
            # held more than once: by inputs that are more than the pairs leave free, or, where these leave nothing free
            # by count, by dimensions that have to agree
            bare = equation_functions(replace(self.mechanism, inputs=())).equations
            if 0 < bare.z.numel() - bare.F.numel() < len(self.mechanism.inputs):
                return refusals.too_many_inputs(self)
        return refusals.not_assembled(self, failure)

    def state(self, z: Array, remarks: tuple[str, ...] = ()) -> State:
        """The state at given unknowns, once they and their rates have passed the residual check. Raises NoAnswer."""
        fast = fast_position(self, z)
        state = self._examined_state(z, remarks) if fast is None else self.fast_state(fast, remarks, self.mechanism)
        self.refuse_outside_stops(z)
        return state

    def is_inside_stops(self, z: Array) -> bool:
        """Whether no pair is beyond its stop."""
        return self._stop_refusal(z) is None

    def refuse_outside_stops(self, z: Array) -> None:
        """Raise NoAnswer where a pair is beyond its stop."""
        refusal = self._stop_refusal(z)
        if refusal is not None:
            raise refusal

    def _stop_refusal(self, z: Array) -> NoAnswer | None:
        if self.stops is None:
            return None
        return self.stops.refusal_outside(self.stop_positions(z, self.inputs.u), self.describe_position())

    def _examined_state(self, z: Array, remarks: tuple[str, ...]) -> State:
        """The state by the general checks, which say why where there is none."""
        residual, pair = self.worst_residual(z)
        if residual > self.tolerance:
            # what all but closes may not close since it is singular
            refuse = refusals.judge_velocity(self, z)[1] if residual <= CLOSED_TOLERANCE else None
            raise refusals.not_closed(self, pair, residual) if refuse is None else refuse()
        if self.equations.open_rows:
            least_misfit.refuse_misfit(self, z, self.inputs.u)
        mobility = self.inputs.u.size
        if not (self.functions.is_square and self._is_regular(z)):
            mobility, refuse = refusals.judge_velocity(self, z)
            regular = None if refuse is None else self.regularized(z)
            if regular is not None:
                return regular[0].state(regular[1], remarks)
            if refuse is not None:
                state = self._singular_state(z, remarks) if mobility == self.inputs.u.size + 1 else None
                if state is None:
                    raise refuse()
                return state
        coordinate_rates, doubt = self._sample_rates(z, {})
        if doubt is not None and doubt.is_too_inexact[0]:
            raise doubt.refusal(self, 0, self.describe_position())
        if doubt is not None:
            remarks += doubt.remarks(lambda _: "")
        return self._checked_state([rates[0] for rates in coordinate_rates], mobility, residual, remarks)

    def _sample_rates(
        self, z: Array, branch_rates: Mapping[int, BranchRates]
    ) -> tuple[list[Array], sample_rates.AccuracyDoubts | None]:
        """The rates at one sample."""
        u, u1, u2 = (rates[None] for rates in self.inputs[:3])
        inputs = InputRates(u, u1, u2, 0.0 * u)
        return sample_rates.sample_rates(self, z[None], inputs, branch_rates, False)

    def fast_state(self, position: FastPosition, remarks: tuple[str, ...], mechanism: Mechanism) -> State:
        """The state of a position that is surely sound, of a mechanism that may have other inputs."""
        frames, own = lazy_frames(self, position.coordinate_rates)
        return State(mechanism, len(self.inputs.u), position.residual, remarks, frames, own, self.shapes)

    def end_refusal(self, u: Array, point: CurvePoint, ending: TrackingEnd) -> NoAnswer:
        """What to say of a motion that ends at inputs u, and went as far as a point."""
        if ending is TrackingEnd.STOP and self.stops is not None:
            met = self.stops.describe_met(self.stop_positions(point.y[:-1], u))
            return refusals.motion_stopped(self, met, self.describe_inputs(u))
        return refusals.motion_ended(self, [point.tangent[:-1]], self.describe_inputs(u), ending)

    def _singular_state(self, z: Array, remarks: tuple[str, ...]) -> State | None:
        """The state where one more than the inputs could move to first order, if only one motion goes on."""
        from planar.solving.continuation.bifurcation import singular_rates  # few positions are of this kind

        s, position_and_rates = self.inputs, singular_rates(self, z)
        if position_and_rates is None or (residual := self.max_residual(position_and_rates[0], s.u)) > self.tolerance:
            return None
        y, y1, y2 = (np.concatenate(parts) for parts in zip(position_and_rates, s[:3], strict=True))
        note = "to first order there is one more motion here; the rates are those of the only one that goes on"
        motion = self.functions.kinematics(y, y1, y2, s.p)
        return self._checked_state([motion.w, motion.w1, motion.w2], s.u.size, residual, (*remarks, note))

    def state_on_branch(self, z: Array, local: BranchRates) -> State:
        """The state on a change point or beside it, with the rates of the branch that was followed there.

        Raises NoAnswer where the inputs do not run in the direction in which it was followed.
        """
        residual = self.max_residual(z, self.inputs.u)
        rates = [part[0] for part in self._sample_rates(z, {0: local})[0]]
        if residual > self.tolerance or not np.isfinite(rates[1]).all():
            return self.state(z)  # says why not
        return self._checked_state(rates, self.inputs.u.size, residual, ())

    def state_with_rates(self, state: State) -> State:
        """The state in the same position as another's, with this mechanism's own rates."""
        w = self.coordinates(state.frames, state.own)
        return self.state(w[list(self.equations.unknowns)], state.remarks)

    def refuse_open_contact(self, motion: Array) -> None:
        """Raise NoAnswer where a contact is open that guides should keep closed; `motion` as of `stack_motion`."""
        contact = self.structure.residual_check.find_open_contact(motion, self.inputs.p)
        if contact is not None:
            pair, gap = contact
            raise refusals.open_contact(self, pair, gap * self.unit)

    def _checked_state(
        self, coordinate_rates: Sequence[Array], mobility: int, residual: float, remarks: tuple[str, ...]
    ) -> State:
        motion = stack_motion([w[None] for w in coordinate_rates], [u[None] for u in self.inputs[:3]])
        gaps = self.structure.residual_check.rate_residuals(motion, self.inputs.p)
        for ((gap,), pair), what in zip(gaps, ("velocities", "accelerations"), strict=True):
            if gap > 1e3 * self.tolerance:
                if self.inputs.u.size > mobility:
                    raise refusals.disagreeing_inputs(self, mobility, what)
                raise refusals.broken_rates(self, what, pair, float(gap))
        self.refuse_open_contact(motion)
        return State(self.mechanism, mobility, residual, remarks, *lazy_frames(self, coordinate_rates), self.shapes)


class SolvedMechanism:
    """What is kept of a mechanism from one solution to the next."""

    def __init__(self, mechanism: Mechanism):
        self.plain_solver = PositionSolver(mechanism)
        "by the constraints of the pairs alone"
        self._refusals_at_rest: dict[str | None, NoAnswer | None] = {}
        "of a mechanism without rates: why the input at a pair cannot run"
        self.range_ends: dict[Any, Any] = {}
        "the ends of the ranges of its inputs"

    @cached_property
    def solver(self) -> PositionSolver:
        """What solves its positions: where it can be assembled, regular all along the motion if that can be."""
        return self._start[0]

    @property
    def assembly(self) -> Assembly:
        """The assembly nearest to the sketch. Raises NoAnswer."""
        assembly = self._start[1]
        if isinstance(assembly, Assembly):
            self.solver.refuse_outside_stops(assembly.z)
            return assembly
        raise self._refusal.with_traceback(None)

    @cached_property
    def _refusal(self) -> NoAnswer:
        """Why there is no assembly: looked for only where somebody asks."""
        failure = self._start[1]
        if isinstance(failure, NoAnswer):
            return failure
        return self.plain_solver.unassembled(failure)  # type: ignore[arg-type]  # an assembly is not refused

    @cached_property
    def nearest(self) -> Assembly | AssemblySearchFailure | NoAnswer:
        """The assembly nearest to the sketch by the constraints of the pairs alone, or why there is none."""
        try:
            return self.plain_solver.nearest()
        except NoAnswer as problem:
            return problem

    @cached_property
    def _start(self) -> tuple[PositionSolver, Assembly | AssemblySearchFailure | NoAnswer]:
        solver, assembly = self.plain_solver, self.nearest
        if not isinstance(assembly, Assembly):
            return solver, assembly
        regular = None if solver.is_surely_regular(assembly.z) else solver.regularized(assembly.z)
        if regular is not None:
            solver, assembly = regular[0], assembly._replace(z=regular[1])
        assembly.z.flags.writeable = False
        if solver.stops is not None:
            solver.stops.initial_turns = solver.stops.turns(solver.stop_positions(assembly.z, solver.inputs.u))
        return solver, assembly

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """The remarks of the mechanism, and those on its assembly."""
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
        return full_constraints.is_rigid(solver, solver.functions.coordinates(z, solver.inputs.u, solver.inputs.p))

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
        at_rest = replace(mechanism, inputs=inputs, remarks=(), loads=())
        refusals_at_rest = solved_mechanism(at_rest)._refusals_at_rest
        if pair not in refusals_at_rest:
            refusals_at_rest[pair] = refusals.judge_motion(self.solver.with_inputs_of(at_rest), z, pair)
        return refusals_at_rest[pair]

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
    """Why a run did not leave its first position: if that is a change point, which branches lead on."""
    if problem.outcome is Outcome.BRANCH_LOST:
        try:
            solver.state(z)
        except NoAnswer as singular:
            return singular
    return problem
