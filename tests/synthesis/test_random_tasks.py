"""Random tasks made from known linkages, as `python -m benchmarks.known_linkages` checks them; here those done soon."""

import numpy as np
import pytest

import planar
from benchmarks.known_linkages.checks import check_task, how_it_meets
from benchmarks.known_linkages.closed_forms import STRUCTURES
from benchmarks.known_linkages.known_tasks import Verdict, conditions_on_numbers, draw_task, jacobian, judge
from benchmarks.known_linkages.makers import MAKERS, write_mechanism
from benchmarks.known_linkages.other_solutions import other_solutions
from planar.foundation.private_cache import disable_cache
from planar.synthesis.design_search import DesignSearch
from planar.synthesis.exact.relations.sought_numbers import sought_numbers
from planar.synthesis.exact.tracking import generic_solutions
from planar.synthesis.task.starts import free_numbers, start_mechanisms

LISTS = {
    "four-bar": (2, 14, 324),
    "slider-crank": (3,),
    "slotted lever": (0, 3, 11, 12, 14, 15),
    "swinging block": (0, 2, 3, 14, 15, 438),
}
REFUSALS = {
    "four-bar": (7, 19),
    "slider-crank": (12, 14),
    "slotted lever": (2, 6, 7, 16, 17),
    "swinging block": (5, 6, 9, 10, 19),
    "Watt II": (3,),
}
"""Seeds of tasks by kinds of linkages."""


def pairs(seeds):
    return [(kind, seed) for kind, own in seeds.items() for seed in own]


@pytest.fixture(autouse=True)
def no_trace_test(monkeypatch):
    """Most of the time of a kind that was never seen is its trace test, which other tests are about."""
    monkeypatch.setattr(generic_solutions, "trace_test", lambda *_, **__: True)
    with disable_cache():
        yield


@pytest.mark.parametrize(("kind", "seed"), pairs(LISTS))
def test_what_a_list_says_is_right_by_closed_forms(kind, seed):
    task = draw_task(kind, seed)
    assert task.verdict is Verdict.LIST
    assert check_task(task, 60).faults == ()


@pytest.mark.parametrize(("kind", "seed"), pairs(REFUSALS))
def test_what_the_rank_forbids_is_refused(kind, seed):
    task = draw_task(kind, seed)
    assert task.verdict is not Verdict.LIST
    assert check_task(task, 60).faults == ()


@pytest.mark.parametrize("kind", MAKERS)
def test_closed_forms_are_the_positions_that_the_analysis_has(kind):
    linkage = draw_task(kind, 4).linkage
    position = linkage.position(linkage.angle)
    mechanism = planar.from_dict(write_mechanism(linkage, linkage.numbers, position, "mm"))
    state = planar.solve(mechanism)
    for name, pin in position.pins.items():
        np.testing.assert_allclose(state.point(name).position, [pin.x, pin.y], atol=1e-9)
    for name, way in position.directions.items():
        assert np.exp(1j * state.link(name).angle) == pytest.approx(complex(way.x, way.y), abs=1e-9)
    if STRUCTURES[kind].output == "s":
        assert state.pair("s")["displacement"] == pytest.approx(position.output, abs=1e-9)


def test_a_task_is_met_by_its_linkage_and_by_none_with_other_numbers():
    task = draw_task("four-bar", 1)
    own = how_it_meets(task, task.linkage.numbers, task.angles)
    assert own.miss < own.tolerance
    (name, *_) = task.free
    other = how_it_meets(task, {**task.linkage.numbers, name: task.linkage.numbers[name] + 1e-6}, task.angles)
    assert other.miss > other.tolerance


def test_newtons_method_comes_to_the_known_linkage_among_others():
    task = draw_task("slider-crank", 5)
    wanted = [task.linkage.numbers[name] for name in task.free]
    found = np.array([[numbers[name] for name in task.free] for numbers, _, _ in other_solutions(task, 100)])
    assert np.abs(found - wanted).max(axis=1).min() < 1e-8


def test_conditions_are_counted_by_the_rank():
    task = draw_task("four-bar", 3)  # three poses: four conditions on each dyad, and four on the pins of the coupler
    names = [*task.linkage.numbers]
    rows = conditions_on_numbers(*jacobian(task.linkage, task.items, task.angles, names))
    assert len(rows) == 6
    assert judge(task.linkage, task.items, task.angles, task.free) is task.verdict is Verdict.LIST
    assert judge(task.linkage, task.items, task.angles, task.free[:-1]) is Verdict.TOO_MANY
    assert judge(task.linkage, task.items, task.angles, names) is Verdict.OPEN


def test_numbers_that_are_given_beside_those_named_are_not_scaled():
    task = draw_task("slider-crank", 428)  # its free numbers bring the poses to any size
    given = {name: value for name, value in task.linkage.numbers.items() if name not in task.free}
    search = DesignSearch(planar.read_task(task.value), next(iter(start_mechanisms(planar.read_task(task.value)))))
    assert search.can_move
    assert {name: planar.dimensions(search.mechanism)[name] for name in given} == pytest.approx(given)


def test_numbers_are_sought_though_a_position_of_the_start_is_a_dead_point():
    drawn = draw_task("slider-crank", 19)
    task = planar.read_task(drawn.value)
    start = next(iter(start_mechanisms(task)))
    assert sought_numbers(task, start, free_numbers(task, start)) == drawn.free
