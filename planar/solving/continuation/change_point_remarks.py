"""What is to be said of change points that a motion passes, or comes near."""

from __future__ import annotations

from collections.abc import Sequence

from planar.model.wording import listed, many
from planar.solving.continuation.path_pieces import Met
from planar.solving.continuation.predictor_corrector import Missed
from planar.solving.prepared_mechanism import Setup

NEARBY = 1e-2
"""rad or sizes: a change point of a neighbouring linkage that is farther away is not worth a word."""
MOST = 12
"""Change points that are told one by one."""


def on_the_way(setup: Setup, met: Sequence[Met], missed: Sequence[Missed]) -> tuple[str, ...]:
    """What to say of change points on the way, and near it."""
    told: dict[str, None] = {}
    for each in met:
        told[crossed(setup, each)] = None
    for each in missed:
        if each.distance < NEARBY:
            told[
                f"the motion comes within {each.distance:.1g} (rad, or lengths of the mechanism's size) of a change "
                f"point of a linkage that differs from this one by {each.open * setup.unit:.1g} m"
            ] = None
    if len(told) > MOST:
        return (*list(told)[:MOST], f"and so on at {many(len(told) - MOST, 'more place')}; see the motion's limits")
    return tuple(told)


def crossed(setup: Setup, met: Met) -> str:
    """What to say of a change point that a motion passes."""
    ways, more = len(met.passed.crossing.ways), "" if met.passed.crossing.whole else "at least "
    at = listed([setup.told(g.pair, u) for g, u, w in zip(setup.mechanism.inputs, met.u, met.way, strict=True) if w])
    if ways == 1 and not more:
        return f"at {at} there is one more motion to first order, but only this one goes on"
    asked = "the last that there is" if met.passed.beyond else "as asked for"
    if met.passed.starts:
        number = f"this motion starts there by number {met.passed.went + 1}, {asked}"
        return f"at {at} {more}{many(max(ways, 2), 'branch', 'branches')} of the motion cross; {number}"
    on = "this one goes on smoothly" if met.passed.went == 0 else f"another one was taken, {asked}"
    return f"at {at} {more}{many(max(ways, 2), 'branch', 'branches')} of the motion cross; {on}"
