"""Sweeps on several cores, in single precision, and reduced as they come: the same numbers, fewer of them kept."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import planar
from planar.batch import executor
from planar.batch.executor import run_tasks, usable_cores
from planar.batch.reductions import fourier_descriptors
from planar.foundation.errors import BadInput
from planar.foundation.turns import leave_turn, take_turn
from tests.builders import four_bar
from tests.checks import ORDERS
from tests.closed_forms import ROCKER, TURN
from tests.known import MODELS

STEPS = 24
POINT_MEASURES = ("x_extremes", "y_extremes", "bounding_box", "path_length", "enclosed_area", "fourier_descriptors")
RATE_MEASURES = ("speed_extremes", "acceleration_extremes")


def designs(many=40):
    """Four-bars of which about half turn."""
    a, b, c, d = np.random.default_rng(5).uniform(0.2, 1.5, (4, many))
    return {"AB.length": a, "BC.length": b, "DC.length": c, "AD.D.x": d}


def swept(many=40, **more):
    return planar.sweep(four_bar(*ROCKER, 0.8), designs(many), STEPS, ["C", "E"], **more)


def pinned(many=12):
    """Linkages of bars, some of which come to dead points."""
    sizes = np.random.default_rng(2).uniform(0.7, 1.1, many)
    places = [[(0, 0), (1, 0), (0.3, 0.2), (0.9, size), (1.4, 0), (1.4, 0.9)] for size in sizes]
    bars = [[(0, 2), (2, 3), (1, 3), (3, 5), (4, 5)]] * many
    return planar.pinned_linkages(places, bars, [[0, 1, 4]] * many, velocity=2.0)


def equal(one, other):
    for order in ORDERS:
        for name, values in getattr(one, order).items():
            np.testing.assert_array_equal(values, getattr(other, order)[name])
    np.testing.assert_array_equal(one.status, other.status)


# workers


def test_whatever_the_number_of_workers_every_digit_is_the_same():
    alone = swept(block=16, workers=1)
    for workers in (3, None):
        found = swept(block=16, workers=workers)
        equal(found, alone)
        assert (found.remarks, found.general) == (alone.remarks, alone.general)


def test_mechanisms_of_any_structure_by_any_number_of_workers(monkeypatch):
    from planar.batch import sweep_mechanisms

    monkeypatch.setattr(sweep_mechanisms, "PART_SIZE", 2)
    mixed = [four_bar(*ROCKER, 0.8), MODELS["004-QR"], *pinned(3), MODELS["double-butterfly"], MODELS["slider-crank"]]
    for mechanisms in (mixed, pinned()):
        alone, found = (planar.sweep_each(mechanisms, STEPS, workers=workers) for workers in (1, 3))
        assert found.remarks == alone.remarks
        for one, other in zip(found, alone, strict=True):
            equal(one, other)


def test_tasks_are_taken_one_after_the_other_as_threads_are_free():
    taken, done = [], []

    def tasks():
        for k in range(20):
            taken.append(k)
            yield k, k

    for k, found in run_tasks(2, None, None, tasks(), lambda _, task: task * task):
        assert found == k * k
        done.append(k)
        assert len(taken) <= len(done) + 2 * executor.TASKS_PER_WORKER + 1
    assert sorted(done) == taken == list(range(20))


@pytest.mark.parametrize("threads", [1, 3])
def test_what_a_task_raises_is_raised(threads):
    def fail(number, task):
        raise KeyError(task)

    with pytest.raises(KeyError, match="lost"):
        list(run_tasks(threads, None, None, [(0, "lost"), (1, "lost")], fail))


def test_an_executor_is_given_no_more_tasks_than_it_can_hold():
    taken = []
    tasks = ((k, taken.append(k) or k) for k in range(12))
    with ThreadPoolExecutor(1) as pool:
        next(run_tasks(1, pool, str, tasks, lambda _, task: str(task)))
    assert len(taken) <= executor.TASKS_PER_WORKER


def test_a_turn_is_one_threads_at_a_time_and_another_goes_on_where_it_is_left():
    inside, most = [], []

    def work(number, task):
        with take_turn():
            inside.append(number)
            most.append(len(inside))
            with take_turn(), leave_turn(False):
                inside.remove(number)
            with leave_turn():
                pass
        with leave_turn():
            return number

    assert sorted(k for k, _ in run_tasks(4, None, None, ((k, k) for k in range(40)), work)) == list(range(40))
    assert set(most) == {1}


def test_as_many_cores_as_the_process_may_use(monkeypatch):
    monkeypatch.setattr(executor.os, "sched_getaffinity", lambda _: {3, 5}, raising=False)
    assert usable_cores() == 2
    monkeypatch.delattr(executor.os, "sched_getaffinity")
    monkeypatch.setattr(executor.os, "cpu_count", lambda: 7)
    assert usable_cores() == 7


# float32


@pytest.mark.parametrize("block", [None, 17])
def test_single_precision_is_what_double_is_rounded_once(block):
    wanted, found = (swept(block=block, dtype=dtype) for dtype in (float, np.float32))
    for order in ORDERS:
        for name, values in getattr(found, order).items():
            assert values.dtype == np.float32
            np.testing.assert_array_equal(values, getattr(wanted, order)[name].astype(np.float32))
    np.testing.assert_array_equal(found.status, wanted.status)
    assert found.input.dtype == np.float64


@pytest.mark.parametrize("suffix", ["zarr", "parquet"])
def test_stores_keep_the_type(tmp_path, suffix):
    pytest.importorskip({"zarr": "zarr", "parquet": "pyarrow"}[suffix])
    store = tmp_path / f"sweep.{suffix}"
    wanted = swept(6, block=4, dtype="float32")
    for _ in range(2):
        found = swept(6, block=4, dtype="float32", store=store)
        assert found.velocity["E"][:].dtype == np.float32
        np.testing.assert_array_equal(found.velocity["E"][:], wanted.velocity["E"])
    with pytest.raises(BadInput, match="something else"):
        swept(6, block=4, store=store)


def test_single_precision_of_mechanisms_of_any_structure():
    mixed = [four_bar(*ROCKER, 0.8), MODELS["geared-five-bar"], *pinned(2)]
    for mechanisms in (mixed, pinned()):
        wanted, found = (planar.sweep_each(mechanisms, STEPS, dtype=dtype) for dtype in ("float64", "float32"))
        for one, other in zip(found, wanted, strict=True):
            for order in ORDERS:
                for name, values in getattr(one, order).items():
                    assert values.dtype == np.float32
                    np.testing.assert_array_equal(values, getattr(other, order)[name].astype(np.float32))


# reductions


def test_reductions_are_what_numpy_makes_of_the_whole():
    whole = swept(block=16)
    reduce = {measure: f"C.{measure}" for measure in POINT_MEASURES + RATE_MEASURES}
    found = swept(reduce=reduce | {"middle": lambda sweep: np.nansum(sweep.position["E"], axis=1)}, block=16)
    path, closed = whole.position["C"], whole.whole
    assert 0.2 < closed.mean() < 0.8
    assert list(found) == [*reduce, "middle"]
    solved = whole.status[:, 0] == 0
    for name, values in (
        ("x_extremes", path[..., 0]),
        ("y_extremes", path[..., 1]),
        ("speed_extremes", np.hypot(*np.moveaxis(whole.velocity["C"], 2, 0))),
        ("acceleration_extremes", np.hypot(*np.moveaxis(whole.acceleration["C"], 2, 0))),
    ):
        wanted = np.stack([np.nanmin(values[solved], axis=1), np.nanmax(values[solved], axis=1)], axis=1)
        np.testing.assert_array_equal(found[name][solved], wanted)
        assert np.all(np.isnan(found[name][~solved]))
    box = np.hstack([np.nanmin(path[solved], axis=1), np.nanmax(path[solved], axis=1)])
    np.testing.assert_array_equal(found["bounding_box"][solved], box)
    length = np.sum(np.linalg.norm(np.diff(path, axis=1), axis=2), axis=1)
    np.testing.assert_allclose(found["path_length"], np.where(closed, length, np.nan), rtol=1e-13)
    np.testing.assert_allclose(found["middle"][solved], np.nansum(whole.position["E"][solved], axis=1), rtol=1e-13)
    for measure in ("enclosed_area", "fourier_descriptors"):
        np.testing.assert_array_equal(np.isnan(found[measure]).reshape(len(closed), -1).any(axis=1), ~closed)
    np.testing.assert_array_equal(found.status, whole.status[:, -1])
    np.testing.assert_array_equal(found.whole, closed)
    assert (found.remarks, found.general) == (whole.remarks, whole.general)


def test_the_area_is_that_within_the_closed_curve():
    mechanism = four_bar(*ROCKER, 0.8)
    found = planar.sweep(mechanism, {"BC.length": [0.9]}, 90, reduce={"area": "E.enclosed_area"})
    wanted = planar.area(planar.cycle(mechanism.with_values({"BC.length": 0.9}), 90), "E")
    np.testing.assert_allclose(found["area"], wanted.value, rtol=1e-9)


def test_paths_that_do_not_close_enclose_nothing():
    reduce = {"area": "E.enclosed_area", "length": "E.path_length"}
    found = planar.sweep(four_bar(*ROCKER, 0.8), {"BC.length": [0.9]}, 30, start=0.8, stop=2.0, reduce=reduce)
    assert np.isnan(found["area"][0])
    assert found["length"][0] > 0.1


def test_equal_curves_have_equal_descriptors_wherever_they_lie_and_begin():
    t = np.linspace(0.0, TURN, 65)
    curve = 1.0 * np.exp(1j * t) + 0.4 * np.exp(-1j * (t + 0.3)) + 0.2 * np.exp(2j * t + 0.7j) + 0.1 * np.exp(-3j * t)
    turned = 2.5 * np.exp(0.9j) * curve + 3.0 - 1.0j
    late = np.roll(curve[:-1], 11)
    curves = [curve, turned, np.append(late, late[0]), curve[::-1], turned[::-1]]
    paths = np.stack([np.stack([each.real, each.imag], axis=1) for each in curves])
    found = fourier_descriptors(paths, 4)
    np.testing.assert_allclose(found, np.broadcast_to(found[0], found.shape), atol=1e-13)
    np.testing.assert_allclose(np.abs(found[0]) * 1.4, [1.0, 0.4, 0.2, 0.0, 0.0, 0.1, 0.0, 0.0], atol=1e-13)
    np.testing.assert_allclose(found[0, :2].imag, 0.0, atol=1e-13)


def test_only_what_measures_need_is_solved(monkeypatch):
    from planar.batch import reductions

    asked = []
    really = reductions.solve_result_block

    def noted(block, out):
        asked.append((block.designs.points, block.designs.rates))
        return really(block, out)

    monkeypatch.setattr(reductions, "solve_result_block", noted)
    mechanism = four_bar(*ROCKER, 0.8)
    for measure, rates in (("path_length", False), ("speed_extremes", True)):
        planar.sweep(mechanism, {"BC.length": [0.9]}, 12, reduce={"kept": f"BC.E.{measure}"})
        assert asked.pop() == (("E",), rates)
    planar.sweep(mechanism, {"BC.length": [0.9]}, 12, "C", reduce={"kept": "E.path_length", "own": len_of_each})
    assert asked.pop() == (("C", "E"), True)


def test_extremes_of_results_beside_those_of_points():
    mechanism, lengths = four_bar(*ROCKER, 0.8), {"BC.length": np.linspace(0.85, 0.95, 5)}
    asked = {"links": "BC", "pairs": ["B"], "outputs": "DC"}
    whole = planar.sweep(mechanism, lengths, STEPS, **asked)
    names = ("BC.angle", "BC.angular_velocity", "B.value", "B.value_second_rate", "DC.transmission_angle")
    found = planar.sweep(mechanism, lengths, STEPS, reduce={name: f"{name}_extremes" for name in names})
    for name in names:
        of, quantity = name.split(".")
        values = getattr(whole, quantity)[of]
        np.testing.assert_allclose(found[name], np.stack([values.min(axis=1), values.max(axis=1)], axis=1), rtol=1e-12)
    single = planar.sweep(mechanism, lengths, STEPS, dtype="float32", **asked)
    for name in names:
        of, quantity = name.split(".")
        values = getattr(single, quantity)[of]
        assert values.dtype == np.float32
        np.testing.assert_array_equal(values, getattr(whole, quantity)[of].astype(np.float32))


def test_all_assemblies_and_runs_in_time_are_reduced_too():
    mechanism, lengths = four_bar(*ROCKER, 0.8), {"BC.length": [0.85, 0.9]}
    reduce = {"box": "E.bounding_box"}
    for more in ({"assemblies": "all"}, {"duration": 1.5}):
        whole = planar.sweep(mechanism, lengths, STEPS, "E", rates=False, **more)
        found = planar.sweep(mechanism, lengths, STEPS, reduce=reduce, **more)
        path = whole.position["E"]
        np.testing.assert_allclose(found["box"], np.hstack([path.min(axis=1), path.max(axis=1)]), rtol=1e-9)
        np.testing.assert_array_equal(found.assembly, whole.assembly)
        single = planar.sweep(mechanism, lengths, STEPS, "E", rates=False, dtype="float32", **more)
        np.testing.assert_array_equal(single.position["E"], path.astype(np.float32))


def len_of_each(some):
    return np.full(len(some), len(some))


@pytest.mark.parametrize("pool", [None, ThreadPoolExecutor(2)])
def test_reductions_rounded_and_elsewhere(pool):
    reduce = {"length": "E.path_length", "shape": "E.fourier_descriptors", "many": len_of_each}
    double, single = (swept(40, reduce=reduce, block=16, executor=pool, dtype=dtype) for dtype in (float, "float32"))
    assert [single[name].dtype for name in reduce] == [np.float32, np.complex64, np.int64]
    np.testing.assert_array_equal(single["length"], double["length"].astype(np.float32))
    np.testing.assert_array_equal(double["many"], [16] * 32 + [8] * 8)


def test_mechanisms_are_taken_as_they_are_needed_and_only_reductions_are_kept(monkeypatch):
    from planar.batch import sweep_mechanisms

    monkeypatch.setattr(sweep_mechanisms, "PART_SIZE", 4)
    taken, told = [], []

    def mechanisms():
        for each in (*pinned(6), four_bar(*ROCKER, 0.8), pinned(5), "four-bar"):
            taken.append(each)
            yield each

    def progress(done, many):
        told.append((done, len(taken)))

    reduce = {"box": "P3.bounding_box", "speed": "P3.speed_extremes", "whole": lambda each: each.whole}
    found = planar.sweep_each(mechanisms(), STEPS, reduce=reduce, workers=1, progress=progress)
    assert told[0] == (4, 4)
    assert told[-1] == (13, 9)
    wanted = planar.sweep_each([*pinned(6), four_bar(*ROCKER, 0.8), *pinned(5), "four-bar"], STEPS)
    for k, each in enumerate(wanted):
        if "P3" not in each.position:
            assert np.all(np.isnan(found["box"][k]))
            continue
        path, speed = each.position["P3"], np.hypot(*each.velocity["P3"].T)
        np.testing.assert_allclose(found["box"][k], [*np.nanmin(path, axis=0), *np.nanmax(path, axis=0)], rtol=1e-12)
        np.testing.assert_allclose(found["speed"][k], [np.nanmin(speed), np.nanmax(speed)], rtol=1e-9)
    np.testing.assert_array_equal(found["whole"], wanted.whole)
    np.testing.assert_array_equal(found.whole, wanted.whole)
    assert found.remarks == wanted.remarks
    both = [planar.sweep_each(mechanisms(), STEPS, reduce=reduce, workers=workers)["box"] for workers in (1, 3)]
    np.testing.assert_array_equal(*both)


WRONG = [
    ({"workers": 0}, "a whole number of threads"),
    ({"workers": 2, "executor": ThreadPoolExecutor(1)}, "workers of its own"),
    ({"dtype": "int8"}, "float64 or float32"),
    ({"dtype": "no type"}, "float64 or float32"),
    ({"reduce": {}}, "name what is to be kept"),
    ({"reduce": {"x": "E.path_lenght"}}, "did you mean 'path_length'"),
    ({"reduce": {"x": "Z.path_length"}}, "no point 'Z'"),
    ({"reduce": {"x": "Z.angle_extremes"}}, "nothing of the name 'Z'"),
    ({"reduce": {"x": 3}}, "or a function"),
    ({"reduce": {"x": lambda sweep: 1.0}}, "an entry for each of"),
    ({"reduce": {"x": "E.speed_extremes", "y": len_of_each}, "rates": False}, "which are rates"),
    ({"reduce": {"x": len_of_each}, "store": "x.zarr"}, "leave out one of them"),
    ({"reduce": {"x": "E.fourier_descriptors"}, "steps": 16}, "harmonics want more"),
    ({"reduce": {"x": lambda sweep: np.zeros((len(sweep), len(sweep)))}, "block": 16}, "others"),
]


@pytest.mark.parametrize(("more", "told"), WRONG)
def test_bad_input_is_one_clear_sentence(more, told):
    with pytest.raises(BadInput, match=told):
        planar.sweep(four_bar(*ROCKER, 0.8), designs(20), **{"steps": STEPS, "points": "E", **more})


def test_mechanisms_tell_points_alone():
    with pytest.raises(BadInput, match="points alone"):
        planar.sweep_each(pinned(1), STEPS, reduce={"x": "bar1.angle_extremes"})


def test_mechanisms_without_the_point_are_told():
    with pytest.raises(BadInput, match="no mechanism has a point 'P9'"):
        planar.sweep_each(pinned(3), STEPS, reduce={"x": "P9.path_length"})
