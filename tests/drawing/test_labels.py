"""Letters are placed near what they name, clear of strokes and of each other."""

from functools import partial
from math import cos, hypot, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planar.drawing.labels import placement
from planar.drawing.labels.fonts import UNKNOWN_CHARACTER, font_properties, printable_text
from planar.drawing.labels.placement import (
    LEADER_DISTANCE,
    MAX_FAR_LABELS,
    SAME_POINT_TOLERANCE,
    PlacedLabel,
    count_labels,
    place_labels,
)
from planar.drawing.labels.text_metrics import text_size, wrap_text
from planar.drawing.output.matplotlib_figure import lay_out_picture
from planar.drawing.paper.boxes import Box, nearby_points
from planar.drawing.paper.pens import MM_PER_POINT
from planar.drawing.paper.picture import Arrow, Circle, Label, Pen, Picture, Polyline
from planar.foundation.errors import MissingGlyphs
from tests.draws import draws, is_exhaustive
from tests.fonts import own_fonts  # noqa: F401
from tests.hostile import TEXTS
from tests.work import calls


def gap(box: Box, spot: tuple[float, float]) -> float:
    """From a box to a spot (mm)."""
    return hypot(max(box.left - spot[0], spot[0] - box.right, 0.0), max(box.bottom - spot[1], spot[1] - box.top, 0.0))


def overlap(one: Box, other: Box) -> bool:
    across = min(one.right, other.right) - max(one.left, other.left)
    return across > 1e-9 and min(one.top, other.top) - max(one.bottom, other.bottom) > 1e-9


def covers(box: Box, points: np.ndarray) -> bool:
    """Whether any of the points (n, 2) lies in the box."""
    return bool(((points > (box.left, box.bottom)) & (points < (box.right, box.top))).all(axis=1).any())


def dotted(mark: Polyline | Circle) -> np.ndarray:
    """Points along a stroke, close together."""
    if isinstance(mark, Circle):
        angles = np.linspace(0.0, 2.0 * pi, 2000)
        return np.array(mark.centre) + mark.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    part = np.linspace(0.0, 1.0, 2000)[:, None]
    return np.array(mark.points[0]) * (1.0 - part) + np.array(mark.points[1]) * part


def middle(each: PlacedLabel) -> tuple[float, float]:
    return (each.box.left + each.box.right) / 2.0, (each.box.bottom + each.box.top) / 2.0


@pytest.mark.parametrize("angle", range(0, 360, 15))
def test_a_letter_at_the_end_of_a_stroke_stands_on_the_free_side(angle):
    way = cos(radians(angle)), sin(radians(angle))
    stroke = Polyline(((0.0, 0.0), (30.0 * way[0], 30.0 * way[1])), Pen.LINK)
    (only,) = place_labels([Label("A", (0.0, 0.0))], [stroke])
    x, y = middle(only)
    assert (x * way[0] + y * way[1]) / hypot(x, y) < -0.7
    assert gap(only.box, (0.0, 0.0)) == pytest.approx(1.0, abs=0.9)
    assert only.leader is None


@pytest.mark.parametrize("away", [1.0, 1.6, 3.0, 9.0])
def test_a_letter_keeps_its_distance_from_its_spot_but_no_more(away):
    (only,) = place_labels([Label("A", (5.0, -7.0), clearance=away)], [])
    assert gap(only.box, (5.0, -7.0)) == pytest.approx(away)
    assert only.leader is None


def test_a_letter_beside_a_line_through_its_spot_stands_off_the_line():
    for angle in range(0, 180, 10):
        way = 40.0 * cos(radians(angle)), 40.0 * sin(radians(angle))
        line = Polyline(((-way[0], -way[1]), way), Pen.LINK)
        (only,) = place_labels([Label("23", (0.0, 0.0), size=8.0)], [line])
        assert not covers(only.box, dotted(line))
        assert gap(only.box, (0.0, 0.0)) < 2.5


