"""Exact tasks of dyads with a slide: on a line of the frame, and along a line of the link itself."""

import numpy as np
import pytest

import planar
from planar.foundation.jets import value_and_rates
from planar.foundation.private_cache import disable_cache
from planar.synthesis.exact.relations.exact_problem import ExactProblem
from planar.synthesis.exact.tracking import generic_solutions
from planar.synthesis.exact.tracking.ball_paths import certify_member
from planar.synthesis.task.starts import start_mechanisms

UNITS = {"length": "mm", "angle": "deg"}
POSES = [(0, 0, 0), (30, 20, 25), (70, 25, 60), (95, 5, 80)]
TURNS = np.radians([angle for _, _, angle in POSES])
PLACES = 1e-3 * np.array([[x, y] for x, y, _ in POSES])
SWING = {"sliding": "swing", "on": "rod", "block": "D", "line": {"through": "G", "angle": 10}}


@pytest.fixture(autouse=True)
def few_designs(monkeypatch):
    monkeypatch.setattr("planar.synthesis.exact.exact_synthesis.FAMILY_DESIGNS", 1)


def task(start, wanted):
    return {"planar": 1, "units": UNITS, "start": start, "wanted": [wanted]}


def turned(places, angle):
    return places @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def to_link(places, pose):
    return turned(places - PLACES[pose], -TURNS[pose])


def to_world(places, pose):
    return turned(places, TURNS[pose]) + PLACES[pose]


def across(steps, directions):
    """Steps across lines."""
    return steps[:, 0] * np.sin(directions) - steps[:, 1] * np.cos(directions)


def poses(count, link):
    return {"link": link, "poses": [{"at": [x, y], "angle": angle} for x, y, angle in POSES[:count]]}


def crank_and(pair, **points):
    """A crank, and a rod that one more pair guides."""
    return {
        "planar": 1,
        "units": UNITS,
        "frame": "frame",
        "links": {
            "frame": {"points": {"O": [0, 0], "D": [100, 0]}},
            "crank": {"ends": ["O", "A"], "length": 40},
            "rod": {"points": {"A": [0, 0], **points}},
        },
        "pairs": [{"turning": "O"}, {"turning": "A"}, pair],
        "inputs": [{"pair": "O", "position": 60}],
        "sketch": {"A": [20, 35]},
    }


def slides_at_both_ends(second):
    first = {"sliding": "slide", "on": "frame", "block": "A", "line": {"through": "P", "angle": 20}}
    return {
        "planar": 1,
        "units": UNITS,
        "frame": "frame",
        "links": {
            "frame": {"points": {"P": [0, 0], "D": [100, 0], "Q": [30, -10]}},
            "rod": {"points": {"A": [0, 0], "G": [5, 40], "B": [60, 0]}},
        },
        "pairs": [first, second],
        "inputs": [{"pair": "slide", "position": 60}],
        "sketch": {"A": [56, 20], "G": [70, 57]},
    }


def on_circle(places):
    """By how much places are off the circle that fits them best, of its radius."""
    whole = np.insert(2.0 * places, 2, 1.0, axis=1)
    x, y, rest = np.linalg.lstsq(whole, np.sum(places**2, axis=1), rcond=None)[0]
    radius = np.sqrt(rest + x * x + y * y)
    return np.abs(np.linalg.norm(places - [x, y], axis=1) / radius - 1.0).max()


def test_three_poses_leave_a_circle_of_pins_that_stay_on_lines_of_the_frame():
    line = {"sliding": "stroke", "on": "frame", "block": "B", "line": {"through": "D", "angle": 0}}
    found = planar.synthesise(task(crank_and(line, B=[60, 0]), poses(3, "rod")), complete=True)
    (curve,) = (each for each in found.curves if each.has_slide)
    assert (curve.pivot, curve.joint, curve.dimension, len(curve.centre_points)) == ("stroke", "B", 1, 0)
    pins = curve.circle_points
    assert len(pins) > 500 and on_circle(pins) < 1e-12
    own = to_link(pins, 0)
    for pose in (1, 2):
        assert np.abs(across(to_world(own, pose) - pins, curve.directions)).max() < 1e-14
    assert np.isnan(curve.centres(pins)).all()
    texts = planar.plot.dyad_curves(found).findobj(lambda one: hasattr(one, "get_text"))
    assert "Dyads B on stroke" in " ".join(" ".join(each.get_text().split()) for each in texts)


