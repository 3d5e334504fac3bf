"""Searches that are kept in a folder: stopped anywhere, killed, gone on with; and folders that hold something else."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import planar
from planar.synthesis.judgement.judgement import DesignJudge
from tests.command import ROOT, run

SETTINGS = {
    "synthesise.DRAWS": 100,
    "synthesise.MATCHES": 4,
    "synthesise.ROUNDS": 2,
    "synthesise.GOOD": 0.0,
    "synthesise.SETTLED": 99,
    "fitting.design_fit.MAX_STEPS": 30,
}
"""Numbers of modules in `planar.synthesis`, for searches of few designs whose fits end before they converge."""
TASK = {
    "planar": 1,
    "name": "Lid",
    "units": {"length": "mm", "angle": "deg"},
    "start": ["slider-crank", "four-bar"],
    # more places than either start meets exactly
    "wanted": [{"point": "E", "through": [[4 * k, 12 * (k % 5) - k * k / 4] for k in range(12)]}],
}


def set_small_search(patch):
    """Few designs; and no machine code, which rounds otherwise than numpy, so that numbers are the same to the bit."""
    patch.setattr("planar.codegen.printed_formula.MAX_COMPILED_INSTRUCTIONS", 0)
    for name, value in SETTINGS.items():
        patch.setattr(f"planar.synthesis.{name}", value)


@pytest.fixture(autouse=True)
def few_designs(monkeypatch):
    set_small_search(monkeypatch)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A search that nothing stopped, with its folder, and how many designs were judged."""
    folder, judged = tmp_path_factory.mktemp("whole") / "designs", []
    with pytest.MonkeyPatch.context() as patch:
        set_small_search(patch)
        stop_at(patch, None, judged)
        found = planar.synthesise(TASK, many=2, seed=5, folder=folder)
    return found, folder, len(judged)


def stop_at(patch, number, judged):
    """Stop, as the keyboard does, before the design of this number is judged."""
    judge = DesignJudge.judge

    def stopped(self, *given):
        if len(judged) == number:
            raise KeyboardInterrupt
        judged.append(given[0].name)
        return judge(self, *given)

    patch.setattr(DesignJudge, "judge", stopped)


def texts(folder):
    return {str(each.relative_to(folder)): each.read_text() for each in sorted(folder.rglob("*")) if each.is_file()}


def assert_same(one, other):
    assert one.remarks == other.remarks and one.size == other.size and one.is_finished and other.is_finished
    for first, second in ((one.designs, other.designs), (one.rejected, other.rejected)):
        assert [planar.dumps(each.mechanism) for each in first] == [planar.dumps(each.mechanism) for each in second]
        for a, b in zip(first, second, strict=True):
            assert (a.defects, a.start, a.numbers) == (b.defects, b.start, b.numbers)
            assert repr((a.error, a.greatest_miss, a.motion)) == repr((b.error, b.greatest_miss, b.motion))
            for own, same in ((a.misses, b.misses), (a.inputs, b.inputs)):
                np.testing.assert_array_equal(np.concatenate(own), np.concatenate(same))


def copied(folder, to, leave_out=()):
    """A folder as it was before its last rounds."""
    for name, text in texts(folder).items():
        if name.removeprefix("search/") not in leave_out:
            (to / name).parent.mkdir(exist_ok=True, parents=True)
            (to / name).write_text(text)


def test_a_folder_changes_nothing_and_progress_is_told(whole):
    found, folder, _ = whole
    steps = []
    assert_same(planar.synthesise(TASK, many=2, seed=5, progress=steps.append), found)
    assert len(found) == 2
    assert len([*(folder / "search").iterdir()]) == 6, "two starts, the round of exact designs and two catalogues each"
    assert [*dict.fromkeys((each.start_number, each.start_count, each.round, each.stage) for each in steps)] == [
        (number, 2, turn, stage)
        for number in (1, 2)
        for turn in (1, 2)
        for stage in ("catalogue", "matches", "fit", "judgement")
    ]
    assert steps[0].best == np.inf
    assert min(each.best for each in steps) >= found[0].error
    assert steps[-1].best_share == pytest.approx(steps[-1].best / found.size)


