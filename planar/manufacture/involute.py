"""Involute teeth by their number, module and pressure angle (ISO 53: addendum m, dedendum 1.25 m)."""

from __future__ import annotations

from math import acos, cos, pi, sin, sqrt, tan

from planar.manufacture.plates import Vertex

ADDENDUM, DEDENDUM = 1.0, 1.25
FLANK_POINTS = 12
"""Of a flank of a tooth; the polygon is off the involute by less than 1e-3 of the module."""


def involute_angle(pressure_angle: float) -> float:
    """inv a = tan a - a: the polar angle of an involute where it is so steep."""
    return tan(pressure_angle) - pressure_angle


def gear_outline(
    teeth: int, module: float, pressure_angle: float, phase: float, backlash: float = 0.0, internal: bool = False
) -> tuple[Vertex, ...]:
    """The teeth of a gear about the origin, one of them at the polar angle `phase` (rad); of a ring what is cut out.

    The flank at a radius r lies at pi / 2z + inv a - inv acos(rb / r) from the middle of its tooth, rb being the radius
    of the base circle; within that it goes straight to the root. `backlash` (in the unit of the module) is what a tooth
    is thinner on the pitch circle. A ring's spaces have the form of teeth.
    """
    pitch = module * teeth / 2.0
    base = pitch * cos(pressure_angle)
    thinner = (-1.0 if internal else 1.0) * backlash / (2.0 * pitch)
    half = pi / (2.0 * teeth) - thinner + involute_angle(pressure_angle)
    high, deep = (DEDENDUM, ADDENDUM) if internal else (ADDENDUM, DEDENDUM)
    tip, root = pitch + high * module, pitch - deep * module

    def flank(radius: float) -> float:
        return half - involute_angle(acos(min(1.0, base / radius)))

    while flank(tip) < 0.0:  # teeth of few are pointed before they are that high
        tip -= 0.02 * module
    start = max(base, root)
    # evenly in the roll angle, which is where the involute bends most
    first, last = (sqrt(max((radius / base) ** 2 - 1.0, 0.0)) for radius in (start, tip))
    rolls = [first + (last - first) * step / FLANK_POINTS for step in range(FLANK_POINTS + 1)]
    radii = [base * sqrt(1.0 + roll * roll) for roll in rolls]
    if root < base:
        radii.insert(0, root)
    found: list[Vertex] = []
    for tooth in range(teeth):
        middle = phase + 2.0 * pi * tooth / teeth
        sides = [(radius, -flank(radius)) for radius in radii] + [(radius, flank(radius)) for radius in reversed(radii)]
        points = [(radius * cos(middle + angle), radius * sin(middle + angle)) for radius, angle in sides]
        bulges = [0.0] * len(points)
        bulges[len(radii) - 1] = tan(2.0 * flank(tip) / 4.0)  # along the tip
        bulges[-1] = tan((2.0 * pi / teeth - 2.0 * flank(radii[0])) / 4.0)  # along the root
        found += [(x, y, bulge) for (x, y), bulge in zip(points, bulges, strict=True)]
    return tuple(found)


def span_length(teeth: int, module: float, pressure_angle: float, over: int) -> float:
    """The length measured over so many teeth: m cos a (pi (k - 1/2) + z inv a)."""
    return module * cos(pressure_angle) * (pi * (over - 0.5) + teeth * involute_angle(pressure_angle))
