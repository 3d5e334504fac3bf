"""A listing's values as sums of what varies, each times a factor that does not, so that these are computed ahead."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

from planar.codegen.instructions import Listing, Value, needed

LONGEST = 6
"""Terms of a sum that is wanted more than once: a longer one is computed once, and not put into other sums."""


class _Sum(NamedTuple):
    """Factors by what they multiply, and a rest; all are numbers of values."""

    factors: dict[int, int]
    rest: int | None


class Collecting:
    """Makes listings again, all into one. `is_still`: which inputs do not vary; `still`: all values that do not."""

    def __init__(self, is_still: Callable[[Value], bool]):
        self.is_still, self.made = is_still, Listing()
        self.still: set[int] = set()
        self.sums: dict[int, _Sum] = {}
        self.whole: dict[int, int] = {}

    def again(self, listing: Listing, wanted: Sequence[int]) -> list[int]:
        """The numbers of the wanted values in the listing that is made."""
        self.sums, self.whole = {}, {}
        order = needed(listing, wanted)
        uses = Counter(each for k in order for each in listing.values[k].of)
        for k in order:
            found = self._sum(listing.values[k])
            if uses[k] > 1 and (len(found.factors) > LONGEST or self._fresh(found) > 1):
                found = self._atom(self._made(found))
            self.sums[k] = found
        return [self._value(k) for k in wanted]

    def _sum(self, value: Value) -> _Sum:
        of = [self.sums[k] for k in value.of]
        if not any(part.factors for part in of) and (value.what not in ("input",) or self.is_still(value)):
            return _Sum({}, self._still(value.what, *(self._rest(part) for part in of), data=value.data))
        if value.what in ("add", "sub", "neg"):
            first, second = of if len(of) == 2 else (_Sum({}, None), of[0])
            return self._plus(first, second, "add" if value.what == "add" else "sub")
        if value.what == "mul" and not all(part.factors for part in of):
            by, part = (of[0], of[1]) if not of[0].factors else (of[1], of[0])
            return self._times(part, self._rest(by))
        if value.what == "div":
            return self._divided(value, *of)
        return self._atom(self.made.add(value.what, *(self._value(k) for k in value.of), data=value.data))

    def _divided(self, value: Value, above: _Sum, below: _Sum) -> _Sum:
        """One division for all that is divided by the same."""
        if not below.factors:
            return self._times(above, self._still("div", self._constant(1.0), self._rest(below)))
        inverse = self.made.add("div", self._constant(1.0), self._value(value.of[1]))
        if not above.factors:
            return self._times(self._atom(inverse), self._rest(above))
        return self._atom(self.made.add("mul", self._value(value.of[0]), inverse))

    def _fresh(self, part: _Sum) -> int:
        """How many of a sum's terms are products or the like, which stand in few other sums."""
        return sum(self.made.values[atom].what != "input" for atom in part.factors)

    def _atom(self, number: int) -> _Sum:
        return _Sum({number: self._constant(1.0)}, None) if number not in self.still else _Sum({}, number)

    def _still(self, what: str, *of: int, data: float | tuple[int, int] | str = 0.0) -> int:
        number = self.made.add(what, *of, data=data)
        self.still.add(number)
        return number

    def _constant(self, value: float) -> int:
        number = self.made.const(value)
        self.still.add(number)
        return number

    def _rest(self, part: _Sum) -> int:
        return self._constant(0.0) if part.rest is None else part.rest

    def _plus(self, first: _Sum, second: _Sum, what: str) -> _Sum:
        factors = dict(first.factors)
        for atom, factor in second.factors.items():
            both = self._still(what, factors.get(atom, self._constant(0.0)), factor)
            if self.made.number(both) == 0.0:
                factors.pop(atom, None)
            else:
                factors[atom] = both
        if second.rest is None:
            return _Sum(factors, first.rest)
        return _Sum(factors, self._still(what, self._rest(first), second.rest))

    def _times(self, part: _Sum, by: int) -> _Sum:
        if self.made.number(by) == 0.0:
            return _Sum({}, None)
        if self._fresh(part) > 1:
            part = self._atom(self._made(part))
        factors = {atom: self._still("mul", factor, by) for atom, factor in part.factors.items()}
        return _Sum(factors, None if part.rest is None else self._still("mul", part.rest, by))

    def _value(self, k: int) -> int:
        if k not in self.whole:
            self.whole[k] = self._made(self.sums[k])
        return self.whole[k]

    def _made(self, part: _Sum) -> int:
        """The number of a sum's value."""
        if not part.factors:
            return self._rest(part)
        terms = [(atom, factor, self.made.number(factor)) for atom, factor in part.factors.items()]
        terms.sort(key=lambda term: term[2] == -1.0)
        total = part.rest if part.rest is not None and self.made.number(part.rest) != 0.0 else None
        for atom, factor, known in terms:
            if known == -1.0:
                total = self.made.add("neg", atom) if total is None else self.made.add("sub", total, atom)
            else:
                term = self.made.add("mul", atom, factor)
                total = term if total is None else self.made.add("add", total, term)
        assert total is not None
        return total
