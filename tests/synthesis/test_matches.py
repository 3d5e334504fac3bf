"""Matches: what a design of a catalogue does finds it again; every match does as it says on the general path."""

from dataclasses import replace

import numpy as np
import pytest

import planar
from planar.foundation.errors import BadInput
from planar.model.link_shapes import link_shape
from planar.model.mechanism import named_points
from planar.synthesis.matching.match_catalogue import match_catalogue
from planar.synthesis.matching.match_problem import MatchProblem
from planar.synthesis.matching.timed_search import best_trials
from planar.synthesis.matching.wanted_entries import FunctionEntries, PathEntries, PoseEntries

FRAME = ("AD.A.x", "AD.A.y", "AD.D.x", "AD.D.y")
BARS = ("AB.length", "BC.length", "DC.length")
POINT = ("BC.E.x", "BC.E.y")
MOVE = 0.7 * np.exp(0.9j), 0.3 - 0.2j
"""A similarity by which what a design does is moved."""


@pytest.fixture(autouse=True, scope="module")
def own_cache(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PLANAR_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


def four_bar():
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "AD",
            "links": {
                "AD": {"points": {"A": [0, 0], "D": [0.1, 0]}},
                "AB": {"ends": ["A", "B"], "length": 0.03},
                "BC": {"ends": ["B", "C"], "length": 0.09, "points": {"E": [0.04, 0.03]}},
                "DC": {"ends": ["D", "C"], "length": 0.07},
            },
            "pairs": [{"turning": name} for name in "ABCD"],
            "inputs": [{"pair": "A", "position": 1.0}],
            "sketch": {"C": [0.1, 0.07]},
        }
    )


@pytest.fixture(scope="module")
def found(own_cache):
    return match_catalogue(four_bar(), FRAME + BARS + POINT, ["E"], ["A", "D"], size=600)


def motion_of(found, design, place, link="BC"):
    """Origins and directions of a link of a design, and the path of a place on it, in double precision."""
    motions = found.swept.motions
    k, count = found.swept.links.index(link), motions.sample_count[design]
    turn = np.exp(1j * motions.angles[k, design, :count].astype(float))
    origin = motions.origins[k, design, :count].astype(complex)
    return origin, turn, origin + turn * place


def a_closed_curve(found, seed=0):
    """The number of a design with a curve of the index that is no dot, and its place."""
    index = found.curves["E"]
    closed = np.flatnonzero(index.is_closed)
    k = np.random.default_rng(seed).choice(closed)
    return int(index.design[k]), complex(index.coordinates[k])


def moved(places):
    return MOVE[0] * places + MOVE[1]


def ones(places):
    return np.ones(len(places))


def turned_back(inputs):
    """Angles without whole turns."""
    return np.exp(1j * np.asarray(inputs))


@pytest.mark.parametrize("way", [1, -1])
def test_a_closed_curve_finds_its_design(found, way):
    for seed in range(4):
        design, place = a_closed_curve(found, seed)
        path = moved(np.roll(motion_of(found, design, place)[2], 5)[::way])
        best = found.matches([PathEntries("E", path, ones(path), is_closed=True)])[0]
        assert best.distance < 3e-6
        assert best.design == design
        first, step = found.swept.motions.first_input[design], found.swept.motions.input_step[design]
        inputs = np.roll(first + step * np.arange(72), 5)[::way]
        assert np.abs(turned_back(best.inputs) - turned_back(inputs)).max() < 1e-3
        assert abs(best.move.factor - MOVE[0]) < 1e-4 * abs(MOVE[0])
        assert abs(best.move.offset - MOVE[1]) < 1e-4


def test_places_in_order_find_arcs_as_near(found):
    design, place = a_closed_curve(found, 3)
    path = moved(motion_of(found, design, place)[2])[[3, 9, 17, 22, 30, 41]]
    matches = found.matches([PathEntries("E", path, ones(path))])
    assert matches[0].distance < 2e-3
    for match in matches:
        steps = np.diff(match.inputs)
        assert (steps > -0.05).all() or (steps < 0.05).all()


def test_places_in_any_order_find_curves_as_near(found):
    design, place = a_closed_curve(found, 3)
    path = moved(motion_of(found, design, place)[2])[[30, 3, 41, 17, 9, 22, 60]]
    matches = found.matches([PathEntries("E", path, ones(path), in_order=False)])
    assert matches[0].distance < 2e-2


def test_many_places_on_an_open_arc(found):
    closed = found.swept.motions.is_closed
    design = int(np.flatnonzero(~closed & (found.swept.motions.sample_count > 30))[0])
    path = moved(motion_of(found, design, 0.02 + 0.03j)[2])[4:28]
    matches = found.matches([PathEntries("E", path, ones(path))])
    assert matches[0].distance < 3e-3


