"""Random linkages, built closed: links first, pairs fitted between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from planar.mechanism import Mechanism
from planar.pairs import Pair
from planar.plane import Frame, Vector, direction, frame_at
from planar.shapes import shape
from planar.solving.freedom import strengths
from planar.solving.position import Solver


@dataclass(frozen=True)
class Built:
    """A linkage's file value, and where each link stands in it."""

    value: dict[str, Any]
    frames: dict[str, Frame]


class Builder:
    """Adds links at known places and pairs that are closed there."""

    def __init__(self, rng: np.random.Generator):
        self.rng = rng
        self.frames: dict[str, Frame] = {"frame": Frame(0.0, 0.0, 1.0, 0.0, 0.0, True)}
        self.links: dict[str, Any] = {"frame": {"points": {"F": [0.1, -0.2]}}}
        self.pairs: list[dict[str, Any]] = []
        self.sketch: dict[str, list[float]] = {}
        self.inputs: list[dict[str, Any]] = []

    def link(self) -> str:
        name = f"L{len(self.links)}"
        x, y = self.rng.uniform(-1.0, 1.0, 2)
        self.frames[name] = frame_at(float(x), float(y), float(self.rng.uniform(-np.pi, np.pi)))
        self.links[name] = {"points": {}}
        return name

    def turning(self, first: str, second: str) -> str:
        name = f"T{len(self.pairs)}"
        at = self._somewhere(first, second)
        for link in (first, second):
            self.links[link]["points"][name] = list(self.frames[link].local(at))
        self.pairs.append({"turning": name, "links": [first, second]})
        self.sketch[name] = list(at)
        return name

    def sliding(self, first: str, second: str) -> str:
        name = f"S{len(self.pairs)}"
        at = self._somewhere(first, second)
        angle, slide = float(self.rng.uniform(-np.pi, np.pi)), float(self.rng.uniform(-0.8, 0.8))
        through = at - direction(angle) * slide
        self.links[first]["points"][f"{name}t"] = list(self.frames[first].local(through))
        self.links[second]["points"][name] = list(self.frames[second].local(at))
        self.pairs.append(
            {
                "sliding": name,
                "links": [first, second],
                "line": {"through": f"{name}t", "angle": angle - self.frames[first].angle},
                "point": name,
                "turn": self.frames[second].angle - angle,
            }
        )
        self.sketch[name] = list(at)
        return name

    def drive(self, pair: str, first: str, second: str, velocity: float, acceleration: float) -> None:
        if pair[0] == "T":
            angle = self.frames[second].angle - self.frames[first].angle
            position = -angle if second == "frame" else angle
        else:
            entry = next(each for each in self.pairs if each.get("sliding") == pair)
            through = self.frames[first].carry(Vector(*self.links[first]["points"][f"{pair}t"]))
            at = self.frames[second].carry(Vector(*self.links[second]["points"][pair]))
            position = (at - through).dot(direction(self.frames[first].angle + entry["line"]["angle"]))
        self.inputs.append({"pair": pair, "position": position, "velocity": velocity, "acceleration": acceleration})

    def _somewhere(self, first: str, second: str) -> Vector:
        """Near both links, so that their shapes are of the linkage's size."""
        a, b = (self.frames[link] for link in (first, second))
        mix = self.rng.uniform(0.2, 0.8)
        off = self.rng.uniform(-0.5, 0.5, 2)
        return Vector(float(a.x + mix * (b.x - a.x) + off[0]), float(a.y + mix * (b.y - a.y) + off[1]))

    def built(self, blur: float = 0.0) -> Built:
        links = {name: link for name, link in self.links.items() if link["points"]}
        sketch = {name: [float(c + blur * self.rng.normal()) for c in at] for name, at in self.sketch.items()}
        value = {
            "planar": 1,
            "name": "random",
            "frame": "frame",
            "links": links,
            "pairs": self.pairs,
            "inputs": self.inputs,
            "sketch": sketch,
        }
        return Built(value, {name: self.frames[name] for name in links})


