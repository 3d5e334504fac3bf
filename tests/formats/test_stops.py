"""Strokes, slot ends and limits: stops of what is read, and read back of what is written; what is lost is a note."""

import json
import math
from math import radians

import pytest

import planar
from planar.reports.files.converted import written_text
from tests.foreign_samples import PIXEL, asmt, asmt_limit, linkage2, pmksplus_cylinder
from tests.round_trips import read_back, read_document, read_text, worst_deviation

MILLIMETRES = {"length": "mm", "angle": "deg"}


def boom(stops=(800, 1300), **more):
    """A boom on a hydraulic cylinder between two pins."""
    cylinder = {"sliding": "cylinder", "links": ["tube", "rod"], "line": {"through": "C"}, "point": "D"}
    return {
        "planar": 1,
        "units": MILLIMETRES,
        "frame": "truck",
        "links": {
            "truck": {"points": {"O": [0, 0], "C": [600, -400]}},
            "boom": {
                "ends": ["O", "T"],
                "length": 3000,
                "points": {"D": {"along": ["O", "T"], "distance": 1200, "angle": -8}},
            },
            "tube": {"points": {"C": [0, 0]}},
            "rod": {"points": {"D": [0, 0]}},
        },
        "pairs": [
            {"turning": "O"},
            {"turning": "C"},
            {"turning": "D"},
            cylinder | ({"stops": list(stops)} if stops else {}),
        ],
        "inputs": [{"pair": "cylinder", "position": 800, "velocity": "50 mm/s"}],
        "sketch": {"T": [2900, 500]},
    } | more


def stop_widths(mechanism):
    """The distance between the two stops of each pair that has stops (m or rad)."""
    return {stop.pair: stop.high - stop.low for stop in mechanism.stops}


def notes(text):
    return " ".join(read_document(text).get("notes", ()))


def test_a_driven_cylinder_is_an_actuator_of_linkage_with_its_stroke_and_speed():
    mechanism = planar.from_dict(boom())
    assert worst_deviation(mechanism, "linkage2", (0.01, 0.1)) < 1e-9
    back = read_back(mechanism, "linkage2")
    (stop,), (given,) = back.stops, back.inputs
    assert (stop.low, stop.high) == (pytest.approx(0.8), pytest.approx(1.3))
    assert (given.position, given.velocity) == (pytest.approx(0.8), pytest.approx(0.05))
    ends = planar.cycle(back, steps=8).point("T").position[[0, -1]]
    assert ends == pytest.approx(planar.cycle(mechanism, steps=8).point("T").position[[0, -1]], abs=1e-9)


@pytest.mark.parametrize(
    ("position", "velocity", "length", "speed"), [(1300, 50, 1.3, 0.05), (1000, -20, 1.0, -0.02), (900, 0, 0.9, 0.0)]
)
def test_an_actuator_keeps_its_place_in_the_stroke_and_its_direction(position, velocity, length, speed):
    inputs = [{"pair": "cylinder", "position": position, "velocity": f"{velocity} mm/s"}]
    back = read_back(planar.from_dict(boom(inputs=inputs)), "linkage2")
    assert (back.inputs[0].position, back.inputs[0].velocity) == (pytest.approx(length), pytest.approx(speed))
    assert (back.stops[0].low, back.stops[0].high) == (pytest.approx(0.8), pytest.approx(1.3))


def test_an_input_without_stops_is_written_with_a_stroke_that_a_note_says():
    written = written_text(planar.from_dict(boom(stops=None)), "linkage2")
    assert "the input at 'cylinder' has no two stops; its actuator has a stroke of" in " ".join(written.notes)
    assert 'actuator="true"' in written.text


def test_a_driven_slide_on_the_frame_is_written_with_an_actuator_beside_it():
    assert worst_deviation(planar.load("stick-slip"), "linkage2") < 1e-9


def test_a_cylinder_of_pmksplus_keeps_its_stroke():
    mechanism = planar.from_dict(boom())
    written = written_text(mechanism, "pmksplus")
    assert not [note for note in written.notes if "stops" in note]
    back = read_text(written.text)
    assert stop_widths(back) == {"cylinder": pytest.approx(0.5, abs=2e-5)}
    assert back.inputs[0].position == pytest.approx(back.stops[0].low, abs=2e-5)
    assert back.inputs[0].velocity == pytest.approx(0.05)


