"""Whether calibration says how exact it is: models fitted again and again to noisy samples of their paths without the
input's position, the spread of what is found beside the predicted one.

    python -m benchmarks.calibration_spread [REPEATS] [MODEL ...]
"""

from __future__ import annotations

import sys

import numpy as np

import planar

MODELS = {
    "hoeken-straight-line": "P",
    "chebyshev-straight-line": "",
    "crank-rocker": "B",
    "four-bar": "E",
    "slider-crank": "",
    "whitworth": "",
    "drag-link": "",
    "watt-six-bar": "",
    "elliptical-trammel": "",
    "oscillating-cylinder": "",
}
"""A point each; where none is named the last that is carried round."""
SAMPLES, NOISE = 48, 2e-4
"""Of a path, and of the greatest extent of a path: the standard deviation of each coordinate."""


def tracing_point(motion: planar.Motion) -> str:
    """The last point that moves in both directions."""
    spans = {name: np.ptp(motion.point(name).position, axis=0) for name in motion.point_names}
    return [name for name, span in spans.items() if span.min() > 1e-3 * span.max() > 0.0][-1]


def spread_ratios(
    model: str, point: str, repeats: int, rng: np.random.Generator
) -> tuple[dict[str, float], int, float]:
    """The spread of each identified number beside the predicted one, how many changes are not seen, and the greatest
    error in predicted standard deviations."""
    mechanism = planar.load(model)
    motion = planar.cycle(mechanism, 4 * SAMPLES)
    name = point or tracing_point(motion)
    path = motion.point(name).position[2:-2][:: len(motion) // SAMPLES]
    noise = NOISE * float(np.ptp(path, axis=0).max())
    true = planar.dimensions(mechanism)
    found = [planar.calibrate(mechanism, {name: path + rng.normal(size=path.shape) * noise}) for _ in range(repeats)]
    known = [key for key in found[0].values if np.isfinite(found[0].deviations[key])]
    errors = {key: np.array([each.values[key] - true[key] for each in found]) for key in known}
    predicted = {key: np.sqrt(np.mean([each.deviations[key] ** 2 for each in found])) for key in known}
    worst = max((float(np.mean(np.abs(errors[key]) > 3.0 * predicted[key])) for key in known), default=0.0)
    return {key: float(np.std(errors[key]) / predicted[key]) for key in known}, len(found[0].unidentified), worst


def main() -> None:
    """Print a line for each model."""
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    for model in sys.argv[2:] or MODELS:
        ratios, unseen, worst = spread_ratios(model, MODELS.get(model, ""), repeats, np.random.default_rng(7))
        told = ", ".join(f"{name} {ratio:.3f}" for name, ratio in ratios.items())
        print(f"{model}: {unseen} unseen; {worst:.1%} beyond 3 deviations; spread over predicted: {told}", flush=True)


if __name__ == "__main__":
    main()
