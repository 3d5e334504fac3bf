"""What designs lack: transmission angles and the region, and which demand is in the way where none is sound."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.analysis.motion.transmission_angle import Transmission, transmission
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, PlanarError
from planar.model.file_units import FileUnits
from planar.model.mechanism import relative_motions
from planar.model.wording import amount, count_phrase
from planar.results.motion import Motion
from planar.solving.input_grid import motion_over_input

REACH, ORDER, WHOLE_TURN = "the reach", "the order", "the whole turn"
ONE_BRANCH, ONE_CIRCUIT = "one branch", "one circuit"
"""Names of demands."""


class Defect(NamedTuple):
    """A sentence, and which demand it is short of: a demand's name, in the words of a file, or of a table.

    `reached` is how far the design comes (SI; `quantity` is its kind), and `asked` how far it is to come; `more` tells
    whether more is better. None of what is met or is not.
    """

    demand: str
    sentence: str
    reached: float | None = None
    asked: float | None = None
    quantity: str = "angle"
    more: bool = True
    verb: str = "reaches"

    @property
    def shortage(self) -> float:
        """By how much (SI) it is short; infinite where that is no number."""
        if self.reached is None or self.asked is None:
            return float("inf")
        return self.asked - self.reached if self.more else self.reached - self.asked


def refusal(designs: Sequence[Sequence[Defect]], units: FileUnits) -> str:
    """A sentence from the defects of all designs that were judged.

    In the way is the demand of which most designs are short; of several alike the one that the best design, with the
    fewest defects, is short of."""
    if not designs:
        return "no design comes near: another start, or more free numbers, may"
    short = [dict.fromkeys(each.demand for each in own) for own in designs]
    count = {demand: sum(demand in own for own in short) for own in short for demand in own}
    fewest = min(range(len(designs)), key=lambda k: len(short[k]))
    demand = max(count, key=lambda name: (count[name], name in short[fewest]))
    worst = [
        max((each for each in own if each.demand == demand), key=lambda each: each.shortage)
        for own, demands in zip(designs, short, strict=True)
        if demand in demands
    ]
    best = min(worst, key=lambda each: each.shortage)
    many, short_of = count_phrase(len(designs), "design"), "is" if count[demand] == 1 else "are"
    return (
        f"no design without a defect; in the way is {demand}{_outcome(best, units)} "
        f"({count[demand]} of {many} {short_of} short of it)"
    )


def _outcome(best: Defect, units: FileUnits) -> str:
    """How near the best design comes."""
    if best.reached is None or best.asked is None:
        return f": {best.sentence}"
    reached, asked, left = (amount(each, best.quantity, units) for each in (best.reached, best.asked, best.shortage))
    if not best.asked:
        return f": the best design {best.verb} {reached}"
    return f" of {asked}: the best design {best.verb} {reached}, {left} {'less' if best.more else 'more'}"


def output_transmissions(motion: Motion) -> Iterator[Transmission]:
    """That of every pair with the frame that is no input, without those of which none is told."""
    mechanism = motion.mechanism
    inputs = {drive.pair for drive in mechanism.inputs}
    for pair in mechanism.pairs:
        if mechanism.frame in pair.links and pair.name not in inputs:
            try:
                yield transmission(motion, pair.name)
            except PlanarError:
                continue  # nothing is transmitted to it by one force


def polygon_depths(places: Array, corners: Array) -> tuple[Array, Array]:
    """How far places (n, 2) are from the border of a polygon (corners, 2), below zero outside; and in which direction
    (n, 2) that grows the most."""
    first, second = corners, np.roll(corners, -1, axis=0)
    along = second - first
    x, y = places[:, 0, None], places[:, 1, None]
    crosses = (first[:, 1] > y) != (second[:, 1] > y)
    rise = np.where(crosses, along[:, 1], 1.0)
    right = first[:, 0] + (y - first[:, 1]) / rise * along[:, 0]
    is_inside = np.sum(crosses & (x < right), axis=1) % 2 == 1
    share = np.clip(np.sum((places[:, None] - first) * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
    off = places[:, None] - first - share[..., None] * along
    distance = np.linalg.norm(off, axis=2)
    distance = np.where(np.isfinite(distance), distance, np.inf)
    nearest = np.argmin(distance, axis=1)
    every = np.arange(len(places))
    least, off, side = distance[every, nearest], off[every, nearest], along[nearest]
    turned = 1.0 if np.sum(first[:, 0] * second[:, 1] - second[:, 0] * first[:, 1]) > 0.0 else -1.0
    inward = turned * np.stack([-side[:, 1], side[:, 0]], axis=1) / np.linalg.norm(side, axis=1, keepdims=True)
    sense = np.where(is_inside, 1.0, -1.0)
    apart = least > 1e-9 * np.ptp(corners, axis=0).max()
    ways = np.where(apart[:, None], sense[:, None] * off / np.where(apart, least, 1.0)[:, None], inward)
    return np.where(np.isfinite(places).all(axis=1), sense * least, np.nan), ways


REFINEMENTS, REFINED_POSITIONS = 2, 9
"""How often, and at how many positions between two samples, it is looked where a point is farthest out."""
ON_BORDER = 1e-9
"""Of the extent of the region: a point so little outside is on its border."""


def transmission_defects(motion: Motion, least: float) -> Iterator[Defect]:
    """Of every output whose transmission angle (rad) falls below the least."""
    mechanism = motion.mechanism
    for found in output_transmissions(motion):
        if found.least is not None and found.least.value < least:
            given = relative_motions(mechanism)[mechanism.inputs[0].pair].input_quantity_kinds()[0]
            at = amount(found.least.input, given, mechanism.units)
            angle, wanted = (amount(each, "angle", mechanism.units) for each in (found.least.value, least))
            where = f"{mechanism.inputs[0].pair} = {at}"
            told = f"the transmission angle at {found.pair} falls to {angle} at {where}, below {wanted}"
            yield Defect("the transmission angle", told, found.least.value, least)


def region_defects(motion: Motion, corners: Array) -> Iterator[Defect]:
    """Of every point that leaves a polygon (corners, 2)."""
    border = ON_BORDER * float(np.ptp(corners, axis=0).max())
    for name, (place, depth) in _farthest_places(motion, corners).items():
        if depth < -border:
            x, y = (amount(float(each), "length", motion.mechanism.units) for each in place)
            told = f"{name} leaves the region at x = {x}, y = {y}"
            yield Defect("the region", told, -depth, 0.0, "length", more=False, verb="leaves it by")


def _farthest_places(motion: Motion, corners: Array) -> dict[str, tuple[Array, float]]:
    """Of every point where it is farthest out, between samples too, and how deep inside that is (m)."""
    running = motion.mechanism.inputs[0].pair
    inputs = np.asarray(motion.inputs[running].position, float)
    samples, given = motion, [inputs] * len(motion.point_names)
    found: dict[str, tuple[Array, float]] = {}
    for step in range(REFINEMENTS + 1):
        wanted, first = [], 0
        for name, own in zip(motion.point_names, given, strict=True):
            every = np.broadcast_to(np.atleast_2d(samples.point(name).position), (len(samples), 2))
            places = every if not step else every[first : first + len(own)]
            first += len(own)
            depths = polygon_depths(places, corners)[0]
            k = int(np.argmin(depths))
            if name not in found or depths[k] < found[name][1]:
                found[name] = places[k], float(depths[k])
            around = own[max(k - 1, 0)], own[min(k + 1, len(own) - 1)]
            wanted.append(np.linspace(*around, REFINED_POSITIONS))
        if step == REFINEMENTS:
            break
        try:
            samples, given = motion_over_input(motion.mechanism, np.concatenate(wanted)), wanted
        except NoAnswer:
            break
    return found
