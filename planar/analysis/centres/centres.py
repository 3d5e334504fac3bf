"""All instantaneous centres of a position, each with its derivation, and proved by another route."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, islice
from typing import NamedTuple

import numpy as np

from planar.analysis.centres.branch_rates import branch_poles
from planar.analysis.centres.kennedy import (
    MAX_MEETING_ERROR,
    FoundCentre,
    KennedyConstruction,
    KennedyLine,
    LinkPair,
    normalise,
)
from planar.analysis.centres.null_space_check import (
    AS_ONE_RATIO,
    CentresProof,
    allowed_motions,
    links_moving_as_one,
    prove_centres,
)
from planar.analysis.centres.pair_centres import primary_centres
from planar.analysis.rate_equations import RateEquations
from planar.analysis.rate_equations import rate_equations as rates_of
from planar.analysis.rate_ratios import LEAST_ERROR, LinkPoles, solve_link_poles
from planar.analysis.vector_chains import VectorChains
from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, Unknown, join_names
from planar.foundation.notebook_display import Displayable
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import stop_if_over, stops_in_time
from planar.model.link_graph import link_numbers, number_separator
from planar.model.mechanism import Mechanism, check_link_count, named_points
from planar.results.motion import State
from planar.solving.position import rest_position

MAX_ERROR_AT_CROSSING = 1e-9
"""Where motions cross positions are exact to the root of rounding only: lines that close to one another are one."""
INFINITY_RATIO_AT_CROSSING = 1e-6
"""As INFINITE, where motions cross."""
INFINITY_RATIO = 1e-9
"""A centre whose w is this small beside x and y, in the mechanism's size, cannot be told from one at infinity."""

MAX_LINKS_OF_ALL_CENTRES, MAX_LINKS_OF_SOME_CENTRES = 250, 600
"""Of more links all centres, or those of some links, take minutes: the time grows with the cube of the links."""
MAX_LINKS_OF_FULL_SEARCH = 40
"""Of mechanisms of more links only the centres of the chosen links and of the frame are searched for."""


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
    "the how manieth it was found as; what was not found comes last"
    how: str
    "`pair`, `Kennedy`, `ratio`, `equations`, `as one` or `open`"
    homogeneous: Array | None
    derivation: str
    lines: tuple[CentreLine, ...] = ()

    __repr__ = short_repr

    @property
    def position(self) -> Array | None:
        """(2,), m; None at infinity, and where it is not determined."""
        if self.homogeneous is None or self.homogeneous[2] == 0.0:
            return None
        found: Array = self.homogeneous[:2] / self.homogeneous[2]
        return found

    @property
    def direction(self) -> Array | None:
        """The unit vector (2,) towards a centre at infinity, else None."""
        if self.homogeneous is None or self.homogeneous[2] != 0.0:
            return None
        return self.homogeneous[:2]


class CentreLine(NamedTuple):
    """A line of centres on which a centre was found: through two other centres by name, or the normal of a pair."""

    centres: tuple[str, ...] = ()
    pair: str = ""


@dataclass(frozen=True)
class Centres(Displayable):
    """All n(n-1)/2 centres of a position, or those of some links, by two link names in any order."""

    state: State
    numbers: Mapping[str, str]
    "of the links, as textbooks count them: the frame is last"
    all: tuple[Centre, ...]
    "in the order in which they were found"
    proof: CentresProof
    as_one: tuple[tuple[str, ...], ...]
    "links that move as one in this position, in groups; at rest are those in one with the frame"
    branches: tuple[Mapping[str, Array], ...] = ()
    "at a change point, for each branch that crosses there, where the open centres by name lie on it: homogeneous (3,)"
    links: tuple[str, ...] = ()
    "of one link all its centres, of several those between any two of them; without any all"

    @cached_property
    def _by_links(self) -> dict[LinkPair, Centre]:
        return {frozenset(centre.links): centre for centre in self.all}

    def __repr__(self) -> str:
        return f"<{len(self)} instantaneous centres of {self.state!r}>"

    def __getitem__(self, links: tuple[str, str]) -> Centre:
        two = frozenset(links)
        if two in self._by_links:
            return self._by_links[two]
        if two <= self.numbers.keys() and len(two) == 2:
            chosen = ", ".join(self.links)
            raise Unknown(f"only centres of {chosen} were computed, not that of {' and '.join(map(repr, links))}")
        raise Unknown(f"there are no links {' and '.join(map(repr, links))}; links are {', '.join(self.numbers)}")

    def __iter__(self) -> Iterator[Centre]:
        return iter(self.all)

    def __len__(self) -> int:
        return len(self.all)


