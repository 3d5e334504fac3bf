"""One linkage made ready to be run over and over, as an optimiser does, its dimensions changed from run to run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from threading import Lock
from typing import Any, NamedTuple

import numpy as np

from planar.batch.design_arrays import checked, lifted
from planar.batch.initial_assembly import assembled
from planar.batch.march.choice import closing
from planar.batch.reference_design import base
from planar.batch.sweep import range_checked, sweep
from planar.foundation.errors import BadInput
from planar.model.mechanism import Mechanism

Array = np.ndarray


class Ran(NamedTuple):
    """A run: of every point position, velocity and acceleration (m, s), each (steps + 1, 2), the two latter None where
    no rates were asked for; status (steps + 1,): 0 is solved, any other number k is `Sweep.outcomes[k]`; what is said.
    """

    position: Mapping[str, Array]
    velocity: Mapping[str, Array] | None
    acceleration: Mapping[str, Array] | None
    status: Array
    said: tuple[str, ...] = ()


def prepared(
    mechanism: Mechanism,
    steps: int = 360,
    points: Sequence[str] | str | None = None,
    *,
    rates: bool = True,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
) -> Prepared:
    """A mechanism made ready to be run over and over; calling what is returned solves it for one design after another.

    See `planar.sweep` for what is taken, and raised: this is a sweep of one design at a time, without its preparations.
    With llvmlite, and where every group of the mechanism is in closed form, a run of the same design again takes some
    microseconds; anything else goes through `planar.sweep` each time.
    """
    return Prepared(mechanism, steps, points, rates, start, stop, pair)


class Prepared:
    """A mechanism ready to run: calling it solves one design, `values` by name as in `planar.sweep`, a number each.

    May be called from several threads; what other processes are given is the mechanism.

    `input`: positions of the running input (steps + 1,), rad or m.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        steps: int,
        points: Sequence[str] | str | None,
        rates: bool,
        start: float | None,
        stop: float | None,
        pair: str | None,
    ):
        self.mechanism = range_checked(mechanism, steps, start, stop, pair)
        self.base = base(self.mechanism, pair)
        self.steps, self.rates = steps, rates
        self.range = {"start": start, "stop": stop, "pair": pair}
        self.points = self.base.wanted(points)
        self.members = {name: self.base.member(name) for name in self.points}
        own = float(self.base.mechanism.inputs[self.base.index].position)
        self.first = own if start is None else float(start)
        self.input = self.first + (2.0 * np.pi if stop is None else stop - self.first) * np.linspace(
            0.0, 1.0, steps + 1
        )
        self.turn = self._turn() if self.first == own and not (self.base.slides and stop is None) else None
        self.known: dict[str, float] | None = None
        self.numbers = np.zeros(0)
        self.tolerance = 0.0
        self.solved = np.zeros(steps + 1, dtype=np.int8)
        self.solved.flags.writeable = False
        self.lock = Lock()

    def _turn(self) -> Any:
        """The compiled function; None where there is none for this structure."""
        base_, frame = self.base, self.base.mechanism.frame
        if any(link == frame for link, _ in self.members.values()) or not base_.marched:
            return None
        try:
            from planar.batch.march.llvm_positions import Turn
            from planar.batch.march.llvm_runner import COARSEST, printed
            from planar.codegen.instructions import NotPrinted
            from planar.equations.functions import structure
        except ImportError:
            return None
        u, _, _ = base_.inputs(base_.mechanism, 1)
        inputs = np.repeat(u.T, self.steps + 1, axis=0)
        inputs[:, base_.index] = self.input / float(base_.scale[base_.index])
        if np.max(np.abs(np.diff(inputs, axis=0))) > COARSEST:
            return None
        try:
            self.printed = printed(base_.program, structure(base_.mechanism))
            return Turn(self.printed, tuple(link for link, _ in self.members.values()), self.rates, inputs)
        except NotPrinted:
            return None

    def __call__(self, values: Mapping[str, float] | None = None) -> Ran:
        """The run of one design. Raises BadInput for a name that is not there."""
        values = {name: _number(name, value) for name, value in (values or {}).items()}
        found = None
        if self.turn is not None:
            with self.lock:  # what is known of a design is kept from call to call
                if values == self.known or self._set(values):
                    found = self.turn(self.numbers, self.tolerance, self.base.unit)
        if found is None or not found[1]:
            return self._swept(values)
        out, _ = found
        turned, many = out.T, len(self.points)
        orders = [
            {name: turned[:, 2 * (k * many + n) : 2 * (k * many + n) + 2] for n, name in enumerate(self.points)}
            for k in range(3 if self.rates else 1)
        ]
        return Ran(orders[0], *(orders[1:] if self.rates else (None, None)), self.solved)

    def _set(self, values: dict[str, float]) -> bool:
        """Take over a design's numbers; whether its assembly is surely the one nearest to the sketch."""
        base_ = self.base
        arrays = checked(self.mechanism, values) if values else {}
        design = lifted(base_.mechanism, arrays)
        shapes = base_.shapes(design)
        p, (u, u1, u2) = base_.numbers(shapes, 1), base_.inputs(design, 1)
        self.tolerance, self.known = base_.tolerance(p), None
        given = [each.position for each in design.inputs]
        if any(
            float(np.ravel(each)[0]) != own.position for each, own in zip(given, base_.mechanism.inputs, strict=True)
        ):
            return False
        if not np.all(np.isfinite(p)) or base_.short(shapes, 1).any() or (arrays and base_.unfit(arrays, shapes).any()):
            return False
        start = assembled(base_, shapes, p, u, self.tolerance, closing("native"))
        if not start.sure[0]:
            return False
        q = [
            float(np.ravel(part)[0]) / base_.unit
            for link, point in self.members.values()
            for part in shapes[link].at(point)
        ]
        sign = self.printed.signs(start.z[:, 0], u[:, 0], p[:, 0])
        rates = {"u1": u1[:, 0], "u2": u2[:, 0]}
        self.numbers = self.turn.numbers(p=p[:, 0], q=np.array(q), sign=sign, **rates)
        self.known = values
        return True

    def _swept(self, values: dict[str, float]) -> Ran:
        """The same by a sweep of one design, which leaves nothing out."""
        given = values or {f"{self.base.pair}.position": self.base.mechanism.inputs[self.base.index].position}
        found = sweep(self.mechanism, given, self.steps, self.points, rates=self.rates, **self.range)
        orders = [
            order and {name: np.asarray(array[0]) for name, array in order.items()}
            for order in (found.position, found.velocity, found.acceleration)
        ]
        return Ran(*orders, np.asarray(found.status)[0], found.said)


def _number(name: str, value: Any) -> float:
    if np.ndim(value) != 0:
        raise BadInput(str(name), "one number is wanted; many designs at once are a sweep")
    return value
