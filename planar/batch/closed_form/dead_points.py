"""The search for dead points of designs in closed form, designs in the lanes, as one function of LLVM IR.

In every pass a lane evaluates its blocks at one place: one of four on which it judges an interval, one nearer to a
dead point between two of them, or one where the other blocks have to keep apart. What the lane does next follows from
its slots and from the values there, by expressions.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, reduce
from math import inf, nan

import casadi as ca
import numpy as np

from planar.batch.closed_form.joined_blocks import BlockJoinWriter, call_with_designs
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import KernelEquations, operand_rows
from planar.batch.march.kernel_writer import OperandNames
from planar.codegen.llvm_ir import write_cos_sin
from planar.equations.casadi_functions import FORMULA_OPERATIONS, inline_function
from planar.foundation.arrays import Array, IntArray
from planar.foundation.instruction_list import InstructionList, required_values

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
"""Places that are looked at beside those of the steps that remain."""
INTERVAL_SLOTS = ("place", "x", "h", "filled", "safe", "doing", "distance", "block")
"""What a lane keeps: where it evaluates next; where its interval begins, how long it is, how many of its places are
known, how many were safe since they are so long; what it does; the dead point, and its block."""
BRACKET_SLOTS = ("of", "a", "fa", "b", "fb", "best", "least", "slope", "before", "f_before", "count")
"""And of the search between two places: the block; these places and its values there; the best place and the value; the
slope; the place before and its value; how many places there were."""
RANGES = ("reached", "span", "longest", "sense")
"""How far designs came, are to go, in which steps, and to which side."""

Slot = str | tuple[int, int]
"""A name of those above; or a block and a place, of the value there."""
Changes = Mapping[Slot, ca.SX | float]
"""What is put into slots."""


@lru_cache(maxsize=256)
def _write_search(equations: KernelEquations, index: int) -> str:
    return DeadPointWriter(equations, index).write()


def search_dead_points(
    equations: KernelEquations, index: int, batch: DesignBatch, signs: Array, ranges: tuple[Array, ...]
) -> tuple[Array, IntArray]:
    """The first dead points of designs in the assemblies of these signs (blocks, designs): their distances from where
    the designs start, rad or sizes, and the blocks that come to them, each (designs,).

    The distance is infinite if there is none in the range, and NaN if that is not decided, or if there is no range. The
    numbers of pairs with stops, which end designs alike, follow those of blocks; -1 stands for none. `index` is the
    input that runs; ranges are `RANGES`, each (designs,), rad or sizes, from where the designs start.
    """
    reached, span, longest, _ = ranges
    with np.errstate(all="ignore"):
        intervals = float(np.fmax.reduce((span - reached) / longest, initial=0.0))
    most = np.array([MOST_WITHOUT_INTERVALS + 2.0 * intervals])
    rows = (batch.numbers, operand_rows(equations.input_operands, batch.u0), signs, np.stack(ranges))
    distance, number = call_with_designs(_write_search(equations, index), SEARCH_NAME, rows, most, 2)
    owners = np.array([*watched_blocks(equations), -1])  # the last one of none
    return np.where(span > 0.0, distance, np.nan), owners[number.astype(int)]


def watched_blocks(equations: KernelEquations) -> list[int]:
    """The blocks, and behind them the pairs with stops, whose values the search watches; of a block with a cosine there
    are two, how far that is from one and from minus one."""
    counts = [1 if form.cosine is None else 2 for form in equations.closed_forms] + [1] * len(equations.stop_pairs)
    return [k for k, count in enumerate(counts) for _ in range(count)]


class DeadPointWriter(BlockJoinWriter):
    """The text of search(blocks, last, width, p, drive, sign, ranges, most, out) for designs whose input `index` runs,
    of which `most` places are looked at; see `search_dead_points` for the results."""

    def __init__(self, equations: KernelEquations, index: int):
        super().__init__(equations, (), None)
        self.index = index
        self.watched = range(len(watched_blocks(equations)))
        known = ((k, n) for k in self.watched for n in range(PLACES))
        self.slot_names: tuple[Slot, ...] = (*INTERVAL_SLOTS, *BRACKET_SLOTS, *known)
        self.slots = {name: ca.SX.sym(str(name)) for name in self.slot_names}
        self.values = [ca.SX.sym("value") for _ in self.watched]
        self.ranges = {name: ca.SX.sym(name) for name in RANGES}

    def write(self) -> str:
        """The complete function."""
        t = self.ir
        self.write_header(SEARCH_NAME, ("p", "drive", "sign", "ranges", "most"))
        self.pointers = {name: t.allocate() for name in self.slot_names}
        most = t.add_instruction("load double, ptr %most")
        t.write_line(f"%most.places = fptosi double {most} to i64")
        t.write_line("br label %block")
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %blockend]")
        names = self.load_designs()
        ranges = [self.load_entry("%ranges", k) for k in range(len(RANGES))]
        for pointer in self.pointers.values():
            t.store("zeroinitializer", pointer)
        reached, longest = self.ranges["reached"], self.ranges["longest"]
        start: Changes = {"x": reached, "h": longest, "place": reached - longest, "distance": nan, "block": -1.0}
        self._write_changes([(ca.SX(1.0), start)], ranges, [t.constant(0.0)] * len(self.watched))
        t.write_line("br label %look")
        t.write_label("look")
        t.write_line("%k = phi i64 [0, %block], [%knext, %look]")
        values = self._write_evaluation(names, ranges[RANGES.index("sense")])
        self._write_changes([*self._look(), *self._refine(), *self._compare()], ranges, values)
        are_finished = t.all_flags(t.compare("oge", t.load(self.pointers["doing"]), t.constant(FINISHED)))
        t.write_line("%knext = add i64 %k, 1")
        has_places = t.add_instruction("icmp slt i64 %knext, %most.places")
        goes_on = t.add_instruction(f"select i1 {are_finished}, i1 false, i1 {has_places}")
        t.write_line(f"br i1 {goes_on}, label %look, label %blockend")
        t.write_label("blockend")
        for row, name in enumerate(("distance", "block")):
            t.store(t.load(self.pointers[name]), self.entry_pointer("%out", row))
        return self.close_function("block")

    def _write_evaluation(self, start: OperandNames, sense: str) -> list[str]:
        """How far, where the lanes look, every block's cosine is from one and from minus one, or the margin of its
        arm, no number where that is short; then how far what reaches one where a pair meets its stop."""
        t, values = self.ir, list[str]()
        offset = t.binary("mul", sense, t.load(self.pointers["place"]))
        names = start | {("u", self.index): t.binary("add", start["u", self.index], offset)}
        if self.equations.input_is_angle[self.index]:
            names["uc", self.index], names["us", self.index] = write_cos_sin(t, names["u", self.index])
        for part in self.equations.blocks:
            form = part.closed_form
            assert form is not None
            self.write_closed_form(part, names)
            if form.cosine is not None:
                near = self.write_slow_nearness(part, names)
                values += [t.binary(operation, t.constant(1.0), near) for operation in ("sub", "add")]
                continue
            assert form.margin is not None
            assert form.squared_arm is not None
            margin, arm = self.write_values([form.margin, form.squared_arm], names)
            values.append(t.select(t.compare("olt", arm, t.constant(LEAST_ARM**2)), t.constant(nan), margin))
        return [*values, *(t.binary("sub", t.constant(1.0), stop) for stop in self.write_stops(names))]

    def _write_changes(self, changes: list[tuple[ca.SX, Changes]], ranges: list[str], values: list[str]) -> None:
        """Put values into slots of the lanes whose flag is up, the later ones over the earlier; all follow from the
        slots as they are before."""
        t, listing = self.ir, InstructionList[int]()
        current: dict[Slot, str] = {name: t.load(pointer) for name, pointer in self.pointers.items()}
        symbols = [*self.slots.values(), *self.ranges.values(), *self.values]
        outputs = ca.vertcat(*(part for flag, of in changes for part in (flag, *of.values())))
        function = ca.Function("changes", [ca.vertcat(*symbols)], [ca.densify(outputs)])
        inputs = dict(enumerate([*current.values(), *ranges, *values]))
        (results,) = inline_function(listing, function, [[listing.add_input(k) for k in inputs]], FORMULA_OPERATIONS)
        names: dict[int, str] = {}
        t.write_values(listing, required_values(listing, results), names, inputs)
        written = (names[k] for k in results)
        for _, of in changes:
            flag = t.compare("une", next(written), t.constant(0.0))
            current |= {name: t.select(flag, next(written), current[name]) for name in of}
        for name in dict.fromkeys(name for _, of in changes for name in of):
            t.store(current[name], self.pointers[name])

    def _is_doing(self, state: float) -> ca.SX:
        return _is_number(self.slots["doing"], state)

    def _look(self) -> list[tuple[ca.SX, Changes]]:
        """Of the lanes that look at intervals: one more place is known, and where all are the interval is judged."""
        s, looking = self.slots, self._is_doing(LOOKING)
        x, h, longest = s["x"], s["h"], self.ranges["longest"]
        near = [
            [ca.if_else(_is_number(s["filled"], n), self.values[k], s[k, n]) for n in range(PLACES)]
            for k in self.watched
        ]
        full = _all(looking, s["filled"] >= PLACES - 1.0)
        judged = [_judge(values) for values in near]
        of, chosen, falls = ca.SX(-1.0), near[-1], judged[-1][1]
        for k in reversed(self.watched):  # the first block that is not safe
            safe, block_falls = judged[k]
            of, falls = ca.if_else(safe, of, k), ca.if_else(safe, falls, block_falls)
            chosen = [ca.if_else(safe, *both) for both in zip(chosen, near[k], strict=True)]
        all_safe = _all(full, *(safe for safe, _ in judged))
        crossing = _all(full, ca.logic_not(all_safe), falls)
        finer = _all(full, ca.logic_not(all_safe), ca.logic_not(crossing))
        next_x, next_safe, shorter, longer = x + h, s["safe"] + 1.0, h * (1.0 / REFINEMENT), ca.fmin(h + h, longest)
        next_interval: Changes = {"x": next_x, "safe": next_safe, "place": next_x + (PLACES - 2.0) * h}
        grows = _all(all_safe, next_safe >= float(LEAST_INTERVALS), h < longest)
        known: Changes = {(k, n): near[k][n] for k in self.watched for n in range(PLACES)}
        shifted: Changes = {(k, n): near[k][n + 1] for k in self.watched for n in range(PLACES - 1)}
        return [
            (looking, {**known, "filled": s["filled"] + 1.0, "place": x + s["filled"] * h}),
            (crossing, _begin_bracket(of, x, h, chosen)),
            (all_safe, {**shifted, **next_interval, "filled": PLACES - 1.0}),
            (grows, {"h": longer, "safe": 0.0, "filled": 0.0, "place": next_x - longer}),
            (_all(all_safe, next_x >= self.ranges["span"]), {"distance": inf, "doing": FINISHED}),
            (finer, {"h": shorter, "safe": 0.0, "filled": 0.0, "place": x - shorter}),
            (_all(finer, shorter <= longest * LEAST_STEP_RATIO), {"doing": FINISHED}),
        ]

    def _refine(self) -> list[tuple[ca.SX, Changes]]:
        """Of the lanes that go nearer to a dead point: a place shrinks the bracket, and the next one is by a secant."""
        s, refining = self.slots, self._is_doing(REFINING)
        x, count, f = s["place"], s["count"] + 1.0, self.values[0]
        for k, value in enumerate(self.values[1:], 1):
            f = ca.if_else(_is_number(s["of"], k), value, f)
        nearer, up = ca.fabs(f) < s["least"], f > 0.0
        best, least = ca.if_else(nearer, x, s["best"]), ca.if_else(nearer, ca.fabs(f), s["least"])
        a, fa = ca.if_else(up, x, s["a"]), ca.if_else(up, f, s["fa"])
        b, fb = ca.if_else(up, s["b"], x), ca.if_else(up, s["fb"], f)
        slope = ca.if_else(_is_number(count, 1.0), s["slope"], (f - s["f_before"]) / (x - s["before"]))
        following = x - f / slope
        for k in range(SECANTS_BEFORE_HALVING - 1, MAX_SECANTS, SECANTS_BEFORE_HALVING):
            following = ca.if_else(_is_number(count, k), 0.5 * (a + b), following)
        inside = _all(following > a, following < b)
        following = ca.if_else(inside, following, (a * fb - b * fa) / (fb - fa))
        converged = _any(least <= ZERO_TOLERANCE, b - a <= BRACKET_TOLERANCE, count >= float(MAX_SECANTS))
        sure = _all(refining, converged, least <= FOUND_TOLERANCE)
        bracket: Changes = {"a": a, "fa": fa, "b": b, "fb": fb, "best": best, "least": least, "count": count}
        is_alone, first_place = len(self.watched) == 1, best - (best - s["x"]) * OTHER_PLACES[0]
        compared: Changes = {"doing": COMPARING, "place": first_place}
        return [
            (refining, {**bracket, "before": x, "f_before": f, "place": following}),
            (_all(refining, converged), {"doing": FINISHED}),
            (sure, {"distance": best, "block": s["of"]} if is_alone else compared),
        ]

    def _compare(self) -> list[tuple[ca.SX, Changes]]:
        """Of the lanes that have a dead point: whether the other blocks surely keep apart up to there."""
        s, comparing, last = self.slots, self._is_doing(COMPARING), self._is_doing(COMPARING_LAST)
        fine, last_place = last, s["best"] - (s["best"] - s["x"]) * OTHER_PLACES[1]
        known: Changes = {(k, 2): value for k, value in enumerate(self.values)}
        for k, value in enumerate(self.values):
            first, second = s[k, 1], s[k, 2]
            half = 0.5 * ca.fabs((first + value) - (second + second))
            apart = _all(first > half, second > half, value > half)
            fine = _all(fine, _any(apart, _is_number(s["of"], k)))
        return [
            (comparing, {**known, "doing": COMPARING_LAST, "place": last_place}),
            (last, {"doing": FINISHED}),
            (fine, {"distance": s["best"], "block": s["of"]}),
        ]


def _is_number(value: ca.SX, number: float) -> ca.SX:
    """Whether a value that is a whole number is this one."""
    return ca.fabs(value - number) < 0.5


def _all(*flags: ca.SX) -> ca.SX:
    return reduce(lambda flag, other: ca.if_else(flag, other, 0.0), flags)


def _any(*flags: ca.SX) -> ca.SX:
    return reduce(ca.fmax, flags)


def _judge(near: list[ca.SX]) -> tuple[ca.SX, ca.SX]:
    """Whether a block surely keeps apart all along an interval, and whether it surely comes to a dead point."""
    changes = [ca.fabs((near[k + 1] + near[k - 1]) - (near[k] + near[k])) for k in (1, 2)]
    bend = ca.fmax(*changes)  # of the one where it is known
    _, start, end, _ = near
    falls = _all(start > 0.0, end <= 0.0, start - end > 2.0 * bend)
    return _all(start > 0.5 * bend, end > 0.5 * bend), falls


def _begin_bracket(of: ca.SX, x: ca.SX, h: ca.SX, near: list[ca.SX]) -> Changes:
    """The search for a dead point of a block in an interval begins: about where a cubic has its zero."""
    before, start, end, after = near
    middle = 0.5 * (before + end) - start
    third = ((after - before) + 3.0 * (start - end)) * (1.0 / 6.0)
    linear = 0.5 * (end - before) - third
    straight = start / (start - end)
    root, slope = straight, linear
    for _ in range(CUBIC_STEPS):
        slope = linear + root * ((middle + middle) + (3.0 * third) * root)
        root = root - (start + root * (linear + root * (middle + root * third))) / slope
    guess = x + ca.if_else(_all(root > 0.0, root < 1.0), root, straight) * h
    ends: Changes = {"of": of, "a": x, "fa": start, "b": x + h, "fb": end, "best": x + h, "least": ca.fabs(end)}
    started: Changes = {"slope": slope / h, "before": x + h, "f_before": end, "count": 0.0}
    return {**ends, **started, "doing": REFINING, "place": guess}
