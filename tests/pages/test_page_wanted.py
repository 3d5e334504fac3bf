"""What is wanted of a mechanism on its page: dragged, missed by what Python says, and followed to Python's optimum."""

from __future__ import annotations

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

import planar
from planar.pages.data.page_data import page_data
from planar.pages.data.wanted_data import PageTask, wanted_data
from planar.pages.page import page
from planar.synthesis.task.synthesis_task import WantedFunction, WantedPath, WantedPoses
from tests.command import run
from tests.draws import covering
from tests.known import MODELS
from tests.page_scripts import in_node, needs_node

SCRIPTS = ("solve/course.js", "solve/slopes.js", "wanted/wanted_fit.js", "wanted/wanted.js")
FIT = """
  page.data.wanted = WANTED;
  page.wanted = Wanted.of(page);
  const courses = new Courses(page), work = courses.find();
  courses.work = null;
  for (;;) { const { done, value } = work.next(); if (done) { page.course = value; break; } }
  const { fit } = page.wanted;
  fit.assign(page.course);
  page.wanted.stale = false;
  const before = page.wanted.misses().map(({ miss, turned }) => [miss, turned ?? 0]);
  if (GO) fit.improve(Infinity);
  return {
    before, after: page.wanted.misses().map(({ miss, turned }) => [miss, turned ?? 0]), cost: fit.least,
    values: Object.fromEntries(fit.free.map(({ k }) => [page.data.dimensions[k].name, fit.d[k]])),
    inputs: fit.entries.map(({ made }) => made.u[0] * made.scale[0]),
  };
"""


def wanted_path(point, places, inputs=None, weights=None, **more):
    """Places that a point is to come to."""
    given = np.ones(len(places)) if weights is None else weights
    return WantedPath(point, np.array(places, dtype=float), inputs, given, **more)


def wanted_poses(link, motion, origin, rows):
    """Some poses of a link over a motion."""
    angles = motion.link(link).angle[rows]
    return WantedPoses(link, motion.point(origin).position[rows], angles, None, np.ones(len(angles)))


def fitted(mechanism, task, go=True):
    """What the page makes of a task."""
    wanted = wanted_data(mechanism, page_data(mechanism)[0], task)
    act = FIT.replace("WANTED", json.dumps(wanted)).replace("GO", json.dumps(go))
    return in_node({"": mechanism}, act, *SCRIPTS)[""]


def path_of(mechanism, point, rows):
    """Some places of a point over the motion."""
    return planar.cycle(mechanism, 60).point(point).position[rows]


RECOVERED = [
    ("hoeken-straight-line", "P", {"crank.length": 1.06, "rocker.length": 0.97, "coupler.length": 1.02}, 7),
    ("slider-crank", "E", {"crank.length": 0.95, "rod.length": 1.05, "rod.E.distance": 1.1}, 9),
    ("klann-leg", "foot", {"leg.foot.x": 1.2, "crank.C.x": 1.01}, 6),
]


@needs_node
@pytest.mark.parametrize(
    ("model", "point", "factors", "every", "timed"),
    covering(((*case, timed) for case in RECOVERED for timed in (False, True)), lambda case: {case[0], case[-1]}),
)
def test_lost_dimensions_are_found_again(model, point, factors, every, timed):
    nominal = MODELS[model]
    numbers = planar.dimensions(nominal)
    motion = planar.cycle(nominal, 60)
    rows = slice(3, 58, every)
    given = nominal.inputs[0].pair
    inputs = motion.inputs[given].position[rows] - 0.3 if timed else None  # the zero is free
    wanted = wanted_path(point, motion.point(point).position[rows], inputs, in_order=True)
    start = nominal.with_values({name: numbers[name] * by for name, by in factors.items()})
    found = fitted(start, PageTask([wanted], dict.fromkeys(factors)))
    size = np.ptp(wanted.places)
    assert max(miss for miss, _ in found["before"]) > 1e-3 * size
    assert max(miss for miss, _ in found["after"]) < 1e-8 * size
    for name in factors:
        assert found["values"][name] == pytest.approx(numbers[name], rel=1e-6)
    # the general path has the point there, too
    for at, position in [*zip(wanted.places, found["inputs"], strict=True)][::3]:
        there = planar.solve(nominal.with_values(found["values"]), {given: position}).point(point).position
        assert np.abs(there - at).max() < 1e-7 * size


