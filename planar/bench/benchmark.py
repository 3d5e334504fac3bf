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

from planar.batch.design_arrays import liftable
from planar.batch.reference_design import base
from planar.batch.sweep import sweep
from planar.bench.profiling import of_cycle, of_first, of_sweep
from planar.equations.constraint_equations import Equations, Stage, build
from planar.equations.functions import Program, structure
from planar.foundation.errors import BadInput
from planar.model.dimensions import Dimension
from planar.model.mechanism import Mechanism
from planar.model.wording import listed
from planar.solving.cycle import cycle
from planar.solving.position import Solver, solve

STEPS, TURN = 200, 360
"""Steps of a sweep, and of a cycle."""
WITHIN = (0.01, 1e-4)
"""Of itself that every length of a design may differ from the file's; the second where the first lets none move."""
BACKENDS = {"native": "llvmlite", "casadi": "casadi"}
"""The backends of sweeps, and the library that each needs."""
MOST, MANY, SECONDS = 2000, 50, 3.0
"""Designs in a sweep at most, and where it is not known yet how long one takes; s that all sweeps should take about."""
ENOUGH, TOO_LONG = 0.4, 2.0
"""s after which nothing is timed once more, and of a cycle that is not looked into."""
GIVEN_UP = 8.0
"""s over what sweeps should take: then they are given up."""
ALONG, WITHOUT_ENDS = 0.9, 0.1
"""The part of its range that a sweep runs of what does not turn round, and of the size of a slide without limits."""


@dataclass(frozen=True)
class Swept:
    """One backend: seconds a position of a sweep over designs with every length `within` 1 % of the file's, or less.

    `first`: s by which the first call takes longer than those after it, `compiling`: s of that for machine code (None:
    the backend makes none). `refused` designs have a position that is not given; the general path solved `general` of
    all positions.
    """

    backend: str
    rates: bool
    within: float
    designs: int
    seconds: float
    first: float
    compiling: float | None
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
    sweeps: tuple[Swept, ...]
    bounds: tuple[str, ...]

    def record(self) -> dict[str, Any]:
        return asdict(self)


Range = tuple[float | None, float | None, str]
"""Where the input starts and stops (rad or m; None: by itself), and its pair."""


def measure(mechanism: Mechanism, rounds: int = 5, seconds: float = SECONDS) -> Speed:
    """Time a mechanism, its sweeps in about so many seconds. Raises NoAnswer where it cannot be solved."""
    # a run in time is no sweep: all is timed at constant rates
    mechanism = replace(mechanism, inputs=tuple(given._replace(law=None) for given in mechanism.inputs))
    equations = _best(lambda: Program(build(structure(mechanism))), rounds)
    solver = Solver(mechanism)
    assembly = _best(solver.assembly, rounds)
    solved = _best(_solving(mechanism), 2 * rounds)
    cycled, swept, told = None, (), _of_groups(solver.equations)
    if mechanism.inputs:
        between, along, rows, cycled = _ranges(mechanism)
        if cycled < TOO_LONG:
            cycled = _best(lambda: cycle(mechanism, TURN, *between), rounds)
        swept, given_up = _sweeps_within(mechanism, along, seconds)
        told = [*map(_of_sweep, swept[:1]), *given_up, *told]
        if cycled < TOO_LONG:
            parts = of_cycle(lambda: cycle(mechanism, TURN, *between))
            told.append(_shared("A cycle, which is the general path too", parts))
        cycled /= rows
        if find_spec(BACKENDS["native"]) is None:
            told.append("Machine code is not installed; pip install 'planar[native]'")
    unknowns, links = len(solver.equations.unknowns), len(mechanism.links)
    return Speed(mechanism.name, links, unknowns, equations, assembly, solved, cycled, swept, tuple(told))


def _solving(mechanism: Mechanism) -> Callable[[], object]:
    """A position that was not asked for before, each time."""
    if not mechanism.inputs:
        return lambda: solve(mechanism)
    given, places = mechanism.inputs[0], count(1)
    return lambda: solve(mechanism, {given.pair: given.position + 1e-4 * next(places)})


def _ranges(mechanism: Mechanism) -> tuple[Range, Range, int, float]:
    """The range of a cycle of the first input, and one that designs beside it can run too; how many rows the cycle has,
    and how many s it takes."""
    given = mechanism.inputs[0]
    between: Range = (None, None, given.pair)
    try:
        seconds, motion = _timed(lambda: cycle(mechanism, TURN, *between))
    except BadInput:
        # a slide without limits
        between = given.position, given.position + WITHOUT_ENDS * base(mechanism, given.pair).unit, given.pair
        seconds, motion = _timed(lambda: cycle(mechanism, TURN, *between))
        return between, between, len(motion), seconds
    ends = motion.inputs[given.pair].position[[0, -1]]
    if np.ptp(ends) >= 2.0 * np.pi - 1e-6 and not base(mechanism, given.pair).slides:
        return between, between, len(motion), seconds
    farther = max(ends, key=lambda end: abs(end - given.position))
    along = given.position, float(given.position + ALONG * (farther - given.position)), given.pair
    return between, along, len(motion), seconds


def _sweeps_within(mechanism: Mechanism, along: Range, seconds: float) -> tuple[tuple[Swept, ...], list[str]]:
    """The sweeps, as many as are done before they take far too long; and what there is to say of that.

    A design may take minutes by the general path, which only an interrupt can end, and only in the main thread.
    """
    found: list[Swept] = []
    rang = Event()

    def ring() -> None:
        rang.set()
        interrupt_main()

    bell = Timer(seconds + GIVEN_UP, ring)
    bell.daemon = True
    before = None
    if current_thread() is main_thread():
        # in the background a shell has it ignored
        before = signal(SIGINT, default_int_handler)
        bell.start()
    try:
        for each in _sweeps(mechanism, along, seconds):
            found.append(each)
        bell.cancel()
    except KeyboardInterrupt:
        if not rang.is_set():
            raise
        return tuple(found), [f"Sweeps were given up after {seconds + GIVEN_UP:g} s: some design takes so long"]
    finally:
        bell.cancel()
        if before is not None:
            signal(SIGINT, before)
    return tuple(found), []


