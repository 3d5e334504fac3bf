"""Pages without a browser: what the file holds, texts that would do harm, and its scripts' numbers beside Python's."""

from __future__ import annotations

import csv
import io
import json
import re
import sys
from base64 import b64decode
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import planar
from planar.document.dimensions import change_dimension, link_lengths
from planar.document.files import read_asset
from planar.foundation.errors import BadInput, NoAnswer
from planar.pages import gallery, notebook
from planar.pages.data.page_data import page_data
from planar.pages.gallery_kinds import KINDS, kind_and_search_text, search_text
from planar.pages.page import SCRIPTS, fill_template, page, script_safe_json
from planar.pages.still_picture import still_svg
from planar.pages.view import notebook_html, page_of, view
from planar.reports.columns import run_columns
from planar.reports.files.run_formats import encode_run
from planar.solving.position import solved_mechanism
from tests import command
from tests.builders import triangle
from tests.draws import part
from tests.hostile import HARMFUL, HARMFUL_LINE, harmful_mechanism
from tests.known import MODELS
from tests.page_scripts import PAGE_STEMS, SLOW_PAGE, in_node, needs_node

LARGEST = 1_500_000
SOME = {stem: MODELS[stem] for stem in PAGE_STEMS}
SOME["four-bar in other units"] = replace(MODELS["four-bar"], units=MODELS[SLOW_PAGE].units)
"""Models of every kind, for what takes long for each."""
LIVE = {
    stem: each
    for stem, each in SOME.items()
    if each.closes_within is None and all(pair.measures_symbols for pair in each.pairs)
}
"""Those whose pages move with other dimensions."""
CLOSE = 1e-12
"""Of the size, or of the greatest rate of a kind."""


class Elements(HTMLParser):
    """The elements of a page, and the text of those that hold scripts and data."""

    def __init__(self, text: str):
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[int, str] = {}
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        if self.tags:
            self.texts[len(self.tags) - 1] = self.texts.get(len(self.tags) - 1, "") + data

    def data(self):
        at = next(k for k, (tag, attributes) in enumerate(self.tags) if attributes.get("id") == "data")
        return json.loads(self.texts[at])


def addresses(text: str) -> set[str]:
    """Addresses in a network that a text names, but for namespaces and the bundled library's licence."""
    text = re.sub(r"/\*! https://github\.com/leeoniya/uPlot.*?\*/", "", text)
    return {each for each in re.findall(r"(?:https?:)?//[\w.-]+\.\w+/[^\s\"'`)]*", text) if "www.w3.org/" not in each}


# what a page holds


@pytest.mark.parametrize("stem", PAGE_STEMS)
def test_the_page_of_every_model_is_one_small_file_that_needs_no_network(stem):
    text = page(MODELS[stem])
    assert len(text.encode()) < LARGEST
    assert addresses(text) == set()
    elements = Elements(text)
    assert not {tag for tag, _ in elements.tags} & {"link", "iframe", "object", "embed", "base", "form"}
    assert not any("src" in attributes or "href" in attributes for _, attributes in elements.tags)
    assert elements.data()["name"] == MODELS[stem].name


def test_a_page_may_load_nothing():
    (policy,) = (
        attributes["content"]
        for _, attributes in Elements(page(MODELS["four-bar"])).tags
        if attributes.get("http-equiv") == "Content-Security-Policy"
    )
    assert policy.startswith("default-src 'none';")
    assert "unsafe-eval" not in policy


def test_texts_of_a_file_stay_texts():
    value = planar.to_dict(planar.load("four-bar")) | {"about": "a", "source": "s", "notes": ["n"]}
    plain, harmful = Elements(page(planar.from_dict(value))), Elements(page(harmful_mechanism()))
    assert [tag for tag, _ in harmful.tags] == [tag for tag, _ in plain.tags]
    assert (harmful.data()["name"], harmful.data()["about"]) == (HARMFUL_LINE, HARMFUL)
    assert harmful.data()["document"]["value"]["notes"] == [HARMFUL]
    title = next(k for k, (tag, _) in enumerate(harmful.tags) if tag == "title")
    assert harmful.texts[title].rstrip("\n") == HARMFUL_LINE
    texts = [text.rstrip("\n") for text in harmful.texts.values()]
    assert texts.count(HARMFUL_LINE) == texts.count(HARMFUL) == 2  # title and heading, about and note
    assert f"Source: {HARMFUL}" in texts


