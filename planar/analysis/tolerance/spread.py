"""How far linear deviations take a result: worst case, mean and covariance.

A deviation is the sum of slopes times those of numbers, each within limits, and of pins aside, each within a circle: of
a point that is a zonotope and ellipses added up, of which the support function h(n) is the greatest deviation along n
(R. Schneider, Convex Bodies, Cambridge 2014, ch. 1.7), and the farthest point of the sum lies where |p| = max h(n).
"""

from __future__ import annotations

from math import erf, pi, sqrt
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array

DIRECTIONS = 180
"""Directions in which a point's farthest deviation is looked for first."""
IMPROVEMENTS = 20
LIMIT_POINTS = 400
"""Points of a quadrature across a limit."""
SIGMAS = {"normal": 3.0, "uniform": sqrt(3.0)}
"""Half of a tolerance's width over the standard deviation, by how the deviations are distributed."""


class LinearSpread(NamedTuple):
    """Deviations of a result (n, parts) that are linear in those of numbers k and of pins m.

    `shift` (n, parts) is what always stands: pins that a load holds.
    """

    slopes: Array
    "(n, parts, k)"
    lower: Array
    "(k,)"
    upper: Array
    "(k,)"
    offset_slopes: Array
    "(n, parts, m, 2)"
    radii: Array
    "(n, m): 0 where a load holds the pin"
    shift: Array
    "(n, parts)"
    sigmas: float

    @property
    def middle(self) -> Array:
        """The middle of all limits (n, parts), which is the mean, too."""
        return self.shift + self.slopes @ (0.5 * (self.lower + self.upper))

    @property
    def variances(self) -> Array:
        """Of each number, then each pin, the covariance that it brings (k + m, n, parts, parts).

        A pin stands on its clearance's circle in any direction: of each of two parts r^2 / 2.
        """
        deviations = 0.5 * (self.upper - self.lower) / self.sigmas
        own = np.moveaxis(self.slopes * deviations, 2, 0)
        of_numbers = own[..., :, None] * own[..., None, :]
        by_pin = np.moveaxis(self.offset_slopes, 2, 0)
        weight = 0.5 * self.radii.T[:, :, None, None] ** 2
        return np.concatenate([of_numbers, weight * (by_pin @ by_pin.swapaxes(-1, -2))])

    def limits(self) -> tuple[Array, Array]:
        """The least and the greatest deviation (n, parts) of each part."""
        half = 0.5 * (np.abs(self.slopes) @ (self.upper - self.lower))
        half = half + (np.linalg.norm(self.offset_slopes, axis=3) * self.radii[:, None]).sum(axis=2)
        return self.middle - half, self.middle + half

    def farthest(self) -> Array:
        """The greatest deviation (n,), of a point its distance from the nominal place."""
        if self.slopes.shape[1] == 1:
            low, high = self.limits()
            return np.asarray(np.maximum(np.abs(low), np.abs(high))[:, 0])
        angles = np.linspace(0.0, 2.0 * pi, DIRECTIONS, endpoint=False)
        n = np.stack([np.cos(angles), np.sin(angles)])  # (2, directions)
        heights = np.stack([(self._support(np.broadcast_to(each, self.shift.shape)) * each).sum(1) for each in n.T])
        towards = n.T[np.argmax(np.nan_to_num(heights), axis=0)]
        for _ in range(IMPROVEMENTS):
            point = self._support(towards)
            size = np.linalg.norm(point, axis=1, keepdims=True)
            towards = np.where(size > 0.0, point / np.where(size > 0.0, size, 1.0), towards)
        return np.asarray(np.linalg.norm(self._support(towards), axis=1))

    def boundary(self, count: int) -> Array:
        """The farthest deviations of a point in so many directions all round (n, count, 2)."""
        angles = np.linspace(0.0, 2.0 * pi, count, endpoint=False)
        ways = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return np.stack([self._support(np.broadcast_to(each, self.shift.shape)) for each in ways], axis=1)

    def _support(self, towards: Array) -> Array:
        """The farthest point (n, 2) of the sum along directions (n, 2)."""
        along = np.einsum("npk,np->nk", self.slopes, towards)
        point = self.middle + np.einsum("npk,nk->np", self.slopes, np.sign(along) * 0.5 * (self.upper - self.lower))
        by_pin = np.einsum("npmd,np->nmd", self.offset_slopes, towards)
        size = np.linalg.norm(by_pin, axis=2, keepdims=True)
        unit = by_pin / np.where(size > 0.0, size, 1.0) * self.radii[..., None]
        found: Array = point + np.einsum("npmd,nmd->np", self.offset_slopes, unit)
        return found


class NormalSpread(NamedTuple):
    """A normal distribution of deviations: mean (n, parts) and covariance (n, parts, parts)."""

    mean: Array
    covariance: Array

    @property
    def std(self) -> Array:
        """Of each part (n, parts)."""
        return np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2))

    def ellipse(self, count: int, sigmas: float) -> Array:
        """So many standard deviations of a point all round its mean (n, count, 2)."""
        angles = np.linspace(0.0, 2.0 * pi, count, endpoint=False)
        variances, axes = np.linalg.eigh(np.nan_to_num(self.covariance))
        half = axes * np.sqrt(np.clip(variances, 0.0, None))[:, None]
        circle = np.stack([np.cos(angles), np.sin(angles)])
        found: Array = self.mean[:, None] + sigmas * (half @ circle).transpose(0, 2, 1)
        return found

    def share_within(self, low: float, high: float) -> Array:
        """The share (n,) of parts whose deviation is between limits; of a point, no farther off than `high`."""
        if self.mean.shape[1] == 1:
            mean, std = self.mean[:, 0], self.std[:, 0]
            return _normal_share((low - mean, high - mean), std)
        found = np.full(len(self.mean), np.nan)
        nodes, weights = np.polynomial.legendre.leggauss(LIMIT_POINTS)
        for row, (mean, covariance) in enumerate(zip(self.mean, self.covariance, strict=True)):
            if not np.isfinite(covariance).all():
                continue
            variances, axes = np.linalg.eigh(covariance)
            small, great = np.sqrt(np.clip(variances, 0.0, None))
            across, along = axes.T @ mean
            if great == 0.0:
                found[row] = float(np.hypot(across, along) <= high)
                continue
            reach = max(min(high, along + 9.0 * great), -high)
            start = min(max(-high, along - 9.0 * great), reach)
            place = 0.5 * (reach - start) * nodes + 0.5 * (reach + start)
            density = np.exp(-0.5 * ((place - along) / great) ** 2) / (great * sqrt(2.0 * pi))
            side = np.sqrt(np.clip(high**2 - place**2, 0.0, None))
            inside = _normal_share((-side - across, side - across), np.full(len(place), small))
            found[row] = 0.5 * (reach - start) * float(weights @ (density * inside))
        return found


def _normal_share(between: tuple[Array, Array], std: Array) -> Array:
    """The share of a normal distribution about 0 between limits."""
    low, high = (
        np.where(std > 0.0, each / np.where(std > 0.0, std, 1.0), np.where(each < 0.0, -np.inf, np.inf))
        for each in between
    )
    phi = np.vectorize(lambda value: 0.5 * (1.0 + erf(value / sqrt(2.0))), otypes=[float])
    found: Array = phi(high) - phi(low)
    return found