def _sweeps(mechanism: Mechanism, along: Range, seconds: float) -> Iterator[Swept]:
    """Every backend that is there, with rates and without."""
    start, stop, pair = along
    points = list(base(mechanism, pair).moved)[-1:]
    todo = [(name, rates) for name, needs in BACKENDS.items() if find_spec(needs) for rates in (True, False)]
    end, within = perf_counter() + seconds, WITHIN[0]

    def run(backend: str, rates: bool, designs: int) -> Any:
        given = {"rates": rates, "start": start, "stop": stop, "pair": pair, "backend": backend}
        return sweep(mechanism, _designs(mechanism, designs, within), STEPS, points, **given)

    for k, (backend, rates) in enumerate(todo):
        task = partial(run, backend, rates)
        first, compiling = of_first(partial(task, 1))
        if not k and not task(2).whole.any():
            within = WITHIN[1]
            first, compiling = of_first(partial(task, 1))
        least, found = _timed(partial(task, 1))
        alone, designs, until = least, 1, perf_counter() + (end - perf_counter()) / (len(todo) - k)
        if found.whole.all() and not found.general and least < until - perf_counter():
            # beside what every sweep takes, a design that is marched takes nearly nothing
            designs = MANY
            least, found = _timed(partial(task, designs))
        # each is run twice, once with the profiler
        while designs < MOST and (more := min(8, int(0.4 * (until - perf_counter()) / least))) >= 2:
            designs = min(MOST, designs * more)
            least, found = _timed(partial(task, designs))
        whole, parts = of_sweep(partial(task, designs))
        yield Swept(
            backend,
            rates,
            within,
            designs,
            min(least, whole) / (designs * (STEPS + 1)),
            max(0.0, first - alone),
            compiling if backend == "native" else None,
            designs - int(np.sum(found.whole)),
            int(found.general),
            parts,
        )


def _designs(mechanism: Mechanism, many: int, within: float) -> dict[str, np.ndarray]:
    """Every length within a part of itself, evenly drawn; the input's rate where there is no length."""
    known = liftable(mechanism)
    lengths = {name: each.value for name, each in known.items() if isinstance(each, Dimension) and each.value}
    if not lengths:
        given = mechanism.inputs[0]
        lengths = {f"{given.pair}.velocity": given.velocity}
    drawn = np.random.default_rng(0).uniform(1.0 - within, 1.0 + within, (len(lengths), many))
    return {name: value * each for (name, value), each in zip(lengths.items(), drawn, strict=True)}


def _of_sweep(swept: Swept) -> str:
    """What takes the time of a sweep, and what became of the designs."""
    rates = "with rates" if swept.rates else "positions alone"
    told = [_shared(f"A sweep by {swept.backend}, {rates}", swept.parts)]
    part = swept.general / (swept.designs * (STEPS + 1))
    told.append(f"{'none' if not part else f'{100.0 * part:.3g} %'} of its positions by the general path")
    if swept.refused:
        told.append(f"{swept.refused} of {swept.designs} designs refused")
    return "; ".join(told)


def _shared(what: str, parts: dict[str, float]) -> str:
    """Shares of a time, the greatest first; without what hardly shows."""
    shown = sorted(((share, name) for name, share in parts.items() if share >= 0.005), reverse=True)
    return f"{what}: {listed([f'{100.0 * share:.0f} % {name}' for share, name in shown]) or 'not looked into'}"


def _of_groups(equations: Equations) -> list[str]:
    """The group that is solved with the most unknowns at once."""
    stages = [stage for stage in equations.stages if stage.unknowns.stop > stage.unknowns.start]
    if not stages:
        return ["All links follow from the inputs, with nothing to be solved"]
    largest = max(stages, key=lambda stage: stage.unknowns.stop - stage.unknowns.start)
    many = largest.unknowns.stop - largest.unknowns.start
    groups = "one group" if len(stages) == 1 else f"{len(stages)} groups, one after the other; the largest"
    unknowns = "1 unknown" if many == 1 else f"{many} unknowns at once"
    links = f" ({', '.join(largest.links)})" if 0 < len(largest.links) <= 8 else ""
    return [f"Solved as {groups} with {unknowns}{links}, {_way(equations, stages)}"]


def _way(equations: Equations, stages: list[Stage]) -> str:
    """In closed form, or by Newton's method."""
    if find_spec("planar.equations.closed_form") is None:
        return "by Newton's method"
    from planar.equations.closed_form import closed

    have = sum(closed(equations, stage) is not None for stage in stages)
    if have == len(stages):
        return "which has a closed form" if have == 1 else "and all have a closed form"
    if not have:
        return "by Newton's method, since it has no closed form"
    return f"and {have} of them have a closed form; the others are solved by Newton's method"


def _timed(task: Callable[[], Any]) -> tuple[float, Any]:
    start = perf_counter()
    found = task()
    return perf_counter() - start, found


def _best(task: Callable[[], object], rounds: int) -> float:
    """Seconds of the fastest of so many calls, or of fewer that take long."""
    least, end = float("inf"), perf_counter() + ENOUGH
    for _ in range(rounds):
        least = min(least, _timed(task)[0])
        if perf_counter() > end:
            break
    return least
