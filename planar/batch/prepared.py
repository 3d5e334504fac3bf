"""Results of a run that are made when they are read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict

import numpy as np

from planar.batch.design_arrays import design_variables
from planar.batch.gradients.run_gradients import RunGradient, RunWeights, read_names, read_weights
from planar.batch.prepare.compiled_runs import ALL_SOLVED, STATUS_OF_ENDING
from planar.batch.prepare.stages import prepare_point_runs
from planar.batch.reference_design import reference_design
from planar.batch.results import Sweep
from planar.batch.sweep import check_range, sweep
from planar.document.first_argument import takes_mechanism
from planar.foundation.errors import BadInput
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism

if TYPE_CHECKING:
    from planar.batch.gradients.run_gradients import RunGradients

Array = np.ndarray


class KeptPoints(Mapping[str, Array]):
    """Points by name, each (positions, 2), of one order of a run's rows (rows, positions)."""

    __slots__ = ("_first", "_index", "_rows")

    def __init__(self, rows: Array, index: Mapping[str, int], first: int):
        """`index`: the row of each point's x beside the order's `first` row."""
        self._rows, self._index, self._first = rows, index, first

    def __getitem__(self, name: str) -> Array:
        row = self._first + self._index[name]
        return self._rows[row : row + 2].T

    def __iter__(self) -> Iterator[str]:
        return iter(self._index)

    def __len__(self) -> int:
        return len(self._index)

    def __repr__(self) -> str:
        return repr(dict(self))


class LateSentences(Sequence[str]):
    """Sentences as a tuple, made once they are read."""

    __slots__ = ("_make", "_sentences")

    def __init__(self, make: Callable[[], Sequence[str]]):
        self._make = make
        self._sentences: tuple[str, ...] | None = None

    def _all(self) -> tuple[str, ...]:
        if self._sentences is None:
            self._sentences = tuple(self._make())
        return self._sentences

    def __getitem__(self, index: Any) -> Any:
        return self._all()[index]

    def __len__(self) -> int:
        return len(self._all())

    def __eq__(self, other: object) -> bool:
        return self._all() == (other._all() if isinstance(other, LateSentences) else other)

    def __hash__(self) -> int:
        return hash(self._all())

    def __repr__(self) -> str:
        return repr(self._all())

    def __reduce__(self) -> tuple[Any, ...]:
        return tuple, (self._all(),)


NO_REMARKS: Sequence[str] = ()


