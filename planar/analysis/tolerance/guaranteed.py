"""Bands that no mechanism within its tolerances leaves, at any position of its inputs: by interval arithmetic.

A deviation is the integral of the slopes times the deviations of all numbers along a straight way from the nominal; the
slopes are enclosed over boxes of inputs and numbers (R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval
Analysis, SIAM 2009, ch. 6), which Krawczyk's operator proves to hold one solution. See `planar.derivatives.enclosures`.
"""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.analysis.tolerance.cover import Cover, Undecided, Varied
from planar.analysis.tolerance.dead_point_proof import DeadPointProof
from planar.analysis.tolerance.variations import Variations
from planar.derivatives.enclosures import ParametricSystem
from planar.derivatives.intervals import OVER
from planar.derivatives.result_slopes import SlopeSystem
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.short_repr import short_repr

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


def guaranteed_band(system: SlopeSystem, of: str, result: str, variations: Variations) -> Guaranteed:
    """The guaranteed band of a result of positions. Raises BadInput where it is of no such kind, and NoAnswer where a
    dead point is proved within the tolerances, or nothing can be proved."""
    design = system.design
    value = next(each.value for each in system.expressions(of) if each.name == result)
    rates = ca.vertcat(design.z1, design.z2, design.u1, design.u2)
    if system.balance is not None or (rates.numel() and ca.depends_on(value, rates)):
        raise BadInput("guaranteed", f"guaranteed bands are told of places, angles and lengths, and not of {result!r}")
    if design.F.numel() != design.z.numel():
        told = "guaranteed bands are told of mechanisms without redundant constraints, which deviations contradict"
        raise BadInput("guaranteed", told)
    varied, names = _what_varies(system, value, variations)
    try:
        columns = sorted(set(varied.columns.tolist()))
        equations = ParametricSystem(design.z, design.t, design.F, value, columns)
    except KeyError as problem:
        told = f"guaranteed bands are not told of this mechanism, whose formulas have a {problem.args[0]!r} in them"
        raise BadInput("guaranteed", told) from None
    t = system.parameters
    cover = Cover(equations, varied, t[0], t[:, : varied.inputs], system.values[0])
    proof = DeadPointProof(system, varied, names)
    try:
        cover.decide(proof.look)
    except Undecided as undecided:
        proof.look(undecided.lower, undecided.upper, undecided.near)
        raise NoAnswer(Outcome.TOO_INEXACT, proof.describe_doubt(undecided)) from None
    row, low, high = cover.grouped_slopes()
    return Guaranteed(*_band_of_rows(varied, len(t), row, low, high), len(cover.boxes.row))


def _what_varies(system: SlopeSystem, value: ca.SX, variations: Variations) -> tuple[Varied, tuple[str, ...]]:
    """Inputs, then numbers and pins on which positions depend, with their names."""
    design = system.design
    inputs = [given.pair for given in design.mechanism.inputs]
    moved = set(ca.jacobian_sparsity(ca.vertcat(design.F, value), design.t).get_col())
    numbers = [each for each in variations.numbers if design.names.index(each.number) in moved]
    names = [each.number for each in numbers]
    names += [f"clearance.{each.pair}.{axis}" for each in variations.offsets for axis in "xy"]
    columns = [*range(len(inputs)), *(design.names.index(name) for name in names)]
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
