"""Where and why the mechanisms of one list end that have been run in blocks of links."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.linkage_groups import LinkageGroup, SweepRequest
from planar.batch.mechanisms.march import LinkageRuns
from planar.batch.stop_checks import find_first_stop
from planar.foundation.errors import Outcome
from planar.model.mechanism import running_input_index

Array = np.ndarray


class LinkageEnding(NamedTuple):
    """So many of the first fine steps are solved; why no more, and what there is to say of it."""

    solved_steps: int
    outcome: Outcome = Outcome.SOLVED
    reason: str = ""


def find_ending(  # many: what a mechanism is run by
    group: LinkageGroup, one: int, runs: LinkageRuns, run: int, places: Array, gone: Array, request: SweepRequest
) -> LinkageEnding | None:
    """How the mechanism `one` of a group ends by its `run` of the runs, whose input has gone so far (steps,); None
    where that is not sure. places (two a watched link, 2, steps)."""
    good = int(runs.good_steps[run])
    if group.watched[one] and good:
        mechanism, at = group.mechanisms[one], np.moveaxis(places[..., :good], 1, 2)
        pair = mechanism.inputs[running_input_index(mechanism, request.pair, "inputs")].pair
        found = {link: (at[2 * k], at[2 * k + 1]) for k, link in enumerate(group.watched[one])}
        unit, positions = float(group.arrays.unit[one]), group.start[one] + gone[:good]
        met = find_first_stop(mechanism, unit, pair, positions, found)
        if met is None or (met.step is None and good < len(gone)):
            return None  # beside a dead point it is not clear which comes first
        if met.step is not None:
            return LinkageEnding(met.step, Outcome.STOP, f"{met.reason}, {_where(group, one, gone, met.step)}")
    if good == len(gone):
        return LinkageEnding(good)
    if not runs.ends_in_dead_point[run]:
        return None
    links = group.links_of_block(int(runs.dead_point_block[run]))
    told = f"links {links} come to a dead point {_where(group, one, gone, good)}"
    return LinkageEnding(good, Outcome.DEAD_POINT, told)


def _where(group: LinkageGroup, one: int, gone: Array, step: int) -> str:
    """Between which inputs a step ends."""
    before, after = group.start[one] + gone[[max(step - 1, 0), step]]
    return f"at an input of {before:.6g} to {after:.6g} rad"
