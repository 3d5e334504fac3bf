"""Whether calibration says how exact it is: models whose numbers are off are fitted again and again to noisy samples
of their paths without the input's position; the spread of what is found beside the predicted one.

    python -m benchmarks.calibration_spread [REPEATS] [MODEL ...]
"""

from __future__ import annotations

import sys

import numpy as np

import planar

MODELS = {
    "hoeken-straight-line": "P",
    "chebyshev-straight-line": "P",
    "roberts-straight-line": "P",
    "four-bar": "E",
    "slider-crank": "E",
    "evans-grasshopper": "P",
    "oscillating-cylinder": "piston",
    "geared-five-bar": "P",
    "watt-1-six-bar": "E",
    "klann-leg": "foot",
    "stephenson-1-six-bar": "E",
}
"""A point of a coupler each. From the start that is drawn the last one ends in another minimum than the true one, with
residuals of four times the noise, and its remarks say that the numbers do not act linearly."""
SAMPLES, NOISE = 48, 2e-6
"""Of a path, and of the greatest extent of a path: the standard deviation of each coordinate."""
CHANGE = 0.003
"""How far from the truth, as a part of each number, the search starts."""


def spread_ratios(
    model: str, point: str, repeats: int, rng: np.random.Generator
) -> tuple[dict[str, float], int, float]:
    """The spread of each identified number beside the predicted one, how many changes are not seen, and the greatest
    error in predicted standard deviations."""
    mechanism = planar.load(model)
    motion = planar.cycle(mechanism, 4 * SAMPLES)
    path = motion.point(point).position[2:-2][:: len(motion) // SAMPLES]
    noise = NOISE * float(np.ptp(path, axis=0).max())
    true = planar.dimensions(mechanism)
    free = [*planar.calibrate(mechanism, {point: path}).values]
    start = mechanism.with_values({key: true[key] * (1.0 + CHANGE * rng.uniform(-1.0, 1.0)) for key in free})
    noisy = [{point: path + rng.normal(size=path.shape) * noise} for _ in range(repeats)]
    found = [planar.calibrate(start, each, free) for each in noisy]
    known = [key for key in found[0].values if np.isfinite(found[0].deviations[key])]
    errors = {key: np.array([each.values[key] - true[key] for each in found]) for key in known}
    predicted = {key: np.sqrt(np.mean([each.deviations[key] ** 2 for each in found])) for key in known}
    worst = max((float(np.mean(np.abs(errors[key]) > 3.0 * predicted[key])) for key in known), default=0.0)
    return {key: float(np.std(errors[key]) / predicted[key]) for key in known}, len(found[0].unidentified), worst


def main() -> None:
    """Print a line for each model."""
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    for model in sys.argv[2:] or MODELS:
        ratios, unseen, worst = spread_ratios(model, MODELS[model], repeats, np.random.default_rng(7))
        told = ", ".join(f"{name} {ratio:.3f}" for name, ratio in ratios.items())
        print(f"{model}: {unseen} unseen; {worst:.1%} beyond 3 deviations; spread over predicted: {told}", flush=True)


if __name__ == "__main__":
    main()