def test_letters_at_one_spot_become_one_text_in_the_order_given():
    pole = [Label(text, (1e-3 * place, 0.0), f"point {text}", slanted=True) for place, text in enumerate("adga")]
    (only,) = place_labels(pole, [])
    assert only.label.text == "a, d, g"
    assert only.label.about == "point a, point d, point g"
    assert only.label.slanted


def test_equal_texts_at_one_spot_stand_once_and_elsewhere_again():
    letters = [Label("A", (0.0, 0.0)), Label("A", (0.0, 0.04)), Label("A", (0.0, 20.0))]
    assert [each.label.text for each in place_labels(letters, [])] == ["A", "A"]


def test_the_number_of_a_link_does_not_join_the_name_of_a_point_there():
    both = place_labels([Label("A", (0.0, 0.0)), Label("2", (0.0, 0.0), size=8.0)], [])
    assert [each.label.text for each in both] == ["A", "2"]
    assert not overlap(both[0].box, both[1].box)


def test_plain_texts_joined_with_mathtext_stay_as_they_are():
    letters = [Label("$A_0$", (0.0, 0.0), math=True), Label("cost $5_x", (0.0, 0.0))]
    (only,) = place_labels(letters, [])
    assert only.label.math
    assert only.label.text == r"$A_0$, cost \$5_x"
    whole, index = text_size(only.label.text, 9.0, math=True).width, text_size("$A_0$", 9.0, math=True).width
    assert whole == pytest.approx(index + text_size(", cost $5_x", 9.0).width, abs=1.5)


def test_letters_of_a_dense_cluster_stand_apart_and_lead_to_their_spots():
    rng = np.random.default_rng(5)
    letters = [Label(f"block {n}", tuple(rng.normal(0.0, 4.0, 2)), clearance=1.0) for n in range(40)]
    boxes = place_labels(letters, [Circle(each.at, 0.5, Pen.PIN) for each in letters])
    assert len(boxes) == 40
    assert not any(overlap(one.box, other.box) for n, one in enumerate(boxes) for other in boxes[:n])
    led = [each for each in boxes if each.leader is not None]
    assert len(led) > 10
    for each in boxes:
        assert (each.leader is not None) == (gap(each.box, each.label.at) > 1.0 + LEADER_DISTANCE)
    for each in led:
        start, end = each.leader
        assert gap(each.box, start) == pytest.approx(0.2, abs=1e-6)
        assert hypot(end[0] - each.label.at[0], end[1] - each.label.at[1]) == pytest.approx(0.5)


def test_a_letter_moves_when_a_later_one_has_no_room():
    # the second letter fits between the walls only where the first, alone, would stand
    walls = [Polyline(((x, -30.0), (x, 30.0)), Pen.LINK) for x in (-1.3, 5.5)]
    first, second = Label("A", (0.0, 0.0)), Label("B", (0.0, 3.4))
    alone = place_labels([first], walls)[0].box
    both = place_labels([first, second], walls)
    assert not overlap(both[0].box, both[1].box)
    assert not any(covers(each.box, dotted(wall)) for each in both for wall in walls)
    assert all(each.leader is None for each in both)
    assert alone.left > -1.3


coordinate = st.floats(-30.0, 30.0).map(lambda value: round(value, 2))
spots = st.tuples(coordinate, coordinate)
near = st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0))
texts = st.sampled_from(["A", "B", "a'", "block D", "crank.P", "12", "O2"])
lines = st.builds(lambda one, other: Polyline((one, other), Pen.LINK), spots, spots)
circles = st.builds(lambda centre, radius: Circle(centre, radius, Pen.PITCH), spots, st.floats(1.0, 15.0))


@settings(max_examples=draws(20), deadline=None)
@given(
    st.lists(st.tuples(texts, spots).map(lambda pair: Label(*pair)), min_size=1, max_size=10),
    st.lists(st.one_of(lines, circles), max_size=6),
)
def test_letters_are_clear_of_strokes_and_of_each_other_whenever_there_is_room(letters, marks):
    found = place_labels(letters, marks)
    assert not any(overlap(one.box, other.box) for n, one in enumerate(found) for other in found[:n])
    for each in found:
        assert not any(covers(each.box, dotted(mark)) for mark in marks)


