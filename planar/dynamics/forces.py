"""The forces of a mechanism: what its inputs supply, what its pairs carry, and how well that is proved."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.document.first_argument import takes_result
from planar.dynamics.drives.stop_force import stop_forces
from planar.dynamics.external_actions import (
    ActionVelocities,
    ExternalAction,
    KinematicArrays,
    action_powers,
    action_velocities,
    collect_actions,
)
from planar.dynamics.free_body_check import free_body_imbalance
from planar.dynamics.friction.contact_rows import ContactState
from planar.dynamics.friction.frictional_forces import pair_heat, solve_friction
from planar.dynamics.imbalance import explain_imbalance, imbalance_refusal
from planar.dynamics.load_validation import check_loads
from planar.dynamics.reaction_solver import ForceSolution, fill_balance
from planar.dynamics.reactions import (
    ZERO_COUPLE_TOLERANCE,
    FixedWheel,
    Reaction,
    fixed_wheels,
    input_efforts,
    pair_reaction,
)
from planar.dynamics.sharing.least_work import Wrench, yielding_power
from planar.dynamics.virtual_velocities import has_length_motion, refuse_surplus_inputs, unit_rate_state
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.notebook_display import Displayable
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import stop_if_over, stops_in_time
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion, State


class ForceProof(NamedTuple):
    """How far laws are from being kept, each beside what it balances; None where a law says nothing.

    `power`: what everything supplies together, inertia included, beside the greatest part of it; None where nothing
    that is loaded moves. `routes`: between the efforts and those by virtual power with each input alone at unit rate,
    which takes the velocities of the solved position instead of multipliers; None for a motion, and where no input
    moves anything. `equilibrium`: the worst force or moment that a link is left with as a free body, under all
    that is told to act on it, beside the greatest force.
    """

    power: float | None
    routes: float | None
    equilibrium: float | None


class PairFriction(NamedTuple):
    """How a pair rubs at a position; over a motion each an array or a tuple of its n positions.

    `sense` (1, -1) of the rate of its input position, 0 where it does not rub; `effort` (N, N m) what friction does in
    the positive sense of that position, of teeth with friction the couple between the wheels; `heat` (W) what it takes
    of the power; `side` in words which side of a guide bears, or which wheel drives.
    """

    sense: Array | float
    effort: Array | float
    heat: Array | float
    side: tuple[str, ...] | str

    def __repr__(self) -> str:
        return short_repr(self)


@dataclass(frozen=True, eq=False)
class Forces(Displayable):
    """The forces at a position, or over a motion (then every array has a first axis for its n positions).

    `inputs["O"]` is what that input supplies: a torque (N m) at a pair whose motion is an angle, a force (N) at one
    whose motion is a length, positive in the positive sense of the motion, and `powers["O"]` its power (W).
    `reactions["B"]` see `Reaction`. `acting` are loads, weights, springs, efforts and inertia. `undetermined` names
    what equilibrium does not tell, and why; `bodies` are the links whose balance was proved. `friction["B"]` see
    `PairFriction`, `frictionless` are the same forces without friction, `others` the further
    solutions at a position, `solution_count` how many there are in all (of a motion (n,)), and `remarks` what there is
    to say of friction. `with_inertia` and `with_friction` say what was taken into account.
    """

    moving: State | Motion
    inputs: Mapping[str, Array | float]
    powers: Mapping[str, Array | float]
    reactions: Mapping[str, Reaction]
    acting: tuple[ExternalAction, ...]
    undetermined: Mapping[str, str]
    proof: ForceProof
    bodies: tuple[str, ...]
    friction: Mapping[str, PairFriction] = field(default_factory=dict)
    frictionless: Forces | None = None
    others: tuple[Forces, ...] = ()
    solution_count: IntArray | int = 1
    remarks: tuple[str, ...] = ()
    with_inertia: bool = True
    with_friction: bool = True

    def __repr__(self) -> str:
        return f"<Forces in {self.moving!r}: {len(self.reactions)} pairs, {len(self.acting)} acting>"

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism."""
        return self.moving.mechanism

    @property
    def loads(self) -> tuple[ExternalAction, ...]:
        """What acts on the links, the inputs and the links' inertia apart."""
        return tuple(each for each in self.acting if each.kind not in ("input", "inertia"))

    @property
    def power_in(self) -> Array | float:
        """What the inputs supply, W."""
        return sum(self.powers.values(), 0.0)

    @property
    def power_out(self) -> Array | float:
        """What the mechanism does against its loads, W."""
        return 0.0 - sum((each.power for each in self.loads), 0.0)

    @property
    def solutions(self) -> tuple[Forces, ...]:
        """All that friction leaves possible at a position: first the one that goes over into that without friction."""
        return (self, *self.others)

    @property
    def heat(self) -> Mapping[str, Array | float]:
        """What each pair that rubs turns into heat, W."""
        return {name: each.heat for name, each in self.friction.items()}

    @property
    def heat_flow(self) -> Array | float:
        """What friction in the pairs turns into heat, W."""
        return sum(self.heat.values(), 0.0)

    @property
    def efficiency(self) -> Array | float:
        """The part of the power that goes into the mechanism and comes out again; NaN where none goes in.

        In goes whatever has positive power: inputs, loads, weights, springs and inertia that gives it.
        """
        supplied = sum((np.maximum(each.power, 0.0) for each in self.acting), np.zeros(()))
        with np.errstate(invalid="ignore", divide="ignore"):
            found = np.where(supplied > 0.0, 1.0 - self.heat_flow / supplied, np.nan)
        return found if found.ndim else float(found)

    @cached_property
    def shaking(self) -> tuple[Array, Array | float]:
        """What the links' inertia puts on the frame: a force, N, and a moment about the frame's origin, N m."""
        of = [each for each in self.acting if each.kind == "inertia"]
        at = [each.at[..., 0] * each.force[..., 1] - each.at[..., 1] * each.force[..., 0] + each.couple for each in of]
        none = np.zeros(np.shape(next(iter(self.inputs.values()), 0.0)))
        return sum((each.force for each in of), np.stack([none, none], axis=-1)), sum(at, none)

    @cached_property
    def fixed_wheels(self) -> Mapping[str, FixedWheel]:
        """The torques that hold the wheels of the frame, as the annulus of an epicyclic train; see `FixedWheel`."""
        return fixed_wheels(self.mechanism, self.moving.shapes, self.reactions)

    @cached_property
    def stop_loads(self) -> Mapping[str, Mapping[str, float]]:
        """By the pair at its stop and the input that is released: what the stop then carries (N, N m); see
        `drives.stop_force`. Only at a position."""
        if not isinstance(self.moving, State):
            return {}
        return stop_forces(self.moving, {name: float(effort) for name, effort in self.inputs.items()})

    @property
    def stops(self) -> Mapping[str, float]:
        """`stop_loads` of the stops on which only one input can press."""
        return {name: next(iter(loads.values())) for name, loads in self.stop_loads.items() if len(loads) == 1}

    def is_force_input(self, name: str) -> bool:
        """Whether an input's effort is a force (N), not a torque (N m)."""
        return has_length_motion(self.mechanism, name)


