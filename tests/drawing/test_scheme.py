"""Schemes: what pair types say of themselves lies where they touch; every model is drawn true, clear and complete."""

from functools import cache
from itertools import combinations
from math import acos, cos, hypot, isfinite, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import planar
from planar.document import files
from planar.drawing.labels.placement import place_labels
from planar.drawing.output.matplotlib_figure import draw_pictures
from planar.drawing.paper.picture import Arrow, Circle, Fill, Label, Pen, Picture, Polyline, extent
from planar.drawing.paper.scales import Scale
from planar.drawing.paper.scales import parse_scale as reading
from planar.drawing.scheme import symbol_table
from planar.drawing.scheme.details import AROUND, scheme_with_details
from planar.drawing.scheme.ground import ground_marks
from planar.drawing.scheme.link_bodies import convex_hull, link_bodies, link_outlines
from planar.drawing.scheme.link_strokes import body_marks
from planar.drawing.scheme.scene import plain_frames
from planar.drawing.scheme.scheme import scheme
from planar.foundation.geometry import Vector, frame_at
from planar.foundation.units import parse_unit
from planar.model.link_graph import link_numbers
from planar.model.link_shapes import link_shape
from planar.model.mechanism import Drive, named_points, replace_inputs
from planar.model.pairs import MeasureKind, pair_types
from planar.model.pairs.symbols import BeltMark, GuideMark, PinMark, PitchLineMark, SliderMark, SlotMark, WheelMark
from tests.builders import four_bar_document
from tests.draws import draws, part
from tests.known import some_models
from tests.known import state_of as solved
from tests.linkages import random_linkage

SAMPLES = [sample for kind in pair_types().values() for sample in kind.samples()]
every_sample = pytest.mark.parametrize("sample", SAMPLES, ids=lambda sample: f"{sample.pair.keyword} {sample.entry}")
every_model = pytest.mark.parametrize("name", some_models(3))
UNIT = Scale("length", 1e-3, "mm")


@cache
def drawn(name) -> Picture:
    return scheme(solved(name))


def told(sample):
    """A sample's links, its pair and those beside it, with the marks of the pair."""
    shapes = dict(zip("abc", sample.shapes, strict=False))
    links = {name: {"points": {p: list(at) for p, at in each.points.items()}} for name, each in shapes.items()}
    value = {"planar": 1, "frame": "ground", "links": {"ground": {"points": {"G": [0, 0]}}, **links}}
    mechanism = files.from_dict(value | {"pairs": [sample.entry, *sample.other_entries]})
    return shapes, mechanism.pairs, mechanism.pairs[0].drawing_marks(shapes, mechanism.pairs)


def made(value):
    return planar.solve(files.from_dict({"planar": 1, "units": {"length": "mm", "angle": "deg"}, **value}))


def spots(mark):
    if isinstance(mark, Polyline):
        return list(mark.points)
    if isinstance(mark, Arrow):
        return [mark.tail, mark.head]
    return [mark.centre] if isinstance(mark, Circle) else [mark.at]


def about(picture, text, kind=None):
    return [mark for mark in picture.marks if mark.about == text and (kind is None or isinstance(mark, kind))]


def off_line(point, through, way):
    return abs(way.cross(point - through))


def test_every_pair_type_says_how_it_is_drawn():
    for name, kind in pair_types().items():
        assert any(told(sample)[2] for sample in kind.samples()), name


@every_sample
def test_marks_lie_where_the_pair_touches(sample):
    _, _, marks = told(sample)
    frames = dict(zip("abc", sample.frames, strict=False))
    riders = {mark.name: (mark.link, mark.position) for mark in marks if isinstance(mark, SliderMark)}
    for mark in marks:
        if isinstance(mark, PinMark):
            first, second = (frames[link].to_world(at) for link, at in zip(mark.links, mark.positions, strict=True))
            assert first == pytest.approx(second, abs=1e-14)
        elif isinstance(mark, GuideMark):
            link, at = riders[mark.name]
            through, way = frames[mark.link].to_world(mark.through), frames[mark.link].rotate_to_world(mark.direction)
            assert off_line(frames[link].to_world(at), through, way) < 1e-14
            block = next(each for each in marks if isinstance(each, SliderMark))
            assert block.guide_link == mark.link
            assert frames[link].rotate_to_world(block.direction) == pytest.approx(way, abs=1e-14)
        elif isinstance(mark, SlotMark):
            through, way = frames[mark.link].to_world(mark.through), frames[mark.link].rotate_to_world(mark.direction)
            assert off_line(frames[mark.pin_link].to_world(mark.pin_position), through, way) < 1e-14
        elif isinstance(mark, PitchLineMark):
            through, way = frames[mark.link].to_world(mark.through), frames[mark.link].rotate_to_world(mark.direction)
            centre = frames[mark.wheel.link].to_world(mark.wheel.centre)
            assert off_line(centre, through, way) == pytest.approx(mark.wheel.radius, abs=1e-14)
        if hasattr(mark, "way"):
            assert hypot(*mark.direction) == pytest.approx(1.0, abs=1e-14)


@every_sample
def test_marks_part_as_the_residual_says_when_the_pair_is_pulled_apart(sample):
    shapes, _, marks = told(sample)
    pair = sample.pair
    shift = Vector(0.03, -0.02)
    frames = list(sample.frames)
    frames[1] = frames[1]._replace(x=frames[1].x + shift.x, y=frames[1].y + shift.y)
    numbers = pair.measure([shapes[link] for link in pair.bodies])
    left = [float(each) for each in pair.residual(frames, numbers, sample.own)]
    lengths = [each for each, kind in zip(left, pair.residual_kinds, strict=True) if kind is MeasureKind.LENGTH][:2]
    named = dict(zip("abc", frames, strict=False))
    for mark in marks:
        if isinstance(mark, PinMark):
            first, second = (named[link].to_world(at) for link, at in zip(mark.links, mark.positions, strict=True))
            assert second - first == pytest.approx(lengths, abs=1e-14)
        elif isinstance(mark, GuideMark | SlotMark):
            link, at = (
                (mark.pin_link, mark.pin_position)
                if isinstance(mark, SlotMark)
                else next((each.link, each.position) for each in marks if isinstance(each, SliderMark))
            )
            through, way = named[mark.link].to_world(mark.through), named[mark.link].rotate_to_world(mark.direction)
            # along the line the pair's own displacement would follow, across it the gap is what the residual leaves
            gap = (named[link].to_world(at) - through).cross(way)
            assert gap == pytest.approx(Vector(*lengths).cross(way), abs=1e-14)


