"""Reactions at pairs and efforts of inputs as results: NaN, and why, where equilibrium does not determine them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.reaction_solver import ForceSolution, ReactionSolver
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.short_repr import short_repr
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism
from planar.model.pairs import Pair
from planar.model.wording import join_all_names

DETERMINED_TOLERANCE = 1e-7
"""What a force of one held otherwise changes by more than this is not determined."""
ZERO_COUPLE_TOLERANCE = 1e-13
"""A couple below this part of a pair's force at an arm of the mechanism's size is none."""


class Reaction(NamedTuple):
    """What a pair does to its second link; the first feels the opposite.

    `force` (2,), N, at the place `at` (2,), m, and a `couple`, N m; over a motion each with a first axis for its
    positions. What equilibrium does not tell is NaN, and `why` says why. Of a pair that ties angles through a carrier,
    and whose forces have no place, `couples` are those on all its links.
    """

    links: tuple[str, str]
    at: Array | None
    force: Array
    couple: Array | float
    couples: Mapping[str, Array | float]
    why: str

    def __repr__(self) -> str:
        return short_repr(self)


class FixedWheel(NamedTuple):
    """The torque that holds a wheel of the frame: what the foundation exerts on it, anticlockwise, N m.

    About its `centre` (2,), m, which is None where the file does not place it (the torque is a couple then). `shares`
    are the parts of the `torque` by the gear, belt and rack pairs of the wheel. Over a motion torques are (n,); a
    torque that equilibrium does not determine is NaN.
    """

    centre: Array | None
    torque: Array | float
    shares: Mapping[str, Array | float]

    def __repr__(self) -> str:
        return short_repr(self)


def fixed_wheels(
    mechanism: Mechanism, shapes: Mapping[str, LinkShape], reactions: Mapping[str, Reaction]
) -> dict[str, FixedWheel]:
    """The holding torques of the wheels that belong to the frame, as the annulus of an epicyclic train.

    By the frame's point at the centre; of a wheel without a known centre by the name of its pair. Wheels about one
    centre are held together.
    """
    frame, shape = mechanism.frame, shapes[mechanism.frame]
    wheels: dict[str, FixedWheel] = {}
    for pair in mechanism.pairs:
        centres = pair.wheel_centres(mechanism.pairs)
        if frame not in centres:
            continue
        point, reaction = centres[frame], reactions[pair.name]
        # the axes of the frame are those of the world
        centre = None if point is None else np.array([*shape.position(point)], dtype=float)
        if reaction.at is None:
            moment = reaction.couples[frame]
        elif centre is None:
            continue
        else:
            arm = reaction.at - centre
            force = reaction.force
            on_second = arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0] + reaction.couple
            moment = on_second if reaction.links[1] == frame else -on_second
        key = pair.name if point is None else point
        previous = wheels.get(key, FixedWheel(centre, 0.0, {}))
        wheels[key] = FixedWheel(centre, previous.torque - moment, {**previous.shares, pair.name: -moment})
    return wheels


def input_efforts(solved: ForceSolution) -> tuple[Array, list[str]]:
    """What the inputs supply (n, inputs), and of each why it is not told."""
    found, whys = solved.efforts.copy(), []
    for k in range(found.shape[1]):
        change = solved.effort_changes[:, k]
        found[:, k] = np.where(_is_determined(change) & solved.is_balanced, found[:, k], np.nan)
        whys.append(_explain_undetermined(solved, [change]))
    return found, whys


def pair_reaction(pair: Pair, field: KinematicArrays, reactions: ReactionSolver, solved: ForceSolution) -> Reaction:
    """What a pair does at every position."""
    wrenches, changes = solved.wrenches[pair.name], solved.wrench_changes[pair.name]
    second, arm = pair.links[1], reactions.arm
    at = reactions.reaction_point(pair)
    if at is None:
        couples = {
            link: np.where(_is_determined(changes[link].moment / arm) & solved.is_balanced, wrench.moment, np.nan)
            for link, wrench in wrenches.items()
        }
        why = _explain_undetermined(solved, [each.moment / arm for each in changes.values()])
        return Reaction(pair.links, None, np.full((field.position_count, 2), np.nan), couples[second], couples, why)
    wrench, change = wrenches[second], changes[second]
    couple, turned = wrench.moment_about(at), change.moment_about(at[:, None]) / arm
    pushed = np.hypot(change.force[..., 0], change.force[..., 1])
    couple = np.where(np.abs(couple) <= ZERO_COUPLE_TOLERANCE * arm * np.hypot(*wrench.force.T), 0.0, couple)
    force = np.where((_is_determined(pushed) & solved.is_balanced)[:, None], wrench.force, np.nan)
    couple = np.where(_is_determined(turned) & solved.is_balanced, couple, np.nan)
    return Reaction(pair.links, at, force, couple, {}, _explain_undetermined(solved, [pushed, turned]))


def _is_determined(changes: Array) -> BoolArray:
    """Where no way to hold the links otherwise changes something (n,), of its changes (n, ways)."""
    return np.abs(changes).max(axis=1, initial=0.0) <= DETERMINED_TOLERANCE


def _explain_undetermined(solved: ForceSolution, changes: Sequence[Array]) -> str:
    """Why something is not told, from its changes (n, ways) each; empty where it is."""
    moved = np.max([np.abs(each[solved.is_balanced]).max(axis=0, initial=0.0) for each in changes], axis=0)
    because = dict.fromkeys(
        name for name, most in zip(solved.causes, moved, strict=True) if most > DETERMINED_TOLERANCE
    )
    told = []
    if "" in because:
        told.append("the links are held more than once, and rigid bodies do not tell how they share it")
    names = [repr(name) for name in because if name]
    if names:
        told.append(
            f"what {join_all_names(names)} put{'s' * (len(names) == 1)} on it is not known: only the couples are"
        )
    if not solved.is_balanced.all():
        told.append(solved.imbalance)
    return "; ".join(told)
