"""Other programs' files are read: points go where circles and lines say, rates, units and masses are theirs."""

import json
from dataclasses import replace
from math import asin, pi

import pytest

import planar
from planar.formats.known_formats import file_formats
from planar.model.mechanism import Drive, Input
from planar.solving.position import rest_position
from tests.foreign_samples import (
    FOUR_BARS,
    LINKAGE_SIM,
    OLD_PLUS_SLIDER,
    PIXEL,
    SLIDER_CRANKS,
    asmt,
    base64,
    coupler_point,
    linkage2,
    pmksplus,
    pmksplus_cylinder,
    slider_place,
)
from tests.round_trips import read_back, read_document, read_text

ROUNDED = 1e-12
TURNS = (0.4, -1.1)


def points_after(mechanism, turn):
    given = mechanism.inputs[0]
    state = rest_position(mechanism, [Drive(given.pair, given.position + turn)])
    return [1000.0 * point.position for point in state.points.values()]


def nearest(points, place):
    return min(abs(x - place[0]) + abs(y - place[1]) for x, y in points)


@pytest.mark.parametrize("name", FOUR_BARS)
def test_a_four_bar_moves_as_circles_meet(name):
    mechanism = read_text(FOUR_BARS[name])
    for turn in TURNS:
        assert nearest(points_after(mechanism, turn), coupler_point(turn)) < 1e-9


@pytest.mark.parametrize("name", SLIDER_CRANKS)
def test_a_slider_crank_moves_as_a_circle_meets_a_line(name):
    mechanism = read_text(SLIDER_CRANKS[name])
    for turn in TURNS:
        assert nearest(points_after(mechanism, turn), slider_place(turn)) < 1e-9


def test_every_format_has_a_sample():
    assert set(FOUR_BARS) | {"linkage_sim"} == set(file_formats())


def test_rates_are_those_of_each_program():
    rates = {name: read_text(text).inputs[0].velocity for name, text in FOUR_BARS.items()}
    turn = 2.0 * pi  # once a second
    wanted = {"linkage2": turn, "pmks-file": turn, "motiongen": turn, "ondsel": turn, "pmks": 0.0, "pyslvs": 0.0}
    assert rates == pytest.approx(wanted | {"pylinkage": 0.1, "pmksplus": 20.0 * turn / 60.0})


def test_a_motion_by_a_sine_is_a_table_of_it():
    document = read_document(SLIDER_CRANKS["ondsel"])
    (piece,) = document["inputs"][0]["law"]
    assert piece["positions"][50] - piece["positions"][0] == pytest.approx(70.0)  # degrees, a quarter of a second on


def test_linkage_sim_gives_its_own_published_positions():
    """Of data/benchmarks/golden/slidercrank_kinematics.json: the crank at 15 degrees."""
    mechanism = read_text(json.dumps(LINKAGE_SIM))
    assert mechanism.inputs == ()
    state = planar.solve(replace(mechanism, inputs=(Input("J1", 0.2617993877991494, 1.0),), sketch=(("J3", 3.9, 0.0),)))
    assert state.point("J3").position[0] == pytest.approx(3.954740424401875, abs=ROUNDED)
    assert state.link("conrod").angle == pytest.approx(-0.08638039723801787, abs=ROUNDED)
    assert state.link("conrod").angular_velocity == pytest.approx(-0.32318024239408183, abs=1e-11)
    assert state.link("conrod").angle == pytest.approx(-asin(state.point("J2").position[1] / 3.0))


def test_bodies_fixed_to_one_another_are_one_link_with_both_masses():
    mechanism = read_text(json.dumps(LINKAGE_SIM))
    assert [link.name for link in mechanism.links] == ["ground", "crank", "conrod", "slider"]
    masses = {mass.link: mass for mass in mechanism.masses}
    assert masses["slider"].at == pytest.approx((0.0, -0.1))  # the cap's origin, turned by a right angle about its q
    assert masses["crank"].inertia == 0.01


def test_what_is_left_out_stands_in_the_notes():
    told = " ".join(read_document(FOUR_BARS["pylinkage"])["notes"])
    assert "0.1 rad in a step" in told and "taken as mm" in told
    assert "driver 'D1'" in " ".join(read_document(json.dumps(LINKAGE_SIM))["notes"])
    loose = linkage2('A 0 0 anchor="true" input="true"\nB 10 0\nX 50 50\nY 60 50', "A B\nX Y")
    assert "'L1' is joined to nothing" in " ".join(read_document(loose)["notes"])


def test_a_link_on_two_anchors_stands_still():
    assert [link.name for link in read_text(SLIDER_CRANKS["linkage2"]).links] == ["frame", "L0", "L1"]


