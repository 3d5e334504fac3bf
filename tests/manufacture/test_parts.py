"""Plates that are cut: what holes are apart, what clears what by polygons, teeth by what is measured on gears."""

import io
import json
import re
from itertools import combinations, pairwise
from math import acos, cos, hypot, pi, radians, sin, tan
from pathlib import Path
from xml.etree import ElementTree

import ezdxf
import numpy as np
import pytest
from matplotlib.path import Path as Polygon

import planar
from planar.manufacture.gear_sizes import MODULES
from planar.manufacture.involute import gear_outline, span_length
from planar.manufacture.layers import LayerRules, broken_rules, find_layers
from planar.manufacture.nesting import nested
from planar.manufacture.plates import Hole, Plate, convex_hull, moved_plate, plate_area, rounded_hull, sampled
from tests.command import run
from tests.cut_plates import drawn, meet
from tests.draws import part

CLEAR = ("four-bar", "klann-leg", "jansen-leg", "v-twin-engine", "gear-reducer", "planetary-gear-set", "slider-crank")


def dxf(found):
    return ezdxf.read(io.StringIO(found.encode(".dxf").decode())).modelspace()


@pytest.mark.parametrize("model", part(CLEAR[:5], 2))
def test_plates_of_a_layer_never_meet_by_polygons(model):
    found = planar.parts(model, scale=1.0, sheet=(9.0, 9.0))
    assert found.is_clear
    motion = planar.cycle(model, steps=40)
    for one, other in combinations(found.plates, 2):
        if one.layer == other.layer and one.link != other.link and "wheel" not in (one.kind, other.kind):
            assert not any(meet(drawn(one, motion, row), drawn(other, motion, row)) for row in range(0, 41, 2))


@pytest.mark.parametrize("model", CLEAR)
def test_no_pin_runs_through_a_plate(model):
    found = planar.parts(model, scale=1.0, sheet=(9.0, 9.0))
    assert found.is_clear
    layers = {plate.name: plate.layer for plate in found.plates}
    for pin in found.pins:
        held = {p.layer for p in found.plates if pin.name in {h.pin for h in (*p.holes, *p.slots)}}
        assert pin.layers[0] <= min(held) and max(held) <= pin.layers[1]
        assert pin.length == pytest.approx(found.thickness * (pin.layers[1] - pin.layers[0] + 1))
    assert layers[found.plates[0].name] == 0 and found.plates[0].link == found.mechanism.frame


def test_where_no_order_is_clear_it_says_what_meets():
    """Whitworth's crank goes round the pin of its slotted link, which goes round the crank's."""
    found = planar.parts("whitworth")
    assert not found.is_clear
    assert any("no order of layers was found" in note and "pin 'C' meets plate 'crank'" in note for note in found.notes)


def test_holes_in_the_dxf_are_as_far_apart_as_the_links_are_long():
    found = planar.parts("klann-leg", play=2e-4)
    circles = [each for each in dxf(found) if each.dxftype() == "CIRCLE"]
    assert {round(2.0 * each.dxf.radius, 9) for each in circles} == {6.2}
    read = sorted(
        round(hypot(a.dxf.center.x - b.dxf.center.x, a.dxf.center.y - b.dxf.center.y), 6)
        for a, b in combinations(circles, 2)
    )
    state = planar.solve("klann-leg")
    for first, second in (("O", "C"), ("C", "E"), ("E", "K"), ("L", "E"), ("U", "H"), ("K", "H")):
        wanted = 1e3 * np.linalg.norm(state.point(first).position - state.point(second).position)
        assert min(abs(each - wanted) for each in read) < 1e-5


def test_the_dxf_says_millimetres_and_has_all_that_is_cut():
    found = planar.parts("slider-crank")
    document = ezdxf.read(io.StringIO(found.encode(".dxf").decode()))
    assert document.units == ezdxf.units.MM
    assert not document.audit().errors
    kinds = [(each.dxftype(), each.dxf.layer) for each in document.modelspace()]
    assert kinds.count(("LWPOLYLINE", "CUT")) == len(found.plates)
    assert kinds.count(("LWPOLYLINE", "SLOTS")) == 1
    assert found.scale == 0.2 and "1:5" in found.notes[0]


def test_a_slot_is_as_long_as_the_stroke():
    """At 1:5 of twice the crank of 480 mm."""
    (slot,) = (slot for plate in planar.parts("slider-crank").plates for slot in plate.slots)
    assert hypot(slot.end[0] - slot.start[0], slot.end[1] - slot.start[1]) == pytest.approx(2 * 480 / 5)


