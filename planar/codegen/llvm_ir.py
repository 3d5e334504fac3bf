"""A listing's values as LLVM IR, on vectors of lanes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

from planar.codegen.instructions import Listing, NotPrinted

BINARY = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
CALLS = {"sqrt": "sqrt", "abs": "fabs"}
LIBRARY = {"cos": 1, "sin": 1, "atan": 1, "atan2": 2}
"""What is called lane by lane, and how many arguments it has."""


class Text:
    """Instructions one after the other, with fresh names."""

    def __init__(self, lanes: int):
        self.lanes, self.count = lanes, 0
        self.lines: list[str | list[str]] = []
        self._ahead: list[str | list[str]] = []
        self.vector = f"<{lanes} x double>"

    def line(self, text: str) -> None:
        """Add a line as it is."""
        self.lines.append(text)

    def mark(self) -> None:
        """Here, later, stands what is written `ahead`."""
        self._ahead = []
        self.lines.append(self._ahead)

    @contextmanager
    def ahead(self) -> Iterator[None]:
        """What is written meanwhile stands where the last mark is."""
        here, self.lines = self.lines, self._ahead
        yield
        self.lines = here

    def new(self, text: str) -> str:
        """Add an instruction that gives a value; the value's name."""
        self.count += 1
        name = f"%v{self.count}"
        self.lines.append(f"{name} = {text}")
        return name

    def label(self, name: str) -> None:
        self.lines.append(f"{name}:")

    def constant(self, value: float) -> str:
        return f"splat (double {_hex(value)})"

    def binary(self, what: str, a: str, b: str) -> str:
        return self.new(f"{BINARY[what]} contract {self.vector} {a}, {b}")

    def call(self, what: str, *of: str) -> str:
        args = ", ".join(f"{self.vector} {each}" for each in of)
        return self.new(f"call contract {self.vector} @llvm.{what}.v{self.lanes}f64({args})")

    def each(self, what: str, *of: str) -> str:
        """A function of the mathematics library, called lane by lane."""
        found = "poison"
        for lane in range(self.lanes):
            ones = [self.new(f"extractelement {self.vector} {value}, i64 {lane}") for value in of]
            one = self.new(f"call double @{what}({', '.join(f'double {each}' for each in ones)})")
            found = self.new(f"insertelement {self.vector} {found}, double {one}, i64 {lane}")
        return found

    def load(self, pointer: str) -> str:
        return self.new(f"load {self.vector}, ptr {pointer}, align 8")

    def store(self, value: str, pointer: str) -> None:
        self.line(f"store {self.vector} {value}, ptr {pointer}, align 8")

    def stream(self, value: str, pointer: str) -> None:
        """Store what is not read again soon, past the caches; where whole vectors begin."""
        self.line(f"store {self.vector} {value}, ptr {pointer}, align 64, !nontemporal !0")

    def loop(self, counter: str, last: str, again: str, after: str) -> None:
        """Count on, and go round again up to the last."""
        self.line(f"%{counter}next = add i64 %{counter}, 1")
        self.line(f"%{counter}more = icmp slt i64 %{counter}next, %{last}")
        self.line(f"br i1 %{counter}more, label %{again}, label %{after}")

    def summed(self, of: Sequence[str]) -> str:
        """The sum of values."""
        found = of[0]
        for each in of[1:]:
            found = self.binary("add", found, each)
        return found

    def compared(self, how: str, a: str, b: str) -> str:
        """A flag in every lane."""
        return self.new(f"fcmp {how} {self.vector} {a}, {b}")

    def both(self, a: str, b: str) -> str:
        """Two flags at once."""
        return self.new(f"and <{self.lanes} x i1> {a}, {b}")

    def either(self, a: str, b: str) -> str:
        """One flag or the other."""
        return self.new(f"or <{self.lanes} x i1> {a}, {b}")

    def where(self, flag: str, value: str) -> str:
        """A value where a flag is up, else nothing."""
        return self.new(f"select <{self.lanes} x i1> {flag}, {self.vector} {value}, {self.vector} zeroinitializer")

    def slot(self, many: int = 1) -> str:
        """Room for values."""
        return self.new(f"alloca {self.vector}, i64 {many}, align 64")

    def place(self, slot: str, index: str) -> str:
        """One of the places of a slot that has room for several."""
        return self.new(f"getelementptr {self.vector}, ptr {slot}, i64 {index}")

    def spread_flag(self, counter: str, how: str, than: int) -> str:
        """Whether a counter is greater ("sgt") than a number, or at most ("sle") that, in every lane."""
        flag = self.new(f"icmp {how} i64 {counter}, {than}")
        one = self.new(f"insertelement <{self.lanes} x i1> poison, i1 {flag}, i64 0")
        return self.new(
            f"shufflevector <{self.lanes} x i1> {one}, <{self.lanes} x i1> poison, <{self.lanes} x i32> zeroinitializer"
        )

    def beyond(self, first: str, last: str) -> str:
        """A flag in every lane: whether its number, counted from `first`, is that in the first lane of `last` or
        more."""
        lanes = self.lanes

        def spread(vector: str) -> str:
            mask = f"<{lanes} x i32> zeroinitializer"
            return self.new(f"shufflevector <{lanes} x i64> {vector}, <{lanes} x i64> poison, {mask}")

        begin = spread(self.new(f"insertelement <{lanes} x i64> poison, i64 {first}, i64 0"))
        own = self.new(f"add <{lanes} x i64> {begin}, <{', '.join(f'i64 {k}' for k in range(lanes))}>")
        return self.new(f"icmp sge <{lanes} x i64> {own}, {spread(last)}")

    def module(self) -> str:
        """All that was written, with what it calls."""
        v, of = self.vector, f"v{self.lanes}f64"
        calls = [f"declare {v} @llvm.{name}.{of}({v})" for name in ("sqrt", "fabs")]
        calls += [f"declare {v} @llvm.{name}.{of}({v}, {v})" for name in ("minnum", "maxnum", "copysign")]
        calls += [
            f"declare double @{name}({', '.join(['double'] * many)}) memory(none)" for name, many in LIBRARY.items()
        ]
        lines = [each for line in self.lines for each in ([line] if isinstance(line, str) else line)]
        return "\n".join([*lines, *calls, "!0 = !{i32 1}"])

    def at(self, base: str, index: str) -> str:
        """A pointer to the double at an index."""
        return self.new(f"getelementptr double, ptr {base}, i64 {index}")

    def spread(self, scalar: str) -> str:
        """A number in every lane."""
        one = self.new(f"insertelement {self.vector} poison, double {scalar}, i64 0")
        return self.new(
            f"shufflevector {self.vector} {one}, {self.vector} poison, <{self.lanes} x i32> zeroinitializer"
        )

    def put(self, listing: Listing, order: Sequence[int], names: dict[int, str], inputs: Mapping[int, str]) -> None:
        """Write values in an order; `names` grows by theirs, those of inputs are known."""
        for each in order:
            value = listing.values[each]
            of = [names[k] for k in value.of]
            if value.what == "input":
                names[each] = inputs[each]
            elif value.what == "const":
                names[each] = self.constant(value.data)
            elif value.what == "neg":
                names[each] = self.new(f"fneg {self.vector} {of[0]}")
            elif value.what in BINARY:
                names[each] = self.binary(value.what, *of)
            elif value.what in ("minnum", "maxnum"):
                names[each] = self.call(value.what, *of)
            elif value.what in LIBRARY:
                names[each] = self.each(value.what, *of)
            elif value.what in CALLS:
                names[each] = self.call(CALLS[value.what], *of)
            else:
                raise NotPrinted(f"there is no {value.what} on vectors")


def _hex(value: float) -> str:
    import struct

    return "0x" + struct.pack(">d", float(value)).hex().upper()
