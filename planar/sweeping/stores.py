"""Where the blocks of a sweep go: arrays in memory, a Zarr group, or a folder of Parquet files."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np

from planar.errors import BadInput, Outcome
from planar.files import to_dict
from planar.native.room import room
from planar.sweeping.block import Block, Done
from planar.sweeping.result import Sweep

Array = np.ndarray

MOST = 16 * 2**30
"""Bytes of results that are kept in memory."""
ORDERS = ("position", "velocity", "acceleration")
LETTERS = {"position": ("", "m"), "velocity": ("v", "m/s"), "acceleration": ("a", "m/s^2")}


class Plan(NamedTuple):
    """A sweep as one block of all its designs, and how many of them are solved together."""

    whole: Block
    size: int

    @property
    def many(self) -> int:
        """How many designs there are."""
        return len(next(iter(self.whole.designs.values())))

    @property
    def orders(self) -> tuple[str, ...]:
        """What is told of every point."""
        return ORDERS if self.whole.rates else ORDERS[:1]

    def fingerprint(self) -> str:
        """The same for two sweeps that have the same results."""
        whole, made = self.whole, hashlib.sha256()
        grid = [whole.steps, whole.points, whole.rates, whole.start, whole.stop, whole.pair]
        made.update(json.dumps([to_dict(whole.mechanism), grid], sort_keys=True, default=float).encode())
        for name, values in sorted(whole.designs.items()):
            made.update(name.encode() + b"\0" + np.ascontiguousarray(values).tobytes())
        return made.hexdigest()


class Sink(ABC):
    """Takes solved blocks, each by its number, and makes of them the result of the sweep."""

    def __init__(self, plan: Plan):
        self.plan, self.size = plan, plan.size
        self.finished: set[int] = set()
        self.told: dict[int, tuple[int, int, Any]] = {}
        "of every block: positions and designs of the general path, and what is said"

    def room(self, part: slice) -> Array | None:
        """Where a block may put its results, if that is known ahead: out (steps + 1, rows, designs)."""
        return None

    @abstractmethod
    def take(self, number: int, part: slice, done: Done) -> None:
        """A solved block, of these designs."""

    @abstractmethod
    def result(self) -> Sweep:
        """The sweep, once all blocks are there."""

    def said(self) -> tuple[str, ...]:
        """What there is to say, in the order of the designs, whichever block was solved first."""
        many, outcomes = self.plan.many, list(Outcome)
        blocks = [each for _, each in sorted(self.told.items())]
        ended: dict[int, tuple[int, str]] = {}
        for _, _, said in blocks:
            for code, count, sentence in said:
                before, first = ended.get(code, (0, sentence))
                ended[code] = before + count, first
        found = []
        sent = sum(each[1] for each in blocks)
        if sent:
            told = f"{sent} of {many} designs went to the general path, which solved {self.general} positions"
            found.append(told)
        found += [
            f"{count} of {many} designs: {outcomes[code].value} (the first: {sentence})"
            for code, (count, sentence) in sorted(ended.items())
        ]
        return tuple(found)

    @property
    def general(self) -> int:
        """How many positions the general path solved."""
        return sum(each[0] for each in self.told.values())

    def sweep(self, found: Mapping[str, Mapping[str, Any]], status: Any, input_: Array) -> Sweep:
        """The result out of arrays by order and point."""
        plan = self.plan
        position, velocity, acceleration = (found.get(order) for order in ORDERS)
        assert position is not None
        return Sweep(
            plan.whole.points,
            plan.whole.designs,
            position,
            velocity,
            acceleration,
            status,
            input_,
            self.general,
            self.said(),
        )


def sink(store: str | Path | None, plan: Plan) -> Sink:
    """Where a sweep's results go. Raises BadInput."""
    if store is None:
        return _Memory(plan)
    path = Path(store)
    kinds = {".zarr": (_Zarr, "zarr", "sweep"), ".parquet": (_Parquet, "pyarrow", "parquet")}
    if path.suffix not in kinds:
        raise BadInput("store", f"a store ends in {' or '.join(kinds)}, unlike {str(store)[:80]!r}")
    kind, library, extra = kinds[path.suffix]
    try:
        import_module(library)
    except ImportError:
        raise BadInput("store", f"a {path.suffix} store needs {library}: pip install 'planar[{extra}]'") from None
    return kind(plan, path)


