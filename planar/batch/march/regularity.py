"""How regular a block's Jacobian has to be: the volume that its columns span, each of length one."""

from __future__ import annotations

from typing import TypeVar

from planar.foundation.arrays import Array

Number = TypeVar("Number", float, Array)

LEAST_START_REGULARITY = 1e-4
"""Below it a design does not start."""
LEAST_KERNEL_REGULARITY = 1e-2
"""Below it a march does not go on, so that between steps too no two assemblies meet."""
CLEAR_REGULARITY = 0.2
"""From it on no other assembly is near."""


def least_regularity(base: Number, unknowns: int) -> Number:
    """The least volume of a block of so many unknowns; `base` is that of one or two, or of each design's."""
    return base if unknowns <= 2 else base**1.5
