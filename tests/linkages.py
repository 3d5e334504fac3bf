"""Random linkages, built closed: links first, pairs fitted between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from planar.document import files
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.model.link_shapes import link_shape
from planar.model.mechanism import Mechanism
from planar.model.pairs import Pair, pair_types
from planar.results.motion import State
from planar.solving.position import PositionSolver

LIFTING = ("cam", "geneva")
"""Pairs whose formulas are put together of pieces, of which a search from starts in a loop may miss solutions: these
have tests of their own."""


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
            self.links[link]["points"][name] = list(self.frames[link].to_local(at))
        self.pairs.append({"turning": name, "links": [first, second]})
        self.sketch[name] = list(at)
        return name

    def sliding(self, first: str, second: str) -> str:
        name = f"S{len(self.pairs)}"
        at = self._somewhere(first, second)
        self._line("sliding", name, first, second, at)
        line = self.pairs[-1]["line"]["angle"] + self.frames[first].angle
        self.pairs[-1]["turn"] = self.frames[second].angle - line
        self.sketch[name] = list(at)
        return name

    def slot(self, first: str, second: str) -> str:
        name = f"P{len(self.pairs)}"
        at = self._somewhere(first, second)
        self._line("slot", name, first, second, at)
        self.sketch[name] = list(at)
        return name

    def rack(self, first: str, second: str) -> str:
        name = f"R{len(self.pairs)}"
        at = self._somewhere(first, second)
        radius = float(self.rng.choice([-1.0, 1.0]) * self.rng.uniform(0.1, 0.5))
        slide = self._line("rack", name, first, second, at, radius)
        turn = self.frames[second].angle - self.frames[first].angle
        rack = self.pairs[-1]
        rack |= {"radius": radius, "mesh": {"displacement": slide, "angle": turn}}
        # a guide along the pitch line keeps the centre at its distance
        local = list(self.frames[first].to_local(at))
        guide = {"through": local, "angle": rack["line"]["angle"]}
        self.pairs.append({"slot": f"{name}guide", "links": [first, second], "line": guide, "point": name})
        return name

    def _line(self, keyword: str, name: str, first: str, second: str, at: Vector, off: float = 0.0) -> float:
        """A line of the first link, so far to the right of a point of the second; the point's place along it."""
        angle, slide = float(self.rng.uniform(-np.pi, np.pi)), float(self.rng.uniform(-0.8, 0.8))
        way = direction(angle)
        through = at - way * slide - Vector(-way.y, way.x) * off
        self.links[first]["points"][f"{name}t"] = list(self.frames[first].to_local(through))
        self.links[second]["points"][name] = list(self.frames[second].to_local(at))
        line = {"through": f"{name}t", "angle": angle - self.frames[first].angle}
        self.pairs.append({keyword: name, "links": [first, second], "line": line, "point": name})
        return slide

    def _wheels(self, keyword: str, first: str, second: str) -> str:
        name = f"W{len(self.pairs)}"
        carrier = str(self.rng.choice([link for link in self.frames if link not in (first, second)]))
        a, b = (self.frames[link].angle - self.frames[carrier].angle for link in (first, second))
        ratio = float(self.rng.choice([-1.0, 1.0]) * self.rng.uniform(0.4, 2.5))
        mesh = {first: a, second: b}
        for link in (first, second, carrier):
            self.links[link]["points"].setdefault("own", [0.1, 0.2])
        entry = {keyword: name, "links": [first, second], "carrier": carrier, "ratio": ratio, "mesh": mesh}
        self.pairs.append(entry)
        return name

    def gear(self, first: str, second: str) -> str:
        return self._wheels("gear", first, second)

    def belt(self, first: str, second: str) -> str:
        return self._wheels("belt", first, second)

    def chain(self, first: str, second: str) -> str:
        return self._wheels("chain", first, second)

    def higher(self, first: str, second: str) -> int:
        """Any pair that prevents one motion only, with what it needs beside it; how many motions they prevent."""
        kinds = [keyword for keyword, kind in pair_types().items() if kind.prevented_motion_count() == 1]
        kinds = [keyword for keyword in kinds if keyword not in LIFTING]
        if len(self.frames) < 3:
            kinds = [keyword for keyword in kinds if len(pair_types()[keyword].samples()[0].frames) == 2]
        before = len(self.pairs)
        keyword = str(self.rng.choice(kinds))
        if hasattr(self, keyword):
            getattr(self, keyword)(first, second)
        elif self.links[second]["points"]:
            self.slot(first, second)
        else:
            self.as_sampled(keyword, first, second)
        return len(self.pairs) - before

    def as_sampled(self, keyword: str, first: str, second: str) -> str:
        """A pair of any type of two bodies, as its first sample has it; the second link, still bare, is put to it."""
        sample, name = pair_types()[keyword].samples()[0], f"X{len(self.pairs)}"
        one, other = sample.frames
        at = self.frames[first].to_world(one.to_local(Vector(other.x, other.y)))
        self.frames[second] = frame_at(at.x, at.y, self.frames[first].angle + other.angle - one.angle)
        words = {"a": first, "b": second, sample.entry[keyword]: name}
        for link, shape in zip((first, second), sample.shapes, strict=True):
            for point, local in shape.points.items():
                words[point] = f"{name}{point}"
                self.links[link]["points"][words[point]] = list(local)

        def renamed(value: Any) -> Any:
            if isinstance(value, dict):
                return {words.get(key, key): renamed(each) for key, each in value.items()}
            if isinstance(value, list):
                return [renamed(each) for each in value]
            return words.get(value, value) if isinstance(value, str) else value

        self.pairs += [renamed(entry) for entry in (sample.entry, *sample.other_entries)]
        return name

    def drive(self, pair: str, first: str, second: str, velocity: float, acceleration: float) -> None:
        if pair[0] == "T":
            angle = self.frames[second].angle - self.frames[first].angle
            position = -angle if second == "frame" else angle
        else:
            entry = next(each for each in self.pairs if each.get("sliding") == pair)
            through = self.frames[first].to_world(Vector(*self.links[first]["points"][f"{pair}t"]))
            at = self.frames[second].to_world(Vector(*self.links[second]["points"][pair]))
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


