"""Drawings of instantaneous centres: marks at their places, lines through their centres, chords from link to link."""

from __future__ import annotations

import re
from functools import cache
from itertools import combinations, pairwise

import numpy as np
import pytest
from PIL import Image

import planar
from planar import plot
from planar.analysis.centres.centres import centres
from planar.document import files
from planar.drawing.centres.centres import DRAWING_SIZE, centres_picture
from planar.drawing.centres.choice import MAX_CENTRES, choose_centres
from planar.drawing.centres.circle_diagram import circle_picture, circle_radius
from planar.drawing.centres.two_directions import directions_picture
from planar.drawing.paper.picture import Arrow, Circle, Label, Pen, Polyline, extent
from planar.drawing.paper.scales import parse_scale
from tests.command import run
from tests.draws import covering, is_exhaustive
from tests.figures import visible_texts
from tests.known import MODELS as ALL
from tests.known import found_centres as found
from tests.known import some_models

MODELS = {stem: mechanism for stem, mechanism in ALL.items() if stem != "chain-42"}
every_model = pytest.mark.parametrize("stem", [stem for stem in some_models(3, 1) if stem in MODELS])
INSIDE = 1e-6


@cache
def shown(stem):
    return {each.name: each for each in choose_centres(found(stem))}


@cache
def space(stem):
    return centres_picture(found(stem), tuple(shown(stem).values()))


@cache
def diagram(stem):
    return circle_picture(found(stem), tuple(shown(stem).values()))


def per_mm(picture):
    """The scale (m/mm), read from the notes as a reader would."""
    return parse_scale(picture.notes[0].removesuffix(" (1:1)")).per_mm


def marks(picture, start, kind):
    return {mark.about: mark for mark in picture.marks if isinstance(mark, kind) and mark.about.startswith(start)}


def places(stem):
    """Every centre that is marked, in mm."""
    return {about[7:]: mark for about, mark in marks(space(stem), "centre ", Circle).items()}


def off(line, at):
    """How far a spot is from a straight line without ends (mm)."""
    start, stop = np.array(line.points)
    way = (stop - start) / np.hypot(*(stop - start))
    return abs(way[0] * (at[1] - start[1]) - way[1] * (at[0] - start[0]))


@every_model
def test_every_centre_is_marked_at_its_place_or_has_an_arrow_towards_it(stem):
    scale, picture = per_mm(space(stem)), space(stem)
    arrows = {about[6:]: arrow for about, arrow in marks(picture, "arrow ", Arrow).items()}
    circles = places(stem)
    for name, centre in shown(stem).items():
        if centre.homogeneous is None:
            assert name not in circles
            assert name not in arrows
            assert any(note.startswith(name) for note in picture.notes) or len(picture.notes) > 6
            continue
        assert (name in circles) != (name in arrows)
        if name in circles:
            assert circles[name].centre == pytest.approx(centre.position / scale, abs=INSIDE)
            continue
        arrow = arrows[name]
        way = np.subtract(arrow.head, arrow.tail)
        ahead = centre.direction if centre.position is None else centre.position / scale - arrow.head
        sine = (way[0] * ahead[1] - way[1] * ahead[0]) / np.hypot(*way) / np.hypot(*ahead)
        assert abs(sine) < 1e-6
        if centre.position is not None:
            assert way @ ahead > 0.0


@every_model
def test_lines_of_centres_pass_through_all_their_centres(stem):
    scale, picture = per_mm(space(stem)), space(stem)
    lines = marks(picture, ("line ", "normal "), Polyline)
    assert all(line.pen is Pen.CENTRE_LINE for line in lines.values())
    drawn = {said: line for about, line in lines.items() for said in about.split(", ")}
    for centre in shown(stem).values():
        for line in centre.lines:
            on = [shown(stem).get(name) for name in (*line.centres, centre.name)]
            told = f"line {' '.join(line.centres)}" if line.centres else f"normal at {line.pair}"
            ends = {mark for name, mark in drawn.items() if name == told}
            if any(each is None for each in on):
                continue
            for each in on:
                for mark in ends if line.centres else ():
                    if each.position is not None:
                        # one that lies far off is hit as exactly as the eye could tell here
                        far = np.hypot(*(each.position / scale - np.mean(mark.points, axis=0)))
                        assert off(mark, each.position / scale) < 0.06 + 1e-3 * far
                    else:
                        way = np.subtract(*mark.points) / np.hypot(*np.subtract(*mark.points))
                        assert abs(way[0] * each.direction[1] - way[1] * each.direction[0]) < 1e-3