def test_poses_that_leave_no_curve_or_every_place_say_so():
    line = {"sliding": "stroke", "on": "frame", "block": "B", "line": {"through": "D", "angle": 0}}
    for places, said in (([[0, 0], [10, 1], [20, 4]], "stroke have no curve"), ([[0, 0], [10, 0], [20, 0]], "any")):
        shifted = {"link": "rod", "poses": [{"at": at, "angle": 0} for at in places]}
        found = planar.synthesise(task(crank_and(line, B=[60, 0]), shifted), complete=True)
        (curve,) = (each for each in found.curves if each.has_slide)
        assert "the poses are special" in found.complete and said in found.complete
        assert not len(curve.circle_points) and not len(curve.directions)


def test_three_poses_leave_a_circle_of_pivots_that_stay_on_lines_of_the_link():
    found = planar.synthesise(task(crank_and(SWING, G=[5, 10]), poses(3, "rod")), complete=True)
    (curve,) = (each for each in found.curves if each.has_slide)
    assert (curve.pivot, curve.joint, curve.dimension, len(curve.circle_points)) == ("D", "swing", 1, 0)
    pivots = curve.centre_points
    assert len(pivots) > 500 and on_circle(pivots) < 1e-12
    for pose in (1, 2):
        step = to_link(pivots, pose) - to_link(pivots, 0)
        assert np.abs(across(step, curve.directions - TURNS[0])).max() < 1e-14


def test_four_poses_of_a_rod_on_two_slides_are_those_of_the_one_that_made_them():
    maker = planar.from_dict(slides_at_both_ends(SWING))
    motion = planar.cycle(maker, 40, start=0.02, stop=0.06)
    frame = motion.frames["rod"]
    x, y, angle = (np.asarray(value_and_rates(getattr(frame, part))[0]) for part in ("x", "y", "angle"))
    rows = [2, 13, 25, 38]
    wanted = [{"at": [1e3 * x[k], 1e3 * y[k]], "angle": float(np.degrees(angle[k]))} for k in rows]
    made = task(slides_at_both_ends(SWING), {"link": "rod", "poses": wanted})
    found = planar.synthesise(made, complete=True)
    assert (found.expected, found.found, len(found), found.complete) == (1, 1, 1, "numerically complete")
    (design,) = found
    numbers, old = planar.dimensions(design.mechanism), planar.dimensions(maker)
    for name in ("frame.D.x", "frame.D.y", "rod.A.x", "rod.A.y"):
        assert numbers[name] == pytest.approx(old[name], abs=1e-10)
    assert design.certified and not design.defects and design.greatest_miss < 1e-10
    again = planar.loads(planar.dumps(design.mechanism))
    for at, k in zip(design.inputs[0], rows, strict=True):
        own = planar.solve(again, {"slide": float(at)}).frames["rod"]
        here = [float(value_and_rates(getattr(own, part))[0]) for part in ("x", "y")]
        np.testing.assert_allclose(here, [x[k], y[k]], atol=1e-10)


def test_two_slides_that_are_alike_can_not_take_four_poses():
    """Every pin on a circle of Cardan's stays on a line: two that do leave no other condition to be met."""
    second = {"sliding": "other", "on": "frame", "block": "B", "line": {"through": "Q", "angle": 110}}
    with pytest.raises(planar.BadInput, match="'block B' is too many and 1 number of it stays open"):
        planar.synthesise(task(slides_at_both_ends(second), poses(4, "rod")), complete=True)


def test_a_dyad_that_slides_twice_and_more_poses_than_a_slide_takes_are_refused_in_words():
    plate = {
        "planar": 1,
        "units": UNITS,
        "frame": "frame",
        "links": {
            "frame": {"points": {"O": [0, 0], "D": [100, 0]}},
            "slide": {"points": {"S": [0, 0]}},
            "plate": {"points": {"T": [0, 0], "Q": [50, 0]}},
            "bar": {"ends": ["D", "Q"], "length": 60},
        },
        "pairs": [
            {"sliding": "one", "links": ["frame", "slide"], "point": "S", "line": {"through": "O", "angle": 20}},
            {"sliding": "two", "links": ["slide", "plate"], "point": "T", "line": {"through": "S", "angle": 100}},
            {"turning": "D"},
            {"turning": "Q"},
        ],
        "inputs": [{"pair": "one", "position": 60}],
        "sketch": {"Q": [50, 20]},
    }
    with pytest.raises(planar.BadInput, match="'plate' slides on what does not turn, so that it takes parallel poses"):
        planar.synthesise(task(plate, poses(3, "plate")), complete=True)
    parallel = {"link": "plate", "poses": [{"at": [k, k * k], "angle": 7} for k in range(3)]}
    with pytest.raises(planar.BadInput, match="takes parallel poses whatever two directions"):
        planar.synthesise(task(plate, parallel), complete=True)
    five = poses(4, "rod")
    five["poses"].append({"at": [99, -30], "angle": 99})
    with pytest.raises(planar.BadInput, match=r"1 condition on .* is too many"):
        planar.synthesise(task(crank_and(SWING, G=[5, 10]), five), complete=True)