@takes_result("State", "Motion")
@stops_in_time
def forces(
    moving: State | Motion,
    inertia: bool = True,
    friction: bool = True,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Forces:
    """What inputs and pairs must supply against loads, weights, springs, friction and the links' inertia.

    A position has its own rates, and of loads that vary with time those at t = 0. `inertia=False` leaves it out:
    equilibrium at rest, or in slow motion; `friction=False` leaves out that of the pairs. For any number of inputs;
    where the links are held more than once, what rigid bodies do not tell is NaN and named. Raises BadInput where a
    load, spring or mass is none of this mechanism's; NoAnswer where there are more inputs than freedoms, where no
    forces in the pairs balance the links, as at a dead point, and where friction jams it (of a motion such rows are
    NaN); and after `timeout` s, or a Ctrl-C, with the outcome "interrupted".

    >>> import planar
    >>> list(planar.forces(planar.solve(planar.load("four-bar"))).reactions)
    ['A', 'B', 'C', 'D']
    """
    stop_if_over("before any forces were found")
    mechanism = moving.mechanism
    check_loads(mechanism)
    state = moving if isinstance(moving, State) else None
    if state is not None:
        refuse_surplus_inputs(state)
    time = np.zeros(1) if isinstance(moving, State) else moving.time
    if time is None and any(load.varies is not None and load.varies.input is None for load in mechanism.loads):
        raise BadInput("loads", "a load varies with time, which this motion has not; give it a duration")
    balanced = _LinkEquilibrium(moving, time, inertia)
    reactions = balanced.reactions
    solved = reactions.solve()
    if state is not None and not np.isfinite(reactions.balance.loads).all():
        raise NoAnswer(
            Outcome.DEAD_POINT,
            "two points between which a spring, a damper or a load acts coincide here, so that its force has no "
            "direction; move the input",
        )
    if not solved.is_balanced.all():
        if state is not None:
            raise imbalance_refusal(reactions)
        solved = solved._replace(imbalance=explain_imbalance(reactions))
    found = balanced.forces(solved)
    if friction and any(pair.has_friction for pair in mechanism.pairs):
        found = _with_friction(balanced, solved, found)
    found = replace(found, with_inertia=inertia, with_friction=friction)
    return found if state is None else _single_position(found)


def greatest_moment_and_force(forces: Forces) -> tuple[float, float]:
    """The greatest moment (N m) and force (N) of all that acts and all pairs; smaller values are judged beside them."""
    reactions = forces.reactions.values()
    exerted = [(action.force, action.couple) for action in forces.acting]
    exerted += [(reaction.force, reaction.couple) for reaction in reactions]
    couples = [couple for _, couple in exerted]
    couples += [couple for reaction in reactions for couple in reaction.couples.values()]
    force = _greatest_size(force for force, _ in exerted)
    couple = _greatest_size(couples)
    return max(couple, force * mechanism_size(forces.mechanism, forces.moving.shapes)), force


class _LinkEquilibrium:
    """What stands fast before the forces in pairs are known: the balance, and the way from its solution to a result."""

    def __init__(self, moving: State | Motion, time: Array | None, inertia: bool):
        self.moving, self.time, self.inertia = moving, time, inertia
        self.field = KinematicArrays(moving)
        self.reactions = fill_balance(self.field, time, inertia)

    def forces(self, solved: ForceSolution, contacts: Mapping[str, ContactState] | None = None) -> Forces:
        """The result, with an axis for its positions, and how pairs rub."""
        mechanism, field = self.moving.mechanism, self.field
        supplied, whys = input_efforts(solved)
        all_of = collect_actions(field, self.time, supplied, self.inertia)
        moved = action_velocities(field, all_of)
        powers = action_powers(field, all_of, moved)
        all_of = [each._replace(power=row) for each, row in zip(all_of, powers, strict=True)]
        by_pair = {pair.name: pair_reaction(pair, field, self.reactions, solved) for pair in mechanism.pairs}
        rubbing = {
            name: PairFriction(*each._replace(heat=_first_finite(pair_heat(field, by_pair[name]), each.heat)))
            for name, each in (contacts or {}).items()
        }
        equilibrium, bodies = free_body_imbalance(field, all_of, by_pair, self.reactions.arm)
        names = [given.pair for given in mechanism.inputs]
        undetermined = {name: why for name, why in zip(names, whys, strict=True) if why}
        undetermined |= {name: each.why for name, each in by_pair.items() if each.why}
        routes = None
        if isinstance(self.moving, State):
            rubs = [by_pair[name] for name in rubbing]
            routes = _second_route_error(self.moving, all_of, supplied[0], rubs, solved.wrenches)
        yielded = yielding_power(solved.wrenches, self.moving.frames) if mechanism.closes_within else None
        lost = np.array([*powers, *(-each.heat for each in rubbing.values())]).reshape(-1, field.position_count)
        return Forces(
            self.moving,
            dict(zip(names, supplied.T, strict=True)),
            {name: sum(each.power for each in all_of if each[:2] == ("input", name)) for name in names},
            by_pair,
            tuple(all_of),
            undetermined,
            ForceProof(_power_imbalance(lost, all_of, moved, yielded), routes, equilibrium),
            bodies,
            rubbing,
        )


def _with_friction(balanced: _LinkEquilibrium, solved: ForceSolution, without: Forces) -> Forces:
    """The forces with friction, beside those without."""
    result = solve_friction(balanced.reactions, balanced.field, solved)
    if result.solution is None:
        return replace(without, remarks=result.remarks)
    first, *others = (
        replace(balanced.forces(*each), frictionless=without, remarks=result.remarks)
        for each in (result.solution, *result.others)
    )
    return replace(first, others=tuple(others), solution_count=result.solution_count)


def _first_finite(values: Array, others: Array) -> Array:
    return np.where(np.isfinite(values), values, others)


def _power_imbalance(
    powers: Array, all_of: Sequence[ExternalAction], moved: ActionVelocities, yielded: Array | None
) -> float | None:
    """What all powers (acting, n) add up to, beside the greatest of them; None where that is rounding alone.

    `yielded` (n,) is what pairs that stay open by a misfit put into the links as that changes.
    """
    if yielded is not None:
        powers = np.vstack([powers, np.broadcast_to(yielded, powers.shape[1:])])
    told = np.isfinite(powers).all(axis=0)
    greatest = float(np.abs(powers[:, told]).max(initial=0.0))
    if greatest <= ZERO_COUPLE_TOLERANCE * _power_scale(all_of, moved):
        return None
    return float(np.abs(powers[:, told].sum(axis=0)).max(initial=0.0)) / greatest


def _power_scale(all_of: Sequence[ExternalAction], moved: ActionVelocities) -> float:
    """The power that the greatest force would have at the greatest speed: powers are rounding beside it."""
    pushed, turned = _greatest_size(each.force for each in all_of), _greatest_size(each.couple for each in all_of)
    return pushed * _greatest_size(moved.velocity) + turned * _greatest_size(moved.angular_velocity)


def _greatest_size(values: Iterable[Array | float]) -> float:
    flat = [np.ravel(each) for each in values]
    return float(np.abs(np.nan_to_num(np.concatenate(flat))).max(initial=0.0)) if flat else 0.0


def _second_route_error(
    state: State,
    all_of: Sequence[ExternalAction],
    supplied: Array,
    rubbing: Sequence[Reaction],
    wrenches: Mapping[str, Mapping[str, Wrench]],
) -> float | None:
    """How far the efforts are from those by virtual power, beside what each input would supply against every part.

    Pairs that rub have a part of it, by their reactions.
    """
    worst, others = None, [each for each in all_of if each.kind != "input"]
    for given, effort in zip(state.mechanism.inputs, supplied, strict=True):
        unit = KinematicArrays(unit_rate_state(state, given.pair))
        moved = action_velocities(unit, others)
        lost = [-pair_heat(unit, each) for each in rubbing]
        parts = np.concatenate([action_powers(unit, others, moved), np.array(lost).reshape(-1, 1)])
        if state.mechanism.closes_within:
            parts = np.vstack([parts, np.broadcast_to(yielding_power(wrenches, unit.moving.frames), parts.shape[1:])])
        whole = float(np.abs(parts).sum())
        could = _power_scale(others, moved)
        beside = whole if whole > ZERO_COUPLE_TOLERANCE * could else could
        if beside and np.isfinite(effort):
            worst = max(worst or 0.0, abs(float(parts.sum() + effort)) / beside)
    return worst


def _single_position(found: Forces) -> Forces:
    """The same for the one position that there is, without an axis for it."""

    def only(values: Array | float) -> float:
        return float(np.ravel(values)[0])

    def one(each: Reaction) -> Reaction:
        at = None if each.at is None else each.at[0]
        couples = {link: only(couple) for link, couple in each.couples.items()}
        return each._replace(at=at, force=each.force[0], couple=only(each.couple), couples=couples)

    def rub(each: PairFriction) -> PairFriction:
        return PairFriction(only(each.sense), only(each.effort), only(each.heat), each.side[0])

    def act(each: ExternalAction) -> ExternalAction:
        return each._replace(at=each.at[0], force=each.force[0], couple=only(each.couple), power=only(each.power))

    return Forces(
        found.moving,
        {name: only(each) for name, each in found.inputs.items()},
        {name: only(each) for name, each in found.powers.items()},
        {name: one(each) for name, each in found.reactions.items()},
        tuple(act(each) for each in found.acting),
        found.undetermined,
        found.proof,
        found.bodies,
        {name: rub(each) for name, each in found.friction.items()},
        None if found.frictionless is None else _single_position(found.frictionless),
        tuple(map(_single_position, found.others)),
        int(np.ravel(found.solution_count)[0]),
        found.remarks,
        found.with_inertia,
        found.with_friction,
    )
