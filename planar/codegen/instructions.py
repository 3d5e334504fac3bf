"""A casadi SX function as a list of instructions: each value once, in an order in which they can be computed."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import cos, sin
from typing import NamedTuple

import casadi as ca

UNARY = {
    ca.OP_NEG: "neg",
    ca.OP_SQRT: "sqrt",
    ca.OP_COS: "cos",
    ca.OP_SIN: "sin",
    ca.OP_FABS: "abs",
}
FOLDED: dict[str, Callable[..., float]] = {
    "neg": operator.neg,
    "cos": cos,
    "sin": sin,
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
}
"""What is computed at once of constants."""
BINARY = {
    ca.OP_ADD: "add",
    ca.OP_SUB: "sub",
    ca.OP_MUL: "mul",
    ca.OP_DIV: "div",
    ca.OP_ATAN2: "atan2",
    ca.OP_FMIN: "minnum",
    ca.OP_FMAX: "maxnum",
}


WHOLE = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
"""Multiples of an angle that are put together from its own cos and sin."""


MOST_INSTRUCTIONS = 16_000
"""Of one function: longer ones would take more than about a second to compile."""


class NotPrinted(Exception):
    """What other machines are not told; the text says why."""


def check_length(instructions: int) -> None:
    """Raises NotPrinted for more instructions than one function may have."""
    if instructions > MOST_INSTRUCTIONS:
        raise NotPrinted(f"more than {MOST_INSTRUCTIONS} instructions take too long to compile")


class Value(NamedTuple):
    """One value: what makes it ("const", "input", "add", ...), of which values, and a constant or the input's place."""

    what: str
    of: tuple[int, ...] = ()
    data: float | tuple[int, int] | str = 0.0


class Listing:
    """Values by number, each of which is made once, however often it is asked for."""

    def __init__(self) -> None:
        self.values: list[Value] = []
        self._known: dict[Value, int] = {}

    def add(self, what: str, *of: int, data: float | tuple[int, int] | str = 0.0) -> int:
        """The number of a value; sums and products with nothing and one are not made."""
        short = self._short(what, of)
        if short is not None:
            return short
        if what in ("add", "mul") and of[0] > of[1]:
            of = (of[1], of[0])
        value = Value(what, of, data)
        if value not in self._known:
            self._known[value] = len(self.values)
            self.values.append(value)
        return self._known[value]

    def const(self, number: float) -> int:
        """A constant."""
        return self.add("const", data=float(number))

    def number(self, value: int) -> float | None:
        """What a constant is; None for another value."""
        return float(self.values[value].data) if self.values[value].what == "const" else None

    def _short(self, what: str, of: tuple[int, ...]) -> int | None:
        """A value that is known already: a constant, or one of those that it would be made of."""
        known = [self.number(each) for each in of]
        if of and None not in known and what in FOLDED and (what != "div" or known[1]):
            return self.const(FOLDED[what](*known))
        idle = {"add": 0.0, "mul": 1.0, "sub": 0.0, "div": 1.0}.get(what)
        if idle is not None and known[1] == idle:
            return of[0]
        if what in ("add", "mul") and known[0] == idle:
            return of[1]
        if (what == "mul" and 0.0 in known) or (what == "div" and known[0] == 0.0) or self._cancels(what, of):
            return self.const(0.0)
        if what == "sub" and known[0] == 0.0:
            return self.add("neg", of[1])
        inside = self.values[of[0]] if what == "neg" else None
        return inside.of[0] if inside is not None and inside.what == "neg" else None

    def _cancels(self, what: str, of: tuple[int, ...]) -> bool:
        """Whether a sum or difference is of a value and the same taken away."""
        if what == "add":
            return any(self.values[a] == Value("neg", (b,)) for a, b in (of, of[::-1]))
        return what == "sub" and of[0] == of[1]

    def inlined(self, function: ca.Function, inputs: list[list[int]]) -> list[list[int]]:
        """A function of values: the numbers of its results, dense, column by column. Raises NotPrinted."""
        work: dict[int, int] = {}
        found = [[self.const(0.0)] * function.numel_out(k) for k in range(function.n_out())]
        places = [function.sparsity_out(k).find() for k in range(function.n_out())]
        for k in range(function.n_instructions()):
            code, out = function.instruction_id(k), function.instruction_output(k)
            of = function.instruction_input(k)
            if code == ca.OP_INPUT:
                work[out[0]] = inputs[of[0]][of[1]]
            elif code == ca.OP_CONST:
                work[out[0]] = self.const(function.instruction_constant(k))
            elif code == ca.OP_OUTPUT:
                found[out[0]][places[out[0]][out[1]]] = work[of[0]]
            else:
                work[out[0]] = self._made(code, [work[each] for each in of])
        return found

    def _made(self, code: int, of: list[int]) -> int:
        if code in BINARY:
            return self.add(BINARY[code], of[0], of[1])
        if code in UNARY:
            return self.add(UNARY[code], of[0])
        if code == ca.OP_SQ:
            return self.add("mul", of[0], of[0])
        if code == ca.OP_TWICE:
            return self.add("add", of[0], of[0])
        if code == ca.OP_INV:
            return self.add("div", self.const(1.0), of[0])
        if code == ca.OP_ASSIGN:
            return of[0]
        raise NotPrinted(f"operation {code}")


