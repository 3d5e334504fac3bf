"""Linkages drawn at random make exact tasks, and must be in their complete lists: `python -m benchmarks.exact_makers`.

`python -m benchmarks.exact_makers "nine places" 20 -o makers.jsonl` keeps a line for each, and goes on where it was.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from rich.console import Console

import planar
from planar.foundation.arrays import Array
from planar.foundation.jets import value_and_rates

UNITS = {"length": "m", "angle": "rad"}
STEPS = 240
SAME = 1e-5
"""By how much a number of the linkage that made a task may differ from that of the one which is it."""
NUMBERS = ("AD.A.x", "AD.A.y", "AD.D.x", "AD.D.y", "AB.length", "BC.length", "DC.length")
NUMBERS = (*NUMBERS, "frame.O.x", "frame.O.y", "crank.length", "rod.length")
NUMBERS = (
    *NUMBERS,
    "EF.length",
    "GF.length",
    "frame.D.x",
    "frame.D.y",
    "rod.A.x",
    "rod.A.y",
    "BC.B.x",
    "BC.B.y",
    "BC.C.x",
    "BC.C.y",
)
EXCHANGED = {"AD.A.x": "AD.D.x", "AD.A.y": "AD.D.y", "AB.length": "DC.length"}
EXCHANGED = EXCHANGED | {"BC.B.x": "BC.C.x", "BC.B.y": "BC.C.y"}

Made = tuple[dict[str, Any], list[dict[str, Any]], dict[str, Any]]
"""A mechanism's file, what is wanted, and more of the task."""


def _coupler(first: str, p: Array, second: str, q: Array, e: Array, by_points: bool) -> dict[str, Any]:
    """A link with a point E, by its ends or by coordinates from E."""
    if by_points:
        return {"points": {first: (p - e).tolist(), second: (q - e).tolist()}}
    way, off = (q - p) / np.linalg.norm(q - p), e - p
    at = [float(off @ way), float(way[0] * off[1] - way[1] * off[0])]
    return {"ends": [first, second], "length": float(np.linalg.norm(q - p)), "points": {"E": at}}


def four_bar(rng: np.random.Generator, by_points: bool = False) -> dict[str, Any]:
    """A four-bar with joints and coupler point at random."""
    a, b, c, d, e = rng.uniform(-1.0, 1.0, (5, 2))
    links = {
        "AD": {"points": {"A": a.tolist(), "D": d.tolist()}},
        "AB": {"ends": ["A", "B"], "length": float(np.linalg.norm(b - a))},
        "BC": _coupler("B", b, "C", c, e, by_points),
        "DC": {"ends": ["D", "C"], "length": float(np.linalg.norm(c - d))},
    }
    return {
        "planar": 1,
        "units": UNITS,
        "frame": "AD",
        "links": links,
        "pairs": [{"turning": pin} for pin in "ABCD"],
        "inputs": [{"pair": "A", "position": float(np.arctan2(*(b - a)[::-1]))}],
        "sketch": {"B": b.tolist(), "C": c.tolist()},
    }


def slider_crank(rng: np.random.Generator) -> dict[str, Any]:
    """A slider-crank with offset, its rod's point at random."""
    o, a, b, e = rng.uniform(-1.0, 1.0, (4, 2))
    angle = float(rng.uniform(0.0, np.pi))
    through = b - rng.uniform(0.2, 1.0) * np.array([np.cos(angle), np.sin(angle)])
    return {
        "planar": 1,
        "units": UNITS,
        "frame": "frame",
        "links": {
            "frame": {"points": {"O": o.tolist(), "G": through.tolist()}},
            "crank": {"ends": ["O", "A"], "length": float(np.linalg.norm(a - o))},
            "rod": _coupler("A", a, "B", b, e, False),
        },
        "pairs": [
            {"turning": "O"},
            {"turning": "A"},
            {"sliding": "stroke", "on": "frame", "block": "B", "line": {"through": "G", "angle": angle}},
        ],
        "inputs": [{"pair": "O", "position": float(np.arctan2(*(a - o)[::-1]))}],
        "sketch": {"A": a.tolist(), "B": b.tolist()},
    }


def watt_two(rng: np.random.Generator) -> dict[str, Any]:
    """A six-bar of Watt II: a four-bar whose rocker, a plate, drives another one."""
    a, d, g = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]) + rng.uniform(-0.3, 0.3, (3, 2))
    b, c, e, f = rng.uniform(-0.5, 0.5, (4, 2)) + np.array([[0.0, 0.4], [1.0, 0.8], [1.2, 0.7], [2.2, 0.7]])
    way, off = (c - d) / np.linalg.norm(c - d), e - d
    at = [float(off @ way), float(way[0] * off[1] - way[1] * off[0])]
    ends = {"AB": (a, b), "BC": (b, c), "EF": (e, f), "GF": (g, f)}
    links = {name: {"ends": [*name], "length": float(np.linalg.norm(q - p))} for name, (p, q) in ends.items()}
    links["plate"] = {"ends": ["D", "C"], "length": float(np.linalg.norm(c - d)), "points": {"E": at}}
    pins = {"A": a.tolist(), "D": d.tolist(), "G": g.tolist()}
    return {
        "planar": 1,
        "units": UNITS,
        "frame": "frame",
        "links": {"frame": {"points": pins}} | links,
        "pairs": [{"turning": pin} for pin in "ABCDEFG"],
        "inputs": [{"pair": "A", "position": float(np.arctan2(*(b - a)[::-1]))}],
        "sketch": {"B": b.tolist(), "C": c.tolist(), "E": e.tolist(), "F": f.tolist()},
    }


