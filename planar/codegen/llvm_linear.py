"""Linear systems of many unknowns as LLVM functions: loops over columns, so that the text does not grow with them.

Orthogonal columns by Gram and Schmidt's method as modified (A. Bjorck, Solving linear least squares problems by
Gram-Schmidt orthogonalization, BIT 7, 1967), which needs no pivot: every lane has a system of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from planar.codegen.llvm_ir import IRWriter


class LinearSystems:
    """Room for systems of up to so many unknowns, in a function that is being written, and calls that solve them.

    To be made where the function begins; `function_text` stands behind it.
    """

    def __init__(self, ir: IRWriter, most: int):
        self.ir = ir
        self._columns, self._triangle = ir.allocate(most * most), ir.allocate(most * most)
        self._right, self._solution, self._least = ir.allocate(most), ir.allocate(most), ir.allocate()

    def factorise(self, columns: Sequence[str], count: int) -> str:
        """Take over a matrix, column after column; the least squared ratio of a column's part across those before it,
        beside one."""
        t = self.ir
        for k, value in enumerate(columns):
            t.store(value, t.element_pointer(self._columns, str(k)))
        t.write_line(
            f"call void @orthogonalise(i64 {count}, ptr {self._columns}, ptr {self._triangle}, ptr {self._least})"
        )
        return t.load(self._least)

    def solve(self, right_side: Sequence[str]) -> list[str]:
        """The matrix's inverse times a right side."""
        t, count = self.ir, len(right_side)
        for k, value in enumerate(right_side):
            t.store(value, t.element_pointer(self._right, str(k)))
        pointers = ", ".join(f"ptr {slot}" for slot in (self._columns, self._triangle, self._right, self._solution))
        t.write_line(f"call void @substitute(i64 {count}, {pointers})")
        return [t.load(t.element_pointer(self._solution, str(k))) for k in range(count)]

    @property
    def function_text(self) -> str:
        """The functions that are called."""
        return "\n".join([*_orthogonalise(self.ir.lanes), *_substitute(self.ir.lanes)])


class _LoopWriter(IRWriter):
    """A function of arrays of vectors that is written loop after loop."""

    def __init__(self, lanes: int, name: str, arrays: Sequence[str]):
        super().__init__(lanes)
        self._block, self._loop_count = "entry", 0
        parameters = ", ".join(f"ptr noalias {array}" for array in arrays)
        self.write_line(f"define internal void @{name}(i64 %n, {parameters}) {{")
        self.write_label(self._block)
        self._sum = self.allocate()

    @contextmanager
    def loop(self, first: str = "0") -> Iterator[str]:
        """What is written meanwhile is done for every index from `first` up to n."""
        self._loop_count += 1
        name = f"loop{self._loop_count}"
        self.write_line(f"br label %{name}")
        self.write_label(name)
        self.write_line(f"%{name}k = phi i64 [{first}, %{self._block}], [%{name}next, %{name}latch]")
        self.write_line(f"%{name}more = icmp slt i64 %{name}k, %n")
        self.write_line(f"br i1 %{name}more, label %{name}body, label %{name}done")
        self._enter(f"{name}body")
        yield f"%{name}k"
        self.write_line(f"br label %{name}latch")
        self.write_label(f"{name}latch")
        self.write_line(f"%{name}next = add i64 %{name}k, 1")
        self.write_line(f"br label %{name}")
        self._enter(f"{name}done")

    def _enter(self, block: str) -> None:
        self.write_label(block)
        self._block = block

    def integer(self, operation: str, a: str, b: str) -> str:
        """A sum, difference or product of indices."""
        return self.add_instruction(f"{operation} i64 {a}, {b}")

    def entry(self, array: str, *place: str) -> str:
        """A pointer to an entry of a vector, or by column and row to one of a matrix of n rows."""
        index = place[0] if len(place) == 1 else self.integer("add", self.integer("mul", place[0], "%n"), place[1])
        return self.element_pointer(array, index)

    def dot(self, a: str, column: str, b: str, *other: str) -> str:
        """The product of a column of one matrix with one of another, or with a vector."""
        self.store("zeroinitializer", self._sum)
        with self.loop() as k:
            product = self.binary("mul", self.load(self.entry(a, column, k)), self.load(self.entry(b, *other, k)))
            self.store(self.binary("add", self.load(self._sum), product), self._sum)
        return self.load(self._sum)

    def subtract_column(self, a: str, column: str, factor: str, b: str, *other: str) -> None:
        """Take a multiple of a column of one matrix off one of another, or off a vector."""
        with self.loop() as k:
            pointer = self.entry(b, *other, k)
            product = self.binary("mul", self.load(self.entry(a, column, k)), factor)
            self.store(self.binary("sub", self.load(pointer), product), pointer)

    def end(self) -> list[str]:
        """The lines of the function."""
        self.end_function()
        return self.lines


def _orthogonalise(lanes: int) -> list[str]:
    """The columns q made orthonormal; the triangle r, the inverses of its diagonal on it, and the `least` squared ratio
    of a column's part across those before it, beside one."""
    t = _LoopWriter(lanes, "orthogonalise", ("%q", "%r", "%least"))
    with t.loop() as column:
        t.store(t.dot("%q", column, "%q", column), t.entry("%r", column, column))
    t.store(t.constant(1.0), "%least")
    with t.loop() as column:
        squared_length, diagonal = t.dot("%q", column, "%q", column), t.entry("%r", column, column)
        ratio = t.binary("div", squared_length, t.load(diagonal))
        t.store(t.call_intrinsic("minnum", t.load("%least"), ratio), "%least")
        inverse = t.binary("div", t.constant(1.0), t.call_intrinsic("sqrt", squared_length))
        t.store(inverse, diagonal)
        with t.loop() as k:
            pointer = t.entry("%q", column, k)
            t.store(t.binary("mul", t.load(pointer), inverse), pointer)
        with t.loop(t.integer("add", column, "1")) as other:
            along = t.dot("%q", column, "%q", other)
            t.store(along, t.entry("%r", column, other))
            t.subtract_column("%q", column, along, "%q", other)
    return t.end()


def _substitute(lanes: int) -> list[str]:
    """The solution x of q r x = b; b is changed."""
    t = _LoopWriter(lanes, "substitute", ("%q", "%r", "%b", "%x"))
    with t.loop() as column:
        along = t.dot("%q", column, "%b")
        t.subtract_column("%q", column, along, "%b")
        t.store(along, t.entry("%x", column))
    last = t.integer("sub", "%n", "1")
    with t.loop() as step:
        row = t.integer("sub", last, step)
        pointer = t.entry("%x", row)
        with t.loop(t.integer("add", row, "1")) as column:
            known = t.binary("mul", t.load(t.entry("%r", row, column)), t.load(t.entry("%x", column)))
            t.store(t.binary("sub", t.load(pointer), known), pointer)
        t.store(t.binary("mul", t.load(pointer), t.load(t.entry("%r", row, row))), pointer)
    return t.end()
