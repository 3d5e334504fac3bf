"""Tasks that leave numbers open: exact designs sampled from their family, against closed forms and random draws."""

import json

import numpy as np
import pytest
from rich.console import Console

import planar
from benchmarks.synthesis.family_draws import Demands, FourBars, meets
from benchmarks.synthesis.family_tasks import family_task, is_met, measure
from planar.reports.tables.design.synthesis import record, table
from planar.synthesis.design_search import DesignSearch
from planar.synthesis.families import FamilySearch, MemberSampler, independent_parts, null_space, recombine
from planar.synthesis.synthesis import least_transmission
from planar.synthesis.task.starts import start_mechanisms
from tests.builders import four_bar_document
from tests.small_searches import set_small_searches

LID = {
    "planar": 1,
    "name": "Tool chest lid",
    "units": {"length": "mm", "angle": "deg"},
    "start": "four-bar",
    "wanted": [
        {
            "link": "BC",
            "poses": [
                {"at": [0, 100], "angle": 0},
                {"at": [-40, 190], "angle": 60},
                {"at": [-130, 120], "angle": 130},
            ],
        }
    ],
    "within": {"AD.A": [-20, 150], "AD.D": [-20, 150]},
    "demands": ["one branch"],
}
POSES = np.array([100j, -40 + 190j, -130 + 120j]) * 1e-3, np.exp(1j * np.radians([0.0, 60.0, 130.0]))


@pytest.fixture(autouse=True)
def few_designs(monkeypatch):
    monkeypatch.setattr("planar.synthesis.exact.exact_synthesis.FAMILY_DESIGNS", 2)
    monkeypatch.setattr("planar.synthesis.synthesise.DRAWS", 600)


def searched(value):
    task = planar.read_task(value)
    return DesignSearch(task, next(iter(start_mechanisms(task))))


def lid_linkages(numbers):
    """Four-bars of the lid by their numbers (SI), moved with the poses of the coupler."""
    place = {name: numbers[:, k] + 1j * numbers[:, k + 1] for name, k in zip("ADBC", (0, 2, 5, 7), strict=True)}
    at, turn = POSES
    b, c = (at + turn * place[name][:, None] for name in "BC")
    return FourBars(place["A"], place["D"], b, c)


@pytest.fixture(scope="module")
def lid():
    """The search for the lid's designs, run."""
    search = FamilySearch(searched(LID), 2, 0)
    return search, search.run()


def test_the_members_of_a_family_keep_the_lengths_of_their_cranks(lid, monkeypatch):
    search, sample = lid
    assert sample.family.dimension == 4 and sample.family.met >= 20
    members, violation, _ = search._known()
    designs = lid_linkages(members.numbers * search.sampler.equations[0].scale)
    for pivot, joints in ((designs.a, designs.b), (designs.d, designs.c)):
        assert np.ptp(np.abs(joints - pivot[:, None]), axis=1).max() < 1e-10
    # what the screen passes is on one branch by the formulas of a four-bar, and the other way round
    assert (violation[meets(designs, Demands(False, False, None))] == 0.0).mean() > 0.9
    monkeypatch.setattr("benchmarks.synthesis.family_draws.MARGIN", 0.0)
    assert meets(designs, Demands(False, False, None))[violation == 0.0].all()


def test_members_without_bounds_on_pivots_are_drawn_about_what_is_wanted():
    value = LID | {"within": {}}
    value["wanted"] = [{"point": "E", "through": [[5000, 3000], [5060, 3010], [5090, 2970]]}]
    members = MemberSampler(searched(value), 0).draw(40)
    assert len(members.numbers) > 10


def test_two_dyads_for_poses_vary_independently_and_a_coupler_point_ties_all(lid):
    search, _ = lid
    members = search.sampler.draw(60)
    directions = null_space(search.sampler, members.take(np.array([0])))
    parts = independent_parts(directions)
    assert directions.shape[1] == 4 and len(parts) == 2
    combined = recombine(search.sampler, members, parts, 500)
    assert len(combined.numbers) == 500 and search.sampler.residuals(combined).max() < 1e-12
    path = dict(LID, wanted=[{"point": "E", "through": [[0, 25], [52, 10], [80, 4]]}], within={})
    sampler = MemberSampler(searched(path), 0)
    directions = null_space(sampler, sampler.draw(40).take(np.array([0])))
    assert directions.shape[1] == 6 and len(independent_parts(directions)) == 1


