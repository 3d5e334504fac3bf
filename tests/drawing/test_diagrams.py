"""Kinematic diagrams: curves against closed forms, chords, millimetres, and what is written on them."""

import re
from dataclasses import replace
from itertools import combinations
from math import acos, degrees, pi

import numpy as np
import pytest

import planar
from planar.drawing.diagrams.axes import fit_axis
from planar.drawing.diagrams.kinematic_diagrams import diagrams
from planar.drawing.diagrams.motion_curves import default_subject, find_peak
from planar.foundation.errors import BadInput
from planar.model.mechanism import Drive, replace_inputs

pytest.importorskip("matplotlib")
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from tests.builders import four_bar_document
from tests.closed_forms import piston
from tests.figures import text_boxes

MM = 25.4


def chart(figure, name):
    return next(axes for axes in figure.axes if axes.get_label() == name)


def lines(axes, gid):
    return [line for line in axes.lines if line.get_gid() == gid]


def curve(figure, name, gid):
    (line,) = lines(chart(figure, name), gid)
    return np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)


def texts(figure):
    return [text.get_text() for text in figure.findobj(Text) if text.get_text().strip()]


def caption(figure):
    return " ".join(text.get_text() for text in figure.texts if text.get_gid() == "caption")


def at_speed(mechanism, velocity, acceleration=None):
    return replace_inputs(mechanism, (Drive(mechanism.inputs[0].pair, None, velocity, acceleration),))


def from_top(theta, r, l):  # noqa: E741
    """Displacement from the top dead centre with its first and second derivative by the crank angle."""
    x, first, second = piston(theta, r, l)
    return r + l - x, -first, -second


@pytest.fixture(scope="module")
def twelve():
    return diagrams(planar.load("004-SC12"), chords=12)


def test_the_curves_of_a_slider_crank_are_its_closed_form(twelve):
    time, displacement = curve(twelve, "displacement", "S")
    exact = from_top(time, 0.03, 0.1)
    assert displacement == pytest.approx(1e3 * exact[0], abs=1e-9)
    assert curve(twelve, "velocity", "V")[1] == pytest.approx(exact[1], abs=1e-12)
    assert curve(twelve, "acceleration", "a")[1] == pytest.approx(exact[2], abs=1e-12)


def test_chords_are_rises_over_equal_times_at_the_middles_of_the_intervals(twelve):
    marks = np.linspace(0.0, 2.0 * pi, 13)
    exact = from_top(marks, 0.03, 0.1)
    for name, values in (("velocity", exact[0]), ("acceleration", exact[1])):
        times, rates = curve(twelve, name, "chords")
        assert times == pytest.approx((marks[1:] + marks[:-1]) / 2.0)
        assert rates == pytest.approx(np.diff(values) / (pi / 6.0), abs=1e-12)
        (stems,) = [each for each in chart(twelve, name).collections if each.get_gid() == "stem"]
        assert np.array([path[1] for path in stems.get_segments()]) == pytest.approx(np.column_stack([times, rates]))


def test_the_chords_of_the_chapter_give_less_than_the_exact_greatest_speed(twelve):
    """004-SC12: at most 0.03089 m/rad by twelve chords, in the third; exactly 0.03133 m/rad at 74.53 degrees."""
    told = caption(twelve)
    assert "0.03133 m/s at α = 74.53 deg" in told
    assert "by 12 chords 0.03089 m/s" in told
    assert "V_{3}" in told
    assert "1.4 % less" in told
    assert {f"$V_{{{k}}}$" for k in range(1, 13)} <= set(texts(twelve))


def test_the_scale_of_velocity_is_that_of_displacement_over_the_length_of_a_twelfth(twelve):
    scales = dict(re.findall(r"mu_\{(\w+)\}\$ = ([\d.e-]+)", caption(twelve)))
    by_chords = re.search(r"OK\$/12\)\$ = ([\d.e-]+) \(m/s\)/mm", caption(twelve))
    assert float(by_chords[1]) == pytest.approx(float(scales["s"]) / (float(scales["t"]) * 120 / 12), rel=2e-4)