def slider_crank(end, crank, rod):
    """A slider-crank whose line goes through G to a second point H."""
    return {
        "planar": 1,
        "units": {"length": "m", "angle": "rad"},
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0], "G": [0.05, 0.12], "H": [2, end]}},
            "c": {"ends": ["O", "A"], "length": crank},
            "rod": {"ends": ["A", "B"], "length": rod},
        },
        "pairs": [
            {"turning": "O"},
            {"turning": "A"},
            {"sliding": "s", "on": "f", "block": "B", "line": {"through": "G", "to": "H"}},
        ],
        "inputs": [{"pair": "O", "position": 1}],
        "sketch": {"B": [1, 0.2]},
    }


def slider_pairs(angles):
    """Displacements along the line with H at y = 0.3 m of a crank of 0.35 m and a rod of 0.8 m."""
    turn = np.exp(-1j * np.angle(1.95 + 0.18j))
    pin = (0.35 * np.exp(1j * np.array(angles)) - (0.05 + 0.12j)) * turn
    return np.stack([angles, pin.real + np.sqrt(0.64 - pin.imag**2)], axis=1).tolist()


@pytest.mark.parametrize(
    ("start", "free", "others"),
    [
        (slider_crank(0.3, 0.3, 0.9), {"c.length": 0.35, "rod.length": 0.8}, 0),
        (slider_crank(0.31, 0.3, 0.9), {"c.length": 0.35, "rod.length": 0.8, "f.H.y": 0.3}, 0),
        (slider_crank(0.31, 0.35, 0.8), {"f.H.y": 0.3}, 1),
    ],
)
def test_lines_through_two_points_are_given_or_sought_by_their_coordinates(monkeypatch, start, free, others):
    """Solutions whose line goes from H to G are no linkages, and are not listed."""
    monkeypatch.setattr(generic_solutions, "trace_test", lambda *_, **__: True)
    wanted = {"from": "O", "to": "s", "pairs": slider_pairs([0.3, 0.9, 1.6][: len(free)]), "absolute": True}
    value = {"planar": 1, "units": start["units"], "start": start, "wanted": [wanted], "free": [*free]}
    with disable_cache():
        designs = planar.synthesise(value, complete=True)
    assert len(designs) == 1 + others and all(design.certified for design in designs)
    assert any(design.numbers == pytest.approx(free, abs=1e-9) for design in designs)


def test_a_path_that_ends_nearly_at_infinity_is_not_the_solution_to_which_it_is_polished():
    """Of three absolute pairs of an offset slider-crank Freudenstein's equations, linear, have one solution."""
    start = slider_crank(0.12, 0.3, 0.9)
    start["links"]["f"]["points"] = {"O": [0, 0], "G": [0, 0.05]}
    start["pairs"][2]["line"] = {"through": "G", "angle": 0}
    angles = np.array([0.3, 0.8, 1.2])
    displacements = 0.35 * np.cos(angles) + np.sqrt(0.64 - (0.35 * np.sin(angles) - 0.12) ** 2)
    wanted = {"from": "O", "to": "s", "pairs": np.stack([angles, displacements], axis=1).tolist(), "absolute": True}
    free = ["c.length", "rod.length", "f.G.y"]
    read = planar.read_task({"planar": 1, "units": start["units"], "start": start, "wanted": [wanted], "free": free})
    (component,) = ExactProblem(read, next(iter(start_mechanisms(read)))).components
    solution = np.array([0.371519746 + 0.114924525j, 1.26021799 + 0.13333333j])
    end = np.array([-5.99254229e-08 - 1.24069954e-08j, 3.98314693e04 + 2.13973812e04j])
    conjugate_end = np.array([-6.77674777e-08 + 5.11617918e-08j, -3.98314316e04 - 2.13974101e04j])
    x = np.array([[*solution, *solution.conj()], [*end, *conjugate_end]])
    assert certify_member(component.family, component.member, x).proved.tolist() == [True, False]
