"""Position diagrams and loci: joints in equal divisions against closed forms, paths, letters, dead centres, scales."""

import re
from dataclasses import replace
from math import hypot, isfinite, pi

import numpy as np
import pytest

import planar
from planar.drawing.diagrams.drawn_run import smooth_path
from planar.drawing.diagrams.positions import loci, positions
from planar.drawing.paper.picture import Circle, Label, Pen, Polyline, extent
from planar.drawing.paper.scales import Scale
from planar.foundation.errors import BadInput, NoAnswer
from planar.model.mechanism import Drive, replace_inputs
from tests.closed_forms import piston
from tests.known import MODELS

PER_MM = 1e-3
FULL = Scale("length", PER_MM, "mm")


def marked(picture, name, what="position of"):
    return np.array(
        [mark.centre for mark in picture.marks if isinstance(mark, Circle) and mark.about == f"{what} {name}"]
    )


def path(picture, name):
    (line,) = [mark for mark in picture.marks if isinstance(mark, Polyline) and mark.about == f"path {name}"]
    assert line.pen is Pen.PATH
    return np.array(line.points)


def letters(picture):
    return {mark.text: mark for mark in picture.marks if isinstance(mark, Label)}


@pytest.fixture(scope="module")
def twelve():
    return positions(planar.load("004-SC12"), scale=FULL)


def test_the_joints_stand_where_the_closed_form_has_them(twelve):
    turn = np.arange(13) * pi / 6.0
    crank = 30.0 * np.column_stack([np.cos(turn), np.sin(turn)])
    wrist = np.column_stack([piston(turn, 30.0, 100.0)[0], np.zeros(13)])
    assert marked(twelve, "A") == pytest.approx(crank, abs=1e-9)
    assert marked(twelve, "B") == pytest.approx(wrist, abs=1e-9)
    assert marked(twelve, "D") == pytest.approx(crank + 0.3 * (wrist - crank), abs=1e-9)


def test_joints_are_lettered_by_their_positions_and_those_that_coincide_together(twelve):
    found = letters(twelve)
    assert {"$A_{0}$, $A_{12}$", "$B_{0}$, $B_{12}$", "$D_{0}$, $D_{12}$", "O"} <= found.keys()
    assert {f"$A_{{{k}}}$" for k in range(1, 12)} <= found.keys()
    assert {f"$B_{{{k}}}$, $B_{{{12 - k}}}$" for k in range(1, 6)} | {"$B_{6}$"} <= found.keys()
    assert found["$A_{3}$"].at == pytest.approx((0.0, 30.0), abs=1e-9)
    assert found["$A_{3}$"].math
    assert not found["O"].math


def test_the_links_are_drawn_thin_in_every_position_but_the_first(twelve):
    thin = [mark for mark in twelve.marks if isinstance(mark, Polyline) and mark.pen is Pen.POSITION]
    cranks = [np.array(mark.points) for mark in thin if mark.about == "link OA"]
    assert len(cranks) == 11
    for k, spots in enumerate(cranks, start=1):
        ends = {tuple(np.round(spot, 9) + 0.0) for spot in spots}
        crank = 30.0 * np.array([np.cos(k * pi / 6.0), np.sin(k * pi / 6.0)])
        assert ends == {(0.0, 0.0), tuple(np.round(crank, 9) + 0.0)}
    strong = [
        mark for mark in twelve.marks if isinstance(mark, Polyline) and mark.pen is Pen.LINK and mark.about == "link OA"
    ]
    assert len(strong) == 1


def test_the_ground_is_drawn_once(twelve):
    one = positions(planar.load("004-SC12"), 1, scale=FULL)
    for picture in (twelve, one):
        grounds = [mark.points for mark in picture.marks if isinstance(mark, Polyline) and mark.pen is Pen.GROUND]
        assert len(grounds) == len(set(grounds))
    assert sum(mark.pen is Pen.GROUND for mark in twelve.marks if not isinstance(mark, Label)) == sum(
        mark.pen is Pen.GROUND for mark in one.marks if not isinstance(mark, Label)
    )


def test_paths_run_through_exact_positions(twelve):
    crank = path(twelve, "A")
    assert len(crank) >= 361
    assert np.hypot(*crank.T) == pytest.approx(30.0)
    piston, rod = path(twelve, "B"), path(twelve, "D")
    assert np.hypot(*(piston - crank).T) == pytest.approx(100.0)
    assert rod == pytest.approx(crank + 0.3 * (piston - crank))


