"""The transmission angle of an output link by the balance of a load on that link alone; see `planar.transmission`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from planar.dynamics.external_actions import KinematicArrays, LinkMotion
from planar.dynamics.reaction_solver import ForceSolution, ReactionSolver
from planar.dynamics.reactions import DETERMINED_TOLERANCE
from planar.dynamics.sharing.least_work import Wrench
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar, atan2
from planar.model.loads import Load
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.output_pair import find_output_pair
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import join_all_names

NEGLIGIBLE_FORCE = 1e-7
"""A force below this part of the greatest on the output, or a moment below this part at an arm of the size, is none."""


class DrivenOutput:
    """An output link, with the pairs and inputs by which other moving links may drive it. Raises Unknown, BadInput.

    Inputs hold still, links are weightless, and the output alone is loaded, by a torque or a force of one.
    """

    def __init__(self, mechanism: Mechanism, output: str):
        self.link, self.pair = find_output_pair(mechanism, output)
        self.mechanism, self.slides = loaded_output(mechanism, self.pair), self.pair.input_kind is MeasureKind.LENGTH
        motions = relative_motions(mechanism)
        pairs = [*mechanism.pairs, *(motions[given.pair] for given in mechanism.inputs)]
        self.driving_pairs = {pair.name: pair for pair in pairs if can_drive(mechanism, pair, (self.link, self.pair))}
        if not self.driving_pairs:
            raise undriven_output(self.link)

    def angles(self, reactions: ReactionSolver, through: tuple[str, ...] = ()) -> tuple[tuple[str, ...], Array]:
        """The names of the pairs that drive the output, unless they are given, and the angle (rad, 0 to pi/2) at all
        positions (n,): 0 where nothing balances the load, NaN where forces on the output are not determined."""
        solution, arm = reactions.solve(), reactions.arm
        wrenches = {name: self._wrenches(reactions, solution, name) for name in self.driving_pairs}
        if not through:
            # what wheels do beside their couples is never known
            is_shared = np.array([not cause for cause in solution.causes], dtype=bool)
            is_known = is_held_once = solution.is_balanced
            for _, change in wrenches.values():
                sizes_of_ways = np.abs(change).max(axis=2)
                is_known = is_known & (sizes_of_ways <= DETERMINED_TOLERANCE).all(axis=1)
                is_held_once = is_held_once & (sizes_of_ways[:, is_shared] <= DETERMINED_TOLERANCE).all(axis=1)
            is_known = is_known if is_known.any() else is_held_once
            sizes = {
                name: np.maximum(np.hypot(*wrench.force.T), np.abs(wrench.moment) / arm)[is_known]
                for name, (wrench, _) in wrenches.items()
            }
            greatest = np.max([*sizes.values()], axis=0)
            # of a force that balances the load
            if is_known.any() and not np.any(greatest > NEGLIGIBLE_FORCE * (1.0 if self.slides else 1.0 / arm)):
                raise undriven_output(self.link)
            names = [name for name, size in sizes.items() if np.any(size > NEGLIGIBLE_FORCE * greatest)]
            through = (*(names or wrenches),)
        force, moment = (np.sum([wrenches[name][0][k] for name in through], axis=0) for k in range(2))
        # a force along one line may be of any size
        changes = np.sum([wrenches[name][1] for name in through], axis=0)
        across = np.abs(changes[..., 0] * force[:, None, 1] - changes[..., 1] * force[:, None, 0])
        size = np.hypot(*force.T)
        is_open = (across > DETERMINED_TOLERANCE * size[:, None]).any(axis=1) | (
            (size <= NEGLIGIBLE_FORCE) & (np.abs(changes).max(axis=(1, 2), initial=0.0) > DETERMINED_TOLERANCE)
        )
        force = np.where(is_open[:, None], np.nan, force)
        if not self.slides:
            self._check_line(reactions.field, through, Wrench(force, moment))
        angle = output_angle(reactions.field, (self.link, self.pair), through, [Vector(*force.T)])
        return through, np.where(solution.is_balanced, angle, 0.0)

    def _wrenches(self, reactions: ReactionSolver, solution: ForceSolution, name: str) -> tuple[Wrench, Array]:
        """What a pair, with an input there, does to the output, and how its force may change (n, ways, 2)."""
        count = reactions.position_count
        change: Array = np.zeros((count, 0, 2))
        wrench = Wrench(np.zeros((count, 2)), np.zeros(count))
        if name in solution.wrenches:
            wrench, change = solution.wrenches[name][self.link], solution.wrench_changes[name][self.link].force
        inputs = [k for k, given in enumerate(self.mechanism.inputs) if given.pair == name]
        for k in inputs:
            of_input, changes = reactions.input_wrench(self.link, k, solution)
            wrench = Wrench(wrench.force + of_input.force, wrench.moment + of_input.moment)
            change = changes.force if not change.shape[1] else change + changes.force
        return wrench, change

    def _check_line(self, field: KinematicArrays, names: tuple[str, ...], driving: Wrench) -> None:
        """Refuse what drives a turning output by more than a force at one point beside its fixed pin. Raises
        BadInput."""
        link, reason = self.link, ""
        places = {force_point(self.driving_pairs[name], link) for name in names}
        place = places.pop()
        if places:
            reason = f"{link} is driven at {join_all_names(names)}, not at one pin"
        elif place is None:
            reason = f"wheels drive {link}"
        else:
            at, fixed = (
                field.point_rates(body, field.shapes[body].position(point))
                for body, point in (place, fixed_pin(self.mechanism, self.pair))
            )
            couple = np.abs(driving.moment_about(at))
            if np.hypot(*(at - fixed).T).max() <= NEGLIGIBLE_FORCE * field.size:
                raise BadInput(link, f"{link} is driven at its fixed pin, about which no force turns it")
            # beside the torque of one that it balances
            if np.max(couple[np.isfinite(couple)], initial=0.0) > NEGLIGIBLE_FORCE:
                reason = f"at {join_all_names(names)} a couple drives {link} beside a force"
                raise BadInput(link, f"{reason}, so that no line of force through one pin tells a transmission angle")
        if reason:
            raise BadInput(link, f"{reason}, so that no one line of force with one pin tells a transmission angle")


def loaded_output(mechanism: Mechanism, pair: Pair) -> Mechanism:
    """The mechanism with weightless links under an effort of one at the output's pair."""
    load = Load(pair=pair.name, effort=1.0)
    return replace(mechanism, loads=(load,), masses=(), springs=(), gravity=(0.0, 0.0), published=())


