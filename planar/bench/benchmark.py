"""How fast a mechanism is solved on this machine, one position, one run and many designs, and what bounds it."""

from __future__ import annotations

from _thread import interrupt_main
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from importlib.util import find_spec
from itertools import count
from signal import SIGINT, default_int_handler, signal
from threading import Event, Timer, current_thread, main_thread
from time import perf_counter
from typing import Any

import numpy as np

from planar.batch.design_arrays import design_variables
from planar.batch.reference_design import reference_design
from planar.batch.results import Sweep
from planar.batch.sweep import sweep
from planar.bench.profiling import profile_cycle, profile_first_call, profile_sweep
from planar.equations.functions import EquationFunctions
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.symbolic_equations import Block, ConstraintEquations, build_equations
from planar.foundation.errors import BadInput
from planar.model.mechanism import Mechanism
from planar.model.wording import join_all_names
from planar.solving.cycle import cycle
from planar.solving.position import PositionSolver, solve

SWEEP_STEPS, CYCLE_STEPS = 200, 360
"""Steps of a sweep, and of a cycle."""
LENGTH_VARIATIONS = (0.01, 1e-4)
"""Of itself that every length of a design may differ from the file's; the second where the first lets none move."""
MAX_DESIGNS, FIRST_DESIGNS, SWEEP_SECONDS = 2000, 50, 3.0
"""Designs in a sweep at most, and where it is not known yet how long one takes; s that all sweeps should take about."""
MAX_REPEAT_SECONDS, MAX_PROFILED_SECONDS = 0.4, 2.0
"""s after which nothing is timed once more, and of a cycle that is not looked into."""
GRACE_SECONDS = 8.0
"""s over what sweeps should take: then they are given up."""
SWEPT_RANGE_RATIO, UNLIMITED_SLIDE_RATIO = 0.9, 0.1
"""The part of its range that a sweep runs of what does not turn round, and of the size of a slide without limits."""


@dataclass(frozen=True)
class SweepTiming:
    """Seconds a position of a sweep over designs with every length `within` 1 % of the file's, or less.

    `first`: s by which the first call takes longer than those after it, `compiling`: s of that for machine code.
    `refused` designs have a position that is not given; the general path solved `general` of all positions.
    """

    rates: bool
    within: float
    designs: int
    seconds: float
    first: float
    compiling: float
    refused: int
    general: int
    parts: dict[str, float]


@dataclass(frozen=True)
class Speed:
    """Seconds, the best of several rounds each; None for what the mechanism cannot do.

    `equations`: file data to a program; `assembly`: from the sketch to a gated assembly; `solve`: `planar.solve` with
    the first input at another position, warm; `cycle`: a position of `planar.cycle` over 360 steps. The two latter have
    velocities and accelerations. `bounds`: sentences that say what takes the time, from measured parts.
    """

    name: str
    links: int
    unknowns: int
    equations: float
    assembly: float
    solve: float
    cycle: float | None
    sweeps: tuple[SweepTiming, ...]
    bounds: tuple[str, ...]

    def record(self) -> dict[str, Any]:
        return asdict(self)


InputRange = tuple[float | None, float | None, str]
"""Where the input starts and stops (rad or m; None: by itself), and its pair."""


def measure_speed(mechanism: Mechanism, rounds: int = 5, seconds: float = SWEEP_SECONDS) -> Speed:
    """Time a mechanism, its sweeps in about so many seconds. Raises NoAnswer where it cannot be solved."""
    # a run in time is no sweep: all is timed at constant rates
    mechanism = replace(mechanism, inputs=tuple(given._replace(law=None) for given in mechanism.inputs))
    equations = _best_time(lambda: EquationFunctions(build_equations(equation_structure(mechanism))), rounds)
    solver = PositionSolver(mechanism)
    assembly = _best_time(solver.find_assembly, rounds)
    solved = _best_time(_make_solve_task(mechanism), 2 * rounds)
    cycled: float | None = None
    swept: tuple[SweepTiming, ...] = ()
    told = _describe_blocks(solver.equations)
    if mechanism.inputs:
        between, along, rows, cycled = _find_ranges(mechanism)
        if cycled < MAX_PROFILED_SECONDS:
            cycled = _best_time(lambda: cycle(mechanism, CYCLE_STEPS, *between), rounds)
        swept, given_up = _time_sweeps_within(mechanism, along, seconds)
        told = [*map(_describe_sweep, swept[:1]), *given_up, *told]
        if cycled < MAX_PROFILED_SECONDS:
            parts = profile_cycle(lambda: cycle(mechanism, CYCLE_STEPS, *between))
            told.append(_describe_shares("A cycle, which is the general path too", parts))
        cycled /= rows
    unknowns, links = len(solver.equations.unknowns), len(mechanism.links)
    return Speed(mechanism.name, links, unknowns, equations, assembly, solved, cycled, swept, tuple(told))