@every_model
def test_both_lines_of_a_found_centre_run_through_its_mark(stem):
    lines = [mark for mark in space(stem).marks if isinstance(mark, Polyline) and mark.pen is Pen.CENTRE_LINE]
    for name, circle in places(stem).items():
        centre = shown(stem)[name]
        known = [line for line in centre.lines if all(each in shown(stem) for each in line.centres)]
        if centre.how == "pair" or not known:
            continue
        through = [line for line in lines if off(line, circle.centre) < 0.06]
        for line in known:
            told = f"line {' '.join(line.centres)}" if line.centres else f"normal at {line.pair}"
            (mark,) = (each for each in through if told in each.about.split(", "))
            # it does not end before the mark
            start, stop = np.array(mark.points)
            part = (np.array(circle.centre) - start) @ (stop - start) / ((stop - start) @ (stop - start))
            assert 0.0 < part < 1.0


@every_model
def test_strokes_stay_in_the_window_and_fit_the_page_beside_the_circle(stem):
    (left, low), (right, high) = extent(mark for mark in space(stem).marks if not isinstance(mark, Label))
    # symbols of links and arrows are as large on any scale
    assert right - left < DRAWING_SIZE[0] - 2.0 * circle_radius(len(found(stem).numbers)) + 60.0
    assert high - low < DRAWING_SIZE[1] + 60.0
    for mark in space(stem).marks:
        if isinstance(mark, Polyline) and mark.pen is Pen.CENTRE_LINE:
            for x, y in mark.points:
                assert left - INSIDE <= x <= right + INSIDE
                assert low - INSIDE <= y <= high + INSIDE


@every_model
def test_every_centre_is_lettered_at_its_spot(stem):
    letters = {
        name: letter
        for about, letter in marks(space(stem), "centre ", Label).items()
        for name in (each.removeprefix("centre ") for each in re.split(", (?=centre )", about))
    }
    assert set(letters) == {name for name, each in shown(stem).items() if each.homogeneous is not None}
    arrows = marks(space(stem), "arrow ", Arrow)
    for name, letter in letters.items():
        at = places(stem)[name].centre if name in places(stem) else arrows[f"arrow {name}"].head
        assert np.hypot(*np.subtract(letter.at, at)) <= 0.05 + INSIDE
        index = name[1:]
        assert f"$I_{{{index}}}$" in letter.text or "…" in letter.text
        assert ("∞" in letter.text or r"\infty" in letter.text) == any(
            shown(stem)[each.removeprefix("centre ")].direction is not None
            for each in re.split(", (?=centre )", letter.about)
        )


@every_model
def test_chords_join_the_points_of_their_links(stem):
    points = {about[5:]: mark.centre for about, mark in marks(diagram(stem), "link ", Circle).items()}
    assert set(points) == set(found(stem).numbers)
    pens = {"pair": Pen.CHORD, "Kennedy": Pen.CHORD_FOUND, "ratio": Pen.CHORD_FOUND, "equations": Pen.CHORD_SOLVED}
    for name, centre in shown(stem).items():
        parts = [mark for mark in diagram(stem).marks if isinstance(mark, Polyline) and mark.about == f"chord {name}"]
        if centre.homogeneous is None:
            assert not parts
            continue
        assert {mark.pen for mark in parts} == {pens[centre.how]}
        assert len(parts) == (1 if centre.how == "pair" else 2)
        assert parts[0].points[0] == pytest.approx(points[centre.links[0]])
        assert parts[-1].points[-1] == pytest.approx(points[centre.links[1]])
        # the gap is for the number, on the chord
        letters = marks(diagram(stem), "order of ", Label)
        assert (f"order of {name}" in letters) == (centre.how != "pair")
        if centre.how != "pair":
            letter = letters[f"order of {name}"]
            assert letter.text == str(centre.order)
            assert letter.at == pytest.approx(np.mean([parts[0].points[1], parts[1].points[0]], axis=0))
            assert off(Polyline((points[centre.links[0]], points[centre.links[1]]), Pen.CHORD), letter.at) < INSIDE


