"""What the benchmark measures against: C by hand, closed forms, and other solvers where they are installed."""

from __future__ import annotations

from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

import planar
from benchmarks import by_planar, compiling, dyadic, growth, long, peers, repeated, speed_page, tables
from benchmarks.contests import Contest, Result
from benchmarks.curves import Curve
from benchmarks.limit import LANES, compiled
from benchmarks.linkages.base import THETA
from benchmarks.mixed import Mixed
from benchmarks.processes import Process
from benchmarks.swept import RATES, SWEPT, SweptFourBar, angles
from benchmarks.swept.row import Row

NAMES = [swept.name for swept in SWEPT]
WITHIN = {"python_solvespace": 1e-7}
"""A solver's own tolerance (m), where it is not told another."""


@pytest.fixture(scope="module")
def limit():
    found = compiled()
    if found is None:
        pytest.skip("no C compiler")
    return found


def far(found, exact):
    """The greatest error of each order as a part of its greatest value."""
    off = np.abs(np.asarray(found, dtype=float) - exact).reshape(-1, 2, *exact.shape[1:]).max(axis=(1, 2, 3))
    return off / np.abs(exact).reshape(-1, 2, *exact.shape[1:]).max(axis=(1, 2, 3))


@pytest.mark.parametrize("swept", SWEPT, ids=NAMES)
def test_c_by_hand_is_the_closed_form(limit, swept):
    d, theta = swept.designs(2 * LANES), angles(200)
    for entry in Contest("", swept, d, 200)._limits(theta):
        exact = swept.motion(d, theta)[: 6 if entry.rates else 2]
        assert far(entry.read(entry.solve()), exact).max() < 1e-12


def test_c_by_hand_over_the_steps_of_one_design(limit):
    for swept in (SWEPT[0], SWEPT[-1]):
        for entry in Contest("", swept, None, 360)._alone(angles(360)):
            exact = swept.motion(swept.base()[:, None], angles(360))[: 6 if entry.rates else 2]
            assert far(entry.read(entry.solve()), exact).max() < 1e-12
    row = Row(10)
    exact = row.motion(np.empty((0, 1)), angles(360))
    assert far(limit.row(row.cells, angles(360))()[:, :, None], exact).max() < 1e-12


@pytest.mark.parametrize("swept", SWEPT, ids=NAMES)
def test_closed_forms_are_what_planar_finds(swept):
    moved = planar.cycle(planar.from_dict(swept.document()), 60).point(swept.point)
    found = np.concatenate([moved.position.T, moved.velocity.T, moved.acceleration.T])[..., None]
    assert far(found, swept.motion(swept.base()[:, None], angles(60))).max() < 1e-12


def test_designs_that_cannot_turn_are_refused_from_the_same_step_on():
    swept = SweptFourBar()
    d = swept.mixed(200)
    a, b, c, g = d
    turns = (g + a < b + c) & (np.abs(g - a) > np.abs(b - c))
    stuck = np.flatnonzero(~turns)[:2]
    assert np.array_equal(turns, ~np.isnan(swept.motion(d, angles(2000))[0]).any(axis=0))
    contest = Contest("", swept, np.ascontiguousarray(d[:, [*stuck, *np.flatnonzero(turns)[:1]]]), 50)
    entry = by_planar.sweeps(swept, contest.d, 50)[-1]
    result = contest._result(entry, 1.0, 1.0)
    assert (result.designs, result.refused, result.wrong) == (3, 2, 0)
    assert result.error < 1e-12


def test_a_sweep_is_read_as_its_contract_has_it(monkeypatch):
    swept, asked = SweptFourBar(), {}
    d, exact = swept.designs(7), swept.motion(swept.designs(7), angles(20))

    def sweep(mechanism, named, *, steps, points, rates, workers):
        asked.update(named)
        orders = [{points[0]: np.moveaxis(exact[k : k + 2], (0, 2), (2, 0))} for k in (0, 2, 4)]
        status = np.zeros((7, steps + 1), dtype=int)
        status[3, 5:] = 2
        return SimpleNamespace(position=orders[0], velocity=orders[1], acceleration=orders[2], status=status)

    monkeypatch.setattr(planar, "sweep", sweep, raising=False)
    for entry in by_planar.sweeps(swept, d, 20)[:2]:
        found = entry.read(entry.solve())
        assert np.isnan(found[:, 5:, 3]).all()
        whole = np.delete(found, 3, axis=2), np.delete(exact[: len(found)], 3, axis=2)
        assert np.array_equal(*whole)
    assert np.array_equal(asked["BC.length"], d[1])


