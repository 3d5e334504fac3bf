"""The mechanisms of a sweep, read and checked part by part, and the messages about them."""

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
"""Number of mechanisms that a thread or an executor solves together."""


class PartRuns(NamedTuple):
    """Where parts are solved, the type of their numbers, and the function that is called with the progress."""

    threads: int
    executor: Executor | None
    dtype: str
    progress: Callable[[int, int], object] | None

    def report(self, done: int, count: int) -> None:
        """Report how many of how many mechanisms are done."""
        report_progress(done, count)
        if self.progress is not None:
            self.progress(done, count)


def iterate_sources(sources: Iterable[T]) -> Iterator[T]:
    """Iterate over mechanisms. Raises BadInput if they are no list, or the like."""
    if isinstance(sources, str | PathLike | Mechanism) or not isinstance(sources, Iterable):
        raise BadInput("mechanisms", f"a list of mechanisms is wanted, not {type(sources).__name__} {sources!r:.40}")
    return iter(sources)


def read_mechanisms(sources: Iterable[MechanismSource | PinnedLinkages], first: int = 0) -> list[Mechanism]:
    """Read mechanisms, each file or model once; `first` is the number of the first one. Raises BadInput."""
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
    """Raise BadInput for a mechanism without an input that runs; `first` is the number of the first one."""
    for k, mechanism in enumerate(mechanisms, first):
        if pair is not None or not isinstance(mechanism, PinnedMechanism) or mechanism.layout is None:
            running_input_index(mechanism, pair, f"mechanisms[{k}]")


def stream_parts(
    sources: Iterable[MechanismSource | PinnedLinkages], pair: str | None
) -> Iterator[list[Mechanism] | PinnedLinkages]:
    """Yield mechanisms part by part, read when they are needed."""
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
        read = read_mechanisms(source if isinstance(source, PinnedLinkages) else [source], done + len(waiting))
        check_inputs(read, pair, done + len(waiting))
        waiting += read
        if len(waiting) >= PART_SIZE:
            yield waiting
            done, waiting = done + len(waiting), []
    if waiting:
        yield waiting


def find_endings(part: SweptPart) -> tuple[tuple[int, int, str], ...]:
    """The number of each outcome, how many mechanisms it ends, and the reason of the first of them; for solved ones how
    many lack rates, or digits of them."""
    status = part.last_status
    counts = np.bincount(status)
    first_ones = sorted((int(np.argmax(status == code)), code) for code in np.flatnonzero(counts).tolist() if code)
    endings = [(code, int(counts[code]), part.reason(first)) for first, code in first_ones]
    without_rates = [swept.reason for swept in part.general.values() if swept.reason and not swept.status.any()]
    return (*endings, *([(0, len(without_rates), without_rates[0])] if without_rates else []))


def end_message(done: int, reason: str) -> tuple[str, ...]:
    """That a sweep ended early after so many mechanisms, for a reason; nothing without one."""
    return (f"{reason} after {count_phrase(done, 'mechanism')}: the others are left out",) if reason else ()


def part_messages(endings: Iterable[Iterable[tuple[int, int, str]]], count: int, general: int) -> tuple[str, ...]:
    """The messages about `count` mechanisms, of which the general path solved `general`, by the endings of all
    parts."""
    messages = []
    if general:
        messages.append(f"the general path solved {general} of {count_phrase(count, 'mechanism')}, one after the other")
    totals: dict[int, tuple[int, str]] = {}
    for code, part_count, reason in (ending for part in endings for ending in part):
        previous, first_reason = totals.get(code, (0, ""))
        totals[code] = previous + part_count, first_reason or reason
    without_rates = totals.pop(0, None)
    messages += [
        f"{count_phrase(ended, 'mechanism')}: {OUTCOMES[code].value}; {reason}"
        for code, (ended, reason) in totals.items()
    ]
    if without_rates:
        ended, reason = without_rates
        messages.append(f"{count_phrase(ended, 'mechanism')}: rates are missing or have few digits; {reason}")
    return tuple(messages)
