"""Fixed and moving centrode of two links: the paths of their instantaneous centre in each of them, over a motion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.relative_motion import RelativeMotion, relative_motion
from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, Unknown
from planar.foundation.geometry import Frame, Vector, frame_at
from planar.foundation.jets import Jet
from planar.foundation.short_repr import short_repr
from planar.model.link_graph import link_label, link_numbers, number_separator
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion

INFINITY_RATIO = 1e-9
"""A pole whose w is this small beside x and y, in the mechanism's size, cannot be told from one at infinity."""
AS_ONE_RATIO = 1e-9
"""Links that move this little against each other, beside the greatest motion, move as one."""
STANDSTILL_RATIO = 1e-8
"""Part of the size: a pole that stays within it stands still."""
SECOND_MOTION_RATIO = 1e-5
"""At a limit there is one motion: another singular value below this part of the greatest is of a second one."""
PARTS_PER_STEP = 8
"""Parts of a step at whose ends it is looked whether the pole passes through infinity."""


class Centrode(NamedTuple):
    """The path of a pole in the axes of a link, and its rate per unit of the input (m, rad): each (n, 3), homogeneous.

    (x, y, w) is in metres, of length one when measured in the mechanism's size about its middle, and steady from row
    to row: w changes its sign only where the pole passes through infinity. NaN where the links move as one, or their
    motion is not determined; the rate is NaN at the limits of a range too.
    """

    inputs: Array
    "positions of the input that runs (n,)"
    homogeneous: Array
    rate: Array

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def position(self) -> Array:
        """(n, 2), m; NaN at infinity, and where the pole is not determined."""
        return self.homogeneous[:, :2] / self._w

    @property
    def velocity(self) -> Array:
        """Of the pole along the path, per unit of the input: (n, 2), m/rad or m/m; NaN where there is none."""
        return (self.rate[:, :2] - self.position * self.rate[:, 2:]) / self._w

    @property
    def _w(self) -> Array:
        w = self.homogeneous[:, 2:]
        return np.where(w == 0.0, np.nan, w)

    def curve(self, rows: IntArray, parts: int = 1) -> Array:
        """The path through some rows (k,), each step in so many parts: ((k - 1) parts + 1, 3), homogeneous.

        Between two rows it is the cubic that has their rates, through infinity as well: wrong by the fourth power of
        the step. Beside a limit, where all goes as the root of the way to it, a parabola of that root.
        """
        if len(rows) < 2:
            return self.homogeneous[rows]
        s = np.linspace(0.0, 1.0, parts, endpoint=False)
        inner = self._between(rows[:-1], rows[1:], s)
        return np.concatenate([inner.reshape(-1, 3), self.homogeneous[rows[-1:]]])

    def homogeneous_at(self, position: float) -> Array:
        """The pole (3,) at a position of the input between the first and the last, by the curve between two rows."""
        order = np.argsort(self.inputs, kind="stable")
        last = min(max(int(np.searchsorted(self.inputs[order], position)), 1), len(order) - 1)
        rows = order[last - 1 : last], order[last : last + 1]
        step = self.inputs[rows[1]] - self.inputs[rows[0]]
        part = (position - self.inputs[rows[0]]) / np.where(step == 0.0, 1.0, step)
        pole: Array = self._between(*rows, part)[0, 0]
        return pole

    def _between(self, first: IntArray, last: IntArray, s: Array) -> Array:
        """Steps from first rows to last ones (k,) at parts s of each: (k, parts, 3)."""
        step = (self.inputs[last] - self.inputs[first])[:, None, None]
        a, b = self.homogeneous[first][:, None], self.homogeneous[last][:, None]
        da, db = step * self.rate[first][:, None], step * self.rate[last][:, None]
        known_a, known_b = np.isfinite(da), np.isfinite(db)
        s = s[None, :, None]
        cubic = a + s * da + s**2 * (3.0 * (b - a) - 2.0 * da - db) + s**3 * (2.0 * (a - b) + da + db)
        to_limit = _parabola_from_limit(b, a, -2.0 * da, 1.0 - s)
        from_limit = _parabola_from_limit(a, b, 2.0 * db, s)
        straight = a + s * (b - a)
        one = np.where(known_a, to_limit, np.where(known_b, from_limit, straight))
        return np.where(known_a & known_b, cubic, one)


def _parabola_from_limit(limit: Array, inner: Array, slope: Array, s: Array) -> Array:
    """A parabola from a limit (s = 0) to an inner row (s = 1), where it has a slope."""
    bend = slope - (inner - limit)
    return limit + s * (inner - limit - bend) + s**2 * bend


