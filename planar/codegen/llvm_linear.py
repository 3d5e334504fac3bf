"""Linear systems of many unknowns as LLVM functions: loops over columns, so that the text does not grow with them.

Orthogonal columns by Gram and Schmidt's method as modified (A. Bjorck, Solving linear least squares problems by
Gram-Schmidt orthogonalization, BIT 7, 1967), which needs no pivot: every lane has a system of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from string import Template

from planar.codegen.llvm_ir import IRWriter

_FUNCTIONS = Template("""
define internal void @orthogonalise(i64 %n, ptr noalias %q, ptr noalias %r, ptr noalias %least) {
entry:
  br label %lengths
lengths:
  %a = phi i64 [0, %entry], [%anext, %lengthend]
  %afirst = mul i64 %a, %n
  br label %square
square:
  %b = phi i64 [0, %lengths], [%bnext, %square]
  %bsum = phi $v [zeroinitializer, %lengths], [%bsumnext, %square]
  %bat = add i64 %afirst, %b
  %bp = getelementptr $v, ptr %q, i64 %bat
  %bq = load $v, ptr %bp, align 64
  %bqq = fmul contract $v %bq, %bq
  %bsumnext = fadd contract $v %bsum, %bqq
  %bnext = add i64 %b, 1
  %bmore = icmp slt i64 %bnext, %n
  br i1 %bmore, label %square, label %lengthend
lengthend:
  %alast = add i64 %afirst, %a
  %ap = getelementptr $v, ptr %r, i64 %alast
  store $v %bsumnext, ptr %ap, align 64
  %anext = add i64 %a, 1
  %amore = icmp slt i64 %anext, %n
  br i1 %amore, label %lengths, label %columns
columns:
  %k = phi i64 [0, %lengthend], [%knext, %columnend]
  %small = phi $v [splat (double 1.0), %lengthend], [%smallnext, %columnend]
  %kfirst = mul i64 %k, %n
  br label %norm
norm:
  %c = phi i64 [0, %columns], [%cnext, %norm]
  %csum = phi $v [zeroinitializer, %columns], [%csumnext, %norm]
  %cat = add i64 %kfirst, %c
  %cp = getelementptr $v, ptr %q, i64 %cat
  %cq = load $v, ptr %cp, align 64
  %cqq = fmul contract $v %cq, %cq
  %csumnext = fadd contract $v %csum, %cqq
  %cnext = add i64 %c, 1
  %cmore = icmp slt i64 %cnext, %n
  br i1 %cmore, label %norm, label %normed
normed:
  %kat = add i64 %kfirst, %k
  %kp = getelementptr $v, ptr %r, i64 %kat
  %length = load $v, ptr %kp, align 64
  %ratio = fdiv contract $v %csumnext, %length
  %smallnext = call contract $v @llvm.minnum.$f($v %small, $v %ratio)
  %root = call contract $v @llvm.sqrt.$f($v %csumnext)
  %inverse = fdiv contract $v splat (double 1.0), %root
  store $v %inverse, ptr %kp, align 64
  %after = add i64 %k, 1
  br label %scale
scale:
  %d = phi i64 [0, %normed], [%dnext, %scale]
  %dat = add i64 %kfirst, %d
  %dp = getelementptr $v, ptr %q, i64 %dat
  %dq = load $v, ptr %dp, align 64
  %dn = fmul contract $v %dq, %inverse
  store $v %dn, ptr %dp, align 64
  %dnext = add i64 %d, 1
  %dmore = icmp slt i64 %dnext, %n
  br i1 %dmore, label %scale, label %others
others:
  %j = phi i64 [%after, %scale], [%jnext, %otherend]
  %jmore = icmp slt i64 %j, %n
  br i1 %jmore, label %otherfirst, label %columnend
otherfirst:
  %jfirst = mul i64 %j, %n
  br label %dot
dot:
  %e = phi i64 [0, %otherfirst], [%enext, %dot]
  %esum = phi $v [zeroinitializer, %otherfirst], [%esumnext, %dot]
  %eat = add i64 %kfirst, %e
  %ep = getelementptr $v, ptr %q, i64 %eat
  %eq = load $v, ptr %ep, align 64
  %eatj = add i64 %jfirst, %e
  %epj = getelementptr $v, ptr %q, i64 %eatj
  %eqj = load $v, ptr %epj, align 64
  %eqq = fmul contract $v %eq, %eqj
  %esumnext = fadd contract $v %esum, %eqq
  %enext = add i64 %e, 1
  %emore = icmp slt i64 %enext, %n
  br i1 %emore, label %dot, label %dotend
dotend:
  %rat = add i64 %kfirst, %j
  %rp = getelementptr $v, ptr %r, i64 %rat
  store $v %esumnext, ptr %rp, align 64
  br label %less
less:
  %g = phi i64 [0, %dotend], [%gnext, %less]
  %gat = add i64 %kfirst, %g
  %gp = getelementptr $v, ptr %q, i64 %gat
  %gq = load $v, ptr %gp, align 64
  %gatj = add i64 %jfirst, %g
  %gpj = getelementptr $v, ptr %q, i64 %gatj
  %gqj = load $v, ptr %gpj, align 64
  %gp2 = fmul contract $v %gq, %esumnext
  %gn = fsub contract $v %gqj, %gp2
  store $v %gn, ptr %gpj, align 64
  %gnext = add i64 %g, 1
  %gmore = icmp slt i64 %gnext, %n
  br i1 %gmore, label %less, label %otherend
otherend:
  %jnext = add i64 %j, 1
  br label %others
columnend:
  %knext = add i64 %k, 1
  %kmore = icmp slt i64 %knext, %n
  br i1 %kmore, label %columns, label %done
done:
  store $v %smallnext, ptr %least, align 64
  ret void
}
define internal void @substitute(i64 %n, ptr noalias %q, ptr noalias %r, ptr noalias %b, ptr noalias %x) {
entry:
  br label %columns
columns:
  %k = phi i64 [0, %entry], [%knext, %columnend]
  %kfirst = mul i64 %k, %n
  br label %dot
dot:
  %e = phi i64 [0, %columns], [%enext, %dot]
  %esum = phi $v [zeroinitializer, %columns], [%esumnext, %dot]
  %eat = add i64 %kfirst, %e
  %ep = getelementptr $v, ptr %q, i64 %eat
  %eq = load $v, ptr %ep, align 64
  %epb = getelementptr $v, ptr %b, i64 %e
  %eb = load $v, ptr %epb, align 64
  %eqq = fmul contract $v %eq, %eb
  %esumnext = fadd contract $v %esum, %eqq
  %enext = add i64 %e, 1
  %emore = icmp slt i64 %enext, %n
  br i1 %emore, label %dot, label %less
less:
  %g = phi i64 [0, %dot], [%gnext, %less]
  %gat = add i64 %kfirst, %g
  %gp = getelementptr $v, ptr %q, i64 %gat
  %gq = load $v, ptr %gp, align 64
  %gpb = getelementptr $v, ptr %b, i64 %g
  %gb = load $v, ptr %gpb, align 64
  %gp2 = fmul contract $v %gq, %esumnext
  %gn = fsub contract $v %gb, %gp2
  store $v %gn, ptr %gpb, align 64
  %gnext = add i64 %g, 1
  %gmore = icmp slt i64 %gnext, %n
  br i1 %gmore, label %less, label %columnend
columnend:
  %xp = getelementptr $v, ptr %x, i64 %k
  store $v %esumnext, ptr %xp, align 64
  %knext = add i64 %k, 1
  %kmore = icmp slt i64 %knext, %n
  br i1 %kmore, label %columns, label %back
back:
  %left = phi i64 [%n, %columnend], [%i, %backend]
  %i = sub i64 %left, 1
  %ifirst = mul i64 %i, %n
  %ip = getelementptr $v, ptr %x, i64 %i
  %iy = load $v, ptr %ip, align 64
  br label %known
known:
  %j = phi i64 [%left, %back], [%jnext, %knownnext]
  %jsum = phi $v [%iy, %back], [%jsumnext, %knownnext]
  %jmore = icmp slt i64 %j, %n
  br i1 %jmore, label %knownnext, label %backend
knownnext:
  %jat = add i64 %ifirst, %j
  %jp = getelementptr $v, ptr %r, i64 %jat
  %jr = load $v, ptr %jp, align 64
  %jpx = getelementptr $v, ptr %x, i64 %j
  %jx = load $v, ptr %jpx, align 64
  %jrx = fmul contract $v %jr, %jx
  %jsumnext = fsub contract $v %jsum, %jrx
  %jnext = add i64 %j, 1
  br label %known
backend:
  %iat = add i64 %ifirst, %i
  %irp = getelementptr $v, ptr %r, i64 %iat
  %inverse = load $v, ptr %irp, align 64
  %ix = fmul contract $v %jsum, %inverse
  store $v %ix, ptr %ip, align 64
  %imore = icmp sgt i64 %i, 0
  br i1 %imore, label %back, label %done
done:
  ret void
}
""")


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
        pointers = ", ".join(f"ptr {each}" for each in (self._columns, self._triangle, self._right, self._solution))
        t.write_line(f"call void @substitute(i64 {count}, {pointers})")
        return [t.load(t.element_pointer(self._solution, str(k))) for k in range(count)]

    @property
    def function_text(self) -> str:
        """The functions that are called."""
        return _FUNCTIONS.substitute(v=self.ir.vector, f=f"v{self.ir.lanes}f64")
