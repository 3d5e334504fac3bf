"""Every link as a free body: whether the forces and couples on it balance.

Nothing here comes from the equations that were solved: places, velocities and accelerations are those of the solved
position, and forces those that are printed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from planar.dynamics.external_actions import ExternalAction, KinematicArrays
from planar.dynamics.reactions import Reaction
from planar.foundation.arrays import Array


def free_body_imbalance(
    field: KinematicArrays, acting: Sequence[ExternalAction], reactions: Mapping[str, Reaction], arm: float
) -> tuple[float | None, tuple[str, ...]]:
    """The worst force or moment (at an arm, m) that a link is left with, beside the greatest force on any of them.

    And the links of which that was told; those that feel what is not determined are not among them. None where nothing
    acts, or nothing is told.
    """
    worst, greatest, links = 0.0, 0.0, []
    forces_on: dict[str, list[Array]] = {link: [] for link in field.moving.frames if link != field.mechanism.frame}
    for each in acting:
        if each.link in forces_on:
            forces_on[each.link].append(force_and_moment(each.at, each.force, each.couple))
    for pair in reactions.values():
        for link in {*pair.links, *pair.couples} & forces_on.keys():
            forces_on[link] += pair_actions_on(link, pair, field.position_count)
    for link, forces in forces_on.items():
        rows = np.array(forces).reshape(-1, field.position_count, 3) / np.array([1.0, 1.0, arm])
        told = np.isfinite(rows).all(axis=(0, 2))
        if not told.any():
            continue
        links.append(link)
        worst = max(worst, float(np.abs(rows[:, told].sum(axis=0)).max(initial=0.0)))
        greatest = max(greatest, float(np.abs(rows[:, told]).max(initial=0.0)))
    return (worst / greatest if greatest else None), tuple(links)


def pair_actions_on(link: str, pair: Reaction, many: int) -> list[Array]:
    """What a pair does to a link, of which it has the opposite on its first link."""
    if pair.couples:
        none = np.zeros((many, 2))
        return [force_and_moment(none, none, pair.couples[link])] if link in pair.couples else []
    if link not in pair.links or pair.at is None:
        return []
    sense = 1.0 if link == pair.links[1] else -1.0
    return [sense * force_and_moment(pair.at, pair.force, pair.couple)]


def force_and_moment(at: Array, force: Array, couple: Array | float) -> Array:
    """A force and a couple as (n, 3): force, and moment about the world's origin."""
    moment = at[:, 0] * force[:, 1] - at[:, 1] * force[:, 0] + couple
    return np.concatenate([force, np.reshape(moment, (-1, 1))], axis=1)