def slide_and_swing(rng: np.random.Generator) -> dict[str, Any]:
    """A rod with a pin on a line of the frame, and a line of its own through a pivot."""
    a, d, g = rng.uniform(-1.0, 1.0, (3, 2))
    angle, own = rng.uniform(0.0, np.pi, 2).tolist()
    through = a - rng.uniform(0.2, 1.0) * np.array([np.cos(angle), np.sin(angle)])
    # the rod's axes stand along the world's where it is drawn, with their origin at g
    along = d - rng.uniform(0.2, 1.0) * np.array([np.cos(own), np.sin(own)])
    return {
        "planar": 1,
        "units": UNITS,
        "frame": "frame",
        "links": {
            "frame": {"points": {"P": through.tolist(), "D": d.tolist()}},
            "rod": {"points": {"A": (a - g).tolist(), "G": (along - g).tolist()}},
        },
        "pairs": [
            {"sliding": "slide", "on": "frame", "block": "A", "line": {"through": "P", "angle": angle}},
            {"sliding": "swing", "on": "rod", "block": "D", "line": {"through": "G", "angle": own}},
        ],
        "inputs": [{"pair": "slide", "position": float(np.linalg.norm(a - through))}],
        "sketch": {"A": a.tolist(), "G": along.tolist()},
    }


def _run(
    value: dict[str, Any], count: int, rng: np.random.Generator, reach: float | None = None
) -> tuple[planar.Motion, Array]:
    """The motion of a linkage, or that so far to both sides, and rows of it at random."""
    here = value["inputs"][0]["position"]
    ends = {} if reach is None else {"start": here - reach, "stop": here + reach}
    motion = planar.cycle(planar.from_dict(value), STEPS, **ends)
    return motion, np.sort(rng.choice(np.arange(2, len(motion) - 2), count, replace=False))


def _poses(motion: planar.Motion, link: str, rows: Array) -> dict[str, Any]:
    frame = motion.frames[link]
    x, y, angle = (np.asarray(value_and_rates(getattr(frame, part))[0]) for part in ("x", "y", "angle"))
    told = [{"at": [float(x[k]), float(y[k])], "angle": float(angle[k])} for k in rows]
    return {"link": link, "poses": told}


def poses(rng: np.random.Generator) -> Made:
    """Five poses of a coupler."""
    value = four_bar(rng, True)
    motion, rows = _run(value, 5, rng)
    return value, [_poses(motion, "BC", rows)], {}


def slide_poses(rng: np.random.Generator) -> Made:
    """Four poses of a rod that slides at both ends."""
    value = slide_and_swing(rng)
    motion, rows = _run(value, 4, rng, 0.4)
    return value, [_poses(motion, "rod", rows)], {}


def poses_and_places(pose_count: int, place_count: int) -> Callable[..., Made]:
    """Poses of a coupler, and places of the origin of its axes (Alt and Burmester's problems)."""

    def made(rng: np.random.Generator) -> Made:
        value = four_bar(rng, True)
        value["links"]["BC"]["points"]["E"] = [0.0, 0.0]
        motion, rows = _run(value, pose_count + place_count, rng)
        order = rng.permutation(rows)
        through = motion.point("E").position[order[pose_count:]].tolist()
        wanted = [_poses(motion, "BC", order[:pose_count]), {"point": "E", "through": through}]
        free = ["AD.A", "AD.D", "AB.length", "BC.B", "BC.C", "DC.length"]
        return value, wanted, {"free": free}

    return made


def path(make: Callable[[np.random.Generator], dict[str, Any]], count: int, **more: Any) -> Callable[..., Made]:
    """Places of a coupler's point."""

    def made(rng: np.random.Generator) -> Made:
        value = make(rng)
        motion, rows = _run(value, count, rng)
        return value, [{"point": "E", "through": motion.point("E").position[rows].tolist()}], more

    return made


def four_bar_function(count: int, absolute: bool) -> Callable[..., Made]:
    """Pairs of positions of crank and rocker."""

    def made(rng: np.random.Generator) -> Made:
        value = four_bar(rng)
        motion, rows = _run(value, count, rng)
        given, shown = motion.inputs["A"].position, motion.link("DC").angle
        pairs = [[float(given[k]), float(shown[k])] for k in rows]
        return value, [{"from": "A", "to": "D", "pairs": pairs, "absolute": absolute}], {}

    return made


