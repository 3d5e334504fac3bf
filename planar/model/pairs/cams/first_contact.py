"""The motion of a follower on a closed curve that turns: the first contact anywhere, and jumps between two contacts.

Every point of the curve holds the follower as a base circle without radius does there: the highest of these positions
is where it rests, and there the derivative along the curve is none. The rates follow from the theorem of implicit
functions. A point of a follower is the other way round: each point of the curve has its one angle of the cam.
"""

from __future__ import annotations

from math import degrees, pi
from typing import NamedTuple

import numpy as np

from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector, direction
from planar.foundation.jets import Jet, Scalar, atan2, hypot
from planar.model.pairs.cams import FollowerAxes, FollowerFace, FollowerRest, rest_position
from planar.model.pairs.cams.profile_curve import ProfileCurve

ANGLES = 720
"""Over a turn, at which contacts are looked for anywhere on the curve."""
NEWTON_STEPS = 10
ZERO_SLOPE = 1e-7
"""Of the greatest slope of the follower's position along the curve: what is less is none."""
JUMP_TOLERANCE = 1e-9
"""Of the profile's size: two contacts at a jump of contact are as high."""
LEAST_DISTANCE = 4
"""Samples of the curve between two contacts that may be two, and not one that goes on."""
STRUCK = "the follower is struck from the side at {angle:.4g} deg of the cam, where the profile is steeper than its way"


class ContactRates(NamedTuple):
    """The lift with its first two derivatives by the cam's angle (m or rad), each (...,)."""

    lift: Array
    first: Array
    second: Array


class ContactMotion(NamedTuple):
    """Where the contact is at `angles` (n,) of the cam (rad) over a turn, as parameters of the curve (n,), ongoing
    except from the sample `jump_after[k]` to the next: between them, at `jump_angles[k]`, it goes from `before[k]` to
    `after[k]`."""

    angles: Array
    parameters: Array
    jump_after: Array
    jump_angles: Array
    before: Array
    after: Array