def test_an_actuator_is_a_driven_slide():
    text = linkage2(
        'A 0 0 anchor="true"\nB 100 0\nC 130 -60 anchor="true"',
        f'A B actuator="true" throw="{20 / PIXEL}" cpm="15"\nB C',
    )
    mechanism = read_text(text)
    (given,) = mechanism.inputs
    assert given.position == pytest.approx(0.1) and given.velocity == pytest.approx(0.01)  # 20 mm, 30 times a minute
    longer = rest_position(mechanism, [Drive(given.pair, 0.11)]).points
    assert nearest([1000.0 * p.position for p in longer.values()], (0, 0)) == 0.0
    lengths = [float((point.position[0] ** 2 + point.position[1] ** 2) ** 0.5) for point in longer.values()]
    assert min(abs(each - 0.11) for each in lengths) < 1e-12


def test_gears_of_linkage_turn_by_their_sizes_and_chains_the_same_way():
    wheels = 'A 0 0 anchor="true" input="true"\nB 90 0 anchor="true"\nP 10 0\nQ 100 0'
    for kind, ratio in (("gears", -0.5), ("chain", 0.5)):
        more = f'<ratios><ratio type="{kind}"><link id="0" size="10"/><link id="1" size="20"/></ratio></ratios>'
        state = planar.solve(read_text(linkage2(wheels, 'A P gear="true"\nB Q gear="true"', more)))
        one, other = (state.link(name).angular_velocity for name in ("L0", "L1"))
        assert other / one == pytest.approx(ratio)


def test_gears_of_pmks_follow_from_where_they_touch():
    """A ring of 7, a sun of 5, a planet of 1 on an arm: Willis' formula."""
    text = "ground,sun,arm,R,0,0\narm,planet,R,6,0\nsun,planet,G,5,0\nplanet,gnd,G,7,0\nplanet,R,6,1\n"
    mechanism = read_text(text)
    given = mechanism.inputs[0]._replace(velocity=1.0)
    state = planar.solve(replace(mechanism, inputs=(given,)))
    arm, planet = (state.link(name).angular_velocity for name in ("arm", "planet"))
    assert arm == pytest.approx(5 / 12)
    assert planet - arm == pytest.approx(-5 * (1 - arm))


def test_a_rounded_upright_rail_of_pmksplus_is_upright():
    body = (
        SLIDER_CRANKS["pmksplus"].partition("?")[2][:-1].replace(f"5P,P,{base64(15)},0,0.", f"5P,P,{base64(15)},0,OZ.")
    )
    assert "OZ" in body  # 1.571 rad
    slot = next(pair for pair in read_document(pmksplus(body))["pairs"] if "line" in pair)
    assert slot["line"]["angle"] == 90.0


def test_coaxial_pins_of_pmks_are_one():
    text = "ground,arm,R,0,0\narm,gears,R,1,0\ngears,ground,G,44,0\ngears,output,G,46,0\nground,output,R,0,0\n"
    mechanism = read_text(text)
    assert len(mechanism.links) == 4
    state = planar.solve(replace(mechanism, inputs=(mechanism.inputs[0]._replace(velocity=1.0),)))
    assert state.link("output").angular_velocity == pytest.approx(1 - (44 / 43) * (45 / 46))


def test_the_compact_form_of_a_pyslvs_project_is_read_alike():
    joints = "M[J[R, P[0, 0], L[ground, a]], J[R, P[1, 0], L[a]]]"
    text = f"{{input: [[0, 1]], algorithm: [{{input: [[2, 1]]}}], mechanism: '{joints}'}}"
    assert read_document(text)["inputs"][0]["pair"] == "P0"


@pytest.mark.parametrize("radius", [0.03, -0.03])
def test_a_rack_of_ondsel_goes_as_far_as_its_pinion_turns(radius):
    """x + r a is constant, x of the pinion along the rack: the rack goes on by r a."""
    parts = {"": {"m1": (0, 0), "x2": (0, -30)}, "wheel": {"a": (0, 0), "b": (0, 20)}}
    text = asmt(
        parts | {"rack": {"x": (0, -30), "c": (0, 0)}},
        "RevoluteJoint A m1 wheel/a\nTranslationalJoint S x2 rack/x\nRackPinionJoint mesh rack/c wheel/a",
        "A 2.0d*pi*time",
    )
    text = text.replace("/Asm/rack/c\n", f"/Asm/rack/c\n\t\t\t\tpitchRadius\n\t\t\t\t\t{radius}\n", 1)
    mechanism = read_text(text)
    state = planar.solve(mechanism)
    assert state.residual < 1e-12 and state.mobility == 1
    assert state.link("wheel").angular_velocity == pytest.approx(2 * pi)
    assert state.point("S").velocity == pytest.approx([2 * pi * radius, 0.0], abs=1e-12)
    turned = planar.cycle(mechanism, steps=8)
    assert turned.point("S").position[-1, 0] - turned.point("S").position[0, 0] == pytest.approx(2 * pi * radius)


