"""The profile of a cam that gives its follower a law of lift, and whether it can be made."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import degrees

import numpy as np

from planar.analysis.motion.output import Extreme
from planar.document.first_argument import takes_mechanism
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, join_names
from planar.foundation.geometry import Vector, direction
from planar.foundation.root_finding import find_root
from planar.foundation.short_repr import short_repr
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism
from planar.model.pairs.cams import CamContact
from planar.model.pairs.cams.profiled import ProfiledPair

PIECE_SAMPLES = 121
"""Of every piece of the law, both its ends among them."""
ZOOMS, ZOOM_SAMPLES = 9, 17
"""How often an extreme is looked for between the neighbours of the best sample, and at how many places."""
FINEST_STEP = 1e-6
"""rad: a profile is not divided further."""
CURVATURE_SLACK = 1e-9
"""Of the curvature at the law's start: what rounding leaves beyond the limit."""
CUT_TOLERANCE = 1e-6
"""Of a roller's radius: by how much a profile may come into it between samples."""
FLAT_CURVE = 1e12
"""A radius of curvature above so many base radii is that of a straight piece."""


@dataclass(frozen=True, eq=False)
class CamProfile:
    """A cam with its follower over a turn of the law, at samples `angle` (n,) from 0 to 2 pi (rad).

    `lift` (4, n): the lift and its first three derivatives by the cam's angle, in m, of a swinging follower in rad. At
    a joint of two pieces there are two samples. In the cam's axes, from its centre, with the x-axis along that of the
    cam (m): `profile` (n, 2), and `pitch_curve` (n, 2) of the roller's middle (of a flat face, the profile again).
    `pressure_angle` (n,) is that between the common normal and the way in which the follower's point of contact moves
    (rad), positive where the normal is turned anticlockwise from it; `curvature_radius` (n,) of the profile, positive
    where it is convex, infinite where it is straight (m).
    """

    mechanism: str
    pair: str
    cam: ProfiledPair
    shapes: tuple[LinkShape, ...] = field(repr=False)
    angle: Array = field(repr=False)

    __repr__ = short_repr

    def at(self, angle: Array) -> CamProfile:
        """The same cam at other angles of the law (rad), whose extremes are those of these samples alone."""
        return replace(self, angle=angle)

    @cached_property
    def lift(self) -> Array:
        """(4, n)."""
        rates = self.cam.lift_rates(self.angle, self.shapes)
        return np.stack(np.broadcast_arrays(*rates))

    @cached_property
    def _contact(self) -> CamContact:
        return self.contact_at(self.angle)

    def contact_at(self, angle: Array) -> CamContact:
        """Where cam and follower touch at angles of the law (rad), in the carrier's axes from the cam's centre."""
        found = self.cam.contact(self.shapes, angle)
        assert found is not None
        return found

    def _in_cam(self, vector: Vector, angle: Array) -> Array:
        """A vector of the carrier in the axes of the cam (n, 2)."""
        turned = vector.rotate(direction(-(self.cam.start + self.cam.sense * angle)))
        return np.stack(np.broadcast_arrays(turned.x, turned.y), axis=-1)

    def profile_at(self, angle: Array) -> Array:
        """The points of the profile (n, 2) at angles of the law (rad)."""
        return self._in_cam(self.contact_at(angle).point, angle)

    @cached_property
    def profile(self) -> Array:
        """(n, 2)."""
        return self._in_cam(self._contact.point, self.angle)

    @cached_property
    def normal(self) -> Array:
        """The profile's unit normals (n, 2), out of the cam."""
        return self._in_cam(self._contact.normal, self.angle)

    @cached_property
    def pitch_curve(self) -> Array:
        """(n, 2)."""
        flat = self.is_flat
        return self.profile if flat else self._in_cam(self._contact.middle, self.angle)

    @property
    def is_flat(self) -> bool:
        """Whether the follower's face is flat."""
        return self.cam.shape is not None and self.cam.shape.flat is not None

    @property
    def base_radius(self) -> float:
        """m."""
        return float(self.cam.base_radius)

    @property
    def roller_radius(self) -> float:
        """m; 0 of a point or a flat face."""
        assert self.cam.shape is not None
        return self.cam.shape.roller_radius

    @cached_property
    def pressure_angle(self) -> Array:
        """(n,), rad."""
        return self._pressure_angle(self.angle)

    def _pressure_angle(self, angle: Array) -> Array:
        at = self.contact_at(angle)
        found: Array = np.arctan2(at.velocity.cross(at.normal), at.velocity.dot(at.normal)) + 0.0 * angle
        return found

    @cached_property
    def curvature_radius(self) -> Array:
        """(n,), m."""
        found = self._contact.curvature_radius + 0.0 * self.angle
        return np.where(np.abs(found) > FLAT_CURVE * self.base_radius, np.inf, found)

    @cached_property
    def greatest_pressure_angle(self) -> Extreme:
        """The greatest size of the pressure angle (rad), and the angle of the law where it is."""
        return self._greatest(lambda angle: np.abs(self._pressure_angle(angle)))

    @cached_property
    def greatest_curvature(self) -> Extreme:
        """The greatest curvature (1/m) of the convex curve of the roller's middle, of a flat face's profile the least
        radius of curvature as a negative number (m); and the angle of the law where it is."""
        return self._greatest(self._curvature)

    @property
    def sampled_curvature(self) -> float:
        """The same, of the samples alone."""
        return float(self._curvature(self.angle).max())

    @cached_property
    def least_curvature_radius(self) -> Extreme:
        """The least radius of curvature of the convex profile (m), and the angle of the law where it is.

        Zero or less where the profile is undercut.
        """
        at, value = self.greatest_curvature
        if self.is_flat:
            return Extreme(at, -value)
        return Extreme(at, 1.0 / value - self.roller_radius if value > 0.0 else np.inf)

    def _curvature(self, angle: Array) -> Array:
        """That of the curve of the roller's middle (1/m); of a flat face less the profile's radius of curvature (m)."""
        at = self.contact_at(angle)
        if self.is_flat:
            radius: Array = -at.curvature_radius + 0.0 * angle
            return radius
        with np.errstate(divide="ignore"):
            found: Array = 1.0 / (at.pitch_radius + 0.0 * angle)
        return found

    @property
    def curvature_limit(self) -> float:
        """What `greatest_curvature` has to stay below, so that the profile is not undercut; infinite for a point."""
        if self.is_flat:
            return 0.0
        return 1.0 / self.roller_radius if self.roller_radius else np.inf

    @cached_property
    def undercut(self) -> tuple[tuple[float, float], ...]:
        """The intervals of the law's angle (rad) whose part of the profile the rest cuts away: there the follower
        cannot follow the law."""
        if not np.isfinite(self.curvature_limit):
            return ()
        slack = CURVATURE_SLACK * abs(float(self._curvature(self.angle[:1])[0]))
        below = self._curvature(self.angle) > self.curvature_limit + slack
        edges = np.flatnonzero(np.diff(below.astype(int)))
        ends = [self._edge(float(self.angle[k]), float(self.angle[k + 1])) for k in edges]
        if below[0]:
            ends.insert(0, float(self.angle[0]))
        if below[-1]:
            ends.append(float(self.angle[-1]))
        return tuple(zip(ends[::2], ends[1::2], strict=True))

    def _edge(self, low: float, high: float) -> float:
        return find_root(lambda angle: float(self._curvature(np.array([angle]))[0]) - self.curvature_limit, low, high)

    @cached_property
    def is_cut_off(self) -> bool:
        """Whether a part of the profile comes into the follower's face elsewhere than where they touch."""
        if self.is_flat:
            reach = (self.normal @ self.profile.T).max(axis=1) - np.einsum("ij,ij->i", self.normal, self.profile)
            return bool(reach.max() > CUT_TOLERANCE * self.base_radius)
        radius = self.roller_radius
        if not radius:
            return False
        apart = np.hypot(*(self.pitch_curve[:, None] - self.profile[None]).T)
        return bool(apart.min() < radius * (1.0 - CUT_TOLERANCE))

    @cached_property
    def face_reach(self) -> tuple[float, float] | None:
        """How far the place of contact goes along a flat face, to its right and left of the follower's point (m)."""
        if not self.is_flat:
            return None
        low, high = self._greatest(lambda angle: -self._along_face(angle)), self._greatest(self._along_face)
        return -low.value, high.value

    def _along_face(self, angle: Array) -> Array:
        at = self.contact_at(angle)
        found: Array = at.normal.cross(at.point - at.middle) + 0.0 * angle
        return found

    def _greatest(self, function: Callable[[Array], Array]) -> Extreme:
        """The greatest value of a function of the law's angle, and where it is."""
        values = function(self.angle)
        best = int(np.argmax(values))
        at, value = float(self.angle[best]), float(values[best])
        piece = best // PIECE_SAMPLES
        low = float(self.angle[max(best - 1, piece * PIECE_SAMPLES)])
        high = float(self.angle[min(best + 1, (piece + 1) * PIECE_SAMPLES - 1)])
        for _ in range(ZOOMS):
            tried = np.linspace(low, high, ZOOM_SAMPLES)
            found = function(tried)
            k = int(np.argmax(found))
            if found[k] > value:
                at, value = float(tried[k]), float(found[k])
            low, high = float(tried[max(k - 1, 0)]), float(tried[min(k + 1, ZOOM_SAMPLES - 1)])
        return Extreme(at, value)

    def problem(self) -> str:
        """Why this cam cannot be made, as a sentence; empty where it can."""
        if self.undercut:
            spans = [f"{degrees(low):.4g} to {degrees(high):.4g} deg" for low, high in self.undercut]
            why = (
                "a larger base circle helps"
                if self.is_flat or not self.roller_radius
                else "a larger base circle or a smaller roller helps"
            )
            return f"the profile is undercut at {join_names(spans)} of the law: the follower cannot go by it; {why}"
        if self.is_cut_off:
            part = "face" if self.is_flat else "roller" if self.roller_radius else "point"
            return f"the follower's {part} meets the profile elsewhere before it touches where the law says"
        return ""

    def points(self, tolerance: float) -> Array:
        """Angles of the law (m,) at which points of the profile lie so close that the straight lines between them are
        never further than `tolerance` (m) from the profile, as halfway between."""
        angle = np.unique(self.angle)
        while True:
            middle = 0.5 * (angle[:-1] + angle[1:])
            ends, between = self.profile_at(angle), self.profile_at(middle)
            way = np.diff(ends, axis=0)
            length = np.maximum(np.hypot(*way.T), 1e-300)
            off = between - ends[:-1]
            far = np.abs(way[:, 0] * off[:, 1] - way[:, 1] * off[:, 0]) / length
            coarse = (far > tolerance) & (np.diff(angle) > FINEST_STEP)
            if not coarse.any():
                return angle
            angle = np.sort(np.concatenate([angle, middle[coarse]]))