@needs_node
def test_misses_are_distances_from_the_path():
    mechanism = MODELS["hoeken-straight-line"]
    places = path_of(mechanism, "P", slice(0, 60, 7)) * 1.04
    found = fitted(mechanism, PageTask([wanted_path("P", places)]), go=False)
    dense = planar.cycle(mechanism, 7200).point("P").position
    near = np.hypot(*(places[:, None] - dense[None]).transpose(2, 0, 1)).min(axis=1)
    np.testing.assert_allclose([miss for miss, _ in found["before"]], near, rtol=1e-4)


@needs_node
@pytest.mark.parametrize("bounds", [None, (0.075, 0.0765)])
def test_what_cannot_be_met_is_missed_as_little_as_scipy_finds(bounds):
    mechanism = MODELS["hoeken-straight-line"]
    rng = np.random.default_rng(5)
    motion = planar.cycle(mechanism, 60)
    rows = slice(2, 60, 6)
    places = motion.point("P").position[rows] + rng.normal(0.0, 0.01, (10, 2))
    inputs = motion.inputs["O"].position[rows]
    free = ["crank.length", "coupler.length", "frame.C.x", "frame.C.y"]
    own = planar.dimensions(mechanism)
    low, high = bounds or (0.0, 1.0)
    limits = [(0.0 if "length" in name else -1.0, 2.0) for name in free]
    limits[0] = (low * own["crank.length"] / 0.075, high * own["crank.length"] / 0.075)
    weights = np.arange(1.0, 11.0)
    wanted = wanted_path("P", places, inputs, weights, is_absolute=True)
    found = fitted(mechanism, PageTask([wanted], dict(zip(free, limits, strict=True))))
    size = np.ptp(places, axis=0).max()

    def residual(values):
        one = planar.sweep(mechanism, {name: [value] for name, value in zip(free, values, strict=True)}, steps=60)
        off = (one.position["P"][0][rows] - places) / size
        return (np.sqrt(weights)[:, None] * off).ravel()

    start = np.clip([own[name] for name in free], *np.transpose(limits))
    best = least_squares(residual, start, bounds=np.transpose(limits), xtol=1e-12, ftol=1e-12, gtol=1e-12)
    assert found["cost"] == pytest.approx(2.0 * best.cost, rel=1e-4)
    for (least, most), name in zip(limits, free, strict=True):
        assert least - 1e-12 <= found["values"][name] <= most + 1e-12


@needs_node
def test_poses_and_functions_are_met():
    mechanism = planar.load("four-bar")
    numbers = planar.dimensions(mechanism)
    motion = planar.cycle(mechanism, 30)
    rows = slice(4, 28, 8)
    poses = wanted_poses("BC", motion, "B", rows)
    start = mechanism.with_values({"AB.length": 0.048, "BC.length": 0.069, "AD.D.x": 0.097})
    found = fitted(start, PageTask([poses], dict.fromkeys(["AB.length", "BC.length", "AD.D.x", "AD.D.y"])))
    assert max(max(map(abs, each)) for each in found["after"]) < 1e-8
    assert found["values"]["AD.D.x"] == pytest.approx(numbers["AD.D.x"], rel=1e-6)
    rows = slice(2, 29, 3)
    values = motion.pair("D")["relative_angle"][rows]
    inputs = motion.inputs["A"].position[rows] + 0.1
    function = WantedFunction("A", "D", inputs, values - 2.0, np.ones(len(values)))
    start = mechanism.with_values({"DC.length": 0.0575, "BC.length": 0.067})
    found = fitted(start, PageTask([function], dict.fromkeys(["DC.length", "BC.length"])))
    assert found["values"]["DC.length"] == pytest.approx(numbers["DC.length"], rel=1e-5)
    assert max(abs(miss) for miss, _ in found["after"]) < 1e-7


