"""The symbols of an exact synthesis: dimensions that are sought, and numbers that are given, as complex pairs."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from planar.foundation.errors import BadInput
from planar.synthesis.exact.relations.polynomials import Symbol, symbol


class NumberKind(Enum):
    """How a given number varies within its family, and what it becomes where the plane moves and grows."""

    PLACE = "place"
    """x + i y of a point; over the complex numbers its conjugate is another number."""
    VECTOR = "vector"
    """The same, which only grows."""
    LENGTH = "length"
    """A real number, its own conjugate."""
    TURN = "turn"
    """e = exp(i angle), whose conjugate is 1/e."""


@dataclass(frozen=True)
class GivenNumber:
    """A number that is given: m, or rad, a value of the file from another one, its `start`."""

    symbol: Symbol
    kind: NumberKind
    value: complex
    start: complex = 0.0


@dataclass
class SymbolTable:
    """Symbols as they are made; `unknowns` are those that are sought."""

    count: int = 0
    unknowns: list[Symbol] = field(default_factory=list)
    given: list[GivenNumber] = field(default_factory=list)

    def add(self) -> Symbol:
        """A symbol for something that is to be eliminated."""
        self.count += 1
        return symbol(self.count - 1)

    def add_unknown(self) -> Symbol:
        """A symbol that is sought."""
        found = self.add()
        self.unknowns.append(found)
        return found

    def add_given(self, kind: NumberKind, value: complex, start: complex = 0.0) -> Symbol:
        """A symbol for a number that is given, from a start."""
        found = self.add()
        self.given.append(GivenNumber(found, kind, value, start))
        return found


def refuse(why: str) -> BadInput:
    """The error for what has no complete list."""
    return BadInput("$", f"no complete list: {why}; without 'complete' the best designs are sought")
