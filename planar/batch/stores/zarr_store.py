"""A sweep's blocks in a Zarr group: every chunk with a checksum, every block with a record that it is whole."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import quote

import numpy as np
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec

from planar.batch.block import SolvedDesigns
from planar.batch.named_results.result_rows import ResultRow
from planar.batch.results import Sweep
from planar.batch.stores.store import BlockNote, FolderStore, result_views
from planar.document.files import to_dict
from planar.foundation.arrays import Array
from planar.foundation.errors import Outcome

RECORD_BYTES = 32_768
"""Bytes of a block's record: a sentence for each outcome, as JSON."""
READ_ERRORS = (OSError, RuntimeError, ValueError, KeyError, TypeError)
"""What Zarr and its codecs raise of damaged files."""
MISSING_STATUS = -1
"""The status of what is not there: none that a design can have."""


class ZarrStore(FolderStore):
    """See the module. A block is whole once its record, written last, and all its chunks can be read."""

    READ_ERRORS = READ_ERRORS

    def read_about(self) -> Any:
        self.group = zarr.open_group(str(self.path), mode="r+")
        return dict(self.group.attrs)

    def write_about(self, about: dict[str, Any]) -> None:
        about["mechanism"] = to_dict(self.plan.all_designs.mechanism)
        about |= {"points": list(self.plan.point_names), "outcomes": [outcome.value for outcome in Outcome]}
        self.group = zarr.create_group(str(self.path), attributes=about)

    def open_blocks(self) -> None:
        with zarr.config.set({"array.write_empty_chunks": True}):  # a chunk that is not there is lost
            self.arrays = dict(self._open_arrays())

    def _open_arrays(self) -> Iterator[tuple[str, Any]]:
        """All arrays by name, those made that are not there or not as they have to be."""
        plan, row = self.plan, (self.plan.all_designs.steps + 1,)
        layout: dict[str, tuple[str, float, tuple[int, ...]]] = {
            _array_path(result): (plan.all_designs.dtype, np.nan, (*row, 2) if result.width == 2 else row)
            for result in plan.rows
        }
        layout |= {"status": ("int8", MISSING_STATUS, row), "input": ("float64", np.nan, row)}
        layout |= dict.fromkeys(("dead_point", "stop_position"), ("float64", np.nan, ()))
        for name, (dtype, fill_value, shape) in layout.items():
            of_array = {"shape": (plan.design_count, *shape), "chunks": (plan.block_size, *shape)}
            dimensions = ("design", "step", "axis")[: 1 + len(shape)]
            yield self._open_array(name, dtype=dtype, fill_value=fill_value, dimension_names=dimensions, **of_array)
        records = {"shape": (plan.block_count, RECORD_BYTES), "chunks": (1, RECORD_BYTES)}
        yield self._open_array("blocks", dtype="uint8", fill_value=0, **records)
        for name, values in plan.design_columns.items():
            of_all = {"shape": values.shape, "chunks": values.shape, "dimension_names": ("design",)}
            key, array = self._open_array(
                f"designs/{_path_name(name)}", dtype=str(values.dtype), fill_value=values.dtype.type(0), **of_all
            )
            if not self._has_values(array, values):
                array[:] = values
            yield key, array

    @staticmethod
    def _has_values(array: Any, values: Array) -> bool:
        try:
            return np.array_equal(array[:], values)
        except READ_ERRORS:
            return False

    def _open_array(self, name: str, **wanted: Any) -> tuple[str, Any]:
        wanted["compressors"] = (ZstdCodec(), Crc32cCodec())
        try:
            array = self.group[name]
            expected = zarr.create_array(zarr.storage.MemoryStore(), **wanted).metadata
            # as text, since NaN equals nothing
            if isinstance(array, zarr.Array) and repr(array.metadata.to_dict()) == repr(expected.to_dict()):
                return name, array
        except READ_ERRORS:
            pass
        return name, self.group.create_array(name, overwrite=True, **wanted)

    def inspect_block(self, number: int) -> tuple[BlockNote | None, bool]:
        record = self._read_record(number)
        # all arrays but those that are written at once, and the records
        names = (name for name in self.arrays if name != "blocks" and not name.startswith("designs/"))
        are_readable = [self.is_readable(name, number) for name in names]
        return record if all(are_readable) else None, record is not None or any(are_readable)

    def _read_record(self, number: int) -> BlockNote | None:
        try:
            text = bytes(self.arrays["blocks"][number]).rstrip(b"\0")
            if not text:
                return None
            positions, designs, endings = json.loads(text)
        except READ_ERRORS:
            return None
        return None if positions is None else (int(positions), int(designs), [tuple(ending) for ending in endings])

    def has_chunk(self, name: str, number: int) -> bool:
        """Whether a block's chunk of an array is there."""
        return self.path.joinpath(name, "c", str(number), *("0",) * (self.arrays[name].ndim - 1)).is_file()

    def is_readable(self, name: str, number: int) -> bool:
        """Whether it is there and has its checksum."""
        try:
            self.arrays[name][self.block_slice(number)]
        except READ_ERRORS:
            return False
        return self.has_chunk(name, number)

    def write_files(self, number: int, part: slice, done: SolvedDesigns, note: BlockNote) -> None:
        for row, values in zip(self.plan.rows, result_views(done.out, self.plan), strict=True):
            self.arrays[_array_path(row)][part] = np.ascontiguousarray(values)
        for name in ("status", "dead_point", "stop_position"):
            self.arrays[name][part] = getattr(done, name)
        self.arrays["input"][part] = np.broadcast_to(done.input, done.status.shape)
        positions, designs, endings = note
        longest = (RECORD_BYTES - 512) // (4 * max(1, len(endings)))  # a character has four bytes at most
        shortened = [(code, count, sentence[:longest]) for code, count, sentence in endings]
        record = json.dumps((positions, designs, shortened), ensure_ascii=False).encode()
        self.arrays["blocks"][number] = np.frombuffer(record.ljust(RECORD_BYTES, b"\0"), dtype=np.uint8)

    def result(self) -> Sweep:
        results = self.plan.by_quantity(StoredArray(self, _array_path(row)) for row in self.plan.rows)
        ends = StoredArray(self, "dead_point"), StoredArray(self, "stop_position")
        return self.make_sweep(results, StoredArray(self, "status"), self._input_positions(), ends)

    def _input_positions(self) -> Any:
        """Positions of the input, as one row where all designs have the same; looked at block by block."""
        stored = StoredArray(self, "input")
        first = stored[0]
        for number in range(self.plan.block_count):
            block = stored[self.block_slice(number)]
            if not np.array_equal(np.broadcast_to(first, block.shape), block, equal_nan=True):
                return stored
        return first


