"""The circuit and branch on which each assembly at one position of the inputs lies."""

from __future__ import annotations

from itertools import islice
from typing import NamedTuple

from planar.assemblies.circuits.circuits import Circuit, Circuits
from planar.assemblies.circuits.traced_circuit import Branch
from planar.assemblies.modes import Mode, Modes

MAX_LOCATED = 64
"""Assemblies that are located."""


class LocatedAssembly(NamedTuple):
    """One assembly, its circuit and its branch there (None where it lies on none that was followed)."""

    mode: Mode
    circuit: Circuit | None
    branch: Branch | None
    is_sketched: bool
    "whether it is the one that the sketch means"

    def is_on(self, circuit: Circuit, branch: Branch | None = None) -> bool:
        """Whether it lies on a circuit, and there on a branch."""
        if self.circuit is None or self.circuit.number != circuit.number:
            return False
        return branch is None or (self.branch is not None and self.branch.number == branch.number)


def locate_assemblies(circuits: Circuits, modes: Modes) -> tuple[LocatedAssembly, ...]:
    """The first assemblies at the inputs of a list, with their circuits and branches."""
    near = modes.nearest
    found = []
    for mode in islice(modes, MAX_LOCATED):
        circuit, branch = circuits.of(mode) or (None, None)
        found.append(LocatedAssembly(mode, circuit, branch, near is not None and near.choices == mode.choices))
    return tuple(found)
