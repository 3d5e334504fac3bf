"""The parts of the benchmark of synthesis that are formulas: its metric, the linkages it reads, the curves it makes."""

import pickle

import numpy as np
import pytest

import planar
from benchmarks.synthesis import (
    dwells,
    four_bar_data,
    functions,
    gcp_holo_data,
    measured_page,
    published_curves,
    random_tasks,
    shapes,
    straight_lines,
)
from benchmarks.synthesis.judged import are_in_order, design_faults
from benchmarks.synthesis.misses import chord_distances, extent, misses, path_of
from benchmarks.synthesis.parts import PARTS
from benchmarks.synthesis.records import append_record, read_records

CRANK_ROCKER = {"p1x": 1.0, "p1y": 2.0, "a": 0.3, "l1": 9.0, "l2": 3.5, "l3": 7.0, "l4": 7.5, "l5": 4.5, "g": 0.5}
LIMITED = {"p1x": 0.0, "p1y": 0.0, "a": 0.2, "l1": 3.0, "l2": 1.0, "l3": 2.0, "l4": 1.6, "l5": 0.5, "g": 0.3}


def closed_form(p, turned, side):
    """The point of a four-bar at angles of the crank (n,) from the ground, by the angle at the crank's end."""
    b = np.array([p["p1x"], p["p1y"]]) + p["l2"] * np.stack([np.cos(p["a"] + turned), np.sin(p["a"] + turned)], axis=1)
    ground = np.array([p["p1x"] + p["l1"] * np.cos(p["a"]), p["p1y"] + p["l1"] * np.sin(p["a"])])
    far = np.hypot(*(ground - b).T)
    inner = np.arccos((far**2 + p["l3"] ** 2 - p["l4"] ** 2) / (2 * far * p["l3"]))
    coupler = np.arctan2(*(ground - b).T[::-1]) + side * inner
    return b + p["l5"] * np.stack([np.cos(coupler + p["g"]), np.sin(coupler + p["g"])], axis=1)


@pytest.mark.parametrize(("circuit", "side"), [("c1b1", 1.0), ("c2b1", -1.0)])
def test_a_four_bar_from_published_numbers_draws_the_path_of_its_closed_form(circuit, side):
    mechanism = four_bar_data.four_bar(CRANK_ROCKER | {"stat": circuit}, "m")
    path = path_of(mechanism, four_bar_data.POINT)
    exact = closed_form(CRANK_ROCKER, np.linspace(0.1, 6.2, 40), side)
    assert chord_distances(path, exact).min(axis=1).max() < 2e-5


def test_a_four_bar_whose_crank_is_limited_is_in_the_branch_that_its_numbers_name():
    paths = {
        name: path_of(four_bar_data.four_bar(LIMITED | {"stat": name}, "m"), four_bar_data.POINT, 720)
        for name in ("c1b1", "c2b1", "c1b2")
    }
    least = np.arccos((9.0 + 1.0 - 3.6**2) / 6.0) if abs(10.0 - 3.6**2) < 6.0 else np.pi
    turned = np.linspace(0.1, least - 0.1, 20)
    assert chord_distances(paths["c1b1"], closed_form(LIMITED, turned, 1.0)).min(axis=1).max() < 1e-3
    assert chord_distances(paths["c2b1"], closed_form(LIMITED, turned, -1.0)).min(axis=1).max() < 1e-3
    assert all(np.isfinite(path).all() for path in paths.values())


def test_numbers_are_read_without_comments():
    text = "/* l1: 7 in a paper */\n(\n  p1x: -1.5, // p1y: 3\n  p1y: 2e-1,\n  stat: c2b1\n)"
    assert four_bar_data.parse_parameters(text) == {"p1x": -1.5, "p1y": 0.2, "stat": "c2b1"}


def test_misses_are_distances_from_the_path_in_percent_of_the_diagonal():
    path = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    places = np.array([[0.0, 1.0], [3.0, -3.0], [4.0, 0.0]])
    assert extent(places) == pytest.approx(np.hypot(4.0, 4.0))
    found = misses(path, places)
    assert found.greatest == pytest.approx(300.0 / np.hypot(4.0, 4.0))
    assert found.rms == pytest.approx(100.0 * np.sqrt(10.0 / 3.0) / np.hypot(4.0, 4.0))


def test_published_misses_of_places_on_the_path_itself_vanish():
    numbers = CRANK_ROCKER | {"stat": "c1b1"}
    places = four_bar_data.path_target(numbers, 20)
    assert published_curves.published_misses(places, numbers).greatest < 1e-4