@every_sample
def test_pitch_circles_roll_on_one_another_as_the_pair_turns(sample):
    shapes, _, marks = told(sample)
    wheels = [mark for mark in marks if isinstance(mark, WheelMark)]
    bands = [mark for mark in marks if isinstance(mark, BeltMark)]
    if len(wheels) != 2:
        return
    a, b = wheels
    numbers = sample.pair.measure([shapes[link] for link in sample.pair.bodies])

    def left(first, second):
        frames = frame_at(0.0, 0.0, first), frame_at(0.0, 0.0, second), frame_at(0.0, 0.0, 0.0)
        return float(sample.pair.residual(frames, numbers, ())[0])

    turned = -(left(1.0, 0.0) - left(0.0, 0.0)) / (left(0.0, 1.0) - left(0.0, 0.0))  # of b, to one turn of a
    centres = [shapes["c"].points[point] for point in ("A", "B")]
    apart = hypot(*(centres[1] - centres[0]))
    if bands:
        assert turned == pytest.approx((-1 if bands[0].crossed else 1) * a.radius / b.radius, rel=1e-13)
    else:
        # rolling: at the point where the circles touch both rims have one velocity
        assert abs(a.radius + b.radius) == pytest.approx(apart, rel=1e-13)
        assert turned == pytest.approx(-a.radius / b.radius, rel=1e-13)


def geared(by, sizes, keyword="gear", apart=100.0, **more):
    return made(
        {
            "frame": "f",
            "links": {
                "f": {"points": {"A": [0, 0], "B": [apart, 0]}},
                "p": {"ends": ["A", "P"], "length": 20},
                "q": {"ends": ["B", "Q"], "length": 20},
            },
            "pairs": [{"turning": "A"}, {"turning": "B"}, {keyword: "w", "links": ["p", "q"], by: sizes, **more}],
            "inputs": [{"pair": "A", "position": 30, "velocity": "2 rad/s"}],
        }
    )


@pytest.mark.parametrize(
    ("by", "sizes", "radii"),
    [
        ("teeth", [20, 30], (40.0, 60.0)),
        ("ratio", -4.0, (80.0, 20.0)),
        ("ratio", 2.0, (-200.0, 100.0)),
        ("ratio", 0.25, (100 / 3, -400 / 3)),
        ("teeth", [-60, 20], (-150.0, 50.0)),
    ],
)
def test_pitch_radii_follow_from_the_distance_of_the_centres(by, sizes, radii):
    state = geared(by, sizes)
    wheels = state.mechanism.pairs[2].drawing_marks(state.shapes, state.mechanism.pairs)
    assert [mark.radius * 1e3 for mark in wheels] == pytest.approx(radii, rel=1e-12)
    # drawn: one pitch circle each, an internal one with its rim
    circles = about(scheme(state, UNIT), "gear w", Circle)
    assert sorted(c.radius for c in circles if c.pen is Pen.PITCH) == pytest.approx(sorted(map(abs, radii)))
    assert len(circles) == 2 + sum(radius < 0.0 for radius in radii)


def test_a_fixed_wheel_is_hatched_behind_its_rim():
    for name, wheel, rim, far in (
        ("planetary-gear-set", "gear outer mesh", 1, 1.0),
        ("belt-arm", "band belt", 0, -1.0),
    ):
        state = solved(name)
        scale = Scale("length", 1e-3, "mm")
        marks = about(scheme(state, scale), wheel)
        centre = state.point("O").position / 1e-3
        circles = [mark for mark in marks if isinstance(mark, Circle) and mark.centre == pytest.approx(tuple(centre))]
        radius = max(mark.radius for mark in circles)
        assert radius == pytest.approx((80.0 + symbol_table.RIM_WIDTH) if rim else 60.0)
        hatches = [mark for mark in marks if isinstance(mark, Polyline) and mark.pen is Pen.HATCH]
        assert len(hatches) > 6
        for hatch in hatches:
            start, stop = (np.hypot(*(np.array(each) - centre)) for each in hatch.points)
            assert start == pytest.approx(radius)
            assert (stop - start) * far > 0.5


def test_wheels_that_cannot_meet_or_have_no_common_carrier_have_no_circles():
    equal = geared("ratio", 1.0)
    assert equal.mechanism.pairs[2].drawing_marks(equal.shapes, equal.mechanism.pairs) == ()
    assert equal.mechanism.pairs[2].drawing_marks(equal.shapes, equal.mechanism.pairs[2:]) == ()
    assert scheme(equal).marks


@pytest.mark.parametrize(("crossed", "lean"), [(False, acos(30 / 100)), (True, acos(50 / 100))])
def test_a_band_is_tangent_to_both_its_wheels(crossed, lean):
    state = geared("radii", [40, 10], "belt", crossed=crossed)
    lines = about(scheme(state, UNIT), "band w", Polyline)
    assert len(lines) == 2
    for (x1, y1), (x2, y2) in (each.points for each in lines):
        sign = 1.0 if y1 > 0 else -1.0
        other = -sign if crossed else sign
        assert (x1, y1) == pytest.approx((40 * cos(lean), sign * 40 * sin(lean)), abs=1e-9)
        away = -10 * cos(lean) if crossed else 10 * cos(lean)
        assert (x2, y2) == pytest.approx((100 + away, other * 10 * sin(lean)), abs=1e-9)
        length = sqrt(100**2 - (50 if crossed else 30) ** 2)
        assert hypot(x2 - x1, y2 - y1) == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize("keyword", ["belt", "chain"])
def test_bands_given_by_ratio_fit_between_their_centres(keyword):
    for ratio in (-3.0, -1.0, 0.2, 1.0, 5.0):
        state = geared("ratio", ratio, keyword)
        first, second, band = state.mechanism.pairs[2].drawing_marks(state.shapes, state.mechanism.pairs)
        assert first.radius / second.radius == pytest.approx(abs(ratio), rel=1e-12)
        assert first.radius + second.radius < 0.1
        assert band.crossed == (ratio < 0.0)


