"""One case solved in every way and compared, position by position, with the general path."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

import planar
from benchmarks.truth.random_cases import Case
from planar.batch.design_arrays import design_variables, values_of_design, with_design_values
from planar.batch.general_path import OUTCOMES, DesignRun
from planar.batch.reference_design import ReferenceDesign

Array = np.ndarray

PERTURBED, TRIES = 1e-9, 6
"""By what part of itself every dimension is changed to see whether a design is decided, and how often."""
ALLOWED = 1e-11
"""A number may be off by what a change of all dimensions by this part of them does to it, as far as that shows."""
ROUND_OFF = 1e-11
"""Or by this part of the greatest number of its order."""
FAR = 1e-4
"""Positions that differ by this part of the size are another assembly, or another branch."""
SECONDS = 4
"""Of processor time: a way that takes longer over a design, on average of its case, is given up, which is counted."""
GENERAL_PATH = "general path"
"""The way that the others are compared with; its verdicts say how designs end."""
SAME, UNDECIDED = "the same", "undecided"


class DesignResult(NamedTuple):
    """Of one design: numbers (steps + 1, x and y of points, then rates; m, s), and status (steps + 1,)."""

    out: Array
    status: Array


class Verdict(NamedTuple):
    """What a way gives for one design of a case, in words, with what there is to say of it."""

    kind: str
    seed: int
    design: int
    way: str
    what: str
    detail: str = ""


class Truth:
    """A case by the general path, design by design, as `planar.sweep` asks it."""

    def __init__(self, case: Case):
        self.case = case
        given = tuple(each._replace(law=None) for each in case.mechanism.inputs)
        self.mechanism = replace(case.mechanism, inputs=given)
        self.reference = ReferenceDesign(self.mechanism, case.pair)
        self.points = self.reference.select_points(None)
        self.results: dict[int, DesignResult] = {}
        self.perturbed_results: dict[int, list[DesignResult]] = {}

    def result(self, design: int) -> DesignResult:
        """The design as it is."""
        if design not in self.results:
            self.results[design] = self._solve(values_of_design(self.case.designs, design))
        return self.results[design]

    def perturbed(self, design: int) -> list[DesignResult]:
        """The design with all of its dimensions a little changed, in different ways."""
        if design not in self.perturbed_results:
            own = {
                name: each.value
                for name, each in design_variables(self.reference.mechanism).items()
                if each.kind == "length" or name.endswith(".position")
            } | values_of_design(self.case.designs, design)
            rng, self.perturbed_results[design] = np.random.default_rng(design), []
            size = max(map(abs, own.values()))
            for _ in range(TRIES):
                # in coordinates that vanish as well
                changed = {
                    name: value + PERTURBED * (value or size) * float(rng.choice([-1.0, 1.0]))
                    for name, value in own.items()
                    if not name.endswith(".position")
                }
                self.perturbed_results[design].append(self._solve(own | changed))
        return self.perturbed_results[design]

    def _solve(self, values: dict[str, float]) -> DesignResult:
        case, reference = self.case, self.reference
        mechanism = with_design_values(reference.mechanism, values)
        start = float(mechanism.inputs[reference.running_index].position)
        grid = None
        if not reference.is_sliding:
            grid = start + 2.0 * np.pi * np.linspace(0.0, 1.0, case.steps + 1)
        found = DesignRun(mechanism, reference.pair, grid, case.steps).solve(self.points, case.rates)
        return DesignResult(found.out, found.status)

    @cached_property
    def ways(self) -> dict[str, Callable[[], list[DesignResult]]]:
        """Every other way to solve the case."""
        return {"sweep": self._sweep, "prepared": self._prepared, "sweep_each": self._sweep_each}

    def order(self, column: int) -> str:
        """What a column of the numbers is."""
        return ("position", "velocity", "acceleration")[column // (2 * len(self.points))]

    def point(self, column: int) -> str:
        """Of which point a column of the numbers is."""
        return self.points[column % (2 * len(self.points)) // 2]

    def _sweep(self) -> list[DesignResult]:
        case = self.case
        found = planar.sweep(self.mechanism, case.designs, case.steps, rates=case.rates, pair=case.pair)
        return [self._result_of(found, np.asarray(found.status)[k], k) for k in range(len(case))]

    def _prepared(self) -> list[DesignResult]:
        case = self.case
        ready = planar.prepared(self.mechanism, case.steps, rates=case.rates, pair=case.pair)
        found = [ready(values_of_design(case.designs, k)) for k in range(len(case))]
        return [self._result_of(each, each.status, None) for each in found]

    def _sweep_each(self) -> list[DesignResult]:
        case = self.case
        mechanisms = [with_design_values(self.mechanism, values_of_design(case.designs, k)) for k in range(len(case))]
        found = planar.sweep_each(mechanisms, case.steps, rates=case.rates, pair=case.pair)
        return [self._result_of(each, each.status, None) for each in found]

    def _result_of(self, found: Any, status: Array, design: int | None) -> DesignResult:
        orders = (found.position, found.velocity, found.acceleration)[: 3 if self.case.rates else 1]
        rows = [order[name] if design is None else order[name][design] for order in orders for name in self.points]
        out = np.hstack(rows) if rows else np.zeros((len(status), 0))
        return DesignResult(np.array(out), np.array(status))


def agrees(verdict: Verdict) -> bool:
    """Whether nothing is wrong with what a way gives."""
    return verdict.way == GENERAL_PATH or verdict.what in (SAME, UNDECIDED)


def compare_case(case: Case) -> list[Verdict]:
    """The verdicts over every way and every design."""
    seconds = SECONDS * len(case)
    try:
        truth = Truth(case)
        with time_limit(seconds):
            for design in range(len(case)):
                truth.result(design)
    except planar.BadInput:
        return []
    except TimeoutError:
        return [Verdict(case.kind, case.seed, 0, f"{GENERAL_PATH}, too long", "given up", f"after {seconds} s")]
    found = [
        Verdict(case.kind, case.seed, design, GENERAL_PATH, OUTCOMES[truth.result(design).status[-1]].value)
        for design in range(len(case))
    ]
    for way, solve in truth.ways.items():
        try:
            with time_limit(seconds):
                results = solve()
        except TimeoutError:
            found.append(Verdict(case.kind, case.seed, 0, way, "given up", f"after {seconds} s"))
            continue
        except Exception as problem:
            what = f"raises {type(problem).__name__}"
            found.append(Verdict(case.kind, case.seed, 0, way, what, str(problem)[:200]))
            continue
        for design, each in enumerate(results):
            what, detail = compare_design(truth, design, each)
            found.append(Verdict(case.kind, case.seed, design, way, what, detail))
    return found


def compare_design(truth: Truth, design: int, other: DesignResult) -> tuple[str, str]:
    """How the result of a design differs from that of the general path, and where."""
    true = truth.result(design)
    what, detail = _difference(truth, true, other, None)
    if what == SAME:
        return what, detail
    near = truth.perturbed(design)
    if any(_is_another(truth, true, each) for each in near):
        return UNDECIDED, f"{what}: {detail}"
    reach = np.max([np.abs(each.out - true.out) for each in near], axis=0)
    return _difference(truth, true, other, reach * (ALLOWED / PERTURBED))


def _is_another(truth: Truth, true: DesignResult, other: DesignResult) -> bool:
    """Whether a status, a missing number or an assembly is another one."""
    if not np.array_equal(true.status, other.status):
        return True
    if not np.array_equal(np.isnan(true.out), np.isnan(other.out)):
        return True
    wide = 2 * len(truth.points)
    off = np.abs(true.out[:, :wide] - other.out[:, :wide])
    return bool(np.any(off > FAR * truth.reference.unit))


def _difference(truth: Truth, true: DesignResult, other: DesignResult, reach: Array | None) -> tuple[str, str]:
    """The greatest difference in words; numbers may be off by round-off, and by `reach`."""
    if other.out.shape != true.out.shape:
        return "other shapes", f"{other.out.shape} for {true.out.shape}"
    if not np.array_equal(other.status, true.status):
        row = int(np.argmax(other.status != true.status))
        is_, should = OUTCOMES[other.status[row]].value, OUTCOMES[true.status[row]].value
        return f"status {is_!r} for {should!r}", f"from row {row} of {len(true.status) - 1}"
    gone, must = np.isnan(other.out), np.isnan(true.out)
    if not np.array_equal(gone, must):
        row, column = map(int, np.argwhere(gone != must)[0])
        what = "missing" if gone[row, column] else "given though not determined"
        return f"{truth.order(column)} {what}", f"row {row}, point {truth.point(column)}"
    return _distance(truth, np.where(must, 0.0, true.out), np.where(must, 0.0, other.out), reach)


def _distance(truth: Truth, true: Array, other: Array, reach: Array | None) -> tuple[str, str]:
    """The greatest difference of numbers that both have."""
    off, wide = np.abs(other - true), 2 * len(truth.points)
    if off.size == 0:
        return SAME, ""
    scale = np.empty_like(off)
    for first in range(0, off.shape[1], wide):
        part = slice(first, first + wide)
        scale[:, part] = truth.reference.unit if first == 0 else float(np.max(np.abs(true[:, part]))) or 1.0
    allowed = ROUND_OFF * scale
    if reach is not None:
        allowed = allowed + np.nan_to_num(reach)
    worst = np.unravel_index(int(np.argmax(off / allowed)), off.shape)
    if off[worst] <= allowed[worst]:
        return SAME, ""
    row, column = map(int, worst)
    where = f"row {row}, point {truth.point(column)}: {other[worst]:.17g} for {true[worst]:.17g}"
    far = np.any(off[:, :wide] > FAR * truth.reference.unit, axis=1)
    if far.any():
        first = int(np.argmax(far))
        return ("branch switched" if first else "another assembly"), f"from row {first}; {where}"
    return f"{truth.order(column)} off", f"{off[worst] / scale[worst]:.1e} of its order; {where}"


@contextmanager
def time_limit(seconds: int) -> Iterator[None]:
    """TimeoutError after so many seconds of processor time, where the system can interrupt."""
    if not hasattr(signal, "SIGPROF"):
        yield
        return

    def stop(*_: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
