"""Where the time of a call goes: its parts, as Python's own profiler sees them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from cProfile import Profile
from time import perf_counter
from typing import Any, NamedTuple

Place = tuple[str, ...]

OF_SWEEP: dict[Place, str] = {
    ("batch", "initial_assembly.py", "assembled"): "assembling the starts",
    ("march", "llvm_backend.py", "march"): "machine code",
    ("march", "numpy_backend.py", "march"): "casadi's program",
    ("batch", "block.py", "_at_start"): "leading designs to where the run starts",
    ("batch", "dead_point_tracking.py", "stopped"): "following designs to where they stop",
    ("batch", "general_path.py", "solve_one"): "the general path",
}
"""Functions of a sweep, and what they do; the time of one that another calls is not the other's."""


class Spent(NamedTuple):
    """Seconds of a task; and of every function called in it, with all that it calls and without, and by whom."""

    whole: float
    total: dict[Place, float]
    own: dict[Place, float]
    called: dict[Place, dict[Place, float]]
    """By function: its callers, with the seconds of their calls."""


def of_first(task: Callable[[], Any]) -> tuple[float, float]:
    """Seconds of a task, with none of its machine code known before, and of these to compile it."""
    try:
        from planar.codegen import code_cache, llvm_compile
    except ImportError:
        return spent(task).whole, 0.0
    llvm_compile.compiled.cache_clear()
    with code_cache.nowhere():
        found = spent(task)
    return found.whole, found.total.get(("codegen", "llvm_compile.py", "_made"), 0.0)


def of_sweep(task: Callable[[], Any]) -> tuple[float, dict[str, float]]:
    """Seconds of a sweep, and its parts, each as a share of the whole."""
    found = spent(task)
    parts = {place: found.total.get(place, 0.0) for place in OF_SWEEP}
    for place in OF_SWEEP:
        for caller, seconds in found.called.get(place, {}).items():
            within = _within(found, caller)
            if within is not None:
                parts[within] -= seconds
    shares = {OF_SWEEP[place]: max(0.0, time) / found.whole for place, time in parts.items() if time > 0.0}
    shares["reading designs and writing results"] = max(0.0, 1.0 - sum(shares.values()))
    return found.whole, shares


def of_cycle(task: Callable[[], Any]) -> dict[str, float]:
    """The parts of a cycle, each as a share of the whole."""
    found = spent(task)
    # what is called through casadi's buffers counts to the function that calls it
    share = sum(found.own.get(place, 0.0) for place in (CASADI, *CALLED)) / found.whole
    return {"in casadi": share, "in Python and numpy": 1.0 - share}


CASADI: Place = ("casadi",)
CALLED: tuple[Place, ...] = (("equations", "casadi_call.py", "__call__"), ("equations", "casadi_call.py", "over"))


def spent(task: Callable[[], Any]) -> Spent:
    """Where a task spends its time."""
    profile = Profile()
    start = perf_counter()
    profile.runcall(task)
    found = Spent(perf_counter() - start, Counter(), Counter(), {})
    for each in profile.getstats():
        place = _place(each.code)
        found.total[place] += each.totaltime
        found.own[place] += each.inlinetime
        for callee in each.calls or ():
            callers = found.called.setdefault(_place(callee.code), Counter())
            callers[place] += callee.totaltime
    return found


def _within(found: Spent, place: Place) -> Place | None:
    """The part of a sweep in which a function is called, if it is in one."""
    seen, waiting = {place}, [place]
    while waiting:
        here = waiting.pop(0)
        if here in OF_SWEEP:
            return here
        more = set(found.called.get(here, ())) - seen
        seen |= more
        waiting += more
    return None


def _place(code: Any) -> Place:
    """(folder, file, function) of Python's functions; of others the library, where it shows."""
    if isinstance(code, str):
        return CASADI if "casadi" in code else ("other",)
    folder, _, name = code.co_filename.replace("\\", "/").rpartition("/")
    return folder.rpartition("/")[2], name, code.co_name