class _Memory(Sink):
    def __init__(self, plan: Plan):
        super().__init__(plan)
        self.wide = 2 * len(plan.whole.points) * len(plan.orders)
        self.shape = plan.whole.steps + 1, self.wide, plan.many
        if np.prod(self.shape, dtype=float) * 8.0 > MOST:
            told = f"results of {np.prod(self.shape, dtype=float) * 8e-9:.0f} GB are too much for memory"
            raise BadInput("store", f"{told}; name a store, as 'sweep.zarr'")
        self.out = room(*self.shape)
        self.status = np.zeros((plan.many, plan.whole.steps + 1), dtype=np.int8)
        self.inputs: Array | None = None

    def room(self, part: slice) -> Array:
        return self.out[:, :, part]

    def take(self, number: int, part: slice, done: Done) -> None:
        own = self.room(part)
        if not np.shares_memory(own, done.out, max_work=1):
            own[:] = done.out
        self.status[part] = done.status
        self.inputs = _joined(self.inputs, done.input, part, self.plan)
        self.told[number] = done.general, done.sent, done.said

    def result(self) -> Sweep:
        assert self.inputs is not None
        return self.sweep(_views(self.out, self.plan), self.status, self.inputs)


def _views(out: Array, plan: Plan) -> dict[str, dict[str, Array]]:
    """out (steps + 1, rows, designs) as arrays (designs, steps + 1, 2) by order and point, without a copy."""
    turned = out.transpose(2, 0, 1)
    many = len(plan.whole.points)
    return {
        order: {
            name: turned[:, :, 2 * (k * many + place) : 2 * (k * many + place) + 2]
            for place, name in enumerate(plan.whole.points)
        }
        for k, order in enumerate(plan.orders)
    }


def _joined(whole: Array | None, own: Array, part: slice, plan: Plan) -> Array:
    """The positions of the running input with those of a block; one row as long as all blocks agree."""
    if own.ndim == 1 and (whole is None or (whole.ndim == 1 and np.array_equal(whole, own))):
        return own
    if whole is None or whole.ndim == 1:
        row = np.full(plan.whole.steps + 1, np.nan) if whole is None else whole
        whole = np.tile(row, (plan.many, 1))
    whole[part] = own
    return whole