def test_what_is_not_there_is_refused():
    mechanism = MODELS["four-bar"]
    data, one = page_data(mechanism)[0], np.zeros(1)
    path = wanted_path("E", [[0.0, 0.0]])
    for task, why in (
        (PageTask([path._replace(point="Q")]), "there is no point 'Q'"),
        (PageTask([WantedPoses("AD", path.places, one, None, one)]), "no moving link 'AD'"),
        (PageTask([WantedFunction("A", "Q", one, one, one)]), "there is no pair 'Q'"),
        (PageTask([WantedFunction("B", "D", one, one, one)]), "of the input 'A'"),
        (PageTask([path], {"AB.lenth": None}), "no number of that name"),
    ):
        with pytest.raises(planar.BadInput, match=why):
            wanted_data(mechanism, data, task)
    assert wanted_data(mechanism, data, None) is None
    told = wanted_data(mechanism, data, PageTask([path], {"AD.D.x": None, "A.position": None}))
    assert told["unmoved"] == ["A.position"]
    assert [data["dimensions"][each["k"]]["name"] for each in told["free"]] == ["AD.D.x"]


LID = {
    "planar": 1,
    "name": "Lid",
    "units": {"length": "mm", "angle": "deg"},
    "start": "four-bar",
    "wanted": [
        {"point": "E", "through": [[40, 40], [52, 45], [60, 48]], "in_order": True, "tolerance": 0.5},
        {"link": "BC", "poses": [{"at": [10, 48], "angle": 10}]},
        {"from": "A", "to": "D", "pairs": [[50, 90], [60, 97]]},
    ],
    "free": ["BC.length", "AD.D", "BC.E"],
    "within": {"BC.length": [60, 80]},
}


def test_a_task_is_shown_under_a_mechanism(tmp_path):
    file = tmp_path / "lid.json"
    file.write_text(json.dumps(LID))
    made = run(tmp_path, "view", "four-bar", "--task", "lid.json", "-o", "page.html").done().strip()
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert made.endswith("page.html")
    data = json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)[1])
    wanted = data["wanted"]
    assert [each["kind"] for each in wanted["items"]] == ["path", "poses", "function"]
    np.testing.assert_allclose(wanted["items"][0]["places"], [[0.04, 0.04], [0.052, 0.045], [0.06, 0.048]])
    names = {data["dimensions"][each["k"]]["name"]: (each["low"], each["high"]) for each in wanted["free"]}
    assert set(names) == {"BC.length", "AD.D.x", "AD.D.y", "BC.E.x", "BC.E.y"}
    assert names["BC.length"] == pytest.approx((0.06, 0.08))
    assert planar.view(planar.solve("four-bar"), tmp_path / "again.html", task=LID).is_file()
    refused = run(tmp_path, "view", "four-bar", "--task", "lid.json", "-o", "lid.html", "--set", "AB.length=1 m")
    assert refused.status == 1  # it has no position
    assert run(tmp_path, "view", "slider-crank", "--task", "lid.json", "-o", "lid.html").status == 2
    with pytest.raises(planar.BadInput, match="no input"):
        planar.view(replace(planar.load("four-bar"), inputs=()), tmp_path / "page.html", task=LID)


@pytest.fixture
def shown(taken, tmp_path):
    """Shows the page of a mechanism with a task: its window, once the design follows."""

    def show(mechanism, task, has_touch=False):
        window = taken(has_touch=has_touch)
        path = tmp_path / "page.html"
        path.write_text(page(mechanism, wanted=task), encoding="utf-8")
        window.goto(path.as_uri())
        until(window, "page.wanted.fit.ready")
        return window

    return show


