"""A formula that many blocks share, over slots of memory."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

from planar.foundation.instruction_list import Instruction, InstructionList, required_values


class FormulaInput(NamedTuple):
    """What a formula takes: ("row", slot, which of its rows), ("p", number), or ("z", unknown, 0 or 1)."""

    source: str
    place: int
    part: int = 0


class BlockFormula:
    """Values by number; `leaves` are the numbers of those that are taken from outside."""

    def __init__(
        self, listing: InstructionList[FormulaInput], wanted: tuple[int, ...], leaves: dict[int, FormulaInput]
    ):
        self.instructions, self.outputs, self.inputs = listing, wanted, leaves
        self.order = required_values(listing, wanted)


def simplify_formula(formula: BlockFormula) -> BlockFormula:
    """The same formula with one division for all that is divided by the same, and none by what does not vary; with
    factors that do not vary put together; without what cancels in sums."""
    return _Simplifier(formula).rebuild()


class _Simplifier:
    """Makes a formula again. `still`: which of the new values do not vary; `terms`: of sums their terms,
    values of the source, with signs."""

    def __init__(self, formula: BlockFormula):
        self.formula, self.source = formula, formula.instructions
        self.result: InstructionList[FormulaInput] = InstructionList()
        self.numbers: dict[int, int] = {}
        self.still: set[int] = set()
        self.terms: dict[int, dict[int, int]] = {}

    def rebuild(self) -> BlockFormula:
        """The new formula."""
        values = [self.source.instructions[k] for k in self.formula.order]
        divided = Counter(value.operands[1] for value in values if value.operation == "div")
        for k, value in zip(self.formula.order, values, strict=True):
            of = [self.numbers[each] for each in value.operands]
            if value.operation == "div":
                own = self._quotient(of[0], of[1], divided[value.operands[1]] > 1)
            elif value.operation == "mul":
                own = self._product(of[0], of[1])
            elif value.operation in ("add", "sub", "neg"):
                own = self._sum(k, value, of)
            else:
                own = self.result.add_again(value, of)
            self._note(own)
            self.numbers[k] = own
        inputs = {self.numbers[k]: leaf for k, leaf in self.formula.inputs.items()}
        return BlockFormula(self.result, tuple(self.numbers[k] for k in self.formula.outputs), inputs)

    def _note(self, number: int) -> int:
        value = self.result.instructions[number]
        given = value.key is not None and value.key.source == "p"
        if value.operation == "const" or given or (value.operands and self.still.issuperset(value.operands)):
            self.still.add(number)
        return number

    def _quotient(self, above: int, below: int, is_shared: bool) -> int:
        if above in self.still or not (below in self.still or is_shared):
            return self.result.add("div", above, below)
        return self._product(above, self._note(self.result.add("div", self.result.add_constant(1.0), below)))

    def _product(self, first: int, second: int) -> int:
        if second not in self.still:
            first, second = second, first
        inside = self.result.instructions[first]
        if second in self.still and first not in self.still and inside.operation == "mul":
            varying, factor = inside.operands if inside.operands[1] in self.still else inside.operands[::-1]
            if factor in self.still:
                return self.result.add("mul", varying, self._note(self.result.add("mul", factor, second)))
        return self.result.add("mul", first, second)

    def _sum(self, k: int, value: Instruction[FormulaInput], of: list[int]) -> int:
        parts = [self.terms.get(each, {each: 1}) for each in value.operands]
        signs = {"add": (1, 1), "sub": (1, -1), "neg": (-1,)}[value.operation]
        whole: Counter[int] = Counter()
        for part, sign in zip(parts, signs, strict=True):
            for term, factor in part.items():
                whole[term] += sign * factor
        kept = {term: factor for term, factor in whole.items() if factor}
        self.terms[k] = kept
        if len(kept) == sum(map(len, parts)) or not set(kept.values()) <= {1, -1}:
            return self.result.add_again(value, of)
        total = self.result.add_constant(0.0)
        for term, factor in sorted(kept.items(), key=lambda each: -each[1]):
            total = self.result.add("add" if factor > 0 else "sub", total, self.numbers[term])
        return total
