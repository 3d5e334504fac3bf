"""Lists of instructions for other machines: how long they may be, sums of angles in them, and what does not vary.

Values are written as sums of what varies, each times a factor that does not, so that these are computed ahead.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Generic, NamedTuple

from planar.foundation.instruction_list import Instruction, InstructionList, Key, UnsupportedOperation, required_values

ANGLE_MULTIPLES = (-3.0, -2.0, -1.0, 1.0, 2.0, 3.0)
"""Multiples of an angle that are put together from its own cos and sin."""
MAX_REUSED_TERMS = 6
"""Terms of a sum that is wanted more than once: a longer one is computed once, and not put into other sums."""
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
    listing: InstructionList[Key], results: list[int], angles: Mapping[int, CosSin]
) -> tuple[InstructionList[Key], list[int]]:
    """The same values with no cos and sin of known angles in them: these are put together from the angles' own.

    cos(a + b) = cos a cos b - sin a sin b. Angles of which other multiples stand in a sum, or that stand elsewhere,
    keep their own values.
    """
    turning = _AngleSumExpander(listing, angles)
    numbers = turning.rebuild(results)
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

    def rebuild(self, results: Sequence[int]) -> list[int]:
        """The numbers of wanted values in what is made."""
        for number in required_values(
            self.source, [*results, *(part for turned in self.angles.values() for part in turned)]
        ):
            value = self.source.instructions[number]
            self.sums[number] = self._angle_sum(number, value)
            inside = self.sums[value.operands[0]] if value.operands else None
            if value.operation in ("cos", "sin") and inside is not None and inside.factors:
                self.new_numbers[number] = getattr(self._cos_sin_of_sum(inside), value.operation)
            else:
                self.new_numbers[number] = self.result.add_again(value, (self.new_numbers[k] for k in value.operands))
        return [self.new_numbers[number] for number in results]

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

    def _angle_sum(self, number: int, value: Instruction[Key]) -> _AngleSum | None:
        if number in self.angles:
            return _AngleSum({number: 1}, None)
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
        multiples = [
            (other, int(times)) for times, other in known if value.operation == "mul" and times in ANGLE_MULTIPLES
        ]
        return self._scale_sum(*multiples[0]) if multiples else None

    def _scale_sum(self, part: _AngleSum, times: int) -> _AngleSum:
        rest = None if part.rest is None else self.result.add("mul", self.result.add_constant(times), part.rest)
        return _AngleSum({leaf: times * factor for leaf, factor in part.factors.items()}, rest)

    def _add_sums(self, first: _AngleSum, second: _AngleSum) -> _AngleSum:
        leaves = {**first.factors, **second.factors}
        factors = {leaf: first.factors.get(leaf, 0) + second.factors.get(leaf, 0) for leaf in leaves}
        rests = [part.rest for part in (first, second) if part.rest is not None]
        rest = self.result.add("add", *rests) if len(rests) == 2 else rests[0] if rests else None
        return _AngleSum({leaf: factor for leaf, factor in factors.items() if factor}, rest)


class _LinearForm(NamedTuple):
    """Factors by what they multiply, and a rest; all are numbers of values."""

    factors: dict[int, int]
    rest: int | None


class InvariantHoister(Generic[Key]):
    """Makes listings again, all into one. `is_still`: which inputs do not vary; `invariants`: what values do not."""

    def __init__(self, is_still: Callable[[Key], bool]):
        self.is_invariant = is_still
        self.result: InstructionList[Key] = InstructionList()
        self.invariants: set[int] = set()
        self.linear_forms: dict[int, _LinearForm] = {}
        self.value_numbers: dict[int, int] = {}
        self.divided: Counter[int] = Counter()
        "how many values of the listing are divided by each"

    def rebuild(self, listing: InstructionList[Key], results: Sequence[int]) -> list[int]:
        """The numbers of the wanted values in the listing that is made."""
        self.linear_forms, self.value_numbers = {}, {}
        order = required_values(listing, results)
        uses = Counter(operand for k in order for operand in listing.instructions[k].operands)
        values = [listing.instructions[k] for k in order]
        self.divided = Counter(value.operands[1] for value in values if value.operation == "div")
        for k in order:
            form = self._linear_form(listing.instructions[k])
            if uses[k] > 1 and (len(form.factors) > MAX_REUSED_TERMS or self._computed_term_count(form) > 1):
                form = self._single_term(self._write_form(form))
            self.linear_forms[k] = form
        return [self._value_number(k) for k in results]

    def _linear_form(self, value: Instruction[Key]) -> _LinearForm:
        of = [self.linear_forms[k] for k in value.operands]
        if not any(part.factors for part in of) and (value.key is None or self.is_invariant(value.key)):
            number = self.result.add_again(value, [self._rest_or_zero(part) for part in of])
            self.invariants.add(number)
            return _LinearForm({}, number)
        if value.operation in ("add", "sub", "neg"):
            first, second = of if len(of) == 2 else (_LinearForm({}, None), of[0])
            return self._add_forms(first, second, "add" if value.operation == "add" else "sub")
        if value.operation == "mul" and not all(part.factors for part in of):
            by, part = (of[0], of[1]) if not of[0].factors else (of[1], of[0])
            return self._scale_form(part, self._rest_or_zero(by))
        if value.operation == "div":
            return self._divide(value, *of)
        return self._single_term(self.result.add_again(value, [self._value_number(k) for k in value.operands]))

    def _divide(self, value: Instruction[Key], above: _LinearForm, below: _LinearForm) -> _LinearForm:
        """One division for all that is divided by the same, and by what does not vary none."""
        if not below.factors:
            return self._scale_form(above, self._add_invariant("div", self._constant(1.0), self._rest_or_zero(below)))
        if self.divided[value.operands[1]] == 1:
            return self._single_term(self.result.add("div", *map(self._value_number, value.operands)))
        inverse = self.result.add("div", self._constant(1.0), self._value_number(value.operands[1]))
        if not above.factors:
            return self._scale_form(self._single_term(inverse), self._rest_or_zero(above))
        return self._single_term(self.result.add("mul", self._value_number(value.operands[0]), inverse))

    def _computed_term_count(self, part: _LinearForm) -> int:
        """How many of a sum's terms are products or the like, which stand in few other sums."""
        return sum(self.result.instructions[atom].operation != "input" for atom in part.factors)

    def _single_term(self, number: int) -> _LinearForm:
        return (
            _LinearForm({number: self._constant(1.0)}, None)
            if number not in self.invariants
            else _LinearForm({}, number)
        )

    def _add_invariant(self, what: str, *of: int) -> int:
        number = self.result.add(what, *of)
        self.invariants.add(number)
        return number

    def _constant(self, value: float) -> int:
        number = self.result.add_constant(value)
        self.invariants.add(number)
        return number

    def _rest_or_zero(self, part: _LinearForm) -> int:
        return self._constant(0.0) if part.rest is None else part.rest

    def _add_forms(self, first: _LinearForm, second: _LinearForm, what: str) -> _LinearForm:
        factors = dict(first.factors)
        for atom, factor in second.factors.items():
            both = self._add_invariant(what, factors.get(atom, self._constant(0.0)), factor)
            if self.result.constant_value(both) == 0.0:
                factors.pop(atom, None)
            else:
                factors[atom] = both
        if second.rest is None:
            return _LinearForm(factors, first.rest)
        return _LinearForm(factors, self._add_invariant(what, self._rest_or_zero(first), second.rest))

    def _scale_form(self, part: _LinearForm, by: int) -> _LinearForm:
        if self.result.constant_value(by) == 0.0:
            return _LinearForm({}, None)
        if self._computed_term_count(part) > 1:
            part = self._single_term(self._write_form(part))
        factors = {atom: self._add_invariant("mul", factor, by) for atom, factor in part.factors.items()}
        return _LinearForm(factors, None if part.rest is None else self._add_invariant("mul", part.rest, by))

    def _value_number(self, k: int) -> int:
        if k not in self.value_numbers:
            self.value_numbers[k] = self._write_form(self.linear_forms[k])
        return self.value_numbers[k]

    def _write_form(self, part: _LinearForm) -> int:
        """The number of a sum's value."""
        if not part.factors:
            return self._rest_or_zero(part)
        terms = [(atom, factor, self.result.constant_value(factor)) for atom, factor in part.factors.items()]
        terms.sort(key=lambda term: term[2] == -1.0)
        total = part.rest if part.rest is not None and self.result.constant_value(part.rest) != 0.0 else None
        for atom, factor, known in terms:
            if known == -1.0:
                total = self.result.add("neg", atom) if total is None else self.result.add("sub", total, atom)
            else:
                term = self.result.add("mul", atom, factor)
                total = term if total is None else self.result.add("add", total, term)
        assert total is not None
        return total
