"""Stores of a sweep's blocks: what every store does, and arrays in memory, which are one."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from planar.batch.assembly.assembly_lists import ListedAssemblies
from planar.batch.block import DesignBlock, SolvedDesigns
from planar.batch.named_results.result_rows import POINT_QUANTITIES, RequestedResults, ResultRow
from planar.batch.results import Sweep, SweepNotes, add_ending_counts
from planar.codegen.llvm_compile import allocate_aligned
from planar.document.files import to_dict
from planar.foundation.arrays import Array, part_offsets
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.safe_files import PARTIAL_FILE_NAME, write_error
from planar.foundation.time_limit import interrupted

MAX_BYTES_IN_MEMORY = 16 * 2**30
"""Bytes of results that are kept in memory."""
ZARR_PARTIAL_SUFFIX = ".partial"
"""Ending of the files that Zarr has not written whole."""
STORE_VERSION = 3
"""Of what stands in a store; raised where it is no longer that of stores of before."""
POINT_UNITS = ("m", "m/s", "m/s^2")
RowValue = TypeVar("RowValue")
BlockNote = tuple[int, int, Any]
"""Of a block the positions and designs of the general path, and by the code of each outcome how many designs ended so,
and the sentence of the first."""
INTERRUPTED = Outcome.INTERRUPTED.code
"""What stands for that in a status."""


@dataclass(frozen=True, eq=False)
class SweepPlan:
    """A sweep as one block of all its designs, and how many of them are solved together."""

    all_designs: DesignBlock
    block_size: int
    results: RequestedResults
    assemblies: ListedAssemblies | None = None

    @property
    def design_count(self) -> int:
        """How many designs there are."""
        return self.all_designs.design_count

    @property
    def design_columns(self) -> dict[str, Array]:
        """What is known of every design: its numbers, and which assembly it is of which of the given designs."""
        listed = self.assemblies
        rows = {} if listed is None else {"of design": listed.design, "assembly": listed.number}
        return {**self.all_designs.designs, **rows}

    @property
    def block_count(self) -> int:
        """How many blocks there are."""
        return -(-self.design_count // self.block_size)

    @property
    def point_names(self) -> tuple[str, ...]:
        """The names of the points."""
        return tuple(str(name) for name in self.all_designs.points)

    @property
    def quantities(self) -> tuple[str, ...]:
        """What is told of every point."""
        return POINT_QUANTITIES if self.all_designs.rates else POINT_QUANTITIES[:1]

    @cached_property
    def rows(self) -> tuple[ResultRow, ...]:
        """What is told at a step in the order of the numbers: of all points, then beside them."""
        points = (
            ResultRow(quantity, name, 2, unit)
            for quantity, unit in zip(self.quantities, POINT_UNITS, strict=False)
            for name in self.point_names
        )
        return *points, *self.results.rows(self.all_designs.mechanism, self.all_designs.rates)

    @property
    def row_count(self) -> int:
        """How many numbers are told at a step."""
        return sum(row.width for row in self.rows)

    def by_quantity(self, values: Iterable[RowValue]) -> dict[str, dict[str, RowValue]]:
        """Values of all rows, one for each, by quantity and name."""
        named: dict[str, dict[str, RowValue]] = {quantity: {} for quantity in self.quantities}
        for row, value in zip(self.rows, values, strict=True):
            named.setdefault(row.quantity, {})[row.name] = value
        return named

    def fingerprint(self) -> str:
        """The same for two sweeps that have the same results."""
        block, digest = self.all_designs, hashlib.sha256()
        grid = [block.steps, block.points, block.rates, block.start, block.stop, block.pair, block.dtype]
        results = [self.results, self.assemblies is not None, block.duration]
        sweep = [STORE_VERSION, to_dict(block.mechanism), grid, *results]
        digest.update(json.dumps(sweep, sort_keys=True, default=float).encode())
        for name, values in sorted(block.designs.items()):
            digest.update(name.encode() + b"\0" + np.ascontiguousarray(values).tobytes())
        return digest.hexdigest()


class BlockStore(ABC):
    """Takes solved blocks, each by its number, and makes of them the result of the sweep."""

    def __init__(self, plan: SweepPlan):
        self.plan = plan
        self.finished: set[int] = set()
        self.damaged: set[int] = set()
        "blocks of which something was there already, but not whole"
        self.block_notes: dict[int, BlockNote] = {}

    def output_array(self, part: slice) -> Array | None:
        """Where a block may put its results, if that is known ahead: out (steps + 1, rows, designs)."""
        return None

    @abstractmethod
    def write_block(self, number: int, part: slice, done: SolvedDesigns) -> None:
        """A solved block, of these designs."""

    def takes(self, done: SolvedDesigns) -> bool:
        """Whether a block is kept."""
        return True

    @abstractmethod
    def leave_out(self, parts: Mapping[int, slice], reason: str) -> None:
        """Say that blocks are not solved, as a computation ended early. Raises NoAnswer."""

    @abstractmethod
    def result(self) -> Any:
        """The sweep, or what is kept of it, once all blocks are there."""

    def notes(self) -> SweepNotes:
        """What there is to say, in the order of the designs, whichever block was solved first."""
        notes = [note for _, note in sorted(self.block_notes.items())]
        endings = tuple(
            (code, *ending) for code, ending in sorted(add_ending_counts(note[2] for note in notes).items())
        )
        general_designs, plan = sum(note[1] for note in notes), self.plan
        counts = plan.design_count, general_designs, self.general_positions
        return SweepNotes(*counts, endings, plan.block_count, len(self.damaged))

    @property
    def general_positions(self) -> int:
        """How many positions the general path solved."""
        return sum(note[0] for note in self.block_notes.values())

    def make_sweep(
        self, results: Mapping[str, Mapping[str, Any]], status: Any, inputs: Array, ends: tuple[Any, Any]
    ) -> Sweep:
        """The result out of arrays by quantity and name; `ends`: where dead points and stops end designs."""
        plan, listed = self.plan, self.plan.assemblies
        quantities: dict[str, Any] = {**dict.fromkeys(POINT_QUANTITIES), **results}
        position, velocity, acceleration = (quantities.pop(quantity) for quantity in POINT_QUANTITIES)
        if listed is not None:
            quantities |= {"design": listed.design, "assembly": listed.number}
        of_points = plan.point_names, plan.all_designs.designs, position, velocity, acceleration
        return Sweep(*of_points, status, inputs, self.general_positions, *ends, self.notes(), **quantities)


def open_store(store: str | Path | None, plan: SweepPlan) -> BlockStore:
    """Where a sweep's results go. Raises BadInput."""
    if store is None:
        return MemoryStore(plan)
    path = Path(store)
    modules = {
        ".zarr": ("zarr_store", "ZarrStore", "zarr", "sweep"),
        ".parquet": ("parquet_store", "ParquetStore", "pyarrow", "parquet"),
    }
    if path.suffix not in modules:
        raise BadInput("store", f"a store ends in {' or '.join(modules)}, unlike {str(store)[:80]!r}")
    module, name, library, extra = modules[path.suffix]
    try:
        import_module(library)
    except ImportError:
        raise BadInput(
            "store", f'a {path.suffix} store needs {library}: pip install "planar-linkages[{extra}]"'
        ) from None
    return getattr(import_module(f"planar.batch.stores.{module}"), name)(plan, path)


