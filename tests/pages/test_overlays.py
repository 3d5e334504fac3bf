"""What is laid over a page's drawing and stands beside it: its scripts, run in Node, against Python's drawing."""

from __future__ import annotations

from functools import cache
from math import hypot
from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import planar
from planar.analysis.polygons.construction import acceleration_polygon, velocity_polygon
from planar.drawing.forces.action_arrows import action_arrows
from planar.drawing.paper.scales import DECIMAL_STEPS, SCREEN_DIGITS, round_step
from planar.drawing.paper.stroke_shapes import arrow_head
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.errors import NoAnswer
from planar.foundation.geometry import Vector
from planar.pages.data.page_data import page_data
from planar.pages.data.polygon_data import outline_sides
from planar.pages.overlay_style import LAYER_PENS, overlay_styles
from tests.known import MODELS, found_centres
from tests.page_scripts import PAGE_STEMS, in_node, needs_node

SCRIPTS = ("layers/ink.js", "layers/points.js", "layers/polygons.js", "layers/centres.js")
FEW = {
    stem: MODELS[stem]
    for stem in ("four-bar", "crank-and-slotted-lever", "klann-leg", "watt-six-bar", "two-stroke-engine")
}
POLYGONS = {"velocity": velocity_polygon, "acceleration": acceleration_polygon}


@cache
def drawn() -> dict[str, Any]:
    """Of some models the points of polygons with the ends of their vectors' parts, and all centres with their lines."""
    act = """
      const found = { values: {}, ends: {} }, { vertices, strokes } = page.data.polygons;
      for (const rate of ["velocity", "acceleration"]) found.values[rate] = polygonPoints(page, rate);
      const values = found.values.acceleration;
      for (const each of strokes.filter(({ end }) => values && end)) {
        found.ends[each.end.join("_")] = centripetalEnd(page, each, values);
      }
      found.letters = vertices.map(({ letter }) => letter);
      const all = centresOf(page, page.frames);
      found.centres = all && all.map((each) => {
        const lines = each.at === null ? [] : kennedyLines(all, each, page.data);
        return { links: each.links, at: each.at, lines: lines.map(({ two }) => two.map(({ at }) => at)) };
      });
      return found;
    """
    return in_node(FEW | {stem: MODELS[stem] for stem in PAGE_STEMS}, act, *SCRIPTS)


@needs_node
@pytest.mark.parametrize("tail, tip", [((1.0, 2.0), (30.0, -7.0)), ((0.0, 0.0), (0.3, 1.1)), ((5.0, 5.0), (5.0, 1.0))])
def test_an_arrow_has_the_head_that_it_has_on_paper(tail, tip):
    far = hypot(tip[0] - tail[0], tip[1] - tail[1])
    way = [(tip[k] - tail[k]) / far for k in (0, 1)]
    act = f"return headOfLength({[*tip]}, {way}, [headLength([{far}], [1], [])[0]], []);"
    expected = arrow_head(tail, tip, far)
    numbers = [*np.ravel(expected.corners), *expected.line_end, expected.max_line_width]
    np.testing.assert_allclose(in_node({"": FEW["four-bar"]}, act, *SCRIPTS)[""], numbers, rtol=1e-12, atol=1e-12)


@needs_node
def test_scales_and_steps_are_round_as_on_paper():
    least = [*np.geomspace(1e-9, 1e9, 997).tolist(), 1.0, 2.0, 0.05, 3e4]
    act = f"return {least}.map((each) => [roundUp(each), roundUp(each, SCALE_VALUES)]);"
    steps, scales = np.transpose(in_node({"": FEW["four-bar"]}, act, *SCRIPTS)[""])
    np.testing.assert_allclose(steps, [round_step(each, DECIMAL_STEPS) for each in least], rtol=1e-12)
    np.testing.assert_allclose(scales, [round_step(each, SCREEN_DIGITS) for each in least], rtol=1e-12)


