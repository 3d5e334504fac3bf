"""A sweep's blocks in a Zarr group: every chunk with a checksum, every block with a record that it is whole."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec

from planar.batch.block import Done
from planar.batch.results import Sweep
from planar.batch.stores.store import Plan, Sink, another, begun, damaged, views, writing
from planar.document.files import to_dict
from planar.foundation.errors import Outcome

Array = np.ndarray

RECORD = 32_768
"""Bytes of a block's record: a sentence for each outcome, as JSON."""
UNREADABLE = (OSError, RuntimeError, ValueError, KeyError, TypeError)
"""What Zarr and its codecs raise of damaged files."""
MISSING = -1
"""The status of what is not there: none that a design can have."""


class Store(Sink):
    """See the module. A block is whole once its record, written last, and all its chunks can be read."""

    def __init__(self, plan: Plan, path: Path):
        super().__init__(plan)
        self.path, mark = path, plan.fingerprint()
        if begun(path):
            try:
                self.group = zarr.open_group(str(path), mode="r+")
                about = dict(self.group.attrs)
            except UNREADABLE:
                about = {}
            size = about.get("block")
            if about.get("fingerprint") != mark or not isinstance(size, int) or size < 1:
                raise another(path)
            self.size = size
            self.plan = plan = plan._replace(size=self.size)
        else:
            # written at once: a store is this sweep's from its first moment
            about = {
                "fingerprint": mark,
                "mechanism": to_dict(plan.whole.mechanism),
                "points": list(plan.whole.points),
                "block": self.size,
                "outcomes": [each.value for each in Outcome],
            }
            with writing(path):
                self.group = zarr.create_group(str(path), attributes=about)
        with writing(path), zarr.config.set({"array.write_empty_chunks": True}):  # a chunk that is not there is lost
            self.arrays = dict(self._arrays())
        for number in range(plan.blocks):
            self._look_at(number)

    def _arrays(self) -> Iterator[tuple[str, Any]]:
        """All arrays by name, those made that are not there or not as they have to be."""
        plan, rows, steps = self.plan, self.size, self.plan.whole.steps + 1
        row = {"shape": (plan.many, steps), "chunks": (rows, steps), "dimension_names": ("design", "step")}
        point = {"shape": (plan.many, steps, 2), "chunks": (rows, steps, 2)}
        point["dimension_names"] = ("design", "step", "axis")
        for order in plan.orders:
            for name in plan.whole.points:
                yield self._array(f"{order}/{_plain(name)}", dtype="float64", fill_value=np.nan, **point)
        yield self._array("status", dtype="int8", fill_value=MISSING, **row)
        yield self._array("input", dtype="float64", fill_value=np.nan, **row)
        records = {"shape": (plan.blocks, RECORD), "chunks": (1, RECORD)}
        yield self._array("blocks", dtype="uint8", fill_value=0, **records)
        for name, values in plan.whole.designs.items():
            of_designs = {"shape": values.shape, "chunks": values.shape, "dimension_names": ("design",)}
            key, array = self._array(
                f"designs/{_plain(name)}", dtype=str(values.dtype), fill_value=values.dtype.type(0), **of_designs
            )
            if not self._holds(array, values):
                array[:] = values
            yield key, array

    @staticmethod
    def _holds(array: Any, values: Array) -> bool:
        try:
            return np.array_equal(array[:], values)
        except UNREADABLE:
            return False

    def _array(self, name: str, **wanted: Any) -> tuple[str, Any]:
        wanted["compressors"] = (ZstdCodec(), Crc32cCodec())
        try:
            there = self.group[name]
            as_wanted = zarr.create_array(zarr.storage.MemoryStore(), **wanted).metadata
            if isinstance(there, zarr.Array) and _same(there.metadata, as_wanted):
                return name, there
        except UNREADABLE:
            pass
        return name, self.group.create_array(name, overwrite=True, **wanted)

    def _look_at(self, number: int) -> None:
        """Take a block as finished that is whole."""
        record = self._record(number)
        if record is not None and all(self.sound(name, number) for name in self.arrays if _of_blocks(name)):
            self.finished.add(number)
            self.told[number] = record

    def _record(self, number: int) -> tuple[int, int, Any] | None:
        try:
            text = bytes(self.arrays["blocks"][number]).rstrip(b"\0")
            general, sent, said = json.loads(text) if text else (None, None, None)
        except UNREADABLE:
            return None
        return None if general is None else (int(general), int(sent), [tuple(each) for each in said])

    def there(self, name: str, number: int) -> bool:
        """Whether a block's chunk of an array is there."""
        return self.path.joinpath(name, "c", str(number), *("0",) * (self.arrays[name].ndim - 1)).is_file()

    def sound(self, name: str, number: int) -> bool:
        """Whether it is there and has its checksum."""
        try:
            self.arrays[name][self.part(number)]
        except UNREADABLE:
            return False
        return self.there(name, number)

    def part(self, number: int) -> slice:
        """The designs of a block."""
        return slice(number * self.size, min((number + 1) * self.size, self.plan.many))

    def take(self, number: int, part: slice, done: Done) -> None:
        with writing(self.path):
            for order, points in views(done.out, self.plan).items():
                for name, values in points.items():
                    self.arrays[f"{order}/{_plain(name)}"][part] = np.ascontiguousarray(values)
            self.arrays["status"][part] = done.status
            self.arrays["input"][part] = np.broadcast_to(done.input, done.status.shape)
            record = json.dumps([done.general, done.sent, _short(done.said)], ensure_ascii=False).encode()
            self.arrays["blocks"][number] = np.frombuffer(record.ljust(RECORD, b"\0"), dtype=np.uint8)
        self.told[number] = done.general, done.sent, done.said

    def result(self) -> Sweep:
        found = {
            order: {name: Stored(self, f"{order}/{_plain(name)}") for name in self.plan.whole.points}
            for order in self.plan.orders
        }
        return self.sweep(found, Stored(self, "status"), self._input())

    def _input(self) -> Any:
        """Positions of the input, as one row where all designs have the same; looked at block by block."""
        stored = Stored(self, "input")
        first = stored[0]
        for number in range(self.plan.blocks):
            own = stored[self.part(number)]
            if not np.array_equal(np.broadcast_to(first, own.shape), own, equal_nan=True):
                return stored
        return first


