"""Random tasks that leave numbers open: a four-bar for two to four poses or three to five places, its pivots in boxes.

Where random draws of the open numbers hold a four-bar that meets all demands, `planar.synthesise` must list one, too.
"""

from __future__ import annotations

from time import process_time
from typing import Any, NamedTuple

import numpy as np

import planar
from benchmarks.synthesis.family_draws import Box, Demands, FourBars, Places, meets, place_designs, pose_designs

KINDS = (("poses", 2), ("poses", 3), ("poses", 4), ("places", 3), ("places", 4), ("places", 5))
DRAWS = 20_000
EXACT = 1e-8
"""m: what designs of the size of 0.1 m may miss."""


class FamilyTask(NamedTuple):
    """A task as a file's value, with what is wanted and demanded of it, m and rad; of places there are no `turns`."""

    value: dict[str, Any]
    at: Places
    turns: Places | None
    boxes: tuple[Box, Box]
    demands: Demands

    def draw(self, count: int, rng: np.random.Generator) -> FourBars:
        """The designs of so many draws that meet all that is demanded."""
        designs = (
            place_designs(self.at, self.boxes, count, rng)
            if self.turns is None
            else pose_designs(self.at, self.turns, self.boxes, count, rng)
        )
        return designs.take(meets(designs, self.demands))


def family_task(seed: int) -> FamilyTask:
    """The random task of a seed; lengths are in mm."""
    rng = np.random.default_rng([41, seed])
    kind, entries = KINDS[seed % len(KINDS)]
    at = np.round(np.cumsum(rng.uniform(-60.0, 60.0, (entries, 2)), axis=0), 1)
    angles = np.round(np.cumsum(rng.uniform(-50.0, 50.0, entries)), 1)
    boxes = []
    for _ in range(2):
        middle, half = rng.uniform(-120.0, 120.0, 2), rng.uniform(30.0, 150.0, 2)
        (x, y), (u, v) = np.round(middle - half), np.round(middle + half)
        boxes.append((float(x), float(u), float(y), float(v)))
    demands = Demands(
        bool(rng.random() < 0.25), bool(rng.random() < 0.4), float(rng.choice([10.0, 20.0, 30.0, 40.0])) or None
    )
    demands = demands._replace(transmission=None if rng.random() < 0.4 else demands.transmission)
    poses = [{"at": place, "angle": angle} for place, angle in zip(at.tolist(), angles.tolist(), strict=True)]
    wanted = {"link": "BC", "poses": poses} if kind == "poses" else {"point": "E", "through": at.tolist()}
    keys: list[Any] = ["one branch", *["whole turn"] * demands.whole_turn]
    keys += [{"transmission": demands.transmission}] if demands.transmission is not None else []
    value = {
        "planar": 1,
        "name": f"family {seed}",
        "units": {"length": "mm", "angle": "deg"},
        "start": "four-bar",
        "wanted": [wanted | {"in_order": demands.in_order}],
        "within": {
            f"AD.{name}.{axis}": list(box[k : k + 2])
            for name, box in zip("AD", boxes, strict=True)
            for axis, k in (("x", 0), ("y", 2))
        },
        "demands": keys,
    }
    if demands.transmission is not None:
        demands = demands._replace(transmission=float(np.radians(demands.transmission)))
    turns = np.exp(1j * np.radians(angles)) if kind == "poses" else None
    metres = tuple(tuple(1e-3 * side for side in box) for box in boxes)
    return FamilyTask(value, 1e-3 * (at[:, 0] + 1j * at[:, 1]), turns, metres, demands)  # type: ignore[arg-type]


def measure(seed: int, draws: int = DRAWS) -> dict[str, Any]:
    """How many of the random draws, and how many of the designs that are listed, meet what is demanded."""
    task = family_task(seed)
    drawn = len(task.draw(draws, np.random.default_rng([43, seed])).a)
    begun = process_time()
    found = planar.synthesise(task.value, complete=True)
    seconds = process_time() - begun
    worst = max((design.greatest_miss for design in found), default=0.0)
    return {
        "kind": " ".join(map(str, KINDS[seed % len(KINDS)][::-1])),
        "drawn": drawn,
        "listed": len(found),
        "tried": 0 if found.family is None else found.family.tried,
        "met": 0 if found.family is None else found.family.met,
        "greatest_miss": worst,
        "seconds": round(seconds, 2),
    }


def is_met(record: dict[str, Any]) -> bool:
    """Whether designs are listed where draws hold some, and none of them misses."""
    return record["greatest_miss"] < EXACT and (record["listed"] > 0 or record["drawn"] == 0)