@every_model
def test_joints_lie_at_their_places_to_scale(name):
    state = solved(name)
    scale = Scale("length", 2e-3, "mm")
    picture = scheme(state, scale)
    pins = {mark.about: mark for mark in picture.marks if mark.about.startswith("pin ")}
    together = {pair.entry_name() for pair in state.mechanism.pairs if pair.coincident_points()}
    for point in together:
        mark = pins.pop(f"pin {point}")
        assert mark.centre == pytest.approx(tuple(state.point(point).position / 2e-3), abs=1e-12)
        assert (mark.radius, mark.fill) == (symbol_table.PIN_RADIUS, Fill.PAPER)
    riding = {
        each.name: pair
        for pair in state.mechanism.pairs
        if (rides := pair.point_on_line()) is not None
        for each in named_points(state.mechanism)
        if rides[0] in each.members
    }
    for text, pin in pins.items():  # the rest are pins in slots
        point = text.removeprefix("pin ")
        assert pin.centre == pytest.approx(tuple(state.point(point).position / 2e-3), abs=1e-12)
        assert point in riding
    blocks = [mark for mark in picture.marks if mark.about.startswith("block ") and isinstance(mark, Polyline)]
    for mark in blocks:
        point = mark.about.removeprefix("block ")
        middle = np.mean(mark.points, axis=0)
        np.testing.assert_allclose(middle, state.point(point).position / 2e-3, atol=1e-9)
        (a, b, c, _) = (np.array(each) for each in mark.points)
        assert (np.linalg.norm(b - a), np.linalg.norm(c - b)) == pytest.approx(symbol_table.BLOCK_SIZE, rel=1e-9)


@every_model
def test_a_scheme_fits_its_sheet_with_all_names_and_numbers(name):
    state, picture = solved(name), drawn(name)
    (left, low), (right, high) = extent(picture.marks)
    assert all(isfinite(value) for mark in picture.marks for at in spots(mark) for value in at)
    assert max(right - left, high - low) >= 60.0
    assert right - left < 277.0
    assert high - low < 190.0
    lettered = {mark.about for mark in picture.marks if isinstance(mark, Label)}
    assert {f"point {point}" for point in state.point_names} <= lettered
    number = link_numbers(state.mechanism)
    texts = {mark.about: mark.text for mark in picture.marks if isinstance(mark, Label)}
    assert all(texts[f"number of {link}"] == text for link, text in number.items())
    assert picture.title == state.mechanism.name
    assert picture.notes[0].startswith(("Space diagram, 1 cm = ", "Space diagram, 1 in = "))


@every_model
def test_hatching_is_only_at_the_frame(name):
    state, picture = solved(name), drawn(name)
    owners = {
        mark.about for mark in picture.marks if isinstance(mark, Polyline) and mark.pen in (Pen.HATCH, Pen.GROUND)
    }
    frame = state.mechanism.frame
    allowed = set()
    for pair in state.mechanism.pairs:
        if frame in pair.links:
            allowed |= {f"ground {pair.entry_name()}", f"guide {pair.name}", f"gear {pair.name}", f"band {pair.name}"}
    allowed |= {f"ground of spring {k}" for k, each in enumerate(state.mechanism.springs, 1) if not each.is_torsional}
    assert owners <= allowed
    for pair in state.mechanism.pairs:
        if frame in pair.links and pair.coincident_points():
            supports = [mark for mark in about(picture, f"ground {pair.entry_name()}") if mark.pen is Pen.GROUND]
            pin = about(picture, f"pin {pair.entry_name()}")[0]
            assert pin.centre in supports[0].points  # the stand begins in its pin
        if frame in pair.links and pair.point_on_line() is not None:
            assert about(picture, f"guide {pair.name}")


@every_model
def test_every_moving_link_shows(name):
    state, picture = solved(name), drawn(name)
    shown = {mark.about for mark in picture.marks if not isinstance(mark, Label)}
    for pair in state.mechanism.pairs:
        for mark in pair.drawing_marks(state.shapes, state.mechanism.pairs):
            if isinstance(mark, SliderMark) and mark.link != state.mechanism.frame:
                point = next(
                    each.name for each in named_points(state.mechanism) if pair.point_on_line()[0] in each.members
                )
                shown |= {f"link {mark.link}"} if f"block {point}" in shown else set()
            elif isinstance(mark, WheelMark):
                shown |= {f"link {mark.link}"}
    for link in state.mechanism.links:
        if link.name != state.mechanism.frame:
            assert f"link {link.name}" in shown


@every_model
def test_input_arrows_point_the_way_that_the_input_drives(name):
    state, picture = solved(name), drawn(name)
    for given_input in state.mechanism.inputs:
        marks = about(picture, f"input {given_input.pair}")
        if given_input.velocity == given_input.acceleration == 0.0:
            assert marks == []
            continue
        arrow, *letters = marks
        assert all(isinstance(letter, Label) for letter in letters)
        along = 1.0 if (given_input.velocity or given_input.acceleration) > 0.0 else -1.0
        told = [rate * along for rate in (given_input.velocity, given_input.acceleration) if rate]
        words = [letter.text.replace("−", "-").split() for letter in letters]
        read = [parse_unit(unit).to_si(float(number)) for _, _, number, unit in words]
        assert read == pytest.approx(told, rel=5e-4)
        if not given_input.velocity:
            continue
        if isinstance(arrow, Arrow):
            rides = next(pair for pair in state.mechanism.pairs if pair.name == given_input.pair).point_on_line()
            (link, point), guide = rides
            frame = state.frames[guide]
            local = frame.to_local(state.frames[link].to_world(state.shapes[link].position(point)))
            rate = np.array([local.x.parts[1] if hasattr(local.x, "parts") else 0.0, local.y.parts[1]])
            cosine, sine = (each.parts[0] if hasattr(each, "parts") else each for each in (frame.cos, frame.sin))
            rate = np.array([cosine * rate[0] - sine * rate[1], sine * rate[0] + cosine * rate[1]])
            way = np.subtract(arrow.head, arrow.tail)
            sign = -1.0 if link == state.mechanism.frame else 1.0
            assert way @ rate * sign == pytest.approx(np.linalg.norm(way) * np.linalg.norm(rate), rel=1e-9)
        else:
            assert arrow.pen is Pen.INPUT
            rates = [abs(state.link(link.name).angular_velocity) for link in state.mechanism.links]
            assert max(rates) > 0.0


