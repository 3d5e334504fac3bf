"""Pictures of velocity and acceleration polygons: all at its place in millimetres, letters as in the chapters."""

from __future__ import annotations

import re
from functools import cache
from itertools import groupby
from math import hypot, isfinite

import numpy as np
import pytest

from planar.analysis.polygons.construction import acceleration_polygon, velocity_polygon
from planar.analysis.polygons.polygon import Meeting, PointImage, Polygon, SimultaneousSolution
from planar.document import files
from planar.drawing.paper.picture import Arrow, Circle, Label, Pen, Picture, Polyline, extent
from planar.drawing.paper.scales import DRAWING_HEIGHT, DRAWING_WIDTH, Scale, parse_scale
from planar.drawing.polygons.polygon import letter_text, polygon_picture
from planar.model.mechanism import Drive, named_points
from planar.solving.position import solve
from tests.builders import four_bar_document
from tests.known import MODELS, some_models, state_of

KINDS = {"velocity": velocity_polygon, "acceleration": acceleration_polygon}
LEGEND = "index 1: accelerations of points; other indices: ends of their parts"
CLOSED_MODELS = [
    stem
    for stem in some_models(3, 1)
    if MODELS[stem].closes_within is None and any(each.velocity for each in MODELS[stem].inputs)
]
"""Where pairs stay open by a misfit, polygons do so too, and of what rests there are none."""
every_model = pytest.mark.parametrize("stem", CLOSED_MODELS)
both_kinds = pytest.mark.parametrize("kind", KINDS)


@cache
def drawn(stem: str, kind: str) -> Polygon:
    state = state_of(stem)
    if all(np.hypot(*getattr(each, kind)) == 0.0 for each in state.points.values()):
        pytest.skip("nothing moves")
    return KINDS[kind](state)


@cache
def picture(stem: str, kind: str) -> Picture:
    return polygon_picture(drawn(stem, kind))


@cache
def per_mm(stem: str, kind: str) -> float:
    """The scale, read from the notes as a reader would."""
    _, told, _, *_ = picture(stem, kind).notes
    return parse_scale(told).per_mm


def of(stem, kind, about):
    (mark,) = (mark for mark in picture(stem, kind).marks if mark.about == about)
    return mark


def strokes(stem, kind, pen, mark=(Arrow, Polyline)):
    return [each for each in picture(stem, kind).marks if isinstance(each, mark) and getattr(each, "pen", None) is pen]


def ends(mark):
    return (mark.tail, mark.head) if isinstance(mark, Arrow) else mark.points


def at(stem, kind, letter):
    return drawn(stem, kind).letters[letter] / per_mm(stem, kind)


def near(one, other):
    return hypot(one[0] - other[0], one[1] - other[1]) < 1e-6


def relative_motions(polygon):
    for stage in polygon.stages:
        for side in stage.sides if isinstance(stage, Meeting) else ():
            for _, together in groupby(side.vectors, key=lambda vector: (vector.of, vector.against)):
                yield list(together)


@both_kinds
@every_model
def test_every_letter_stands_at_its_number_and_all_fits_the_paper(stem, kind):
    found, polygon = picture(stem, kind), drawn(stem, kind)
    letters = {mark.about: mark for mark in found.marks if isinstance(mark, Label)}
    few = polygon.pole[3:-1] if len(polygon.pole) > 8 else ()
    assert {*letters} >= {f"letter {letter}" for letter in polygon.letters if letter not in few}
    for letter, value in polygon.letters.items():
        if letter not in few:
            assert near(letters[f"letter {letter}"].at, value / per_mm(stem, kind))
    for letter in polygon.pole[:3]:
        assert letters[f"letter {letter}"].at == (0.0, 0.0)
    (left, low), (right, high) = extent(mark for mark in found.marks if not isinstance(mark, Circle))
    assert all(map(isfinite, (left, low, right, high)))
    # a tick may reach a millimetre over
    assert right - left < DRAWING_WIDTH + 2.3
    assert high - low < DRAWING_HEIGHT + 2.3
    assert found.title == polygon.state.mechanism.name