def test_places_in_order_are_told_from_those_that_are_not():
    near = np.array([[0, 1, 0, 0, 0], [0, 0, 1, 0, 1], [0, 0, 0, 1, 0]], float)
    assert are_in_order(1.0 - near, 0.5, whole=False)
    assert not are_in_order(1.0 - near[[1, 0, 2]][:, [0, 1, 4, 3, 2]], 0.5, whole=False)
    # a turn may begin anywhere
    assert are_in_order(1.0 - np.roll(near, 3, axis=1), 0.5, whole=True)
    assert not are_in_order(1.0 - np.roll(near, 3, axis=1), 0.5, whole=False)


def test_a_design_is_judged_from_its_file():
    mechanism = four_bar_data.four_bar(CRANK_ROCKER | {"stat": "c1b1"}, "m")
    places = closed_form(CRANK_ROCKER, np.linspace(0.5, 4.0, 8), 1.0)
    other = closed_form(CRANK_ROCKER, np.linspace(0.5, 4.0, 8), -1.0)
    assert design_faults(mechanism, "E", places, 1e-4, closed=True) == []
    assert design_faults(mechanism, "E", places[[0, 2, 1, 3, 4, 5, 6, 7]], 1e-4, closed=True)
    assert "misses" in design_faults(mechanism, "E", other, 1e-4, closed=False)[0]


def test_the_other_order_is_as_good():
    mechanism = four_bar_data.four_bar(CRANK_ROCKER | {"stat": "c1b1"}, "m")
    places = closed_form(CRANK_ROCKER, np.linspace(4.0, 0.5, 8), 1.0)
    assert design_faults(mechanism, "E", places, 1e-4, closed=False) == []


def test_random_tasks_are_those_of_their_seed_and_another_linkage_of_the_structure():
    task, again = (random_tasks.random_task("four", 1) for _ in range(2))
    np.testing.assert_allclose(task.places, again.places, rtol=1e-13)
    assert {name: task.value[name] for name in task.value if name != "wanted"} == {
        name: again.value[name] for name in again.value if name != "wanted"
    }
    grid = task.places / (random_tasks.ROUNDED * float(np.ptp(task.places, axis=0).max()))
    assert random_tasks.FEWEST <= len(task.places) <= random_tasks.MOST
    assert np.abs(grid - np.round(grid)).max() < 0.5
    assert planar.read_task(task.value).wanted[0].in_order


def test_a_function_s_three_points_are_exact_and_its_error_is_that_of_the_output():
    wanted = functions.FUNCTIONS[4]
    first, second = wanted.angles(101)
    assert (first[0], second[0]) == (0.0, 0.0)
    assert np.degrees([first[-1], second[-1]]) == pytest.approx([wanted.input_swing, wanted.output_swing])
    assert functions.structural_error(second + 0.3, wanted) == pytest.approx(0.0, abs=1e-9)
    off = second + np.radians(0.9) * np.linspace(-1.0, 1.0, 101)
    assert functions.structural_error(off, wanted) == pytest.approx(1.0)


def test_the_famous_numbers_of_a_logarithm_by_three_points():
    # with the input from 45 deg on and the output from 0: a four-bar of finite links that errs by less than 1 %
    errors = [
        functions.three_points_error(functions.FUNCTIONS[4], np.radians(45.0), np.radians(k)) for k in range(0, 360, 15)
    ]
    assert np.nanmin(errors) < 1.0


def test_a_straight_stretch_is_found_in_a_path():
    turned = np.linspace(0.0, np.pi, 100)
    arc = np.stack([np.sin(turned), 1.0 - np.cos(turned)], axis=1)
    path = np.concatenate([np.stack([np.linspace(-3.0, 0.0, 80), np.zeros(80)], axis=1), arc[1:]])
    line = straight_lines.longest_line(path, 1e-4)
    assert np.hypot(*(line.end - line.start)) == pytest.approx(3.0, rel=0.05)
    assert straight_lines.departure(arc[:50]) > 0.1
    assert straight_lines.longest_link(planar.load("chebyshev-straight-line")) == pytest.approx(0.5)


def test_curves_by_formula_are_of_one_size_and_at_equal_ways():
    for each in shapes.shapes():
        assert float(np.ptp(each.places, axis=0).max()) == pytest.approx(shapes.SIZE, rel=0.03)
        around = np.concatenate([each.places, each.places[:1]]) if each.closed else each.places
        ways = np.hypot(*np.diff(around, axis=0).T)
        assert ways.max() < 1.2 * np.median(ways)


