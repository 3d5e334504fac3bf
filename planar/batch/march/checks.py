"""Both parts of the gate for many designs at once, each at the same step."""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np

from planar.batch.march.design_functions import Columns
from planar.equations.functions import Program, placed
from planar.model.mechanism import Mechanism
from planar.solving.checks.branch_check import CLOSE, Branch, allowed, cancelling
from planar.solving.checks.residual_check import EPS, SURELY_KEPT, Gate

Array = np.ndarray

WEAK = 1e-4
"""The volume that the columns of a slope span, each of length one: below it a backend does not go on."""


class Here(NamedTuple):
    """Where all designs are: z (designs, unknowns), u (designs, inputs), with the slopes of F and of the unknowns."""

    z: Array
    u: Array
    slopes: Array
    gains: Array


class Branches(Branch):
    """The second part of the gate, for designs each with its own p (numbers, designs): see `Branch`."""

    def __init__(self, columns: Columns, p: Array):
        super().__init__(columns, p)  # type: ignore[arg-type] - it asks for slopes and equations only

    def here(self, z: Array, u: Array) -> Here:
        """What is judged at a step; z (designs, unknowns), u (designs, inputs)."""
        slopes, drives = self.program.slopes(z, u, self.p)
        return Here(z, u, slopes, _gains(slopes, drives))

    def kept(self, before: Here, after: Here, ahead: Array | None) -> tuple[Array, Array]:
        """Whether each design kept to its branch in a step (designs,), and how far ahead each is from leaving it.

        `ahead` is the latter from the step before, where that went as far as this one.
        """
        way = after.u - before.u
        first, second = ((each.gains @ way[:, :, None])[..., 0] for each in (before, after))
        keeps = np.all(allowed(after.z - before.z, first, second), axis=1) & self._onwards(first, second, way)
        clear = self._safe(before.z, before.u, before.slopes, first, way) if ahead is None else ahead
        further = self._safe(after.z, after.u, after.slopes, second, way)
        return keeps & np.all(clear + further > CLOSE, axis=1), further

    def regular(self, here: Here) -> Array:
        """Whether the slope of every group is regular enough for a backend (designs,)."""
        found = np.ones(len(here.z), dtype=bool)
        for stage in self.program.equations.stages:
            own = here.slopes[:, stage.rows, stage.unknowns]
            if own.size:
                arm = np.minimum(np.linalg.norm(own, axis=1).min(axis=1), 1.0)
                # short arms lose digits too, see `solving.accuracy`
                least = np.maximum(WEAK, np.sqrt(EPS / SURELY_KEPT / np.maximum(arm, 1e-300)))
                found &= volume(own) > (least if own.shape[1] <= 2 else least**1.5)
        return found


def volume(slope: Array) -> Array:
    """The volume that the columns of a slope (designs, rows, unknowns) span, each of length one (designs,)."""
    if slope.shape[1:] == (2, 2):
        a, b, c, d = (slope[:, i, j] for i in (0, 1) for j in (0, 1))
        return np.abs(a * d - b * c) / np.sqrt(np.maximum((a * a + c * c) * (b * b + d * d), 1e-300))
    sizes = np.maximum(np.linalg.norm(slope, axis=1), 1e-300)
    return np.abs(np.linalg.det(slope)) / np.prod(sizes, axis=1)


def _gains(slopes: Array, drives: Array) -> Array:
    """The rates of the unknowns by those of the inputs; not numbers where a slope is singular."""
    many = slopes.shape[-1]
    if many == 2:
        a, b, c, d = (slopes[:, i, j, None] for i in (0, 1) for j in (0, 1))
        one, two = drives[:, 0], drives[:, 1]
        return np.stack([b * two - d * one, c * one - a * two], axis=1) / (a * d - b * c)[:, None]
    return cancelling(slopes, drives)


class Closed:
    """The first part of the gate, for designs each with its own p (numbers, designs), in units of the size."""

    def __init__(self, gate: Gate, mechanism: Mechanism, program: Program, p: Array):
        self.mechanism, self.program = mechanism, program
        self.gate = copy(gate)
        self.gate.unit = 1.0
        ends = np.cumsum([len(pair.measures) for pair in mechanism.pairs])
        self.gate.numbers = {
            pair.name: tuple(part) for pair, part in zip(mechanism.pairs, np.split(p, ends[:-1]), strict=True)
        }
        # a pin of many links has motions between links that no pair of its own joins
        for given in mechanism.inputs:
            self.gate.numbers.setdefault(given.pair, tuple(gate.numbers[given.pair]))
        self.column = {(c.owner, c.part): index for index, c in enumerate(program.equations.coordinates)}
        self.links = [link.name for link in mechanism.links]
        self.pairs = {pair.name: pair for pair in mechanism.pairs}

    def placed(self, w):  # noqa: ANN001, ANN201 - arrays or jets alike
        """Frames of links and own coordinates of pairs from w (coordinates, designs)."""
        return placed(w, self.column, self.links, self.pairs)

    def exact(self, w: Array) -> Array:
        """Whether no angle or length is so great that rounding takes digits of it (designs,)."""
        return EPS * np.abs(w).max(axis=0, initial=0.0) <= np.pi * SURELY_KEPT

    def left(self, w: Array, u: Array) -> Array:
        """What the worst constraint leaves open (designs,); w (coordinates, designs), u (inputs, designs)."""
        frames, own = self.placed(w)
        gaps = self.gate.gaps(frames, own, u)
        return np.broadcast_to(gaps.max(axis=0, initial=0.0), w.shape[1:] or u.shape[1:])
