"""Cams as plates by their profiles, and what of a follower touches them: a roller, or the shoe of a flat face."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, hypot, sin
from typing import NamedTuple

import numpy as np

from planar.analysis.cams.cam_profile import cam_profile
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Frame, Vector
from planar.manufacture.plates import Place, Vertex, convex_hull
from planar.model.link_shapes import LinkShape, link_shape
from planar.model.mechanism import Mechanism
from planar.model.pairs.cams.profile_curve import profile_curve
from planar.model.pairs.cams.profiled import ProfiledPair

TOLERANCE = 0.005
"""mm, within which straight lines keep to a profile."""
HULL_CORNERS = 32
"""Of the hull by which a cam clears what is beside it, which is so much wider as it leaves out."""


class CamDrive(NamedTuple):
    """A cam and its follower where they were drawn (mm).

    `profile` goes anticlockwise. A roller of this radius turns about `at` of the follower; or else its face is flat, at
    `at`, with a normal away from the cam in the direction `normal` (unit).
    """

    name: str
    cam: str
    follower: str
    centre: Place
    profile: tuple[Place, ...]
    at: Place
    roller: float
    normal: Place | None


def cam_drives(mechanism: Mechanism, frames: Mapping[str, Frame], scale: float) -> list[CamDrive]:
    """The cams of a mechanism, with links in these frames, at a scale. Raises BadInput for one that is none of plates.

    That is one without a profile, one that cannot be made, a grooved one, and one whose follower is a bare point.
    """
    shapes = {link.name: link_shape(link) for link in mechanism.links}
    return [
        _drive(mechanism, pair, frames, shapes, scale) for pair in mechanism.pairs if isinstance(pair, ProfiledPair)
    ]


def _drive(
    mechanism: Mechanism,
    pair: ProfiledPair,
    frames: Mapping[str, Frame],
    shapes: Mapping[str, LinkShape],
    scale: float,
) -> CamDrive:
    cam, follower = pair.links[:2]
    shape = pair.shape
    if shape is None or pair.point is None:
        raise BadInput(pair.name, "this cam has no profile, so there is no plate of it; give it a 'base_radius'")
    if shape.grooved:
        raise BadInput(pair.name, "a grooved cam cannot be cut as plates that lie flat: its groove goes not through")
    if shape.flat is None and not shape.roller_radius:
        raise BadInput(
            pair.name, "its follower is a bare point, which no plate has; give it a 'roller_radius' or 'flat'"
        )
    factor = 1e3 * scale

    def place(link: str, local: Vector) -> Place:
        found = frames[link].to_world(local)
        return factor * float(found.x), factor * float(found.y)

    centre = shapes[cam].position(shape.centre)
    points = _profile(mechanism, pair, TOLERANCE / factor)
    profile = [place(cam, Vector(centre.x + x, centre.y + y)) for x, y in points.tolist()]
    if sum(x * v - u * y for (x, y), (u, v) in zip(profile, [*profile[1:], profile[0]], strict=True)) < 0.0:
        profile.reverse()
    normal = None
    if shape.flat is not None:
        base = frames[follower].angle
        if pair.line is not None:
            base = frames[pair.carrier].angle + pair.line.direction_angle(shapes[pair.carrier])
        angle = float(base + shape.flat)
        normal = cos(angle), sin(angle)
    middle = place(follower, shapes[follower].position(pair.point))
    return CamDrive(
        pair.name, cam, follower, place(cam, centre), tuple(profile), middle, factor * shape.roller_radius, normal
    )


def _profile(mechanism: Mechanism, pair: ProfiledPair, tolerance: float) -> Array:
    """The profile's points in the cam's axes from its centre (n, 2; m), each once."""
    given = pair.profile_by_points
    if given is not None:
        curve = profile_curve(tuple((float(x), float(y)) for x, y in given.points))
        points = np.column_stack(curve.at(curve.samples()))
    else:
        found = cam_profile(mechanism, pair.name)
        if found.problem():
            raise BadInput(pair.name, found.problem())
        points = found.at(found.points(tolerance)).profile
    apart = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1)
    kept: Array = points[apart > 1e-9 * np.abs(points).max()]
    return kept


def hull_of_profile(profile: tuple[Place, ...]) -> tuple[tuple[Place, ...], float]:
    """Some corners of a profile's hull, and within what distance of their own hull all the profile lies (mm)."""
    hull = convex_hull(profile)
    some = hull[:: -(-len(hull) // HULL_CORNERS)] if len(hull) > HULL_CORNERS else hull
    beyond = 0.0
    for (x, y), (u, v) in zip(some, [*some[1:], some[0]], strict=True):
        size = hypot(u - x, v - y)
        beyond = max(beyond, *(((p - x) * (v - y) - (q - y) * (u - x)) / size for p, q in hull))
    return tuple(some), beyond


def face_reach(profiles: Array, faces: Array, normals: Array) -> tuple[float, float]:
    """How far along a flat face from its point the cam touches it over a run (mm), to the left of its normal positive.

    `profiles` (positions, points, 2) are the cam's; `faces` where the point is and `normals` are (positions, 2).
    """
    off = profiles - faces[:, None]
    up = (off * normals[:, None]).sum(axis=2)
    across = off[..., 1] * normals[:, None, 0] - off[..., 0] * normals[:, None, 1]
    touching = across[np.arange(len(up)), up.argmax(axis=1)]
    return float(touching.min()), float(touching.max())


def outline_of(profile: tuple[Place, ...]) -> tuple[Vertex, ...]:
    """A profile as a line that is cut."""
    return tuple((x, y, 0.0) for x, y in profile)
