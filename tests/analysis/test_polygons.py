"""Velocity and acceleration polygons: laws that hold for every mechanism, and the tables of the chapters."""

from __future__ import annotations

from functools import cache
from itertools import chain
from math import hypot, prod

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

import planar
from planar.analysis.polygons.construction import acceleration_polygon, velocity_polygon
from planar.analysis.polygons.polygon import (
    Meeting,
    PointImage,
    Polygon,
    PolygonVector,
    SimultaneousSolution,
    TurningRate,
    VectorPart,
)
from planar.document import files
from planar.foundation.geometry import direction
from planar.model.wording import direction_sense
from planar.solving.position import solve
from tests.builders import four_bar as bars
from tests.builders import four_bar_document
from tests.closed_forms import between
from tests.draws import draws
from tests.known import some_models
from tests.known import state_of as solved
from tests.linkages import assembled, random_linkage

KINDS = {"velocity": velocity_polygon, "acceleration": acceleration_polygon}
TIGHT = 1e-9
"""Of the largest vector: what rounding may leave of a law in a model."""


@cache
def drawn(stem: str, kind: str) -> Polygon:
    return KINDS[kind](solved(stem))


# The same quantities by another route: rigid motion of a link's frame, whose parts are plain numbers here.


def parts(value, order):
    return float(value.parts[order]) if hasattr(value, "parts") else float(value) * (order == 0)


def spin(state, link, order=1):
    return parts(state.frames[link].angle, order)


def moved(state, link, spot, order):
    """Velocity (1) or acceleration (2) of the point of a link that lies at a place."""
    frame = state.frames[link]
    origin, *own = (np.array([parts(frame.x, k), parts(frame.y, k)]) for k in range(3))
    reach = np.asarray(spot) - origin
    quarter = np.array([-reach[1], reach[0]])
    rate, second = spin(state, link, 1), spin(state, link, 2)
    return own[order - 1] + (rate * quarter if order == 1 else second * quarter - rate**2 * reach)


def order_of(polygon):
    return 1 if polygon.kind == "velocity" else 2


def meant(polygon, point):
    """The point that has the name, or on which a point without a name of its own (A′) lies; None of guides (G)."""
    names = polygon.state.point_names
    return next((name for name in (point, point.rstrip("′")) if name in names), None)


def place(polygon, point):
    return polygon.state.point(meant(polygon, point)).position


def largest(polygon):
    return max((hypot(*value) for value in polygon.letters.values()), default=0.0)


def vectors(polygon):
    sides = chain.from_iterable(stage.sides for stage in polygon.stages if isinstance(stage, Meeting))
    return [vector for side in sides for vector in side.vectors]


def letter_of(polygon, point):
    (letter,) = (letter for letter, name in polygon.points.items() if name == point)
    return letter


def guide_lines(state):
    """Of every slide: the point that rides, the guide and the direction of its line."""
    for pair in state.mechanism.pairs:
        if pair.point_on_line() is None:
            continue
        (rider, point), guide = pair.point_on_line()
        *_, x, y = pair.line.measure_line(state.shapes[guide])
        way = direction(spin(state, guide, 0))
        yield f"{rider}.{point}", guide, np.array([x * way.x - y * way.y, x * way.y + y * way.x])


def cross(a, b):
    return float(a[0] * b[1] - a[1] * b[0])


# Laws


def every_side_closes(polygon, tolerance):
    scale = tolerance * largest(polygon)
    for stage in polygon.stages:
        for side in stage.sides if isinstance(stage, Meeting) else ():
            ends = [side.start, *(vector.head for vector in side.vectors)]
            assert [vector.tail for vector in side.vectors] == ends[:-1]
            assert ends[-1] == stage.letter
            for vector in side.vectors:
                at = polygon.letters[vector.tail] + vector.value
                np.testing.assert_allclose(polygon.letters[vector.head], at, atol=scale)