@dataclass(frozen=True)
class Centrodes:
    """The centrodes of a link against another over a motion of n positions: they roll on each other without slipping.

    `fixed` is in the axes of `other`, `moving` in those of `link`; at every position both touch in the pole. `arcs`
    are the rows of their pieces, which end where the pole passes through infinity. `reason` says why there are no
    curves: the links turn about one point, only slide, or move as one.
    """

    link: str
    other: str
    pair: str
    "of the input that runs"
    fixed: Centrode
    moving: Centrode
    arcs: tuple[IntArray, ...]
    motion: RelativeMotion
    "of the link in the axes of the other, at every position"
    reason: str

    __repr__ = short_repr

    def placed(self, row: int, points: Array | None = None) -> Array:
        """The moving centrode, or other points of the link's axes, where they are at a position: (n, 2), m.

        In the axes of the other link.
        """
        points = self.moving.position if points is None else points
        here = RelativeMotion(*(part[row] for part in self.motion))
        return here.points_in_other(points)

    @property
    def known(self) -> IntArray:
        """The rows at which the pole is determined, be it at infinity."""
        return np.flatnonzero(np.isfinite(self.fixed.homogeneous[:, 2]))


@dataclass(frozen=True)
class CentrePath:
    """The path of the instantaneous centre of two links over a motion, in the axes of the frame.

    `homogeneous` (n, 3) is (x, y, w) in m: the point (x/w, y/w), for w = 0 at infinity in the direction (x, y); NaN
    where the links move as one, or their motion is not determined. Rows are those of the motion, of one there and back
    those of the first half.
    """

    links: tuple[str, str]
    name: str
    "I24, of the numbers of the links"
    homogeneous: Array
    reason: str
    "why the centre does not move, or is nowhere; else empty"

    __repr__ = short_repr

    @property
    def position(self) -> Array:
        """(n, 2), m; NaN at infinity, and where the centre is not determined."""
        w = self.homogeneous[:, 2:]
        return self.homogeneous[:, :2] / np.where(w == 0.0, np.nan, w)

    @property
    def direction(self) -> Array:
        """The angle (n,), rad, towards a centre at infinity; NaN where it is not at infinity."""
        x, y, w = self.homogeneous.T
        return np.where(w == 0.0, np.arctan2(y, x), np.nan)


@takes_result("Motion")
def centre_path(motion: Motion, link: str, other: str | None = None) -> CentrePath:
    """The path of the instantaneous centre of two links (the second one by default the frame), from the motion's rates.

    Over the range of an input as `centrodes` has it, its limits included; in a motion in time by the rates at each
    time, so that the centre is not determined where both links are at rest. Raises Unknown for a link that does not
    exist.

    >>> import planar
    >>> path = planar.centre_path(planar.cycle("four-bar", 12), "BC")
    >>> path.name, path.position.shape
    ('I24', (13, 2))
    """
    other = motion.mechanism.frame if other is None else other
    relative_motion(motion.frames, link, other)  # refuses what there is not
    if motion.time is None:
        found = centrodes(motion, link, other)
        poles, reason = found.fixed.homogeneous, found.reason
    else:
        places = np.concatenate([motion.point(name).position for name in motion.point_names])
        moved = _poles(motion, float(np.ptp(places, axis=0).max()) or 1.0, link, other)
        poles = moved.paths[other][0] @ moved.scale[other].T
        reason = "" if np.isfinite(poles).any() else f"{link} and {other} are at rest, or move as one, at all times"
    frame = motion.frames[other]
    x, y, cosine, sine = (
        np.broadcast_to(getattr(part, "parts", (part,))[0], len(motion))[: len(poles)]
        for part in (frame.x, frame.y, frame.cos, frame.sin)
    )
    a, b, w = poles.T
    world = np.stack([x * w + cosine * a - sine * b, y * w + sine * a + cosine * b, w], axis=1)
    return CentrePath((link, other), centre_name(motion.mechanism, link, other), world, reason)


def centre_name(mechanism: Mechanism, link: str, other: str) -> str:
    """The centre of two links by their numbers: I24."""
    numbers = link_numbers(mechanism)
    return "I" + number_separator(numbers).join(sorted((numbers[link], numbers[other]), key=int))


def links_of_centre(mechanism: Mechanism, text: str) -> tuple[str, str]:
    """The two links of a centre that is named by their numbers (I24, 24; 2,4) or by their names (BC,AD).

    Raises Unknown for a name that means no two links.
    """
    by_number = {number: link for link, number in link_numbers(mechanism).items()}
    parts = [part.strip() for part in text.split(",")]
    if len(parts) == 2 and parts[0] != parts[1] and {*parts} <= {link.name for link in mechanism.links}:
        return parts[0], parts[1]
    numbers = ",".join(parts).removeprefix("I")
    for first, second in combinations(sorted(by_number, key=int), 2):
        if numbers in (f"{first},{second}", f"{first}{number_separator(link_numbers(mechanism))}{second}"):
            return by_number[first], by_number[second]
    listed = ", ".join(link_label(number, link) for number, link in by_number.items())
    raise Unknown(f"there is no centre {text!r:.40}; write two numbers or names of links, as I12: {listed}")