class PreparedRun(NamedTuple):
    """A run: of every point position, velocity and acceleration (m, s), each (steps + 1, 2), the two latter None where
    no rates were asked for; status (steps + 1,): 0 is solved, any other number k is `Sweep.outcomes[k]`;
    `remarks` say why.
    """

    position: Mapping[str, Array]
    velocity: Mapping[str, Array] | None
    acceleration: Mapping[str, Array] | None
    status: Array
    remarks: Sequence[str] = ()

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
    With llvmlite a run takes some microseconds, of whatever design, also of one that cannot be assembled, comes to a
    dead point or meets a stop; what the compiled code is not sure of goes through `planar.sweep`.

    >>> import planar
    >>> planar.prepared(planar.load("four-bar"), 12, "C")
    <PreparedSweep of 'Four-bar chain': 13 positions of C>
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
        own = float(self.reference.mechanism.inputs[self.reference.running_index].position)
        begin = own if start is None else float(start)
        self.input = begin + (2.0 * np.pi if stop is None else stop - begin) * np.linspace(0.0, 1.0, steps + 1)
        # a slide without a stop runs in each design between limits of its own
        is_alike = not (self.reference.is_sliding and stop is None)
        may_shift = start is None and stop is None
        self._runs = prepare_point_runs(self.reference, self.points, rates, self.input, may_shift) if is_alike else None
        self._index = {name: 2 * k for k, name in enumerate(self.points)}
        self._solved_status = np.zeros(steps + 1, dtype=np.int8)
        self._solved_status.flags.writeable = False

    def __reduce__(self) -> tuple[Any, ...]:
        # compiled code stays in its process: another one prepares it again
        ends = (self.range["start"], self.range["stop"], self.range["pair"])
        return PreparedSweep, (self.mechanism, self.steps, self.points, self.rates, *ends)

    def __repr__(self) -> str:
        return f"<PreparedSweep of {self.mechanism.name!r}: {self.steps + 1} positions of {', '.join(self.points)}>"

    def __call__(self, values: Mapping[str, float] | None = None) -> PreparedRun:
        """The run of one design. Raises BadInput for a name that is not there."""
        values = self._read_values(values)
        results = None if self._runs is None else self._runs(values)
        if results is None:
            return self._run_as_sweep(values)
        rows, ending, end = results
        status, remarks = self._solved_status, NO_REMARKS
        if ending != ALL_SOLVED:
            rows[:, end:] = np.nan
            status = np.zeros(len(self._solved_status), dtype=np.int8)
            status[end:] = STATUS_OF_ENDING[ending]
            design = dict(values)
            remarks = LateSentences(lambda: self._run_as_sweep(design).remarks)
        position, count = KeptPoints(rows, self._index, 0), 2 * len(self.points)
        if not self.rates:
            return PreparedRun(position, None, None, status, remarks)
        orders = KeptPoints(rows, self._index, count), KeptPoints(rows, self._index, 2 * count)
        return PreparedRun(position, *orders, status, remarks)

    def gradient(
        self, weights: RunWeights, values: Mapping[str, float] | None = None, *, of: Sequence[str] | str | None = None
    ) -> RunGradient:
        """The derivatives of a weighed sum over the run of one design, in all numbers of the file at once (SI).

        `weights`: by what the run tells, and the points, an array (steps + 1, 2) each, as `{"position": {"C": ...}}`;
        "velocity" and "acceleration" where it has rates. `values` as in a call; `of` names the numbers by which
        derivatives are wanted, all where it is left out. Names and numbers are those of `planar.gradient` of the same
        motion: the position of the running input moves the whole run, what inputs that stand still say of their rates
        does nothing, and numbers that cannot change alone are NaN.

        A position that is not solved, or that has no derivatives, as a dead point, brings nothing; `status` says so.

        Raises BadInput for weights or names that do not fit, and for a structure of which derivatives are not told.

        >>> import numpy as np
        >>> import planar
        >>> run = planar.prepared("four-bar", 12, "C", start=0.5, stop=1.0)
        >>> found = run.gradient({"position": {"C": np.eye(13, 2)}}, {"BC.length": 0.066}, of="BC.length")
        >>> round(found.derivatives["BC.length"], 3)
        1.131
        """
        values = self._read_values(values)
        gradients = self.run_gradients
        names = gradients.names if of is None else read_names(of, gradients.names)
        value, slopes, status = gradients.gradient(
            read_weights(weights, self._index, self.rates, self.steps + 1), values
        )
        every = dict(zip(gradients.names, slopes, strict=True))
        return RunGradient(value, every if of is None else {name: every[name] for name in names}, status)

    @property
    def derivative_values(self) -> dict[str, float | None]:
        """The numbers in which `gradient` has derivatives, as the file has them (SI); None those that cannot change
        alone. Raises BadInput where derivatives are not told of the structure."""
        known = design_variables(self.mechanism)
        bound = self.run_gradients.bound
        return {
            name: None if name in bound else known[name].value for name in self.run_gradients.names if name in known
        }

    @cached_property
    def run_gradients(self) -> RunGradients:
        """What `gradient` asks. Raises BadInput where derivatives are not told of the structure."""
        from planar.batch.gradients.run_gradients import RunGradients  # derivatives are seldom wanted

        span = self.range["start"], self.range["stop"]
        return RunGradients(self.reference, self.points, self.rates, self.input, span)

    @staticmethod
    def _read_values(values: Mapping[str, float] | None) -> Mapping[str, float]:
        values = {} if values is None else values
        for value in values.values():
            if type(value) is not float:
                return {name: _check_number(name, value) for name, value in values.items()}
        return values

    def sweep(self, designs: Mapping[str, Any]) -> Sweep:
        """The same of many designs at once, as `planar.sweep` has it."""
        return sweep(self.mechanism, designs, self.steps, self.points, rates=self.rates, **self.range)

    def _run_as_sweep(self, values: Mapping[str, float]) -> PreparedRun:
        """The same by a sweep of one design, which leaves nothing out."""
        given = values or {
            f"{self.reference.pair}.position": self.reference.mechanism.inputs[self.reference.running_index].position
        }
        found = self.sweep(given)
        return PreparedRun(
            _only_design(found.position),
            found.velocity and _only_design(found.velocity),
            found.acceleration and _only_design(found.acceleration),
            np.asarray(found.status)[0],
            LateSentences(lambda: found.remarks),
        )


def _only_design(order: Mapping[str, Any]) -> dict[str, Array]:
    return {name: np.asarray(array[0]) for name, array in order.items()}


def _check_number(name: str, value: float) -> float:
    if np.ndim(value) != 0:
        raise BadInput(str(name), "one number is wanted; many designs at once are a sweep")
    return value
