"""A linkage as a function of JAX: numbers of its file in, positions of its points out, differentiable and batched."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from planar.batch.linkage_layer import LinkageLayer
from planar.batch.prepared import RangeArguments
from planar.foundation.errors import BadInput

try:
    import jax
except ImportError:
    raise BadInput("jax", 'planar.jax needs JAX: pip install "planar-linkages[jax]"') from None

__all__ = ["Linkage"]


class Linkage:
    """A linkage of any structure as a differentiable function, in double precision.

    `free`: the numbers of the file that are given, by name, in the order of the values' last axis; `points`, `steps`,
    `rates`, `start`, `stop` and `pair` as `planar.prepared` has them. Called with values (..., free) in SI it gives
    positions (..., steps + 1, 2), of several points (..., steps + 1, points, 2); with `rates` velocities and
    accelerations of the same shape after them; and a mask (..., steps + 1) of the positions that are solved. What is
    not solved is 0, and has no derivative but 0.

    `file_values` (free,) are those of the file, from which one may begin. `jax.jit`, `jax.vmap` and `jax.grad` go over
    it; it runs on the processor, and there are derivatives backwards alone, and no second ones.

    Raises BadInput for what is not there, cannot change alone, or has no derivatives, and where JAX computes in single
    precision.
    """

    def __init__(  # many: as `planar.prepared`
        self,
        mechanism: Any,
        free: Sequence[str] | str,
        points: Sequence[str] | str | None = None,
        steps: int = 360,
        *,
        rates: bool = False,
        start: float | None = None,
        stop: float | None = None,
        pair: str | None = None,
    ):
        _check_precision()
        self.layer = LinkageLayer(
            mechanism, free, points, steps, rates, RangeArguments(start=start, stop=stop, pair=pair)
        )
        self.file_values = jax.numpy.asarray(self.layer.file_values)
        self._run = _differentiable(self.layer)

    def __call__(self, values: Any) -> tuple[Any, ...]:
        """Positions, rates where there are any, and the mask."""
        _check_precision()
        values = jax.numpy.asarray(values)
        self.layer.check_shape(values.shape)
        if values.dtype != jax.numpy.float64:
            raise BadInput("values", f"double precision is wanted here, not {values.dtype}")
        found: tuple[Any, ...] = self._run(values)
        return found

    def __repr__(self) -> str:
        return f"Linkage({self.layer!r})"


def _check_precision() -> None:
    if not jax.config.jax_enable_x64:
        raise BadInput(
            "jax", 'positions are told in double precision; write jax.config.update("jax_enable_x64", True) first'
        )


def _differentiable(layer: LinkageLayer) -> Callable[[Any], tuple[Any, ...]]:
    """The runs of a layer, with their derivatives."""

    def run_all(values: Any) -> tuple[Any, ...]:
        told, solved = layer.run(values)
        return (*told, solved)

    @jax.custom_vjp
    def run(values: Any) -> tuple[Any, ...]:
        lead = values.shape[:-1]
        told = jax.ShapeDtypeStruct((*lead, *layer.result_shape), jax.numpy.float64)
        solved = jax.ShapeDtypeStruct((*lead, layer.result_shape[0]), jax.numpy.bool_)
        shapes = (*[told] * len(layer.orders), solved)
        found: tuple[Any, ...] = jax.pure_callback(run_all, shapes, values, vmap_method="broadcast_all")
        return found

    def run_and_keep(values: Any) -> tuple[tuple[Any, ...], Any]:
        return run(values), values

    def pull_back(values: Any, weights: tuple[Any, ...]) -> tuple[Any]:
        shape = jax.ShapeDtypeStruct(values.shape, jax.numpy.float64)
        of = jax.pure_callback(
            lambda at, *given: layer.pull_back(at, given), shape, values, *weights[:-1], vmap_method="broadcast_all"
        )
        return (of,)

    run.defvjp(run_and_keep, pull_back)
    checked: Callable[[Any], tuple[Any, ...]] = run
    return checked
