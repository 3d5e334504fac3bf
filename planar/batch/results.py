"""The result of a sweep: arrays over designs and positions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planar.foundation.errors import Outcome
from planar.foundation.short_repr import short_repr

Array = np.ndarray


@dataclass(frozen=True)
class Sweep:
    """Every design at every step: SI, arrays with an entry for each design first.

    `position`, `velocity` and `acceleration` map the points' names to arrays (designs, steps + 1, 2); the two latter
    are None where no rates were asked for. NaN where a position is refused; rates also on a dead point itself, where
    none is determined. Written to a store they are read when they are indexed, which raises BadInput where a block of
    it is missing or damaged. `status` (designs, steps + 1): 0 is solved, any other number k is `outcomes[k]`. `input`:
    positions of the input that runs, (steps + 1,), or (designs, steps + 1) where they differ; of a run in time the
    times (s). `general`: how many positions the general path solved, one design after the other. `said`: what there is
    to say.

    What was asked for beside points stands by the names of links, pairs and inputs in arrays (designs, steps + 1), and
    is empty where nothing was: `angle`, `angular_velocity` and `angular_acceleration` of links (rad, s) as
    `Motion.link` has them; `value` of pairs, the relative angle (rad) or how far a slide is (m), with `value_rate` and
    `value_second_rate` (per s, per s^2), as `Motion.pair` has them; `transmission_angle` of outputs (rad), as of
    `planar.transmission`; `effort` of inputs (N m or N), `reaction` of pairs, the force on the second link by the first
    (designs, steps + 1, 2) (N), and `reaction_couple` (N m), as of `planar.forces` with inertia. NaN as of points;
    forces also where equilibrium does not tell them. `limit` of the running input: the dead point (rad or m) at which a
    design's run ends, the same at every step, NaN where it comes to its end.

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
    said: tuple[str, ...]
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
    limit: Mapping[str, Any] = field(default_factory=dict, repr=False)
    design: Array | None = field(default=None, repr=False)
    assembly: Array | None = field(default=None, repr=False)

    __repr__ = short_repr

    def __len__(self) -> int:
        """How many designs there are."""
        return len(self.status)

    @property
    def whole(self) -> Array:
        """The designs (designs,) that were solved at every step."""
        found: Array = np.all(np.asarray(self.status[:]) == 0, axis=1)
        return found
