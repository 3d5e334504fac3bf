"""Whether the file of a design meets entries to round-off, each in the assembly that comes nearest."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.document.dimensions import file_dimensions
from planar.document.files import from_dict, to_dict
from planar.foundation.arrays import Array
from planar.foundation.errors import PlanarError
from planar.model.mechanism import Mechanism
from planar.synthesis.judgement.design_assemblies import DesignAssemblies
from planar.synthesis.judgement.misses import result_differences, wanted_results
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction

ROUND_OFF = 1024.0 * float(np.finfo(float).eps)
"""Of the greatest length: what the numbers of a file and the positions of its input are out by; results are out by as
much times the condition of the position."""
EXACT = 1e-6
"""Of the extent of what is wanted, or rad: a file that misses more meets nothing, however ill-conditioned it is."""


class FileCheck(NamedTuple):
    """A mechanism read from its own file, and how it meets entries there.

    `results` (n, parts) of each item are what it is to show, `misses` (n,) how far it is from that (m or rad) in the
    assembly that comes nearest, infinite where it cannot be assembled; `tolerances` (n,) are what round-off explains.
    """

    mechanism: Mechanism
    results: tuple[Array, ...]
    misses: tuple[Array, ...]
    tolerances: tuple[Array, ...]
    scales: tuple[float, ...]
    "what misses of each item are compared with: rad, or the extent of what is wanted (m)"

    @property
    def is_met(self) -> bool:
        """Whether every entry is met to round-off."""
        limits = [np.minimum(own, EXACT * scale) for own, scale in zip(self.tolerances, self.scales, strict=True)]
        return all(bool((off <= limit).all()) for off, limit in zip(self.misses, limits, strict=True))

    @property
    def is_rounded(self) -> bool:
        """Whether round-off explains all misses."""
        return all(bool((off <= limit).all()) for off, limit in zip(self.misses, self.tolerances, strict=True))

    @property
    def worst(self) -> tuple[int, int]:
        """The item and the entry that are missed most, of what each is compared with."""
        every = [float(off.max()) / scale for off, scale in zip(self.misses, self.scales, strict=True)]
        item = int(np.argmax(every))
        return item, int(np.argmax(self.misses[item]))


def read_back(mechanism: Mechanism) -> Mechanism:
    """A mechanism from the text of its own file. Raises BadInput."""
    return from_dict(json.loads(json.dumps(to_dict(mechanism))))


def check_file(mechanism: Mechanism, wanted: Sequence[Wanted], inputs: Sequence[Array], size: float) -> FileCheck:
    """How the file of a mechanism meets wanted items at positions (n,) of its running input, the first of which is that
    of its sketch; `size` (m) is the extent of what is wanted. Raises BadInput where the file cannot be read."""
    again = read_back(mechanism)
    lengths = [abs(each.value) for each in file_dimensions(again).values() if each.kind == "length"]
    try:
        design = DesignAssemblies(again)
    except PlanarError:
        design = None
    results, misses, tolerances, scales = [], [], [], []
    for each, positions in zip(wanted, inputs, strict=True):
        result, is_angle = wanted_results(each), design is None or design.measures_angle(each)
        scale = 1.0 if isinstance(each, WantedFunction) and is_angle else size
        if design is None:
            none = np.full(len(result), np.inf)
            off, within = none, 0.0 * result[:, 0]
        else:
            if isinstance(each, WantedFunction) and not each.is_absolute:  # counted from the first entry
                first = design.results(each, design.home[None], positions[:1])
                result = result - result[:1] + first
            off, within = _entries(design, each, result, positions, size)
        results.append(result)
        misses.append(off)
        tolerances.append(within * ROUND_OFF * scale * max(1.0, *(length / size for length in lengths)))
        scales.append(scale)
    return FileCheck(again, tuple(results), tuple(misses), tuple(tolerances), tuple(scales))


def _entries(
    design: DesignAssemblies, wanted: Wanted, results: Array, positions: Array, size: float
) -> tuple[Array, Array]:
    """How far entries are from results (n, parts) at positions (n,) in the assembly that comes nearest (n,), and the
    condition of that (n,)."""
    misses, conditions = np.full(len(positions), np.inf), np.ones(len(positions))
    for k, position in enumerate(positions.tolist()):
        z = design.at(position)
        if not len(z):
            continue
        shown = design.results(wanted, z, np.full(len(z), position))
        off = result_differences(wanted, shown, results[k], size, design.measures_angle(wanted))
        nearest = int(np.argmin(off))
        misses[k], conditions[k] = off[nearest], design.condition(z[nearest], position)
    return misses, conditions