def letters_are_what_the_state_has(polygon, tolerance):
    state, order = polygon.state, order_of(polygon)
    scale = tolerance * largest(polygon)
    frame = state.mechanism.frame
    fixed = {name for name in state.point_names if any(link == frame for link, _ in state._find_point(name).members)}
    assert len(set(polygon.points.values())) == len(polygon.points)
    # every point that can move has a letter
    assert {*state.point_names} - {*polygon.points.values()} <= fixed
    for letter, value in polygon.letters.items():
        point = polygon.points.get(letter)
        if letter in polygon.pole:
            assert point in fixed or meant(polygon, point) is None
            assert not value.any()
        elif point in state.point_names:
            assert point not in fixed
            found = state.point(point)
            np.testing.assert_allclose(value, found.velocity if order == 1 else found.acceleration, atol=scale)
        elif point is not None:
            sliding = {link for pair in state.mechanism.pairs if pair.point_on_line() for link in pair.links}
            routes = [moved(state, link, place(polygon, point), order) for link in sliding]
            assert min(hypot(*(route - value)) for route in routes) <= scale
    heads = {vector.head for vector in vectors(polygon)} | {*polygon.pole}
    assert {*polygon.letters} - {*polygon.points} <= heads


def magnitudes_are_made_of_their_factors(polygon, tolerance):
    state, scale = polygon.state, tolerance * largest(polygon)
    speeds = velocity_polygon(state)
    for vector in vectors(polygon):
        assert vector.known == bool(vector.factors)
        if not vector.known:
            continue
        assert prod(each.value**each.power for each in vector.factors) == pytest.approx(hypot(*vector.value), abs=scale)
        for factor in vector.factors:
            symbol, link = factor.symbol[0], factor.symbol[2:]
            if factor.kind == "length":
                ends = place(polygon, vector.of), place(polygon, vector.against)
                assert factor.value == pytest.approx(hypot(*(ends[0] - ends[1])))
                assert factor.symbol in (each.format(vector.against, vector.of) for each in ("{}{}", "{}-{}"))
            elif factor.kind == "angular velocity":
                assert (symbol, factor.value) == ("ω", pytest.approx(abs(state.link(link).angular_velocity)))
            elif factor.kind == "angular acceleration":
                assert (symbol, factor.value) == ("α", pytest.approx(abs(state.link(link).angular_acceleration)))
            elif factor.kind == "velocity" and factor.symbol.startswith("("):
                one, other = (letter_of(speeds, point) for point in (vector.against, vector.of))
                apart = hypot(*(speeds.letters[one] - speeds.letters[other]))
                assert factor.symbol == f"({one}{other})"
                assert factor.value == pytest.approx(apart, abs=tolerance * largest(speeds))


def directions_are_those_of_the_space_diagram(polygon, tolerance):
    state, scale = polygon.state, tolerance * largest(polygon)
    speeds = velocity_polygon(state)
    for vector in vectors(polygon):
        size = hypot(*vector.value)
        if vector.part in (VectorPart.SLIDING, VectorPart.CORIOLIS):
            assert vector.is_perpendicular == (vector.part is VectorPart.CORIOLIS)
            guide = vector.line.removeprefix("line on ") if vector.line.startswith("line on ") else None
            ways = [way for _, link, way in guide_lines(state) if link == (guide or state.mechanism.frame)]
            off = [abs(way @ vector.value if vector.is_perpendicular else cross(way, vector.value)) for way in ways]
            assert min(off) <= scale
        else:
            assert vector.is_perpendicular == (vector.part is not VectorPart.CENTRIPETAL)
            reach = place(polygon, vector.of) - place(polygon, vector.against)
            length = hypot(*reach)
            off = reach @ vector.value if vector.is_perpendicular else cross(reach, vector.value)
            assert abs(off) <= scale * length
            if vector.part is VectorPart.CENTRIPETAL:
                assert vector.towards == vector.against
                assert reach @ vector.value <= scale * length
        if not vector.known:
            assert vector.towards == ""
        elif vector.part is VectorPart.TANGENTIAL and not vector.towards.startswith(("to the", "upwards", "downwards")):
            # the letter of the velocity polygon to which it points
            head, tail = (letter_of(speeds, point) for point in (vector.of, vector.against))
            relative = speeds.letters[head] - speeds.letters[tail]
            assert vector.towards == (head if relative @ vector.value > 0.0 else tail)
            assert abs(cross(relative, vector.value)) <= tolerance * largest(speeds) * size + scale * hypot(*relative)
        elif vector.part is not VectorPart.CENTRIPETAL:
            assert vector.towards == direction_sense(vector.value)


