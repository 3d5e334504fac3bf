"""Springs, dampers and centres of mass as they are drawn: between their points, as long and as turned as they are."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import atan2, cos, hypot, pi, radians, sin

import numpy as np
import pytest

import planar
from planar.drawing.diagrams.positions import positions
from planar.drawing.output.animation import plan_animation
from planar.drawing.paper.picture import Circle, Fill, Label, Polyline
from planar.drawing.scheme import symbol_table
from planar.drawing.scheme.scheme import scheme
from planar.foundation.errors import BadInput
from planar.model.loads import Mass, Spring
from tests.known import MODELS, state_of
from tests.page_scripts import browser, opened

LAMP = MODELS["balanced-lamp"]
WISHBONE = MODELS["double-wishbone"]


def about(marks, name, kind=Polyline):
    return [mark for mark in marks if mark.about == name and isinstance(mark, kind)]


def lamp_spring(angle):
    """The length (m) of the lamp's spring by the cosine rule: from 80 mm above the pivot to 120 mm along the arm."""
    return hypot(0.12 * cos(angle), 0.12 * sin(angle) - 0.08)


def test_a_spring_is_a_zigzag_between_its_points_and_lengthens_with_them():
    """At every frame of the animation, by the cosine rule; its teeth are as wide at any length."""
    script = plan_animation(LAMP, frames=24)
    per_mm = script.scale.per_mm
    lengths = []
    for row, marks in zip(script.rows, script.bodies, strict=True):
        (spring,) = about(marks, "spring 1")
        start, stop = np.array(spring.points[0]), np.array(spring.points[-1])
        np.testing.assert_allclose(start * per_mm, [0.0, 0.08], atol=1e-12)
        np.testing.assert_allclose(stop * per_mm, script.run.motion.point("R").position[row], atol=1e-12)
        lengths.append(np.hypot(*(stop - start)) * per_mm)
        assert lengths[-1] == pytest.approx(lamp_spring(script.run.position[row]), rel=1e-9)
        way = (stop - start) / np.hypot(*(stop - start))
        off = [float(way[0] * y - way[1] * x) for x, y in np.array(spring.points) - start]
        assert max(off) == pytest.approx(symbol_table.SPRING_HALF_WIDTH) and min(off) == pytest.approx(
            -symbol_table.SPRING_HALF_WIDTH
        )
        assert sum(a * b < -1e-9 for a, b in pairwise(off)) == 11
    assert max(lengths) > 4.0 * min(lengths)


def test_scheme_positions_and_free_bodies_show_springs_and_centres_of_mass():
    pictures = [scheme(state_of("balanced-lamp")), positions(LAMP, 6), planar_space_diagram("balanced-lamp")]
    for picture in pictures:
        assert about(picture.marks, "spring 1")
        for link in ("arm", "stay", "head"):
            assert len(about(picture.marks, f"mass of {link}", Circle)) == 1
            assert {mark.fill for mark in about(picture.marks, f"mass of {link}")} == {Fill.SOLID}
    # what hangs on the frame, but at a pin, has a support there
    assert about(pictures[0].marks, "ground of spring 1")
    at_a_pin = replace(LAMP, springs=(Spring(points=("O", "lamp"), stiffness=5.0),))
    assert not about(scheme(planar.solve(at_a_pin)).marks, "ground of spring 1")


def planar_space_diagram(stem):
    from planar.drawing.forces.free_bodies import free_bodies

    (first, *_), _ = free_bodies(planar.forces(state_of(stem)))
    return first


@pytest.mark.parametrize(
    ("stiffness", "damping", "paths"),
    [(100.0, 0.0, 1), (0.0, 5.0, 4), (100.0, 5.0, 9)],
    ids=["spring", "damper", "both"],
)
def test_a_damper_is_a_dashpot_and_beside_a_spring_both_stand_between_cross_bars(stiffness, damping, paths):
    hung = replace(WISHBONE, springs=(Spring(points=("LA", "UB"), stiffness=stiffness, damping=damping),))
    state = planar.solve(hung)
    drawn = scheme(state)
    strokes = about(drawn.marks, "spring 1")
    assert len(strokes) == paths
    ends = [np.array(state.point(name).position) for name in ("LA", "UB")]
    spots = np.array([spot for stroke in strokes for spot in stroke.points])
    way = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
    along, off = (spots - spots[0]) @ way, (spots - spots[0]) @ [-way[1], way[0]]
    length = np.ptp(along)
    pins = [about(drawn.marks, f"pin {name}", Circle)[0].centre for name in ("LA", "UB")]
    assert length == pytest.approx(np.hypot(*np.subtract(*pins)), rel=1e-9)
    wide = (
        symbol_table.SIDE_BY_SIDE_OFFSET + symbol_table.SPRING_HALF_WIDTH
        if stiffness and damping
        else symbol_table.SPRING_HALF_WIDTH
    )
    assert np.abs(off).max() == pytest.approx(wide)