class FirstContact:
    """A follower on a curve. `problem` says why it cannot go round it; empty where it can."""

    def __init__(self, curve: ProfileCurve, rest: FollowerRest):
        self.curve, self.axes, self.face = curve, rest.axes, rest.face
        self.rest = float(rest_position(rest.axes, rest.face, rest.base_radius))
        self.is_point = rest.face.normal is None and not rest.face.roller_radius > 0.0
        x, y = curve.at(curve.samples())
        self.size = float(np.hypot(x, y).max())
        self.problem = ""
        with np.errstate(invalid="ignore", divide="ignore"):
            self.motion = self._point_motion() if self.is_point else self._face_motion()

    def rates(self, angle: Array, near: Array) -> tuple[Array, ContactRates]:
        """The contact nearest to parameters, improved by Newton's steps, and the lift there with its rates."""
        with np.errstate(invalid="ignore", divide="ignore"):
            if self.is_point:
                return self._point_rates(angle, near)
            return self._face_rates(angle, near)

    # a roller or a flat face

    def _lift_of(self, angle: Scalar, parameter: Scalar) -> Scalar:
        """The lift at which a point of the curve touches the face (m or rad); NaN where it cannot."""
        x, y = self.curve.at(parameter)
        centre = self.axes.centre + Vector(x, y).rotate(direction(angle))
        went = rest_position(self.axes._replace(centre=centre), self.face, 0.0) - self.rest
        return went if self.axes.line is not None else wrap_angle(went) * self.axes.side

    def _along(self, angle: Array, parameter: Array, turning: float, moving: float) -> tuple[Array, Array]:
        """The first two derivatives of that in a direction of angle and parameter."""
        one = np.ones_like(parameter)
        found = self._lift_of(Jet(angle, turning * one, 0.0 * one), Jet(parameter, moving * one, 0.0 * one))
        return found.parts[1], found.parts[2]

    def _contact_near(self, angle: Array, near: Array) -> tuple[Array, Array]:
        """The highest point of the curve nearest to parameters, and the slope that is left there."""
        found, most = near, float(np.diff(self.curve.knots).max())
        slope = np.full_like(near, np.inf)
        for _ in range(NEWTON_STEPS):
            slope, bend = self._along(angle, found, 0.0, 1.0)
            step = np.where(bend < 0.0, -slope / np.minimum(bend, -1e-300), np.sign(slope) * most)
            found = found + np.clip(np.nan_to_num(step), -0.3 * most, 0.3 * most)
        return found, slope

    def _face_rates(self, angle: Array, near: Array) -> tuple[Array, ContactRates]:
        at, _ = self._contact_near(angle, near)
        first, by_angle = self._along(angle, at, 1.0, 0.0)
        _, by_both = self._along(angle, at, 1.0, 1.0)
        _, by_way = self._along(angle, at, 0.0, 1.0)
        mixed = 0.5 * (by_both - by_angle - by_way)
        return at, ContactRates(self._lift_of(angle, at), first, by_angle - mixed * mixed / by_way)

    def _face_motion(self) -> ContactMotion | None:
        angles = np.arange(ANGLES) * (2.0 * pi / ANGLES)
        samples = self.curve.samples(max(4, -(-ANGLES // (len(self.curve.knots) - 1))))
        heights = np.nan_to_num(self._lift_of(angles[:, None], samples[None]), nan=-np.inf)
        highest = np.argmax(heights, axis=1)
        if not np.isfinite(heights.max(axis=1)).all():
            at = angles[int(np.argmin(heights.max(axis=1)))]
            self.problem = f"the follower does not reach the profile at {degrees(at):.4g} deg of the cam"
            return None
        found, slope = self._contact_near(angles, samples[highest])
        scale = float(np.nanmax(np.abs(self._along(angles[:, None], samples[None, ::7], 0.0, 1.0)[0])))
        if not np.all(np.abs(slope) <= ZERO_SLOPE * scale):
            self.problem = STRUCK.format(angle=degrees(angles[int(np.argmax(np.nan_to_num(np.abs(slope), nan=np.inf)))]))
            return None
        jumps = [j for j in range(ANGLES) if self._jumps(heights, highest, j)]
        return self._with_jumps(angles, found, np.array(jumps, dtype=int))

    def _jumps(self, heights: Array, highest: Array, j: int) -> bool:
        """Whether the contact after a sample is another one: there is a valley between them, before or after."""
        here, there, many = int(highest[j]), int(highest[(j + 1) % ANGLES]), heights.shape[1]
        way = (there - here + many // 2) % many - many // 2
        if abs(way) < LEAST_DISTANCE:
            return False
        between = (here + np.arange(0, way, 1 if way > 0 else -1)) % many
        return any(
            bool(np.any(np.diff(heights[row % ANGLES, between] * sense) < 0.0))
            for row, sense in ((j, -1.0), (j + 1, 1.0))
        )

    def _with_jumps(self, angles: Array, found: Array, jumps: Array) -> ContactMotion | None:
        step = 2.0 * pi / ANGLES
        at, one, other = angles[jumps], found[jumps], found[(jumps + 1) % ANGLES]
        low, high = at.copy(), at + step
        if len(jumps):
            gap = np.zeros(len(jumps))
            at = at + 0.5 * step
            for _ in range(60):  # bisection: the first contact is the higher one before, the other after
                one, other = self._contact_near(at, one)[0], self._contact_near(at, other)[0]
                gap = self._lift_of(at, one) - self._lift_of(at, other)
                low, high = np.where(gap > 0.0, at, low), np.where(gap > 0.0, high, at)
                at = 0.5 * (low + high)
            scale = self.size if self.axes.line is not None else 1.0
            bad = ~(np.abs(gap) <= JUMP_TOLERANCE * scale)
            if bad.any():
                self.problem = STRUCK.format(angle=degrees(float(at[int(np.argmax(bad))])))
                return None
        return ContactMotion(angles, found, jumps, at, one, other)

    # a point

    def _point_angles(self, parameter: Scalar) -> tuple[Scalar, Scalar]:
        """The angle of the cam at which a point of the curve is where the follower's point is, and the lift there."""
        x, y = self.curve.at(parameter)
        far = rest_position(self.axes, FollowerFace(0.0, None), hypot(x, y))
        if self.axes.line is not None:
            at = self.axes.origin + self.axes.line * far - self.axes.centre
        else:
            at = self.axes.origin + self.axes.arm.rotate(direction(far)) - self.axes.centre
        middle = Vector(x, y)
        went = far - self.rest
        lift = went if self.axes.line is not None else wrap_angle(went) * self.axes.side
        return atan2(middle.cross(at), middle.dot(at)), lift

    def _point_motion(self) -> ContactMotion | None:
        samples = self.curve.samples(max(4, -(-2 * ANGLES // (len(self.curve.knots) - 1))))
        turned, _ = self._point_angles(samples)
        if not np.isfinite(turned).all():
            self.problem = "the follower does not reach every point of the profile"
            return None
        slope = self._point_angles(Jet(samples, np.ones_like(samples), 0.0 * samples))[0].parts[1]
        if not slope.max() < 0.0:
            self.problem = STRUCK.format(angle=degrees(float(turned[int(np.argmax(slope))])) % 360.0)
            return None
        whole = np.unwrap(np.append(turned, turned[0]))[::-1]
        if abs(whole[-1] - whole[0] - 2.0 * pi) > 1e-6:
            self.problem = "the profile does not go round before the follower"
            return None
        ways = np.append(samples, self.curve.knots[-1])[::-1]
        angles = np.arange(ANGLES) * (2.0 * pi / ANGLES)
        shifted = (angles - whole[0]) % (2.0 * pi) + whole[0]
        found, none = np.interp(shifted, whole, ways), np.zeros(0)
        return ContactMotion(angles, found, np.zeros(0, dtype=int), none, none, none)

    def _point_rates(self, angle: Array, near: Array) -> tuple[Array, ContactRates]:
        found, one = near, np.ones_like(near)
        for _ in range(NEWTON_STEPS):
            turned, _ = self._point_angles(Jet(found, one, 0.0 * one))
            found = found - wrap_angle(turned.parts[0] - angle) / turned.parts[1]
        turned, lift = self._point_angles(Jet(found, one, 0.0 * one))
        (_, t1, t2), (s, s1, s2) = turned.parts, lift.parts
        return found, ContactRates(s, s1 / t1, (s2 * t1 - s1 * t2) / (t1 * t1 * t1))