class _Poles(NamedTuple):
    """The relative motion of two links, and their pole in the axes of each, with its rate, in the mechanism's size."""

    relative: RelativeMotion
    scale: Mapping[str, Array]
    paths: Mapping[str, tuple[Array, Array]]
    greatest: Array


def _poles(moved: Motion, size: float, link: str, other: str) -> _Poles:
    """The poles of a link against another from the frames and rates of a motion."""
    frame = moved.mechanism.frame
    scale = {name: _link_scale(moved, name, size) for name in (frame, other, link)}
    greatest = np.max(
        [
            _in_sizes(_relative_motion(moved, name, frame).fixed_pole[0], scale[frame])[1]
            for name in moved.frames
            if name != frame
        ],
        axis=0,
    )
    found = _relative_motion(moved, link, other)
    paths = {
        name: _unit_poles(pole, scale[name], AS_ONE_RATIO * greatest)
        for name, pole in ((other, found.fixed_pole), (link, found.moving_pole))
    }
    return _Poles(found, scale, paths, greatest)


@takes_result("Motion")
def centrodes(motion: Motion, link: str, other: str | None = None) -> Centrodes:
    """The fixed and the moving centrode of a link against another (left out: the frame), from the motion's rates.

    The input's speed does not matter; where it is zero in the file, a unit rate takes its place. At the limits of a
    range, where rates are not determined, the pole is that of the motion that the constraints leave. Raises Unknown
    for a link that is not there.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> planar.centrodes(motion, "rod").fixed.homogeneous.shape
    (13, 3)
    """
    other = motion.mechanism.frame if other is None else other
    relative_motion(motion.frames, link, other)  # refuses what there is not
    steady = InterpolatedRun(motion)
    moved = replace(steady.samples, frames=_frames_with_limit_rates(steady))
    size = steady.solver.unit
    poles = _poles(moved, size, link, other)
    signs = _continuous_signs(poles.paths[other][0])
    fixed, moving = (
        Centrode(
            steady.positions,
            signs * place @ poles.scale[name].T,
            signs * rate @ poles.scale[name].T / steady.rate,
        )
        for name, (place, rate) in poles.paths.items()
    )
    reason = _reason(fixed, poles.greatest, link, other, size)
    return Centrodes(
        link, other, steady.pair, fixed, moving, () if reason else _split_at_infinity(fixed), poles.relative, reason
    )


def usual_links(mechanism: Mechanism) -> tuple[str, str]:
    """Two links whose centrodes say most: the first coupler and the frame, else the first two moving links.

    A coupler is no link that is pinned to the frame or slides on it; best one that no pair at all joins to it. Raises
    BadInput where nothing moves.
    """
    frame = mechanism.frame
    moving = [link for link in link_numbers(mechanism) if link != frame]
    if not moving:
        raise BadInput(mechanism.name, "the mechanism has no moving link, so there are no centrodes")
    on_frame = [pair for pair in relative_motions(mechanism).values() if frame in pair.links]
    pinned = {
        link for pair in on_frame if pair.is_lower_pair and pair.input_kind is MeasureKind.ANGLE for link in pair.links
    }
    guided = {link for pair in on_frame if pair.is_lower_pair for link in pair.links}
    joined = {link for pair in on_frame for link in pair.links}
    for out in (joined, guided, pinned):
        free = [link for link in moving if link not in out]
        if free:
            return free[0], frame
    return (moving[1], moving[0]) if len(moving) > 1 else (moving[0], frame)


def _relative_motion(moved: Motion, link: str, other: str) -> RelativeMotion:
    """The motion of a link against another, with a row for every position."""
    found, many = relative_motion(moved.frames, link, other), len(moved)
    return RelativeMotion(
        *(
            np.broadcast_to(part, (many, *part.shape[part.ndim - whole :]))
            for part, whole in zip(found, (1, 1, 1, 0, 0, 0), strict=True)
        )
    )


def _link_scale(moved: Motion, link: str, size: float) -> Array:
    """What puts homogeneous points measured in the size, about the mechanism's middle, into a link's axes (3, 3), m."""
    places = np.mean([moved.point(name).position for name in moved.point_names], axis=0)
    local = moved.frames[link].to_local(Vector(*places.T))
    x, y = (np.mean(part.parts[0] if isinstance(part, Jet) else part) for part in local)
    return np.array([[size, 0.0, x], [0.0, size, y], [0.0, 0.0, 1.0]])


