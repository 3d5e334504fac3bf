"""Structures at random: chains of four, six and eight links with slides, and chains of freedom 2 that gears close."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import planar

RATIOS = (-3.0, -2.0, -1.5, -1.0, -0.5, 0.5, 1.0, 2.0, 3.0)
GEARED_SHARE = 0.25
MOST_SLIDES = {4: 2, 6: 2, 8: 1}


class Structure(NamedTuple):
    """A structure with the link that carries the wanted point; `linkage` makes one with the dimensions of a seed."""

    name: str
    linkage: Callable[[int], planar.Mechanism]
    carrier: str


def random_structure(links: int, rng: np.random.Generator) -> Structure:
    """One of so many links; with gears one link more, the gears' own constraint taking the second freedom."""
    geared = float(rng.random()) < GEARED_SHARE and links < 8
    slides = 0 if geared else int(rng.integers(0, MOST_SLIDES[links] + 1))
    found = planar.chains(links + 1, freedom=2) if geared else planar.chains(links, slides=slides)
    while True:
        chain = found[int(rng.integers(len(found)))]
        kinds = chain.mechanisms()
        kind = kinds[int(rng.integers(len(kinds)))]
        ratio = float(rng.choice(RATIOS))
        structure = _structure(chain, kind, ratio if geared else None)
        carriers = [] if structure is None else carrier_links(structure(0))
        if structure is None or not carriers:
            continue
        name = f"{kind.name or f'{links}-link chain {chain.number}'}"
        name += f", geared {ratio:g}" if geared else f", {slides} slides" if slides else ""
        return Structure(name, structure, str(rng.choice(carriers)))


def _structure(
    chain: planar.Chain, kind: planar.ChainMechanism, ratio: float | None
) -> Callable[[int], planar.Mechanism] | None:
    if ratio is None:
        return lambda seed: chain.mechanism(kind.frame, kind.drives, seed)
    sample = chain.mechanism(kind.frame, kind.drives, 0)
    pins = {pair.name: pair for pair in sample.pairs}
    if any(sample.frame not in pins[each.pair].links for each in sample.inputs):
        return None
    return lambda seed: geared(chain.mechanism(kind.frame, kind.drives, seed), ratio)


def geared(mechanism: planar.Mechanism, ratio: float) -> planar.Mechanism:
    """A mechanism of two inputs at the frame with gears of this ratio between its driven links, as they stand."""
    value: dict[str, Any] = planar.to_dict(mechanism)
    first, second = mechanism.inputs
    pairs = {pair.name: pair for pair in mechanism.pairs}
    links = [next(link for link in pairs[each.pair].links if link != mechanism.frame) for each in (first, second)]
    mesh = {link: f"{each.position} rad" for link, each in zip(links, (first, second), strict=True)}
    value["pairs"] = [*value["pairs"], {"gear": "wheels", "links": links, "ratio": ratio, "mesh": mesh}]
    value["inputs"] = value["inputs"][:1]
    value.pop("notes", None)
    return planar.from_dict(value)


def carrier_links(mechanism: planar.Mechanism) -> list[str]:
    """The links that do not turn or slide on the frame: their points describe curves."""
    beside = {link for pair in mechanism.pairs if mechanism.frame in pair.links for link in pair.links}
    return [link.name for link in mechanism.links if link.name not in beside]
