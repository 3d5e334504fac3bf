"""Where the blocks of a sweep go: what every place for them does, and arrays in memory, which are one."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from planar.batch.block import Block, Done
from planar.batch.results import Sweep
from planar.codegen.aligned_arrays import room
from planar.document.files import PART, to_dict, unwritten
from planar.foundation.errors import BadInput, Outcome

Array = np.ndarray

MOST = 16 * 2**30
"""Bytes of results that are kept in memory."""
ORDERS = ("position", "velocity", "acceleration")
ZARRS_PART = ".partial"
"""Ending of the files that Zarr has not written whole."""
FORM = 2
"""Of what stands in a store; raised where it is no longer that of stores of before."""


class Plan(NamedTuple):
    """A sweep as one block of all its designs, and how many of them are solved together."""

    whole: Block
    size: int

    @property
    def many(self) -> int:
        """How many designs there are."""
        return len(next(iter(self.whole.designs.values())))

    @property
    def blocks(self) -> int:
        """How many blocks there are."""
        return -(-self.many // self.size)

    @property
    def orders(self) -> tuple[str, ...]:
        """What is told of every point."""
        return ORDERS if self.whole.rates else ORDERS[:1]

    def fingerprint(self) -> str:
        """The same for two sweeps that have the same results."""
        whole, made = self.whole, hashlib.sha256()
        grid = [whole.steps, whole.points, whole.rates, whole.start, whole.stop, whole.pair]
        made.update(json.dumps([FORM, to_dict(whole.mechanism), grid], sort_keys=True, default=float).encode())
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
    modules = {".zarr": ("zarr_store", "zarr", "sweep"), ".parquet": ("parquet_store", "pyarrow", "parquet")}
    if path.suffix not in modules:
        raise BadInput("store", f"a store ends in {' or '.join(modules)}, unlike {str(store)[:80]!r}")
    module, library, extra = modules[path.suffix]
    try:
        import_module(library)
    except ImportError:
        raise BadInput("store", f"a {path.suffix} store needs {library}: pip install 'planar[{extra}]'") from None
    return import_module(f"planar.batch.stores.{module}").Store(plan, path)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """What the system refuses of a store is one sentence: BadInput, or NotWritten where there is no room."""
    try:
        yield
    except OSError as problem:
        raise unwritten("store", str(path), problem) from None


def begun(path: Path) -> bool:
    """Whether anything whole stands in the folder of a store, which is made if it is not there. Raises BadInput."""
    with writing(path):
        if path.exists() and not path.is_dir():
            raise BadInput("store", f"{path} is a file, and a store is a folder; name another, or take it away first")
        path.mkdir(parents=True, exist_ok=True)
        return any(not PART.fullmatch(each.name) and each.suffix != ZARRS_PART for each in path.iterdir())


def another(path: Path) -> BadInput:
    """That a folder is not this sweep's to write in."""
    return BadInput("store", f"{path} holds something else than this sweep; name another store, or take it away first")


def damaged(path: Path, number: int, part: slice) -> BadInput:
    """That a block of a store cannot be read."""
    told = f"block {number} of {path} (designs {part.start} to {part.stop - 1}) is missing or damaged"
    return BadInput("store", f"{told}; the same sweep into this store solves it again")


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
        return self.sweep(views(self.out, self.plan), self.status, self.inputs)


def views(out: Array, plan: Plan) -> dict[str, dict[str, Array]]:
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