@pytest.mark.parametrize(("model", "unit"), [("four-bar", "mm"), ("engine-in-inches", "in")])
def test_the_svg_is_as_large_as_its_parts_and_their_list(model, unit):
    found = planar.parts(model)
    root = ElementTree.fromstring(found.encode(".svg"))
    width, height = (float(root.get(side).removesuffix(unit)) for side in ("width", "height"))
    assert root.get("viewBox") == f"0 0 {width:.6g} {height:.6g}"
    paths = [each for each in root if each.tag.endswith("path")]
    assert len(paths) == len(found.plates)
    numbers = np.array([re.findall(r"(-?[\d.]+) (-?[\d.]+)(?= [A-Z]|$)", each.get("d")) for each in paths[:1]], float)
    assert numbers.min() >= 0.0
    millimetre = 1.0 if unit == "mm" else 1 / 25.4
    sides = [np.ptp(np.array(sampled(plate.outline)), axis=0) * millimetre for plate in found.sheets[0]]
    assert max(side[0] for side in sides) < width < found.sheet[0] * 1e3 * millimetre
    lowest = min(float(each.get("y")) for each in root if each.get("text-anchor") == "start")
    assert lowest < (found.sheet[1] * 1e3 + 8.0) * millimetre  # the list stands right beneath the parts


def test_a_file_in_inches_gives_plates_pins_and_areas_in_inches(tmp_path):
    found = planar.parts("engine-in-inches")
    document = ezdxf.read(io.StringIO(found.encode(".dxf").decode()))
    assert document.units == document.header["$INSUNITS"] == ezdxf.units.IN
    circles = [each for each in document.modelspace() if each.dxftype() == "CIRCLE"]
    assert {round(2.0 * each.dxf.radius, 9) for each in circles} == {0.505}
    apart = [
        hypot(a.dxf.center.x - b.dxf.center.x, a.dxf.center.y - b.dxf.center.y) for a, b in combinations(circles, 2)
    ]
    assert min(abs(each - 8.0) for each in apart) < 1e-9  # the rod
    (sheet,) = (each for each in document.modelspace() if each.dxf.layer == "SHEET")
    assert max(map(tuple, sheet.get_points("xy"))) == pytest.approx((24.0, 16.0))
    shown = run(tmp_path, "parts", "engine-in-inches").done()
    assert "0.125 in plates at scale 1:1" in shown
    assert "in²" in shown
    assert "mm" not in shown
    rod = next(plate for plate in found.plates if plate.name == "rod")
    assert f"{8.0 * 1.5 + pi * 0.75**2 - 2 * pi * 0.2525**2:.5g}" in shown  # a bar, two half discs, two holes
    assert plate_area(rod) / 25.4**2 == pytest.approx(8.0 * 1.5 + pi * 0.75**2 - 2 * pi * 0.2525**2)
    small = run(tmp_path, "parts", "engine-in-inches", "--sheet", "8x6").done()
    assert "at scale 1:2" in small
    assert "such as 24x16 (in)" in run(tmp_path, "parts", "engine-in-inches", "--sheet", "big").refused(2)


def test_springs_and_points_that_are_named_get_holes(tmp_path):
    """The spring of the door from S of the wall to A, which has the hole of a pin already."""
    door = Path(__file__).parents[1] / "data" / "ranges" / "garage-door.json"
    found = planar.parts(door, holes=("bottom",))
    holes = {plate.name: {hole.pin: hole.at for hole in plate.holes} for plate in found.plates}
    assert {name: set(own) for name, own in holes.items()} == {
        "wall": {"O", "Q", "S"},
        "arm": {"O", "A"},
        "guide": {"Q", "B"},
        "door": {"A", "B", "bottom"},
    }
    assert np.subtract(holes["wall"]["S"], holes["wall"]["O"]) == pytest.approx([0.0, 1050.0 / 5], abs=1e-9)
    assert np.hypot(*np.subtract(holes["door"]["bottom"], holes["door"]["B"])) == pytest.approx(1700.0 / 5)
    assert {pin.name for pin in found.pins} == set("OQAB")
    done = run(tmp_path, "parts", str(door), "--hole", "top", "--hole", "door.bottom", "--json")
    record = json.loads(done.done())
    assert {"top", "door.bottom"} < next(set(each["holes"]) for each in record["plates"] if each["plate"] == "door")
    assert "there is no point 'knob'" in run(tmp_path, "parts", str(door), "--hole", "knob").refused(2)
    near = planar.parts(door, pin=0.05, wall=0.01, scale=0.05)  # an arm of 24.6 mm
    assert any("run into each other" in note for note in near.notes)