@pytest.mark.skipif(not hasattr(planar, "sweep"), reason="planar.sweep is not there")
@pytest.mark.parametrize("swept", SWEPT, ids=NAMES)
def test_sweeps_find_the_closed_form(swept):
    d = swept.designs(5)
    for entry in by_planar.sweeps(swept, d, 40):
        exact = swept.motion(d, angles(40))[: 6 if entry.rates else 2, :, entry.designs]
        assert far(entry.read(entry.solve()), exact).max() < 1e-9


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", peers.installed())
def test_peers_find_what_planar_finds(name):
    module = import_module(f"benchmarks.peers.{peers.PACKAGES[name]}")
    for swept in SWEPT:
        base, theta = swept.base()[:, None], angles(90)
        if name == "pylinkage":
            entries = module.entries(swept, base, theta, many=False)
        else:
            entries = module.entries(swept, theta) if swept.only_turning else []
        for entry in entries:
            exact = swept.motion(base, theta)[: 6 if entry.rates else 2, entry.steps]
            assert far(entry.read(entry.solve()), exact).max() < WITHIN.get(name, 1e-9), (name, swept.name)


def test_the_page_on_speed_gets_its_table_and_plots_between_its_markers(tmp_path):
    results = [
        Result("four-bar", "C by hand", False, 1e-9, 1.0, 1e-16, 10, 1, 0),
        Result("four-bar", "planar.sweep", False, 5e-9, 5.0, 2e-16, 10, 1, 0),
        Result("four-bar", "planar.sweep", True, 1.1e-8, 2.5, 3e-15, 10, 1, 0),
    ]
    curves = [Curve("C by hand", (1, 10), (1e-8, 1e-9), 1e-16), Curve("planar", (1, 10), (1e-6, 1e-7), 1e-16)]
    path = tmp_path / speed_page.PAGE
    path.parent.mkdir(parents=True)
    path.write_text("nothing", encoding="utf-8")
    with pytest.raises(ValueError, match="speed"):
        speed_page.write(tmp_path, "planar", results, curves, curves)
    path.write_text(f"before\n{speed_page.START}\nold\n{speed_page.END}\nafter\n", encoding="utf-8")
    speed_page.write(tmp_path, "planar", results, curves, curves)
    text = path.read_text(encoding="utf-8")
    assert text.startswith("before\n") and text.endswith("\nafter\n") and "old" not in text
    assert "|  | planar.sweep | 5 ns | 11 ns | 5 / 2.5 | 3e-15 | 1 of 10 (0) |" in text
    folder = tmp_path / speed_page.PICTURES_FOLDER
    assert all((folder / picture).stat().st_size > 5000 for picture in speed_page.PICTURES.values())


def test_random_linkages_of_dyads_are_c_by_hand_and_numpys_closed_form(limit):
    mixed = Mixed(30, True, 60)
    stops = 0
    for entry in mixed.entries()[:3]:
        told = entry.solve()
        for k in range(mixed.many):
            exact = dyadic.closed_form(mixed.tape, mixed.turned, k, entry.rates)
            found = entry.read(told, k)
            assert np.array_equal(np.isnan(found[:, :2]), np.isnan(exact[:, :2]))
            gone = np.isnan(exact).any(axis=(0, 1))
            stops += bool(gone.any())
            # rates grow towards a dead point
            whole = ~gone if not gone.any() else np.flatnonzero(gone)[0] > np.arange(len(gone)) + 3
            scale = np.abs(exact[..., whole]).max(axis=2, keepdims=True).max(axis=0, keepdims=True)
            np.testing.assert_allclose((found / scale)[..., whole], (exact / scale)[..., whole], atol=1e-9)
    assert stops >= 3


def test_random_linkages_go_round_but_for_those_whose_last_dyad_stops():
    tape = dyadic.random_tape(40, True)
    counts = np.diff(tape.first)
    assert (counts.min(), counts.max()) >= (dyadic.FEWEST, 15) and counts.max() <= dyadic.MOST
    gone = [np.isnan(dyadic.closed_form(tape, angles(400) - THETA, k, rates=False)).any(axis=(1, 2)) for k in range(40)]
    # only the last joint is not there
    assert not any(each[:-1].any() for each in gone)
    assert 0 < sum(each[-1] for each in gone) < 12
    assert all(dyadic.sketch(tape, k).shape == (counts[k], 2) for k in range(40))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.skipif("pylinkage" not in peers.installed(), reason="needs pylinkage")
def test_pylinkage_finds_random_linkages_of_dyads():
    mixed = Mixed(6, False, 90)
    entries = [entry for entry in mixed.entries() if entry.system.startswith("pylinkage")]
    assert [entry.rates for entry in entries] == [False, False, True, True]
    for entry in entries:
        assert mixed.result(entry, 1.0, 1.0).error < 1e-9