def test_the_stroke_of_a_cylinder_of_pmksplus_follows_from_its_barrel_and_the_scale():
    """cylinder.ts: stroke = barrel - 1.4 R, and the rod's inner end starts 1.4 R and half a head from the mount."""
    scale, barrel, rod, start = 0.7, 4.0, 4.0, 0.25
    radius = 0.15 * scale
    stroke, shut = barrel - 1.4 * radius, (1.4 + 3.84) * radius
    mechanism = read_text(pmksplus_cylinder(scale, barrel, shut + start * stroke, rod))
    (stop,) = mechanism.stops
    assert stop.high - stop.low == pytest.approx(stroke / 100.0, abs=1e-5)
    assert mechanism.inputs[0].position - stop.low == pytest.approx(start * stroke / 100.0, abs=2e-5)
    assert mechanism.inputs[0].velocity == pytest.approx(0.03)  # its own 3 cm/s
    beyond = pmksplus_cylinder(scale, barrel, shut + 1.2 * stroke, rod)
    assert read_text(beyond).stops == () and "beyond it; it has no stops here" in notes(beyond)


def test_a_cylinder_that_was_read_of_pmksplus_is_written_as_one_again():
    first = read_text(pmksplus_cylinder(1.0, 4.0, 2.0, 5.0))
    written = written_text(first, "pmksplus")
    assert not [note for note in written.notes if "left out" in note]
    (stop,), (again,) = first.stops, read_text(written.text).stops
    assert (again.low, again.high) == (pytest.approx(stop.low, abs=2e-5), pytest.approx(stop.high, abs=2e-5))


def test_a_point_on_the_bar_of_a_cylinder_that_pmksplus_cannot_have_is_a_note():
    with_point = boom()
    with_point["links"]["tube"]["points"]["M"] = [70, 0]
    written = written_text(planar.from_dict(with_point), "pmksplus")
    assert "the point 'M' of 'tube' is left out" in " ".join(written.notes)
    assert len(read_text(written.text).stops) == 1


def test_stops_that_a_format_has_not_are_named_with_their_values():
    mechanism = planar.from_dict(boom())
    for name in ("pmks", "pyslvs"):
        told = " ".join(written_text(mechanism, name).notes)
        assert "the stops of the slide 'cylinder', 0 to 500 mm from its drawn position, are left out" in told
    pins = boom() | {"pairs": [{"turning": "O", "stops": [-5, None]}, *boom()["pairs"][1:]]}
    told = " ".join(written_text(planar.from_dict(pins), "pmksplus").notes)
    assert "the stops of the pin 'O'" in told and "to open deg" in told


def test_slots_of_linkage_end_where_their_connectors_are_in_both_directions():
    text = linkage2(
        'A 0 0 anchor="true" input="true" rpm="-60"\nB 30 40\nL 50 0 anchor="true"\nR 155 0 anchor="true"\n'
        'C 150 0 slider="true" ~L ~R',
        "A B\nB C\nL R",
    )
    mechanism = read_text(text)
    assert stop_widths(mechanism) == {"C": pytest.approx(0.105)}
    end = planar.cycle(mechanism, steps=36).point("C").position[:, 0].max()
    assert end <= 0.155 + 1e-9
    assert stop_widths(read_back(mechanism, "linkage2")) == {"C": pytest.approx(0.105)}
    outside = text.replace(f'x="{155 / PIXEL!r}"', f'x="{140 / PIXEL!r}"')
    assert read_text(outside).stops == ()
    assert "the slot of 'C' is 90 mm long, but its pin was drawn 10 mm beyond its end" in notes(outside)


def test_a_curved_slot_ends_where_its_connectors_are():
    ends = 'P 60 0 anchor="true"\nQ 140 0 anchor="true"\nC 100 -20 slider="true"'
    text = linkage2(
        f'A 0 0 anchor="true" input="true"\nB 30 0\n{ends} slideradius="{50 / PIXEL}" ~P ~Q', "A B\nB C\nP Q"
    )
    assert list(stop_widths(read_text(text)).values()) == [pytest.approx(2.0 * math.asin(40 / 50))]


