"""A sweep of which only reductions are kept: what is asked for, what a block gives, and what all blocks give."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import DTypeLike

from planar.batch.block import SolvedDesigns
from planar.batch.named_results.result_block import ResultBlock, solve_result_block
from planar.batch.reductions.point_reductions import HARMONICS, MEASURES, RESULT_ARGUMENTS, NamedReduction
from planar.batch.results import Sweep, SweepNotes
from planar.batch.stores.store import INTERRUPTED, BlockStore, MemoryStore, SweepPlan
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import BadInput, Outcome, suggest_name
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import interrupted

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