@settings(max_examples=draws(8), deadline=None)
@given(
    st.lists(st.tuples(texts, near).map(lambda pair: Label(*pair)), max_size=30),
    st.lists(lines, max_size=40),
)
def test_letters_never_overlap_each_other_however_crowded_it_is(letters, marks):
    found = place_labels(letters, marks)
    assert not any(overlap(one.box, other.box) for n, one in enumerate(found) for other in found[:n])
    assert found == place_labels(letters, marks)


def test_letters_keep_off_arrows_and_their_heads_hatching_and_boxes_that_are_taken():
    strokes = [Arrow((-20.0, 0.0), (0.0, 0.0), Pen.VELOCITY), Arrow((0.0, 0.0), (0.0, -20.0), Pen.VELOCITY)]
    strokes += [Polyline(((-20.0, 2.0 + n), (-18.0 + n, 4.0 + n)), Pen.HATCH) for n in range(10)]
    taken = Box(0.5, 0.5, 12.0, 12.0)
    (only,) = place_labels([Label("b", (0.0, 0.0))], strokes, [taken])
    assert not overlap(only.box, taken)
    assert not covers(
        only.box, np.concatenate([dotted(Polyline((each.tail, each.head), each.pen)) for each in strokes[:2]])
    )


def test_a_leader_crosses_no_letter_where_that_can_be_avoided():
    letters = [Label("long name", (0.3 * n, 0.0)) for n in range(12)]
    letters = [each._replace(text=f"long name {n}") for n, each in enumerate(letters)]
    found = place_labels(letters, [])
    for each in found:
        if each.leader is not None:
            points = dotted(Polyline(each.leader, Pen.LEADER))
            assert not any(covers(other.box, points) for other in found if other is not each)


def test_no_letters_and_blank_letters_take_no_place():
    assert place_labels([], [Polyline(((0.0, 0.0), (1.0, 0.0)), Pen.LINK)]) == ()
    assert place_labels([Label(" \n", (0.0, 0.0))], []) == ()


def crowd(many):
    """So many letters and four times as many strokes, as close to one another however many they are."""
    rng = np.random.default_rng(3)
    sheet = np.array([200.0, 150.0]) * np.sqrt(many / 150)
    letters = [Label(f"P{n}", tuple(rng.uniform((0.0, 0.0), sheet))) for n in range(many)]
    starts = rng.uniform((0.0, 0.0), sheet, (4 * many, 2))
    return letters, [Polyline((tuple(one), tuple(one + rng.normal(0.0, 8.0, 2))), Pen.LINK) for one in starts]


def test_twice_as_many_letters_among_strokes_take_about_twice_the_work():
    place_labels(*crowd(10))
    some, more = (calls(partial(place_labels, *crowd(many))) for many in (50, 100))
    assert more < 3.0 * some


@pytest.mark.filterwarnings("ignore::planar.foundation.errors.MissingGlyphs")
@pytest.mark.parametrize("text", TEXTS)
def test_any_text_can_be_measured_and_is_one_line_of_what_the_font_has(text):
    (only,) = place_labels([Label(text, (0.0, 0.0))], [])
    assert not only.label.math
    assert all(each.isprintable() for each in only.label.text)
    assert only.box.right - only.box.left < 130.0


def test_what_the_font_lacks_is_replaced_and_the_rest_stays(own_fonts):  # noqa: F811
    with pytest.warns(MissingGlyphs, match="中"):
        assert printable_text("Kurbel 中, α₁ → <b> $x$ \\frac{") == f"Kurbel {UNKNOWN_CHARACTER}, α₁ → <b> $x$ \\frac{{"
    assert printable_text("a\x07b\u2028c") == f"a{UNKNOWN_CHARACTER}b c"


def test_faulty_mathtext_is_shown_as_it_stands():
    (only,) = place_labels([Label(r"$\frac{$", (0.0, 0.0), math=True)], [])
    assert (only.label.text, only.label.math) == (r"$\frac{$", False)


