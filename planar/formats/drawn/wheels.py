"""Wheels in mesh by the place where they touch, as other programs say it: to radii, and back."""

from __future__ import annotations

from collections.abc import Iterable
from math import hypot

from planar.formats.drawn.drawn_linkage import Joint, PinJoint, Place, WheelJoint
from planar.foundation.errors import BadInput

OFF_LINE = 1e-6
"""Of the distance of centres: how far a point of contact may be off the line through them."""


def wheel_centre(joints: Iterable[Joint], wheel: str, carrier: str) -> Place | None:
    """Where a wheel turns on its carrier; None where no pin holds it there."""
    pins = (item for item in joints if isinstance(item, PinJoint))
    return next((item.at for item in pins if {wheel, carrier} <= set(item.links)), None)


def common_carrier(joints: Iterable[Joint], first: str, second: str) -> str | None:
    """The link on which both wheels turn."""
    held = [item.links for item in joints if isinstance(item, PinJoint)]
    with_first = dict.fromkeys(link for links in held if first in links for link in links)
    both = [link for link in with_first for links in held if second in links and link in links]
    return next((link for link in both if link not in (first, second)), None)


def meshing_gears(
    name: str, wheels: tuple[str, str], contact: Place, joints: Iterable[Joint], place: str
) -> WheelJoint:
    """The gears that touch at a place of the line through their centres. Raises BadInput.

    Where both centres are to one side of it the larger wheel is internal.
    """
    joints = tuple(joints)
    carrier = common_carrier(joints, *wheels)
    if carrier is None:
        raise BadInput(place, f"the wheels {wheels[0]!r} and {wheels[1]!r} turn on no common link")
    centres = [wheel_centre(joints, wheel, carrier) for wheel in wheels]
    arms = [(c[0] - contact[0], c[1] - contact[1]) for c in centres if c is not None]
    first, second = (hypot(*arm) for arm in arms)
    apart = hypot(arms[0][0] - arms[1][0], arms[0][1] - arms[1][1])
    off = abs(arms[0][0] * arms[1][1] - arms[0][1] * arms[1][0])
    if min(first, second) == 0.0 or apart == 0.0 or off > OFF_LINE * apart * max(first, second):
        raise BadInput(
            place, f"the wheels {wheels[0]!r} and {wheels[1]!r} cannot touch there, off the line of their centres"
        )
    inside = arms[0][0] * arms[1][0] + arms[0][1] * arms[1][1] > 0.0
    radii = (-first if inside and first > second else first, -second if inside and second > first else second)
    return WheelJoint(name, "gear", wheels, carrier, "radii", radii)


def wheel_ratio(joint: WheelJoint) -> float:
    """The turning of the second wheel by that of the first, both seen from the carrier."""
    if joint.size_kind == "ratio":
        return joint.sizes[0]
    ratio = joint.sizes[0] / joint.sizes[1]
    return -ratio if joint.kind == "gear" or joint.crossed else ratio


def pitch_point(joint: WheelJoint, joints: Iterable[Joint]) -> Place | None:
    """Where the wheels of a pair of gears touch, from their centres and their ratio; None where that is nowhere."""
    joints = tuple(joints)
    centres = [wheel_centre(joints, wheel, joint.carrier) for wheel in joint.wheels]
    ratio = wheel_ratio(joint)
    if centres[0] is None or centres[1] is None or centres[0] == centres[1] or ratio == 1.0:
        return None
    (x, y), (u, v) = centres[0], centres[1]
    return (x - ratio * u) / (1.0 - ratio), (y - ratio * v) / (1.0 - ratio)
