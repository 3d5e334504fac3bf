"""The transmission angle of an output link by the balance of a load on that link alone; see `planar.transmission`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from planar.dynamics.external_actions import LinkMotion
from planar.dynamics.reaction_solver import ForceSolution, ReactionSolver
from planar.dynamics.reactions import DETERMINED_TOLERANCE
from planar.dynamics.sharing.least_work import Wrench
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar, atan2
from planar.model.loads import Load
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.output_pair import find_output_pair
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import join_all_names

NEGLIGIBLE_FORCE = 1e-7
"""A force below this part of the greatest on the output, or a moment below this part at an arm of the size, is zero."""


class OutputLink:
    """An output link, with the pairs and inputs by which other moving links may drive it. Raises Unknown, BadInput.

    Inputs hold still, links are weightless, and the output alone is loaded, in `mechanism`.
    """

    def __init__(self, mechanism: Mechanism, output: str):
        self.link, self.pair = find_output_pair(mechanism, output)
        self.mechanism = loaded_output(mechanism, self.pair)
        self.slides = self.pair.input_kind is MeasureKind.LENGTH
        motions = relative_motions(mechanism)
        candidates = [*mechanism.pairs, *(motions[driven.pair] for driven in mechanism.inputs)]
        self.driving_pairs = {pair.name: pair for pair in candidates if self._can_drive(pair)}
        if not self.driving_pairs:
            raise self._undriven_output()

    def _can_drive(self, pair: Pair) -> bool:
        """Whether a pair may pass a force from another moving link to the output."""
        others = [body for body in pair.bodies if body not in (self.link, self.mechanism.frame)]
        return self.link in pair.bodies and bool(others) and pair.entry_name() != self.pair.entry_name()

    def _undriven_output(self) -> BadInput:
        reason = f"no other moving link drives {self.link}: its transmission angle is that of a link the rest drives"
        return BadInput(self.link, reason)

    def angles(self, reactions: ReactionSolver, through: tuple[str, ...] = ()) -> tuple[tuple[str, ...], Array]:
        """The pairs that drive the output, if they are not given, and the angle (rad, 0 to pi/2) at all positions (n,).

        `reactions` are of positions of `mechanism`. The angle is 0 where nothing balances the load, and NaN where the
        force is not determined.
        """
        solution = reactions.solve()
        wrenches = {name: self._wrenches(name, reactions, solution) for name in self.driving_pairs}
        names = through or self._driving_names(reactions, solution, wrenches)
        force = np.sum([wrenches[name][0].force for name in names], axis=0)[:, 0]
        moment = np.sum([wrenches[name][0].moment for name in names], axis=0)[:, 0]
        changes = [_largest_change(wrenches[name][1]) for name in names]
        is_determined = np.max(changes, axis=0) <= DETERMINED_TOLERANCE
        force = np.where(is_determined[:, None], force, np.nan)
        if not self.slides:
            self._check_line(reactions, names, Wrench(force, moment), solution.is_balanced)
        angle = output_angle(reactions.field, (self.link, self.pair), names, [Vector(*force.T)])
        return names, np.where(solution.is_balanced, angle, 0.0)

    def _wrenches(self, name: str, reactions: ReactionSolver, solution: ForceSolution) -> tuple[Wrench, Wrench]:
        """What a pair or an input, or both, do to the output (n, 1), and how else they may be (n, ways)."""
        parts: list[tuple[Wrench, Wrench]] = []
        if name in reactions.pairs:
            wrench = solution.wrenches[name][self.link]
            wrench = Wrench(wrench.force[:, None], wrench.moment[:, None])
            parts.append((wrench, solution.wrench_changes[name][self.link]))
        for index, driven in enumerate(self.mechanism.inputs):
            if driven.pair == name:
                efforts = solution.efforts[:, index, None], solution.effort_changes[:, index]
                wrench, change = (reactions.input_wrench(index, self.link, effort) for effort in efforts)
                parts.append((wrench, change))
        wrench, change = (
            Wrench(sum(part.force for part in column), sum(part.moment for part in column))
            for column in zip(*parts, strict=True)
        )
        return wrench, change

    def _driving_names(
        self, reactions: ReactionSolver, solution: ForceSolution, wrenches: dict[str, tuple[Wrench, Wrench]]
    ) -> tuple[str, ...]:
        """The pairs that drive the output where the forces are determined; if that is nowhere, all that may."""
        arm = reactions.arm
        unit = 1.0 if self.slides else 1.0 / arm  # of a force that balances the load
        sizes, is_determined = {}, solution.is_balanced.copy()
        for name, (wrench, change) in wrenches.items():
            sizes[name] = np.maximum(np.hypot(*wrench.force[:, 0].T), np.abs(wrench.moment[:, 0]) / arm)
            is_determined &= _largest_change(change) <= DETERMINED_TOLERANCE
        least = NEGLIGIBLE_FORCE * np.max([*sizes.values(), np.full(reactions.position_count, unit)], axis=0)
        driving = tuple(name for name, size in sizes.items() if np.any((size > least)[is_determined]))
        if not driving and is_determined.any():
            raise self._undriven_output()
        return driving or tuple(wrenches)

    def _check_line(
        self, reactions: ReactionSolver, names: tuple[str, ...], driving: Wrench, is_balanced: BoolArray
    ) -> None:
        """Refuse what drives a turning output by more than a force at one point. Raises BadInput."""
        places = {_force_point(self.driving_pairs[name], self.link) for name in names}
        place = places.pop()
        if places or place is None:
            reason = (
                f"{self.link} is driven at {join_all_names(names)}, not at one pin"
                if places
                else f"wheels drive {self.link}"
            )
            raise BadInput(self.link, f"{reason}, so that no one line of force with one pin tells a transmission angle")
        field = reactions.field
        point = field.point_rates(place[0], field.shapes[place[0]].position(place[1]))
        couple = np.abs(driving.moment_about(point))[is_balanced]
        # beside the torque of one that it balances
        if np.max(couple[np.isfinite(couple)], initial=0.0) > NEGLIGIBLE_FORCE:
            reason = f"at {join_all_names(names)} a couple drives {self.link} beside a force"
            raise BadInput(self.link, f"{reason}, so that no line of force through one pin tells a transmission angle")
        lever = np.hypot(*_output_direction(field, (self.link, self.pair), names[0]))
        if np.max(lever) <= NEGLIGIBLE_FORCE * reactions.arm:
            raise BadInput(self.link, f"{self.link} is driven at its fixed pin, about which no force turns it")


def _largest_change(change: Wrench) -> Array:
    """The largest component of forces (n, ways) at every position (n,)."""
    largest: Array = np.abs(change.force).max(axis=(1, 2), initial=0.0)
    return largest


def loaded_output(mechanism: Mechanism, pair: Pair) -> Mechanism:
    """The mechanism with weightless links under an effort of one at the output's pair."""
    load = Load(pair=pair.name, effort=1.0)
    return replace(mechanism, loads=(load,), masses=(), springs=(), gravity=(0.0, 0.0), published=())


def output_angle(
    links: LinkMotion, output: tuple[str, Pair], through: tuple[str, ...], forces: Iterable[Vector]
) -> Scalar:
    """The angle (rad) between the forces of the other moving links on the output, (link, pair), and its lever, or
    across its way; `through` are the pairs by which they act."""
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
    place = _force_point(links.relative_motions[driving], link)
    pin = next(member for member in pair.coincident_points() if member[0] == links.mechanism.frame)
    assert place is not None
    end, fixed = (links.place(name, links.shapes[name].position(point)) for name, point in (place, pin))
    return end - fixed


def _force_point(pair: Pair, link: str) -> tuple[str, str] | None:
    """The (link, point) where a pair's force on a link acts: of that link if it can be."""
    members = [member for member in pair.coincident_points() if member[0] == link]
    rides = pair.point_on_line()
    return members[0] if members else rides and rides[0]
