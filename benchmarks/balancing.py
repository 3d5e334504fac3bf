"""Random counterweights beside the best that `planar balance` claims: how near the best of very many come.

    python -m benchmarks.balancing          # 100,000 for every model and objective
    python -m benchmarks.balancing 1000000

Forces and torques of the random ones are put together from accelerations of points, apart from the maps that the
optimum comes from; that of the input from the power of inertia and weights.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from math import pi
from time import process_time
from typing import Any

import numpy as np

import planar
from planar.dynamics.balancing.balance import OBJECTIVES, Balance
from planar.dynamics.balancing.mass_parameters import link_axes
from planar.dynamics.external_actions import KinematicArrays
from planar.foundation.geometry import Vector
from planar.model.loads import Mass

STEPS, CHUNK = 72, 10_000
MODELS = {
    "two-stroke-engine": ["crank", "rod"],
    "v-twin-engine": ["crank", "left rod"],
    "engine-in-inches": None,
    "pump-jack": None,
    "crank-rocker": None,
    "stephenson-1-six-bar": None,
}
"""With the links that bear counterweights; models without masses are given bars of one kilogram a metre."""


def heavy(model: str) -> planar.Mechanism:
    """The model with masses."""
    mechanism = planar.load(model)
    if mechanism.masses:
        return mechanism
    shapes = planar.solve(mechanism).shapes
    masses = []
    for link in mechanism.links:
        points = [*shapes[link.name].points.values()]
        if link.name != mechanism.frame and len(points) > 1:
            ends = points[0], points[1]
            length = float(np.hypot(*(ends[1] - ends[0])))
            middle = (ends[0] + ends[1]) * 0.5
            drawn = middle.rotate(shapes[link.name].axis) + shapes[link.name].origin
            masses.append(Mass(link.name, length, (drawn.x, drawn.y), length**3 / 12.0))
    return replace(mechanism, masses=tuple(masses))


def random_values(found: Balance, count: int, seed: int = 1) -> np.ndarray:
    """What random bodies within the limits make of the objective (count,)."""
    random = np.random.default_rng(seed)
    motion = found.motion
    field = KinematicArrays(motion, motion.shapes)
    total = sum(mass.mass for mass in motion.mechanism.masses if mass.link != motion.mechanism.frame)
    speed = motion.inputs[found.input].velocity
    own = {
        "shaking force": found.before.force,
        "shaking moment": found.before.moment[:, None],
        "peak torque": found.before.effort[:, None],
    }[found.minimised]
    values = np.repeat(own[None], count, axis=0)
    for axes in link_axes(motion.mechanism, motion.shapes):
        if axes.link not in found.links:
            continue
        reach = max(float(np.hypot(*(each - axes.origin))) for each in motion.shapes[axes.link].points.values())
        mass = total * random.uniform(0.0, 1.0, count)
        away, angle = reach * np.sqrt(random.uniform(0.0, 1.0, count)), random.uniform(-pi, pi, count)
        about_centre = random.uniform(0.0, 1.0, count) * (reach**2 - away**2) * mass
        at = axes.origin + axes.axis.rotate(Vector(np.cos(angle), np.sin(angle))) * away
        place, rate, acceleration = (
            np.stack([np.stack([_part(field, axes.link, at, order, k) for k in (0, 1)], axis=-1)], axis=0)[0]
            for order in range(3)
        )  # (count, n, 2)
        turning, turned = (field.angle_rates(axes.link, order) for order in (1, 2))
        force = -mass[:, None, None] * acceleration
        couple = -about_centre[:, None] * turned
        if found.minimised == "shaking force":
            values += force
        elif found.minimised == "shaking moment":
            arm = place - found.about
            values[..., 0] += arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0] + couple
        else:
            weight = mass[:, None, None] * np.array(motion.mechanism.gravity)
            power = ((force + weight) * rate).sum(axis=2) + couple * turning
            values[..., 0] -= power / speed
    sizes: np.ndarray = np.linalg.norm(values, axis=2).max(axis=1)
    return sizes


def _part(field: KinematicArrays, link: str, at: Vector, order: int, k: int) -> np.ndarray:
    """One part of where places (count,) of a link are, or of a rate (count, n)."""
    none, first = (field.point_rates(link, Vector(x, 0.0), order) for x in (0.0, 1.0))
    second = field.point_rates(link, Vector(0.0, 1.0), order)
    found: np.ndarray = (
        none[:, k] + np.outer(at.x, first[:, k] - none[:, k]) + np.outer(at.y, second[:, k] - none[:, k])
    )
    return found


def main(words: list[str]) -> int:
    """Compare, print, and say by the status whether any random design was better than a bound."""
    count = int(words[0]) if words else 100_000
    better = 0
    print(f"{count} random counterweights each")
    for model, links in MODELS.items():
        motion = planar.cycle(heavy(model), STEPS)
        for objective in OBJECTIVES:
            begun = process_time()
            try:
                found = planar.balance(motion, objective, links)
            except planar.BadInput as problem:
                print(f"{model:24} {objective:16} {problem.sentence}")
                continue
            took = process_time() - begun
            if found.value_before <= 1e-9:
                continue
            chunks: Any = [random_values(found, CHUNK, seed).min() for seed in range(max(count // CHUNK, 1))]
            best = float(min(chunks))
            better += best < found.bound * (1.0 - 1e-9)
            print(
                f"{model:24} {objective:16} before {found.value_before:12.6g}  claimed {found.value:12.6g}  "
                f"bound {found.bound:12.6g}  best random {best:12.6g}  {1e3 * took:6.1f} ms"
            )
    print("none is better" if not better else f"{better} ARE BETTER")
    return int(better > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
