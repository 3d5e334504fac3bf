"""Pages in a real browser, taken hold of by mouse, keys and fields: every number beside Python's."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace
from html import escape
from itertools import product
from xml.etree import ElementTree

import numpy as np
import pytest

import planar
from planar.analysis.polygons.construction import acceleration_polygon, velocity_polygon
from planar.document.dimensions import change_dimension, link_lengths
from planar.drawing.polygons.polygon import polygon_picture
from planar.pages import gallery, notebook
from planar.pages.gallery_kinds import KINDS, kind_and_search_text
from planar.pages.page import page
from planar.pages.still_picture import still_svg
from planar.pages.view import view
from tests.builders import triangle
from tests.draws import covering
from tests.hostile import harmful_mechanism
from tests.known import MODELS, kinds_of_model
from tests.page_scripts import CLOSE, FAINT, MISNAMED, NAMELESS, PLACES, SCREENS, downloaded, opened, same, settled

STEMS = ("crank-rocker", "slider-crank", "scotch-yoke", "watt-six-bar", "whitworth", "planetary-gear-set", "open-arm")
"""Of the gallery."""


# motion


def test_the_crank_is_dragged_to_ten_angles(shown):
    mechanism = MODELS["crank-rocker"]
    (given,) = mechanism.inputs
    window = shown(mechanism)
    start = window.evaluate("page.input(0)")
    # the end of the crank: the point that moves as the input does, and is not its pin
    tip = window.evaluate(
        """(pin) => {
          const [link] = page.data.points[pin].links.filter((each) => each !== page.data.frame);
          return page.data.names.find((name) => name !== pin && page.data.points[name].links.includes(link));
        }""",
        given.pair,
    )
    box = window.locator("#drawing").bounding_box()

    def screen(name):
        x, y = window.evaluate("(name) => page.view.toScreen(page.point(name).position)", name)
        return np.array([box["x"] + x, box["y"] + y])

    centre, at = screen(given.pair), screen(tip)
    window.mouse.move(*at)
    window.mouse.down()
    radius, first = np.hypot(*(at - centre)), np.arctan2(-(at - centre)[1], (at - centre)[0])
    for k in range(1, 11):
        turned = k * 0.5
        for part in np.linspace(turned - 0.5, turned, 5)[1:]:
            angle = first + part
            window.mouse.move(*(centre + radius * np.array([np.cos(angle), -np.sin(angle)])))
        settled(window)
        found = window.evaluate("page.input(0)")
        assert found == pytest.approx(start + turned, abs=0.02)
        same(window, planar.solve(mechanism, {given.pair: found}))
    window.mouse.up()


def test_the_input_is_moved_by_keys_and_by_its_number(shown):
    mechanism = MODELS["crank-rocker"]
    (given,) = mechanism.inputs
    window = shown(mechanism)
    start = window.evaluate("page.input(0)")
    slider = window.get_by_role("slider", name=given.pair, exact=True)
    slider.focus()
    window.keyboard.press("ArrowRight")
    settled(window)
    assert window.evaluate("page.input(0)") == pytest.approx(start + np.radians(1.0))
    window.keyboard.press("Home")
    settled(window)
    assert window.evaluate("page.input(0)") == pytest.approx(start, abs=CLOSE)
    field = window.get_by_label(f"{given.pair} ({mechanism.units.angle})")
    field.fill("100")
    field.press("Enter")
    settled(window)
    assert window.evaluate("page.input(0)") == pytest.approx(np.radians(100.0), abs=CLOSE)
    same(window, planar.solve(mechanism, {given.pair: np.radians(100.0)}))


def test_the_numbers_are_headed_by_the_inputs_position_and_both_its_rates(shown):
    window = shown(MODELS["002-E3.1"])
    heads = window.locator("#numbers caption").all_inner_texts()
    assert heads == ["Points at A = 60 deg, ω = 10.5 rad/s, α = −26 rad/s²"]
    window = shown(MODELS["excavator-arm"])
    (head,) = window.locator("#numbers caption").all_inner_texts()
    for given in MODELS["excavator-arm"].inputs:
        if given.velocity or given.acceleration:
            assert f"v = {given.velocity:g} m/s, a = {given.acceleration:g} m/s²" in head.replace("\u2212", "-")


def test_it_plays_and_stops(shown):
    window = shown(MODELS["slider-crank"])
    start = window.evaluate("page.input(0)")
    window.get_by_role("button", name="Play").click()
    window.wait_for_function("([start]) => Math.abs(page.input(0) - start) > 0.05", arg=[start])
    window.get_by_role("button", name="Pause").click()
    settled(window)
    stood = window.evaluate("page.input(0)")
    settled(window)
    assert window.evaluate("page.input(0)") == stood


def test_a_structure_is_drawn_and_offers_no_motion(shown):
    value = planar.to_dict(triangle(50)) | {"sketch": {"C": [25, 70]}}
    at = np.degrees(np.arccos((70**2 + 50**2 - 80**2) / (2 * 70 * 50)))
    window = shown(planar.from_dict(value | {"inputs": [{"pair": "A", "position": f"{float(at)!r} deg"}]}))
    assert "nothing moves: it is a structure" in window.locator("header").inner_text()
    assert window.locator("#drawing .drives polyline, #drawing .drives path").count() == 0
    play = window.locator("#controls").get_by_role("button", name="Play")
    assert play.is_disabled()
    colour = "(button) => getComputedStyle(button).backgroundColor"
    assert play.evaluate(colour) == window.get_by_role("button", name="Undo").evaluate(colour)
    assert window.evaluate("drawing.spans[0].names") == ["fixed at", "fixed at"]
    assert window.get_by_label("A", exact=True).is_disabled()
    assert "Take hold" not in window.locator("#controls").inner_text()


def test_a_dead_point_stops_it_and_is_told(shown):
    mechanism = MODELS["000-P1"]
    (given,) = mechanism.inputs
    window = shown(mechanism)
    *_, dead = planar.cycle(mechanism, 12).inputs[given.pair].position
    field = window.get_by_label(f"{given.pair} ({mechanism.units.angle})")
    field.fill(str(np.degrees(dead) + 30.0))
    field.press("Enter")
    settled(window)
    assert window.evaluate("page.input(0)") == pytest.approx(dead, abs=1e-5)
    assert "dead point" in window.locator("#said").inner_text().lower()


# layers


@pytest.mark.parametrize(
    "stem", covering(["watt-six-bar", "000-P2", "planetary-gear-set", "walschaerts-valve-gear"], kinds_of_model)
)
def test_every_layer_is_shown_without_a_problem(stem, shown):
    window = shown(MODELS[stem])
    boxes = window.locator("#layers").get_by_role("checkbox")
    assert boxes.count() >= 4
    for k in range(boxes.count()):
        assert boxes.nth(k).evaluate("(each) => each.labels.length > 0 || each.hasAttribute('aria-label')")
        boxes.nth(k).check()
        settled(window)
    window.evaluate("page.moveTo(page.input(0) + 0.1)")
    settled(window)
    assert "NaN" not in window.locator("#drawing").evaluate("(each) => each.outerHTML")


# dimensions


def test_a_length_is_changed_by_its_number_and_reset(shown):
    mechanism = MODELS["watt-six-bar"]
    window = shown(mechanism)
    each = next(
        d
        for d in link_lengths(mechanism, frozenset(link.name for link in mechanism.links))
        if d.name.endswith(".length")
    )
    length = planar.foundation.units.parse_unit(mechanism.units.length)
    wanted = float(f"{length.from_si(1.05 * each.value):.4g}")
    field = window.get_by_label(f"{each.link}: length, number, {mechanism.units.length}")
    field.fill(str(wanted))
    field.press("Enter")
    settled(window)
    assert window.evaluate(
        "page.data.dimensions.findIndex((one, k) => page.linkage.d[k] !== one.value)"
    ) == window.evaluate("(name) => page.data.dimensions.findIndex((one) => one.name === name)", each.name)
    places = dict(zip(window.evaluate("page.data.names"), window.evaluate(PLACES), strict=True))
    other = change_dimension(mechanism, each, length.to_si(wanted))
    same(window, planar.solve(replace(other, sketch=tuple((name, *at[0]) for name, at in places.items()))))
    slider = window.get_by_role("slider", name=f"{each.link}: length, {mechanism.units.length}")
    assert slider.get_attribute("aria-valuetext") == f"{wanted:.6g} {mechanism.units.length}"
    window.get_by_role("button", name="Reset all dimensions").click()
    settled(window)
    same(window, planar.solve(mechanism))
    assert window.get_by_role("button", name="Reset all dimensions").is_disabled()


def test_a_slider_gives_round_numbers_and_is_moved_by_keys(shown):
    mechanism = MODELS["four-bar"]
    window = shown(mechanism)
    slider = window.locator("#dimensions input[type=range]:enabled").locator("visible=true").first
    slider.focus()
    before = window.evaluate("Array.from(page.linkage.d)")
    window.keyboard.press("ArrowRight")
    settled(window)
    (k,) = np.flatnonzero(np.subtract(window.evaluate("Array.from(page.linkage.d)"), before))
    now = planar.foundation.units.parse_unit(mechanism.units.length).from_si(
        window.evaluate("(k) => page.linkage.d[k]", int(k))
    )
    assert float(f"{now:.4g}") == pytest.approx(now, rel=1e-12)


def test_what_does_not_go_together_is_told_with_how_far_it_goes(shown):
    window = shown(triangle(100))
    field = window.get_by_label("base: length, number, mm")
    field.fill("190")
    field.press("Enter")
    settled(window)
    note = window.locator("#dimensions .note", has_text="goes together")
    assert note.inner_text() == "It goes together up to base: length = 150 mm; asked for 190 mm."
    assert float(field.input_value()) == pytest.approx(150.0, rel=1e-5)
    field.fill("-3")
    field.press("Enter")
    settled(window)
    assert window.locator("#dimensions .note", has_text="cannot be").inner_text() == "base: length cannot be -3 mm."


def test_a_length_moved_to_and_fro_while_it_plays_leaves_it_on_its_branch_with_pythons_numbers(shown, tmp_path):
    window = shown(MODELS["crank-rocker"])
    window.evaluate(
        """async () => {
          const next = () => new Promise((go) => requestAnimationFrame(go));
          const k = page.data.dimensions.findIndex((each) => each.name.endsWith(".length"));
          const slider = document.getElementById(`dimension-${k}`), own = Number(slider.value);
          controls.speed = 4;
          controls.play();
          for (let i = 0; i < 40; i++) {
            // the crank stays one that turns round: beyond, play would lead through dead points to other assemblies
            slider.value = own * (0.5 + 0.06 * ((7 * i) % 11));
            slider.dispatchEvent(new Event("input"));
            await next();
          }
          controls.pause();
        }"""
    )
    settled(window)
    path = tmp_path / "saved.json"
    downloaded(window, "Save: Mechanism (JSON)", path)
    saved = planar.load(path)
    assert saved.links != MODELS["crank-rocker"].links
    same(window, planar.solve(saved))
    window.get_by_role("button", name="Reset all dimensions").click()
    window.get_by_role("button", name="Start").click()
    settled(window)
    same(window, planar.solve(MODELS["crank-rocker"]))


def test_all_dimensions_are_reset_also_where_the_input_is_beyond_the_files_range(shown):
    mechanism = MODELS["000-P1"]
    window = shown(mechanism)
    far = window.evaluate(
        """async () => {
          while (!page.course) await new Promise((go) => setTimeout(go, 10));
          const own = Array.from(page.linkage.d), [low, high] = page.course.limits;
          for (let k = 0; k < own.length; k++) {
            page.changeTo(own.map((each, i) => (i === k ? 1.1 * each : each)));
            for (const to of [low - 0.05, high + 0.05]) if (page.moveTo(to)) return to;
            page.take(page.data.z);
          }
        }"""
    )
    assert window.evaluate("page.input(0)") == far
    window.get_by_role("button", name="Reset all dimensions").click()
    settled(window)
    assert "do not go together" in window.locator("#said").inner_text()
    same(window, planar.solve(mechanism))


# assemblies


def test_every_assembly_can_be_chosen(shown):
    mechanism = MODELS["000-P2"]
    window = shown(mechanism)
    modes = list(planar.modes(mechanism, certify=False))
    choice = window.get_by_label("Assembly, of 4")
    assert choice.input_value() == str(planar.modes(mechanism, certify=False).nearest.number - 1)
    window.evaluate("page.moveTo(page.input(0) + 0.2)")
    for mode in reversed(modes):
        choice.select_option(index=mode.number - 1)
        settled(window)
        found = np.array([places[0] for places in window.evaluate(PLACES)])
        wanted = np.array([mode.points[name] for name in window.evaluate("page.data.names")])
        assert np.abs(found - wanted).max() <= CLOSE * np.abs(wanted).max()
        assert choice.input_value() == str(mode.number - 1)
        assert window.locator("#said").inner_text().startswith(f"Assembly {mode.number} of 4")


def test_circuit_and_branch_of_an_assembly_are_told_where_they_are_known_soon(shown):
    mechanism = MODELS["crank-rocker"]
    circuits = planar.circuits(mechanism)
    options = shown(mechanism).get_by_label("Assembly, of 2").locator("option").all_inner_texts()
    for mode, option in zip(planar.modes(mechanism, certify=False), options, strict=True):
        circuit, branch = circuits.of(mode)
        told = f"circuit {circuit.number} of {len(circuits)}, branch {branch.number} of {len(circuit.branches)}"
        assert option == f"{mode.number}: {told}"


# texts


def test_texts_of_a_file_are_shown_and_never_run(shown, chromium, tmp_path):
    mechanism = harmful_mechanism()
    window = shown(mechanism)
    for box in window.locator("#layers").get_by_role("checkbox").all():
        box.check()
    for button in ("Play", "Pause", "Save: Mechanism (JSON)", "Save: Motion (CSV)"):
        window.get_by_role("button", name=button).click()
    settled(window)
    assert window.evaluate("typeof window.hacked") == "undefined"
    assert window.locator("h1").inner_text().split() == mechanism.name.split()
    assert window.locator("img").count() == 0
    index, _ = gallery.write_gallery([("a", mechanism)], tmp_path / "folder")
    context = chromium.new_context()
    window, wrong = opened(context, index)
    window.locator("#gallery svg polyline").first.wait_for(state="attached")
    assert window.evaluate("typeof window.hacked") == "undefined"
    assert window.locator("#gallery strong").inner_text().split() == mechanism.name.split()
    window.locator("#gallery a").click()
    assert window.locator("#drawing").count() == 1
    assert wrong == []
    context.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A gallery of some models of every kind."""
    return gallery.write_gallery([(stem, MODELS[stem]) for stem in STEMS], tmp_path_factory.mktemp("gallery"))[0]


