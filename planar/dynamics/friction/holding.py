"""What a mechanism holds at rest: the efforts of its input, or the loads, with which friction keeps it there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from planar.document.first_argument import takes_result
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.friction.contact_choice import solve_contacts
from planar.dynamics.friction.contact_rows import RATE_TOLERANCE, ContactRows
from planar.dynamics.friction.single_solution import has_single_solution, solve_contraction
from planar.dynamics.load_validation import check_loads
from planar.dynamics.reaction_solver import ReactionSolver, fill_balance
from planar.dynamics.virtual_velocities import refuse_surplus_inputs
from planar.dynamics.virtual_work import balance_equations
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput
from planar.foundation.notebook_display import Displayable
from planar.model.mechanism import Mechanism
from planar.model.wording import quote_names
from planar.results.motion import Motion, State

MAX_MIXED_PAIRS = 10
"""Of more pairs that rub not every mixture of senses is tried."""
WIDER_TOLERANCE = 1e-9
"""Of the greatest effort: what is wider by less is not."""


@dataclass(frozen=True, eq=False)
class Holding(Displayable):
    """The efforts of an input (N m, or N) with which a mechanism stays at rest, at a position or at n of them.

    From `low` to `high` friction at rest holds it: as the effort passes one of these everything slips at once, with
    the input moving on (`high`) or back (`low`). NaN where nothing balances the links, or friction is not determined;
    infinite where no effort, however great, starts it. `widest` (2,) or (n, 2): efforts beyond, up to those, may be
    held too, where pairs are braced against each other: the ends over every mixture of senses in which they can rub.
    `is_proved` where it is proved that contacts have just one solution in each of these.

    With a `load` (by what the file calls it) these are the parts of that load, 1 as it stands, that are held with the
    `effort` of the input; past `high` it moves the way the load pushes, past `low` against it.
    """

    moving: State | Motion
    input: str
    low: Array | float
    high: Array | float
    widest: Array
    is_proved: BoolArray | bool
    undetermined: str = ""
    load: str | None = None
    effort: float = 0.0

    def __repr__(self) -> str:
        return f"<Holding of {self.load or self.input!r} in {self.moving!r}>"

    @property
    def is_self_locking(self) -> BoolArray | bool:
        """Whether it stays under its loads without an effort of the input; of a load whether that is held as it is."""
        wanted = 0.0 if self.load is None else 1.0
        found = (np.asarray(self.low) <= wanted) & (np.asarray(self.high) >= wanted)
        return found if found.ndim else bool(found)


@takes_result("State", "Motion")
def holding(moving: State | Motion, load: str | None = None, effort: float = 0.0) -> Holding:
    """Between which efforts of its one input a mechanism with friction stays at rest under its loads and weights.

    With the coefficients at rest. Equilibrium does not tell how friction is shared there; at the ends of the interval
    all pairs slip. With a `load`, the point, link or pair that it acts on: between which parts of that load it stays
    with this `effort` of the input (N m, or N). Raises BadInput for several inputs, where no pair has friction, for a
    load that is not there once, and what `planar.forces` raises for loads.

    >>> import planar
    >>> jack = planar.load("screw-jack")
    >>> planar.holding(planar.solve(jack)).is_self_locking
    True
    """
    mechanism = moving.mechanism
    check_loads(mechanism)
    if len(mechanism.inputs) != 1:
        raise BadInput("inputs", f"what is held at rest is told of one input, and there are {len(mechanism.inputs)}")
    if not any(pair.has_friction for pair in mechanism.pairs):
        raise BadInput("pairs", "no pair has friction; give one 'friction', as 0.15, or an 'efficiency'")
    if isinstance(moving, State):
        refuse_surplus_inputs(moving)
    time = moving.time if isinstance(moving, Motion) else np.zeros(1)
    field = KinematicArrays(moving, at_rest=True)
    balanced = fill_balance(field, time, inertia=False)
    if load is not None:
        balanced = _with_unknown_load(balanced, field, time, _load_index(mechanism, load), effort)
    ends = _HoldingEnds(balanced, field)
    told = ends.undetermined, load, float(effort)
    name = mechanism.inputs[0].pair
    low, high, widest, proved = ends.low, ends.high, ends.widest, ends.is_proved
    if isinstance(moving, State):
        return Holding(moving, name, float(low[0]), float(high[0]), widest[0], bool(proved[0]), *told)
    return Holding(moving, name, low, high, widest, proved, *told)


def load_names(mechanism: Mechanism) -> tuple[str, ...]:
    """What each load of a mechanism acts on."""
    return tuple(load.target for load in mechanism.loads)


def _load_index(mechanism: Mechanism, name: str) -> int:
    """The one load on a point, link or pair. Raises BadInput."""
    names = load_names(mechanism)
    if names.count(name) != 1:
        told = "there are several loads" if name in names else "there is no load"
        raise BadInput("load", f"{told} on {name!r}; loads are on {quote_names(names) if names else 'nothing'}")
    return names.index(name)


def _with_unknown_load(
    balanced: ReactionSolver, field: KinematicArrays, time: Array | None, index: int, effort: float
) -> ReactionSolver:
    """The balance with the part of a load as what is looked for, and the effort of the input as a load."""
    moving = field.moving
    assert isinstance(moving, State | Motion)
    loads = moving.mechanism.loads
    without = replace(moving, mechanism=replace(moving.mechanism, loads=loads[:index] + loads[index + 1 :]))
    rest = fill_balance(KinematicArrays(without, at_rest=True), time, inertia=False).balance.loads
    push = balanced.balance.loads - rest
    driven = rest + balanced.balance.input_directions[:, 0] * effort
    changed = balanced.balance._replace(loads=driven, input_directions=push[:, None])
    return ReactionSolver(balance_equations(moving.mechanism), changed, field)


class _HoldingEnds:
    """The efforts at which everything slips, on and back."""

    def __init__(self, reactions: ReactionSolver, field: KinematicArrays):
        self.reactions, self.rows = reactions, ContactRows(reactions, field, at_rest=True)
        many = reactions.position_count
        self.effort_row = reactions.equilibrium.inverse_rows(slice(reactions.row_count, reactions.row_count + 1))[:, 0]
        self.undetermined = ""
        without = reactions.solve()
        nothing = np.full(many, np.nan)
        self.low, self.high, self.widest = nothing, nothing.copy(), np.full((many, 2), np.nan)
        self.is_proved = np.zeros(many, dtype=bool)
        self.sound = without.is_balanced & self.rows.is_determined()
        if not self.sound.any():
            self.undetermined = "what it holds is not determined, as the reactions are not that friction follows"
            return
        senses = self._unit_senses()
        forward, ahead = self._effort(senses, 1.0)
        backward, back = self._effort({name: -sense for name, sense in senses.items()}, -1.0)
        self.high, self.low = np.where(self.sound, forward, np.nan), np.where(self.sound, backward, np.nan)
        self.is_proved = self.sound & ahead & back
        self.widest = np.stack([np.fmin(self.low, self.high), np.fmax(self.low, self.high)], axis=1)
        self._widen(senses)

    def _unit_senses(self) -> dict[str, Array]:
        """The senses of all pairs with the input at unit rate (n,): its row of the inverse is that motion."""
        reactions = self.reactions
        motion = self.effort_row * reactions.coordinate_scale
        rates = {name: self.rows.rates_along(name, motion) for name in self.rows.rubbing_pairs}
        most = np.abs(motion / reactions.coordinate_scale).max(axis=1, initial=0.0)
        units = {name: 1.0 if self.rows.is_length(name) else 1.0 / reactions.arm for name in rates}
        return {
            name: np.where(np.abs(rate) > RATE_TOLERANCE * most * units[name], np.sign(rate), 0.0)
            for name, rate in rates.items()
        }

    def _effort(self, senses: dict[str, Array], way: float) -> tuple[Array, BoolArray]:
        """The effort at which all slips in these senses (n,), infinite where none does; where it is the only one."""
        system, actions = self.rows.system(senses)
        choice = solve_contacts(system.where(self.sound))
        single = (choice.solution_count == 1) & choice.is_complete
        found = self._efforts(actions, np.nan_to_num(choice.first))
        none = choice.solution_count == 0
        return np.where(none, way * np.inf, found), single

    def _efforts(self, actions: Array, y: Array) -> Array:
        """What the input supplies with contacts y (n, m)."""
        reactions = self.reactions
        off = np.einsum("nlm,nm->nl", actions, y) * reactions.coordinate_scale
        force = np.einsum("nl,nl->n", self.effort_row, reactions.required_forces - off)
        found: Array = force / reactions.column_scale[:, reactions.row_count]
        return found

    def _widen(self, senses: dict[str, Array]) -> None:
        """Try every mixture of senses: at rest each pair may bear either way, whatever the others do."""
        names = list(senses)
        if len(names) > MAX_MIXED_PAIRS:
            self.is_proved = np.zeros_like(self.is_proved)
            return
        if not self.is_proved.any():
            return
        low, high = self.widest.T
        proved = self.is_proved.copy()
        for signs in product((1.0, -1.0), repeat=max(len(names) - 1, 0)):
            mixed = {
                name: np.where(senses[name] == 0.0, 1.0, senses[name]) * sign
                for name, sign in zip(names, (1.0, *signs), strict=False)
            }
            for way in (1.0, -1.0):
                system, actions = self.rows.system({name: way * sense for name, sense in mixed.items()})
                single = has_single_solution(system.where(self.sound))
                proved &= single
                rows = np.flatnonzero(single)
                y = np.zeros(system.loads.shape[:2])
                if rows.size:
                    y[rows] = solve_contraction(system.at(rows))
                effort = np.where(single, self._efforts(actions, y), np.nan)
                low, high = np.fmin(low, effort), np.fmax(high, effort)
        self.widest, self.is_proved = np.stack([low, high], axis=1), proved
        wide = WIDER_TOLERANCE * np.nan_to_num(np.abs(self.widest).max(axis=1))
        self.widest[:, 0] = np.where(self.low - low <= wide, self.low, low)
        self.widest[:, 1] = np.where(high - self.high <= wide, self.high, high)