def test_about_source_and_notes_of_the_file_stand_on_the_page_without_scripts():
    mechanism = MODELS["two-stroke-engine"]
    texts = {text.rstrip("\n") for text in Elements(page(mechanism)).texts.values()}
    assert mechanism.about in texts
    assert f"Source: {mechanism.source}" in texts
    assert len(mechanism.notes) == 2
    assert set(mechanism.notes) <= texts
    bare = replace(mechanism, about="", source="", notes=())
    assert not {"notes", "source"} & {part for _, each in Elements(page(bare)).tags for part in each.values()}


def test_texts_in_a_template_are_not_filled_again():
    assert fill_template("{a}{b}", {"a": "{b}", "b": "2"}) == "{b}2"
    assert json.loads(script_safe_json({"x": HARMFUL})) == {"x": HARMFUL}
    assert not set(script_safe_json(HARMFUL)) & set("<\u2028\u2029")


def test_no_script_of_ours_makes_elements_or_programs_of_texts():
    for name in {*SCRIPTS, *gallery.SCRIPTS}:
        if name.startswith("uplot/"):
            continue
        text = read_asset(name)
        assert not re.findall(
            r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function|fetch\(", text
        )
        assert text.startswith('"use strict";\n/*')
        assert len(text.splitlines()) < 420


@pytest.mark.parametrize("scripts", [SCRIPTS, gallery.SCRIPTS], ids=["page", "gallery"])
def test_no_two_scripts_of_a_page_give_one_name_to_two_things(scripts):
    named = [
        name
        for script in scripts
        for name in re.findall(
            r"^(?:async )?(?:const|let|var|class|function\*?) (\w+)", read_asset(script), re.MULTILINE
        )
    ]
    assert sorted(named) == sorted(set(named))


# what Python shows as a page


@cache
def results() -> dict[str, Any]:
    """One of everything that a notebook shows."""
    mechanism = planar.load("two-stroke-engine")
    state, motion = planar.solve(mechanism), planar.cycle(mechanism, 12)
    return {
        "mechanism": mechanism,
        "state": state,
        "motion": motion,
        "forces": planar.forces(state),
        "forces over": planar.forces(motion),
        "centres": planar.centres(state),
        "modes": planar.modes(mechanism, certify=False),
        "circuits": planar.circuits(mechanism),
    }


def test_everything_shows_itself_in_a_notebook_as_a_table_a_picture_and_a_page():
    layers = {"forces": ["paths", "forces"], "forces over": ["paths", "forces"], "centres": ["centres"]}
    tables = {"forces": 4, "forces over": 2, "centres": 1, "modes": 2, "circuits": 2}
    for kind, each in results().items():
        elements = Elements(each._repr_html_())
        (frame,) = (attributes for tag, attributes in elements.tags if tag == "iframe")
        inner = Elements(frame["srcdoc"])
        assert inner.data()["name"] == frame["title"] == "Two-stroke engine"
        # what is left where a notebook is not trusted: neither frames nor scripts
        assert not {"script", "svg", "style"} & {tag for tag, _ in elements.tags}
        (image,) = (attributes for tag, attributes in elements.tags if tag == "img")
        head, code = image["src"].split(",")
        assert head == "data:image/svg+xml;base64"
        picture = ElementTree.fromstring(b64decode(code))
        letters = {text.text for text in picture.iter("{http://www.w3.org/2000/svg}text")}
        assert letters >= set(results()["state"].point_names)
        assert sum(tag == "table" for tag, _ in elements.tags) == tables.get(kind, 0), kind
        assert inner.data()["layers"] == layers.get(kind, ["paths"])


def test_the_still_picture_is_to_scale_and_needs_no_drawing_library(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    mechanism = planar.load("four-bar")
    state = planar.solve(mechanism)
    root = ElementTree.fromstring(still_svg(mechanism))
    svg = "{http://www.w3.org/2000/svg}"
    pins = {tuple(float(each.get(part)) for part in ("cx", "cy")) for each in root.iter(f"{svg}circle")}
    left, top, width, height = map(float, root.get("viewBox").split())
    assert all(left < x < left + width and top < y < top + height for x, y in pins)
    scale = 1000.0  # millimetres of paper in a metre: 1 to 1, as `planar plot four-bar scheme` has it
    for name in "ABCDEFG":
        x, y = state.point(name).position
        assert min(np.hypot(cx - scale * x, cy + scale * y) for cx, cy in pins) < 0.01
    boxes = []
    for text in root.iter(f"{svg}text"):
        size = float(text.get("font-size"))
        x, y, half = float(text.get("x")), float(text.get("y")), 0.3 * size * len(text.text)
        boxes.append((x - half, y - 0.7 * size, x + half, y))
    for k, a in enumerate(boxes):
        for b in boxes[:k]:
            assert a[2] < b[0] or b[2] < a[0] or a[3] < b[1] or b[3] < a[1]


def test_tables_in_a_notebook_have_the_numbers_of_the_results_and_escaped_names():
    forces = results()["forces"]
    cells = {text.strip() for text in Elements(forces._repr_html_()).texts.values()}
    assert f"{forces.inputs['O']:.6g}" in {cell.replace("\u2212", "-") for cell in cells}
    harmful = planar.centres(planar.solve(harmful_mechanism()))
    assert not {"script"} & {tag for tag, _ in Elements(harmful._repr_html_()).tags}


def test_everything_says_what_it_is_in_one_line():
    for each in results().values():
        line = repr(each)
        assert "Two-stroke engine" in line
        assert "\n" not in line
        assert len(line) < 140
    assert repr(results()["state"]) == "<State of 'Two-stroke engine' at O = 40 deg>"


class Shell:
    """A kernel's shell, in a run of a cell."""

    kernel = None

    def __init__(self):
        self.cell, self.run = None, 0

    def get_parent(self):
        return {"metadata": {"cellId": self.cell} if self.cell else {}, "header": {"msg_id": self.run}}


def test_one_output_of_a_notebook_carries_the_scripts_and_a_cell_that_is_run_again_does(monkeypatch):
    shell = Shell()
    monkeypatch.setattr(notebook, "_runs_by_cell", {})
    monkeypatch.setattr(notebook, "_jupyter_shell", lambda: shell)
    found = []
    for run, cell in enumerate(["a", "a", "b", "c", "b", "a"]):
        shell.cell, shell.run = cell, run if run != 1 else 0  # the first cell shows two
        found.append(notebook.must_carry_scripts())
    assert found == [True, False, False, False, True, True]
    monkeypatch.setattr(notebook, "_runs_by_cell", {})
    shell.cell = None  # nothing is known of the cells
    assert [notebook.must_carry_scripts() for _ in range(3)] == [True, False, False]
    monkeypatch.setattr(notebook, "_jupyter_shell", lambda: None)
    assert [notebook.must_carry_scripts() for _ in range(2)] == [True, True]


def test_an_output_that_shares_the_scripts_is_a_fraction_of_one_that_carries_them():
    mechanism = planar.load("four-bar")
    alone, carrying, sharing = (len(page(mechanism, library=each)) for each in (None, True, False))
    assert carrying < 0.6 * alone
    assert sharing < 0.15 * alone


def test_the_page_of_a_position_stands_at_that_assembly_also_where_the_sketch_means_another():
    mechanism = planar.load("four-bar")
    other = next(
        mode for mode in planar.modes(mechanism, certify=False) if mode.number != planar.modes(mechanism).nearest.number
    )
    state = replace(planar.solve(other.mechanism), mechanism=mechanism)
    assert np.abs(np.array(Elements(page_of(state)).data()["z"]) - other.z).max() < CLOSE


def test_the_page_of_a_motion_keeps_its_range_and_stands_on_one_of_its_rows():
    mechanism = planar.load("crank-rocker")
    (given,) = mechanism.inputs
    motion = planar.cycle(mechanism, 10, given.position + 1.0, given.position + 2.0)
    data = Elements(page_of(motion)).data()
    assert data["window"] == {"running": 0, "low": given.position + 1.0, "high": given.position + 2.0}
    assert data["inputs"][0]["position"] == pytest.approx(given.position + 1.0, abs=CLOSE)
    there = solved_mechanism(planar.solve(mechanism, {given.pair: given.position + 1.0}).mechanism).solver
    z = np.array(data["z"])
    assert there.max_residuals(z[None], there.inputs.u[None])[0] < there.tolerance


def test_a_mechanism_without_a_position_shows_its_text():
    mechanism = triangle(200)
    assert notebook_html(mechanism) is None
    with pytest.raises(NoAnswer):
        view(mechanism, "never.html")


def test_view_writes_where_it_is_told_or_opens_a_browser(tmp_path, monkeypatch):
    mechanism, shown = planar.load("four-bar"), []
    assert planar.view(mechanism, tmp_path / "a.html").read_text(encoding="utf-8") == page(mechanism)
    monkeypatch.setattr("webbrowser.open_new_tab", shown.append)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    path = planar.view(mechanism)
    assert shown == [path.as_uri()]
    assert path.read_text(encoding="utf-8") == page(mechanism)
    with pytest.raises(BadInput, match="a Mechanism, a State or a Motion"):
        planar.view(3)


def test_the_view_command_writes_a_page_at_a_position_and_of_an_assembly(tmp_path):
    (tmp_path / "m.json").write_text(planar.dumps(planar.load("crank-rocker")), encoding="utf-8")
    (given,) = planar.load("crank-rocker").inputs
    assert command.run(tmp_path, "view", "m.json", "-o", "a.html").done() == "a.html\n"
    command.run(tmp_path, "view", "m.json", "-o", "b.html", "--mode", "2", "--at", f"{given.pair}=80deg").done()
    first, second = (Elements((tmp_path / name).read_text(encoding="utf-8")).data() for name in ("a.html", "b.html"))
    assert second["inputs"][0]["position"] == pytest.approx(np.radians(80.0))
    other = planar.solve(list(planar.modes(planar.load("crank-rocker")))[1].mechanism, {given.pair: np.radians(80.0)})
    solver = solved_mechanism(other.mechanism).solver
    wanted = solver.coordinates(other.frames, other.own)[list(solver.equations.unknowns)]
    assert np.abs(np.sin(np.subtract(second["z"], wanted))).max() < CLOSE
    assert first["z"] != second["z"]


def test_the_view_command_refuses_other_files_and_its_own(tmp_path):
    (tmp_path / "m.html").write_text(planar.dumps(planar.load("crank-rocker")), encoding="utf-8")
    assert "own file" in command.run(tmp_path, "view", "m.html", "-o", "m.html").refused(2)
    assert ".html" in command.run(tmp_path, "view", "crank-rocker", "-o", "a.pdf").refused(2)


# the gallery


def test_a_gallery_has_a_page_for_each_and_an_index_that_moves(tmp_path):
    told_of = []
    models = [
        ("../<b>.x", harmful_mechanism()),
        ("index", planar.load("slider-crank")),
        ("INDEX", planar.load("rack-steering")),
        ("apart", triangle(200)),
    ]
    index, refused = gallery.write_gallery(models, tmp_path / "new" / "folder", lambda *done: told_of.append(done))
    assert told_of == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert [name for name, _ in refused] == ["apart"]
    names = {path.name for path in index.parent.iterdir()}
    assert names == {"index.html", "b-.x.html", "index-2.html", "INDEX-3.html"}
    elements = Elements(index.read_text(encoding="utf-8"))
    first, second, third = elements.data()
    assert {each["href"] for each in (first, second, third)} <= names
    assert (first["name"], first["about"]) == (HARMFUL_LINE, HARMFUL)
    assert [tag for tag, _ in elements.tags].count("script") == 2
    listed = [each["href"] for tag, each in elements.tags if tag == "a" and each["href"].endswith(".html")]
    assert listed == [each["href"] for each in (first, second, third)]  # also without scripts
    for name in names - {"index.html"}:
        links = [each for tag, each in Elements((index.parent / name).read_text(encoding="utf-8")).tags if tag == "a"]
        assert [each["href"] for each in links] == ["index.html"]
    assert (second["closed"], third["closed"]) == (True, False)


def test_the_gallery_command_writes_a_folder_and_tells_what_it_leaves_out(tmp_path):
    (tmp_path / "apart.json").write_text(planar.dumps(triangle(200)), encoding="utf-8")
    done = command.run(tmp_path, "gallery", "four-bar", "apart.json", "-o", "pages")
    assert done.status == 0
    assert done.out == str(Path("pages") / "index.html") + "\n"
    assert done.err.startswith("planar: apart: ")
    assert {path.name for path in (tmp_path / "pages").iterdir()} == {"index.html", "four-bar.html"}
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert "file" in command.run(tmp_path, "gallery", "four-bar", "-o", "file/folder").refused(2)


def test_the_index_is_small_and_its_links_are_where_the_motion_has_them():
    shown = [gallery.small_picture_data(mechanism) for mechanism in SOME.values()]
    drawing = len(gallery.index_page([]).encode())
    each = (
        len(
            gallery.index_page(
                [one | {"name": "", "about": "", "href": "", "kind": KINDS[0], "words": ""} for one in shown]
            ).encode()
        )
        - drawing
    )
    assert drawing + each / len(SOME) * len(MODELS) < 2 * LARGEST
    mechanism = MODELS["crank-rocker"]
    small = gallery.small_picture_data(mechanism)
    motion = planar.cycle(mechanism, gallery.PICTURE_STEPS)
    moving = [link for link in small["links"] if link != mechanism.frame]
    for link, path in zip(moving, small["frames"], strict=True):
        frame = motion.frames[link]
        wanted = np.stack([part.parts[0] for part in (frame.x, frame.y, frame.angle)], axis=1)
        assert np.abs(np.reshape(path, (-1, 3)) - wanted).max() < 1e-4 * max(1.0, np.abs(wanted).max())


@pytest.mark.parametrize(
    "text",
    ["four-bar", "4-bar", "4 bar", "4bar", "Four Bar", "fourbar", "FOUR\u2010BAR", "  four  bar ", "4\u2013bar's"],
)
def test_a_name_is_found_however_it_is_written(text):
    assert search_text(text).startswith("four bar")
    assert search_text("Hoecken's 12 links é") == "hoeckens twelve links e"


def test_a_mechanism_is_of_a_kind_that_its_structure_tells():
    wanted = {
        "drag-link": "Four-bar linkages",
        "hand-pump": "Slider-cranks and their inversions",
        "oldham": "Double slider-cranks",
        "klann-leg": "Six-bar linkages",
        "jansen-leg": "Linkages of eight links and more",
        "belt-arm": "Gears, belts and racks",
        "rack-steering": "Gears, belts and racks",
        "open-arm": "Open chains",
        "pantograph": "Other linkages",
    }
    assert {stem: kind_and_search_text(MODELS[stem], stem)[0] for stem in wanted} == wanted
    assert set(wanted.values()) == set(KINDS)


# numbers


def near(found, wanted, scale):
    assert np.abs(np.subtract(found, wanted)).max() <= CLOSE * scale


@needs_node
def test_pages_of_models_solve_as_python_does():
    """At the file's position and one beside it: places, velocities and accelerations of all points."""
    act = """
    const told = () => page.data.names.map((name) => Object.values(page.point(name)));
    const found = [[page.input(0), told()]], start = page.input(0);
    const far = page.data.inputs[0].slides ? 0.05 * page.data.size : 0.2;
    for (const to of [start + far, start - far]) {
      if (found.length < 2 && page.moveTo(to, 0)) found.push([to, told()]);
    }
    return found;
    """
    compared, some = 0, {stem: MODELS[stem] for stem in PAGE_STEMS}
    for stem, positions in in_node(some, act).items():
        mechanism = MODELS[stem]
        given = mechanism.inputs[0]
        for to, points in positions:
            try:
                state = planar.solve(mechanism, {given.pair: to} if to != given.position else {})
            except NoAnswer:
                continue  # a dead point, or a change point, where the page does not stop
            if any(part is None for point in points for part in point):
                continue
            wanted = np.array([[p.position, p.velocity, p.acceleration] for p in state.points.values()])
            found = np.array(points)
            size = max(1e-3, np.abs(wanted[:, 0]).max())
            for order in range(3):
                scale = max(np.abs(wanted[:, order]).max(), size)
                assert np.abs(found[:, order] - wanted[:, order]).max() <= CLOSE * scale, (stem, to, order)
            compared += 1
    assert compared > 1.7 * len(some)


@needs_node
def test_a_changed_mechanism_is_saved_as_a_file_that_planar_solves_to_the_same():
    """One dimension after the other by some per cent, and the input moved: the saved file, solved from nothing."""
    act = """
    const d = page.linkage.d.map((each, k) => (page.data.dimensions[k].held ? each : each * (1 + 0.01 * (1 + k % 3))));
    const { reached } = page.changeTo(d);
    page.moveTo(page.input(0) + (page.data.inputs[0].slides ? 0.01 * page.data.size : 0.05), 0);
    return { reached, d: Array.from(page.linkage.d), u: page.input(0), file: Files.mechanism(page),
      points: page.data.names.map((name) => page.point(name).position) };
    """
    whole = 0
    for stem, found in in_node(LIVE, act).items():
        saved = planar.from_dict(found["file"])
        links = frozenset(link.name for link in saved.links)
        assert [each.value for each in link_lengths(saved, links)] == found["d"], stem
        assert saved.inputs[0].position == found["u"]
        try:
            state = planar.solve(saved)
        except NoAnswer:
            continue
        wanted = np.array([state.point(name).position for name in state.point_names])
        apart = np.abs(np.array(found["points"]) - wanted).max()
        assert apart < 1e-9 * max(1e-3, np.abs(wanted).max()), stem
        whole += found["reached"] == 1
    assert whole > 0.8 * len(LIVE)


@needs_node
def test_a_mechanism_that_is_not_changed_is_saved_as_it_came():
    for stem, found in in_node(SOME, "return Files.mechanism(page);").items():
        assert planar.from_dict(found) == SOME[stem]


@pytest.mark.parametrize("stem", ["planetary-gear-set", "cartwright", "sun-and-planet", "belt-arm", "crank-rocker"])
def test_a_dimension_is_held_where_a_pair_would_refuse_the_file_with_another(stem):
    mechanism = MODELS[stem]
    links = frozenset(link.name for link in mechanism.links)
    for each, told_of in zip(link_lengths(mechanism, links), page_data(mechanism)[0]["dimensions"], strict=True):
        refused = 0
        for end in ("low", "high"):
            other = change_dimension(mechanism, each, each.value + 0.02 * (told_of[end] - each.value))
            try:
                planar.loads(planar.dumps(other))
            except BadInput as problem:
                refused += 1
                assert "wheels" in problem.sentence
        assert bool(refused) == bool(told_of["held"])


@needs_node
def test_the_page_of_a_motion_runs_over_its_range():
    mechanism = MODELS["crank-rocker"]
    window = {"running": 0, "low": mechanism.inputs[0].position + 0.5, "high": mechanism.inputs[0].position + 1.25}
    act = f"""
    page.data.window = {json.dumps(window)};
    page.moveTo(page.data.window.low + 0.1);
    new Courses(page);
    while (!page.course) await new Promise((go) => setTimeout(go, 5));
    return [page.course.inputs[0], page.course.inputs[page.course.count - 1], page.course.whole];
    """
    low, high, whole = in_node({"motion": mechanism}, act, "solve/course.js")["motion"]
    assert (low, high) == pytest.approx((window["low"], window["high"]))
    assert not whole


@needs_node
def test_a_dimension_stops_where_the_linkage_comes_apart():
    """A triangle of two links on a line of centres: they part where the base is as long as both together."""
    act = """
    const k = page.data.dimensions.findIndex((each) => each.name === "base.length"), d = Array.from(page.linkage.d);
    d[k] = 0.2;
    const up = page.changeTo(d).reached, high = page.linkage.d[k];
    d[k] = 0.001;
    const down = page.changeTo(d).reached, low = page.linkage.d[k];
    d[k] = 0.1;
    const back = page.changeTo(d).reached;
    return { up, high, down, low, back, C: page.point("C").position };
    """
    found = in_node({"triangle": triangle(100)}, act)["triangle"]
    assert found["up"] < 1.0
    assert found["down"] < 1.0
    assert found["back"] == 1.0
    assert found["high"] == pytest.approx(0.15, rel=1e-5)
    assert found["low"] == pytest.approx(0.01, rel=1e-3)
    near(found["C"], planar.solve(triangle(100)).point("C").position, 0.1)


@needs_node
@pytest.mark.parametrize(
    "stem", ["crank-rocker", "000-P2", "double-rocker", "planetary-gear-set", *part(["walschaerts-valve-gear"], 2, 1)]
)
def test_the_motion_is_saved_with_the_columns_and_numbers_of_the_cycle_command(stem):
    act = """
    new Courses(page);
    while (!page.course) await new Promise((go) => setTimeout(go, 5));
    return [page.course.inputs[0], page.course.inputs[page.course.count - 1], page.course.count, Files.motion(page)];
    """
    low, high, count, text = in_node({stem: MODELS[stem]}, act, "solve/course.js")[stem]
    mechanism = MODELS[stem]
    motion = planar.cycle(mechanism, count - 1, low, high, mechanism.inputs[0].pair)
    heads, *rows = csv.reader(io.StringIO(text))
    wanted = {column.head: column.values for column in run_columns(motion)}
    assert heads == list(wanted)
    table = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows])
    calm = slice(count // 10, -(count // 10))
    for told, (head, values) in zip(table.T, wanted.items(), strict=True):
        is_half_turn = head.endswith("[deg]") and abs(abs(values[0]) - 180.0) < 1e-9  # told by either sign
        found = told - 360.0 * np.round((told[0] - values[0]) / 360.0) if is_half_turn else told
        scale = np.abs(values[calm]).max() or 1.0
        assert np.abs(found[: len(values)][calm] - values[calm]).max() < 1e-8 * max(scale, 1e-3), head


@needs_node
def test_heads_that_spreadsheets_would_take_for_formulas_are_marked_as_texts_as_by_the_cycle_command():
    value = planar.to_dict(MODELS["crank-rocker"])
    crank = next(link for link in value["links"].values() if "ends" in link)
    crank["points"] = crank.get("points", {}) | {"=A1+1": {"along": crank["ends"], "distance": 1}}
    mechanism = planar.from_dict(value)
    act = """
    new Courses(page);
    while (!page.course) await new Promise((go) => setTimeout(go, 5));
    return Files.motion(page).split("\\n")[0];
    """
    heads = in_node({"formula": mechanism}, act, "solve/course.js")["formula"]
    assert heads == encode_run(planar.cycle(mechanism, 2), ".csv").decode().split("\n")[0]
    assert "'=A1+1 x [" in heads


@needs_node
def test_the_range_of_the_input_is_that_of_the_cycle_command():
    """Hart's A-frame passes a change point at the very angle where a turn begins."""
    act = """
    new Courses(page);
    while (!page.course) await new Promise((go) => setTimeout(go, 1));
    return page.course.limits;
    """
    free = {"davis-steering", "rack-differential", "rapsons-slide", "rolling-wheel"}  # slides without limits
    some = {stem: each for stem, each in part(MODELS.items(), 11, 1) if each.inputs and stem not in free}
    for stem, limits in in_node(some | {"hart-a-frame": MODELS["hart-a-frame"]}, act, "solve/course.js").items():
        mechanism = MODELS[stem]
        positions = planar.cycle(mechanism, 4, pair=mechanism.inputs[0].pair)
        wanted = positions.inputs[mechanism.inputs[0].pair].position
        if limits is None:
            assert np.ptp(wanted) == pytest.approx(2.0 * np.pi), stem
        else:
            assert limits == pytest.approx([wanted.min(), wanted.max()], abs=1e-12), stem


@needs_node
@pytest.mark.parametrize("stem", ["000-P1", "hart-inversor", "elliptical-trammel", "excavator-arm"])
def test_at_its_limits_a_page_has_no_rates_as_the_cycle_command_has_none(stem):
    """Also where two groups of links turn back at once; beside a limit there are rates; back is its branch."""
    act = """
    const start = page.input(0), far = page.data.inputs[0].slides ? 4 * page.data.size : 2 * Math.PI, found = [];
    const places = () => page.data.names.map((name) => page.point(name).position), first = places();
    for (const sense of [-1, 1]) {
      const there = page.moveTo(start + sense * far, 0), at = page.input(0), { w1, w2, why } = page.state;
      const points = page.data.names.map((name) => page.point(name).velocity);
      const none = [w1, w2, ...points].every((each) => each === null), told = page.undetermined;
      page.moveTo(start, 0);
      found.push({ there, at, none, why, told, back: places() });
      page.moveTo(at + 1e-7 * far * -sense, 0);
      found[found.length - 1].beside = page.state.w1 !== null;
      page.moveTo(start, 0);
    }
    return { found, first };
    """
    mechanism = MODELS[stem]
    (given, *_) = mechanism.inputs
    motion = planar.cycle(mechanism, 4, pair=given.pair)
    places = motion.inputs[given.pair].position
    page_of_it = in_node({stem: mechanism}, act)[stem]
    scale = solved_mechanism(mechanism).solver.unit
    for found, row in zip(page_of_it["found"], (np.argmin(places), np.argmax(places)), strict=True):
        rates = [point.velocity[row] for point in motion.points.values()]
        assert np.isnan(rates).any()
        assert not found["there"]
        assert found["at"] == pytest.approx(places[row], abs=CLOSE)
        assert found["none"]
        assert found["why"] == "dead point"
        assert found["told"] in ("dead point of the input: no velocity", "dead point of the inputs: no velocity")
        assert found["beside"]
        near(found["back"], page_of_it["first"], scale)


@needs_node
@pytest.mark.parametrize("stem", ["000-P1", "umbrella", "hart-inversor"])
def test_from_a_limit_it_comes_back_on_its_branch_however_it_came_there(stem):
    """To the limit's own number, beyond it, there again while it stands there, and back by steps of all lengths."""
    act = """
    const start = page.input(0), scale = page.linkage.scale[0];
    const places = () => page.data.names.map((name) => page.point(name).position), first = places(), found = [];
    for (const sense of [-1, 1]) {
      page.moveTo(start + sense * 7 * scale);
      const limit = page.input(0);
      for (const by of [0.3, 0.01, 1e-4, 1e-7]) {
        for (const again of [0, 1, 3]) {
          page.moveTo(limit - 0.03 * sense * scale);
          const there = page.moveTo(limit), why = page.state.why;
          for (let k = 0; k < again; k++) page.moveTo(limit + (k % 2 ? sense * scale : 0));
          page.moveTo(limit - by * sense * scale);
          page.moveTo(start);
          found.push([there, why, places()]);
        }
      }
    }
    return { first, found };
    """
    found = in_node({stem: MODELS[stem]}, act)[stem]
    assert len(found["found"]) == 24
    for there, why, places in found["found"]:
        assert there
        assert why == "dead point"
        near(places, found["first"], solved_mechanism(MODELS[stem]).solver.unit)


@needs_node
def test_what_is_singular_on_a_page_is_so_in_python():
    """The least singular value of every group, at the file's position and one beside it, by both."""
    act = """
    page.moveTo(page.input(0) + (page.data.inputs[0].slides ? 0.02 * page.data.size : 0.1), 0);
    const { linkage } = page, { slope } = linkage.closure(linkage.z, linkage.u), { F: rows } = page.data.counts;
    const { by, least } = slopeScales(linkage);
    const strengths = page.data.stages.map(({ z: [a, b], F: [c, d] }) => {
      const columns = [];
      for (let j = a; j < b; j++) {
        const column = Array.from({ length: d - c }, (_, i) => slope[j * rows + c + i] / by[c + i]);
        const size = Math.max(Math.hypot(...column), least[j]);
        columns.push(column.map((each) => each / size));
      }
      const values = singularValues(columns);
      return b > a ? Math.min(...values) / Math.max(1, ...values) : 1;
    });
    return { z: Array.from(linkage.z), u: Array.from(linkage.u), strengths };
    """
    some = {stem: each for stem, each in SOME.items() if each.inputs}
    for stem, found in in_node(some, act).items():
        solver = solved_mechanism(some[stem]).solver
        z, u = np.array(found["z"]), np.array(found["u"])
        assert found["strengths"] == pytest.approx(solver.block_regularity(z, u), rel=1e-9, abs=1e-12), stem


@needs_node
def test_a_file_that_stands_at_a_dead_point_can_be_moved_off_it():
    """On a base of 4 a crank of 3, coupler and rocker of 1.5: these in line where the crank is at arccos(2/3)."""
    value = planar.to_dict(triangle(100))
    value["links"] = {
        name: {"ends": list(ends), "length": length}
        for name, ends, length in [
            ("base", "AB", 400),
            ("crank", "AC", 300),
            ("coupler", "CD", 150),
            ("rocker", "BD", 150),
        ]
    }
    dead = np.arccos(2.0 / 3.0)
    value |= {"pairs": [{"turning": pin} for pin in "ABCD"], "sketch": {"C": [200, 220], "D": [300, 110]}}
    value["inputs"] = [{"pair": "A", "position": f"{float(dead)!r} rad"}]
    act = """
    const beyond = page.moveTo(page.input(0) + 0.2), stood = page.input(0), back = page.moveTo(page.input(0) - 0.2);
    const points = page.data.names.map((name) => [name, page.point(name).position]);
    return { beyond, stood, back, at: page.input(0), points };
    """
    mechanism = planar.from_dict(value)
    found = in_node({"dead": mechanism}, act)["dead"]
    assert (found["beyond"], found["back"]) == (False, True)
    assert found["stood"] == pytest.approx(dead, abs=CLOSE)
    assert found["at"] == pytest.approx(dead - 0.2, abs=1e-5)
    value["inputs"][0]["position"] = f"{found['at']!r} rad"
    sketch = {name: [1000.0 * part for part in position] for name, position in found["points"]}
    state = planar.solve(planar.from_dict(value | {"sketch": sketch}))
    near([at for _, at in found["points"]], [state.point(name).position for name, _ in found["points"]], 0.4)


@needs_node
def test_other_dimensions_give_pythons_numbers():
    """Each dimension of a linkage alone, by a tenth: every point, beside Python's solution of the changed mechanism."""
    stem = "watt-six-bar"
    mechanism = MODELS[stem]
    act = """
    const found = [], own = Array.from(page.linkage.d);
    for (let k = 0; k < own.length; k++) {
      const d = own.map((each, i) => (i === k ? 1.1 * each : each));
      found.push([page.changeTo(d).reached, page.data.names.map((name) => page.point(name).position)]);
      page.changeTo(own);
    }
    return found;
    """
    links = frozenset(link.name for link in mechanism.links)
    for each, (reached, points) in zip(
        link_lengths(mechanism, links), in_node({stem: mechanism}, act)[stem], strict=True
    ):
        other = change_dimension(mechanism, each, 1.1 * each.value)
        assert reached == 1
        sketch = tuple((name, *at) for name, at in zip(planar.solve(mechanism).point_names, points, strict=True))
        state = planar.solve(replace(other, sketch=sketch))
        wanted = np.array([state.point(name).position for name in state.point_names])
        near(points, wanted, np.abs(wanted).max())