@pytest.mark.parametrize("model", ["four-bar", "klann-leg"])
def test_spacers_fill_the_gaps_of_pins_and_meet_no_plate(model):
    found = planar.parts(model, scale=1.0, sheet=(9.0, 9.0))
    motion = planar.cycle(model, steps=40)
    layers = {plate.name: plate.layer for plate in found.plates}
    gaps = []
    for pin in found.pins:
        joined = sorted({layers[p.name] for p in found.plates if pin.name in {hole.pin for hole in p.holes}})
        gaps += [(pin.name, low + 1, high - 1) for low, high in pairwise(joined) if high - low > 1]
    assert gaps
    assert [(each.pin, *each.layers) for each in found.spacers] == gaps
    for spacer in found.spacers:
        low, high = spacer.layers
        assert spacer.length == pytest.approx(found.thickness * (high - low + 1))
        (diameter,) = (pin.diameter for pin in found.pins if pin.name == spacer.pin)
        assert spacer.inner == pytest.approx(diameter + 1e-4) and spacer.outer > spacer.inner
        ring = spacer.outer / 2.0 * np.exp(2j * pi * np.arange(48) / 48)
        for plate in found.plates:
            for row in range(41) if low <= plate.layer <= high else ():
                place = motion.point(spacer.pin).position[row]
                around = np.column_stack([place[0] + ring.real, place[1] + ring.imag])
                assert not meet(around, drawn(plate, motion, row))
    assert any(line.startswith(f"spacer on pin {found.spacers[0].pin}: ") for line in found.lines())


def test_a_bar_is_its_length_and_two_half_discs():
    hull = rounded_hull([(0.0, 0.0), (30.0, 40.0)], 6.0)
    plate = Plate("b", "b", "bar", hull, (), (Hole("p", (0.0, 0.0), 5.0),), (), ((0.0, 0.0), (30.0, 40.0)), 6.0)
    wanted = 50 * 12 + pi * 36 - pi * 6.25
    assert plate_area(plate) == pytest.approx(wanted, rel=1e-12)
    assert plate_area(moved_plate(plate, 33.0, 7.0, -2.0)) == pytest.approx(plate_area(plate))


@pytest.mark.parametrize("angle", [0.0, 0.3, pi / 2, 2.0])
def test_the_hull_of_points_on_a_line_has_its_ends_whatever_rounding_makes_of_them(angle):
    noise = (0.0, 1e-15, -2e-15, 4e-15)
    spots = [(along, across) for along in (0.0, 1.0, 3.0) for across in noise]
    points = [(cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y) for x, y in spots]
    hull = convex_hull(points)
    assert len(hull) == 2
    assert hypot(hull[0][0] - hull[1][0], hull[0][1] - hull[1][1]) == pytest.approx(3.0)
    assert len(convex_hull(points[:4])) == 1


def test_a_block_with_two_pins_has_both_holes_in_its_plate():
    found = planar.parts("engine-in-inches")
    (block,) = (plate for plate in found.plates if plate.name == "block B")
    inside = Polygon(np.array(sampled(block.outline)))
    assert all(inside.contains_point(hole.at) for hole in block.holes)
    assert len(block.drilled) == 2  # the pin of the slot and that of the rod are on one axis


def test_the_hull_is_convex_and_holds_all_points():
    points = [(cos(n * 2.4) * n, sin(n * 2.4) * n) for n in range(40)]
    hull = np.array(convex_hull(points))
    ways = np.roll(hull, -1, axis=0) - hull
    after = np.roll(ways, -1, axis=0)
    assert np.all(ways[:, 0] * after[:, 1] - ways[:, 1] * after[:, 0] > 0)
    assert Polygon(np.vstack([hull, hull[:1]])).contains_points(points, radius=1e-9).sum() >= len(points) - len(hull)