def images_are_similar_and_of_the_same_sense(polygon, tolerance):
    state, order = polygon.state, order_of(polygon)
    scale = tolerance * largest(polygon)
    for stage in polygon.stages:
        if not isinstance(stage, PointImage):
            continue
        points = (*stage.base, stage.point)
        ends = [polygon.letters[letter_of(polygon, point)] for point in points]
        for point, value in zip(points, ends, strict=True):
            np.testing.assert_allclose(moved(state, stage.link, place(polygon, point), order), value, atol=scale)
        if stage.sense == "same":
            np.testing.assert_allclose(ends[2], ends[0], atol=scale)
            continue
        space = [complex(*place(polygon, point)) for point in points]
        image = [complex(*value) for value in ends]
        shape = (space[2] - space[0]) / (space[1] - space[0])
        # similar and read in the same order, as complex numbers: no reflection passes this
        assert abs(image[2] - image[0] - shape * (image[1] - image[0])) <= scale
        if stage.sense:
            assert stage.sense == ("anticlockwise" if shape.imag > 0.0 else "clockwise")
            grown = abs(image[1] - image[0]) / abs(space[1] - space[0])
            assert stage.ratio == pytest.approx(grown, rel=1e-6, abs=scale)
        else:
            assert abs(shape.imag) < 1e-6
            assert stage.ratio == pytest.approx(shape.real)


def turns_are_those_of_the_links(polygon, tolerance):
    state = polygon.state
    for turn in polygon.stages:
        if not isinstance(turn, TurningRate):
            continue
        link = state.link(turn.link)
        rate = link.angular_velocity if polygon.kind == "velocity" else link.angular_acceleration
        assert turn.value == pytest.approx(rate)
        if turn.sense != "does not turn":
            assert turn.sense == ("anticlockwise" if rate > 0.0 else "clockwise")
        if turn.by:
            assert turn.by in polygon.state.pairs
            assert turn.vector == ("", "")
        else:
            tail, head = (polygon.letters[each] for each in turn.vector)
            scale = tolerance * largest(polygon)
            assert hypot(*(head - tail)) == pytest.approx(turn.magnitude, abs=scale)
            assert turn.magnitude == pytest.approx(abs(turn.value) * turn.length, abs=scale)
            (vector,) = {(v.of, v.against): v for v in vectors(polygon) if (v.tail, v.head) == turn.vector}.values()
            apart = place(polygon, vector.of) - place(polygon, vector.against)
            assert (turn.line, turn.length) == (vector.line, pytest.approx(hypot(*apart)))


def equations_hold_for_the_rates_of_the_state(polygon, tolerance):
    state, order = polygon.state, order_of(polygon)
    for stage in polygon.stages:
        if not isinstance(stage, SimultaneousSolution):
            continue
        values = {unknown.name: unknown.value for unknown in stage.unknowns}
        assert len(values) == len(stage.unknowns)
        for unknown in stage.unknowns:
            if unknown.is_angular:
                symbol, link = unknown.name[0], unknown.name[2:]
                assert symbol == ("ω" if order == 1 else "α")
                assert unknown.value == pytest.approx(spin(state, link, order))
            else:
                symbol, _, pair = unknown.name.partition(" at ")
                assert symbol == ("v" if order == 1 else "a")
                assert unknown.value in [parts(own, order) for own in state.own[pair]]
        rows = []
        for equation in stage.equations:
            row = dict.fromkeys(values, 0.0) | dict(equation.terms)
            rows.append(list(row.values()))
            terms = [slope * values[name] for name, slope in equation.terms]
            most = max(map(abs, (*terms, equation.known)))
            assert abs(sum(terms) - equation.known) <= tolerance * max(most, largest(polygon))
        if state.mobility == len(state.mechanism.inputs):
            assert np.linalg.matrix_rank(np.array(rows)) == len(values)
            assert len(rows) == len(values)


def lines_of(polygon, vector):
    """The directions that a vector of unknown magnitude may have by what is drawn in the space diagram."""
    if vector.part is VectorPart.SLIDING:
        guide = vector.line.removeprefix("line on ") if vector.line.startswith("line on ") else None
        state = polygon.state
        return [way for _, link, way in guide_lines(state) if link == (guide or state.mechanism.frame)]
    x, y = place(polygon, vector.of) - place(polygon, vector.against)
    return [np.array([-y, x]) / hypot(x, y)]


def a_pencil_can_draw_it_in_this_order(polygon, tolerance):
    there = {*polygon.pole}
    for stage in polygon.stages:
        if isinstance(stage, PointImage):
            assert {letter_of(polygon, point) for point in stage.base} <= there
            there.add(letter_of(polygon, stage.point))
        elif isinstance(stage, SimultaneousSolution):
            assert not {*stage.letters} & there
            there |= {*stage.letters}
        elif isinstance(stage, TurningRate):
            assert {*stage.vector} - {""} <= there
        else:
            _meets(polygon, stage, there, tolerance)
    assert there == {*polygon.letters}


