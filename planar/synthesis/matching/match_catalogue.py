"""Matches: designs of a catalogue that come near to what is wanted, wherever, however large and however turned."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from planar.document.dimensions import file_dimensions, find_dimension
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism
from planar.synthesis.matching.carried_points import CarriedPoint, carried_point, free_point_names
from planar.synthesis.matching.curve_index import CurveIndex, curve_index
from planar.synthesis.matching.match_finder import find_candidates, spread_choice
from planar.synthesis.matching.match_problem import MatchProblem, MatchState
from planar.synthesis.matching.sample_search import with_rounds
from planar.synthesis.matching.wanted_entries import Entries, FunctionEntries, PathEntries, PoseEntries
from planar.synthesis.swept.bare_mechanism import bare_mechanism
from planar.synthesis.swept.swept_catalogue import SIZE, SweptCatalogue, swept_catalogue


class Similarity(NamedTuple):
    """A move of a whole mechanism: a place x + iy (m) goes to factor * place + offset."""

    factor: complex = 1.0 + 0.0j
    offset: complex = 0.0j


@dataclass(frozen=True, eq=False)
class CatalogueMatch:
    """A design near to what is wanted, before it is moved as `move` has it.

    `numbers` (free,) as the search was given their names (SI). At all wanted entries, one item after the other,
    `inputs` (entries,) are the positions of the running input (rad or m), `frames` (entries, moving links, 3) where the
    axes of the links are: x, y (m) and angle (rad), nearly. `distance` is the root mean square miss, after the move, in
    sizes of what is wanted (see `entries_size`), of angles in rad.
    """

    numbers: Array
    inputs: Array
    frames: Array = field(repr=False)
    distance: float
    move: Similarity
    design: int

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class MatchCatalogue:
    """A mechanism's catalogue with the curves of its wanted points, in which matches are looked for."""

    mechanism: Mechanism
    names: tuple[str, ...]
    swept: SweptCatalogue
    points: dict[str, CarriedPoint] = field(repr=False)
    curves: dict[str, CurveIndex] = field(repr=False)

    __repr__ = short_repr

    def matches(
        self, wanted: Sequence[Entries], *, can_move: bool = True, many: int = 64, seed: int = 0
    ) -> list[CatalogueMatch]:
        """At most so many designs that come near to all that is wanted, the nearest first, none all but like another.

        With `can_move` a mechanism may be moved, turned and made larger as a whole. The same for the same seed. Raises
        BadInput where a point, link or pair is wanted that the catalogue was not made for.
        """
        self._check(wanted)
        problem = MatchProblem(self.swept, tuple(wanted), self.points, self.curves, can_move)
        state = find_candidates(problem, np.random.default_rng([seed, 1]))
        return self._matches(problem, state.select(spread_choice(problem, state, many)))

    def _check(self, wanted: Sequence[Entries]) -> None:
        if not wanted:
            raise BadInput("wanted", "nothing is wanted, so that every design would do")
        for each in wanted:
            if isinstance(each, PathEntries) and each.point not in self.points:
                raise BadInput("wanted", f"the catalogue was not made for a point {each.point!r}")
            if isinstance(each, PoseEntries) and each.link not in self.swept.links:
                raise BadInput("wanted", f"{self.mechanism.name!r} has no moving link {each.link!r}")
            if isinstance(each, FunctionEntries):
                known = {*self.swept.motions.values, self.mechanism.inputs[0].pair}
                for pair in {each.from_pair, each.to_pair} - known:
                    raise BadInput("wanted", f"the catalogue was not made for a pair {pair!r}")

    def _matches(self, problem: MatchProblem, state: MatchState) -> list[CatalogueMatch]:
        closed, count = self.swept.motions.is_closed[state.design], self.swept.sample_count
        samples = np.concatenate(
            [
                with_rounds(each, closed, count, entries.in_order)
                if not isinstance(entries, FunctionEntries) and entries.inputs is None
                else each
                for entries, each in zip(problem.wanted, state.samples, strict=True)
            ],
            axis=1,
        )
        frames = np.empty((*samples.shape, len(self.swept.links), 3))
        for link in range(len(self.swept.links)):
            origin, turn = problem.frames(link, state.design, samples)
            frames[:, :, link] = np.stack([origin.real, origin.imag, np.angle(turn)], axis=2)
        numbers, inputs = self._numbers(state), problem.inputs(state.design, samples)
        moves = map(Similarity, state.factor.tolist(), state.offset.tolist())
        each = zip(numbers, inputs, frames, state.distance.tolist(), moves, state.design.tolist(), strict=True)
        return [CatalogueMatch(*one) for one in each]

    def _numbers(self, state: MatchState) -> Array:
        """The numbers of candidates (n, names)."""
        dimensions = file_dimensions(self.mechanism)
        known = dict(zip(self.swept.names, self.swept.numbers[state.design].T, strict=True))
        for name, place in state.places.items():
            own = self.points[name].names
            if own is not None:
                known |= {own[0]: place.real, own[1]: place.imag}
        columns = [known.get(name, np.full(len(state.design), dimensions[name].value)) for name in self.names]
        return np.array(columns).reshape(len(self.names), -1).T


def match_catalogue(  # many: each says what it holds
    mechanism: Mechanism,
    names: Sequence[str],
    points: Sequence[str] = (),
    pairs: Sequence[str] = (),
    *,
    lower: Array | None = None,
    upper: Array | None = None,
    size: int = SIZE,
    seed: int = 0,
    progress: Callable[[int, int], object] | None = None,
) -> MatchCatalogue:
    """The catalogue of a mechanism in the numbers `names`, for paths of `points` and functions of `pairs`.

    Both coordinates of a wanted point, where they are among the numbers and nothing else rests on them, are no numbers
    of the sweep: how a point moves follows from how its link does. `lower` and `upper` (names,) are bounds (SI),
    infinite where there is none. Kept on disk; the same for the same seed. Raises BadInput for a name that is not
    there, and NoAnswer where hardly any design goes together.
    """
    known = file_dimensions(mechanism)
    for name in names:
        find_dimension(known, name)
    none = np.full(len(names), np.inf)
    low, high = -none if lower is None else np.asarray(lower), none if upper is None else np.asarray(upper)
    bounds = {name: (float(one), float(other)) for name, one, other in zip(names, low, high, strict=True)}
    own = {point: free_point_names(mechanism, point) for point in points}
    free = {point: each for point, each in own.items() if each is not None and {*each} <= {*names}}
    bare = bare_mechanism(mechanism, [point for point in points if point not in free])
    held = {name for each in free.values() for name in each}
    bare_names = file_dimensions(bare)
    swept_names = [name for name in names if name not in held and name in bare_names]
    ends = np.array([bounds[name] for name in swept_names]).reshape(-1, 2)
    asked = [pair for pair in dict.fromkeys(pairs) if pair != mechanism.inputs[0].pair] if mechanism.inputs else []
    swept = swept_catalogue(
        bare, swept_names, ends[:, 0], ends[:, 1], pairs=asked, size=size, seed=seed, progress=progress
    )
    values = dict(zip(swept_names, swept.numbers.T, strict=True))
    carried = {point: carried_point(mechanism, point, values, len(swept), bounds) for point in points}
    curves = {point: curve_index(swept, each) for point, each in carried.items()}
    return MatchCatalogue(mechanism, tuple(names), swept, carried, curves)
