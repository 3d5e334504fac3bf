"""A linkage of a structure whose crank turns fully, or whose slide goes about as far as it is large: by a search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import log, pi

import numpy as np

from planar.batch.mechanisms.results import Swept
from planar.batch.sweep_mechanisms import sweep_each
from planar.document.files import from_dict
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.model.mechanism import Mechanism
from planar.model.wording import amount
from planar.solving.cycle import cycle
from planar.structures.linkage_dimensions import (
    LENGTH,
    Linkage,
    candidate_places,
    candidate_ways,
    crossings,
    linkage_document,
)

ROUNDS, SLIDING_ROUNDS, CANDIDATES = 16, 4, 12
"""So many times so many linkages are tried, until the crank of one of them turns fully; fewer times with slides."""
STEPS = 72
STROKE = 1e-3 * LENGTH
"""m that a driven slide had best go."""


def find_linkage(linkage: Linkage, seed: int, name: str) -> Mechanism:
    """The mechanism of a structure with random dimensions (mm, whole or a tenth), the same for the same seed.

    In rounds of 12, sixteen at the most (four with slides), linkages are drawn and run through a turn of the first
    input, the others at rest. Of those whose crank turns fully that one is taken whose joints go farthest for the
    greatest acceleration and whose bars cross least; else, of all, that which turns farthest, and its range is said in
    the mechanism's notes. Where a slide is driven, that of one round is taken whose stroke is nearest to 400 mm.
    """
    random = np.random.default_rng(
        [seed, *linkage.drives, linkage.frame, *(link for links in linkage.joints for link in links), *linkage.slides]
    )
    if linkage.drives[0] in linkage.slides:
        return _with_a_stroke(_candidates(linkage, random, name)[0])
    farthest: tuple[float, Mechanism] | None = None
    rounds = SLIDING_ROUNDS if linkage.slides else ROUNDS
    for _ in range(rounds):
        mechanisms, places = _candidates(linkage, random, name)
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
    tried = rounds * CANDIDATES
    return _with_note(farthest[1], f"turns from {ends}; of {tried} random linkages of this structure none turns fully")


def _candidates(linkage: Linkage, random: np.random.Generator, name: str) -> tuple[list[Mechanism], Array]:
    """Random linkages of a structure, and where their joints stand."""
    places = candidate_places([linkage] * CANDIDATES, random)
    ways = candidate_ways(linkage, CANDIDATES, random)
    documents = (linkage_document(linkage, at, name, along) for at, along in zip(places, ways, strict=True))
    return [from_dict(each) for each in documents], places


def _with_a_stroke(mechanisms: Sequence[Mechanism]) -> Mechanism:
    """That one of mechanisms whose driven slide goes about as far as they are large, or on and on."""
    strokes = []
    for each in mechanisms:
        try:
            motion = cycle(each, STEPS, pair=each.inputs[0].pair)
        except NoAnswer:
            continue
        except BadInput:  # nothing is wrong with it but that its slide has no limits
            return _with_note(each, "slides without a limit")
        at = motion.inputs[each.inputs[0].pair].position
        if np.ptp(at) > 0.0:
            strokes.append((float(at.min()), float(at.max()), each))
    if not strokes:
        raise NoAnswer(
            Outcome.DEAD_POINT, f"of {len(mechanisms)} random linkages of this structure none moves; try another 'seed'"
        )
    low, high, chosen = min(strokes, key=lambda each: abs(log((each[1] - each[0]) / STROKE)))
    told = " to ".join(amount(each, "length", chosen.units) for each in (low, high))
    return _with_note(chosen, f"slides from {told}")


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
