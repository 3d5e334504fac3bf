"""Lists of instructions for other machines: how long they may be, and sums of angles in them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Generic, NamedTuple

from planar.foundation.instruction_list import Instruction, InstructionList, Key, UnsupportedOperation, required_values

ANGLE_MULTIPLES = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
"""Multiples of an angle that are put together from its own cos and sin."""


MAX_INSTRUCTIONS = 14_000
"""Of one function: longer ones would take more than about a second to compile."""


def check_length(instructions: int) -> None:
    """Raises UnsupportedOperation for more instructions than one function may have."""
    if instructions > MAX_INSTRUCTIONS:
        raise UnsupportedOperation(f"more than {MAX_INSTRUCTIONS} instructions take too long to compile")


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
