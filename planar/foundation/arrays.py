"""Types of arrays, for annotations: of numbers, of whole numbers, of truth values, of complex numbers."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.floating[Any]]
"""Of float64, as all numbers here; what numpy's linear algebra returns is annotated no closer."""
IntArray: TypeAlias = NDArray[np.integer[Any]]
BoolArray: TypeAlias = NDArray[np.bool_]
ComplexArray: TypeAlias = NDArray[np.complexfloating[Any, Any]]
