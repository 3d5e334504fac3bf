"""The speed of a linkage on this machine: what `planar bench` measures and says."""

import json
import math
from cProfile import Profile
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import planar
from planar.bench import benchmark as measuring
from planar.bench import profiling as profiled
from planar.bench.benchmark import LENGTH_VARIATIONS, SWEEP_STEPS, measure_speed
from planar.bench.profiling import SWEEP_PARTS, profile_call, profile_cycle, profile_first_call, profile_sweep
from planar.reports.tables.benchmark import format_time as shown
from planar.solving.cycle import cycle
from tests.builders import bar_document, four_bar_document
from tests.command import run
from tests.known import MODELS
from tests.watchdog import watched

# a busy machine's clock goes on while it does something else, so these tests have clocks of their own


class Clock:
    """Goes on by what is done."""

    now = 0.0

    def __call__(self):
        return self.now


def measured_by(monkeypatch, clock):
    monkeypatch.setattr(measuring, "perf_counter", clock)
    monkeypatch.setattr(profiled, "perf_counter", clock)
    monkeypatch.setattr(profiled, "Profile", lambda: Profile(clock))
    monkeypatch.setattr(measuring, "GRACE_SECONDS", 600.0)  # s, by a clock on the wall


@pytest.fixture
def clock(monkeypatch):
    """By which all is measured."""
    made = Clock()
    measured_by(monkeypatch, made)
    return made


TICK = 0.25


@pytest.fixture
def ticks(monkeypatch):
    """A clock that goes on by so much whenever it is looked at, as the profiler does at every call."""
    measured_by(monkeypatch, count(0.0, TICK).__next__)


def test_bench_prints_tables_and_says_what_bounds_it(tmp_path, ticks):
    said = run(tmp_path, "bench", "000-P1", "--seconds", "0.2").done()
    for word in ("assembly", "Four-bar", "machine code", "general path", "2 unknowns at once"):
        assert word in said


def test_bench_gives_a_record(tmp_path, ticks):
    (record,) = json.loads(run(tmp_path, "bench", "slider-crank", "--seconds", "0.2", "--json").done())
    assert (record["links"], record["unknowns"]) == (4, 2)
    assert min(record[name] for name in ("equations", "assembly", "solve", "cycle")) > 0.0
    assert [each["rates"] for each in record["sweeps"]] == [True, False]
    for each in record["sweeps"]:
        assert each["seconds"] > 0.0
        assert (each["refused"], each["general"], each["within"]) == (0, 0, LENGTH_VARIATIONS[0])
        # nothing is counted twice
        assert sum(each["parts"].values()) == pytest.approx(1.0, abs=1e-9)
    native = record["sweeps"][0]
    assert 0.0 < native["compiling"] <= native["first"] + TICK
    assert {"machine code", "assembling the starts"} <= set(native["parts"])


def instead(monkeypatch, clock, each, closes):
    """Sweeps that take so many seconds a design, and close where `closes` says so of a design's lengths."""

    def sweep(mechanism, designs, steps, points, **given):
        values = np.stack(list(designs.values()))
        clock.now += each * values.shape[1]
        return SimpleNamespace(whole=closes(values), general=0)

    monkeypatch.setattr(measuring, "sweep", sweep)
    monkeypatch.setattr(profiled, "SWEEP_PARTS", {})


def test_the_time_of_a_position_is_that_of_the_whole_sweep_divided(monkeypatch, clock):
    instead(monkeypatch, clock, 1e-3, lambda values: np.ones(values.shape[1], dtype=bool))
    found, _ = measuring._time_sweeps_within(MODELS["crank-rocker"], (None, None, "A0"), 2.0)
    assert [each.rates for each in found] == [True, False]
    for each in found:
        assert each.designs >= measuring.FIRST_DESIGNS
        assert each.seconds * (SWEEP_STEPS + 1) == pytest.approx(1e-3)
        assert (each.refused, each.within) == (0, LENGTH_VARIATIONS[0])


def test_a_linkage_that_is_not_closed_within_a_hundredth_is_swept_nearer(monkeypatch, clock):
    lengths = np.array([0.2, 0.05, 0.18, 0.12])[:, None]
    instead(monkeypatch, clock, 1e-4, lambda values: np.all(np.abs(values / lengths - 1.0) < 2e-4, axis=0))
    found, _ = measuring._time_sweeps_within(MODELS["crank-rocker"], (None, None, "A0"), 0.2)
    assert {(each.within, each.refused) for each in found} == {(LENGTH_VARIATIONS[1], 0)}
    instead(monkeypatch, clock, 1e-4, lambda values: np.zeros(values.shape[1], dtype=bool))
    found, _ = measuring._time_sweeps_within(MODELS["crank-rocker"], (None, None, "A0"), 0.2)
    assert all(each.refused == each.designs for each in found)


