"""Partial assemblies of many designs at once, as blocks are added to them one after the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

Array = np.ndarray


class PartialAssemblies(NamedTuple):
    """Partial assemblies of all designs: z (unknowns, designs, ways), which of the ways there are (designs, ways), and
    what they are told apart by: the squared distance to the sketch, and for each block how its slides and points lie.
    """

    z: Array
    exists: Array
    distance: Array
    tie_keys: tuple[Array, ...] = ()

    def select(self, designs: Array) -> PartialAssemblies:
        """Those of some designs."""
        lying = tuple(each[designs] for each in self.tie_keys)
        return PartialAssemblies(self.z[:, designs], self.exists[designs], self.distance[designs], lying)

    def replace(self, designs: Array, others: PartialAssemblies) -> PartialAssemblies:
        """The same with other ones of some designs; of the two as many ways as there are of either."""
        width = max(self.exists.shape[1], others.exists.shape[1])

        def merged(own: Array, of_others: Array) -> Array:
            filled = [(0, 0)] * (own.ndim - 1)
            whole, part = (
                np.pad(each, [*filled, (0, width - each.shape[-1])], mode="edge" if each.dtype != bool else "constant")
                for each in (own, of_others)
            )
            whole[..., designs, :] = part
            return whole

        lying = tuple(merged(*both) for both in zip(self.tie_keys, others.tie_keys, strict=True))
        return PartialAssemblies(
            merged(self.z, others.z),
            merged(self.exists, others.exists),
            merged(self.distance, others.distance),
            lying,
        )