def test_flags_of_pmks_may_be_words_and_its_texts_of_the_page_of_windows(tmp_path):
    lines = ["ground, input,R,0,0", "input coupler,R,-2,0,0", "coupler rocker,R,5,6", "rocker ground,R,4,0"]
    words = read_document("\n".join([*lines, "coupler,R,7,7,False,False,false"]))
    assert (
        words["links"]["coupler"]["points"]
        == read_document("\n".join([*lines, "coupler,R,7,7"]))["links"]["coupler"]["points"]
    )
    told = read_document("\n".join(["rocker ground,R,4,0,0,true,false,false,true", *lines[:3]]))
    assert told["inputs"][0]["pair"] == "A"
    file = tmp_path / "link.txt"
    file.write_bytes(b"A walker:\xa0http://x.org/?mech=" + "|".join(lines).replace(" ", ",").encode("ascii"))
    assert len(planar.load(file).links) == 4


def test_joints_of_ondsel_that_no_plane_has_are_refused_by_their_kind():
    text = FOUR_BARS["ondsel"].replace("RevoluteJoint", "CurveCurveContact", 1).replace("/Asm/m1", "/Asm/curve", 1)
    with pytest.raises(planar.BadInput, match="joint A: a 'CurveCurveContact' as this stands is no pair"):
        read_text(text)


def test_a_link_of_pmksplus_until_2023_is_read():
    mechanism = planar.load(OLD_PLUS_SLIDER)
    assert [link.name for link in mechanism.links] == ["ground", "ab", "bc"]
    assert mechanism.inputs[0].velocity == pytest.approx(pi / 3)  # 10 rpm
    for turn in TURNS:
        assert nearest(points_after(mechanism, turn), slider_place(turn)) < 1e-9
    (load,) = mechanism.loads
    assert load.force == (0.0, 7.0) and load.axes is None
    turned = planar.load(OLD_PLUS_SLIDER.replace("&s=10,false", "&s=10,true"))
    assert turned.inputs[0].velocity == pytest.approx(-pi / 3)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("b,3,4", "b,3,x", "joint b: 'x' is no number"),
        ("a,0,0,ab,R,t", "a,0,0,ab,R,maybe", "joint a: 't' or 'f' is expected"),
        ("a%7Cb,,line", "a%7Cq,,line", "the link 'ab' names a joint 'q'"),
        ("F1,bc,9", "F1,zz,9", "the force 'F1' is on a link 'zz'"),
        ("a,0,0,ab,R,t,Null,t", "a,0", "no joint of PMKS"),
    ],
)
def test_a_broken_link_of_pmksplus_until_2023_is_refused_at_its_part(old, new, message):
    with pytest.raises(planar.BadInput, match=message):
        planar.load(OLD_PLUS_SLIDER.replace(old, new, 1))


def test_links_with_newer_signs_and_a_locked_part_are_read():
    code = FOUR_BARS["pmksplus"].partition("?")[2][:-1].replace("YRAB", "ARAB").replace("YRCD", "3RCD")
    assert len(read_text(pmksplus(f"{code}.JA,KJB~red")).links) == 4


def test_the_speed_of_a_driven_slide_of_pmksplus_is_not_that_of_a_pin():
    text = pmksplus_cylinder(0.7, 4.0, 2.0, 4.0)
    without = text.replace(f",{base64(3.0)}.", ".")
    assert read_text(pmksplus(without.partition("?")[2][:-1])).inputs[0].velocity == pytest.approx(0.05)


MASS = "\n{0}PrincipalMassMarker\n{0}\tName\n{0}\t\tm{1}\n{0}\tMass\n{0}\t\t{2}\n{0}\tMomentOfInertias\n{0}\t\t{3}"


def with_masses(text, mass, inertia):
    """An assembly whose parts have these masses and moments of inertia."""
    place = "\n{0}Position3D\n{0}\t0 0 0\n{0}RotationMatrix\n{0}\t1 0 0\n{0}\t0 1 0\n{0}\t0 0 1".format("\t" * 4)
    return text.replace("\n\t\t\tRefPoints", MASS.format("\t" * 3, place, mass, inertia) + "\n\t\t\tRefPoints")


def test_an_assembly_of_freecad_is_in_millimetres_and_its_placeholders_are_no_masses():
    freecad = with_masses(FOUR_BARS["ondsel"], "1", "1 1 1")
    document = read_document(freecad)
    assert document["units"]["length"] == "mm" and "masses" not in document
    told = " ".join(document["notes"])
    assert "0.09 mm high and 0.1 mm wide" in told and "placeholders; no mass is read" in told
    weighed = read_document(with_masses(FOUR_BARS["ondsel"], "2", "1 1 1"))
    assert weighed["units"]["length"] == "m" and len(weighed["masses"]) == 4
    example = freecad.replace("OndselSolver", "freeCAD: 3D CAD", 1)
    assert read_document(example)["units"]["length"] == "m"


