"""How small a cam may be: the least base circle for a greatest pressure angle, and that without undercutting."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from math import degrees, hypot, pi
from typing import NamedTuple

import numpy as np

from planar.analysis.cams.cam_profile import CamProfile, cam_profile
from planar.document.first_argument import takes_mechanism
from planar.foundation.errors import BadInput
from planar.foundation.root_finding import find_root
from planar.model.mechanism import Mechanism
from planar.model.pairs.cams import rest_problem

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
    0.097288
    """
    if not 0.0 < pressure_angle < 0.5 * pi:
        raise BadInput(
            "pressure_angle", f"an angle between 0 and a right one is wanted, not {degrees(pressure_angle):g} deg"
        )
    found = cam_profile(mechanism, pair)
    if found.cam.has_given_profile:
        return BaseCircle(pressure_angle, None, None, None)

    def pressed(cam: CamProfile) -> float:
        return pressure_angle - cam.greatest_pressure_angle.value

    def curved(cam: CamProfile) -> float:
        return cam.curvature_limit - cam.greatest_curvature.value

    one = _least_radius(found, pressed, lambda cam: pressure_angle - float(np.abs(cam.pressure_angle).max()))
    other = _least_radius(found, curved, lambda cam: cam.curvature_limit - cam.sampled_curvature)
    return BaseCircle(pressure_angle, one, other, None if one is None or other is None else max(one, other))


def _with_base(profile: CamProfile, radius: float) -> CamProfile:
    """The same cam on another base circle."""
    assert profile.cam.shape is not None
    cam = replace(profile.cam, shape=profile.cam.shape._replace(base_radius=radius))
    return CamProfile(profile.mechanism, profile.pair, cam, profile.shapes, profile.angle)


def _least_radius(
    profile: CamProfile, margin: Callable[[CamProfile], float], sampled_margin: Callable[[CamProfile], float]
) -> float | None:
    """The radius above which a margin stays above zero, as far as the follower reaches; 0 where any will do.

    The margin at the samples of the profile, which is never less, tells about where that is.
    """
    axes, face = profile.cam.follower_axes(profile.shapes), profile.cam.follower_face(profile.shapes)
    apart = axes.centre - axes.origin
    sizes = [profile.base_radius, profile.roller_radius, float(hypot(apart.x, apart.y)), float(hypot(*axes.arm))]
    if axes.line is not None:
        sizes.append(float(profile.lift[0].max()))
    size = max(sizes)
    every = np.geomspace(size / SEARCHED_RATIO, size * SEARCHED_RATIO, SEARCH_STEPS).tolist()
    tried = [radius for radius in every if not rest_problem(axes, face, radius)]
    last_bad = len(tried) - 1
    while last_bad >= 0 and sampled_margin(_with_base(profile, tried[last_bad])) > 0.0:
        last_bad -= 1
    for bad, good in pairwise(tried[max(last_bad, 0) :]):
        if margin(_with_base(profile, good)) > 0.0:
            if last_bad < 0 and margin(_with_base(profile, bad)) > 0.0:
                return bad if bad > every[0] else 0.0
            return find_root(lambda radius: margin(_with_base(profile, radius)), bad, good)
    return None
