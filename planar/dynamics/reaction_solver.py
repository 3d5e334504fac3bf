"""The forces in pairs and of inputs that balance the links, from the multipliers of the constraints.

Links that are held more than once share what holds them in a way that rigid bodies do not tell: such reactions are
named, and those that are the same however it is shared are given. Teeth press at their pitch point, and push each other
off: the other pairs carry that too.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.load_variation import load_factors
from planar.dynamics.sharing.least_work import Wrench, share_by_least_work
from planar.dynamics.virtual_work import BalanceFunction, VirtualWorkBalance, balance_function
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.geometry import Vector
from planar.foundation.short_repr import short_repr
from planar.model.pairs import Pair
from planar.model.pairs.base import ToothContact

RANK_TOLERANCE = 1e-9
"""A singular value below this part of the greatest is none: what it would hold is held by others, or by nothing."""
WHEEL_LOAD_TOLERANCE = 1e-7
"""What takes efforts, or is not held, by more than this beside a force of one is no way in which wheels load pairs."""
BALANCE_TOLERANCE = 1e-8
"""Links that stay out of balance by more than this part of the greatest force are not held by any."""


class ForceSolution(NamedTuple):
    """What inputs and pairs do at positions (n).

    `efforts` (n, inputs); `wrenches` of every pair on each of its bodies (n), and by `changes` (n, ways) how they may
    be otherwise; `effort_changes` (n, inputs, ways) alike. `causes` has for every way the pair whose share in it is
    not known, or nothing where links are held more than once. `is_balanced` (n,) is False where no forces in the pairs
    balance the links, as at a dead point; `imbalance` says why.
    """

    efforts: Array
    effort_changes: Array
    wrenches: dict[str, dict[str, Wrench]]
    wrench_changes: dict[str, dict[str, Wrench]]
    causes: tuple[str, ...]
    is_balanced: BoolArray
    imbalance: str = ""

    def __repr__(self) -> str:
        return short_repr(self)


class ReactionSolver:
    """One mechanism at n positions, its balance filled in."""

    def __init__(self, balancing: BalanceFunction, balance: VirtualWorkBalance, field: KinematicArrays):
        self.work, self.pair_rows, self.balance = balancing.work, balancing.pair_rows, balance
        self.mechanism, self.field = field.mechanism, field
        self.pairs = {pair.name: pair for pair in field.mechanism.pairs}
        self.position_count = len(balance.loads)
        self.frames = field.frames
        self.shapes, self.arm = field.shapes, self.work.size
        self.coordinate_scale = np.tile([1.0, 1.0, 1.0 / self.arm], len(self.work.links))
        rows = balance.constraints.copy()
        for name, contact in self.contacts.items():
            rows[:, self.pair_rows[name]] = self.unit_force_on_pair(self.pairs[name], contact, contact.drive_direction)
        held = np.concatenate([rows, balance.input_directions], axis=1) * self.coordinate_scale
        self.column_scale = np.maximum(np.linalg.norm(held, axis=2), 1e-300)  # (n, forces)
        self.equilibrium_matrix = (held / self.column_scale[:, :, None]).transpose(0, 2, 1)  # (n, links, forces)

    @cached_property
    def contacts(self) -> dict[str, ToothContact]:
        """Where teeth touch, for the pairs of which that is known."""
        beside = tuple(self.pairs.values())
        found = {name: pair.tooth_contact(self.frames, self.shapes, beside) for name, pair in self.pairs.items()}
        return {name: contact for name, contact in found.items() if contact is not None}

    @cached_property
    def couple_only_pairs(self) -> tuple[str, ...]:
        """The pairs of which only couples are known: what forces they come from, and load other pairs, is not."""
        return tuple(name for name, pair in self.pairs.items() if pair.ties_angles and name not in self.contacts)

    def solve(self) -> ForceSolution:
        """The efforts and reactions that balance loads and inertia, without friction."""
        if not self.contacts:
            return self.solve_beside({})
        found, *_ = self._solve_balance(self.required_forces[:, :, None])
        pushed = {}
        for name, contact in self.contacts.items():
            pair, rows = self.pairs[name], self.pair_rows[name]
            press = np.abs(found[:, rows, 0] / self.column_scale[:, rows])
            push = self.unit_force_on_pair(pair, contact, contact.separation_direction)[:, 0]
            pushed[name] = push * (contact.pressure_tangent * press)
        return self.solve_beside(pushed)

    def solve_beside(self, pushed: Mapping[str, Array]) -> ForceSolution:
        """The same where pairs by name do more than their constraints, known on the links' coordinates (n, links)."""
        asked = self.required_forces
        if pushed:
            off = sum(pushed.values()) * self.coordinate_scale
            asked = asked - off
        found, ways, balanced = self._solve_balance(asked[:, :, None])
        found, ways = share_by_least_work(self, found, ways)
        by_cause = {"": ways} | self._wheel_changes
        by_cause = {
            name: np.concatenate([each, *self._separation_changes(each)], axis=2) for name, each in by_cause.items()
        }
        because = tuple(name for name, each in by_cause.items() for _ in range(each.shape[2]))
        ways = np.concatenate([*by_cause.values()], axis=2)
        wrenches = {name: self.pair_wrenches(pair, found[:, self.pair_rows[name]]) for name, pair in self.pairs.items()}
        for name, push in pushed.items():
            also = self._wrenches_on_bodies(self.pairs[name], push[:, :, None])
            wrenches[name] = {
                link: Wrench(each.force + also[link].force, each.moment + also[link].moment)
                for link, each in wrenches[name].items()
            }
        changes = {name: self.pair_wrenches(pair, ways[:, self.pair_rows[name]]) for name, pair in self.pairs.items()}
        inputs = slice(self.balance.constraints.shape[1], None)
        by = self.column_scale[:, inputs, None]
        return ForceSolution(
            (found[:, inputs] / by)[:, :, 0],
            ways[:, inputs] / by,
            {
                name: {link: Wrench(w.force[:, 0], w.moment[:, 0]) for link, w in of.items()}
                for name, of in wrenches.items()
            },
            changes,
            because,
            balanced,
        )

    @cached_property
    def required_forces(self) -> Array:
        """What pairs and inputs have to do together on the coordinates of the links (n, links), scaled as these are."""
        return (self.balance.inertia - self.balance.loads) * self.coordinate_scale

    @property
    def inverse(self) -> Array:
        """How forces (n, forces) follow from what they have to do together (n, forces, links)."""
        return self._inverse_and_null_space[0]

    @property
    def undetermined_forces(self) -> Array:
        """All ways in which equilibrium leaves open how forces are (n, forces, ways)."""
        return np.concatenate([self._inverse_and_null_space[1], *self._wheel_changes.values()], axis=2)

    @cached_property
    def _wheel_changes(self) -> dict[str, Array]:
        return {name: self._unknown_wheel_forces(self.pairs[name]) for name in self.couple_only_pairs}

    @cached_property
    def _inverse_and_null_space(self) -> tuple[Array, Array]:
        """The inverse (n, forces, links) as far as there is one, and the ways (n, forces, ways) in which forces that
        nothing asks for may stand against each other."""
        many, links, forces = self.equilibrium_matrix.shape
        inverse, ways = np.zeros((many, forces, links)), np.zeros((many, forces, 0))
        weak = np.full(many, bool(self.equilibrium_matrix.size))
        if links == forces:
            # the norms tell that no singular value is weak, in a tenth of the time that it takes to find them
            whole = np.full(many, True)
            try:
                inverse = np.linalg.inv(self.equilibrium_matrix)
            except np.linalg.LinAlgError:  # some are singular
                whole = np.linalg.slogdet(self.equilibrium_matrix)[0] != 0.0
                inverse[whole] = np.linalg.inv(self.equilibrium_matrix[whole])
            sizes = [np.linalg.norm(each, axis=(1, 2)) for each in (self.equilibrium_matrix, inverse)]
            weak = ~whole | (sizes[0] * sizes[1] >= 1.0 / RANK_TOLERANCE)
        if weak.any():
            inverse[weak], spare = _pseudo_inverse(self.equilibrium_matrix[weak])
            ways = np.zeros((many, forces, spare.shape[2]))
            ways[weak] = spare
        return inverse, ways

    def _solve_balance(self, asked: Array) -> tuple[Array, Array, BoolArray]:
        """The forces (n, forces, 1) that do what is asked (n, links, 1), how else they may be, and whether they can."""
        inverse, ways = self._inverse_and_null_space
        found = inverse @ asked
        found += inverse @ (asked - self.equilibrium_matrix @ found)
        left = np.abs(asked - self.equilibrium_matrix @ found).max(axis=(1, 2), initial=0.0)
        whole = np.maximum(np.abs(asked).max(axis=(1, 2), initial=0.0), np.abs(found).max(axis=(1, 2), initial=0.0))
        return found, ways, left <= BALANCE_TOLERANCE * whole

    def unit_force_on_pair(self, pair: Pair, contact: ToothContact, way: Vector) -> Array:
        """A force of one along a way at a contact, on the second link, and its opposite on the first (n, 1, links)."""
        found = np.zeros((self.position_count, 1, self.work.link_coordinate_count))
        for link, sense in zip(pair.links, (-1.0, 1.0), strict=True):
            self._add_unit_action(found, link, contact.pitch_point, way, sense)
        return found

    def _add_unit_action(self, found: Array, link: str, at: Vector, way: Vector | None, sense: float) -> None:
        """Add a force of one along a way at a place of a link, or a couple of one at the mechanism's size."""
        if link in self.work.link_columns:
            first, frame = self.work.link_columns[link], self.frames[link]
            arm = at - Vector(frame.x, frame.y)
            for k, part in enumerate((0.0, 0.0, self.arm) if way is None else (way.x, way.y, arm.cross(way))):
                found[:, 0, first + k] += sense * part

    def _unknown_wheel_forces(self, pair: Pair) -> Array:
        """How forces change with an unknown wrench between two wheels beside the couples of their row (n, forces, 4).

        A force at a place and a couple between the wheels, and a couple between one and their carrier; of these only
        what the pairs alone hold, for efforts follow from the couples.
        """
        first, second, carrier = pair.bodies
        x, y = Vector(1.0, 0.0), Vector(0.0, 1.0)
        at = Vector(self.frames[second].x, self.frames[second].y)
        share = np.zeros((self.position_count, self.work.link_coordinate_count, 4))
        for k, (way, against) in enumerate(((x, first), (y, first), (None, first), (None, carrier))):
            for link, sense in ((against, -1.0), (second, 1.0)):
                self._add_unit_action(share[:, None, :, k], link, at, way, sense)
        share *= self.coordinate_scale[:, None]
        change = -self._inverse_and_null_space[0] @ share
        own, inputs = self.pair_rows[pair.name], slice(self.balance.constraints.shape[1], None)
        barred = np.concatenate([change[:, own], change[:, inputs], share + self.equilibrium_matrix @ change], axis=1)
        s, v = np.linalg.svd(barred)[1:]
        return change @ (v.transpose(0, 2, 1) * (s <= WHEEL_LOAD_TOLERANCE)[:, None]) @ v

    def _separation_changes(self, ways: Array) -> list[Array]:
        """How forces (n, forces, 1) change with what pushes teeth off each other, for every contact.

        Where ways (n, forces, ways) leave open how hard teeth press, they leave that open too, and whatever the sense.
        """
        if not ways.shape[2]:
            return []
        found = []
        for name, contact in self.contacts.items():
            rows = self.pair_rows[name]
            press = np.linalg.norm(ways[:, rows] / self.column_scale[:, rows, None], axis=(1, 2))
            push = (
                self.unit_force_on_pair(self.pairs[name], contact, contact.separation_direction)[:, 0]
                * (contact.pressure_tangent * press)[:, None]
            )
            found.append(-self._inverse_and_null_space[0] @ (push * self.coordinate_scale)[:, :, None])
        return found

    def reaction_point(self, pair: Pair) -> Array | None:
        """Where a pair's force is told (n, 2): its pin, the point that rides on its line, where teeth touch."""
        contact = self.contacts.get(pair.name)
        if contact is not None:
            return np.stack(np.broadcast_arrays(*contact.pitch_point, np.zeros(self.position_count))[:2], axis=-1)
        end = bearing_point(pair)
        return self.field.point_rates(end[0], self.shapes[end[0]].position(end[1])) if end is not None else None

    def pair_wrenches(self, pair: Pair, forces: Array) -> dict[str, Wrench]:
        """What a pair does to each of its bodies (n, ways) by forces of its own (n, rows, ways)."""
        own = (self.equilibrium_matrix[:, :, self.pair_rows[pair.name]] @ forces) / self.coordinate_scale[None, :, None]
        return self._wrenches_on_bodies(pair, own)

    def _wrenches_on_bodies(self, pair: Pair, own: Array) -> dict[str, Wrench]:
        """Forces on the coordinates of a pair's bodies (n, links, ways); the frame has what adds up to nothing."""
        bodies = dict.fromkeys(pair.bodies)
        found = {link: self._wrench_on_link(link, own) for link in bodies if link in self.work.link_columns}
        none = np.zeros(())
        rest = Wrench(
            -sum((each.force for each in found.values()), none), -sum((each.moment for each in found.values()), none)
        )
        return {link: found.get(link, rest) for link in bodies}

    def _wrench_on_link(self, link: str, own: Array) -> Wrench:
        at, frame = self.work.link_columns[link], self.frames[link]
        force = own[:, at : at + 2].transpose(0, 2, 1)
        return Wrench(force, own[:, at + 2] + frame.x[:, None] * force[..., 1] - frame.y[:, None] * force[..., 0])