def random_linkage(seed: int, links: int, blur: float = 0.0, higher: float = 0.0) -> Built:
    """A linkage of so many moving links: driven ones, then sets of 2, 4 or 6 links joined in any loops.

    `higher` is the share of joints made of higher pairs.
    """
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
            if rng.random() < higher:
                # in place of a pair that prevents two motions two that prevent one each
                if builder.higher(first, second) == 1:
                    other = new[int(rng.integers(len(new)))]
                    builder.slot(str(rng.choice([link for link in (*placed, *new) if link != other])), other)
            else:
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


def conditioning(solver: PositionSolver, z: np.ndarray) -> float:
    """The least singular value of any group at a position, as the solver judges it."""
    y = np.concatenate([z, solver.inputs.u])
    slope = solver.functions.kinematics(y, 0.0 * y, 0.0 * y, solver.inputs.p).jacobian
    return float(solver.jacobian_regularity(slope).min(initial=1.0))


def determinate(mechanism: Mechanism, built: Built) -> bool:
    """Whether pairs and inputs determine every rate at the place where the linkage was built.

    By the rank of all constraints in all coordinates, nothing eliminated; each column by the complex step.
    """
    shapes = {link.name: link_shape(link) for link in mechanism.links}
    moving = [name for name in built.frames if name != mechanism.frame]
    numbers = {pair.name: pair.measure([shapes[link] for link in pair.bodies]) for pair in mechanism.pairs}
    pairs = {pair.name: pair for pair in mechanism.pairs}
    place = np.array([part for name in moving for part in _frame(built, name)], dtype=complex)
    own = [(pair.name, k) for pair in mechanism.pairs for k in range(len(pair.coordinate_kinds))]
    place = np.concatenate([place, *(_own(built, pair, numbers[pair.name]) for pair in mechanism.pairs)])

    def left(at: np.ndarray) -> np.ndarray:
        frames = {name: frame_at(*at[3 * k : 3 * k + 3]) for k, name in enumerate(moving)}
        frames[mechanism.frame] = built.frames[mechanism.frame]
        slides: dict[str, list] = {name: [] for name in pairs}
        for k, (name, _) in enumerate(own):
            slides[name].append(at[len(place) - len(own) + k])
        found = []
        for pair in mechanism.pairs:
            ends = [frames[link] for link in pair.bodies]
            found += pair.residual(ends, numbers[pair.name], slides[pair.name])
        for given in mechanism.inputs:
            pair = pairs[given.pair]
            found.append(pair.input_position([frames[link] for link in pair.bodies], (), slides[pair.name]))
        return np.array(found)

    step = 1e-30
    columns = [np.imag(left(place + step * 1j * unit)) / step for unit in np.eye(len(place))]
    return bool(np.linalg.matrix_rank(np.array(columns).T, tol=1e-6) == len(place))


def _frame(built: Built, name: str) -> tuple[float, float, float]:
    frame = built.frames[name]
    return frame.x, frame.y, frame.angle


def _own(built: Built, pair: Pair, numbers: Sequence[float]) -> np.ndarray:
    """The pair's own coordinates where the linkage was built: they enter its residual linearly."""
    frames = [built.frames[link] for link in pair.bodies]
    count = len(pair.coordinate_kinds)
    still = np.array(pair.residual(frames, numbers, [0.0] * count))
    slopes = [np.array(pair.residual(frames, numbers, list(unit))) - still for unit in np.eye(count)]
    return np.linalg.lstsq(np.array(slopes).T, -still, rcond=None)[0] if count else np.zeros(0)


seeds = st.integers(0, 10**6)
shares = st.sampled_from([0.0, 0.0, 0.3])
"""Of joints made of higher pairs."""


def assembled(built: Built, least: float) -> tuple[Mechanism, State]:
    """The linkage solved; assumed to have determinate rates, with some distance from dead points."""
    mechanism = files.from_dict(built.value)
    solver = PositionSolver(mechanism)
    try:
        found = solver.find_assembly()
        state = solver.state(found.z, solver.remarks(found))  # as `solve` does
    except NoAnswer as problem:
        # loops drawn at random may hold each other twice, or leave freedom: then that is what must be said, and only
        # then
        assert problem.outcome in (Outcome.TOO_FEW_INPUTS, Outcome.INPUT_JAMMED, Outcome.DEAD_POINT)
        assert not determinate(mechanism, built)
        assume(False)
        raise
    assume(conditioning(solver, found.z) > least)
    return mechanism, state
