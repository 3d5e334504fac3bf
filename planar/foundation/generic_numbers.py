"""Numbers at which no identity holds by accident, the same each time."""

from __future__ import annotations

from math import log
from random import Random  # numpy's takes longer to load than a small mechanism to solve

import numpy as np

from planar.foundation.arrays import Array

LEAST, GREATEST = 0.5, 2.0


def generic_numbers(*shape: int, seed: int = 0) -> Array:
    """Numbers about one, spread at random, of which products are about one as well."""
    draw = Random(seed).uniform
    powers = [draw(log(LEAST), log(GREATEST)) for _ in range(int(np.prod(shape)))]
    numbers: Array = np.exp(np.array(powers, dtype=float))
    return numbers.reshape(shape)