@every_model
def test_links_stand_evenly_on_the_circle_in_the_order_of_their_numbers(stem):
    numbers = found(stem).numbers
    around = [
        mark.centre
        for _, mark in sorted(
            marks(diagram(stem), "link ", Circle).items(), key=lambda item: int(numbers[item[0].removeprefix("link ")])
        )
    ]
    (circle,) = (mark for mark in diagram(stem).marks if mark.about == "circle")
    angles = np.unwrap([np.arctan2(y, x) for x, y in around])
    assert np.diff(angles) == pytest.approx([-2.0 * np.pi / len(around)] * (len(around) - 1))
    assert [np.hypot(*at) for at in around] == pytest.approx([circle.radius] * len(around))
    letters = marks(diagram(stem), "number of ", Label)
    assert {about[10:]: letter.text for about, letter in letters.items()} == dict(numbers)


@every_model
def test_no_two_marks_of_the_diagram_and_no_two_lines_are_drawn_twice(stem):
    for picture in (space(stem), diagram(stem)):
        seen = [
            (mark.about, mark.points)
            for mark in picture.marks
            if isinstance(mark, Polyline) and "entre" in mark.pen.value
        ]
        assert len(seen) == len(set(seen))
    lines = [
        mark for mark in space(stem).marks if isinstance(mark, Polyline) and mark.about.startswith(("line", "normal"))
    ]
    for one, other in combinations(lines, 2):
        assert max(off(one, at) for at in other.points) > 1e-3


def test_the_slider_crank_of_the_chapter_has_its_centre_above_the_slider():
    # 004: crank 160 mm at 40 degrees, rod 500 mm; C lies over A, on the crank produced
    picture, stem = space("004-EX-piston"), "004-EX-piston"
    scale = per_mm(picture)
    (x, y), slider = places(stem)["I24"].centre, found(stem).state.point("A").position / scale
    assert x == pytest.approx(slider[0])
    assert y == pytest.approx(slider[0] * np.tan(np.radians(40.0)))
    arrow = marks(picture, "arrow ", Arrow)["arrow I34"]
    assert arrow.head[0] == arrow.tail[0] == pytest.approx(slider[0])
    assert arrow.head[1] > arrow.tail[1] > y
    lines = marks(picture, "line ", Polyline)
    assert set(lines) == {"line I12 I23", "line I14 I34", "line I12 I14", "line I23 I34"}


def test_the_view_grows_to_a_centre_that_lies_a_picture_away_and_no_further_than_its_reach():
    """I13 of the four-bar lies twice as far from its frame as that is long."""
    picture = space("four-bar")
    assert places("four-bar")["I13"].centre == pytest.approx(
        found("four-bar")["AB", "DC"].position / per_mm(picture), abs=INSIDE
    )
    assert not marks(picture, "arrow ", Arrow)
    assert not any("outside" in note for note in picture.notes)
    for stem in ("four-bar", "whitworth", "jansen-leg", "slider-crank"):
        spots = np.array([circle.centre for circle in places(stem).values()])
        scheme_marks = [
            mark for mark in space(stem).marks if not str(mark.about).startswith(("centre", "line", "arrow"))
        ]
        drawn = np.array(extent(scheme_marks))
        size = np.ptp(drawn, axis=0).max()
        assert np.ptp(np.concatenate([drawn, spots]), axis=0).max() <= 3.2 * size