@pytest.mark.parametrize("is_absolute", [False, True])
def test_given_inputs_find_their_design(found, is_absolute):
    for seed in range(3):
        design, place = a_closed_curve(found, seed)
        chosen = [2, 9, 20, 33, 47, 60]
        motions = found.swept.motions
        inputs = motions.first_input[design] + motions.input_step[design] * np.array(chosen)
        turned = np.angle(MOVE[0]) if is_absolute else 0.4
        path = moved(motion_of(found, design, place)[2])[chosen]
        wanted = PathEntries("E", path, ones(path), inputs + turned, is_absolute=is_absolute)
        best = found.matches([wanted])[0]
        assert best.distance < 3e-6
        assert best.design == design
        assert np.abs(turned_back(best.inputs) - turned_back(inputs)).max() < 1e-6
        place_found = complex(*best.numbers[[found.names.index(name) for name in POINT]])
        assert abs(place_found - place) < 1e-5


def test_poses_find_their_design(found):
    design, _ = a_closed_curve(found, 1)
    chosen = [3, 15, 33, 50]
    origin, turn, _ = motion_of(found, design, 0.0)
    places, angles = moved(origin)[chosen], np.angle(turn * MOVE[0])[chosen]
    best = found.matches([PoseEntries("BC", places, angles, ones(places))])[0]
    assert best.distance < 1e-3
    motions = found.swept.motions
    inputs = motions.first_input[design] + motions.input_step[design] * np.array(chosen)
    best = found.matches([PoseEntries("BC", places, angles, ones(places), inputs)])[0]
    assert best.distance < 3e-6
    assert best.design == design


@pytest.mark.parametrize(("given", "told"), [("A", "D"), ("D", "A")])
def test_a_function_finds_its_design(found, given, told):
    swept = found.swept
    design = int(np.flatnonzero(swept.motions.is_closed)[7])
    chosen = np.array([9, 14, 18, 23, 27])
    inputs = swept.motions.first_input[design] + swept.motions.input_step[design] * chosen
    values = {"A": inputs, "D": swept.motions.values["D"][design, chosen].astype(float)}
    if given == "D" and not (np.diff(values["D"]) > 0).all() and not (np.diff(values["D"]) < 0).all():
        values = {name: each[:2] for name, each in values.items()}
    wanted = FunctionEntries(given, told, values[given] + 0.3, values[told] - 0.2, ones(values["A"]))
    matches = found.matches([wanted], can_move=False)
    assert matches[0].distance < 1e-5
    assert any(match.design == design for match in matches)


def test_several_items_find_their_design_together(found):
    design, place = a_closed_curve(found, 5)
    motions = found.swept.motions
    origin, turn, path = motion_of(found, design, place)
    chosen, poses = [2, 12, 24, 40, 55], [7, 30, 50]
    inputs = motions.first_input[design] + motions.input_step[design] * np.array([4, 20, 33, 61])
    outputs = motions.values["D"][design, [4, 20, 33, 61]].astype(float)
    wanted = [
        PathEntries("E", moved(path)[chosen], ones(chosen)),
        PoseEntries("BC", moved(origin)[poses], np.angle(turn * MOVE[0])[poses], ones(poses), in_order=True),
        FunctionEntries("A", "D", inputs, outputs, ones(inputs)),
    ]
    matches = found.matches(wanted)
    assert matches[0].distance < 0.05
    for match in matches[:5]:
        assert match.inputs.shape == (12,)
        assert match.frames.shape == (12, 3, 3)
    timed = [wanted[0]._replace(inputs=motions.first_input[design] + motions.input_step[design] * np.array(chosen))]
    best = found.matches([*timed, *wanted[2:]])[0]
    assert best.distance < 1e-5
    assert best.design == design


def place_misses(found, match, point="E"):
    """How far the point of a match is from where its frames have it, on the general path (m); and where it is."""
    mechanism = found.mechanism.with_values(dict(zip(found.names, map(float, match.numbers), strict=True)))
    pair, points = mechanism.inputs[0].pair, {each.name: each.members for each in named_points(mechanism)}
    links, frame = found.swept.links, mechanism.frame
    places, misses = [], []
    for position, frames in zip(match.inputs, match.frames, strict=True):
        sketch = []
        for name, members in points.items():
            carrier, at = members[0]
            if frame not in dict(members):
                x, y, angle = frames[links.index(carrier)]
                spot = link_shape(next(each for each in mechanism.links if each.name == carrier)).position(at)
                here = complex(x, y) + np.exp(1j * angle) * complex(spot.x, spot.y)
                sketch.append((name, here.real, here.imag))
        state = planar.solve(
            replace(mechanism, sketch=tuple(sketch)).with_values({f"{pair}.position": float(position)})
        )
        told = complex(*state.point(point).position)
        expected = {name: complex(x, y) for name, x, y in sketch}[point]
        places.append(told)
        misses.append(abs(told - expected))
    return np.array(misses), np.array(places)