def _meets(polygon, stage: Meeting, there: set[str], tolerance: float):
    """The letter of a meeting from letters that are there, known vectors and the directions of unknown ones."""
    assert 1 <= len(stage.sides) <= 2
    before = {*there}
    lines = []
    for side in stage.sides:
        assert side.start in before
        at = polygon.letters[side.start]
        for vector in side.vectors:
            assert vector.tail in there
            there.add(vector.head)
            assert vector.known or vector is side.vectors[-1]
            at = at + vector.value if vector.known else at
        last = side.vectors[-1] if side.vectors and not side.vectors[-1].known else None
        lines.append((at, [] if last is None else lines_of(polygon, last)))
    assert stage.letter in there
    goal, scale = polygon.letters[stage.letter], tolerance * largest(polygon)
    done = [at for at, ways in lines if not ways]
    for at in done:
        np.testing.assert_allclose(at, goal, atol=scale)
    if not done:
        # a link may have several lines: two of them that are not parallel meet in the letter
        (start, ways), (stop, others) = lines
        pairs = [(way, other) for way in ways for other in others if abs(cross(way, other)) > 1e-8]
        apart = []
        for way, other in pairs:
            along, _ = np.linalg.solve(np.array([way, -other]).T, stop - start)
            apart.append(hypot(*(start + along * way - goal)) * abs(cross(way, other)))
        assert min(apart) <= 10.0 * scale


LAWS = [
    every_side_closes,
    letters_are_what_the_state_has,
    magnitudes_are_made_of_their_factors,
    directions_are_those_of_the_space_diagram,
    images_are_similar_and_of_the_same_sense,
    turns_are_those_of_the_links,
    equations_hold_for_the_rates_of_the_state,
    a_pencil_can_draw_it_in_this_order,
]


@pytest.mark.parametrize("stem", some_models(3))
@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.__name__)
def test_law_holds_for_every_model(law, stem):
    for kind in KINDS:
        law(drawn(stem, kind), TIGHT)


some = settings(
    max_examples=draws(8), deadline=None, suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow]
)


@some
@given(st.integers(0, 10**6), st.integers(1, 9), st.sampled_from([0.0, 0.0, 0.3]))
@example(1, 3, 0.3)  # a rack and its guide say the same twice
@example(1, 5, 0.3)  # a wheel turns with one that is not of the group
@example(534895, 4, 0.3)  # a link whose turning is known helps to hold a group
@example(124802, 4, 0.0)  # out from a letter and back to it
@example(130031, 3, 0.0)
def test_laws_hold_for_random_linkages(seed, links, higher):
    _, state = assembled(random_linkage(seed, links, 0.0, higher), 0.02)
    for draw in KINDS.values():
        polygon = draw(state)
        for law in LAWS:
            # a group that drives the next near one of its limits multiplies rounding by its condition, squared
            law(polygon, 1e-7)


def turned(value, turn):
    """The file of a linkage of turning and sliding pairs, with its frame turned round the origin."""
    cos, sin = np.cos(turn), np.sin(turn)

    def about(spot):
        return [cos * spot[0] - sin * spot[1], sin * spot[0] + cos * spot[1]]

    frame = {"points": {name: about(spot) for name, spot in value["links"]["frame"]["points"].items()}}
    pairs, shifted = [], {}
    for entry in value["pairs"]:
        first, second = entry["links"]
        changed = dict(entry)
        if "line" in entry and first == "frame":
            changed["line"] = entry["line"] | {"angle": entry["line"]["angle"] + turn}
        if "turn" in entry and second == "frame":
            changed["turn"] = entry["turn"] - turn
        if "turning" in entry and "frame" in (first, second):
            shifted[entry["turning"]] = turn
        pairs.append(changed)
    inputs = [each | {"position": each["position"] + shifted.get(each["pair"], 0.0)} for each in value["inputs"]]
    sketch = {name: about(spot) for name, spot in value["sketch"].items()}
    return value | {"links": value["links"] | {"frame": frame}, "pairs": pairs, "inputs": inputs, "sketch": sketch}