class _Zarr(Sink):
    def __init__(self, plan: Plan, path: Path):
        super().__init__(plan)
        import zarr

        self.path, mark = path, plan.fingerprint()
        if path.exists():
            try:
                self.group = zarr.open_group(str(path), mode="r+")
                same = self.group.attrs.get("fingerprint") == mark
            except (FileNotFoundError, ValueError):
                same = False
            if not same:
                raise _another(path)
            self.size = int(self.group.attrs["block"])  # type: ignore[arg-type]
            general = self.group["blocks"][:]
            self.finished = {int(k) for k in np.flatnonzero(general[:, 0] >= 0)}
            for k in self.finished:
                self.told[k] = (*map(int, general[k]), self.group.attrs.get(f"said {k}", ()))  # type: ignore[assignment]
            return
        self.group = group = zarr.open_group(str(path), mode="w")
        rows, steps = plan.size, plan.whole.steps + 1
        for order in plan.orders:
            for name in plan.whole.points:
                self._add(f"{order}/{_plain(name)}", (plan.many, steps, 2), (rows, steps, 2), float, "axis")
        self._add("status", (plan.many, steps), (rows, steps), np.int8)
        self._add("input", (plan.many, steps), (rows, steps), float)
        blocks = -(-plan.many // rows)
        group.create_array("blocks", shape=(blocks, 2), chunks=(1, 2), dtype="int64", fill_value=-1)
        for name, values in plan.whole.designs.items():
            group.create_array(
                f"designs/{_plain(name)}", data=np.ascontiguousarray(values), dimension_names=("design",)
            )
        group.attrs.update(
            {"mechanism": to_dict(plan.whole.mechanism), "points": list(plan.whole.points), "block": rows}
        )
        group.attrs["outcomes"] = [each.value for each in Outcome]
        group.attrs["fingerprint"] = mark  # last: a store without it was not begun

    def _add(self, name: str, shape: tuple, chunks: tuple, kind: Any, *axes: str) -> None:
        fill = np.nan if kind is float else 0
        names = ("design", "step", *axes)
        self.group.create_array(name, shape=shape, chunks=chunks, dtype=kind, fill_value=fill, dimension_names=names)

    def take(self, number: int, part: slice, done: Done) -> None:
        for order, points in _views(done.out, self.plan).items():
            for name, values in points.items():
                self.group[f"{order}/{_plain(name)}"][part] = np.ascontiguousarray(values)
        self.group["status"][part] = done.status
        self.group["input"][part] = np.broadcast_to(done.input, done.status.shape)
        if done.said:
            self.group.attrs[f"said {number}"] = [list(each) for each in done.said]
        self.group["blocks"][number] = [done.general, done.sent]
        self.told[number] = done.general, done.sent, done.said

    def result(self) -> Sweep:
        group = self.group
        found = {
            order: {name: group[f"{order}/{_plain(name)}"] for name in self.plan.whole.points}
            for order in self.plan.orders
        }
        return self.sweep(found, group["status"], _one_row(group["input"], self.size))


def _one_row(stored: Any, size: int) -> Array:
    """Positions of the input, as one row where all designs have the same; looked at block by block."""
    first = stored[0]
    blocks = range(0, stored.shape[0], size)
    if all(np.array_equal(np.broadcast_to(first, (p := stored[k : k + size]).shape), p) for k in blocks):
        return first
    return stored


class _Parquet(Sink):
    """One file for each block, a row for each design and step."""

    def __init__(self, plan: Plan, path: Path):
        super().__init__(plan)
        self.path, self.mark = path, plan.fingerprint()
        path.mkdir(parents=True, exist_ok=True)
        if not path.is_dir():
            raise BadInput("store", f"{path} is no folder")
        for file in sorted(path.glob("part-*.parquet")):
            about = self._about(file)
            if about.get("fingerprint") != self.mark:
                raise _another(path)
            self.size = about["block"]
            self.finished.add(about["number"])
            self.told[about["number"]] = about["general"], about["sent"], about["said"]

    @staticmethod
    def _about(file: Path) -> dict[str, Any]:
        from pyarrow import parquet

        return json.loads((parquet.read_schema(file).metadata or {}).get(b"planar", b"{}"))

    def _file(self, number: int) -> Path:
        return self.path / f"part-{number:06d}.parquet"

    def take(self, number: int, part: slice, done: Done) -> None:
        import pyarrow as pa
        from pyarrow import parquet

        designs, steps = done.status.shape
        columns: dict[str, Array] = {
            "design": np.repeat(np.arange(part.start, part.stop), steps),
            "step": np.tile(np.arange(steps, dtype=np.int32), designs),
            **{name: np.repeat(values[part], steps) for name, values in self.plan.whole.designs.items()},
            "input": np.broadcast_to(done.input, done.status.shape).ravel(),
            "status": done.status.ravel(),
        }
        for order, points in _views(done.out, self.plan).items():
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
        table = pa.table(columns).replace_schema_metadata({"planar": json.dumps(about)})
        # a name that readers of the folder pass over, until the file is whole
        rough = self.path / f".part-{number:06d}"
        parquet.write_table(table, rough)
        rough.replace(self._file(number))
        self.told[number] = done.general, done.sent, done.said

    def _read(self, columns: tuple[str, ...]) -> list[Array]:
        """Columns of all blocks, each (designs, steps + 1)."""
        from pyarrow import parquet

        blocks = range(-(-self.plan.many // self.size))
        tables = [parquet.read_table(self._file(k), columns=list(columns)) for k in blocks]
        return [
            np.concatenate([table[name].to_numpy() for table in tables]).reshape(-1, self.plan.whole.steps + 1)
            for name in columns
        ]

    def result(self) -> Sweep:
        found = {order: _Read(self, order) for order in self.plan.orders}
        status, inputs = self._read(("status", "input"))
        return self.sweep(found, status, inputs[0] if np.all(inputs == inputs[0]) else inputs)


class _Read(Mapping[str, Any]):
    """One quantity of all points, read from Parquet files when it is asked for."""

    def __init__(self, of: _Parquet, order: str):
        self.of, self.order = of, order

    def __getitem__(self, name: str) -> Array:
        if name not in self.of.plan.whole.points:
            raise KeyError(name)
        return np.stack(self.of._read(_columns(self.order, name)), axis=2)

    def __iter__(self) -> Iterator[str]:
        return iter(self.of.plan.whole.points)

    @cached_property
    def _many(self) -> int:
        return len(self.of.plan.whole.points)

    def __len__(self) -> int:
        return self._many


def _columns(order: str, point: str) -> tuple[str, str]:
    letter, unit = LETTERS[order]
    return f"{point} {letter}x [{unit}]", f"{point} {letter}y [{unit}]"


def _plain(name: str) -> str:
    """A name that a path can have."""
    return quote(name, safe=" ")


def _another(path: Path) -> BadInput:
    return BadInput("store", f"{path} holds something else than this sweep; name another store, or take it away first")
