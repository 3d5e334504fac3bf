"""Mechanisms with friction for tests."""

from __future__ import annotations

from dataclasses import replace
from math import degrees
from typing import Any

import numpy as np

import planar
from planar.model.loads import Load, Mass
from planar.model.mechanism import Mechanism, named_points
from planar.model.pairs.rubbing import Friction
from tests.linkages import random_linkage


def incline(angle: float, friction: float, velocity: float, **guide: Any) -> Mechanism:
    """A block of 100 N on an incline (rad), pushed along it."""
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {"f": {"points": {"O": [0, 0]}}, "block": {"points": {"B": [0, 0], "P": [0, 0.5]}}},
            "pairs": [
                {
                    "sliding": "S",
                    "links": ["f", "block"],
                    "line": {"through": "O", "angle": angle},
                    "point": "B",
                    "turn": -angle,
                    "friction": friction,
                    **guide,
                }
            ],
            "inputs": [{"pair": "S", "position": 1.0, "velocity": velocity}],
            "loads": [{"point": "B", "force": [0, -100]}],
        }
    )


def crank_and_slider(radius: float, friction: float, angle: float, velocity: float, **guide: Any) -> Mechanism:
    """A crank of 50 mm and a rod of 150 mm with pins of this radius (m) that press a slider against 1000 N."""
    pin = {"pin_radius": radius, "friction": friction}
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {
                "f": {"points": {"O": [0, 0]}},
                "crank": {"ends": ["O", "A"], "length": 0.05},
                "rod": {"ends": ["A", "B"], "length": 0.15},
            },
            "pairs": [
                *({"turning": name, **pin} for name in "OAB"),
                {"sliding": "S", "on": "f", "block": "B", "line": {"through": "O"}, "friction": friction, **guide},
            ],
            "inputs": [{"pair": "O", "position": f"{degrees(angle)!r} deg", "velocity": velocity}],
            "loads": [{"point": "B", "force": [-1000, 0]}],
            "sketch": {"B": [0.15, 0]},
        }
    )


def gear_train(velocity: float, load: float, **mesh: Any) -> Mechanism:
    """Two wheels of 20 and 50 teeth; the first is driven, on the second acts a torque (N m)."""
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {
                "f": {"points": {"A": [0, 0], "B": [0.35, 0]}},
                "a": {"points": {"A": [0, 0]}},
                "b": {"points": {"B": [0, 0]}},
            },
            "pairs": [{"turning": "A"}, {"turning": "B"}, {"links": ["a", "b"], "teeth": [20, 50], **mesh}],
            "inputs": [{"pair": "A", "position": 0, "velocity": velocity}],
            "loads": [{"link": "b", "torque": load}],
        }
    )


def rubbing_linkage(seed: int, most: float) -> Mechanism:
    """A random linkage with loads and masses, and friction up to a coefficient in every pair that can have it."""
    rng = np.random.default_rng(seed)
    mechanism = planar.from_dict(random_linkage(seed, 1 + seed % 6, higher=0.3 * (seed % 2)).value)
    points = [each.name for each in named_points(mechanism)]
    links = [link for link in mechanism.links if link.names]
    forces = (Load(str(rng.choice(points)), tuple(rng.uniform(-300.0, 300.0, 2).tolist())) for _ in range(2))
    masses = tuple(Mass(link.name, float(rng.uniform(0.1, 4.0)), link.names[0], 0.1) for link in links)
    return replace(
        with_friction(mechanism, rng, most), loads=tuple(forces), masses=masses, gravity=(1.5, -9.0), published=()
    )


def with_friction(mechanism: Mechanism, rng: np.random.Generator, most: float) -> Mechanism:
    """The mechanism with friction in every pair that can have it."""

    def rubbing(pair: planar.Pair) -> planar.Pair:
        friction, size = Friction(float(rng.uniform(0.0, most))), float(rng.uniform(0.1, 1.0))
        if isinstance(pair, planar.TurningPair):
            return replace(pair, radius=0.05 * size, friction=friction)
        if isinstance(pair, planar.SlidingPair):
            return replace(pair, guide_length=size, guide_width=0.1 * size, friction=friction)
        if isinstance(pair, planar.SlotPair):
            return replace(pair, friction=friction)
        return replace(pair, efficiency=1.0 - 0.3 * size)

    return replace(mechanism, pairs=tuple(map(rubbing, mechanism.pairs)))