class StoredArray:
    """One of a store's arrays, read when it is indexed; what is missing or damaged there raises BadInput."""

    def __init__(self, store: ZarrStore, name: str):
        self._store, self._name, self._array = store, name, store.arrays[name]

    def __getitem__(self, key: Any) -> Any:
        try:
            values = self._array[key]
        except READ_ERRORS:
            self._check_blocks(self._store.is_readable)
            raise
        # a chunk that is not there is read as what fills the array
        if np.any(np.isnan(values) if self._array.dtype.kind == "f" else values == MISSING_STATUS):
            self._check_blocks(self._store.has_chunk)
        return values

    def _check_blocks(self, right: Callable[[str, int], bool]) -> None:
        """Raises BadInput for the first block that is not right."""
        store = self._store
        for number in range(store.plan.block_count):
            if not right(self._name, number):
                raise store.damaged_block_error(number) from None

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # none of the array's own, nor of this one before it is made
            raise AttributeError(name)
        return getattr(self._array, name)

    def __len__(self) -> int:
        return self._array.shape[0]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        values = np.asarray(self[...])
        return values if dtype is None else values.astype(dtype)

    def __repr__(self) -> str:
        return repr(self._array)


def _array_path(row: ResultRow) -> str:
    return f"{row.quantity}/{_path_name(row.name)}"


def _path_name(name: str) -> str:
    """A name that a path can have."""
    return quote(name, safe=" ")
