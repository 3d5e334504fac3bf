"""Bands that no mechanism within its tolerances leaves, at any position of its inputs: by interval arithmetic.

A deviation is the integral of the slopes times the deviations of all numbers along a straight way from the nominal; the
slopes are enclosed over boxes of inputs and numbers (R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval
Analysis, SIAM 2009, ch. 6), which Krawczyk's operator proves to hold one solution. See `planar.derivatives.enclosures`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.analysis.tolerance.cover import Cover, Undecided
from planar.analysis.tolerance.dead_point_proof import DeadPointProof
from planar.analysis.tolerance.variations import Variations
from planar.analysis.tolerance.varied import Varied
from planar.derivatives.design_equations import PositionResult
from planar.derivatives.enclosures import OVER
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.short_repr import short_repr
from planar.results.motion import Motion, State

DIRECTIONS = 48
"""In which a point's farthest deviation is enclosed; between them it is 1 / cos(pi / 48) times as far at most."""


class Guaranteed(NamedTuple):
    """Deviations that no mechanism within its tolerances exceeds: least and greatest (n, parts), the greatest distance
    `worst` (n,), at a position of a motion and at all others half way to the next ones; by how many `boxes`."""

    lower: Array
    upper: Array
    worst: Array
    boxes: int

    def __repr__(self) -> str:
        return short_repr(self)


def guaranteed_band(source: State | Motion | Forces, of: str, result: str, variations: Variations) -> Guaranteed:
    """The guaranteed band of a result of positions. Raises BadInput where it is of no such kind, and NoAnswer where a
    dead point is proved within the tolerances, or nothing can be proved."""
    offsets = tuple(offset.pair for offset in variations.offsets)
    position = PositionResult(source, offsets, of, result)
    varied, names = _what_varies(position, variations)
    equations = position.over_boxes(sorted(set(varied.columns.tolist())))
    moving = source.moving if isinstance(source, Forces) else source
    (z, *_), t = position.design.coordinates_at(moving)
    cover = Cover(equations, varied, t[0], t[:, : varied.inputs], z)
    proof = DeadPointProof(position.design, t[0], varied, names)
    try:
        cover.decide(proof.look)
    except Undecided as undecided:
        proof.look(undecided.lower, undecided.upper, undecided.near)
        raise NoAnswer(Outcome.TOO_INEXACT, proof.describe_doubt(undecided)) from None
    row, low, high = cover.grouped_slopes()
    return Guaranteed(*_band_of_rows(varied, len(t), row, low, high), len(cover.boxes.row))


def _what_varies(position: PositionResult, variations: Variations) -> tuple[Varied, tuple[str, ...]]:
    """Inputs, then numbers and pins on which positions depend, with their names."""
    inputs = [given.pair for given in position.design.mechanism.inputs]
    known = position.moving(each.number for each in variations.numbers)
    numbers = [each for each in variations.numbers if each.number in known]
    names = [*known, *(f"clearance.{each.pair}.{axis}" for each in variations.offsets for axis in "xy")]
    columns = [*range(len(inputs)), *(position.design.names.index(name) for name in names)]
    radii = [each.radius for each in variations.offsets for _ in "xy"]
    lower = np.array([*(each.lower for each in numbers), *(-each for each in radii)])
    upper = np.array([*(each.upper for each in numbers), *radii])
    return Varied(np.array(columns, dtype=int), len(inputs), lower, upper, len(variations.offsets)), (*inputs, *names)


def _band_of_rows(varied: Varied, many: int, row: IntArray, low: Array, high: Array) -> tuple[Array, Array, Array]:
    least, greatest = np.full((many, low.shape[1]), np.inf), np.full((many, low.shape[1]), -np.inf)
    farthest = np.zeros(many)
    ends = varied.deviations(low, high)
    np.minimum.at(least, row, ends[0])
    np.maximum.at(greatest, row, ends[1])
    np.maximum.at(farthest, row, _farthest(varied, low, high))
    return least, greatest, farthest


def _farthest(varied: Varied, low: Array, high: Array) -> Array:
    """How far results go, at most (groups,): a point by its support, the greatest deviation in a direction."""
    if low.shape[1] != 2:
        ends = varied.deviations(low, high)
        return np.asarray(np.maximum(np.abs(ends[0]), np.abs(ends[1])).max(axis=1, initial=0.0))
    angle = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    farthest = np.zeros(len(low))
    for way in np.stack([np.cos(angle), np.sin(angle)], axis=1):
        parts = [way[:, None] * each for each in (low, high)]
        least, greatest = np.minimum(*parts).sum(axis=1), np.maximum(*parts).sum(axis=1)
        slack = (OVER - 1.0) * np.maximum(np.abs(low), np.abs(high)).sum(axis=1)
        along = varied.deviations((least - slack)[:, None], (greatest + slack)[:, None])[1]
        farthest = np.maximum(farthest, along[:, 0])
    return np.asarray(farthest * (OVER / np.cos(np.pi / DIRECTIONS)))