@pytest.mark.parametrize(("teeth", "over"), [(17, 2), (20, 3), (41, 5)])
def test_teeth_measure_over_several_as_involutes_do(teeth, over):
    """Parallel planes that touch k teeth are m cos a (pi (k - 1/2) + z inv a) apart (Wildhaber)."""
    module, angle = 2.0, radians(20.0)
    first = pi / 2 - (over - 1) * pi / teeth  # so many teeth, to either side of upwards
    points = np.array([(x, y) for x, y, _ in gear_outline(teeth, module, angle, first)])
    embraced = points[: over * len(points) // teeth]
    wanted = span_length(teeth, module, angle, over)
    assert np.ptp(embraced[:, 0]) == pytest.approx(wanted, rel=1e-3)
    assert {17: 9.332, 20: 15.321, 41: 27.718}[teeth] == pytest.approx(wanted, abs=6e-3)


@pytest.mark.parametrize("teeth", [12, 17, 34, 80])
def test_a_tooth_is_as_thick_as_an_involute_is_at_any_radius(teeth):
    """s(r) = r (pi / z + 2 inv a - 2 inv acos(rb / r)), the textbook's formula."""
    module, angle = 1.5, radians(20.0)
    pitch = module * teeth / 2.0
    points = np.array([(x, y) for x, y, _ in gear_outline(teeth, module, angle, 0.0)])
    own = points[: len(points) // teeth]
    radius = np.hypot(*own.T)
    base = pitch * cos(angle)
    for at, polar in zip(radius, np.arctan2(own[:, 1], own[:, 0]), strict=True):
        if at > base * (1 + 1e-9):
            steep = acos(base / at)
            half = pi / (2 * teeth) + (tan(angle) - angle) - (tan(steep) - steep)
            assert abs(polar) == pytest.approx(half, abs=1e-12)
    assert radius.max() <= pitch + module + 1e-12
    assert radius.min() == pytest.approx(pitch - 1.25 * module)


@pytest.mark.parametrize("model", ["gear-reducer", "planetary-gear-set"])
def test_gears_in_mesh_turn_without_cutting_into_each_other(model):
    found = planar.parts(model, scale=1.0, sheet=(9.0, 9.0))
    gears = [plate for plate in found.plates if plate.kind in ("wheel", "ring")]
    motion = planar.cycle(model, steps=50)
    for one, other in combinations(gears, 2):
        if one.layer != other.layer or one.module != pytest.approx(other.module):
            continue
        ring = next((each for each in (one, other) if each.kind == "ring"), None)
        for row in range(0, 51, 7):
            first, second = (
                drawn(each._replace(outline=each.inside[0] if each.kind == "ring" else each.outline), motion, row)
                for each in (one, other)
            )
            if ring is None:
                assert not meet(first, second)
            else:
                space, gear = (first, second) if ring is one else (second, first)
                assert Polygon(np.vstack([space, space[:1]])).contains_points(gear).all()


def test_gears_take_a_module_that_is_sold_where_radii_let_them():
    gears = [plate for plate in planar.parts("planetary-gear-set").plates if plate.teeth]
    assert [plate.module for plate in gears] == pytest.approx([2.0] * 3) and 2.0 in MODULES
    assert sorted(plate.teeth for plate in gears) == [20, 40, 80]


def test_layers_keep_a_pin_out_of_a_plate_between():
    """A pin from the frame to plate 2 that would meet plate 1: 2 lies below 1."""
    rules = LayerRules(3, frozenset({(1, 2)}), (), (), {"P": (0, 2)}, {"P": frozenset({1})}, frozenset())
    layers, broken = find_layers(rules)
    assert layers == [0, 2, 1] and broken == []
    both = rules._replace(pins={"P": (0, 2), "Q": (0, 1)}, obstacles={"P": frozenset({1}), "Q": frozenset({2})})
    layers, broken = find_layers(both)
    assert len(broken) == 1 == len(broken_rules(both, layers))


def test_sheets_hold_plates_apart_and_refuse_what_is_larger():
    bar = Plate("b", "b", "bar", rounded_hull([(0, 0), (90, 0)], 5.0), (), (), (), ((0.0, 0.0), (90.0, 0.0)), 5.0)
    sheets = nested([bar._replace(name=str(n)) for n in range(30)], (300.0, 100.0), 4.0)
    assert sum(map(len, sheets)) == 30
    for sheet in sheets:
        boxes = [np.array(sampled(plate.outline)) for plate in sheet]
        for points in boxes:
            assert (
                points.min() >= 4.0 - 1e-9 and points[:, 0].max() <= 296.0 + 1e-9 and points[:, 1].max() <= 96.0 + 1e-9
            )
        for one, other in combinations(boxes, 2):
            assert not meet(one, other)
    with pytest.raises(planar.BadInput, match="larger than the sheet"):
        nested([bar], (80.0, 80.0), 4.0)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["geneva-wheel"], "the geneva 'cross' cannot be cut as plates"),
        (["four-bar", "-o", "x.iges"], "files that end in .dxf, .svg or .step"),
        (["four-bar", "--sheet", "big"], "not of the form WxH"),
        (["four-bar", "--made-at", "5"], "no scale such as 1:5"),
        (["four-bar", "--made-at", "1:1", "--sheet", "50x50"], "do not fit the sheet"),
        (["four-bar", "--thickness", "-3mm"], "--thickness"),
    ],
)
def test_what_cannot_be_is_answered_in_a_sentence(words, told, tmp_path):
    assert told in run(tmp_path, "parts", *words).refused(2)


def test_the_command_lists_plates_and_pins_and_writes_them(tmp_path):
    shown = run(tmp_path, "parts", "klann-leg", "-o", "leg.dxf").done()
    assert "connecting rod" in shown and "every plate and pin is clear" in shown
    assert (tmp_path / "leg.dxf").stat().st_size > 5000
    value = json.loads(run(tmp_path, "parts", "klann-leg", "--pin", "4mm", "--json").done())
    assert {pin["diameter"] for pin in value["pins"]} == {0.004}
    assert value["clear"] is True
