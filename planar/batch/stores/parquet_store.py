"""A sweep's blocks in a folder of Parquet files: one for each block, and beside it the checksum of the whole file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from planar.batch.block import SolvedDesigns
from planar.batch.named_results.result_rows import ResultRow
from planar.batch.results import Sweep
from planar.batch.stores.store import BlockNote, FolderStore, result_views
from planar.document.files import read_limited
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.safe_files import PARTIAL_FILE_NAME, file_sha256, write_atomically

MANIFEST = "_planar.json"
"""What makes a folder a store; readers pass over names that begin so."""
POINT_LETTERS = {"position": "", "velocity": "v", "acceleration": "a"}
READ_ERRORS = (BadInput, OSError, KeyError, ValueError, TypeError, pa.ArrowException)
"""What pyarrow raises of damaged files."""


class ParquetStore(FolderStore):
    """See the module. A row for each design and step; a block is whole where its file has the checksum beside it."""

    READ_ERRORS = READ_ERRORS

    def read_about(self) -> Any:
        return json.loads(read_limited(self.path / MANIFEST))

    def write_about(self, about: dict[str, Any]) -> None:
        write_atomically(self.path / MANIFEST, json.dumps(about).encode())

    def open_blocks(self) -> None:
        for file in self.path.iterdir():
            if PARTIAL_FILE_NAME.fullmatch(file.name):  # of a process that was killed
                with suppress(OSError):
                    file.unlink()
        self.verified_files: dict[int, tuple[int, int]] = {}
        "of every block that has its checksum: when its file was written, and how long it is"

    def inspect_block(self, number: int) -> tuple[BlockNote | None, bool]:
        try:
            self._verify_block(number)
            about = json.loads(parquet.read_schema(self._block_path(number)).metadata[b"planar"])
            return (about["general"], about["sent"], about["said"]), True
        except READ_ERRORS:
            return None, self._block_path(number).exists() or self._checksum_path(number).exists()

    def _verify_block(self, number: int) -> None:
        """Raises one of `READ_ERRORS` where a block is not whole; looked at once as long as it stays."""
        known = self._block_path(number).stat()
        if self.verified_files.get(number) != (known.st_mtime_ns, known.st_size):
            if read_limited(self._checksum_path(number)) != self._checksum_line(
                number, file_sha256(self._block_path(number))
            ):
                raise ValueError("the checksum is another")
            self.verified_files[number] = known.st_mtime_ns, known.st_size

    def _block_path(self, number: int) -> Path:
        return self.path / f"part-{number:06d}.parquet"

    def _checksum_path(self, number: int) -> Path:
        return self.path / f"_part-{number:06d}.sha256"

    def _checksum_line(self, number: int, checksum: str) -> bytes:
        """A checksum as `sha256sum -c` takes it."""
        return f"{checksum}  {self._block_path(number).name}\n".encode()

    def write_files(self, number: int, part: slice, done: SolvedDesigns, note: BlockNote) -> None:
        designs, steps = done.status.shape
        columns: dict[str, Array] = {
            "design": np.repeat(np.arange(part.start, part.stop), steps),
            "step": np.tile(np.arange(steps, dtype=np.int32), designs),
            **{name: np.repeat(values[part], steps) for name, values in self.plan.design_columns.items()},
            "input": np.broadcast_to(done.input, done.status.shape).ravel(),
            "status": done.status.ravel(),
            "dead_point": np.repeat(done.dead_point, steps),
            "stop_position": np.repeat(done.stop_position, steps),
        }
        for row, values in zip(self.plan.rows, result_views(done.out, self.plan), strict=True):
            axes = np.moveaxis(values, 2, 0) if values.ndim == 3 else values[None]
            for column, axis_values in zip(_column_names(row), axes, strict=True):
                columns[column] = np.ascontiguousarray(axis_values).ravel()
        general_positions, general_designs, endings = note
        about = {
            "fingerprint": self.fingerprint,
            "block": self.plan.block_size,
            "number": number,
            "general": general_positions,
            "sent": general_designs,
            "said": endings,
            "outcomes": [outcome.value for outcome in Outcome],
        }
        content, table = BytesIO(), pa.table(columns).replace_schema_metadata({"planar": json.dumps(about)})
        parquet.write_table(table, content, write_page_checksum=True)
        checksum = sha256(content.getbuffer()).hexdigest()
        self._checksum_path(number).unlink(missing_ok=True)
        write_atomically(self._block_path(number), content.getvalue())
        write_atomically(self._checksum_path(number), self._checksum_line(number, checksum))

    def read_columns(self, columns: tuple[str, ...]) -> list[Array]:
        """Columns of all blocks, each (designs, steps + 1). Raises BadInput."""
        blocks = [self._read_block(number, columns) for number in range(self.plan.block_count)]
        return [np.concatenate(column) for column in zip(*blocks, strict=True)]

    def _read_block(self, number: int, columns: tuple[str, ...]) -> list[Array]:
        part = self.block_slice(number)
        shape = part.stop - part.start, self.plan.all_designs.steps + 1
        try:
            self._verify_block(number)
            table = parquet.read_table(self._block_path(number), columns=list(columns), page_checksum_verification=True)
            return [table[name].to_numpy().reshape(shape) for name in columns]
        except READ_ERRORS:
            raise self.damaged_block_error(number) from None

    def result(self) -> Sweep:
        columns = self.plan.by_quantity(map(_column_names, self.plan.rows))
        results = {quantity: _ParquetResults(self, names) for quantity, names in columns.items()}
        status, inputs, *ends = self.read_columns(("status", "input", "dead_point", "stop_position"))
        common = inputs[0] if np.all(inputs == inputs[0]) else inputs
        return self.make_sweep(results, status, common, (ends[0][:, 0], ends[1][:, 0]))


class _ParquetResults(Mapping[str, Any]):
    """One quantity of all that have it, by name, read from Parquet files when it is asked for."""

    def __init__(self, store: ParquetStore, columns: Mapping[str, tuple[str, ...]]):
        self.store, self.columns = store, columns

    def __getitem__(self, name: str) -> Array:
        columns = self.store.read_columns(self.columns[name])
        return np.stack(columns, axis=2) if len(columns) > 1 else columns[0]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)


def _column_names(row: ResultRow) -> tuple[str, ...]:
    """The columns of a result."""
    if row.quantity in POINT_LETTERS:
        return tuple(f"{row.name} {POINT_LETTERS[row.quantity]}{axis} [{row.unit}]" for axis in "xy")
    result = f"{row.name} {row.quantity.replace('_', ' ')}"
    return (f"{result} [{row.unit}]",) if row.width == 1 else tuple(f"{result} {axis} [{row.unit}]" for axis in "xy")
