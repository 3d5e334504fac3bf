"""Reductions of sweeps that keep no positions: measures of points and paths by name, functions of a block, results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import DTypeLike

from planar.batch.block import SolvedDesigns
from planar.batch.mechanisms.results import Each
from planar.batch.named_results.result_block import ResultBlock, solve_result_block
from planar.batch.named_results.result_rows import LINK_QUANTITIES, PAIR_QUANTITIES
from planar.batch.results import Sweep, SweepNotes
from planar.batch.stores.store import INTERRUPTED, BlockStore, MemoryStore, SweepPlan
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.errors import BadInput, Outcome, suggest_name
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import interrupted

HARMONICS = 8
"""Harmonics of a path of which there are descriptors."""
CLOSED_PATH_TOLERANCE = 1e-6
"""Of a path's extent, by which its end may lie beside its start."""


def extremes(values: Array) -> Array:
    """The least and the greatest (designs, 2) of values (designs, steps + 1), of those that are numbers."""
    return np.stack([np.fmin.reduce(values, axis=1), np.fmax.reduce(values, axis=1)], axis=1)


def path_length(path: Array) -> Array:
    """The length (designs,) of the polygon through the positions of paths (designs, steps + 1, 2)."""
    step = np.diff(path, axis=1)
    length: Array = np.hypot(step[..., 0], step[..., 1]).sum(axis=1)
    return length


def enclosed_area(path: Array) -> Array:
    """The signed area (designs,) within closed paths (designs, steps + 1, 2), as `planar.area` counts it.

    From the positions as they are: with x + iy = sum of c_n exp(i n theta), pi times the sum of n |c_n|^2.
    """
    c = _fourier_coefficients(path)
    n = np.fft.fftfreq(c.shape[1], 1.0 / c.shape[1])
    n[2 * np.abs(n) == c.shape[1]] = 0.0
    area: Array = np.pi * np.sum(n * (c.real**2 + c.imag**2), axis=1)
    return area


def fourier_descriptors(path: Array, harmonics: int = HARMONICS) -> ComplexArray:
    """Normalised Fourier descriptors (designs, 2 harmonics) of closed paths (designs, steps + 1, 2): complex numbers.

    Those of n = 1, -1, 2, -2, ... in x + iy = sum of c_n exp(i n theta), theta going on evenly from step to step, so
    scaled, turned and begun that the ellipse of n = 1 and -1 has its greater half-axis of length one along x, starts at
    its end, and is gone round anticlockwise; of the two ends the one at which c_2 has no negative real part. So equal
    curves have equal descriptors wherever they lie, however large they are, and wherever they begin (F. P. Kuhl,
    C. R. Giardina, Elliptic Fourier features of a closed contour, Comp. Graphics Image Proc. 18, 1982).
    """
    c = _fourier_coefficients(path)
    n = np.arange(1, harmonics + 1)
    ahead, back = c[:, n], c[:, -n]
    clockwise = (np.abs(ahead[:, 0]) < np.abs(back[:, 0]))[:, None]
    ahead, back = np.where(clockwise, back, ahead), np.where(clockwise, ahead, back)
    with np.errstate(all="ignore"):  # of a point at rest there is none
        first = ahead[:, :1]
        ahead, back = ahead / first, back / first
        begin = np.exp(0.5j * np.angle(back[:, :1]))
        ahead, back = ahead * begin ** (n - 1), back * begin ** (-n - 1)
        other = (ahead[:, 1:2].real < 0.0) if harmonics > 1 else np.zeros((len(c), 1), dtype=bool)
        ahead, back = np.where(other, ahead * (-1.0) ** (n - 1), ahead), np.where(other, back * (-1.0) ** (n + 1), back)
        return np.stack([ahead, back], axis=2).reshape(len(c), -1) / (1.0 + back[:, :1])


def _fourier_coefficients(path: Array) -> ComplexArray:
    """c_n (designs, steps) of x + iy at positions equally spaced, the last of which is the first again."""
    z = path[:, :-1, 0] + 1j * path[:, :-1, 1]
    return np.fft.fft(z, axis=1) / z.shape[1]


class _Measure(NamedTuple):
    """A `function` of a quantity that a sweep has of a point (designs, steps + 1, 2), or of a link, pair or input.

    `of_whole_path`: only of paths that are solved at every step; `of_closed_path`: and that come back to their start.
    """

    function: Callable[[Array], Any]
    quantity: str = "position"
    of_whole_path: bool = False
    of_closed_path: bool = False