@pytest.mark.parametrize("kind", ["closed", "arc", "timed", "in no order"])
def test_matches_do_on_the_general_path_what_they_say(found, kind):
    rounds = np.exp(2j * np.pi * np.arange(12) / 12)
    path = 0.2 * (rounds + 0.4 * rounds.conj() + 0.1j * rounds**2) + 0.5
    wanted = {
        "closed": PathEntries("E", path, ones(path), is_closed=True),
        "arc": PathEntries("E", path[:7], ones(path[:7])),
        "timed": PathEntries("E", path, ones(path), 2.0 * np.pi * np.arange(12) / 12),
        "in no order": PathEntries("E", path[[0, 5, 3, 9, 7, 1]], np.ones(6), in_order=False),
    }[kind]
    matches = found.matches([wanted], many=6)
    assert len(matches) == 6
    size = 2.0 * np.sqrt(np.mean(np.abs(wanted.places - wanted.places.mean()) ** 2))
    assert [match.distance for match in matches] == sorted(match.distance for match in matches)
    for match in matches:
        misses, places = place_misses(found, match)
        factor = abs(match.move.factor)
        # straight lines between 72 samples are off by some 1e-3 of a crank's radius
        assert misses.max() * factor < 4e-3 * size
        off = np.abs(match.move.factor * places + match.move.offset - wanted.places)
        assert abs(np.sqrt(np.mean(off**2)) / size - match.distance) < 4e-3


def test_a_mechanism_that_stays_is_matched_where_it_is(found):
    design, place = a_closed_curve(found, 2)
    path, steps = motion_of(found, design, place)[2], np.array([3, 20, 40, 60])
    for wanted in (
        PathEntries("E", path, ones(path), is_closed=True),
        PathEntries("E", path[steps], np.ones(4), found.swept.motions.input_step[0] * steps),
    ):
        best = found.matches([wanted], can_move=False)[0]
        assert best.distance < 3e-6
        assert best.design == design
        assert best.move == (1.0, 0.0)


def test_timed_designs_are_those_of_exhaustive_search(found):
    rng = np.random.default_rng(8)
    path, inputs = rng.normal(size=5) + 1j * rng.normal(size=5), np.array([0.0, 0.9, 2.0, 2.6, 4.1])
    wanted = PathEntries("E", path, np.array([1.0, 2.0, 1.0, 1.0, 0.5]), inputs)
    problem = MatchProblem(found.swept, (wanted,), found.points, found.curves, True)
    designs = np.flatnonzero(found.swept.motions.is_closed)[:12]
    told = best_trials(problem, wanted, designs, None)
    root = np.sqrt(wanted.weights)
    for k, design in enumerate(designs):
        origin, turn, _ = motion_of(found, design, 0.0)
        best = np.inf
        for start in range(72):
            at = (start + inputs / (2.0 * np.pi / 72)) % 72
            one, part = np.floor(at).astype(int), at % 1.0
            o, r = ((1 - part) * each[one % 72] + part * each[(one + 1) % 72] for each in (origin, turn))
            columns = np.stack([o, np.ones(5), r / np.abs(r)], axis=1) * root[:, None]
            off = columns @ np.linalg.lstsq(columns, path * root, rcond=None)[0] - path * root
            best = min(best, np.sum(np.abs(off) ** 2) / wanted.weights.sum())
        assert told.square[k] == pytest.approx(best, rel=1e-3, abs=1e-9)


def test_points_stay_within_their_bounds():
    names = FRAME + BARS + POINT
    lower, upper = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    lower[-2:], upper[-2:] = (0.02, -0.01), (0.05, 0.01)
    within = match_catalogue(four_bar(), names, ["E"], lower=lower, upper=upper, size=200)
    path = np.exp(2j * np.pi * np.arange(10) / 10) * (1.0 + 0.3 * np.sin(np.arange(10)))
    for wanted in (PathEntries("E", path, ones(path), is_closed=True), PathEntries("E", path[:5], np.ones(5))):
        for match in within.matches([wanted], many=10):
            assert (match.numbers[-2:] >= lower[-2:] - 1e-12).all()
            assert (match.numbers[-2:] <= upper[-2:] + 1e-12).all()


