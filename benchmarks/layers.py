"""Layers of linkages beside a dyad written by hand, in PyTorch and JAX: a four-bar in a thousand designs over a turn.

    python -m benchmarks.layers [DESIGNS]

Timed is a loss with its gradient in four lengths of each design, forward and backward; libraries that are not
installed are left out. What is written by hand is closed in one formula for this linkage alone, without a check, and
runs on all designs at once; JAX compiles it. The greatest difference of the gradients stands beside the times.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from typing import Any

import numpy as np

import planar
from benchmarks.swept import SweptFourBar, angles
from benchmarks.timing import best

STEPS = 360
Loss = Callable[[], Any]


def dyadic_pin(np_like: Any, values: Any, cos: Any, sin: Any) -> tuple[Any, Any]:
    """x and y of the pin between coupler and rocker (designs, positions), by what has a library's `sqrt`."""
    a, b, c, g = (values[:, k, None] for k in range(4))
    x, y = g - a * cos, -a * sin
    square = x * x + y * y
    along = 0.5 * (b * b - c * c + square) / square
    height = np_like.sqrt(b * b / square - along * along)
    return a * cos + along * x - height * y, a * sin + along * y + height * x


def by_torch(values: np.ndarray, swept: SweptFourBar, free: list[str]) -> tuple[Loss, Loss]:
    """The gradients (designs, 4) by planar's layer, and by hand."""
    import torch

    linkage = planar.torch.Linkage(planar.from_dict(swept.document()), free, [swept.point], STEPS)
    cos, sin = (torch.from_numpy(each(angles(STEPS)))[None] for each in (np.cos, np.sin))

    def layer() -> np.ndarray:
        given = torch.from_numpy(values).requires_grad_()
        (linkage(given)[0] ** 2).sum().backward()
        return given.grad.numpy()

    def own() -> np.ndarray:
        given = torch.from_numpy(values).requires_grad_()
        x, y = dyadic_pin(torch, given, cos, sin)
        (x * x + y * y).sum().backward()
        return given.grad.numpy()

    return layer, own


def by_jax(values: np.ndarray, swept: SweptFourBar, free: list[str]) -> tuple[Loss, Loss]:
    """The same by JAX, compiled."""
    import jax

    jax.config.update("jax_enable_x64", True)
    linkage = planar.jax.Linkage(planar.from_dict(swept.document()), free, [swept.point], STEPS)
    cos, sin = (jax.numpy.asarray(each(angles(STEPS)))[None] for each in (np.cos, np.sin))

    def hand(given: Any) -> Any:
        x, y = dyadic_pin(jax.numpy, given, cos, sin)
        return (x * x + y * y).sum()

    slopes = [jax.jit(jax.grad(each)) for each in (lambda given: (linkage(given)[0] ** 2).sum(), hand)]
    layer, own = (lambda slope=slope: np.asarray(slope(values)) for slope in slopes)
    return layer, own


def told(many: int) -> Iterator[str]:
    """A line for each library."""
    swept = SweptFourBar()
    free = [each.name for each in swept.dimensions]
    values = np.ascontiguousarray(swept.designs(many).T)
    ways = {
        library: make(values, swept, free)
        for library, make in (("torch", by_torch), ("jax", by_jax))
        if find_spec(library)
    }
    times = best({(library, k): way for library, both in ways.items() for k, way in enumerate(both)})
    yield f"{many} designs, {STEPS + 1} positions each"
    yield f"{'library':10}{'planar':>12}{'by hand':>12}{'ratio':>7}{'difference':>12}"
    for library, (layer, own) in ways.items():
        found, wanted = layer(), own()
        error = float(np.max(np.abs(found - wanted)) / np.max(np.abs(wanted)))
        one, other = times[library, 0], times[library, 1]
        yield f"{library:10}{1e3 * one:9.1f} ms{1e3 * other:9.1f} ms{one / other:7.2f}{error:12.1e}"


def main() -> None:
    """Print a line for each library that is installed."""
    print(*told(int(sys.argv[1]) if len(sys.argv) > 1 else 1000), sep="\n")


if __name__ == "__main__":
    main()