def test_a_torsional_spring_is_wound_by_as_much_as_its_links_turn():
    """Its outer end points along the first link, its inner end along the second, at every position."""
    coiled = replace(WISHBONE, springs=(Spring(links=("chassis", "lower arm"), stiffness=10.0),))
    wound = []
    for degrees in (-20.0, -3.0, 30.0, 80.0):
        state = planar.solve(coiled, {"LA": radians(degrees)})
        marks = scheme(state).marks
        (spring,) = about(marks, "spring 1")
        centre = np.array(about(marks, "pin LA", Circle)[0].centre)
        arms = np.array(spring.points) - centre
        turns = np.unwrap(np.arctan2(arms[:, 1], arms[:, 0]))
        radii = np.hypot(*arms.T)
        assert (radii[0], radii[-1]) == pytest.approx(symbol_table.TORSION_SPRING_RADII[::-1])
        chassis = atan2(440 - 190, 330 - 250)
        assert np.exp(1j * turns[0]) == pytest.approx(np.exp(1j * chassis))
        assert np.exp(1j * turns[-1]) == pytest.approx(np.exp(1j * radians(degrees)))
        wound.append(turns[-1] - turns[0])
    np.testing.assert_allclose(np.diff(wound), np.radians(np.diff((-20.0, -3.0, 30.0, 80.0))), atol=1e-9)
    assert all(abs(each) > 3.0 * pi for each in wound)
    damped = replace(coiled, springs=(Spring(links=("chassis", "lower arm"), damping=1.0),))
    assert len(about(scheme(planar.solve(damped)).marks, "spring 1")) == 2  # a ring and its vane


def letters(mechanism):
    marks = scheme(planar.solve(mechanism)).marks
    return sorted(each.text for each in about_masses(marks))


def about_masses(marks):
    return [mark for mark in marks if isinstance(mark, Label) and mark.about.startswith("mass of ")]


def test_a_centre_of_mass_has_a_letter_where_no_point_of_its_link_has_a_name():
    four, off = MODELS["four-bar"], (0.03, 0.01)
    assert letters(replace(LAMP, masses=(Mass("head", 1.0, "lamp"),))) == []
    assert letters(replace(LAMP, masses=(Mass("arm", 1.0, off), Mass("head", 1.0, "lamp")))) == ["G"]
    assert letters(LAMP) == ["G₁", "G₃"]
    assert letters(replace(LAMP, masses=(Mass("arm", 1.0, off), Mass("arm", 1.0, (0.1, 0.0))))) == ["G₁", "G₁′"]
    assert "G" in state_of("four-bar").point_names  # which that centre then is not called
    assert letters(replace(four, masses=(Mass("AB", 1.0, off),))) == ["G₁"]
    # a moment of inertia alone is nowhere
    assert not about(
        scheme(planar.solve(replace(LAMP, masses=(Mass("arm", 0.0, off, 1.0),)))).marks, "mass of arm", Circle
    )


def test_the_mark_of_a_centre_is_at_the_centre_and_within_the_drawing():
    """Also where it is far from all points: the scale has room for it."""
    far = replace(LAMP, masses=(Mass("arm", 1.0, (1.0, 0.0)),))
    drawn = scheme(planar.solve(far))
    (mark,) = about(drawn.marks, "mass of arm", Circle)
    pin = np.array(about(drawn.marks, "pin O", Circle)[0].centre)
    np.testing.assert_allclose(
        np.subtract(mark.centre, pin) / np.hypot(*np.subtract(mark.centre, pin)), [cos(radians(50)), sin(radians(50))]
    )
    assert np.hypot(*np.subtract(mark.centre, pin)) < 160.0


def test_a_spring_or_mass_made_in_python_that_is_nowhere_is_refused_in_a_sentence():
    for more in ({"springs": (Spring(points=("S", "Z"), stiffness=1.0),)}, {"masses": (Mass("arm", 1.0, "Z"),)}):
        with pytest.raises(BadInput, match="no point 'Z'"):
            scheme(planar.solve(replace(LAMP, **more)))


ENDS = """() => {
  const path = document.querySelector(".mechanism .springs path").getAttribute("d");
  const numbers = path.match(/-?[0-9.]+/g).map(Number), last = numbers.length;
  const pins = [...document.querySelectorAll(".mechanism .pins .pen-pin.fill-paper")].map((pin) => {
    const box = pin.getBoundingClientRect(), svg = document.getElementById("drawing").getBoundingClientRect();
    return [box.x + box.width / 2 - svg.x, box.y + box.height / 2 - svg.y];
  });
  return {
    ends: [numbers.slice(0, 2), numbers.slice(last - 2)], pins,
    masses: document.querySelectorAll(".mechanism .sliders circle").length,
    letters: [...document.querySelectorAll(".mechanism .letter")].map((each) => each.textContent),
  };
}"""


def test_on_a_page_springs_lengthen_as_the_input_moves_and_masses_are_marked(tmp_path):
    """From one pin to another: the ends of the zigzag stay in the middles of the pins."""
    strut = (Spring(points=("LA", "UB"), stiffness=1e4, damping=50.0),)
    file = tmp_path / "page.html"
    planar.view(replace(WISHBONE, springs=strut, masses=(Mass("knuckle", 8.0, (0.03, 0.1)),)), file)
    with browser() as chrome:
        window, wrong = opened(chrome.new_context(), file)
        lengths = []
        for key in ("", "ArrowRight"):
            if key:
                window.locator("input[type=range]").nth(1).focus()
                for _ in range(8):
                    window.keyboard.press(key)
            window.wait_for_timeout(50)
            found = window.evaluate(ENDS)
            for end in found["ends"]:
                assert min(np.hypot(*np.subtract(end, pin)) for pin in found["pins"]) < 1.0
            lengths.append(np.hypot(*np.subtract(*found["ends"])))
            assert found["masses"] == 1
            assert "G" in found["letters"]
        assert not wrong
    assert abs(lengths[1] - lengths[0]) > 2.0