def test_dead_centres_are_named_at_the_ends_of_the_slide(twelve):
    ends = {mark.text: mark.at[0] for mark in twelve.marks if isinstance(mark, Label) and mark.text in ("TDC", "BDC")}
    assert ends == pytest.approx({"TDC": 130.0, "BDC": 70.0})
    lines = [mark for mark in twelve.marks if isinstance(mark, Polyline) and mark.about.startswith(("TDC", "BDC"))]
    assert [line.points[0] for line in lines] == [pytest.approx((130.0, 0.0)), pytest.approx((70.0, 0.0))]
    assert twelve.notes[0] == "Position 0: top dead centre (TDC) of stroke, the input O at 0 deg"


def test_position_0_of_the_quick_return_is_its_top_dead_centre():
    """The ram turns back where the crank is at a right angle to the lever: 90 degrees less asin(OA/OC) from OC."""
    picture = positions(planar.load("004-QR"), scale=FULL)
    crank, ram = marked(picture, "A"), marked(picture, "R")
    centre = np.array([0.0, -250.0])
    assert crank[0] @ (crank[0] - centre) == pytest.approx(0.0, abs=1e-9)
    assert ram[:, 0].max() == pytest.approx(ram[0, 0])
    assert np.degrees(np.arctan2(*crank[0, ::-1])) == pytest.approx(-np.degrees(np.arcsin(100.0 / 250.0)))


def test_a_clockwise_crank_is_numbered_in_its_sense():
    picture = positions(planar.load("002-E3.4"), scale=FULL)
    turn = np.unwrap(np.arctan2(*marked(picture, "A").T[::-1]))
    assert np.diff(turn) == pytest.approx(-pi / 6.0)


def test_a_rocking_input_is_divided_from_limit_to_limit():
    picture = positions(planar.load("000-P3"), scale=FULL)
    crank = marked(picture, "A")
    turn = np.unwrap(np.arctan2(*crank.T[::-1]))
    assert np.degrees(turn[0]) == pytest.approx(48.19, abs=0.01)
    assert np.diff(turn) == pytest.approx(np.full(12, (2.0 * pi - 2.0 * turn[0]) / 12.0))
    assert {"$A_{0}$", "$A_{12}$", "$B_{0}$", "$B_{12}$"} <= letters(picture).keys()
    rocker = path(picture, "B") - (200.0, 0.0)
    assert np.hypot(*rocker.T) == pytest.approx(300.0, abs=0.02)
    assert np.hypot(*np.diff(rocker, axis=0).T).max() < 20.0


def test_a_number_of_positions_may_be_asked_for():
    picture = positions(planar.load("004-SC12"), 8, scale=FULL)
    assert len(marked(picture, "A")) == 9
    assert "$A_{0}$, $A_{8}$" in letters(picture)
    assert "45 deg" in picture.notes[1]


def test_only_the_points_that_are_named_are_lettered():
    picture = positions(planar.load("004-SC12"), points=["AB.D"], scale=FULL)
    assert len(marked(picture, "D")) == 13
    assert not len(marked(picture, "A"))
    assert {text for text in letters(picture) if not text.startswith("$D")} == {"O", "TDC", "BDC"}


def test_names_that_are_no_plain_letters_are_never_mathtext():
    mechanism = planar.from_dict(
        {
            "planar": 1,
            "name": "arm",
            "frame": "f",
            "links": {"f": {"points": {"O": [0, 0]}}, "arm": {"ends": ["O", "$x_{"], "length": 1}},
            "pairs": [{"turning": "O"}],
            "inputs": [{"pair": "O", "position": 0}],
        }
    )
    found = letters(positions(mechanism, 4))
    assert found["$x_{₀, $x_{₄"].math is False


def test_many_joints_do_not_drown_the_drawing_in_letters():
    picture = positions(planar.cycle(planar.load("chain-42"), 24))
    assert sum(isinstance(mark, Label) for mark in picture.marks) < 160


def test_loci_default_to_the_points_of_couplers_with_tracers_first():
    picture = loci(planar.load("002-E3.1"))
    names = [mark.about.removeprefix("path ") for mark in picture.marks if mark.about.startswith("path ")]
    assert list(dict.fromkeys(names)) == ["E", "F"]
    assert {"path of E", "path of F"} <= letters(picture).keys()


