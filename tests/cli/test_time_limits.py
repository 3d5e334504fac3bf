"""Commands that a time limit or Ctrl-C ends: what is printed, the sentence, the status, and JSON that says so."""

from __future__ import annotations

import json
import signal

import click
import pytest

import planar
from planar.cli import main
from planar.cli.streams import TIME_LIMIT
from planar.foundation import time_limit
from tests.command import run
from tests.time_limits import REASON, CountedLimit

BY_USER = "the user interrupted it"
COMMANDS = {
    "balance": ("two-stroke-engine", "--counterweights", "crank", "--disc", "10mm"),
    "centres": ("four-bar", "--cycle", "--of", "24", "--to", "4000rad"),
    "chains": ("8",),
    "circuits": ("watt-six-bar",),
    "cycle": ("four-bar", "--to", "4000rad"),
    "forces": ("door-closer", "--cycle"),
    "harmonics": ("slider-crank",),
    "inspect": ("four-bar",),
    "modes": ("watt-six-bar",),
    "problem": ("four-bar", "--vary", "2"),
    "simulate": ("door-closer", "--duration", "1s"),
}


@pytest.fixture
def limits(monkeypatch):
    """Makes the limit of the next command one that is over after so many checks."""
    made, limited_by = [], time_limit.limited_by

    def with_checks(checks):
        def limited(limit, *more):
            if not made:
                limit = CountedLimit(checks)
                click.get_current_context().meta[TIME_LIMIT] = limit
                made.append(limit)
            return limited_by(limit, *more)

        made.clear()
        monkeypatch.setattr(time_limit, "limited_by", limited)

    return with_checks


def timed_commands():
    return {
        name
        for name, command in main.load_commands().items()
        if any("--timeout" in getattr(each, "opts", ()) for each in command.params)
    }


def test_commands_with_a_time_limit_are_known():
    untimed = {
        "bench", "cams", "convert", "edit", "explain", "guide", "models", "schema", "solve", "view"
    }  # fmt: skip
    assert timed_commands() == set(main.modules) - untimed
    assert set(COMMANDS) <= timed_commands()


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("form", [(), ("--json",)])
def test_a_command_is_ended_before_anything(name, form, limits, tmp_path):
    limits(0)
    ended = run(tmp_path, name, *COMMANDS[name], *form)
    if name in ("centres", "forces") and ended.status == 0:
        return  # a run that closed forms give at once is not ended
    assert ended.refused(1).startswith("interrupted: ")
    assert REASON in ended.err
    if form:
        value = json.loads(ended.out)
        assert value["outcome"] == "interrupted"
        assert REASON in value["reason"]


def test_what_a_command_found_is_printed(limits, tmp_path):
    whole = json.loads(run(tmp_path, "chains", "10", "--json").done())
    limits(40)
    ended = run(tmp_path, "chains", "10", "--json")
    part = json.loads(ended.out)
    assert part["outcome"] == "interrupted"
    assert 0 < len(part["found"]) < len(whole) and part["found"] == whole[: len(part["found"])]
    assert ended.refused(1) == (
        f"interrupted: {REASON}; what was found by then is reported; give more time for all of it"
    )
    limits(40)
    listed = run(tmp_path, "chains", "10")
    assert "at least" in listed.out and "kinematic chains of 10 links" in listed.out


@pytest.mark.usefixtures("interruptions")
@pytest.mark.parametrize("form", [(), ("--json",)])
def test_ctrl_c_ends_a_command_with_what_was_found(form, tmp_path, monkeypatch):
    """The first signal, while the second group of links is assembled."""
    from planar.assemblies import search_tree

    solve, solved = search_tree._solve_block, []

    def interrupted(*given):
        solved.append(given)
        if len(solved) == 2:
            signal.raise_signal(signal.SIGINT)
        return solve(*given)

    monkeypatch.setattr(search_tree, "_solve_block", interrupted)
    before = signal.getsignal(signal.SIGINT)
    ended = run(tmp_path, "modes", "watt-six-bar", "--no-certify", *form)
    assert BY_USER in ended.refused(130)
    assert signal.getsignal(signal.SIGINT) is before
    if form:
        value = json.loads(ended.out)
        assert (value["outcome"], value["reason"]) == ("interrupted", BY_USER)


@pytest.mark.usefixtures("interruptions")
def test_ctrl_c_ends_what_has_no_part_with_a_sentence(tmp_path, monkeypatch):
    from planar.analysis.classroom import variants

    draw, drawn = variants._draw_variant, []

    def interrupted(*given):
        drawn.append(given)
        if len(drawn) == 2:
            signal.raise_signal(signal.SIGINT)
        return draw(*given)

    monkeypatch.setattr(variants, "_draw_variant", interrupted)
    ended = run(tmp_path, "problem", "four-bar", "--vary", "5", "--json")
    sentence = f"{BY_USER} before variant 2 was drawn; give more time, or ask for fewer"
    assert ended.refused(130) == f"interrupted: {sentence}"
    assert json.loads(ended.out) == {"outcome": "interrupted", "reason": sentence}


@pytest.mark.parametrize("time", ["0", "-1 s", "soon"])
def test_what_is_no_time_is_refused(time, tmp_path):
    for name, words in COMMANDS.items():
        assert run(tmp_path, name, *words, "--timeout", time).refused(2).startswith("--timeout: ")


def test_enough_time_changes_nothing(tmp_path):
    for name in ("chains", "modes", "inspect", "problem"):
        words = (name, *COMMANDS[name], "--json")
        assert run(tmp_path, *words, "--timeout", "100 h").done() == run(tmp_path, *words).done()


def test_the_former_names_of_the_time_limit_of_a_search_still_work(tmp_path):
    points = [[4 * k, 12 * (k % 5) - k * k / 4] for k in range(12)]
    task = {"planar": 1, "start": "slider-crank", "wanted": [{"point": "E", "through": points}]}
    with pytest.warns(DeprecationWarning, match="'timeout' now"):
        assert not planar.synthesise(task, many=2, time_limit=1e-9).is_finished
    (tmp_path / "task.json").write_text(json.dumps(task))
    ended = run(tmp_path, "synthesise", "task.json", "--time", "1e-9")
    assert (ended.status, "--time is called --timeout now" in ended.err) == (1, True)
