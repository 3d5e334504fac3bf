"""Linkages of pinned bars of which only those are wanted whose crank surely turns fully."""

from __future__ import annotations

from functools import partial

import numpy as np

from planar.batch.general_path import OUTCOMES
from planar.batch.mechanisms.linkages import SweepRequest
from planar.batch.mechanisms.results import Swept
from planar.batch.pinned.march import solve_pinned
from planar.batch.pinned.results import PinnedPart
from planar.batch.sweep_mechanisms import solve_partitioned
from planar.foundation.arrays import BoolArray
from planar.foundation.errors import Outcome
from planar.model.mechanism import Mechanism, named_points
from planar.model.pin_linkages import PinnedLinkages


def run_whole_turns(linkages: PinnedLinkages, steps: int) -> tuple[BoolArray, PinnedPart]:
    """Which linkages surely turn fully (linkages,), and their positions as `sweep_each` has them.

    What compiled code leaves open, most of it linkages that come to a dead point, is not looked at by the general path.
    """
    request = SweepRequest(steps, None, False, None)
    leave_open = partial(_leave_open, request=request)
    solve_blocks = partial(solve_partitioned, request=request, solve_general=_leave_open)
    part = solve_pinned(linkages, request, solve_blocks, leave_open)
    return np.asarray(part.last_status == 0), part


def _leave_open(mechanism: Mechanism, request: SweepRequest) -> Swept:
    """A run without positions."""
    names = [each.name for each in named_points(mechanism)]
    nothing = np.full((request.steps + 1, 2), np.nan)
    status = np.full(request.steps + 1, OUTCOMES.index(Outcome.DEAD_POINT), dtype=np.int8)
    return Swept(dict.fromkeys(names, nothing), None, None, np.full(request.steps + 1, np.nan), status, "", False)
