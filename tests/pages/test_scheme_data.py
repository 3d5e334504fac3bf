"""The strokes that a page carries: Python's own, for other dimensions too, and as the page's scripts evaluate them."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import planar
from planar.document.dimensions import change_dimension
from planar.drawing.paper.picture import Polyline
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.link_bodies import link_bodies
from planar.drawing.scheme.link_strokes import moving_strokes
from planar.drawing.scheme.placed_strokes import PlacedLine, PlacedSymbol, stroke_marks
from planar.drawing.scheme.scene import Scene, plain_frames
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.geometry import GROUND, Vector
from planar.pages.data.dimension_numbers import DimensionNumbers
from planar.pages.data.scheme_data import motion_positions, moving_scene, scheme_data
from planar.pages.drawing_style import symbol_script
from planar.solving.position import solved_mechanism
from tests.known import MODELS
from tests.page_scripts import PAGE_STEMS, in_node, needs_node

PER_MM = 1e-3
CURVED_SLOT = planar.from_dict(
    {
        "planar": 1,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "f",
        "links": {
            "f": {"points": {"A": [0, 0], "E": [40, 110]}},
            "crank": {"ends": ["A", "B"], "length": 30},
            "rod": {"ends": ["B", "C"], "length": 80},
            "plate": {"points": {"E": [40, 110], "M": [100, 60]}},
            "arc": {"ends": ["M", "C"], "length": 50, "curved_slot": True},
        },
        "pairs": [*({"turning": name} for name in "ABCE"), {"turning": "M", "stops": [-150, -20]}],
        "inputs": [{"pair": "A", "position": 40}, {"pair": "E", "position": 10}],
        "sketch": {"C": [100, 10]},
    }
)
"""A crank and a rod whose pin slides in the curved slot of a swinging plate."""
EVALUATED = """
globalThis.document = { createElementNS: () => ({ setAttribute() {}, append() {} }) };
const strokes = new Strokes(page.data.scheme);
strokes.measure(page, [page.frames], 1000, 1);
const moving = Object.entries(page.data.scheme.levels).filter(([level]) => !["springs", "ground"].includes(level));
const made = (each) => strokes.made(each).map(({ spots }) => spots);
return Object.fromEntries(moving.map(([level, all]) => [level, all.map(made)]));
"""
"""Places (mm of the link's axes, y downwards) of what each stroke that moves is made of, level by level."""


def evaluated(carried, numbers, sizes, frames):
    """The numbers that strokes refer to, in one position: as scripts work them out."""
    given = [numbers.dimensions.d, ca.vertcat(*numbers.travel), numbers.per_mm.expression]
    drawn = ca.Function("drawn", given, [ca.vertcat(*map(ca.SX, numbers.values))])

    def values(travel):
        return drawn(sizes, travel, PER_MM).full().ravel()

    known, travel = values([0.0] * len(numbers.travel)), []
    for each in carried["measures"]:
        foot, way, at = (Vector(*known[each[name]]) for name in ("foot", "direction", "at"))
        local = frames[each["link"]].to_local(frames[each["rider"]].to_world(at))
        travel += [(local - foot).dot(way)] * 2
    return values(travel)


@pytest.mark.parametrize(
    "name", ["watt-1-six-bar", "oscillating-cylinder", "crank-and-slotted-lever", "jansen-leg", "curved"]
)
def test_strokes_on_a_page_are_those_of_a_drawing_for_other_dimensions_too(name):
    mechanism = MODELS.get(name, CURVED_SLOT)
    dimensions = DimensionNumbers(mechanism)
    carried, numbers = scheme_data(mechanism, dimensions, [plain_frames(planar.solve(mechanism).frames)])
    first = dimensions.dimensions[0 if name in MODELS else -1]  # the radius of the curved slot
    for by in (1.0, 1.01):
        other = change_dimension(mechanism, first, by * first.value)
        shapes, frames = shapes_of_links(other), plain_frames(planar.solve(other).frames)
        sizes = [each.value * (by if each == first else 1.0) for each in dimensions.dimensions]
        values = evaluated(carried, numbers, sizes, frames)
        scene = Scene(other, link_bodies(other, shapes), frames, shapes, Scale("length", PER_MM, "mm"))
        for level, strokes in moving_strokes(scene).items():
            for stroke, found in zip(strokes, carried["levels"][level], strict=level != "pins"):
                assert found["link"] == stroke.link
                if isinstance(stroke, PlacedLine):
                    wanted, places = stroke.points, found["points"]
                else:
                    assert found["symbol"] == stroke.symbol
                    wanted = [stroke.at, *([stroke.stop] if stroke.stop else [])]
                    places = [found["at"], *([found["stop"]] if stroke.stop else [])]
                np.testing.assert_allclose(values[np.array(places)], np.array(wanted, dtype=float), atol=1e-12)


@needs_node
def test_scripts_evaluate_strokes_as_python_does():
    names = [*PAGE_STEMS, "belt-arm", "planetary-gear-set", "rack-steering"]
    models = {name: MODELS[name] for name in names if all(pair.measures_symbols for pair in MODELS[name].pairs)}
    models["curved"] = CURVED_SLOT
    table = symbol_script().replace("const ", "globalThis.")
    told = in_node(models, table + EVALUATED, "stage/plane.js", "stage/symbols.js", "stage/strokes.js")
    for name, mechanism in models.items():
        z = solved_mechanism(mechanism).assembly.z
        positions = motion_positions(mechanism, z)[:1]
        scene = moving_scene(mechanism, DimensionNumbers(mechanism), positions, None, PER_MM)
        axes = {link.name: GROUND for link in mechanism.links}
        for level, strokes in moving_strokes(scene).items():
            for stroke, found in zip(strokes, told[name].get(level, ()), strict=False):
                marks = list(stroke_marks([stroke], axes, PER_MM))
                for mark, spots in zip(marks, found, strict=True):
                    if isinstance(mark, Polyline):
                        wanted = [(x, -y) for x, y in mark.points]
                        np.testing.assert_allclose(spots[: len(wanted)], wanted, atol=1e-3, err_msg=f"{name} {stroke}")
                    else:
                        assert isinstance(stroke, PlacedSymbol)
                        radii = np.hypot(*(np.array(spots) - [mark.centre[0], -mark.centre[1]]).T)
                        np.testing.assert_allclose(radii, mark.radius, rtol=1e-3)