def test_a_unit_of_length_may_be_given_where_a_file_names_none(tmp_path):
    for name, ending in (("ondsel", "asmt"), ("pmks", "txt"), ("pyslvs", "pyslvs"), ("pylinkage", "json")):
        path = tmp_path / f"a.{ending}"
        path.write_text(FOUR_BARS[name])
        found = planar.convert(path, length_unit="in")
        assert any("its numbers are taken as in" in note for note in found.notes)
        assert found.mechanism.units.length == "in"
    path = tmp_path / "a.linkage2"
    path.write_text(FOUR_BARS["linkage2"])
    with pytest.raises(planar.BadInput, match="names its unit of length"):
        planar.convert(path, length_unit="in")
    with pytest.raises(planar.BadInput, match="length unit"):
        planar.convert(tmp_path / "a.txt", length_unit="kg")


def rotated(text, rows):
    """An assembly turned in space as a whole, gravity included."""
    turned = "\n".join(f"\t\t{row}" for row in rows)
    head, _, tail = text.partition("\n\tRotationMatrix\n\t\t1 0 0\n\t\t0 1 0\n\t\t0 0 1")
    gravity = " ".join(str(-9.81 * float(row.split()[1])) for row in rows)
    return f"{head}\n\tRotationMatrix\n{turned}{tail}".replace("0.0 -9.81 0.0", gravity)


@pytest.mark.parametrize(
    "rows",
    [
        ("1 0 0", "0 1 0", "0 0 1"),  # seen from above
        ("1 0 0", "0 0 -1", "0 1 0"),  # from the front, y of the drawing along z
        ("0 0 1", "1 0 0", "0 1 0"),  # from the right
        ("0 0 -1", "0 1 0", "1 0 0"),  # in the plane of y and z, y upwards
    ],
)
def test_gravity_of_an_assembly_points_downwards_in_every_view(rows):
    mechanism = read_text(rotated(FOUR_BARS["ondsel"], rows))
    assert mechanism.gravity == pytest.approx((0.0, -9.81))
    state = planar.solve(mechanism)
    heights = sorted(1000.0 * point.position[1] for point in state.points.values())
    assert (heights[0], heights[-1]) == (pytest.approx(0.0), pytest.approx(90.0))


def open_bar(gap: float, size: float, tolerance: str = "") -> str:
    """An assembly of one bar of a length (m) whose pin is open by a gap (m), with the solver's tolerance if any."""
    text = asmt(
        {"": {"m1": (0, 0)}, "bar": {"a": (0, 0), "b": (size * 1000, 0)}}, "RevoluteJoint A m1 bar/a", "A 1.0*time"
    )
    parameters = (
        f"\n\tSimulationParameters\n\t\terrorTol\n\t\t\t{tolerance}\nTimeSeries" if tolerance else "\nTimeSeries"
    )
    moved = text.replace("\n\t\t\tPosition3D\n\t\t\t\t0.0 0.0 0.0", f"\n\t\t\tPosition3D\n\t\t\t\t{gap} 0.0 0.0", 1)
    return moved.replace("\nTimeSeries", parameters)


@pytest.mark.parametrize(
    ("gap", "size", "tolerance"),
    [(0.63e-6, 0.3, ""), (0.63e-6, 0.021, "1.0e-6"), (0.9e-6, 0.1, ""), (9e-6, 10.0, ""), (4e-6, 0.3, "5.0e-6")],
)
def test_an_assembly_that_its_solver_left_open_is_closed_with_a_note(gap, size, tolerance):
    text = open_bar(gap, size, tolerance)
    assert "is open by" in " ".join(read_document(text)["notes"])
    assert planar.solve(read_text(text)).residual < 1e-12


@pytest.mark.parametrize(
    ("gap", "size", "tolerance"),
    [(2e-6, 0.3, ""), (0.63e-6, 0.01, ""), (0.63e-6, 0.3, "1.0e-7"), (2e-5, 0.3, "1.0"), (1e-9, 0.3, "-1.0")],
)
def test_an_assembly_open_by_more_than_its_solver_leaves_is_refused(gap, size, tolerance):
    with pytest.raises(planar.BadInput, match="apart; save the assembly closed"):
        read_document(open_bar(gap, size, tolerance))


def test_names_of_links_that_are_numbers_stay_so_in_texts_of_pmks():
    text = "ground,6,R,0,0,0,tfft\n6,3,R,30,40\n3,5,R,90,70\n5,ground,R,100,0\n"
    mechanism = read_text(text)
    assert [link.name for link in mechanism.links] == ["ground", "6", "3", "5"]
    assert [link.name for link in read_back(mechanism, "pmks").links] == ["ground", "6", "3", "5"]