def test_the_arrow_of_a_crank_turns_as_the_crank_does():
    for speed, pointed in (("3 rad/s", 1), ("-3 rad/s", -1)):
        mechanism = planar.load("four-bar")
        state = planar.solve(replace_inputs(mechanism, (Drive("A", None, float(speed.split()[0]), 0.0),)))
        (arrow, letter) = about(scheme(state), "input A")
        assert (arrow.arrow_end, letter.text) == (pointed, "ω = 3 rad/s")
        assert arrow.centre == pytest.approx((0.0, 0.0), abs=1e-9)
    still = planar.solve(replace_inputs(mechanism, (Drive("A", None, 0.0, 0.0),)))
    assert about(scheme(still), "input A") == []


def test_alpha_stands_beside_omega_with_its_sense_along_the_arrow():
    mechanism = planar.load("four-bar")
    for velocity, acceleration, pointed, told in (
        (3.0, -26.0, 1, ["ω = 3 rad/s", "α = −26 rad/s²"]),
        (-3.0, -26.0, -1, ["ω = 3 rad/s", "α = 26 rad/s²"]),
        (0.0, -26.0, -1, ["α = 26 rad/s²"]),
    ):
        state = planar.solve(replace_inputs(mechanism, (Drive("A", None, velocity, acceleration),)))
        picture = scheme(state)
        arrow, *letters = about(picture, "input A")
        assert (arrow.arrow_end, [each.text for each in letters]) == (pointed, told)
        shown = place_labels([mark for mark in picture.marks if isinstance(mark, Label)], picture.marks)
        assert set(told) <= {each.label.text for each in shown}  # two texts, not one line


@pytest.mark.parametrize("name", ["slider-crank", "four-bar", "crank-rocker", "002-E3.1", "two-stroke-engine"])
def test_the_number_of_a_link_is_not_read_as_a_part_of_a_rate(name):
    """No figure stands close behind words in their line."""
    picture = scheme(planar.solve(planar.load(name)))
    shown = place_labels([mark for mark in picture.marks if isinstance(mark, Label)], picture.marks)
    rates = [each.box for each in shown if " = " in each.label.text]
    assert rates
    for each in shown:
        if each.label.text.isdigit():
            for box in rates:
                behind = 0.0 < each.box.left - box.right < 8.0
                assert not (behind and min(each.box.top, box.top) - max(each.box.bottom, box.bottom) > 0.5)


def test_a_coupler_has_its_points_on_its_line_and_beside_it():
    mechanism = planar.load("four-bar")
    body = link_bodies(mechanism, {link.name: link_shape(link) for link in mechanism.links})["BC"]
    assert body.plate == ()
    assert body.sides == ((Vector(0.0, 0.0), Vector(pytest.approx(0.066), 0.0)),)
    (b, f), (c, again) = body.tracers
    assert (hypot(*(f - b)), hypot(*(again - c))) == pytest.approx((0.045, 0.030))
    assert f.y < 0.0  # F is to the right of the way from B to C
    assert len(body.dots) == 2  # E on the line, F beside it


def test_a_point_on_a_produced_bar_lengthens_it():
    body = link_bodies(*parts("slider-crank"))["rod"]
    ((start, stop),) = body.sides
    assert sorted((start.x, stop.x)) == pytest.approx([-0.45, 1.6])
    assert body.tracers == ()


def test_a_bell_crank_is_a_plate_and_a_block_alone_has_no_body():
    made_of = link_bodies(*parts("002-E3.3"))
    plates = [body for body in made_of.values() if body.plate]
    assert len(plates) == 1
    (body,) = plates
    assert len(body.plate) == len(body.sides) == len(body.joints) == 3
    area = sum(a.cross(b) for a, b in body.sides) / 2.0
    p, q, r = body.joints
    assert area == pytest.approx(abs((q - p).cross(r - p)) / 2.0)  # anticlockwise, and the whole of it
    alone = [each for link, each in made_of.items() if link.startswith("block")]
    assert alone
    assert all(each.sides == each.tracers == each.plate == () for each in alone)


def test_the_frame_has_no_body():
    mechanism, shapes = parts("four-bar")
    assert set(link_bodies(mechanism, shapes)) == {"AB", "BC", "DC"}


def parts(name):
    mechanism = planar.load(name)
    return mechanism, {link.name: link_shape(link) for link in mechanism.links}


coordinates = st.floats(-1.0, 1.0).map(lambda value: round(value, 3))
clouds = st.lists(st.builds(Vector, coordinates, coordinates), min_size=1, max_size=9)


@given(clouds)
@settings(max_examples=draws(30), deadline=None)
def test_a_hull_is_convex_anticlockwise_and_holds_all_points(points):
    corners = convex_hull(points, 1e-9)
    if not corners:
        for p, q, r in combinations(points, 3):
            assert abs((q - p).cross(r - p)) < 1e-8
        return
    around = list(zip(corners, (*corners[1:], corners[0]), strict=True))
    assert all((b - a).cross(p - a) >= -1e-8 for a, b in around for p in points)
    assert set(corners) <= set(points)


@given(st.lists(st.builds(Vector, coordinates, coordinates), min_size=0, max_size=6), st.floats(0.0, 6.28))
@settings(max_examples=draws(20), deadline=None)
def test_a_link_with_any_points_can_be_drawn(points, angle):
    links = {"f": {"points": {"O": [0, 0]}}, "m": {"points": {"O": [0, 0]}}}
    links["m"]["points"] |= {f"p{k}": [1e3 * x, 1e3 * y] for k, (x, y) in enumerate(points)}
    pairs, inputs = [{"turning": "O"}], [{"pair": "O", "position": angle, "velocity": "1 rad/s"}]
    state = made({"frame": "f", "links": links, "pairs": pairs, "inputs": inputs})
    picture = scheme(state)
    assert all(isfinite(value) for mark in picture.marks for at in spots(mark) for value in at)
    for k in range(len(points)):
        assert about(picture, f"point p{k}", Label)