@pytest.mark.parametrize("width", [80.0, 200.0])
def test_the_time_axis_is_as_long_as_asked_for_in_every_diagram(width):
    figure = diagrams(planar.load("004-SC12"), width=width)
    assert len(figure.axes) == 5
    for axes in figure.axes:
        assert axes.get_position().width * figure.get_figwidth() * MM == pytest.approx(width)
    assert f"OK = {width:g} mm" in caption(figure)


@pytest.mark.parametrize("model", ["002-E3.4", "four-bar"])
def test_ordinates_are_to_the_scale_that_is_written(model):
    figure = diagrams(planar.load(model))
    scales = dict(re.findall(r"mu_\{(\w+)\}\$ = ([\d.e+-]+)", caption(figure)))
    angle = "ω" in scales
    for name, symbol in zip(("displacement", "velocity", "acceleration"), "φωε" if angle else "sva", strict=True):
        axes = chart(figure, name)
        low, high = axes.get_ylim()
        height = axes.get_position().height * figure.get_figheight() * MM
        size = 1.0 if name != "displacement" else pi / 180.0 if angle else 1e-3
        assert (high - low) * size / height == pytest.approx(float(scales[symbol]), rel=1e-3)
        ticks = axes.get_yticks()
        assert np.diff(ticks) / (high - low) * height == pytest.approx(10.0)
        first = f"{np.diff(ticks)[0]:.3e}"
        assert first.startswith(("1.000", "2.000", "5.000"))


def test_time_and_angle_have_their_scales(twelve):
    scales = dict(re.findall(r"mu_\{(\w+)\}\$ = ([\d.e-]+) (?:s|rad)/mm", caption(twelve)))
    assert float(scales["t"]) == pytest.approx(2.0 * pi / 120.0, rel=1e-3)
    assert float(scales["α"]) == pytest.approx(2.0 * pi / 120.0, rel=1e-3)
    assert chart(twelve, "angle").get_xlim() == pytest.approx((0.0, 360.0))
    assert chart(twelve, "time").get_xlim() == pytest.approx((0.0, 2.0 * pi))
    assert [label.get_text() for label in chart(twelve, "angle").get_xticklabels()][:3] == ["0", "30", "60"]


def test_axes_are_labelled_with_units(twelve):
    labels = [chart(twelve, name).get_ylabel() for name in ("displacement", "velocity", "acceleration")]
    assert labels == ["S (mm)", "V (m/s)", "a (m/s²)"]
    assert {"t (s)", "α (deg)"} <= set(texts(twelve))
    turning = diagrams(planar.load("four-bar"))
    assert "ω is" not in caption(turning)
    labels = [chart(turning, name).get_ylabel() for name in ("displacement", "velocity", "acceleration")]
    assert labels == ["φ (deg)", "ω (rad/s)", "ε (rad/s²)"]


def test_rules_stand_at_twelve_numbered_positions(twelve):
    for name in ("displacement", "velocity", "acceleration"):
        axes = chart(twelve, name)
        rules = [line.get_xdata()[0] for line in lines(axes, "position")]
        assert rules == pytest.approx(np.linspace(0.0, 2.0 * pi, 13))
        assert [label.get_text() for label in axes.get_xticklabels()] == [str(k) for k in range(13)]
        assert lines(axes, "zero")[0].get_ydata()[0] == 0.0


def named(figure, name):
    axes = chart(figure, "displacement")
    return sorted(text.xy[0] for text in axes.texts if text.get_gid() == name)


def test_dead_centres_are_named_and_the_stroke_is_measured(twelve):
    assert named(twelve, "TDC") == pytest.approx([0.0, 1.0])
    assert named(twelve, "BDC") == pytest.approx([0.5])
    assert "stroke 60 mm" in texts(twelve)
    assert "Position 0: top dead centre (TDC) of stroke, input O at 0 deg" in caption(twelve)