def test_a_point_that_is_not_free_stays_where_the_file_has_it():
    fixed = match_catalogue(four_bar(), FRAME + BARS, ["E", "C"], size=200)
    design = int(np.flatnonzero(fixed.swept.motions.is_closed)[3])
    for point, link, place in (("E", "BC", 0.04 + 0.03j), ("C", "DC", fixed.swept.numbers[design][-1])):
        path = moved(motion_of(fixed, design, place, link)[2])
        timed = PathEntries(point, path[::9], np.ones(8), fixed.swept.motions.input_step[design] * np.arange(0, 72, 9))
        best = fixed.matches([timed])[0]
        assert best.distance < 3e-6


@pytest.mark.parametrize(
    ("model", "names", "point"),
    [
        ("slider-crank", ("crank.length", "rod.length", "rod.E.distance", "rod.E.angle"), "E"),
        ("watt-six-bar", ("AB.length", "BC.length", "CD.length"), None),
        ("geared-five-bar", ("OA.length", "QB.length", "AC.length", "BC.length", "AC.P.distance"), "P"),
    ],
)
def test_any_structure_is_searched(model, names, point):
    mechanism = planar.load(model)
    names = tuple(name for name in names if name in planar.dimensions(mechanism))
    point = point or named_points(mechanism)[-1].name
    some = match_catalogue(mechanism, names, [point], size=40)
    index = some.curves[point]
    k = int(np.flatnonzero(index.is_closed)[5])
    links = some.swept.links
    path = motion_of(some, index.design[k], complex(index.coordinates[k]), links[some.points[point].link])[2]
    best = some.matches([PathEntries(point, moved(path), ones(path), is_closed=True)])[0]
    assert best.distance < 1e-4
    assert best.design == index.design[k]


def test_a_sliding_input_is_searched(found):
    mechanism = planar.load("slider-crank")
    driven = replace(mechanism, inputs=(mechanism.inputs[0]._replace(pair="stroke", position=1.7),))
    some = match_catalogue(driven, ("crank.length", "rod.length", "rod.E.distance"), ["E"], ["O"], size=40)
    index = some.curves["E"]
    design, place = int(index.design[11]), complex(index.coordinates[11])
    path = motion_of(some, design, place, "rod")[2]
    motions = some.swept.motions
    inputs = motions.first_input[design] + motions.input_step[design] * np.arange(5, 60, 9)
    best = some.matches([PathEntries("E", moved(path)[5:60:9], np.ones(7), inputs)])[0]
    assert best.distance < 3e-6
    assert best.design == design
    assert np.allclose(best.inputs, inputs, rtol=0, atol=1e-9)


def test_matches_are_not_all_but_alike(found):
    path = np.exp(2j * np.pi * np.arange(16) / 16) * (1.0 + 0.4 * np.cos(np.arange(16)))
    matches = found.matches([PathEntries("E", path, ones(path), is_closed=True)], many=20)
    assert len({(match.design, round(match.move.factor.real, 3)) for match in matches}) == 20


def test_the_same_seed_finds_the_same_matches(found):
    path = np.array([0.0, 1.0, 2.0 + 1.0j, 1.0 + 2.0j])
    one, same = (found.matches([PathEntries("E", path, ones(path))], seed=2, many=9) for _ in range(2))
    assert [match.design for match in one] == [match.design for match in same]
    assert all(np.array_equal(a.numbers, b.numbers) for a, b in zip(one, same, strict=True))


@pytest.mark.parametrize(
    ("wanted", "said"),
    [
        ([], "nothing is wanted"),
        ([PathEntries("B", np.zeros(2), np.ones(2))], "not made for a point 'B'"),
        ([PoseEntries("AD", np.zeros(2), np.zeros(2), np.ones(2))], "no moving link 'AD'"),
        ([FunctionEntries("A", "C", np.zeros(2), np.zeros(2), np.ones(2))], "not made for a pair 'C'"),
    ],
)
def test_what_the_catalogue_does_not_know_is_refused(found, wanted, said):
    with pytest.raises(BadInput, match=said):
        found.matches(wanted)


def test_names_that_are_not_there_are_refused():
    with pytest.raises(BadInput, match=r"AB\.lenth"):
        match_catalogue(four_bar(), ["AB.lenth"], ["E"], size=5)
    with pytest.raises(BadInput, match="no point 'Q'"):
        match_catalogue(four_bar(), BARS, ["Q"], size=5)
    with pytest.raises(BadInput, match="'D' lies on the frame"):
        match_catalogue(four_bar(), BARS, ["D"], size=5)