def _in_sizes(poles: Array, scale: Array) -> tuple[Array, Array]:
    """Poles in the mechanism's size, and their lengths (n, 1)."""
    poles = poles @ np.linalg.inv(scale).T
    return poles, np.linalg.norm(poles, axis=1, keepdims=True)


def _unit_poles(pole: tuple[Array, Array], scale: Array, least: Array) -> tuple[Array, Array]:
    """Poles (n, 3) of length one with their rates, in the mechanism's size; NaN where there is no more motion than the
    least (n, 1)."""
    at, length = _in_sizes(pole[0], scale)
    rate, _ = _in_sizes(pole[1], scale)
    length = np.where(length > least, length, np.nan)
    at, rate = at / length, rate / length
    rate -= at * (at * rate).sum(axis=1, keepdims=True)
    at[np.abs(at[:, 2]) <= INFINITY_RATIO, 2] = 0.0
    return at, rate


def _continuous_signs(poles: Array) -> Array:
    """The signs (n, 1) with which poles go on steadily: where the links rest in passing, all of a twist turns round."""
    signs = np.ones(len(poles))
    known = np.flatnonzero(np.isfinite(poles[:, 2]))
    if len(known):
        along = (poles[known[1:]] * poles[known[:-1]]).sum(axis=1)
        signs[known] = np.cumprod(np.append(1.0, np.where(along < 0.0, -1.0, 1.0)))
    return signs[:, None]


def _split_at_infinity(fixed: Centrode) -> tuple[IntArray, ...]:
    """The rows of the pieces of a curve, cut where w vanishes at a row or between two."""
    known = np.flatnonzero(np.isfinite(fixed.homogeneous[:, 2]))
    w = fixed.curve(known, PARTS_PER_STEP)[:, 2]
    senses = np.sign(w[np.arange(len(known) - 1)[:, None] * PARTS_PER_STEP + np.arange(PARTS_PER_STEP + 1)])
    cuts = np.flatnonzero(senses.min(axis=1) != senses.max(axis=1)) + 1
    pieces = np.split(known, cuts)
    return tuple(piece for piece in pieces if np.all(fixed.homogeneous[piece, 2] != 0.0))


def _reason(fixed: Centrode, greatest: Array, link: str, other: str, size: float) -> str:
    """Why there are no curves, if there are none."""
    poles = fixed.homogeneous[np.isfinite(fixed.homogeneous[:, 2])]
    if not len(poles):
        if np.isfinite(greatest).any():
            return f"{link} and {other} move as one, so that every point is their centre"
        return "the motion is not determined at any position"
    finite = poles[poles[:, 2] != 0.0]
    if not len(finite):
        return f"{link} only slides against {other}: their centre is always at infinity"
    if len(finite) == len(poles) and np.ptp(finite[:, :2] / finite[:, 2:], axis=0).max() <= STANDSTILL_RATIO * size:
        return f"{link} turns against {other} about one point, which is their centre always"
    return ""


def _frames_with_limit_rates(steady: InterpolatedRun) -> Mapping[str, Frame]:
    """The frames of a motion's samples, with first rates at limits too, of any size: those of the one motion there."""
    solver, program = steady.solver, steady.solver.functions
    running = [given.pair for given in solver.mechanism.inputs].index(steady.pair)
    by = solver.unit if solver.relative_motions[steady.pair].input_kind is MeasureKind.LENGTH else 1.0
    rates = {}
    for row in np.flatnonzero(~steady.has_rates).tolist():
        z, u = steady.z[row], solver.inputs.u.copy()
        u[running] = steady.positions[row] / by
        slopes, drives = program.jacobians(z[None], u[None], solver.inputs.p)
        _, values, ways = np.linalg.svd(np.hstack([slopes[0], drives[0][:, running : running + 1]]))
        if len(values) < len(z) or values[len(z) - 1] <= SECOND_MOTION_RATIO * values[0]:
            continue  # branches cross, or there is more than one motion
        y1 = np.concatenate([ways[-1][:-1], np.zeros_like(u)])
        y1[len(z) + running] = ways[-1][-1]
        still_ = np.zeros_like(y1)
        rates[row] = program.kinematics(np.concatenate([z, u]), y1, still_, solver.inputs.p).w1 * solver.scale
    return {link: _with_first_rates(link, frame, rates, solver.column) for link, frame in steady.samples.frames.items()}


def _with_first_rates(
    link: str, frame: Frame, rates: Mapping[int, Array], column: Mapping[tuple[str, str], int]
) -> Frame:
    """A frame with other first rates in some rows."""
    if frame.fixed or not rates:
        return frame
    parts = []
    for part in ("x", "y", "angle"):
        position, rate, second = getattr(frame, part).parts
        rate = np.array(rate)
        for row, w1 in rates.items():
            rate[row] = w1[column[link, part]]
        parts.append(Jet(position, rate, second))
    return frame_at(*parts)
