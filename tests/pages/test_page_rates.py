"""A page at the rates of its inputs: the input that runs first, unit rates, zero values, paths beside dead points."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

import planar
from planar.foundation.errors import BadInput
from planar.model.mechanism import Drive, replace_inputs, unit_rate_note
from planar.model.wording import sentence
from planar.pages.view import page_of
from tests.builders import four_bar_document
from tests.page_scripts import downloaded, same, settled

KNOWN = "() => page.course !== null"


def still_four_bar(**more):
    return planar.from_dict(four_bar_document(0.04, 0.09, 0.07, 0.1, 1.0, 1, omega=None, name="still", **more))


def test_a_page_of_a_file_without_a_velocity_shows_the_unit_rate_and_says_so_once(shown, tmp_path):
    mechanism = still_four_bar(loads=[{"point": "B", "force": [0, -10]}], masses=[{"link": "BC", "mass": 3, "at": "C"}])
    window = shown(mechanism)
    note = sentence(unit_rate_note(mechanism, "A"))
    window.wait_for_function(KNOWN)
    assert window.locator("body").inner_text().count(note) == 1
    assert "times the unit rate" in window.locator("output").first.inner_text()
    turning = replace_inputs(mechanism, (Drive("A", velocity=1.0),))
    same(window, planar.solve(turning))
    # forces are those of the file, which is at rest
    effort = window.evaluate("page.forces.effort('A')")
    assert effort == pytest.approx(planar.forces(planar.solve(mechanism)).inputs["A"], rel=1e-9)
    # and the file that is saved has no velocity
    window.evaluate("page.moveTo(1.2)")
    saved = planar.loads(downloaded(window, "Save: Mechanism (JSON)", tmp_path / "saved.json"))
    assert [given.velocity for given in saved.inputs] == [0.0]
    # a speed that is typed takes the place of the unit rate
    window.evaluate("page.give([[3, 0]])")
    settled(window)
    same(window, planar.solve(turning, [Drive("A", 1.2, 3.0)]))
    assert not window.locator("#unit-rate").is_visible()
    window.evaluate("page.give([[0, 0]])")
    assert window.locator("#unit-rate").is_visible()


def test_a_page_starts_on_the_input_that_has_a_speed_or_that_is_named():
    mechanism = planar.load("pantograph")
    first, second = mechanism.inputs
    behind = replace(mechanism, inputs=(first._replace(velocity=0.0, acceleration=0.0), second))
    assert '"running": 1' in page_of(behind)
    assert '"running": 0' in page_of(mechanism)
    assert '"running": 1' in page_of(mechanism, pair=second.pair)
    with pytest.raises(BadInput, match="there is no input at 'nowhere'"):
        page_of(mechanism, pair="nowhere")


def test_the_unit_rate_is_that_of_the_input_that_runs(shown):
    mechanism = planar.load("pantograph")
    still = replace(
        mechanism, inputs=tuple(given._replace(velocity=0.0, acceleration=0.0) for given in mechanism.inputs)
    )
    window = shown(still)
    for number, given in enumerate(still.inputs):
        window.get_by_role("radio", name=f"Play {given.pair}").check()
        assert window.locator("#unit-rate").inner_text() == sentence(unit_rate_note(still, given.pair))
        assert window.evaluate("page.running") == number
        same(window, planar.solve(replace_inputs(still, (Drive(given.pair, velocity=1.0),))))


def test_what_is_zero_to_round_off_is_drawn_as_zero_in_the_middle_of_an_axis(shown):
    """A parallelogram's coupler does not turn, and its fixed pin A does not move."""
    value = four_bar_document(0.04, 0.1, 0.04, 0.1, 1.0, 1, omega=10.0, name="parallelogram")
    window = shown(planar.from_dict(value))
    window.evaluate(
        "page.chosen.list = [{ kind: 'point', name: 'A' }, { kind: 'link', name: 'BC' }], page.emit('chosen')"
    )
    window.evaluate("page.charts.on = new Set(['y', 'v', 'w', 'e']), page.charts.build()")
    window.wait_for_function(KNOWN)
    assert (
        max(abs(each) for each in window.evaluate("Array.from(page.course.link('BC').w).filter(Number.isFinite)")) > 0.0
    )
    charts = window.evaluate("page.charts.charts.map(({ limits, plot }) => [limits, plot.data[1].filter(Boolean)])")
    assert charts == [[[-0.5, 0.5], []]] * 4
    told = window.locator(".charts figcaption .value").all_inner_texts()
    assert [text.split()[1] for text in told] == ["0"] * 4


def test_paths_beside_dead_points_have_no_corners(shown):
    """Of a double rocker with a point far from its short coupler, as a prosthetic knee is one."""
    value = four_bar_document(39, 29.5, 62.5, 43.2, 70, 1, points={"E": [180, 300]}, name="knee", omega=None)
    mechanism = planar.from_dict(value | {"units": {"length": "mm", "angle": "deg"}})
    window = shown(mechanism)
    window.wait_for_function(KNOWN)
    rows = np.array(window.evaluate("page.course.path('E')"))
    even = np.array(window.evaluate("Array.from(page.course.point('E').x, (x, i) => [x, page.course.point('E').y[i]])"))
    assert window.evaluate("page.course.dead") == [True, True]
    assert len(rows) > len(even)
    assert greatest_corner(even) > 0.15  # rad: what the even positions alone would show
    assert greatest_corner(rows) < 0.1
    # what is put between lies on the path: at the distances of the link's shape from B and C
    frames = window.evaluate(
        "[...page.course.between.values()].flat().map((f) => [...'BCE'].map((name) => page.point(name, f).position))"
    )
    b, c, e = np.array(frames).transpose(1, 0, 2)
    assert np.hypot(*(b - c).T) == pytest.approx(0.0295, rel=1e-9)
    assert np.hypot(*(e - b).T) == pytest.approx(np.hypot(0.18, 0.3), rel=1e-9)


def greatest_corner(path):
    """The greatest angle (rad) between chords of a path that follow each other, but for those that turn back."""
    chords = np.diff(path, axis=0)
    chords = chords[np.hypot(*chords.T) > 1e-9]
    turns = np.abs(np.angle(np.exp(1j * np.diff(np.arctan2(*chords.T[::-1])))))
    return turns[turns < 0.9 * pi].max()


def test_points_of_an_outline_have_neither_letters_nor_paths_of_their_own(shown):
    ring = {
        f"b{k}": [0.045 + 0.012 * np.cos(turn), 0.04 + 0.012 * np.sin(turn)]
        for k, turn in enumerate(np.arange(9) * 0.7)
    }
    window = shown(still_four_bar(points=ring))
    assert window.evaluate("page.data.scheme.letters.map((each) => each.text)") == list("ADBC")
    assert window.evaluate("page.chosen.points()") == ["B", "C"]
    assert window.evaluate("page.data.polygons.vertices.some((each) => each.point?.startsWith('b'))") is False
    outlines = window.evaluate("page.data.scheme.levels.plates.map((each) => each.points.length)")
    assert outlines == [9]