def test_the_dead_centres_of_an_offset_slider_crank_are_where_crank_and_rod_are_in_line():
    mechanism = planar.load("offset-slider-crank")
    motion = planar.cycle(mechanism)
    points = {name: motion.point(name).position for name in motion.point_names}
    crank = next(link for link in mechanism.links if link.ends and link.ends[0] == mechanism.inputs[0].pair)
    r = crank.length
    (rod,) = [link for link in mechanism.links if link.ends and link is not crank]
    l, e = rod.length, abs(points[rod.ends[1]][0, 1] - points[crank.ends[0]][0, 1])  # noqa: E741
    stroke = np.sqrt((l + r) ** 2 - e**2) - np.sqrt((l - r) ** 2 - e**2)
    apart = pi + acos(np.sqrt((l + r) ** 2 - e**2) / (l + r)) - acos(np.sqrt((l - r) ** 2 - e**2) / (l - r))
    figure = diagrams(mechanism)
    assert named(figure, "TDC") == pytest.approx([0.0, 1.0])
    (bottom,) = named(figure, "BDC")
    assert min(abs(bottom * 2.0 * pi - apart), abs((1.0 - bottom) * 2.0 * pi - apart)) < 1e-9
    assert curve(figure, "displacement", "S")[1].max() == pytest.approx(1e3 * stroke, rel=1e-4)
    assert curve(figure, "displacement", "S")[1].min() == pytest.approx(0.0, abs=1e-9)


def test_a_clockwise_crank_runs_on_in_time():
    figure = diagrams(planar.load("002-E3.4"))
    time, displacement = curve(figure, "displacement", "S")
    assert time[[0, -1]] == pytest.approx([0.0, 60.0 / 210.0])
    exact = from_top(time * 7.0 * pi, 0.2, 0.8)
    assert displacement == pytest.approx(1e3 * exact[0], abs=1e-6)
    assert curve(figure, "velocity", "V")[1] == pytest.approx(exact[1] * 7.0 * pi, abs=1e-8)
    assert curve(figure, "acceleration", "a")[1] == pytest.approx(exact[2] * (7.0 * pi) ** 2, abs=1e-6)


def test_the_files_acceleration_is_left_out_and_that_is_said():
    mechanism = planar.load("four-bar")
    assert mechanism.inputs[0].acceleration != 0.0
    figure = diagrams(mechanism, "E")
    steady = planar.cycle(at_speed(mechanism, None, 0.0), 720).point("E")
    assert curve(figure, "acceleration", "ax")[1] == pytest.approx(steady.acceleration[:, 0], nan_ok=True)
    assert curve(figure, "displacement", "Sy")[1] == pytest.approx(1e3 * (steady.position - steady.position[0])[:, 1])
    assert "the acceleration in the file, -26 rad/s², is left out" in caption(figure)


def test_without_a_speed_rates_are_per_radian():
    mechanism = planar.load("000-P5")
    figure = diagrams(at_speed(mechanism, 0.0, 0.0))
    assert [axes.get_label() for axes in figure.axes] == ["displacement", "velocity", "acceleration", "angle"]
    labels = [chart(figure, name).get_ylabel() for name in ("velocity", "acceleration")]
    assert labels == ["V (m/rad)", "a (m/rad²)"]
    gone, rate = curve(figure, "velocity", "V")
    assert rate == pytest.approx(from_top(gone, 0.15, 0.6)[1], abs=1e-10)
    assert "rates are per radian of the input" in caption(figure)
    assert "mu_{t}" not in caption(figure)


def test_the_greatest_speed_of_the_engine_is_told():
    """000-P5: exactly 7.287 m/s at 76.72 degrees."""
    assert "7.287 m/s at α = 76.72 deg" in caption(diagrams(planar.load("000-P5")))


