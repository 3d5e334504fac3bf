"""How the time of what users call grows with the number of links, of kinds of linkages that can be of any length.

Each is done in a mechanism of its own, so that nothing is known of it: a first `solve`, a first and a second `cycle`,
`forces` of a position, `simulate`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from time import process_time
from typing import Any

import planar
from benchmarks.long import STRUCTURES

LINKS = (10, 100, 1_000)
MANY_LINKS = 10_000
"""Only a run goes so far."""
STEPS = 72
"""Of a run."""
SIMULATED_STEPS = 4
WHEEL_RADIUS = 0.5


@dataclass(frozen=True)
class Growth:
    """Processor time (s) of a linkage of so many links; None for what was not done.

    A first `solve` and a first `cycle` of it, a second one, `forces` of a position whose structure is known, and a step
    of `simulate`. `residual` is what the worst constraint of the run leaves open, in sizes.
    """

    kind: str
    links: int
    solve: float
    cycle: float
    cycle_again: float
    residual: float
    forces: float | None = None
    simulate: float | None = None

    def per_link(self) -> tuple[float | None, ...]:
        """Seconds a link, and of runs a link and position."""
        positions = self.links * (STEPS + 1)
        parts = (self.solve, self.links), (self.cycle, positions), (self.cycle_again, positions)
        parts += (self.forces, self.links), (self.simulate, self.links)
        return tuple(None if seconds is None else seconds / by for seconds, by in parts)


def gear_train(links: int) -> dict[str, Any]:
    """Wheels of one size in a line, each in mesh with the next, the first of which is driven."""
    names = [f"w{k}" for k in range(links - 1)]
    pairs: list[dict[str, Any]] = [{"turning": f"O{k}"} for k in range(links - 1)]
    pairs += [
        {"gear": f"g{k}", "links": names[k - 1 : k + 1], "radii": [WHEEL_RADIUS] * 2} for k in range(1, links - 1)
    ]
    return {
        "planar": 1,
        "units": {"length": "m", "angle": "rad"},
        "frame": "frame",
        "links": {
            "frame": {"points": {f"O{k}": [2.0 * WHEEL_RADIUS * k, 0.0] for k in range(links - 1)}},
            **{name: {"points": {f"O{k}": [0.0, 0.0]}} for k, name in enumerate(names)},
        },
        "pairs": pairs,
        "inputs": [{"pair": "O0", "position": 0.7, "velocity": 1.0}],
    }


def linkage(kind: str, links: int) -> dict[str, Any]:
    """The file of a linkage of bars."""
    pinned = STRUCTURES[kind](links)
    return planar.to_dict(planar.pinned(pinned.places, pinned.bars, pinned.frame, 0))


KINDS: dict[str, Callable[[int], dict[str, Any]]] = {
    **{kind: partial(linkage, kind) for kind in STRUCTURES},
    "trains of gears": gear_train,
}


def with_masses(document: dict[str, Any]) -> dict[str, Any]:
    """Every link with a mass at its first point."""
    moving = {name: link for name, link in document["links"].items() if name != document["frame"]}
    at = {name: (link.get("ends") or list(link["points"]))[0] for name, link in moving.items()}
    return document | {"masses": [{"link": name, "mass": 1.0, "inertia": 0.1, "at": at[name]} for name in moving]}


def grow(kind: str, links: int, with_forces: bool = True) -> Growth:
    """Time one linkage."""
    mechanism = planar.from_dict(with_masses(KINDS[kind](links)))
    solved, _ = _time(lambda: planar.solve(mechanism))
    first, motion = _time(lambda: planar.cycle(mechanism, STEPS))
    again, _ = _time(lambda: planar.cycle(mechanism, STEPS))
    forces = simulated = None
    if with_forces:
        state = planar.solve(mechanism)
        planar.forces(state)
        forces, _ = _time(lambda: planar.forces(state))
        planar.simulate(mechanism, 1e-3, 1)
        seconds, _ = _time(lambda: planar.simulate(mechanism, 1e-2, SIMULATED_STEPS))
        simulated = seconds / SIMULATED_STEPS
    return Growth(kind, len(mechanism.links), solved, first, again, motion.residual, forces, simulated)


def growths() -> Iterator[Growth]:
    """All kinds, up to many links."""
    for kind in KINDS:
        for links in LINKS:
            yield grow(kind, links)
        yield grow(kind, MANY_LINKS, with_forces=False)


def _time(task: Callable[[], Any]) -> tuple[float, Any]:
    start = process_time()
    result = task()
    return process_time() - start, result
