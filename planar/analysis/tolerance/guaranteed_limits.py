"""Guaranteed bands of travels and dead points: the limits themselves are solved for over the box of all deviations.

A limit of every mechanism within the tolerances, that which continues the nominal one, is the one solution of its own
equations near it, of which the running input is an unknown; a travel is from one to the other, so that what moves both
alike drops out.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from planar.analysis.sensitivity.limit_slopes import dead_point_equations, travel_end_equations
from planar.analysis.tolerance.guaranteed import Guaranteed
from planar.analysis.tolerance.variations import Variations
from planar.analysis.tolerance.varied import Varied, mean_slopes
from planar.derivatives.design_equations import LimitEquations, LimitSystem
from planar.derivatives.enclosures import ParametricSystem, down, up
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.results.motion import Motion

START_STEPS = 8


def guaranteed_travel(motion: Motion, of: str, variations: Variations) -> Guaranteed:
    """Of a stroke or swing. Raises NoAnswer where its ends are not proved to follow the deviations."""
    system, ends = travel_end_equations(motion, of, tuple(each.pair for each in variations.offsets))
    varied = _varied(system, variations)
    low, high = ([_value_slopes(each, varied, of) for each in places] for places in ends)
    bands = [varied.deviations(down(one[0] - other[1]), up(one[1] - other[0])) for one, other in product(high, low)]
    # of ends that tie in the nominal mechanism any may be the farthest
    return _guaranteed([(min(each[0] for each in bands), max(each[1] for each in bands))], len(low) + len(high))


def guaranteed_dead_points(motion: Motion, variations: Variations) -> Guaranteed:
    """Of all dead points of the running input. Raises NoAnswer."""
    system, limits = dead_point_equations(motion, tuple(each.pair for each in variations.offsets))
    varied = _varied(system, variations)
    slopes = [_value_slopes(each, varied, motion.running_input) for each in limits]
    return _guaranteed([varied.deviations(*each) for each in slopes], len(limits))


def _varied(system: LimitSystem, variations: Variations) -> Varied:
    names = [each.number for each in variations.numbers]
    names += [f"clearance.{each.pair}.{axis}" for each in variations.offsets for axis in "xy"]
    radii = [each.radius for each in variations.offsets for _ in "xy"]
    lower = np.array([*(each.lower for each in variations.numbers), *(-each for each in radii)])
    upper = np.array([*(each.upper for each in variations.numbers), *radii])
    columns = np.array([system.names.index(name) for name in names], dtype=int)
    return Varied(columns, 0, lower, upper, len(variations.offsets))


def _value_slopes(limit: LimitEquations, varied: Varied, of: str) -> tuple[Array, Array]:
    """What slopes of a limit's value are between (1, 1, varied)."""
    columns = sorted(set(varied.columns.tolist()))
    equations = ParametricSystem(limit.unknowns, limit.parameters, limit.equations, limit.value, columns)
    bounds = np.minimum(varied.lower, 0.0)[None], np.maximum(varied.upper, 0.0)[None]
    none = np.zeros_like(bounds[0])
    narrow = equations.enclose(varied.boxes_of_t(limit.numbers, none, none), limit.start[None], START_STEPS)
    place = [equations.columns.index(column) for column in varied.columns]
    start = narrow.middle + (narrow.tangents[..., place] @ (0.5 * (bounds[0] + bounds[1]))[:, :, None])[:, :, 0]
    found = equations.enclose(varied.boxes_of_t(limit.numbers, *bounds), start)
    if not found.holds(narrow)[0]:
        told = f"it is undecided whether all mechanisms within the tolerances have the limits of {of!r}: tighten them"
        raise NoAnswer(Outcome.TOO_INEXACT, told)
    return mean_slopes(equations, varied, limit.numbers, bounds, found)


def _guaranteed(bands: list[tuple[Array, Array]], boxes: int) -> Guaranteed:
    lower, upper = (np.concatenate([np.ravel(each[k]) for each in bands])[None] for k in (0, 1))
    return Guaranteed(lower, upper, np.maximum(np.abs(lower), np.abs(upper)).max(axis=1), boxes)
