"""All instantaneous centres of a position, each with its derivation, and proved by another route."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from planar.analysis.kennedy import Found, Primary, Through, Two, constructed, unit
from planar.analysis.primary import primary
from planar.analysis.ratios import motions_of
from planar.analysis.ties import Rates, part, rates
from planar.analysis.walks import Walks
from planar.graph import numbered
from planar.mechanism import named_points
from planar.motion import State, Unknown
from planar.solving.constraints import Constraints, null_space
from planar.solving.setup import Setup

Array = np.ndarray
INFINITE = 1e-9
"""A centre whose w is this small beside x and y, in the mechanism's size, cannot be told from one at infinity."""
AS_ONE = 1e-9
"""Links that move this little against each other, beside the greatest motion, move as one."""
EXACT = 1e-13
"""How exact the equations round the loops are."""


@dataclass(frozen=True)
class Centre:
    """The instantaneous centre of two links: where both have the same velocity.

    `homogeneous` (3,) is (x, y, w) of length one, in metres in the frame's axes: the point (x/w, y/w), or for w = 0
    the direction (x, y) in which it lies at infinity; None where the two links move as one, or it is not determined.
    """

    links: tuple[str, str]
    name: str
    "I24, of the links' numbers"
    order: int
    "the how manieth it was found as"
    how: str
    "`pair`, `Kennedy`, `ratio`, `equations`, `as one` or `open`"
    homogeneous: Array | None
    derivation: str
    lines: tuple[Line, ...] = ()

    @property
    def position(self) -> Array | None:
        """(2,), m; None at infinity, and where it is not determined."""
        if self.homogeneous is None or self.homogeneous[2] == 0.0:
            return None
        return self.homogeneous[:2] / self.homogeneous[2]

    @property
    def direction(self) -> Array | None:
        """The unit vector (2,) towards a centre at infinity, else None."""
        if self.homogeneous is None or self.homogeneous[2] != 0.0:
            return None
        return self.homogeneous[:2]


class Line(NamedTuple):
    """A line of centres on which a centre was found: through two other centres by name, or the normal of a pair."""

    centres: tuple[str, ...] = ()
    pair: str = ""


class Proof(NamedTuple):
    """The worst of three figures over all centres, on homogeneous points with lengths in the mechanism's size.

    `routes`: between the centre and that of the null vector of the whole Jacobian. `collinear`: the determinant of the
    centres of any three links. `velocities`: between the velocities that both links have in their centre, beside the
    greatest. None where the Jacobian does not tell one motion.
    """

    routes: float | None
    collinear: float
    velocities: float | None


@dataclass(frozen=True)
class Centres:
    """All n(n-1)/2 centres of a position, by two link names in any order."""

    state: State
    numbers: Mapping[str, str]
    "of the links, as textbooks count them: the frame is last"
    all: tuple[Centre, ...]
    "in the order in which they were found"
    proof: Proof

    def __getitem__(self, links: tuple[str, str]) -> Centre:
        for centre in self.all:
            if set(centre.links) == set(links):
                return centre
        raise Unknown(f"there are no links {' and '.join(map(repr, links))}; links are {', '.join(self.numbers)}")

    def __iter__(self) -> Iterator[Centre]:
        return iter(self.all)

    def __len__(self) -> int:
        return len(self.all)


def centres(state: State) -> Centres:
    """Every instantaneous centre of a position, from positions alone: Kennedy's theorem on what the pairs show.

    Where no two lines are known, one centre is taken from the linear equations round the loops, and lines serve again;
    a mechanism with several inputs has its centres for their given rates.
    """
    found = _Search(state)
    found.run()
    return found.told()