@pytest.mark.parametrize("seed", part(range(24), 3))
def test_any_linkage_can_be_drawn_on_its_sheet(seed):
    try:
        state = planar.solve(files.from_dict(random_linkage(seed, 3 + seed % 7, higher=0.4).value))
    except planar.PlanarError:
        return
    picture = scheme(state)
    (left, low), (right, high) = extent(picture.marks)
    assert max(right - left, high - low) >= 60.0
    assert right - left < 277.0
    assert high - low < 190.0
    for pair in state.mechanism.pairs:
        if pair.coincident_points():
            (pin,) = about(picture, f"pin {pair.entry_name()}")
            per_mm = reading(picture.notes[0].removeprefix("Space diagram, ")).per_mm
            assert pin.centre == pytest.approx(tuple(state.point(pair.entry_name()).position / per_mm), abs=1e-9)


def crossing(p, q, r, s):
    def side(a, b, c):
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    return side(p, q, r) * side(p, q, s) < 0.0 and side(r, s, p) * side(r, s, q) < 0.0


@every_model
def test_what_stands_still_is_clear_of_other_grounds(name):
    if name == "chain-42":  # more supports than there is room for
        return
    ground = [mark for mark in drawn(name).marks if isinstance(mark, Polyline) and mark.pen in (Pen.GROUND, Pen.HATCH)]
    for one, other in combinations(ground, 2):
        if one.about != other.about:
            pieces = [list(zip(mark.points, mark.points[1:], strict=False)) for mark in (one, other)]
            assert not any(crossing(*a, *b) for a in pieces[0] for b in pieces[1])


@pytest.mark.parametrize("name", ["four-bar", "jansen-leg", "excavator-arm", "planetary-gear-set", "scissor-lift"])
def test_links_keep_their_lengths_in_every_position_drawn(name):
    mechanism = planar.load(name)
    motion = planar.cycle(mechanism, 6, pair=mechanism.inputs[0].pair)
    shapes = motion.shapes
    made_of = link_bodies(mechanism, shapes)
    slides = [pair.name for pair in mechanism.pairs if pair.point_on_line() is not None]
    ways = {slide: motion.pair(slide)["displacement"] for slide in slides}
    travel = {slide: (float(way.min()), float(way.max())) for slide, way in ways.items()}
    lengths = []
    for index in range(len(motion)):
        frames = plain_frames(motion.frames, index)
        marks = body_marks(mechanism, made_of, frames, shapes, UNIT, travel=travel)
        thin = body_marks(mechanism, made_of, frames, shapes, UNIT, Pen.POSITION, with_symbols=False)
        assert {mark.pen for mark in thin} == {Pen.POSITION}
        lines = [mark for mark in marks if isinstance(mark, Polyline)]
        lengths.append([hypot(*np.subtract(*mark.points[:2])) for mark in lines])
        assert {mark.about for mark in thin} <= {mark.about for mark in lines}
    assert len(lengths) > 2
    np.testing.assert_allclose(lengths[1:], [lengths[0]] * (len(lengths) - 1), rtol=1e-9, atol=1e-9)


def test_a_piston_stays_in_its_cylinder_over_its_whole_travel():
    mechanism = planar.load("excavator-arm")
    motion = planar.cycle(mechanism, 9, 2.1, 3.0, "boom cylinder")
    low, high = 2.1, 3.0
    made_of = link_bodies(mechanism, motion.shapes)
    for index in range(len(motion)):
        frames = plain_frames(motion.frames, index)
        travel = {"boom cylinder": (low, high)}
        marks = body_marks(mechanism, made_of, frames, motion.shapes, UNIT, travel=travel)
        (tube,) = (mark for mark in marks if mark.about == "link boom tube" and mark.closed)
        piston, rod = (mark for mark in marks if mark.about == "link boom rod")
        base, mouth = (np.mean([tube.points[a], tube.points[b]], axis=0) for a, b in ((0, 3), (1, 2)))
        part = (np.mean(piston.points, axis=0) - base) @ (mouth - base) / ((mouth - base) @ (mouth - base))
        assert 0.0 < part < 1.0
        assert np.hypot(*(mouth - base)) < np.hypot(*(rod.points[1] - base))


def test_a_fixed_guide_is_as_long_as_the_travel_of_its_block():
    state = solved("slider-crank")
    short, long = scheme(state, UNIT), scheme(state, UNIT, travel={"stroke": (1.12, 2.08)})

    def rail(picture):
        (mark,) = (each for each in about(picture, "guide stroke") if each.pen is Pen.GROUND)
        return mark.points

    (a, b), (c, d) = rail(short)
    assert hypot(c - a, d - b) == pytest.approx(symbol_table.RAIL_LENGTH)
    (a, b), (c, d) = rail(long)
    assert (min(a, c), max(a, c)) == pytest.approx((1120 - 5.5, 2080 + 5.5))
    assert abs(b) == pytest.approx(symbol_table.BLOCK_SIZE[1] / 2.0)  # under the block, whose middle is on the line
    assert b == pytest.approx(d)


def test_a_moving_guide_is_as_long_as_the_travel_that_is_measured_from_its_first_point():
    state = made(
        {
            "frame": "f",
            "links": {
                "f": {"points": {"O": [0, 0], "C": [60, 0]}},
                "lever": {"points": {"C": [0, 0]}},
                "crank": {"ends": ["O", "A"], "length": 20},
            },
            "pairs": [
                {"turning": "O"},
                {"turning": "C"},
                {"sliding": "s", "on": "lever", "block": "A", "line": {"through": [-10, 0], "angle": 180}},
            ],
            "inputs": [{"pair": "O", "position": 60}],
            "sketch": {"A": [10, 17]},
        }
    )
    # the block goes from 40 to 80 mm from C, which is 10 mm less from the line's first point
    picture = scheme(state, UNIT, travel={"s": (0.03, 0.07)})
    (guide,) = about(picture, "link lever", Polyline)
    lengths = [hypot(x - 60.0, y) for x, y in guide.points]
    assert sorted(lengths) == pytest.approx([0.0, 85.5], abs=1e-9)