def test_sizes_are_those_of_the_drawn_outlines():
    from matplotlib.textpath import TextPath

    for text in ("block D.B", "A", "g", "ω = 10.5 rad/s"):
        box = TextPath((0.0, 0.0), text, prop=font_properties(9.0)).get_extents()
        size = text_size(text, 9.0)
        assert size.width == pytest.approx(box.x1 * MM_PER_POINT, abs=0.5)
        assert size.height == pytest.approx(box.height * MM_PER_POINT, abs=0.05)
        assert size.descent == pytest.approx(-box.y0 * MM_PER_POINT, abs=0.05)


def test_lines_are_broken_at_spaces_and_within_words_that_are_too_long():
    words = "one two three four five six seven"
    lines = wrap_text(words, 8.5, 25.0)
    assert " ".join(lines) == words
    assert len(lines) > 1
    broken = wrap_text("x" * 3000 + " end", 8.5, 40.0)
    assert "".join(broken).replace(" ", "") == "x" * 3000 + "end"
    assert all(text_size(line, 8.5).width <= 40.0 for line in lines + broken)
    assert wrap_text("W", 8.5, 0.1) == ["W"]
    assert wrap_text("  ", 8.5, 40.0) == []


def test_no_line_ends_at_a_no_break_space():
    pieces = [f"{k}-{k + 1}:\N{NO-BREAK SPACE}II," for k in range(20)]
    for width in (14.0, 25.0, 33.0):
        lines = wrap_text(" ".join(pieces), 8.5, width)
        assert len(lines) > 1
        assert " ".join(lines) == " ".join(pieces).replace("\N{NO-BREAK SPACE}", " ")
        assert all(line.endswith("II,") for line in lines)


def test_of_very_many_letters_those_without_room_near_their_spots_are_left_out(monkeypatch):
    """A row of more letters than fit: none of those that stay has a leader, meets another or is far from its spot."""
    most = MAX_FAR_LABELS if is_exhaustive() else 50
    monkeypatch.setattr(placement, "MAX_FAR_LABELS", most)
    marks = [Polyline(((0.0, 0.0), (2.0 * most, 0.0)), Pen.LINK)]
    crowded = [Label(f"N{k}", (2.0 * k, 0.0)) for k in range(most + 1)]
    letters = place_labels(crowded, marks)
    assert 10 < len(letters) < count_labels(crowded) == len(crowded)
    assert all(each.leader is None and gap(each.box, each.label.at) < LEADER_DISTANCE + 1.0 for each in letters)
    assert not any(overlap(one.box, other.box) for k, one in enumerate(letters) for other in letters[:k])
    spread = [Label(f"N{k}", (60.0 * k, 0.0)) for k in range(most + 1)]
    assert len(place_labels(spread, [])) == len(spread)
    assert len(place_labels(crowded[:-1], marks)) == len(crowded) - 1
    picture = Picture((*marks, *crowded), "row", ())
    note, _ = lay_out_picture(picture).text_lines[1]
    assert note.startswith(f"{len(crowded) - len(letters)} letters of {len(crowded)} left out")


def test_points_near_each_other_are_those_of_all_pairs():
    rng = np.random.default_rng(3)
    points, reach = rng.uniform(0.0, 10.0, (60, 2)), rng.uniform(0.1, 0.8, 60)
    expected = [
        [one, other]
        for one in range(60)
        for other in range(one + 1, 60)
        if hypot(*(points[one] - points[other])) < reach[one] + reach[other]
    ]
    assert len(expected) > 10
    assert nearby_points(points, reach).tolist() == expected
    assert nearby_points(points[:0], 1.0).tolist() == []


def test_letters_of_one_spot_are_joined_wherever_their_cells_end():
    """Spots a little apart may lie in two cells of those that are compared."""
    at = (3.0 * SAME_POINT_TOLERANCE, 1.0)
    close, far = (at[0] - 0.4 * SAME_POINT_TOLERANCE, 1.0), (at[0] + 2.0 * SAME_POINT_TOLERANCE, 1.0)
    letters = place_labels([Label("A", at), Label("B", close), Label("C", far)], [])
    assert sorted(each.label.text for each in letters) == ["A, B", "C"]
