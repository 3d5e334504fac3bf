"""A data set of random linkages in a Zarr group, made block by block: begun, gone on with, read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple, overload

import numpy as np

from planar.batch.executor import run_tasks, thread_count
from planar.batch.stores.store import is_folder_begun, reporting_write_errors
from planar.foundation.errors import BadInput
from planar.foundation.time_limit import report_progress, stop_if_over, stops_in_time
from planar.model.mechanism import Mechanism
from planar.model.pin_linkage import pinned
from planar.model.run_arguments import check_steps, check_whole_number
from planar.structures.random_linkages import SolvedLinkages, random_linkages, structures

BLOCK_SIZE = 500
"""Linkages that are drawn from one seed, and written at once."""
MAX_LINKS = 12
VERSION = 1
"""Of what stands in a data set."""
READ_ERRORS = (OSError, RuntimeError, ValueError, KeyError, TypeError)
"""What Zarr and its codecs raise of damaged files."""


class DataSetPlan(NamedTuple):
    """What a data set holds: the same plan makes the same linkages."""

    links: int
    linkages: int
    steps: int
    seed: int

    @property
    def block_count(self) -> int:
        """How many blocks there are."""
        return -(-self.linkages // BLOCK_SIZE)

    def part(self, block: int) -> slice:
        """The linkages of a block."""
        return slice(block * BLOCK_SIZE, min((block + 1) * BLOCK_SIZE, self.linkages))

    def size(self, block: int) -> int:
        """How many linkages a block has."""
        return min(BLOCK_SIZE, self.linkages - block * BLOCK_SIZE)


@stops_in_time
def generate(  # many: the public signature
    store: str | Path,
    links: int = 8,
    count: int = 1000,
    *,
    steps: int = 100,
    seed: int = 0,
    workers: int | None = None,
    executor: Executor | None = None,
    progress: Callable[[int, int], object] | None = None,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> LinkageSet:
    """A data set of random linkages of one degree of freedom, all structures alike, each with a crank that turns fully.

    Structures are the chains of so many links, from 4 to 12, with every fixed link and driven joint that differ (see
    `planar.chains`), so that triads and larger groups are among them as often as there are. Of each linkage the joints
    stand at random in a square, and what is driven is made shorter by a random part, until compiled code is sure of a
    whole turn; one link that has no fixed pivot, where there is one, bears a coupler point.

    `store` is a folder ending in .zarr, which is written block by block. What is there already is kept: the same call
    goes on where it was interrupted. The same numbers and `seed` give the same linkages, in `workers` threads or by an
    `executor` of concurrent.futures' kind; `progress` is called with how many there are, and how many there will be.
    Raises BadInput where the folder holds something else, and where Zarr is missing; NoAnswer after `timeout` s or a
    Ctrl-C, with the outcome "interrupted": the same call goes on.

    >>> import tempfile, planar
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     print(planar.generate(f"{folder}/four-bars.zarr", links=4, count=10, steps=12)[3])
    <Mechanism 'Linkage 3: chain 0 of 4 links, link 0 fixed, joint 0 driven': 4 links, 4 pairs, driven at P0>
    """
    check_whole_number("links", links, 4, MAX_LINKS)
    check_whole_number("count", count, 1)
    check_whole_number("seed", seed, 0)
    if links % 2:
        raise BadInput("links", f"linkages of one degree of freedom have an even number of links, not {links}")
    check_steps(steps)
    threads = thread_count(workers, executor)
    plan = DataSetPlan(int(links), int(count), int(steps), int(seed))
    made = LinkageSet(_open_group(Path(store), plan), plan, Path(store))
    left = [block for block in range(plan.block_count) if not made.has_block(block)]
    done = plan.linkages - sum(map(plan.size, left))
    if progress:
        progress(done, plan.linkages)
    for block, linkages in run_tasks(
        threads, executor, solve_block, ((block, (plan, block)) for block in left), lambda _, task: solve_block(task)
    ):
        made.write_block(block, linkages)
        done += plan.size(block)
        report_progress(done, plan.linkages)
        if progress:
            progress(done, plan.linkages)
    if done < plan.linkages:
        stop_if_over(f"after {done} of {plan.linkages} linkages", "the same call goes on from there")
    return made


def solve_block(task: tuple[DataSetPlan, int]) -> SolvedLinkages:
    """The linkages of a block, by a plan and the block's number."""
    plan, block = task
    return random_linkages(plan.links, plan.size(block), plan.steps, (plan.seed, plan.links, block))