def test_a_rack_reaches_from_its_block_to_its_wheel():
    picture = drawn("rack-differential")
    state = solved("rack-differential")
    for pair in state.mechanism.pairs:
        for mark in pair.drawing_marks(state.shapes, state.mechanism.pairs):
            if isinstance(mark, PitchLineMark):
                bar = next(each for each in about(picture, f"link {mark.link}", Polyline) if each.closed)
                xs = [x for x, _ in bar.points]
                scale = reading(picture.notes[0].removeprefix("Space diagram, "))
                for point in (*state.shapes[mark.link].points, None):
                    where = "C" if point is None else f"{mark.link}.{point}"
                    x = state.point(where).position[0] / scale.per_mm
                    assert min(xs) - 1e-9 <= x <= max(xs) + 1e-9


def test_a_rack_reaches_beneath_its_wheel_over_the_whole_motion():
    """The bar goes on for 1.2 radii (of 25 mm) beyond where the wheel comes, or to the pin of its slide."""
    state = solved("rack-differential")
    here = state.pair("lower mesh")["displacement"]
    for far in (0.0, 0.02, 0.05):
        picture = scheme(state, UNIT, travel={"lower mesh": (here - far, here + far)})
        (bar,) = (each for each in about(picture, "link lower rack", Polyline) if each.closed)
        xs = np.array([x for x, _ in bar.points]) / 1000
        middle = state.point("C").position[0]
        assert xs.min() == pytest.approx(middle - far - 1.2 * 0.025, abs=1e-9)
        assert xs.max() == pytest.approx(max(middle + far + 1.2 * 0.025, state.point("L").position[0]), abs=1e-9)


@every_model
def test_hatching_leans_away_from_the_line_on_the_far_side_of_the_pin(name):
    picture = drawn(name)
    for pin in (mark for mark in picture.marks if mark.about.startswith("pin ")):
        marks = about(picture, pin.about.replace("pin", "ground", 1), Polyline)
        for hatch in (mark for mark in marks if mark.pen is Pen.HATCH):
            base = np.array(marks[1].points)
            down = base.mean(axis=0) - pin.centre
            start, stop = (np.array(spot) - pin.centre for spot in hatch.points)
            assert np.hypot(*down) == pytest.approx(symbol_table.SUPPORT_HEIGHT)
            depths = start @ down / symbol_table.SUPPORT_HEIGHT, stop @ down / symbol_table.SUPPORT_HEIGHT
            # from the base line outwards at 45 degrees
            assert depths == pytest.approx(
                (symbol_table.SUPPORT_HEIGHT, symbol_table.SUPPORT_HEIGHT + symbol_table.HATCH_LENGTH / sqrt(2.0)),
                abs=1e-9,
            )
            assert np.hypot(*(stop - start)) == pytest.approx(symbol_table.HATCH_LENGTH)


def test_a_long_guide_leaves_room_for_the_support_of_a_pin_on_its_way():
    picture = scheme(solved("scotch-yoke"), UNIT, travel={"stroke": (-0.075, 0.075)})
    rails = [mark.points for mark in about(picture, "guide stroke") if mark.pen is Pen.GROUND]
    assert sorted(x for spots in rails for x, _ in spots) == pytest.approx([-80.5, -4.5, 4.5, 80.5])
    base = about(picture, "ground O")[1]
    assert np.mean(base.points, axis=0) == pytest.approx((0.0, -symbol_table.SUPPORT_HEIGHT))


def test_a_support_stands_on_the_side_that_no_link_leaves_from():
    for degrees, wanted in ((90, (0, -1)), (-90, (-1, 0)), (-100, (1, 0))):
        state = made(
            {
                "frame": "f",
                "links": {"f": {"points": {"O": [0, 0]}}, "m": {"ends": ["O", "P"], "length": 100}},
                "pairs": [{"turning": "O"}],
                "inputs": [{"pair": "O", "position": degrees}],
            }
        )
        ground = ground_marks(
            state.mechanism, link_bodies(state.mechanism, state.shapes), plain_frames(state.frames), state.shapes, UNIT
        )
        base = next(mark for mark in ground if mark.pen is Pen.GROUND and len(mark.points) == 2)
        middle = np.mean(base.points, axis=0)
        assert middle @ np.array([cos(degrees * pi / 180), sin(degrees * pi / 180)]) < 2.0
        if degrees != -100:
            np.testing.assert_allclose(middle, np.array(wanted) * symbol_table.SUPPORT_HEIGHT, atol=1e-9)


def test_a_link_that_slides_through_a_fixed_block_is_drawn_with_the_block_on_the_frame():
    state = made(
        {
            "frame": "f",
            "links": {"f": {"points": {"B": [10, 5]}}, "rod": {"points": {"P": [0, 0], "Q": [80, 0]}}},
            "pairs": [{"sliding": "bush", "links": ["rod", "f"], "line": {"through": "P"}, "point": "B"}],
            "inputs": [{"pair": "bush", "position": 30, "velocity": "0.2 m/s"}],
        }
    )
    picture = scheme(state, UNIT)
    (block,) = about(picture, "block B", Polyline)
    np.testing.assert_allclose(np.mean(block.points, axis=0), (10, 5), atol=1e-9)
    assert [mark for mark in about(picture, "guide bush") if mark.pen is Pen.HATCH]
    assert {(0.0 - 20.0, 5.0), (60.0, 5.0)} <= {
        (round(x, 9), round(y, 9)) for mark in about(picture, "link rod", Polyline) for x, y in mark.points
    }
    (arrow, _) = about(picture, "input bush")
    assert arrow.head[0] - arrow.tail[0] == pytest.approx(-10.0)  # the rod goes back as B goes ahead along it


