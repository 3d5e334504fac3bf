"""Demands that the fit keeps: slopes against differences, designs against the general path and brute force."""

import numpy as np
import pytest

import planar
from planar.synthesis.design_search import DesignSearch
from planar.synthesis.fitting.design_fit import constrained_step
from planar.synthesis.fitting.moving_designs import OrderSlacks
from planar.synthesis.fitting.wanted_equations import solve_symmetric, tangents
from planar.synthesis.judgement.defects import output_transmissions, polygon_depths
from planar.synthesis.judgement.judgement import DesignJudge
from planar.synthesis.task.starts import start_mechanisms
from planar.synthesis.task.wanted_results import entry_misses, resting_misses
from tests.draws import covering, first_cases
from tests.known import MODELS
from tests.small_searches import set_small_searches

UNITS = {"length": "mm", "angle": "deg"}
STARTS = [("four-bar", "E"), ("slider-crank", "E"), ("whitworth", "D"), ("klann-leg", "foot")]
SQUARE = [[0, 0], [20, 0], [20, 20], [0, 20]]
CUT_SQUARE = [[-1, -2], [3, -2], [3, 3], [1, 0.5], [-1, 3]]
"""Not convex, as a share of the extent of what is wanted."""


@pytest.fixture
def few_designs(monkeypatch):
    """A small catalogue, which is enough for tasks as easy as these."""
    set_small_searches(monkeypatch)
    monkeypatch.setattr("planar.synthesis.synthesise.DRAWS", 600)
    monkeypatch.setattr("planar.synthesis.synthesise.MATCHES", 5)


def task(start, *wanted, **more):
    return {"planar": 1, "units": UNITS, "start": start, "wanted": list(wanted)} | more


def search(model, point, **more):
    known = planar.read_task(task(model, {"point": point, "through": [[0, 0], [90, 50], [200, 20]]}, **more))
    return DesignSearch(known, next(start_mechanisms(known)))


def positions(own, count):
    """Scaled numbers near those of the start, and unknowns (count, unknowns) of its motion, closed by them."""
    each = own.equations[0]
    motion = planar.cycle(own.mechanism, 17)
    z, _ = each.design.coordinates_at(motion)
    inputs = motion.inputs[own.mechanism.inputs[0].pair].position / each.input_scale
    y = np.concatenate([z[0], inputs[:, None]], axis=1)[1 : count + 1][None]
    x = (own.free.values / each.scale)[None] + 0.01 * np.random.default_rng(5).normal(size=len(own.free.names))
    y, is_closed = each.close(x, y, tangents(each.jacobians(x, y)), 8)
    assert is_closed.all()
    return x, y


@pytest.mark.parametrize(("model", "point"), STARTS)
def test_slacks_change_as_their_slopes_say(model, point):
    """By the numbers with the input held, and by the input, all equations kept: central differences."""
    extent = 200.0
    corners = (extent * np.array(CUT_SQUARE)).tolist()
    own = search(model, point, demands=[{"transmission": 30}, {"inside": corners}])
    guard = own.guards[True]
    x, y = positions(own, 5)
    many = guard.row_count
    found = guard.slopes(x, y, np.ones((1, 5, many), bool))
    np.testing.assert_allclose(found.slack, guard.slacks(x, y)[0])

    def slack(numbers, inputs):
        there = np.concatenate([y[..., :-1], (y[..., -1] + inputs)[..., None]], axis=-1)
        closed, is_closed = guard.equations.close(numbers, there, np.zeros_like(y), 8)
        assert is_closed.all()
        return guard.slacks(numbers, closed)[0]

    step = 1e-6
    for k in range(x.shape[1]):
        change = step * np.eye(x.shape[1])[k]
        differences = (slack(x + change, 0.0) - slack(x - change, 0.0)) / (2 * step)
        np.testing.assert_allclose(found.by_numbers[:, k], differences, rtol=1e-5, atol=1e-6)
    differences = (slack(x, step) - slack(x, -step)) / (2 * step)
    np.testing.assert_allclose(found.by_input, differences, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("model", "point"), STARTS)