@takes_mechanism
def cam_profile(mechanism: Mechanism, pair: str | None = None) -> CamProfile:
    """The profile of a cam, as the envelope of its follower's face, in closed form.

    `pair` names the cam where there are several. Raises BadInput where there is none, or none with a base circle.

    >>> import planar
    >>> found = planar.cam_profile("valve-cam")
    >>> round(found.least_curvature_radius.value, 6)  # m
    0.013306
    """
    cam = find_cam(mechanism, pair)
    every = shapes_of_links(mechanism)
    shapes = tuple(every[body] for body in cam.bodies)
    angle = [
        np.linspace(piece.start, np.nextafter(piece.stop, piece.start), PIECE_SAMPLES)
        for piece in cam.lift_pieces(shapes)
    ]
    return CamProfile(mechanism.name, cam.name, cam, shapes, np.concatenate(angle))


def find_cam(mechanism: Mechanism, pair: str | None = None) -> ProfiledPair:
    """The cam of this name, or the only one, that has a profile. Raises BadInput."""
    cams = {each.name: each for each in mechanism.pairs if isinstance(each, ProfiledPair)}
    if pair is not None and pair not in cams:
        told = f"; cams are {join_names(cams)}" if cams else ""
        raise BadInput(pair, f"there is no cam of this name{told}")
    if pair is None and len(cams) != 1:
        told = f"there are {len(cams)} cams, {join_names(cams)}; name one" if cams else "the mechanism has no cam"
        raise BadInput("pair", told)
    cam = cams[pair] if pair is not None else next(iter(cams.values()))
    if cam.shape is None:
        raise BadInput(cam.name, "this cam is a law alone; its profile follows from a 'base_radius'")
    return cam


def cams_with_profiles(mechanism: Mechanism) -> Sequence[ProfiledPair]:
    """The cams of a mechanism that have profiles."""
    return [each for each in mechanism.pairs if isinstance(each, ProfiledPair) and each.shape is not None]
