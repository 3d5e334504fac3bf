"""Teeth of a rack by their module and pressure angle (ISO 53: straight flanks, addendum m, dedendum 1.25 m)."""

from __future__ import annotations

from math import ceil, floor, pi, tan

from planar.manufacture.involute import ADDENDUM, DEDENDUM
from planar.manufacture.plates import Vertex

ROUNDING = 1e-9
"""Of a pitch: a tooth that lacks less is whole."""


def rack_outline(
    span: tuple[float, float], module: float, pressure_angle: float, offset: float, backlash: float, depth: float
) -> tuple[tuple[Vertex, ...], int]:
    """A rack along the x-axis, its pitch line, with teeth upwards and so many of them that are whole within `span`.

    One tooth is at x = `offset`; `backlash` is what a tooth is thinner on the pitch line, `depth` how far the back is
    below that. All lengths in one unit. The outline goes round anticlockwise.
    """
    pitch, steep = pi * module, tan(pressure_angle)
    half = pitch / 4.0 - backlash / 2.0
    high, deep = min(ADDENDUM * module, half / steep), min(DEDENDUM * module, (pitch / 2.0 - half) / steep)
    start, end = ((place - offset) / pitch for place in span)
    first, last = ceil(start + 0.5 - ROUNDING), floor(end - 0.5 + ROUNDING)
    found: list[Vertex] = [(span[0], -depth, 0.0), (span[1], -depth, 0.0), (span[1], -deep, 0.0)]
    for number in range(last, first - 1, -1):
        middle = offset + number * pitch
        sides = ((half + deep * steep, -deep), (half - high * steep, high))
        found += [(middle + across, up, 0.0) for across, up in sides]
        found += [(middle - across, up, 0.0) for across, up in reversed(sides)]
    found.append((span[0], -deep, 0.0))
    return tuple(found), max(0, last - first + 1)