@every_model
def test_every_vector_of_velocity_is_an_arrow_of_its_length(stem):
    polygon, scale = drawn(stem, "velocity"), per_mm(stem, "velocity")
    arrows = {(mark.about, ends(mark)) for mark in strokes(stem, "velocity", Pen.VELOCITY, Arrow)}
    for (vector,) in relative_motions(polygon):
        if hypot(*vector.value) / scale < 0.1:
            continue
        tail = polygon.letters[vector.tail] / scale
        head = tail + vector.value / scale
        found = [each for about, each in arrows if about == f"velocity {vector.of}/{vector.against}"]
        assert any(near(start, tail) and near(stop, head) for start, stop in found)


@every_model
def test_accelerations_have_arrows_for_parts_and_strong_lines_for_totals(stem):
    polygon, scale = drawn(stem, "acceleration"), per_mm(stem, "acceleration")
    parts = strokes(stem, "acceleration", Pen.PART)
    totals = strokes(stem, "acceleration", Pen.ACCELERATION)
    assert all(isinstance(mark, Arrow) for mark in parts)
    for together in relative_motions(polygon):
        start, stop = (polygon.letters[each] / scale for each in (together[0].tail, together[-1].head))
        shown = [vector for vector in together if hypot(*vector.value) / scale > 0.05 + 1e-9]
        motion = f"{together[0].of}/{together[0].against}"
        if hypot(*(stop - start)) > 0.1:
            (total,) = (mark for mark in totals if mark.about == f"acceleration {motion}" and near(ends(mark)[1], stop))
            assert near(ends(total)[0], start)
            # between points that both move it is read both ways
            assert isinstance(total, Arrow) == (together[0].tail in polygon.pole or len(shown) < 2)
        if len(shown) < 2:
            assert not any(mark.about.endswith(f" {motion}") and near(mark.tail, start) for mark in parts)
            continue
        for vector in shown:
            ahead = vector.value / scale
            same = (mark for mark in parts if mark.about.endswith(f" {motion}"))
            (part,) = (mark for mark in same if near(mark.head, mark.tail + ahead))
            assert near(part.tail, polygon.letters[vector.tail] / scale)
            assert part.about == f"{vector.part.value} {motion}"


@both_kinds
@every_model
def test_strokes_are_drawn_once_and_join_letters(stem, kind):
    polygon, scale = drawn(stem, kind), per_mm(stem, kind)
    spots = [value / scale for value in polygon.letters.values()]
    seen = set()
    for mark in picture(stem, kind).marks:
        if not isinstance(mark, (Arrow, Polyline)) or mark.about.startswith("tick"):
            continue
        tail, head = ends(mark)
        assert hypot(tail[0] - head[0], tail[1] - head[1]) > 0.05
        for end in (tail, head):
            assert any(near(end, spot) for spot in spots)
        key = (mark.about, mark.pen, tuple(np.round(tail, 6)), tuple(np.round(head, 6)))
        assert key not in seen
        seen.add(key)


@both_kinds
@every_model
def test_images_are_triangles_similar_to_their_links(stem, kind):
    polygon, scale = drawn(stem, kind), per_mm(stem, kind)
    letter_of = {point: letter for letter, point in polygon.points.items()}
    names = polygon.state.point_names
    lines = [ends(mark) for mark in picture(stem, kind).marks if isinstance(mark, (Arrow, Polyline))]
    for stage in polygon.stages:
        if not isinstance(stage, PointImage) or not stage.sense:
            continue
        corners = [polygon.letters[letter_of[point]] / scale for point in (*stage.base, stage.point)]
        if stage.sense == "same":
            assert near(corners[0], corners[2])
            continue
        sides = [hypot(*(corners[k] - corners[k - 1])) for k in range(3)]
        if min(sides) < 0.1 or not all(point.rstrip("′") in names for point in (*stage.base, stage.point)):
            continue
        for k in range(3):
            both = corners[k], corners[k - 1]
            assert any({near(a, both[0]), near(b, both[1])} == {True} for line in lines for a, b in (line, line[::-1]))
        space = [polygon.state.point(point.rstrip("′")).position for point in (*stage.base, stage.point)]
        lengths = [hypot(*(space[k] - space[k - 1])) for k in range(3)]
        np.testing.assert_allclose(np.divide(sides, lengths), sides[0] / lengths[0], rtol=1e-6)


