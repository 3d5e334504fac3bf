"""Four-bars that meet two to four poses or three to five places exactly, from random draws, by closed forms alone.

Places of the plane are complex numbers. A design is its fixed pivots a and d, and its joints b and c at every entry;
the crank a-b is the input. Nothing of planar is used here.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
Places = NDArray[np.complex128]
Box = tuple[float, float, float, float]
"""The least x, the greatest x, the least y and the greatest y."""

MARGIN = 1e-3
"""rad: by so much angles are inside what is demanded, so that no draw is met by round-off."""


class FourBars(NamedTuple):
    """Designs: fixed pivots (n,) and joints at every entry (n, entries)."""

    a: Places
    d: Places
    b: Places
    c: Places

    def take(self, rows: Any) -> FourBars:
        """Those rows."""
        return FourBars(*(part[rows] for part in self))


class Demands(NamedTuple):
    """What is demanded: one branch always, and at wish a whole turn, an order and a least transmission angle (rad)."""

    whole_turn: bool
    in_order: bool
    transmission: float | None


def uniform(box: Box, count: int, rng: np.random.Generator) -> Places:
    """Places in a box."""
    return rng.uniform(box[0], box[1], count) + 1j * rng.uniform(box[2], box[3], count)


def is_inside(places: Places, box: Box) -> NDArray[np.bool_]:
    """Which places are in a box."""
    x, y = places.real, places.imag
    return (x >= box[0]) & (x <= box[1]) & (y >= box[2]) & (y <= box[3])


def dyads(at: Places, turn: Places, box: Box, rng: np.random.Generator) -> tuple[Places, Places, NDArray[np.int64]]:
    """Fixed pivots in a box, joints at every entry, and the draw of each, for poses (draws, entries) of a link.

    Two poses leave the joint on a line, three give it, and four leave the pivot on a cubic; of five the pivots are
    those that Newton's method reaches.
    """
    draws, entries = at.shape
    pivot, row = uniform(box, draws, rng), np.arange(draws)
    if entries == 4:
        pivot, row = _cubic_pivots(at, turn, pivot)
    elif entries == 5:
        pivot = _five_pose_pivots(at, turn, pivot)
    at, turn = at[row], turn[row]
    seen = (pivot[:, None] - at) / turn  # the pivot in the link's axes
    if entries == 2:
        along = rng.uniform(-2.0, 2.0, len(row)) * np.abs(at[:, 1] - at[:, 0])
        joint = seen.mean(axis=1) + 1j * along * (seen[:, 1] - seen[:, 0]) / np.abs(seen[:, 1] - seen[:, 0])
    else:
        joint = _middle(seen[:, :3])
    is_exact = np.ptp(np.abs(joint[:, None] - seen), axis=1) < 1e-9 * (1.0 + np.abs(joint))
    kept = np.flatnonzero(is_exact & is_inside(pivot, box))
    return pivot[kept], (at + turn * joint[:, None])[kept], row[kept]


def _middle(points: Places) -> Places:
    """The centre of the circle through three points (n, 3)."""
    p, q = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    with np.errstate(all="ignore"):
        centre = (np.abs(p) ** 2 * q - np.abs(q) ** 2 * p) / (p.conj() * q - p * q.conj())
    return points[:, 0] + centre


def _circle_determinant(at: Places, turn: Places, pivot: Places, entries: tuple[int, ...]) -> Reals:
    """Zero where the pivot is seen on one circle from four poses."""
    chosen = list(entries)
    seen = (pivot[..., None] - at[:, chosen]) / turn[:, chosen]
    rows = np.stack([np.abs(seen) ** 2, seen.real, seen.imag, np.ones(seen.shape)], axis=-1)
    return np.asarray(np.linalg.det(rows))


def _cubic_pivots(at: Places, turn: Places, pivot: Places) -> tuple[Places, NDArray[np.int64]]:
    """The pivots above and below drawn ones on the centre-point curve, and the draw of each."""
    size = np.abs(at - at[:, :1]).max(axis=1)
    steps = np.array([-1.5, -0.5, 0.5, 1.5])
    values = np.stack(
        [_circle_determinant(at, turn, pivot.real + 1j * size * step, (0, 1, 2, 3)) for step in steps], axis=1
    )
    factors = values @ np.linalg.inv(np.vander(steps, 4)).T
    companion = np.zeros((len(at), 3, 3))
    with np.errstate(all="ignore"):
        companion[:, 0] = -factors[:, 1:] / factors[:, :1]
    companion[:, 1, 0] = companion[:, 2, 1] = 1.0
    known = np.flatnonzero(np.isfinite(companion).all(axis=(1, 2)))
    roots = np.linalg.eigvals(companion[known])
    row, column = np.nonzero(np.abs(roots.imag) < 1e-9)
    draw = known[row]
    return pivot[draw].real + 1j * size[draw] * roots.real[row, column], draw


def _five_pose_pivots(at: Places, turn: Places, pivot: Places) -> Places:
    """The pivots near drawn ones that are seen on one circle from five poses."""
    step = 1e-6 * np.abs(at - at[:, :1]).max(axis=1)
    with np.errstate(all="ignore"):
        for _ in range(12):
            value, right, up = (
                np.stack([_circle_determinant(at, turn, place, k) for k in ((0, 1, 2, 3), (0, 1, 2, 4))], axis=1)
                for place in (pivot, pivot + step, pivot + 1j * step)
            )
            (p, q), (r, s) = ((each - value).T / step for each in (right, up))
            f, g = value.T
            pivot = pivot - ((s * f - r * g) + 1j * (p * g - q * f)) / (p * s - q * r)
    return pivot


def pose_designs(at: Places, turn: Places, boxes: tuple[Box, Box], count: int, rng: np.random.Generator) -> FourBars:
    """Four-bars whose coupler takes poses (entries,), from so many draws of each pivot."""
    poses = np.broadcast_to(at, (count, len(at))), np.broadcast_to(turn, (count, len(at)))
    (a, b, first), (d, c, second) = (dyads(*poses, box, rng) for box in boxes)
    common, left, right = np.intersect1d(first, second, return_indices=True)
    del common
    return FourBars(a[left], d[right], b[left], c[right])


def place_designs(places: Places, boxes: tuple[Box, Box], count: int, rng: np.random.Generator) -> FourBars:
    """Four-bars whose coupler point comes to places (entries,): pivot and joint of the crank are drawn, and how the
    coupler bends at each place; then the coupler's poses are known."""
    size = float(np.abs(places - places[0]).max())
    a = uniform(boxes[0], count, rng)
    b = a + size * np.exp(rng.uniform(np.log(0.1), np.log(2.0), count) + 1j * rng.uniform(-np.pi, np.pi, count))
    crank, arm = np.abs(b - a), np.abs(places[0] - b)
    reach = np.abs(places - a[:, None])
    with np.errstate(all="ignore"):
        bend = np.arccos((crank[:, None] ** 2 + reach**2 - arm[:, None] ** 2) / (2.0 * crank[:, None] * reach))
    bend *= rng.choice([-1.0, 1.0], bend.shape)
    joints = a[:, None] + crank[:, None] * (places - a[:, None]) / reach * np.exp(1j * bend)
    joints[:, 0] = b
    kept = np.flatnonzero(np.isfinite(joints).all(axis=1))
    a, joints = a[kept], joints[kept]
    turn = (places - joints) / np.abs(places - joints)
    d, c, row = dyads(joints, turn, boxes[1], rng)
    return FourBars(a[row], d, joints[row], c)