class LinkageSet(Sequence[Mechanism]):
    """A data set of linkages: one of them, by its number, is a mechanism.

    `chain_number`, `frame` and `drive` (linkages,) are numbers of `planar.chains(links)` and of links and joints there;
    `start` (linkages, pins, 2) is where the joints stand, in their order, and behind them a coupler point on link
    `coupler_link`; `path` (linkages, steps + 1, pins, 2) all their places over a turn of the crank, in single
    precision. Lengths have no unit: joints lie in a square of side 2 about. Arrays are read from the folder as they are
    indexed.
    """

    def __init__(self, group: Any, plan: DataSetPlan, folder: Path):
        self._group, self._plan, self.folder = group, plan, folder

    def __repr__(self) -> str:
        plan = self._plan
        return f"<LinkageSet of {plan.linkages} linkages of {plan.links} links at {plan.steps + 1} positions>"

    def __len__(self) -> int:
        return self._plan.linkages

    @property
    def links(self) -> int:
        """How many links each linkage has, the fixed one among them."""
        return self._plan.links

    @property
    def chain_number(self) -> Any:
        """(linkages,)"""
        return self._group["chain_number"]

    @property
    def frame(self) -> Any:
        """(linkages,)"""
        return self._group["frame"]

    @property
    def drive(self) -> Any:
        """(linkages,)"""
        return self._group["drive"]

    @property
    def coupler_link(self) -> Any:
        """(linkages,)"""
        return self._group["coupler_link"]

    @property
    def start(self) -> Any:
        """(linkages, pins, 2)"""
        return self._group["start"]

    @property
    def path(self) -> Any:
        """(linkages, steps + 1, pins, 2)"""
        return self._group["path"]

    @overload
    def __getitem__(self, index: int) -> Mechanism: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Mechanism, ...]: ...
    def __getitem__(self, index: int | slice) -> Mechanism | tuple[Mechanism, ...]:
        if isinstance(index, slice):
            return tuple(self[k] for k in range(*index.indices(len(self))))
        row = range(len(self))[index]
        chain, frame, drive = (int(each[row]) for each in (self.chain_number, self.frame, self.drive))
        linkage = next(
            each.linkage
            for each in structures(self.links)
            if (each.chain, each.linkage.frame, each.linkage.drives[0]) == (chain, frame, drive)
        )
        places, coupler = np.asarray(self.start[row]), int(self.coupler_link[row])
        moving = [link for link in range(self.links) if link != frame]
        bars = [linkage.joints_of(link) + [len(linkage.joints)] * (link == coupler) for link in moving]
        crank = moving.index(linkage.driven_link(0))
        name = f"Linkage {row}: chain {chain} of {self.links} links, link {frame} fixed, joint {drive} driven"
        return pinned(places, bars, linkage.joints_of(frame), crank, name=name)

    def __iter__(self) -> Iterator[Mechanism]:
        return (self[k] for k in range(len(self)))

    def has_block(self, block: int) -> bool:
        """Whether a block was written whole, and can be read."""
        part = self._plan.part(block)
        try:
            return bool(self._group["blocks"][block]) and all(
                self._group[name][part] is not None for name in SolvedLinkages._fields if name != "structure"
            )
        except READ_ERRORS:
            return False

    def write_block(self, block: int, linkages: SolvedLinkages) -> None:
        """Write a block, and last that it is whole."""
        part, known = self._plan.part(block), structures(self.links)
        found = [known[k] for k in linkages.structure]
        with reporting_write_errors(self.folder):
            self._group["chain_number"][part] = [each.chain for each in found]
            self._group["frame"][part] = [each.linkage.frame for each in found]
            self._group["drive"][part] = [each.linkage.drives[0] for each in found]
            self._group["coupler_link"][part] = linkages.coupler_link
            self._group["start"][part] = linkages.start
            self._group["path"][part] = linkages.path.astype(np.float32)
            self._group["blocks"][block] = 1


def _open_group(folder: Path, plan: DataSetPlan) -> Any:
    """The group of a data set, made where there is none. Raises BadInput."""
    if folder.suffix != ".zarr":
        raise BadInput("store", f"a data set is a folder that ends in .zarr, unlike {str(folder)[:80]!r}")
    try:
        import zarr
        from zarr.codecs import Crc32cCodec, ZstdCodec
    except ImportError:
        raise BadInput("store", 'a data set needs zarr: pip install "planar-linkages[sweep]"') from None
    about = {"version": VERSION, **plan._asdict(), "block": BLOCK_SIZE}
    if is_folder_begun(folder):
        try:
            group = zarr.open_group(str(folder), mode="r+")
            own = {key: group.attrs.get(key) for key in about}
        except READ_ERRORS:
            own = {}
        if own != about:
            told = f"{folder} holds something else than this data set"
            raise BadInput("store", f"{told}; name another folder, or take it away first")
        return group
    first = structures(plan.links)[0].linkage
    pins = len(first.joints) + 1
    chains = {str(each.chain): each.linkage.joints for each in structures(plan.links)}
    shapes: dict[str, tuple[tuple[int, ...], str]] = {
        **dict.fromkeys(("chain_number", "frame", "drive", "coupler_link"), ((), "int32")),
        "start": ((pins, 2), "float64"),
        "path": ((plan.steps + 1, pins, 2), "float32"),
    }
    with reporting_write_errors(folder):
        group = zarr.create_group(str(folder), attributes={**about, "joints": list(chains.values())})
        for name, (shape, dtype) in shapes.items():
            group.create_array(
                name,
                shape=(plan.linkages, *shape),
                chunks=(BLOCK_SIZE, *shape),
                dtype=dtype,
                compressors=(ZstdCodec(), Crc32cCodec()),
            )
        group.create_array("blocks", shape=(plan.block_count,), chunks=(1,), dtype="uint8")
    return group