@contextmanager
def reporting_write_errors(path: Path) -> Iterator[None]:
    """What the system refuses of a store is one sentence: BadInput, or WriteFailure where there is no room."""
    try:
        yield
    except OSError as problem:
        raise write_error("store", str(path), problem) from None


def is_folder_begun(path: Path) -> bool:
    """Whether anything whole stands in the folder of a store, which is made if it is not there. Raises BadInput."""
    with reporting_write_errors(path):
        if path.exists() and not path.is_dir():
            raise BadInput("store", f"{path} is a file, and a store is a folder; name another, or take it away first")
        path.mkdir(parents=True, exist_ok=True)
        return any(
            not PARTIAL_FILE_NAME.fullmatch(file.name) and file.suffix != ZARR_PARTIAL_SUFFIX for file in path.iterdir()
        )


class FolderStore(BlockStore):
    """A store in a folder of its own, which is gone on with where it is there."""

    READ_ERRORS: tuple[type[Exception], ...] = ()
    """What is raised of damaged files."""

    def __init__(self, plan: SweepPlan, path: Path):
        super().__init__(plan)
        self.path, self.fingerprint = path, plan.fingerprint()
        if is_folder_begun(path):
            try:
                about = self.read_about()
            except self.READ_ERRORS:
                about = {}
            size = about.get("block") if isinstance(about, dict) and about.get("fingerprint") == self.fingerprint else 0
            if not isinstance(size, int) or size < 1:
                reason = "holds something else than this sweep; name another store, or take it away first"
                raise BadInput("store", f"{path} {reason}")
            self.plan = replace(plan, block_size=size)
        else:
            with reporting_write_errors(path):
                self.write_about({"fingerprint": self.fingerprint, "block": plan.block_size})
        with reporting_write_errors(path):
            self.open_blocks()
        for number in range(self.plan.block_count):
            note, is_begun = self.inspect_block(number)
            if note is not None:
                self.finished.add(number)
                self.block_notes[number] = note
            elif is_begun:
                self.damaged.add(number)

    @abstractmethod
    def read_about(self) -> Any:
        """What the store says about itself. Raises one of `READ_ERRORS`."""

    @abstractmethod
    def write_about(self, about: dict[str, Any]) -> None:
        """Begin the store with what it says about itself, so that it is this sweep's from its first moment."""

    @abstractmethod
    def open_blocks(self) -> None:
        """Make what blocks are written to, or remove what a killed process has left."""

    @abstractmethod
    def inspect_block(self, number: int) -> tuple[BlockNote | None, bool]:
        """The note of a block that is whole, else None; and whether anything of the block is there."""

    @abstractmethod
    def write_files(self, number: int, part: slice, done: SolvedDesigns, note: BlockNote) -> None:
        """Write a solved block and its note."""

    def write_block(self, number: int, part: slice, done: SolvedDesigns) -> None:
        endings = [(code, count, str(sentence)) for code, count, sentence in done.endings]
        note = done.general_positions, done.general_designs, endings
        with reporting_write_errors(self.path):
            self.write_files(number, part, done, note)
        self.block_notes[number] = note

    def block_slice(self, number: int) -> slice:
        """The designs of a block."""
        size = self.plan.block_size
        return slice(number * size, min((number + 1) * size, self.plan.design_count))

    def damaged_block_error(self, number: int) -> BadInput:
        """That a block of the store cannot be read."""
        part = self.block_slice(number)
        block = f"block {number} of {self.path} (designs {part.start} to {part.stop - 1})"
        return BadInput("store", f"{block} is missing or damaged; the same sweep into this store solves it again")

    def takes(self, done: SolvedDesigns) -> bool:
        """Only a block that no time limit ended, as the store is gone on with."""
        return all(code != INTERRUPTED for code, _, _ in done.endings)

    def leave_out(self, parts: Mapping[int, slice], reason: str) -> None:
        count = self.plan.design_count
        done = count - sum(part.stop - part.start for part in parts.values())
        raise interrupted(
            reason, f"after {done} of {count} designs, which the store has", "the same sweep into this store goes on"
        )


