"""A row of four-bars as a linkage for every solver: its last pin is asked for; no dimension varies."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from benchmarks import chain
from benchmarks.swept.base import Array, Dimension, Swept


class Row(Swept):
    """Of so many links."""

    name: ClassVar[str] = "row of four-bars"
    limit: ClassVar[str] = "row"
    dimensions: ClassVar[tuple[Dimension, ...]] = ()

    def __init__(self, links: int):
        self.links = links
        self.cells = np.array([[cell.a, cell.b, cell.c, cell.g] for cell in chain.cells(links)])

    @property
    def point(self) -> str:  # type: ignore[override]
        return f"C{len(self.cells)}"

    def document(self) -> dict[str, Any]:
        return chain.document(self.links)

    def motion(self, d: Array, theta: Array) -> Array:
        """Positions alone (2, steps, 1)."""
        angle = chain.motion(np, self.links, theta)[0]
        length = self.cells[-1, 2]
        pivot = self.cells[:, 3].sum()
        return np.stack([pivot + length * np.cos(angle), length * np.sin(angle)])[..., None]