def needed(listing: Listing, wanted: Iterable[int]) -> list[int]:
    """The values on which the wanted ones depend, and these, in their order."""
    found: set[int] = set()
    stack = list(wanted)
    while stack:
        each = stack.pop()
        if each not in found:
            found.add(each)
            stack += listing.values[each].of
    return sorted(found)


class Turned(NamedTuple):
    """An angle's cos and sin, as values."""

    cos: int
    sin: int


def without_turning(listing: Listing, wanted: list[int], angles: Mapping[int, Turned]) -> tuple[Listing, list[int]]:
    """The same values with no cos and sin of known angles in them: these are put together from the angles' own.

    cos(a + b) = cos a cos b - sin a sin b. Angles of which other multiples stand in a sum, or that stand elsewhere,
    keep their own values.
    """
    turning = _Turning(listing, angles)
    numbers = turning.again(wanted)
    return turning.made, numbers


class _Sum(NamedTuple):
    """A value as a sum of whole multiples of angles and a rest without any (none: zero)."""

    factors: Mapping[int, int]
    rest: int | None


class _Turning:
    """Makes a listing again, with the angles' own cos and sin."""

    def __init__(self, listing: Listing, angles: Mapping[int, Turned]):
        self.listing, self.angles, self.made = listing, angles, Listing()
        self.number: dict[int, int] = {}
        self.sums: dict[int, _Sum | None] = {}

    def again(self, wanted: Sequence[int]) -> list[int]:
        """The numbers of wanted values in what is made."""
        for each in needed(self.listing, [*wanted, *(part for turned in self.angles.values() for part in turned)]):
            value = self.listing.values[each]
            self.sums[each] = self._sum(each, value)
            inside = self.sums[value.of[0]] if value.of else None
            if value.what in ("cos", "sin") and inside is not None and inside.factors:
                self.number[each] = getattr(self._turned(inside), value.what)
            else:
                self.number[each] = self.made.add(value.what, *(self.number[k] for k in value.of), data=value.data)
        return [self.number[each] for each in wanted]

    def _turned(self, inside: _Sum) -> Turned:
        made = self.made
        c, s = made.const(1.0), made.const(0.0)
        if inside.rest is not None:
            c, s = made.add("cos", inside.rest), made.add("sin", inside.rest)
        for leaf, factor in sorted(inside.factors.items()):
            cos_of, sin_of = (self.number[part] for part in self.angles[leaf])
            sin_of = sin_of if factor > 0 else made.add("neg", sin_of)
            for _ in range(abs(factor)):
                c, s = (
                    made.add("sub", made.add("mul", c, cos_of), made.add("mul", s, sin_of)),
                    made.add("add", made.add("mul", s, cos_of), made.add("mul", c, sin_of)),
                )
        return Turned(c, s)

    def _sum(self, each: int, value: Value) -> _Sum | None:
        if each in self.angles:
            return _Sum({each: 1}, None)
        of = [self.sums[k] for k in value.of]
        if any(part is None for part in of):
            return None
        if not any(part.factors for part in of):
            return _Sum({}, self.made.add(value.what, *(self.number[k] for k in value.of), data=value.data))
        if value.what in ("add", "sub"):
            return self._plus(of[0], of[1] if value.what == "add" else self._times(of[1], -1))
        if value.what == "neg":
            return self._times(of[0], -1)
        known = [(self.listing.number(k), other) for k, other in zip(value.of, of[::-1], strict=True)]
        whole = [(other, int(times)) for times, other in known if value.what == "mul" and times in WHOLE]
        return self._times(*whole[0]) if whole else None

    def _times(self, part: _Sum, times: int) -> _Sum:
        rest = None if part.rest is None else self.made.add("mul", self.made.const(times), part.rest)
        return _Sum({leaf: times * factor for leaf, factor in part.factors.items()}, rest)

    def _plus(self, first: _Sum, second: _Sum) -> _Sum:
        leaves = {**first.factors, **second.factors}
        factors = {leaf: first.factors.get(leaf, 0) + second.factors.get(leaf, 0) for leaf in leaves}
        rests = [part.rest for part in (first, second) if part.rest is not None]
        rest = self.made.add("add", *rests) if len(rests) == 2 else rests[0] if rests else None
        return _Sum({leaf: factor for leaf, factor in factors.items() if factor}, rest)