@pytest.mark.parametrize("model", ["002-E3.3", "four-bar"])
def test_curves_stop_at_the_limits_of_a_range(model):
    figure = diagrams(planar.load(model), chords=12)
    names = ("displacement", "velocity", "acceleration")
    for name, gid in zip(names, ("S", "V", "a") if model == "002-E3.3" else ("φ", "ω", "ε"), strict=True):
        _, values = curve(figure, name, gid)
        assert np.isfinite(values[1:-1]).all()
        assert np.isnan(values[[0, -1]]).all() == (name != "displacement")
        inner = values[len(values) // 10 : -len(values) // 10]
        low, high = chart(figure, name).get_ylim()
        assert low <= inner.min()
        assert high >= inner.max()
        assert high - low < 4.0 * np.ptp(np.append(values[72:-72] if name != "displacement" else values, 0.0))
    assert "no rates exist" in caption(figure)


@pytest.mark.parametrize(
    ("model", "of"),
    [
        ("004-SC12", "stroke"),
        ("002-E3.3", "stroke"),
        ("004-QR", "stroke"),
        ("four-bar", "DC"),
        ("jansen-leg", "c"),
        ("planetary-gear-set", "arm"),
        ("excavator-arm", "boom"),
    ],
)
def test_what_is_drawn_where_nothing_is_named(model, of):
    assert default_subject(planar.load(model)) == of


def test_one_of_several_inputs_runs_and_the_title_says_what_is_drawn():
    figure = diagrams(planar.cycle(planar.load("excavator-arm"), 24, pair="bucket cylinder"))
    assert "Kinematic diagrams of link boom" in texts(figure)
    assert "input bucket cylinder" in caption(figure)
    assert "s₁ (mm)" in texts(figure)
    assert "s₁ is how far the input has moved" in caption(figure)
    assert not curve(figure, "velocity", "ω")[1][1:-1].any()


@pytest.mark.parametrize("of", ["B", "block B.B", "AB.B"])
def test_a_point_that_slides_on_the_frame_is_measured_along_its_slide(of, twelve):
    figure = diagrams(planar.load("004-SC12"), of)
    assert curve(figure, "displacement", "S")[1] == pytest.approx(curve(twelve, "displacement", "S")[1])
    assert "stroke 60 mm" in texts(figure)


def test_a_point_on_a_curve_has_two_curves_that_differ_in_their_dashes():
    figure = diagrams(planar.load("jansen-leg"), "foot")
    x, y = (lines(chart(figure, "velocity"), f"V{axis}")[0] for axis in "xy")
    assert x.get_linestyle() != y.get_linestyle()
    assert [text.get_text() for text in figure.texts if text.get_gid() == "legend"] == ["x", "y"]
    motion = planar.cycle(planar.load("jansen-leg"), 720, pi / 3.0, -5.0 * pi / 3.0).point("foot")
    assert x.get_ydata() == pytest.approx(motion.velocity[:, 0], abs=1e-9)
    assert y.get_ydata() == pytest.approx(motion.velocity[:, 1], abs=1e-9)


@pytest.mark.parametrize(
    ("model", "of"),
    [("002-E3.4", "guide F"), ("004-QR", "CD"), ("geared-five-bar", "P"), ("004-COS", "slot"), ("jansen-leg", "hip")],
)
def test_each_diagram_is_the_derivative_of_the_one_above(model, of):
    figure = diagrams(planar.load(model), of)
    rows = [
        [np.asarray(line.get_ydata()) for line in chart(figure, name).lines if len(line.get_xdata()) > 100]
        for name in ("displacement", "velocity", "acceleration")
    ]
    time = np.asarray(next(line.get_xdata() for line in chart(figure, "velocity").lines if len(line.get_xdata()) > 100))
    size = pi / 180.0 if "φ" in chart(figure, "displacement").get_ylabel() else 1e-3
    for value, rate, second in zip(*rows, strict=True):
        for one, other in ((value * size, rate), (rate, second)):
            found = np.gradient(one, time, edge_order=2)
            assert found == pytest.approx(other, abs=2e-3 * np.abs(other).max())


def test_a_range_that_was_asked_for_is_kept():
    mechanism = planar.load("004-SC12")
    figure = diagrams(planar.cycle(mechanism, 30, start=0.5, stop=2.0))
    time, displacement = curve(figure, "displacement", "S")
    exact = from_top(time + 0.5, 0.03, 0.1)[0]
    assert time[[0, -1]] == pytest.approx([0.0, 1.5])
    assert displacement == pytest.approx(-1e3 * (exact - exact[0]), abs=1e-9)
    assert "Displacements are from position 0" in caption(figure)
    assert named(figure, "TDC") == []


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"of": "nothing"}, "there is no pair, point or link of this name; slides are stroke; points are O, A"),
        ({"width": 10.0}, "a time axis of 60 to 1000 mm"),
        ({"width": float("nan")}, "a time axis of 60 to 1000 mm"),
        ({"chords": 1}, "a whole number of chords from 2"),
        ({"chords": True}, "a whole number of chords from 2"),
    ],
)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(arguments, sentence):
    with pytest.raises(BadInput, match=re.escape(sentence)):
        diagrams(planar.load("004-SC12"), **arguments)


