"""A linkage of a structure whose crank turns fully, where a search of stated extent finds one."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np

from planar.batch.mechanisms.results import Swept
from planar.batch.sweep_mechanisms import sweep_each
from planar.document.files import from_dict
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.model.wording import amount
from planar.solving.cycle import cycle
from planar.structures.linkage_dimensions import Linkage, candidate_places, crossings, linkage_document

ROUNDS, CANDIDATES = 16, 12
"""So many times so many linkages are tried, until the crank of one of them turns fully."""
STEPS = 72
LEAST_TURN = 0.02
"""Of a turn: the range that a linkage has at least that is taken where no crank turns fully."""


def find_linkage(linkage: Linkage, seed: int, name: str) -> Mechanism:
    """The mechanism of a structure with random dimensions (mm, whole or a tenth), the same for the same seed.

    In rounds of 12, sixteen at the most, linkages are drawn and run through a turn of the first input, the others at
    rest. Of those whose crank turns fully that one is taken whose joints go farthest for the greatest acceleration and
    whose bars cross least; else, of all, that which turns farthest, and its range is said in the mechanism's notes.
    """
    random = np.random.default_rng([seed, *linkage.drives, linkage.frame, *np.ravel(linkage.joints)])
    farthest: tuple[float, Mechanism] | None = None
    for _ in range(ROUNDS):
        places = candidate_places([linkage] * CANDIDATES, random)
        mechanisms = [from_dict(linkage_document(linkage, each, name)) for each in places]
        found = sweep_each(mechanisms, STEPS, pair=mechanisms[0].inputs[0].pair)
        whole = np.flatnonzero(found.whole).tolist()
        for k in sorted(whole, key=lambda j: -_merit(found[j], linkage, places[j])):
            if _range(mechanisms[k]) is None:
                return _with_note(mechanisms[k], "turns fully")
        shares = [float(np.mean(np.asarray(found[k].status) == 0)) for k in range(len(mechanisms))]
        best = int(np.argmax(shares))
        if farthest is None or shares[best] > farthest[0]:
            farthest = shares[best], mechanisms[best]
    assert farthest is not None
    low, high = _range(farthest[1]) or (0.0, 2.0 * pi)
    ends = " to ".join(amount(each, "angle", farthest[1].units) for each in (low, high))
    tried = ROUNDS * CANDIDATES
    return _with_note(farthest[1], f"turns from {ends}; of {tried} random linkages of this structure none turns fully")


def _range(mechanism: Mechanism) -> tuple[float, float] | None:
    """Between which positions the first input runs (rad); None for a whole turn."""
    motion = cycle(mechanism, STEPS, pair=mechanism.inputs[0].pair)
    at = motion.inputs[mechanism.inputs[0].pair].position
    low, high = float(at.min()), float(at.max())
    return None if high - low > 2.0 * pi * (1.0 - 1e-9) else (low, high)


def _merit(swept: Swept, linkage: Linkage, places: Array) -> float:
    """How far joints go on average, over the greatest acceleration at unit speed and by how often bars cross."""
    assert swept.acceleration is not None
    extents = [np.ptp(np.asarray(each), axis=0).max() for each in swept.position.values()]
    most = max(float(np.linalg.norm(each, axis=1).max()) for each in swept.acceleration.values())
    return float(np.mean(extents)) / most / (1.0 + crossings(linkage, places))


def _with_note(mechanism: Mechanism, said: str) -> Mechanism:
    return replace(mechanism, notes=(f"The link that {mechanism.inputs[0].pair} drives {said}.",))
