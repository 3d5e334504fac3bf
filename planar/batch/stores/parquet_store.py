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

from planar.batch.block import Done
from planar.batch.results import Sweep
from planar.batch.stores.store import Plan, Sink, another, begun, damaged, views, writing
from planar.document.files import PART, bytes_of, digest, write_whole
from planar.foundation.errors import BadInput, Outcome

Array = np.ndarray

MARK = "_planar.json"
"""What makes a folder a store; readers pass over names that begin so."""
LETTERS = {"position": ("", "m"), "velocity": ("v", "m/s"), "acceleration": ("a", "m/s^2")}
UNREADABLE = (OSError, KeyError, ValueError, TypeError, pa.ArrowException)
"""What pyarrow raises of damaged files."""


class Store(Sink):
    """See the module. A row for each design and step; a block is whole where its file has the checksum beside it."""

    def __init__(self, plan: Plan, path: Path):
        super().__init__(plan)
        self.path, self.mark = path, plan.fingerprint()
        if begun(path):
            try:
                about = json.loads(bytes_of(path / MARK))
                self.size = int(about["block"])
            except (BadInput, ValueError, KeyError, TypeError):
                about = {}
            if not isinstance(about, dict) or about.get("fingerprint") != self.mark or self.size < 1:
                raise another(path)
            self.plan = plan = plan._replace(size=self.size)
        else:
            with writing(path):
                write_whole(path / MARK, json.dumps({"fingerprint": self.mark, "block": self.size}).encode())
        for left in path.iterdir():
            if PART.fullmatch(left.name):  # of a process that was killed
                with suppress(OSError):
                    left.unlink()
        self.looked_at: dict[int, tuple[int, int]] = {}
        "of every block that has its checksum: when its file was written, and how long it is"
        for number in range(plan.blocks):
            with suppress(*UNREADABLE, BadInput):
                self._look_at(number)
                about = json.loads(parquet.read_schema(self._file(number)).metadata[b"planar"])
                self.told[number] = about["general"], about["sent"], about["said"]
                self.finished.add(number)

    def _look_at(self, number: int) -> None:
        """Raises BadInput, or one of UNREADABLE, where a block is not whole; looked at once as long as it stays."""
        known = self._file(number).stat()
        if self.looked_at.get(number) != (known.st_mtime_ns, known.st_size):
            if bytes_of(self._sum(number)) != self._summed(number, digest(self._file(number))):
                raise ValueError("the checksum is another")
            self.looked_at[number] = known.st_mtime_ns, known.st_size

    def _file(self, number: int) -> Path:
        return self.path / f"part-{number:06d}.parquet"

    def _sum(self, number: int) -> Path:
        return self.path / f"_part-{number:06d}.sha256"

    def _summed(self, number: int, made: str) -> bytes:
        """A checksum as `sha256sum -c` takes it."""
        return f"{made}  {self._file(number).name}\n".encode()

    def take(self, number: int, part: slice, done: Done) -> None:
        designs, steps = done.status.shape
        columns: dict[str, Array] = {
            "design": np.repeat(np.arange(part.start, part.stop), steps),
            "step": np.tile(np.arange(steps, dtype=np.int32), designs),
            **{name: np.repeat(values[part], steps) for name, values in self.plan.whole.designs.items()},
            "input": np.broadcast_to(done.input, done.status.shape).ravel(),
            "status": done.status.ravel(),
        }
        for order, points in views(done.out, self.plan).items():
            for name, values in points.items():
                for axis, own in zip(_columns(order, name), np.moveaxis(values, 2, 0), strict=True):
                    columns[axis] = np.ascontiguousarray(own).ravel()
        about = {
            "fingerprint": self.mark,
            "block": self.size,
            "number": number,
            "general": done.general,
            "sent": done.sent,
            "said": done.said,
            "outcomes": [each.value for each in Outcome],
        }
        content, table = BytesIO(), pa.table(columns).replace_schema_metadata({"planar": json.dumps(about)})
        parquet.write_table(table, content, write_page_checksum=True)
        with writing(self.path):
            self._sum(number).unlink(missing_ok=True)
            write_whole(self._file(number), content.getvalue())
            write_whole(self._sum(number), self._summed(number, sha256(content.getbuffer()).hexdigest()))
        self.told[number] = done.general, done.sent, done.said

    def read(self, columns: tuple[str, ...]) -> list[Array]:
        """Columns of all blocks, each (designs, steps + 1). Raises BadInput."""
        found = [self._block(number, columns) for number in range(self.plan.blocks)]
        return [np.concatenate(each) for each in zip(*found, strict=True)]

    def _block(self, number: int, columns: tuple[str, ...]) -> list[Array]:
        part = slice(number * self.size, min((number + 1) * self.size, self.plan.many))
        shape = part.stop - part.start, self.plan.whole.steps + 1
        try:
            self._look_at(number)
            table = parquet.read_table(self._file(number), columns=list(columns), page_checksum_verification=True)
            return [table[name].to_numpy().reshape(shape) for name in columns]
        except (*UNREADABLE, BadInput):
            raise damaged(self.path, number, part) from None

    def result(self) -> Sweep:
        found = {order: _Read(self, order) for order in self.plan.orders}
        status, inputs = self.read(("status", "input"))
        return self.sweep(found, status, inputs[0] if np.all(inputs == inputs[0]) else inputs)


class _Read(Mapping[str, Any]):
    """One quantity of all points, read from Parquet files when it is asked for."""

    def __init__(self, of: Store, order: str):
        self.of, self.order = of, order

    def __getitem__(self, name: str) -> Array:
        if name not in self.of.plan.whole.points:
            raise KeyError(name)
        return np.stack(self.of.read(_columns(self.order, name)), axis=2)

    def __iter__(self) -> Iterator[str]:
        return iter(self.of.plan.whole.points)

    def __len__(self) -> int:
        return len(self.of.plan.whole.points)


def _columns(order: str, point: str) -> tuple[str, str]:
    letter, unit = LETTERS[order]
    return f"{point} {letter}x [{unit}]", f"{point} {letter}y [{unit}]"
