"""The parts of this benchmark: of each what is measured, one result after the other, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from benchmarks.synthesis import (
    dwells,
    family_tasks,
    four_bar_data,
    functions,
    lifting,
    published_curves,
    pylinkage_beside,
    random_tasks,
    six_bar_curves,
    straight_lines,
)

Record = dict[str, Any]
Measurement = tuple[str, Callable[[], Record]]
"""A result's name, and what gives its values."""


class Wish(NamedTuple):
    """What of the parts is wanted: how many random tasks, and of which kinds."""

    count: int = 200
    kinds: tuple[str, ...] = tuple(random_tasks.KINDS)


def _published() -> Iterator[Measurement]:
    if not four_bar_data.is_there():
        return
    for name, places, closed, parameters in published_curves.targets():
        yield (
            name,
            lambda given=(name, places, closed, parameters): published_curves.measure(*given)._asdict(),
        )


def _shapes() -> Iterator[Measurement]:
    for structure in six_bar_curves.STRUCTURES:
        for target in six_bar_curves.targets():
            yield (
                f"{target.name}, {structure}",
                lambda given=(target, structure): six_bar_curves.measure(*given)._asdict(),
            )


def _random(wish: Wish) -> Iterator[Measurement]:
    for k in range(wish.count):
        kind, seed = wish.kinds[k % len(wish.kinds)], k // len(wish.kinds)
        yield f"{kind} {seed}", lambda given=(kind, seed): random_tasks.measure(*given)


def _functions() -> Iterator[Measurement]:
    for each in functions.FUNCTIONS:
        yield each.name, lambda each=each: functions.measure(each)._asdict()


def _lifting() -> Iterator[Measurement]:
    for each in lifting.lifts():
        yield each.name, lambda each=each: lifting.measure(each)._asdict()


def _dwells() -> Iterator[Measurement]:
    yield "arc with a dyad", lambda: dwells.measure_arc()._asdict()
    for mechanism, output in dwells.function_starts():
        name = f"{mechanism.name}, from {mechanism.inputs[0].pair} to {output}"
        yield name, lambda given=(mechanism, output): dwells.measure_function(*given)._asdict()


def _lines() -> Iterator[Measurement]:
    for name in straight_lines.FAMOUS:
        yield name, lambda name=name: straight_lines.measure(name)._asdict()


def _beside() -> Iterator[Measurement]:
    for name in pylinkage_beside.TASKS:
        yield f"{name}, planar", lambda name=name: pylinkage_beside.by_planar(name)._asdict()
        if pylinkage_beside.is_there():
            yield f"{name}, pylinkage", lambda name=name: pylinkage_beside.by_pylinkage(name)._asdict()


def _families(wish: Wish) -> Iterator[Measurement]:
    for seed in range(wish.count):
        yield f"family {seed}", lambda seed=seed: family_tasks.measure(seed)


PARTS: dict[str, Callable[[], Iterator[Measurement]] | None] = {
    "published": _published,
    "curves": _shapes,
    "random": None,
    "functions": _functions,
    "lifting": _lifting,
    "dwells": _dwells,
    "lines": _lines,
    "beside": _beside,
    "families": None,
}
"""In the order of the page; none where what is measured depends on what is wanted."""


def measurements(part: str, wish: Wish) -> Iterator[Measurement]:
    """What is measured of a part."""
    of_part = PARTS[part]
    if of_part is None:
        return _families(wish) if part == "families" else _random(wish)
    return of_part()
