"""The search for dead points of designs in closed form, designs in the lanes, as one function of LLVM IR.

Every time round a lane evaluates its blocks at one place: one of four on which it judges an interval, one nearer to a
dead point between two of them, or one where the other blocks have to keep apart.
"""

from __future__ import annotations

from math import inf, nan

from planar.batch.march.kernel import KernelEquations
from planar.batch.march.kernel_writer import KernelWriter, OperandNames
from planar.codegen.llvm_ir import write_cos_sin

LEAST_INTERVALS = 3
"""Intervals that are safe one after the other before longer ones are looked at."""
REFINEMENT = 4.0
"""By how much steps are divided where it is not clear what lies between."""
LEAST_STEP_RATIO = 1e-4
"""Of the march's steps: what finer steps do not decide is left open."""
MAX_SECANTS, SECANTS_BEFORE_HALVING = 16, 8
"""Steps of the search for a zero, and after how many of them the bracket is halved."""
CUBIC_STEPS = 3
"""Steps of Newton's method to a cubic's root."""
ZERO_TOLERANCE, BRACKET_TOLERANCE = 4e-15, 1e-15
"""Coalescence from one, and rad or sizes, at which a dead point is found."""
FOUND_TOLERANCE = 1e-12
"""Coalescence from one at which it is taken for found."""
OTHER_PLACES = (0.25, 1e-10)
"""Parts of the way to a dead point that are left where other blocks are looked at."""
LEAST_ARM = 0.1
"""Sizes of an arm on which a length turns: a shorter one may have vanished between two positions."""
SEARCH_NAME = "search"
PLACES = 4
"""Places on which an interval is judged: the one before it, its ends, the one after it."""
LOOKING, REFINING, COMPARING, COMPARING_LAST, FINISHED = (float(k) for k in range(5))
"""What a lane does next: look at a place of an interval; go nearer to a dead point; see where the other blocks are, at
the one place and at the other; nothing."""
MOST_WITHOUT_INTERVALS = 1000.0
"""Places that are looked at beside those of the steps that are left."""
INTERVAL_SLOTS = ("place", "x", "h", "filled", "safe", "doing", "distance", "block")
"""What a lane keeps: where it evaluates next; where its interval begins, how long it is, how many of its places are
known, how many were safe since they are so long; what it does; the dead point that was found, and its block."""
BRACKET_SLOTS = ("of", "a", "fa", "b", "fb", "found", "least", "slope", "before", "f_before", "count")
"""And of the search between two places: the block; these places and its values there; the best place and the value; the
slope; the place before and its value; how many places there were."""


