"""Random four-bars in a sweep: which can turn, and how far the others come, against the closed form."""

from __future__ import annotations

import sys
import time

import numpy as np

import planar

FIRST = 0.8
"""rad: where the crank starts."""


def base() -> planar.Mechanism:
    """A crank-rocker in its open assembly."""
    value = {
        "planar": 1,
        "frame": "AD",
        "links": {
            "AD": {"points": {"A": [0, 0], "D": [1.0, 0]}},
            "AB": {"ends": ["A", "B"], "length": 0.3},
            "BC": {"ends": ["B", "C"], "length": 0.9},
            "DC": {"ends": ["D", "C"], "length": 0.7},
        },
        "pairs": [{"turning": name} for name in "ABCD"],
        "inputs": [{"pair": "A", "position": FIRST, "velocity": 1.0}],
        "sketch": {"C": [0.9, 0.7]},
    }
    return planar.from_dict(value)


def closes(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Whether each four-bar comes to each crank angle from the first: its diagonal is neither too long nor too short,
    nor was it on the way there (designs, angles)."""
    far = np.sqrt(a * a + d * d - 2 * a * d * np.cos(theta)[:, None]).T
    found = np.logical_and.accumulate((far <= (b + c)[:, None]) & (far >= abs(b - c)[:, None]), axis=1)
    for place, extreme in ((np.pi, a + d), (2 * np.pi, abs(a - d))):
        broken = (extreme > b + c) | (extreme < abs(b - c))
        found &= ~(broken[:, None] & (theta > place))
    return found


def main(many: int = 10_000, steps: int = 200) -> int:
    """Print how many designs differ from the closed form, and how long the sweep took."""
    a, b, c, d = np.random.default_rng(0).uniform(0.2, 1.5, (4, many))
    designs = {"AB.length": a, "BC.length": b, "DC.length": c, "AD.D.x": d}
    start = time.perf_counter()
    result = planar.sweep(base(), designs, steps, "C", rates=False, workers=1)
    took = time.perf_counter() - start
    wanted = closes(a, b, c, d, FIRST + np.linspace(0, 2 * np.pi, steps + 1))
    differing = int(np.sum(np.any((np.asarray(result.status) == 0) != wanted, axis=1)))
    print(f"{many} random four-bars x {steps} steps in {took:.2f} s: {took / many * 1e6:.0f} us a design")
    print(f"{int(wanted[:, -1].sum())} can turn, {int(np.sum(~wanted[:, 0]))} cannot be assembled at the start")
    print(f"{differing} designs differ from the closed form; {result.general} positions by the general path")
    return differing


if __name__ == "__main__":
    sys.exit(bool(main(*map(int, sys.argv[1:]))))