@both_kinds
def test_ticks_are_square_to_the_image_at_their_points(kind):
    stem, suffix = "002-E3.1", {"velocity": "", "acceleration": "_1"}[kind]
    (left, right), middle = of(stem, kind, f"tick e{suffix}").points, at(stem, kind, f"e{suffix}")
    way = at(stem, kind, f"c{suffix}") - at(stem, kind, f"b{suffix}")
    assert near(np.add(left, right) / 2.0, middle)
    assert abs(np.subtract(left, right) @ way) < 1e-9
    along = middle - at(stem, kind, f"b{suffix}")
    assert hypot(*along) / hypot(*way) == pytest.approx(40 / 66)


def test_the_image_of_a_produced_link_is_produced():
    line = of("002-E3.2", "velocity", "image AB")
    assert near(line.points[0], at("002-E3.2", "velocity", "a"))
    assert near(line.points[1], at("002-E3.2", "velocity", "e"))


def test_the_chapters_first_polygon_has_just_these_strokes():
    marks = [mark for mark in picture("002-E3.1", "acceleration").marks if not isinstance(mark, Label)]
    assert sorted((type(mark).__name__, mark.about) for mark in marks) == [
        ("Arrow", "acceleration B/A"),
        ("Arrow", "acceleration C/D"),
        *(("Arrow", f"centripetal {each}") for each in ("B/A", "C/B", "C/D")),
        *(("Arrow", f"tangential {each}") for each in ("B/A", "C/B", "C/D")),
        ("Circle", "pole"),
        ("Polyline", "acceleration C/B"),
        *[("Polyline", "image BC")] * 2,
        *[("Polyline", "image DC")] * 2,
        ("Polyline", "tick e_1"),
    ]
    texts = [mark.text for mark in picture("002-E3.1", "acceleration").marks if isinstance(mark, Label)]
    assert texts[:2] == ["$a_{1}$", "$d_{1}$"]
    assert {*texts} == {
        f"${each[0]}_{{{each[1]}}}$" for each in ["a1", "d1", "b1", "ba", "c1", "cb", "cd", "e1", "f1", "g1"]
    }
    texts = [mark.text for mark in picture("002-E3.1", "velocity").marks if isinstance(mark, Label)]
    assert sorted(texts) == [*"abcdefg"]


def test_a_total_of_one_part_is_drawn_once():
    arrow = of("002-E3.2", "acceleration", "acceleration A/O")
    assert near(arrow.head, at("002-E3.2", "acceleration", "a_1"))
    assert "centripetal A/O" not in [mark.about for mark in picture("002-E3.2", "acceleration").marks]


def test_crank_of_the_first_example_at_a_scale_that_is_given():
    polygon = drawn("002-E3.1", "velocity")
    found = polygon_picture(polygon, parse_scale("1 cm = 0.1 m/s"))
    (arrow,) = (mark for mark in found.marks if mark.about == "velocity B/A")
    # 10.5 rad/s at 50 mm: 0.525 m/s, a quarter turn ahead of 60 degrees
    assert arrow.tail == (0.0, 0.0)
    np.testing.assert_allclose(arrow.head, (-52.5 * np.sin(np.pi / 3), 52.5 * np.cos(np.pi / 3)))
    assert found.notes == ("Velocity polygon", "1 cm = 0.1 m/s", "μᵥ = 0.01 (m/s)/mm")
    found = polygon_picture(drawn("002-E3.1", "acceleration"), parse_scale("1 cm = 2 m/s^2"))
    assert found.notes == ("Acceleration polygon", "1 cm = 2 m/s²", "μₐ = 0.2 (m/s²)/mm", LEGEND)
    (arrow,) = (mark for mark in found.marks if mark.about == "centripetal B/A")
    assert hypot(*arrow.head) == pytest.approx(10.5**2 * 0.05 / 0.2)