def test_a_driven_slide_between_moving_links_is_a_cylinder_with_its_rod():
    picture = drawn("excavator-arm")
    assert [mark for mark in picture.marks if mark.about.startswith("block")] == []
    (tube,) = (mark for mark in about(picture, "link boom tube") if mark.closed)
    (_, rod) = about(picture, "link boom rod", Polyline)
    pin = {mark.about: np.array(mark.centre) for mark in picture.marks if isinstance(mark, Circle)}
    np.testing.assert_allclose(np.mean([tube.points[0], tube.points[3]], axis=0), pin["pin T"], atol=1e-9)
    np.testing.assert_allclose(rod.points[1], pin["pin R"], atol=1e-9)
    way, along = pin["pin R"] - pin["pin T"], np.subtract(rod.points[1], rod.points[0])
    assert way[0] * along[1] - way[1] * along[0] == pytest.approx(0.0, abs=1e-9)


def test_letters_and_numbers_can_be_left_out():
    picture = scheme(solved("four-bar"), letters=False, numbers=False)
    assert {mark.about for mark in picture.marks if isinstance(mark, Label)} == {"input A"}


def test_the_same_position_is_drawn_the_same():
    for name in ("excavator-arm", "chain-42"):
        assert scheme(solved(name)) == drawn(name)


def test_a_drawing_whose_pins_would_lie_on_each_other_takes_a_whole_sheet():
    assert scheme(solved("stephenson-valve-gear")).notes == ("Space diagram, 1 cm = 100 mm",)
    # others keep to the paper of a drawing
    assert scheme(solved("walschaerts-valve-gear")).notes == ("Space diagram, 1 cm = 200 mm",)


@pytest.mark.parametrize("name", ["stephenson-valve-gear", "walschaerts-valve-gear", "rack-steering"])
def test_where_symbols_lie_on_each_other_that_part_is_drawn_larger_beside_it(name):
    state = solved(name)
    whole, detail = scheme_with_details(state)
    frame = next(mark for mark in whole.marks if mark.about == detail.title)
    one, other = detail.title.removeprefix("Detail: ").split(" and ")
    large, small = (reading(picture.notes[0].removeprefix("Space diagram, ")).per_mm for picture in (detail, whole))
    a, b = (state.point(point).position / large for point in (one, other))
    reach = hypot(*symbol_table.BLOCK_SIZE) / 2.0 + symbol_table.PIN_RADIUS
    assert hypot(*(a - b)) > reach > hypot(*(a - b)) * large / small
    low, high = np.minimum(a, b) - AROUND, np.maximum(a, b) + AROUND
    assert detail.window == (pytest.approx(low), pytest.approx(high))
    corners = np.array(frame.points)
    assert corners.min(axis=0) * small == pytest.approx(low * large)
    assert corners.max(axis=0) * small == pytest.approx(high * large)
    letters = {mark.text: mark.at for mark in detail.marks if isinstance(mark, Label)}
    for point, place in ((one, a), (other, b)):
        assert letters[point] == pytest.approx(place)
    for axes in draw_pictures([whole, detail]).axes:
        window = next((patch for patch in axes.patches if patch.get_gid() == "window"), None)
        assert (window is None) is (axes.get_label() != detail.title)
        strokes = [
            each
            for each in (*axes.lines, *axes.patches)
            if each is not window and "leader" not in (each.get_gid() or "")
        ]
        assert all(each.get_clip_on() is (window is not None) for each in strokes)


def test_what_is_clear_has_no_detail_and_a_detail_is_never_the_drawing_again():
    for name in ("four-bar", "slider-crank", "jansen-leg", "oldham"):
        assert len(scheme_with_details(solved(name))) == 1
    short = made(
        {
            "frame": "f",
            "links": {
                "f": {"points": {"O": [0, 0], "Q": [0, 1]}},
                "a": {"ends": ["O", "A"], "length": 1},
                "b": {"ends": ["Q", "B"], "length": 1},
            },
            "pairs": [{"turning": "O"}, {"turning": "Q"}],
            "inputs": [{"pair": "O", "position": 0}, {"pair": "Q", "position": 0}],
        }
    )
    assert len(scheme_with_details(short, Scale("length", 1e-3, "mm"))) == 1


def test_pins_however_near_each_other_are_drawn():
    for apart in (1e-2, 1e-1, 1.0, 10.0):
        value = {
            "frame": "f",
            "links": {
                "f": {"points": {"O": [0, 0], "Q": [apart, 0]}},
                "a": {"ends": ["O", "A"], "length": 1000},
                "b": {"ends": ["Q", "B"], "length": 1000},
            },
            "pairs": [{"turning": "O"}, {"turning": "Q"}],
            "inputs": [{"pair": "O", "position": 0}, {"pair": "Q", "position": 90}],
        }
        for scale in (None, "1:1000", "1:1", "5:1"):
            whole, *details = scheme_with_details(made(value), None if scale is None else reading(scale))
            assert whole.marks
            assert all(picture.window is not None for picture in details)


# outlines, and masses on one pin


def outlined(points):
    """A four-bar whose coupler BC carries points, in mm."""
    value = four_bar_document(
        40, 90, 70, 100, 60, 1, points=points, name="outlined", units={"length": "mm", "angle": "deg"}, omega=None
    )
    return planar.from_dict(value)


def ring(count, centre=(45.0, 40.0), radius=12.0):
    """Points on a circle by their names."""
    turns = [2.0 * pi * k / count for k in range(count)]
    return {f"b{k}": [centre[0] + radius * cos(turn), centre[1] + radius * sin(turn)] for k, turn in enumerate(turns)}


def test_points_of_a_link_that_nothing_uses_are_its_outline_without_letters():
    mechanism = outlined(ring(9))
    picture = scheme(planar.solve(mechanism))
    assert {mark.text for mark in picture.marks if isinstance(mark, Label) and mark.about.startswith("point ")} == set(
        "ABCD"
    )
    assert not any(mark.about.startswith("point ") for mark in picture.marks if not isinstance(mark, Label))
    (outline,) = [
        mark for mark in picture.marks if isinstance(mark, Polyline) and mark.closed and len(mark.points) == 9
    ]
    assert outline.about == "link BC"
    # nine points fan out to neither pin: the bar itself, and one line to the nearest corner
    lines = [
        mark for mark in picture.marks if isinstance(mark, Polyline) and mark.about == "link BC" and not mark.closed
    ]
    assert len(lines) == 2