def output_angle(
    links: LinkMotion, output: tuple[str, Pair], through: tuple[str, ...], forces: Iterable[Vector]
) -> Scalar:
    """The angle (rad) between the forces of the other moving links on the output, (link, pair), and its lever, or
    across its way; `through` are the names of the pairs by which they act."""
    parts = [*forces]
    force = Vector(sum(part.x for part in parts), sum(part.y for part in parts))
    direction = _output_direction(links, output, through[0])
    cross, dot = abs(direction.cross(force)), abs(direction.dot(force))
    return atan2(dot, cross) if output[1].input_kind is MeasureKind.LENGTH else atan2(cross, dot)


def _output_direction(links: LinkMotion, output: tuple[str, Pair], driving: str) -> Vector:
    """Along the slide, or from the fixed pin to where the force acts."""
    link, pair = output
    if pair.input_kind is MeasureKind.LENGTH:
        direction = links.relative_motions[pair.name].effort_action(links.frames, links.shapes).direction
        assert direction is not None
        return direction
    pairs = {each.name: each for each in links.mechanism.pairs}
    place = force_point(pairs.get(driving) or links.relative_motions[driving], link)
    assert place is not None
    members = place, fixed_pin(links.mechanism, pair)
    end, fixed = (links.place(name, links.shapes[name].position(point)) for name, point in members)
    return end - fixed


def fixed_pin(mechanism: Mechanism, pair: Pair) -> tuple[str, str]:
    """The (frame, point) about which an output turns."""
    return next(member for member in pair.coincident_points() if member[0] == mechanism.frame)


def can_drive(mechanism: Mechanism, pair: Pair, output: tuple[str, Pair]) -> bool:
    """Whether a pair may pass a force from another moving link to the output, (link, pair)."""
    link, output_pair = output
    others = [body for body in pair.bodies if body not in (link, mechanism.frame)]
    return link in pair.bodies and bool(others) and pair.entry_name() != output_pair.entry_name()


def undriven_output(link: str) -> BadInput:
    """The error for an output link that no other moving link drives."""
    return BadInput(
        link, f"no other moving link drives {link}: its transmission angle is that of a link the rest drives"
    )


def force_point(pair: Pair, link: str) -> tuple[str, str] | None:
    """The (link, point) where a pair's force on a link acts: of that link if it can be."""
    members = [member for member in pair.coincident_points() if member[0] == link]
    rides = pair.point_on_line()
    return members[0] if members else rides and rides[0]