def test_a_structure_has_neither_cycle_nor_sweeps():
    bars = {"a": ("A", "C", 1), "b": ("B", "C", 1)}
    value = bar_document({"A": [0, 0], "B": [1, 0]}, bars, sketch={"C": [0.5, 0.8]})
    found = measure_speed(planar.from_dict(value), rounds=1)
    assert (found.cycle, found.sweeps) == (None, ())
    assert found.solve > 0.0
    assert found.bounds[0].startswith("Solved as one group with 2 unknowns at once (a, b)")


def test_sweeps_that_take_far_too_long_are_given_up(monkeypatch):
    monkeypatch.setattr(measuring, "GRACE_SECONDS", 0.2)

    def slow(*args):
        yield "one"
        while True:
            math.sqrt(2.0)

    monkeypatch.setattr(measuring, "_time_sweeps", slow)
    with watched(10):
        found, told = measuring._time_sweeps_within(MODELS["crank-rocker"], (None, None, "A0"), 0.1)
    assert found == ("one",)
    assert told == ["Sweeps were given up after 0.3 s: some design takes so long"]


def test_an_interrupt_by_the_user_is_none_by_the_clock(monkeypatch):
    def interrupted(*args):
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr(measuring, "_time_sweeps", interrupted)
    with pytest.raises(KeyboardInterrupt):
        measuring._time_sweeps_within(MODELS["crank-rocker"], (None, None, "A0"), 10.0)


def test_the_parts_of_a_sweep_are_functions_that_are_there():
    import importlib

    package = Path(planar.__file__).parents[1]
    for folder, file, name in SWEEP_PARTS:
        (path,) = package.glob(f"planar/**/{folder}/{file}")
        module = importlib.import_module(".".join(path.relative_to(package).with_suffix("").parts))
        owners = [module, *(each for each in vars(module).values() if isinstance(each, type))]
        assert any(callable(getattr(each, name, None)) for each in owners), name


def test_the_time_of_a_part_within_another_is_counted_once(monkeypatch, clock):
    def busy(seconds):
        clock.now += seconds

    def inner():
        busy(0.02)

    def between():
        inner()

    def outer():
        busy(0.01)
        between()

    def task():
        outer()
        busy(0.01)

    here = profiled._function_key(inner.__code__)[:2]
    monkeypatch.setattr(profiled, "SWEEP_PARTS", {(*here, "outer"): "outer", (*here, "inner"): "inner"})
    whole, parts = profile_sweep(task)
    assert whole == pytest.approx(0.04)
    assert parts["inner"] == pytest.approx(0.5)
    assert parts["outer"] == pytest.approx(0.25)
    assert sum(parts.values()) == pytest.approx(1.0)


def test_the_parts_of_a_cycle_are_what_their_functions_take():
    """Block after block at first, and once a run is asked for often by one formula."""
    names = ["seen", "by", "no other", "test"]
    mechanism = planar.from_dict(four_bar_document(0.3, 1.0, 0.8, 0.9, 1.0, names=names, omega="1 rad/s"))
    cycle(mechanism, 60)
    for parts in (("computing blocks", "the residual check"), ("solving blocks", "rates and the residual check")):
        shares = profile_cycle(lambda: cycle(mechanism, 60))
        assert min(shares["the rest"], *(shares[part] for part in parts)) > 0.0
        assert sum(shares.values()) == pytest.approx(1.0)
        for _ in range(200):
            cycle(mechanism, 60)
    assert profile_cycle(lambda: None) == {"the rest": 1.0}


def test_a_first_call_compiles_whatever_is_kept():
    mechanism = MODELS["crank-rocker"]

    def task():
        return planar.sweep(mechanism, {"crank.length": [0.045]}, 5)

    task()
    assert profile_first_call(task)[1] > 0.0
    assert profile_call(task).total_seconds.get(("native", "compiled.py", "_made"), 0.0) == 0.0


def test_times_are_shown_in_the_unit_that_fits():
    assert [shown(each) for each in (None, 2.0, 3e-3, 4.5e-6, 7e-9)] == ["-", "2 s", "3 ms", "4.5 us", "7 ns"]
