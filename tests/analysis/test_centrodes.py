"""Centrodes: they touch in the pole and roll on each other; closed forms; infinity, limits, links at rest; drawings."""

import json
from dataclasses import replace
from itertools import pairwise
from math import hypot, pi

import numpy as np
import pytest

import planar
from planar.analysis.centres.centrodes import (
    Centrode,
    _split_at_infinity,
    centre_path,
    centrodes,
    links_of_centre,
    usual_links,
)
from planar.analysis.relative_motion import quarter_turn
from planar.drawing.centres.centrodes import DRAWING_SIZE, MAX_WINDOW_RATIO, centrodes_picture
from planar.drawing.paper.clipping import clip_homogeneous_curve, remove_repeated_strokes
from planar.drawing.paper.pens import pen_style
from planar.drawing.paper.picture import Circle, Label, Pen, Polyline, extent
from planar.drawing.paper.scales import Scale
from planar.foundation.errors import BadInput, Unknown
from planar.model.mechanism import Drive, replace_inputs
from tests import command
from tests.draws import first_cases
from tests.known import MODELS, some_models

RANGES = {
    "davis-steering": (-0.05, 0.05),
    "rack-differential": (0.0, 0.2),
    "rapsons-slide": (-0.2, 0.2),
    "rolling-wheel": (-0.3, 1.5),
    "screw-jack": (0.0, 0.05),
}
"""m: inputs that slide without limits."""


def run(model, steps=48):
    mechanism = MODELS[model]
    start, stop = RANGES.get(model, (None, None))
    return planar.cycle(mechanism, steps, start, stop, mechanism.inputs[0].pair)


def turned(vectors, angle):
    return np.cos(angle)[:, None] * vectors + np.sin(angle)[:, None] * quarter_turn(vectors)


def distances(places, centre):
    return np.hypot(*(places - np.asarray(centre)).T)


