"""What the simulator of Linkage does with a file, by its sources: turning, swinging, curved slots, fixed gears."""

import json
from math import asin, degrees, hypot, pi

import pytest

import planar
from planar.model.mechanism import curved_slots
from planar.reports.files.converted import written_text
from planar.solving.position import rest_position
from tests.foreign_samples import linkage2
from tests.round_trips import read_document, read_text

PIXEL = 25.4 / 96.0
CRANK = 'A 0 0 anchor="true" input="true" rpm="30"\nB 30 0'


def notes(text: str) -> str:
    return " ".join(read_document(text)["notes"])


@pytest.mark.parametrize(("radius", "centre"), [(50.0, (100.0, 30.0)), (-50.0, (100.0, -30.0)), (1.0, (100.0, 0.0))])
def test_a_pin_in_a_curved_slot_keeps_its_distance_from_the_centre(radius, centre):
    """The centre is left of the way from one end to the other where the radius is positive; at least half the way."""
    size = max(abs(radius), 40.0)
    place = f"C 100 {centre[1] - size if radius > 0 else centre[1] + size}"
    ends = 'P 60 0 anchor="true"\nQ 140 0 anchor="true"'
    text = linkage2(f'{CRANK}\n{ends}\n{place} slider="true" slideradius="{radius / PIXEL}" ~P ~Q', "A B\nB C\nP Q")
    assert "curved slot of 'C'" in notes(text) and "stops where the slot ends" in notes(text)
    assert read_document(text)["links"]["C_arc"] == {
        "ends": ["C_centre", "C"],
        "length": pytest.approx(size),
        "curved_slot": True,
    }
    motion = planar.cycle(read_text(text), steps=24)
    for x, y in 1000.0 * motion.point("C").position:
        assert hypot(x - centre[0], y - centre[1]) == pytest.approx(size)


MOVING_SLOT = linkage2(
    f"""A 0 0 anchor="true" input="true"\nB 20 22\nD 10 75 anchor="true"\nP 60 30\nQ 140 30\nE 40 110 anchor="true"
    C 100 10 slider="true" slideradius="{50 / PIXEL}" ~P ~Q""",
    "A B\nB C\nP Q E\nD C",
)
"""A pin of two links in a curved slot of a third that moves."""


def slot_ends(mechanism):
    """The positions of the link that stands for a slot at its two stops."""
    (stops,), (slot,) = mechanism.stops, curved_slots(mechanism)
    return stops.pair == slot.pair.name, slot.carrier, slot.angles(mechanism)


def test_a_curved_slot_comes_back_from_both_files():
    mechanism = read_text(MOVING_SLOT)
    is_centre, carrier, angles = slot_ends(mechanism)
    assert is_centre and carrier == "L2"
    assert angles[1] - angles[0] == pytest.approx(2.0 * asin(40 / 50))
    assert planar.from_dict(planar.to_dict(mechanism)).links == mechanism.links
    conversion = written_text(mechanism, "linkage2")
    assert "C_arc" not in " ".join(conversion.notes) and "slideradius" in conversion.text
    back = read_text(conversion.text)
    assert slot_ends(back)[:2] == (True, "L2")
    assert slot_ends(back)[2] == pytest.approx(angles)
    assert [link.length for link in back.links if link.curved_slot] == [pytest.approx(0.05)]
    assert "the curved slot 'C_arc' is written as a link" in " ".join(written_text(mechanism, "pyslvs").notes)


@pytest.mark.parametrize("stops", [None, [-40, None], [-100, 100]])
def test_a_slot_that_linkage_cannot_say_is_written_as_a_link(stops):
    value = read_document(MOVING_SLOT)
    (centre,) = (pair for pair in value["pairs"] if pair.get("turning") == "C_centre")
    del centre["stops"]
    centre |= {"stops": stops} if stops else {}
    conversion = written_text(planar.from_dict(value), "linkage2")
    assert "the curved slot 'C_arc' is written as a link" in " ".join(conversion.notes)
    assert "slideradius" not in conversion.text
    assert "C_centre" in {pair["turning"] for pair in read_document(conversion.text)["pairs"]}


def test_parts_refuse_a_curved_slot_by_name():
    with pytest.raises(planar.BadInput, match="C_arc: it stands for a curved slot of 'L2'"):
        planar.parts(read_text(MOVING_SLOT))


def test_a_positive_rpm_turns_clockwise_and_a_swinging_input_starts_as_its_offset_says():
    for more, turn in (
        ("", -pi),
        (' limitangle="40"', -pi),
        (' limitangle="40" startoffset="10"', -pi),
        (' limitangle="40" startoffset="50"', pi),
    ):
        text = linkage2(f'A 0 0 anchor="true" input="true" rpm="30"{more}\nB 30 0', "A B")
        (given,) = read_text(text).inputs
        assert given.velocity == pytest.approx(turn)
        assert ("by 40 degrees" in str(read_document(text).get("notes"))) == bool(more)