def plan(polygon):
    """What is drawn in which order, without its directions."""
    for stage in polygon.stages:
        if isinstance(stage, Meeting):
            sides = [
                [(v.part, v.of, v.against, v.tail, v.head, v.known, v.line) for v in s.vectors] for s in stage.sides
            ]
            yield stage.letter, sides
        elif isinstance(stage, PointImage):
            yield stage.link, stage.base, stage.point, stage.sense
        elif isinstance(stage, TurningRate):
            yield stage.link, stage.sense, stage.vector
        else:
            yield stage.links, stage.letters, [unknown.name for unknown in stage.unknowns]


@some
@given(st.integers(0, 10**6), st.integers(1, 9), st.floats(-3.0, 3.0))
@example(31859, 7, 0.5)  # a known link is reached by a pin whose first link is reached by it
def test_a_linkage_turned_as_a_whole_has_its_polygons_turned(seed, links, turn):
    built = random_linkage(seed, links)
    _, state = assembled(built, 0.05)
    other = solve(files.from_dict(turned(built.value, turn)))
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    for draw in KINDS.values():
        one, two = draw(state), draw(other)
        assert [*plan(one)] == [*plan(two)]
        for letter, value in one.letters.items():
            np.testing.assert_allclose(two.letters[letter], rotation @ value, atol=1e-7 * largest(one))


# The chapters' tables: what is drawn, its letters, its magnitude in the book with the tolerance of the case, what it
# is parallel or square to, and where it points. No magnitude: the direction alone is known.
C, T, S = VectorPart.CENTRIPETAL, VectorPart.TANGENTIAL, VectorPart.SLIDING
TABLES = {
    "3.3 of 002-E3.1": [
        (C, "BA", "a_1 b_a", 5.51, 0.002, "∥ AB", "A"),
        (T, "BA", "b_a b_1", 1.3, 0.001, "⊥ AB", "a"),
        (C, "CB", "b_1 c_b", 1.75, 0.03, "∥ BC", "B"),
        (T, "CB", "c_b c_1", None, 0, "⊥ BC", ""),
        (C, "CD", "d_1 c_d", 2.72, 0.06, "∥ DC", "D"),
        (T, "CD", "c_d c_1", None, 0, "⊥ DC", ""),
    ],
    "3.4 of 002-E3.2": [
        (C, "AO", "o_1 a_1", 192, 0.001, "∥ OA", "O"),
        (C, "BA", "a_1 b_a", 17.2, 0.12, "∥ AB", "A"),
        (T, "BA", "b_a b_1", None, 0, "⊥ AB", ""),
        (S, "BG", "g_1 b_1", None, 0, "∥ line of motion of B", ""),
    ],
    "3.5 and 3.6 of 002-E3.3": [
        (C, "AO", "o_1 a_1", 5.92, 0.005, "∥ OA", "O"),
        (C, "CA", "a_1 c_a", 1.79, 0.04, "∥ AC", "A"),
        (T, "CA", "c_a c_1", None, 0, "⊥ AC", ""),
        (C, "CQ", "q_1 c_q", 8.96, 0.04, "∥ QC", "Q"),
        (T, "CQ", "c_q c_1", None, 0, "⊥ QC", ""),
        (C, "BD", "d_1 b_d", 0.49, 0.06, "∥ DB", "D"),
        (T, "BD", "b_d b_1", None, 0, "⊥ DB", ""),
        (S, "BG", "g_1 b_1", None, 0, "∥ line of motion of B", ""),
    ],
    "3.7 of 002-E3.4": [
        (C, "AO", "o_1 a_1", 96.8, 0.005, "∥ OA", "O"),
        (C, "BA", "a_1 b_a", 6.4, 0.03, "∥ AB", "A"),
        (T, "BA", "b_a b_1", None, 0, "⊥ AB", ""),
        (S, "BG", "g_1 b_1", None, 0, "∥ line of motion of B", ""),
        (C, "DC", "c_1 d_c", 38.1, 0.15, "∥ CD", "C"),
        (T, "DC", "d_c d_1", None, 0, "⊥ CD", ""),
        (S, "DG′", "g′_1 d_1", None, 0, "∥ line of motion of D", ""),
        (C, "FE", "e_1 f_e", 14.3, 0.05, "∥ EF", "E"),
        (T, "FE", "f_e f_1", None, 0, "⊥ EF", ""),
        (S, "FG′′", "g′′_1 f_1", None, 0, "∥ line of motion of F", ""),
    ],
    "3.8 of 002-E3.5": [
        (C, "AO", "o_1 a_o", 96.8, 0.005, "∥ OA", "O"),
        (T, "AO", "a_o a_1", 12, 0.001, "⊥ OA", "a"),
        # the book takes B's way from Q before that from A
        (C, "BA", "a_1 b_a", 5.93, 0.08, "∥ AB", "A"),
        (T, "BA", "b_a b_1", None, 0, "⊥ AB", ""),
        (C, "BQ", "q_1 b_q", 38.3, 0.03, "∥ QB", "Q"),
        (T, "BQ", "b_q b_1", None, 0, "⊥ QB", ""),
        (C, "DB", "b_1 d_b", 20, 0.03, "∥ BD", "B"),
        (T, "DB", "d_b d_1", None, 0, "⊥ BD", ""),
        (S, "DG", "g_1 d_1", None, 0, "∥ line of motion of D", ""),
    ],
    "3.9 and 3.10 of 002-E3.6a": [
        # here and below the book begins at O
        (C, "BQ", "q_1 b_1", 22.2, 0.005, "∥ QB", "Q"),
        (C, "AO", "o_1 a_1", 9.87, 0.005, "∥ OA", "O"),
        (C, "CB", "b_1 c_b", 0.078, 0.9, "∥ BC", "B"),
        (T, "CB", "c_b c_1", None, 0, "⊥ BC", ""),
        (C, "CA", "a_1 c_a", 3.55, 0.08, "∥ AC", "A"),
        (T, "CA", "c_a c_1", None, 0, "⊥ AC", ""),
        (C, "DC", "c_1 d_c", 4.17, 0.08, "∥ CD", "C"),
        (T, "DC", "d_c d_1", None, 0, "⊥ CD", ""),
        (S, "DG", "g_1 d_1", None, 0, "∥ line of motion of D", ""),
    ],
}