def test_centres_far_outside_have_their_coordinates_beside_the_arrow():
    picture = space("watt-1-six-bar")
    (far,) = (centre for centre in found("watt-1-six-bar") if centre.name == "I23")
    assert "arrow I23" in marks(picture, "arrow ", Arrow)
    (label,) = (mark for mark in picture.marks if isinstance(mark, Label) and mark.about == "centre I23")
    x, y = (1e3 * value for value in far.position)
    assert label.text == f"$I_{{23}}$ ({x:.4g}, {y:.4g}) mm".replace("-", "−")
    assert "Centres outside: coordinates in the axes of the frame" in picture.notes
    near = centres_picture(found("four-bar"), found("four-bar").all, reach=1.0)
    # on the x-axis of the frame, not at some 1e-14 above it
    (label,) = (mark for mark in near.marks if isinstance(mark, Label) and mark.about == "centre I13")
    assert label.text.endswith(", 0) mm")


def test_a_parallelogram_has_its_centres_at_infinity_along_its_cranks_and_coupler():
    stem = "three-parallel-cranks"
    arrows = marks(space(stem), "arrow ", Arrow)
    crank = found(stem).state.point("A").position - found(stem).state.point("A0").position
    way = np.subtract(arrows["arrow I25"].head, arrows["arrow I25"].tail)
    assert abs(way[0] * crank[1] - way[1] * crank[0]) < 1e-9
    assert "arrow I13" in arrows


def test_notes_tell_how_centres_were_found_and_leave_the_proof_to_the_text():
    notes = space("double-butterfly").notes
    assert notes[1] == "28 centres: 10 by pairs, 17 by Kennedy's theorem, 1 by loop equations"
    assert not any("proof" in note.lower() for note in notes)
    assert "Full: by pairs; dashed: by lines of centres; dash-dot: by equations" in diagram("double-butterfly").notes
    assert not any("left out" in note for note in notes)
    assert "20 of 36 centres are left out, and the lines through them" in space("stephenson-valve-gear").notes


def test_of_very_many_centres_those_of_pairs_and_of_the_frame_are_drawn():
    every = found("rotary-engine")
    picked, frame = choose_centres(every), every.state.mechanism.frame
    assert len(every) > MAX_CENTRES
    assert [each for each in every if each.how == "pair" or frame in each.links] == list(picked)
    (note,) = (note for note in space("rotary-engine").notes if note.startswith("At one place: "))
    assert len(note.split(", ")) == 28  # seven rods and the frame on one pin


def test_centres_are_chosen_by_links_with_what_their_lines_need():
    every = found("002-E3.4")
    names = {each.name for each in choose_centres(every, ["CD", "frame"])}
    (wanted,) = (each for each in every if set(each.links) == {"CD", "frame"})
    assert names == {wanted.name, *(name for line in wanted.lines for name in line.centres)}
    of_one = choose_centres(every, "EF")
    assert {each.name for each in every if "EF" in each.links} <= {each.name for each in of_one}
    with pytest.raises(planar.BadInput, match="X: there is no link of this name; links are OA, AB"):
        choose_centres(every, ["X"])


def test_inputs_at_rest_change_nothing_and_what_they_leave_open_is_said():
    state = planar.solve(MODELS["four-bar"], [planar.Drive("A", velocity=0.0, acceleration=0.0)])
    again = centres(state)
    still = marks(centres_picture(again, again.all), "centre ", Circle)
    assert set(still) == {f"centre {name}" for name in places("four-bar")}
    for name, circle in places("four-bar").items():
        assert still[f"centre {name}"].centre == pytest.approx(circle.centre, abs=INSIDE)
    arm = MODELS["open-arm"]
    rest = centres(planar.solve(arm, [planar.Drive(each.pair, velocity=0.0) for each in arm.inputs]))
    picture = centres_picture(rest, rest.all)
    assert picture.notes[1] == "6 centres: 3 by pairs, 3 of no place"
    assert sum("depends on the ratio of the inputs' rates" in note for note in picture.notes) == 3
    assert not marks(picture, "arrow ", Arrow)
    assert len(marks(circle_picture(rest, rest.all), "chord ", Polyline)) == 3