@pytest.mark.skipif(not hasattr(planar, "sweep_each"), reason="planar.sweep_each is not there")
def test_planar_finds_random_linkages_of_dyads_and_refuses_the_others():
    mixed = Mixed(30, True, 60)
    for entry in mixed.entries():
        if entry.system.startswith("planar"):
            result = mixed.result(entry, 1.0, 1.0)
            assert result.error < 1e-9
            assert result.wrong == 0
            assert result.refused > 0


@pytest.mark.parametrize("make", [long.row, long.scissors], ids=["row", "scissors"])
def test_long_linkages_go_round_in_c_by_hand(limit, make):
    linkage = make(40)
    assert linkage.links in (40, 41)
    turned = 2.0 * np.pi * np.linspace(0.0, 1.0, 61)
    exact = dyadic.closed_form(linkage.tape, turned, 0, rates=True)
    assert np.isfinite(exact).all()
    np.testing.assert_allclose(exact[:, :2, 0], linkage.places, atol=1e-12)
    np.testing.assert_allclose(limit.tape(linkage.tape, turned, RATES)(), exact, atol=1e-9 * np.abs(exact).max())
    # the bars keep their lengths: the tape is the linkage of bars
    for a, b, *more in linkage.bars:
        for c in (b, *more):
            far = np.hypot(*(exact[a, :2] - exact[c, :2]))
            np.testing.assert_allclose(far, far[0], atol=1e-10)


def test_long_chains_of_triads_go_round():
    linkage = long.triads(14)
    assert linkage.links == 14
    links = {"frame": {"points": {f"P{pin}": linkage.places[pin].tolist() for pin in linkage.frame}}}
    for k, (a, b, *more) in enumerate(linkage.bars):
        (ax, ay), (bx, by) = linkage.places[[a, b]]
        length = float(np.hypot(bx - ax, by - ay))
        turn = np.array([[bx - ax, by - ay], [ay - by, bx - ax]]) / length
        points = {f"P{c}": (turn @ (linkage.places[c] - linkage.places[a])).tolist() for c in more}
        links[f"bar{k}"] = {"ends": [f"P{a}", f"P{b}"], "length": length, "points": points}
    value = {
        "planar": 1,
        "frame": "frame",
        "links": links,
        "pairs": [{"turning": f"P{pin}"} for pin in range(len(linkage.places))],
        "inputs": [{"pair": "P0", "position": THETA, "velocity": 1.0}],
        "sketch": {f"P{k}": at.tolist() for k, at in enumerate(linkage.places) if k not in linkage.frame},
    }
    motion = planar.cycle(planar.from_dict(value), 24)
    assert (motion.outcome, len(motion)) == (planar.Outcome.SOLVED, 25)
    last = motion.point(f"P{linkage.bars[-1][1]}").position
    assert 0.15 < np.ptp(last[:, 0]) < 0.3


def test_code_is_printed_and_compiled_by_one_process_and_read_by_another():
    first = compiling._measure_structure("four-bar")
    assert min(first.printing, first.compiling, first.reading) > 0.0
    assert first.reading < first.compiling


def test_the_page_on_speed_has_the_other_tables_too():
    tables = (
        [
            long.Long("rows", (10, 100), (2e-9, 3e-9), (1e-9, None), 1e-15),
            long.Long("triads", (10, 102), (5e-9, None), (None, None), 0.0),
        ],
        [compiling.Compiling("four-bar", 0.01, 0.04, 0.002)],
        [Process("python -c pass", 0.1, 1.0)],
    )
    text = speed_page.section("planar", [], tables)
    assert "| rows | 2 ns (2 times C) | 3 ns | 1e-15 |" in text
    assert "| triads | 5 ns | not waited for | 0e+00 |" in text
    assert "| four-bar | 10 ms | 40 ms | 2 ms |" in text
    assert "| `python -c pass` | 100 ms | 1 |" in text


@pytest.mark.parametrize("kind", growth.KINDS)
def test_linkages_of_any_length_are_solved_and_run(kind):
    measured = growth.grow(kind, 10)
    assert measured.links == 10
    assert 0.0 <= measured.residual < 1e-13
    assert all(seconds is not None and seconds > 0.0 for seconds in measured.per_link())


def test_repeated_calls_stand_in_a_table_beside_fsolve():
    measured = repeated.repeated_calls(warm_calls=1, rounds=1)
    assert {each.positions for each in measured} == {1, 73, 361}
    assert all(0.0 < each.ratio < 1000.0 for each in measured)
    console = Console(width=120)
    with console.capture() as captured:
        console.print(tables.repeated(measured))
    assert "cycle of 72 steps, between dead points" in captured.get()
