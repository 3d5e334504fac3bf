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
from planar.foundation.arrays import Array, IntArray
from planar.foundation.geometry import Vector, direction
from planar.foundation.jets import Jet, Scalar, atan2, hypot
from planar.model.pairs.cams import FollowerFace, FollowerRest, rest_position
from planar.model.pairs.cams.profile_curve import ProfileCurve

ANGLES = 720
"""Over a turn, at which contacts are looked for anywhere on the curve."""
NEWTON_STEPS, SETTLED_STEP = 10, 1e-13
"""At most, and of the profile's size the step that is the last."""
ZERO_SLOPE = 1e-7
"""Of the greatest slope of the follower's position along the curve: what is less is none."""
JUMP_TOLERANCE = 1e-9
"""Of the profile's size: two contacts at a jump of contact are as high."""
LEAST_DISTANCE = 4
"""Samples of the curve between two contacts that may be two, and not one that goes on."""
CANDIDATES = 3
"""Tops of a row of samples of which the highest is chosen."""
BISECTIONS = 45
"""From a step between samples to rounding."""
SAME_CONTACT = 1e-4
"""Of the profile's size: nearer contacts on both sides of an angle are one that moves fast."""
STRUCK = "the follower is struck from the side at {angle:.4g} deg of the cam, where the profile is steeper than its way"


class ContactRates(NamedTuple):
    """The lift with its first two derivatives by the cam's angle (m or rad), each (...,)."""

    lift: Array
    first: Array
    second: Array