def until(window, true):
    """Wait for something, looked at frame by frame: a page evaluates no text later on."""
    look = f"const look = () => ({true}) ? go() : requestAnimationFrame(look); look();"
    window.evaluate(f"new Promise((go) => {{ {look} }})")


def drawn(window):
    """Wait for two frames."""
    window.evaluate("new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go)))")


def done(window):
    """Wait until the design follows no more, and is shown."""
    until(window, "!page.wanted.waits && !page.wanted.stale && page.course !== null")
    drawn(window)


def grip(window, which):
    box = window.locator(f'[data-wanted="{which}"]').bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


HOEKEN = MODELS["hoeken-straight-line"]
PIVOTS = [f"frame.{name}.{axis}" for name in "OC" for axis in "xy"]
PLACES = path_of(HOEKEN, "P", slice(0, 60, 15))


def misses(window):
    return window.evaluate("page.wanted.misses().map(({ miss }) => miss)")


def test_a_place_is_dragged_and_the_design_follows_and_comes_back(shown):
    window = shown(HOEKEN, PageTask([wanted_path("P", PLACES, in_order=True, tolerance=1e-3)]))
    own = window.evaluate("[...page.linkage.d]")
    assert max(misses(window)) < 1e-9
    x, y = grip(window, "0 2")
    window.mouse.move(x, y)
    window.mouse.down()
    for k in range(1, 9):
        window.mouse.move(x + 3 * k, y - 4 * k)
    scale = window.evaluate("page.view.scale")
    window.mouse.up()
    done(window)
    at = window.evaluate("page.wanted.items[0].places[2]")
    np.testing.assert_allclose(at, PLACES[2] + np.array([24.0, 32.0]) / scale, atol=1.5 / scale)
    assert max(misses(window)) < 1e-6
    assert window.evaluate("[...page.linkage.d]") != own
    assert "Place 3 of P" in window.locator("#said").inner_text()
    table = window.locator("#wanted tbody tr").nth(2).locator("input").first
    assert float(table.input_value()) == pytest.approx(1e3 * at[0], rel=1e-5)
    # what the page has come to is what Python makes of its file
    values = window.evaluate("Object.fromEntries(page.data.dimensions.map(({ name }, k) => [name, page.linkage.d[k]]))")
    path = planar.cycle(HOEKEN.with_values(values), 3600).point("P").position
    assert np.hypot(*(path - at).T).min() < 1e-3 * np.ptp(path)
    window.get_by_role("button", name="Undo").click()
    done(window)
    assert window.evaluate("[...page.linkage.d]") == own
    np.testing.assert_array_equal(window.evaluate("page.wanted.items[0].places[2]"), PLACES[2])
    window.get_by_role("button", name="Redo").click()
    done(window)
    np.testing.assert_array_equal(window.evaluate("page.wanted.items[0].places[2]"), at)


def test_arrow_keys_and_numbers_move_a_place(shown):
    window = shown(HOEKEN, PageTask([wanted_path("P", PLACES)]))
    one = window.locator('[data-wanted="0 1"]')
    one.focus()
    assert "place 2 wanted of P" in one.get_attribute("aria-label")
    scale = window.evaluate("page.view.scale")
    window.keyboard.press("Shift+ArrowUp")
    window.keyboard.press("ArrowRight")
    done(window)
    moved = window.evaluate("page.wanted.items[0].places[1]")
    np.testing.assert_allclose(moved, PLACES[1] + np.array([2.0, 20.0]) / scale, rtol=0, atol=1.0 / scale)
    assert window.evaluate("document.activeElement.dataset.wanted") == "0 1"
    assert max(misses(window)) < 1e-6
    field = window.locator("#wanted tbody tr").nth(1).locator("input").first
    field.fill("150")
    field.press("Enter")
    done(window)
    assert window.evaluate("page.wanted.items[0].places[1][0]") == pytest.approx(0.15)
    window.get_by_role("button", name="As in the task").click()
    done(window)
    np.testing.assert_array_equal(window.evaluate("page.wanted.items[0].places[1]"), PLACES[1])


