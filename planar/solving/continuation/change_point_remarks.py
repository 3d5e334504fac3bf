"""Remarks on change points that a motion passes, or comes near."""

from __future__ import annotations

from collections.abc import Sequence

from planar.model.wording import count_phrase, join_all_names
from planar.solving.continuation.path_pieces import PathBifurcation
from planar.solving.continuation.predictor_corrector import NearbyBifurcation
from planar.solving.prepared_mechanism import PreparedMechanism

REMARKED_DISTANCE = 1e-2
"""rad or sizes: a change point of a neighbouring linkage that is farther away is not worth a word."""
MAX_REMARKS = 12
"""Change points that are told one by one."""


def change_point_remarks(
    setup: PreparedMechanism, passed: Sequence[PathBifurcation], missed: Sequence[NearbyBifurcation]
) -> tuple[str, ...]:
    """What to say of change points on the way, and near it."""
    told: dict[str, None] = {}
    for each in passed:
        told[change_point_remark(setup, each)] = None
    for near in missed:
        if near.distance < REMARKED_DISTANCE:
            told[
                f"the motion comes within {near.distance:.1g} (rad, or lengths of the mechanism's size) of a change "
                f"point of a linkage that differs from this one by {near.residual * setup.unit:.1g} m"
            ] = None
    if len(told) > MAX_REMARKS:
        return (
            *list(told)[:MAX_REMARKS],
            f"and so on at {count_phrase(len(told) - MAX_REMARKS, 'more place')}; see the motion's limits",
        )
    return tuple(told)


def change_point_remark(setup: PreparedMechanism, passed: PathBifurcation) -> str:
    """What to say of a change point that a motion passes."""
    ways, more = len(passed.passed.bifurcation.branches), "" if passed.passed.bifurcation.is_complete else "at least "
    at = join_all_names(
        [
            setup.describe_input(g.pair, u)
            for g, u, w in zip(setup.mechanism.inputs, passed.u, passed.input_direction, strict=True)
            if w
        ]
    )
    if ways == 1 and not more:
        return f"at {at} there is one more motion to first order, but only this one goes on"
    asked = "the last that there is" if passed.passed.beyond else "as asked for"
    if passed.passed.is_start:
        number = f"this motion starts there by number {passed.passed.branch_index + 1}, {asked}"
        return f"at {at} {more}{count_phrase(max(ways, 2), 'branch', 'branches')} of the motion cross; {number}"
    on = "this one goes on smoothly" if passed.passed.branch_index == 0 else f"another one was taken, {asked}"
    return f"at {at} {more}{count_phrase(max(ways, 2), 'branch', 'branches')} of the motion cross; {on}"