FOUND = {
    "4-bar": {"Crank-rocker", "Watt six-bar"},
    "FOURBAR chains": {"Crank-rocker", "Watt six-bar"},
    "quadric": {"Crank-rocker", "Watt six-bar"},
    "in-line crank slider": {"Slider-crank"},
    "watt": {"Watt six-bar", "Whitworth quick return"},
    "Watt II 6-bar": {"Watt six-bar", "Whitworth quick return"},
    "quickest way": set(),
    "shaper": {"Whitworth quick return"},
    "quick-returns": {"Whitworth quick return"},
    "epicyclic": {"Planetary gear set"},
    "sine mechanism": {"Scotch yoke"},
    "open chain": {"Open arm"},
}
"""What readers look for, and what of the gallery is that."""


def test_the_gallery_finds_by_any_of_the_usual_words(chromium, folder):
    context = chromium.new_context()
    window, wrong = opened(context, folder)
    for words, found in FOUND.items():
        window.get_by_label("Find").fill(words)
        assert set(window.locator("#gallery li:visible strong").all_inner_texts()) == found, words
        kinds = {kind_and_search_text(MODELS[stem], stem)[0] for stem in STEMS if MODELS[stem].name in found}
        assert set(window.locator("#gallery h2:visible").all_inner_texts()) == kinds
        assert (window.locator("#none").inner_text() == "") == bool(found)
    assert wrong == []
    context.close()