def test_an_actuator_starts_where_its_offset_says_and_shrinks_where_its_rate_is_negative():
    for rate, offset, velocity in ((15, 0, 10.0), (-15, 0, -10.0), (15, 30, -10.0), (-15, 30, 10.0)):
        more = f'throw="{20 / PIXEL}" cpm="{rate}" startoffset="{offset / PIXEL}" alwaysmanual="true"'
        ends = 'A 0 0 anchor="true"\nB 100 0\nC 130 -60 anchor="true"'
        text = linkage2(ends, f'A B actuator="true" {more}\nB C')
        (given,) = read_text(text).inputs
        assert 1000.0 * given.velocity == pytest.approx(velocity)
        assert "moved by hand" in notes(text)


def test_all_links_that_an_input_alone_holds_turn_with_it():
    """The second crank at A turns as well; the rod at A that is held by the first crank's coupler does not."""
    text = linkage2(
        f'{CRANK}\nC 0 40\nD 90 0 anchor="true"\nE 90 40\nF 0 -40 anchor="true"\nG 40 -40',
        "A B\nA C\nC E\nD E\nF G\nB G",
    )
    mechanism = read_text(text)
    assert "turns are one here" in notes(text) and len(mechanism.inputs) == 1
    state = rest_position(mechanism)
    one, two = (hypot(*(1000.0 * state.points[name].position)) for name in "BC")
    assert (one, two) == (pytest.approx(30.0), pytest.approx(40.0))
    assert len({name for name in ("L0", "L1") if name in {link.name for link in mechanism.links}}) == 1


def test_a_gear_on_an_input_turns_with_it_and_one_that_is_fastened_to_an_anchor_stands_still():
    wheels = f'{CRANK}\nS 0 0 anchor="true"'
    turning = '<ratios><ratio type="gears"><link id="1" size="20"/><link id="2" size="10"/></ratio></ratios>'
    arm = planar.solve(read_text(linkage2(wheels, 'A B\nA gear="true" fastenconnector="2"\nB gear="true"', turning)))
    assert arm.link("L2").angular_velocity == pytest.approx(-pi * (1 + 20 / 10))  # rolls about a sun at rest
    paired = 'A 0 0 anchor="true" input="true" rpm="30"\nB 30 0\nD 90 0 anchor="true"'
    both = planar.solve(read_text(linkage2(paired, 'A B\nA gear="true"\nD gear="true"', turning)))
    assert both.link("L2").angular_velocity == pytest.approx(pi * 20 / 10)


def test_links_of_one_connector_are_no_links():
    """An anchor that slides in a moving slot stands alone; the slot's link swings about it (a swinging block)."""
    text = linkage2(f'{CRANK}\nC 150 0\nD 80 0 anchor="true" slider="true" ~B ~C', "A B\nB C\nD\nA\nB")
    mechanism = read_text(text)
    assert {link.name for link in mechanism.links} == {"frame", "L0", "L1"}
    motion = planar.cycle(mechanism, steps=72)
    assert float(abs(motion.link("L1").angle).max()) == pytest.approx(asin(30 / 80), abs=2e-3)


def test_names_of_connectors_are_those_that_are_shown():
    text = linkage2(CRANK, "A B").replace('name="A"', "").replace('name="B"', "").replace('"1"', '"27"')
    assert {pair["turning"] for pair in read_document(text)["pairs"]} == {"A"}
    assert "b" in json.dumps(read_document(text)["links"])
    far = text.replace('id="0"', 'id="53"')
    assert {pair["turning"] for pair in read_document(far)["pairs"]} == {"B1"}


def test_attributes_without_a_blank_between_them_are_read():
    text = linkage2(CRANK, "A B")
    assert read_document(text.replace('16" x', '16"x')) == read_document(text)
    assert degrees(read_text(text).inputs[0].velocity) == pytest.approx(-180.0)


def test_two_inputs_about_one_place_are_two_connectors():
    links = [{"name": "a", "length": 30}, {"name": "b", "length": 50}]
    value = {
        "planar": 1,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}}
        | {each["name"]: {"ends": ["O", each["name"].upper()], "length": each["length"]} for each in links},
        "pairs": [{"turning": "O", "links": ["f", "a", "b"]}],
        "inputs": [
            {"pair": "O:f,a", "position": 20, "velocity": "2 rad/s"},
            {"pair": "O:f,b", "position": 70, "velocity": "-3 rad/s"},
        ],
    }
    back = read_text(written_text(planar.from_dict(value), "linkage2").text)
    assert sorted(given.velocity for given in back.inputs) == pytest.approx([-3.0, 2.0])
