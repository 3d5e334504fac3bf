"""Whether the pairs of one mechanism that has been run keep off their stops, by where its links are at every step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.march.stops import SURE_DISTANCE, TURN
from planar.batch.named_results.design_frames import DesignFrames
from planar.equations.mechanism_numbers import shapes_of_links
from planar.model.mechanism import Mechanism, links_counting_turns, relative_motions
from planar.solving.stops import PairStops

Array = np.ndarray


class FirstStop(NamedTuple):
    """The first step beyond a stop, and what there is met, in words; no step where all keep off."""

    step: int | None
    reason: str = ""


def watched_links(mechanism: Mechanism) -> tuple[str, ...]:
    """The moving links whose places tell where the pairs with stops are."""
    motions = relative_motions(mechanism) if mechanism.stops else {}
    links = [link for each in mechanism.stops for link in motions[each.pair].bodies]
    return tuple(link for link in dict.fromkeys(links) if link != mechanism.frame)


def find_first_stop(
    mechanism: Mechanism, unit: float, pair: str, positions: Array, places: dict[str, tuple[Array, Array]]
) -> FirstStop | None:
    """The first stop of a mechanism of this size (m), whose input `pair` stands at positions (steps,); None where that
    is not clear. places: of links the origin of the axes, and the place at the size on its x-axis (steps, 2)."""
    stops, counted = PairStops(mechanism, unit), links_counting_turns(mechanism)
    inputs = {given.pair for given in mechanism.inputs}
    far = [stops.high[k] - stops.low[k] > TURN + SURE_DISTANCE for k in range(len(stops.pairs))]
    if any(
        not counted.isdisjoint(each.bodies) or (many and each.name not in inputs)
        for each, many in zip(stops.pairs, far, strict=True)
    ):
        return None
    given = {
        each.pair: positions[:, None] if each.pair == pair else np.full((len(positions), 1), each.position)
        for each in mechanism.inputs
    }
    both = {link: (one[None, :, :, None], other[None, :, :, None]) for link, (one, other) in places.items()}
    frames = DesignFrames(mechanism, shapes_of_links(mechanism), given, both, unit)
    if not frames.is_clear[0]:
        return None
    at = np.array([frames.pair_value(each.name)[0][:, 0] for each in stops.pairs])
    low, high, scale = (each[:, None] for each in (stops.low, stops.high, stops.scale))
    counted_at = at + stops.turns(at[:, 0])[:, None]
    rooms = (np.minimum(counted_at - low, high - counted_at) / scale).T  # (steps, stops)
    if rooms[0].min() < -SURE_DISTANCE:
        return FirstStop(0, stops.describe_met(at[:, 0]))
    turned = np.array([angle[:, 0] for angle in frames.angles.values()])
    sure = stops.sure_rows(at, np.vstack([turned, at / stops.scale[:, None]]).T)
    if sure.all():
        return FirstStop(None)
    first = int(np.argmin(sure))
    if first < 2 or rooms[first - 1].min() < SURE_DISTANCE or rooms[first].min() > -SURE_DISTANCE:
        return None
    k = int(np.argmin(rooms[first]))
    is_upper = bool(at[k, first] > at[k, first - 1])
    return FirstStop(first, stops.side(is_upper, k).describe(stops.motions, mechanism.units))