def bearing_point(pair: Pair) -> tuple[str, str] | None:
    """The (link, point) at which a pair without teeth bears; None where it joins its links at no place."""
    rides = pair.point_on_line()
    return next(iter(pair.coincident_points()[1:] or ((rides[0],) if rides else ())), None)


def _pseudo_inverse(held: Array) -> tuple[Array, Array]:
    """Those of `ReactionSolver._inverse_and_null_space` by singular values."""
    u, s, v = np.linalg.svd(held)
    strong = s > RANK_TOLERANCE * s[:, :1]
    few, back = s.shape[1], v.transpose(0, 2, 1)
    inverse = back[:, :, :few] * np.where(strong, 1.0 / np.where(strong, s, 1.0), 0.0)[:, None]
    spare = np.ones((len(held), back.shape[2]), dtype=bool)
    spare[:, :few] = ~strong
    return inverse @ u.transpose(0, 2, 1)[:, :few], (back * spare[:, None, :])[:, :, spare.any(axis=0)]


def fill_balance(field: KinematicArrays, time: Array | None, inertia: bool, at_rest: bool = False) -> ReactionSolver:
    """The balance of every position of a state or a motion, as it moves or as if it stood still there."""
    moving = field.moving
    equations = balance_function(moving.mechanism)
    body = equations.work
    inputs = {name: np.broadcast_to(each.position, (field.position_count,)) for name, each in moving.inputs.items()}
    q, q1, q2 = body.coordinates(moving)
    if at_rest:
        q1, q2 = np.zeros_like(q1), np.zeros_like(q2)
    factors = load_factors(moving.mechanism, inputs, time, field.position_count)
    balance = equations.evaluate(q, q1, q2, factors, body.initial_spring_turns(q[0]))
    if not inertia:
        balance = balance._replace(inertia=np.zeros_like(balance.inertia))
    return ReactionSolver(equations, balance, field)