def test_transmission_angles_of_the_fit_are_those_of_the_general_path(model, point):
    own = search(model, point, demands=[{"transmission": 30}])
    rows = own.guards[True].rows[0]
    motion = planar.cycle(own.mechanism, 17)
    z, _ = own.equations[0].design.coordinates_at(motion)
    inputs = motion.inputs[own.mechanism.inputs[0].pair].position / own.equations[0].input_scale
    y = np.concatenate([z[0], inputs[:, None]], axis=1)[1:-1]
    x = np.broadcast_to(own.free.values / own.equations[0].scale, (len(y), len(own.free.names)))
    for each, angle in zip(output_transmissions(motion), rows.values(x, y).T, strict=True):
        np.testing.assert_allclose(angle, planar.transmission(motion, each.pair).angle[1:-1], atol=1e-9)


def test_depths_in_a_polygon_are_distances_from_its_border():
    corners = np.array(CUT_SQUARE, float)
    places = np.random.default_rng(2).uniform(-3, 4, size=(300, 2))
    depths, ways = polygon_depths(places, corners)
    share = np.linspace(0, 1, 4001)[:, None]
    border = np.concatenate([a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])
    nearest = np.array([np.linalg.norm(border - each, axis=1).min() for each in places])
    np.testing.assert_allclose(np.abs(depths), nearest, atol=1e-3)
    x, y = places.T
    inside = (x > -1) & (x < 3) & (y > -2) & (y < np.where(x < 1, 0.5 + 1.25 * (1 - x), 0.5 + 1.25 * (x - 1)))
    np.testing.assert_array_equal(depths > 0, inside)
    np.testing.assert_allclose(polygon_depths(places + 1e-7 * ways, corners)[0] - depths, 1e-7, rtol=1e-4)
    on_side, inward = polygon_depths(np.array([[0.0, -2.0]]), corners[::-1])
    assert on_side[0] == pytest.approx(0.0)
    np.testing.assert_allclose(inward[0], [0, 1])


def test_steps_keep_the_conditions_of_karush_kuhn_and_tucker():
    random = np.random.default_rng(3)
    root = random.normal(size=(6, 5, 5))
    normal = root @ root.swapaxes(1, 2) + np.eye(5)
    slope, slack = random.normal(size=(6, 5)), random.normal(size=(6, 4))
    slopes, rows, ways = random.normal(size=(6, 4, 5)), random.normal(size=(6, 1)), random.normal(size=(6, 1, 5))
    step = constrained_step(normal, slope, slack, slopes, rows, ways)
    left = slack + np.einsum("cki,ci->ck", slopes, step)
    np.testing.assert_allclose(rows + np.einsum("cki,ci->ck", ways, step), 0.0, atol=1e-9)
    assert left.min() > -1e-5
    for k in range(6):  # the gradient is a sum of slopes that bear, none of them with a negative multiplier
        gradient = normal[k] @ step[k] + slope[k]
        is_bearing = left[k] < 1e-5
        bearing = np.concatenate([slopes[k][is_bearing], ways[k]])
        multipliers = np.linalg.lstsq(bearing.T, gradient, rcond=None)[0]
        np.testing.assert_allclose(bearing.T @ multipliers, gradient, atol=1e-4)
        assert (multipliers[:-1] > -1e-4).all()


def test_a_singular_system_alone_is_solved_by_least_size():
    matrices = np.stack([np.diag([1e-9, 3.0]), np.ones((2, 2)), np.diag([2.0, 4.0])])
    found = solve_symmetric(matrices, np.array([[1.0, 3.0], [2.0, 2.0], [2.0, 4.0]]))
    np.testing.assert_allclose(found, [[1e9, 1.0], [1.0, 1.0], [1.0, 1.0]])


def test_slacks_of_an_order_are_steps_of_the_input_in_its_sense():
    own = search("four-bar", "E").equations[0]
    own.rows = own.rows._replace(wanted=own.rows.wanted._replace(in_order=True))
    inputs = np.array([[5.9, 0.2, 0.5], [3.0, 2.0, 2.5]])
    unknowns = [inputs[..., None]]
    round_turn, between = (OrderSlacks([own], unknowns, over_turn, True) for over_turn in (True, False))
    turn = 2 * np.pi
    slack = round_turn.slacks(inputs, np.arange(2))
    np.testing.assert_allclose(slack[0], [0.2 - 5.9 + turn, 0.3, turn - (0.5 - 5.9 + turn)])
    np.testing.assert_allclose(between.slacks(inputs, np.arange(2))[1], [1.0, -0.5])
    np.testing.assert_allclose(between.slopes(np.ones((2, 3)), np.arange(2)), 0.0)


