"""Six-bars for curves that no four-bar draws well: those of GCP-HOLO where a copy is named, and those by formula.

GCP-HOLO's authors and those of LInK (A. Heyrani Nobari and others, arXiv:2405.20592, 2024) compare curves after moving,
turning and scaling by the Chamfer distance; LInK states 28 times less error than GCP-HOLO in 20 times less time. Here
place, size and turn are as wanted and the metric is that of all this benchmark.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import process_time
from typing import Any, NamedTuple

import numpy as np

import planar
from benchmarks.synthesis import gcp_holo_data
from benchmarks.synthesis.judged import design_faults
from benchmarks.synthesis.misses import Misses, misses, path_of
from benchmarks.synthesis.shapes import Shape, shape, shapes

POINT, NEW_POINT = "E", "wanted"
"Of the model `four-bar`, and of a chain."
FOUR_BAR = "four-bar"
SIX_BARS = {
    "Stephenson III": (1, "Stephenson III six-bar"),
    "Watt I": (0, "Watt I six-bar"),
    "Stephenson II": (1, "Stephenson II six-bar"),
    "Stephenson I": (1, "Stephenson I six-bar"),
}
"""By name the number of the chain and what its mechanism is called."""
STRUCTURES = (FOUR_BAR, *SIX_BARS)
TIME = 300.0
"""Seconds after which nothing new is begun, shared by the starts of a kind."""


class ShapeResult(NamedTuple):
    """Of a curve and a structure: misses in % of the extent (none where no design is sound), processor seconds."""

    curve: str
    structure: str
    own: Misses | None
    seconds: float
    faults: tuple[str, ...]


def targets() -> Iterator[Shape]:
    """Every curve."""
    if gcp_holo_data.is_there():
        for name in gcp_holo_data.CURVES:
            curve = gcp_holo_data.read_curve(name)
            yield shape(f"GCP-HOLO: {name}", np.concatenate([curve, curve[:1]]), True)
    yield from shapes()


def six_bar_starts(name: str) -> Iterator[tuple[planar.Mechanism, str]]:
    """The mechanisms of a kind, one for each input and link that may carry the point, as that link's name."""
    number, kind = SIX_BARS[name]
    chain = planar.chains(6)[number]
    for each in chain.mechanisms():
        if each.name != kind:
            continue
        mechanism = chain.mechanism(each.frame, each.drives)
        beside = {link for pair in mechanism.pairs if mechanism.frame in pair.links for link in pair.links}
        for link in mechanism.links:
            if link.name not in beside:
                yield mechanism, link.name


def curve_task(target: Shape, start: object, carrier: str | None) -> dict[str, Any]:
    """The task of a curve; `carrier` is the link of a new point, left out where the start has the point."""
    wanted: dict[str, Any] = {"point": POINT, "through": target.places.tolist(), "in_order": True}
    if carrier is not None:  # a pin of the chain may have the letter
        wanted |= {"point": NEW_POINT, "on": carrier}
    if target.closed:
        wanted["closed"] = True
    units = {"length": "mm", "angle": "deg"}
    return {"planar": 1, "name": target.name, "units": units, "start": start, "wanted": [wanted]}


def measure(target: Shape, structure: str) -> ShapeResult:
    """The best four-bar, or the best six-bar of a kind with any input and any link that may carry the point."""
    if structure == FOUR_BAR:
        return _measure(target, structure, [curve_task(target, FOUR_BAR, None)])
    starts = six_bar_starts(structure)
    return _measure(target, structure, [curve_task(target, planar.to_dict(each), link) for each, link in starts])


def _measure(target: Shape, structure: str, tasks: list[dict[str, Any]]) -> ShapeResult:
    begun = process_time()
    searches = [planar.synthesise(task, many=1, timeout=TIME / len(tasks)) for task in tasks]
    seconds = process_time() - begun
    sound = [(found[0], task["wanted"][0]["point"]) for found, task in zip(searches, tasks, strict=True) if found]
    if not sound:
        return ShapeResult(target.name, structure, None, seconds, ())
    best, point = min(sound, key=lambda each: each[0].error)
    places = target.places * 1e-3
    faults = design_faults(best.mechanism, point, places, best.greatest_miss, target.closed)
    own = misses(path_of(planar.loads(planar.dumps(best.mechanism)), point), places)
    return ShapeResult(target.name, structure, own, seconds, tuple(faults))
