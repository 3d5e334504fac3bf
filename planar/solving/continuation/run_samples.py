"""The rows of a run: unknowns, inputs and rates at its samples, and what was met on the way to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.solving.prepared_mechanism import PreparedMechanism

if TYPE_CHECKING:
    from planar.solving.continuation.predictor_corrector import NearbyBifurcation, PassedBifurcation

FILM_BACKWARDS = np.array([1.0, -1.0, 1.0])
"""Signs of position, velocity and acceleration in a film that runs backwards."""


class InputRates(NamedTuple):
    """Positions of the inputs over a run, with their first, second and third rates, each (samples, inputs)."""

    u: Array
    u1: Array
    u2: Array
    u3: Array

    def select(self, rows: IntArray | slice) -> InputRates:
        """The rows with these numbers."""
        return InputRates(*(rate[rows] for rate in self))


def resting_inputs(u: Array) -> InputRates:
    """Inputs at positions (samples, inputs) without rates."""
    rest = np.zeros_like(u)
    return InputRates(u, rest, rest, rest)


class BranchRates(NamedTuple):
    """Rates where a slope is singular: first, second and third derivative of the unknowns (3, unknowns) by the distance
    of the inputs along a direction; and how much rank the Jacobian lacks at the change point."""

    rates: Array
    input_direction: Array
    rank_loss: int


class RunSamples(NamedTuple):
    """The rows of a run as far as it comes.

    `z`: unknowns (rows, unknowns). `coordinate_rates`: coordinates with their rates (rows, 3, coordinates) at the rows
    that are surely sound, which `is_sure` says (rows,); `residual` is what the worst constraint leaves open at those.
    `dead_points` are rows, `branch_rates` the rates at rows where the Jacobian is singular. `passed` are the change
    points on the way, `nearby` those of neighbouring linkages. A run that does not come to its end has `stopped`, with
    the last unknowns and inputs before that where they are known. `reason` says why its range ends.
    """

    z: Array
    inputs: InputRates
    coordinate_rates: Array
    is_sure: BoolArray
    residual: float = 0.0
    dead_points: tuple[int, ...] = ()
    branch_rates: Mapping[int, BranchRates] = MappingProxyType({})
    passed: tuple[PassedBifurcation, ...] = ()
    nearby: tuple[NearbyBifurcation, ...] = ()
    stopped: NoAnswer | None = None
    last_position: tuple[Array, Array] | None = None
    reason: str = ""

    @property
    def outcome(self) -> Outcome:
        """Whether the run came to its end, or why not."""
        return Outcome.SOLVED if self.stopped is None else self.stopped.outcome

    def select(self, rows: IntArray) -> RunSamples:
        """The rows with these numbers, in this order."""
        numbers = rows.tolist()
        return self._replace(
            z=self.z[rows],
            inputs=self.inputs.select(rows),
            coordinate_rates=self.coordinate_rates[rows],
            is_sure=self.is_sure[rows],
            dead_points=tuple(k for k, row in enumerate(numbers) if row in self.dead_points),
            branch_rates={k: self.branch_rates[row] for k, row in enumerate(numbers) if row in self.branch_rates},
        )

    def from_row(self, first: int) -> RunSamples:
        """The rows from one on."""
        return self.select(np.arange(first, len(self.z)))

    def reversed(self) -> RunSamples:
        """The same run backwards: velocities turn round, accelerations stay, as in a film run backwards."""
        run = self.select(np.arange(len(self.z))[::-1])
        u, u1, u2, u3 = run.inputs
        return run._replace(
            inputs=InputRates(u, -u1, u2, -u3), coordinate_rates=run.coordinate_rates * FILM_BACKWARDS[:, None]
        )

    def with_last_row(self, z: Array, inputs: InputRates, is_dead_point: bool) -> RunSamples:
        """The rows with one more at the end, of unknowns z (unknowns,)."""
        last = RunSamples(z[None], inputs, np.zeros((1, *self.coordinate_rates.shape[1:])), np.zeros(1, dtype=bool))
        dead_points = (0,) if is_dead_point else ()
        return join_runs([self, last._replace(dead_points=dead_points, stopped=self.stopped)])


def unjudged_rows(setup: PreparedMechanism, z: Array, inputs: InputRates) -> RunSamples:
    """Rows of unknowns (rows, unknowns) of which nothing is known to be sound."""
    count = len(z)
    return RunSamples(z, inputs, np.zeros((count, 3, len(setup.scale))), np.zeros(count, dtype=bool))


def join_runs(parts: Sequence[RunSamples]) -> RunSamples:
    """The rows of runs one after the other; it ends as the last of them does."""
    first_rows = np.cumsum([0, *(len(part.z) for part in parts)]).tolist()
    numbered = list(zip(first_rows, parts, strict=False))
    return parts[-1]._replace(
        z=np.vstack([part.z for part in parts]),
        inputs=InputRates(*(np.vstack(rates) for rates in zip(*(part.inputs for part in parts), strict=True))),
        coordinate_rates=np.concatenate([part.coordinate_rates for part in parts]),
        is_sure=np.concatenate([part.is_sure for part in parts]),
        residual=max(part.residual for part in parts),
        dead_points=tuple(first + row for first, part in numbered for row in part.dead_points),
        branch_rates={first + row: rates for first, part in numbered for row, rates in part.branch_rates.items()},
        passed=tuple(chain.from_iterable(part.passed for part in parts)),
        nearby=tuple(chain.from_iterable(part.nearby for part in parts)),
        reason=next((part.reason for part in parts if part.reason), ""),
    )