class MemoryStore(BlockStore):
    """Arrays of all designs in memory, into which blocks are solved."""

    def __init__(self, plan: SweepPlan):
        super().__init__(plan)
        self.shape = plan.all_designs.steps + 1, plan.row_count, plan.design_count
        size = np.prod(self.shape, dtype=float) * np.dtype(plan.all_designs.dtype).itemsize
        if size > MAX_BYTES_IN_MEMORY:
            message = f"results of {size * 1e-9:.0f} GB are too much for memory; name a store, as 'sweep.zarr'"
            raise BadInput("store", message)
        self.out = allocate_aligned(*self.shape, plan.all_designs.dtype)
        self.status = np.zeros((plan.design_count, plan.all_designs.steps + 1), dtype=np.int8)
        self.inputs: list[tuple[slice, Array]] = []
        "of every block where the running input is: in one row for all of its designs, or in a row of each"
        self.dead_point, self.stop_position = np.full((2, plan.design_count), np.nan)

    def output_array(self, part: slice) -> Array:
        return self.out[:, :, part]

    def write_block(self, number: int, part: slice, done: SolvedDesigns) -> None:
        out = self.output_array(part)
        if not np.may_share_memory(out, done.out):
            out[:] = done.out
        self.status[part], self.dead_point[part] = done.status, done.dead_point
        self.stop_position[part] = done.stop_position
        self.inputs.append((part, done.input))
        self.block_notes[number] = done.general_positions, done.general_designs, done.endings

    def leave_out(self, parts: Mapping[int, slice], reason: str) -> None:
        for number, part in parts.items():
            count = part.stop - part.start
            self.out[:, :, part], self.status[part] = np.nan, INTERRUPTED
            self.inputs.append((part, np.full(self.status.shape[1], np.nan)))
            self.block_notes[number] = 0, 0, ((INTERRUPTED, count, reason),)

    def result(self) -> Sweep:
        inputs = self.inputs[0][1]
        if not all(values.ndim == 1 and np.array_equal(values, inputs) for _, values in self.inputs):
            inputs = np.empty(self.status.shape)
            for part, values in self.inputs:
                inputs[part] = values
        ends = self.dead_point, self.stop_position
        return self.make_sweep(self.plan.by_quantity(result_views(self.out, self.plan)), self.status, inputs, ends)


def result_views(out: Array, plan: SweepPlan) -> list[Array]:
    """out (steps + 1, rows, designs) by the rows of a plan, without a copy: arrays (designs, steps + 1), or of vectors
    (designs, steps + 1, 2)."""
    rows, by_design = plan.rows, out.transpose(2, 0, 1)
    offsets = part_offsets([row.width for row in rows])
    return [
        by_design[:, :, first] if row.width == 1 else by_design[:, :, first : first + row.width]
        for row, first in zip(rows, offsets, strict=False)
    ]
