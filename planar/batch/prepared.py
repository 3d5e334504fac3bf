"""`planar.prepared`: one linkage made ready to be run again and again with other dimensions, as an optimiser does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from threading import Lock
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict

import numpy as np

from planar.batch.design_arrays import read_designs, with_design_values
from planar.batch.initial_assembly import find_assemblies
from planar.batch.march.choice import find_runner
from planar.batch.march.prediction import LONGEST_STEP
from planar.batch.reference_design import reference_design
from planar.batch.sweep import check_range, sweep
from planar.document.first_argument import takes_mechanism
from planar.foundation.errors import BadInput
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import LARGEST_INPUT_POSITION, Mechanism

if TYPE_CHECKING:
    from planar.batch.march.llvm_positions import PositionsKernel

Array = np.ndarray


class PreparedRun(NamedTuple):
    """A run: of every point position, velocity and acceleration (m, s), each (steps + 1, 2), the two latter None where
    no rates were asked for; status (steps + 1,): 0 is solved, any other number k is `Sweep.outcomes[k]`; what is said.
    """

    position: Mapping[str, Array]
    velocity: Mapping[str, Array] | None
    acceleration: Mapping[str, Array] | None
    status: Array
    said: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return short_repr(self)


class RangeArguments(TypedDict):
    """Where the running input starts and stops (rad or m; None: by itself), and its pair."""

    start: float | None
    stop: float | None
    pair: str | None


@takes_mechanism
def prepared(
    mechanism: Mechanism,
    steps: int = 360,
    points: Sequence[str] | str | None = None,
    *,
    rates: bool = True,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
) -> PreparedSweep:
    """A mechanism made ready to be run over and over; calling what is returned solves it for one design after another.

    See `planar.sweep` for what is taken, and raised: this is a sweep of one design at a time, without its preparations.
    With llvmlite, and where every block of the mechanism is in closed form, a run of the same design again takes some
    microseconds; anything else goes through `planar.sweep` each time.
    """
    return PreparedSweep(mechanism, steps, points, rates, start, stop, pair)


class PreparedSweep:
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
        self.mechanism = check_range(mechanism, steps, start, stop, pair)
        self.reference = reference_design(self.mechanism, pair)
        self.steps, self.rates = steps, rates
        self.range: RangeArguments = {"start": start, "stop": stop, "pair": pair}
        self.points = self.reference.select_points(points)
        self.members = {name: self.reference.point_member(name) for name in self.points}
        own = float(self.reference.mechanism.inputs[self.reference.running_index].position)
        self.start_position = own if start is None else float(start)
        self.input = self.start_position + (2.0 * np.pi if stop is None else stop - self.start_position) * np.linspace(
            0.0, 1.0, steps + 1
        )
        self.kernel = (
            self._compile_kernel()
            if self.start_position == own and not (self.reference.is_sliding and stop is None)
            else None
        )
        self.current_design: dict[str, float] | None = None
        self.kernel_numbers = np.zeros(0)
        self.tolerance = 0.0
        self.solved_status = np.zeros(steps + 1, dtype=np.int8)
        self.solved_status.flags.writeable = False
        self.lock = Lock()

    def __reduce__(self) -> tuple[Any, ...]:
        # compiled code stays in its process: another one prepares it again
        ends = (self.range["start"], self.range["stop"], self.range["pair"])
        return PreparedSweep, (self.mechanism, self.steps, self.points, self.rates, *ends)

    def __repr__(self) -> str:
        return f"<PreparedSweep of {self.mechanism.name!r}: {self.steps + 1} positions of {', '.join(self.points)}>"

    def _compile_kernel(self) -> PositionsKernel | None:
        """The compiled function; None where there is none for this structure."""
        base_, frame = self.reference, self.reference.mechanism.frame
        if any(link == frame for link, _ in self.members.values()) or not base_.can_run_backend:
            return None
        try:
            from planar.batch.march.kernel import kernel_equations
            from planar.batch.march.llvm_positions import PositionsKernel
            from planar.codegen.instructions import UnsupportedOperation
            from planar.equations.mechanism_numbers import equation_structure
        except ImportError:
            return None
        u, _, _ = base_.inputs(base_.mechanism, 1)
        inputs = np.repeat(u.T, self.steps + 1, axis=0)
        inputs[:, base_.running_index] = self.input / float(base_.input_scale[base_.running_index])
        if np.max(np.abs(np.diff(inputs, axis=0))) > LONGEST_STEP or np.max(np.abs(inputs)) > LARGEST_INPUT_POSITION:
            return None
        try:
            self.kernel_equations = kernel_equations(base_.functions, equation_structure(base_.mechanism))
            return PositionsKernel(
                self.kernel_equations, tuple(link for link, _ in self.members.values()), self.rates, inputs
            )
        except UnsupportedOperation:
            return None

    def __call__(self, values: Mapping[str, float] | None = None) -> PreparedRun:
        """The run of one design. Raises BadInput for a name that is not there."""
        values = {name: _check_number(name, value) for name, value in (values or {}).items()}
        found = None
        if self.kernel is not None:
            with self.lock:  # what is known of a design is kept from call to call
                if values == self.current_design or self._set_design(self.kernel, values):
                    found = self.kernel(self.kernel_numbers, self.tolerance, self.reference.unit)
        if found is None or not found[1]:
            return self._run_as_sweep(values)
        out, _ = found
        turned, many = out.T, len(self.points)
        orders = [
            {name: turned[:, 2 * (k * many + n) : 2 * (k * many + n) + 2] for n, name in enumerate(self.points)}
            for k in range(3 if self.rates else 1)
        ]
        velocity, acceleration = orders[1:] if self.rates else (None, None)
        return PreparedRun(orders[0], velocity, acceleration, self.solved_status)

    def _set_design(self, kernel: PositionsKernel, values: dict[str, float]) -> bool:
        """Take over a design's numbers; whether its assembly is surely the one nearest to the sketch."""
        base_ = self.reference
        arrays = read_designs(self.mechanism, values) if values else {}
        design = with_design_values(base_.mechanism, arrays)
        shapes = base_.shapes(design)
        p, inputs = base_.pair_numbers(shapes, 1, design), base_.inputs(design, 1)
        batch = base_.design_batch(shapes, p, inputs, self.members.values())
        self.tolerance, self.current_design = batch.tolerance, None
        given = [each.position for each in design.inputs]
        if any(
            float(np.ravel(each)[0]) != own.position for each, own in zip(given, base_.mechanism.inputs, strict=True)
        ):
            return False
        if not base_.is_fit(arrays, shapes, p)[0]:
            return False
        start = find_assemblies(base_, shapes, p, batch.u0, find_runner("native"))
        if not start.is_sure[0]:
            return False
        rows = {name: getattr(batch, name)[:, 0] for name in ("p", "q", "u1", "u2")}
        sign = self.kernel_equations.assembly_signs(start.z[:, 0], batch.u0[:, 0], rows["p"])
        self.kernel_numbers = kernel.pack_numbers(sign=sign, **rows)
        self.current_design = values
        return True

    def _run_as_sweep(self, values: dict[str, float]) -> PreparedRun:
        """The same by a sweep of one design, which leaves nothing out."""
        given = values or {
            f"{self.reference.pair}.position": self.reference.mechanism.inputs[self.reference.running_index].position
        }
        found = sweep(self.mechanism, given, self.steps, self.points, rates=self.rates, **self.range)
        return PreparedRun(
            _only_design(found.position),
            found.velocity and _only_design(found.velocity),
            found.acceleration and _only_design(found.acceleration),
            np.asarray(found.status)[0],
            found.said,
        )


def _only_design(order: Mapping[str, Any]) -> dict[str, Array]:
    return {name: np.asarray(array[0]) for name, array in order.items()}


def _check_number(name: str, value: float) -> float:
    if np.ndim(value) != 0:
        raise BadInput(str(name), "one number is wanted; many designs at once are a sweep")
    return value