def random_linkage(seed: int, links: int, blur: float = 0.0) -> Built:
    """A linkage of so many moving links: driven ones, then sets of 2, 4 or 6 links joined in any loops."""
    rng = np.random.default_rng(seed)
    builder = Builder(rng)
    placed = ["frame"]
    while len(builder.links) - 1 < links:
        room = links - (len(builder.links) - 1)
        if len(placed) == 1 or rng.random() < 0.15 or room == 1:
            base, moving = placed[int(rng.integers(len(placed)))], builder.link()
            kind = builder.turning if rng.random() < 0.7 else builder.sliding
            ends = (base, moving) if rng.random() < 0.7 else (moving, base)
            builder.drive(kind(*ends), *ends, float(rng.uniform(0.5, 2.0)), float(rng.uniform(-2.0, 2.0)))
            placed.append(moving)
            continue
        many = int(rng.choice([size for size in (2, 4, 6) if size <= room]))
        new = [builder.link() for _ in range(many)]
        for first, second in _joints(rng, placed, new):
            (builder.sliding if rng.random() < 0.25 else builder.turning)(first, second)
        placed += new
    return builder.built(blur)


def _joints(rng: np.random.Generator, placed: list[str], new: list[str]) -> list[tuple[str, str]]:
    """3/2 pairs a link, each new link on two or more, no two links joined twice."""
    while True:
        joints: set[tuple[str, str]] = set()
        for _ in range(200):
            first = new[int(rng.integers(len(new)))]
            pool = new + placed[-4:] if rng.random() < 0.8 else [*new, "frame"]
            second = pool[int(rng.integers(len(pool)))]
            if first != second and (second, first) not in joints:
                joints.add((first, second))
            if len(joints) == 3 * len(new) // 2:
                break
        counts = {link: sum(link in joint for joint in joints) for link in new}
        outside = sum(second not in new for _, second in joints)
        if min(counts.values()) >= 2 and outside >= 2 and len(joints) == 3 * len(new) // 2:
            ordered = sorted(joints)
            return [joint if rng.random() < 0.7 else joint[::-1] for joint in ordered]


def conditioning(solver: Solver, z: np.ndarray) -> float:
    """The least singular value of any group at a position, as the solver judges it."""
    y = np.concatenate([z, solver.station.u])
    slope = solver.program.kinematics(y, 0.0 * y, 0.0 * y, solver.station.p).slope
    return float(strengths(solver, slope).min(initial=1.0))


def determinate(mechanism: Mechanism, built: Built) -> bool:
    """Whether pairs and inputs determine every rate at the place where the linkage was built.

    By the rank of all constraints in all coordinates, nothing eliminated; each column by the complex step.
    """
    shapes = {link.name: shape(link) for link in mechanism.links}
    moving = [name for name in built.frames if name != mechanism.frame]
    numbers = {pair.name: pair.measure([shapes[link] for link in pair.bodies]) for pair in mechanism.pairs}
    pairs = {pair.name: pair for pair in mechanism.pairs}
    place = np.array([part for name in moving for part in _frame(built, name)], dtype=complex)
    own = [(pair.name, k) for pair in mechanism.pairs for k in range(len(pair.coordinates))]
    place = np.concatenate([place, [_displacement(built, pairs[name], numbers[name]) for name, _ in own]])

    def left(at: np.ndarray) -> np.ndarray:
        frames = {name: frame_at(*at[3 * k : 3 * k + 3]) for k, name in enumerate(moving)}
        frames[mechanism.frame] = built.frames[mechanism.frame]
        slides = {name: at[len(place) - len(own) + k] for k, (name, _) in enumerate(own)}
        found = []
        for pair in mechanism.pairs:
            ends = [frames[link] for link in pair.bodies]
            found += pair.residual(ends, numbers[pair.name], [slides.get(pair.name)])
        for given in mechanism.inputs:
            pair = pairs[given.pair]
            found.append(pair.drive([frames[link] for link in pair.bodies], (), [slides.get(pair.name)]))
        return np.array(found)

    step = 1e-30
    columns = [np.imag(left(place + step * 1j * unit)) / step for unit in np.eye(len(place))]
    return bool(np.linalg.matrix_rank(np.array(columns).T, tol=1e-6) == len(place))


def _frame(built: Built, name: str) -> tuple[float, float, float]:
    frame = built.frames[name]
    return frame.x, frame.y, frame.angle


def _displacement(built: Built, pair: Pair, numbers: Sequence[float]) -> float:
    first, second = (built.frames[link] for link in pair.links)
    way = second.carry(Vector(*numbers[4:6])) - first.carry(Vector(*numbers[0:2]))
    return way.dot(first.turn(Vector(*numbers[2:4])))
