"""Lists of instructions: each value once, in an order in which they can be computed."""

from __future__ import annotations

import operator
from collections.abc import Callable, Container, Hashable, Iterable, Sequence
from math import cos, sin
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

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
COMMUTATIVE_OPERATIONS = frozenset(("add", "mul"))
IDLE_CONSTANTS = {"add": 0.0, "mul": 1.0, "sub": 0.0, "div": 1.0}
"""Second operands that leave the first as it is."""


class UnsupportedOperation(Exception):
    """What other machines are not told; the text says why."""


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
        self._numbers: dict[Hashable, int] = {}
        self._constants: dict[int, float] = {}

    def add(self, operation: str, *operands: int) -> int:
        """The number of a value; sums and products with nothing and one are not made."""
        if operation in COMMUTATIVE_OPERATIONS and operands[0] > operands[1]:
            operands = operands[::-1]
        number = self._numbers.get((operation, operands))
        if number is None:
            number = self._simplify(operation, operands)
            if number is None:
                number = self._append(Instruction(operation, operands))
            self._numbers[operation, operands] = number
        return number

    def _append(self, value: Instruction[Key]) -> int:
        self.instructions.append(value)
        return len(self.instructions) - 1

    def add_constant(self, constant: float) -> int:
        """A constant."""
        constant = float(constant)
        number = self._numbers.get(("const", constant))
        if number is None:
            number = self._numbers["const", constant] = self._append(Instruction("const", number=constant))
            self._constants[number] = constant
        return number

    def add_input(self, key: Key) -> int:
        """A value from outside."""
        number = self._numbers.get(("input", key))
        if number is None:
            number = self._numbers["input", key] = self._append(Instruction("input", key=key))
        return number

    def add_again(self, value: Instruction[Key], operands: Iterable[int]) -> int:
        """An instruction of another list, of values of this one."""
        if value.key is not None:
            return self.add_input(value.key)
        return self.add_constant(value.number) if value.operation == "const" else self.add(value.operation, *operands)

    def constant_value(self, number: int) -> float | None:
        """What a constant is; None for another value."""
        return self._constants.get(number)

    def _simplify(self, operation: str, operands: tuple[int, ...]) -> int | None:
        """A value that is known already: a constant, or one of those that it would be made of."""
        constants = [self._constants.get(operand) for operand in operands]
        if constants.count(None) < len(constants):
            number = self._simplify_with_constants(operation, operands, constants)
            if number is not None:
                return number
        if self._cancels(operation, operands):
            return self.add_constant(0.0)
        inside = self.instructions[operands[0]] if operation == "neg" else None
        return inside.operands[0] if inside is not None and inside.operation == "neg" else None

    def _simplify_with_constants(
        self, operation: str, operands: tuple[int, ...], constants: list[float | None]
    ) -> int | None:
        if None not in constants and operation in FOLDABLE_OPERATIONS and (operation != "div" or constants[1]):
            return self.add_constant(FOLDABLE_OPERATIONS[operation](*constants))
        idle = IDLE_CONSTANTS.get(operation)
        if idle is not None and constants[1] == idle:
            return operands[0]
        if operation in COMMUTATIVE_OPERATIONS and constants[0] == idle:
            return operands[1]
        if (operation == "mul" and 0.0 in constants) or (operation == "div" and constants[0] == 0.0):
            return self.add_constant(0.0)
        return self.add("neg", operands[1]) if operation == "sub" and constants[0] == 0.0 else None

    def _cancels(self, operation: str, operands: tuple[int, ...]) -> bool:
        """Whether a sum or difference is of a value and the same taken away."""
        if operation == "add":
            return any(self.instructions[a] == ("neg", (b,), 0.0, None) for a, b in (operands, operands[::-1]))
        return operation == "sub" and operands[0] == operands[1]


class Instructions(Protocol):
    """What has instructions: a list that is being made, or a recorded formula."""

    @property
    def instructions(self) -> Sequence[Instruction[Any]]:
        """The values by number; each is made of those before it."""


def required_values(formula: Instructions, wanted: Iterable[int], known: Container[int] = ()) -> list[int]:
    """The values on which the wanted ones depend, and these, in their order; not what known ones are made of."""
    required: set[int] = set()
    stack = list(wanted)
    while stack:
        each = stack.pop()
        if each not in required:
            required.add(each)
            if each not in known:
                stack += formula.instructions[each].operands
    return sorted(required)