@pytest.mark.parametrize("table", TABLES)
def test_rows_are_those_of_the_chapter(table):
    rows, found = TABLES[table], vectors(drawn(table.split()[-1], "acceleration"))
    assert len(rows) == len(found)
    for (part, points, letters, magnitude, tolerance, line, towards), vector in zip(rows, found, strict=True):
        assert (vector.part, f"{vector.of}{vector.against}") == (part, points)
        assert f"{vector.tail} {vector.head}" == letters
        assert f"{'⊥' if vector.is_perpendicular else '∥'} {vector.line}" == line
        assert vector.towards == towards
        assert vector.known == (magnitude is not None)
        if magnitude is not None:
            assert hypot(*vector.value) == pytest.approx(magnitude, rel=tolerance)


@pytest.mark.parametrize(
    ("stem", "link", "value", "tolerance", "vector", "line"),
    [
        ("002-E3.1", "BC", 34.09, 0.04, "c_b c_1", "BC"),
        ("002-E3.1", "DC", 79.11, 0.03, "c_d c_1", "DC"),
        ("002-E3.2", "AB", 104, 0.02, "b_a b_1", "AB"),
        ("002-E3.3", "AC", 23, 0.02, "c_a c_1", "AC"),
        ("002-E3.3", "CQD", 13.8, 0.06, "c_q c_1", "QC"),
        ("002-E3.3", "DB", -14.4, 0.03, "b_d b_1", "DB"),
        ("002-E3.5", "BD", 109.2, 0.03, "d_b d_1", "BD"),
        ("002-E3.6a", "AC", -142.7, 0.06, "c_a c_1", "AC"),
        ("002-E3.6a", "BC", 47.8, 0.08, "c_b c_1", "BC"),
    ],
)
def test_angular_accelerations_are_measured_as_in_the_chapter(stem, link, value, tolerance, vector, line):
    (turn,) = (
        each for each in drawn(stem, "acceleration").stages if isinstance(each, TurningRate) and each.link == link
    )
    assert " ".join(turn.vector) == vector
    assert turn.line == line
    assert turn.value == pytest.approx(value, rel=tolerance)
    assert turn.sense == ("anticlockwise" if value > 0 else "clockwise")


def test_images_of_the_four_bar_are_read_as_in_the_chapter():
    images = [stage for stage in drawn("002-E3.1", "acceleration").stages if isinstance(stage, PointImage)]
    assert [(each.base, each.point, each.sense) for each in images] == [
        (("B", "C"), "E", ""),
        (("B", "C"), "F", "clockwise"),
        (("C", "D"), "G", "anticlockwise"),
    ]
    assert images[0].ratio == pytest.approx(40 / 66)