class _Search:
    """The centres of one position while they are found."""

    def __init__(self, state: State):
        self.state = state
        self.numbers = numbered(state.mechanism)
        self.links = sorted(self.numbers, key=lambda link: int(self.numbers[link]))
        points = np.array([point.position for point in state.points.values()])
        self.middle = 0.5 * (points.max(axis=0) + points.min(axis=0))
        self.size = float(np.ptp(points, axis=0).max()) or 1.0
        self.rates: Rates = rates(state)
        named = {member: each.name for each in named_points(state.mechanism) for member in each.members}
        self.walks = Walks(self.rates, named, self.size)
        self.primary: Primary = primary(self.rates, self.middle, self.size)
        self.found: dict[Two, Found] = {}
        self.by_equations: set[Two] = set()
        self.as_one: set[Two] = set()

    def run(self) -> None:
        """All of them, as far as they are determined."""
        every = [frozenset(two) for two in combinations(self.links, 2)]
        self.found = constructed(self.links, self.primary, self.primary.centres)
        if len(self.found) == len(every):
            return
        motions = motions_of(self.rates, self.walks, self.middle, self.size)
        while motions is not None:
            left = [two for two in every if two not in self.found and two not in self.as_one]
            if not left:
                return
            two = max(left, key=self._opens)
            a, b = sorted(two)
            relative = motions[b] - motions[a]
            if np.linalg.norm(relative) <= AS_ONE:
                self.as_one.add(two)
                continue
            self.by_equations.add(two)
            self.found[two] = Found(unit(relative), EXACT)
            self.found = constructed(self.links, self.primary, self.found)

    def _opens(self, two: Two) -> int:
        """How many open centres would have two lines if this one were known."""
        count = 0
        for end in two:
            (other,) = two - {end}
            for link in self.links:
                third = frozenset((end, link))
                if link not in two and third not in self.found and frozenset((other, link)) in self.found:
                    count += any(
                        frozenset((end, via)) in self.found and frozenset((via, link)) in self.found
                        for via in self.links
                        if via not in (end, link, other)
                    )
        return count

    def told(self) -> Centres:
        """The centres in metres, with names and derivations, and their proof."""
        listed = [self._centre(two, order, one) for order, (two, one) in enumerate(self.found.items(), start=1)]
        rest = [frozenset(two) for two in combinations(self.links, 2) if frozenset(two) not in self.found]
        listed += [self._without(two, len(listed) + k) for k, two in enumerate(rest, start=1)]
        return Centres(self.state, self.numbers, tuple(listed), self._proof())

    def _named(self, two: Two) -> tuple[tuple[str, str], str]:
        links = tuple(sorted(two, key=lambda link: int(self.numbers[link])))
        first, second = (self.numbers[link] for link in links)
        return links, f"I{first}{second}" if len(self.links) < 10 else f"I{first},{second}"

    def _name(self, a: str, b: str) -> str:
        return self._named(frozenset((a, b)))[1]

    def _centre(self, two: Two, order: int, one: Found) -> Centre:
        links, name = self._named(two)
        x, y, w = one.at
        if abs(w) <= INFINITE * np.hypot(x, y):
            at = unit(np.array([x, y, 0.0]))
        else:
            at = unit(np.array([self.size * x + w * self.middle[0], self.size * y + w * self.middle[1], w]))
        lines = tuple(self._line(through, links) for through in one.lines)
        if one.pair:
            how, told = (
                "pair",
                f"{name} at infinity, square to the motion at {one.pair}" if at[2] == 0.0 else f"{name} at {one.pair}",
            )
        elif two in self.by_equations:
            how, told = "equations", f"{name} by the equations round the loops: no two lines are known"
        elif one.ratio:
            how, told = "ratio", f"{name} on {_said(lines[0])}, in the ratio of {one.ratio}"
        else:
            how, told = "Kennedy", f"{name} = {_said(lines[0])} × {_said(lines[1])}"
        return Centre(links, name, order, how, at, told, lines)

    def _line(self, through: Through, links: Sequence[str]) -> Line:
        if through.pair:
            return Line(pair=through.pair)
        return Line(tuple(self._name(link, through.link) for link in links))

    def _without(self, two: Two, order: int) -> Centre:
        links, name = self._named(two)
        if two in self.as_one:
            told = f"{name}: {links[0]} and {links[1]} move as one here, so every point is their centre"
            return Centre(links, name, order, "as one", None, told)
        told = f"{name} depends on the ratio of the inputs' rates, which are not given or all zero"
        return Centre(links, name, order, "open", None, told)

    def _proof(self) -> Proof:
        found = {two: one.at for two, one in self.found.items()}
        triples = [
            tuple(found[frozenset(two)] for two in combinations(three, 2))
            for three in combinations(self.links, 3)
            if all(frozenset(two) in found for two in combinations(three, 2))
        ]
        collinear = float(np.abs(np.linalg.det(np.array(triples))).max()) if triples else 0.0
        motions = _jacobian(self.state, self.middle, self.size)
        if motions is None:
            return Proof(None, collinear, None)
        routes = velocities = 0.0
        for two, at in found.items():
            a, b = two
            relative = motions[b] - motions[a]
            length = float(np.linalg.norm(relative))
            if length > AS_ONE:
                routes = max(routes, float(np.linalg.norm(np.cross(at, relative / length))))
            x, y, w = at
            mx, my, turning = relative
            apart = np.hypot(turning * y - my * w, turning * x - mx * w)
            velocities = max(velocities, float(apart))
        return Proof(routes, collinear, velocities)


def _said(line: Line) -> str:
    return " ".join(line.centres) if line.centres else f"the normal at {line.pair}"


def _jacobian(state: State, middle: Array, size: float) -> dict[str, Array] | None:
    """Every link's motion by the null vector of all constraints, nothing eliminated; as `motions_of` has it.

    With several inputs the one in which their rates are as given. None where there is no such one.
    """
    setup = Setup(state.mechanism)
    constraints = Constraints(setup)
    w = np.array([_value(state, c.owner, c.part, c.of_link) for c in setup.equations.coordinates]) / setup.scale
    free = null_space(constraints.slope(w)) if w.size else np.zeros((0, 0))
    if free.shape[1] != 1:
        names = tuple(given.pair for given in state.mechanism.inputs)
        rows = constraints.drive_slope(names, w) @ free
        if free.shape[1] == 0 or rows.shape[0] < free.shape[1] or not np.any(setup.station.u1):
            return None
        free = free @ np.linalg.lstsq(rows, setup.station.u1, rcond=None)[0][:, None]
    moving = dict(zip(((c.owner, c.part) for c in setup.equations.coordinates), free[:, 0] * setup.scale, strict=True))
    poles = {}
    for link, frame in state.frames.items():
        vx, vy, turning = (moving.get((link, which), 0.0) for which in ("x", "y", "angle"))
        x, y = (np.array([part(frame.x, 0), part(frame.y, 0)]) - middle) / size
        poles[link] = np.array([turning * x - vy / size, turning * y + vx / size, turning])
    most = max(float(np.linalg.norm(pole)) for pole in poles.values())
    return {link: pole / most for link, pole in poles.items()} if most else None


def _value(state: State, owner: str, which: str, of_link: bool) -> float:
    if of_link:
        return part(getattr(state.frames[owner], which), 0)
    pair = next(pair for pair in state.mechanism.pairs if pair.name == owner)
    names = [name for name, _ in pair.coordinates]
    return part(state.own[owner][names.index(which)], 0)
