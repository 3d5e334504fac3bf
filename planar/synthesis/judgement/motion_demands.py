"""What is demanded of a design's motion, judged by the general path: transmission angles, and the region."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.model.mechanism import relative_motions
from planar.model.wording import amount
from planar.results.motion import Motion
from planar.solving.grids.grid_motion import motion_over_input
from planar.synthesis.demands.output_transmissions import output_transmissions
from planar.synthesis.demands.polygon import polygon_depths
from planar.synthesis.judgement.defects import Defect

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