def test_a_produced_link_has_its_image_produced():
    (image,) = (stage for stage in drawn("002-E3.2", "acceleration").stages if isinstance(stage, PointImage))
    assert (image.base, image.point) == (("A", "B"), "E")
    assert image.ratio == pytest.approx(-450 / 1600)


def coriolis(polygon) -> PolygonVector:
    (found,) = (vector for vector in vectors(polygon) if vector.part is VectorPart.CORIOLIS)
    return found


def test_quick_return_has_the_coriolis_part_and_the_ram_of_its_closed_form():
    """Crank r about O, lever about C at a distance d below, ram of a link q from the lever's end at the height h."""
    state = solved("004-QR")
    r, d, long, q, h, w = 0.1, 0.25, 0.5, 0.2, 0.24, 10.0
    a = np.radians(30.0)
    s = np.sqrt(r**2 + d**2 + 2 * r * d * np.sin(a))
    lever = np.arctan2(d + r * np.sin(a), r * np.cos(a))
    turn = w * r * (r + d * np.sin(a)) / s**2
    second = w**2 * r * d * np.cos(a) * (d**2 - r**2) / s**4
    speed = r * d * np.cos(a) * w / s
    away = (-r * d * np.sin(a) * w**2 - speed**2) / s
    along = np.array([np.cos(lever), np.sin(lever)])
    across = np.array([-along[1], along[0]])
    # the chapter's example goes from the crank pin to the lever: the lever's point against the block
    velocity, polygon = drawn("004-QR", "velocity"), drawn("004-QR", "acceleration")
    np.testing.assert_allclose(velocity.letters["a"] - velocity.letters["a′"], speed * along, atol=1e-12)
    vector = coriolis(polygon)
    sign = {("A", "A′"): 1.0, ("A′", "A"): -1.0}[vector.of, vector.against]
    np.testing.assert_allclose(sign * vector.value, 2.0 * turn * speed * across, atol=1e-12)
    assert [(factor.symbol, factor.power) for factor in vector.factors] == [("2", 1), ("ω_CD", 1), ("(aa′)", 1)]
    (sliding,) = (v for v in vectors(polygon) if (v.of, v.against, v.part) == (vector.of, vector.against, S))
    np.testing.assert_allclose(sign * sliding.value, away * along, atol=1e-12)
    end = long * (second * across - turn**2 * along)
    np.testing.assert_allclose(polygon.letters["d_1"], end, atol=1e-12)
    (y, rise), up = (long * along[1] - d, long * turn * across[1]), end[1]
    reach = np.sqrt(q**2 - (h - y) ** 2)
    closing = (h - y) * rise / reach
    ram = long * turn * across[0] + closing
    np.testing.assert_allclose(velocity.letters["r"], [ram, 0.0], atol=1e-12)
    ram = end[0] + ((h - y) * up - rise**2 - closing**2) / reach
    np.testing.assert_allclose(polygon.letters["r_1"], [ram, 0.0], atol=1e-12)
    assert state.link("CD").angular_velocity == pytest.approx(turn)


def test_block_on_a_coupler_has_the_coriolis_part_of_its_loops():
    """Four-bar OABQ by two circles, PD to the coupler by a circle and a line; rates by the loops' slopes."""
    crank, coupler, rocker, arm, w = 0.6, 1.9, 1.0, 1.4, 4.0 * np.pi
    q, p = 1.9 + 0j, 0.1 - 0.6j
    a = crank * np.exp(1j * np.radians(115.0))
    apart = abs(q - a)
    angle = between(coupler, apart, rocker)
    b = a + coupler * (q - a) / apart * np.exp(1j * angle)
    way = (b - a) / coupler

    def rates(one, other, known):
        """x and y of one x + other y = known, complex."""
        return np.linalg.solve([[one.real, other.real], [one.imag, other.imag]], [known.real, known.imag])

    coupler_rate, _ = rates(1j * (b - a), -1j * (b - q), -1j * w * a)
    foot = ((p - a) * way.conjugate()).real
    s = foot + np.sqrt(arm**2 - abs(a + foot * way - p) ** 2)
    pin = a + s * way
    sliding, arm_rate = rates(way, -1j * (pin - p), -1j * w * a - 1j * coupler_rate * s * way)
    assert sliding == pytest.approx(9.3, rel=0.02)
    assert abs(arm_rate) == pytest.approx(1.64, rel=0.02)
    vector = coriolis(drawn("004-OABQ", "acceleration"))
    assert (vector.of, vector.against, vector.tail, vector.head) == ("D", "D′", "d′_1", "d_d′")
    np.testing.assert_allclose(complex(*vector.value), 2.0 * coupler_rate * sliding * 1j * way, rtol=1e-10)
    assert [factor.value for factor in vector.factors] == pytest.approx([2.0, abs(coupler_rate), abs(sliding)])