@needs_node
def test_points_of_polygons_and_ends_of_parts_lie_where_they_do_on_paper():
    compared = 0
    for stem, found in drawn().items():
        try:
            state = planar.solve(MODELS[stem])
        except NoAnswer:
            continue
        for rate, polygon in POLYGONS.items():
            if found["values"][rate] is None:
                continue
            known = polygon(state).letters
            near = 1e-9 * max((hypot(*each) for each in known.values()), default=1.0)
            own = dict(zip(found["letters"], found["values"][rate], strict=True))
            own = {f"{letter}_1": at for letter, at in own.items()} | found["ends"] if rate == "acceleration" else own
            for letter in own.keys() & known.keys():
                np.testing.assert_allclose(own[letter], known[letter], rtol=0.0, atol=near, err_msg=f"{stem} {letter}")
                compared += 1
    assert compared > 150


@needs_node
def test_centres_lie_where_they_do_on_paper_and_three_on_each_line_of_kennedys():
    lines = 0
    for stem, found in drawn().items():
        known = found_centres(stem)
        size = page_data(MODELS[stem])[0]["size"]

        def unit(point, size=size):
            point = np.array(point) * [1.0, 1.0, size]
            return point / np.linalg.norm(point)

        for each in found["centres"] or []:
            expected = known[tuple(each["links"])]
            if each["at"] is None or expected.homogeneous is None or expected.how == "equations":
                continue
            sine = np.linalg.norm(np.cross(unit(each["at"]), unit(expected.homogeneous)))
            assert sine < 1e-6, (stem, expected.name)
            for two in each["lines"]:
                assert abs(np.linalg.det([unit(at) for at in (each["at"], *two)])) < 1e-6
                lines += 1
    assert lines > 100


@pytest.mark.parametrize("stem", ["four-bar", "crank-and-slotted-lever"])
def test_a_polygon_has_a_vector_for_each_relative_motion_of_joints(stem):
    data = page_data(MODELS[stem])[0]["polygons"]
    letters = [each["letter"] for each in data["vertices"]]
    vectors = {(each["kind"], letters[each["from"]], letters[each["to"]]) for each in data["strokes"]}
    wanted = {
        "four-bar": {("absolute", "a", "b"), ("relative", "b", "c"), ("absolute", "d", "c"), ("image", "b", "f")},
        "crank-and-slotted-lever": {("relative", "a′", "a"), ("absolute", "c", "a′"), ("absolute", "", "r")},
    }
    assert vectors >= wanted[stem]


def test_an_outline_is_the_convex_hull_and_of_what_is_on_a_line_its_ends():
    places = {k: Vector(*at) for k, at in enumerate(np.random.default_rng(5).normal(size=(40, 2)))}
    assert {a for a, _ in outline_sides(places)} == set(ConvexHull(np.array(list(places.values()))).vertices)
    assert outline_sides({"a": Vector(1.0, 1.0), "b": Vector(3.0, 3.0), "c": Vector(2.0, 2.0)}) == [("a", "b")]
    assert outline_sides({"a": Vector(0.0, 0.0)}) == outline_sides({}) == []


@pytest.mark.parametrize("stem", ["000-P2", "balanced-lamp", "gear-reducer", "two-stroke-engine"])
def test_forces_have_the_letters_that_they_have_on_paper(stem):
    symbols = page_data(MODELS[stem])[0]["forces"]["symbols"]
    carried = {
        (link, *symbol)
        for kind in symbols.values()
        for of in kind.values()
        for link, two in of.items()
        for symbol in two
    }
    state = planar.solve(MODELS[stem])
    felt = action_arrows(planar.forces(state), mechanism_size(MODELS[stem], state.shapes))
    lettered = {(link, each.symbol.base, each.symbol.subscript) for link, of in felt.items() for each in of}
    assert {each for each in lettered if not each[1].startswith("-")} <= carried


def test_every_layer_has_a_pen_of_the_paper_and_a_colour_by_day_and_by_night():
    styles = overlay_styles()
    assert all(f" {selector} {{ stroke-width:" in styles for selector in LAYER_PENS)
    for name in ("velocity", "acceleration", "centre", "centrode", "reaction", "load", "series5"):
        assert styles.count(f"--{name}: #") == 2
