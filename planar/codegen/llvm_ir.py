"""A listing's values as LLVM IR, on vectors of lanes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import factorial, pi

from planar.foundation.instruction_list import Instructions, UnsupportedOperation

LLVM_OPERATIONS = {"add": "fadd", "sub": "fsub", "mul": "fmul", "div": "fdiv"}
LLVM_INTRINSICS = {"sqrt": "sqrt", "abs": "fabs", "floor": "floor", "minnum": "minnum", "maxnum": "maxnum"}
LLVM_COMPARISONS = {"less": "olt", "most": "ole"}
"""What gives 1 where it is true, else 0."""
LIBRARY_ARGUMENT_COUNTS = {"cos": 1, "sin": 1, "tan": 1, "atan": 1, "atan2": 2, "pow": 2}
"""What is called lane by lane, and how many arguments it has."""
STACK_ALIGNMENT = 64
"""Bytes: so that each vector that a function keeps on it lies in one line of the cache. Else the widest lie over two
wherever the caller's stack happens to begin so, and the function takes up to twice as long."""
LOADS_IN_ORDER = 64
"""Loads between two labels after which those that follow are held apart from them. LLVM looks, for every load, through
all that may change places with it, and again after each change: the time grows with the third power of their number."""
KEEP_ORDER = 'call void asm sideeffect "", ""() nounwind willreturn memory(inaccessiblemem: readwrite)'
"""No instruction, and nothing in memory is other after it; but loads do not pass it."""