class DeadPointWriter(KernelWriter):
    """The text of the function for designs whose input `index` runs; see `DeadPoints` for what it gives.

    search(blocks, last, width, p, drive, sign, ranges, most, out): the last block of designs begins at `last`; rows are
    `width` apart; ranges has how far designs came, are to go, in which steps, and to which side; `most` places are
    looked at.
    """

    def __init__(self, equations: KernelEquations, index: int, lanes: int):
        super().__init__(equations, (), False, lanes, frozenset(), frozenset())
        self.index = index

    def write(self) -> str:
        """The whole function."""
        t = self.ir
        arrays = ", ".join(f"ptr noalias readonly %{name}" for name in ("p", "drive", "sign", "ranges", "most"))
        t.write_line(f"define void @{SEARCH_NAME}(i64 %blocks, i64 %last, i64 %width, {arrays}, ptr noalias %out) {{")
        t.write_label("entry")
        self.slots = {name: t.allocate() for name in (*INTERVAL_SLOTS, *BRACKET_SLOTS)}
        watched = (*self.equations.blocks, *self.equations.stop_pairs)
        self.known = [t.allocate(PLACES) for _ in watched]
        most = t.add_instruction("load double, ptr %most")
        t.write_line(f"%most.places = fptosi double {most} to i64")
        t.write_line("br label %block")
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %blockend]")
        names = self._write_start()
        t.write_line("br label %look")
        t.write_label("look")
        t.write_line("%k = phi i64 [0, %block], [%knext, %look]")
        values = self._write_evaluation(names)
        doing = t.load(self.slots["doing"])
        at = {state: t.compare("oeq", doing, t.constant(state)) for state in (LOOKING, REFINING, COMPARING)}
        last = t.compare("oeq", doing, t.constant(COMPARING_LAST))
        self._write_look(at[LOOKING], values)
        self._write_refinement(at[REFINING], values)
        if len(values) > 1:
            self._write_comparison(at[COMPARING], last, values)
        self._write_next_place()
        busy = t.compare("olt", t.load(self.slots["doing"]), t.constant(FINISHED))
        bits = t.add_instruction(f"bitcast <{t.lanes} x i1> {busy} to i{t.lanes}")
        some = t.add_instruction(f"icmp ne i{t.lanes} {bits}, 0")
        t.write_line("%knext = add i64 %k, 1")
        on = t.add_instruction("icmp slt i64 %knext, %most.places")
        t.write_line(f"br i1 {t.add_instruction(f'and i1 {some}, {on}')}, label %look, label %blockend")
        t.write_label("blockend")
        for row, name in enumerate(("distance", "block")):
            t.store(t.load(self.slots[name]), self.entry_pointer("%out", row))
        t.close_loop("b", "blocks", "block", "done")
        t.write_label("done")
        t.write_line("ret void")
        t.write_line("}")
        return t.module_text()

    def _put(self, where: str, **values: str) -> None:
        """Put values into slots of the lanes whose flag is up."""
        for name, value in values.items():
            self._put_into(where, self.slots[name], value)

    def _put_into(self, where: str, slot: str, value: str) -> None:
        self.ir.store(self.ir.select(where, value, self.ir.load(slot)), slot)

    def _not(self, flag: str) -> str:
        t = self.ir
        return t.add_instruction(f"xor <{t.lanes} x i1> {flag}, <{', '.join(['i1 true'] * t.lanes)}>")

    def _write_start(self) -> OperandNames:
        """A block of designs begins: its numbers, and the lanes' slots."""
        t = self.ir
        first = t.add_instruction(f"mul i64 %b, {t.lanes}")
        past = t.add_instruction(f"icmp sgt i64 {first}, %last")
        self.lane = t.add_instruction(f"select i1 {past}, i64 %last, i64 {first}")
        names: OperandNames = {("p", k): self.load_entry("%p", k) for k in range(self.symbols["p"].numel())}
        names |= self.stop_number_names(lambda k: self.load_entry("%p", k))
        names |= {operand: self.load_entry("%drive", k) for k, operand in enumerate(self.input_operands)}
        names |= {("sign", k): self.load_entry("%sign", k) for k in range(len(self.equations.blocks))}
        reached, self.span, self.longest, self.sense = (self.load_entry("%ranges", k) for k in range(4))
        first_values = {name: t.constant(0.0) for name in self.slots} | {
            "x": reached,
            "h": self.longest,
            "place": t.binary("sub", reached, self.longest),
            "distance": t.constant(nan),
            "block": t.constant(-1.0),
        }
        for name, value in first_values.items():
            t.store(value, self.slots[name])
        for known in self.known:
            for k in range(PLACES):
                t.store("zeroinitializer", t.element_pointer(known, str(k)))
        return names

    def _write_evaluation(self, start: OperandNames) -> list[str]:
        """How far every block's coalescence is from one where the lanes look, no number where an arm is short; then how
        far what reaches one where a pair meets its stop."""
        t, values = self.ir, []
        way = t.binary("mul", self.sense, t.load(self.slots["place"]))
        names = start | {("u", self.index): t.binary("add", start["u", self.index], way)}
        if self.equations.input_is_angle[self.index]:
            names["uc", self.index], names["us", self.index] = write_cos_sin(t, names["u", self.index])
        for part in self.equations.blocks:
            form = part.closed_form
            assert form is not None
            self.write_closed_form(part, names)
            (near,) = self.write_values([form.coalescence], names)
            value = t.binary("sub", t.constant(1.0), near)
            if form.squared_arm is not None:
                (arm,) = self.write_values([form.squared_arm], names)
                value = t.select(t.compare("olt", arm, t.constant(LEAST_ARM**2)), t.constant(nan), value)
            values.append(value)
        return [*values, *(t.binary("sub", t.constant(1.0), each) for each in self.write_stops(names))]

    def _write_look(self, looking: str, values: list[str]) -> None:
        """Of the lanes that look at intervals: a place more is known, and where all are the interval is judged."""
        t = self.ir
        filled = t.load(self.slots["filled"])
        for known, value in zip(self.known, values, strict=True):
            for k in range(PLACES):
                here = t.and_flags(looking, t.compare("oeq", filled, t.constant(float(k))))
                self._put_into(here, t.element_pointer(known, str(k)), value)
        full = t.and_flags(looking, t.compare("oge", filled, t.constant(PLACES - 1.0)))
        self._put(looking, filled=t.binary("add", filled, t.constant(1.0)))
        near = [[t.load(t.element_pointer(known, str(k))) for k in range(PLACES)] for known in self.known]
        judged = [self._write_judgement(each) for each in near]
        all_safe, falls, of, chosen = full, judged[-1][1], t.constant(-1.0), near[-1]
        for k in reversed(range(len(near))):
            safe, own_falls = judged[k]
            all_safe = t.and_flags(all_safe, safe)
            # the first block that is not safe
            of = t.select(safe, of, t.constant(float(k)))
            falls = self._select_flag(safe, falls, own_falls)
            chosen = [t.select(safe, *both) for both in zip(chosen, near[k], strict=True)]
        crossing = t.and_flags(t.and_flags(full, self._not(all_safe)), falls)
        self._write_bracket(crossing, of, chosen)
        self._write_safe_step(all_safe, near)
        finer = t.and_flags(full, self._not(t.or_flags(all_safe, crossing)))
        h = t.binary("mul", t.load(self.slots["h"]), t.constant(1.0 / REFINEMENT))
        self._put(finer, h=h, filled=t.constant(0.0), safe=t.constant(0.0))
        least = t.binary("mul", self.longest, t.constant(LEAST_STEP_RATIO))
        self._put(t.and_flags(finer, t.compare("ole", h, least)), doing=t.constant(FINISHED))

    def _select_flag(self, where: str, one: str, other: str) -> str:
        flags = f"<{self.ir.lanes} x i1>"
        return self.ir.add_instruction(f"select {flags} {where}, {flags} {one}, {flags} {other}")

    def _write_judgement(self, near: list[str]) -> tuple[str, str]:
        """Whether a block surely keeps apart all along an interval, and whether it surely comes to a dead point."""
        t = self.ir
        bends = []
        for k in (1, 2):
            change = t.binary("sub", t.binary("add", near[k + 1], near[k - 1]), t.binary("add", near[k], near[k]))
            bends.append(t.call_intrinsic("fabs", change))
        bend = t.call_intrinsic("maxnum", *bends)  # of the one where it is known
        half, double = (t.binary("mul", bend, t.constant(factor)) for factor in (0.5, 2.0))
        _, left, right, _ = near
        safe = t.and_flags(t.compare("ogt", left, half), t.compare("ogt", right, half))
        falls = t.and_flags(t.compare("ogt", left, t.constant(0.0)), t.compare("ole", right, t.constant(0.0)))
        return safe, t.and_flags(falls, t.compare("ogt", t.binary("sub", left, right), double))

    def _write_safe_step(self, safe: str, near: list[list[str]]) -> None:
        """Lanes whose interval is safe go on to the next one, a longer one after some; or are at the end."""
        t, zero = self.ir, self.ir.constant(0.0)
        h = t.load(self.slots["h"])
        x = t.binary("add", t.load(self.slots["x"]), h)
        many = t.binary("add", t.load(self.slots["safe"]), t.constant(1.0))
        for known, values in zip(self.known, near, strict=True):
            for k in range(PLACES - 1):
                self._put_into(safe, t.element_pointer(known, str(k)), values[k + 1])
        self._put(safe, x=x, safe=many, filled=t.constant(PLACES - 1.0))
        grows = t.and_flags(safe, t.compare("oge", many, t.constant(float(LEAST_INTERVALS))))
        grows = t.and_flags(grows, t.compare("olt", h, self.longest))
        longer = t.call_intrinsic("minnum", t.binary("add", h, h), self.longest)
        self._put(grows, h=longer, safe=zero, filled=zero)
        ended = t.and_flags(safe, t.compare("oge", x, self.span))
        self._put(ended, distance=t.constant(inf), doing=t.constant(FINISHED))

    def _write_bracket(self, crossing: str, of: str, near: list[str]) -> None:
        """Lanes that come to a dead point in their interval begin to go nearer: where a cubic has its zero, about."""
        t = self.ir
        before, left, right, after = near
        middle = t.binary("sub", t.binary("mul", t.constant(0.5), t.binary("add", before, right)), left)
        three = t.binary("mul", t.constant(3.0), t.binary("sub", left, right))
        third = t.binary("mul", t.binary("add", t.binary("sub", after, before), three), t.constant(1.0 / 6.0))
        linear = t.binary("sub", t.binary("mul", t.constant(0.5), t.binary("sub", right, before)), third)
        root = t.binary("div", left, t.binary("sub", left, right))
        slope = linear
        for _ in range(CUBIC_STEPS):
            steep = t.binary("mul", t.constant(3.0), t.binary("mul", third, root))
            steep = t.binary("add", t.binary("add", middle, middle), steep)
            slope = t.binary("add", linear, t.binary("mul", root, steep))
            value = t.binary("add", middle, t.binary("mul", root, third))
            value = t.binary("add", linear, t.binary("mul", root, value))
            value = t.binary("add", left, t.binary("mul", root, value))
            root = t.binary("sub", root, t.binary("div", value, slope))
        a, h = (t.load(self.slots[name]) for name in ("x", "h"))
        b = t.binary("add", a, h)
        straight = t.binary("div", left, t.binary("sub", left, right))
        inside = t.and_flags(t.compare("ogt", root, t.constant(0.0)), t.compare("olt", root, t.constant(1.0)))
        guess = t.binary("add", a, t.binary("mul", t.select(inside, root, straight), h))
        self._put(crossing, of=of, a=a, fa=left, b=b, fb=right, found=b, before=b, f_before=right)
        self._put(crossing, least=t.call_intrinsic("fabs", right), slope=t.binary("div", slope, h))
        self._put(crossing, doing=t.constant(REFINING), place=guess, count=t.constant(0.0))

    def _write_refinement(self, refining: str, values: list[str]) -> None:
        """Lanes that go nearer to a dead point: the bracket shrinks by a place, and the next one is by a secant."""
        t = self.ir
        of, a, fa, b, fb, found, least, slope, before, f_before, count = (
            t.load(self.slots[name]) for name in BRACKET_SLOTS
        )
        x = t.load(self.slots["place"])
        f = values[0]
        for k, value in enumerate(values[1:], 1):
            f = t.select(t.compare("oeq", of, t.constant(float(k))), value, f)
        size, count = t.call_intrinsic("fabs", f), t.binary("add", count, t.constant(1.0))
        nearer = t.compare("olt", size, least)
        found, least = t.select(nearer, x, found), t.select(nearer, size, least)
        up = t.compare("ogt", f, t.constant(0.0))
        a, fa, b, fb = t.select(up, x, a), t.select(up, f, fa), t.select(up, b, x), t.select(up, fb, f)
        secant = t.binary("div", t.binary("sub", f, f_before), t.binary("sub", x, before))
        steep = t.select(t.compare("oeq", count, t.constant(1.0)), slope, secant)
        following = t.binary("sub", x, t.binary("div", f, steep))
        for k in range(SECANTS_BEFORE_HALVING - 1, MAX_SECANTS, SECANTS_BEFORE_HALVING):
            middle = t.binary("mul", t.constant(0.5), t.binary("add", a, b))
            following = t.select(t.compare("oeq", count, t.constant(float(k))), middle, following)
        inside = t.and_flags(t.compare("ogt", following, a), t.compare("olt", following, b))
        crossed = t.binary("sub", t.binary("mul", a, fb), t.binary("mul", b, fa))
        following = t.select(inside, following, t.binary("div", crossed, t.binary("sub", fb, fa)))
        self._put(refining, a=a, fa=fa, b=b, fb=fb, found=found, least=least, count=count)
        self._put(refining, before=x, f_before=f, place=following)
        ends = t.compare("ole", least, t.constant(ZERO_TOLERANCE))
        ends = t.or_flags(ends, t.compare("ole", t.binary("sub", b, a), t.constant(BRACKET_TOLERANCE)))
        ends = t.or_flags(ends, t.compare("oge", count, t.constant(float(MAX_SECANTS))))
        ends = t.and_flags(refining, ends)
        self._put(ends, doing=t.constant(FINISHED))
        sure = t.and_flags(ends, t.compare("ole", least, t.constant(FOUND_TOLERANCE)))
        if len(values) > 1:
            self._put(sure, doing=t.constant(COMPARING))
        else:
            self._put(sure, distance=found, block=of)

    def _write_comparison(self, comparing: str, last: str, values: list[str]) -> None:
        """Lanes that have found a dead point: whether the other blocks surely keep apart up to there."""
        t, of, fine = self.ir, self.ir.load(self.slots["of"]), last
        for k, (known, value) in enumerate(zip(self.known, values, strict=True)):
            first, second = (t.load(t.element_pointer(known, str(n))) for n in (1, 2))
            bend = t.binary("sub", t.binary("add", first, value), t.binary("add", second, second))
            half = t.binary("mul", t.constant(0.5), t.call_intrinsic("fabs", bend))
            apart = t.compare("ogt", first, half)
            for each in (second, value):
                apart = t.and_flags(apart, t.compare("ogt", each, half))
            fine = t.and_flags(fine, t.or_flags(apart, t.compare("oeq", of, t.constant(float(k)))))
            self._put_into(comparing, t.element_pointer(known, "2"), value)
        self._put(comparing, doing=t.constant(COMPARING_LAST))
        self._put(last, doing=t.constant(FINISHED))
        self._put(fine, distance=t.load(self.slots["found"]), block=of)

    def _write_next_place(self) -> None:
        """Where the lanes look next, but for those that go nearer to a dead point."""
        t = self.ir
        doing, x, h, filled = (t.load(self.slots[name]) for name in ("doing", "x", "h", "filled"))
        on = t.binary("mul", t.binary("sub", filled, t.constant(1.0)), h)
        self._put(t.compare("oeq", doing, t.constant(LOOKING)), place=t.binary("add", x, on))
        found = t.load(self.slots["found"])
        left = t.binary("sub", found, x)
        for state, part in zip((COMPARING, COMPARING_LAST), OTHER_PLACES, strict=True):
            place = t.binary("sub", found, t.binary("mul", left, t.constant(part)))
            self._put(t.compare("oeq", doing, t.constant(state)), place=place)