def test_from_a_page_of_a_gallery_a_link_leads_back_to_what_was_looked_for(chromium, folder):
    context = chromium.new_context()
    window, wrong = opened(context, folder)
    assert window.locator("#gallery h2").all_inner_texts() == [
        each for each in KINDS if each[:5] not in ("Linka", "Other")
    ]
    window.get_by_label("Find").fill("4-bar swings")
    window.locator("#gallery a:visible").click()
    window.get_by_role("link", name="All mechanisms").click()
    assert window.locator("#gallery li:visible").count() == 7
    window.go_back()
    window.go_back()
    assert window.locator("#gallery li:visible strong").all_inner_texts() == ["Crank-rocker"]
    assert wrong == []
    context.close()


# what is saved


def test_the_changed_mechanism_is_saved_and_read_back(shown, tmp_path):
    mechanism = MODELS["watt-six-bar"]
    window = shown(mechanism)
    window.evaluate("page.changeTo(page.linkage.d.map((each) => each * 1.01)); page.moveTo(page.input(0) + 0.1)")
    path = tmp_path / "saved.json"
    downloaded(window, "Save: Mechanism (JSON)", path)
    same(window, planar.solve(planar.load(path)))


def test_the_picture_is_saved_by_itself(shown, tmp_path):
    window = shown(MODELS["slider-crank"], scheme="dark")
    text = downloaded(window, "Save: Picture (SVG)", tmp_path / "picture.svg")
    root = ElementTree.fromstring(text)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert "var(" not in text
    assert "href" not in text
    assert "paint-order" not in text
    plain = {each.text for each in root.iter() if each.tag.endswith("text") and each.get("stroke", "none") == "none"}
    assert plain >= set(planar.solve(MODELS["slider-crank"]).point_names)  # no letter is hidden by its own outline
    strokes = [each.get("stroke") for each in root.iter() if each.tag.endswith(("polyline", "circle", "line"))]
    assert any(stroke not in (None, "none") for stroke in strokes)


