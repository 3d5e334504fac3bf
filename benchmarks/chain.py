"""A row of four-bars, each driven by the rocker of the one before, of any even number of links."""

from __future__ import annotations

import math
from typing import Any

from benchmarks.linkages import FourBar
from benchmarks.linkages.base import ALPHA, OMEGA, THETA, Scalar

FIRST = FourBar()
NEXT = (FourBar(a=0.5, b=1.02, c=0.5, g=1.0), FourBar(a=0.5, b=0.98, c=0.5, g=1.0))
"""The later four-bars in turn: nearly parallelograms, so that every rocker swings about as the first."""


def document(links: int) -> dict[str, Any]:
    """The mechanism file (m, rad) of a frame, a crank and (links - 2) / 2 dyads of a coupler and a rocker."""
    dyads = cells(links)
    frame: dict[str, list[float]] = {"A": [0.0, 0.0]}
    bars: dict[str, Any] = {"crank": {"ends": ["A", "B1"], "length": FIRST.a}}
    sketch = {}
    angle, pivot = THETA, 0.0
    for number, cell in enumerate(dyads, start=1):
        pivot += cell.g
        _, angle = cell.positions(math, angle)
        frame[f"D{number}"] = [pivot, 0.0]
        bars[f"coupler{number}"] = {"ends": [f"B{number}", f"C{number}"], "length": cell.b}
        bars[f"rocker{number}"] = {"ends": [f"D{number}", f"C{number}"], "length": cell.c}
        sketch[f"C{number}"] = [round(pivot + cell.c * math.cos(angle), 1), round(cell.c * math.sin(angle), 1)]
        if number < len(dyads):
            # the next four-bar's crank is this rocker, as long as that crank is
            crank = {"along": [f"D{number}", f"C{number}"], "distance": dyads[number].a}
            bars[f"rocker{number}"]["points"] = {f"B{number + 1}": crank}
    pins = ["A", "B1", *(f"{pin}{n}" for n in range(1, len(dyads) + 1) for pin in ("C", "D"))]
    pins += [f"B{n}" for n in range(2, len(dyads) + 1)]
    return {
        "planar": 1,
        "name": f"row of four-bars, {links} links",
        "frame": "frame",
        "links": {"frame": {"points": frame}, **bars},
        "pairs": [{"turning": pin} for pin in pins],
        "inputs": [{"pair": "A", "position": THETA, "velocity": OMEGA, "acceleration": ALPHA}],
        "sketch": sketch,
    }


def last_rocker(links: int) -> str:
    """The name of the link that moves last."""
    return f"rocker{len(cells(links))}"


def motion(m: Any, links: int, theta: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """The last rocker's angle, velocity and acceleration (rad, per s, per s^2), four-bar after four-bar."""
    swing = theta, OMEGA, ALPHA
    for cell in cells(links):
        swing = tuple(rates[1] for rates in cell.motion(m, *swing))
    return swing


def cells(links: int) -> tuple[FourBar, ...]:
    """The four-bars of a row, the first one first."""
    return (FIRST, *(NEXT[index % 2] for index in range((links - 4) // 2)))