def test_a_scale_is_kept_and_a_wider_reach_shows_more():
    every = found("four-bar")
    near, far = (centres_picture(every, every.all, reach=reach) for reach in (1.0, 8.0))
    assert "centre I13" not in marks(near, "centre ", Circle)
    assert "centre I13" in marks(far, "centre ", Circle)
    figure = plot.centres(every.state, "1 cm = 25 mm", reach=1.2)
    assert "1 cm = 25 mm" in [text for text, _ in visible_texts(figure)]
    for wrong in (0.5, float("nan"), float("inf")):
        with pytest.raises(planar.BadInput, match="reach"):
            plot.centres(every.state, reach=wrong)


SAMPLE = (
    "four-bar",
    "002-E3.4",
    "jansen-leg",
    "double-butterfly",
    "three-parallel-cranks",
    "excavator-arm",
    "klann-leg",
)


@pytest.mark.parametrize("stem", SAMPLE)
def test_texts_lie_on_the_sheet_and_apart_and_the_circle_beside_or_below_the_scheme(stem):
    figure = plot.centres(found(stem).state)
    width, height = figure.get_size_inches() * figure.dpi
    said = visible_texts(figure)
    for text, box in said:
        assert min(box.x0, box.y0, width - box.x1, height - box.y1) > -1.0, text
    for (one, a), (other, b) in combinations(said, 2):
        across = min(a.x1, b.x1) - max(a.x0, b.x0)
        assert min(across, min(a.y1, b.y1) - max(a.y0, b.y0)) < 1.0, f"{one!r} lies on {other!r}"
    left, right = (axes.get_position() for axes in figure.axes)
    assert left.x1 < right.x0 or left.y0 > right.y1
    # every number of a chord is in the gap of its chord
    numbers = {mark.about: mark for mark in diagram(stem).marks if isinstance(mark, Label)}
    axes = figure.axes[1]
    drawn = {text.get_gid(): text for text in axes.texts}
    mids = [
        np.hypot(*np.subtract(axes.transData.inverted().transform(_middle(drawn[about])), mark.at))
        for about, mark in numbers.items()
        if about.startswith("order")
    ]
    assert sorted(mids)[len(mids) // 2] < 0.2
    assert all(one <= 2.0 for one in mids)


def _middle(text):
    box = text.get_window_extent()
    return (box.x0 + box.x1) / 2.0, (box.y0 + box.y1) / 2.0


def test_the_command_draws_centres_and_refuses_links_that_there_are_not(tmp_path):
    assert run(tmp_path, "plot", "002-E3.4", "centres", "--link", "CD", "--link", "frame", "-o", "a.png").done() == ""
    with Image.open(tmp_path / "a.png") as picture:
        assert min(picture.size) > 600
    sentence = run(tmp_path, "plot", "002-E3.4", "centres", "--link", "XY", "-o", "b.png").refused(2)
    assert "XY: there is no link of this name" in sentence
    assert not (tmp_path / "b.png").exists()


def test_a_circle_grows_with_its_links_up_to_a_limit():
    sizes = [circle_radius(count) for count in range(2, 60)]
    assert all(one <= other for one, other in pairwise(sizes))
    assert sizes[-1] == 48.0


def moving_links():
    stems = list(MODELS)[::5]
    for stem in dict.fromkeys([*stems[::3], *covering(stems, lambda stem: {*map(type, MODELS[stem].pairs)})]):
        mechanism, state = MODELS[stem], found(stem).state
        for link in state.frames:
            if link == mechanism.frame:
                continue
            try:
                yield stem, link, directions_picture(state, link), found(stem)[link, mechanism.frame]
            except planar.BadInput as problem:
                assert re.search("at rest|with two points", str(problem)), (stem, link)


def test_the_centre_from_two_directions_is_the_one_against_the_frame():
    count = 0
    for stem, link, picture, centre in moving_links():
        scale, at = per_mm(picture), marks(picture, "centre", Circle)
        lines = marks(picture, "normal ", Polyline)
        if centre.position is None:
            assert not at, (stem, link)
            assert any("at infinity" in note for note in picture.notes), (stem, link)
            continue
        for line in lines.values():
            far = np.hypot(*(centre.position / scale - line.points[0]))
            assert off(line, centre.position / scale) < 1e-6 * (1.0 + far) ** 2, (stem, link)
        if at:
            assert at["centre"].centre == pytest.approx(centre.position / scale, abs=1e-5), (stem, link)
            count += 1
        told = [float(note.split("= ")[-1].removesuffix(" rad/s")) for note in picture.notes if "ω = v / r at" in note]
        turning = abs(found(stem).state.link(link).angular_velocity)
        assert told == pytest.approx([turning] * len(told), rel=2e-3), (stem, link)
    assert count > (30 if is_exhaustive() else 10)


def arm(**points):
    value = {
        "planar": 1,
        "name": "arm",
        "frame": "frame",
        "links": {"frame": {"points": {"O": [0, 0]}}, "arm": {"points": {"O": [0, 0]} | points}},
        "pairs": [{"turning": "O"}],
        "inputs": [{"pair": "O", "position": 0.5, "velocity": 2.0}],
    }
    return planar.solve(files.from_dict(value))


@pytest.mark.parametrize(("one", "other"), [(1.0, 3.0), (3.0, 1.0), (-1.0, 2.0)])
def test_parallel_velocities_have_their_centre_on_the_line_through_the_heads(one, other):
    # the second case of chapter 004: both points and the centre in one line
    picture = directions_picture(arm(P=[one, 0.0], Q=[other, 0.0]), "arm", ("P", "Q"))
    assert marks(picture, "centre", Circle)["centre"].centre == pytest.approx((0.0, 0.0), abs=1e-9)
    (heads,) = marks(picture, "heads", Polyline).values()
    tips = [arrow.head for arrow in marks(picture, "velocity ", Arrow).values()]
    assert [off(heads, at) for at in (*tips, (0.0, 0.0))] == pytest.approx([0.0] * 3, abs=1e-9)
    assert sum(note.endswith("= 2 rad/s") for note in picture.notes) == 2


def test_the_rod_of_the_chapter_has_equal_quotients_of_velocity_and_radius():
    picture = directions_picture(found("004-EX-piston").state, "AB", ("A", "B"))
    scale, speed = per_mm(picture), float(picture.notes[1].split()[3]) / 10.0
    centre = np.array(marks(picture, "centre", Circle)["centre"].centre)
    for arrow in marks(picture, "velocity ", Arrow).values():
        way, ray = np.subtract(arrow.head, arrow.tail), centre - arrow.tail
        assert abs(way @ ray) < 1e-6 * np.hypot(*way) * np.hypot(*ray)
        assert np.hypot(*way) * speed / (np.hypot(*ray) * scale) == pytest.approx(118.041, rel=1e-5)


def test_a_construction_that_has_no_two_directions_is_refused():
    still = planar.solve(arm(P=[1.0, 0.0]).mechanism, [planar.Drive("O", velocity=0.0)])
    for state, link, points, said in (
        (still, "arm", None, "are at rest"),
        (arm(), "arm", None, "with two points"),
        (arm(P=[1.0, 0.0]), "lever", None, "there is no link of this name"),
        (arm(P=[1.0, 0.0]), "arm", ("P", "Z"), "arm has no point of this name; its points are O, P"),
        (arm(P=[1.0, 0.0]), "arm", ("P", "P"), "two different points"),
    ):
        with pytest.raises(planar.BadInput, match=said):
            directions_picture(state, link, points)
    assert plot.two_directions(arm(P=[1.0, 0.0]), "arm", scale=["1 cm = 200 mm", "1 cm = 1 m/s"]).axes