@pytest.mark.parametrize("model", some_models(4))
def test_both_curves_touch_in_the_pole_and_run_through_it_at_one_velocity(model):
    found = centrodes(run(model), *usual_links(MODELS[model]))
    if found.reason:
        assert not found.arcs
        return
    assert sum(map(len, found.arcs)) > len(found.fixed.inputs) // 2
    fixed, moving = found.fixed, found.moving
    for rows in found.arcs:
        for row in rows[:: max(len(rows) // 3, 1)]:
            reach = 1.0 + hypot(*fixed.position[row])
            assert found.placed(row)[row] == pytest.approx(fixed.position[row], abs=1e-9 * reach)
        # rolling: the pole runs along both curves alike, so tangents and lengths are the same
        along, rolled = fixed.velocity[rows], turned(moving.velocity[rows], found.motion.angle[rows])
        known = np.isfinite(along[:, 0])
        assert known[1:-1].all()
        assert rolled[known] == pytest.approx(along[known], rel=1e-9, abs=1e-9 * np.abs(along[known]).max(initial=1e-3))


@pytest.mark.parametrize(
    ("model", "link", "other"),
    [
        ("crank-rocker", "coupler", None),
        ("slotted-lever", "CD", "OA"),
        ("drag-link", "coupler", None),
        ("jansen-leg", None, None),
    ],
)
def test_arcs_between_two_positions_are_as_long_on_both_curves_and_chords_come_to_that_at_second_order(
    model, link, other
):
    link, other = (link, other) if link else usual_links(MODELS[model])
    apart, lengths = [], []
    for steps in (240, 480, 960):
        motion = run(model, steps)
        found = centrodes(motion, link, other)
        # the same finite stretch each time: a sixteenth of the range in the middle of the longest arc of the coarsest
        if not apart:
            rows = max(found.arcs, key=len)
            middle = int(rows[len(rows) // 2])
            first, last = middle - 15, middle + 15
        else:
            first, last = 2 * first, 2 * last
        both = [
            np.hypot(*np.diff(curve.position[first : last + 1], axis=0).T).sum()
            for curve in (found.fixed, found.moving)
        ]
        apart.append(both[0] - both[1])
        lengths.append(both)
    orders = np.log2(np.abs(np.array(apart[:-1]) / np.array(apart[1:])))
    assert orders == pytest.approx([2.0, 2.0], abs=0.1)
    assert abs(apart[-1]) < 1e-4 * lengths[-1][0]
    # extrapolated, nothing is left of the difference
    assert abs(4.0 * apart[2] - apart[1]) / 3.0 < 1e-2 * abs(apart[2])


@pytest.mark.parametrize("model", ["four-bar", "slotted-lever", "cardan-gears", "crank-rocker"])
def test_rates_are_those_of_the_curve_and_the_curve_between_rows_is_exact_to_the_fourth_order(model):
    link, other = usual_links(MODELS[model])
    coarse, fine = (centrodes(run(model, steps), link, other) for steps in (60, 120))
    finest = centrodes(run(model, 240), link, other)
    for which in ("fixed", "moving"):
        wrong = []
        for found, more, by in ((coarse, fine, 2), (fine, finest, 2)):
            curve, exact = getattr(found, which), getattr(more, which)
            inner = found.known[2:-2]
            between = curve.curve(inner, by)[1::2]
            there = exact.homogeneous[by * inner[:-1] + 1]
            between, there = (each / np.linalg.norm(each, axis=1)[:, None] for each in (between, there))
            wrong.append(np.linalg.norm(np.cross(between, there), axis=1))
        # the worst places of the coarse steps are those of the fine ones
        assert np.log2(np.sqrt((wrong[0] ** 2).mean() / (wrong[1] ** 2).mean())) > 3.5
        assert wrong[1].max() < 1e-4


@pytest.mark.parametrize(
    ("model", "link", "radius"), [("elliptical-trammel", "bar", 60e-3), ("cardan-gears", "wheel", 50e-3)]
)
def test_cardan_circles_have_the_ratio_two(model, link, radius):
    found = centrodes(run(model), link)
    assert len(found.known) == 49  # at the limits of the trammel too
    assert distances(found.fixed.position, (0.0, 0.0)) == pytest.approx(np.full(49, 2.0 * radius))
    centre = (radius, 0.0) if link == "bar" else (0.0, 0.0)
    assert distances(found.moving.position, centre) == pytest.approx(np.full(49, radius))


def test_beside_a_limit_the_curve_between_rows_is_a_parabola_in_the_root_of_the_way_to_it():
    wrong = []
    for steps in (100, 400, 1600):
        found = centrodes(run("elliptical-trammel", steps), "bar")
        assert np.isnan(found.fixed.rate[[0, -1]]).all()
        ends = [found.fixed.curve(rows, 8) for rows in (np.array([0, 1]), np.array([steps - 1, steps]))]
        wrong.append([np.abs(distances(end[:, :2] / end[:, 2:], (0.0, 0.0)) - 0.12).max() / 0.12 for end in ends])
    # the root of a step is halved: third order, where straight lines have the second
    assert np.log2(np.array(wrong[:-1]) / np.array(wrong[1:])).min() > 2.8


def test_a_rolling_wheel_has_its_rail_and_its_rim():
    found = centrodes(run("rolling-wheel"), "wheel")
    assert found.fixed.position[:, 1] == pytest.approx(np.zeros(49), abs=1e-12)
    assert found.fixed.position[:, 0] == pytest.approx(found.fixed.inputs)
    assert distances(found.moving.position, (0.0, 0.0)) == pytest.approx(np.full(49, 0.2))
    assert found.fixed.velocity == pytest.approx(np.tile([1.0, 0.0], (49, 1)), abs=1e-12)


def test_gears_have_their_pitch_circles_outside_and_inside():
    motion = run("planetary-gear-set")
    for link, other, radii in (("planet", "sun", (20e-3, 40e-3)), ("planet", "frame", (20e-3, 80e-3))):
        found = centrodes(motion, link, other)
        assert distances(found.moving.position, (0.0, 0.0)) == pytest.approx(np.full(49, radii[0]))
        assert distances(found.fixed.position, (0.0, 0.0)) == pytest.approx(np.full(49, radii[1]))


def test_cranks_of_an_antiparallelogram_roll_as_ellipses_about_their_pivots_and_the_coupler_as_a_hyperbola():
    motion = run("antiparallelogram")
    found = centrodes(motion, "follower", "crank")
    (rows,) = found.arcs
    for places in (found.fixed.position[rows], found.moving.position[rows]):
        # the foci are the pivots of each crank: its ends, the second 60 mm along the x-axis
        assert distances(places, (0.0, 0.0)) + distances(places, (0.06, 0.0)) == pytest.approx(np.full(len(rows), 0.1))
    # they mirror each other in the common tangent
    chords = (np.hypot(*np.diff(curve.position[rows], axis=0).T) for curve in (found.fixed, found.moving))
    assert next(chords) == pytest.approx(next(chords), rel=1e-6)
    coupler = centrodes(motion, "coupler")
    assert len(coupler.arcs) == 3  # the first and the last are one, over the seam of the turn
    for rows in coupler.arcs:
        for places in (coupler.fixed.position[rows], coupler.moving.position[rows]):
            apart = distances(places, (0.0, 0.0)) - distances(places, (0.1, 0.0))
            assert np.abs(apart) == pytest.approx(np.full(len(rows), 0.06), rel=1e-6)


def test_the_pole_of_a_coupler_lies_on_both_cranks_at_the_limits_too():
    motion = run("four-bar")
    found = centrodes(motion, "BC")
    assert np.isnan(motion.link("BC").angular_velocity[[0, -1]]).all()
    assert len(found.known) == 49
    poles = found.fixed.homogeneous
    for fixed, end in (("A", "B"), ("D", "C")):
        first, second = (np.column_stack([motion.point(name).position, np.ones(49)]) for name in (fixed, end))
        line = np.cross(first, second)
        line /= np.linalg.norm(line, axis=1)[:, None]
        assert (line * poles).sum(axis=1) == pytest.approx(np.zeros(49), abs=1e-12)


def test_centres_of_single_positions_are_on_the_curve():
    found = centrodes(run("crank-rocker", 12), "coupler")
    for row in range(0, 12, 5):
        state = planar.solve(MODELS["crank-rocker"], {"A0": float(found.fixed.inputs[row])})
        centre = planar.centres(state)["coupler", state.mechanism.frame]
        assert found.fixed.position[row] == pytest.approx(centre.position, abs=1e-9)


@pytest.mark.parametrize("duration", [None, 0.5])
@pytest.mark.parametrize("links", [("coupler", "frame"), ("rocker", "crank"), ("coupler", "crank")])
def test_the_path_of_a_centre_goes_through_the_centres_of_single_positions(links, duration):
    """Over the range of the input, and in time; in the axes of the frame, also of two links that both move."""
    motion = planar.cycle(MODELS["crank-rocker"], 12, duration=duration)
    path = centre_path(motion, *links)
    for row in range(0, 12, 5):
        state = planar.solve(MODELS["crank-rocker"], {"A0": float(motion.inputs["A0"].position[row])})
        centre = planar.centres(state)[links]
        assert path.position[row] == pytest.approx(centre.position, abs=1e-9)
        assert path.name == centre.name
        assert np.isnan(path.direction[row])
    assert path.homogeneous.shape == (13, 3)


def test_both_links_have_one_velocity_along_the_path_of_their_centre_where_several_inputs_run():
    motion = planar.cycle("excavator-arm", 4, duration=0.5)
    path = centre_path(motion, "bucket", "boom")
    velocities = []
    for link in ("bucket", "boom"):
        frame = motion.frames[link]
        x, y, angle = (np.stack(np.broadcast_arrays(*part.parts[:2])) for part in (frame.x, frame.y, frame.angle))
        away = path.position - np.stack([x[0], y[0]], axis=1)
        velocities.append(np.stack([x[1], y[1]], axis=1) + angle[1][:, None] * quarter_turn(away))
    assert np.isfinite(path.position).any()
    assert velocities[0] == pytest.approx(velocities[1], abs=1e-12, nan_ok=True)


def test_a_centre_is_at_infinity_where_the_rod_only_slides():
    path = centre_path(planar.cycle("slider-crank", 12, pi / 2.0, pi), "rod", "frame")
    assert np.isnan(path.position[0]).all()
    assert abs(np.sin(path.direction[0])) == pytest.approx(1.0)
    assert np.isfinite(path.position[1:]).all()


def test_a_centre_is_named_by_numbers_or_names_of_its_links():
    mechanism = MODELS["four-bar"]
    for text in ("24", "I24", "2,4", "BC,AD", "AD, BC", "I2,4"):
        assert {*links_of_centre(mechanism, text)} == {"BC", "AD"}
    many = MODELS["rotary-engine"]
    assert links_of_centre(many, "I1,12") == links_of_centre(many, "1,12")
    for text in ("44", "I5", "BC", "BC,BC", "", "BC,nothing"):
        with pytest.raises(Unknown, match="there is no centre"):
            links_of_centre(mechanism, text)


def test_the_command_lists_writes_and_prints_the_path_of_a_centre(tmp_path):
    words = ("centres", "slider-crank", "--cycle", "--steps", "4")
    text = command.run(tmp_path, *words, "--of", "24", "--of", "rod,crank").done()
    assert "I24 x" in text
    assert "I12 y" in text
    path = centre_path(planar.cycle("slider-crank", 4), "rod")
    record = json.loads(command.run(tmp_path, *words, "--of", "I24", "--json").done())
    assert np.array(record["centres"]["I24"]["position"]) == pytest.approx(path.position)
    command.run(tmp_path, *words, "--of", "24", "-o", "path.csv").done()
    head, *rows = [line.split(",") for line in (tmp_path / "path.csv").read_text(encoding="utf-8").splitlines()]
    assert head[-2:] == ["centre I24 x [mm]", "centre I24 y [mm]"]
    assert np.array([row[-2:] for row in rows], dtype=float) == pytest.approx(1e3 * path.position)
    command.run(tmp_path, *words, "--of", "24", "-o", "path.txt").done()
    assert "I24 x" in (tmp_path / "path.txt").read_text(encoding="utf-8")
    assert "--of: name the centre" in command.run(tmp_path, *words).refused(2)
    assert "--of: there is no centre '55'" in command.run(tmp_path, *words, "--of", "55").refused(2)
    for extra in (("--of", "24"), ("--steps", "3"), ("--from", "1deg")):
        assert f"{extra[0]}: this is for the path" in command.run(tmp_path, "centres", "four-bar", *extra).refused(2)


@pytest.mark.parametrize(("model", "link"), [("crank-rocker", "coupler"), ("four-bar", "BC"), ("002-E3.6a", "AC")])
def test_arcs_are_cut_where_the_link_slides_without_turning_and_nowhere_else(model, link):
    motion = run(model, 360)
    found = centrodes(motion, link)
    turning = motion.link(link).angular_velocity
    changes = np.flatnonzero(turning[:-1] * turning[1:] < 0.0)
    assert len(changes) >= 1
    assert len(found.arcs) == len(changes) + 1
    assert [int(arc[-1]) for arc in found.arcs[:-1]] == changes.tolist()
    assert found.fixed.velocity.shape == (361, 2)


def test_a_row_at_infinity_belongs_to_no_arc():
    # a crank at 90 degrees: the rod of a slider-crank in line slides only
    motion = planar.cycle(MODELS["slider-crank"], 8, 0.0, 2.0 * pi)
    found = centrodes(motion, "rod")
    assert found.fixed.homogeneous[[2, 6], 2].tolist() == [0.0, 0.0]
    assert np.isnan(found.fixed.position[[2, 6]]).all()
    assert [arc.tolist() for arc in found.arcs] == [[0, 1], [3, 4, 5], [7, 8]]
    # it lies square to the velocity, which is along the slide
    assert found.fixed.homogeneous[2, 0] == pytest.approx(0.0, abs=1e-12)


def test_a_pole_that_passes_through_infinity_twice_between_two_rows_is_cut_there():
    inputs = np.array([0.0, 1.0])
    at, rate = np.array([[1.0, 0.0, 0.1]] * 2), np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    assert [arc.tolist() for arc in _split_at_infinity(Centrode(inputs, at, rate))] == [[0], [1]]
    assert [arc.tolist() for arc in _split_at_infinity(Centrode(inputs, at, 0.0 * rate))] == [[0, 1]]


def test_a_rocker_that_rests_in_passing_turns_about_its_pin_all_the_while():
    motion = run("crank-rocker", 360)
    turning = motion.link("rocker").angular_velocity
    assert (turning[:-1] * turning[1:] < 0.0).sum() == 2
    found = centrodes(motion, "rocker")
    assert found.arcs == ()
    assert "one point" in found.reason
    places = found.fixed.position
    assert np.nanmax(np.ptp(places[np.isfinite(places[:, 0])], axis=0)) < 1e-9


def test_links_that_only_slide_or_move_as_one_are_said_to():
    assert "always at infinity" in centrodes(run("slider-crank"), "piston").reason
    assert "always at infinity" in centrodes(run("three-parallel-cranks"), "rod").reason
    motion = run("planetary-gear-set")
    frozen = replace(motion, frames=motion.frames | {"sun": motion.frames["arm"]})
    found = centrodes(frozen, "sun", "arm")
    assert "move as one" in found.reason
    assert np.isnan(found.fixed.homogeneous).all()


def test_the_rate_of_the_input_does_not_matter():
    mechanism = MODELS["crank-rocker"]
    found = [
        centrodes(planar.cycle(replace_inputs(mechanism, (Drive("A0", None, *rates),)), 90), "coupler")
        for rates in ((6.0, 0.0), (-2.0, 11.0), (0.0, 0.0))
    ]
    for each in found[1:]:
        for which in ("fixed", "moving"):
            one, other = getattr(found[0], which), getattr(each, which)
            assert np.abs((one.homogeneous * other.homogeneous).sum(axis=1)) == pytest.approx(
                (one.homogeneous**2).sum(axis=1), rel=1e-9
            )
            assert other.velocity == pytest.approx(one.velocity, rel=1e-6, abs=1e-9, nan_ok=True)


def test_seen_the_other_way_round_the_moving_centrode_is_the_fixed_one():
    motion = run("slotted-lever")
    one, other = centrodes(motion, "CD", "OA"), centrodes(motion, "OA", "CD")
    assert one.fixed.position == pytest.approx(other.moving.position, nan_ok=True)
    assert one.moving.position == pytest.approx(other.fixed.position, nan_ok=True)


def test_names_that_are_not_there_are_refused():
    motion = run("four-bar", 4)
    with pytest.raises(Unknown, match="no link 'XY'"):
        centrodes(motion, "XY")
    with pytest.raises(Unknown, match="both are 'BC'"):
        centrodes(motion, "BC", "BC")
    with pytest.raises(BadInput, match="no link 'XY'"):
        centrodes_picture(MODELS["four-bar"], "BC", "XY")


@pytest.mark.parametrize(
    ("model", "links"),
    [
        ("four-bar", ("BC", "AD")),
        ("planetary-gear-set", ("planet", "frame")),
        ("gear-reducer", ("countershaft", "input shaft")),
        ("single-link", ("link", "frame")),
        ("slider-crank", ("rod", "frame")),
    ],
)
def test_the_usual_links_are_a_coupler_and_the_frame_or_two_that_are_pinned(model, links):
    assert usual_links(MODELS[model]) == links


FULL = Scale("length", 1e-3, "mm")


def strokes(picture, pen):
    return [np.array(mark.points) for mark in picture.marks if isinstance(mark, Polyline) and mark.pen is pen]


def beside(lines, at):
    """How far a spot is from the nearest side of some lines (mm)."""
    best = np.inf
    for line in lines:
        start, way = line[:-1], np.diff(line, axis=0)
        part = np.clip(((at - start) * way).sum(axis=1) / (way**2).sum(axis=1), 0.0, 1.0)
        best = min(best, distances(start + part[:, None] * way, at).min())
    return best


def pole(picture):
    (mark,) = [mark for mark in picture.marks if isinstance(mark, Circle) and mark.about.startswith("pole")]
    return np.array(mark.centre)


@pytest.mark.parametrize(
    ("model", "links"),
    first_cases(
        [
            ("elliptical-trammel", ()),
            ("antiparallelogram", ("follower", "crank")),
            ("four-bar", ()),
            ("slider-crank", ()),
            ("planetary-gear-set", ()),
            ("002-E3.6a", ()),  # never comes back, and its slide does not turn back in the file's position
            ("antiparallelogram", ()),
            ("slotted-lever", ()),
            ("hoeken-straight-line", ()),
        ],
        6,
    ),
)
def test_both_curves_are_drawn_touching_in_the_pole_inside_the_paper(model, links):
    picture = centrodes_picture(MODELS[model], *links)
    fixed, moving = (strokes(picture, pen) for pen in (Pen.FIXED_CENTRODE, Pen.MOVING_CENTRODE))
    at = pole(picture)
    assert beside(fixed, at) < 0.02
    assert beside(moving, at) < 0.02
    low, high = (np.array(corner) for corner in extent(mark for mark in picture.marks if not isinstance(mark, Label)))
    assert np.all(high - low <= np.array(DRAWING_SIZE) * 1.35)
    texts = {mark.text for mark in picture.marks if isinstance(mark, Label)}
    assert {"fixed centrode", "moving centrode"} <= texts
    assert any(text.startswith("$I_") for text in texts)


def test_round_positions_of_the_input_are_marked_on_both_centrodes():
    """The dots of the fixed centrode are the centres at these positions; those of the moving one lie as far apart."""
    mechanism = MODELS["cardan-gears"]
    picture = centrodes_picture(mechanism, scale=FULL)
    dots = {
        mark.about: np.array(mark.centre) for mark in picture.marks if isinstance(mark, Circle) and " at " in mark.about
    }
    fixed, moving = (
        [f"{pen.value} at {30 * k}" for k in range(12)] for pen in (Pen.FIXED_CENTRODE, Pen.MOVING_CENTRODE)
    )
    assert set(dots) == {*fixed, *moving}
    marks = [mark for mark in picture.marks if isinstance(mark, Circle) and mark.about in dots]
    assert not any(pen_style(mark).dashes for mark in marks)  # a dashed ring as small as that would be an arc
    link, frame = usual_links(mechanism)
    for name, degrees in ((fixed[1], 30.0), (fixed[8], 240.0)):
        state = planar.solve(mechanism, {mechanism.inputs[0].pair: np.radians(degrees)})
        assert dots[name] == pytest.approx(planar.centres(state)[link, frame].position / FULL.per_mm, abs=1e-3)
    sides = [[np.hypot(*(dots[a] - dots[b])) for a, b in pairwise(names)] for names in (fixed, moving)]
    # chords of equal arcs on circles of radii two to one
    assert sides[0] == pytest.approx([2.0 * np.hypot(*dots[fixed[0]]) * np.sin(pi / 12.0)] * 11, rel=1e-4)
    assert sides[1] == pytest.approx([np.hypot(*dots[fixed[0]]) * np.sin(pi / 6.0)] * 11, rel=1e-4)
    labels = {mark.text for mark in picture.marks if isinstance(mark, Label)}
    assert {str(30 * k) for k in range(12)} <= labels
    assert "Dots: positions of the input O in deg" in picture.notes
    assert not any(" at " in mark.about for mark in centrodes_picture(mechanism, marks=0).marks)
    with pytest.raises(BadInput, match="whole number of marks"):
        centrodes_picture(mechanism, marks=-1)


def test_cardan_circles_are_drawn_once_and_in_their_places():
    picture = centrodes_picture(MODELS["cardan-gears"], scale=FULL)
    (c,) = {mark.at for mark in picture.marks if isinstance(mark, Label) and mark.text == "C"}
    for pen, centre, radius in ((Pen.FIXED_CENTRODE, (0.0, 0.0), 100.0), (Pen.MOVING_CENTRODE, c, 50.0)):
        lines = strokes(picture, pen)
        for line in lines:
            assert distances(line, centre) == pytest.approx(np.full(len(line), radius), abs=0.01)
        length = sum(np.hypot(*np.diff(line, axis=0).T).sum() for line in lines)
        assert length == pytest.approx(2.0 * pi * radius, abs=1.5)


def test_curves_end_at_the_window_and_the_notes_say_that_they_go_on():
    picture = centrodes_picture(MODELS["crank-rocker"], scale=Scale("length", 5e-3, "mm"))
    lines = np.concatenate([*strokes(picture, Pen.FIXED_CENTRODE), *strokes(picture, Pen.MOVING_CENTRODE)])
    rest = [mark for mark in picture.marks if not isinstance(mark, Label)]
    rest = [mark for mark in rest if not (isinstance(mark, Polyline) and mark.pen.value.endswith("centrode"))]
    low, high = (np.array(corner) for corner in extent(rest))
    assert np.ptp(lines, axis=0).max() <= 1.1 * MAX_WINDOW_RATIO * (high - low).max()
    assert any("infinity" in note for note in picture.notes)


def test_where_the_pole_is_far_away_the_nearest_position_is_drawn_in_which_it_is_not():
    nearly = replace_inputs(MODELS["slider-crank"], (Drive("O", 1.5),))
    picture = centrodes_picture(nearly, scale=Scale("length", 20e-3, "mm"))
    assert beside(strokes(picture, Pen.FIXED_CENTRODE), pole(picture)) < 0.02
    (told,) = [note for note in picture.notes if note.startswith("Drawn with")]
    assert "O at" in told
    still = centrodes_picture(MODELS["cardan-gears"])
    assert not any(note.startswith("Drawn with") for note in still.notes)


def test_what_has_no_centrodes_is_drawn_without_and_the_notes_say_why():
    for links, why in ((("piston",), "at infinity"), (("crank",), "one point")):
        picture = centrodes_picture(MODELS["slider-crank"], *links)
        assert not strokes(picture, Pen.FIXED_CENTRODE)
        assert why in picture.notes[0]


def test_a_speed_that_the_file_does_not_give_is_not_drawn():
    (given,) = MODELS["four-bar"].inputs
    still = replace_inputs(MODELS["four-bar"], (Drive(given.pair, None, 0.0, 0.0),))
    picture = centrodes_picture(still)
    assert not [mark for mark in picture.marks if mark.about.startswith("input")]
    assert pole(picture) == pytest.approx(pole(centrodes_picture(MODELS["four-bar"])), abs=1e-6)


def test_a_polygon_is_clipped_to_a_window_and_parts_at_infinity():
    low, high = np.zeros(2), np.ones(2)
    (piece,) = clip_homogeneous_curve(np.array([[-1.0, 0.5, 1.0], [0.5, 0.5, 1.0], [0.5, 3.0, 1.0]]), low, high)
    assert piece == pytest.approx(np.array([[0.0, 0.5], [0.5, 0.5], [0.5, 1.0]]))
    through = np.array([[0.5, 0.5, 1.0], [0.5, 0.5, 0.1], [0.5, 0.5, -0.1], [-0.5, -0.5, -1.0]])
    first, last = clip_homogeneous_curve(through, low, high)
    assert first == pytest.approx(np.array([[0.5, 0.5], [1.0, 1.0]]))
    assert last[-1] == pytest.approx([0.5, 0.5])
    assert clip_homogeneous_curve(np.array([[2.0, 2.0, 1.0], [3.0, 3.0, 1.0]]), low, high) == ()


def test_what_runs_over_itself_is_drawn_once_and_what_crosses_itself_all():
    turn = np.linspace(0.0, 6.0 * pi, 4000)
    thrice = np.column_stack([20.0 * np.cos(turn), 20.0 * np.sin(turn)])
    length = sum(np.hypot(*np.diff(line, axis=0).T).sum() for line in remove_repeated_strokes([thrice]))
    assert length == pytest.approx(40.0 * pi, abs=1.0)
    eight = np.column_stack([30.0 * np.cos(turn / 3.0), 20.0 * np.sin(turn / 1.5)])
    whole = np.hypot(*np.diff(eight, axis=0).T).sum()
    assert sum(np.hypot(*np.diff(line, axis=0).T).sum() for line in remove_repeated_strokes([eight])) == pytest.approx(
        whole, abs=1.0
    )


def test_the_command_draws_them_and_refuses_what_are_no_two_links(tmp_path):
    file = tmp_path / "centrodes.svg"
    words = ("plot", "antiparallelogram", "centrodes")
    assert command.run(tmp_path, *words, "--link", "follower", "--link", "crank", "-o", file.name).done() == ""
    assert "centrodes of follower against crank" in file.read_text()
    for links, why in ((("a", "b", "c"), "two links"), (("coupler", "nothing"), "no link 'nothing'")):
        named = [word for link in links for word in ("--link", link)]
        assert why in command.run(tmp_path, *words, *named, "-o", file.name).refused(2)
