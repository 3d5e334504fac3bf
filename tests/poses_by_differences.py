"""Linkages of turning and sliding pairs solved from their files alone: poses by scipy, rates by differences in time.

Nothing of planar takes part, so that its answers can be held against these.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import fsolve

STEP = 4e-3
"""rad by which an input goes on between two positions."""
FIRST = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
SECOND = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / 12.0
"""Derivatives by five points."""


def local_points(link: dict[str, Any]) -> dict[str, complex]:
    """The points of a link in its own axes."""
    found = {}
    if "ends" in link:
        first, second = link["ends"]
        found = {first: 0j, second: complex(link["length"])}
    for name, where in link.get("points", {}).items():
        if isinstance(where, list):
            found[name] = complex(*where)
        elif "along" in where:
            start, end = (found[each] for each in where["along"])
            way = (end - start) / abs(end - start)
            found[name] = start + where["distance"] * way * np.exp(1j * np.deg2rad(where.get("angle", 0.0)))
    return found


class Poses:
    """A mechanism's file (millimetres and degrees, one driven pin on the frame) at moments about its position.

    Searched from the points `near` and the links `turned` so.
    """

    def __init__(self, value: dict[str, Any], near: dict[str, np.ndarray], turned: dict[str, float]):
        self.value = value
        self.points = {name: local_points(link) for name, link in value["links"].items()}
        self.moving = [name for name in value["links"] if name != value["frame"]]
        (given,) = value["inputs"]
        self.rates = float(str(given["velocity"]).split()[0]), float(str(given.get("acceleration", 0)).split()[0])
        self.driven = next(pair["links"][1] for pair in value["pairs"] if pair.get("turning") == given["pair"])
        self.angle = np.deg2rad(given["position"])
        self.step = STEP / abs(self.rates[0])
        origins = [next(point for point, at in self.points[name].items() if at == 0) for name in self.moving]
        first = np.array([(*near[at], turned[name]) for at, name in zip(origins, self.moving, strict=True)]).ravel()
        times = self.step * np.arange(-2, 3)
        self.poses = [self.frames(fsolve(self.residuals, first, (t,), xtol=1e-11)) for t in times]

    def frames(self, z: np.ndarray) -> dict[str, tuple[complex, float]]:
        found = {name: (complex(x, y), turn) for name, (x, y, turn) in zip(self.moving, z.reshape(-1, 3), strict=True)}
        return {self.value["frame"]: (0j, 0.0)} | found

    def residuals(self, z: np.ndarray, time: float) -> list[float]:
        frames, open_by = self.frames(z), []

        def place(link: str, point: str) -> complex:
            at, turn = frames[link]
            return at + self.points[link][point] * np.exp(1j * turn)

        for pair in self.value["pairs"]:
            first = pair["links"][0]
            for second in pair["links"][1:]:
                if "turning" in pair:
                    gap = place(first, pair["turning"]) - place(second, pair["turning"])
                    open_by += [gap.real, gap.imag]
                else:
                    line = pair["line"]
                    way = frames[first][1] + np.deg2rad(line["angle"])
                    off = (place(second, pair["point"]) - place(first, line["through"])) * np.exp(-1j * way)
                    open_by += [off.imag, 100.0 * (frames[second][1] - way)]
        omega, alpha = self.rates
        return [*open_by, 100.0 * (frames[self.driven][1] - self.angle - omega * time - alpha * time**2 / 2)]

    def rates_of(self, name: str) -> tuple[complex | float, complex | float]:
        """Velocity and acceleration of a point (m/s, m/s^2), or those of a link's angle (rad/s, rad/s^2)."""
        if name in self.points:
            track, unit = np.array([pose[name][1] for pose in self.poses]), 1.0
        else:
            link = next(each for each, points in self.points.items() if name in points)
            at = self.points[link][name]
            track = np.array([pose[link][0] + at * np.exp(1j * pose[link][1]) for pose in self.poses])
            unit = 1e-3
        return unit * (FIRST @ track) / self.step, unit * (SECOND @ track) / self.step**2
