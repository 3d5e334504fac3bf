"""What inputs supply and pairs carry, told at their places; not a number where equilibrium does not tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.dynamics.external_actions import Field
from planar.dynamics.multipliers import Reactions, Solved
from planar.model.pairs import Pair
from planar.model.wording import listed

Array = np.ndarray

SHARED = 1e-7
"""What a force of one held otherwise changes by more than this is not determined."""
ROUNDED = 1e-13
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


def efforts(solved: Solved) -> tuple[Array, list[str]]:
    """What the inputs supply (n, inputs), and of each why it is not told."""
    found, whys = solved.efforts.copy(), []
    for k in range(found.shape[1]):
        change = solved.efforts_change[:, k]
        found[:, k] = np.where(_still(change) & solved.balanced, found[:, k], np.nan)
        whys.append(_why(solved, [change]))
    return found, whys


def reaction(pair: Pair, field: Field, reactions: Reactions, solved: Solved) -> Reaction:
    """What a pair does at every position."""
    wrenches, changes = solved.wrenches[pair.name], solved.changes[pair.name]
    second, arm = pair.links[1], reactions.arm
    at = _place(pair, field, reactions)
    if at is None:
        couples = {
            link: np.where(_still(changes[link].moment / arm) & solved.balanced, wrench.moment, np.nan)
            for link, wrench in wrenches.items()
        }
        why = _why(solved, [each.moment / arm for each in changes.values()])
        return Reaction(pair.links, None, np.full((field.many, 2), np.nan), couples[second], couples, why)
    wrench, change = wrenches[second], changes[second]
    couple, turned = wrench.about(at), change.about(at[:, None]) / arm
    pushed = np.hypot(change.force[..., 0], change.force[..., 1])
    couple = np.where(np.abs(couple) <= ROUNDED * arm * np.hypot(*wrench.force.T), 0.0, couple)
    force = np.where((_still(pushed) & solved.balanced)[:, None], wrench.force, np.nan)
    couple = np.where(_still(turned) & solved.balanced, couple, np.nan)
    return Reaction(pair.links, at, force, couple, {}, _why(solved, [pushed, turned]))


def _place(pair: Pair, field: Field, reactions: Reactions) -> Array | None:
    """Where a pair's force is told (n, 2): its pin, the point that rides on its line, where teeth touch."""
    contact = reactions.contacts.get(pair.name)
    if contact is not None:
        return np.stack(np.broadcast_arrays(*contact.at, np.zeros(field.many))[:2], axis=-1)
    end = borne(pair)
    return field.at(end[0], field.shapes[end[0]].at(end[1])) if end is not None else None


def borne(pair: Pair) -> tuple[str, str] | None:
    """The (link, point) at which a pair without teeth bears; None where it joins its links at no place."""
    rides = pair.rides()
    return next(iter(pair.coincident()[1:] or ((rides[0],) if rides else ())), None)


def _still(changes: Array) -> Array:
    """Where no way to hold the links otherwise changes something (n,), of its changes (n, ways)."""
    return np.abs(changes).max(axis=1, initial=0.0) <= SHARED


def _why(solved: Solved, changes: Sequence[Array]) -> str:
    """Why something is not told, from its changes (n, ways) each; empty where it is."""
    moved = np.max([np.abs(each[solved.balanced]).max(axis=0, initial=0.0) for each in changes], axis=0)
    because = dict.fromkeys(name for name, most in zip(solved.because, moved, strict=True) if most > SHARED)
    told = []
    if "" in because:
        told.append("the links are held more than once, and rigid bodies do not tell how they share it")
    names = [repr(name) for name in because if name]
    if names:
        told.append(f"what {listed(names)} put{'s' * (len(names) == 1)} on it is not known: only the couples are")
    if not solved.balanced.all():
        told.append("no forces in the pairs balance the links there, as at a dead point")
    return "; ".join(told)