def test_several_inputs_have_to_be_told_apart():
    with pytest.raises(BadInput, match="name the one that runs"):
        diagrams(planar.load("excavator-arm"))


@pytest.mark.parametrize(
    ("model", "of", "width", "chords"),
    [
        ("004-SC12", None, 120.0, 12),
        ("000-P3", None, 60.0, None),
        ("002-E3.4", "guide D", 90.0, 24),
        ("jansen-leg", "foot", 120.0, 12),
        ("geared-five-bar", "P", 150.0, 36),
        ("landing-gear", None, 100.0, 12),
        ("sewing-machine", ["bush", "eyelet", "needle", "rocker", "take-up"], 60.0, 12),
    ],
)
def test_no_text_lies_on_another_or_leaves_the_sheet(model, of, width, chords):
    (wide, high), found = text_boxes(diagrams(planar.load(model), of, chords, width))
    for _, box in found:
        assert min(box.x0, box.y0) >= 0.0
        assert box.x1 <= wide
        assert box.y1 <= high
    for (one, a), (other, b) in combinations(found, 2):
        apart = a.x0 >= b.x1 - 0.5 or b.x0 >= a.x1 - 0.5 or a.y0 >= b.y1 - 0.5 or b.y0 >= a.y1 - 0.5
        assert apart, f"{one!r} lies on {other!r}"


@pytest.mark.filterwarnings("ignore::planar.foundation.errors.MissingGlyphs")
@pytest.mark.parametrize("name", ["$x_{\n\\frac{1", "机构 \U0001f600", "x" * 400])
def test_hostile_names_are_shown_as_texts(name):
    (wide, _), found = text_boxes(diagrams(replace(planar.load("004-SC12"), name=name)))
    assert all(box.x0 >= 0.0 and box.x1 <= wide for _, box in found)


def test_letters_of_chords_keep_clear_of_the_curve(twelve):
    axes = chart(twelve, "velocity")
    FigureCanvasAgg(twelve).draw()
    (line,) = lines(axes, "V")
    spots = axes.transData.transform(np.column_stack([line.get_xdata(), line.get_ydata()]))
    for text in axes.texts:
        box = text.get_window_extent()
        inside = (spots[:, 0] > box.x0) & (spots[:, 0] < box.x1) & (spots[:, 1] > box.y0) & (spots[:, 1] < box.y1)
        assert not inside.any(), text.get_text()


def test_a_peak_between_samples_is_found():
    time = np.linspace(0.0, 2.0 * pi, 361)
    found = find_peak(time, -3.0 * np.sin(time + 0.0031))
    assert found.value == pytest.approx(3.0, abs=1e-8)
    assert degrees(found.time) == pytest.approx(90.0 - degrees(0.0031), abs=1e-4)
    assert find_peak(time, np.full(361, np.nan)) is None


def test_the_same_figure_comes_from_a_mechanism_and_from_its_motion(twelve):
    figure = diagrams(planar.cycle(planar.load("004-SC12"), 2), chords=12)
    assert curve(figure, "velocity", "V")[1] == pytest.approx(curve(twelve, "velocity", "V")[1], abs=1e-12)
    assert caption(figure) == caption(twelve)


