"""How small a cam may be: the least base circle for a greatest pressure angle, and that without undercutting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import degrees, hypot, pi
from typing import NamedTuple

import numpy as np

from planar.analysis.cams.cam_profile import CamProfile, cam_profile
from planar.document.first_argument import takes_mechanism
from planar.foundation.errors import BadInput
from planar.foundation.root_finding import find_root
from planar.model.mechanism import Mechanism
from planar.model.pairs.cam_follower import rest_problem

SEARCHED_RATIO = 1e4
"""Base circles are looked for from this part of the follower's own sizes up to so many times these."""
SEARCH_STEPS = 241
"""Base circles between, each so many times the one before."""


class BaseCircle(NamedTuple):
    """The least radii of a cam's base circle (m): None where none that the follower reaches will do, 0 where any will.

    `pressure` for a greatest pressure angle of `pressure_angle` (rad), `curvature` for a profile that is not undercut,
    `both` for both.
    """

    pressure_angle: float
    pressure: float | None
    curvature: float | None
    both: float | None


@takes_mechanism
def least_base_circle(mechanism: Mechanism, pressure_angle: float = pi / 6.0, pair: str | None = None) -> BaseCircle:
    """The least base circle of a cam for a greatest pressure angle (rad), and for a profile that is not undercut.

    All that is larger, as far as the follower reaches, will do as well. `pair` names the cam where there are several.
    Raises BadInput where there is no such cam, and for an angle that is not between 0 and a right angle.

    >>> import planar
    >>> from math import radians
    >>> found = planar.least_base_circle("valve-cam", radians(30))
    >>> round(found.pressure, 6)  # m
    0.065711
    """
    if not 0.0 < pressure_angle < 0.5 * pi:
        raise BadInput(
            "pressure_angle", f"an angle between 0 and a right one is wanted, not {degrees(pressure_angle):g} deg"
        )
    found = cam_profile(mechanism, pair)

    def pressed(radius: float) -> float:
        return pressure_angle - _with_base(found, radius).greatest_pressure_angle.value

    def curved(radius: float) -> float:
        other = _with_base(found, radius)
        return other.curvature_limit - other.greatest_curvature.value

    one, other = _least_radius(found, pressed), _least_radius(found, curved)
    return BaseCircle(pressure_angle, one, other, None if one is None or other is None else max(one, other))


def _with_base(profile: CamProfile, radius: float) -> CamProfile:
    """The same cam on another base circle."""
    assert profile.cam.shape is not None
    cam = replace(profile.cam, shape=profile.cam.shape._replace(base_radius=radius))
    return CamProfile(profile.mechanism, profile.pair, cam, profile.shapes, profile.angle)


def _least_radius(profile: CamProfile, margin: Callable[[float], float]) -> float | None:
    """The radius above which a margin stays above zero, as far as the follower reaches; 0 where any will do."""
    axes, face = profile.cam.follower_axes(profile.shapes), profile.cam.follower_face(profile.shapes)
    apart = axes.centre - axes.origin
    sizes = [profile.base_radius, profile.roller_radius, float(hypot(apart.x, apart.y)), float(hypot(*axes.arm))]
    if axes.line is not None:
        sizes.append(profile.cam.law.greatest_lift())
    size = max(sizes)
    every = np.geomspace(size / SEARCHED_RATIO, size * SEARCHED_RATIO, SEARCH_STEPS).tolist()
    tried = [radius for radius in every if not rest_problem(axes, face, radius)]
    bad = None
    for radius in reversed(tried):
        value = margin(radius)
        if not value > 0.0:
            bad = radius
            break
    if bad is None:
        return None if not tried else tried[0] if tried[0] > every[0] else 0.0
    above = [radius for radius in tried if radius > bad]
    return find_root(margin, bad, above[0]) if above else None