def test_the_motion_is_saved_as_a_table(shown, tmp_path):
    mechanism = MODELS["slider-crank"]
    window = shown(mechanism)
    heads, *rows = csv.reader(io.StringIO(downloaded(window, "Save: Motion (CSV)", tmp_path / "motion.csv")))
    motion = planar.cycle(mechanism, len(rows) - 1, *(np.radians(float(rows[k][0])) for k in (0, -1)))
    column = heads.index(f"B x [{mechanism.units.length}]")
    found = np.array([float(row[column]) for row in rows])
    assert found == pytest.approx(
        planar.foundation.units.parse_unit(mechanism.units.length).from_si(motion.point("B").position[:, 0]), rel=1e-9
    )


# how it looks


def test_a_drawing_leaves_room_for_all_that_a_slide_with_two_ends_can_do(shown):
    """The foot of a scissor lift goes as far as its bars are long, both ways, and so does the platform's other end."""
    window = shown(MODELS["scissor-lift"])
    span = window.evaluate("motions(page).spans[0]")
    assert [span["low"], span["high"], span["dead"]] == [
        pytest.approx(-0.6, rel=1e-3),
        pytest.approx(0.6, rel=1e-3),
        [True] * 2,
    ]
    places = window.evaluate(
        "motions(page).poses.map((frames) => page.view.toScreen(Plane.carry(frames['platform'], [0, 0])))"
    )
    box = window.locator("#drawing").bounding_box()
    assert all(0.0 <= x <= box["width"] and 0.0 <= y <= box["height"] for x, y in places)