def meets(designs: FourBars, demands: Demands) -> NDArray[np.bool_]:
    """Which designs meet all entries on one branch, and what else is demanded, by the angles of a four-bar."""
    a, d, b, c = designs
    crank, rocker, coupler = (np.abs(part[:, 0]) for part in (b - a[:, None], c - d[:, None], c - b))
    base = np.abs(d - a)
    is_sound = np.minimum.reduce([crank, rocker, coupler, base]) > 1e-3 * np.abs(b).max(axis=1)
    side = np.sign(((d[:, None] - b).conj() * (c - b)).imag)
    is_sound &= (side == side[:, :1]).all(axis=1)
    angle = np.angle((b - a[:, None]) / (d - a)[:, None])
    with np.errstate(all="ignore"):
        ends = [(crank**2 + base**2 - (coupler + sign * rocker) ** 2) / (2.0 * crank * base) for sign in (1.0, -1.0)]
    has_far, has_near = ends[0] > -1.0, ends[1] < 1.0
    is_whole = ~has_far & ~has_near
    is_sound &= ~(has_far & has_near) | (np.sign(angle) == np.sign(angle[:, :1])).all(axis=1)
    # a range about the far side is counted from 0 to a turn, so that it has no gap
    angle = np.where((has_near & ~has_far)[:, None], np.mod(angle, 2.0 * np.pi), angle)
    cosine = np.cos(angle)
    is_sound &= (cosine > ends[0][:, None] + MARGIN).all(axis=1) & (cosine < ends[1][:, None] - MARGIN).all(axis=1)
    if demands.whole_turn:
        is_sound &= (ends[0] < -1.0 - MARGIN) & (ends[1] > 1.0 + MARGIN)
    if demands.in_order:
        is_sound &= _is_in_order(angle, is_whole)
    if demands.transmission is not None:
        low, high = (np.where(is_whole, end, part) for end, part in ((-np.pi, angle.min(1)), (np.pi, angle.max(1))))
        spread = low[:, None] + np.linspace(0.0, 1.0, 181) * (high - low)[:, None]
        diagonal = (crank**2 + base**2)[:, None] - 2.0 * (crank * base)[:, None] * np.cos(spread)
        with np.errstate(all="ignore"):
            inner = np.arccos(
                (coupler**2 + rocker**2)[:, None] / (2.0 * coupler * rocker)[:, None]
                - diagonal / (2.0 * coupler * rocker)[:, None]
            )
            is_sound &= np.minimum(inner, np.pi - inner).min(axis=1) > demands.transmission + 10.0 * MARGIN
    return is_sound


def _is_in_order(angle: Reals, is_whole: NDArray[np.bool_]) -> NDArray[np.bool_]:
    steps = np.diff(angle, axis=1)
    plain = (steps > 0.0).all(axis=1) | (steps < 0.0).all(axis=1)
    rounds = [np.mod(sign * steps, 2.0 * np.pi).sum(axis=1) for sign in (1.0, -1.0)]
    return np.where(is_whole, np.minimum(*rounds) < 2.0 * np.pi, plain)