@both_kinds
def test_what_does_not_move_is_a_pole_and_says_so(kind):
    mechanism = MODELS["002-E3.1"]
    polygon = KINDS[kind](solve(mechanism, [Drive("A", mechanism.inputs[0].position, 0.0, 0.0)]))
    found = polygon_picture(polygon)
    assert found.notes[-1] == {"velocity": "everything is at rest", "acceleration": "nothing is accelerated"}[kind]
    assert not [mark for mark in found.marks if isinstance(mark, (Arrow, Polyline))]
    assert {mark.at for mark in found.marks if isinstance(mark, Label)} == {(0.0, 0.0)}
    assert [mark.about for mark in found.marks if isinstance(mark, Circle)] == ["pole"]
    at_scale = polygon_picture(polygon, Scale(kind, 0.01, {"velocity": "m/s", "acceleration": "m/s^2"}[kind]))
    assert at_scale.marks == found.marks


def test_rounding_is_no_motion():
    """A slide that is pushed steadily: all accelerations vanish up to rounding."""
    value = {
        "planar": 1,
        "name": "pushed",
        "frame": "frame",
        "links": {"frame": {"points": {"O": [0, 0]}}, "slide": {"points": {"S": [0, 0], "T": [1.1, 0.3]}}},
        "pairs": [
            {"sliding": "way", "links": ["frame", "slide"], "line": {"through": "O", "angle": 0.3}, "point": "S"}
        ],
        "inputs": [{"pair": "way", "position": 0.7, "velocity": 0.3}],
    }
    state = solve(files.from_dict(value))
    assert polygon_picture(acceleration_polygon(state)).notes[-1] == "nothing is accelerated"
    (arrow,) = (mark for mark in polygon_picture(velocity_polygon(state)).marks if isinstance(mark, Arrow))
    assert arrow.about == "velocity S/G"


# Letters


@pytest.mark.parametrize(
    ("stem", "letter", "text"),
    [
        ("002-E3.1", "b_1", "$b_{1}$"),
        ("002-E3.1", "c_d", "$c_{d}$"),
        ("002-E3.4", "g′′_1", "$g''_{1}$"),
        ("004-OABQ", "d_d′", "$d_{d'}$"),
        ("oldham", "o2_1", "$o2_{1}$"),
        ("jansen-leg", "foot_1", "$foot_{1}$"),
    ],
)
def test_letters_of_accelerations_are_set_with_an_index(stem, letter, text):
    polygon = drawn(stem, "acceleration")
    assert letter in polygon.letters
    assert letter_text(polygon, letter) == (text, True)


def test_letters_of_velocities_are_plain():
    assert letter_text(drawn("002-E3.4", "velocity"), "g′′") == ("g″", False)
    letters = [mark for mark in picture("002-E3.4", "velocity").marks if isinstance(mark, Label)]
    assert all(mark.slanted and not mark.math for mark in letters)


@pytest.mark.parametrize("name", ["$b^2$", r"\frac", "b_1", "{b", "crank pin", "b-c", "_", "b_a_1"])
def test_names_of_any_kind_are_never_taken_for_formulas(name):
    names = {"pins": ["A", name, "C", "D"], "names": ["frame", "crank", "coupler", "rocker"]}
    value = four_bar_document(1, 3.5, 2.5, 4, 1.0, omega=2.0, alpha=1.0, sketch={"C": [3, 2.5]}, **names)
    state = solve(files.from_dict(value))
    for kind, draw in KINDS.items():
        polygon = draw(state)
        (own,) = (letter for letter, point in polygon.points.items() if point == name)
        texts = {mark.about: mark for mark in polygon_picture(polygon).marks if isinstance(mark, Label)}
        assert not texts[f"letter {own}"].math
        plain = name if name in polygon.letters else name.lower()
        assert texts[f"letter {own}"].text == plain + {"velocity": "", "acceleration": "₁"}[kind]
        for mark in texts.values():
            assert mark.math == bool(re.fullmatch(r"\$[A-Za-z]+'*_\{([A-Za-z]+'*|1)\}\$", mark.text))
    # the head of a part has both names
    assert f"letter c_{plain}" in texts
    assert texts[f"letter c_{plain}"].text == f"c_{plain}"


