"""The curves of a point in all designs of a catalogue, of a free point several in each, ready to be compared."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.synthesis.matching.carried_points import CarriedPoint
from planar.synthesis.matching.curve_descriptors import even_points, fourier_coefficients, lengths_along
from planar.synthesis.swept.array_store import catalogue_key, keep_arrays, kept_arrays
from planar.synthesis.swept.swept_catalogue import SweptCatalogue

VERSION = 1
"""Of how curves are chosen and described."""
POINTS_EACH = 8
"""Places of a free point on each design's link."""
EVEN_POINTS = 48
"""Of each curve, evenly by its length."""
CHUNK = 4096
"""Curves that are described at once."""


@dataclass(frozen=True, eq=False)
class CurveIndex:
    """Curves (curves,): of which design, where on its link the point lies, and whether the curve is closed.

    `coefficients` (closed curves, 2 harmonics + 1) are of the closed ones, which stand first; `even` (points, curves)
    are points evenly by length, of open curves both ends among them.
    """

    design: IntArray
    coordinates: ComplexArray
    is_closed: BoolArray
    coefficients: ComplexArray
    even: ComplexArray


def curve_index(catalogue: SweptCatalogue, point: CarriedPoint) -> CurveIndex:
    """The curves of a point, from disk where they have been described before."""
    places = [] if point.is_free else [point.coordinates.real, point.coordinates.imag]
    told = [catalogue.key, point.link, point.is_free, point.lower, point.upper, *places]
    name = catalogue_key("curves", VERSION, *told, point.middle.real, point.middle.imag, point.extent)
    kept = kept_arrays(name)
    if kept is None:
        made = _describe(catalogue, point)
        kept = {each.name: getattr(made, each.name) for each in fields(made)}
        keep_arrays(name, kept)
    return CurveIndex(**kept)


def design_curves(catalogue: SweptCatalogue, link: int, design: IntArray, coordinates: ComplexArray) -> ComplexArray:
    """The paths (n, samples) of points at `coordinates` (n,) on a link of designs (n,), in single precision."""
    motions = catalogue.motions
    angle = motions.angles[link, design]
    turn = np.empty(angle.shape, dtype=np.complex64)
    turn.real, turn.imag = np.cos(angle), np.sin(angle)
    turn *= coordinates.astype(np.complex64)[:, None]
    found: ComplexArray = turn + motions.origins[link, design]
    return found


def _describe(catalogue: SweptCatalogue, point: CarriedPoint) -> CurveIndex:
    motions = catalogue.motions
    many = POINTS_EACH if point.is_free else 1
    places = point.coordinates[:, None]
    if point.is_free:
        places = point.draw(many, np.random.default_rng([0, len(catalogue)]))
    order = np.argsort(~motions.is_closed, kind="stable")
    design, coordinates = np.repeat(order, many), places[order].ravel()
    closed = motions.is_closed[design]
    coefficients, even = [], np.empty((EVEN_POINTS, len(design)), dtype=np.complex64)
    for part, is_closed in _parts(closed):
        curves = design_curves(catalogue, point.link, design[part], coordinates[part])
        if is_closed:
            coefficients.append(fourier_coefficients(curves))
        else:  # the last position again, which changes no length
            last = motions.sample_count[design[part]] - 1
            index = np.minimum(np.arange(curves.shape[1]), last[:, None])
            curves = np.take_along_axis(curves, index, axis=1)
        even[:, part] = even_points(curves, lengths_along(curves, is_closed), EVEN_POINTS).T
    none = np.zeros((0, 1), dtype=np.complex64)
    return CurveIndex(design, coordinates, closed, np.concatenate(coefficients or [none]), even)


def _parts(closed: BoolArray) -> list[tuple[slice, bool]]:
    """Parts of the curves, each of closed ones alone or of others."""
    count, first_open = len(closed), int(np.count_nonzero(closed))
    found = [(slice(k, min(k + CHUNK, first_open)), True) for k in range(0, first_open, CHUNK)]
    return found + [(slice(k, min(k + CHUNK, count)), False) for k in range(first_open, count, CHUNK)]


def samples_at(along: Array, shares: Array) -> Array:
    """Where on polygons (n, corners) with lengths `along` shares (n, places) of the whole length are: numbers of
    corners with the part of the side behind, going on over whole turns as the shares do."""
    turns = np.floor(shares)
    whole = np.where(along[:, -1:] > 0.0, along[:, -1:], 1.0)
    share, wanted = along / whole, shares - turns
    sides = along.shape[1] - 1
    row = 2.0 * np.arange(len(along))[:, None]
    at = np.searchsorted((share + row).ravel(), (wanted + row).ravel(), side="right").reshape(wanted.shape)
    at = np.clip(at - np.arange(len(along))[:, None] * (sides + 1) - 1, 0, sides - 1)
    before, behind = np.take_along_axis(share, at, axis=1), np.take_along_axis(share, at + 1, axis=1)
    part = (wanted - before) / np.where(behind > before, behind - before, 1.0)
    found: Array = at + np.clip(part, 0.0, 1.0) + turns * sides
    return found
