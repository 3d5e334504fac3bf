"""Bands of tolerances by derivatives beside those of very many mechanisms, each solved: time, agreement, and proof.

    python -m benchmarks.tolerance              # 100,000 mechanisms of each model at 360 positions
    python -m benchmarks.tolerance 1000000 36   # a million at 36, as the guaranteed bands are asked to hold

A mechanism outside a guaranteed band is a defect: the status says so. Linkages with slides and of no dyads are among
them. Widths are those of the guaranteed band over those of all mechanisms near a row, where that ratio is greatest.
"""

from __future__ import annotations

import sys
from time import perf_counter
from typing import NamedTuple

import numpy as np

import planar
from planar.analysis.tolerance.tolerance import ToleranceBand

CHUNK = 10_000
PER_ROW = 4
"""Positions from one row of a guaranteed band to the next."""
CLASS = {"general": "ISO 2768-1 f"}
MODELS = {
    "slider-crank": "stroke",
    "crank-rocker": "B",
    "whitworth": "R",
    "hoeken-straight-line": "P",
    "geared-five-bar": "C",
    "stephenson-3-five-bar": "C",
    "klann-leg": "foot",
    "double-butterfly": "E",
}


class Moments(NamedTuple):
    """Of very many mechanisms the standard deviation (n, parts), how many are not solved, and the seconds."""

    std: np.ndarray
    unsolved: int
    seconds: float


class Ends(NamedTuple):
    """The least and the greatest deviations of very many mechanisms near each row (n, parts), and the unsolved."""

    least: np.ndarray
    greatest: np.ndarray
    unsolved: int


def run(band: ToleranceBand, of: str, unit: np.ndarray, per_row: int) -> np.ndarray:
    """The result (designs, positions, parts) of mechanisms whose numbers lie within tolerances at `unit` (designs,
    numbers), from -1 to 1."""
    motion, numbers = band.moving, band.variations.numbers
    assert isinstance(motion, planar.Motion)
    values = planar.dimensions(motion.mechanism)
    limits = np.array([[each.lower, each.upper] for each in numbers])
    off = limits.mean(axis=1) + 0.5 * np.ptp(limits, axis=1) * unit
    at = motion.inputs[motion.running_input].position
    swept = planar.sweep(
        motion.mechanism,
        {each.number: values[each.number] + off[:, k] for k, each in enumerate(numbers)},
        (len(motion) - 1) * per_row,
        start=float(at[0]),
        stop=float(at[-1]),
        rates=False,
        **{"points" if band.result == "position" else "pairs": [of]},
    )
    found: np.ndarray = swept.position[of] if band.result == "position" else swept.value[of][..., None]
    return found


def moments(band: ToleranceBand, of: str, count: int) -> Moments:
    """Mechanisms whose numbers are normally distributed, three standard deviations to each end of a tolerance."""
    total, square, solved, seconds = 0.0, 0.0, 0, 0.0
    for seed in range(max(count // CHUNK, 1)):
        unit = np.random.default_rng(seed).normal(size=(CHUNK, len(band.variations.numbers))) / 3.0
        begun = perf_counter()
        off = run(band, of, unit, 1) - band.nominal_rows
        off = off[np.isfinite(off).all(axis=(1, 2))]
        solved, total, square = solved + len(off), total + off.sum(axis=0), square + (off**2).sum(axis=0)
        seconds += perf_counter() - begun
    mean = total / solved
    return Moments(np.sqrt(square / solved - mean**2), count - solved, seconds)


def ends(band: ToleranceBand, of: str, count: int) -> Ends:
    """Mechanisms within the tolerances: at corners where the result is farthest off, at random ones, and inside."""
    slopes = np.concatenate(band.linear.slopes)
    slopes = slopes[np.isfinite(slopes).all(axis=1)]
    farthest = np.concatenate([np.sign(slopes), -np.sign(slopes)])
    nominal = run(band, of, np.zeros((1, slopes.shape[1])), PER_ROW)
    least, greatest, unsolved = np.inf, -np.inf, 0
    for seed in range(max(count // CHUNK, 1)):
        rng = np.random.default_rng(seed)
        unit = rng.uniform(-1.0, 1.0, (CHUNK, slopes.shape[1]))
        unit[::2] = np.sign(unit[::2])
        if seed == 0:
            unit[: len(farthest)] = farthest[:CHUNK]
        off = run(band, of, unit, PER_ROW) - nominal
        whole = np.isfinite(off).all(axis=(1, 2))
        unsolved += int((~whole).sum())
        least = np.minimum(least, off[whole].min(axis=0))
        greatest = np.maximum(greatest, off[whole].max(axis=0))
    rows = range(len(band.nominal_rows))
    near = [slice(max(0, row * PER_ROW - PER_ROW // 2), row * PER_ROW + PER_ROW // 2 + 1) for row in rows]
    return Ends(
        np.array([least[each].min(axis=0) for each in near]),
        np.array([greatest[each].max(axis=0) for each in near]),
        unsolved,
    )


def compare(model: str, of: str, count: int, steps: int) -> str:
    """A line of the table; it ends in OUTSIDE where a mechanism left the guaranteed band."""
    motion = planar.cycle(model, steps)
    planar.tolerance(motion, of, CLASS)  # what is compiled once is not counted
    begun = perf_counter()
    band = planar.tolerance(motion, of, CLASS)
    linear = perf_counter() - begun
    sampled = moments(band, of, count)
    deviations: np.ndarray = np.sqrt(np.diagonal(band.statistical.covariance, axis1=1, axis2=2))
    off = 100.0 * float(np.abs(deviations - sampled.std).max() / sampled.std.max())
    ratio = sampled.seconds / linear
    told = f"{model:24} {1e3 * linear:8.1f} {1e3 * sampled.seconds:10.0f} {ratio:9.0f} {off:9.2f}"
    begun = perf_counter()
    try:
        proved = planar.tolerance(motion, of, CLASS, guaranteed=True).guaranteed
    except (planar.NoAnswer, planar.BadInput) as why:
        return f"{told}   no guaranteed band: {why}"
    proof = perf_counter() - begun
    assert proved is not None
    found = ends(band, of, count)
    is_outside = (found.least < proved.lower).any() or (found.greatest > proved.upper).any()
    excess = ((proved.upper - proved.lower) / (found.greatest - found.least)).max()
    word = "   OUTSIDE" if is_outside else ""
    return f"{told} {1e3 * proof:10.0f} {excess:8.3f} {found.unsolved:9}{word}"


def main(words: list[str]) -> int:
    """Print the table; 1 where a mechanism lies outside a guaranteed band."""
    count, steps = [*map(int, words), *(100_000, 360)[len(words) :]]
    print(f"{count} mechanisms of each model, ISO 2768-1 f, at {steps + 1} positions")
    for heads in (
        ("linear", "samples", "ratio", "differ", "guarantee", "width", "unsolved"),
        ("ms", "ms", "", "%", "ms"),
    ):
        widths = (8, 10, 9, 9, 10, 8, 9)
        print(" " * 24, *(f"{head:>{width}}" for head, width in zip(heads, widths, strict=False)))
    lines = []
    for model, of in MODELS.items():
        lines.append(compare(model, of, count, steps))
        print(lines[-1], flush=True)
    return int(any(line.endswith("OUTSIDE") for line in lines))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
