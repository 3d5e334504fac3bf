"""Fourier descriptors of curves by their length, and how far shapes are apart wherever they lie.

A closed polygon z(s), s from 0 to 1 by its length, has c_n = sum of (v_(p-1) - v_p) exp(-2 pi i n s_p) / (2 pi n)^2,
where v_p is its direction, times the length, behind the corner p: the series of Kuhl and Giardina (Elliptic Fourier
features of a closed contour, Comp. Graphics Image Proc. 18, 1982) in complex numbers. To move a curve multiplies all
c_n but c_0 by one number, to begin it elsewhere c_n by exp(2 pi i n shift), to go round it the other way exchanges c_n
and c_-n.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray

HARMONICS = 10
SHIFTS, FINER_SHIFTS = 64, 8
"""Starts of a curve that are tried, and then of each step between them."""
CHUNK = 8192
"""Curves that are compared at once, so that all stays in the processor's cache."""


def lengths_along(curves: ComplexArray, is_closed: bool) -> Array:
    """How far from the first each corner of polygons (curves, corners) is (m), and behind them the whole length."""
    ends = np.concatenate([curves, curves[:, :1]], axis=1) if is_closed else curves
    pieces = np.abs(np.diff(ends, axis=1))
    return np.concatenate([np.zeros((len(curves), 1), pieces.dtype), np.cumsum(pieces, axis=1)], axis=1)


def fourier_coefficients(curves: ComplexArray, harmonics: int = HARMONICS) -> ComplexArray:
    """c_n (curves, 2 harmonics + 1) of closed polygons (curves, corners), n from -harmonics to harmonics; of a curve
    without length c_0 alone."""
    along = lengths_along(curves, True)
    whole = along[:, -1:]
    share = along / np.where(whole > 0.0, whole, 1.0)
    pieces = np.roll(curves, -1, axis=1) - curves
    with np.errstate(all="ignore"):
        way = np.where(pieces == 0.0, 0.0, whole * pieces / np.abs(pieces))
    turned = np.roll(way, 1, axis=1) - way
    first = np.exp(-2j * np.pi * share[:, :-1]).astype(curves.dtype)
    found = np.empty((len(curves), 2 * harmonics + 1), curves.dtype)
    found[:, harmonics] = np.sum(np.diff(share, axis=1) * (curves + 0.5 * pieces), axis=1)
    found[:, harmonics] += np.where(whole[:, 0] > 0.0, 0.0, curves[:, 0])
    power = np.ones_like(first)
    for n in range(1, harmonics + 1):
        power = power * first
        size = (2.0 * np.pi * n) ** 2
        found[:, harmonics + n] = np.einsum("ck,ck->c", turned, power) / size
        found[:, harmonics - n] = np.einsum("ck,ck->c", turned, power.conj()) / size
    return found


def even_points(curves: ComplexArray, along: Array, count: int) -> ComplexArray:
    """Points (curves, count) of polygons (curves, corners) evenly by their lengths `along`, both ends among them; where
    these have one entry more than there are corners the polygons are closed, and the last is left out."""
    is_closed = along.shape[1] > curves.shape[1]
    ends = np.concatenate([curves, curves[:, :1]], axis=1) if is_closed else curves
    whole = np.where(along[:, -1:] > 0.0, along[:, -1:], 1.0)
    share = along / whole
    wanted = np.arange(count) / (count if is_closed else count - 1)
    row = 2.0 * np.arange(len(curves))[:, None]
    at = np.searchsorted((share + row).ravel(), (wanted + row).ravel(), side="right").reshape(len(curves), count)
    at = np.clip(at - (row / 2).astype(int) * along.shape[1] - 1, 0, along.shape[1] - 2)
    before, behind = np.take_along_axis(share, at, axis=1), np.take_along_axis(share, at + 1, axis=1)
    part = (wanted - before) / np.where(behind > before, behind - before, 1.0)
    one, other = np.take_along_axis(ends, at, axis=1), np.take_along_axis(ends, at + 1, axis=1)
    found: ComplexArray = one + np.clip(part, 0.0, 1.0).astype(along.dtype) * (other - one)
    return found


class CurveAlignment(NamedTuple):
    """How curves are laid upon a wanted one: the root mean square distance between them (curves,) in sizes of the
    wanted curve, where it begins along each (of its length), and whether it goes round the other way.

    The size is twice the root mean square distance from the centre: of a circle the diameter.
    """

    distance: Array
    shift: Array
    is_reversed: BoolArray


