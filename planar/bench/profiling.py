"""Where the time of a call goes: its parts, as Python's own profiler sees them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from cProfile import Profile
from time import perf_counter
from typing import Any, NamedTuple

from planar.foundation.private_cache import disable_cache

FunctionKey = tuple[str, ...]

SWEEP_PARTS: dict[FunctionKey, str] = {
    ("batch", "initial_assembly.py", "find_assemblies"): "assembling the starts",
    ("march", "runs.py", "run_compiled"): "machine code",
    ("batch", "block.py", "_lead_to_start"): "leading designs to where the run starts",
    ("batch", "design_ends.py", "follow_to_ends"): "finding dead points in closed form",
    ("batch", "design_ends.py", "follow_to_dead_points"): "following designs to where they stop",
    ("batch", "general_path.py", "solve"): "the general path",
}
"""Functions of a sweep, and what they do; the time of one that another calls is not the other's."""


CYCLE_PARTS: dict[FunctionKey, str] = {
    ("equations", "acceptance.py", "_judge_blocks"): "computing blocks",
    ("equations", "acceptance.py", "_solve_run"): "solving blocks",
    ("equations", "acceptance.py", "_judge_by_one_formula"): "rates and the residual check",
    ("equations", "constraint_check.py", "judge"): "the residual check",
    ("continuation", "path.py", "_follow_general"): "following the curve",
    ("solving", "cycle.py", "_find_range_end"): "finding the ends of the range",
}
"""The same of a cycle."""


class CallProfile(NamedTuple):
    """Seconds of a task; and of every function called in it, with all that it calls and without, and by whom."""

    seconds: float
    total_seconds: dict[FunctionKey, float]
    own_seconds: dict[FunctionKey, float]
    callers: dict[FunctionKey, dict[FunctionKey, float]]
    """By function: its callers, with the seconds of their calls."""


def profile_first_call(task: Callable[[], Any]) -> tuple[float, float]:
    """Seconds of a task, with none of its machine code known before, and of these to compile it."""
    from planar.codegen import llvm_compile  # takes long to load

    llvm_compile.compile_function.cache_clear()
    with disable_cache():
        found = profile_call(task)
    return found.seconds, found.total_seconds.get(("codegen", "llvm_compile.py", "_compile_object"), 0.0)


def profile_sweep(task: Callable[[], Any]) -> tuple[float, dict[str, float]]:
    """Seconds of a sweep, and its parts, each as a share of the whole."""
    return _profile_parts(task, SWEEP_PARTS, "reading designs and writing results")


def profile_cycle(task: Callable[[], Any]) -> dict[str, float]:
    """The parts of a cycle, each as a share of the whole."""
    return _profile_parts(task, CYCLE_PARTS, "the rest")[1]


def _profile_parts(
    task: Callable[[], Any], part_names: dict[FunctionKey, str], rest: str
) -> tuple[float, dict[str, float]]:
    """Seconds of a task, and the shares of functions and of the rest in it."""
    found = profile_call(task)
    parts = {place: found.total_seconds.get(place, 0.0) for place in part_names}
    for place in part_names:
        for caller, seconds in found.callers.get(place, {}).items():
            within = _enclosing_part(found, caller, part_names)
            if within is not None:
                parts[within] -= seconds
    shares = {part_names[place]: max(0.0, time) / found.seconds for place, time in parts.items() if time > 0.0}
    shares[rest] = max(0.0, 1.0 - sum(shares.values()))
    return found.seconds, shares


def profile_call(task: Callable[[], Any]) -> CallProfile:
    """Where a task spends its time."""
    profile = Profile()
    start = perf_counter()
    profile.runcall(task)
    found = CallProfile(perf_counter() - start, defaultdict(float), defaultdict(float), {})
    for each in profile.getstats():
        place = _function_key(each.code)
        found.total_seconds[place] += each.totaltime
        found.own_seconds[place] += each.inlinetime
        for callee in each.calls or ():
            callers = found.callers.setdefault(_function_key(callee.code), defaultdict(float))
            callers[place] += callee.totaltime
    return found


def _enclosing_part(found: CallProfile, place: FunctionKey, part_names: dict[FunctionKey, str]) -> FunctionKey | None:
    """The part in which a function is called, if it is in one."""
    seen, waiting = {place}, [place]
    while waiting:
        here = waiting.pop(0)
        if here in part_names:
            return here
        more = set(found.callers.get(here, ())) - seen
        seen |= more
        waiting += more
    return None


def _function_key(code: Any) -> FunctionKey:
    """(folder, file, function) of Python's functions."""
    if isinstance(code, str):
        return ("other",)
    folder, _, name = code.co_filename.replace("\\", "/").rpartition("/")
    return folder.rpartition("/")[2], name, code.co_name