class IRWriter:
    """Instructions one after the other, with fresh names."""

    def __init__(self, lanes: int, contracts: bool = True):
        """`contracts`: whether a product and a sum may be rounded once."""
        self.lanes, self.count, self.load_count = lanes, 0, 0
        self._flags = "contract " if contracts else ""
        self.lines: list[str] = []
        self._ahead: list[str] = []
        self._sections = [self.lines]
        self.vector = f"<{lanes} x double>"

    def write_line(self, text: str) -> None:
        """Add a line as it is."""
        self.lines.append(text)

    def mark_hoist_point(self) -> None:
        """Here, later, stands what is written `ahead`."""
        self._ahead, self.lines = [], []
        self._sections += [self._ahead, self.lines]

    @contextmanager
    def hoisted(self) -> Iterator[None]:
        """What is written meanwhile stands where the last mark is."""
        lines, self.lines = self.lines, self._ahead
        yield
        self.lines = lines

    def add_instruction(self, text: str) -> str:
        """Add an instruction that gives a value; the value's name."""
        self.count += 1
        name = f"%v{self.count}"
        if text.startswith("load "):
            self.load_count += 1
            if self.load_count % LOADS_IN_ORDER == 0:
                self.lines.append(KEEP_ORDER)
        self.lines.append(f"{name} = {text}")
        return name

    def write_label(self, name: str) -> None:
        self.lines.append(f"{name}:")
        self.load_count = 0

    def constant(self, value: float) -> str:
        return f"splat (double {_double_literal(value)})"

    def binary(self, what: str, a: str, b: str) -> str:
        return self.add_instruction(f"{LLVM_OPERATIONS[what]} {self._flags}{self.vector} {a}, {b}")

    def call_intrinsic(self, what: str, *of: str) -> str:
        args = ", ".join(f"{self.vector} {value}" for value in of)
        return self.add_instruction(f"call contract {self.vector} @llvm.{what}.v{self.lanes}f64({args})")

    def call_per_lane(self, what: str, *of: str) -> str:
        """A function of the mathematics library, called lane by lane."""
        result = "poison"
        for lane in range(self.lanes):
            ones = [self.add_instruction(f"extractelement {self.vector} {value}, i64 {lane}") for value in of]
            one = self.add_instruction(f"call double @{what}({', '.join(f'double {number}' for number in ones)})")
            result = self.add_instruction(f"insertelement {self.vector} {result}, double {one}, i64 {lane}")
        return result

    def load(self, pointer: str) -> str:
        return self.add_instruction(f"load {self.vector}, ptr {pointer}, align 8")

    def load_pairs(self, pointer: str) -> tuple[str, str]:
        """The first and the second numbers of as many pairs as there are lanes."""
        both = f"<{2 * self.lanes} x double>"
        pairs = self.add_instruction(f"load {both}, ptr {pointer}, align 8")
        first, second = (
            self.add_instruction(
                f"shufflevector {both} {pairs}, {both} poison, "
                f"<{self.lanes} x i32> <{', '.join(f'i32 {2 * k + part}' for k in range(self.lanes))}>"
            )
            for part in range(2)
        )
        return first, second

    def store(self, value: str, pointer: str) -> None:
        self.write_line(f"store {self.vector} {value}, ptr {pointer}, align 8")

    def store_pairs(self, first: str, second: str, pointer: str) -> None:
        """Store the first and the second numbers of as many pairs as there are lanes."""
        both = f"<{2 * self.lanes} x double>"
        order = ", ".join(f"i32 {k}, i32 {k + self.lanes}" for k in range(self.lanes))
        pairs = self.add_instruction(
            f"shufflevector {self.vector} {first}, {self.vector} {second}, <{2 * self.lanes} x i32> <{order}>"
        )
        self.write_line(f"store {both} {pairs}, ptr {pointer}, align 8")

    def store_streaming(self, value: str, pointer: str, vector: str | None = None) -> None:
        """Store what is not read again soon, past the caches; where whole vectors begin. `vector` is its type, by
        default doubles."""
        self.write_line(f"store {vector or self.vector} {value}, ptr {pointer}, align 64, !nontemporal !0")

    def store_streaming_rounded(self, value: str, pointer: str) -> None:
        """The same, each number rounded once to single precision."""
        single = f"<{self.lanes} x float>"
        self.store_streaming(self.add_instruction(f"fptrunc {self.vector} {value} to {single}"), pointer, single)

    def close_loop(self, counter: str, last: str, again: str, after: str) -> None:
        """Count on, and go round again up to the last."""
        self.write_line(f"%{counter}next = add i64 %{counter}, 1")
        self.write_line(f"%{counter}more = icmp slt i64 %{counter}next, %{last}")
        self.write_line(f"br i1 %{counter}more, label %{again}, label %{after}")

    def end_function(self) -> None:
        """Return from the function and end it."""
        self.lines += ["ret void", "}"]

    def add_all(self, of: Sequence[str]) -> str:
        """The sum of values."""
        total = of[0]
        for value in of[1:]:
            total = self.binary("add", total, value)
        return total

    def compare(self, how: str, a: str, b: str) -> str:
        """A flag in every lane."""
        return self.add_instruction(f"fcmp {how} {self.vector} {a}, {b}")

    def and_flags(self, a: str, b: str) -> str:
        """Two flags at once."""
        return self.add_instruction(f"and <{self.lanes} x i1> {a}, {b}")

    def or_flags(self, a: str, b: str) -> str:
        """One flag or the other."""
        return self.add_instruction(f"or <{self.lanes} x i1> {a}, {b}")

    def all_flags(self, flags: str) -> str:
        """Whether the flags of all lanes are up."""
        bits = self.add_instruction(f"bitcast <{self.lanes} x i1> {flags} to i{self.lanes}")
        return self.add_instruction(f"icmp eq i{self.lanes} {bits}, -1")

    def select_or_zero(self, flag: str, value: str) -> str:
        """A value where a flag is up, else nothing."""
        return self.add_instruction(
            f"select <{self.lanes} x i1> {flag}, {self.vector} {value}, {self.vector} zeroinitializer"
        )

    def select(self, flag: str, value: str, other: str) -> str:
        """One value where a flag is up, else the other."""
        return self.add_instruction(f"select <{self.lanes} x i1> {flag}, {self.vector} {value}, {self.vector} {other}")

    def greater(self, value: str, other: str) -> str:
        """The greater of two values; the other where one is not a number."""
        return self.select(self.compare("ogt", value, other), value, other)

    def allocate(self, count: int = 1) -> str:
        """Room for values."""
        return self.add_instruction(f"alloca {self.vector}, i64 {count}, align 64")

    def allocate_flags(self) -> str:
        """Room for a flag in every lane."""
        return self.add_instruction(f"alloca <{self.lanes} x i1>")

    def load_flags(self, pointer: str) -> str:
        return self.add_instruction(f"load <{self.lanes} x i1>, ptr {pointer}")

    def store_flags(self, flags: str, pointer: str) -> None:
        self.write_line(f"store <{self.lanes} x i1> {flags}, ptr {pointer}")

    def element_pointer(self, slot: str, index: str) -> str:
        """One of the places of a slot that has room for several."""
        return self.add_instruction(f"getelementptr {self.vector}, ptr {slot}, i64 {index}")

    def broadcast_counter_test(self, counter: str, how: str, than: int) -> str:
        """Whether a counter is greater ("sgt") than a number, or at most ("sle") that, in every lane."""
        flag = self.add_instruction(f"icmp {how} i64 {counter}, {than}")
        one = self.add_instruction(f"insertelement <{self.lanes} x i1> poison, i1 {flag}, i64 0")
        return self.add_instruction(
            f"shufflevector <{self.lanes} x i1> {one}, <{self.lanes} x i1> poison, <{self.lanes} x i32> zeroinitializer"
        )

    def lanes_from(self, first: str, last: str) -> str:
        """A flag in every lane: whether its number, counted from `first`, is that in the first lane of `last` or
        more."""
        lanes = self.lanes

        def spread(vector: str) -> str:
            mask = f"<{lanes} x i32> zeroinitializer"
            return self.add_instruction(f"shufflevector <{lanes} x i64> {vector}, <{lanes} x i64> poison, {mask}")

        begin = spread(self.add_instruction(f"insertelement <{lanes} x i64> poison, i64 {first}, i64 0"))
        numbers = self.add_instruction(f"add <{lanes} x i64> {begin}, <{', '.join(f'i64 {k}' for k in range(lanes))}>")
        return self.add_instruction(f"icmp sge <{lanes} x i64> {numbers}, {spread(last)}")

    def module_text(self, *others: IRWriter) -> str:
        """All that was written, ahead of it what others wrote, with what it calls."""
        calls = {
            f"declare double @{name}({', '.join(['double'] * count)}) memory(none)"
            for name, count in LIBRARY_ARGUMENT_COUNTS.items()
        }
        for lanes in {writer.lanes for writer in (self, *others)}:
            v, of = f"<{lanes} x double>", f"v{lanes}f64"
            calls |= {f"declare {v} @llvm.{name}.{of}({v})" for name in ("sqrt", "fabs", "floor")}
            calls |= {f"declare {v} @llvm.{name}.{of}({v}, {v})" for name in ("minnum", "maxnum", "copysign")}
            calls |= {f"declare double @llvm.vector.reduce.{name}.{of}({v})" for name in ("fmin", "fmax")}
            calls.add(f"declare double @llvm.vector.reduce.fadd.{of}(double, {v})")
        lines = [line for writer in (*others, self) for section in writer._sections for line in section]
        return "\n".join([*map(_with_aligned_stack, lines), *sorted(calls), "!0 = !{i32 1}"])

    def reduce(self, what: str, value: str) -> str:
        """The least ("fmin"), greatest ("fmax") or sum ("fadd") of the lanes: one number."""
        first = "double -0.0, " if what == "fadd" else ""
        return self.add_instruction(
            f"call double @llvm.vector.reduce.{what}.v{self.lanes}f64({first}{self.vector} {value})"
        )

    def constants(self, values: Sequence[float]) -> str:
        """A constant for each lane."""
        return f"<{', '.join(f'double {_double_literal(value)}' for value in values)}>"

    def double_pointer(self, base: str, index: str) -> str:
        """A pointer to the double at an index."""
        return self.add_instruction(f"getelementptr double, ptr {base}, i64 {index}")

    def row_pointer(self, base: str, stride: str, row: int | str, index: str) -> str:
        """A pointer to the double at an index of a row; `stride` is the number of doubles of a row."""
        start = self.add_instruction(f"mul i64 {stride}, {row}")
        return self.double_pointer(base, self.add_instruction(f"add i64 {start}, {index}"))

    def single_pointer(self, base: str, index: str) -> str:
        """A pointer to the number of single precision at an index."""
        return self.add_instruction(f"getelementptr float, ptr {base}, i64 {index}")

    def broadcast(self, scalar: str) -> str:
        """A number in every lane."""
        one = self.add_instruction(f"insertelement {self.vector} poison, double {scalar}, i64 0")
        return self.add_instruction(
            f"shufflevector {self.vector} {one}, {self.vector} poison, <{self.lanes} x i32> zeroinitializer"
        )

    def write_values(
        self, listing: Instructions, order: Sequence[int], names: dict[int, str], inputs: Mapping[int, str]
    ) -> None:
        """Write values in an order; `names` grows by theirs, those of inputs are known."""
        for number in order:
            value = listing.instructions[number]
            of = [names[k] for k in value.operands]
            if value.operation == "input":
                names[number] = inputs[number]
            elif value.operation == "const":
                names[number] = self.constant(value.number)
            elif value.operation == "neg":
                names[number] = self.add_instruction(f"fneg {self.vector} {of[0]}")
            elif value.operation in LLVM_OPERATIONS:
                names[number] = self.binary(value.operation, *of)
            elif value.operation in LIBRARY_ARGUMENT_COUNTS:
                names[number] = self.call_per_lane(value.operation, *of)
            elif value.operation in LLVM_COMPARISONS:
                is_true = self.compare(LLVM_COMPARISONS[value.operation], *of)
                names[number] = self.select(is_true, self.constant(1.0), self.constant(0.0))
            elif value.operation == "not":
                names[number] = self.binary("sub", self.constant(1.0), of[0])
            elif value.operation == "where":
                names[number] = self.select_or_zero(self.compare("une", of[0], self.constant(0.0)), of[1])
            elif value.operation in LLVM_INTRINSICS:
                names[number] = self.call_intrinsic(LLVM_INTRINSICS[value.operation], *of)
            else:
                raise UnsupportedOperation(f"there is no {value.operation} on vectors")


