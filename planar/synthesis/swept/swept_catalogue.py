"""A catalogue: random designs of one mechanism with the motions of all their links, swept once and kept on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from math import pi

import numpy as np

from planar.batch.reference_design import reference_design
from planar.document.writer import write_mechanism
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism, named_points
from planar.model.wording import count_phrase
from planar.synthesis.swept.array_store import catalogue_key, keep_arrays, kept_arrays
from planar.synthesis.swept.bare_mechanism import length_scale
from planar.synthesis.swept.design_motions import DesignMotions, MotionSweeps, join_motions
from planar.synthesis.swept.number_draws import NumberDraws

VERSION = 1
"""Of how catalogues are drawn and written: other versions are made anew."""
SIZE, SAMPLES = 20_000, 72
"""Designs of a catalogue, and positions of a motion."""
LEAST_SAMPLES = 6
"""Positions of a design at least: less is no arc."""
PARTIAL_SHARE = 0.35
"""Of the designs at most, where there are enough others: motions that do not close."""
ROUNDS, ROUND_SHARE = 32, 2.0
"""How often designs are drawn at most, and how many at once, of the size."""
NEAR_SHARES = {True: 0.5, False: 0.9}
"""Of the draws: near to designs that go together; where a structure has a closed form, so that others cost little, and
where it has none."""
MOST_TURNS = 6
"""Of the input, after which a motion closes that is looked for."""
SKETCH_SPREAD = 1.5
"""Of the scale: how far random sketches reach, from which designs are put together in other ways."""
GOLDEN_ANGLE = pi * (3.0 - 5.0**0.5)


@dataclass(frozen=True, eq=False)
class SweptCatalogue:
    """Designs of a `mechanism` by `numbers` (designs, names), SI, with the motions of its moving `links`.

    The same for the same seed. Designs whose motion ends are there as far as it goes.
    """

    mechanism: Mechanism
    names: tuple[str, ...]
    numbers: Array
    links: tuple[str, ...]
    motions: DesignMotions = field(repr=False)
    key: str = field(repr=False)
    "the fingerprint of what it follows from"

    __repr__ = short_repr

    def __len__(self) -> int:
        """How many designs there are."""
        return len(self.numbers)

    @property
    def sample_count(self) -> int:
        """Positions of a whole motion."""
        return int(self.motions.angles.shape[2])


def swept_catalogue(  # many: each says what it holds
    mechanism: Mechanism,
    names: Sequence[str],
    lower: Array | None = None,
    upper: Array | None = None,
    *,
    pairs: Sequence[str] = (),
    size: int = SIZE,
    seed: int = 0,
    samples: int = SAMPLES,
    progress: Callable[[int, int], object] | None = None,
) -> SweptCatalogue:
    """The catalogue of a bare mechanism in the numbers `names`, from disk where it has been made before.

    `lower` and `upper` (names,) are bounds (SI), infinite where there is none. Of `pairs` relative motions are kept,
    too. `progress` is called with how many designs there are and are wanted. Raises BadInput where the mechanism has
    no input, and NoAnswer where hardly any design goes together.
    """
    none = np.full(len(names), np.inf)
    low, high = -none if lower is None else np.asarray(lower), none if upper is None else np.asarray(upper)
    key = catalogue_key(
        VERSION,
        write_mechanism(mechanism),
        list(names),
        low,
        high,
        list(pairs),
        size,
        seed,
        samples,
        length_scale(mechanism),
    )
    links = tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
    kept = kept_arrays(key)
    if kept is None:
        build = _CatalogueBuild(mechanism, names, low, high, MotionSweeps(mechanism, samples, pairs))
        numbers, motions = build.run(size, seed, progress)
        own = {name: each for name, each in motions._asdict().items() if name != "values"}
        kept = {"numbers": numbers, **own, **{f"value of {pair}": each for pair, each in motions.values.items()}}
        keep_arrays(key, kept)
    own = {name: kept[name] for name in DesignMotions._fields if name != "values"}
    values = {pair: kept[f"value of {pair}"] for pair in pairs}
    return SweptCatalogue(mechanism, tuple(names), kept["numbers"], links, DesignMotions(**own, values=values), key)


class _CatalogueBuild:
    """Draws designs in rounds, each put together at another position and from another sketch."""

    def __init__(self, mechanism: Mechanism, names: Sequence[str], lower: Array, upper: Array, sweeps: MotionSweeps):
        self.mechanism, self.names, self.sweeps = mechanism, names, sweeps
        self.draws = NumberDraws(mechanism, names, lower, upper)
        functions = reference_design(mechanism, None).functions
        blocks = functions.equations.blocks
        self.near_share = NEAR_SHARES[all(functions.block_assemblies(each) is not None for each in blocks)]
        self.joints = [each.name for each in named_points(mechanism) if self._is_moving_joint(each.members)]
        self.pool = np.clip(self.draws.start, lower, upper)[None]
        self.has_closed = False

    def _is_moving_joint(self, members: Sequence[tuple[str, str]]) -> bool:
        return len(members) > 1 and self.mechanism.frame not in dict(members)

    def run(self, size: int, seed: int, progress: Callable[[int, int], object] | None) -> tuple[Array, DesignMotions]:
        """Numbers (designs, names) and motions."""
        random = np.random.default_rng([seed, size])
        self.sweeps.turns = self.sweeps.closing_turns(MOST_TURNS)
        found: list[tuple[Array, DesignMotions]] = []
        closed = partial = 0
        for numbers, motions in self._rounds(size, random):
            kept = self._choose(motions, size - closed - partial, int(PARTIAL_SHARE * size) - partial)
            found.append((numbers[kept], motions.select(kept)))
            closed += int(motions.is_closed[kept].sum())
            partial += int((~motions.is_closed[kept]).sum())
            self._remember(numbers, motions)
            if progress is not None:
                progress(closed + partial, size)
            if closed + partial >= size:
                break
        if not closed + partial:
            told = f"of {count_phrase(ROUNDS, 'round')} of random designs of {self.mechanism.name!r} none goes together"
            raise NoAnswer(Outcome.CANNOT_BE_ASSEMBLED, f"{told}; give bounds about numbers with which it does")
        return np.concatenate([each for each, _ in found]), join_motions([each for _, each in found])

    def _rounds(self, size: int, random: np.random.Generator) -> Iterator[tuple[Array, DesignMotions]]:
        """The numbers and motions of designs that are drawn at once; first those about the file's own position."""
        count = max(16, int(ROUND_SHARE * size) // 4)
        given = float(self.mechanism.inputs[0].position)
        middle = 0j
        for turn in range(ROUNDS):
            near = int(self.near_share * count)
            parents = self.pool[random.integers(len(self.pool), size=near)]
            numbers = np.concatenate(
                [self.draws.draw_wide(count - near, random), self.draws.draw_near(parents, random)]
            )
            sketch = None
            start = given
            if turn == 0:
                numbers[0] = self.pool[0]
            elif self.joints:
                at = random.normal(size=(len(self.joints), 2)) * SKETCH_SPREAD * self.draws.scale
                own = [middle + complex(*each) for each in at]
                sketch = dict(zip(self.joints, own, strict=True)) if turn % 2 else None
            if not self.sweeps.is_sliding:
                start = given + turn * GOLDEN_ANGLE
            elif turn:
                start = given * float(np.exp(random.normal(scale=0.4)))
            yield numbers, self.sweeps.run(self.names, numbers, start, sketch)

    def _choose(self, motions: DesignMotions, left: int, partial_left: int) -> IntArray:
        """The designs to keep, at most so many, and of those that do not close."""
        is_enough = motions.sample_count >= LEAST_SAMPLES
        closed = np.flatnonzero(motions.is_closed)[: max(left, 0)]
        room = left - len(closed)
        may: BoolArray = is_enough & ~motions.is_closed
        partial = np.flatnonzero(may)[: max(0, min(room, max(partial_left, 0)))]
        if not self.has_closed and not len(closed):  # as of slides: none will
            partial = np.flatnonzero(may)[: max(left, 0)]
        return np.concatenate([closed, partial])

    def _remember(self, numbers: Array, motions: DesignMotions) -> None:
        """Keep designs about which others are to be drawn: such as close, as long as there are any."""
        closed = motions.is_closed
        if closed.any() and not self.has_closed:
            self.has_closed, self.pool = True, self.pool[:0]
        self.pool = np.concatenate(
            [self.pool, numbers[closed if self.has_closed else motions.sample_count >= LEAST_SAMPLES]]
        )