class Stored:
    """One of a store's arrays, read when it is indexed; what is missing or damaged there raises BadInput."""

    def __init__(self, store: Store, name: str):
        self._store, self._name, self._array = store, name, store.arrays[name]

    def __getitem__(self, key: Any) -> Any:
        try:
            found = self._array[key]
        except UNREADABLE:
            self._check(self._store.sound)
            raise
        # a chunk that is not there is read as what fills the array
        if np.any(np.isnan(found) if self._array.dtype.kind == "f" else found == MISSING):
            self._check(self._store.there)
        return found

    def _check(self, right: Callable[[str, int], bool]) -> None:
        """Raises BadInput for the first block that is not right."""
        store = self._store
        for number in range(store.plan.blocks):
            if not right(self._name, number):
                raise damaged(store.path, number, store.part(number)) from None

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # none of the array's own, nor of this one before it is made
            raise AttributeError(name)
        return getattr(self._array, name)

    def __len__(self) -> int:
        return self._array.shape[0]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        found = np.asarray(self[...])
        return found if dtype is None else found.astype(dtype)

    def __repr__(self) -> str:
        return repr(self._array)


def _of_blocks(name: str) -> bool:
    """Whether an array is written block by block."""
    return name != "blocks" and not name.startswith("designs/")


def _same(one: Any, other: Any) -> bool:
    """Whether two arrays' metadata say the same; as text, since NaN equals nothing."""
    return repr(one.to_dict()) == repr(other.to_dict())


def _short(said: Any) -> list[Any]:
    """What is said of a block, sentences shortened so that all fit into its record."""
    longest = (RECORD - 512) // (4 * max(1, len(said)))  # a character has four bytes at most
    return [[code, count, sentence[:longest]] for code, count, sentence in said]


def _plain(name: str) -> str:
    """A name that a path can have."""
    return quote(name, safe=" ")