class ContactMotion(NamedTuple):
    """Where the contact is at `angles` (n,) of the cam (rad) over a turn, as parameters of the curve (n,): it goes on,
    but at `jump_angles[k]` it goes from `before[k]` to `after[k]`."""

    angles: Array
    parameters: Array
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
        least = 2 * ANGLES if not self.is_point else 4 * ANGLES
        self._samples = curve.samples(max(4, -(-least // (len(curve.knots) - 1))))
        self._turned = self._ways = np.zeros(0)  # of a point: where each point of the curve meets it
        with np.errstate(invalid="ignore", divide="ignore"):
            self.motion = self._point_motion() if self.is_point else self._face_motion()

    def rates(self, angle: Array, near: Array) -> ContactRates:
        """The lift with its rates at contacts (of a point near them)."""
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

    def _polish(self, angle: Array, near: Array, reach: float) -> tuple[Array, Array]:
        """The highest point of the curve within reach of parameters, and the slope that is left there."""
        found, slope = near, np.full_like(near, np.inf)
        for _ in range(NEWTON_STEPS):
            slope, bend = self._along(angle, found, 0.0, 1.0)
            step = np.where(bend < 0.0, -slope / np.minimum(bend, -1e-300), np.sign(slope) * 0.25 * reach)
            before, found = found, np.clip(found + np.nan_to_num(step), near - reach, near + reach)
            if not (np.abs(found - before) > SETTLED_STEP * self.size).any():
                break
        return found, slope

    def parameters(self, angle: Array) -> Array:
        """Where the contact is at angles of the cam (n,): anywhere on the curve."""
        if self.is_point:
            found: Array = np.interp((angle - self._turned[0]) % (2.0 * pi) + self._turned[0], self._turned, self._ways)
            return found
        return self._highest(angle)[0]

    def _highest(self, angle: Array) -> tuple[Array, Array]:
        """The parameters (n,) of the highest point at angles (n,), and the slope that is left there; NaN where the
        follower does not reach the curve."""
        heights = np.nan_to_num(self._lift_of(angle[:, None], self._samples[None]), nan=-np.inf)
        is_peak = (heights >= np.roll(heights, 1, axis=1)) & (heights > np.roll(heights, -1, axis=1))
        rows, spacing = np.arange(len(angle)), float(np.diff(self._samples).max())
        peaks = np.where(is_peak, heights, -np.inf)
        tops, is_top = np.zeros((CANDIDATES, len(angle)), int), np.zeros((CANDIDATES, len(angle)), bool)
        for k in range(CANDIDATES):  # of tops of samples the true ones may have another order
            tops[k] = np.argmax(peaks, axis=1)
            is_top[k] = np.isfinite(peaks[rows, tops[k]])
            peaks[rows, tops[k]] = -np.inf
        height, at, slope = (np.full(tops.shape, value) for value in (-np.inf, np.nan, np.nan))
        if is_top.any():
            angles = np.broadcast_to(angle, tops.shape)[is_top]
            at[is_top], slope[is_top] = self._polish(angles, self._samples[tops[is_top]], 1.5 * spacing)
            height[is_top] = np.nan_to_num(self._lift_of(angles, at[is_top]), nan=-np.inf)
        best = np.argmax(height, axis=0)
        return at[best, rows], slope[best, rows]

    def _face_rates(self, angle: Array, at: Array) -> ContactRates:
        first, by_angle = self._along(angle, at, 1.0, 0.0)
        _, by_both = self._along(angle, at, 1.0, 1.0)
        _, by_way = self._along(angle, at, 0.0, 1.0)
        mixed = 0.5 * (by_both - by_angle - by_way)
        return ContactRates(self._lift_of(angle, at), first, by_angle - mixed * mixed / by_way)

    def _face_motion(self) -> ContactMotion | None:
        angles = np.arange(ANGLES) * (2.0 * pi / ANGLES)
        found, slope = self._highest(angles)
        if not np.isfinite(found).all():
            at = angles[int(np.argmin(np.isfinite(found)))]
            self.problem = f"the follower does not reach the profile at {degrees(at):.4g} deg of the cam"
            return None
        scale = float(np.nanmedian(np.abs(self._along(angles[::9, None], self._samples[None, ::7], 0.0, 1.0)[0])))
        if not np.all(np.abs(slope) <= ZERO_SLOPE * scale):
            self.problem = STRUCK.format(
                angle=degrees(angles[int(np.argmax(np.nan_to_num(np.abs(slope), nan=np.inf)))])
            )
            return None
        apart = np.abs(self._apart(np.roll(found, -1), found))
        jumps = np.flatnonzero(apart > LEAST_DISTANCE * float(np.diff(self._samples).max()))
        return self._with_jumps(angles, found, jumps)

    def _apart(self, one: Array, other: Array) -> Array:
        """How far a parameter is ahead of another, the short way round."""
        whole = float(self.curve.knots[-1])
        found: Array = (one - other + 0.5 * whole) % whole - 0.5 * whole
        return found

    def _with_jumps(self, angles: Array, found: Array, near: IntArray) -> ContactMotion | None:
        """The jumps among the steps after samples `near`, by bisection: whether the contact is still near the one
        before, or near the other."""
        low, one, other = angles[near], found[near], found[(near + 1) % ANGLES]
        high: Array = low + 2.0 * pi / ANGLES
        for _ in range(BISECTIONS if len(near) else 0):
            middle = 0.5 * (low + high)
            here = self._highest(middle)[0]
            is_before = np.abs(self._apart(here, one)) < np.abs(self._apart(here, other))
            low, one = np.where(is_before, middle, low), np.where(is_before, here, one)
            high, other = np.where(is_before, high, middle), np.where(is_before, other, here)
        is_jump = np.abs(self._apart(one, other)) > SAME_CONTACT * self.size
        at, one, other, near = low[is_jump], one[is_jump], other[is_jump], near[is_jump]
        gap = np.abs(self._lift_of(at, one) - self._lift_of(at, other))
        bad = ~(gap <= JUMP_TOLERANCE * (self.size if self.axes.line is not None else 1.0))
        if bad.any():
            self.problem = STRUCK.format(angle=degrees(float(at[int(np.argmax(bad))])))
            return None
        return ContactMotion(angles, found, at, one, other)

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
        turned, _ = self._point_angles(self._samples)
        if not np.isfinite(turned).all():
            self.problem = "the follower does not reach every point of the profile"
            return None
        one = np.ones_like(self._samples)
        slope = self._point_angles(Jet(self._samples, one, 0.0 * one))[0].parts[1]
        if not slope.max() < 0.0:
            self.problem = STRUCK.format(angle=degrees(float(turned[int(np.argmax(slope))])) % 360.0)
            return None
        self._turned = np.unwrap(np.append(turned, turned[0]))[::-1]
        self._ways = np.append(self._samples, self.curve.knots[-1])[::-1]
        if abs(self._turned[-1] - self._turned[0] - 2.0 * pi) > 1e-6:
            self.problem = "the profile does not go round before the follower"
            return None
        angles, none = np.arange(ANGLES) * (2.0 * pi / ANGLES), np.zeros(0)
        return ContactMotion(angles, self.parameters(angles), none, none, none)

    def _point_rates(self, angle: Array, near: Array) -> ContactRates:
        found, one = near, np.ones_like(near)
        for _ in range(NEWTON_STEPS):
            turned, _ = self._point_angles(Jet(found, one, 0.0 * one))
            found = found - wrap_angle(turned.parts[0] - angle) / turned.parts[1]
        turned, lift = self._point_angles(Jet(found, one, 0.0 * one))
        (_, t1, t2), (s, s1, s2) = turned.parts, lift.parts
        return ContactRates(s, s1 / t1, (s2 * t1 - s1 * t2) / (t1 * t1 * t1))