def _size_extremes(values: Array) -> Array:
    """The least and the greatest of every design (designs, 2), of vectors by length."""
    return extremes(values if values.ndim == 2 else np.hypot(values[..., 0], values[..., 1]))


def _bounding_box(path: Array) -> Array:
    return np.concatenate([np.fmin.reduce(path, axis=1), np.fmax.reduce(path, axis=1)], axis=1)


POINT_MEASURES: Mapping[str, _Measure] = {
    "x_extremes": _Measure(lambda path: extremes(path[..., 0])),
    "y_extremes": _Measure(lambda path: extremes(path[..., 1])),
    "bounding_box": _Measure(_bounding_box),
    "speed_extremes": _Measure(_size_extremes, "velocity"),
    "acceleration_extremes": _Measure(_size_extremes, "acceleration"),
    "path_length": _Measure(path_length, of_whole_path=True),
    "enclosed_area": _Measure(enclosed_area, of_whole_path=True, of_closed_path=True),
    "fourier_descriptors": _Measure(fourier_descriptors, of_whole_path=True, of_closed_path=True),
}
RESULT_ARGUMENTS: Mapping[str, str] = {
    **dict.fromkeys(LINK_QUANTITIES, "links"),
    **dict.fromkeys(PAIR_QUANTITIES, "pairs"),
    "transmission_angle": "outputs",
    "effort": "efforts",
    "reaction": "reactions",
    "reaction_couple": "reactions",
}
"""Quantities of links, pairs and inputs, those attributes of a `Sweep`: which argument of a sweep asks for each."""
MEASURES: Mapping[str, _Measure] = {
    **POINT_MEASURES,
    **{f"{quantity}_extremes": _Measure(_size_extremes, quantity) for quantity in RESULT_ARGUMENTS},
}
RATES = "velocity", "acceleration", *LINK_QUANTITIES[1:], *PAIR_QUANTITIES[1:]


@dataclass(frozen=True)
class NamedReduction:
    """A function of a sweep, or of a block of one: a measure of `MEASURES` of a point, link, pair or input."""

    name: str
    measure: str

    @property
    def is_of_point(self) -> bool:
        """Whether it is a measure of a point."""
        return self.measure in POINT_MEASURES

    @property
    def quantity(self) -> str:
        """The attribute of a sweep that is measured."""
        return MEASURES[self.measure].quantity

    @property
    def wants_rates(self) -> bool:
        """Whether it is made of rates."""
        return self.quantity in RATES

    def __call__(self, sweep: Sweep | Each) -> Array:
        """The measure of every design; not a number where the path is not as the measure needs it."""
        measure = MEASURES[self.measure]
        if isinstance(sweep, Each):
            values = sweep.of_point(measure.quantity, self.name)
        else:
            results: Mapping[str, Any] = getattr(sweep, measure.quantity)
            values = np.asarray(results[self.name])
        measured = measure.function(values)
        if measure.of_whole_path:
            measured[~sweep.whole] = np.nan
        if measure.of_closed_path:
            measured[~_is_closed(values)] = np.nan
        return measured


def _is_closed(path: Array) -> BoolArray:
    """Which paths (designs, steps + 1, 2) come back to where they started (designs,)."""
    extent = np.ptp(path, axis=1).max(axis=1)
    return np.asarray(np.abs(path[:, -1] - path[:, 0]).max(axis=1) <= CLOSED_PATH_TOLERANCE * extent)


Swept_ = TypeVar("Swept_", bound=Sized)
Reduction = Callable[[Swept_], Any]
"""What is made of some of the whole, a `Sweep` or an `Each`: an array with an entry first for each of its designs."""
RESULT_TYPES = ("float64", "float32")
"""Types of the numbers of results."""


