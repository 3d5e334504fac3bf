"""The forces of a mechanism: what its inputs supply, what its pairs carry, and how well that is proved."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.document.first_argument import takes_result
from planar.dynamics.external_actions import (
    ActionVelocities,
    ExternalAction,
    KinematicArrays,
    action_powers,
    action_velocities,
    collect_actions,
)
from planar.dynamics.free_body_check import free_body_imbalance
from planar.dynamics.imbalance import explain_imbalance, imbalance_refusal
from planar.dynamics.load_validation import check_loads
from planar.dynamics.load_variation import load_factors
from planar.dynamics.reaction_solver import ReactionSolver
from planar.dynamics.reactions import ZERO_COUPLE_TOLERANCE, Reaction, input_efforts, pair_reaction
from planar.dynamics.sharing.least_work import Wrench, yielding_power
from planar.dynamics.virtual_velocities import has_length_motion, refuse_surplus_inputs, unit_rate_state
from planar.dynamics.virtual_work import BalanceFunction, balance_function
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.notebook_display import Displayable
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


@dataclass(frozen=True, eq=False)
class Forces(Displayable):
    """The forces at a position, or over a motion (then every array has a first axis for its n positions).

    `inputs["O"]` is what that input supplies: a torque (N m) at a pair whose motion is an angle, a force (N) at one
    whose motion is a length, positive in the positive sense of the motion, and `powers["O"]` its power (W).
    `reactions["B"]` see `Reaction`. `acting` are loads, weights, springs, efforts and inertia. `undetermined` names
    what equilibrium does not tell, and why; `bodies` are the links whose balance was proved.
    """

    moving: State | Motion
    inputs: Mapping[str, Array | float]
    powers: Mapping[str, Array | float]
    reactions: Mapping[str, Reaction]
    acting: tuple[ExternalAction, ...]
    undetermined: Mapping[str, str]
    proof: ForceProof
    bodies: tuple[str, ...]

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

    @cached_property
    def shaking(self) -> tuple[Array, Array | float]:
        """What the links' inertia puts on the frame: a force, N, and a moment about the frame's origin, N m."""
        of = [each for each in self.acting if each.kind == "inertia"]
        at = [each.at[..., 0] * each.force[..., 1] - each.at[..., 1] * each.force[..., 0] + each.couple for each in of]
        none = np.zeros(np.shape(next(iter(self.inputs.values()), 0.0)))
        return sum((each.force for each in of), np.stack([none, none], axis=-1)), sum(at, none)

    def is_force_input(self, name: str) -> bool:
        """Whether an input's effort is a force (N), not a torque (N m)."""
        return has_length_motion(self.mechanism, name)


@takes_result("State", "Motion")
def forces(moving: State | Motion, inertia: bool = True) -> Forces:
    """What inputs and pairs must supply against loads, weights, springs and the links' inertia.

    A position has its own rates, and of loads that vary with time those at t = 0. `inertia=False` leaves it out:
    equilibrium at rest, or in slow motion. For any number of inputs; where the links are held more than once, what
    rigid bodies do not tell is NaN and named. Raises BadInput where a load, spring or mass is none of this
    mechanism's; NoAnswer where there are more inputs than freedoms, and where no forces in the pairs balance the
    links, as at a dead point (of a motion such rows are NaN).

    >>> import planar
    >>> list(planar.forces(planar.solve(planar.load("four-bar"))).reactions)
    ['A', 'B', 'C', 'D']
    """
    mechanism = moving.mechanism
    check_loads(mechanism)
    state = moving if isinstance(moving, State) else None
    one = state is not None
    if state is not None:
        refuse_surplus_inputs(state)
    time = np.zeros(1) if isinstance(moving, State) else moving.time
    if time is None and any(load.varies is not None and load.varies.input is None for load in mechanism.loads):
        raise BadInput("loads", "a load varies with time, which this motion has not; give it a duration")
    equations = balance_function(mechanism)
    field = KinematicArrays(moving, equations.work.shapes)
    reactions = _make_reaction_solver(equations, field, time, inertia)
    solved = reactions.solve()
    if one and not np.isfinite(reactions.balance.loads).all():
        raise NoAnswer(
            Outcome.DEAD_POINT,
            "the ends of a spring or damper meet here, so that its force has no direction; move the input",
        )
    if not solved.is_balanced.all():
        if one:
            raise imbalance_refusal(reactions)
        solved = solved._replace(imbalance=explain_imbalance(reactions))
    supplied, whys = input_efforts(solved)
    all_of = collect_actions(field, time, supplied, inertia)
    moved = action_velocities(field, all_of)
    powers = action_powers(field, all_of, moved)
    all_of = [each._replace(power=row) for each, row in zip(all_of, powers, strict=True)]
    by_pair = {pair.name: pair_reaction(pair, field, reactions, solved) for pair in mechanism.pairs}
    equilibrium, bodies = free_body_imbalance(field, all_of, by_pair, reactions.arm)
    names = [given.pair for given in mechanism.inputs]
    undetermined = {name: why for name, why in zip(names, whys, strict=True) if why}
    undetermined |= {name: each.why for name, each in by_pair.items() if each.why}
    yielded = yielding_power(solved.wrenches, moving.frames) if mechanism.closes_within else None
    routes = None if state is None else _second_route_error(state, field, all_of, supplied[0], solved.wrenches)
    found = Forces(
        moving,
        dict(zip(names, supplied.T, strict=True)),
        {name: sum(each.power for each in all_of if each[:2] == ("input", name)) for name in names},
        by_pair,
        tuple(all_of),
        undetermined,
        ForceProof(_power_imbalance(powers, all_of, moved, yielded), routes, equilibrium),
        bodies,
    )
    return _single_position(found) if one else found


def _make_reaction_solver(
    equations: BalanceFunction, field: KinematicArrays, time: Array | None, inertia: bool
) -> ReactionSolver:
    """The balance of every position."""
    body, moving = equations.work, field.moving
    inputs = {name: np.broadcast_to(each.position, (field.position_count,)) for name, each in moving.inputs.items()}
    q, q1, q2 = body.coordinates(moving)
    balance = equations.evaluate(
        q, q1, q2, load_factors(moving.mechanism, inputs, time, field.position_count), body.initial_spring_turns(q[0])
    )
    if not inertia:
        balance = balance._replace(inertia=np.zeros_like(balance.inertia))
    return ReactionSolver(equations, balance, field)


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
    field: KinematicArrays,
    all_of: Sequence[ExternalAction],
    supplied: Array,
    wrenches: Mapping[str, Mapping[str, Wrench]],
) -> float | None:
    """How far the efforts are from those by virtual power, beside what each input would supply against every part."""
    worst, others = None, [each for each in all_of if each.kind != "input"]
    for given, effort in zip(state.mechanism.inputs, supplied, strict=True):
        unit = KinematicArrays(unit_rate_state(state, given.pair), field.shapes)
        moved = action_velocities(unit, others)
        parts = action_powers(unit, others, moved)
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
    )
