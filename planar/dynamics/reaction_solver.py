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

from planar.dynamics.equilibrium import Equilibrium
from planar.dynamics.external_actions import KinematicArrays, action_factors
from planar.dynamics.sharing.least_work import Wrench, share_by_least_work
from planar.dynamics.sparse_equilibrium import RANK_TOLERANCE
from planar.dynamics.virtual_work import BalanceEquations, VirtualWorkBalance, balance_equations
from planar.equations.sparse_matrices import SparseMatrices, SparsePattern
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.geometry import Vector
from planar.foundation.short_repr import short_repr
from planar.model.pairs import Pair
from planar.model.pairs.base import ToothContact

WHEEL_LOAD_TOLERANCE = 1e-7
"""What takes efforts, or is not held, by more than this beside a force of one is no way in which wheels load pairs."""
BALANCE_TOLERANCE = 1e-8
"""Links that stay out of balance by more than this part of the greatest force are not held by any."""
RANK_TOLERANCE_AT_SINGULAR_POSITIONS = 1e-6
"""In place of `RANK_TOLERANCE` where rates do not follow: such a position is known to the root of round-off."""
LinkActions = Mapping[str, Array]
"""What acts on the coordinates x, y, angle of links (n, 3), by link."""


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

    def __init__(self, equations: BalanceEquations, balance: VirtualWorkBalance, field: KinematicArrays):
        self.work, self.pair_rows, self.balance = equations, equations.pair_rows, balance
        self.mechanism, self.field = field.mechanism, field
        self.pairs = {pair.name: pair for pair in field.mechanism.pairs}
        self.position_count = len(balance.loads)
        self.frames = field.frames
        self.shapes, self.arm = field.shapes, field.size
        self.coordinate_scale = np.tile([1.0, 1.0, 1.0 / self.arm], len(self.work.links))
        self.row_count = equations.row_count
        matrices = self._scaled_matrices()
        self.column_scale = matrices.column_norms(1e-300)  # (n, forces)
        has_rates = np.isfinite(self.work.coordinates(field.moving)[1]).all(axis=1)
        tolerances = np.where(has_rates, RANK_TOLERANCE, RANK_TOLERANCE_AT_SINGULAR_POSITIONS)
        self.equilibrium = Equilibrium(matrices.divide_columns(self.column_scale), tolerances)

    def _scaled_matrices(self) -> SparseMatrices:
        """What forces of one in the rows of the pairs and in the inputs do to the scaled coordinates of the links
        (n, links, forces)."""
        constraints, directions = self.balance.constraints, self.balance.input_directions
        values = constraints.values.copy()
        first = constraints.pattern.first
        for name, contact in self.contacts.items():
            pair, rows = self.pairs[name], self.pair_rows[name]
            unit = self.unit_force_on_pair(pair, contact, contact.drive_direction)
            entries = slice(first[rows.start], first[rows.stop])
            values[:, entries] = np.concatenate([unit[link] for link in self.moving_bodies(pair)], axis=1)
        inputs, columns = np.nonzero(directions.any(axis=0))
        ends = first[-1] + np.cumsum(np.bincount(inputs, minlength=directions.shape[1]))
        shape = constraints.pattern.shape[0], self.row_count + directions.shape[1]
        pattern = SparsePattern(
            shape, np.concatenate([constraints.pattern.rows, columns]), np.concatenate([first, ends])
        )
        values = np.concatenate([values, directions[:, inputs, columns]], axis=1)
        return SparseMatrices(pattern, values * self.coordinate_scale[pattern.rows])

    @property
    def equilibrium_matrix(self) -> Array | SparseMatrices:
        """What forces do to the scaled coordinates of the links (n, links, forces), columns of length one."""
        return self.equilibrium.matrix

    def moving_bodies(self, pair: Pair) -> list[str]:
        """The bodies of a pair that move, in the order of their coordinates."""
        columns = self.work.link_columns
        return sorted((link for link in {*pair.bodies} if link in columns), key=columns.__getitem__)

    @cached_property
    def contacts(self) -> dict[str, ToothContact]:
        """Where teeth touch, for the pairs of which that is known."""
        entries: dict[str, list[Pair]] = {}
        names: dict[str, list[str]] = {}
        for pair in self.pairs.values():
            entries.setdefault(pair.entry_name(), []).append(pair)
            for link in pair.bodies:
                names.setdefault(link, []).append(pair.entry_name())
        order = {entry: k for k, entry in enumerate(entries)}
        contacts = {}
        for name, pair in self.pairs.items():
            if type(pair).tooth_contact is Pair.tooth_contact:
                continue
            # teeth depend on the pins of their links alone
            adjacent = {entry for link in pair.links for entry in names[link]}
            beside = [each for entry in sorted(adjacent, key=order.__getitem__) for each in entries[entry]]
            contacts[name] = pair.tooth_contact(self.frames, self.shapes, beside)
        return {name: contact for name, contact in contacts.items() if contact is not None}

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
            press = contact.pressure_tangent * np.abs(found[:, rows, 0] / self.column_scale[:, rows])
            unit = self.unit_force_on_pair(pair, contact, contact.separation_direction)
            pushed[name] = {link: action * press for link, action in unit.items()}
        return self.solve_beside(pushed)

    def solve_beside(self, pushed: Mapping[str, LinkActions]) -> ForceSolution:
        """The same where pairs by name do more than their constraints, known on the links' coordinates."""
        required = self.required_forces
        if pushed:
            required = required - sum(map(self.on_coordinates, pushed.values())) * self.coordinate_scale
        found, ways, balanced = self._solve_balance(required[:, :, None])
        found, ways = share_by_least_work(self, found, ways)
        by_cause = {"": ways} | self._wheel_changes
        by_cause = {
            name: np.concatenate([each, *self._separation_changes(each)], axis=2) for name, each in by_cause.items()
        }
        because = tuple(name for name, each in by_cause.items() for _ in range(each.shape[2]))
        ways = np.concatenate([*by_cause.values()], axis=2)
        wrenches = {name: self.pair_wrenches(pair, found[:, self.pair_rows[name]]) for name, pair in self.pairs.items()}
        for name, push in pushed.items():
            also = self._wrenches_on_bodies(self.pairs[name], {link: each[:, :, None] for link, each in push.items()})
            wrenches[name] = {
                link: Wrench(each.force + also[link].force, each.moment + also[link].moment)
                for link, each in wrenches[name].items()
            }
        changes = {name: self.pair_wrenches(pair, ways[:, self.pair_rows[name]]) for name, pair in self.pairs.items()}
        inputs = slice(self.row_count, None)
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

    def on_coordinates(self, actions: LinkActions) -> Array:
        """What acts on links, on the coordinates of all of them (n, links)."""
        total: Array = np.zeros((self.position_count, self.work.link_coordinate_count))
        for link, action in actions.items():
            first = self.work.link_columns[link]
            total[:, first : first + 3] += action
        return total

    @cached_property
    def required_forces(self) -> Array:
        """What pairs and inputs have to do together on the coordinates of the links (n, links), scaled as these are."""
        return (self.balance.inertia - self.balance.loads) * self.coordinate_scale

    @property
    def undetermined_forces(self) -> Array:
        """All ways in which equilibrium leaves open how forces are (n, forces, ways)."""
        return np.concatenate([self.equilibrium.null_space, *self._wheel_changes.values()], axis=2)

    @cached_property
    def _wheel_changes(self) -> dict[str, Array]:
        return {name: self._unknown_wheel_forces(self.pairs[name]) for name in self.couple_only_pairs}

    def _solve_balance(self, required: Array) -> tuple[Array, Array, BoolArray]:
        """The forces (n, forces, 1) that do what is required (n, links, 1), how else they may be, and whether they
        can."""
        equilibrium, matrix = self.equilibrium, self.equilibrium.matrix
        found = equilibrium.solve(required)
        found += equilibrium.solve(required - matrix @ found)
        residual = np.abs(required - matrix @ found).max(axis=(1, 2), initial=0.0)
        scale = np.maximum(*(np.abs(each).max(axis=(1, 2), initial=0.0) for each in (required, found)))
        return found, equilibrium.null_space, residual <= BALANCE_TOLERANCE * scale

    def unit_force_on_pair(self, pair: Pair, contact: ToothContact, way: Vector) -> dict[str, Array]:
        """A force of one along a way at a contact, on the second link, and its opposite on the first."""
        actions: dict[str, Array] = {link: np.zeros((self.position_count, 3)) for link in self.moving_bodies(pair)}
        for link, sense in zip(pair.links, (-1.0, 1.0), strict=True):
            if link in actions:
                actions[link] += self._unit_action(link, contact.pitch_point, way, sense)
        return actions

    def _unit_action(self, link: str, place: Vector, way: Vector | None, sense: float) -> Array:
        """A force of one along a way at a place, or a couple of one at the mechanism's size, on the coordinates of a
        link (n, 3)."""
        frame = self.frames[link]
        arm = place - Vector(frame.x, frame.y)
        action: Array = np.empty((self.position_count, 3))
        for k, part in enumerate((0.0, 0.0, self.arm) if way is None else (way.x, way.y, arm.cross(way))):
            action[:, k] = sense * part
        return action

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
                if link in self.work.link_columns:
                    column = self.work.link_columns[link]
                    share[:, column : column + 3, k] += self._unit_action(link, at, way, sense)
        share *= self.coordinate_scale[:, None]
        change = -self.equilibrium.solve(share)
        own, inputs = self.pair_rows[pair.name], slice(self.row_count, None)
        barred = np.concatenate([change[:, own], change[:, inputs], share + self.equilibrium_matrix @ change], axis=1)
        s, v = np.linalg.svd(barred, full_matrices=False)[1:]
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
            unit = self.on_coordinates(self.unit_force_on_pair(self.pairs[name], contact, contact.separation_direction))
            push = unit * (contact.pressure_tangent * press)[:, None]
            found.append(-self.equilibrium.solve((push * self.coordinate_scale)[:, :, None]))
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
        rows, actions = self.pair_rows[pair.name], {}
        for link in self.moving_bodies(pair):
            own = slice(self.work.link_columns[link], self.work.link_columns[link] + 3)
            actions[link] = (self.equilibrium_matrix[:, own, rows] @ forces) / self.coordinate_scale[None, own, None]
        return self._wrenches_on_bodies(pair, actions)

    def input_wrench(self, link: str, number: int, solution: ForceSolution) -> tuple[Wrench, Wrench]:
        """What the effort of an input does to a link that moves (n,), and how it may be otherwise (n, ways)."""
        first = self.work.link_columns[link]
        direction = self.balance.input_directions[:, number, first : first + 3, None]
        wrench = self._wrench_on_link(link, direction * solution.efforts[:, None, number : number + 1])
        changes = self._wrench_on_link(link, direction * solution.effort_changes[:, number, None])
        return Wrench(wrench.force[:, 0], wrench.moment[:, 0]), changes

    def _wrenches_on_bodies(self, pair: Pair, actions: LinkActions) -> dict[str, Wrench]:
        """Forces on the coordinates of a pair's bodies (n, 3, ways) by link; the frame has what adds up to nothing."""
        found = {link: self._wrench_on_link(link, action) for link, action in actions.items()}
        none = np.zeros(())
        rest = Wrench(
            -sum((each.force for each in found.values()), none), -sum((each.moment for each in found.values()), none)
        )
        return {link: found.get(link, rest) for link in pair.bodies}

    def _wrench_on_link(self, link: str, action: Array) -> Wrench:
        frame = self.frames[link]
        force = action[:, :2].transpose(0, 2, 1)
        return Wrench(force, action[:, 2] + frame.x[:, None] * force[..., 1] - frame.y[:, None] * force[..., 0])


def bearing_point(pair: Pair) -> tuple[str, str] | None:
    """The (link, point) at which a pair without teeth bears; None where it joins its links at no place."""
    rides = pair.point_on_line()
    return next(iter(pair.coincident_points()[1:] or ((rides[0],) if rides else ())), None)


def fill_balance(field: KinematicArrays, time: Array | None, inertia: bool) -> ReactionSolver:
    """The balance of every position of a state or a motion."""
    equations = balance_equations(field.mechanism)
    return ReactionSolver(equations, equations.balance(field, action_factors(field, time), inertia), field)