@dataclass(frozen=True)
class ReducedSweep(Mapping[str, Array]):
    """Reductions of every design by their names, arrays with an entry for each design first.

    `designs`: what they differ in; nothing of mechanisms. `status` (designs,): how each ended, 0 is solved at every
    step, any other number k is `outcomes[k]`. `general`: how many positions the general path solved.
    `design` and `assembly` as of `Sweep`, where all assemblies were asked for.
    """

    designs: Mapping[str, Array]
    reduced: Mapping[str, Array]
    status: Array
    general: int
    notes: SweepNotes | tuple[str, ...] = field(repr=False)
    outcomes: tuple[Outcome, ...] = tuple(Outcome)
    design: Array | None = field(default=None, repr=False)
    assembly: Array | None = field(default=None, repr=False)

    __repr__ = short_repr

    @cached_property
    def remarks(self) -> tuple[str, ...]:
        """What there is to say; made when it is first read."""
        return self.notes.sentences() if isinstance(self.notes, SweepNotes) else self.notes

    def __getitem__(self, name: str) -> Array:
        """A reduction of all designs."""
        return self.reduced[name]

    def __iter__(self) -> Iterator[str]:
        """The names."""
        return iter(self.reduced)

    def __len__(self) -> int:
        """How many reductions there are."""
        return len(self.reduced)

    @property
    def whole(self) -> BoolArray:
        """The designs (designs,) that were solved at every step."""
        return np.asarray(self.status == 0)


class ReducedBlock(NamedTuple):
    """What is kept of a block: its reductions (designs, ...), how each design ended (designs,), and of `SolvedDesigns`
    the rest."""

    reduced: dict[str, Array]
    status: IntArray
    general_positions: int
    general_designs: int
    ending_counts: tuple[tuple[int, int, Any], ...]


class Reductions(NamedTuple):
    """What is to be kept, by its names."""

    functions: dict[str, Reduction[Any]]

    @property
    def measures(self) -> list[NamedReduction]:
        """Those that are asked for by name."""
        return [function for function in self.functions.values() if isinstance(function, NamedReduction)]

    def with_results(self, asked: Mapping[str, Sequence[str] | str]) -> dict[str, tuple[str, ...]]:
        """The names of links, pairs and so on that are asked for, with those of measures."""
        names = {word: (given,) if isinstance(given, str) else tuple(given) for word, given in asked.items()}
        for measure in self.measures:
            if not measure.is_of_point:
                names[RESULT_ARGUMENTS[measure.quantity]] += (measure.name,)
        return names

    def with_points(self, points: Sequence[Any] | None, rates: bool) -> tuple[tuple[Any, ...] | None, bool]:
        """The points that have to be solved, and whether with rates, of what is asked for: no more than is needed where
        only measures are. Raises BadInput."""
        measured = dict.fromkeys(measure.name for measure in self.measures if measure.is_of_point)
        wants_rates = any(measure.wants_rates for measure in self.measures)
        if len(self.measures) == len(self.functions):
            return tuple(measured), wants_rates
        if wants_rates and not rates:
            raise BadInput("rates", "speeds and accelerations are wanted, which are rates")
        return None if points is None else tuple(dict.fromkeys((*points, *measured))), rates


def read_reductions(reduce: Mapping[str, Any], result_name: Callable[[str], Any], steps: int) -> Reductions:
    """The reductions by their names; `result_name` gives that of a point, and raises BadInput. Raises BadInput."""
    if not isinstance(reduce, Mapping) or not reduce:
        raise BadInput("reduce", "name what is to be kept, as {'reach': 'C.bounding_box'}")
    return Reductions({name: _read_reduction(name, each, result_name, steps) for name, each in reduce.items()})


def _read_reduction(name: str, given: Any, result_name: Callable[[str], Any], steps: int) -> Any:
    if isinstance(given, str):
        name_of_result, _, measure = given.rpartition(".")
        if measure not in MEASURES:
            hint = suggest_name(measure, list(MEASURES), "measures", None)
            raise BadInput(f"reduce.{name}", f"there is no measure {given!r:.60}{hint}")
        if measure == "fourier_descriptors" and steps <= 2 * HARMONICS:
            raise BadInput(f"reduce.{name}", f"{HARMONICS} harmonics want more than {2 * HARMONICS} steps")
        reduction = NamedReduction(name_of_result, measure)
        return NamedReduction(result_name(name_of_result), measure) if reduction.is_of_point else reduction
    if not callable(given):
        wanted = "a measure, as 'C.bounding_box', or a function of a sweep"
        raise BadInput(f"reduce.{name}", f"{wanted} is wanted, not {given!r:.40}")
    return given


def result_type(dtype: DTypeLike) -> str:
    """The name of the type that results have. Raises BadInput."""
    try:
        name = np.dtype(dtype).name
    except TypeError:
        name = ""
    if name not in RESULT_TYPES:
        raise BadInput("dtype", f"results are {' or '.join(RESULT_TYPES)}, not {dtype!r:.40}")
    return name