def test_a_locus_is_the_path_of_its_point_to_scale():
    mechanism = planar.load("hoeken-straight-line")
    picture = loci(planar.cycle(mechanism, 48), scale=FULL)
    (name,) = {mark.about for mark in picture.marks if mark.about.startswith("path ") and isinstance(mark, Polyline)}
    name = name.removeprefix("path ")
    spots = path(picture, name)
    assert len(spots) >= 361
    start = mechanism.inputs[0].position
    turns = start + np.sign(mechanism.inputs[0].velocity or 1.0) * 2.0 * pi * np.arange(len(spots)) / (len(spots) - 1)
    motion = planar.cycle(mechanism, len(spots) - 1, float(turns[0]), float(turns[-1]))
    assert spots == pytest.approx(motion.point(name).position / PER_MM, abs=1e-7)
    marks = marked(picture, name, "mark of")
    assert marks == pytest.approx(spots[:: (len(spots) - 1) // 12])


def test_loci_show_the_mechanism_once_in_the_position_of_its_file():
    mechanism = planar.load("four-bar")
    picture = loci(mechanism, ["E"], FULL)
    pins = {
        mark.about: mark.centre for mark in picture.marks if isinstance(mark, Circle) and mark.about.startswith("pin ")
    }
    state = planar.solve(mechanism)
    assert set(pins) == {"pin A", "pin B", "pin C", "pin D"}
    for about, centre in pins.items():
        assert centre == pytest.approx(tuple(state.point(about[-1]).position / PER_MM))


def test_geared_links_are_followed_until_they_are_back():
    """The wheels have 30 and 20 teeth: the second crank is back after two turns of the first."""
    picture = loci(planar.load("geared-five-bar"), ["P"])
    spots = path(picture, "P")
    assert hypot(*(spots[-1] - spots[0])) < 1e-6
    half = spots[(len(spots) - 1) // 2]
    assert hypot(*(half - spots[0])) > 5.0
    assert "720 deg" in picture.notes[0]


def test_a_path_is_smooth_beside_a_limit():
    """Beside a limit a path turns sharply in few steps of the input; what is between them stays on the coupler."""
    mechanism = planar.load("four-bar")
    picture = loci(mechanism, ["B", "C"], FULL)
    for name, centre, radius in (("B", "A", 50.0), ("C", "D", 56.0)):
        spots = path(picture, name)
        away = planar.solve(mechanism).point(centre).position / PER_MM
        assert np.hypot(*(spots - away).T) == pytest.approx(radius, abs=0.05)
        assert np.hypot(*np.diff(spots, axis=0).T).max() < 4.0


@pytest.mark.parametrize("draw", [positions, loci])
def test_names_that_are_not_there_are_refused(draw):
    with pytest.raises(BadInput, match=re.escape("there is no point 'Z'; points are O, A")):
        draw(planar.load("004-SC12"), points=["Z"])
    with pytest.raises(BadInput, match="name one point at least"):
        draw(planar.load("004-SC12"), points=[])


@pytest.mark.parametrize("count", [0, 73, 1.5, True])
def test_a_count_that_cannot_be_drawn_is_refused(count):
    with pytest.raises(BadInput, match="a whole number of positions from 1 to 72"):
        positions(planar.load("004-SC12"), count)


def test_a_mechanism_without_inputs_is_refused_in_a_sentence():
    mechanism = replace(planar.load("004-SC12"), inputs=())
    for draw in (positions, loci):
        with pytest.raises(NoAnswer, match="with 0 inputs links 'OA', 'AB' and 'block B' can still move"):
            draw(mechanism)


def test_a_mechanism_without_a_speed_is_drawn_alike(twelve):
    still = replace_inputs(planar.load("004-SC12"), (Drive("O", None, 0.0, 0.0),))
    assert marked(positions(still, scale=FULL), "B") == pytest.approx(marked(twelve, "B"))


SOME = sorted(stem for stem, mechanism in MODELS.items() if mechanism.inputs)[::9]


@pytest.mark.parametrize("model", SOME)
def test_drawings_of_models_fit_the_paper(model):
    mechanism = planar.load(model)
    given = mechanism.inputs[0]
    try:
        motion = planar.cycle(mechanism, 24, pair=given.pair)
    except BadInput:
        motion = planar.cycle(mechanism, 24, given.position, given.position + 0.05, given.pair)
    for picture, widest in ((positions(motion), 290.0), (loci(motion), 240.0)):
        (left, low), (right, high) = extent(picture.marks)
        assert all(map(isfinite, (left, low, right, high)))
        assert 5.0 < max(right - left, high - low) < widest


def test_paths_are_rounded_off_by_the_root_of_the_way_to_a_limit():
    """A parabola whose parameter is the root of the input's: the corners between its rows lie on it too."""
    root = np.sqrt(np.arange(60.0))
    rows = np.column_stack([root, root**2 - root])
    rates = np.ones((60, 2))
    limit = np.vstack([[np.nan, np.nan], rates[1:]])
    for at, rate in ((rows, limit), (rows[::-1], limit[::-1])):
        path = smooth_path(at, rate)
        assert path[:, 1] == pytest.approx(path[:, 0] ** 2 - path[:, 0], abs=1e-9)
        assert len(path) > 70
        assert path[[0, -1]] == pytest.approx(at[[0, -1]])
    assert smooth_path(rows, rates) is not rows
    assert smooth_path(rows, rates) == pytest.approx(rows)
    short = smooth_path(rows[:7], np.vstack([limit[:6], [np.nan, np.nan]]))
    assert short[[0, -1]] == pytest.approx(rows[[0, 6]])
