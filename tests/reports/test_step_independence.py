"""No number that is printed without "among these positions" depends on the number of steps: a slice of the models."""

import pytest

import planar
from planar.reports.tables.forces.friction import mean_efficiency
from tests.command import run
from tests.step_independence import AMONG, compare_steps, differences, solved_lines

FORCES = ("forces", "--cycle")


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("two-stroke-engine", (*FORCES, "--fluctuation", "0.02")),
        ("motor-press", (*FORCES, "--fluctuation", "0.02", "--json")),
        ("motor-press", FORCES),
        ("cam-with-spring", FORCES),
        ("geneva-wheel", ("cycle",)),
    ],
)
def test_printed_numbers_do_not_depend_on_the_steps(tmp_path, model, words):
    assert compare_steps(tmp_path, words, model, (45, 46)) == []


def test_the_efficiency_over_a_motion_does_not_depend_on_the_steps():
    """Of a clamp whose guide bears now on this side, now on that, so that its friction steps between positions."""
    first, second = (mean_efficiency(planar.forces(planar.cycle("toggle-clamp", steps))) for steps in (12, 17))
    assert first == pytest.approx(second, rel=1e-8)


def test_what_is_read_off_positions_is_not_asked_for(tmp_path):
    """The comparison leaves out tables that say so, and sees any other number that differs in its sixth digit."""
    text = run(tmp_path, "forces", "two-stroke-engine", "--cycle", "--steps", "12").done()
    effort = next(line for line in text.splitlines() if line.split()[:1] == ["O"])
    assert " ".join(effort.split()) in solved_lines(text)
    number = effort.split()[1]
    assert (
        differences(text, text.replace(number, number[:-1] + ("1" if number[-1] != "1" else "3"))) or number[-1] == "2"
    )
    assert not differences(text, text)
    read_off = run(tmp_path, "cycle", "two-stroke-engine", "--steps", "12").done()
    assert AMONG in read_off
    assert not any(line.startswith("G ") for line in solved_lines(read_off))