def test_a_complete_list_of_three_poses_has_exact_designs_and_says_how_many_were_tried():
    found = planar.synthesise(LID, complete=True)
    assert len(found) == 2 and found.expected is None and len(found.curves) == 2
    assert found.family.dimension == 4 and found.family.tried > found.family.met >= 2
    assert f"{found.family.met} meet all that is demanded" in found.summary[0]
    angles = [least_transmission(design) for design in found]
    assert angles == sorted(angles, reverse=True) and angles[-1] > 0.0
    for design in found:
        assert design.greatest_miss < 1e-10 and not design.defects
        numbers = np.array([list(design.numbers.values())])
        assert meets(lid_linkages(numbers), Demands(False, False, None)).all()
        pivots = numbers[0, :4]
        assert (pivots >= -0.02 - 1e-12).all() and (pivots <= 0.15 + 1e-12).all()
    values = json.loads(json.dumps(record(found, [])))
    assert values["family"] == found.family._asdict() and len(values["designs"]) == 2
    console = Console(width=200)
    with console.capture() as captured:
        console.print(table(found, []))
    text = captured.get()
    assert "a family with 4 open parameters" in text and "transmission" in text


def test_approximate_synthesis_lists_exact_designs_and_goes_on_from_its_folder(tmp_path):
    found = planar.synthesise(LID, many=2, folder=tmp_path / "lid")
    assert len(found) == 2 and max(design.greatest_miss for design in found) < 1e-10
    angles = [least_transmission(design) for design in found]
    assert angles == sorted(angles, reverse=True)
    assert any("a family with 4 open parameters" in remark for remark in found.remarks)
    again = planar.synthesise(LID, many=2, folder=tmp_path / "lid")
    assert [design.numbers for design in again] == [design.numbers for design in found]
    assert again.remarks == found.remarks


def test_a_family_without_a_design_says_what_is_in_the_way(monkeypatch):
    set_small_searches(monkeypatch)
    value = LID | {"within": {"AD.A": [-20, -19], "AD.D": [-20, -19]}, "demands": [{"transmission": 89}]}
    found = planar.synthesise(value, complete=True)
    assert not found and found.family.met == 0
    assert "meets all that is demanded" in found.summary[0]
    assert found.remarks[0].startswith("no design")


@pytest.mark.parametrize("seed", [1, 3, 10, 12])
def test_where_random_draws_hold_a_design_one_is_listed(seed):
    result = measure(seed, 2000)
    assert result["drawn"] > 0 and is_met(result)


def test_draws_by_closed_forms_are_exact():
    for seed in range(6):
        task = family_task(seed)
        designs = task.draw(1500, np.random.default_rng(seed))
        for pivot, joints in ((designs.a, designs.b), (designs.d, designs.c)):
            assert np.ptp(np.abs(joints - pivot[:, None]), axis=1).max(initial=0.0) < 1e-8
        assert np.ptp(np.abs(designs.b - designs.c), axis=1).max(initial=0.0) < 1e-8


def test_a_task_that_leaves_nothing_open_lists_each_linkage_once(monkeypatch):
    """The length of a rocker that stands at 120 deg with the crank at 60 deg: |D + r - B| = BC has two solutions."""
    monkeypatch.setattr("planar.synthesis.synthesise.ROUNDS", 1)  # of catalogues, which find nothing else
    start = four_bar_document(50, 66, 56, 100, 60, omega="1 rad/s", units={"length": "mm", "angle": "deg"})
    apart = 0.1 - 0.05 * np.exp(1j * np.radians(60.0))
    along = (apart * np.exp(-1j * np.radians(120.0))).real
    root = np.sqrt(along**2 - abs(apart) ** 2 + 0.066**2)
    rocker = next(name for name in planar.dimensions(planar.loads(json.dumps(start))) if name.startswith("DC"))
    wanted = {"from": "A", "to": "D", "pairs": [[60, 120]], "absolute": True}
    task = {"planar": 1, "units": {"angle": "deg"}, "start": start, "wanted": [wanted], "free": [rocker]}
    found = planar.synthesise(task, many=4)
    values = sorted(design.numbers[rocker] for design in found)
    np.testing.assert_allclose(values, [-along - root, -along + root], atol=1e-9)
    assert any("single linkages" in remark and "spread over" not in remark for remark in found.remarks)