def _make_solve_task(mechanism: Mechanism) -> Callable[[], object]:
    """A position that was not asked for before, each time."""
    if not mechanism.inputs:
        return lambda: solve(mechanism)
    given, places = mechanism.inputs[0], count(1)
    return lambda: solve(mechanism, {given.pair: given.position + 1e-4 * next(places)})


def _find_ranges(mechanism: Mechanism) -> tuple[InputRange, InputRange, int, float]:
    """The range of a cycle of the first input, and one that designs beside it can run too; how many rows the cycle has,
    and how many s it takes."""
    given = mechanism.inputs[0]
    between: InputRange = (None, None, given.pair)
    try:
        seconds, motion = _time_call(lambda: cycle(mechanism, CYCLE_STEPS, *between))
    except BadInput:
        # a slide without limits
        between = (
            given.position,
            given.position + UNLIMITED_SLIDE_RATIO * reference_design(mechanism, given.pair).unit,
            given.pair,
        )
        seconds, motion = _time_call(lambda: cycle(mechanism, CYCLE_STEPS, *between))
        return between, between, len(motion), seconds
    ends = motion.inputs[given.pair].position[[0, -1]]
    if np.ptp(ends) >= 2.0 * np.pi - 1e-6 and not reference_design(mechanism, given.pair).is_sliding:
        return between, between, len(motion), seconds
    farther = max(ends, key=lambda end: abs(end - given.position))
    along = given.position, float(given.position + SWEPT_RANGE_RATIO * (farther - given.position)), given.pair
    return between, along, len(motion), seconds


def _time_sweeps_within(
    mechanism: Mechanism, input_range: InputRange, seconds: float
) -> tuple[tuple[SweepTiming, ...], list[str]]:
    """The sweeps, as many as are done before they take far too long; and what there is to say of that.

    A design may take minutes by the general path, which only an interrupt can end, and only in the main thread.
    """
    found: list[SweepTiming] = []
    rang = Event()

    def ring() -> None:
        rang.set()
        interrupt_main()

    bell = Timer(seconds + GRACE_SECONDS, ring)
    bell.daemon = True
    before = None
    if current_thread() is main_thread():
        # in the background a shell has it ignored
        before = signal(SIGINT, default_int_handler)
        bell.start()
    try:
        for each in _time_sweeps(mechanism, input_range, seconds):
            found.append(each)
        bell.cancel()
    except KeyboardInterrupt:
        if not rang.is_set():
            raise
        return tuple(found), [f"Sweeps were given up after {seconds + GRACE_SECONDS:g} s: some design takes so long"]
    finally:
        bell.cancel()
        if before is not None:
            signal(SIGINT, before)
    return tuple(found), []


def _time_sweeps(mechanism: Mechanism, input_range: InputRange, seconds: float) -> Iterator[SweepTiming]:
    """With rates and without."""
    start, stop, pair = input_range
    points = list(reference_design(mechanism, pair).moving_points)[-1:]
    end, within = perf_counter() + seconds, LENGTH_VARIATIONS[0]

    def run(rates: bool, designs: int) -> Sweep:
        drawn = _draw_designs(mechanism, designs, within)
        return sweep(
            mechanism,
            drawn,
            SWEEP_STEPS,
            points,
            rates=rates,
            start=start,
            stop=stop,
            pair=pair,
            workers=1,
        )

    for k, rates in enumerate((True, False)):
        task = partial(run, rates)
        first, compiling = profile_first_call(partial(task, 1))
        if not k and not task(2).whole.any():
            within = LENGTH_VARIATIONS[1]
            first, compiling = profile_first_call(partial(task, 1))
        least, found = _time_call(partial(task, 1))
        alone, designs, until = least, 1, perf_counter() + (end - perf_counter()) / (2 - k)
        if found.whole.all() and not found.general and least < until - perf_counter():
            # beside what every sweep takes, a design that is marched takes nearly nothing
            designs = FIRST_DESIGNS
            least, found = _time_call(partial(task, designs))
        # each is run twice, once with the profiler
        while designs < MAX_DESIGNS and (more := min(8, int(0.4 * (until - perf_counter()) / least))) >= 2:
            designs = min(MAX_DESIGNS, designs * more)
            least, found = _time_call(partial(task, designs))
        whole, parts = profile_sweep(partial(task, designs))
        yield SweepTiming(
            rates,
            within,
            designs,
            min(least, whole) / (designs * (SWEEP_STEPS + 1)),
            max(0.0, first - alone),
            compiling,
            designs - int(np.sum(found.whole)),
            int(found.general),
            parts,
        )