def test_without_following_only_the_misses_change(shown):
    window = shown(HOEKEN, PageTask([wanted_path("P", PLACES, tolerance=1e-3)]))
    window.get_by_label("The dimensions follow").uncheck()
    own = window.evaluate("[...page.linkage.d]")
    window.locator('[data-wanted="0 0"]').focus()
    window.keyboard.press("Shift+ArrowUp")
    drawn(window)
    assert window.evaluate("[...page.linkage.d]") == own
    assert misses(window)[0] > 0.01
    assert window.locator("#wanted tr.over").count() == 1
    assert "1 beyond the tolerance" in window.locator("#wanted p[role=status]").inner_text()
    window.get_by_role("button", name="Improve").click()
    done(window)
    assert misses(window)[0] < 1e-6


def test_a_closed_curve_is_dragged_as_a_whole_by_touch(shown):
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    middle = np.array([0.2, 0.42])
    places = middle + np.stack([0.2 * np.cos(turn), 0.05 * np.sin(turn)], axis=1)
    task = PageTask([wanted_path("P", places, is_closed=True)], dict.fromkeys(PIVOTS))
    window = shown(HOEKEN, task, has_touch=True)
    assert window.locator("#drawing .wanted path.curve").count() == 1
    spots = "page.wanted.items[0].places.slice(5, 7).map(page.view.toScreen)"
    box, scale = window.locator("#drawing").bounding_box(), window.evaluate("page.view.scale")
    x, y = np.mean(window.evaluate(spots), axis=0) + np.array([box["x"], box["y"]])
    before = window.evaluate("Math.hypot(...page.linkage.d)")
    touch = window.context.new_cdp_session(window)
    touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
    for k in range(1, 6):
        touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [{"x": x + 6 * k, "y": y + 2 * k}]})
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    done(window)
    moved = np.array(window.evaluate("page.wanted.items[0].places")) - places
    np.testing.assert_allclose(moved, np.broadcast_to(moved[0], moved.shape), atol=1e-12)
    assert moved[0][0] > 20.0 / scale
    assert window.evaluate("Math.hypot(...page.linkage.d)") != before


def test_a_pose_is_turned_by_its_arm(shown):
    mechanism = planar.load("four-bar")
    motion = planar.cycle(mechanism, 30)
    rows = slice(8, 28, 9)
    poses = wanted_poses("BC", motion, "B", rows)
    window = shown(mechanism, PageTask([poses]))
    assert window.locator("#drawing .wanted path.ghost").count() == len(poses.angles)
    x, y = grip(window, "0 1 turn")
    window.mouse.move(x, y)
    window.mouse.down()
    window.mouse.move(x - 5, y - 8)
    window.mouse.move(x - 10, y - 15)
    window.mouse.up()
    done(window)
    turned = window.evaluate("page.wanted.items[0].angles[1]") - poses.angles[1]
    assert 0.1 < turned < 1.0
    assert max(window.evaluate("page.wanted.misses().map(({ turned }) => Math.abs(turned))")) < 1e-4
    window.locator('[data-wanted="0 1 turn"]').focus()
    window.keyboard.press("ArrowUp")
    done(window)
    assert window.evaluate("page.wanted.items[0].angles[1]") - poses.angles[1] == pytest.approx(turned + np.pi / 180)


def test_a_dimension_changed_by_hand_changes_the_misses(shown):
    window = shown(HOEKEN, PageTask([wanted_path("P", PLACES)]))
    window.evaluate("page.changeTo(page.linkage.d.map((each, k) => each * (k === 4 ? 1.03 : 1)))")
    done(window)
    values = window.evaluate("Object.fromEntries(page.data.dimensions.map(({ name }, k) => [name, page.linkage.d[k]]))")
    path = planar.cycle(HOEKEN.with_values(values), 7200).point("P").position
    near = np.hypot(*(PLACES[:, None] - path[None]).transpose(2, 0, 1)).min(axis=1)
    np.testing.assert_allclose(misses(window), near, atol=1e-6)