PATHS = {
    "four-bar": "64 134 88 127 135 108 157 98 162 109 158 126 147 142 130 154 109 161 88 160 71 154 62 143",
    "slider-crank": "-34 -69 -56 -53 -70 -28 -72 0 -64 21 -62 25 -71 8 -75 -20 -65 -47 -45 -67 -22 -75 -16 -75",
    "stephenson-3-five-bar": "445 -118 416 -104 393 -87 377 -71 367 -58 362 -51 363 -51 368 -60 380 -74 401 -94 435 "
    "-114 462 -124",
}
"""x and y of each place, closed curves."""


def least_transmissions(design, outputs):
    motion = planar.cycle(planar.loads(planar.dumps(design.mechanism)), 720)
    assert np.ptp(motion.inputs[design.mechanism.inputs[0].pair].position) == pytest.approx(2 * np.pi)
    return [float(np.degrees(planar.transmission(motion, each).angle.min())) for each in outputs]


def output_kinds(case):
    """The kinds of pairs of a model, and whether one or several outputs are looked at."""
    model, outputs, _ = case
    return {*map(type, MODELS[model].pairs), *(["several"] if len(outputs) > 1 else [])}


@pytest.mark.parametrize(
    ("model", "outputs", "least"),
    covering(
        [("four-bar", ["D"], 35), ("slider-crank", ["stroke"], 30), ("stephenson-3-five-bar", ["P", "Q"], 40)],
        output_kinds,
    ),
)
def test_a_transmission_angle_is_kept_all_round_the_turn(few_designs, model, outputs, least):
    wanted = {"point": "E", "through": np.array(PATHS[model].split(), float).reshape(-1, 2).tolist(), "closed": True}
    free = planar.synthesise(task(model, wanted), many=1)[0]
    assert min(least_transmissions(free, outputs)) < least - 1  # what is best without the demand
    found = planar.synthesise(task(model, wanted, demands=[{"transmission": least}]), many=1)
    assert min(least_transmissions(found[0], outputs)) >= least
    assert found[0].greatest_miss < 0.1 * found.size


def test_between_entries_a_transmission_angle_is_kept_where_the_input_swings(few_designs):
    wanted = {"point": "E", "through": [[0, 0], [20, 12], [42, 15], [63, 8], [80, -6]], "in_order": True}
    found = planar.synthesise(task("four-bar", wanted, demands=[{"transmission": 60}]), many=3)
    swinging = 0
    for design in found:
        inputs = design.inputs[0]
        whole = planar.cycle(design.mechanism, 90)
        is_whole = np.ptp(whole.inputs["A"].position) > 2 * np.pi - 1e-6
        swinging += not is_whole
        ends = {} if is_whole else {"start": float(inputs.min()), "stop": float(inputs.max())}
        motion = planar.cycle(design.mechanism, 720, **ends)
        assert np.degrees(planar.transmission(motion, "D").angle.min()) >= 60
        assert design.greatest_miss < 0.01 * found.size
    assert swinging


@pytest.mark.parametrize(
    "corners",
    first_cases(
        [
            [[-60, -60], [30, -60], [30, -10], [90, -10], [90, 80], [-60, 80]],
            [[-60, -60], [120, 60]],
        ]
    ),
)
def test_a_region_is_kept_by_all_points(few_designs, monkeypatch, corners):
    monkeypatch.setattr("planar.synthesis.synthesise.DRAWS", 1000)
    monkeypatch.setattr("planar.synthesis.synthesise.MATCHES", 10)  # fewer do not come near the path in this region
    wanted = {"point": "E", "through": [[0, 0], [20, 12], [42, 15], [63, 8], [80, -6]], "in_order": True}
    turning = task("four-bar", wanted, demands=["whole turn"])
    given = planar.read_task(task("four-bar", wanted, demands=[{"inside": corners}])).demands.inside

    def depth(design):
        motion = planar.cycle(design.mechanism, 720)
        return min(polygon_depths(np.atleast_2d(motion.point(name).position), given)[0].min() for name in "ABCDEFG")

    assert depth(planar.synthesise(turning, many=1)[0]) < -1e-2  # what is best leaves it
    found = planar.synthesise(turning | {"demands": ["whole turn", {"inside": corners}]}, many=1, seed=1)[0]
    assert depth(found) >= -1e-9
    assert found.greatest_miss < 0.05 * 80e-3


