"""A new design in each call of a prepared mechanism, wide ones and failing ones too, is what the general path finds."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import planar
from planar.batch.design_arrays import with_design_values
from planar.batch.general_path import DesignRun
from planar.batch.prepare.design_numbers import compiled_variables
from planar.foundation.errors import BadInput
from tests.builders import open_four_bar
from tests.draws import draws
from tests.known import MODELS

FULL_TURN = 2.0 * np.pi


def lengths_around(mechanism, rng, spread, zeros=0.0):
    """Lengths of links, each times a factor; those that are nothing up to so many metres."""
    known = compiled_variables(mechanism)
    return {
        name: float(each.value * np.exp(spread * rng.normal()) + (0.0 if each.value else zeros * rng.normal()))
        for name, each in known.items()
        if each.link and (each.value or zeros)
    }


def agree_with_general_path(ready, values, start=None, stop=None):
    """Whether the compiled code was sure; then it has said what the general path says."""
    if ready._runs(values) is None:
        return False
    found, reference = ready(values), ready.reference
    mechanism = with_design_values(reference.mechanism, values)
    start = mechanism.inputs[reference.running_index].position if start is None else start
    stop = start + FULL_TURN if stop is None else stop
    grid = np.linspace(start, stop, ready.steps + 1)
    wanted = DesignRun(mechanism, reference.pair, grid, ready.steps).solve(ready.points, True)
    np.testing.assert_array_equal(found.status, wanted.status)
    rows = np.split(wanted.out, 3, axis=1)
    for order, row, near in zip(found[:3], rows, (1e-9, 1e-6, 1e-4), strict=True):
        told = np.hstack([order[name] for name in ready.points])
        np.testing.assert_allclose(told, row, atol=near * max(1e-3, np.nanmax(np.abs(row), initial=0.0)))
    return True


@pytest.mark.parametrize(
    ("stem", "spread", "sure"),
    [
        ("drag-link", 0.5, 0.6),
        ("scott-russell", 0.3, 0.6),
        ("slotted-yoke", 0.03, 0.6),
        ("stephenson-3-five-bar", 0.02, 0.6),
    ],
)
def test_new_designs_are_those_of_the_general_path(stem, spread, sure):
    mechanism, rng = MODELS[stem], np.random.default_rng(20)
    ready, many = planar.prepared(mechanism, 40), draws(3)
    values = [lengths_around(mechanism, rng, spread, 0.05 * spread * (k % 2)) for k in range(many)]
    assert sum(agree_with_general_path(ready, each) for each in values) >= sure * many


def test_a_run_begins_where_it_is_asked_to():
    mechanism, rng = open_four_bar(0.3, 0.8, 0.7, 1.0), np.random.default_rng(3)
    for start, stop in ((1.5, None), (0.2, 2.0), (None, 1.9)):
        ready = planar.prepared(mechanism, 9, start=start, stop=stop)
        for values in (lengths_around(mechanism, rng, 0.1), {"AB.length": 0.6}, {"AB.length": 9.0}):
            assert agree_with_general_path(ready, values, start, stop)
    ready = planar.prepared(mechanism, 30)
    assert agree_with_general_path(ready, {"AB.length": 0.25, "A.position": 2.5, "A.velocity": -1.0})


def test_another_input_stands_where_a_design_has_it():
    mechanism = MODELS["stephenson-valve-gear"]
    running, standing = (given.pair for given in mechanism.inputs)
    ready = planar.prepared(mechanism, 30, pair=running)
    at = mechanism.inputs[1].position
    assert [agree_with_general_path(ready, {f"{standing}.position": at + by}) for by in (0.0, 0.02)] == [True, True]


def test_what_a_failing_design_says_is_what_a_sweep_says():
    mechanism = open_four_bar(0.3, 0.8, 0.7, 1.0)
    ready = planar.prepared(mechanism, 60)
    for length in (0.9, 9.0):
        values = {"AB.length": length}
        assert agree_with_general_path(ready, values)
        found, swept = ready(values), planar.sweep(mechanism, values, 60)
        assert found.remarks == swept.remarks
        assert pickle.loads(pickle.dumps(found)).remarks == swept.remarks
        np.testing.assert_array_equal(np.isnan(found.position["C"]), np.isnan(swept.position["C"][0]))


@pytest.mark.parametrize("stem", ["drag-link", "slotted-yoke"])
def test_threads_and_other_processes_find_the_same(stem):
    mechanism, rng = MODELS[stem], np.random.default_rng(7)
    ready = planar.prepared(mechanism, 90)
    values = [lengths_around(mechanism, rng, 0.01) for _ in range(40)]
    one_by_one = [ready(each) for each in values]
    copy = pickle.loads(pickle.dumps(ready))
    with ThreadPoolExecutor(4) as pool:
        for found, wanted in zip(pool.map(ready, values), one_by_one, strict=True):
            for name in ready.points:
                np.testing.assert_array_equal(found.acceleration[name], wanted.acceleration[name])
    np.testing.assert_array_equal(copy(values[0]).velocity[name], one_by_one[0].velocity[name])


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), "long", np.array([0.3]), None])
def test_what_is_not_a_number_is_refused(wrong):
    with pytest.raises(BadInput, match=r"AB\.length"):
        planar.prepared(open_four_bar(0.3, 0.8, 0.7, 1.0), 30)({"AB.length": wrong})