def watt_function(count: int, *links: str) -> Callable[..., Made]:
    """Pairs of positions of crank and output of a six-bar, of which the lengths of these links are sought."""

    def made(rng: np.random.Generator) -> Made:
        value = watt_two(rng)
        motion, rows = _run(value, count, rng)
        given, shown = motion.inputs["A"].position, motion.link("GF").angle
        pairs = [[float(given[k]), float(shown[k])] for k in rows]
        return value, [{"from": "A", "to": "G", "pairs": pairs}], {"free": [f"{each}.length" for each in links]}

    return made


def slider_function(rng: np.random.Generator) -> Made:
    """Pairs of positions of a crank and a slide."""
    value = slider_crank(rng)
    motion, rows = _run(value, 5, rng)
    given, shown = motion.inputs["O"].position, motion.pair("stroke")["displacement"]
    return value, [{"from": "O", "to": "stroke", "pairs": [[float(given[k]), float(shown[k])] for k in rows]}], {}


KINDS: dict[str, Callable[[np.random.Generator], Made]] = {
    "five poses": poses,
    "four poses of slides": slide_poses,
    "four poses and two places": poses_and_places(4, 2),
    "three poses and four places": poses_and_places(3, 4),
    "two poses and six places": poses_and_places(2, 6),
    "three pairs": four_bar_function(3, True),
    "five pairs": four_bar_function(5, False),
    "five pairs of a slider-crank": slider_function,
    "four pairs of Watt II, two links sought": watt_function(4, "EF", "GF"),
    "five pairs of Watt II, three links sought": watt_function(5, "BC", "EF", "GF"),
    "six pairs of Watt II, four links sought": watt_function(6, "AB", "BC", "EF", "GF"),
    "five places, pivots given": path(four_bar, 5, free=["AB.length", "BC.length", "BC.E", "DC.length"]),
    "eight places of a slider-crank": path(slider_crank, 8),
    "nine places": path(four_bar, 9),
}


def distance_to_maker(found: planar.CompleteSynthesis, maker: planar.Mechanism) -> float:
    """How far the numbers of the nearest linkage of a list are from those that made its task, whichever way round."""
    wanted, best = planar.dimensions(maker), np.inf
    for each in found:
        numbers = planar.dimensions(each.mechanism)
        other = dict(numbers)
        for one, two in EXCHANGED.items():
            if one in numbers and two in numbers:
                other[one], other[two] = numbers[two], numbers[one]
        for told in (numbers, other):
            off = max(abs(told[name] - wanted[name]) for name in NUMBERS if name in wanted)
            best = min(best, off)
    return float(best)


def try_maker(kind: str, seed: int) -> dict[str, Any]:
    """One linkage, its task, and what its list says."""
    rng = np.random.default_rng(seed)
    try:
        value, wanted, more = KINDS[kind](rng)
    except planar.NoAnswer as problem:
        return {"kind": kind, "seed": seed, "refused": problem.outcome.value}
    began = process_time()
    task = {"planar": 1, "units": UNITS, "start": value, "wanted": wanted} | more
    found = planar.synthesise(task, complete=True)
    off = distance_to_maker(found, planar.from_dict(value))
    return {
        "kind": kind,
        "seed": seed,
        "is_there": off < SAME,
        "off": off,
        "real": len(found),
        "certified": sum(each.certified for each in found),
        "found": found.found,
        "expected": found.expected,
        "complete": found.complete,
        "seconds": round(process_time() - began, 2),
    }


def main() -> None:
    """Try so many makers of a kind, those left out that a file has already."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.exact_makers")
    parser.add_argument("kind", choices=[*KINDS])
    parser.add_argument("count", type=int)
    parser.add_argument(
        "-o", dest="file", type=Path, default=None, help="a line of JSON for each, kept and gone on from"
    )
    wanted = parser.parse_args()
    lines = wanted.file.read_text().splitlines() if wanted.file is not None and wanted.file.exists() else []
    results = [each for each in map(json.loads, lines) if each["kind"] == wanted.kind]
    console, done = Console(), {each["seed"] for each in results}
    for seed in range(wanted.count):
        if seed in done:
            continue
        results.append(try_maker(wanted.kind, seed))
        if wanted.file is not None:
            with wanted.file.open("a") as file:
                file.write(json.dumps(results[-1]) + "\n")
        console.print(results[-1])
    tried = [each for each in results if "refused" not in each]
    missing = [each["seed"] for each in tried if not each["is_there"]]
    whole = sum(each["found"] == each["expected"] for each in tried)
    console.print(
        f"{wanted.kind}: {len(tried)} tried, {whole} with all that are expected, missing: {missing or 'none'}"
    )


if __name__ == "__main__":
    main()
