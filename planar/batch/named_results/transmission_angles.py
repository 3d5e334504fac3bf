"""The transmission angles of output links in many designs: how squarely the force that drives them acts.

The rule is that of `planar.transmission`: inputs hold still, links are weightless, and the output alone is loaded.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from planar.batch.design_arrays import design_variables
from planar.batch.named_results.design_forces import design_reaction_solver, position_chunks
from planar.batch.named_results.design_frames import DesignFrames
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.reaction_solver import ForceSolution, ReactionSolver
from planar.dynamics.reactions import DETERMINED_TOLERANCE
from planar.dynamics.sharing.least_work import Wrench
from planar.foundation.errors import BadInput
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.output_pair import find_output_pair
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import join_all_names

Array = np.ndarray

NEGLIGIBLE_FORCE = 1e-7
"""A force below this part of the greatest on the output, or a moment below this part at an arm of the size, is none."""


class OutputLink:
    """An output link, with the pairs by which other moving links may drive it. Raises Unknown, BadInput."""

    def __init__(self, mechanism: Mechanism, output: str):
        self.mechanism = replace(mechanism, loads=(), springs=(), masses=())
        self.link, self.pair = find_output_pair(mechanism, output)
        self.slides = self.pair.input_kind is MeasureKind.LENGTH
        self.driving_pairs = {pair.name: pair for pair in mechanism.pairs if self._can_drive(pair)}
        if not self.driving_pairs:
            told = f"no other moving link drives {self.link}: its transmission angle is that of a link the rest drives"
            raise BadInput(self.link, told)

        motions = relative_motions(mechanism)
        own = [given.pair for given in mechanism.inputs if self._can_drive(motions[given.pair])]
        if own:
            told = f"the input at {own[0]} itself drives {self.link} from another moving link"
            raise BadInput(self.link, f"{told}; planar.transmission tells whether it has a transmission angle")

    def _can_drive(self, pair: Pair) -> bool:
        others = [body for body in pair.bodies if body not in (self.link, self.mechanism.frame)]
        return self.link in pair.bodies and bool(others) and pair.entry_name() != self.pair.entry_name()

    def angles(self, frames: DesignFrames, values: Mapping[str, Array], is_solved: Array) -> Array:
        """The angle (rad, 0 to pi/2) of designs at every step (steps + 1, designs); NaN where it is not determined."""
        angles = np.full(frames.design_shape, np.nan)
        own = design_variables(self.mechanism)  # numbers of loads, springs and masses are not there
        known = {name: value for name, value in values.items() if name in own}
        for positions in position_chunks(self.mechanism, frames, known, is_solved):
            reactions = design_reaction_solver(self.mechanism, frames, positions, known)
            angles[positions.steps, positions.designs] = self._angles_at(reactions)
        return angles

    def _angles_at(self, reactions: ReactionSolver) -> Array:
        field = reactions.field
        way, count = self._slide_direction(field), field.position_count
        load = np.zeros((count, reactions.work.link_coordinate_count))
        first = reactions.work.link_columns[self.link]
        if self.slides:
            load[:, first : first + 2] = way
        else:
            load[:, first + 2] = 1.0
        reactions.balance = reactions.balance._replace(loads=load, inertia=np.zeros_like(load))
        solved = reactions.solve()
        force, moment, names = self._driving_force(solved, reactions.arm)
        along = way if self.slides else self._lever(field, names, Wrench(force, moment))
        cross = np.abs(along[:, 0] * force[:, 1] - along[:, 1] * force[:, 0])
        dot = np.abs(np.sum(along * force, axis=1))
        angle = np.arctan2(dot, cross) if self.slides else np.arctan2(cross, dot)
        return np.where(solved.is_balanced, angle, 0.0)

    def _driving_force(self, solved: ForceSolution, arm: float) -> tuple[Array, Array, list[str]]:
        """The force (n, 2) that drives the output, its moment (n,) about the world's origin, and the pairs by which."""
        own = {name: solved.wrenches[name][self.link] for name in self.driving_pairs}
        unit = 1.0 if self.slides else 1.0 / arm  # of a force that balances the load
        sizes = {
            name: np.where(solved.is_balanced, np.maximum(np.hypot(*each.force.T), np.abs(each.moment) / arm), 0.0)
            for name, each in own.items()
        }
        names = [name for name, size in sizes.items() if np.any(size > NEGLIGIBLE_FORCE * unit)]
        if not names and solved.is_balanced.any():
            told = f"no other moving link drives {self.link}: its transmission angle is that of a link the rest drives"
            raise BadInput(self.link, told)
        names = names or [*own]
        force = np.sum([own[name].force for name in names], axis=0)
        moment = np.sum([own[name].moment for name in names], axis=0)
        changes = [np.abs(solved.wrench_changes[name][self.link].force).max(axis=(1, 2), initial=0.0) for name in names]
        return np.where((np.max(changes, axis=0) <= DETERMINED_TOLERANCE)[:, None], force, np.nan), moment, names

    def _slide_direction(self, field: KinematicArrays) -> Array:
        """The unit direction (n, 2) in which a sliding output goes."""
        if not self.slides:
            return np.zeros((field.position_count, 2))
        pair = next(each for each in field.mechanism.pairs if each.name == self.pair.name)
        way = pair.effort_action(field.frames, field.shapes).direction
        assert way is not None
        return np.stack(np.broadcast_arrays(*way, np.zeros(field.position_count))[:2], axis=1)

    def _lever(self, field: KinematicArrays, names: list[str], driving: Wrench) -> Array:
        """From the fixed pin to the point at which the force acts (n, 2). Raises BadInput where there is none."""
        places = {self._force_point(self.driving_pairs[name]) for name in names}
        place = places.pop()
        if places or place is None:
            told = f"{self.link} is driven at several places, or by wheels"
            raise BadInput(self.link, f"{told}, so that no one line of force with one pin tells a transmission angle")
        pin = next(each for each in self.pair.coincident_points() if each[0] == self.mechanism.frame)
        at, centre = (field.point_rates(link, field.shapes[link].position(point)) for link, point in (place, pin))
        couple = np.abs(driving.moment_about(at))  # beside the torque of one that it balances
        if np.max(couple[np.isfinite(couple)], initial=0.0) > NEGLIGIBLE_FORCE:
            told = f"at {join_all_names(names)} a couple drives {self.link} beside a force"
            raise BadInput(self.link, f"{told}, so that no line of force through one pin tells a transmission angle")
        return at - centre

    def _force_point(self, pair: Pair) -> tuple[str, str] | None:
        """The (link, point) where a pair's force acts: of the output if it can be."""
        at = [member for member in pair.coincident_points() if member[0] == self.link]
        rides = pair.point_on_line()
        return at[0] if at else rides and rides[0]


@lru_cache(maxsize=16)
def output_link(mechanism: Mechanism, output: str) -> OutputLink:
    """An output link, kept. Raises Unknown, BadInput."""
    return OutputLink(mechanism, output)
