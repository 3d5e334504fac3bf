"""A design in another place, of another size, and turned: by its free numbers and unknowns."""

from __future__ import annotations

import cmath
from dataclasses import dataclass

import numpy as np

from planar.foundation.arrays import Array, IntArray
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.synthesis.fitting.wanted_equations import WantedEquations
from planar.synthesis.task.starts import FreeNumbers


@dataclass(frozen=True)
class MovedNumbers:
    """Which of a design's numbers are lengths, places in the frame's axes, and angles against these."""

    lengths: IntArray
    places: tuple[tuple[int, int], ...]
    angles: IntArray
    own_lengths: IntArray
    "among the unknowns, and the input"
    own_angles: IntArray

    def move(self, x: Array, y: Array, factor: complex, offset: complex) -> tuple[Array, Array]:
        """Scaled free numbers (free,) and unknowns (n, unknowns) where every place p is at factor * p + offset, which
        is in the numbers' scale."""
        x, y, size, turn = x.copy(), y.copy(), abs(factor), cmath.phase(factor)
        x[self.lengths] *= size
        for first, second in self.places:
            at = factor * complex(x[first], x[second]) + offset
            x[first], x[second] = at.real, at.imag
        x[self.angles] += turn
        y[:, self.own_lengths] *= size
        y[:, self.own_angles] += turn
        return x, y

    def factors(self, x: Array, lower: Array, upper: Array) -> Array | None:
        """The least and the greatest size (designs, 2) by which scaled free numbers (designs, free) may grow between
        their bounds; None where bounds of places or of angles in the frame hold designs where they are."""
        is_bound = np.isfinite(lower) | np.isfinite(upper)
        held = [*self.angles.tolist(), *(k for place in self.places for k in place)]
        if is_bound[held].any():
            return None
        own = self.lengths[is_bound[self.lengths]]
        size, low, high = x[:, own], lower[own], upper[own]
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([low / size, high / size])
        ends = np.where(size == 0.0, np.array([0.0, np.inf])[:, None, None], ends)
        least = np.maximum(ends.min(axis=0).max(axis=1, initial=0.0), 0.0)
        most = ends.max(axis=0).min(axis=1, initial=np.inf)
        return np.stack([np.minimum(least, 1.0), np.maximum(most, 1.0)], axis=1)


def moved_numbers(equations: WantedEquations, free: FreeNumbers) -> MovedNumbers:
    """How a mechanism's free numbers follow where it is moved as a whole."""
    design = equations.design
    mechanism, frame = design.mechanism, design.mechanism.frame
    known = {each.name: each for each in design.dimensions}
    by_place: dict[str, dict[str, int]] = {}
    lengths, angles = [], []
    for k, name in enumerate(free.names):
        dimension = known[name]
        on_frame = dimension.path[:2] == ("links", frame) or (
            dimension.path[0] == "pairs" and _is_guided_by_frame(mechanism, name)
        )
        stem, _, part = name.rpartition(".")
        if dimension.kind == "length" and on_frame and part in ("x", "y"):
            by_place.setdefault(stem, {})[part] = k
        elif dimension.kind == "length":
            lengths.append(k)
        elif dimension.kind == "angle" and dimension.path[0] == "pairs" and on_frame and "line" in name:
            angles.append(k)
    kinds = [design.equations.coordinates[k] for k in design.equations.unknowns]
    own_lengths = [k for k, each in enumerate(kinds) if each.kind is MeasureKind.LENGTH]
    own_angles = [k for k, each in enumerate(kinds) if each.kind is MeasureKind.ANGLE and each.of_link]
    running = relative_motions(mechanism)[mechanism.inputs[0].pair]
    if running.input_kind is MeasureKind.LENGTH:
        own_lengths.append(len(kinds))
    elif running.links[0] == frame:
        own_angles.append(len(kinds))
    return MovedNumbers(
        np.array(lengths, int),
        tuple((each["x"], each["y"]) for each in by_place.values() if len(each) == 2),
        np.array(angles, int),
        np.array(own_lengths, int),
        np.array(own_angles, int),
    )


def _is_guided_by_frame(mechanism: Mechanism, name: str) -> bool:
    pair = next((each for each in mechanism.pairs if name.startswith(f"{each.name}.")), None)
    return pair is not None and mechanism.frame in pair.links
