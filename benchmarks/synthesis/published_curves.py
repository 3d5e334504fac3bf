"""Four-bars for published curves beside the published four-bars, both from the same places in the same metric."""

from __future__ import annotations

from collections.abc import Iterator
from time import process_time
from typing import NamedTuple

import numpy as np

import planar
from benchmarks.synthesis import four_bar_data as data
from benchmarks.synthesis.judged import design_faults
from benchmarks.synthesis.misses import Array, Misses, misses, path_of

CURVES = {
    "mcgarva.closed": "McGarva 1994",
    "yu1.closed": "Yu, Tang, Wang 2007, 1",
    "yu2.closed": "Yu, Tang, Wang 2007, 2",
    "mkh1.closed": "Bulatovic et al. 2016, 1",
    "mkh2.closed": "Bulatovic et al. 2016, 2",
    "mkh3.closed": "Bulatovic et al. 2016, 3",
    "ullah.closed": "Ullah, Kota 1997",
    "wu3.partial": "Wu et al. 2011, 3 (open)",
}
"""Curves of which places are published, each with a published linkage."""
PLACES_ALONE = {
    "triangle.closed": "Hernandez et al. 2021, a triangle",
    "slice.open": "slice (open)",
    "straight-line.open": "straight line (open)",
}
"""Places without a published linkage."""
PATHS = {
    "cusp.closed": ("Hsieh 2017, cusp", True),
    "wu1.closed": ("Wu et al. 2011, 1", True),
    "sharp.open": ("Hsieh 2017, sharp (open)", True),
    "c-shape.partial": ("Hsieh 2017, c-shape (open)", True),
    "c-shape-1.open": ("Hsieh 2017, c-shape 1 (open)", False),
    "crunode.closed": ("crunode", False),
    "heart.closed": ("heart", False),
    "khan1.closed": ("Khan et al. 2015, 1", False),
    "khan2.closed": ("Khan et al. 2015, 2", False),
    "wu2.open": ("Wu et al. 2011, 2 (open)", False),
    "throm.open": ("throm (open)", False),
}
"""Linkages whose own path is the target, and whether another linkage is published for it. Left out are those that pass
change points: which way they go there is not told."""
PLACES = 30
ROUNDED = 3
"""Digits of the places of a path."""
START_EXTENT = 100.0
"""mm; tasks are shown in such a size."""


class CurveResult(NamedTuple):
    """Misses in % of the places' extent: of the published linkage, where there is one, and of the best design found.

    `seconds` are of the processor, on one core.
    """

    name: str
    places: int
    published: Misses | None
    own: Misses | None
    seconds: float
    faults: tuple[str, ...]


def targets() -> Iterator[tuple[str, Array, bool, data.Parameters | None]]:
    """Each target: name, places (n, 2), whether they go round, and the published linkage."""
    for file, name in CURVES.items():
        yield name, data.read_curve(file), file.endswith("closed"), data.read_parameters(file)
    for file, name in PLACES_ALONE.items():
        yield name, data.read_curve(file), file.endswith("closed"), None
    for file, (name, published) in PATHS.items():
        places = np.round(data.path_target(data.read_parameters(file, False), PLACES), ROUNDED)
        yield name, places, file.endswith("closed"), data.read_parameters(file) if published else None


def published_misses(places: Array, parameters: data.Parameters) -> Misses:
    """Of a published linkage, from the places in its own unit."""
    return misses(path_of(data.four_bar(parameters, "m"), data.POINT), places)


def measure(name: str, places: Array, closed: bool, parameters: data.Parameters | None) -> CurveResult:
    """A target searched with the model `four-bar`, and judged from the file of the best design."""
    shown = places * (START_EXTENT / float(np.ptp(places, axis=0).max()))
    begun = process_time()
    found = planar.synthesise(path_task(name, shown, closed, "four-bar"), many=3)
    seconds = process_time() - begun
    published = None if parameters is None else published_misses(places, parameters)
    if not found:
        return CurveResult(name, len(places), published, None, seconds, ())
    own, faults = judged_misses(found[0], data.POINT, shown * 1e-3, closed)
    return CurveResult(name, len(places), published, own, seconds, faults)


def judged_misses(
    design: planar.SynthesisedDesign, point: str, places: Array, closed: bool
) -> tuple[Misses, tuple[str, ...]]:
    """The misses of a design from places (n, 2) in m, and its faults, both from its file."""
    faults = design_faults(design.mechanism, point, places, design.greatest_miss, closed)
    return misses(path_of(planar.loads(planar.dumps(design.mechanism)), point), places), tuple(faults)


def path_task(name: str, places: Array, closed: bool, start: object) -> dict[str, object]:
    """A task's file value: places (n, 2) in mm, one after the other."""
    wanted: dict[str, object] = {"point": data.POINT, "through": places.tolist(), "in_order": True}
    if closed:
        wanted["closed"] = True
    return {"planar": 1, "name": name, "units": {"length": "mm", "angle": "deg"}, "start": start, "wanted": [wanted]}
