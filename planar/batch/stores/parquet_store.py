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
from planar.batch.results import Sweep
from planar.batch.stores.store import (
    BlockStore,
    SweepPlan,
    damaged_block_error,
    foreign_store_error,
    is_folder_begun,
    reporting_write_errors,
    result_views,
)
from planar.document.files import read_limited
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.safe_files import PARTIAL_FILE_NAME, file_sha256, write_atomically

Array = np.ndarray

MANIFEST = "_planar.json"
"""What makes a folder a store; readers pass over names that begin so."""
COLUMN_SYMBOLS = {"position": ("", "m"), "velocity": ("v", "m/s"), "acceleration": ("a", "m/s^2")}
READ_ERRORS = (OSError, KeyError, ValueError, TypeError, pa.ArrowException)
"""What pyarrow raises of damaged files."""


class ParquetStore(BlockStore):
    """See the module. A row for each design and step; a block is whole where its file has the checksum beside it."""

    def __init__(self, plan: SweepPlan, path: Path):
        super().__init__(plan)
        self.path, self.fingerprint = path, plan.fingerprint()
        if is_folder_begun(path):
            try:
                about = json.loads(read_limited(path / MANIFEST))
                self.size = int(about["block"])
            except (BadInput, ValueError, KeyError, TypeError):
                about = {}
            if not isinstance(about, dict) or about.get("fingerprint") != self.fingerprint or self.size < 1:
                raise foreign_store_error(path)
            self.plan = plan = plan._replace(block_size=self.size)
        else:
            with reporting_write_errors(path):
                write_atomically(
                    path / MANIFEST, json.dumps({"fingerprint": self.fingerprint, "block": self.block_size}).encode()
                )
        for left in path.iterdir():
            if PARTIAL_FILE_NAME.fullmatch(left.name):  # of a process that was killed
                with suppress(OSError):
                    left.unlink()
        self.verified_files: dict[int, tuple[int, int]] = {}
        "of every block that has its checksum: when its file was written, and how long it is"
        for number in range(plan.block_count):
            with suppress(*READ_ERRORS, BadInput):
                self._verify_block(number)
                about = json.loads(parquet.read_schema(self._block_path(number)).metadata[b"planar"])
                self.block_notes[number] = about["general"], about["sent"], about["said"]
                self.finished.add(number)
            if number not in self.finished and (
                self._block_path(number).exists() or self._checksum_path(number).exists()
            ):
                self.damaged.add(number)

    def _verify_block(self, number: int) -> None:
        """Raises BadInput, or one of UNREADABLE, where a block is not whole; looked at once as long as it stays."""
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

    def write_block(self, number: int, part: slice, done: SolvedDesigns) -> None:
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
        named = column_names(self.plan)
        for quantity, results in result_views(done.out, self.plan).items():
            for name, values in results.items():
                axes = np.moveaxis(values, 2, 0) if values.ndim == 3 else values[None]
                for column, own in zip(named[quantity][name], axes, strict=True):
                    columns[column] = np.ascontiguousarray(own).ravel()
        said = [(code, count, str(sentence)) for code, count, sentence in done.endings]
        about = {
            "fingerprint": self.fingerprint,
            "block": self.block_size,
            "number": number,
            "general": done.general_positions,
            "sent": done.general_designs,
            "said": said,
            "outcomes": [each.value for each in Outcome],
        }
        content, table = BytesIO(), pa.table(columns).replace_schema_metadata({"planar": json.dumps(about)})
        parquet.write_table(table, content, write_page_checksum=True)
        with reporting_write_errors(self.path):
            self._checksum_path(number).unlink(missing_ok=True)
            write_atomically(self._block_path(number), content.getvalue())
            write_atomically(
                self._checksum_path(number), self._checksum_line(number, sha256(content.getbuffer()).hexdigest())
            )
        self.block_notes[number] = done.general_positions, done.general_designs, said

    def read_columns(self, columns: tuple[str, ...]) -> list[Array]:
        """Columns of all blocks, each (designs, steps + 1). Raises BadInput."""
        found = [self._read_block(number, columns) for number in range(self.plan.block_count)]
        return [np.concatenate(each) for each in zip(*found, strict=True)]

    def _read_block(self, number: int, columns: tuple[str, ...]) -> list[Array]:
        part = slice(number * self.block_size, min((number + 1) * self.block_size, self.plan.design_count))
        shape = part.stop - part.start, self.plan.all_designs.steps + 1
        try:
            self._verify_block(number)
            table = parquet.read_table(self._block_path(number), columns=list(columns), page_checksum_verification=True)
            return [table[name].to_numpy().reshape(shape) for name in columns]
        except (*READ_ERRORS, BadInput):
            raise damaged_block_error(self.path, number, part) from None

    def result(self) -> Sweep:
        found = {quantity: _ParquetResults(self, names) for quantity, names in column_names(self.plan).items()}
        status, inputs, *ends = self.read_columns(("status", "input", "dead_point", "stop_position"))
        common = inputs[0] if np.all(inputs == inputs[0]) else inputs
        return self.make_sweep(found, status, common, (ends[0][:, 0], ends[1][:, 0]))


class _ParquetResults(Mapping[str, Any]):
    """One quantity of all that have it, by name, read from Parquet files when it is asked for."""

    def __init__(self, store: ParquetStore, columns: Mapping[str, tuple[str, ...]]):
        self.store, self.columns = store, columns

    def __getitem__(self, name: str) -> Array:
        found = self.store.read_columns(self.columns[name])
        return np.stack(found, axis=2) if len(found) > 1 else found[0]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)


def column_names(plan: SweepPlan) -> dict[str, dict[str, tuple[str, ...]]]:
    """The columns of every result by quantity and name."""
    found = {order: {name: _point_columns(order, name) for name in plan.point_names} for order in plan.quantities}
    for row in plan.result_rows:
        said = f"{row.name} {row.quantity.replace('_', ' ')}"
        columns = [f"{said} [{row.unit}]"] if row.width == 1 else [f"{said} {axis} [{row.unit}]" for axis in "xy"]
        found.setdefault(row.quantity, {})[row.name] = tuple(columns)
    return found


def _point_columns(order: str, point: str) -> tuple[str, ...]:
    letter, unit = COLUMN_SYMBOLS[order]
    return f"{point} {letter}x [{unit}]", f"{point} {letter}y [{unit}]"