def _draw_designs(mechanism: Mechanism, count: int, within: float) -> dict[str, np.ndarray]:
    """Every length within a part of itself, evenly drawn; the input's rate where there is no length."""
    known = design_variables(mechanism)
    lengths = {name: each.value for name, each in known.items() if each.link and each.kind == "length" and each.value}
    if not lengths:
        given = mechanism.inputs[0]
        lengths = {f"{given.pair}.velocity": given.velocity}
    drawn = np.random.default_rng(0).uniform(1.0 - within, 1.0 + within, (len(lengths), count))
    return {name: value * each for (name, value), each in zip(lengths.items(), drawn, strict=True)}


def _describe_sweep(swept: SweepTiming) -> str:
    """What takes the time of a sweep, and what became of the designs."""
    rates = "with rates" if swept.rates else "positions alone"
    told = [_describe_shares(f"A sweep, {rates}", swept.parts)]
    part = swept.general / (swept.designs * (SWEEP_STEPS + 1))
    told.append(f"{'none' if not part else f'{100.0 * part:.3g} %'} of its positions by the general path")
    if swept.refused:
        told.append(f"{swept.refused} of {swept.designs} designs refused")
    return "; ".join(told)


def _describe_shares(what: str, parts: dict[str, float]) -> str:
    """Shares of a time, the greatest first; without what hardly shows."""
    shown = sorted(((share, name) for name, share in parts.items() if share >= 0.005), reverse=True)
    return f"{what}: {join_all_names([f'{100.0 * share:.0f} % {name}' for share, name in shown]) or 'not looked into'}"


def _describe_blocks(equations: ConstraintEquations) -> list[str]:
    """The group that is solved with the most unknowns at once."""
    stages = [stage for stage in equations.blocks if stage.unknowns.stop > stage.unknowns.start]
    if not stages:
        return ["All links follow from the inputs, with nothing to be solved"]
    largest = max(stages, key=lambda stage: stage.unknowns.stop - stage.unknowns.start)
    many = largest.unknowns.stop - largest.unknowns.start
    groups = "one group" if len(stages) == 1 else f"{len(stages)} groups, one after the other; the largest"
    unknowns = "1 unknown" if many == 1 else f"{many} unknowns at once"
    links = f" ({', '.join(largest.links)})" if 0 < len(largest.links) <= 8 else ""
    return [f"Solved as {groups} with {unknowns}{links}, {_describe_solution(equations, stages)}"]


def _describe_solution(equations: ConstraintEquations, stages: list[Block]) -> str:
    """In closed form, or by Newton's method."""
    if find_spec("planar.equations.closed_form") is None:
        return "by Newton's method"
    from planar.equations.closed_form import find_closed_form

    have = sum(find_closed_form(equations, stage) is not None for stage in stages)
    if have == len(stages):
        return "which has a closed form" if have == 1 else "and all have a closed form"
    if not have:
        return "by Newton's method, since it has no closed form"
    return f"and {have} of them have a closed form; the others are solved by Newton's method"


def _time_call(task: Callable[[], Any]) -> tuple[float, Any]:
    start = perf_counter()
    found = task()
    return perf_counter() - start, found


def _best_time(task: Callable[[], object], rounds: int) -> float:
    """Seconds of the fastest of so many calls, or of fewer that take long."""
    least, end = float("inf"), perf_counter() + MAX_REPEAT_SECONDS
    for _ in range(rounds):
        least = min(least, _time_call(task)[0])
        if perf_counter() > end:
            break
    return least