# What no two lines locate, and where letters go


def test_double_butterfly_is_told_to_need_equations_from_its_crank_on():
    polygon = drawn("double-butterfly", "velocity")
    turn, meeting, group = polygon.stages[:3]
    assert (turn.link, meeting.letter) == ("OA", "a")
    assert isinstance(group, SimultaneousSolution)
    assert len(group.unknowns) == len(group.equations) == 6
    assert {*polygon.pole} == {"o", "b", "c"}


def test_a_block_that_only_turns_with_a_group_is_located_by_two_lines_afterwards():
    polygon = drawn("stephenson-valve-gear", "acceleration")
    group = next(index for index, stage in enumerate(polygon.stages) if isinstance(stage, SimultaneousSolution))
    assert "d_1" not in polygon.stages[group].letters
    (meeting,) = (stage for stage in polygon.stages[group:] if isinstance(stage, Meeting))
    assert meeting.letter == "d_1"
    assert [side.vectors[-1].part for side in meeting.sides] == [S, S]


def test_the_image_of_a_link_that_does_not_turn_is_at_the_letter_of_a_point_of_it():
    (image,) = (stage for stage in drawn("004-COS", "velocity").stages if isinstance(stage, PointImage))
    # the yoke's own point below the block, not the block's
    assert (image.link, image.base, image.point, image.sense) == ("yoke", ("A′", "A′"), "B", "same")


def test_what_turns_about_a_fixed_pin_is_drawn_from_the_pole():
    (last,) = (s for s in drawn("coupled-wheels", "velocity").stages if isinstance(s, Meeting) and s.letter == "c")
    assert last.sides[0].start == "c0"
    assert "c0" in drawn("coupled-wheels", "velocity").pole


def four_bar_with_pins(names: str) -> dict:
    a, b, c, d = names.split()
    links, rates = ["frame", "crank", "coupler", "rocker"], {"omega": 2.0, "alpha": 1.0}
    return four_bar_document(1, 3.5, 2.5, 4, 1.0, pins=[a, b, c, d], names=links, sketch={c: [3, 2.5]}, **rates)


@pytest.mark.parametrize("names", ["2 1 3 4", "b B a A", "a_1 a 1 a_a", "A′ A B G", "G H K S", "b_1 b b_b b_1_1"])
def test_odd_names_of_points_get_letters_of_their_own(names):
    state = solve(files.from_dict(four_bar_with_pins(names)))
    for kind, draw in KINDS.items():
        polygon = draw(state)
        moving = {names.split()[1], names.split()[2]}
        assert moving <= {*polygon.points.values()}
        assert len(polygon.pole) == 2
        for law in LAWS:
            law(polygon, TIGHT)
        if kind == "acceleration":
            # pole 2, points 2, heads of centripetal parts 3
            assert len(polygon.letters) == 7


@pytest.mark.parametrize("draw", [velocity_polygon, acceleration_polygon])
def test_beside_a_point_very_far_off_all_others_are_in_one_place(draw):
    """C and T, 0.05 m and 0.1 m from O, are where o is in an image of 1e9 m."""
    far = planar.load("cardan-gears").with_values({"wheel.N.distance": 1e9})
    state = planar.solve(far)
    found = draw(state)
    by_point = {point: letter for letter, point in found.points.items()}
    value = state.point("N").velocity if draw is velocity_polygon else state.point("N").acceleration
    np.testing.assert_allclose(found.letters[by_point["N"]], value, rtol=1e-9)
    assert np.hypot(*found.letters[by_point["C"]]) < 1e-8 * np.hypot(*value)


@pytest.mark.parametrize("by", [1e-11, 1e-6, 1e6])
def test_polygons_of_a_mechanism_of_any_size_are_alike(by):
    found, plain = (velocity_polygon(solve(bars(*(each * k for each in (1, 3, 2.5, 3.5)), 0.9))) for k in (by, 1.0))
    assert (found.points, list(found.letters)) == (plain.points, list(plain.letters))
    assert [type(each) for each in found.stages] == [type(each) for each in plain.stages]
    for letter, place in plain.letters.items():
        np.testing.assert_allclose(found.letters[letter], by * place, rtol=1e-9, atol=1e-12 * by)