@pytest.mark.parametrize(
    ("stem", "screens"), covering(product(["000-P2", "excavator-arm"], [("phone",), ("desk", "projector")]), frozenset)
)
def test_nothing_is_wider_than_the_screen(stem, screens, shown):
    window = shown(MODELS[stem], screens[0])
    for box in window.locator("#layers").get_by_role("checkbox").all():
        box.check()
    for screen, scheme in product(screens, ("light", "dark")):
        width, height = SCREENS[screen]
        window.set_viewport_size({"width": width, "height": height})
        window.emulate_media(color_scheme=scheme)
        settled(window)
        assert window.evaluate("[innerWidth, innerHeight]") == [width, height]
        assert window.evaluate("document.documentElement.scrollWidth") <= width
        dark = window.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (sum(json.loads(f"[{dark[4:-1]}]")) < 380) == (scheme == "dark")


def test_texts_stand_out_from_their_paper(shown):
    """WCAG 2, 1.4.3: a contrast of 4.5 to 1, but for what cannot be used now."""
    window = shown(MODELS["excavator-arm"])
    window.evaluate("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    for box in window.locator("#layers").get_by_role("checkbox").all():
        box.check()
    for scheme in ("light", "dark"):
        window.emulate_media(color_scheme=scheme)
        settled(window)
        faint = window.evaluate(FAINT)
        assert faint["count"] > 100
        assert faint["least"] == [], scheme


def test_long_names_stay_in_the_picture_and_letters_stand_above_the_layers(shown):
    value = planar.to_dict(MODELS["crank-rocker"])
    text = json.dumps(value)
    for name in {pair["turning"] for pair in value["pairs"]}:
        text = text.replace(json.dumps(name), json.dumps(name + 9 * " of a very long name"))
    window = shown(planar.from_dict(json.loads(text)))
    box = window.locator("#drawing").bounding_box()
    for letter in window.locator("#drawing .letters text").all():
        each = letter.bounding_box()
        assert box["x"] <= each["x"]
        assert each["x"] + each["width"] <= box["x"] + box["width"]
    assert window.evaluate(
        "document.querySelector('.layers').compareDocumentPosition(document.querySelector('.letters'))"
        "& Node.DOCUMENT_POSITION_FOLLOWING"
    )


def test_every_control_has_a_name(shown):
    window = shown(MODELS["000-P2"])
    assert window.evaluate(NAMELESS) == []
    assert window.evaluate(MISNAMED) == []


# diagrams


def test_what_rounding_leaves_of_a_rate_is_told_as_none_below_a_diagram(shown):
    """The piston of a slider-crank moves along x alone."""
    window = shown(MODELS["two-stroke-engine"])
    window.wait_for_function("() => page.course !== null")
    window.evaluate("for (const each of document.querySelectorAll('[name^=diagram]')) if (!each.checked) each.click();")
    settled(window)
    for what, unit in (("velocity", "m/s"), ("acceleration", "m/s²")):
        figure = window.locator(f"figure[aria-label^='{what} along y']")
        assert f"B 0 {unit}" in " ".join(figure.locator("figcaption").inner_text().split())


def test_a_diagram_holds_the_whole_course_and_the_values_of_now_also_beside_a_dead_point(shown):
    """Where the input is 1e-9 rad from its limit, rates are greater than in any row of the course."""
    window = shown(MODELS["000-P1"])
    window.wait_for_function("() => page.course !== null")
    window.evaluate(
        "page.chosen.toggle('link', 'DC'); for (const each of document.querySelectorAll('[name^=diagram]'))"
        " if (!each.checked) each.click();"
    )
    act = """() => page.charts.charts.map((each) => ({
      now: each.now(), data: each.plot.data.slice(1).flat().filter((value) => value !== null),
      low: each.plot.scales.y.min, high: each.plot.scales.y.max,
    }))"""
    for to in ("page.data.inputs[0].position", "page.course.limits[1] - 1e-9", "page.course.limits[1]"):
        window.evaluate(f"page.moveTo({to})")
        settled(window)
        charts = window.evaluate(act)
        assert len(charts) == 11
        for each in charts:
            held = [value for value in (*each["data"], *each["now"]) if value is not None]
            assert each["low"] <= min(held)
            assert max(held) <= each["high"]
    outgrown = window.evaluate("page.moveTo(page.course.limits[1] - 1e-9), " + act.split("=> ", 1)[1])
    assert any(max(each["now"]) > max(each["data"]) for each in outgrown)


def test_at_a_dead_point_the_page_says_so_and_shows_no_number_and_no_arrow(shown):
    window = shown(MODELS["000-P1"])
    window.wait_for_function("() => page.course !== null")
    for box in window.locator("#layers").get_by_role("checkbox").all():
        box.check()
    window.evaluate("page.chosen.toggle('link', 'DC')")
    assert window.locator("#drawing .layers .arrow").count() > 0
    window.evaluate("page.moveTo(3)")
    settled(window)
    assert window.locator("#numbers .why").inner_text() == "Dead point of the input: no velocity."
    assert window.locator(":is(#drawing .layers, #layers .beside) .arrow").count() == 0
    heads = window.locator("#numbers table").last.locator("thead th").all_inner_texts()
    cells = window.locator("#numbers table").last.locator("tbody td:not(.press)").all_inner_texts()
    assert [each.split()[0] for each in heads] == ["link", "angle", "angular", "angular"]
    assert cells[1:] == ["–", "–"]
    assert "dead point of the input: no velocity" in window.locator("#layers").inner_text()
    circle = window.locator("#layers .beside figure", has_text="Circle diagram")
    why = "centres are where two links have one velocity; dead point of the input: no velocity"
    assert why in circle.locator("figcaption").inner_text()
    assert circle.locator("svg").is_hidden()
    window.evaluate("page.moveTo(page.data.inputs[0].position)")
    settled(window)
    assert window.locator("#numbers .why").is_hidden()
    assert window.locator("#drawing .layers .arrow").count() > 0


def test_letters_of_polygons_are_explained_as_on_paper(shown):
    mechanism = MODELS["crank-and-slotted-lever"]
    window = shown(mechanism)
    for box in window.locator("#layers").get_by_role("checkbox").all():
        box.check()
    state = planar.solve(mechanism)
    for polygon in (velocity_polygon(state), acceleration_polygon(state)):
        figure = window.locator("#layers .beside figure", has_text=f"{polygon.kind.capitalize()} polygon")
        told = figure.locator("figcaption").inner_text()
        # what lies below a slide on the frame has an arrow of its own on a page, and no letter
        notes = [note for note in polygon_picture(polygon).notes if ": " in note and "the frame" not in note]
        assert any("a′: the point of lever at A" in note for note in notes)
        for note in notes:
            assert note in told
        assert "a′" in figure.locator("svg").text_content()


# undo


def test_what_was_entered_dragged_and_moved_is_undone_and_redone_by_keys_and_by_buttons(shown):
    mechanism = MODELS["000-P1"]
    window = shown(mechanism)
    (given,) = mechanism.inputs
    undo, redo = (window.get_by_role("button", name=name, exact=True) for name in ("Undo", "Redo"))
    assert undo.is_disabled()
    assert redo.is_disabled()

    def here():
        settled(window)
        return window.evaluate("[Array.from(page.linkage.d), page.input(0), Array.from(page.linkage.z)]")

    stood = [here()]
    length = window.get_by_label("BC: length, number, mm")
    length.fill("70")
    length.press("Enter")
    stood.append(here())
    angle = window.get_by_label(f"{given.pair} (deg)")
    angle.fill("75")
    angle.press("Enter")
    stood.append(here())
    slider = window.get_by_role("slider", name=given.pair, exact=True)
    slider.focus()
    window.keyboard.press("ArrowRight")
    stood.append(here())
    window.get_by_label("Assembly, of 2").select_option(index=0)
    window.get_by_label("Assembly, of 2").select_option(index=1)
    stood += [here()]
    window.keyboard.press("Control+z")
    stood.insert(-1, here())
    angle.focus()  # a number that nobody types at is not the browser's to undo
    for k in (3, 2):
        window.keyboard.press("Control+z")
        assert here() == stood[k]
    assert float(angle.input_value()) == 75.0
    undo.click()
    assert here() == stood[1]
    assert float(length.input_value()) == 70.0
    window.keyboard.press("Control+z")
    assert here() == stood[0]
    assert float(length.input_value()) == 66.0
    assert undo.is_disabled()
    same(window, planar.solve(mechanism))
    for k, key in ((1, "Control+y"), (2, "Control+Shift+Z"), (3, None), (4, "Control+y"), (5, "Control+y")):
        if key:
            window.keyboard.press(key)
        else:
            redo.click()
        assert here() == stood[k]
    assert redo.is_disabled()


def test_a_number_that_is_being_typed_is_the_browsers_to_undo(shown):
    window = shown(MODELS["000-P1"])
    length = window.get_by_label("BC: length, number, mm")
    length.fill("70")
    length.press("Enter")
    settled(window)
    length.press("End")
    length.press_sequentially("5")
    length.press("Control+z")
    settled(window)
    assert window.evaluate("page.linkage.d.some((each) => Math.abs(each - 0.07) < 1e-15)")  # nothing of the mechanism
    length.press("Enter")
    settled(window)
    length.press("Control+z")
    settled(window)
    assert window.evaluate("page.linkage.d.every((each, k) => each === page.data.dimensions[k].value)")


def test_a_whole_drag_and_a_whole_play_are_one_step_each(shown):
    window = shown(MODELS["crank-rocker"])
    start = window.evaluate("page.input(0)")
    window.get_by_role("button", name="Play").click()
    window.wait_for_function("([start]) => Math.abs(page.input(0) - start) > 0.1", arg=[start])
    window.get_by_role("button", name="Undo").click(delay=100)  # ms, in which it plays on; it stops, and goes back
    settled(window)
    assert window.evaluate("[controls.playing, page.input(0)]") == [False, start]
    assert window.get_by_role("button", name="Undo").is_disabled()


# within another page


def test_within_a_frame_that_lets_no_download_through_the_text_is_there_to_be_copied(chromium, tmp_path):
    mechanism = MODELS["crank-rocker"]
    context = chromium.new_context()
    inner = escape(view(mechanism, tmp_path / "page.html").read_text(encoding="utf-8"))
    outer = tmp_path / "outer.html"
    outer.write_text(
        f'<!doctype html><iframe sandbox="allow-scripts" width="1000" height="900" srcdoc="{inner}"></iframe>',
        encoding="utf-8",
    )
    window = context.new_page()
    window.goto(outer.as_uri())
    frame = window.frame_locator("iframe")
    frame.get_by_role("button", name="Save: Mechanism (JSON)").click()
    said = frame.locator("#said").inner_text()
    assert "offered for download" in said
    assert "Saved" not in said
    assert planar.loads(frame.locator("textarea").input_value()) == mechanism
    assert frame.get_by_role("button", name="Copy", exact=True).count() == 1
    context.close()


def outputs(chromium, *cells, scripts=True):
    """A page with outputs as a notebook has them: a window, and what goes wrong in it."""
    context = chromium.new_context(java_script_enabled=scripts)
    window, wrong = context.new_page(), []
    window.on("pageerror", lambda problem: wrong.append(str(problem)))
    window.set_content("<!doctype html>" + "".join(f"<div class='output'>{each}</div>" for each in cells))
    return window, wrong


def cell(mechanism, library):
    return notebook.output_html(mechanism.name, "", still_svg(mechanism), page(mechanism, library=library))


def test_outputs_of_one_notebook_share_the_scripts_of_one_in_any_order(chromium):
    names = ("crank-rocker", "slider-crank", "whitworth")
    cells = [cell(MODELS[name], library=k == 1) for k, name in enumerate(names)]
    window, wrong = outputs(chromium, *cells)
    for k in range(3):
        window.frame_locator(f".output:nth-of-type({k + 1}) iframe").get_by_role("button", name="Play").wait_for()
    # the one that carried them goes, and one that has none comes
    window.evaluate(
        """([html]) => {
          document.querySelectorAll(".output")[1].remove();
          document.querySelectorAll(".output")[0].innerHTML = html;
        }""",
        [cells[2]],
    )
    window.frame_locator(".output:nth-of-type(1) iframe").get_by_role("button", name="Play").wait_for()
    assert wrong == []
    window.context.close()


def test_an_output_whose_scripts_are_gone_stays_a_picture_and_says_what_to_do(chromium):
    mechanism = MODELS["crank-rocker"]
    window, wrong = outputs(chromium, cell(mechanism, library=False))
    frame = window.frame_locator("iframe")
    frame.get_by_text("Run this cell again").wait_for()
    assert frame.locator("#still svg polyline").count() > 3
    window.evaluate(
        "([html]) => { document.body.append(Object.assign(document.createElement('div'), { innerHTML: html })); }",
        [cell(mechanism, library=True)],
    )
    frame.first.get_by_role("button", name="Play").first.wait_for()
    assert wrong == []
    window.context.close()


def test_where_no_script_runs_a_still_picture_and_the_files_words_stand_there(chromium, tmp_path):
    mechanism = MODELS["two-stroke-engine"]
    window, _ = outputs(chromium, cell(mechanism, library=True), scripts=False)
    alone = window.context.new_page()
    alone.goto(view(mechanism, tmp_path / "page.html").as_uri())
    for each in (window.frame_locator("iframe"), alone):
        each.locator("#still svg").wait_for()
        each.get_by_text(mechanism.about).wait_for()
        each.get_by_text("it moves once its scripts run").wait_for()
    window.context.close()


def test_the_still_picture_goes_once_the_mechanism_is_drawn(shown):
    window = shown(MODELS["crank-rocker"])
    assert window.locator("#drawing .bars polyline").count() > 0
    assert window.locator("#still").count() == 0


def test_a_page_by_itself_says_that_a_file_is_offered(shown, tmp_path):
    window = shown(MODELS["crank-rocker"])
    downloaded(window, "Save: Mechanism (JSON)", tmp_path / "saved.json")
    assert window.locator("#said").inner_text() == "Crank-rocker.json is offered for download."
    assert window.locator("textarea").count() == 0


# on paper


def test_a_dark_page_is_printed_light_and_whole(shown, tmp_path):
    window = shown(MODELS["two-stroke-engine"], scheme="dark")
    window.wait_for_function("() => page.charts.charts.length > 0")
    light = shown(MODELS["two-stroke-engine"])
    light.wait_for_function("() => page.charts.charts.length > 0")
    colours = "page.charts.charts.map((each) => [each.plot.series[1].stroke(), each.plot.axes[0].stroke()])"
    assert window.evaluate(colours) != light.evaluate(colours)
    paper = 660  # px: A4 and Letter less their margins
    window.set_viewport_size({"width": paper, "height": 900})
    window.emulate_media(media="print", color_scheme="dark")
    window.evaluate("dispatchEvent(new Event('beforeprint'))")
    settled(window)
    style = (
        "Object.fromEntries(['backgroundColor', 'color'].map((each) => [each, getComputedStyle(document.body)[each]]))"
    )
    assert window.evaluate(style) == light.evaluate(style)
    assert window.evaluate(colours) == light.evaluate(colours)
    assert window.evaluate("document.documentElement.scrollWidth") <= paper
    outside = window.evaluate(
        """() => {
          const box = (each) => each.getBoundingClientRect(), whole = box(document.getElementById("drawing"));
          const parts = document.querySelectorAll("#drawing .bars polyline, #drawing .letters text");
          const out = (each) => each.left < whole.left || each.right > whole.right
            || each.top < whole.top || each.bottom > whole.bottom;
          return { count: parts.length, out: Array.from(parts).filter((each) => out(box(each))).length };
        }"""
    )
    assert outside["count"] > 4
    assert outside["out"] == 0
    for seen in ("h1", "#numbers table", ".charts figure", "#notes"):
        assert window.locator(seen).first.is_visible()
    for unseen in ("#controls button", "#layers .choices", "#saving", "#numbers select"):
        assert not window.locator(unseen).first.is_visible()
    window.emulate_media(media="screen", color_scheme="dark")
    window.evaluate("dispatchEvent(new Event('afterprint'))")
    assert window.evaluate(colours) != light.evaluate(colours)