def test_a_cycloid_rises_returns_and_dwells():
    turned = np.linspace(0.0, 360.0, 361)
    found = dwells.rise_and_return(turned)
    assert found[[0, 60, 120, 240, 300, 360]] == pytest.approx([0.0, 20.0, 40.0, 0.0, 0.0, 0.0])
    assert dwells.dwell_error(planar.load("crank-rocker"), "B0", 1.0, 1.0 + 1e-6) < 1e-3
    # its crank does not turn fully
    assert dwells.dwell_error(planar.load("four-bar"), "D", 1.047, 1.048) == np.inf


def test_a_dyad_behind_an_arc_stands_still_with_its_pin_in_the_centre():
    # the crank's own end goes round an arc of its length: the dyad's pin stays in the crank's pivot
    linkage = CRANK_ROCKER | {"p1x": 0.0, "p1y": 0.0, "l5": 0.0, "stat": "c1b1"}
    scaled = {key: 40.0 / 3.5 * value if key.startswith("l") else value for key, value in linkage.items()}
    moved = dwells.with_dyad(four_bar_data.four_bar(scaled), np.array([-0.1, 0.2]))
    motion = planar.cycle(moved, 24, pair="A", start=1.6, stop=2.2)
    assert np.ptp(motion.pair(dwells.PIVOT)["relative_angle"]) < 1e-9
    assert np.abs(motion.point(dwells.PIN).position).max() < 1e-9
    assert dwells.arc_task()["wanted"][0]["closed"]
    assert np.hypot(*dwells.arc_places()[: dwells.ARC_PLACES].T) == pytest.approx(dwells.RADIUS)


def test_circles_cross_at_their_radii_from_both_centres():
    one, other = np.array([0.0, 0.0]), np.array([3.0, 4.0])
    for each in dwells.circle_crossings(one, 4.0, other, 3.0):
        assert [np.hypot(*(each - centre)) for centre in (one, other)] == pytest.approx([4.0, 3.0])


def test_a_pivot_is_chosen_about_which_the_dyad_swings():
    turned = np.linspace(0.0, 2.0 * np.pi, 181)
    path = np.stack([1.0 + 0.3 * np.cos(turned), 0.2 * np.sin(turned)], axis=1)
    arm = float(np.hypot(*dwells.best_pivot(path, 1.0)))
    assert 1.0 <= arm <= 8.0
    assert dwells.best_pivot(path * 9.0, 1.0) is None


def test_other_things_than_arrays_are_not_unpickled(tmp_path):
    good, bad = tmp_path / "good.pkl", tmp_path / "bad.pkl"
    good.write_bytes(pickle.dumps(np.arange(6.0).reshape(2, 3)))
    bad.write_bytes(pickle.dumps({"a": planar.Outcome.SOLVED}))
    assert gcp_holo_data.read_array(good).tolist() == [[0, 1, 2], [3, 4, 5]]
    with pytest.raises(pickle.UnpicklingError, match="no array"):
        gcp_holo_data.read_array(bad)


def test_results_are_kept_and_the_page_is_written_from_them(tmp_path):
    results = tmp_path / "results.jsonl"
    common = {"places": 12, "closed": True, "structure": "four-bar", "seconds": 2.0}
    for seed, greatest in enumerate((0.01, 0.02)):
        own = {"part": "random", "name": f"four {seed}", "kind": "four", "seed": seed}
        append_record(results, own | common | {"greatest": greatest, "faults": [[], []]})
    own = {
        "part": "published",
        "name": "a curve",
        "places": 9,
        "published": [2.0, 4.0],
        "own": [0.5, 1.0],
        "seconds": 1.0,
    }
    append_record(results, own | {"faults": []})
    with results.open("a", encoding="utf-8") as file:
        file.write('{"part": "cut')
    records = [*read_records(results)]
    assert len(records) == 3
    page = tmp_path / measured_page.PAGE
    page.parent.mkdir(parents=True)
    page.write_text("before\n", encoding="utf-8")
    with pytest.raises(ValueError, match="has no"):
        measured_page.write(tmp_path, records)
    page.write_text(f"before\n{measured_page.START}\nold\n{measured_page.END}\nafter\n", encoding="utf-8")
    measured_page.write(tmp_path, records)
    text = page.read_text(encoding="utf-8")
    assert text.startswith("before") and text.endswith("after\n") and "old" not in text
    assert "| a curve | 9 | 2 (4) | 0.5 (1) | 1.0 s |" in text
    assert "| four | 2 | 1 (50 %) | 0 | 2.0 s | 2 s |" in text
    assert [*measured_page.TABLES] == [*PARTS]
