"""Mechanisms of any kind some at a time: read, checked, and what there is to say of all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from os import PathLike
from typing import NamedTuple, TypeVar

import numpy as np

from planar.batch.general_path import OUTCOMES
from planar.batch.mechanisms.results import SweptPart
from planar.document.files import as_mechanism
from planar.document.first_argument import MechanismSource
from planar.foundation.errors import BadInput
from planar.foundation.time_limit import report_progress
from planar.model.mechanism import Mechanism, running_input_index
from planar.model.pin_linkage import PinnedMechanism
from planar.model.pin_linkages import PinnedLinkages
from planar.model.wording import count_phrase

T = TypeVar("T")

PART_SIZE = 512
"""Mechanisms that are assembled together, and handed to a thread or an executor."""


class PartRuns(NamedTuple):
    """Where parts are solved, the type that their numbers have, and who is told how far they are."""

    threads: int
    executor: Executor | None
    dtype: str
    progress: Callable[[int, int], object] | None

    def tell(self, done: int, many: int) -> None:
        """So many of so many are done."""
        report_progress(done, many)
        if self.progress is not None:
            self.progress(done, many)


def iterate_sources(sources: Iterable[T]) -> Iterator[T]:
    """One after the other. Raises BadInput where it is no list, or the like."""
    if isinstance(sources, str | PathLike | Mechanism) or not isinstance(sources, Iterable):
        raise BadInput("mechanisms", f"a list of mechanisms is wanted, not {type(sources).__name__} {sources!r:.40}")
    return iter(sources)


def read_mechanisms(sources: Iterable[MechanismSource | PinnedLinkages], first: int = 0) -> list[Mechanism]:
    """The mechanisms, the `first` by its number, each file or model read once. Raises BadInput."""
    read: dict[str | PathLike[str], Mechanism] = {}
    mechanisms = []
    for source in iterate_sources(sources):
        if isinstance(source, Mechanism):
            mechanisms.append(source)
        elif isinstance(source, str | PathLike):
            if source not in read:
                read[source] = as_mechanism(source)
            mechanisms.append(read[source])
        else:
            raise BadInput(f"mechanisms[{first + len(mechanisms)}]", f"a mechanism is wanted, not {source!r:.40}")
    return mechanisms


def check_inputs(mechanisms: Sequence[Mechanism], pair: str | None, first: int = 0) -> None:
    """Raises BadInput for a mechanism without an input that runs, `first` by its number."""
    for k, mechanism in enumerate(mechanisms, first):
        if pair is not None or not isinstance(mechanism, PinnedMechanism) or mechanism.layout is None:
            running_input_index(mechanism, pair, f"mechanisms[{k}]")


def stream_parts(
    sources: Iterable[MechanismSource | PinnedLinkages], pair: str | None
) -> Iterator[list[Mechanism] | PinnedLinkages]:
    """Mechanisms some at a time, read when they are asked for."""
    if isinstance(sources, PinnedLinkages):
        sources = [sources]
    done, waiting = 0, list[Mechanism]()
    for source in iterate_sources(sources):
        if isinstance(source, PinnedLinkages) and pair is None:
            if waiting:
                yield waiting
            yield from (source[k : k + PART_SIZE] for k in range(0, len(source), PART_SIZE))
            done, waiting = done + len(waiting) + len(source), []
            continue
        own = read_mechanisms(source if isinstance(source, PinnedLinkages) else [source], done + len(waiting))
        check_inputs(own, pair, done + len(waiting))
        waiting += own
        if len(waiting) >= PART_SIZE:
            yield waiting
            done, waiting = done + len(waiting), []
    if waiting:
        yield waiting


def find_endings(part: SweptPart) -> tuple[tuple[int, int, str], ...]:
    """By outcome how many mechanisms ended so, and why the first of them did; by that of what is solved how many lack
    rates, or digits of them."""
    status = part.last_status
    codes, first, counts = np.unique(status[status != 0], return_index=True, return_counts=True)
    ended = np.flatnonzero(status)
    endings = [(int(codes[k]), int(counts[k]), part.reason(int(ended[first[k]]))) for k in np.argsort(first)]
    few = [swept for swept in part.general.values() if swept.reason and not swept.status.any()]
    return (*endings, *([(0, len(few), few[0].reason)] if few else []))


def end_message(done: int, reason: str) -> tuple[str, ...]:
    """That a sweep ended early after so many mechanisms, for a reason; nothing without one."""
    return (f"{reason} after {count_phrase(done, 'mechanism')}: the others are left out",) if reason else ()


def part_messages(endings: Iterable[Iterable[tuple[int, int, str]]], many: int, sent: int) -> tuple[str, ...]:
    """What there is to say of so many mechanisms: how many the general path solved, and by the endings of parts how
    many ended before their time, with a reason."""
    told = []
    if sent:
        told.append(f"the general path solved {sent} of {count_phrase(many, 'mechanism')}, one after the other")
    ended: dict[int, tuple[int, str]] = {}
    for code, count, reason in (each for part in endings for each in part):
        before, first = ended.get(code, (0, ""))
        ended[code] = before + count, first or reason
    few = ended.pop(0, None)
    told += [
        f"{count_phrase(count, 'mechanism')}: {OUTCOMES[k].value}; {reason}" for k, (count, reason) in ended.items()
    ]
    if few:
        told.append(f"{count_phrase(few[0], 'mechanism')}: rates are missing or have few digits; {few[1]}")
    return tuple(told)