@takes_result("State", "Mechanism")
@stops_in_time
def centres(
    position: State | Mechanism,
    links: str | Sequence[str] = (),
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Centres:
    """Every instantaneous centre of a position, from positions alone: Kennedy's theorem on what the pairs show.

    Where no two lines are known, one centre is taken from the linear equations round the loops, and lines serve again;
    where the mechanism can move in several ways it is that of the inputs' given rates. Of a mechanism only the
    position is assembled, so that it may stand where `solve` finds no velocities: on a dead point of its inputs or on
    a change point. `links` chooses: of one link all its centres, of several those between any two of them; the time
    of these grows with the number of links, that of all with its cube. Raises NoAnswer where it cannot be assembled,
    or after `timeout` s, or a Ctrl-C, with the outcome "interrupted"; BadInput for a link that there is not, for all
    centres of more than 250 links and for some of more than 600.

    >>> import planar
    >>> sorted(each.name for each in planar.centres(planar.load("four-bar")))
    ['I12', 'I13', 'I14', 'I23', 'I24', 'I34']
    >>> sorted(each.name for each in planar.centres(planar.load("four-bar"), "BC"))
    ['I12', 'I23', 'I24']
    """
    chosen = chosen_links(position if isinstance(position, Mechanism) else position.mechanism, links)
    search = _CentreSearch(rest_position(position) if isinstance(position, Mechanism) else position, chosen)
    search.search()
    return search.result()


def chosen_links(mechanism: Mechanism, links: str | Sequence[str]) -> tuple[str, ...]:
    """The links whose centres are asked for, none for all. Raises BadInput where that takes too long."""
    chosen = (links,) if isinstance(links, str) else tuple(dict.fromkeys(links))
    names = [link.name for link in mechanism.links]
    for link in chosen:
        if link not in names:
            raise BadInput(link, f"there is no link of this name; links are {join_names(names)}")
    remedy = f"up to {MAX_LINKS_OF_SOME_CENTRES} links those of one link can be asked for"
    check_link_count(mechanism, MAX_LINKS_OF_SOME_CENTRES, "instantaneous centres", remedy)
    if not chosen:
        remedy = f"those of one link take seconds: --link {names[0]}, or in Python centres(position, {names[0]!r})"
        check_link_count(mechanism, MAX_LINKS_OF_ALL_CENTRES, "all instantaneous centres", remedy)
    return chosen


def is_chosen(two: Iterable[str], links: Collection[str]) -> bool:
    """Whether the centre of two links is among those of some links: of one all, of several those between them."""
    return len(links) == 0 or (any if len(links) == 1 else all)(link in links for link in two)


def extent(state: State) -> tuple[Array, float]:
    """The middle (2,) of all points, and the greater side of the rectangle that holds them (m)."""
    points = np.array([point.position for point in state.points.values()]).reshape(-1, 2)
    low, high = (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(2), np.zeros(2))
    return 0.5 * (low + high), float((high - low).max()) or 1.0


class OpeningPairs:
    """How many centres would have two lines if that of two links were known, for all pairs of links while centres
    become known."""

    def __init__(self, link_count: int, is_target: BoolArray | None = None):
        """`is_target` (links, links): the pairs that are offered; by default all."""
        shape = (link_count, link_count)
        self.known_count = 0
        self._is_known, self._has_line = np.zeros(shape, dtype=int), np.zeros(shape, dtype=int)
        self._is_open = np.triu(np.ones(shape, dtype=bool) if is_target is None else is_target, 1)
        "of links in their order: neither known nor excluded"
        self._opened = np.zeros(shape, dtype=int)
        "for links a and b how many others have a line with a and a known centre with b"

    def add_known(self, pairs: Iterable[tuple[int, ...]]) -> None:
        """Take centres of pairs of links as known."""
        known, line = self._is_known, self._has_line
        for a, b in pairs:
            self.known_count += 1
            self.exclude((a, b))
            if line[a, b]:
                self._change_line(a, b, -1)
            known[a, b] = known[b, a] = 1
            self._opened[:, b] += line[:, a]
            self._opened[:, a] += line[:, b]
            for one, via in ((a, b), (b, a)):
                for other in np.flatnonzero(known[via] & ~known[one] & ~line[one]):
                    if other != one:
                        self._change_line(one, int(other), 1)

    def _change_line(self, a: int, b: int, by: int) -> None:
        self._has_line[a, b] += by
        self._has_line[b, a] += by
        self._opened[a] += by * self._is_known[b]
        self._opened[b] += by * self._is_known[a]

    def exclude(self, pair: tuple[int, ...]) -> None:
        """Offer a pair no more."""
        a, b = sorted(pair)
        self._is_open[a, b] = False

    def best_pair(self) -> tuple[int, int] | None:
        """The first pair that opens most, of those that are neither known nor excluded; None where there is none."""
        if not self._is_open.any():
            return None
        opened = np.where(self._is_open, self._opened + self._opened.T, -1)
        a, b = np.unravel_index(int(opened.argmax()), opened.shape)
        return int(a), int(b)


class _CentreSearch:
    """The centres of one position while they are found."""

    def __init__(self, state: State, chosen: tuple[str, ...] = ()):
        self.state, self.chosen = state, chosen
        self.numbers = link_numbers(state.mechanism)
        self.links = sorted(self.numbers, key=lambda link: int(self.numbers[link]))
        self.middle, self.size = extent(state)
        rates: RateEquations = rates_of(state)
        named = {member: each.name for each in named_points(state.mechanism) for member in each.members}
        self.chains = VectorChains(rates, named, self.size)
        self.motions = allowed_motions(state, self.middle, self.size)
        worst = MAX_MEETING_ERROR if self.motions.mobility <= 1 else MAX_ERROR_AT_CROSSING
        self.targets = self._target_pairs()
        primary = primary_centres(rates, self.middle, self.size)
        self.construction = KennedyConstruction(self.links, primary, worst, self.targets)
        self.by_equations: dict[LinkPair, str] = {}
        self.as_one: set[LinkPair] = set()
        self.open_reason = ""

    def _target_pairs(self) -> list[LinkPair] | None:
        """The pairs of links whose centres are searched for; None for all.

        Lines through centres of the frame and of a link locate nearly all other centres of the link. Where mechanisms
        are small all are searched for, so that those of a link are derived as in the list of all.
        """
        if not self.chosen or len(self.links) <= MAX_LINKS_OF_FULL_SEARCH:
            return None
        ends = {*self.chosen, self.state.mechanism.frame}
        return [frozenset((a, b)) for a in sorted(ends) for b in self.links if a != b]

    @property
    def found(self) -> dict[LinkPair, FoundCentre]:
        """By two links, in the order in which they were found."""
        return self.construction.found

    def search(self) -> None:
        """All of them, as far as they are determined."""
        self.construction.find_all()
        moved: LinkPoles | None = None
        place = {link: index for index, link in enumerate(self.links)}
        is_target = np.full((len(self.links), len(self.links)), self.targets is None)
        for target in self.targets or ():
            first, second = (place[link] for link in target)
            is_target[first, second] = is_target[second, first] = True
        opening = OpeningPairs(len(self.links), is_target)
        while True:
            stop_if_over(f"after {len(self.found)} centres")
            opening.add_known(
                [tuple(place[link] for link in two) for two in islice(self.found, opening.known_count, None)]
            )
            next_pair = opening.best_pair()
            if next_pair is None:
                return
            moved = moved or solve_link_poles(self.chains.equations, self.chains, self.middle, self.size)
            further = moved.links is None and self.motions.mobility == 1
            if further:
                moved = LinkPoles({link: each[0] for link, each in self.motions.poles.items()}, "", LEAST_ERROR)
            if moved.links is None:
                self.open_reason = moved.reason
                return
            a, b = (self.links[index] for index in next_pair)
            two = frozenset((a, b))
            relative = moved.links[b] - moved.links[a]
            length = float(np.linalg.norm(relative))
            if length <= self.motions.as_one_ratio:
                self.as_one.add(two)
                opening.exclude(next_pair)
                continue
            nearly = self.construction.count_lines(two) > 1
            told = "the lines known are one, or nearly" if nearly else "no two lines are known"
            self.by_equations[two] = f"{told}, and to first order more could move" if further else told
            self.construction.add_centre(two, FoundCentre(normalise(relative), moved.error / length))
            self.construction.find_all()

    def result(self) -> Centres:
        """The centres in metres, with names and derivations, and their proof."""
        chosen = {two: one for two, one in self.found.items() if is_chosen(two, self.chosen)}
        listed = [self._centre(two, order, one) for order, (two, one) in enumerate(chosen.items(), start=1)]
        rest = [
            frozenset(two)
            for two in combinations(self.links, 2)
            if frozenset(two) not in self.found and is_chosen(two, self.chosen)
        ]
        listed += [self._undetermined_centre(two, order) for order, two in enumerate(rest, start=len(listed) + 1)]
        proof = prove_centres({two: one.at for two, one in self.found.items()}, self.links, self.motions)
        groups = links_moving_as_one(self.links, self.motions)
        branches = self._branch_centres(listed)
        return Centres(self.state, self.numbers, tuple(listed), proof, groups, branches, self.chosen)

    def _branch_centres(self, listed: Sequence[Centre]) -> tuple[dict[str, Array], ...]:
        """Where the open centres lie on each branch of a change point; links that move as one on it have none."""
        left = [each for each in listed if each.how == "open"]
        if not left or self.motions.mobility <= len(self.state.mechanism.inputs):
            return ()
        found = []
        for motions in branch_poles(self.state, self.middle, self.size):
            relatives = {each.name: motions[each.links[1]] - motions[each.links[0]] for each in left}
            moving = {name: each for name, each in relatives.items() if np.linalg.norm(each) > AS_ONE_RATIO}
            found.append(
                {
                    name: self._in_metres(each / np.linalg.norm(each), INFINITY_RATIO_AT_CROSSING)
                    for name, each in moving.items()
                }
            )
        return tuple(found)

    def _in_metres(self, at: Array, infinite: float = INFINITY_RATIO) -> Array:
        """A homogeneous point in sizes about the middle as one in metres, at infinity what cannot be told from it."""
        x, y, w = at
        if abs(w) <= infinite * np.hypot(x, y):
            return normalise(np.array([x, y, 0.0]))
        return normalise(np.array([self.size * x + w * self.middle[0], self.size * y + w * self.middle[1], w]))

    def _named(self, two: LinkPair) -> tuple[tuple[str, str], str]:
        first, second = sorted(two, key=lambda link: int(self.numbers[link]))
        return (first, second), f"I{self.numbers[first]}{number_separator(self.numbers)}{self.numbers[second]}"

    def _name(self, a: str, b: str) -> str:
        return self._named(frozenset((a, b)))[1]

    def _centre(self, two: LinkPair, order: int, one: FoundCentre) -> Centre:
        links, name = self._named(two)
        at = self._in_metres(one.at)
        lines = tuple(self._line(through, links) for through in one.lines)
        if one.pair:
            how, told = (
                "pair",
                f"{name} at infinity, square to the motion at {one.pair}" if at[2] == 0.0 else f"{name} at {one.pair}",
            )
        elif two in self.by_equations:
            how, told = "equations", f"{name} by the equations round the loops: {self.by_equations[two]}"
        elif one.ratio:
            how, told = "ratio", f"{name} on {_line_name(lines[0])}, in the ratio of {one.ratio}"
        else:
            how, told = "Kennedy", f"{name} = {_line_name(lines[0])} × {_line_name(lines[1])}"
        return Centre(links, name, order, how, at, told, lines)

    def _line(self, through: KennedyLine, links: Sequence[str]) -> CentreLine:
        if through.pair:
            return CentreLine(pair=through.pair)
        return CentreLine(tuple(self._name(link, through.link) for link in links))

    def _undetermined_centre(self, two: LinkPair, order: int) -> Centre:
        links, name = self._named(two)
        if two in self.as_one:
            told = f"{name}: {links[0]} and {links[1]} move as one here, so every point is their centre"
            return Centre(links, name, order, "as one", None, told)
        return Centre(links, name, order, "open", None, f"{name} is not determined: {self.open_reason}")


def _line_name(line: CentreLine) -> str:
    return " ".join(line.centres) if line.centres else f"the normal at {line.pair}"