@pytest.mark.parametrize("count", [1, 3, 5])
def test_few_points_that_nothing_uses_are_tracers_with_letters(count):
    points = dict(list(ring(9).items())[:count])
    mechanism = outlined(points)
    assert not link_outlines(mechanism, parts_of(mechanism))
    letters = {mark.text for mark in scheme(planar.solve(mechanism)).marks if isinstance(mark, Label)}
    assert points.keys() <= letters


def test_a_point_that_a_load_a_mass_a_spring_or_a_published_value_uses_is_on_no_outline():
    value = planar.to_dict(outlined(ring(10)))
    value["loads"] = [{"point": "b0", "force": [0, -10]}]
    value["masses"] = [{"link": "BC", "mass": 2, "at": "b1"}]
    value["springs"] = [{"points": ["b2", "A"], "stiffness": "10 N/mm", "free_length": 10}]
    value["published"] = [{"symbol": "v", "quantity": "velocity", "of": "b3"}]
    mechanism = planar.from_dict(value)
    (outline,) = link_outlines(mechanism, parts_of(mechanism)).values()
    assert outline.points == ("b4", "b5", "b6", "b7", "b8", "b9")


def test_an_outline_keeps_the_order_of_its_points_unless_they_cross():
    corners = {"p": [20, 20], "q": [60, 20], "r": [60, 60], "s": [40, 30], "t": [20, 60], "u": [10, 40]}  # s is a notch
    mechanism = outlined(corners)
    (outline,) = link_outlines(mechanism, parts_of(mechanism)).values()
    assert outline.corners == tuple("pqrstu")
    mechanism = outlined({name: corners[name] for name in "prqstu"})  # these sides cross: the hull is taken
    (outline,) = link_outlines(mechanism, parts_of(mechanism)).values()
    assert sorted(outline.corners) == ["p", "q", "r", "t", "u"]
    assert sorted(outline.points) == sorted("pqrstu")


def test_a_link_with_one_pin_and_a_mass_has_a_line_to_its_mass_centre():
    value = four_bar_document(40, 90, 70, 100, 60, 1, name="arm", units={"length": "mm", "angle": "deg"}, omega=None)
    value["links"]["arm"] = {"points": {"C": [0, 0]}}
    value["pairs"] = [{"turning": name} for name in "ABD"] + [{"turning": "C", "links": ["BC", "DC", "arm"]}]
    value["inputs"].append({"pair": "C:BC,arm", "position": 20})
    value["masses"] = [{"link": "arm", "mass": 2, "at": [30, 40]}]
    mechanism = planar.from_dict(value)
    body = link_bodies(mechanism, parts_of(mechanism))["arm"]
    ((start, stop),) = body.sides
    assert hypot(*(stop - start)) == pytest.approx(0.05)
    assert body.dots == ()  # the centre of mass has its own symbol, and is no point


def parts_of(mechanism):
    return {link.name: link_shape(link) for link in mechanism.links}


def curved(carrier, stops):
    """A pin of a rocker in a curved slot of radius 50, of the frame or of a swinging plate."""
    plate = {"points": {"E": [40, 110], "M": [100, 60]}}
    return {
        "frame": "f",
        "links": {
            "f": {"points": {"A": [0, 0], "E": [40, 110]} | ({"M": [100, 60]} if carrier == "f" else {})},
            "crank": {"ends": ["A", "B"], "length": 30},
            "rod": {"ends": ["B", "C"], "length": 80},
            "arc": {"ends": ["M", "C"], "length": 50, "curved_slot": True},
        }
        | ({"plate": plate} if carrier == "plate" else {}),
        "pairs": [
            *({"turning": name} for name in "ABC"),
            {"turning": "M", "links": [carrier, "arc"], "stops": stops},
            *([{"turning": "E"}] if carrier == "plate" else []),
        ],
        "inputs": [{"pair": "A", "position": 40}, *([{"pair": "E", "position": 10}] if carrier == "plate" else [])],
        "sketch": {"C": [100, 10]},
    }


@pytest.mark.parametrize("carrier", ["f", "plate"])
@pytest.mark.parametrize("stops", [[-150, -20], None, [-150, None]])
def test_a_link_that_stands_for_a_curved_slot_is_drawn_as_an_arc_about_its_centre(carrier, stops):
    value = curved(carrier, stops)
    if stops is None:
        del value["pairs"][3]["stops"]
    state = made(value)
    frame, half = plain_frames(state.frames)[carrier], symbol_table.SLOT_SIZE[1] / 2.0
    centre = 1000.0 * np.array(state.point("M").position)
    picture = scheme(state, UNIT)
    about = "guide M" if carrier == "f" else "link plate"
    edges = [mark for mark in picture.marks if isinstance(mark, Polyline) and mark.about == about and mark.closed]
    distances = np.concatenate([np.hypot(*(np.array(edge.points) - centre).T) for edge in edges])
    assert distances.min() == pytest.approx(50.0 - half) and distances.max() == pytest.approx(50.0 + half)
    full = stops is not None and None not in stops
    assert len(edges) == (1 if full else 2)
    if full:  # the middles of the round ends lie beyond the stops by half the width of the slot
        turned = np.degrees(np.arctan2(*(np.array(edges[0].points) - centre).T[::-1]) - frame.angle)
        turned = (turned + 265.0) % 360.0 - 265.0
        beyond = np.degrees(half / 50.0)
        assert turned.min() == pytest.approx(-150.0 - beyond, abs=0.1)
        assert turned.max() == pytest.approx(-20.0 + beyond, abs=0.1)
    blocks = [mark for mark in picture.marks if mark.about == "stop of M"]
    assert len(blocks) == (stops == [-150, None])
    spots = [mark.about for mark in picture.marks]
    assert "pin C" in spots and not {"pin M", "ground M", "link arc", "point M"} & set(spots)
    assert "number of arc" in spots


def test_a_drawing_with_a_curved_slot_has_room_for_the_slot_and_not_for_its_centre():
    value = curved("f", [-100, -80])
    value["links"]["arc"]["length"], value["links"]["f"]["points"]["M"] = 5000, [100, 5010]
    low, high = (np.array(corner) for corner in extent(scheme(made(value)).marks))
    assert (high - low).max() < 1000.0
