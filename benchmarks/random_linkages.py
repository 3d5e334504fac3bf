"""Thousands of random linkages solved and judged: `python -m benchmarks.random_linkages 10000` prints the counts.

Each is built closed, of every pair type, with up to twelve moving links, and its sketch is then disturbed by a
hundredth of its size. What comes out is compared with what was built, and what is refused with the rank of all
constraints.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import pairwise
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

import planar
from planar.results.motion import State
from tests.linkages import Built, determinate, random_linkage

BLUR = 0.01
HIGHER = 0.2
"""The share of joints made of higher pairs, in every second linkage."""
CHUNK = 50
FEW = 20
SAME = 1e-6
WRONG = "finite and wrong"
UNEXPLAINED = "refused though determinate"


def outcome_of_linkage(seed: int) -> str:
    """What came out of one linkage, in words."""
    built = random_linkage(seed, 1 + seed % 12, BLUR, HIGHER * (seed % 2))
    mechanism = planar.from_dict(built.value)
    try:
        state = planar.solve(mechanism)
    except planar.NoAnswer as problem:
        # at a dead point of a group the rank of the whole falls too, so that every refusal shows there
        expected = not determinate(mechanism, built)
        return problem.outcome.value if expected and problem.reason else f"{UNEXPLAINED}: {problem.outcome.value}"
    if not _is_closed(state):
        return WRONG
    if max(np.hypot(*(state.point(name).position - at)) for name, at in _as_built(state, built).items()) < SAME:
        return "solved: the assembly that was built"
    sketch = {name: np.array([x, y]) for name, x, y in mechanism.sketch}
    found = sum(np.sum((state.point(name).position - at) ** 2) for name, at in sketch.items())
    drawn = sum(np.sum((at - sketch[name]) ** 2) for name, at in _as_built(state, built).items() if name in sketch)
    return "solved: one nearer to the sketch" if found <= drawn + 1e-9 else "solved: another"


def _as_built(state: State, built: Built) -> dict[str, np.ndarray]:
    found = {}
    for link in state.mechanism.links:
        for point in link.names:
            frame = built.frames[link.name]
            found[f"{link.name}.{point}"] = np.array(
                frame.to_world(state.shapes[link.name].position(point)), dtype=float
            )
    names = state.point_names
    return found | {name: found[_member(state, name)] for name in names}


def _member(state: State, name: str) -> str:
    link, point = state._find_point(name).members[0]
    return f"{link}.{point}"


def _is_closed(state: State) -> bool:
    """Whether every pin is where both its links have it, by their frames alone; nothing of the solver is asked."""
    for pair in state.mechanism.pairs:
        places = [
            state.frames[link].to_world(state.shapes[link].position(point)) for link, point in pair.coincident_points()
        ]
        for first, second in pairwise(places):
            gap = first - second
            if abs(_value(gap.x)) + abs(_value(gap.y)) > 1e-12 * 10:
                return False
    return all(np.isfinite(point.acceleration).all() for point in state.points.values())


def _value(part: object) -> float:
    return float(getattr(part, "parts", (part,))[0])


def _chunk(first: int) -> list[tuple[str, int]]:
    return [(outcome_of_linkage(seed), seed) for seed in range(first, first + CHUNK)]


def main() -> None:
    """Judge so many linkages and print the counts."""
    many = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    console = Console()
    seeds: dict[str, list[int]] = {}
    start = perf_counter()
    with ProcessPoolExecutor() as pool, Progress(console=console, disable=not console.is_terminal) as progress:
        for each in progress.track(pool.map(_chunk, range(0, many, CHUNK)), total=-(-many // CHUNK)):
            for what, seed in each:
                seeds.setdefault(what, []).append(seed)
    table = Table(title=f"{sum(map(len, seeds.values()))} random linkages, {perf_counter() - start:.0f} s")
    table.add_column("what came out")
    table.add_column("how many", justify="right")
    table.add_column("seeds")
    for what, each in sorted(seeds.items(), key=lambda item: -len(item[1])):
        table.add_row(what, str(len(each)), ", ".join(map(str, each)) if len(each) < FEW else "")
    console.print(table)
    sys.exit(any(what == WRONG or what.startswith(UNEXPLAINED) for what in seeds))


if __name__ == "__main__":
    main()
