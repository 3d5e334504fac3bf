"""The lift of a cam whose profile is given by points: pieces of the motion that follows from the first contact.

On every piece the lift is the polynomial of degree five that has the lift of the contact with its first two derivatives
at both ends (Hermite's), so the acceleration goes on but at jumps of the contact, where pieces end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import degrees, pi
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector
from planar.foundation.jets import Jet, Scalar, TermSizes, constant_jet, value_between, within_turn
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.pairs.base import MeasureKind
from planar.model.pairs.cams import FollowerAxes, FollowerFace, FollowerRest
from planar.model.pairs.cams.first_contact import ContactMotion, FirstContact
from planar.model.pairs.cams.lift_law import LiftPiece
from planar.model.pairs.cams.profile_curve import (
    find_hollow,
    find_profile_problem,
    profile_curve,
)

MIN_PIECES, MAX_PIECES = 72, 240
"""Polynomials over a turn: one a point of the profile between these."""
HEAD = 4
"""Numbers before those of the pieces: where the first starts, and the greatest lift, first and second derivative."""
PIECE = 8
"""Numbers of a piece: where it starts, the inverse of its length, six coefficients."""
COARSE_PIECES = 24
"""Of these over a turn, before the worst are halved."""
COMPARED_PARTS = (0.2, 0.5, 0.8)
"""Of a piece, where it is compared with the contact."""
TOLD_PIECES = 12
"""Parts of a turn of which something is told, beside where the contact jumps."""


class ContactJump(NamedTuple):
    """The angle of the cam (rad) at which the contact jumps along the profile, from one point in the cam's axes to
    another (m), and the derivative of the lift by the angle before and after (m or rad)."""

    angle: float
    start: tuple[float, float]
    end: tuple[float, float]
    rate_before: float
    rate_after: float


class _Pieces(NamedTuple):
    """Polynomials from `start` to `stop` (n,), their `coefficients` (6, n) and how far they are off (n,)."""

    start: Array
    stop: Array
    coefficients: Array
    deviation: Array


class SolvedLift(NamedTuple):
    """The numbers of a lift, by how much it is off the contact's at the most (m or rad), where the contact jumps, and
    why there is none; empty where there is one."""

    numbers: tuple[float, ...]
    deviation: float
    jumps: tuple[ContactJump, ...]
    problem: str


@dataclass(frozen=True)
class ProfileLift:
    """A closed profile through points in the cam's axes from its centre (m), anticlockwise."""

    points: tuple[tuple[float, float], ...]

    @property
    def piece_count(self) -> int:
        """Of polynomials."""
        return min(max(len(self.points), MIN_PIECES), MAX_PIECES)

    @property
    def least_radius(self) -> Scalar:
        """The radius of the base circle (m): the greatest about the centre within the profile."""
        flat = [part for point in self.points for part in point]
        return _for_each(lambda *parts: (profile_curve(_as_points(parts)).least_radius,), flat)[0]

    def number_kinds(self, lift: MeasureKind) -> tuple[MeasureKind, ...]:
        """What each of the numbers of `lift` is."""
        of = lift if lift is MeasureKind.LENGTH else MeasureKind.PURE
        pure = MeasureKind.PURE
        return (pure, of, of, of, *(pure, pure, *(of,) * 6) * self.piece_count)

    def measure(self, rest: FollowerRest) -> tuple[Scalar, ...]:
        """The numbers of `lift`; not a number where the follower cannot go round."""
        axes, face, base = rest
        keys = (axes.line is not None, face.normal is not None, axes.side)
        given = [
            *axes.centre,
            *axes.origin,
            *(axes.line or ()),
            *axes.arm,
            face.roller_radius,
            *(face.normal or ()),
            base,
        ]
        points = [part for point in self.points for part in point]
        many = len(given)

        def numbers(*values: float) -> tuple[float, ...]:
            return _solve_lift(_as_points(values[many:]), keys, values[:many], self.piece_count).numbers

        return _for_each(numbers, [*given, *points])

    def solved(self, rest: FollowerRest) -> SolvedLift:
        """The lift with what is to be said of it, of plain numbers."""
        axes, face, base = rest
        keys = (axes.line is not None, face.normal is not None, axes.side)
        given = [
            *axes.centre,
            *axes.origin,
            *(axes.line or ()),
            *axes.arm,
            face.roller_radius,
            *(face.normal or ()),
            base,
        ]
        return _solve_lift(_floats(self.points), keys, tuple(map(float, given)), self.piece_count)

    def lift(self, angle: Scalar, numbers: Sequence[Scalar]) -> Scalar:
        """The lift (m or rad) at an angle of the cam, in any arithmetic."""
        first, size, slope, bend, *pieces = numbers
        if isinstance(angle, TermSizes):
            _, rate, second = angle.parts
            return TermSizes(size, slope * rate, slope * second + bend * rate * rate)
        at = within_turn(angle - first)
        start, inverse, *coefficients = _select_piece(at, pieces)
        x = (at - start) * inverse
        total: Scalar = coefficients[-1]
        for each in reversed(coefficients[:-1]):
            total = x * total + each
        return total

    def lift_rates(self, angle: Scalar, numbers: Sequence[Scalar]) -> tuple[Scalar, ...]:
        """The lift and its first three derivatives by the cam's angle."""
        lift: Jet = self.lift(Jet(angle, 1.0, 0.0, 0.0), [constant_jet(number, 4) for number in numbers])
        return lift.parts

    def lift_pieces(self, rest: FollowerRest) -> list[LiftPiece]:
        """Parts of a turn, in plain numbers: they end where the contact jumps."""
        solved = self.solved(rest)
        jumps = [jump.angle for jump in solved.jumps]
        first = jumps[0] if jumps else 0.0
        ends = sorted(
            {*(jump - first for jump in jumps), *(2.0 * pi * k / TOLD_PIECES for k in range(TOLD_PIECES + 1))}
        )
        return [
            LiftPiece("profile", first + start, first + stop, True)
            for start, stop in pairwise(ends)
            if stop - start > 1e-9
        ]

    def piece_starts(self, rest: FollowerRest) -> list[float]:
        """Angles of the law at which one polynomial of the lift ends and the next begins."""
        first, _, _, _, *pieces = self.solved(rest).numbers
        return [first + start for start in pieces[::PIECE]]

    def find_problem(self, rest: FollowerRest) -> str:
        """Why the follower cannot go round; empty where it can."""
        wrong = find_profile_problem(_floats(self.points))  # which changed numbers may bring
        if wrong is not None:
            return f"the profile's points{wrong[0]}: {wrong[1]}" if wrong[0] else wrong[1]
        if rest.face.normal is not None:
            hollow = find_hollow(_floats(self.points))
            if hollow is not None:
                told = f"at its point {hollow[0]}, at {hollow[1]:.4g} deg of its axes"
                return f"a flat face needs a convex profile, but this one is hollow {told}"
        return self.solved(rest).problem

    def outline(self, many: int) -> Array:
        """Points of the profile (many, 2) in the cam's axes from its centre."""
        curve = profile_curve(_floats(self.points))
        return np.stack(curve.at(np.linspace(0.0, curve.knots[-1], many)), axis=-1)


