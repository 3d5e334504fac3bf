"""A casadi SX function as a list of instructions: each value once, in an order in which they can be computed."""

from __future__ import annotations

import operator
from collections.abc import Callable, Container, Hashable, Iterable, Mapping, Sequence
from math import cos, sin
from typing import Any, Generic, NamedTuple, TypeVar

import casadi as ca

from planar.codegen.generic_evaluation import evaluate_function

UNARY_OPERATIONS = {
    ca.OP_NEG: "neg",
    ca.OP_SQRT: "sqrt",
    ca.OP_COS: "cos",
    ca.OP_SIN: "sin",
    ca.OP_FABS: "abs",
    ca.OP_FLOOR: "floor",
}
FOLDABLE_OPERATIONS: dict[str, Callable[..., float]] = {
    "neg": operator.neg,
    "cos": cos,
    "sin": sin,
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
}
"""What is computed at once of constants."""
BINARY_OPERATIONS = {
    ca.OP_ADD: "add",
    ca.OP_SUB: "sub",
    ca.OP_MUL: "mul",
    ca.OP_DIV: "div",
    ca.OP_ATAN2: "atan2",
    ca.OP_FMIN: "minnum",
    ca.OP_FMAX: "maxnum",
    ca.OP_LT: "less",
    ca.OP_LE: "most",
}


ANGLE_MULTIPLES = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
"""Multiples of an angle that are put together from its own cos and sin."""


MAX_INSTRUCTIONS = 14_000
"""Of one function: longer ones would take more than about a second to compile."""


class UnsupportedOperation(Exception):
    """What other machines are not told; the text says why."""


def check_length(instructions: int) -> None:
    """Raises UnsupportedOperation for more instructions than one function may have."""
    if instructions > MAX_INSTRUCTIONS:
        raise UnsupportedOperation(f"more than {MAX_INSTRUCTIONS} instructions take too long to compile")


Key = TypeVar("Key", bound=Hashable)
"""What tells the inputs of a list from each other, as whoever writes the code knows them."""


class Instruction(NamedTuple, Generic[Key]):
    """One value: what makes it ("const", "input", "add", ...), of which values, a constant's number, an input's key."""

    operation: str
    operands: tuple[int, ...] = ()
    number: float = 0.0
    key: Key | None = None


class InstructionList(Generic[Key]):
    """Values by number, each of which is made once, however often it is asked for."""

    def __init__(self) -> None:
        self.instructions: list[Instruction[Key]] = []
        self._known: dict[Instruction[Key], int] = {}

    def add(self, what: str, *of: int, number: float = 0.0, key: Key | None = None) -> int:
        """The number of a value; sums and products with nothing and one are not made."""
        short = self._simplify(what, of)
        if short is not None:
            return short
        if what in ("add", "mul") and of[0] > of[1]:
            of = (of[1], of[0])
        value = Instruction(what, of, number, key)
        if value not in self._known:
            self._known[value] = len(self.instructions)
            self.instructions.append(value)
        return self._known[value]

    def add_constant(self, number: float) -> int:
        """A constant."""
        return self.add("const", number=float(number))

    def add_input(self, key: Key) -> int:
        """A value from outside."""
        return self.add("input", key=key)

    def add_again(self, value: Instruction[Key], operands: Iterable[int]) -> int:
        """An instruction of another list, of values of this one."""
        return self.add(value.operation, *operands, number=value.number, key=value.key)

    def constant_value(self, value: int) -> float | None:
        """What a constant is; None for another value."""
        return self.instructions[value].number if self.instructions[value].operation == "const" else None

    def _simplify(self, what: str, of: tuple[int, ...]) -> int | None:
        """A value that is known already: a constant, or one of those that it would be made of."""
        known = [self.constant_value(each) for each in of]
        if of and None not in known and what in FOLDABLE_OPERATIONS and (what != "div" or known[1]):
            return self.add_constant(FOLDABLE_OPERATIONS[what](*known))
        idle = {"add": 0.0, "mul": 1.0, "sub": 0.0, "div": 1.0}.get(what)
        if idle is not None and known[1] == idle:
            return of[0]
        if what in ("add", "mul") and known[0] == idle:
            return of[1]
        if (what == "mul" and 0.0 in known) or (what == "div" and known[0] == 0.0) or self._cancels(what, of):
            return self.add_constant(0.0)
        if what == "sub" and known[0] == 0.0:
            return self.add("neg", of[1])
        inside = self.instructions[of[0]] if what == "neg" else None
        return inside.operands[0] if inside is not None and inside.operation == "neg" else None

    def _cancels(self, what: str, of: tuple[int, ...]) -> bool:
        """Whether a sum or difference is of a value and the same taken away."""
        if what == "add":
            return any(self.instructions[a] == Instruction("neg", (b,)) for a, b in (of, of[::-1]))
        return what == "sub" and of[0] == of[1]

    def inline_function(self, function: ca.Function, inputs: list[list[int]]) -> list[list[int]]:
        """A function of values: the numbers of its results, dense, column by column. Raises NotPrinted."""
        return evaluate_function(function, inputs, self.add_constant, self._add_operation)

    def _add_operation(self, code: int, of: list[int]) -> int:
        if code in BINARY_OPERATIONS:
            return self.add(BINARY_OPERATIONS[code], of[0], of[1])
        if code in UNARY_OPERATIONS:
            return self.add(UNARY_OPERATIONS[code], of[0])
        if code in (ca.OP_SQ, ca.OP_TWICE):
            return self.add("mul" if code == ca.OP_SQ else "add", of[0], of[0])
        if code == ca.OP_INV:
            return self.add("div", self.add_constant(1.0), of[0])
        if code == ca.OP_ASSIGN:
            return of[0]
        return self._add_step(code, of[0])

    def _add_step(self, code: int, of: int) -> int:
        """What derivatives of pieces are made of."""
        if code == ca.OP_SIGN:
            zero = self.add_constant(0.0)
            return self.add("sub", self.add("less", zero, of), self.add("less", of, zero))
        if code == ca.OP_NOT:
            return self.add("sub", self.add_constant(1.0), of)
        raise UnsupportedOperation(f"operation {code}")