def test_what_was_stopped_goes_on_to_the_same_designs(whole, tmp_path, monkeypatch):
    found, folder, count = whole
    for number in (0, count // 2):
        with monkeypatch.context() as patch:
            stop_at(patch, number, judged := [])
            with pytest.raises(KeyboardInterrupt):
                planar.synthesise(TASK, many=2, seed=5, folder=tmp_path / "designs")
            assert len(judged) == number
    with monkeypatch.context() as patch:
        stop_at(patch, None, judged := [])
        assert_same(planar.synthesise(TASK, many=2, seed=5, folder=tmp_path / "designs"), found)
        assert 0 < len(judged) < count, "rounds that were done are not done again"
    assert texts(tmp_path / "designs") == texts(folder)


def test_what_is_in_the_way_is_told_alike_after_an_interrupt(tmp_path, monkeypatch):
    task = TASK | {"start": "slider-crank", "demands": [{"inside": [[-1, -1], [1, 1]]}]}
    monkeypatch.setattr("planar.synthesis.synthesise.MATCHES", 2)  # each design is judged all round its region
    with monkeypatch.context() as patch:
        stop_at(patch, None, judged := [])
        whole = planar.synthesise(task, many=1)
    with monkeypatch.context() as patch:
        stop_at(patch, len(judged) - 1, [])
        with pytest.raises(KeyboardInterrupt):
            planar.synthesise(task, many=1, folder=tmp_path)
    assert_same(planar.synthesise(task, many=1, folder=tmp_path), whole)
    assert not len(whole) and len(whole.remarks) > 1


def test_a_process_that_is_killed_leaves_nothing_broken(whole, tmp_path):
    found, folder, _ = whole
    copied(folder, tmp_path / "designs", leave_out=("00002-2.json",))
    killed = (
        "import json, os, signal, sys; from importlib import import_module; import planar\n"
        "from planar.synthesis.judgement.judgement import DesignJudge\n"
        f"for name, value in {SETTINGS!r}.items():\n"
        "    module, _, constant = name.rpartition('.')\n"
        "    setattr(import_module(f'planar.synthesis.{module}'), constant, value)\n"
        "judge, left = DesignJudge.judge, [1]\n"
        "def die(self, *given):\n"
        "    left[0] -= 1\n"
        "    return os.kill(os.getpid(), signal.SIGKILL) if left[0] < 0 else judge(self, *given)\n"
        "DesignJudge.judge = die\n"
        "planar.synthesise(json.loads(sys.argv[1]), many=2, seed=5, folder='designs')\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", killed, json.dumps(TASK)],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=False,
        timeout=120,
    )
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    for path in (tmp_path / "designs").rglob("*.json"):
        json.loads(path.read_text())
    assert_same(planar.synthesise(TASK, many=2, seed=5, folder=tmp_path / "designs"), found)


def test_a_round_that_somebody_changed_is_made_again(whole, tmp_path):
    found, folder, _ = whole
    copied(folder, tmp_path)
    (tmp_path / "search" / "00001-2.json").write_text('{"size": 0.1, "designs": [{}]}')
    (tmp_path / "search" / "00002-1.json").write_text("{")
    assert_same(planar.synthesise(TASK, many=2, seed=5, folder=tmp_path), found)
    assert texts(tmp_path) == texts(folder)


@pytest.mark.parametrize(
    ("task", "given", "sentence"),
    [
        (TASK | {"name": "Bonnet"}, {}, "designs of another task, 'Lid'"),
        (TASK | {"demands": ["one branch"]}, {}, "designs of another task"),
        (TASK, {"many": 3}, "has many = 2, and not 3"),
        (TASK, {"seed": 6}, "has seed = 5, and not 6"),
    ],
)
def test_a_folder_of_another_search_is_refused(whole, task, given, sentence):
    _, folder, _ = whole
    before = texts(folder)
    with pytest.raises(planar.BadInput, match=sentence):
        planar.synthesise(task, **({"many": 2, "seed": 5} | given), folder=folder)
    assert texts(folder) == before


def test_a_folder_of_other_things_is_refused(tmp_path):
    (tmp_path / "thesis.txt").write_text("do not lose me")
    with pytest.raises(planar.BadInput, match=r"holds 'thesis.txt' and no designs of a task"):
        planar.synthesise(TASK, folder=tmp_path)
    assert texts(tmp_path) == {"thesis.txt": "do not lose me"}


def test_a_time_limit_says_how_far_it_came(tmp_path):
    early = planar.synthesise(TASK, many=2, seed=5, timeout=1e-9, folder=tmp_path)
    assert not early.is_finished and not len(early)
    told = "the time limit of 1e-09 s was reached at start 1 of 2 (Slider-crank), exact designs"
    assert any(told in each for each in early.remarks)


def test_the_command_tells_what_was_found_when_it_is_stopped_and_goes_on(whole, tmp_path, monkeypatch):
    found, folder, _ = whole
    copied(folder, tmp_path / "designs", leave_out=("00002-2.json",))
    (tmp_path / "lid.json").write_text(json.dumps(TASK))
    words = ("synthesise", "lid.json", "--many", "2", "--seed", "5", "-o", "designs")
    with monkeypatch.context() as patch:
        stop_at(patch, 1, [])
        ended = run(tmp_path, *words)
    assert "the same command goes on where it was" in ended.refused(130)
    assert "the search was interrupted at start 2 of 2" in ended.out
    assert (tmp_path / "designs" / "index.html").exists()
    told = json.loads(run(tmp_path, *words, "--json").done())
    assert told["is_finished"] and told["seed"] == 5
    for design, record in zip(found, told["designs"], strict=True):
        assert record["error"] == design.error
        assert record["numbers"] == design.numbers
        assert record["motion"]["is_whole_turn"] == design.motion.is_whole_turn
        assert Path(record["file"]).name in texts(tmp_path / "designs")


@pytest.mark.skipif(sys.platform == "win32", reason="processes are ended otherwise there")
def test_a_signal_to_end_stops_the_command_as_the_keyboard_does(tmp_path, monkeypatch):
    (tmp_path / "lid.json").write_text(json.dumps(TASK))
    monkeypatch.setattr(DesignJudge, "judge", lambda *_: signal.raise_signal(signal.SIGTERM))
    ended = run(tmp_path, "synthesise", "lid.json", "--many", "2", "-o", "designs")
    assert "interrupted" in ended.refused(128 + signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
