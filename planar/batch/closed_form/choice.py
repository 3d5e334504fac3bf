"""Which joiner of blocks is there for a structure: machine code, else numpy."""

from __future__ import annotations

from functools import lru_cache

from planar.batch.closed_form.joined_blocks import BlockJoiner
from planar.batch.closed_form.numpy_joiner import NumpyBlockJoiner
from planar.batch.march.backend import DesignBatch
from planar.batch.march.choice import available_backends
from planar.batch.march.kernel import KernelEquations, batch_equations
from planar.foundation.instruction_list import UnsupportedOperation


def find_joiner(batch: DesignBatch, point_blocks: tuple[int, ...], backend: str) -> BlockJoiner | None:
    """What joins the blocks of a batch, whose points are placed by these blocks; None where one is not in closed
    form, or stands in an angle's own value."""
    try:
        equations = batch_equations(batch)
    except UnsupportedOperation:
        return None
    if equations.has_newton_blocks or not equations.blocks:
        return None
    return _make_joiner(equations, batch.links, point_blocks, "native" in available_backends(backend))


@lru_cache(maxsize=256)
def _make_joiner(
    equations: KernelEquations, links: tuple[str, ...], point_blocks: tuple[int, ...], is_native: bool
) -> BlockJoiner | None:
    try:
        if is_native:
            from planar.batch.closed_form.llvm_joiner import NativeBlockJoiner

            return NativeBlockJoiner(equations, links, point_blocks)
        return NumpyBlockJoiner(equations, links, point_blocks)
    except UnsupportedOperation:
        return None