def required_values(instructions: InstructionList[Any], wanted: Iterable[int], known: Container[int] = ()) -> list[int]:
    """The values on which the wanted ones depend, and these, in their order; not what known ones are made of."""
    required: set[int] = set()
    stack = list(wanted)
    while stack:
        each = stack.pop()
        if each not in required:
            required.add(each)
            if each not in known:
                stack += instructions.instructions[each].operands
    return sorted(required)


class CosSin(NamedTuple):
    """An angle's cos and sin, as values."""

    cos: int
    sin: int


def expand_angle_sums(
    listing: InstructionList[Key], wanted: list[int], angles: Mapping[int, CosSin]
) -> tuple[InstructionList[Key], list[int]]:
    """The same values with no cos and sin of known angles in them: these are put together from the angles' own.

    cos(a + b) = cos a cos b - sin a sin b. Angles of which other multiples stand in a sum, or that stand elsewhere,
    keep their own values.
    """
    turning = _AngleSumExpander(listing, angles)
    numbers = turning.rebuild(wanted)
    return turning.result, numbers


class _AngleSum(NamedTuple):
    """A value as a sum of whole multiples of angles and a rest without any (none: zero)."""

    factors: Mapping[int, int]
    rest: int | None


class _AngleSumExpander(Generic[Key]):
    """Makes a listing again, with the angles' own cos and sin."""

    def __init__(self, listing: InstructionList[Key], angles: Mapping[int, CosSin]):
        self.source, self.angles = listing, angles
        self.result: InstructionList[Key] = InstructionList()
        self.new_numbers: dict[int, int] = {}
        self.sums: dict[int, _AngleSum | None] = {}

    def rebuild(self, wanted: Sequence[int]) -> list[int]:
        """The numbers of wanted values in what is made."""
        for each in required_values(
            self.source, [*wanted, *(part for turned in self.angles.values() for part in turned)]
        ):
            value = self.source.instructions[each]
            self.sums[each] = self._angle_sum(each, value)
            inside = self.sums[value.operands[0]] if value.operands else None
            if value.operation in ("cos", "sin") and inside is not None and inside.factors:
                self.new_numbers[each] = getattr(self._cos_sin_of_sum(inside), value.operation)
            else:
                self.new_numbers[each] = self.result.add_again(value, (self.new_numbers[k] for k in value.operands))
        return [self.new_numbers[each] for each in wanted]

    def _cos_sin_of_sum(self, inside: _AngleSum) -> CosSin:
        made = self.result
        c, s = made.add_constant(1.0), made.add_constant(0.0)
        if inside.rest is not None:
            c, s = made.add("cos", inside.rest), made.add("sin", inside.rest)
        for leaf, factor in sorted(inside.factors.items()):
            cos_of, sin_of = (self.new_numbers[part] for part in self.angles[leaf])
            sin_of = sin_of if factor > 0 else made.add("neg", sin_of)
            for _ in range(abs(factor)):
                c, s = (
                    made.add("sub", made.add("mul", c, cos_of), made.add("mul", s, sin_of)),
                    made.add("add", made.add("mul", s, cos_of), made.add("mul", c, sin_of)),
                )
        return CosSin(c, s)

    def _angle_sum(self, each: int, value: Instruction[Key]) -> _AngleSum | None:
        if each in self.angles:
            return _AngleSum({each: 1}, None)
        of = [part for k in value.operands if (part := self.sums[k]) is not None]
        if len(of) < len(value.operands):
            return None
        if not any(part.factors for part in of):
            return _AngleSum({}, self.result.add_again(value, (self.new_numbers[k] for k in value.operands)))
        if value.operation in ("add", "sub"):
            return self._add_sums(of[0], of[1] if value.operation == "add" else self._scale_sum(of[1], -1))
        if value.operation == "neg":
            return self._scale_sum(of[0], -1)
        known = [(self.source.constant_value(k), other) for k, other in zip(value.operands, of[::-1], strict=True)]
        whole = [(other, int(times)) for times, other in known if value.operation == "mul" and times in ANGLE_MULTIPLES]
        return self._scale_sum(*whole[0]) if whole else None

    def _scale_sum(self, part: _AngleSum, times: int) -> _AngleSum:
        rest = None if part.rest is None else self.result.add("mul", self.result.add_constant(times), part.rest)
        return _AngleSum({leaf: times * factor for leaf, factor in part.factors.items()}, rest)

    def _add_sums(self, first: _AngleSum, second: _AngleSum) -> _AngleSum:
        leaves = {**first.factors, **second.factors}
        factors = {leaf: first.factors.get(leaf, 0) + second.factors.get(leaf, 0) for leaf in leaves}
        rests = [part.rest for part in (first, second) if part.rest is not None]
        rest = self.result.add("add", *rests) if len(rests) == 2 else rests[0] if rests else None
        return _AngleSum({leaf: factor for leaf, factor in factors.items() if factor}, rest)
