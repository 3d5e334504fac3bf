"""Sweeps of wide designs beside the general path, design by design: `python -m benchmarks.truth --count 10000`.

Designs are drawn so widely that about half of them do not go together or stop. Of each the statuses of all positions
have to be those of `planar.cycle`, and the numbers its numbers, to what rounding makes of them: a hundred times what
moves when the dimensions move by rounding. Where the general path itself answers otherwise for dimensions that differ
by a billionth, the design is undecided and counted apart. Each difference is printed with what repeats it.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

import planar
from benchmarks.swept import Stephenson, SweptFourBar, SweptQuickReturn, Watt
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.general_path import OUTCOMES, SolvedDesign, solve_design
from planar.batch.reference_design import reference_design
from tests.linkages import random_linkage

Array = np.ndarray

STEPS, CHUNK = 60, 200
SPREADS = (0.3, 1.0)
"""Parts of themselves by which dimensions differ: of near designs, and of such half of which fail."""
ROUNDING, MARGIN, FLOOR = 1e-14, 100.0, 1e-12
"""How far dimensions move by rounding (of themselves), how many times as far numbers may be off, and sizes that are
always let pass."""
PERTURBATION = 1e-9
"""Of themselves: where dimensions that differ by so little have another status, it is undecided."""
AGREES, UNDECIDED, STATUS, NUMBER = "agrees", "undecided", "status differs", "number differs"


class Case(NamedTuple):
    """A structure whose designs are drawn: how its mechanism is made, which numbers vary, the point that is told."""

    make: Callable[[], planar.Mechanism]
    names: tuple[str, ...]
    point: str


def _swept(kind: Any) -> Case:
    swept = kind()
    names = tuple(dimension.name for dimension in swept.dimensions)
    return Case(lambda: planar.from_dict(swept.document()), names, swept.point)


def _model(name: str, point: str) -> Case:
    lengths = [
        key for key, value in planar.dimensions(name).items() if key.endswith((".length", ".distance")) and value
    ]
    return Case(lambda: planar.load(name), tuple(lengths), point)


def _random(seed: int) -> Case | None:
    """A random linkage of three to six links, its input from where it stands; None where it has no moving point."""
    built = random_linkage(seed, 3 + seed % 4)

    def make() -> planar.Mechanism:
        return planar.from_dict(built.value)

    mechanism = make()
    given = planar.dimensions(mechanism)
    known = set(reference_design(mechanism, mechanism.inputs[0].pair).moving_points)
    names = tuple(key for key, value in given.items() if key.count(".") == 2 and key[-2:] in (".x", ".y") and value)
    names = tuple(key for key in names if not key.startswith("sketch"))
    return Case(make, names, min(known)) if known and names else None


@lru_cache
def cases() -> dict[str, Case]:
    """The structures by name."""
    found: dict[str, Case] = {kind().name: _swept(kind) for kind in (SweptFourBar, SweptQuickReturn, Watt, Stephenson)}
    models = (("slider-crank", "B"), ("toggle-press", "D"), ("whitworth", "R"), ("klann-leg", "foot"))
    found |= {name: _model(name, point) for name, point in models}
    randoms = {f"random linkage {seed}": _random(seed) for seed in range(24)}
    return found | {name: case for name, case in randoms.items() if case is not None}


def draw(case: Case, seed: int, count: int) -> dict[str, Array]:
    """Designs of a case, half of them near and half of them wide."""
    rng = np.random.default_rng(seed)
    base = planar.dimensions(case.make())
    spread = np.repeat(SPREADS, [count - count // 2, count // 2])
    return {name: base[name] * np.exp(spread * rng.uniform(-1.0, 1.0, count)) for name in case.names}


class Difference(NamedTuple):
    """What came of one design, and what there is to say of it."""

    verdict: str
    detail: str


def judge(name: str, seed: int, count: int, backend: str) -> tuple[Counter[str], list[str]]:
    """So many designs of a case: how many of each verdict, and a line for each that differs."""
    case = cases()[name]
    mechanism, designs = case.make(), draw(case, seed, count)
    pair = mechanism.inputs[0].pair
    found = planar.sweep(mechanism, designs, STEPS, case.point, rates=False, pair=pair, backend=backend)
    nudged = {key: values * (1.0 + ROUNDING) for key, values in designs.items()}
    moved = planar.sweep(mechanism, nudged, STEPS, case.point, rates=False, pair=pair, backend=backend)
    counts: Counter[str] = Counter()
    lines = []
    for k in range(count):
        values = values_of_design(designs, k)
        verdict, detail = _judge_design(
            mechanism,
            values,
            (case.point, pair),
            (np.asarray(found.status[k]), np.asarray(found.position[case.point][k])),
            np.asarray(moved.position[case.point][k]),
        )
        counts[verdict] += 1
        if verdict in (STATUS, NUMBER):
            lines.append(f"{name}, {backend}, seed {seed}, design {k}: {verdict}: {detail}; {values}")
    counts["general path"] += found.general
    return counts, lines


def _judge_design(
    mechanism: planar.Mechanism,
    values: dict[str, float],
    asked: tuple[str, str],
    swept: tuple[Array, Array],
    nudged: Array,
) -> Difference:
    status, position = swept
    wanted = _solve(mechanism, values, asked)
    if wanted is None:
        return Difference(AGREES, "")  # with a range of its own
    if not np.array_equal(status, wanted.status):
        for nudge in (1.0 + PERTURBATION, 1.0 - PERTURBATION):
            other = _solve(mechanism, {key: value * nudge for key, value in values.items()}, asked)
            if other is None or not np.array_equal(other.status, wanted.status):
                return Difference(UNDECIDED, "")
        at = int(np.argmax(status != wanted.status))
        said = OUTCOMES[status[at]].value, OUTCOMES[wanted.status[at]].value
        return Difference(STATUS, f"position {at} of {STEPS}: {said[0]}, and by itself {said[1]}")
    solved = status == 0
    apart = np.abs(position - wanted.out[:, :2])[solved].max(axis=1, initial=0.0)
    size = np.abs(wanted.out[solved][:, :2]).max(initial=0.0)
    allowed = MARGIN * np.nan_to_num(np.abs(position - nudged)[solved].max(axis=1, initial=0.0), nan=np.inf)
    wrong = apart > allowed + FLOOR * size
    if wrong.any():
        at = int(np.argmax(wrong))
        return Difference(NUMBER, f"solved position {at}: {apart[at]:.2e} apart, {allowed[at]:.2e} allowed")
    return Difference(AGREES, "")


def _solve(mechanism: planar.Mechanism, values: dict[str, float], asked: tuple[str, str]) -> SolvedDesign | None:
    """The design by the general path; None where its input has a range of its own."""
    point, pair = asked
    reference = reference_design(mechanism, pair)
    if reference.is_sliding:
        return None
    own = with_design_values(reference.mechanism, values)
    start = float(np.ravel(own.inputs[reference.running_index].position)[0])
    grid = start + 2.0 * np.pi * np.linspace(0.0, 1.0, STEPS + 1)
    return solve_design(own, pair, grid, STEPS, (float(grid[0]), float(grid[-1])), (point,), False)


def _tasks(count: int, seed: int, backends: tuple[str, ...]) -> Iterator[tuple[str, int, int, str]]:
    names = list(cases())
    each = max(1, ceil(count / (len(names) * len(backends))))
    for backend in backends:
        for number, name in enumerate(names):
            for first in range(0, each, CHUNK):
                yield name, 1_000_003 * seed + 1000 * number + first // CHUNK, min(CHUNK, each - first), backend


def main() -> int:
    """Judge designs of all cases; 1 where one differs."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.truth", description=__doc__)
    parser.add_argument("--count", type=int, default=2000, help="designs in all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=None)
    parser.add_argument("--backend", action="append", choices=("native", "numpy"))
    given = parser.parse_args()
    backends = tuple(given.backend or ("native", "numpy"))
    tasks = list(_tasks(given.count, given.seed, backends))
    counts: dict[str, Counter[str]] = {}
    lines: list[str] = []
    with ProcessPoolExecutor(given.workers) as pool, Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("designs", total=sum(each[2] for each in tasks))
        for (name, _, size, _), (found, own) in zip(tasks, pool.map(judge, *zip(*tasks, strict=True)), strict=True):
            counts.setdefault(name.partition(" linkage")[0], Counter()).update(found)
            lines += own
            bar.advance(task, size)
    table = Table("structure", *(verdict for verdict in (AGREES, UNDECIDED, STATUS, NUMBER)), "positions one by one")
    for name, found in counts.items():
        table.add_row(name, *(str(found[each]) for each in (AGREES, UNDECIDED, STATUS, NUMBER, "general path")))
    console = Console(width=160)
    console.print(table)
    for line in lines:
        console.print(line, soft_wrap=True)
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main())
