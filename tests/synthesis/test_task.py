"""A task's file: what is read from it, and the sentence about what is wrong in it."""

import json
from itertools import islice
from math import pi, radians

import numpy as np
import pytest

import planar
from planar.synthesis.task.freedom import can_move_whole
from planar.synthesis.task.starts import free_numbers, start_mechanisms
from tests.command import run

TASK = {
    "planar": 1,
    "name": "Lid",
    "units": {"length": "mm", "angle": "deg"},
    "start": "four-bar",
    "wanted": [
        {"point": "E", "through": [[0, 25], [52, 10], [80, 4]], "in_order": True},
        {"link": "BC", "poses": [{"at": [0, 1], "angle": 10}]},
        {"from": "A", "to": "D", "pairs": [[0, 0], [20, 31]]},
    ],
    "free": ["AB.length", "AD.D"],
    "within": {"AB.length": [20, 80]},
    "demands": ["whole turn", "one branch", {"transmission": 30}, {"inside": [[0, 0], [200, 100]]}],
}


def changed(place, value):
    task = json.loads(json.dumps(TASK))
    *way, last = place
    at = task
    for key in way:
        at = at[key]
    at[last] = value
    return task


def test_a_task_is_read_in_si():
    task = planar.read_task(TASK)
    path, poses, function = task.wanted
    np.testing.assert_allclose(path.places, [[0, 0.025], [0.052, 0.01], [0.08, 0.004]])
    assert path.inputs is None and path.in_order and not path.is_closed
    assert poses.angles[0] == pytest.approx(radians(10))
    assert function.values[1] == pytest.approx(radians(31))
    assert task.free == ("AB.length", "AD.D.x", "AD.D.y")
    assert task.within == {"AB.length": (0.02, 0.08)}
    assert task.demands.transmission == pytest.approx(pi / 6)
    assert task.demands.inside.shape == (4, 2)
    assert task.entry_count == 6


def test_a_task_is_read_from_a_file_with_a_start_beside_it(tmp_path):
    (tmp_path / "own.json").write_text(planar.dumps("slider-crank"))
    wanted = [{"point": "E", "through": [[0, 0], [10, 0]]}]
    task = {"planar": 1, "units": {"length": "mm"}, "start": ["own.json", "four-bar"], "wanted": wanted}
    (tmp_path / "task.json").write_text(json.dumps(task))
    assert [each.name for each in planar.read_task(tmp_path / "task.json").starts] == [
        "Slider-crank",
        "Four-bar chain",
    ]


@pytest.mark.parametrize(
    ("place", "value", "told"),
    [
        (["planar"], 2, "$.planar"),
        (["start"], "no-such-model", "$.start"),
        (["start"], {"chains": [3]}, "$.start.chains[0]"),
        (["start"], "single-link-of-nothing", "$.start"),
        (["wanted"], [], "$.wanted"),
        (["wanted", 0, "point"], "Z", "$.wanted[0].point"),
        (["wanted", 0, "through"], [], "$.wanted[0].through"),
        (["wanted", 0, "through", 1], [1, 2, 3], "$.wanted[0].through[1]"),
        (["wanted", 0, "through", 1], {"at": [1, 2], "input": 3}, "$.wanted[0].through"),
        (["wanted", 0, "through", 1], {"at": [1, 2], "weight": 0}, "$.wanted[0].through[1].weight"),
        (["wanted", 0, "closed"], True, "$.wanted[0].through"),
        (["wanted", 0, "colour"], 1, "$.wanted[0].colour"),
        (["wanted", 1, "link"], "XY", "$.wanted[1].link"),
        (["wanted", 1, "poses", 0, "at"], [1], "$.wanted[1].poses[0].at"),
        (["wanted", 2, "to"], "Q", "$.wanted[2].to"),
        (["wanted", 2, "from"], "D", "$.wanted[2].from"),
        (["wanted", 2, "pairs", 0], [1], "$.wanted[2].pairs[0]"),
        (["free", 0], "AB.lenght", "$.free[0]"),
        (["within", "AB.length"], [80, 20], "$.within['AB.length']"),
        (["within", "nothing"], [1, 2], "$.within.nothing"),
        (["demands", 0], "whole tern", "$.demands[0]"),
        (["demands", 2], {"transmission": 95}, "$.demands[2].transmission"),
        (["demands", 3], {"inside": [[0, 0], [0, 5]]}, "$.demands[3].inside"),
        (["demands", 3], {}, "$.demands[3]"),
    ],
)
def test_what_is_wrong_is_refused_with_its_place(place, value, told):
    with pytest.raises(planar.BadInput) as refused:
        planar.read_task(changed(place, value))
    assert refused.value.place == told


def test_the_command_refuses_in_one_sentence(tmp_path):
    (tmp_path / "task.json").write_text(json.dumps(changed(["wanted", 0, "point"], "Z")))
    told = run(tmp_path, "synthesise", "task.json").refused(2)
    assert "$.wanted[0].point" in told and "Traceback" not in told
    assert "no such file" in run(tmp_path, "synthesise", "none.json").refused(2)


@pytest.mark.parametrize(
    ("model", "point", "count"), [("four-bar", "E", 9), ("slider-crank", "E", 10), ("stephenson-3-five-bar", "E", 13)]
)
def test_all_numbers_on_which_the_motion_depends_are_free(model, point, count):
    task = planar.read_task({"planar": 1, "start": model, "wanted": [{"point": point, "through": [["0 m", "0 m"]]}]})
    start = next(start_mechanisms(task))
    free = free_numbers(task, start)
    assert len(free.names) == count
    assert can_move_whole(task, start, free)


def test_chains_are_started_from_with_every_carrier_that_needs_all_links():
    task = planar.read_task(
        {"planar": 1, "start": {"chains": [4, 6]}, "wanted": [{"point": "P", "through": [["0 m", "0 m"]]}]}
    )
    starts = list(islice(start_mechanisms(task), 4))
    assert [len(each.links) for each in starts] == [4, 6, 6, 6]
    for start in starts:
        assert {name.split(".")[0] for name in free_numbers(task, start).names} >= {
            each.name for each in start.links if each.name != "frame"
        }


def test_a_wanted_point_has_both_coordinates_however_the_start_wrote_it():
    """E of the model lies at a distance along its coupler, F by two distances."""
    value = {
        "planar": 1,
        "units": {"length": "mm"},
        "start": "four-bar",
        "wanted": [{"point": "E", "through": [[0, 0]]}],
    }
    task = planar.read_task(value | {"free": ["BC.E", "AD.D"], "within": {"BC.E": [-50, 50]}})
    assert task.free == ("BC.E.x", "BC.E.y", "AD.D.x", "AD.D.y")
    assert task.within["BC.E.y"] == pytest.approx((-0.05, 0.05))
    assert free_numbers(task, next(start_mechanisms(task))).names == task.free
    assert planar.read_task(value | {"free": ["BC.F"]}).free == ("BC.F.B", "BC.F.C")
    with pytest.raises(planar.BadInput, match=r"no number 'BC\.E\.distance'"):
        planar.read_task(value | {"free": ["BC.E.distance"]})
