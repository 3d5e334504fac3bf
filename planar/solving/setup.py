"""One mechanism made ready to be solved and judged: its program, its numbers, its gate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.algebra import Jet, Scalar
from planar.errors import BadInput
from planar.mechanism import Mechanism, check, misfits, motions
from planar.pairs import Kind
from planar.plane import Frame
from planar.program import Program, extent, fitted, placed, positions, program, rates, shapes, size
from planar.solving.gate import Gate
from planar.words import amount, listed

Array = np.ndarray


class Station(NamedTuple):
    """The numbers of one position: inputs u with their rates (scaled), and the numbers p of the pairs."""

    u: Array
    u1: Array
    u2: Array
    p: Array


class Setup:
    """What does not change from one position of a mechanism to the next, and what the file's own inputs are."""

    def __init__(self, mechanism: Mechanism):
        check(mechanism)
        self.mechanism = mechanism
        self.shapes = shapes(mechanism)
        for pair, wrong in misfits(mechanism.pairs, self.shapes, mechanism.units):
            raise BadInput(pair.name, wrong)
        self.unit = size(mechanism, self.shapes)
        self.program: Program = program(mechanism)
        self.equations = self.program.equations
        self.gate = Gate(mechanism, self.shapes, self.unit)
        self.column = {(c.owner, c.part): index for index, c in enumerate(self.equations.coordinates)}
        self.pairs = {pair.name: pair for pair in mechanism.pairs}
        self.named = motions(mechanism)
        self.scale = np.array([self.unit if c.kind is Kind.LENGTH else 1.0 for c in self.equations.coordinates])
        self.reach = {name: extent(shape) / self.unit for name, shape in self.shapes.items()}
        self.station = Station(
            positions(mechanism, self.unit),
            rates(mechanism, "velocity", self.unit),
            rates(mechanism, "acceleration", self.unit),
            fitted(mechanism, self.shapes, self.unit),
        )

    @property
    def tolerance(self) -> float:
        """What the gate lets pass: round-off of the residual, in lengths of the size."""
        return self.gate.tolerance

    def gaps(self, z: Array, u: Array) -> Array:
        """What every constraint leaves open (constraints, samples); z (samples, unknowns), u (samples, inputs)."""
        w = self.program.positions(z.T, u.T, self.station.p).full()
        scale = np.array([self.unit if self.slides(given.pair) else 1.0 for given in self.mechanism.inputs])
        with np.errstate(invalid="ignore"):  # what is not a number counts as open, and is refused as such
            frames, own = placed(w * self.scale[:, None], self.column, self.shapes, self.pairs)
            return self.gate.gaps(frames, own, u.T * scale[:, None]).reshape(-1, len(z))

    def coordinates(self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Scalar]]) -> Array:
        """w (coordinates,) where the links' frames and the pairs' own coordinates are, jets or numbers (m, rad)."""
        parts = {(link, name): getattr(frame, name) for link, frame in frames.items() for name in ("x", "y", "angle")}
        for pair, values in own.items():
            parts |= {
                (pair, name): value for (name, _), value in zip(self.pairs[pair].coordinates, values, strict=True)
            }
        found = (parts[each.owner, each.part] for each in self.equations.coordinates)
        return np.array([value.parts[0] if isinstance(value, Jet) else value for value in found]) / self.scale

    def open_along(self, z: Array, u: Array) -> Array:
        """What the worst constraint leaves open at every sample (samples,)."""
        return self.gaps(z, u).max(axis=0, initial=0.0)

    def at(self) -> str:
        """The file's own position in words: at A = 60 deg."""
        return f"at {self.where(self.station.u)}" if self.mechanism.inputs else "as drawn"

    def where(self, u: Array) -> str:
        """A position of the inputs in words: A = 60 deg."""
        return listed([self.told(given.pair, at) for given, at in zip(self.mechanism.inputs, u, strict=True)])

    def told(self, pair: str, position: float) -> str:
        """A position of one input in words."""
        kind, by = ("length", self.unit) if self.slides(pair) else ("angle", 1.0)
        return f"{pair} = {amount(position * by, kind, self.mechanism.units)}"

    def slides(self, pair: str) -> bool:
        """Whether the relative motion at a pair is a length."""
        return self.named[pair].drive_kind is Kind.LENGTH