def test_of_very_many_letters_at_the_pole_a_few_are_shown_and_all_told():
    found = picture("chain-42", "velocity")
    texts = [mark.text for mark in found.marks if isinstance(mark, Label) and mark.at == (0.0, 0.0)]
    assert texts == ["a0", "a1", "a2", "…", "a20"]
    assert found.notes[-1] == f"at the pole: {', '.join(f'A{k}' for k in range(21))}"


# Groups that no two lines locate


def test_links_found_together_have_images_and_arrows_from_their_fixed_pins():
    stem, kind = "double-butterfly", "velocity"
    images = {mark.about for mark in strokes(stem, kind, Pen.IMAGE)}
    assert images == {"image ADE", "image DKJ", "image CGH", "image EG", "image KH"}
    arrows = {mark.about: mark for mark in strokes(stem, kind, Pen.VELOCITY)}
    assert {*arrows} == {"velocity A/O", "velocity G/C", "velocity H/C", "velocity J/B"}
    for name, mark in arrows.items():
        assert mark.tail == (0.0, 0.0)
        assert near(mark.head, at(stem, kind, name.removeprefix("velocity ")[0].lower()))


def test_what_slides_in_a_group_has_its_arrow():
    arrow = of("hand-pump", "velocity", "velocity O/G")
    assert near(arrow.head, at("hand-pump", "velocity", "o"))
    assert arrow.head[0] == pytest.approx(0.0, abs=1e-9)


@both_kinds
@every_model
def test_every_link_of_a_group_is_seen(stem, kind):
    polygon = drawn(stem, kind)
    marks = [mark for mark in picture(stem, kind).marks if isinstance(mark, (Arrow, Polyline))]
    members = {name: polygon.state._find_point(name).members for name in polygon.state.point_names}
    letter_of = {point: letter for letter, point in polygon.points.items()}
    for stage in polygon.stages:
        for link in stage.links if isinstance(stage, SimultaneousSolution) else ():
            named = [name for name, each in members.items() if any(owner == link for owner, _ in each)]
            spots = [polygon.letters[letter_of[name]] / per_mm(stem, kind) for name in named if name in letter_of]
            wide = max((hypot(*(one - other)) for one in spots for other in spots), default=0.0)
            # some stroke between two of its letters, whatever it is called
            joined = [mark for mark in marks if all(any(near(end, spot) for spot in spots) for end in ends(mark))]
            assert joined or wide < 0.1


@both_kinds
@every_model
def test_every_letter_is_that_of_a_point_in_the_space_diagram_or_is_explained(stem, kind):
    polygon, notes = drawn(stem, kind), picture(stem, kind).notes
    named = {each.name for each in named_points(polygon.state.mechanism)}
    explained = {letter for note in notes if ": the point" in note for letter in note.split(":")[0].split(", ")}
    for letter, point in polygon.points.items():
        text, math = letter_text(polygon, letter)
        bare = re.sub(r"_\{.*\}|\$", "", text) if math else text
        bare = re.sub("'+", lambda primes: "′″‴"[len(primes[0]) - 1], bare) if math else bare
        assert point in named or bare.rstrip("₁") in explained, letter
    assert any("index 1" in note for note in notes) == (kind == "acceleration")
    heads = set(polygon.letters) - set(polygon.points)
    assert any("ends of their parts" in note for note in notes) == bool(heads)


def test_what_lies_under_a_slider_is_told_by_its_link_and_the_slider():
    assert "g, g′, g″: the points of the frame at B, D, F" in picture("002-E3.4", "velocity").notes
    polygon = drawn("crank-and-slotted-lever", "velocity")
    frame = polygon.state.mechanism.frame
    moving = [(letter, *where) for letter, where in polygon.points_underneath.items() if where[0] != frame]
    assert moving
    for letter, link, over in moving:
        assert f"{letter}: the point of {link} at {over}" in picture("crank-and-slotted-lever", "velocity").notes