@pytest.mark.parametrize(("rpm", "offset"), [(30, 0), (-30, 0), (30, 10), (-30, 50)])
def test_an_input_of_linkage_that_goes_to_and_fro_stops_at_both_ends(rpm, offset):
    swing = f'limitangle="40" startoffset="{offset}"'
    mechanism = read_text(linkage2(f'A 0 0 anchor="true" input="true" rpm="{rpm}" {swing}\nB 30 0', "A B"))
    (stop,), (given,) = mechanism.stops, mechanism.inputs
    begun = radians(offset if offset < 40 else 80 - offset)
    low = -begun if rpm < 0 else begun - radians(40)
    assert (stop.low, stop.high) == (pytest.approx(low), pytest.approx(low + radians(40)))
    back = read_back(mechanism, "linkage2")
    assert (back.stops[0].low, back.stops[0].high) == (pytest.approx(stop.low), pytest.approx(stop.high))
    assert back.inputs[0].velocity == pytest.approx(given.velocity)


def test_a_cylinder_of_motiongen_stays_within_a_stroke_of_its_drawn_length():
    value = {
        "joints": [{"id": "A", "x": 0, "y": 0}, {"id": "B", "x": 3, "y": 0}, {"id": "C", "x": 3, "y": -4}],
        "links": [{"joints": ["A", "C"], "isGround": True}, {"joints": ["B", "C"]}],
        "slots": [],
        "cylinders": [{"joints": ["A", "B"], "stroke": 1.5}],
        "actuators": [{"type": "linear", "at": "B", "from": "A", "velocity": 1}],
    }
    (stop,) = read_text(json.dumps(value)).stops
    assert (stop.low / 0.0254, stop.high / 0.0254) == (pytest.approx(1.5), pytest.approx(4.5))
    assert "does not say where in it" in notes(json.dumps(value))
    value["actuators"] = [{"type": "rotary", "at": "C", "from": "A", "to": "B", "min": 10, "max": 70, "velocity": 1}]
    assert "the actuator at 'C' goes from 10 to 70 deg" in notes(json.dumps(value))


def test_arcs_of_pylinkage_are_stops():
    crank = {"id": "AB", "type": "arc_driver", "joints": ["A", "B"], "motor_joint": "A", "angular_velocity": 0.1}
    joints = [{"id": "A", "type": "ground", "position": [0, 0]}, {"id": "B", "type": "revolute", "position": [0, 2]}]
    links = [crank | {"arc_start": 0.5, "arc_end": 2.0}]
    (stop,) = read_text(json.dumps({"joints": joints, "links": links})).stops
    assert (stop.low, stop.high) == (pytest.approx(0.5), pytest.approx(2.0))  # the crank's own angle


SLIDER = (
    {
        "": {"m1": (0, 0), "x0": (0, 0)},
        "crank": {"a": (0, 0), "b": (30, 40)},
        "rod": {"b": (30, 40), "c": (150, 0)},
        "piston": {"c": (150, 0), "x1": (150, 0)},
    },
    "RevoluteJoint A m1 crank/a\nRevoluteJoint B crank/b rod/b\nRevoluteJoint C rod/c piston/c\n"
    "TranslationalJoint slide x0 piston/x1",
)


def test_limits_of_ondsel_are_stops():
    text = asmt(*SLIDER, "A 2.0d*pi*time")
    limits = [
        asmt_limit("TranslationLimit", "slide", "0.16", "=<"),
        asmt_limit("TranslationLimit", "slide", "0.1", "=>"),
    ]
    limits.append(asmt_limit("RotationLimit", "B", "-30.0*pi/180.0", "=>"))
    stops = {
        stop.pair: stop
        for stop in read_text(text.replace("\n\t\tMotions", "\n\t\tLimits" + "".join(limits) + "\n\t\tMotions")).stops
    }
    assert (stops["slide"].low, stops["slide"].high) == (pytest.approx(0.1), pytest.approx(0.16))
    assert stops["B"].high is None
    passed = text.replace(
        "\n\t\tMotions", "\n\t\tLimits" + asmt_limit("TranslationLimit", "slide", "0.1", "=<") + "\n\t\tMotions"
    )
    assert read_text(passed).stops == ()
    assert "the stops of the slide 'slide', open to -0.05 m from its drawn position, are left out" in notes(passed)


def test_stops_of_a_driven_pin_are_a_swing_of_linkage():
    low, high = radians(-10), radians(50)
    value = {
        "planar": 1,
        "units": MILLIMETRES,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "a": {"ends": ["O", "A"], "length": 30}},
        "pairs": [{"turning": "O", "links": ["f", "a"], "stops": [-10, 50]}],
        "inputs": [{"pair": "O", "position": 20, "velocity": "2 rad/s"}],
    }
    (stop,) = read_back(planar.from_dict(value), "linkage2").stops
    assert (stop.low, stop.high) == (pytest.approx(low), pytest.approx(high))
