"""The result of a sweep: arrays over designs and positions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.errors import Outcome
from planar.foundation.short_repr import short_repr
from planar.model.wording import count_phrase

Array = np.ndarray

LACKING_RATES = "rates are missing or have few digits"


class SweepNotes(NamedTuple):
    """What there is to say of a sweep of so many designs: how many designs the general path was given, and positions it
    solved; by outcome its code, how many designs ended so, and what is said of the first, which as text is a sentence;
    and how many of its blocks were not whole in a store.
    """

    design_count: int
    general_designs: int
    general_positions: int
    endings: tuple[tuple[int, int, Any], ...]
    block_count: int
    damaged_blocks: int

    def sentences(self) -> tuple[str, ...]:
        """The sentences; those of designs are made here, which may take each about as long as a motion."""
        many, outcomes, found = self.design_count, list(Outcome), []
        if self.general_designs:
            told = f"{self.general_designs} of {many} designs went to the general path"
            found.append(f"{told}, which solved {self.general_positions} positions")
        found += [
            f"{count} of {many} designs: {outcomes[code] if code else LACKING_RATES} (the first: {first})"
            for code, count, first in self.endings
        ]
        if self.damaged_blocks:
            which = f"{self.damaged_blocks} of {count_phrase(self.block_count, 'block')} in the store"
            found.append(f"{which} {'was' if self.damaged_blocks == 1 else 'were'} not whole, and solved again")
        return tuple(found)


def add_ending_counts(blocks: Iterable[Iterable[tuple[int, int, Any]]]) -> dict[int, tuple[int, Any]]:
    """By the code of each outcome how many designs of all blocks ended so, and what is said of the first."""
    totals: dict[int, tuple[int, Any]] = {}
    for code, count, sentence in chain.from_iterable(blocks):
        previous, first = totals.get(code, (0, sentence))
        totals[code] = previous + count, first
    return totals


@dataclass(frozen=True)
class Sweep:
    """Every design at every step: SI, arrays with an entry for each design first.

    `position`, `velocity` and `acceleration` map the points' names to arrays (designs, steps + 1, 2); the two latter
    are None where no rates were asked for. NaN where a position is refused; rates also on a dead point itself, where
    none is determined. Written to a store they are read when they are indexed, which raises BadInput where a block of
    it is missing or damaged. `status` (designs, steps + 1): 0 is solved, any other number k is `outcomes[k]`. `input`:
    positions of the input that runs, (steps + 1,), or (designs, steps + 1) where they differ; of a run in time the
    times (s). `general`: how many positions the general path solved, one design after the other. `dead_point`
    (designs,): where the input is at the dead point at which a design's motion ends (rad or m), NaN where none does;
    `stop_position` (designs,): where it is as a pair meets the stop that ends the motion.

    What was asked for beside points stands by the names of links, pairs and inputs in arrays (designs, steps + 1), and
    is empty where nothing was: `angle`, `angular_velocity` and `angular_acceleration` of links (rad, s) as
    `Motion.link` has them; `value` of pairs, the relative angle (rad) or how far a slide is (m), with `value_rate` and
    `value_second_rate` (per s, per s^2), as `Motion.pair` has them; `transmission_angle` of outputs (rad), as of
    `planar.transmission`; `effort` of inputs (N m or N), `reaction` of pairs, the force on the second link by the first
    (designs, steps + 1, 2) (N), and `reaction_couple` (N m), as of `planar.forces` with inertia. NaN as of points;
    forces also where equilibrium does not tell them.

    `derivatives` of what was asked for in numbers of the file, by names as `position of E by BC.length` (of points
    (designs, steps + 1, 2)), `angular_velocity of BC by AB.length`, `value of stroke by A.position`: SI per SI. In the
    position of an input they are those in where it is at a step. NaN at dead points and change points, and in numbers
    that cannot change alone.

    Where all assemblies were asked for each stands as a design of its own: `design` is the number (from 0) of the one
    that was given, and `assembly` that of the assembly in the list of `planar.modes` (from 1; 0 of a design that has
    none), each (designs,).
    """

    points: tuple[str, ...]
    designs: Mapping[str, Array]
    position: Mapping[str, Any]
    velocity: Mapping[str, Any] | None
    acceleration: Mapping[str, Any] | None
    status: Any
    input: Array
    general: int
    dead_point: Any
    stop_position: Any
    notes: SweepNotes = field(repr=False)
    outcomes: tuple[Outcome, ...] = tuple(Outcome)
    angle: Mapping[str, Any] = field(default_factory=dict, repr=False)
    angular_velocity: Mapping[str, Any] = field(default_factory=dict, repr=False)
    angular_acceleration: Mapping[str, Any] = field(default_factory=dict, repr=False)
    value: Mapping[str, Any] = field(default_factory=dict, repr=False)
    value_rate: Mapping[str, Any] = field(default_factory=dict, repr=False)
    value_second_rate: Mapping[str, Any] = field(default_factory=dict, repr=False)
    transmission_angle: Mapping[str, Any] = field(default_factory=dict, repr=False)
    effort: Mapping[str, Any] = field(default_factory=dict, repr=False)
    reaction: Mapping[str, Any] = field(default_factory=dict, repr=False)
    reaction_couple: Mapping[str, Any] = field(default_factory=dict, repr=False)
    derivatives: Mapping[str, Any] = field(default_factory=dict, repr=False)
    design: Array | None = field(default=None, repr=False)
    assembly: Array | None = field(default=None, repr=False)

    __repr__ = short_repr

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """What there is to say; made when it is first read."""
        return self.notes.sentences()

    def __len__(self) -> int:
        """How many designs there are."""
        return len(self.status)

    @property
    def whole(self) -> Array:
        """The designs (designs,) that were solved at every step."""
        found: Array = np.all(np.asarray(self.status[:]) == 0, axis=1)
        return found
