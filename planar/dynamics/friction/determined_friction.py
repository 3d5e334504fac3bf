"""What is said of mechanisms whose friction cannot be told."""

from __future__ import annotations

import numpy as np

from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.friction.contact_rows import ContactRows
from planar.dynamics.reaction_solver import fill_balance
from planar.foundation.errors import BadInput
from planar.model.wording import quote_names
from planar.results.motion import State


def check_determined_friction(state: State) -> None:
    """Raise BadInput where the forces that friction follows are not determined, as links are held more than once."""
    if not any(pair.has_friction for pair in state.mechanism.pairs):
        return
    field = KinematicArrays(state)
    rows = ContactRows(fill_balance(field, np.zeros(1), inertia=False), field)
    if not rows.is_determined().all():
        raise BadInput(
            "pairs",
            f"what friction at {quote_names(rows.rubbing_pairs)} follows is not determined, as links are held more "
            "than once, or only couples of wheels are known; leave out what holds them twice, or the friction",
        )