def _with_aligned_stack(line: str) -> str:
    """A line of text; where a function begins, with what its stack is aligned to."""
    begins = line.startswith("define ") and line.endswith(") {")
    return f"{line[:-1]}alignstack({STACK_ALIGNMENT}) {{" if begins else line


def _double_literal(value: float) -> str:
    import struct

    return "0x" + struct.pack(">d", float(value)).hex().upper()


RIGHT_ANGLE_PARTS = tuple(map(float.fromhex, ("0x1.921fb544p+0", "0x1.0b4611a6p-34", "0x1.3198a2e037073p-69")))
"""A right angle as a sum; whole multiples of all but the last, up to 2^21, are exact."""
ROUNDING_SHIFT = 1.5 * 2.0**52
"""Added to a number it leaves the nearest whole one in the last bits."""
SERIES_TERMS = 8
"""Of the powers of an angle up to half a right one: what is left out is less than the last digit."""


def write_cos_sin(t: IRWriter, angle: str) -> tuple[str, str]:
    """The cos and sin of an angle, up to 1e6 rad either way, to about two units in their last place.

    The nearest whole number of right angles is taken off. Of the rest both are the sums of their series.
    """
    shifted = t.binary("add", t.binary("mul", angle, t.constant(2.0 / pi)), t.constant(ROUNDING_SHIFT))
    turns, rest = t.binary("sub", shifted, t.constant(ROUNDING_SHIFT)), angle
    for part in RIGHT_ANGLE_PARTS:
        rest = t.binary("sub", rest, t.binary("mul", turns, t.constant(part)))
    square = t.binary("mul", rest, rest)
    cos_series = _write_polynomial(t, square, [(-1.0) ** k / factorial(2 * k) for k in range(SERIES_TERMS + 1)])
    tail = _write_polynomial(t, square, [(-1.0) ** k / factorial(2 * k + 1) for k in range(1, SERIES_TERMS)])
    sin_series = t.binary("add", rest, t.binary("mul", t.binary("mul", rest, square), tail))
    integers = f"<{t.lanes} x i64>"
    quarter = t.add_instruction(f"bitcast {t.vector} {shifted} to {integers}")
    after = t.add_instruction(f"add {integers} {quarter}, {_spread(t, 1)}")
    is_odd = _write_bit_test(t, quarter, 1)
    cos, sin = t.select(is_odd, sin_series, cos_series), t.select(is_odd, cos_series, sin_series)
    turned = ((cos, _write_bit_test(t, after, 2)), (sin, _write_bit_test(t, quarter, 2)))
    cos, sin = (t.select(flag, t.add_instruction(f"fneg {t.vector} {value}"), value) for value, flag in turned)
    return cos, sin


def _write_polynomial(t: IRWriter, x: str, coefficients: Sequence[float]) -> str:
    """A polynomial by its coefficients, the constant one first."""
    value = t.constant(coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        value = t.binary("add", t.binary("mul", value, x), t.constant(coefficient))
    return value


def _write_bit_test(t: IRWriter, numbers: str, bit: int) -> str:
    """Whether a bit is set, in every lane."""
    integers = f"<{t.lanes} x i64>"
    masked = t.add_instruction(f"and {integers} {numbers}, {_spread(t, bit)}")
    return t.add_instruction(f"icmp ne {integers} {masked}, zeroinitializer")


def _spread(t: IRWriter, number: int) -> str:
    return f"<{', '.join([f'i64 {number}'] * t.lanes)}>"