def reduce_block(block: ResultBlock, reductions: Mapping[str, Reduction[Sweep]]) -> ReducedBlock:
    """Solve a block and keep its reductions, made of numbers in double precision and rounded to the block's."""
    designs = block.designs._replace(dtype="float64")
    store = MemoryStore(SweepPlan(designs, designs.design_count, block.results))
    every = slice(0, store.plan.design_count)
    done = solve_result_block(block._replace(designs=designs), store.output_array(every))
    store.write_block(0, every, done)
    sweep = store.result()
    reduced = reduce_all(sweep, reductions, block.designs.dtype)
    ended = np.array(done.status[:, -1])
    return ReducedBlock(reduced, ended, done.general_positions, done.general_designs, done.endings)


def reduce_all(source: Swept_, reductions: Mapping[str, Reduction[Swept_]], dtype: str) -> dict[str, Array]:
    """The reductions of some of the whole, rounded. Raises BadInput where one has no entry for each design."""
    reduced = {}
    for name, function in reductions.items():
        values = np.asarray(function(source))
        if values.dtype == object or values.shape[:1] != (len(source),):
            reason = (
                f"a reduction gives an array with an entry for each of {len(source)} designs, not one {values.shape}"
            )
            raise BadInput(f"reduce.{name}", reason)
        if dtype != "float64" and values.dtype.kind in "fc":
            values = values.astype("complex64" if values.dtype.kind == "c" else dtype)
        reduced[name] = values
    return reduced


def join_blocks(blocks: Sequence[ReducedBlock]) -> tuple[dict[str, Array], Array, int]:
    """The reductions of all blocks, one after the other, which are no longer theirs; how all designs ended, and how
    many positions the general path solved. Raises BadInput where they are not of one shape."""
    reduced = {}
    for name in tuple(blocks[0].reduced) if blocks else ():
        shapes = {block.reduced[name].shape[1:] for block in blocks}
        if len(shapes) > 1:
            raise BadInput(f"reduce.{name}", f"some mechanisms have an array {min(shapes)} each, others {max(shapes)}")
        reduced[name] = np.concatenate([block.reduced.pop(name) for block in blocks])
    status = np.concatenate([np.zeros(0, dtype=np.int8), *(block.status for block in blocks)])
    return reduced, status, sum(block.general_positions for block in blocks)


class ReductionStore(BlockStore):
    """Takes the reductions of blocks, in memory."""

    def __init__(self, plan: SweepPlan):
        super().__init__(plan)
        self.blocks: dict[int, ReducedBlock] = {}

    def write_block(self, number: int, part: slice, done: SolvedDesigns | ReducedBlock) -> None:
        assert isinstance(done, ReducedBlock)
        first = next(iter(self.blocks.values()), done)
        for name, values in done.reduced.items():
            shape, expected = values.shape[1:], first.reduced[name].shape[1:]
            if shape != expected:
                designs = f"designs {part.start} to {part.stop - 1}"
                raise BadInput(f"reduce.{name}", f"{designs} have an array {shape} each, others {expected}")
        self.blocks[number] = done
        self.block_notes[number] = done.general_positions, done.general_designs, done.ending_counts

    def leave_out(self, parts: Mapping[int, slice], reason: str) -> None:
        if not self.blocks:
            raise interrupted(reason, "before a block of designs was reduced")
        known = next(iter(self.blocks.values())).reduced
        for number, part in parts.items():
            count = part.stop - part.start
            unknown = {
                # what has no number that says so is written as one that has
                name: np.full((count, *values.shape[1:]), np.nan, values.dtype if values.dtype.kind in "fc" else float)
                for name, values in known.items()
            }
            status, endings = np.full(count, INTERRUPTED, dtype=np.int8), ((INTERRUPTED, count, reason),)
            self.write_block(number, part, ReducedBlock(unknown, status, 0, 0, endings))

    def result(self) -> ReducedSweep:
        joined = join_blocks([block for _, block in sorted(self.blocks.items())])
        swept = ReducedSweep(self.plan.all_designs.designs, *joined, self.notes())
        listed = self.plan.assemblies
        return swept if listed is None else replace(swept, design=listed.design, assembly=listed.number)
