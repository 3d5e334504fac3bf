"""Free bodies, torque over a cycle, bearing loads: read off the drawing with a ruler, laws and closed forms hold."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from math import pi, radians, sin

import numpy as np
import pytest

import planar
from planar.drawing.forces.bearing_loads import bearing_pictures
from planar.drawing.forces.free_bodies import free_bodies
from planar.drawing.forces.torque import torque_picture
from planar.drawing.labels.placement import place_labels
from planar.drawing.labels.text_metrics import text_size
from planar.drawing.output.matplotlib_figure import lay_out_picture
from planar.drawing.paper.pens import PEN_STYLES
from planar.drawing.paper.picture import Arrow, Circle, Label, Pen, Picture, Polyline
from planar.dynamics.flywheel import flywheel
from planar.dynamics.forces import forces
from planar.foundation.errors import BadInput
from planar.foundation.units import parse_unit
from planar.model.loads import Course, Load, Mass, Spring
from planar.model.mechanism import Drive, Mechanism
from tests.command import run
from tests.known import MODELS, state_of

GRAVITY = (0.0, -9.81)


def massed(stem: str, *loads: Load, springs: tuple[Spring, ...] = ()) -> Mechanism:
    """A model whose moving links have masses, with gravity."""
    model = MODELS[stem]
    masses = tuple(
        Mass(link.name, 0.5 + 0.3 * k, (0.02 * k, 0.01), 0.004)
        for k, link in enumerate(model.links, 1)
        if link.name != model.frame
    )
    return replace(model, masses=masses, gravity=GRAVITY, loads=loads, springs=springs)


CASES = {
    "toggle press": MODELS["000-P2"],
    "four-bar": massed("four-bar", Load(link="DC", torque=-3.0)),
    "engine": massed("slider-crank", Load(point="B", force=(-400.0, 60.0))),
    "leg": massed("jansen-leg"),
    "gears": replace(MODELS["planetary-gear-set"], loads=(Load(link="arm", torque=-40.0),)),
    "steering": massed("rack-steering", Load(link="left arm", torque=-100.0)),
    "excavator": massed("excavator-arm"),
    "springs": replace(
        MODELS["four-bar"],
        springs=(Spring(("A", "C"), stiffness=900.0, free=0.05), Spring(links=("AB", "BC"), stiffness=5.0, free=0.2)),
    ),
}
every_case = pytest.mark.parametrize("case", CASES)


@cache
def drawn(case: str) -> tuple[list[Picture], str]:
    return free_bodies(forces(planar.solve(CASES[case])))


def scales_of(title: str) -> tuple[float, float]:
    """Metres and newtons to a millimetre, read from the title as a reader would."""
    found = {}
    for value, written in re.findall(r"1 cm = (\S+) (\w+)", title):
        kind, *_ = parse_unit(written)
        found[kind] = parse_unit(written).to_si(float(value)) / 10.0
    return found["length"], found.get("force", 1.0)


def strokes(picture: Picture, start: str, kind: type = Arrow) -> list:
    return [mark for mark in picture.marks if isinstance(mark, kind) and mark.about.startswith(start)]


def vector(arrow: Arrow) -> np.ndarray:
    return np.subtract(arrow.head, arrow.tail)


def plain(number: str) -> float:
    return float(number.replace("−", "-"))


def said(picture: Picture, about: str) -> float:
    """The value that stands beside an arrow, in SI units."""
    (text,) = (mark.text for mark in picture.marks if isinstance(mark, Label) and mark.about == about)
    value, prefix = re.search(r" = (\S+) ([mkM]?)N", text).groups()
    return plain(value) * {"m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}[prefix]


@every_case
def test_the_forces_and_couples_drawn_on_a_link_balance_it(case):
    pictures, title = drawn(case)
    length, force = scales_of(title)
    for picture in pictures[1:]:
        total, moment, size, arm = np.zeros(2), 0.0, 0.0, 0.0
        for arrow in strokes(picture, "force "):
            pull, at = vector(arrow) * force, np.array(arrow.tail) * length
            total, size = total + pull, max(size, np.hypot(*pull))
            moment += at[0] * pull[1] - at[1] * pull[0]
            arm = max(arm, np.hypot(*at))
        couples = [circle.arrow_end * said(picture, circle.about) for circle in strokes(picture, "couple ", Circle)]
        # couples are read as they are printed, to four digits
        most = max([size * arm, *map(abs, couples)], default=0.0)
        assert np.hypot(*total) <= 1e-9 * size
        assert abs(moment + sum(couples)) <= 1e-9 * most + 6e-4 * sum(map(abs, couples)) + 1e-12


@every_case
def test_reactions_are_arrows_of_their_length_on_both_links(case):
    pictures, title = drawn(case)
    found = forces(planar.solve(CASES[case]))
    _, per_mm = scales_of(title)
    arrows = [
        vector(arrow) * per_mm
        for picture in pictures[1:]
        for arrow in strokes(picture, "force F")
        if arrow.pen is Pen.REACTION
    ]
    frame = CASES[case].frame
    most = max(np.hypot(*each.force) for each in found.reactions.values())
    wanted = [
        sense * each.force
        for each in found.reactions.values()
        for sense, link in zip((-1.0, 1.0), each.links, strict=True)
        if link != frame and np.hypot(*each.force) > 1e-9 * most
    ]
    assert len(arrows) == len(wanted)
    for each in wanted:
        assert min(np.hypot(*(each - arrow)) for arrow in arrows) <= 1e-9 * most


@every_case
def test_what_is_written_at_an_arrow_is_its_length_to_the_scale(case):
    pictures, title = drawn(case)
    _, per_mm = scales_of(title)
    for picture in pictures[1:]:
        texts = [mark.text for mark in picture.marks if isinstance(mark, Label) and mark.about.startswith("force ")]
        assert len(texts) == len(strokes(picture, "force "))
        for arrow in strokes(picture, "force "):
            assert said(picture, arrow.about) == pytest.approx(np.hypot(*vector(arrow)) * per_mm, rel=6e-4)


@every_case
def test_polygons_go_head_to_tail_once_round_with_the_forces_of_the_link(case):
    pictures, _ = drawn(case)
    polygons = 0
    for picture in pictures[1:]:
        sides = strokes(picture, "polygon ")
        if not sides:
            continue
        polygons += 1
        for side, after in zip(sides, [*sides[1:], sides[0]], strict=True):
            assert np.allclose(side.head, after.tail, atol=1e-9)
        of = {arrow.about.removeprefix("force "): vector(arrow) for arrow in strokes(picture, "force ")}
        assert {side.about.removeprefix("polygon ") for side in sides} == set(of)
        for side in sides:
            assert np.allclose(vector(side), of[side.about.removeprefix("polygon ")], atol=1e-9)
    assert polygons


@every_case
def test_letters_of_free_bodies_do_not_meet_and_nothing_is_clipped(case):
    for picture in drawn(case)[0]:
        found = lay_out_picture(picture)
        boxes = [each.box for each in found.labels]
        for k, one in enumerate(boxes):
            assert found.low[0] <= one.left < one.right <= found.high[0]
            assert found.low[1] <= one.bottom < one.top <= found.high[1]
            for other in boxes[:k]:
                assert min(one.right, other.right) <= max(one.left, other.left) or min(one.top, other.top) <= max(
                    one.bottom, other.bottom
                )


def test_a_link_with_two_forces_is_called_so_and_they_lie_on_one_line():
    mechanism = replace(MODELS["four-bar"], loads=(Load(link="DC", torque=-3.0),))
    pictures, _ = free_bodies(forces(planar.solve(mechanism)))
    (coupler,) = (each for each in pictures if "two-force member" in each.notes)
    assert coupler.title.endswith("BC")
    one, other = strokes(coupler, "force ")
    between = np.subtract(one.tail, other.tail)
    assert abs(np.cross(np.append(between, 0.0), np.append(vector(one), 0.0))[2]) < 1e-6
    assert np.hypot(*between) > 1.0
    assert all("two-force member" not in each.notes for each in pictures if "AB" in each.title or "DC" in each.title)


def test_inertia_is_dashed_and_there_only_where_links_are_accelerated():
    pens = {arrow.pen for picture in drawn("engine")[0] for arrow in strokes(picture, "force -ma")}
    assert pens == {Pen.INERTIA}
    assert PEN_STYLES[Pen.INERTIA].dashes
    assert not PEN_STYLES[Pen.REACTION].dashes
    held = forces(planar.solve(CASES["engine"]), inertia=False)
    assert not [arrow for picture in free_bodies(held)[0] for arrow in strokes(picture, "force -ma")]


def test_what_equilibrium_does_not_tell_is_named_and_not_drawn():
    mechanism = replace(MODELS["three-parallel-cranks"], loads=(Load(point="B", force=(50.0, -80.0)),))
    pictures, _ = free_bodies(forces(planar.solve(mechanism)))
    assert not [arrow for picture in pictures for arrow in strokes(picture, "force F")]
    assert not [arrow for picture in pictures for arrow in strokes(picture, "polygon ")]
    rod = next(each for each in pictures if each.title.endswith("rod"))
    assert "not determined: F₂₁, F₂₃ and F₂₄" in rod.notes
    assert any("held more than once" in note for note in rod.notes)


def test_a_given_scale_of_force_is_kept_and_others_are_refused():
    found = forces(planar.solve(CASES["toggle press"]))
    pictures, title = free_bodies(found, "1 cm = 250 N")
    assert "1 cm = 250 N" in title
    assert max(
        np.hypot(*vector(arrow)) for picture in pictures for arrow in strokes(picture, "force P")
    ) == pytest.approx(80.0)
    with pytest.raises(BadInput, match="scale of length and of force"):
        free_bodies(found, "1 cm = 1 m/s")
    with pytest.raises(BadInput, match="one position"):
        free_bodies(forces(planar.cycle(CASES["toggle press"], steps=8)))


def test_a_letter_with_a_side_stands_there_and_others_keep_off():
    number = Label("100", (0.0, 0.0), "number", 8.0, 0.5, side=(0, -1))
    free = Label("120", (0.0, 0.0), "free", 8.0, 0.5)
    found = {each.label.about: each.box for each in place_labels([free, number], [])}
    size = text_size("100", 8.0)
    assert np.allclose(found["number"], (-size.width / 2.0, -0.5 - size.height, size.width / 2.0, -0.5))
    assert (
        found["free"].bottom >= -0.5
        or found["free"].left >= size.width / 2.0
        or found["free"].right <= -size.width / 2.0
    )


def pendulum(torque: float = 0.0, course: Course | None = None) -> Mechanism:
    """A link of 2 kg, centred 0.2 m from its pin, turned at a steady 2 pi rad/s against a torque."""
    model = MODELS["single-link"]
    inputs = tuple(given._replace(acceleration=0.0) for given in model.inputs)
    loads = (Load(link="link", torque=-torque, varies=course),) if torque else ()
    return replace(model, inputs=inputs, masses=(Mass("link", 2.0, "P"),), gravity=GRAVITY, loads=loads)


def test_the_flywheel_of_a_weight_on_a_crank_is_that_of_its_rise_and_fall():
    # T = 7 + m g r cos a, whose integral swings by 2 m g r
    found = flywheel(forces(planar.cycle(pendulum(7.0), steps=90)), fluctuation=0.05)
    swing = 2.0 * 2.0 * 9.81 * 0.2
    assert found.mean == pytest.approx(7.0, rel=1e-12)
    assert found.energy == pytest.approx(swing, rel=1e-6)
    assert found.inertia == pytest.approx(swing / (0.05 * (2.0 * pi) ** 2), rel=1e-6)
    # the weight helps until it is lowest, where the link is fastest
    assert sin(found.fastest) == pytest.approx(-1.0, abs=1e-9)
    assert sin(found.slowest) == pytest.approx(1.0, abs=1e-9)


def test_the_flywheel_of_a_triangle_of_torque_is_its_area_above_the_mean():
    tent = Course("O", (0.0, pi, 2.0 * pi), (0.0, 1.0, 0.0))
    mechanism = replace(pendulum(100.0, tent), gravity=(0.0, 0.0))
    found = flywheel(forces(planar.cycle(mechanism, steps=720)))
    assert found.mean == pytest.approx(50.0, rel=1e-9)
    # base pi, height 50
    assert found.energy == pytest.approx(25.0 * pi, rel=1e-4)
    assert (found.slowest, found.fastest) == (pytest.approx(1.5 * pi, abs=1e-3), pytest.approx(0.5 * pi, abs=1e-3))


@pytest.mark.parametrize("stem", ["slider-crank", "scotch-yoke", "jansen-leg", "crank-rocker"])
def test_inertia_alone_asks_for_what_the_kinetic_energy_swings_by(stem):
    mechanism = replace(massed(stem), gravity=(0.0, 0.0))
    (given,) = mechanism.inputs
    mechanism = replace(mechanism, inputs=(given._replace(acceleration=0.0),))
    found = flywheel(forces(planar.cycle(mechanism, steps=360)))

    def energy(angle: float) -> float:
        state = planar.solve(mechanism, [Drive(given.pair, angle, given.velocity, 0.0)])
        total = 0.0
        for mass in mechanism.masses:
            centre = state.frames[mass.link].to_world(state.shapes[mass.link].position(mass.at))
            speed = np.hypot(*(part.parts[1] for part in centre))
            total += 0.5 * (mass.mass * speed**2 + mass.inertia * state.link(mass.link).angular_velocity ** 2)
        return float(total)

    # what the links have not, the flywheel has
    assert found.energy == pytest.approx(energy(found.slowest) - energy(found.fastest), rel=1e-6)
    assert found.energy >= max(abs(energy(k) - energy(0.0)) for k in range(1, 7))
    assert abs(found.mean) <= 1e-9 * found.energy


def test_a_flywheel_is_refused_without_a_whole_cycle_and_named_wrongly():
    rocking = forces(planar.cycle(MODELS["four-bar"], steps=24))
    with pytest.raises(BadInput, match="no whole cycle"):
        flywheel(rocking)
    whole = forces(planar.cycle(pendulum(), steps=24))
    with pytest.raises(BadInput, match="no input of this name"):
        flywheel(whole, "A")
    for wrong in (0.0, -0.1, 2.0, float("nan")):
        with pytest.raises(BadInput, match="between 0 and 2"):
            flywheel(whole, fluctuation=wrong)
    with pytest.raises(BadInput, match="over a motion"):
        flywheel(forces(planar.solve(pendulum())))


def test_a_flywheel_of_an_unsteady_speed_has_no_moment_of_inertia():
    mechanism = pendulum(7.0)
    hurrying = tuple(given._replace(acceleration=2.0) for given in mechanism.inputs)
    motion = planar.cycle(replace(mechanism, inputs=hurrying), steps=90)
    found = flywheel(
        forces(replace(motion, inputs={"O": motion.inputs["O"]._replace(velocity=np.linspace(5.0, 6.0, 91))}))
    )
    assert (found.speed, found.inertia) == (None, None)
    assert found.energy > 0.0


def axis_of(picture: Picture, name: str, index: int):
    """From mm to the values of an axis, read off its ticks and numbers."""
    ends = [mark.points[0][index] for mark in picture.marks if mark.about == f"tick {name}"]
    texts = [plain(mark.text) for mark in picture.marks if mark.about == f"number {name}"]
    slope, start = np.polyfit(ends, texts, 1)
    assert np.allclose(np.polyval([slope, start], ends), texts, atol=1e-6 * np.ptp(texts))
    return lambda at: slope * np.asarray(at) + start


def names_of(picture: Picture) -> list[str]:
    return [mark.about.removeprefix("axis ") for mark in picture.marks if mark.about.startswith("axis ")]


def curve_of(picture: Picture, about: str) -> np.ndarray:
    """A curve (n, 2) in the units of the axes."""
    up, across = names_of(picture)
    spots = np.concatenate(
        [mark.points for mark in picture.marks if isinstance(mark, Polyline) and mark.about == about]
    )
    return np.stack([axis_of(picture, across, 0)(spots[:, 0]), axis_of(picture, up, 1)(spots[:, 1])], axis=1)


def area(spots) -> float:
    x, y = np.array(spots).T
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))


def test_the_torque_curve_is_the_effort_at_each_position_its_mean_and_its_areas():
    picture = torque_picture(pendulum(7.0), fluctuation=0.05)
    curve = curve_of(picture, "effort")
    assert (curve[0, 0], curve[-1, 0]) == (pytest.approx(0.0, abs=1e-6), pytest.approx(360.0))
    assert np.allclose(curve[:, 1], 7.0 + 2.0 * 9.81 * 0.2 * np.cos(np.radians(curve[:, 0])), atol=1e-4)
    assert np.allclose(curve_of(picture, "mean")[:, 1], 7.0, atol=1e-6)
    (mean,) = strokes(picture, "mean", Polyline)
    mm = mean.points[1][0] - mean.points[0][0]
    up, _ = names_of(picture)
    joule = radians(360.0) / mm * (axis_of(picture, up, 1)(1.0) - axis_of(picture, up, 1)(0.0))
    sides = {
        side: joule * sum(area(mark.points) for mark in picture.marks if mark.about == side)
        for side in ("above", "below")
    }
    assert sides["above"] == pytest.approx(2.0 * 2.0 * 9.81 * 0.2, rel=1e-3)
    assert sides["below"] == pytest.approx(sides["above"], rel=1e-3)
    assert any("I = ΔE / (C ω²) = 3.976 kg·m²" in note for note in picture.notes)


def test_the_parts_of_a_torque_add_up_to_it():
    picture = torque_picture(CASES["engine"])
    whole = curve_of(picture, "effort")
    parts = [curve_of(picture, f"part {each}") for each in ("loads", "weights", "inertia")]
    assert all(np.ptp(part[:, 1]) > 0.1 for part in parts)
    assert np.allclose(sum(part[:, 1] for part in parts), whole[:, 1], atol=1e-6 * np.ptp(whole[:, 1]))


def test_the_greatest_and_the_least_are_marked_where_they_are():
    picture = torque_picture(pendulum(7.0))
    curve = curve_of(picture, "effort")
    _, across = names_of(picture)
    for told, index in (("greatest", curve[:, 1].argmax()), ("least", curve[:, 1].argmin())):
        (mark,) = strokes(picture, told, Circle)
        assert axis_of(picture, across, 0)(mark.centre[0]) == pytest.approx(curve[index, 0], abs=1e-6)
        (text,) = (each.text for each in picture.marks if isinstance(each, Label) and each.about == told)
        value, place = re.fullmatch(r"(\S+) N·m at (\S+) deg", text).groups()
        assert plain(value) == pytest.approx(curve[index, 1], rel=1e-3)
        assert plain(place) == pytest.approx(curve[index, 0], abs=0.1)


def test_without_a_whole_cycle_there_is_no_mean_and_it_is_said():
    picture = torque_picture(CASES["four-bar"])
    assert not [mark for mark in picture.marks if mark.about in ("mean", "above", "below")]
    assert any("no whole cycle" in note for note in picture.notes)
    # beside its dead points it is not to be held: the axis is for the rest
    assert np.abs(curve_of(picture, "effort")[:, 1]).max() < 50.0
    assert any(note.startswith("beyond the axis") for note in picture.notes)


def test_a_polar_diagram_has_the_reaction_at_every_mark():
    (picture,) = bearing_pictures(CASES["engine"], ["A"])
    x, y = axis_of(picture, "x (N)", 0), axis_of(picture, "y (N)", 1)
    marks = strokes(picture, "mark ", Circle)
    assert len(marks) == 12
    (given,) = CASES["engine"].inputs
    for mark in marks[::4]:
        at = radians(plain(mark.about.removeprefix("mark ")))
        state = planar.solve(CASES["engine"], [Drive("O", at, given.velocity, 0.0)])
        wanted = forces(state).reactions["A"].force
        assert (x(mark.centre[0]), y(mark.centre[1])) == (
            pytest.approx(wanted[0], abs=0.05),
            pytest.approx(wanted[1], abs=0.05),
        )
    curve = curve_of(picture, "load")
    (arrow,) = strokes(picture, "greatest")
    assert np.hypot(x(arrow.head[0]), y(arrow.head[1])) == pytest.approx(np.hypot(*curve.T).max(), rel=1e-6)
    # the same newtons to a millimetre both ways
    assert x(1.0) - x(0.0) == pytest.approx(y(1.0) - y(0.0), rel=1e-9)


def test_a_slide_has_the_force_across_its_line_and_the_couple():
    mechanism = massed("scotch-yoke", Load(point="yoke.Y", force=(0.0, -100.0)))
    force, couple = bearing_pictures(mechanism, ["stroke"])
    state = planar.solve(mechanism, [Drive("O", radians(60.0), mechanism.inputs[0].velocity, 0.0)])
    found = forces(state).reactions["stroke"]
    for picture, about, wanted in ((force, "load", found.force[1]), (couple, "couple", found.couple)):
        curve = curve_of(picture, about)
        assert np.interp(60.0, *curve.T) == pytest.approx(wanted, abs=2e-3 * np.abs(curve[:, 1]).max())


def test_a_pair_that_is_not_told_or_carries_nothing_has_no_curve_but_says_so():
    cranks = replace(MODELS["three-parallel-cranks"], loads=(Load(point="B", force=(50.0, -80.0)),))
    (picture,) = bearing_pictures(cranks, ["A"])
    assert picture.marks == ()
    assert "held more than once" in picture.notes[0]
    shaft = replace(MODELS["slider-crank"], loads=(Load(link="crank", torque=5.0),))
    (idle,) = bearing_pictures(shaft, ["A"])
    assert (idle.marks, idle.title, idle.notes) == ((), "No diagram: A", ("no force or couple is carried here",))


def test_pairs_that_carry_nothing_are_named_together_after_the_diagrams_of_the_others():
    lift = replace(MODELS["scissor-lift"], loads=(Load(point="L1", force=(0.0, -1000.0)),))
    *drawn, rest = bearing_pictures(lift)
    assert [each.title.partition(":")[0] for each in drawn] == ["O", "M1", "S"]
    assert all(each.marks for each in drawn)
    assert rest.title == "No diagram: L1, R1, M2, L2, R2, M3, L3, foot, top and R3"
    assert (rest.marks, rest.notes) == ((), ("no force or couple is carried here",))


def test_commands_draw_all_three_and_refuse_what_is_for_others(tmp_path):
    for what, more in (
        ("forces", ["--at", "O=80"]),
        ("torque", ["--fluctuation", "0.01"]),
        ("bearings", ["--pair", "A"]),
    ):
        file = tmp_path / f"{what}.pdf"
        run(tmp_path, "plot", "000-P2", what, "-o", str(file), *more).done()
        assert file.read_bytes().startswith(b"%PDF")
    for what, more, said_of in (
        ("forces", ["--fluctuation", "0.01"], "torque"),
        ("torque", ["--pair", "A"], "bearings"),
        ("bearings", ["--pair", "Z"], "there is no pair"),
        ("torque", ["--of", "Z"], "there is no input"),
        ("torque", ["--fluctuation", "3"], "between 0 and 2"),
    ):
        assert said_of in run(tmp_path, "plot", "000-P2", what, "-o", str(tmp_path / "x.pdf"), *more).refused(2)


@pytest.mark.parametrize("what", ["forces", "torque", "bearings"])
def test_without_anything_that_acts_there_is_no_empty_picture_but_a_sentence(tmp_path, what):
    picture = tmp_path / "x.png"
    told = run(tmp_path, "plot", "toggle-press", what, "-o", str(picture)).refused(2)
    assert told.startswith("$.loads: the mechanism has no loads, springs or masses; write forces (N) at points")
    assert not picture.exists()
    acting = state_of("four-bar") if what == "forces" else MODELS["four-bar"]
    with pytest.raises(BadInput, match="has no loads, springs or masses"):
        getattr(planar.plot, what)(acting)


def test_the_space_diagram_of_free_bodies_says_on_which_link_of_a_pin_a_load_acts():
    """The gas pushes the piston: its arrow is on the block, and the rod feels the gudgeon alone."""
    pictures, _ = free_bodies(forces(state_of("two-stroke-engine")))
    drawn = {picture.title: picture for picture in pictures}
    assert "the load at 'B' acts on link 'block B', not on 'rod'" in " ".join(drawn["Space diagram"].notes)
    pushed = {title for title, each in drawn.items() if strokes(each, "force P_B", Arrow)}
    assert pushed == {"3 block B"}


def test_many_links_go_on_sheets_no_larger_than_a_page_each_once():
    figures = planar.plot.forces(planar.solve(CASES["leg"]))
    assert len(figures) > 1
    assert len({float(figure.get_size_inches()[0]) for figure in figures}) == 1
    assert all(figure.get_size_inches()[0] * 25.4 <= 297.0 + 1e-6 for figure in figures)
    assert all(figure.get_size_inches()[1] * 25.4 <= 210.0 + 1e-6 for figure in figures)
    titles = [axes.get_label() for figure in figures for axes in figure.axes]
    assert titles == [picture.title for picture in drawn("leg")[0]]


def test_a_couple_on_a_link_stands_at_a_joint_of_it_wherever_its_axes_are():
    pictures, _ = drawn("gears")
    arm = next(each for each in pictures if each.title.endswith("arm"))
    (couple,) = strokes(arm, "couple ", Circle)
    pins = [mark.centre for mark in strokes(arm, "pin ", Circle)]
    assert min(np.hypot(*np.subtract(couple.centre, pin)) for pin in pins) < 1e-9


def test_a_linkage_that_moves_by_itself_asks_nothing_of_its_input_and_round_off_is_not_drawn():
    simulation = planar.simulate(CASES["four-bar"], 0.2, 40)
    picture = torque_picture(forces(simulation.motion))
    assert not np.any(curve_of(picture, "effort")[:, 1])
    assert "the same at every position" in picture.notes
    assert names_of(picture)[1] in ("A (deg)", "t (s)")