def align_curves(
    wanted: ComplexArray, curves: ComplexArray, can_move: bool = True, many: int | None = None
) -> tuple[IntArray, CurveAlignment]:
    """The curves nearest to a wanted one, `many` or all, nearest first, and how these are aligned.

    `wanted` (2 harmonics + 1,) and `curves` (curves, 2 harmonics + 1) are Fourier coefficients; with `can_move` place,
    size and turn of the curves are those that fit best.
    """
    size = float(np.sqrt(_power(wanted[None])[0]))
    if can_move:
        wanted, curves = _without_place(wanted[None])[0], _without_place(curves)
    shifts = np.arange(SHIFTS) / SHIFTS
    best = np.empty(len(curves), dtype=int)
    score = np.empty(len(curves))
    filters = _filters(wanted, shifts).astype(curves.dtype)
    for first in range(0, len(curves), CHUNK):
        part = slice(first, first + CHUNK)
        told = _likeness(curves[part].conj() @ filters, can_move)
        best[part] = np.argmax(told, axis=1)
        score[part] = np.take_along_axis(told, best[part][:, None], axis=1)[:, 0]
    distance = _distances(score, curves, wanted, can_move) / (2.0 * size)
    count = len(curves) if many is None else min(many, len(curves))
    chosen = np.argpartition(distance, count - 1)[:count] if count < len(curves) else np.arange(count)
    alignment = _refine(wanted, curves[chosen], best[chosen], can_move, size)
    order = np.argsort(alignment.distance, kind="stable")
    distance, shift, is_reversed = alignment
    return chosen[order], CurveAlignment(distance[order], shift[order], is_reversed[order])


def _refine(wanted: ComplexArray, curves: ComplexArray, best: IntArray, can_move: bool, size: float) -> CurveAlignment:
    """Alignments by finer shifts about the best (curves,) of `_filters`."""
    curves = curves.astype(complex)
    harmonics = curves.shape[1] // 2
    n = np.arange(-harmonics, harmonics + 1)
    is_reversed = best >= SHIFTS
    turned = np.where(is_reversed[:, None], curves[:, ::-1], curves)
    middle = (best % SHIFTS) / SHIFTS
    step, shift = 1.0 / SHIFTS, middle
    for _ in range(3):
        tried = shift[:, None] + step * np.arange(-FINER_SHIFTS, FINER_SHIFTS + 1) / FINER_SHIFTS
        begun = np.exp(-2j * np.pi * tried[:, :, None] * n)
        told = _likeness(np.einsum("cn,ctn,n->ct", turned.conj(), begun, wanted), can_move)
        pick = np.argmax(told, axis=1)[:, None]
        shift, score = np.take_along_axis(tried, pick, axis=1)[:, 0], np.take_along_axis(told, pick, axis=1)[:, 0]
        step /= FINER_SHIFTS
    found = _distances(score, curves, wanted, can_move) / (2.0 * size)
    return CurveAlignment(found, np.where(is_reversed, -shift, shift) % 1.0, is_reversed)


def _filters(wanted: ComplexArray, shifts: Array) -> ComplexArray:
    """What the conjugate coefficients of curves are multiplied by (2 harmonics + 1, 2 shifts), those behind of curves
    the other way round."""
    harmonics = len(wanted) // 2
    n = np.arange(-harmonics, harmonics + 1)[:, None]
    ahead = wanted[:, None] * np.exp(-2j * np.pi * n * shifts)
    return np.concatenate([ahead, ahead[::-1]], axis=1)


def _likeness(products: ComplexArray, can_move: bool) -> Array:
    """What is greatest where curves lie best upon one another."""
    found: Array = products.real**2 + products.imag**2 if can_move else products.real
    return found


def _distances(score: Array, curves: ComplexArray, wanted: ComplexArray, can_move: bool) -> Array:
    """Root mean square distances (curves,) from what `_likeness` tells."""
    own, other = np.sum(np.abs(curves) ** 2, axis=1, dtype=float), float(np.sum(np.abs(wanted) ** 2))
    with np.errstate(all="ignore"):
        square = other - score / own if can_move else other + own - 2.0 * score
    found: Array = np.sqrt(np.maximum(np.where(np.isfinite(square), square, np.inf), 0.0))
    return found


def _without_place(coefficients: ComplexArray) -> ComplexArray:
    found = coefficients.copy()
    found[:, found.shape[1] // 2] = 0.0
    return found


def _power(coefficients: ComplexArray) -> Array:
    """The mean square distance from the centre (curves,)."""
    found: Array = np.sum(np.abs(_without_place(coefficients)) ** 2, axis=1)
    return found
