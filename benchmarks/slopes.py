"""What derivatives add to a sweep: `python -m benchmarks.slopes` prints ratios of times, taken in turn.

Each model's sweep tells one point, or a pair, over a turn of designs that differ in one number; "one" and "all" add the
derivatives in one number of its file, and in all.
"""

from __future__ import annotations

import numpy as np

import planar
from benchmarks.timing import best

DESIGNS, STEPS = 200, 90
MODELS = {
    "four-bar": {"points": ["E"]},
    "slider-crank": {"pairs": ["stroke"]},
    "whitworth": {"pairs": ["R"]},
    "geared-five-bar": {"points": ["C"]},
    "klann-leg": {"points": ["foot"]},
    "double-butterfly": {"points": ["E"]},
}


def main() -> None:
    """Print a line for each model."""
    print(f"{'':20} {'sweep, us':>10} {'one':>6} {'all':>6}  of so many")
    for model, asked in MODELS.items():
        mechanism = planar.load(model)
        numbers = [
            name
            for name in planar.dimensions(mechanism)
            if name.endswith((".length", ".x", ".y")) and not name.startswith(("sketch", "gravity"))
        ]
        values = {numbers[0]: planar.dimensions(mechanism)[numbers[0]] * np.linspace(0.999, 1.001, DESIGNS)}

        def run(derivatives: list[str]) -> planar.Sweep:
            return planar.sweep(mechanism, values, STEPS, **asked, derivatives=derivatives)  # noqa: B023

        times = best({0: lambda: run([]), 1: lambda: run(numbers[:1]), 2: lambda: run(numbers)}, 2)  # noqa: B023
        each = 1e6 * times[0] / (DESIGNS * (STEPS + 1))
        print(f"{model:20} {each:10.2f} {times[1] / times[0]:6.1f} {times[2] / times[0]:6.1f}  {len(numbers)}")


if __name__ == "__main__":
    main()
