"""Where the points of a link lie, against the geometry that their author stated."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planar.foundation.geometry import Vector
from planar.model.link_shapes import (
    Along,
    At,
    Distances,
    Link,
    Offset,
    Point,
    PointDefinition,
    PointPlacementError,
    link_shape,
)

STEADY = settings(deadline=None)
"""No example is timed: the first one may load a library."""

ROUND_OFF = 1e-14
"""A point is a dozen operations on numbers up to 10, each rounded to 1.1e-16 of itself."""

COORDINATE = st.floats(-10.0, 10.0).map(lambda x: round(x, 6))
PLACE = st.tuples(COORDINATE, COORDINATE)
ANGLE = st.floats(-7.0, 7.0)


def bar(*points: tuple[str, PointDefinition], length: float = 1.0) -> Link:
    """A link with its ends A, B on the x-axis, and more points."""
    return Link("bar", tuple(Point(*each) for each in points), ("A", "B"), length)


def drawn(*points: tuple[str, PointDefinition], axis: tuple[str, str] | None = None) -> Link:
    """A link by its points alone."""
    return Link("plate", tuple(Point(*each) for each in points), axis=axis)


def near(x: float, y: float, tolerance: float = ROUND_OFF) -> object:
    return pytest.approx((x, y), rel=0.0, abs=tolerance)


def apart(p: Vector, q: Vector) -> float:
    return float(hypot(p.x - q.x, p.y - q.y))


# ends


def test_ends_put_the_first_at_the_origin_and_the_second_on_the_x_axis() -> None:
    found = link_shape(bar(length=0.05))
    assert tuple(found.points) == ("A", "B")
    assert found.points["A"] == (0.0, 0.0)
    assert found.points["B"] == (0.05, 0.0)
    assert found.axis == (1.0, 0.0)


def test_names_are_the_ends_then_the_points() -> None:
    assert bar(("Q", At(0.0, 1.0)), ("P", At(1.0, 1.0))).names == ("A", "B", "Q", "P")
    assert drawn(("Q", At(0.0, 1.0))).names == ("Q",)


def test_coordinates_beside_ends_are_in_the_axes_of_the_ends() -> None:
    assert link_shape(bar(("P", At(0.3, -0.2)))).points["P"] == (0.3, -0.2)


# along


@pytest.mark.parametrize(
    ("place", "x", "y"),
    [
        (Along("A", "B", 0.25), 0.25, 0.0),
        (Along("A", "B", -0.25), -0.25, 0.0),
        (Along("A", "B", 1.5), 1.5, 0.0),
        (Along("B", "A", 0.25), 0.75, 0.0),
        (Along("B", "A", -0.25), 1.25, 0.0),
        (Along("A", "B", 0.0), 0.0, 0.0),
        # a bell crank: the way turned anticlockwise about the first point
        (Along("A", "B", 0.5, pi / 2), 0.0, 0.5),
        (Along("A", "B", 0.5, -pi / 2), 0.0, -0.5),
        (Along("A", "B", -0.5, pi / 2), 0.0, -0.5),
        (Along("B", "A", 0.5, pi / 2), 1.0, -0.5),
        (Along("A", "B", 0.5, pi), -0.5, 0.0),
        (Along("A", "B", 2.0, pi / 3), 1.0, 3.0**0.5),
    ],
)
def test_along_goes_a_signed_distance_on_the_way_turned_anticlockwise(place: Along, x: float, y: float) -> None:
    assert link_shape(bar(("P", place))).points["P"] == near(x, y)


@STEADY
@given(PLACE, PLACE, st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_an_offset_lies_to_the_left_of_the_line(
    p: tuple[float, float], q: tuple[float, float], distance: float, offset: float
) -> None:
    """By the polar form of the same place, and by the products of the line with the way to it."""
    assume(hypot(q[0] - p[0], q[1] - p[1]) > 1e-3)
    polar = Along("P", "Q", hypot(distance, offset), atan2(offset, distance))
    points = link_shape(
        drawn(("P", At(*p)), ("Q", At(*q)), ("R", Offset("P", "Q", distance, offset)), ("S", polar))
    ).points
    line, arm = points["Q"] - points["P"], points["R"] - points["P"]
    length = hypot(*line)
    rounding = 1e-11 * (1.0 + hypot(*arm))
    assert points["R"] == pytest.approx(points["S"], abs=rounding)
    assert line.dot(arm) / length == pytest.approx(distance, abs=rounding)
    assert line.cross(arm) / length == pytest.approx(offset, abs=rounding)


@STEADY
@given(PLACE, PLACE, st.floats(-10.0, 10.0), ANGLE)
def test_along_holds_its_distance_and_angle_between_any_two_points(
    p: tuple[float, float], q: tuple[float, float], distance: float, angle: float
) -> None:
    assume(hypot(q[0] - p[0], q[1] - p[1]) > 1e-3)
    link = drawn(("P", At(*p)), ("Q", At(*q)), ("R", Along("P", "Q", distance, angle)))
    found = link_shape(link).points
    way = found["Q"] - found["P"]
    off = found["R"] - found["P"]
    length = hypot(*way)
    # the way's own rounding, 1e-15 / 1e-3, turns the point
    tolerance = 1e-11
    assert way.dot(off) / length == pytest.approx(distance * cos(angle), abs=tolerance)
    assert way.cross(off) / length == pytest.approx(distance * sin(angle), abs=tolerance)


# distances


def test_a_triangle_of_3_4_5_lies_to_the_left_or_right_of_its_way() -> None:
    for place, y in (
        (Distances("A", "B", 3.0, 4.0, True), 2.4),
        (Distances("A", "B", 3.0, 4.0, False), -2.4),
        (Distances("B", "A", 4.0, 3.0, True), -2.4),
        (Distances("B", "A", 4.0, 3.0, False), 2.4),
    ):
        assert link_shape(bar(("P", place), length=5.0)).points["P"] == near(1.8, y), place


@STEADY
@given(PLACE, PLACE, PLACE)
def test_distances_hold_and_the_side_is_the_one_asked_for(
    p: tuple[float, float], q: tuple[float, float], r: tuple[float, float]
) -> None:
    first, second = (hypot(r[0] - o[0], r[1] - o[1]) for o in (p, q))
    base = hypot(q[0] - p[0], q[1] - p[1])
    assume(min(first, second, base) > 1e-3)
    for left in (True, False):
        place = Distances("P", "Q", first, second, left)
        found = link_shape(drawn(("P", At(*p)), ("Q", At(*q)), ("R", place))).points
        # a law of cosines over a base of 1e-3 loses 20 / 1e-3 of 1e-15; a triangle closed by force 1e-12 of a square
        assert apart(found["R"], found["P"]) == pytest.approx(first, abs=1e-7)
        assert apart(found["R"], found["Q"]) == pytest.approx(second, abs=1e-7)
        side = (found["Q"] - found["P"]).cross(found["R"] - found["P"])
        assert side >= -1e-11 if left else side <= 1e-11


@STEADY
@given(PLACE, PLACE, PLACE)
def test_a_point_by_its_distances_is_the_point_that_they_were_measured_from(
    p: tuple[float, float], q: tuple[float, float], r: tuple[float, float]
) -> None:
    way, off = (q[0] - p[0], q[1] - p[1]), (r[0] - p[0], r[1] - p[1])
    cross = way[0] * off[1] - way[1] * off[0]
    assume(hypot(*way) > 0.1 and abs(cross) > 0.1)  # not flat: there the height is the root of a small difference
    first, second = hypot(*off), hypot(r[0] - q[0], r[1] - q[1])
    place = Distances("P", "Q", first, second, cross > 0.0)
    found = link_shape(drawn(("P", At(*p)), ("Q", At(*q)), ("R", place))).points["R"]
    # squares up to 1e3 rounded to 1e-13, divided by a base of 0.1 and by a height of 0.1 / 30
    assert found == near(*r, tolerance=1e-8)


@STEADY
@given(st.floats(1e-3, 1e3), st.floats(0.01, 0.99), st.booleans())
def test_a_flat_triangle_closes_however_its_sides_are_rounded(length: float, part: float, left: bool) -> None:
    inside = Distances("A", "B", part * length, length - part * length, left)
    beyond = Distances("A", "B", length + part * length, part * length, left)
    before = Distances("A", "B", part * length, length + part * length, left)
    for place, x in ((inside, part), (beyond, 1.0 + part), (before, -part)):
        found = link_shape(bar(("P", place), length=length)).points["P"]
        assert found.x == pytest.approx(x * length, abs=1e-12 * length)
        # a height whose square is round-off: 4e-16 of the longest side's square, of which 4 at most
        assert abs(found.y) < 1e-7 * length


@pytest.mark.parametrize(("a", "b"), [(0.4, 0.5), (1.7, 0.6), (0.6, 1.7), (1e-6, 1e-6), (0.5, 0.5 - 1e-6)])
def test_a_triangle_that_does_not_close_is_refused_with_its_sides(a: float, b: float) -> None:
    with pytest.raises(PointPlacementError) as caught:
        link_shape(bar(("P", Distances("A", "B", a, b))))
    assert caught.value.point == "P"
    for words in ("A-B-P", "does not close", f"{a:.6g}", f"{b:.6g}", "1,"):
        assert words in str(caught.value)


@pytest.mark.parametrize(("a", "b"), [(1.0, 1e200), (1e200, 1.0), (1e155, 1e-3), (1e-200, 1e200)])
def test_a_triangle_of_sides_out_of_all_proportion_does_not_close(a: float, b: float) -> None:
    with pytest.raises(PointPlacementError, match="does not close"):
        link_shape(bar(("P", Distances("A", "B", a, b))))


# points that rest on points


def test_points_may_rest_on_later_points() -> None:
    link = bar(
        ("R", Distances("P", "Q", 1.0, 1.0)),
        ("Q", Along("P", "B", 1.0)),
        ("P", Along("A", "B", 0.5, pi / 2)),
        length=0.5,
    )
    found = link_shape(link).points
    assert found["P"] == near(0.0, 0.5)
    assert found["Q"] == near(0.5**0.5, 0.5 - 0.5**0.5)
    assert apart(found["R"], found["P"]) == pytest.approx(1.0, abs=ROUND_OFF)
    assert apart(found["R"], found["Q"]) == pytest.approx(1.0, abs=ROUND_OFF)


@pytest.mark.parametrize("backwards", [False, True])
def test_a_chain_of_thousands_of_points_is_placed(backwards: bool) -> None:
    # each a metre from the one before, away from the one before that: in a line to the left of A
    rests = ["B", "A", *(f"P{k}" for k in range(3000))]
    chain = [(f"P{k}", Along(rests[k + 1], rests[k], 1.0, pi)) for k in range(3000)]
    found = link_shape(bar(*(chain[::-1] if backwards else chain))).points
    # each step turns by the 1e-16 of pi's own rounding, which adds up over 3000 * 3000 / 2 metres
    assert found["P2999"] == near(-3000.0, 0.0, tolerance=1e-8)


def test_points_that_rest_on_one_another_are_refused_with_their_circle() -> None:
    link = bar(("P", Along("Q", "B", 1.0)), ("Q", Distances("R", "A", 1.0, 1.0)), ("R", Along("A", "P", 1.0)))
    with pytest.raises(PointPlacementError) as caught:
        link_shape(link)
    assert caught.value.point in ("P", "Q", "R")
    assert "rests on itself" in str(caught.value)
    assert all(name in str(caught.value) for name in ("P", "Q", "R"))


def test_a_point_that_rests_on_itself_is_refused() -> None:
    with pytest.raises(PointPlacementError, match="rests on itself"):
        link_shape(bar(("P", Along("P", "B", 1.0))))


@pytest.mark.parametrize("place", [Along("A", "X", 1.0), Along("X", "A", 1.0), Distances("A", "X", 1.0, 1.0)])
def test_a_point_that_rests_on_no_point_of_the_link_is_refused(place: PointDefinition) -> None:
    with pytest.raises(PointPlacementError, match="there is no point 'X'") as caught:
        link_shape(bar(("P", place)))
    assert caught.value.point == "P"


@pytest.mark.parametrize("place", [Along("P", "Q", 1.0), Distances("P", "Q", 1.0, 1.0)])
def test_two_points_that_coincide_give_no_direction(place: PointDefinition) -> None:
    with pytest.raises(PointPlacementError, match="'P' and 'Q' coincide") as caught:
        link_shape(drawn(("P", At(1.0, 2.0)), ("Q", At(1.0, 2.0)), ("R", place)))
    assert caught.value.point == "R"


# axis


def test_an_axis_turns_the_drawing_about_its_first_point() -> None:
    link = drawn(("O", At(3.0, 4.0)), ("P", At(3.0, 1.0)), ("Q", At(5.0, 4.0)), axis=("O", "P"))
    found = link_shape(link)
    assert found.points["O"] == near(0.0, 0.0)
    assert found.points["P"] == near(3.0, 0.0)
    assert found.points["Q"] == near(0.0, 2.0)
    assert found.axis == near(0.0, -1.0)


@STEADY
@given(PLACE, PLACE, PLACE)
def test_an_axis_keeps_all_distances_and_handedness(
    p: tuple[float, float], q: tuple[float, float], r: tuple[float, float]
) -> None:
    assume(hypot(q[0] - p[0], q[1] - p[1]) > 1e-3)
    points = (("P", At(*p)), ("Q", At(*q)), ("R", At(*r)))
    plain, turned = link_shape(drawn(*points)), link_shape(drawn(*points, axis=("P", "Q")))
    for a, b in (("P", "Q"), ("Q", "R"), ("R", "P")):
        before, after = apart(plain.points[a], plain.points[b]), apart(turned.points[a], turned.points[b])
        assert after == pytest.approx(before, abs=1e-13)
    before, after = ((s.points["Q"] - s.points["P"]).cross(s.points["R"] - s.points["P"]) for s in (plain, turned))
    # a product of two lengths up to 30
    assert after == pytest.approx(before, abs=1e-12)
    assert turned.points["Q"].x > 0.0
    assert turned.points["Q"].y == pytest.approx(0.0, abs=1e-13)


@STEADY
@given(PLACE)
def test_coordinates_are_taken_in_the_axes_of_the_drawing(at: tuple[float, float]) -> None:
    link = drawn(("O", At(3.0, 4.0)), ("P", At(1.0, 1.0)), ("Q", At(*at)), axis=("O", "P"))
    found = link_shape(link)
    assert found.position(at) == near(*found.points["Q"])
    assert found.position("Q") == found.points["Q"]
    assert link_shape(bar(("Q", At(*at)))).position(at) == at


# the same formulas on arrays


def everything(a: float, b: float, c: float, angle: float, axis: bool) -> Link:
    """A link of every kind of point, resting on one another; the numbers may be arrays."""
    points = [
        ("P", At(0.7 * a, -0.3 * b)),
        ("E", Along("P", "B" if not axis else "O", -0.4 * c, angle)),
        ("L", Distances("P", "E", c, c + 0.1 * a, True)),
        ("R", Distances("L", "P", c, 0.5 * c, False)),
    ]
    if axis:
        return drawn(("O", At(a, b)), *points, axis=("P", "E"))
    return bar(*points, length=a)


@pytest.mark.parametrize("axis", [False, True], ids=["ends", "axis"])
def test_arrays_of_designs_are_placed_as_each_design_alone(axis: bool) -> None:
    rng = np.random.default_rng(7)
    a, b, c, angle = rng.uniform(0.5, 2.0, (4, 50))
    together = link_shape(everything(a, b, c, angle, axis))
    for k in range(50):
        alone = link_shape(everything(float(a[k]), float(b[k]), float(c[k]), float(angle[k]), axis))
        for name, point in alone.points.items():
            found = [np.broadcast_to(part, 50)[k] for part in together.points[name]]
            # numpy's vectors of sines and cosines may differ from its single ones in the last bit
            np.testing.assert_allclose(found, np.array(point, dtype=float), rtol=0.0, atol=ROUND_OFF)