def test_two_turns_are_drawn_as_two_turns():
    figure = diagrams(planar.cycle(planar.load("004-SC12"), 60, 1.0, 1.0 + 4.0 * pi))
    gone, displacement = curve(figure, "displacement", "S")
    assert gone[[0, -1]] == pytest.approx([0.0, 4.0 * pi])
    assert displacement == pytest.approx(1e3 * from_top(gone, 0.03, 0.1)[0], abs=1e-9)
    assert chart(figure, "angle").get_xlim() == pytest.approx((0.0, 720.0))


def test_what_is_steady_is_said_to_be_so():
    assert "$ω$ is 104.7 rad/s throughout." in caption(diagrams(planar.load("planetary-gear-set")))


def test_what_turns_at_a_pin_may_be_drawn():
    mechanism = planar.load("planetary-gear-set")
    figure = diagrams(mechanism, "O:arm,sun")
    assert "Kinematic diagrams of pair O:arm,sun" in texts(figure)
    assert curve(figure, "velocity", "ω")[1] == pytest.approx(mechanism.inputs[0].velocity * 2.0 / 3.0)


@pytest.mark.parametrize("most", [5e-324, 1e-310, 1e-290, 1e250])
def test_an_axis_of_the_least_and_the_greatest_numbers_has_ticks(most):
    axis = fit_axis(np.array([0.0, most]), 85.0, "T")
    assert 2 <= len(axis.ticks) < 20
    assert axis.low <= 0.0 < axis.high
    assert np.all(np.isfinite(axis.ticks))


def test_a_coupler_that_only_slides_has_no_angular_acceleration_beside_change_points_either():
    value = four_bar_document(0.04, 0.1, 0.04, 0.1, 1.0, 1, omega=10.0, name="parallelogram")
    figure = diagrams(planar.from_dict(value), "BC")
    for name, symbol in (("displacement", "φ"), ("velocity", "ω"), ("acceleration", "ε")):
        _, values = curve(figure, name, symbol)
        assert not values.any()


def test_several_outputs_share_the_axes_of_their_quantity_and_angles_have_axes_below():
    mechanism = planar.load("sewing-machine")
    figure = diagrams(mechanism, ["bush", "eyelet", "rocker", "take-up"])
    run = diagrams(mechanism, "bush"), diagrams(mechanism, "rocker")
    for name, symbols in (("displacement", "Sφ"), ("velocity", "Vω"), ("acceleration", "aε")):
        length, angle = chart(figure, name), chart(figure, f"angular {name}")
        assert {line.get_gid() for line in length.lines} >= {
            f"{symbols[0]}{of}" for of in ("bush", "eyelet x", "eyelet y")
        }
        assert {line.get_gid() for line in angle.lines} >= {f"{symbols[1]}{of}" for of in ("rocker", "take-up")}
        # the same curves as in diagrams of one output
        _, values = curve(figure, name, f"{symbols[0]}bush")
        assert values == pytest.approx(curve(run[0], name, symbols[0])[1])
        ((_, values),) = [line.get_data() for line in lines(angle, f"{symbols[1]}rocker")]
        assert values == pytest.approx(curve(run[1], name, symbols[1])[1])
        low, high = length.get_ylim()
        assert all(low <= value <= high for line in length.lines for value in np.ravel(line.get_ydata()))
    colours = {line.get_gid(): line.get_color() for line in chart(figure, "velocity").lines}
    assert colours["Veyelet x"] == colours["Veyelet y"] != colours["Vbush"]
    legend = [text.get_text() for text in figure.texts if text.get_gid() == "legend"]
    assert legend == ["bush", "eyelet x", "eyelet y", "rocker", "take-up"]
    for sentence in (
        "S of bush is from top dead centre",
        "of bush 2.112 m/s",
        "$V_x$ of eyelet",
        "of take-up 60 rad/s",
    ):
        assert sentence in caption(figure)
    with pytest.raises(BadInput, match="'bush' is named twice"):
        diagrams(mechanism, ["bush", "bush"])