def test_designs_grow_as_far_as_their_bounds_let_them():
    own = search("four-bar", "E", within={"AB.length": [20, 80], "BC.length": [60, None]})
    names, scale = own.free.names, own.equations[0].scale
    x = (own.free.values / scale)[None].repeat(2, axis=0)
    x[:, names.index("AB.length")], x[:, names.index("BC.length")] = (0.04, 0.08), 0.1
    x[:, names.index("AB.length")] /= scale[names.index("AB.length")]
    x[:, names.index("BC.length")] /= scale[names.index("BC.length")]
    factors = own.moves.factors(x, own.free.lower / scale, own.free.upper / scale)
    np.testing.assert_allclose(factors, [[0.6, 2.0], [0.6, 1.0]])
    held = search("four-bar", "E", within={"AD.A.x": [0, 80]})
    assert held.moves.factors(x, held.free.lower / scale, held.free.upper / scale) is None


def test_bounded_lengths_are_matched_wherever_what_is_wanted_lies(few_designs):
    wanted = {"point": "E", "through": [[5000, 0], [5020, 12], [5042, 15], [5063, 8], [5080, -6]], "in_order": True}
    within = {"AB.length": [5, 8], "BC.length": [70, 90]}
    found = planar.synthesise(task("four-bar", wanted, within=within, demands=[{"transmission": 30}]), many=1)[0]
    numbers = planar.dimensions(found.mechanism)
    for name, (low, high) in within.items():
        assert low * 1e-3 - 1e-9 <= numbers[name] <= high * 1e-3 + 1e-9
    assert found.greatest_miss < 0.05 * 80e-3


def test_what_is_to_be_met_exactly_is_met_to_round_off_beside_what_is_not(few_designs):
    exact = {"point": "E", "through": [[0, 0], [20, 12]], "tolerance": 0}
    rest = {"point": "F", "through": [[5 * k, 30 + k * (9 - k)] for k in range(10)]}
    found = planar.synthesise(task("four-bar", exact, rest), many=1)[0]
    mechanism = planar.loads(planar.dumps(found.mechanism))
    for at, place in zip(found.inputs[0], [[0, 0], [0.02, 0.012]], strict=True):
        np.testing.assert_allclose(planar.solve(mechanism, {"A": float(at)}).point("E").position, place, atol=1e-10)
    assert found.misses[1].max() > 1e-6


def test_more_than_can_be_met_exactly_is_refused_with_both_counts():
    exact = {"point": "E", "through": [[k, k * k] for k in range(12)], "tolerance": 0}
    with pytest.raises(planar.BadInput, match="12 conditions, and only 9 independent numbers are free") as problem:
        planar.synthesise(task("four-bar", exact))
    assert problem.value.place == "$.wanted"
    assert "\n" not in problem.value.sentence


@pytest.mark.parametrize(
    ("demand", "words"),
    [
        ({"inside": [[-1, -1], [1, 1]]}, ("the region: the best design leaves it by", "mm")),
        ({"transmission": 89.99}, ("the transmission angle of 89.99 deg: the best design reaches", "deg less")),
    ],
)
def test_a_refusal_names_the_demand_and_how_near_designs_come(few_designs, monkeypatch, demand, words):
    monkeypatch.setattr("planar.synthesis.fitting.design_fit.MAX_STEPS", 8)  # how near they come does not matter
    wanted = {"point": "E", "through": [[0, 0], [20, 12], [42, 15]], "in_order": True}
    found = planar.synthesise(task("slider-crank", wanted, demands=["whole turn", demand]), many=1)
    assert not len(found)
    for each in ("no design without a defect; in the way is", *words):
        assert each in found.remarks[-1]


def test_a_closed_curve_is_not_met_by_a_crank_that_does_not_turn_fully():
    """What goes round a closed curve is judged as if the whole turn were demanded."""
    closed = planar.read_task(task("four-bar", {"point": "E", "through": SQUARE, "closed": True}))
    mechanism = planar.load("four-bar")
    inputs = planar.cycle(mechanism, 12).inputs["A"].position[2:6]
    judge = DesignJudge(closed, 0.02)
    defects = judge.judge(mechanism, [inputs], [closed.wanted[0].places]).defects
    assert any(each.demand == "the whole turn" for each in defects)


def test_a_point_that_does_little_better_than_one_at_rest_does_not_do_what_is_wanted():
    wanted = planar.read_task(task("four-bar", {"point": "E", "through": SQUARE})).wanted[0]
    middle = np.broadcast_to(wanted.places.mean(axis=0), wanted.places.shape)
    np.testing.assert_allclose(resting_misses(wanted, 1.0), entry_misses(wanted, middle, 1.0))
    np.testing.assert_allclose(resting_misses(wanted, 1.0), 0.01 * np.sqrt(2.0))