def _floats(points: Sequence[Sequence[float]]) -> tuple[tuple[float, float], ...]:
    return tuple((float(x), float(y)) for x, y in points)


def _as_points(parts: Sequence[float]) -> tuple[tuple[float, float], ...]:
    return tuple(zip(parts[::2], parts[1::2], strict=True))


def _for_each(function: Any, values: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """Numbers of numbers, or of arrays of them (designs,), one design after the other."""
    if all(np.ndim(value) == 0 for value in values):
        found: tuple[Scalar, ...] = function(*map(float, values))
        return found
    rows = np.stack(np.broadcast_arrays(*values)).reshape(len(values), -1)
    return tuple(np.array([function(*row) for row in rows.T.tolist()]).T)


def _select_piece(at: Scalar, pieces: Sequence[Scalar]) -> list[Scalar]:
    """The numbers of the piece in which an angle lies."""
    starts = pieces[::PIECE]
    value = at.parts[0] if isinstance(at, Jet) else at
    if isinstance(value, float | complex | np.ndarray) and all(isinstance(each, float) for each in pieces):
        k = np.searchsorted(np.array(starts[1:]), np.asarray(np.real(value)), side="right")
        return list(np.array(pieces).reshape(-1, PIECE).T[:, k])
    ends = [*starts[1:], None]
    flags = [
        value_between(value, start if k else None, end, 1.0)
        for k, (start, end) in enumerate(zip(starts, ends, strict=True))
    ]
    return [
        sum(
            (flag * each for flag, each in zip(flags[1:], pieces[k + PIECE :: PIECE], strict=True)),
            flags[0] * pieces[k],
        )
        for k in range(PIECE)
    ]


@lru_cache(maxsize=256)
def _solve_lift(
    points: tuple[tuple[float, float], ...], keys: tuple[bool, bool, float], given: tuple[float, ...], pieces: int
) -> SolvedLift:
    """The lift of a follower that slides or not, with a flat face or not, to a side, with its sizes."""
    slides, is_flat, side = keys
    rest = iter(given)

    def vector() -> Vector:
        return Vector(next(rest), next(rest))

    centre, origin = vector(), vector()
    axes = FollowerAxes(centre, origin, vector() if slides else None, vector(), side)
    face = FollowerFace(next(rest), vector() if is_flat else None)
    follower = FollowerRest(axes, face, next(rest))
    none = (float("nan"),) * (HEAD + PIECE * pieces)
    if not np.isfinite(given).all() or not np.isfinite(points).all():
        return SolvedLift(none, 0.0, (), "a number of the cam is not finite")
    contact = FirstContact(profile_curve(points), follower)
    motion = contact.motion
    if motion is None:
        return SolvedLift(none, 0.0, (), contact.problem)
    if len(motion.jump_angles) > pieces // 2:
        return SolvedLift(none, 0.0, (), f"the contact jumps {len(motion.jump_angles)} times in a turn")
    return _fit_pieces(contact, motion, pieces)


def _fit_pieces(contact: FirstContact, motion: ContactMotion, pieces: int) -> SolvedLift:
    """The polynomials: a coarse division, then always the pieces halved that are off most."""
    first = float(motion.jump_angles[0]) if len(motion.jump_angles) else 0.0
    fixed = np.append(motion.jump_angles - first if len(motion.jump_angles) else [0.0], 2.0 * pi)
    joints = [
        low + (high - low) * k / n for low, high in pairwise(fixed) for n in [_coarse(high - low)] for k in range(n)
    ]
    made = _make_pieces(contact, motion, first, np.array(joints), np.append(joints[1:], 2.0 * pi))
    while len(made.start) < pieces:
        count = min(pieces - len(made.start), max(1, len(made.start) // 4))
        worst = np.argsort(made.deviation)[len(made.start) - count :]
        middle = 0.5 * (made.start + made.stop)[worst]
        kept = _Pieces(*(np.delete(each, worst, axis=-1) for each in made))
        ends = np.concatenate([middle, made.stop[worst]])
        halves = _make_pieces(contact, motion, first, np.concatenate([made.start[worst], middle]), ends)
        made = _Pieces(*(np.concatenate(each, axis=-1) for each in zip(kept, halves, strict=True)))
    made = _Pieces(*(each[..., np.argsort(made.start)] for each in made))
    rates = contact.rates(motion.angles, motion.parameters)
    sizes = [float(np.abs(rate).max()) for rate in rates]
    if not np.isfinite(made.coefficients).all():
        return SolvedLift((float("nan"),) * (HEAD + PIECE * pieces), 0.0, (), "the contact has no acceleration")
    rows = np.vstack([made.start, 1.0 / (made.stop - made.start), made.coefficients])
    off = float(made.deviation.max())
    return SolvedLift((first, *sizes, *rows.T.ravel().tolist()), off, tuple(_jumps(contact, motion)), "")


def _coarse(length: float) -> int:
    """Pieces over an angle to begin with."""
    return max(1, round(length / (2.0 * pi) * COARSE_PIECES))


def _make_pieces(contact: FirstContact, motion: ContactMotion, first: float, start: Array, stop: Array) -> _Pieces:
    """Polynomials between angles from the first; jumps have their contacts before and after."""
    step = stop - start
    offsets = np.stack([start, stop, *(start + part * step for part in COMPARED_PARTS)])
    angles = (first + offsets).ravel()
    parameters = contact.parameters(angles).reshape(offsets.shape)
    for angle, before, after in zip(motion.jump_angles - first, motion.before, motion.after, strict=True):
        parameters[0] = np.where(start == angle, after, parameters[0])
        parameters[1] = np.where((stop == angle) | (stop == angle + 2.0 * pi), before, parameters[1])
    rates = contact.rates(angles, parameters.ravel())
    lift, velocity, acceleration = (rate.reshape(offsets.shape) for rate in rates)
    scaled = [np.stack([lift[end], velocity[end] * step, acceleration[end] * step * step]) for end in (0, 1)]
    found, off = _hermite_coefficients(*scaled), np.zeros_like(start)
    for part, wanted in zip(COMPARED_PARTS, lift[2:], strict=True):
        off = np.maximum(off, np.abs(sum(found[k] * part**k for k in range(6)) - wanted))
    return _Pieces(start, stop, found, off)


def _hermite_coefficients(start: Array, stop: Array) -> Array:
    """Of polynomials of degree five on 0..1 (6, n) with these values and two derivatives (3, n) at both ends."""
    p, v, a = start
    q, w, b = stop
    rise, speed, bend = q - p - v - 0.5 * a, w - v - a, b - a
    return np.stack(
        [
            p,
            v,
            0.5 * a,
            10.0 * rise - 4.0 * speed + 0.5 * bend,
            -15.0 * rise + 7.0 * speed - bend,
            6.0 * rise - 3.0 * speed + 0.5 * bend,
        ]
    )


def _jumps(contact: FirstContact, motion: ContactMotion) -> Iterator[ContactJump]:
    ends = [contact.rates(motion.jump_angles, ways).first.tolist() for ways in (motion.before, motion.after)]
    points = [
        list(zip(*(each.tolist() for each in contact.curve.at(way)), strict=True))
        for way in (motion.before, motion.after)
    ]
    for angle, start, end, before, after in zip(motion.jump_angles.tolist(), *points, *ends, strict=True):
        yield ContactJump(angle, start, end, before, after)


def jump_remarks(name: str, jumps: Sequence[ContactJump]) -> Iterator[str]:
    """What is to be said of a cam whose follower goes over hollows."""
    if not jumps:
        return
    told = (
        f"the follower of cam {name!r} goes over a hollow: at {degrees(jumps[0].angle):.6g} deg of the cam the contact"
    )
    more = f"; so it does at {len(jumps) - 1} more angles" if len(jumps) > 1 else ""
    yield f"{told} jumps along the profile, and the follower's speed with it{more}"


def read_profile(entry: EntryReader, key: str) -> ProfileLift:
    """The points under a key of an entry."""
    found = ProfileLift(tuple((x, y) for x, y in entry.quantity_lists(key, "length", 2)))
    wrong = find_profile_problem(found.points)
    if wrong is not None:
        raise entry.error_at(f"{key}{wrong[0]}", wrong[1])
    return found


def write_profile(lift: ProfileLift, quantity: QuantityWriter) -> list[list[float | str]]:
    """The points as an entry has them."""
    return [[quantity(x, "length"), quantity(y, "length")] for x, y in lift.points]
